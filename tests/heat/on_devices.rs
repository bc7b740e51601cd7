//! Heat on devices: closed forms, and against the f64 path tracer (docs/METHOD.md, Closed forms).

use glam::{DVec2, DVec3};
use spectile::device::prepared::Prepared;
use spectile::device::words::{Emitter, Material};
use spectile::scene::{Attributes, Filter, Projection, Scene, Sides, Temperature};
use spectile::spectral::{Channels, Curve, Outside, planck as law};

use super::reference::BOUNCES;
use crate::device::{Settings, assert_as_reference, measure, render};
use crate::scene_builder::closed_forms::{self, Case};
use crate::scene_builder::heat::*;
use crate::scene_builder::*;
use crate::size;
use crate::statistics::*;

#[test]
fn hot_grey_plates() {
    for Case { scene, expected, seed } in hot_plates(1e3, 24) {
        // As with the emission written out: two ways of missing 1e-6, r₁¹² r₂¹², and the tables.
        let bound = Bound { resolution: 0.005, allowance: 2e-5 };
        assert_estimates("plates", &measure(scene, 2, seed), &expected, bound);
    }
}

/// Walls, a ball, a disk and a blend of different emissivities at one temperature: nothing of them can be seen.
#[test]
fn isothermal_cavity_is_black() {
    let slope = Curve::Linear { nm: vec![3e3, 20e3], value: vec![0.9, 0.1], outside: Outside::Hold };
    let mut scene = Builder::new()
        .camera(look(0.5 * DVec3::ONE, DVec3::new(0.9, 0.8, 0.0), DVec3::Y, narrow()))
        .channels(infrared())
        .bounces(150)
        .diffuse(room(DVec3::ZERO, DVec3::ONE), slope)
        .at_kelvin(300.0)
        .diffuse(disk(DVec3::new(0.3, 0.5, 0.2), DVec3::Z, 0.2), 0.1)
        .at_kelvin(300.0)
        .black(sphere(DVec3::new(0.2, 0.2, 0.8), 0.1))
        .at_kelvin(300.0);
    let ball = sphere(DVec3::new(0.7, 0.7, 0.7), 0.2);
    scene = scene.diffuse(ball.clone(), 0.4).black(ball.clone()).blend_of_last_two(ball, 0.3).at_kelvin(300.0);
    let expected = means(&planck(300.0), &infrared());
    // Ten events of ρ = 0.9, twice that for corners; 1e-5 for the tables, 1e-5 for the derived curve.
    let bound = Bound { resolution: 0.005, allowance: 20.0 * ORIGIN_OFFSET + 3e-5 };
    assert_estimates("isothermal", &measure(scene.build(), 1, 401), &expected, bound);
}

/// From 3 K to 50,000 K, directly seen from in front and behind: every sample is exact, and what underflows f32 is 0.
#[test]
fn planck_of_every_temperature() {
    let bounds = [[380.0, 380.0001], [549.9999, 550.0001], [9_999.9, 10_000.1], [19_999.9, 20_000.0]];
    for kelvin in [3.0, 220.0, 300.0, 900.0, 5778.0, 50_000.0] {
        for normal in [DVec3::Z, DVec3::NEG_Z] {
            let scene = Builder::new()
                .channels(Channels::from_bounds(bounds.to_vec(), None))
                .film(4, 4, Filter::Box)
                .bounces(0)
                .black(disk(DVec3::ZERO, normal, 1.0))
                .at_kelvin(kelvin)
                .build();
            let rendered = render(&scene, 1, 64, Settings::default());
            rendered.assert_clean();
            for values in rendered.means[0].chunks(4) {
                for (value, [from, to]) in values.iter().zip(bounds) {
                    let want = Curve::Blackbody { kelvin, scale: 1.0 }.mean(from, to);
                    // 1e-4 of the channel's peak pointwise, the mean of 64 stratified wavelengths better; below the
                    // least normal f32 nothing but zero or less than that.
                    let bound = 1e-4 * want + f64::from(f32::MIN_POSITIVE);
                    assert!((f64::from(*value) - want).abs() <= bound, "{kelvin} K, {from} nm: {value}, {want}");
                }
            }
        }
    }
    assert!(law::radiance(550.0, 300.0) > 0.0 && (law::radiance(380.0, 3.0) as f32) == 0.0);
}

