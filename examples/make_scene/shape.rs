//! Shapes as parts: grids over two parameters, solids of revolution, tubes, boxes, cushions, convex polyhedra.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec2, DVec3, dvec2, dvec3};

use super::mesh::Part;

/// How a grid closes.
#[derive(Clone, Copy, PartialEq)]
pub enum Wrap {
    Open,
    /// The last column is the first.
    U,
    /// The last row is the first, too.
    Both,
}

/// The surface p(u, v) over [0, 1]² in `nu` x `nv` quadrilaterals, its front where du x dv points; smooth normals, and
/// (u, v) as texture coordinates.
pub fn grid(nu: u32, nv: u32, wrap: Wrap, p: impl Fn(f64, f64) -> DVec3) -> Part {
    let mut part = Part::default();
    for j in 0..=nv {
        for i in 0..=nu {
            // Where it closes, the very same point, bit for bit.
            let at = |k: u32, n: u32, wraps: bool| if wraps && k == n { 0.0 } else { f64::from(k) / f64::from(n) };
            part.positions.push(p(at(i, nu, wrap != Wrap::Open), at(j, nv, wrap == Wrap::Both)));
            part.uvs.push(dvec2(f64::from(i) / f64::from(nu), f64::from(j) / f64::from(nv)));
        }
    }
    for j in 0..nv {
        for i in 0..nu {
            let a = j * (nu + 1) + i;
            let [b, c, d] = [a + 1, a + nu + 2, a + nu + 1];
            part.triangle([a, b, c]);
            part.triangle([a, c, d]);
        }
    }
    part.smooth()
}

/// Revolves pieces of a profile (radius, height) about the y axis; pieces meet in sharp edges. Fronts face outwards
/// where the profile climbs.
pub fn lathe(segments: u32, pieces: &[&[DVec2]]) -> Part {
    let part = pieces
        .iter()
        .map(|piece| {
            let rows = (piece.len() - 1) as u32;
            grid(segments, rows, Wrap::U, |u, v| {
                let q = piece[(v * f64::from(rows)).round() as usize];
                let (sin, cos) = (TAU * u).sin_cos();
                dvec3(q.x * cos, q.y, -q.x * sin)
            })
        })
        .reduce(Part::and);
    part.unwrap_or_default()
}

/// Points of a profile from numbers.
pub fn profile(points: &[(f64, f64)]) -> Vec<DVec2> {
    points.iter().map(|&(r, y)| dvec2(r, y)).collect()
}

/// `count` points on the Catmull-Rom curve through `points`, ends included (Catmull and Rom 1974).
pub fn curve(points: &[DVec3], count: usize) -> Vec<DVec3> {
    let last = points.len() - 1;
    let point = |i: isize| points[i.clamp(0, last as isize) as usize];
    (0..count)
        .map(|k| {
            let t = k as f64 / (count - 1) as f64 * last as f64;
            let i = (t.floor() as usize).min(last - 1) as isize;
            let f = t - i as f64;
            let [a, b, c, d] = [-1, 0, 1, 2].map(|o| point(i + o));
            0.5 * (2.0 * b
                + (c - a) * f
                + (2.0 * a - 5.0 * b + 4.0 * c - d) * f * f
                + (3.0 * (b - c) + d - a) * f * f * f)
        })
        .collect()
}

/// A tube along `path` with rounded-off (closed) ends; `radius` over the share of the way.
pub fn tube(path: &[DVec3], segments: u32, radius: impl Fn(f64) -> f64) -> Part {
    let last = path.len() - 1;
    // The frame is carried along with the least turn, so the tube does not twist.
    let mut frames: Vec<(DVec3, DVec3)> = Vec::new();
    let mut side = (path[1] - path[0]).any_orthogonal_vector().normalize();
    for i in 0..=last {
        let along = (path[(i + 1).min(last)] - path[i.saturating_sub(1)]).normalize();
        side = (side - along * along.dot(side)).normalize();
        frames.push((side, along.cross(side)));
    }
    let side = grid(segments, last as u32, Wrap::U, |u, v| {
        let i = (v * last as f64).round() as usize;
        let (sin, cos) = (TAU * u).sin_cos();
        path[i] + radius(v) * (frames[i].0 * cos + frames[i].1 * sin)
    });
    let cap = |i: usize, v: f64| {
        grid(segments, 1, Wrap::U, |u, t| {
            let (sin, cos) = (TAU * u).sin_cos();
            path[i] + t * radius(v) * (frames[i].0 * cos + frames[i].1 * sin)
        })
    };
    side.and(cap(0, 0.0)).and(cap(last, 1.0).flipped())
}

