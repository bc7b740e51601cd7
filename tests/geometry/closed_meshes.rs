//! Zero leaks in millions of rays.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3, Vec3};
use spectile::device::prepared::Prepared;
use spectile::scene::{Filter, Mesh, Projection, Shape, Sides};

use super::{Random, black_mesh, f32s, mesh_of};
use crate::device::{self, Epochs, Settings};
use crate::scene_builder::*;
use crate::tracer::{Ray, trace};

/// Meridians close together, so that triangles are slivers and hundreds of them meet in each pole.
fn uv_sphere(meridians: u32, parallels: u32) -> Mesh {
    let mut mesh = Mesh { positions: vec![DVec3::Z, DVec3::NEG_Z], triangles: Vec::new() };
    for j in 1..parallels {
        let theta = PI * f64::from(j) / f64::from(parallels);
        for i in 0..meridians {
            let phi = TAU * f64::from(i) / f64::from(meridians);
            mesh.positions.push(DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()));
        }
    }
    let at = |j: u32, i: u32| 2 + (j - 1) * meridians + i % meridians;
    for i in 0..meridians {
        mesh.triangles.push([0, at(1, i), at(1, i + 1)]);
        mesh.triangles.push([1, at(parallels - 1, i + 1), at(parallels - 1, i)]);
        for j in 1..parallels - 1 {
            mesh.triangles.push([at(j, i), at(j + 1, i), at(j + 1, i + 1)]);
            mesh.triangles.push([at(j, i), at(j + 1, i + 1), at(j, i + 1)]);
        }
    }
    mesh
}

