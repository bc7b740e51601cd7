//! How a unit, or several, is cut into waves: never so that it changes a bit of the result.

use crate::device::facts;
use crate::device::part::OnDevice;
use crate::device::prepared::Prepared;
use crate::device::windows::Windows;
use crate::device::words::{Counters, LOOP_LIMIT, Step, Wave};
use crate::files::format_bytes;
use crate::gpu::buffer;
use crate::{Error, Result};

/// Bytes of a path between the passes, beside its state and its records: head (8, and as many again where some paths are evaluated
/// only), its places in the queues (8), what roulette and flights have made of its weight (4).
const HEAD_BYTES: u64 = 8;
const QUEUE_BYTES: u64 = 8;
const THROUGHPUT_BYTES: u64 = 4;
/// Bytes of a unit's rectangle.
const UNIT_BYTES: u64 = 16;

/// Paths of the smallest waves: a few workgroups. With fewer, dispatches cost more than what they do.
const LEAST_PATHS: u64 = 256;

/// Waves of which records are on their way to the host, or walked through there, while the next one computes.
pub const SAVED_WAVES: usize = 2;

/// Rays whose first hits are asked for at a time, and bytes of each: the ray, what it meets, and that on its way to the host.
pub const FIRST_HIT_RAYS: usize = 4096;
const FIRST_HIT_BYTES: [u64; 3] = [32, 16, 16];

/// Of a buffer that nobody uses.
pub const UNUSED_BYTES: u64 = 256;

/// Most samples per pixel of a wave: those of the longest epoch that is usual.
const MOST_SAMPLES: u32 = 64;

/// What a device allows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DeviceLimits {
    /// Largest binding, bytes.
    pub binding: u64,
    /// Distance of uniforms that one binding shows in turn, bytes.
    pub uniform_alignment: u32,
    /// Software devices work best on waves that stay in the processor's caches; GPUs need many paths to be full.
    pub software: bool,
}

/// What a device may be used for: bounds on the waves that the device itself does not set.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Budget {
    /// Scene, path buffers, means and transfers together, bytes.
    pub memory: Option<u64>,
    /// Paths of a wave, as far as they fit, instead of what is worth it.
    pub paths: Option<u32>,
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
    pub max_bounces: u32,
    pub max_records: u32,
    /// Bytes of a path's state and of a record.
    pub state_size: u32,
    /// Loop iterations that evaluating a path may take, at all its wavelengths.
    pub path_iterations: u32,
    pub record_size: u32,
    /// Bytes of the state of all channels of a path (`pt`), or 0.
    pub spectral_state_size: u32,
    /// Whether evaluation has a dispatch a sample.
    pub sample_by_sample: bool,
    /// Whether paths keep what has become of their weight (`SCALED`).
    pub scaled: bool,
    /// Whether roulette decides which paths are evaluated.
    pub thinned: bool,
    /// Whether records are read back (factored renders): instead of means, or beside those of what does not separate.
    pub gathered: bool,
    /// Whether single rays are asked for (layers).
    pub first_hits: bool,
    pub limits: DeviceLimits,
    /// The scene on the device, bytes.
    pub scene_bytes: u64,
}

impl WavePlan {
    /// The largest waves that are worth it and fit. Errors: a tile whose channels, or a path whose records, exceed what
    /// the device can bind; a scene of more windows than bindings; a budget that does not hold the smallest waves.
    pub fn new(prepared: &Prepared, tile: [u32; 2], limits: DeviceLimits, budget: Budget) -> Result<WavePlan> {
        WavePlan::with_thinning(prepared, tile, limits, budget, prepared.thinning.is_some())
    }

