//! Factored renders of scenes that separate in part: weights and remainder together are the picture, whatever a path meets.

use glam::DVec3;
use spectile::device::separable;
use spectile::render::wave::Budget;
use spectile::scene::{Bsdf, Field, Reflectance, Scene, Shape, Sides, TextureKind, Wavelengths, Weight};
use spectile::spectral::{Channels, Curve, Outside};

use crate::device::{Settings, assert_rendered_as_reference, parts_of, render, render_paths_of_weights, render_relit};
use crate::scene_builder::heat::grid;
use crate::scene_builder::*;
use crate::size;
use crate::statistics::Bound;

/// A diffuse corner under a lamp, of spectra that are the same all over each channel, in which a test puts what does not separate.
fn corner() -> Builder {
    let floor = quad(DVec3::new(-2.0, -1.0, 2.0), 4.0 * DVec3::X, 4.0 * DVec3::NEG_Z);
    let wall = quad(DVec3::new(-2.0, -1.0, -1.0), 4.0 * DVec3::X, 3.0 * DVec3::Y);
    Builder::new()
        .into_corner()
        .diffuse(floor, steps([0.5, 0.6, 0.2, 0.8, 0.1, 0.9]))
        .diffuse(wall, steps([0.9, 0.3, 0.8, 0.2, 0.7, 0.5]))
        .lamp(sphere(DVec3::new(-0.5, 1.2, 0.4), 0.2), steps([9.0, 20.0, 3.0, 40.0, 5.0, 6.0]), Sides::Front)
}

/// One value in each of the six channels.
fn steps(values: [f64; 6]) -> Curve {
    let nm = Channels::equal(400.0, 700.0, 6).bounds.iter().flatten().copied().collect();
    Curve::Linear { nm, value: values.iter().flat_map(|v| [*v; 2]).collect(), outside: Outside::Hold }
}

fn ball() -> Shape {
    sphere(DVec3::new(0.4, -0.6, 0.2), 0.4)
}

fn small(x: f64) -> Shape {
    sphere(DVec3::new(x, -0.6, 0.5), 0.2)
}

fn away() -> Shape {
    sphere(DVec3::new(0.0, 9.0, 0.0), 0.1)
}

/// Surfaces of every kind that does not separate, beside some that do.
fn surfaces() -> Scene {
    let mut builder = corner();
    let colours = [0.9, 0.1, 0.1, 0.1, 0.9, 0.1, 0.2, 0.3, 0.8, 0.5, 0.5, 0.5];
    let albedo = builder.texture([2, 2], &colours, TextureKind::Colour);
    builder
        .plastic(small(-0.7), steps([0.2, 0.4, 0.6, 0.8, 0.3, 0.1]), 1.5, 0.2)
        .dielectric(small(-0.2), 1.5, 0.0)
        .conductor(small(0.3), 0.3, steps([3.0, 2.0, 4.0, 3.5, 2.5, 1.0]), [0.3; 2])
        .diffuse(away(), steps([0.8, 0.1, 0.7, 0.2, 0.6, 0.3]))
        .conductor(away(), 0.3, 3.0, [0.2; 2])
        .blend_of_last_two(small(0.8), 0.4)
        .opacity(Weight::Constant(0.7))
        .textured(quad(DVec3::new(-1.5, -0.9, -0.5), DVec3::X, DVec3::Y), albedo)
        .attributes(quad_uv())
        .point(DVec3::new(0.5, 1.0, 1.0), 2.0)
        .sky(0.3)
        .build()
}

/// Gas that glows in voxels, within it haze, and a wall seen beside both.
fn matter() -> Scene {
    let mut builder = corner();
    let phase = builder.henyey_greenstein(0.6);
    let density = grid([2, 3, 2], |[x, y, z]| 0.2 + 0.3 * f64::from(x + 2 * y + z));
    let absorption = steps([0.1, 2.0, 0.5, 0.4, 1.0, 0.3]);
    let even = |mut scene: Scene| {
        // Heat is another at every wavelength of a channel, so that drawing them by it would weigh paths.
        scene.integrator.wavelengths = Wavelengths::Uniform;
        scene
    };
    even(
        builder
            .medium(absorption, Some(Field::Constant(3000.0)), density)
            .null_box(DVec3::new(-0.1, -0.9, -0.3), DVec3::new(0.9, 0.5, 0.6))
            .gas(0.1)
            .scattering(0.8, phase)
            .null_box(DVec3::new(-0.9, -0.9, -0.3), DVec3::new(-0.2, 0.5, 0.6))
            .build(),
    )
}

