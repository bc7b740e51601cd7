//! The reference path tracer against closed forms (docs/METHOD.md lists them).
//!
//! Two kinds of bound: where every single sample has the exact value, f64 rounding (stated as a multiple of ε); else
//! a two-sided z-test with the estimator's own standard error at [`ALPHA`] per test, Sidak-corrected over pixels x
//! channels, fixed seeds. Each z-test also states the largest relative standard error it may have, so that it cannot
//! pass by being blind.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use spectile::reference::Estimate;
use spectile::scene::{Filter, Projection, Scene, Shape, Sides};
use spectile::spectral::{Channels, Curve, planck};
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

use crate::scene_builder::closed_forms::{self, Case, form_factors, patch, patch_under_squares};
use crate::scene_builder::*;
use crate::truth::{render, render_image};

/// Probability that a right estimator fails one test.
const ALPHA: f64 = 1e-4;

/// Quantile for `count` two-sided comparisons at [`ALPHA`] together (Sidak 1967).
fn z_limit(count: usize) -> f64 {
    let each = -(-ALPHA).ln_1p() / count as f64;
    Normal::standard().inverse_cdf(1.0 + 0.5 * (-each).exp_m1())
}

/// Means equal `expected` within their standard errors, which are at most `resolution` of the expected values.
fn assert_z(estimate: &Estimate, expected: &[f64], resolution: f64) {
    assert_eq!(estimate.mean.len(), expected.len());
    let limit = z_limit(expected.len());
    for (i, ((mean, error), want)) in estimate.mean.iter().zip(&estimate.standard_error).zip(expected).enumerate() {
        assert!(*error <= resolution * want.abs(), "value {i}: standard error {error} too large for {want}");
        let rounding = 1e-12 * want.abs();
        assert!((mean - want).abs() <= limit * error + rounding, "value {i}: {mean} ± {error}, expected {want}");
    }
}

/// Every sample is `expected`, within `rounding` relative.
fn assert_exact(estimate: &Estimate, expected: &[f64], rounding: f64) {
    assert_eq!(estimate.mean.len(), expected.len());
    for (i, ((mean, error), want)) in estimate.mean.iter().zip(&estimate.standard_error).zip(expected).enumerate() {
        let bound = rounding * want.abs();
        assert!((mean - want).abs() <= bound, "value {i}: {mean}, expected {want}");
        assert!(*error <= bound, "value {i}: standard error {error} where every sample is {want}");
    }
}

fn one_pixel(scene: &Scene, samples: u32, seed: u64) -> Estimate {
    render(scene, &[[0, 0]], samples, seed)
}

/// Radiance after `vertices` surface vertices in a closed cavity.
fn cavity(emission: f64, reflectance: f64, vertices: i32) -> f64 {
    emission * (1.0 - reflectance.powi(vertices)) / (1.0 - reflectance)
}

// ---- Furnaces and cavities (1.1)

/// A convex body under a uniform sky L0 shows ρ L0 in every single sample, ρ = 1 included.
#[test]
fn furnace_convex() {
    let camera = look(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, DVec3::Y, narrow());
    for rho in [0.0, 0.18, 0.5, 1.0] {
        let scene = Builder::new().camera(camera.clone()).diffuse(sphere(DVec3::ZERO, 1.0), rho).sky(3.0).build();
        assert_exact(&one_pixel(&scene, 2000, 1), &[3.0 * rho], 1e-12);
    }
}

/// A white bowl, closed but for its top, shows L0 as soon as every path gets out: nothing is lost in corners, and the
/// spread of a constant is nothing but rounding.
#[test]
fn furnace_concave() {
    let (bottom, top) = (DVec3::ZERO, 2.0 * DVec3::Z);
    let scene = Builder::new()
        .camera(look(4.0 * DVec3::Z, DVec3::ZERO, DVec3::Y, Projection::Perspective { tan_half: DVec2::splat(0.2) }))
        .film(4, 4, Filter::Box)
        .diffuse(Shape::Cylinder { from: bottom, to: top, radius: 1.0 }, 1.0)
        .diffuse(disk(bottom, DVec3::Z, 1.0), 1.0)
        .sky(0.7)
        .bounces(10_000)
        .build();
    assert_exact(&render_image(&scene, 500, 2), &[0.7; 16], 1e-12);
}

