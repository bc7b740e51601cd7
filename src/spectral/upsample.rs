//! From one linear-sRGB colour to a smooth spectrum: Jakob and Hanika, *A Low-Dimensional Function Space for
//! Efficient Spectral Upsampling* (Computer Graphics Forum 38(2), 2019).
//!
//! A reflectance is S(c₀t² + c₁t + c₂), S(x) = ½ + x / (2√(1+x²)) (Eqs. 3 and 4), t the wavelength scaled to [0, 1].
//! The paper tabulates the coefficients; here they are solved for, one by one or a picture at a time.

use std::collections::HashMap;
use std::sync::LazyLock;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::curve::{Curve, Outside};
use super::data::{CIE1931, D65, columns};

/// Where the colour matching functions, and so the fit, begin and end, in nm. The grid has a node every nm.
pub const FIRST_NM: u32 = 360;
pub const LAST_NM: u32 = 830;
const NODES: usize = (LAST_NM - FIRST_NM + 1) as usize;

/// Colour matching functions and D65 on the 1 nm grid, and what follows from them.
struct Observer {
    /// x̄ȳz̄ · D65, scaled so that a perfect reflector has Y = 1.
    weight: Vec<DVec3>,
    /// D65 scaled so that ∫D65 ȳ dλ = ∫ȳ dλ.
    d65: Vec<f64>,
    /// XYZ of D65 on this very grid, Y = 1.
    white: DVec3,
    /// Linear sRGB to XYZ, with that white, so that [1, 1, 1] is exactly a perfect reflector.
    from_rgb: DMat3,
}

static OBSERVER: LazyLock<Observer> = LazyLock::new(|| {
    let bars: Vec<DVec3> = columns::<4>(CIE1931).map(|[_, x, y, z]| DVec3::new(x, y, z)).collect();
    let (nm, value) = columns::<2>(D65).map(|[nm, v]| (nm, v)).unzip();
    let d65 = Curve::Linear { nm, value, outside: Outside::Hold };
    let d65: Vec<f64> = (FIRST_NM..=LAST_NM).map(|nm| d65.eval(f64::from(nm))).collect();

    let luminance: f64 = bars.iter().zip(&d65).map(|(bar, d)| bar.y * d).sum();
    let scale = bars.iter().map(|bar| bar.y).sum::<f64>() / luminance;
    let weight: Vec<DVec3> = bars.iter().zip(&d65).map(|(bar, d)| *bar * (*d / luminance)).collect();
    let white: DVec3 = weight.iter().sum();
    // IEC 61966-2-1 primaries as chromaticities (x, y, 1-x-y).
    let primaries =
        DMat3::from_cols(DVec3::new(0.64, 0.33, 0.03), DVec3::new(0.30, 0.60, 0.10), DVec3::new(0.15, 0.06, 0.79));
    let from_rgb = primaries * DMat3::from_diagonal(primaries.inverse() * white);
    Observer { weight, d65: d65.iter().map(|d| d * scale).collect(), white, from_rgb }
});

/// A reflectance in [0, 1] whose colour under D65 (CIE 1931 2°) is `rgb`, linear sRGB in [0, 1].
///
/// Greys are exactly constant. All of sRGB is met, its corners included; only colours a few millionths above black
/// or below white, which need ever steeper spectra, end at the nearest one in CIELAB (within 1e-3). Beyond
/// 360-830 nm the end values hold.
pub fn reflectance(rgb: [f64; 3]) -> Curve {
    if rgb[0] == rgb[1] && rgb[1] == rgb[2] {
        return Curve::Constant(rgb[0]);
    }
    let coefficients = solve(DVec3::from_array(rgb)).coefficients;
    on_grid((0..NODES).map(|i| smooth(coefficients, i)))
}

/// A smooth reflectance by its coefficients.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Smooth(pub [f64; 3]);

impl Smooth {
    /// That of [`reflectance`] for `rgb`, without its grid. Greys are constant to rounding.
    pub fn new(rgb: [f64; 3]) -> Self {
        match grey(rgb) {
            Some(grey) => grey,
            None => Smooth(solve(DVec3::from_array(rgb)).coefficients.to_array()),
        }
    }

