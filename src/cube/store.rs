//! The cube as a folder: opening and reading it.

use std::fs::{self, File};
use std::io::{ErrorKind, Read};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use serde_json::Value;

use super::counts::Counts;
use super::estimate;
use super::grid::Grid;
use super::journal::Journal;
use super::layer::Layer;
use super::lock::{Probe, TileLock};
use super::map::Chunk;
use super::metadata::{DERIVED, Header, Layout, Recorded};
use super::weights::{Groups, Merging, Weights};
use crate::spectral::Channels;
use crate::spectral::colour::Projection;
use crate::spectral::product::{Basis, Expander};
use crate::{Error, Result, files};

/// Folder of everything that is not plain Zarr.
pub(super) use crate::files::output::PRIVATE;
/// What the cube is known by, in it.
pub(super) const RECORD: &str = ".spectile/cube.json";

/// Folder of the journals, there.
pub(super) const JOURNALS: &str = "journal";

/// The arrays that each tile has a file of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TileArray {
    Radiance,
    Samples,
    Preview,
    Overview,
    /// Only in cubes that have it.
    StandardError,
    /// Instead of the radiance, and of the standard error, in factored cubes.
    Weights,
    Products,
    /// What does not separate, in factored cubes that have it, and where standard errors are wanted its own.
    Remainder,
    RemainderError,
    /// Only in cubes that have it.
    Layer(Layer),
}

impl TileArray {
    /// In the order in which they are written and take their places.
    pub const ALL: [TileArray; 5] =
        [TileArray::Radiance, TileArray::Samples, TileArray::Preview, TileArray::Overview, TileArray::StandardError];
    const FACTORED: [TileArray; 5] =
        [TileArray::Weights, TileArray::Samples, TileArray::Preview, TileArray::Overview, TileArray::Products];

    /// Files of a tile at most, at most without remainder, and at most without layers.
    pub const MOST: usize = TileArray::WITHOUT_REMAINDER + 2;
    pub const WITHOUT_REMAINDER: usize = TileArray::WITHOUT_LAYERS + Layer::ALL.len();
    pub const WITHOUT_LAYERS: usize = TileArray::ALL.len();

    /// Those of cubes of all kinds.
    pub fn all() -> impl Iterator<Item = TileArray> {
        let layers = Layer::ALL.map(TileArray::Layer);
        let factored = [TileArray::Weights, TileArray::Products, TileArray::Remainder, TileArray::RemainderError];
        TileArray::ALL.into_iter().chain(factored).chain(layers)
    }

    /// Its place among a tile's files.
    pub fn place(self) -> usize {
        match self {
            TileArray::Radiance | TileArray::Weights => 0,
            TileArray::Samples => 1,
            TileArray::Preview => 2,
            TileArray::Overview => 3,
            TileArray::StandardError | TileArray::Products => 4,
            TileArray::Layer(layer) => TileArray::WITHOUT_LAYERS + layer as usize,
            TileArray::Remainder => TileArray::WITHOUT_REMAINDER,
            TileArray::RemainderError => TileArray::WITHOUT_REMAINDER + 1,
        }
    }

    /// Whether it has all channels of every pixel.
    pub fn has_channels(self) -> bool {
        use TileArray::{Radiance, Remainder, RemainderError, StandardError};
        matches!(self, Radiance | StandardError | Remainder | RemainderError)
    }

    /// Whether it can be made anew from the others.
    pub fn is_derived(self) -> bool {
        matches!(self, TileArray::Samples | TileArray::Preview | TileArray::Overview)
    }

    pub fn name(self) -> &'static str {
        match self {
            TileArray::Radiance => "radiance",
            TileArray::Samples => "samples",
            TileArray::Preview => "preview",
            TileArray::Overview => "overview",
            TileArray::StandardError => "standard_error",
            TileArray::Weights => "weights",
            TileArray::Products => "products",
            TileArray::Remainder => "remainder",
            TileArray::RemainderError => "remainder_standard_error",
            TileArray::Layer(layer) => layer.name(),
        }
    }
}

/// A cube on disk. Any number of threads and processes may read it while it grows.
pub struct Cube {
    path: PathBuf,
    header: Header,
    layout: Layout,
    origin: Origin,
    projection: Projection,
    parts: Vec<TileArray>,
    layers: Vec<Layer>,
    expander: OnceLock<Expander>,
}

