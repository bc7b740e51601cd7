//! The GPU renderer against the f64 reference, which shares no code with it: per pixel and channel, and per channel over
//! the image.
//!
//! Welch's t-test at ALPHA = 1e-4 a test, Sidak over pixels x channels (over channels for the image), fixed seeds. Each
//! scene states the largest standard errors it may have; the limits of t are about 6.5 (pixels) and 4.5 (image) of
//! them, so a bias of 2 to 3 % of a channel's mean over the image fails, and of 0.2 % in `small_biases`.

use glam::{DVec2, DVec3};
use spectile::device::prepared::{Features, Prepared};
use spectile::device::rng::hash;
use spectile::scene::{Distortion, Filter, Line, Mesh, Projection, Sampler, Scene, Shape, Sides, Wavelengths};
use spectile::spectral::{Channels, Curve, Outside, Response};

use crate::device::{Settings, render};
use crate::scene_builder::*;
use crate::statistics::*;
use crate::truth;

/// The origin offset of a few scattering events in rooms a few times larger than what stands in them, and the tables'
/// pointwise bound of 1e-4: relative to the image's mean.
const ALLOWANCE: f64 = 3e-4;

/// Samples a pixel of the two renderers, the largest standard error of a pixel and of the image relative to the
/// channel's mean.
struct Effort {
    epochs: u32,
    reference: u32,
    pixel: f64,
    image: f64,
}

const USUAL: Effort = Effort { epochs: 20, reference: 2_560, pixel: 0.25, image: 0.006 };

fn compare(what: &str, scene: &Scene, effort: &Effort) {
    let ours = render(scene, effort.epochs, 64, Settings { seed: 11, tile: [8, 8], ..Settings::default() });
    ours.assert_clean();
    let reference = truth::render_image(scene, effort.reference, 12);
    let channels = scene.channels.len();
    let freedom = f64::from(effort.reference - 1);

    let images = image_estimates(&reference.mean, &reference.standard_error, channels, freedom);
    let means: Vec<f64> = images.iter().map(|e| e.mean).collect();
    let bound = Bound { resolution: effort.image, allowance: ALLOWANCE };
    assert_agreement(&format!("{what}, image"), &ours.image_means(), &images, &means, bound);

    let values: Vec<Estimate> = (reference.mean.iter().zip(&reference.standard_error))
        .map(|(mean, error)| Estimate { mean: *mean, error: *error, freedom })
        .collect();
    // A single pixel may lie in a corner, where an offset matters ten times more.
    let bound = Bound { resolution: effort.pixel, allowance: 10.0 * ALLOWANCE };
    let scales: Vec<f64> = (0..values.len()).map(|i| means[i % channels]).collect();
    assert_agreement(&format!("{what}, pixels"), &ours.values(), &values, &scales, bound);
}

fn features(scene: &Scene) -> Features {
    Prepared::new(scene, 0).unwrap().features
}

// ---- Spectra

/// A jagged table of `n` nodes from 370 to 790 nm, values between `low` and `high`, ends and nodes on no channel's edge.
fn jagged(n: u32, seed: u32, low: f64, high: f64) -> Curve {
    let nm = (0..n).map(|i| 370.3 + 419.1 * f64::from(i) / f64::from(n - 1)).collect();
    let value = (0..n).map(|i| low + (high - low) * f64::from(hash(seed << 16 ^ i)) / 4_294_967_296.0).collect();
    Curve::Linear { nm, value, outside: Outside::Hold }
}

/// Steps inside channels.
fn stepped(levels: [f64; 3]) -> Curve {
    let [a, b, c] = levels;
    Curve::Linear {
        nm: vec![380.0, 487.3, 487.3, 611.9, 611.9, 780.0],
        value: vec![a, a, b, b, c, c],
        outside: Outside::Hold,
    }
}

/// Lines of 0.4 nm on a low continuum: no affordable number of strata resolves them.
fn lines() -> Curve {
    let mut points = vec![(370.0, 0.4)];
    for line in [404.66, 435.83, 546.07, 578.02, 667.8] {
        points.extend([(line - 0.2, 0.4), (line, 20.0), (line + 0.2, 0.4)]);
    }
    points.push((790.0, 0.4));
    let (nm, value) = points.into_iter().unzip();
    Curve::Linear { nm, value, outside: Outside::Zero }
}

