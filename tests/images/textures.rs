//! Textures, texture coordinates, shading normals and tangents: the f64 reference and the device, each against closed
//! forms, and the device against the reference, which shares no code with it.
//!
//! Bounds as in `statistics`: a two-sided t-test, Sidak-corrected over the values of a test, plus a stated allowance; and
//! a largest standard error.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec2, DVec3};
use spectile::scene::{
    Attributes, Filter, Mesh, Placement, Projection, Scene, Shape, Sides, TextureFilter, TextureKind,
};
use spectile::spectral::{Channels, Curve, Outside, upsample};

use crate::device::{Settings, render};
use crate::scene_builder::*;
use crate::size;
use crate::statistics::{Bound, Estimate, assert_agreement};
use crate::truth;

pub fn of_device(scene: &Scene, epochs: u32, samples: u32, seed: u64) -> Vec<Estimate> {
    let ours = render(scene, epochs, samples, Settings { seed, tile: [8, 8], ..Settings::default() });
    ours.assert_clean();
    ours.values()
}

fn of_reference(scene: &Scene, samples: u32, seed: u64) -> Vec<Estimate> {
    let e = truth::render_image(scene, samples, seed);
    let freedom = f64::from(e.samples - 1);
    e.mean.iter().zip(&e.standard_error).map(|(&mean, &error)| Estimate { mean, error, freedom }).collect()
}

/// One value where every sample is the same: the reference to what a texture of at most 16 texels a metre and slope 1 a
/// texel changes over the footprint of [`narrow`], 4e-9 m; the device to `rounding`.
fn exact(what: &str, scene: &Scene, expected: &[f64], rounding: f64) {
    for (who, values, bound) in
        [("reference", of_reference(scene, 4, 1), 1e-7), ("device", of_device(scene, 2, 4, 1), rounding)]
    {
        for (k, (value, want)) in values.iter().zip(expected).enumerate() {
            let wrong = (value.mean - want).abs() > bound * want.abs().max(1.0);
            assert!(!wrong, "{what}, {who}, channel {k}: {} instead of {want}", value.mean);
            assert!(value.error <= bound * want.abs().max(1.0), "{what}, {who}, channel {k}: {value:?} is not exact");
        }
        assert_eq!(values.len(), expected.len());
    }
}

fn constant(values: [f64; 2]) -> Curve {
    let [a, b] = values;
    Curve::Linear { nm: vec![400.0, 500.0, 500.0, 600.0], value: vec![a, a, b, b], outside: Outside::Hold }
}

fn axes(axes: DMat3) -> Attributes {
    Attributes { axes: Some(axes), ..Attributes::default() }
}

/// Looks straight along -`normal` at `point`.
fn straight(point: DVec3, normal: DVec3) -> spectile::scene::Camera {
    look(point + 2.0 * normal, point, normal.any_orthonormal_vector(), narrow())
}

/// f32 coordinates in a picture of this many texels, and f32 itself.
fn texel_rounding(texels: f64) -> f64 {
    8.0 * texels * f64::from(f32::EPSILON) + 1e-6
}

// ---- Closed forms

