//! Radiance of the pixels of a tile, and its standard errors: sums over all entries, by the processor or something else.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use pulp::{Arch, Simd, WithSimd};

use super::{Groups, Weights};
use crate::Result;
use crate::cube::grid::Rect;
use crate::spectral::product::{Expander, Product};

/// The means of products over channels.
#[derive(Clone, Copy)]
pub enum Rows<'a> {
    /// \[product\]\[channel\], as [`Expander::rows`] makes them, and the number of channels.
    Made(&'a [f32], usize),
    /// Made for some channels at a time, and never all at once.
    Of(&'a Expander, &'a [Product]),
}

impl Rows<'_> {
    pub fn channels(&self) -> usize {
        match self {
            Rows::Made(_, channels) => *channels,
            Rows::Of(expander, _) => expander.channels(),
        }
    }

    pub fn products(&self) -> usize {
        match self {
            Rows::Made(rows, channels) => rows.len() / (*channels).max(1),
            Rows::Of(_, products) => products.len(),
        }
    }

    /// Those of some channels: a product's in `out` from `width` times its number on.
    pub fn write(&self, channels: Range<usize>, width: usize, out: &mut [f32]) {
        match self {
            Rows::Made(rows, all) => {
                for (out, row) in out.chunks_mut(width).zip(rows.chunks(*all)) {
                    out[..channels.len()].copy_from_slice(&row[channels.clone()]);
                }
            }
            Rows::Of(expander, products) => expander.write_rows(products, channels, width, out),
        }
    }
}

/// What makes the sums of a tile.
pub trait Expand: Sync {
    /// The sums of all pixels with the first set of weights to `values`, \[pixel\]\[channel\], and where there are more sets their standard
    /// errors to `errors`, which else is empty.
    ///
    /// # Errors
    /// Those of a device.
    fn sums(&self, of: &Entries, values: &mut [f32], errors: &mut [f32]) -> Result<()>;
}

/// The entries of a tile's pixels, and what they are multiplied by.
pub struct Entries<'a> {
    /// Where each pixel's entries begin and end.
    pub pixels: Vec<[u32; 2]>,
    /// Of each entry its place among the rows.
    pub products: &'a [u32],
    /// Weights of all entries: of all samples, then of each group with epochs, if errors are wanted.
    pub sets: Vec<&'a [f32]>,
    /// Of each set of a group, the number of its epochs; and what their squared distances from the mean are divided by.
    pub epochs: Vec<f64>,
    pub divisor: f64,
    pub rows: Rows<'a>,
}

impl Weights {
    /// The radiance of all pixels, in the order of a chunk's files: column by column. Beyond `rect` NaN.
    pub fn expanded(&self, rows: Rows, tile: [u32; 2], rect: Rect) -> Vec<f32> {
        let [values, _] = self.expand_here(rows, tile, rect, None);
        values
    }

    /// Standard errors of the means of all pixels, by the spread of the groups; NaN below two epochs.
    pub fn standard_errors(&self, rows: Rows, tile: [u32; 2], rect: Rect, groups: &Groups) -> Vec<f32> {
        let [_, errors] = self.expand_here(rows, tile, rect, Some(groups));
        errors
    }

    fn expand_here(&self, rows: Rows, tile: [u32; 2], rect: Rect, groups: Option<&Groups>) -> [Vec<f32>; 2] {
        let (mut values, mut errors) = (Vec::new(), Vec::new());
        let done = self.expand_by(&Processor, rows, tile, rect, groups, [&mut values, &mut errors]);
        done.expect("a processor has no errors");
        [values, errors]
    }

