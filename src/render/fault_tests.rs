//! Devices that are lost, full, hung, stuck or silent at every phase of a unit: others finish with the same bytes; alone,
//! whatever was merged stays.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use glam::{DVec2, DVec3};

use crate::cube::{Cube, Existing, epoch_samples};
use crate::cube_files::{Files, arrays};
use crate::gpu::adapter::{Gpu, Selection};
use crate::gpu::buffer;
use crate::gpu::fault::{self, Fault, Faults, Kind, Phase};
use crate::render::job::{Job, StopRule};
use crate::render::schedule::{self, Event, Summary};
use crate::scene::{Filter, Projection, Scene, Sides};
use crate::scene_builder::{Builder, look, quad, room};
use crate::spectral::Channels;
use crate::{Error, Result};

const SAMPLES: u32 = 64;
const EPOCH: u32 = 16;
/// 3 x 2 tiles, those at the right and the bottom cut off.
const SIZE: [u32; 2] = [40, 26];
const TILE: u32 = 16;

/// One at a time: the deadlines and devices of one test are none of another's business.
fn turn() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(|e| e.into_inner())
}

fn scene() -> Scene {
    let projection = Projection::Perspective { tan_half: DVec2::splat(0.7) };
    let mut scene = Builder::new()
        .camera(look(DVec3::new(0.0, 0.0, 0.9), DVec3::ZERO, DVec3::Y, projection))
        .film(SIZE[0], SIZE[1], Filter::Box)
        .channels(Channels::equal(400.0, 700.0, 9))
        .bounces(3)
        .diffuse(room(DVec3::splat(-1.0), DVec3::splat(1.0)), 0.5)
        .lamp(quad(DVec3::new(-0.3, 0.9, -0.3), DVec3::X * 0.6, DVec3::Z * 0.6), 1.0, Sides::Front)
        .build();
    scene.integrator.epoch = EPOCH;
    scene
}

/// How a render went.
struct Outcome {
    result: Result<Summary>,
    arrays: Files,
    warnings: Vec<String>,
    /// Units merged, as was last reported.
    units: u64,
    /// Samples per pixel and values of each tile that has any.
    tiles: BTreeMap<u32, (u32, Vec<u32>)>,
}

impl Outcome {
    #[track_caller]
    fn succeeded(&self) -> &Summary {
        self.result.as_ref().unwrap_or_else(|e| panic!("{e}; {:?}", self.warnings))
    }
}

/// Renders into a cube of its own.
fn render(devices: usize, samples: u32, observe: &mut dyn FnMut(&Event)) -> Outcome {
    let folder = tempfile::tempdir().expect("a folder");
    render_into(&folder.path().join("cube.zarr"), Existing::Refuse, devices, samples, observe)
}

/// Renders on `devices` devices, whose faults have been planned. Few paths fit: every unit takes several waves.
fn render_into(
    output: &Path,
    existing: Existing,
    devices: usize,
    samples: u32,
    observe: &mut dyn FnMut(&Event),
) -> Outcome {
    let job = Job {
        scene: scene(),
        output: output.to_owned(),
        existing,
        tiles: None,
        seed: 3,
        tile: Some(TILE),
        uncertainty: false,
        layers: Vec::new(),
        stop: StopRule { samples: Some(samples), ..StopRule::default() },
        preview: None,
        profile: false,
        devices: Selection::Count(devices),
        memory: Some(buffer::WGPU_BYTES + (160 << 10)),
        feed: None,
    };
    let (mut warnings, mut units) = (Vec::new(), 0);
    let result = schedule::run(&job, &Arc::default(), &mut |event| {
        observe(&event);
        match event {
            Event::Warning(what) => warnings.push(what),
            Event::Progress(status) => units = status.devices.iter().map(|d| d.units).sum(),
            _ => {}
        }
        Ok(())
    });
    let mut tiles = BTreeMap::new();
    if let Ok(cube) = Cube::open(output) {
        for tile in 0..cube.grid().count() {
            if let Some(chunk) = cube.chunk(tile).expect("read") {
                let bits = chunk.values().iter().map(|v| v.to_bits()).collect();
                tiles.insert(tile, (cube.samples(tile).expect("samples"), bits));
            }
        }
    }
    let arrays = if output.exists() { arrays(output) } else { Files::new() };
    Outcome { result, arrays, warnings, units, tiles }
}

