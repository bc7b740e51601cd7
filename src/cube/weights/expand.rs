//! Radiance of the pixels of a tile, Σ weight x row of its product: what relighting spends its time on.

use bytemuck::cast_slice;
use pulp::{Arch, Simd, WithSimd};

use super::{Groups, Weights};
use crate::Result;
use crate::cube::grid::Rect;

/// What makes the sums of a tile in the place of the processor.
pub trait Expand: Sync {
    /// \[pixel\]\[channel\], pixels row by row of the full tile: the sums with the one set of weights, or their standard error where there
    /// are several.
    ///
    /// # Errors
    /// Those of the device.
    fn sums(&self, of: Entries) -> Result<Vec<f32>>;
}

/// The entries of a tile's pixels, and what they are multiplied by.
#[derive(Debug, Clone, Copy)]
pub struct Entries<'a> {
    /// Where each pixel's entries begin, and the end of the last one's.
    pub starts: &'a [u32],
    /// Of each entry its place among the rows.
    pub products: &'a [u32],
    /// Weights of all entries: of all samples, then of each group with epochs, if errors are wanted.
    pub sets: &'a [&'a [f32]],
    /// Of each set of a group, the number of its epochs; and what their squared distances from the mean are divided by.
    pub epochs: &'a [f64],
    pub divisor: f64,
    /// \[product\]\[channel\].
    pub rows: &'a [f32],
    pub channels: usize,
}

impl Entries<'_> {
    pub fn pixels(&self) -> usize {
        self.starts.len() - 1
    }
}

/// Weights of the groups that have epochs, how many each has, and the divisor of their squares.
struct OfGroups {
    weights: Vec<Vec<f32>>,
    epochs: Vec<f64>,
    divisor: f64,
}

/// Values of a block of channels, of all products, that a processor's second cache surely holds.
const MOST_PACKED: usize = 1 << 18;

/// The sums over the entries of `pixels`, in every channel, once with each of `sets` of weights. A block of channels of all rows stays in
/// the cache while the pixels go by, and a pixel's sums stay in registers; they are added in the order of the entries, so that the bits are
/// those of any machine.
struct Sums<'a, F> {
    weights: &'a Weights,
    /// \[product\]\[channel\].
    rows: &'a [f32],
    channels: usize,
    sets: &'a [&'a [f32]],
    pixels: &'a [usize],
    /// Takes, of the pixel of that number among them, from that channel on, [set][channel].
    put: F,
}

impl<F: FnMut(usize, usize, &[f32])> WithSimd for Sums<'_, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let widest = 8 * S::F32_LANES;
        if widest * self.weights.products.len() > MOST_PACKED {
            return self.whole_rows();
        }
        let mut from = 0;
        while from < self.channels {
            from += match (self.channels - from).div_ceil(S::F32_LANES) {
                8.. => self.block::<S, 8>(simd, from),
                4.. => self.block::<S, 4>(simd, from),
                2.. => self.block::<S, 2>(simd, from),
                _ => self.block::<S, 1>(simd, from),
            };
        }
    }
}

impl<F: FnMut(usize, usize, &[f32])> Sums<'_, F> {
    /// A pixel after the other, in all channels: of so many products that each is in a few pixels only, and no block of them stays in the cache.
    #[inline(always)]
    fn whole_rows(&mut self) {
        let channels = self.channels;
        let row = |i: usize| &self.rows[self.weights.product[i] as usize * channels..][..channels];
        let mut sums = vec![0.0f32; channels * self.sets.len()];
        for (n, &pixel) in self.pixels.iter().enumerate() {
            let entries = self.weights.entries(pixel);
            let in_fours = entries.end - entries.len() % 4;
            for (set, sums) in self.sets.iter().zip(sums.chunks_exact_mut(channels)) {
                sums.fill(0.0);
                // So that what is summed is loaded and stored once for four.
                for i in (entries.start..in_fours).step_by(4) {
                    let rows = row(i).iter().zip(row(i + 1)).zip(row(i + 2)).zip(row(i + 3));
                    for (sum, (((a, b), c), d)) in sums.iter_mut().zip(rows) {
                        *sum = *sum + set[i] * a + set[i + 1] * b + set[i + 2] * c + set[i + 3] * d;
                    }
                }
                for i in in_fours..entries.end {
                    sums.iter_mut().zip(row(i)).for_each(|(sum, value)| *sum += set[i] * value);
                }
            }
            (self.put)(n, 0, &sums);
        }
    }

    /// So many vectors of channels; gives the channels that are done.
    #[inline(always)]
    fn block<S: Simd, const VECTORS: usize>(&mut self, simd: S, from: usize) -> usize {
        let room = VECTORS * S::F32_LANES;
        let width = room.min(self.channels - from);
        // Side by side, so that no two rows compete for the same lines of the cache.
        let zero = simd.splat_f32s(0.0);
        let mut packed = vec![zero; VECTORS * self.weights.products.len()];
        let rows = self.rows.chunks_exact(self.channels);
        for (row, to) in rows.zip(bytemuck::cast_slice_mut::<_, f32>(&mut packed).chunks_exact_mut(room)) {
            to[..width].copy_from_slice(&row[from..from + width]);
        }
        let (packed, _) = packed.as_chunks::<VECTORS>();
        let mut sums = vec![0.0f32; width * self.sets.len()];
        for (n, &pixel) in self.pixels.iter().enumerate() {
            let entries = self.weights.entries(pixel);
            for (set, sums) in self.sets.iter().zip(sums.chunks_exact_mut(width)) {
                let mut sum = [zero; VECTORS];
                for (&product, &weight) in self.weights.product[entries.clone()].iter().zip(&set[entries.clone()]) {
                    let weight = simd.splat_f32s(weight);
                    let row = &packed[product as usize];
                    for i in 0..VECTORS {
                        // Not fused, which not every machine has.
                        sum[i] = simd.add_f32s(sum[i], simd.mul_f32s(weight, row[i]));
                    }
                }
                sums.copy_from_slice(&cast_slice::<_, f32>(&sum)[..width]);
            }
            (self.put)(n, from, &sums);
        }
        width
    }
}

