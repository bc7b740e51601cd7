//! Looking at a cube while it grows: pictures of a part of it at the resolution of a screen, spectra, means of regions.
//!
//! Where eight or more pixels are one, everything is read from `overview`: of it the channels that are looked at, and for
//! true colour those that an eye sees. Closer up true colour is read from `preview`, 12 bytes a pixel whatever K, and
//! channels by themselves from `radiance`, where one of them costs the reading of all.

use std::fs::{self, File};
use std::io::{ErrorKind, Read, Seek, SeekFrom};
use std::time::{Duration, SystemTime};

use super::grid::Rect;
use super::map::Chunk;
use super::metadata::Layout;
use super::store::{Cube, TileArray};
use super::weights::{Rows, Weights};
use super::writer::Writer;
use super::{BLOCK, Grid};
use crate::spectral::tone::Picture;
use crate::{Error, Result};

/// How often two files are read that must be of one commit, and what lies between.
const READS: u32 = 50;
const PAUSE: Duration = Duration::from_millis(20);

/// Bytes of radiance that one call may go through; more is refused.
const MOST_RADIANCE: u64 = 4 << 30;

/// A cube as it is at this moment: as its last commits left it, or with every unit that a writer has merged so far.
#[derive(Clone, Copy)]
pub struct CubeState<'a> {
    cube: &'a Cube,
    writer: Option<&'a Writer>,
}

/// Values of some pixels, or blocks of pixels: rows from the top, `planes` values each; NaN where nothing is rendered.
#[derive(Debug, Clone, PartialEq)]
pub struct Window {
    /// Columns and rows.
    pub size: [u32; 2],
    pub planes: usize,
    pub values: Vec<f32>,
}

/// The mean over the pixels of a rectangle that have samples.
#[derive(Debug, Clone, PartialEq)]
pub struct RegionMean {
    pub pixels: u64,
    pub radiance: Vec<f64>,
    /// Of the mean; pixels are independent. `None` without the array `standard_error`.
    pub standard_error: Option<Vec<f64>>,
}

impl Cube {
    pub fn state(&self) -> CubeState<'_> {
        CubeState { cube: self, writer: None }
    }
}

impl Writer {
    pub fn state(&self) -> CubeState<'_> {
        CubeState { cube: self.cube(), writer: Some(self) }
    }
}

