//! Hot surfaces that emit otherwise at every place (temperatures, reflectances or shares from textures) or by azimuth (brushed
//! metals), as devices get them: `shaders/parts/heat/place.wgsl` turns each into instructions where a path meets it.

use crate::device::parts::heat::{HotLeaf, Radiating};
use crate::device::parts::surfaces::{self, Surfaces, texture_records};
use crate::device::separable;
use crate::device::words::{
    HOT_FACET_COUNT, NONE, RADIATOR_ABSORBS, RADIATOR_COAT, RADIATOR_FACETS, RADIATOR_LAMP, RADIATOR_MIRROR,
    RADIATOR_OPEN, RADIATOR_PASSES_SPECTRUM, RADIATOR_PASSES_TEXTURE, RADIATOR_SEPARATES, RADIATOR_TWO_SIDED,
    RADIATOR_VARNISH, Radiator,
};
use crate::scene::{Bsdf, Reflectance, SMOOTH, Scene, SpectrumId, Temperature, TextureKind};
use crate::spectral::Curve;
use crate::spectral::hemisphere::fresnel::{mean_conductor, mean_dielectric};
use crate::spectral::hemisphere::{CoatAlbedo, ReflectionAlbedo, index_range};
use crate::{Error, Result};

/// What the surface of a radiator does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
enum Kind {
    Open = RADIATOR_OPEN,
    Mirror = RADIATOR_MIRROR,
    Facets = RADIATOR_FACETS,
    Varnish = RADIATOR_VARNISH,
    Coat = RADIATOR_COAT,
    Lamp = RADIATOR_LAMP,
}

/// Of [`Emitter::spectrum`](crate::device::words::Emitter): first radiator and their number, 16 and 12 bits.
const COUNT_SHIFT: u32 = 16;
const MOST: usize = 1 << 16;

/// Radiators of all surfaces that emit by place. Spectra are positions among those that materials need until
/// [`Radiators::name_spectra`].
#[derive(Debug, Clone, Default)]
pub struct Radiators {
    pub all: Vec<Radiator>,
    /// For each of [`Heat::radiating`](crate::device::parts::heat::Heat::radiating) what stands in its emitters.
    pub words: Vec<u32>,
    pub features: Features,
    /// Spectrum of the wavelength in µm.
    pub wavelength: u32,
}

/// What shaders are composed for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Features {
    pub facets: bool,
    pub mirrors: bool,
    pub varnish: bool,
    pub coats: bool,
    /// Some reflectance is a texture, and some light passes beside it.
    pub translucent: bool,
    pub lamps: bool,
    /// Some lamp is a picture.
    pub pictures: bool,
    /// Some reflectance is a texture; some temperature or share is.
    pub textured: bool,
    pub numbers: bool,
    /// Most records that the emission of one surface takes.
    pub records: u32,
}

impl Radiators {
    /// Of the surfaces `radiating` of `scene`; what they need is added to `surfaces`. Errors: more parts than numbers.
    pub fn new(scene: &Scene, radiating: &[Radiating], surfaces: &mut Surfaces) -> Result<Radiators> {
        let mut radiators = Radiators::default();
        for surface in radiating {
            let (first, mut records) = (radiators.all.len(), 0);
            for part in &surface.parts {
                records += radiators.add(scene, part, surfaces);
            }
            if let Some((spectrum, both, texture)) = surface.lamp {
                radiators.features.lamps = true;
                let kind = Kind::Lamp as u32 | if both { RADIATOR_TWO_SIDED } else { 0 };
                let mut lamp = blank(kind);
                match texture {
                    None => {
                        lamp.spectra = surfaces.spectrum(spectrum);
                        records += 1;
                    }
                    Some(texture) => {
                        lamp.reflectance = texture as u32;
                        if let TextureKind::Light(daylight) = scene.textures[texture].kind {
                            lamp.spectra = surfaces.spectrum(daylight);
                        }
                        radiators.features.pictures = true;
                        records += texture_records(&scene.textures[texture]);
                    }
                }
                radiators.all.push(lamp);
            }
            radiators.features.records = radiators.features.records.max(records);
            radiators.words.push(first as u32 | ((radiators.all.len() - first) as u32) << COUNT_SHIFT);
        }
        if scene.textures.len() > MOST {
            let message = format!("{} textures beside hot ones, at most {MOST} are supported", scene.textures.len());
            return Err(Error::input(&scene.file, message));
        }
        if radiators.all.len() > MOST {
            let message =
                format!("{} hot parts of textured materials, at most {MOST} are supported", radiators.all.len());
            return Err(Error::input(&scene.file, message));
        }
        radiators.wavelength = surfaces.need(surfaces::wavelength(scene));
        Ok(radiators)
    }

