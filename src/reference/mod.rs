//! A small, plain, independent f64 path tracer on the CPU that every shader result is tested against.
//! Shares `scene`, `spectral` and the tables of `scattering` with the renderer and nothing else: its random numbers,
//! intersections, BSDFs, sampling strategies and estimator are its own, so that an agreement means something.
//!
//! Every sample is independent (no stratification), which is what makes [`Estimate::standard_error`] honest.

mod bsdf;
mod camera;
mod flight;
mod gas;
mod lights;
mod path;
mod phase;
mod primitive;
mod rng;
mod shading;
mod sky;
mod texture;
mod world;

use path::{Path, Tracer};
use rayon::prelude::*;
use rng::Rng;

use crate::scene::Scene;

/// Mean spectral radiance of pixels over each channel's interval, with its uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// \[pixel\]\[K\], W m⁻² sr⁻¹ nm⁻¹. NaN without samples.
    pub mean: Vec<f64>,
    /// Standard error of the mean, same shape and unit; NaN below two samples.
    pub standard_error: Vec<f64>,
    /// Samples (paths) per pixel.
    pub samples: u32,
}

/// Radiance of `pixels`, given as (x, y) in the full film, from `samples` paths each.
///
/// What is placed several times is copied. The result depends on the arguments only, not on the number of cores. Cost: about a microsecond per surface met
/// in a simple scene, plus a few nanoseconds per channel.
pub fn render(scene: &Scene, pixels: &[[u32; 2]], samples: u32, seed: u64) -> Estimate {
    let scene = &*scene.copied();
    let tracer = Tracer::new(scene);
    let blocks = samples.div_ceil(BLOCK) as usize;
    let render_block = |path: &mut Path, job: usize| {
        let (pixel, block) = (pixels[job / blocks], (job % blocks) as u32);
        let mut rng = Rng::from_keys(&[seed, u64::from(pixel[0]), u64::from(pixel[1]), u64::from(block)]);
        let mut moments = Moments::new(scene.channels.len());
        for _ in 0..BLOCK.min(samples - block * BLOCK) {
            tracer.trace(pixel, &mut rng, path);
            moments.add(&path.radiance);
        }
        moments
    };
    // Merged in one order, whoever computed them. No two take the same time, so that each is given out by itself.
    let jobs = (0..pixels.len() * blocks).into_par_iter().with_max_len(1);
    let moments: Vec<Moments> = jobs.map_init(|| Path::new(scene), render_block).collect();

    let mut estimate = Estimate { mean: Vec::new(), standard_error: Vec::new(), samples };
    let mut moments = moments.into_iter();
    for _ in pixels {
        let pixel = moments.by_ref().take(blocks).reduce(Moments::merge);
        let pixel = pixel.unwrap_or_else(|| Moments::new(scene.channels.len()));
        pixel.finish(&mut estimate);
    }
    estimate
}

/// Radiance of every pixel of the crop, row by row.
pub fn render_image(scene: &Scene, samples: u32, seed: u64) -> Estimate {
    let [x0, y0, x1, y1] = scene.film.crop;
    let pixels: Vec<[u32; 2]> = (y0..y1).flat_map(|y| (x0..x1).map(move |x| [x, y])).collect();
    render(scene, &pixels, samples, seed)
}

/// Samples of one pixel that are taken in one go, with one stream of random numbers: what threads share out.
const BLOCK: u32 = 1024;

/// Running mean and sum of squared deviations per channel (Welford 1962).
struct Moments {
    count: u32,
    mean: Vec<f64>,
    squares: Vec<f64>,
}

impl Moments {
    fn new(channels: usize) -> Self {
        Moments { count: 0, mean: vec![0.0; channels], squares: vec![0.0; channels] }
    }

    fn add(&mut self, values: &[f64]) {
        self.count += 1;
        let n = f64::from(self.count);
        for ((mean, squares), x) in self.mean.iter_mut().zip(&mut self.squares).zip(values) {
            let before = x - *mean;
            *mean += before / n;
            *squares += before * (x - *mean);
        }
    }

    /// Chan, Golub, LeVeque 1979.
    fn merge(mut self, other: Moments) -> Moments {
        let (a, b) = (f64::from(self.count), f64::from(other.count));
        for k in 0..self.mean.len() {
            let delta = other.mean[k] - self.mean[k];
            self.mean[k] += delta * (b / (a + b));
            self.squares[k] += other.squares[k] + delta * delta * (a * b / (a + b));
        }
        self.count += other.count;
        self
    }

    fn finish(&self, estimate: &mut Estimate) {
        let n = f64::from(self.count);
        estimate.mean.extend(self.mean.iter().map(|m| if self.count == 0 { f64::NAN } else { *m }));
        // 0/0 below two samples: no spread is known.
        let error = |squares: &f64| (squares.max(0.0) / (n * (n - 1.0).max(0.0))).sqrt();
        estimate.standard_error.extend(self.squares.iter().map(error));
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, DVec3};