// ---- Scenes

fn wide() -> Projection {
    Projection::Perspective { tan_half: DVec2::new(0.8, 0.7) }
}

/// A box standing in the room.
fn block(min: DVec3, max: DVec3) -> Shape {
    match room(min, max) {
        Shape::Mesh(mut mesh) => {
            mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            Shape::Mesh(mesh)
        }
        other => other,
    }
}

/// A line of a scanner that flies past and turns.
fn scanned(i: i32) -> Line {
    let i = f64::from(i);
    let forward = DVec3::new(0.05 * i - 0.2, -0.3 + 0.02 * i * i, -1.0).normalize();
    let right = forward.cross(DVec3::new(0.1 * i, 1.0, 0.0)).normalize();
    Line { position: DVec3::new(0.3 - 0.05 * i, 0.9 - 0.25 * i, 2.2), forward, right, nose: forward.cross(right) }
}

/// One wall of the room [-1, 1]³, facing inwards.
fn wall(axis: DVec3) -> Shape {
    let (u, v) = axis.any_orthonormal_pair();
    quad(axis - u - v, 2.0 * v, 2.0 * u)
}

/// Several meshes as one.
fn joined(shapes: impl IntoIterator<Item = Shape>) -> Shape {
    let mut all = Mesh::default();
    for shape in shapes {
        let Shape::Mesh(mesh) = shape else { unreachable!("only meshes are joined") };
        let first = all.positions.len() as u32;
        all.positions.extend(mesh.positions);
        all.triangles.extend(mesh.triangles.iter().map(|t| t.map(|i| first + i)));
    }
    Shape::Mesh(all)
}

/// A room in the manner of Cornell's: coloured walls, two boxes, a lamp below the ceiling.
fn cornell(channels: Channels) -> Builder {
    Builder::new()
        .camera(look(DVec3::new(0.0, 0.0, 0.95), DVec3::new(0.0, -0.1, 0.0), DVec3::Y, wide()))
        .film(8, 8, Filter::Box)
        .channels(channels)
        .bounces(3)
        .diffuse(wall(DVec3::NEG_X), jagged(23, 1, 0.1, 0.9))
        .diffuse(wall(DVec3::X), jagged(6, 12, 0.1, 0.6))
        .diffuse(joined([DVec3::Y, DVec3::NEG_Y, DVec3::NEG_Z, DVec3::Z].map(wall)), 0.7)
        .diffuse(block(DVec3::new(-0.6, -1.0, -0.6), DVec3::new(-0.1, 0.2, -0.1)), 0.6)
        .diffuse(block(DVec3::new(0.2, -1.0, -0.3), DVec3::new(0.6, -0.5, 0.2)), jagged(14, 13, 0.4, 0.9))
}

fn lamp_quad(y: f64) -> Shape {
    quad(DVec3::new(-0.3, y, -0.3), 0.6 * DVec3::X, 0.6 * DVec3::Z)
}

/// Few spectra, which vary within channels: in registers as lines with kinks where channels have few nodes, by strata where they have
/// more, knots where those do not resolve them.
#[test]
fn cornell_like_room() {
    for (sampler, count) in [(Sampler::Sobol, 40), (Sampler::Independent, 33), (Sampler::Sobol, 3)] {
        let lamp = if count == 33 { jagged(110, 2, 2.9, 3.0) } else { jagged(9, 2, 1.0, 3.0) };
        let mut scene = cornell(Channels::equal(380.0, 780.0, count)).lamp(lamp_quad(0.98), lamp, Sides::Front).build();
        scene.integrator.sampler = sampler;
        let prepared = Prepared::new(&scene, 0).unwrap();
        let f = prepared.features;
        assert!(!f.shapes && !f.environment && f.few_triangles, "{f:?}");
        let held = (f.registers, prepared.tables.kinks > 0, f.strata, f.knots);
        let expected = match count {
            40 => (true, true, false, false),
            33 => (true, false, true, false),
            _ => (false, false, true, true),
        };
        assert_eq!(held, expected, "{count} channels: registers, kinks, strata, knots");
        compare("Cornell-like", &scene, &USUAL);
    }
}

