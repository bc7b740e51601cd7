//! Techniques at surfaces (docs/METHOD.md, Techniques): lobes among which channels choose by chances of their own, and rough boundaries that
//! bend them apart; in closed forms, against the f64 reference, which has one wavelength at a time, and against paths that one rule decides.

use glam::{DVec2, DVec3};
use spectile::device::prepared::Prepared;
use spectile::scene::{Emission, Evaluator, Field, Filter, Mesh, Phase, Projection, Scene, Shape, Sides, TextureKind};
use spectile::spectral::{Channels, Curve};

use crate::device::{Settings, assert_as_reference, render};
use crate::scene_builder::*;
use crate::size;
use crate::statistics::{Bound, Estimate, assert_estimates};

/// How many techniques decide.
fn techniques(scene: &Scene) -> usize {
    Prepared::new(scene, 0).expect("a scene that fits").techniques.count()
}

/// Relative variances of a sample, and means: 128 x 128 pixels that see one point, `epochs` times one sample.
fn spread(scene: &Scene, epochs: u32) -> (Vec<f64>, Vec<Estimate>) {
    let mut scene = scene.clone();
    (scene.film.width, scene.film.height, scene.film.crop) = (128, 128, [0, 0, 128, 128]);
    let rendered = render(&scene, epochs, 1, Settings::default());
    rendered.assert_clean();
    let means = rendered.replicas();
    let samples = f64::from(epochs) * 16_384.0;
    (means.iter().map(|e| e.error.powi(2) * samples / e.mean.powi(2)).collect(), means)
}

fn demanding(mut scene: Scene, techniques: u32) -> Scene {
    scene.integrator.techniques = Some(techniques);
    scene
}

/// In each of five channels, what the inner of two balls reflects and what it lets through: 0.95 in all.
const SIDES: [[f64; 2]; 5] = [[0.9025, 0.0475], [0.0475, 0.9025], [0.475, 0.475], [0.95, 0.0], [0.0, 0.95]];

/// Two balls, one in the other, that all glow with 1 on both sides and send on 0.95 of what they get: from within, after n vertices,
/// (1 - 0.95^n) / 0.05.
fn glowing_balls(bounces: u32) -> (Scene, f64) {
    let ((channels, reflected), (_, transmitted)) =
        (by_channel(&SIDES.map(|s| s[0])), by_channel(&SIDES.map(|s| s[1])));
    let b = Builder::new().camera(look(DVec3::new(0.1, 0.2, 0.3), DVec3::X, DVec3::Y, narrow())).channels(channels);
    let b = b.bounces(bounces).glowing(sphere(DVec3::ZERO, 1.2), 0.95, 1.0, Sides::Both);
    let mut scene = b.translucent(sphere(DVec3::ZERO, 1.0), reflected, transmitted).build();
    let radiance = scene.objects[0].emission.as_ref().expect("a ball that glows").radiance;
    scene.objects[1].emission = Some(Emission { radiance, sides: Sides::Both, texture: None });
    (scene, (1.0 - 0.95f64.powi(bounces as i32 + 1)) / 0.05)
}

/// Shares of 0.95 and 0.05, and of 1 and 0: every channel has its mean, and the spread of samples stays below what T techniques may make of
/// it, where chances by shares let it grow with every bounce.
#[test]
fn lobes_in_a_closed_room() {
    let (scene, expected) = glowing_balls(16);
    assert_eq!(techniques(&scene), 3, "the two ends, and what lies between");
    let (with, means) = spread(&scene, size::either(4, 64));
    assert_estimates("glowing balls", &means, &[expected; 5], Bound { resolution: 0.05, allowance: 1e-4 });
    let (without, _) = spread(&demanding(scene, 1), 4);
    let most = |all: &[f64]| all.iter().copied().fold(0.0, f64::max);
    assert!(most(&with) < 3.0, "relative variances {with:?}");
    // What was in between all along had nothing to gain.
    for k in [0, 1, 3, 4] {
        assert!(
            without[k] > 5.0 * with[k],
            "channel {k}: relative variance {} by shares, {} by techniques",
            without[k],
            with[k]
        );
    }
    assert!(most(&without) > 20.0 * most(&with), "relative variances {without:?} by shares, {with:?} by techniques");
}

