//! Pearson's test of counts against what is expected.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::Bench;

/// Probability that a case with nothing wrong fails (Sidak 1967, over all of its tests).
const ALPHA: f64 = 1e-4;

/// The probability of counts as far from `expected` as these, or further. Cells with less than 10 expected count as one; where there
/// are still less, only a count that is an error by itself says anything.
pub fn p_value(counts: &[f64], expected: &[f64]) -> f64 {
    let (mut chi2, mut cells, mut few) = (0.0, 0, [0.0; 2]);
    for (count, want) in counts.iter().zip(expected) {
        if *want < 10.0 {
            few = [few[0] + count, few[1] + want];
        } else {
            chi2 += (count - want).powi(2) / want;
            cells += 1;
        }
    }
    if few[1] >= 10.0 {
        chi2 += (few[0] - few[1]).powi(2) / few[1];
        cells += 1;
    } else if few[0] >= few[1] + 8.0 * (few[1] + 1.0).sqrt() {
        return 0.0;
    }
    match ChiSquared::new(f64::from(cells - 1)) {
        Ok(distribution) => distribution.sf(chi2),
        Err(_) => 1.0,
    }
}

/// A test that gave `p`, of `tests` in its case: how improbable, in powers of ten.
pub fn check(bench: &mut Bench, what: String, p: f64, tests: usize) {
    let limit = -((-ALPHA).ln_1p() / tests as f64).exp_m1();
    // Where f64 has no number for it.
    let digits = -p.max(1e-300).log10();
    bench.check_within(format!("{what}: -log10 p"), 0.0, (digits, 0.0), -limit.log10());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn p_values_are_those_of_tables() {
        // Of one degree of freedom 3.841 has 5 %, and of two 9.210 has 1 %.
        let off = (3.841_458_8f64 * 50.0 / 2.0).sqrt();
        assert!((p_value(&[50.0 + off, 50.0 - off], &[50.0; 2]) - 0.05).abs() < 1e-6);
        let off = (9.210_340_4f64 * 20.0 / 2.0).sqrt();
        assert!((p_value(&[20.0 + off, 20.0 - off, 20.0], &[20.0; 3]) - 0.01).abs() < 1e-6);
        // Ten cells of 5 are one of 50, beside one of 50.
        let mut counts = [5.0; 11];
        counts[10] = 50.0;
        assert_eq!(p_value(&counts, &[5.0, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0, 50.0]), 1.0);
        // A count where none can be.
        assert_eq!(p_value(&[100.0, 9.0], &[100.0, 0.0]), 0.0);
    }
}
