//! Hot surfaces as devices have them: emission of objects. Where a surface sends the same radiance in all directions, as
//! diffuse and black ones and blends of such do, it is a lamp like any other, and costs nothing else. What depends on the
//! angle (metals, plastics, fronts that differ from backs) is a row of spectra, one for each of some cosines.

use std::borrow::Cow;

use glam::DVec3;

use crate::scattering::fresnel::{conductor, dielectric, mean_conductor, mean_dielectric};
use crate::scattering::{DielectricAlbedo, FACET_COSINES, FacetCosines, ReflectionAlbedo, facet_cosine, index_range};
use crate::scene::{Bsdf, Emission, MaterialId, Reflectance, SMOOTH, Scene, Sides, Spectrum, SpectrumId, Weight};
use crate::spectral::{Channels, Curve, planck};
use crate::{Error, Result};

/// Cosines (j / (n - 1))³ at which the emission of a side is known; between them it is linear in j.
pub const COSINES: usize = 128;

/// A scene whose heat is emission of its objects.
pub struct Heat<'a> {
    pub scene: Cow<'a, Scene>,
    /// Spectra of the scene at [`COSINES`] cosines, of fronts and backs.
    pub by_angle: Vec<[Vec<SpectrumId>; 2]>,
    /// For each object that emits by angle, its place in `by_angle`.
    pub groups: Vec<Option<usize>>,
}

/// What decides an object's emission: its material, and the spectrum of its lamp and whether that is on both sides.
type Source = (MaterialId, Option<(SpectrumId, bool)>);

/// A hot part of a surface.
struct Leaf<'a> {
    weight: f64,
    kelvin: f64,
    two_sided: bool,
    absorber: Absorber,
    /// What the absorber depends on, in its order.
    curves: Vec<&'a Curve>,
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

/// `scene` with the heat of its surfaces as emission of objects. Errors: heat that no device renders yet.
pub fn as_emission(scene: &Scene) -> Result<Heat<'_>> {
    let mut heat = Heat { scene: Cow::Borrowed(scene), by_angle: Vec::new(), groups: vec![None; scene.objects.len()] };
    if scene.materials.iter().all(|material| material.temperature.is_none()) {
        return Ok(heat);
    }
    let mut lit = scene.clone();
    let mut made: Vec<(Source, (SpectrumId, Option<usize>))> = Vec::new();
    for (index, object) in scene.objects.iter().enumerate() {
        let Some(material) = object.material else { continue };
        let emitted = object.emission.as_ref().map(|e| (e.radiance, e.sides == Sides::Both));
        let known = made.iter().find(|(key, _)| *key == (material, emitted)).map(|(_, made)| *made);
        let (radiance, group) = match known {
            Some(known) => known,
            None => {
                let mut leaves = Vec::new();
                collect(scene, material, 1.0, None, &mut leaves)?;
                if leaves.is_empty() {
                    continue;
                }
                let name = format!("heat of \"{}\"", scene.materials[material].name);
                let of_lamp = |back: bool| {
                    emitted.filter(|(_, both)| *both || !back).map(|(spectrum, _)| &scene.spectra[spectrum].curve)
                };
                let mut push = |curve: Curve| {
                    lit.spectra.push(Spectrum { name: name.clone(), curve });
                    lit.spectra.len() - 1
                };
                let even = leaves.iter().all(Leaf::is_even) && emitted.is_none_or(|(_, both)| both);
                let new = if even {
                    (push(radiance(of_lamp(false), &leaves, 1.0, false, &scene.channels)), None)
                } else {
                    let row = |back: bool| -> Vec<Curve> {
                        let cosine = |j: usize| (j as f64 / (COSINES - 1) as f64).powi(3);
                        let at = |j: usize| radiance(of_lamp(back), &leaves, cosine(j), back, &scene.channels);
                        (0..COSINES).map(at).collect()
                    };
                    let front = row(false);
                    // Lights are chosen by what they send at a cosine of 2/3, the mean over the hemisphere.
                    let typical = front[(0.874 * (COSINES - 1) as f64) as usize].clone();
                    let same = leaves.iter().all(|leaf| leaf.two_sided) && emitted.is_none_or(|(_, both)| both);
                    let front: Vec<SpectrumId> = front.into_iter().map(&mut push).collect();
                    let back = if same { front.clone() } else { row(true).into_iter().map(&mut push).collect() };
                    heat.by_angle.push([front, back]);
                    (push(typical), Some(heat.by_angle.len() - 1))
                };
                made.push(((material, emitted), new));
                new
            }
        };
        heat.groups[index] = group;
        // A white surface is hot in vain.
        if lit.spectra[radiance].curve != Curve::Constant(0.0) {
            lit.objects[index].emission = Some(Emission { radiance, sides: Sides::Both });
        }
    }
    lit.materials.iter_mut().for_each(|material| material.temperature = None);
    heat.scene = Cow::Owned(lit);
    Ok(heat)
}

