//! Where camera rays start: a lens or a window, which boundaries of media may cut. Device units throughout.

use glam::{DVec2, DVec3};

use crate::device::accel::DeviceSpace;
use crate::device::words::Primitive;
use crate::scene::{Filter, Projection, Scene};

/// How thick a lens or window is taken to be: some ulp of an f32 near 1.
const THICKNESS: f64 = 1e-6;
/// Places among which that far from boundaries is chosen.
const PLACES: u32 = 256;

/// A rectangle that holds the origins of all camera rays.
pub struct Origins {
    center: DVec3,
    /// Unit vectors: right, up and forward.
    axes: [DVec3; 3],
    half_size: DVec3,
}

/// What a boundary may have in common with the rectangle.
#[derive(Debug)]
pub enum Cut {
    /// In the rectangle's coordinates.
    Polygon(Vec<DVec3>),
    Sphere {
        center: DVec3,
        radius: f64,
    },
}

impl Origins {
    /// `None` where all rays start in one point.
    pub fn of(scene: &Scene, space: &DeviceSpace) -> Option<Origins> {
        let camera = &scene.camera;
        let half_size = match camera.projection {
            // A line scanner has a track instead.
            Projection::Perspective { .. } | Projection::Latlong | Projection::Pushbroom { .. } => return None,
            Projection::ThinLens { aperture_radius, .. } => DVec2::splat(aperture_radius),
            Projection::Orthographic { half_size } => {
                let film = DVec2::new(f64::from(scene.film.width), f64::from(scene.film.height));
                // That filter reaches two pixels, of 2/film of the half size, beyond the film.
                let beyond = if scene.film.filter == Filter::Gaussian { 4.0 } else { 0.0 };
                half_size * (1.0 + beyond / film)
            }
        };
        Some(Origins {
            center: (camera.position - space.center) * space.scale,
            axes: [camera.right, camera.up, camera.forward],
            half_size: (half_size * space.scale).extend(THICKNESS),
        })
    }

    /// What `boundary` has in common with the rectangle; `None` where that is nothing.
    pub fn cut(&self, boundary: &Primitive) -> Option<Cut> {
        let [a, b, c] = [boundary.a, boundary.b, boundary.c].map(|v| DVec3::from(v.map(f64::from)));
        let own = |p: DVec3| DVec3::from(self.axes.map(|axis| axis.dot(p - self.center)));
        match boundary.tag >> 24 {
            0 => {
                let polygon = self.within([a, b, c].map(own).to_vec());
                (!polygon.is_empty()).then_some(Cut::Polygon(polygon))
            }
            1 => {
                let (center, radius) = (own(a), b.x);
                let nearest = center.clamp(-self.half_size, self.half_size);
                // The farthest corner.
                let farthest = -self.half_size * center.signum();
                let distances = center.distance(nearest)..=center.distance(farthest);
                distances.contains(&radius).then_some(Cut::Sphere { center, radius })
            }
            // What is filled is closed, so that neither a disk nor the wall of a cylinder bounds anything.
            _ => None,
        }
    }

    /// The part of a convex polygon within the rectangle (Sutherland and Hodgman 1974).
    fn within(&self, mut polygon: Vec<DVec3>) -> Vec<DVec3> {
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                let depth = |p: DVec3| self.half_size[axis] - side * p[axis];
                let mut kept = Vec::new();
                for (i, &from) in polygon.iter().enumerate() {
                    let to = polygon[(i + 1) % polygon.len()];
                    if depth(from) >= 0.0 {
                        kept.push(from);
                    }
                    if (depth(from) >= 0.0) != (depth(to) >= 0.0) {
                        kept.push(from.lerp(to, depth(from) / (depth(from) - depth(to))));
                    }
                }
                polygon = kept;
            }
        }
        polygon
    }

    /// A place in the rectangle as far from all `cuts` as any of some hundred.
    pub fn place_apart_from(&self, cuts: &[Cut]) -> DVec3 {
        let place = |i: u32| {
            // Roberts' sequence R2: even, and on no line that a model is likely to have.
            let at = |step: f64| 2.0 * (0.5 + step * f64::from(i)).fract() - 1.0;
            DVec3::new(at(0.754_877_666_246_693), at(0.569_840_290_998_053), 0.0) * self.half_size
        };
        let clearance = |p: DVec3| cuts.iter().map(|cut| cut.distance(p)).fold(f64::INFINITY, f64::min);
        let best = (1..=PLACES).map(place).max_by(|p, q| clearance(*p).total_cmp(&clearance(*q)));
        let [x, y, z] = best.unwrap_or_default().to_array();
        self.center + x * self.axes[0] + y * self.axes[1] + z * self.axes[2]
    }
}

