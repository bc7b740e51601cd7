//! An export in many files, a block of pixels each, for cubes that no single file can hold; with an index of them.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::{Format, Progress, units, write as write_file};
use crate::Result;
use crate::cube::{Rect, View};
use crate::files::output::only_holds;
use crate::files::output::{NewFolder, Product};
use crate::files::write_atomically;

/// What [`write`] writes.
pub const BLOCKS: Product =
    Product { name: "a folder of blocks", extensions: &[], is_stream: false, is_folder: true, check: is_blocks };

const INDEX: &str = "index.json";
const ABOUT: &str =
    "blocks of one picture: columns x[0] to x[1] - 1 and rows y[0] to y[1] - 1 of the full film, from the top left";

/// Whether the folder has an index of blocks, and holds nothing that is not in it.
fn is_blocks(folder: &Path) -> std::result::Result<(), String> {
    let text = fs::read(folder.join(INDEX)).map_err(|_| format!("holds no {INDEX}"))?;
    let index: Value = serde_json::from_slice(&text).map_err(|_| format!("holds an {INDEX} of something else"))?;
    if index["about"] != ABOUT {
        return Err(format!("holds an {INDEX} of something else"));
    }
    let blocks = index["blocks"].as_array().into_iter().flatten();
    let mut known: BTreeSet<&str> =
        blocks.flat_map(|b| b["files"].as_array()).flatten().flat_map(Value::as_str).collect();
    known.insert(INDEX);
    only_holds(folder, |name| known.contains(name))
}

/// Writes blocks of `side` pixels a side, those at the right and the bottom smaller, and `index.json`, into the folder
/// `path`, new or one of the same kind that is replaced.
pub fn write(view: &View, path: &Path, format: Format, side: u32, progress: &mut Progress) -> Result<Vec<PathBuf>> {
    let folder = NewFolder::create(path, BLOCKS)?;
    let (rect, channels) = (view.rect(), view.channels());
    let [left, top] = view.cube().header().origin;
    let mut blocks = Vec::new();
    let mut done = 0;
    for y0 in (rect.y0..rect.y1).step_by(side as usize) {
        for x0 in (rect.x0..rect.x1).step_by(side as usize) {
            let (x1, y1) = (x0.saturating_add(side).min(rect.x1), y0.saturating_add(side).min(rect.y1));
            let block = view.clone().with_rect(Rect { x0, y0, x1, y1 })?;
            let (x, y) = (left + x0, top + y0);
            let name = format!("x{x:06}_y{y:06}.{}", format.extension());
            let mut tell = |of_block: u64, _: u64| progress(done + of_block, rect.pixels());
            let files = write_file(&block, &folder.aside().join(name), format, &mut tell)?;
            done += block.rect().pixels();
            let names: Vec<_> =
                files.iter().map(|file| file.file_name().unwrap_or_default().to_string_lossy()).collect();
            blocks.push(json!({ "files": names, "x": [x, left + x1], "y": [y, top + y1] }));
        }
    }
    let bands = (0..channels.len()).map(|k| {
        json!({
            "name": channels.names[k],
            "wavelength_nm": channels.centre(k),
            "bounds_nm": channels.bounds[k],
            "response_integral_nm": channels.integral(k),
        })
    });
    let index = json!({
        "about": ABOUT,
        "size": view.size(),
        "origin": view.origin(),
        "block": side,
        "units": units(view),
        "bands": bands.collect::<Vec<_>>(),
        "blocks": blocks,
    });
    write_atomically(&folder.aside().join(INDEX), format!("{index:#}\n").as_bytes())?;
    folder.finish()?;
    Ok(vec![path.to_owned()])
}