    /// The value at `nm`; beyond 360-830 nm the end values hold.
    pub fn eval(&self, nm: f64) -> f64 {
        let (first, last) = (f64::from(FIRST_NM), f64::from(LAST_NM));
        let t = (nm.clamp(first, last) - first) / (last - first);
        let [a, b, c] = self.0;
        let x = (a * t + b) * t + c;
        // `sigmoid` without its cancellation where x is far below 0.
        let root = (1.0 + x * x).sqrt();
        let tail = 0.5 / (root * (root + x.abs()));
        if x < 0.0 { tail } else { 1.0 - tail }
    }
}

/// [`Smooth::new`] of every colour in turn: the same but for the last digits, and much faster where there are many,
/// as each is solved for from the solution of a similar one. All cores take part, and change no bit.
pub fn smooth_of(colours: &[[f32; 3]]) -> Vec<Smooth> {
    // Along a curve that visits the colour cube piece by piece, so that neighbours on it are alike.
    let key = |rgb: &[f32; 3]| (interleaved(rgb), rgb.map(f32::to_bits));
    let mut distinct = colours.to_vec();
    distinct.sort_unstable_by_key(key);
    distinct.dedup_by_key(|rgb| rgb.map(f32::to_bits));

    const BLOCK: usize = 256;
    let solve = |block: &[[f32; 3]]| {
        let mut similar = None;
        let solved = block.iter().map(|rgb| {
            let colour = rgb.map(f64::from);
            let smooth = grey(colour).unwrap_or_else(|| {
                let solution = near(DVec3::from_array(colour), similar.take());
                let smooth = Smooth(solution.coefficients.to_array());
                similar = Some(solution);
                smooth
            });
            (rgb.map(f32::to_bits), smooth)
        });
        solved.collect::<Vec<_>>()
    };
    let solved: HashMap<[u32; 3], Smooth> = distinct.par_chunks(BLOCK).with_max_len(1).flat_map_iter(solve).collect();
    colours.iter().map(|rgb| solved[&rgb.map(f32::to_bits)]).collect()
}

/// The solution for `rgb`, not grey, from that of a similar colour, or from none.
fn near(rgb: DVec3, similar: Option<Found>) -> Found {
    if let Some(similar) = similar {
        let target = lab(OBSERVER.from_rgb * rgb).0;
        let found = descend(similar, target, 12);
        if found.is_close(target) {
            return found;
        }
    }
    solve(rgb)
}

/// Ten bits of each component, taken in turn (Morton 1966).
fn interleaved(rgb: &[f32; 3]) -> u32 {
    let bits = rgb.map(|v| (v.clamp(0.0, 1.0) * 1023.0) as u32);
    (0..30).fold(0, |key, i| key | (bits[i % 3] >> (i / 3) & 1) << i)
}

/// The coefficients of a grey: S⁻¹, of what is 1e-18 from its ends the ends.
fn grey(rgb: [f64; 3]) -> Option<Smooth> {
    let [v, g, b] = rgb;
    (v == g && g == b).then(|| {
        let inverse = (2.0 * v - 1.0) / (2.0 * (v * (1.0 - v)).max(0.0).sqrt());
        Smooth([0.0, 0.0, inverse.clamp(-FARTHEST, FARTHEST)])
    })
}

/// Beyond, S is 0 or 1 to 1e-18; its square is far inside f32.
const FARTHEST: f64 = 5e8;

/// An emission, in W m⁻² sr⁻¹ nm⁻¹, of colour `rgb`, linear sRGB of at least 0: D65 times a smooth spectrum times a
/// scale, such that [1, 1, 1] is D65 with Y = ∫L ȳ dλ / ∫ȳ dλ = 1. Beyond 360-830 nm the end values hold.
pub fn emission(rgb: [f64; 3]) -> Curve {
    let largest = rgb[0].max(rgb[1]).max(rgb[2]);
    if largest == 0.0 {
        return Curve::Constant(0.0);
    }
    // Twice the largest leaves the smooth spectrum at ½ and below, where it is at its smoothest.
    let scale = 2.0 * largest;
    let smooth = reflectance(rgb.map(|v| v / scale));
    on_grid((0..NODES).map(|i| scale * smooth.eval(grid_nm(i)) * OBSERVER.d65[i]))
}

