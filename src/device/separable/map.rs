//! A map of spectra as sources of products: each texel is a sum of a few spectra of the map, as far as it goes; what they leave of it is
//! of the remainder.
//!
//! The spectra are texels that are no sum of others (successive projection: Araújo et al. 2001, Chemometrics and Intelligent Laboratory
//! Systems 57). How much of each a texel has is a least-squares fit without negative shares (Lawson and Hanson 1974, chapter 23), made so
//! small that nothing negative is left in any band.

use std::sync::{Arc, Mutex, Weak};

use rayon::prelude::*;
use smallvec::SmallVec;

use crate::scene::{EnvironmentMap, Texels};

/// Spectra that a map is made of, at most.
const MOST: usize = 16;
/// Another spectrum is not worth it where no texel is further off, over its own radiance.
const ENOUGH: f64 = 1e-6;
/// What is left of a texel, over its own radiance in each band, is rounding below that.
const ROUNDING: f64 = 1e-5;

/// What a map is made of.
#[derive(Debug)]
pub struct Clusters {
    size: [usize; 2],
    /// Radiance in each band, without the scale of the map.
    pub spectra: Vec<Vec<f64>>,
    /// Of each texel, where its shares begin; then where the last ones end.
    begin: Vec<u32>,
    shares: Vec<(u16, f32)>,
    /// [texel][band]: what the spectra leave, if it is anything. Nowhere negative.
    pub left: Option<Vec<f32>>,
}

/// A map's radiance, and what it is made of.
type Known = (Weak<[f32]>, Arc<Clusters>);

/// Those of maps that somebody has still.
static KNOWN: Mutex<Vec<Known>> = Mutex::new(Vec::new());

/// Of a map of spectra; `None` of one of colours, which are no sums of some.
pub fn clusters(map: &EnvironmentMap) -> Option<Arc<Clusters>> {
    let Texels::Spectral { nm, radiance } = &map.texels else { return None };
    let mut known = KNOWN.lock().unwrap_or_else(|broken| broken.into_inner());
    known.retain(|(map, _)| map.strong_count() > 0);
    let is_it = |of: &Weak<[f32]>| std::ptr::addr_eq(of.as_ptr(), Arc::as_ptr(radiance));
    if let Some((_, found)) = known.iter().find(|(of, _)| is_it(of)) {
        return Some(found.clone());
    }
    let found = Arc::new(Clusters::of(map.size, radiance, nm.len()));
    known.push((Arc::downgrade(radiance), found.clone()));
    Some(found)
}

impl Clusters {
    /// Of `radiance`, \[texel\]\[band\], finite and not negative.
    fn of(size: [u32; 2], radiance: &[f32], bands: usize) -> Clusters {
        let spectra = extremes(radiance, bands);
        let fit = Fit::new(&spectra, mean(radiance, bands));
        let fitted: Vec<(SmallVec<[f64; MOST]>, bool)> =
            radiance.par_chunks_exact(bands).map(|texel| fit.shares(&spectra, texel)).collect();
        let (mut begin, mut shares) = (vec![0], Vec::new());
        for (of_texel, _) in &fitted {
            let there = of_texel.iter().enumerate().filter(|(_, share)| **share > 0.0);
            shares.extend(there.map(|(i, share)| (i as u16, *share as f32)));
            begin.push(shares.len() as u32);
        }
        let left = fitted.iter().any(|(_, is_all)| !is_all).then(|| {
            let of_texel = |(texel, (shares, is_all)): (&[f32], &(SmallVec<[f64; MOST]>, bool))| {
                let sum = sum(&spectra, shares);
                let left = texel.iter().zip(sum).map(|(v, sum)| (f64::from(*v) - sum).max(0.0) as f32);
                if *is_all { vec![0.0; bands] } else { left.collect::<Vec<f32>>() }
            };
            radiance.par_chunks_exact(bands).zip(&fitted).flat_map_iter(of_texel).collect()
        });
        Clusters { size: size.map(|side| side as usize), spectra, begin, shares, left }
    }

