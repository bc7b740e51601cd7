//! A process's hold on tiles of a cube: units are merged aside, and committed in batches.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use super::checksums;
use super::choices::Brightness;
use super::create::{Existing, open_or_create, open_same};
use super::estimate::{Floor, Totals, UNSEEN};
use super::faults::step;
use super::journal::{Journal, Record};
use super::layer::TileLayers;
use super::lock::TileLock;
use super::merge::check_portion;
use super::metadata::Header;
use super::state::Window;
use super::store::{Cube, TileArray};
use super::tile_files::{Aside, Base, Committed, Held, Pending, Unit, remove_aside};
use super::weights::Weights;
use super::{recover, restore};
use crate::spectral::tone::Picture;
use crate::{Error, Result, files};

/// At most one batch is committed in this time, but for the last.
const COMMIT_EVERY: Duration = Duration::from_secs(1);
/// A batch that is so large, in bytes of radiance or in tiles, takes no more: whoever merges waits until it is committed.
pub(super) const BATCH_BYTES: u64 = 1 << 30;
const BATCH_TILES: usize = 4096;

/// The right to change some tiles of a cube, shared by the threads that do. Reading goes through [`Writer::cube`].
///
/// What is merged is on disk for good, and seen by readers, once it is committed: once a second by
/// [`Writer::commit_regularly`], which a thread of its own should run, or at once by [`Writer::flush`].
pub struct Writer {
    cube: Cube,
    tiles: Range<u32>,
    /// Samples per pixel that each of `tiles` had when this writer came.
    found: Vec<u32>,
    /// In cubes whose tiles have ends of their own.
    floor: OnceLock<Floor>,
    state: Mutex<State>,
    changed: Condvar,
    /// Layers of tiles whose first unit is about to be merged.
    layers: Mutex<BTreeMap<u32, TileLayers>>,
    /// Held during a commit.
    committing: Mutex<()>,
    /// Held, by tile number modulo their count, while a tile is merged: a merge reads what it replaces.
    merging: [Mutex<()>; 32],
    _lock: TileLock,
}

struct State {
    /// Tiles merged since the last commit, and those of the commit under way.
    open: BTreeMap<u32, Arc<Pending>>,
    committing: BTreeMap<u32, Arc<Pending>>,
    last_commit: Option<Instant>,
    totals: Totals,
    /// Of each of the writer's tiles, [`Record::looks`].
    looks: Vec<[f32; 2]>,
    /// A commit has failed; nothing more is merged.
    failed: Option<(PathBuf, String)>,
    closed: bool,
}

impl State {
    /// The error of a commit that has failed.
    fn check(&self) -> Result<()> {
        self.failed.as_ref().map_or(Ok(()), |(path, what)| Err(Error::storage(path, what)))
    }
}

impl Writer {
    /// Makes a cube or goes on with one, as `existing` says, to write to `tiles` of it. Those are locked until this is
    /// dropped, and what a killed process left of them is put in order; what that loses, if anything, `warn` is told.
    pub fn open(
        path: &Path,
        header: &Header,
        existing: Existing,
        tiles: Range<u32>,
        warn: &mut dyn FnMut(String),
    ) -> Result<Writer> {
        let cube = open_or_create(path, header, existing, &tiles)?;
        let lock = TileLock::take(cube.path(), &cube.private(), tiles.clone())?;
        // Between the look at the cube and the lock another process may have replaced it.
        if !lock.is_current(&cube.private()) {
            let what = "was replaced by another process at this moment; look at it and try again";
            return Err(Error::storage(cube.path(), what));
        }
        let cube = open_same(cube.path(), header)?;
        restore::restore(&cube)?;
        let mut totals = Totals::new(cube.channels().len(), cube.header().epoch);
        let (mut found, mut looks) = (Vec::with_capacity(tiles.len()), Vec::with_capacity(tiles.len()));
        for record in recover::recover(&cube, tiles.clone(), warn)? {
            let record = record?;
            found.push(record.as_ref().map_or(0, |record| record.samples));
            looks.push(record.as_ref().map_or(UNSEEN, |record| record.looks));
            if let Some(record) = record {
                totals.replace(None, &record);
            }
        }
        let state = State {
            open: BTreeMap::new(),
            committing: BTreeMap::new(),
            last_commit: None,
            totals,
            looks,
            failed: None,
            closed: false,
        };
        let known = Brightness::read(cube.path())?.map(|known| known.checked(&cube)).transpose()?;
        let floor = known.map_or_else(OnceLock::new, |known| OnceLock::from(Floor::of(&known.mean_radiance)));
        Ok(Writer {
            cube,
            tiles,
            found,
            floor,
            state: Mutex::new(state),
            changed: Condvar::new(),
            layers: Mutex::default(),
            committing: Mutex::new(()),
            merging: Default::default(),
            _lock: lock,
        })
    }