/// D65 with Y = 1: the spectrum of white light.
pub fn daylight() -> Curve {
    on_grid(OBSERVER.d65.iter().copied())
}

fn on_grid(value: impl Iterator<Item = f64>) -> Curve {
    Curve::Linear { nm: (0..NODES).map(grid_nm).collect(), value: value.collect(), outside: Outside::Hold }
}

fn grid_nm(i: usize) -> f64 {
    f64::from(FIRST_NM) + i as f64
}

/// (t², t, 1) at node `i`.
fn basis(i: usize) -> DVec3 {
    let t = i as f64 / (NODES - 1) as f64;
    DVec3::new(t * t, t, 1.0)
}

/// The smooth spectrum's value (Jakob and Hanika 2019), x the polynomial's.
fn sigmoid(x: f64) -> f64 {
    0.5 + x / (2.0 * (1.0 + x * x).sqrt())
}

fn smooth(coefficients: DVec3, i: usize) -> f64 {
    sigmoid(coefficients.dot(basis(i))).clamp(0.0, 1.0)
}

/// CIELAB of `xyz` under the grid's D65, and its derivative.
fn lab(xyz: DVec3) -> (DVec3, DMat3) {
    const DELTA: f64 = 6.0 / 29.0;
    let white = OBSERVER.white;
    let f = |ratio: f64| {
        if ratio > DELTA.powi(3) {
            let root = ratio.cbrt();
            (root, 1.0 / (3.0 * root * root))
        } else {
            (ratio / (3.0 * DELTA * DELTA) + 4.0 / 29.0, 1.0 / (3.0 * DELTA * DELTA))
        }
    };
    let ((fx, dx), (fy, dy), (fz, dz)) = (f(xyz.x / white.x), f(xyz.y / white.y), f(xyz.z / white.z));
    let value = DVec3::new(116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz));
    let derivative = DMat3::from_cols(
        DVec3::new(0.0, 500.0, 0.0) * (dx / white.x),
        DVec3::new(116.0, -500.0, 200.0) * (dy / white.y),
        DVec3::new(0.0, 0.0, -200.0) * (dz / white.z),
    );
    (value, derivative)
}

/// Nodes that are summed side by side, the registers of a processor: the last ones are padded with weights of 0.
const LANES: usize = 4;

/// Some neighbouring nodes of the grid: t and the weights of x̄, ȳ and z̄.
struct Nodes {
    t: [f64; LANES],
    weight: [[f64; LANES]; 3],
}

static NODES_BY_LANES: LazyLock<Vec<Nodes>> = LazyLock::new(|| {
    let node = |i: usize| (i < NODES).then(|| (basis(i).y, OBSERVER.weight[i].to_array()));
    let nodes = |first: usize| Nodes {
        t: std::array::from_fn(|lane| node(first + lane).map_or(0.0, |(t, _)| t)),
        weight: std::array::from_fn(|bar| {
            std::array::from_fn(|lane| node(first + lane).map_or(0.0, |(_, weight)| weight[bar]))
        }),
    };
    (0..NODES).step_by(LANES).map(nodes).collect()
});

/// Coefficients, CIELAB of their smooth reflectance, and its derivative by the coefficients.
#[derive(Clone, Copy)]
struct Found {
    coefficients: DVec3,
    lab: DVec3,
    jacobian: DMat3,
}