    /// How much of which spectra there is at a place that a record of the map names (`shaders/parts/sky/map_value.wgsl`).
    pub fn at(&self, cell: u32, fractions: u32) -> SmallVec<[(u16, f64); 8]> {
        let [width, height] = self.size;
        let (column, row) = ((cell & 0xffff) as usize, (cell >> 16) as usize);
        let right = if column + 1 == width { 0 } else { column + 1 };
        let (upper, lower) = ((row.max(1) - 1) * width, row.min(height - 1) * width);
        let [x, y] = [fractions & 0xffff, fractions >> 16].map(|fraction| f64::from(fraction) / 65535.0);
        let corners = [
            (upper + column, (1.0 - x) * (1.0 - y)),
            (upper + right, x * (1.0 - y)),
            (lower + column, (1.0 - x) * y),
            (lower + right, x * y),
        ];
        let mut sums = SmallVec::<[(u16, f64); 8]>::new();
        for (texel, weight) in corners {
            for &(spectrum, share) in &self.shares[self.begin[texel] as usize..self.begin[texel + 1] as usize] {
                let more = weight * f64::from(share);
                match sums.iter_mut().find(|(known, _)| *known == spectrum) {
                    Some((_, sum)) => *sum += more,
                    None => sums.push((spectrum, more)),
                }
            }
        }
        sums
    }
}

fn sum(spectra: &[Vec<f64>], shares: &[f64]) -> Vec<f64> {
    let mut sum = vec![0.0; spectra.first().map_or(0, Vec::len)];
    for (spectrum, share) in spectra.iter().zip(shares).filter(|(_, share)| **share > 0.0) {
        sum.iter_mut().zip(spectrum).for_each(|(sum, value)| *sum += share * value);
    }
    sum
}

/// Of each band.
fn mean(radiance: &[f32], bands: usize) -> Vec<f64> {
    let mut sums = vec![0.0; bands];
    for texel in radiance.chunks_exact(bands) {
        sums.iter_mut().zip(texel).for_each(|(sum, value)| *sum += f64::from(*value));
    }
    let texels = (radiance.len() / bands).max(1) as f64;
    sums.iter_mut().for_each(|sum| *sum /= texels);
    sums
}

/// Texels of which no one is nearly a sum of the others: each time the one that is furthest from what those before make, over its own
/// radiance.
fn extremes(radiance: &[f32], bands: usize) -> Vec<Vec<f64>> {
    let mean = mean(radiance, bands);
    // Each band counts alike, and bright texels as dark ones: of sums that are all 1, the farthest are no sums of others.
    let even = |texel: &[f32]| -> Vec<f64> {
        let values = texel.iter().zip(&mean);
        let values: Vec<f64> = values.map(|(v, mean)| if *mean > 0.0 { f64::from(*v) / mean } else { 0.0 }).collect();
        let total: f64 = values.iter().sum();
        values.iter().map(|v| if total > 0.0 { v / total } else { 0.0 }).collect()
    };
    let mut left: Vec<f32> = radiance.par_chunks_exact(bands).flat_map_iter(even).map(|v| v as f32).collect();
    let mut found: Vec<Vec<f64>> = Vec::new();
    while found.len() < MOST {
        let square = |texel: &[f32]| texel.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>();
        let squares: Vec<f64> = left.par_chunks_exact(bands).map(square).collect();
        let farthest =
            squares.iter().enumerate().fold((0, 0.0), |most, (t, v)| if *v > most.1 { (t, *v) } else { most });
        // The length of an even spectrum is 1 / √bands.
        if (farthest.1 * bands as f64).sqrt() <= ENOUGH {
            break;
        }
        let texel = farthest.0 * bands..(farthest.0 + 1) * bands;
        found.push(radiance[texel.clone()].iter().map(|v| f64::from(*v)).collect());
        let axis: Vec<f64> = left[texel].iter().map(|v| f64::from(*v) / farthest.1.sqrt()).collect();
        left.par_chunks_exact_mut(bands).for_each(|texel| {
            let along: f64 = texel.iter().zip(&axis).map(|(v, axis)| f64::from(*v) * axis).sum();
            texel.iter_mut().zip(&axis).for_each(|(v, axis)| *v = (f64::from(*v) - along * axis) as f32);
        });
    }
    found
}

/// Least squares over bands, each over its mean.
struct Fit {
    /// 1 / mean².
    weights: Vec<f64>,
    /// [spectrum][spectrum].
    products: Vec<Vec<f64>>,
}