/// Closed sphere: L_n = Le (1 - ρⁿ)/(1 - ρ) after n vertices, i.e. n - 1 bounces. Aiming at the sphere's area and
/// Lambert's law have the same density inside a sphere, so every sample is exact: the depth series to the last term.
#[test]
fn closed_sphere_depth_series() {
    for (rho, emission, vertices, published) in [
        (0.5, 0.5, 8, 0.996094),
        (0.5, 0.5, 1, 0.5),
        (0.5, 0.5, 64, 1.0),
        (0.8, 1.0, 8, 4.161139),
        (0.8, 1.0, 16, 4.859263),
        (0.8, 1.0, 32, 4.996039),
        (0.99, 1.0, 64, 47.44),
        (0.95, 1.0, 700, 20.0),
    ] {
        let expected = cavity(emission, rho, vertices);
        assert!((expected - published).abs() < 6e-4 * published, "the published digits");
        let scene = Builder::new()
            .camera(look(DVec3::new(0.2, 0.1, -0.3), DVec3::ONE, DVec3::Y, narrow()))
            .glowing(sphere(DVec3::new(0.0, 0.1, 0.0), 1.0), rho, emission, Sides::Both)
            .bounces(vertices as u32 - 1)
            .build();
        // Rays start 1e-12 R off the surface, which moves a density by 1e-12 R / distance: 1e-10 down to R/100, and
        // only 1 in 40,000 points is closer than that.
        assert_exact(&one_pixel(&scene, 500, 3), &[expected], 1e-10);
    }
}

/// Roulette is unbiased: ρ = 0.99 has L = 100 where 64 vertices alone give 47.
#[test]
fn roulette_reaches_the_limit() {
    let scene = Builder::new()
        .camera(look(DVec3::ZERO, DVec3::ONE, DVec3::Y, narrow()))
        .glowing(sphere(DVec3::ZERO, 1.0), 0.99, 1.0, Sides::Both)
        .bounces(100_000)
        .roulette(3)
        .build();
    assert_z(&one_pixel(&scene, 40_000, 4), &[100.0], 0.01);
}

/// The same law holds in any closed shape with any ρ_k, Le_k: a room with corners, and a can of cylinder and disks,
/// each channel with its own reflectance and emission, with and without roulette.
#[test]
fn closed_cavities_of_other_shapes() {
    let rho = [0.2, 0.5, 0.7, 0.9];
    let emission = [1.0, 0.0, 5.0, 0.1];
    let nm = [400.0, 500.0, 500.0, 600.0, 600.0, 700.0, 700.0, 800.0];
    let steps = |v: [f64; 4]| table(&nm, &v.map(|x| [x, x]).concat());
    let expected: Vec<f64> = (0..4).map(|k| cavity(emission[k], rho[k], 30)).collect();
    for roulette in [0, 2] {
        let base = || {
            Builder::new()
                .camera(look(DVec3::new(0.3, 0.2, 0.4), DVec3::new(1.0, 0.7, 0.9), DVec3::Y, narrow()))
                .channels(Channels::equal(400.0, 800.0, 4))
                .bounces(29)
                .roulette(roulette)
        };
        let min = DVec3::new(-1.0, -0.5, -0.7);
        let room = base().glowing(room(min, DVec3::ONE), steps(rho), steps(emission), Sides::Front).build();
        assert_z(&one_pixel(&room, 20_000, 5), &expected, 0.01);
        let (low, high) = (DVec3::new(0.0, 0.0, -1.0), DVec3::new(0.5, 0.2, 1.0));
        let axis = high - low;
        let wall = Shape::Cylinder { from: low, to: high, radius: 1.0 };
        let can = base()
            .glowing(wall, steps(rho), steps(emission), Sides::Both)
            .glowing(disk(low, axis, 1.0), steps(rho), steps(emission), Sides::Front)
            .glowing(disk(high, -axis, 1.0), steps(rho), steps(emission), Sides::Front)
            .build();
        assert_z(&one_pixel(&can, 20_000, 6), &expected, 0.01);
    }
}

#[test]
fn isothermal_cavity_is_black() {
    let (scene, expected) = closed_forms::isothermal_cavity(200);
    assert_z(&one_pixel(&scene, 10_000, 7), &expected, 0.014);
}

// ---- Parallel grey plates (1.2)

