//! Surfaces that let some rays pass: closed forms in the f64 reference and on the device, and both against each other.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};
use spectile::render::wave::Budget;
use spectile::scene::{Attributes, Field, Scene, Shape, Sides, TextureKind, Weight};
use spectile::spectral::Channels;

use crate::device::{self, Settings};
use crate::scene_builder::heat::{cuboid, infrared, means, planck};
use crate::scene_builder::*;
use crate::statistics::*;
use crate::truth;

fn at_height(z: f64) -> Shape {
    quad(DVec3::new(-1.0, -1.0, z), 2.0 * DVec3::X, 2.0 * DVec3::Y)
}

/// Both estimate `expected`.
#[track_caller]
fn estimates(what: &str, scene: &Scene, expected: f64, resolution: f64) {
    let samples = 20_000;
    let reference = truth::render_image(scene, samples, 3);
    let values =
        [Estimate { mean: reference.mean[0], error: reference.standard_error[0], freedom: f64::from(samples - 1) }];
    assert_estimates(&format!("{what}, reference"), &values, &[expected], Bound { resolution, allowance: 1e-6 });
    let ours = device::measure(scene.clone(), 2, 4);
    assert_estimates(&format!("{what}, device"), &ours, &[expected], Bound { resolution, allowance: 3e-4 });
}

/// Before a lamp of radiance 2, black sheets of opacity α leave 1 - α each; of 0 and 1, as numbers and as textures that are so all over,
/// they leave all and nothing in every sample.
#[test]
fn what_sheets_leave_of_a_lamp() {
    let before_lamp = |sheets: &[Weight], texels: f32| {
        let camera = look(DVec3::new(0.13, 0.21, 4.0), DVec3::new(0.1, 0.2, 0.0), DVec3::Y, narrow());
        let mut b = Builder::new().camera(camera);
        b.texture([2, 2], &[texels; 4], TextureKind::Number);
        let lamp = b.lamp(at_height(0.0), 2.0, Sides::Front);
        let add = |b: Builder, (i, sheet): (usize, &Weight)| {
            b.black(at_height(0.5 + i as f64)).attributes(quad_uv()).opacity(*sheet)
        };
        sheets.iter().enumerate().fold(lamp, add).build()
    };
    for (opacity, left) in [(0.0f32, 2.0), (1.0, 0.0)] {
        for sheet in [Weight::Constant(f64::from(opacity)), Weight::Texture(0)] {
            let scene = before_lamp(&[sheet, sheet], opacity);
            assert_eq!(truth::render_image(&scene, 64, 1).mean, [left], "{sheet:?} of {opacity}");
            let device = device::render(&scene, 1, 64, Settings::default());
            device.assert_clean();
            assert_eq!(device.means[0], [left as f32], "{sheet:?} of {opacity}");
        }
    }
    let three = [Weight::Constant(0.3), Weight::Texture(0), Weight::Constant(0.5)];
    estimates("one sheet", &before_lamp(&three[..1], 0.25), 2.0 * 0.7, 0.01);
    estimates("three sheets", &before_lamp(&three, 0.25), 2.0 * 0.7 * 0.75 * 0.5, 0.02);
}

/// A white patch under a point, a sphere that glows on both sides and a disk, past sheets: next-event estimation sees as much of them as
/// rays do. What a sphere of opacity α shows is α L from without and, where that lets pass, (1 - α) α L from within.
#[test]
fn ways_to_lights_pass_as_rays_do() {
    let patch = || {
        let camera = look(DVec3::new(0.0, 0.5, 1.0), DVec3::ZERO, DVec3::Y, narrow());
        Builder::new().camera(camera).diffuse(disk(DVec3::ZERO, DVec3::Z, 1.0), 1.0)
    };
    let sheet = |b: Builder, z: f64, opacity: f64| {
        b.black(disk(DVec3::new(0.0, -3.0, z), DVec3::Z, 3.05)).opacity(Weight::Constant(opacity))
    };
    let point = sheet(sheet(patch(), 0.25, 0.4), 0.3, 0.5).point(DVec3::new(0.0, -1.0, 1.0), 7.0).build();
    estimates("point", &point, 0.6 * 0.5 * 7.0 / (PI * 2.0) * 0.5f64.sqrt(), 0.02);
    // E = π L (R/d)² of a sphere that is all above.
    let sphere_of = |opacity: f64, both: bool| {
        let sides = if both { Sides::Both } else { Sides::Front };
        patch().lamp(sphere(2.0 * DVec3::Z, 1.0), 3.0, sides).opacity(Weight::Constant(opacity)).build()
    };
    estimates("sphere, one side", &sphere_of(0.4, false), 0.4 * 3.0 / 4.0, 0.02);
    estimates("sphere, both sides", &sphere_of(0.4, true), (0.4 + 0.6 * 0.4) * 3.0 / 4.0, 0.02);
    // A disk, on axis: E = π L R² / (R² + h²); half of it cut out by a texture of its own around its axis.
    let mut b = patch();
    let mask = b.texture([2, 1], &[1.0, 0.0], TextureKind::Number);
    b.0.textures[mask].placement.filter = spectile::scene::TextureFilter::Nearest;
    let upright = Attributes { axes: Some(DMat3::IDENTITY), ..Attributes::default() };
    let lamp = b.lamp(disk(2.0 * DVec3::Z, DVec3::NEG_Z, 1.0), 3.0, Sides::Front);
    // u depends on the angle about the disk's axis, which `axes` must name.
    let axis = DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y);
    let scene = lamp.attributes(Attributes { axes: Some(axis), ..upright }).opacity(Weight::Texture(mask)).build();
    estimates("half a disk", &scene, 0.5 * 3.0 / 5.0, 0.02);
}

