//! The scene loader from outside: what good scenes resolve to, number by number, what is said about wrong ones, and
//! that nothing makes it panic.

mod assemblies;
mod cameras;
mod heat;
mod lights;
mod materials;
mod media;
mod meshes;
mod never_panics;
mod quantities;
mod resolved;
mod sun;
mod textures;
mod wrong;

use spectile::Result;
use spectile::scene::{self, Scene};

/// A scene with one of everything that the cases below spoil.
const BASE: &str = r#"
[camera.perspective]
position = [0.0, 0.0, 5.0]
look_at = [0.0, 0.0, 0.0]
up = [0.0, 1.0, 0.0]
fov = 60.0

[film]
width = 40
height = 20

[channels]
equal = { from = 400.0, to = 700.0, count = 3 }

[integrator]
max_bounces = 4

[spectra.grey]
constant = 0.5

[spectra.lamp]
blackbody = 3000

[materials.white.diffuse]
reflectance = "grey"

[materials.soot.black]

[[objects]]
quad = { corner = [0, 0, 0], edge_u = [2, 0, 0], edge_v = [0, 3, 0] }
material = "white"

[[objects]]
mesh = "tri.obj"
material = "soot"
emission = "lamp"

[environment]
radiance = 0.25
"#;

const TRIANGLE: &str = "o part\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl white\nf 1 2 3\n";

/// A folder with the scene's files.
pub fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a temporary folder");
    for (name, text) in [("tri.obj", TRIANGLE)].iter().chain(files) {
        std::fs::write(dir.path().join(name), text).expect("a file in it");
    }
    dir
}

fn overrides(sets: &[(&str, &str)]) -> Vec<(String, String)> {
    sets.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect()
}

fn parse_with(text: &str, files: &[(&str, &str)], sets: &[(&str, &str)]) -> Result<Scene> {
    let dir = folder(files);
    scene::parse(text, &dir.path().join("scene.toml"), &overrides(sets))
}

#[track_caller]
fn good(text: &str, files: &[(&str, &str)], sets: &[(&str, &str)]) -> Scene {
    parse_with(text, files, sets).unwrap_or_else(|e| panic!("{e}"))
}

/// The base scene with `from` replaced by `to`.
#[track_caller]
fn changed(from: &str, to: &str) -> String {
    assert_eq!(BASE.matches(from).count(), 1, "{from:?} must be in the base scene once");
    BASE.replace(from, to)
}
