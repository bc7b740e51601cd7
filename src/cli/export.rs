//! `spectile export`: a cube in somebody else's format.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use serde_json::json;

use super::Output;
use crate::cube::Cube;
use crate::format::png;
use crate::{Error, Result};

/// Write a cube, or a picture of it, in another format
///
/// png: the preview of the cube as an 8-bit sRGB picture. It shows the colours an eye would see where the channels cover
/// the visible (CIE 1931), else three channels as red, green and blue (channels.false_colour in the scene). Brighter than
/// white and colours outside the gamut of sRGB are cut; what is not rendered yet is black.
#[derive(Debug, clap::Args)]
#[command(after_long_help = "\
Examples:
  spectile export cube.zarr -o picture.png
  spectile export cube.zarr -o picture.png --exposure 1.5")]
pub struct Args {
    /// The cube, a folder
    pub cube: PathBuf,

    /// The file to write; an existing one is replaced
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,

    /// Format of the file; otherwise its extension says it
    #[arg(long, value_enum)]
    pub format: Option<Format>,

    /// Exposure of a picture in EV: every step up is twice as bright
    ///
    /// At 0 a radiance of 1 W m-2 sr-1 nm-1 in all channels is white. Without it the 99th percentile of the lit pixels
    /// is, and the exposure chosen is printed; use that for pictures that are to be compared.
    #[arg(long, value_name = "EV", value_parser = super::parse_exposure, allow_hyphen_values = true)]
    pub exposure: Option<f64>,

    /// One JSON object on stdout, instead of text
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// 8-bit sRGB picture (.png)
    Png,
    /// ENVI image and header (.img, .hdr); not supported yet
    Envi,
    /// Spectral OpenEXR (.exr); not supported yet
    Exr,
    /// Compressed Zarr v3 (.zarr); not supported yet
    Zarr,
    /// Table of spectra (.csv); not supported yet
    Csv,
}

pub fn run(args: &Args, output: &Output) -> Result<()> {
    let format = match args.format {
        Some(format) => format,
        None => guess(&args.output)?,
    };
    if format != Format::Png {
        let name = format.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default();
        return Err(Error::Usage(format!("export to {name} is not supported yet; this version writes png")));
    }
    let cube = Cube::open(&args.cube)?;
    let picture = cube.preview()?;
    let ev = args.exposure.unwrap_or_else(|| picture.auto_exposure());
    png::write(&args.output, &picture, ev)?;

    let ([width, height], progress) = (cube.header().size, cube.progress()?);
    let missing = progress.tiles - progress.tiles_started;
    let shows = super::info::shows(&cube);
    output.event(
        "done",
        json!({
            "file": args.output,
            "format": "png",
            "size": [width, height],
            "exposure_ev": ev,
            "shows": shows,
            "tiles_missing": missing,
        }),
    )?;
    let how = if args.exposure.is_some() { "as asked" } else { "99th percentile white" };
    let file = args.output.display();
    output.text(&format!("{file}: {width} x {height} pixels, {shows}, exposure {ev:+.3} EV ({how})\n"))?;
    if missing > 0 {
        output.text(&format!("{missing} of {} tiles have no samples yet and are black\n", progress.tiles))?;
    }
    Ok(())
}

/// The format that a file's extension stands for.
fn guess(path: &Path) -> Result<Format> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "png" => Ok(Format::Png),
        "img" | "hdr" | "bil" | "bip" | "bsq" => Ok(Format::Envi),
        "exr" => Ok(Format::Exr),
        "zarr" => Ok(Format::Zarr),
        "csv" => Ok(Format::Csv),
        _ => Err(Error::Usage(format!(
            "{}: the extension names no format; use .png, or say --format png",
            path.display()
        ))),
    }
}
