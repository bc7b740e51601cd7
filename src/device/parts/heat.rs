//! Hot surfaces as devices have them: emission of objects. Where a surface sends the same radiance in all directions, as
//! diffuse and black ones and blends of such do, it is a lamp like any other, and costs nothing else. What depends on the
//! angle (metals, plastics, fronts that differ from backs) is a row of spectra, one for each of some cosines. What also
//! differs from place to place (textures) or by azimuth (brushed metals) is worked out where a path meets it:
//! `device::parts::radiators`.

use std::borrow::Cow;
use std::sync::Arc;

use glam::DVec3;

use crate::device::part::{Part, Place, Records, SceneBuffer};
use crate::device::parts::geometry::{FEWER_MATERIALS, MATERIALS};
use crate::device::parts::textures::{self, Share};
use crate::device::text::module;
use crate::device::words::HOT_COSINES;
use crate::scene::{
    Bsdf, Emission, MaterialId, Reflectance, SMOOTH, Scene, Sides, Spectrum, SpectrumId, Temperature, TextureId, Weight,
};
use crate::spectral::hemisphere::fresnel::{conductor, dielectric, mean_conductor, mean_dielectric};
use crate::spectral::hemisphere::{
    CoatAlbedo, FACET_COSINES, FacetCosines, ReflectionAlbedo, facet_cosine, index_range,
};
use crate::spectral::{Channels, Curve, planck};

/// The mean over a hemisphere by projected solid angle.
const TYPICAL_COSINE: f64 = 2.0 / 3.0;
/// Cosines (j / (n - 1))³ at which the emission of a side is known; between them it is linear in j.
const COSINES: usize = HOT_COSINES as usize;

pub const BY_ANGLE: Part = Part {
    name: "heat that depends on the angle",
    used: |scene| scene.emits_by_angle && scene.features.emitters,
    effect: |_| "256 spectra for each hot material that is not diffuse".into(),
    is_planned: true,
    modules: &[(Place::Stage, module!("parts/heat/angle.wgsl"))],
    lines: &[
        ("EMITTED", "if (emits_by_angle(list, path, site, v, emitter, weight)) { return; }"),
        ("AIMED_AT_SURFACE", "aim_by_angle(aim, path, emitter, point);"),
    ],
    example: Some(|exhibit| exhibit.add_hot_metal()),
    ..Part::NOTHING
};

pub const BY_PLACE: Part = Part {
    name: "heat that differs by place",
    // Where all is at 0 K nothing emits.
    used: |scene| scene.radiators.is_some() && scene.features.emitters,
    effect: |scene| {
        let most = scene.radiators.as_ref().map_or(0, |radiators| radiators.features.records);
        format!("up to {most} records where a path meets it")
    },
    is_planned: true,
    modules: &[(Place::Stage, module!("parts/heat/radiator.wgsl")), (Place::Stage, module!("parts/heat/place.wgsl"))],
    lines: &[
        ("EMITTED", "if (emits_by_place(list, path.number, v, emitter, weight)) { return; }"),
        ("AIMED_AT_SURFACE", "aim_by_place(aim, emitter, point);"),
        ("LIGHT_TAKES_RECORDS", "if (aim.hot != 0u) { return true; }"),
        (
            "LIGHT_RECORDS",
            "if (aim.hot != 0u) { append_heat_aimed_at(list, aim.hot, aim.hot_vertex, facet_numbers(path, SALT_AIMED)); }",
        ),
    ],
    defines: |scene, _, defines| {
        let Some(features) = scene.radiators.as_ref().map(|radiators| radiators.features) else { return };
        defines.set("RADIATORS", true).set("HOT_LAMPS", features.lamps);
        defines.set("HOT_FACETS", features.facets).set("HOT_MIRRORS", features.mirrors);
        defines.set("HOT_VARNISH", features.varnish).set("HOT_COATS", features.coats);
        defines.set("HOT_TRANSLUCENT", features.translucent).set("HOT_PICTURES", features.pictures);
        defines.set("HOT_TEXTURED", features.textured).set("HOT_NUMBERS", features.numbers);
    },
    buffers: |scene| {
        let radiators = scene.prepared.radiators.as_ref().map(|radiators| &radiators.all);
        radiators.map(|all| SceneBuffer::new("radiators", all, MATERIALS, FEWER_MATERIALS)).into_iter().collect()
    },
    // What is met, beside the one record of every emitter; and what is aimed at: those records, put aside and back, and a diffuse
    // vertex in two.
    records: |scene| {
        let most = scene.radiators.as_ref().map_or(0, |radiators| radiators.features.records);
        Records { way: most.max(1) - 1, vertex: most + 3, path: 0 }
    },
    example: Some(|exhibit| exhibit.add_hot_textures()),
    ..Part::NOTHING
};

