//! Shapes of objects, in their own space.

use glam::{DMat3, DVec2, DVec3};

use super::decode::{Fields, Item};
use super::keys;
use super::material::Needs;
use super::{Attributes, Mesh, Shape};
use crate::format::mesh::Part;

/// The shape `item` spells, one of sphere, quad, disk, cube and cylinder.
pub fn decode(item: &Item) -> Option<Shape> {
    match item.path.rsplit('.').next() {
        Some("sphere") => sphere(item),
        Some("quad") => quad(item),
        Some("disk") => disk(item),
        Some("cube") => cube(item),
        _ => cylinder(item),
    }
}

fn vector(fields: &Fields, key: &str) -> Option<DVec3> {
    fields.require(key, &format!("{key} = [x, y, z]"))?.vector()
}

fn radius(fields: &Fields) -> Option<f64> {
    fields.require("radius", "radius = 1.0")?.positive()
}

fn sphere(item: &Item) -> Option<Shape> {
    let fields = item.table(&keys::SPHERE)?;
    let (center, radius) = (vector(&fields, "center"), radius(&fields));
    Some(Shape::Sphere { center: center?, radius: radius? })
}

fn disk(item: &Item) -> Option<Shape> {
    let fields = item.table(&keys::DISK)?;
    let normal = fields.require("normal", "normal = [x, y, z]").and_then(|item| item.direction());
    let (center, radius) = (vector(&fields, "center"), radius(&fields));
    Some(Shape::Disk { center: center?, normal: normal?, radius: radius? })
}

fn cylinder(item: &Item) -> Option<Shape> {
    let fields = item.table(&keys::CYLINDER)?;
    let (from, to, radius) = (vector(&fields, "from"), vector(&fields, "to"), radius(&fields));
    let (from, to) = (from?, to?);
    if from == to {
        fields.get("to")?.error_help("must be another point than `from`", "move one of them");
        return None;
    }
    Some(Shape::Cylinder { from, to, radius: radius? })
}

/// Two triangles whose normal is edge_u x edge_v, and whose first edges run along edge_u.
fn quad(item: &Item) -> Option<Shape> {
    let fields = item.table(&keys::QUAD)?;
    let (corner, u, v) = (vector(&fields, "corner"), vector(&fields, "edge_u"), vector(&fields, "edge_v"));
    let (corner, u, v) = (corner?, u?, v?);
    if is_degenerate(DVec3::ZERO, u, v) {
        item.error_help("has no area: its edges are parallel or 0", "give two edges in different directions");
        return None;
    }
    let positions = vec![corner, corner + u, corner + u + v, corner + v];
    Some(Shape::Mesh(Mesh { positions, triangles: vec![[0, 1, 2], [2, 3, 0]] }))
}

/// Twelve triangles facing outward. The first edges of a face's two triangles are along its u.
fn cube(item: &Item) -> Option<Shape> {
    let fields = item.table(&keys::CUBE)?;
    let (min, max) = (vector(&fields, "min"), vector(&fields, "max"));
    let (min, max) = (min?, max?);
    if !min.cmplt(max).all() {
        let help = "exchange the coordinates that are the wrong way round";
        fields.get("min")?.error_help("must be less than `max` in x, y and z", help);
        return None;
    }
    // Corner i has its maximum in x, y, z where bit 0, 1, 2 of i is set.
    let corner = |i: u32| {
        let pick = |bit: u32, low: f64, high: f64| if i & (1 << bit) == 0 { low } else { high };
        DVec3::new(pick(0, min.x, max.x), pick(1, min.y, max.y), pick(2, min.z, max.z))
    };
    // Counter-clockwise from outside: -x, +x, -y, +y, -z, +z.
    const FACES: [[u32; 4]; 6] = [[0, 4, 6, 2], [5, 1, 3, 7], [0, 1, 5, 4], [6, 7, 3, 2], [1, 0, 2, 3], [4, 5, 7, 6]];
    let triangles = FACES.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [c, d, a]]).collect();
    Some(Shape::Mesh(Mesh { positions: (0..8).map(corner).collect(), triangles }))
}

/// What the shape [`decode`] gave carries where `needs` asks for it.
pub fn attributes(shape: &Shape, needs: Needs) -> Attributes {
    let mut attributes = Attributes::default();
    match shape {
        // Faces of four corners, from that of (0, 0) by that of (1, 0).
        Shape::Mesh(mesh) if needs.uv => {
            let [a, b, c, d] = [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y];
            attributes.uv = Some([[a, b, c], [c, d, a]].into_iter().cycle().take(mesh.triangles.len()).collect());
        }
        Shape::Mesh(_) => {}
        Shape::Sphere { .. } if needs.uv || needs.tangent => attributes.axes = Some(DMat3::IDENTITY),
        Shape::Disk { normal, .. } if needs.uv => attributes.axes = Some(axes_about(*normal)),
        Shape::Cylinder { from, to, .. } if needs.uv => attributes.axes = Some(axes_about((*to - *from).normalize())),
        Shape::Sphere { .. } | Shape::Disk { .. } | Shape::Cylinder { .. } => {}
    }
    attributes
}

