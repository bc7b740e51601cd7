//! `spectile bench`: the evaluators side by side.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::json;

use super::Output;
use super::render::parse_time;
use crate::device::example::with_everything;
use crate::files::shown;
use crate::gpu::adapter::{Gpu, Selection};
use crate::render::interrupt::Interrupt;
use crate::report::bench::{Frames, Report, Row, Section};
use crate::report::throughput::{Trial, frames, measure};
use crate::report::{Circumstances, make_folder, write};
use crate::scene::{self, Evaluator, Scene};
use crate::{Error, Result};

/// Where the repository's own scenes are, seen from its root.
const SCENES: [&str; 4] = [
    "scenes/cornell/cornell.toml",
    "scenes/conference/conference.toml",
    "scenes/aircraft/aircraft.toml",
    "scenes/statues/statues.toml",
];

/// Measure paths per second, evaluator by evaluator, and write a report
///
/// Renders each SCENE (the repository's four, if none is given) with every evaluator by turns: the conventional path tracer (pt)
/// and three ways to evaluate saved paths (dpept-path, dpept-spectral, dpept-pixel), against the number of channels and of paths at
/// a time, and of pixels; generate and evaluate apart; memory as planned and as allocated. Then each scene with its own kernels against one set of
/// kernels for all scenes. Writes DIR/bench.csv, .json and .html, anew after every step; Ctrl-C leaves what has been measured.
#[derive(Debug, clap::Args)]
#[command(after_long_help = "\
Examples:
  spectile bench -o report                                       from the repository's root
  spectile bench scene.toml -o report --channels 8,400 --pools 32768
  spectile bench scene.toml -o report --evaluators dpept-pixel,pt --rounds 9")]
pub struct Args {
    /// Scene files (TOML) whose channels are equal
    pub scenes: Vec<PathBuf>,

    /// The folder of the report
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,

    /// Numbers of channels
    #[arg(long, value_name = "K,…", value_delimiter = ',', default_value = "2,8,32,128,512,2048,4096")]
    pub channels: Vec<u32>,

    /// Numbers of paths at a time, at 128 channels
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_value = "4096,32768,262144,1048576")]
    pub pools: Vec<u32>,

    /// Widths and heights of frames, at 128 channels
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_value = "128,256,512,1024")]
    pub frames: Vec<u32>,

    /// Evaluators to compare
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "pt,dpept-path,dpept-spectral,dpept-pixel", value_parser = parse_evaluator)]
    pub evaluators: Vec<Evaluator>,

    /// Measure scenes with their own kernels only
    ///
    /// Kernels that have everything compiled in take a minute and more to compile on a software device.
    #[arg(long)]
    pub own_kernels: bool,

    /// Turns that each evaluator gets
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    pub rounds: u32,

    /// Begin nothing new after this time
    #[arg(long, value_name = "TIME", default_value = "1h", value_parser = parse_time)]
    pub budget: Duration,

    /// The device, as for `render`; the first of several is used
    #[arg(long, value_name = "all|N|LIST", default_value = "all")]
    pub devices: Selection,

    /// One JSON object a line on stdout, instead of text
    #[arg(long)]
    pub json: bool,
}

/// Channels of the parts that do not vary them, and width and height of the picture.
const CHANNELS: u32 = 128;
const SIDE: u32 = 512;

/// Something to measure by turns: evaluators of a scene, or its kernels.
struct Step<'a> {
    part: Section,
    file: &'a Path,
    channels: u32,
    pool: Option<u32>,
}

pub fn run(args: &Args, output: &Output) -> Result<()> {
    let was_there = args.output.exists();
    let measured = run_all(args, output);
    if measured.is_err() && !was_there {
        // Only where nothing was measured: what is not empty stays.
        let _ = std::fs::remove_dir(&args.output);
    }
    measured
}