/// What both have in common.
pub const EITHER: Part = Part {
    name: "hot surfaces",
    used: |scene| (BY_ANGLE.used)(scene) || (BY_PLACE.used)(scene),
    modules: &[
        (Place::Stage, module!("parts/lights/hit_on_emitter.wgsl")),
        (Place::Stage, module!("parts/heat/heat.wgsl")),
    ],
    defines: |scene, _, defines| {
        let features = scene.radiators.as_ref().map(|radiators| radiators.features);
        let smooth = scene.surfaces.as_ref().is_some_and(|surfaces| surfaces.smooth);
        defines.set("HOT_RANDOM", scene.emits_by_angle || features.is_some_and(|features| features.facets));
        defines.set("HOT_VERTICES", features.is_some() || smooth);
    },
    ..Part::NOTHING
};

/// A scene whose heat is emission of its objects.
pub struct Heat<'a> {
    pub scene: Cow<'a, Scene>,
    /// Spectra of the scene at [`COSINES`] cosines, of fronts and backs.
    pub by_angle: Vec<[Vec<SpectrumId>; 2]>,
    /// Of surfaces that emit otherwise at every place; each once.
    pub radiating: Vec<Radiating>,
    /// For each object.
    pub kinds: Vec<Kind>,
    /// What spectra that were made here are sums of.
    pub made: Vec<Made>,
}

