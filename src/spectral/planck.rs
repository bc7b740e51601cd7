//! Planck's law.

/// Planck's constant, J s, the speed of light, m/s, and the charge of the electron, C (SI 2019, exact).
pub const PLANCK: f64 = 6.626_070_15e-34;
pub const LIGHT_SPEED: f64 = 299_792_458.0;
pub const CHARGE: f64 = 1.602_176_634e-19;
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

/// What is that much less than what the hottest place sends need not be so right.
const DARK: f64 = 1e-3;
/// Wavelengths, spread over a range, at which [`chord_error`] looks.
const WAVELENGTHS: usize = 48;

/// How far off, in `from` to `to` nanometres, radiance is that is interpolated between what bodies of `low` and `high` kelvin send, over
/// what is sent really, or over a thousandth of what one of `hottest` kelvin sends.
pub fn chord_error([from, to]: [f64; 2], [low, high]: [f64; 2], hottest: f64) -> f64 {
    let ratio = (to / from).ln() / (WAVELENGTHS - 1) as f64;
    let at = |i: usize| {
        let nm = from * (ratio * i as f64).exp();
        let least = DARK * radiance(nm, hottest);
        let [below, above] = [low, high].map(|kelvin| radiance(nm, kelvin));
        let off = |share: f64| {
            let real = radiance(nm, low + share * (high - low));
            let error = (below + share * (above - below) - real).abs();
            // Where f32 would have nothing either.
            if error > 0.0 { error / real.max(least).max(f64::MIN_POSITIVE) } else { 0.0 }
        };
        [0.25, 0.5, 0.75].into_iter().map(off).fold(0.0, f64::max)
    };
    (0..WAVELENGTHS).map(at).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::radiance;

    /// Planck's law with the constants of the SI of 2019, to seven digits.
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
