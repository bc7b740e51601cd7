//! Array jobs on a real Slurm cluster of several nodes on this machine. Where Slurm is not installed they say so and pass;
//! `./check --full` installs it.

mod cluster;
mod disturbed;
mod refused;
mod scale;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::{Mutex, MutexGuard, OnceLock};

use cluster::{Cluster, is_there, wait_for};
use serde_json::Value;
use tempfile::TempDir;

use crate::cube_files::{Files, arrays};

/// A grey wall under a lamp; 64 x 64 pixels, 5 channels: 64 tiles of 8 x 8.
const SCENE: &str = r#"
[camera.perspective]
position = [0.0, 0.2, 3.0]
look_at = [0.0, 0.0, 0.0]
up = [0.0, 1.0, 0.0]
fov = 50.0

[film]
width = 64
height = 64

[channels]
equal = { from = 400.0, to = 700.0, count = 5 }

[integrator]
max_bounces = 3

[spectra.lamp]
samples = [[400, 1.0], [700, 2.0]]

[materials.grey.diffuse]
reflectance = 0.5

[materials.black.black]

[[objects]]
quad = { corner = [-1, -1, -1], edge_u = [2, 0, 0], edge_v = [0, 2, 0] }
material = "grey"

[[objects]]
quad = { corner = [-0.3, 1, -0.5], edge_u = [0.6, 0, 0], edge_v = [0, 0, 0.6] }
material = "black"
emission = "lamp"
"#;

/// A folder that all nodes share, with `scene.toml`, and a cluster. One at a time.
struct Place {
    cluster: Cluster,
    folder: TempDir,
    _turn: MutexGuard<'static, ()>,
}

fn turn() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(|e| e.into_inner())
}

fn folder_with_scene() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("scene.toml"), SCENE).expect("written");
    folder
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

impl Place {
    /// `None`, said aloud, where there is no Slurm.
    fn new(nodes: usize, cpus: u32) -> Option<Place> {
        Place::with_gpus(nodes, cpus, 0)
    }

    fn with_gpus(nodes: usize, cpus: u32, gpus: u32) -> Option<Place> {
        let turn = turn();
        is_there().then(|| Place {
            cluster: Cluster::start(nodes, cpus, gpus),
            folder: folder_with_scene(),
            _turn: turn,
        })
    }

    fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = self.cluster.prepare(env!("CARGO_BIN_EXE_spectile"));
        command.env("XDG_RUNTIME_DIR", self.folder.path()).current_dir(self.folder.path()).args(arguments);
        command
    }

    fn run(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().expect("the binary runs")
    }

    fn success(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        assert!(output.status.success(), "{arguments:?}: {:?} {}", output.status, text(&output.stderr));
        text(&output.stdout)
    }

    /// Submits the scene into cube.zarr on CPUs, and returns the array's and the finaliser's numbers.
    fn submit(&self, more: &[&str]) -> [u64; 2] {
        let stdout = self.success(&[&["submit", "--json"], SUBMIT, more].concat());
        let done: Value = serde_json::from_str(stdout.lines().last().expect("a line")).expect("JSON");
        ["array_job", "finaliser_job"].map(|key| done[key].as_u64().unwrap_or_else(|| panic!("{key}: {done}")))
    }

    /// How the tiles of cube.zarr stand.
    fn work(&self) -> Value {
        let stdout = self.success(&["info", "cube.zarr", "--json"]);
        serde_json::from_str::<Value>(stdout.trim()).expect("JSON")["work"].clone()
    }

    fn tiles_done(&self) -> u64 {
        self.work()["tiles_done"].as_u64().expect("a number")
    }

    fn summary(&self) -> String {
        let summary = fs::read_to_string(self.at("cube.zarr.summary.txt"));
        summary.unwrap_or_else(|e| panic!("a summary: {e}\n{}", self.logs()))
    }

    /// Waits for the end of everything; then the cube must be whole, and every byte that of the one-machine render.
    fn ends_with_the_same_bytes(&self, spp: &'static str) {
        self.ends_with_the_bytes_of(&["--spp", spp]);
    }

    /// The same, of the render with these options.
    fn ends_with_the_bytes_of(&self, options: &[&'static str]) {
        self.cluster.wait_until_empty();
        let summary = self.summary();
        assert!(summary.contains("\nresult       complete: 64 tiles of "), "{summary}\n{}", self.logs());
        assert!(summary.contains(", every checksum is right\n"), "{summary}");
        self.success(&["info", "cube.zarr", "--verify"]);
        let aside = fs::read_dir(self.at("cube.zarr/.spectile/aside")).expect("a folder").count();
        assert_eq!(aside, 0, "nothing lies aside");
        assert!(arrays(&self.at("cube.zarr")) == *straight(options), "{}", self.logs());
    }

    /// What tasks and finalisers have said, for when something is not as it should be.
    fn logs(&self) -> String {
        let entries = fs::read_dir(self.at("cube.zarr/.spectile/slurm")).into_iter().flatten().flatten();
        let each = entries.map(|entry| {
            let text = fs::read_to_string(entry.path()).unwrap_or_default();
            format!("--- {}\n{text}", entry.path().display())
        });
        each.collect()
    }

    /// The states of all runs so far, and whether any of them has been requeued.
    fn runs(&self) -> Vec<(String, u64)> {
        let each = fs::read_dir(self.at("cube.zarr/.spectile")).expect("a folder").flatten().filter_map(|entry| {
            let is_run = entry.file_name().to_str().is_some_and(|name| name.starts_with("run-"));
            let run: Value = serde_json::from_slice(&fs::read(entry.path()).ok().filter(|_| is_run)?).ok()?;
            Some((run["state"].as_str()?.to_owned(), run["slurm"]["restarts"].as_u64()?))
        });
        each.collect()
    }
}

