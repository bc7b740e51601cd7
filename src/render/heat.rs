//! Hot surfaces as devices have them: emission of objects. Where a surface sends the same radiance in all directions, as
//! diffuse and black ones and blends of such do, it is a lamp like any other, and costs nothing else. What depends on the
//! angle (metals, plastics, fronts that differ from backs) is a row of spectra, one for each of some cosines. What also
//! differs from place to place (textures) or by azimuth (brushed metals) is worked out where a path meets it:
//! `render::radiators`.

use std::borrow::Cow;

use glam::DVec3;

use crate::render::textures::{self, Share};
use crate::scattering::fresnel::{conductor, dielectric, mean_conductor, mean_dielectric};
use crate::scattering::{DielectricAlbedo, FACET_COSINES, FacetCosines, ReflectionAlbedo, facet_cosine, index_range};
use crate::scene::{
    Bsdf, Emission, MaterialId, Reflectance, SMOOTH, Scene, Sides, Spectrum, SpectrumId, Temperature, Weight,
};
use crate::spectral::{Channels, Curve, planck};

/// The mean over a hemisphere by projected solid angle.
const TYPICAL_COSINE: f64 = 2.0 / 3.0;
/// Cosines (j / (n - 1))³ at which the emission of a side is known; between them it is linear in j.
pub const COSINES: usize = 128;

/// A scene whose heat is emission of its objects.
pub struct Heat<'a> {
    pub scene: Cow<'a, Scene>,
    /// Spectra of the scene at [`COSINES`] cosines, of fronts and backs.
    pub by_angle: Vec<[Vec<SpectrumId>; 2]>,
    /// Of surfaces that emit otherwise at every place; each once.
    pub radiating: Vec<Radiating>,
    /// For each object.
    pub kinds: Vec<Kind>,
}

/// How an object emits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// As its emission says, in all directions.
    Lamp,
    /// As a place in [`Heat::by_angle`] says; its emission is a typical spectrum.
    ByAngle(usize),
    /// As a place in [`Heat::radiating`] says, likewise.
    ByPlace(usize),
}

/// The spectrum of an object's lamp, and whether that is on both sides.
type OfLamp = Option<(SpectrumId, bool)>;

/// A surface of hot parts, and its lamp.
pub struct Radiating {
    pub parts: Vec<HotPart>,
    pub lamp: OfLamp,
}

/// A hot part of a material, at the end of its blends.
#[derive(Debug, Clone)]
pub struct HotPart {
    pub material: MaterialId,
    pub weight: f64,
    /// What blend textures leave of it.
    pub shares: Vec<Share>,
    pub temperature: Temperature,
}

/// A hot part of a surface that is the same all over.
struct Leaf<'a> {
    weight: f64,
    kelvin: f64,
    two_sided: bool,
    absorber: Absorber,
    /// What the absorber depends on, in its order.
    curves: Vec<Cow<'a, Curve>>,
}

enum Absorber {
    Black,
    Diffuse,
    Mirror,
    RoughMetal { facets: FacetCosines, again: Option<ReflectionAlbedo> },
    Varnish,
    RoughPlastic { facets: FacetCosines, coat: DielectricAlbedo },
}

