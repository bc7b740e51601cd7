//! Renders measured against a reference while they go on: error against samples and seconds.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::cube::{Cube, epoch_samples};
use crate::device::prepared::Prepared;
use crate::device::words::Counters;
use crate::gpu::adapter::Gpu;
use crate::render::interrupt::Interrupt;
use crate::render::plan;
use crate::render::wave::Budget;
use crate::render::worker::{Collected, UnitRect, Worker};
use crate::scene::Scene;
use crate::{Error, Result};

/// A picture, and how far its epochs spread. Values are [pixel][channel].
pub struct Image {
    pub mean: Vec<f64>,
    /// Of the epochs' means about their mean: Σ squares (Welford).
    spread: Vec<f64>,
    /// Full epochs, the first ones of 1, 1, 2, … samples together as one.
    epochs: u32,
    pub samples: u32,
    channels: usize,
    /// Samples of a path and channel that were not finite, or negative; and paths that found no end in a structure.
    pub non_finite: u64,
    pub negative: u64,
    pub overflow: u64,
}

/// What `render` would have after an epoch.
#[derive(Debug, Clone)]
pub struct Point {
    pub samples: u32,
    /// Of rendering and merging.
    pub seconds: f64,
    /// Per channel: relMSE, root of Σ (x - ref)² / Σ ref², and the estimate of that, NaN where there is none. What the reference's own
    /// noise adds is taken away.
    pub rel_mse: Vec<f64>,
    pub error: Vec<f64>,
    pub estimate: Vec<f64>,
}

impl Point {
    /// Of all channels.
    pub fn mean_rel_mse(&self) -> f64 {
        mean(&self.rel_mse)
    }

    /// The errors and the estimates, root mean square over channels.
    pub fn rms_error(&self) -> f64 {
        root_mean_square(&self.error)
    }

    pub fn rms_estimate(&self) -> f64 {
        root_mean_square(&self.estimate)
    }
}

pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

pub(super) fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

/// What is true, as far as is known. Values are [pixel][channel].
pub struct Reference {
    pub mean: Vec<f64>,
    /// Per channel: what its noise adds to relMSE and to the mean square error relative to that of the radiance.
    pub rel_noise: Vec<f64>,
    pub noise: Vec<f64>,
    channels: usize,
    pub what: String,
}

impl Image {
    fn new(pixels: usize, channels: usize) -> Image {
        let values = vec![0.0; pixels * channels];
        Image {
            spread: values.clone(),
            mean: values,
            epochs: 0,
            samples: 0,
            channels,
            non_finite: 0,
            negative: 0,
            overflow: 0,
        }
    }

    /// Adds an epoch's means of all pixels.
    fn add(&mut self, epoch: &[f32], samples: u32, full: u32) {
        let share = f64::from(samples) / f64::from(self.samples + samples);
        self.samples += samples;
        // Epochs are equal from the first full one on.
        let spreads = samples == full && self.samples > full;
        for ((mean, spread), &value) in self.mean.iter_mut().zip(&mut self.spread).zip(epoch) {
            let before = f64::from(value) - *mean;
            *mean += before * share;
            if spreads {
                *spread += before * (f64::from(value) - *mean);
            }
        }
        self.epochs = self.samples / full;
    }

    /// The variance of the mean of a value; NaN below two epochs.
    pub fn variance(&self, i: usize) -> f64 {
        let epochs = f64::from(self.epochs);
        if self.epochs < 2 { f64::NAN } else { self.spread[i] / (epochs * (epochs - 1.0)) }
    }

    /// sqrt(Σ variance of the mean / Σ mean²) per channel: the error estimate of docs/METHOD.md, Errors.
    fn estimate(&self) -> Vec<f64> {
        self.per_channel(|i| (self.variance(i), self.mean[i] * self.mean[i])).map(f64::sqrt).collect()
    }

    /// Σ numerator / Σ denominator over the pixels of each channel; 0 where nothing is anywhere.
    fn per_channel(&self, of: impl Fn(usize) -> (f64, f64)) -> impl Iterator<Item = f64> {
        ratios(self.mean.len(), self.channels, of).into_iter()
    }
}

fn ratios(values: usize, channels: usize, of: impl Fn(usize) -> (f64, f64)) -> Vec<f64> {
    let mut sums = vec![(0.0, 0.0); channels];
    for i in 0..values {
        let (sum, (numerator, denominator)) = (&mut sums[i % channels], of(i));
        *sum = (sum.0 + numerator, sum.1 + denominator);
    }
    sums.into_iter().map(|(n, d)| if n == 0.0 { 0.0 } else { n / d }).collect()
}

