//! What runs on the nodes of a cluster: the tasks of an array job, its finaliser, and the probe before both. `submit` writes
//! these commands; nobody needs to type them.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::Output;
use super::interrupt;
use super::output::say;
use super::progress::{Reporter, short};
use super::scene::SceneArgs;
use super::submit::submit_array;
use crate::cube::{Cube, Existing, Run, RunFile, RunState, SlurmTask, Stand, Verification, Work, node_name, now_s};
use crate::gpu::adapter::of_task;
use crate::render::interrupt::Interrupt;
use crate::render::job::{self, StopRule};
use crate::render::schedule;
use crate::scene::Scene;
use crate::slurm::{self, Job, client};
use crate::{Error, Result};

/// What the probe prints where it feels the lock that `submit` holds, and where it does not.
pub const FELT: &str = "spectile: locked";
const NOT_FELT: &str = "spectile: not locked";

/// A task whose tiles somebody else works on waits so long: a node that is lost to Slurm may still be at work, and the lock of
/// one that died may outlive it on a network file system.
const LOCK_PATIENCE: Duration = Duration::from_secs(180);
/// Runs of a task that may end one after the other without having merged anything, before it is given up.
const RUNS_WITHOUT_UNIT: usize = 3;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The cube that was submitted
    pub cube: PathBuf,
}

/// Whether this node sees what the one that submitted sees.
pub fn probe(args: &Args) -> Result<()> {
    let job = Job::read(&args.cube)?;
    scene_of(&job)?;
    let felt = Cube::open(&args.cube)?.probe_from_here().map_err(on_node)?;
    of_task(job.allow_software).map_err(on_node)?;
    println!("{}", if felt { FELT } else { NOT_FELT });
    Ok(())
}

/// The scene that was submitted, as this node sees it.
fn scene_of(job: &Job) -> Result<Scene> {
    let args = SceneArgs {
        scene: job.scene.clone(),
        overrides: job.overrides.clone(),
        size: job.size,
        tile: job.tile,
        given: None,
    };
    let scene = args.load().map_err(on_node)?;
    if scene.digest != job.scene_digest {
        return Err(Error::Usage(format!(
            "{}: on {} this is not the scene that was submitted; it has changed since, or the nodes see other files under the \
             same paths (`spectile submit --resume` begins from what it is now, if only what does not matter has changed)",
            job.scene.display(),
            node_name()
        )));
    }
    let scene = if job.factored { scene.factored() } else { scene };
    Ok(if job.layers.is_empty() { scene } else { scene.with_first_hits() })
}

/// An error that names the node where it came up.
fn on_node(error: Error) -> Error {
    let node = node_name();
    match error {
        Error::Storage { path, what } => Error::Storage { path, what: format!("{what} (on {node})") },
        Error::Input(problems) => {
            let each = problems.into_iter().map(|mut problem| {
                problem.message +=
                    &format!(" (on {node}; scene and all it reads must be seen there under the same paths)");
                problem
            });
            Error::Input(each.collect())
        }
        Error::NoDevice(what) => Error::NoDevice(format!("{node}: {what}")),
        error => error,
    }
}

