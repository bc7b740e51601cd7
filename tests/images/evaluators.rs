//! The evaluators: the same paths, so the same values up to rounding, with one seed; and of the same mean with others.

use glam::{DMat3, DVec2, DVec3};
use spectile::device::prepared::Prepared;
use spectile::render::wave::{Budget, DeviceLimits, WavePlan};
use spectile::scene::{
    Attributes, Cone, Evaluator, Field, Filter, Profile, Projection, Sampler, Scene, Sides, TextureKind, Weight,
};
use spectile::spectral::{Channels, upsample};

use crate::device::{self, Settings, render};
use crate::scene_builder::*;
use crate::{size, statistics};

const OTHERS: [Evaluator; 3] = [Evaluator::DpeptPath, Evaluator::DpeptSpectral, Evaluator::Pt];

/// Kernels of general scenes take long to compile, and all of these read records by one text: the one that is chosen by itself.
fn others(is_general: bool) -> impl Iterator<Item = Evaluator> {
    OTHERS.into_iter().filter(move |other| size::is_full() || !is_general || *other == Evaluator::Pt)
}

fn with(scene: &Scene, evaluator: Evaluator) -> Scene {
    let mut scene = scene.clone();
    scene.integrator.evaluator = evaluator;
    scene
}

/// 13 x 7 pixels, which no tile divides, on a floor.
fn floor(channels: usize) -> Builder {
    Builder::new()
        .camera(look(
            DVec3::new(0.2, 0.3, 2.2),
            DVec3::ZERO,
            DVec3::Y,
            Projection::Perspective { tan_half: DVec2::new(0.8, 0.5) },
        ))
        .film(13, 7, Filter::Gaussian)
        .channels(Channels::equal(400.0, 700.0, channels))
        .bounces(4)
        .diffuse(
            quad(DVec3::new(-2.0, -1.0, 2.0), 4.0 * DVec3::X, 4.0 * DVec3::NEG_Z),
            table(&[400.0, 700.0], &[0.2, 0.9]),
        )
}

/// Diffuse surfaces, several lamps (one with more lines close together than kinks can follow), a sky, roulette.
fn plain(channels: usize) -> Builder {
    let lines =
        table(&[400.0, 549.0, 549.1, 549.2, 549.3, 549.4, 549.5, 700.0], &[0.1, 0.1, 9.0, 0.1, 5.0, 3.0, 0.1, 0.1]);
    floor(channels)
        .roulette(2)
        .diffuse(sphere(DVec3::new(0.7, -0.6, 0.3), 0.3), table(&[400.0, 530.0, 700.0], &[0.9, 0.1, 0.3]))
        .lamp(icosphere(DVec3::new(0.5, 0.8, 0.0), 0.2, 1), lines, Sides::Front)
        .lamp(disk(DVec3::new(-1.0, 1.0, 0.0), DVec3::new(0.5, -1.0, 0.0), 0.3), 2.0, Sides::Both)
        .sky(table(&[400.0, 700.0], &[0.5, 0.2]))
}

/// Metal, dispersive and rough glass, plastic, a blend, a sun, a hot ball, a gas and a grid of hot gas.
fn general(channels: usize) -> Builder {
    let ball = |x: f64, z: f64| sphere(DVec3::new(x, -0.6, z), 0.3);
    let cells = heat::grid([3, 2, 4], |[i, j, k]| 500.0 + 100.0 * f64::from(i + j + k));
    floor(channels)
        .bounces(5)
        .conductor(ball(-0.9, 0.2), 0.2, 3.4, [0.3, 0.1])
        .dielectric(ball(0.0, 0.4), surfaces::glass_curve(), 0.0)
        .dielectric(ball(0.9, 0.3), 1.5, 0.2)
        .plastic(ball(-0.4, -0.5), table(&[400.0, 700.0], &[0.1, 0.8]), 1.5, 0.1)
        .blend_of_last_two(ball(0.4, -0.5), 0.4)
        .sun(DVec3::new(-0.3, -1.0, -0.2), 0.01, table(&[400.0, 700.0], &[3.0, 5.0]))
        .conductor(sphere(DVec3::new(0.0, 0.4, 0.0), 0.2), 2.0, 2.5, [0.2; 2])
        .at_kelvin(2500.0)
        .medium(table(&[400.0, 700.0], &[0.2, 3.0]), Some(cells), Field::Constant(1.0))
        .null_box(DVec3::new(-0.5, 0.0, -0.5), DVec3::new(0.5, 0.9, 0.5))
        .gas(0.1)
        .sky(0.3)
}

