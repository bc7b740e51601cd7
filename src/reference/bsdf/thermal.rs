//! What a hot surface emits: ε(λ, ω) B(λ, T), ε = 1 - what the surface sends on of flux along ω, of its own BSDF.

use std::f64::consts::TAU;
use std::sync::Arc;

use super::{Vertex, fresnel};
use crate::scene::{Bsdf as Description, Material, Reflectance, SMOOTH, Scene, SpectrumId, Temperature, TextureId};
use crate::spectral::hemisphere::fresnel::{mean_conductor, mean_dielectric};
use crate::spectral::hemisphere::{
    CoatAlbedo, FACET_COSINES, FacetCosines, ReflectionAlbedo, facet_cosine, index_range,
};
use crate::spectral::planck;

/// One material, of a blend or by itself, at a temperature.
pub struct Hot {
    /// Share of a blend.
    pub weight: f64,
    /// Shares by texture, or what they leave.
    shares: Vec<(TextureId, bool)>,
    temperature: Temperature,
    /// Whether its back is as its front; otherwise it is black.
    pub two_sided: bool,
    absorber: Absorber,
}

/// Where light stays in a surface.
enum Absorber {
    Black,
    Diffuse {
        reflectance: Reflectance,
    },
    Translucent {
        reflectance: Reflectance,
        transmittance: Reflectance,
    },
    Mirror {
        eta: SpectrumId,
        k: SpectrumId,
    },
    RoughMetal {
        eta: SpectrumId,
        k: SpectrumId,
        facets: Arc<FacetCosines>,
        /// With energy compensation.
        again: Option<Arc<ReflectionAlbedo>>,
    },
    Varnish {
        reflectance: Reflectance,
        eta: SpectrumId,
    },
    RoughPlastic {
        reflectance: Reflectance,
        eta: SpectrumId,
        facets: Arc<FacetCosines>,
        /// As the base has it.
        coat: Arc<CoatAlbedo>,
    },
}

impl Hot {
    /// `None` for what absorbs nothing.
    pub fn new(
        scene: &Scene,
        material: &Material,
        weight: f64,
        shares: &[(TextureId, bool)],
        temperature: Temperature,
    ) -> Option<Self> {
        let absorber = match material.bsdf {
            Description::Black => Absorber::Black,
            Description::Diffuse { reflectance } => Absorber::Diffuse { reflectance },
            Description::Translucent { reflectance, transmittance } => {
                Absorber::Translucent { reflectance, transmittance }
            }
            Description::Conductor { eta, k, roughness, energy_compensation } => match roughness.of_hot_surface() {
                [along, _] if along < SMOOTH => Absorber::Mirror { eta, k },
                alpha => Absorber::RoughMetal {
                    eta,
                    k,
                    facets: FacetCosines::shared(alpha),
                    again: energy_compensation.then(|| ReflectionAlbedo::shared(alpha)),
                },
            },
            Description::Plastic { reflectance, eta, roughness } => match roughness.of_hot_surface() {
                [alpha, _] if alpha < SMOOTH => Absorber::Varnish { reflectance, eta },
                alpha => {
                    let range = index_range(&scene.spectra[eta].curve, &scene.channels);
                    let coat = CoatAlbedo::shared(alpha[0], range);
                    Absorber::RoughPlastic { reflectance, eta, facets: FacetCosines::shared(alpha), coat }
                }
            },
            Description::Dielectric { .. } | Description::Blend { .. } => return None,
        };
        Some(Hot { weight, shares: shares.to_vec(), temperature, two_sided: material.two_sided, absorber })
    }

    /// Adds weight · ε · B of every live channel to `out`.
    pub fn add(&self, at: &Vertex, out: &mut [f64]) {
        let share = |&(texture, missing): &(TextureId, bool)| {
            let number = at.spectra.number(texture);
            if missing { 1.0 - number } else { number }
        };
        let kelvin = match self.temperature {
            Temperature::Constant(kelvin) => kelvin,
            Temperature::Texture(texture) => at.spectra.number(texture),
        };
        let weight = self.weight * self.shares.iter().map(share).product::<f64>();
        for k in at.alive.clone() {
            out[k] += weight * self.emittance(at, k) * planck::radiance(at.spectra.wavelength(k), kelvin);
        }
    }

