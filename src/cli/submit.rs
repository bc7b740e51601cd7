//! `spectile submit`: a render as an array job on a Slurm cluster.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde_json::json;

use super::Output;
use super::output::say;
use super::render::ErrorOf;
use super::scene::SceneArgs;
use crate::cube::{Cube, Existing, Header, Layer, check_target, make, now_s};
use crate::device::prepared::Prepared;
use crate::files::{self, format_bytes};
use crate::render::job::StopRule;
use crate::render::plan;
use crate::slurm::client::{self, Tried};
use crate::slurm::{self, Job, Request, Submitted, script};
use crate::{Error, Result};

/// Seconds that the probe waits for a free node.
const PROBE_S: u32 = 10;

/// Render a scene on a Slurm cluster, as an array job
///
/// Checks SCENE and the space for the cube, makes the cube, writes a batch script OUT.zarr.sbatch beside it and submits it: an
/// array job whose tasks each render a range of tiles, and a finaliser that comes when no task is left. That one verifies every
/// tile, submits again what is missing (3 times at most, not on nodes where nothing worked) and leaves OUT.zarr.summary.txt.
///
/// The cube must lie on a file system that all nodes share, and the scene with what it reads under the same paths; one node is
/// asked at once, if any is free, whether that is so. Tasks may be killed, preempted, requeued or run twice, and time limits may
/// be too short for them: what is merged stays, and the cube ends with the bytes of `spectile render` on one machine.
#[derive(Debug, clap::Args)]
#[command(after_long_help = "\
Examples:
  spectile submit scene.toml -o cube.zarr --spp 1024
  spectile submit scene.toml -o cube.zarr --spp 1024 --partition gpu --time-limit 2h --sbatch '--account=optics --mem=16G'
  spectile submit scene.toml -o cube.zarr --spp 1024 --gpus-per-task 0 --sbatch '--cpus-per-task=16'    on CPUs
  spectile submit scene.toml -o cube.zarr --spp 1024 --dry-run            the script and the commands, nothing else
  spectile submit scene.toml -o cube.zarr --spp 4096 --resume             go on: what is missing, or more samples
  spectile info cube.zarr --watch                                         how far it is, and who does what")]
pub struct Args {
    /// The cube to make, a folder on a file system that all nodes share
    #[arg(short, long, value_name = "OUT.zarr")]
    pub output: PathBuf,

    /// Samples per pixel, rounded up as by `render`
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub spp: u32,

    /// End each tile where its own error is at most E in every channel, at --spp at the latest; with --error-per tile, as for `render`
    #[arg(long, value_name = "E", value_parser = super::render::parse_error, requires = "error_per")]
    pub error: Option<f64>,

    /// What --error is the error of: a task sees its own tiles only
    #[arg(long, value_name = "tile", value_enum, requires = "error")]
    pub error_per: Option<ErrorOf>,

    /// Seed of all random numbers, as for `render`
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,

    /// Store the standard error of every pixel and channel too, as `render` does
    #[arg(long)]
    pub uncertainty: bool,

    /// Keep weights of products of spectra instead of radiance, as `spectile render --factored` does
    #[arg(long)]
    pub factored: bool,

