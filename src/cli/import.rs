//! `spectile import`: a scene of another program as one of Spectile's.

use std::path::PathBuf;

use serde_json::json;

use super::Output;
use crate::files::shown;
use crate::{Result, import};

/// Make a scene of one by another program
///
/// The result is a folder: scene.toml, the meshes, spectra and textures that it names, and IMPORT.md, which tells with
/// file and line what was translated, what was approximated and how far off that is, what was left out, and what was
/// chosen because the scene says nothing of it. Nothing outside the folder of the scene is read, and no folder that is
/// there already is replaced.
#[derive(Debug, clap::Args)]
#[command(after_long_help = "\
Examples:
  spectile import scene.xml -o room                  a scene of Mitsuba 3
  spectile import scene.pbrt -o room                 one of pbrt-v4
  spectile import scene.glb -o room                  one of glTF 2.0
  spectile render room/scene.toml -o room.zarr       then render it
  spectile render room/scene.toml -o room.zarr --set channels.equal.count=400

Which things of which format are read is in docs/IMPORT.md.")]
pub struct Args {
    /// The scene: Mitsuba 3 (.xml), pbrt-v4 (.pbrt) or glTF 2.0 (.gltf, .glb)
    pub scene: PathBuf,

    /// The folder to make; it must not be there
    #[arg(short, long, value_name = "FOLDER")]
    pub output: PathBuf,

    /// One JSON object a line on stdout, instead of text
    #[arg(long)]
    pub json: bool,
}

pub fn run(args: &Args, output: &Output) -> Result<()> {
    let summary = import::import(&args.scene, &args.output)?;
    let fields = json!({
        "translated": summary.translated,
        "approximated": summary.approximated,
        "left_out": summary.left_out,
        "chosen": summary.chosen,
        "output": shown(&args.output),
    });
    output.event("done", fields)?;
    output.text(&format!(
        "{}: {} things translated; of {} kinds approximated, {} left out, {} chosen: see IMPORT.md there\n",
        args.output.display(),
        summary.translated,
        summary.approximated,
        summary.left_out,
        summary.chosen
    ))
}
