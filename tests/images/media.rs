//! Gases on devices: closed forms (docs/METHOD.md), cameras and volumes within volumes, ways to lights.
//!
//! Where a path has nothing to choose, every sample is the answer to f32 rounding: Sums over voxels add half a digit each, and
//! rays start 2⁻¹⁶ of the scene's half size off the boundaries that they pass.

use glam::{DVec2, DVec3};
use spectile::scene::{Field, Filter, Light, Projection, Scene, Shape, Sides};
use spectile::spectral::{Channels, Curve, Outside, planck as law};

use crate::device::{Settings, assert_as_reference, measure, render};
use crate::scene_builder::closed_forms::Case;
use crate::scene_builder::heat::*;
use crate::scene_builder::surfaces::glass_curve;
use crate::scene_builder::*;
use crate::size;
use crate::statistics::{Bound, Estimate, ORIGIN_OFFSET, assert_estimates};

/// Every sample is `expected`, within `relative` and the least normal f32.
#[track_caller]
fn assert_exact(scene: &Scene, expected: &[f64], relative: f64) {
    let rendered = render(scene, 1, 64, Settings::default());
    rendered.assert_clean();
    for values in rendered.means[0].chunks(expected.len()) {
        for (value, want) in values.iter().zip(expected) {
            let bound = relative * want.abs() + f64::from(f32::MIN_POSITIVE);
            assert!((f64::from(*value) - want).abs() <= bound, "{value}, {want}: {:e}", f64::from(*value) / want - 1.0);
        }
    }
}

/// Half size of the scene of `slab` with a wall of radius 2, m.
const HALF_SIZE: f64 = 2.0;

