//! Array jobs on a Slurm cluster: what is submitted, and what its tasks and its finaliser are told.
//!
//! A task is a range of tiles of one cube, rendered by an ordinary process under the locks and journals of every other,
//! so a task may be killed, requeued, or run twice. The finaliser comes when no task of the array is left,
//! verifies every tile and submits again what is missing. All of them read [`Job`], a file in the cube.

pub mod client;
pub mod script;

use std::fs;
use std::io::ErrorKind;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::cube::{Layer, node_name};
use crate::files::output::Product;
use crate::{Error, Result, files};

/// Arrays that finalisers may submit for one `spectile submit`, after the first.
pub const RESUBMISSIONS: usize = 3;
/// Indices of an array where no cluster says: Slurm's default for MaxArraySize.
pub const DEFAULT_ARRAY_LIMIT: u32 = 1001;
/// More tasks than this are not made unasked: every one starts a program and opens a device.
const DEFAULT_TASKS: u32 = 1000;
/// Samples of a channel that a task should at least have, where so many tasks can be made: minutes of a large GPU, and of some
/// dozen CPU cores (of which each does about 1e8 a second). With fewer, opening devices would be what takes the time.
const VALUES_ON_GPU: f64 = 1e12;
const VALUES_ON_CPU: f64 = 1e11;

/// What `spectile submit` has submitted: enough for a task on any node to render its part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Job {
    /// Of the program that submitted; others refuse.
    pub version: String,
    /// The program that the nodes run, absolute like all paths here.
    pub program: PathBuf,
    pub scene: PathBuf,
    pub scene_digest: String,
    pub overrides: Vec<(String, String)>,
    pub size: Option<[u32; 2]>,
    /// Side of the tiles, if asked for.
    pub tile: Option<u32>,
    pub seed: u64,
    /// Whether the cube has standard errors.
    #[serde(default)]
    pub uncertainty: bool,
    /// Whether weights of products of spectra are kept instead of radiance.
    #[serde(default)]
    pub factored: bool,
    /// What of the first surface behind each pixel the cube has.
    #[serde(default)]
    pub layers: Vec<Layer>,
    pub memory: Option<u64>,
    /// Whether tasks may use software devices where no GPU is found.
    #[serde(default)]
    pub allow_software: bool,
    /// Samples per pixel at which every tile is done, the end of an epoch.
    pub samples: u32,
    /// The error of a tile at which it is done before.
    #[serde(default)]
    pub tile_error: Option<f64>,
    /// Tiles of the cube, and tasks that share them.
    pub tiles: u32,
    pub tasks: u32,
    pub request: Request,
    /// What was submitted, the latest last.
    pub submitted: Vec<Submitted>,
}

/// What of the cluster a task gets.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Request {
    pub name: String,
    pub gpus_per_task: u32,
    pub partition: Option<String>,
    /// Minutes.
    pub time_limit: Option<u64>,
    /// Further options of sbatch, as the user wrote them.
    pub more: Vec<String>,
}

/// One array and its finaliser.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Submitted {
    pub array: u64,
    /// `None`: nothing was there to wait with it, or it was not submitted any more.
    pub finaliser: Option<u64>,
    /// Tasks, as sbatch takes them: `0-4,7`.
    pub tasks: String,
    pub at_s: f64,
}

/// Folder of job file and logs.
pub fn folder(cube: &Path) -> PathBuf {
    cube.join(".spectile/slurm")
}

fn file(cube: &Path) -> PathBuf {
    folder(cube).join("job.json")
}

/// The batch script that stands beside a cube, and what the finaliser leaves there.
pub fn script_path(cube: &Path) -> PathBuf {
    beside(cube, "sbatch")
}

pub fn summary_path(cube: &Path) -> PathBuf {
    beside(cube, "summary.txt")
}

/// Both files, as [`crate::files::output`] has it.
pub const SCRIPT: Product = Product {
    name: "a batch script that `submit` wrote",
    extensions: &["sbatch"],
    is_stream: false,
    is_folder: false,
    check: |path| begins(path, "#!/bin/bash\n# ", script::WRITTEN_BY),
};
pub const SUMMARY: Product = Product {
    name: "the summary of an array job",
    extensions: &["txt"],
    is_stream: false,
    is_folder: false,
    check: |path| begins(path, "cube         ", "\nresult       "),
};

