//! One analytic surface in f64: intersection, bounds, area and uniform sampling.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::rng::Rng;

/// A half line; `direction` has unit length, so `t` is a distance in metres.
#[derive(Debug, Clone, Copy)]
pub struct Ray {
    pub origin: DVec3,
    pub direction: DVec3,
}

/// A point of a surface with its unit geometric normal (counter-clockwise side of a triangle, outward of closed
/// shapes).
#[derive(Debug, Clone, Copy)]
pub struct SurfacePoint {
    pub position: DVec3,
    pub normal: DVec3,
}

/// Geometry of one primitive. Unit vectors and lengths are prepared once.
#[derive(Debug, Clone)]
pub enum Surface {
    Triangle { vertex: DVec3, edge1: DVec3, edge2: DVec3, normal: DVec3 },
    Sphere { center: DVec3, radius: f64 },
    Disk { center: DVec3, normal: DVec3, radius: f64 },
    Cylinder { from: DVec3, axis: DVec3, length: f64, radius: f64 },
}

impl Surface {
    /// `None` where the three corners span no area.
    pub fn triangle([a, b, c]: [DVec3; 3]) -> Option<Self> {
        let (edge1, edge2) = (b - a, c - a);
        let normal = edge1.cross(edge2).try_normalize()?;
        Some(Surface::Triangle { vertex: a, edge1, edge2, normal })
    }

    /// Area in m².
    pub fn area(&self) -> f64 {
        match *self {
            Surface::Triangle { edge1, edge2, .. } => 0.5 * edge1.cross(edge2).length(),
            Surface::Sphere { radius, .. } => 4.0 * PI * radius * radius,
            Surface::Disk { radius, .. } => PI * radius * radius,
            Surface::Cylinder { length, radius, .. } => TAU * radius * length,
        }
    }

    /// The tight axis-aligned box, as its two corners.
    pub fn bounds(&self) -> [DVec3; 2] {
        // Half extent of a circle of unit radius about `n`, along each axis.
        let circle = |n: DVec3| (DVec3::ONE - n * n).max(DVec3::ZERO).map(f64::sqrt);
        match *self {
            Surface::Triangle { vertex, edge1, edge2, .. } => {
                let (b, c) = (vertex + edge1, vertex + edge2);
                [vertex.min(b).min(c), vertex.max(b).max(c)]
            }
            Surface::Sphere { center, radius } => [center - radius, center + radius],
            Surface::Disk { center, normal, radius } => {
                let half = radius * circle(normal);
                [center - half, center + half]
            }
            Surface::Cylinder { from, axis, length, radius } => {
                let (to, half) = (from + length * axis, radius * circle(axis));
                [from.min(to) - half, from.max(to) + half]
            }
        }
    }

    /// The smallest t in (0, t_max) at which the ray meets the surface, from either side.
    pub fn intersect(&self, ray: &Ray, t_max: f64) -> Option<f64> {
        let inside = |t: &f64| *t > 0.0 && *t < t_max;
        match *self {
            Surface::Triangle { vertex, edge1, edge2, .. } => {
                // Möller and Trumbore 1997: Cramer's rule for (t, u, v), without culling.
                let p = ray.direction.cross(edge2);
                let det = edge1.dot(p);
                if det == 0.0 {
                    return None;
                }
                let s = ray.origin - vertex;
                let u = s.dot(p) / det;
                let q = s.cross(edge1);
                let v = ray.direction.dot(q) / det;
                if !(u >= 0.0 && v >= 0.0 && u + v <= 1.0) {
                    return None;
                }
                Some(edge2.dot(q) / det).filter(inside)
            }
            Surface::Sphere { center, radius } => {
                let s = ray.origin - center;
                circle_roots(s, ray.direction, radius)?.into_iter().find(inside)
            }
            Surface::Disk { center, normal, radius } => {
                let t = (center - ray.origin).dot(normal) / ray.direction.dot(normal);
                let offset = ray.origin + t * ray.direction - center;
                Some(t).filter(inside).filter(|_| offset.length_squared() <= radius * radius)
            }
            Surface::Cylinder { from, axis, length, radius } => {
                let s = ray.origin - from;
                let across = |v: DVec3| v - v.dot(axis) * axis;
                circle_roots(across(s), across(ray.direction), radius)?.into_iter().filter(inside).find(|t| {
                    let height = (s + *t * ray.direction).dot(axis);
                    (0.0..=length).contains(&height)
                })
            }
        }
    }

