//! One device at work: generate, evaluate (Hoarau et al. 2018, section 5.1), transfer.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::cube::Weights;
use crate::device::evaluator::EvaluateShape;
use crate::device::facts;
use crate::device::kernels::launching;
use crate::device::part::OnDevice;
use crate::device::prepared::Prepared;
use crate::device::windows::Windows;
use crate::device::words::{Counters, Frame, Proof, Wave};
use crate::gpu::adapter::Gpu;
use crate::gpu::buffer;
#[cfg(test)]
use crate::gpu::fault::{self, Phase};
use crate::gpu::pass::{Pass, grid};
use crate::gpu::source::Source;
use crate::gpu::timestamps::Timestamps;
use crate::gpu::upload::NamedBuffers;
use crate::render::gather::{Gather, Saved};
use crate::render::interrupt::Interrupt;
use crate::render::pool::MERGE_THREADS;
use crate::render::time_limit::TimeLimit;
use crate::render::wave::{Budget, DeviceLimits, SAVED_WAVES, WavePlan};
use crate::{Error, Result};

mod first_hits;
mod path_buffers;

use first_hits::FirstHits;
pub use first_hits::{Met, Question};
use path_buffers::PathBuffers;

/// A rectangle x0, y0, x1, y1 of the full film: one tile in one epoch.
pub type UnitRect = [u32; 4];

/// Staging buffers: the next unit computes while the last one is merged.
const SLOTS: usize = 2;

/// Waves under way at most. A GPU's take milliseconds, and some must be left to compute while a unit is merged; on the
/// processor one takes up to a second, and whoever interrupts waits for all of them.
const WAVES_AHEAD: usize = 32;
const WAVES_AHEAD_SOFTWARE: usize = 2;

/// Time of the passes, seconds: the device's own where it has timestamps, else that of waiting for each.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Profile {
    pub generate_s: f64,
    pub evaluate_s: f64,
}

impl Profile {
    /// Adds the time of a pass of a wave; they generate and evaluate by turns.
    fn add(&mut self, pass: usize, seconds: f64) {
        *if pass.is_multiple_of(2) { &mut self.generate_s } else { &mut self.evaluate_s } += seconds;
    }
}

/// A device with everything a scene needs on it.
pub struct Worker {
    pub gpu: Arc<Gpu>,
    pub plan: WavePlan,
    pub profile: Profile,
    prepared: Arc<Prepared>,
    camera: Stage,
    bounce: Stage,
    /// On software devices, between two bounces. A GPU is done with workgroups that have nothing to do in no time; a processor takes
    /// them one by one.
    launch: Option<(Stage, wgpu::Buffer)>,
    /// After every bounce, in the conventional path tracer.
    update: Option<Stage>,
    /// Before evaluation, where not all paths are evaluated.
    thin: Option<Stage>,
    /// None where records are read back instead.
    evaluate: Option<Stage>,
    /// Where there are layers.
    first_hits: Option<FirstHits>,
    shape: EvaluateShape,
    path_buffers: PathBuffers,
    frame: wgpu::Buffer,
    max_bounces: u32,
    timestamps: Option<Timestamps>,
    /// Whether passes are measured by waiting for them.
    clocked: bool,
    slots: [Slot; SLOTS],
    next_slot: usize,
    /// Walks through records, in factored renders; where they come back, by turns.
    gather: Option<Gather>,
    saved: Vec<wgpu::Buffer>,
    /// The units submitted last, until they are collected.
    pending: Option<Pending>,
    /// Waves under way, the oldest first.
    waves: VecDeque<InFlight>,
    /// Waves submitted so far.
    submitted: u64,
    time_limit: TimeLimit,
    /// Since when the device has been at work on the oldest wave, or will be from its submission.
    at_work_since: Instant,
    interrupt: Arc<Interrupt>,
    /// Since when nothing is under way; `None` before the first unit.
    idle_since: Option<Instant>,
    /// Seconds without work between the first unit and the last.
    idle_s: f64,
}

