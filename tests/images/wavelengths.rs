//! Wavelengths drawn by what emits (`wavelengths = "emission"`; docs/METHOD.md) against even ones (Eq. 4 of Hoarau et al. 2018) and
//! against the f64 reference, which knows nothing but even ones: the same radiance, with less noise where emission is spiky.

use glam::{DVec2, DVec3};
use spectile::device::prepared::Prepared;
use spectile::scene::{Field, Filter, Projection, Sampler, Scene, Sides, Wavelengths};
use spectile::spectral::{Channels, Curve, Outside, Response};

use crate::device::{Settings, render};
use crate::scene_builder::heat::infrared;
use crate::scene_builder::*;
use crate::size;
use crate::statistics::*;
use crate::truth;

/// Lines of 1 nm at those of mercury and sodium, and nothing between: `nm` scaled by `stretch`.
fn lines(stretch: f64, peak: f64) -> Curve {
    let mut points = Vec::new();
    for line in [404.66, 435.83, 546.07, 578.02, 589.3] {
        points.extend([(-0.5, 0.0), (0.0, peak), (0.5, 0.0)].map(|(off, value)| (stretch * (line + off), value)));
    }
    let (nm, value) = points.into_iter().unzip();
    Curve::Linear { nm, value, outside: Outside::Zero }
}

fn table(points: &[(f64, f64)], outside: Outside) -> Curve {
    let (nm, value) = points.iter().copied().unzip();
    Curve::Linear { nm, value, outside }
}

/// A room under a lamp of lines; a weak lamp shines where those do not, and nothing does in the last channel.
fn lit_room(channels: Channels) -> Builder {
    let weak = table(&[(380.0, 0.02), (480.0, 0.05), (650.0, 0.03), (700.0, 0.0)], Outside::Zero);
    let down = |x: f64| quad(DVec3::new(x, 0.97, -0.3), 0.5 * DVec3::X, 0.5 * DVec3::Z);
    Builder::new()
        .camera(look(
            DVec3::new(0.0, 0.0, 0.95),
            DVec3::NEG_Z,
            DVec3::Y,
            Projection::Perspective { tan_half: DVec2::splat(0.8) },
        ))
        .film(8, 8, Filter::Box)
        .channels(channels)
        .bounces(3)
        .diffuse(
            room(DVec3::NEG_ONE, DVec3::ONE),
            table(&[(380.0, 0.3), (546.0, 0.8), (546.5, 0.1), (780.0, 0.6)], Outside::Hold),
        )
        .lamp(down(-0.7), lines(1.0, 30.0), Sides::Front)
        .lamp(down(0.2), weak, Sides::Front)
}

fn visible(count: usize) -> Channels {
    Channels::equal(380.0, 780.0, count)
}

fn with(scene: &Scene, wavelengths: Wavelengths) -> Scene {
    let mut scene = scene.clone();
    scene.integrator.wavelengths = wavelengths;
    scene
}

/// Both ways give one answer, per channel over the image. Gives the ratios of their variances, uniform over emission, along the
/// same paths: where wavelengths are even they are the same, so that the errors taken as independent are too large, if anything.
fn compare(what: &str, scene: &Scene, epochs: u32, resolution: f64) -> Vec<f64> {
    let of = |wavelengths, seed| {
        let rendered = render(&with(scene, wavelengths), epochs, 64, Settings { seed, ..Settings::default() });
        rendered.assert_clean();
        rendered.image_means()
    };
    let (uniform, emission) = (of(Wavelengths::Uniform, 1), of(Wavelengths::Emission, 1));
    let scale: Vec<f64> = emission.iter().map(|e| e.mean).collect();
    // Tables are held to 1e-4 of a channel's peak, which is up to ten times its mean here.
    assert_agreement(what, &uniform, &emission, &scale, Bound { resolution, allowance: 1e-3 });
    let lit = uniform.iter().zip(&emission).filter(|(_, e)| e.mean > 0.0);
    let ratios: Vec<f64> = lit.map(|(u, e)| (u.error / e.error).powi(2)).collect();
    println!("{what}: variance, uniform over emission: {ratios:.2?}");
    ratios
}

