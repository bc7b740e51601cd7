//! wgpu: adapters, buffers, pipelines; names, bytes and texts come in. With `render::worker` the only place that names it.

pub mod adapter;
mod allocation;
pub mod buffer;
pub mod deadline;
#[cfg(test)]
pub mod fault;
mod instance;
pub mod kept;
pub mod pass;
pub mod source;
pub mod timestamps;
pub mod upload;