#[test]
fn beer_lambert_and_isothermal_slabs() {
    let ten = || Channels::from_bounds(vec![[9_999.99, 10_000.01]], None);
    for depth in DEPTHS {
        // The way starts a little late, and the exponent is rounded.
        let of_depth = depth * (2.0 * HALF_SIZE * ORIGIN_OFFSET + 3e-7);
        let lamp = slab(depth, None, |b| b.lamp(disk(DVec3::ZERO, DVec3::Z, 2.0), 3.0, Sides::Front)).build();
        assert_exact(&lamp, &[3.0 * (-depth).exp()], of_depth + 1e-6);
        let scene = slab(depth, Some(300.0), |b| b.channels(ten())).build();
        let source = law::radiance(1e4, 300.0);
        // An optical depth is right to the offset, relatively; Planck's tables to 1e-5.
        assert_exact(&scene, &[source * -(-depth).exp_m1()], 2.0 * ORIGIN_OFFSET + 2e-5);
        let wall = |b: Builder| b.channels(ten()).lamp(disk(DVec3::ZERO, DVec3::Z, 2.0), planck(280.0), Sides::Front);
        let want = source * -(-depth).exp_m1() + law::radiance(1e4, 280.0) * (-depth).exp();
        assert!(depth != 1.0 || (want - 8.85884247e-3).abs() < 1e-10, "the published digits");
        assert_exact(&slab(depth, Some(300.0), wall).build(), &[want], of_depth.min(1e-4) + 2e-5);
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
            .channels(Channels::from_bounds(vec![[9_999.99, 10_000.01]], None))
            .camera(down(3.0))
            .medium(depth, Some(kelvin), Field::Constant(1.0))
            .null_box(DVec3::ZERO, DVec3::ONE);
        let step = depth / f64::from(CELLS);
        // Temperatures and Planck's law in f32: x = c₂/(λT) = 4.8 is off by 2e-7, and so is the rest.
        assert_exact(&base.build(), &[published * unit], step * step / 8.0 + 2.0 * ORIGIN_OFFSET + 1e-5);
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
                .channels(Channels::from_bounds(vec![[nm - 1e-2, nm + 1e-2]], None))
                .camera(camera.clone())
                .medium(0.7, Some(temperature), density)
                .null_box(low, high)
                .build()
        };
        let uneven = scene(grid(size, |v| 250.0 + 300.0 * hash(v, 1)), grid(size, |v| 2.0 * hash(v, 2)));
        let direction = (to - from).normalize();
        let (mut radiance, mut through) = (0.0, 1.0);
        const STEPS: u32 = 1_000_000;
        let step = 10.0 / f64::from(STEPS);
        for s in 0..STEPS {
            let place = (from + (f64::from(s) + 0.5) * step * direction - low) / (high - low);
            if place.min_element() < 0.0 || place.max_element() >= 1.0 {
                continue;
            }
            let voxel = std::array::from_fn(|axis| (place[axis] * f64::from(size[axis])) as u32);
            let depth = 2.0 * hash(voxel, 2) * 0.7 * step;
            radiance += through * law::radiance(nm, 250.0 + 300.0 * hash(voxel, 1)) * -(-depth).exp_m1();
            through *= (-depth).exp();
        }
        // Steps that straddle one of up to 16 planes, 1e-5 m of a way of metres each; rays start 2⁻¹⁶ beside the box.
        assert_exact(&uneven, &[radiance], 1e-3);
        let even = scene(grid(size, |_| 400.0), grid(size, |_| 1.5));
        let none = scene(Field::Constant(400.0), Field::Constant(1.5));
        let want = f64::from(render(&none, 1, 64, Settings::default()).means[0][0]);
        assert_exact(&even, &[want], 3e-5);
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
        let e = measure(scene, 16, 320)[0];
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
    let lamp = |b: Builder| b.lamp(disk(DVec3::ZERO, DVec3::Z, 4.0), 1.0, Sides::Front);
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
    // Half the scene is 4 m, and up to five rays start beside where they should.
    let bound = 5.0 * 4.0 * ORIGIN_OFFSET + 1e-6;
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
            assert_exact(&scene, &[(-depth).exp()], bound);
            let scene = nested(inner_first, true).camera(down(height)).build();
            assert_exact(&scene, &[(-depth - 0.1 * outside).exp()], bound);
        }
    }
    // What arrives from infinity has been measured at the scene, however many boundaries of nothing are in between.
    let sky = |b: Builder| b.sky(1.0).gas(0.1).outer().camera(look(9.0 * DVec3::Z, DVec3::ZERO, DVec3::Y, narrow()));
    assert_exact(&sky(Builder::new()).build(), &[1.0], 1e-6);
    assert_exact(&sky(Builder::new().gas(0.0).null_box(cube(2.0).0, cube(2.0).1)).build(), &[1.0], 1e-6);
    assert_exact(&sky(Builder::new().gas(0.25).null_box(cube(2.0).0, cube(2.0).1)).build(), &[(-1f64).exp()], bound);
}

/// Camera rays of one camera that start in different media: a window and a lens that boundaries cut, also among bodies of glass.
#[test]
fn cameras_cut_by_media() {
    for inner_first in [true, false] {
        let (scene, expected) = window_in_gases(inner_first);
        assert_exact(&scene, &expected, 3.0 * 4.0 * ORIGIN_OFFSET + 1e-6);
    }
    let Case { scene, expected, seed } = lens_in_gas();
    let bound = Bound { resolution: 2e-3, allowance: 4.0 * ORIGIN_OFFSET + 1e-5 };
    assert_estimates("lens", &measure(scene, 8, seed), &expected, bound);
    // Tables of Planck's law and of the gas are within 1e-4 of a channel's peak.
    let bound = Bound { resolution: 0.03, allowance: 20.0 * ORIGIN_OFFSET + 3e-4 };
    assert_as_reference("lens in glass", &lens_in_glass(), [32, 256], 10_000, bound);
}

