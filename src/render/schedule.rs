//! The render: epochs of the whole image, decided one after the other; devices that pull their units; what is known so far.

use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use serde_json::json;

use crate::cube::Cube;
use crate::gpu::adapter::{Gpu, Selection};
use crate::gpu::layout::Counters;
use crate::render::plan;
use crate::render::pool::{Merged, Pool, Report};
use crate::render::prepare::Prepared;
use crate::render::queue::Queue;
use crate::render::watch::Reports;
use crate::render::worker::{Interrupt, Profile, check_interrupt};
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
    pub devices: Selection,
    /// Bytes of each device that may be used.
    pub memory: Option<u64>,
}

/// How far a render is.
#[derive(Debug, Clone, PartialEq)]
pub struct Status {
    /// Samples per pixel in the whole image, and when the current epoch will be done.
    pub samples: u32,
    pub samples_next: u32,
    /// Units of the current epoch merged, of all.
    pub units: (u32, u32),
    pub paths: u64,
    pub rays: u64,
    pub elapsed: Duration,
    /// Seconds since the first device was ready.
    pub rendering_s: f64,
    /// The largest error estimate of a channel, from two full epochs on.
    pub error_estimate: Option<f64>,
    pub remaining: Option<Duration>,
    pub devices: Vec<DeviceStatus>,
}

/// What one device did.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviceStatus {
    pub name: String,
    /// Units that it has rendered, of all epochs.
    pub units: u64,
    /// Seconds in which it had work, and had not.
    pub busy_s: f64,
    pub idle_s: f64,
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
    /// Sums over the devices that have timestamps, if asked for.
    pub profile: Option<Profile>,
    /// Seconds until the first device was ready, and seconds that the devices' threads spent merging.
    pub setup_s: f64,
    pub merge_s: f64,
    /// Scene and buffers on all devices, bytes.
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
    let gpus = Gpu::open_all(&job.devices)?;
    for gpu in &gpus {
        observe(Event::Device(&gpu.name))?;
    }
    if gpus.iter().any(|gpu| gpu.name != gpus[0].name) {
        let what =
            "the devices are of different kinds: the cube is right, but its last bits depend on which rendered what";
        observe(Event::Warning(what.into()))?;
    }
    let prepared = Arc::new(Prepared::new(&job.scene, job.seed)?);
    if prepared.accel.degenerate > 0 {
        let what =
            format!("{} triangles without area in f32 were left out: no ray can meet them", prepared.accel.degenerate);
        observe(Event::Warning(what))?;
    }

    let pool = Arc::new(Pool {
        prepared,
        queue: Queue::new(header.grid().count()),
        cube: OnceLock::new(),
        tile,
        full_epoch: job.scene.integrator.epoch,
        memory: job.memory,
        profile: job.profile,
        interrupt: Arc::clone(interrupt),
    });
    let names = gpus.iter().map(|gpu| gpu.name.clone()).collect();
    let mut render = Render::new(job, names, header.grid().count(), samples_limit, started);
    let mut reports = pool.start(gpus)?;
    let result = render.wait_for_devices(&mut reports, observe).and_then(|()| {
        check_interrupt(interrupt)?;
        // Only now is anything written: whatever can be refused has been.
        let made = Cube::create(&job.output, header, job.overwrite)?;
        render.epochs(pool.cube.get_or_init(|| made), &pool.queue, &mut reports, observe)
    });
    // At the end nobody has a unit any more; after an error those under way are dropped.
    pool.queue.close();
    reports.for_each(|(_, report)| render.note_profile(report));
    // What ended the epochs is the error to report, whatever else fails for the same reason.
    let Some(cube) = pool.cube.get() else { return Err(result.err().unwrap_or_else(no_cube)) };
    let preview = render.write_preview(cube);
    let facts = render.write_run_facts(cube);
    let warned = render.report_counters(observe);
    result?;
    facts?;
    warned?;
    Ok(Summary {
        profile: render.profile,
        setup_s: render.setup_s,
        merge_s: render.merge_s,
        device_bytes: render.device_bytes,
        exposure: preview?,
        counters: render.counters,
        status: render.status,
    })
}

fn no_cube() -> Error {
    Error::Internal("the render ended without a cube".into())
}

