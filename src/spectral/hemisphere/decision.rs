//! Probabilities of decisions, common to all channels (docs/METHOD.md, Decisions).

use super::fresnel;
use crate::spectral::{Channels, Curve};

/// The probability of reflection, not refraction, at a smooth boundary between dielectrics, over the cosine on either
/// side: q = ½ mean over channels of F_k + ½ max F_k / (max F_k + max (1 - F_k)), of F itself and not of F at a mean
/// index. Refraction has a positive probability wherever any channel is not totally reflected.
pub struct ReflectionProbability {
    /// \[before, behind\] at equally spaced cosines from 0 to 1.
    sides: [Vec<f64>; 2],
}

/// Intervals of the table. Near the critical angle a linear table is coarse, which costs noise, not truth.
const INTERVALS: usize = 256;

impl ReflectionProbability {
    /// `eta`: index behind over index before, in `channels` (at least one).
    pub fn new(eta: &Curve, channels: &Channels) -> Self {
        // A channel is seen at three wavelengths; the extremes belong to whatever lies between these.
        let mut indices: Vec<f64> =
            channels.bounds.iter().flat_map(|&[a, b]| [a, 0.5 * (a + b), b].map(|nm| eta.eval(nm))).collect();
        let among_channels = indices.len();
        indices.extend(index_range(eta, channels));
        let side = |behind: bool| {
            let probability = |i: usize| {
                let cosine = i as f64 / INTERVALS as f64;
                let of = |eta: &f64| fresnel::dielectric(cosine, if behind { eta.recip() } else { *eta });
                let mean = indices[..among_channels].iter().map(of).sum::<f64>() / among_channels as f64;
                let most = indices.iter().map(of).fold(0.0, f64::max);
                let least = indices.iter().map(of).fold(1.0, f64::min);
                0.5 * mean + 0.5 * most / (most + 1.0 - least)
            };
            (0..=INTERVALS).map(probability).collect()
        };
        ReflectionProbability { sides: [side(false), side(true)] }
    }

    /// For an observer `behind` the boundary or before it, at `cosine` in [0, 1].
    pub fn at(&self, behind: bool, cosine: f64) -> f64 {
        let nodes = &self.sides[usize::from(behind)];
        let x = cosine * INTERVALS as f64;
        let i = (x as usize).min(INTERVALS - 1);
        nodes[i] + (x - i as f64) * (nodes[i + 1] - nodes[i])
    }
}

/// The least and the greatest value of a piecewise linear curve in any channel.
pub fn index_range(curve: &Curve, channels: &Channels) -> [f64; 2] {
    let nodes = channels.bounds.iter().flat_map(|b| curve.linear_pieces(b[0], b[1]).unwrap_or_default());
    nodes.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], (_, value)| [low.min(value), high.max(value)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectral::Outside;

    fn glass() -> Curve {
        Curve::Linear { nm: vec![400.0, 550.0, 700.0], value: vec![1.6, 1.5, 1.7], outside: Outside::Hold }
    }

    #[test]
    fn ranges_see_the_middle_of_a_channel() {
        assert_eq!(index_range(&glass(), &Channels::equal(500.0, 600.0, 1)), [1.5, 1.5 + 0.2 / 3.0]);
        assert_eq!(index_range(&Curve::Constant(1.5), &Channels::equal(500.0, 600.0, 3)), [1.5, 1.5]);
    }

    /// One index: exactly F at the nodes. The interpolation error is the table's own.
    #[test]
    fn of_one_index_it_is_the_reflectance() {
        let table = ReflectionProbability::new(&Curve::Constant(1.5), &Channels::equal(400.0, 700.0, 5));
        for i in 0..=256 {
            let c = f64::from(i) / 256.0;
            assert!((table.at(false, c) - fresnel::dielectric(c, 1.5)).abs() < 1e-14);
            assert!((table.at(true, c) - fresnel::dielectric(c, 1.0 / 1.5)).abs() < 1e-14);
        }
    }

    /// Channels of two indices at 60 degrees, by hand: ½ mean + ½ of the normalised largest; and wherever a wavelength
    /// within some channel can be refracted, refraction may be chosen.
    #[test]
    fn of_several_it_follows_design_section_6() {
        let steps = Curve::Linear {
            nm: vec![400.0, 500.0, 500.0, 600.0],
            value: vec![1.5, 1.5, 2.0, 2.0],
            outside: Outside::Hold,
        };
        let channels = Channels::from_bounds(vec![[400.0, 499.0], [501.0, 600.0]], None);
        let table = ReflectionProbability::new(&steps, &channels);
        let (a, b) = (fresnel::dielectric(0.5, 1.5), fresnel::dielectric(0.5, 2.0));
        let want = 0.25 * (a + b) + 0.5 * b / (b + 1.0 - a);
        assert!((table.at(false, 0.5) - want).abs() < 1e-14, "{} {want}", table.at(false, 0.5));

        let channels = Channels::from_bounds(vec![[400.0, 700.0]], None);
        let table = ReflectionProbability::new(&glass(), &channels);
        let refracted = |nm: f64, c: f64| 1.0 - fresnel::dielectric(c, 1.0 / glass().eval(nm));
        for i in 0..10_000 {
            let (c, nm) = (f64::from(i) * 1e-4, 400.0 + 300.0 * f64::from(i * 37 % 1000) * 1e-3);
            let q = table.at(true, c);
            assert!((0.0..=1.0).contains(&q));
            assert!(q < 1.0 || refracted(nm, c) == 0.0, "{c} at {nm} nm");
        }
    }
}
