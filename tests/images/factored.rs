//! Weights of products of spectra: closed forms, the f64 reference under spectra that the render never saw, and the same paths as
//! without.

use glam::DVec3;
use spectile::device::separable;
use spectile::render::wave::Budget;
use spectile::scene::{
    Bsdf, Cone, Filter, Profile, Reflectance, Roughness, Scene, Sides, Spectrum, Texels, TextureKind, Wavelengths,
    Weight,
};
use spectile::spectral::{Channels, Curve, Outside};

use crate::device::{Settings, assert_rendered_as_reference, render, render_paths_of_weights, render_relit};
use crate::scene_builder::heat::infrared;
use crate::scene_builder::*;
use crate::size;
use crate::statistics::{Bound, assert_agreement, assert_estimates, image_estimates};
use crate::truth;

fn basis(scene: &Scene) -> spectile::spectral::product::Basis {
    separable::basis(scene).expect("a scene that separates")
}

/// A ball under a uniform sky, which is sampled as the surface reflects: each path brings half by aiming and half by meeting it, so that
/// the weight of sky times paint is 1, of each.
#[test]
fn a_ball_under_the_sky_weighs_one() {
    let scene = Builder::new().channels(Channels::equal(400.0, 700.0, 4));
    let scene = scene.diffuse(sphere(DVec3::ZERO, 0.5), 0.5).sky(2.0).build();
    let mut other = basis(&scene);
    assert_eq!((other.factors.len(), other.sources.len()), (1, 1));
    let paint = table(&[400.0, 700.0], &[0.1, 0.7]);
    for leaf in &mut other.spectra {
        leaf.curve = if leaf.curve == Curve::Constant(2.0) { Curve::Constant(3.0) } else { paint.clone() };
    }
    let rendered = render_relit(&scene, &other, &scene.channels, 1, 64, Settings::default());
    rendered.assert_clean();
    for (k, value) in rendered.means[0].iter().enumerate() {
        let [from, to] = scene.channels.bounds[k];
        let want = 3.0 * paint.mean(from, to);
        assert!((f64::from(*value) / want - 1.0).abs() < 1e-6, "{k}: {value}, not {want}");
    }
}

/// In a closed room whose walls are black and whose lamps are off, relit: E (1 + ρ + ρ² + … ρ^B). What has no power while rendering must
/// have its share of the paths all the same.
#[test]
fn furnaces_are_series_of_powers() {
    const BOUNCES: u32 = 6;
    let scene = Builder::new()
        .camera(look(0.5 * DVec3::ONE, DVec3::new(0.9, 0.8, 0.0), DVec3::Y, narrow()))
        .film(8, 8, Filter::Box)
        .bounces(BOUNCES)
        .roulette(2)
        .glowing(
            room(DVec3::ZERO, DVec3::ONE),
            0.0,
            Curve::Linear { nm: vec![1.0, 2.0], value: vec![1.0, 1.0], outside: Outside::Zero },
            Sides::Front,
        )
        .build();
    let dark = basis(&scene);
    let settings = Settings { seed: 3, ..Settings::default() };
    for (rho, emission) in [(0.0, 1.0), (0.3, 1.0), (0.9, 2.5)] {
        let mut lit = dark.clone();
        for leaf in &mut lit.spectra {
            let is_paint = leaf.curve == Curve::Constant(0.0);
            leaf.curve = Curve::Constant(if is_paint { rho } else { emission });
        }
        let rendered = render_relit(&scene, &lit, &scene.channels, 32, 64, settings);
        rendered.assert_clean();
        let want = emission * (0..=BOUNCES).map(|n| f64::powi(rho, n as i32)).sum::<f64>();
        assert_estimates(&format!("{rho}"), &rendered.replicas(), &[want], Bound { resolution: 0.01, allowance: 1e-6 });
    }
}

/// Spectra for a scene: three of surfaces, three of lights.
struct Paints {
    surfaces: [Curve; 3],
    lights: [Curve; 3],
}

impl Paints {
    fn dull() -> Paints {
        let flat = |a: f64, b: f64| table(&[400.0, 700.0], &[a, b]);
        Paints {
            surfaces: [flat(0.5, 0.4), flat(0.3, 0.35), flat(0.6, 0.2)],
            lights: [flat(3.0, 4.0), flat(1.0, 2.0), flat(0.5, 0.25)],
        }
    }

