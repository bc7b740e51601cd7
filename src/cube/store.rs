//! The cube as a folder: opening and reading it.

use std::fs;
use std::io::ErrorKind;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::estimate;
use super::grid::Grid;
use super::journal::Journal;
use super::lock::{Probe, TileLock};
use super::map::Chunk;
use super::metadata::{FORMAT, Header};
use crate::spectral::Channels;
use crate::spectral::colour::Projection;
use crate::{Error, Result, files};

/// Folder of everything that is not plain Zarr.
pub(super) const PRIVATE: &str = ".spectile";

/// The arrays that each tile has a file of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    Radiance,
    Samples,
    Preview,
    Overview,
    /// Only in cubes that have it.
    StandardError,
}

impl Part {
    /// In the order in which they are written and take their places.
    pub const ALL: [Part; 5] = [Part::Radiance, Part::Samples, Part::Preview, Part::Overview, Part::StandardError];

    /// Whether it can be made from the radiance anew.
    pub fn is_derived(self) -> bool {
        !matches!(self, Part::Radiance | Part::StandardError)
    }

    pub fn name(self) -> &'static str {
        match self {
            Part::Radiance => "radiance",
            Part::Samples => "samples",
            Part::Preview => "preview",
            Part::Overview => "overview",
            Part::StandardError => "standard_error",
        }
    }
}

/// A cube on disk. Any number of threads and processes may read it while it grows.
pub struct Cube {
    path: PathBuf,
    header: Header,
    projection: Projection,
}

/// How far a cube has got.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Progress {
    pub tiles: u32,
    /// Tiles with at least one sample.
    pub tiles_started: u32,
    /// The least and the most samples per pixel of the tiles with any.
    pub samples: [u32; 2],
    /// Tiles without any.
    pub missing: Vec<Range<u32>>,
    /// Tiles with some, but fewer than the most.
    pub behind: Vec<Range<u32>>,
}

impl Progress {
    /// What the samples per pixel of every tile say.
    pub fn of(samples: &[u32]) -> Progress {
        let most = samples.iter().copied().max().unwrap_or(0);
        let least = samples.iter().copied().filter(|&n| n > 0).min().unwrap_or(0);
        let missing = ranges(samples, |n| n == 0);
        let behind = ranges(samples, |n| n > 0 && n < most);
        let tiles_started = samples.iter().filter(|&&n| n > 0).count() as u32;
        Progress { tiles: samples.len() as u32, tiles_started, samples: [least, most], missing, behind }
    }
}

impl Cube {
    /// Opens a cube that another process may be rendering at this moment.
    pub fn open(path: &Path) -> Result<Cube> {
        Cube::from_group(path, &read_group(path)?)
    }

    /// The cube at `path`, whose group's metadata have been read.
    pub(super) fn from_group(path: &Path, group: &Value) -> Result<Cube> {
        let header = Header::parse(path, group, |count| {
            let values = read_doubles(&path.join("wavelength_bounds/c/0/0"), 2 * count)?;
            Ok(values.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect())
        })?;
        Ok(Cube::new(path, header))
    }

