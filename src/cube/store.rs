//! The cube as a folder: creating, opening, replacing and reading it.

use std::fs::{self, File};
use std::io::{ErrorKind, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde_json::Value;

use super::estimate::TileSums;
use super::grid::Grid;
use super::map::Chunk;
use super::metadata::{FORMAT, Header};
use crate::files;
use crate::spectral::Channels;
use crate::spectral::colour::{Picture, Projection};
use crate::{Error, Result};

/// Folder of everything that is not plain Zarr.
const PRIVATE: &str = ".spectile";
/// Arrays that later versions add and this one must not mistake for somebody else's files.
const OTHER_ARRAYS: [&str; 1] = ["standard_error"];

/// A cube on disk. Any number of threads and processes may read it while it grows.
pub struct Cube {
    path: PathBuf,
    header: Header,
    pub(super) projection: Projection,
    /// Held, by tile number modulo their count, while a tile is merged: a merge reads what it replaces.
    merging: [Mutex<()>; 32],
}

/// How far a cube has got.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    pub tiles: u32,
    /// Tiles with at least one sample.
    pub tiles_started: u32,
    /// The least and the most samples per pixel of the tiles with any.
    pub samples: [u32; 2],
}

impl Cube {
    /// Whether [`Cube::create`] may make a cube at `path`; says why not. Changes nothing.
    pub fn check_target(path: &Path, header: &Header, overwrite: bool) -> Result<()> {
        find_target(path, header, overwrite).map(|_| ())
    }

    /// Makes an empty cube at `path`: built under a temporary name beside it and renamed. What is there already is an
    /// error unless `overwrite`, and then only a Spectile cube is replaced. Too little space on the disk is an error.
    pub fn create(path: &Path, header: Header, overwrite: bool) -> Result<Cube> {
        let (target, replaces) = find_target(path, &header, overwrite)?;
        let path = target.as_path();

        let mut building = Building(Some(files::sibling(path, "creating")));
        let temporary = building.0.as_deref().unwrap_or(path);
        write_empty(temporary, &header).map_err(|error| match error {
            // Nobody knows the temporary name: name the cube.
            Error::Storage { what, .. } => Error::storage(path, what),
            error => error,
        })?;
        let failed = |error: std::io::Error| Error::storage(path, format!("cannot be created: {error}"));
        if replaces {
            let old = files::sibling(path, "replaced");
            fs::rename(path, &old).map_err(failed)?;
            if let Err(error) = fs::rename(temporary, path) {
                fs::rename(&old, path).map_err(failed)?;
                return Err(failed(error));
            }
            building.0 = None;
            fs::remove_dir_all(&old).map_err(|error| Error::storage(&old, format!("cannot be removed: {error}")))?;
        } else {
            fs::rename(temporary, path).map_err(failed)?;
            building.0 = None;
        }
        Ok(Cube::new(path, header))
    }

    /// Opens a cube that another process may be rendering at this moment.
    pub fn open(path: &Path) -> Result<Cube> {
        let group = read_group(path)?;
        let header = Header::parse(path, &group, |count| {
            let values = read_doubles(&path.join("wavelength_bounds/c/0/0"), 2 * count)?;
            Ok(values.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect())
        })?;
        Ok(Cube::new(path, header))
    }

    fn new(path: &Path, header: Header) -> Cube {
        let projection = Projection::new(&header.channels);
        Cube { path: path.to_owned(), header, projection, merging: Default::default() }
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
        let path = self.samples_path(tile);
        match fs::read(&path) {
            Ok(bytes) => {
                let bytes = bytes.try_into().map_err(|_| Error::storage(&path, "is damaged: not 4 bytes long"))?;
                Ok(u32::from_le_bytes(bytes))
            }
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(0),
            Err(error) => Err(Error::storage(&path, error)),
        }
    }

    /// How far the whole cube has got.
    pub fn progress(&self) -> Result<Progress> {
        let tiles = self.grid().count();
        let mut progress = Progress { tiles, tiles_started: 0, samples: [u32::MAX, 0] };
        for tile in 0..tiles {
            let samples = self.samples(tile)?;
            if samples > 0 {
                progress.tiles_started += 1;
                progress.samples = [progress.samples[0].min(samples), progress.samples[1].max(samples)];
            }
        }
        if progress.tiles_started == 0 {
            progress.samples = [0, 0];
        }
        Ok(progress)
    }

    /// The radiance of a tile, mapped into memory; `None` before its first unit.
    pub fn chunk(&self, tile: u32) -> Result<Option<Chunk>> {
        Chunk::open(&self.chunk_path(tile), self.grid().rect(tile), self.header.tile, self.channels().len())
    }

