//! How the renderer aims at lights, against geometry and densities: chi-square.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3};

use super::chi_square::{check, p_value};
use super::probe::{Aimed, Aiming, SAMPLES, bin, random};
use super::{Bench, Case};
use crate::Result;
use crate::device::prepared::Prepared;
use crate::scene::{Environment, EnvironmentMap, Texels};

pub const CASES: &[Case] = &[Case {
    group: "sampling",
    name: "aiming",
    what: "points on lamps of every shape from 5 places, 5 suns, 5 maps: chi-square, and densities against geometry",
    run: aiming,
}];

/// A lamp's cells of equal share, and rings and sectors of a round one.
const CELLS: usize = 64;
const ROUND: usize = 8;

/// A lamp as the device has it.
#[derive(Clone, Copy)]
enum Lamp {
    Triangle,
    Disk,
    Cylinder,
    Sphere,
}

impl Lamp {
    /// In which of its cells the point `p` is that was chosen from `from`, and the density by solid angle that geometry gives it. `a`,
    /// `b`, `c`: the device's numbers of the primitive.
    fn cell_and_density(self, [a, b, c]: [DVec3; 3], area: f64, p: DVec3, from: DVec3) -> (usize, f64) {
        let by_area = |normal: DVec3| {
            let way = p - from;
            way.length_squared() / (area * way.normalize().dot(normal).abs())
        };
        let round = |share: f64, off: DVec3, axis: DVec3| ring_and_sector(share, off, axis.normalize(), ROUND);
        match self {
            Lamp::Triangle => {
                let (u, v) = (b - a, c - a);
                let normal = u.cross(v);
                // Barycentric coordinates, and the row of small triangles in which they are.
                let n = normal.length_squared();
                let x = (p - a).cross(v).dot(normal) / n;
                let y = u.cross(p - a).dot(normal) / n;
                let [x, y] = [x, y].map(|w| ROUND as f64 * w.clamp(0.0, 0.999_999));
                let (column, row) = (x.floor() as usize, y.floor() as usize);
                let upper = usize::from(x.fract() + y.fract() > 1.0);
                // Row j has 2 (8 - j) - 1 of them.
                let cell = row * (2 * ROUND - row) + (2 * column + upper).min(2 * (ROUND - row) - 2);
                (cell.min(CELLS - 1), by_area(normal.normalize()))
            }
            Lamp::Disk => (round((p - a).length_squared() / c.x.powi(2), p - a, b), by_area(b)),
            Lamp::Cylinder => {
                let axis = b - a;
                let along = (p - a).dot(axis) / axis.length_squared();
                let off = p - a - along * axis;
                (round(along, off, axis), by_area(off.normalize()))
            }
            Lamp::Sphere => {
                // Uniform in the cone that it fills.
                let axis = a - from;
                let cap = 1.0 - (1.0 - b.x.powi(2) / axis.length_squared()).sqrt();
                (in_cone((p - from).normalize(), axis.normalize(), cap, ROUND), 1.0 / (TAU * cap))
            }
        }
    }
}

/// The cell of what is at `share` of [`ROUND`] rings, by its angle about `axis` among so many sectors.
fn ring_and_sector(share: f64, off: DVec3, axis: DVec3, sectors: usize) -> usize {
    let (s, t) = axis.any_orthonormal_pair();
    bin(share, ROUND) * sectors + bin(0.5 + off.dot(t).atan2(off.dot(s)) / TAU, sectors)
}

/// The same of a direction in a cone about `axis` with 1 - cos of its half angle `cap`, rings of equal solid angle.
fn in_cone(way: DVec3, axis: DVec3, cap: f64, sectors: usize) -> usize {
    ring_and_sector(0.5 * way.distance_squared(axis) / cap, way, axis, sectors)
}

