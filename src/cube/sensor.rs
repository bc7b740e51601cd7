//! Sensors after the fact: the channels of a cube integrated with response curves.

use std::path::Path;

use serde_json::json;

use super::create::{Aside, Existing};
use super::metadata::Header;
use super::store::Cube;
use super::writer::Writer;
use crate::spectral::colour::RunningIntegral;
use crate::spectral::{Channels, Response};
use crate::{Error, Result};

/// Of what a response sees, the channels must cover this much; a band of which they do not is left out.
const COVERED: f64 = 0.99;
/// Channels are said to be too wide for a response where that makes an error of more than this.
const TOLERABLE: f64 = 1e-3;
/// Tiles merged between commits.
const TOGETHER: u32 = 64;

/// What an integration found worth saying.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Findings {
    /// Bands that the cube does not cover, and how much of each it does.
    pub left_out: Vec<(String, f64)>,
    /// Bands for which the channels are wide: the error, relative to the band's radiance, root mean square over pixels, that
    /// comes from the radiance's slope within channels. `None`: it cannot be told, since there are no neighbours to see one.
    pub wide: Vec<(String, Option<f64>)>,
}

/// How one band is made of channels.
struct Band {
    name: String,
    response: Response,
    /// (channel, share of ∫R); the shares of all add up to 1.
    weights: Vec<(usize, f64)>,
    /// First-order error: this is multiplied with radiance and added up: (channel, ∫R (λ - centre) dλ x slope).
    slopes: Vec<(usize, f64)>,
    /// Whether a channel in which the response varies has no neighbour that would show a slope.
    is_blind: bool,
}

/// Per band, ∫ R/n over each channel over ∫R, with n(λ) the number of channels that cover λ: exact for radiance that is
/// constant in each channel. Responses that are not covered are told apart.
fn bands(channels: &Channels, named: &[(String, Response)], findings: &mut Findings) -> Vec<Band> {
    let neighbours = Neighbours::new(channels);
    let mut bands = Vec::new();
    for (name, response) in named {
        let running = RunningIntegral::new(channels, std::array::from_ref(response.curve()));
        let of = |k: usize| running.at(channels.bounds[k][1])[0] - running.at(channels.bounds[k][0])[0];
        let inside: Vec<(usize, f64)> = (0..channels.len()).map(|k| (k, of(k))).filter(|(_, w)| *w > 0.0).collect();
        // The sum of nothing is -0.
        let covered: f64 = inside.iter().map(|(_, weight)| weight).sum::<f64>() + 0.0;
        let share = covered / response.integral();
        if share < COVERED {
            findings.left_out.push((name.clone(), share));
            continue;
        }
        let weights: Vec<_> = inside.iter().map(|&(k, weight)| (k, weight / covered)).collect();
        let (mut slopes, mut is_blind) = (Vec::new(), false);
        for &(k, weight) in &weights {
            // Where the response is one and the same all over the channel, a slope cancels.
            let moment = first_moment(response, channels.bounds[k]) / covered;
            if moment.abs() <= 1e-9 * weight * channels.width(k) {
                continue;
            }
            match neighbours.of(k) {
                (Some(below), Some(above)) => {
                    let distance = channels.centre(above) - channels.centre(below);
                    slopes.extend([(above, moment / distance), (below, -moment / distance)]);
                }
                (Some(other), None) | (None, Some(other)) => {
                    let distance = channels.centre(other) - channels.centre(k);
                    slopes.extend([(other, moment / distance), (k, -moment / distance)]);
                }
                (None, None) => is_blind |= moment.abs() > TOLERABLE * weight * channels.width(k),
            }
        }
        bands.push(Band { name: name.clone(), response: response.clone(), weights, slopes, is_blind });
    }
    bands
}

/// ∫ R (λ - centre) dλ over an interval.
fn first_moment(response: &Response, [from, to]: [f64; 2]) -> f64 {
    let centre = 0.5 * (from + to);
    let pieces = response.curve().linear_pieces(from, to).unwrap_or_default();
    let piece = |w: &[(f64, f64)]| {
        let ((a, p), (b, q)) = (w[0], w[1]);
        (b - a) * (0.5 * (a - centre) * (p + q) + (b - a) * (p + 2.0 * q) / 6.0)
    };
    pieces.windows(2).map(piece).sum()
}

