//! Spectile: a spectral image renderer.
//!
//! `scene` (parsed, checked, in metres and nanometres) → `render::prepare` → `gpu` → `render` (generate,
//! evaluate, transfer, merge) → `cube` (a Zarr v3 store). `reference` is an independent f64 path tracer.

pub mod accel;
pub mod cli;
pub mod cube;
pub mod error;
pub mod files;
pub mod format;
pub mod gpu;
pub mod reference;
pub mod render;
pub mod scattering;
pub mod scene;
pub mod spectral;

pub use error::{Error, Result};