    /// The same, whether or not it is decided already that roulette has a say in which paths are evaluated.
    pub fn with_thinning(
        prepared: &Prepared,
        tile: [u32; 2],
        limits: DeviceLimits,
        budget: Budget,
        thinned: bool,
    ) -> Result<WavePlan> {
        // Records are all that comes back of factored renders, but for what does not separate.
        let gathered = prepared.separable.is_some();
        let channels = if gathered && !prepared.has_remainder() { 0 } else { prepared.channels as u64 };
        let records = u64::from(prepared.max_records());
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
        let of_a_path =
            [prepared.record_bytes() * prepared.max_records(), prepared.state_bytes(), prepared.spectral_state_bytes()];
        let bindable = limits.binding / u64::from(of_a_path.into_iter().max().unwrap_or(1));
        let most = bindable.min(budget.paths.map_or(u64::MAX, u64::from));
        if most == 0 {
            return Err(Error::Usage(
                "a single path exceeds what this device binds: lower integrator.max_bounces".into(),
            ));
        }
        let on_device = OnDevice { prepared, windows: Windows::of(&prepared.accel, limits.binding)? };
        let mut plan = WavePlan {
            tile,
            paths: LEAST_PATHS.min(most) as u32,
            samples: 1,
            units: 1,
            channels: channels as u32,
            max_bounces: prepared.frame.max_bounces,
            max_records: records as u32,
            state_size: prepared.state_bytes(),
            path_iterations: prepared.path_iterations(),
            record_size: prepared.record_bytes(),
            spectral_state_size: prepared.spectral_state_bytes(),
            sample_by_sample: prepared.evaluator.takes_one_sample(),
            scaled: prepared.features.roulette || prepared.scattering.is_some(),
            thinned,
            gathered,
            first_hits: prepared.first_hits,
            limits,
            scene_bytes: facts::scene_bytes(&on_device, buffer::allocated),
        };
        // What is left when the smallest waves have theirs goes to paths first, then to further units.
        let mut left = match budget.memory {
            None => u64::MAX,
            Some(memory) if memory < plan.device_bytes() => return Err(plan.too_large_for(memory)),
            Some(memory) => memory - buffer::WGPU_BYTES - plan.scene_bytes - plan.wave_bytes(),
        };
        let wanted = budget.paths.map_or_else(
            || wanted_paths(limits.software, channels * u64::from(prepared.wavelengths_per_channel), records),
            u64::from,
        );
        let more_paths = wanted.min(most).saturating_sub(u64::from(plan.paths)).min(left / plan.path_bytes());
        // In fours, so that every buffer grows by exactly what its paths take, alignment included.
        let more_paths = more_paths - more_paths % 4;
        plan.paths += more_paths as u32;
        left -= more_paths * plan.path_bytes();
        plan.samples = plan.most_samples();

        // Means and transfers are aligned once for all units.
        let unit_bytes = UNIT_BYTES + 3 * plan.mean_bytes();
        let left = left.saturating_sub(3 * 16);
        let shared = (if limits.software { 32 << 20 } else { 128 << 20 }).min(limits.binding) / tile_bytes.max(1);
        let units = (u64::from(plan.paths) / tile_pixels).min(shared).min(1 + left / unit_bytes);
        plan.units = units.max(1) as u32;
        Ok(plan)
    }

    /// Waves of half the size, or the smallest; `None` where these are the smallest already.
    pub fn halved(&self) -> Option<WavePlan> {
        let paths = (self.paths / 2).max(self.paths.min(LEAST_PATHS as u32));
        let mut half = WavePlan { paths, units: (self.units / 2).max(1), ..*self };
        half.samples = half.most_samples();
        ((half.paths, half.units) != (self.paths, self.units)).then_some(half)
    }

    /// Samples per pixel of a wave: one invocation of `evaluate_pixel` walks all of them.
    fn most_samples(&self) -> u32 {
        let samples = (LOOP_LIMIT / self.path_iterations).clamp(1, MOST_SAMPLES).min(self.paths);
        1 << samples.ilog2()
    }