/// Channels that begin where another ends.
struct Neighbours {
    /// Channels by their lower and by their upper bound.
    by_lower: Vec<(f64, usize)>,
    by_upper: Vec<(f64, usize)>,
    bounds: Vec<[f64; 2]>,
}

impl Neighbours {
    fn new(channels: &Channels) -> Self {
        let sorted = |end: usize| {
            let mut list: Vec<_> = channels.bounds.iter().enumerate().map(|(k, bounds)| (bounds[end], k)).collect();
            list.sort_by(|a, b| a.0.total_cmp(&b.0));
            list
        };
        Neighbours { by_lower: sorted(0), by_upper: sorted(1), bounds: channels.bounds.clone() }
    }

    /// The channels below and above `k`.
    fn of(&self, k: usize) -> (Option<usize>, Option<usize>) {
        let find = |list: &[(f64, usize)], nm: f64| {
            let tolerance = 1e-9 * nm;
            let at = list.partition_point(|(end, _)| *end < nm - tolerance);
            list[at..]
                .iter()
                .take_while(|(end, _)| *end <= nm + tolerance)
                .map(|(_, other)| *other)
                .find(|&other| other != k)
        };
        let [from, to] = self.bounds[k];
        (find(&self.by_upper, from), find(&self.by_lower, to))
    }
}

