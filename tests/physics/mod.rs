//! The GPU renderer against closed forms (docs/METHOD.md lists them).
//!
//! Bounds as in `statistics`: Student t at ALPHA = 1e-4 per test, Sidak over channels, fixed seeds, plus a stated f32
//! allowance. Resolutions of 0.2 to 0.4 % mean that a wrong factor of 1 to 2 % in any of these would fail.

mod anchors;
mod cavities;
mod irradiance;
mod sides;
mod spectra;

use spectile::scene::Scene;

use crate::device::{Settings, measure, render};

/// Every pixel of every epoch has the expected value in every channel.
fn assert_exact(what: &str, scene: &Scene, samples: u32, expected: f64, allowance: f64) {
    let rendered = render(scene, 2, samples, Settings { seed: 1, ..Settings::default() });
    rendered.assert_clean();
    for value in rendered.means.iter().flatten() {
        let error = (f64::from(*value) / expected - 1.0).abs();
        assert!(error <= allowance, "{what}: {value} instead of {expected}, {error:e}");
    }
}
