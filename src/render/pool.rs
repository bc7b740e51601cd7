//! The devices of a render, a thread each: they pull units from the queue, render them, and merge them into the cube.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, OnceLock, Weak};
use std::time::Instant;

use crossbeam_channel::{Sender, unbounded};
use rayon::ThreadPool;
use rayon::prelude::*;

use crate::cube::{CubeState, Rect, Weights, Writer, epoch_samples, merge_means, samples_before};
use crate::device::prepared::Prepared;
use crate::device::words::Counters;
use crate::files::format_bytes;
use crate::gpu::adapter::Gpu;
use crate::gpu::buffer::{self, WARM_UP};
#[cfg(test)]
use crate::gpu::fault::Phase;
use crate::preview::Source;
use crate::render::interrupt::Interrupt;
use crate::render::layers::Layers;
use crate::render::queue::{Group, Next, Queue};
use crate::render::self_test;
use crate::render::watch::{Device, Reports};
use crate::render::wave::{Budget, WavePlan};
use crate::render::worker::{Collected, Profile, UnitRect, Worker, device_limits};
use crate::{Error, Result, threads};

/// Threads that merge what a device brings back, at most. A tile of a GPU comes back faster than one core merges it: on an H200 at 400
/// channels a path took 9 ns on the device, and 106 ns of one core to merge.
pub const MERGE_THREADS: usize = 8;

/// What all devices of a render share. Nobody borrows it: a thread that is stuck in its driver keeps it for good.
pub struct Pool {
    pub prepared: Arc<Prepared>,
    /// What of the first surfaces is stored, if anything.
    pub layers: Option<Layers>,
    pub queue: Queue,
    /// Set before the first unit may be taken.
    pub cube: OnceLock<Writer>,
    pub tile: [u32; 2],
    /// Samples of a full epoch.
    pub full_epoch: u32,
    /// Bytes of each device that may be used.
    pub memory: Option<u64>,
    pub profile: bool,
    pub interrupt: Arc<Interrupt>,
}

/// The cube of a render, for whoever watches: no longer than the render needs it.
impl Source for Weak<Pool> {
    fn with_state(&self, read: &mut dyn FnMut(CubeState<'_>)) -> bool {
        let pool = self.upgrade();
        let cube = pool.as_ref().and_then(|pool| pool.cube.get());
        cube.map(|cube| read(cube.state())).is_some()
    }
}

/// What a device tells the thread that decides.
pub enum Report {
    /// It passed the self-test and holds the scene; scene and buffers take this many bytes.
    Ready { bytes: u64 },
    /// A group of units is merged.
    Merged(Merged),
    /// It goes on, but users should know.
    Warning(String),
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
    /// Their weights, of a factored render, whose means are those of what does not separate.
    weights: Vec<Weights>,
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

/// A device at work: its number, the groups that it has under way, the oldest first, and to whom it reports.
struct Post<'a> {
    device: usize,
    /// The threads that merge its units, if not its own does.
    mergers: Option<Arc<ThreadPool>>,
    taken: VecDeque<Taken>,
    reports: &'a Sender<(usize, Report)>,
    /// Whether it was ready once, and what it measured.
    ready: bool,
    profile: Option<Profile>,
}

impl Post<'_> {
    fn report(&self, report: Report) {
        // Nobody listens any more only when the render has ended already.
        let _ = self.reports.send((self.device, report));
    }
}

impl Pool {
    /// Sets every device to work on a thread of its own.
    pub fn start(self: &Arc<Self>, gpus: Vec<Gpu>) -> Result<Reports> {
        let (sender, receiver) = unbounded();
        let mut devices = Vec::new();
        let mergers = mergers(gpus.iter().filter(|gpu| !gpu.is_software).count())?;
        for (device, gpu) in gpus.into_iter().enumerate() {
            // The cores of a software device have enough to do.
            let mergers = mergers.clone().filter(|_| !gpu.is_software);
            let (name, deadline) = (gpu.name.clone(), Arc::clone(&gpu.deadline));
            let (pool, sender) = (Arc::clone(self), sender.clone());
            let work = move || pool.work(device, mergers, gpu, &sender);
            let thread = threads::run(&format!("device {}", device + 1), work);
            let thread = thread.map_err(|e| Error::Internal(format!("no thread for device {}: {e}", device + 1)))?;
            devices.push(Device::new(name, deadline, thread));
        }
        Ok(Reports::new(Arc::clone(self), receiver, devices))
    }

