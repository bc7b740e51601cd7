//! Makes what the scenes in `scenes/` need and the repository does not hold: meshes, textures, maps and grids. The
//! same bytes on every run. `scenes/render NAME` calls it where they are missing.
//!
//!     cargo run --release --example make_scene -- conference scenes/conference
//!
//! reads the scene folder's `spectra/` and writes to its `generated/`.

mod aircraft;
mod cloud;
mod conference;
mod gases;
mod grove;
mod haze;
mod image;
mod isosurface;
mod lounge;
pub mod matter;
mod mesh;
mod plume;
mod shape;
mod sky;
mod statues;
mod water;

use std::io;
use std::path::Path;
use std::process::ExitCode;

pub const NAMES: [&str; 7] = ["conference", "aircraft", "statues", "haze", "cloud", "lounge", "grove"];

/// Makes what the scene in the folder `scene` needs, in its folder `generated`; or, named `matter`, what several have in common and the
/// repository holds.
pub fn make(name: &str, scene: &Path) -> io::Result<()> {
    if name == "matter" {
        return matter::make(scene);
    }
    let folder = &scene.join("generated");
    std::fs::create_dir_all(folder)?;
    match name {
        "conference" => conference::make(folder),
        "aircraft" => aircraft::make(scene, folder),
        "statues" => statues::make(scene, folder),
        "haze" => haze::make(folder),
        "cloud" => cloud::make(folder),
        "lounge" => lounge::make(folder),
        "grove" => grove::make(folder),
        _ => Err(io::Error::other(format!("there is no scene `{name}` to make"))),
    }
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [name, scene] = &arguments[..] else {
        eprintln!("usage: make_scene {} SCENE_FOLDER", NAMES.join("|"));
        return ExitCode::from(2);
    };
    match make(name, Path::new(scene)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("make_scene: {scene}: {error}");
            ExitCode::FAILURE
        }
    }
}
