//! Geometry at its worst: closed meshes do not leak, whatever their size and place; degenerate input neither hangs nor
//! spoils a picture; the device's traversal finds what brute force in f64 finds.

mod device;
mod scene_builder;
mod statistics;
mod tracer;

use std::f64::consts::{PI, TAU};

use device::{Epochs, Settings};
use glam::{DVec2, DVec3, Vec3};
use scene_builder::*;
use spectile::gpu::layout::Primitive;
use spectile::render::prepare::Prepared;
use spectile::render::rng::hash;
use spectile::scene::{Filter, Mesh, Projection, Scene, Shape, Sides};
use tracer::{Ray, trace};

/// Uniform over [0, 1), the same in every run.
struct Random(u32);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 += 1;
        f64::from(hash(self.0)) / 4_294_967_296.0
    }

    fn in_cube(&mut self) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| 2.0 * self.next() - 1.0))
    }

    fn direction(&mut self) -> DVec3 {
        let (z, angle) = (2.0 * self.next() - 1.0, TAU * self.next());
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * angle.cos(), r * angle.sin(), z)
    }
}

fn f32s(v: DVec3) -> [f32; 3] {
    v.as_vec3().to_array()
}

fn mesh_of(shape: Shape) -> Mesh {
    match shape {
        Shape::Mesh(mesh) => mesh,
        _ => unreachable!("a mesh"),
    }
}

// ---- Closed meshes

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

