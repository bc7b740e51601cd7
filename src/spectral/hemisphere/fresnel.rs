//! Fresnel reflectances of unpolarised light, and their hemispherical means.

/// Reflectance of a boundary at cosine `cosine` in [0, 1] from the side of the observer; `eta`: index beyond it over
/// index before it, above 0. 1 under total reflection.
///
/// Differences of nearly equal numbers are multiplied out, so that f32 will do as well: with t = η c_t = √(η² - 1 + c²),
/// r_s = (1 - η²) / (c + t)² and r_p = (η² - 1)((η² + 1) c² - 1) / (η² c + t)². The textbook's forms cancel near η = 1.
pub fn dielectric(cosine: f64, eta: f64) -> f64 {
    // η² - 1, exact to rounding.
    let excess = (eta - 1.0) * (eta + 1.0);
    let transmitted_square = excess + cosine * cosine;
    if transmitted_square <= 0.0 {
        return if excess == 0.0 { 0.0 } else { 1.0 };
    }
    // η times the cosine beyond.
    let transmitted = transmitted_square.sqrt();
    let s = excess / (cosine + transmitted).powi(2);
    let p = excess * ((excess + 2.0) * cosine * cosine - 1.0) / (eta * eta * cosine + transmitted).powi(2);
    0.5 * (s * s + p * p)
}

/// Reflectance of a metal of complex index `eta` + i `k`, from vacuum, at cosine `cosine` (Born and Wolf, section 14.2).
pub fn conductor(cosine: f64, eta: f64, k: f64) -> f64 {
    let (c2, s2) = (cosine * cosine, (1.0 - cosine) * (1.0 + cosine));
    let (difference, product) = (eta * eta - k * k - s2, 2.0 * eta * k);
    let modulus = difference.hypot(product);
    // a + i b = √(difference + i product); of (modulus ± difference)/2 one cancels, the other gives it by the product.
    let a2 =
        if difference >= 0.0 { 0.5 * (modulus + difference) } else { 0.5 * product * product / (modulus - difference) };
    let a = a2.sqrt();
    let s = (modulus + c2 - 2.0 * a * cosine) / (modulus + c2 + 2.0 * a * cosine);
    let (even, odd) = (c2 * modulus + s2 * s2, 2.0 * a * cosine * s2);
    let p = if even == 0.0 { 1.0 } else { s * (even - odd) / (even + odd) };
    0.5 * (s + p)
}

/// Hemispherical mean ∫ F(c) 2c dc of [`conductor`], to 1e-6.
pub fn mean_conductor(eta: f64, k: f64) -> f64 {
    mean(|cosine| conductor(cosine, eta, k))
}

/// Hemispherical mean of [`dielectric`], to 1e-6 for `eta` of at least 1.
pub fn mean_dielectric(eta: f64) -> f64 {
    mean(|cosine| dielectric(cosine, eta))
}

/// ∫ f(c) 2c dc with c = x³, which spreads out the grazing angles where metals and dense glasses change fast:
/// Gauss-Legendre in x.
fn mean(f: impl Fn(f64) -> f64) -> f64 {
    let term = |&(x, weight): &(f64, f64)| weight * f(x * x * x) * 6.0 * x.powi(5);
    GAUSS_16
        .iter()
        .flat_map(|&(node, weight)| [0.5 - 0.5 * node, 0.5 + 0.5 * node].map(|x| (x, 0.5 * weight)))
        .map(|n| term(&n))
        .sum()
}

/// Positive nodes and weights of the 16-point rule on [-1, 1] (Abramowitz and Stegun, table 25.4).
const GAUSS_16: [(f64, f64); 8] = [
    (0.095_012_509_837_637_44, 0.189_450_610_455_068_5),
    (0.281_603_550_779_258_9, 0.182_603_415_044_923_6),
    (0.458_016_777_657_227_4, 0.169_156_519_395_002_5),
    (0.617_876_244_402_643_7, 0.149_595_988_816_576_7),
    (0.755_404_408_355_003, 0.124_628_971_255_533_9),
    (0.865_631_202_387_831_7, 0.095_158_511_682_492_78),
    (0.944_575_023_073_232_6, 0.062_253_523_938_647_9),
    (0.989_400_934_991_649_9, 0.027_152_459_411_754_1),
];

#[cfg(test)]
mod tests {
    use super::*;

