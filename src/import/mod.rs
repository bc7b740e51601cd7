//! Scenes of other programs as a folder of Spectile's own: a scene.toml that a person would like to edit, meshes, spectra and
//! textures beside it, and `IMPORT.md`, which tells what became of everything. Whatever changes the picture is translated,
//! approximated or left out, and said with its line.

mod combine;
mod environment;
#[cfg(test)]
mod every_approximation;
mod film;
mod geometry;
mod gltf;
mod layers;
mod media;
mod metals;
mod mitsuba;
mod pbrt;
mod picture;
mod report;
mod scene;
mod spot;
mod surfaces;
mod text;

use std::path::{Component, Path, PathBuf};

use crate::error::Problem;
use crate::files::output::{NewFolder, Product};
use crate::files::parent;
use crate::{Error, Result};

use scene::Scene;

/// What an import made. It is never replaced: somebody may have worked on it.
pub const FOLDER: Product = Product {
    name: "an imported scene",
    extensions: &[],
    is_stream: false,
    is_folder: true,
    check: |_| Err("is there already".into()),
};

/// Bounces that scene files may ask for (docs/scene.md).
const MOST_BOUNCES: f64 = 16_383.0;

/// How many things of a scene became what.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Summary {
    pub translated: usize,
    pub approximated: usize,
    pub left_out: usize,
    pub chosen: usize,
}

/// Reads `source`, whose format its name tells, and makes `folder`, which must not be there.
///
/// # Errors
/// What is wrong with the scene, with file and line; or with the folder.
pub fn import(source: &Path, folder: &Path) -> Result<Summary> {
    let extension = source.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let read = match extension.as_str() {
        "xml" => mitsuba::read,
        "pbrt" => pbrt::read,
        "gltf" | "glb" => gltf::read,
        _ => {
            return Err(Error::Usage(format!(
                "{}: scenes of Mitsuba 3 (.xml), pbrt-v4 (.pbrt) and glTF 2.0 (.gltf, .glb) are imported; this name ends \
                 otherwise",
                source.display()
            )));
        }
    };
    FOLDER.new_target(folder)?;
    let new = NewFolder::create(folder, FOLDER)?;
    let mut scene = Scene::new(new.aside());
    read(source, &mut scene)?;
    let write = |name: &str, text: String| {
        let path = new.aside().join(name);
        std::fs::write(&path, text).map_err(|error| Error::storage(&path, error))
    };
    let assemblies = scene.write_assemblies()?;
    write("scene.toml", scene.toml(source, &assemblies))?;
    write("IMPORT.md", scene.report.page(source))?;
    new.finish()?;
    Ok(scene.report.summary())
}

impl From<Box<Problem>> for Error {
    fn from(problem: Box<Problem>) -> Error {
        Error::Input(vec![*problem])
    }
}

/// The file that `name` means in `file`: in its folder or below, as scenes that people hand on have it.
///
/// # Errors
/// A sentence.
fn path_beside(file: &Path, name: &str) -> std::result::Result<PathBuf, String> {
    let relative = Path::new(name.trim());
    let stays = relative.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if !stays || name.contains('\0') || name.trim().is_empty() {
        let shown: String = name.chars().take(100).collect();
        return Err(format!(
            "\"{}\" is not in the folder of the scene: only files there are read, so copy it into it",
            shown.escape_debug()
        ));
    }
    Ok(parent(file).join(relative))
}
