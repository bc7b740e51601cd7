//! Closed forms that a sensor must meet.

use std::path::Path;

use super::detect::{Clipped, Electronics};
use super::{Bands, Figures};
use crate::scene::{Seen, SensorModel, parse_sensor};
use crate::spectral::Channels;
use crate::{Error, Result};

fn parsed(text: &str, channels: &Channels) -> Result<SensorModel> {
    parse_sensor(text, Path::new("sensor.toml"), channels, Seen::default())
}

const MWIR: &str = "
[optics]
f_number = 2.5
transmittance = 0.85
[detector]
pitch = 15e-6
fill_factor = 0.9
integration_time = 2e-3
quantum_efficiency = 0.8
dark_current = 5e4
read_noise = 100
gain = 400
bits = 14
[[bands]]
name = \"MWIR\"
from = 3000
to = 5000
";

const LWIR: &str = "
[optics]
f_number = 1
transmittance = 0.9
[detector]
kind = \"thermal\"
pitch = 17e-6
fill_factor = 0.8
absorptance = 0.85
responsivity = 4e11
noise_equivalent_power = 3e-12
bits = 16
[[bands]]
name = \"LWIR\"
from = 8000
to = 14000
";

/// Electrons, or W, of a black body at 300 K.
const MWIR_SIGNAL: f64 = 1.447681399e+06;
/// K.
const MWIR_NETD: f64 = 2.333786073e-02;
/// Electrons, or W, of a black body at 300 K.
const LWIR_SIGNAL: f64 = 7.630906130e-09;
/// K.
const LWIR_NETD: f64 = 2.651227168e-02;

/// π τ L A t / (4 N²) x QE x (λ₂² - λ₁²) / 2hc, whether channels end where the band does, overlap, or not.
#[test]
fn flat_radiance_makes_the_electrons_of_the_closed_form() {
    let area_time = 15e-6f64.powi(2) * 0.9 * 2e-3;
    // λ in m where it is the photon's, in nm where it is the interval's.
    let photons = 0.5 * (5000.0f64.powi(2) - 3000.0f64.powi(2)) * 1e-9 / (6.626_070_15e-34 * 299_792_458.0);
    let expected = std::f64::consts::PI / (4.0 * 2.5 * 2.5) * 0.85 * 0.8 * area_time * photons;
    let overlapping = Channels::from_bounds(vec![[2900.0, 4200.0], [3900.0, 5100.0], [3000.0, 5000.0]], None);
    for channels in [Channels::equal(2000.0, 6000.0, 37), Channels::equal(3000.0, 5000.0, 1), overlapping] {
        let model = parsed(MWIR, &channels).expect("a model");
        let bands = Bands::new(&model, &channels);
        let found = bands.bands[0].sensitivity();
        // Sums of tens of terms in f64.
        assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
        // Σ∫λ² / Σ∫λ.
        let centre = 2.0 / 3.0 * (5000.0f64.powi(3) - 3000.0f64.powi(3)) / (5000.0f64.powi(2) - 3000.0f64.powi(2));
        assert!((bands.bands[0].centre / centre - 1.0).abs() < 1e-12);
    }
}

/// Against Simpson's rule over 20,000 intervals and a difference of 0.1 K, in Python: central differences err by 1e-8.
#[test]
fn netd_at_300_kelvin_is_that_of_theory() {
    let channels = Channels::equal(2000.0, 15_000.0, 1300);
    for (text, signal, netd) in [(MWIR, MWIR_SIGNAL, MWIR_NETD), (LWIR, LWIR_SIGNAL, LWIR_NETD)] {
        let model = parsed(text, &channels).expect("a model");
        let bands = Bands::new(&model, &channels).bands;
        let electronics = Electronics { model: &model, seed: 0, noise: true };
        let figures = Figures::new(&electronics, &bands[0], 1.0);
        assert!((bands[0].black_body[0] / signal - 1.0).abs() < 1e-6, "{} {signal}", bands[0].black_body[0]);
        let found = figures.netd.expect("a thermal band");
        assert!((found / netd - 1.0).abs() < 1e-6, "{found} {netd}");
    }
}

/// Warm optics fill the hemisphere, or the cone of their cold shield: 4 N² times less. They emit what they do not let through.
#[test]
fn a_cold_shield_takes_the_warm_optics_out() {
    let channels = Channels::equal(2000.0, 6000.0, 40);
    let background = |keys: &str| {
        let text = MWIR.replace("[optics]", &format!("[optics]\n{keys}"));
        let model = parsed(&text, &channels).expect("a model");
        let band = Bands::new(&model, &channels).bands.swap_remove(0);
        (band.background, band.black_body[0])
    };
    assert_eq!(background("").0, 0.0);
    let (hemisphere, seen) = background("temperature = 300");
    // The same black body through the F-number's cone, with τ for 1 - τ.
    let expected = seen * 4.0 * 2.5 * 2.5 * (1.0 - 0.85) / 0.85;
    assert!((hemisphere / expected - 1.0).abs() < 1e-12, "{hemisphere} {expected}");
    let (shielded, _) = background("temperature = 300\ncold_shield = 2.5");
    assert!((hemisphere / shielded / 25.0 - 1.0).abs() < 1e-12, "{hemisphere} {shielded}");
}