fn refusal(scene: &Scene, what: &str, help: &str) -> Error {
    Error::input(&scene.file, format!("{what}, which cannot be rendered yet: {help}"))
}

/// The hot parts of a material; `kelvin`: of the blend around, for what has no temperature of its own.
fn collect<'a>(
    scene: &'a Scene,
    id: MaterialId,
    weight: f64,
    kelvin: Option<f64>,
    out: &mut Vec<Leaf<'a>>,
) -> Result<()> {
    let material = &scene.materials[id];
    let kelvin = material.temperature.or(kelvin);
    let curve = |spectrum: SpectrumId| &scene.spectra[spectrum].curve;
    let refuse = |what: &str, help: &str| {
        Err(refusal(scene, &format!("material \"{}\" is hot and {what}", material.name), help))
    };
    if let Bsdf::Blend { a, b, weight: of_b } = material.bsdf {
        if let Weight::Constant(of_b) = of_b {
            collect(scene, a, weight * (1.0 - of_b), kelvin, out)?;
            return collect(scene, b, weight * of_b, kelvin, out);
        }
        let mut hot = Vec::new();
        for part in [a, b] {
            collect(scene, part, weight, kelvin, &mut hot)?;
        }
        return match hot.is_empty() {
            true => Ok(()),
            false => refuse("blended by a texture", "blend by a number, or remove the `temperature`"),
        };
    }
    let Some(kelvin) = kelvin.filter(|_| weight > 0.0) else { return Ok(()) };
    let one_reflectance = |reflectance: Reflectance| match reflectance {
        Reflectance::Spectrum(spectrum) => Ok(curve(spectrum)),
        Reflectance::Texture(_) => {
            refuse("textured", "give it one reflectance, or remove the `temperature`").map(|()| curve(0))
        }
    };
    let (absorber, curves) = match material.bsdf {
        // Absorbs nothing.
        Bsdf::Dielectric { .. } | Bsdf::Blend { .. } => return Ok(()),
        Bsdf::Black => (Absorber::Black, vec![]),
        Bsdf::Diffuse { reflectance } => (Absorber::Diffuse, vec![one_reflectance(reflectance)?]),
        Bsdf::Conductor { roughness: [x, y], .. } if x != y => {
            return refuse("brushed, of two roughnesses", "give it one roughness, or remove the `temperature`");
        }
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
                    coat: DielectricAlbedo::new(roughness, index_range(curve(eta), &scene.channels)),
                },
            };
            (absorber, vec![one_reflectance(reflectance)?, curve(eta)])
        }
    };
    out.push(Leaf { weight, kelvin, two_sided: material.two_sided, absorber, curves });
    Ok(())
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
    let tables = emitted.into_iter().chain(leaves.iter().flat_map(|leaf| leaf.curves.iter().copied()));
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
        Leaf { weight, kelvin, two_sided: true, absorber, curves: reflectance.into_iter().collect() }
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