    /// Both, to vectors that may have been used before; without groups no errors.
    ///
    /// Var = Σ b_g (m_g - m)² / ((G - 1) B): b_g of B epochs are of group g, whose mean is m_g.
    ///
    /// # Errors
    /// As [`Expand::sums`].
    pub fn expand_by(
        &self,
        by: &dyn Expand,
        rows: Rows,
        tile: [u32; 2],
        rect: Rect,
        groups: Option<&Groups>,
        [values, errors]: [&mut Vec<f32>; 2],
    ) -> Result<()> {
        let size = self.pixels() * rows.channels();
        let divisor = groups.and_then(Groups::divisor);
        values.resize(size, 0.0);
        errors.resize(if groups.is_some() { size } else { 0 }, 0.0);
        if divisor.is_none() {
            errors.fill(f32::NAN);
        }
        let (mut in_groups, mut epochs) = (Vec::new(), Vec::new());
        if let (Some(groups), Some(_)) = (groups, divisor) {
            let total = groups.total();
            for (group, of_group) in groups.with_epochs() {
                in_groups.push((0..self.len()).map(|i| self.weight_in(i, group, groups, total)).collect::<Vec<f32>>());
                epochs.push(f64::from(of_group));
            }
        }
        let in_picture = |x: u32, y: u32| x < rect.width() && y < rect.height();
        let columns = || (0..tile[0]).flat_map(|x| (0..tile[1]).map(move |y| (x, y)));
        let entries_of = |(x, y)| {
            let entries = if in_picture(x, y) { self.entries((y * tile[0] + x) as usize) } else { 0..0 };
            [entries.start as u32, entries.end as u32]
        };
        let of = Entries {
            pixels: columns().map(entries_of).collect(),
            products: &self.product,
            sets: [&self.weight].into_iter().chain(&in_groups).map(Vec::as_slice).collect(),
            epochs,
            divisor: divisor.unwrap_or(f64::NAN),
            rows,
        };
        by.sums(&of, values, if divisor.is_some() { &mut errors[..] } else { &mut [] })?;
        for (pixel, _) in columns().enumerate().filter(|(_, (x, y))| !in_picture(*x, *y)) {
            let of_pixel = pixel * rows.channels()..(pixel + 1) * rows.channels();
            errors.get_mut(of_pixel.clone()).into_iter().for_each(|errors| errors.fill(f32::NAN));
            values[of_pixel].fill(f32::NAN);
        }
        Ok(())
    }
}

/// Sums by the processor, with the vectors that it has. In the order of the entries, whatever these are: the bits do not depend on the machine.
pub struct Processor;

/// Channels of a pixel that are summed in registers.
const WIDTH: usize = 64;
/// Bytes of rows that stay near the processor: as many channels are made of all products at a time, and at least `WIDTH`. Where a tile has
/// tens of thousands of products, pixels have few of them in common beside some thousand.
const NEAR: usize = 1 << 20;

/// Where vectors may begin: none lies across two lines of the cache.
#[repr(C, align(64))]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Line([f32; 16]);

/// Of some channels of a pixel.
type Sums = [f32; WIDTH];

impl Expand for Processor {
    fn sums(&self, of: &Entries, values: &mut [f32], errors: &mut [f32]) -> Result<()> {
        let (arch, products, all) = (Arch::new(), of.rows.products().max(1), of.rows.channels());
        let at_once = (NEAR / 4 / products / WIDTH).clamp(1, all.div_ceil(WIDTH)) * WIDTH;
        // One line more than is needed where rows are long: those that lie as far apart as a way of the cache is long drive each other out.
        let stride = at_once / 16 + usize::from(at_once > WIDTH);
        let mut rows = vec![Line::zeroed(); products * stride];
        for from in (0..all).step_by(at_once) {
            let channels = from..(from + at_once).min(all);
            of.rows.write(channels.clone(), 16 * stride, bytemuck::cast_slice_mut(&mut rows));
            arch.dispatch(Block { of, rows: &rows, stride, channels, values: &mut *values, errors: &mut *errors });
        }
        Ok(())
    }
}

/// Some channels of all pixels.
struct Block<'a> {
    of: &'a Entries<'a>,
    /// Of each product `stride`.
    rows: &'a [Line],
    stride: usize,
    channels: Range<usize>,
    values: &'a mut [f32],
    errors: &'a mut [f32],
}

