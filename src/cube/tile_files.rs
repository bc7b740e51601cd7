//! The files of a tile: what a unit is merged into, and those that are written aside for it.

use std::fs::{self, File};
use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;

use super::checksums::{self, Summing};
use super::epochs::epochs_in;
use super::estimate::UNSEEN;
use super::faults::step;
use super::grid::Rect;
use super::journal::{OfRemainder, Record};
use super::layer::{Layer, TileLayers};
use super::map::Chunk;
use super::merge::{UnitPass, write_standard_errors};
use super::metadata::{Header, Layout};
use super::state::add;
use super::store::{Cube, TileArray};
use super::weights::{Merging, Rows, Weights};
use crate::{Error, Result, files};

/// A tile merged and not committed yet: its files lie aside.
pub(super) struct Pending {
    pub record: Record,
    /// Suffix of the record before it in the journal.
    pub previous: Option<u64>,
    pub held: Held,
}

/// What a unit is, as a device brings it back.
pub(super) enum Unit<'a> {
    /// [tile_h][tile_w][K].
    Radiance(&'a [f32]),
    /// Of a tile that has none: [tile_w][tile_h][K], and standard errors.
    Columns { values: &'a [f32], errors: Option<&'a [f32]> },
    /// And of what does not separate [tile_h][tile_w][K], in cubes that have it.
    Weights(Weights, Option<&'a [f32]>),
}

impl Unit<'_> {
    pub fn is_for(&self, header: &Header) -> bool {
        match self {
            Unit::Radiance(unit) | Unit::Columns { values: unit, .. } => {
                !header.is_factored() && unit.len() == header.grid().tile_pixels() * header.channels.len()
            }
            Unit::Weights(unit, remainder) => {
                let values =
                    if header.has_remainder() { header.grid().tile_pixels() * header.channels.len() } else { 0 };
                header.is_factored()
                    && unit.pixels() == header.grid().tile_pixels()
                    && remainder.map_or(0, <[f32]>::len) == values
            }
        }
    }
}

/// What is at hand of a tile that was merged.
pub(super) enum Held {
    Radiance {
        mean: Chunk,
        /// In cubes that have them.
        errors: Option<Chunk>,
    },
    /// Nothing: they are read again.
    Weights,
}

/// What a unit is merged into.
pub(super) enum Base {
    Committed(Box<Committed>),
    Pending(Arc<Pending>),
}

/// A tile as its last commit left it.
pub(super) struct Committed {
    pub record: Record,
    pub held: Held,
}

impl Base {
    pub fn record(&self) -> &Record {
        match self {
            Base::Committed(committed) => &committed.record,
            Base::Pending(pending) => &pending.record,
        }
    }

    fn held(&self) -> &Held {
        match self {
            Base::Committed(committed) => &committed.held,
            Base::Pending(pending) => &pending.held,
        }
    }

    fn chunk(&self) -> Option<&Chunk> {
        match self.held() {
            Held::Radiance { mean, .. } => Some(mean),
            Held::Weights => None,
        }
    }

    fn errors(&self) -> Option<&Chunk> {
        match self.held() {
            Held::Radiance { errors, .. } => errors.as_ref(),
            Held::Weights => None,
        }
    }

    /// Where a file of the tile is, and what it holds.
    fn bytes(&self, cube: &Cube, part: TileArray) -> Result<(PathBuf, Vec<u8>)> {
        let record = self.record();
        let path = match self {
            Base::Committed(_) => cube.part_path(part, record.tile),
            Base::Pending(pending) => cube.aside_path(part, record.tile, pending.record.suffix),
        };
        // A commit may just have put it into its place.
        let bytes = fs::read(&path).or_else(|_| fs::read(cube.part_path(part, record.tile)));
        let bytes = bytes.map_err(|error| Error::storage(&path, format!("cannot be read: {error}")))?;
        if checksums::of(&bytes) != record.checksums[part.place()] {
            let what = "is damaged: it is not what the journal says; --resume puts it in order";
            return Err(Error::storage(&path, what));
        }
        Ok((path, bytes))
    }

    /// A file that has all channels of every pixel.
    fn values(&self, cube: &Cube, part: TileArray) -> Result<Chunk> {
        let (_, bytes) = self.bytes(cube, part)?;
        let (grid, tile) = (cube.grid(), self.record().tile);
        Ok(Chunk::of(bytemuck::pod_collect_to_vec(&bytes), grid.rect(tile), grid.tile, cube.channels().len()))
    }