fn against_reference(what: &str, scene: &Scene, [epochs, samples]: [u32; 2], resolution: f64) {
    let rendered = render(scene, epochs, 64, Settings { seed: 3, ..Settings::default() });
    rendered.assert_clean();
    let reference = truth::render_image(scene, samples, 4);
    let (channels, freedom) = (scene.channels.len(), f64::from(samples - 1));
    let image = image_estimates(&reference.mean, &reference.standard_error, channels, freedom);
    let scale: Vec<f64> = image.iter().map(|e| e.mean).collect();
    assert_agreement(what, &rendered.image_means(), &image, &scale, Bound { resolution, allowance: 1e-3 });
}

#[test]
fn a_lamp_of_lines_in_few_channels() {
    for count in size::first(2, [8, 40, 4]) {
        let scene = lit_room(visible(count)).build();
        let prepared = Prepared::new(&scene, 0).expect("a scene");
        assert!(prepared.warp.bits() > 0 && prepared.features.registers != prepared.tables.has_knots());
        let ratios = compare(&format!("{count} channels"), &scene, 64, 0.2);
        // A line fills a hundredth of the first of 4 channels, a tenth of one of 40.
        let gained = ratios.iter().copied().fold(0.0, f64::max);
        assert!(gained > 40.0 / count as f64, "{gained}");
    }
    against_reference("8 channels", &lit_room(visible(8)).build(), [64, 8192], 0.1);
}

fn several(scene: &Scene, count: u32) -> Scene {
    let mut scene = scene.clone();
    scene.integrator.wavelengths_per_channel = Some(count);
    scene
}

/// Four wavelengths a channel and one: the same means. Gives the ratios of their variances, one over four.
fn compare_several(what: &str, scene: &Scene, epochs: u32, resolution: f64) -> Vec<f64> {
    let of = |count, seed| {
        let rendered = render(&several(scene, count), epochs, 64, Settings { seed, ..Settings::default() });
        rendered.assert_clean();
        rendered.image_means()
    };
    let (one, four) = (of(1, 1), of(4, 2));
    let scale: Vec<f64> = four.iter().map(|e| e.mean).collect();
    assert_agreement(what, &one, &four, &scale, Bound { resolution, allowance: 1e-3 });
    let ratios: Vec<f64> = one.iter().zip(&four).map(|(a, b)| (a.error / b.error).powi(2)).collect();
    println!("{what}: variance, one wavelength over four: {ratios:.2?}");
    ratios
}

/// Spiky lamps and paints in registers and in tables, responses, and glass behind whose dispersion only a path's own wavelength counts.
#[test]
fn several_wavelengths_a_channel_have_the_same_means() {
    let room = with(&lit_room(visible(4)).build(), Wavelengths::Uniform);
    let ratios = compare_several("a room", &room, 64, 0.3);
    // Nothing but wavelengths differs much: in channels with a line at least half of four is won.
    assert!(ratios.iter().copied().fold(0.0, f64::max) > 2.0, "{ratios:?}");

    let sensor = Response::new(vec![480.0, 550.0, 600.0], vec![0.0, 1.0, 0.0]).expect("a response");
    let channels = Channels::from_responses(vec![("green".into(), sensor)], None);
    compare_several("a response", &lit_room(channels).build(), 64, 0.2);

    for roughness in size::first(2, [0.0, 0.02, 0.15]) {
        let ball = surfaces::dispersive_ball(Channels::equal(400.0, 700.0, 4), roughness);
        compare_several(&format!("glass of roughness {roughness}"), &ball, 16, 0.12);
    }
}

/// The equivalent width of a Lorentz line in a channel of 200 half widths, in the mean of 256 samples of a pixel: known within 1e-3 with
/// 16 wavelengths a sample, and far from that with one.
#[test]
fn a_line_in_a_wide_channel() {
    for (x, published) in [(1.0, 4.23279359), (10.0, 15.6511644)] {
        let (line, channels, expected) = heat::lorentz_line(x, published);
        let lamp = |b: Builder| b.lamp(disk(DVec3::ZERO, DVec3::Z, 2.0), 1.0, Sides::Front);
        let mut scene = heat::slab(0.0, None, |b| lamp(b.channels(channels))).build();
        scene.spectra[scene.media[0].components[0].absorbers[0].columns[0].1].curve = line;
        scene.integrator.sampler = Sampler::Sobol;
        scene.film.width = 16;
        scene.film.height = 16;
        scene.film.crop = [0, 0, 16, 16];
        // Root mean square of the pixels' errors, of the width.
        let error = |count| {
            let rendered = render(&several(&scene, count), 1, 256, Settings { seed: 9, ..Settings::default() });
            rendered.assert_clean();
            let errors = rendered.means[0].iter().map(|v| f64::from(*v) - expected);
            (errors.map(|e| e * e).sum::<f64>() / 256.0).sqrt() / (1.0 - expected)
        };
        let (one, many) = (error(1), error(16));
        println!("x = {x}: error of the width {one:.1e} with one wavelength a channel, {many:.1e} with 16");
        assert!(many < 1e-3 && many < 0.2 * one, "{one} {many}");
    }
}