    /// Replaces positions by the ids that the device's tables gave the spectra.
    pub fn name_spectra(&mut self, id: impl Fn(usize) -> u32) {
        let both = |word: u32| id((word & 0xffff) as usize) | id((word >> 16) as usize) << 16;
        for radiator in &mut self.all {
            radiator.spectra = both(radiator.spectra);
            // The upper half may be a table.
            radiator.inner = id((radiator.inner & 0xffff) as usize) | radiator.inner & 0xffff_0000;
        }
        self.wavelength = id(self.wavelength as usize);
    }

    /// Adds a part, and gives the records that it takes.
    fn add(&mut self, scene: &Scene, part: &HotLeaf, surfaces: &mut Surfaces) -> u32 {
        let material = &scene.materials[part.material];
        let name = &material.name;
        let mut radiator = blank(if material.two_sided { RADIATOR_TWO_SIDED } else { 0 });
        if separable::separates_by_place(scene, part) {
            radiator.kind |= RADIATOR_SEPARATES;
        }
        radiator.weight = part.weight as f32;
        match part.temperature {
            Temperature::Constant(kelvin) => radiator.kelvin = kelvin as f32,
            Temperature::Texture(texture) => {
                radiator.temperature = texture as u32;
                self.features.numbers = true;
            }
        }
        if !part.shares.is_empty() {
            self.features.numbers = true;
            radiator.shares = surfaces.append_shares(&part.shares);
        }
        let curve = |spectrum: usize| &scene.spectra[spectrum].curve;
        let (kind, mut records) = match material.bsdf {
            Bsdf::Black => (Kind::Open, 1),
            Bsdf::Diffuse { reflectance } => {
                match reflectance {
                    Reflectance::Spectrum(spectrum) => {
                        let absorbed = Curve::derived(&[curve(spectrum)], &scene.channels, |v| 1.0 - v[0]);
                        radiator.inner = surfaces.derived(format!("{name}, absorbed"), absorbed);
                        radiator.kind |= RADIATOR_ABSORBS;
                    }
                    Reflectance::Texture(texture) => radiator.reflectance = texture as u32,
                }
                (Kind::Open, 2)
            }
            Bsdf::Translucent { reflectance, transmittance } => match (reflectance, transmittance) {
                (Reflectance::Spectrum(a), Reflectance::Spectrum(b)) => {
                    let absorbed = Curve::derived(&[curve(a), curve(b)], &scene.channels, |v| 1.0 - v[0] - v[1]);
                    radiator.inner = surfaces.derived(format!("{name}, absorbed"), absorbed);
                    radiator.kind |= RADIATOR_ABSORBS;
                    (Kind::Open, 2)
                }
                // Which of both is reflected makes no difference to what is kept.
                (Reflectance::Texture(texture), Reflectance::Spectrum(other))
                | (Reflectance::Spectrum(other), Reflectance::Texture(texture)) => {
                    radiator.reflectance = texture as u32;
                    radiator.spectra = surfaces.spectrum(other);
                    radiator.kind |= RADIATOR_PASSES_SPECTRUM;
                    self.features.translucent = true;
                    (Kind::Open, 3)
                }
                (Reflectance::Texture(texture), Reflectance::Texture(other)) => {
                    radiator.reflectance = texture as u32;
                    radiator.kind |= RADIATOR_PASSES_TEXTURE | (other as u32) << 16;
                    self.features.translucent = true;
                    (Kind::Open, 2 + texture_records(&scene.textures[other]))
                }
            },
            Bsdf::Conductor { eta, k, roughness, .. } if roughness.of_hot_surface()[0] < SMOOTH => {
                radiator.spectra = surfaces.spectrum(eta) | surfaces.spectrum(k) << 16;
                self.features.mirrors = true;
                (Kind::Mirror, 2)
            }
            Bsdf::Conductor { eta, k, roughness, energy_compensation } => {
                radiator.spectra = surfaces.spectrum(eta) | surfaces.spectrum(k) << 16;
                let alpha = roughness.of_hot_surface();
                radiator.alpha = alpha.map(|alpha| alpha as f32);
                // What is scattered more than once comes back as `surfaces` has it, or is lost.
                let lost = ReflectionAlbedo::shared(alpha).mean_loss();
                if energy_compensation {
                    let stays = |v: &[f64]| {
                        let f = mean_conductor(v[0], v[1]);
                        1.0 - f * f * (1.0 - lost) / (1.0 - f * lost)
                    };
                    let stays = Curve::derived(&[curve(eta), curve(k)], &scene.channels, stays);
                    radiator.inner = surfaces.derived(format!("{name}, absorbed later"), stays);
                    radiator.kind |= RADIATOR_ABSORBS;
                }
                self.features.facets = true;
                (Kind::Facets, 2 * HOT_FACET_COUNT + 2)
            }
            Bsdf::Plastic { reflectance, eta, roughness } => {
                let [alpha, _] = roughness.of_hot_surface();
                (self.plastic(scene, &mut radiator, name, reflectance, (eta, alpha), surfaces), 3)
            }
            Bsdf::Dielectric { .. } | Bsdf::Blend { .. } => unreachable!("hot parts absorb, and are no blends"),
        };
        if radiator.reflectance != NONE {
            self.features.textured = true;
            records += texture_records(&scene.textures[radiator.reflectance as usize]);
        }
        radiator.kind |= kind as u32;
        self.all.push(radiator);
        records
    }