/// A wave on the device.
struct InFlight {
    /// The number of waves submitted, this one included.
    number: u64,
    paths: u32,
    submission: wgpu::SubmissionIndex,
    /// The wave and the slot of its units, where its records are read back.
    saved: Option<(Wave, usize)>,
}

/// A pass with its bind groups.
struct Stage {
    pass: Pass,
    groups: Vec<wgpu::BindGroup>,
}

/// A staging buffer and the units whose means it holds, or will.
struct Slot {
    staging: wgpu::Buffer,
    units: Vec<UnitRect>,
    /// Whether the host sees it, and the device must not touch it.
    is_mapped: bool,
}

/// Units on their way into a slot.
struct Pending {
    slot: usize,
    submission: wgpu::SubmissionIndex,
    /// The number of its last wave.
    last_wave: u64,
    proof: Proof,
}

/// What a group of units brought back, as it lies in its staging buffer.
pub struct Collected<'a> {
    #[cfg(test)]
    pub gpu: &'a Gpu,
    pub units: &'a [UnitRect],
    view: wgpu::BufferView,
    /// Of each unit, in factored renders: the means are those of what does not separate then, if there is such a thing.
    pub weights: Vec<Weights>,
    pub counters: Counters,
    /// Seconds in which the device had nothing to do, so far.
    pub idle_s: f64,
}

impl Collected<'_> {
    /// [unit][row of the full tile][column][channel]; slots outside a unit's rectangle hold zeros.
    pub fn means(&self) -> &[f32] {
        bytemuck::cast_slice(&self.view[..self.view.len() - size_of::<Counters>()])
    }
}

impl Worker {
    /// Uploads the scene and compiles its passes, with waves as large as `budget` lets them be.
    pub fn new(gpu: impl Into<Arc<Gpu>>, prepared: Arc<Prepared>, tile: [u32; 2], budget: Budget) -> Result<Worker> {
        let gpu = gpu.into();
        let plan = WavePlan::new(&prepared, tile, device_limits(&gpu), budget)?;
        Worker::with_waves(gpu, prepared, plan)
    }

    /// As [`Worker::new`], with waves as planned.
    pub fn with_waves(gpu: Arc<Gpu>, prepared: Arc<Prepared>, plan: WavePlan) -> Result<Worker> {
        let _watched = gpu.deadline.watch(buffer::WARM_UP);
        let windows = Windows::of(&prepared.accel, plan.limits.binding)?;
        let on_device = OnDevice { prepared: &prepared, windows };
        let scene = upload(&gpu, &on_device)?;
        let path_buffers = PathBuffers::new(&gpu, &plan);
        let slots = std::array::from_fn(|_| {
            let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
            let staging = buffer::empty(&gpu, "staging", plan.staging_bytes(), usage);
            Slot { staging, units: Vec::new(), is_mapped: false }
        });
        #[cfg(test)]
        gpu.faults.reach(Phase::Start, &gpu);
        // Before shaders are compiled in vain.
        gpu.check()?;

        let shape = EvaluateShape::of(&prepared, gpu.is_software);
        let kernels = on_device.kernels(shape);
        let stage = |source: &Source| {
            let pass = Pass::new(&gpu, source)?;
            let groups = (0..2)
                .map(|group| pass.bind(&gpu, group, |name| scene.find(name).or_else(|| path_buffers.find(name))))
                .collect::<Result<_>>()?;
            Ok::<_, Error>(Stage { pass, groups })
        };
        let camera = stage(&kernels.camera)?;
        let bounce = stage(&kernels.bounce)?;
        let launches = path_buffers.launches.clone();
        let launch = launches.map(|groups| Ok::<_, Error>((stage(&launching())?, groups))).transpose()?;
        let update = kernels.update.as_ref().map(stage).transpose()?;
        let thin = kernels.thin.as_ref().map(stage).transpose()?;
        let evaluate = kernels.evaluate.as_ref().map(stage).transpose()?;
        let first_hits = kernels.first_hits.as_ref().map(|source| FirstHits::new(&gpu, source, &scene)).transpose()?;
        // The cores of a software device have enough to do.
        let threads = if gpu.is_software { 1 } else { MERGE_THREADS.min(rayon::current_num_threads()) };
        let gather = Gather::new(&prepared, plan.tile, SLOTS, threads);
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let saved = gather.iter().flat_map(|_| 0..SAVED_WAVES);
        let saved = saved.map(|_| buffer::empty(&gpu, "saved", plan.saved_bytes(), usage)).collect();
        gpu.check()?;
        let profile = Profile::default();
        let timestamps = None;
        let frame = scene.buffer("frame").expect("every scene has one").clone();
        let max_bounces = prepared.frame.max_bounces;
        Ok(Worker {
            gpu,
            plan,
            profile,
            prepared,
            camera,
            bounce,
            launch,
            update,
            thin,
            evaluate,
            first_hits,
            shape,
            path_buffers,
            frame,
            max_bounces,
            timestamps,
            clocked: false,
            slots,
            next_slot: 0,
            gather,
            saved,
            pending: None,
            waves: VecDeque::new(),
            submitted: 0,
            time_limit: TimeLimit::default(),
            at_work_since: Instant::now(),
            interrupt: Arc::default(),
            idle_since: None,
            idle_s: 0.0,
        })
    }

