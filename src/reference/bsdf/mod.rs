//! Scattering at a surface: one interface over a set of lobes.
//!
//! Directions are local and point away from the surface: `o` towards where the path comes from, with z > 0, `i` towards
//! where it goes on; z is along the normal on the side of `o`.
//!
//! # Radiance across a boundary
//! What a path carries is radiance. A boundary sends the fraction T of the flux that arrives along `o` through, into a
//! cone that is narrower on the denser side, so that L/n² is what is kept: L_o = T (n_o/n_i)² L_i. Transmission
//! therefore carries the factor 1/η², η = n_i/n_o; a path that enters and leaves a body of glass meets 1/η² and η² and
//! ends with neither. Seen from inside glass, a white sky has radiance n².
//!
//! # Decisions
//! Every direction is chosen once for all channels. A lobe is chosen with q = ½ mean over channels of its share of what
//! is scattered + ½ its normalised largest share (docs/METHOD.md, Decisions). Shares are those of directional albedos at the
//! path's own wavelength samples, so that a lobe which scatters in any channel can be chosen; between reflection and
//! refraction at a smooth boundary the table decides that devices use too. A direction that several lobes could have
//! chosen is weighted by all of them together.

mod dielectric;
mod fresnel;
mod ggx;
mod plastic;
mod reflection;
mod roughness;
mod spectra;
#[cfg(test)]
mod tests;
mod thermal;

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use glam::DVec3;

use crate::scene::{
    Bsdf as Description, MaterialId, Reflectance, Roughness, SMOOTH, Scene, SpectrumId, Temperature, TextureId, Weight,
};
use crate::spectral::hemisphere::index_range;
pub use spectra::SpectralValues;
use thermal::Hot;
pub use thermal::hemisphere;

/// Where a path meets a material.
#[derive(Clone)]
pub struct Vertex<'v> {
    pub o: DVec3,
    /// Whether the path comes from behind, against the geometric normal: from inside a dielectric.
    pub inside: bool,
    /// At this path's wavelengths; holds those of [`Bsdf::spectra`], and [`Bsdf::textures`] at this vertex.
    pub spectra: &'v SpectralValues<'v>,
    /// The channels that have not stopped.
    pub alive: Range<usize>,
}

/// A way in which a surface scatters. Densities are by solid angle and common to all channels.
trait Lobe: Send + Sync {
    /// Flux sent out in all directions per flux arriving along `o` in channel `k`, in [0, 1] to the accuracy of its
    /// tables: for decisions only.
    fn albedo(&self, at: &Vertex, k: usize) -> f64;

    /// A direction from uniform numbers (the first picks among channels where it matters); `None` where this lobe sends
    /// nothing.
    fn sample(&self, at: &Vertex, u: [f64; 3]) -> Option<Choice>;

    /// Adds `scale` f(o, i) |cosθ_i| of every live channel to `out`; nothing for a [`Choice::Only`] direction.
    fn evaluate(&self, at: &Vertex, i: DVec3, scale: f64, out: &mut [f64]);

    /// The density with which [`Lobe::sample`] chooses `i` as a [`Choice::Spread`].
    fn density(&self, at: &Vertex, i: DVec3) -> f64;

    /// f |cosθ| integrated over the one direction of [`Choice::Only`], in channel `k`.
    fn factor(&self, _at: &Vertex, _k: usize) -> f64 {
        0.0
    }
}

/// What a lobe chose.
enum Choice {
    /// One of a continuum.
    Spread(DVec3),
    /// The only one there is. `channel`: the one that goes on while all others stop.
    Only { direction: DVec3, channel: Option<usize> },
}

/// A lobe's place in a material.
struct PlacedLobe {
    lobe: Box<dyn Lobe>,
    /// Share of a blend, but for what is textured of it.
    weight: f64,
    /// Textures whose number, or what is missing of it to 1 (true), are factors of the share.
    shares: Vec<(TextureId, bool)>,
    /// Whether nothing passes. An opaque surface has no inside: its back is as its front, or black.
    opaque: bool,
    two_sided: bool,
}

