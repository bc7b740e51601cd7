//! The renderer's own choices, asked for one by one: kernels around its functions that scatter, and that aim at lights.

use glam::DVec3;

use crate::Result;
use crate::device::part::OnDevice;
use crate::device::prepared::Prepared;
use crate::device::rng::hash;
use crate::device::text::{Module, module};
use crate::device::windows::Windows;
use crate::gpu::adapter::Gpu;
use crate::gpu::buffer::{self, Buffer};
use crate::gpu::pass::{Pass, grid};
use crate::gpu::upload::NamedBuffers;
use crate::render::worker::{device_limits, upload};

/// Random numbers of each question.
pub const SAMPLES: u32 = 60_000;

/// The bin of `x` in [0, 1] among `n`.
pub fn bin(x: f64, n: usize) -> usize {
    ((x * n as f64) as usize).min(n - 1)
}

/// So many random numbers of 24 bits, as the device's samplers make them, N a time.
pub fn random<const N: usize>(count: u32, seed: u32) -> Vec<[f32; N]> {
    let number = |i: u32| (hash(hash(seed) ^ i) >> 8) as f32 / 16_777_216.0;
    (0..count).map(|i| std::array::from_fn(|j| number(N as u32 * i + j as u32))).collect()
}

/// A compiled kernel of one question a thread, and what it binds: `asked` and `given` of group 1 beside the scene.
pub struct Kernel<'a> {
    gpu: &'a Gpu,
    pass: Pass,
    scene: NamedBuffers,
    /// For what the modules declare and the kernel does not use.
    unused: Buffer,
}

impl<'a> Kernel<'a> {
    /// `module` in the place of the pass that follows paths, after all that it is made of.
    pub fn around(gpu: &'a Gpu, prepared: &Prepared, module: Module) -> Result<Kernel<'a>> {
        let scene = OnDevice { prepared, windows: Windows::of(&prepared.accel, device_limits(gpu).binding)? };
        let pass = Pass::new(gpu, &scene.around_tracing(module))?;
        let scene = upload(gpu, &scene)?;
        let unused = buffer::output(gpu, "unused", 256);
        Ok(Kernel { gpu, pass, scene, unused })
    }

    /// So many `answers` to what is `asked`.
    pub fn ask<T: bytemuck::Pod>(&self, asked: &[[f32; 4]], answers: usize) -> Result<Vec<T>> {
        let gpu = self.gpu;
        let input = buffer::storage(gpu, "asked", asked)?;
        let size = (size_of::<T>() * answers) as u64;
        let output = buffer::output(gpu, "given", size);
        self.pass.run(gpu, grid((answers as u32).div_ceil(64)), |name| match name {
            "asked" => Some(input.as_entire_buffer_binding()),
            "given" => Some(output.as_entire_buffer_binding()),
            _ => self.scene.find(name).or(Some(self.unused.as_entire_buffer_binding())),
        })?;
        buffer::read(gpu, &output, size, buffer::WARM_UP)
    }
}

fn vector([x, y, z, _]: &[f32; 4]) -> DVec3 {
    DVec3::new(f64::from(*x), f64::from(*y), f64::from(*z))
}

/// What was chosen for four random numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Chosen {
    /// One of a continuum.
    Spread(DVec3),
    /// The only direction of a mirror or of refraction.
    Only(DVec3),
    Nothing,
}

/// Directions at a surface along z of the first material of a general scene.
pub struct Scattering<'a>(Kernel<'a>);

impl<'a> Scattering<'a> {
    pub fn new(gpu: &'a Gpu, prepared: &Prepared) -> Result<Scattering<'a>> {
        Ok(Scattering(Kernel::around(gpu, prepared, module!("probes/choose.wgsl"))?))
    }

    /// Directions for random numbers (two for the direction, two for the part), light arriving along `o`.
    pub fn choose(&self, o: DVec3, behind: bool, random: &[[f32; 4]]) -> Result<Vec<Chosen>> {
        let questions: Vec<[[f32; 4]; 2]> = random.iter().map(|u| [*u, [0.0; 4]]).collect();
        let chosen = |given: &[f32; 4]| match given[3] {
            1.0 => Chosen::Spread(vector(given)),
            -1.0 => Chosen::Only(vector(given)),
            _ => Chosen::Nothing,
        };
        Ok(self.ask(o, behind, &questions)?.iter().map(chosen).collect())
    }

    /// The density by solid angle with which each direction is chosen.
    pub fn densities(&self, o: DVec3, behind: bool, directions: &[DVec3]) -> Result<Vec<f64>> {
        let question = |d: &DVec3| [d.as_vec3().extend(0.0).to_array(), [1.0, 0.0, 0.0, 0.0]];
        let questions: Vec<[[f32; 4]; 2]> = directions.iter().map(question).collect();
        Ok(self.ask(o, behind, &questions)?.iter().map(|[.., density]| f64::from(*density)).collect())
    }

    fn ask(&self, o: DVec3, behind: bool, questions: &[[[f32; 4]; 2]]) -> Result<Vec<[f32; 4]>> {
        let vertex = o.as_vec3().extend(if behind { 1.0 } else { 0.0 }).to_array();
        let asked: Vec<[f32; 4]> = std::iter::once(vertex).chain(questions.iter().flatten().copied()).collect();
        self.0.ask(&asked, questions.len())
    }
}

/// A point on a light, or the direction of one that is far away, and the density by solid angle with which it is chosen.
pub type Aimed = (DVec3, f64);

/// How the renderer aims at a light of a general scene: at its map, if there is one, else its first emitter.
pub struct Aiming<'a>(Kernel<'a>);

impl<'a> Aiming<'a> {
    pub fn new(gpu: &'a Gpu, prepared: &Prepared) -> Result<Aiming<'a>> {
        Ok(Aiming(Kernel::around(gpu, prepared, module!("probes/aim.wgsl"))?))
    }

    /// From `origin` (device units), for pairs of random numbers.
    pub fn aim(&self, origin: DVec3, random: &[[f32; 2]]) -> Result<Vec<Aimed>> {
        let question = |[x, y]: &[f32; 2]| [*x, *y, 0.0, 0.0];
        self.ask(origin, random.iter().map(question).collect())
    }

    /// The density of each direction towards the map or a sun; below zero where there is none.
    pub fn densities(&self, directions: &[DVec3]) -> Result<Vec<f64>> {
        let question = |d: &DVec3| d.as_vec3().extend(1.0).to_array();
        let given = self.ask(DVec3::ZERO, directions.iter().map(question).collect())?;
        Ok(given.into_iter().map(|(_, density)| density).collect())
    }

    fn ask(&self, origin: DVec3, questions: Vec<[f32; 4]>) -> Result<Vec<Aimed>> {
        let count = questions.len();
        let asked: Vec<[f32; 4]> = std::iter::once(origin.as_vec3().extend(0.0).to_array()).chain(questions).collect();
        Ok(self.0.ask(&asked, count)?.iter().map(|given: &[f32; 4]| (vector(given), f64::from(given[3]))).collect())
    }
}