/// A 2 x 2 picture of shares of two spectra on a plate under a sky of 1: worked out by hand, in both channels.
#[test]
fn abundances_mix_spectra() {
    // Rows from the top: (1, 0) (0.5, 0.25); (0, 1) (0.25, 0.25).
    let texels = [1.0, 0.0, 0.5, 0.25, 0.0, 1.0, 0.25, 0.25];
    let at = |u: f64, v: f64, expected: [f64; 2]| {
        let mut b = Builder::new().channels(Channels::from_bounds(vec![[410.0, 480.0], [520.0, 590.0]], None));
        let texture = b.mixture([2, 2], &texels, &[constant([0.8, 0.2]), constant([0.1, 0.6])]);
        let plate = quad(DVec3::ZERO, 2.0 * DVec3::X, DVec3::Y);
        let camera = straight(DVec3::new(2.0 * u, v, 0.0), DVec3::Z);
        let scene = b.camera(camera).sky(1.0).textured(plate, texture).attributes(quad_uv()).build();
        exact(&format!("({u}, {v})"), &scene, &expected, texel_rounding(2.0));
    };
    at(0.25, 0.75, [0.8, 0.2]);
    at(0.75, 0.25, [0.25 * 0.9, 0.25 * 0.8]);
    at(0.25, 0.25, [0.1, 0.6]);
    // Halfway between the upper two, and in the middle of all.
    at(0.5, 0.75, [0.75 * 0.8 + 0.125 * 0.1, 0.75 * 0.2 + 0.125 * 0.6]);
    at(0.5, 0.5, [0.4375 * 0.8 + 0.375 * 0.1, 0.4375 * 0.2 + 0.375 * 0.6]);
    // Over the left edge: a quarter of the way from the left to the right column.
    at(0.125, 0.75, [0.875 * 0.8 + 0.0625 * 0.1, 0.875 * 0.2 + 0.0625 * 0.6]);
}

/// A picture of colours shows the spectra of `rgb`, and between two texels half of both, from 360 nm to beyond the visible.
#[test]
fn colours_are_the_spectra_of_rgb() {
    let rgb: [[f32; 3]; 4] = [[0.8, 0.1, 0.05], [0.02, 0.3, 0.9], [0.5; 3], [0.0; 3]];
    let nm = [361.0, 420.0, 480.0, 530.0, 580.0, 620.0, 700.0, 900.0];
    // 10 pm: the slope within a channel is nothing.
    let channels = Channels::from_bounds(nm.iter().map(|nm| [*nm, nm + 0.01]).collect(), None);
    let spectrum = |texel: usize, nm: f64| upsample::reflectance(rgb[texel].map(f64::from)).eval(nm + 0.005);
    for (u, parts) in [
        (0.125, vec![(0, 1.0)]),
        (0.375, vec![(1, 1.0)]),
        (0.25, vec![(0, 0.5), (1, 0.5)]),
        (0.625, vec![(2, 1.0)]),
        (0.875, vec![(3, 1.0)]),
        (0.6875, vec![(2, 0.75), (3, 0.25)]),
    ] {
        let mut b = Builder::new().channels(channels.clone());
        let texture = b.texture([4, 1], rgb.as_flattened(), TextureKind::Colour);
        let plate = quad(DVec3::ZERO, 4.0 * DVec3::X, DVec3::Y);
        let camera = straight(DVec3::new(4.0 * u, 0.3, 0.0), DVec3::Z);
        let scene = b.camera(camera).sky(1.0).textured(plate, texture).attributes(quad_uv()).build();
        let expected: Vec<f64> =
            nm.iter().map(|nm| parts.iter().map(|(texel, w)| w * spectrum(*texel, *nm)).sum()).collect();
        // Coefficients of some 100 as f32 move x by 1e-5, S by half of that at most; the grid of `rgb` is as far off.
        let bound = 2e-5;
        for (k, value) in of_reference(&scene, 4, 2).iter().chain(&of_device(&scene, 2, 4, 2)).enumerate() {
            let want = expected[k % nm.len()];
            assert!((value.mean - want).abs() < bound, "u {u}, value {k}: {} instead of {want}", value.mean);
        }
    }
}