impl Weights {
    /// The radiance of all pixels, `rows` as [`Expander::rows`](crate::spectral::product::Expander::rows) makes them, in the order of a
    /// chunk's files: column by column. Beyond `rect` NaN.
    pub fn expanded(&self, rows: &[f32], channels: usize, tile: [u32; 2], rect: Rect) -> Vec<f32> {
        self.each(rows, channels, tile, rect, &[&self.weight], |sums, out| out.copy_from_slice(sums))
    }

    /// Standard errors of the means of all pixels, by the spread of the groups; NaN below two epochs. Var = Σ b_g (m_g - m)² / ((G - 1) B):
    /// b_g of B epochs are of group g, whose mean is m_g.
    pub fn standard_errors(
        &self,
        rows: &[f32],
        channels: usize,
        tile: [u32; 2],
        rect: Rect,
        groups: &Groups,
    ) -> Vec<f32> {
        let Some(OfGroups { weights, epochs, divisor }) = self.of_groups(groups) else {
            return vec![f32::NAN; self.pixels() * channels];
        };
        let sets: Vec<&[f32]> = [&self.weight].into_iter().chain(&weights).map(Vec::as_slice).collect();
        self.each(rows, channels, tile, rect, &sets, |sums, out| {
            let (means, of_groups) = sums.split_at(out.len());
            for (k, (out, &mean)) in out.iter_mut().zip(means).enumerate() {
                let square = |(sums, epochs): (&[f32], &f64)| {
                    let distance = f64::from(sums[k]) - f64::from(mean);
                    epochs * distance * distance
                };
                let variance: f64 = of_groups.chunks_exact(means.len()).zip(&epochs).map(square).sum();
                *out = (variance / divisor).sqrt() as f32;
            }
        })
    }

    /// `None` below two epochs.
    fn of_groups(&self, groups: &Groups) -> Option<OfGroups> {
        let all: u32 = groups.epochs.iter().sum();
        if all < 2 {
            return None;
        }
        let total: f64 = groups.samples.iter().sum();
        let others = self.groups - 1;
        let of_group = |group: usize| -> Vec<f32> {
            let share = |i: usize| {
                let shares = &self.shares[i * others..(i + 1) * others];
                if group == 0 { 1.0 - shares.iter().sum::<f32>() } else { shares[group - 1] }
            };
            let weight = |i: usize| f64::from(self.weight[i] * share(i)) * total / groups.samples[group];
            (0..self.len()).map(|i| weight(i) as f32).collect()
        };
        let with_epochs = || groups.epochs.iter().enumerate().filter(|(_, epochs)| **epochs > 0);
        let epochs: Vec<f64> = with_epochs().map(|(_, epochs)| f64::from(*epochs)).collect();
        let divisor = (epochs.len() as f64 - 1.0) * f64::from(all);
        Some(OfGroups { weights: with_epochs().map(|(group, _)| of_group(group)).collect(), epochs, divisor })
    }

    /// [`Weights::expanded`] by something else, whose sums may differ in their last bits.
    ///
    /// # Errors
    /// As [`Expand::sums`].
    pub fn expanded_by(
        &self,
        by: &dyn Expand,
        rows: &[f32],
        channels: usize,
        tile: [u32; 2],
        rect: Rect,
    ) -> Result<Vec<f32>> {
        let sets: [&[f32]; 1] = [&self.weight];
        let entries = self.all_entries(rows, channels, &sets, &[], 1.0);
        Ok(self.in_columns(&by.sums(entries)?, channels, tile, rect))
    }