/// More spectra than registers hold, and lookups by strata or knots; responses as well.
#[test]
fn tables_and_responses() {
    let many = |channels: Channels| {
        let mut builder = lit_room(channels);
        for i in 0..8 {
            let at = DVec3::new(0.2 * f64::from(i) - 0.7, -0.8, -0.2);
            builder =
                builder.diffuse(sphere(at, 0.1), table(&[(380.0, 0.1 * f64::from(i)), (780.0, 0.5)], Outside::Hold));
        }
        builder.build()
    };
    let scene = many(visible(6));
    assert!(!Prepared::new(&scene, 0).expect("a scene").features.registers);
    compare("tables", &scene, 64, 0.2);

    let sensor = |name: &str, nm: [f64; 3]| {
        (name.to_owned(), Response::new(nm.to_vec(), vec![0.0, 1.0, 0.0]).expect("a response"))
    };
    let sensors = vec![sensor("blue", [390.0, 450.0, 500.0]), sensor("green", [480.0, 550.0, 600.0])];
    let scene = many(Channels::from_responses(sensors, None));
    assert!(Prepared::new(&scene, 0).expect("a scene").path_weight.is_some());
    compare("responses", &scene, 64, 0.2);
}

/// A uniform sky of lines, a sun, a hot wall and a hot gas of narrow lines, over a metal and a plastic: 2 to 8 µm.
#[test]
fn heat_gases_and_the_sky() {
    let absorption = lines(8.0, 3.0);
    let scene = Builder::new()
        .camera(look(
            DVec3::new(0.0, 0.5, 4.0),
            DVec3::ZERO,
            DVec3::Y,
            Projection::Perspective { tan_half: DVec2::splat(0.4) },
        ))
        .film(8, 8, Filter::Box)
        .channels(infrared())
        .bounces(3)
        .diffuse(quad(DVec3::new(-2.0, -1.0, 2.0), 4.0 * DVec3::X, 4.0 * DVec3::NEG_Z), 0.3)
        .at_kelvin(320.0)
        .conductor(sphere(DVec3::new(-0.7, -0.4, 0.0), 0.5), 1.5, 4.0, [0.3; 2])
        .at_kelvin(600.0)
        .plastic(sphere(DVec3::new(0.7, -0.4, 0.0), 0.5), 0.6, 1.5, 0.2)
        .sky(lines(7.0, 1e-3))
        .sun(DVec3::new(0.3, -1.0, -0.2), 0.05, table(&[(2000.0, 1e-3), (8000.0, 1e-5)], Outside::Hold))
        .medium(absorption, Some(Field::Constant(900.0)), Field::Constant(1.0))
        .null(sphere(DVec3::new(0.0, 0.6, 0.0), 0.5))
        .build();
    assert!(Prepared::new(&scene, 0).expect("a scene").warp.bits() > 0);
    compare("heat, gases, sky", &scene, 16, 0.05);
    against_reference("heat, gases, sky", &scene, [16, 1024], 0.05);
}

/// Nothing emits in most channels, and lamps that are even within them: even wavelengths, and nothing is paid for.
#[test]
fn even_emission_costs_nothing() {
    let mut scene = lit_room(visible(8)).build();
    let even = table(&[(380.0, 1.0), (780.0, 2.0)], Outside::Hold);
    scene.spectra.iter_mut().filter(|s| s.curve == lines(1.0, 30.0)).for_each(|s| s.curve = even.clone());
    let prepared = Prepared::new(&scene, 0).expect("a scene");
    let uniform = Prepared::new(&with(&scene, Wavelengths::Uniform), 0).expect("a scene");
    assert_eq!((prepared.path_weight, prepared.features), (None, uniform.features));
    assert_eq!(prepared.tables.strata, uniform.tables.strata);
}