/// A line scanner's rays start where it is at their moment, in whatever gas is there: against the closed form and the reference.
#[test]
fn line_scanners_in_media() {
    for inner_first in [true, false] {
        let Case { scene, expected, seed } = scanner_in_gases(inner_first);
        let bound = Bound { resolution: 5e-3, allowance: 5.0 * 5.0 * ORIGIN_OFFSET + 1e-5 };
        for (row, expected) in expected.into_iter().enumerate() {
            let row = row as u32;
            let mut line = scene.clone();
            line.film.crop = [0, row, 16, row + 1];
            let rendered = render(&line, 8, 64, Settings { seed, ..Settings::default() });
            rendered.assert_clean();
            assert_estimates(&format!("line {row}"), &rendered.image_means(), &[expected], bound);
        }
        let bound = Bound { resolution: 0.03, allowance: 5.0 * 5.0 * ORIGIN_OFFSET + 3e-4 };
        let mut column = scene;
        column.film.crop = [0, 0, 1, 7];
        assert_as_reference("scanner", &column, [32, 256], 10_000, bound);
    }
}

/// Light that is aimed at goes through gas on its way too: a patch under a point light and a directional one.
#[test]
fn shadow_rays_through_gas() {
    let base = || {
        Builder::new()
            .camera(look(DVec3::new(0.0, 0.6, 0.8), DVec3::ZERO, DVec3::X, narrow()))
            .diffuse(disk(DVec3::ZERO, DVec3::Z, 4.0), 0.5)
            .gas(0.4)
            .null(sphere(DVec3::ZERO, 2.0))
    };
    let lit = |distance: f64| 0.5 / std::f64::consts::PI * 0.5 / (distance * distance);
    // The first spectrum is the number 0.5; the camera is a metre away.
    let mut scene = base().build();
    let bound = 8.0 * 4.0 * ORIGIN_OFFSET + 1e-6;
    scene.lights.push(Light::Point { position: 1.5 * DVec3::Z, intensity: 0 });
    assert_exact(&scene, &[lit(1.5) * (-0.4f64 * (1.0 + 1.5)).exp()], bound);
    scene.lights[0] = Light::Point { position: 3.0 * DVec3::Z, intensity: 0 };
    assert_exact(&scene, &[lit(3.0) * (-0.4f64 * (1.0 + 2.0)).exp()], bound);
    scene.lights[0] = Light::Directional { direction: DVec3::NEG_Z, irradiance: 0 };
    assert_exact(&scene, &[0.5 / std::f64::consts::PI * 0.5 * (-0.4f64 * 3.0).exp()], bound);
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
        .bounces(20)
        .build();
    let through = (-depth).exp();
    let expected = (1.0 - r) * (1.0 - r) * through / (1.0 - (r * through).powi(2));
    let bound = Bound { resolution: 0.01, allowance: 10.0 * ORIGIN_OFFSET };
    assert_estimates("glass", &measure(scene, 4, 340), &[expected], bound);
}