    /// [`Weights::standard_errors`], likewise.
    ///
    /// # Errors
    /// As [`Expand::sums`].
    pub fn standard_errors_by(
        &self,
        by: &dyn Expand,
        rows: &[f32],
        channels: usize,
        tile: [u32; 2],
        rect: Rect,
        groups: &Groups,
    ) -> Result<Vec<f32>> {
        let Some(OfGroups { weights, epochs, divisor }) = self.of_groups(groups) else {
            return Ok(vec![f32::NAN; self.pixels() * channels]);
        };
        let sets: Vec<&[f32]> = [&self.weight].into_iter().chain(&weights).map(Vec::as_slice).collect();
        let entries = self.all_entries(rows, channels, &sets, &epochs, divisor);
        Ok(self.in_columns(&by.sums(entries)?, channels, tile, rect))
    }

    fn all_entries<'a>(
        &'a self,
        rows: &'a [f32],
        channels: usize,
        sets: &'a [&'a [f32]],
        epochs: &'a [f64],
        divisor: f64,
    ) -> Entries<'a> {
        Entries { starts: &self.starts, products: &self.product, sets, epochs, divisor, rows, channels }
    }

    /// Values of pixels row by row in the order of a chunk's files; beyond `rect` NaN.
    fn in_columns(&self, values: &[f32], channels: usize, tile: [u32; 2], rect: Rect) -> Vec<f32> {
        let mut columns = vec![f32::NAN; self.pixels() * channels];
        for (x, y) in (0..rect.width()).flat_map(|x| (0..rect.height()).map(move |y| (x, y))) {
            let [from, to] = [y * tile[0] + x, x * tile[1] + y].map(|pixel| pixel as usize * channels);
            columns[to..to + channels].copy_from_slice(&values[from..from + channels]);
        }
        columns
    }

    /// Values of the pixels of `rect`, of which `fill` makes some channels at a time out of [set][channel].
    fn each(
        &self,
        rows: &[f32],
        channels: usize,
        tile: [u32; 2],
        rect: Rect,
        sets: &[&[f32]],
        fill: impl Fn(&[f32], &mut [f32]),
    ) -> Vec<f32> {
        let places = || (0..rect.width()).flat_map(|x| (0..rect.height()).map(move |y| (x, y)));
        let pixels: Vec<usize> = places().map(|(x, y)| (y * tile[0] + x) as usize).collect();
        let begins: Vec<usize> = places().map(|(x, y)| (x * tile[1] + y) as usize * channels).collect();
        let mut values = vec![f32::NAN; self.pixels() * channels];
        let put = |n: usize, from: usize, sums: &[f32]| {
            fill(sums, &mut values[begins[n] + from..][..sums.len() / sets.len()]);
        };
        Arch::new().dispatch(Sums { weights: self, rows, channels, sets, pixels: &pixels, put });
        values
    }
}

#[cfg(test)]
mod tests {
    use smallvec::smallvec;

    use super::*;
    use crate::spectral::product::Product;

    /// Blocks of channels of every width and whole rows, in the order of a chunk: the bits of a pixel alone.
    #[test]
    fn blocks_have_the_bits_of_single_pixels() {
        let number = |i: usize| ((i * 7919) % 1013) as f32 / 97.0;
        let product = |i: usize| Product { factors: smallvec![i as u16], source: 0 };
        let (tile, rect) = ([3, 4], Rect { x0: 3, y0: 4, x1: 5, y1: 7 });
        let entries =
            |pixel: usize| (0..5 * pixel).map(move |i| (product((i + pixel) % 71), f64::from(number(i * pixel))));
        let few = Weights::of_pixels((0..12).map(entries));
        // One pixel, beyond the picture, has more products than a cache.
        let several = |pixel: usize| match pixel {
            11 => (0..MOST_PACKED / 8).map(|i| (product(i), 1.0)).collect::<Vec<_>>(),
            pixel => entries(pixel).collect(),
        };
        let many = Weights::of_pixels((0..12).map(|pixel| several(pixel).into_iter()));
        for (weights, channels) in
            [1, 4, 7, 16, 31, 64, 100, 129, 300].into_iter().flat_map(|k| [(&few, k), (&many, k)])
        {
            let rows: Vec<f32> = (0..weights.products.len() * channels).map(number).collect();
            let all = weights.expanded(&rows, channels, tile, rect);
            let mut want = vec![0.0; channels];
            for (x, y) in (0..3).flat_map(|x| (0..4).map(move |y| (x, y))) {
                let got = &all[(4 * x + y) * channels..][..channels];
                if x < 2 && y < 3 {
                    weights.expand(3 * y + x, &rows, &mut want);
                    assert!(want[0] > 0.0 || (x, y) == (0, 0));
                    assert_eq!(got, want, "{channels}: {x}, {y}");
                } else {
                    assert!(got.iter().all(|v| v.is_nan()));
                }
            }
        }
    }
}
