//! Cosine transforms: what a picture is that is continued beyond its edges by mirroring, as waves.

use std::f64::consts::PI;
use std::sync::Arc;

use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlannerScalar};

/// Of rows of one length: X_k = Σ x_i cos(π k (2 i + 1) / 2n), of frequency k / 2n cycles a value, and back (DCT-II and DCT-III, by one
/// complex transform of the same length: Makhoul 1980).
pub struct Cosine {
    forward: Arc<dyn Fft<f64>>,
    inverse: Arc<dyn Fft<f64>>,
    /// e^(-iπk/2n).
    turns: Vec<Complex<f64>>,
}

/// What a thread keeps between rows.
#[derive(Default)]
pub struct Work {
    values: Vec<Complex<f64>>,
    scratch: Vec<Complex<f64>>,
}

impl Cosine {
    pub fn new(n: usize) -> Cosine {
        let mut planner = FftPlannerScalar::new();
        let turns = (0..n).map(|k| Complex::from_polar(1.0, -PI * k as f64 / (2 * n) as f64)).collect();
        Cosine { forward: planner.plan_fft_forward(n), inverse: planner.plan_fft_inverse(n), turns }
    }

    /// In place.
    pub fn forward(&self, row: &mut [f64], work: &mut Work) {
        let n = row.len();
        work.values.resize(n, Complex::default());
        for (i, pair) in row.chunks(2).enumerate() {
            work.values[i] = Complex::new(pair[0], 0.0);
            if let Some(&odd) = pair.get(1) {
                work.values[n - 1 - i] = Complex::new(odd, 0.0);
            }
        }
        work.run(&*self.forward);
        for ((out, value), turn) in row.iter_mut().zip(&work.values).zip(&self.turns) {
            *out = (value * turn).re;
        }
    }

    /// In place: what [`Cosine::forward`] was applied to.
    pub fn inverse(&self, row: &mut [f64], work: &mut Work) {
        let n = row.len();
        work.values.resize(n, Complex::default());
        for k in 0..n {
            let mirrored = if k == 0 { 0.0 } else { row[n - k] };
            work.values[k] = self.turns[k].conj() * Complex::new(row[k], -mirrored);
        }
        work.run(&*self.inverse);
        let scale = 1.0 / n as f64;
        for (i, pair) in row.chunks_mut(2).enumerate() {
            pair[0] = scale * work.values[i].re;
            if let Some(odd) = pair.get_mut(1) {
                *odd = scale * work.values[n - 1 - i].re;
            }
        }
    }
}

impl Work {
    fn run(&mut self, transform: &dyn Fft<f64>) {
        self.scratch.resize(transform.get_inplace_scratch_len(), Complex::default());
        transform.process_with_scratch(&mut self.values, &mut self.scratch);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transforms_are_sums_of_cosines_and_come_back() {
        for n in [1usize, 2, 3, 8, 13, 20, 101] {
            let row: Vec<f64> = (0..n).map(|i| ((7 * i * i + 3) % 11) as f64 - 4.0).collect();
            let (cosine, mut work, mut found) = (Cosine::new(n), Work::default(), row.clone());
            cosine.forward(&mut found, &mut work);
            for (k, found) in found.iter().enumerate() {
                let wave = |i: usize| (PI * k as f64 * (2 * i + 1) as f64 / (2 * n) as f64).cos();
                let sum: f64 = row.iter().enumerate().map(|(i, value)| value * wave(i)).sum();
                // Sums of n numbers of about 5, in f64.
                assert!((found - sum).abs() < 1e-12 * n as f64, "{n} {k}: {found} {sum}");
            }
            cosine.inverse(&mut found, &mut work);
            assert!(found.iter().zip(&row).all(|(a, b)| (a - b).abs() < 1e-13 * n as f64), "{n}: {found:?}");
        }
    }
}