    /// `position`, found along a ray, moved onto the surface again: what is left of its error no longer grows with
    /// the distance travelled.
    pub fn project(&self, position: DVec3) -> SurfacePoint {
        match *self {
            Surface::Triangle { vertex, normal, .. } => {
                SurfacePoint { position: position - (position - vertex).dot(normal) * normal, normal }
            }
            Surface::Disk { center, normal, .. } => {
                SurfacePoint { position: position - (position - center).dot(normal) * normal, normal }
            }
            Surface::Sphere { center, radius } => {
                let normal = (position - center).normalize_or_zero();
                SurfacePoint { position: center + radius * normal, normal }
            }
            Surface::Cylinder { from, axis, radius, .. } => {
                let foot = from + (position - from).dot(axis) * axis;
                let normal = (position - foot).normalize_or_zero();
                SurfacePoint { position: foot + radius * normal, normal }
            }
        }
    }

    /// A unit vector along the surface at one of its points, as `scene::Shape` has it: the direction of the first of two
    /// roughnesses. Any on a sphere.
    pub fn tangent(&self, point: &SurfacePoint) -> DVec3 {
        let around = |axis: DVec3, middle: DVec3| axis.cross(point.position - middle).try_normalize();
        let tangent = match *self {
            Surface::Triangle { edge1, .. } => edge1.try_normalize(),
            Surface::Sphere { .. } => None,
            Surface::Disk { center, normal, .. } => around(normal, center),
            Surface::Cylinder { from, axis, .. } => around(axis, from),
        };
        tangent.unwrap_or_else(|| point.normal.any_orthonormal_vector())
    }

    /// A point chosen uniformly by area.
    pub fn sample(&self, rng: &mut Rng) -> SurfacePoint {
        match *self {
            Surface::Triangle { vertex, edge1, edge2, normal } => {
                let (root, v) = (rng.uniform().sqrt(), rng.uniform());
                SurfacePoint { position: vertex + (root * (1.0 - v)) * edge1 + (root * v) * edge2, normal }
            }
            Surface::Sphere { center, radius } => {
                // Archimedes: the height of a uniform point is uniform.
                let (z, angle) = (2.0 * rng.uniform() - 1.0, TAU * rng.uniform());
                let across = (1.0 - z * z).max(0.0).sqrt();
                let normal = DVec3::new(across * angle.cos(), across * angle.sin(), z);
                SurfacePoint { position: center + radius * normal, normal }
            }
            Surface::Disk { center, normal, radius } => {
                let (u, v) = normal.any_orthonormal_pair();
                let [x, y] = rng.unit_disk();
                SurfacePoint { position: center + radius * (x * u + y * v), normal }
            }
            Surface::Cylinder { from, axis, length, radius } => {
                let (u, v) = axis.any_orthonormal_pair();
                let (height, angle) = (length * rng.uniform(), TAU * rng.uniform());
                let normal = angle.cos() * u + angle.sin() * v;
                SurfacePoint { position: from + height * axis + radius * normal, normal }
            }
        }
    }
}

/// Both t, ascending, at which |s + t d| = radius; `None` where the line misses.
///
/// The constant term is a product of sums and the discriminant is taken at the point closest to the centre, so
/// neither cancels for rays that start close to the surface or far away from it (Haines, Günther, Akenine-Möller,
/// Ray Tracing Gems, chapter 7).
fn circle_roots(s: DVec3, d: DVec3, radius: f64) -> Option<[f64; 2]> {
    let a = d.length_squared();
    if a == 0.0 {
        return None;
    }
    let b = s.dot(d);
    let closest = s - (b / a) * d;
    let discriminant = a * (radius - closest.length()) * (radius + closest.length());
    if discriminant < 0.0 {
        return None;
    }
    let c = (s.length() - radius) * (s.length() + radius);
    let q = -(b + discriminant.sqrt().copysign(b));
    if q == 0.0 {
        return Some([0.0, 0.0]);
    }
    let (t0, t1) = (q / a, c / q);
    Some([t0.min(t1), t0.max(t1)])
}