impl<'a> CubeState<'a> {
    pub fn cube(&self) -> &'a Cube {
        self.cube
    }

    /// The newest file of a tile in one of the arrays; `None` before its first unit.
    fn open(&self, part: TileArray, tile: u32) -> Result<Option<File>> {
        if let Some(writer) = self.writer
            && let Some(suffix) = writer.pending(tile)
            // By now it may have taken its place, or a newer one is about to.
            && let Ok(file) = File::open(self.cube.aside_path(part, tile, suffix))
        {
            return Ok(Some(file));
        }
        self.cube.open_part(part, tile)
    }

    /// Reads `values` from the file of a tile, `offset` bytes from its start; false before its first unit.
    fn read<T: bytemuck::Pod>(&self, part: TileArray, tile: u32, offset: u64, values: &mut [T]) -> Result<bool> {
        let Some(mut file) = self.open(part, tile)? else { return Ok(false) };
        self.read_from(&mut file, part, tile, offset, values).map(|()| true)
    }

    fn read_from<T: bytemuck::Pod>(
        &self,
        file: &mut File,
        part: TileArray,
        tile: u32,
        offset: u64,
        values: &mut [T],
    ) -> Result<()> {
        if part.has_channels() {
            let expected = 4 * (self.cube.grid().tile_pixels() * self.cube.channels().len()) as u64;
            // What cannot be asked fails when it is read.
            let bytes = file.metadata().map_or(expected, |found| found.len());
            if bytes != expected {
                let what = format!("is damaged: {bytes} bytes long, not {expected}");
                return Err(Error::storage(&self.cube.part_path(part, tile), what));
            }
        }
        let read = file.seek(SeekFrom::Start(offset)).and_then(|_| file.read_exact(bytemuck::cast_slice_mut(values)));
        read.map_err(|error| Error::storage(&self.cube.part_path(part, tile), format!("is damaged: {error}")))
    }

    /// Samples per pixel of a tile.
    pub fn samples(&self, tile: u32) -> Result<u32> {
        if self.cube.is_counts() {
            return self.cube.samples(tile);
        }
        let mut samples = [0u32];
        Ok(if self.read(TileArray::Samples, tile, 0, &mut samples)? { samples[0] } else { 0 })
    }

    fn chunk(&self, part: TileArray, tile: u32) -> Result<Option<Chunk>> {
        let Some(file) = self.open(part, tile)? else { return Ok(None) };
        self.cube.map(&file, &self.cube.part_path(part, tile), tile).map(Some)
    }

    /// The weights of a tile of a factored cube.
    pub fn weights(&self, tile: u32) -> Result<Option<Weights>> {
        let [main, products] = [TileArray::Weights, TileArray::Products];
        let paths = [main, products].map(|part| self.cube.part_path(part, tile));
        for _ in 0..READS {
            let (Some(mut weights), Some(mut table)) = (self.open(main, tile)?, self.open(products, tile)?) else {
                return Ok(None);
            };
            if let Some(found) = self.cube.weights_from([(&paths[0], &mut weights), (&paths[1], &mut table)])? {
                return Ok(Some(found));
            }
            // A commit has put only one of them into its place.
            std::thread::sleep(PAUSE);
        }
        Err(Error::storage(
            &paths[0],
            "is damaged: it does not belong to the products beside it; --resume puts it in order",
        ))
    }

    /// All channels of all pixels of a tile.
    ///
    /// Of counts these, NaN where a pixel is missing.
    pub fn radiance(&self, tile: u32) -> Result<Option<Chunk>> {
        if let Some(counts) = self.cube.counts() {
            return self.cube.counts_chunk(counts, tile);
        }
        if !self.cube.header().is_factored() {
            return self.chunk(TileArray::Radiance, tile);
        }
        let Some(weights) = self.weights(tile)? else { return Ok(None) };
        let (size, channels, rect) = (self.cube.header().tile, self.cube.channels().len(), self.cube.grid().rect(tile));
        let mut values = weights.expanded(Rows::Of(self.cube.expander()?, &weights.products), size, rect);
        if let Some(remainder) = self.remainder(tile)? {
            add(&mut values, remainder.values());
        }
        Ok(Some(Chunk::of(values, rect, size, channels)))
    }

    /// What of a tile's radiance does not separate, in factored cubes that have it.
    pub fn remainder(&self, tile: u32) -> Result<Option<Chunk>> {
        if self.cube.header().has_remainder() { self.chunk(TileArray::Remainder, tile) } else { Ok(None) }
    }

    /// The standard errors of that, where there are some.
    pub(super) fn remainder_errors(&self, tile: u32) -> Result<Option<Chunk>> {
        let header = self.cube.header();
        let has = header.has_remainder() && header.has_uncertainty();
        if has { self.chunk(TileArray::RemainderError, tile) } else { Ok(None) }
    }

    /// The remainder of a pixel of a cube that has one.
    pub(super) fn remainder_of(&self, x: u32, y: u32) -> Result<Vec<f32>> {
        let (grid, channels) = (self.cube.grid(), self.cube.channels().len());
        let tile = grid.tile_at(x, y);
        let rect = grid.rect(tile);
        let mut remainder = vec![0.0f32; channels];
        let pixel = self.cube.layout().pixel(grid.tile, x - rect.x0, y - rect.y0) as u64;
        self.read(TileArray::Remainder, tile, pixel * channels as u64 * 4, &mut remainder)?;
        Ok(remainder)
    }

    /// The K channels of a pixel, in one contiguous read; `None` before the first unit of its tile. The pixel must lie in
    /// the picture.
    pub fn spectrum(&self, x: u32, y: u32) -> Result<Option<Vec<f32>>> {
        let (grid, channels) = (self.cube.grid(), self.cube.channels().len());
        let tile = grid.tile_at(x, y);
        let rect = grid.rect(tile);
        if self.cube.is_counts() {
            return Ok(self.radiance(tile)?.map(|chunk| chunk.spectrum(x, y).to_vec()));
        }
        if self.cube.header().is_factored() {
            let Some(weights) = self.weights(tile)? else { return Ok(None) };
            let pixel = grid.pixel_in_tile(x, y);
            let mut spectrum = weights.spectrum(pixel, self.cube.expander()?);
            if self.cube.header().has_remainder() {
                add(&mut spectrum, &self.remainder_of(x, y)?);
            }
            return Ok(Some(spectrum));
        }
        let pixel = self.cube.layout().pixel(grid.tile, x - rect.x0, y - rect.y0) as u64;
        let mut spectrum = vec![0.0f32; channels];
        let there = self.read::<f32>(TileArray::Radiance, tile, pixel * channels as u64 * 4, &mut spectrum)?;
        Ok(there.then_some(spectrum))
    }

    /// Samples per pixel of the pixels that share a block of `factor` x `factor` with `rect`: means; NaN where nothing is rendered.
    pub fn sample_counts(&self, rect: Rect, factor: u32) -> Result<Window> {
        let grid = self.cube.grid();
        let mut sums = Sums::new(rect, factor, 1);
        let all = sums.pixels(grid);
        for tile in grid.tiles_in(all) {
            let (Some(part), samples) = (grid.rect(tile).intersection(&all), self.samples(tile)?) else { continue };
            if samples > 0 {
                for (x, y) in (part.y0..part.y1).flat_map(|y| (part.x0..part.x1).map(move |x| (x, y))) {
                    sums.add(x, y, 1, &[samples as f32]);
                }
            }
        }
        Ok(sums.means())
    }

    /// Linear R, G, B as the preview shows them, in means of `factor` x `factor` pixels counted from the picture's top left;
    /// those that share pixels with `rect`. From 8 on, a multiple of 8, only `overview` is read.
    pub fn colour(&self, rect: Rect, factor: u32) -> Result<Window> {
        let grid = self.cube.grid();
        let mut sums = Sums::new(rect, factor, 3);
        if self.cube.is_counts() && !self.has_overview(factor) {
            let (projection, pixels) = (self.cube.projection(), sums.pixels(grid));
            self.each_pixel(pixels, |x, y, spectrum| sums.add(x, y, 1, &projection.rgb(spectrum)))?;
            return Ok(sums.means());
        }
        if self.has_overview(factor) {
            let projection = self.cube.projection();
            let channels: Vec<usize> = projection.channels().collect();
            // Colours are linear in the channels, so those of a mean are the mean of the colours.
            self.blocks(&channels, sums.pixels(grid), |x, y, pixels, values| {
                sums.add(x, y, pixels, &projection.rgb_of(values.iter().copied()));
            })?;
            return Ok(sums.means());
        }
        let mut values = vec![0.0f32; grid.tile_pixels() * 3];
        for tile in grid.tiles_in(sums.pixels(grid)) {
            let part = grid.rect(tile);
            let Some(shared) = part.intersection(&sums.pixels(grid)) else { continue };
            // The rows that are needed, from the first to the last.
            let row = grid.tile[0] as usize * 3;
            let rows = &mut values[..shared.height() as usize * row];
            if !self.read(TileArray::Preview, tile, u64::from(shared.y0 - part.y0) * row as u64 * 4, rows)? {
                continue;
            }
            for (y, row) in (shared.y0..shared.y1).zip(rows.chunks_exact(row)) {
                let first = (shared.x0 - part.x0) as usize;
                let pixels = row.chunks_exact(3).skip(first).take(shared.width() as usize);
                for (x, pixel) in (shared.x0..).zip(pixels) {
                    sums.add(x, y, 1, pixel);
                }
            }
        }
        Ok(sums.means())
    }

    /// The radiance in `channels`, in means of `factor` x `factor` pixels counted from the picture's top left; those that
    /// share pixels with `rect`. From 8 on, a multiple of 8, only `overview` is read.
    pub fn channels(&self, channels: &[usize], rect: Rect, factor: u32) -> Result<Window> {
        let mut sums = Sums::new(rect, factor, channels.len());
        let pixels = sums.pixels(self.cube.grid());
        match self.has_overview(factor) {
            true => self.blocks(channels, pixels, |x, y, pixels, values| sums.add(x, y, pixels, values))?,
            false => {
                let mut values = vec![0.0; channels.len()];
                self.each_pixel(pixels, |x, y, spectrum| {
                    values.iter_mut().zip(channels).for_each(|(value, &k)| *value = spectrum[k]);
                    sums.add(x, y, 1, &values);
                })?;
            }
        }
        Ok(sums.means())
    }

    /// Whether means of `factor` x `factor` pixels can be had from `overview`, which holds counts with their noise.
    fn has_overview(&self, factor: u32) -> bool {
        factor.is_multiple_of(BLOCK) && self.cube.counts().is_none_or(|counts| !counts.is_plain())
    }

    /// Calls `each` with column, row and all channels of the pixels that are there.
    fn each_pixel(&self, pixels: Rect, mut each: impl FnMut(u32, u32, &[f32])) -> Result<()> {
        self.check_radiance(pixels)?;
        for tile in self.cube.grid().tiles_in(pixels) {
            let Some(chunk) = self.radiance(tile)? else { continue };
            let Some(shared) = chunk.rect().intersection(&pixels) else { continue };
            for y in shared.y0..shared.y1 {
                for x in shared.x0..shared.x1 {
                    let spectrum = chunk.spectrum(x, y);
                    // Of counts single pixels may be missing.
                    if !(self.cube.is_counts() && spectrum.iter().any(|value| value.is_nan())) {
                        each(x, y, spectrum);
                    }
                }
            }
        }
        Ok(())
    }

    /// Calls `each` with the means of the blocks of `overview` that share pixels with `pixels`: column and row of a block's
    /// first pixel, how many pixels it has, and its values in `channels`.
    fn blocks(&self, channels: &[usize], pixels: Rect, mut each: impl FnMut(u32, u32, u32, &[f32])) -> Result<()> {
        let grid = self.cube.grid();
        let [columns, rows] = grid.tile_blocks();
        let blocks = columns as usize * rows as usize;
        // [block in the order of the file][channel].
        let mut values = vec![0.0f32; blocks * channels.len()];
        let mut scratch = Vec::new();
        for tile in grid.tiles_in(pixels) {
            let Some(mut file) = self.open(TileArray::Overview, tile)? else { continue };
            self.read_blocks(&mut file, tile, channels, blocks, &mut scratch, &mut values)?;
            let part = grid.rect(tile);
            for (y, x) in (0..rows).flat_map(|y| (0..columns).map(move |x| (y, x))) {
                let (x0, y0) = (part.x0 + x * BLOCK, part.y0 + y * BLOCK);
                let block = Rect { x0, y0, x1: x0 + BLOCK, y1: y0 + BLOCK };
                // At the picture's edge a block has fewer pixels.
                let Some(block) = block.intersection(&part).filter(|b| b.intersection(&pixels).is_some()) else {
                    continue;
                };
                let i = self.cube.layout().pixel([columns, rows], x, y);
                each(x0, y0, block.pixels() as u32, &values[i * channels.len()..][..channels.len()]);
            }
        }
        Ok(())
    }

    /// Reads `channels` of all blocks of a tile to [block][channel]. Only what is wanted is read, unless that is most of the
    /// file.
    fn read_blocks(
        &self,
        file: &mut File,
        tile: u32,
        channels: &[usize],
        blocks: usize,
        scratch: &mut Vec<f32>,
        values: &mut [f32],
    ) -> Result<()> {
        let (all, wanted) = (self.cube.channels().len(), channels.len());
        let mut read = |first: usize, values: &mut [f32]| {
            self.read_from(file, TileArray::Overview, tile, (first * 4) as u64, values)
        };
        match self.cube.layout() {
            Layout::Columns if 2 * wanted > all => {
                scratch.resize(blocks * all, 0.0);
                read(0, scratch)?;
                for (values, spectrum) in values.chunks_exact_mut(wanted).zip(scratch.chunks_exact(all)) {
                    values.iter_mut().zip(channels).for_each(|(value, &k)| *value = spectrum[k]);
                }
            }
            Layout::Columns => {
                for (block, mut values) in values.chunks_exact_mut(wanted).enumerate() {
                    // Channels that follow each other lie together in the file.
                    for run in channels.chunk_by(|a, b| a + 1 == *b) {
                        let (these, others) = values.split_at_mut(run.len());
                        read(block * all + run[0], these)?;
                        values = others;
                    }
                }
            }
            Layout::Rows => {
                scratch.resize(blocks * wanted, 0.0);
                let mut rest = &mut scratch[..];
                for run in channels.chunk_by(|a, b| a + 1 == *b) {
                    let (these, others) = rest.split_at_mut(run.len() * blocks);
                    read(run[0] * blocks, these)?;
                    rest = others;
                }
                for (k, plane) in scratch.chunks_exact(blocks).enumerate() {
                    plane.iter().enumerate().for_each(|(block, &value)| values[block * wanted + k] = value);
                }
            }
        }
        Ok(())
    }

    /// The mean spectrum of the pixels in `rect` that have samples, where there are any.
    pub fn region(&self, rect: Rect) -> Result<Option<RegionMean>> {
        self.check_radiance(rect)?;
        let channels = self.cube.channels().len();
        let mut pixels = 0;
        let mut radiance = vec![0.0; channels];
        let mut variance = Some(vec![0.0; channels]);
        for tile in self.cube.grid().tiles_in(rect) {
            let Some(chunk) = self.radiance(tile)? else { continue };
            let errors = self.standard_errors(tile)?;
            let Some(shared) = chunk.rect().intersection(&rect) else { continue };
            for y in shared.y0..shared.y1 {
                for x in shared.x0..shared.x1 {
                    if self.cube.is_counts() && chunk.spectrum(x, y).iter().any(|value| value.is_nan()) {
                        continue;
                    }
                    pixels += 1;
                    radiance.iter_mut().zip(chunk.spectrum(x, y)).for_each(|(sum, &v)| *sum += f64::from(v));
                    if let (Some(variance), Some(errors)) = (&mut variance, &errors) {
                        let errors = errors.spectrum(x, y);
                        variance.iter_mut().zip(errors).for_each(|(sum, &e)| *sum += f64::from(e) * f64::from(e));
                    }
                }
            }
            if errors.is_none() {
                variance = None;
            }
        }
        let n = pixels as f64;
        radiance.iter_mut().for_each(|sum| *sum /= n);
        let standard_error = variance.map(|sums| sums.into_iter().map(|sum| sum.sqrt() / n).collect());
        Ok((pixels > 0).then_some(RegionMean { pixels, radiance, standard_error }))
    }

    /// Going through the radiance of these pixels must not take for ever.
    fn check_radiance(&self, rect: Rect) -> Result<()> {
        let bytes = rect.pixels().saturating_mul(self.cube.channels().len() as u64 * 4);
        if bytes <= MOST_RADIANCE {
            return Ok(());
        }
        let (bytes, most) = (crate::files::format_bytes(bytes), crate::files::format_bytes(MOST_RADIANCE));
        Err(Error::Usage(format!("these pixels hold {bytes} of radiance, more than {most}: take fewer, or scale >= 8")))
    }

    /// The standard errors of a tile, laid out like its radiance, where the cube has them. They are read as the last commit
    /// left them.
    pub(super) fn standard_errors(&self, tile: u32) -> Result<Option<Chunk>> {
        let cube = self.cube;
        if !cube.header().has_uncertainty() {
            return Ok(None);
        }
        if !cube.header().is_factored() {
            return cube.state().chunk(TileArray::StandardError, tile);
        }
        let Some(weights) = cube.state().weights(tile)? else { return Ok(None) };
        let (size, channels, rect) = (cube.header().tile, cube.channels().len(), cube.grid().rect(tile));
        let rows = Rows::Of(cube.expander()?, &weights.products);
        let mut errors = weights.standard_errors(rows, size, rect, &cube.groups(cube.samples(tile)?));
        // Both parts come from the same paths, so that their errors belong together: at most they add up.
        if let Some(more) = cube.state().remainder_errors(tile)? {
            add(&mut errors, more.values());
        }
        Ok(Some(Chunk::of(errors, rect, size, channels)))
    }

    /// The standard error of every channel of a pixel, where the cube has them.
    pub fn standard_error(&self, x: u32, y: u32) -> Result<Option<Vec<f32>>> {
        let errors = self.standard_errors(self.cube.grid().tile_at(x, y))?;
        Ok(errors.map(|chunk| chunk.spectrum(x, y).to_vec()))
    }
}