fn plan(phase: Phase, skip: u32, kind: Kind) -> Arc<Faults> {
    fault::plan([Fault { phase, skip, kind }])
}

/// Of two devices, the first has a fault and the second waits for it.
fn render_with_another(phase: Phase, kind: Kind) -> (Outcome, Arc<Faults>) {
    let faults = plan(phase, 1, kind);
    plan(Phase::Between, 0, Kind::After(Arc::clone(&faults)));
    let outcome = render(2, SAMPLES, &mut |_| ());
    (outcome, faults)
}

const DRIVER: [Phase; 4] = [Phase::FirstWave, Phase::LaterWave, Phase::Transfer, Phase::Mapping];
const ALL: [Phase; 6] =
    [Phase::FirstWave, Phase::LaterWave, Phase::Transfer, Phase::Mapping, Phase::Merge, Phase::Between];

/// Faults after which a device leaves, what is said then, and the phases in which they can happen.
fn fatal() -> Vec<(&'static str, Kind, &'static str, &'static [Phase])> {
    vec![
        ("lost", Kind::Lost, "lost by a test", &ALL),
        ("destroyed", Kind::Destroyed, "device lost (Destroyed)", &ALL),
        ("hung", Kind::Hang, "hung: no answer", &ALL),
        ("stuck", Kind::Stuck, "stuck in its driver", &DRIVER),
        ("silent generate", Kind::SilentGenerate, "a unit came back incomplete", &DRIVER[..2]),
        ("silent evaluate", Kind::SilentEvaluate, "a unit came back incomplete", &DRIVER[..2]),
        ("an invalid call", Kind::Invalid, "greater than the maximum buffer size", &ALL),
    ]
}

/// The other device finishes: the same bytes, one warning that says why.
#[test]
fn another_device_finishes_with_the_same_bytes() {
    let _turn = turn();
    let undisturbed = render(1, SAMPLES, &mut |_| ());
    undisturbed.succeeded();
    assert!(undisturbed.warnings.is_empty() && undisturbed.tiles.len() == 6, "{:?}", undisturbed.warnings);
    for (name, kind, said, phases) in fatal() {
        for &phase in phases {
            let (outcome, faults) = render_with_another(phase, kind.clone());
            assert_eq!(faults.fired(), 1, "{name}, {phase:?}");
            outcome.succeeded();
            let [warning] = &outcome.warnings[..] else { panic!("{name}, {phase:?}: {:?}", outcome.warnings) };
            // The other may have rendered what was given back before the first has said that it leaves.
            let lost = ["device 1 is lost, 1 go on without it: ", "device 1 is lost, others finished the render: "];
            assert!(lost.iter().any(|lost| warning.starts_with(lost)), "{name}, {phase:?}: {warning}");
            assert!(warning.contains(said), "{name}, {phase:?}: {warning}");
            assert!(outcome.arrays == undisturbed.arrays, "{name}, {phase:?}");
            faults.release();
        }
    }
}

