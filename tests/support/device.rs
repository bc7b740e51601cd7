//! Renders a scene on the first device and keeps the means of every epoch, for tests that compare and count.

use std::sync::{Arc, OnceLock};

use spectile::device::parts::paths::Thinning;
use spectile::device::prepared::Prepared;
use spectile::device::separable;
use spectile::device::words::Counters;
use spectile::gpu::adapter::Gpu;
use spectile::render::pilot;
use spectile::render::wave::Budget;
use spectile::render::worker::{UnitRect, Worker};
use spectile::scene::{Evaluator, Scene};
use spectile::spectral::Channels;
use spectile::spectral::product::{Basis, Expander};

use crate::report::{Part, timed};
use crate::statistics::{Bound, Estimate, assert_agreement, image_estimates};
use crate::truth;

/// How to render in a test.
#[derive(Debug, Clone, Copy)]
pub struct Settings {
    pub seed: u64,
    pub tile: [u32; 2],
    /// Upper bounds on the waves.
    pub budget: Budget,
    /// Units submitted together at most.
    pub units: usize,
    /// Run the shaders with the translator's bounds checks.
    pub checked: bool,
    /// Pretend that the device binds at most so many bytes.
    pub binding: Option<u64>,
    /// Roulette on evaluation: what the energy of a path, over the mean of the picture, is multiplied with to be its chance.
    pub scale: Option<f64>,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            seed: 0,
            tile: [16, 16],
            budget: Budget { memory: None, paths: None },
            units: usize::MAX,
            checked: false,
            binding: None,
            scale: None,
        }
    }
}

/// The means of equal epochs of one image.
pub struct Epochs {
    pub width: usize,
    pub height: usize,
    pub channels: usize,
    /// `means[epoch][(y * width + x) * channels + k]`.
    pub means: Vec<Vec<f32>>,
    pub counters: Counters,
    pub rays: u64,
}

/// Relative rounding of a mean of `samples` paths of up to `records` records: each record takes a few operations and a value from a
/// table, each step of the mean three, and one evaluator may fuse a product and a sum that another does not.
pub fn rounding(records: u32, samples: u32) -> f64 {
    (6.0 * f64::from(records) + 3.0 * f64::from(samples) + 8.0) * f64::from(f32::EPSILON) / 2.0
}

/// The device of this process, opened once.
pub fn shared() -> Arc<Gpu> {
    static SHARED: OnceLock<Arc<Gpu>> = OnceLock::new();
    Arc::clone(SHARED.get_or_init(|| Arc::new(Gpu::open().expect("a device"))))
}

/// One that fits: the shared one unless it must be told something.
fn device(settings: Settings) -> Arc<Gpu> {
    if !settings.checked && settings.binding.is_none() {
        return shared();
    }
    let mut gpu = Gpu::open().expect("a device");
    if settings.checked {
        gpu.shader_checks = wgpu::ShaderRuntimeChecks::checked();
    }
    if let Some(binding) = settings.binding {
        gpu.limits.max_storage_buffer_binding_size = binding;
    }
    Arc::new(gpu)
}

/// Renders `epochs` epochs of `samples` samples per pixel (a power of two) of the film's crop.
pub fn render(scene: &Scene, epochs: u32, samples: u32, settings: Settings) -> Epochs {
    let basis = scene.is_factored().then(|| separable::basis(scene).expect("a scene that separates"));
    let prepared = Prepared::new(scene, settings.seed).expect("a scene that fits");
    render_as(prepared, scene, basis.as_ref().map(|basis| (basis, &scene.channels)), epochs, samples, settings)
}

/// The paths of the factored render of a scene, evaluated in channels: as [`render`] of what is not factored, by its decisions.
pub fn render_paths_of_weights(scene: &Scene, epochs: u32, samples: u32, settings: Settings) -> Epochs {
    let factored = scene.clone().factored();
    let prepared = Prepared::for_evaluator(&factored, settings.seed, Evaluator::DpeptPixel);
    render_as(prepared.expect("a scene that fits"), &factored, None, epochs, samples, settings)
}

