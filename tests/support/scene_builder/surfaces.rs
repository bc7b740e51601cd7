//! Scenes with metals, glass and plastic whose answers are known (docs/METHOD.md, Closed forms). What differs between the
//! reference and a device (depths, samples, bounds) is the caller's.

use glam::{DVec2, DVec3};
use spectile::scene::{Filter, Mesh, Projection, Scene, Shape, Sides};
use spectile::spectral::{Channels, Curve, Outside};

use super::closed_forms::Case;
use super::{Builder, look, narrow, quad, room, sphere};

/// A clear slab at normal incidence before a lamp of radiance 1: T = (1 - R)/(1 + R), all orders: 0.923077
/// for n = 1.5, 0.470588 for n = 4.
pub fn slab(bounces: u32) -> Vec<Case> {
    let case = |(n, published, seed): (f64, f64, u64)| {
        let r = ((n - 1.0) / (n + 1.0)).powi(2);
        let expected = (1.0 - r) / (1.0 + r);
        assert!((expected - published).abs() < 1e-6, "the published digits");
        let scene = Builder::new()
            .camera(look(DVec3::new(0.1, 0.2, 4.0), DVec3::new(0.1, 0.2, 0.0), DVec3::Y, narrow()))
            .dielectric(cuboid(DVec3::new(-5.0, -5.0, 0.0), DVec3::new(5.0, 5.0, 1.0)), n, 0.0)
            .lamp(quad(DVec3::new(-5.0, -5.0, -1.0), 10.0 * DVec3::X, 10.0 * DVec3::Y), 1.0, Sides::Front)
            .bounces(bounces)
            .build();
        Case { scene, expected: vec![expected], seed }
    };
    [(1.5, 0.923077, 101), (4.0, 0.470588, 102)].map(case).into()
}

/// Wavelengths in nm of the lines F, d and C, and the index of N-BK7 there (Sellmeier's formula with Schott's constants).
const LINES: [(f64, f64); 3] = [(486.13, 1.522376), (587.56, 1.516800), (656.27, 1.514322)];

/// A prism of 60 degrees of N-BK7 at the d line's minimum deviation, and at the end of each line's ray a lamp 0.02 degrees
/// in radius, one a scene: its line shows it through two surfaces, the others do not. Deviations by Snell's law; that of
/// the d line is the published 38.64671 degrees.
pub fn prism() -> Vec<Case> {
    let apex = 60f64.to_radians();
    let entrance = 0.5 * (38.64671f64.to_radians() + apex);
    let index = || Curve::Linear {
        nm: LINES.iter().map(|line| line.0).collect(),
        value: LINES.iter().map(|line| line.1).collect(),
        outside: Outside::Hold,
    };
    let channels = Channels::from_bounds(LINES.iter().map(|(nm, _)| [nm - 1e-3, nm + 1e-3]).collect(), None);
    let turned = |angle: f64| DVec3::new(angle.cos(), angle.sin(), 0.0);
    // The left face's normal points 150 degrees from +x; light comes from below it.
    let towards = turned(entrance - 0.5 * apex);
    let left_face = DVec3::new(-0.5, 0.5 * 3f64.sqrt(), 0.0);
    let mut cases = Vec::new();
    for (line, (_, n)) in LINES.into_iter().enumerate() {
        let inner = (entrance.sin() / n).asin();
        let exit = (n * (apex - inner).sin()).asin();
        let deviation = entrance + exit - apex;
        // Half a digit of n beside.
        assert!(line != 1 || (deviation.to_degrees() - 38.64671).abs() < 1e-4, "the published deviation");
        let leaving = turned(entrance - 0.5 * apex - deviation);
        // One surface: the angles outside and inside.
        let passed = |outside: f64, inside: f64| {
            let s = ((outside - inside).sin() / (outside + inside).sin()).powi(2);
            let p = ((outside - inside).tan() / (outside + inside).tan()).powi(2);
            1.0 - 0.5 * (s + p)
        };
        let mut expected = vec![0.0; LINES.len()];
        expected[line] = passed(entrance, inner) * passed(exit, apex - inner);
        let lamp = Shape::Disk { center: 1e4 * leaving, normal: -leaving, radius: 1e4 * 0.02f64.to_radians() };
        let scene = Builder::new()
            .camera(look(left_face - 3.0 * towards, left_face, DVec3::Z, narrow()))
            .channels(channels.clone())
            .dielectric(triangular_prism(), index(), 0.0)
            .lamp(lamp, 1.0, Sides::Front)
            .bounces(2)
            .build();
        cases.push(Case { scene, expected, seed: 110 + line as u64 });
    }
    cases
}

