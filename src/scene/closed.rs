//! Which shapes have an inside.

use glam::DVec3;

use super::{Mesh, Shape};
use crate::format::edges;

/// What keeps `shape` from having an inside, in words; `None` if it has one.
pub fn opening(shape: &Shape) -> Option<String> {
    match shape {
        Shape::Sphere { .. } => None,
        Shape::Disk { .. } => Some("a disk has no inside".to_owned()),
        Shape::Cylinder { .. } => Some("a cylinder is open at both ends".to_owned()),
        Shape::Mesh(mesh) => {
            let open = open_edges(mesh);
            let &[a, b] = open.first()?;
            Some(format!(
                "its mesh is not closed: {} edges have no triangle on their other side, one of them from {a} to {b}",
                open.len()
            ))
        }
    }
}

/// The ends of [`edges::open`].
fn open_edges(mesh: &Mesh) -> Vec<[DVec3; 2]> {
    let open = edges::open(&mesh.positions, &mesh.triangles);
    open.into_iter().map(|edge| edge.map(|corner| mesh.positions[corner as usize])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> Mesh {
        let positions = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        Mesh { positions, triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]] }
    }

    #[test]
    fn closed_meshes_have_no_open_edges() {
        let whole = tetrahedron();
        assert!(open_edges(&whole).is_empty() && opening(&Shape::Mesh(whole.clone())).is_none());
        // Corners of its own for every triangle, one of them with another zero.
        let mut positions: Vec<DVec3> =
            whole.triangles.iter().flatten().map(|&i| whole.positions[i as usize]).collect();
        positions[0] = -positions[0];
        let apart = Mesh { positions, triangles: (0..4).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect() };
        assert!(open_edges(&apart).is_empty());
        // Two bodies, and one twice.
        let twice = Mesh { triangles: whole.triangles.repeat(2), ..whole };
        assert!(open_edges(&twice).is_empty());
    }

    #[test]
    fn what_is_open_says_where() {
        let mut mesh = tetrahedron();
        mesh.triangles.pop();
        assert_eq!(open_edges(&mesh).len(), 3);
        // One triangle the wrong way round.
        let mut mesh = tetrahedron();
        mesh.triangles[2].swap(0, 1);
        assert_eq!(open_edges(&mesh).len(), 3);
        let words = opening(&Shape::Mesh(mesh)).unwrap();
        assert!(words.contains("3 edges") && words.contains("one of them from [1, 0, 0] to [0, 0, 1]"), "{words}");
        assert!(opening(&Shape::Disk { center: DVec3::ZERO, normal: DVec3::X, radius: 1.0 }).is_some());
    }
}
