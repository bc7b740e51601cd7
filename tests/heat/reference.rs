//! The f64 path tracer on hot surfaces and in gases (docs/METHOD.md, Closed forms).

use glam::{DVec2, DVec3};
use spectile::scene::{Field, Filter, Light, Projection, Scene, Shape, Sides};
use spectile::spectral::{Channels, Curve, planck as law};

use crate::scene_builder::closed_forms::Case;
use crate::scene_builder::heat::*;
use crate::scene_builder::surfaces::{glass_curve, white_metal};
use crate::scene_builder::*;
use crate::size;
use crate::statistics::{Bound, Estimate, assert_estimates};
use crate::truth::{render, render_image};

fn estimates(e: &spectile::reference::Estimate) -> Vec<Estimate> {
    let freedom = f64::from(e.samples - 1);
    e.mean.iter().zip(&e.standard_error).map(|(&mean, &error)| Estimate { mean, error, freedom }).collect()
}

pub fn shown(scene: &Scene, samples: u32, seed: u64) -> Vec<Estimate> {
    estimates(&render_image(scene, samples, seed))
}

/// Every sample is `expected`, within `relative`.
#[track_caller]
fn assert_exact(scene: &Scene, expected: &[f64], relative: f64) {
    let e = render_image(scene, 64, 9);
    for ((mean, error), want) in e.mean.iter().zip(&e.standard_error).zip(expected) {
        assert!(
            (mean - want).abs() <= relative * want.abs() && *error <= relative * want.abs(),
            "{mean} ± {error}, {want}"
        );
    }
}

/// A path through glass meets a wall at every third event at least, others at every second; walls of cavities reflect a fifth, so that
/// less than 0.2^8, 3e-6, would come after these.
pub const BOUNCES: u32 = 24;

/// A ball of some material in a room of grey walls, both at 300 K, is not to be seen.
fn cavity(ball: impl FnOnce(Builder, Shape) -> Builder) -> Scene {
    let camera = look(1.5 * DVec3::Z, DVec3::ZERO, DVec3::Y, Projection::Orthographic { half_size: DVec2::splat(0.9) });
    let base = Builder::new()
        .camera(camera)
        .film(2, 2, Filter::Box)
        .channels(infrared())
        .bounces(BOUNCES)
        .diffuse(room(DVec3::splat(-2.0), DVec3::new(1.7, 2.0, 2.2)), 0.2)
        .at_kelvin(300.0);
    ball(base, sphere(DVec3::ZERO, 0.8)).build()
}

/// Kirchhoff: L = B(λ, T) in every channel. The emittance of rough surfaces is within 1e-4, and each is met twice or so.
#[test]
fn isothermal_cavities_of_every_material_are_black() {
    let expected = means(&planck(300.0), &infrared()).repeat(4);
    assert!((expected[2] - 9.924033e-3).abs() < 1e-8);
    type Ball = fn(Builder, Shape) -> Builder;
    let balls: [(&str, Ball, u32); 11] = [
        ("plastic", |b, s| b.plastic(s, 0.6, 1.5, 0.3).at_kelvin(300.0), 800),
        ("rough metal", |b, s| b.conductor(s, 5.0, 12.0, [0.4; 2]).at_kelvin(300.0), 800),
        (
            "blend of parts",
            |b, s| {
                let b = b.plastic(s.clone(), 0.2, 1.4, 0.0).at_kelvin(300.0).black(s.clone()).at_kelvin(300.0);
                b.blend_of_last_two(s, 0.7)
            },
            4_000,
        ),
        (
            "glass slab",
            |b, _| b.dielectric(cuboid(DVec3::new(-1.0, -1.0, -0.2), DVec3::new(1.0, 1.2, 0.1)), glass_curve(), 0.0),
            4_000,
        ),
        ("varnish", |b, s| b.plastic(s, 0.6, 1.5, 0.0).at_kelvin(300.0), 4_000),
        ("one-sided", |b, s| b.one_sided(s, 0.8).at_kelvin(300.0), 4_000),
        ("diffuse", |b, s| b.diffuse(s, 0.8).at_kelvin(300.0), 4_000),
        ("black", |b, s| b.black(s).at_kelvin(300.0), 5_000),
        ("mirror", |b, s| b.conductor(s, 25.0, 90.0, [0.0; 2]).at_kelvin(300.0), 4_000),
        (
            "brushed metal",
            |b, _| {
                b.conductor(disk(DVec3::ZERO, DVec3::new(0.3, 0.2, 1.0), 0.8), 5.0, 12.0, [0.5, 0.1]).at_kelvin(300.0)
            },
            400,
        ),
        (
            "blend",
            |b, s| {
                let b = white_metal(b, s.clone(), [0.0; 2]).diffuse(s.clone(), 0.2);
                b.blend_of_last_two(s, 0.4).at_kelvin(300.0)
            },
            4_000,
        ),
    ];
    for (name, ball, samples) in size::first(6, balls) {
        let estimates = shown(&cavity(ball), samples, 300);
        assert_estimates(name, &estimates, &expected, Bound { resolution: 0.06, allowance: 3e-4 });
    }
}