/// The shortest turn that takes +y to the unit vector `axis`; to -y, half a turn about x.
fn axes_about(axis: DVec3) -> DMat3 {
    let across = DVec3::Y.cross(axis);
    // Below, what is left of `across` is rounding.
    if axis.y < 0.0 && across.length() < 1e-12 {
        return DMat3::from_cols(DVec3::X, DVec3::NEG_Y, DVec3::NEG_Z);
    }
    // Rodrigues: v + a x v + a x (a x v) / (1 + cosine), where 1 + cosine does not cancel.
    let share = if axis.y < 0.0 { (1.0 - axis.y) / across.length_squared() } else { 1.0 / (1.0 + axis.y) };
    let turned = |v: DVec3| v + across.cross(v) + across.cross(across.cross(v)) * share;
    let (x, z) = (turned(DVec3::X), turned(DVec3::Z));
    DMat3::from_cols(x.normalize(), axis, z.normalize())
}

/// The parts of a mesh file in one mesh, with the attributes that `needs` asks for. Where there are texture coordinates,
/// all parts have them.
pub fn join(parts: &[&Part], needs: Needs) -> (Mesh, Attributes) {
    let (mut mesh, mut attributes) = (Mesh::default(), Attributes::default());
    if needs.uv || needs.tangent {
        let corners = parts.iter().filter_map(|part| part.uv.as_ref()).flatten();
        attributes.uv = Some(corners.map(|uv| uv.map(DVec2::from_array)).collect());
    }
    let mut normals = Vec::new();
    for part in parts {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(part.positions.iter().map(|p| DVec3::from_array(*p)));
        mesh.triangles.extend(part.triangles.iter().map(|t| t.map(|i| i + first)));
        match &part.normals {
            Some(of_part) => normals.extend(of_part.iter().map(|normals| normals.map(DVec3::from_array))),
            None => {
                let corner = |i: u32| DVec3::from_array(part.positions[i as usize]);
                normals.extend(part.triangles.iter().map(|t| [unit_normal(t.map(corner)); 3]));
            }
        }
    }
    if needs.normal && parts.iter().any(|part| part.normals.is_some()) {
        attributes.normals = Some(normals);
    }
    (mesh, attributes)
}

/// The side from which the corners are counter-clockwise; 0 without area.
fn unit_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    let (u, v) = (b - a, c - a);
    let unit = |v: DVec3| v / v.abs().max_element().max(f64::MIN_POSITIVE);
    unit(u).cross(unit(v)).normalize_or_zero()
}

/// Removes triangles without area and tells how many there were.
pub fn drop_degenerate(mesh: &mut Mesh, attributes: &mut Attributes) -> usize {
    let positions = &mesh.positions;
    let good = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| positions[i as usize]);
        !is_degenerate(a, b, c)
    };
    let keep: Vec<bool> = mesh.triangles.iter().map(good).collect();
    let dropped = keep.iter().filter(|keep| !**keep).count();
    if dropped > 0 {
        fn retain<T>(of_triangles: &mut Vec<T>, keep: &[bool]) {
            let mut keep = keep.iter();
            of_triangles.retain(|_| *keep.next().unwrap_or(&true));
        }
        retain(&mut mesh.triangles, &keep);
        attributes.uv.iter_mut().for_each(|uv| retain(uv, &keep));
        attributes.normals.iter_mut().for_each(|normals| retain(normals, &keep));
    }
    dropped
}

/// Corners whose normal had to be replaced.
#[derive(Debug, Default, PartialEq)]
pub struct Replaced {
    /// By that of the triangle, as they had no length.
    pub without_length: usize,
    /// By their opposite, as they pointed behind the triangle.
    pub behind: usize,
}