    /// To six digits: ((n - 1)² + k²) / ((n + 1)² + k²) at normal incidence, Fresnel's s and p at others, cosine-weighted means.
    #[test]
    fn published_reflectances() {
        let near = |got: f64, want: f64, digits: f64| assert!((got - want).abs() < digits, "{got}, expected {want}");
        for (n, r) in [(1.333, 0.020373), (1.5, 0.04), (1.5168, 0.042165), (2.42, 0.172395), (4.0, 0.36)] {
            near(dielectric(1.0, n), r, 6e-7);
            near(dielectric(1.0, 1.0 / n), r, 6e-7);
            near(conductor(1.0, n, 0.0), r, 6e-7);
        }
        for (n, k, r) in [(0.2, 3.4, 0.938462), (1.0, 6.0, 0.9), (12.0, 50.0, 0.982016)] {
            near(conductor(1.0, n, k), r, 6e-7);
        }
        let cos = |degrees: f64| degrees.to_radians().cos();
        for (degrees, s, p) in [(45.0, 0.092013, 0.008466), (60.0, 0.176571, 0.001802), (80.0, 0.538595, 0.236814)] {
            near(dielectric(cos(degrees), 1.5), 0.5 * (s + p), 1e-6);
        }
        near(conductor(cos(60.0), 0.2, 3.4), 0.5 * (0.969688 + 0.895381), 1e-6);
        near(conductor(cos(80.0), 12.0, 50.0), 0.5 * (0.996854 + 0.901770), 1e-6);
        near(mean_dielectric(1.5), 0.09177, 1e-5);
        near(mean_dielectric(1.333), 0.06640, 1e-5);
        near(mean_conductor(1.5, 0.0), 0.09177, 1e-5);
    }

    /// The form without cancellation is the textbook's (Hecht, section 4.6), on both sides and at every angle.
    #[test]
    fn textbook_form() {
        for eta in [0.05, 0.5, 0.999, 1.0000001, 1.5, 4.0, 100.0] {
            for i in 0..=200 {
                let c = f64::from(i) / 200.0;
                let sine = (1.0 - c * c).sqrt() / eta;
                let want = if sine >= 1.0 {
                    1.0
                } else {
                    let t = (1.0 - sine * sine).sqrt();
                    let (s, p) = ((c - eta * t) / (c + eta * t), (eta * c - t) / (eta * c + t));
                    0.5 * (s * s + p * p)
                };
                assert!((dielectric(c, eta) - want).abs() < 1e-11, "{eta} {c}: {} {want}", dielectric(c, eta));
                // A metal that does not absorb is a dielectric.
                let limit = conductor(c, eta, 0.0);
                assert!((limit - want).abs() < 1e-7, "{eta} {c}: {limit} {want}");
            }
        }
    }

    /// Nothing is reflected at a matched index; everything beyond the critical angle, and at grazing incidence; and of the
    /// p part nothing at Brewster's angle, where half of the published 0.147929 is left.
    #[test]
    fn limits() {
        for c in [0.0, 1e-9, 0.3, 1.0] {
            assert_eq!(dielectric(c, 1.0), 0.0);
        }
        assert!((dielectric(0.0, 1.5) - 1.0).abs() < 1e-15);
        assert_eq!((conductor(0.0, 0.2, 3.4), conductor(0.0, 1.5, 0.0)), (1.0, 1.0));
        let critical = (1.0 - 1.0 / (1.5f64 * 1.5)).sqrt();
        assert_eq!(dielectric(critical - 1e-9, 1.0 / 1.5), 1.0);
        assert!(dielectric(critical + 1e-9, 1.0 / 1.5) < 1.0);
        let brewster = 1.0 / (1.0 + 1.5f64 * 1.5).sqrt();
        assert!((dielectric(brewster, 1.5) - 0.073964).abs() < 1e-6);
        // Total reflection without loss: a purely imaginary index.
        assert!((1.0 - conductor(0.4, 1e-14, 3.0)).abs() < 1e-13);
    }

    /// The means against a midpoint rule of a million points.
    #[test]
    fn means_are_accurate() {
        let dense = |f: &dyn Fn(f64) -> f64| {
            const N: usize = 1_000_000;
            (0..N).map(|i| (i as f64 + 0.5) / N as f64).map(|c| f(c) * 2.0 * c).sum::<f64>() / N as f64
        };
        for (eta, k) in [(0.2, 3.4), (1.0, 6.0), (12.0, 50.0), (100.0, 200.0), (0.05, 1.0), (1.5, 0.01)] {
            let error = mean_conductor(eta, k) - dense(&|c| conductor(c, eta, k));
            assert!(error.abs() < 1e-6, "{eta} + {k}i: {error}");
        }
        for eta in [1.0, 1.001, 1.33, 2.4, 30.0] {
            let error = mean_dielectric(eta) - dense(&|c| dielectric(c, eta));
            assert!(error.abs() < 1e-6, "{eta}: {error}");
        }
    }
}
