//! Roughness by textures: on the device against one number, and against the f64 reference.

use glam::DVec3;
use spectile::scene::{Attributes, Bsdf, Placement, Roughness, Scene, Shape, TextureFilter, TextureKind};

use super::textures::{against_reference, of_device, plate, room_with};
use crate::scene_builder::surfaces::white_metal;
use crate::scene_builder::*;
use crate::size;

/// Gives the last `count` materials the roughness of `texture`.
fn rough(mut scene: Scene, count: usize, texture: usize) -> Scene {
    let first = scene.materials.len() - count;
    for material in &mut scene.materials[first..] {
        if let Bsdf::Conductor { roughness, .. }
        | Bsdf::Dielectric { roughness, .. }
        | Bsdf::Plastic { roughness, .. } = &mut material.bsdf
        {
            *roughness = Roughness::Texture(texture);
        }
    }
    scene
}

type Add = fn(Builder, Shape, f64) -> Builder;

const KINDS: [(&str, Add); 4] = [
    ("metal", |b, s, alpha| b.conductor(s, 0.2, 3.4, [alpha; 2])),
    ("glass", |b, s, alpha| b.dielectric(s, 1.5, alpha)),
    ("dispersive glass", |b, s, alpha| b.dielectric(s, table(&[400.0, 700.0], &[1.52, 1.48]), alpha)),
    ("varnish", |b, s, alpha| b.plastic(s, 0.5, 1.5, alpha)),
];

fn with_texture(add: Add, size: [u32; 2], texels: &[f32]) -> Scene {
    let mut at = 0;
    let scene = room_with(|mut b| {
        at = b.texture(size, texels, TextureKind::Number);
        add(b, plate(), 0.5).attributes(quad_uv())
    });
    rough(scene, 1, at)
}

/// A texture that is the same all over, at a roughness for which there are tables, is one number: the same samples.
#[test]
fn a_constant_texture_is_one_roughness() {
    let alpha = 0.25;
    for (what, add) in size::first(2, KINDS) {
        let textured = with_texture(add, [2, 1], &[alpha as f32; 2]);
        let plain = room_with(|b| add(b, plate(), alpha).attributes(quad_uv()));
        let [a, b] = [&textured, &plain].map(|scene| of_device(scene, 4, 64, 51));
        for (i, (a, b)) in a.iter().zip(&b).enumerate() {
            assert!((a.mean - b.mean).abs() <= 1e-5 * b.mean, "{what}, value {i}: {} instead of {}", a.mean, b.mean);
        }
    }
}

/// Fields of four roughnesses, between those of the tables.
#[test]
fn textured_roughness_is_that_of_the_reference() {
    let few = [64, 1000];
    for (what, add) in size::first(1, KINDS) {
        let mut scene = with_texture(add, [2, 2], &[0.04, 0.115, 0.3, 0.75]);
        scene.textures[0].placement = Placement { filter: TextureFilter::Nearest, ..Placement::default() };
        against_reference(what, &scene, few, [0.5, 0.05]);
    }
    // Metal and varnish with a texture each, in shares by a third.
    let mut scene = room_with(|mut b| {
        b.texture([2, 1], &[0.1, 0.6], TextureKind::Number);
        b.texture([1, 2], &[0.35, 0.15], TextureKind::Number);
        let mask = b.texture([2, 2], &[0.2, 0.9, 0.5, 0.7], TextureKind::Number);
        let b = b.conductor(plate(), 0.2, 3.4, [0.5; 2]).plastic(plate(), 0.5, 1.5, 0.5);
        b.masked_last_two(plate(), mask).attributes(quad_uv())
    });
    let last = scene.materials.len() - 1;
    for (material, texture) in [(last - 2, 0), (last - 1, 1)] {
        let (Bsdf::Conductor { roughness, .. } | Bsdf::Plastic { roughness, .. }) = &mut scene.materials[material].bsdf
        else {
            panic!("one of the two")
        };
        *roughness = Roughness::Texture(texture);
    }
    for texture in &mut scene.textures {
        texture.placement.filter = TextureFilter::Nearest;
    }
    against_reference("a blend", &scene, few, [0.5, 0.05]);
}

/// White metal, white glass and white varnish are not to be seen under a white sky, at every roughness of a bilinear texture.
#[test]
fn a_white_furnace_at_every_roughness() {
    let texels: Vec<f32> = (0..16).map(|i| (i as f32 / 15.0).powi(2).max(0.002)).collect();
    type Of = fn(Builder, Shape) -> Builder;
    let kinds: [(&str, Of); 3] = [
        ("metal", |b, s| white_metal(b, s, [0.5; 2])),
        ("glass", |b, s| b.dielectric(s, 1.5, 0.5)),
        ("varnish", |b, s| b.plastic(s, 1.0, 1.5, 0.5)),
    ];
    for (what, add) in size::first(1, kinds) {
        let mut b = Builder::new().sky(1.0).bounces(64).film(8, 1, spectile::scene::Filter::Box);
        let texture = b.texture([16, 1], &texels, TextureKind::Number);
        // The axis of the coordinates goes once around the ball.
        let camera = look(DVec3::new(0.0, 0.0, 9.0), DVec3::ZERO, DVec3::Y, narrow_ball());
        let scene = add(b.camera(camera), sphere(DVec3::ZERO, 1.0)).attributes(Attributes::default()).build();
        let scene = rough(scene, 1, texture);
        for (i, value) in of_device(&scene, 16, 64, 3).iter().enumerate() {
            let off = (value.mean - 1.0).abs();
            // The lines between tables are within 6e-4 for each of some events.
            assert!(off < 4.0 * value.error + 2e-3, "{what}, pixel {i}: {value:?}");
        }
    }
}

fn narrow_ball() -> spectile::scene::Projection {
    spectile::scene::Projection::Perspective { tan_half: glam::DVec2::new(0.1, 0.01) }
}