/// Whether the text at `path` begins so, and goes on to say that.
fn begins(path: &Path, begin: &str, more: &str) -> std::result::Result<(), String> {
    let text = fs::read_to_string(path).map_err(|error| format!("cannot be read as text ({error})"))?;
    if text.starts_with(begin) && text.contains(more) { Ok(()) } else { Err("holds something else".into()) }
}

fn beside(cube: &Path, extension: &str) -> PathBuf {
    let mut name = cube.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{extension}"));
    cube.with_file_name(name)
}

impl Job {
    /// Tiles of a task.
    pub fn range(&self, task: u32) -> Range<u32> {
        let at = |task: u32| (u64::from(task) * u64::from(self.tiles) / u64::from(self.tasks)) as u32;
        at(task)..at(task + 1)
    }

    /// The tasks that have any of `tiles`, which are in order.
    pub fn tasks_of(&self, tiles: impl IntoIterator<Item = u32>) -> Vec<u32> {
        let mut tasks: Vec<u32> = Vec::new();
        for tile in tiles {
            if tasks.last().is_some_and(|&task| self.range(task).contains(&tile)) {
                continue;
            }
            let guess = (u64::from(tile) * u64::from(self.tasks) / u64::from(self.tiles)) as u32;
            let from = guess.saturating_sub(1);
            tasks.extend((from..self.tasks).find(|&task| self.range(task).contains(&tile)));
        }
        tasks
    }

    /// The job of a cube, if it has been submitted.
    pub fn find(cube: &Path) -> Result<Option<Job>> {
        let file = file(cube);
        let text = match fs::read_to_string(&file) {
            Ok(text) => text,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(Error::storage(&file, error)),
        };
        // Another version's file may differ in anything but this.
        #[derive(Deserialize)]
        struct Version {
            version: String,
        }
        let damaged = |error: serde_json::Error| Error::storage(&file, format!("is damaged: {error}"));
        let Version { version } = serde_json::from_str(&text).map_err(damaged)?;
        if version != env!("CARGO_PKG_VERSION") {
            let (node, ours) = (node_name(), env!("CARGO_PKG_VERSION"));
            return Err(Error::Usage(format!(
                "{}: was submitted by Spectile {version}, but {node} has {ours} at {}; put the same version on every node",
                cube.display(),
                std::env::current_exe().unwrap_or_default().display()
            )));
        }
        serde_json::from_str(&text).map_err(damaged).map(Some)
    }

    /// The job of a cube that must have been submitted.
    pub fn read(cube: &Path) -> Result<Job> {
        if !cube.is_dir() {
            let what = format!(
                "cannot be seen from {}; put the cube on a file system that all nodes share, under the same path",
                node_name()
            );
            return Err(Error::storage(cube, what));
        }
        Job::find(cube)?.ok_or_else(|| {
            Error::Usage(format!("{}: nothing was submitted for it; `spectile submit` does", cube.display()))
        })
    }

    pub fn write(&self, cube: &Path) -> Result<()> {
        let folder = folder(cube);
        files::make_folder_durably(&folder).map_err(|error| Error::storage(&folder, error))?;
        let text = serde_json::to_string_pretty(self).expect("plain values");
        files::write_atomically(&file(cube), format!("{text}\n").as_bytes())
    }

    /// The command that renders the same on one machine.
    pub fn render_command(&self, cube: &Path) -> String {
        let mut words = vec!["spectile".into(), "render".into(), quote(&self.scene.display().to_string()), "-o".into()];
        words.push(quote(&cube.display().to_string()));
        words.push(format!("--spp {}", self.samples));
        words.extend(self.tile_error.map(|error| format!("--error {error} --error-per tile")));
        words.extend(self.overrides.iter().map(|(key, value)| format!("--set {}", quote(&format!("{key}={value}")))));
        words.extend(self.size.map(|[width, height]| format!("--size {width}x{height}")));
        words.extend(self.tile.map(|tile| format!("--tile {tile}")));
        words.extend((self.seed != 0).then(|| format!("--seed {}", self.seed)));
        words.extend(self.uncertainty.then(|| "--uncertainty".into()));
        words.extend(self.factored.then(|| "--factored".into()));
        let layers: Vec<&str> = self.layers.iter().map(|layer| layer.name()).collect();
        words.extend((!layers.is_empty()).then(|| format!("--layers {}", layers.join(","))));
        words.extend(self.memory.map(|memory| format!("--memory {memory}")));
        words.join(" ")
    }
}

