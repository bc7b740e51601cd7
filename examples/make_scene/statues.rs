//! A terrace under an open sky: a gem of flint glass in a claw of silver, a cat of gold, a knot of crown glass, an
//! amphora of copper. y up; the terrace is a disk of 7 m about the origin.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::io;
use std::path::Path;

use glam::{DAffine3, DVec3, dvec2, dvec3};

use super::isosurface::{self, blend, capsule, ellipsoid};
use super::mesh::{Mesh, Part};
use super::shape::{Wrap, curve, cushion, grid, lathe, polyhedron, profile, quad, ring, tube};

pub fn make(scene: &Path, folder: &Path) -> io::Result<()> {
    let write = |name: &str, material: &str, part: Part| {
        let mut mesh = Mesh::default();
        mesh.add(material, part);
        mesh.write(&folder.join(name))
    };
    write("gem.obj", "flint", gem())?;
    write("knot.obj", "crown", knot())?;
    write("cat.obj", "gold", cat())?;
    let mut copper = Mesh::default();
    copper.add("copper", amphora());
    copper.write(&folder.join("amphora.obj"))?;
    terrace().write(&folder.join("terrace.obj"))?;
    super::image::soften_sun(&scene.join("sky.hdr"), &folder.join("sky.hdr"))
}

/// Where each statue stands, and how high its plinth is.
const GEM: (DVec3, f64) = (dvec3(0.0, 0.0, 0.4), 0.72);
const CAT: (DVec3, f64) = (dvec3(-1.35, 0.0, -0.25), 0.62);
const KNOT: (DVec3, f64) = (dvec3(1.38, 0.0, -0.2), 0.62);
const AMPHORA: (DVec3, f64) = (dvec3(0.78, 0.0, -2.1), 0.3);

/// A brilliant: table, crown, girdle and pavilion by the angles of Tolkowsky (*Diamond Design*, 1919), girdle radius 0.36 m,
/// in a claw, tilted a little towards the camera.
fn gem() -> Part {
    // Facets at `count` azimuths, inclined by `degrees`, through the point at radius r and height y; crown and pavilion.
    let mut planes = vec![(DVec3::Y, 0.343)];
    let mut facets = |count: u32, offset: f64, degrees: f64, r: f64, y: f64| {
        let (out, up) = degrees.to_radians().sin_cos();
        for k in 0..count {
            let (s, c) = (TAU * (f64::from(k) + offset) / f64::from(count)).sin_cos();
            planes.push((dvec3(out * c, up * y.signum(), out * s), out * r + up * y.abs()));
        }
    };
    facets(16, 0.5, 90.0, 1.0, 0.0);
    facets(8, 0.5, 34.5, 1.0, 0.02);
    facets(16, 0.5, 36.8, 1.0, 0.02);
    facets(8, 0.0, 21.0, 0.68, 0.275);
    facets(8, 0.5, 40.75, 1.0, -0.02);
    facets(16, 0.5, 41.3, 1.0, -0.02);
    let tilt = DAffine3::from_rotation_x(14f64.to_radians()) * DAffine3::from_rotation_y(0.19);
    let scale = DAffine3::from_scale(DVec3::splat(0.36));
    let (place, height) = GEM;
    polyhedron(&planes).transformed(DAffine3::from_translation(place + dvec3(0.0, height + 0.43, 0.0)) * tilt * scale)
}

/// A trefoil knot of a thick rod.
fn knot() -> Part {
    let (place, height) = KNOT;
    let path = |t: f64| {
        let a = TAU * t;
        0.148 * dvec3(a.sin() + 2.0 * (2.0 * a).sin(), a.cos() - 2.0 * (2.0 * a).cos(), -1.25 * (3.0 * a).sin())
    };
    let part = ring(720, 64, 0.082, path);
    let turn = DAffine3::from_rotation_y(-0.35);
    let lowest = part.positions.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
    part.transformed(turn).moved(place + dvec3(0.0, height - lowest + 1e-3, 0.0))
}