    /// The life of device number `device`.
    fn work(&self, device: usize, mergers: Option<Arc<ThreadPool>>, gpu: Gpu, reports: &Sender<(usize, Report)>) {
        let gpu = Arc::new(gpu);
        let mut post = Post { device, mergers, taken: VecDeque::new(), reports, ready: false, profile: None };
        let result = catch_unwind(AssertUnwindSafe(|| self.serve(&gpu, &mut post)));
        let result =
            result.unwrap_or_else(|_| Err(Error::Internal(format!("the thread of device {} panicked", device + 1))));
        self.give_back(&mut post);
        if gpu.is_hung() {
            // Closing it would wait for its work, for good. It is lost with whatever it holds.
            std::mem::forget(gpu);
        } else {
            let _watched = gpu.deadline.watch(WARM_UP);
            drop(gpu);
        }
        let profile = post.profile;
        post.report(Report::Left { result: result.map(|()| profile) });
    }

    fn give_back(&self, post: &mut Post) {
        for taken in post.taken.drain(..).rev() {
            self.queue.give_back(taken.group);
        }
    }

    /// Renders until there is nothing more to do. A device that runs out of memory goes on with waves of half the size, as
    /// long as there are smaller ones.
    fn serve(&self, gpu: &Arc<Gpu>, post: &mut Post) -> Result<()> {
        self_test::run(gpu)?;
        let budget = Budget { memory: self.memory, paths: None };
        let mut waves = WavePlan::new(&self.prepared, self.tile, device_limits(gpu), budget)?;
        let (mut shortage, mut told) = (false, false);
        loop {
            let result = self.start_worker(gpu, waves, post).and_then(|mut worker| {
                if shortage && !told {
                    told = true;
                    post.report(Report::Warning(format!(
                        "device {} ({}) ran out of memory and goes on with {} at most in smaller waves; --memory keeps it from \
                         trying more",
                        post.device + 1,
                        gpu.name,
                        format_bytes(waves.device_bytes())
                    )));
                }
                let result = self.pull(&mut worker, post);
                if self.profile {
                    let sum = post.profile.get_or_insert_default();
                    sum.generate_s += worker.profile.generate_s;
                    sum.evaluate_s += worker.profile.evaluate_s;
                }
                let _watched = gpu.deadline.watch(WARM_UP);
                drop(worker);
                result
            });
            let Err(Error::DeviceMemory(what)) = result else { return result };
            // First of all, others may go on with its units.
            self.give_back(post);
            let Some(smaller) = waves.halved() else {
                return Err(if post.ready { Error::DevicesLost(what) } else { Error::DeviceMemory(what) });
            };
            buffer::recover(gpu)?;
            (waves, shortage) = (smaller, true);
        }
    }

    fn start_worker(&self, gpu: &Arc<Gpu>, waves: WavePlan, post: &mut Post) -> Result<Worker> {
        let mut worker = Worker::with_waves(Arc::clone(gpu), Arc::clone(&self.prepared), waves)?;
        worker.watch(&self.interrupt);
        if self.profile {
            worker.enable_profile();
        }
        if !post.ready {
            post.ready = true;
            post.report(Report::Ready { bytes: waves.device_bytes() });
        }
        Ok(worker)
    }

    /// Renders what the queue has, until it has nothing any more.
    fn pull(&self, worker: &mut Worker, post: &mut Post) -> Result<()> {
        loop {
            #[cfg(test)]
            worker.gpu.faults.reach(Phase::Between, &worker.gpu);
            let plan = worker.plan;
            match self.queue.next(post.device, |epoch| plan.units_at_once(epoch_samples(epoch, self.full_epoch))) {
                Next::Units(group) => {
                    let units: Vec<UnitRect> = group.tiles.iter().map(|&tile| self.unit_rect(tile)).collect();
                    let epochs = group.epoch..group.epoch + group.epochs;
                    let tiles = group.tiles.clone();
                    post.taken.push_back(Taken::new(group));
                    if epochs.start == 0 {
                        self.lay(&tiles, worker)?;
                    }
                    for epoch in epochs {
                        let samples = epoch_samples(epoch, self.full_epoch);
                        let before = worker.submit(&units, epoch, samples)?;
                        before.map_or(Ok(()), |before| self.merge(&before, post))?;
                    }
                }
                Next::Later if worker.is_idle() => self.queue.wait(),
                // What this device holds back may be what others, or it itself, wait for.
                Next::Later => worker.collect()?.map_or(Ok(()), |last| self.merge(&last, post))?,
                Next::Never => return worker.collect()?.map_or(Ok(()), |last| self.merge(&last, post)),
            }
        }
    }

