//! `spectile export`: a cube in somebody else's format.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use serde_json::{Value, json};

use super::Output;
use super::bands::Bands;
use crate::cube::{Cube, Layer, Quantity, Rect, View, White};
use crate::export::layers::{self, LayerView};
use crate::export::{self, Shown};
use crate::format::envi::{self, Interleave};
use crate::format::png::PICTURE;
use crate::spectral::Channels;
use crate::spectral::colour::{Observer, Projection};
use crate::spectral::temperature::{THERMAL_NM, is_thermal};
use crate::spectral::tone::Tone;
use crate::{Error, Result, files, scene};

/// Write a cube, or a picture of it, in another format
///
/// envi: raw numbers and a header with wavelengths, widths, units and names (ENVI, QGIS, GDAL, Spectral Python).
/// exr: spectral OpenEXR, a channel a band, and R, G, B for viewers that know nothing of spectra.
/// zarr: a compressed Zarr v3 store with coordinates (xarray); smaller than the cube, and good to read band by band.
/// tif: GeoTIFF, 32-bit numbers band by band (QGIS, GDAL); with its place on a map where the scene has a georeference.
/// csv: a line a pixel, a column a band.
/// png: the preview of the cube as an 8-bit sRGB picture. It shows the colours an eye would see where the channels cover
/// the visible (CIE 1931), else three channels as red, green and blue (channels.false_colour in the scene). Other colours:
/// --bands, --observer, --temperature, --colour-map. Brighter than white and colours outside the gamut of sRGB are cut; what
/// is not rendered yet is black.
///
/// The numbers are those of the cube, to the last bit; memory stays small whatever the cube's size. What is not rendered
/// yet is NaN (-9999 in ENVI, which the header says; empty in CSV).
#[derive(Debug, clap::Args)]
#[command(after_long_help = "\
Examples:
  spectile export cube.zarr -o picture.png --exposure 1.5
  spectile export cube.zarr -o near.png --bands 860nm,650nm,550nm       false colours
  spectile export cube.zarr -o heat.png --bands 8um..14um --temperature brightness temperature
  spectile export cube.zarr -o cube.img                                 ENVI, and cube.hdr
  spectile export cube.zarr -o thermal.exr --bands 8um..14um
  spectile export cube.zarr -o part.zarr --crop 100,100,356,356 --bands 0..50,120
  spectile export cube.zarr -o - --format csv --bands 550nm | head      to a pipe
  spectile export cube.zarr -o blocks --format envi --blocks 1024       a folder of files, and index.json")]
pub struct Args {
    /// The cube, a folder
    pub cube: PathBuf,

    /// The file to write; - is the standard output
    ///
    /// A new name, or a file of the same format, which is replaced; through a link the file behind it. CSV and PNG may go to a
    /// pipe, a device or the standard output too. Nothing else is ever replaced.
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,

    /// Format of the file; otherwise its extension says it
    #[arg(long, value_enum)]
    pub format: Option<Format>,

    /// Only these bands: names, numbers from 0, half-open ranges, or wavelengths, with commas between
    ///
    /// B4 is the band of that name (a name that is a number comes before the number), 3 and 0..10 are channels by number,
    /// 550nm is the one whose centre is nearest, 8um..14um are all with their centres in that range. They are written in
    /// this order. For a PNG: three are shown as red, green and blue, one as grey.
    #[arg(long, value_name = "BANDS", value_parser = Bands::parse)]
    pub bands: Option<Bands>,

