//! Who works, or worked, on a cube: a file per process under `.spectile/`, which the arrays do not depend on.

use std::fs;
use std::io::ErrorKind;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::estimate::is_within;
use super::store::{Cube, PRIVATE};
use crate::{Error, Result, files};

/// How a run stands, by its own account: one that was killed still says `Running`, but holds no lock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RunState {
    Running,
    Done,
    Interrupted,
    Failed,
}

/// What Slurm calls the task that a run belongs to.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SlurmTask {
    /// Of the whole array, if the job is part of one, and the task in it.
    pub array: Option<u64>,
    pub task: Option<u32>,
    pub job: u64,
    /// How often Slurm had requeued it.
    pub restarts: u32,
}

/// One process's work on some tiles of a cube.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Run {
    pub state: RunState,
    /// Why it failed.
    pub message: Option<String>,
    pub exit_code: Option<i32>,
    pub node: String,
    pub process: u32,
    pub slurm: Option<SlurmTask>,
    /// From A up to B, without B.
    pub tiles: [u32; 2],
    /// Samples per pixel that it works towards.
    pub samples_limit: Option<u32>,
    /// The error to which it works in each tile, where tiles have ends of their own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tile_error: Option<f64>,
    /// Units merged.
    pub units: u64,
    /// Unix times in seconds.
    pub started_s: f64,
    pub ended_s: Option<f64>,
    /// Devices, times, counters.
    #[serde(flatten)]
    pub facts: Map<String, Value>,
}

impl Run {
    /// A run of this process that begins now.
    pub fn begin(tiles: &Range<u32>, samples_limit: Option<u32>, tile_error: Option<f64>) -> Run {
        Run {
            state: RunState::Running,
            message: None,
            exit_code: None,
            node: node_name(),
            process: std::process::id(),
            slurm: SlurmTask::of_this_process(),
            tiles: [tiles.start, tiles.end],
            samples_limit,
            tile_error,
            units: 0,
            started_s: now_s(),
            ended_s: None,
            facts: Map::new(),
        }
    }

    /// Notes how it ended.
    pub fn end(&mut self, result: std::result::Result<(), &Error>) {
        self.ended_s = Some(now_s());
        self.state = match result {
            Ok(()) => RunState::Done,
            Err(Error::Interrupted { .. }) => RunState::Interrupted,
            Err(_) => RunState::Failed,
        };
        self.exit_code = Some(result.map_or_else(Error::exit_code, |()| 0));
        self.message = result.err().filter(|_| self.state == RunState::Failed).map(Error::to_string);
    }

    /// Who, for people: the node, and its job or process.
    pub fn who(&self) -> String {
        match &self.slurm {
            Some(slurm) => format!("{} (job {})", self.node, slurm.name()),
            None => format!("{} (process {})", self.node, self.process),
        }
    }

    fn has(&self, tile: u32) -> bool {
        (self.tiles[0]..self.tiles[1]).contains(&tile)
    }
}

impl SlurmTask {
    /// As Slurm's tools take it: `12_4`, or `12`.
    pub fn name(&self) -> String {
        match (self.array, self.task) {
            (Some(array), Some(task)) => format!("{array}_{task}"),
            _ => self.job.to_string(),
        }
    }

    /// What Slurm says in the environment of its jobs.
    pub fn of_this_process() -> Option<SlurmTask> {
        fn number<T: std::str::FromStr>(name: &str) -> Option<T> {
            std::env::var(name).ok()?.parse().ok()
        }
        Some(SlurmTask {
            array: number("SLURM_ARRAY_JOB_ID"),
            task: number("SLURM_ARRAY_TASK_ID"),
            job: number("SLURM_JOB_ID")?,
            restarts: number("SLURM_RESTART_COUNT").unwrap_or(0),
        })
    }
}

/// What Slurm or the system calls this machine.
pub fn node_name() -> String {
    let slurm = std::env::var("SLURMD_NODENAME").ok().filter(|name| !name.is_empty());
    #[cfg(unix)]
    let system = nix::unistd::gethostname().ok().and_then(|name| name.into_string().ok());
    #[cfg(not(unix))]
    let system = std::env::var("COMPUTERNAME").ok();
    slurm.or(system).unwrap_or_else(|| "this machine".into())
}

/// Seconds since 1970.
pub fn now_s() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |d| d.as_secs_f64())
}

/// The file of a run, written when it begins and again when it ends.
pub struct RunFile {
    path: PathBuf,
    pub run: Run,
}

impl RunFile {
    pub fn create(cube: &Path, run: Run) -> Result<RunFile> {
        let path = cube.join(PRIVATE).join(format!("run-{}.json", files::random_suffix()));
        let file = RunFile { path, run };
        file.write()?;
        Ok(file)
    }