    /// Steps, lines and colours, bright where the others are dark.
    fn vivid() -> Paints {
        let hold = |nm: &[f64], value: &[f64]| Curve::Linear {
            nm: nm.to_vec(),
            value: value.to_vec(),
            outside: Outside::Hold,
        };
        Paints {
            surfaces: [
                hold(&[400.0, 500.0, 500.0, 700.0], &[0.05, 0.05, 0.95, 0.9]),
                hold(&[400.0, 480.0, 700.0], &[0.9, 0.8, 0.02]),
                Curve::Constant(0.85),
            ],
            lights: [
                table(
                    &[400.0, 435.0, 436.0, 437.0, 545.0, 546.0, 547.0, 700.0],
                    &[0.1, 0.1, 60.0, 0.1, 0.1, 80.0, 0.1, 0.2],
                ),
                Curve::Blackbody { kelvin: 2700.0, scale: 2e-5 },
                Curve::Constant(2.0),
            ],
        }
    }
}

/// A corner with a ball, a lamp and a sky: a plain scene.
fn plain(paints: Paints) -> Scene {
    let ([a, b, c], [lamp, glow, sky]) = (paints.surfaces, paints.lights);
    corner()
        .diffuse(quad(DVec3::new(-2.0, -1.0, 2.0), 4.0 * DVec3::X, 4.0 * DVec3::NEG_Z), a)
        .diffuse(quad(DVec3::new(-2.0, -1.0, -1.0), 4.0 * DVec3::X, 3.0 * DVec3::Y), b)
        .glowing(sphere(DVec3::new(0.4, -0.6, 0.2), 0.3), c, glow, Sides::Front)
        .lamp(icosphere(DVec3::new(-0.5, 1.2, 0.4), 0.2, 1), lamp, Sides::Front)
        .sky(sky)
        .build()
}

fn corner() -> Builder {
    Builder::new().into_corner().roulette(3)
}

/// What makes a scene general and separates still: endmembers, a blend, a leaf, an opacity, a point, a spot and a sun.
fn general(paints: Paints) -> Scene {
    let ([a, b, c], [point, sun, sky]) = (paints.surfaces, paints.lights);
    let mut builder = corner();
    let shares = [0.7, 0.1, 0.1, 0.1, 0.5, 0.4, 0.3, 0.3, 0.3, 0.0, 0.2, 0.8];
    let mixture = builder.mixture([2, 2], &shares, &[a.clone(), b.clone(), c.clone()]);
    let floor = quad(DVec3::new(-2.0, -1.0, 2.0), 4.0 * DVec3::X, 4.0 * DVec3::NEG_Z);
    let cone = Cone { half_angle: 0.6, falloff: 0.3, profile: Profile::Smooth };
    builder
        .textured(floor, mixture)
        .attributes(quad_uv())
        .diffuse(quad(DVec3::new(-2.0, -1.0, -1.0), 4.0 * DVec3::X, 3.0 * DVec3::Y), b)
        .opacity(Weight::Constant(0.8))
        .diffuse(sphere(DVec3::new(0.4, -0.6, 0.2), 0.3), c.clone())
        .translucent(disk(DVec3::new(-0.5, 0.2, 0.3), DVec3::new(0.3, 0.2, 1.0), 0.5), half(&c), half(&a))
        .point(DVec3::new(0.5, 1.0, 1.0), point.clone())
        .spot(DVec3::new(-1.0, 1.5, 1.0), DVec3::new(0.5, -1.0, -0.5), point, cone)
        .sun(DVec3::new(-0.3, -1.0, -0.2), 0.05, sun)
        .sky(sky)
        .build()
}

fn half(curve: &Curve) -> Curve {
    curve.scaled(0.5)
}

