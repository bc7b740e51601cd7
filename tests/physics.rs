//! The GPU renderer against closed forms (VALIDATION sections 1.1, 1.2, 1.6, 1.7).
//!
//! Bounds as in `statistics`: Student t at ALPHA = 1e-4 per test, Sidak over channels, fixed seeds, plus a stated f32
//! allowance. Resolutions of 0.2 to 0.4 % mean that a wrong factor of 1 to 2 % in any of these would fail.

mod device;
mod scene_builder;
mod statistics;

use std::f64::consts::PI;

use device::{Settings, render};
use glam::{DVec2, DVec3};
use scene_builder::*;
use spectile::scene::{Film, Filter, Projection, Sampler, Scene, Shape, Sides};
use spectile::spectral::{Channels, Curve, Outside};
use statistics::*;

/// 16 x 16 pixels that look along one ray, `epochs` times 64 samples: replicas of one measurement.
fn measure(mut scene: Scene, epochs: u32, seed: u64) -> Vec<Estimate> {
    scene.film.width = 16;
    scene.film.height = 16;
    scene.film.crop = [0, 0, 16, 16];
    let rendered = render(&scene, epochs, 64, Settings { seed, ..Settings::default() });
    rendered.assert_clean();
    rendered.replicas()
}

/// Every pixel of every epoch has the expected value in every channel.
fn assert_exact(what: &str, scene: &Scene, samples: u32, expected: f64, allowance: f64) {
    let rendered = render(scene, 2, samples, Settings { seed: 1, ..Settings::default() });
    rendered.assert_clean();
    for value in rendered.means.iter().flatten() {
        let error = (f64::from(*value) / expected - 1.0).abs();
        assert!(error <= allowance, "{what}: {value} instead of {expected}, {error:e}");
    }
}

fn table(nm: &[f64], value: &[f64]) -> Curve {
    Curve::Linear { nm: nm.to_vec(), value: value.to_vec(), outside: Outside::Hold }
}

/// Radiance after `vertices` surface vertices in a closed cavity (VALIDATION 1.1).
fn cavity(emission: f64, reflectance: f64, vertices: i32) -> f64 {
    emission * (1.0 - reflectance.powi(vertices)) / (1.0 - reflectance)
}

// ---- Furnaces and cavities (1.1)

/// A convex body under a uniform sky L0 shows ρ L0 in every single sample: next-event estimation and the reflected
/// direction find ½ each. Eight roundings a sample (two records of three products and two weights, and the mean).
#[test]
fn furnace_convex() {
    for rho in [0.18, 0.5, 1.0] {
        for shape in [sphere(DVec3::ZERO, 1.0), icosphere(DVec3::ZERO, 1.0, 2)] {
            let scene = Builder::new()
                .camera(look(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, DVec3::Y, Projection::Perspective { tan_half: DVec2::splat(0.1) }))
                .film(16, 16, Filter::Box)
                .diffuse(shape, rho)
                .sky(3.0)
                .build();
            assert_exact("convex furnace", &scene, 64, 3.0 * rho, 16.0 * HALF_ULP);
        }
    }
}

/// A white bowl, closed but for its top, shows L0 once every path got out: nothing is lost in its corners.
#[test]
fn furnace_concave() {
    let (bottom, top) = (DVec3::ZERO, 2.0 * DVec3::Z);
    for roulette in [0, 4] {
        let scene = Builder::new()
            .camera(look(4.0 * DVec3::Z, DVec3::new(0.3, 0.1, 0.0), DVec3::Y, narrow()))
            .diffuse(Shape::Cylinder { from: bottom, to: top, radius: 1.0 }, 1.0)
            .diffuse(disk(bottom, DVec3::Z, 1.0), 1.0)
            .sky(0.7)
            // One path in e^60 needs more.
            .bounces(300)
            .roulette(roulette)
            .build();
        assert_estimates("white bowl", &measure(scene, 2, 2), &[0.7], Bound { resolution: 0.004, allowance: 10.0 * ORIGIN_OFFSET });
    }
}

