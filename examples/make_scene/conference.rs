//! A conference room at dusk: 9 m x 6.5 m x 2.9 m, seen from its corner at the door. x runs along the back wall
//! (z = 0) to the windows (x = 9), y up.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::io;
use std::path::Path;

use glam::{DAffine3, DVec3, dvec2, dvec3};

use super::image::abundances;
use super::mesh::{Mesh, Part};
use super::shape::{Random, Wrap, cuboid, curve, cushion, grid, lathe, profile, quad, sphere, tube};

const SIZE: DVec3 = dvec3(9.0, 2.9, 6.5);
/// Where the table stands, and its half length and width.
const TABLE: DVec3 = dvec3(4.75, 0.0, 3.05);
const TABLE_HALF: [f64; 2] = [2.3, 0.75];
const TABLE_TOP: f64 = 0.75;

pub fn make(folder: &Path) -> io::Result<()> {
    let mut random = Random(2026);
    room().write(&folder.join("room.obj"))?;
    furniture(&mut random).write(&folder.join("furniture.obj"))?;
    shelf(&mut random).write(&folder.join("shelf.obj"))?;
    things(&mut random).write(&folder.join("things.obj"))?;
    plants(&mut random).write(&folder.join("plants.obj"))?;
    blinds().write(&folder.join("blinds.obj"))?;
    let (fittings, panels, pendants, uplights) = lamps();
    fittings.write(&folder.join("fittings.obj"))?;
    panels.write(&folder.join("panels.obj"))?;
    pendants.write(&folder.join("pendants.obj"))?;
    uplights.write(&folder.join("uplights.obj"))?;
    carpet(&folder.join("carpet.png"))
}

fn at(x: f64, y: f64, z: f64, degrees: f64) -> DAffine3 {
    DAffine3::from_translation(dvec3(x, y, z)) * DAffine3::from_rotation_y(degrees.to_radians())
}

/// A rectangle on a wall from `corner` along two edges; its texture coordinates are metres.
fn panel(corner: DVec3, u: DVec3, v: DVec3) -> Part {
    let mut part = quad([corner, corner + u, corner + u + v, corner + v]);
    part.uvs.iter_mut().for_each(|t| *t *= dvec2(u.length(), v.length()));
    part
}

