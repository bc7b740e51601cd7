//! Shapes of objects, in their own space.

use glam::DVec3;

use super::decode::{Fields, Item, Keys};
use super::{Mesh, Shape};
use crate::format::obj::Part;

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
    let fields = item.table(Keys::new(&["center", "radius"]))?;
    let (center, radius) = (vector(&fields, "center"), radius(&fields));
    Some(Shape::Sphere { center: center?, radius: radius? })
}

fn disk(item: &Item) -> Option<Shape> {
    let fields = item.table(Keys::new(&["center", "normal", "radius"]))?;
    let normal = fields.require("normal", "normal = [x, y, z]").and_then(|item| item.direction());
    let (center, radius) = (vector(&fields, "center"), radius(&fields));
    Some(Shape::Disk { center: center?, normal: normal?, radius: radius? })
}

fn cylinder(item: &Item) -> Option<Shape> {
    let fields = item.table(Keys::new(&["from", "to", "radius"]))?;
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
    let fields = item.table(Keys::new(&["corner", "edge_u", "edge_v"]))?;
    let (corner, u, v) = (vector(&fields, "corner"), vector(&fields, "edge_u"), vector(&fields, "edge_v"));
    let (corner, u, v) = (corner?, u?, v?);
    if is_degenerate(DVec3::ZERO, u, v) {
        item.error_help("has no area: its edges are parallel or 0", "give two edges in different directions");
        return None;
    }
    let positions = vec![corner, corner + u, corner + u + v, corner + v];
    Some(Shape::Mesh(Mesh { positions, triangles: vec![[0, 1, 2], [2, 3, 0]] }))
}

/// Twelve triangles facing outward. The first edges of a face's two triangles are parallel.
fn cube(item: &Item) -> Option<Shape> {
    let fields = item.table(Keys::new(&["min", "max"]))?;
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
    const FACES: [[u32; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = FACES.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [c, d, a]]).collect();
    Some(Shape::Mesh(Mesh { positions: (0..8).map(corner).collect(), triangles }))
}

/// The parts of an OBJ file in one mesh.
pub fn join(parts: &[&Part]) -> Mesh {
    let mut mesh = Mesh::default();
    for part in parts {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(part.positions.iter().map(|p| DVec3::from_array(*p)));
        mesh.triangles.extend(part.triangles.iter().map(|t| t.map(|i| i + first)));
    }
    mesh
}

/// Removes triangles without area and tells how many there were.
pub fn drop_degenerate(mesh: &mut Mesh) -> usize {
    let before = mesh.triangles.len();
    let positions = &mesh.positions;
    mesh.triangles.retain(|t| {
        let [a, b, c] = t.map(|i| positions[i as usize]);
        !is_degenerate(a, b, c)
    });
    before - mesh.triangles.len()
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
            assert_eq!(drop_degenerate(&mut mesh), 3);
            assert_eq!(mesh.triangles, [[0, 1, 2]]);
        }
    }
}
