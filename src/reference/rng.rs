//! The reference's own random numbers: xoshiro256++ seeded through SplitMix64.

use std::f64::consts::TAU;

/// SplitMix64 (Steele, Lea, Flood 2014): turns any 64-bit state into well-mixed bits, one call a word.
struct SplitMix64(u64);

impl SplitMix64 {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
}

/// xoshiro256++ 1.0 (Blackman and Vigna 2019).
pub struct Rng([u64; 4]);

impl Rng {
    /// A stream of its own for every tuple of `keys`: each key is absorbed through SplitMix64 in turn, so that
    /// neighbouring pixels and blocks start from unrelated states.
    pub fn from_keys(keys: &[u64]) -> Self {
        let state = keys.iter().fold(0, |state, key| SplitMix64(state ^ key).next());
        let mut seeder = SplitMix64(state);
        Rng(std::array::from_fn(|_| seeder.next()))
    }

    fn next(&mut self) -> u64 {
        let s = &mut self.0;
        let result = s[0].wrapping_add(s[3]).rotate_left(23).wrapping_add(s[0]);
        let t = s[1] << 17;
        s[2] ^= s[0];
        s[3] ^= s[1];
        s[1] ^= s[2];
        s[0] ^= s[3];
        s[2] ^= t;
        s[3] = s[3].rotate_left(45);
        result
    }

    /// Uniform over [0, 1), all 53 bits.
    pub fn uniform(&mut self) -> f64 {
        (self.next() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Normal with mean 0 and deviation 1 (Box and Muller 1958; the second variate is not kept).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (TAU * self.uniform()).cos()
    }

    /// Uniform over the unit disk.
    pub fn unit_disk(&mut self) -> [f64; 2] {
        let (radius, angle) = (self.uniform().sqrt(), TAU * self.uniform());
        [radius * angle.cos(), radius * angle.sin()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The authors' test vectors: SplitMix64 from 1234567, xoshiro256++ from the state 1, 2, 3, 4.
    #[test]
    fn published_sequences() {
        let mut split = SplitMix64(1_234_567);
        let expected = [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423];
        assert_eq!(std::array::from_fn(|_| split.next()), expected);
        let mut rng = Rng([1, 2, 3, 4]);
        let expected =
            [41_943_041, 58_720_359, 3_588_806_011_781_223, 3_591_011_842_654_386, 9_228_616_714_210_784_205];
        assert_eq!(std::array::from_fn(|_| rng.next()), expected);
    }

    /// Two keys swapped, or one shifted, are other streams.
    #[test]
    fn keys_make_separate_streams() {
        let first = |keys: &[u64]| Rng::from_keys(keys).next();
        let all: Vec<u64> = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [0, 0, 0], [0, 0, 1]].iter().map(|k| first(k)).collect();
        for (i, a) in all.iter().enumerate() {
            assert!(!all[i + 1..].contains(a));
        }
    }

    /// Mean and variance of the uniform, normal and disk variates within 5 standard errors at a fixed seed.
    #[test]
    fn moments() {
        const N: usize = 100_000;
        let mut rng = Rng::from_keys(&[7]);
        // (draw, mean, variance, fourth central moment)
        type Draw = fn(&mut Rng) -> f64;
        let cases: [(Draw, f64, f64, f64); 3] = [
            (Rng::uniform, 0.5, 1.0 / 12.0, 1.0 / 80.0),
            (Rng::normal, 0.0, 1.0, 3.0),
            (|rng| rng.unit_disk()[0], 0.0, 0.25, 0.125),
        ];
        for (draw, mean, variance, fourth) in cases {
            let values: Vec<f64> = (0..N).map(|_| draw(&mut rng)).collect();
            let m = values.iter().sum::<f64>() / N as f64;
            let v = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / N as f64;
            assert!((m - mean).abs() < 5.0 * (variance / N as f64).sqrt(), "mean {m}, expected {mean}");
            assert!((v - variance).abs() < 5.0 * ((fourth - variance * variance) / N as f64).sqrt(), "variance {v}");
        }
    }
}
