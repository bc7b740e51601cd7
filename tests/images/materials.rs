//! Metals, glass, plastic and blends on the device: closed forms, furnaces, and the f64 reference, which shares no code
//! with it.
//!
//! Bounds as in `statistics`: a two-sided t-test, Sidak-corrected over the values of a test, plus a stated allowance; and
//! a largest standard error.

use glam::{DVec2, DVec3};
use spectile::scene::{Filter, Projection, Scene, Shape, Sides};
use spectile::spectral::{Channels, Curve, Outside};

use crate::device::{Settings, render};
use crate::scene_builder::closed_forms::Case;
use crate::scene_builder::surfaces::*;
use crate::scene_builder::*;
use crate::size;
use crate::statistics::{Bound, Estimate, assert_agreement, assert_estimates};
use crate::truth::{self, render_image};

/// Directional albedos of rough surfaces are within this (tables of `scattering`; each surface's own furnace).
const TABLE: f64 = 1e-3;

fn shown(scene: &Scene, epochs: u32, samples: u32, seed: u64) -> Vec<Estimate> {
    let settings = Settings { seed, tile: [4, 4], ..Settings::default() };
    let ours = render(scene, epochs, samples, settings);
    ours.assert_clean();
    ours.values()
}

#[test]
fn slab_of_all_orders() {
    for Case { scene, expected, seed } in slab(60) {
        let bound = Bound { resolution: 0.01, allowance: 1e-4 };
        assert_estimates("slab", &shown(&scene, 16, 768, seed), &expected, bound);
    }
}

#[test]
fn prism_at_minimum_deviation() {
    for (line, Case { scene, expected, seed }) in prism().into_iter().enumerate() {
        let shown = shown(&scene, 32, 512, seed);
        for (k, estimate) in shown.iter().enumerate().filter(|(k, _)| *k != line) {
            assert_eq!(estimate.mean, 0.0, "line {k} at the lamp of line {line}");
        }
        let bound = Bound { resolution: 0.015, allowance: 1e-4 };
        assert_estimates("prism", &shown[line..=line], &expected[line..=line], bound);
    }
}

/// Reflectances by angle, a sky of radiance 1 mirrored by a plane over a black one: s and p by Fresnel's
/// equations, with Brewster's angle for three indices; and metals.
#[test]
fn reflectances_by_angle() {
    type Add = fn(Builder, Shape) -> Builder;
    let water: Add = |b, s| b.dielectric(s, 1.333, 0.0);
    let crown: Add = |b, s| b.dielectric(s, 1.5, 0.0);
    let germanium: Add = |b, s| b.dielectric(s, 4.0, 0.0);
    let silver: Add = |b, s| b.conductor(s, 0.2, 3.4, [0.0; 2]);
    let infrared: Add = |b, s| b.conductor(s, 12.0, 50.0, [0.0; 2]);
    for (add, degrees, [rs, rp]) in [
        (crown, 0.0, [0.04, 0.04]),
        (germanium, 0.0, [0.36, 0.36]),
        (crown, 45.0, [0.092013, 0.008466]),
        (crown, 60.0, [0.176571, 0.001802]),
        (crown, 80.0, [0.538595, 0.236814]),
        (water, 53.1232, [0.078271, 0.0]),
        (crown, 56.3099, [0.147929, 0.0]),
        (germanium, 75.9638, [0.778547, 0.0]),
        (silver, 0.0, [0.938462, 0.938462]),
        (silver, 60.0, [0.969688, 0.895381]),
        (infrared, 80.0, [0.996854, 0.901770]),
    ] {
        let scene = mirrored(add, degrees, false);
        // Half a digit of the published numbers; the tables decide with which chance, not with which value.
        let bound = Bound { resolution: 0.03, allowance: 3e-4 };
        assert_estimates(&format!("{degrees} degrees"), &shown(&scene, 32, 1024, 115), &[0.5 * (rs + rp)], bound);
    }
}