    pub fn cube(&self) -> &Cube {
        &self.cube
    }

    /// The tiles that this writer may change.
    pub fn tiles(&self) -> Range<u32> {
        self.tiles.clone()
    }

    /// Samples per pixel that each of [`Writer::tiles`] had when this writer came.
    pub fn found(&self) -> &[u32] {
        &self.found
    }

    /// The error estimate of every channel over the tiles of this writer, units not committed yet included; see
    /// [`Cube::error_estimate`].
    pub fn error_estimate(&self) -> Vec<f64> {
        self.lock().totals.error_estimate()
    }

    /// Notes how bright the picture is, as far as a few samples tell, unless the cube knows it: from now on the errors of tiles are
    /// looked at. Gives what it knows.
    pub fn note_brightness(&self, brightness: Brightness) -> Result<Brightness> {
        let known = brightness.record(&self.cube)?;
        self.floor.get_or_init(|| Floor::of(&known.mean_radiance));
        Ok(known)
    }

    /// The errors of a tile of this writer at the last two looks (docs/METHOD.md, Errors), units not committed yet included; infinite
    /// before them.
    pub fn looks(&self, tile: u32) -> [f32; 2] {
        self.lock().looks[(tile - self.tiles.start) as usize]
    }

    /// Whether every value merged so far is zero.
    pub fn is_dark(&self) -> bool {
        self.lock().totals.is_dark()
    }

    /// The preview with every unit merged so far; means of `factor` x `factor` pixels.
    pub fn preview(&self, factor: u32) -> Result<Picture> {
        self.state().colour(self.cube.grid().whole(), factor).map(Window::into_picture)
    }