    /// Only the pixels of columns X0 to X1 - 1 and rows Y0 to Y1 - 1 of the cube
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = parse_crop)]
    pub crop: Option<Rect>,

    /// Brightness temperatures in K: of the black body with the radiance of each channel
    ///
    /// Channels below 2.5 um are refused unless --bands names them: what is seen there is light, not how warm something is.
    /// For a PNG: of the chosen bands together, in a perceptually uniform colour map.
    #[arg(long, conflicts_with_all = ["integrated", "xyz", "standard_error"])]
    pub temperature: bool,

    /// Reflectance factors instead of radiances, relative to WHITE
    ///
    /// WHITE is a cube of the same view and channels in which what is seen is diffuse and white (reflectance 1): the factor is the
    /// radiance over that of the white, at each pixel. Or it is an irradiance E: a file, am0, am1.5, a number or a table as in
    /// scenes, such as '{ file = "sun.csv", column = "global" }'; the factor is then pi L / E. Both are hemispherical-directional
    /// reflectance factors. NaN where the white is black.
    #[arg(long, value_name = "WHITE", conflicts_with_all = ["integrated", "xyz", "temperature", "standard_error"])]
    pub reflectance: Option<String>,

    /// Layers of the cube instead of radiances: depth, normal, object, material, coordinates, sun, separated by commas
    ///
    /// Of a cube that was rendered with --layers, into ENVI, OpenEXR or CSV: a band for each number, named depth, normal.x and so on.
    /// Where nothing is seen it is NaN (-9999 in ENVI, empty in CSV). A cube is a Zarr store already, and holds them as arrays.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = super::render::parse_layer)]
    #[arg(conflicts_with_all = ["bands", "temperature", "reflectance", "xyz", "standard_error", "integrated", "blocks", "statistics", "exr_split",
                           "exr_strict_units"])]
    pub layers: Vec<Layer>,

    /// X, Y and Z instead of the bands, for the standard observer of this year
    ///
    /// Divided by the integral of ybar: a constant 1 W m-2 sr-1 nm-1 has Y = 1.
    #[arg(long, value_enum, value_name = "OBSERVER", num_args = 0..=1, default_missing_value = "1931")]
    #[arg(conflicts_with_all = ["bands", "integrated"])]
    pub xyz: Option<Observer>,

    /// The standard errors of the values instead of these, from a cube that was rendered with --uncertainty
    ///
    /// A Zarr store gets both without asking.
    #[arg(long, conflicts_with = "xyz")]
    pub standard_error: bool,

    /// A line a band instead of a line a pixel, in CSV: how many pixels are rendered, and of their values least, greatest, mean and standard
    /// deviation
    ///
    /// Of the bands, pixels and quantity that are asked for.
    #[arg(long, conflicts_with = "blocks")]
    pub statistics: bool,

    /// Radiance of the channels in W m-2 sr-1: their means times their widths (or the integrals of their responses)
    ///
    /// For a PNG: of the bands chosen, or of all in a colour map.
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

    /// Colours as the standard observer of this year sees them, in a picture
    #[arg(long, value_enum, conflicts_with = "bands")]
    pub observer: Option<Observer>,

    /// Show the bands of a picture together, in a perceptually uniform colour map
    #[arg(long)]
    pub colour_map: bool,

    /// Ends of the colour map: W m-2 sr-1 nm-1 (W m-2 sr-1 with --integrated), or K with --temperature
    ///
    /// Without it they are the 1st and the 99th percentile of what is above zero, and are printed.
    #[arg(long, value_name = "FROM..TO", value_parser = parse_range, allow_hyphen_values = true)]
    pub range: Option<[f64; 2]>,

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
    /// GeoTIFF (.tif)
    Tif,
    /// Table of spectra (.csv)
    Csv,
}