/// What asks for techniques, and what does not.
#[test]
fn how_many_techniques() {
    let (scene, _) = glowing_balls(16);
    assert_eq!(techniques(&demanding(scene.clone(), 1)), 1);
    assert_eq!(techniques(&demanding(scene.clone(), 2)), 2);
    assert_eq!(techniques(&demanding(scene, 16)), 5, "as many as channels");
    // Not where paths choose once only.
    assert_eq!(techniques(&glowing_balls(1).0), 1);
    let eight = || Builder::new().into_room().channels(Channels::equal(400.0, 700.0, 8)).bounces(8);
    let walls = || room(DVec3::new(-1.0, -1.0, -1.0), DVec3::new(1.0, 1.0, 3.0));
    let saturated = |b: Builder, bounces| b.bounces(bounces).plastic(walls(), slanted(0.01, 0.97), 1.5, 0.2).build();
    assert_eq!(techniques(&saturated(eight(), 5)), 1);
    assert_eq!(techniques(&saturated(eight(), 64)), 2);
    assert_eq!(techniques(&saturated(eight().channels(Channels::equal(400.0, 700.0, 1)), 64)), 1, "one channel");
    // Paints that go the same way need no choice, whatever their colours; what all channels share alike neither.
    let paints = eight().diffuse(walls(), slanted(0.0, 0.9)).diffuse(walls(), slanted(0.9, 0.0));
    assert_eq!(techniques(&demanding(paints.blend_of_last_two(walls(), 0.5).build(), 4)), 1);
    assert_eq!(techniques(&demanding(eight().plastic(walls(), 0.9, 1.5, 0.2).build(), 4)), 1);
    assert_eq!(techniques(&demanding(eight().diffuse(walls(), slanted(0.1, 0.9)).build(), 4)), 1);
}

/// A slanted spectrum over the visible.
fn slanted(blue: f64, red: f64) -> Curve {
    table(&[400.0, 700.0], &[blue, red])
}

/// Plastic, varnish, a leaf, and blends by a number and by a texture, of saturated colours, in a room with a lamp and an open end to a map.
fn saturated_room() -> Scene {
    let mut b = Builder::new().into_room().channels(Channels::equal(400.0, 700.0, 4)).bounces(6);
    let weights = b.texture([2, 2], &[0.1, 0.9, 0.6, 0.3], TextureKind::Number);
    let wall = |corner: DVec3, u: DVec3, v: DVec3| quad(corner, u, v);
    let low = DVec3::new(-1.0, -1.0, -1.0);
    let rgb = (0..32).flat_map(|i| [0.2 + 0.02 * i as f32, 0.5, 1.0 - 0.02 * i as f32]).collect();
    let b = b
        .rgb_map([8, 4], rgb)
        .lamp(quad(DVec3::new(-0.5, 0.99, -0.5), DVec3::X, DVec3::Z), slanted(4.0, 2.0), Sides::Front)
        .diffuse(wall(low, 2.0 * DVec3::X, 2.0 * DVec3::Y), 0.7)
        .plastic(wall(low, 2.0 * DVec3::Z, 2.0 * DVec3::X), slanted(0.05, 0.9), slanted(1.6, 1.4), 0.3)
        .plastic(sphere(DVec3::new(-0.4, -0.6, 0.0), 0.35), slanted(0.9, 0.0), 1.5, 0.0)
        .translucent(sphere(DVec3::new(0.5, -0.5, 0.3), 0.3), slanted(0.05, 0.9), slanted(0.9, 0.0));
    let metal = |b: Builder, s: Shape| b.conductor(s, slanted(0.2, 1.2), slanted(1.0, 6.0), [0.3; 2]);
    let back = wall(low, 2.0 * DVec3::Y, 2.0 * DVec3::Z);
    let b = metal(b, back.clone()).diffuse(back.clone(), slanted(0.9, 0.1)).masked_last_two(back, weights);
    let b = b.attributes(quad_uv());
    let ball = sphere(DVec3::new(0.3, 0.3, -0.5), 0.3);
    metal(b, ball.clone()).diffuse(ball.clone(), slanted(0.9, 0.1)).blend_of_last_two(ball, 0.6).build()
}

/// Every pixel and channel is that of the f64 reference, which has one wavelength at a time and no techniques.
#[test]
fn lobes_are_those_of_the_reference() {
    let scene = demanding(saturated_room(), 3);
    assert_eq!(techniques(&scene), 3);
    let bound = Bound { resolution: size::either(0.35, 0.1), allowance: 2e-3 };
    assert_as_reference(
        "a saturated room",
        &scene,
        size::either([16, 64], [64, 256]),
        size::either(2_000, 50_000),
        bound,
    );
}