fn room() -> Mesh {
    let mut mesh = Mesh::default();
    let DVec3 { x: w, y: h, z: d } = SIZE;
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    mesh.add("carpet", panel(d * z, w * x, -d * z));
    mesh.add("wall", panel(DVec3::ZERO, w * x, h * y));
    mesh.add("wall", panel(d * z, -d * z, h * y));
    mesh.add("wall", panel(w * x + d * z, -w * x, h * y));

    // The ceiling: tiles of 60 cm in an aluminium grid.
    mesh.add("ceiling", panel(h * y, w * x, d * z));
    let bar = |a: DVec3, b: DVec3| cuboid(a, b);
    for i in 1..15 {
        let x = 0.6 * f64::from(i);
        mesh.add("aluminium", bar(dvec3(x - 0.012, h - 0.006, 0.0), dvec3(x + 0.012, h - 1e-4, d)));
    }
    for k in 1..11 {
        let z = 0.6 * f64::from(k);
        mesh.add("aluminium", bar(dvec3(0.0, h - 0.007, z - 0.012), dvec3(w, h - 2e-4, z + 0.012)));
    }

    // The window wall: sill, lintel, piers; sashes with panes of 6 mm.
    let (low, high, near, far) = (0.85, 2.5, 0.5, 6.1);
    let wall = |y0: f64, y1: f64, z0: f64, z1: f64| cuboid(dvec3(w, y0, z0), dvec3(w + 0.3, y1, z1));
    mesh.add("wall", wall(0.0, low, 0.0, d));
    mesh.add("wall", wall(high, h, 0.0, d));
    mesh.add("wall", wall(low, high, 0.0, near));
    mesh.add("wall", wall(low, high, far, d));
    mesh.add("sill", cuboid(dvec3(w - 0.18, low, near - 0.05), dvec3(w + 0.1, low + 0.03, far + 0.05)));
    let sash = (far - near) / 4.0;
    for k in 0..4 {
        let (z0, z1) = (near + sash * f64::from(k), near + sash * f64::from(k + 1));
        let (y0, y1) = (low + 0.03, high);
        let (x0, x1, f) = (w + 0.12, w + 0.18, 0.05);
        mesh.add("frame", cuboid(dvec3(x0, y0, z0), dvec3(x1, y1, z0 + f)));
        mesh.add("frame", cuboid(dvec3(x0, y0, z1 - f), dvec3(x1, y1, z1)));
        mesh.add("frame", cuboid(dvec3(x0, y0, z0 + f), dvec3(x1, y0 + f, z1 - f)));
        mesh.add("frame", cuboid(dvec3(x0, y1 - f, z0 + f), dvec3(x1, y1, z1 - f)));
        let gap = 1e-3;
        let min = dvec3(w + 0.147, y0 + f + gap, z0 + f + gap);
        mesh.add("pane", cuboid(min, dvec3(w + 0.153, y1 - f - gap, z1 - f - gap)));
    }
    // A wall of wood slats behind everything, and a skirting board.
    for k in 0..90 {
        let x = 2.98 + 0.065 * f64::from(k);
        mesh.add("oak", cuboid(dvec3(x, 0.1, 0.0), dvec3(x + 0.042, 1.02, 0.022)));
    }
    mesh.add("skirting", cuboid(dvec3(0.0, 0.0, 0.0), dvec3(w, 0.09, 0.015)));
    // The screen, and 24 measured colours in a frame.
    mesh.add("frame_black", cuboid(dvec3(3.35, 1.12, 0.0), dvec3(5.95, 2.62, 0.02)));
    mesh.add("screen", panel(dvec3(3.38, 1.15, 0.021), 2.54 * x, 1.44 * y));
    let (left, bottom, patch, gap) = (6.72, 1.25, 0.25, 0.035);
    let edge = dvec3(6.0 * patch + 7.0 * gap, 4.0 * patch + 5.0 * gap, 0.02);
    mesh.add("frame_black", cuboid(dvec3(left - gap, bottom - gap, 0.0), dvec3(left - gap, bottom - gap, 0.0) + edge));
    for i in 0..24u32 {
        let (column, row) = (f64::from(i % 6), f64::from(3 - i / 6));
        let corner = dvec3(left + column * (patch + gap), bottom + row * (patch + gap), 0.021);
        mesh.add(&format!("patch{:02}", i + 1), panel(corner, patch * x, patch * y));
    }
    skyline(&mut mesh);
    mesh
}

/// Roofs across the street, small and near in front of the backdrop that is the sky.
fn skyline(mesh: &mut Mesh) {
    let mut random = Random(11);
    let mut z = -3.5;
    while z < 10.0 {
        let (wide, top) = (random.between(0.35, 1.1), random.between(0.95, 1.55));
        let x = SIZE.x + random.between(1.9, 2.3);
        mesh.add("roofs", cuboid(dvec3(x, -1.0, z), dvec3(x + 0.4, top, z + wide)));
        if random.between(0.0, 1.0) < 0.5 {
            let mast = [0.0, 0.15, 0.3].map(|y| dvec3(x + 0.1, top + y, z + wide / 2.0));
            mesh.add("roofs", tube(&mast, 6, |_| 0.006));
        }
        z += wide;
    }
}

