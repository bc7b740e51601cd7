//! How the tiles of a cube stand, for `info`: done, being rendered, failed or waiting, and by whom.

use std::collections::BTreeMap;
use std::ops::Range;

use serde_json::{Value, json};

use super::array::why;
use crate::Result;
use crate::cube::{Cube, Stand, Work};
use crate::slurm::{Job, client};

/// Ranges and nodes that people are shown, at most.
const SHOWN: usize = 8;

/// What `info` says of the work on a cube.
#[derive(Debug, Clone, PartialEq)]
pub struct TileStates {
    work: Work,
    /// The array job, if there is one, and what Slurm says of those that are not over.
    job: Option<Job>,
    queue: Option<Vec<(String, usize)>>,
}

/// Ranges of tiles as people write them, the first few.
pub fn list(tiles: &[Range<u32>]) -> String {
    let mut each: Vec<String> = tiles.iter().take(SHOWN).map(|t| format!("{}..{}", t.start, t.end)).collect();
    if tiles.len() > SHOWN {
        each.push(format!("and {} more ranges (--json lists all)", tiles.len() - SHOWN));
    }
    each.join(", ")
}

fn is_done(stand: Stand) -> bool {
    matches!(stand, Stand::Done(_))
}

fn is_running(stand: Stand) -> bool {
    matches!(stand, Stand::Running(_))
}

fn is_failed(stand: Stand) -> bool {
    matches!(stand, Stand::Failed(_))
}

fn is_waiting(stand: Stand) -> bool {
    stand == Stand::Missing
}

impl TileStates {
    pub fn of(cube: &Cube, samples: &[u32]) -> Result<TileStates> {
        // What another version has submitted is a cube like any other here.
        let job = Job::find(cube.path()).unwrap_or(None);
        let work = Work::of(cube, samples, job.as_ref().map(|job| job.samples))?;
        let jobs: Vec<u64> = job.iter().flat_map(|job| job.submitted.iter().map(|s| s.array)).collect();
        let queue = if jobs.is_empty() || work.is_done() { None } else { client::states(&jobs) };
        Ok(TileStates { work, job, queue })
    }

    /// Whether tiles end by their own errors, so that their samples differ.
    pub fn has_own_ends(&self) -> bool {
        self.work.goal.is_some()
    }

    pub fn is_done(&self) -> bool {
        self.work.is_done()
    }

    /// Tiles that somebody works on: those of the first range.
    pub fn first_in_use(&self) -> Option<Range<u32>> {
        self.work.ranges(is_running).into_iter().next().map(|(tiles, _)| tiles)
    }

    fn who(&self, stand: Stand) -> Option<String> {
        match stand {
            Stand::Done(Some(run)) | Stand::Running(Some(run)) | Stand::Failed(run) => Some(self.work.runs[run].who()),
            _ => None,
        }
    }

    /// Tiles done, by node.
    fn done_by(&self) -> BTreeMap<String, usize> {
        let mut by = BTreeMap::new();
        for stand in &self.work.stands {
            if let Stand::Done(Some(run)) = stand {
                *by.entry(self.work.runs[*run].node.clone()).or_default() += 1;
            }
        }
        by
    }