const SUBMIT: &[&str] = &["scene.toml", "-o", "cube.zarr", "--tile", "8", "--gpus-per-task", "0"];

/// The arrays that one process makes, without a cluster; each is made once.
fn straight(options: &[&'static str]) -> &'static Files {
    type Made = Vec<(Vec<&'static str>, &'static Files)>;
    static MADE: OnceLock<Mutex<Made>> = OnceLock::new();
    let mut made = MADE.get_or_init(Mutex::default).lock().unwrap_or_else(|e| e.into_inner());
    if let Some((_, files)) = made.iter().find(|(of, _)| *of == options) {
        return files;
    }
    let folder = folder_with_scene();
    let mut command = Command::new(env!("CARGO_BIN_EXE_spectile"));
    command.env("XDG_RUNTIME_DIR", folder.path()).current_dir(folder.path());
    command.args(["render", "scene.toml", "-o", "cube.zarr", "--tile", "8", "--quiet"]).args(options);
    assert!(command.status().expect("the binary runs").success());
    let files: &'static Files = Box::leak(Box::new(arrays(&folder.path().join("cube.zarr"))));
    made.push((options.to_vec(), files));
    files
}

#[test]
fn an_array_render_is_byte_equal_to_the_one_machine_render() {
    let Some(place) = Place::new(3, 2) else { return };
    let [array, finaliser] = place.submit(&["--spp", "64", "--tasks", "7", "--sbatch", "--cpus-per-task=2"]);
    let watched = place.success(&["info", "cube.zarr", "--watch"]);
    let last = watched.lines().find(|line| line.starts_with("64 of 64 tiles done"));
    assert!(last.is_some(), "{watched}");
    place.ends_with_the_same_bytes("64");

    let script = fs::read_to_string(place.at("cube.zarr.sbatch")).expect("a script");
    assert!(script.contains("#SBATCH --array=0-6\n") && script.contains("#SBATCH --cpus-per-task=2\n"), "{script}");
    let work = place.work();
    assert_eq!((&work["array_job"], &work["finaliser_job"]), (&array.into(), &finaliser.into()));
    let runs = work["runs"].as_array().expect("a list");
    assert!(runs.len() == 7 && runs.iter().all(|run| run["state"] == "done"), "{runs:?}");
    let nodes: std::collections::BTreeSet<_> = runs.iter().map(|run| run["node"].as_str().expect("a name")).collect();
    assert_eq!(nodes, ["n1", "n2", "n3"].into(), "every node has worked");
    // Every array of it is one that other tools would read; and who did what is told.
    let told = place.success(&["info", "cube.zarr"]);
    assert!(told.contains("\ndone             64 of 64 tiles have 64 samples per pixel: n1 "), "{told}");

    // What is there is not submitted again; more samples are gone on with.
    let again = place.success(&[&["submit", "--resume", "--spp", "64"], SUBMIT].concat());
    assert!(again.contains("all 64 tiles have 64 samples per pixel; there is nothing to submit"), "{again}");
    place.submit(&["--resume", "--spp", "128", "--tasks", "5"]);
    place.ends_with_the_same_bytes("128");
    // Or it is begun anew, which must be said.
    let output = place.run(&[&["submit", "--spp", "64"], SUBMIT].concat());
    assert!(
        output.status.code() == Some(2) && text(&output.stderr).contains("exists already"),
        "{}",
        text(&output.stderr)
    );
    place.submit(&["--overwrite", "--spp", "64", "--tasks", "3"]);
    place.ends_with_the_same_bytes("64");
}

/// With `--uncertainty` the cube has an array more, with `--layers` some, of which every task writes its part.
#[test]
fn an_array_job_makes_standard_errors_too() {
    let Some(place) = Place::new(2, 2) else { return };
    place.submit(&["--spp", "128", "--tasks", "4", "--uncertainty", "--layers", "depth,object"]);
    place.ends_with_the_bytes_of(&["--spp", "128", "--uncertainty", "--layers", "depth,object"]);
    let [radiance, error, depth] = ["radiance", "standard_error", "depth"].map(|array| {
        straight(&["--spp", "128", "--uncertainty", "--layers", "depth,object"])
            .keys()
            .filter(|name| name.starts_with(&format!("{array}/c/")))
            .count()
    });
    assert_eq!((radiance, error, depth), (64, 64, 64));
    // Going on without it would be another cube.
    let output = place.run(&[&["submit", "--resume", "--spp", "256"], SUBMIT].concat());
    assert!(
        output.status.code() == Some(2) && text(&output.stderr).contains("uncertainty"),
        "{}",
        text(&output.stderr)
    );
}

#[test]
fn an_array_job_keeps_weights() {
    let Some(place) = Place::new(2, 1) else { return };
    place.submit(&["--spp", "64", "--factored", "--tasks", "4"]);
    place.ends_with_the_bytes_of(&["--spp", "64", "--factored"]);
}

/// No task sees the whole picture, nor needs to.
#[test]
fn tiles_of_an_array_job_end_by_their_errors() {
    let Some(place) = Place::new(2, 1) else { return };
    let stop = ["--set", "integrator.epoch=4", "--spp", "4096", "--error", "0.1", "--error-per", "tile"];
    place.submit(&[&stop[..], &["--tasks", "4"]].concat());
    place.ends_with_the_bytes_of(&stop);
    let work = place.work();
    assert_eq!((&work["tiles_exact"], &work["tiles_done"]), (&Value::from(64), &Value::from(64)), "{work}");
    let output = place.run(&[&["submit", "--resume"], &stop[..], SUBMIT].concat());
    assert!(text(&output.stdout).contains("there is nothing to submit"), "{}", text(&output.stdout));
    for (more, words) in [
        (&["--error", "0.1"][..], "--error-per"),
        (&["--error", "0.1", "--error-per", "image"], "take --error-per tile"),
    ] {
        let output = place.run(&[&["submit", "--overwrite", "--spp", "64"], more, SUBMIT].concat());
        assert!(output.status.code() == Some(2) && text(&output.stderr).contains(words), "{}", text(&output.stderr));
    }
}

/// The script and what would be typed, to the letter. If this has to change, look at it, and write it anew by hand.
#[test]
fn a_dry_run_shows_everything_and_changes_nothing() {
    let folder = folder_with_scene();
    let path = folder.path().canonicalize().expect("a folder");
    let mut command = Command::new(env!("CARGO_BIN_EXE_spectile"));
    command.current_dir(&path).args(["submit", "scene.toml", "-o", "cube.zarr", "--spp", "100", "--tile", "8"]);
    command.args([
        "--set",
        "channels.equal.count=7",
        "--seed",
        "3",
        "--uncertainty",
        "--memory",
        "1GiB",
        "--tasks",
        "20",
    ]);
    command.args(["--partition", "gpu", "--time-limit", "90m", "--array-limit", "1001", "--dry-run"]);
    command.args(["--sbatch", "--account=optics --comment='two words'"]);
    let output = command.output().expect("the binary runs");
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(text(&output.stderr), "");
    let program = env!("CARGO_BIN_EXE_spectile");
    let shown = text(&output.stdout).replace(path.to_str().expect("UTF-8"), "/data").replace(program, "/bin/spectile");
    assert_eq!(shown, include_str!("dry_run.txt"), "{shown}");
    assert_eq!(fs::read_dir(&path).expect("list").count(), 1, "nothing is written");
}

fn exists(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok()
}
