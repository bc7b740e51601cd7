//! Signals of whole pictures on their way through blurring optics, on disk: a plane for each wavelength at which a band is blurred.
//!
//! A picture is continued by mirroring, so its waves are cosines, and optics multiply each by their transfer function. That is one
//! transform of the whole picture: no tile has an edge. It is done by rows, then by columns, some at a time.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::cosine::{Cosine, Work};
use super::radiometry::Optical;
use super::transfer::{Nodes, Transfer};
use crate::cube::{Chunk, Cube, Rect};
use crate::files::{format_bytes, free_bytes, output::cannot_write};
use crate::scene::SensorModel;
use crate::{Error, Result};

/// Bytes of values that are held at a time, about, and half of it for each of two.
const PIECE_BYTES: usize = 32 << 20;

/// What a step of the work is called with: steps done.
pub type Step<'a> = dyn FnMut(u64) -> Result<()> + 'a;

/// Pixel and band of a signal that is not finite.
pub type Wrong = ([u32; 2], usize);

/// All planes of a picture.
pub struct Planes<'a> {
    /// The store that is being made, which errors name.
    store: &'a Path,
    path: PathBuf,
    file: File,
    size: [usize; 2],
    transfer: Option<Transfer<'a>>,
    /// Side of the cube's pixels on the detector, m.
    side: f64,
    bands: Vec<(&'a Optical, Nodes)>,
    /// The first plane of each band.
    first: Vec<usize>,
}