/// Alone, the render ends as lost, and the cube holds what was merged: whole units, bit for bit those of an undisturbed
/// render, and all that had been reported. Gone on with, it ends with the bytes of one.
#[test]
fn alone_every_merged_unit_stays() {
    let _turn = turn();
    let ends: Vec<u32> = (0..)
        .scan(0, |end, epoch| {
            *end += epoch_samples(epoch, EPOCH);
            Some(*end)
        })
        .take_while(|&end| end <= SAMPLES)
        .collect();
    let straight: BTreeMap<u32, Outcome> = ends.iter().map(|&n| (n, render(1, n, &mut |_| ()))).collect();
    for (name, kind, said, phases) in fatal() {
        for &phase in phases {
            let faults = plan(phase, 4, kind.clone());
            let folder = tempfile::tempdir().expect("a folder");
            let output = folder.path().join("cube.zarr");
            let outcome = render_into(&output, Existing::Refuse, 1, SAMPLES, &mut |_| ());
            assert_eq!(faults.fired(), 1, "{name}, {phase:?}");
            match &outcome.result {
                Err(error @ Error::DevicesLost(what)) => {
                    assert!(what.contains(said) && error.exit_code() == 4, "{phase:?}: {what}");
                }
                Err(error) => panic!("{name}, {phase:?}: {error}"),
                Ok(_) => panic!("{name}, {phase:?}: the render went on"),
            }
            assert!(outcome.warnings.is_empty(), "{:?}", outcome.warnings);
            let mut units = 0;
            for (tile, (samples, bits)) in &outcome.tiles {
                assert!(straight[samples].tiles[tile].1 == *bits, "{name}, {phase:?}: tile {tile}");
                units += ends.iter().filter(|&end| end <= samples).count() as u64;
            }
            assert_eq!(units, outcome.units, "{name}, {phase:?}: what is there, and what was reported");
            assert!(units > 0, "{name}, {phase:?}: nothing had been merged");
            faults.release();
            // A thread that was stuck holds the cube until it returns.
            let cube = Cube::open(&output).expect("a cube");
            while cube.in_use().is_some() {
                std::thread::sleep(std::time::Duration::from_millis(1));
            }
            let resumed = render_into(&output, Existing::Resume, 1, SAMPLES, &mut |_| ());
            resumed.succeeded();
            assert!(resumed.warnings.is_empty(), "{name}, {phase:?}: {:?}", resumed.warnings);
            assert!(resumed.arrays == straight[&SAMPLES].arrays, "{name}, {phase:?}");
        }
    }
}

/// A device that runs out of memory goes on with smaller waves, alone and among others: the same bytes, one warning.
#[test]
fn out_of_memory_makes_smaller_waves() {
    let _turn = turn();
    let expected = render(1, SAMPLES, &mut |_| ()).arrays;
    for phase in [Phase::Start].into_iter().chain(ALL) {
        for others in [0, 1] {
            // At its start a device comes by once before it is rebuilt.
            let skip = if phase == Phase::Start { 0 } else { 1 };
            let faults = plan(phase, skip, Kind::OutOfMemory);
            let outcome = render(1 + others, SAMPLES, &mut |_| ());
            outcome.succeeded();
            if faults.fired() == 0 {
                // The other device was faster; alone it must happen.
                assert_eq!(others, 1, "{phase:?}");
                continue;
            }
            let [warning] = &outcome.warnings[..] else { panic!("{phase:?}: {:?}", outcome.warnings) };
            assert!(warning.starts_with("device 1 (") && warning.contains("ran out of memory"), "{warning}");
            assert!(outcome.arrays == expected, "{phase:?}, {others} others");
        }
    }
}

/// Again and again, until there are no smaller waves: the user is told once; then the device leaves.
#[test]
fn out_of_memory_for_good() {
    let _turn = turn();
    let expected = render(1, SAMPLES, &mut |_| ()).arrays;
    let shortage = |phase, skip| Fault { phase, skip, kind: Kind::OutOfMemory };
    // Twice in the middle: two steps down, one warning.
    let faults = fault::plan([shortage(Phase::LaterWave, 3), shortage(Phase::Mapping, 1)]);
    let outcome = render(1, SAMPLES, &mut |_| ());
    outcome.succeeded();
    assert_eq!((faults.fired(), outcome.warnings.len()), (2, 1), "{:?}", outcome.warnings);
    assert!(outcome.arrays == expected);

    // Every time in the middle: it leaves, and what was merged stays.
    let faults = fault::plan((0..40).map(|_| shortage(Phase::LaterWave, 1)));
    let outcome = render(1, SAMPLES, &mut |_| ());
    let error = outcome.result.err().expect("no memory");
    assert!(matches!(&error, Error::DevicesLost(what) if what.contains("memory does not hold")), "{error}");
    assert!((2..40).contains(&faults.fired()), "{}", faults.fired());

    // From the start: refused as too large, and nothing is written; with another device it is left out.
    let never = || fault::plan((0..40).map(|_| shortage(Phase::Start, 0)));
    never();
    let outcome = render(1, SAMPLES, &mut |_| ());
    assert_eq!(outcome.result.err().expect("no memory").exit_code(), 2);
    assert!(outcome.arrays.is_empty() && outcome.warnings.is_empty());
    never();
    let outcome = render(2, SAMPLES, &mut |_| ());
    outcome.succeeded();
    let [warning] = &outcome.warnings[..] else { panic!("{:?}", outcome.warnings) };
    assert!(warning.starts_with("device 1 is left out: ") && warning.contains("memory does not hold"), "{warning}");
    assert!(outcome.arrays == expected);
}

