//! Assemblies: a picture of things that are placed is that of their copies, in the f64 reference and but for rounding on the device.

use glam::{DAffine3, DMat3, DVec3};
use spectile::scene::{Attributes, Field, Scene, Shape, Sides, TextureKind, Weight};
use spectile::spectral::Channels;

use crate::device::{self, Settings};
use crate::scene_builder::heat::{cuboid, grid, infrared};
use crate::scene_builder::*;
use crate::size;
use crate::statistics::*;

/// Where things stand in the room: turned, small, and, where they may be, stretched.
fn places(stretch: DVec3) -> Vec<DAffine3> {
    let place = |i: u32| {
        let i = f64::from(i);
        let matrix3 = DMat3::from_axis_angle(DVec3::new(0.3, 1.0, 0.2 * i).normalize(), 0.9 * i)
            * DMat3::from_diagonal((0.3 + 0.1 * i) * stretch)
            * DMat3::from_rotation_x(0.5 * i);
        DAffine3 { matrix3, translation: DVec3::new(0.45 * i - 0.7, 0.3 - 0.35 * i, 0.25 * i - 0.4) }
    };
    (0..4).map(place).collect()
}

/// What a part of the renderer asks of what a ray met: corners, normals, coordinates, tangents, masks, sides.
fn room_with(thing: &str) -> Scene {
    let mut b = Builder::new()
        .into_room()
        .channels(Channels::equal(400.0, 700.0, 2))
        .bounces(3)
        .diffuse(room(DVec3::new(-1.0, -1.0, -1.0), DVec3::new(1.0, 1.0, 3.0)), table(&[400.0, 700.0], &[0.3, 0.7]))
        .lamp(quad(DVec3::new(-0.5, 0.9, -0.5), DVec3::X, DVec3::Z), table(&[400.0, 700.0], &[4.0, 2.0]), Sides::Both);
    let blue = || table(&[400.0, 700.0], &[0.8, 0.2]);
    let absorbing = || table(&[400.0, 700.0], &[3.0, 1.0]);
    let stretched = places(DVec3::new(1.0, 0.4, 0.7));
    let similar = places(DVec3::ONE);
    let ball = icosphere(DVec3::ZERO, 0.8, 1);
    let smooth = round_normals(DVec3::ZERO, &ball);
    let sheet = quad(DVec3::new(-0.7, -0.7, 0.0), DVec3::new(1.4, 0.0, 0.1), DVec3::new(0.0, 1.4, -0.2));
    let axes =
        Attributes { axes: Some(DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.4)), ..Attributes::default() };
    match thing {
        "boxes" => b.diffuse(cuboid(DVec3::splat(-0.5), DVec3::splat(0.5)), blue()).placed(1, stretched),
        "normals" => b.conductor(ball, 0.2, 3.4, [0.3; 2]).attributes(smooth).placed(1, stretched),
        "coordinates" => {
            let texture =
                b.texture([2, 2], &[0.9, 0.1, 0.1, 0.1, 0.8, 0.1, 0.2, 0.2, 0.9, 0.5, 0.5, 0.5], TextureKind::Colour);
            b.textured(sheet, texture).attributes(quad_uv()).placed(1, stretched)
        }
        "tangents" => b.conductor(sheet, 0.2, 3.4, [0.05, 0.5]).attributes(quad_uv()).placed(1, stretched),
        "masks" => {
            let mask = b.texture([2, 2], &[1.0, 0.0, 0.2, 0.7], TextureKind::Number);
            b.diffuse(sheet, blue()).attributes(quad_uv()).opacity(Weight::Texture(mask)).placed(1, stretched)
        }
        "leaves" => b.translucent(sheet, 0.3, 0.5).placed(1, stretched),
        "glass" => b.dielectric(cuboid(DVec3::splat(-0.5), DVec3::splat(0.5)), 1.5, 0.0).placed(1, stretched),
        "round" => {
            let texture = b.texture([2, 1], &[0.9, 0.1, 0.1, 0.1, 0.1, 0.8], TextureKind::Colour);
            let b = b.textured(sphere(DVec3::new(0.2, 0.1, 0.0), 0.4), texture).attributes(axes.clone());
            let b = b.textured(disk(DVec3::new(-0.5, 0.0, 0.2), DVec3::new(0.2, 1.0, 0.3).normalize(), 0.4), texture);
            let b =
                b.attributes(Attributes { axes: Some(axes_to(DVec3::new(0.2, 1.0, 0.3))), ..Attributes::default() });
            let b =
                b.conductor(tube(DVec3::new(0.0, -0.6, 0.0), DVec3::new(0.5, -0.1, 0.3), 0.2), 0.2, 3.4, [0.05, 0.4]);
            b.placed(3, similar)
        }
        "in gas" => b
            .diffuse(cuboid(DVec3::splat(-0.5), DVec3::splat(0.5)), blue())
            .placed(1, stretched)
            .medium(table(&[400.0, 700.0], &[0.2, 0.5]), None, Field::Constant(1.0))
            .outer(),
        "gas" => b.gas(absorbing()).null(cuboid(DVec3::splat(-0.5), DVec3::splat(0.5))).placed(1, stretched),
        "fog" => {
            let phase = b.henyey_greenstein(0.6);
            let b = b.gas(0.1).scattering(table(&[400.0, 700.0], &[2.0, 5.0]), phase);
            // Seen from within one of them.
            let around_camera = DAffine3::from_translation(DVec3::new(0.0, 0.1, 2.7));
            b.null(sphere(DVec3::ZERO, 0.6)).placed(1, similar.into_iter().chain([around_camera]).collect())
        }
        "voxels" => {
            let phase = b.henyey_greenstein(0.4);
            let density = grid([2, 3, 4], |[x, y, z]| [0.0, 2.0, 5.0, 1.0][((x + 2 * y + 3 * z) % 4) as usize]);
            let b = b.medium(absorbing(), None, density).scattering(table(&[400.0, 700.0], &[1.0, 2.0]), phase);
            // One around the camera, and two within one another.
            let around_camera = DAffine3::from_translation(DVec3::new(0.1, 0.0, 2.6));
            let within = places(DVec3::ONE)[3] * DAffine3::from_scale(DVec3::splat(0.5));
            let b = b.null_box(DVec3::splat(-0.5), DVec3::splat(0.5));
            b.placed(1, stretched.into_iter().chain([around_camera, within]).collect())
        }
        "voxels in glass" => {
            let density = grid([3, 1, 2], |[x, _, z]| f64::from(x + 2 * z));
            let b = b.medium(absorbing(), None, density);
            let b = b.dielectric(cuboid(DVec3::splat(-0.5), DVec3::splat(0.5)), 1.5, 0.0);
            let b = b.filled_from(DVec3::splat(-0.5), DVec3::splat(0.5));
            // Beside it what every instance has the same.
            let b = b.gas(0.8).null(sphere(DVec3::new(0.0, 1.0, 0.0), 0.3));
            b.placed(2, similar)
        }
        "filled glass" => {
            let b = b.gas(absorbing()).dielectric(cuboid(DVec3::splat(-0.5), DVec3::splat(0.5)), 1.5, 0.0).filled();
            b.placed(1, stretched)
        }
        _ => unreachable!("{thing}"),
    }
    .build()
}