impl WithSimd for Block<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Block { of, rows, stride, channels, values, errors } = self;
        let all = of.rows.channels();
        let rows = bytemuck::cast_slice::<Line, S::f32s>(rows);
        let stride = stride * (16 / S::F32_LANES);
        for (number, &[begin, end]) in of.pixels.iter().enumerate() {
            let at = number * all + channels.start;
            let pixel = |from| Pixel { simd, of, entries: begin as usize..end as usize, rows: &rows[from..], stride };
            let pixels = (0..).step_by(WIDTH / S::F32_LANES).map(pixel);
            let values = values[at..][..channels.len()].chunks_mut(WIDTH);
            if errors.is_empty() {
                for (values, pixel) in values.zip(pixels) {
                    let [sums] = pixel.sums([0]);
                    put(&sums, values);
                }
                continue;
            }
            let errors = errors[at..][..channels.len()].chunks_mut(WIDTH);
            for ((values, errors), pixel) in values.zip(errors).zip(pixels) {
                let [mean, deviation] = pixel.means();
                put(&mean, values);
                put(&deviation, errors);
            }
        }
    }
}

/// As many as there is room for.
#[inline(always)]
fn put(sums: &Sums, out: &mut [f32]) {
    match out.first_chunk_mut() {
        // Of a number that is known.
        Some(out) => *out = *sums,
        None => out.copy_from_slice(&sums[..out.len()]),
    }
}

/// The entries of a pixel, and the rows of all products from the first of `WIDTH` channels on.
struct Pixel<'a, S: Simd> {
    simd: S,
    of: &'a Entries<'a>,
    entries: Range<usize>,
    rows: &'a [S::f32s],
    stride: usize,
}

impl<S: Simd> Pixel<'_, S> {
    /// The means of the channels and their standard errors.
    #[inline(always)]
    fn means(&self) -> [Sums; 2] {
        let mut mean = [0.0; WIDTH];
        let mut variance = [0.0f64; WIDTH];
        let count = self.of.sets.len();
        // Two sets at a time: their sums stay in registers, and a row is loaded once for both.
        for set in (0..count).step_by(2) {
            let sums = if set + 1 < count {
                self.sums([set, set + 1])
            } else {
                let [sums] = self.sums([set]);
                [sums; 2]
            };
            for (number, sums) in (set..count).zip(&sums) {
                if number == 0 {
                    mean = *sums;
                    continue;
                }
                let epochs = self.of.epochs[number - 1];
                for ((variance, &of_group), &mean) in variance.iter_mut().zip(sums).zip(&mean) {
                    let distance = f64::from(of_group) - f64::from(mean);
                    *variance += epochs * distance * distance;
                }
            }
        }
        [mean, variance.map(|variance| (variance / self.of.divisor).sqrt() as f32)]
    }

    /// Σ over the entries with each of some sets of weights.
    #[inline(always)]
    fn sums<const SETS: usize>(&self, sets: [usize; SETS]) -> [Sums; SETS] {
        // As many vectors as registers hold, and as fill the time that an addition takes.
        if SETS == 1 && WIDTH / S::F32_LANES >= 8 {
            self.sums_by::<SETS, 8>(sets)
        } else {
            self.sums_by::<SETS, 4>(sets)
        }
    }

    /// Likewise, `N` vectors at a time.
    #[inline(always)]
    fn sums_by<const SETS: usize, const N: usize>(&self, sets: [usize; SETS]) -> [Sums; SETS] {
        let simd = self.simd;
        let products = &self.of.products[self.entries.clone()];
        let weights = sets.map(|set| &self.of.sets[set][self.entries.clone()]);
        let mut sums = [[0.0; WIDTH]; SETS];
        for at in (0..WIDTH / S::F32_LANES).step_by(N) {
            let mut parts = [[simd.splat_f32s(0.0); N]; SETS];
            for (i, &product) in products.iter().enumerate() {
                let row = &self.rows[product as usize * self.stride + at..][..N];
                for (parts, weights) in parts.iter_mut().zip(&weights) {
                    let weight = simd.splat_f32s(weights[i]);
                    for (part, &value) in parts.iter_mut().zip(row) {
                        *part = simd.add_f32s(*part, simd.mul_f32s(weight, value));
                    }
                }
            }
            for (sums, parts) in sums.iter_mut().zip(&parts) {
                let lanes = at * S::F32_LANES..(at + N) * S::F32_LANES;
                sums[lanes].copy_from_slice(bytemuck::cast_slice(parts));
            }
        }
        sums
    }
}