/// By what a cube is known, which decides whether it can be gone on with.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Origin {
    /// Its record under `.spectile/`; the version of Spectile that made it.
    Record { made_by: String },
    /// Its metadata, since the record is damaged.
    DamagedRecord { made_by: String },
    /// Its metadata: somebody has copied it without `.spectile/`, where its journals are.
    Copy,
    /// Its metadata, in version 1 of the layout.
    Older { made_by: String },
    /// Counts of a sensor, by their metadata: no cube of radiance.
    Counts(Counts),
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

    /// How many tiles have no samples, of how many.
    pub fn tiles_missing(&self) -> [u32; 2] {
        [self.tiles - self.tiles_started, self.tiles]
    }
}

impl Cube {
    /// Opens a cube that another process may be rendering at this moment.
    pub fn open(path: &Path) -> Result<Cube> {
        check_folder(path)?;
        let damaged = match fs::read_to_string(path.join(RECORD)) {
            Ok(text) => match Header::from_record(path, &text)? {
                Recorded::Sound { header, made_by } if path.join(PRIVATE).join(JOURNALS).is_dir() => {
                    return Ok(Cube::new(path, *header, Layout::Columns, Origin::Record { made_by }));
                }
                Recorded::Sound { header, .. } => {
                    return Ok(Cube::new(path, *header, Layout::Columns, Origin::Copy));
                }
                Recorded::Damaged => true,
            },
            Err(error) if error.kind() == ErrorKind::NotFound => false,
            // Bytes that are no text.
            Err(error) if error.kind() == ErrorKind::InvalidData => true,
            Err(error) => return Err(Error::storage(&path.join(RECORD), error)),
        };
        let group = read_group(path)?;
        let (header, layout) = Header::parse(path, &group, |count| {
            let values = read_doubles(&path.join("wavelength_bounds/c/0/0"), 2 * count)?;
            Ok(values.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect())
        })?;
        let made_by = group["attributes"]["spectile_version"].as_str().unwrap_or("another version").to_owned();
        let origin = match layout {
            Layout::Rows => Origin::Older { made_by },
            Layout::Columns if damaged => Origin::DamagedRecord { made_by },
            Layout::Columns => Origin::Copy,
        };
        Ok(Cube::new(path, header, layout, origin))
    }

    /// The same for whoever takes its numbers: not where somebody has changed what they mean.
    pub fn open_to_read(path: &Path) -> Result<Cube> {
        let cube = Cube::open(path)?;
        if cube.layout == Layout::Columns {
            cube.header.check_in_place(path)?;
        }
        Ok(cube)
    }

    pub(super) fn new(path: &Path, header: Header, layout: Layout, origin: Origin) -> Cube {
        let projection = Projection::new(&header.channels);
        let layers = header.layers();
        let parts = match (header.is_factored(), header.has_uncertainty()) {
            // None that a journal tells of.
            _ if matches!(origin, Origin::Counts(_)) => &[][..],
            (true, _) => &TileArray::FACTORED[..],
            (false, true) => &TileArray::ALL,
            (false, false) => &TileArray::ALL[..4],
        };
        let remainder = [TileArray::Remainder, TileArray::RemainderError];
        let of_remainder = match (header.has_remainder(), header.has_uncertainty()) {
            (false, _) => &[][..],
            (true, false) => &remainder[..1],
            (true, true) => &remainder,
        };
        let of_layers = layers.iter().copied().map(TileArray::Layer);
        let parts = parts.iter().chain(of_remainder).copied().chain(of_layers).collect();
        Cube { path: path.to_owned(), header, layout, origin, projection, parts, layers, expander: OnceLock::new() }
    }

    /// A cube that this version has just made.
    pub(super) fn made(path: &Path, header: Header) -> Cube {
        Cube::new(path, header, Layout::Columns, Origin::Record { made_by: env!("CARGO_PKG_VERSION").into() })
    }

    /// How counts are read, of a cube that holds them.
    pub(super) fn counts(&self) -> Option<&Counts> {
        match &self.origin {
            Origin::Counts(counts) => Some(counts),
            _ => None,
        }
    }

    pub(super) fn set_counts(&mut self, counts: Counts) {
        self.origin = Origin::Counts(counts);
    }