/// Of a factored render as it came back, the weights of all pixels, and the sum of what does not separate over pixels and channels.
pub fn parts_of(scene: &Scene, samples: u32, settings: Settings) -> (usize, f64) {
    let prepared = Prepared::new(&scene.clone().factored(), settings.seed).expect("a scene that fits");
    let mut worker =
        Worker::new(device(settings), Arc::new(prepared), settings.tile, settings.budget).expect("a worker");
    let [x0, y0, x1, y1] = scene.film.crop;
    worker.submit(&[[x0, y0, x1.min(x0 + settings.tile[0]), y1.min(y0 + settings.tile[1])]], 0, samples).expect("work");
    let collected = worker.collect().expect("results").expect("a unit");
    let remainder = collected.means().iter().map(|value| f64::from(*value)).sum();
    (collected.weights[0].len(), remainder)
}

/// As [`render`], a scene as weights of products of spectra; then with the spectra of `basis` in `channels`.
pub fn render_relit(
    scene: &Scene,
    basis: &Basis,
    channels: &Channels,
    epochs: u32,
    samples: u32,
    settings: Settings,
) -> Epochs {
    let factored = scene.clone().factored();
    let prepared = Prepared::new(&factored, settings.seed).expect("a scene that fits");
    render_as(prepared, &factored, Some((basis, channels)), epochs, samples, settings)
}

fn render_as(
    prepared: Prepared,
    scene: &Scene,
    factored: Option<(&Basis, &Channels)>,
    epochs: u32,
    samples: u32,
    settings: Settings,
) -> Epochs {
    let expander =
        factored.map(|(basis, channels)| Expander::new(basis, channels, scene.integrator.max_bounces as usize));
    let [x0, y0, x1, y1] = scene.film.crop;
    let mut prepared = Arc::new(prepared);
    if let Some(scale) = settings.scale {
        let pilot = pilot::choose(&device(settings), &prepared, scene, None, &Arc::default()).expect("a pilot");
        let thinning = Thinning::new(&prepared, scale, &pilot.mean_radiance);
        Arc::get_mut(&mut prepared).expect("nobody else's").thinning = Some(thinning);
    }
    let integration = prepared.integration.clone();
    let mut worker = timed(Part::Compilation, || {
        let mut worker = Worker::new(device(settings), prepared, settings.tile, settings.budget).expect("a worker");
        // Drivers compile what is left when it is first used: a wave of one pixel that nobody looks at.
        worker.submit(&[[x0, y0, x0 + 1, y0 + 1]], 0, 1).expect("a submission");
        worker.collect().expect("results");
        worker
    });
    let [tw, th] = settings.tile;
    let tiles: Vec<UnitRect> = (y0..y1)
        .step_by(th as usize)
        .flat_map(|y| (x0..x1).step_by(tw as usize).map(move |x| [x, y, (x + tw).min(x1), (y + th).min(y1)]))
        .collect();
    let channels = factored.map_or(scene.channels.len(), |(_, channels)| channels.len());
    let (width, height) = ((x1 - x0) as usize, (y1 - y0) as usize);
    let (mut counters, mut rays) = (Counters::default(), 0);
    let mut means = Vec::new();
    timed(Part::Rendering, || {
        for epoch in 0..epochs {
            let mut image = vec![f32::NAN; width * height * channels];
            let mut place = |collected: spectile::render::worker::Collected| {
                counters.overflow += collected.counters.overflow;
                counters.non_finite += collected.counters.non_finite;
                counters.negative += collected.counters.negative;
                rays += collected.counters.rays();
                let unit_size = (tw * th) as usize * channels;
                // As the renderer does where responses weight.
                let sums = integration.as_ref().map(|integration| integration.sums(collected.means()));
                let made = expander.as_ref().map(|expander| {
                    let mut means = vec![0.0f32; unit_size * collected.units.len()];
                    for (weights, means) in collected.weights.iter().zip(means.chunks_mut(unit_size)) {
                        let rows = expander.rows(&weights.products);
                        means.chunks_mut(channels).enumerate().for_each(|(i, out)| weights.expand(i, &rows, out));
                    }
                    // What does not separate, of the scene's own channels.
                    let remainder = sums.as_deref().unwrap_or(collected.means());
                    assert!(remainder.is_empty() || remainder.len() == means.len(), "channels of a remainder");
                    means.iter_mut().zip(remainder).for_each(|(value, other)| *value += other);
                    means
                });
                let means: &[f32] = made.as_deref().or(sums.as_deref()).unwrap_or(collected.means());
                for (unit, means) in collected.units.iter().zip(means.chunks(unit_size)) {
                    for y in unit[1]..unit[3] {
                        for x in unit[0]..unit[2] {
                            let from = ((y - unit[1]) * tw + x - unit[0]) as usize * channels;
                            let to = ((y - y0) as usize * width + (x - x0) as usize) * channels;
                            image[to..to + channels].copy_from_slice(&means[from..from + channels]);
                        }
                    }
                }
            };
            let at_once = worker.plan.units_at_once(samples).min(settings.units);
            for units in tiles.chunks(at_once) {
                worker.submit(units, epoch, samples).expect("a submission").into_iter().for_each(&mut place);
            }
            worker.collect().expect("results").into_iter().for_each(&mut place);
            means.push(image);
        }
    });
    Epochs { width, height, channels, means, counters, rays }
}

