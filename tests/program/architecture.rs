//! Who knows whom: imports between the folders of `src/` against the list here, which is complete. An arrow that is not in it fails; so
//! does one in the list that nothing uses. None runs up, so there are no circles.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Each folder (or file) of `src/`, lowest first, and what it may import; `error`, `files` and `threads` are everywhere's.
const ARROWS: &[(&str, &[&str])] = &[
    ("error", &[]),
    ("files", &[]),
    ("threads", &[]),
    ("gpu", &[]),
    ("spectral", &[]),
    ("format", &["spectral"]),
    ("import", &["spectral", "format"]),
    ("scene", &["spectral", "format"]),
    ("reference", &["scene", "spectral"]),
    // Of gpu the type of a kernel's text alone, which has no word of wgpu.
    ("device", &["scene", "spectral", "gpu::source"]),
    ("cube", &["spectral"]),
    ("sensor", &["cube", "scene", "spectral"]),
    ("sky", &["cube", "spectral"]),
    ("export", &["cube", "format", "spectral"]),
    ("preview", &["cube", "scene", "format", "spectral"]),
    ("render", &["device", "gpu", "cube", "preview", "scene", "spectral"]),
    ("slurm", &["cube"]),
    ("report", &["render", "device", "gpu", "cube", "scene", "format"]),
    ("stress", &["report", "render", "device", "gpu", "cube", "scene", "format", "spectral"]),
    (
        "cli",
        &[
            "stress", "report", "slurm", "sky", "render", "preview", "export", "sensor", "cube", "device", "gpu",
            "import", "scene", "format", "spectral",
        ],
    ),
];

/// Where wgpu is named; tests of faults destroy devices by it.
const NAMES_WGPU: &[&str] = &["gpu/", "render/worker.rs", "render/worker/", "render/fault_tests.rs"];
/// Where memory is mapped.
const MAPS_MEMORY: &str = "cube/";

fn sources() -> Vec<(String, String)> {
    fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                walk(&path, found);
            } else if path.extension().is_some_and(|e| e == "rs") {
                found.push(path);
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = Vec::new();
    walk(&root, &mut found);
    let name = |path: &PathBuf| path.strip_prefix(&root).expect("below").to_string_lossy().into_owned();
    found.iter().map(|path| (name(path), code(&fs::read_to_string(path).expect("text")))).collect()
}

/// A file's code: without comments, and without the tests at its end.
fn code(text: &str) -> String {
    let text = text.split("\n#[cfg(test)]\nmod tests").next().unwrap_or(text);
    text.lines().map(|line| line.split("//").next().unwrap_or("")).fold(String::new(), |all, line| all + line + "\n")
}

/// The folder or file of `src/` that a file belongs to.
fn room(file: &str) -> &str {
    file.split('/').next().unwrap_or(file).trim_end_matches(".rs")
}

/// What follows `crate::` in `text`, one step and, of `gpu`, two.
fn imports(text: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for (at, _) in text.match_indices("crate::") {
        let rest = &text[at + "crate::".len()..];
        let group = rest.strip_prefix('{').and_then(|rest| rest.split('}').next());
        let paths: Vec<&str> = group.map_or_else(|| vec![rest], |group| group.split(',').map(str::trim).collect());
        for path in paths {
            let end = path.find(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':')).unwrap_or(path.len());
            found.insert(path[..end].trim_end_matches(':').to_owned());
        }
    }
    found
}

#[test]
fn imports_follow_the_list() {
    let allowed: BTreeMap<&str, &[&str]> = ARROWS.iter().copied().collect();
    let mut used: BTreeSet<(String, String)> = BTreeSet::new();
    for (file, text) in sources() {
        let from = room(&file).to_owned();
        if ["main", "lib"].contains(&from.as_str()) {
            continue;
        }
        let may = allowed.get(from.as_str()).unwrap_or_else(|| panic!("src/{from} is not in the list"));
        for path in imports(&text) {
            let to = path.split("::").next().unwrap_or_default();
            if !allowed.contains_key(to) || [from.as_str(), "error", "files", "threads"].contains(&to) {
                continue;
            }
            let arrow =
                may.iter().find(|arrow| **arrow == to || path == **arrow || path.starts_with(&format!("{arrow}::")));
            let arrow = arrow.unwrap_or_else(|| panic!("src/{file} imports {path}, and {from} may not"));
            used.insert((from.clone(), (*arrow).to_owned()));
        }
    }
    for (from, arrows) in ARROWS {
        for to in *arrows {
            assert!(
                used.contains(&((*from).to_owned(), (*to).to_owned())),
                "nothing in {from} imports {to}: strike it"
            );
        }
    }
}

/// The list itself runs down: whoever is imported stands above who imports.
#[test]
fn no_arrow_runs_up() {
    let place = |room: &str| ARROWS.iter().position(|(name, _)| *name == room).expect("in the list");
    for (from, arrows) in ARROWS {
        for to in *arrows {
            let to = to.split("::").next().expect("a room");
            assert!(place(to) < place(from), "{from} -> {to}");
        }
    }
}

#[test]
fn wgpu_and_unsafe_stay_where_they_are_known() {
    for (file, text) in sources() {
        // Strings may speak of it.
        let names_wgpu = text.contains("wgpu::");
        assert!(!names_wgpu || NAMES_WGPU.iter().any(|known| file.starts_with(known)), "src/{file} names wgpu");
        let maps = text.contains("memmap2::") || text.contains("MmapMut") || text.contains("MmapOptions");
        assert!(!maps || file.starts_with(MAPS_MEMORY), "src/{file} maps memory");
        let is_unsafe = text.contains("unsafe {") || text.contains("unsafe fn") || text.contains("unsafe impl");
        assert!(!is_unsafe || file.starts_with("cube/") || file.starts_with("gpu/"), "src/{file} has unsafe code");
    }
}

/// `reference` shares no arithmetic with what it judges: of `spectral` what is data, of `scene` the scene.
#[test]
fn the_reference_knows_no_device() {
    for (file, text) in sources().iter().filter(|(file, _)| file.starts_with("reference/")) {
        for foreign in ["device", "gpu", "render", "shaders"] {
            assert!(!text.contains(&format!("crate::{foreign}")), "src/{file} imports {foreign}");
        }
    }
}
