//! The surface where a function of space is zero, by surface nets (Gibson, MICCAI 1998): a vertex in each cell of a
//! grid that the surface crosses, pulled onto it; and solids to put such functions together.

use std::collections::HashMap;

use glam::{DVec3, dvec3};

use super::mesh::Part;

/// Distance to a segment's neighbourhood.
pub fn capsule(p: DVec3, a: DVec3, b: DVec3, radius: f64) -> f64 {
    let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
    p.distance(a.lerp(b, t)) - radius
}

/// About the distance to an ellipsoid, right to first order at its surface.
pub fn ellipsoid(p: DVec3, radii: DVec3) -> f64 {
    let k = (p / radii).length();
    let gradient = (p / (radii * radii)).length();
    if gradient == 0.0 { -radii.min_element() } else { k * (k - 1.0) / gradient }
}

/// A union whose seam is filled over the length `k`: the polynomial smooth minimum.
pub fn blend(a: f64, b: f64, k: f64) -> f64 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - 0.25 * h * h * k
}

/// Meshes `f` = 0 in a box, `f` < 0 being inside, with cells of side `step`; normals are the gradient of `f`.
pub fn mesh(f: impl Fn(DVec3) -> f64, [min, max]: [DVec3; 2], step: f64) -> Part {
    let n = ((max - min) / step).ceil();
    let [nx, ny, nz] = [n.x as i32, n.y as i32, n.z as i32];
    let at = |i: i32, j: i32, k: i32| min + step * dvec3(f64::from(i), f64::from(j), f64::from(k));
    let index = |i: i32, j: i32, k: i32| ((k * (ny + 1) + j) * (nx + 1) + i) as usize;
    let mut values = Vec::with_capacity(index(nx, ny, nz) + 1);
    for k in 0..=nz {
        for j in 0..=ny {
            values.extend((0..=nx).map(|i| f(at(i, j, k))));
        }
    }
    let inside = |i: i32, j: i32, k: i32| values[index(i, j, k)] < 0.0;
    let gradient = |p: DVec3| {
        let h = 1e-5;
        let axis = |d: DVec3| (f(p + d) - f(p - d)) / (2.0 * h);
        dvec3(axis(h * DVec3::X), axis(h * DVec3::Y), axis(h * DVec3::Z))
    };

    // A vertex where a cell has corners of both kinds.
    let mut part = Part::default();
    let mut vertices = HashMap::new();
    for k in 0..nz {
        for j in 0..ny {
            for i in 0..nx {
                let corners = (0..8).map(|c| inside(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)));
                let count = corners.filter(|c| *c).count();
                if count == 0 || count == 8 {
                    continue;
                }
                let mut p = at(i, j, k) + DVec3::splat(step / 2.0);
                for _ in 0..6 {
                    let g = gradient(p);
                    p -= (f(p) * g / g.length_squared().max(1e-12)).clamp_length_max(step / 2.0);
                }
                vertices.insert((i, j, k), part.positions.len() as u32);
                part.positions.push(p);
                part.normals.push(gradient(p).normalize_or(DVec3::Y));
            }
        }
    }
    // A quadrilateral for each edge of the grid that crosses the surface, of the four cells around it.
    for k in 1..nz {
        for j in 1..ny {
            for i in 1..nx {
                let here = inside(i, j, k);
                let around = [
                    (inside(i + 1, j, k), [(i, j - 1, k - 1), (i, j, k - 1), (i, j, k), (i, j - 1, k)]),
                    (inside(i, j + 1, k), [(i - 1, j, k - 1), (i - 1, j, k), (i, j, k), (i, j, k - 1)]),
                    (inside(i, j, k + 1), [(i - 1, j - 1, k), (i, j - 1, k), (i, j, k), (i - 1, j, k)]),
                ];
                for (there, cells) in around.into_iter().filter(|(there, _)| *there != here) {
                    let mut v = cells.map(|cell| vertices[&cell]);
                    if there {
                        v.reverse();
                    }
                    part.triangle([v[0], v[1], v[2]]);
                    part.triangle([v[0], v[2], v[3]]);
                }
            }
        }
    }
    part
}