/// Rendered under one set of spectra, relit to the other: the picture of the reference under that one.
fn relit_is_as_reference(what: &str, scene: impl Fn(Paints) -> Scene, epochs: u32, bound: Bound) {
    let (rendered, wanted) = (scene(Paints::dull()), scene(Paints::vivid()));
    let other = basis(&wanted);
    assert_eq!(other.factors.len(), basis(&rendered).factors.len());
    let channels = Channels::from_bounds(vec![[400.0, 450.0], [540.0, 550.0], [550.0, 700.0]], None);
    let relit = render_relit(&rendered, &other, &channels, epochs, 64, Settings { seed: 4, ..Settings::default() });
    let wanted = Scene { channels, ..wanted };
    assert_rendered_as_reference(what, &relit, &wanted, 64 * epochs, bound);
}

#[test]
fn plain_scenes_relit_are_as_the_reference() {
    relit_is_as_reference(
        "plain",
        plain,
        size::either(64, 256),
        Bound { resolution: size::either(0.2, 0.1), allowance: 1e-6 },
    );
}

#[test]
fn general_scenes_relit_are_as_the_reference() {
    relit_is_as_reference(
        "general",
        general,
        size::either(64, 256),
        Bound { resolution: size::either(0.2, 0.1), allowance: 1e-6 },
    );
}

/// Hot walls, relit to other paints and temperatures: 1 - ρ follows.
#[test]
fn heat_follows_its_paint_and_temperature() {
    let scene = |paint: Curve, kelvin: [f64; 2]| {
        corner()
            .channels(infrared())
            .diffuse(quad(DVec3::new(-2.0, -1.0, 2.0), 4.0 * DVec3::X, 4.0 * DVec3::NEG_Z), paint)
            .at_kelvin(kelvin[0])
            .black(sphere(DVec3::new(0.4, -0.6, 0.2), 0.3))
            .at_kelvin(kelvin[1])
            .diffuse(quad(DVec3::new(-2.0, -1.0, -1.0), 4.0 * DVec3::X, 3.0 * DVec3::Y), 0.6)
            .build()
    };
    let steps =
        Curve::Linear { nm: vec![3e3, 9e3, 9e3, 20e3], value: vec![0.9, 0.9, 0.1, 0.2], outside: Outside::Hold };
    let (rendered, wanted) = (scene(Curve::Constant(0.2), [300.0, 320.0]), scene(steps, [350.0, 500.0]));
    let settings = Settings { seed: 7, ..Settings::default() };
    let relit = render_relit(&rendered, &basis(&wanted), &wanted.channels, 32, 64, settings);
    relit.assert_clean();
    let truth = truth::render_image(&wanted, 4096, 8);
    let channels = wanted.channels.len();
    let truth = image_estimates(&truth.mean, &truth.standard_error, channels, f64::from(truth.samples - 1));
    let means: Vec<f64> = truth.iter().map(|e| e.mean).collect();
    assert_agreement("heat", &relit.image_means(), &truth, &means, Bound { resolution: 0.02, allowance: 2e-6 });
}

/// Heat that differs by place: temperatures of textures, on paint, endmembers and black; shares of blends; beside a lamp, and a picture
/// of lamps.
fn hot_places(paints: [Curve; 4], lamps: [Curve; 2]) -> Scene {
    let ([a, b, c, d], [lamp, screen]) = (paints, lamps);
    let mut builder = corner().channels(infrared());
    let warm = builder.texture([2, 2], &[300.0, 420.0, 0.0, 360.0], TextureKind::Number);
    let shares = builder.texture([2, 1], &[0.9, 0.2], TextureKind::Number);
    let mixture = builder.mixture([2, 1], &[0.6, 0.3, 0.1, 0.9], &[a.clone(), b.clone()]);
    let picture = builder.mixture([2, 1], &[1.0, 0.2, 0.0, 3.0], &[lamp.clone(), screen]);
    let [x, y] = [DVec3::X, DVec3::Y];
    let away = || sphere(DVec3::new(0.0, 9.0, 0.0), 0.1);
    let mut scene = builder
        .diffuse(quad(DVec3::new(-2.0, -1.0, 2.0), 4.0 * x, 4.0 * DVec3::NEG_Z), c)
        .attributes(quad_uv())
        .heated_by(warm)
        .textured(quad(DVec3::new(-2.0, -1.0, -1.0), 4.0 * x, 3.0 * y), mixture)
        .attributes(quad_uv())
        .at_kelvin(350.0)
        .black(quad(DVec3::new(-1.5, -0.9, 0.2), x, y))
        .attributes(quad_uv())
        .heated_by(warm)
        .diffuse(away(), d)
        .at_kelvin(500.0)
        .textured(away(), mixture)
        .heated_by(warm)
        .masked_last_two(quad(DVec3::new(0.5, -0.9, 0.2), x, y), shares)
        .attributes(quad_uv())
        .glowing(quad(DVec3::new(-0.5, 1.0, 0.2), x, -0.3 * y), a, lamp, Sides::Front)
        .attributes(quad_uv())
        .heated_by(warm)
        .glowing(quad(DVec3::new(0.6, 0.3, 0.4), 0.5 * x, 0.4 * y), b, 1.0, Sides::Front)
        .attributes(quad_uv())
        .build();
    let screen = scene.objects.last_mut().and_then(|object| object.emission.as_mut()).expect("a lamp");
    screen.texture = Some(picture);
    scene
}