/// From inside glass: total reflection from the critical angle on (41.8103 degrees for 1.5, 48.6066 for
/// 1.333, 14.4775 for 4), and less than total before it.
#[test]
fn critical_angles() {
    for (n, critical) in [(1.5, 41.8103), (1.333, 48.6066), (4.0, 14.4775)] {
        for beyond in [0.1, 1.0, 20.0] {
            let scene = mirrored(|b, s| b.dielectric(s, n, 0.0), critical + beyond, true);
            // Next to the critical angle the table still decides for refraction now and then, in vain.
            let bound = Bound { resolution: 0.01, allowance: 1e-4 };
            let what = format!("{n} at {critical} + {beyond} degrees");
            assert_estimates(&what, &shown(&scene, 32, 256, 116), &[1.0], bound);
        }
        let degrees: f64 = critical - 0.5;
        let (sin, cos) = degrees.to_radians().sin_cos();
        let beyond = (1.0 - (n * sin).powi(2)).sqrt();
        let [s, p] = [(n * cos - beyond) / (n * cos + beyond), (cos - n * beyond) / (cos + n * beyond)];
        let scene = mirrored(|b, s| b.dielectric(s, n, 0.0), degrees, true);
        let bound = Bound { resolution: 0.01, allowance: 1e-4 };
        assert_estimates("before", &shown(&scene, 32, 1024, 117), &[0.5 * (s * s + p * p)], bound);
    }
}

/// A smooth plane at z = 0 seen at `degrees` from its normal. Seen from outside: a sky of radiance 1, a black plane below;
/// from inside: a lamp of radiance 1 below, nothing above.
fn mirrored(add: impl Fn(Builder, Shape) -> Builder, degrees: f64, inside: bool) -> Scene {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let eye = DVec3::new(sin, 0.1 * f64::EPSILON, if inside { -cos } else { cos });
    let plane = |z: f64, half: f64| quad(DVec3::new(-half, -half, z), 2.0 * half * DVec3::X, 2.0 * half * DVec3::Y);
    let base = Builder::new().camera(look(eye, DVec3::ZERO, DVec3::Y, narrow())).bounces(1);
    let base = add(base, plane(0.0, 50.0));
    match inside {
        false => base.sky(1.0).black(plane(-1.0, 100.0)).build(),
        true => base.lamp(plane(-2.0, 100.0), 1.0, Sides::Front).build(),
    }
}

/// White surfaces under a white sky disappear. A path of n events is off by n times the tables' error at most: one on a
/// ball that nothing enters, some four on average in rough glass. Of what enters a ball of glass less than 0.2^18 is there
/// after 40 bounces.
#[test]
fn white_balls_under_a_white_sky() {
    let bound = |events: f64| Bound { resolution: 0.01, allowance: events * TABLE + 1e-4 };
    let glass = |n: f64, alpha: f64| under_white_sky(|b, ball| b.dielectric(ball, n, alpha), 40);
    for n in [1.05, 2.4] {
        assert_estimates("glass", &shown(&glass(n, 0.0), 16, 256, 120), &[1.0; 9], bound(0.0));
    }
    for alpha in size::first(1, [1.0, 0.1]) {
        assert_estimates("frosted glass", &shown(&glass(1.5, alpha), 16, 1024, 121), &[1.0; 9], bound(4.0));
        let scene = under_white_sky(|b, ball| white_metal(b, ball, [alpha; 2]), 10);
        assert_estimates("metal", &shown(&scene, 16, 512, 122), &[1.0; 9], bound(1.0));
        let scene = under_white_sky(|b, ball| b.plastic(ball, 1.0, 1.5, alpha), 10);
        assert_estimates("plastic", &shown(&scene, 16, 512, 123), &[1.0; 9], bound(1.0));
    }
    let scene = under_white_sky(|b, ball| b.plastic(ball, 1.0, 1.5, 0.0), 10);
    assert_estimates("varnish", &shown(&scene, 16, 1024, 124), &[1.0; 9], bound(0.0));
}