/// A material.
pub struct Bsdf {
    parts: Vec<PlacedLobe>,
    hot: Vec<Hot>,
    spectra: Vec<SpectrumId>,
    textures: Vec<TextureId>,
}

/// A direction to go on in.
#[derive(Debug)]
pub struct Sampled {
    pub direction: DVec3,
    /// By solid angle; `None` for the only direction of a mirror or of ideal refraction.
    pub density: Option<f64>,
    /// The one channel that goes on, where the others stop.
    pub channel: Option<usize>,
}

/// A material at a vertex, with what is decided there.
pub struct Scattering<'v> {
    parts: Vec<(&'v PlacedLobe, f64)>,
    at: Vertex<'v>,
    survival: f64,
}

impl Bsdf {
    pub fn new(scene: &Scene, material: MaterialId) -> Self {
        let mut bsdf = Bsdf { parts: Vec::new(), hot: Vec::new(), spectra: Vec::new(), textures: Vec::new() };
        bsdf.add(scene, material, 1.0, &[], None);
        bsdf.spectra.sort_unstable();
        bsdf.spectra.dedup();
        bsdf
    }

    pub fn is_hot(&self) -> bool {
        !self.hot.is_empty()
    }

    /// Adds thermal radiance along `at.o`, W m⁻² sr⁻¹ nm⁻¹, of every live channel to `out`.
    pub fn emit(&self, at: &Vertex, out: &mut [f64]) {
        self.hot.iter().for_each(|hot| hot.add(at, out));
    }

    /// What [`SpectralValues`] must hold before [`Bsdf::at`] and [`Bsdf::emit`].
    pub fn spectra(&self) -> &[SpectrumId] {
        &self.spectra
    }

    /// What [`SpectralValues`] must have looked up at the vertex before [`Bsdf::at`].
    pub fn textures(&self) -> &[TextureId] {
        &self.textures
    }

    fn add_reflectance(&mut self, reflectance: Reflectance) {
        match reflectance {
            Reflectance::Spectrum(spectrum) => self.spectra.push(spectrum),
            Reflectance::Texture(texture) => self.textures.push(texture),
        }
    }

    /// `temperature`: of the blend around, for what has no temperature of its own.
    fn add(
        &mut self,
        scene: &Scene,
        material: MaterialId,
        weight: f64,
        shares: &[(TextureId, bool)],
        temperature: Option<Temperature>,
    ) {
        if weight == 0.0 {
            return;
        }
        let material = &scene.materials[material];
        let temperature = material.temperature.or(temperature);
        if let Some(temperature) = temperature {
            if let Temperature::Texture(texture) = temperature {
                self.textures.push(texture);
            }
            self.hot.extend(Hot::new(scene, material, weight, shares, temperature));
        }
        let (opaque, lobes): (bool, Vec<Box<dyn Lobe>>) = match material.bsdf {
            Description::Black => (true, Vec::new()),
            Description::Diffuse { reflectance } => {
                self.add_reflectance(reflectance);
                (true, vec![Box::new(Lambert { share: reflectance, side: 1.0 })])
            }
            Description::Translucent { reflectance, transmittance } => {
                self.add_reflectance(reflectance);
                self.add_reflectance(transmittance);
                let sides = [(reflectance, 1.0), (transmittance, -1.0)];
                (false, sides.map(|(share, side)| Box::new(Lambert { share, side }) as Box<dyn Lobe>).into())
            }
            Description::Conductor { eta, k, roughness, energy_compensation } => {
                self.spectra.extend([eta, k]);
                let at = move |alpha| reflection::conductor(eta, k, alpha, energy_compensation);
                (true, self.of_roughness(roughness, at))
            }
            Description::Dielectric { eta, dispersion, roughness } => {
                self.spectra.push(eta);
                let surface = dielectric::Surface::new(scene, eta, dispersion);
                let range = index_range(&scene.spectra[eta].curve, &scene.channels);
                (false, self.of_roughness(roughness, move |alpha| dielectric::lobes(&surface, range, alpha)))
            }
            Description::Plastic { reflectance, eta, roughness } => {
                self.add_reflectance(reflectance);
                self.spectra.push(eta);
                let range = index_range(&scene.spectra[eta].curve, &scene.channels);
                (true, self.of_roughness(roughness, move |alpha| plastic::lobes(reflectance, eta, range, alpha)))
            }
            Description::Blend { a, b, weight: Weight::Constant(of_b) } => {
                self.add(scene, a, weight * (1.0 - of_b), shares, temperature);
                return self.add(scene, b, weight * of_b, shares, temperature);
            }
            Description::Blend { a, b, weight: Weight::Texture(texture) } => {
                self.textures.push(texture);
                let with = |missing| [shares, &[(texture, missing)]].concat();
                self.add(scene, a, weight, &with(true), temperature);
                return self.add(scene, b, weight, &with(false), temperature);
            }
        };
        let two_sided = material.two_sided;
        let part = |lobe| PlacedLobe { lobe, weight, shares: shares.to_vec(), opaque, two_sided };
        self.parts.extend(lobes.into_iter().map(part));
    }