    /// ε along `at.o` in channel `k`.
    pub fn emittance(&self, at: &Vertex, k: usize) -> f64 {
        if at.inside && !self.two_sided {
            return 1.0;
        }
        let value = |spectrum: SpectrumId| at.spectra.value(spectrum, k);
        // Of light that gets through a coat, what the base keeps: 1 - ρτ/(1 - ρ(1 - τ)), τ what leaves it upward.
        let kept = |rho: f64, eta: f64, mean_reflected: f64| {
            let leaves = (1.0 - mean_reflected) / (eta * eta);
            (1.0 - rho) / (1.0 - rho * (1.0 - leaves))
        };
        match &self.absorber {
            Absorber::Black => 1.0,
            Absorber::Diffuse { reflectance } => 1.0 - at.spectra.reflectance(*reflectance, k),
            Absorber::Translucent { reflectance, transmittance } => {
                let sent_on = [reflectance, transmittance].map(|share| at.spectra.reflectance(*share, k));
                (1.0 - sent_on[0] - sent_on[1]).max(0.0)
            }
            Absorber::Mirror { eta, k } => 1.0 - fresnel::conductor(at.o.z, value(*eta), value(*k)),
            Absorber::RoughMetal { eta, k, facets, again } => {
                let (eta, k) = (value(*eta), value(*k));
                let absorbed: [f64; FACET_COSINES] =
                    std::array::from_fn(|j| 1.0 - fresnel::conductor(facet_cosine(j), eta, k));
                let once = facets.mean(at.o, &absorbed);
                let lost = 1.0 - facets.mean(at.o, &[1.0; FACET_COSINES]);
                let comes_back = again.as_ref().map_or(0.0, |albedo| {
                    let (f, missing) = (mean_conductor(eta, k), albedo.mean_loss());
                    albedo.loss(at.o) * f * f * (1.0 - missing) / (1.0 - f * missing)
                });
                // The two tables of what is lost may differ by a rounding where all of it comes back.
                (once + lost - comes_back).max(0.0)
            }
            Absorber::Varnish { reflectance, eta } => {
                let (rho, eta) = (at.spectra.reflectance(*reflectance, k), value(*eta));
                (1.0 - fresnel::dielectric(at.o.z, eta)) * kept(rho, eta, mean_dielectric(eta))
            }
            Absorber::RoughPlastic { reflectance, eta, facets, coat } => {
                let (rho, eta) = (at.spectra.reflectance(*reflectance, k), value(*eta));
                let reflected: [f64; FACET_COSINES] =
                    std::array::from_fn(|j| fresnel::dielectric(facet_cosine(j), eta));
                let enters = 1.0 - coat.reflected(eta, at.o.z);
                let kept = kept(rho, eta, coat.mean_reflected(eta));
                // 1 - R - (what comes out of the base), whose table of R is a coarser one.
                (1.0 - facets.mean(at.o, &reflected) - enters * (1.0 - kept)).max(0.0)
            }
        }
    }
}

/// Directions that stand for a hemisphere, by projected solid angle.
pub fn hemisphere() -> impl Iterator<Item = glam::DVec3> {
    const RINGS: u32 = 4;
    const TURNS: u32 = 4;
    (0..RINGS * TURNS).map(|i| {
        let z = ((f64::from(i / TURNS) + 0.5) / f64::from(RINGS)).sqrt();
        let (sin, cos) = (TAU * (f64::from(i % TURNS) + 0.5) / f64::from(TURNS)).sin_cos();
        let r = (1.0 - z * z).sqrt();
        glam::DVec3::new(r * cos, r * sin, z)
    })
}
