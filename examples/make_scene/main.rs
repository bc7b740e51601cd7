//! Makes what the scenes in `scenes/` need and the repository does not hold: meshes, textures, maps and grids. The
//! same bytes on every run. `scenes/render NAME` calls it where they are missing.
//!
//!     cargo run --release --example make_scene -- conference scenes/conference
//!
//! reads the scene folder's `spectra/` and writes to its `generated/`.

mod aircraft;
mod conference;
mod gases;
mod image;
mod isosurface;
mod mesh;
mod plume;
mod shape;
mod sky;
mod statues;

use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [name, scene] = &arguments[..] else {
        eprintln!("usage: make_scene conference|aircraft|statues SCENE_FOLDER");
        return ExitCode::from(2);
    };
    let scene = Path::new(scene);
    let folder = &scene.join("generated");
    let made = std::fs::create_dir_all(folder).and_then(|()| match name.as_str() {
        "conference" => conference::make(folder),
        "aircraft" => aircraft::make(scene, folder),
        "statues" => statues::make(scene, folder),
        other => Err(std::io::Error::other(format!("there is no scene `{other}` to make"))),
    });
    match made {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("make_scene: {}: {error}", folder.display());
            ExitCode::FAILURE
        }
    }
}
