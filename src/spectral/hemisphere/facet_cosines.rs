//! How the microfacets that a direction sees are turned towards it: from that, whatever one scattering event by a rough
//! surface reflects or absorbs, for every Fresnel reflectance at once.

use std::sync::{Arc, LazyLock};

use glam::DVec3;
use quick_cache::sync::Cache;
use rayon::prelude::*;

use super::microfacet::{Lattice, azimuth_at, cosine_at, lambda, smith_ratio, turn};
use super::recent;

/// Cosines between direction and facet for which there is a weight, spread as cubes: metals change fastest near grazing.
pub const FACET_COSINES: usize = 256;
/// Cosines of directions: cubes, and a few where masking sets in.
const CUBES: usize = 256;
const MASKED: usize = 128;
/// Azimuths over a quarter turn where roughness differs along and across.
const AZIMUTHS: usize = 65;
/// Points and generator of the [`Lattice`], Fibonacci numbers: fewer than for albedos, since the weights are f32 and held to 1e-4.
const POINTS: (usize, usize) = (4_181, 2_584);

/// Weights w_j over direction such that Σ w_j f(c_j) is the mean over visible facets of f(o·h) G2/G1, f linear between
/// [`facet_cosine`]s: with f = F the single-scattering albedo, with f = 1 - F what is absorbed at once.
///
/// For metals of |n + i k| up to 100 and dielectrics the result is within 1e-4 (measured in tests).
pub struct FacetCosines {
    alpha: [f64; 2],
    /// Of directions, ascending from 0 to 1.
    cosines: Vec<f64>,
    /// \[azimuth\]\[direction\]\[facet\]; one azimuth if isotropic.
    weights: Vec<f32>,
}

/// The cosine that weight `j` is for.
pub fn facet_cosine(j: usize) -> f64 {
    (j as f64 / (FACET_COSINES - 1) as f64).powi(3)
}

impl FacetCosines {
    /// [`Self::new`], or what it has lately given for the same roughness. An anisotropic one takes 34 MiB.
    pub fn shared(alpha: [f64; 2]) -> Arc<Self> {
        static RECENT: LazyLock<Cache<[u64; 2], Arc<FacetCosines>>> = LazyLock::new(|| Cache::new(8));
        recent(&RECENT, alpha.map(f64::to_bits), || Self::new(alpha))
    }

    /// `alpha`: along x and along y, both above 0.
    pub fn new(alpha: [f64; 2]) -> Self {
        let rows = if alpha[0] == alpha[1] { 1 } else { AZIMUTHS };
        let mut cosines: Vec<f64> = (0..=CUBES).map(|i| (i as f64 / CUBES as f64).powi(3)).collect();
        cosines
            .extend(alpha[..rows.min(2)].iter().flat_map(|&alpha| (1..MASKED - 1).map(move |i| cosine_at(i, alpha))));
        cosines.sort_by(f64::total_cmp);
        cosines.dedup();
        let lattice = Lattice::new(POINTS);
        let of_node = |node: usize| {
            let (sin, cos) =
                if rows == 1 { (0.0, 1.0) } else { azimuth_at(node / cosines.len(), alpha, AZIMUTHS).sin_cos() };
            let z = cosines[node % cosines.len()];
            let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
            weights(alpha, DVec3::new(r * cos, r * sin, z), &lattice)
        };
        let weights = (0..rows * cosines.len()).into_par_iter().flat_map_iter(of_node).collect();
        FacetCosines { alpha, cosines, weights }
    }

    /// The weights w_j of a direction with z in [0, 1].
    pub fn weights(&self, direction: DVec3) -> Vec<f64> {
        let mut weights = vec![0.0; FACET_COSINES];
        for (row, share) in self.rows(direction) {
            let (above, place) = self.between(direction.z);
            for (node, share) in [(above - 1, share * (1.0 - place)), (above, share * place)] {
                let start = (row * self.cosines.len() + node) * FACET_COSINES;
                let of_node = &self.weights[start..start + FACET_COSINES];
                weights.iter_mut().zip(of_node).for_each(|(sum, weight)| *sum += share * f64::from(*weight));
            }
        }
        weights
    }

    /// Σ w_j `values`[j] for a direction with z in [0, 1].
    pub fn mean(&self, direction: DVec3, values: &[f64; FACET_COSINES]) -> f64 {
        let (above, place) = self.between(direction.z);
        let row = |row: usize| {
            let at = |node: usize| {
                let start = (row * self.cosines.len() + node) * FACET_COSINES;
                let weights = &self.weights[start..start + FACET_COSINES];
                weights.iter().zip(values).map(|(weight, value)| f64::from(*weight) * value).sum::<f64>()
            };
            let a = at(above - 1);
            a + place * (at(above) - a)
        };
        self.rows(direction).map(|(number, share)| share * row(number)).sum()
    }