fn dull_places() -> Scene {
    let lamp = |scale: f64, kelvin: f64| Curve::Blackbody { kelvin, scale };
    hot_places([0.2, 0.7, 0.4, 0.5].map(Curve::Constant), [lamp(0.3, 400.0), lamp(0.1, 500.0)])
}

#[test]
fn heat_by_place_follows_paints_and_lamps() {
    let rendered = dull_places();
    assert_eq!(separable::of(&rendered).expect("a scene").remainder, [""; 0]);
    let line = |from: f64, to: f64| table(&[3e3, 20e3], &[from, to]);
    let lamp = |scale: f64, kelvin: f64| Curve::Blackbody { kelvin, scale };
    let paints = [line(0.1, 0.8), line(0.9, 0.3), line(0.6, 0.2), line(0.05, 0.4)];
    let wanted = hot_places(paints, [lamp(0.5, 600.0), lamp(0.2, 350.0)]);
    let (settings, epochs) = (Settings { seed: 8, ..Settings::default() }, size::either(64, 256));
    let relit = render_relit(&rendered, &basis(&wanted), &wanted.channels, epochs, 64, settings);
    let bound = Bound { resolution: size::either(0.2, 0.1), allowance: 1e-4 };
    assert_rendered_as_reference("heat by place", &relit, &wanted, 64 * epochs, bound);
}

/// The very same paths bring what they bring in channels so narrow that nothing changes within them, to `bound` of the brightest pixel.
fn is_that_of_channels(what: &str, scene: Scene, nm: [f64; 5], bound: f32) {
    let mut scene = Scene { channels: Channels::from_bounds(nm.map(|nm| [nm, nm + 0.01]).to_vec(), None), ..scene };
    scene.integrator.wavelengths = Wavelengths::Uniform;
    let in_channels = render_paths_of_weights(&scene, 2, 64, Settings::default());
    let weights = render(&scene.clone().factored(), 2, 64, Settings::default());
    assert_eq!(in_channels.rays, weights.rays);
    for k in 0..nm.len() {
        let of = |means: &[Vec<f32>]| means.iter().map(|pixel| pixel[k]).collect::<Vec<f32>>();
        let (a, b) = (of(&in_channels.means), of(&weights.means));
        let peak = a.iter().copied().fold(0.0, f32::max);
        assert!(peak > 0.0);
        let worst = a.iter().zip(&b).map(|(a, b)| (a - b).abs() / peak).fold(0.0, f32::max);
        println!("{what}, {k}: {worst:e} of the peak");
        assert!(worst <= bound, "{what}, {k}: {worst:e}");
    }
}

/// To what interpolation between temperatures leaves; beside metals that are hot by place, which do not separate, too.
#[test]
fn heat_by_place_is_that_of_channels() {
    let nm = [3e3, 5e3, 8e3, 12e3, 20e3];
    is_that_of_channels("all", dull_places(), nm, 1e-4);
    let mut scene = dull_places();
    let [eta, k] = [2.0, 5.0].map(|value| {
        scene.spectra.push(Spectrum { name: "metal".into(), curve: Curve::Constant(value), definition: None });
        scene.spectra.len() - 1
    });
    scene.materials[2].bsdf =
        Bsdf::Conductor { eta, k, roughness: Roughness::Constant([0.3; 2]), energy_compensation: true };
    assert!(!separable::remainder(&scene).is_empty());
    is_that_of_channels("beside metals", scene, nm, 1e-4);
    // A lamp and a paint of the same numbers are one spectrum of a scene.
    let mut scene = dull_places();
    let Bsdf::Diffuse { reflectance: Reflectance::Spectrum(paint) } = scene.materials[0].bsdf else { unreachable!() };
    let lamps = scene.objects.iter_mut().filter_map(|object| object.emission.as_mut());
    lamps.filter(|lamp| lamp.texture.is_none()).for_each(|lamp| lamp.radiance = paint);
    is_that_of_channels("a lamp of paint", scene, nm, 1e-4);
}