/// One task of an array job.
pub fn task(args: &Args, output: &Output) -> Result<()> {
    let interrupt = interrupt::watch()?;
    let began = now_s();
    let job = Job::read(&args.cube)?;
    let slurm = SlurmTask::of_this_process();
    let number = slurm.as_ref().and_then(|slurm| slurm.task).filter(|&task| task < job.tasks);
    let (Some(slurm), Some(number)) = (slurm, number) else {
        let what =
            format!("this is for the tasks 0 to {} of an array job, which `spectile submit` submits", job.tasks - 1);
        return Err(Error::Usage(what));
    };
    let tiles = job.range(number);
    say(&format!("{}, job {}: tiles {}..{}", node_name(), slurm.name(), tiles.start, tiles.end));
    let result = render(&args.cube, &job, number, &interrupt, output);
    let error = match result {
        Ok(()) => return Ok(()),
        Err(error) => error,
    };
    let runs = Cube::open(&args.cube).and_then(|cube| cube.runs()).unwrap_or_default();
    let here =
        |run: &Run| run.process == std::process::id() && run.slurm.as_ref() == Some(&slurm) && run.started_s >= began;
    let recorded = runs.iter().any(here);
    let error = match error {
        Error::Interrupted { signal: signal_hook::consts::SIGTERM } => {
            match requeue(&job, &slurm, runs.iter(), recorded) {
                Ok(()) => return Err(error),
                Err(why) => why,
            }
        }
        error if recorded => return Err(error),
        error => error,
    };
    // So that whoever looks at the cube sees why nothing comes of these tiles.
    let mut run = Run { started_s: began, ..Run::begin(&tiles, Some(job.samples), job.tile_error) };
    run.end(Err(&error));
    if let Err(unwritten) = RunFile::create(&args.cube, run) {
        say(&format!("warning: {unwritten}"));
    }
    Err(error)
}

/// Puts the task back into the queue after SIGTERM, unless it was cancelled or nothing ever comes of it.
fn requeue<'r>(
    job: &Job,
    slurm: &SlurmTask,
    runs: impl DoubleEndedIterator<Item = &'r Run>,
    recorded: bool,
) -> Result<()> {
    let own =
        |run: &&Run| run.slurm.as_ref().is_some_and(|other| (other.array, other.task) == (slurm.array, slurm.task));
    let fruitless = runs.rev().filter(own).take_while(|run| run.units == 0).count() + usize::from(!recorded);
    if fruitless >= RUNS_WITHOUT_UNIT {
        return Err(Error::Usage(format!(
            "this task was ended {fruitless} times before a tile had its first {} samples; give it more --time-limit, or a smaller \
             --tile",
            job.samples.min(64)
        )));
    }
    if client::requeue(&slurm.name())? {
        say("requeued: what is merged stays, and the next run goes on from there");
    }
    Ok(())
}

fn render(cube: &Path, job: &Job, number: u32, interrupt: &std::sync::Arc<Interrupt>, output: &Output) -> Result<()> {
    let tiles = job.range(number);
    let scene = scene_of(job)?;
    let devices = of_task(job.allow_software).map_err(on_node)?;
    let mut reporter = Reporter::new(false, output);
    wait_until_free(&Cube::open(cube)?, &tiles, interrupt)?;
    let job = job::Job {
        scene,
        output: cube.to_owned(),
        existing: Existing::Resume,
        tiles: Some(tiles),
        seed: job.seed,
        tile: job.tile,
        uncertainty: job.uncertainty,
        layers: job.layers.clone(),
        stop: StopRule {
            samples: Some(job.samples),
            time: None,
            error: job.tile_error,
            per_tile: job.tile_error.is_some(),
        },
        preview: None,
        profile: false,
        devices,
        memory: job.memory,
        feed: None,
    };
    reporter.start(&job)?;
    let summary = schedule::run(&job, interrupt, &mut |event| reporter.event(event));
    reporter.finish(&job, summary)
}

/// Waits while another worker holds any of the tiles.
fn wait_until_free(cube: &Cube, tiles: &std::ops::Range<u32>, interrupt: &Interrupt) -> Result<()> {
    let began = Instant::now();
    let mut said = false;
    loop {
        let held = cube.all_in_use().into_iter().find(|held| held.start < tiles.end && tiles.start < held.end);
        let Some(held) = held.filter(|_| began.elapsed() < LOCK_PATIENCE) else { return Ok(()) };
        if !said {
            say(&format!("another worker is at the tiles {}..{}; waiting for it", held.start, held.end));
            said = true;
        }
        interrupt.sleep(Duration::from_secs(1))?;
    }
}

