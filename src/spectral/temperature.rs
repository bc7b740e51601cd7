//! Brightness temperature: that of the black body whose radiance in a channel is the given one.

use super::planck::{C1L, C2};
use super::{Channels, Curve};

/// Between these, K, the table stands. Below the first no f32 holds the radiance of any channel below 1 mm; above the last
/// the law of Rayleigh and Jeans holds, and radiance is proportional to temperature.
const COLDEST: f64 = 1.0;
const HOTTEST: f64 = 1e6;
const NODES: usize = 256;

/// From this wavelength on, nm, a channel is thermal: bodies at room temperature glow in it, and the sun hardly does.
pub const THERMAL_NM: f64 = 2500.0;

/// Whether brightness temperatures in channel `k` say how warm something is.
pub fn is_thermal(channels: &Channels, k: usize) -> bool {
    channels.centre(k) >= THERMAL_NM
}

/// The ends of a scale on which temperatures, K, of these percentiles are shown: where they are less than half a kelvin apart,
/// a kelvin below and above, so that noise does not look like a picture.
pub fn shown_range([low, high]: [f64; 2]) -> [f64; 2] {
    if high - low < 0.5 { [low - 1.0, high + 1.0] } else { [low, high] }
}

/// Temperature over radiance of one channel: 1/T by cubic Hermite interpolation over ln L, from exact values and slopes at
/// 256 temperatures in equal ratios. Relative error below 1e-6.
pub struct BandTemperature {
    ln_radiance: Vec<f64>,
    inverse: Vec<f64>,
    /// d(1/T) / d(ln L).
    slope: Vec<f64>,
}

impl BandTemperature {
    /// Of channel `k`.
    pub fn of(channels: &Channels, k: usize) -> BandTemperature {
        BandTemperature::of_all(channels, &[k])
    }

    /// Of several channels together: of their mean radiance, weighted by their widths (the integrals of their responses).
    pub fn of_all(channels: &Channels, bands: &[usize]) -> BandTemperature {
        let total: f64 = bands.iter().map(|&k| channels.integral(k)).sum();
        let share = |k: usize| channels.integral(k) / total;
        let of = |k: usize| quadrature(channels, k).into_iter().map(move |(nm, weight)| (nm, weight * share(k)));
        let weights: Vec<(f64, f64)> = bands.iter().flat_map(|&k| of(k)).collect();
        let ratio = (HOTTEST / COLDEST).powf(1.0 / (NODES - 1) as f64);
        let mut table = BandTemperature {
            ln_radiance: Vec::with_capacity(NODES),
            inverse: Vec::with_capacity(NODES),
            slope: Vec::with_capacity(NODES),
        };
        for i in 0..NODES {
            let kelvin = COLDEST * ratio.powi(i as i32);
            let (ln_radiance, derivative) = ln_band_radiance(&weights, kelvin);
            table.ln_radiance.push(ln_radiance);
            table.inverse.push(1.0 / kelvin);
            table.slope.push(1.0 / derivative);
        }
        table
    }

    /// The temperature, K, for mean radiance in W m⁻² sr⁻¹ nm⁻¹: 0 for 0, NaN for what is negative or NaN.
    pub fn kelvin(&self, radiance: f64) -> f64 {
        if radiance == 0.0 || radiance.is_nan() || radiance < 0.0 {
            return if radiance == 0.0 { 0.0 } else { f64::NAN };
        }
        let x = radiance.ln();
        let last = NODES - 1;
        if x >= self.ln_radiance[last] {
            return (x - self.ln_radiance[last]).exp() / self.inverse[last];
        }
        let i = self.ln_radiance.partition_point(|&v| v <= x).clamp(1, last) - 1;
        let h = self.ln_radiance[i + 1] - self.ln_radiance[i];
        let t = (x - self.ln_radiance[i]) / h;
        let (a, b) = (self.inverse[i], self.inverse[i + 1]);
        let (p, q) = (self.slope[i] * h, self.slope[i + 1] * h);
        // Hermite's cubic as a line and a correction that vanishes at both ends.
        let correction = t * (1.0 - t) * ((1.0 - t) * (p - (b - a)) - t * (q - (b - a)));
        1.0 / (a + t * (b - a) + correction)
    }
}