    /// The cosine above `z`, by its number, and where z is between that and the one before.
    fn between(&self, z: f64) -> (usize, f64) {
        let above = self.cosines.partition_point(|&cosine| cosine <= z).clamp(1, self.cosines.len() - 1);
        let (low, high) = (self.cosines[above - 1], self.cosines[above]);
        (above, ((z - low) / (high - low)).clamp(0.0, 1.0))
    }

    /// The azimuths nearest to that of a direction, with their shares.
    fn rows(&self, direction: DVec3) -> impl Iterator<Item = (usize, f64)> {
        let (mut first, mut share) = (0, 0.0);
        if self.alpha[0] != self.alpha[1] && direction.x.hypot(direction.y) > 0.0 {
            let turn = turn(direction.y.abs().atan2(direction.x.abs()), self.alpha, AZIMUTHS);
            first = (turn as usize).min(AZIMUTHS - 2);
            share = turn - first as f64;
        }
        [(first, 1.0 - share), (first + 1, share)].into_iter().filter(|(_, share)| *share > 0.0)
    }
}

/// The weights of one direction.
fn weights(alpha: [f64; 2], o: DVec3, lattice: &Lattice) -> Vec<f32> {
    let lambda_o = lambda(alpha, o);
    let mut weights = vec![0.0f64; FACET_COSINES];
    lattice.each(alpha, o, |weight, h| {
        let cosine = o.dot(h).clamp(0.0, 1.0);
        let i = 2.0 * cosine * h - o;
        if i.z <= 0.0 {
            return;
        }
        let weight = weight * smith_ratio(lambda_o, lambda(alpha, i));
        let j = ((cosine.cbrt() * (FACET_COSINES - 1) as f64) as usize).min(FACET_COSINES - 2);
        let (low, high) = (facet_cosine(j), facet_cosine(j + 1));
        let place = ((cosine - low) / (high - low)).clamp(0.0, 1.0);
        weights[j] += weight * (1.0 - place);
        weights[j + 1] += weight * place;
    });
    weights.iter().map(|w| *w as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::super::ReflectionAlbedo;
    use super::super::fresnel::{conductor, dielectric};
    use super::super::microfacet::FINE;
    use super::*;

    /// Of two roughnesses, whose table takes long.
    const BRUSHED: [f64; 2] = [0.3, 0.1];

    fn direction(z: f64, azimuth: f64) -> DVec3 {
        let r = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(r * azimuth.cos(), r * azimuth.sin(), z)
    }

    /// The bound that the type states, against a finer lattice and F itself, away from all nodes.
    #[test]
    fn tables_are_accurate() {
        let fine = Lattice::new(FINE);
        let fresnel: [(&str, &dyn Fn(f64) -> f64); 5] = [
            ("gold", &|c| 1.0 - conductor(c, 0.2, 3.4)),
            ("tungsten", &|c| 1.0 - conductor(c, 3.5, 2.8)),
            ("aluminium at 10 um", &|c| 1.0 - conductor(c, 25.0, 90.0)),
            ("soot", &|c| 1.0 - conductor(c, 1.5, 0.4)),
            ("coat", &|c| dielectric(c, 1.5)),
        ];
        let mut largest = 0.0f64;
        for alpha in [[0.01; 2], [0.1; 2], [0.4; 2], [1.0; 2], BRUSHED] {
            let table = FacetCosines::shared(alpha);
            for (name, f) in &fresnel {
                let values = std::array::from_fn(|j| f(facet_cosine(j)));
                for (turn, z) in [0.0013, 0.0123, 0.052, 0.21, 0.43, 0.77, 0.993].into_iter().enumerate() {
                    let o = direction(z, 0.3 * turn as f64);
                    let lambda_o = lambda(alpha, o);
                    let mut want = 0.0;
                    fine.each(alpha, o, |weight, h| {
                        let i = 2.0 * o.dot(h) * h - o;
                        if i.z > 0.0 {
                            want += weight * f(o.dot(h)) * smith_ratio(lambda_o, lambda(alpha, i));
                        }
                    });
                    let error = table.mean(o, &values) - want;
                    largest = largest.max(error.abs());
                    assert!(error.abs() < 1e-4, "{name}, α {alpha:?}, z {z}: {error}");
                }
            }
        }
        println!("largest error {largest:e}");
    }

    /// With f = 1, what [`ReflectionAlbedo`] has.
    #[test]
    fn of_a_white_surface_it_is_the_albedo() {
        for alpha in [[0.2; 2], BRUSHED] {
            let (table, albedo) = (FacetCosines::shared(alpha), ReflectionAlbedo::new(alpha));
            for z in [0.05, 0.3, 0.8, 1.0] {
                let o = direction(z, 0.7);
                let difference = table.mean(o, &[1.0; FACET_COSINES]) + albedo.loss(o) - 1.0;
                assert!(difference.abs() < 2e-4, "{alpha:?}, {z}: {difference}");
            }
        }
    }
}
