//! A twin-jet that climbs away from a runway. The aircraft in its own frame: nose at +x, y up, +z to starboard, metres;
//! the scene turns it. The field around it in the world's frame.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::io;
use std::path::Path;

use glam::{DAffine3, DVec2, DVec3, dvec2, dvec3};

use super::gases;
use super::mesh::{Mesh, Part};
use super::plume::{self, noise};
use super::shape::{Random, Wrap, cuboid, cushion, grid, lathe, profile, quad, tube};
use super::sky::Sky;

/// Of the sun, in degrees from +x towards +z.
const SUN_AZIMUTH: f64 = 100.0;
/// Where an engine's lip is; the other one is at -z.
const ENGINE: DVec3 = dvec3(4.4, -2.0, 5.4);

pub fn make(scene: &Path, folder: &Path) -> io::Result<()> {
    airframe().write(&folder.join("airframe.obj"))?;
    let (engines, hot) = engines();
    engines.write(&folder.join("engines.obj"))?;
    hot.write(&folder.join("hot.obj"))?;
    field().write(&folder.join("field.obj"))?;
    plume::write(folder)?;
    gases::write(folder)?;
    let sky = Sky::read(&scene.join("spectra"), SUN_AZIMUTH)?;
    println!("{}: the sun's light travels along {}", folder.display(), -sky.sun);
    let steps = |from: u32, to: u32, step: usize| (from..=to).step_by(step).map(f64::from).collect::<Vec<_>>();
    sky.write_map(&folder.join("sky_visible.img"), [256, 128], &steps(380, 780, 10))?;
    sky.write_map(&folder.join("sky_infrared.img"), [96, 48], &steps(1500, 5500, 10))?;
    sky.write_sun(&folder.join("sun.csv"))
}

const RADIUS: f64 = 1.88;
const NOSE: f64 = 16.0;
const LENGTH: f64 = 34.0;

/// The fuselage at a share `t` of its length from the nose and an angle from starboard over the top.
fn fuselage(t: f64, angle: f64, lift: f64) -> DVec3 {
    let (nose, tail) = ((1.0 - t / 0.17).max(0.0), ((t - 0.66) / 0.34).max(0.0));
    let radius = RADIUS * (1.0 - nose.powf(2.1)).max(0.0).powf(0.55) * (1.0 - 0.93 * tail.powf(1.75)) + lift;
    let middle = -0.42 * nose.powf(1.6) + 1.25 * tail.powf(1.5);
    let (sin, cos) = angle.sin_cos();
    // A little higher than wide.
    dvec3(NOSE - LENGTH * t, middle + 1.04 * radius * sin, radius * cos)
}

/// A patch on the fuselage between two shares of its length and two angles, with rounded corners, `lift` m above it.
fn patch(t: [f64; 2], angle: [f64; 2], round: f64, n: [u32; 2]) -> Part {
    let part = grid(n[0], n[1], Wrap::Open, |u, v| {
        // The square onto a superellipse.
        let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
        let r = x.abs().max(y.abs());
        let angle_in = y.atan2(x);
        let (s, c) = angle_in.sin_cos();
        let q = if r == 0.0 { 0.0 } else { r / (c.abs().powf(round) + s.abs().powf(round)).powf(1.0 / round) };
        let at = |range: [f64; 2], k: f64| range[0] + (range[1] - range[0]) * (0.5 + 0.5 * k);
        fuselage(at(t, q * c), at(angle, q * s), 0.004)
    });
    // Outwards is away from the axis.
    let outwards: f64 = part
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| part.positions[i as usize]);
            (b - a).cross(c - a).dot(dvec3(0.0, a.y, a.z))
        })
        .sum();
    if outwards < 0.0 { part.flipped() } else { part }
}

/// A lifting surface through stations from root to tip.
struct Station {
    /// The leading edge.
    edge: DVec3,
    chord: f64,
    /// Thickness as a share of the chord.
    thickness: f64,
    /// Across the section, a unit vector.
    up: DVec3,
}

fn station(edge: [f64; 3], chord: f64, thickness: f64, up: [f64; 3]) -> Station {
    Station { edge: edge.into(), chord, thickness, up: DVec3::from(up).normalize() }
}