/// The same with a constant spectrum each: registers without strata; and roulette.
#[test]
fn grey_room_with_roulette() {
    let mut b =
        Builder::new().camera(look(DVec3::new(0.0, 0.0, 0.95), DVec3::ZERO, DVec3::Y, wide())).film(8, 8, Filter::Box);
    for (axis, reflectance) in [
        (DVec3::X, 0.9),
        (DVec3::NEG_X, 0.3),
        (DVec3::Y, 0.03),
        (DVec3::NEG_Y, 0.8),
        (DVec3::NEG_Z, 0.6),
        (DVec3::Z, 0.5),
    ] {
        b = b.diffuse(wall(axis), reflectance);
    }
    let scene = b.bounces(12).roulette(1).lamp(lamp_quad(0.5), 2.0, Sides::Both).build();
    let f = features(&scene);
    assert!(f.registers && !f.strata && f.roulette);
    compare("roulette", &scene, &Effort { epochs: 32, ..USUAL });
}

/// Narrow lines (knots), more than eight spectra (tables), black bodies, a Gaussian filter, a crop, a thin lens.
#[test]
fn many_spectra_with_lines() {
    let mut b = cornell(Channels::from_bounds(
        vec![[380.0, 520.0], [540.0, 550.0], [500.0, 780.0], [430.0, 440.0], [3000.0, 12000.0]],
        None,
    ));
    for i in 0..8 {
        let at = DVec3::new(-0.7 + 0.2 * f64::from(i), -0.8, 0.3 - 0.1 * f64::from(i % 3));
        b = b.diffuse(
            icosphere(at, 0.09, 1),
            if i == 0 { stepped([0.9, 0.2, 0.6]) } else { jagged(5 + 3 * i, 30 + i, 0.2, 0.95) },
        );
    }
    let lens = Projection::ThinLens { tan_half: DVec2::new(0.8, 0.7), aperture_radius: 0.05, focus_distance: 1.2 };
    let mut scene = b
        .camera(look(DVec3::new(0.1, 0.1, 0.9), DVec3::new(0.0, -0.3, 0.0), DVec3::Y, lens))
        .film(16, 12, Filter::Gaussian)
        .lamp(lamp_quad(0.98), lines(), Sides::Front)
        .lamp(
            quad(DVec3::new(0.5, 0.2, -0.9), 0.3 * DVec3::X, 0.3 * DVec3::Y),
            Curve::Blackbody { kelvin: 900.0, scale: 0.2 },
            Sides::Both,
        )
        .glowing(
            icosphere(DVec3::new(-0.5, 0.5, -0.5), 0.2, 1),
            jagged(40, 3, 0.0, 0.5),
            Curve::Blackbody { kelvin: 1800.0, scale: 0.01 },
            Sides::Front,
        )
        .build();
    scene.film.crop = [5, 3, 12, 10];
    scene.integrator.sampler = Sampler::Sobol;
    // Drawn by emission, they would have strata that end at nodes, and no need of knots.
    scene.integrator.wavelengths = Wavelengths::Uniform;
    let f = features(&scene);
    assert!(!f.registers && f.strata && f.knots && f.thin_lens && f.gaussian && !f.shapes);
    compare("many spectra", &scene, &Effort { epochs: 48, reference: 16_384, pixel: 0.4, image: 0.018 });
}

/// More than eight spectra without lines: tables without knots.
#[test]
fn many_plain_spectra() {
    let mut b = cornell(Channels::equal(400.0, 760.0, 45));
    for i in 0..9 {
        let at = DVec3::new(-0.8 + 0.2 * f64::from(i), -0.9, 0.4);
        b = b.diffuse(sphere(at, 0.09), jagged(4 + i, 60 + i, 0.1, 0.95));
    }
    let scene = b.lamp(lamp_quad(0.9), jagged(12, 4, 0.5, 2.0), Sides::Both).build();
    let f = features(&scene);
    assert!(!f.registers && f.strata && !f.knots && f.shapes);
    compare("plain tables", &scene, &Effort { epochs: 40, reference: 4096, ..USUAL });
}

