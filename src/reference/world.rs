//! Every primitive of a scene and a bounding-volume hierarchy over them.

use glam::DVec3;

use super::primitive::{Ray, Surface, SurfacePoint};
use crate::scene::{Object, Shape};

/// A surface that belongs to `Scene::objects[object]`.
pub struct Primitive {
    pub surface: Surface,
    pub object: usize,
    /// Index into a mesh's triangles; 0 of other shapes.
    pub triangle: usize,
    /// How far rays start off this surface, in metres: about 4,500 ulp of its largest coordinate, which is well above
    /// the rounding error of a projected point and well below any gap that f64 geometry can mean.
    offset: f64,
}

/// Where a ray ends.
pub struct Hit {
    /// Distance in metres.
    pub t: f64,
    /// Index into [`World::primitives`].
    pub primitive: usize,
    pub point: SurfacePoint,
}

/// Inner nodes hold two children, leaves a range of `World::order`.
enum Node {
    Inner { bounds: [DVec3; 2], children: [usize; 2] },
    Leaf { bounds: [DVec3; 2], range: std::ops::Range<usize> },
}

pub struct World {
    pub primitives: Vec<Primitive>,
    /// Primitive indices, grouped by leaf.
    order: Vec<usize>,
    /// The root is last; empty without primitives.
    nodes: Vec<Node>,
}

const LEAF_SIZE: usize = 4;
const OFFSET: f64 = 1e-12;

impl World {
    /// Triangles without area are left out: no ray meets them and they emit nothing.
    pub fn new(objects: &[Object]) -> Self {
        let mut primitives = Vec::new();
        for (object, item) in objects.iter().enumerate() {
            for (triangle, surface) in surfaces(&item.shape) {
                let [low, high] = surface.bounds();
                let offset = OFFSET * low.abs().max_element().max(high.abs().max_element());
                primitives.push(Primitive { surface, object, triangle, offset });
            }
        }
        let mut order: Vec<usize> = (0..primitives.len()).collect();
        let mut nodes = Vec::new();
        if !primitives.is_empty() {
            let bounds: Vec<_> = primitives.iter().map(Primitive::padded_bounds).collect();
            build(&bounds, &mut order, 0, &mut nodes);
        }
        World { primitives, order, nodes }
    }

    /// The first surface along `ray`.
    pub fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let mut nearest = (f64::INFINITY, usize::MAX);
        self.visit(ray, |i, nearest_t| {
            if let Some(t) = self.primitives[i].surface.intersect(ray, *nearest_t) {
                *nearest_t = t;
                nearest = (t, i);
            }
            false
        });
        let (t, primitive) = nearest;
        let surface = &self.primitives.get(primitive)?.surface;
        Some(Hit { t, primitive, point: surface.project(ray.origin + t * ray.direction) })
    }

    /// Whether anything stands between two points; the end points are taken as they are.
    pub fn occluded(&self, from: DVec3, to: DVec3) -> bool {
        let distance = (to - from).length();
        let ray = Ray { origin: from, direction: (to - from) / distance };
        let mut blocked = false;
        self.visit(&ray, |i, t_max| {
            *t_max = distance;
            blocked = self.primitives[i].surface.intersect(&ray, distance).is_some();
            blocked
        });
        blocked
    }

    /// Half the diagonal of the box around everything, m.
    pub fn radius(&self) -> f64 {
        match self.nodes.last() {
            Some(Node::Inner { bounds: [low, high], .. } | Node::Leaf { bounds: [low, high], .. }) => {
                0.5 * (*high - *low).length()
            }
            None => 0.0,
        }
    }

    /// A point just off primitive `i`, on the side that `towards` points to.
    pub fn leave(&self, i: usize, point: &SurfacePoint, towards: DVec3) -> DVec3 {
        point.position + self.primitives[i].offset.copysign(point.normal.dot(towards)) * point.normal
    }

    /// How far along `ray` it is just beyond the surface that it met: on the same line, so that what is aimed at is not
    /// missed, nor met too early where it is seen obliquely.
    pub fn beyond(&self, ray: &Ray, hit: &Hit) -> f64 {
        let cosine = hit.point.normal.dot(ray.direction).abs().max(1e-3);
        hit.t + self.primitives[hit.primitive].offset / cosine
    }

    /// Calls `test(primitive, t_max)` for every primitive whose leaf the ray enters before t_max, which `test` may
    /// lower; stops as soon as it returns true.
    fn visit(&self, ray: &Ray, mut test: impl FnMut(usize, &mut f64) -> bool) {
        let mut t_max = f64::INFINITY;
        let mut stack: Vec<usize> = self.nodes.len().checked_sub(1).into_iter().collect();
        while let Some(node) = stack.pop() {
            match &self.nodes[node] {
                Node::Inner { bounds, children } => {
                    if enters(bounds, ray, t_max) {
                        stack.extend(children);
                    }
                }
                Node::Leaf { bounds, range } => {
                    if enters(bounds, ray, t_max) && self.order[range.clone()].iter().any(|&i| test(i, &mut t_max)) {
                        return;
                    }
                }
            }
        }
    }
}