pub fn run(args: &Args, output: &Output) -> Result<()> {
    let format = match args.format {
        Some(format) => format,
        None => guess(&args.output)?,
    };
    check_options(args, format)?;
    let to_standard_output = match format {
        Format::Png => PICTURE.is_standard_output(&args.output),
        Format::Csv => export::TABLE.is_standard_output(&args.output),
        _ => false,
    };
    if to_standard_output && args.json {
        return Err(Error::Usage("--json and -o -: only one of them can have the standard output".into()));
    }
    let output = &Said { output, aside: to_standard_output };
    let cube = Cube::open_picture(&args.cube)?;
    if cube.is_counts() {
        refuse_of_counts(args)?;
    }
    if args.temperature && args.bands.is_none() {
        refuse_without_heat(&args.cube, &cube)?;
    }
    if format == Format::Png {
        PICTURE.check_target(&args.output)?;
        return write_png(args, &cube, output);
    }
    if !args.layers.is_empty() {
        return write_layers(args, &cube, format, output);
    }
    let mut view = view(args, &cube, output)?;
    let white_cube;
    if let Some(written) = &args.reflectance {
        let path = Path::new(written);
        let white = if path.is_dir() || path.extension().is_some_and(|e| e == "zarr") {
            white_cube = Cube::open_to_read(path)?;
            White::Cube(&white_cube)
        } else {
            White::Irradiance(irradiances(written, cube.channels(), output)?)
        };
        view = view.with_reflectance(white)?;
    }
    let format = match format {
        Format::Envi => export::Format::Envi { interleave: interleave(args)? },
        Format::Exr => {
            let split = args.exr_split.map(|n| n as usize);
            let channels = split.unwrap_or(usize::MAX).min(view.channels().len()) + 3;
            if channels > export::WIDELY_READ {
                output.output.warn(&format!(
                    "{channels} channels in one OpenEXR file: OpenImageIO and what uses it read {} at most; --exr-split 1000 \
                     makes several files",
                    export::WIDELY_READ
                ))?;
            }
            export::Format::Exr { strict_units: args.exr_strict_units, split }
        }
        Format::Zarr => export::Format::Zarr { shards: !args.zarr_no_shards },
        Format::Csv if args.statistics => export::Format::Statistics,
        Format::Tif => export::Format::Tiff,
        Format::Csv | Format::Png => export::Format::Csv,
    };
    match args.blocks {
        Some(_) => export::BLOCKS.check_target(&args.output)?,
        None => format.check_target(&args.output)?,
    }
    // Before anything is written: it fails where a file of the cube is gone.
    let missing = cube.progress()?.tiles_missing();
    let files = write(args, &view, format, output)?;
    if let (export::Format::Envi { .. }, None) = (format, args.blocks)
        && let Some(other) = export::other_header(&args.output)
    {
        output.output.warn(&format!(
            "{} is there too: GDAL and QGIS read it instead of the header just written; remove it if it is not meant",
            other.display()
        ))?;
    }
    if let (export::Format::Envi { .. } | export::Format::Exr { .. }, None) = (format, args.blocks)
        && let Some([header, image]) = export::header_beside_exr(&args.output)
    {
        output.output.warn(&format!(
            "{} and {} have one name: a GDAL that cannot read OpenEXR opens the latter as ENVI data, which it is not; give them \
             different names if other programs read them",
            header.display(),
            image.display()
        ))?;
    }
    if let (export::Format::Envi { .. }, Some((crs, affine))) = (format, view.georeference()) {
        let is_placed =
            envi::map_info(crs, affine).is_some_and(|info| !info.contains("Arbitrary")) || !crs.starts_with("EPSG:");
        if !is_placed {
            output.output.warn(&format!(
                "an ENVI header has no word for {crs} and where the picture lies in it: a GeoTIFF (.tif) says both"
            ))?;
        }
    }
    report(args, &view, format, &files, missing, output)
}

/// What is said about an export: beside it, where that itself has the standard output.
struct Said<'a> {
    output: &'a Output,
    aside: bool,
}

impl Said<'_> {
    fn text(&self, text: &str) -> Result<()> {
        if !self.aside {
            return self.output.text(text);
        }
        self.output.say(text.trim_end());
        Ok(())
    }

    fn event(&self, event: &str, fields: Value) -> Result<()> {
        self.output.event(event, fields)
    }
}

