//! The directions that the device chooses towards a scene's map, or its first sun, and their densities.

use glam::DVec3;
use spectile::gpu::adapter::Gpu;
use spectile::gpu::buffer;
use spectile::gpu::pass::Pass;
use spectile::gpu::shader::{self, Module};
use spectile::gpu::upload::{self, SceneBuffers};
use spectile::render::prepare::Prepared;
use spectile::render::worker::device_limits;

const AIM: Module = Module { name: "tests/aimer/aim.wgsl", text: include_str!("aim.wgsl") };

/// A direction and its density by solid angle.
pub type Aimed = (DVec3, f64);

/// For each pair of random numbers the direction chosen; for each direction the density of choosing it.
pub fn aim(prepared: &Prepared, random: &[[f32; 2]], directions: &[DVec3]) -> (Vec<Aimed>, Vec<f64>) {
    let gpu = Gpu::open().expect("a device");
    let windows = upload::windows(prepared, device_limits(&gpu).binding).expect("a scene that fits");
    let scene = SceneBuffers::new(&gpu, prepared, &windows).expect("buffers");
    let lights = if prepared.sky.is_some() { shader::MAP } else { shader::LAMP };
    let modules = [shader::TYPES, shader::GEOMETRY, lights, AIM];
    let pass = Pass::new(&gpu, &shader::compose(&modules, &prepared.defines(&windows))).expect("a pass");

    let asked = random.iter().map(|[x, y]| [*x, *y, 0.0, 0.0]);
    let asked: Vec<[f32; 4]> = asked.chain(directions.iter().map(|d| d.as_vec3().extend(1.0).to_array())).collect();
    let input = buffer::storage(&gpu, "asked", &asked).expect("a buffer");
    let size = 16 * asked.len() as u64;
    let output = buffer::empty(&gpu, "given", size, wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
    let groups = [0, 1].map(|group| {
        pass.bind(&gpu, group, |name| match name {
            "asked" => Some(input.as_entire_buffer_binding()),
            "given" => Some(output.as_entire_buffer_binding()),
            _ => scene.find(name),
        })
        .expect("a bind group")
    });
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("aim") });
    {
        let mut compute = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        compute.set_pipeline(&pass.pipeline);
        compute.set_bind_group(0, &groups[0], &[]);
        compute.set_bind_group(1, &groups[1], &[]);
        compute.dispatch_workgroups((asked.len() as u32).div_ceil(64), 1, 1);
    }
    let submission = gpu.queue.submit([encoder.finish()]);
    buffer::wait(&gpu, submission, buffer::WARM_UP).expect("results");
    let given: Vec<[f32; 4]> = buffer::read(&gpu, &output, size, buffer::WARM_UP).expect("results");
    let all = given.iter().map(|[x, y, z, density]| (DVec3::new(*x as f64, *y as f64, *z as f64), f64::from(*density)));
    let mut chosen: Vec<Aimed> = all.collect();
    let densities = chosen.split_off(random.len()).into_iter().map(|(_, density)| density).collect();
    (chosen, densities)
}