#[test]
fn the_same_paths_give_the_same_means() {
    let independent = |mut scene: Scene| {
        scene.integrator.sampler = Sampler::Independent;
        scene
    };
    let several = |mut scene: Scene| {
        scene.integrator.wavelengths_per_channel = Some(4);
        scene
    };
    let mut far = 0.0f64;
    let scenes = [
        ("everything", general(4).build()),
        ("plain, several wavelengths", several(plain(7).build())),
        ("plain", plain(6).build()),
        ("plain, independent, many channels", independent(plain(170).build())),
        ("no bounces", plain(5).bounces(0).build()),
        ("plain, one channel", plain(1).build()),
        ("infrared", general(37).channels(Channels::equal(1500.0, 5500.0, 37)).build()),
        ("everything, several wavelengths", several(general(4).build())),
    ];
    for (what, scene) in size::first(3, scenes) {
        let samples = 64;
        let settings = Settings { seed: 3, ..Settings::default() };
        let expected = render(&with(&scene, Evaluator::DpeptPixel), 2, samples, settings);
        expected.assert_clean();
        let prepared = Prepared::new(&scene, 0).expect("a scene");
        assert_eq!(prepared.tables.kinks, 0, "{what}: the others have strata instead");
        let bound = device::rounding(prepared.max_records(), samples);
        for evaluator in others(prepared.is_general()) {
            // Waves of a few pixels and samples, and large ones.
            let is_plain = what.starts_with("plain");
            for paths in [None, Some(600)].into_iter().take(if is_plain { 2 } else { 1 }) {
                let settings = Settings { budget: Budget { memory: None, paths }, ..settings };
                let found = render(&with(&scene, evaluator), 2, samples, settings);
                found.assert_clean();
                assert_eq!(found.rays, expected.rays, "{what}, {}", evaluator.name());
                let mut lit = 0;
                for (a, b) in expected.means.iter().flatten().zip(found.means.iter().flatten()) {
                    let (a, b) = (f64::from(*a), f64::from(*b));
                    let error = (a - b).abs() / a.abs().max(1e-30);
                    assert!(error <= bound, "{what}, {}: {a} and {b}, bound {bound:e}", evaluator.name());
                    far = far.max(error / bound);
                    lit += u32::from(a > 0.0);
                }
                assert!(lit as usize * 3 > expected.means.len() * expected.means[0].len(), "{what} is dark");
            }
        }
    }
    println!("largest difference over its bound: {far:.1e}");
    assert!(far > 0.0, "all bits are the same: was another evaluator run at all?");
}

/// Leaves, masks, screens and spots: what next-event estimation finds on both sides, past what lets rays pass, and pictures as lamps.
#[test]
fn leaves_masks_screens_and_spots() {
    let ball = |x: f64, z: f64| sphere(DVec3::new(x, -0.6, z), 0.3);
    let cone = Cone { half_angle: 0.6, falloff: 0.2, profile: Profile::Smooth };
    let mut b = floor(5)
        .translucent(ball(-0.9, 0.2), table(&[400.0, 700.0], &[0.1, 0.4]), table(&[400.0, 700.0], &[0.05, 0.5]))
        .conductor(ball(0.0, 0.4), 0.2, 3.4, [0.3; 2])
        .opacity(Weight::Constant(0.6))
        .spot(DVec3::new(0.5, 1.5, 1.0), DVec3::new(-0.3, -1.0, -0.2), 2.0, cone)
        .lamp(sphere(DVec3::new(0.7, 0.2, -0.3), 0.3), upsample::daylight(), Sides::Both)
        .attributes(Attributes { axes: Some(DMat3::IDENTITY), ..Attributes::default() });
    let daylight = b.0.spectra.len() - 1;
    let rgb = [3.0, 0.2, 0.1, 0.1, 0.4, 2.0, 0.7, 0.7, 0.2, 1.0, 1.0, 1.0];
    let picture = b.texture([2, 2], &rgb, TextureKind::Light(daylight));
    b.0.objects.last_mut().and_then(|object| object.emission.as_mut()).expect("a lamp").texture = Some(picture);
    let scene = b.build();
    let (samples, settings) = (16, Settings { seed: 3, ..Settings::default() });
    let expected = render(&with(&scene, Evaluator::DpeptPixel), 1, samples, settings);
    expected.assert_clean();
    let bound = device::rounding(Prepared::new(&scene, 0).expect("a scene").max_records(), samples);
    for evaluator in others(true) {
        let found = render(&with(&scene, evaluator), 1, samples, settings);
        found.assert_clean();
        assert_eq!(found.rays, expected.rays, "{}", evaluator.name());
        for (a, b) in expected.means[0].iter().zip(&found.means[0]) {
            let (a, b) = (f64::from(*a), f64::from(*b));
            assert!((a - b).abs() <= bound * a.abs(), "{}: {a} and {b}, bound {bound:e}", evaluator.name());
        }
    }
    let lit = expected.means[0].iter().filter(|value| **value > 0.0).count();
    assert!(3 * lit > expected.means[0].len(), "{lit} values are not dark");
}