    /// Makes the layers, if there are any, of tiles that have no sample yet.
    fn lay(&self, tiles: &[u32], worker: &mut Worker) -> Result<()> {
        let Some(layers) = &self.layers else { return Ok(()) };
        let (cube, accel) = (self.cube(), &self.prepared.accel);
        for &tile in tiles {
            let [x0, y0, x1, y1] = self.unit_rect(tile);
            let rect = Rect { x0, y0, x1, y1 };
            cube.lay(tile, layers.of_tile(accel, cube.cube().grid(), rect, &mut |rays| worker.meet(rays))?);
        }
        Ok(())
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

    /// Takes what came back of the oldest group under way; merges it into the cube when all has, unless somebody else has
    /// been asked for it meanwhile.
    fn merge(&self, collected: &Collected, post: &mut Post) -> Result<()> {
        let Some(oldest) = post.taken.front_mut() else {
            return Err(Error::Internal("a device returned units that it had not taken".into()));
        };
        let epoch = oldest.group.epoch + oldest.collected;
        oldest.collected += 1;
        let last = oldest.collected == oldest.group.epochs;
        if !(if last { self.queue.claim(&oldest.group) } else { self.queue.is_wanted(&oldest.group) }) {
            if last {
                post.taken.pop_front();
            }
            #[cfg(test)]
            collected.gpu.faults.discarded.fetch_add(1, std::sync::atomic::Ordering::SeqCst);
            return Ok(());
        }
        #[cfg(test)]
        collected.gpu.faults.reach(Phase::Merge, collected.gpu);
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
        oldest.note(counters, epoch, || self.bad_sample(collected));
        let (n_before, samples) = (samples_before(epoch, self.full_epoch), epoch_samples(epoch, self.full_epoch));
        // With responses the device has rendered parts of the channels.
        let sums = self.prepared.integration.as_ref().map(|integration| integration.sums(collected.means()));
        let means: &[f32] = sums.as_deref().unwrap_or(collected.means());
        if self.prepared.separable.is_some() {
            let merged = self.merge_weights(collected, means, oldest, [n_before, samples], post.mergers.as_deref())?;
            return if merged { self.report_merged(began, n_before + samples, collected.idle_s, post) } else { Ok(()) };
        }
        let units = means.chunks(means.len() / collected.units.len());
        if oldest.group.epochs > 1 {
            oldest.gather(units, [n_before, samples]);
            if !last {
                return Ok(());
            }
            let means: Vec<_> = oldest.group.tiles.iter().zip(&oldest.means).collect();
            on_all(post.mergers.as_deref(), &means, |(tile, mean)| {
                self.cube().merge_unit(**tile, 0, n_before + samples, mean)
            })?;
        } else {
            let units: Vec<_> = oldest.group.tiles.iter().zip(units).collect();
            on_all(post.mergers.as_deref(), &units, |(tile, unit)| {
                self.cube().merge_unit(**tile, n_before, samples, unit)
            })?;
        }
        self.report_merged(began, n_before + samples, collected.idle_s, post)
    }

    /// Merges what came back of a factored render, `means` of what does not separate included; whether the group is done.
    fn merge_weights(
        &self,
        collected: &Collected,
        means: &[f32],
        oldest: &mut Taken,
        [n_before, samples]: [u32; 2],
        mergers: Option<&ThreadPool>,
    ) -> Result<bool> {
        let cube = self.cube();
        let tiles = &oldest.group.tiles;
        // None where all separates.
        let size = means.len() / tiles.len();
        if oldest.group.epochs == 1 {
            let units: Vec<_> = tiles.iter().zip(&collected.weights).enumerate().collect();
            on_all(mergers, &units, |(i, (tile, unit))| {
                let remainder = (size > 0).then(|| &means[i * size..][..size]);
                cube.merge_weights(**tile, n_before, samples, (*unit).clone(), remainder)
            })?;
            return Ok(true);
        }
        // The same arithmetic as in the cube, but nothing is written before the last of these epochs.
        let mut before = std::mem::take(&mut oldest.weights).into_iter();
        let units = tiles.iter().zip(&collected.weights);
        let merged = units.map(|(&tile, unit)| {
            let merging = cube.cube().merging(tile, before.next(), n_before, unit.clone(), samples)?;
            Ok(merging.merged.compacted())
        });
        oldest.weights = merged.collect::<Result<_>>()?;
        if size > 0 {
            oldest.gather(means.chunks(size), [n_before, samples]);
        }
        if oldest.collected < oldest.group.epochs {
            return Ok(false);
        }
        let all: Vec<_> = oldest.group.tiles.iter().zip(&oldest.weights).enumerate().collect();
        on_all(mergers, &all, |(i, (tile, all))| {
            let remainder = oldest.means.get(*i).map(Vec::as_slice);
            cube.merge_weights(**tile, 0, n_before + samples, (*all).clone(), remainder)
        })?;
        Ok(true)
    }

    /// Tells that the oldest group is in the cube, which has so many samples of its tiles now.
    fn report_merged(&self, began: Instant, n_after: u32, idle_s: f64, post: &mut Post) -> Result<()> {
        let Some(Taken { group, tally, bad, .. }) = post.taken.pop_front() else { return Ok(()) };
        self.queue.done(&group);
        let merged = u64::from(n_after - samples_before(group.epoch, self.full_epoch));
        let grid = self.cube().cube().grid();
        let paths = group.tiles.iter().map(|&tile| grid.rect(tile).pixels() * merged).sum();
        let merge_s = began.elapsed().as_secs_f64();
        post.report(Report::Merged(Merged { group, paths, tally, bad, merge_s, idle_s }));
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
        Taken { group, collected: 0, means: Vec::new(), weights: Vec::new(), tally: Tally::default(), bad: None }
    }

    /// Merges the means of one more epoch with those before it. The same arithmetic as in the cube, but nothing is written before the last.
    fn gather<'a>(&mut self, units: impl Iterator<Item = &'a [f32]>, [n_before, samples]: [u32; 2]) {
        if self.means.is_empty() {
            self.means = units.map(<[f32]>::to_vec).collect();
        } else {
            self.means.iter_mut().zip(units).for_each(|(mean, unit)| merge_means(mean, n_before, unit, samples));
        }
    }