fn lamps(bench: &mut Bench, tests: usize) -> Result<()> {
    let places = [[0.4, 0.3, 3.0], [2.0, 0.0, 1.0], [-1.0, -2.5, 0.7], [0.1, 0.0, 2.2], [-3.0, 2.0, -1.5]];
    for (lamp, name, shape) in [
        (Lamp::Triangle, "a triangle", "quad = { corner = [-0.5, -0.5, 0], edge_u = [1, 0, 0], edge_v = [0.3, 1, 0] }"),
        (Lamp::Disk, "a disk", "disk = { center = [0, 0, 0], normal = [0.3, 0.2, 1], radius = 0.7 }"),
        (Lamp::Cylinder, "a cylinder", "cylinder = { from = [-0.5, 0.2, 0], to = [0.6, 0, 0.3], radius = 0.4 }"),
        (Lamp::Sphere, "a sphere", "sphere = { center = [0.1, 0.1, 0], radius = 0.6 }"),
    ] {
        // The mirror makes the scene a general one.
        let scene = bench.scene(&format!(
            "[materials.m.conductor]\neta = 0.2\nk = 3.4\n[materials.b.black]\n[[objects]]\n{shape}\nmaterial = \"b\"\nemission = 1\n\
             emission_sides = \"both\"\n[[objects]]\nsphere = {{ center = [0, 0, -9], radius = 1 }}\nmaterial = \"m\"\n"
        ))?;
        let prepared = Prepared::new(&scene, 0)?;
        let emitter = prepared.emitters[0];
        let primitive = prepared.accel.primitives[emitter.primitive as usize];
        let numbers = [primitive.a, primitive.b, primitive.c].map(|v| DVec3::from_array(v.map(f64::from)));
        let kernel = Aiming::new(&bench.machine().gpu, &prepared)?;
        let (mut least, mut off) = (1.0f64, 0.0f64);
        for (seed, place) in places.iter().enumerate() {
            let from = DVec3::from_array(prepared.accel.space.point(DVec3::from_array(*place)).map(f64::from));
            let mut counts = vec![0.0; CELLS];
            for (point, density) in kernel.aim(from, &random(SAMPLES, seed as u32))? {
                let (cell, expected) = lamp.cell_and_density(numbers, f64::from(emitter.area), point, from);
                counts[cell] += 1.0;
                // The cosine of a grazing angle is what rounding makes it.
                if density > 0.0 && density < 100.0 {
                    off = off.max((density / expected - 1.0).abs());
                }
            }
            least = least.min(p_value(&counts, &[f64::from(SAMPLES) / CELLS as f64; CELLS]));
        }
        check(bench, name.to_owned(), least, tests);
        bench.check_within(format!("{name}: densities, relative"), 0.0, (off, 0.0), 1e-3);
    }
    Ok(())
}

fn suns(bench: &mut Bench, tests: usize) -> Result<()> {
    const SECTORS: usize = 12;
    for (case, (degrees, axis)) in [
        (0.01f64, DVec3::Z),
        (0.2665, DVec3::new(1.0, 2.0, 3.0)),
        (5.0, DVec3::NEG_Y),
        (45.0, DVec3::new(-1.0, 0.1, 0.0)),
        (90.0, DVec3::new(0.3, -0.4, -0.5)),
    ]
    .into_iter()
    .enumerate()
    {
        let to = -axis;
        let scene = bench.scene(&format!(
            "[materials.b.black]\n[[objects]]\nsphere = {{ center = [0, 0, 0], radius = 1 }}\nmaterial = \"b\"\n\
             [[lights]]\nsun = {{ direction = [{:?}, {:?}, {:?}], angular_radius = {degrees}, irradiance = 1 }}\n",
            to.x, to.y, to.z
        ))?;
        let prepared = Prepared::new(&scene, 0)?;
        let kernel = Aiming::new(&bench.machine().gpu, &prepared)?;
        let chosen = kernel.aim(DVec3::ZERO, &random(SAMPLES, 10 + case as u32))?;
        // The device's axis is one of f32, up to 6e-8 off: as much as the finest disk's rings tell apart is 100 times that.
        let axis = axis.normalize().as_vec3().as_dvec3().normalize();
        let cap = 2.0 * (0.5 * degrees.to_radians()).sin().powi(2);
        let (mut counts, mut off) = (vec![0.0; ROUND * SECTORS], 0.0f64);
        for (d, density) in &chosen {
            off = off.max((density * TAU * cap - 1.0).abs());
            counts[in_cone(d.normalize(), axis, cap, SECTORS)] += 1.0;
        }
        let each = f64::from(SAMPLES) / (ROUND * SECTORS) as f64;
        let name = format!("a sun of {degrees}°");
        check(bench, name.clone(), p_value(&counts, &[each; ROUND * SECTORS]), tests);
        bench.check_within(format!("{name}: densities, relative"), 0.0, (off, 0.0), 1e-5);
        // Met where it is aimed at: all but the rim, which f32 blurs.
        let directions: Vec<DVec3> = chosen.iter().map(|(d, _)| *d).collect();
        let missed = kernel.densities(&directions)?.iter().filter(|density| **density < 0.0).count();
        bench.check_within(
            format!("{name}: share not met again"),
            0.0,
            (missed as f64 / f64::from(SAMPLES), 0.0),
            0.01,
        );
    }
    Ok(())
}