fn run_all(args: &Args, output: &Output) -> Result<()> {
    let interrupt = output.interrupt()?;
    let files = if args.scenes.is_empty() { SCENES.map(PathBuf::from).to_vec() } else { args.scenes.clone() };
    if let Some(missing) = files.iter().find(|file| args.scenes.is_empty() && !file.exists()) {
        return Err(Error::Usage(format!(
            "{} is not there: name scenes, or run `spectile bench` in the root of Spectile's repository",
            missing.display()
        )));
    }
    make_folder(&args.output, "bench")?;
    let gpu = Arc::new(Gpu::open_all(&args.devices)?.remove(0));
    let mut report = Report {
        circumstances: Circumstances::now(&gpu),
        rounds: args.rounds,
        rows: Vec::new(),
        frames: Vec::new(),
        missing: Vec::new(),
    };
    output.event(
        "start",
        json!({ "scenes": files.iter().map(|file| shown(file)).collect::<Vec<_>>(), "device": gpu.name }),
    )?;
    let began = Instant::now();
    for step in steps(args, &files) {
        let name = name_of(step.file);
        let what = match (step.part, step.pool) {
            (Section::Pool, Some(pool)) => format!("{name}, {} channels, {pool} paths at a time", step.channels),
            (Section::LeftOut, _) => format!("{name}, its own kernels and all of them"),
            _ => format!("{name}, {} channels", step.channels),
        };
        interrupt.check()?;
        if began.elapsed() > args.budget {
            report.missing.push(format!("{what}: the time of --budget was over"));
        } else {
            output.say(&what);
            measure_step(args, &step, &name, &gpu, &interrupt, &mut report)?;
        }
        write(&args.output, "bench", &report.csv(), &report.json(), &report.html()?)?;
    }
    for (file, side) in files.iter().flat_map(|file| args.frames.iter().map(move |&side| (file, side))) {
        let name = name_of(file);
        let what = format!("{name}, frames of {side} x {side} pixels");
        interrupt.check()?;
        if began.elapsed() > args.budget {
            report.missing.push(format!("{what}: the time of --budget was over"));
        } else {
            output.say(&what);
            let scene = load(file, side, CHANNELS)?;
            let seconds = frames(&mut Trial::new(&scene, &gpu, None, &interrupt)?, args.rounds)?;
            report.frames.push(Frames { scene: name, channels: CHANNELS as usize, side, seconds });
        }
        write(&args.output, "bench", &report.csv(), &report.json(), &report.html()?)?;
    }
    output.event("done", json!({ "report": report.json(), "folder": shown(&args.output) }))?;
    output.text(&format!("{}{}\n", report.summary(), args.output.join("bench.html").display()))
}

fn name_of(file: &Path) -> String {
    file.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// The scene of `file` with so many pixels a side and channels.
fn load(file: &Path, side: u32, channels: u32) -> Result<Scene> {
    let of = |(key, value): (&str, u32)| (key.to_owned(), value.to_string());
    let overrides = [("film.width", side), ("film.height", side), ("channels.equal.count", channels)];
    scene::load(file, &overrides.map(of))
}

/// What is measured, in an order that has something of every scene early.
fn steps<'a>(args: &Args, files: &'a [PathBuf]) -> Vec<Step<'a>> {
    let each = |part, channels, pool| files.iter().map(move |file| Step { part, file, channels, pool });
    let by_channels = args.channels.iter().flat_map(|&channels| each(Section::Channels, channels, None));
    let by_pool = args.pools.iter().flat_map(|&pool| each(Section::Pool, CHANNELS, Some(pool)));
    let left_out = each(Section::LeftOut, CHANNELS, None).filter(|_| !args.own_kernels);
    by_channels.chain(left_out).chain(by_pool).collect()
}

fn measure_step(
    args: &Args,
    step: &Step,
    name: &str,
    gpu: &Arc<Gpu>,
    interrupt: &Arc<Interrupt>,
    report: &mut Report,
) -> Result<()> {
    let scene = load(step.file, SIDE, step.channels)?;
    let with = |evaluator: Evaluator, everything: bool| -> (Evaluator, bool, Scene) {
        let mut scene = if everything { with_everything(&scene) } else { scene.clone() };
        scene.integrator.evaluator = evaluator;
        (evaluator, everything, scene)
    };
    let ways: Vec<_> = match step.part {
        Section::LeftOut => [false, true].map(|everything| with(Evaluator::DpeptPixel, everything)).into(),
        _ => args.evaluators.iter().map(|&evaluator| with(evaluator, false)).collect(),
    };
    let (mut trials, mut measured) = (Vec::new(), Vec::new());
    for (evaluator, everything, scene) in ways {
        interrupt.check()?;
        match Trial::new(&scene, gpu, step.pool, interrupt) {
            Ok(trial) => {
                trials.push(trial);
                measured.push((evaluator, everything));
            }
            // What does not fit is a result too.
            Err(error @ (Error::Usage(_) | Error::DeviceMemory(_))) => {
                report.missing.push(format!("{name}, {}, {} channels: {error}", evaluator.name(), step.channels));
            }
            Err(error) => return Err(error),
        }
    }
    let rates = measure(&mut trials, args.rounds)?;
    for ((trial, (evaluator, everything)), rates) in trials.iter().zip(measured).zip(rates) {
        let plan = trial.plan();
        report.rows.push(Row {
            part: step.part,
            scene: name.to_owned(),
            evaluator,
            everything,
            channels: step.channels as usize,
            pool: plan.paths,
            rates,
            path_bytes: plan.path_bytes(),
            channel_bytes: u64::from(plan.spectral_state_size) / u64::from(step.channels.next_multiple_of(4)),
            planned_bytes: trial.planned_bytes(),
            allocated_bytes: trial.allocated_bytes,
        });
    }
    Ok(())
}

fn parse_evaluator(text: &str) -> std::result::Result<Evaluator, String> {
    let all = || Evaluator::ALL[1..].iter().map(|evaluator| evaluator.name()).collect::<Vec<_>>().join(", ");
    Evaluator::named(text.trim()).ok_or_else(|| format!("an evaluator is one of {}", all()))
}