/// Scenes that separate in part, each by one thing.
fn scenes() -> Vec<(&'static str, Scene)> {
    let lit = || corner().point(DVec3::new(0.5, 1.0, 1.0), 2.0).sky(0.3);
    let map: Vec<f32> = (0..24).map(|i| 0.1 + 0.1 * (i % 7) as f32).collect();
    let gas = steps([0.1, 2.0, 0.5, 0.0, 1.0, 0.3]);
    let mut hot = corner().conductor(ball(), 0.9, 1.5, [0.3; 2]).at_kelvin(2500.0).build();
    hot.integrator.wavelengths = Wavelengths::Uniform;
    vec![
        ("plastic", lit().plastic(ball(), steps([0.2, 0.4, 0.6, 0.8, 0.3, 0.1]), 1.5, 0.2).build()),
        ("metal", lit().roulette(2).conductor(ball(), 0.3, 3.0, [0.3; 2]).build()),
        ("mirror", lit().conductor(ball(), 0.3, 3.0, [0.0; 2]).sun(DVec3::new(-0.3, -1.0, -0.2), 0.05, 3.0).build()),
        ("glass", lit().dielectric(ball(), 1.5, 0.0).build()),
        ("frosted glass", lit().dielectric(ball(), 1.5, 0.3).build()),
        ("a map", corner().rgb_map([4, 2], map).build()),
        ("gas", corner().gas(gas).null_box(DVec3::new(-0.6, -0.9, -0.3), DVec3::new(0.9, 0.5, 0.6)).build()),
        ("a hot metal", hot),
    ]
}

/// Where spectra are the same all over each channel, weights and remainder bring together what the very same paths bring in channels.
fn both_parts_bring_the_same(what: &str, scene: &Scene) {
    let channels = render_paths_of_weights(scene, 2, 64, Settings::default());
    let both = render(&scene.clone().factored(), 2, 64, Settings::default());
    assert_eq!(channels.rays, both.rays, "{what}");
    let (entries, remainder) = parts_of(scene, 64, Settings::default());
    assert!(entries > 0 && remainder > 0.0, "{what}: {entries} entries, {remainder}");
    let peak = channels.means.iter().flatten().copied().fold(0.0, f32::max);
    let off = |(a, b): (&f32, &f32)| (a - b).abs() / peak;
    let worst = channels.means.iter().flatten().zip(both.means.iter().flatten()).map(off).fold(0.0, f32::max);
    println!("{what}: {entries} entries, {worst:e} of the peak");
    assert!(worst <= 1e-5, "{what}: {worst:e}");
}

#[test]
fn surfaces_bring_the_same_in_two_parts() {
    both_parts_bring_the_same("surfaces", &surfaces());
}

#[test]
fn matter_brings_the_same_in_two_parts() {
    both_parts_bring_the_same("matter", &matter());
}

#[test]
#[ignore = "many kernels; the two above have most of it"]
fn everything_brings_the_same_in_two_parts() {
    scenes().iter().for_each(|(what, scene)| both_parts_bring_the_same(what, scene));
}

/// Waves of any size, and tiles: the same bits.
#[test]
fn waves_and_tiles_change_no_bit() {
    let scene = surfaces().factored();
    let usual = render(&scene, 2, 64, Settings::default());
    for settings in [
        Settings { budget: Budget { memory: None, paths: Some(777) }, ..Settings::default() },
        Settings { tile: [8, 8], units: 1, ..Settings::default() },
    ] {
        let other = render(&scene, 2, 64, settings);
        assert!(usual.means == other.means, "{settings:?}");
    }
}

