//! Reflection by a boundary, smooth or of microfacets, and metals.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec3;

use super::ggx::Ggx;
use super::{Choice, Lobe, Vertex, cosine_density, cosine_direction, fresnel};
use crate::scene::SpectrumId;
use crate::spectral::hemisphere::ReflectionAlbedo;
use crate::spectral::hemisphere::fresnel::mean_conductor;

/// What reflects: F at the cosine between direction and normal, and what the lobe as a whole reflects.
pub trait Boundary: Send + Sync {
    fn reflectance(&self, at: &Vertex, cosine: f64, k: usize) -> f64;

    /// Directional albedo of the lobe, for decisions.
    fn albedo(&self, at: &Vertex, k: usize) -> f64 {
        self.reflectance(at, at.o.z, k)
    }
}

/// The mirror.
pub struct Mirror<B>(pub B);

impl<B: Boundary> Lobe for Mirror<B> {
    fn albedo(&self, at: &Vertex, k: usize) -> f64 {
        self.0.albedo(at, k)
    }

    fn sample(&self, at: &Vertex, _u: [f64; 3]) -> Option<Choice> {
        Some(Choice::Only { direction: DVec3::new(-at.o.x, -at.o.y, at.o.z), channel: None })
    }

    fn evaluate(&self, _at: &Vertex, _i: DVec3, _scale: f64, _out: &mut [f64]) {}

    fn density(&self, _at: &Vertex, _i: DVec3) -> f64 {
        0.0
    }

    fn factor(&self, at: &Vertex, k: usize) -> f64 {
        self.0.reflectance(at, at.o.z, k)
    }
}

/// Single reflection by microfacets (Walter et al. 2007, eq. 20, correlated by height): F D G2 / (4 cosθ_o cosθ_i).
pub struct RoughMirror<B> {
    pub boundary: B,
    pub ggx: Ggx,
}

impl<B: Boundary> Lobe for RoughMirror<B> {
    fn albedo(&self, at: &Vertex, k: usize) -> f64 {
        self.boundary.albedo(at, k)
    }

    fn sample(&self, at: &Vertex, u: [f64; 3]) -> Option<Choice> {
        let h = self.ggx.visible_normal(at.o, [u[1], u[2]]);
        reflected(at.o, h).map(Choice::Spread)
    }

    fn evaluate(&self, at: &Vertex, i: DVec3, scale: f64, out: &mut [f64]) {
        if i.z <= 0.0 {
            return;
        }
        let h = (at.o + i).normalize();
        let common = scale * self.ggx.distribution(h) * self.ggx.both_visible(at.o, i) / (4.0 * at.o.z);
        for k in at.alive.clone() {
            out[k] += common * self.boundary.reflectance(at, at.o.dot(h), k);
        }
    }

    fn density(&self, at: &Vertex, i: DVec3) -> f64 {
        if i.z <= 0.0 {
            return 0.0;
        }
        let h = (at.o + i).normalize();
        self.ggx.visible_density(at.o, h) / (4.0 * at.o.dot(h))
    }
}

/// `o` mirrored by a facet of normal `h`; `None` where that leads below the surface.
pub fn reflected(o: DVec3, h: DVec3) -> Option<DVec3> {
    let i = 2.0 * o.dot(h) * h - o;
    (i.z > 0.0).then_some(i)
}

/// A metal: a mirror, or microfacets and, with `compensation`, what they scatter more than once.
pub fn conductor(
    eta: SpectrumId,
    k: SpectrumId,
    roughness: Option<[f64; 2]>,
    compensation: bool,
) -> Vec<Box<dyn Lobe>> {
    let Some(alpha) = roughness else { return vec![Box::new(Mirror(Metal { eta, k, albedo: None }))] };
    let albedo = ReflectionAlbedo::shared(alpha);
    let metal = Metal { eta, k, albedo: Some(Arc::clone(&albedo)) };
    let mut lobes: Vec<Box<dyn Lobe>> = vec![Box::new(RoughMirror { boundary: metal, ggx: Ggx { alpha } })];
    if compensation {
        lobes.push(Box::new(MetalAgain { eta, k, albedo }));
    }
    lobes
}

struct Metal {
    eta: SpectrumId,
    k: SpectrumId,
    /// Where rough.
    albedo: Option<Arc<ReflectionAlbedo>>,
}

impl Boundary for Metal {
    fn reflectance(&self, at: &Vertex, cosine: f64, k: usize) -> f64 {
        fresnel::conductor(cosine, at.spectra.value(self.eta, k), at.spectra.value(self.k, k))
    }

    fn albedo(&self, at: &Vertex, k: usize) -> f64 {
        let masked = self.albedo.as_ref().map_or(0.0, |albedo| albedo.loss(at.o));
        self.reflectance(at, at.o.z, k) * (1.0 - masked)
    }
}

/// What the microfacets of a metal scatter more than once: F_ms (1 - E(o)) (1 - E(i)) / (π (1 - E_avg)), E the albedo of
/// single scattering without loss, F_ms = F² E_avg / (1 - F (1 - E_avg)), F the hemispherical mean reflectance (Kulla
/// and Conty 2017, "Revisiting physically based shading at Imageworks"). Reciprocal; white where F is 1.
struct MetalAgain {
    eta: SpectrumId,
    k: SpectrumId,
    albedo: Arc<ReflectionAlbedo>,
}

impl MetalAgain {
    fn reflectance(&self, at: &Vertex, k: usize) -> f64 {
        let f = mean_conductor(at.spectra.value(self.eta, k), at.spectra.value(self.k, k));
        let lost = self.albedo.mean_loss();
        f * f * (1.0 - lost) / (1.0 - f * lost)
    }
}

impl Lobe for MetalAgain {
    fn albedo(&self, at: &Vertex, k: usize) -> f64 {
        self.reflectance(at, k) * self.albedo.loss(at.o)
    }

    fn sample(&self, _at: &Vertex, u: [f64; 3]) -> Option<Choice> {
        Some(Choice::Spread(cosine_direction([u[1], u[2]])))
    }

    fn evaluate(&self, at: &Vertex, i: DVec3, scale: f64, out: &mut [f64]) {
        if i.z <= 0.0 {
            return;
        }
        let lost = self.albedo.loss(at.o) * self.albedo.loss(i) / self.albedo.mean_loss();
        let common = scale * lost * i.z / PI;
        for k in at.alive.clone() {
            out[k] += common * self.reflectance(at, k);
        }
    }

    fn density(&self, _at: &Vertex, i: DVec3) -> f64 {
        cosine_density(i)
    }
}
