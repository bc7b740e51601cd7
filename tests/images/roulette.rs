//! Roulette on evaluation: the same means as with all paths, in every kind of scene; light that is seen before it is scattered stays
//! exact; what the pilot expects is what comes.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use spectile::device::prepared::Prepared;
use spectile::render::pilot;
use spectile::render::wave::Budget;
use spectile::scene::{Evaluation, Evaluator, Field, Filter, Projection, Sampler, Scene, Sides};
use spectile::spectral::{Channels, Response};

use crate::device::{self, Settings, assert_as_reference, render};
use crate::scene_builder::*;
use crate::size;
use crate::statistics::{Bound, assert_agreement};

/// A floor under a small lamp and a coloured ball, 13 x 7 pixels: some paths bring a hundred times what others do.
fn floor(channels: Channels) -> Builder {
    Builder::new()
        .camera(look(
            DVec3::new(0.2, 0.3, 2.2),
            DVec3::ZERO,
            DVec3::Y,
            Projection::Perspective { tan_half: DVec2::new(0.8, 0.5) },
        ))
        .film(13, 7, Filter::Box)
        .channels(channels)
        .bounces(4)
        .diffuse(
            quad(DVec3::new(-2.0, -1.0, 2.0), 4.0 * DVec3::X, 4.0 * DVec3::NEG_Z),
            table(&[400.0, 700.0], &[0.2, 0.9]),
        )
        .diffuse(sphere(DVec3::new(0.7, -0.6, 0.3), 0.3), table(&[400.0, 530.0, 700.0], &[0.9, 0.1, 0.3]))
        // Out of sight, so that all of the noise is that of what is scattered.
        .lamp(icosphere(DVec3::new(0.5, 1.8, 0.0), 0.1, 1), table(&[400.0, 700.0], &[200.0, 500.0]), Sides::Front)
}

fn plain(channels: usize) -> Scene {
    floor(Channels::equal(400.0, 700.0, channels)).roulette(3).sky(0.02).build()
}

/// Metal, glass, plastic, a sun, hot gas in voxels: 2 to 4 micrometres, where everything glows.
fn hot(channels: usize) -> Scene {
    let cells = heat::grid([3, 2, 4], |[i, j, k]| 500.0 + 100.0 * f64::from(i + j + k));
    floor(Channels::equal(2000.0, 4000.0, channels))
        .conductor(sphere(DVec3::new(-0.9, -0.6, 0.2), 0.3), 0.2, 3.4, [0.3, 0.1])
        .at_kelvin(700.0)
        .dielectric(sphere(DVec3::new(0.0, -0.6, 0.4), 0.3), surfaces::glass_curve(), 0.0)
        .plastic(sphere(DVec3::new(-0.4, -0.6, -0.5), 0.3), 0.5, 1.5, 0.1)
        .sun(DVec3::new(-0.3, -1.0, -0.2), 0.01, 5.0)
        .medium(table(&[2000.0, 4000.0], &[0.2, 3.0]), Some(cells), Field::Constant(1.0))
        .null_box(DVec3::new(-0.5, 0.0, -0.5), DVec3::new(0.5, 0.9, 0.5))
        .build()
}

fn thinned(scale: f64, seed: u64) -> Settings {
    Settings { seed, scale: Some(scale), ..Settings::default() }
}

/// Every channel's mean over the picture, with all paths and with few; the growth of its variance.
fn compare(what: &str, scene: &Scene, scale: f64, epochs: u32, resolution: f64) -> Vec<f64> {
    let of = |settings: Settings| {
        let rendered = render(scene, epochs, 64, settings);
        rendered.assert_clean();
        rendered.image_means()
    };
    let (all, some) = (of(Settings { seed: 1, ..Settings::default() }), of(thinned(scale, 2)));
    let means: Vec<f64> = all.iter().map(|e| e.mean).collect();
    assert_agreement(what, &all, &some, &means, Bound { resolution, allowance: 0.0 });
    let grown: Vec<f64> = all.iter().zip(&some).map(|(a, b)| (b.error / a.error).powi(2)).collect();
    println!("{what}: variance with few paths over that with all: {grown:.2?}");
    grown
}

/// In registers, by kinks and by strata, in tables, general scenes with their instructions, responses, by other evaluators, at
/// several wavelengths. The chances are so small that most paths are dropped: if a weight were forgotten, a mean would be far off.
#[test]
fn the_means_are_those_of_all_paths() {
    let grown = compare("in registers", &plain(6), 1e-3, 64, 0.1);
    assert!(grown.iter().all(|grown| *grown > 2.0), "most paths were dropped: {grown:?}");
    compare("everything", &hot(5), 0.1, 32, 0.1);
    let mut several = plain(3);
    several.integrator.wavelengths_per_channel = Some(4);
    compare("several wavelengths", &several, 0.1, 32, 0.1);
    if size::is_full() {
        compare("many channels", &plain(150), 0.2, 16, 0.1);
        let sensor = Response::new(vec![480.0, 550.0, 600.0], vec![0.0, 1.0, 0.0]).expect("a response");
        let green = Channels::from_responses(vec![("green".into(), sensor)], None);
        compare("a response", &floor(green).build(), 0.1, 32, 0.1);
    }
    for evaluator in size::first(1, [Evaluator::DpeptPath, Evaluator::DpeptSpectral]) {
        let mut scene = plain(5);
        scene.integrator.evaluator = evaluator;
        compare(evaluator.name(), &scene, 0.1, 32, 0.1);
    }
}

