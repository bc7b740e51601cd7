//! Surfaces that let light through diffusely: closed forms in the f64 reference and on the device, and both against each other.

use std::f64::consts::PI;

use glam::DVec3;
use spectile::scene::{Attributes, Bsdf, Reflectance, Scene, Sides};
use spectile::spectral::{Channels, Curve, Outside};

use crate::device::{self, Settings};
use crate::scene_builder::heat::{infrared, means, planck};
use crate::scene_builder::*;
use crate::statistics::*;
use crate::truth;

fn plate() -> spectile::scene::Shape {
    quad(DVec3::new(-1.0, -1.0, 0.0), 2.0 * DVec3::X, 2.0 * DVec3::Y)
}

/// Looks at a plate's lower left from one side.
fn seen_from(side: f64) -> Builder {
    let point = DVec3::new(-0.5, -0.5, 0.0);
    Builder::new().camera(look(point + DVec3::new(0.3, 0.2, 2.0 * side), point, DVec3::Y, narrow()))
}

/// All samples are alike, in the reference and on the device.
#[track_caller]
fn exact(what: &str, scene: &Scene, expected: &[f64]) {
    let reference = truth::render_image(scene, 64, 1);
    let device = device::render(scene, 1, 64, Settings::default());
    device.assert_clean();
    for (k, want) in expected.iter().enumerate() {
        let (theirs, ours) = (reference.mean[k], f64::from(device.means[0][k]));
        assert!((theirs - want).abs() <= 1e-7 * want, "{what}, reference, {k}: {theirs}, not {want}");
        assert!((ours - want).abs() <= 2e-5 * want, "{what}, device, {k}: {ours}, not {want}");
    }
}

/// Parallel light from above and from below: L = ρ E cosθ / π on the side that it comes from, τ E cosθ / π on the other; the textures'
/// shares where there are some.
#[test]
fn light_is_reflected_and_passes() {
    let cosine = 0.8;
    for (camera, light, share) in [(1.0, -1.0, 0.5), (-1.0, 1.0, 0.5), (1.0, 1.0, 0.3), (-1.0, -1.0, 0.3)] {
        let direction = DVec3::new(0.6, 0.0, cosine * light);
        let scene = seen_from(camera).translucent(plate(), 0.5, 0.3).directional(direction, 2.0).build();
        exact(&format!("camera {camera}, light {light}"), &scene, &[2.0 * cosine * share / PI]);

        // The lower left texel: 0.2 of 0.9 and 0.6 of 0.5.
        let mut b = seen_from(camera);
        let a = b.mixture([2, 2], &[1.0, 1.0, 0.2, 1.0], &[Curve::Constant(0.9)]);
        let t = b.mixture([2, 2], &[0.1, 0.1, 0.6, 0.1], &[Curve::Constant(0.5)]);
        let mut scene = b.translucent(plate(), 0.5, 0.3).attributes(quad_uv()).directional(direction, 2.0).build();
        scene.materials[0].bsdf =
            Bsdf::Translucent { reflectance: Reflectance::Texture(a), transmittance: Reflectance::Texture(t) };
        let share = if share == 0.5 { 0.2 * 0.9 } else { 0.6 * 0.5 };
        exact(&format!("textures, camera {camera}, light {light}"), &scene, &[2.0 * cosine * share / PI]);
    }
}

/// Under a sky of 1 a plate shows ρ + τ; and a closed ball that absorbs nothing is not to be seen, from outside and from within.
#[test]
fn nothing_is_lost_or_won() {
    exact("plate", &seen_from(1.0).translucent(plate(), 0.4, 0.2).sky(1.0).build(), &[0.6]);
    for position in [3.0 * DVec3::Z, DVec3::new(0.1, 0.2, 0.3)] {
        let camera = look(position, DVec3::new(0.2, -0.9, 0.0), DVec3::X, narrow());
        let ball = Builder::new().camera(camera).translucent(sphere(DVec3::ZERO, 1.0), 0.75, 0.25);
        let scene = ball.sky(1.0).bounces(60).build();
        // What is left inside after 60 events: 0.75^60 = 3e-8.
        exact(&format!("ball from {position}"), &scene, &[1.0]);
    }
}

