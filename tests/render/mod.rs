//! `render`, `plan` and `devices` as users meet them: the real binary, in fresh directories, on the device that is
//! there.

mod accuracy;
mod by_tile;
mod evaluation;
mod factored;
mod georeference;
mod heat_of_sky;
mod json;
mod latlong;
mod layers;
mod memory;
mod out_of_core;
mod outcome;
mod products;
mod reflectance;
mod remainder;
mod responses;
mod resume;
mod running;
mod several;
mod sizes;
mod sky;
mod uncertainty;
mod wrong;

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;
use spectile::cube::Cube;
use tempfile::TempDir;

use crate::binary::{self, events, png, text, wait_for};
use crate::cube_files::{self, Files};

/// A grey wall and floor under a lamp; 24 x 20 pixels, 5 channels.
const SCENE: &str = r#"
[camera.perspective]
position = [0.0, 0.2, 3.0]
look_at = [0.0, 0.0, 0.0]
up = [0.0, 1.0, 0.0]
fov = 50.0

[film]
width = 24
height = 20

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
quad = { corner = [-1, -1, -1], edge_u = [0, 0, 2], edge_v = [2, 0, 0] }
material = "grey"

[[objects]]
quad = { corner = [-0.3, 1, -0.5], edge_u = [0.6, 0, 0], edge_v = [0, 0, 0.6] }
material = "black"
emission = "lamp"
"#;

/// The scene so that no render of it ends by itself before a test does.
const ENDLESS: &[&str] = &["--spp", "1000000000"];

/// A fresh folder with `scene.toml`.
struct Place {
    folder: TempDir,
}

impl Place {
    fn new() -> Place {
        Place::of(SCENE)
    }

    fn of(scene: &str) -> Place {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("scene.toml"), scene).expect("written");
        Place { folder }
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    fn command(&self, arguments: &[&str]) -> Command {
        binary::command(self.path(), arguments)
    }

    fn run(&self, arguments: &[&str]) -> Output {
        binary::run(self.path(), arguments)
    }

    /// Stdout and stderr of a run that must succeed.
    fn success(&self, arguments: &[&str]) -> (String, String) {
        let output = self.run(arguments);
        assert!(output.status.success(), "{arguments:?}: {:?} {}", output.status, text(&output.stderr));
        (text(&output.stdout), text(&output.stderr))
    }

    /// Renders scene.toml into `name`, and opens it.
    fn render(&self, name: &str, more: &[&str]) -> Cube {
        self.success(&[&["render", "scene.toml", "-o", name, "--quiet"], more].concat());
        self.cube(name)
    }

    fn cube(&self, name: &str) -> Cube {
        Cube::open(&self.path().join(name)).expect("a cube")
    }

    /// The JSON events of a run that must succeed.
    fn events(&self, arguments: &[&str]) -> Vec<Value> {
        events(&self.success(&[arguments, &["--json"]].concat()).0)
    }

    /// What a render into cube.zarr says at its end that nothing but `--time` stops, after a full epoch or more. Compiling counts
    /// as time, and machines may have other things to do: so it is given more until it is enough.
    fn until_a_full_epoch(&self, more: &[&str]) -> Value {
        let render = ["render", "scene.toml", "-o", "cube.zarr", "--overwrite"];
        let of_seconds = |seconds: u32| {
            let time = format!("{seconds}s");
            self.events(&[&render[..], &["--time", &time], more].concat()).pop().expect("done")
        };
        let mut ends = (0..8).map(|doubled| of_seconds(1 << doubled));
        ends.find(|done| done["samples"].as_u64() >= Some(64)).expect("an epoch in two minutes")
    }

    /// Starts a render into `name` that somebody must stop.
    fn start(&self, name: &str, more: &[&str]) -> Running {
        let mut command = self.command(&[&["render", "scene.toml", "-o", name], ENDLESS, more].concat());
        Running(command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the binary starts"))
    }
}

/// A process that does not outlive its test.
struct Running(std::process::Child);

impl Running {
    #[cfg(unix)]
    fn signal(&self, name: &str) {
        self.signals(&[name]);
    }

    /// One right after the other.
    #[cfg(unix)]
    fn signals(&self, names: &[&str]) {
        let kill: String = names.iter().map(|name| format!("kill -{name} {}; ", self.0.id())).collect();
        // It may have ended already.
        let _ = Command::new("sh").args(["-c", &kill]).stderr(Stdio::null()).status().expect("a shell");
    }