/// Directions of maps against the density that the device gives for them, integrated over the cells between texel centres.
fn maps(bench: &mut Bench, tests: usize) -> Result<()> {
    const POINTS: usize = 12;
    for (case, [width, height]) in [[6usize, 4usize], [8, 5], [16, 8], [1, 7], [9, 1]].into_iter().enumerate() {
        let value = |t: usize| match (case, t) {
            (0, _) => 1.0,
            (1, 19) => 1e4,
            (1, _) => 0.0,
            _ => (t * t % 17) as f32,
        };
        let radiance: Vec<f32> = (0..width * height).flat_map(|t| [value(t); 2]).collect();
        let to_map = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -2.0) / 3.0, case as f64);
        let mut scene = bench.scene(
            "[materials.b.black]\n[[objects]]\nsphere = { center = [0, 0, 0], radius = 1 }\nmaterial = \"b\"\n",
        )?;
        let texels = Texels::Spectral { nm: vec![300.0, 800.0], radiance: radiance.into() };
        let size = [width as u32, height as u32];
        scene.environment =
            Some(Environment::Map(EnvironmentMap { name: "a map".into(), to_map, scale: 1.0, size, texels }));
        let prepared = Prepared::new(&scene, 0)?;

        // Points in every cell, and what each stands for in solid angle.
        let mut points = Vec::new();
        for row in 0..=height {
            let [top, bottom] = [row as f64 - 0.5, row as f64 + 0.5].map(|edge| (edge / height as f64).clamp(0.0, 1.0));
            for column in 0..width {
                for k in 0..POINTS * POINTS {
                    let [x, y] = [k % POINTS, k / POINTS].map(|i| (i as f64 + 0.5) / POINTS as f64);
                    let (u, v) = ((column as f64 + 0.5 + x) / width as f64, top + y * (bottom - top));
                    let area = TAU / width as f64 * PI * (bottom - top) / (POINTS * POINTS) as f64;
                    let (phi, theta) = (TAU * (u - 0.5), PI * v);
                    let m = DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
                    points.push((to_map.transpose() * m, area * theta.sin()));
                }
            }
        }
        let kernel = Aiming::new(&bench.machine().gpu, &prepared)?;
        let densities = kernel.densities(&points.iter().map(|(direction, _)| *direction).collect::<Vec<_>>())?;
        let shares: Vec<f64> = densities
            .chunks(POINTS * POINTS)
            .zip(points.chunks(POINTS * POINTS))
            .map(|(densities, points)| densities.iter().zip(points).map(|(density, (_, area))| density * area).sum())
            .collect();
        // Between four texels of which one shines it is bright all over.
        let shines = |cell: usize| {
            let (row, column) = (cell / width, cell % width);
            let rows = [row.saturating_sub(1), row.min(height - 1)];
            rows.iter().any(|row| [column, (column + 1) % width].iter().any(|column| value(row * width + column) > 0.0))
        };
        let cells = densities.chunks(POINTS * POINTS).enumerate();
        let never: usize =
            cells.filter(|(cell, _)| shines(*cell)).map(|(_, d)| d.iter().filter(|d| **d <= 0.0).count()).sum();
        let chosen: Vec<Aimed> = kernel.aim(DVec3::ZERO, &random(SAMPLES, case as u32))?;
        let mut counts = vec![0.0; shares.len()];
        for (direction, _) in &chosen {
            let m = to_map * *direction;
            let (u, v) = (0.5 + m.x.atan2(-m.z) / TAU, m.x.hypot(m.z).atan2(m.y) / PI);
            let column = (u * width as f64 - 0.5).rem_euclid(width as f64) as usize % width;
            counts[((v * height as f64 + 0.5) as usize).min(height) * width + column] += 1.0;
        }
        let expected: Vec<f64> = shares.iter().map(|share| share * f64::from(SAMPLES)).collect();
        let name = format!("a map of {width} x {height}");
        check(bench, name.clone(), p_value(&counts, &expected), tests);
        // Midpoints of a density that is bilinear over 1 / sin, times sin: exact but for f32.
        bench.check_within(format!("{name}: integral of its density"), 1.0, (shares.iter().sum(), 0.0), 1e-4);
        bench.check_within(format!("{name}: bright points never aimed at"), 0.0, (never as f64, 0.0), 0.0);
        // The same density where a direction is found again; f32 directions blur it beside the poles and edges.
        let found = kernel.densities(&chosen.iter().map(|(direction, _)| *direction).collect::<Vec<_>>())?;
        let off = chosen.iter().zip(&found).filter(|((_, own), again)| (*again / own - 1.0).abs() > 1e-3).count();
        let off = off as f64 / f64::from(SAMPLES);
        bench.check_within(format!("{name}: share of other densities when met again"), 0.0, (off, 0.0), 1e-3);
    }
    Ok(())
}

fn aiming(bench: &mut Bench) -> Result<()> {
    let tests = 4 * 5 + 5 + 5;
    lamps(bench, tests)?;
    suns(bench, tests)?;
    maps(bench, tests)
}
