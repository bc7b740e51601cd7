//! Buffers with names, and waiting for the device.

use std::time::Duration;

use crate::gpu::adapter::Gpu;
use crate::{Error, Result};

/// How long one submission may take before the device counts as hung.
const TIMEOUT: Duration = Duration::from_secs(600);

/// A storage buffer holding `data`; empty data gives the smallest buffer that can be bound.
pub fn storage<T: bytemuck::NoUninit>(gpu: &Gpu, label: &str, data: &[T]) -> wgpu::Buffer {
    let bytes: &[u8] = bytemuck::cast_slice(data);
    let buffer = empty(gpu, label, bytes.len() as u64, wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST);
    // In pieces: each `write_buffer` keeps a host copy until the device has taken it.
    for (i, piece) in bytes.chunks(16 << 20).enumerate() {
        gpu.queue.write_buffer(&buffer, (i as u64) * (16 << 20), piece);
        if bytes.len() > 16 << 20 {
            gpu.queue.submit([]);
            let _ = gpu.device.poll(wgpu::PollType::wait_indefinitely());
        }
    }
    buffer
}

/// A buffer of `size` bytes, at least 16 and a multiple of 16, with undefined (by wgpu: zero) content.
pub fn empty(gpu: &Gpu, label: &str, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: size.max(16).next_multiple_of(16),
        usage,
        mapped_at_creation: false,
    })
}

/// Waits until a submission is done.
pub fn wait(gpu: &Gpu, submission: wgpu::SubmissionIndex) -> Result<()> {
    let poll = wgpu::PollType::Wait { submission_index: Some(submission), timeout: Some(TIMEOUT) };
    gpu.device.poll(poll).map_err(|e| Error::DevicesLost(format!("{}: no answer ({e})", gpu.name)))?;
    gpu.check()
}

/// Copies `size` bytes of `source` to the host: for small buffers and tests.
pub fn read<T: bytemuck::Pod>(gpu: &Gpu, source: &wgpu::Buffer, size: u64) -> Result<Vec<T>> {
    let staging = empty(gpu, "read back", size, wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("read back") });
    encoder.copy_buffer_to_buffer(source, 0, &staging, 0, size);
    let submission = gpu.queue.submit([encoder.finish()]);
    map(&staging);
    wait(gpu, submission)?;
    let view =
        staging.slice(..size).get_mapped_range().map_err(|e| Error::DevicesLost(format!("{}: {e}", gpu.name)))?;
    Ok(bytemuck::pod_collect_to_vec(&view))
}

/// Asks for a staging buffer to be mapped for reading once the work before it is done.
pub fn map(staging: &wgpu::Buffer) {
    staging.slice(..).map_async(wgpu::MapMode::Read, |_| {});
}