/// Closed sphere: L_n = Le (1 - ρⁿ)/(1 - ρ) after n vertices. Aiming at the area and Lambert's law have the same
/// density inside a sphere, so every sample is exact but for where rays start.
#[test]
fn closed_sphere_depth_series() {
    for (rho, emission, vertices, published) in [
        (0.5, 0.5, 8, 0.996094),
        (0.5, 0.5, 64, 1.0),
        (0.8, 1.0, 8, 4.161139),
        (0.8, 1.0, 16, 4.859263),
        (0.8, 1.0, 32, 4.996039),
        (0.95, 1.0, 64, 19.24956),
        (0.99, 1.0, 64, 47.44),
    ] {
        let expected = cavity(emission, rho, vertices);
        assert!((expected - published).abs() < 1e-4 * published, "the published digits: {expected}");
        let scene = || {
            Builder::new()
                .camera(look(DVec3::new(0.2, 0.1, -0.3), DVec3::ONE, DVec3::Y, narrow()))
                .glowing(sphere(DVec3::new(0.0, 0.1, 0.0), 1.0), rho, emission, Sides::Both)
                .bounces(vertices as u32 - 1)
        };
        let estimates = measure(scene().build(), 1, 3);
        // Each event that still counts, ρ + ρ² + …, is off by at most the ray offset.
        let allowance = cavity(rho, rho, vertices) * ORIGIN_OFFSET;
        assert_estimates("closed sphere", &estimates, &[expected], Bound { resolution: 1e-4, allowance });
        let estimates = measure(scene().roulette(2).build(), 2, 4);
        assert_estimates("closed sphere, roulette", &estimates, &[expected], Bound { resolution: 0.01, allowance });
    }
}

/// Roulette is unbiased: ρ = 0.95 and 0.99 have L = 20 and 100, where 64 vertices alone give 19.2 and 47.
#[test]
fn roulette_reaches_the_limit() {
    for (rho, bounces) in [(0.95, 200), (0.99, 1000)] {
        let scene = Builder::new()
            .camera(look(DVec3::ZERO, DVec3::ONE, DVec3::Y, narrow()))
            .glowing(sphere(DVec3::ZERO, 1.0), rho, 1.0, Sides::Both)
            .bounces(bounces)
            .roulette(3)
            .build();
        let expected = 1.0 / (1.0 - rho);
        let bound = Bound { resolution: 0.008, allowance: rho.powi(bounces as i32) + expected * ORIGIN_OFFSET };
        assert_estimates("roulette", &measure(scene, 1, 5), &[expected], bound);
    }
}

/// The same law in other closed shapes with ρ_k, Le_k of each channel: a cube of triangles, and a can of cylinder and
/// disks, with and without roulette.
#[test]
fn closed_cavities_of_other_shapes() {
    let rho = [0.2, 0.5, 0.7, 0.9];
    let emission = [1.0, 0.0, 5.0, 0.1];
    let nm = [400.0, 500.0, 500.0, 600.0, 600.0, 700.0, 700.0, 800.0];
    let steps = |v: [f64; 4]| table(&nm, &v.map(|x| [x, x]).concat());
    let expected: Vec<f64> = (0..4).map(|k| cavity(emission[k], rho[k], 30)).collect();
    // Ten events of ρ = 0.9, and the corners, where an offset is not small beside the distance to the next wall.
    let bound = Bound { resolution: 0.004, allowance: 20.0 * ORIGIN_OFFSET };
    for roulette in [0, 2] {
        let base = || {
            Builder::new()
                .camera(look(DVec3::new(0.3, 0.2, 0.4), DVec3::new(1.0, 0.7, 0.9), DVec3::Y, narrow()))
                .channels(Channels::equal(400.0, 800.0, 4))
                .bounces(29)
                .roulette(roulette)
        };
        let cube = room(DVec3::new(-1.0, -0.5, -0.7), DVec3::ONE);
        let scene = base().glowing(cube, steps(rho), steps(emission), Sides::Front).build();
        assert_estimates("cube", &measure(scene, 4, 6), &expected, bound);
        let (low, high) = (DVec3::new(0.0, 0.0, -1.0), DVec3::new(0.5, 0.2, 1.0));
        let wall = Shape::Cylinder { from: low, to: high, radius: 1.0 };
        let scene = base()
            .glowing(wall, steps(rho), steps(emission), Sides::Both)
            .glowing(disk(low, high - low, 1.0), steps(rho), steps(emission), Sides::Front)
            .glowing(disk(high, low - high, 1.0), steps(rho), steps(emission), Sides::Front)
            .build();
        assert_estimates("can", &measure(scene, 4, 7), &expected, bound);
    }
}

