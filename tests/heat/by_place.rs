//! Surfaces that emit otherwise at every place or by azimuth: temperatures, reflectances and shares from textures, brushed
//! metals. Closed forms through the reference and through devices, and one against the other.

use glam::{DMat3, DVec2, DVec3};
use spectile::device::prepared::Prepared;
use spectile::scene::{Attributes, Camera, Filter, Projection, Scene, Shape, Sides, TextureKind};
use spectile::spectral::{Channels, Curve, Outside, planck as law};

use super::reference::{BOUNCES, shown};
use crate::device::{Settings, assert_as_reference, measure, render};
use crate::scene_builder::heat::*;
use crate::scene_builder::*;
use crate::size;
use crate::statistics::*;
use crate::truth;

fn upright() -> Attributes {
    Attributes { axes: Some(DMat3::IDENTITY), ..Attributes::default() }
}

fn slope(from: f64, to: f64) -> Curve {
    Curve::Linear { nm: vec![3e3, 20e3], value: vec![from, to], outside: Outside::Hold }
}

/// A 2 x 2 picture of numbers.
fn numbers(b: &mut Builder, texels: [f32; 4]) -> usize {
    b.texture([2, 2], &texels, TextureKind::Number)
}

/// Half of each of two spectra, and less of both: in all texels something else.
fn mixture(b: &mut Builder) -> usize {
    b.mixture([2, 2], &[1.0, 0.0, 0.5, 0.5, 0.0, 1.0, 0.2, 0.3], &[slope(0.9, 0.3), slope(0.1, 0.8)])
}

/// Straight down at the unit square.
fn above() -> Camera {
    let middle = DVec3::new(0.5, 0.5, 0.0);
    look(middle + DVec3::Z, middle, DVec3::Y, Projection::Orthographic { half_size: DVec2::splat(0.5) })
}

fn unit_square() -> Shape {
    quad(DVec3::ZERO, DVec3::X, DVec3::Y)
}

/// A texture of one temperature is that temperature, from 3 K to 50,000 K, before and behind; where it says 0 K, nothing.
#[test]
fn a_texture_of_one_temperature_is_plancks_law() {
    // So narrow that Planck's law is the same all over, also where it falls as e^-500.
    let bounds = [380.0, 550.0, 10_000.0, 19_999.0].map(|nm| [nm * (1.0 - 1e-9), nm * (1.0 + 1e-9)]);
    for kelvin in [0.0f32, 3.0, 220.0, 300.0, 5778.0, 50_000.0] {
        for normal in [DVec3::Z, DVec3::NEG_Z] {
            let mut b = Builder::new().channels(Channels::from_bounds(bounds.to_vec(), None)).bounces(0);
            let texture = numbers(&mut b, [kelvin; 4]);
            let scene = b.film(4, 4, Filter::Box).black(disk(DVec3::ZERO, normal, 1.0)).heated_by(texture);
            let scene = scene.attributes(upright()).build();
            let rendered = render(&scene, 1, 64, Settings::default());
            rendered.assert_clean();
            let exact = truth::render_image(&scene, 4, 1).mean;
            for (i, value) in rendered.means[0].iter().enumerate() {
                let [from, to] = bounds[i % 4];
                let want = law::radiance(0.5 * (from + to), f64::from(kelvin));
                // f32: x of e^-x is off by some 3e-7 of itself, and is 88 where nothing is left.
                let bound = 3e-5 * want + f64::from(f32::MIN_POSITIVE);
                assert!((f64::from(*value) - want).abs() <= bound, "{kelvin} K, {from} nm: {value}, {want}");
                assert!(
                    (exact[i] - want).abs() <= 1e-5 * want,
                    "{kelvin} K, {from} nm, reference: {}, {want}",
                    exact[i]
                );
            }
        }
    }
}

