//! Irradiance and form factors (VALIDATION 1.7): a white Lambert surface shows E/π.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use spectile::scene::{Film, Filter, Projection, Scene, Sides};
use spectile::spectral::Channels;

use crate::device::{Settings, render};
use crate::scene_builder::*;
use crate::statistics::*;
use crate::{measure, table};

/// A small white patch at the origin, seen obliquely from above.
fn patch() -> Builder {
    Builder::new()
        .camera(look(DVec3::new(0.0, 0.05, 0.05), DVec3::ZERO, DVec3::X, narrow()))
        .diffuse(disk(DVec3::ZERO, DVec3::Z, 0.01), 1.0)
}

/// Relative error of an irradiance from a light at distance h: everything moves by the offset, relative to the scene.
fn irradiance_bound(h: f64) -> Bound {
    Bound { resolution: 0.005, allowance: 2.0 * ORIGIN_OFFSET * h.max(1.0) }
}

/// Points on the axis of a disk, E = π L R²/(R² + h²); half of it behind a screen; nothing from its dark side.
#[test]
#[expect(clippy::approx_constant, reason = "digits as published, compared with π/2")]
fn irradiance_of_a_disk() {
    for (h, published, seed) in [(1.0, 1.570796, 30), (2.0, 0.628319, 31), (10.0, 0.0311049, 32)] {
        let expected = PI / (1.0 + h * h);
        assert!((expected - published).abs() < 1e-6 * published.max(1.0), "the published digits");
        let lit = || patch().lamp(disk(h * DVec3::Z, DVec3::NEG_Z, 1.0), 1.0, Sides::Front);
        assert_estimates("disk", &measure(lit().build(), 2, seed), &[expected / PI], irradiance_bound(h));
        let screen = quad(DVec3::new(0.0, -9.0, 0.5 * h), 9.0 * DVec3::X, 18.0 * DVec3::Y);
        let scene = lit().black(screen).build();
        // The screen sets the scale of the scene: 9.
        let bound = Bound { resolution: 0.01, allowance: 2.0 * ORIGIN_OFFSET * 9.0 };
        assert_estimates("half a disk", &measure(scene, 2, seed), &[0.5 * expected / PI], bound);
        let scene = lit().lamp(disk(5.0 * DVec3::NEG_Z, DVec3::NEG_Z, 1.0), 1.0, Sides::Front).build();
        let bound = Bound { resolution: 0.01, allowance: 2.0 * ORIGIN_OFFSET * 7.5 };
        assert_estimates("dark side", &measure(scene, 2, seed), &[expected / PI], bound);
    }
}

/// A sphere of radius R whose centre is d away, straight above: E = π L (R/d)².
#[test]
fn irradiance_of_a_sphere() {
    for (distance, seed) in [(1.1, 39), (1.5, 40), (4.0, 41), (100.0, 42)] {
        let scene = patch().lamp(sphere(distance * DVec3::Z, 1.0), 2.0, Sides::Front).build();
        let expected = 2.0 / (distance * distance);
        assert_estimates("sphere", &measure(scene, 2, seed), &[expected], irradiance_bound(distance));
    }
}

/// A patch facing a centred square of side 2a at h = 1: F = (4/π) s atan s, s = a/√(1 + a²).
#[test]
fn irradiance_of_a_square() {
    for (side, published, seed) in [(2.0f64, 0.554126, 50), (1.0, 0.239456, 51)] {
        let x = 0.5 * side;
        let slope = x / (1.0 + x * x).sqrt();
        let expected = 4.0 / PI * slope * slope.atan();
        assert!((expected - published).abs() < 1e-6, "the published digits");
        let lamp = quad(DVec3::new(-x, x, 1.0), side * DVec3::X, side * DVec3::NEG_Y);
        let scene = patch().lamp(lamp, 1.0, Sides::Front).build();
        assert_estimates("square", &measure(scene, 2, seed), &[expected], irradiance_bound(1.0));
    }
}

/// An orthographic camera averages over a unit square (or a disk inside its 2 x 2 view): F₁₂ directly.
#[test]
fn form_factors_between_areas() {
    let above = |centre: DVec3, half: f64| {
        look(centre + 0.25 * DVec3::Z, centre, DVec3::Y, Projection::Orthographic { half_size: DVec2::splat(half) })
    };
    let floor = || quad(DVec3::ZERO, DVec3::X, DVec3::Y);
    let middle = DVec3::new(0.5, 0.5, 0.0);
    let averaged = |scene: Scene, seed| {
        let scene = Scene { film: Film { width: 4, height: 4, filter: Filter::Box, crop: [0, 0, 4, 4] }, ..scene };
        let rendered = render(&scene, 64, 64, Settings { seed, tile: [4, 4], ..Settings::default() });
        rendered.assert_clean();
        rendered.image_means()
    };
    let bound = Bound { resolution: 0.005, allowance: 4.0 * ORIGIN_OFFSET };

    for (distance, expected, seed) in [(1.0, 0.199825, 60), (0.5, 0.415253, 61)] {
        let scene = Builder::new()
            .camera(above(middle, 0.5))
            .diffuse(floor(), 1.0)
            .lamp(quad(distance * DVec3::Z, DVec3::Y, DVec3::X), 1.0, Sides::Front)
            .build();
        assert_estimates("opposed squares", &averaged(scene, seed), &[expected], bound);
    }
    let wall = quad(DVec3::ZERO, DVec3::Y, DVec3::Z);
    let scene = Builder::new().camera(above(middle, 0.5)).diffuse(floor(), 1.0).lamp(wall, 1.0, Sides::Front).build();
    assert_estimates("perpendicular squares", &averaged(scene, 62), &[0.200044], bound);

    for (radius, expected, seed) in [(1.0, 0.381966, 63), (2.0, 0.763932, 64)] {
        let scene = Builder::new()
            .camera(above(DVec3::ZERO, 1.0))
            .diffuse(disk(DVec3::ZERO, DVec3::Z, 1.0), 1.0)
            .lamp(disk(DVec3::Z, DVec3::NEG_Z, radius), 1.0, Sides::Front)
            .build();
        // The disk fills π/4 of the view; beyond it nothing is seen.
        assert_estimates("coaxial disks", &averaged(scene, seed), &[expected * PI / 4.0], bound);
    }
}

/// Lights of disjoint spectra and very different power: each channel has its own light's closed form.
#[test]
fn lights_of_disjoint_spectra() {
    let low = table(&[400.0, 500.0, 500.0, 600.0], &[1e6, 1e6, 0.0, 0.0]);
    let high = table(&[400.0, 500.0, 500.0, 600.0], &[0.0, 0.0, 1e-3, 1e-3]);
    let scene = patch()
        .channels(Channels::equal(400.0, 600.0, 2))
        .lamp(disk(2.0 * DVec3::Z, DVec3::NEG_Z, 0.5), low, Sides::Front)
        .lamp(disk(DVec3::Z, DVec3::Z, 0.1), high, Sides::Both)
        .build();
    // The near disk, r = 0.1 at 1 m, hides the far one, r = 0.5 at 2 m, within r = 0.2 of its plane.
    let seen = |r: f64, h: f64| r * r / (r * r + h * h);
    let expected = [1e6 * (seen(0.5, 2.0) - seen(0.2, 2.0)), 1e-3 * seen(0.1, 1.0)];
    assert_estimates("two lights", &measure(scene, 8, 70), &expected, irradiance_bound(2.0));
}