impl Fit {
    fn new(spectra: &[Vec<f64>], mean: Vec<f64>) -> Fit {
        let weights: Vec<f64> = mean.iter().map(|mean| if *mean > 0.0 { mean.powi(-2) } else { 0.0 }).collect();
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).zip(&weights).map(|((a, b), w)| a * b * w).sum::<f64>();
        let products = spectra.iter().map(|a| spectra.iter().map(|b| product(a, b)).collect()).collect();
        Fit { weights, products }
    }

    /// Shares of a texel, and whether they are all of it.
    fn shares(&self, spectra: &[Vec<f64>], texel: &[f32]) -> (SmallVec<[f64; MOST]>, bool) {
        let right: Vec<f64> = spectra
            .iter()
            .map(|spectrum| {
                let values = spectrum.iter().zip(texel).zip(&self.weights);
                values.map(|((a, b), w)| a * f64::from(*b) * w).sum::<f64>()
            })
            .collect();
        let mut shares = least_squares(&self.products, &right);
        let fitted = sum(spectra, &shares);
        let values = || texel.iter().map(|v| f64::from(*v)).zip(&fitted);
        if values().all(|(v, fit)| (v - fit).abs() <= ROUNDING * v) {
            return (shares, true);
        }
        // As much of it as leaves nothing negative.
        let most = values().filter(|(_, fit)| **fit > 0.0).map(|(v, fit)| v / fit).fold(1.0, f64::min);
        shares.iter_mut().for_each(|share| *share *= most);
        (shares, false)
    }
}

/// The x ≥ 0 for which |A x - b| is least, of AᵀA and Aᵀb.
fn least_squares(products: &[Vec<f64>], right: &[f64]) -> SmallVec<[f64; MOST]> {
    let count = right.len();
    let mut x = SmallVec::<[f64; MOST]>::from_elem(0.0, count);
    let mut used = SmallVec::<[usize; MOST]>::new();
    // Each turn brings in what would lessen the error most; a few turns more than there are spectra, since some go out again.
    for _ in 0..3 * count {
        let slope = |i: usize| right[i] - (0..count).map(|j| products[i][j] * x[j]).sum::<f64>();
        let next = (0..count).filter(|i| !used.contains(i)).map(|i| (i, slope(i) / products[i][i].sqrt()));
        let Some((next, slope)) = next.max_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        if slope <= 1e-12 * right[next] / products[next][next].sqrt() {
            break;
        }
        used.push(next);
        loop {
            let Some(solved) = solve(products, right, &used) else {
                // The same as others, to rounding.
                used.pop();
                return x;
            };
            if solved.iter().all(|v| *v > 0.0) {
                used.iter().zip(&solved).for_each(|(&i, &v)| x[i] = v);
                break;
            }
            // As far towards it as all stay positive; what becomes 0 goes out.
            let reach = |(&i, &v): (&usize, &f64)| if v > 0.0 { 1.0 } else { x[i] / (x[i] - v) };
            let step = used.iter().zip(&solved).map(reach).fold(1.0, f64::min);
            used.iter().zip(&solved).for_each(|(&i, &v)| x[i] += step * (v - x[i]));
            let out: SmallVec<[usize; MOST]> = used
                .iter()
                .zip(&solved)
                .filter(|&(&i, &v)| v <= 0.0 && x[i] <= 1e-12 * (1.0 + v.abs()))
                .map(|(&i, _)| i)
                .collect();
            out.iter().for_each(|&i| x[i] = 0.0);
            used.retain(|i| !out.contains(i));
            if out.is_empty() || used.is_empty() {
                return x;
            }
        }
    }
    x
}

