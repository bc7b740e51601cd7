//! What a surface carries beside its geometry, at a point: texture coordinates, shading normal, tangent.

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::{DMat3, DVec2, DVec3};

use super::primitive::{Surface, SurfacePoint};
use super::world::Primitive;
use crate::scene::Attributes;

/// How near to the viewer's horizon a shading normal may come: the cosine between both.
const LEAST_COSINE: f64 = 0.01;

pub struct Shading {
    /// (0, 0) where the surface has none.
    pub uv: DVec2,
    /// Unit, on the front; `None` where that is the geometric one.
    normal: Option<DVec3>,
    /// Unit, along the surface.
    tangent: DVec3,
}

impl Shading {
    pub fn new(attributes: &Attributes, primitive: &Primitive, point: &SurfacePoint) -> Self {
        let (p, axes) = (point.position, attributes.axes);
        let own = primitive.surface.tangent(point);
        let round = |q: DVec3, v: f64| DVec2::new(0.5 + q.x.atan2(q.z) / TAU, v);
        let (mut uv, mut normal, mut tangent) = (DVec2::ZERO, None, own);
        match primitive.surface {
            Surface::Triangle { vertex, edge1, edge2, normal: geometric } => {
                let n = edge1.cross(edge2);
                let share = |a: DVec3, b: DVec3| a.cross(b).dot(n) / n.length_squared();
                let (b, c) = (share(p - vertex, edge2), share(edge1, p - vertex));
                let at = [1.0 - b - c, b, c];
                if let Some(corners) = &attributes.uv {
                    let [t0, t1, t2] = corners[primitive.triangle];
                    uv = at[0] * t0 + at[1] * t1 + at[2] * t2;
                    let (d1, d2) = (t1 - t0, t2 - t0);
                    // Cramer's rule for dp/du.
                    let growing = (d2.y * edge1 - d1.y * edge2) * d1.perp_dot(d2).signum();
                    if d1.perp_dot(d2) != 0.0 {
                        tangent = growing.try_normalize().unwrap_or(own);
                    }
                }
                if let Some(corners) = &attributes.normals {
                    let sum: DVec3 = corners[primitive.triangle].iter().zip(at).map(|(n, share)| share * *n).sum();
                    normal = sum.try_normalize().filter(|n| n.dot(geometric) > 0.0);
                }
            }
            Surface::Sphere { .. } => {
                if let Some(axes) = axes {
                    let q = axes.transpose() * point.normal;
                    uv = round(q, 0.5 + q.y.clamp(-1.0, 1.0).asin() * FRAC_1_PI);
                    tangent = axes.y_axis.cross(point.normal).try_normalize().unwrap_or(own);
                }
            }
            Surface::Disk { center, radius, .. } => {
                if let Some(axes) = axes {
                    let q = axes.transpose() * (p - center) / radius;
                    uv = round(q, 1.0 - q.length());
                }
            }
            Surface::Cylinder { from, length, .. } => {
                if let Some(axes) = axes {
                    let q = axes.transpose() * (p - from);
                    uv = round(q, q.y / length);
                }
            }
        }
        Shading { uv, normal, tangent }
    }

    /// Tangent, bitangent and the normal that light sees, on the side of `geometric` (unit), from where `o` (unit) leads
    /// away. A shading normal that `o` is behind, as happens on silhouettes, is bent towards it.
    pub fn frame(&self, geometric: DVec3, inside: bool, o: DVec3) -> DMat3 {
        let normal = match self.normal {
            None => geometric,
            Some(normal) => {
                let normal = if inside { -normal } else { normal };
                let missing = LEAST_COSINE - o.dot(normal);
                if missing > 0.0 { (normal + missing * o).normalize() } else { normal }
            }
        };
        let along = self.tangent - self.tangent.dot(normal) * normal;
        let tangent = along.try_normalize().unwrap_or_else(|| normal.any_orthonormal_vector());
        DMat3::from_cols(tangent, normal.cross(tangent), normal)
    }

    /// Whether light that leaves along `direction` is on the same side of the surface as of its shading normal: no light
    /// is reflected into a surface or passes to where it came from.
    pub fn keeps_side(&self, geometric: DVec3, frame: &DMat3, direction: DVec3) -> bool {
        self.normal.is_none() || geometric.dot(direction) * frame.z_axis.dot(direction) > 0.0
    }
}