fn chair() -> Vec<(&'static str, Part)> {
    let mut parts = vec![
        ("fabric", cushion(dvec3(0.0, 0.47, 0.0), dvec3(0.25, 0.045, 0.24), 0.5, 0.4, 48, 18)),
        ("shell", cushion(dvec3(0.0, 0.425, 0.0), dvec3(0.24, 0.02, 0.23), 0.4, 0.4, 40, 10)),
    ];
    // A back that leans and curves around the sitter.
    let back = cushion(DVec3::ZERO, dvec3(0.24, 0.28, 0.035), 0.45, 0.4, 48, 26);
    let bend = |p: DVec3| dvec3(p.x, 0.85 + p.y, -0.27 - 0.12 * (p.y + 0.28) + 0.9 * p.x * p.x + p.z);
    parts.push(("fabric", Part { positions: back.positions.iter().map(|p| bend(*p)).collect(), ..back }.smooth()));
    let spine =
        curve(&[dvec3(0.0, 0.41, -0.1), dvec3(0.0, 0.44, -0.3), dvec3(0.0, 0.7, -0.34), dvec3(0.0, 0.95, -0.36)], 16);
    parts.push(("shell", tube(&spine, 10, |_| 0.022)));
    for side in [-1.0, 1.0] {
        let arm = [(0.24, 0.43, 0.0), (0.30, 0.46, 0.0), (0.31, 0.62, 0.02), (0.30, 0.665, -0.02), (0.29, 0.66, -0.18)];
        let arm: Vec<_> = arm.iter().map(|&(x, y, z)| dvec3(side * x, y, z)).collect();
        parts.push(("chrome", tube(&curve(&arm, 24), 10, |_| 0.012)));
        parts.push(("shell", cushion(dvec3(side * 0.295, 0.675, -0.06), dvec3(0.03, 0.014, 0.13), 0.6, 0.5, 20, 10)));
    }
    let column = [profile(&[(0.028, 0.14), (0.028, 0.3)]), profile(&[(0.02, 0.3), (0.02, 0.41)])];
    parts.push(("chrome", lathe(24, &[&column[0], &column[1]])));
    for k in 0..5 {
        let turn = DAffine3::from_rotation_y(TAU * f64::from(k) / 5.0);
        let leg = curve(&[dvec3(0.0, 0.13, 0.0), dvec3(0.12, 0.12, 0.0), dvec3(0.3, 0.075, 0.0)], 10);
        parts.push(("chrome", tube(&leg, 10, |t| 0.02 - 0.006 * t).transformed(turn)));
        let castor = sphere(dvec3(0.3, 0.03, 0.0), 0.03, 16, 10);
        parts.push(("rubber", castor.transformed(turn)));
    }
    parts
}

fn furniture(random: &mut Random) -> Mesh {
    let mut mesh = Mesh::default();
    let [half_length, half_width] = TABLE_HALF;
    let top = cushion(DVec3::ZERO, dvec3(half_length, 0.018, half_width), 0.35, 0.55, 240, 20);
    mesh.add("table", top.moved(TABLE + dvec3(0.0, TABLE_TOP - 0.018, 0.0)));
    for x in [-1.3, 1.3] {
        let foot = profile(&[(0.0, 0.0), (0.42, 0.0)]);
        let rim = profile(&[(0.42, 0.0), (0.425, 0.008), (0.42, 0.016)]);
        let stem: Vec<_> = (0..=24)
            .map(|i| {
                let t = f64::from(i) / 24.0;
                dvec2(0.42 * (1.0 - t).powi(6) + 0.06 + 0.12 * t.powi(8), 0.016 + 0.70 * t)
            })
            .collect();
        let pieces = [&foot[..], &rim[..], &stem[..]];
        mesh.add("chrome", lathe(48, &pieces).moved(TABLE + dvec3(x, 0.0, 0.0)));
    }
    // Five chairs on either side, one at each end, not quite in line.
    let mut places =
        vec![(TABLE.x - half_length - 0.35, TABLE.z, 90.0), (TABLE.x + half_length + 0.35, TABLE.z, -90.0)];
    for i in 0..5 {
        let x = TABLE.x + 0.84 * (f64::from(i) - 2.0);
        places.push((x, TABLE.z + half_width + 0.3, 180.0));
        places.push((x, TABLE.z - half_width - 0.3, 0.0));
    }
    for (i, (x, z, degrees)) in places.into_iter().enumerate() {
        let place = at(
            x + random.between(-0.06, 0.06),
            0.0,
            z + random.between(-0.08, 0.12),
            degrees + random.between(-14.0, 14.0),
        );
        for (material, part) in chair() {
            let material = if material == "fabric" && i % 4 == 1 { "fabric_b" } else { material };
            mesh.add(material, part.transformed(place));
        }
    }
    mesh
}