/// A picture whose texel (x, y) has reflectance value(x, y), on shapes of every kind: (u, v) as `Attributes` says them.
#[test]
fn every_shape_has_its_coordinates() {
    const SIZE: [u32; 2] = [16, 8];
    let texel =
        |x: i64, y: i64| (0.05 + 0.9 * ((x.rem_euclid(16) * 5 + y.rem_euclid(8) * 3) % 16) as f64 / 16.0) as f32;
    let texels: Vec<f32> = (0..8).flat_map(|y| (0..16).map(move |x| texel(x, y))).collect();
    // Bilinear by hand.
    let value = |u: f64, v: f64| {
        let (x, y) = (u * 16.0 - 0.5, (1.0 - v) * 8.0 - 0.5);
        let (i, j, s, t) = (x.floor() as i64, y.floor() as i64, x - x.floor(), y - y.floor());
        let at = |x: i64, y: i64| f64::from(texel(x, y));
        (1.0 - s) * (1.0 - t) * at(i, j)
            + s * (1.0 - t) * at(i + 1, j)
            + (1.0 - s) * t * at(i, j + 1)
            + s * t * at(i + 1, j + 1)
    };
    let check = |what: &str, shape: &Shape, attributes: &Attributes, point: DVec3, normal: DVec3, [u, v]: [f64; 2]| {
        let mut b = Builder::new();
        let texture = b.mixture(SIZE, &texels, &[Curve::Constant(1.0)]);
        let scene = b.camera(straight(point, normal)).sky(1.0).textured(shape.clone(), texture);
        let scene = scene.attributes(attributes.clone()).build();
        // Positions on round shapes are some ulp of their size beside where they should be.
        exact(&format!("{what} at {u}, {v}"), &scene, &[value(u, v)], 4.0 * texel_rounding(16.0));
    };
    let turn = |azimuth: f64| DVec3::new(azimuth.sin(), 0.0, azimuth.cos());
    let tilted = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.7);
    let mirrored = tilted * DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
    for (frame, name) in [(DMat3::IDENTITY, "upright"), (tilted, "tilted"), (mirrored, "mirrored")] {
        for (azimuth, height) in [(0.3, 0.2), (-2.0, -0.7), (3.0, 0.95), (1.5, -0.1)] {
            let (u, across) = (0.5 + azimuth / TAU, (1.0f64 - height * height).sqrt());
            let n = frame * (across * turn(azimuth) + height * DVec3::Y);
            let ball = sphere(DVec3::new(0.1, 0.2, -0.3), 0.8);
            let v = 0.5 + height.asin() / PI;
            check(&format!("{name} sphere"), &ball, &axes(frame), DVec3::new(0.1, 0.2, -0.3) + 0.8 * n, n, [u, v]);

            let (from, axis) = (DVec3::new(0.3, 0.0, 0.1), frame.y_axis);
            let tube = Shape::Cylinder { from, to: from + 1.5 * axis, radius: 0.4 };
            let (n, v) = (frame * turn(azimuth), 0.5 + 0.5 * height);
            check(&format!("{name} cylinder"), &tube, &axes(frame), from + 1.5 * v * axis + 0.4 * n, n, [u, v]);

            let plate = disk(from, axis, 0.7);
            let point = from + 0.7 * (1.0 - v) * n;
            check(&format!("{name} disk"), &plate, &axes(frame), point, axis, [u, v]);
        }
    }
    // A mesh: (u, v) far from 0, as they may be in a file.
    let corners = [DVec3::ZERO, DVec3::new(2.0, 0.1, 0.0), DVec3::new(0.3, 1.7, 0.4)];
    let uv = [DVec2::new(-3.25, 12.5), DVec2::new(-2.5, 12.875), DVec2::new(-3.125, 13.25)];
    let mesh = Shape::Mesh(Mesh { positions: corners.to_vec(), triangles: vec![[0, 1, 2]] });
    let attributes = Attributes { uv: Some(vec![uv]), ..Attributes::default() };
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
    for [b, c] in [[0.2, 0.3], [0.6, 0.1], [0.1, 0.8]] {
        let point = corners[0] + b * (corners[1] - corners[0]) + c * (corners[2] - corners[0]);
        let t = uv[0] + b * (uv[1] - uv[0]) + c * (uv[2] - uv[0]);
        check("mesh", &mesh, &attributes, point, normal, [t.x, t.y]);
    }
}