    fn too_large_for(&self, memory: u64) -> Error {
        let [width, height] = self.tile;
        let least = self.device_bytes();
        Error::Usage(format!(
            "{memory} bytes of memory do not hold this render on a device: the least is {least} bytes ({}), that is {} for \
             the scene, {} for a tile of {width} x {height} pixels with {} channels and its two transfers, {} for {} paths at a \
             time, and {} of wgpu's own: raise --memory, or choose a smaller --tile, fewer channels or fewer triangles",
            format_bytes(least),
            format_bytes(self.scene_bytes),
            format_bytes(self.mean_bytes() + 2 * self.staging_bytes()),
            self.channels,
            format_bytes(u64::from(self.paths) * self.path_bytes()),
            self.paths,
            format_bytes(buffer::WGPU_BYTES),
        ))
    }

    pub fn tile_pixels(&self) -> u32 {
        self.tile[0] * self.tile[1]
    }

    pub fn state_bytes(&self) -> u64 {
        u64::from(self.paths) * u64::from(self.state_size)
    }

    fn head_size(&self) -> u64 {
        if self.thinned { 2 * HEAD_BYTES } else { HEAD_BYTES }
    }

    pub fn head_bytes(&self) -> u64 {
        u64::from(self.paths) * self.head_size()
    }

    /// Two lists of the paths still under way.
    pub fn queue_bytes(&self) -> u64 {
        u64::from(self.paths) * QUEUE_BYTES
    }

    pub fn throughput_bytes(&self) -> u64 {
        if self.scaled { u64::from(self.paths) * THROUGHPUT_BYTES } else { 0 }
    }

    pub fn spectral_state_bytes(&self) -> u64 {
        u64::from(self.paths) * u64::from(self.spectral_state_size)
    }

    /// A buffer in which the heads and records of a wave are read back, or 0.
    pub fn saved_bytes(&self) -> u64 {
        if self.gathered { self.head_bytes() + self.record_bytes() } else { 0 }
    }

    pub fn record_bytes(&self) -> u64 {
        u64::from(self.paths) * u64::from(self.max_records) * u64::from(self.record_size)
    }

    /// The means of all units of a wave.
    pub fn mean_bytes(&self) -> u64 {
        u64::from(self.units) * u64::from(self.tile_pixels()) * u64::from(self.channels) * 4
    }

    /// A staging buffer: the means of all units of a wave, and the counters.
    pub fn staging_bytes(&self) -> u64 {
        self.mean_bytes() + size_of::<Counters>() as u64
    }

    pub fn unit_list_bytes(&self) -> u64 {
        u64::from(self.units) * UNIT_BYTES
    }

    /// Distance of the [`steps`] in their buffer.
    pub fn step_stride(&self) -> u32 {
        self.limits.uniform_alignment.max(16)
    }

    /// Dispatches that are numbered: bounces and what the last direction meets, or samples.
    pub fn steps(&self) -> Vec<Step> {
        let samples = if self.sample_by_sample { MOST_SAMPLES } else { 0 };
        (0..samples.max(self.max_bounces + 1)).map(|i| Step { bounce: i, sample: i }).collect()
    }

    pub fn step_bytes(&self) -> u64 {
        self.steps().len() as u64 * u64::from(self.step_stride())
    }

    /// How long each list of paths under way became.
    pub fn queue_length_bytes(&self) -> u64 {
        (u64::from(self.max_bounces) + 1) * 4
    }

    /// How many workgroups the next bounce takes, in three dimensions, where a pass says it.
    pub fn launch_bytes(&self) -> Option<u64> {
        self.limits.software.then_some(12)
    }

    /// Everything but the scene that a device holds: path buffers, means, and two staging buffers.
    pub fn wave_bytes(&self) -> u64 {
        let fixed =
            [size_of::<Wave>() as u64, size_of::<Counters>() as u64, self.step_bytes(), self.queue_length_bytes()];
        let by_paths = [self.state_bytes(), self.head_bytes(), self.record_bytes(), self.queue_bytes()];
        let by_units = [self.unit_list_bytes(), self.mean_bytes(), self.staging_bytes(), self.staging_bytes()];
        let throughputs = self.scaled.then(|| self.throughput_bytes());
        let spectral = (self.spectral_state_size > 0).then(|| self.spectral_state_bytes());
        let saved = self.gathered.then(|| [self.saved_bytes(); SAVED_WAVES]);
        let sizes = [fixed, by_paths, by_units];
        let others =
            throughputs.into_iter().chain(spectral).chain(self.launch_bytes()).chain(saved.into_iter().flatten());
        sizes.iter().flatten().copied().chain(others).map(buffer::allocated).sum::<u64>() + self.first_hit_bytes()
    }