/// Disks of radius 1e5 one metre apart stand for infinite plates: 1e-10 of the hemisphere is missing.
#[test]
fn parallel_grey_plates() {
    for Case { scene, expected, seed } in closed_forms::grey_plates(1e5, 100) {
        assert_z(&one_pixel(&scene, 10_000, seed), &expected, 0.008);
    }
}

// ---- Spectra and channels

/// Mean radiance of a black body over overlapping bands, width x mean = the published band radiances.
#[test]
fn planck_bands() {
    for (kelvin, bands) in [
        (300.0, &[(3e3, 5e3, 1.865956), (8e3, 12e3, 38.50042), (8e3, 14e3, 54.93346), (380.0, 20e3, 107.8647)][..]),
        (900.0, &[(3e3, 5e3, 4250.709), (8e3, 12e3, 1297.147)][..]),
        (5778.0, &[(380.0, 20e3, 1.810209e7)][..]),
    ] {
        let scene = Builder::new()
            .channels(Channels::from_bounds(bands.iter().map(|b| [b.0, b.1]).collect(), None))
            .lamp(sphere(DVec3::ZERO, 0.5), Curve::Blackbody { kelvin, scale: 1.0 }, Sides::Front)
            .bounces(0)
            .build();
        // Seven published digits are well below the standard errors.
        let expected: Vec<f64> = bands.iter().map(|b| b.2 / (b.1 - b.0)).collect();
        assert_z(&one_pixel(&scene, 200_000, 20), &expected, 0.01);
    }
}

/// One wavelength a path for reflectance and emission alike: over a channel where both are ramps from 0 to 1 the
/// reflected mean is ∫x² = 1/3, not the product of means 1/4. A channel beside the tables' end sees the held value.
#[test]
fn products_of_spectra_are_averaged_by_wavelength() {
    let ramp = || table(&[500.0, 600.0], &[0.0, 1.0]);
    let scene = Builder::new()
        .channels(Channels::from_bounds(vec![[500.0, 600.0], [520.0, 530.0], [600.0, 700.0]], None))
        .diffuse(sphere(DVec3::ZERO, 0.5), ramp())
        .sky(ramp())
        .build();
    let cubes = |a: f64, b: f64| (b.powi(3) - a.powi(3)) / (3.0 * (b - a));
    assert_z(&one_pixel(&scene, 100_000, 21), &[cubes(0.0, 1.0), cubes(0.2, 0.3), 1.0], 0.01);
}

/// The tables of Planck's law that the cavities above rely on: 550 nm at 300 K is 3e-32 and stays finite in a render.
#[test]
fn faint_radiance_survives() {
    let scene = Builder::new()
        .channels(Channels::from_bounds(vec![[549.999, 550.001]], None))
        .diffuse(sphere(DVec3::ZERO, 0.5), 0.5)
        .sky(Curve::Blackbody { kelvin: 300.0, scale: 1.0 })
        .build();
    // d ln B / d λ is 0.17 per nm there: 2e-4 over half the channel.
    assert_exact(&one_pixel(&scene, 1000, 22), &[0.5 * planck::radiance(550.0, 300.0)], 2e-4);
}

// ---- Irradiance and form factors (1.7): a white Lambert surface shows E/π

/// Points on the axis of a disk, E = π L R²/(R² + h²), and the same below half of it.
#[test]
#[expect(clippy::approx_constant, reason = "digits as published, compared with π/2")]
fn irradiance_of_a_disk() {
    for (h, published, seed) in [(1.0, 1.570796, 30), (2.0, 0.628319, 31), (10.0, 0.0311049, 32)] {
        let expected = PI / (1.0 + h * h);
        assert!((expected - published).abs() < 1e-6 * published.max(1.0), "the published digits");
        let base = || patch().lamp(disk(h * DVec3::Z, DVec3::NEG_Z, 1.0), 1.0, Sides::Front);
        assert_z(&one_pixel(&base().build(), 60_000, seed), &[expected / PI], 0.01);
        // A screen hides the half at x > 0, by symmetry half of E.
        let screen = quad(DVec3::new(0.0, -9.0, 0.5 * h), 9.0 * DVec3::X, 18.0 * DVec3::Y);
        assert_z(&one_pixel(&base().black(screen).build(), 60_000, seed), &[0.5 * expected / PI], 0.02);
        // Lit from the wrong side: nothing.
        let scene = base().lamp(disk(5.0 * DVec3::NEG_Z, DVec3::NEG_Z, 1.0), 1.0, Sides::Front).build();
        assert_z(&one_pixel(&scene, 60_000, seed + 100), &[expected / PI], 0.02);
    }
}