/// Where light is aimed at as well as met: both ways of finding it, through a boundary too, weigh 1 together.
#[test]
fn white_balls_in_a_glowing_room() {
    let bound = Bound { resolution: 0.012, allowance: 4.0 * TABLE + 1e-4 };
    let opaque = Bound { allowance: TABLE + 1e-4, ..bound };
    for alpha in size::first(1, [0.3, 0.0]) {
        let scene = in_glowing_room(|b, ball| b.dielectric(ball, 1.5, alpha), 40);
        assert_estimates("glass", &shown(&scene, 16, 320, 140), &[1.0; 9], bound);
        let scene = in_glowing_room(|b, ball| white_metal(b, ball, [alpha; 2]), 10);
        assert_estimates("metal", &shown(&scene, 16, 320, 141), &[1.0; 9], opaque);
        let scene = in_glowing_room(|b, ball| b.plastic(ball, 1.0, 1.5, alpha), 10);
        assert_estimates("plastic", &shown(&scene, 16, 320, 142), &[1.0; 9], opaque);
    }
    for roughness in size::first(1, [0.2, 0.01]) {
        let mut scene = in_glowing_room(|b, ball| b.dielectric(ball, glass_curve(), roughness), 40);
        scene.channels = Channels::equal(400.0, 700.0, 3);
        let bound = Bound { resolution: 0.03, ..bound };
        assert_estimates("dispersive", &shown(&scene, 32, 320, 143), &[1.0; 27], bound);
    }
    let blended = |b: Builder, ball: Shape| {
        let b = white_metal(b, ball.clone(), [0.3; 2]).dielectric(ball.clone(), 1.5, 0.2);
        b.blend_of_last_two(ball, 0.5)
    };
    let scene = in_glowing_room(blended, 40);
    assert_estimates("blend", &shown(&scene, 16, 448, 144), &[1.0; 9], bound);
}