    /// Measures the passes from now on, at the price of waiting for every wave.
    pub fn enable_profile(&mut self) {
        let passes = if self.update.is_some() { 2 * self.bounces() } else { 2 };
        self.timestamps = self.gpu.timestamps.then(|| Timestamps::new(&self.gpu, passes));
        self.clocked = !self.gpu.timestamps;
    }

    /// Ends paths after `bounces` scattering events from now on, fewer than the scene allows.
    pub fn limit_bounces(&mut self, bounces: u32) {
        self.max_bounces = bounces.min(self.prepared.frame.max_bounces);
        let frame = Frame { max_bounces: self.max_bounces, ..self.prepared.frame };
        self.gpu.queue.write_buffer(&self.frame, 0, bytemuck::bytes_of(&frame));
    }

    /// Heads and records of the first `paths` paths of the wave submitted last, once it was collected; words, as they lie there.
    pub fn saved_paths(&self, paths: u32) -> Result<(Vec<u32>, Vec<u32>)> {
        let (buffers, paths) = (&self.path_buffers, u64::from(paths.min(self.plan.paths)));
        let [heads, records] =
            [self.plan.head_bytes(), self.plan.record_bytes()].map(|all| all / u64::from(self.plan.paths));
        let _watched = self.gpu.deadline.watch(self.limit());
        Ok((
            buffer::read(&self.gpu, &buffers.heads, heads * paths, self.limit())?,
            buffer::read(&self.gpu, &buffers.records, records * paths, self.limit())?,
        ))
    }

    /// Ends the work of [`Worker::submit`] with an error as soon as `interrupt` is set.
    pub fn watch(&mut self, interrupt: &Arc<Interrupt>) {
        self.interrupt = Arc::clone(interrupt);
    }

    /// Starts one epoch of `units` and returns what came of those submitted before, if they were not collected yet: to be
    /// merged while the new ones compute. All but the last waves of these are done then.
    pub fn submit(&mut self, units: &[UnitRect], epoch: u32, epoch_samples: u32) -> Result<Option<Collected<'_>>> {
        let slot = self.next_slot;
        self.next_slot = (slot + 1) % SLOTS;
        if let Some(since) = self.idle_since.take() {
            self.idle_s += since.elapsed().as_secs_f64();
        }

