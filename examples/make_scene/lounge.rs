//! A furnished room, 6 m x 5 m x 2.7 m, in which everything is diffuse and each of four lamps can be switched: about 100,000 triangles
//! without smooth normals. x runs along the back wall (z = 0) to the window (x = 6), y up.

use std::f64::consts::{PI, TAU};
use std::io;
use std::path::Path;

use glam::{DAffine3, DVec3, dvec3};

use super::mesh::{Mesh, Part};
use super::shape::{Random, Wrap, cuboid, cushion, grid, lathe, profile, quad, sphere, tube};

const SIZE: DVec3 = dvec3(6.0, 2.7, 5.0);
/// The window in the wall at x = 6: from, to.
const WINDOW: [DVec3; 2] = [dvec3(6.0, 0.9, 1.2), dvec3(6.0, 2.3, 3.4)];

pub fn make(folder: &Path) -> io::Result<()> {
    let mut random = Random(2026);
    let mut mesh = room();
    furniture(&mut mesh, &mut random);
    shelf(&mut mesh, &mut random);
    plant(&mut mesh, &mut random);
    mesh.write(&folder.join("lounge.obj"))?;
    for (name, part) in lamps() {
        let mut mesh = Mesh::default();
        mesh.add("lamp", part);
        mesh.write(&folder.join(format!("{name}.obj")))?;
    }
    Ok(())
}

/// Without normals of its own: facets are small enough.
fn facets(mut part: Part) -> Part {
    part.normals.clear();
    part.uvs.clear();
    part
}

fn add(mesh: &mut Mesh, material: &str, part: Part) {
    mesh.add(material, facets(part));
}

fn room() -> Mesh {
    let mut mesh = Mesh::default();
    let DVec3 { x: w, y: h, z: d } = SIZE;
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let rectangle = |corner: DVec3, u: DVec3, v: DVec3| quad([corner, corner + u, corner + u + v, corner + v]);
    add(&mut mesh, "ceiling", rectangle(h * y, w * x, d * z));
    for (corner, u) in [(DVec3::ZERO, w * x), (d * z, -d * z), (w * x + d * z, -w * x)] {
        add(&mut mesh, "wall", rectangle(corner, u, h * y));
    }
    // Around the window.
    let [low, high] = WINDOW;
    for (from, to) in [
        (dvec3(w, 0.0, 0.0), dvec3(w, low.y, d)),
        (dvec3(w, high.y, 0.0), dvec3(w, h, d)),
        (dvec3(w, low.y, 0.0), dvec3(w, high.y, low.z)),
        (dvec3(w, low.y, high.z), dvec3(w, high.y, d)),
    ] {
        add(&mut mesh, "wall", rectangle(from, (to.z - from.z) * z, (to.y - from.y) * y));
    }
    add(&mut mesh, "wood", cuboid(dvec3(w - 0.15, low.y - 0.03, low.z - 0.05), dvec3(w, low.y, high.z + 0.05)));
    // Planks with gaps, and a skirting board.
    for k in 0..25 {
        let z = 0.2 * f64::from(k);
        add(&mut mesh, "floor", cuboid(dvec3(0.0, -0.02, z + 0.001), dvec3(w, 0.0, z + 0.199)));
    }
    add(&mut mesh, "floor", rectangle(-0.01 * y + d * z, w * x, -d * z));
    add(&mut mesh, "ceiling", cuboid(dvec3(0.001, 0.0, 0.001), dvec3(w - 0.001, 0.09, 0.015)));
    // A rug with a pile, and curtains in folds.
    let pile = |u: f64, v: f64| 0.012 + 0.004 * (57.0 * TAU * u).sin() * (43.0 * TAU * v).sin();
    let rug = grid(170, 120, Wrap::Open, |u, v| dvec3(1.7 + 2.6 * u, pile(u, v), 3.7 - 1.9 * v));
    let (middle, border) = rug.split(|p| (p.x - 3.0).abs() < 1.1 && (p.z - 2.75).abs() < 0.75);
    add(&mut mesh, "rug", middle);
    add(&mut mesh, "rug_border", border);
    for (from, to) in [(low.z - 0.45, low.z + 0.15), (high.z - 0.15, high.z + 0.45)] {
        let fold = |u: f64| 0.05 * (7.0 * TAU * u).sin() + 0.012 * (17.0 * TAU * u + 1.0).sin();
        let cloth = grid(160, 24, Wrap::Open, |u, v| {
            dvec3(w - 0.13 + fold(u) * (0.6 + 0.4 * v), 0.05 + 2.45 * v, from + (to - from) * u)
        });
        add(&mut mesh, "curtain", cloth);
    }
    let rod = [dvec3(w - 0.13, 2.53, low.z - 0.6), dvec3(w - 0.13, 2.53, high.z + 0.6)];
    add(&mut mesh, "metal", tube(&rod, 12, |_| 0.015));
    mesh
}

