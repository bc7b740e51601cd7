//! The device's traversal and triangle test against a loop over all triangles in f64.

use glam::DVec3;
use spectile::device::prepared::Prepared;
use spectile::device::words::Primitive;
use spectile::scene::Mesh;

use super::{Random, black_mesh, f32s};
use crate::tracer::{Hit, Ray, trace};

fn vector(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

/// The corners of a triangle.
pub fn corners(p: &Primitive) -> [DVec3; 3] {
    [p.a, p.b, p.c].map(vector)
}

/// Distance along the ray to a triangle in f64, with barycentric weights allowed to miss by `slack`.
pub fn distance_f64(corners: &[DVec3; 3], ray: &Ray, slack: impl Fn(f64, f64) -> f64) -> Option<f64> {
    let [a, b, c] = *corners;
    let (d, o) = (vector(ray.direction), vector(ray.origin));
    let (e1, e2) = (b - a, c - a);
    let n = e1.cross(e2);
    let det = -d.dot(n);
    let s = o - a;
    let w = s.cross(d);
    let (u, v, t) = (e2.dot(w) / det, -e1.dot(w) / det, s.dot(n) / det);
    let slack = slack(det, e1.length().max(e2.length()));
    (u >= -slack && v >= -slack && u + v <= 1.0 + slack && t > 0.0).then_some(t)
}

/// What tests a few triangles one by one finds what the BVH finds, to the last bit; of two in one place, either.
#[test]
fn few_triangles_are_hit_as_by_the_bvh() {
    let mut random = Random(4);
    for count in [1, 7, 48] {
        let mut mesh = Mesh::default();
        for i in 0..count {
            // Every third shares an edge with the last one.
            let first = if i % 3 == 2 { 3 * i - 2 } else { 3 * i };
            let (centre, size) = (random.in_cube(), 0.8 * random.next());
            mesh.positions.extend((0..3).map(|_| centre + size * random.in_cube()));
            mesh.triangles.push([first, first + 1, 3 * i + 2]);
        }
        let mut prepared = Prepared::new(&black_mesh(mesh), 0).unwrap();
        assert!(prepared.features.few_triangles);
        let corners: Vec<DVec3> = prepared
            .accel
            .primitives
            .iter()
            .flat_map(|p| [p.a, p.b, p.c])
            .map(|v| DVec3::from(v.map(f64::from)))
            .collect();
        let rays: Vec<Ray> = (0..40_000)
            .map(|i| {
                let origin = f32s(1.2 * random.in_cube());
                let towards = |to: DVec3| to - DVec3::from(origin.map(f64::from));
                let direction = match i % 4 {
                    0 => DVec3::AXES[i / 4 % 3],
                    1 => towards(corners[i / 4 % corners.len()]),
                    2 => towards(0.5 * (corners[i / 4 % corners.len()] + corners[(i / 4 + 1) % corners.len()])),
                    _ => random.direction(),
                };
                Ray { origin, direction: f32s(direction) }
            })
            .collect();
        let few = trace(&prepared, &rays);
        prepared.features.few_triangles = false;
        let mut hits = 0;
        for ((ray, few), bvh) in rays.iter().zip(&few).zip(trace(&prepared, &rays)) {
            assert!(!few.overflow && few.distance.to_bits() == bvh.distance.to_bits(), "{ray:?}: {few:?}, {bvh:?}");
            assert_eq!(few.primitive.is_some(), bvh.primitive.is_some());
            hits += u32::from(few.primitive.is_some());
        }
        assert!(hits > 3000, "{hits} hits of {count} triangles");
    }
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
    // Rounding of sheared coordinates up to 4: three roundings of half an ulp of 4 move a vertex by 8e-7 at most.
    let all: Vec<[DVec3; 3]> = prepared.accel.primitives.iter().map(corners).collect();
    let (hit, missed) = assert_as_brute_force(&all, |hit| all[hit.primitive? as usize].into(), &rays, &hits, 8e-7);
    assert!(hit > 3000 && missed > 1000, "{hit} hits, {missed} misses: a poor test");
}

/// Every hit of the unit `rays` lies between the nearest of slightly larger and of slightly smaller triangles than `all`, and where the
/// triangle that was `met` says, whose vertices rounding moves by `rounding`. How many hit, how many missed.
pub fn assert_as_brute_force(
    all: &[[DVec3; 3]],
    met: impl Fn(&Hit) -> Option<[DVec3; 3]>,
    rays: &[Ray],
    hits: &[Hit],
    rounding: f64,
) -> (usize, usize) {
    // What a vertex is moved by is worth that times the longest edge over the determinant in barycentric weight, for each of two
    // vertices of an edge.
    let slack = |det: f64, edge: f64| 2.0 * rounding * edge / det.abs();
    let (mut hit, mut missed) = (0, 0);
    for (ray, found) in rays.iter().zip(hits) {
        assert!(!found.overflow);
        let nearest = |sign: f64| {
            let each = all.iter().filter_map(|p| distance_f64(p, ray, |d, e| sign * slack(d, e)));
            each.fold(f64::INFINITY, f64::min)
        };
        let (larger, smaller) = (nearest(1.0), nearest(-1.0));
        match met(found) {
            Some(corners) => {
                let exact = distance_f64(&corners, ray, slack);
                let exact = exact.unwrap_or_else(|| panic!("{ray:?} does not meet what {found:?} says"));
                let distance = f64::from(found.distance);
                // The same slack, of three weights, moves the distance by at most that share of the longest edge.
                let [a, b, c] = corners;
                let (e1, e2) = (b - a, c - a);
                let det = vector(ray.direction).dot(e1.cross(e2));
                let edge = e1.length().max(e2.length());
                let tolerance = 2.5 * rounding + 3.0 * slack(det, edge) * edge;
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
    (hit, missed)
}
