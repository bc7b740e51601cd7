//! Rays of a test's own choice through the renderer's traversal and intersections on the first device.

use spectile::gpu::adapter::Gpu;
use spectile::gpu::buffer;
use spectile::gpu::layout::NONE;
use spectile::gpu::pass::Pass;
use spectile::gpu::shader::{self, Module};
use spectile::gpu::upload::{self, SceneBuffers};
use spectile::render::prepare::Prepared;
use spectile::render::worker::device_limits;

const TRACE: Module = Module { name: "tests/tracer/trace.wgsl", text: include_str!("trace.wgsl") };

/// A ray in device units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    pub origin: [f32; 3],
    pub direction: [f32; 3],
}

/// What the nearest primitive along a ray is, and how far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    pub distance: f32,
    /// Index into `Accel::primitives`; `None` for a miss.
    pub primitive: Option<u32>,
    /// The traversal gave up.
    pub overflow: bool,
}

/// The nearest hits of `rays`, at most four million.
pub fn trace(prepared: &Prepared, rays: &[Ray]) -> Vec<Hit> {
    let gpu = Gpu::open().expect("a device");
    let windows = upload::windows(prepared, device_limits(&gpu).binding).expect("a scene that fits");
    let scene = SceneBuffers::new(&gpu, prepared, &windows).expect("buffers");
    let mut modules = prepared.bounce_modules();
    // Everything but the pass itself.
    modules.pop();
    modules.push(TRACE);
    let pass = Pass::new(&gpu, &shader::compose(&modules, &prepared.defines(&windows))).expect("a pass");

    let packed: Vec<[f32; 8]> = rays
        .iter()
        .map(|Ray { origin: [x, y, z], direction: [u, v, w] }| [*x, *y, *z, 3.0e38, *u, *v, *w, 0.0])
        .collect();
    let input = buffer::storage(&gpu, "rays", &packed).expect("a buffer");
    let size = 16 * rays.len() as u64;
    let output = buffer::empty(&gpu, "hits", size, wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
    let groups = [0, 1].map(|group| {
        pass.bind(&gpu, group, |name| match name {
            "rays" => Some(input.as_entire_buffer_binding()),
            "hits" => Some(output.as_entire_buffer_binding()),
            _ => scene.find(name),
        })
        .expect("a bind group")
    });
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("trace") });
    {
        let mut compute = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        compute.set_pipeline(&pass.pipeline);
        compute.set_bind_group(0, &groups[0], &[]);
        compute.set_bind_group(1, &groups[1], &[]);
        compute.dispatch_workgroups((rays.len() as u32).div_ceil(64), 1, 1);
    }
    let submission = gpu.queue.submit([encoder.finish()]);
    buffer::wait(&gpu, submission, buffer::WARM_UP).expect("results");
    let hits: Vec<[u32; 4]> = buffer::read(&gpu, &output, size, buffer::WARM_UP).expect("results");
    hits.iter()
        .map(|[distance, primitive, overflow, _]| Hit {
            distance: f32::from_bits(*distance),
            primitive: (*primitive != NONE).then_some(*primitive),
            overflow: *overflow != 0,
        })
        .collect()
}