impl Primitive {
    /// Bounds widened beyond the rounding error of the slab test.
    fn padded_bounds(&self) -> [DVec3; 2] {
        let [low, high] = self.surface.bounds();
        [low - self.offset, high + self.offset]
    }
}

/// Each with the index of its triangle.
fn surfaces(shape: &Shape) -> Vec<(usize, Surface)> {
    match shape {
        Shape::Mesh(mesh) => {
            let corner = |i: u32| mesh.positions[i as usize];
            let triangle = |(i, t): (usize, &[u32; 3])| Some((i, Surface::triangle(t.map(corner))?));
            mesh.triangles.iter().enumerate().filter_map(triangle).collect()
        }
        Shape::Sphere { center, radius } => vec![(0, Surface::Sphere { center: *center, radius: *radius })],
        Shape::Disk { center, normal, radius } => {
            vec![(0, Surface::Disk { center: *center, normal: normal.normalize(), radius: *radius })]
        }
        Shape::Cylinder { from, to, radius } => {
            let length = (*to - *from).length();
            vec![(0, Surface::Cylinder { from: *from, axis: (*to - *from) / length, length, radius: *radius })]
        }
    }
}

/// Splits `order` at the median centroid of the longest axis until leaves are small; returns the node's index.
/// `first` is the position of `order[0]` in the whole.
fn build(bounds: &[[DVec3; 2]], order: &mut [usize], first: usize, nodes: &mut Vec<Node>) -> usize {
    let union = order.iter().map(|&i| bounds[i]).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
    let union = union.unwrap_or([DVec3::INFINITY, DVec3::NEG_INFINITY]);
    if order.len() <= LEAF_SIZE {
        nodes.push(Node::Leaf { bounds: union, range: first..first + order.len() });
    } else {
        let centroid = |i: usize| bounds[i][0] + bounds[i][1];
        let low = order.iter().map(|&i| centroid(i)).fold(DVec3::INFINITY, DVec3::min);
        let high = order.iter().map(|&i| centroid(i)).fold(DVec3::NEG_INFINITY, DVec3::max);
        let axis = (high - low).max_position();
        let middle = order.len() / 2;
        order.select_nth_unstable_by(middle, |&a, &b| centroid(a)[axis].total_cmp(&centroid(b)[axis]));
        let (left, right) = order.split_at_mut(middle);
        let children = [build(bounds, left, first, nodes), build(bounds, right, first + middle, nodes)];
        nodes.push(Node::Inner { bounds: union, children });
    }
    nodes.len() - 1
}