/// A diffuse corner, a mirror if it is wanted, and a map of three spectra, of which texels have shares; with a per cent of something else
/// in each band.
fn under_a_map(noise: f32, with_a_mirror: bool) -> Scene {
    const BANDS: usize = 13;
    let nm: Vec<f64> = (0..BANDS).map(|i| 380.0 + 30.0 * i as f64).collect();
    let spectrum = |k: usize, i: usize| match k {
        0 => 0.2 + 0.05 * i as f32,
        1 => (-(i as f32) / 3.0).exp(),
        _ => 0.1 + (0.9 * i as f32).sin().powi(2),
    };
    let share = |t: usize, k: usize| if t < 3 { f32::from(u8::from(t == k)) } else { ((t * (k + 2)) % 7) as f32 / 3.0 };
    let off = |t: usize, i: usize| 1.0 + noise * (((t * 31 + i * 17) % 11) as f32 / 5.0 - 1.0);
    let value = |t: usize, i: usize| (0..3).map(|k| share(t, k) * spectrum(k, i)).sum::<f32>() * off(t, i);
    let radiance: Vec<f32> = (0..32 * BANDS).map(|at| value(at / BANDS, at % BANDS)).collect();
    let builder = corner()
        .diffuse(
            quad(DVec3::new(-2.0, -1.0, 2.0), 4.0 * DVec3::X, 4.0 * DVec3::NEG_Z),
            table(&[400.0, 700.0], &[0.2, 0.8]),
        )
        .diffuse(sphere(DVec3::new(-0.5, -0.6, 0.2), 0.3), 0.6)
        .map([8, 4], Texels::Spectral { nm, radiance: radiance.into() });
    if with_a_mirror { builder.conductor(sphere(DVec3::new(0.6, -0.6, 0.2), 0.3), 0.3, 3.0, [0.0; 2]) } else { builder }
        .build()
}

/// Maps of a few spectra are products; what these leave of others is of the remainder, and so is all of them that a mirror shows.
#[test]
fn maps_are_those_of_channels() {
    let nm = [410.0, 475.0, 530.0, 610.0, 690.0];
    for (what, scene, has_remainder) in [
        ("three spectra", under_a_map(0.0, false), false),
        ("a mirror", under_a_map(0.0, true), true),
        ("noise", under_a_map(0.01, false), true),
        ("noise and a mirror", under_a_map(0.01, true), true),
    ] {
        assert_eq!(!separable::remainder(&scene).is_empty(), has_remainder, "{what}");
        // Shares of a texel are within 1e-5 of it.
        is_that_of_channels(what, scene, nm, 2e-5);
    }
}

/// Rendered in narrow channels, relit in others: as the reference has it.
#[test]
fn maps_follow_channels() {
    let scene = under_a_map(0.0, false);
    let channels = Channels::from_bounds(vec![[400.0, 500.0], [540.0, 550.0], [550.0, 700.0]], None);
    let narrow = Scene { channels: Channels::equal(600.0, 610.0, 2), ..scene.clone() };
    let epochs = size::either(16, 256);
    let relit =
        render_relit(&narrow, &basis(&scene), &channels, epochs, 64, Settings { seed: 5, ..Settings::default() });
    let bound = Bound { resolution: size::either(0.2, 0.1), allowance: 2e-5 };
    assert_rendered_as_reference("a map", &relit, &Scene { channels, ..scene }, 64 * epochs, bound);
}