/// A thread that comes back from the driver after its units were given to another: its results are discarded, the units are
/// not merged twice, and the render goes on undisturbed.
#[test]
fn late_results_are_discarded() {
    let _turn = turn();
    let expected = render(1, SAMPLES, &mut |_| ()).arrays;
    let faults = plan(Phase::Mapping, 1, Kind::Stuck);
    plan(Phase::Between, 0, Kind::After(Arc::clone(&faults)));
    let (mut superseded, mut merged) = (false, 0);
    let outcome = render(2, SAMPLES, &mut |event| match event {
        Event::Warning(what) if what.contains("stuck in its driver") => superseded = true,
        // The units have been rendered again, and others are under way.
        Event::Progress(_) if superseded => {
            merged += 1;
            if merged == 3 {
                faults.release();
                let began = Instant::now();
                while faults.discarded.load(Ordering::SeqCst) == 0 {
                    assert!(began.elapsed() < Duration::from_secs(60), "the late result never came");
                    std::thread::sleep(Duration::from_millis(1));
                }
            }
        }
        _ => {}
    });
    outcome.succeeded();
    assert!(faults.discarded.load(Ordering::SeqCst) >= 1 && merged > 3, "{merged}");
    assert_eq!(outcome.warnings.len(), 1, "{:?}", outcome.warnings);
    assert!(outcome.arrays == expected);
}

/// A bug in a device's thread ends the render with an error, and nobody waits for what will not come.
#[test]
fn a_panic_is_an_error() {
    let _turn = turn();
    for phase in [Phase::LaterWave, Phase::Merge] {
        let faults = plan(phase, 1, Kind::Panic);
        plan(Phase::Between, 0, Kind::After(faults));
        let error = render(2, SAMPLES, &mut |_| ()).result.err().expect("a bug");
        assert!(matches!(&error, Error::Internal(what) if what.contains("device 1 panicked")), "{error}");
    }
}

/// A thread that is stuck before its device was ever ready does not hold up the render either.
#[test]
fn stuck_at_the_start() {
    let _turn = turn();
    let expected = render(1, SAMPLES, &mut |_| ()).arrays;
    let faults = plan(Phase::Start, 0, Kind::Stuck);
    let outcome = render(2, SAMPLES, &mut |_| ());
    outcome.succeeded();
    let [warning] = &outcome.warnings[..] else { panic!("{:?}", outcome.warnings) };
    assert!(warning.starts_with("device 1 is left out: ") && warning.contains("stuck in its driver"), "{warning}");
    assert!(outcome.arrays == expected);
    faults.release();
}

/// Real work on a real device, waited for too briefly: twice, and it counts as hung; once is not enough.
#[test]
fn waits_time_out_twice() {
    let _turn = turn();
    let gpu = Gpu::open().expect("a device");
    let (size, usage) = (256 << 20, wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST);
    let [from, to] = ["from", "to"].map(|name| buffer::empty(&gpu, name, size, usage));
    let work = || {
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        for _ in 0..8 {
            encoder.copy_buffer_to_buffer(&from, 0, &to, 0, size);
        }
        gpu.queue.submit([encoder.finish()])
    };
    buffer::wait(&gpu, work(), Duration::from_secs(300)).expect("long enough");
    let error = buffer::wait(&gpu, work(), Duration::from_micros(10)).expect_err("2 GiB in 20 microseconds");
    assert!(gpu.is_hung() && error.to_string().contains("hung: no answer"), "{error}");
}
