//! Merging a unit into its tile: the arithmetic, and all that is derived from the new mean.

use std::io::Write;

use super::grid::Rect;
use super::map::Chunk;
use super::metadata::Layout;
use super::weights::Shape;
use super::{BLOCK, Grid};
use crate::spectral::colour::Projection;
use crate::{Error, Result};

/// The most bytes of a new chunk held in memory before they are written, unless one pixel alone is longer.
const BUFFER_BYTES: usize = 1 << 20;

/// The samples per pixel after a unit, if it may follow those merged.
pub(super) fn check_portion(n_before: u32, n_unit: u32, epoch: u32) -> Result<u32> {
    let fits = if n_before < epoch { n_unit >= 1 && n_unit <= epoch - n_before } else { n_unit == epoch };
    match n_before.checked_add(n_unit) {
        Some(samples) if fits => Ok(samples),
        Some(_) => Err(Error::Internal(format!(
            "a unit of {n_unit} samples cannot follow {n_before} where an epoch has {epoch}: epochs are merged whole"
        ))),
        None => Err(Error::Usage(format!("more than {} samples per pixel cannot be counted", u32::MAX))),
    }
}

/// Merges `unit`, the mean of `n_unit` samples, into `mean`, that of `n_before`, as [`super::Writer::merge_unit`] does.
pub fn merge_means(mean: &mut [f32], n_before: u32, unit: &[f32], n_unit: u32) {
    let weight = f64::from(n_unit) / (f64::from(n_before) + f64::from(n_unit));
    for (mean, &new) in mean.iter_mut().zip(unit) {
        *mean = merged(f64::from(*mean), f64::from(new), weight);
    }
}

/// The new running mean. This form, and not a weighted sum: a zero difference changes nothing, whatever the weight.
fn merged(old: f64, new: f64, weight: f64) -> f32 {
    (old + (new - old) * weight) as f32
}

/// What merging a unit into a cube of `header` holds in memory at most, bytes: the unit and the old chunk apart, which are
/// where the device and the file have them.
pub fn merge_bytes(header: &super::Header) -> u64 {
    let grid = header.grid();
    let channels = header.channels.len() as u64;
    let [blocks_x, blocks_y] = grid.tile_blocks().map(u64::from);
    let buffer = (BUFFER_BYTES as u64).max(4 * channels);
    // Error sums and a spectrum of squares: two f64 a channel as they were, and two as they become.
    let sums = 4 * 8 * channels;
    // Of factored cubes: radiance of the tile before and after, and of the unit; what both files hold. Of a remainder the same again, with
    // standard errors.
    let shape = Shape::of(header);
    let chunks = if header.has_remainder() { 7 } else { 3 };
    let weights = chunks * header.chunk_bytes() + (shape.entries * (4 * shape.columns + 2 * shape.width)) as u64;
    let weights = if header.is_factored() { weights } else { 0 };
    weights + buffer + sums + 12 * grid.tile_pixels() as u64 + (8 * blocks_y + 4 * blocks_x * blocks_y) * channels
}

/// One pass over the pixels of a unit, in the order of the file: the new chunk streams out, and all that is derived from it is
/// gathered.
pub(super) struct UnitPass<'a> {
    grid: Grid,
    rect: Rect,
    channels: usize,
    projection: &'a Projection,
    /// Σ over pixels of (unit - old mean)².
    distance: Vec<f64>,
    /// Σ over pixels of (new mean)².
    pub square: Vec<f64>,
    /// [tile_h][tile_w][3].
    pub preview: Vec<f32>,
    /// Sums of the blocks in the current column of blocks, [blocks_y][K].
    block_sums: Vec<f64>,
    /// [blocks_x][blocks_y][K].
    pub overview: Vec<f32>,
}

impl<'a> UnitPass<'a> {
    pub fn new(grid: Grid, rect: Rect, channels: usize, projection: &'a Projection) -> Self {
        let [blocks_x, blocks_y] = grid.tile_blocks().map(|n| n as usize);
        UnitPass {
            grid,
            rect,
            channels,
            projection,
            distance: vec![0.0; channels],
            square: vec![0.0; channels],
            preview: vec![f32::NAN; grid.tile_pixels() * 3],
            block_sums: vec![0.0; blocks_y * channels],
            overview: vec![f32::NAN; blocks_x * blocks_y * channels],
        }
    }

    /// Folds `unit`, whose pixels lie as in `layout`, into `old` with the weight n_unit / (n_old + n_unit) and writes the new
    /// chunk.
    pub fn run(
        &mut self,
        old: Option<&Chunk>,
        unit: &[f32],
        layout: Layout,
        weight: f64,
        file: &mut impl Write,
    ) -> std::io::Result<()> {
        let channels = self.channels;
        let [tile_width, tile_height] = self.grid.tile;
        let [width, height] = [self.rect.width(), self.rect.height()];
        let buffered = (BUFFER_BYTES / (4 * channels)).clamp(1, self.grid.tile_pixels());
        let mut buffer: Vec<f32> = Vec::with_capacity(buffered * channels);
        for x in 0..tile_width {
            for y in 0..tile_height {
                let start = buffer.len();
                if x < width && y < height {
                    let new = &unit[layout.pixel(self.grid.tile, x, y) * channels..][..channels];
                    match old {
                        None => buffer.extend_from_slice(new),
                        Some(old) => {
                            buffer.resize(start + channels, 0.0);
                            let mean = &mut buffer[start..];
                            let pixel = Layout::Columns.pixel(self.grid.tile, x, y);
                            let old = &old.values()[pixel * channels..][..channels];
                            merge_pixel(old, new, weight, mean, &mut self.distance);
                        }
                    }
                    self.gather(x as usize, y as usize, &buffer[start..]);
                } else {
                    buffer.resize(start + channels, f32::NAN);
                }
                if buffer.len() == buffered * channels {
                    file.write_all(bytemuck::cast_slice(&buffer))?;
                    buffer.clear();
                }
            }
            if x < width && ((x + 1) % BLOCK == 0 || x + 1 == width) {
                self.finish_blocks(x as usize);
            }
        }
        file.write_all(bytemuck::cast_slice(&buffer))
    }