/// Shelves against the back wall, with books in measured colours.
fn shelf(random: &mut Random) -> Mesh {
    let mut mesh = Mesh::default();
    let (x0, x1, depth, height) = (0.35, 2.75, 0.32, 2.2);
    let board = 0.024;
    for x in [x0, (x0 + x1 - board) / 2.0, x1 - board] {
        mesh.add("walnut", cuboid(dvec3(x, 0.0, 0.001), dvec3(x + board, height, depth)));
    }
    mesh.add("walnut", cuboid(dvec3(x0, 0.0, 0.0), dvec3(x1, height, 0.001)));
    for row in 0..7 {
        let y = 0.06 + f64::from(row) * (height - 0.06 - board) / 6.0;
        mesh.add("walnut", cuboid(dvec3(x0 + 1e-4, y, 0.001), dvec3(x1 - 1e-4, y + board, depth - 1e-3)));
        if row == 6 {
            break;
        }
        for bay in 0..2 {
            let middle = (x0 + x1) / 2.0 + board / 2.0;
            let (mut x, end) = if bay == 0 { (x0 + 0.03, middle - 0.04) } else { (middle + 0.005, x1 - 0.03) };
            let stop = end - random.between(0.0, 0.5);
            if (row, bay) == (3, 1) {
                continue; // a globe stands there
            }
            while x < stop {
                let (thick, tall, deep) =
                    (random.between(0.014, 0.05), random.between(0.19, 0.29), random.between(0.15, 0.23));
                if x + thick > end {
                    break;
                }
                let (a, b) =
                    (dvec3(x, y + board, depth - 0.03 - deep), dvec3(x + thick, y + board + tall, depth - 0.03));
                mesh.add(&format!("book{:02}", random.index(24) + 1), spine(a, b));
                mesh.add("paper", cuboid(a + dvec3(0.002, 0.004, 0.001), b - dvec3(0.002, 0.003, 0.006)));
                x += thick + 0.0015;
            }
        }
    }
    let y = 0.06 + 3.0 * (height - 0.06 - board) / 6.0 + board;
    let centre = dvec3(2.2, y + 0.15, 0.17);
    mesh.add("globe", sphere(centre, 0.11, 64, 40));
    let meridian: Vec<_> = (0..=40)
        .map(|i| {
            let (s, c) = (-FRAC_PI_2 + PI * f64::from(i) / 40.0).sin_cos();
            centre + 0.125 * dvec3(c, s, 0.0)
        })
        .collect();
    mesh.add("brass", tube(&meridian, 10, |_| 0.005));
    let foot = profile(&[(0.08, 0.0), (0.075, 0.01), (0.02, 0.02), (0.01, 0.03)]);
    mesh.add("brass", lathe(40, &[&foot]).moved(dvec3(2.2, y, 0.17)));
    mesh
}

/// A book's cover: rounded back, two boards.
fn spine(min: DVec3, max: DVec3) -> Part {
    let (half, middle) = ((max.x - min.x) / 2.0, (max.x + min.x) / 2.0);
    let bulge = 0.3 * half;
    let back = grid(10, 1, Wrap::Open, |u, v| {
        let (s, c) = ((u - 0.5) * PI).sin_cos();
        dvec3(middle + half * s, min.y + v * (max.y - min.y), max.z - bulge + bulge * c)
    });
    let z = max.z - bulge;
    let board = |x: f64| cuboid(dvec3(x, min.y, min.z), dvec3(x + 0.002, max.y, z));
    back.and(board(min.x)).and(board(max.x - 0.002))
}

