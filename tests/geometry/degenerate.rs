//! Degenerate, coincident, too many, none.

use glam::{DVec2, DVec3};
use spectile::scene::{Filter, Mesh, Projection, Scene, Shape, Sides};

use super::{Random, mesh_of};
use crate::device::{self, Settings};
use crate::scene_builder::*;

/// A white floor under a sky with `extra` above it, in the plane z = 0.5, of black triangles; seen from above.
fn with_triangles(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Scene {
    let projection = Projection::Orthographic { half_size: DVec2::splat(1.0) };
    let mut b = Builder::new()
        .camera(look(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, DVec3::Y, projection))
        .film(8, 8, Filter::Box)
        .lamp(quad(DVec3::new(-2.0, -2.0, 0.0), 4.0 * DVec3::X, 4.0 * DVec3::Y), 1.0, Sides::Both)
        .bounces(1);
    if !triangles.is_empty() {
        b = b.black(Shape::Mesh(Mesh { positions, triangles }));
    }
    b.build()
}

fn picture(scene: &Scene) -> Vec<f32> {
    let mut e = device::render(scene, 1, 16, Settings { tile: [8, 8], ..Settings::default() });
    e.assert_clean();
    e.means.remove(0)
}

/// Triangles without area are never met; duplicates and coincident ones are like one.
#[test]
fn degenerate_and_coincident_triangles() {
    let p = vec![
        DVec3::new(-0.5, -0.5, 0.5),
        DVec3::new(0.5, -0.5, 0.5),
        DVec3::new(0.0, 0.5, 0.5),
        DVec3::new(0.25, 0.0, 0.5),
    ];
    let none = picture(&with_triangles(p.clone(), vec![]));
    assert!(none.iter().all(|v| *v == 1.0));
    let one = picture(&with_triangles(p.clone(), vec![[0, 1, 2]]));
    assert!(one.contains(&0.0) && one.contains(&1.0));
    // The same vertex twice, all three, and three on a line: 1, 3 and 2 lie on x = 0.5 - y/2 - 1/4.
    let on_a_line = vec![[0, 0, 1], [2, 2, 2], [1, 3, 2], [1, 2, 1]];
    assert_eq!(picture(&with_triangles(p.clone(), on_a_line.clone())), none);
    let mut mixed = on_a_line;
    mixed.extend([[0, 1, 2], [0, 1, 2], [2, 1, 0], [1, 2, 0]]);
    assert_eq!(picture(&with_triangles(p.clone(), mixed)), one);
    assert_eq!(picture(&with_triangles(p, vec![[0, 1, 2]; 500])), one);
}

/// A hundred thousand triangles in one place: more than a ray may test. The overflow counter says so, and nothing hangs.
#[test]
fn too_many_coincident_triangles_are_an_overflow() {
    let p = vec![DVec3::new(-0.5, -0.5, 0.5), DVec3::new(0.5, -0.5, 0.5), DVec3::new(0.0, 0.5, 0.5)];
    let scene = with_triangles(p, vec![[0, 1, 2]; 100_000]);
    let e = device::render(&scene, 1, 16, Settings { tile: [8, 8], ..Settings::default() });
    assert!(e.counters.overflow > 0, "an overflow is reported");
    assert_eq!(e.counters.non_finite, 0);
}

/// No object at all: sky or nothing.
#[test]
fn empty_scenes() {
    let empty = || Builder::new().film(4, 4, Filter::Box).bounces(3);
    assert!(picture(&empty().build()).iter().all(|v| *v == 0.0));
    assert!(picture(&empty().sky(2.0).build()).iter().all(|v| *v == 2.0));
    // One object, of triangles without area only, which emits.
    let nothing = Shape::Mesh(Mesh { positions: vec![DVec3::ZERO; 3], triangles: vec![[0, 1, 2]] });
    assert!(picture(&empty().lamp(nothing, 1.0, Sides::Both).sky(2.0).build()).iter().all(|v| *v == 2.0));
}

/// Slivers down to nothing, white, under a uniform sky: whatever they hide, a pixel shows between nothing and the sky,
/// and no sample is lost as not finite.
#[test]
fn slivers_spoil_no_sample() {
    let mut random = Random(7);
    let mut mesh = Mesh::default();
    for i in 0..3000u32 {
        let a = random.in_cube();
        let along = 0.5 * random.in_cube();
        let width = 10f64.powf(-1.0 - 9.0 * random.next());
        mesh.positions.extend([a, a + along, a + random.next() * along + width * random.in_cube()]);
        mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    let scene = |reflectance: f64| {
        Builder::new()
            .camera(look(
                DVec3::new(0.0, 0.0, 3.0),
                DVec3::ZERO,
                DVec3::Y,
                Projection::Perspective { tan_half: DVec2::splat(0.3) },
            ))
            .film(64, 64, Filter::Box)
            .glowing(Shape::Mesh(mesh.clone()), reflectance, 1e-3, Sides::Both)
            .sky(1.0)
            .bounces(4)
            .build()
    };
    let e = device::render(&scene(1.0), 1, 64, Settings { tile: [32, 32], ..Settings::default() });
    e.assert_clean();
    // Emission adds up to five times 1e-3; single estimates of next-event estimation scatter above the mean.
    let mean = e.means[0].iter().map(|v| f64::from(*v)).sum::<f64>() / e.means[0].len() as f64;
    assert!((0.5..1.01).contains(&mean), "{mean}");
}

/// A camera in the very plane of a floor, or of a triangle's edge, that looks away from it sees what is there.
#[test]
fn camera_on_a_surface() {
    let floor = || quad(DVec3::new(-1.0, -1.0, 0.0), 2.0 * DVec3::X, 2.0 * DVec3::Y);
    for position in [DVec3::new(0.25, -0.125, 0.0), DVec3::ZERO, DVec3::new(-1.0, -1.0, 0.0)] {
        let scene = Builder::new()
            .camera(look(
                position,
                position + DVec3::Z,
                DVec3::Y,
                Projection::Perspective { tan_half: DVec2::splat(0.5) },
            ))
            .film(16, 16, Filter::Box)
            .black(floor())
            .sky(1.0)
            .bounces(0)
            .build();
        assert!(picture(&scene).iter().all(|v| *v == 1.0), "{position}");
    }
}

/// A million triangles: a bumpy sphere, whole from outside.
#[test]
fn a_million_triangles() {
    let mut mesh = mesh_of(icosphere(DVec3::ZERO, 1.0, 8));
    assert!(mesh.triangles.len() > 1_000_000);
    for p in &mut mesh.positions {
        *p *= 1.0 + 0.02 * (20.0 * p.x).sin() * (20.0 * p.y).cos();
    }
    let scene = Builder::new()
        .camera(look(
            DVec3::new(0.0, 0.0, 4.0),
            DVec3::ZERO,
            DVec3::Y,
            Projection::Perspective { tan_half: DVec2::splat(0.15) },
        ))
        .film(64, 64, Filter::Box)
        .lamp(Shape::Mesh(mesh), 1.0, Sides::Front)
        .bounces(0)
        .build();
    assert!(picture(&scene).iter().all(|v| *v == 1.0));
}