fn black_mesh(mesh: Mesh) -> Scene {
    Builder::new().black(Shape::Mesh(mesh)).build()
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
    for (what, mesh) in [("icosphere", mesh_of(icosphere(DVec3::ZERO, 1.0, 5))), ("slivers", uv_sphere(1500, 9)), ("coplanar", cube(32))] {
        let prepared = Prepared::new(&black_mesh(mesh), 0).unwrap();
        assert!(prepared.accel.primitives.len() > 10_000);
        // In device units all three span [-1, 1].
        let mut origins = vec![DVec3::ZERO, DVec3::new(0.25, 0.25, 0.25), DVec3::new(0.5, 0.0, 0.0), DVec3::new(0.0, 0.125, -0.5)];
        origins.extend((0..4).map(|_| 0.4 * random.in_cube()));
        origins.push(0.97 * DVec3::new(0.3, 0.9, 0.1).normalize());
        assert_no_leak(what, &prepared, &hard_rays(&prepared, &origins, 600_000, &mut random));
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
    for (scale, offset) in [(1.0, DVec3::ZERO), (1e-6, DVec3::ZERO), (1e6, DVec3::ZERO), (1.0, far), (1e-6, 1e-6 * far), (1e6, 1e6 * far)] {
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
            .camera(look(at(DVec3::new(0.5, 0.25, 2.5)), at(DVec3::ZERO), DVec3::Y, Projection::Perspective { tan_half: DVec2::splat(0.6) }))
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
    for (scale, offset) in [(2f64.powi(-20), DVec3::ZERO), (2f64.powi(20), DVec3::ZERO), (1.0, 2f64.powi(20) * DVec3::new(1.0, -0.5, 0.25))] {
        assert!(picture(scale, offset) == expected, "scale {scale}, offset {offset}");
    }
}

// ---- Degenerate input

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
    let p = vec![DVec3::new(-0.5, -0.5, 0.5), DVec3::new(0.5, -0.5, 0.5), DVec3::new(0.0, 0.5, 0.5), DVec3::new(0.25, 0.0, 0.5)];
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
            .camera(look(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, DVec3::Y, Projection::Perspective { tan_half: DVec2::splat(0.3) }))
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
            .camera(look(position, position + DVec3::Z, DVec3::Y, Projection::Perspective { tan_half: DVec2::splat(0.5) }))
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
        .camera(look(DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO, DVec3::Y, Projection::Perspective { tan_half: DVec2::splat(0.15) }))
        .film(64, 64, Filter::Box)
        .lamp(Shape::Mesh(mesh), 1.0, Sides::Front)
        .bounces(0)
        .build();
    assert!(picture(&scene).iter().all(|v| *v == 1.0));
}

// ---- Against brute force

/// Distance along the ray to a triangle in f64, with barycentric weights allowed to miss by `slack`.
fn distance_f64(p: &Primitive, ray: &Ray, slack: impl Fn(f64, f64) -> f64) -> Option<f64> {
    let v = |a: [f32; 3]| DVec3::from(a.map(f64::from));
    let (a, d, o) = (v(p.a), v(ray.direction), v(ray.origin));
    let (e1, e2) = (v(p.b) - a, v(p.c) - a);
    let n = e1.cross(e2);
    let det = -d.dot(n);
    let s = o - a;
    let w = s.cross(d);
    let (u, v, t) = (e2.dot(w) / det, -e1.dot(w) / det, s.dot(n) / det);
    let slack = slack(det, e1.length().max(e2.length()));
    (u >= -slack && v >= -slack && u + v <= 1.0 + slack && t > 0.0).then_some(t)
}

/// The nearest of 2,000 triangles of all sizes, at random and along axes: what the device finds lies between the nearest
/// hit of slightly larger and of slightly smaller triangles.
#[test]
fn traversal_equals_brute_force() {
    let mut random = Random(3);
    let mut mesh = Mesh::default();
    for i in 0..2000u32 {
        let (centre, size) = (random.in_cube(), 0.5 * random.next());
        let flat = if i % 3 == 0 { DVec3::new(1.0, 1.0, 0.0) } else { DVec3::ONE };
        mesh.positions.extend((0..3).map(|_| centre + size * flat * random.in_cube()));
        mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    let prepared = Prepared::new(&black_mesh(mesh), 0).unwrap();
    let rays: Vec<Ray> = (0..20_000)
        .map(|i| {
            let direction = if i % 5 == 0 { DVec3::AXES[i % 3] } else { random.direction() };
            Ray { origin: f32s(1.2 * random.in_cube()), direction: f32s(direction) }
        })
        .collect();
    let hits = trace(&prepared, &rays);
    // Rounding of sheared coordinates up to 4: three roundings of half an ulp of 4 move a vertex by 8e-7 at most, which is
    // worth that times the longest edge over the determinant in barycentric weight, for each of two vertices of an edge.
    let slack = |det: f64, edge: f64| 2.0 * 8e-7 * edge / det.abs();
    let (mut hit, mut missed) = (0, 0);
    for (ray, found) in rays.iter().zip(&hits) {
        assert!(!found.overflow);
        let nearest = |sign: f64| {
            let each = prepared.accel.primitives.iter().filter_map(|p| distance_f64(p, ray, |d, e| sign * slack(d, e)));
            each.fold(f64::INFINITY, f64::min)
        };
        let (larger, smaller) = (nearest(1.0), nearest(-1.0));
        match found.primitive {
            Some(i) => {
                let exact = distance_f64(&prepared.accel.primitives[i as usize], ray, |d, e| slack(d, e));
                let exact = exact.unwrap_or_else(|| panic!("{ray:?} does not meet what {found:?} says"));
                let distance = f64::from(found.distance);
                // The same slack, of three weights, moves the distance by at most that share of the longest edge.
                let p = &prepared.accel.primitives[i as usize];
                let v = |a: [f32; 3]| DVec3::from(a.map(f64::from));
                let (e1, e2) = (v(p.b) - v(p.a), v(p.c) - v(p.a));
                let det = DVec3::from(ray.direction.map(f64::from)).dot(e1.cross(e2));
                let tolerance = 2e-6 + 3.0 * slack(det, e1.length().max(e2.length())) * e1.length().max(e2.length());
                assert!((distance - exact).abs() <= tolerance, "{ray:?}: {found:?}, exactly {exact}, {tolerance:e}");
                assert!(distance <= smaller + tolerance, "{ray:?}: {found:?} behind {smaller}");
                assert!(distance >= larger - tolerance, "{ray:?}: {found:?} before {larger}");
                hit += 1;
            }
            None => {
                assert_eq!(smaller, f64::INFINITY, "{ray:?} misses what is {smaller} away");
                missed += 1;
            }
        }
    }
    assert!(hit > 3000 && missed > 1000, "{hit} hits, {missed} misses: a poor test");
}