/// Adds to values others that lie as they do.
pub(super) fn add(values: &mut [f32], others: &[f32]) {
    values.iter_mut().zip(others).for_each(|(value, other)| *value += other);
}

/// Weighted sums over blocks of `factor` x `factor` pixels.
pub(super) struct Sums {
    factor: u32,
    /// Column and row of the first block, and how many there are.
    first: [u32; 2],
    size: [u32; 2],
    planes: usize,
    sums: Vec<f32>,
    weights: Vec<u32>,
}

impl Sums {
    pub(super) fn new(rect: Rect, factor: u32, planes: usize) -> Sums {
        let first = [rect.x0 / factor, rect.y0 / factor];
        let size = [rect.x1.div_ceil(factor) - first[0], rect.y1.div_ceil(factor) - first[1]];
        let blocks = size[0] as usize * size[1] as usize;
        Sums { factor, first, size, planes, sums: vec![0.0; blocks * planes], weights: vec![0; blocks] }
    }

    /// The pixels of the picture in these blocks.
    pub(super) fn pixels(&self, grid: Grid) -> Rect {
        let [x0, y0] = self.first.map(|block| block * self.factor);
        let end = |axis: usize| ((self.first[axis] + self.size[axis]) * self.factor).min(grid.size[axis]);
        Rect { x0, y0, x1: end(0), y1: end(1) }
    }