impl Leaf<'_> {
    /// ε at `cosine` where the curves have `values`: 1 - what is reflected (see `reference`, which has its own).
    fn emittance(&self, cosine: f64, back: bool, values: &[f64]) -> f64 {
        if back && !self.two_sided {
            return 1.0;
        }
        let o = DVec3::new(((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt(), 0.0, cosine);
        // What the base under a coat of index η keeps of light that got through.
        let kept = |rho: f64, eta: f64, mean_reflected: f64| {
            let leaves = (1.0 - mean_reflected) / (eta * eta);
            (1.0 - rho) / (1.0 - rho * (1.0 - leaves))
        };
        let emittance = match &self.absorber {
            Absorber::Black => 1.0,
            Absorber::Diffuse => 1.0 - values[0],
            Absorber::Mirror => 1.0 - conductor(cosine, values[0], values[1]),
            Absorber::RoughMetal { facets, again } => {
                let (eta, k) = (values[0], values[1]);
                let once = facets.mean(o, &std::array::from_fn(|j| 1.0 - conductor(facet_cosine(j), eta, k)));
                let lost = 1.0 - facets.mean(o, &[1.0; FACET_COSINES]);
                let comes_back = again.as_ref().map_or(0.0, |albedo| {
                    let (f, missing) = (mean_conductor(eta, k), albedo.mean_loss());
                    albedo.loss(o) * f * f * (1.0 - missing) / (1.0 - f * missing)
                });
                once + lost - comes_back
            }
            Absorber::Varnish => {
                let (rho, eta) = (values[0], values[1]);
                (1.0 - dielectric(cosine, eta)) * kept(rho, eta, mean_dielectric(eta))
            }
            Absorber::RoughPlastic { facets, coat } => {
                let (rho, eta) = (values[0], values[1]);
                let reflected = facets.mean(o, &std::array::from_fn(|j| dielectric(facet_cosine(j), eta)));
                let enters = 1.0 - coat.reflected(eta, false, cosine);
                1.0 - reflected - enters * (1.0 - kept(rho, eta, coat.mean_reflected(eta, false)))
            }
        };
        emittance.max(0.0)
    }

    /// Whether ε is the same in all directions.
    fn is_even(&self) -> bool {
        match self.absorber {
            Absorber::Black => true,
            Absorber::Diffuse => self.two_sided,
            _ => false,
        }
    }
}

/// `scene` with the heat of its surfaces as emission of objects.
pub fn as_emission(scene: &Scene) -> Heat<'_> {
    let kinds = vec![Kind::Lamp; scene.objects.len()];
    let mut heat = Heat { scene: Cow::Borrowed(scene), by_angle: Vec::new(), radiating: Vec::new(), kinds };
    if scene.materials.iter().all(|material| material.temperature.is_none()) {
        return heat;
    }
    let mut lit = scene.clone();
    let mut made: Vec<((MaterialId, OfLamp), (SpectrumId, Kind))> = Vec::new();
    for (index, object) in scene.objects.iter().enumerate() {
        let Some(material) = object.material else { continue };
        let emitted = object.emission.as_ref().map(|e| (e.radiance, e.sides == Sides::Both));
        let known = made.iter().find(|(key, _)| *key == (material, emitted)).map(|(_, made)| *made);
        let (radiance, kind) = match known {
            Some(known) => known,
            None => {
                let mut parts = Vec::new();
                collect(scene, material, 1.0, &[], None, &mut parts);
                if parts.is_empty() {
                    continue;
                }
                let by_place = parts.iter().any(|part| part.differs_by_place(scene));
                let leaves: Vec<Leaf> = match by_place {
                    true => parts.iter().flat_map(|part| part.typical(scene)).collect(),
                    false => parts.iter().map(|part| part.leaf(scene)).collect(),
                };
                let name = format!("heat of \"{}\"", scene.materials[material].name);
                let of_lamp = |back: bool| {
                    emitted.filter(|(_, both)| *both || !back).map(|(spectrum, _)| &scene.spectra[spectrum].curve)
                };
                let mut push = |curve: Curve| {
                    lit.spectra.push(Spectrum { name: name.clone(), curve });
                    lit.spectra.len() - 1
                };
                let even = leaves.iter().all(Leaf::is_even) && emitted.is_none_or(|(_, both)| both);
                let new = if by_place {
                    let typical = radiance(of_lamp(false), &leaves, TYPICAL_COSINE, false, &scene.channels);
                    heat.radiating.push(Radiating { parts, lamp: emitted });
                    (push(typical), Kind::ByPlace(heat.radiating.len() - 1))
                } else if even {
                    (push(radiance(of_lamp(false), &leaves, 1.0, false, &scene.channels)), Kind::Lamp)
                } else {
                    let row = |back: bool| -> Vec<Curve> {
                        let cosine = |j: usize| (j as f64 / (COSINES - 1) as f64).powi(3);
                        let at = |j: usize| radiance(of_lamp(back), &leaves, cosine(j), back, &scene.channels);
                        (0..COSINES).map(at).collect()
                    };
                    let front = row(false);
                    // Lights are chosen by what they send typically.
                    let typical = front[(TYPICAL_COSINE.cbrt() * (COSINES - 1) as f64) as usize].clone();
                    let same = leaves.iter().all(|leaf| leaf.two_sided) && emitted.is_none_or(|(_, both)| both);
                    let front: Vec<SpectrumId> = front.into_iter().map(&mut push).collect();
                    let back = if same { front.clone() } else { row(true).into_iter().map(&mut push).collect() };
                    heat.by_angle.push([front, back]);
                    (push(typical), Kind::ByAngle(heat.by_angle.len() - 1))
                };
                made.push(((material, emitted), new));
                new
            }
        };
        heat.kinds[index] = kind;
        // A white surface is hot in vain.
        if lit.spectra[radiance].curve != Curve::Constant(0.0) {
            lit.objects[index].emission = Some(Emission { radiance, sides: Sides::Both });
        }
    }
    lit.materials.iter_mut().for_each(|material| material.temperature = None);
    heat.scene = Cow::Owned(lit);
    heat
}