/// Photon transfer: temporal variance against mean has the slope 1/gain and begins at (read/gain)² + 1/12; what pixels differ
/// by grows as the square of PRNU. Of 90,000 pixels a variance has the standard error sqrt(2/90,000) = 0.5 %, so a line through
/// eight of them is within 1 % by more than three standard errors.
#[test]
fn photon_transfer_shows_gain_read_noise_and_prnu() {
    const SIDE: u32 = 300;
    let channels = Channels::equal(2000.0, 6000.0, 40);
    let text = MWIR.replace("gain = 400", "gain = 2.5\nprnu = 0.01\noffset = 200").replace("dark_current = 5e4", "");
    let model = parsed(&text.replace("read_noise = 100", "read_noise = 20"), &channels).expect("a model");
    let frame = |seed: u64, light: f64| -> Vec<f64> {
        let electronics = Electronics { model: &model, seed, noise: true };
        let mut clipped = Clipped::default();
        let pixels = (0..SIDE * SIDE).map(|i| [i % SIDE, i / SIDE]);
        let counts = pixels.map(|pixel| electronics.count(light, pixel, 0, &mut clipped).into()).collect();
        assert_eq!(clipped, Clipped::default());
        counts
    };
    let n = f64::from(SIDE * SIDE);
    let measure = |light: f64| {
        let (a, b) = (frame(1, light), frame(2, light));
        let mean = a.iter().sum::<f64>() / n;
        let temporal = a.iter().zip(&b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / (2.0 * n);
        let total = a.iter().map(|a| (a - mean) * (a - mean)).sum::<f64>() / (n - 1.0);
        (mean - 200.0, temporal, total)
    };
    let (dark, floor, _) = measure(0.0);
    // Three standard errors of the mean, 8 / 300.
    assert!(dark.abs() < 0.08, "{dark}");
    let expected = (20.0f64 / 2.5).powi(2) + 1.0 / 12.0;
    assert!((floor / expected - 1.0).abs() < 0.015, "{floor} {expected}");
    // Each level's slope from the floor has the standard error 0.5 %, their mean a third of it.
    let levels: Vec<_> = (1..=8).map(|i| measure(4000.0 * f64::from(i))).collect();
    let slopes: f64 = levels.iter().map(|(mean, variance, _)| (variance - expected) / mean).sum::<f64>() / 8.0;
    assert!((slopes * 2.5 - 1.0).abs() < 0.01, "{slopes}");
    let (mean, temporal, total) = levels[7];
    let prnu = (total - temporal).sqrt() / mean;
    assert!((prnu / 0.01 - 1.0).abs() < 0.015, "{prnu}");
}

/// Full wells, and both ends of the converter, are counted; nothing wraps.
#[test]
fn what_is_clipped_is_counted() {
    let channels = Channels::equal(2000.0, 6000.0, 40);
    let model = parsed(&MWIR.replace("bits = 14", "bits = 14\nfull_well = 1e6"), &channels).expect("a model");
    let electronics = Electronics { model: &model, seed: 1, noise: true };
    let mut clipped = Clipped::default();
    let count = electronics.count(1e9, [0, 0], 0, &mut clipped);
    // 1e6 electrons in full, and six standard deviations of reading.
    assert!((f64::from(count) - 2500.0).abs() <= 1.0 + 6.0 * 0.25, "{count}");
    assert_eq!(clipped, Clipped { full_wells: 1, above: 0, below: 0 });
    let low = parsed(&MWIR.replace("bits = 14", "bits = 4"), &channels).expect("a model");
    let electronics = Electronics { model: &low, seed: 1, noise: true };
    assert_eq!(electronics.count(1e9, [0, 0], 0, &mut clipped), 15);
    assert_eq!(clipped, Clipped { full_wells: 1, above: 1, below: 0 });
}

/// Every mistake with its line and key.
#[test]
fn wrong_models_are_refused_by_name() {
    let channels = Channels::equal(2000.0, 6000.0, 40);
    for (from, to, key, words) in [
        ("f_number = 2.5", "f_number = 0.2", "optics.f_number", "0.5 or greater"),
        ("f_number = 2.5", "focal_length = 0.1", "optics", "f_number"),
        ("f_number = 2.5", "f_number = 2.5\npsf = \"airy\"", "optics.psf", "gaussian"),
        ("bits = 14", "bits = 40", "detector.bits", "1 to 24"),
        ("bits = 14", "bits = 14\nresponsivity = 1", "detector.responsivity", "not for photon"),
        ("gain = 400", "", "detector.gain", "missing"),
        ("quantum_efficiency = 0.8", "quantum_efficiency = 1.8", "detector.quantum_efficiency", "1"),
        ("to = 5000", "to = 2000", "bands.0", "no interval"),
        ("pitch = 15e-6", "pich = 15e-6", "detector.pich", "unknown key"),
        ("pitch = 15e-6", "pitch = 15", "detector.pitch", "at most 0.1 (m)"),
    ] {
        let error = parsed(&MWIR.replace(from, to), &channels).expect_err(to);
        let Error::Input(problems) = error else { panic!("{to}: {error}") };
        let found = problems.iter().find(|problem| problem.key.as_deref() == Some(key));
        let found = found.unwrap_or_else(|| panic!("{to}: {problems:?}"));
        assert!(found.line.is_some(), "{to}: {found:?}");
        assert!(found.message.contains(words) || found.help.as_ref().is_some_and(|h| h.contains(words)), "{found:?}");
    }
}