/// A spectrum that a surface sends in all directions: of its lamp, and of its hot parts.
pub struct Made {
    pub spectrum: SpectrumId,
    pub lamp: Option<SpectrumId>,
    pub parts: Vec<HotLeaf>,
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

/// The spectrum of an object's lamp, whether that is on both sides, and the texture that takes its place.
type OfLamp = Option<(SpectrumId, bool, Option<TextureId>)>;

/// A surface of hot parts, and its lamp.
pub struct Radiating {
    pub parts: Vec<HotLeaf>,
    pub lamp: OfLamp,
}

/// A hot part of a material, at the end of its blends.
#[derive(Debug, Clone)]
pub struct HotLeaf {
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

/// A cosine at which a leaf is seen.
struct Seen {
    cosine: f64,
    /// Of facets.
    weights: Vec<f64>,
    /// What they lose, of which `again` comes back in the end, times something that depends on the metal.
    lost: f64,
    again: f64,
}

enum Absorber {
    Black,
    Diffuse,
    Translucent,
    Mirror,
    RoughMetal { facets: Arc<FacetCosines>, again: Option<Arc<ReflectionAlbedo>> },
    Varnish,
    RoughPlastic { facets: Arc<FacetCosines>, coat: Arc<CoatAlbedo> },
}

impl Leaf<'_> {
    fn seen(&self, cosine: f64) -> Seen {
        let o = DVec3::new(((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt(), 0.0, cosine);
        let (weights, again) = match &self.absorber {
            Absorber::RoughMetal { facets, again } => {
                (facets.weights(o), again.as_ref().map_or(0.0, |albedo| albedo.loss(o)))
            }
            Absorber::RoughPlastic { facets, .. } => (facets.weights(o), 0.0),
            _ => (Vec::new(), 0.0),
        };
        let lost = 1.0 - weights.iter().sum::<f64>();
        Seen { cosine, weights, lost, again }
    }
}

/// Eight sums side by side: in one, each addition would wait for the one before.
fn weighted_sum(weights: &[f64], values: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    for (weights, values) in weights.chunks_exact(8).zip(values.chunks_exact(8)) {
        sums.iter_mut().zip(weights.iter().zip(values)).for_each(|(sum, (weight, value))| *sum += weight * value);
    }
    sums.iter().sum()
}

const _: () = assert!(FACET_COSINES.is_multiple_of(8));

/// A value at each cosine of facets.
fn at_facets(f: impl Fn(f64) -> f64) -> [f64; FACET_COSINES] {
    std::array::from_fn(|j| f(facet_cosine(j)))
}

impl Leaf<'_> {
    /// Adds `times` ε to the sum of each cosine at which the leaf is seen, where its curves have `values`: 1 - what is reflected (see
    /// `reference`, which has its own). What all cosines have in common is worked out once.
    fn add(&self, seen: &[Seen], back: bool, values: &[f64], times: f64, sums: &mut [f64]) {
        let mut add = |emittance: &dyn Fn(&Seen) -> f64| {
            sums.iter_mut().zip(seen).for_each(|(sum, seen)| *sum += times * emittance(seen).max(0.0));
        };
        if back && !self.two_sided {
            return add(&|_| 1.0);
        }
        // What the base under a coat of index η keeps of light that got through.
        let kept = |rho: f64, eta: f64, mean_reflected: f64| {
            let leaves = (1.0 - mean_reflected) / (eta * eta);
            (1.0 - rho) / (1.0 - rho * (1.0 - leaves))
        };
        match &self.absorber {
            Absorber::Black => add(&|_| 1.0),
            Absorber::Diffuse => add(&|_| 1.0 - values[0]),
            Absorber::Translucent => add(&|_| 1.0 - values[0] - values[1]),
            Absorber::Mirror => add(&|seen| 1.0 - conductor(seen.cosine, values[0], values[1])),
            Absorber::RoughMetal { again, .. } => {
                let (eta, k) = (values[0], values[1]);
                let absorbed = at_facets(|cosine| 1.0 - conductor(cosine, eta, k));
                let comes_back = again.as_ref().map_or(0.0, |albedo| {
                    let (f, missing) = (mean_conductor(eta, k), albedo.mean_loss());
                    f * f * (1.0 - missing) / (1.0 - f * missing)
                });
                add(&|seen| weighted_sum(&seen.weights, &absorbed) + seen.lost - seen.again * comes_back);
            }
            Absorber::Varnish => {
                let (rho, eta) = (values[0], values[1]);
                let kept = kept(rho, eta, mean_dielectric(eta));
                add(&|seen| (1.0 - dielectric(seen.cosine, eta)) * kept);
            }
            Absorber::RoughPlastic { coat, .. } => {
                let (rho, eta) = (values[0], values[1]);
                let by_facets = at_facets(|cosine| dielectric(cosine, eta));
                let kept = kept(rho, eta, coat.mean_reflected(eta));
                add(&|seen| {
                    let enters = 1.0 - coat.reflected(eta, seen.cosine);
                    1.0 - weighted_sum(&seen.weights, &by_facets) - enters * (1.0 - kept)
                });
            }
        }
    }
}

impl Leaf<'_> {
    /// Whether ε is the same in all directions.
    fn is_even(&self) -> bool {
        match self.absorber {
            Absorber::Black | Absorber::Translucent => true,
            Absorber::Diffuse => self.two_sided,
            _ => false,
        }
    }
}

/// `scene` with the heat of its surfaces as emission of objects.
pub fn as_emission(scene: &Scene) -> Heat<'_> {
    let kinds = vec![Kind::Lamp; scene.objects.len()];
    let (by_angle, radiating) = (Vec::new(), Vec::new());
    let mut heat = Heat { scene: Cow::Borrowed(scene), by_angle, radiating, kinds, made: Vec::new() };
    let is_picture = |emission: &Emission| emission.texture.is_some();
    let pictures = scene.objects.iter().any(|object| object.emission.as_ref().is_some_and(is_picture));
    if scene.materials.iter().all(|material| material.temperature.is_none()) && !pictures {
        return heat;
    }
    let mut lit = scene.clone();
    let mut made: Vec<((MaterialId, OfLamp), (SpectrumId, Kind))> = Vec::new();
    for (index, object) in scene.objects.iter().enumerate() {
        let Some(material) = object.material else { continue };
        let emitted = object.emission.as_ref().map(|e| (e.radiance, e.sides == Sides::Both, e.texture));
        let known = made.iter().find(|(key, _)| *key == (material, emitted)).map(|(_, made)| *made);
        let (radiance, kind) = match known {
            Some(known) => known,
            None => {
                let mut parts = Vec::new();
                collect(scene, material, 1.0, &[], None, &mut parts);
                let is_picture = emitted.is_some_and(|(_, _, texture)| texture.is_some());
                if parts.is_empty() && !is_picture {
                    continue;
                }
                let by_place = is_picture || parts.iter().any(|part| part.differs_by_place(scene));
                let leaves: Vec<Leaf> = match by_place {
                    true => parts.iter().flat_map(|part| part.typical(scene)).collect(),
                    false => parts.iter().map(|part| part.leaf(scene)).collect(),
                };
                let name = format!("heat of \"{}\"", scene.materials[material].name);
                let of_lamp = |back: bool| {
                    emitted.filter(|(_, both, _)| *both || !back).map(|(spectrum, ..)| &scene.spectra[spectrum].curve)
                };
                let mut push = |curve: Curve| {
                    lit.spectra.push(Spectrum { name: name.clone(), curve, definition: None });
                    lit.spectra.len() - 1
                };
                let at = |cosines: &[f64], back: bool| radiance(of_lamp(back), &leaves, cosines, back, &scene.channels);
                let even = leaves.iter().all(Leaf::is_even) && emitted.is_none_or(|(_, both, _)| both);
                let new = if by_place {
                    let typical = at(&[TYPICAL_COSINE], false).remove(0);
                    heat.radiating.push(Radiating { parts, lamp: emitted });
                    (push(typical), Kind::ByPlace(heat.radiating.len() - 1))
                } else if even {
                    let spectrum = push(at(&[1.0], false).remove(0));
                    let lamp = emitted.map(|(lamp, ..)| lamp);
                    heat.made.push(Made { spectrum, lamp, parts });
                    (spectrum, Kind::Lamp)
                } else {
                    let cosines: [f64; COSINES] = std::array::from_fn(|j| (j as f64 / (COSINES - 1) as f64).powi(3));
                    let front = at(&cosines, false);
                    // Lights are chosen by what they send typically.
                    let typical = front[(TYPICAL_COSINE.cbrt() * (COSINES - 1) as f64) as usize].clone();
                    let same = leaves.iter().all(|leaf| leaf.two_sided) && emitted.is_none_or(|(_, both, _)| both);
                    let front: Vec<SpectrumId> = front.into_iter().map(&mut push).collect();
                    let back =
                        if same { front.clone() } else { at(&cosines, true).into_iter().map(&mut push).collect() };
                    heat.by_angle.push([front, back]);
                    (push(typical), Kind::ByAngle(heat.by_angle.len() - 1))
                };
                made.push(((material, emitted), new));
                new
            }
        };
        heat.kinds[index] = kind;
        // A white surface is hot in vain, unless its paint may be exchanged.
        if scene.is_factored() || lit.spectra[radiance].curve != Curve::Constant(0.0) {
            lit.objects[index].emission = Some(Emission { radiance, sides: Sides::Both, texture: None });
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
    out: &mut Vec<HotLeaf>,
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
            out.push(HotLeaf { material: id, weight, shares: shares.to_vec(), temperature });
        }
        _ => {}
    }
}

