//! Spectile: a spectral image renderer.
//!
//! `scene` (parsed, checked, in metres and nanometres) → `device::prepared` → `gpu` → `render` (generate,
//! evaluate, transfer, merge) → `cube` (a Zarr v3 store). `reference` is an independent f64 path tracer.

pub mod cli;
pub mod cube;
pub mod device;
pub mod error;
pub mod export;
pub mod files;
pub mod format;
pub mod gpu;
pub mod import;
pub mod preview;
pub mod reference;
pub mod render;
pub mod report;
pub mod scene;
pub mod sensor;
pub mod sky;
pub mod slurm;
pub mod spectral;
pub mod stress;
pub mod threads;

// The unit tests that need a scene build it as the integration tests do, and compare cubes as they do.
#[cfg(test)]
#[allow(dead_code, reason = "unit tests use a part of it")]
#[path = "../tests/support/cube_files.rs"]
mod cube_files;
#[cfg(test)]
extern crate self as spectile;
#[cfg(test)]
#[allow(dead_code, reason = "unit tests use a part of it")]
#[path = "../tests/support/scene_builder/mod.rs"]
mod scene_builder;

pub use error::{Error, Result};
