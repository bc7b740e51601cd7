//! How one cube differs from another that serves as reference.

use super::grid::Rect;
use super::map::Chunk;
use super::store::Cube;
use crate::{Error, Result};

/// Two cubes against each other, over the pixels that are rendered in both.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    pub channels: Vec<ChannelMetrics>,
    /// Pixels compared.
    pub pixels: u64,
    /// Pixels of the picture.
    pub pixels_in_all: u64,
}

/// What is told of one channel, x against ref (docs/METHOD.md, Errors); means over pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelMetrics {
    /// mean of x, W m⁻² sr⁻¹ nm⁻¹.
    pub mean: f64,
    /// mean of ref, W m⁻² sr⁻¹ nm⁻¹.
    pub reference_mean: f64,
    /// mean of x - ref, W m⁻² sr⁻¹ nm⁻¹.
    pub bias: f64,
    /// sqrt of the mean of (x - ref)², W m⁻² sr⁻¹ nm⁻¹.
    pub rmse: f64,
    /// mean of (x - ref)² / (ref² + ε), ε = (0.01 · mean of ref)². Equal values differ by 0, also where ref and ε are 0;
    /// others are infinitely far apart there.
    pub rel_mse: f64,
    /// Where a cube has standard errors (one without counts as exact): whether they explain the difference.
    pub z: Option<ZTest>,
}

/// The differences of a channel in units of their standard errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZTest {
    /// Of the mean over pixels: Σ (x - ref) / sqrt(Σ s²). Within ±2 in 95 % of all cases if nothing but noise differs.
    pub mean: f64,
    /// Root mean square over pixels of (x - ref)/s; 1 if nothing but noise differs and there are many epochs.
    pub rms: f64,
    /// Pixels with a standard error above 0, or different without one.
    pub pixels: u64,
}

/// Sums over pixels for the z-test of a channel.
#[derive(Debug, Clone, Copy, Default)]
struct ZSums {
    difference: f64,
    variance: f64,
    square: f64,
    pixels: u64,
}

impl ZSums {
    fn add(&mut self, difference: f64, variance: f64) {
        // Equal and exact, or an error that is not known.
        if variance.is_nan() || (variance == 0.0 && difference == 0.0) {
            return;
        }
        self.difference += difference;
        self.variance += variance;
        self.square += difference * difference / variance;
        self.pixels += 1;
    }

    fn test(&self) -> Option<ZTest> {
        let Self { difference, variance, square, pixels } = *self;
        let rms = (square / pixels as f64).sqrt();
        (pixels > 0).then(|| ZTest { mean: difference / variance.sqrt(), rms, pixels })
    }
}

impl Comparison {
    /// The channel with the largest relMSE, and that; NaN is larger than any number.
    pub fn worst(&self) -> (usize, f64) {
        // `total_cmp` puts a positive NaN above infinity.
        let of = |k: usize| if self.channels[k].rel_mse.is_nan() { f64::NAN.abs() } else { self.channels[k].rel_mse };
        let worst = (0..self.channels.len()).rev().max_by(|&a, &b| of(a).total_cmp(&of(b))).unwrap_or(0);
        (worst, of(worst))
    }
}

/// Compares `cube` with `reference`. Their sizes and channels must agree, their tiles need not.
pub fn compare(cube: &Cube, reference: &Cube) -> Result<Comparison> {
    check_comparable(cube, reference)?;
    let channels = cube.channels().len();
    let mut pixels = 0u64;
    let (mut sums, mut reference_sums) = (vec![0.0; channels], vec![0.0; channels]);
    visit(cube, reference, |x, reference| {
        pixels += 1;
        for k in 0..channels {
            sums[k] += f64::from(x[k]);
            reference_sums[k] += f64::from(reference[k]);
        }
    })?;
    if pixels == 0 {
        let (a, b) = (cube.path().display(), reference.path().display());
        return Err(Error::Usage(format!("{a} and {b} have no rendered pixel in common")));
    }

    // The reference's mean is part of relMSE, hence a second pass. Sums of differences of means would cancel.
    let mean = |sum: f64| sum / pixels as f64;
    let epsilon: Vec<f64> = reference_sums.iter().map(|&sum| (0.01 * mean(sum)).powi(2)).collect();
    // Counted anew: a cube that is being rendered may have grown meanwhile.
    let mut compared = 0u64;
    let (mut bias, mut square, mut relative) = (vec![0.0; channels], vec![0.0; channels], vec![0.0; channels]);
    visit(cube, reference, |x, reference| {
        compared += 1;
        for k in 0..channels {
            let reference = f64::from(reference[k]);
            let difference = f64::from(x[k]) - reference;
            let distance = difference * difference;
            bias[k] += difference;
            square[k] += distance;
            if distance != 0.0 {
                relative[k] += distance / (reference * reference + epsilon[k]);
            }
        }
    })?;
    let z = z_sums(cube, reference)?;
    let n = compared as f64;
    let metrics = |k: usize| ChannelMetrics {
        mean: mean(sums[k]),
        reference_mean: mean(reference_sums[k]),
        bias: bias[k] / n,
        rmse: (square[k] / n).sqrt(),
        rel_mse: relative[k] / n,
        z: z.as_ref().and_then(|z| z[k].test()),
    };
    let [width, height] = cube.header().size.map(u64::from);
    Ok(Comparison { channels: (0..channels).map(metrics).collect(), pixels: compared, pixels_in_all: width * height })
}