        {
            let _watched = self.gpu.deadline.watch(self.limit());
            self.gpu.queue.write_buffer(&self.path_buffers.units, 0, bytemuck::cast_slice(units));
        }
        let ahead = if self.gpu.is_software { WAVES_AHEAD_SOFTWARE } else { WAVES_AHEAD };
        let ahead = if self.gather.is_some() { SAVED_WAVES } else { ahead };
        if let Some(gather) = &mut self.gather {
            gather.begin(slot, units, epoch_samples);
        }
        for wave in self.plan.waves(units.len() as u32, epoch, epoch_samples) {
            self.interrupt.check()?;
            while self.waves.len() >= ahead {
                self.wait_for_wave()?;
            }
            #[cfg(test)]
            self.gpu.faults.reach(phase(&wave), &self.gpu);
            self.submit_wave(wave, slot)?;
        }

        let watched = self.gpu.deadline.watch(self.limit());
        let mut encoder = self.encoder("transfer");
        let buffers = &self.path_buffers;
        let size = self.unit_bytes() * units.len() as u64;
        let Slot { staging, units: of_slot, is_mapped } = &mut self.slots[slot];
        if std::mem::take(is_mapped) {
            staging.unmap();
        }
        encoder.copy_buffer_to_buffer(&buffers.means, 0, staging, 0, size);
        encoder.copy_buffer_to_buffer(&buffers.counters, 0, staging, size, size_of::<Counters>() as u64);
        encoder.clear_buffer(&buffers.counters, 0, None);
        let submission = self.gpu.queue.submit([encoder.finish()]);
        buffer::map(staging);
        *of_slot = units.to_vec();
        let (last_wave, proof) = (self.submitted, self.proof(units, epoch_samples));
        let before = self.pending.replace(Pending { slot, submission, last_wave, proof });
        #[cfg(test)]
        self.gpu.faults.reach(Phase::Transfer, &self.gpu);
        drop(watched);
        match before {
            Some(before) => self.receive(before).map(Some),
            None => Ok(None),
        }
    }

    /// What each of `rays` meets first, once what is under way is done. Only where the scene has layers.
    pub fn meet(&mut self, rays: &[Question]) -> Result<Vec<Met>> {
        let limit = self.limit();
        let first_hits = self.first_hits.as_ref().ok_or_else(|| Error::Internal("no layers were asked for".into()))?;
        first_hits.ask(&self.gpu, rays, limit)
    }

    /// How long whatever is under way may take.
    fn limit(&self) -> Duration {
        self.time_limit.limit(self.waves.iter().map(|wave| u64::from(wave.paths)).sum())
    }

    /// Waits for the oldest wave under way.
    fn wait_for_wave(&mut self) -> Result<()> {
        let Some(oldest) = self.waves.front() else { return Ok(()) };
        let (number, submission) = (oldest.number, oldest.submission.clone());
        self.wait(submission, number)
    }

    /// Waits for a submission after which the waves up to number `done` have been done.
    fn wait(&mut self, submission: wgpu::SubmissionIndex, done: u64) -> Result<()> {
        buffer::wait(&self.gpu, submission, self.limit())?;
        let mut paths = 0;
        while let Some(wave) = self.waves.pop_front_if(|wave| wave.number <= done) {
            paths += u64::from(wave.paths);
            if let Some((saved, slot)) = wave.saved {
                self.walk(wave.number, &saved, slot)?;
            }
        }
        if paths > 0 {
            self.time_limit.note(paths, self.at_work_since.elapsed());
            self.at_work_since = Instant::now();
        }
        Ok(())
    }

    /// Takes the records of a wave that is done.
    fn walk(&mut self, number: u64, wave: &Wave, slot: usize) -> Result<()> {
        let (Some(gather), Some(scene)) = (&mut self.gather, &self.prepared.separable) else { return Ok(()) };
        let buffer = &self.saved[number as usize % SAVED_WAVES];
        self.gpu.check()?;
        let lost = |e| Error::DevicesLost(format!("{}: {e}", self.gpu.name));
        let view = buffer.slice(..).get_mapped_range().map_err(lost)?;
        let words: &[u32] = bytemuck::cast_slice(&view);
        let (heads, records) = words.split_at(self.plan.head_bytes() as usize / 4);
        gather.take(slot, scene, &Saved { wave, heads, records });
        drop(view);
        buffer.unmap();
        Ok(())
    }

    /// Waits for what is under way, if anything is.
    pub fn collect(&mut self) -> Result<Option<Collected<'_>>> {
        match self.pending.take() {
            Some(last) => self.receive(last).map(Some),
            None => Ok(None),
        }
    }

    fn receive(&mut self, pending: Pending) -> Result<Collected<'_>> {
        self.wait(pending.submission, pending.last_wave)?;
        if self.is_idle() {
            self.idle_since = Some(Instant::now());
        }
        let (unit_bytes, limit) = (self.unit_bytes(), self.limit());
        let Slot { staging, units, is_mapped } = &mut self.slots[pending.slot];
        let end = unit_bytes * units.len() as u64 + size_of::<Counters>() as u64;
        let lost = |e| Error::DevicesLost(format!("{}: {e}", self.gpu.name));
        let view = {
            let _watched = self.gpu.deadline.watch(limit);
            #[cfg(test)]
            self.gpu.faults.reach(Phase::Mapping, &self.gpu);
            // A shortage of memory, say, is why there may be nothing to see.
            self.gpu.check()?;
            staging.slice(..end).get_mapped_range().map_err(lost)?
        };
        *is_mapped = true;
        let mut counters: Counters = bytemuck::pod_read_unaligned(&view[view.len() - size_of::<Counters>()..]);
        // Who walks records sees each path once, whatever channels there are.
        let walked = pending.proof;
        let evaluated = Proof { folded: walked.folded * u64::from(self.shape.blocks), ..walked };
        let on_device = self.evaluate.as_ref().and_then(|_| counters.missing(&evaluated));
        let weights = self.gather.as_mut().map(|gather| gather.finish(pending.slot, &mut counters));
        let on_host = weights.as_ref().and_then(|_| counters.missing(&walked));
        if let Some(what) = on_device.or(on_host) {
            let what = format!("{}: a unit came back incomplete: {what}", self.gpu.name);
            return Err(Error::DevicesLost(what));
        }
        if counters.records > self.plan.max_records {
            return Err(Error::Internal(format!(
                "a path took {} records where {} were planned for: its unit was not merged",
                counters.records, self.plan.max_records
            )));
        }
        Ok(Collected {
            #[cfg(test)]
            gpu: &self.gpu,
            units,
            view,
            weights: weights.unwrap_or_default(),
            counters,
            idle_s: self.idle_s,
        })
    }

    /// Whether nothing is under way.
    pub fn is_idle(&self) -> bool {
        self.pending.is_none()
    }

    /// What the counters must show after the last wave of `units`, where each path is seen once.
    fn proof(&self, units: &[UnitRect], epoch_samples: u32) -> Proof {
        let samples = u64::from(epoch_samples);
        let pixels = |[x0, y0, x1, y1]: &UnitRect| u64::from(x1 - x0) * u64::from(y1 - y0);
        let slots = units.len() as u64 * u64::from(self.plan.tile_pixels());
        Proof {
            paths: units.iter().map(pixels).sum::<u64>() * samples,
            folded: slots * samples,
            sequence: sequence(self.submitted),
        }
    }

    fn unit_bytes(&self) -> u64 {
        u64::from(self.plan.tile_pixels()) * u64::from(self.plan.channels) * 4
    }

    fn encoder(&self, label: &str) -> wgpu::CommandEncoder {
        self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(label) })
    }

    /// Generate: camera rays, then a bounce at a time. Evaluate: all channels along the saved paths.
    fn submit_wave(&mut self, mut wave: Wave, slot: usize) -> Result<()> {
        if self.waves.is_empty() {
            self.at_work_since = Instant::now();
        }
        self.submitted += 1;
        wave.sequence = sequence(self.submitted);
        let paths = wave.path_count;
        let [groups, pixel_groups] = [paths.div_ceil(64), wave.pixel_count.div_ceil(self.shape.pixels)];
        #[cfg(test)]
        match self.gpu.faults.silence() {
            Some(fault::Kind::SilentGenerate) => wave.path_count = 0,
            Some(_) => wave.pixel_count = 0,
            None => {}
        }

        let _watched = self.gpu.deadline.watch(self.limit());
        self.gpu.queue.write_buffer(&self.path_buffers.wave, 0, bytemuck::bytes_of(&wave));
        let mut encoder = self.encoder("wave");
        encoder.clear_buffer(&self.path_buffers.queue_lengths, 0, None);
        let (stride, blocks, bounces) = (self.path_buffers.step_stride, self.shape.blocks, self.bounces());
        let step = |number: u32| [number * stride];
        let (all, pixels) = (grid(groups), grid(pixel_groups));
        let mut pass = self.begin(&mut encoder, "generate", 0);
        self.camera.dispatch(&mut pass, &[], all, 1);
        for bounce in 0..bounces {
            if bounce > 0 && self.update.is_some() {
                drop(pass);
                self.lap(&mut encoder, 1)?;
                pass = self.begin(&mut encoder, "generate", 2 * bounce);
            }
            match &self.launch {
                Some((launch, groups)) if bounce > 0 => {
                    launch.dispatch(&mut pass, &step(bounce - 1), [1, 1], 1);
                    self.bounce.dispatch_indirect(&mut pass, &step(bounce), groups);
                }
                _ => self.bounce.dispatch(&mut pass, &step(bounce), all, 1),
            }
            if self.update.is_some() {
                drop(pass);
                self.lap(&mut encoder, 0)?;
                pass = self.begin(&mut encoder, "evaluate", 2 * bounce + 1);
            }
            if let Some(update) = &self.update {
                update.dispatch(&mut pass, &step(bounce), grid(paths.div_ceil(self.shape.pixels)), blocks);
            }
        }
        if self.update.is_none() {
            drop(pass);
            self.lap(&mut encoder, 0)?;
            pass = self.begin(&mut encoder, "evaluate", 1);
        }
        if let Some(thin) = &self.thin {
            thin.dispatch(&mut pass, &[], all, 1);
        }
        if let Some(evaluate) = &self.evaluate {
            if self.plan.sample_by_sample {
                for sample in 0..wave.samples {
                    evaluate.dispatch(&mut pass, &step(sample), pixels, blocks);
                }
            } else {
                evaluate.dispatch(&mut pass, &[], pixels, blocks);
            }
        }
        drop(pass);
        self.lap(&mut encoder, 1)?;
        if let Some(timestamps) = &self.timestamps {
            timestamps.resolve(&mut encoder);
        }
        let saved = self.gather.is_some().then_some((wave, slot));
        let staging = &self.saved.get(self.submitted as usize % SAVED_WAVES);
        if let Some(staging) = staging {
            let (buffers, plan) = (&self.path_buffers, &self.plan);
            let (heads, head_bytes) = (u64::from(paths) * 8, plan.head_bytes());
            let records = u64::from(paths) * u64::from(plan.max_records) * u64::from(plan.record_size);
            encoder.copy_buffer_to_buffer(&buffers.heads, 0, staging, 0, heads);
            encoder.copy_buffer_to_buffer(&buffers.records, 0, staging, head_bytes, records);
        }
        let submission = self.gpu.queue.submit([encoder.finish()]);
        if let Some(staging) = staging {
            buffer::map(staging);
        }
        self.waves.push_back(InFlight { number: self.submitted, paths, submission, saved });
        if let Some(timestamps) = &self.timestamps {
            let passes = timestamps.read(&self.gpu, self.limit())?;
            passes.into_iter().enumerate().for_each(|(pass, seconds)| self.profile.add(pass, seconds));
        }
        Ok(())
    }

    /// Where passes are clocked, does what `encoder` has, the pass of that number, and adds its time.
    fn lap(&mut self, encoder: &mut wgpu::CommandEncoder, pass: usize) -> Result<()> {
        if !self.clocked {
            return Ok(());
        }
        let done = std::mem::replace(encoder, self.encoder("wave"));
        let began = Instant::now();
        let submission = self.gpu.queue.submit([done.finish()]);
        buffer::wait(&self.gpu, submission, self.limit())?;
        self.profile.add(pass, began.elapsed().as_secs_f64());
        Ok(())
    }

    /// Bounces, and what the last direction meets.
    fn bounces(&self) -> u32 {
        self.max_bounces + 1
    }

    fn begin<'e>(
        &self,
        encoder: &'e mut wgpu::CommandEncoder,
        label: &'static str,
        index: u32,
    ) -> wgpu::ComputePass<'e> {
        encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(label),
            timestamp_writes: self.timestamps.as_ref().map(|timestamps| timestamps.writes(index)),
        })
    }
}

