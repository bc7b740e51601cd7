//! Estimates with their uncertainty, and tests of them whose bounds are derived.
//!
//! A deterministic part (rounding, truncation) is stated by each test as `allowance`, relative to the expected value;
//! the random part is a two-sided Student t-test at [`ALPHA`] per test, Sidak-corrected over the values of that test.
//! Each test also limits the standard error, so that none passes because it sees nothing.

use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::report;

/// Probability that a right estimator fails one test. Seeds are fixed, so a test that passes once always passes.
pub const ALPHA: f64 = 1e-4;

/// Largest relative distance between a number and its f32.
pub const HALF_ULP: f64 = 1.0 / 16_777_216.0;

/// How far rays start off a surface, relative to the half size of the scene (Wächter and Binder's constants: 2⁻¹⁶ near
/// the origin, 256 ulp else). The largest systematic error of a closed form on the device: each scattering event
/// happens that far beside where it should.
pub const ORIGIN_OFFSET: f64 = 1.0 / 65_536.0;

/// Quantile for `count` two-sided comparisons at [`ALPHA`] together (Sidak 1967), for a Student t with `freedom` degrees.
pub fn t_limit(count: usize, freedom: f64) -> f64 {
    let each = -((-ALPHA).ln_1p() / count as f64).exp_m1();
    StudentsT::new(0.0, 1.0, freedom).expect("positive freedom").inverse_cdf(1.0 - 0.5 * each)
}

/// A mean, its standard error, and the degrees of freedom behind that error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    pub mean: f64,
    pub error: f64,
    pub freedom: f64,
}

impl Estimate {
    /// From equally likely, independent replicas.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Estimate {
        let (mut n, mut mean, mut squares) = (0.0, 0.0, 0.0);
        for x in values {
            n += 1.0;
            let before = x - mean;
            mean += before / n;
            squares += before * (x - mean);
        }
        assert!(n >= 2.0, "a spread needs two values");
        Estimate { mean, error: (squares / (n * (n - 1.0))).sqrt(), freedom: n - 1.0 }
    }

    /// The difference of two independent estimates; degrees of freedom by Welch and Satterthwaite.
    pub fn minus(&self, other: &Estimate) -> Estimate {
        let (a, b) = (self.error * self.error, other.error * other.error);
        let spread = a * a / self.freedom + b * b / other.freedom;
        let freedom = if spread > 0.0 { (a + b) * (a + b) / spread } else { self.freedom.min(other.freedom) };
        Estimate { mean: self.mean - other.mean, error: (a + b).sqrt(), freedom }
    }
}

/// Fails where two sets of means differ by so many standard errors of their difference.
pub fn assert_same_means(what: &str, a: &[Estimate], b: &[Estimate], sigmas: f64) {
    assert_eq!(a.len(), b.len());
    for (k, (a, b)) in a.iter().zip(b).enumerate() {
        let difference = a.minus(b);
        let z = difference.mean / difference.error;
        assert!(z.abs() < sigmas, "{what}, channel {k}: {a:?} {b:?}, z = {z:.2}");
    }
}

/// Means over the pixels of an image, per channel, from values and their standard errors, [pixel][channel].
pub fn image_estimates(mean: &[f64], error: &[f64], channels: usize, freedom: f64) -> Vec<Estimate> {
    let pixels = (mean.len() / channels) as f64;
    let of = |values: &'_ [f64], k: usize, power: i32| {
        values.iter().skip(k).step_by(channels).map(|v| v.powi(power)).sum::<f64>()
    };
    let estimate =
        |k: usize| Estimate { mean: of(mean, k, 1) / pixels, error: of(error, k, 2).sqrt() / pixels, freedom };
    (0..channels).map(estimate).collect()
}

/// What a test allows: the standard error at most `resolution`, and a systematic error of at most `allowance`, both
/// relative to the expected value.
#[derive(Debug, Clone, Copy)]
pub struct Bound {
    pub resolution: f64,
    pub allowance: f64,
}

/// Every estimate equals what is expected.
pub fn assert_estimates(what: &str, estimates: &[Estimate], expected: &[f64], bound: Bound) {
    assert_eq!(estimates.len(), expected.len(), "{what}");
    let largest = estimates.iter().zip(expected).map(|(e, want)| e.error / (bound.resolution * want.abs()));
    report::resolution(what, largest.filter(|share| share.is_finite()).fold(0.0, f64::max));
    for (i, (e, want)) in estimates.iter().zip(expected).enumerate() {
        let Estimate { mean, error, freedom } = *e;
        assert!(
            error <= bound.resolution * want.abs(),
            "{what}, value {i}: standard error {error} too large for {want}"
        );
        let limit = t_limit(expected.len(), freedom) * error + bound.allowance * want.abs();
        assert!((mean - want).abs() <= limit, "{what}, value {i}: {mean} ± {error}, expected {want} within {limit}");
    }
}

/// Two estimators of the same values agree. `scale[i]`: what resolution and allowance of value i are relative to.
pub fn assert_agreement(what: &str, a: &[Estimate], b: &[Estimate], scale: &[f64], bound: Bound) {
    assert_eq!((a.len(), a.len()), (b.len(), scale.len()), "{what}");
    let shares = |of: &[Estimate]| {
        let largest = of.iter().zip(scale).map(|(e, scale)| e.error / (bound.resolution * scale));
        largest.filter(|share| share.is_finite()).fold(0.0, f64::max)
    };
    report::resolution(&format!("{what}, first"), shares(a));
    report::resolution(&format!("{what}, second"), shares(b));
    for (i, (a_i, b_i)) in a.iter().zip(b).enumerate() {
        let Estimate { mean, error, freedom } = a_i.minus(b_i);
        assert!(error <= bound.resolution * scale[i], "{what}, value {i}: standard error {error} of {}", scale[i]);
        let limit = t_limit(a.len(), freedom) * error + bound.allowance * scale[i];
        assert!(mean.abs() <= limit, "{what}, value {i}: {a_i:?} and {b_i:?} differ by {mean}, more than {limit}");
    }
}