#[cfg(test)]
mod tests {
    use super::*;

    pub fn surfaces() -> Vec<Surface> {
        let n = DVec3::new(1.0, -2.0, 0.5).normalize();
        vec![
            Surface::triangle([DVec3::new(0.3, 0.0, -1.0), DVec3::new(2.0, 0.5, 0.0), DVec3::new(-1.0, 1.5, 0.7)])
                .unwrap(),
            Surface::Sphere { center: DVec3::new(0.5, -0.2, 0.1), radius: 1.3 },
            Surface::Disk { center: DVec3::new(0.5, -0.2, 0.1), normal: n, radius: 1.3 },
            Surface::Cylinder { from: DVec3::new(0.5, -0.2, 0.1), axis: n, length: 2.0, radius: 0.7 },
        ]
    }

    /// A ray aimed at a sampled point meets the surface there, or earlier on the near side of a round shape; what it
    /// meets lies on the surface and in its bounds.
    #[test]
    fn rays_meet_sampled_points() {
        let mut rng = Rng::from_keys(&[1]);
        for surface in surfaces() {
            let convex_once = matches!(surface, Surface::Triangle { .. } | Surface::Disk { .. });
            let [low, high] = surface.bounds();
            for _ in 0..2000 {
                let target = surface.sample(&mut rng);
                assert!((surface.project(target.position).position - target.position).length() < 1e-14);
                assert!((surface.project(target.position).normal - target.normal).length() < 1e-14);
                assert!(target.position.cmpge(low - 1e-14).all() && target.position.cmple(high + 1e-14).all());
                let origin = 5.0 * DVec3::from_array(std::array::from_fn(|_| rng.normal()));
                let distance = (target.position - origin).length();
                let ray = Ray { origin, direction: (target.position - origin) / distance };
                // A point within rounding of the rim may be missed, which is no error.
                let Some(t) = surface.intersect(&ray, f64::INFINITY) else { continue };
                assert!(t <= distance * (1.0 + 1e-9));
                assert!(!convex_once || (t - distance).abs() < 1e-9 * distance);
                let met = ray.origin + t * ray.direction;
                assert!((surface.project(met).position - met).length() < 1e-12 * (1.0 + distance));
                assert_eq!(surface.intersect(&ray, t), None, "t_max is exclusive");
            }
        }
    }

    /// Sampled points fill the area evenly: their centroid is that of the surface, within 5 standard errors.
    #[test]
    fn samples_are_uniform() {
        const N: usize = 40_000;
        let mut rng = Rng::from_keys(&[2]);
        for surface in surfaces() {
            let centroid = match surface {
                Surface::Triangle { vertex, edge1, edge2, .. } => vertex + (edge1 + edge2) / 3.0,
                Surface::Sphere { center, .. } | Surface::Disk { center, .. } => center,
                Surface::Cylinder { from, axis, length, .. } => from + 0.5 * length * axis,
            };
            let points: Vec<DVec3> = (0..N).map(|_| surface.sample(&mut rng).position - centroid).collect();
            let mean = points.iter().sum::<DVec3>() / N as f64;
            let variance = points.iter().map(|p| *p * *p).sum::<DVec3>() / N as f64;
            let bound = 5.0 * (variance / N as f64).map(f64::sqrt);
            assert!(mean.abs().cmple(bound).all(), "{surface:?}: {mean} beyond {bound}");
        }
    }