/// (nm, weight) whose weighted sum is the channel's mean of a smooth function: Gauss-Legendre on panels of at most 1/64 of
/// the wavelength, within the linear pieces of a response.
fn quadrature(channels: &Channels, k: usize) -> Vec<(f64, f64)> {
    const NODE: [f64; 5] =
        [-0.906_179_845_938_664, -0.538_469_310_105_683_1, 0.0, 0.538_469_310_105_683_1, 0.906_179_845_938_664];
    const WEIGHT: [f64; 5] = [
        0.236_926_885_056_189_1,
        0.478_628_670_499_366_5,
        0.568_888_888_888_888_9,
        0.478_628_670_499_366_5,
        0.236_926_885_056_189_1,
    ];
    let curve = channels.responses.get(k).map_or(&Curve::Constant(1.0), |response| response.curve());
    let [from, to] = channels.bounds[k];
    // Responses and constants are piecewise linear.
    let pieces = curve.linear_pieces(from, to).unwrap_or_default();
    let mut weights = Vec::new();
    for piece in pieces.windows(2) {
        let ((a, p), (b, q)) = (piece[0], piece[1]);
        if a >= b || (p <= 0.0 && q <= 0.0) {
            continue;
        }
        let panels = ((b / a).ln() * 64.0).ceil().max(1.0);
        let width = (b - a) / panels;
        for panel in 0..panels as usize {
            let centre = a + (panel as f64 + 0.5) * width;
            for (node, weight) in NODE.iter().zip(WEIGHT) {
                let nm = centre + 0.5 * width * node;
                let response = p + (nm - a) / (b - a) * (q - p);
                weights.push((nm, 0.5 * width * weight * response / channels.integral(k)));
            }
        }
    }
    weights
}

/// ln of the band's mean Planck radiance, and its derivative by 1/T. In logarithms, so that nothing underflows.
fn ln_band_radiance(weights: &[(f64, f64)], kelvin: f64) -> (f64, f64) {
    let ln_planck = |nm: f64| {
        let metre = nm * 1e-9;
        let x = C2 / (metre * kelvin);
        (C1L.ln() - 5.0 * metre.ln() - x - (-(-x).exp_m1()).ln() + 1e-9f64.ln(), x)
    };
    let largest = weights.iter().map(|(nm, _)| ln_planck(*nm).0).fold(f64::NEG_INFINITY, f64::max);
    let (mut sum, mut derivative) = (0.0, 0.0);
    for &(nm, weight) in weights {
        let (ln, x) = ln_planck(nm);
        let part = weight * (ln - largest).exp();
        sum += part;
        // d ln B / d(1/T) = -(c2/λ) / (1 - e^-x).
        derivative -= part * (x * kelvin) / -(-x).exp_m1();
    }
    (largest + sum.ln(), derivative / sum)
}

#[cfg(test)]
mod tests {
    use super::super::Response;
    use super::*;

    #[test]
    fn temperatures_of_black_bodies_come_back() {
        let wide = Channels::from_bounds(vec![[550.0, 551.0], [3e3, 5e3], [8e3, 14e3], [380.0, 2e4], [1e5, 1e6]], None);
        for k in 0..wide.len() {
            let band = BandTemperature::of(&wide, k);
            let [from, to] = wide.bounds[k];
            for kelvin in [30.0, 220.0, 300.0, 301.7, 900.0, 5778.0, 2e5, 3e7] {
                let radiance = Curve::Blackbody { kelvin, scale: 1.0 }.mean(from, to);
                if radiance > 1e-300 {
                    let got = band.kelvin(radiance);
                    // Rayleigh and Jeans differ from Planck by x/2, 1.3 % at 550 nm and a million kelvin.
                    let allowed = if kelvin > HOTTEST { 0.02 } else { 1e-6 };
                    assert!((got / kelvin - 1.0).abs() < allowed, "{from}-{to} nm, {kelvin} K: {got}");
                }
            }
        }
    }

