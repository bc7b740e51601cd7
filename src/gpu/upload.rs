//! Immutable data on a device: storage buffers, and one uniform, found by the names of their WGSL variables.

use crate::Result;
use crate::gpu::adapter::Gpu;
use crate::gpu::buffer;

pub struct NamedBuffers {
    named: Vec<(String, wgpu::Buffer)>,
}

impl NamedBuffers {
    /// Uploads `uniform` and `storage`. Errors: a device that is lost, or whose memory does not hold them.
    pub fn new<'a>(
        gpu: &Gpu,
        uniform: (&str, &[u8]),
        storage: impl IntoIterator<Item = (String, &'a [u8])>,
    ) -> Result<NamedBuffers> {
        let (name, bytes) = uniform;
        let mut named = vec![(name.to_owned(), buffer::uniform(gpu, name, bytes))];
        for (name, bytes) in storage {
            let buffer = buffer::storage(gpu, &name, bytes)?;
            named.push((name, buffer));
        }
        Ok(NamedBuffers { named })
    }

    /// The buffer of the variable `name`.
    pub fn buffer(&self, name: &str) -> Option<&wgpu::Buffer> {
        self.named.iter().find(|(n, _)| n == name).map(|(_, b)| b)
    }

    /// The binding for the variable `name`, if it is one of these.
    pub fn find(&self, name: &str) -> Option<wgpu::BufferBinding<'_>> {
        self.buffer(name).map(|buffer| buffer.as_entire_buffer_binding())
    }
}