/// A NACA four-digit section with 2 % camber (Jacobs, Ward and Pinkerton, NACA report 460, 1933), lofted.
fn wing(stations: &[Station], around: u32, along: u32) -> Part {
    let spans = stations.len() as u32 - 1;
    let thick =
        |x: f64| 5.0 * (0.2969 * x.sqrt() - 0.126 * x - 0.3516 * x * x + 0.2843 * x.powi(3) - 0.1036 * x.powi(4));
    let camber = |x: f64| if x < 0.4 { 0.02 / 0.16 * (0.8 * x - x * x) } else { 0.02 / 0.36 * (0.2 + 0.8 * x - x * x) };
    let section = |u: f64, v: f64| {
        let s = v * f64::from(spans);
        let i = (s.floor() as usize).min(stations.len() - 2);
        let f = s - i as f64;
        let (a, b) = (&stations[i], &stations[i + 1]);
        // Once around: trailing edge, over the top, leading edge, below, back.
        let x = 0.5 * (1.0 + (TAU * u).cos());
        let side = if u <= 0.5 { 1.0 } else { -1.0 };
        let at = |k: &Station| {
            k.edge - dvec3(k.chord * x, 0.0, 0.0) + k.up * k.chord * (camber(x) + side * k.thickness * thick(x))
        };
        at(a).lerp(at(b), f)
    };
    let skin = grid(around, along * spans, Wrap::U, section);
    let cap = grid(around, 1, Wrap::U, |u, v| {
        let (top, below) = (section(u, 1.0), section(1.0 - u, 1.0));
        // v = 1 is the middle line of the tip.
        top.lerp((top + below) / 2.0, v)
    });
    skin.and(cap).outward()
}

fn mirrored(part: &Part) -> Part {
    part.clone().transformed(DAffine3::from_scale(dvec3(1.0, 1.0, -1.0)))
}