/// 16 x 16 pixels that look along one ray, `epochs` times 64 samples: replicas of one measurement.
pub fn measure(mut scene: Scene, epochs: u32, seed: u64) -> Vec<Estimate> {
    scene.film.width = 16;
    scene.film.height = 16;
    scene.film.crop = [0, 0, 16, 16];
    let rendered = render(&scene, epochs, 64, Settings { seed, ..Settings::default() });
    rendered.assert_clean();
    rendered.replicas()
}

/// Every pixel and channel, relative to its value or the channel's mean over the image, whichever is larger; and those means, five
/// times as sharply. `samples`: epochs and samples of each.
pub fn assert_as_reference(what: &str, scene: &Scene, samples: [u32; 2], of_reference: u32, bound: Bound) {
    let rendered = render(scene, samples[0], samples[1], Settings { seed: 5, ..Settings::default() });
    assert_rendered_as_reference(what, &rendered, scene, of_reference, bound);
}

/// The same of what is rendered already.
pub fn assert_rendered_as_reference(what: &str, rendered: &Epochs, scene: &Scene, of_reference: u32, bound: Bound) {
    rendered.assert_clean();
    let truth = truth::render_image(scene, of_reference, 6);
    let (channels, freedom) = (scene.channels.len(), f64::from(truth.samples - 1));
    let of_image = image_estimates(&truth.mean, &truth.standard_error, channels, freedom);
    let means: Vec<f64> = of_image.iter().map(|e| e.mean).collect();
    let scale: Vec<f64> = truth.mean.iter().enumerate().map(|(i, value)| value.max(means[i % channels])).collect();
    let truth: Vec<Estimate> = (truth.mean.iter().zip(&truth.standard_error))
        .map(|(&mean, &error)| Estimate { mean, error, freedom })
        .collect();
    assert_agreement(what, &rendered.values(), &truth, &scale, bound);
    let bound = Bound { resolution: 0.2 * bound.resolution, ..bound };
    assert_agreement(&format!("{what}, image"), &rendered.image_means(), &of_image, &means, bound);
}

impl Epochs {
    /// Mean of every value over the epochs, [y][x][k].
    pub fn values(&self) -> Vec<Estimate> {
        let value = |i: usize| Estimate::of(self.means.iter().map(|m| f64::from(m[i])));
        (0..self.means[0].len()).map(value).collect()
    }

    /// Mean of every channel over the image, from the spread of the epochs.
    pub fn image_means(&self) -> Vec<Estimate> {
        let pixels = (self.width * self.height) as f64;
        let mean = |m: &Vec<f32>, k: usize| {
            m.iter().skip(k).step_by(self.channels).map(|v| f64::from(*v)).sum::<f64>() / pixels
        };
        (0..self.channels).map(|k| Estimate::of(self.means.iter().map(|m| mean(m, k)))).collect()
    }

    /// Every channel where all pixels show the same point, so that pixels and epochs are replicas of one another.
    pub fn replicas(&self) -> Vec<Estimate> {
        let of_channel = |k: usize| self.means.iter().flat_map(move |m| m.iter().skip(k).step_by(self.channels));
        (0..self.channels).map(|k| Estimate::of(of_channel(k).map(|v| f64::from(*v)))).collect()
    }

    /// No sample was lost, negative or not finite.
    pub fn assert_clean(&self) {
        let Counters { overflow, non_finite, negative, .. } = self.counters;
        assert_eq!((overflow, non_finite, negative), (0, 0, 0), "overflow, non-finite, negative");
    }
}
