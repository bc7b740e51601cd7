//! What is written once, when a cube is made: metadata, coordinates, the record. Others may add to the metadata, rewrite them
//! or bring arrays of their own; what of Spectile's is gone or broken is put back from the record.

use std::fs;
use std::path::Path;

use serde_json::{Map, Value, json};

use super::checksums;
use super::metadata::{Header, is_raw, same_layout};
use super::store::{Cube, Origin, PRIVATE, RECORD};
use crate::{Error, Result, files};

/// Metadata as a file holds them.
pub(super) fn pretty(value: &Value) -> String {
    format!("{value:#}\n")
}

/// Names and bytes of the files of all coordinates.
pub(super) fn coordinates(header: &Header) -> Vec<(&'static str, Vec<u8>)> {
    let channels = &header.channels;
    let doubles = |values: &mut dyn Iterator<Item = f64>| values.flat_map(f64::to_le_bytes).collect::<Vec<u8>>();
    let each = |value: &dyn Fn(usize) -> f64| doubles(&mut (0..channels.len()).map(value));
    let pixels = |axis: usize| pixels(header, axis, 0.0);
    vec![
        ("wavelength/c/0", each(&|k| channels.centre(k))),
        ("wavelength_bounds/c/0/0", doubles(&mut channels.bounds.iter().flatten().copied())),
        ("response_integral/c/0", each(&|k| channels.integral(k))),
        ("x/c/0", pixels(0)),
        ("y/c/0", pixels(1)),
    ]
}

/// Columns or rows on the full film, from 0, `off` from each.
fn pixels(header: &Header, axis: usize, off: f64) -> Vec<u8> {
    (0..header.size[axis]).flat_map(|i| (f64::from(header.origin[axis] + i) + off).to_le_bytes()).collect()
}

/// Whether a coordinate's file holds `bytes`, or what older cubes have there: the places of pixels' centres instead of their numbers.
fn is_coordinate(cube: &Cube, name: &str, bytes: &[u8]) -> bool {
    let older = ["x/c/0", "y/c/0"].iter().position(|pixel| *pixel == name).map(|axis| pixels(cube.header(), axis, 0.5));
    let path = cube.path().join(name);
    is_written(&path, bytes) || older.is_some_and(|older| is_written(&path, &older))
}

/// How metadata on disk stand to those that Spectile wrote.
enum Found {
    /// They say the same of the array, whatever else they say.
    Same(Value),
    /// They describe an array that is laid out otherwise.
    Other(Value),
    /// There are none, or they are none.
    Broken,
}

fn read(path: &Path, is: impl Fn(&Value) -> bool) -> Found {
    match fs::read(path).ok().and_then(|text| serde_json::from_slice::<Value>(&text).ok()) {
        Some(found) if !found.is_object() => Found::Broken,
        Some(found) if is(&found) => Found::Same(found),
        Some(found) => Found::Other(found),
        None => Found::Broken,
    }
}

fn read_array(cube: &Path, name: &str, own: &Value) -> Found {
    let is = |found: &Value| found["node_type"] == "array" && same_layout(own, found);
    read(&cube.join(name).join("zarr.json"), is)
}

fn read_group(cube: &Path) -> Found {
    read(&cube.join("zarr.json"), |found| found["node_type"] == "group" && found["zarr_format"] == 3)
}

fn is_written(path: &Path, bytes: &[u8]) -> bool {
    fs::read(path).is_ok_and(|found| found == bytes)
}

/// Compares what is written once with what it must be: how many files, and a sentence for each that is damaged. What
/// others wrote is no damage.
pub(super) fn verify(cube: &Cube) -> Result<(u64, Vec<String>)> {
    let path = cube.path();
    if let Origin::Older { .. } = cube.origin() {
        // Version 1 has a list of checksums instead of a record; of its metadata opening has read all that matters.
        let wrong = checksums::wrong_files(path);
        let list = path.join(checksums::FILE);
        let (wrong, count) = wrong.map_err(|error| Error::storage(&list, format!("cannot be read: {error}")))?;
        let wrong = wrong.into_iter().filter(|name| !name.ends_with("zarr.json"));
        return Ok((count, wrong.map(|name| not_written(&name)).collect()));
    }
    let (mut count, mut damage) = (2, Vec::new());
    let (_, arrays) = cube.header().metadata()?;
    let consolidated = match read_group(path) {
        Found::Same(found) => Some(found["consolidated_metadata"]["metadata"].clone()),
        Found::Other(_) | Found::Broken => {
            damage.push(not_written("zarr.json"));
            None
        }
    };
    for (name, own) in &arrays {
        count += 1;
        let file = format!("{name}/zarr.json");
        match read_array(path, name, own) {
            Found::Same(_) => {}
            Found::Other(_) if is_raw(name) => {
                damage.push(format!("{file} describes another layout than its files have"))
            }
            // Somebody has written these coordinates anew, in his own way.
            Found::Other(_) => continue,
            Found::Broken => damage.push(not_written(&file)),
        }
        let told = consolidated.as_ref().map_or(&Value::Null, |found| &found[*name]);
        if is_raw(name) && !told.is_null() && !same_layout(own, told) {
            damage.push(format!("zarr.json describes another layout of {name} than its files have"));
        }
    }
    for (name, bytes) in coordinates(cube.header()) {
        if is_own(path, name, &arrays) {
            count += 1;
            damage.extend((!is_coordinate(cube, name, &bytes)).then(|| not_written(name)));
        }
    }
    if !matches!(cube.origin(), Origin::Record { .. }) {
        damage.push(not_written(RECORD));
    }
    Ok((count, damage))
}