/// A checker of 300 and 900 K: temperatures are bilinear between the texels' centres, so that over the unit square the mean
/// of f(T) is that over T = 300 + 600 (s + t - 2 s t), s and t uniform. Seen as a whole, and by a wall far away.
#[test]
fn a_checker_of_two_temperatures() {
    const STEPS: u32 = 400;
    let mean = |nm: f64| {
        let at = |i: u32| (f64::from(i) + 0.5) / f64::from(STEPS);
        let pairs = (0..STEPS * STEPS).map(|i| (at(i % STEPS), at(i / STEPS)));
        pairs.map(|(s, t)| 0.8 * law::radiance(nm, 300.0 + 600.0 * (s + t - 2.0 * s * t))).sum::<f64>()
            / f64::from(STEPS * STEPS)
    };
    let bounds = vec![[1_999.9, 2_000.1], [3_999.9, 4_000.1], [9_999.9, 10_000.1], [19_999.8, 20_000.0]];
    let expected: Vec<f64> = bounds.iter().map(|b| mean(0.5 * (b[0] + b[1]))).collect();
    let base = |camera: Camera| {
        let mut b = Builder::new().camera(camera).channels(Channels::from_bounds(bounds.clone(), None));
        let texture = numbers(&mut b, [300.0, 900.0, 900.0, 300.0]);
        b.diffuse(unit_square(), 0.2).heated_by(texture).attributes(quad_uv())
    };
    let scene = base(above()).film(8, 8, Filter::Box).bounces(0).build();
    let ours = render(&scene, 8, 256, Settings { seed: 3, ..Settings::default() });
    ours.assert_clean();
    assert_estimates("seen", &ours.image_means(), &expected, Bound { resolution: 4e-3, allowance: 1e-5 });
    let theirs = truth::render_image(&scene, 20_000, 3);
    for (k, want) in expected.iter().enumerate() {
        let all = |values: &[f64]| values.iter().skip(k).step_by(4).copied().collect::<Vec<f64>>();
        let (means, errors) = (all(&theirs.mean), all(&theirs.standard_error));
        let pixels = means.len() as f64;
        let error = errors.iter().map(|e| e * e).sum::<f64>().sqrt() / pixels;
        let estimate = Estimate { mean: means.iter().sum::<f64>() / pixels, error, freedom: 1e5 };
        assert_estimates("reference", &[estimate], &[*want], Bound { resolution: 1e-3, allowance: 1e-6 });
    }
    // From 50 m away the square has one direction and one solid angle, to 1e-4: E = L / 2500, of which a wall of 0.5 sends on
    // 0.5 E / pi. Orientation: a wall of 1 cm in front, turned to it.
    let wall = disk(DVec3::new(0.5, 0.5, 50.0), DVec3::NEG_Z, 0.01);
    let camera = look(DVec3::new(0.5, 0.9, 49.0), DVec3::new(0.5, 0.5, 50.0), DVec3::Y, narrow());
    let scene = base(camera).diffuse(wall, 0.5).bounces(1).build();
    let expected: Vec<f64> = expected.iter().map(|l| l / 2_500.0 * 0.5 / std::f64::consts::PI).collect();
    assert_estimates("lit", &measure(scene.clone(), 4, 4), &expected, Bound { resolution: 0.01, allowance: 3e-4 });
    assert_estimates("lit", &shown(&scene, 100_000, 4), &expected, Bound { resolution: 0.01, allowance: 2e-4 });
}

type Ball = fn(Builder, Shape) -> Builder;

/// Surfaces at 300 K all over, whatever they consist of.
const OF_ONE_TEMPERATURE: [(&str, Ball); 10] = [
    ("plastic over a mixture", |mut b, s| {
        let texture = mixture(&mut b);
        b.coated(s, texture, 1.5, 0.3).at_kelvin(300.0)
    }),
    ("masked metal", |mut b, s| {
        let mask = numbers(&mut b, [0.0, 1.0, 0.3, 0.8]);
        let b = b.conductor(s.clone(), 5.0, 12.0, [0.3; 2]).diffuse(s.clone(), slope(0.1, 0.6));
        b.masked_last_two(s, mask).at_kelvin(300.0)
    }),
    ("brushed metal", |b, s| b.conductor(s, slope(2.0, 9.0), slope(5.0, 20.0), [0.5, 0.1]).at_kelvin(300.0)),
    ("soot", |mut b, s| {
        let t = numbers(&mut b, [300.0; 4]);
        b.black(s).heated_by(t)
    }),
    ("one-sided", |mut b, s| {
        let t = numbers(&mut b, [300.0; 4]);
        b.one_sided(s, 0.7).heated_by(t)
    }),
    ("mixture", |mut b, s| {
        let texture = mixture(&mut b);
        b.textured(s, texture).at_kelvin(300.0)
    }),
    ("colours", |mut b, s| {
        let rgb = [0.9, 0.1, 0.05, 0.2, 0.8, 0.3, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0];
        let texture = b.texture([2, 2], &rgb, TextureKind::Colour);
        b.textured(s, texture).at_kelvin(300.0)
    }),
    ("varnish over a mixture", |mut b, s| {
        let texture = mixture(&mut b);
        b.coated(s, texture, 1.5, 0.0).at_kelvin(300.0)
    }),
    ("plastic", |mut b, s| {
        let t = numbers(&mut b, [300.0; 4]);
        b.plastic(s, slope(0.2, 0.9), 1.5, 0.3).heated_by(t)
    }),
    ("mirror", |mut b, s| {
        let t = numbers(&mut b, [300.0; 4]);
        b.conductor(s, 5.0, 12.0, [0.0; 2]).heated_by(t)
    }),
];

/// In a room at its temperature, whose walls are as hot as a texture says, none of them can be seen.
fn cavity(ball: Ball) -> Scene {
    let camera = look(DVec3::new(0.1, 0.2, 1.2), DVec3::new(0.35, 0.17, 0.0), DVec3::Y, narrow());
    let mut b = Builder::new().camera(camera).channels(infrared()).bounces(BOUNCES);
    let t = numbers(&mut b, [300.0; 4]);
    let walls = b.diffuse(room(DVec3::splat(-1.5), DVec3::splat(1.5)), 0.2).heated_by(t);
    ball(walls, sphere(DVec3::ZERO, 0.5)).attributes(upright()).build()
}