/// When a fault planned for `wave` happens.
#[cfg(test)]
fn phase(wave: &Wave) -> Phase {
    if wave.pixel_begin + wave.sample_begin == 0 { Phase::FirstWave } else { Phase::LaterWave }
}

/// The scene's buffers on a device. Errors: one that exceeds a binding; a device that is lost, or whose memory does not hold them.
pub fn upload(gpu: &Gpu, scene: &OnDevice) -> Result<NamedBuffers> {
    let limits = gpu.device.limits();
    facts::check_bindings(scene, limits.max_storage_buffer_binding_size.min(limits.max_buffer_size))?;
    let storage = scene.buffers().into_iter().map(|buffer| (buffer.name, buffer.bytes));
    NamedBuffers::new(gpu, ("frame", bytemuck::bytes_of(&scene.frame)), storage)
}

/// What `gpu` allows. A binding shows no more than 1 GiB, so that offsets stay within 32 bits of words, and leaves room
/// for the counters that follow the means in a staging buffer.
pub fn device_limits(gpu: &Gpu) -> DeviceLimits {
    let buffer = gpu.limits.max_buffer_size - buffer::allocated(size_of::<Counters>() as u64);
    DeviceLimits {
        binding: gpu.limits.max_storage_buffer_binding_size.min(buffer).min(1 << 30),
        uniform_alignment: gpu.limits.min_uniform_buffer_offset_alignment,
        software: gpu.is_software,
    }
}