/// Every shape as a lamp, seen from outside, one side and both, under a sky, before one-sided surfaces; four cameras,
/// mirrored film.
#[test]
fn lamps_of_every_shape_and_a_sky() {
    let floor = || quad(DVec3::new(-2.0, -1.0, 2.0), 4.0 * DVec3::X, 4.0 * DVec3::NEG_Z);
    let tan_half = DVec2::new(0.7, 0.6);
    let projections = [
        Projection::Perspective { tan_half },
        Projection::Orthographic { half_size: DVec2::new(1.5, 1.2) },
        Projection::ThinLens { tan_half, aperture_radius: 0.2, focus_distance: 2.0 },
        Projection::Latlong,
        Projection::Pushbroom { half_width: 0.7, half_pixel: 0.08, lines: (0..7).map(scanned).collect() },
    ];
    for (i, projection) in projections.into_iter().enumerate() {
        let is_lens = matches!(projection, Projection::Perspective { .. } | Projection::ThinLens { .. });
        let sides = if i == 1 { Sides::Front } else { Sides::Both };
        let mut scene = Builder::new()
            .camera(look(DVec3::new(0.3, 0.4, 2.2), DVec3::new(0.0, -0.3, 0.0), DVec3::Y, projection))
            .film(9, 7, Filter::Gaussian)
            .channels(Channels::equal(400.0, 700.0, 4))
            .bounces(3)
            .diffuse(floor(), jagged(7, 5, 0.2, 0.9))
            .one_sided(quad(DVec3::new(-1.6, -0.9, -1.5), 2.0 * DVec3::X, 2.0 * DVec3::Y), 0.8)
            .one_sided(quad(DVec3::new(0.5, -0.9, -1.5), 1.2 * DVec3::Y, 1.2 * DVec3::X), 0.8)
            .one_sided(disk(DVec3::new(1.2, 0.2, 0.0), DVec3::new(-1.0, 0.2, 0.3), 0.4), 0.7)
            .black(sphere(DVec3::new(0.9, -0.8, 0.5), 0.2))
            .lamp(sphere(DVec3::new(-0.8, -0.4, 0.0), 0.3), jagged(6, 6, 1.0, 2.0), sides)
            .glowing(disk(DVec3::new(0.2, 0.9, 0.1), DVec3::new(0.1, -1.0, 0.2), 0.3), 0.5, 3.0, sides)
            .lamp(
                Shape::Cylinder { from: DVec3::new(-0.1, -0.9, 0.7), to: DVec3::new(0.3, -0.6, 0.4), radius: 0.1 },
                2.0,
                sides,
            )
            .glowing(
                quad(DVec3::new(0.6, -0.9, -0.4), 0.4 * DVec3::X, 0.4 * DVec3::Y),
                0.3,
                stepped([4.0, 0.0, 2.0]),
                sides,
            )
            .sky(jagged(5, 7, 0.2, 0.5))
            .build();
        if is_lens {
            scene.camera.distortion = Some(Distortion { radial: [-0.25, 0.1, 0.02], tangential: [0.03, -0.02] });
        }
        if i == 2 {
            scene.camera.right = -scene.camera.right;
            scene.integrator.sampler = Sampler::Sobol;
        }
        compare(["perspective", "orthographic", "thin lens", "latlong", "pushbroom"][i], &scene, &USUAL);
    }
}

/// Inside a glowing sphere, with lamps that are partly inside one another and a cylinder open at both ends.
#[test]
fn inside_a_sphere_lamp() {
    for roulette in [0, 3] {
        let scene = Builder::new()
            .camera(look(DVec3::new(0.2, 0.3, 1.2), DVec3::new(0.0, -0.2, 0.0), DVec3::Y, wide()))
            .film(8, 8, Filter::Box)
            .channels(Channels::equal(400.0, 700.0, 2))
            .bounces(5)
            .roulette(roulette)
            .glowing(sphere(DVec3::ZERO, 1.5), jagged(6, 8, 0.2, 0.7), 0.3, Sides::Both)
            .glowing(
                Shape::Cylinder { from: DVec3::new(-0.9, -0.6, 0.0), to: DVec3::new(0.9, -0.4, 0.2), radius: 0.35 },
                0.6,
                jagged(6, 9, 0.5, 2.0),
                Sides::Both,
            )
            .glowing(sphere(DVec3::new(0.5, 0.3, -0.3), 0.3), 0.5, 1.0, Sides::Front)
            .diffuse(sphere(DVec3::new(-0.5, 0.3, -0.3), 0.3), 0.9)
            .build();
        compare("inside a lamp", &scene, &USUAL);
    }
}

