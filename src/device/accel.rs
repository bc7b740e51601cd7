//! From world-space objects to what rays meet: primitives in device units and a compressed wide BVH over them.
//!
//! Device units: the scene recentred and scaled by a power of two to about [-1, 1], in f64, before anything becomes f32,
//! so that a scene far from the origin, or measured in micrometres, loses nothing.

use glam::{DAffine3, DMat3, DVec3, Mat3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;
use obvhs::cwbvh::node::CwBvhNode;
use obvhs::ploc::PlocBuilder;
use obvhs::{Boundable, BvhBuildParams};

use crate::device::words::{
    HAS_COORDINATES, HAS_NORMALS, KIND_CYLINDER, KIND_DISK, KIND_INSTANCE, KIND_SPHERE, NONE, Primitive,
};
use crate::scene::{Attributes, Object, Scene, Shape, box_around, box_around_all};

/// The largest number of materials: ids have 24 bits beside the primitive's kind, and one stands for none.
pub const MAX_MATERIALS: usize = (1 << 24) - 1;
const NO_MATERIAL: u32 = 0x00ff_ffff;

/// World space → device units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviceSpace {
    pub center: DVec3,
    /// Device units per metre, a power of two.
    pub scale: f64,
    /// Radius of a sphere around the device origin that holds the scene, in device units.
    pub radius: f64,
}

impl DeviceSpace {
    pub fn point(&self, world: DVec3) -> [f32; 3] {
        ((world - self.center) * self.scale).as_vec3().to_array()
    }

    pub fn length(&self, metres: f64) -> f32 {
        (metres * self.scale) as f32
    }

    /// Around what lies within `bounds`.
    fn around([min, max]: [DVec3; 2]) -> DeviceSpace {
        let half = (0.5 * (max - min)).max_element();
        let scale = if half > 0.0 { (-half.log2().ceil()).exp2() } else { 1.0 };
        let radius = (0.5 * (max - min)).length() * scale;
        DeviceSpace { center: 0.5 * (min + max), scale, radius: radius.max(f64::from(f32::MIN_POSITIVE)) }
    }

    /// From the world into device units.
    fn of_world(&self) -> DAffine3 {
        DAffine3::from_scale(DVec3::splat(self.scale)) * DAffine3::from_translation(-self.center)
    }
}

/// An emitting primitive: its index into [`Accel::primitives`], its object, and its area in device units.
pub type Emitting = (u32, usize, f64);

/// An instance that emits.
#[derive(Debug, Clone, Copy)]
pub struct Luminous {
    /// Its place among [`Accel::primitives`].
    pub primitive: u32,
    pub assembly: usize,
}

/// Everything a ray can meet, ready for the device.
pub struct Accel {
    pub space: DeviceSpace,
    /// CWBVH nodes, 80 bytes each: the world's, whose root is the first, then those of each assembly; at least one. Behind them, in
    /// vectors of four words, five in the place of a node, what instances have beside their primitives ([`PLACEMENT_VECTORS`]).
    pub nodes: Vec<[u32; 20]>,
    /// How many of them are nodes.
    pub node_count: usize,
    /// What a traversal has waiting at most.
    pub depth: u32,
    /// In the order of the leaves of the world's tree, then of each assembly's, whose units are those of its own bounds.
    pub primitives: Vec<Primitive>,
    /// How many of them are instances.
    pub instances: usize,
    /// Texture coordinates, normals and axes of those that carry some, found by [`Primitive::attributes`].
    pub attributes: Vec<f32>,
    /// The object of each primitive.
    pub objects: Vec<u32>,
    /// The emitting primitives of the world.
    pub emitters: Vec<Emitting>,
    /// Those of each assembly, areas in its own units; and the instances of assemblies that have some.
    pub emitters_of: Vec<Vec<Emitting>>,
    pub luminous: Vec<Luminous>,
    /// Whether anything but triangles occurs.
    pub has_shapes: bool,
    /// Triangles without area, which no ray can meet and which were left out.
    pub degenerate: usize,
}