/// A dim lamp at 5778 K and a room at 300 K, from 0.5 to 10 um: devices and the reference, both ends converge.
fn sun_and_heat() -> Scene {
    let camera =
        look(DVec3::new(0.1, 0.2, 1.8), DVec3::ZERO, DVec3::Y, Projection::Perspective { tan_half: DVec2::splat(0.5) });
    Builder::new()
        .camera(camera)
        .film(4, 4, Filter::Box)
        .channels(Channels::from_bounds(
            vec![[490.0, 510.0], [1_900.0, 2_100.0], [3.9e3, 4.1e3], [9.5e3, 10.5e3]],
            None,
        ))
        .bounces(4)
        .diffuse(
            room(DVec3::splat(-2.0), DVec3::splat(2.0)),
            Curve::Linear { nm: vec![500.0, 10e3], value: vec![0.8, 0.1], outside: Outside::Hold },
        )
        .at_kelvin(300.0)
        .black(sphere(DVec3::new(1.2, 1.5, -0.8), 0.05))
        .at_kelvin(5778.0)
        .diffuse(sphere(DVec3::new(-0.4, -0.3, -0.2), 0.5), 0.5)
        .at_kelvin(350.0)
        .lamp(disk(DVec3::new(0.0, 1.9, 0.0), DVec3::NEG_Y, 0.4), 1e-3, Sides::Both)
        .at_kelvin(420.0)
        .build()
}

#[test]
fn sun_and_heat_converge_as_the_reference() {
    let bound = Bound { resolution: 0.05, allowance: 10.0 * ORIGIN_OFFSET + 1e-4 };
    assert_as_reference("sun and heat", &sun_and_heat(), [32, 64], 12_000, bound);
}

/// Heat on diffuse and black surfaces makes the scene one of lamps: the same shaders, the same sizes.
#[test]
fn heat_pays_for_nothing_but_lamps() {
    let cold = closed_forms::isothermal_cavity(5).0;
    let mut hot = cold.clone();
    hot.objects.iter_mut().for_each(|object| object.emission = None);
    hot.materials.iter_mut().for_each(|material| material.temperature = Some(Temperature::Constant(300.0)));
    let [cold, hot] = [cold, hot].map(|scene| Prepared::new(&scene, 0).unwrap_or_else(|e| panic!("{e}")));
    assert_eq!((hot.features, hot.emitters.len()), (cold.features, cold.emitters.len()));
    assert_eq!((size_of::<Emitter>(), size_of::<Material>()), (20, 16));
}

/// Surfaces whose emission depends on the angle, in an isothermal room: nothing of them can be seen. Emittances are within
/// 1e-4 and read at 128 cosines, met twice or so.
#[test]
fn hot_metals_and_plastics_in_a_cavity() {
    type Ball = fn(Builder) -> Builder;
    let balls: [(&str, Ball); 6] = [
        ("blend", |b| {
            let s = || sphere(DVec3::ZERO, 0.5);
            b.conductor(s(), 5.0, 12.0, [0.2; 2]).diffuse(s(), 0.2).blend_of_last_two(s(), 0.4)
        }),
        ("plastic", |b| b.plastic(sphere(DVec3::ZERO, 0.5), 0.6, 1.5, 0.3)),
        ("one-sided", |b| b.one_sided(disk(DVec3::ZERO, DVec3::new(0.1, 0.2, -1.0), 0.5), 0.7)),
        ("mirror", |b| b.conductor(sphere(DVec3::ZERO, 0.5), 5.0, 12.0, [0.0; 2])),
        ("rough metal", |b| b.conductor(sphere(DVec3::ZERO, 0.5), 5.0, 12.0, [0.4; 2])),
        ("varnish", |b| b.plastic(sphere(DVec3::ZERO, 0.5), 0.6, 1.5, 0.0)),
    ];
    let expected = means(&planck(300.0), &infrared());
    for (i, (name, ball)) in size::first(3, balls).enumerate() {
        for off in [0.0, 0.35] {
            let base = Builder::new()
                .camera(look(DVec3::new(0.1, 0.2, 1.2), DVec3::new(off, 0.5 * off, 0.0), DVec3::Y, narrow()))
                .channels(infrared())
                .bounces(BOUNCES)
                .diffuse(room(DVec3::splat(-1.5), DVec3::splat(1.5)), 0.2)
                .at_kelvin(300.0);
            let scene = ball(base).at_kelvin(300.0).build();
            let bound = Bound { resolution: 0.01, allowance: 10.0 * ORIGIN_OFFSET + 4e-4 };
            assert_estimates(name, &measure(scene, 1, 410 + i as u64), &expected, bound);
        }
    }
}