    /// The pass of values that stand for others, whose distances `of` has.
    pub fn with_distance(self, of: UnitPass) -> Self {
        UnitPass { distance: of.distance, ..self }
    }

    /// Adds a pixel's new mean to everything derived.
    fn gather(&mut self, x: usize, y: usize, mean: &[f32]) {
        let pixel = y * self.grid.tile[0] as usize + x;
        self.preview[pixel * 3..][..3].copy_from_slice(&self.projection.rgb(mean));
        let block = &mut self.block_sums[y / BLOCK as usize * self.channels..][..self.channels];
        for ((&mean, square), block) in mean.iter().zip(&mut self.square).zip(block) {
            let mean = f64::from(mean);
            *square += mean * mean;
            *block += mean;
        }
    }

    /// Turns the sums of the column of blocks that ends with column `x` of the tile into means.
    fn finish_blocks(&mut self, x: usize) {
        let block = BLOCK as usize;
        let (column, columns) = (x / block, x % block + 1);
        let means = self.overview.chunks_exact_mut(self.block_sums.len()).nth(column).expect("a column of blocks");
        let of_blocks = means.chunks_exact_mut(self.channels).zip(self.block_sums.chunks_exact_mut(self.channels));
        for (row, (means, sums)) in of_blocks.enumerate() {
            let rows = (self.rect.height() as usize).saturating_sub(row * block).min(block);
            if rows > 0 {
                let pixels = (rows * columns) as f64;
                means.iter_mut().zip(sums.iter()).for_each(|(mean, sum)| *mean = (sum / pixels) as f32);
            }
            sums.fill(0.0);
        }
    }

    /// Per channel, Σ M2 and Σ mean² of the tile after this unit: Welford's M2 += δ² B / (B + 1), δ the distance of the
    /// new epoch from the mean of the B epochs before it. The portions of the first epoch are one epoch together.
    /// `old`: the samples before, and their Σ M2.
    pub fn sums(&mut self, old: Option<(u32, &[f64])>, epoch: u32) -> (Vec<f64>, Vec<f64>) {
        let mut spread = vec![0.0; self.channels];
        if let Some((samples, old)) = old
            && samples >= epoch
        {
            let before = f64::from(samples / epoch);
            for ((spread, old), distance) in spread.iter_mut().zip(old).zip(&self.distance) {
                *spread = old + distance * (before / (before + 1.0));
            }
        }
        (spread, std::mem::take(&mut self.square))
    }
}

/// Writes the standard errors of a tile's new means to `file`: of `unit`, rows of pixels, the mean of the last of `epochs` equal epochs, and
/// the mean and the standard error of those before it. With B epochs the variance of the mean is M2 / (B (B - 1)), M2 the
/// sum that Welford's rule adds δ² (B - 1) / B to, δ the distance of the last epoch from the mean before it; so the standard
/// error carries the sum from one epoch to the next. NaN below two epochs, and beyond the edge of the picture.
pub(super) fn write_standard_errors(
    grid: Grid,
    rect: Rect,
    channels: usize,
    epochs: u32,
    old: Option<(&Chunk, &Chunk)>,
    unit: &[f32],
    file: &mut impl Write,
) -> std::io::Result<()> {
    let buffered = (BUFFER_BYTES / (4 * channels)).clamp(1, grid.tile_pixels());
    let mut buffer: Vec<f32> = Vec::with_capacity(buffered * channels);
    let n = f64::from(epochs);
    let [tile_width, tile_height] = grid.tile;
    for (x, y) in (0..tile_width).flat_map(|x| (0..tile_height).map(move |y| (x, y))) {
        let is_inside = x < rect.width() && y < rect.height();
        let of = |layout: Layout| {
            let pixel = layout.pixel(grid.tile, x, y);
            pixel * channels..(pixel + 1) * channels
        };
        match old {
            Some((mean, error)) if is_inside && epochs >= 2 => {
                let values = of(Layout::Columns);
                let before = mean.values()[values.clone()].iter().zip(&error.values()[values]);
                buffer.extend(before.zip(&unit[of(Layout::Rows)]).map(|((&mean, &error), &new)| {
                    let error = f64::from(error);
                    // The first of the epochs has no spread yet.
                    let spread = if epochs == 2 { 0.0 } else { error * error * (n - 1.0) * (n - 2.0) };
                    let distance = f64::from(new) - f64::from(mean);
                    let spread = spread + distance * distance * ((n - 1.0) / n);
                    (spread / (n * (n - 1.0))).sqrt() as f32
                }));
            }
            _ => buffer.resize(buffer.len() + channels, f32::NAN),
        }
        if buffer.len() == buffered * channels {
            file.write_all(bytemuck::cast_slice(&buffer))?;
            buffer.clear();
        }
    }
    file.write_all(bytemuck::cast_slice(&buffer))
}

/// The new running mean of one pixel, and δ² of every channel added to `distance`.
fn merge_pixel(old: &[f32], new: &[f32], weight: f64, mean: &mut [f32], distance: &mut [f64]) {
    for (((&old, &new), mean), distance) in old.iter().zip(new).zip(mean).zip(distance) {
        let (old, new) = (f64::from(old), f64::from(new));
        *mean = merged(old, new, weight);
        *distance += (new - old) * (new - old);
    }
}
