//! What tests share: scenes with known answers, renders on the device, statistics, cubes, the real binary.

pub mod binary;
pub mod cube_files;
pub mod cubes;
pub mod device;
pub mod outside;
pub mod report;
pub mod scene_builder;
pub mod size;
pub mod statistics;
pub mod tracer;
pub mod truth;