fn airframe() -> Mesh {
    let mut mesh = Mesh::default();
    let body = grid(144, 420, Wrap::U, |u, v| fuselage(v.powf(1.35) * 0.999 + 1e-4, -TAU * u - FRAC_PI_2, 0.0));
    let (belly, top) = body.outward().split(|p| p.y < -0.95 && p.x > -10.0);
    mesh.add("paint_grey", belly);
    mesh.add("paint_white", top);
    let exhaust = cushion(fuselage(0.999, 0.0, 0.0) * dvec3(1.0, 1.0, 0.0), dvec3(0.02, 0.12, 0.12), 1.0, 1.0, 20, 12);
    mesh.add("rubber", exhaust);
    for side in [1.0, -1.0] {
        let angles = |low: f64, high: f64| if side > 0.0 { [low, high] } else { [PI - low, PI - high] };
        // Cabin windows between the doors, doors, and the flight deck's.
        for k in 0..46 {
            let t = 0.17 + 0.0122 * f64::from(k);
            if !(20..=21).contains(&k) {
                mesh.add("window", patch([t, t + 0.0072], angles(0.13, 0.33), 3.0, [8, 8]));
            }
        }
        for t in [0.128, 0.735] {
            mesh.add("paint_blue", patch([t, t + 0.028], angles(-0.28, 0.75), 9.0, [12, 20]));
            mesh.add(
                "paint_white",
                patch([t + 0.0016, t + 0.0264], angles(-0.25, 0.72), 9.0, [12, 20]).moved(dvec3(
                    0.0,
                    0.0,
                    side * 0.003,
                )),
            );
        }
        for (a, b, low, high) in [(0.036, 0.054, 0.80, 1.33), (0.045, 0.061, 0.42, 0.76), (0.058, 0.075, 0.45, 0.74)] {
            mesh.add("window", patch([a, b], angles(low, high), 5.0, [14, 14]));
        }
        mesh.add("paint_blue", patch([0.06, 0.76], angles(-0.16, -0.06), 40.0, [400, 4]));
        mesh.add("paint_orange", patch([0.07, 0.74], angles(-0.215, -0.185), 40.0, [400, 2]));
        letters(&mut mesh, side);
    }
    // Wings with winglets, fairing, tail.
    let right = wing(
        &[
            station([4.6, -1.15, 1.0], 7.2, 0.15, [0.0, 1.0, 0.0]),
            station([1.7, -0.75, 5.6], 4.4, 0.12, [0.0, 1.0, -0.06]),
            station([-4.1, 0.25, 15.6], 1.85, 0.11, [0.0, 1.0, -0.08]),
            station([-4.5, 0.42, 16.3], 1.65, 0.11, [0.0, 1.0, -0.5]),
            station([-4.95, 0.95, 16.75], 1.4, 0.10, [0.0, 0.5, -1.0]),
            station([-6.0, 2.5, 17.1], 0.7, 0.09, [0.0, 0.2, -1.0]),
        ],
        96,
        28,
    );
    let (tip, plane) = right.split(|p| p.z > 16.55);
    let (edge, plane) = plane.split(|p| {
        // The leading edge: bare metal.
        let line = |z: f64| if z < 5.6 { 4.6 - 2.9 * (z - 1.0) / 4.6 } else { 1.7 - 0.58 * (z - 5.6) };
        p.x > line(p.z) - 0.22
    });
    for (material, part) in [("paint_blue", tip), ("aluminium", edge), ("paint_grey", plane)] {
        mesh.add(material, mirrored(&part));
        mesh.add(material, part);
    }
    mesh.add("paint_grey", cushion(dvec3(0.6, -1.35, 0.0), dvec3(5.6, 0.85, 2.05), 0.8, 0.9, 96, 40));
    let tailplane = wing(
        &[
            station([-13.4, 1.25, 0.3], 3.9, 0.11, [0.0, 1.0, 0.0]),
            station([-16.6, 1.75, 6.1], 1.5, 0.10, [0.0, 1.0, -0.05]),
        ],
        64,
        40,
    );
    mesh.add("paint_white", mirrored(&tailplane));
    mesh.add("paint_white", tailplane);
    let fin = wing(
        &[
            station([-9.2, 1.5, 0.0], 7.6, 0.035, [0.0, 0.0, 1.0]),
            station([-11.6, 2.7, 0.0], 5.6, 0.10, [0.0, 0.0, 1.0]),
            station([-15.9, 8.3, 0.0], 2.3, 0.09, [0.0, 0.0, 1.0]),
        ],
        80,
        40,
    );
    // A sash of orange across the blue fin.
    let sash = |p: DVec3| {
        let s = p.x + 0.55 * p.y;
        (-12.6..-11.5).contains(&s)
    };
    let (orange, blue) = fin.split(sash);
    mesh.add("paint_orange", orange);
    mesh.add("paint_blue", blue);
    mesh
}

/// SPECTILE along the cabin, in squares of a grid of 5 x 7.
fn letters(mesh: &mut Mesh, side: f64) {
    const FONT: [(char, [&str; 7]); 7] = [
        ('S', [" ####", "#    ", "#    ", " ### ", "    #", "    #", "#### "]),
        ('P', ["#### ", "#   #", "#   #", "#### ", "#    ", "#    ", "#    "]),
        ('E', ["#####", "#    ", "#    ", "#### ", "#    ", "#    ", "#####"]),
        ('C', [" ####", "#    ", "#    ", "#    ", "#    ", "#    ", " ####"]),
        ('T', ["#####", "  #  ", "  #  ", "  #  ", "  #  ", "  #  ", "  #  "]),
        ('I', ["#####", "  #  ", "  #  ", "  #  ", "  #  ", "  #  ", "#####"]),
        ('L', ["#    ", "#    ", "#    ", "#    ", "#    ", "#    ", "#####"]),
    ];
    let (step, rise) = (0.0052, 0.062);
    for (k, letter) in "SPECTILE".chars().enumerate() {
        let Some((_, rows)) = FONT.iter().find(|(name, _)| *name == letter) else { continue };
        for (row, line) in rows.iter().enumerate() {
            for (column, _) in line.chars().enumerate().filter(|(_, c)| *c == '#') {
                // Read from the nose on port, from the tail on starboard.
                let along = (k * 6 + column) as f64 * step;
                let t = if side > 0.0 { 0.715 - along } else { 0.445 + along };
                let t = [t, t + if side > 0.0 { -step } else { step }];
                let low = 0.41 + (6 - row) as f64 * rise;
                let angle = if side > 0.0 { [low, low + rise] } else { [PI - low, PI - low - rise] };
                mesh.add("paint_blue", patch(t, angle, 60.0, [2, 2]));
            }
        }
    }
}