/// Without energy compensation what is lost is absorbed, and emitted.
#[test]
fn cavity_of_single_scattering() {
    let mut scene = cavity(|b, s| b.conductor(s, 5.0, 12.0, [0.9; 2]).at_kelvin(300.0));
    let spectile::scene::Bsdf::Conductor { energy_compensation, .. } = &mut scene.materials[1].bsdf else { panic!() };
    *energy_compensation = false;
    let expected = means(&planck(300.0), &infrared()).repeat(4);
    assert_estimates("lossy", &shown(&scene, 800, 301), &expected, Bound { resolution: 0.06, allowance: 3e-4 });
}

#[test]
fn hot_grey_plates() {
    for Case { scene, expected, seed } in hot_plates(1e3, 24) {
        // 1e-6 of the hemisphere is missing, twice, and r₁¹² r₂¹² beyond 24 bounces.
        let bound = Bound { resolution: 0.02, allowance: 1e-5 };
        assert_estimates("plates", &shown(&scene, 10_000, seed), &expected, bound);
    }
}

/// From the coldest to the hottest, also where nothing is left of it; emission and temperature add up.
#[test]
fn planck_of_hot_surfaces() {
    let channels = || Channels::from_bounds(vec![[380.0, 380.001], [549.99, 550.01], [19_999.9, 20_000.0]], None);
    for kelvin in [3.0, 220.0, 300.0, 5778.0, 50_000.0] {
        let scene = Builder::new()
            .channels(channels())
            .bounces(0)
            .lamp(disk(DVec3::ZERO, DVec3::Z, 1.0), 2.0, Sides::Front)
            .at_kelvin(kelvin)
            .build();
        let expected: Vec<f64> = means(&planck(kelvin), &channels()).iter().map(|b| b + 2.0).collect();
        assert_exact(&scene, &expected, 1e-3);
        let backside =
            Builder::new().channels(channels()).lamp(disk(DVec3::ZERO, DVec3::NEG_Z, 1.0), 2.0, Sides::Front);
        let middle: Vec<f64> = channels().bounds.iter().map(|b| law::radiance(0.5 * (b[0] + b[1]), kelvin)).collect();
        assert_exact(&backside.at_kelvin(kelvin).build(), &middle, 1e-2);
    }
}

#[test]
fn beer_lambert_and_isothermal_slabs() {
    let ten = || Channels::from_bounds(vec![[9_999.999, 10_000.001]], None);
    for depth in DEPTHS {
        let lamp = slab(depth, None, |b| b.lamp(disk(DVec3::ZERO, DVec3::Z, 2.0), 3.0, Sides::Front)).build();
        // Rays go on 1e-12 of the largest coordinate beside a boundary.
        assert_exact(&lamp, &[3.0 * (-depth).exp()], 1e-11 * depth.max(1.0));
        let scene = slab(depth, Some(300.0), |b| b.channels(ten())).build();
        let source = law::radiance(1e4, 300.0);
        assert_exact(&scene, &[source * -(-depth).exp_m1()], 1e-6);
        let scene =
            slab(depth, Some(300.0), |b| b.channels(ten()).black(disk(DVec3::ZERO, DVec3::Z, 2.0)).at_kelvin(280.0));
        let want = source * -(-depth).exp_m1() + law::radiance(1e4, 280.0) * (-depth).exp();
        assert!(depth != 1.0 || (want - 8.85884247e-3).abs() < 1e-10, "the published digits");
        assert_exact(&scene.build(), &[want], 1e-6);
    }
}