    /// The K channels of the pixel in column `x` and row `y` from the top left, in one contiguous read; `None` before
    /// the first unit of its tile.
    pub fn spectrum(&self, x: u32, y: u32) -> Result<Option<Vec<f32>>> {
        let [width, height] = self.header.size;
        if x >= width || y >= height {
            let what = format!("pixel {x} {y} is outside the picture; columns are 0..{width}, rows 0..{height}");
            return Err(Error::Usage(format!("{}: {what}", self.path.display())));
        }
        let grid = self.grid();
        let tile = grid.tile_at(x, y);
        let path = self.chunk_path(tile);
        let mut file = match File::open(&path) {
            Ok(file) => file,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(Error::storage(&path, error)),
        };
        let rect = grid.rect(tile);
        let pixel = u64::from(y - rect.y0) * u64::from(grid.tile[0]) + u64::from(x - rect.x0);
        let mut spectrum = vec![0.0f32; self.channels().len()];
        file.seek(SeekFrom::Start(pixel * spectrum.len() as u64 * 4))
            .and_then(|_| file.read_exact(bytemuck::cast_slice_mut(&mut spectrum)))
            .map_err(|error| Error::storage(&path, format!("is damaged: {error}")))?;
        Ok(Some(spectrum))
    }

    /// The preview of the whole picture, NaN where nothing is rendered yet.
    pub fn preview(&self) -> Result<Picture> {
        let grid = self.grid();
        let [width, height] = grid.size.map(|side| side as usize);
        let mut rgb = vec![f32::NAN; width * height * 3];
        let mut tile_rgb = vec![0.0f32; grid.tile_pixels() * 3];
        for tile in 0..grid.count() {
            let path = self.preview_path(tile);
            match File::open(&path) {
                Ok(mut file) => file
                    .read_exact(bytemuck::cast_slice_mut(&mut tile_rgb))
                    .map_err(|error| Error::storage(&path, format!("is damaged: {error}")))?,
                Err(error) if error.kind() == ErrorKind::NotFound => continue,
                Err(error) => return Err(Error::storage(&path, error)),
            }
            let rect = grid.rect(tile);
            let row_length = rect.width() as usize * 3;
            for (y, row) in (rect.y0..rect.y1).zip(tile_rgb.chunks_exact(grid.tile[0] as usize * 3)) {
                let start = (y as usize * width + rect.x0 as usize) * 3;
                rgb[start..start + row_length].copy_from_slice(&row[..row_length]);
            }
        }
        Ok(Picture { size: grid.size, rgb })
    }

    /// The error estimate of every channel (DESIGN section 8), from the spread of the epochs: sqrt(Σ variance of the
    /// mean / Σ mean²), sums over the pixels of all tiles begun. NaN while any of those has fewer than two epochs, 0
    /// where a channel is all zero.
    pub fn error_estimate(&self) -> Result<Vec<f64>> {
        let sums = (0..self.grid().count()).map(|tile| self.sums(tile));
        super::estimate::error_estimate(sums, self.header.epoch, self.channels().len())
    }

    /// What is kept for the error estimate of a tile; `None` before its first unit.
    pub(super) fn sums(&self, tile: u32) -> Result<Option<TileSums>> {
        TileSums::read(&self.sums_path(tile), self.channels().len())
    }

    pub(super) fn hold(&self, tile: u32) -> MutexGuard<'_, ()> {
        // The lock guards no data of its own, so a thread that died holding it has broken nothing.
        self.merging[tile as usize % self.merging.len()].lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn aside_folder(&self) -> PathBuf {
        self.path.join(PRIVATE).join("aside")
    }

    pub(super) fn chunk_path(&self, tile: u32) -> PathBuf {
        let [column, row] = self.grid().position(tile);
        self.path.join(format!("radiance/c/0/{row}/{column}"))
    }

    pub(super) fn samples_path(&self, tile: u32) -> PathBuf {
        let [column, row] = self.grid().position(tile);
        self.path.join(format!("samples/c/{row}/{column}"))
    }

    pub(super) fn preview_path(&self, tile: u32) -> PathBuf {
        let [column, row] = self.grid().position(tile);
        self.path.join(format!("preview/c/{row}/{column}/0"))
    }

    pub(super) fn overview_path(&self, tile: u32) -> PathBuf {
        let [column, row] = self.grid().position(tile);
        self.path.join(format!("overview/c/0/{row}/{column}"))
    }

    pub(super) fn sums_path(&self, tile: u32) -> PathBuf {
        self.path.join(PRIVATE).join("sums").join(tile.to_string())
    }
}

/// Where a new cube goes, and whether it replaces one.
fn find_target(path: &Path, header: &Header, overwrite: bool) -> Result<(PathBuf, bool)> {
    header.validate().map_err(|what| Error::Usage(format!("{}: {what}", path.display())))?;
    // A link to a cube on another disk stays a link.
    let target = if overwrite { fs::canonicalize(path).unwrap_or(path.to_owned()) } else { path.to_owned() };
    let replaces = match fs::symlink_metadata(&target) {
        Err(error) if error.kind() == ErrorKind::NotFound => false,
        Err(error) => return Err(Error::storage(&target, error)),
        Ok(_) if overwrite => {
            check_removable(&target)?;
            true
        }
        Ok(_) => {
            let what = "exists already; choose another name, or --overwrite to replace a cube";
            return Err(Error::Usage(format!("{} {what}", target.display())));
        }
    };
    let folder = files::parent(&target);
    if !folder.is_dir() {
        return Err(Error::storage(&target, format!("cannot be created: there is no folder {}", folder.display())));
    }
    check_space(&target, header, if replaces { folder_bytes(&target) } else { 0 })?;
    Ok((target, replaces))
}

