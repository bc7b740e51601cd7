//! The render: plan → units → waves on a device → host merge.

pub mod compose;
mod emission;
#[cfg(test)]
mod fault_tests;
mod heat;
pub mod integration;
pub mod interrupt;
pub mod job;
pub mod lights;
pub mod media;
mod origins;
pub mod patience;
pub mod plan;
pub mod pool;
pub mod prepare;
pub mod queue;
pub mod radiators;
pub mod rng;
pub mod schedule;
pub mod sky;
mod spectra;
pub mod surfaces;
pub mod textures;
pub mod watch;
pub mod wave;
pub mod worker;