/// Refuses what is asked of counts and can be had of radiance only.
fn refuse_of_counts(args: &Args) -> Result<()> {
    let asked = [
        ("--temperature", args.temperature),
        ("--integrated", args.integrated),
        ("--xyz", args.xyz.is_some()),
        ("--observer", args.observer.is_some()),
        ("--reflectance", args.reflectance.is_some()),
        ("--standard-error", args.standard_error),
        ("--layers", !args.layers.is_empty()),
    ];
    match asked.into_iter().find(|(_, is_asked)| *is_asked) {
        None => Ok(()),
        Some((option, _)) => {
            let what =
                format!("holds counts of a sensor: {option} is about radiance, of the cube that they were made of");
            Err(Error::Usage(format!("{} {what}", args.cube.display())))
        }
    }
}

/// Refuses to tell temperatures of channels in which no heat is seen.
fn refuse_without_heat(path: &Path, cube: &Cube) -> Result<()> {
    let channels = cube.channels();
    let cold: Vec<usize> = (0..channels.len()).filter(|&k| !is_thermal(channels, k)).collect();
    let Some(&first) = cold.first() else { return Ok(()) };
    let from = THERMAL_NM / 1000.0;
    let instead = match (0..channels.len())
        .filter(|&k| is_thermal(channels, k))
        .map(|k| channels.bounds[k][1])
        .reduce(f64::max)
    {
        Some(to) => format!("choose the others, with --bands {from}um..{}um", (to / 1000.0).ceil()),
        None => "its channels are all of that kind".to_owned(),
    };
    Err(Error::Usage(format!(
        "{}: no heat is seen in {} of its {} channels, such as {}, which lie below {from} um: a temperature of them says nothing; \
         {instead}, or name those that are meant with --bands",
        path.display(),
        cold.len(),
        channels.len(),
        channels.names[first]
    )))
}