    /// Of those, what asking for single rays takes (layers).
    pub fn first_hit_bytes(&self) -> u64 {
        let [asked, met, read] = FIRST_HIT_BYTES.map(|bytes| bytes * FIRST_HIT_RAYS as u64);
        let buffers = self.first_hits.then_some([asked, met, read, UNUSED_BYTES]);
        buffers.into_iter().flatten().map(buffer::allocated).sum()
    }

    /// The most that a device holds at any moment: the scene, and then the waves' buffers; before those are there, what
    /// is on its way into the scene's. Code and the driver's own are not known.
    pub fn device_bytes(&self) -> u64 {
        buffer::WGPU_BYTES + self.scene_bytes + self.wave_bytes().max(self.scene_bytes.min(buffer::PIECE_BYTES))
    }

    /// Bytes of one saved path, all its records included.
    pub fn path_bytes(&self) -> u64 {
        u64::from(self.state_size)
            + self.head_size()
            + QUEUE_BYTES
            + u64::from(self.record_size) * u64::from(self.max_records)
            + self.throughput_bytes().min(THROUGHPUT_BYTES)
            + u64::from(self.spectral_state_size)
            + SAVED_WAVES as u64 * self.saved_bytes() / u64::from(self.paths)
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

    /// The waves of `units` units of one epoch, in the order in which they must run; whoever runs them numbers them.
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
                    sequence: 0,
                });
            }
        }
        waves
    }
}

