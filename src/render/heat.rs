//! Hot surfaces as devices know them so far: those that send the same radiance in all directions, diffuse and black ones
//! and blends of such, emit it like any lamp. For devices a scene with them is one of lamps, and pays for nothing else.

use std::borrow::Cow;

use crate::scene::{Bsdf, Emission, MaterialId, Reflectance, Scene, Sides, Spectrum, Weight};
use crate::spectral::{Channels, Curve, Outside, planck};
use crate::{Error, Result};

/// Part of a surface: its share, its temperature in K, and its reflectance if it has one.
struct Leaf<'a> {
    weight: f64,
    kelvin: f64,
    reflectance: Option<&'a Curve>,
}

/// `scene` with the heat of its surfaces as emission of objects. Errors: heat that no device renders yet.
pub fn as_emission(scene: &Scene) -> Result<Cow<'_, Scene>> {
    if scene.materials.iter().all(|material| material.temperature.is_none()) {
        return Ok(Cow::Borrowed(scene));
    }
    let mut lit = scene.clone();
    let mut made: Vec<(MaterialId, Option<usize>, usize)> = Vec::new();
    for (index, object) in scene.objects.iter().enumerate() {
        let Some(material) = object.material else { continue };
        let mut leaves = Vec::new();
        collect(scene, material, 1.0, None, &mut leaves)?;
        if leaves.is_empty() {
            continue;
        }
        let emitted = object.emission.as_ref().map(|emission| emission.radiance);
        if object.emission.as_ref().is_some_and(|emission| emission.sides == Sides::Front) {
            return Err(refusal(
                scene,
                &format!("{} emits on its front side and is hot on both", object.name),
                "write emission_sides = \"both\", or remove the `temperature`",
            ));
        }
        let known = made.iter().find(|(m, e, _)| (*m, *e) == (material, emitted)).map(|(_, _, spectrum)| *spectrum);
        let radiance = known.unwrap_or_else(|| {
            let curve = radiance(emitted.map(|e| &scene.spectra[e].curve), &leaves, &scene.channels);
            lit.spectra.push(Spectrum { name: format!("heat of \"{}\"", scene.materials[material].name), curve });
            made.push((material, emitted, lit.spectra.len() - 1));
            lit.spectra.len() - 1
        });
        // A white surface is hot in vain.
        if lit.spectra[radiance].curve != Curve::Constant(0.0) {
            lit.objects[index].emission = Some(Emission { radiance, sides: Sides::Both });
        }
    }
    lit.materials.iter_mut().for_each(|material| material.temperature = None);
    Ok(Cow::Owned(lit))
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
    let kind = match material.bsdf {
        Bsdf::Blend { a, b, weight: Weight::Constant(of_b) } => {
            collect(scene, a, weight * (1.0 - of_b), kelvin, out)?;
            return collect(scene, b, weight * of_b, kelvin, out);
        }
        Bsdf::Blend { a, b, .. } => {
            let (mut hot, start) = (Vec::new(), material.temperature.or(kelvin));
            for part in [a, b] {
                collect(scene, part, weight, start, &mut hot)?;
            }
            if hot.is_empty() {
                return Ok(());
            }
            let what = format!("material \"{}\" is hot and blended by a texture", material.name);
            return Err(refusal(scene, &what, "blend by a number, or remove the `temperature`"));
        }
        Bsdf::Diffuse { .. } => "diffuse",
        Bsdf::Black => "black",
        Bsdf::Conductor { .. } => "conductor",
        Bsdf::Plastic { .. } => "plastic",
        // Absorbs nothing.
        Bsdf::Dielectric { .. } => return Ok(()),
    };
    let Some(kelvin) = kelvin.filter(|_| weight > 0.0) else { return Ok(()) };
    let reflectance = match material.bsdf {
        Bsdf::Diffuse { .. } if !material.two_sided => {
            let what =
                format!("material \"{}\" is hot and one-sided: its back would emit as a black body", material.name);
            return Err(refusal(scene, &what, "remove two_sided = false, or the `temperature`"));
        }
        Bsdf::Diffuse { reflectance: Reflectance::Spectrum(spectrum) } => Some(&scene.spectra[spectrum].curve),
        Bsdf::Diffuse { .. } => {
            let what = format!("material \"{}\" is hot and textured", material.name);
            return Err(refusal(scene, &what, "give it one reflectance, or remove the `temperature`"));
        }
        Bsdf::Black => None,
        _ => {
            let what = format!("material \"{}\" is hot and of kind `{kind}`", material.name);
            return Err(refusal(
                scene,
                &what,
                "use `diffuse`, `black` or a blend of them, or remove the `temperature`",
            ));
        }
    };
    out.push(Leaf { weight, kelvin, reflectance });
    Ok(())
}

