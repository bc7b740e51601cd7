//! How a unit, or several, is cut into waves: never so that it changes a bit of the result.

use crate::gpu::layout::{Step, Wave};
use crate::gpu::self_test::LOOP_LIMIT;
use crate::render::prepare::Prepared;
use crate::{Error, Result};

/// Bytes of a path between the passes: state (32), head (8), its places in the queues (8), throughput under roulette
/// (4), and 8 a record.
const STATE_BYTES: u64 = 32;
const HEAD_BYTES: u64 = 8;
const QUEUE_BYTES: u64 = 8;
const THROUGHPUT_BYTES: u64 = 4;
const RECORD_BYTES: u64 = 8;

/// What a device allows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DeviceLimits {
    /// Largest binding, bytes.
    pub binding: u64,
    /// Software devices work best on waves that stay in the processor's caches; GPUs need many paths to be full.
    pub software: bool,
    /// Upper bound on paths per wave, for tests and small memories.
    pub max_paths: Option<u32>,
}

/// Sizes of the waves and of their buffers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WavePlan {
    /// Width and height of a tile, in pixels.
    pub tile: [u32; 2],
    /// Most paths of one wave.
    pub paths: u32,
    /// Most samples per pixel of one wave.
    pub samples: u32,
    /// Most units of one wave.
    pub units: u32,
    pub channels: u32,
    pub max_records: u32,
    pub roulette: bool,
    /// Largest binding of the device, bytes.
    pub binding: u64,
}

impl WavePlan {
    /// Errors: a tile whose channels, or a path whose records, exceed what the device can bind.
    pub fn new(prepared: &Prepared, tile: [u32; 2], limits: DeviceLimits) -> Result<WavePlan> {
        let (channels, records) = (prepared.channels as u64, u64::from(prepared.max_records()));
        let tile_pixels = u64::from(tile[0]) * u64::from(tile[1]);
        let tile_bytes = tile_pixels * channels * 4;
        if tile_bytes > limits.binding {
            return Err(Error::Usage(format!(
                "a tile of {} x {} pixels with {channels} channels takes {} MiB, more than the {} MiB that this device binds: \
                 choose a smaller --tile",
                tile[0],
                tile[1],
                tile_bytes >> 20,
                limits.binding >> 20
            )));
        }
        // Measured: on lavapipe 16 k to 64 k paths are alike, fewer pay for dispatches and more for cache misses; a GPU
        // wants a few hundred thousand threads in flight. Many channels lengthen evaluation: keep a dispatch near 200 ms.
        let wanted: u64 =
            if limits.software { (1 << 15).min((1 << 26) / channels) } else { (1 << 20).min((1 << 31) / channels) };
        let bindable = limits.binding / (RECORD_BYTES * records).max(STATE_BYTES);
        let mut paths = wanted.max(256).min(bindable);
        if let Some(max) = limits.max_paths {
            paths = paths.min(u64::from(max));
        }
        if paths == 0 {
            return Err(Error::Usage(
                "a single path exceeds what this device binds: lower integrator.max_bounces".into(),
            ));
        }
        // One invocation of `evaluate` walks all samples of a pixel.
        let samples = (u64::from(LOOP_LIMIT) / (records + 1)).clamp(1, 64).min(paths);
        let by_memory = (if limits.software { 32 << 20 } else { 128 << 20 }) / tile_bytes;
        let units = (paths / tile_pixels).min(by_memory).max(1);
        Ok(WavePlan {
            tile,
            paths: paths as u32,
            samples: 1 << samples.ilog2(),
            units: units as u32,
            channels: channels as u32,
            max_records: records as u32,
            roulette: prepared.features.roulette,
            binding: limits.binding,
        })
    }

    pub fn tile_pixels(&self) -> u32 {
        self.tile[0] * self.tile[1]
    }

    pub fn state_bytes(&self) -> u64 {
        u64::from(self.paths) * STATE_BYTES
    }

    pub fn head_bytes(&self) -> u64 {
        u64::from(self.paths) * HEAD_BYTES
    }

