//! What lies between the passes of a wave.

use crate::device::words::{Counters, Wave};
use crate::gpu::adapter::Gpu;
use crate::gpu::buffer;
use crate::render::wave::WavePlan;

/// The buffers of a wave, by the names that shaders have for them.
pub struct PathBuffers {
    pub wave: wgpu::Buffer,
    pub units: wgpu::Buffer,
    pub steps: wgpu::Buffer,
    pub step_stride: u32,
    pub states: wgpu::Buffer,
    pub spectral_states: Option<wgpu::Buffer>,
    pub heads: wgpu::Buffer,
    pub records: wgpu::Buffer,
    pub throughputs: Option<wgpu::Buffer>,
    pub queue: wgpu::Buffer,
    pub queue_lengths: wgpu::Buffer,
    /// Where a pass says how many workgroups a bounce takes.
    pub launches: Option<wgpu::Buffer>,
    pub counters: wgpu::Buffer,
    pub means: wgpu::Buffer,
}

impl PathBuffers {
    pub fn new(gpu: &Gpu, plan: &WavePlan) -> PathBuffers {
        use wgpu::BufferUsages as U;
        let storage = U::STORAGE | U::COPY_SRC | U::COPY_DST;
        let step_stride = plan.step_stride();
        let mut step_bytes = vec![0u8; plan.step_bytes() as usize];
        for (step, bytes) in plan.steps().iter().zip(step_bytes.chunks_mut(step_stride as usize)) {
            bytes[..size_of_val(step)].copy_from_slice(bytemuck::bytes_of(step));
        }
        let steps = buffer::empty(gpu, "steps", plan.step_bytes(), U::UNIFORM | U::COPY_DST);
        gpu.queue.write_buffer(&steps, 0, &step_bytes);
        PathBuffers {
            wave: buffer::empty(gpu, "wave", size_of::<Wave>() as u64, U::UNIFORM | U::COPY_DST),
            units: buffer::empty(gpu, "units", plan.unit_list_bytes(), storage),
            steps,
            step_stride,
            states: buffer::empty(gpu, "states", plan.state_bytes(), storage),
            spectral_states: (plan.spectral_state_size > 0)
                .then(|| buffer::empty(gpu, "spectral_states", plan.spectral_state_bytes(), storage)),
            heads: buffer::empty(gpu, "heads", plan.head_bytes(), storage),
            records: buffer::empty(gpu, "records", plan.record_bytes(), storage),
            throughputs: plan.scaled.then(|| buffer::empty(gpu, "throughputs", plan.throughput_bytes(), storage)),
            queue: buffer::empty(gpu, "queue", plan.queue_bytes(), storage),
            queue_lengths: buffer::empty(gpu, "queue_lengths", plan.queue_length_bytes(), storage),
            launches: plan.launch_bytes().map(|bytes| buffer::empty(gpu, "launches", bytes, U::STORAGE | U::INDIRECT)),
            counters: buffer::empty(gpu, "counters", size_of::<Counters>() as u64, storage),
            means: buffer::empty(gpu, "means", plan.mean_bytes(), storage),
        }
    }

    pub fn find(&self, name: &str) -> Option<wgpu::BufferBinding<'_>> {
        let buffer = match name {
            "wave" => &self.wave,
            "units" => &self.units,
            "step" => {
                let size = wgpu::BufferSize::new(16);
                return Some(wgpu::BufferBinding { buffer: &self.steps, offset: 0, size });
            }
            "states" => &self.states,
            "spectral_states" => self.spectral_states.as_ref()?,
            "heads" => &self.heads,
            "records" => &self.records,
            "throughputs" => self.throughputs.as_ref()?,
            "queue" => &self.queue,
            "queue_lengths" => &self.queue_lengths,
            "launches" => self.launches.as_ref()?,
            "counters" => &self.counters,
            "means" => &self.means,
            _ => return None,
        };
        Some(buffer.as_entire_buffer_binding())
    }
}