fn things(random: &mut Random) -> Mesh {
    let mut mesh = Mesh::default();
    let y = TABLE_TOP + 2e-4;
    // Glasses and carafes are solids of glass: outside up, over the rim, inside down.
    let tumbler = profile(&[
        (0.0, 0.0),
        (0.029, 0.0),
        (0.031, 0.002),
        (0.0345, 0.05),
        (0.037, 0.1),
        (0.0375, 0.1045),
        (0.0365, 0.106),
        (0.0352, 0.1045),
        (0.0347, 0.1),
        (0.032, 0.05),
        (0.0285, 0.01),
        (0.026, 0.0085),
        (0.0, 0.008),
    ]);
    let carafe: Vec<_> = {
        let outside = [
            (0.0, 0.0),
            (0.058, 0.0),
            (0.066, 0.006),
            (0.072, 0.05),
            (0.066, 0.1),
            (0.048, 0.15),
            (0.033, 0.19),
            (0.031, 0.215),
            (0.036, 0.245),
            (0.0375, 0.249),
            (0.0362, 0.251),
            (0.0348, 0.249),
            (0.0282, 0.215),
            (0.0302, 0.19),
            (0.0452, 0.15),
            (0.063, 0.1),
            (0.0688, 0.05),
            (0.063, 0.01),
            (0.055, 0.006),
            (0.0, 0.005),
        ];
        let points: Vec<_> = outside.iter().map(|&(r, y)| dvec3(r, y, 0.0)).collect();
        let mut smooth: Vec<_> = curve(&points, 115).iter().map(|p| dvec2(p.x.max(0.0), p.y)).collect();
        smooth[0].x = 0.0;
        smooth[114].x = 0.0;
        smooth
    };
    let cup = profile(&[
        (0.0, 0.002),
        (0.024, 0.0),
        (0.027, 0.004),
        (0.034, 0.03),
        (0.038, 0.065),
        (0.0385, 0.068),
        (0.0375, 0.0685),
        (0.036, 0.066),
        (0.032, 0.03),
        (0.024, 0.008),
        (0.0, 0.006),
    ]);
    let saucer = profile(&[
        (0.0, 0.0),
        (0.04, 0.0),
        (0.07, 0.01),
        (0.0705, 0.012),
        (0.068, 0.0125),
        (0.04, 0.005),
        (0.0, 0.004),
    ]);
    for x in [-1.35, 0.05, 1.45] {
        mesh.add("glass", lathe(72, &[&carafe]).moved(TABLE + dvec3(x, y, 0.08)));
        for (dx, dz) in [(0.17, 0.1), (0.2, -0.04), (0.13, -0.16)] {
            mesh.add("glass", lathe(48, &[&tumbler]).moved(TABLE + dvec3(x + dx, y, dz)));
        }
    }
    for i in 0..5 {
        for side in [-1.0, 1.0] {
            let x = TABLE.x + 0.84 * (f64::from(i) - 2.0) + random.between(-0.05, 0.05);
            let turn = if side > 0.0 { 180.0 } else { 0.0 };
            let place =
                |dx: f64, dz: f64, degrees: f64| at(x + dx, y, TABLE.z + side * (TABLE_HALF[1] - dz), turn + degrees);
            if (i + usize::from(side > 0.0) as i32) % 2 == 0 {
                let lid =
                    DAffine3::from_translation(dvec3(0.0, 0.014, 0.11)) * DAffine3::from_rotation_x(18f64.to_radians());
                let here = place(0.0, 0.24, random.between(-6.0, 6.0));
                let slab = |hx: f64, hy: f64, hz: f64| cushion(DVec3::ZERO, dvec3(hx, hy, hz), 0.2, 0.12, 40, 12);
                mesh.add("aluminium", slab(0.165, 0.007, 0.115).moved(dvec3(0.0, 0.007, 0.0)).transformed(here));
                mesh.add("keys", cuboid(dvec3(-0.14, 0.0141, -0.02), dvec3(0.14, 0.0147, 0.08)).transformed(here));
                let cover = slab(0.165, 0.108, 0.004).moved(dvec3(0.0, 0.108, 0.0));
                mesh.add("aluminium", cover.transformed(here * lid));
                let display = cuboid(dvec3(-0.155, 0.012, -0.0047), dvec3(0.155, 0.206, -0.0041));
                mesh.add("display", display.transformed(here * lid));
            } else {
                let pad = cuboid(dvec3(-0.105, 0.0, -0.148), dvec3(0.105, 0.008, 0.148));
                mesh.add("paper", pad.transformed(place(0.0, 0.22, random.between(-12.0, 12.0))));
                let pen =
                    tube(&[dvec3(-0.07, 0.0125, 0.0), dvec3(0.06, 0.0125, 0.0), dvec3(0.07, 0.0125, 0.0)], 16, |t| {
                        if t > 0.9 { 0.001 } else { 0.004 }
                    });
                let colour = format!("book{:02}", random.index(24) + 1);
                mesh.add(&colour, pen.transformed(place(0.02, 0.26, random.between(20.0, 70.0))));
            }
            let here = place(0.24, 0.3, random.between(0.0, 90.0));
            mesh.add("porcelain", lathe(56, &[&saucer]).transformed(here));
            let up = here * DAffine3::from_translation(dvec3(0.0, 0.0045, 0.0));
            mesh.add("porcelain", lathe(56, &[&cup]).transformed(up));
            let handle = curve(
                &[
                    dvec3(0.034, 0.055, 0.0),
                    dvec3(0.055, 0.052, 0.0),
                    dvec3(0.055, 0.028, 0.0),
                    dvec3(0.031, 0.02, 0.0),
                ],
                16,
            );
            mesh.add("porcelain", tube(&handle, 10, |_| 0.0035).transformed(up));
            let coffee = profile(&[(0.0345, 0.05), (0.0, 0.05)]);
            mesh.add("coffee", lathe(40, &[&coffee]).transformed(up));
        }
    }
    // A bowl of fruit.
    let bowl = profile(&[
        (0.0, 0.0),
        (0.05, 0.0),
        (0.09, 0.02),
        (0.14, 0.07),
        (0.143, 0.072),
        (0.138, 0.074),
        (0.086, 0.026),
        (0.05, 0.008),
        (0.0, 0.007),
    ]);
    let centre = TABLE + dvec3(-0.62, y, -0.02);
    mesh.add("copper", lathe(80, &[&bowl]).moved(centre));
    for (k, material) in ["apple", "orange", "apple", "lemon", "orange", "apple_green"].into_iter().enumerate() {
        let angle = TAU * k as f64 / 5.0;
        let (r, lift) = if k == 5 { (0.0, 0.11) } else { (0.068, 0.062) };
        let place = centre + dvec3(r * angle.cos(), lift, r * angle.sin());
        let fruit = grid(32, 20, Wrap::U, |u, v| {
            let (s, c) = (TAU * u).sin_cos();
            let (sv, cv) = (PI * v).sin_cos();
            // Dimples where stem and flower were.
            let r = 0.038 * (1.0 - 0.22 * cv.abs().powi(8));
            dvec3(r * sv * c, -r * cv, -r * sv * s)
        });
        mesh.add(material, fruit.moved(place));
    }
    mesh
}