    pub fn write(&self) -> Result<()> {
        let text = serde_json::to_string_pretty(&self.run).expect("plain values");
        files::write_atomically(&self.path, format!("{text}\n").as_bytes())
    }
}

/// How the tiles of a cube stand, and who did what.
#[derive(Debug, Clone, PartialEq)]
pub struct Work {
    /// Samples per pixel that a tile must have to be done; `None` where nobody has said.
    pub target: Option<u32>,
    /// The error that makes it done before; `None` where nobody has asked for one.
    pub goal: Option<f64>,
    /// Tiles that are as exact as that, and the largest error of the others.
    pub exact: usize,
    pub worst: Option<f32>,
    pub runs: Vec<Run>,
    /// By tile.
    pub stands: Vec<Stand>,
}

/// How one tile stands. Runs are numbered as in [`Work::runs`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stand {
    /// By the last run that had it among its tiles and merged anything.
    Done(Option<usize>),
    /// Locked at this moment.
    Running(Option<usize>),
    /// The last run that had it failed, or was lost: killed, with its node or alone.
    Failed(usize),
    Missing,
}

impl Work {
    /// `target`: the samples per pixel wanted; else the most that any run works or worked towards.
    pub fn of(cube: &Cube, samples: &[u32], target: Option<u32>) -> Result<Work> {
        // Locks first: a run that ends meanwhile is then seen as one that still works, not as one that was lost.
        let held = cube.all_in_use();
        let runs = cube.runs()?;
        let looks = if runs.iter().any(|run| run.tile_error.is_some()) { cube.all_looks()? } else { Vec::new() };
        Ok(Work::judge(samples, &looks, &held, runs, target))
    }

    /// `looks`: the errors of all tiles at their last two looks, where they are needed.
    fn judge(samples: &[u32], looks: &[[f32; 2]], held: &[Range<u32>], runs: Vec<Run>, target: Option<u32>) -> Work {
        let goal = runs.iter().filter_map(|run| run.tile_error).reduce(f64::min);
        let is_fine = |looks: &[f32; 2]| goal.is_some_and(|goal| is_within(*looks, goal));
        let is_exact = |tile: usize| looks.get(tile).is_some_and(is_fine);
        let worst = looks.iter().filter(|looks| !is_fine(looks)).map(|looks| looks[1]).reduce(f32::max);
        let exact = (0..samples.len()).filter(|tile| is_exact(*tile)).count();
        let target = target.or_else(|| runs.iter().filter_map(|run| run.samples_limit).max());
        // The last run by tile, and the last that merged anything there.
        let (mut last, mut worked) = (vec![None; samples.len()], vec![None; samples.len()]);
        for (i, run) in runs.iter().enumerate() {
            let [from, to] = run.tiles.map(|tile| (tile as usize).min(samples.len()));
            last[from.min(to)..to].fill(Some(i));
            if run.units > 0 || run.state == RunState::Running {
                worked[from.min(to)..to].fill(Some(i));
            }
        }
        let mut is_held = vec![false; samples.len()];
        for range in held {
            let to = (range.end as usize).min(samples.len());
            is_held[(range.start as usize).min(to)..to].fill(true);
        }
        let stand = |(tile, &n): (usize, &u32)| match (target, last[tile]) {
            (Some(target), _) if n >= target => Stand::Done(worked[tile]),
            _ if is_exact(tile) => Stand::Done(worked[tile]),
            (None, _) if n > 0 && !is_held[tile] && goal.is_none() => Stand::Done(worked[tile]),
            (_, last) if is_held[tile] => {
                let of_now = |i: &usize| runs[*i].state == RunState::Running && runs[*i].has(tile as u32);
                Stand::Running(last.filter(of_now).or_else(|| (0..runs.len()).rev().find(of_now)))
            }
            (_, Some(i)) if matches!(runs[i].state, RunState::Failed | RunState::Running) => Stand::Failed(i),
            _ => Stand::Missing,
        };
        let stands = samples.iter().enumerate().map(stand).collect();
        Work { target, goal, exact, worst, runs, stands }
    }

    /// Tiles that stand so, those that follow each other and stand alike together.
    pub fn ranges(&self, such: impl Fn(Stand) -> bool) -> Vec<(Range<u32>, Stand)> {
        let mut found: Vec<(Range<u32>, Stand)> = Vec::new();
        for (tile, &stand) in (0..).zip(&self.stands).filter(|(_, stand)| such(**stand)) {
            match found.last_mut() {
                Some((range, of)) if range.end == tile && *of == stand => range.end += 1,
                _ => found.push((tile..tile + 1, stand)),
            }
        }
        found
    }