impl Reference {
    pub fn of_image(image: &Image) -> Reference {
        let epsilon = epsilon(&image.mean, image.channels);
        let count = image.mean.len();
        let rel_noise = ratios(count, image.channels, |i| {
            let square = image.mean[i] * image.mean[i] + epsilon[i % image.channels];
            (if square > 0.0 { image.variance(i) / square } else { 0.0 }, 1.0)
        });
        let noise = ratios(count, image.channels, |i| (image.variance(i), image.mean[i] * image.mean[i]));
        let what = format!("an independent render of {} samples per pixel", image.samples);
        Reference { mean: image.mean.clone(), rel_noise, noise, channels: image.channels, what }
    }

    /// A cube of the scene's size and channels, taken as exact.
    pub fn of_cube(cube: &Cube, scene: &Scene) -> Result<Reference> {
        let (header, size, channels) = (cube.header(), scene.film.cube_size(), scene.channels.len());
        if header.size != size || header.channels.bounds != scene.channels.bounds {
            return Err(Error::Usage(format!(
                "--reference {}: has {} x {} pixels and {} channels, or other ones than the scene, which has {} x {} and {channels}",
                cube.path().display(),
                header.size[0],
                header.size[1],
                header.channels.len(),
                size[0],
                size[1]
            )));
        }
        let mut mean = Vec::with_capacity(size[0] as usize * size[1] as usize * channels);
        for (y, x) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (y, x))) {
            let Some(spectrum) = cube.spectrum(x, y)? else {
                let what = format!("--reference {}: pixel {x}, {y} is not rendered", cube.path().display());
                return Err(Error::Usage(what));
            };
            mean.extend(spectrum.into_iter().map(f64::from));
        }
        let zeros = vec![0.0; channels];
        let what = format!("{}, taken as exact", cube.path().display());
        Ok(Reference { mean, rel_noise: zeros.clone(), noise: zeros, channels, what })
    }

    fn point(&self, image: &Image, seconds: f64) -> Point {
        let epsilon = epsilon(&self.mean, self.channels);
        let distance = |i: usize| (image.mean[i] - self.mean[i]).powi(2);
        let square = |i: usize| self.mean[i] * self.mean[i];
        let rel_mse = ratios(self.mean.len(), self.channels, |i| {
            let distance = distance(i);
            (if distance == 0.0 { 0.0 } else { distance / (square(i) + epsilon[i % self.channels]) }, 1.0)
        });
        let error = ratios(self.mean.len(), self.channels, |i| (distance(i), square(i)));
        let net = |of: Vec<f64>, noise: &[f64]| of.into_iter().zip(noise).map(|(v, n)| (v - n).max(0.0)).collect();
        let error: Vec<f64> = net(error, &self.noise);
        Point {
            samples: image.samples,
            seconds,
            rel_mse: net(rel_mse, &self.rel_noise),
            error: error.into_iter().map(f64::sqrt).collect(),
            estimate: image.estimate(),
        }
    }
}

/// ε_k = (0.01 mean)² of relMSE, which keeps dark pixels from ruling.
fn epsilon(mean: &[f64], channels: usize) -> Vec<f64> {
    ratios(mean.len(), channels, |i| (mean[i], 1.0)).into_iter().map(|mean| (0.01 * mean).powi(2)).collect()
}

/// Where a trial ends.
#[derive(Debug, Clone, Copy)]
pub struct Limit {
    pub time: Duration,
    pub samples: u32,
}

