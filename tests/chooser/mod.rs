//! The directions that the device chooses at a surface of a scene's first material, and their densities.

use glam::DVec3;
use spectile::gpu::adapter::Gpu;
use spectile::gpu::buffer;
use spectile::gpu::pass::Pass;
use spectile::gpu::shader::{self, Module};
use spectile::gpu::upload::{self, SceneBuffers};
use spectile::render::prepare::Prepared;
use spectile::render::worker::device_limits;

const CHOOSE: Module = Module { name: "tests/chooser/choose.wgsl", text: include_str!("choose.wgsl") };

/// What was chosen for four random numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Chosen {
    /// One of a continuum.
    Spread(DVec3),
    /// The only direction of a mirror or of refraction.
    Only(DVec3),
    Nothing,
}

/// A compiled kernel and what it binds.
pub struct Chooser {
    gpu: Gpu,
    pass: Pass,
    scene: SceneBuffers,
    /// For what the modules declare and this kernel does not use.
    unused: wgpu::Buffer,
}

impl Chooser {
    pub fn new(prepared: &Prepared) -> Chooser {
        let gpu = Gpu::open().expect("a device");
        let windows = upload::windows(prepared, device_limits(&gpu).binding).expect("a scene that fits");
        let scene = SceneBuffers::new(&gpu, prepared, &windows).expect("buffers");
        let mut modules = prepared.bounce_modules();
        // Everything but the pass itself.
        modules.pop();
        modules.push(CHOOSE);
        let pass = Pass::new(&gpu, &shader::compose(&modules, &prepared.defines(&windows))).expect("a pass");
        let unused = buffer::empty(&gpu, "unused", 256, wgpu::BufferUsages::STORAGE);
        Chooser { gpu, pass, scene, unused }
    }

    /// Directions for random numbers (two for the direction, two for the part), light arriving along `o`.
    pub fn choose(&self, o: DVec3, behind: bool, random: &[[f32; 4]]) -> Vec<Chosen> {
        let questions: Vec<[[f32; 4]; 2]> = random.iter().map(|u| [*u, [0.0; 4]]).collect();
        let chosen = |[x, y, z, how]: &[f32; 4]| {
            let direction = DVec3::new(f64::from(*x), f64::from(*y), f64::from(*z));
            match how {
                1.0 => Chosen::Spread(direction),
                -1.0 => Chosen::Only(direction),
                _ => Chosen::Nothing,
            }
        };
        self.ask(o, behind, &questions).iter().map(chosen).collect()
    }

    /// The density by solid angle with which each direction is chosen.
    pub fn densities(&self, o: DVec3, behind: bool, directions: &[DVec3]) -> Vec<f64> {
        let question = |d: &DVec3| [d.as_vec3().extend(0.0).to_array(), [1.0, 0.0, 0.0, 0.0]];
        let questions: Vec<[[f32; 4]; 2]> = directions.iter().map(question).collect();
        self.ask(o, behind, &questions).iter().map(|[.., density]| f64::from(*density)).collect()
    }

    fn ask(&self, o: DVec3, behind: bool, questions: &[[[f32; 4]; 2]]) -> Vec<[f32; 4]> {
        let gpu = &self.gpu;
        let vertex = o.as_vec3().extend(if behind { 1.0 } else { 0.0 }).to_array();
        let asked: Vec<[f32; 4]> = std::iter::once(vertex).chain(questions.iter().flatten().copied()).collect();
        let input = buffer::storage(gpu, "asked", &asked).expect("a buffer");
        let size = 16 * questions.len() as u64;
        let output = buffer::empty(gpu, "given", size, wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
        let groups = [0, 1].map(|group| {
            self.pass
                .bind(gpu, group, |name| match name {
                    "asked" => Some(input.as_entire_buffer_binding()),
                    "given" => Some(output.as_entire_buffer_binding()),
                    _ => self.scene.find(name).or(Some(self.unused.as_entire_buffer_binding())),
                })
                .expect("a bind group")
        });
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("choose") });
        {
            let mut compute = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            compute.set_pipeline(&self.pass.pipeline);
            compute.set_bind_group(0, &groups[0], &[]);
            compute.set_bind_group(1, &groups[1], &[]);
            let workgroups = (questions.len() as u32).div_ceil(64);
            compute.dispatch_workgroups(workgroups.min(1024), workgroups.div_ceil(1024), 1);
        }
        let submission = gpu.queue.submit([encoder.finish()]);
        buffer::wait(gpu, submission, buffer::WARM_UP).expect("results");
        buffer::read(gpu, &output, size, buffer::WARM_UP).expect("results")
    }
}