/// Kirchhoff: in an isothermal room nothing is seen of a ball of 1 - ρ - τ, by spectra and by textures.
#[test]
fn isothermal_cavities() {
    let slope =
        |from: f64, to: f64| Curve::Linear { nm: vec![3e3, 20e3], value: vec![from, to], outside: Outside::Hold };
    let expected = means(&planck(300.0), &infrared());
    let cavity = || {
        let camera = look(DVec3::new(0.1, 0.2, 1.2), DVec3::new(0.35, 0.17, 0.0), DVec3::Y, narrow());
        let base = Builder::new().camera(camera).channels(infrared()).bounces(24);
        base.diffuse(room(DVec3::splat(-1.5), DVec3::splat(1.5)), 0.2).at_kelvin(300.0)
    };
    let ball = || sphere(DVec3::ZERO, 0.5);
    let even = cavity().translucent(ball(), slope(0.1, 0.5), slope(0.4, 0.2)).at_kelvin(300.0).build();
    let textured = |both: bool| {
        let mut b = cavity();
        let a = b.mixture([2, 2], &[1.0, 0.0, 0.5, 0.5, 0.0, 1.0, 0.2, 0.3], &[slope(0.5, 0.3), slope(0.1, 0.6)]);
        let t = b.mixture([1, 2], &[0.3, 0.9], &[slope(0.4, 0.1)]);
        let upright = Attributes { axes: Some(glam::DMat3::IDENTITY), ..Attributes::default() };
        let mut scene = b.translucent(ball(), 0.1, slope(0.1, 0.4)).at_kelvin(300.0).attributes(upright).build();
        let Bsdf::Translucent { reflectance, transmittance } = &mut scene.materials[1].bsdf else { panic!() };
        *reflectance = Reflectance::Texture(a);
        if both {
            *transmittance = Reflectance::Texture(t);
        }
        scene
    };
    for (i, scene) in [even, textured(false), textured(true)].into_iter().enumerate() {
        let reference = truth::render_image(&scene, 2_000, 450 + i as u64);
        let estimates: Vec<Estimate> = (reference.mean.iter().zip(&reference.standard_error))
            .map(|(&mean, &error)| Estimate { mean, error, freedom: 1_999.0 })
            .collect();
        assert_estimates(&format!("reference {i}"), &estimates, &expected, Bound { resolution: 0.06, allowance: 3e-4 });
        let bound = Bound { resolution: 0.01, allowance: 10.0 * ORIGIN_OFFSET + 4e-4 };
        assert_estimates(&format!("device {i}"), &device::measure(scene, 1, 430 + i as u64), &expected, bound);
    }
}

/// A leaf between lamps in a room, its textures mixed of spectra that each favour another channel.
#[test]
fn leaves_are_those_of_the_reference() {
    let slope = |a: f64, b: f64| Curve::Linear { nm: vec![400.0, 700.0], value: vec![a, b], outside: Outside::Hold };
    let mut b = Builder::new()
        .into_room()
        .channels(Channels::equal(400.0, 700.0, 3))
        .diffuse(room(DVec3::new(-1.0, -1.0, -1.0), DVec3::new(1.0, 1.0, 3.0)), slope(0.3, 0.7))
        .lamp(quad(DVec3::new(-0.5, 0.99, -0.9), DVec3::X, 0.5 * DVec3::Z), slope(4.0, 2.0), Sides::Front)
        .bounces(3)
        .roulette(2);
    let a = b.mixture([2, 2], &[0.9, 0.0, 0.1, 0.6, 0.5, 0.5, 0.0, 0.2], &[slope(0.6, 0.2), slope(0.1, 0.3)]);
    let shape = quad(DVec3::new(-0.7, -0.8, 0.1), DVec3::new(1.3, 0.0, -0.3), DVec3::new(0.0, 1.4, -0.4));
    let mut scene = b.translucent(shape, 0.1, slope(0.1, 0.6)).attributes(quad_uv()).build();
    let Bsdf::Translucent { reflectance, .. } = &mut scene.materials[2].bsdf else { panic!() };
    *reflectance = Reflectance::Texture(a);
    device::assert_as_reference("leaf", &scene, [16, 256], 6000, Bound { resolution: 0.2, allowance: 4e-3 });
}