    pub(super) fn set_projection(&mut self, projection: Projection) {
        self.projection = projection;
    }

    pub(super) fn layout(&self) -> Layout {
        self.layout
    }

    pub(super) fn origin(&self) -> &Origin {
        &self.origin
    }

    /// Why this cube can be read, but not gone on with, if so.
    pub fn is_only_read(&self) -> Option<String> {
        match &self.origin {
            Origin::Record { .. } | Origin::DamagedRecord { .. } => None,
            Origin::Copy => {
                Some(format!("it is a copy without {PRIVATE}, where the journals are by which a render goes on"))
            }
            Origin::Older { made_by } => {
                Some(format!("its layout is that of version 1, by Spectile {made_by}, which this one reads only"))
            }
            Origin::Counts(_) => Some("it holds counts of a sensor".into()),
        }
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// An attribute of the group that is not the cube's, if its record tells which are.
    pub(super) fn foreign_attribute(&self) -> Result<Option<String>> {
        if !matches!(self.origin, Origin::Record { .. }) {
            return Ok(None);
        }
        let (own, _) = self.header.metadata()?;
        let is_own = |name: &&String| own["attributes"].get(name.as_str()).is_some();
        let group = read_group(&self.path)?;
        Ok(group["attributes"].as_object().and_then(|all| all.keys().find(|name| !is_own(name)).cloned()))
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
    ///
    /// Of counts 1 where there are some.
    pub fn samples(&self, tile: u32) -> Result<u32> {
        if self.counts().is_some() {
            return Ok(self.counts_path("counts", tile).exists().into());
        }
        let mut bytes = Vec::new();
        if let Some(mut file) = self.open_part(TileArray::Samples, tile)? {
            let path = self.part_path(TileArray::Samples, tile);
            file.read_to_end(&mut bytes).map_err(|error| Error::storage(&path, error))?;
            let bytes = bytes.try_into().map_err(|_| Error::storage(&path, "is damaged: not 4 bytes long"))?;
            return Ok(u32::from_le_bytes(bytes));
        }
        Ok(0)
    }

    /// The file of a tile in one of the arrays, as the last commit left it; `None` before the tile's first unit. One that is
    /// gone although the tile is known to have been rendered is an error.
    pub(super) fn open_part(&self, part: TileArray, tile: u32) -> Result<Option<File>> {
        let path = self.part_path(part, tile);
        let open = |path: &Path| match File::open(path) {
            Ok(file) => Ok(Some(file)),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
            Err(error) => Err(Error::storage(path, format!("cannot be opened: {error}"))),
        };
        if let Some(file) = open(&path)? {
            return Ok(Some(file));
        }
        let journal = Journal::of(self, tile);
        let is_orphan = || self.origin == Origin::Copy && self.part_path(self.main_part(), tile).exists();
        let witness = match part {
            TileArray::Samples if journal.last()?.is_some() => "its journal",
            TileArray::Samples if is_orphan() => "another of its files",
            TileArray::Samples => return Ok(None),
            _ if self.open_part(TileArray::Samples, tile)?.is_none() => return Ok(None),
            _ => "`samples`",
        };
        // The files of a commit take their places one after the other, and whoever did that may have been killed: the rest
        // still lies aside. Or it has come to its place by now, which no file in place ever leaves. So the journal is read
        // after what says that there is something, and the place after that.
        if let Some(record) = journal.last()?
            && let Some(file) = open(&self.aside_path(part, tile, record.suffix))?
        {
            return Ok(Some(file));
        }
        if let Some(file) = open(&path)? {
            return Ok(Some(file));
        }
        let mend = match self.is_only_read() {
            None => "restore it from a copy, or have the tile rendered again by the same command with --resume",
            Some(_) => "restore it from where the cube comes from",
        };
        Err(Error::storage(&path, format!("is missing, although {witness} says that tile {tile} was rendered; {mend}")))
    }

    /// The error of a tile that was rendered and of which a file is gone.
    pub fn check_files(&self, tile: u32) -> Result<()> {
        self.parts().iter().try_for_each(|&part| self.open_part(part, tile).map(drop))
    }

    /// Tiles of which a file is gone, among those that have `samples`.
    pub fn lost(&self, samples: &[u32]) -> Vec<Range<u32>> {
        let is_lost = |tile: u32| self.check_files(tile).is_err();
        let lost: Vec<u32> = (0..).zip(samples).map(|(tile, &n)| u32::from(n > 0 && is_lost(tile))).collect();
        ranges(&lost, |lost| lost == 1)
    }

    /// Samples per pixel of every tile.
    pub fn all_samples(&self) -> Result<Vec<u32>> {
        (0..self.grid().count()).map(|tile| self.samples(tile)).collect()
    }

    /// How far the whole cube has got.
    pub fn progress(&self) -> Result<Progress> {
        Ok(Progress::of(&self.all_samples()?))
    }

    /// The radiance of a tile, mapped into memory or, in factored cubes, made of its weights; `None` before its first unit.
    pub fn chunk(&self, tile: u32) -> Result<Option<Chunk>> {
        self.state().radiance(tile)
    }

    /// The standard errors of a tile, mapped into memory like [`Cube::chunk`]: NaN below two epochs. `None` before its
    /// first unit, and in cubes without them.
    pub fn error_chunk(&self, tile: u32) -> Result<Option<Chunk>> {
        self.state().standard_errors(tile)
    }

    /// What the products of a factored cube are made of. Errors: a cube that is none.
    pub fn basis(&self) -> Result<Basis> {
        let what = "holds radiance, not weights of products of spectra: only cubes of `spectile render --factored` can be relit";
        self.header.basis().ok_or_else(|| Error::Usage(format!("{} {what}", self.path.display())))
    }

    /// What makes channels of the products of a factored cube.
    pub(super) fn expander(&self) -> Result<&Expander> {
        if let Some(expander) = self.expander.get() {
            return Ok(expander);
        }
        let basis = self.basis()?;
        Ok(self.expander.get_or_init(|| Expander::new(&basis, self.channels(), self.header.most_factors())))
    }

    /// The weights of a tile of a factored cube, from its two files; `None` where these are not of the same commit.
    pub(super) fn weights_from(&self, files: [(&Path, &mut File); 2]) -> Result<Option<Weights>> {
        let [weights, products] = files.map(|(path, file)| {
            let mut bytes = Vec::new();
            let read = file.read_to_end(&mut bytes);
            read.map(|_| (path, bytes)).map_err(|error| Error::storage(path, format!("cannot be read: {error}")))
        });
        let ((path, weights), (products_path, products)) = (weights?, products?);
        Weights::decode(&self.header, [(path, &weights), (products_path, &products)])
    }

    /// As [`Merging::new`].
    pub fn merging(
        &self,
        tile: u32,
        old: Option<Weights>,
        n_before: u32,
        unit: Weights,
        n_unit: u32,
    ) -> Result<Merging> {
        let (rect, [x, y]) = (self.grid().rect(tile), self.header.origin);
        let at = [x + rect.x0, y + rect.y0];
        Ok(Merging::new(&self.header, self.expander()?, at, old, n_before, unit, n_unit))
    }

    /// How the samples of a tile are spread over the groups of epochs of a factored cube.
    pub fn groups(&self, samples: u32) -> Groups {
        Groups::new(samples, self.header.epoch, self.header.groups())
    }

    /// Maps a file of a tile that has all channels of every pixel; `path` is what errors name.
    pub(super) fn map(&self, file: &File, path: &Path, tile: u32) -> Result<Chunk> {
        Chunk::map(file, path, self.grid().rect(tile), self.header.tile, self.channels().len(), self.layout)
    }

    /// The same of a file that may not be there.
    pub(super) fn mapped(&self, path: &Path, tile: u32) -> Result<Option<Chunk>> {
        match File::open(path) {
            Ok(file) => self.map(&file, path, tile).map(Some),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
            Err(error) => Err(Error::storage(path, format!("cannot be opened: {error}"))),
        }
    }

    /// The parts that each tile of this cube has.
    pub(super) fn parts(&self) -> &[TileArray] {
        &self.parts
    }

    /// The layers that it has.
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// The one from which all that is derived can be made, with others of [`Cube::parts`] that cannot.
    pub(super) fn main_part(&self) -> TileArray {
        self.parts()[0]
    }

    /// The K channels of the pixel in column `x` and row `y` from the top left, in one contiguous read; `None` before
    /// the first unit of its tile.
    pub fn spectrum(&self, x: u32, y: u32) -> Result<Option<Vec<f32>>> {
        self.check_pixel(x, y)?;
        self.state().spectrum(x, y)
    }

    /// The standard errors of the pixel's channels, as [`Cube::spectrum`] gives their values; `None` also in cubes without
    /// them. NaN below two epochs.
    pub fn standard_error(&self, x: u32, y: u32) -> Result<Option<Vec<f32>>> {
        self.check_pixel(x, y)?;
        self.state().standard_error(x, y)
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
        if self.is_derived() {
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

    /// The errors of all tiles at their last two looks ([`super::Writer::looks`]); infinite before them.
    pub fn all_looks(&self) -> Result<Vec<[f32; 2]>> {
        let looks = |tile| Ok(Journal::of(self, tile).last()?.map_or(estimate::UNSEEN, |record| record.looks));
        (0..self.grid().count()).map(looks).collect()
    }

    /// Of tiles with these samples per pixel those that have fewer than `limit` and are not as exact as `tile_error` either.
    pub fn unfinished(&self, samples: &[u32], limit: u32, tile_error: Option<f64>) -> Result<Vec<u32>> {
        let mut lacking: Vec<u32> = (0..).zip(samples).filter(|(_, n)| **n < limit).map(|(tile, _)| tile).collect();
        if let Some(error) = tile_error {
            let looks = self.all_looks()?;
            lacking.retain(|&tile| !estimate::is_within(looks[tile as usize], error));
        }
        Ok(lacking)
    }

    /// Whether it was made of another cube's channels.
    pub fn is_derived(&self) -> bool {
        self.header.attributes.contains_key(DERIVED) || self.counts().is_some()
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
        self.private().join(JOURNALS)
    }

    /// The file of a tile in one of the arrays.
    pub(super) fn part_path(&self, part: TileArray, tile: u32) -> PathBuf {
        let [column, row] = self.grid().position(tile);
        let name = part.name();
        self.path.join(match part {
            TileArray::Samples => format!("{name}/c/{row}/{column}"),
            TileArray::Preview => format!("{name}/c/{row}/{column}/0"),
            TileArray::Weights | TileArray::Products => format!("{name}/c/{row}/{column}/0/0"),
            TileArray::Layer(layer) if layer.axes().len() == 1 => format!("{name}/c/{row}/{column}"),
            TileArray::Layer(_) => format!("{name}/c/{row}/{column}/0"),
            // Channels of pixels, or of blocks of them.
            _ => format!("{name}/c/0/{row}/{column}"),
        })
    }

    /// Where a file of a tile lies before it takes its place, under the suffix of its commit.
    pub(super) fn aside_path(&self, part: TileArray, tile: u32, suffix: u64) -> PathBuf {
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

pub(super) fn read_doubles(path: &Path, count: usize) -> Result<Vec<f64>> {
    let bytes = fs::read(path).map_err(|error| Error::storage(path, format!("cannot be read: {error}")))?;
    if bytes.len() != 8 * count {
        return Err(Error::storage(path, format!("is damaged: {} bytes long, not {}", bytes.len(), 8 * count)));
    }
    Ok(bytes.as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect())
}

pub(super) fn check_folder(path: &Path) -> Result<()> {
    match fs::metadata(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => Err(Error::storage(path, "there is no such cube")),
        Err(error) => Err(Error::storage(path, error)),
        Ok(found) if !found.is_dir() => Err(Error::storage(path, "is a file; a cube is a folder, usually NAME.zarr")),
        Ok(_) => Ok(()),
    }
}

/// The metadata of the Zarr group at `path`.
pub(super) fn read_group(path: &Path) -> Result<Value> {
    let refuse = |what: &str| Err(Error::storage(path, what));
    let text = match fs::read(path.join("zarr.json")) {
        Ok(text) => text,
        Err(error) if error.kind() == ErrorKind::NotFound => {
            return refuse("is not a Spectile cube: it holds no zarr.json");
        }
        Err(error) => return Err(Error::storage(&path.join("zarr.json"), error)),
    };
    match serde_json::from_slice(&text) {
        Ok(group) => Ok(group),
        Err(error) => refuse(&format!("is not a Spectile cube: its zarr.json is not JSON ({error})")),
    }
}