/// A closed tube along a closed path, `path(t)` over [0, 1].
pub fn ring(count: u32, segments: u32, radius: f64, path: impl Fn(f64) -> DVec3) -> Part {
    grid(segments, count, Wrap::Both, |u, v| {
        let step = 1e-4;
        let along = (path(v + step) - path(v - step)).normalize();
        // Any field of directions that never is parallel to the path and closes with it.
        let bend = path(v + step) + path(v - step) - 2.0 * path(v);
        let side = (bend - along * along.dot(bend)).normalize();
        let (sin, cos) = (TAU * u).sin_cos();
        path(v) + radius * (side * cos + along.cross(side) * sin)
    })
    .outward()
}

/// A box with flat sides.
pub fn cuboid(min: DVec3, max: DVec3) -> Part {
    let corner = |i: usize| dvec3([min, max][i & 1].x, [min, max][i >> 1 & 1].y, [min, max][i >> 2 & 1].z);
    // Counter-clockwise seen from outside.
    const SIDES: [[usize; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    SIDES.map(|side| quad(side.map(corner))).into_iter().reduce(Part::and).unwrap_or_default()
}

/// A flat quadrilateral, counter-clockwise seen from the front, u along its first edge.
pub fn quad(corners: [DVec3; 4]) -> Part {
    let normal = (corners[1] - corners[0]).cross(corners[3] - corners[0]).normalize();
    Part {
        positions: corners.to_vec(),
        normals: vec![normal; 4],
        uvs: vec![dvec2(0.0, 0.0), dvec2(1.0, 0.0), dvec2(1.0, 1.0), dvec2(0.0, 1.0)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

/// A superellipsoid: exponents 1 give an ellipsoid, small ones a box with rounded edges (Barr 1981).
pub fn cushion(centre: DVec3, radii: DVec3, vertical: f64, horizontal: f64, nu: u32, nv: u32) -> Part {
    let power = |x: f64, e: f64| x.signum() * x.abs().powf(e);
    // Parameters are spread so that the rounded edges get more than their share.
    let angle = |t: f64, e: f64| {
        let quarter = (t * 4.0).fract();
        let bent = if e < 1.0 { 0.5 - 0.5 * (PI * quarter).cos() } else { quarter };
        ((t * 4.0).floor() + (quarter + bent) / 2.0) / 4.0 * TAU
    };
    grid(nu, nv, Wrap::U, |u, v| {
        let (s, c) = angle(u, horizontal).sin_cos();
        let (sv, cv) = if v == 0.0 {
            (-1.0, 0.0)
        } else if v == 1.0 {
            (1.0, 0.0)
        } else {
            (angle(v / 2.0, vertical) - PI / 2.0).sin_cos()
        };
        let ring = power(cv, vertical);
        centre + radii * dvec3(ring * power(c, horizontal), power(sv, vertical), -ring * power(s, horizontal))
    })
}

pub fn sphere(centre: DVec3, radius: f64, nu: u32, nv: u32) -> Part {
    cushion(centre, DVec3::splat(radius), 1.0, 1.0, nu, nv)
}

/// The polyhedron of all points p with n . p <= d for every plane (n, d); it must be bounded. Flat facets.
pub fn polyhedron(planes: &[(DVec3, f64)]) -> Part {
    const NEAR: f64 = 1e-9;
    let mut corners: Vec<DVec3> = Vec::new();
    for (i, a) in planes.iter().enumerate() {
        for (j, b) in planes.iter().enumerate().skip(i + 1) {
            for c in &planes[j + 1..] {
                let matrix = DMat3::from_cols(a.0, b.0, c.0).transpose();
                if matrix.determinant().abs() < 1e-7 {
                    continue;
                }
                let p = matrix.inverse() * dvec3(a.1, b.1, c.1);
                let inside = planes.iter().all(|(n, d)| n.dot(p) <= d + NEAR);
                if inside && corners.iter().all(|q| q.distance(p) > 1e-7) {
                    corners.push(p);
                }
            }
        }
    }
    let mut part = Part::default();
    for (normal, d) in planes {
        let mut face: Vec<DVec3> = corners.iter().copied().filter(|p| (normal.dot(*p) - d).abs() < 1e-7).collect();
        if face.len() < 3 {
            continue;
        }
        let centre = face.iter().sum::<DVec3>() / face.len() as f64;
        let x = normal.any_orthonormal_vector();
        let angle = |p: &DVec3| normal.cross(x).dot(*p - centre).atan2(x.dot(*p - centre));
        face.sort_by(|p, q| angle(p).total_cmp(&angle(q)));
        let first = part.positions.len() as u32;
        part.positions.extend(&face);
        for k in 1..face.len() as u32 - 1 {
            part.triangle([first, first + k, first + k + 1]);
        }
    }
    part
}

/// SplitMix64 (Steele, Lea and Flood 2014): the same numbers on every machine.
pub struct Random(pub u64);

impl Random {
    /// Uniform in [a, b).
    pub fn between(&mut self, a: f64, b: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        a + (b - a) * ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn index(&mut self, count: usize) -> usize {
        (self.between(0.0, count as f64) as usize).min(count - 1)
    }
}