    /// Tangents are unit vectors along the surface: along the first edge, or around the axis.
    #[test]
    fn tangents_lie_on_the_surface() {
        let mut rng = Rng::from_keys(&[5]);
        for surface in surfaces() {
            for _ in 0..100 {
                let point = surface.sample(&mut rng);
                let tangent = surface.tangent(&point);
                assert!((tangent.length() - 1.0).abs() < 1e-12 && tangent.dot(point.normal).abs() < 1e-12);
                let across = match surface {
                    Surface::Triangle { edge1, .. } => tangent.cross(edge1).length(),
                    Surface::Disk { center, .. } => tangent.dot(point.position - center).abs(),
                    Surface::Cylinder { axis, .. } => tangent.dot(axis).abs(),
                    Surface::Sphere { .. } => 0.0,
                };
                assert!(across < 1e-12, "{surface:?}");
            }
        }
    }

    /// Distances worked out by hand, from outside, inside and behind.
    #[test]
    fn known_distances() {
        let ray = |o: [f64; 3], d: [f64; 3]| Ray { origin: o.into(), direction: DVec3::from(d).normalize() };
        let met = |s: &Surface, r: &Ray| s.intersect(r, f64::INFINITY);
        let sphere = Surface::Sphere { center: DVec3::ZERO, radius: 2.0 };
        assert_eq!(met(&sphere, &ray([-5.0, 0.0, 0.0], [1.0, 0.0, 0.0])), Some(3.0));
        assert_eq!(met(&sphere, &ray([0.0; 3], [0.0, 1.0, 0.0])), Some(2.0));
        assert_eq!(met(&sphere, &ray([5.0, 0.0, 0.0], [1.0, 0.0, 0.0])), None);
        assert_eq!(met(&sphere, &ray([-5.0, 2.5, 0.0], [1.0, 0.0, 0.0])), None);
        let tube = Surface::Cylinder { from: DVec3::ZERO, axis: DVec3::Z, length: 1.0, radius: 1.0 };
        assert_eq!(met(&tube, &ray([-3.0, 0.0, 0.5], [1.0, 0.0, 0.0])), Some(2.0));
        assert_eq!(met(&tube, &ray([0.0, 0.0, 0.5], [0.0, -1.0, 0.0])), Some(1.0));
        assert_eq!(met(&tube, &ray([-3.0, 0.0, 1.5], [1.0, 0.0, 0.0])), None);
        assert_eq!(met(&tube, &ray([0.0, 0.0, -3.0], [0.0, 0.0, 1.0])), None, "along the axis, through the open ends");
        // Enters over the rim (outside the wall's height) and meets the far wall from inside at height 0.5.
        let over = met(&tube, &ray([-2.0, 0.0, 2.0], [3.0, 0.0, -1.5])).unwrap();
        assert!((over - (9.0f64 + 2.25).sqrt()).abs() < 1e-14);
        let disk = Surface::Disk { center: DVec3::Z, normal: DVec3::Z, radius: 1.0 };
        assert_eq!(met(&disk, &ray([0.5, 0.0, 0.0], [0.0, 0.0, 1.0])), Some(1.0));
        assert_eq!(met(&disk, &ray([1.5, 0.0, 0.0], [0.0, 0.0, 1.0])), None);
        assert_eq!(met(&disk, &ray([0.0, 0.0, 1.0], [1.0, 0.0, 0.0])), None, "within the plane");
    }

    /// A ray that starts δR inside a sphere keeps its near root behind it and its far root exact, at any size and down
    /// to grazing angles. δ itself is known to ε/δ = 1e-4 only.
    #[test]
    fn roots_do_not_cancel() {
        const DELTA: f64 = 1e-12;
        for radius in [1e-6, 1.0, 1e6] {
            for cosine in [1e-6, 1e-3, 0.5] {
                let d = DVec3::new((1.0f64 - cosine * cosine).sqrt(), 0.0, -cosine);
                let s = DVec3::new(0.0, 0.0, radius * (1.0 - DELTA));
                let [near, far] = circle_roots(s, d, radius).unwrap();
                let root = (cosine * cosine + 2.0 * DELTA).sqrt();
                let (expected_far, expected_near) = (radius * (cosine + root), -2.0 * radius * DELTA / (cosine + root));
                assert!((near / expected_near - 1.0).abs() < 2e-4, "{radius} {cosine}: {near} {expected_near}");
                assert!((far / expected_far - 1.0).abs() < 2e-4, "{radius} {cosine}: {far} {expected_far}");
            }
        }
    }
}
