//! Spectral OpenEXR (A. Fichet, R. Pacanowski, A. Wilkie 2021, JCGT 10(3)): a channel a band, named by its wavelength, and
//! R, G, B for viewers that know nothing of spectra.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use exr::block::writer::{ChunkWriter, ChunksWriter};
use exr::block::{BlockIndex, UncompressedBlock};
use exr::math::{RoundingMode, Vec2};
use exr::meta::attribute::{
    AttributeValue, ChannelDescription, LevelMode, LineOrder, SampleType, Text, TileDescription,
};
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData};
use exr::prelude::Compression;
use rayon::prelude::*;
use smallvec::SmallVec;

use super::{Progress, check_space};
use crate::cube::{Integers, Quantity, Rect, Strides, View};
use crate::files::output::{Product, Replacement, cannot_write};
use crate::format::maps::exr::QUANTITY;
use crate::spectral::{Curve, Response};
use crate::{Error, Result};

/// What [`write`] writes. Where its chunks lie stands at the beginning, and is known at the end: no pipe takes it.
pub const IMAGE: Product =
    Product { name: "an OpenEXR image", extensions: &["exr"], is_stream: false, is_folder: false, check: is_exr };

fn is_exr(path: &Path) -> std::result::Result<(), String> {
    MetaData::read_from_file(path, false).map(drop).map_err(|_| "does not begin like one".into())
}

/// OpenImageIO, and what is built on it, refuses files with more channels unless told otherwise.
pub const WIDELY_READ: usize = 1024;

/// Side of a tile in pixels, and the most bytes of one before compression.
const TILE: u32 = 32;
const TILE_BYTES: usize = 64 << 20;

/// Writes one file; or with `split` several of at most so many bands each, in ascending wavelength, named after their
/// ranges.
pub fn write(
    view: &View,
    path: &Path,
    strict_units: bool,
    split: Option<usize>,
    progress: &mut Progress,
) -> Result<Vec<PathBuf>> {
    if view.cube().is_counts() && strict_units {
        let what = "--exr-strict-units is about radiance, and these are counts; leave it out";
        return Err(Error::Usage(format!("{}: {what}", path.display())));
    }
    if !matches!(view.quantity(), Quantity::Radiance | Quantity::Integrated | Quantity::Counts) {
        let what = "spectral OpenEXR holds spectra of light only; export temperatures, reflectances and colours to another format";
        return Err(Error::Usage(format!("{}: {what}", path.display())));
    }
    let channels = view.channels();
    let mut order: Vec<usize> = (0..channels.len()).collect();
    order.sort_by(|&a, &b| channels.centre(a).total_cmp(&channels.centre(b)));
    check_names(view, &order)?;
    // As if nothing could be compressed.
    check_space(path, view.bytes())?;
    let parts: Vec<&[usize]> = order.chunks(split.unwrap_or(usize::MAX).max(1)).collect();
    let pixels = view.rect().pixels();
    let mut files = Vec::new();
    let mut written = Vec::new();
    for (i, part) in parts.iter().enumerate() {
        let target = if parts.len() == 1 { path.to_owned() } else { part_path(path, view, part) };
        let bands = part.iter().map(|&b| view.bands()[b]).collect();
        let of_part = view.clone().with_bands(bands)?;
        let mut tell = |done: u64, _: u64| progress(i as u64 * pixels + done, parts.len() as u64 * pixels);
        files.push(write_file(&of_part, &target, strict_units, &mut tell)?);
        written.push(target);
    }
    // All are whole before the first takes its place.
    files.into_iter().try_for_each(Replacement::finish)?;
    Ok(written)
}

/// `name.400-500nm.exr`.
fn part_path(path: &Path, view: &View, part: &[usize]) -> PathBuf {
    let end = |b: usize| view.channels().centre(b);
    let (from, to) = (end(part[0]), end(part[part.len() - 1]));
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or("exr");
    path.with_extension(format!("{from:.3}-{to:.3}nm.{extension}"))
}