/// Slab test: whether the ray is inside the box somewhere in [0, t_max].
fn enters([low, high]: &[DVec3; 2], ray: &Ray, t_max: f64) -> bool {
    let (mut near, mut far) = (0.0f64, t_max);
    for axis in 0..3 {
        let (o, d) = (ray.origin[axis], ray.direction[axis]);
        if d == 0.0 {
            // Division would give 0/0 on the slab's own plane.
            if o < low[axis] || o > high[axis] {
                return false;
            }
            continue;
        }
        let (a, b) = ((low[axis] - o) / d, (high[axis] - o) / d);
        near = near.max(a.min(b));
        far = far.min(a.max(b));
    }
    near <= far
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::rng::Rng;
    use crate::scene::Mesh;

    fn object(shape: Shape) -> Object {
        let attributes = crate::scene::Attributes::default();
        Object {
            name: "test".into(),
            shape,
            attributes,
            material: Some(0),
            emission: None,
            interior: None,
            assembly: None,
        }
    }

    fn vector(rng: &mut Rng) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| rng.normal()))
    }

    /// A cloud of every kind of primitive, axis-aligned and flat ones among them.
    fn cloud(rng: &mut Rng) -> World {
        let mut mesh = Mesh::default();
        for i in 0..300 {
            let centre = 4.0 * vector(rng);
            let flat = if i % 3 == 0 { DVec3::new(1.0, 1.0, 0.0) } else { DVec3::ONE };
            for _ in 0..3 {
                mesh.positions.push(centre + 0.5 * flat * vector(rng));
            }
            mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
        }
        let mut objects = vec![object(Shape::Mesh(mesh))];
        for _ in 0..60 {
            let (center, radius) = (4.0 * vector(rng), 0.4 * rng.uniform());
            objects.push(object(Shape::Sphere { center, radius }));
            let (center, normal) = (4.0 * vector(rng), vector(rng));
            objects.push(object(Shape::Disk { center, normal, radius }));
            let from = 4.0 * vector(rng);
            objects.push(object(Shape::Cylinder { from, to: from + vector(rng), radius }));
        }
        World::new(&objects)
    }

    /// Closest hits and occlusion equal a loop over all primitives, for general and axis-parallel rays.
    #[test]
    fn hierarchy_equals_brute_force() {
        let mut rng = Rng::from_keys(&[3]);
        let world = cloud(&mut rng);
        assert_eq!(world.primitives.len(), 480);
        let (mut hits, mut blocked) = (0, 0);
        for i in 0..20_000 {
            let origin = 4.0 * vector(&mut rng);
            let direction = if i % 4 == 0 { DVec3::AXES[i / 4 % 3] } else { vector(&mut rng).normalize() };
            let ray = Ray { origin, direction };
            let each = world.primitives.iter().filter_map(|p| p.surface.intersect(&ray, f64::INFINITY));
            let expected = each.fold(f64::INFINITY, f64::min);
            let found = world.closest_hit(&ray);
            assert_eq!(found.as_ref().map_or(f64::INFINITY, |h| h.t), expected, "ray {ray:?}");
            hits += usize::from(found.is_some());

            let to = 4.0 * vector(&mut rng);
            let distance = (to - origin).length();
            let segment = Ray { origin, direction: (to - origin) / distance };
            let expected = world.primitives.iter().any(|p| p.surface.intersect(&segment, distance).is_some());
            assert_eq!(world.occluded(origin, to), expected);
            blocked += usize::from(expected);
        }
        assert!(hits > 2000 && hits < 18_000 && blocked > 2000 && blocked < 18_000, "{hits} {blocked}: a poor test");
    }

    /// No ray from inside leaves a closed box of triangles, also not after it left a wall next to an edge.
    #[test]
    fn closed_box_does_not_leak() {
        let corner = |i: u32| DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64);
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let mesh = Mesh { positions: (0..8).map(|i| 3.0 * corner(i) - 1.0).collect(), triangles };
        let world = World::new(&[object(Shape::Mesh(mesh))]);
        let mut rng = Rng::from_keys(&[4]);
        let mut origin = DVec3::ZERO;
        let mut wall = DVec3::ZERO;
        for _ in 0..200_000 {
            let direction = vector(&mut rng).normalize();
            let direction = if direction.dot(wall) > 0.0 { -direction } else { direction };
            let ray = Ray { origin, direction };
            let hit = world.closest_hit(&ray).unwrap_or_else(|| panic!("leaked: {ray:?}"));
            // Outward normals: a ray from inside meets the back.
            wall = hit.point.normal;
            assert!(wall.dot(direction) > 0.0, "met a wall from outside: {ray:?}");
            origin = world.leave(hit.primitive, &hit.point, -direction);
        }
    }

    #[test]
    fn empty_and_degenerate() {
        let ray = Ray { origin: DVec3::ZERO, direction: DVec3::Z };
        assert!(World::new(&[]).closest_hit(&ray).is_none());
        assert!(!World::new(&[]).occluded(DVec3::ZERO, DVec3::ONE));
        let sliver = Mesh { positions: vec![DVec3::Z, 2.0 * DVec3::Z, 3.0 * DVec3::Z], triangles: vec![[0, 1, 2]] };
        assert!(World::new(&[object(Shape::Mesh(sliver))]).primitives.is_empty());
    }
}
