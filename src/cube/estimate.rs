//! The error estimate: how far the epochs of each tile spread, gathered while merging (DESIGN section 8).

use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use sha2::{Digest, Sha256};

use crate::{Error, Result};

/// First bytes of a file of sums.
const MAGIC: [u8; 8] = *b"SPTSUMS1";

/// What is kept of a tile besides its mean, per channel, summed over its pixels.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct TileSums {
    /// Samples per pixel merged.
    pub samples: u32,
    /// Σ over pixels of Welford's M2 = Σ (epoch mean - mean)² over the epochs so far.
    pub spread: Vec<f64>,
    /// Σ over pixels of mean².
    pub square: Vec<f64>,
}

impl TileSums {
    /// Little-endian: magic, samples, K, `spread`, `square`, SHA-256 of all before.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend(self.samples.to_le_bytes());
        bytes.extend((self.square.len() as u32).to_le_bytes());
        bytes.extend(self.spread.iter().chain(&self.square).flat_map(|v| v.to_le_bytes()));
        bytes.extend(Sha256::digest(&bytes));
        bytes
    }

    pub fn read(path: &Path, channels: usize) -> Result<Option<TileSums>> {
        let bytes = match fs::read(path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(Error::storage(path, error)),
        };
        match Self::parse(&bytes, channels) {
            Some(sums) => Ok(Some(sums)),
            None => Err(Error::storage(path, "is damaged: its length or its checksum is wrong")),
        }
    }

    fn parse(bytes: &[u8], channels: usize) -> Option<TileSums> {
        let (content, digest) = bytes.split_last_chunk::<32>()?;
        let (head, sums) = content.split_first_chunk::<16>()?;
        let valid = sums.len() == 16 * channels
            && head[..8] == MAGIC
            && head[12..] == (channels as u32).to_le_bytes()
            && Sha256::digest(content).as_slice() == digest;
        if !valid {
            return None;
        }
        let samples = u32::from_le_bytes(head[8..12].try_into().ok()?);
        let mut values: Vec<f64> = sums.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
        let square = values.split_off(channels);
        Some(TileSums { samples, spread: values, square })
    }
}

/// sqrt(Σ variance of the mean / Σ mean²) per channel over the tiles begun, with B = samples / epoch equal epochs a
/// tile and s²/B = M2 / (B (B - 1)) the variance of a pixel's mean.
pub(super) fn error_estimate(
    tiles: impl Iterator<Item = Result<Option<TileSums>>>,
    epoch: u32,
    channels: usize,
) -> Result<Vec<f64>> {
    let (mut variance, mut square) = (vec![0.0; channels], vec![0.0; channels]);
    let mut begun = false;
    for sums in tiles {
        let Some(sums) = sums? else { continue };
        let epochs = f64::from(sums.samples / epoch);
        if epochs < 2.0 {
            return Ok(vec![f64::NAN; channels]);
        }
        begun = true;
        for k in 0..channels {
            variance[k] += sums.spread[k] / (epochs * (epochs - 1.0));
            square[k] += sums.square[k];
        }
    }
    if !begun {
        return Ok(vec![f64::NAN; channels]);
    }
    let estimate = |(variance, square): (f64, f64)| {
        // All zero, in every epoch: as converged as can be.
        if variance == 0.0 && square == 0.0 { 0.0 } else { (variance / square).sqrt() }
    };
    Ok(variance.into_iter().zip(square).map(estimate).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sums(samples: u32) -> TileSums {
        TileSums { samples, spread: vec![2.0, 0.0, 0.0], square: vec![9.0, 5.0, 0.0] }
    }

    #[test]
    fn bytes_round_trip_and_damage_is_seen() {
        let bytes = sums(192).to_bytes();
        assert_eq!(TileSums::parse(&bytes, 3), Some(sums(192)));
        assert_eq!(TileSums::parse(&bytes, 2), None);
        for i in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[i] ^= 4;
            assert_eq!(TileSums::parse(&damaged, 3), None, "byte {i}");
            assert_eq!(TileSums::parse(&bytes[..i], 3), None, "cut at {i}");
        }
    }

    #[test]
    fn tiles_add_up_and_too_few_epochs_are_nan() {
        let estimate = |tiles: &[Option<u32>]| {
            let tiles = tiles.iter().map(|n| Ok(n.map(sums)));
            error_estimate(tiles, 64, 3).expect("sums")
        };
        assert!(estimate(&[]).iter().all(|v| v.is_nan()));
        assert!(estimate(&[None]).iter().all(|v| v.is_nan()));
        assert!(estimate(&[Some(192), Some(64)]).iter().all(|v| v.is_nan()));
        // 3 and 2 epochs: 2/(3·2) + 2/(2·1) over 9 + 9; no spread; all zero.
        let expected = [((1.0 / 3.0 + 1.0) / 18.0f64).sqrt(), 0.0, 0.0];
        assert_eq!(estimate(&[Some(192), None, Some(128)]), expected);
    }
}