struct Render<'a> {
    job: &'a Job,
    /// Samples per pixel at which to stop, the end of an epoch.
    samples_limit: Option<u32>,
    started: Instant,
    setup_s: f64,
    merge_s: f64,
    device_bytes: u64,
    profile: Option<Profile>,
    status: Status,
    /// Devices that have not left.
    active: usize,
    /// Units merged of the current epoch and of those after it.
    merged: VecDeque<u32>,
    counters: Counters,
    /// Column, row, epoch and sample of the first bad sample, for the report.
    first_bad: Option<[u32; 4]>,
    last_preview: Option<Instant>,
}

impl<'a> Render<'a> {
    fn new(job: &'a Job, names: Vec<String>, tiles: u32, samples_limit: Option<u32>, started: Instant) -> Self {
        let devices: Vec<_> =
            names.into_iter().map(|name| DeviceStatus { name, units: 0, busy_s: 0.0, idle_s: 0.0 }).collect();
        Render {
            job,
            samples_limit,
            started,
            setup_s: 0.0,
            merge_s: 0.0,
            device_bytes: 0,
            profile: None,
            active: devices.len(),
            status: Status {
                samples: 0,
                samples_next: 0,
                units: (0, tiles),
                paths: 0,
                rays: 0,
                elapsed: Duration::ZERO,
                rendering_s: 0.0,
                error_estimate: None,
                remaining: None,
                devices,
            },
            merged: VecDeque::new(),
            counters: Counters::default(),
            first_bad: None,
            last_preview: None,
        }
    }

    /// Waits until every device holds the scene, or has left: one that cannot is left out, unless none can.
    fn wait_for_devices(&mut self, reports: &mut Reports, observe: &mut dyn FnMut(Event) -> Result<()>) -> Result<()> {
        let (mut ready, mut refused) = (0, BTreeMap::new());
        while ready < self.active {
            let (device, report) = reports.next().ok_or_else(no_cube)?;
            match report {
                Report::Ready { bytes } => {
                    if ready == 0 {
                        self.setup_s = self.started.elapsed().as_secs_f64();
                    }
                    ready += 1;
                    self.device_bytes += bytes;
                }
                Report::Left { result: Err(error) } if error.may_be_of_one_device() => {
                    self.active -= 1;
                    refused.insert(device, error);
                }
                report => self.left(device, report, observe)?,
            }
        }
        if ready == 0
            && let Some((_, error)) = refused.pop_first()
        {
            return Err(error);
        }
        for (device, error) in refused {
            observe(Event::Warning(format!("device {} is left out: {error}", device + 1)))?;
        }
        Ok(())
    }

    /// One epoch after another until a stop rule is met.
    fn epochs(
        &mut self,
        cube: &Cube,
        queue: &Queue,
        reports: &mut Reports,
        observe: &mut dyn FnMut(Event) -> Result<()>,
    ) -> Result<()> {
        let full = self.job.scene.integrator.epoch;
        for epoch in 0.. {
            let n = epoch_samples(epoch, full);
            if self.samples_limit.is_some_and(|limit| self.status.samples >= limit) || self.too_late(n) {
                return Ok(());
            }
            queue.allow(self.decided(epoch));
            self.status.samples_next =
                self.status.samples.checked_add(n).ok_or_else(|| {
                    Error::Usage(format!("more than {} samples per pixel cannot be counted", u32::MAX))
                })?;
            self.status.units.0 = self.merged.front().copied().unwrap_or(0);
            while self.status.units.0 < self.status.units.1 {
                let (device, report) = reports.next().ok_or_else(no_cube)?;
                match report {
                    Report::Merged(merged) => self.note_merged(cube, epoch, device, merged, observe)?,
                    report => self.left(device, report, observe)?,
                }
            }
            self.merged.pop_front();
            self.status.samples += n;
            self.update_estimate(cube)?;
            observe(Event::Epoch(&self.status))?;
        }
        unreachable!("epochs go on until a stop rule ends them")
    }