/// A sphere of radius R whose centre is d away, straight above: E = π L (R/d)².
#[test]
fn irradiance_of_a_sphere() {
    for (distance, seed) in [(1.5, 40), (4.0, 41)] {
        let scene = patch().lamp(sphere(distance * DVec3::Z, 1.0), 2.0, Sides::Front).build();
        assert_z(&one_pixel(&scene, 60_000, seed), &[2.0 / (distance * distance)], 0.01);
    }
}

#[test]
fn irradiance_of_a_square() {
    for Case { scene, expected, seed } in patch_under_squares() {
        assert_z(&one_pixel(&scene, 60_000, seed), &expected, 0.01);
    }
}

#[test]
fn form_factors_between_areas() {
    for Case { scene, expected, seed } in form_factors() {
        assert_z(&one_pixel(&scene, 60_000, seed), &expected, 0.01);
    }
}

#[test]
fn lights_of_disjoint_spectra() {
    let Case { scene, expected, seed } = closed_forms::lights_of_disjoint_spectra();
    assert_z(&one_pixel(&scene, 200_000, seed), &expected, 0.01);
}

// ---- Sides, cameras, film

/// What each side of a surface shows: emission and reflection, from the front and from the back.
#[test]
fn sides() {
    let plate = || disk(DVec3::ZERO, DVec3::Z, 1.0);
    for (from, front) in [(DVec3::Z, true), (DVec3::NEG_Z, false)] {
        let base = || Builder::new().camera(look(from, DVec3::ZERO, DVec3::Y, narrow()));
        let shown = |scene: Scene| one_pixel(&scene, 200, 80).mean[0];
        let only_front = |x: f64| if front { x } else { 0.0 };
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-14 * b;
        assert_eq!(shown(base().lamp(plate(), 2.0, Sides::Front).build()), only_front(2.0));
        assert_eq!(shown(base().lamp(plate(), 2.0, Sides::Both).build()), 2.0);
        assert!(close(shown(base().diffuse(plate(), 0.5).sky(3.0).build()), 1.5));
        assert!(close(shown(base().one_sided(plate(), 0.5).sky(3.0).build()), only_front(1.5)));
        assert_eq!(shown(base().black(plate()).sky(3.0).build()), 0.0);
        // No scattering at depth 0: a reflecting surface is black, the sky is seen directly.
        assert_eq!(shown(base().diffuse(plate(), 0.5).sky(3.0).bounces(0).build()), 0.0);
        assert_eq!(shown(base().sky(3.0).bounces(0).build()), 3.0);
    }
}

/// Row 0 is the top, columns run along `right`; a crop shows the same pixels with the same random numbers.
#[test]
fn orientation_and_crop() {
    for projection in [
        Projection::Perspective { tan_half: DVec2::new(0.4, 0.3) },
        Projection::ThinLens { tan_half: DVec2::new(0.4, 0.3), aperture_radius: 0.01, focus_distance: 10.0 },
        Projection::Orthographic { half_size: DVec2::new(4.0, 3.0) },
    ] {
        // Ten metres away the film measures 8 x 6 m, a pixel 1 m: the ball fills part of pixel (6, 1) only.
        let camera = look(DVec3::new(0.0, 0.0, 10.0), DVec3::ZERO, DVec3::Y, projection);
        let ball = sphere(DVec3::new(2.5, 1.5, 0.0), 0.3);
        let mut scene = Builder::new().camera(camera).film(8, 6, Filter::Box).lamp(ball, 1.0, Sides::Front).build();
        let whole = render_image(&scene, 100, 90);
        for (i, mean) in whole.mean.iter().enumerate() {
            assert_eq!(*mean > 0.0, i == 8 + 6, "pixel {i}: {mean}");
        }
        scene.film.crop = [5, 1, 8, 3];
        let crop = render_image(&scene, 100, 90);
        assert_eq!(crop.mean, [&whole.mean[13..16], &whole.mean[21..24]].concat());
        // Mirrored: the ball is on the other side.
        scene.camera.right = -scene.camera.right;
        assert!(render(&scene, &[[1, 1]], 100, 90).mean[0] > 0.0);
    }
}