/// A tree, and what stands in its leaves.
struct Tree {
    nodes: Vec<[u32; 20]>,
    depth: u32,
    primitives: Vec<Primitive>,
}

impl Tree {
    /// Over primitives and the boxes around them.
    fn over(loose: &[Primitive], boxes: &[Aabb]) -> Tree {
        let (nodes, order, depth) = build_nodes(boxes);
        Tree { nodes, depth, primitives: order.iter().map(|&i| loose[i as usize]).collect() }
    }

    /// Boxes that hold everything: those of the children of its root.
    fn upper_boxes(&self) -> Vec<[DVec3; 2]> {
        let root: CwBvhNode = bytemuck::cast(self.nodes[0]);
        let children = (0..8).filter(|&child| !root.is_child_empty(child)).map(|child| root.child_aabb(child));
        children.map(|Aabb { min, max }| [min, max].map(|corner| corner.as_dvec3())).collect()
    }
}

/// What is collected of a scene's objects.
#[derive(Default)]
struct Collected {
    attributes: Vec<f32>,
    /// Triangles without area.
    degenerate: usize,
}

impl Collected {
    /// The primitives of those `objects` that are parts of `assembly`, or of none, in the units of `space`; the object stands in for
    /// the emitter.
    fn primitives(&mut self, objects: &[Object], assembly: Option<usize>, space: &DeviceSpace) -> Vec<Primitive> {
        let mut loose = Vec::new();
        for (index, object) in objects.iter().enumerate().filter(|(_, object)| object.assembly == assembly) {
            let first = loose.len();
            let material = object.material.map_or(NO_MATERIAL, |m| m as u32);
            let triangles = collect(&object.shape, material, index as u32, space, &mut loose);
            for (primitive, triangle) in loose[first..].iter_mut().zip(&triangles) {
                primitive.attributes = attach(&object.attributes, *triangle, &mut self.attributes);
            }
            let all = if let Shape::Mesh(mesh) = &object.shape { mesh.triangles.len() } else { 1 };
            self.degenerate += all - triangles.len();
        }
        loose
    }
}

/// Nodes and primitives, one tree after the other.
#[derive(Default)]
struct Packed {
    nodes: Vec<[u32; 20]>,
    primitives: Vec<Primitive>,
}

/// Words of a node that count from the first: its first child, and its first primitive.
const NODE_CHILDREN: usize = 4;
const NODE_PRIMITIVES: usize = 5;

impl Packed {
    /// Appends a tree and gives the place of its root.
    fn push(&mut self, tree: &Tree) -> usize {
        let (root, first) = (self.nodes.len(), self.primitives.len());
        self.nodes.extend(tree.nodes.iter().map(|node| {
            let mut node = *node;
            node[NODE_CHILDREN] += root as u32;
            node[NODE_PRIMITIVES] += first as u32;
            node
        }));
        self.primitives.extend(&tree.primitives);
        root
    }
}

/// Of each instance: where its space begins in the world and the root of its assembly; columns of its matrix.
const PLACEMENT_VECTORS: u32 = 4;

/// An instance among the primitives of the world, and what it has beside that.
struct Stub {
    primitive: Primitive,
    bounds: Aabb,
    at: [f32; 3],
    linear: Mat3,
    assembly: usize,
}