/// Where evaluation per pixel holds spectra with kinks, the others read strata: as far apart as tables may be from spectra.
#[test]
fn kinks_are_the_same_spectra_as_strata() {
    let mut far = 0.0f64;
    for channels in [8, 23, 50] {
        let scene = floor(channels)
            .diffuse(
                sphere(DVec3::new(0.7, -0.6, 0.3), 0.3),
                table(&[400.0, 511.0, 523.0, 700.0], &[0.9, 0.3, 0.4, 0.3]),
            )
            .lamp(sphere(DVec3::new(0.5, 0.8, 0.0), 0.2), table(&[400.0, 466.0, 700.0], &[3.0, 7.0, 4.0]), Sides::Front)
            .build();
        let prepared = |evaluator| Prepared::for_evaluator(&scene, 0, evaluator).expect("a scene");
        let (kinked, other) = (prepared(Evaluator::DpeptPixel), prepared(Evaluator::DpeptSpectral));
        assert!((1..=2).contains(&kinked.tables.kinks) && !kinked.features.strata && other.features.strata);
        let samples = 64;
        let of = |evaluator| render(&with(&scene, evaluator), 1, samples, Settings::default());
        let (a, b) = (of(Evaluator::DpeptPixel), of(Evaluator::DpeptSpectral));
        a.assert_clean();
        // Table errors are relative to a channel's peak, and no spectrum falls below 1/2.4 of it within one: two of each vertex.
        let error = |p: &Prepared| p.tables.bounds.iter().map(|b| 2.4 * b.pointwise).fold(0.0, f64::max);
        let records = kinked.max_records();
        let tables = 2.0 * f64::from(records) * (error(&kinked) + error(&other));
        let bound = device::rounding(records, samples) + tables;
        assert!(bound < 0.01, "{bound}");
        for (a, b) in a.means.iter().flatten().zip(b.means.iter().flatten()) {
            let (a, b) = (f64::from(*a), f64::from(*b));
            let error = (a - b).abs() / a.abs().max(1e-30);
            assert!(error <= bound, "{channels} channels: {a} and {b}, bound {bound:e}");
            far = far.max(error);
        }
    }
    println!("largest difference: {far:.1e}");
    assert!(far > 0.0, "all bits are the same: were the tables others at all?");
}

/// Each evaluator, bit for bit, whatever the waves.
#[test]
fn waves_change_no_bit_of_any_evaluator() {
    for scene in [plain(6).build(), general(4).build()] {
        let is_general = Prepared::new(&scene, 0).expect("a scene").is_general();
        for evaluator in others(is_general) {
            let scene = with(&scene, evaluator);
            let bits = |settings: Settings| -> Vec<u32> {
                render(&scene, 1, 64, settings).means.iter().flatten().map(|v| v.to_bits()).collect()
            };
            let expected = bits(Settings::default());
            let budget = Budget { memory: None, paths: Some(300) };
            let settings = [
                Settings { budget, tile: [5, 3], units: 2, ..Settings::default() },
                Settings { checked: true, ..Settings::default() },
            ];
            // With checks, general kernels are compiled once more.
            for settings in size::first(if is_general { 1 } else { 2 }, settings) {
                assert!(bits(settings) == expected, "{}: {settings:?}", evaluator.name());
            }
        }
    }
}

/// With seeds of its own, each evaluator's mean is that of the others: z-scores of all channels of the image.
#[test]
#[ignore = "minutes: a weaker proof of what the same paths show"]
fn no_evaluator_is_biased() {
    let scene = general(4).build();
    let of = |evaluator, seed| {
        let rendered = render(&with(&scene, evaluator), 32, 64, Settings { seed, ..Settings::default() });
        rendered.assert_clean();
        rendered.image_means()
    };
    let expected = of(Evaluator::DpeptPixel, 100);
    for (seed, evaluator) in (1..).zip(OTHERS) {
        statistics::assert_same_means(evaluator.name(), &expected, &of(evaluator, seed), 4.5);
    }
}

/// Bytes of a path: 32 and 16 a channel for the conventional path tracer, as in Hoarau et al. 2018, section 4.2; for the deferred ones
/// records, whatever the number of channels. Beside that 8 for its head and 8 for its places in the queues.
#[test]
fn only_the_conventional_path_tracer_takes_memory_by_channel() {
    let plan = |channels: usize, bounces: u32, evaluator| {
        let scene =
            with(&floor(channels).bounces(bounces).lamp(sphere(DVec3::Y, 0.2), 1.0, Sides::Front).build(), evaluator);
        let prepared = Prepared::new(&scene, 0).expect("a scene");
        let limits = DeviceLimits { binding: 1 << 30, uniform_alignment: 256, software: false };
        let plan = WavePlan::new(&prepared, [16, 16], limits, Budget::default()).expect("waves");
        assert!(plan.spectral_state_bytes() <= limits.binding && plan.record_bytes() <= limits.binding);
        plan
    };
    for channels in [4, 400, 2000] {
        // A vertex's two records of 8 bytes, and one for what the last direction meets.
        assert_eq!(plan(channels, 5, Evaluator::Pt).path_bytes(), 32 + 16 * channels as u64 + 16 + 24);
        for evaluator in [Evaluator::DpeptPixel, Evaluator::DpeptPath, Evaluator::DpeptSpectral] {
            assert_eq!(plan(channels, 5, evaluator).path_bytes(), 32 + 16 + 8 * 11);
        }
    }
    // The pool of the conventional one shrinks to what can be bound.
    assert_eq!(plan(2000, 5, Evaluator::Pt).paths, (1 << 30) / 32_000 / 4 * 4);
}
