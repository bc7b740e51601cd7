//! Fresnel's equations for unpolarised light, as textbooks have them.
//!
//! In f64 their cancellation is harmless; `spectral::hemisphere` has the forms for f32.

/// Reflectance of a boundary of relative index `eta` (beyond over before) at cosine `c`.
pub fn dielectric(c: f64, eta: f64) -> f64 {
    match cosine_beyond(c, eta) {
        // 0/0 at grazing incidence.
        _ if eta == 1.0 => 0.0,
        None => 1.0,
        Some(t) => {
            let (s, p) = ((c - eta * t) / (c + eta * t), (eta * c - t) / (eta * c + t));
            0.5 * (s * s + p * p)
        }
    }
}

/// Snell's law: the cosine beyond the boundary; `None` under total reflection.
pub fn cosine_beyond(c: f64, eta: f64) -> Option<f64> {
    let square = 1.0 - (1.0 - c * c) / (eta * eta);
    (square > 0.0).then(|| square.sqrt())
}

/// Reflectance, from vacuum, of a metal of complex index `eta` + i `k`: with ε = (η + i k)² and q = √(ε - sin²θ),
/// r_s = (c - q)/(c + q) and r_p = (ε c - q)/(ε c + q).
pub fn conductor(c: f64, eta: f64, k: f64) -> f64 {
    let epsilon = [eta * eta - k * k, 2.0 * eta * k];
    let q = square_root([epsilon[0] - (1.0 - c * c), epsilon[1]]);
    let square = |[re, im]: [f64; 2]| re * re + im * im;
    let s = square([c - q[0], q[1]]) / square([c + q[0], q[1]]);
    let p =
        square([epsilon[0] * c - q[0], epsilon[1] * c - q[1]]) / square([epsilon[0] * c + q[0], epsilon[1] * c + q[1]]);
    0.5 * (s + p)
}

/// The root with non-negative parts of a complex number whose imaginary part is not negative.
fn square_root([re, im]: [f64; 2]) -> [f64; 2] {
    let modulus = re.hypot(im);
    let (a, b) = ((0.5 * (modulus + re)).max(0.0).sqrt(), (0.5 * (modulus - re)).max(0.0).sqrt());
    // The larger part is exact; the other follows from 2ab = im.
    match (a, b) {
        (0.0, 0.0) => [0.0, 0.0],
        _ if a >= b => [a, 0.5 * im / a],
        _ => [0.5 * im / b, b],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectral::hemisphere::fresnel as shared;

    /// Two ways of writing the same equations agree; the other is held against published digits.
    #[test]
    fn agrees_with_the_forms_for_f32() {
        for i in 0..=1000 {
            let c = f64::from(i) / 1000.0;
            for eta in [0.05, 0.67, 1.0, 1.0000001, 1.33, 1.5, 2.4, 100.0] {
                let (a, b) = (dielectric(c, eta), shared::dielectric(c, eta));
                assert!((a - b).abs() < 1e-9, "{c} {eta}: {a} {b}");
                // The same from behind; what is left of a small cosine after Snell's law twice is √ε η.
                if let Some(t) = cosine_beyond(c, eta).filter(|_| eta < 3.0) {
                    let back = dielectric(t, 1.0 / eta);
                    assert!((a - back).abs() < 1e-6, "{c} {eta}: {a} from before, {back} from behind");
                }
            }
            for (eta, k) in [(0.2, 3.4), (1.0, 6.0), (12.0, 50.0), (100.0, 200.0), (0.05, 0.01), (1.5, 0.0)] {
                let (a, b) = (conductor(c, eta, k), shared::conductor(c, eta, k));
                assert!((a - b).abs() < 1e-9, "{c} {eta} {k}: {a} {b}");
            }
        }
    }
}
