//! The reference path tracer on metals, glass and plastic: closed forms, furnaces, and dispersion with and without
//! stopping channels.
//!
//! Bounds as in `statistics`: a two-sided t-test, Sidak-corrected over the values of a test, plus a stated allowance; and
//! a largest standard error.

use glam::DVec3;
use spectile::scene::{Scene, Shape, Sides};
use spectile::spectral::Channels;

use crate::scene_builder::closed_forms::Case;
use crate::scene_builder::surfaces::*;
use crate::scene_builder::*;
use crate::statistics::{Bound, Estimate, assert_agreement, assert_estimates};
use crate::truth::{render, render_image};

/// Directional albedos of rough surfaces are within this (tables of `scattering`; each surface's own furnace).
const TABLE: f64 = 1e-3;

fn estimates(e: &spectile::reference::Estimate) -> Vec<Estimate> {
    let freedom = f64::from(e.samples - 1);
    e.mean.iter().zip(&e.standard_error).map(|(&mean, &error)| Estimate { mean, error, freedom }).collect()
}

fn shown(scene: &Scene, samples: u32, seed: u64) -> Vec<Estimate> {
    estimates(&render_image(scene, samples, seed))
}

#[test]
fn slab_of_all_orders() {
    for Case { scene, expected, seed } in slab(60) {
        assert_estimates("slab", &shown(&scene, 40_000, seed), &expected, Bound { resolution: 0.01, allowance: 0.0 });
    }
}

#[test]
fn prism_at_minimum_deviation() {
    for (line, Case { scene, expected, seed }) in prism().into_iter().enumerate() {
        let shown = shown(&scene, 40_000, seed);
        for (k, estimate) in shown.iter().enumerate().filter(|(k, _)| *k != line) {
            assert_eq!(estimate.mean, 0.0, "line {k} at the lamp of line {line}");
        }
        let bound = Bound { resolution: 0.01, allowance: 0.0 };
        assert_estimates("prism", &shown[line..=line], &expected[line..=line], bound);
    }
}

/// White surfaces under a white sky disappear. A path of n events is off by n times the tables' error at most: one on a
/// ball that nothing enters, some four on average in rough glass.
#[test]
fn white_balls_under_a_white_sky() {
    let bound = |events: f64| Bound { resolution: 0.006, allowance: events * TABLE };
    for n in [1.05, 1.5, 2.4] {
        let scene = under_white_sky(|b, ball| b.dielectric(ball, n, 0.0), 2000);
        assert_estimates("glass", &shown(&scene, 40_000, 120), &[1.0; 9], bound(0.0));
    }
    for alpha in [0.1, 0.5, 1.0] {
        let scene = under_white_sky(|b, ball| b.dielectric(ball, 1.5, alpha), 2000);
        assert_estimates("frosted glass", &shown(&scene, 40_000, 121), &[1.0; 9], bound(4.0));
        let scene = under_white_sky(|b, ball| white_metal(b, ball, [alpha; 2]), 10);
        assert_estimates("metal", &shown(&scene, 20_000, 122), &[1.0; 9], bound(1.0));
        let scene = under_white_sky(|b, ball| b.plastic(ball, 1.0, 1.5, alpha), 10);
        assert_estimates("plastic", &shown(&scene, 20_000, 123), &[1.0; 9], bound(1.0));
    }
    let scene = under_white_sky(|b, ball| b.plastic(ball, 1.0, 1.5, 0.0), 10);
    assert_estimates("varnish", &shown(&scene, 20_000, 124), &[1.0; 9], bound(0.0));
}

/// Roulette and channels that stop keep the balance too.
#[test]
fn dispersive_white_balls_with_roulette() {
    for (roughness, bound) in [(0.0, 0.0), (0.4, 4.0 * TABLE)] {
        let mut scene = under_white_sky(|b, ball| b.dielectric(ball, glass_curve(), roughness).roulette(2), 2000);
        scene.channels = Channels::equal(400.0, 700.0, 5);
        let bound = Bound { resolution: 0.02, allowance: bound };
        assert_estimates("dispersive", &shown(&scene, 40_000, 130), &[1.0; 45], bound);
    }
}

/// Where light is aimed at as well as met: both ways of finding it, through a boundary too, weigh 1 together.
#[test]
fn white_balls_in_a_glowing_room() {
    let bound = Bound { resolution: 0.01, allowance: 4.0 * TABLE };
    let opaque = Bound { allowance: TABLE, ..bound };
    for alpha in [0.0, 0.05, 0.3, 1.0] {
        let scene = in_glowing_room(|b, ball| b.dielectric(ball, 1.5, alpha), 2000);
        assert_estimates("glass", &shown(&scene, 20_000, 140), &[1.0; 9], bound);
        let scene = in_glowing_room(|b, ball| white_metal(b, ball, [alpha; 2]), 10);
        assert_estimates("metal", &shown(&scene, 20_000, 141), &[1.0; 9], opaque);
        let scene = in_glowing_room(|b, ball| b.plastic(ball, 1.0, 1.5, alpha), 10);
        assert_estimates("plastic", &shown(&scene, 20_000, 142), &[1.0; 9], opaque);
    }
    let mut scene = in_glowing_room(|b, ball| b.dielectric(ball, glass_curve(), 0.2), 2000);
    scene.channels = Channels::equal(400.0, 700.0, 3);
    assert_estimates("dispersive", &shown(&scene, 20_000, 143), &[1.0; 27], bound);
    let blended = |b: Builder, ball: Shape| {
        let b = white_metal(b, ball.clone(), [0.3; 2]).dielectric(ball.clone(), 1.5, 0.2);
        b.blend_of_last_two(ball, 0.5)
    };
    let scene = in_glowing_room(blended, 2000);
    assert_estimates("blend", &shown(&scene, 20_000, 144), &[1.0; 9], bound);
}