/// Within a rough ball of a metal that reflects 0.95, paths are scattered dozens of times: weights that differ a little each time would make
/// noise without end. With energy compensation it is at most four times that of facets that keep what they would scatter again: they
/// reflect less, and paths matter for less long. (Eleven times, when light scattered again was spread by the cosine and facets mirrored a
/// fifth of all paths below the surface.)
#[test]
fn compensation_of_a_metal_that_reflects_nearly_everything() {
    let bounces = 100;
    let cavity = |compensated: bool| {
        let ball = sphere(DVec3::ZERO, 1.0);
        let mut scene = Builder::new()
            .camera(look(DVec3::new(0.1, 0.2, 0.3), DVec3::new(0.3, 0.1, -0.4), DVec3::Y, narrow()))
            .channels(infrared())
            .bounces(bounces)
            .conductor(ball, 24.0, 38.0, [0.6; 2])
            .at_kelvin(300.0)
            .build();
        let spectile::scene::Bsdf::Conductor { energy_compensation, .. } = &mut scene.materials[0].bsdf else {
            panic!()
        };
        *energy_compensation = compensated;
        let rendered = render(&scene, 64, 64, Settings { seed: 480, ..Settings::default() });
        rendered.assert_clean();
        rendered.image_means()
    };
    let (with, without) = (cavity(true), cavity(false));
    // What is left after 100 times 0.9536 at most; emittances are within 1e-4 of 0.05 or more.
    let bound = Bound { resolution: 0.05, allowance: 0.9536f64.powi(bounces as i32) + 2e-3 };
    for (what, found) in [("compensated", &with), ("single", &without)] {
        assert_estimates(what, found, &means(&planck(300.0), &infrared()), bound);
    }
    let ratios: Vec<f64> = with.iter().zip(&without).map(|(a, b)| a.error / b.error).collect();
    println!("standard errors with energy compensation, over those without: {ratios:.2?}");
    assert!(ratios.iter().all(|ratio| *ratio < 4.0), "{ratios:?}");
}

/// Coarse meshes that light sees as balls emit by the angle to that normal: a mirror and a rough plastic that the camera sees, and
/// a mirror with slanted normals above a cold floor, whose heat is aimed at.
#[test]
fn emittance_goes_by_the_shading_normal() {
    let view = Projection::Perspective { tan_half: DVec2::splat(0.55) };
    let slope = |from, to| Curve::Linear { nm: vec![3e3, 20e3], value: vec![from, to], outside: Outside::Hold };
    let mut b = Builder::new()
        .camera(look(DVec3::new(0.0, 0.6, 4.0), DVec3::new(0.0, 0.0, 0.0), DVec3::Y, view))
        .film(6, 6, Filter::Box)
        .channels(Channels::from_bounds(vec![[3.9e3, 4.1e3], [9.5e3, 10.5e3]], None))
        .bounces(2)
        .diffuse(disk(DVec3::new(0.0, -1.1, 0.0), DVec3::Y, 4.0), 0.7);
    for (x, kelvin) in [(-1.0, 700.0), (1.0, 650.0)] {
        let center = DVec3::new(x, 0.0, 0.0);
        let mesh = icosphere(center, 0.9, 0);
        let normals = round_normals(center, &mesh);
        b = match x < 0.0 {
            true => b.conductor(mesh, slope(2.0, 9.0), slope(5.0, 20.0), [0.0; 2]),
            false => b.plastic(mesh, slope(0.8, 0.3), 1.5, 0.3),
        };
        b = b.at_kelvin(kelvin).attributes(normals);
    }
    let lamp = quad(DVec3::new(-0.3, 1.2, 0.7), 0.6 * DVec3::X, 0.6 * DVec3::Y);
    let slanted =
        Attributes { normals: Some(vec![[DVec3::new(0.0, -0.9, 0.4).normalize(); 3]; 2]), ..Attributes::default() };
    b = b.conductor(lamp, slope(2.0, 9.0), slope(5.0, 20.0), [0.0; 2]).at_kelvin(1_200.0).attributes(slanted);
    // Emittances are within 1e-4 and read at 128 cosines; the tables of `scattering` within 1e-3, met once or twice.
    let bound = Bound { resolution: 0.06, allowance: 10.0 * ORIGIN_OFFSET + 2e-3 };
    assert_as_reference("smooth heat", &b.build(), [32, 192], 12_000, bound);
}