    pub(super) fn add(&mut self, x: u32, y: u32, weight: u32, values: &[f32]) {
        let [column, row] = [x / self.factor - self.first[0], y / self.factor - self.first[1]];
        let block = row as usize * self.size[0] as usize + column as usize;
        let sums = &mut self.sums[block * self.planes..][..self.planes];
        if self.weights[block] == 0 && weight == 1 {
            // A pixel by itself stays what it is, to the last bit.
            sums.copy_from_slice(values);
        } else {
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value * weight as f32);
        }
        self.weights[block] += weight;
    }

    pub(super) fn means(mut self) -> Window {
        for (sums, &weight) in self.sums.chunks_exact_mut(self.planes).zip(&self.weights) {
            match weight {
                0 => sums.fill(f32::NAN),
                1 => {}
                _ => sums.iter_mut().for_each(|sum| *sum /= weight as f32),
            }
        }
        Window { size: self.size, planes: self.planes, values: self.sums }
    }
}

impl Window {
    /// As a picture: three planes are R, G, B, one is grey.
    pub fn into_picture(self) -> Picture {
        let rgb = match self.planes {
            3 => self.values,
            planes => self.values.iter().step_by(planes).flat_map(|&v| [v; 3]).collect(),
        };
        Picture { size: self.size, rgb }
    }
}