impl Found {
    /// A picture of many colours spends its time here.
    fn at(coefficients: DVec3) -> Found {
        let [a, b, c] = coefficients.to_array();
        // Of each bar: the sum of values, and of slopes by each coefficient.
        let mut sums = [[[0.0; LANES]; 4]; 3];
        for Nodes { t, weight } in NODES_BY_LANES.iter() {
            let x = t.map(|t| (a * t + b) * t + c);
            let root = x.map(|x| (1.0 + x * x).sqrt().recip());
            for (sums, weight) in sums.iter_mut().zip(weight) {
                for lane in 0..LANES {
                    let (t, root) = (t[lane], root[lane]);
                    let slope = weight[lane] * (0.5 * root * root * root);
                    sums[0][lane] += weight[lane] * (0.5 + 0.5 * x[lane] * root);
                    sums[1][lane] += slope * t * t;
                    sums[2][lane] += slope * t;
                    sums[3][lane] += slope;
                }
            }
        }
        let sum = |of: usize| DVec3::from_array(sums.map(|bar| bar[of].iter().sum()));
        let (lab, by_xyz) = lab(sum(0));
        Found { coefficients, lab, jacobian: by_xyz * DMat3::from_cols(sum(1), sum(2), sum(3)) }
    }

    fn is_close(&self, target: DVec3) -> bool {
        (self.lab - target).length_squared() < CLOSE_ENOUGH
    }
}

/// The coefficients for `rgb` in [0, 1]³, not grey. From a grey of equal luminance the target moves to the colour in
/// steps, each starting at the solution of the one before, as the paper builds its table.
fn solve(rgb: DVec3) -> Found {
    const STEPS: u32 = 8;
    let grey = (OBSERVER.from_rgb * rgb).y.clamp(1e-3, 1.0 - 1e-3);
    let x = 2.0 * grey - 1.0;
    let mut found = Found::at(DVec3::new(0.0, 0.0, x / (1.0 - x * x).sqrt()));
    for step in 1..=STEPS {
        let target = DVec3::splat(grey).lerp(rgb, f64::from(step) / f64::from(STEPS));
        found = descend(found, lab(OBSERVER.from_rgb * target).0, 100);
    }
    found
}

/// CIELAB units, squared: far below what f32 output can show.
const CLOSE_ENOUGH: f64 = 1e-18;