/// A ball under a uniform sky of radiance 1, filling the middle of 3 x 3 pixels. What absorbs nothing shows 1 everywhere.
pub fn under_white_sky(ball: impl FnOnce(Builder, Shape) -> Builder, bounces: u32) -> Scene {
    let camera = look(3.0 * DVec3::Z, DVec3::ZERO, DVec3::Y, Projection::Orthographic { half_size: DVec2::splat(1.1) });
    let base = Builder::new().camera(camera).film(3, 3, Filter::Box).sky(1.0).bounces(bounces);
    ball(base, sphere(DVec3::ZERO, 1.0)).build()
}

/// The same in a room whose walls glow with radiance 1 and reflect nothing: light is aimed at, as well as met.
pub fn in_glowing_room(ball: impl FnOnce(Builder, Shape) -> Builder, bounces: u32) -> Scene {
    let camera = look(3.0 * DVec3::Z, DVec3::ZERO, DVec3::Y, Projection::Orthographic { half_size: DVec2::splat(1.1) });
    let walls = room(DVec3::new(-2.0, -1.5, -2.5), DVec3::new(1.5, 2.0, 4.0));
    let base = Builder::new().camera(camera).film(3, 3, Filter::Box).lamp(walls, 1.0, Sides::Front).bounces(bounces);
    ball(base, sphere(DVec3::ZERO, 1.0)).build()
}

/// A ball of strongly dispersive glass before lamps and a dim sky, in `channels`.
pub fn dispersive_ball(channels: Channels, roughness: f64) -> Scene {
    let camera = look(3.0 * DVec3::Z, DVec3::ZERO, DVec3::Y, Projection::Orthographic { half_size: DVec2::splat(0.9) });
    let glass = Curve::Linear { nm: vec![400.0, 700.0], value: vec![1.7, 1.4], outside: Outside::Hold };
    let ramp = Curve::Linear { nm: vec![400.0, 700.0], value: vec![1.0, 3.0], outside: Outside::Hold };
    Builder::new()
        .camera(camera)
        .film(2, 2, Filter::Box)
        .channels(channels)
        .dielectric(sphere(DVec3::ZERO, 1.0), glass, roughness)
        .lamp(sphere(DVec3::new(0.5, 0.3, -3.0), 0.8), ramp, Sides::Front)
        .lamp(quad(DVec3::new(-3.0, -2.0, 2.0), DVec3::Y, 2.0 * DVec3::Z), 2.0, Sides::Both)
        .sky(0.2)
        .bounces(12)
        .build()
}

/// A brushed plate, roughness 0.5 along x and 0.05 along y before `turn` about z, that shows a small lamp beside its
/// mirror image: off by 20 degrees along x if `along_x`, else along y.
pub fn brushed_plate(turned: bool, along_x: bool) -> Scene {
    let (u, v) = if turned { (DVec3::Y, DVec3::NEG_X) } else { (DVec3::X, DVec3::Y) };
    let plate = quad(-(u + v), 2.0 * u, 2.0 * v);
    let off = 20f64.to_radians();
    let towards = if along_x { DVec3::new(off.sin(), 0.0, off.cos()) } else { DVec3::new(0.0, off.sin(), off.cos()) };
    Builder::new()
        .camera(look(3.0 * DVec3::Z, DVec3::ZERO, DVec3::Y, narrow()))
        .conductor(plate, 0.2, 3.4, [0.5, 0.05])
        .lamp(sphere(10.0 * towards, 0.5), 1.0, Sides::Front)
        .build()
}

/// A box with outward faces.
fn cuboid(min: DVec3, max: DVec3) -> Shape {
    let Shape::Mesh(inward) = room(min, max) else { unreachable!("a room is a mesh") };
    let triangles = inward.triangles.iter().map(|&[a, b, c]| [b, a, c]).collect();
    Shape::Mesh(Mesh { positions: inward.positions, triangles })
}

/// Equilateral with sides of 2 in the xy plane, apex up, its base on y = 0; from z = -1 to 1; outward faces.
fn triangular_prism() -> Shape {
    let corner = |x: f64, y: f64| [DVec3::new(x, y, -1.0), DVec3::new(x, y, 1.0)];
    let positions = [corner(-1.0, 0.0), corner(1.0, 0.0), corner(0.0, 3f64.sqrt())].concat();
    let mut triangles = vec![[0, 4, 2], [1, 3, 5]];
    for [a, b] in [[0, 2], [2, 4], [4, 0]] {
        triangles.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
    }
    Shape::Mesh(Mesh { positions, triangles })
}

/// A metal that absorbs next to nothing: a purely imaginary index.
pub fn white_metal(builder: Builder, shape: Shape, roughness: [f64; 2]) -> Builder {
    builder.conductor(shape, 1e-9, 3.0, roughness)
}

/// An index that falls from 1.6 at 400 nm to 1.5 at 700 nm.
pub fn glass_curve() -> Curve {
    Curve::Linear { nm: vec![400.0, 700.0], value: vec![1.6, 1.5], outside: Outside::Hold }
}
