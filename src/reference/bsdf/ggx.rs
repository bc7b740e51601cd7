//! The GGX distribution of microfacet normals (Trowbridge and Reitz 1975; Walter et al. 2007), anisotropic, with Smith's
//! masking.
//!
//! For f32: Λ as a quotient (below) and not √(1 + a²) - 1; D through slopes x/α, y/α, so that nothing cancels at normal
//! incidence; the height of a visible normal's point as a difference from the cap's lower end.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

/// Roughness α along x and y, both above 0.
#[derive(Debug, Clone, Copy)]
pub struct Ggx {
    pub alpha: [f64; 2],
}

impl Ggx {
    /// Density of normals D(h), h.z > 0; ∫ D cosθ dω = 1.
    pub fn distribution(&self, h: DVec3) -> f64 {
        let [ax, ay] = self.alpha;
        let stretched = (h.x / ax).powi(2) + (h.y / ay).powi(2) + h.z * h.z;
        1.0 / (PI * ax * ay * stretched * stretched)
    }

    /// Smith's Λ of a direction on either side.
    fn lambda(&self, v: DVec3) -> f64 {
        let slope2 = ((self.alpha[0] * v.x).powi(2) + (self.alpha[1] * v.y).powi(2)) / (v.z * v.z);
        if slope2.is_finite() { 0.5 * slope2 / (1.0 + (1.0 + slope2).sqrt()) } else { f64::INFINITY }
    }

    /// The fraction of microfacets seen from `v` that nothing hides.
    pub fn visible(&self, v: DVec3) -> f64 {
        1.0 / (1.0 + self.lambda(v))
    }

    /// The fraction visible from both of two directions on one side: correlated by height (Heitz 2014, eq. 99).
    pub fn both_visible(&self, o: DVec3, i: DVec3) -> f64 {
        1.0 / (1.0 + self.lambda(o) + self.lambda(i))
    }

    /// Density of the normals that [`Ggx::visible_normal`] chooses.
    pub fn visible_density(&self, o: DVec3, h: DVec3) -> f64 {
        self.visible(o) * self.distribution(h) * o.dot(h).max(0.0) / o.z
    }

    /// A normal as seen from `o` (Dupuy and Benyoub 2023: normals of a round distribution are halfway between `o` and a
    /// point of a spherical cap).
    pub fn visible_normal(&self, o: DVec3, u: [f64; 2]) -> DVec3 {
        let [ax, ay] = self.alpha;
        let round = DVec3::new(ax * o.x, ay * o.y, o.z).normalize();
        let height = (1.0 - u[0]) * (1.0 + round.z);
        let z = height - round.z;
        let (r, angle) = (((1.0 - z) * (1.0 + z)).max(0.0).sqrt(), TAU * u[1]);
        DVec3::new(ax * (r * angle.cos() + round.x), ay * (r * angle.sin() + round.y), height).normalize()
    }
}