impl Accel {
    /// Builds the structure; never fails, an empty scene gives one empty node.
    pub fn build(scene: &Scene) -> Accel {
        let space = device_space(scene);
        let mut collected = Collected::default();
        let mut loose = collected.primitives(&scene.objects, None, &space);
        let mut boxes: Vec<Aabb> = loose.iter().map(Boundable::aabb).collect();
        let mut stubs = Vec::new();
        let mut assemblies = Vec::with_capacity(scene.assemblies.len());
        for (id, assembly) in scene.assemblies.iter().enumerate() {
            let own = DeviceSpace::around(scene.bounds_of(id).unwrap_or_default());
            let parts = collected.primitives(&scene.objects, Some(id), &own);
            let of_parts: Vec<Aabb> = parts.iter().map(Boundable::aabb).collect();
            let tree = Tree::over(&parts, &of_parts);
            let around = tree.upper_boxes();
            assemblies.push(tree);
            let of_own = own.of_world().inverse();
            // Whose material and boundary it is does not matter: a ray meets what is in it.
            let object = scene.objects.iter().position(|object| object.assembly == Some(id)).unwrap_or(0);
            let placed = assembly.instances.iter();
            stubs.extend(placed.map(|to_world| stub(space.of_world() * *to_world * of_own, &around, id, object)));
        }
        for (i, stub) in stubs.iter().enumerate() {
            // Its number, for now.
            loose.push(Primitive { attributes: i as u32, ..stub.primitive });
            boxes.push(stub.bounds);
        }
        let world = Tree::over(&loose, &boxes);
        let mut packed = Packed::default();
        packed.push(&world);
        let roots: Vec<usize> = assemblies.iter().map(|tree| packed.push(tree)).collect();
        let inner = assemblies.iter().map(|tree| tree.depth).max();
        // What is left of the leaf in which the instance stands waits too.
        let depth = world.depth + inner.map_or(0, |depth| depth + 1);
        let Packed { mut nodes, mut primitives } = packed;
        let node_count = nodes.len();
        let of_stub = |stub: &Stub| {
            let vector = |[x, y, z]: [f32; 3], word: usize| [x.to_bits(), y.to_bits(), z.to_bits(), word as u32];
            let [a, b, c] = stub.linear.to_cols_array_2d();
            [vector(stub.at, roots[stub.assembly]), vector(a, 0), vector(b, 0), vector(c, 0)]
        };
        let placements: Vec<[u32; 4]> = stubs.iter().flat_map(of_stub).collect();
        nodes.extend(placements.chunks(5).map(|five| {
            let mut node = [0; 20];
            node[..4 * five.len()].copy_from_slice(five.as_flattened());
            node
        }));
        let objects = primitives.iter().map(|primitive| primitive.emitter).collect();
        let (mut emitters, mut emitters_of) = (Vec::new(), vec![Vec::new(); scene.assemblies.len()]);
        for (index, primitive) in primitives.iter_mut().enumerate() {
            // `collect` left the object here; from now on it is the emitter.
            let object = primitive.emitter as usize;
            primitive.emitter = NONE;
            if primitive.tag >> 24 != KIND_INSTANCE && scene.objects[object].emission.is_some() {
                let among = scene.objects[object].assembly.map_or(&mut emitters, |assembly| &mut emitters_of[assembly]);
                primitive.emitter = among.len() as u32;
                among.push((index as u32, object, area(primitive)));
            }
        }
        let mut luminous = Vec::new();
        for (index, primitive) in primitives.iter_mut().enumerate().filter(|(_, p)| p.tag >> 24 == KIND_INSTANCE) {
            let assembly = stubs[primitive.attributes as usize].assembly;
            primitive.attributes = 5 * node_count as u32 + PLACEMENT_VECTORS * primitive.attributes;
            if !emitters_of[assembly].is_empty() {
                primitive.emitter = (emitters.len() + luminous.len()) as u32;
                luminous.push(Luminous { primitive: index as u32, assembly });
            }
        }
        let has_shapes = primitives.iter().any(|p| !matches!(p.tag >> 24, 0 | KIND_INSTANCE));
        let Collected { attributes, degenerate } = collected;
        let instances = stubs.len();
        Accel {
            space,
            nodes,
            node_count,
            depth,
            primitives,
            instances,
            attributes,
            objects,
            emitters,
            emitters_of,
            luminous,
            has_shapes,
            degenerate,
        }
    }