    /// What a tile has of sums, and of how many samples.
    fn spread(&self) -> (u32, &[f64]) {
        (self.record().samples, &self.record().spread)
    }

    /// The weights of a tile of a factored cube.
    fn weights(&self, cube: &Cube) -> Result<Weights> {
        let read = |part: TileArray| self.bytes(cube, part);
        let ((path, weights), (products_path, products)) = (read(TileArray::Weights)?, read(TileArray::Products)?);
        let weights = Weights::decode(cube.header(), [(&path, &weights), (&products_path, &products)])?;
        weights.ok_or_else(|| Error::storage(&path, "is damaged: it does not belong to the products beside it"))
    }
}

/// New files of a tile, under one suffix; removed again unless kept.
pub(super) struct Aside<'a> {
    cube: &'a Cube,
    tile: u32,
    suffix: u64,
    kept: bool,
}

impl<'a> Aside<'a> {
    pub fn new(cube: &'a Cube, tile: u32) -> Self {
        Aside { cube, tile, suffix: files::random_number(), kept: false }
    }

    pub fn path(&self, part: TileArray) -> PathBuf {
        self.cube.aside_path(part, self.tile, self.suffix)
    }

    pub fn keep(mut self) {
        self.kept = true;
    }

    /// Writes the tile's new files and says what they are.
    pub fn write(&self, base: Option<&Base>, samples: u32, n_unit: u32, unit: &Unit) -> Result<Record> {
        let (cube, tile) = (self.cube, self.tile);
        let (unit, layout, known_errors) = match *unit {
            Unit::Radiance(unit) => (unit, Layout::Rows, None),
            Unit::Columns { values, errors } => (values, Layout::Columns, errors),
            Unit::Weights(..) => return Err(Error::Internal("weights are no radiance".into())),
        };
        let mut pass = UnitPass::new(cube.grid(), cube.grid().rect(tile), cube.channels().len(), cube.projection());
        let weight = f64::from(n_unit) / f64::from(samples);
        let radiance =
            self.file(TileArray::Radiance, |file| pass.run(base.and_then(Base::chunk), unit, layout, weight, file))?;
        if let Some(k) = pass.square.iter().position(|v| !v.is_finite()) {
            let what = format!("a unit of tile {tile} holds a value in channel {k} that is not finite");
            return Err(Error::Internal(what));
        }
        let (spread, square) = pass.sums(base.map(Base::spread), cube.header().epoch);
        let samples_sum = self.file(TileArray::Samples, |file| file.write_all(&samples.to_le_bytes()))?;
        let preview = self.file(TileArray::Preview, |file| file.write_all(bytemuck::cast_slice(&pass.preview)))?;
        let overview = self.file(TileArray::Overview, |file| file.write_all(bytemuck::cast_slice(&pass.overview)))?;
        let errors = match cube.header().has_uncertainty() {
            false => 0,
            true => self.file(TileArray::StandardError, |file| {
                if let Some(errors) = known_errors {
                    return file.write_all(bytemuck::cast_slice(errors));
                }
                let (grid, epochs) = (cube.grid(), samples / cube.header().epoch);
                let old = base.and_then(|base| Some((base.chunk()?, base.errors()?)));
                write_standard_errors(grid, grid.rect(tile), cube.channels().len(), epochs, old, unit, file)
            })?,
        };
        Ok(Record {
            tile,
            samples,
            epoch: epochs_in(samples, cube.header().epoch).saturating_sub(1),
            suffix: self.suffix,
            looks: UNSEEN,
            checksums: checksums_of([radiance, samples_sum, preview, overview, errors]),
            spread,
            square,
            remainder: None,
        })
    }

