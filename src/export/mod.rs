//! Cubes in other people's formats, written piece by piece: memory is bounded whatever the cube's size. What is taken of
//! the cube is a [`View`]; every writer is a pass over it.

mod blocks;
mod envi;
mod exr;
pub mod layers;
mod picture;
mod statistics;
mod table;
mod tiff;
mod zarr;

use std::path::{Path, PathBuf};

use crate::cube::{Quantity, View};
use crate::format::envi::Interleave;
use crate::spectral::colour::{ProjectionKind, three_of};
use crate::{Error, Result, files};

pub use exr::WIDELY_READ;
pub use picture::{Map, Shown, write_png};

/// Values, in bytes, that a writer holds at a time, about.
const PIECE_BYTES: usize = 32 << 20;

/// A format that holds all values of a view.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    Envi {
        interleave: Interleave,
    },
    Exr {
        /// Write the unit that the layout names, although the values are per nanometre.
        strict_units: bool,
        /// The most bands of a file.
        split: Option<usize>,
    },
    Zarr {
        /// Several chunks in a file.
        shards: bool,
    },
    Tiff,
    Csv,
    /// In CSV too: a line a band.
    Statistics,
}

impl Format {
    pub fn name(self) -> &'static str {
        match self {
            Format::Envi { .. } => "envi",
            Format::Exr { .. } => "exr",
            Format::Zarr { .. } => "zarr",
            Format::Tiff => "tif",
            Format::Csv | Format::Statistics => "csv",
        }
    }

    /// Refuses early what cannot be written to.
    pub fn check_target(self, path: &Path) -> Result<()> {
        match self {
            Format::Envi { .. } => envi::check_target(path),
            Format::Exr { .. } => exr::IMAGE.check_target(path),
            Format::Zarr { .. } => zarr::STORE.check_target(path),
            Format::Tiff => tiff::IMAGE.check_target(path),
            Format::Csv => table::TABLE.check_target(path),
            Format::Statistics => statistics::TABLE.check_target(path),
        }
    }

    /// Of files in this format.
    fn extension(self) -> &'static str {
        if let Format::Envi { .. } = self { "img" } else { self.name() }
    }
}

/// Called with the pixels done so far, of all; an error ends the export.
pub type Progress<'a> = dyn FnMut(u64, u64) -> Result<()> + 'a;

/// Writes `view` to `path`, new or one of the same format that is replaced, and returns the files (or the one folder)
/// written.
pub fn write(view: &View, path: &Path, format: Format, progress: &mut Progress) -> Result<Vec<PathBuf>> {
    match format {
        Format::Envi { interleave } => envi::write(view, path, interleave, progress),
        Format::Exr { strict_units, split } => exr::write(view, path, strict_units, split, progress),
        Format::Zarr { shards } => zarr::write(view, path, shards, progress),
        Format::Tiff => tiff::write(view, path, progress),
        Format::Csv => table::write(view, path, progress),
        Format::Statistics => statistics::write(view, path, progress),
    }
}

pub use blocks::{BLOCKS, write as write_blocks};
pub use envi::{header_beside_exr, other_header};
pub use table::TABLE;

/// Refuses what would not fit on the disk of `path`, where `bytes` are known to be written.
fn check_space(path: &Path, bytes: u64) -> Result<()> {
    match files::free_bytes(&files::output::real_folder(path)) {
        Some(free) if free < bytes => Err(Error::Usage(format!(
            "{}: the export needs {}, and {} are free there; choose fewer bands or pixels, or another disk",
            path.display(),
            files::format_bytes(bytes),
            files::format_bytes(free)
        ))),
        _ => Ok(()),
    }
}

/// The unit of a view's values, as CF writes it.
fn units(view: &View) -> &'static str {
    match view.quantity() {
        Quantity::Radiance | Quantity::Xyz(_) => "W m-2 sr-1 nm-1",
        Quantity::Integrated => "W m-2 sr-1",
        Quantity::Temperature => "K",
        Quantity::Reflectance | Quantity::Counts => "1",
    }
}

fn long_name(view: &View) -> &'static str {
    if view.is_of_errors() {
        return "standard error of radiance";
    }
    match view.quantity() {
        Quantity::Xyz(_) => "CIE XYZ, divided by the integral of ybar",
        Quantity::Radiance => "mean spectral radiance over the channel",
        Quantity::Counts => "counts",
        Quantity::Integrated => "radiance of the channel",
        Quantity::Temperature => "brightness temperature in the channel",
        Quantity::Reflectance if view.is_by_white_cube() => {
            "hemispherical-directional reflectance factor: radiance over that of a rendered white reference"
        }
        Quantity::Reflectance => {
            "hemispherical-directional reflectance factor: pi times radiance over the irradiance given"
        }
    }
}

/// The bands (of the view) shown as red, green and blue where a format names three: those of the preview if they are
/// there, else what [`three_of`] chooses.
fn default_bands(view: &View) -> [usize; 3] {
    let channels = view.channels();
    let position = |k: usize| view.bands().iter().position(|&band| band == k);
    match view.cube().projection().kind {
        ProjectionKind::Xyz => three_of(channels, true),
        ProjectionKind::FalseColour([r, g, b]) => match (position(r), position(g), position(b)) {
            (Some(r), Some(g), Some(b)) => [r, g, b],
            _ => three_of(channels, false),
        },
    }
}