/// The hot parts of a material; `temperature`: of the blend around, for what has none of its own.
fn collect(
    scene: &Scene,
    id: MaterialId,
    weight: f64,
    shares: &[Share],
    temperature: Option<Temperature>,
    out: &mut Vec<HotPart>,
) {
    let material = &scene.materials[id];
    let temperature = material.temperature.or(temperature);
    match (&material.bsdf, temperature) {
        (Bsdf::Blend { a, b, weight: Weight::Constant(of_b) }, _) => {
            collect(scene, *a, weight * (1.0 - of_b), shares, temperature, out);
            collect(scene, *b, weight * of_b, shares, temperature, out);
        }
        (Bsdf::Blend { a, b, weight: Weight::Texture(texture) }, _) => {
            let with = |missing| [shares, &[(*texture, missing)]].concat();
            collect(scene, *a, weight, &with(true), temperature, out);
            collect(scene, *b, weight, &with(false), temperature, out);
        }
        // Absorbs nothing.
        (Bsdf::Dielectric { .. }, _) | (_, None) => {}
        (_, Some(temperature)) if weight > 0.0 => {
            out.push(HotPart { material: id, weight, shares: shares.to_vec(), temperature });
        }
        _ => {}
    }
}

impl HotPart {
    /// Whether what it emits depends on more than the cosine.
    fn differs_by_place(&self, scene: &Scene) -> bool {
        let bsdf = &scene.materials[self.material].bsdf;
        let textured = match bsdf {
            Bsdf::Diffuse { reflectance } | Bsdf::Plastic { reflectance, .. } => {
                matches!(reflectance, Reflectance::Texture(_))
            }
            Bsdf::Conductor { roughness: [x, y], .. } => x != y && *x >= SMOOTH,
            Bsdf::Dielectric { .. } | Bsdf::Blend { .. } | Bsdf::Black => false,
        };
        textured || !self.shares.is_empty() || matches!(self.temperature, Temperature::Texture(_))
    }

