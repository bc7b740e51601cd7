//! A tree of 24,000 leaves, and where ten thousand of it stand.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;
use std::io;
use std::path::Path;

use glam::{DVec3, dvec3};

use super::mesh::{Mesh, Part};
use super::plume::noise;
use super::shape::{Random, Wrap, curve, grid, tube};

const LEAVES: usize = 24_000;
/// Half the side of the square that is planted, and the distance between trees, metres.
const HALF_SIDE: f64 = 300.0;
const SPACING: f64 = 6.0;

pub fn make(folder: &Path) -> io::Result<()> {
    tree().write(&folder.join("tree.obj"))?;
    let mut land = Mesh::default();
    land.add(
        "litter",
        grid(96, 96, Wrap::Open, |u, v| ground(4.0 * HALF_SIDE * (u - 0.5), 4.0 * HALF_SIDE * (0.5 - v))),
    );
    land.write(&folder.join("land.obj"))?;
    std::fs::write(folder.join("trees.csv"), places())
}

fn ground(x: f64, z: f64) -> DVec3 {
    dvec3(x, 14.0 * noise(dvec3(x / 180.0, 0.3, z / 180.0)) + 2.0 * noise(dvec3(x / 40.0, 7.1, z / 40.0)), z)
}

/// x,y,z,yaw_degrees,scale: a grid whose points are moved by chance, with a ride through it.
fn places() -> String {
    let mut random = Random(10_000);
    let mut text = String::from("x,y,z,yaw_degrees,scale\n");
    let side = (2.0 * HALF_SIDE / SPACING) as usize;
    for cell in 0..side * side {
        let place =
            |i: usize, random: &mut Random| SPACING * (i as f64 + 0.5 + random.between(-0.45, 0.45)) - HALF_SIDE;
        let (x, z) = (place(cell % side, &mut random), place(cell / side, &mut random));
        let (yaw, size) = (random.between(0.0, 360.0), random.between(0.55, 1.1));
        // A path winds through the wood.
        let off_path = (x - 25.0 * (z / 70.0).sin()).abs() > 5.0;
        let y = ground(x, z).y - 0.1;
        let (x, z) = if off_path { (x, z) } else { (x + 10.0, z) };
        writeln!(text, "{x:.3},{y:.3},{z:.3},{yaw:.1},{size:.3}").expect("memory");
    }
    text
}

/// Twelve metres high: a trunk, boughs that turn upward, twigs, and leaves about the twigs' ends.
fn tree() -> Mesh {
    let mut random = Random(7);
    let mut wood = tube(&curve(&[DVec3::ZERO, dvec3(0.1, 4.0, 0.05), dvec3(-0.05, 10.5, 0.1)], 12), 9, |t| {
        0.22 * (1.0 - 0.85 * t)
    });
    let mut tips = Vec::new();
    for bough in 0..26 {
        let share = f64::from(bough) / 25.0;
        let from = dvec3(0.05, 2.6 + 7.4 * share, 0.05);
        let angle = 2.4 * f64::from(bough) + random.between(-0.3, 0.3);
        let out = dvec3(angle.cos(), 0.0, angle.sin());
        // Widest at two fifths of the crown.
        let reach = 3.4 * (PI * (0.15 + 0.8 * share)).sin().max(0.25);
        let bend =
            [from, from + 0.5 * reach * out + DVec3::Y * 0.25 * reach, from + reach * out + DVec3::Y * 0.75 * reach];
        wood = wood.and(tube(&curve(&bend, 8), 6, |t| 0.07 * (1.0 - 0.8 * t)));
        for _ in 0..7 {
            let along = random.between(0.35, 1.0);
            let from = bend[0].lerp(bend[1], along).lerp(bend[1].lerp(bend[2], along), along);
            let away = (out + unit(&mut random) + 0.3 * DVec3::Y).normalize() * random.between(0.5, 1.0);
            wood = wood
                .and(tube(&[from, from + 0.5 * away, from + away + 0.1 * DVec3::Y], 4, |t| 0.018 * (1.0 - 0.6 * t)));
            tips.push((from, from + away));
        }
    }
    let mut leaves = Part::default();
    for _ in 0..LEAVES {
        let (from, to) = tips[random.index(tips.len())];
        let at = from.lerp(to, random.between(0.2, 1.15)) + 0.28 * unit(&mut random) * random.between(0.2, 1.0);
        leaf(&mut leaves, at, &mut random);
    }
    let mut mesh = Mesh::default();
    mesh.add("bark", wood);
    mesh.add("leaf", leaves);
    mesh
}

fn unit(random: &mut Random) -> DVec3 {
    let (y, turn) = (random.between(-1.0, 1.0), random.between(0.0, TAU));
    let r = (1.0 - y * y).sqrt();
    dvec3(r * turn.cos(), y, r * turn.sin())
}

/// Four triangles, 14 cm long, folded along the middle; most of them look up (planophile).
fn leaf(part: &mut Part, at: DVec3, random: &mut Random) {
    let up = (unit(random) + 1.2 * DVec3::Y).normalize();
    let along = up.any_orthonormal_vector();
    let turn = random.between(0.0, TAU);
    let along = along * turn.cos() + up.cross(along) * turn.sin();
    let across = up.cross(along);
    let (length, width) = (0.14, 0.045);
    let first = part.positions.len() as u32;
    part.positions.extend([
        at,
        at + 0.45 * length * along - width * across + 0.015 * up,
        at + 0.5 * length * along,
        at + 0.45 * length * along + width * across + 0.015 * up,
        at + length * along - 0.02 * up,
    ]);
    for corners in [[0, 1, 2], [0, 2, 3], [1, 4, 2], [2, 4, 3]] {
        part.triangle(corners.map(|i: u32| i + first));
    }
}