    fn note(&mut self, counters: Counters, epoch: u32, bad_sample: impl FnOnce() -> [u32; 3]) {
        self.tally += counters.into();
        if counters.bad_sample > 0 && self.bad.is_none() {
            let [x, y, sample] = bad_sample();
            self.bad = Some([x, y, epoch, sample]);
        }
    }
}

/// The threads that merge what so many devices bring back, shared by all of them; `None` where that is left to the devices' own.
fn mergers(devices: usize) -> Result<Option<Arc<ThreadPool>>> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = cores.min(devices * MERGE_THREADS);
    if threads <= 1 {
        return Ok(None);
    }
    let named = rayon::ThreadPoolBuilder::new().num_threads(threads).thread_name(|i| format!("merge {}", i + 1));
    let pool = named.build().map_err(|e| Error::Internal(format!("no threads to merge with: {e}")))?;
    Ok(Some(Arc::new(pool)))
}

/// Does `each` of `work` on the threads of `pool`, or on this one, until one fails.
fn on_all<T: Sync>(pool: Option<&ThreadPool>, work: &[T], each: impl Fn(&T) -> Result<()> + Sync) -> Result<()> {
    match pool {
        // Tiles are few and large: each is given out by itself.
        Some(pool) if work.len() > 1 => pool.install(|| work.par_iter().with_max_len(1).try_for_each(&each)),
        _ => work.iter().try_for_each(each),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU32, Ordering};

    use super::*;

    #[test]
    fn work_on_all_threads_is_all_done_or_fails() {
        let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let work: Vec<u32> = (1..=100).collect();
        for pool in [None, Some(pool(2)), Some(pool(5))] {
            let sum = AtomicU32::new(0);
            let add = |x: &u32| {
                sum.fetch_add(*x, Ordering::Relaxed);
                Ok(())
            };
            on_all(pool.as_ref(), &work, add).expect("no error");
            assert_eq!(sum.into_inner(), 5050);
            let fail = |x: &u32| if *x == 57 { Err(Error::Usage("57".into())) } else { Ok(()) };
            assert_eq!(on_all(pool.as_ref(), &work, fail).expect_err("one fails").to_string(), "57");
            on_all(pool.as_ref(), &[], |_: &u32| panic!("nothing to do")).expect("nothing to do");
        }
    }

    /// The cores of the machine, and not more of them than the devices can keep busy.
    #[test]
    fn mergers_are_few() {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = |devices| mergers(devices).expect("threads").map_or(0, |pool| pool.current_num_threads());
        assert_eq!(threads(0), 0);
        assert!([1, 2, 100].map(threads).into_iter().all(|threads| threads <= cores && threads != 1));
        assert!(threads(1) <= MERGE_THREADS);
    }
}
