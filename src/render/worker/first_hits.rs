//! What single rays meet first, asked by the host.

use std::time::Duration;

use crate::device::words::{FIRST_HIT_OPEN, FIRST_HIT_OVERFLOW, NONE};
use crate::gpu::adapter::Gpu;
use crate::gpu::buffer;
use crate::gpu::pass::Pass;
use crate::gpu::source::Source;
use crate::gpu::upload::NamedBuffers;
use crate::render::wave::{FIRST_HIT_RAYS, UNUSED_BYTES};
use crate::{Error, Result};

/// A ray, as long as matters, in device units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Question {
    pub origin: [f32; 3],
    pub direction: [f32; 3],
    pub limit: f32,
}

/// The first primitive along a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Met {
    /// In device units.
    pub distance: f32,
    /// Index into `Accel::primitives`; `None` where there is nothing.
    pub primitive: Option<u32>,
    /// The instance that it is a part of, likewise; `None` in the world itself.
    pub instance: Option<u32>,
    /// Less than half of all rays are stopped there.
    pub is_open: bool,
}

/// The kernel, and its buffers.
pub struct FirstHits {
    pass: Pass,
    groups: Vec<wgpu::BindGroup>,
    asked: buffer::Buffer,
    met: buffer::Buffer,
    /// For what the modules declare and the kernel does not use.
    _unused: buffer::Buffer,
}

impl FirstHits {
    pub fn new(gpu: &Gpu, source: &Source, scene: &NamedBuffers) -> Result<FirstHits> {
        use wgpu::BufferUsages as U;
        let size = |bytes: usize| (bytes * FIRST_HIT_RAYS) as u64;
        let asked = buffer::empty(gpu, "asked", size(32), U::STORAGE | U::COPY_DST);
        let met = buffer::output(gpu, "met", size(16));
        let unused = buffer::output(gpu, "unused", UNUSED_BYTES);
        let pass = Pass::new(gpu, source)?;
        let find = |name: &str| match name {
            "asked" => Some(asked.as_entire_buffer_binding()),
            "met" => Some(met.as_entire_buffer_binding()),
            name => scene.find(name).or(Some(unused.as_entire_buffer_binding())),
        };
        let groups = (0..2).map(|group| pass.bind(gpu, group, find)).collect::<Result<_>>()?;
        Ok(FirstHits { pass, groups, asked, met, _unused: unused })
    }

    /// Answers in the order of `rays`.
    pub fn ask(&self, gpu: &Gpu, rays: &[Question], limit: Duration) -> Result<Vec<Met>> {
        let mut found = Vec::with_capacity(rays.len());
        for rays in rays.chunks(FIRST_HIT_RAYS) {
            let words: Vec<[f32; 4]> = rays
                .iter()
                .flat_map(|Question { origin: [x, y, z], direction: [u, v, w], limit }| {
                    [[*x, *y, *z, *limit], [*u, *v, *w, 0.0]]
                })
                .collect();
            {
                let _watched = gpu.deadline.watch(limit);
                gpu.queue.write_buffer(&self.asked, 0, bytemuck::cast_slice(&words));
                let mut encoder =
                    gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("first hits") });
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
                pass.set_pipeline(&self.pass.pipeline);
                for (i, group) in (0..).zip(&self.groups) {
                    pass.set_bind_group(i, group, &[]);
                }
                pass.dispatch_workgroups((rays.len() as u32).div_ceil(64), 1, 1);
                drop(pass);
                gpu.queue.submit([encoder.finish()]);
            }
            let met: Vec<[u32; 4]> = buffer::read(gpu, &self.met, (rays.len() * 16) as u64, limit)?;
            for [distance, primitive, flags, instance] in met {
                if flags & FIRST_HIT_OVERFLOW != 0 {
                    let what = "a ray met more primitives than can be tested: too many triangles overlap in one place; remove \
                                duplicates";
                    return Err(Error::Usage(what.into()));
                }
                found.push(Met {
                    distance: f32::from_bits(distance),
                    primitive: (primitive != NONE).then_some(primitive),
                    instance: (primitive != NONE && instance != NONE).then_some(instance),
                    is_open: flags & FIRST_HIT_OPEN != 0,
                });
            }
        }
        Ok(found)
    }
}