/// A room that nothing lights but what is placed in it.
fn lit_by(thing: &str) -> Scene {
    let walls = room(DVec3::new(-1.0, -1.0, -1.0), DVec3::new(1.0, 1.0, 3.0));
    let mut b = Builder::new().into_room().channels(Channels::equal(400.0, 700.0, 2)).bounces(3);
    b = b.diffuse(walls, table(&[400.0, 700.0], &[0.3, 0.7]));
    let (stretched, similar) = (places(DVec3::new(1.0, 0.4, 0.7)), places(DVec3::ONE));
    let radiance = || table(&[400.0, 700.0], &[4.0, 2.0]);
    let sheet = quad(DVec3::new(-0.7, -0.7, 0.0), DVec3::new(1.4, 0.0, 0.1), DVec3::new(0.0, 1.4, -0.2));
    match thing {
        "sheets" => b.lamp(sheet, radiance(), Sides::Both).placed(1, stretched),
        "several" => {
            let b = b.lamp(cuboid(DVec3::splat(-0.3), DVec3::splat(0.3)), radiance(), Sides::Front);
            let b = b.lamp(quad(DVec3::new(0.4, 0.4, 0.4), 0.1 * DVec3::X, 0.1 * DVec3::Y), 40.0, Sides::Both);
            let b = b.placed(2, stretched[..2].to_vec()).black(sphere(DVec3::new(0.3, 0.4, 0.2), 0.2));
            let b = b.lamp(quad(DVec3::new(-0.5, 0.9, -0.5), DVec3::X, DVec3::Z), radiance(), Sides::Both);
            b.lamp(sheet, 2.0, Sides::Front).placed(1, stretched[2..].to_vec())
        }
        "round" => {
            let b = b.lamp(sphere(DVec3::new(0.2, 0.1, 0.0), 0.4), radiance(), Sides::Front);
            let b = b.lamp(disk(DVec3::new(-0.5, 0.0, 0.2), DVec3::new(0.2, 1.0, 0.3), 0.3), 3.0, Sides::Both);
            b.lamp(tube(DVec3::new(0.0, -0.6, 0.0), DVec3::new(0.5, -0.1, 0.3), 0.2), 5.0, Sides::Front)
                .placed(3, similar)
        }
        "masked" => {
            let mask = b.texture([2, 2], &[1.0, 0.0, 0.2, 0.7], TextureKind::Number);
            let b = b.lamp(sheet, radiance(), Sides::Both).attributes(quad_uv()).opacity(Weight::Texture(mask));
            b.placed(1, stretched)
        }
        "hot metal" => b
            .channels(infrared())
            .conductor(cuboid(DVec3::splat(-0.5), DVec3::splat(0.5)), 2.0, 3.0, [0.3; 2])
            .at_kelvin(600.0)
            .placed(1, stretched),
        "hot voxels" => {
            let kelvin = grid([2, 2, 3], |[x, y, z]| 300.0 + 100.0 * f64::from(x + y + z));
            let density = grid([2, 2, 3], |[x, ..]| 1.0 + f64::from(x));
            let b = b.channels(infrared()).medium(1.5, Some(kelvin), density);
            b.null_box(DVec3::splat(-0.5), DVec3::splat(0.5)).placed(1, stretched)
        }
        "hot by place" => {
            let kelvin = b.texture([2, 2], &[300.0, 500.0, 700.0, 400.0], TextureKind::Number);
            b.channels(infrared()).diffuse(sheet, 0.4).attributes(quad_uv()).heated_by(kelvin).placed(1, stretched)
        }
        _ => unreachable!("{thing}"),
    }
    .build()
}

