//! Speed, error and memory of the peer's Cornell box: 64 x 64 pixels, 400 channels, 5 bounces, one core of a software
//! device.
//!
//! `cargo bench --bench cornell` prints paths per CPU second, mean relMSE x CPU seconds (compilation apart), anonymous
//! memory apart from scene and device buffers, and where the time goes. Without `--bench`, as `cargo test` runs it, one
//! short round shows that it still works.

mod clock;

use std::path::Path;
use std::sync::Arc;

use clock::cpu_seconds;
use spectile::Result;
use spectile::cube::{Cube, Existing};
use spectile::device::prepared::Prepared;
use spectile::gpu::adapter::{Gpu, Selection};
use spectile::render::job::{Job, StopRule};
use spectile::render::schedule::{self, Event};
use spectile::render::wave::Budget;
use spectile::render::worker::Worker;
use spectile::report::throughput::median;
use spectile::scene::{self, Scene};

/// Set in the process that measures: the driver reads its number of threads once, at the first call.
const THREADS: &str = "LP_NUM_THREADS";

fn main() -> Result<()> {
    let measure = std::env::args().any(|a| a == "--bench");
    if std::env::var_os(THREADS).is_none() {
        let own = std::env::current_exe().expect("this program");
        let mut again = std::process::Command::new(own);
        let status = again.args(std::env::args_os().skip(1)).env(THREADS, "1").status().expect("this program again");
        std::process::exit(status.code().unwrap_or(1));
    }
    let [channels, rounds, samples, factor] = if measure { [400, 9, 64, 20] } else { [16, 1, 4, 2] };
    let scene = cornell(channels);
    speed(&scene, rounds, if measure { 64 } else { 4 })?;
    error(&scene, samples as u32, factor as u32)
}

fn cornell(channels: usize) -> Scene {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell/cornell.toml");
    let set = |key: &str, value: usize| (key.to_owned(), value.to_string());
    let overrides = [set("film.width", 64), set("film.height", 64), set("channels.equal.count", channels)];
    scene::load(&file, &overrides).expect("the Cornell box")
}

/// Anonymous memory of this process, bytes (Linux).
fn anonymous_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("RssAnon:")).unwrap_or("0 kB");
    line.trim().trim_end_matches(" kB").parse::<u64>().unwrap_or(0) << 10
}

/// Paths per CPU second, and microseconds of a path in generate and evaluate.
fn speed(scene: &Scene, rounds: usize, samples: u32) -> Result<()> {
    let prepared = Arc::new(Prepared::new(scene, 0)?);
    let mut worker = Worker::new(Gpu::open()?, prepared, [64, 64], Budget::default())?;
    let epoch = |worker: &mut Worker, index: u32| -> Result<()> {
        worker.submit(&[[0, 0, 64, 64]], index, samples)?;
        worker.collect().map(drop)
    };
    epoch(&mut worker, 0)?;
    let paths = 64.0 * 64.0 * f64::from(samples);
    let mut rates = Vec::new();
    for round in 0..rounds as u32 {
        let began = cpu_seconds();
        epoch(&mut worker, 1 + round)?;
        rates.push(paths / (cpu_seconds() - began));
    }
    worker.enable_profile();
    epoch(&mut worker, 1 + rounds as u32)?;
    let us = |seconds: f64| 1e6 * seconds / paths;
    println!("{}, K = {}, {samples} samples a unit, {rounds} rounds", worker.gpu.name, scene.channels.len());
    rates.sort_by(f64::total_cmp);
    let (middle, fastest) = (median(&rates), rates[rates.len() - 1]);
    println!("paths per CPU second: median {middle:.0}, {:.0} to {fastest:.0}", rates[0]);
    println!(
        "of a path: generate {:.3} us, evaluate {:.3} us",
        us(worker.profile.generate_s),
        us(worker.profile.evaluate_s)
    );
    Ok(())
}

/// Renders `samples` samples and `factor` times as many with another seed; the longer run's share of the difference is
/// subtracted.
fn error(scene: &Scene, samples: u32, factor: u32) -> Result<()> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (short, seconds, memory) = render(scene, samples, 1, &folder.path().join("short.zarr"))?;
    let (long, _, _) = render(scene, samples * factor, 2, &folder.path().join("long.zarr"))?;
    let comparison = spectile::cube::compare(&short, &long)?;
    let channels = &comparison.channels;
    let measured = channels.iter().map(|c| c.rel_mse).sum::<f64>() / channels.len() as f64;
    let own = measured * f64::from(factor) / f64::from(factor + 1);
    println!("{samples} samples: mean relMSE {own:.4e} in {seconds:.3} CPU s, product {:.4} s", own * seconds);
    println!("anonymous memory apart from scene and device buffers: {:.0} MiB", memory as f64 / f64::from(1 << 20));
    Ok(())
}

/// The cube, CPU seconds from the first dispatch after a warm-up of the shader cache, and peak anonymous memory less scene
/// and device buffers.
fn render(scene: &Scene, samples: u32, seed: u64, output: &Path) -> Result<(Cube, f64, u64)> {
    let job = Job {
        scene: scene.clone(),
        output: output.to_owned(),
        existing: Existing::Refuse,
        tiles: None,
        seed,
        tile: None,
        uncertainty: false,
        layers: Vec::new(),
        stop: StopRule { samples: Some(samples), ..StopRule::default() },
        preview: None,
        profile: false,
        devices: Selection::Count(1),
        memory: None,
        feed: None,
    };
    let (mut began, mut peak) = (None, 0);
    let summary = schedule::run(&job, &Arc::default(), &mut |event| {
        match event {
            // The first epoch of one sample compiles the shaders.
            Event::Epoch(status) if status.samples == 1 => began = Some(cpu_seconds()),
            Event::Progress(_) => peak = peak.max(anonymous_bytes()),
            _ => {}
        }
        Ok(())
    })?;
    let seconds = cpu_seconds() - began.unwrap_or(0.0);
    Ok((Cube::open(output)?, seconds, peak.saturating_sub(summary.device_bytes)))
}