/// Kirchhoff: in a closed isothermal cavity of grey walls, ε B emitted and 1 - ε reflected, L = B(λ, T) in every channel
/// for any mix of emissivities; 10 um, 300 K: 9.924033e-3.
#[test]
fn isothermal_cavity_is_black() {
    let planck = |scale| Curve::Blackbody { kelvin: 300.0, scale };
    let channels = Channels::from_bounds(vec![[3e3, 5e3], [8e3, 12e3], [9_999.0, 10_001.0], [14e3, 20e3]], None);
    let expected: Vec<f64> = channels.bounds.iter().map(|b| planck(1.0).mean(b[0], b[1])).collect();
    assert!((expected[2] - 9.924033e-3).abs() < 1e-8);
    let scene = Builder::new()
        .camera(look(0.5 * DVec3::ONE, DVec3::new(0.9, 0.8, 0.0), DVec3::Y, narrow()))
        .channels(channels)
        .bounces(100)
        .glowing(room(DVec3::ZERO, DVec3::ONE), 0.8, planck(0.2), Sides::Front)
        .glowing(sphere(DVec3::new(0.7, 0.7, 0.7), 0.2), 0.4, planck(0.6), Sides::Front)
        .glowing(disk(DVec3::new(0.3, 0.5, 0.2), DVec3::Z, 0.2), 0.1, planck(0.9), Sides::Both)
        .build();
    // Five events of ρ = 0.8, twice that for corners; 1e-5 for the tables.
    let bound = Bound { resolution: 0.005, allowance: 10.0 * ORIGIN_OFFSET + 1e-5 };
    assert_estimates("isothermal", &measure(scene, 4, 8), &expected, bound);
}

// ---- Parallel grey plates (1.2)

/// Disks of radius 1,000 one metre apart stand for infinite plates: 1e-6 of the hemisphere is missing.
#[test]
fn parallel_grey_plates() {
    let channels = Channels::from_bounds(vec![[3e3, 5e3], [9_999.0, 10_001.0], [8e3, 14e3]], None);
    for (e, kelvin, published, seed) in [
        ([0.9, 0.8], [400.0, 300.0], [0.03163354, 0.01426593], 10),
        ([0.5, 0.5], [400.0, 300.0], [0.02568353, 0.01780378], 11),
        ([0.1, 0.9], [900.0, 300.0], [0.04199965, 0.01313159], 12),
    ] {
        let planck = |i: usize| Curve::Blackbody { kelvin: kelvin[i], scale: e[i] };
        // The plate looked at, and the other one.
        for (plate, published) in published.into_iter().enumerate() {
            let (this, other) = (plate, 1 - plate);
            let expected: Vec<f64> = (channels.bounds.iter())
                .map(|[from, to]| {
                    let (own, opposite) = (planck(this).mean(*from, *to), planck(other).mean(*from, *to));
                    (own + (1.0 - e[this]) * opposite) / (1.0 - (1.0 - e[0]) * (1.0 - e[1]))
                })
                .collect();
            assert!((expected[1] - published).abs() < 1e-8, "the published digits at 10 um");
            let scene = Builder::new()
                .camera(look(DVec3::new(0.0, 0.0, 0.5), DVec3::new(0.1, 0.0, plate as f64), DVec3::Y, narrow()))
                .channels(channels.clone())
                .bounces(24)
                .glowing(disk(DVec3::ZERO, DVec3::Z, 1e3), 1.0 - e[0], planck(0), Sides::Front)
                .glowing(disk(DVec3::Z, DVec3::NEG_Z, 1e3), 1.0 - e[1], planck(1), Sides::Front)
                .build();
            // Two ways of missing 1e-6, r₁¹² r₂¹² = 6e-8 beyond 24 bounces, and the tables.
            let bound = Bound { resolution: 0.005, allowance: 2e-5 };
            assert_estimates("plates", &measure(scene, 2, seed), &expected, bound);
        }
    }
}

