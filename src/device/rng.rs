//! Bit-identical twin of `shaders/common/rng.wgsl`: counter-based random numbers keyed by (seed, pixel, epoch,
//! dimension, sample).

/// Integer hash with low bias (C. Wellons, "Prospecting for Hash Functions", 2018: lowbias32).
pub fn hash(value: u32) -> u32 {
    let mut x = value;
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// The key of all samples of one pixel (in the full film) in one epoch.
pub fn pixel_key(seed: u64, x: u32, y: u32, epoch: u32) -> u32 {
    let mut h = hash((seed as u32).wrapping_add(0x9e37_79b9));
    h = hash(h ^ (seed >> 32) as u32);
    h = hash(h ^ x);
    h = hash(h ^ y);
    hash(h ^ epoch)
}

/// Laine-Karras permutation (Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020): bit i of the result
/// depends on bits 0..=i of `value` only.
pub fn permute_upwards(value: u32, seed: u32) -> u32 {
    let mut x = value.wrapping_add(seed);
    x ^= x.wrapping_mul(0x6c50_b47c);
    x ^= x.wrapping_mul(0xb82f_1e52);
    x ^= x.wrapping_mul(0xc7af_e638);
    x ^ x.wrapping_mul(0x8d22_f6e6)
}

/// The second Sobol dimension with reversed bits: the Taylor shift x → x + 1 over GF(2).
pub fn pascal(index: u32) -> u32 {
    let mut r = index;
    r ^= (r >> 1) & 0x5555_5555;
    r ^= (r >> 2) & 0x3333_3333;
    r ^= (r >> 4) & 0x0f0f_0f0f;
    r ^= (r >> 8) & 0x00ff_00ff;
    r ^ ((r >> 16) & 0x0000_ffff)
}

/// Two numbers in [0, 2³²): pair `dimension` of the first two Owen-scrambled Sobol dimensions, padded. `epoch_mask` is
/// the number of samples of the epoch - 1, a power of two - 1.
pub fn sobol_pair(key: u32, dimension: u32, index: u32, epoch_mask: u32) -> [u32; 2] {
    let seed = hash(key.wrapping_add(dimension.wrapping_mul(0x9e37_79b9)));
    let i = permute_upwards(index.reverse_bits(), seed).reverse_bits() & epoch_mask;
    [
        permute_upwards(i, hash(seed ^ 0x68bc_21eb)).reverse_bits(),
        permute_upwards(pascal(i), hash(seed ^ 0x02e5_be93)).reverse_bits(),
    ]
}

/// Two independent numbers in [0, 2³²).
pub fn independent_pair(key: u32, dimension: u32, index: u32) -> [u32; 2] {
    let seed = hash(key.wrapping_add(dimension.wrapping_mul(0x9e37_79b9)));
    let h = hash(seed ^ index);
    [h, hash(h ^ 0x85eb_ca6b)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every epoch of 2^m samples is a (0, m, 2)-net: each elementary interval of area 2^-m holds one point.
    #[test]
    fn every_epoch_is_a_net() {
        for m in 0..=10u32 {
            let n = 1u32 << m;
            for dimension in [0, 3, 17] {
                let key = pixel_key(7, 5, 9, m);
                for a in 0..=m {
                    let mut seen = vec![0u32; n as usize];
                    for i in 0..n {
                        let [x, y] = sobol_pair(key, dimension, i, n - 1);
                        let column = (u64::from(x) << a >> 32) as u32;
                        let row = (u64::from(y) << (m - a) >> 32) as u32;
                        seen[((column << (m - a)) | row) as usize] += 1;
                    }
                    assert!(seen.iter().all(|&c| c == 1), "m = {m}, split {a}, dimension {dimension}");
                }
            }
        }
    }

    /// The unscrambled points are Sobol's own, as an independent implementation has them.
    #[test]
    fn matrix_is_sobol_dimension_one() {
        // Direction numbers of the polynomial x + 1: v_j = v_{j-1} ^ (v_{j-1} >> 1).
        let mut directions = vec![1u32 << 31];
        for j in 1..32 {
            directions.push(directions[j - 1] ^ (directions[j - 1] >> 1));
        }
        for index in (0..2000).chain([u32::MAX, 0x8000_0001, 0xdead_beef]) {
            let expected = (0..32).filter(|j| index >> j & 1 == 1).fold(0, |v, j| v ^ directions[j]);
            assert_eq!(pascal(index).reverse_bits(), expected);
        }
    }

    /// The first two dimensions of sobol_burley (the same construction with its own hashes) form nets too, and its
    /// unscrambled structure agrees: both fill the same number of elementary boxes at every prefix.
    #[test]
    fn agrees_in_structure_with_sobol_burley() {
        let boxes = |point: &dyn Fn(u32) -> [f64; 2], n: u32, columns: f64, rows: f64| {
            let mut seen = std::collections::HashSet::new();
            for i in 0..n {
                let [x, y] = point(i);
                seen.insert(((x * columns) as u32, (y * rows) as u32));
            }
            seen.len()
        };
        let ours = |i: u32| sobol_pair(99, 4, i, 255).map(|v| f64::from(v >> 8) / 16_777_216.0);
        let oracle = |i: u32| [0, 1].map(|d| f64::from(sobol_burley::sample(i, d, 1234)));
        for split in 0..=8 {
            let (columns, rows) = (f64::from(1u32 << split), f64::from(1u32 << (8 - split)));
            assert_eq!(boxes(&ours, 256, columns, rows), boxes(&oracle, 256, columns, rows));
        }
    }

    /// Moments over pixels: uniform and uncorrelated between dimensions, epochs and pixels.
    #[test]
    fn scrambles_are_independent() {
        let n = 200_000u32;
        let value = |pixel: u32, epoch: u32, dimension: u32| {
            f64::from(sobol_pair(pixel_key(1, pixel, 3, epoch), dimension, 0, 0)[0]) / 4_294_967_296.0 - 0.5
        };
        let correlation = |a: &dyn Fn(u32) -> f64, b: &dyn Fn(u32) -> f64| {
            (0..n).map(|i| a(i) * b(i)).sum::<f64>() / f64::from(n) * 12.0
        };
        // The standard deviation of each of these is 1/sqrt(n); 5 sigma.
        let bound = 5.0 / f64::from(n).sqrt();
        assert!(correlation(&|i| value(i, 0, 0), &|i| value(i, 0, 1)).abs() < bound);
        assert!(correlation(&|i| value(i, 0, 0), &|i| value(i, 1, 0)).abs() < bound);
        assert!(correlation(&|i| value(i, 0, 0), &|i| value(i + 1, 0, 0)).abs() < bound);
        assert!(((0..n).map(|i| value(i, 2, 5)).sum::<f64>() / f64::from(n)).abs() < bound / 12f64.sqrt());
    }
}