fn leaf(length: f64, width: f64, droop: f64) -> Part {
    grid(6, 14, Wrap::Open, |u, v| {
        let across = 2.0 * u - 1.0;
        let w = width * (PI * v.clamp(0.03, 0.985)).sin().powf(0.8) * (1.0 - 0.35 * v);
        let out = length * v;
        dvec3(w * across, length * (0.9 * v - droop * v * v) + 0.25 * w * across * across, out * (0.35 + 0.65 * v))
    })
}

fn plants(random: &mut Random) -> Mesh {
    let mut mesh = Mesh::default();
    let pot = profile(&[(0.0, 0.0), (0.17, 0.0), (0.21, 0.38), (0.22, 0.4), (0.205, 0.4), (0.195, 0.36)]);
    let earth = profile(&[(0.199, 0.37), (0.0, 0.38)]);
    for (x, z, scale) in [(8.4, 0.55, 1.15), (0.5, 6.0, 1.0), (8.5, 6.05, 1.2)] {
        mesh.add("terracotta", lathe(64, &[&pot]).moved(dvec3(x, 0.0, z)));
        mesh.add("earth", lathe(40, &[&earth]).moved(dvec3(x, 0.0, z)));
        for k in 0..110 {
            let height = random.between(0.0, 0.55);
            let length = scale * random.between(0.45, 0.85) * (1.15 - height);
            let place = DAffine3::from_translation(dvec3(x, 0.4 + scale * height, z))
                * DAffine3::from_rotation_y(2.39996 * f64::from(k) + random.between(-0.3, 0.3));
            let one = leaf(length, random.between(0.035, 0.06), random.between(0.35, 1.25));
            mesh.add("leaf", one.transformed(place));
        }
        let stem = curve(&[dvec3(x, 0.37, z), dvec3(x + 0.01, 0.7, z), dvec3(x, 0.4 + scale * 0.6, z)], 12);
        mesh.add("bark", tube(&stem, 12, |t| 0.022 - 0.012 * t));
    }
    mesh
}

