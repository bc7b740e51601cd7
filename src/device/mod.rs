//! What a scene is on a device, without a word of wgpu: parts and their texts, layouts, buffers, tables.

pub mod accel;
mod emission;
pub mod evaluator;
pub mod example;
pub mod facts;
pub mod instructions;
pub mod integration;
pub mod kernels;
pub mod part;
pub mod parts;
pub mod prepared;
pub mod rng;
pub mod separable;
mod spectra;
pub mod text;
pub mod windows;
pub mod words;
