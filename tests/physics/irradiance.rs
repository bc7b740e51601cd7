//! Irradiance and form factors (docs/METHOD.md, Closed forms): a white Lambert surface shows E/π.

use std::f64::consts::PI;

use glam::DVec3;
use spectile::scene::{Film, Filter, Scene, Sides};

use super::measure;
use crate::device::{Settings, render};
use crate::scene_builder::closed_forms::{self, Case, form_factors, patch, patch_under_squares};
use crate::scene_builder::*;
use crate::statistics::*;

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

#[test]
fn irradiance_of_a_square() {
    for Case { scene, expected, seed } in patch_under_squares() {
        assert_estimates("square", &measure(scene, 2, seed), &expected, irradiance_bound(1.0));
    }
}

#[test]
fn form_factors_between_areas() {
    let averaged = |scene: Scene, seed| {
        let scene = Scene { film: Film { width: 4, height: 4, filter: Filter::Box, crop: [0, 0, 4, 4] }, ..scene };
        let rendered = render(&scene, 64, 64, Settings { seed, tile: [4, 4], ..Settings::default() });
        rendered.assert_clean();
        rendered.image_means()
    };
    let bound = Bound { resolution: 0.005, allowance: 4.0 * ORIGIN_OFFSET };
    for (i, Case { scene, expected, seed }) in form_factors().into_iter().enumerate() {
        assert_estimates(&format!("form factor {i}"), &averaged(scene, seed), &expected, bound);
    }
}

#[test]
fn lights_of_disjoint_spectra() {
    let Case { scene, expected, seed } = closed_forms::lights_of_disjoint_spectra();
    assert_estimates("two lights", &measure(scene, 8, seed), &expected, irradiance_bound(2.0));
}