/// Paths of a wave where memory does not matter.
///
/// Measured: on lavapipe 16 k to 64 k paths are alike, fewer pay for dispatches and more for cache misses; a GPU wants a
/// few hundred thousand threads in flight. Many channels and long paths lengthen evaluation, at most paths x channels x
/// records: on lavapipe 0.6 ns each on one slow core, of a modest GPU 4e10 a second are assumed, so that a dispatch ends
/// within about 200 ms: GPU watchdogs end what takes seconds.
fn wanted_paths(software: bool, channels: u64, records: u64) -> u64 {
    let (most, evaluations) = if software { (1 << 15, 1 << 29) } else { (1 << 20, 1 << 33) };
    (evaluations / (channels * records).max(1)).clamp(LEAST_PATHS, most)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Sides;
    use crate::scene_builder::{Builder, room, sphere};
    use crate::spectral::Channels;
    use glam::DVec3;

    const LIMITS: DeviceLimits = DeviceLimits { binding: 128 << 20, uniform_alignment: 256, software: false };

    fn plan(paths: u32, samples: u32, tile: [u32; 2]) -> WavePlan {
        WavePlan {
            tile,
            paths,
            samples,
            units: 4,
            channels: 8,
            max_bounces: 5,
            max_records: 11,
            state_size: 32,
            path_iterations: 12,
            record_size: 8,
            spectral_state_size: 0,
            sample_by_sample: false,
            scaled: false,
            thinned: false,
            gathered: false,
            first_hits: false,
            limits: LIMITS,
            scene_bytes: 0,
        }
    }

    fn prepared(channels: usize, bounces: u32, roulette: u32) -> Prepared {
        let scene = Builder::new()
            .channels(Channels::equal(400.0, 700.0, channels))
            .bounces(bounces)
            .roulette(roulette)
            .diffuse(room(DVec3::NEG_ONE, DVec3::ONE), 0.5)
            .lamp(sphere(DVec3::ZERO, 0.1), 1.0, Sides::Front)
            .build();
        Prepared::new(&scene, 0).expect("a scene")
    }

    /// What a plan takes is within any budget that it accepts, more memory never makes smaller waves, all of it is used
    /// until there is enough, and a byte less than the least is refused, with that number.
    #[test]
    fn plans_keep_their_budgets() {
        for (channels, bounces, roulette, tile) in
            [(1, 0, 0, [64, 64]), (400, 5, 2, [64, 64]), (3, 5, 0, [7, 5]), (5000, 1, 0, [16, 16]), (7, 800, 1, [3, 1])]
        {
            let prepared = prepared(channels, bounces, roulette);
            for software in [false, true] {
                let limits = DeviceLimits { software, ..LIMITS };
                let with = |memory| WavePlan::new(&prepared, tile, limits, Budget { memory, paths: None });
                let refusal = with(Some(1)).expect_err("one byte").to_string();
                let least = refusal.split("the least is ").nth(1).and_then(|s| s.split(' ').next()).expect("a number");
                let least: u64 = least.parse().expect("bytes");
                assert_eq!(with(Some(least - 1)).expect_err("too little").exit_code(), 2);

                let unbounded = with(None).expect("a plan");
                let mut last = with(Some(least)).expect("the least is enough");
                assert_eq!(last.device_bytes(), least);
                let mut memory = least;
                while memory < 2 * unbounded.device_bytes() {
                    let plan = with(Some(memory)).expect("more than the least");
                    assert!(plan.device_bytes() <= memory, "{memory}: {plan:?}");
                    assert!(plan.paths >= last.paths && plan.samples >= last.samples, "{memory}: {plan:?}, {last:?}");
                    let unused = memory - plan.device_bytes();
                    let unit_bytes = 3 * plan.mean_bytes() / u64::from(plan.units) + 16;
                    assert!(
                        (plan.paths, plan.units) == (unbounded.paths, unbounded.units)
                            || unused < unit_bytes.max(4 * plan.path_bytes()) + 48,
                        "{unused} bytes of {memory} unused: {plan:?}"
                    );
                    (last, memory) = (plan, memory + memory / 7 + 13);
                }
                assert_eq!(with(Some(memory)).expect("plenty"), unbounded);
            }
        }
    }

    #[test]
    fn waves_are_halved_down_to_the_smallest() {
        let mut plan = WavePlan::new(&prepared(40, 5, 1), [16, 16], LIMITS, Budget::default()).expect("a plan");
        let least = WavePlan { paths: 256, samples: 64, units: 1, ..plan };
        let mut steps = 0;
        while let Some(half) = plan.halved() {
            assert!(half.wave_bytes() < plan.wave_bytes() && half.paths >= plan.paths / 2, "{half:?}");
            (plan, steps) = (half, steps + 1);
        }
        assert_eq!(plan, least);
        assert!((10..=12).contains(&steps), "{steps} steps from a million paths to 256");
        // A bound below that stays.
        let few = Budget { paths: Some(7), memory: None };
        let plan = WavePlan::new(&prepared(40, 5, 1), [16, 16], LIMITS, few).expect("a plan");
        assert_eq!((plan.paths, plan.samples, plan.halved()), (7, 4, None));
    }

    /// Many channels and long paths make smaller waves, so that a dispatch ends in time.
    #[test]
    fn long_work_comes_in_smaller_waves() {
        let evaluations = |software: bool, channels: u64, records: u64| {
            let paths = wanted_paths(software, channels, records);
            assert!((LEAST_PATHS..=1 << 20).contains(&paths));
            (paths, paths * channels * records)
        };
        assert_eq!(evaluations(true, 400, 11).0, 1 << 15);
        assert_eq!(evaluations(false, 400, 11).0, 1 << 20);
        for (channels, bounces) in [(400, 100), (5000, 5), (1, 16_383), (2000, 30)] {
            assert!(evaluations(true, channels, 2 * bounces + 1).1 <= 1 << 29);
            assert!(evaluations(false, channels, 2 * bounces + 1).1 <= 1 << 33);
        }
        assert_eq!(evaluations(true, 5000, 32_767).0, LEAST_PATHS);
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