/// How many tasks share `tiles` tiles where nobody says: as many as the array may have, unless they would be too small.
/// `values`: samples x channels of the whole cube.
pub fn default_tasks(tiles: u32, values: f64, gpus_per_task: u32, array_limit: u32) -> u32 {
    let least = if gpus_per_task > 0 { VALUES_ON_GPU * f64::from(gpus_per_task) } else { VALUES_ON_CPU };
    // Enough for a few nodes, however small it is.
    let by_size = (values / least).clamp(8.0, f64::from(DEFAULT_TASKS)) as u32;
    by_size.min(tiles).min(array_limit).max(1)
}

/// Numbers in order as sbatch takes them: `0-4,7`.
pub fn array_spec(tasks: &[u32]) -> String {
    /// More than this no command line needs to hold.
    const MAX_BYTES: usize = 32 << 10;
    let mut ranges: Vec<[u32; 2]> = Vec::new();
    for &task in tasks {
        match ranges.last_mut() {
            Some([_, last]) if *last + 1 == task => *last = task,
            _ => ranges.push([task, task]),
        }
    }
    let each = |[from, to]: &[u32; 2]| if from == to { from.to_string() } else { format!("{from}-{to}") };
    let spec = ranges.iter().map(each).collect::<Vec<_>>().join(",");
    match (ranges.first(), ranges.last()) {
        // Tasks that have nothing to do end at once.
        (Some([first, _]), Some([_, last])) if spec.len() > MAX_BYTES => format!("{first}-{last}"),
        _ => spec,
    }
}

/// Text as a shell takes it for one word.
pub fn quote(text: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "/._-+=:,@%".contains(c);
    if !text.is_empty() && text.chars().all(is_plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub fn job(tiles: u32, tasks: u32) -> Job {
        Job {
            version: env!("CARGO_PKG_VERSION").into(),
            program: "/opt/spectile/bin/spectile".into(),
            scene: "/home/ada/box.toml".into(),
            scene_digest: "0123abcd".into(),
            overrides: vec![("channels.equal.count".into(), "40".into())],
            size: None,
            tile: Some(32),
            seed: 7,
            uncertainty: false,
            factored: false,
            layers: Vec::new(),
            memory: None,
            allow_software: false,
            samples: 256,
            tile_error: None,
            tiles,
            tasks,
            request: Request {
                name: "box".into(),
                gpus_per_task: 1,
                partition: Some("gpu".into()),
                time_limit: Some(120),
                more: vec!["--account=optics".into()],
            },
            submitted: Vec::new(),
        }
    }

    #[test]
    fn tasks_share_all_tiles() {
        for (tiles, tasks) in [(1, 1), (9, 4), (10, 10), (1000, 7), (4_000_000_000, 1001)] {
            let job = job(tiles, tasks);
            let mut next = 0;
            for task in 0..tasks {
                let range = job.range(task);
                assert!(range.start == next && !range.is_empty(), "{tiles} {tasks} {task}");
                assert_eq!(job.tasks_of([range.start, range.end - 1]), [task]);
                next = range.end;
            }
            assert_eq!(next, tiles);
        }
        assert_eq!(job(9, 4).tasks_of([0, 1, 2, 3, 8]), [0, 1, 3]);
    }

    #[test]
    fn numbers_of_tasks_follow_from_the_work() {
        assert_eq!(default_tasks(9, 1e6, 1, 1001), 8);
        assert_eq!(default_tasks(3, 1e6, 1, 1001), 3);
        assert_eq!(default_tasks(10_000, 1e14, 1, 1001), 100);
        assert_eq!(default_tasks(10_000, 1e14, 0, 1001), 1000);
        assert_eq!(default_tasks(10_000, 1e14, 0, 50), 50);
    }

    #[test]
    fn arrays_and_words_are_written_as_others_read_them() {
        assert_eq!(array_spec(&[0, 1, 2, 5, 7, 8]), "0-2,5,7-8");
        assert_eq!(array_spec(&(0..100_000).step_by(2).collect::<Vec<_>>()), "0-99998");
        assert_eq!(quote("a b's"), r"'a b'\''s'");
        assert_eq!(quote("/home/ada/box.zarr"), "/home/ada/box.zarr");
    }
}