/// S = 1 + t in cells of the middle's temperature: each cell of depth h is off by at most h²/8 of what it sends.
#[test]
fn linear_source() {
    const CELLS: u32 = 256;
    for (depth, published) in [(0.5, 0.48367335), (1.0, 0.89636168), (2.0, 1.45865887)] {
        let unit = law::radiance(1e4, 300.0);
        // The camera looks along -z: t grows downwards.
        let kelvin = grid([1, 1, CELLS], |[_, _, z]| {
            kelvin_of(unit * (1.0 + depth * (f64::from(CELLS - 1 - z) + 0.5) / f64::from(CELLS)))
        });
        let base = Builder::new()
            .channels(Channels::from_bounds(vec![[9_999.999, 10_000.001]], None))
            .camera(look(DVec3::new(0.1, 0.2, 3.0), DVec3::new(0.1, 0.2, 0.0), DVec3::Y, narrow()))
            .medium(depth, Some(kelvin), Field::Constant(1.0))
            .null_box(DVec3::ZERO, DVec3::ONE);
        let step = depth / f64::from(CELLS);
        assert_exact(&base.build(), &[published * unit], step * step / 8.0 + 3e-6);
    }
}

/// Along any line, cells sum up to the same as short steps; a uniform grid is as no grid.
#[test]
fn grids_against_short_steps() {
    let hash = |[x, y, z]: [u32; 3], salt: u32| f64::from((x * 73 + y * 179 + z * 283 + salt * 37) % 101) / 100.0;
    let (low, high, size) = (DVec3::new(-1.0, -2.0, 0.0), DVec3::new(1.0, 1.0, 2.0), [5, 7, 4]);
    let nm = 10_000.0;
    for (i, from) in
        [DVec3::new(4.0, 1.0, 3.0), DVec3::new(0.2, 0.1, 5.0), DVec3::new(0.3, -0.4, 0.9)].into_iter().enumerate()
    {
        let to = DVec3::new(-0.31, -0.27, 0.43) + 0.2 * f64::from(i as u32) * DVec3::X;
        let camera = look(from, to, DVec3::new(0.3, 1.0, 0.2), narrow());
        let scene = |temperature: Field, density: Field| {
            Builder::new()
                .channels(Channels::from_bounds(vec![[nm - 1e-6, nm + 1e-6]], None))
                .camera(camera.clone())
                .medium(0.7, Some(temperature), density)
                .null_box(low, high)
                .build()
        };
        let uneven = scene(grid(size, |v| 250.0 + 300.0 * hash(v, 1)), grid(size, |v| 2.0 * hash(v, 2)));
        let direction = (to - from).normalize();
        let (mut radiance, mut through) = (0.0, 1.0);
        const STEPS: u32 = 2_000_000;
        let step = 10.0 / f64::from(STEPS);
        for s in 0..STEPS {
            let place = (from + (f64::from(s) + 0.5) * step * direction - low) / (high - low);
            if place.min_element() < 0.0 || place.max_element() >= 1.0 {
                continue;
            }
            let voxel = std::array::from_fn(|axis| (place[axis] * f64::from(size[axis])) as u32);
            let depth = f64::from((2.0 * hash(voxel, 2)) as f32) * 0.7 * step;
            radiance += through * law::radiance(nm, f64::from((250.0 + 300.0 * hash(voxel, 1)) as f32)) * depth;
            through *= 1.0 - depth;
        }
        // Steps that straddle one of up to 20 cell boundaries, and first order in the depth of a step.
        assert_exact(&uneven, &[radiance], 1e-3);
        let even = scene(grid(size, |_| 400.0), grid(size, |_| 1.5));
        let none = scene(Field::Constant(400.0), Field::Constant(1.5));
        assert_exact(&even, &render_image(&none, 64, 9).mean, 1e-9);
    }
}

