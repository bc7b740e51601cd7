//! Maps of radiance as others write them: OpenEXR (RGB, spectral), Radiance RGBE, ENVI and Zarr, told apart by content.
//!
//! What the values mean by direction is the scene's business; here they are a picture of RGB or spectra.

mod envi;
pub mod exr;
mod hdr;
mod zarr;

use std::io::Read;
use std::path::Path;

use super::primaries::{self, Primaries, White};
use super::table::shown;
use super::unit::{Density, Kind, Measure, Unit};
use crate::error::Problem;

/// A picture of colours or spectra, rows from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// Width and height, at least 1.
    pub size: [u32; 2],
    pub content: Content,
    /// What the file leaves open and how it is taken, to be continued after its name.
    pub warnings: Vec<String>,
}

/// Values as the file has them, \[y\]\[x\]\[band\].
#[derive(Debug, Clone, PartialEq)]
pub enum Content {
    /// Three bands: linear red, green, blue.
    Rgb(Vec<f32>),
    /// A band for each wavelength; these ascend, and two equal ones make a step.
    Spectral { nm: Vec<f64>, values: Vec<f32> },
}

impl Map {
    pub fn values(&self) -> &[f32] {
        match &self.content {
            Content::Rgb(values) | Content::Spectral { values, .. } => values,
        }
    }

    pub fn values_mut(&mut self) -> &mut [f32] {
        match &mut self.content {
            Content::Rgb(values) | Content::Spectral { values, .. } => values,
        }
    }

    /// Numbers of a texel.
    pub fn per_texel(&self) -> usize {
        match &self.content {
            Content::Rgb(_) => 3,
            Content::Spectral { nm, .. } => nm.len(),
        }
    }
}

/// Reads the map at `path`: an EXR, Radiance or ENVI file (its data or its header) or a Zarr store, which is a folder.
///
/// Errors name the file, and a line where it has any.
pub fn read(path: &Path) -> Result<Map, Box<Problem>> {
    if path.is_dir() {
        return zarr::read(path);
    }
    let mut start = [0; 8];
    let length = std::fs::File::open(path)
        .and_then(|file| file.take(8).read(&mut start))
        .map_err(|e| whole(path, format!("cannot be read: {e}")))?;
    match &start[..length] {
        [0x76, 0x2f, 0x31, 0x01, ..] => exr::read_map(path),
        [b'#', b'?', ..] => hdr::read(path),
        start if crate::format::envi::is_header(start) => envi::read(path, None),
        _ => match envi::header_of(path) {
            Some(header) => envi::read(&header, Some(path)),
            None => {
                let help = "use OpenEXR, Radiance RGBE (.hdr), ENVI (with its .hdr beside it) or a Zarr store";
                Err(with_help(path, "is no map in a known format".to_owned(), help))
            }
        },
    }
}

/// A mistake in a file as a whole.
fn whole(path: &Path, message: String) -> Box<Problem> {
    Box::new(Problem { file: path.to_owned(), message, ..Problem::default() })
}

fn with_help(path: &Path, message: String, help: &str) -> Box<Problem> {
    Box::new(Problem { help: Some(help.to_owned()), ..*whole(path, message) })
}

/// A size in pixels that a map may have. Texels are numbered in 32 bits, and columns and rows in 16.
fn checked_size(path: &Path, width: u64, height: u64) -> Result<[u32; 2], Box<Problem>> {
    const LARGEST: u64 = 1 << 16;
    if width == 0 || height == 0 || width > LARGEST || height > LARGEST {
        return Err(whole(path, format!("is {width} x {height} pixels, but each side must have 1 to {LARGEST}")));
    }
    Ok([width as u32, height as u32])
}

/// The bands of a map.
struct Bands {
    /// Centres.
    nm: Vec<f64>,
    /// What each spans, where the file says so.
    spans: Option<Vec<[f64; 2]>>,
}

/// Bands over wavelength, sorted: `planes` are \[band\]\[y\]\[x\] in the order of `bands`.
///
/// Without spans a band is a point, and values are linear between points. A band with a span is the mean over it and constant
/// there; in a gap between two of them values are linear. Where spans overlap, centres are points again, and the outer halves
/// of the first and the last band hold their values.
fn spectral(
    path: &Path,
    bands: &Bands,
    planes: &[&[f32]],
    warnings: &mut Vec<String>,
) -> Result<Content, Box<Problem>> {
    let order = ascending(path, &bands.nm)?;
    // Wavelength and band of every node.
    let mut nodes: Vec<(f64, usize)> = Vec::new();
    match &bands.spans {
        None => nodes.extend(order.iter().map(|&band| (bands.nm[band], band))),
        Some(spans) => {
            let mut spans: Vec<[f64; 2]> =
                order.iter().map(|&band| spans[band]).map(|[a, b]| [a.min(b), a.max(b)]).collect();
            if let Some([a, b]) = spans.iter().find(|[a, b]| !(a.is_finite() && b.is_finite() && *a > 0.0)) {
                return Err(whole(path, format!("has a band from {a} to {b} nm, which is no span of wavelengths")));
            }
            let overlap = join_edges(&mut spans);
            if overlap {
                nodes.push((spans[0][0], order[0]));
                nodes.extend(order.iter().map(|&band| (bands.nm[band], band)));
                let last = spans.len() - 1;
                nodes.push((spans[last][1], order[last]));
                nodes.dedup_by(|after, before| after.0 <= before.0);
                warnings.push(
                    "has bands that overlap: values are taken to be those at their centres, and linear between them"
                        .to_owned(),
                );
            } else {
                nodes.extend(spans.iter().zip(&order).flat_map(|([a, b], &band)| [(*a, band), (*b, band)]));
            }
        }
    }
    let texels = planes[0].len();
    let values = (0..texels).flat_map(|texel| nodes.iter().map(move |&(_, band)| planes[band][texel])).collect();
    Ok(Content::Spectral { nm: nodes.iter().map(|(nm, _)| *nm).collect(), values })
}