    /// The assembly of an instance, and which of that assembly's it is.
    pub fn instance_of(&self, scene: &Scene, instance: &Primitive) -> (usize, usize) {
        let mut number = ((instance.attributes - 5 * self.node_count as u32) / PLACEMENT_VECTORS) as usize;
        for (assembly, instances) in scene.assemblies.iter().map(|assembly| assembly.instances.len()).enumerate() {
            if number < instances {
                return (assembly, number);
            }
            number -= instances;
        }
        unreachable!("an instance is one of some assembly")
    }

    /// From the units of its assembly to the device's of the world, of the instance that stands among the primitives.
    pub fn placement(&self, instance: u32) -> DAffine3 {
        let place = self.primitives[instance as usize].attributes as usize;
        let vectors = self.nodes.as_flattened()[4 * place..].as_chunks::<4>().0;
        let [at, a, b, c] = std::array::from_fn(|i| {
            let [x, y, z, _] = vectors[i].map(|word| f64::from(f32::from_bits(word)));
            DVec3::new(x, y, z)
        });
        DAffine3 { matrix3: DMat3::from_cols(a, b, c), translation: at }
    }

    /// The kind of a primitive and what it has in the places of corners, in the device's units of the world, as a part of an instance
    /// if it is one.
    pub fn in_world(&self, primitive: u32, instance: Option<u32>) -> (u32, [DVec3; 3]) {
        let p = &self.primitives[primitive as usize];
        let (kind, [a, b, c]) = (p.tag >> 24, [p.a, p.b, p.c].map(vector));
        let Some(instance) = instance else { return (kind, [a, b, c]) };
        let to_world = self.placement(instance);
        let point = |p: DVec3| to_world.transform_point3(p);
        // What is round keeps its form.
        let scale = to_world.matrix3.x_axis.length();
        let corners = match kind {
            KIND_SPHERE => [point(a), scale * b, c],
            KIND_DISK => [point(a), to_world.transform_vector3(b).normalize(), scale * c],
            KIND_CYLINDER => [point(a), point(b), scale * c],
            _ => [a, b, c].map(point),
        };
        (kind, corners)
    }

    /// What emits in an instance, with areas in the device units of the world.
    pub fn placed_emitters(&self, instance: &Luminous) -> impl Iterator<Item = Emitting> {
        let linear = self.placement(instance.primitive).matrix3;
        let scale2 = linear.x_axis.length_squared();
        let keeps_shape = {
            let gram = linear.transpose() * linear * scale2.recip();
            (gram - DMat3::IDENTITY).to_cols_array().iter().all(|difference| difference.abs() < 1e-5)
        };
        self.emitters_of[instance.assembly].iter().map(move |&(primitive, object, area)| {
            let p = &self.primitives[primitive as usize];
            let placed = if keeps_shape || p.tag >> 24 != 0 {
                scale2 * area
            } else {
                let [b, c] = [p.b, p.c].map(|corner| linear * (vector(corner) - vector(p.a)));
                0.5 * b.cross(c).length()
            };
            (primitive, object, placed)
        })
    }

    /// Everything that emits, with areas in the device units of the world.
    pub fn all_emitters(&self) -> impl Iterator<Item = Emitting> {
        self.emitters.iter().copied().chain(self.luminous.iter().flat_map(|instance| self.placed_emitters(instance)))
    }
}