/// What marks wave `number` on the device: 16 bits, never 0.
fn sequence(number: u64) -> u32 {
    (number % 65_535) as u32 + 1
}

impl Stage {
    /// `offsets`: one per dynamic binding of the pass.
    fn dispatch(&self, pass: &mut wgpu::ComputePass<'_>, offsets: &[u32], [x, y]: [u32; 2], z: u32) {
        self.set(pass, offsets);
        pass.dispatch_workgroups(x, y, z);
    }

    /// Likewise, over as many workgroups as stand in a buffer by then.
    fn dispatch_indirect(&self, pass: &mut wgpu::ComputePass<'_>, offsets: &[u32], groups: &wgpu::Buffer) {
        self.set(pass, offsets);
        pass.dispatch_workgroups_indirect(groups, 0);
    }

    fn set(&self, pass: &mut wgpu::ComputePass<'_>, offsets: &[u32]) {
        pass.set_pipeline(&self.pass.pipeline);
        pass.set_bind_group(0, &self.groups[0], &[]);
        pass.set_bind_group(1, &self.groups[1], offsets);
    }
}

#[cfg(test)]
mod tests {
    use std::mem::offset_of;

    use glam::DVec3;

    use super::*;
    use crate::scene::Sides;
    use crate::scene_builder::{Builder, room, sphere};