/// E + Σ w (1 - ρ) B(λ, T) within `channels`.
fn radiance(emitted: Option<&Curve>, leaves: &[Leaf], channels: &Channels) -> Curve {
    let constant = |curve: &Curve| curve.is_constant().then(|| curve.eval(channels.centre(0)));
    let absorbed = |leaf: &Leaf| leaf.weight * (1.0 - leaf.reflectance.map_or(Some(0.0), constant).unwrap_or(f64::NAN));
    if emitted.is_none() && leaves.iter().all(|leaf| leaf.kelvin == leaves[0].kelvin) {
        // Grey: Planck's law itself.
        let scale: f64 = leaves.iter().map(absorbed).sum();
        if scale == 0.0 {
            return Curve::Constant(0.0);
        }
        if !scale.is_nan() {
            return Curve::Blackbody { kelvin: leaves[0].kelvin, scale };
        }
    }
    let tables: Vec<&Curve> = emitted.into_iter().chain(leaves.iter().filter_map(|leaf| leaf.reflectance)).collect();
    let heat = |nm: f64, reflectances: &[f64]| {
        let mut reflectances = reflectances.iter();
        let of_leaf = |leaf: &Leaf| {
            let rho = leaf.reflectance.and_then(|_| reflectances.next()).copied().unwrap_or(0.0);
            leaf.weight * (1.0 - rho) * planck::radiance(nm, leaf.kelvin)
        };
        leaves.iter().map(of_leaf).sum::<f64>()
    };
    // From bound to bound, each stretch by its own peak: the tail of Planck's law is as exact as its top.
    let mut edges: Vec<f64> = channels.bounds.iter().flatten().copied().collect();
    edges.sort_by(f64::total_cmp);
    edges.dedup();
    let (mut nm, mut value) = (Vec::new(), Vec::new());
    for edge in edges.windows(2) {
        if !channels.bounds.iter().any(|b| b[0] <= edge[0] && edge[1] <= b[1]) {
            continue;
        }
        // The wavelength itself is one of the curves that the sum is made of.
        let wavelength = Curve::Linear { nm: edge.to_vec(), value: edge.to_vec(), outside: Outside::Hold };
        let curves: Vec<&Curve> = std::iter::once(&wavelength).chain(tables.iter().copied()).collect();
        let at = |v: &[f64]| match emitted {
            None => heat(v[0], &v[1..]),
            Some(_) => v[1] + heat(v[0], &v[2..]),
        };
        let stretch = Channels::from_bounds(vec![[edge[0], edge[1]]], None);
        if let Curve::Linear { nm: x, value: y, .. } = Curve::derived(&curves, &stretch, at) {
            nm.extend(x);
            value.extend(y);
        }
    }
    Curve::Linear { nm, value, outside: Outside::Hold }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(value: [f64; 2]) -> Curve {
        Curve::Linear { nm: vec![380.0, 20e3], value: value.to_vec(), outside: Outside::Hold }
    }

    /// Means of every channel to 2e-5, also 30 orders below the peak.
    #[test]
    fn sums_keep_their_means_in_every_channel() {
        let channels = Channels::from_bounds(vec![[540.0, 560.0], [3e3, 5e3], [8e3, 14e3], [10e3, 12e3]], None);
        let (rho, step) = (
            table([0.2, 0.9]),
            Curve::Linear {
                nm: vec![4e3, 9e3, 9e3, 20e3],
                value: vec![1e-3, 1e-3, 2e-3, 2e-3],
                outside: Outside::Zero,
            },
        );
        let leaves = [
            Leaf { weight: 0.25, kelvin: 300.0, reflectance: Some(&rho) },
            Leaf { weight: 0.75, kelvin: 400.0, reflectance: None },
        ];
        for emitted in [None, Some(&step)] {
            let curve = radiance(emitted, &leaves, &channels);
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
        let leaf = |reflectance, weight| Leaf { weight, kelvin: 300.0, reflectance };
        let mixed = radiance(None, &[leaf(Some(&half), 0.5), leaf(None, 0.5)], &channels);
        assert_eq!(mixed, Curve::Blackbody { kelvin: 300.0, scale: 0.75 });
        assert_eq!(radiance(None, &[leaf(Some(&white), 1.0)], &channels), Curve::Constant(0.0));
    }
}
