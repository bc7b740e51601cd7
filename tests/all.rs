//! All integration tests, in one program: so they are linked once, and share what they need. A subject is a module, and is run
//! alone by its name: `cargo test --release --test all physics::`.

mod files;
mod geometry;
mod heat;
mod images;
mod import;
mod kernels;
mod manual;
mod package;
mod physics;
#[cfg(feature = "web")]
mod preview;
mod program;
mod reference;
mod render;
mod scene;
mod slurm;
mod support;

use support::{binary, cube_files, cubes, device, outside, report, scene_builder, size, statistics, tracer, truth};