    /// The lobes that `at` gives for a roughness along and across, `None` for smooth surfaces; or, by a texture, those of the vertex.
    fn of_roughness(
        &mut self,
        roughness: Roughness,
        at: impl Fn(Option<[f64; 2]>) -> Vec<Box<dyn Lobe>> + Send + Sync + 'static,
    ) -> Vec<Box<dyn Lobe>> {
        match roughness {
            Roughness::Constant(alpha) => at((alpha[0] >= SMOOTH).then_some(alpha)),
            Roughness::Texture(texture) => {
                self.textures.push(texture);
                roughness::lobes(texture, move |alpha| at(Some([alpha; 2])))
            }
        }
    }

    /// The material as a path meets it; `None` where nothing is scattered.
    pub fn at<'v>(&'v self, at: Vertex<'v>) -> Option<Scattering<'v>> {
        let active = self.parts.iter().filter(|part| !at.inside || !part.opaque || part.two_sided);
        let mut parts: Vec<(&PlacedLobe, f64)> = active.map(|part| (part, 1.0)).collect();
        if let [(part, _)] = parts[..] {
            let seen = part.seen_from(&at);
            let largest = at.alive.clone().map(|k| part.share(&at) * part.lobe.albedo(&seen, k)).fold(0.0, f64::max);
            return (largest > 0.0).then(|| Scattering { parts, at, survival: largest.min(1.0) });
        }
        let (mut mean, mut largest) = (vec![0.0; parts.len()], vec![0.0f64; parts.len()]);
        let (mut survival, mut lit) = (0.0f64, 0.0);
        let mut albedos = vec![0.0; parts.len()];
        for k in at.alive.clone() {
            for (albedo, (part, _)) in albedos.iter_mut().zip(&parts) {
                *albedo = part.share(&at) * part.lobe.albedo(&part.seen_from(&at), k).max(0.0);
            }
            let total: f64 = albedos.iter().sum();
            if total > 0.0 {
                survival = survival.max(total);
                lit += 1.0;
                for (l, albedo) in albedos.iter().enumerate() {
                    mean[l] += albedo / total;
                    largest[l] = largest[l].max(albedo / total);
                }
            }
        }
        if lit == 0.0 {
            return None;
        }
        let largest_total: f64 = largest.iter().sum();
        for (l, (_, q)) in parts.iter_mut().enumerate() {
            *q = 0.5 * mean[l] / lit + 0.5 * largest[l] / largest_total;
        }
        Some(Scattering { parts, at, survival: survival.min(1.0) })
    }
}

impl PlacedLobe {
    /// The share of a blend at a vertex.
    fn share(&self, at: &Vertex) -> f64 {
        let factor = |&(texture, missing): &(TextureId, bool)| {
            let number = at.spectra.number(texture);
            if missing { 1.0 - number } else { number }
        };
        self.weight * self.shares.iter().map(factor).product::<f64>()
    }

