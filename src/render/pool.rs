//! The devices of a render, a thread each: they pull units from the queue, render them, and merge them into the cube.

use std::collections::VecDeque;
use std::sync::mpsc::Sender;
use std::sync::{Arc, OnceLock};
use std::time::Instant;

use crate::cube::{Writer, epoch_samples, merge_means, samples_before};
use crate::gpu::adapter::Gpu;
use crate::gpu::layout::Counters;
use crate::gpu::self_test;
use crate::render::prepare::Prepared;
use crate::render::queue::{Group, Next, Queue};
use crate::render::wave::Budget;
use crate::render::worker::{Collected, Interrupt, Profile, UnitRect, Worker};
use crate::{Error, Result};

/// What all devices of a render share.
pub struct Pool<'a> {
    pub prepared: &'a Arc<Prepared>,
    pub queue: &'a Queue,
    /// Set before the first unit may be taken.
    pub cube: &'a OnceLock<Writer>,
    pub tile: [u32; 2],
    /// Samples of a full epoch.
    pub full_epoch: u32,
    /// Bytes of each device that may be used.
    pub memory: Option<u64>,
    pub profile: bool,
    pub interrupt: &'a Arc<Interrupt>,
}

/// What a device tells the thread that started it.
pub enum Report {
    /// It passed the self-test and holds the scene; scene and buffers take this many bytes.
    Ready { bytes: u64 },
    /// A group of units is merged.
    Merged(Merged),
    /// It has left: at the end, or with an error, after which its units are back in the queue.
    Left { result: Result<Option<Profile>> },
}

/// A group that a device has taken.
struct Taken {
    group: Group,
    /// Epochs that have come back.
    collected: u32,
    /// The means of each tile over these, where several epochs are merged at once.
    means: Vec<Vec<f32>>,
    tally: Tally,
    bad: Option<[u32; 4]>,
}

/// Sums of what the passes counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tally {
    pub rays: u64,
    /// Samples of a channel that were not finite, and that were negative.
    pub non_finite: u64,
    pub negative: u64,
}

impl std::ops::AddAssign for Tally {
    fn add_assign(&mut self, other: Tally) {
        self.rays += other.rays;
        self.non_finite += other.non_finite;
        self.negative += other.negative;
    }
}

impl From<Counters> for Tally {
    fn from(counters: Counters) -> Tally {
        let [non_finite, negative] = [counters.non_finite, counters.negative].map(u64::from);
        Tally { rays: counters.rays(), non_finite, negative }
    }
}

/// A group of units in the cube.
pub struct Merged {
    pub group: Group,
    /// Paths of the pixels in the image.
    pub paths: u64,
    pub tally: Tally,
    /// Column, row, epoch and sample of a bad sample, where there was one.
    pub bad: Option<[u32; 4]>,
    /// Seconds that merging took, and since when the device has been without work, in all.
    pub merge_s: f64,
    pub idle_s: f64,
}