/// Per channel; `None` where neither cube has standard errors.
fn z_sums(a: &Cube, b: &Cube) -> Result<Option<Vec<ZSums>>> {
    if !a.header().has_uncertainty() && !b.header().has_uncertainty() {
        return Ok(None);
    }
    let mut sums = vec![ZSums::default(); a.channels().len()];
    for tile in 0..a.grid().count() {
        let (Some(chunk), errors) = (a.chunk(tile)?, a.error_chunk(tile)?) else { continue };
        for other in b.grid().tiles_in(chunk.rect()) {
            let (Some(other), other_errors) = (b.chunk(other)?, b.error_chunk(other)?) else { continue };
            let Some(common) = chunk.rect().intersection(&other.rect()) else { continue };
            for (y, x) in (common.y0..common.y1).flat_map(|y| (common.x0..common.x1).map(move |x| (y, x))) {
                let (of_a, of_b) = (chunk.spectrum(x, y), other.spectrum(x, y));
                let square = |errors: &Option<Chunk>, k: usize| {
                    errors.as_ref().map_or(0.0, |errors| f64::from(errors.spectrum(x, y)[k]).powi(2))
                };
                for (k, sums) in sums.iter_mut().enumerate() {
                    let difference = f64::from(of_a[k]) - f64::from(of_b[k]);
                    sums.add(difference, square(&errors, k) + square(&other_errors, k));
                }
            }
        }
    }
    Ok(Some(sums))
}

fn check_comparable(a: &Cube, b: &Cube) -> Result<()> {
    let refuse = |what: String| {
        let (a, b) = (a.path().display(), b.path().display());
        Err(Error::Usage(format!("{a} and {b} cannot be compared: {what}")))
    };
    let ([wa, ha], [wb, hb]) = (a.header().size, b.header().size);
    if [wa, ha] != [wb, hb] {
        return refuse(format!("the first has {wa}x{ha} pixels, the second {wb}x{hb}"));
    }
    let ([xa, ya], [xb, yb]) = (a.header().origin, b.header().origin);
    if [xa, ya] != [xb, yb] {
        return refuse(format!(
            "the first begins at pixel {xa}, {ya} of its film, the second at {xb}, {yb}: render both with the same `film.crop`"
        ));
    }
    if a.is_counts() != b.is_counts() {
        let holds = |cube: &Cube| if cube.is_counts() { "counts of a sensor" } else { "radiance" };
        return refuse(format!("the first holds {}, the second {}", holds(a), holds(b)));
    }
    let (ca, cb) = (a.channels(), b.channels());
    if ca.len() != cb.len() {
        return refuse(format!("the first has {} channels, the second {}", ca.len(), cb.len()));
    }
    // Bounds that were computed in different ways may differ in their last bits.
    let same = |a: f64, b: f64| (a - b).abs() <= 1e-9 * a.abs().max(b.abs());
    let differs = |k: &usize| (0..2).any(|end| !same(ca.bounds[*k][end], cb.bounds[*k][end]));
    match (0..ca.len()).find(differs) {
        Some(k) => {
            let ([a0, a1], [b0, b1]) = (ca.bounds[k], cb.bounds[k]);
            refuse(format!("channel {k} is {a0}-{a1} nm in the first and {b0}-{b1} nm in the second"))
        }
        None => Ok(()),
    }
}

/// Calls `each` with the spectra of every pixel rendered in both cubes.
fn visit(a: &Cube, b: &Cube, mut each: impl FnMut(&[f32], &[f32])) -> Result<()> {
    for tile in 0..a.grid().count() {
        let Some(chunk) = a.chunk(tile)? else { continue };
        for other in b.grid().tiles_in(chunk.rect()) {
            let Some(other) = b.chunk(other)? else { continue };
            if let Some(common) = chunk.rect().intersection(&other.rect()) {
                visit_common(&chunk, &other, common, &mut |of_a, of_b| {
                    // Single pixels of counts may be missing.
                    let is_missing = a.is_counts() && of_a.iter().chain(of_b).any(|value| value.is_nan());
                    if !is_missing {
                        each(of_a, of_b);
                    }
                });
            }
        }
    }
    Ok(())
}

fn visit_common(a: &Chunk, b: &Chunk, common: Rect, each: &mut impl FnMut(&[f32], &[f32])) {
    for y in common.y0..common.y1 {
        for x in common.x0..common.x1 {
            each(a.spectrum(x, y), b.spectrum(x, y));
        }
    }
}
