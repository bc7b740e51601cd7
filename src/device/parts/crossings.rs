//! Where straight lines cross primitives, in f64 and device units: what lies around a place is found by that.

use glam::DVec3;

use crate::device::words::Primitive;

/// A point on a primitive.
pub fn place_on(p: &Primitive) -> DVec3 {
    let [a, b, c] = [p.a, p.b, p.c].map(|v| DVec3::from(v.map(f64::from)));
    match p.tag >> 24 {
        1 => a + b.x * DVec3::Z,
        2 => a,
        3 => 0.5 * (a + b) + c.x * (b - a).any_orthogonal_vector().normalize(),
        _ => (a + b + c) / 3.0,
    }
}

/// Tells `crossing` where a ray meets a primitive, and whether it leaves what is behind it.
pub fn meet(p: &Primitive, origin: DVec3, direction: DVec3, crossing: &mut impl FnMut(f64, bool)) {
    let [a, b, c] = [p.a, p.b, p.c].map(|v| DVec3::from(v.map(f64::from)));
    let mut found = |t: f64, normal: DVec3| {
        if t > 0.0 {
            crossing(t, normal.dot(direction) > 0.0);
        }
    };
    let f = origin - a;
    match p.tag >> 24 {
        1 => {
            let (half, rest) = (f.dot(direction), f.length_squared() - b.x * b.x);
            let square = half * half - rest;
            if square > 0.0 {
                for t in [-half - square.sqrt(), -half + square.sqrt()] {
                    found(t, f + t * direction);
                }
            }
        }
        2 => {
            let t = -f.dot(b) / direction.dot(b);
            if (f + t * direction).length() <= c.x {
                found(t, b);
            }
        }
        3 => {
            let axis = (b - a).normalize();
            let across = |v: DVec3| v - v.dot(axis) * axis;
            let (g, d) = (across(f), across(direction));
            let (half, dd) = (g.dot(d), d.length_squared());
            let square = half * half - dd * (g.length_squared() - c.x * c.x);
            if square > 0.0 && dd > 0.0 {
                for t in [(-half - square.sqrt()) / dd, (-half + square.sqrt()) / dd] {
                    if (0.0..=(b - a).length()).contains(&(f + t * direction).dot(axis)) {
                        found(t, g + t * d);
                    }
                }
            }
        }
        _ => {
            // Möller and Trumbore 1997.
            let (e1, e2) = (b - a, c - a);
            let h = direction.cross(e2);
            let determinant = e1.dot(h);
            let u = f.dot(h) / determinant;
            let q = f.cross(e1);
            let v = direction.dot(q) / determinant;
            if determinant != 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0 {
                found(e2.dot(q) / determinant, e1.cross(e2));
            }
        }
    }
}