fn furniture(mesh: &mut Mesh, random: &mut Random) {
    // A sofa along the back wall: base, seats, back, arms, legs.
    let sofa = DAffine3::from_translation(dvec3(3.0, 0.0, 0.62));
    let soft = |centre: DVec3, radii: DVec3| cushion(centre, radii, 0.35, 0.3, 48, 64).transformed(sofa);
    add(mesh, "sofa", soft(dvec3(0.0, 0.24, 0.0), dvec3(1.1, 0.12, 0.45)));
    for side in [-1.0, 1.0] {
        add(mesh, "sofa", soft(dvec3(0.53 * side, 0.43, 0.05), dvec3(0.53, 0.1, 0.4)));
        add(mesh, "sofa", soft(dvec3(0.53 * side, 0.68, -0.32), dvec3(0.53, 0.25, 0.13)));
        add(mesh, "sofa", soft(dvec3(1.16 * side, 0.4, 0.0), dvec3(0.12, 0.28, 0.46)));
        for z in [-0.35, 0.35] {
            let leg = [dvec3(1.0 * side, 0.0, z), dvec3(1.0 * side, 0.13, z)];
            add(mesh, "wood", tube(&leg, 12, |_| 0.025).transformed(sofa));
        }
    }
    for (i, x) in [-0.8, -0.15, 0.75].into_iter().enumerate() {
        let turned = DAffine3::from_translation(dvec3(x, 0.68, -0.08))
            * DAffine3::from_rotation_x(-0.4)
            * DAffine3::from_rotation_z(random.between(-0.3, 0.3));
        let pillow = cushion(DVec3::ZERO, dvec3(0.21, 0.21, 0.08), 0.6, 0.5, 40, 48).transformed(sofa * turned);
        add(mesh, ["pillow_red", "pillow_yellow", "pillow_blue"][i], pillow);
    }
    // A low table with a bowl, cups and a book.
    add(mesh, "wood", cushion(dvec3(3.0, 0.4, 2.4), dvec3(0.65, 0.02, 0.4), 0.2, 0.7, 24, 64));
    for (x, z) in [(-0.5, -0.25), (0.5, -0.25), (-0.5, 0.25), (0.5, 0.25)] {
        let leg = [dvec3(3.0 + x, 0.0, 2.4 + z), dvec3(3.0 + 0.9 * x, 0.39, 2.4 + 0.9 * z)];
        add(mesh, "wood", tube(&leg, 16, |_| 0.02));
    }
    let bowl = profile(&[
        (0.0, 0.0),
        (0.06, 0.0),
        (0.13, 0.05),
        (0.16, 0.1),
        (0.15, 0.1),
        (0.12, 0.055),
        (0.05, 0.012),
        (0.0, 0.01),
    ]);
    add(mesh, "porcelain", lathe(64, &[&bowl]).moved(dvec3(2.85, 0.42, 2.35)));
    for (x, z, fruit) in [(2.81, 2.32, "fruit_red"), (2.9, 2.34, "fruit_orange"), (2.85, 2.41, "fruit_green")] {
        add(mesh, fruit, sphere(dvec3(x, 0.49, z), 0.045, 32, 24));
    }
    let cup =
        profile(&[(0.0, 0.0), (0.03, 0.0), (0.037, 0.03), (0.038, 0.08), (0.035, 0.08), (0.033, 0.03), (0.0, 0.008)]);
    for (x, z) in [(3.3, 2.3), (3.42, 2.52)] {
        add(mesh, "porcelain", lathe(48, &[&cup]).moved(dvec3(x, 0.42, z)));
    }
    add(mesh, "pillow_blue", cuboid(dvec3(3.05, 0.42, 2.5), dvec3(3.25, 0.45, 2.64)));
    // An armchair to the left.
    let chair = DAffine3::from_translation(dvec3(1.05, 0.0, 2.5)) * DAffine3::from_rotation_y(1.1);
    let soft = |centre: DVec3, radii: DVec3| cushion(centre, radii, 0.35, 0.35, 40, 56).transformed(chair);
    add(mesh, "armchair", soft(dvec3(0.0, 0.32, 0.0), dvec3(0.38, 0.14, 0.38)));
    add(mesh, "armchair", soft(dvec3(0.0, 0.65, -0.33), dvec3(0.38, 0.34, 0.11)));
    for side in [-1.0, 1.0] {
        add(mesh, "armchair", soft(dvec3(0.4 * side, 0.42, 0.0), dvec3(0.09, 0.22, 0.38)));
    }
    // The standing lamp's foot and pole, and a picture above the sofa.
    add(
        mesh,
        "metal",
        lathe(48, &[&profile(&[(0.0, 0.0), (0.16, 0.0), (0.16, 0.02), (0.02, 0.03), (0.0, 0.03)])])
            .moved(dvec3(0.7, 0.0, 0.7)),
    );
    add(mesh, "metal", tube(&[dvec3(0.7, 0.02, 0.7), dvec3(0.7, 1.48, 0.7)], 16, |_| 0.012));
    add(mesh, "wood", cuboid(dvec3(2.3, 1.35, 0.0), dvec3(3.7, 2.15, 0.03)));
    let patches = ["pillow_red", "fruit_orange", "pillow_yellow", "fruit_green", "pillow_blue", "rug"];
    for (i, material) in patches.into_iter().enumerate() {
        let x = 2.36 + 0.215 * i as f64;
        add(mesh, material, cuboid(dvec3(x, 1.41, 0.031), dvec3(x + 0.2, 2.09, 0.036)));
    }
}