/// From y as the axis of a lathe to an engine's: backwards from its lip.
fn engine_frame(side: f64) -> DAffine3 {
    DAffine3::from_translation(ENGINE * dvec3(1.0, 1.0, side)) * DAffine3::from_rotation_z(FRAC_PI_2)
}

fn smooth(points: &[(f64, f64)], count: usize) -> Vec<DVec2> {
    let points: Vec<_> = points.iter().map(|&(r, y)| dvec3(r, y, 0.0)).collect();
    super::shape::curve(&points, count).iter().map(|p| dvec2(p.x.max(0.0), p.y)).collect()
}

/// What is cold, and what is hot.
fn engines() -> (Mesh, Mesh) {
    let [mut cold, mut hot] = [(); 2].map(|()| Mesh::default());
    // The cowl's section, from inside the intake over the lip to the fan nozzle and back in.
    let lip = smooth(&[(0.84, 0.22), (0.845, 0.06), (0.90, 0.0), (0.97, 0.09), (1.02, 0.26)], 24);
    let cowl = smooth(&[(1.02, 0.26), (1.12, 0.9), (1.13, 1.7), (1.04, 2.8), (0.93, 3.5)], 40);
    let inside = smooth(&[(0.925, 3.5), (0.95, 3.2), (0.97, 2.6)], 12);
    let duct = smooth(&[(0.90, 1.0), (0.87, 0.6), (0.84, 0.22)], 12);
    let core = smooth(&[(0.66, 2.5), (0.68, 3.0), (0.60, 3.8), (0.475, 4.6)], 30);
    let nozzle = smooth(&[(0.475, 4.6), (0.46, 4.68), (0.45, 4.6), (0.47, 4.2), (0.5, 3.9)], 20);
    let plug = smooth(&[(0.30, 3.9), (0.30, 4.3), (0.22, 4.8), (0.08, 5.3), (0.0, 5.4)], 24);
    let spinner = smooth(&[(0.0, 0.5), (0.12, 0.62), (0.24, 0.86), (0.27, 1.0)], 16);
    for side in [1.0, -1.0] {
        let place = engine_frame(side);
        let mut add = |material: &str, part: Part| cold.add(material, part.transformed(place));
        add("aluminium", lathe(96, &[&lip]));
        add("paint_white", lathe(96, &[&cowl]));
        add("paint_grey", lathe(96, &[&inside]));
        add("aluminium", lathe(96, &[&duct]).flipped());
        add("rubber", lathe(48, &[&profile(&[(0.97, 2.6), (0.6, 2.6)])]).flipped());
        add("rubber", lathe(48, &[&profile(&[(0.9, 1.12), (0.0, 1.12)])]));
        add("titanium", lathe(48, &[&spinner]));
        for k in 0..24 {
            let turn = DAffine3::from_rotation_y(TAU * f64::from(k) / 24.0);
            let blade = grid(6, 16, Wrap::Open, |u, v| {
                let r = 0.25 + 0.64 * v;
                let pitch = (0.5 + 0.55 * v).min(1.05);
                let across = (u - 0.5) * (0.13 + 0.08 * v);
                dvec3(r, 0.99 + across * pitch.cos() * side, across * pitch.sin() + 0.05 * v * v)
            });
            add("titanium", blade.transformed(turn));
        }
        let pylon = wing(
            &[
                station([3.3, -1.0, ENGINE.z], 4.6, 0.075, [0.0, 0.0, 1.0]),
                station([2.3, -0.5, ENGINE.z], 4.4, 0.07, [0.0, 0.0, 1.0]),
            ],
            48,
            6,
        );
        cold.add("paint_white", if side > 0.0 { pylon } else { mirrored(&pylon) });
        // Cowl of the core, its nozzle, the plug, and the turbine behind them.
        hot.add("core_cowl", lathe(96, &[&core]).transformed(place));
        hot.add("nozzle", lathe(96, &[&nozzle]).transformed(place));
        hot.add("nozzle", lathe(64, &[&plug]).transformed(place));
        hot.add("turbine", lathe(64, &[&profile(&[(0.5, 3.9), (0.3, 3.9)])]).transformed(place));
    }
    (cold, hot)
}

