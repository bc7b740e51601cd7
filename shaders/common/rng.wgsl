// Counter-based random numbers, keyed by (seed, pixel, epoch, dimension, sample). Bit-identical twin: src/render/rng.rs.

// Integer hash with low bias (C. Wellons, "Prospecting for Hash Functions", 2018: lowbias32).
fn hash(value: u32) -> u32 {
    var x = value;
    x ^= x >> 16u;
    x *= 0x7feb352du;
    x ^= x >> 15u;
    x *= 0x846ca68bu;
    x ^= x >> 16u;
    return x;
}

// The key of all samples of one pixel in one epoch; x and y count in the full film.
fn pixel_key(seed_low: u32, seed_high: u32, x: u32, y: u32, epoch: u32) -> u32 {
    var h = hash(seed_low + 0x9e3779b9u);
    h = hash(h ^ seed_high);
    h = hash(h ^ x);
    h = hash(h ^ y);
    return hash(h ^ epoch);
}

// Laine-Karras permutation: bit i of the result depends on bits 0..i of the input only, so on reversed bits it is a
// nested uniform (Owen) scramble (Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020).
fn permute_upwards(value: u32, seed: u32) -> u32 {
    var x = value + seed;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    x ^= x * 0x8d22f6e6u;
    return x;
}

// The second Sobol dimension with reversed bits. Its matrix is Pascal's triangle mod 2: the shift x -> x + 1 of the
// polynomial over GF(2) whose coefficients are the bits, done in five butterflies.
fn pascal(index: u32) -> u32 {
    var r = index;
    r ^= (r >> 1u) & 0x55555555u;
    r ^= (r >> 2u) & 0x33333333u;
    r ^= (r >> 4u) & 0x0f0f0f0fu;
    r ^= (r >> 8u) & 0x00ff00ffu;
    r ^= (r >> 16u) & 0x0000ffffu;
    return r;
}

// Two random numbers in [0, 2^32) for one pair of dimensions.
fn random_pair_bits(key: u32, dimension: u32, index: u32, epoch_mask: u32) -> vec2<u32> {
    let seed = hash(key + dimension * 0x9e3779b9u);
#if SOBOL
    // The first two Sobol dimensions, padded: each pair visits the points of its epoch in an order of its own.
    let i = reverseBits(permute_upwards(reverseBits(index), seed)) & epoch_mask;
    let x = reverseBits(permute_upwards(i, hash(seed ^ 0x68bc21ebu)));
    let y = reverseBits(permute_upwards(pascal(i), hash(seed ^ 0x02e5be93u)));
    return vec2<u32>(x, y);
#else
    let h = hash(seed ^ index);
    return vec2<u32>(h, hash(h ^ 0x85ebca6bu));
#endif
}

// To [0, 1), exactly representable steps of 2^-24.
fn unit_interval(bits: vec2<u32>) -> vec2<f32> {
    return vec2<f32>(bits >> vec2<u32>(8u)) * 5.9604645e-8;
}

fn random_pair(key: u32, dimension: u32, index: u32, epoch_mask: u32) -> vec2<f32> {
    return unit_interval(random_pair_bits(key, dimension, index, epoch_mask));
}

// Pairs of dimensions.
const DIMENSION_FILM: u32 = 0u;
const DIMENSION_LENS: u32 = 1u;
const DIMENSION_WAVELENGTH: u32 = 2u;
// Per bounce, from here on:
const DIMENSION_BOUNCE: u32 = 3u;
const DIMENSIONS_PER_BOUNCE: u32 = 3u;
const DIMENSION_LIGHT_POINT: u32 = 0u;
const DIMENSION_BSDF: u32 = 1u;
// x: which light; y: roulette.
const DIMENSION_CHOICE: u32 = 2u;