/// The name of a band: its centre in nanometres, with a decimal comma, since a point separates layers.
fn band_name(nm: f64) -> String {
    format!("S0.{nm:.6}nm").replacen(".", "\u{0}", 1).replace('.', ",").replace('\u{0}', ".")
}

/// The channel of a band of counts: its name, without the points that separate layers.
fn counts_name(view: &View, b: usize) -> String {
    view.channels().names[b].replace('.', "_")
}

/// Bands are told apart by their centres only; those of counts by their names.
fn check_names(view: &View, order: &[usize]) -> Result<()> {
    let channels = view.channels();
    if view.cube().is_counts() {
        let mut names: Vec<String> = order.iter().map(|&b| counts_name(view, b)).collect();
        names.sort();
        return match names.windows(2).find(|pair| pair[0] == pair[1]) {
            None => Ok(()),
            Some(pair) => Err(Error::Usage(format!(
                "{}: OpenEXR would call two bands {}, since points separate layers; choose one of them with --bands",
                view.cube().path().display(),
                pair[0]
            ))),
        };
    }
    let same = |pair: &&[usize]| band_name(channels.centre(pair[0])) == band_name(channels.centre(pair[1]));
    match order.windows(2).find(same) {
        None => Ok(()),
        Some(pair) => Err(Error::Usage(format!(
            "{}: the channels {} and {} have one centre, {} nm, and spectral OpenEXR names channels by it; choose others \
             with --bands, or another format",
            view.cube().path().display(),
            channels.names[pair[0]],
            channels.names[pair[1]],
            channels.centre(pair[0]),
        ))),
    }
}

/// What a channel of the file holds.
#[derive(Clone, Copy)]
enum Source {
    /// Red, green or blue.
    Colour(usize),
    Band(usize),
}

/// The file, which has not taken its place yet.
fn write_file(view: &View, path: &Path, strict_units: bool, progress: &mut Progress) -> Result<Replacement> {
    let is_counts = view.cube().is_counts();
    let name = |b: usize| if is_counts { counts_name(view, b) } else { band_name(view.channels().centre(b)) };
    let mut named: Vec<(String, Source)> = (0..view.channels().len()).map(|b| (name(b), Source::Band(b))).collect();
    // Counts are no light that has a colour.
    let colours = ["R", "G", "B"].into_iter().enumerate().filter(|_| !is_counts);
    named.extend(colours.map(|(i, name)| (name.to_owned(), Source::Colour(i))));
    // The order of the file's channels is that of their names' bytes.
    named.sort_by(|a, b| a.0.cmp(&b.0));
    let sources: Vec<Source> = named.iter().map(|(_, source)| *source).collect();
    let header = header(view, &named, strict_units)?;

    write_image(path, header, |meta, writer| write_tiles(view, path, &sources, meta, writer, progress))
}

/// An image whose blocks `write` writes in their order, which has not taken its place yet.
pub(super) fn write_image(
    path: &Path,
    header: Header,
    write: impl FnOnce(&MetaData, &mut ChunkWriter<&mut BufWriter<&mut File>>) -> Result<()>,
) -> Result<Replacement> {
    let mut replacement = Replacement::create(path, IMAGE)?;
    let mut ended = None;
    let mut file = BufWriter::with_capacity(1 << 20, replacement.file());
    let result = exr::block::write(&mut file, SmallVec::from_vec(vec![header]), true, |meta, writer| {
        write(&meta, writer).map_err(|error| {
            // What the crate can carry through is only its own errors.
            let what = error.to_string();
            ended = Some(error);
            exr::error::Error::Invalid(what.into())
        })
    });
    let flushed = file.flush();
    drop(file);
    if let Some(error) = ended {
        return Err(error);
    }
    result.map_err(failed(path))?;
    flushed.map_err(|error| replacement.failed(&error))?;
    Ok(replacement)
}

/// A text as headers have it.
pub(super) fn text(text: &str) -> Result<Text> {
    Text::new_or_none(text).ok_or_else(|| Error::Internal(format!("`{text}` cannot stand in an EXR header")))
}