impl Pool<'_> {
    /// The life of device number `device`.
    pub fn work(&self, device: usize, gpu: Gpu, reports: &Sender<(usize, Report)>) {
        let report = |r: Report| {
            // Nobody listens any more only when the render has ended already.
            let _ = reports.send((device, r));
        };
        let mut taken = VecDeque::new();
        let result = self.start(gpu, &report).and_then(|mut worker| {
            self.pull(&mut worker, &mut taken, &report)?;
            Ok((self.profile && worker.gpu.timestamps).then_some(worker.profile))
        });
        for taken in taken.into_iter().rev() {
            self.queue.give_back(taken.group);
        }
        report(Report::Left { result });
    }

    fn start(&self, gpu: Gpu, report: &impl Fn(Report)) -> Result<Worker> {
        self_test::run(&gpu)?;
        let budget = Budget { memory: self.memory, paths: None };
        let mut worker = Worker::new(gpu, Arc::clone(self.prepared), self.tile, budget)?;
        worker.watch(self.interrupt);
        if self.profile {
            worker.enable_profile();
        }
        report(Report::Ready { bytes: worker.plan.device_bytes() });
        Ok(worker)
    }

    /// Renders what the queue has, until it has nothing any more. `taken`: groups under way, the oldest first.
    fn pull(&self, worker: &mut Worker, taken: &mut VecDeque<Taken>, report: &impl Fn(Report)) -> Result<()> {
        loop {
            let plan = worker.plan;
            match self.queue.next(|epoch| plan.units_at_once(epoch_samples(epoch, self.full_epoch))) {
                Next::Units(group) => {
                    let units: Vec<UnitRect> = group.tiles.iter().map(|&tile| self.unit_rect(tile)).collect();
                    let epochs = group.epoch..group.epoch + group.epochs;
                    taken.push_back(Taken::new(group));
                    for epoch in epochs {
                        let samples = epoch_samples(epoch, self.full_epoch);
                        worker.submit(&units, epoch, samples, &mut |c| self.merge(&c, taken, report))?;
                    }
                }
                // What this device holds back may be what others, or it itself, wait for.
                Next::Later if worker.is_idle() => self.queue.wait(),
                Next::Later => worker.collect(&mut |c| self.merge(&c, taken, report))?,
                Next::Never => return worker.collect(&mut |c| self.merge(&c, taken, report)),
            }
        }
    }

    fn cube(&self) -> &Writer {
        self.cube.get().expect("the cube is there before the first unit")
    }

    /// A tile in the coordinates of the full film.
    fn unit_rect(&self, tile: u32) -> UnitRect {
        let cube = self.cube().cube();
        let (rect, [x, y]) = (cube.grid().rect(tile), cube.header().origin);
        [x + rect.x0, y + rect.y0, x + rect.x1, y + rect.y1]
    }

    /// Takes what came back of the oldest group under way; merges it into the cube when all has.
    fn merge(&self, collected: &Collected, taken: &mut VecDeque<Taken>, report: &impl Fn(Report)) -> Result<()> {
        let counters = collected.counters;
        if counters.overflow > 0 {
            let [x0, y0, x1, y1] = collected.units[0];
            return Err(Error::Usage(format!(
                "{} rays met more primitives than can be tested, in pixels {x0}..{x1} x {y0}..{y1} or nearby: too many \
                 triangles overlap in one place; remove duplicates",
                counters.overflow,
            )));
        }
        let began = Instant::now();
        let Some(oldest) = taken.front_mut() else {
            return Err(Error::Internal("a device returned units that it had not taken".into()));
        };
        let epoch = oldest.group.epoch + oldest.collected;
        oldest.note(counters, epoch, || self.bad_sample(collected));
        oldest.collected += 1;
        let (n_before, samples) = (samples_before(epoch, self.full_epoch), epoch_samples(epoch, self.full_epoch));
        let unit_len = collected.means.len() / collected.units.len();
        let units = collected.means.chunks(unit_len);
        let last = oldest.collected == oldest.group.epochs;
        if oldest.group.epochs > 1 {
            // The same arithmetic as in the cube, but nothing is written before the last of these epochs.
            if oldest.means.is_empty() {
                oldest.means = units.map(<[f32]>::to_vec).collect();
            } else {
                oldest.means.iter_mut().zip(units).for_each(|(mean, unit)| merge_means(mean, n_before, unit, samples));
            }
            if !last {
                return Ok(());
            }
            for (&tile, mean) in oldest.group.tiles.iter().zip(&oldest.means) {
                self.cube().merge_unit(tile, 0, n_before + samples, mean)?;
            }
        } else {
            for (&tile, unit) in oldest.group.tiles.iter().zip(units) {
                self.cube().merge_unit(tile, n_before, samples, unit)?;
            }
        }
        let Some(Taken { group, tally, bad, .. }) = taken.pop_front() else { return Ok(()) };
        self.queue.done(&group);
        let merged = u64::from(n_before + samples - samples_before(group.epoch, self.full_epoch));
        let grid = self.cube().cube().grid();
        let paths = group.tiles.iter().map(|&tile| grid.rect(tile).pixels() * merged).sum();
        let (merge_s, idle_s) = (began.elapsed().as_secs_f64(), collected.idle_s);
        report(Report::Merged(Merged { group, paths, tally, bad, merge_s, idle_s }));
        Ok(())
    }

    /// Column, row and sample of a bad sample.
    fn bad_sample(&self, collected: &Collected) -> [u32; 3] {
        let ([width, height], counters) = (self.tile, collected.counters);
        let unit = collected.units[(counters.bad_slot / (width * height)) as usize];
        let in_tile = counters.bad_slot % (width * height);
        [unit[0] + in_tile % width, unit[1] + in_tile / width, counters.bad_sample - 1]
    }
}

impl Taken {
    fn new(group: Group) -> Taken {
        Taken { group, collected: 0, means: Vec::new(), tally: Tally::default(), bad: None }
    }

    fn note(&mut self, counters: Counters, epoch: u32, bad_sample: impl FnOnce() -> [u32; 3]) {
        self.tally += counters.into();
        if counters.bad_sample > 0 && self.bad.is_none() {
            let [x, y, sample] = bad_sample();
            self.bad = Some([x, y, epoch, sample]);
        }
    }
}