/// A hot ball in a room of its temperature is not to be seen, however much of it is there.
#[test]
fn isothermal_cavities() {
    let expected = means(&planck(300.0), &infrared());
    for (i, opacity) in [0.7, 0.2].into_iter().enumerate() {
        let camera = look(DVec3::new(0.1, 0.2, 1.2), DVec3::new(0.35, 0.17, 0.0), DVec3::Y, narrow());
        let base = Builder::new().camera(camera).channels(infrared()).bounces(24);
        let room = base.diffuse(room(DVec3::splat(-1.5), DVec3::splat(1.5)), 0.2).at_kelvin(300.0);
        let ball = room.diffuse(sphere(DVec3::ZERO, 0.5), 0.4).at_kelvin(300.0).opacity(Weight::Constant(opacity));
        let bound = Bound { resolution: 0.01, allowance: 10.0 * ORIGIN_OFFSET + 4e-4 };
        assert_estimates(
            &format!("opacity {opacity}"),
            &device::measure(ball.build(), 1, 480 + i as u64),
            &expected,
            bound,
        );
    }
}

/// A masked plate and a masked lamp in a room, with and without gas in it, against the reference.
fn masked_room(gas: bool) -> Scene {
    let mut b = Builder::new()
        .into_room()
        .channels(Channels::equal(400.0, 700.0, 2))
        .bounces(3)
        .diffuse(room(DVec3::new(-1.0, -1.0, -1.0), DVec3::new(1.0, 1.0, 3.0)), table(&[400.0, 700.0], &[0.3, 0.7]));
    let mask = b.texture([2, 2], &[1.0, 0.0, 0.2, 0.7], TextureKind::Number);
    let plate = quad(DVec3::new(-0.7, -0.8, 0.1), DVec3::new(1.3, 0.0, -0.3), DVec3::new(0.0, 1.4, -0.4));
    let lamp = quad(DVec3::new(-0.5, 0.9, -0.5), DVec3::X, DVec3::Z);
    b = b.conductor(plate, 0.2, 3.4, [0.3; 2]).attributes(quad_uv()).opacity(Weight::Texture(mask));
    b = b
        .lamp(lamp, table(&[400.0, 700.0], &[4.0, 2.0]), Sides::Both)
        .attributes(quad_uv())
        .opacity(Weight::Texture(mask));
    if gas {
        b = b.medium(table(&[400.0, 700.0], &[0.2, 0.5]), None, Field::Constant(1.0)).outer();
        // A body of gas whose boundary is there for some.
        b = b
            .medium(2.0, None, Field::Constant(1.0))
            .diffuse(cuboid(DVec3::splat(-0.3), DVec3::splat(0.2)), 0.5)
            .filled();
        b = b.opacity(Weight::Constant(0.4));
    }
    b.build()
}

#[test]
fn masks_are_those_of_the_reference() {
    for gas in [false, true] {
        let bound = Bound { resolution: 0.2, allowance: 4e-3 };
        device::assert_as_reference(&format!("gas {gas}"), &masked_room(gas), [16, 256], 4000, bound);
    }
}

/// Which rays pass depends on path and bounce, not on how the picture is cut into tiles and waves.
#[test]
fn what_passes_is_the_same_in_any_waves() {
    let scene = masked_room(false);
    let whole = device::render(&scene, 1, 16, Settings { seed: 7, ..Settings::default() });
    let budget = Budget { memory: None, paths: Some(40) };
    let cut = device::render(&scene, 1, 16, Settings { seed: 7, tile: [2, 2], budget, ..Settings::default() });
    assert_eq!(whole.means, cut.means);
}
