//! What is opened, decided and refused before a render writes anything.

use std::ops::Range;
use std::sync::Arc;

use crate::cube::{Brightness, Choices, Header, check_target};
use crate::device::prepared::Prepared;
use crate::gpu::adapter::Gpu;
use crate::render::interrupt::Interrupt;
use crate::render::job::Job;
use crate::render::last_bounce::LastBounce;
use crate::render::pilot::Pilot;
use crate::render::schedule::Event;
use crate::render::wave::{Budget, WavePlan};
use crate::render::worker::device_limits;
use crate::render::{pilot, plan};
use crate::scene::Evaluator;
use crate::{Error, Result, preview};

/// What a render has before anything is written.
pub(super) struct Ready {
    pub header: Header,
    pub tiles: Range<u32>,
    pub samples_limit: Option<u32>,
    pub gpus: Vec<Gpu>,
    /// Whether the first of them is a software device.
    pub software: bool,
    pub evaluator: Evaluator,
    pub prepared: Arc<Prepared>,
    /// What the pilot chose.
    pub choices: Option<Choices>,
    /// What it tells of the picture, where tiles have ends of their own.
    pub brightness: Option<Brightness>,
}

/// Opens devices, and refuses and decides what can be before anything is written.
pub(super) fn get_ready(
    job: &Job,
    interrupt: &Arc<Interrupt>,
    observe: &mut dyn FnMut(Event) -> Result<()>,
) -> Result<Ready> {
    plan::check(&job.scene)?;
    let samples_limit = job.stop.samples_limit(job.scene.integrator.epoch, job.uncertainty)?;
    let tile = plan::tile_size(&job.scene, job.tile);
    let mut header = job.header(tile)?;
    let tiles = job.tiles(&header)?;
    let there = check_target(&job.output, &header, job.existing, &tiles)?;
    if let Some(preview) = &job.preview {
        preview::PICTURE.check_target(&preview.file)?;
    }
    let mut gpus = Gpu::open_all(&job.devices)?;
    for gpu in &gpus {
        observe(Event::Device(&gpu.name))?;
    }
    if gpus.iter().any(|gpu| gpu.name != gpus[0].name) {
        let what =
            "the devices are of different kinds: the cube is right, but its last bits depend on which rendered what";
        observe(Event::Warning(what.into()))?;
    }
    let software = gpus[0].is_software;
    let evaluator = plan::evaluator(&job.scene, there.as_ref(), software)?;
    plan::record_evaluator(&mut header, evaluator);
    let prepared = Prepared::for_evaluator(&job.scene, job.seed, evaluator)?;
    refuse_too_little(job, &prepared, tile, &gpus)?;
    let chosen = there.as_ref().map(|_| Choices::read(&job.output)).transpose()?.flatten();
    let noted = there.as_ref().map(|_| Brightness::read(&job.output)).transpose()?.flatten();
    let mut pilot = Pilot {
        scene: &job.scene,
        gpus: &mut gpus,
        memory: job.memory,
        interrupt,
        warn: &mut |what| observe(Event::Warning(what)),
    };
    let (prepared, choices) = pilot.decide(prepared, chosen)?;
    let brightness = match noted {
        None if job.stop.per_tile => Some(pilot.brightness(&prepared)?),
        noted => noted.filter(|_| job.stop.per_tile),
    };
    let first = Arc::new(gpus.remove(0));
    let last_bounce = LastBounce::measure(&job.scene, &prepared, &first, job.memory, interrupt);
    gpus.insert(0, Arc::into_inner(first).ok_or_else(|| Error::Internal("a device was kept that was lent".into()))?);
    match last_bounce {
        Ok(None) => {}
        Ok(Some(last)) if last.is_much() => observe(Event::Warning(last.to_string()))?,
        Ok(Some(last)) => observe(Event::Note(last.to_string()))?,
        Err(error) if error.may_be_of_one_device() => {
            observe(Event::Warning(format!("what the last bounce brings was not measured: {error}")))?;
        }
        Err(error) => return Err(error),
    }
    if evaluator == Evaluator::Factored && prepared.has_remainder() {
        let what = prepared.obstacles(&job.scene).join(", ");
        observe(Event::Note(format!(
            "light by what does not separate stays in channels, where relight cannot change it: {what} (plan --pilot says how much it is)"
        )))?;
    }
    if prepared.accel.degenerate > 0 {
        let what =
            format!("{} triangles without area in f32 were left out: no ray can meet them", prepared.accel.degenerate);
        observe(Event::Warning(what))?;
    }
    Ok(Ready { header, tiles, samples_limit, gpus, software, evaluator, prepared, choices, brightness })
}

/// Refuses memory that holds the waves of no device, before a pilot's smaller ones fill it.
fn refuse_too_little(job: &Job, prepared: &Prepared, tile: [u32; 2], gpus: &[Gpu]) -> Result<()> {
    let budget = Budget { memory: job.memory, paths: None };
    let thinned = pilot::may_thin(&job.scene, prepared);
    let plans = gpus.iter().map(|gpu| WavePlan::with_thinning(prepared, tile, device_limits(gpu), budget, thinned));
    let mut refusals = Vec::new();
    for plan in plans {
        match plan {
            Ok(_) => return Ok(()),
            Err(refusal) => refusals.push(refusal),
        }
    }
    refusals.into_iter().next().map_or(Ok(()), Err)
}