    /// Store what the first surface behind each pixel is, as `spectile render --layers` does
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = super::render::parse_layer)]
    pub layers: Vec<Layer>,

    #[command(flatten)]
    pub scene: SceneArgs,

    /// Tasks that share the tiles
    ///
    /// By default as many as the work is worth: tasks of minutes on a GPU, at most 1000, at most one a tile. What is merged
    /// is never lost with a task, so few tasks are as safe as many; many balance better over fast and slow nodes. To limit
    /// how many run at the same time, tell Slurm afterwards: scontrol update JobId=ARRAY ArrayTaskThrottle=20.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub tasks: Option<u32>,

    /// GPUs of every task; 0: none, software devices render on the CPUs of the task (as if with --allow-software)
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(..=64))]
    pub gpus_per_task: u32,

    /// Use software devices on nodes where no GPU is found
    ///
    /// By default such a node is refused, since it renders at a hundredth of a GPU's speed, if that: the one that is asked at
    /// once, if any is free, and each that gets a task. Those are not used again.
    #[arg(long)]
    pub allow_software: bool,

    /// The cluster's partition, if not its default one
    #[arg(long, value_name = "NAME")]
    pub partition: Option<String>,

    /// Time limit of a task, such as 2h; else the partition's
    ///
    /// A number without a unit is seconds, as everywhere here; Slurm's own are minutes. In whole minutes, rounded up. A task that needs longer commits what it has, requeues itself and goes on.
    #[arg(long, value_name = "TIME", value_parser = super::render::parse_time)]
    pub time_limit: Option<Duration>,

    /// Indices that an array may have; else the cluster is asked (MaxArraySize)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub array_limit: Option<u32>,

    /// Further options of sbatch, for array and finaliser, quoted as one word (repeatable)
    #[arg(long, value_name = "OPTIONS", allow_hyphen_values = true, value_parser = parse_options)]
    pub sbatch: Vec<Options>,

    /// Memory to use on each device, as for `render`
    #[arg(long, value_name = "SIZE", value_parser = files::parse_bytes)]
    pub memory: Option<u64>,

    /// Go on with OUT.zarr, which an earlier `submit` or `render` of the same scene and settings has begun; begin it where
    /// there is none
    ///
    /// Only tasks with tiles that lack samples are submitted.
    #[arg(long)]
    pub resume: bool,

    /// Replace OUT.zarr if it exists
    ///
    /// As `render --overwrite`: only a Spectile cube that nobody works on, of which no task waits or runs. It is gone when the new one is
    /// made, also where submitting fails after that.
    #[arg(long, conflicts_with = "resume")]
    pub overwrite: bool,

    /// Print the script and the commands, and change nothing
    #[arg(long)]
    pub dry_run: bool,

    /// One JSON object a line on stdout, instead of text
    #[arg(long)]
    pub json: bool,
}

/// Options of sbatch, word by word.
#[derive(Debug, Clone, PartialEq)]
pub struct Options(Vec<String>);

/// Options that decide how tasks and tiles go together, or how a task ends.
const OURS: [(&str, &str); 8] = [
    ("--array", "--tasks"),
    ("-a", "--tasks"),
    ("--partition", "--partition"),
    ("-p", "--partition"),
    ("--time", "--time-limit"),
    ("-t", "--time-limit"),
    ("--gpus-per-task", "--gpus-per-task"),
    ("--wrap", "nothing: the program is always the same"),
];

fn parse_options(text: &str) -> std::result::Result<Options, String> {
    let words = shlex::split(text).ok_or("a quotation mark is not closed")?;
    for word in &words {
        let name = word.split('=').next().unwrap_or(word);
        if word.contains('\n') || word.contains('"') {
            return Err(format!("`{word}`: line breaks and quotation marks cannot stand in a batch script's options"));
        }
        if ["--no-requeue", "--signal", "--output", "-o", "--dependency", "-d"].contains(&name) {
            return Err(format!("`{name}` is decided by `submit`: tasks must end in order, requeue and be heard of"));
        }
        if let Some((_, instead)) = OURS.iter().find(|(option, _)| *option == name) {
            return Err(format!("`{name}` is what `submit` itself says; use {instead}"));
        }
    }
    Ok(Options(words))
}