    /// A base under a varnish: what it keeps of what comes back from below the boundary too.
    fn plastic(
        &mut self,
        scene: &Scene,
        radiator: &mut Radiator,
        name: &str,
        reflectance: Reflectance,
        (eta, roughness): (SpectrumId, f64),
        surfaces: &mut Surfaces,
    ) -> Kind {
        let curve = |spectrum: usize| &scene.spectra[spectrum].curve;
        radiator.spectra = surfaces.spectrum(eta);
        let rough =
            (roughness >= SMOOTH).then(|| CoatAlbedo::shared(roughness, index_range(curve(eta), &scene.channels)));
        radiator.alpha = [roughness as f32; 2];
        let mean_reflected = |eta: f64| match &rough {
            None => mean_dielectric(eta),
            Some(table) => table.mean_reflected(eta),
        };
        // Of what leaves the base, the share that the coat sends back to it.
        let back = |eta: f64| 1.0 - (1.0 - mean_reflected(eta)) / (eta * eta);
        radiator.inner = match reflectance {
            Reflectance::Spectrum(spectrum) => {
                let kept = |v: &[f64]| (1.0 - v[0]) / (1.0 - v[0] * back(v[1]));
                let kept = Curve::derived(&[curve(spectrum), curve(eta)], &scene.channels, kept);
                radiator.kind |= RADIATOR_ABSORBS;
                surfaces.derived(format!("{name}, kept by the base"), kept)
            }
            Reflectance::Texture(texture) => {
                radiator.reflectance = texture as u32;
                let back = Curve::derived(&[curve(eta)], &scene.channels, |v| back(v[0]));
                surfaces.derived(format!("{name}, back to the base"), back)
            }
        };
        match &rough {
            None => {
                self.features.varnish = true;
                Kind::Varnish
            }
            Some(table) => {
                self.features.coats = true;
                radiator.inner |= surfaces.eta_table(table.table()) << 16;
                Kind::Coat
            }
        }
    }
}

fn blank(kind: u32) -> Radiator {
    Radiator { kind, weight: 1.0, temperature: NONE, reflectance: NONE, shares: 0, ..Radiator::default() }
}