    pub(super) fn new(path: &Path, header: Header) -> Cube {
        let projection = Projection::new(&header.channels);
        Cube { path: path.to_owned(), header, projection }
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    pub fn header(&self) -> &Header {
        &self.header
    }

    pub fn channels(&self) -> &Channels {
        &self.header.channels
    }

    pub fn grid(&self) -> Grid {
        self.header.grid()
    }

    /// What the preview shows.
    pub fn projection(&self) -> &Projection {
        &self.projection
    }

    /// Samples per pixel merged into a tile so far.
    pub fn samples(&self, tile: u32) -> Result<u32> {
        let path = self.part_path(Part::Samples, tile);
        match fs::read(&path) {
            Ok(bytes) => {
                let bytes = bytes.try_into().map_err(|_| Error::storage(&path, "is damaged: not 4 bytes long"))?;
                Ok(u32::from_le_bytes(bytes))
            }
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(0),
            Err(error) => Err(Error::storage(&path, error)),
        }
    }

    /// Samples per pixel of every tile.
    pub fn all_samples(&self) -> Result<Vec<u32>> {
        (0..self.grid().count()).map(|tile| self.samples(tile)).collect()
    }

    /// How far the whole cube has got.
    pub fn progress(&self) -> Result<Progress> {
        Ok(Progress::of(&self.all_samples()?))
    }

    /// The radiance of a tile, mapped into memory; `None` before its first unit.
    pub fn chunk(&self, tile: u32) -> Result<Option<Chunk>> {
        self.mapped(&self.part_path(Part::Radiance, tile), tile)
    }

    /// The standard errors of a tile, mapped into memory like [`Cube::chunk`]: NaN below two epochs. `None` before its
    /// first unit, and in cubes without them.
    pub fn error_chunk(&self, tile: u32) -> Result<Option<Chunk>> {
        match self.header.has_uncertainty() {
            true => self.mapped(&self.part_path(Part::StandardError, tile), tile),
            false => Ok(None),
        }
    }

    pub(super) fn mapped(&self, path: &Path, tile: u32) -> Result<Option<Chunk>> {
        Chunk::open(path, self.grid().rect(tile), self.header.tile, self.channels().len())
    }

    /// The parts that each tile of this cube has.
    pub(super) fn parts(&self) -> &'static [Part] {
        if self.header.has_uncertainty() { &Part::ALL } else { &Part::ALL[..4] }
    }

    /// The K channels of the pixel in column `x` and row `y` from the top left, in one contiguous read; `None` before
    /// the first unit of its tile.
    pub fn spectrum(&self, x: u32, y: u32) -> Result<Option<Vec<f32>>> {
        self.check_pixel(x, y)?;
        self.look().spectrum(x, y)
    }

    /// The standard errors of the pixel's channels, as [`Cube::spectrum`] gives their values; `None` also in cubes without
    /// them. NaN below two epochs.
    pub fn standard_error(&self, x: u32, y: u32) -> Result<Option<Vec<f32>>> {
        self.check_pixel(x, y)?;
        self.look().standard_error(x, y)
    }

    fn check_pixel(&self, x: u32, y: u32) -> Result<()> {
        let [width, height] = self.header.size;
        if x < width && y < height {
            return Ok(());
        }
        let what = format!("pixel {x} {y} is outside the picture; columns are 0..{width}, rows 0..{height}");
        Err(Error::Usage(format!("{}: {what}", self.path.display())))
    }

    /// The error estimate of every channel, from the spread of the epochs (docs/METHOD.md, Errors): sqrt(Σ variance of the
    /// mean / Σ mean²), sums over the pixels of all tiles begun. NaN while any of those has fewer than two epochs, 0
    /// where a channel is all zero. NaN in a cube made of another one's channels: these spread together.
    pub fn error_estimate(&self) -> Result<Vec<f64>> {
        if self.header.attributes.contains_key("derived") {
            return Ok(vec![f64::NAN; self.channels().len()]);
        }
        let mut totals = estimate::Totals::new(self.channels().len(), self.header.epoch);
        for tile in 0..self.grid().count() {
            if let Some(record) = Journal::of(self, tile).last()? {
                totals.replace(None, &record);
            }
        }
        Ok(totals.error_estimate())
    }

    /// Tiles that some process works on at this moment: those of the first range found.
    pub fn in_use(&self) -> Option<Range<u32>> {
        TileLock::held(&self.private(), 0..self.grid().count())
    }

    /// All tiles that some process works on at this moment.
    pub fn all_in_use(&self) -> Vec<Range<u32>> {
        TileLock::all_held(&self.private(), 0..self.grid().count())
    }

    /// Holds what [`Cube::probe_from_here`] must feel on every other machine.
    pub fn hold_probe(&self) -> Result<Probe> {
        Probe::hold(&self.path, &self.private())
    }

