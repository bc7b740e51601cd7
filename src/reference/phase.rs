//! Where matter scatters light, one wavelength at a time.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::bsdf::SpectralValues;
use super::rng::Rng;
use crate::scene::{Phase, PhaseTable};

/// P / 4π for light that is turned from `from` to `to`, both unit vectors, in channel `k`.
pub fn density(phase: &Phase, spectra: &SpectralValues, k: usize, from: DVec3, to: DVec3) -> f64 {
    let cosine = from.dot(to).clamp(-1.0, 1.0);
    let value = match phase {
        Phase::HenyeyGreenstein(g) => {
            let g = spectra.value(*g, k);
            (1.0 - g * g) / (1.0 + g * g - 2.0 * g * cosine).powf(1.5)
        }
        Phase::Rayleigh { depolarisation } => {
            let gamma = depolarisation / (2.0 - depolarisation);
            3.0 / (4.0 * (1.0 + 2.0 * gamma)) * (1.0 + 3.0 * gamma + (1.0 - gamma) * cosine * cosine)
        }
        Phase::Table(table) => table.value(from.angle_between(to).to_degrees(), spectra.wavelength(k)),
    };
    value / (4.0 * PI)
}

/// A direction with that density.
pub fn sample(phase: &Phase, spectra: &SpectralValues, k: usize, from: DVec3, rng: &mut Rng) -> DVec3 {
    let angle = match phase {
        Phase::HenyeyGreenstein(g) => {
            let (g, u) = (spectra.value(*g, k), rng.uniform());
            if g.abs() < 1e-4 {
                // To first order in g: what is left out is 1e-8.
                let x = 2.0 * u - 1.0;
                (x + 1.5 * g * (1.0 - x * x)).clamp(-1.0, 1.0).acos()
            } else {
                let s = (1.0 - g * g) / (1.0 - g + 2.0 * g * u);
                ((1.0 + g * g - s * s) / (2.0 * g)).clamp(-1.0, 1.0).acos()
            }
        }
        // By rejection: it is nowhere above 3/2.
        Phase::Rayleigh { .. } => loop {
            let cosine: f64 = 2.0 * rng.uniform() - 1.0;
            let to = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
            if 1.5 * rng.uniform() < 4.0 * PI * density(phase, spectra, k, DVec3::Z, to) {
                break cosine.acos();
            }
        },
        Phase::Table(table) => sample_table(table, spectra.wavelength(k), rng.uniform()),
    };
    let (around, azimuth) = (from.any_orthonormal_pair(), TAU * rng.uniform());
    let side = azimuth.cos() * around.0 + azimuth.sin() * around.1;
    (angle.cos() * from + angle.sin() * side).normalize()
}

/// The angle up to which share `u` of what is scattered goes: by the integral of P sinθ, whose inverse is found by bisection.
fn sample_table(table: &PhaseTable, nm: f64, u: f64) -> f64 {
    let angles: Vec<f64> = table.degrees.iter().map(|degrees| degrees.to_radians()).collect();
    let values: Vec<f64> = table.degrees.iter().map(|&degrees| table.value(degrees, nm)).collect();
    // ∫ (p + slope (θ - from)) sinθ dθ between `from` and `to`.
    let integral = |i: usize, to: f64| {
        let from = angles[i];
        let slope = (values[i + 1] - values[i]) / (angles[i + 1] - from);
        let primitive = |x: f64| -(values[i] + slope * (x - from)) * x.cos() + slope * x.sin();
        primitive(to) - primitive(from)
    };
    let parts: Vec<f64> = (0..angles.len() - 1).map(|i| integral(i, angles[i + 1])).collect();
    let mut left = u * parts.iter().sum::<f64>();
    let mut i = 0;
    while i + 1 < parts.len() && left > parts[i] {
        left -= parts[i];
        i += 1;
    }
    let (mut low, mut high) = (angles[i], angles[i + 1]);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if integral(i, middle) < left { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}
