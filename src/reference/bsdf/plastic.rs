//! A diffuse base under a dielectric coat.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec3;

use super::ggx::Ggx;
use super::reflection::{Boundary, Mirror, RoughMirror};
use super::{Choice, Lobe, Vertex, cosine_density, cosine_direction, fresnel};
use crate::scene::{Reflectance, SpectrumId};
use crate::spectral::hemisphere::CoatAlbedo;
use crate::spectral::hemisphere::fresnel::mean_dielectric;

/// The coat's reflection, and what comes out of the base; `range` bounds the coat's index.
pub fn lobes(
    reflectance: Reflectance,
    eta: SpectrumId,
    range: [f64; 2],
    roughness: Option<[f64; 2]>,
) -> Vec<Box<dyn Lobe>> {
    let rough = roughness.map(|[alpha, _]| CoatAlbedo::shared(alpha, range));
    let coat = Coat { eta, rough };
    let base = Box::new(Base { reflectance, coat: coat.clone() });
    match roughness {
        None => vec![Box::new(Mirror(coat)), base],
        Some(alpha) => vec![Box::new(RoughMirror { boundary: coat, ggx: Ggx { alpha } }), base],
    }
}

/// The surface of the coat, of index at least 1.
#[derive(Clone)]
struct Coat {
    eta: SpectrumId,
    rough: Option<Arc<CoatAlbedo>>,
}

impl Coat {
    /// What is reflected of light along a direction of cosine `z`.
    fn reflected(&self, at: &Vertex, z: f64, k: usize) -> f64 {
        let eta = at.spectra.value(self.eta, k);
        match &self.rough {
            None => fresnel::dielectric(z, eta),
            Some(table) => table.reflected(eta, z),
        }
    }

    fn mean_reflected(&self, at: &Vertex, k: usize) -> f64 {
        let eta = at.spectra.value(self.eta, k);
        match &self.rough {
            None => mean_dielectric(eta),
            Some(table) => table.mean_reflected(eta),
        }
    }
}

impl Boundary for Coat {
    fn reflectance(&self, at: &Vertex, cosine: f64, k: usize) -> f64 {
        fresnel::dielectric(cosine, at.spectra.value(self.eta, k))
    }

    fn albedo(&self, at: &Vertex, k: usize) -> f64 {
        self.reflected(at, at.o.z, k)
    }
}

/// What the coat does not reflect enters (t(z) = 1 - R(z), R by single scattering where rough), meets a Lambertian base of
/// reflectance ρ, and of what that sends up the fraction τ leaves, the rest comes back to the base, and so on:
///
/// f = t(o) t(i) / (π t_avg) · ρ τ / (1 - ρ (1 - τ)), τ = t_avg / η², t_avg the hemispherical mean of t,
///
/// τ by reciprocity of the surface (Walsh 1926; summed as in Saunderson 1942, with the light between base and coat taken
/// as diffuse). Reciprocal, and white with a white base under every coat. A rough coat's own multiple scattering goes
/// into the base.
struct Base {
    reflectance: Reflectance,
    coat: Coat,
}

impl Base {
    /// ρ τ / (1 - ρ (1 - τ)), and t_avg.
    fn inner(&self, at: &Vertex, k: usize) -> (f64, f64) {
        let (rho, eta) = (at.spectra.reflectance(self.reflectance, k), at.spectra.value(self.coat.eta, k));
        let mean = 1.0 - self.coat.mean_reflected(at, k);
        let leaves = mean / (eta * eta);
        (rho * leaves / (1.0 - rho * (1.0 - leaves)), mean)
    }

    fn enters(&self, at: &Vertex, z: f64, k: usize) -> f64 {
        1.0 - self.coat.reflected(at, z, k)
    }
}

impl Lobe for Base {
    fn albedo(&self, at: &Vertex, k: usize) -> f64 {
        self.enters(at, at.o.z, k) * self.inner(at, k).0
    }

    fn sample(&self, _at: &Vertex, u: [f64; 3]) -> Option<Choice> {
        Some(Choice::Spread(cosine_direction([u[1], u[2]])))
    }

    fn evaluate(&self, at: &Vertex, i: DVec3, scale: f64, out: &mut [f64]) {
        if i.z <= 0.0 {
            return;
        }
        for k in at.alive.clone() {
            let (albedo, mean) = self.inner(at, k);
            out[k] += scale * self.enters(at, at.o.z, k) * self.enters(at, i.z, k) / mean * albedo * i.z / PI;
        }
    }

    fn density(&self, _at: &Vertex, i: DVec3) -> f64 {
        cosine_density(i)
    }
}