/// Solves for those of `used` by Cholesky's decomposition; `None` where they depend on each other.
fn solve(products: &[Vec<f64>], right: &[f64], used: &[usize]) -> Option<SmallVec<[f64; MOST]>> {
    let n = used.len();
    let mut lower = [[0.0; MOST]; MOST];
    let mut x = SmallVec::<[f64; MOST]>::new();
    for i in 0..n {
        for j in 0..=i {
            let rest = products[used[i]][used[j]] - (0..j).map(|k| lower[i][k] * lower[j][k]).sum::<f64>();
            if i != j {
                lower[i][j] = rest / lower[j][j];
            } else if rest > 1e-13 * products[used[i]][used[i]] {
                lower[i][i] = rest.sqrt();
            } else {
                return None;
            }
        }
        let rest = right[used[i]] - (0..i).map(|k| lower[i][k] * x[k]).sum::<f64>();
        x.push(rest / lower[i][i]);
    }
    for i in (0..n).rev() {
        let rest = x[i] - (i + 1..n).map(|k| lower[k][i] * x[k]).sum::<f64>();
        x[i] = rest / lower[i][i];
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    const BANDS: usize = 9;

    fn band(i: usize) -> f64 {
        i as f64 / (BANDS - 1) as f64
    }

    /// The radiance of a texel as its shares and what is left make it.
    fn made(clusters: &Clusters, texel: usize) -> Vec<f64> {
        let mut shares = vec![0.0; clusters.spectra.len()];
        let own = &clusters.shares[clusters.begin[texel] as usize..clusters.begin[texel + 1] as usize];
        own.iter().for_each(|(i, share)| shares[usize::from(*i)] = f64::from(*share));
        let mut sum = sum(&clusters.spectra, &shares);
        if let Some(left) = &clusters.left {
            sum.iter_mut().zip(&left[texel * BANDS..]).for_each(|(sum, left)| *sum += f64::from(*left));
        }
        sum
    }

    fn is_whole(clusters: &Clusters, radiance: &[f32]) {
        for (t, texel) in radiance.chunks_exact(BANDS).enumerate() {
            for (got, want) in made(clusters, t).into_iter().zip(texel) {
                assert!((got - f64::from(*want)).abs() <= 1.1e-5 * f64::from(*want), "{t}: {got} {want}");
            }
        }
    }

    /// Sums of three spectra, one of them pure somewhere: nothing is left. Black texels and bands are nobody's.
    #[test]
    fn sums_of_few_spectra_leave_nothing() {
        let spectrum = |k: usize, i: usize| match k {
            0 => 1.0 + band(i),
            1 => (-4.0 * band(i)).exp(),
            _ => 0.2 + (9.0 * band(i)).sin().powi(2),
        };
        let shares = |t: usize| match t {
            0..=2 => std::array::from_fn(|k| if k == t { 2.0 } else { 0.0 }),
            3 => [0.0; 3],
            t => [t % 5, t % 7, t % 3].map(|v| v as f64),
        };
        let value = |t: usize, i: usize| (0..3).map(|k| shares(t)[k] * spectrum(k, i)).sum::<f64>();
        let is_dark = |i: usize| i == 4;
        let radiance: Vec<f32> = (0..32 * BANDS)
            .map(|at| if is_dark(at % BANDS) { 0.0 } else { value(at / BANDS, at % BANDS) as f32 })
            .collect();
        let clusters = Clusters::of([8, 4], &radiance, BANDS);
        assert_eq!((clusters.spectra.len(), clusters.left.as_ref()), (3, None));
        is_whole(&clusters, &radiance);
    }

    /// Spectra that are no sums of sixteen: what is left is nowhere negative, and little; both parts are the whole.
    #[test]
    fn what_is_left_is_little_and_never_negative() {
        // A slope that changes from texel to texel, and a per cent of noise.
        let mut state = 1u32;
        let mut noise = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state) / f64::from(u32::MAX) - 0.5
        };
        let radiance: Vec<f32> = (0..512 * BANDS)
            .map(|at| ((-3.0 * (at / BANDS) as f64 / 512.0 * band(at % BANDS)).exp() * (1.0 + 0.02 * noise())) as f32)
            .collect();
        let clusters = Clusters::of([32, 16], &radiance, BANDS);
        let left = clusters.left.as_ref().expect("something is left of noise");
        assert!(left.iter().all(|v| *v >= 0.0));
        let share = left.iter().sum::<f32>() / radiance.iter().sum::<f32>();
        println!("{} spectra, {share} left", clusters.spectra.len());
        assert!(share < 0.02, "{share}");
        is_whole(&clusters, &radiance);
    }

    /// Between texels as the shader has it.
    #[test]
    fn places_between_texels_are_bilinear() {
        let radiance: Vec<f32> = [1.0, 0.0, 0.0, 1.0, 2.0, 2.0, 0.0, 3.0].to_vec();
        let clusters = Clusters::of([2, 2], &radiance, 2);
        assert_eq!((clusters.spectra.len(), clusters.left.as_ref()), (2, None));
        let value = |cell: [u32; 2], at: [u32; 2]| {
            let shares = clusters.at(cell[0] | cell[1] << 16, at[0] | at[1] << 16);
            let band = |i: usize| shares.iter().map(|(s, v)| v * clusters.spectra[usize::from(*s)][i]).sum::<f64>();
            [band(0), band(1)]
        };
        let near = |got: [f64; 2], want: [f64; 2]| assert!((got[0] - want[0]).abs() + (got[1] - want[1]).abs() < 1e-4);
        near(value([0, 1], [0, 0]), [1.0, 0.0]);
        near(value([0, 1], [65535, 0]), [0.0, 1.0]);
        near(value([0, 1], [32768, 32768]), [0.75, 1.5]);
        // Around, and held at the top.
        near(value([1, 0], [65535, 65535]), [1.0, 0.0]);
        near(value([1, 2], [0, 65535]), [0.0, 3.0]);
    }
}