    /// Name and value of every line.
    pub fn rows(&self) -> Vec<(&'static str, String)> {
        let (work, mut rows) = (&self.work, Vec::new());
        if let Some(goal) = work.goal {
            let mut text = format!("{} of {} are within {:.3} %", work.exact, work.stands.len(), 100.0 * goal);
            if let Some(worst) = work.worst {
                let full = work.count(is_done).saturating_sub(work.exact);
                text += &format!(", {full} ended by their samples; the worst has ");
                text += &if worst.is_finite() {
                    format!("{:.3} %", 100.0 * worst)
                } else {
                    "not been looked at".to_owned()
                };
            }
            rows.push(("tile errors", text));
        }
        let whole = match (work.target, work.goal) {
            (None, None) => return rows,
            (Some(target), None) => format!("tiles have {target} samples per pixel"),
            (_, Some(_)) => "tiles".to_owned(),
        };
        let done = work.count(is_done);
        let mut by: Vec<String> = self.done_by().into_iter().map(|(node, tiles)| format!("{node} {tiles}")).collect();
        if by.len() > SHOWN {
            let more = by.len() - SHOWN;
            by.truncate(SHOWN);
            by.push(format!("and {more} more nodes"));
        }
        let by = if by.is_empty() { String::new() } else { format!(": {}", by.join(", ")) };
        rows.push(("done", format!("{done} of {} {whole}{by}", work.stands.len())));
        let with_whom = |name, such: fn(Stand) -> bool, rows: &mut Vec<_>| {
            let ranges = work.ranges(such);
            for (tiles, stand) in ranges.iter().take(SHOWN) {
                let mut value = format!("tiles {}..{}", tiles.start, tiles.end);
                match (stand, self.who(*stand)) {
                    (Stand::Failed(run), Some(who)) => value += &format!(" by {who}: {}", why(&work.runs[*run])),
                    (_, Some(who)) => value += &format!(" by {who}"),
                    (_, None) => value += " by a process that has not said more",
                }
                rows.push((name, value));
            }
            if ranges.len() > SHOWN {
                rows.push((name, format!("and {} more ranges (--json lists all)", ranges.len() - SHOWN)));
            }
        };
        with_whom("running", is_running, &mut rows);
        with_whom("failed", is_failed, &mut rows);
        let waiting: Vec<Range<u32>> = work.ranges(is_waiting).into_iter().map(|(tiles, _)| tiles).collect();
        if !waiting.is_empty() {
            rows.push(("waiting", format!("{} tiles: {}", work.count(is_waiting), list(&waiting))));
        }
        if let Some(submitted) = self.job.as_ref().and_then(|job| job.submitted.last()) {
            let finaliser = submitted.finaliser.map_or_else(String::new, |id| format!(", finaliser {id}"));
            let queue = match self.queue.as_deref() {
                None => String::new(),
                Some([]) => "; no task of it is in the queue any more".into(),
                Some(states) => {
                    let each: Vec<_> = states.iter().map(|(state, count)| format!("{count} {state}")).collect();
                    format!("; in the queue: {}", each.join(", "))
                }
            };
            rows.push(("array job", format!("{}, tasks {}{finaliser}{queue}", submitted.array, submitted.tasks)));
        }
        rows
    }

    /// All of it on a line.
    pub fn line(&self) -> String {
        let work = &self.work;
        let mut text = format!("{} of {} tiles done", work.count(is_done), work.stands.len());
        for (name, such) in
            [("running", is_running as fn(Stand) -> bool), ("failed", is_failed), ("waiting", is_waiting)]
        {
            let count = work.count(such);
            if count > 0 {
                text += &format!(", {count} {name}");
            }
        }
        text
    }

    /// The same for programs; docs/json.md lists the fields.
    pub fn facts(&self) -> Value {
        let work = &self.work;
        let ranges = |such: fn(Stand) -> bool| -> Value {
            let each = work.ranges(such).into_iter().map(|(tiles, stand)| {
                let run = match stand {
                    Stand::Done(run) | Stand::Running(run) => run,
                    Stand::Failed(run) => Some(run),
                    Stand::Missing => None,
                };
                json!({ "tiles": [tiles.start, tiles.end], "run": run })
            });
            each.collect()
        };
        let runs = work.runs.iter().map(|run| {
            json!({
                "node": run.node,
                "process": run.process,
                "job": run.slurm.as_ref().map(|slurm| slurm.name()),
                "state": run.state,
                "message": run.message,
                "tiles": run.tiles,
                "units": run.units,
                "started_s": run.started_s,
                "ended_s": run.ended_s,
            })
        });
        let submitted = self.job.as_ref().and_then(|job| job.submitted.last());
        json!({
            "samples_wanted": work.target,
            "tile_error_wanted": work.goal,
            "tiles_exact": work.goal.map(|_| work.exact),
            "worst_tile_error": work.worst.filter(|worst| worst.is_finite()),
            "tiles": work.stands.len(),
            "tiles_done": work.count(is_done),
            "done": ranges(is_done),
            "running": ranges(is_running),
            "failed": ranges(is_failed),
            "waiting": ranges(is_waiting),
            "runs": runs.collect::<Vec<_>>(),
            "array_job": submitted.map(|s| s.array),
            "finaliser_job": submitted.and_then(|s| s.finaliser),
        })
    }
}