    /// Whether this machine can write to the cube and lock its tiles; and if so, whether somebody's probe is felt.
    pub fn probe_from_here(&self) -> Result<bool> {
        let file = self.private().join(format!("probe-{}", files::random_suffix()));
        let written = files::write_durably(&file, b"").and_then(|()| fs::remove_file(&file));
        written.map_err(|error| Error::storage(&self.path, format!("cannot be written: {error}")))?;
        Probe::is_felt(&self.path, &self.private())
    }

    pub(super) fn private(&self) -> PathBuf {
        self.path.join(PRIVATE)
    }

    pub(super) fn aside_folder(&self) -> PathBuf {
        self.private().join("aside")
    }

    pub(super) fn journal_folder(&self) -> PathBuf {
        self.private().join("journal")
    }

    /// The file of a tile in one of the arrays.
    pub(super) fn part_path(&self, part: Part, tile: u32) -> PathBuf {
        let [column, row] = self.grid().position(tile);
        let name = part.name();
        self.path.join(match part {
            Part::Radiance | Part::Overview | Part::StandardError => format!("{name}/c/0/{row}/{column}"),
            Part::Samples => format!("{name}/c/{row}/{column}"),
            Part::Preview => format!("{name}/c/{row}/{column}/0"),
        })
    }

    /// Where a file of a tile lies before it takes its place, under the suffix of its commit.
    pub(super) fn aside_path(&self, part: Part, tile: u32, suffix: u64) -> PathBuf {
        self.aside_folder().join(format!("{tile}.{suffix:016x}.{}", part.name()))
    }
}

/// The tiles whose samples are `such`, those that follow each other together.
fn ranges(samples: &[u32], such: impl Fn(u32) -> bool) -> Vec<Range<u32>> {
    let mut found: Vec<Range<u32>> = Vec::new();
    for (tile, _) in (0..).zip(samples).filter(|(_, n)| such(**n)) {
        match found.last_mut() {
            Some(last) if last.end == tile => last.end += 1,
            _ => found.push(tile..tile + 1),
        }
    }
    found
}

fn read_doubles(path: &Path, count: usize) -> Result<Vec<f64>> {
    let bytes = fs::read(path).map_err(|error| Error::storage(path, format!("cannot be read: {error}")))?;
    if bytes.len() != 8 * count {
        return Err(Error::storage(path, format!("is damaged: {} bytes long, not {}", bytes.len(), 8 * count)));
    }
    Ok(bytes.as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect())
}

/// The metadata of the Zarr group at `path`, if that is a Spectile cube of a layout this version knows.
pub(super) fn read_group(path: &Path) -> Result<Value> {
    let refuse = |what: &str| Err(Error::storage(path, what));
    match fs::metadata(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => return refuse("there is no such cube"),
        Err(error) => return Err(Error::storage(path, error)),
        Ok(found) if !found.is_dir() => return refuse("is a file; a cube is a folder, usually NAME.zarr"),
        Ok(_) => {}
    }
    let text = match fs::read_to_string(path.join("zarr.json")) {
        Ok(text) => text,
        Err(error) if error.kind() == ErrorKind::NotFound => {
            return refuse("is not a Spectile cube: it holds no zarr.json");
        }
        Err(error) => return Err(Error::storage(&path.join("zarr.json"), error)),
    };
    let group: Value = match serde_json::from_str(&text) {
        Ok(group) => group,
        Err(error) => return refuse(&format!("is not a Spectile cube: its zarr.json is not JSON ({error})")),
    };
    match group["attributes"]["spectile_format"].as_u64() {
        Some(FORMAT) => Ok(group),
        Some(newer) => refuse(&format!("is a Spectile cube of format {newer}; this version reads format {FORMAT}")),
        None => refuse("is a Zarr store, but not a Spectile cube: it has no attribute `spectile_format`"),
    }
}