/// Makes the normals of a mesh without degenerate triangles unit vectors on the front. Those that say nothing beyond the
/// triangles themselves are left out.
pub fn settle_normals(mesh: &Mesh, attributes: &mut Attributes) -> Replaced {
    /// Radians, more than what is lost in writing, less than what any curve needs.
    const FLAT: f64 = 1e-4;
    let (mut replaced, mut flat) = (Replaced::default(), true);
    let Some(normals) = &mut attributes.normals else { return replaced };
    for (triangle, normals) in mesh.triangles.iter().zip(normals.iter_mut()) {
        let geometric = unit_normal(triangle.map(|i| mesh.positions[i as usize]));
        for normal in normals {
            match normal.try_normalize() {
                None => {
                    replaced.without_length += 1;
                    *normal = geometric;
                }
                Some(unit) if unit.dot(geometric) < 0.0 => {
                    replaced.behind += 1;
                    *normal = -unit;
                }
                Some(unit) => *normal = unit,
            }
            flat &= normal.distance(geometric) < FLAT;
        }
    }
    if flat {
        attributes.normals = None;
    }
    replaced
}

/// Triangles over which (u, v) do not spread, so that no direction is that of growing u.
pub fn without_tangent(attributes: &Attributes) -> usize {
    let flat = |[a, b, c]: &&[DVec2; 3]| (*b - *a).perp_dot(*c - *a) == 0.0;
    attributes.uv.iter().flatten().filter(flat).count()
}

/// Whether the corners lie on one line, as far as f64 can tell at any scale: the sine between two edges is within
/// the rounding of a cross product.
fn is_degenerate(a: DVec3, b: DVec3, c: DVec3) -> bool {
    let (u, v) = (b - a, c - a);
    let (lu, lv) = (u.abs().max_element(), v.abs().max_element());
    if lu == 0.0 || lv == 0.0 || b == c {
        return true;
    }
    let (u, v) = (u / lu, v / lv);
    u.cross(v).abs().max_element() <= 4.0 * f64::EPSILON
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_degenerate_triangle_is_found_at_any_scale() {
        for scale in [1e-140, 1e-6, 1.0, 1e12] {
            let p = |x: f64, y: f64, z: f64| DVec3::new(x, y, z) * scale;
            let mut mesh = Mesh {
                positions: vec![p(0., 0., 0.), p(1., 0., 0.), p(0., 1e-7, 0.), p(2., 0., 0.)],
                triangles: vec![[0, 1, 2], [0, 1, 3], [0, 0, 1], [1, 1, 1]],
            };
            assert_eq!(drop_degenerate(&mut mesh, &mut Attributes::default()), 3);
            assert_eq!(mesh.triangles, [[0, 1, 2]]);
        }
    }

    #[test]
    fn an_axis_takes_the_picture_by_the_shortest_turn() {
        assert_eq!(axes_about(DVec3::Y), DMat3::IDENTITY);
        assert_eq!(axes_about(DVec3::NEG_Y), DMat3::from_cols(DVec3::X, DVec3::NEG_Y, DVec3::NEG_Z));
        let close = |axis: DVec3, x: DVec3, z: DVec3| {
            let axes = axes_about(axis);
            assert!(axes.x_axis.distance(x) < 1e-15 && axes.z_axis.distance(z) < 1e-15, "{axis}: {axes}");
        };
        close(DVec3::Z, DVec3::X, DVec3::NEG_Y);
        close(DVec3::X, DVec3::NEG_Y, DVec3::Z);
        for axis in [DVec3::new(0.3, -0.8, 0.2), DVec3::new(1e-9, -1.0, 0.0), DVec3::new(-2.0, 0.1, 5.0)] {
            let axes = axes_about(axis.normalize());
            assert!(
                (axes.transpose() * axes - DMat3::IDENTITY).to_cols_array().iter().all(|e| e.abs() < 1e-9),
                "{axis}"
            );
            assert!((axes.determinant() - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn normals_are_settled() {
        let mesh = Mesh { positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y], triangles: vec![[0, 1, 2]] };
        let tilted = DVec3::new(0.0, 3.0, 4.0);
        let mut attributes =
            Attributes { normals: Some(vec![[tilted, DVec3::ZERO, -tilted]]), ..Attributes::default() };
        assert_eq!(settle_normals(&mesh, &mut attributes), Replaced { without_length: 1, behind: 1 });
        let unit = DVec3::new(0.0, 0.6, 0.8);
        let [settled] = attributes.normals.as_deref().unwrap() else { panic!("one triangle") };
        assert!(settled.iter().zip([unit, DVec3::Z, unit]).all(|(a, b)| a.distance(b) < 1e-15), "{settled:?}");
        // Those of the triangle itself, as written with a few digits, are none.
        attributes.normals = Some(vec![[DVec3::new(1e-5, 0.0, 1.0), DVec3::Z, 7.0 * DVec3::Z]]);
        assert_eq!(settle_normals(&mesh, &mut attributes), Replaced::default());
        assert_eq!(attributes.normals, None);
    }
}