/// Runway, markings, trees, hangars and a tower.
fn field() -> Mesh {
    let mut mesh = Mesh::default();
    let mut random = Random(4);
    let flat = |x: [f64; 2], z: [f64; 2], y: f64| {
        quad([dvec3(x[0], y, z[1]), dvec3(x[1], y, z[1]), dvec3(x[1], y, z[0]), dvec3(x[0], y, z[0])])
    };
    mesh.add("asphalt", flat([-340.0, 340.0], [-22.0, 22.0], 0.02));
    mesh.add("asphalt", flat([-340.0, 340.0], [-96.0, -78.0], 0.02));
    for k in -8..9 {
        let x = 40.0 * f64::from(k);
        mesh.add("marking", flat([x, x + 24.0], [-0.5, 0.5], 0.03));
    }
    for z in [-20.5, 20.5] {
        mesh.add("marking", flat([-340.0, 340.0], [z - 0.45, z + 0.45], 0.03));
    }
    // The field beyond, a little uneven where it is far.
    mesh.add(
        "grass",
        grid(96, 24, Wrap::U, |u, v| {
            let r = 400.0 * v.powf(1.6);
            let (s, c) = (TAU * u).sin_cos();
            let hills = (r - 120.0).max(0.0) * 0.012 * (1.0 + noise(dvec3(6.0 * c, 3.0 * s, 0.5)));
            dvec3(r * c, if r < 120.0 { 0.0 } else { hills }, -r * s)
        })
        .flipped(),
    );
    for k in 0..240 {
        let angle = TAU * f64::from(k) / 240.0 + random.between(-0.015, 0.015);
        let r = random.between(215.0, 330.0);
        let place = dvec3(r * angle.cos(), 0.8, r * angle.sin());
        if place.z.abs() < 45.0 {
            continue; // the runway goes on
        }
        let (height, seed) = (random.between(7.0, 16.0), f64::from(k) * 17.0);
        let crown = grid(20, 14, Wrap::U, |u, v| {
            let (s, c) = (TAU * u).sin_cos();
            let (sv, cv) = (PI * v).sin_cos();
            let d = dvec3(sv * c, -cv, -sv * s);
            d * (1.0 + 0.35 * noise(d * 2.2 + DVec3::splat(seed))) * dvec3(0.36, 0.42, 0.36) * height
        });
        mesh.add("trees", crown.moved(place + 0.62 * height * DVec3::Y));
        let trunk = [0.0, 0.2, 0.4].map(|h| place + h * height * DVec3::Y);
        mesh.add("soil", tube(&trunk, 8, |_| 0.03 * height));
    }
    for (x, wide) in [(60.0, 44.0), (118.0, 52.0), (186.0, 40.0)] {
        let z = -165.0;
        mesh.add("concrete", cuboid(dvec3(x, 0.0, z), dvec3(x + wide, 9.0, z + 40.0)));
        mesh.add(
            "roof",
            grid(32, 1, Wrap::Open, |u, v| {
                let (s, c) = (PI * u).sin_cos();
                dvec3(x + wide / 2.0 - (wide / 2.0 + 0.6) * c, 9.0 + 4.5 * s, z + 41.0 - 42.0 * v)
            }),
        );
        mesh.add("window", cuboid(dvec3(x + 4.0, 0.0, z + 40.0), dvec3(x + wide - 4.0, 7.5, z + 40.1)));
    }
    let tower = profile(&[(3.0, 0.0), (2.4, 24.0), (4.2, 27.0), (4.2, 27.6)]);
    let glass = profile(&[(4.2, 27.6), (4.9, 31.0)]);
    let cap = profile(&[(4.9, 31.0), (5.1, 31.4), (4.6, 32.0), (0.0, 32.6)]);
    let place = dvec3(20.0, 0.0, -150.0);
    mesh.add("concrete", lathe(48, &[&tower]).moved(place));
    mesh.add("window", lathe(12, &[&glass]).moved(place));
    mesh.add("paint_white", lathe(48, &[&cap]).moved(place));
    mesh
}
