//! Responses that weight the radiance while rendering (pre-integration): the device renders narrow *strata*
//! of wavelength, weighted, and the channels are sums of theirs.
//!
//! The union of the supports is cut where a response jumps, and into equal strata that are narrow for every response over them:
//! equal, since a response that begins and ends at zero then has nearly the same sum wherever in them the wavelengths lie (the
//! rectangle rule of smooth periodic functions). A response has one inner channel for each of its strata: its value is the path's
//! radiance at the stratum's wavelength times R there. Strata that responses share are the same intervals, so all of them see the
//! same wavelengths of every path (Eq. 4 of Hoarau et al. 2018, a stratum at a time). The weight is a spectrum like others on the
//! device, with which the throughput of every path begins; sums are taken over the means of a unit, where nothing is lost by it.

use crate::spectral::{Channels, Curve, Outside, Response};

/// Strata of a response at least. More are for responses that need them; spectra that do may have several wavelengths in each
/// (`wavelengths_per_channel`).
const LEAST_STRATA: u32 = 4;
/// What they are doubled to at most, for responses with jumps and peaks.
const MOST_STRATA: u32 = 64;
/// Standard deviation of a path, relative, that a response may add to a spectrum that is the same everywhere.
const DEVIATION: f64 = 0.05;
/// Where a response has no more of its peak than this, cutting there would save nothing.
const JUMP: f64 = 0.01;
/// Neighbouring intervals whose strata may differ by this are cut alike.
const ALIKE: f64 = 2.0;

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
        let strata = strata_of(&channels.responses);
        let (mut bounds, mut weights, mut part_of) = (Vec::new(), Vec::new(), Vec::new());
        for (k, response) in channels.responses.iter().enumerate() {
            let Curve::Linear { nm, value, .. } = response.curve() else { continue };
            for &[from, to] in within(&strata, response) {
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

/// Disjoint intervals, ascending, over all supports: as few as leave every response its [`DEVIATION`].
fn strata_of(responses: &[Response]) -> Vec<[f64; 2]> {
    let mut counts = vec![LEAST_STRATA; responses.len()];
    loop {
        let strata = strata(responses, &counts);
        let mut done = true;
        for (count, response) in counts.iter_mut().zip(responses) {
            if *count < MOST_STRATA && deviation(response, within(&strata, response)) > DEVIATION {
                *count *= 2;
                done = false;
            }
        }
        if done {
            return strata;
        }
    }
}

/// Those of `strata` that overlap the support of `response`.
fn within<'a>(strata: &'a [[f64; 2]], response: &Response) -> &'a [[f64; 2]] {
    let [from, to] = response.support();
    &strata[strata.partition_point(|s| s[1] <= from)..strata.partition_point(|s| s[0] < to)]
}

/// Standard deviation over μ of what a path has of a flat spectrum, over its mean.
fn deviation(response: &Response, strata: &[[f64; 2]]) -> f64 {
    const PLACES: u32 = 32;
    let sum = |i: u32| {
        let mu = (f64::from(i) + 0.5) / f64::from(PLACES);
        strata.iter().map(|[from, to]| (to - from) * response.curve().eval(from + (to - from) * mu)).sum::<f64>()
    };
    let squares = (0..PLACES).map(|i| (sum(i) / response.integral() - 1.0).powi(2)).sum::<f64>();
    (squares / f64::from(PLACES)).sqrt()
}

/// Equal strata of each run of wavelengths: runs end where a response jumps, or where strata of very different width are wanted. None
/// is wider than the support of any response over it by that one's count.
fn strata(responses: &[Response], counts: &[u32]) -> Vec<[f64; 2]> {
    let jumps: Vec<f64> = responses.iter().flat_map(jumps).collect();
    let mut ends: Vec<f64> = responses.iter().flat_map(Response::support).chain(jumps.iter().copied()).collect();
    ends.sort_by(f64::total_cmp);
    ends.dedup();
    // From, to, the narrowest and the widest stratum that its parts ask for.
    let mut runs: Vec<([f64; 2], [f64; 2])> = Vec::new();
    for pair in ends.windows(2) {
        let [from, to] = [pair[0], pair[1]];
        let over = responses.iter().zip(counts).filter(|(r, _)| r.support()[0] <= from && to <= r.support()[1]);
        let width =
            over.map(|(r, &count)| (r.support()[1] - r.support()[0]) / f64::from(count)).fold(f64::INFINITY, f64::min);
        if width == f64::INFINITY {
            continue;
        }
        let jumps_here = jumps.contains(&from);
        match runs.last_mut() {
            Some(([_, end], [least, most]))
                if *end == from && !jumps_here && most.max(width) <= ALIKE * least.min(width) =>
            {
                (*end, *least, *most) = (to, least.min(width), most.max(width));
            }
            _ => runs.push(([from, to], [width, width])),
        }
    }
    let mut strata = Vec::new();
    for ([from, to], [width, _]) in runs {
        let count = ((to - from) / width * (1.0 - 1e-9)).ceil().max(1.0) as usize;
        let edge = |i: usize| if i == count { to } else { from + (to - from) * (i as f64 / count as f64) };
        strata.extend((0..count).map(|i| [edge(i), edge(i + 1)]));
    }
    strata
}