/// Against the left wall, with rows of books.
fn shelf(mesh: &mut Mesh, random: &mut Random) {
    let (z0, z1, depth) = (3.2, 4.7, 0.3);
    for i in 0..6 {
        let y = 0.02 + 0.4 * f64::from(i);
        add(mesh, "wood", cuboid(dvec3(0.0, y, z0), dvec3(depth, y + 0.025, z1)));
        let mut z = z0 + 0.04;
        while i < 5 && z < z1 - 0.1 {
            let (thick, tall) = (random.between(0.018, 0.05), random.between(0.22, 0.34));
            let book = cuboid(
                dvec3(0.03, y + 0.026, z),
                dvec3(0.03 + random.between(0.17, 0.24), y + 0.026 + tall, z + thick),
            );
            let colours = [
                "pillow_red",
                "pillow_yellow",
                "pillow_blue",
                "fruit_green",
                "curtain",
                "rug",
                "porcelain",
                "armchair",
            ];
            add(mesh, colours[random.index(colours.len())], book);
            z += thick + 0.002;
        }
    }
    for z in [z0 - 0.025, z1] {
        add(mesh, "wood", cuboid(dvec3(0.0, 0.0, z), dvec3(depth, 2.05, z + 0.025)));
    }
}

/// In a pot at the window.
fn plant(mesh: &mut Mesh, random: &mut Random) {
    let foot = dvec3(5.35, 0.0, 0.7);
    let pot = profile(&[(0.0, 0.0), (0.14, 0.0), (0.2, 0.36), (0.18, 0.36), (0.17, 0.3), (0.0, 0.3)]);
    add(mesh, "pot", lathe(64, &[&pot]).moved(foot));
    for i in 0..60 {
        let turn = 2.4 * f64::from(i);
        let (reach, height) = (random.between(0.25, 0.6), random.between(0.5, 1.3));
        let tip = |t: f64| {
            let out = reach * t.powf(1.5);
            foot + dvec3(out * turn.cos(), 0.3 + height * t * (1.25 - 0.45 * t), out * turn.sin())
        };
        let across = dvec3(-turn.sin(), 0.0, turn.cos());
        let blade = grid(6, 24, Wrap::Open, |u, v| {
            let half = 0.035 * (PI * v.powf(0.7)).sin() + 0.003;
            tip(v) + (2.0 * u - 1.0) * half * across - dvec3(0.0, 0.02 * (2.0 * u - 1.0).powi(2), 0.0)
        });
        add(mesh, "leaf", blade);
    }
}

/// What shines, by the name of its file.
fn lamps() -> [(&'static str, Part); 4] {
    let [low, high] = WINDOW;
    let inwards =
        |x: f64| [dvec3(x, low.y, low.z), dvec3(x, low.y, high.z), dvec3(x, high.y, high.z), dvec3(x, high.y, low.z)];
    let y = SIZE.y - 0.03;
    let panel = quad([dvec3(2.2, y, 2.2), dvec3(3.8, y, 2.2), dvec3(3.8, y, 2.8), dvec3(2.2, y, 2.8)]);
    let shade = sphere(dvec3(0.7, 1.62, 0.7), 0.15, 32, 20);
    let strip = cuboid(dvec3(0.02, 2.1, 3.3), dvec3(0.06, 2.13, 4.6));
    [("window", quad(inwards(SIZE.x - 0.001))), ("ceiling", panel), ("standing", shade), ("strip", strip)]
        .map(|(name, part)| (name, facets(part)))
}
