//! Furnaces, cavities, grey plates (docs/METHOD.md, Closed forms).

use glam::{DVec2, DVec3};
use spectile::scene::{Filter, Projection, Shape, Sides};
use spectile::spectral::Channels;

use super::{assert_exact, measure};
use crate::device::{Settings, render};
use crate::scene_builder::closed_forms::{self, Case};
use crate::scene_builder::*;
use crate::statistics::*;

/// Radiance after `vertices` surface vertices in a closed cavity.
fn cavity(emission: f64, reflectance: f64, vertices: i32) -> f64 {
    emission * (1.0 - reflectance.powi(vertices)) / (1.0 - reflectance)
}

/// A convex body under a uniform sky L0 shows ρ L0 in every single sample: next-event estimation and the reflected
/// direction find ½ each. Eight roundings a sample (two records of three products and two weights, and the mean).
#[test]
fn furnace_convex() {
    for rho in [0.18, 0.5, 1.0] {
        for shape in [sphere(DVec3::ZERO, 1.0), icosphere(DVec3::ZERO, 1.0, 2)] {
            let scene = Builder::new()
                .camera(look(
                    DVec3::new(0.0, 0.0, 5.0),
                    DVec3::ZERO,
                    DVec3::Y,
                    Projection::Perspective { tan_half: DVec2::splat(0.1) },
                ))
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
        assert_estimates(
            "white bowl",
            &measure(scene, 2, 2),
            &[0.7],
            Bound { resolution: 0.004, allowance: 10.0 * ORIGIN_OFFSET },
        );
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
        let estimates = measure(scene().roulette(2).build(), 1, 4);
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

/// Roulette survives with the albedo, however small: in a closed cavity of ρ a path that survives S times traces
/// 2 S + 2 rays, and S is geometric with mean ρ / (1 - ρ) and variance ρ / (1 - ρ)².
#[test]
fn roulette_survives_with_the_albedo() {
    for rho in [0.01, 0.3] {
        let scene = Builder::new()
            .camera(look(DVec3::ZERO, DVec3::ONE, DVec3::Y, narrow()))
            .film(16, 16, Filter::Box)
            .glowing(sphere(DVec3::ZERO, 1.0), rho, 1.0, Sides::Both)
            .bounces(60)
            .roulette(1)
            .build();
        let rendered = render(&scene, 1, 64, Settings::default());
        let paths = 16.0 * 16.0 * 64.0;
        let expected = paths * 2.0 / (1.0 - rho);
        let deviation = 2.0 * (paths * rho).sqrt() / (1.0 - rho);
        let rays = rendered.rays as f64;
        assert!((rays - expected).abs() < 4.0 * deviation, "{rho}: {rays} rays instead of {expected}");
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

#[test]
fn isothermal_cavity_is_black() {
    let (scene, expected) = closed_forms::isothermal_cavity(100);
    // Five events of ρ = 0.8, twice that for corners; 1e-5 for the tables.
    let bound = Bound { resolution: 0.005, allowance: 10.0 * ORIGIN_OFFSET + 1e-5 };
    assert_estimates("isothermal", &measure(scene, 2, 8), &expected, bound);
}

/// Disks of radius 1,000 one metre apart stand for infinite plates: 1e-6 of the hemisphere is missing.
#[test]
fn parallel_grey_plates() {
    for Case { scene, expected, seed } in closed_forms::grey_plates(1e3, 24) {
        // Two ways of missing 1e-6, r₁¹² r₂¹² = 6e-8 beyond 24 bounces, and the tables.
        let bound = Bound { resolution: 0.005, allowance: 2e-5 };
        assert_estimates("plates", &measure(scene, 1, seed), &expected, bound);
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
        assert_estimates("spheres", &measure(scene, 1, 13), &[expected], bound);
    }
}
