//! What emits in a scene: spectra and how much of each, by which lights are chosen and wavelengths drawn.

use std::borrow::Cow;

use crate::device::accel::{Accel, Emitting};
use crate::device::parts::media::{absorption, extent};
use crate::scene::{Cone, Light, Medium, Profile, Scene, Sides};
use crate::spectral::{Curve, planck};

/// A spectrum of radiance or the like, and what its power is proportional to.
pub type Share<'a> = (Cow<'a, Curve>, f64);

/// The scene's emission, each part times its factor: power over π, in device units.
pub struct Emitted<'a> {
    /// Of the surfaces of each spectrum (by its number in the scene), in ascending order.
    pub surfaces: Vec<(usize, f64)>,
    /// Of the scene's lights, in the order asked for.
    pub lamps: Vec<(usize, f64)>,
    /// Of the environment: its radiance integrated over the sphere.
    pub environment: Option<Share<'a>>,
}

impl<'a> Emitted<'a> {
    /// Of the primitives and `lamps` (indices of the scene's lights).
    pub fn of(scene: &Scene, accel: &Accel, lamps: &[usize], environment: Option<&'a Curve>) -> Emitted<'a> {
        let mut areas = vec![0.0; scene.spectra.len()];
        for emitter in accel.all_emitters() {
            areas[radiance(scene, &emitter)] += area(scene, &emitter);
        }
        // What comes from afar lights the cross-section of a sphere around everything.
        let cross_section = accel.space.radius.powi(2);
        let of_lamp = |&i: &usize| {
            let light = &scene.lights[i];
            let per_value = match light {
                Light::Point { .. } => 4.0 * accel.space.scale.powi(2),
                Light::Spot { cone, .. } => flux_over_pi(cone) * accel.space.scale.powi(2),
                Light::Directional { .. } | Light::Sun { .. } => cross_section,
            };
            (light.spectrum(), per_value)
        };
        Emitted {
            surfaces: areas.into_iter().enumerate().filter(|(_, area)| *area > 0.0).collect(),
            lamps: lamps.iter().map(of_lamp).collect(),
            environment: environment.map(|flux| (Cow::Borrowed(flux), cross_section)),
        }
    }

    /// All of them, and the media.
    pub fn shares(self, scene: &'a Scene, accel: &Accel) -> Vec<Share<'a>> {
        let of_scene = |&(spectrum, factor): &(usize, f64)| (Cow::Borrowed(&scene.spectra[spectrum].curve), factor);
        let mut shares: Vec<Share> = self.surfaces.iter().chain(&self.lamps).map(of_scene).collect();
        shares.extend(self.environment);
        shares.extend(hot_gases(scene, accel));
        shares
    }
}

/// What a spot sends out, over π and its intensity on the axis: 2 ∫ profile(θ) sin θ dθ.
fn flux_over_pi(cone: &Cone) -> f64 {
    let (inner, outer) = (cone.falloff, cone.half_angle);
    match cone.profile {
        // Over 1 - cos θ the step is as much above ½ as below.
        Profile::Smooth => (1.0 - inner.cos()) + (1.0 - outer.cos()),
        Profile::Linear if outer - inner < 1e-6 => 2.0 * (1.0 - outer.cos()),
        Profile::Linear => 2.0 * (1.0 - (outer.sin() - inner.sin()) / (outer - inner)),
    }
}

/// The spectrum that an emitting primitive has in the scene.
pub fn radiance(scene: &Scene, &(_, object, _): &Emitting) -> usize {
    scene.objects[object].emission.as_ref().expect("emitters come from emitting objects").radiance
}

/// Its emitting area in device units.
pub fn area(scene: &Scene, &(_, object, area): &Emitting) -> f64 {
    let both = scene.objects[object].emission.as_ref().is_some_and(|emission| emission.sides == Sides::Both);
    area * if both { 2.0 } else { 1.0 }
}

/// Media as grey bodies that fill a sphere around them, of one temperature and density each: this decides where wavelengths
/// are drawn, and nothing else.
fn hot_gases<'a>(scene: &'a Scene, accel: &Accel) -> Vec<Share<'a>> {
    let mut bodies: Vec<(usize, f64)> = Vec::new();
    let mut seen = Vec::new();
    for object in &scene.objects {
        let Some(interior) = object.interior else { continue };
        if seen.contains(&interior.body) {
            continue;
        }
        seen.push(interior.body);
        bodies.push((interior.medium, 0.5 * extent(scene, accel, Some(&interior))));
    }
    bodies.extend(scene.camera_medium.map(|medium| (medium, 0.5 * extent(scene, accel, None))));
    let share = |(medium, radius): (usize, f64)| {
        let medium = &scene.media[medium];
        let (kelvin, densities) = typical(medium)?;
        let mut densities = densities.into_iter();
        let (spectra, factors) = absorption(medium, Some(kelvin), |_| densities.next().unwrap_or(0.0));
        let curves: Vec<&Curve> = spectra.iter().map(|&s| &scene.spectra[s].curve).collect();
        // The mean way through a sphere.
        let way = 4.0 / 3.0 * radius;
        let emitted = |nm: f64, v: &[f64]| {
            let depth: f64 = v.iter().zip(&factors).map(|(v, f)| v * f).sum::<f64>() * way;
            -(-depth).exp_m1() * planck::radiance(nm, kelvin)
        };
        let area = 4.0 * std::f64::consts::PI * (radius * accel.space.scale).powi(2);
        Some((Cow::Owned(Curve::derived_by_stretch(&curves, &scene.channels, emitted)), area))
    };
    bodies.into_iter().filter_map(share).collect()
}

/// The temperature of a medium that emits and the densities of its kinds of matter: means over its voxels, weighted with density x
/// T⁴, the density that of all kinds together.
fn typical(medium: &Medium) -> Option<(f64, Vec<f64>)> {
    let temperature = medium.temperature.as_ref()?;
    let count = medium.grid_size().map_or(1, |size| size.iter().map(|&side| side as usize).product());
    let (mut weights, mut kelvin, mut densities) = (0.0, 0.0, vec![0.0; medium.components.len()]);
    for i in 0..count {
        let (t, n) = (temperature.at(i), medium.components.iter().map(|component| component.density.at(i)));
        let weight = n.clone().sum::<f64>() * t.powi(4);
        weights += weight;
        kelvin += weight * t;
        densities.iter_mut().zip(n).for_each(|(sum, n)| *sum += weight * n);
    }
    (weights > 0.0).then(|| (kelvin / weights, densities.into_iter().map(|sum| sum / weights).collect()))
}