impl Cut {
    /// From a place in the plane, both in the rectangle's coordinates.
    fn distance(&self, p: DVec3) -> f64 {
        match self {
            Cut::Sphere { center, radius } => (p.distance(*center) - radius).abs(),
            Cut::Polygon(corners) => {
                let edge = |i: usize| {
                    let (from, to) = (corners[i].truncate(), corners[(i + 1) % corners.len()].truncate());
                    let (along, off) = (to - from, p.truncate() - from);
                    let nearest = (off.dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
                    off.distance(nearest * along)
                };
                (0..corners.len()).map(edge).fold(f64::INFINITY, f64::min)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit() -> Origins {
        Origins { center: DVec3::ZERO, axes: DVec3::AXES, half_size: DVec3::new(1.0, 0.5, THICKNESS) }
    }

    fn triangle(corners: [[f32; 3]; 3]) -> Primitive {
        let [a, b, c] = corners;
        Primitive { a, b, c, ..bytemuck::Zeroable::zeroed() }
    }

    fn ball(center: [f32; 3], radius: f32) -> Primitive {
        Primitive { a: center, b: [radius, 0.0, 0.0], tag: 1 << 24, ..bytemuck::Zeroable::zeroed() }
    }

    /// Boundaries beside, before and around the rectangle do not cut it; those that go through any part of it do.
    #[test]
    fn what_cuts_a_window() {
        let upright = |x: f32, y: f32, z: f32| triangle([[x, y, z - 1.0], [x, y, z + 1.0], [x, y + 1.0, z]]);
        for (cuts, boundary) in [
            (true, upright(0.3, 0.0, 0.0)),
            (true, upright(0.99, 0.49, 0.0)),
            (false, upright(1.01, 0.0, 0.0)),
            (false, upright(0.3, 0.51, 0.0)),
            (false, upright(0.3, 0.0, 1.01)),
            // Its bounding box does, it does not.
            (false, triangle([[0.9, 2.0, -1.0], [3.0, 0.4, 1.0], [3.0, 2.0, 0.0]])),
            (false, ball([0.0; 3], 1.2)),
            (true, ball([0.0; 3], 1.1)),
            (true, ball([0.0; 3], 0.1)),
            (true, ball([1.5, 0.0, 0.2], 0.6)),
            (false, ball([1.5, 0.0, 0.2], 0.5)),
        ] {
            assert_eq!(unit().cut(&boundary).is_some(), cuts, "{boundary:?}");
        }
    }

    /// The place is in the rectangle, and as far from what cuts it in halves or thirds as that leaves room for, nearly.
    #[test]
    fn a_place_apart_from_boundaries() {
        let walls = [-0.4f32, 0.4].map(|x| triangle([[x, -9.0, -9.0], [x, 9.0, -9.0], [x, 0.0, 9.0]]));
        let cuts: Vec<Cut> = walls.iter().filter_map(|wall| unit().cut(wall)).collect();
        let place = unit().place_apart_from(&cuts);
        assert!(cuts.len() == 2 && place.x.abs() <= 1.0 && place.y.abs() <= 0.5 && place.z == 0.0, "{place}");
        assert!(((place.x.abs() - 0.4).abs() - 0.6).abs() < 0.02, "{place}");
    }
}
