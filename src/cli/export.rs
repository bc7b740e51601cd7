//! `spectile export`: a cube in somebody else's format.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use serde_json::json;

use super::Output;
use super::bands::Bands;
use crate::cube::{Cube, Quantity, Rect, View};
use crate::export;
use crate::format::envi::Interleave;
use crate::format::png;
use crate::render::worker::check_interrupt;
use crate::{Error, Result, files};

/// Write a cube, or a picture of it, in another format
///
/// envi: raw numbers and a header with wavelengths, widths, units and names (ENVI, QGIS, GDAL, Spectral Python).
/// exr: spectral OpenEXR, a channel a band, and R, G, B for viewers that know nothing of spectra.
/// zarr: a compressed Zarr v3 store with coordinates (xarray); smaller than the cube, and good to read band by band.
/// csv: a line a pixel, a column a band.
/// png: the preview of the cube as an 8-bit sRGB picture. It shows the colours an eye would see where the channels cover
/// the visible (CIE 1931), else three channels as red, green and blue (channels.false_colour in the scene). Brighter than
/// white and colours outside the gamut of sRGB are cut; what is not rendered yet is black.
///
/// The numbers are those of the cube, to the last bit; memory stays small whatever the cube's size. What is not rendered
/// yet is NaN (-9999 in ENVI, which the header says; empty in CSV).
#[derive(Debug, clap::Args)]
#[command(after_long_help = "\
Examples:
  spectile export cube.zarr -o picture.png --exposure 1.5
  spectile export cube.zarr -o cube.img                                 ENVI, and cube.hdr
  spectile export cube.zarr -o thermal.exr --bands 8um..14um
  spectile export cube.zarr -o part.zarr --crop 100,100,356,356 --bands 0..50,120
  spectile export cube.zarr -o blocks --format envi --blocks 1024       a folder of files, and index.json")]
pub struct Args {
    /// The cube, a folder
    pub cube: PathBuf,

    /// The file to write; an existing one is replaced
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,

    /// Format of the file; otherwise its extension says it
    #[arg(long, value_enum)]
    pub format: Option<Format>,

    /// Only these bands: numbers from 0, half-open ranges, or wavelengths, with commas between
    ///
    /// 3 and 0..10 are channels by number, 550nm is the one that holds that wavelength, 8um..14um are all with their
    /// centres in that range. They are written in this order. For a PNG: three are shown as red, green and blue, one as
    /// grey.
    #[arg(long, value_name = "BANDS", value_parser = Bands::parse)]
    pub bands: Option<Bands>,

    /// Only the pixels of columns X0 to X1 - 1 and rows Y0 to Y1 - 1 of the cube
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = parse_crop)]
    pub crop: Option<Rect>,

    /// Radiance of the channels in W m-2 sr-1: their means times their widths (or the integrals of their responses)
    #[arg(long)]
    pub integrated: bool,

    /// Order of the numbers in an ENVI file
    #[arg(long, value_enum)]
    pub interleave: Option<Interleave>,

    /// Split an OpenEXR file by wavelength into several of at most N bands
    ///
    /// Many readers refuse files of more than 1024 channels.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub exr_split: Option<u32>,

    /// Write the unit W.m^-2.sr^-1 into an OpenEXR file, as its layout says, although values are per nanometre
    ///
    /// By default the unit is W.m^-2.sr^-1.nm^-1, which is true; some readers warn about it.
    #[arg(long)]
    pub exr_strict_units: bool,

    /// Write every chunk of a Zarr store to a file of its own
    ///
    /// By default several share one (shards), which GDAL before 3.13 cannot read.
    #[arg(long)]
    pub zarr_no_shards: bool,

    /// Write blocks of N x N pixels to files of their own in the folder FILE, with an index.json
    ///
    /// For cubes too large for one file. --format says which.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), requires = "format")]
    pub blocks: Option<u32>,

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
    /// ENVI image and header (.img or .bil, .bip, .bsq, and .hdr)
    Envi,
    /// Spectral OpenEXR (.exr)
    Exr,
    /// Compressed Zarr v3 (.zarr)
    Zarr,
    /// Table of spectra (.csv)
    Csv,
}

pub fn run(args: &Args, output: &Output) -> Result<()> {
    let format = match args.format {
        Some(format) => format,
        None => guess(&args.output)?,
    };
    check_options(args, format)?;
    let cube = Cube::open(&args.cube)?;
    if format == Format::Png {
        return write_png(args, &cube, output);
    }
    let view = view(args, &cube)?;
    let format = match format {
        Format::Envi => export::Format::Envi { interleave: interleave(args)? },
        Format::Exr => {
            let split = args.exr_split.map(|n| n as usize);
            let channels = split.unwrap_or(usize::MAX).min(view.channels().len()) + 3;
            if channels > export::WIDELY_READ {
                output.warn(&format!(
                    "{channels} channels in one OpenEXR file: OpenImageIO and what uses it read {} at most; --exr-split 1000 \
                     makes several files",
                    export::WIDELY_READ
                ))?;
            }
            export::Format::Exr { strict_units: args.exr_strict_units, split }
        }
        Format::Zarr => export::Format::Zarr { shards: !args.zarr_no_shards },
        Format::Csv | Format::Png => export::Format::Csv,
    };
    let files = write(args, &view, format)?;
    report(args, &view, &files, output)
}