/// An instance of `assembly`, which fills `boxes` in its own units; `to_device` leads from those to the world's.
fn stub(to_device: DAffine3, boxes: &[[DVec3; 2]], assembly: usize, object: usize) -> Stub {
    let m = to_device.matrix3.as_mat3();
    let at = to_device.translation.as_vec3();
    // Several, since a box that is turned needs a larger one around it.
    let moved = boxes.iter().map(|one| box_around(&to_device, *one));
    let [low, high] = box_around_all(moved).unwrap_or_default().map(|p| p.as_vec3a());
    // Rays are moved into it in f32.
    let reach =
        low.abs().max(high.abs()).max_element() + (m.x_axis.abs() + m.y_axis.abs() + m.z_axis.abs()).max_element();
    let margin = Vec3A::splat(PLACING_ERROR * reach);
    let [a, b, c] = to_device.matrix3.inverse().transpose().to_cols_array_2d().map(|row| row.map(|x| x as f32));
    let primitive =
        Primitive { a, b, c, tag: KIND_INSTANCE << 24 | NO_MATERIAL, emitter: object as u32, ..Primitive::default() };
    Stub { primitive, bounds: Aabb::new(low - margin, high + margin), at: at.to_array(), linear: m, assembly }
}

/// Of what a ray goes through when it is moved in f32, relative to the largest number on the way: eight roundings.
const PLACING_ERROR: f32 = 4.8e-7;

fn device_space(scene: &Scene) -> DeviceSpace {
    let alone = DeviceSpace { center: scene.camera.position, scale: 1.0, radius: 1.0 };
    scene.bounds().map_or(alone, DeviceSpace::around)
}

/// Appends what a primitive carries, as `shaders/common/attributes.wgsl` reads it, and gives the word that finds it.
fn attach(attributes: &Attributes, triangle: usize, out: &mut Vec<f32>) -> u32 {
    let first = out.len() as u32;
    let mut flags = 0;
    if let Some(axes) = &attributes.axes {
        flags |= HAS_COORDINATES;
        out.extend(axes.to_cols_array().map(|v| v as f32));
    }
    if let Some(uv) = &attributes.uv {
        flags |= HAS_COORDINATES;
        let corners = uv[triangle];
        // Textures repeat: small numbers have more digits.
        let whole = corners[0].min(corners[1]).min(corners[2]).floor();
        out.extend(corners.iter().flat_map(|uv| (*uv - whole).as_vec2().to_array()));
    }
    if let Some(normals) = &attributes.normals {
        flags |= HAS_NORMALS;
        out.extend(normals[triangle].iter().flat_map(|normal| normal.as_vec3().to_array()));
    }
    if flags == 0 { 0 } else { first | flags }
}

/// Appends a shape's primitives, the object's index standing in for the emitter, and gives the triangle that each is; those
/// without area as f32 are left out.
fn collect(shape: &Shape, material: u32, object: u32, space: &DeviceSpace, out: &mut Vec<Primitive>) -> Vec<usize> {
    let base = Primitive { tag: material, emitter: object, ..Primitive::default() };
    match shape {
        Shape::Mesh(mesh) => {
            let positions: Vec<[f32; 3]> = mesh.positions.iter().map(|&p| space.point(p)).collect();
            let mut kept = Vec::with_capacity(mesh.triangles.len());
            for (triangle, t) in mesh.triangles.iter().enumerate() {
                let [a, b, c] = t.map(|i| positions[i as usize]);
                let primitive = Primitive { a, b, c, ..base };
                if triangle_area(&primitive) > 0.0 {
                    out.push(primitive);
                    kept.push(triangle);
                }
            }
            return kept;
        }
        Shape::Sphere { center, radius } => out.push(Primitive {
            a: space.point(*center),
            tag: material | KIND_SPHERE << 24,
            b: [space.length(*radius), 0.0, 0.0],
            ..base
        }),
        Shape::Disk { center, normal, radius } => out.push(Primitive {
            a: space.point(*center),
            tag: material | KIND_DISK << 24,
            b: normal.normalize().as_vec3().to_array(),
            c: [space.length(*radius), 0.0, 0.0],
            ..base
        }),
        Shape::Cylinder { from, to, radius } => out.push(Primitive {
            a: space.point(*from),
            tag: material | KIND_CYLINDER << 24,
            b: space.point(*to),
            c: [space.length(*radius), 0.0, 0.0],
            ..base
        }),
    }
    vec![0]
}