/// Kirchhoff through devices: L = B(λ, T) in every channel, to what the tables of `scattering` are within, 1e-4, met twice or so.
#[test]
fn isothermal_cavities_on_devices() {
    let expected = means(&planck(300.0), &infrared());
    for (i, (name, ball)) in size::first(4, OF_ONE_TEMPERATURE).enumerate() {
        let bound = Bound { resolution: 0.01, allowance: 10.0 * ORIGIN_OFFSET + 4e-4 };
        assert_estimates(name, &measure(cavity(ball), 1, 430 + i as u64), &expected, bound);
    }
}

/// And through the reference; its brushed metals, whose tables take long, are in a cavity in `reference`.
#[test]
fn isothermal_cavities_of_the_reference() {
    let expected = means(&planck(300.0), &infrared());
    for (i, (name, ball)) in
        OF_ONE_TEMPERATURE.into_iter().enumerate().filter(|(_, (name, _))| *name != "brushed metal")
    {
        let bound = Bound { resolution: 0.06, allowance: 3e-4 };
        assert_estimates(name, &shown(&cavity(ball), 2_000, 450 + i as u64), &expected, bound);
    }
}

/// Without energy compensation a brushed metal keeps what its facets have lost.
#[test]
fn cavity_of_single_scattering_by_brushed_metal() {
    let mut scene = cavity(|b, s| b.conductor(s, 5.0, 12.0, [0.5, 0.1]).at_kelvin(300.0));
    let spectile::scene::Bsdf::Conductor { energy_compensation, .. } = &mut scene.materials[1].bsdf else { panic!() };
    *energy_compensation = false;
    let bound = Bound { resolution: 0.01, allowance: 10.0 * ORIGIN_OFFSET + 1e-4 };
    assert_estimates("lossy", &measure(scene, 2, 470), &means(&planck(300.0), &infrared()), bound);
}

/// All of it at once, at many temperatures, before cold walls that it lights: devices as the reference, pixel by pixel.
#[test]
fn textured_heat_agrees_with_the_reference() {
    let view = Projection::Perspective { tan_half: DVec2::splat(0.55) };
    let mut b = Builder::new()
        .camera(look(DVec3::new(0.1, 0.3, 1.8), DVec3::new(0.0, -0.3, 0.0), DVec3::Y, view))
        .film(5, 5, Filter::Box)
        .channels(Channels::from_bounds(vec![[1.9e3, 2.1e3], [3.9e3, 4.1e3], [9.5e3, 10.5e3]], None))
        .bounces(4)
        .diffuse(room(DVec3::splat(-2.0), DVec3::splat(2.0)), 0.6)
        .at_kelvin(290.0);
    let (hot, warm) = (numbers(&mut b, [700.0, 400.0, 0.0, 550.0]), numbers(&mut b, [320.0, 450.0, 450.0, 380.0]));
    let (mask, soil) = (numbers(&mut b, [0.0, 1.0, 0.4, 0.7]), mixture(&mut b));
    let plate = |x: f64, y: f64| quad(DVec3::new(x, y, -0.6), 0.7 * DVec3::X, DVec3::new(0.0, 0.7, 0.1));
    let scene = b
        .textured(plate(-0.9, -1.0), soil)
        .heated_by(warm)
        .attributes(quad_uv())
        .conductor(plate(0.1, -1.0), slope(2.0, 9.0), slope(5.0, 20.0), [0.5, 0.1])
        .heated_by(hot)
        .attributes(quad_uv())
        .coated(plate(-0.9, -0.1), soil, 1.5, 0.0)
        .heated_by(warm)
        .attributes(quad_uv())
        .conductor(plate(0.1, -0.1), 5.0, 12.0, [0.3; 2])
        .plastic(plate(0.1, -0.1), 0.5, 1.5, 0.4)
        .masked_last_two(plate(0.1, -0.1), mask)
        .heated_by(hot)
        .attributes(quad_uv())
        .lamp(sphere(DVec3::new(0.0, 0.9, -0.2), 0.2), 0.02, Sides::Front)
        .heated_by(warm)
        .attributes(upright())
        .build();
    // The tables of `scattering` are within 1e-3: over four events, and in the mean.
    let (reference, resolution) = if size::is_full() { (20_000, 0.06) } else { (2_500, 0.12) };
    let bound = Bound { resolution, allowance: 10.0 * ORIGIN_OFFSET + 1e-3 };
    assert_as_reference("textured heat", &scene, [size::either(32, 128), 64], reference, bound);
}

/// Scenes without such surfaces have none of it: not in their shaders' switches, nor in their records.
#[test]
fn other_heat_pays_nothing() {
    let scene = Builder::new().plastic(unit_square(), 0.5, 1.5, 0.1).at_kelvin(300.0).build();
    let prepared = Prepared::new(&scene, 0).unwrap_or_else(|e| panic!("{e}"));
    assert!(prepared.is_general() && prepared.radiators.is_none() && prepared.wavelength.is_none());
}