/// One triangle that pretends to be curved, and a lamp where its interpolated normal reflects the view: a mirror shows it
/// there, and shows the dark beside it.
#[test]
fn mirrors_follow_interpolated_normals() {
    let corners = [DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, -1.0, 0.0), DVec3::new(0.0, 1.0, 0.0)];
    let normals = corners.map(|p| (p * 0.3 + DVec3::Z).normalize());
    for [b, c] in [[0.2, 0.5], [0.4, 0.1], [1.0 / 3.0, 1.0 / 3.0]] {
        let at = [1.0 - b - c, b, c];
        let point: DVec3 = corners.iter().zip(at).map(|(p, w)| w * *p).sum();
        let normal = normals.iter().zip(at).map(|(n, w)| w * *n).sum::<DVec3>().normalize();
        let eye = DVec3::new(0.4, -0.3, 2.0);
        let incoming = (point - eye).normalize();
        let out = incoming - 2.0 * incoming.dot(normal) * normal;
        for (beside, expected) in [(0.0, 7.0), (0.02, 0.0)] {
            let across = out.any_orthonormal_vector();
            let target = point + 4.0 * out + 4.0 * beside * across;
            let mesh = Shape::Mesh(Mesh { positions: corners.to_vec(), triangles: vec![[0, 1, 2]] });
            let scene = Builder::new()
                .camera(look(eye, point, DVec3::Y, narrow()))
                .conductor(mesh, 1e-9, 3.0, [0.0; 2])
                .attributes(Attributes { normals: Some(vec![normals]), ..Attributes::default() })
                .lamp(disk(target, -out, 0.04), 7.0, Sides::Front)
                .build();
            exact(&format!("({b}, {c}), {beside} beside"), &scene, &[expected], 1e-5);
        }
    }
}

/// A smooth ball under a white sky sends out no more than it gets, and all of it where the facets are seen face on.
#[test]
fn shading_normals_gain_no_energy() {
    let scene = smooth_ball(2, &|b, ball| b.diffuse(ball, 1.0)).sky(1.0).film(8, 8, Filter::Box).bounces(4).build();
    let shown = [of_reference(&scene, 4000, 21), of_device(&scene, 8, 128, 21)];
    for values in &shown {
        for value in values {
            assert!(value.mean <= 1.0 + 5.0 * value.error + 1e-5, "{value:?}");
            assert!(value.mean > 0.9, "the loss is that of directions into facets: {value:?}");
        }
    }
    assert_agreement(
        "furnace",
        &shown[0],
        &shown[1],
        &vec![1.0; shown[0].len()],
        Bound { resolution: 0.01, allowance: 1e-4 },
    );
}

/// A mesh of one ball with the ball's own normals, added by `add`, in nothing.
fn smooth_ball(levels: u32, add: &dyn Fn(Builder, Shape) -> Builder) -> Builder {
    let shape = icosphere(DVec3::ZERO, 1.0, levels);
    let normals = round_normals(DVec3::ZERO, &shape);
    let wide = Projection::Perspective { tan_half: DVec2::splat(0.15) };
    let b = Builder::new().camera(look(DVec3::new(1.0, 2.0, 4.0), DVec3::ZERO, DVec3::Y, wide));
    add(b, shape).attributes(normals)
}

// ---- Device against reference

/// Welch's t-test, Sidak over pixels x channels, and over channels for the image; the largest standard errors relative to the
/// channel's mean over the image.
/// Samples of each of 16 epochs, and of the reference.
const USUAL: [u32; 2] = [256, 6000];
/// Where every pixel sees much of the light.
const FEW: [u32; 2] = [64, 1000];

pub fn against_reference(what: &str, scene: &Scene, samples: [u32; 2], [pixel, image]: [f64; 2]) {
    let channels = scene.channels.len();
    let theirs = of_reference(scene, samples[1], 31);
    let ours = render(scene, 16, samples[0], Settings { seed: 31, tile: [8, 8], ..Settings::default() });
    ours.assert_clean();
    let pixels = theirs.len() / channels;
    let mean = |k: usize| theirs.iter().skip(k).step_by(channels).map(|e| e.mean).sum::<f64>() / pixels as f64;
    let scales: Vec<f64> = (0..theirs.len()).map(|i| mean(i % channels)).collect();
    // The tables of `scattering` are within 1e-3: over four events, and in the mean.
    assert_agreement(what, &ours.values(), &theirs, &scales, Bound { resolution: pixel, allowance: 4e-3 });
    let of_image = |k: usize| {
        let error =
            theirs.iter().skip(k).step_by(channels).map(|e| e.error * e.error).sum::<f64>().sqrt() / pixels as f64;
        Estimate { mean: mean(k), error, freedom: theirs[0].freedom }
    };
    let their: Vec<Estimate> = (0..channels).map(of_image).collect();
    let means: Vec<f64> = (0..channels).map(mean).collect();
    let bound = Bound { resolution: image, allowance: 1e-3 };
    assert_agreement(&format!("{what}, image"), &ours.image_means(), &their, &means, bound);
}