/// The temporary folder of a cube that is being built, removed again unless it has taken its place.
struct Building(Option<PathBuf>);

impl Drop for Building {
    fn drop(&mut self) {
        if let Some(folder) = &self.0 {
            // Creation has failed already; that error is the one to report.
            let _ = fs::remove_dir_all(folder);
        }
    }
}

/// Writes metadata, coordinates and empty folders of a cube into a new folder.
fn write_empty(folder: &Path, header: &Header) -> Result<()> {
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        fs::create_dir_all(files::parent(&path))
            .and_then(|()| fs::write(&path, bytes))
            .map_err(|error| Error::storage(&path, format!("{name} cannot be written: {error}")))
    };
    let (group, arrays) = header.metadata()?;
    for (name, array) in arrays {
        write(&format!("{name}/zarr.json"), pretty(&array).as_bytes())?;
    }
    let channels = &header.channels;
    let each = |value: &dyn Fn(usize) -> f64| doubles((0..channels.len()).map(value));
    write("wavelength/c/0", &each(&|k| channels.centre(k)))?;
    write("wavelength_bounds/c/0/0", &doubles(channels.bounds.iter().flatten().copied()))?;
    write("response_integral/c/0", &each(&|k| channels.width(k)))?;
    for (axis, name) in ["x", "y"].into_iter().enumerate() {
        let centres = (0..header.size[axis]).map(|i| f64::from(header.origin[axis]) + f64::from(i) + 0.5);
        write(&format!("{name}/c/0"), &doubles(centres))?;
    }
    for private in ["aside", "sums"] {
        let path = folder.join(PRIVATE).join(private);
        fs::create_dir_all(&path).map_err(|error| Error::storage(&path, format!("cannot be created: {error}")))?;
    }
    // Last, so that the folder is a Zarr group only once all it speaks of is there.
    write("zarr.json", pretty(&group).as_bytes())
}

fn pretty(value: &Value) -> String {
    format!("{value:#}\n")
}

fn doubles(values: impl Iterator<Item = f64>) -> Vec<u8> {
    values.flat_map(f64::to_le_bytes).collect()
}

fn read_doubles(path: &Path, count: usize) -> Result<Vec<f64>> {
    let bytes = fs::read(path).map_err(|error| Error::storage(path, format!("cannot be read: {error}")))?;
    if bytes.len() != 8 * count {
        return Err(Error::storage(path, format!("is damaged: {} bytes long, not {}", bytes.len(), 8 * count)));
    }
    Ok(bytes.as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect())
}

/// The metadata of the Zarr group at `path`, if that is a Spectile cube of a layout this version knows.
fn read_group(path: &Path) -> Result<Value> {
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

/// Whether `path` is a Spectile cube and nothing else, so that replacing it loses nobody's other files.
fn check_removable(path: &Path) -> Result<()> {
    let refuse = |what: String| {
        Error::Usage(format!("{}: --overwrite replaces nothing but Spectile cubes: {what}", path.display()))
    };
    if !path.exists() {
        return Err(refuse("this is a link to nothing".into()));
    }
    let group = read_group(path).map_err(|error| match error {
        Error::Storage { what, .. } => refuse(format!("this {what}")),
        error => error,
    })?;
    let arrays = group["consolidated_metadata"]["metadata"].as_object();
    let known = |name: &str| {
        [PRIVATE, "zarr.json"].contains(&name)
            || OTHER_ARRAYS.contains(&name)
            || arrays.is_some_and(|arrays| arrays.contains_key(name))
    };
    for entry in fs::read_dir(path).map_err(|error| Error::storage(path, error))? {
        let name = entry.map_err(|error| Error::storage(path, error))?.file_name();
        if !name.to_str().is_some_and(known) {
            return Err(refuse(format!("this one also holds `{}`, which is no part of it", name.display())));
        }
    }
    Ok(())
}

/// Refuses a cube that would not fit, `freed` bytes of the one it replaces counted in.
fn check_space(path: &Path, header: &Header, freed: u64) -> Result<()> {
    let needed = header.store_bytes();
    match files::free_bytes(files::parent(path)) {
        Some(free) if free.saturating_add(freed) < needed => Err(Error::Usage(format!(
            "{}: the cube needs {}, and {} are free there; use fewer channels or pixels, or another disk",
            path.display(),
            files::format_bytes(needed),
            files::format_bytes(free.saturating_add(freed))
        ))),
        _ => Ok(()),
    }
}

/// Bytes of all files under a folder; what cannot be read counts nothing.
fn folder_bytes(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .map(|entry| match entry.file_type() {
            Ok(kind) if kind.is_dir() => folder_bytes(&entry.path()),
            Ok(_) => entry.metadata().map_or(0, |metadata| metadata.len()),
            Err(_) => 0,
        })
        .sum()
}