/// Wavelengths at which `response` jumps: between two nodes at one, and where it begins or ends with something.
fn jumps(response: &Response) -> Vec<f64> {
    let Curve::Linear { nm, value, .. } = response.curve() else { return Vec::new() };
    let [from, to] = response.support();
    let least = JUMP * value.iter().copied().fold(0.0, f64::max);
    let before = |x: f64| nm.partition_point(|&node| node < x);
    let after = |x: f64| nm.partition_point(|&node| node <= x);
    // What it comes from, and what it goes on with: nothing outside of its support.
    let jumps = |x: f64| {
        let left = if x <= from { 0.0 } else { value[before(x).min(value.len() - 1)] };
        let right = if x >= to { 0.0 } else { value[after(x).saturating_sub(1)] };
        (left - right).abs() > least
    };
    let mut found: Vec<f64> = nm.windows(2).filter(|pair| pair[0] == pair[1]).map(|pair| pair[0]).collect();
    found.extend([from, to]);
    found.retain(|&x| jumps(x));
    found
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

    fn response(nodes: &[(f64, f64)]) -> Response {
        let (nm, value) = nodes.iter().copied().unzip();
        Response::new(nm, value).expect("a response")
    }

    #[test]
    fn strata_cover_the_union_and_nothing_else() {
        let triangle = |from: f64| response(&[(from, 0.0), (from + 80.0, 1.0), (from + 160.0, 0.0)]);
        let responses = [triangle(400.0), triangle(480.0), response(&[(8000.0, 1.0), (12_000.0, 1.0)])];
        let strata = strata_of(&responses);
        let width: f64 = strata.iter().map(|[a, b]| b - a).sum();
        assert!((width - (240.0 + 4000.0)).abs() < 1e-9);
        assert!(strata.windows(2).all(|w| w[0][1] <= w[1][0]));
        // Four a response, of which two share half.
        assert_eq!(strata.len(), 6 + 4);
        for response in &responses {
            assert!(deviation(response, within(&strata, response)) < 1e-12);
        }
    }

    #[test]
    fn every_response_has_the_strata_that_it_needs() {
        let bell = |centre: f64, fwhm: f64| {
            let nodes: Vec<(f64, f64)> = (-75..=75)
                .map(|i| 0.02 * f64::from(i) * fwhm)
                .map(|x| (centre + x, (-4.0 * 2f64.ln() * (x / fwhm).powi(2)).exp()))
                .collect();
            response(&nodes)
        };
        // An imaging spectrometer.
        let bands: Vec<Response> = (0..200).map(|k| bell(400.0 + 8.0 * f64::from(k), 10.0)).collect();
        let strata = strata_of(&bands);
        let of = |k: usize| within(&strata, &bands[k]).len();
        assert!((0..200).all(|k| (4..=6).contains(&of(k))), "{} to {}", of(0), of(100));
        // A line beside a foot, a saw, a slit with steps within its table, one band within another.
        let odd = [
            response(&[(400.0, 0.0), (500.0, 0.05), (505.0, 1.0), (510.0, 0.05), (800.0, 0.0)]),
            response(&[(900.0, 0.0), (1000.0, 1.0)]),
            response(&[(1100.0, 0.0), (1110.0, 0.0), (1110.0, 1.0), (1147.0, 1.0), (1147.0, 0.0), (1200.0, 0.0)]),
            response(&[(1300.0, 0.0), (1800.0, 1.0), (2300.0, 0.0)]),
            bell(1700.0, 10.0),
        ];
        assert!(bands.iter().all(|band| deviation(band, within(&strata, band)) <= DEVIATION));
        let strata = strata_of(&odd);
        for (response, at_most) in odd.iter().zip([64, 16, 4, 12, 6]) {
            let mine = within(&strata, response);
            assert!(deviation(response, mine) <= DEVIATION && mine.len() <= at_most, "{response:?}: {}", mine.len());
        }
    }

    /// A path's radiance that is known at every wavelength, by the midpoint of many μ: ∫L R / ∫R.
    #[test]
    fn sums_are_means_weighted_by_responses() {
        let channels =
            channels(&[(&[400.0, 500.0, 560.0], &[0.0, 2.0, 0.0]), (&[480.0, 500.0, 640.0], &[1.0, 1.0, 0.5])]);
        let integration = Integration::of(&channels).expect("responses");
        assert!((8..32).contains(&integration.inner.len()));
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
        assert_eq!((wide.len(), narrow.len()), (2 + 4, 4));
        assert!(narrow.iter().all(|bounds| wide.contains(bounds)));
        assert_eq!(Integration::of(&Channels::equal(400.0, 700.0, 4)), None);
    }
}