fn vector(p: [f32; 3]) -> DVec3 {
    DVec3::from(p.map(f64::from))
}

fn triangle_area(p: &Primitive) -> f64 {
    0.5 * (vector(p.b) - vector(p.a)).cross(vector(p.c) - vector(p.a)).length()
}

/// Area in device units.
fn area(p: &Primitive) -> f64 {
    use std::f64::consts::PI;
    match p.tag >> 24 {
        KIND_SPHERE => 4.0 * PI * f64::from(p.b[0]).powi(2),
        KIND_DISK => PI * f64::from(p.c[0]).powi(2),
        KIND_CYLINDER => 2.0 * PI * f64::from(p.c[0]) * (vector(p.b) - vector(p.a)).length(),
        _ => triangle_area(p),
    }
}

impl Boundable for Primitive {
    fn aabb(&self) -> Aabb {
        let v = |p: [f32; 3]| Vec3A::from(p);
        let around = |points: &[Vec3A], radius: f32| {
            let mut bounds = Aabb::from_points(points);
            // Rounding of center and radius included.
            let margin = Vec3A::splat(radius * (1.0 + 1e-6)) + 2e-7 * bounds.max.abs().max(bounds.min.abs());
            bounds.min -= margin;
            bounds.max += margin;
            bounds
        };
        match self.tag >> 24 {
            KIND_SPHERE => around(&[v(self.a)], self.b[0]),
            KIND_DISK => around(&[v(self.a)], self.c[0]),
            KIND_CYLINDER => around(&[v(self.a), v(self.b)], self.c[0]),
            _ => Aabb::from_points(&[v(self.a), v(self.b), v(self.c)]),
        }
    }
}

/// Deeper trees are built anew: the traversal's stack grows with the depth.
const MAX_DEPTH: usize = 30;

/// How much boxes grow for the time of their clustering, of their longest side. Those of a tessellated wall have no thickness, and any
/// two are together as large as any other two: a box of 130 x 130 quads a wall had 97 nodes opened a diffuse ray, with this 4.6. What
/// is not flat has 1 % more to 7 % fewer (statues, conference room, aircraft).
const PADDING: f32 = 0.01;
/// So few are as well off without, and keep the order that they always had.
const PADDED_FROM: usize = 100;

/// Clustering takes quadratic time, and recursion as deep, over boxes that are the same: it merges one pair a round.
const MAX_COINCIDENT: usize = 256;

/// The nodes, for each place in the leaves the primitive that stands there, and the tree's depth.
fn build_nodes(boxes: &[Aabb]) -> (Vec<[u32; 20]>, Vec<u32>, u32) {
    if boxes.is_empty() {
        return (vec![[0; 20]], Vec::new(), 1);
    }
    let clustered = (most_coincident(boxes) <= MAX_COINCIDENT)
        .then(|| clustered(boxes))
        // Nested boxes become chains instead of trees.
        .filter(|bvh| depth(bvh) <= MAX_DEPTH);
    let bvh = clustered.unwrap_or_else(|| bvh2_to_cwbvh(&balanced(boxes), 3, true, false));
    let nodes = bvh.nodes.iter().map(|node| bytemuck::cast(*node)).collect();
    let depth = depth(&bvh) as u32;
    (nodes, bvh.primitive_indices, depth)
}

/// A box that is clustered for another.
struct Padded(Aabb);