/// What [`Cube::changes`] knows from the last time.
pub struct Seen {
    /// When each row of tiles was looked at, and its folder's time then.
    rows: Vec<Option<(SystemTime, SystemTime)>>,
    samples: Vec<u32>,
}

impl Seen {
    pub fn nothing(cube: &Cube) -> Seen {
        let grid = cube.grid();
        Seen { rows: vec![None; grid.tiles()[1] as usize], samples: vec![0; grid.count() as usize] }
    }

    /// Samples per pixel of every tile.
    pub fn samples(&self) -> &[u32] {
        &self.samples
    }
}

impl Cube {
    /// The tiles whose samples have changed since `seen`, which is brought up to date. Of a large cube at rest only the times
    /// of a folder for each row of tiles are read.
    pub fn changes(&self, seen: &mut Seen) -> Result<Vec<u32>> {
        // The clocks of file systems tick, and a shared one has a clock of its own.
        const DOUBT: Duration = Duration::from_secs(5);
        let [columns, _] = self.grid().tiles();
        let mut changed = Vec::new();
        for (row, known) in (0..).zip(&mut seen.rows) {
            let path = match self.is_counts() {
                true => self.counts_path("counts", row * columns),
                false => self.part_path(TileArray::Samples, row * columns),
            };
            let folder = crate::files::parent(&path);
            let modified = match fs::metadata(folder).and_then(|found| found.modified()) {
                Ok(modified) => modified,
                Err(error) if error.kind() == ErrorKind::NotFound => continue,
                Err(error) => return Err(Error::storage(folder, error)),
            };
            let now = SystemTime::now();
            if known.is_some_and(|(looked, then)| then == modified && looked > modified + DOUBT) {
                continue;
            }
            *known = Some((now, modified));
            for tile in row * columns..(row + 1) * columns {
                let samples = self.samples(tile)?;
                if samples != std::mem::replace(&mut seen.samples[tile as usize], samples) {
                    changed.push(tile);
                }
            }
        }
        Ok(changed)
    }
}