/// Options that mean nothing for the format are mistakes.
fn check_options(args: &Args, format: Format) -> Result<()> {
    let given = [
        ("--interleave", args.interleave.is_some(), vec![Format::Envi]),
        ("--reflectance", args.reflectance.is_some(), vec![Format::Envi, Format::Zarr, Format::Tif, Format::Csv]),
        ("--statistics", args.statistics, vec![Format::Csv]),
        ("--layers", !args.layers.is_empty(), vec![Format::Envi, Format::Exr, Format::Csv]),
        ("--exr-split", args.exr_split.is_some(), vec![Format::Exr]),
        ("--exr-strict-units", args.exr_strict_units, vec![Format::Exr]),
        ("--zarr-no-shards", args.zarr_no_shards, vec![Format::Zarr]),
        ("--exposure", args.exposure.is_some(), vec![Format::Png]),
        ("--observer", args.observer.is_some(), vec![Format::Png]),
        ("--colour-map", args.colour_map, vec![Format::Png]),
        ("--range", args.range.is_some(), vec![Format::Png]),
        ("--xyz", args.xyz.is_some(), vec![Format::Envi, Format::Zarr, Format::Tif, Format::Csv]),
        ("--temperature", args.temperature, vec![Format::Png, Format::Envi, Format::Zarr, Format::Tif, Format::Csv]),
        (
            "--standard-error",
            args.standard_error,
            vec![Format::Envi, Format::Exr, Format::Zarr, Format::Tif, Format::Csv],
        ),
        (
            "--integrated",
            args.integrated,
            vec![Format::Png, Format::Envi, Format::Exr, Format::Zarr, Format::Tif, Format::Csv],
        ),
        ("--blocks", args.blocks.is_some(), vec![Format::Envi, Format::Exr, Format::Zarr, Format::Tif, Format::Csv]),
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

/// The means of an irradiance over the channels; where nothing arrives is said.
fn irradiances(written: &str, channels: &Channels, output: &Said) -> Result<Vec<f64>> {
    let (curve, warnings) = scene::irradiance("--reflectance", written, channels)?;
    warnings.iter().try_for_each(|warning| output.output.warn(warning))?;
    let means: Vec<f64> = (0..channels.len()).map(|k| channels.mean_of(k, &curve)).collect();
    let dark = means.iter().filter(|mean| **mean <= 0.0).count();
    if dark == means.len() {
        let what = format!("--reflectance {written}: nothing arrives in any channel of the cube");
        return Err(Error::Usage(what));
    }
    if dark > 0 {
        let what = format!("--reflectance {written}: nothing arrives in {dark} of {} channels: NaN there", means.len());
        output.output.warn(&what)?;
    }
    Ok(means)
}

/// The channels that are asked for; what might have been meant otherwise is said.
fn choose(bands: &Bands, cube: &Cube, output: &Said) -> Result<Vec<usize>> {
    let chosen = bands.resolve(cube.channels()).map_err(Error::Usage)?;
    chosen.notes.iter().try_for_each(|note| output.output.warn(note))?;
    Ok(chosen.channels)
}

/// The part of the cube that is asked for.
fn view<'c>(args: &Args, cube: &'c Cube, output: &Said) -> Result<View<'c>> {
    let mut view = View::whole(cube);
    if let Some(bands) = &args.bands {
        let chosen = choose(bands, cube, output)?;
        let mut seen = std::collections::BTreeSet::new();
        if let Some(twice) = chosen.iter().find(|&&band| !seen.insert(band)) {
            return Err(Error::Usage(format!("--bands names the band {twice} twice")));
        }
        view = view.with_bands(chosen)?;
    }
    if let Some(crop) = args.crop {
        view = view.with_rect(crop)?;
    }
    if args.standard_error {
        view = view.of_errors()?;
    }
    view.with_quantity(match (args.xyz, args.temperature, args.integrated) {
        (Some(observer), ..) => Quantity::Xyz(observer),
        (_, true, _) => Quantity::Temperature,
        (.., true) => Quantity::Integrated,
        _ => Quantity::Radiance,
    })
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
fn write(args: &Args, view: &View, format: export::Format, output: &Said) -> Result<Vec<PathBuf>> {
    super::progress::watched(output.output, |progress| match args.blocks {
        None => export::write(view, &args.output, format, progress),
        Some(side) => export::write_blocks(view, &args.output, format, side, progress),
    })
}

fn report(
    args: &Args,
    view: &View,
    format: export::Format,
    written: &[PathBuf],
    [missing, tiles]: [u32; 2],
    output: &Said,
) -> Result<()> {
    let ([width, height], channels) = (view.size(), view.channels().len());
    // Through a link the file behind it was written.
    let bytes: u64 =
        written.iter().map(|path| files::bytes_of(&path.canonicalize().unwrap_or_else(|_| path.clone()))).sum();
    output.event(
        "done",
        json!({
            "file": files::shown(&args.output),
            "format": format.name(),
            "files": written.iter().map(|path| files::shown(path)).collect::<Vec<_>>(),
            "size": [width, height],
            "bands": channels,
            "integrated": args.integrated,
            "bytes": bytes,
            "tiles_missing": missing,
        }),
    )?;
    let names: Vec<String> = written.iter().map(|path| path.display().to_string()).collect();
    // What went through a pipe has left no file.
    let bytes = if bytes > 0 { format!(", {}", files::format_bytes(bytes)) } else { String::new() };
    output.text(&format!("{}: {width} x {height} pixels x {channels} bands{bytes}\n", names.join(", ")))?;
    if missing > 0 {
        output.text(&format!("{missing} of {tiles} tiles have no samples yet\n"))?;
    }
    Ok(())
}

/// Writes layers instead of radiances.
fn write_layers(args: &Args, cube: &Cube, format: Format, output: &Said) -> Result<()> {
    if args.interleave.is_some_and(|interleave| interleave != Interleave::Bil) {
        return Err(Error::Usage("--layers are written by lines: leave --interleave out, or say bil".into()));
    }
    let view = LayerView::new(cube, &args.layers, args.crop)?;
    let (of_layers, format) = match format {
        Format::Envi => (layers::Format::Envi, export::Format::Envi { interleave: Interleave::Bil }),
        Format::Exr => (layers::Format::Exr, export::Format::Exr { strict_units: false, split: None }),
        _ => (layers::Format::Csv, export::Format::Csv),
    };
    format.check_target(&args.output)?;
    let missing = cube.progress()?.tiles_missing();
    let written =
        super::progress::watched(output.output, |progress| layers::write(&view, &args.output, of_layers, progress))?;
    let ([width, height], names) = (view.size(), view.names());
    output.event(
        "done",
        json!({
            "file": files::shown(&args.output),
            "format": format.name(),
            "files": written.iter().map(|path| files::shown(path)).collect::<Vec<_>>(),
            "size": [width, height],
            "layers": names,
            "tiles_missing": missing[0],
        }),
    )?;
    let files: Vec<String> = written.iter().map(|path| path.display().to_string()).collect();
    output.text(&format!("{}: {width} x {height} pixels, {}\n", files.join(", "), names.join(", ")))
}

fn write_png(args: &Args, cube: &Cube, output: &Said) -> Result<()> {
    let usage = |what: String| Error::Usage(format!("{}: {what}", args.cube.display()));
    let mut view = View::whole(cube);
    if let Some(crop) = args.crop {
        view = view.with_rect(crop)?;
    }
    let bands = args.bands.as_ref().map(|bands| choose(bands, cube, output)).transpose()?;
    if args.temperature || args.colour_map {
        if let Some(option) = args.observer.map(|_| "--observer").or(args.exposure.map(|_| "--exposure")) {
            return Err(usage(format!("{option} means nothing in a colour map; --range gives its ends")));
        }
        if let Some(bands) = bands {
            view = view.with_bands(bands)?;
        }
        return write_map(args, &view, output);
    }
    if args.range.is_some() {
        return Err(usage("--range goes with --temperature or --colour-map".into()));
    }
    if args.integrated && bands.is_none() {
        let what = "--integrated goes with --bands or --colour-map in a picture; the colours of all channels are integrals already";
        return Err(usage(what.into()));
    }
    let (shown, shows) = match (bands.as_deref(), args.observer) {
        (None, None) => (Shown::Preview, super::info::shows(cube)),
        (None, Some(observer)) => {
            let seen = Projection::as_seen(cube.channels(), observer);
            let seen = seen.ok_or_else(|| usage("its channels do not cover the visible; choose --bands".into()))?;
            (Shown::Colours(seen), format!("colours as seen ({}, sRGB)", observer.name()))
        }
        (Some(bands), _) => {
            let (rgb, how) = match *bands {
                [grey] => ([grey; 3], format!("{} in grey", cube.channels().names[grey])),
                [r, g, b] => {
                    let name = |k: usize| cube.channels().names[k].as_str();
                    let how = format!("{} as red, {} as green, {} as blue", name(r), name(g), name(b));
                    ([r, g, b], format!("false colours: {how}"))
                }
                _ => {
                    let what = format!(
                        "a picture shows one band or three, but --bands names {}; --colour-map or --temperature shows several \
                         together",
                        bands.len()
                    );
                    return Err(usage(what));
                }
            };
            let colours = Projection::false_colour(rgb);
            match args.integrated {
                true => (Shown::Colours(colours.times(|k| cube.channels().integral(k))), format!("{how}, integrated")),
                false => (Shown::Colours(colours), how),
            }
        }
    };
    let missing = cube.progress()?.tiles_missing();
    let tone = picture(args, &view, &shown, args.exposure.map(Tone::Exposure), output)?;
    let Tone::Exposure(ev) = tone else { return Err(Error::Internal("colours have an exposure".into())) };
    output.event(
        "done",
        json!({
            "file": files::shown(&args.output),
            "format": "png",
            "size": view.size(),
            "exposure_ev": ev,
            "shows": shows,
            "tiles_missing": missing[0],
        }),
    )?;
    let how = if args.exposure.is_some() { "as asked" } else { "99th percentile white" };
    let (file, [width, height]) = (args.output.display(), view.size());
    output.text(&format!("{file}: {width} x {height} pixels, {shows}, exposure {ev:+.3} EV ({how})\n"))?;
    say_missing(missing, output)
}

/// Writes a picture, with a bar on a terminal; an interrupt leaves nothing behind.
fn picture(args: &Args, view: &View, shown: &Shown, tone: Option<Tone>, output: &Said) -> Result<Tone> {
    super::progress::watched(output.output, |progress| export::write_png(view, &args.output, shown, tone, progress))
}

/// A colour map of the bands of `view` together.
fn write_map(args: &Args, view: &View, output: &Said) -> Result<()> {
    let (map, of, unit) = match (args.temperature, args.integrated) {
        (true, _) => (export::Map::Temperature, "brightness temperature", "K"),
        (_, true) => (export::Map::Integrated, "radiance", "W m-2 sr-1"),
        _ if view.cube().is_counts() => (export::Map::Radiance, "mean counts", "counts"),
        _ => (export::Map::Radiance, "mean radiance", "W m-2 sr-1 nm-1"),
    };
    let missing = view.cube().progress()?.tiles_missing();
    let tone = picture(args, view, &Shown::Map(map), args.range.map(Tone::Range), output)?;
    let Tone::Range(range) = tone else { return Err(Error::Internal("a colour map has ends".into())) };
    let channels = view.channels();
    let from = channels.bounds.iter().map(|b| b[0]).fold(f64::INFINITY, f64::min);
    let to = channels.bounds.iter().map(|b| b[1]).fold(f64::NEG_INFINITY, f64::max);
    let shows = format!("{of} of {} bands, {from} to {to} nm", channels.len());
    output.event(
        "done",
        json!({
            "file": files::shown(&args.output),
            "format": "png",
            "size": view.size(),
            "range": range,
            "range_units": unit,
            "shows": shows,
            "tiles_missing": missing[0],
        }),
    )?;
    let how = if args.range.is_some() { "as asked" } else { "1st to 99th percentile" };
    let (file, [width, height], [low, high]) = (args.output.display(), view.size(), range);
    output.text(&format!("{file}: {width} x {height} pixels, {shows}, {low:.6} to {high:.6} {unit} ({how})\n"))?;
    say_missing(missing, output)
}

fn say_missing([missing, tiles]: [u32; 2], output: &Said) -> Result<()> {
    if missing == 0 {
        return Ok(());
    }
    output.text(&format!("{missing} of {tiles} tiles have no samples yet and are black\n"))
}

/// The format that a file's extension stands for.
fn guess(path: &Path) -> Result<Format> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "png" => Ok(Format::Png),
        "img" | "hdr" | "bil" | "bip" | "bsq" => Ok(Format::Envi),
        "exr" => Ok(Format::Exr),
        "zarr" => Ok(Format::Zarr),
        "tif" | "tiff" => Ok(Format::Tif),
        "csv" => Ok(Format::Csv),
        "" if path.as_os_str() == "-" => {
            Err(Error::Usage("-o - names no format; say --format csv or --format png".into()))
        }
        _ => Err(Error::Usage(format!(
            "{}: the extension names no format; use .png, .img, .exr, .zarr, .tif or .csv, or say --format",
            path.display()
        ))),
    }
}

fn parse_range(text: &str) -> std::result::Result<[f64; 2], String> {
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|v| v.is_finite());
    let range = text.split_once("..").and_then(|(from, to)| Some([number(from)?, number(to)?]));
    range.filter(|[from, to]| from < to).ok_or_else(|| "a range is FROM..TO with FROM < TO, such as 280..320".into())
}

fn parse_crop(text: &str) -> std::result::Result<Rect, String> {
    let numbers: Option<Vec<u32>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x0, y0, x1, y1]) if x0 < x1 && y0 < y1 => Ok(Rect { x0, y0, x1, y1 }),
        _ => Err("a crop is X0,Y0,X1,Y1 in whole pixels with X0 < X1 and Y0 < Y1, such as 0,0,64,64".into()),
    }
}