impl Boundable for Padded {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

/// As obvhs's `build_cwbvh`, but for what happens to the boxes meanwhile.
fn clustered(own: &[Aabb]) -> CwBvh {
    let settings = BvhBuildParams::medium_build();
    let padding = if own.len() < PADDED_FROM { 0.0 } else { PADDING };
    let padded = |Aabb { min, max }: &Aabb| {
        let (min, max) = (*min, *max);
        let margin = Vec3A::splat(padding * (max - min).max_element());
        Padded(Aabb { min: min - margin, max: max + margin })
    };
    let boxes: Vec<Padded> = own.iter().map(padded).collect();
    let mut tree = PlocBuilder::with_capacity(boxes.len()).build(
        settings.ploc_search_distance,
        &boxes,
        (0..boxes.len() as u32).collect(),
        settings.sort_precision,
        settings.search_depth_threshold,
    );
    ReinsertionOptimizer::default().run(&mut tree, settings.reinsertion_batch_ratio, None);
    for node in tree.nodes.iter_mut().filter(|node| node.is_leaf()) {
        let held = node.first_index as usize..(node.first_index + node.prim_count) as usize;
        let held = tree.primitive_indices[held].iter().map(|&i| own[i as usize]);
        node.set_aabb(held.fold(Aabb::INVALID, |all, one| all.union(&one)));
    }
    tree.refit_all();
    bvh2_to_cwbvh(&tree, settings.max_prims_per_leaf.clamp(1, 3), true, false)
}

/// The largest number of primitives that share one bounding box (by hashes: a collision may only overstate it).
fn most_coincident(boxes: &[Aabb]) -> usize {
    let mut hashes: Vec<u64> = boxes
        .iter()
        .map(|Aabb { min, max }| {
            let bits = min.to_array().into_iter().chain(max.to_array()).map(|x| u64::from(x.to_bits()));
            // Fowler, Noll and Vo's prime, a word at a time.
            bits.fold(0xcbf2_9ce4_8422_2325, |h: u64, b| (h ^ b).wrapping_mul(0x0100_0000_01b3).rotate_left(29))
        })
        .collect();
    hashes.sort_unstable();
    hashes.chunk_by(|a, b| a == b).map(<[u64]>::len).max().unwrap_or(0)
}

/// Levels of nodes.
fn depth(bvh: &CwBvh) -> usize {
    let mut deepest = 0;
    let mut open = vec![(0usize, 1usize)];
    while let Some((node, level)) = open.pop() {
        deepest = deepest.max(level);
        let node = &bvh.nodes[node];
        let children = node.imask.count_ones() as usize;
        open.extend((0..children).map(|i| (node.child_base_idx as usize + i, level + 1)));
    }
    deepest
}

/// A binary tree by median splits along the widest axis: as deep as log2 of the number of primitives, whatever they are.
fn balanced(boxes: &[Aabb]) -> Bvh2 {
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let mut nodes = vec![Bvh2Node::default()];
    let mut open = vec![(0usize, 0..boxes.len())];
    while let Some((at, range)) = open.pop() {
        let bounds = order[range.clone()].iter().fold(Aabb::INVALID, |b, &i| b.union(&boxes[i as usize]));
        if range.len() == 1 {
            nodes[at] = Bvh2Node::new(bounds, 1, range.start as u32);
            continue;
        }
        let extent = bounds.max - bounds.min;
        let axis = (0..3).max_by(|&a, &b| extent[a].total_cmp(&extent[b])).unwrap_or(0);
        let middle = range.len() / 2;
        let center = |i: &u32| boxes[*i as usize].min[axis] + boxes[*i as usize].max[axis];
        order[range.clone()].select_nth_unstable_by(middle, |a, b| center(a).total_cmp(&center(b)));
        let first_child = nodes.len();
        nodes.resize(first_child + 2, Bvh2Node::default());
        nodes[at] = Bvh2Node::new(bounds, 0, first_child as u32);
        open.push((first_child, range.start..range.start + middle));
        open.push((first_child + 1, range.start + middle..range.end));
    }
    Bvh2 { nodes, primitive_indices: order, ..Bvh2::default() }
}

#[cfg(test)]
mod tests {
    use glam::UVec2;
    use obvhs::ray::Ray;
    use obvhs::traverse;

    use super::*;
    use crate::device::rng::hash;

    fn triangle(a: [f32; 3], b: [f32; 3], c: [f32; 3]) -> Primitive {
        Primitive { a, b, c, ..Primitive::default() }
    }