/// Concentric grey spheres, the inner one's view factor to the outer being 1 and the outer's to it (r/R)²: the two
/// equations of radiosity, exact for any ratio.
#[test]
fn concentric_grey_spheres() {
    let (inner, outer) = (0.6f64, 1.0f64);
    let (e, emitted) = ([0.4, 0.7], [2.0, 0.5]);
    let view = (inner / outer).powi(2);
    // J1 = E1 + r1 J2;  J2 = E2 + r2 (view J1 + (1 - view) J2).
    let [r1, r2] = e.map(|e| 1.0 - e);
    let j2 = (emitted[1] + r2 * view * emitted[0]) / (1.0 - r2 * view * r1 - r2 * (1.0 - view));
    let j1 = emitted[0] + r1 * j2;
    let from = DVec3::new(0.0, 0.0, 0.8);
    for (towards, expected) in [(DVec3::ZERO, j1), (DVec3::new(0.1, 0.3, 1.0), j2)] {
        let scene = Builder::new()
            .camera(look(from, towards, DVec3::Y, narrow()))
            .bounces(40)
            .glowing(sphere(DVec3::ZERO, inner), r1, emitted[0], Sides::Front)
            .glowing(sphere(DVec3::ZERO, outer), r2, emitted[1], Sides::Both)
            .build();
        let bound = Bound { resolution: 0.004, allowance: 5.0 * ORIGIN_OFFSET };
        assert_estimates("spheres", &measure(scene, 4, 13), &[expected], bound);
    }
}

// ---- Spectra and channels (1.6, Eq. 4)

/// Mean radiance of a black body over overlapping bands, width x mean = the published band radiances.
#[test]
fn planck_bands() {
    for (kelvin, bands) in [
        (300.0, &[(3e3, 5e3, 1.865956), (8e3, 12e3, 38.50042), (8e3, 14e3, 54.93346), (380.0, 20e3, 107.8647)][..]),
        (900.0, &[(3e3, 5e3, 4250.709), (8e3, 12e3, 1297.147)][..]),
        (5778.0, &[(380.0, 20e3, 1.810209e7)][..]),
    ] {
        let mut scene = Builder::new()
            .channels(Channels::from_bounds(bands.iter().map(|b| [b.0, b.1]).collect(), None))
            .lamp(sphere(DVec3::ZERO, 0.5), Curve::Blackbody { kelvin, scale: 1.0 }, Sides::Front)
            .bounces(0)
            .build();
        // Stratified: 64 independent wavelengths alone would leave 1 % of the sun's curve over 20 um.
        scene.integrator.sampler = Sampler::Sobol;
        let expected: Vec<f64> = bands.iter().map(|b| b.2 / (b.1 - b.0)).collect();
        // The tables' bound is 1e-5; seven published digits.
        let bound = Bound { resolution: 0.005, allowance: 1.1e-5 };
        assert_estimates("Planck bands", &measure(scene, 8, 20), &expected, bound);
    }
}

/// 550 nm at 300 K is 3.19e-32: far below the visible, and still normal in f32. At 200 K it underflows, which is 0.
#[test]
fn faint_radiance_survives() {
    let lamp = |kelvin| {
        let scene = Builder::new()
            .channels(Channels::from_bounds(vec![[549.999, 550.001]], None))
            .lamp(sphere(DVec3::ZERO, 0.5), Curve::Blackbody { kelvin, scale: 1.0 }, Sides::Front)
            .bounces(0)
            .build();
        measure(scene, 2, 22)
    };
    // d ln B / dλ is 0.17 per nm there: 1.7e-4 over half the channel.
    assert_estimates("faint", &lamp(300.0), &[3.193330e-32], Bound { resolution: 1e-4, allowance: 1e-5 });
    assert_eq!(lamp(150.0)[0].mean, 0.0);
}

/// One wavelength a path for reflectance and emission alike: where both are ramps from 0 to 1 the reflected mean is
/// ∫x² = 1/3, not the product of means 1/4.
#[test]
fn products_of_spectra_are_averaged_by_wavelength() {
    let ramp = || table(&[500.0, 600.0], &[0.0, 1.0]);
    let scene = Builder::new()
        .channels(Channels::from_bounds(vec![[500.0, 600.0], [520.0, 530.0], [600.0, 700.0]], None))
        .diffuse(sphere(DVec3::ZERO, 0.5), ramp())
        .sky(ramp())
        .build();
    let cubes = |a: f64, b: f64| (b.powi(3) - a.powi(3)) / (3.0 * (b - a));
    let bound = Bound { resolution: 0.005, allowance: 1e-5 };
    assert_estimates("ramps", &measure(scene, 4, 21), &[cubes(0.0, 1.0), cubes(0.2, 0.3), 1.0], bound);
}

// ---- Irradiance and form factors (1.7): a white Lambert surface shows E/π

/// A small white patch at the origin, seen obliquely from above.
fn patch() -> Builder {
    Builder::new()
        .camera(look(DVec3::new(0.0, 0.05, 0.05), DVec3::ZERO, DVec3::X, narrow()))
        .diffuse(disk(DVec3::ZERO, DVec3::Z, 0.01), 1.0)
}

