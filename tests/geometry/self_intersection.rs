//! Rays that leave a surface never meet it again through rounding, nor lose what lies close to it.

use glam::{DQuat, DVec2, DVec3};
use spectile::scene::{Filter, Projection, Scene, Shape, Sides};

use super::Random;
use crate::device::{self, Settings};
use crate::scene_builder::*;

/// A convex white body under a white sky, seen from `direction`, with two specks far off that stretch the scene.
fn convex_furnace(body: Shape, center: DVec3, size: f64, direction: DVec3, stretch: f64) -> Scene {
    let up = direction.any_orthonormal_vector();
    let projection = Projection::Orthographic { half_size: DVec2::splat(1.2 * size) };
    let speck = |at: f64| disk(DVec3::splat(at), DVec3::Z, 1e-7 * stretch);
    Builder::new()
        .camera(look(center + 3.0 * size * direction, center, up, projection))
        .film(48, 48, Filter::Box)
        .bounces(1)
        .sky(1.0)
        .diffuse(body, 1.0)
        .black(speck(-stretch))
        .black(speck(stretch))
        .build()
}

/// Every sample of such a scene is exactly 1 (the sky, or half of it by each strategy): one ray in 32 that met its own
/// surface would show as 0.015. A million rays from quads, spheres, meshes and disks of many sizes, anywhere in the scene,
/// seen from all sides, grazing ones included.
#[test]
fn convex_bodies_do_not_shadow_themselves() {
    let mut random = Random(41);
    for case in 0..16 {
        let size = [1.0, 0.3, 0.03, 0.003][case % 4];
        let center = (1.0 - size) * 0.7 * random.in_cube();
        let turn = DQuat::from_rotation_arc(DVec3::Z, random.direction());
        let [u, v] = [DVec3::X, DVec3::Y].map(|axis| size * (turn * axis));
        let body = match case / 4 {
            0 => quad(center - u - v, 2.0 * u, 2.0 * v),
            1 => sphere(center, size),
            2 => icosphere(center, size, 5),
            _ => disk(center, turn * DVec3::Z, size),
        };
        // Flat bodies also at a few degrees.
        let direction =
            if case % 2 == 0 { random.direction() } else { (u + 0.05 * size * (turn * DVec3::Z)).normalize() };
        let scene = convex_furnace(body, center, size, direction, 1.0);
        let mut e =
            device::render(&scene, 1, 32, Settings { tile: [48, 48], seed: case as u64, ..Settings::default() });
        e.assert_clean();
        for (i, value) in e.means.remove(0).iter().enumerate() {
            assert!((value - 1.0).abs() < 1e-5, "case {case}, pixel {i}: {value}");
        }
    }
}

/// The price of the offset: two large plates a thousandth of the scene apart still exchange their light. Radiance of the
/// lower, white plate under the upper, glowing one is that of the glow, but for the rim.
#[test]
fn close_surfaces_see_each_other() {
    let gap = 1e-3;
    let scene = Builder::new()
        .camera(look(
            DVec3::new(0.0, 0.0, 0.5 * gap),
            DVec3::ZERO,
            DVec3::Y,
            Projection::Orthographic { half_size: DVec2::splat(0.1) },
        ))
        .film(8, 8, Filter::Box)
        .bounces(1)
        .diffuse(quad(DVec3::new(-1.0, -1.0, 0.0), 2.0 * DVec3::X, 2.0 * DVec3::Y), 1.0)
        .lamp(quad(DVec3::new(-1.0, -1.0, gap), 2.0 * DVec3::Y, 2.0 * DVec3::X), 1.0, Sides::Front)
        .build();
    let mut e = device::render(&scene, 1, 1024, Settings { tile: [8, 8], ..Settings::default() });
    e.assert_clean();
    let values = e.means.remove(0);
    let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len() as f64;
    // The share of the hemisphere beyond the rim, 0.9 away or more, is below (gap / 0.9)²; the rest is noise: samples lie
    // between 0 and 2, so that 64 x 1,024 of them have a standard error of at most 0.004.
    assert!((mean - 1.0).abs() < 0.016, "{mean}");
}
