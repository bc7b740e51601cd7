//! Maps of radiance as others write them: OpenEXR (RGB, spectral), Radiance RGBE, ENVI and Zarr, told apart by content.
//!
//! What the values mean by direction is the scene's business; here they are a picture of RGB or spectra.

mod envi;
mod exr;
mod hdr;
mod zarr;

use std::io::Read;
use std::path::Path;

use super::text::nanometres;
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
    /// A band for each wavelength; these ascend.
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
    let mut start = [0; 4];
    let length = std::fs::File::open(path)
        .and_then(|file| file.take(4).read(&mut start))
        .map_err(|e| whole(path, format!("cannot be read: {e}")))?;
    match &start[..length] {
        [0x76, 0x2f, 0x31, 0x01] => exr::read_map(path),
        [b'#', b'?', ..] => hdr::read(path),
        b"ENVI" => envi::read(path, None),
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

/// Sorts the bands by wavelength: `planes` are \[band\]\[y\]\[x\] in the order of `nm`.
fn spectral(path: &Path, nm: &[f64], planes: &[&[f32]]) -> Result<Content, Box<Problem>> {
    let order = ascending(path, nm)?;
    let texels = planes[0].len();
    let values = (0..texels).flat_map(|texel| order.iter().map(move |&band| planes[band][texel])).collect();
    Ok(Content::Spectral { nm: order.iter().map(|&band| nm[band]).collect(), values })
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