    /// The same of weights, and of what does not separate. All that is derived from radiance is derived from that which readers make of
    /// both.
    pub fn write_weights(
        &self,
        base: Option<&Base>,
        samples: u32,
        n_unit: u32,
        unit: Weights,
        remainder: Option<&[f32]>,
    ) -> Result<Record> {
        let (cube, tile) = (self.cube, self.tile);
        let (grid, channels, epoch) = (cube.grid(), cube.channels().len(), cube.header().epoch);
        let (size, rect) = (grid.tile, grid.rect(tile));
        let pass = || UnitPass::new(grid, rect, channels, cube.projection());
        let in_memory = |error| Error::storage(cube.path(), error);
        let old = base.map(|base| base.weights(cube)).transpose()?;
        let Merging { old, unit, merged, rows } = cube.merging(tile, old, samples - n_unit, unit, n_unit)?;
        let remainder = remainder.map(|unit| self.write_remainder(base, samples, n_unit, unit)).transpose()?;
        let radiance = |weights: &Weights, remainder: Option<&[f32]>| {
            let mut values = weights.expanded(Rows::Made(&rows, channels), size, rect);
            add(&mut values, remainder.unwrap_or_default());
            values
        };
        // How far the unit is from the mean before it, where that is one of whole epochs.
        let mut distances = pass();
        if let Some(old) = old.as_ref().filter(|_| samples - n_unit >= epoch) {
            let of_old = remainder.as_ref().and_then(|of| of.old.as_ref()).map(Chunk::values);
            let before = Chunk::of(radiance(old, of_old), rect, size, channels);
            let of_unit = remainder.as_ref().map(|of| in_columns(of.unit, size, rect, channels));
            let unit = radiance(&unit, of_unit.as_deref());
            let run = distances.run(Some(&before), &unit, Layout::Columns, 1.0, &mut std::io::sink());
            run.map_err(in_memory)?;
        }
        let mut all = pass();
        let values = radiance(&merged, remainder.as_ref().map(|of| of.merged.values()));
        all.run(None, &values, Layout::Columns, 1.0, &mut std::io::sink()).map_err(in_memory)?;
        if let Some(k) = all.square.iter().position(|v| !v.is_finite()) {
            let what = format!("a unit of tile {tile} holds a value in channel {k} that is not finite");
            return Err(Error::Internal(what));
        }
        let mut all = all.with_distance(distances);
        let (spread, square) = all.sums(base.map(Base::spread), epoch);
        let [of_weights, of_products] = merged.compacted().encode(cube.header()).map_err(in_memory)?;
        let weights_sum = self.file(TileArray::Weights, |file| file.write_all(&of_weights))?;
        let samples_sum = self.file(TileArray::Samples, |file| file.write_all(&samples.to_le_bytes()))?;
        let preview = self.file(TileArray::Preview, |file| file.write_all(bytemuck::cast_slice(&all.preview)))?;
        let overview = self.file(TileArray::Overview, |file| file.write_all(bytemuck::cast_slice(&all.overview)))?;
        let products_sum = self.file(TileArray::Products, |file| file.write_all(&of_products))?;
        let mut checksums = checksums_of([weights_sum, samples_sum, preview, overview, products_sum]);
        let remainder = remainder.map(|of| {
            checksums[TileArray::WITHOUT_REMAINDER..].copy_from_slice(&of.checksums);
            let [sum, of_all] = [of.merged.values(), &values].map(|values| sums_of(values, channels));
            OfRemainder { spread: of.spread, sum, of_all }
        });
        Ok(Record {
            tile,
            samples,
            epoch: epochs_in(samples, epoch).saturating_sub(1),
            suffix: self.suffix,
            looks: UNSEEN,
            checksums,
            spread,
            square,
            remainder,
        })
    }

