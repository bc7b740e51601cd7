//! Ridges behind one another, from a meadow to ten kilometres.

use std::io;
use std::path::Path;

use glam::{DVec3, dvec3};

use super::mesh::{Mesh, Part};
use super::plume::noise;
use super::shape::{Wrap, grid};

/// Where ridges stand, metres before the camera, and how high they are.
const RIDGES: [(f64, f64); 6] =
    [(400.0, 25.0), (1000.0, 70.0), (2200.0, 150.0), (4200.0, 290.0), (7000.0, 480.0), (10_000.0, 720.0)];
const HALF_WIDTH: f64 = 9_000.0;

pub fn make(folder: &Path) -> io::Result<()> {
    let mut mesh = Mesh::default();
    for (i, (distance, height)) in RIDGES.into_iter().enumerate() {
        mesh.add(if i % 2 == 0 { "trees" } else { "grass" }, ridge(i, distance, height));
    }
    mesh.add("grass", grid(1, 1, Wrap::Open, |u, v| dvec3(HALF_WIDTH * (2.0 * u - 1.0), 0.0, 1_000.0 - 12_500.0 * v)));
    mesh.write(&folder.join("land.obj"))
}

/// From its foot up to a jagged crest and down behind.
fn ridge(number: usize, distance: f64, height: f64) -> Part {
    let depth = 1.1 * height;
    let crest = |x: f64| {
        let p = |scale: f64| dvec3(x / (scale * height), 17.3 * number as f64, 0.5);
        height * (0.75 + 0.45 * noise(p(6.0)) + 0.2 * noise(p(1.7)) + 0.07 * noise(p(0.4))).max(0.1)
    };
    let place = |u: f64, v: f64| -> DVec3 {
        // Not wider than it is seen.
        let x = (0.8 * distance + 500.0).min(HALF_WIDTH) * (2.0 * u - 1.0);
        let rise = 1.0 - (2.0 * v - 1.0).abs();
        let rough = 0.06 * height * noise(dvec3(3.0 * x / height, 9.0 * v, number as f64)) * rise;
        dvec3(x, crest(x) * rise.powf(0.8) + rough - 0.01, -distance - depth * (2.0 * v - 1.0))
    };
    grid(240, 16, Wrap::Open, place)
}
