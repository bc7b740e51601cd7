//! Responses that weight the radiance while rendering (pre-integration): the device renders narrow *strata*
//! of wavelength, weighted, and the channels are sums of theirs.
//!
//! The union of the supports is cut where a response begins or ends, and each piece into equal strata that are narrow for
//! every response over it. A response has one inner channel for each of its strata: its value is the path's radiance at the
//! stratum's wavelength times R there. Strata that responses share are the same intervals, so all of them see the same
//! wavelengths of every path (Eq. 4 of Hoarau et al. 2018, a stratum at a time). The weight is a spectrum like others on the device,
//! with which the throughput of every path begins; sums are taken over the means of a unit, where nothing is lost by it.

use crate::spectral::{Channels, Curve, Outside};

/// Strata of a response at least, unless it is narrower than rounding allows.
const STRATA: f64 = 16.0;

/// How the channels of a scene with responses are made of those that the device renders.
#[derive(Debug, Clone, PartialEq)]
pub struct Integration {
    /// What the device renders.
    pub inner: Channels,
    /// Per inner channel: R / ∫R times the width of its stratum, zero outside.
    pub weights: Vec<Curve>,
    /// Per inner channel: the channel that it is a part of.
    part_of: Vec<usize>,
    /// The number of channels.
    channels: usize,
}

impl Integration {
    /// `None` for channels without responses.
    pub fn of(channels: &Channels) -> Option<Integration> {
        if channels.responses.is_empty() {
            return None;
        }
        let strata = strata(&channels.bounds);
        let (mut bounds, mut weights, mut part_of) = (Vec::new(), Vec::new(), Vec::new());
        for (k, response) in channels.responses.iter().enumerate() {
            let Curve::Linear { nm, value, .. } = response.curve() else { continue };
            for &[from, to] in &strata {
                if response.integral_over(from, to) <= 0.0 {
                    continue;
                }
                let scale = (to - from) / response.integral();
                bounds.push([from, to]);
                part_of.push(k);
                weights.push(Curve::Linear {
                    nm: nm.clone(),
                    value: value.iter().map(|v| v * scale).collect(),
                    outside: Outside::Zero,
                });
            }
        }
        let inner = Channels::from_bounds(bounds, None);
        Some(Integration { inner, weights, part_of, channels: channels.len() })
    }

    /// The channels of each pixel from its inner ones, [pixel][inner] to [pixel][channel].
    pub fn sums(&self, means: &[f32]) -> Vec<f32> {
        let mut sums = vec![0.0f64; self.channels];
        let pixels = means.chunks_exact(self.part_of.len());
        let mut out = Vec::with_capacity(pixels.len() * self.channels);
        for pixel in pixels {
            sums.fill(0.0);
            for (&k, &mean) in self.part_of.iter().zip(pixel) {
                sums[k] += f64::from(mean);
            }
            out.extend(sums.iter().map(|&sum| sum as f32));
        }
        out
    }
}

/// Disjoint intervals, ascending, over the union of `supports`: none reaches over an end of a support, and each is at most
/// a [`STRATA`]th of the narrowest support over it.
fn strata(supports: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut ends: Vec<f64> = supports.iter().flatten().copied().collect();
    ends.sort_by(f64::total_cmp);
    ends.dedup();
    let mut strata = Vec::new();
    for pair in ends.windows(2) {
        let [from, to] = [pair[0], pair[1]];
        let over = supports.iter().filter(|s| s[0] <= from && to <= s[1]).map(|s| s[1] - s[0]);
        let narrowest = over.fold(f64::INFINITY, f64::min);
        if narrowest == f64::INFINITY {
            continue;
        }
        let count = ((to - from) / narrowest * STRATA * (1.0 - 1e-9)).ceil().max(1.0) as usize;
        let edge = |i: usize| if i == count { to } else { from + (to - from) * (i as f64 / count as f64) };
        strata.extend((0..count).map(|i| [edge(i), edge(i + 1)]));
    }
    strata
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectral::Response;

    fn channels(responses: &[(&[f64], &[f64])]) -> Channels {
        let named = responses.iter().enumerate().map(|(i, (nm, value))| {
            (i.to_string(), Response::new(nm.to_vec(), value.to_vec()).expect("a response")) //
        });
        Channels::from_responses(named.collect(), None)
    }

    #[test]
    fn strata_cover_the_union_and_nothing_else() {
        let strata = strata(&[[400.0, 560.0], [480.0, 640.0], [8000.0, 12_000.0]]);
        let width: f64 = strata.iter().map(|[a, b]| b - a).sum();
        assert!((width - (240.0 + 4000.0)).abs() < 1e-9);
        assert!(strata.windows(2).all(|w| w[0][1] <= w[1][0]));
        // 16 a response, of which two share half: 24; and 16 of the thermal one.
        assert_eq!(strata.len(), 24 + 16);
        assert!([480.0, 560.0].iter().all(|end| strata.iter().any(|s| s[0] == *end)));
    }

    /// A path's radiance that is known at every wavelength, by the midpoint of many μ: ∫L R / ∫R.
    #[test]
    fn sums_are_means_weighted_by_responses() {
        let channels =
            channels(&[(&[400.0, 500.0, 560.0], &[0.0, 2.0, 0.0]), (&[480.0, 500.0, 640.0], &[1.0, 1.0, 0.5])]);
        let integration = Integration::of(&channels).expect("responses");
        assert_eq!(integration.inner.len(), 32);
        const N: usize = 400;
        let mut means = vec![0.0f64; integration.inner.len()];
        for (k, mean) in means.iter_mut().enumerate() {
            for i in 0..N {
                let nm = integration.inner.wavelength(k, (i as f64 + 0.5) / N as f64);
                *mean += (nm - 300.0) * integration.weights[k].eval(nm) / N as f64;
            }
        }
        let means: Vec<f32> = means.iter().map(|&v| v as f32).collect();
        // The mean of a linear radiance is its value at the centroid.
        let got = integration.sums(&[&means[..], &means[..]].concat());
        assert_eq!(got.len(), 4);
        for (k, got) in got.iter().enumerate() {
            let expected = channels.centre(k % 2) - 300.0;
            assert!((f64::from(*got) / expected - 1.0).abs() < 1e-5, "{got} {expected}");
        }
    }

    #[test]
    fn overlapping_responses_share_their_strata() {
        let channels = channels(&[(&[400.0, 720.0], &[1.0, 1.0]), (&[560.0, 720.0], &[1.0, 1.0])]);
        let integration = Integration::of(&channels).expect("responses");
        let of = |k: usize| {
            let mine = integration.part_of.iter().zip(&integration.inner.bounds).filter(|(part, _)| **part == k);
            mine.map(|(_, bounds)| *bounds).collect::<Vec<_>>()
        };
        let (wide, narrow) = (of(0), of(1));
        assert_eq!((wide.len(), narrow.len()), (8 + 16, 16));
        assert!(narrow.iter().all(|bounds| wide.contains(bounds)));
        assert_eq!(Integration::of(&Channels::equal(400.0, 700.0, 4)), None);
    }
}