/// Makes one edge of two that are the same but for rounding; whether spans overlap by more.
fn join_edges(spans: &mut [[f64; 2]]) -> bool {
    /// Of the narrower of two bands: widths are written with three digits at least.
    const ROUNDING: f64 = 2e-3;
    let mut overlap = spans.iter().any(|[a, b]| a >= b);
    for i in 1..spans.len() {
        let (before, after) = (spans[i - 1], spans[i]);
        let narrower = (before[1] - before[0]).min(after[1] - after[0]);
        if (after[0] - before[1]).abs() <= ROUNDING * narrower {
            let edge = 0.5 * (before[1] + after[0]);
            spans[i - 1][1] = edge;
            spans[i][0] = edge;
        } else if after[0] < before[1] {
            overlap = true;
        }
    }
    overlap
}

/// Brings colours of other primaries to those of sRGB; what has none there is an error.
fn to_srgb(
    path: &Path,
    rgb: &mut [f32],
    width: u32,
    from: Primaries,
    warnings: &mut Vec<String>,
) -> Result<(), Box<Problem>> {
    /// Of the brightest: what the scene takes as noise.
    const TOLERATED: f32 = 0.01;
    let Some(matrix) = from.to_srgb(White::Kept) else {
        return Err(whole(path, format!("has primaries {:?} that span no colours", from.0)));
    };
    for texel in rgb.as_chunks_mut::<3>().0 {
        *texel = primaries::apply(&matrix, texel.map(f64::from)).map(|v| v as f32);
    }
    let peak = rgb.iter().copied().fold(0.0, f32::max);
    if let Some(i) = rgb.iter().position(|v| *v < -TOLERATED * peak) {
        let (column, row) = (i / 3 % width as usize, i / 3 / width as usize);
        let message =
            format!("has primaries other than sRGB's, and a colour outside of sRGB at column {column}, row {row}");
        return Err(with_help(
            path,
            message,
            "convert it to linear sRGB and choose there what becomes of such colours",
        ));
    }
    warnings.push("has primaries other than sRGB's: its colours are converted".to_owned());
    Ok(())
}

/// What makes W m⁻² sr⁻¹ nm⁻¹ of numbers whose unit a file gives as `text`, over an axis in `axis`.
fn radiance_of(
    path: &Path,
    text: &str,
    measure: Option<Measure>,
    axis: Unit,
    warnings: &mut Vec<String>,
) -> Result<Density, Box<Problem>> {
    let text = shown(text);
    if let Some(density) = measure.and_then(|measure| measure.to(Kind::Radiance)) {
        if density != Density::Plain(1.0) {
            warnings.push(format!("gives radiance in `{text}`, which is converted to W m-2 sr-1 nm-1"));
        }
        return Ok(density);
    }
    if measure.is_some_and(|measure| !measure.is_number()) {
        let message = format!("gives its values in `{text}`, which is no spectral radiance");
        return Err(with_help(path, message, "convert them to W m-2 sr-1 nm-1"));
    }
    warnings.push(format!("gives its unit as \"{text}\": its values are taken as W m-2 sr-1 nm-1"));
    radiance_unsaid(path, axis)
}

/// The same where a file says no unit: then what is over wavelength is taken to be per nanometre.
fn radiance_unsaid(path: &Path, axis: Unit) -> Result<Density, Box<Problem>> {
    if matches!(axis, Unit::Wavelength(_)) {
        return Ok(Density::Plain(1.0));
    }
    let message = "is over wavenumber, frequency or energy, and does not say in what unit its radiance is".to_owned();
    Err(with_help(
        path,
        message,
        "say e.g. `data units = W m-2 sr-1 nm-1` (ENVI) or units = \"W m-2 sr-1 nm-1\" (Zarr)",
    ))
}

/// The order in which wavelengths ascend; two equal ones, or one that is none, are an error.
fn ascending(path: &Path, nm: &[f64]) -> Result<Vec<usize>, Box<Problem>> {
    if let Some(wrong) = nm.iter().find(|nm| !(nm.is_finite() && **nm > 0.0)) {
        return Err(whole(path, format!("has a band at {wrong} nm, which is no wavelength")));
    }
    let mut order: Vec<usize> = (0..nm.len()).collect();
    order.sort_by(|&a, &b| nm[a].total_cmp(&nm[b]));
    match order.windows(2).find(|w| nm[w[0]] == nm[w[1]]) {
        Some(w) => Err(whole(path, format!("has two bands at {} nm", nm[w[0]]))),
        None => Ok(order),
    }
}