pub fn run(args: &Args, output: &Output) -> Result<()> {
    let cube = std::path::absolute(&args.output).map_err(|error| Error::storage(&args.output, error))?;
    let program = super::program::path().map_err(|error| Error::storage(Path::new("spectile"), error))?;
    for path in [&cube, &args.scene.scene, &program] {
        if path.to_str().is_none() {
            let what = "is not UTF-8, which neither batch scripts nor Slurm's options take; give it another name";
            return Err(Error::Usage(format!("{} {what}", path.display())));
        }
    }
    let scene = args.scene.load()?;
    let scene = if args.factored { scene.factored() } else { scene };
    let scene = if args.layers.is_empty() { scene } else { scene.with_first_hits() };
    for warning in &scene.warnings {
        say(&format!("warning: {warning}"));
        output.event("warning", json!({ "message": warning }))?;
    }
    plan::check(&scene)?;
    // What no device renders yet is refused here, not by a thousand tasks.
    Prepared::new(&scene, args.seed)?;
    let stop = StopRule { samples: Some(args.spp), ..StopRule::default() };
    let samples = stop.samples_limit(scene.integrator.epoch, args.uncertainty)?.unwrap_or(args.spp);
    let tile = plan::tile_size(&scene, args.scene.tile);
    let mut header = plan::header(&scene, tile, args.seed, args.uncertainty, &args.layers)?;
    plan::record_evaluator(&mut header, plan::evaluator(&scene, None, args.gpus_per_task == 0)?);
    header.validate().map_err(Error::Usage)?;
    if args.error_per == Some(ErrorOf::Image) {
        let what = "--error-per image: a task sees its own tiles only; take --error-per tile";
        return Err(Error::Usage(what.into()));
    }
    let existing = match args.overwrite {
        true => Existing::Replace,
        false if args.resume => Existing::Resume,
        false => Existing::Refuse,
    };
    let tiles = header.grid().count();
    check_target(&cube, &header, existing, &(0..tiles))?;
    slurm::SCRIPT.check_target(&slurm::script_path(&cube))?;
    slurm::SUMMARY.check_target(&slurm::summary_path(&cube))?;
    if (args.resume || args.overwrite) && cube.exists() {
        refuse_while_at_work(&cube)?;
    }

    let job = Job {
        version: env!("CARGO_PKG_VERSION").into(),
        program,
        scene: scene.file.clone(),
        scene_digest: scene.digest.clone(),
        overrides: args.scene.overrides.clone(),
        size: args.scene.size,
        tile: args.scene.tile,
        seed: args.seed,
        uncertainty: args.uncertainty,
        factored: args.factored,
        layers: args.layers.clone(),
        memory: args.memory,
        allow_software: args.allow_software || args.gpus_per_task == 0,
        samples,
        tile_error: args.error,
        tiles,
        tasks: tasks(args, &header, samples)?,
        request: Request {
            name: cube.file_stem().map_or_else(|| "spectile".into(), |name| name.to_string_lossy().into_owned()),
            gpus_per_task: args.gpus_per_task,
            partition: args.partition.clone(),
            time_limit: args.time_limit.map(|time| (time.as_secs_f64() / 60.0).ceil() as u64),
            more: args.sbatch.iter().flat_map(|Options(words)| words.clone()).collect(),
        },
        submitted: Vec::new(),
    };
    let wanted = if args.resume && cube.exists() { lacking(&job, &cube)? } else { (0..job.tasks).collect() };
    if wanted.is_empty() {
        output.event("done", facts(&job, &cube, "", None, args.dry_run))?;
        let or = args.error.map_or_else(String::new, |error| format!(", or errors of at most {error}"));
        let all = format!("all {tiles} tiles have {samples} samples per pixel{or}");
        return output.text(&format!("{}: {all}; there is nothing to submit\n", cube.display()));
    }
    let tasks = slurm::array_spec(&wanted);
    let text = script::text(&job, &cube, &tasks)?;
    if args.dry_run {
        output.event("done", facts(&job, &cube, &tasks, None, true))?;
        return output.text(&dry_run(&job, &cube, &tasks, &text, &header));
    }
    let submitted = Submission { job, cube, tasks, text, header, existing }.submit(output)?;
    let Submission { job, cube, tasks, .. } = &submitted;
    output.event("done", facts(job, cube, tasks, job.submitted.last(), false))?;
    output.text(&next_steps(job, cube, wanted.len()))
}

