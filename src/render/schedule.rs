//! The render loop: epochs of the whole image, units in the order of their tiles, one device.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::json;

use crate::cube::Cube;
use crate::gpu::adapter::Gpu;
use crate::gpu::layout::Counters;
use crate::gpu::self_test;
use crate::render::plan;
use crate::render::prepare::Prepared;
use crate::render::worker::{Collected, Interrupt, Profile, UnitRect, Worker, check_interrupt};
use crate::scene::Scene;
use crate::{Error, Result, files, format};

/// Samples per pixel where no stop rule says otherwise.
pub const DEFAULT_SAMPLES: u32 = 64;
/// The preview file is rewritten at most this often.
const PREVIEW_INTERVAL: Duration = Duration::from_secs(1);

/// When to stop; the first that is reached does, at the end of an epoch of the whole image.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StopRule {
    pub samples: Option<u32>,
    pub time: Option<Duration>,
}

/// A picture of the cube that is kept up to date.
#[derive(Debug, Clone, PartialEq)]
pub struct Preview {
    pub file: PathBuf,
    /// EV, or automatic.
    pub exposure: Option<f64>,
}

/// Everything that decides a render.
pub struct Job {
    pub scene: Scene,
    pub output: PathBuf,
    pub overwrite: bool,
    pub seed: u64,
    /// Side of the tiles, if asked for.
    pub tile: Option<u32>,
    pub stop: StopRule,
    pub preview: Option<Preview>,
    pub profile: bool,
}

/// How far a render is.
#[derive(Debug, Clone, PartialEq)]
pub struct Status {
    pub device: String,
    /// Samples per pixel in the whole image, and when the current epoch will be done.
    pub samples: u32,
    pub samples_next: u32,
    /// Units of the current epoch merged, of all.
    pub units: (u32, u32),
    /// Units that the device has rendered, of all epochs.
    pub device_units: u64,
    pub paths: u64,
    pub rays: u64,
    pub elapsed: Duration,
    /// Seconds in which the device had work, and had not.
    pub busy_s: f64,
    pub idle_s: f64,
    /// The largest error estimate of a channel, from two full epochs on.
    pub error_estimate: Option<f64>,
    pub remaining: Option<Duration>,
}