/// A seated cat that looks to the camera, 0.85 m high, as a blend of solids.
fn cat() -> Part {
    let v = dvec3;
    let shape = move |p: DVec3| {
        // Symmetric but for the tail.
        let q = v(p.x.abs(), p.y, p.z);
        let body = ellipsoid(p - v(0.0, 0.26, -0.06), v(0.165, 0.24, 0.19));
        let chest = ellipsoid(p - v(0.0, 0.40, 0.03), v(0.12, 0.20, 0.115));
        let haunch = ellipsoid(q - v(0.12, 0.15, -0.05), v(0.09, 0.145, 0.165));
        let hind = capsule(q, v(0.15, 0.035, -0.02), v(0.14, 0.03, 0.16), 0.038);
        let leg = capsule(q, v(0.062, 0.38, 0.10), v(0.062, 0.05, 0.165), 0.036);
        let paw = ellipsoid(q - v(0.063, 0.032, 0.195), v(0.043, 0.034, 0.062));
        let neck = capsule(p, v(0.0, 0.50, 0.02), v(0.0, 0.64, 0.045), 0.068);
        let head = ellipsoid(p - v(0.0, 0.70, 0.065), v(0.108, 0.09, 0.095));
        let cheek = ellipsoid(q - v(0.042, 0.672, 0.125), v(0.05, 0.04, 0.045));
        let nose = ellipsoid(p - v(0.0, 0.686, 0.155), v(0.024, 0.02, 0.03));
        // An ear: a thick triangle that leans outwards.
        let ear = {
            let a = q - v(0.072, 0.76, 0.045);
            let t = (a.y / 0.125).clamp(0.0, 1.0);
            let centre = v(0.025 * t, 0.125 * t, -0.01 * t);
            let d = a - centre;
            let width = 0.047 * (1.0 - t) + 0.006;
            (v(d.x / width, d.y / 0.05, d.z / (0.55 * width)).length() - 1.0) * 0.5 * width
        };
        let eye = ellipsoid(q - v(0.043, 0.716, 0.142), v(0.02, 0.013, 0.016));
        let tail_path = [
            v(0.0, 0.07, -0.22),
            v(0.16, 0.045, -0.22),
            v(0.26, 0.035, -0.08),
            v(0.255, 0.035, 0.1),
            v(0.16, 0.035, 0.235),
        ];
        let tail =
            tail_path.windows(2).map(|w| capsule(p, w[0], w[1], 0.032)).reduce(|a, b| blend(a, b, 0.02)).unwrap_or(1.0);
        let trunk = [chest, haunch, neck].into_iter().fold(body, |all, part| blend(all, part, 0.05));
        let limbs = [hind, leg, paw].into_iter().fold(trunk, |all, part| blend(all, part, 0.022));
        let face = [cheek, nose, ear].into_iter().fold(head, |all, part| blend(all, part, 0.018));
        let all = blend(blend(limbs, face, 0.03), tail, 0.02);
        // Eyes are cut in, with a rounded edge.
        -blend(-all, eye + 0.002, 0.006)
    };
    let (place, height) = CAT;
    let box_ = [v(-0.36, -0.01, -0.34), v(0.36, 0.96, 0.34)];
    let turn = DAffine3::from_rotation_y(0.42);
    isosurface::mesh(shape, box_, 0.0075).transformed(DAffine3::from_translation(place + v(0.0, height, 0.0)) * turn)
}

fn amphora() -> Part {
    let (place, height) = AMPHORA;
    let outside: Vec<_> = [
        (0.0, 0.0),
        (0.11, 0.0),
        (0.12, 0.025),
        (0.085, 0.05),
        (0.13, 0.16),
        (0.24, 0.42),
        (0.27, 0.62),
        (0.22, 0.82),
        (0.10, 0.94),
        (0.075, 1.05),
        (0.085, 1.14),
        (0.13, 1.19),
        (0.135, 1.205),
        (0.12, 1.205),
        (0.07, 1.14),
        (0.06, 1.05),
    ]
    .iter()
    .map(|&(r, y)| dvec3(r, y, 0.0))
    .collect();
    let smooth: Vec<_> = curve(&outside, 150).iter().map(|p| dvec2(p.x.max(0.0), p.y)).collect();
    let mut part = lathe(128, &[&smooth]);
    for side in [-1.0, 1.0] {
        let handle = [(0.078, 1.06), (0.17, 1.10), (0.235, 1.02), (0.225, 0.88), (0.2, 0.82)];
        let path: Vec<_> = handle.iter().map(|&(x, y)| dvec3(side * x, y, 0.0)).collect();
        part = part.and(tube(&curve(&path, 40), 20, |_| 0.018));
    }
    part.transformed(DAffine3::from_rotation_y(0.5)).moved(place + dvec3(0.0, height, 0.0))
}