/// Venetian blinds: half way down in the first and the third window.
fn blinds() -> Mesh {
    let mut mesh = Mesh::default();
    let sash = (6.1 - 0.5) / 4.0;
    for (window, drop) in [(0, 0.9), (1, 0.35), (2, 1.25), (3, 0.35)] {
        let (z0, z1) = (0.53 + sash * f64::from(window), 0.47 + sash * f64::from(window + 1));
        let top = 2.46;
        mesh.add("aluminium", cuboid(dvec3(8.93, top, z0), dvec3(8.985, top + 0.04, z1)));
        let count = (drop / 0.021) as i32;
        for k in 0..count {
            let y = top - 0.012 - 0.021 * f64::from(k);
            let slat = grid(8, 6, Wrap::Open, |u, v| {
                let s = 2.0 * u - 1.0;
                // Tilted by 35 degrees, and curved.
                dvec3(8.957 + 0.0102 * s, y + 0.0075 * s + 0.0022 * (1.0 - s * s), z0 + v * (z1 - z0))
            });
            mesh.add("slat", slat);
        }
        for z in [z0 + 0.2, z1 - 0.2] {
            let cord = [dvec3(8.957, top, z), dvec3(8.957, top - drop / 2.0, z), dvec3(8.957, top - drop, z)];
            mesh.add("paper", tube(&cord, 6, |_| 0.0012));
        }
    }
    mesh
}