    /// The suffix under which the files of a tile lie aside, if any do.
    pub(super) fn pending(&self, tile: u32) -> Option<u64> {
        let state = self.lock();
        state.open.get(&tile).or_else(|| state.committing.get(&tile)).map(|pending| pending.record.suffix)
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // Every change of the state is one assignment or insertion, so a thread that died has left it whole.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Merges the mean of `n_unit` samples per pixel into a tile that has `n_before`, with all that is derived from it.
    ///
    /// `unit` is [tile_h][tile_w][K], the full tile size; what lies beyond the edge of the picture is not looked at and
    /// stored as NaN. The first unit of a tile is stored bit for bit; later ones as
    /// m + (unit - m) · n_unit / (n_before + n_unit) in f64, rounded to f32, so that a constant stays exact. The first
    /// `epoch` samples may come in any portions that add up to it, then every unit is one whole epoch.
    ///
    /// Waits while the open batch is full. On an error the tile is what it was.
    pub fn merge_unit(&self, tile: u32, n_before: u32, n_unit: u32, unit: &[f32]) -> Result<()> {
        self.merge(tile, n_before, n_unit, Unit::Radiance(unit), check_portion)
    }

    /// As [`Writer::merge_unit`], the weights of a tile of a factored cube, and where that has one the mean of what does not separate.
    pub fn merge_weights(
        &self,
        tile: u32,
        n_before: u32,
        n_unit: u32,
        unit: Weights,
        remainder: Option<&[f32]>,
    ) -> Result<()> {
        self.merge(tile, n_before, n_unit, Unit::Weights(unit, remainder), check_portion)
    }

    /// Stores what was made of another cube's tile, with as many samples per pixel as that has, into one that has none.
    pub fn store(&self, tile: u32, samples: u32, values: &[f32]) -> Result<()> {
        self.merge(tile, 0, samples, Unit::Radiance(values), |_, samples, _| Ok(samples))
    }

    /// The same of values that lie as in a chunk, column by column, with their standard errors in a cube that has them.
    pub fn store_columns(&self, tile: u32, samples: u32, values: &[f32], errors: Option<&[f32]>) -> Result<()> {
        self.merge(tile, 0, samples, Unit::Columns { values, errors }, |_, samples, _| Ok(samples))
    }

    /// Gives a tile its layers, in a cube that has some: before its first unit is merged.
    pub fn lay(&self, tile: u32, layers: TileLayers) {
        self.layers.lock().unwrap_or_else(PoisonError::into_inner).insert(tile, layers);
    }

    fn merge(
        &self,
        tile: u32,
        n_before: u32,
        n_unit: u32,
        unit: Unit,
        samples_after: fn(u32, u32, u32) -> Result<u32>,
    ) -> Result<()> {
        let cube = &self.cube;
        if !self.tiles.contains(&tile) || !unit.is_for(cube.header()) {
            let what = format!("a unit of tile {tile} is not what the tiles {:?} of this cube hold", self.tiles);
            return Err(Error::Internal(what));
        }
        let _held = self.merging[tile as usize % self.merging.len()].lock().unwrap_or_else(PoisonError::into_inner);
        let base = self.base(tile)?;
        let n_found = base.as_ref().map_or(0, |base| base.record().samples);
        let seen = base.as_ref().map_or(UNSEEN, |base| base.record().looks);
        if n_found != n_before {
            let what = format!(
                "tile {tile} has {n_found} samples per pixel where {n_before} were expected: another process works on it"
            );
            return Err(Error::storage(cube.path(), what));
        }
        let samples = samples_after(n_before, n_unit, cube.header().epoch)?;
        let aside = Aside::new(cube, tile);
        let laid = match base {
            None => self.layers.lock().unwrap_or_else(PoisonError::into_inner).remove(&tile),
            Some(_) => None,
        };
        let layers = aside.write_layers(base.as_ref(), laid.as_ref())?;
        let (mut record, held) = match unit {
            Unit::Radiance(_) | Unit::Columns { .. } => {
                let record = aside.write(base.as_ref(), samples, n_unit, &unit)?;
                let mapped = |part: TileArray| {
                    let path = aside.path(part);
                    cube.mapped(&path, tile)?.ok_or_else(|| Error::storage(&path, "has vanished"))
                };
                let mean = mapped(TileArray::Radiance)?;
                let errors = cube.header().has_uncertainty().then(|| mapped(TileArray::StandardError)).transpose()?;
                (record, Held::Radiance { mean, errors })
            }
            Unit::Weights(unit, remainder) => {
                (aside.write_weights(base.as_ref(), samples, n_unit, unit, remainder)?, Held::Weights)
            }
        };
        record.checksums[TileArray::WITHOUT_LAYERS..TileArray::WITHOUT_REMAINDER].copy_from_slice(&layers);
        let (epoch, pixels) = (cube.header().epoch, cube.grid().rect(tile).pixels());
        record.looks = self.floor.get().map_or(seen, |floor| floor.looks(seen, &record, epoch, pixels));
        self.insert(aside, base, record, held);
        Ok(())
    }

    /// What a unit of the tile is merged into, once the open batch has room.
    fn base(&self, tile: u32) -> Result<Option<Base>> {
        let full = |state: &mut State| {
            let bytes = state.open.len() as u64 * self.cube.header().chunk_bytes();
            let room = bytes < BATCH_BYTES && state.open.len() < BATCH_TILES;
            !(room || state.open.contains_key(&tile) || state.failed.is_some() || state.closed)
        };
        let state = self.changed.wait_while(self.lock(), full).unwrap_or_else(PoisonError::into_inner);
        state.check()?;
        if let Some(pending) = state.open.get(&tile).or_else(|| state.committing.get(&tile)) {
            return Ok(Some(Base::Pending(Arc::clone(pending))));
        }
        drop(state);
        let Some(record) = Journal::of(&self.cube, tile).last()? else { return Ok(None) };
        let sound = |part: TileArray| {
            let path = self.cube.part_path(part, tile);
            let damaged = |what: &str| Error::storage(&path, format!("{what}; --resume puts it in order"));
            let chunk = self.cube.mapped(&path, tile)?;
            let chunk = chunk.ok_or_else(|| damaged("is missing, although the journal has it"))?;
            if checksums::of(chunk.bytes()) != record.checksums[part.place()] {
                return Err(damaged("is damaged: it is not what the journal says"));
            }
            Ok(chunk)
        };
        let held = match self.cube.header().is_factored() {
            // Read when it is merged, which looks at the checksums too.
            true => Held::Weights,
            false => Held::Radiance {
                mean: sound(TileArray::Radiance)?,
                errors: self.cube.header().has_uncertainty().then(|| sound(TileArray::StandardError)).transpose()?,
            },
        };
        Ok(Some(Base::Committed(Box::new(Committed { record, held }))))
    }

    fn insert(&self, aside: Aside, base: Option<Base>, record: Record, held: Held) {
        let tile = record.tile;
        let mut state = self.lock();
        let replaced = state.open.remove(&tile);
        // Whether the base was, or is being, committed decides what stands in the journal before this record.
        let previous = match (&base, &replaced) {
            (None, _) => None,
            (Some(Base::Pending(_)), Some(replaced)) => replaced.previous,
            (Some(base), _) => Some(base.record().suffix),
        };
        state.totals.replace(base.as_ref().map(Base::record), &record);
        state.looks[(tile - self.tiles.start) as usize] = record.looks;
        state.open.insert(tile, Arc::new(Pending { record, previous, held }));
        drop(state);
        aside.keep();
        if let Some(replaced) = replaced {
            remove_aside(&self.cube, tile, replaced.record.suffix);
        }
        self.changed.notify_all();
    }

    /// Commits once a second until [`Writer::close`]; what a thread of its own should run. After an error merging
    /// returns it too.
    pub fn commit_regularly(&self) -> Result<()> {
        loop {
            let mut state = self.lock();
            loop {
                if state.closed {
                    return Ok(());
                }
                let since = state.last_commit.map_or(COMMIT_EVERY, |last| last.elapsed());
                if !state.open.is_empty() && since >= COMMIT_EVERY {
                    break;
                }
                let time_limit = if state.open.is_empty() { COMMIT_EVERY } else { COMMIT_EVERY - since };
                state = self.changed.wait_timeout(state, time_limit).unwrap_or_else(PoisonError::into_inner).0;
            }
            drop(state);
            self.flush()?;
        }
    }

    /// Ends [`Writer::commit_regularly`], without a last commit.
    pub fn close(&self) {
        self.lock().closed = true;
        self.changed.notify_all();
    }

    /// Commits everything merged so far.
    pub fn flush(&self) -> Result<()> {
        let _committing = self.committing.lock().unwrap_or_else(PoisonError::into_inner);
        let mut state = self.lock();
        state.check()?;
        let batch = std::mem::take(&mut state.open);
        state.committing = batch.clone();
        drop(state);
        let result = if batch.is_empty() { Ok(()) } else { self.commit(&batch) };
        let mut state = self.lock();
        state.committing.clear();
        state.last_commit = Some(Instant::now());
        if let Err(Error::Storage { path, what }) = &result {
            state.failed = Some((path.clone(), what.clone()));
        }
        drop(state);
        self.changed.notify_all();
        result
    }

    /// Makes a batch durable; its files lie aside already. First the journals speak of them, synced; then the renames, and the folders
    /// synced: whoever dies between two steps leaves what `recover` can finish.
    fn commit(&self, batch: &BTreeMap<u32, Arc<Pending>>) -> Result<()> {
        if let Err(error) = self.journal(batch) {
            // What no journal speaks of is nothing but wasted space, which may be what is missing. The rest is in order
            // again when the tiles are resumed.
            for (&tile, pending) in batch {
                let last = Journal::of(&self.cube, tile).last();
                if last.is_ok_and(|last| last.is_none_or(|last| last.suffix != pending.record.suffix)) {
                    remove_aside(&self.cube, tile, pending.record.suffix);
                }
            }
            return Err(error);
        }
        let mut folders = BTreeSet::new();
        for (&tile, pending) in batch {
            Journal::of(&self.cube, tile).expect_tail(Some(pending.record.suffix))?;
            take_places(&self.cube, tile, pending.record.suffix, &mut folders)?;
        }
        sync_folders(&folders)
    }

    /// Makes the files aside of a batch durable, and then the records that speak of them.
    fn journal(&self, batch: &BTreeMap<u32, Arc<Pending>>) -> Result<()> {
        for (&tile, pending) in batch {
            for &part in self.cube.parts() {
                let path = self.cube.aside_path(part, tile, pending.record.suffix);
                let synced =
                    File::open(&path).and_then(|file| file.sync_all()).and_then(|()| step("file aside synced"));
                synced.map_err(|error| Error::storage(&path, format!("cannot be written: {error}")))?;
            }
        }
        let folder = self.cube.aside_folder();
        let synced = files::sync_folder(&folder).and_then(|()| step("folder aside synced"));
        synced.map_err(|error| Error::storage(&folder, error))?;
        for (&tile, pending) in batch {
            Journal::of(&self.cube, tile).append(&pending.record, pending.previous)?;
        }
        Ok(())
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        // Left only by a render that ended with an error.
        let left = std::mem::take(&mut self.lock().open);
        left.iter().for_each(|(&tile, pending)| remove_aside(&self.cube, tile, pending.record.suffix));
    }
}

/// Renames the files aside of a tile to their places, and adds the folders that must be synced then.
fn take_places(cube: &Cube, tile: u32, suffix: u64, folders: &mut BTreeSet<PathBuf>) -> Result<()> {
    for &part in cube.parts() {
        let (aside, target) = (cube.aside_path(part, tile, suffix), cube.part_path(part, tile));
        take_place(&aside, &target, folders)?;
    }
    Ok(())
}

/// Renames one file to its place.
pub(super) fn take_place(aside: &Path, target: &Path, folders: &mut BTreeSet<PathBuf>) -> Result<()> {
    let folder = files::parent(target);
    // The first unit of a tile, or of a row of tiles, makes the folder.
    let renamed = files::make_folder_durably(folder)
        .and_then(|()| step("folder made"))
        .and_then(|()| fs::rename(aside, target))
        .and_then(|()| step("file in place"));
    renamed.map_err(|error| Error::storage(target, format!("cannot be replaced: {error}")))?;
    folders.insert(folder.to_owned());
    Ok(())
}

pub(super) fn sync_folders(folders: &BTreeSet<PathBuf>) -> Result<()> {
    for folder in folders {
        let synced = files::sync_folder(folder).and_then(|()| step("folder synced"));
        synced.map_err(|error| Error::storage(folder, error))?;
    }
    Ok(())
}