    pub fn count(&self, such: impl Fn(Stand) -> bool) -> usize {
        self.stands.iter().filter(|stand| such(**stand)).count()
    }

    pub fn is_done(&self) -> bool {
        self.stands.iter().all(|stand| matches!(stand, Stand::Done(_)))
    }
}

impl Cube {
    /// Every run that has worked on this cube, in the order in which they began. A file that is no run's is passed over:
    /// nothing depends on it.
    pub fn runs(&self) -> Result<Vec<Run>> {
        let folder = self.private();
        let failed = |error| Error::storage(&folder, error);
        let mut runs = Vec::new();
        let entries = match fs::read_dir(&folder) {
            Ok(entries) => entries,
            // A copy without it.
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(runs),
            Err(error) => return Err(failed(error)),
        };
        for entry in entries {
            let entry = entry.map_err(failed)?;
            let name = entry.file_name();
            if !name.to_str().is_some_and(|name| name.starts_with("run-") && name.ends_with(".json")) {
                continue;
            }
            match fs::read(entry.path()) {
                Ok(bytes) => runs.extend(serde_json::from_slice::<Run>(&bytes)),
                Err(error) if error.kind() == ErrorKind::NotFound => {}
                Err(error) => return Err(Error::storage(&entry.path(), error)),
            }
        }
        runs.sort_by(|a, b| a.started_s.total_cmp(&b.started_s));
        Ok(runs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(state: RunState, tiles: Range<u32>, units: u64) -> Run {
        Run { state, units, ..Run::begin(&tiles, Some(64), None) }
    }

    #[test]
    fn tiles_stand_as_samples_locks_and_runs_say() {
        let runs = vec![
            run(RunState::Done, 0..2, 2),
            run(RunState::Failed, 2..4, 1),
            run(RunState::Running, 4..6, 0),
            run(RunState::Running, 6..8, 0),
            run(RunState::Interrupted, 8..9, 1),
            // It found tiles 0..2 done, and renders 2 again.
            run(RunState::Done, 0..3, 0),
        ];
        let samples = [64, 64, 16, 64, 64, 0, 0, 0, 32, 0];
        let work = Work::judge(&samples, &[], std::slice::from_ref(&(6..8)), runs.clone(), None);
        let expected = [
            Stand::Done(Some(0)),
            Stand::Done(Some(0)),
            Stand::Missing,
            Stand::Done(Some(1)),
            Stand::Done(Some(2)),
            Stand::Failed(2),
            Stand::Running(Some(3)),
            Stand::Running(Some(3)),
            Stand::Missing,
            Stand::Missing,
        ];
        assert_eq!((work.target, &work.stands[..]), (Some(64), &expected[..]));
        assert!(!work.is_done() && work.count(|s| matches!(s, Stand::Done(_))) == 4);
        let running = work.ranges(|stand| matches!(stand, Stand::Running(_)));
        assert_eq!(running, [(6..8, Stand::Running(Some(3)))]);
        let more = Work::judge(&samples, &[], &[], runs, Some(128));
        assert_eq!(more.count(|s| matches!(s, Stand::Done(_))), 0);
    }

    #[test]
    fn tiles_with_ends_of_their_own_are_done_where_they_are_exact() {
        let of = |limit, error| Run { state: RunState::Interrupted, units: 9, ..Run::begin(&(0..4), limit, error) };
        let (samples, looks) =
            ([640, 64, 512, 4096], [[0.02, 0.01], [f32::INFINITY; 2], [f32::INFINITY, 0.01], [0.09, 0.05]]);
        let judge =
            |limit| Work::judge(&samples, &looks, &[], vec![of(limit, Some(0.03)), of(limit, Some(0.02))], None);
        let (done, missing) = (Stand::Done(Some(1)), Stand::Missing);
        let work = judge(None);
        assert_eq!((work.goal, work.exact, work.worst), (Some(0.02), 1, Some(f32::INFINITY)));
        assert_eq!(work.stands, [done, missing, missing, missing]);
        assert_eq!(judge(Some(4096)).stands, [done, missing, missing, done]);
    }

    #[test]
    fn runs_are_read_as_they_were_written() {
        let mut run = Run::begin(&(3..7), None, None);
        run.facts.insert("merge_seconds".into(), serde_json::json!(1.5));
        run.end(Err(&Error::Interrupted { signal: 15 }));
        assert_eq!((run.state, run.exit_code, &run.message), (RunState::Interrupted, Some(143), &None));
        let text = serde_json::to_string(&run).expect("plain values");
        assert_eq!(serde_json::from_str::<Run>(&text).expect("a run"), run);
        run.end(Err(&Error::Usage("no".into())));
        assert_eq!((run.state, run.message.as_deref()), (RunState::Failed, Some("no")));
    }
}