/// A lamp in a box under a sky a hundred thousand times as strong in total, which comes in through one opening.
#[test]
fn weak_lamp_under_a_strong_sky() {
    // The ceiling leaves a gap; the lamp has 320 triangles.
    let scene = Builder::new()
        .camera(look(DVec3::new(0.0, 0.0, 0.9), DVec3::ZERO, DVec3::Y, wide()))
        .film(6, 6, Filter::Box)
        .channels(Channels::equal(400.0, 700.0, 2))
        .bounces(2)
        .diffuse(joined([DVec3::X, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z, DVec3::Z].map(wall)), 0.6)
        .diffuse(quad(DVec3::new(-1.0, 1.0, -1.0), 1.5 * DVec3::X, 2.0 * DVec3::Z), 0.6)
        .lamp(icosphere(DVec3::new(-0.3, -0.2, -0.3), 0.05, 2), 1.0, Sides::Front)
        .sky(stepped([20.0, 10.0, 5.0]))
        .build();
    compare("strong sky", &scene, &Effort { epochs: 32, reference: 4096, pixel: 0.4, image: 0.015 });
}

/// Walls that glow, each in its own way, so that paths differ little: a bias of 0.2 % of any channel's mean fails.
#[test]
fn small_biases() {
    let mut b = Builder::new()
        .camera(look(DVec3::new(0.0, 0.0, 0.95), DVec3::new(0.0, -0.1, 0.0), DVec3::Y, wide()))
        .film(4, 4, Filter::Box)
        .channels(Channels::equal(380.0, 780.0, 5))
        .bounces(4);
    for (i, axis) in [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z].into_iter().enumerate() {
        let sides = if i % 2 == 0 { Sides::Front } else { Sides::Both };
        let (reflectance, radiance) = (0.3 + 0.1 * i as f64, jagged(5 + i as u32, 70 + i as u32, 0.8, 1.2));
        b = b.glowing(wall(axis), reflectance, radiance, sides);
    }
    let mut scene = b
        .glowing(block(DVec3::new(-0.6, -1.0, -0.6), DVec3::new(-0.1, 0.2, -0.1)), 0.6, 0.8, Sides::Front)
        .glowing(sphere(DVec3::new(0.4, -0.4, 0.0), 0.3), 0.8, 1.1, Sides::Front)
        .build();
    scene.integrator.sampler = Sampler::Sobol;
    compare("small biases", &scene, &Effort { epochs: 160, reference: 40_000, pixel: 0.01, image: 0.0004 });
}

/// Responses that overlap, one that is narrow and one far away, over spectra with a step and a line; the reference draws
/// wavelengths over each whole support.
#[test]
fn responses() {
    let response = |nm: &[f64], value: &[f64]| Response::new(nm.to_vec(), value.to_vec()).expect("a response");
    let named = [
        ("wide", response(&[420.0, 500.0, 600.0, 680.0], &[0.0, 1.0, 0.2, 0.9])),
        ("narrow", response(&[590.0, 600.0, 610.0], &[0.0, 1.0, 0.0])),
        ("other", response(&[560.0, 640.0, 720.0], &[0.0, 2.0, 0.0])),
        ("thermal", response(&[8000.0, 9000.0, 12_000.0], &[0.5, 1.0, 0.0])),
    ];
    let named = named.into_iter().map(|(name, response)| (name.to_owned(), response)).collect();
    let table =
        |nm: &[f64], value: &[f64]| Curve::Linear { nm: nm.to_vec(), value: value.to_vec(), outside: Outside::Hold };
    let lamp = table(&[500.0, 550.0, 550.0, 595.0, 600.0, 605.0, 9000.0], &[1.0, 2.0, 4.0, 1.0, 9.0, 1.0, 3.0]);
    let scene = Builder::new()
        .camera(look(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, DVec3::Y, narrow()))
        .film(8, 8, Filter::Box)
        .channels(Channels::from_responses(named, None))
        .bounces(3)
        .diffuse(
            quad(DVec3::new(-2.0, -2.0, 0.0), DVec3::X * 4.0, DVec3::Y * 4.0),
            table(&[400.0, 600.0, 700.0, 10_000.0], &[0.2, 0.8, 0.5, 0.9]),
        )
        .lamp(quad(DVec3::new(-0.5, 1.0, 0.5), DVec3::X, DVec3::Z), lamp, Sides::Both)
        .sky(0.1)
        .build();
    compare("responses", &scene, &USUAL);
}