/// What a render tells while it goes on.
pub enum Event<'a> {
    Device(&'a str),
    Progress(&'a Status),
    Epoch(&'a Status),
    Warning(String),
}

/// What a render did.
pub struct Summary {
    pub status: Status,
    /// If asked for, and if the device has timestamps.
    pub profile: Option<Profile>,
    /// Seconds until the device was ready, and seconds spent merging.
    pub setup_s: f64,
    pub merge_s: f64,
    /// Scene and buffers on the device, bytes.
    pub device_bytes: u64,
    /// EV of the last preview written.
    pub exposure: Option<f64>,
    pub counters: Counters,
}

/// Samples of epoch `index` when a full one has `full`: 1, 1, 2, 4, … full/2, then `full` for ever.
pub fn epoch_samples(index: u32, full: u32) -> u32 {
    match index {
        0 => 1,
        i if i > full.ilog2() => full,
        i => 1 << (i - 1),
    }
}

/// Samples per pixel at the end of the first epoch that has `wanted`; `None` where u32 does not count that far.
pub fn whole_epochs(wanted: u32, full: u32) -> Option<u32> {
    if wanted < full { wanted.checked_next_power_of_two() } else { wanted.checked_next_multiple_of(full) }
}

impl StopRule {
    /// The samples per pixel at which a render with full epochs of `full` samples stops; `None`: only time does.
    pub fn samples_limit(&self, full: u32) -> Result<Option<u32>> {
        let wanted = match self {
            StopRule { samples: None, time: None } => DEFAULT_SAMPLES,
            StopRule { samples: None, .. } => return Ok(None),
            StopRule { samples: Some(wanted), .. } => *wanted,
        };
        let too_many =
            || Error::Usage(format!("--spp {wanted}: the most that whole epochs make is {}", u32::MAX / full * full));
        whole_epochs(wanted, full).ok_or_else(too_many).map(Some)
    }
}

/// Renders `job` into a new cube. Errors leave the cube with every unit merged so far.
pub fn run(job: &Job, interrupt: &Arc<Interrupt>, observe: &mut dyn FnMut(Event) -> Result<()>) -> Result<Summary> {
    let started = Instant::now();
    plan::check(&job.scene)?;
    let samples_limit = job.stop.samples_limit(job.scene.integrator.epoch)?;
    let tile = plan::tile_size(&job.scene, job.tile);
    let header = plan::header(&job.scene, tile, job.seed);
    Cube::check_target(&job.output, &header, job.overwrite)?;
    if let Some(preview) = &job.preview {
        files::check_target(&preview.file)?;
    }
    let gpu = Gpu::open()?;
    observe(Event::Device(&gpu.name))?;
    let prepared = Arc::new(Prepared::new(&job.scene, job.seed)?);
    if prepared.accel.degenerate > 0 {
        let what =
            format!("{} triangles without area in f32 were left out: no ray can meet them", prepared.accel.degenerate);
        observe(Event::Warning(what))?;
    }
    self_test::run(&gpu)?;
    let mut worker = Worker::new(gpu, prepared, tile, None)?;
    worker.watch(interrupt);
    if job.profile {
        worker.enable_profile();
    }
    check_interrupt(interrupt)?;
    // Only now is anything written: whatever can be refused has been.
    let cube = Cube::create(&job.output, header, job.overwrite)?;
    let mut render = Render::new(job, &cube, &worker, samples_limit, started);
    // What ended the epochs is the error to report, whatever else fails for the same reason.
    let result = render.epochs(&mut worker, observe);
    let preview = render.write_preview();
    let facts = render.write_run_facts();
    let warned = render.report_counters(observe);
    result?;
    facts?;
    warned?;
    Ok(Summary {
        profile: (job.profile && worker.gpu.timestamps).then_some(worker.profile),
        setup_s: render.setup_s,
        merge_s: render.merge_s,
        device_bytes: worker.device_bytes(),
        exposure: preview?,
        counters: render.counters,
        status: render.status,
    })
}

struct Render<'a> {
    job: &'a Job,
    cube: &'a Cube,
    /// Samples per pixel at which to stop, the end of an epoch.
    samples_limit: Option<u32>,
    started: Instant,
    setup_s: f64,
    merge_s: f64,
    status: Status,
    counters: Counters,
    /// Column, row, epoch and sample of the first bad sample, for the report.
    first_bad: Option<[u32; 4]>,
    last_preview: Option<Instant>,
}

impl<'a> Render<'a> {
    fn new(job: &'a Job, cube: &'a Cube, worker: &Worker, samples_limit: Option<u32>, started: Instant) -> Self {
        let status = Status {
            device: worker.gpu.name.clone(),
            samples: 0,
            samples_next: 0,
            units: (0, cube.grid().count()),
            device_units: 0,
            paths: 0,
            rays: 0,
            elapsed: Duration::ZERO,
            busy_s: 0.0,
            idle_s: 0.0,
            error_estimate: None,
            remaining: None,
        };
        let setup_s = started.elapsed().as_secs_f64();
        let counters = Counters::default();
        Render {
            job,
            cube,
            samples_limit,
            started,
            setup_s,
            merge_s: 0.0,
            status,
            counters,
            first_bad: None,
            last_preview: None,
        }
    }

    /// One epoch after another until a stop rule is met.
    fn epochs(&mut self, worker: &mut Worker, observe: &mut dyn FnMut(Event) -> Result<()>) -> Result<()> {
        let full = self.job.scene.integrator.epoch;
        for epoch in 0.. {
            let n = epoch_samples(epoch, full);
            if self.samples_limit.is_some_and(|limit| self.status.samples >= limit) || self.too_late(n) {
                return Ok(());
            }
            self.status.samples_next =
                self.status.samples.checked_add(n).ok_or_else(|| {
                    Error::Usage(format!("more than {} samples per pixel cannot be counted", u32::MAX))
                })?;
            self.epoch(worker, epoch, n, observe)?;
            self.status.samples += n;
            self.update_estimate()?;
            observe(Event::Epoch(&self.status))?;
        }
        unreachable!("epochs go on until a stop rule ends them")
    }

    fn rendering_s(&self) -> f64 {
        self.started.elapsed().as_secs_f64() - self.setup_s
    }

    /// Whether an epoch of `n` samples would not fit into the time that is left.
    fn too_late(&self, n: u32) -> bool {
        let Some(limit) = self.job.stop.time else { return false };
        if self.status.samples == 0 {
            return false;
        }
        let predicted = self.rendering_s() / f64::from(self.status.samples) * f64::from(n);
        self.started.elapsed().as_secs_f64() + predicted > limit.as_secs_f64()
    }

    fn epoch(
        &mut self,
        worker: &mut Worker,
        epoch: u32,
        n: u32,
        observe: &mut dyn FnMut(Event) -> Result<()>,
    ) -> Result<()> {
        let grid = self.cube.grid();
        self.status.units = (0, grid.count());
        let tiles: Vec<u32> = (0..grid.count()).collect();
        for group in tiles.chunks(worker.plan.units_at_once(n)) {
            let units: Vec<UnitRect> = group.iter().map(|&tile| self.unit_rect(tile)).collect();
            worker.submit(&units, epoch, n, &mut |c| self.merge(&c, epoch, n, observe))?;
        }
        worker.collect(&mut |c| self.merge(&c, epoch, n, observe))
    }

    /// A tile in the coordinates of the full film.
    fn unit_rect(&self, tile: u32) -> UnitRect {
        let rect = self.cube.grid().rect(tile);
        let [x, y] = self.cube.header().origin;
        [x + rect.x0, y + rect.y0, x + rect.x1, y + rect.y1]
    }

    /// Merges the means of a group of units into the cube.
    fn merge(
        &mut self,
        collected: &Collected,
        epoch: u32,
        n: u32,
        observe: &mut dyn FnMut(Event) -> Result<()>,
    ) -> Result<()> {
        let counters = collected.counters;
        if counters.overflow > 0 {
            return Err(Error::Usage(format!(
                "{} rays met more primitives than can be tested, in {} or nearby: too many triangles overlap in one place; \
                 remove duplicates",
                counters.overflow,
                describe_rect(&collected.units[0]),
            )));
        }
        self.counters.non_finite += counters.non_finite;
        self.counters.negative += counters.negative;
        if counters.bad_sample > 0 && self.first_bad.is_none() {
            let [width, height] = self.cube.header().tile;
            let unit = collected.units[(counters.bad_slot / (width * height)) as usize];
            let in_tile = counters.bad_slot % (width * height);
            let pixel = [unit[0] + in_tile % width, unit[1] + in_tile / width];
            self.first_bad = Some([pixel[0], pixel[1], epoch, counters.bad_sample - 1]);
        }

        // Before merging, which the device need not wait for.
        self.status.idle_s = collected.idle_s;
        self.status.busy_s = self.rendering_s() - collected.idle_s;
        let began = Instant::now();
        let grid = self.cube.grid();
        let unit_len = collected.means.len() / collected.units.len();
        for (unit, mean) in collected.units.iter().zip(collected.means.chunks(unit_len)) {
            let [x, y] = self.cube.header().origin;
            let tile = grid.tile_at(unit[0] - x, unit[1] - y);
            self.cube.merge_unit(tile, n, mean)?;
            self.status.units.0 += 1;
            self.status.device_units += 1;
            self.status.paths += grid.rect(tile).pixels() * u64::from(n);
        }
        self.merge_s += began.elapsed().as_secs_f64();
        self.status.rays += u64::from(counters.rays);
        self.status.elapsed = self.started.elapsed();
        self.status.remaining = self.remaining();
        if self.last_preview.is_none_or(|last| last.elapsed() >= PREVIEW_INTERVAL) {
            self.write_preview()?;
        }
        observe(Event::Progress(&self.status))
    }

    /// Time until the last epoch ends, from the paths still to trace.
    fn remaining(&self) -> Option<Duration> {
        let left = self.samples_limit.map(|limit| {
            let total = self.cube.header().size.iter().map(|&s| f64::from(s)).product::<f64>() * f64::from(limit);
            self.rendering_s() * (total / self.status.paths.max(1) as f64 - 1.0)
        });
        let until = self.job.stop.time.map(|limit| limit.as_secs_f64() - self.status.elapsed.as_secs_f64());
        let seconds = [left, until].into_iter().flatten().reduce(f64::min)?;
        Duration::try_from_secs_f64(seconds.max(0.0)).ok()
    }

    fn update_estimate(&mut self) -> Result<()> {
        if self.status.samples >= 2 * self.job.scene.integrator.epoch {
            let estimates = self.cube.error_estimate()?;
            self.status.error_estimate = estimates.into_iter().filter(|e| !e.is_nan()).reduce(f64::max);
        }
        self.status.elapsed = self.started.elapsed();
        self.status.remaining = self.remaining();
        Ok(())
    }

    /// Writes the preview, if one is wanted, and says at which exposure.
    fn write_preview(&mut self) -> Result<Option<f64>> {
        let Some(preview) = &self.job.preview else { return Ok(None) };
        let picture = self.cube.preview()?;
        let exposure = preview.exposure.unwrap_or_else(|| picture.auto_exposure());
        format::png::write(&preview.file, &picture, exposure)?;
        self.last_preview = Some(Instant::now());
        Ok(Some(exposure))
    }

    /// Facts about this process, which are not part of what the cube is.
    fn write_run_facts(&self) -> Result<()> {
        let facts = json!({
            "device": self.status.device,
            "seconds": self.started.elapsed().as_secs_f64(),
            "setup_seconds": self.setup_s,
            "merge_seconds": self.merge_s,
            "paths": self.status.paths,
            "rays": self.status.rays,
            "samples": self.status.samples,
            "non_finite_samples": self.counters.non_finite,
            "negative_samples": self.counters.negative,
            "version": env!("CARGO_PKG_VERSION"),
        });
        let folder = self.cube.path().join(".spectile");
        let file: &Path = &folder.join(format!("run-{}.json", files::random_suffix()));
        files::write_atomically(file, format!("{facts:#}\n").as_bytes())
    }

    /// Bad samples are bugs, never silent.
    fn report_counters(&self, observe: &mut dyn FnMut(Event) -> Result<()>) -> Result<()> {
        let Some([x, y, epoch, sample]) = self.first_bad else { return Ok(()) };
        let Counters { non_finite, negative, .. } = self.counters;
        observe(Event::Warning(format!(
            "{non_finite} samples of a channel were not finite (counted as 0) and {negative} were negative (counted as they \
             are), first seen in pixel {x} {y}, epoch {epoch}, up to sample {sample}: this is a bug in Spectile, please report it \
             with the scene"
        )))
    }
}

fn describe_rect(unit: &UnitRect) -> String {
    format!("pixels {}..{} x {}..{}", unit[0], unit[2], unit[1], unit[3])
}

#[cfg(test)]
mod tests {
    use super::{StopRule, epoch_samples, whole_epochs};

    #[test]
    fn epochs_double_up_to_a_full_one() {
        let sizes = |full, n: u32| (0..n).map(|i| epoch_samples(i, full)).collect::<Vec<_>>();
        assert_eq!(sizes(64, 9), [1, 1, 2, 4, 8, 16, 32, 64, 64]);
        assert_eq!(sizes(1, 3), [1, 1, 1]);
        assert_eq!(sizes(2, 4), [1, 1, 2, 2]);
    }

    #[test]
    fn limits_are_ends_of_epochs() {
        for full in [1, 2, 64, 1024] {
            let mut end = 0;
            for epoch in 0..20 {
                let begin = end;
                end += epoch_samples(epoch, full);
                for wanted in begin + 1..=end {
                    assert_eq!(whole_epochs(wanted, full), Some(end), "{wanted} in epochs of {full}");
                }
            }
        }
        let limit = |samples| StopRule { samples: Some(samples), time: None }.samples_limit(64);
        assert_eq!(limit(u32::MAX - 63).ok(), Some(Some(u32::MAX - 63)));
        assert!(limit(u32::MAX).unwrap_err().to_string().contains("4294967232"));
    }
}
