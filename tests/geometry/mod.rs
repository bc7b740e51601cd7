//! Geometry at its worst: closed meshes do not leak, whatever their size and place; degenerate input neither hangs nor
//! spoils a picture; the device's traversal finds what brute force in f64 finds.

mod brute_force;
mod closed_meshes;
mod degenerate;
mod instances;
mod self_intersection;

use std::f64::consts::TAU;

use glam::DVec3;
use spectile::device::rng::hash;
use spectile::scene::{Mesh, Scene, Shape};

use crate::scene_builder::Builder;

/// Uniform over [0, 1), the same in every run.
struct Random(u32);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 += 1;
        f64::from(hash(self.0)) / 4_294_967_296.0
    }

    fn in_cube(&mut self) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| 2.0 * self.next() - 1.0))
    }

    fn direction(&mut self) -> DVec3 {
        let (z, angle) = (2.0 * self.next() - 1.0, TAU * self.next());
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * angle.cos(), r * angle.sin(), z)
    }
}

fn f32s(v: DVec3) -> [f32; 3] {
    v.as_vec3().to_array()
}

fn mesh_of(shape: Shape) -> Mesh {
    match shape {
        Shape::Mesh(mesh) => mesh,
        _ => unreachable!("a mesh"),
    }
}

fn black_mesh(mesh: Mesh) -> Scene {
    Builder::new().black(Shape::Mesh(mesh)).build()
}