    /// How many epochs may be rendered while `epoch` is the current one. Where only the number of samples decides, all
    /// are: then no device waits for another at an epoch's end.
    fn decided(&self, epoch: u32) -> u32 {
        let (None, Some(limit)) = (self.job.stop.time, self.samples_limit) else { return epoch + 1 };
        let full = self.job.scene.integrator.epoch;
        if limit < full { limit.ilog2() + 1 } else { full.ilog2() + limit / full }
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

    /// A device has left. The others go on without it, if it was lost and there are others.
    fn left(&mut self, device: usize, report: Report, observe: &mut dyn FnMut(Event) -> Result<()>) -> Result<()> {
        let result = match report {
            Report::Left { result } => result,
            Report::Warning(what) => return observe(Event::Warning(what)),
            Report::Ready { .. } | Report::Merged(_) => return Ok(()),
        };
        self.active -= 1;
        match result {
            Err(Error::DevicesLost(what) | Error::NoDevice(what)) if self.active > 0 => {
                let device = device + 1;
                observe(Event::Warning(format!("device {device} is lost, {} go on without it: {what}", self.active)))
            }
            Err(error) => Err(error),
            Ok(_) => Err(Error::Internal("a device ended its work before the render did".into())),
        }
    }

    /// A group of units is in the cube.
    fn note_merged(
        &mut self,
        cube: &Cube,
        current: u32,
        device: usize,
        merged: Merged,
        observe: &mut dyn FnMut(Event) -> Result<()>,
    ) -> Result<()> {
        let ahead = (merged.group.epoch - current) as usize;
        if self.merged.len() <= ahead {
            self.merged.resize(ahead + 1, 0);
        }
        self.merged[ahead] += merged.group.tiles.len() as u32;
        self.status.units.0 = self.merged[0];
        self.counters.non_finite += merged.counters.non_finite;
        self.counters.negative += merged.counters.negative;
        if let (Some([x, y, sample]), None) = (merged.bad, self.first_bad) {
            self.first_bad = Some([x, y, merged.group.epoch, sample]);
        }
        self.merge_s += merged.merge_s;
        self.status.paths += merged.paths;
        self.status.rays += merged.counters.rays();
        self.update_clock();
        let rendering_s = self.status.rendering_s;
        let of_device = &mut self.status.devices[device];
        of_device.units += merged.group.tiles.len() as u64;
        of_device.idle_s = merged.idle_s;
        of_device.busy_s = rendering_s - merged.idle_s;
        if self.last_preview.is_none_or(|last| last.elapsed() >= PREVIEW_INTERVAL) {
            self.write_preview(cube)?;
        }
        observe(Event::Progress(&self.status))
    }

    /// What a device measured, when it has ended.
    fn note_profile(&mut self, report: Report) {
        if let Report::Left { result: Ok(Some(of_device)) } = report {
            let sum = self.profile.get_or_insert_default();
            sum.generate_s += of_device.generate_s;
            sum.evaluate_s += of_device.evaluate_s;
        }
    }

    fn update_clock(&mut self) {
        self.status.elapsed = self.started.elapsed();
        self.status.rendering_s = self.rendering_s();
        self.status.remaining = self.remaining();
    }

    /// Time until the last epoch ends, from the paths still to trace.
    fn remaining(&self) -> Option<Duration> {
        let left = self.samples_limit.map(|limit| {
            let pixels: f64 = self.job.scene.film.cube_size().iter().map(|&s| f64::from(s)).product();
            self.rendering_s() * (pixels * f64::from(limit) / self.status.paths.max(1) as f64 - 1.0)
        });
        let until = self.job.stop.time.map(|limit| limit.as_secs_f64() - self.status.elapsed.as_secs_f64());
        let seconds = [left, until].into_iter().flatten().reduce(f64::min)?;
        Duration::try_from_secs_f64(seconds.max(0.0)).ok()
    }

    fn update_estimate(&mut self, cube: &Cube) -> Result<()> {
        if self.status.samples >= 2 * self.job.scene.integrator.epoch {
            let estimates = cube.error_estimate()?;
            self.status.error_estimate = estimates.into_iter().filter(|e| !e.is_nan()).reduce(f64::max);
        }
        self.update_clock();
        Ok(())
    }

    /// Writes the preview, if one is wanted, and says at which exposure.
    fn write_preview(&mut self, cube: &Cube) -> Result<Option<f64>> {
        let Some(preview) = &self.job.preview else { return Ok(None) };
        let picture = cube.preview()?;
        let exposure = preview.exposure.unwrap_or_else(|| picture.auto_exposure());
        format::png::write(&preview.file, &picture, exposure)?;
        self.last_preview = Some(Instant::now());
        Ok(Some(exposure))
    }

    /// Facts about this process, which are not part of what the cube is.
    fn write_run_facts(&self, cube: &Cube) -> Result<()> {
        let devices =
            self.status.devices.iter().map(|d| json!({ "name": d.name, "units": d.units, "idle_seconds": d.idle_s }));
        let facts = json!({
            "devices": devices.collect::<Vec<_>>(),
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
        let folder = cube.path().join(".spectile");
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