/// After an array: whether every tile is there, and what is submitted again.
pub fn end(args: &Args) -> Result<()> {
    let mut job = Job::read(&args.cube)?;
    // This one's own number may not stand there yet.
    let arrays: Vec<u64> = job.submitted.iter().map(|s| s.array).collect();
    if client::states(&arrays).is_some_and(|states| !states.is_empty()) {
        say("an array job is still in the queue; its own finaliser comes after it");
        return Ok(());
    }
    let cube = Cube::open(&args.cube)?;
    let samples = cube.all_samples()?;
    let work = Work::of(&cube, &samples, Some(job.samples))?;
    let verified = cube.verify()?;
    let mut wanted: BTreeSet<u32> = verified.tiles.iter().copied().collect();
    wanted.extend(cube.unfinished(&samples, job.samples, job.tile_error)?);
    let last = arrays.last().copied();
    let tasks = slurm::array_spec(&job.tasks_of(wanted.iter().copied()));
    let verdict = if wanted.is_empty() && verified.damage.is_empty() {
        Verdict::Complete
    } else if wanted.is_empty() {
        Verdict::GiveUp("files that are written once are damaged, and no render makes them anew".into())
    } else if arrays.len() > slurm::RESUBMISSIONS {
        Verdict::GiveUp(format!("{} arrays were submitted again, which is enough", slurm::RESUBMISSIONS))
    } else {
        judge(&work.runs, last)
    };
    if let Verdict::Again { except } = &verdict {
        submit_array(&mut job, &args.cube, &tasks, except)?;
    }
    let summary = summarise(&args.cube, &job, &work, &verified, wanted.len(), &verdict);
    say(summary.trim_end());
    slurm::SUMMARY.write(&slurm::summary_path(&args.cube), summary.as_bytes())?;
    match verdict {
        Verdict::GiveUp(why) => Err(Error::Check(format!("{}: not finished: {why}", args.cube.display()))),
        _ => Ok(()),
    }
}

enum Verdict {
    Complete,
    /// What is missing is submitted again, but not to these nodes.
    Again {
        except: Vec<String>,
    },
    GiveUp(String),
}

/// Whether another array would do better than the last one.
fn judge(runs: &[Run], last: Option<u64>) -> Verdict {
    let of_last = || runs.iter().filter(|run| run.slurm.as_ref().is_some_and(|slurm| slurm.array == last));
    let works: BTreeSet<&str> = of_last().filter(|run| run.units > 0).map(|run| run.node.as_str()).collect();
    let hopeless = |run: &&Run| run.state == RunState::Failed && run.units == 0;
    if works.is_empty()
        && let Some(run) = of_last().rev().find(hopeless)
    {
        // Nothing was rendered anywhere, for a reason that will be the same next time.
        let why = run.message.as_deref().unwrap_or("it failed");
        return Verdict::GiveUp(format!("no task could begin; {}: {why}", run.who()));
    }
    let failed: BTreeSet<&str> = of_last().filter(hopeless).map(|run| run.node.as_str()).collect();
    Verdict::Again { except: failed.difference(&works).map(|node| (*node).to_owned()).collect() }
}