/// Two rooms with a black wall between: in one everything separates, in the other nothing but the floor does. The lamp and the paint of
/// the first are exchanged, to lines and steps: the picture of the f64 reference under those.
#[test]
fn what_separates_is_relit_beside_what_does_not() {
    let scene = |lamp: Curve, paint: Curve| {
        let floor = |builder: Builder, x: f64, paint: Curve| {
            builder.diffuse(quad(DVec3::new(x, -1.0, 2.0), 2.0 * DVec3::X, 4.0 * DVec3::NEG_Z), paint)
        };
        let builder =
            Builder::new().into_corner().black(quad(DVec3::new(0.1, -3.0, 3.0), 6.0 * DVec3::NEG_Z, 6.0 * DVec3::Y));
        let builder = floor(builder, -1.9, paint);
        let builder = floor(builder, 0.1, Curve::Constant(0.4));
        builder
            .lamp(sphere(DVec3::new(-0.8, 0.6, 0.2), 0.3), lamp, Sides::Front)
            .lamp(sphere(DVec3::new(1.0, 0.8, 0.2), 0.3), table(&[400.0, 700.0], &[5.0, 2.0]), Sides::Front)
            .plastic(small(0.6), table(&[400.0, 700.0], &[0.1, 0.8]), 1.5, 0.2)
            .build()
    };
    let lines =
        table(&[400.0, 435.0, 436.0, 437.0, 545.0, 546.0, 547.0, 700.0], &[0.1, 0.1, 60.0, 0.1, 0.1, 80.0, 0.1, 0.2]);
    let hold =
        |nm: &[f64], value: &[f64]| Curve::Linear { nm: nm.to_vec(), value: value.to_vec(), outside: Outside::Hold };
    let paint = hold(&[400.0, 500.0, 500.0, 700.0], &[0.05, 0.05, 0.95, 0.9]);
    let rendered = scene(table(&[400.0, 700.0], &[3.0, 4.0]), hold(&[400.0, 700.0], &[0.5, 0.4]));
    let wanted = scene(lines, paint);
    let basis = separable::basis(&wanted).expect("a basis");
    let epochs = size::either(48, 256);
    let relit =
        render_relit(&rendered, &basis, &rendered.channels, epochs, 64, Settings { seed: 4, ..Settings::default() });
    let bound = Bound { resolution: size::either(0.25, 0.1), allowance: 1e-6 };
    assert_rendered_as_reference("two rooms", &relit, &wanted, 64 * epochs, bound);
}

/// What does not separate is named; what cannot be rendered so at all is refused.
#[test]
fn what_does_not_separate_is_named() {
    let named = |scene: Scene, words: &str| {
        let remainder = separable::of(&scene).expect(words).remainder;
        assert!(remainder.iter().any(|what| what.contains(words)), "{words}: {remainder:?}");
    };
    named(Builder::new().plastic(ball(), 0.5, 1.5, 0.2).build(), "plastic");
    named(Builder::new().dielectric(ball(), 1.5, 0.0).build(), "dielectric");
    named(Builder::new().conductor(ball(), 0.2, 3.0, [0.0; 2]).build(), "conductor");
    named(Builder::new().gas(1.0).build(), "media");
    named(Builder::new().rgb_map([2, 1], vec![1.0; 6]).build(), "environment map");
    let mut one_sided = Builder::new().one_sided(ball(), 0.5).at_kelvin(300.0).build();
    named(one_sided.clone(), "heat");
    one_sided.materials[0].bsdf = Bsdf::Diffuse { reflectance: Reflectance::Spectrum(0) };
    one_sided.materials[0].two_sided = true;
    let separated = separable::of(&one_sided).expect("a basis");
    assert!(separated.remainder.is_empty() && separated.basis.sources.len() == 1);
    let deep = Builder::new().bounces(65).diffuse(ball(), 0.5).build();
    let said = separable::of(&deep).err().expect("refused").to_string();
    assert!(said.contains("--factored") && said.contains("integrator.max_bounces"), "{said}");
}