const LIGHTS: [&str; 7] = ["sheets", "several", "round", "masked", "hot metal", "hot voxels", "hot by place"];

/// Columns that take +y to `axis`.
fn axes_to(axis: DVec3) -> DMat3 {
    let y = axis.normalize();
    let x = y.any_orthonormal_vector();
    DMat3::from_cols(x, y, x.cross(y))
}

fn tube(from: DVec3, to: DVec3, radius: f64) -> Shape {
    Shape::Cylinder { from, to, radius }
}

const THINGS: [&str; 14] = [
    "boxes",
    "normals",
    "coordinates",
    "tangents",
    "masks",
    "leaves",
    "glass",
    "round",
    "in gas",
    "gas",
    "fog",
    "voxels",
    "voxels in glass",
    "filled glass",
];

/// The reference copies what is placed.
#[test]
fn pictures_are_those_of_the_reference() {
    THINGS.into_iter().for_each(|thing| assert_as_reference(thing, &room_with(thing)));
}

#[test]
fn light_is_that_of_the_reference() {
    LIGHTS.into_iter().for_each(|thing| assert_as_reference(thing, &lit_by(thing)));
}

fn assert_as_reference(thing: &str, scene: &Scene) {
    device::assert_as_reference(thing, scene, [16, 256], 2500, Bound { resolution: 0.2, allowance: 4e-3 });
}

/// The same paths, but where rounding decides: nine in ten pixels and channels are within 1e-4, and the mean within 1e-3.
#[test]
fn placed_or_copied_is_the_same_but_for_rounding() {
    for (thing, scene) in size::first(2, THINGS.map(|thing| (thing, room_with(thing)))) {
        let [placed, copied] = [&scene, &*scene.copied()].map(|scene| {
            let epochs = device::render(scene, 1, 64, Settings::default());
            epochs.assert_clean();
            epochs.means[0].clone()
        });
        let mut differences: Vec<f32> =
            placed.iter().zip(&copied).map(|(a, b)| (a - b).abs() / b.abs().max(1e-6)).collect();
        differences.sort_by(f32::total_cmp);
        let mean = |values: &[f32]| values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len() as f64;
        let (all, change) = (differences.len(), mean(&placed) / mean(&copied) - 1.0);
        println!(
            "{thing}: median {:e}, nine tenths {:e}, mean {change:e}",
            differences[all / 2],
            differences[all * 9 / 10]
        );
        assert!(differences[all * 9 / 10] < 1e-4 || differences[all / 2] < 1e-5, "{thing}: {differences:?}");
        assert!(change.abs() < 1e-3, "{thing}: {change:e}");
    }
}
