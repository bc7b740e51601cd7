//! Scenes with known answers (docs/METHOD.md, Closed forms) that the reference and the device are both held against. What
//! differs between the two (depths, sizes, samples, bounds) is the caller's.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use spectile::scene::{Camera, Projection, Scene, Sides};
use spectile::spectral::{Channels, Curve, Outside};

use super::{Builder, disk, look, narrow, quad, room, sphere};

/// A scene, what a pixel of it shows in each channel, and a seed.
pub struct Case {
    pub scene: Scene,
    pub expected: Vec<f64>,
    pub seed: u64,
}

/// Kirchhoff: in a closed isothermal cavity of grey walls, ε B emitted and 1 - ε reflected, L = B(λ, T) for any mix of
/// emissivities, in every channel; 10 um, 300 K: 9.924033e-3.
pub fn isothermal_cavity(bounces: u32) -> (Scene, Vec<f64>) {
    let planck = |scale| Curve::Blackbody { kelvin: 300.0, scale };
    let channels = Channels::from_bounds(vec![[3e3, 5e3], [8e3, 12e3], [9_999.0, 10_001.0], [14e3, 20e3]], None);
    let expected: Vec<f64> = channels.bounds.iter().map(|b| planck(1.0).mean(b[0], b[1])).collect();
    assert!((expected[2] - 9.924033e-3).abs() < 1e-8);
    let scene = Builder::new()
        .camera(look(0.5 * DVec3::ONE, DVec3::new(0.9, 0.8, 0.0), DVec3::Y, narrow()))
        .channels(channels)
        .bounces(bounces)
        .glowing(room(DVec3::ZERO, DVec3::ONE), 0.8, planck(0.2), Sides::Front)
        .glowing(sphere(DVec3::new(0.7, 0.7, 0.7), 0.2), 0.4, planck(0.6), Sides::Front)
        .glowing(disk(DVec3::new(0.3, 0.5, 0.2), DVec3::Z, 0.2), 0.1, planck(0.9), Sides::Both)
        .build();
    (scene, expected)
}

/// Two disks one metre apart that stand for infinite grey plates, each looked at: about 1/radius² of the hemisphere is
/// missing.
pub fn grey_plates(radius: f64, bounces: u32) -> Vec<Case> {
    let channels = Channels::from_bounds(vec![[3e3, 5e3], [9_999.0, 10_001.0], [8e3, 14e3]], None);
    let mut cases = Vec::new();
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
                .bounces(bounces)
                .glowing(disk(DVec3::ZERO, DVec3::Z, radius), 1.0 - e[0], planck(0), Sides::Front)
                .glowing(disk(DVec3::Z, DVec3::NEG_Z, radius), 1.0 - e[1], planck(1), Sides::Front)
                .build();
            cases.push(Case { scene, expected, seed });
        }
    }
    cases
}

/// A small white patch at the origin, seen obliquely from above: it shows E/π.
pub fn patch() -> Builder {
    Builder::new()
        .camera(look(DVec3::new(0.0, 0.05, 0.05), DVec3::ZERO, DVec3::X, narrow()))
        .diffuse(disk(DVec3::ZERO, DVec3::Z, 0.01), 1.0)
}

/// A patch facing a centred square of side 2a at h = 1: F = (4/π) s atan s, s = a/√(1 + a²).
pub fn patch_under_squares() -> Vec<Case> {
    let case = |(side, published, seed): (f64, f64, u64)| {
        let x = 0.5 * side;
        let slope = x / (1.0 + x * x).sqrt();
        let expected = 4.0 / PI * slope * slope.atan();
        assert!((expected - published).abs() < 1e-6, "the published digits");
        let lamp = quad(DVec3::new(-x, x, 1.0), side * DVec3::X, side * DVec3::NEG_Y);
        Case { scene: patch().lamp(lamp, 1.0, Sides::Front).build(), expected: vec![expected], seed }
    };
    [(2.0, 0.554126, 50), (1.0, 0.239456, 51)].map(case).into()
}

/// An orthographic camera that averages over a unit square, or over a disk inside its 2 x 2 view: F₁₂ directly, of
/// opposed and of perpendicular squares, and of coaxial disks.
pub fn form_factors() -> Vec<Case> {
    let above = |centre: DVec3, half: f64| -> Camera {
        look(centre + 0.25 * DVec3::Z, centre, DVec3::Y, Projection::Orthographic { half_size: DVec2::splat(half) })
    };
    let over_floor = || {
        Builder::new().camera(above(DVec3::new(0.5, 0.5, 0.0), 0.5)).diffuse(quad(DVec3::ZERO, DVec3::X, DVec3::Y), 1.0)
    };
    let opposed = [(1.0, 0.199825, 60), (0.5, 0.415253, 61)].map(|(distance, expected, seed)| {
        let scene = over_floor().lamp(quad(distance * DVec3::Z, DVec3::Y, DVec3::X), 1.0, Sides::Front).build();
        Case { scene, expected: vec![expected], seed }
    });
    let wall = quad(DVec3::ZERO, DVec3::Y, DVec3::Z);
    let perpendicular =
        Case { scene: over_floor().lamp(wall, 1.0, Sides::Front).build(), expected: vec![0.200044], seed: 62 };
    let coaxial = [(1.0, 0.381966, 63), (2.0, 0.763932, 64)].map(|(radius, expected, seed)| {
        let scene = Builder::new()
            .camera(above(DVec3::ZERO, 1.0))
            .diffuse(disk(DVec3::ZERO, DVec3::Z, 1.0), 1.0)
            .lamp(disk(DVec3::Z, DVec3::NEG_Z, radius), 1.0, Sides::Front)
            .build();
        // The disk fills π/4 of the view; beyond it nothing is seen.
        Case { scene, expected: vec![expected * PI / 4.0], seed }
    });
    opposed.into_iter().chain([perpendicular]).chain(coaxial).collect()
}

/// Lights of disjoint spectra and very different power: each channel has its own light's closed form.
pub fn lights_of_disjoint_spectra() -> Case {
    let nm = vec![400.0, 500.0, 500.0, 600.0];
    let table = |value: [f64; 4]| Curve::Linear { nm: nm.clone(), value: value.to_vec(), outside: Outside::Hold };
    let scene = patch()
        .channels(Channels::equal(400.0, 600.0, 2))
        .lamp(disk(2.0 * DVec3::Z, DVec3::NEG_Z, 0.5), table([1e6, 1e6, 0.0, 0.0]), Sides::Front)
        .lamp(disk(DVec3::Z, DVec3::Z, 0.1), table([0.0, 0.0, 1e-3, 1e-3]), Sides::Both)
        .build();
    // The near disk, r = 0.1 at 1 m, hides the far one, r = 0.5 at 2 m, within r = 0.2 of its plane.
    let seen = |r: f64, h: f64| r * r / (r * r + h * h);
    let expected = vec![1e6 * (seen(0.5, 2.0) - seen(0.2, 2.0)), 1e-3 * seen(0.1, 1.0)];
    Case { scene, expected, seed: 70 }
}