#[test]
fn pixels_are_those_of_the_reference() {
    let mut scene = plain(4);
    scene.film.crop = [5, 2, 9, 6];
    let bound = Bound { resolution: 0.12, allowance: 1e-3 };
    let of_roulette = |scene: &Scene| {
        let rendered = render(scene, 96, 64, thinned(0.2, 5));
        rendered.assert_clean();
        rendered.values()
    };
    let truth = crate::truth::render_image(&scene, 1500, 6);
    let freedom = f64::from(truth.samples - 1);
    let expected: Vec<_> = (truth.mean.iter().zip(&truth.standard_error))
        .map(|(&mean, &error)| crate::statistics::Estimate { mean, error, freedom })
        .collect();
    assert_agreement("every pixel", &of_roulette(&scene), &expected, &truth.mean, bound);
    // And the same bound without, so that it is the scene's own.
    if size::is_full() {
        assert_as_reference("all paths", &scene, [96, 64], 1500, bound);
    }
}

/// A wall that glows evenly and reflects a lamp: what it emits is in every sample, however few of its reflections are evaluated.
#[test]
fn what_is_seen_before_scattering_is_exact() {
    let wall = quad(DVec3::new(-3.0, -3.0, 0.0), 6.0 * DVec3::X, 6.0 * DVec3::Y);
    let far = |builder: Builder| builder.film(8, 8, Filter::Box).bounces(3);
    let scene = far(Builder::new())
        .glowing(wall.clone(), 0.5, 2.0, Sides::Front)
        .lamp(sphere(DVec3::new(0.0, 2.0, 3.0), 0.05), 800.0, Sides::Front)
        .build();
    let rendered = render(&scene, 4, 64, thinned(1e-3, 3));
    rendered.assert_clean();
    let values = rendered.means.iter().flatten();
    let (least, most) = values.fold((f32::MAX, 0f32), |(least, most), value| (least.min(*value), most.max(*value)));
    // Of 64 samples one in 64 is evaluated at least, so that a third of the pixels has none of the lamp's light.
    assert_eq!(least, 2.0, "up to {most}");
    assert!(most > 2.1, "no light of the lamp: {most}");
    // Nothing but what is seen: not one bit is different.
    let sky = far(Builder::new()).sky(0.3).build();
    let values = |scale| render(&sky, 2, 64, Settings { scale, ..Settings::default() }).means;
    assert_eq!(values(None), values(Some(1e-3)));
}

/// Waves, tiles and units change no bit of it; the sampler and the seed do.
#[test]
fn machinery_changes_no_bit() {
    for (what, scene) in [("plain", plain(6)), ("everything", hot(3))] {
        let base = thinned(0.3, 5);
        let bits = |settings: Settings| {
            let rendered = render(&scene, 2, 64, settings);
            rendered.means.iter().flatten().map(|v| v.to_bits()).collect::<Vec<_>>()
        };
        let expected = bits(base);
        for paths in [300, 1000] {
            assert!(
                bits(Settings { budget: Budget { paths: Some(paths), memory: None }, ..base }) == expected,
                "{what}"
            );
        }
        assert!(bits(Settings { tile: [5, 3], ..base }) == expected, "{what}: tiles");
        assert!(bits(Settings { scale: Some(0.29), ..base }) != expected, "{what}: another scale");
        assert!(bits(Settings { seed: 6, ..base }) != expected, "{what}: another seed");
    }
}

/// What the pilot expects of the share of paths and of the noise, against what comes: where paths are independent.
#[test]
fn the_pilot_is_right_about_what_it_chooses() {
    let mut scene = plain(200);
    scene.integrator.evaluation = Evaluation::Roulette;
    scene.integrator.sampler = Sampler::Independent;
    let prepared = Arc::new(Prepared::new(&scene, 0).expect("a scene"));
    let choices = pilot::choose(&device::shared(), &prepared, &scene, None, &Arc::default()).expect("a pilot");
    println!("{}: scale {:?}, evaluated {:.3}", choices.reason, choices.scale, choices.evaluated);
    let scale = choices.scale.expect("it pays where paths differ so much");
    assert!(choices.evaluated < 0.7 && choices.variance <= 1.1 && choices.gain > 1.0, "{choices:?}");
    let grown = compare("as chosen", &scene, scale, 256, 0.02);
    let mean = grown.iter().sum::<f64>() / grown.len() as f64;
    // 256 epochs tell a variance within 9 %, and the channels are not independent.
    assert!((0.75..1.4).contains(&mean), "variance grows by {mean}");
}