    /// A lamp in a closed room, so that every path goes all the way.
    fn worker() -> Worker {
        let scene = Builder::new()
            .bounces(3)
            .diffuse(room(DVec3::splat(-2.0), DVec3::splat(2.0)), 0.5)
            .lamp(sphere(DVec3::new(0.0, 1.0, 0.0), 0.1), 1.0, Sides::Front)
            .build();
        let prepared = Arc::new(Prepared::new(&scene, 0).expect("a scene"));
        Worker::new(Gpu::open().expect("a device"), prepared, [4, 4], Budget::default()).expect("a worker")
    }

    /// The counters of 64 samples of 3 x 2 pixels.
    fn counters(worker: &mut Worker) -> Result<Counters> {
        assert!(worker.submit(&[[0, 0, 3, 2]], 0, 64)?.is_none());
        Ok(worker.collect()?.expect("just submitted").counters)
    }

    /// Without timestamps passes are clocked, and compute the same.
    #[test]
    fn passes_are_measured_with_and_without_timestamps() {
        let mut worker = worker();
        let rays = counters(&mut worker).expect("counters").rays();
        for has_timestamps in [true, false] {
            let mut again = self::worker();
            let gpu = Arc::get_mut(&mut again.gpu).expect("the only one");
            gpu.timestamps &= has_timestamps;
            again.enable_profile();
            assert_eq!(counters(&mut again).expect("counters").rays(), rays);
            let Profile { generate_s, evaluate_s } = again.profile;
            assert!(generate_s > 0.0 && evaluate_s > 0.0, "{:?}", again.profile);
        }
    }