    use super::*;
    use crate::scene::{
        Camera, Environment, Evaluation, Evaluator, Film, Filter, Integrator, Projection, Sampler, Shape, Spectrum,
        Wavelengths,
    };
    use crate::spectral::{Channels, Curve, Outside};

    /// A grey sphere before a sky whose spectrum rises: every random decision matters.
    fn small_scene() -> Scene {
        let rising = Curve::Linear { nm: vec![400.0, 700.0], value: vec![1.0, 2.0], outside: Outside::Zero };
        let spectra =
            [Curve::Constant(0.5), rising].map(|curve| Spectrum { name: "test".into(), curve, definition: None });
        Scene {
            file: "test".into(),
            camera: Camera {
                position: DVec3::new(0.0, 0.0, 3.0),
                forward: DVec3::NEG_Z,
                right: DVec3::X,
                up: DVec3::Y,
                projection: Projection::Perspective { tan_half: DVec2::splat(0.5) },
                distortion: None,
            },
            film: Film { width: 4, height: 3, filter: Filter::Gaussian, crop: [1, 0, 4, 2] },
            channels: Channels::equal(400.0, 700.0, 2),
            integrator: Integrator {
                max_bounces: 3,
                russian_roulette_start: 1,
                sampler: Sampler::Independent,
                wavelengths: Wavelengths::Uniform,
                wavelengths_per_channel: Some(1),
                techniques: None,
                forced_collision: false,
                evaluation: Evaluation::All,
                evaluator: Evaluator::Auto,
                epoch: 64,
            },
            spectra: spectra.into(),
            materials: vec![crate::scene::Material {
                name: "grey".into(),
                bsdf: crate::scene::Bsdf::Diffuse { reflectance: crate::scene::Reflectance::Spectrum(0) },
                two_sided: true,
                temperature: None,
                opacity: None,
            }],
            textures: vec![],
            objects: vec![crate::scene::Object {
                name: "ball".into(),
                shape: Shape::Sphere { center: DVec3::ZERO, radius: 1.0 },
                attributes: crate::scene::Attributes::default(),
                material: Some(0),
                emission: None,
                interior: None,
                assembly: None,
            }],
            assemblies: vec![],
            media: vec![],
            camera_medium: None,
            lights: vec![],
            environment: Some(Environment::Uniform(1)),
            georeference: None,
            first_hits: false,
            warnings: vec![],
            digest: String::new(),
        }
    }

    /// Bit for bit the same on 1, 2 and 5 threads, with samples that do not fill the last block; other seeds differ;
    /// `render_image` is `render` of the crop's pixels row by row.
    #[test]
    fn result_depends_on_arguments_only() {
        let scene = small_scene();
        let pixels = [[1, 0], [2, 0], [3, 0], [1, 1], [2, 1], [3, 1]];
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| render(&scene, &pixels, 2500, 7))
        };
        let one = on(1);
        assert_eq!(one.mean.len(), 12);
        for threads in [2, 5] {
            assert_eq!(on(threads), one);
        }
        assert_eq!(render_image(&scene, 2500, 7), one);
        assert_ne!(render(&scene, &pixels, 2500, 8).mean, one.mean);
        assert_eq!(render(&scene, &pixels[3..4], 2500, 7).mean, one.mean[6..8]);
        assert!(render(&scene, &[], 10, 0).mean.is_empty());
        assert!(render(&scene, &pixels[..1], 0, 0).mean.iter().all(|m| m.is_nan()));
    }

    /// Blocks merged equal one long run, to rounding, and the textbook formula.
    #[test]
    fn moments_merge() {
        let values: Vec<f64> = (0..1000).map(|i| 1e6 + f64::from(i * i % 97)).collect();
        let moments = |values: &[f64]| {
            let mut m = Moments::new(1);
            values.iter().for_each(|x| m.add(&[*x]));
            m
        };
        let whole = moments(&values);
        let parts = values.chunks(77).map(moments).reduce(Moments::merge).unwrap();
        let mean = values.iter().sum::<f64>() / 1000.0;
        let squares: f64 = values.iter().map(|x| (x - mean).powi(2)).sum();
        for m in [&whole, &parts] {
            assert_eq!(m.count, 1000);
            assert!((m.mean[0] - mean).abs() < 1e-8);
            assert!((m.squares[0] / squares - 1.0).abs() < 1e-9);
        }
        let mut estimate = Estimate { mean: vec![], standard_error: vec![], samples: 1000 };
        whole.finish(&mut estimate);
        assert!((estimate.standard_error[0] / (squares / 999.0 / 1000.0).sqrt() - 1.0).abs() < 1e-9);
    }

    #[test]
    fn too_few_samples_have_no_error() {
        for count in 0..2 {
            let mut m = Moments::new(1);
            (0..count).for_each(|_| m.add(&[3.0]));
            let mut estimate = Estimate { mean: vec![], standard_error: vec![], samples: count };
            m.finish(&mut estimate);
            assert!(estimate.standard_error[0].is_nan());
            assert_eq!(estimate.mean[0].is_nan(), count == 0);
        }
    }
}