/// How many tasks there are, which the cluster must allow.
fn tasks(args: &Args, header: &Header, samples: u32) -> Result<u32> {
    let limit = match args.array_limit {
        Some(limit) => limit,
        // Without a cluster, what most clusters say.
        None if args.dry_run => client::array_limit().unwrap_or(slurm::DEFAULT_ARRAY_LIMIT),
        None => client::array_limit()?,
    };
    let tiles = header.grid().count();
    let pixels: f64 = header.size.iter().map(|&side| f64::from(side)).product();
    let values = pixels * f64::from(samples) * header.channels.len() as f64;
    match args.tasks {
        Some(tasks) if tasks > limit => Err(Error::Usage(format!(
            "--tasks {tasks}: arrays of this cluster have at most {limit} tasks (--array-limit, or MaxArraySize as Slurm says)"
        ))),
        Some(tasks) if tasks > tiles => Err(Error::Usage(format!(
            "--tasks {tasks}: this picture has {tiles} tiles, and a task needs one; choose fewer tasks or a smaller --tile"
        ))),
        Some(tasks) => Ok(tasks),
        None => Ok(slurm::default_tasks(tiles, values, args.gpus_per_task, limit)),
    }
}

/// Refuses while an array is still at work on the cube: its finaliser goes on by itself.
fn refuse_while_at_work(cube: &Path) -> Result<()> {
    let jobs: Vec<u64> = Job::find(cube)?
        .map(|job| job.submitted.iter().flat_map(|s| [Some(s.array), s.finaliser]).flatten().collect())
        .unwrap_or_default();
    match client::states(&jobs) {
        Some(states) if !jobs.is_empty() && !states.is_empty() => {
            let list = jobs.iter().map(u64::to_string).collect::<Vec<_>>().join(" ");
            Err(Error::Usage(format!(
                "{}: its jobs are still in the queue and go on by themselves; to begin anew: scancel {list}",
                cube.display()
            )))
        }
        _ => Ok(()),
    }
}

/// Tasks with tiles that lack samples.
fn lacking(job: &Job, cube: &Path) -> Result<Vec<u32>> {
    let cube = Cube::open(cube)?;
    Ok(job.tasks_of(cube.unfinished(&cube.all_samples()?, job.samples, job.tile_error)?))
}

struct Submission {
    job: Job,
    cube: PathBuf,
    tasks: String,
    text: String,
    header: Header,
    existing: Existing,
}

impl Submission {
    /// Makes cube and script, tries a node, and submits. Whatever fails leaves no new cube behind.
    fn submit(mut self, output: &Output) -> Result<Submission> {
        let script = slurm::script_path(&self.cube);
        let aside = files::sibling(&script, "part");
        let written = fs::write(&aside, &self.text).map_err(|error| Error::storage(&script, error));
        let tested = written.and_then(|()| client::test(&aside));
        // Only sbatch needed it.
        let _ = fs::remove_file(&aside);
        tested?;
        let (cube, is_new) = make(&self.cube, &self.header, self.existing)?;
        let done = self.submit_to(&cube, &script, output);
        if done.is_err() && is_new {
            // The error is what matters; what cannot be removed is an empty cube.
            let _ = fs::remove_dir_all(&self.cube);
            let _ = fs::remove_file(&script);
        }
        done.map(|()| self)
    }

    fn submit_to(&mut self, cube: &Cube, script: &Path, output: &Output) -> Result<()> {
        let job = &mut self.job;
        job.write(&self.cube)?;
        slurm::SCRIPT.write(script, self.text.as_bytes())?;
        let probe = cube.hold_probe()?;
        let tried =
            client::try_on_a_node(&script::probe_options(job), PROBE_S, &job.program, &["array-probe"], &self.cube)?;
        drop(probe);
        let at = self.cube.display();
        match tried {
            Tried::Fine(said) if said.trim() == super::array::FELT => {}
            Tried::Fine(_) => {
                let what = "locks on this file system do not reach from machine to machine, so nothing would keep two tasks on \
                            one tile apart; put the cube on another file system, or have it mounted with locks";
                return Err(Error::storage(&self.cube, what));
            }
            Tried::Wrong(code, what) => return Err(as_on_node(code, &self.cube, what)),
            Tried::NotRun(why) => {
                let what = format!(
                    "no node was free to try whether it sees {at} and the scene ({why}); every task tries for itself"
                );
                say(&format!("warning: {what}"));
                output.event("warning", json!({ "message": what }))?;
            }
        }
        submit_array(job, &self.cube, &self.tasks, &[])
    }
}