fn slanted(blue: f64, red: f64) -> Curve {
    Curve::Linear { nm: vec![400.0, 700.0], value: vec![blue, red], outside: Outside::Hold }
}

/// A plate in a room with a lamp.
pub fn room_with(add: impl FnOnce(Builder) -> Builder) -> Scene {
    let wide = Projection::Perspective { tan_half: DVec2::splat(0.5) };
    let b = Builder::new()
        .camera(look(DVec3::new(0.1, 0.2, 2.9), DVec3::new(0.0, -0.2, 0.0), DVec3::Y, wide))
        .film(5, 5, Filter::Box)
        .channels(Channels::equal(400.0, 700.0, 3))
        .diffuse(room(DVec3::new(-1.0, -1.0, -1.0), DVec3::new(1.0, 1.0, 3.0)), slanted(0.3, 0.7))
        .lamp(quad(DVec3::new(-0.5, 0.99, -0.5), DVec3::X, DVec3::Z), slanted(4.0, 2.0), Sides::Front)
        .bounces(4);
    add(b).build()
}

pub fn plate() -> Shape {
    quad(DVec3::new(-0.7, -0.8, 0.1), DVec3::new(1.3, 0.0, -0.3), DVec3::new(0.0, 1.4, -0.4))
}

#[test]
fn textured_materials_are_those_of_the_reference() {
    let shares = [0.9, 0.0, 0.1, 0.6, 0.5, 0.5, 0.0, 0.2];
    let colours = [0.9, 0.2, 0.1, 0.1, 0.4, 0.9, 0.7, 0.7, 0.2, 0.05, 0.05, 0.05];
    let ends = [slanted(0.9, 0.2), slanted(0.1, 0.8)];
    against_reference(
        "mixture",
        &room_with(|mut b| {
            let texture = b.mixture([2, 2], &shares, &ends);
            b.textured(plate(), texture).attributes(quad_uv()).roulette(2)
        }),
        USUAL,
        [0.25, 0.03],
    );
    for roughness in size::first(1, [0.3, 0.0]) {
        against_reference(
            &format!("coated colours of roughness {roughness}"),
            &room_with(|mut b| {
                let texture = b.texture([2, 2], &colours, TextureKind::Colour);
                b.coated(plate(), texture, slanted(1.6, 1.5), roughness).attributes(quad_uv())
            }),
            USUAL,
            [0.25, 0.03],
        );
    }
    against_reference(
        "masked metal and textured paint",
        &room_with(|mut b| {
            let texture = b.mixture([2, 2], &shares, &ends);
            let mask = b.texture([3, 1], &[0.0, 0.4, 1.0], TextureKind::Number);
            let b = b.conductor(plate(), 0.2, 3.4, [0.3; 2]).textured(plate(), texture);
            b.masked_last_two(plate(), mask).attributes(quad_uv())
        }),
        USUAL,
        [0.25, 0.03],
    );
}