    /// Two lists of the paths still under way.
    pub fn queue_bytes(&self) -> u64 {
        u64::from(self.paths) * QUEUE_BYTES
    }

    pub fn throughput_bytes(&self) -> u64 {
        if self.roulette { u64::from(self.paths) * THROUGHPUT_BYTES } else { 0 }
    }

    pub fn record_bytes(&self) -> u64 {
        u64::from(self.paths) * u64::from(self.max_records) * RECORD_BYTES
    }

    /// The means of all units of a wave.
    pub fn mean_bytes(&self) -> u64 {
        u64::from(self.units) * u64::from(self.tile_pixels()) * u64::from(self.channels) * 4
    }

    /// Everything but the scene that a device holds: path buffers, means, and two staging buffers of that size.
    pub fn device_bytes(&self) -> u64 {
        u64::from(self.paths) * self.path_bytes() + 3 * self.mean_bytes()
    }

    /// Bytes of one saved path, all its records included.
    pub fn path_bytes(&self) -> u64 {
        STATE_BYTES
            + HEAD_BYTES
            + QUEUE_BYTES
            + RECORD_BYTES * u64::from(self.max_records)
            + self.throughput_bytes().min(THROUGHPUT_BYTES)
    }

    /// How many units to submit together in an epoch of `samples` samples per pixel.
    pub fn units_at_once(&self, samples: u32) -> usize {
        let per_unit = u64::from(self.tile_pixels()) * u64::from(samples);
        if samples > self.samples {
            1
        } else {
            (u64::from(self.paths) / per_unit).clamp(1, u64::from(self.units)) as usize
        }
    }

    /// The waves of `units` units of one epoch, in the order in which they must run.
    pub fn waves(&self, units: u32, epoch: u32, epoch_samples: u32) -> Vec<Wave> {
        let pixels = units * self.tile_pixels();
        let samples = epoch_samples.min(self.samples);
        let pixels_at_once = (self.paths / samples).max(1);
        let mut waves = Vec::new();
        for pixel_begin in (0..pixels).step_by(pixels_at_once as usize) {
            for sample_begin in (0..epoch_samples).step_by(samples as usize) {
                let pixel_count = pixels_at_once.min(pixels - pixel_begin);
                waves.push(Wave {
                    path_count: pixel_count * samples,
                    pixel_count,
                    samples,
                    sample_begin,
                    pixel_begin,
                    tile_width: self.tile[0],
                    tile_pixels: self.tile_pixels(),
                    epoch,
                    epoch_mask: epoch_samples - 1,
                });
            }
        }
        waves
    }
}

/// The dispatches of a wave, one a bounce, and the one that sees what the last direction meets.
pub fn steps(max_bounces: u32) -> Vec<Step> {
    (0..=max_bounces).map(|bounce| Step { bounce }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(paths: u32, samples: u32, tile: [u32; 2]) -> WavePlan {
        WavePlan { tile, paths, samples, units: 4, channels: 8, max_records: 11, roulette: false, binding: 128 << 20 }
    }

    /// Every (pixel, sample) once, a pixel's samples in order.
    #[test]
    fn waves_cover_every_sample_in_order() {
        for (paths, samples) in [(1 << 15, 64), (1000, 8), (64, 64), (7, 1), (4096, 16)] {
            for epoch_samples in [1, 2, 32, 64, 1024] {
                let plan = plan(paths, samples, [16, 8]);
                for units in [1, 3] {
                    let mut next = vec![0; (units * plan.tile_pixels()) as usize];
                    for wave in plan.waves(units, 9, epoch_samples) {
                        assert!(wave.path_count <= paths.max(samples));
                        for pixel in wave.pixel_begin..wave.pixel_begin + wave.pixel_count {
                            assert_eq!(next[pixel as usize], wave.sample_begin);
                            next[pixel as usize] += wave.samples;
                        }
                    }
                    assert!(next.iter().all(|&n| n == epoch_samples));
                }
            }
        }
    }
}