/// A channel of f32, of every pixel.
pub(super) fn channel(name: &str) -> Result<ChannelDescription> {
    let (name, sampling) = (text(name)?, Vec2(1, 1));
    Ok(ChannelDescription { name, sample_type: SampleType::F32, quantize_linearly: false, sampling })
}

fn header(view: &View, named: &[(String, Source)], strict_units: bool) -> Result<Header> {
    let is_counts = view.cube().is_counts();
    let sample_type = if is_counts { SampleType::U32 } else { SampleType::F32 };
    let channels = named.iter().map(|(name, _)| Ok(ChannelDescription { sample_type, ..channel(name)? }));
    let channels = channels.collect::<Result<SmallVec<_>>>()?;
    let [width, height] = view.size();
    let mut side = TILE.min(width.max(height).next_power_of_two());
    while side > 1 && (side * side) as usize * named.len() * 4 > TILE_BYTES {
        side /= 2;
    }
    let blocks = BlockDescription::Tiles(TileDescription {
        tile_size: Vec2(side as usize, side as usize),
        level_mode: LevelMode::Singular,
        rounding_mode: RoundingMode::Down,
    });
    let mut header = Header::new(
        text(if is_counts { "counts" } else { "radiance" })?,
        Vec2(width as usize, height as usize),
        channels,
    )
    .with_encoding(Compression::ZIP16, blocks, LineOrder::Increasing);
    // A single unnamed part is what every reader expects.
    header.own_attributes.layer_name = None;
    if is_counts {
        let about = format!(
            "Spectile {}; counts of a sensor, whole numbers; {} is a pixel that is missing",
            env!("CARGO_PKG_VERSION"),
            u32::MAX
        );
        header.own_attributes.comments = Some(text(&about)?);
        return Ok(header);
    }
    let units = match view.quantity() {
        Quantity::Radiance if !strict_units => "W.m^-2.sr^-1.nm^-1",
        _ => "W.m^-2.sr^-1",
    };
    let preview = match view.cube().projection().kind {
        crate::spectral::colour::ProjectionKind::Xyz => "linear sRGB of CIE 1931 XYZ divided by the integral of ybar",
        crate::spectral::colour::ProjectionKind::FalseColour(_) => "false colour",
    };
    let about = format!("Spectile {}; R, G, B: {preview}", env!("CARGO_PKG_VERSION"));
    let other = &mut header.own_attributes.other;
    header.own_attributes.comments = Some(text(&about)?);
    let mut of_all = vec![("spectralLayoutVersion", "1.0"), ("emissiveUnits", units)];
    if view.quantity() == Quantity::Integrated {
        // The layout has the same label for spectral radiance.
        of_all.push((QUANTITY, "radiance integrated over each band, W m^-2 sr^-1"));
    }
    for (key, value) in of_all {
        other.insert(text(key)?, AttributeValue::Text(text(value)?));
    }
    // How wide each band is: its response, which is one over its interval where it has no other, under its own name.
    for (name, source) in named {
        if let Source::Band(b) = source {
            let [from, to] = view.channels().bounds[*b];
            let written = match view.channels().responses.get(*b).map(Response::curve) {
                Some(Curve::Linear { nm, value, .. }) => {
                    nm.iter().zip(value).map(|(nm, value)| format!("{nm}nm:{value};")).collect()
                }
                _ => format!("{from}nm:1;{to}nm:1;"),
            };
            other.insert(text(name)?, AttributeValue::Text(text(&written)?));
        }
    }
    Ok(header)
}

pub(super) fn failed(path: &Path) -> impl Fn(exr::error::Error) -> Error + Copy + use<'_> {
    move |error| match error {
        exr::error::Error::Io(error) => cannot_write(path, &error),
        error => Error::storage(path, format!("cannot be written: {error}")),
    }
}

