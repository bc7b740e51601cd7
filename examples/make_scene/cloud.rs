//! A cumulus on a grid: grams of water a cubic metre.

use std::io;
use std::path::Path;

use glam::dvec3;

use super::plume::{noise, write_array};

/// Voxels along x, y, z; a voxel has 20 m.
const SIZE: [usize; 3] = [64, 40, 64];

/// Writes `water.zarr`. A flat base, a heap above it whose edge is folded by noise, more water with height, as air that rises has.
pub fn make(folder: &Path) -> io::Result<()> {
    let [nx, ny, nz] = SIZE;
    let mut water = Vec::new();
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                let centre = |k: usize, n: usize| (k as f64 + 0.5) / n as f64;
                let p = dvec3(centre(x, nx) - 0.5, centre(y, ny), centre(z, nz) - 0.5);
                let folds =
                    (1..=4).map(|octave| noise(p * f64::from(3 << octave)) / f64::from(1 << octave)).sum::<f64>();
                let across = (p.x * p.x + 1.3 * p.z * p.z).sqrt() / (0.47 - 0.28 * p.y);
                let inside = 1.0 - across - (p.y / 0.95).powi(4) + 0.75 * folds;
                let edge = ((p.y - 0.04) / 0.04).clamp(0.0, 1.0) * (inside / 0.15).clamp(0.0, 1.0);
                let rim = [p.x + 0.5, 0.5 - p.x, 1.0 - p.y, p.z + 0.5, 0.5 - p.z].into_iter().fold(1.0, f64::min);
                water.push((edge * (0.1 + 0.5 * p.y) * (rim / 0.03).min(1.0)) as f32);
            }
        }
    }
    write_array(&folder.join("water.zarr"), SIZE, &water)
}
