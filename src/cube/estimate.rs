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

/// What tiles are held to that end by their own errors (`--error-per tile`): a tenth of the picture's mean, so that what is dark need
/// not be as exact as what is bright.
#[derive(Debug, Clone)]
pub(super) struct Floor {
    /// (0.1 L)² of the mean radiance L of each channel.
    squares: Vec<f64>,
}

/// Of the picture's mean, below which no tile's mean is taken for its error.
const LEAST_SHARE: f64 = 0.1;

/// Full epochs at the first look.
pub const FIRST_LOOK: u32 = 8;

/// Whether the error of a tile is looked at after so many full epochs: 8, 10, 12, 14, 16, 20, 24, 28, 32, 40, … Whoever looked after each
/// would sooner or later stop where the mean, or its spread, happens to be low.
fn is_look(epochs: u32) -> bool {
    epochs >= FIRST_LOOK && epochs.is_multiple_of(between(epochs))
}

/// From one look to the next, from so many full epochs on.
fn between(epochs: u32) -> u32 {
    (1 << epochs.ilog2()) / 4
}

/// Full epochs at the first look after `epochs` of them.
pub fn next_look(epochs: u32) -> u32 {
    if epochs < FIRST_LOOK { FIRST_LOOK } else { (epochs / between(epochs) + 1).saturating_mul(between(epochs)) }
}

/// What was seen of a tile before its first look.
pub(super) const UNSEEN: [f32; 2] = [f32::INFINITY; 2];

/// Whether a tile whose errors at its last two looks are these ends at an error of `error`: both must be that small.
pub fn is_within(looks: [f32; 2], error: f64) -> bool {
    looks.iter().all(|look| f64::from(*look) <= error)
}

impl Floor {
    /// For a picture of this mean radiance, W m⁻² sr⁻¹ nm⁻¹, in each channel.
    pub fn of(mean_radiance: &[f64]) -> Floor {
        Floor { squares: mean_radiance.iter().map(|mean| (LEAST_SHARE * mean).powi(2)).collect() }
    }

    /// The largest error of a channel of a tile of `pixels` pixels: sqrt(Σ variance of the mean / max(Σ mean², n (0.1 L)²)), sums over
    /// its n pixels, by `epochs` full epochs, two at least.
    fn error(&self, record: &Record, epochs: u32, pixels: u64) -> f32 {
        let b = f64::from(epochs);
        let of_channel = |((&spread, &square), floor): ((&f64, &f64), &f64)| {
            let variance = spread.max(0.0) / (b * (b - 1.0));
            let least = square.max(pixels as f64 * floor);
            // All zero, in every epoch and in the picture: as converged as can be.
            if variance <= 0.0 { 0.0 } else { (variance / least).sqrt() }
        };
        record.spread.iter().zip(&record.square).zip(&self.squares).map(of_channel).fold(0.0, f64::max) as f32
    }

    /// What was seen at the last two looks, `before` this record being what had been seen until then.
    pub fn looks(&self, before: [f32; 2], record: &Record, epoch: u32, pixels: u64) -> [f32; 2] {
        let epochs = record.samples / epoch;
        if !is_look(epochs) { before } else { [before[1], self.error(record, epochs, pixels)] }
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
            looks: [f32::INFINITY; 2],
            checksums: [0; TileArray::MOST],
            spread: vec![2.0, 0.0, 0.0],
            square: vec![9.0, 5.0, 0.0],
            remainder: None,
        }
    }

    #[test]
    fn looks_grow_apart() {
        let looks: Vec<u32> = (0..100).filter(|&epochs| is_look(epochs)).collect();
        assert_eq!(looks, [8, 10, 12, 14, 16, 20, 24, 28, 32, 40, 48, 56, 64, 80, 96]);
        for epochs in 0..96 {
            assert_eq!(next_look(epochs), *looks.iter().find(|look| **look > epochs).expect("a look"));
        }
    }

    #[test]
    fn errors_of_tiles_have_a_floor() {
        let record = |samples| Record { spread: vec![8.0, 0.0, 0.5], square: vec![16.0, 5.0, 0.0], ..record(samples) };
        let looks = |mean: [f64; 3], samples| Floor::of(&mean).looks([0.5, 0.25], &record(samples), 64, 4);
        // 8 / (8 x 7) over 16, in the first channel; over 4 (0.1 x 40)² = 64; and 0.5 / 56 over 4 (0.1 x 1)² in the third.
        assert_eq!(looks([0.0, 0.0, 1e9], 512), [0.25, (1.0 / 7.0 / 16.0f64).sqrt() as f32]);
        assert_eq!(looks([40.0, 0.0, 1e9], 512), [0.25, (1.0 / 7.0 / 64.0f64).sqrt() as f32]);
        assert_eq!(looks([40.0, 0.0, 1.0], 512), [0.25, (0.5 / 56.0 / 0.04f64).sqrt() as f32]);
        assert_eq!(looks([40.0, 0.0, 0.0], 512)[1], f32::INFINITY);
        // Nobody looks in between.
        assert_eq!(looks([40.0, 0.0, 1.0], 576), [0.5, 0.25]);
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