    /// What it emits, of a part that is the same all over.
    fn leaf<'a>(&self, scene: &'a Scene) -> Leaf<'a> {
        let material = &scene.materials[self.material];
        let curve = |spectrum: SpectrumId| Cow::Borrowed(&scene.spectra[spectrum].curve);
        let all_over = |reflectance: Reflectance| match reflectance {
            Reflectance::Spectrum(spectrum) => curve(spectrum),
            Reflectance::Texture(_) => unreachable!("textures differ by place"),
        };
        let Temperature::Constant(kelvin) = self.temperature else { unreachable!("textures differ by place") };
        let (absorber, curves) = match material.bsdf {
            Bsdf::Black => (Absorber::Black, vec![]),
            Bsdf::Diffuse { reflectance } => (Absorber::Diffuse, vec![all_over(reflectance)]),
            Bsdf::Conductor { eta, k, roughness, energy_compensation } => {
                let absorber = match roughness[0] < SMOOTH {
                    true => Absorber::Mirror,
                    false => Absorber::RoughMetal {
                        facets: FacetCosines::new(roughness),
                        again: energy_compensation.then(|| ReflectionAlbedo::new(roughness)),
                    },
                };
                (absorber, vec![curve(eta), curve(k)])
            }
            Bsdf::Plastic { reflectance, eta, roughness } => {
                let absorber = match roughness < SMOOTH {
                    true => Absorber::Varnish,
                    false => Absorber::RoughPlastic {
                        facets: FacetCosines::new([roughness; 2]),
                        coat: DielectricAlbedo::new(roughness, index_range(&curve(eta), &scene.channels)),
                    },
                };
                (absorber, vec![all_over(reflectance), curve(eta)])
            }
            Bsdf::Dielectric { .. } | Bsdf::Blend { .. } => unreachable!("`collect` has none"),
        };
        Leaf { weight: self.weight, kelvin, two_sided: material.two_sided, absorber, curves }
    }

    /// What it emits on the whole, for choosing among lights: facets lie flat, textures are their means, of temperatures a
    /// few. Something wherever the part emits anywhere.
    fn typical<'a>(&self, scene: &'a Scene) -> Vec<Leaf<'a>> {
        let material = &scene.materials[self.material];
        let curve = |spectrum: SpectrumId| Cow::Borrowed(&scene.spectra[spectrum].curve);
        let mean = |reflectance: Reflectance| match reflectance {
            Reflectance::Spectrum(spectrum) => curve(spectrum),
            Reflectance::Texture(texture) => Cow::Owned(textures::mean_reflectance(scene, texture)),
        };
        let share = |&(texture, missing): &Share| {
            let mean = textures::mean_number(&scene.textures[texture]);
            if missing { 1.0 - mean } else { mean }
        };
        let weight = self.weight * self.shares.iter().map(share).product::<f64>();
        let temperatures = match self.temperature {
            Temperature::Constant(kelvin) => vec![(1.0, kelvin)],
            Temperature::Texture(texture) => textures::typical_numbers(&scene.textures[texture]),
        };
        let leaf = |(share, kelvin): (f64, f64)| {
            let (absorber, curves) = match material.bsdf {
                Bsdf::Black => (Absorber::Black, vec![]),
                Bsdf::Diffuse { reflectance } => (Absorber::Diffuse, vec![mean(reflectance)]),
                Bsdf::Conductor { eta, k, .. } => (Absorber::Mirror, vec![curve(eta), curve(k)]),
                Bsdf::Plastic { reflectance, eta, .. } => (Absorber::Varnish, vec![mean(reflectance), curve(eta)]),
                Bsdf::Dielectric { .. } | Bsdf::Blend { .. } => unreachable!("`collect` has none"),
            };
            Leaf { weight: weight * share, kelvin, two_sided: material.two_sided, absorber, curves }
        };
        temperatures.into_iter().map(leaf).collect()
    }
}