/// Where spectra are the same all over each channel, the very same paths bring what they bring without weights.
#[test]
fn the_paths_are_those_of_channels() {
    let channels = Channels::equal(400.0, 700.0, 6);
    let steps = |values: [f64; 6]| {
        let nm = channels.bounds.iter().flatten().copied().collect();
        Curve::Linear { nm, value: values.iter().flat_map(|v| [*v; 2]).collect(), outside: Outside::Hold }
    };
    let paints = || Paints {
        surfaces: [
            steps([0.5, 0.6, 0.7, 0.8, 0.55, 0.9]),
            steps([0.9, 0.5, 0.8, 0.6, 0.7, 0.5]),
            steps([0.6, 0.8, 0.6, 0.9, 0.5, 0.7]),
        ],
        lights: [steps([10.0, 20.0, 30.0, 40.0, 50.0, 60.0]), steps([6.0, 5.0, 4.0, 3.0, 2.0, 1.0]), steps([0.1; 6])],
    };
    // One light, which has all of the choice either way, and surfaces that reflect a half at least.
    let of = |paints: Paints| {
        let ([a, b, c], [lamp, ..]) = (paints.surfaces, paints.lights);
        corner()
            .diffuse(quad(DVec3::new(-2.0, -1.0, 2.0), 4.0 * DVec3::X, 4.0 * DVec3::NEG_Z), a)
            .diffuse(quad(DVec3::new(-2.0, -1.0, -1.0), 4.0 * DVec3::X, 3.0 * DVec3::Y), b)
            .diffuse(sphere(DVec3::new(0.4, -0.6, 0.2), 0.3), c)
            .lamp(sphere(DVec3::new(-0.5, 1.2, 0.4), 0.2), lamp, Sides::Front)
            .build()
    };
    let scene = of(paints());
    let channels_of = render(&scene, 2, 64, Settings::default());
    let weights = render(&scene.clone().factored(), 2, 64, Settings::default());
    assert_eq!(channels_of.rays, weights.rays);
    let peak = channels_of.means.iter().flatten().copied().fold(0.0, f32::max);
    assert!(peak > 0.1);
    for (a, b) in channels_of.means.iter().flatten().zip(weights.means.iter().flatten()) {
        assert!((a - b).abs() <= 1e-5 * peak, "{a} {b}");
    }
}

/// Waves of any size, and tiles: the same bits.
#[test]
fn waves_and_tiles_change_no_bit() {
    for scene in [plain(Paints::vivid()), general(Paints::vivid())] {
        let scene = scene.factored();
        let usual = render(&scene, 2, 64, Settings::default());
        for settings in [
            Settings { budget: Budget { memory: None, paths: Some(777) }, ..Settings::default() },
            Settings { tile: [8, 8], units: 1, ..Settings::default() },
            Settings { checked: true, ..Settings::default() },
        ] {
            let other = render(&scene, 2, 64, settings);
            assert!(usual.means == other.means, "{settings:?}");
        }
    }
}

/// Mixtures seen in mixtures are more terms than a path carries: some are chosen, and the mean stays.
#[test]
fn mixtures_of_mixtures_keep_their_mean() {
    let scene = |paints: Paints| {
        let [a, b, c] = paints.surfaces;
        let mut builder = corner().bounces(5);
        let shares = [0.3, 0.4, 0.3, 0.5, 0.2, 0.3, 0.2, 0.2, 0.6, 0.4, 0.4, 0.2];
        let mixture = builder.mixture([2, 2], &shares, &[a, b, c]);
        let wall = |builder: Builder, corner: DVec3, u: DVec3, v: DVec3| {
            builder.textured(quad(corner, u, v), mixture).attributes(quad_uv())
        };
        let (x, y, z) = (4.0 * DVec3::X, 3.0 * DVec3::Y, 4.0 * DVec3::NEG_Z);
        let builder = wall(builder, DVec3::new(-2.0, -1.0, 2.5), x, z);
        let builder = wall(builder, DVec3::new(-2.0, -1.0, -1.5), x, y);
        let builder = wall(builder, DVec3::new(-2.0, -1.0, 2.5), z, y);
        builder.point(DVec3::new(0.5, 1.0, 1.0), paints.lights[0].clone()).build()
    };
    let bound = Bound { resolution: size::either(0.2, 0.1), allowance: 1e-6 };
    relit_is_as_reference("mixtures", scene, size::either(64, 256), bound);
}