/// A plinth with base, shaft and cap.
fn plinth(mesh: &mut Mesh, material: &str, (place, height): (DVec3, f64), half: f64) {
    let slab = |y0: f64, y1: f64, h: f64| {
        let middle = (y0 + y1) / 2.0;
        cushion(place + dvec3(0.0, middle, 0.0), dvec3(h, (y1 - y0) / 2.0, h), 0.12, 0.12, 64, 20)
    };
    mesh.add(material, slab(0.0, 0.1, half + 0.06));
    mesh.add(material, slab(0.1, height - 0.07, half));
    mesh.add(material, slab(height - 0.07, height, half + 0.035));
}

fn terrace() -> Mesh {
    let mut mesh = Mesh::default();
    // Flags in two stones, in rings about the middle.
    for row in 0..28 {
        for column in 0..28 {
            let size = 0.5;
            let (x, z) = (size * (f64::from(column) - 14.0), size * (f64::from(row) - 14.0));
            if dvec2(x + size / 2.0, z + size / 2.0).length() > 6.6 {
                continue;
            }
            let material = if (row + column) % 2 == 0 { "stone_light" } else { "stone_dark" };
            let gap = 0.004;
            let (a, b) = (dvec3(x + gap, -0.1, z + gap), dvec3(x + size - gap, 0.0, z + size - gap));
            mesh.add(material, quad([dvec3(a.x, 0.0, b.z), b, dvec3(b.x, 0.0, a.z), dvec3(a.x, 0.0, a.z)]));
        }
    }
    let edge = profile(&[(0.0, -0.012), (6.9, -0.012)]);
    let wall = profile(&[(6.9, -0.6), (6.9, -0.012)]);
    mesh.add("mortar", lathe(128, &[&edge]).flipped().and(lathe(128, &[&wall])));
    // A low balustrade at the far side.
    let posts = 46;
    let arc = |k: f64, r: f64| {
        let a = -FRAC_PI_2 + (k / f64::from(posts) - 0.5) * 1.9;
        dvec3(r * a.cos(), 0.0, r * a.sin())
    };
    let baluster =
        profile(&[(0.05, 0.08), (0.05, 0.12), (0.03, 0.16), (0.065, 0.32), (0.035, 0.5), (0.05, 0.56), (0.05, 0.6)]);
    let baluster: Vec<_> = baluster.iter().map(|p| dvec3(p.x, p.y, 0.0)).collect();
    let baluster: Vec<_> = curve(&baluster, 40).iter().map(|p| dvec2(p.x, p.y)).collect();
    for k in 0..=posts {
        mesh.add("stone_light", lathe(24, &[&baluster]).moved(arc(f64::from(k), 6.3)));
    }
    for (low, high, half) in [(0.0, 0.085, 0.1), (0.595, 0.69, 0.12)] {
        // A rail: a rectangle swept along the arc.
        let rail = grid(4, 160, Wrap::U, |u, v| {
            let corner = ((u * 4.0).round() as usize) % 4;
            let (r, y) = [(half, low), (half, high), (-half, high), (-half, low)][corner];
            arc(v * f64::from(posts), 6.3 + r) + y * DVec3::Y
        });
        mesh.add("stone_light", Part { normals: Vec::new(), ..rail });
    }
    plinth(&mut mesh, "marble", GEM, 0.2);
    plinth(&mut mesh, "marble", CAT, 0.3);
    plinth(&mut mesh, "marble", KNOT, 0.26);
    plinth(&mut mesh, "marble", AMPHORA, 0.22);
    // The gem's claw: a foot and four arms.
    let (place, height) = GEM;
    let foot = profile(&[(0.0, 0.0), (0.13, 0.0), (0.13, 0.012), (0.03, 0.03), (0.02, 0.055), (0.0, 0.056)]);
    mesh.add("silver", lathe(64, &[&foot]).moved(place + height * DVec3::Y));
    for k in 0..4 {
        let arm = curve(
            &[
                dvec3(0.015, 0.04, 0.0),
                dvec3(0.12, 0.10, 0.0),
                dvec3(0.285, 0.25, 0.0),
                dvec3(0.376, 0.40, 0.0),
                dvec3(0.386, 0.47, 0.0),
            ],
            30,
        );
        let turn = DAffine3::from_rotation_y(PI / 4.0 + FRAC_PI_2 * f64::from(k));
        mesh.add("silver", tube(&arm, 16, |t| 0.011 - 0.004 * t).transformed(turn).moved(place + height * DVec3::Y));
    }
    mesh
}