/// A cube of side 2 whose faces are `n` x `n` squares of two triangles, all vertices shared and exact in f32 for powers of 2.
fn cube(n: u32) -> Mesh {
    let mut mesh = Mesh::default();
    let mut index = std::collections::HashMap::new();
    for axis in 0..3 {
        for side in [0, n] {
            let mut vertex = |u: u32, v: u32| {
                let mut at = [0; 3];
                (at[axis], at[(axis + 1) % 3], at[(axis + 2) % 3]) = (side, u, v);
                *index.entry(at).or_insert_with(|| {
                    mesh.positions.push(DVec3::from_array(at.map(|i| 2.0 * f64::from(i) / f64::from(n) - 1.0)));
                    mesh.positions.len() as u32 - 1
                })
            };
            let mut triangles = Vec::new();
            for u in 0..n {
                for v in 0..n {
                    let (a, b, c, d) = (vertex(u, v), vertex(u + 1, v), vertex(u + 1, v + 1), vertex(u, v + 1));
                    triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
            mesh.triangles.extend(triangles);
        }
    }
    mesh
}

/// Rays from `origins` to everything that is hard to hit in the mesh: vertices, edges, and random directions.
fn hard_rays(prepared: &Prepared, origins: &[DVec3], random_rays: usize, random: &mut Random) -> Vec<Ray> {
    let mut rays = Vec::new();
    for origin in origins {
        let from = Vec3::from_array(f32s(*origin));
        for p in &prepared.accel.primitives {
            let [a, b, c] = [p.a, p.b, p.c].map(Vec3::from_array);
            let s = random.next() as f32;
            // Directions between f32 points, not normalised: as close to the target as f32 gets.
            for target in [a, a + s * (b - a), b + s * (c - b)] {
                rays.push(Ray { origin: from.to_array(), direction: (target - from).to_array() });
            }
        }
    }
    for i in 0..random_rays {
        rays.push(Ray { origin: f32s(origins[i % origins.len()]), direction: f32s(random.direction()) });
    }
    rays
}

fn assert_no_leak(what: &str, prepared: &Prepared, rays: &[Ray]) {
    let hits = trace(prepared, rays);
    let leaks: Vec<_> = rays.iter().zip(&hits).filter(|(_, h)| h.primitive.is_none() || h.overflow).collect();
    assert!(leaks.is_empty(), "{what}: {} of {} rays leak, e.g. {:?}", leaks.len(), rays.len(), leaks[0]);
}

/// Zero leaks in a million rays and more, through vertices, along edges, into slivers, from the centre, from lattice
/// points where coordinates cancel exactly, and from close to the surface.
#[test]
fn closed_meshes_are_watertight() {
    let mut random = Random(1);
    for (what, mesh) in [
        ("icosphere", mesh_of(icosphere(DVec3::ZERO, 1.0, 5))),
        ("slivers", uv_sphere(1500, 9)),
        ("coplanar", cube(32)),
    ] {
        let prepared = Prepared::new(&black_mesh(mesh), 0).unwrap();
        assert!(prepared.accel.primitives.len() > 10_000);
        // In device units all three span [-1, 1].
        let mut origins =
            vec![DVec3::ZERO, DVec3::new(0.25, 0.25, 0.25), DVec3::new(0.5, 0.0, 0.0), DVec3::new(0.0, 0.125, -0.5)];
        origins.extend((0..4).map(|_| 0.4 * random.in_cube()));
        origins.push(0.97 * DVec3::new(0.3, 0.9, 0.1).normalize());
        assert_no_leak(what, &prepared, &hard_rays(&prepared, &origins, 400_000, &mut random));
    }
}

/// Rays exactly along the axes of a lattice: through vertices, along edges, inside the planes of other faces.
#[test]
fn axis_parallel_rays_do_not_leak() {
    let prepared = Prepared::new(&black_mesh(cube(32)), 0).unwrap();
    let mut rays = Vec::new();
    for i in -31..32 {
        for j in -31..32 {
            // From a lattice plane; coordinates are vertices' coordinates.
            let at = DVec3::new(f64::from(i), f64::from(j), f64::from((i * j) % 32)) / 32.0;
            let diagonal = [DVec3::ONE, DVec3::new(1.0, -1.0, 0.0), DVec3::new(0.0, 1.0, 1.0)];
            for direction in DVec3::AXES.into_iter().chain(diagonal) {
                rays.extend([1.0, -1.0].map(|s| Ray { origin: f32s(at), direction: f32s(s * direction) }));
            }
        }
    }
    assert_no_leak("axes", &prepared, &rays);
}

fn transformed(mesh: &Mesh, scale: f64, offset: DVec3) -> Mesh {
    Mesh { positions: mesh.positions.iter().map(|p| scale * *p + offset).collect(), triangles: mesh.triangles.clone() }
}

/// A picture from inside a closed black mesh under a sky: black.
fn from_inside(mesh: Mesh, scale: f64, offset: DVec3) -> Epochs {
    let projection = Projection::Perspective { tan_half: DVec2::splat(2.0) };
    let scene = Builder::new()
        .camera(look(offset + scale * DVec3::new(0.1, 0.05, 0.2), offset - scale * DVec3::Z, DVec3::Y, projection))
        .film(128, 128, Filter::Box)
        .black(Shape::Mesh(transformed(&mesh, scale, offset)))
        .sky(1.0)
        .bounces(0)
        .build();
    let e = device::render(&scene, 1, 16, Settings { tile: [32, 32], ..Settings::default() });
    e.assert_clean();
    e
}

/// Through the renderer's own kernels, at any scale and place: 262,144 rays each, no light comes in.
#[test]
fn no_light_enters_a_closed_mesh_of_any_size_anywhere() {
    let ball = mesh_of(icosphere(DVec3::ZERO, 1.0, 5));
    let far = 1e6 * DVec3::new(1.0, -0.7, 0.3);
    for (scale, offset) in
        [(1.0, DVec3::ZERO), (1e-6, DVec3::ZERO), (1e6, DVec3::ZERO), (1.0, far), (1e-6, 1e-6 * far), (1e6, 1e6 * far)]
    {
        let e = from_inside(ball.clone(), scale, offset);
        assert!(e.means[0].iter().all(|v| *v == 0.0), "scale {scale}, offset {offset}");
    }
    // The same picture would show it: with one triangle less it does.
    let mut open = ball;
    open.triangles.truncate(open.triangles.len() - 40);
    assert!(from_inside(open, 1.0, DVec3::ZERO).means[0].iter().any(|v| *v > 0.0));
}

/// Powers of two and dyadic offsets give the very same bits: nothing depends on where the scene is or how large.
#[test]
fn scale_and_place_change_no_bit() {
    let picture = |scale: f64, offset: DVec3| {
        let at = |p: DVec3| scale * p + offset;
        let mesh = |m: Mesh| Shape::Mesh(transformed(&m, scale, offset));
        // Vertices on a lattice, so that the offset rounds nothing in f64.
        let scene = Builder::new()
            .camera(look(
                at(DVec3::new(0.5, 0.25, 2.5)),
                at(DVec3::ZERO),
                DVec3::Y,
                Projection::Perspective { tan_half: DVec2::splat(0.6) },
            ))
            .film(12, 12, Filter::Box)
            .bounces(3)
            .diffuse(mesh(cube(4)), 0.6)
            .lamp(mesh(mesh_of(quad(DVec3::new(-0.5, 1.5, -0.5), DVec3::X, DVec3::Z))), 2.0, Sides::Front)
            .diffuse(sphere(at(DVec3::new(1.5, -0.5, 0.5)), 0.5 * scale), 0.4)
            .sky(0.3)
            .build();
        let e = device::render(&scene, 1, 16, Settings::default());
        e.assert_clean();
        e.means[0].iter().map(|v| v.to_bits()).collect::<Vec<u32>>()
    };
    let expected = picture(1.0, DVec3::ZERO);
    for (scale, offset) in [
        (2f64.powi(-20), DVec3::ZERO),
        (2f64.powi(20), DVec3::ZERO),
        (1.0, 2f64.powi(20) * DVec3::new(1.0, -0.5, 0.25)),
    ] {
        assert!(picture(scale, offset) == expected, "scale {scale}, offset {offset}");
    }
}