/// From inside glass a white sky has radiance n².
#[test]
fn radiance_inside_glass() {
    for (roughness, allowance) in [(0.0, 1e-4), (0.3, 4.0 * TABLE)] {
        let mut scene = under_white_sky(|b, ball| b.dielectric(ball, 1.5, roughness), 40);
        scene.camera = look(DVec3::new(0.1, 0.2, 0.3), DVec3::new(0.4, 0.1, 1.0), DVec3::Y, narrow());
        scene.film.crop = [1, 1, 2, 2];
        let estimate = shown(&scene, 32, 128, 150);
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
    let mut scene = under_white_sky(blended, 10);
    scene.film.crop = [1, 1, 2, 2];
    let shown = shown(&scene, 2, 64, 160);
    let expected = 0.75 * 0.8 + 0.25 * 0.2;
    assert!((shown[0].mean / expected - 1.0).abs() < 1e-6, "{shown:?}");
}

/// Rough metals beyond the ends of their tables, which are held, and at the ends of what n and k may be: no sample is bad, on a device
/// or in the reference, and none sends on more than it gets.
#[test]
fn rough_metals_are_finite_outside_their_tables() {
    let ends = |a: f64, b: f64| Curve::Linear { nm: vec![500.0, 600.0], value: vec![a, b], outside: Outside::Hold };
    let metals = [(ends(0.05, 0.3), ends(3.4, 120.0)), (ends(1e-3, 1e-3), ends(0.0, 1e-6))]
        .into_iter()
        .chain([(ends(1000.0, 1e-3), ends(1000.0, 1000.0)), (ends(1.0, 1.0), ends(0.0, 1e-4))]);
    let bounds = vec![[380.0, 400.0], [499.0, 601.0], [779.0, 780.0], [19_000.0, 20_000.0]];
    let mut builder = Builder::new()
        .camera(look(
            DVec3::new(0.0, 0.0, 3.0),
            DVec3::ZERO,
            DVec3::Y,
            Projection::Perspective { tan_half: DVec2::splat(0.5) },
        ))
        .film(8, 8, Filter::Box)
        .channels(Channels::from_bounds(bounds, None))
        .bounces(4)
        .sky(1.0);
    for (i, (eta, k)) in metals.enumerate() {
        let at = DVec3::new(0.7 * f64::from(i as u32 % 2) - 0.35, 0.7 * f64::from(i as u32 / 2) - 0.35, 0.0);
        builder = builder.conductor(sphere(at, 0.33), eta, k, [0.3; 2]);
    }
    let scene = builder.build();
    let rendered = render(&scene, 1, 64, Settings::default());
    rendered.assert_clean();
    let theirs = render_image(&scene, 64, 1);
    let ours = rendered.means[0].iter().map(|value| f64::from(*value)).collect();
    for values in [ours, theirs.mean] {
        let means = (0..4).map(|k| values.iter().skip(k).step_by(4).sum::<f64>() / 64.0);
        assert!(values.iter().all(|value| value.is_finite() && *value >= 0.0), "{values:?}");
        assert!(means.clone().all(|mean| mean < 1.0 + TABLE), "{:?}", means.collect::<Vec<_>>());
    }
}

// ---- Against the reference, per pixel and channel

/// Welch's t-test, Sidak over pixels x channels, and over channels for the image; the largest standard errors relative to the
/// channel's mean over the image.
fn against_reference(what: &str, scene: &Scene, samples: u32, reference: u32, [pixel, image]: [f64; 2]) {
    let ours = render(scene, 32, samples, Settings { seed: 31, tile: [8, 8], ..Settings::default() });
    ours.assert_clean();
    let theirs = render_image(scene, reference, 32);
    let freedom = f64::from(reference - 1);
    let theirs: Vec<Estimate> = (theirs.mean.iter().zip(&theirs.standard_error))
        .map(|(&mean, &error)| Estimate { mean, error, freedom })
        .collect();
    let channels = scene.channels.len();
    let pixels = theirs.len() / channels;
    let means: Vec<f64> = (0..channels)
        .map(|k| theirs.iter().skip(k).step_by(channels).map(|e| e.mean).sum::<f64>() / pixels as f64)
        .collect();
    let scales: Vec<f64> = (0..theirs.len()).map(|i| means[i % channels]).collect();
    assert_agreement(what, &ours.values(), &theirs, &scales, Bound { resolution: pixel, allowance: 4.0 * TABLE });
    let of_image = |values: &[Estimate], k: usize| {
        let of_channel = || values.iter().skip(k).step_by(channels);
        let error = of_channel().map(|e| e.error * e.error).sum::<f64>().sqrt() / pixels as f64;
        Estimate { mean: of_channel().map(|e| e.mean).sum::<f64>() / pixels as f64, error, freedom }
    };
    let (our, their): (Vec<_>, Vec<_>) = (0..channels).map(|k| (ours.image_means()[k], of_image(&theirs, k))).unzip();
    assert_agreement(&format!("{what}, image"), &our, &their, &means, Bound { resolution: image, allowance: TABLE });
}

/// A slanted spectrum over the visible.
fn slanted(blue: f64, red: f64) -> Curve {
    Curve::Linear { nm: vec![400.0, 700.0], value: vec![blue, red], outside: Outside::Hold }
}

/// A ball and a plate of one material in a diffuse room with a lamp; four channels.
fn room_with(add: impl Fn(Builder, Shape) -> Builder) -> Scene {
    let wide = Projection::Perspective { tan_half: DVec2::splat(0.6) };
    let b = Builder::new()
        .camera(look(DVec3::new(0.1, 0.2, 2.9), DVec3::new(0.0, -0.2, 0.0), DVec3::Y, wide))
        .film(6, 6, Filter::Box)
        .channels(Channels::equal(400.0, 700.0, 4))
        .diffuse(room(DVec3::new(-1.0, -1.0, -1.0), DVec3::new(1.0, 1.0, 3.0)), slanted(0.3, 0.7))
        .lamp(quad(DVec3::new(-0.5, 0.99, -0.5), DVec3::X, DVec3::Z), slanted(4.0, 2.0), Sides::Front)
        .bounces(6);
    let b = add(b, sphere(DVec3::new(-0.35, -0.5, -0.2), 0.45));
    let plate = quad(DVec3::new(0.2, -0.9, 0.6), DVec3::new(0.6, 0.0, -0.3), DVec3::new(0.0, 0.9, -0.2));
    add(b, plate).build()
}

#[test]
fn opaque_materials_are_those_of_the_reference() {
    type Add = fn(Builder, Shape) -> Builder;
    let metal: Add = |b, s| b.conductor(s, slanted(0.2, 1.2), slanted(3.4, 2.0), [0.0; 2]);
    let rough: Add = |b, s| b.conductor(s, slanted(0.2, 1.2), slanted(3.4, 2.0), [0.4; 2]);
    let varnish: Add = |b, s| b.plastic(s, slanted(0.1, 0.8), slanted(1.6, 1.4), 0.0);
    let plastic: Add = |b, s| b.plastic(s, slanted(0.1, 0.8), slanted(1.6, 1.4), 0.3);
    let blend: Add = |b, s| {
        let b = b.conductor(s.clone(), slanted(0.2, 1.2), 3.4, [0.2; 2]).diffuse(s.clone(), slanted(0.8, 0.1));
        b.blend_of_last_two(s, 0.6)
    };
    let materials =
        [("blend", blend), ("plastic", plastic), ("varnish", varnish), ("rough metal", rough), ("metal", metal)];
    for (what, add) in size::first(3, materials) {
        against_reference(what, &room_with(add), 128, 2048, [0.35, 0.02]);
    }
}

#[test]
fn glass_is_that_of_the_reference() {
    type Add = fn(Builder, Shape) -> Builder;
    let clear: Add = |b, s| b.dielectric(s, 1.5, 0.0);
    let frosted: Add = |b, s| b.dielectric(s, 1.5, 0.3);
    let dispersive: Add = |b, s| b.dielectric(s, slanted(1.7, 1.4), 0.0);
    let narrow: Add = |b, s| b.dielectric(s, slanted(1.7, 1.4), 0.05);
    let wide: Add = |b, s| b.dielectric(s, slanted(1.52, 1.48), 0.4);
    let glasses =
        [("narrow", narrow), ("frosted", frosted), ("dispersive", dispersive), ("wide", wide), ("clear", clear)];
    for (what, add) in size::first(3, glasses) {
        against_reference(what, &room_with(add), 128, 4096, [0.7, 0.04]);
    }
}

/// Six channels of one path, of which refraction leaves one, or which share rough directions, have the means of the
/// reference.
#[test]
fn dispersion_is_unbiased() {
    for roughness in size::first(2, [0.02, 0.0, 0.15]) {
        let scene = dispersive_ball(Channels::equal(400.0, 700.0, 6), roughness);
        against_reference(&format!("roughness {roughness}"), &scene, 192, 8_000, [0.15, 0.06]);
    }
}

/// Two roughnesses follow the quad's edges: a lamp beside the mirror image shows along the rough direction; turning the
/// plate turns the picture.
#[test]
fn anisotropy_follows_the_edges() {
    let of = |turned, along_x, seed| shown(&brushed_plate(turned, along_x), 32, 256, seed);
    let (rough, fine) = (of(false, true, 180), of(false, false, 181));
    assert!(rough[0].mean > 10.0 * fine[0].mean, "{rough:?} {fine:?}");
    let bound = Bound { resolution: 0.03, allowance: 1e-3 };
    assert_agreement("along the rough edge", &of(true, false, 182), &rough, &[rough[0].mean], bound);
    assert_agreement("along the fine edge", &of(true, true, 183), &fine, &[fine[0].mean], bound);
    for along_x in [true, false] {
        let theirs = truth::render(&brushed_plate(false, along_x), &[[0, 0]], 40_000, 184);
        let theirs = [Estimate { mean: theirs.mean[0], error: theirs.standard_error[0], freedom: 39_999.0 }];
        let ours = if along_x { &rough } else { &fine };
        assert_agreement("anisotropic", ours, &theirs, &[theirs[0].mean], Bound { resolution: 0.05, allowance: 1e-3 });
    }
}
