//! Planck's law.

/// First radiation constant for spectral radiance, 2hc² (SI 2019), in W m² sr⁻¹.
pub const C1L: f64 = 1.191_042_972_397_188_4e-16;
/// Second radiation constant hc/k (SI 2019), in m K.
pub const C2: f64 = 1.438_776_877_503_933_6e-2;

/// Black-body spectral radiance in W m⁻² sr⁻¹ nm⁻¹ at `nm` nanometres and `kelvin`.
///
/// Written as c₁λ⁻⁵ e⁻ˣ / (1 - e⁻ˣ) with `exp_m1`, which neither overflows for small λT nor cancels for
/// large λT; what underflows is 0. Non-positive wavelengths or temperatures give 0.
pub fn radiance(nm: f64, kelvin: f64) -> f64 {
    if nm <= 0.0 || kelvin <= 0.0 {
        return 0.0;
    }
    let m = nm * 1e-9;
    let x = C2 / (m * kelvin);
    let per_metre = C1L / m.powi(5) * (-x).exp() / -(-x).exp_m1();
    per_metre * 1e-9
}

/// Brightness temperatures in a channel: at which temperature a black body has this mean radiance over it.
///
/// A table of the logarithm of the mean over 1/T, in which Wien's law is a straight line; its temperatures are half a percent
/// apart from 20 K to 20,000 K, and what lies between is interpolated to about 1e-6 of T.
pub struct Thermometer {
    /// ln of the mean radiance, ascending, and 1/T.
    ln_radiance: Vec<f64>,
    inverse: Vec<f64>,
}

impl Thermometer {
    /// For the channel from `from` to `to` nm.
    pub fn new([from, to]: [f64; 2]) -> Thermometer {
        const STEPS: i32 = 1382;
        let (mut ln_radiance, mut inverse) = (Vec::new(), Vec::new());
        for step in 0..=STEPS {
            let kelvin = 20.0 * 1000f64.powf(f64::from(step) / f64::from(STEPS));
            let mean = mean_radiance([from, to], kelvin);
            // In cold and short waves nothing is left of it.
            if mean > f64::MIN_POSITIVE {
                ln_radiance.push(mean.ln());
                inverse.push(kelvin.recip());
            }
        }
        Thermometer { ln_radiance, inverse }
    }

    /// The temperature, K, of a black body with this mean radiance in W m⁻² sr⁻¹ nm⁻¹; 0 without radiance, NaN for NaN. Beyond
    /// the table it is extrapolated.
    pub fn kelvin(&self, radiance: f64) -> f64 {
        if radiance <= 0.0 || radiance.is_nan() || self.inverse.len() < 2 {
            return if radiance.is_nan() { f64::NAN } else { 0.0 };
        }
        let wanted = radiance.ln();
        let upper = self.ln_radiance.partition_point(|&ln| ln < wanted).clamp(1, self.inverse.len() - 1);
        let [a, b] = [upper - 1, upper].map(|i| (self.ln_radiance[i], self.inverse[i]));
        (a.1 + (b.1 - a.1) * (wanted - a.0) / (b.0 - a.0)).recip().max(0.0)
    }
}

/// The mean of [`radiance`] over an interval of nm, by Simpson's rule over equal steps of ln λ.
fn mean_radiance([from, to]: [f64; 2], kelvin: f64) -> f64 {
    const PAIRS: i32 = 32;
    let step = (to / from).ln() / f64::from(2 * PAIRS);
    let at = |i: i32| {
        let nm = from * (step * f64::from(i)).exp();
        nm * radiance(nm, kelvin)
    };
    let inner: f64 = (1..2 * PAIRS).map(|i| if i % 2 == 1 { 4.0 * at(i) } else { 2.0 * at(i) }).sum();
    step / 3.0 * (at(0) + inner + at(2 * PAIRS)) / (to - from)
}

#[cfg(test)]
mod tests {
    use super::{Thermometer, radiance};

    /// Means by a plain sum of 20,000 midpoints, wide channels and narrow ones.
    #[test]
    fn a_black_body_has_its_own_brightness_temperature() {
        for bounds in [[8e3, 12e3], [3e3, 5e3], [9_990.0, 10_010.0], [1e3, 20e3]] {
            let thermometer = Thermometer::new(bounds);
            for kelvin in [77.0, 233.15, 300.0, 305.3, 1500.0, 5778.0] {
                let width = (bounds[1] - bounds[0]) / 2e4;
                let at = |i: i32| radiance(bounds[0] + (f64::from(i) + 0.5) * width, kelvin);
                let mean = (0..20_000).map(at).sum::<f64>() / 2e4;
                let got = thermometer.kelvin(mean);
                assert!((got / kelvin - 1.0).abs() < 5e-6, "{bounds:?} {kelvin} K: {got}");
            }
            assert_eq!(thermometer.kelvin(0.0), 0.0);
            assert!(thermometer.kelvin(f64::NAN).is_nan());
        }
    }

    /// VALIDATION section 1.6.
    #[test]
    fn planck_matches_published_values() {
        for (nm, kelvin, expected) in [
            (550.0, 300.0, 3.193330e-32),
            (4e3, 300.0, 7.219764e-4),
            (1e4, 300.0, 9.924033e-3),
            (1e4, 310.0, 1.160066e-2),
            (4e3, 900.0, 2.177613),
            (2.2e3, 1500.0, 29.91619),
            (550.0, 2856.0, 249.0188),
            (550.0, 5778.0, 2.585764e4),
            (2e4, 220.0, 1.470571e-3),
        ] {
            let got = radiance(nm, kelvin);
            assert!((got / expected - 1.0).abs() < 5e-7, "{nm} nm {kelvin} K: {got} {expected}");
        }
    }
}