impl<'a> Planes<'a> {
    /// Planes in a new file in `folder`.
    ///
    /// # Errors
    /// Too little space; a measured transfer function that ends too early.
    pub fn new(
        folder: &Path,
        store: &'a Path,
        cube: &Cube,
        model: &'a SensorModel,
        bands: &'a [Optical],
    ) -> Result<Planes<'a>> {
        let size = cube.header().size.map(|side| side as usize);
        let transfer = Transfer::new(model);
        let side = model.pitch / f64::from(model.oversampling);
        let highest = 0.5 * std::f64::consts::SQRT_2 / side;
        if let Some(transfer) = transfer {
            transfer.check(highest).map_err(|what| Error::Usage(format!("{}: {what}", cube.path().display())))?;
        }
        let bands: Vec<(&Optical, Nodes)> =
            bands.iter().map(|band| (band, Nodes::new(transfer, band, cube.channels(), highest))).collect();
        let (mut first, mut count) = (Vec::new(), 0);
        for (_, nodes) in &bands {
            first.push(count);
            count += nodes.nm.len();
        }
        let bytes = (count * size[0] * size[1] * 8) as u64;
        let failed = |error: io::Error| cannot_write(store, &error);
        if free_bytes(folder).is_some_and(|free| free < bytes) {
            let what = format!(
                "blurring needs {} beside it for a while, which are not free there; choose another disk",
                format_bytes(bytes)
            );
            return Err(Error::Usage(format!("{}: {what}", store.display())));
        }
        let path = folder.join("planes");
        let file = OpenOptions::new().read(true).write(true).create_new(true).open(&path).map_err(failed)?;
        // What no tile writes to is 0.
        file.set_len(bytes).map_err(failed)?;
        Ok(Planes { store, path, file, size, transfer, side, bands, first })
    }

    /// How many steps [`Planes::blur`] takes.
    pub fn steps(&self) -> u64 {
        match self.transfer {
            None => 0,
            Some(_) => self.bands.iter().map(|(_, nodes)| 2 * nodes.nm.len() as u64 + 1).sum(),
        }
    }

    /// Radius, in pixels of the cube, within which a missing pixel takes more than it may from a band.
    pub fn reach(&self, band: usize) -> f64 {
        let longest = self.bands[band].1.nm.iter().copied().fold(0.0, f64::max);
        self.transfer.map_or(0.0, |transfer| transfer.radius(longest) / self.side)
    }

    /// Share of the contrast that is left of the finest waves along an axis of the cube's pixels, in the band that keeps the most.
    pub fn at_nyquist(&self) -> f64 {
        let shortest = |nodes: &Nodes| nodes.nm.iter().copied().fold(f64::INFINITY, f64::min);
        let of = |transfer: Transfer| {
            self.bands.iter().map(move |(_, nodes)| transfer.at(shortest(nodes), 0.5 / self.side)).fold(0.0, f64::max)
        };
        self.transfer.map_or(0.0, of)
    }

    /// Takes the radiance of a tile. Returns the first signal that is not finite.
    pub fn put(&mut self, chunk: &Chunk) -> Result<Option<Wrong>> {
        let rect = chunk.rect();
        let planes: usize = self.bands.iter().map(|(_, nodes)| nodes.nm.len()).sum();
        let width = rect.width() as usize;
        let together = (PIECE_BYTES / (8 * planes * width)).max(1) as u32;
        for y0 in (rect.y0..rect.y1).step_by(together as usize) {
            let rows: Vec<u32> = (y0..(y0 + together).min(rect.y1)).collect();
            // [row][plane][x].
            let sums: Vec<std::result::Result<Vec<f64>, Wrong>> =
                rows.par_iter().map(|&y| self.row(chunk, y, planes)).collect();
            let mut found = Vec::with_capacity(sums.len());
            for row in sums {
                match row {
                    Ok(row) => found.push(row),
                    Err(wrong) => return Ok(Some(wrong)),
                }
            }
            for plane in 0..planes {
                for (&y, row) in rows.iter().zip(&found) {
                    self.write(plane, y as usize, rect.x0 as usize, &row[plane * width..][..width])?;
                }
            }
        }
        Ok(None)
    }

    fn row(&self, chunk: &Chunk, y: u32, planes: usize) -> std::result::Result<Vec<f64>, Wrong> {
        let rect = chunk.rect();
        let width = rect.width() as usize;
        let mut sums = vec![0.0; planes * width];
        for x in rect.x0..rect.x1 {
            let (spectrum, at) = (chunk.spectrum(x, y), (x - rect.x0) as usize);
            for (b, (band, nodes)) in self.bands.iter().enumerate() {
                let first = self.first[b];
                let mut total = 0.0;
                for (&(k, weight), &(node, share)) in band.weights.iter().zip(&nodes.places) {
                    let light = weight * f64::from(spectrum[k]);
                    total += light;
                    sums[(first + node) * width + at] += (1.0 - share) * light;
                    if share > 0.0 {
                        sums[(first + node + 1) * width + at] += share * light;
                    }
                }
                if !total.is_finite() {
                    return Err(([x, y], b));
                }
            }
        }
        Ok(sums)
    }

    /// Blurs all bands. `step` is called with how many steps are done.
    pub fn blur(&mut self, step: &mut Step) -> Result<()> {
        let Some(transfer) = self.transfer else { return Ok(()) };
        let [along_x, along_y] = self.size.map(Cosine::new);
        let mut done = 0;
        let mut tell = |n: u64| {
            done += n;
            step(done)
        };
        for band in 0..self.bands.len() {
            let (first, nm) = (self.first[band], self.bands[band].1.nm.clone());
            for plane in first..first + nm.len() {
                self.each_rows(plane, |row, work| along_x.forward(row, work))?;
                tell(1)?;
            }
            self.columns(first, &nm, transfer, &along_y)?;
            tell(nm.len() as u64)?;
            self.each_rows(first, |row, work| along_x.inverse(row, work))?;
            tell(1)?;
        }
        Ok(())
    }

    /// Changes all rows of a plane.
    fn each_rows(&mut self, plane: usize, change: impl Fn(&mut [f64], &mut Work) + Sync) -> Result<()> {
        let [width, height] = self.size;
        let together = (PIECE_BYTES / (8 * width)).clamp(1, height);
        let mut values = vec![0.0; together * width];
        for y in (0..height).step_by(together) {
            let values = &mut values[..together.min(height - y) * width];
            self.read(plane, y, 0, values)?;
            values.par_chunks_mut(width).for_each_init(Work::default, |work, row| change(row, work));
            self.write(plane, y, 0, values)?;
        }
        Ok(())
    }

    /// Transforms the columns of the planes from `first` on, adds them up as their wavelengths are passed on, and transforms back, to the
    /// first plane.
    fn columns(&mut self, first: usize, nm: &[f64], transfer: Transfer, along: &Cosine) -> Result<()> {
        let [width, height] = self.size;
        let together = (PIECE_BYTES / (16 * height)).clamp(1, width);
        // [row][column] as in the file, and [column][row].
        let mut lines = vec![0.0; together];
        let mut values = vec![0.0; together * height];
        let mut sums = vec![0.0; together * height];
        // Cycles a metre of the waves number m of n values.
        let side = self.side;
        let frequency = |m: usize, n: usize| m as f64 / (2 * n) as f64 / side;
        for x in (0..width).step_by(together) {
            let count = together.min(width - x);
            let (values, sums) = (&mut values[..count * height], &mut sums[..count * height]);
            sums.fill(0.0);
            for (node, &nm) in nm.iter().enumerate() {
                for y in 0..height {
                    self.read(first + node, y, x, &mut lines[..count])?;
                    lines[..count].iter().enumerate().for_each(|(column, value)| values[column * height + y] = *value);
                }
                let columns = values.par_chunks_mut(height).zip(sums.par_chunks_mut(height)).enumerate();
                columns.for_each_init(Work::default, |work, (column, (values, sums))| {
                    along.forward(values, work);
                    let across = frequency(x + column, width);
                    for (m, (sum, value)) in sums.iter_mut().zip(values).enumerate() {
                        *sum += transfer.at(nm, across.hypot(frequency(m, height))) * *value;
                    }
                });
            }
            sums.par_chunks_mut(height).for_each_init(Work::default, |work, column| along.inverse(column, work));
            for y in 0..height {
                lines[..count].iter_mut().enumerate().for_each(|(column, value)| *value = sums[column * height + y]);
                self.write(first, y, x, &lines[..count])?;
            }
        }
        Ok(())
    }

    /// The signals of a band in these pixels of the cube, row by row.
    pub fn signals(&mut self, band: usize, rect: Rect, signals: &mut Vec<f64>) -> Result<()> {
        let width = rect.width() as usize;
        signals.resize(width * rect.height() as usize, 0.0);
        for (y, row) in (rect.y0..rect.y1).zip(signals.chunks_exact_mut(width)) {
            self.read(self.first[band], y as usize, rect.x0 as usize, row)?;
        }
        Ok(())
    }

    /// Removes the file.
    pub fn finish(self) -> Result<()> {
        drop(self.file);
        fs::remove_file(&self.path).map_err(|error| cannot_write(self.store, &error))
    }

    fn seek(&mut self, plane: usize, y: usize, x: usize) -> io::Result<u64> {
        let [width, height] = self.size;
        self.file.seek(SeekFrom::Start(8 * ((plane * height + y) * width + x) as u64))
    }

    fn read(&mut self, plane: usize, y: usize, x: usize, values: &mut [f64]) -> Result<()> {
        let read = self.seek(plane, y, x).and_then(|_| self.file.read_exact(bytemuck::cast_slice_mut(values)));
        read.map_err(|error| Error::storage(self.store, format!("what was put beside it cannot be read: {error}")))
    }

    fn write(&mut self, plane: usize, y: usize, x: usize, values: &[f64]) -> Result<()> {
        let written = self.seek(plane, y, x).and_then(|_| self.file.write_all(bytemuck::cast_slice(values)));
        written.map_err(|error| cannot_write(self.store, &error))
    }
}
