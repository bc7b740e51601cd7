//! Radiance of the pixels of a tile by something else than the processor.

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

impl Weights {
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
}