fn summarise(cube: &Path, job: &Job, work: &Work, verified: &Verification, wanted: usize, verdict: &Verdict) -> String {
    let mut text = String::new();
    let mut row = |name: &str, value: String| {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{name:<12} {value}");
    };
    row("cube", cube.display().to_string());
    let all = job.tiles;
    row(
        "result",
        match verdict {
            Verdict::Complete => {
                let until = job.tile_error.map_or_else(String::new, |error| format!(", or errors of {error}"));
                format!("complete: {all} tiles of {} samples per pixel{until}, every checksum is right", job.samples)
            }
            Verdict::Again { .. } => {
                format!("{wanted} of {all} tiles are missing or damaged; they are submitted again")
            }
            Verdict::GiveUp(why) => format!("NOT COMPLETE: {wanted} of {all} tiles are missing or damaged; {why}"),
        },
    );
    row("verified", format!("{} files, {} damaged", verified.files, verified.damage.len()));
    verified.damage.iter().take(20).for_each(|what| row("damage", what.clone()));
    for submitted in &job.submitted {
        let finaliser = submitted.finaliser.map_or_else(|| "none".to_owned(), |id| id.to_string());
        row("array job", format!("{} (tasks {}), finaliser {finaliser}", submitted.array, submitted.tasks));
    }
    if let Verdict::Again { except } = verdict
        && !except.is_empty()
    {
        row("left out", format!("nodes where nothing worked: {}", except.join(", ")));
    }
    let of_state = |state| work.runs.iter().filter(|run| run.state == state).count();
    row(
        "runs",
        format!(
            "{}: {} done, {} interrupted and gone on with, {} failed, {} lost",
            work.runs.len(),
            of_state(RunState::Done),
            of_state(RunState::Interrupted),
            of_state(RunState::Failed),
            of_state(RunState::Running)
        ),
    );
    for (node, runs, units, seconds) in by_node(&work.runs) {
        row("node", format!("{node}: {units} units in {runs} runs, {}", short(Duration::from_secs_f64(seconds))));
    }
    if let (Some(first), Some(last)) =
        (job.submitted.first(), work.runs.iter().filter_map(|run| run.ended_s).reduce(f64::max))
        && last > first.at_s
    {
        row("time", format!("{} from submission to the last tile", short(Duration::from_secs_f64(last - first.at_s))));
    }
    for (tiles, stand) in work.ranges(|stand| matches!(stand, Stand::Failed(_))).into_iter().take(20) {
        if let Stand::Failed(run) = stand {
            let run = &work.runs[run];
            row("failed", format!("tiles {}..{}: {}: {}", tiles.start, tiles.end, run.who(), why(run)));
        }
    }
    text
}

/// Why a run failed, for people.
pub fn why(run: &Run) -> &str {
    run.message.as_deref().unwrap_or("it was killed, or its node was lost")
}

/// Runs, units and seconds by node, in the order of names.
fn by_node(runs: &[Run]) -> Vec<(String, usize, u64, f64)> {
    let mut found: std::collections::BTreeMap<&str, (usize, u64, f64)> = Default::default();
    for run in runs {
        let (count, units, seconds) = found.entry(&run.node).or_default();
        *count += 1;
        *units += run.units;
        *seconds += run.ended_s.map_or(0.0, |end| (end - run.started_s).max(0.0));
    }
    found.into_iter().map(|(node, (count, units, seconds))| (node.to_owned(), count, units, seconds)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(node: &str, state: RunState, units: u64) -> Run {
        let slurm = SlurmTask { array: Some(12), task: Some(0), job: 13, restarts: 0 };
        Run { node: node.into(), state, units, slurm: Some(slurm), ..Run::begin(&(0..4), Some(64), None) }
    }

    /// Black holes, nodes where every task fails at once, are left out; a mistake that every node shares ends it.
    #[test]
    fn what_failed_is_submitted_again_where_it_can_work() {
        let except = |runs: &[Run]| match judge(runs, Some(12)) {
            Verdict::Again { except } => Some(except),
            _ => None,
        };
        let (good, hole) = (run("a", RunState::Done, 5), run("b", RunState::Failed, 0));
        assert_eq!(except(&[good.clone(), hole.clone(), hole.clone()]), Some(vec!["b".into()]));
        assert_eq!(except(&[good.clone(), run("b", RunState::Failed, 3)]), Some(vec![]));
        assert_eq!(except(&[run("a", RunState::Running, 0)]), Some(vec![]), "killed");
        assert_eq!(except(std::slice::from_ref(&hole)), None);
        let before = Run { slurm: None, ..good };
        assert_eq!(except(&[before, hole]), None, "what another array did says nothing of this one");
    }
}