    fn seen_from<'v>(&self, at: &Vertex<'v>) -> Vertex<'v> {
        Vertex { inside: at.inside && !self.opaque, ..at.clone() }
    }
}

impl Scattering<'_> {
    /// The largest directional albedo over the live channels: the probability with which roulette lets a path go on.
    pub fn survival(&self) -> f64 {
        self.survival
    }

    /// Sets `out` to f(o, i) |cosθ_i| of every live channel, and gives the density with which [`Scattering::sample`]
    /// chooses `i`; neither has the only directions of mirrors and ideal refraction.
    pub fn evaluate(&self, i: DVec3, out: &mut [f64]) -> f64 {
        out[self.at.alive.clone()].fill(0.0);
        let mut density = 0.0;
        for (part, q) in &self.parts {
            let at = part.seen_from(&self.at);
            part.lobe.evaluate(&at, i, part.share(&at), out);
            density += q * part.lobe.density(&at, i);
        }
        density
    }

    /// Chooses a direction from uniform numbers in [0, 1) (lobe, channel, two for the direction), and sets `factor` to
    /// f |cosθ| over its density or probability. Channels that stop get 0.
    pub fn sample(&self, u: [f64; 4], factor: &mut [f64]) -> Option<Sampled> {
        let (mut lobe, mut left) = (self.parts.len() - 1, u[0]);
        for (l, (_, q)) in self.parts.iter().enumerate() {
            if left < *q {
                lobe = l;
                break;
            }
            left -= q;
        }
        let (part, q) = self.parts[lobe];
        let at = part.seen_from(&self.at);
        match part.lobe.sample(&at, [u[1], u[2], u[3]])? {
            Choice::Spread(direction) => {
                let density = self.evaluate(direction, factor);
                if density <= 0.0 {
                    return None;
                }
                factor[self.at.alive.clone()].iter_mut().for_each(|f| *f /= density);
                Some(Sampled { direction, density: Some(density), channel: None })
            }
            Choice::Only { direction, channel } => {
                // The chosen of n channels stands for all.
                let count = channel.map_or(1.0, |_| self.at.alive.len() as f64);
                for k in self.at.alive.clone() {
                    let goes_on = channel.is_none_or(|channel| channel == k);
                    factor[k] = if goes_on { count * part.share(&at) * part.lobe.factor(&at, k) / q } else { 0.0 };
                }
                Some(Sampled { direction, density: None, channel })
            }
        }
    }
}

/// Lambert's law, on the side where light comes from or on the other.
struct Lambert {
    share: Reflectance,
    /// 1 on this side, -1 on the other.
    side: f64,
}

impl Lobe for Lambert {
    fn albedo(&self, at: &Vertex, k: usize) -> f64 {
        at.spectra.reflectance(self.share, k)
    }

    fn sample(&self, _at: &Vertex, u: [f64; 3]) -> Option<Choice> {
        Some(Choice::Spread(self.side * cosine_direction([u[1], u[2]])))
    }

    fn evaluate(&self, at: &Vertex, i: DVec3, scale: f64, out: &mut [f64]) {
        let density = scale * cosine_density(self.side * i);
        for k in at.alive.clone() {
            out[k] += density * at.spectra.reflectance(self.share, k);
        }
    }

    fn density(&self, _at: &Vertex, i: DVec3) -> f64 {
        cosine_density(self.side * i)
    }
}

/// A direction with density cosθ/π: Malley's method, a point of the disk lifted to the hemisphere.
fn cosine_direction([square, turn]: [f64; 2]) -> DVec3 {
    let (radius, angle) = (square.sqrt(), TAU * turn);
    DVec3::new(radius * angle.cos(), radius * angle.sin(), (1.0 - square).sqrt())
}

fn cosine_density(i: DVec3) -> f64 {
    i.z.max(0.0) / PI
}