/// Renders `scene` on `gpu` until `limit`, in tiles of a size other than the default if one is given, and tells `after` of every epoch: the picture and the seconds of
/// rendering so far, without set-up.
pub fn render(
    scene: &Scene,
    seed: u64,
    tile: Option<u32>,
    gpu: &Arc<Gpu>,
    limit: Limit,
    interrupt: &Arc<Interrupt>,
    mut after: impl FnMut(&Image, f64) -> Result<()>,
) -> Result<Image> {
    let prepared = Arc::new(Prepared::for_evaluator(scene, seed, plan::evaluator(scene, None, gpu.is_software)?)?);
    let integration = prepared.integration.clone();
    let tile = plan::tile_size(scene, tile);
    let mut worker = Worker::new(Arc::clone(gpu), prepared, tile, Budget { memory: None, paths: None })?;
    worker.watch(interrupt);
    let [x0, y0, x1, y1] = scene.film.crop;
    let units: Vec<UnitRect> = (y0..y1)
        .step_by(tile[1] as usize)
        .flat_map(|y| (x0..x1).step_by(tile[0] as usize).map(move |x| (x, y)))
        .map(|(x, y)| [x, y, (x + tile[0]).min(x1), (y + tile[1]).min(y1)])
        .collect();
    let (width, channels, full) = ((x1 - x0) as usize, scene.channels.len(), scene.integrator.epoch);
    let mut image = Image::new(width * (y1 - y0) as usize, channels);
    let mut epoch_means = vec![0.0f32; image.mean.len()];
    // The kernels are compiled by what is thrown away.
    worker.submit(&units[..1], 0, 1)?;
    worker.collect()?;

    let mut seconds = 0.0;
    for epoch in 0.. {
        let samples = epoch_samples(epoch, full);
        let pace = if image.samples == 0 { 0.0 } else { seconds / f64::from(image.samples) };
        if epoch > 0
            && (image.samples >= limit.samples || seconds + pace * f64::from(samples) > limit.time.as_secs_f64())
        {
            break;
        }
        interrupt.check()?;
        let began = Instant::now();
        let mut bad = [0u64; 3];
        let mut place = |collected: Collected| {
            let Counters { non_finite, negative, overflow, .. } = collected.counters;
            bad = [0, 1, 2].map(|i| bad[i] + u64::from([non_finite, negative, overflow][i]));
            let sums = integration.as_ref().map(|integration| integration.sums(collected.means()));
            let means = sums.as_deref().unwrap_or(collected.means());
            let unit_size = tile[0] as usize * tile[1] as usize * channels;
            for (unit, means) in collected.units.iter().zip(means.chunks(unit_size)) {
                let row = (unit[2] - unit[0]) as usize * channels;
                for y in unit[1]..unit[3] {
                    let from = (y - unit[1]) as usize * tile[0] as usize * channels;
                    let to = ((y - y0) as usize * width + (unit[0] - x0) as usize) * channels;
                    epoch_means[to..to + row].copy_from_slice(&means[from..from + row]);
                }
            }
        };
        for units in units.chunks(worker.plan.units_at_once(samples)) {
            worker.submit(units, epoch, samples)?.into_iter().for_each(&mut place);
        }
        worker.collect()?.into_iter().for_each(place);
        image.add(&epoch_means, samples, full);
        [image.non_finite, image.negative, image.overflow] =
            [image.non_finite + bad[0], image.negative + bad[1], image.overflow + bad[2]];
        seconds += began.elapsed().as_secs_f64();
        after(&image, seconds)?;
    }
    Ok(image)
}

/// [`render`], every epoch against `reference`.
pub fn measure(
    scene: &Scene,
    seed: u64,
    gpu: &Arc<Gpu>,
    limit: Limit,
    interrupt: &Arc<Interrupt>,
    reference: &Reference,
    mut after: impl FnMut(Point) -> Result<()>,
) -> Result<()> {
    render(scene, seed, None, gpu, limit, interrupt, |image, seconds| after(reference.point(image, seconds)))
        .map(|_| ())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two pixels of one channel: 64 samples in all, then equal epochs.
    #[test]
    fn epochs_add_up_to_means_and_spreads() {
        let mut image = Image::new(2, 1);
        for (epoch, values) in [(1, [0.0, 4.0]), (1, [2.0, 4.0]), (2, [3.0, 4.0]), (4, [4.0, 4.0]), (4, [6.0, 4.0])] {
            image.add(&values, epoch, 4);
        }
        // (0 + 2 + 2·3)/4 = 2, then 4 and 6: the mean is 4, the spread 4 + 0 + 4.
        assert_eq!((image.samples, image.epochs, &image.mean), (12, 3, &vec![4.0, 4.0]));
        assert!((image.variance(0) - 8.0 / 6.0).abs() < 1e-12 && image.variance(1) == 0.0);
        let expected = ((8.0 / 6.0) / 32.0f64).sqrt();
        assert!((image.estimate()[0] - expected).abs() < 1e-12);

        // Against the truth 3, 4: relMSE 1/(9 + ε)/2, error 1/25.
        let truth = Reference {
            mean: vec![3.0, 4.0],
            rel_noise: vec![0.0],
            noise: vec![0.0],
            channels: 1,
            what: String::new(),
        };
        let point = truth.point(&image, 1.5);
        let epsilon = 0.035f64.powi(2);
        assert!((point.rel_mse[0] - 0.5 / (9.0 + epsilon)).abs() < 1e-12);
        assert!((point.error[0] - 0.2).abs() < 1e-12);
        // A reference of the same noise explains some of it.
        let noisy = Reference::of_image(&image);
        assert!((noisy.noise[0] - expected * expected).abs() < 1e-12);
    }
}
