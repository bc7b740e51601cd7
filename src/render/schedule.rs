//! The render: epochs of the whole image, decided one after the other; devices that pull their units; what is known so far.

mod by_tile;

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, OnceLock};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use signal_hook::consts::SIGINT;

use crate::cube::{Run, RunFile, Writer, epoch_samples, epochs_in, reduction, samples_before};
use crate::preview::{Control, DeviceStatus, Status};
use crate::render::interrupt::Interrupt;
use crate::render::job::{Job, SURE_EPOCHS};
use crate::render::layers::Layers;
use crate::render::plan;
use crate::render::pool::{Merged, Pool, Report, Tally};
use crate::render::queue::Queue;
use crate::render::ready::{Ready, get_ready};
use crate::render::watch::{Heard, Reports, Requests};
use crate::render::worker::Profile;
use crate::{Error, Result, preview};

/// The preview file is rewritten at most this often, and takes at most this share of the time.
const PREVIEW_INTERVAL: Duration = Duration::from_secs(1);
const PREVIEW_SHARE: u32 = 20;
/// Most pixels of the preview file: 4K. Larger pictures are reduced, so that memory does not grow with the cube.
pub const PREVIEW_PIXELS: u64 = 3840 * 2160;

/// What a render tells while it goes on.
pub enum Event<'a> {
    Device(&'a str),
    Progress(&'a Status),
    Epoch(&'a Status),
    /// Somebody has asked, and what is merged is on disk.
    Asked(&'a Status),
    /// Whoever watches has made the render rest, or go on.
    Rests(bool),
    Warning(String),
    /// What is good to know.
    Note(String),
}

/// What a render did.
pub struct Summary {
    pub status: Status,
    /// Sums over the devices, if asked for.
    pub profile: Option<Profile>,
    /// Seconds until the first device was ready, and seconds that the devices' threads spent merging.
    pub setup_s: f64,
    pub merge_s: f64,
    /// Scene and buffers on all devices, bytes.
    pub device_bytes: u64,
    /// EV of the last preview written.
    pub exposure: Option<f64>,
    /// The epoch that the time ended before: its samples, and how many seconds it was predicted to take.
    pub too_long: Option<(u32, f64)>,
    pub tally: Tally,
}

/// Renders `job` into a cube, new or gone on with. Errors leave the cube with every unit merged so far.
pub fn run(job: &Job, interrupt: &Arc<Interrupt>, observe: &mut dyn FnMut(Event) -> Result<()>) -> Result<Summary> {
    let started = Instant::now();
    let Ready { header, tiles, samples_limit, gpus, software, evaluator, prepared, choices, brightness } =
        get_ready(job, interrupt, observe)?;
    let pool = Arc::new(Pool {
        prepared,
        layers: Layers::new(&job.scene, &job.layers)?,
        queue: Queue::default(),
        cube: OnceLock::new(),
        tile: header.tile,
        full_epoch: job.scene.integrator.epoch,
        memory: job.memory,
        profile: job.profile,
        interrupt: Arc::clone(interrupt),
    });
    let names = gpus.iter().map(|gpu| gpu.name.clone()).collect();
    let mut render = Render::new(job, names, samples_limit, interrupt, started);
    let mut reports = pool.start(gpus)?;
    let (mut committer, mut run) = (None, None);
    let result = render.wait_for_devices(&mut reports, observe).and_then(|()| {
        interrupt.check()?;
        // Only now is anything written: whatever can be refused has been.
        let mut warnings = Vec::new();
        let opened = Writer::open(&job.output, &header, job.existing, tiles, &mut |what| warnings.push(what));
        warnings.into_iter().try_for_each(|what| observe(Event::Warning(what)))?;
        let opened = opened?;
        // Another process may have made it since, on a device of another kind.
        if plan::evaluator(&job.scene, Some(opened.cube().header()), software)? != evaluator {
            let what = "was made by another process with another evaluator a moment ago: run the same command again";
            return Err(Error::storage(opened.cube().path(), what));
        }
        if let Some(choices) = &choices
            && *choices != choices.clone().record(opened.cube())?
        {
            let what = "was made by another process that chose otherwise which paths are evaluated: run the same command again";
            return Err(Error::storage(opened.cube().path(), what));
        }
        if let Some(brightness) = brightness {
            opened.note_brightness(brightness)?;
        }
        run = Some(RunFile::create(opened.cube().path(), Run::begin(&opened.tiles(), samples_limit, job.stop.tile_error()))?);
        let cube = pool.cube.get_or_init(|| opened);
        if let Some(feed) = &job.feed {
            let there = cube.tiles().zip(cube.found()).filter(|(_, samples)| **samples > 0).map(|(tile, _)| tile);
            feed.opened(Arc::new(Arc::downgrade(&pool)), cube.cube().grid().count(), there);
        }
        let commits = Arc::clone(&pool);
        // What goes wrong there is what the next unit, or the last commit, ends with.
        committer = Some(thread::spawn(move || commits.cube.get().map(Writer::commit_regularly)));
        match job.stop.tile_error() {
            Some(error) => render.tiles_by_error(error, cube, &pool.queue, &mut reports, observe),
            None => render.epochs(cube, &pool.queue, &mut reports, observe),
        }
    });
    // At the end nobody has a unit any more; after an error those under way are dropped.
    pool.queue.close();
    if pool.cube.get().is_none() && matches!(result, Err(Error::Interrupted { .. })) {
        // Nothing is under way but set-up, which nobody waits for.
        return Err(result.err().unwrap_or_else(no_cube));
    }
    // Every device is heard out, whatever one of them says.
    let told = reports.map(|(device, report)| render.note_last(device, report, result.is_ok(), observe));
    let told = told.fold(Ok(()), Result::and);
    // What ended the epochs is the error to report, whatever else fails for the same reason.
    let Some(cube) = pool.cube.get() else { return Err(result.err().unwrap_or_else(no_cube)) };
    cube.close();
    if committer.is_some_and(|committer| committer.join().is_err()) {
        return Err(Error::Internal("the thread that commits panicked".into()));
    }
    let flushed = cube.flush();
    let preview = render.write_preview(cube);
    let ended = result.as_ref().and(flushed.as_ref()).copied();
    let facts = run.map_or(Ok(()), |run| render.write_run_facts(run, ended));
    let warned = render.report_counters(observe);
    result?;
    flushed?;
    facts?;
    told?;
    warned?;
    Ok(Summary {
        profile: render.profile,
        setup_s: render.setup_s,
        merge_s: render.merge_s,
        device_bytes: render.device_bytes,
        exposure: preview?,
        too_long: render.too_long,
        tally: render.tally,
        status: render.status,
    })
}

fn no_cube() -> Error {
    Error::Internal("the render ended without a cube".into())
}

/// What is said where an error of 0 says nothing.
const DARK: &str = "every value of the picture is 0, of which --error knows nothing: either no light reaches the camera, or it is too \
    rare to have been met yet";

struct Render<'a> {
    job: &'a Job,
    interrupt: &'a Interrupt,
    requests: Requests,
    /// Samples per pixel at which to stop, the end of an epoch.
    samples_limit: Option<u32>,
    /// Paths to trace until the limit.
    paths_needed: Option<f64>,
    started: Instant,
    setup_s: f64,
    merge_s: f64,
    device_bytes: u64,
    profile: Option<Profile>,
    status: Status,
    /// Whether somebody has asked how far it is, and whether it should rest.
    asked: bool,
    rest_wanted: bool,
    /// Since when the render rests, and how long it has before.
    resting: Option<Instant>,
    rested: Duration,
    /// Devices that have not left.
    active: usize,
    /// Units merged of the current epoch and of those after it.
    merged: VecDeque<u32>,
    tally: Tally,
    /// Column, row, epoch and sample of the first bad sample, for the report.
    first_bad: Option<[u32; 4]>,
    /// Samples of the last epoch, and the seconds that it took.
    last_epoch: Option<(u32, f64)>,
    too_long: Option<(u32, f64)>,
    /// When the preview file may be rewritten.
    next_preview: Option<Instant>,
}

impl<'a> Render<'a> {
    fn new(
        job: &'a Job,
        names: Vec<String>,
        samples_limit: Option<u32>,
        interrupt: &'a Interrupt,
        started: Instant,
    ) -> Self {
        let devices: Vec<_> =
            names.into_iter().map(|name| DeviceStatus { name, paths: 0, units: 0, busy_s: 0.0, idle_s: 0.0 }).collect();
        Render {
            job,
            interrupt,
            requests: Requests::new(interrupt, job.feed.as_ref().map(|feed| feed.controls())),
            samples_limit,
            paths_needed: None,
            started,
            setup_s: 0.0,
            merge_s: 0.0,
            device_bytes: 0,
            profile: None,
            asked: false,
            rest_wanted: false,
            resting: None,
            rested: Duration::ZERO,
            active: devices.len(),
            status: Status {
                samples: 0,
                samples_next: 0,
                units: (0, 0),
                paths: 0,
                rays: 0,
                elapsed: Duration::ZERO,
                rendering_s: 0.0,
                error_estimate: None,
                tiles: None,
                remaining: None,
                devices,
            },
            merged: VecDeque::new(),
            tally: Tally::default(),
            first_bad: None,
            last_epoch: None,
            too_long: None,
            next_preview: None,
        }
    }

    /// Waits until every device holds the scene, or has left: one that cannot is left out, unless none can.
    fn wait_for_devices(&mut self, reports: &mut Reports, observe: &mut dyn FnMut(Event) -> Result<()>) -> Result<()> {
        let (mut ready, mut refused) = (0, BTreeMap::new());
        while ready < self.active {
            let Some((device, report)) = self.hear(reports)? else { continue };
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

    /// What a device has to tell, or nothing where users have asked for something: the end is an error, all else is noted.
    fn hear(&mut self, reports: &mut Reports) -> Result<Option<(usize, Report)>> {
        match reports.hear(&self.requests) {
            Heard::Report(device, report) => return Ok(Some((device, report))),
            Heard::End => self.interrupt.check()?,
            // As if by Ctrl-C: devices look at the interrupt too.
            Heard::Control(Control::Stop) => self.interrupt.stop(SIGINT),
            Heard::Asked | Heard::Control(Control::Save) => self.asked = true,
            Heard::Control(Control::Rest(rests)) => self.rest_wanted = rests,
            Heard::AllLeft => return Err(no_cube()),
        }
        Ok(None)
    }

    /// Commits and tells how far the render is, if somebody has asked.
    fn answer(&mut self, cube: &Writer, observe: &mut dyn FnMut(Event) -> Result<()>) -> Result<()> {
        if std::mem::take(&mut self.asked) {
            cube.flush()?;
            observe(Event::Asked(&self.status))?;
        }
        Ok(())
    }

    /// Rests, or goes on, as whoever watches has asked.
    fn rest_if_asked(&mut self, queue: &Queue, observe: &mut dyn FnMut(Event) -> Result<()>) -> Result<()> {
        let Some(feed) = &self.job.feed else { return Ok(()) };
        let rests = self.rest_wanted;
        if rests == self.resting.is_some() {
            return Ok(());
        }
        queue.pause(rests);
        self.rested = self.rested();
        self.resting = rests.then(Instant::now);
        feed.rests(rests);
        observe(Event::Rests(rests))
    }

    /// How long the render has rested, which counts neither as time of rendering nor towards `--time`.
    fn rested(&self) -> Duration {
        self.rested + self.resting.map_or(Duration::ZERO, |since| since.elapsed())
    }

    /// Counts what the cube holds already, and fills the queue with what is missing. Returns the first epoch that is.
    fn go_on(&mut self, cube: &Writer, queue: &Queue) -> u32 {
        let (full, grid) = (cube.cube().header().epoch, cube.cube().grid());
        let tiles = || cube.tiles().zip(cube.found().iter().copied());
        let epochs = || tiles().map(|(tile, samples)| (tile, epochs_in(samples, full)));
        queue.fill(epochs(), self.job.together(cube.cube().header(), self.samples_limit));

        let first = epochs().map(|(_, epoch)| epoch).min().unwrap_or(0);
        self.status.units.1 = cube.tiles().len() as u32;
        self.status.samples = samples_before(first, full);
        self.paths_needed = self.samples_limit.map(|limit| {
            tiles().map(|(tile, n)| grid.rect(tile).pixels() as f64 * f64::from(limit.saturating_sub(n))).sum()
        });
        for (_, epoch) in epochs() {
            let ahead = (epoch - first) as usize;
            if self.merged.len() < ahead {
                self.merged.resize(ahead, 0);
            }
            self.merged.iter_mut().take(ahead).for_each(|count| *count += 1);
        }
        first
    }

    /// One epoch after another until a stop rule is met.
    fn epochs(
        &mut self,
        cube: &Writer,
        queue: &Queue,
        reports: &mut Reports,
        observe: &mut dyn FnMut(Event) -> Result<()>,
    ) -> Result<()> {
        let full = self.job.scene.integrator.epoch;
        let first = self.go_on(cube, queue);
        self.update_estimate(cube);
        for epoch in first.. {
            let n = epoch_samples(epoch, full);
            let enough = self.samples_limit.is_some_and(|limit| self.status.samples >= limit);
            let is_accurate = self.is_accurate();
            if is_accurate && cube.is_dark() {
                observe(Event::Warning(DARK.into()))?;
            }
            if enough || is_accurate {
                return Ok(());
            }
            if self.too_late(n) {
                self.too_long = Some((n, self.predicted_s(n)));
                return Ok(());
            }
            let (began, rested, there) = (Instant::now(), self.rested(), self.merged.front().copied().unwrap_or(0));
            queue.allow(self.decided(epoch));
            self.status.samples_next =
                self.status.samples.checked_add(n).ok_or_else(|| {
                    Error::Usage(format!("more than {} samples per pixel cannot be counted", u32::MAX))
                })?;
            self.status.units.0 = there;
            while self.status.units.0 < self.status.units.1 {
                self.answer(cube, observe)?;
                self.rest_if_asked(queue, observe)?;
                match self.hear(reports)? {
                    Some((device, Report::Merged(merged))) => {
                        self.note_merged(cube, queue, epoch, device, merged, observe)?
                    }
                    Some((device, report)) => self.left(device, report, observe)?,
                    None => {}
                }
            }
            self.merged.pop_front();
            self.status.samples += n;
            // Of an epoch that was partly there before, as if all of it had been rendered now.
            let whole = f64::from(self.status.units.1) / f64::from((self.status.units.1 - there).max(1));
            let seconds = began.elapsed().saturating_sub(self.rested() - rested).as_secs_f64();
            self.last_epoch = Some((n, seconds * whole));
            self.tell_epoch(cube, observe)?;
        }
        unreachable!("epochs go on until a stop rule ends them")
    }

    /// Tells that an epoch has ended.
    fn tell_epoch(&mut self, cube: &Writer, observe: &mut dyn FnMut(Event) -> Result<()>) -> Result<()> {
        self.update_estimate(cube);
        if let Some(feed) = &self.job.feed {
            feed.epoch(&self.status);
        }
        observe(Event::Epoch(&self.status))
    }

    /// How many epochs may be rendered while `epoch` is the current one. Where only the number of samples decides, all
    /// are: then no device waits for another at an epoch's end.
    fn decided(&self, epoch: u32) -> u32 {
        match self.samples_limit {
            Some(limit) if self.job.stop.is_of_samples() => epochs_in(limit, self.job.scene.integrator.epoch),
            _ => epoch + 1,
        }
    }

    /// Whether the error estimate of every channel, [`Status::error_estimate`] is the largest, is as small as was asked for.
    fn is_accurate(&self) -> bool {
        let Some(wanted) = self.job.stop.error else { return false };
        self.status.samples / self.job.scene.integrator.epoch >= SURE_EPOCHS
            && self.status.error_estimate.is_some_and(|estimate| estimate <= wanted)
    }

    fn rendering_s(&self) -> f64 {
        (self.started.elapsed() - self.rested()).as_secs_f64() - self.setup_s
    }

    /// Seconds of an epoch of `n` samples at the pace of the last one: the first ones of a render also wait for shaders to be
    /// compiled.
    fn predicted_s(&self, n: u32) -> f64 {
        self.last_epoch.map_or(0.0, |(samples, seconds)| seconds / f64::from(samples) * f64::from(n))
    }

    /// Whether an epoch of `n` samples would not fit into the time that is left.
    fn too_late(&self, n: u32) -> bool {
        let Some(limit) = self.job.stop.time else { return false };
        // A render always begins; one that is gone on with need not.
        self.status.samples > 0
            && (self.started.elapsed() - self.rested()).as_secs_f64() + self.predicted_s(n) > limit.as_secs_f64()
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
        cube: &Writer,
        queue: &Queue,
        current: u32,
        device: usize,
        merged: Merged,
        observe: &mut dyn FnMut(Event) -> Result<()>,
    ) -> Result<()> {
        let first = (merged.group.epoch - current) as usize;
        let epochs = first..first + merged.group.epochs as usize;
        if self.merged.len() < epochs.end {
            self.merged.resize(epochs.end, 0);
        }
        self.merged.range_mut(epochs).for_each(|count| *count += merged.group.tiles.len() as u32);
        self.status.units.0 = self.merged[0];
        self.note_group(cube, queue, device, merged, observe)
    }

    /// Counts a group of units and tells of it.
    fn note_group(
        &mut self,
        cube: &Writer,
        queue: &Queue,
        device: usize,
        merged: Merged,
        observe: &mut dyn FnMut(Event) -> Result<()>,
    ) -> Result<()> {
        self.count(&merged);
        self.update_clock();
        let (rendering_s, rested) = (self.status.rendering_s, self.rested().as_secs_f64());
        let of_device = &mut self.status.devices[device];
        of_device.units += merged.group.tiles.len() as u64 * u64::from(merged.group.epochs);
        of_device.paths += merged.paths;
        of_device.idle_s = merged.idle_s;
        of_device.busy_s = rendering_s + rested - merged.idle_s;
        if self.next_preview.is_none_or(|next| next <= Instant::now()) {
            self.write_preview(cube)?;
        }
        if let Some(feed) = &self.job.feed {
            feed.merged(&merged.group.tiles, &self.status, queue.under_way());
        }
        observe(Event::Progress(&self.status))
    }

    /// What a device says after the end, which is a good one if the render `is_complete`: what it measured, units that it
    /// merged meanwhile, and trouble, of which others were faster to make up for than it was to tell.
    fn note_last(
        &mut self,
        device: usize,
        report: Report,
        is_complete: bool,
        observe: &mut dyn FnMut(Event) -> Result<()>,
    ) -> Result<()> {
        match report {
            Report::Left { result: Ok(Some(of_device)) } => {
                let sum = self.profile.get_or_insert_default();
                sum.generate_s += of_device.generate_s;
                sum.evaluate_s += of_device.evaluate_s;
            }
            Report::Left { result: Err(error) } if is_complete => match error {
                Error::DevicesLost(what) | Error::NoDevice(what) => {
                    let device = device + 1;
                    observe(Event::Warning(format!("device {device} is lost, others finished the render: {what}")))?;
                }
                // Asked for too late.
                Error::Interrupted { .. } => {}
                error => return Err(error),
            },
            Report::Merged(merged) => self.count(&merged),
            Report::Warning(what) => observe(Event::Warning(what))?,
            Report::Left { .. } | Report::Ready { .. } => {}
        }
        Ok(())
    }

    /// Adds what a group of units took.
    fn count(&mut self, merged: &Merged) {
        self.tally += merged.tally;
        self.first_bad = self.first_bad.or(merged.bad);
        self.merge_s += merged.merge_s;
        self.status.paths += merged.paths;
        self.status.rays = self.tally.rays;
    }

    fn update_clock(&mut self) {
        self.status.elapsed = self.started.elapsed();
        self.status.rendering_s = self.rendering_s();
        self.status.remaining = self.remaining();
    }

    /// Time until the last epoch ends, from the paths still to trace.
    fn remaining(&self) -> Option<Duration> {
        let left = self.paths_needed.map(|paths| self.rendering_s() * (paths / self.status.paths.max(1) as f64 - 1.0));
        let spent = self.status.elapsed.saturating_sub(self.rested());
        let until = self.job.stop.time.map(|limit| limit.as_secs_f64() - spent.as_secs_f64());
        let seconds = [left, until].into_iter().flatten().reduce(f64::min)?;
        Duration::try_from_secs_f64(seconds.max(0.0)).ok()
    }

    fn update_estimate(&mut self, cube: &Writer) {
        if self.status.samples >= 2 * self.job.scene.integrator.epoch {
            self.status.error_estimate = cube.error_estimate().into_iter().filter(|e| !e.is_nan()).reduce(f64::max);
        }
        self.update_clock();
    }

    /// Writes the preview, if one is wanted, and says at which exposure.
    fn write_preview(&mut self, cube: &Writer) -> Result<Option<f64>> {
        let Some(wanted) = &self.job.preview else { return Ok(None) };
        let began = Instant::now();
        let picture = cube.preview(reduction(cube.cube().header().size, PREVIEW_PIXELS))?;
        let exposure = wanted.exposure.unwrap_or_else(|| picture.auto_exposure());
        preview::write(&wanted.file, &picture, exposure)?;
        self.next_preview = Some(Instant::now() + PREVIEW_INTERVAL.max(began.elapsed() * PREVIEW_SHARE));
        Ok(Some(exposure))
    }

    /// Facts about this process, which are not part of what the cube is.
    fn write_run_facts(&self, mut file: RunFile, ended: std::result::Result<(), &Error>) -> Result<()> {
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
            "non_finite_samples": self.tally.non_finite,
            "negative_samples": self.tally.negative,
            "version": env!("CARGO_PKG_VERSION"),
        });
        if let Value::Object(facts) = facts {
            file.run.facts = facts;
        }
        file.run.units = self.status.devices.iter().map(|d| d.units).sum();
        file.run.end(ended);
        file.write()
    }

    /// Bad samples are bugs, never silent.
    fn report_counters(&self, observe: &mut dyn FnMut(Event) -> Result<()>) -> Result<()> {
        let Some([x, y, epoch, sample]) = self.first_bad else { return Ok(()) };
        let Tally { non_finite, negative, .. } = self.tally;
        observe(Event::Warning(format!(
            "{non_finite} samples of a channel were not finite (counted as 0) and {negative} were negative (counted as they \
             are), first seen in pixel {x} {y}, epoch {epoch}, up to sample {sample}: this is a bug in Spectile, please report it \
             with the scene"
        )))
    }
}