/// A hot gas in a room of glowing walls at its temperature is not to be seen, neither homogeneous nor in voxels, nor in
/// glass; walls are aimed at and met.
#[test]
fn isothermal_cavity_with_gas() {
    let camera = look(1.5 * DVec3::Z, DVec3::ZERO, DVec3::Y, Projection::Orthographic { half_size: DVec2::splat(0.5) });
    let room_with = |ball: &dyn Fn(Builder) -> Builder| {
        let walls = room(DVec3::splat(-2.0), DVec3::new(1.7, 2.0, 2.2));
        let base = Builder::new().camera(camera.clone()).film(2, 2, Filter::Box).channels(infrared()).bounces(24);
        ball(base.lamp(walls, planck(300.0), Sides::Front)).build()
    };
    let expected = means(&planck(300.0), &infrared()).repeat(4);
    let curve = || Curve::Linear { nm: vec![3e3, 20e3], value: vec![0.01, 2.0], outside: Outside::Hold };
    let hot = || Some(Field::Constant(300.0));
    let ball = || sphere(DVec3::ZERO, 0.8);
    let cube = (DVec3::new(-0.9, -0.7, -0.8), DVec3::new(0.8, 0.9, 0.7));
    let voxels = || grid([5, 4, 3], |[x, y, z]| f64::from((7 * x + 3 * y + 5 * z) % 4));
    type Add<'a> = &'a dyn Fn(Builder) -> Builder;
    let cases: [(&str, Add); 8] = [
        ("voxels in glass in glass", &|b| {
            let b = b.dielectric(cuboid(-0.9 * DVec3::ONE, 0.9 * DVec3::ONE), 1.5, 0.0).gas(0.0).filled();
            let (low, high) = (DVec3::splat(-0.6), DVec3::new(0.6, 0.5, 0.7));
            b.dielectric(cuboid(low, high), 1.2, 0.0).medium(curve(), hot(), voxels()).filled_from(low, high)
        }),
        ("around a matt ball", &|b| {
            b.diffuse(sphere(DVec3::ZERO, 0.3), 1.0).medium(curve(), hot(), voxels()).null_box(cube.0, cube.1)
        }),
        ("gas", &|b| b.medium(curve(), hot(), Field::Constant(1.0)).null(ball())),
        ("voxels", &|b| b.medium(curve(), hot(), voxels()).null_box(cube.0, cube.1)),
        ("glass", &|b| b.dielectric(ball(), glass_curve(), 0.0).medium(curve(), hot(), Field::Constant(1.0)).filled()),
        ("voxels in glass", &|b| {
            let b = b.dielectric(cuboid(cube.0, cube.1), 1.5, 0.0).medium(curve(), hot(), voxels());
            b.filled_from(cube.0, cube.1)
        }),
        // Gases in glass, whose sources are those in glass; and glass in glass, by the indices of both.
        ("gas in glass", &|b| {
            let b = b.dielectric(ball(), glass_curve(), 0.0).gas(0.0).filled();
            b.medium(curve(), hot(), Field::Constant(1.0)).null(sphere(DVec3::ZERO, 0.5))
        }),
        ("gas in glass in glass", &|b| {
            let b = b.dielectric(sphere(DVec3::ZERO, 0.4), 1.2, 0.0);
            let b = b.medium(curve(), hot(), Field::Constant(1.0)).filled();
            b.dielectric(ball(), glass_curve(), 0.0).gas(0.0).filled()
        }),
    ];
    for (what, add) in size::first(1, cases) {
        let rendered = render(&room_with(add), 32, 128, Settings { seed: 7, tile: [4, 4], ..Settings::default() });
        rendered.assert_clean();
        // Tables of Planck's law and of the gas are within 1e-4 of a channel's peak, their means to 1e-5.
        let bound = Bound { resolution: 0.02, allowance: 3e-4 };
        assert_estimates(what, &rendered.values(), &expected, bound);
    }
}

/// A null boundary around nothing changes nothing: a lamp, a wall, glass and a sky.
#[test]
fn null_boundaries_change_nothing() {
    let scene = |null: bool| {
        let view = Projection::Perspective { tan_half: DVec2::splat(0.4) };
        let b = Builder::new()
            .camera(look(DVec3::new(0.0, 0.5, 3.0), DVec3::ZERO, DVec3::Y, view))
            .film(20, 20, Filter::Box)
            .bounces(6)
            .diffuse(disk(DVec3::new(0.0, -1.0, 0.0), DVec3::Y, 4.0), 0.7)
            .dielectric(sphere(DVec3::ZERO, 0.5), 1.5, 0.0)
            .lamp(sphere(DVec3::new(1.0, 1.0, 0.5), 0.2), 20.0, Sides::Front)
            .sky(0.3);
        let shape: Shape = sphere(DVec3::splat(0.5), 1.7);
        if null { b.gas(0.0).null(sphere(DVec3::new(0.1, 0.0, 0.0), 0.9)).null(shape).build() } else { b.build() }
    };
    let [with, without] = [true, false].map(|null| {
        let rendered = render(&scene(null), 4, 64, Settings { seed: 3, ..Settings::default() });
        rendered.assert_clean();
        rendered.image_means()[0]
    });
    // The same random numbers: only paths that glass turns aside differ, seldom.
    assert!((with.mean / without.mean - 1.0).abs() < 2e-3, "{with:?} {without:?}");
}