    /// Against the trapezoidal rule on the response's own nodes, which are 1 nm apart.
    #[test]
    fn responses_weight_the_band() {
        let nm: Vec<f64> = (8000..=12000).map(f64::from).collect();
        let value: Vec<f64> = nm.iter().map(|x| (-((x - 10_000.0) / 900.0).powi(2)).exp()).collect();
        let response = Response::new(nm.clone(), value.clone()).unwrap();
        let channels = Channels::from_responses(vec![("b".into(), response)], None);
        let planck = |x: f64| super::super::planck::radiance(x, 287.5);
        let sum = |f: &dyn Fn(usize) -> f64| -> f64 { (0..nm.len() - 1).map(|i| 0.5 * (f(i) + f(i + 1))).sum() };
        let mean = sum(&|i| value[i] * planck(nm[i])) / sum(&|i| value[i]);
        let got = BandTemperature::of(&channels, 0).kelvin(mean);
        assert!((got - 287.5).abs() < 1e-4, "{got}");
    }

    #[test]
    fn channels_together_are_one_wide_one() {
        let channels = Channels::from_bounds(vec![[8e3, 9e3], [9e3, 12e3]], None);
        let radiance = Curve::Blackbody { kelvin: 250.0, scale: 1.0 }.mean(8e3, 12e3);
        let got = BandTemperature::of_all(&channels, &[0, 1]).kelvin(radiance);
        assert!((got / 250.0 - 1.0).abs() < 1e-6, "{got}");
    }

    /// Means by a plain sum of 20,000 midpoints, in the f32 that cubes hold.
    #[test]
    fn radiance_of_a_cube_is_good_for_microkelvins() {
        for [from, to] in [[8e3, 12e3], [3e3, 5e3], [9_990.0, 10_010.0], [1e3, 20e3]] {
            let band = BandTemperature::of(&Channels::from_bounds(vec![[from, to]], None), 0);
            for kelvin in [77.0, 233.15, 300.0, 305.3, 1500.0, 5778.0] {
                let at =
                    |i: i32| super::super::planck::radiance(from + (f64::from(i) + 0.5) * (to - from) / 2e4, kelvin);
                let mean = (0..20_000).map(at).sum::<f64>() / 2e4;
                let got = band.kelvin(f64::from(mean as f32));
                // Rounding to f32 is worth 6e-8 / (d ln B / d ln T), which is at least 1; the sum is good for 1e-6.
                assert!((got / kelvin - 1.0).abs() < 2e-6, "{from}-{to} nm, {kelvin} K: {got}");
            }
        }
    }

    #[test]
    fn what_is_thermal_and_on_which_scale_it_is_shown() {
        let channels = Channels::from_bounds(vec![[500.0, 510.0], [2e3, 3e3], [8e3, 12e3]], None);
        assert_eq!([0, 1, 2].map(|k| is_thermal(&channels, k)), [false, true, true]);
        assert_eq!(shown_range([280.0, 290.0]), [280.0, 290.0]);
        assert_eq!(shown_range([300.0, 300.25]), [299.0, 301.25]);
    }

    #[test]
    fn zero_is_zero_and_what_is_none_is_nan() {
        let band = BandTemperature::of(&Channels::equal(8e3, 12e3, 1), 0);
        assert_eq!(band.kelvin(0.0), 0.0);
        assert!(band.kelvin(-1.0).is_nan() && band.kelvin(f64::NAN).is_nan());
        assert!(band.kelvin(f64::from(f32::from_bits(1))) > 0.0);
    }
}