fn not_written(name: &str) -> String {
    format!("{name} is not what was written")
}

/// Whether a coordinate's file is still laid out as Spectile does it, so that it must hold what Spectile wrote.
fn is_own(cube: &Path, file: &str, arrays: &[(&'static str, Value)]) -> bool {
    let name = file.split('/').next().unwrap_or_default();
    let own = arrays.iter().find(|(array, _)| *array == name);
    own.is_some_and(|(_, own)| !matches!(read_array(cube, name, own), Found::Other(_)))
}

/// Puts back what is gone or broken, and leaves alone what others wrote. Nothing is written where all is in order.
pub(super) fn restore(cube: &Cube) -> Result<()> {
    let path = cube.path();
    let write = |name: &str, bytes: &[u8]| {
        let target = path.join(name);
        let written = files::make_folder_durably(files::parent(&target))
            .map_err(|error| files::output::cannot_write(&target, &error))
            .and_then(|()| files::write_atomically(&target, bytes));
        written
            .and_then(|()| files::sync_folder(files::parent(&target)).map_err(|error| Error::storage(&target, error)))
    };
    if !matches!(cube.origin(), Origin::Record { .. }) {
        write(RECORD, cube.header().record().as_bytes())?;
    }
    let (own_group, own_arrays) = cube.header().metadata()?;
    // Before their metadata, which decide whether they are Spectile's.
    for (name, bytes) in coordinates(cube.header()) {
        if is_own(path, name, &own_arrays) && !is_coordinate(cube, name, &bytes) {
            write(name, &bytes)?;
        }
    }
    for (name, own) in &own_arrays {
        let mended = match read_array(path, name, own) {
            Found::Same(found) => with_attributes_of(&found, own),
            Found::Other(found) if is_raw(name) => with_layout_of(&with_attributes_of(&found, own), own),
            Found::Other(_) => continue,
            Found::Broken => own.clone(),
        };
        if !matches!(read_array(path, name, own), Found::Same(found) if found == mended) {
            write(&format!("{name}/zarr.json"), pretty(&mended).as_bytes())?;
        }
    }
    let (found, mut mended) = match read_group(path) {
        Found::Same(found) => (found.clone(), with_attributes_of(&found, &own_group)),
        Found::Other(found) => (found.clone(), with_layout_of(&with_attributes_of(&found, &own_group), &own_group)),
        // Others' arrays must be seen by who reads consolidated metadata.
        Found::Broken => {
            let mut group = own_group.clone();
            if let Some(consolidated) = group["consolidated_metadata"]["metadata"].as_object_mut() {
                consolidated.extend(all_nodes(path));
            }
            (Value::Null, group)
        }
    };
    if let Some(consolidated) = mended["consolidated_metadata"]["metadata"].as_object_mut() {
        for (name, own) in &own_arrays {
            let is_whole = |told: &&Value| !is_raw(name) || same_layout(own, told);
            if consolidated.get(*name).filter(is_whole).is_none()
                && let Found::Same(found) | Found::Other(found) = read_array(path, name, own)
            {
                consolidated.insert((*name).into(), found);
            }
        }
    }
    if mended != found { write("zarr.json", pretty(&mended).as_bytes()) } else { Ok(()) }
}

/// `found` with the attributes of `own` that it lacks.
fn with_attributes_of(found: &Value, own: &Value) -> Value {
    let mut mended = found.clone();
    let attributes = own["attributes"].as_object();
    if !mended["attributes"].is_object() {
        mended["attributes"] = json!({});
    }
    for (name, value) in attributes.into_iter().flatten() {
        if mended["attributes"].get(name).is_none() {
            mended["attributes"][name] = value.clone();
        }
    }
    mended
}

/// `found` with everything of `own` but its attributes and the consolidated metadata.
fn with_layout_of(found: &Value, own: &Value) -> Value {
    let mut mended = found.clone();
    for (key, value) in own.as_object().into_iter().flatten() {
        if key != "attributes" && key != "consolidated_metadata" {
            mended[key] = value.clone();
        }
    }
    mended
}

/// The metadata of all arrays and groups below `folder`, by their paths.
fn all_nodes(folder: &Path) -> Map<String, Value> {
    fn walk(root: &Path, name: &str, found: &mut Map<String, Value>) {
        let folder = if name.is_empty() { root.to_owned() } else { root.join(name) };
        for entry in fs::read_dir(&folder).into_iter().flatten().flatten() {
            let Some(below) = entry.file_name().to_str().map(str::to_owned) else { continue };
            if below == PRIVATE || !entry.path().is_dir() {
                continue;
            }
            let below = if name.is_empty() { below } else { format!("{name}/{below}") };
            let node = fs::read(root.join(&below).join("zarr.json")).ok();
            // Below what is no node there are chunks.
            if let Some(node) = node.and_then(|text| serde_json::from_slice::<Value>(&text).ok()) {
                let is_group = node["node_type"] == "group";
                found.insert(below.clone(), node);
                if is_group {
                    walk(root, &below, found);
                }
            }
        }
    }
    let mut found = Map::new();
    walk(folder, "", &mut found);
    found
}