    /// A path that takes more records than were planned for harms no other, and its unit is not merged.
    #[test]
    fn too_many_records_are_a_fault_of_their_own() {
        let scene = Builder::new()
            .bounces(3)
            .plastic(room(DVec3::splat(-2.0), DVec3::splat(2.0)), 0.5, 1.5, 0.2)
            .lamp(sphere(DVec3::new(0.0, 1.0, 0.0), 0.1), 1.0, Sides::Front)
            .build();
        let mut prepared = Prepared::new(&scene, 0).expect("a scene");
        let planned = prepared.frame.max_records;
        let mut run = |most: u32| {
            prepared.frame.max_records = most;
            let prepared = Arc::new(std::mem::replace(&mut prepared, Prepared::new(&scene, 0).expect("a scene")));
            let gpu = Gpu::open().expect("a device");
            counters(&mut Worker::new(gpu, prepared, [4, 4], Budget::default()).expect("a worker"))
        };
        let used = run(planned).expect("counters").records;
        assert!(used > 8 && used <= planned, "{used} of {planned}");
        assert_eq!(run(used).expect("just enough").records, used);
        let error = run(used - 1).expect_err("too few");
        let said = format!("a path took {used} records where {} were planned for", used - 1);
        assert!(matches!(&error, Error::Internal(what) if what.contains(&said)), "{error}");
    }

    /// The count of rays goes on beyond 32 bits, from wherever it crosses them.
    #[test]
    fn rays_do_not_wrap() {
        let mut worker = worker();
        let rays = counters(&mut worker).expect("counters").rays();
        // 384 paths of up to 4 vertices, each with its shadow ray but the last.
        assert!((384 * 2..=384 * 7).contains(&rays), "{rays}");
        for before in [u32::MAX, u32::MAX - 100, u32::MAX - rays as u32, u32::MAX - rays as u32 + 1] {
            let at = offset_of!(Counters, rays_low) as u64;
            worker.gpu.queue.write_buffer(&worker.path_buffers.counters, at, &before.to_le_bytes());
            assert_eq!(counters(&mut worker).expect("counters").rays(), u64::from(before) + rays);
        }
    }
}
