//! Assemblies: what a ray meets of a thing that is placed is what it meets of its copy, and closed things stay closed.

use glam::{DAffine3, DMat3, DVec3, Vec3};
use spectile::device::prepared::Prepared;
use spectile::scene::{Mesh, Scene, Shape};

use super::brute_force::{assert_as_brute_force, corners};
use super::{Random, f32s};
use crate::scene_builder::*;
use crate::tracer::{Hit, Ray, trace};

fn turn(random: &mut Random) -> DMat3 {
    DMat3::from_axis_angle(random.direction(), 6.3 * random.next())
}

/// Turned, of sizes from `smallest` to 1; where `stretched`, along three axes of its own by up to 1 : 30, not mirrored.
fn anywhere(random: &mut Random, smallest: f64, stretched: bool) -> DAffine3 {
    let size = smallest.powf(random.next());
    let stretch =
        if stretched { DVec3::from_array(std::array::from_fn(|_| 30f64.powf(-random.next()))) } else { DVec3::ONE };
    let matrix3 = turn(random) * DMat3::from_diagonal(size * stretch) * turn(random);
    DAffine3 { matrix3, translation: 2.0 * random.in_cube() }
}

/// 400 triangles of all sizes within a cube of side 2.
fn shreds(random: &mut Random) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..400u32 {
        let (centre, size) = (0.7 * random.in_cube(), 0.3 * random.next());
        mesh.positions.extend((0..3).map(|_| centre + size * random.in_cube()));
        mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    mesh
}

fn prepared(scene: &Scene) -> Prepared {
    Prepared::new(scene, 0).expect("a scene")
}

/// The corners of a triangle of the instance `stub`, in f64 in the device's units of the world.
fn corners_placed(prepared: &Prepared, stub: u32, primitive: u32) -> [DVec3; 3] {
    let to_world = prepared.accel.placement(stub);
    corners(&prepared.accel.primitives[primitive as usize]).map(|p| to_world.transform_point3(p))
}

/// Triangles placed anywhere, small and stretched, among triangles of the world: what the device finds is what brute force in f64 finds
/// among all that is placed, for rays at random, along axes, and at corners and edges.
#[test]
fn what_is_placed_is_met_where_it_is() {
    let mut random = Random(7);
    for (smallest, stretched) in [(0.3, false), (0.003, false), (0.1, true)] {
        let mut b = Builder::new();
        for count in [20, 3] {
            let places = (0..count).map(|_| anywhere(&mut random, smallest, stretched)).collect();
            b = b.black(Shape::Mesh(shreds(&mut random))).placed(1, places);
        }
        let prepared = prepared(&b.black(Shape::Mesh(shreds(&mut random))).build());
        assert_eq!(prepared.accel.instances, 23);
        // Those of the world's tree come first, then 400 of each assembly.
        let of_world = prepared.accel.primitives.len() as u32 - 800;
        let mut all = Vec::new();
        for i in 0..of_world {
            let p = &prepared.accel.primitives[i as usize];
            if p.tag >> 24 == 0 {
                all.push(corners(p));
                continue;
            }
            let root = prepared.accel.nodes[p.attributes as usize / 5][4 * (p.attributes as usize % 5) + 3] as usize;
            let first = of_world + if prepared.accel.nodes[root][5] < of_world + 400 { 0 } else { 400 };
            all.extend((first..first + 400).map(|own| corners_placed(&prepared, i, own)));
        }
        assert_eq!(all.len(), 24 * 400);
        let rays: Vec<Ray> = (0..2_500)
            .map(|i| {
                let origin = f32s(1.2 * random.in_cube());
                let [a, b, c] = all[(random.next() * all.len() as f64) as usize];
                let towards = |to: DVec3| (to - DVec3::from(origin.map(f64::from))).normalize();
                let direction = match i % 5 {
                    0 => DVec3::AXES[i / 5 % 3],
                    1 => towards(a),
                    2 => towards(0.5 * (a + b)),
                    3 => towards((a + b + c) / 3.0),
                    _ => random.direction(),
                };
                Ray { origin, direction: f32s(direction) }
            })
            .collect();
        let met = |hit: &Hit| match (hit.instance, hit.primitive?) {
            (Some(instance), primitive) => Some(corners_placed(&prepared, instance, primitive)),
            (None, primitive) => Some(corners(&prepared.accel.primitives[primitive as usize])),
        };
        // Beside what the test rounds, a ray is moved into the instance by a matrix that is rounded too.
        let (hit, missed) = assert_as_brute_force(&all, met, &rays, &trace(&prepared, &rays), 1.2e-6);
        println!("{smallest}: {hit} hits, {missed} misses");
        assert!(hit > 1_000 && missed > 10, "{hit} hits, {missed} misses");
    }
}

/// A closed mesh that is placed does not leak: rays from inside, at corners, along edges and at random, in instances that are small,
/// stretched and far from the middle of the world.
#[test]
fn closed_things_that_are_placed_stay_closed() {
    let mut random = Random(11);
    for (smallest, stretched) in [(0.5, false), (0.002, false), (0.1, true)] {
        let places: Vec<DAffine3> = (0..12).map(|_| anywhere(&mut random, smallest, stretched)).collect();
        let ball = icosphere(DVec3::ZERO, 1.0, 4);
        let b = Builder::new().black(ball).placed(1, places.clone()).black(sphere(DVec3::splat(2.9), 0.1));
        let prepared = prepared(&b.build());
        let space = prepared.accel.space;
        let mut rays = Vec::new();
        for to_world in &places {
            let inside = to_world.transform_point3(0.5 * random.in_cube());
            let origin = space.point(inside);
            for p in prepared.accel.primitives.iter().filter(|p| p.tag >> 24 == 0) {
                let [a, b, _] = corners(p);
                for own in [a, a.lerp(b, random.next())] {
                    // The ball's own units are those of its radius.
                    let to = Vec3::from_array(space.point(to_world.transform_point3(own)));
                    rays.push(Ray { origin, direction: (to - Vec3::from_array(origin)).to_array() });
                }
            }
            rays.extend((0..4_000).map(|_| Ray { origin, direction: f32s(random.direction()) }));
        }
        let leaks =
            rays.iter().zip(trace(&prepared, &rays)).filter(|(_, hit)| hit.primitive.is_none() || hit.overflow).count();
        assert_eq!(leaks, 0, "of {} rays, {smallest}, stretched: {stretched}", rays.len());
    }
}
