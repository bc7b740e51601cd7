//! Random numbers that depend on what they are for and on nothing that came before: every (seed, purpose, pixel, band) has a
//! stream of its own, so that order, tiles and threads change no bit.

use std::f64::consts::TAU;

use statrs::function::gamma::ln_gamma;

/// What a stream is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// Of one exposure.
    Temporal = 1,
    /// The same in every exposure of a detector.
    Response = 2,
    Dark = 3,
}

/// SplitMix64 (Steele, Lea and Flood 2014).
#[derive(Debug, Clone)]
pub struct Stream(u64);

/// From this mean on, Poisson numbers are made by rejection.
const BY_REJECTION: f64 = 10.0;

impl Stream {
    /// `pixel` is the column and row on the full film.
    pub fn new(seed: u64, purpose: Purpose, pixel: [u32; 2], band: usize) -> Stream {
        let keys = [seed, purpose as u64, u64::from(pixel[0]) << 32 | u64::from(pixel[1]), band as u64];
        Stream(keys.iter().fold(0, |state, key| Stream(state ^ key).next()))
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In (0, 1).
    pub fn uniform(&mut self) -> f64 {
        ((self.next() >> 11) as f64 + 0.5) * (1.0 / (1u64 << 53) as f64)
    }

    /// Mean 0 and standard deviation 1 (Box and Muller 1958); at most 8.7.
    pub fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (TAU * self.uniform()).cos()
    }

    /// A Poisson number: products of uniforms below a mean of 10 (Knuth 1969), above by transformed rejection with the
    /// exact ratio of probabilities (PTRS, Hörmann 1993). That ratio's logarithm is a difference of numbers of the size
    /// mean x ln(mean), so it is rounded by about 1e-16 of these: 1e-5 at 1e10 electrons.
    pub fn poisson(&mut self, mean: f64) -> f64 {
        if mean <= 0.0 {
            return 0.0;
        }
        if mean < BY_REJECTION {
            let limit = (-mean).exp();
            let (mut count, mut product) = (0.0, self.uniform());
            while product > limit {
                product *= self.uniform();
                count += 1.0;
            }
            return count;
        }
        let b = 0.931 + 2.53 * mean.sqrt();
        let a = -0.059 + 0.024_83 * b;
        let inverse_alpha = 1.1239 + 1.1328 / (b - 3.4);
        let accepted_at_once = 0.9277 - 3.6224 / (b - 2.0);
        loop {
            let (u, v) = (self.uniform() - 0.5, self.uniform());
            let from_edge = 0.5 - u.abs();
            let k = ((2.0 * a / from_edge + b) * u + mean + 0.43).floor();
            if from_edge >= 0.07 && v <= accepted_at_once {
                return k;
            }
            if k < 0.0 || (from_edge < 0.013 && v > from_edge) {
                continue;
            }
            let hat = (v * inverse_alpha / (a / (from_edge * from_edge) + b)).ln();
            if hat <= k * mean.ln() - mean - ln_gamma(k + 1.0) {
                return k;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use statrs::distribution::{ChiSquared, ContinuousCDF, Discrete, Poisson};

    use super::*;

    /// Over 100 bands, chi-square of the numbers of each against the probabilities of Poisson's law; p > 0.01 in all of them
    /// together (Sidak). Bins of fewer than 5 expected numbers are pooled.
    #[test]
    fn poisson_numbers_have_poissons_law_in_every_band() {
        const PIXELS: u32 = 4000;
        let alpha = 1.0 - 0.99f64.powf(1.0 / 100.0);
        for band in 0..100usize {
            // From 0.2 to 2e4, through the mean at which the method changes.
            let mean = 0.2 * 10f64.powf(band as f64 / 20.0);
            let law = Poisson::new(mean).expect("a mean");
            let spread = 8.0 * mean.sqrt() + 10.0;
            let first = (mean - spread).max(0.0) as u64;
            let bins = (mean + spread) as u64 - first + 1;
            let mut seen = vec![0.0; bins as usize];
            for pixel in 0..PIXELS {
                let k = Stream::new(7, Purpose::Temporal, [pixel % 64, pixel / 64], band).poisson(mean) as u64;
                seen[(k.clamp(first, first + bins - 1) - first) as usize] += 1.0;
            }
            let (mut chi, mut groups, mut expected, mut found) = (0.0, 0, 0.0, 0.0);
            let (mut left, last) = (f64::from(PIXELS), bins - 1);
            for i in 0..bins {
                let of_bin = if i == last { left - expected } else { f64::from(PIXELS) * law.pmf(first + i) };
                expected += of_bin;
                found += seen[i as usize];
                let rest = left - expected;
                if i == last || (expected >= 5.0 && rest >= 5.0) {
                    chi += (found - expected) * (found - expected) / expected;
                    groups += 1;
                    left = rest;
                    (expected, found) = (0.0, 0.0);
                }
            }
            let p = 1.0 - ChiSquared::new(f64::from(groups - 1).max(1.0)).expect("degrees").cdf(chi);
            assert!(p > alpha, "band {band}, mean {mean}: chi-square {chi} of {groups} groups, p = {p}");
        }
    }

    #[test]
    fn normal_numbers_have_their_moments() {
        const N: u32 = 100_000;
        let [mut sum, mut squares] = [0.0f64; 2];
        for x in 0..N {
            let z = Stream::new(3, Purpose::Dark, [x, 5], 0).normal();
            sum += z;
            squares += z * z;
        }
        let n = f64::from(N);
        // Four standard errors: 1/sqrt(n) of the mean, sqrt(2/n) of the mean square.
        assert!((sum / n).abs() < 4.0 / n.sqrt(), "{}", sum / n);
        assert!((squares / n - 1.0).abs() < 4.0 * (2.0 / n).sqrt(), "{}", squares / n);
    }
}
