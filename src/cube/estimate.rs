//! The error estimate: how far the epochs of each tile spread, gathered while merging (docs/METHOD.md, Errors).

use super::journal::Record;

/// Sums over tiles, per channel, of what the error estimate is made of.
#[derive(Debug, Clone)]
pub(super) struct Totals {
    /// Samples per pixel of a full epoch.
    epoch: u32,
    /// Σ variance of the mean, and Σ mean².
    variance: Vec<f64>,
    square: Vec<f64>,
    /// Tiles begun, and those of them with fewer than two epochs.
    begun: u32,
    too_few: u32,
}

impl Totals {
    pub fn new(channels: usize, epoch: u32) -> Totals {
        Totals { epoch, variance: vec![0.0; channels], square: vec![0.0; channels], begun: 0, too_few: 0 }
    }

    /// Counts a tile as what `new` says instead of what `old` said of it.
    pub fn replace(&mut self, old: Option<&Record>, new: &Record) {
        if let Some(old) = old {
            self.add(old, -1.0);
            self.begun -= 1;
            self.too_few -= u32::from(self.epochs(old) < 2);
        }
        self.add(new, 1.0);
        self.begun += 1;
        self.too_few += u32::from(self.epochs(new) < 2);
    }

    fn epochs(&self, record: &Record) -> u32 {
        record.samples / self.epoch
    }

    /// With B equal epochs, s²/B = M2 / (B (B - 1)) is the variance of a pixel's mean.
    fn add(&mut self, record: &Record, sign: f64) {
        let epochs = f64::from(self.epochs(record));
        if epochs < 2.0 {
            return;
        }
        for (sum, spread) in self.variance.iter_mut().zip(&record.spread) {
            *sum += sign * spread / (epochs * (epochs - 1.0));
        }
        for (sum, square) in self.square.iter_mut().zip(&record.square) {
            *sum += sign * square;
        }
    }

    /// Whether nothing but zeros was seen, of which the estimate knows nothing.
    pub fn is_dark(&self) -> bool {
        self.begun > 0 && self.too_few == 0 && self.square.iter().all(|square| *square <= 0.0)
    }

    /// sqrt(Σ variance of the mean / Σ mean²) per channel; NaN while a tile begun has fewer than two epochs.
    pub fn error_estimate(&self) -> Vec<f64> {
        if self.begun == 0 || self.too_few > 0 {
            return vec![f64::NAN; self.variance.len()];
        }
        let estimate = |(&variance, &square): (&f64, &f64)| {
            // All zero, in every epoch: as converged as can be. What taking away and adding leaves of a zero is none.
            if square <= 0.0 { 0.0 } else { (variance.max(0.0) / square).sqrt() }
        };
        self.variance.iter().zip(&self.square).map(estimate).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cube::store::TileArray;

    fn record(samples: u32) -> Record {
        Record {
            tile: 0,
            samples,
            epoch: 0,
            suffix: 0,
            checksums: [0; TileArray::MOST],
            spread: vec![2.0, 0.0, 0.0],
            square: vec![9.0, 5.0, 0.0],
        }
    }

    #[test]
    fn tiles_add_up_and_too_few_epochs_are_nan() {
        let totals = |tiles: &[u32]| {
            let mut totals = Totals::new(3, 64);
            tiles.iter().for_each(|&n| totals.replace(None, &record(n)));
            totals
        };
        assert!(totals(&[]).error_estimate().iter().all(|v| v.is_nan()));
        assert!(totals(&[192, 64]).error_estimate().iter().all(|v| v.is_nan()));
        // 3 and 2 epochs: 2/(3·2) + 2/(2·1) over 9 + 9; no spread; all zero.
        let expected = [((1.0 / 3.0 + 1.0) / 18.0f64).sqrt(), 0.0, 0.0];
        assert_eq!(totals(&[192, 128]).error_estimate(), expected);
        let mut replaced = totals(&[192, 64]);
        replaced.replace(Some(&record(64)), &record(128));
        assert_eq!(replaced.error_estimate(), expected);
    }
}