    /// obvhs's own validation walks the whole tree: bounds, completeness, depth.
    #[test]
    fn trees_are_valid_on_odd_input() {
        let one = vec![triangle([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])];
        let coincident = vec![one[0]; 100_000];
        let nested: Vec<_> = (1..5000)
            .map(|i| triangle([-i as f32, -i as f32, 0.0], [i as f32, -i as f32, 0.0], [0.0, i as f32, 0.0]))
            .collect();
        let grid: Vec<_> = (0..40_000)
            .map(|i| {
                let (x, y) = ((i % 200) as f32, (i / 200) as f32);
                triangle([x, y, 0.0], [x + 1.0, y, 0.0], [x, y + 1.0, 0.1 * x])
            })
            .collect();
        let flat: Vec<_> = (0..100)
            .map(|i| triangle([i as f32, 0.0, 0.0], [i as f32 + 1e-6, 0.0, 0.0], [i as f32, 0.0, 1.0]))
            .collect();
        for primitives in [one, coincident, nested, grid, flat] {
            let boxes: Vec<Aabb> = primitives.iter().map(Boundable::aabb).collect();
            let (nodes, order, _) = build_nodes(&boxes);
            let mut seen = order.clone();
            seen.sort_unstable();
            assert!(seen.iter().enumerate().all(|(i, &p)| i as u32 == p), "each primitive stands in one leaf");
            let bvh = CwBvh {
                nodes: nodes.into_iter().map(bytemuck::cast).collect(),
                primitive_indices: order,
                ..CwBvh::default()
            };
            bvh.validate(&primitives, false);
            assert!(depth(&bvh) <= MAX_DEPTH);
        }
        assert_eq!(build_nodes(&[]).0, vec![[0; 20]]);
    }

    /// A room whose walls are cut into 60 x 60 quads each: a ray from anywhere in it opens few nodes on its way to a wall.
    #[test]
    fn tessellated_walls_are_found_in_few_nodes() {
        const QUADS: usize = 60;
        let mut walls = Vec::new();
        for (axis, at) in (0..3).flat_map(|axis| [(axis, -1.0), (axis, 1.0)]) {
            let corner = |i: usize, j: usize| {
                let [u, v] = [i, j].map(|n| 2.0 * n as f32 / QUADS as f32 - 1.0);
                let mut point = [at; 3];
                (point[(axis + 1) % 3], point[(axis + 2) % 3]) = (u, v);
                point
            };
            for (i, j) in (0..QUADS).flat_map(|i| (0..QUADS).map(move |j| (i, j))) {
                let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
                walls.extend([triangle(a, b, c), triangle(a, c, d)]);
            }
        }
        let boxes: Vec<Aabb> = walls.iter().map(Boundable::aabb).collect();
        let (nodes, primitive_indices, _) = build_nodes(&boxes);
        let nodes = nodes.into_iter().map(bytemuck::cast).collect();
        let bvh = CwBvh { nodes, primitive_indices, ..CwBvh::default() };
        const RAYS: u32 = 2_000;
        let mut opened = 0;
        for i in 0..RAYS {
            let number = |j: u32| hash(8 * i + j) as f32 / 2_147_483_648.0 - 1.0;
            let origin = 0.999 * Vec3A::new(number(0), number(1), number(2));
            let direction = Vec3A::new(number(3), number(4), number(5)).normalize();
            let walls = (direction.signum() - origin) / direction;
            let ray = Ray::new(origin, direction, 0.0, walls.min_element());
            let mut state = bvh.new_traversal(direction);
            let mut node;
            traverse!(
                bvh,
                node,
                state,
                {
                    opened += 1;
                    node.intersect_ray(&ray, state.oct_inv4)
                },
                {}
            );
        }
        let mean = f64::from(opened) / f64::from(RAYS);
        println!("{mean} nodes a ray");
        assert!(mean < 6.0, "{mean} nodes a ray");
    }
}