impl HotLeaf {
    /// Whether what it emits depends on more than the cosine.
    fn differs_by_place(&self, scene: &Scene) -> bool {
        let bsdf = &scene.materials[self.material].bsdf;
        let textured = match bsdf {
            Bsdf::Diffuse { reflectance } | Bsdf::Plastic { reflectance, .. } => {
                matches!(reflectance, Reflectance::Texture(_))
            }
            Bsdf::Translucent { reflectance, transmittance } => {
                [reflectance, transmittance].iter().any(|share| matches!(share, Reflectance::Texture(_)))
            }
            Bsdf::Conductor { roughness, .. } => {
                let [x, y] = roughness.of_hot_surface();
                x != y && x >= SMOOTH
            }
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
            Bsdf::Translucent { reflectance, transmittance } => {
                (Absorber::Translucent, vec![all_over(reflectance), all_over(transmittance)])
            }
            Bsdf::Conductor { eta, k, roughness, energy_compensation } => {
                let alpha = roughness.of_hot_surface();
                let absorber = match alpha[0] < SMOOTH {
                    true => Absorber::Mirror,
                    false => Absorber::RoughMetal {
                        facets: FacetCosines::shared(alpha),
                        again: energy_compensation.then(|| ReflectionAlbedo::shared(alpha)),
                    },
                };
                (absorber, vec![curve(eta), curve(k)])
            }
            Bsdf::Plastic { reflectance, eta, roughness } => {
                let alpha = roughness.of_hot_surface();
                let absorber = match alpha[0] < SMOOTH {
                    true => Absorber::Varnish,
                    false => Absorber::RoughPlastic {
                        facets: FacetCosines::shared(alpha),
                        coat: CoatAlbedo::shared(alpha[0], index_range(&curve(eta), &scene.channels)),
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
        let weight = self.weight * textures::mean_share(scene, &self.shares);
        let temperatures = match self.temperature {
            Temperature::Constant(kelvin) => vec![(1.0, kelvin)],
            Temperature::Texture(texture) => textures::typical_numbers(&scene.textures[texture]),
        };
        let leaf = |(share, kelvin): (f64, f64)| {
            let (absorber, curves) = match material.bsdf {
                Bsdf::Black => (Absorber::Black, vec![]),
                Bsdf::Diffuse { reflectance } => (Absorber::Diffuse, vec![mean(reflectance)]),
                Bsdf::Translucent { reflectance, transmittance } => {
                    (Absorber::Translucent, vec![mean(reflectance), mean(transmittance)])
                }
                Bsdf::Conductor { eta, k, .. } => (Absorber::Mirror, vec![curve(eta), curve(k)]),
                Bsdf::Plastic { reflectance, eta, .. } => (Absorber::Varnish, vec![mean(reflectance), curve(eta)]),
                Bsdf::Dielectric { .. } | Bsdf::Blend { .. } => unreachable!("`collect` has none"),
            };
            let two_sided = material.two_sided;
            Leaf { weight: weight * share, kelvin, two_sided, absorber, curves }
        };
        temperatures.into_iter().map(leaf).collect()
    }
}

/// E + Σ w ε B(λ, T) at each of the cosines, within `channels`.
fn radiance(emitted: Option<&Curve>, leaves: &[Leaf], cosines: &[f64], back: bool, channels: &Channels) -> Vec<Curve> {
    let seen: Vec<Vec<Seen>> =
        leaves.iter().map(|leaf| cosines.iter().map(|&cosine| leaf.seen(cosine)).collect()).collect();
    let is_grey = |leaf: &Leaf| leaf.kelvin == leaves[0].kelvin && leaf.curves.iter().all(|curve| curve.is_constant());
    if emitted.is_none() && leaves.iter().all(is_grey) {
        // Planck's law itself.
        let mut scales = vec![0.0; cosines.len()];
        for (leaf, seen) in leaves.iter().zip(&seen) {
            let values: Vec<f64> = leaf.curves.iter().map(|curve| curve.eval(channels.centre(0))).collect();
            leaf.add(seen, back, &values, leaf.weight, &mut scales);
        }
        let curve = |scale: f64| match scale {
            0.0 => Curve::Constant(0.0),
            scale => Curve::Blackbody { kelvin: leaves[0].kelvin, scale },
        };
        return scales.into_iter().map(curve).collect();
    }
    let tables = emitted.into_iter().chain(leaves.iter().flat_map(|leaf| leaf.curves.iter().map(|curve| &**curve)));
    let tables: Vec<&Curve> = tables.collect();
    let at = |nm: f64, values: &[f64], out: &mut [f64]| {
        let (lamp, mut values) = values.split_at(usize::from(emitted.is_some()));
        out.fill(lamp.iter().sum());
        for (leaf, seen) in leaves.iter().zip(&seen) {
            let (own, rest) = values.split_at(leaf.curves.len());
            values = rest;
            leaf.add(seen, back, own, leaf.weight * planck::radiance(nm, leaf.kelvin), out);
        }
    };
    Curve::derived_rows(&tables, channels, cosines.len(), at)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectral::Outside;

    fn leaf<'a>(reflectance: Option<&'a Curve>, weight: f64, kelvin: f64) -> Leaf<'a> {
        let absorber = if reflectance.is_some() { Absorber::Diffuse } else { Absorber::Black };
        let curves = reflectance.into_iter().map(Cow::Borrowed).collect();
        Leaf { weight, kelvin, two_sided: true, absorber, curves }
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
            let curve = radiance(emitted, &leaves, &[1.0], false, &channels).remove(0);
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
        let mixed = radiance(None, &[leaf(Some(&half), 0.5, 300.0), leaf(None, 0.5, 300.0)], &[1.0], false, &channels);
        assert_eq!(mixed, [Curve::Blackbody { kelvin: 300.0, scale: 0.75 }]);
        assert_eq!(radiance(None, &[leaf(Some(&white), 1.0, 300.0)], &[1.0], false, &channels), [Curve::Constant(0.0)]);
    }
}