#[test]
fn smooth_and_brushed_surfaces_are_those_of_the_reference() {
    let lamp = |b: Builder| {
        let lamp = quad(DVec3::new(-1.0, 3.0, 1.0), DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.0, 0.5, 1.5));
        b.lamp(lamp, 5.0, Sides::Both).sky(0.3).film(5, 5, Filter::Box).bounces(3).build()
    };
    against_reference("smooth diffuse", &lamp(smooth_ball(1, &|b, ball| b.diffuse(ball, 0.7))), FEW, [0.25, 0.03]);
    against_reference(
        "smooth metal",
        &lamp(smooth_ball(1, &|b, ball| b.conductor(ball, 0.2, 3.4, [0.3; 2]))),
        FEW,
        [0.25, 0.03],
    );
    against_reference(
        "smooth glass",
        &lamp(smooth_ball(1, &|b, ball| b.dielectric(ball, 1.5, 0.2))),
        FEW,
        [0.25, 0.03],
    );

    // Brushed around a tilted axis; and by the coordinates of a mesh.
    let tilted = DMat3::from_axis_angle(DVec3::Z, 0.6);
    let wide = Projection::Perspective { tan_half: DVec2::splat(0.2) };
    let seen = || Builder::new().camera(look(DVec3::new(1.0, 2.0, 4.0), DVec3::ZERO, DVec3::Y, wide.clone()));
    let ball = sphere(DVec3::ZERO, 1.0);
    let brushed = seen().conductor(ball, 0.2, 3.4, [0.5, 0.1]).attributes(axes(tilted));
    against_reference("brushed ball", &lamp(brushed), FEW, [0.25, 0.03]);
}

/// Brushing follows u: a mesh whose u runs along y with roughness (a, b) is a quad, whose tangent is x, with (b, a).
#[test]
fn the_tangent_is_that_of_growing_u() {
    let corners =
        [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y].map(|p| 2.0 * p - DVec3::new(1.0, 1.0, 0.0));
    let mesh = || Shape::Mesh(Mesh { positions: corners.to_vec(), triangles: vec![[0, 1, 2], [2, 3, 0]] });
    let turned = |p: DVec3| DVec2::new(0.3 * p.y + 5.0, -0.2 * p.x);
    let uv = [[0, 1, 2], [2, 3, 0]].map(|t| t.map(|i: usize| turned(corners[i])));
    let scene = |roughness: [f64; 2], attributes: Attributes| {
        Builder::new()
            .camera(look(DVec3::new(0.0, -1.5, 2.0), DVec3::ZERO, DVec3::Y, narrow()))
            .conductor(mesh(), 0.2, 3.4, roughness)
            .attributes(attributes)
            .lamp(quad(DVec3::new(1.0, 1.0, 1.5), DVec3::X, DVec3::Y), 9.0, Sides::Both)
            .build()
    };
    let by_uv = scene([0.1, 0.5], Attributes { uv: Some(uv.to_vec()), ..Attributes::default() });
    let by_edge = scene([0.5, 0.1], Attributes::default());
    let other = scene([0.1, 0.5], Attributes::default());
    let want = of_reference(&by_edge, 40_000, 41);
    let bound = Bound { resolution: 0.03, allowance: 1e-3 };
    assert!(
        of_reference(&other, 40_000, 42)[0].mean < 0.7 * want[0].mean,
        "the two must differ for this to show anything"
    );
    assert_agreement("reference", &of_reference(&by_uv, 40_000, 43), &want, &[want[0].mean], bound);
    assert_agreement("device", &of_device(&by_uv, 32, 512, 44), &want, &[want[0].mean], bound);
}