/// Relative error of an irradiance from a light at distance h: everything moves by the offset, relative to the scene.
fn irradiance_bound(h: f64) -> Bound {
    Bound { resolution: 0.005, allowance: 2.0 * ORIGIN_OFFSET * h.max(1.0) }
}

/// Points on the axis of a disk, E = π L R²/(R² + h²); half of it behind a screen; nothing from its dark side.
#[test]
#[expect(clippy::approx_constant, reason = "digits as published, compared with π/2")]
fn irradiance_of_a_disk() {
    for (h, published, seed) in [(1.0, 1.570796, 30), (2.0, 0.628319, 31), (10.0, 0.0311049, 32)] {
        let expected = PI / (1.0 + h * h);
        assert!((expected - published).abs() < 1e-6 * published.max(1.0), "the published digits");
        let lit = || patch().lamp(disk(h * DVec3::Z, DVec3::NEG_Z, 1.0), 1.0, Sides::Front);
        assert_estimates("disk", &measure(lit().build(), 2, seed), &[expected / PI], irradiance_bound(h));
        let screen = quad(DVec3::new(0.0, -9.0, 0.5 * h), 9.0 * DVec3::X, 18.0 * DVec3::Y);
        let scene = lit().black(screen).build();
        // The screen sets the scale of the scene: 9.
        let bound = Bound { resolution: 0.01, allowance: 2.0 * ORIGIN_OFFSET * 9.0 };
        assert_estimates("half a disk", &measure(scene, 2, seed), &[0.5 * expected / PI], bound);
        let scene = lit().lamp(disk(5.0 * DVec3::NEG_Z, DVec3::NEG_Z, 1.0), 1.0, Sides::Front).build();
        let bound = Bound { resolution: 0.01, allowance: 2.0 * ORIGIN_OFFSET * 7.5 };
        assert_estimates("dark side", &measure(scene, 2, seed), &[expected / PI], bound);
    }
}

/// A sphere of radius R whose centre is d away, straight above: E = π L (R/d)².
#[test]
fn irradiance_of_a_sphere() {
    for (distance, seed) in [(1.1, 39), (1.5, 40), (4.0, 41), (100.0, 42)] {
        let scene = patch().lamp(sphere(distance * DVec3::Z, 1.0), 2.0, Sides::Front).build();
        let expected = 2.0 / (distance * distance);
        assert_estimates("sphere", &measure(scene, 2, seed), &[expected], irradiance_bound(distance));
    }
}

/// A patch facing a centred square of side 2a at h = 1: F = (4/π) s atan s, s = a/√(1 + a²).
#[test]
fn irradiance_of_a_square() {
    for (side, published, seed) in [(2.0f64, 0.554126, 50), (1.0, 0.239456, 51)] {
        let x = 0.5 * side;
        let slope = x / (1.0 + x * x).sqrt();
        let expected = 4.0 / PI * slope * slope.atan();
        assert!((expected - published).abs() < 1e-6, "the published digits");
        let lamp = quad(DVec3::new(-x, x, 1.0), side * DVec3::X, side * DVec3::NEG_Y);
        let scene = patch().lamp(lamp, 1.0, Sides::Front).build();
        assert_estimates("square", &measure(scene, 2, seed), &[expected], irradiance_bound(1.0));
    }
}