/// A bright half plane seen by the Gaussian filter: pixels beside the edge show the cut normal distribution.
#[test]
fn gaussian_filter_at_an_edge() {
    let half_plane = quad(DVec3::new(0.0, -50.0, 0.0), 50.0 * DVec3::X, 100.0 * DVec3::Y);
    let projection = Projection::Orthographic { half_size: DVec2::new(4.0, 0.5) };
    let scene = Builder::new()
        .camera(look(DVec3::Z, DVec3::ZERO, DVec3::Y, projection))
        .film(8, 1, Filter::Gaussian)
        .lamp(half_plane, 1.0, Sides::Front)
        .bounces(0)
        .build();
    let normal = Normal::new(0.0, 0.5).unwrap();
    let cut = |x: f64| (normal.cdf(x.clamp(-2.0, 2.0)) - normal.cdf(-2.0)) / (1.0 - 2.0 * normal.cdf(-2.0));
    let estimate = render_image(&scene, 50_000, 91);
    // Pixel centres at -3.5 … 3.5; those within 2 px of the edge are mixed.
    let expected: Vec<f64> = (2..6).map(|x| cut(f64::from(x) - 3.5)).collect();
    let inner = Estimate {
        mean: estimate.mean[2..6].to_vec(),
        standard_error: estimate.standard_error[2..6].to_vec(),
        samples: estimate.samples,
    };
    assert_z(&inner, &expected, 0.15);
    assert_eq!((&estimate.mean[..2], &estimate.mean[6..]), (&[0.0; 2][..], &[1.0; 2][..]));
}

/// A disk of radius r off the focal plane: seen from the lens point p through the axis, hit where |p| |1 - D/f| < r.
#[test]
fn thin_lens_blur() {
    let (aperture, focus) = (0.5, 4.0);
    for (distance, radius, seed) in [(2.0, 0.2, 92), (6.0, 0.1, 93), (4.0, 1e-3, 94)] {
        let lens =
            Projection::ThinLens { tan_half: DVec2::splat(1e-9), aperture_radius: aperture, focus_distance: focus };
        let scene = Builder::new()
            .camera(look(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, lens))
            .lamp(disk(distance * DVec3::NEG_Z, DVec3::Z, radius), 1.0, Sides::Front)
            .bounces(0)
            .build();
        let blur = aperture * f64::abs(1.0 - distance / focus);
        let expected = if blur > radius { (radius / blur).powi(2) } else { 1.0 };
        assert_z(&one_pixel(&scene, 50_000, seed), &[expected], 0.02);
    }
}

// ---- The estimator itself

/// Standard errors are honest: over 400 seeds Σz² follows chi-square, two-sided at [`ALPHA`].
#[test]
fn standard_errors_are_calibrated() {
    const RUNS: u64 = 400;
    let expected = 0.5;
    let scene = Builder::new()
        .camera(look(DVec3::new(0.0, 0.05, 0.05), DVec3::ZERO, DVec3::X, narrow()))
        .diffuse(disk(DVec3::ZERO, DVec3::Z, 0.01), 1.0)
        .lamp(disk(DVec3::Z, DVec3::NEG_Z, 1.0), 1.0, Sides::Front)
        .build();
    let squares: f64 = (0..RUNS)
        .map(|seed| {
            let estimate = one_pixel(&scene, 2000, seed);
            ((estimate.mean[0] - expected) / estimate.standard_error[0]).powi(2)
        })
        .sum();
    let chi = ChiSquared::new(RUNS as f64).unwrap();
    let (low, high) = (chi.inverse_cdf(ALPHA / 2.0), chi.inverse_cdf(1.0 - ALPHA / 2.0));
    assert!((low..high).contains(&squares), "{squares} outside {low}..{high}");
}

/// A scene without objects or light is black and does not fail; an image has K values a pixel.
#[test]
fn empty_scene() {
    let scene = Builder::new().film(3, 2, Filter::Box).channels(Channels::equal(400.0, 700.0, 5)).build();
    assert_exact(&render_image(&scene, 4, 0), &[0.0; 30], 0.0);
}