/// One spiky line in a wide channel: the mean over wavelengths, drawn one a path.
#[test]
fn lorentz_equivalent_width() {
    for (x, published) in [(0.01, 0.06251926), (0.1, 0.59841017), (1.0, 4.23279359), (10.0, 15.6511644)] {
        let (line, channels, expected) = lorentz_line(x, published);
        let lamp = slab(0.0, None, |b| b.channels(channels).lamp(disk(DVec3::ZERO, DVec3::Z, 2.0), 1.0, Sides::Front));
        let mut scene = lamp.build();
        scene.spectra[scene.media[0].components[0].absorbers[0].columns[0].1].curve = line;
        let e = estimates(&render(&scene, &[[0, 0]], 200_000, 320))[0];
        // 1 - mean: the width itself.
        let width = Estimate { mean: 1.0 - e.mean, ..e };
        // Wings are taken as τ, not 1 - e^-τ: τ² / 2 of them at most, τ(50 nm) = 2 x 1e-4; and the table's nodes.
        let bound = Bound { resolution: 0.04, allowance: 2e-3 };
        assert_estimates("line", &[width], &[1.0 - expected], bound);
    }
}

/// Inside a gas, in a gas within a gas, in the medium outside everything, before and behind a null boundary of nothing.
#[test]
fn cameras_and_nested_media() {
    let lamp = |b: Builder| b.lamp(disk(DVec3::ZERO, DVec3::Z, 50.0), 1.0, Sides::Front);
    let cube = |half: f64| (DVec3::new(-half, -half, 5.0 - half), DVec3::new(half, half, 5.0 + half));
    // Boxes of 0.3 and 0.7 per metre around z = 5, half sides 2 and 1; outside 0.1; the inner one is met last or first.
    let nested = |inner_first: bool, outer: bool| {
        let b = lamp(Builder::new());
        let (big, small) = (cube(2.0), cube(1.0));
        let b = if inner_first {
            b.gas(0.7).null_box(small.0, small.1).gas(0.3).null_box(big.0, big.1)
        } else {
            b.gas(0.3).null_box(big.0, big.1).gas(0.7).null_box(small.0, small.1)
        };
        if outer { b.gas(0.1).outer() } else { b }
    };
    for inner_first in [true, false] {
        let cameras: [(f64, f64, f64); 5] = [
            (9.0, 2.0 * 0.7 + 2.0 * 0.3, 5.0),
            (6.5, 2.0 * 0.7 + 1.5 * 0.3, 3.0),
            (5.25, 1.25 * 0.7 + 0.3, 3.0),
            (3.5, 0.15, 3.0),
            (1.0, 0.0, 1.0),
        ];
        for (height, depth, outside) in cameras {
            let scene = nested(inner_first, false).camera(down(height)).build();
            assert_exact(&scene, &[(-depth).exp()], 1e-10);
            let scene = nested(inner_first, true).camera(down(height)).build();
            assert_exact(&scene, &[(-depth - 0.1 * outside).exp()], 1e-10);
        }
    }
    // What arrives from infinity has been measured at the scene, however many boundaries of nothing are in between.
    let sky = |b: Builder| b.sky(1.0).gas(0.1).outer().camera(look(9.0 * DVec3::Z, DVec3::ZERO, DVec3::Y, narrow()));
    assert_exact(&sky(Builder::new()).build(), &[1.0], 1e-14);
    assert_exact(&sky(Builder::new().gas(0.0).null_box(cube(2.0).0, cube(2.0).1)).build(), &[1.0], 1e-14);
    assert_exact(&sky(Builder::new().gas(0.25).null_box(cube(2.0).0, cube(2.0).1)).build(), &[(-1f64).exp()], 1e-10);
}

/// Camera rays of one camera that start in different media: a window and a lens that boundaries cut.
#[test]
fn cameras_cut_by_media() {
    for inner_first in [true, false] {
        let (scene, expected) = window_in_gases(inner_first);
        assert_exact(&scene, &expected, 1e-10);
    }
    let Case { scene, expected, seed } = lens_in_gas();
    // A thousand steps of the midpoint rule, across a kink.
    let bound = Bound { resolution: 2e-3, allowance: 1e-5 };
    assert_estimates("lens", &shown(&scene, 100_000, seed), &expected, bound);
}