/// Gauss-Newton on the CIELAB difference to `target`, damped (Levenberg-Marquardt) so that it also ends well where
/// the colour is out of reach and the coefficients would run away.
fn descend(mut found: Found, target: DVec3, iterations: usize) -> Found {
    let mut damping = 1e-3;
    for _ in 0..iterations {
        if found.is_close(target) || damping > 1e12 {
            break;
        }
        let (residual, jacobian) = (found.lab - target, found.jacobian);
        let normal = jacobian.transpose() * jacobian;
        let diagonal = DVec3::new(normal.x_axis.x, normal.y_axis.y, normal.z_axis.z);
        let damped = normal + DMat3::from_diagonal(diagonal * damping + 1e-12);
        let candidate = Found::at(found.coefficients - damped.inverse() * (jacobian.transpose() * residual));
        // A singular matrix gives NaN, which is no improvement either.
        if (candidate.lab - target).length_squared() < residual.length_squared() {
            found = candidate;
            damping = (damping * 0.1).max(1e-15);
        } else {
            damping *= 10.0;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Linear sRGB of a reflectance curve under D65.
    fn colour(curve: &Curve) -> DVec3 {
        let xyz: DVec3 = OBSERVER.weight.iter().enumerate().map(|(i, w)| *w * curve.eval(grid_nm(i))).sum();
        OBSERVER.from_rgb.inverse() * xyz
    }

    #[test]
    fn the_white_is_d65() {
        let white = OBSERVER.white;
        // CIE 15: the chromaticity of D65, 2°.
        let (x, y) = (white.x / white.element_sum(), white.y / white.element_sum());
        assert!((x - 0.31272).abs() < 2e-5 && (y - 0.32903).abs() < 2e-5, "{x} {y}");
    }

    #[test]
    fn colours_come_back() {
        let mut worst: f64 = 0.0;
        for r in 0..6 {
            for g in 0..6 {
                for b in 0..6 {
                    let rgb = [r, g, b].map(|v| f64::from(v) / 5.0);
                    let back = colour(&reflectance(rgb));
                    worst = worst.max((back - DVec3::from_array(rgb)).abs().max_element());
                }
            }
        }
        // The descent stops within 1e-9 CIELAB units, which are nowhere worth more than 1e-1 of linear sRGB.
        assert!(worst < 1e-9, "{worst:e}");
    }

    #[test]
    fn colours_near_black_and_white_are_met_as_well_as_they_can_be() {
        for rgb in
            [[1e-6, 0.0, 0.0], [0.0, 0.0, 1e-3], [1.0, 1.0, 0.999], [1.0, 0.999_999, 1.0], [0.5, 0.5, 0.500_000_1]]
        {
            let curve = reflectance(rgb);
            let Curve::Linear { value, .. } = &curve else { panic!("{rgb:?} is no grey") };
            assert!(value.iter().all(|v| (0.0..=1.0).contains(v)), "{rgb:?}");
            let lab_of = |rgb: DVec3| lab(OBSERVER.from_rgb * rgb).0;
            let difference = lab_of(colour(&curve)).distance(lab_of(DVec3::from_array(rgb)));
            assert!(difference < 1e-3, "{rgb:?}: {difference:e}");
        }
    }

    #[test]
    fn greys_are_exact() {
        for v in [0.0, 0.25, 1.0] {
            assert_eq!(reflectance([v; 3]), Curve::Constant(v));
        }
    }

    /// Many at once are what each is alone: on the grid to 1e-9, greys, corners and repeated ones among them.
    #[test]
    fn many_colours_are_the_same_as_one_by_one() {
        let mut colours: Vec<[f32; 3]> = Vec::new();
        for i in 0..3000u32 {
            let byte = |shift: u32| (i.wrapping_mul(2_654_435_761) >> shift & 255) as f32 / 255.0;
            colours.push([byte(8), byte(16), byte(24)]);
        }
        colours.extend([[0.0; 3], [1.0; 3], [0.5; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 0.0], [0.5; 3]]);
        let start = std::time::Instant::now();
        let all = smooth_of(&colours);
        println!("{} colours in {:?}", colours.len(), start.elapsed());
        assert_eq!(all, smooth_of(&colours));
        for (rgb, smooth) in colours.iter().zip(&all).rev().step_by(17).chain([(&[0.0; 3], &all[3000])]) {
            let curve = reflectance(rgb.map(f64::from));
            for nm in [300.0, 360.0, 450.0, 551.0, 702.0, 830.0, 2000.0] {
                let (one, many) = (curve.eval(nm), smooth.eval(nm));
                assert!((one - many).abs() < 1e-8, "{rgb:?} at {nm} nm: {one} {many}");
            }
        }
        assert_eq!(all[3000].eval(500.0), Smooth::new([0.0; 3]).eval(500.0));
        assert!(all[3000].eval(500.0) < 1e-17 && all[3001].eval(500.0) == 1.0 && all[3002].eval(500.0) == 0.5);
        assert!(smooth_of(&[]).is_empty());
    }

    /// What a scene means by rgb emission [1, 1, 1]: D65 with Y = 1.
    #[test]
    fn white_emission_is_d65_of_unit_luminance() {
        let bars = || columns::<4>(CIE1931);
        let luminance = |curve: &Curve| {
            bars().map(|[nm, _, y, _]| y * curve.eval(nm)).sum::<f64>() / bars().map(|c| c[2]).sum::<f64>()
        };
        let white = emission([1.0; 3]);
        assert!((luminance(&white) - 1.0).abs() < 1e-12);
        // 560 nm and 450 nm of the table: 100 and 117.008.
        assert!((white.eval(450.0) / white.eval(560.0) - 1.17008).abs() < 1e-12);
        // Linear in scale, and the luminance of a colour is that of its sRGB.
        assert!((luminance(&emission([3.0; 3])) - 3.0).abs() < 1e-12);
        let expected = (OBSERVER.from_rgb * DVec3::new(5.0, 0.5, 2.0)).y;
        assert!((luminance(&emission([5.0, 0.5, 2.0])) - expected).abs() < 1e-8);
        assert_eq!(emission([0.0; 3]), Curve::Constant(0.0));
    }
}