/// E + Σ w ε B(λ, T) at a cosine, within `channels`.
fn radiance(emitted: Option<&Curve>, leaves: &[Leaf], cosine: f64, back: bool, channels: &Channels) -> Curve {
    if emitted.is_none() && leaves.iter().all(|leaf| leaf.kelvin == leaves[0].kelvin) {
        // Grey: Planck's law itself.
        let grey = |leaf: &Leaf| {
            let values: Option<Vec<f64>> =
                leaf.curves.iter().map(|c| c.is_constant().then(|| c.eval(channels.centre(0)))).collect();
            values.map(|values| leaf.weight * leaf.emittance(cosine, back, &values))
        };
        let scale: Option<f64> = leaves.iter().map(grey).sum();
        match scale {
            Some(0.0) => return Curve::Constant(0.0),
            Some(scale) => return Curve::Blackbody { kelvin: leaves[0].kelvin, scale },
            None => {}
        }
    }
    let tables = emitted.into_iter().chain(leaves.iter().flat_map(|leaf| leaf.curves.iter().map(|curve| &**curve)));
    let tables: Vec<&Curve> = tables.collect();
    let at = |nm: f64, values: &[f64]| {
        let (lamp, mut values) = values.split_at(usize::from(emitted.is_some()));
        let mut of_leaf = |leaf: &Leaf| {
            let (own, rest) = values.split_at(leaf.curves.len());
            values = rest;
            leaf.weight * leaf.emittance(cosine, back, own) * planck::radiance(nm, leaf.kelvin)
        };
        leaves.iter().map(&mut of_leaf).sum::<f64>() + lamp.iter().sum::<f64>()
    };
    Curve::derived_by_stretch(&tables, channels, at)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectral::Outside;

    fn leaf<'a>(reflectance: Option<&'a Curve>, weight: f64, kelvin: f64) -> Leaf<'a> {
        let absorber = if reflectance.is_some() { Absorber::Diffuse } else { Absorber::Black };
        Leaf { weight, kelvin, two_sided: true, absorber, curves: reflectance.into_iter().map(Cow::Borrowed).collect() }
    }

    /// Means of every channel to 2e-5, also 30 orders below the peak.
    #[test]
    fn sums_keep_their_means_in_every_channel() {
        let channels = Channels::from_bounds(vec![[540.0, 560.0], [3e3, 5e3], [8e3, 14e3], [10e3, 12e3]], None);
        let rho = Curve::Linear { nm: vec![380.0, 20e3], value: vec![0.2, 0.9], outside: Outside::Hold };
        let step = Curve::Linear {
            nm: vec![4e3, 9e3, 9e3, 20e3],
            value: vec![1e-3, 1e-3, 2e-3, 2e-3],
            outside: Outside::Zero,
        };
        let leaves = [leaf(Some(&rho), 0.25, 300.0), leaf(None, 0.75, 400.0)];
        for emitted in [None, Some(&step)] {
            let curve = radiance(emitted, &leaves, 1.0, false, &channels);
            for &[from, to] in &channels.bounds {
                const STEPS: u32 = 200_000;
                let at = |i: u32| {
                    let nm = from + (to - from) * (f64::from(i) + 0.5) / f64::from(STEPS);
                    emitted.map_or(0.0, |e| e.eval(nm))
                        + 0.25 * (1.0 - rho.eval(nm)) * planck::radiance(nm, 300.0)
                        + 0.75 * planck::radiance(nm, 400.0)
                };
                let want = (0..STEPS).map(at).sum::<f64>() / f64::from(STEPS);
                let got = curve.mean(from, to);
                assert!((got / want - 1.0).abs() < 2e-5, "{from}-{to}: {got} {want}");
            }
        }
    }

    #[test]
    fn grey_heat_is_plancks_law() {
        let channels = Channels::equal(8e3, 14e3, 3);
        let (half, white) = (Curve::Constant(0.5), Curve::Constant(1.0));
        let mixed = radiance(None, &[leaf(Some(&half), 0.5, 300.0), leaf(None, 0.5, 300.0)], 1.0, false, &channels);
        assert_eq!(mixed, Curve::Blackbody { kelvin: 300.0, scale: 0.75 });
        assert_eq!(radiance(None, &[leaf(Some(&white), 1.0, 300.0)], 1.0, false, &channels), Curve::Constant(0.0));
    }
}