/// Light that is aimed at goes through gas on its way too: a patch under a point light and a sun.
#[test]
fn shadow_rays_through_gas() {
    let base = || {
        Builder::new()
            .camera(look(DVec3::new(0.0, 0.6, 0.8), DVec3::ZERO, DVec3::X, narrow()))
            .diffuse(disk(DVec3::ZERO, DVec3::Z, 50.0), 0.5)
            .gas(0.4)
            .null(sphere(DVec3::ZERO, 2.0))
    };
    let mut scene = base().build();
    scene.lights.push(Light::Point { position: 1.5 * DVec3::Z, intensity: 0 });
    let lit = |distance: f64| 0.5 / std::f64::consts::PI * 0.5 / (distance * distance);
    // The first spectrum is the number 0.5; the camera is a metre away.
    assert_exact(&scene, &[lit(1.5) * (-0.4f64 * (1.0 + 1.5)).exp()], 1e-10);
    scene.lights[0] = Light::Point { position: 3.0 * DVec3::Z, intensity: 0 };
    assert_exact(&scene, &[lit(3.0) * (-0.4f64 * (1.0 + 2.0)).exp()], 1e-10);
    scene.lights[0] = Light::Directional { direction: DVec3::NEG_Z, irradiance: 0 };
    assert_exact(&scene, &[0.5 / std::f64::consts::PI * 0.5 * (-0.4f64 * 3.0).exp()], 1e-10);
}

/// A null boundary around nothing changes nothing, path by path: a lamp, a wall, glass and a sky. Every pixel's one sample
/// has random numbers of its own; glass may turn a difference of 1e-12 in where a ray starts into another path, seldom.
#[test]
fn null_boundaries_change_nothing() {
    let scene = |null: bool| {
        let view = Projection::Perspective { tan_half: DVec2::splat(0.4) };
        let b = Builder::new()
            .camera(look(DVec3::new(0.0, 0.5, 3.0), DVec3::ZERO, DVec3::Y, view))
            .film(40, 40, Filter::Box)
            .bounces(6)
            .diffuse(disk(DVec3::new(0.0, -1.0, 0.0), DVec3::Y, 4.0), 0.7)
            .dielectric(sphere(DVec3::ZERO, 0.5), 1.5, 0.0)
            .lamp(sphere(DVec3::new(1.0, 1.0, 0.5), 0.2), 20.0, Sides::Front)
            .sky(0.3);
        if null {
            b.gas(0.0).null(sphere(DVec3::new(0.1, 0.0, 0.0), 0.9)).null(sphere(DVec3::splat(0.5), 1.7)).build()
        } else {
            b.build()
        }
    };
    let [with, without] = [true, false].map(|null| render_image(&scene(null), 1, 330).mean);
    let changed = with.iter().zip(&without).filter(|(a, b)| (**a - **b).abs() > 1e-6 * **b).count();
    assert!(changed <= 3, "{changed} of {} paths", with.len());
}

/// Glass that absorbs: T = (1 - R)² e^-τ / (1 - R² e^-2τ), all orders at normal incidence.
#[test]
fn absorbing_glass() {
    let (r, depth) = (0.04, 0.8f64);
    let scene = Builder::new()
        .camera(look(DVec3::new(0.1, 0.2, 4.0), DVec3::new(0.1, 0.2, 0.0), DVec3::Y, narrow()))
        .dielectric(cuboid(DVec3::new(-5.0, -5.0, 0.0), DVec3::new(5.0, 5.0, 1.0)), 1.5, 0.0)
        .gas(depth)
        .filled()
        .lamp(quad(DVec3::new(-5.0, -5.0, -1.0), 10.0 * DVec3::X, 10.0 * DVec3::Y), 1.0, Sides::Front)
        .bounces(60)
        .build();
    let through = (-depth).exp();
    let expected = (1.0 - r) * (1.0 - r) * through / (1.0 - (r * through).powi(2));
    assert_estimates("glass", &shown(&scene, 100_000, 340), &[expected], Bound { resolution: 0.01, allowance: 0.0 });
}

/// A hot gas in a cavity at its temperature is not to be seen, hot glass of its own neither.
#[test]
fn isothermal_cavity_with_gas() {
    let expected = means(&planck(300.0), &infrared()).repeat(4);
    let curve =
        || Curve::Linear { nm: vec![3e3, 20e3], value: vec![0.01, 2.0], outside: spectile::spectral::Outside::Hold };
    let gas = |b: Builder| b.medium(curve(), Some(Field::Constant(300.0)), Field::Constant(1.0));
    let bound = Bound { resolution: 0.06, allowance: 0.0 };
    let plume = cavity(|b, ball| gas(b).null(ball));
    assert_estimates("plume", &shown(&plume, 4_000, 350), &expected, bound);
    let glass = cavity(|b, ball| gas(b.dielectric(ball, 1.5, 0.0)).filled());
    assert_estimates("glass", &shown(&glass, 4_000, 351), &expected, bound);
}
