//! The only place, with `render::worker`, that names wgpu.

pub mod adapter;
mod allocation;
pub mod buffer;
pub mod deadline;
#[cfg(test)]
pub mod fault;
mod instance;
pub mod layout;
pub mod pass;
pub mod self_test;
pub mod shader;
pub mod timestamps;
pub mod upload;
