//! The devices of a render, a thread each: they pull units from the queue, render them, and merge them into the cube.

use std::collections::VecDeque;
use std::sync::mpsc::Sender;
use std::sync::{Arc, OnceLock};
use std::time::Instant;

use crate::cube::Cube;
use crate::gpu::adapter::Gpu;
use crate::gpu::layout::Counters;
use crate::gpu::self_test;
use crate::render::prepare::Prepared;
use crate::render::queue::{Group, Next, Queue};
use crate::render::schedule::epoch_samples;
use crate::render::wave::Budget;
use crate::render::worker::{Collected, Interrupt, Profile, UnitRect, Worker};
use crate::{Error, Result};

/// What all devices of a render share.
pub struct Pool<'a> {
    pub prepared: &'a Arc<Prepared>,
    pub queue: &'a Queue,
    /// Set before the first unit may be taken.
    pub cube: &'a OnceLock<Cube>,
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

/// A group of units in the cube.
pub struct Merged {
    pub group: Group,
    /// Paths of the pixels in the image.
    pub paths: u64,
    pub counters: Counters,
    /// Column, row and sample of a bad sample, where there was one.
    pub bad: Option<[u32; 3]>,
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
        for group in taken.into_iter().rev() {
            self.queue.give_back(group);
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
    fn pull(&self, worker: &mut Worker, taken: &mut VecDeque<Group>, report: &impl Fn(Report)) -> Result<()> {
        loop {
            let plan = worker.plan;
            match self.queue.next(|epoch| plan.units_at_once(epoch_samples(epoch, self.full_epoch))) {
                Next::Units(group) => {
                    let units: Vec<UnitRect> = group.tiles.iter().map(|&tile| self.unit_rect(tile)).collect();
                    let (epoch, samples) = (group.epoch, epoch_samples(group.epoch, self.full_epoch));
                    taken.push_back(group);
                    worker.submit(&units, epoch, samples, &mut |c| self.merge(&c, taken, report))?;
                }
                // What this device holds back may be what others, or it itself, wait for.
                Next::Later if worker.is_idle() => self.queue.wait(),
                Next::Later => worker.collect(&mut |c| self.merge(&c, taken, report))?,
                Next::Never => return worker.collect(&mut |c| self.merge(&c, taken, report)),
            }
        }
    }

    fn cube(&self) -> &Cube {
        self.cube.get().expect("the cube is there before the first unit")
    }

    /// A tile in the coordinates of the full film.
    fn unit_rect(&self, tile: u32) -> UnitRect {
        let rect = self.cube().grid().rect(tile);
        let [x, y] = self.cube().header().origin;
        [x + rect.x0, y + rect.y0, x + rect.x1, y + rect.y1]
    }

    /// Merges the oldest group under way into the cube.
    fn merge(&self, collected: &Collected, taken: &mut VecDeque<Group>, report: &impl Fn(Report)) -> Result<()> {
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
        let Some(group) = taken.front() else {
            return Err(Error::Internal("a device returned units that it had not taken".into()));
        };
        let (cube, samples) = (self.cube(), epoch_samples(group.epoch, self.full_epoch));
        let unit_len = collected.means.len() / collected.units.len();
        let mut paths = 0;
        for (&tile, mean) in group.tiles.iter().zip(collected.means.chunks(unit_len)) {
            cube.merge_unit(tile, samples, mean)?;
            paths += cube.grid().rect(tile).pixels() * u64::from(samples);
        }
        let bad = (counters.bad_sample > 0).then(|| {
            let [width, height] = self.tile;
            let unit = collected.units[(counters.bad_slot / (width * height)) as usize];
            let in_tile = counters.bad_slot % (width * height);
            [unit[0] + in_tile % width, unit[1] + in_tile / width, counters.bad_sample - 1]
        });
        let group = taken.pop_front().expect("looked at above");
        for &tile in &group.tiles {
            self.queue.done(group.epoch, tile);
        }
        let (merge_s, idle_s) = (began.elapsed().as_secs_f64(), collected.idle_s);
        report(Report::Merged(Merged { group, paths, counters, bad, merge_s, idle_s }));
        Ok(())
    }
}