/// From inside glass a white sky has radiance n².
#[test]
fn radiance_inside_glass() {
    for (roughness, allowance) in [(0.0, 0.0), (0.3, 4.0 * TABLE)] {
        let mut scene = under_white_sky(|b, ball| b.dielectric(ball, 1.5, roughness), 2000);
        scene.camera = look(DVec3::new(0.1, 0.2, 0.3), DVec3::new(0.4, 0.1, 1.0), DVec3::Y, narrow());
        let estimate = estimates(&render(&scene, &[[1, 1]], 40_000, 150));
        assert_estimates("inside", &estimate, &[2.25], Bound { resolution: 0.01, allowance });
    }
}

/// A blend reflects its parts by their shares: under a white sky (1 - w) ρ of black and white.
#[test]
fn blends_reflect_by_share() {
    let blended = |b: Builder, ball: Shape| {
        let b = b.diffuse(ball.clone(), 0.8).diffuse(ball.clone(), 0.2);
        b.blend_of_last_two(ball, 0.25)
    };
    let shown = estimates(&render(&under_white_sky(blended, 10), &[[1, 1]], 1000, 160));
    assert!((shown[0].mean - (0.75 * 0.8 + 0.25 * 0.2)).abs() < 1e-12, "{shown:?}");
}

/// Six channels of one path, of which refraction leaves one (or, where rough, which share their directions), have the
/// means of six renders of one channel, where none has to stop: within 3.5 standard errors in 24 comparisons.
#[test]
fn dispersion_is_unbiased() {
    for (roughness, samples, resolution) in [(0.0, 240_000, 0.02), (0.15, 40_000, 0.02)] {
        let all = Channels::equal(400.0, 700.0, 6);
        let together = shown(&dispersive_ball(all.clone(), roughness), samples, 170);
        for k in 0..6 {
            let alone = Channels::from_bounds(vec![all.bounds[k]], None);
            let alone = shown(&dispersive_ball(alone, roughness), samples / 5, 171 + k as u64);
            for (pixel, alone) in alone.iter().enumerate() {
                let together = &together[6 * pixel + k];
                let difference = together.minus(alone);
                let z = difference.mean / difference.error;
                assert!(difference.error < resolution * alone.mean, "{alone:?} {together:?}");
                assert!(z.abs() < 3.5, "roughness {roughness}, pixel {pixel}, channel {k}: {together:?} and {alone:?}");
            }
        }
    }
}

/// Two roughnesses follow the quad's edges: a lamp beside the mirror image shows along the rough direction; turning the
/// plate turns the picture.
#[test]
fn anisotropy_follows_the_edges() {
    let of = |turned, along_x, seed| shown(&brushed_plate(turned, along_x), 20_000, seed);
    let (rough, fine) = (of(false, true, 180), of(false, false, 181));
    assert!(rough[0].mean > 10.0 * fine[0].mean, "{rough:?} {fine:?}");
    let bound = Bound { resolution: 0.03, allowance: 0.0 };
    assert_agreement("along the rough edge", &of(true, false, 182), &rough, &[rough[0].mean], bound);
    assert_agreement("along the fine edge", &of(true, true, 183), &fine, &[fine[0].mean], bound);
}

/// A rough metal with loss, where nothing is known beforehand: everything above a plate glows with radiance 1, once as a
/// lamp around it, which is aimed at and met, once as the sky, which is only met.
#[test]
fn a_lamp_in_a_rough_mirror() {
    let camera = || look(DVec3::new(2.0, 0.0, 2.0), DVec3::ZERO, DVec3::Z, narrow());
    let plate = || quad(DVec3::new(-1.0, -1.0, 0.0), 2.0 * DVec3::X, 2.0 * DVec3::Y);
    for roughness in [[0.1, 0.1], [0.1, 0.4]] {
        let base = || Builder::new().camera(camera()).conductor(plate(), 0.2, 3.4, roughness);
        let lamp = base().lamp(sphere(DVec3::ZERO, 10.0), 1.0, Sides::Both).build();
        let sky = base().sky(1.0).build();
        let (lamp, sky) = (shown(&lamp, 40_000, 190), shown(&sky, 40_000, 191));
        let bound = Bound { resolution: 0.005, allowance: 0.0 };
        assert_agreement("lamp and sky", &lamp, &sky, &[sky[0].mean], bound);
    }
}