/// One tile after another, several of them compressed at the same time.
fn write_tiles(
    view: &View,
    path: &Path,
    sources: &[Source],
    meta: &MetaData,
    writer: &mut impl ChunksWriter,
    progress: &mut Progress,
) -> Result<()> {
    let header = &meta.headers[0];
    let side = header.max_block_pixel_size().x() as u32;
    let tile_bytes = (side * side) as usize * sources.len() * 4;
    // Compression holds a tile twice.
    let together = rayon::current_num_threads().min(TILE_BYTES / tile_bytes).max(1);
    let failed = failed(path);
    let indices: Vec<_> = exr::block::enumerate_ordered_header_block_indices(&meta.headers).collect();
    let mut tiles = Tiles { view, reader: view.reader(), sources, bands: Vec::new(), colours: Vec::new() };
    let mut done = 0;
    for group in indices.chunks(together) {
        let blocks = group.iter().map(|(at, index)| Ok((*at, tiles.block(*index)?))).collect::<Result<Vec<_>>>()?;
        let compress = |(at, block): (usize, UncompressedBlock)| Ok((at, block.compress_to_chunk(&meta.headers)?));
        let compressed: Vec<_> =
            blocks.into_par_iter().with_max_len(1).map(compress).collect::<exr::error::Result<_>>().map_err(failed)?;
        for (at, chunk) in compressed {
            writer.write_chunk(at, chunk).map_err(failed)?;
        }
        done += group.iter().map(|(_, index)| index.pixel_size.area() as u64).sum::<u64>();
        progress(done, view.rect().pixels())?;
    }
    Ok(())
}

struct Tiles<'a> {
    view: &'a View<'a>,
    reader: crate::cube::Reader<'a>,
    sources: &'a [Source],
    /// [row][band][column], and [row][rgb][column].
    bands: Vec<f32>,
    colours: Vec<f32>,
}

impl Tiles<'_> {
    /// For every row, for every channel, the values of the row.
    fn block(&mut self, index: BlockIndex) -> Result<UncompressedBlock> {
        let rect = self.view.rect();
        let (x0, y0) = (rect.x0 + index.pixel_position.x() as u32, rect.y0 + index.pixel_position.y() as u32);
        let (width, height) = (index.pixel_size.x(), index.pixel_size.y());
        let tile = Rect { x0, y0, x1: x0 + width as u32, y1: y0 + height as u32 };
        let count = self.view.channels().len();
        self.bands.resize(width * height * count, 0.0);
        self.reader.read(tile, 0..count, Strides { row: width * count, pixel: 1, band: width }, &mut self.bands)?;
        self.colours.clear();
        self.colours.resize(width * height * 3, f32::NAN);
        let projection = self.view.cube().projection();
        // The only whole numbers that OpenEXR has.
        let whole = self.view.integers().map(|_| Integers { is_short: false, missing: u32::MAX });
        self.reader.spectra(tile, |x, y, spectrum| {
            let at = (y - y0) as usize * 3 * width + (x - x0) as usize;
            (0..3).zip(projection.rgb(spectrum)).for_each(|(i, value)| self.colours[at + i * width] = value);
        })?;
        let mut data = Vec::with_capacity(width * height * self.sources.len() * 4);
        for row in 0..height {
            for source in self.sources {
                let line: Range<usize> = match source {
                    Source::Band(b) => (row * count + b) * width..(row * count + b + 1) * width,
                    Source::Colour(i) => (row * 3 + i) * width..(row * 3 + i + 1) * width,
                };
                let values = match source {
                    Source::Band(_) => &self.bands[line],
                    Source::Colour(_) => &self.colours[line],
                };
                match whole {
                    None => data.extend_from_slice(bytemuck::cast_slice(values)),
                    Some(whole) => data.extend(whole.encode(values)),
                }
            }
        }
        Ok(UncompressedBlock { index, data })
    }
}

#[cfg(test)]
mod tests {
    use super::band_name;

    #[test]
    fn names_have_a_decimal_comma() {
        assert_eq!(band_name(550.0), "S0.550,000000nm");
        assert_eq!(band_name(10_000.123_456_7), "S0.10000,123457nm");
    }
}