    /// Exit code and stderr, which come soon.
    fn ends(&mut self) -> (Option<i32>, String) {
        let status = wait_for("the end", || self.0.try_wait().expect("a child"));
        let mut stderr = Vec::new();
        std::io::Read::read_to_end(&mut self.0.stderr.take().expect("piped"), &mut stderr).expect("read");
        (status.code(), text(&stderr))
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Every file of a cube outside `.spectile`, by its path in it.
fn arrays(cube: &Cube) -> Files {
    cube_files::arrays(cube.path())
}

/// Samples per pixel, the same in all tiles.
fn samples(cube: &Cube) -> u32 {
    let progress = cube.progress().expect("progress");
    assert_eq!((progress.tiles, progress.samples[0]), (progress.tiles_started, progress.samples[1]));
    progress.samples[0]
}

fn spectrum(cube: &Cube, x: u32, y: u32) -> Vec<f32> {
    cube.spectrum(x, y).expect("inside").expect("rendered")
}

#[test]
fn plan_says_what_a_render_takes() {
    let place = Place::new();
    let (text, stderr) = place.success(&["plan", "scene.toml", "--spp", "100"]);
    assert_eq!(stderr, "");
    for expected in
        ["24 x 20 pixels x 5 channels", "thin lens", "left out", "device", "disk", "for 128 samples per pixel"]
    {
        assert!(text.contains(expected), "{expected}: {text}");
    }
    // What users ask comes first, details where they are asked for.
    let places = ["\ntime", "\ndevice", "\nhost", "\ndisk", "\nevaluator", "\nused", "\nleft out", "\nspectra"]
        .map(|title| text.find(title).unwrap_or_else(|| panic!("{title}: {text}")));
    assert!(places.is_sorted() && text.lines().all(|line| line.chars().count() < 220), "{text}");
    let verbose = place.success(&["plan", "scene.toml", "--verbose"]).0;
    let details = ["thin lens (a pair of random numbers a path)", "lamp: within", "storage buffers at most"];
    assert!(details.iter().all(|detail| verbose.contains(detail) && !text.contains(detail)), "{verbose}");
    let done =
        place.events(&["plan", "scene.toml", "--size", "64x32", "--tile", "16", "--spp", "8"]).pop().expect("done");
    assert_eq!((&done["tiles"], &done["samples"]), (&Value::from(8), &Value::from(8)));
    let feature = |name: &str| {
        let features = done["features"].as_array().expect("features");
        features.iter().find(|f| f["name"] == name).unwrap_or_else(|| panic!("{name}"))["used"].as_bool()
    };
    assert_eq!(
        (feature("area lights"), feature("environment"), feature("thin lens")),
        (Some(true), Some(false), Some(false))
    );
    // Nothing is written, and the cube will take what was said, in whole blocks.
    assert_eq!(fs::read_dir(place.path()).expect("list").count(), 1);
    for (size, channels) in [("64x32", "5"), ("8x8", "1"), ("40x40", "3000")] {
        let count = format!("channels.equal.count={channels}");
        let scene = ["scene.toml", "--size", size, "--tile", "16", "--spp", "8", "--set", &count];
        let planned =
            place.events(&[&["plan"], &scene[..]].concat()).pop().expect("done")["disk_bytes"].as_u64().expect("bytes");
        place.success(&[&["render"], &scene[..], &["-o", "cube.zarr", "--quiet", "--overwrite"]].concat());
        let taken = blocks(&place.path().join("cube.zarr"));
        assert!((taken..taken + taken / 2).contains(&planned), "{size}: {planned} planned, {taken} taken");
    }
}

/// Bytes that a folder takes where files take whole blocks of 4 KiB and folders one.
fn blocks(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
    let each = entries.map(|path| match path.is_dir() {
        true => blocks(&path),
        false => fs::metadata(&path).expect("a file").len().div_ceil(4096) * 4096,
    });
    each.sum::<u64>() + 4096
}

#[test]
fn devices_lists_what_there_is() {
    let place = Place::new();
    let (text, stderr) = place.success(&["devices"]);
    assert!(stderr.is_empty() && text.contains("can render") && text.contains("self-test passed"), "{text}{stderr}");
    let events = place.events(&["devices"]);
    let done = events.last().expect("done");
    assert_eq!(done["adapters"].as_u64(), Some(events.len() as u64 - 1));
    let chosen = events.iter().find(|e| e["event"] == "device" && e["name"] == done["chosen"]).expect("listed");
    assert!(chosen["unusable"].is_null() && chosen["max_binding"].as_u64().is_some_and(|b| b >= 128 << 20));
    assert!(text.contains(chosen["name"].as_str().expect("a name")));
}