/// An orthographic camera averages over a unit square (or a disk inside its 2 x 2 view): F₁₂ directly.
#[test]
fn form_factors_between_areas() {
    let above = |centre: DVec3, half: f64| {
        look(centre + 0.25 * DVec3::Z, centre, DVec3::Y, Projection::Orthographic { half_size: DVec2::splat(half) })
    };
    let floor = || quad(DVec3::ZERO, DVec3::X, DVec3::Y);
    let middle = DVec3::new(0.5, 0.5, 0.0);
    let averaged = |scene: Scene, seed| {
        let scene = Scene { film: Film { width: 4, height: 4, filter: Filter::Box, crop: [0, 0, 4, 4] }, ..scene };
        let rendered = render(&scene, 64, 64, Settings { seed, tile: [4, 4], ..Settings::default() });
        rendered.assert_clean();
        rendered.image_means()
    };
    let bound = Bound { resolution: 0.005, allowance: 4.0 * ORIGIN_OFFSET };

    for (distance, expected, seed) in [(1.0, 0.199825, 60), (0.5, 0.415253, 61)] {
        let scene = Builder::new()
            .camera(above(middle, 0.5))
            .diffuse(floor(), 1.0)
            .lamp(quad(distance * DVec3::Z, DVec3::Y, DVec3::X), 1.0, Sides::Front)
            .build();
        assert_estimates("opposed squares", &averaged(scene, seed), &[expected], bound);
    }
    let wall = quad(DVec3::ZERO, DVec3::Y, DVec3::Z);
    let scene = Builder::new().camera(above(middle, 0.5)).diffuse(floor(), 1.0).lamp(wall, 1.0, Sides::Front).build();
    assert_estimates("perpendicular squares", &averaged(scene, 62), &[0.200044], bound);

    for (radius, expected, seed) in [(1.0, 0.381966, 63), (2.0, 0.763932, 64)] {
        let scene = Builder::new()
            .camera(above(DVec3::ZERO, 1.0))
            .diffuse(disk(DVec3::ZERO, DVec3::Z, 1.0), 1.0)
            .lamp(disk(DVec3::Z, DVec3::NEG_Z, radius), 1.0, Sides::Front)
            .build();
        // The disk fills π/4 of the view; beyond it nothing is seen.
        assert_estimates("coaxial disks", &averaged(scene, seed), &[expected * PI / 4.0], bound);
    }
}

/// Lights of disjoint spectra and very different power: each channel has its own light's closed form.
#[test]
fn lights_of_disjoint_spectra() {
    let low = table(&[400.0, 500.0, 500.0, 600.0], &[1e6, 1e6, 0.0, 0.0]);
    let high = table(&[400.0, 500.0, 500.0, 600.0], &[0.0, 0.0, 1e-3, 1e-3]);
    let scene = patch()
        .channels(Channels::equal(400.0, 600.0, 2))
        .lamp(disk(2.0 * DVec3::Z, DVec3::NEG_Z, 0.5), low, Sides::Front)
        .lamp(disk(DVec3::Z, DVec3::Z, 0.1), high, Sides::Both)
        .build();
    // The near disk, r = 0.1 at 1 m, hides the far one, r = 0.5 at 2 m, within r = 0.2 of its plane.
    let seen = |r: f64, h: f64| r * r / (r * r + h * h);
    let expected = [1e6 * (seen(0.5, 2.0) - seen(0.2, 2.0)), 1e-3 * seen(0.1, 1.0)];
    assert_estimates("two lights", &measure(scene, 8, 70), &expected, irradiance_bound(2.0));
}

// ---- Sides

/// What each side of a surface shows, for a disk and for a pair of triangles: emission and reflection.
#[test]
fn sides() {
    let plates = [disk(DVec3::ZERO, DVec3::Z, 1.0), quad(DVec3::new(-1.0, -1.0, 0.0), 2.0 * DVec3::X, 2.0 * DVec3::Y)];
    for (from, front) in [(DVec3::Z, true), (DVec3::NEG_Z, false)] {
        for plate in &plates {
            // Off the quad's diagonal.
            let base = || Builder::new().camera(look(from, DVec3::new(0.1, 0.2, 0.0), DVec3::Y, narrow()));
            let shown = |scene: Scene| {
                let rendered = render(&scene, 1, 64, Settings::default());
                rendered.assert_clean();
                rendered.means[0][0]
            };
            let only_front = |x: f32| if front { x } else { 0.0 };
            let close = |a: f32, b: f32| (a - b).abs() <= 1e-6 * b;
            assert_eq!(shown(base().lamp(plate.clone(), 2.0, Sides::Front).build()), only_front(2.0));
            assert_eq!(shown(base().lamp(plate.clone(), 2.0, Sides::Both).build()), 2.0);
            assert!(close(shown(base().diffuse(plate.clone(), 0.5).sky(3.0).build()), 1.5));
            assert!(close(shown(base().one_sided(plate.clone(), 0.5).sky(3.0).build()), only_front(1.5)));
            assert_eq!(shown(base().black(plate.clone()).sky(3.0).build()), 0.0);
            // No scattering at depth 0: a reflecting surface is black, the sky is seen directly.
            assert_eq!(shown(base().diffuse(plate.clone(), 0.5).sky(3.0).bounces(0).build()), 0.0);
            assert_eq!(shown(base().sky(3.0).bounces(0).build()), 3.0);
        }
    }
}
