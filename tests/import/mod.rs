//! `spectile import`: what scenes of other programs become.

mod as_mitsuba;
mod deviations;
mod gltf;
mod media;
mod mitsuba;
mod mitsuba_xml;
mod numbers;
mod pbrt;
mod round_trip;
mod spoilt;

use std::path::{Path, PathBuf};

use spectile::scene::{self, Scene};
use tempfile::TempDir;

use crate::binary::repository;
use crate::report::excuse;

/// A scene by others that lies beside the repository.
fn others(name: &str) -> Option<PathBuf> {
    let path = repository("../shared/import").join(name);
    if !path.exists() {
        excuse(&format!("there is no {}", path.display()));
        return None;
    }
    Some(path)
}

/// What an import of a file made: its scene and its page.
struct Imported {
    folder: TempDir,
    scene: Scene,
    toml: String,
    page: String,
}

fn import(source: &Path) -> Imported {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    spectile::import::import(source, &out).unwrap_or_else(|e| panic!("{}: {e}", source.display()));
    let file = out.join("scene.toml");
    let scene = scene::load(&file, &[]).unwrap_or_else(|e| panic!("{}: {e}", source.display()));
    let read = |name: &str| std::fs::read_to_string(out.join(name)).expect("text");
    Imported { scene, toml: read("scene.toml"), page: read("IMPORT.md"), folder }
}

/// A file of this name and content, and the folder that it is in.
fn written(name: &str, content: &str) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    std::fs::write(&path, content).expect("written");
    (folder, path)
}