/// Options that mean nothing for the format are mistakes.
fn check_options(args: &Args, format: Format) -> Result<()> {
    let given = [
        ("--interleave", args.interleave.is_some(), vec![Format::Envi]),
        ("--exr-split", args.exr_split.is_some(), vec![Format::Exr]),
        ("--exr-strict-units", args.exr_strict_units, vec![Format::Exr]),
        ("--zarr-no-shards", args.zarr_no_shards, vec![Format::Zarr]),
        ("--exposure", args.exposure.is_some(), vec![Format::Png]),
        ("--integrated", args.integrated, vec![Format::Envi, Format::Exr, Format::Zarr, Format::Csv]),
        ("--blocks", args.blocks.is_some(), vec![Format::Envi, Format::Exr, Format::Zarr, Format::Csv]),
    ];
    let name = |format: Format| format.to_possible_value().map(|v| v.get_name().to_owned()).unwrap_or_default();
    match given.iter().find(|(_, is_given, formats)| *is_given && !formats.contains(&format)) {
        None => Ok(()),
        Some((option, _, formats)) => {
            let formats: Vec<String> = formats.iter().map(|&format| name(format)).collect();
            Err(Error::Usage(format!("{option} goes with {}, not with {}", formats.join(", "), name(format))))
        }
    }
}

/// The part of the cube that is asked for.
fn view<'c>(args: &Args, cube: &'c Cube) -> Result<View<'c>> {
    let mut view = View::whole(cube);
    if let Some(bands) = &args.bands {
        let chosen = bands.resolve(cube.channels()).map_err(Error::Usage)?;
        let mut seen = std::collections::BTreeSet::new();
        if let Some(twice) = chosen.iter().find(|&&band| !seen.insert(band)) {
            return Err(Error::Usage(format!("--bands names the band {twice} twice")));
        }
        view = view.with_bands(chosen)?;
    }
    if let Some(crop) = args.crop {
        view = view.with_rect(crop)?;
    }
    let quantity = if args.integrated { Quantity::Integrated } else { Quantity::Radiance };
    Ok(view.with_quantity(quantity))
}

/// Of an ENVI file: as asked, or as its extension says.
fn interleave(args: &Args) -> Result<Interleave> {
    let extension = args.output.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let named = [Interleave::Bil, Interleave::Bip, Interleave::Bsq].into_iter().find(|i| i.name() == extension);
    match (args.interleave, named) {
        (Some(asked), Some(named)) if asked != named => Err(Error::Usage(format!(
            "{}: the extension contradicts --interleave {}",
            args.output.display(),
            asked.name()
        ))),
        (asked, named) => Ok(asked.or(named).unwrap_or(Interleave::Bil)),
    }
}

/// Writes the files, with a bar on a terminal; an interrupt leaves nothing behind.
fn write(args: &Args, view: &View, format: export::Format) -> Result<Vec<PathBuf>> {
    let interrupt = super::interrupt::watch()?;
    let bar = super::progress::bar(args.json);
    let mut progress = |done: u64, all: u64| {
        if let Some(bar) = &bar {
            bar.set_length(all);
            bar.set_position(done);
        }
        check_interrupt(&interrupt)
    };
    let result = match args.blocks {
        None => export::write(view, &args.output, format, &mut progress),
        Some(side) => {
            let extension = match format {
                export::Format::Envi { .. } => "img",
                export::Format::Exr { .. } => "exr",
                export::Format::Zarr { .. } => "zarr",
                export::Format::Csv => "csv",
            };
            export::write_blocks(view, &args.output, format, extension, side, &mut progress)
        }
    };
    if let Some(bar) = &bar {
        bar.finish_and_clear();
    }
    result
}

fn report(args: &Args, view: &View, written: &[PathBuf], output: &Output) -> Result<()> {
    let progress = view.cube().progress()?;
    let missing = progress.tiles - progress.tiles_started;
    let ([width, height], channels) = (view.size(), view.channels().len());
    let bytes: u64 = written.iter().map(|path| files::bytes_of(path)).sum();
    output.event(
        "done",
        json!({
            "file": args.output,
            "files": written,
            "size": [width, height],
            "bands": channels,
            "integrated": args.integrated,
            "bytes": bytes,
            "tiles_missing": missing,
        }),
    )?;
    let names: Vec<String> = written.iter().map(|path| path.display().to_string()).collect();
    let bytes = files::format_bytes(bytes);
    output.text(&format!("{}: {width} x {height} pixels x {channels} bands, {bytes}\n", names.join(", ")))?;
    if missing > 0 {
        output.text(&format!("{missing} of {} tiles have no samples yet\n", progress.tiles))?;
    }
    Ok(())
}

fn write_png(args: &Args, cube: &Cube, output: &Output) -> Result<()> {
    let picture = cube.preview()?;
    let ev = args.exposure.unwrap_or_else(|| picture.auto_exposure());
    png::write(&args.output, &picture, ev)?;

    let ([width, height], progress) = (cube.header().size, cube.progress()?);
    let missing = progress.tiles - progress.tiles_started;
    let shows = super::info::shows(cube);
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
            "{}: the extension names no format; use .png, .img, .exr, .zarr or .csv, or say --format",
            path.display()
        ))),
    }
}

fn parse_crop(text: &str) -> std::result::Result<Rect, String> {
    let numbers: Option<Vec<u32>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x0, y0, x1, y1]) if x0 < x1 && y0 < y1 => Ok(Rect { x0, y0, x1, y1 }),
        _ => Err("a crop is X0,Y0,X1,Y1 in whole pixels with X0 < X1 and Y0 < Y1, such as 0,0,64,64".into()),
    }
}