/// Makes at `path` a cube whose channels are the `named` responses, from the channels of `cube`. A tile at a time is in memory.
/// `progress` is called with the tiles done, of all; an error of it ends the work, and nothing is left or replaced.
pub fn integrate(
    cube: &Cube,
    named: &[(String, Response)],
    about: &str,
    path: &Path,
    existing: Existing,
    progress: &mut dyn FnMut(u64, u64) -> Result<()>,
) -> Result<Findings> {
    let channels = cube.channels();
    if !channels.responses.is_empty() {
        let what = "its channels are weighted by responses already; sensors need plain channels";
        return Err(Error::Usage(format!("{}: {what}", cube.path().display())));
    }
    let mut findings = Findings::default();
    let bands = bands(channels, named, &mut findings);
    if bands.is_empty() {
        let most = findings.left_out.iter().map(|(_, share)| *share).fold(0.0, f64::max);
        return Err(Error::Usage(format!(
            "{}: its channels cover no band of {about}: {:.1} % of the response at most, and {:.0} % are needed",
            cube.path().display(),
            100.0 * most,
            100.0 * COVERED
        )));
    }
    let of_bands = bands.iter().map(|band| (band.name.clone(), band.response.clone())).collect();
    let mut attributes = cube.header().attributes.clone();
    // The errors of channels that one path made belong together: those of their sums are not known.
    attributes.remove(super::metadata::UNCERTAINTY);
    attributes.remove(super::metadata::FACTORED);
    attributes
        .insert(super::metadata::DERIVED.into(), json!({ "sensor": about, "channels_integrated": channels.len() }));
    let header = Header { channels: Channels::from_responses(of_bands, None), attributes, ..cube.header().clone() };
    let grid = cube.grid();
    let count = grid.count();
    let aside = Aside::new(path, &header, existing)?;
    let writer = Writer::open(aside.path(), &header, Existing::Refuse, 0..count, &mut |_| {});
    let writer = writer.map_err(|error| aside.error(error))?;
    // Σ over pixels of error² and of value².
    let mut squares = vec![[0.0f64; 2]; bands.len()];
    let mut unit = vec![0.0f32; grid.tile_pixels() * bands.len()];
    for tile in 0..count {
        let samples = cube.samples(tile)?;
        if let (Some(chunk), 1..) = (cube.chunk(tile)?, samples) {
            let rect = chunk.rect();
            for (y, x) in (rect.y0..rect.y1).flat_map(|y| (rect.x0..rect.x1).map(move |x| (y, x))) {
                let spectrum = chunk.spectrum(x, y);
                let sum = |weights: &[(usize, f64)]| -> f64 {
                    weights.iter().map(|&(k, weight)| weight * f64::from(spectrum[k])).sum()
                };
                let pixel = grid.pixel_in_tile(x, y);
                for (b, band) in bands.iter().enumerate() {
                    let (value, error) = (sum(&band.weights), sum(&band.slopes));
                    if !value.is_finite() {
                        let what = format!(
                            "holds a value that is not finite in a channel of pixel {x}, {y}: somebody has changed it"
                        );
                        return Err(Error::storage(
                            cube.path(),
                            format!("{what}; `spectile info --verify` says which tile"),
                        ));
                    }
                    unit[pixel * bands.len() + b] = value as f32;
                    squares[b][0] += error * error;
                    squares[b][1] += value * value;
                }
            }
            if let Some(layers) = cube.tile_layers(tile)? {
                writer.lay(tile, layers);
            }
            writer.store(tile, samples, &unit).map_err(|error| aside.error(error))?;
        }
        if tile % TOGETHER == TOGETHER - 1 {
            writer.flush().map_err(|error| aside.error(error))?;
        }
        progress(u64::from(tile) + 1, count.into())?;
    }
    writer.flush().map_err(|error| aside.error(error))?;
    drop(writer);
    aside.put()?;
    for (band, [error, value]) in bands.iter().zip(squares) {
        let relative = if value > 0.0 { (error / value).sqrt() } else { 0.0 };
        if band.is_blind {
            findings.wide.push((band.name.clone(), None));
        } else if relative > TOLERABLE {
            findings.wide.push((band.name.clone(), Some(relative)));
        }
    }
    Ok(findings)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn response(nm: &[f64], value: &[f64]) -> Response {
        Response::new(nm.to_vec(), value.to_vec()).expect("a response")
    }

    #[test]
    fn partial_overlaps_weigh_what_they_see() {
        // A triangle from 405 to 425 over channels of 10 nm.
        let channels = Channels::equal(400.0, 430.0, 3);
        let triangle = ("t".to_owned(), response(&[405.0, 415.0, 425.0], &[0.0, 1.0, 0.0]));
        let mut findings = Findings::default();
        let bands = bands(&channels, &[triangle], &mut findings);
        let weights = &bands[0].weights;
        // ∫ = 10; 405-410: 5·0.25 = 1.25; 410-420: 10 - 2·1.25; 420-425: 1.25.
        for ((k, got), expected) in weights.iter().zip([0.125, 0.75, 0.125]) {
            assert!((got - expected).abs() < 1e-12, "channel {k}: {got}");
        }
        assert_eq!(findings, Findings::default());
        // The slopes of the outer channels cancel, and the middle one has none.
        assert!(bands[0].slopes.iter().map(|s| s.1).sum::<f64>().abs() < 1e-15);
    }

    #[test]
    fn overlapping_channels_share_and_gaps_leave_out() {
        let twice = Channels::from_bounds(vec![[400.0, 420.0], [400.0, 410.0], [410.0, 420.0]], None);
        let flat = ("f".to_owned(), response(&[400.0, 420.0], &[1.0, 1.0]));
        let mut findings = Findings::default();
        let of = |channels: &Channels, findings: &mut Findings| {
            let bands = bands(channels, std::slice::from_ref(&flat), findings);
            bands.first().map(|band| band.weights.clone())
        };
        assert_eq!(of(&twice, &mut findings), Some(vec![(0, 0.5), (1, 0.25), (2, 0.25)]));
        let gap = Channels::from_bounds(vec![[400.0, 409.0], [410.0, 420.0]], None);
        assert_eq!(of(&gap, &mut findings), None);
        assert_eq!(findings.left_out, [("f".to_owned(), 0.95)]);
        let hair = Channels::from_bounds(vec![[400.0, 409.9], [410.0, 420.0]], None);
        let weights = of(&hair, &mut findings).expect("covered");
        assert!((weights.iter().map(|w| w.1).sum::<f64>() - 1.0).abs() < 1e-12);
    }
}