    /// What does not separate, as radiance is written, and its standard errors.
    fn write_remainder<'u>(
        &self,
        base: Option<&Base>,
        samples: u32,
        n_unit: u32,
        unit: &'u [f32],
    ) -> Result<Remainder<'u>> {
        let (cube, tile) = (self.cube, self.tile);
        let (grid, channels, epoch) = (cube.grid(), cube.channels().len(), cube.header().epoch);
        let read = |part: TileArray| base.map(|base| base.values(cube, part)).transpose();
        let old = read(TileArray::Remainder)?;
        let mut pass = UnitPass::new(grid, grid.rect(tile), channels, cube.projection());
        let weight = f64::from(n_unit) / f64::from(samples);
        let sum = self.file(TileArray::Remainder, |file| pass.run(old.as_ref(), unit, Layout::Rows, weight, file))?;
        let before = base.and_then(|base| Some((base.record().samples, &base.record().remainder.as_ref()?.spread[..])));
        let (spread, _) = pass.sums(before, epoch);
        let errors = match cube.header().has_uncertainty() {
            false => 0,
            true => {
                let errors = read(TileArray::RemainderError)?;
                let old = old.as_ref().zip(errors.as_ref());
                self.file(TileArray::RemainderError, |file| {
                    write_standard_errors(grid, grid.rect(tile), channels, samples / epoch, old, unit, file)
                })?
            }
        };
        let path = self.path(TileArray::Remainder);
        let merged = cube.mapped(&path, tile)?.ok_or_else(|| Error::storage(&path, "has vanished"))?;
        Ok(Remainder { old, unit, merged, spread, checksums: [sum, errors] })
    }

    /// Writes the layers, those of the tile before or those that it begins with, and gives their checksums in the order of
    /// [`Layer::ALL`].
    pub fn write_layers(&self, base: Option<&Base>, laid: Option<&TileLayers>) -> Result<[u128; Layer::ALL.len()]> {
        let mut checksums = [0; Layer::ALL.len()];
        for &layer in self.cube.layers() {
            let part = TileArray::Layer(layer);
            let kept = base.map(|base| base.bytes(self.cube, part)).transpose()?.map(|(_, bytes)| bytes);
            let bytes = kept.as_deref().or_else(|| laid?.of(layer));
            let bytes = bytes.ok_or_else(|| {
                Error::Internal(format!("tile {} begins without its layer `{}`", self.tile, layer.name()))
            })?;
            checksums[layer as usize] = self.file(part, |file| file.write_all(bytes))?;
        }
        Ok(checksums)
    }

    fn file(&self, part: TileArray, write: impl FnOnce(&mut Summing<File>) -> std::io::Result<()>) -> Result<u128> {
        let path = self.path(part);
        let write = || {
            let mut file = Summing::new(File::create_new(&path)?);
            step("file aside made")?;
            write(&mut file)?;
            step("file aside written")?;
            Ok(file.checksum())
        };
        write().map_err(|error: std::io::Error| {
            Error::storage(&self.cube.part_path(part, self.tile), format!("cannot be written: {error}"))
        })
    }
}

impl Drop for Aside<'_> {
    fn drop(&mut self) {
        if !self.kept {
            remove_aside(self.cube, self.tile, self.suffix);
        }
    }
}

/// What of a tile does not separate, before and after a unit.
struct Remainder<'a> {
    old: Option<Chunk>,
    /// [tile_h][tile_w][K].
    unit: &'a [f32],
    merged: Chunk,
    /// As [`OfRemainder::spread`].
    spread: Vec<f64>,
    /// Of its files.
    checksums: [u128; 2],
}

/// A unit's rows of pixels column by column, as they lie in a chunk.
fn in_columns(unit: &[f32], tile: [u32; 2], rect: Rect, channels: usize) -> Vec<f32> {
    let mut values = vec![f32::NAN; unit.len()];
    for (x, y) in (0..rect.width()).flat_map(|x| (0..rect.height()).map(move |y| (x, y))) {
        let [to, from] = [Layout::Columns, Layout::Rows].map(|layout| layout.pixel(tile, x, y) * channels);
        values[to..][..channels].copy_from_slice(&unit[from..][..channels]);
    }
    values
}

/// Σ over the pixels of the picture, per channel.
fn sums_of(values: &[f32], channels: usize) -> Vec<f64> {
    let mut sums = vec![0.0; channels];
    for pixel in values.chunks_exact(channels).filter(|pixel| !pixel[0].is_nan()) {
        sums.iter_mut().zip(pixel).for_each(|(sum, value)| *sum += f64::from(*value));
    }
    sums
}

/// Of a tile whose layers and remainder, if it has any, are still to come.
pub(super) fn checksums_of(files: [u128; TileArray::WITHOUT_LAYERS]) -> [u128; TileArray::MOST] {
    std::array::from_fn(|i| files.get(i).copied().unwrap_or(0))
}

pub(super) fn remove_aside(cube: &Cube, tile: u32, suffix: u64) {
    for &part in cube.parts() {
        // Nobody reads such a file; one that cannot be removed now is removed when the tile is resumed.
        let _ = fs::remove_file(cube.aside_path(part, tile, suffix));
    }
}