/// Fittings, and what shines in them: panels in the ceiling, disks in the pendants, uplights on the back wall.
fn lamps() -> (Mesh, Mesh, Mesh, Mesh) {
    let [mut fittings, mut panels, mut pendants, mut uplights] = [(); 4].map(|()| Mesh::default());
    // Trays with a rim, and an opal sheet a little inside.
    for (x, z) in [(1.5, 1.5), (3.9, 1.5), (6.3, 1.5), (1.5, 5.1), (3.9, 5.1), (6.3, 5.1), (8.1, 1.5), (8.1, 5.1)] {
        let (top, deep, rim) = (SIZE.y - 0.008, 0.07, 0.018);
        let (a, b) = (dvec3(x - 0.6, top - deep, z - 0.15), dvec3(x + 0.6, top, z + 0.15));
        fittings.add("enamel", cuboid(dvec3(a.x, b.y - 0.004, a.z), b));
        let side = |x0: f64, x1: f64, z0: f64, z1: f64| cuboid(dvec3(x0, a.y, z0), dvec3(x1, b.y - 0.004, z1));
        fittings.add("aluminium", side(a.x, a.x + rim, a.z, b.z));
        fittings.add("aluminium", side(b.x - rim, b.x, a.z, b.z));
        fittings.add("aluminium", side(a.x + rim, b.x - rim, a.z, a.z + rim));
        fittings.add("aluminium", side(a.x + rim, b.x - rim, b.z - rim, b.z));
        let corner = dvec3(a.x + rim, a.y + 0.006, a.z + rim);
        let (u, v) = ((1.2 - 2.0 * rim) * DVec3::X, (0.3 - 2.0 * rim) * DVec3::Z);
        panels.add("lamp_panel", panel(corner, u, v));
    }
    for x in [-1.35, 0.0, 1.35] {
        let hang = dvec3(TABLE.x + x, 1.72, TABLE.z);
        let bell: Vec<_> = (0..=30)
            .map(|i| {
                let t = f64::from(i) / 30.0;
                dvec2(0.19 * (1.0 - t.powf(2.6)).sqrt().max(0.0) + 0.022, 0.2 * t)
            })
            .collect();
        let inside: Vec<_> = bell.iter().map(|p| dvec2(p.x - 0.002, p.y - 1e-3)).collect();
        fittings.add("copper", lathe(96, &[&bell]).moved(hang));
        fittings.add("enamel", lathe(72, &[&inside]).flipped().moved(hang));
        let cable = [hang + dvec3(0.0, 0.19, 0.0), dvec3(hang.x, 2.4, hang.z), dvec3(hang.x, SIZE.y, hang.z)];
        fittings.add("rubber", tube(&cable, 8, |_| 0.004));
        let socket = profile(&[(0.024, 0.18), (0.024, 0.225), (0.0, 0.226)]);
        fittings.add("rubber", lathe(24, &[&socket]).moved(hang));
        // Looks down.
        let opal = profile(&[(0.0, 0.03), (0.185, 0.03)]);
        pendants.add("lamp_pendant", lathe(32, &[&opal]).moved(hang));
    }
    for x in [3.12, 6.33, 8.75] {
        let place = dvec3(x, 1.95, 0.13);
        let shell = profile(&[(0.0, -0.14), (0.04, -0.13), (0.085, -0.06), (0.1, 0.0), (0.098, 0.0), (0.093, -0.02)]);
        fittings.add("brass", lathe(64, &[&shell]).moved(place));
        fittings.add("brass", cuboid(dvec3(x - 0.01, 1.85, 0.0), dvec3(x + 0.01, 1.87, 0.06)));
        // Looks up.
        let glow = profile(&[(0.092, -0.012), (0.0, -0.012)]);
        uplights.add("lamp_uplight", lathe(24, &[&glow]).moved(place));
    }
    (fittings, panels, pendants, uplights)
}

/// Shares of three yarns in a metre of carpet: broad checks of 50 cm, stripes, and tufts of 8 mm.
fn carpet(path: &Path) -> io::Result<()> {
    let mut random = Random(7);
    abundances(path, 256, |x, y| {
        let check = ((x * 2.0) as u32 + (y * 2.0) as u32).is_multiple_of(2);
        let along = if check { x } else { y };
        let stripe = 0.5 + 0.5 * (TAU * along * 16.0).sin();
        let accent = if random.between(0.0, 1.0) < 0.05 { 0.75 } else { 0.0 };
        let light = (0.15 + 0.45 * stripe + random.between(-0.15, 0.15)).clamp(0.0, 1.0);
        [(1.0 - accent) * (1.0 - light), (1.0 - accent) * light, accent]
    })
}