/// Textures that are the same all over are what they are without: the same samples, to rounding.
#[test]
fn a_constant_texture_is_no_texture() {
    let scenes = |textured: bool| {
        let with = |add: &dyn Fn(Builder) -> Builder| {
            room_with(|b| add(b).attributes(if textured { quad_uv() } else { Attributes::default() }))
        };
        [
            with(&|mut b| match textured {
                true => {
                    let texture = b.mixture([1, 1], &[0.25, 0.75], &[Curve::Constant(0.2), Curve::Constant(0.6)]);
                    b.textured(plate(), texture)
                }
                false => b.diffuse(plate(), 0.5),
            }),
            with(&|mut b| match textured {
                true => {
                    let texture = b.texture([1, 1], &[0.5; 3], TextureKind::Colour);
                    b.coated(plate(), texture, 1.5, 0.2)
                }
                false => b.plastic(plate(), 0.5, 1.5, 0.2),
            }),
            with(&|mut b| {
                if textured {
                    let mask = b.texture([1, 1], &[0.25], TextureKind::Number);
                    b.conductor(plate(), 0.2, 3.4, [0.3; 2]).diffuse(plate(), 0.5).masked_last_two(plate(), mask)
                } else {
                    b.conductor(plate(), 0.2, 3.4, [0.3; 2]).diffuse(plate(), 0.5).blend_of_last_two(plate(), 0.25)
                }
            }),
        ]
    };
    for (i, (textured, plain)) in size::first(2, scenes(true).iter().zip(&scenes(false))).enumerate() {
        let [a, b] = [textured, plain].map(|scene| of_device(scene, 16, 64, 51));
        let scale: Vec<f64> = b.iter().map(|e| e.mean).collect();
        assert_agreement(&format!("scene {i}"), &a, &b, &scale, Bound { resolution: 0.1, allowance: 1e-4 });
        let [a, b] = [textured, plain].map(|scene| of_reference(scene, 1000, 52));
        assert_agreement(&format!("reference {i}"), &a, &b, &scale, Bound { resolution: 0.1, allowance: 1e-9 });
    }
}

/// Weights of 0 and 1 leave one material; between, what is reflected is their mean.
#[test]
fn weights_of_0_and_1_leave_one_material() {
    for (weight, expected) in [(0.0f32, 0.8), (1.0, 0.2), (0.5, 0.5)] {
        let mut b = Builder::new().camera(straight(DVec3::new(0.3, 0.4, 0.0), DVec3::Z)).sky(1.0);
        let mask = b.texture([1, 1], &[weight], TextureKind::Number);
        let plate = quad(DVec3::ZERO, DVec3::X, DVec3::Y);
        let b = b.diffuse(plate.clone(), 0.8).diffuse(plate.clone(), 0.2).masked_last_two(plate, mask);
        exact(&format!("weight {weight}"), &b.attributes(quad_uv()).build(), &[expected], 1e-6);
    }
}

/// A picture that is scaled, moved, mirrored, and one of whole texels: by hand.
#[test]
fn placements_scale_move_and_step() {
    // Rows from the top: 0.1 0.2 / 0.4 0.8.
    let texels = [0.1, 0.2, 0.4, 0.8];
    let at = |placement: Placement, u: f64, v: f64, expected: f64| {
        let mut b = Builder::new();
        let texture = b.mixture([2, 2], &texels, &[Curve::Constant(1.0)]);
        b.0.textures[texture].placement = placement;
        let camera = straight(DVec3::new(2.0 * u, v, 0.0), DVec3::Z);
        let plate = quad(DVec3::ZERO, 2.0 * DVec3::X, DVec3::Y);
        let scene = b.camera(camera).sky(1.0).textured(plate, texture).attributes(quad_uv()).build();
        exact(&format!("{placement:?} at {u}, {v}"), &scene, &[expected], 4.0 * texel_rounding(2.0));
    };
    let usual = Placement::default();
    let nearest = Placement { filter: TextureFilter::Nearest, ..usual };
    at(nearest, 0.01, 0.51, 0.1);
    at(nearest, 0.49, 0.99, 0.1);
    at(nearest, 0.51, 0.49, 0.8);
    at(nearest, 0.99, 0.01, 0.8);
    // Three pictures along u, one along v: u = 0.6 is 0.8 of the second, between the columns' centres by 0.1 beyond the last.
    let thrice = Placement { scale: DVec2::new(3.0, 1.0), ..usual };
    at(thrice, 0.6, 0.75, 0.9 * 0.2 + 0.1 * 0.1);
    at(Placement { filter: TextureFilter::Nearest, ..thrice }, 0.6, 0.75, 0.2);
    // Mirrored in u, moved half a picture in v.
    let mirrored = Placement { scale: DVec2::new(-1.0, 1.0), offset: DVec2::new(0.0, 0.5), ..usual };
    at(mirrored, 0.25, 0.25, 0.2);
    at(mirrored, 0.75, 0.75, 0.4);
}
