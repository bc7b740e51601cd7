//! Buffers with names, and waiting for the device.

use std::time::Duration;

pub use wgpu::Buffer;

use crate::gpu::adapter::{Gpu, Trouble};
use crate::{Error, Result};

/// How long the first work on a device may take: drivers compile then, for minutes at worst.
pub const WARM_UP: Duration = Duration::from_secs(600);

/// A device counts as hung after so many waits in a row that timed out.
const TIMEOUTS: u32 = 2;

/// The most that is under way to the device at a time: wgpu keeps a copy of what is written until it has arrived.
pub const PIECE_BYTES: u64 = 4 << 20;

/// What wgpu and drivers take on every device beside the buffers asked for: a buffer of zeros (512 KiB), and alignment.
pub const WGPU_BYTES: u64 = 576 << 10;

/// A storage buffer holding `data`, which has arrived; empty data gives the smallest buffer that can be bound.
pub fn storage<T: bytemuck::NoUninit>(gpu: &Gpu, label: &str, data: &[T]) -> Result<wgpu::Buffer> {
    let bytes: &[u8] = bytemuck::cast_slice(data);
    let buffer = empty(gpu, label, bytes.len() as u64, wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST);
    for (i, piece) in bytes.chunks(PIECE_BYTES as usize).enumerate() {
        gpu.queue.write_buffer(&buffer, i as u64 * PIECE_BYTES, piece);
        wait(gpu, gpu.queue.submit([]), WARM_UP)?;
    }
    Ok(buffer)
}

/// A buffer of `size` bytes, [`allocated`], with undefined (by wgpu: zero) content.
pub fn empty(gpu: &Gpu, label: &str, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: allocated(size),
        usage,
        mapped_at_creation: false,
    })
}

/// A uniform holding `bytes`.
pub fn uniform(gpu: &Gpu, label: &str, bytes: &[u8]) -> Buffer {
    let buffer = empty(gpu, label, bytes.len() as u64, wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST);
    gpu.queue.write_buffer(&buffer, 0, bytes);
    buffer
}

/// A storage buffer of `size` bytes that kernels write and [`read`] reads.
pub fn output(gpu: &Gpu, label: &str, size: u64) -> Buffer {
    empty(gpu, label, size, wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC)
}

/// Bytes that a buffer for `size` bytes takes: at least 16 and a multiple of 16.
pub fn allocated(size: u64) -> u64 {
    size.max(16).next_multiple_of(16)
}

/// Waits until a submission is done. Errors: whatever went wrong on the device; or it is not done after twice `limit`, and
/// the device counts as hung.
pub fn wait(gpu: &Gpu, submission: wgpu::SubmissionIndex, limit: Duration) -> Result<()> {
    poll(gpu, Some(submission), limit)
}

/// Gets over a shortage of memory: forgets it, and waits until nothing is under way and what has been dropped is free.
pub fn recover(gpu: &Gpu) -> Result<()> {
    gpu.forget_out_of_memory();
    poll(gpu, None, WARM_UP)
}

fn poll(gpu: &Gpu, submission: Option<wgpu::SubmissionIndex>, limit: Duration) -> Result<()> {
    let _watched = gpu.deadline.watch(limit);
    for _ in 0..TIMEOUTS {
        #[cfg(test)]
        if gpu.faults.hangs() {
            continue;
        }
        let wait = wgpu::PollType::Wait { submission_index: submission.clone(), timeout: Some(limit) };
        match gpu.device.poll(wait) {
            Ok(_) => return gpu.check(),
            Err(wgpu::PollError::Timeout) => gpu.check()?,
            Err(e) => {
                // A device that is gone says so only when it is asked once more.
                let _ = gpu.device.poll(wgpu::PollType::Poll);
                gpu.check()?;
                return Err(Error::DevicesLost(format!("{}: {e}", gpu.name)));
            }
        }
    }
    gpu.note(Trouble::Hung(limit.saturating_mul(TIMEOUTS)));
    gpu.check()
}

/// Copies `size` bytes of `source` to the host, waiting as [`wait`] does: for small buffers and tests.
pub fn read<T: bytemuck::Pod>(gpu: &Gpu, source: &wgpu::Buffer, size: u64, limit: Duration) -> Result<Vec<T>> {
    let staging = empty(gpu, "read back", size, wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("read back") });
    encoder.copy_buffer_to_buffer(source, 0, &staging, 0, size);
    let submission = gpu.queue.submit([encoder.finish()]);
    map(&staging);
    wait(gpu, submission, limit)?;
    let view =
        staging.slice(..size).get_mapped_range().map_err(|e| Error::DevicesLost(format!("{}: {e}", gpu.name)))?;
    Ok(bytemuck::pod_collect_to_vec(&view))
}

/// Asks for a staging buffer to be mapped for reading once the work before it is done.
pub fn map(staging: &wgpu::Buffer) {
    staging.slice(..).map_async(wgpu::MapMode::Read, |_| {});
}