/// The same by all evaluators.
#[test]
fn lobes_by_all_evaluators() {
    let shown = |evaluator| {
        let mut scene = demanding(saturated_room(), 4);
        scene.integrator.evaluator = evaluator;
        render(&scene, 2, 16, Settings::default()).means
    };
    let pixel = shown(Evaluator::DpeptPixel);
    for other in size::first(1, [Evaluator::Pt, Evaluator::DpeptPath, Evaluator::DpeptSpectral]) {
        for (a, b) in pixel.iter().flatten().zip(shown(other).iter().flatten()) {
            assert!((a - b).abs() <= 2e-4 * a.abs().max(0.01), "{other:?}: {a} {b}");
        }
    }
}

/// A plate of rough glass whose channels bend apart by several widths of its lobe, before a ramp of lamps; in `count` channels.
fn frosted_plate(count: usize, roughness: f64) -> Scene {
    let camera = look(
        3.0 * DVec3::Z,
        DVec3::new(0.5, 0.0, 0.0),
        DVec3::Y,
        Projection::Perspective { tan_half: DVec2::splat(0.3) },
    );
    let prism = |x: f64| DVec3::new(x, 0.0, 0.4 * x);
    let corners = [[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]];
    // A wedge: its back is slanted.
    let front = corners.map(|[x, y]| DVec3::new(x, y, 1.0));
    let back = corners.map(|[x, y]| DVec3::new(0.0, y, -0.2) + prism(x));
    let quads = [[0, 1, 2, 3], [7, 6, 5, 4], [4, 5, 1, 0], [5, 6, 2, 1], [6, 7, 3, 2], [7, 4, 0, 3]];
    let wedge = Shape::Mesh(Mesh {
        positions: [front, back].concat(),
        triangles: quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
    });
    let stripe = |x: f64| quad(DVec3::new(x, -3.0, -4.0), 0.5 * DVec3::X, 6.0 * DVec3::Y);
    let b =
        Builder::new().camera(camera).film(3, 3, Filter::Box).channels(Channels::equal(400.0, 700.0, count)).bounces(6);
    let b = b.dielectric(wedge, slanted(1.7, 1.4), roughness).sky(0.2);
    [-2.0, -0.5, 1.0].into_iter().fold(b, |b, x| b.lamp(stripe(x), slanted(3.0, 1.0), Sides::Front)).build()
}

/// Rough glass in which all channels go on is that of the reference, and of paths that go on in one channel each.
#[test]
fn rough_dispersive_glass_is_that_of_the_reference() {
    let scene = frosted_plate(8, 0.06);
    assert_eq!(techniques(&scene), 6);
    let bound = Bound { resolution: size::either(0.35, 0.1), allowance: 4e-3 };
    assert_as_reference(
        "a frosted wedge",
        &scene,
        size::either([16, 64], [64, 256]),
        size::either(2_000, 50_000),
        bound,
    );
}

/// Matter that scatters, lobes and rough dispersion together: one set of techniques is for all, each of which would have others alone.
#[test]
#[ignore = "half a minute, most of it compiling: a kernel with nearly everything"]
fn all_that_techniques_decide() {
    let mut scene = saturated_room();
    let cloud = {
        let (steep, flat) = (slanted(3.0, 0.2), slanted(0.5, 0.5));
        let mut b = Builder(scene);
        let forward = b.henyey_greenstein(slanted(0.8, 0.1));
        b = b.medium(0.1, None, Field::Constant(1.0)).scattering(steep, forward);
        b = b.beside(0.0, Field::Constant(1.0)).scattering(flat, Phase::Rayleigh { depolarisation: 0.0 });
        b.null_box(DVec3::new(-0.9, -0.2, -0.8), DVec3::new(0.0, 0.6, 0.8))
    };
    scene = demanding(cloud.dielectric(sphere(DVec3::new(0.5, 0.5, 0.6), 0.25), slanted(1.7, 1.4), 0.12).build(), 4);
    assert_eq!(techniques(&scene), 4);
    let bound = Bound { resolution: 0.15, allowance: 2e-3 };
    assert_as_reference("all at once", &scene, [64, 128], 20_000, bound);
    let shown = |evaluator| {
        let mut scene = scene.clone();
        scene.integrator.evaluator = evaluator;
        render(&scene, 2, 16, Settings::default()).means
    };
    for (a, b) in shown(Evaluator::DpeptPixel).iter().flatten().zip(shown(Evaluator::Pt).iter().flatten()) {
        assert!((a - b).abs() <= 2e-4 * a.abs().max(0.01), "{a} {b}");
    }
}