/// Submits an array and its finaliser, and notes both in the job's file.
pub fn submit_array(job: &mut Job, cube: &Path, tasks: &str, except: &[String]) -> Result<()> {
    let array = client::submit(&script::array_arguments(cube, tasks, except))?;
    job.submitted.push(Submitted { array, finaliser: None, tasks: tasks.to_owned(), at_s: now_s() });
    let finaliser = job.write(cube).and_then(|()| {
        let finaliser = client::submit(&script::finaliser_arguments(job, cube, &array.to_string()))?;
        if let Some(last) = job.submitted.last_mut() {
            last.finaliser = Some(finaliser);
        }
        job.write(cube).map(|()| finaliser)
    });
    finaliser.map(|_| ()).inspect_err(|_| client::cancel(&[array]))
}

/// What a node said, as an error of its own kind here.
fn as_on_node(code: i32, cube: &Path, what: String) -> Error {
    match code {
        5 => {
            // The cube's path stands before it anyway.
            let what = what.strip_prefix(&format!("{}: ", cube.display())).unwrap_or(&what);
            Error::storage(cube, format!("a node of the cluster says: {what}"))
        }
        3 => Error::NoDevice(format!("a node of the cluster says: {what}")),
        _ => Error::Usage(format!("a node of the cluster says: {what}")),
    }
}

fn facts(job: &Job, cube: &Path, tasks: &str, submitted: Option<&Submitted>, dry_run: bool) -> serde_json::Value {
    json!({
        "output": files::shown(cube),
        "script": files::shown(&slurm::script_path(cube)),
        "samples": job.samples,
        "tiles": job.tiles,
        "tasks": job.tasks,
        "tasks_submitted": tasks,
        "array_job": submitted.map(|s| s.array),
        "finaliser_job": submitted.and_then(|s| s.finaliser),
        "dry_run": dry_run,
    })
}

fn dry_run(job: &Job, cube: &Path, tasks: &str, text: &str, header: &Header) -> String {
    let array = script::command("sbatch", &script::array_arguments(cube, tasks, &[]));
    let finaliser = script::command("sbatch", &script::finaliser_arguments(job, cube, "ARRAY"));
    format!(
        "would make {}, {} when finished, and write {}:\n\n{text}\nwould submit, ARRAY being the first one's number:\n\n  {array}\n  \
         {finaliser}\n",
        cube.display(),
        format_bytes(header.store_bytes()),
        slurm::script_path(cube).display(),
    )
}

fn next_steps(job: &Job, cube: &Path, tasks: usize) -> String {
    let Some(Submitted { array, finaliser: Some(finaliser), .. }) = job.submitted.last() else { return String::new() };
    let of = if tasks == job.tasks as usize { String::new() } else { format!(" of {}", job.tasks) };
    let quoted = slurm::quote(&cube.display().to_string());
    format!(
        "submitted array job {array} ({tasks}{of} tasks for {} tiles) and its finaliser {finaliser}\n\
         \u{20} spectile info {quoted} --watch    how far it is, and who does what\n\
         \u{20} squeue --jobs {array},{finaliser}    what waits and runs\n\
         \u{20} scancel {array} {finaliser}    stop; the same command with --resume goes on\n\
         scripts and logs: {} and {}\n\
         in the end {} says how it went\n",
        job.tiles,
        slurm::script_path(cube).display(),
        slurm::folder(cube).display(),
        slurm::summary_path(cube).display(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_of_sbatch_are_words() {
        assert_eq!(
            parse_options("--account=optics --comment='two words'"),
            Ok(Options(vec!["--account=optics".into(), "--comment=two words".into()]))
        );
        for (bad, words) in [
            ("--array=0-3", "use --tasks"),
            ("-p gpu", "use --partition"),
            ("--time=5", "use --time-limit"),
            ("--signal=KILL", "decided by `submit`"),
            ("--comment='a", "not closed"),
            ("--comment='a\"b'", "quotation marks"),
        ] {
            assert!(parse_options(bad).unwrap_err().contains(words), "{bad}");
        }
    }
}
