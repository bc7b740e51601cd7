//! Black bodies and products of spectra over channels, at the wavelengths of Eq. 4 of Hoarau et al. 2018.

use glam::DVec3;
use spectile::scene::{Sampler, Sides};
use spectile::spectral::{Channels, Curve};

use super::measure;
use crate::scene_builder::*;
use crate::statistics::*;

/// Mean radiance of a black body over overlapping bands, width x mean = the published band radiances.
#[test]
fn planck_bands() {
    for (kelvin, bands) in [
        (300.0, &[(3e3, 5e3, 1.865956), (8e3, 12e3, 38.50042), (8e3, 14e3, 54.93346), (380.0, 20e3, 107.8647)][..]),
        (900.0, &[(3e3, 5e3, 4250.709), (8e3, 12e3, 1297.147)][..]),
        (5778.0, &[(380.0, 20e3, 1.810209e7)][..]),
    ] {
        let mut scene = Builder::new()
            .channels(Channels::from_bounds(bands.iter().map(|b| [b.0, b.1]).collect(), None))
            .lamp(sphere(DVec3::ZERO, 0.5), Curve::Blackbody { kelvin, scale: 1.0 }, Sides::Front)
            .bounces(0)
            .build();
        // Stratified: 64 independent wavelengths alone would leave 1 % of the sun's curve over 20 um.
        scene.integrator.sampler = Sampler::Sobol;
        let expected: Vec<f64> = bands.iter().map(|b| b.2 / (b.1 - b.0)).collect();
        // The tables' bound is 1e-5; seven published digits.
        let bound = Bound { resolution: 0.005, allowance: 1.1e-5 };
        assert_estimates("Planck bands", &measure(scene, 8, 20), &expected, bound);
    }
}

/// 550 nm at 300 K is 3.19e-32: far below the visible, and still normal in f32. At 200 K it underflows, which is 0.
#[test]
fn faint_radiance_survives() {
    let lamp = |kelvin| {
        let scene = Builder::new()
            .channels(Channels::from_bounds(vec![[549.999, 550.001]], None))
            .lamp(sphere(DVec3::ZERO, 0.5), Curve::Blackbody { kelvin, scale: 1.0 }, Sides::Front)
            .bounces(0)
            .build();
        measure(scene, 2, 22)
    };
    // d ln B / dλ is 0.17 per nm there: 1.7e-4 over half the channel.
    assert_estimates("faint", &lamp(300.0), &[3.193330e-32], Bound { resolution: 1e-4, allowance: 1e-5 });
    assert_eq!(lamp(150.0)[0].mean, 0.0);
}

/// One wavelength a path for reflectance and emission alike: where both are ramps from 0 to 1 the reflected mean is
/// ∫x² = 1/3, not the product of means 1/4.
#[test]
fn products_of_spectra_are_averaged_by_wavelength() {
    let ramp = || table(&[500.0, 600.0], &[0.0, 1.0]);
    let mut scene = Builder::new()
        .channels(Channels::from_bounds(vec![[500.0, 600.0], [520.0, 530.0], [600.0, 700.0]], None))
        .diffuse(sphere(DVec3::ZERO, 0.5), ramp())
        .sky(ramp())
        .build();
    scene.integrator.sampler = Sampler::Sobol;
    let cubes = |a: f64, b: f64| (b.powi(3) - a.powi(3)) / (3.0 * (b - a));
    let bound = Bound { resolution: 0.0003, allowance: 1e-5 };
    assert_estimates("ramps", &measure(scene, 4, 21), &[cubes(0.0, 1.0), cubes(0.2, 0.3), 1.0], bound);
}
