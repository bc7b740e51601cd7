//! Decision probabilities of next-event estimation, common to all channels (docs/METHOD.md, Decisions).

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use crate::device::accel::{Accel, Emitting};
use crate::device::emission::{Emitted, area, radiance};
use crate::device::part::{OnDevice, Part, Place, Records, SceneBuffer};
use crate::device::text::module;
use crate::device::words::{CONE_LINEAR, CONE_SMOOTH, LAMP_SPOT, Lamp};
use crate::scene::{Cone, Light, Profile, Scene};
use crate::spectral::Curve;

pub const AREA_LIGHTS: Part = Part {
    name: "area lights",
    used: |scene| scene.features.emitters,
    effect: |scene| format!("{} records of {} bytes a path", scene.frame.max_bounces + 1, scene.record_bytes()),
    is_planned: true,
    modules: &[(Place::Stage, module!("stages/emit.wgsl"))],
    lines: &[("EMIT", "emit(&list, path, meeting, site, v);")],
    defines: |_, _, defines| _ = defines.set("EMITTERS", true),
    records: |_| Records { way: 1, ..Records::NONE },
    example: Some(|exhibit| exhibit.add_lamp()),
    ..Part::NOTHING
};

pub const NEXT_EVENT: Part = Part {
    name: "next-event estimation",
    used: |scene| scene.features.environment || aims(scene),
    effect: |_| "a shadow ray a bounce".into(),
    is_planned: true,
    modules: &[(Place::Generate, module!("parts/lights/next_event.wgsl"))],
    defines: |_, _, defines| _ = defines.set("LIGHTS", true),
    ..Part::NOTHING
};

/// Whether there is a light that general scenes aim at.
fn aims(scene: &OnDevice) -> bool {
    scene.features.emitters || !scene.lamps.is_empty() || scene.sky.is_some()
}

pub const AIMS: Part = Part {
    name: "aiming at lights",
    used: |scene| scene.is_general() && aims(scene),
    modules: &[(Place::Stage, module!("stages/aim/light.wgsl"))],
    lines: &[
        ("AIM", "aim = aim_at_light(number, site, v, u_choice.x, draw(from_path, dimension + DIMENSION_LIGHT_POINT));"),
        ("LIGHT_WEIGHT", "weight = light_weight(aim, chance, path.scale);"),
    ],
    defines: |scene, _, defines| {
        defines.set("CHOOSES", scene.features.emitters || !scene.lamps.is_empty());
    },
    ..Part::NOTHING
};

pub const LAMPS: Part = Part {
    name: "point, directional, sun lights",
    used: |scene| !scene.lamps.is_empty(),
    effect: |_| "32 bytes a light".into(),
    is_planned: true,
    modules: &[
        (Place::Generate, module!("parts/lights/lamp.wgsl")),
        (Place::Stage, module!("parts/lights/aim_at_lamp.wgsl")),
    ],
    lines: &[("AIM_AT_EMITTER", "if (aims_at_lamp(&aim, emitter, seen_from, u)) { return aim; }")],
    defines: |_, _, defines| _ = defines.set("LAMPS", true),
    buffers: |scene| vec![SceneBuffer::new("lamps", &scene.prepared.lamps, "the lights of the scene", "fewer of them")],
    example: Some(|exhibit| exhibit.add_lights()),
    ..Part::NOTHING
};

pub const SPOTS: Part = Part {
    name: "spot lights",
    used: |scene| scene.lamps.iter().any(|lamp| lamp.kind == LAMP_SPOT),
    effect: |_| "32 bytes more of each".into(),
    is_planned: true,
    modules: &[(Place::Generate, module!("common/turn.wgsl")), (Place::Generate, module!("parts/lights/spot.wgsl"))],
    defines: |_, _, defines| _ = defines.set("SPOTS", true),
    example: Some(|exhibit| exhibit.add_spots()),
    ..Part::NOTHING
};

pub const SUNS: Part = Part {
    name: "suns",
    used: |scene| scene.suns > 0,
    modules: &[
        (Place::Generate, module!("parts/lights/sun.wgsl")),
        (Place::Stage, module!("parts/lights/arrive_from_suns.wgsl")),
    ],
    lines: &[("BEYOND", "arrive_from_suns(&list, path);")],
    defines: |scene, _, defines| _ = defines.constant("SUNS", scene.suns),
    // They may cover one another.
    records: |scene| Records { path: scene.suns, ..Records::NONE },
    ..Part::NOTHING
};

/// Emitting surfaces among what general scenes aim at; after lights without one.
pub const SURFACES: Part = Part {
    name: "aiming at surfaces",
    used: |scene| scene.is_general() && scene.features.emitters,
    modules: &[(Place::Stage, module!("stages/aim/surface.wgsl"))],
    lines: &[("AIM_AT_EMITTER", "aim_at_surface(&aim, path, emitter, seen_from, u);")],
    ..Part::NOTHING
};

/// 1 - cos of an angle, without cancellation.
pub fn versine(angle: f64) -> f64 {
    2.0 * (0.5 * angle).sin().powi(2)
}

/// The cone of a spot, as it stands after it among the lamps.
pub fn cone(direction: DVec3, cone: &Cone) -> Lamp {
    let (kind, [falls, ends]) = match cone.profile {
        Profile::Smooth => (CONE_SMOOTH, [cone.falloff, cone.half_angle].map(versine)),
        Profile::Linear => (CONE_LINEAR, [cone.falloff, cone.half_angle].map(|angle| angle * FRAC_1_PI)),
    };
    let place = direction.as_vec3().to_array();
    Lamp { place, kind, sine2: falls as f32, versine: ends as f32, ..Lamp::default() }
}

/// With which probability next-event estimation asks which light.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LightPicks {
    /// The environment's probability; multiples of 2⁻²⁴, like the random numbers that decide.
    pub environment: f64,
    /// Upper ends of the emitters' intervals, which lie above the environment's. After the emitters of the world the instances that
    /// emit, then `lamps`.
    pub cdf: Vec<f32>,
    /// Probability of each emitter, then of each lamp, exactly what the device's choice amounts to.
    pub emitters: Vec<f64>,
    /// Indices into the scene's lights in the order of their intervals: suns last.
    pub lamps: Vec<usize>,
    /// Within each assembly, upper ends and probabilities of what emits there, by areas in its own space.
    pub within: Vec<(Vec<f32>, Vec<f64>)>,
}

/// q = ½ mean over channels of a light's share + ½ its normalised largest share over channels, where the share is its
/// power over the total power in that channel. Channels without power are left out; if none has any, all lights are
/// equally likely. The emitting primitives, the instances that emit and the scene's lights are the lights and, with its radiance integrated over the
/// sphere, the environment.
pub fn light_picks(scene: &Scene, accel: &Accel, environment: Option<&Curve>) -> LightPicks {
    let mut lamps: Vec<usize> = (0..scene.lights.len()).collect();
    lamps.sort_by_key(|&i| matches!(scene.lights[i], Light::Sun { .. }));

    // Emitters of one spectrum differ by area only, so shares are worked out per spectrum.
    let emitted = Emitted::of(scene, accel, &lamps, environment);
    let by_spectrum = emitted.surfaces.len();
    let groups: Vec<(usize, f64)> = emitted.surfaces.iter().chain(&emitted.lamps).copied().collect();
    let spectra = groups.iter().map(|&(spectrum, factor)| (&scene.spectra[spectrum].curve, factor));
    let powers: Vec<Vec<f64>> = spectra
        .chain(emitted.environment.iter().map(|(flux, factor)| (&**flux, *factor)))
        .map(|(curve, factor)| scene.channels.bounds.iter().map(|b| factor * curve.mean(b[0], b[1])).collect())
        .collect();
    let mut shares = probabilities(&powers);
    if scene.is_factored() {
        // No source is left out that other spectra could make bright.
        let each = LEAST_SHARE / shares.len() as f64;
        shares.iter_mut().for_each(|share| *share = (1.0 - LEAST_SHARE) * *share + each);
    }

    let environment = match environment {
        Some(_) if groups.is_empty() => 1.0,
        // Steps of 2^-24, and never so small or large that a side would never be asked.
        Some(_) => (shares[groups.len()] * STEPS).round().clamp(1.0, STEPS - 1.0) / STEPS,
        None => 0.0,
    };
    let share_of = |spectrum: usize| {
        groups[..by_spectrum].iter().position(|g| g.0 == spectrum).map_or(0.0, |g| shares[g] / groups[g].1)
    };
    let weight = |e: &Emitting| share_of(radiance(scene, e)) * area(scene, e);
    let placed = accel.luminous.iter().map(|instance| accel.placed_emitters(instance).map(|e| weight(&e)).sum());
    let weights = accel.emitters.iter().map(weight).chain(placed);
    let weights: Vec<f64> = weights.chain(shares[by_spectrum..groups.len()].iter().copied()).collect();
    let (cdf, emitters) = intervals(environment, &weights);
    let within = accel.emitters_of.iter().map(|of| intervals(0.0, &of.iter().map(weight).collect::<Vec<f64>>()));
    let within = within.collect();
    LightPicks { environment, cdf, emitters, lamps, within }
}

/// Of an even share, what every source has at least where its spectrum may be exchanged after the render.
const LEAST_SHARE: f64 = 0.25;

/// Upper ends of the intervals in which a random number chooses each emitter, above the environment's [0, environment),
/// and their widths. All are multiples of 2⁻²⁴, like the random numbers, so that the widths are the probabilities.
fn intervals(environment: f64, weights: &[f64]) -> (Vec<f32>, Vec<f64>) {
    let total: f64 = weights.iter().sum();
    let (mut sum, mut last) = (0.0, environment);
    let end_of = |(i, weight): (usize, &f64)| {
        sum += if total > 0.0 { weight / total } else { 1.0 / weights.len() as f64 };
        let end = environment + sum.min(1.0) * (1.0 - environment);
        let end = if i + 1 == weights.len() { 1.0 } else { (end * STEPS).round() / STEPS };
        let width = end - last;
        last = end;
        (end as f32, width)
    };
    weights.iter().enumerate().map(end_of).unzip()
}

/// Random numbers on the device have 24 bits.
pub const STEPS: f64 = 16_777_216.0;

/// q by shares, see [`light_picks`], for `powers[light][channel]`.
fn probabilities(powers: &[Vec<f64>]) -> Vec<f64> {
    let channels = powers.first().map_or(0, Vec::len);
    let totals: Vec<f64> = (0..channels).map(|k| powers.iter().map(|p| p[k]).sum()).collect();
    let lit: Vec<usize> = (0..channels).filter(|&k| totals[k] > 0.0).collect();
    if lit.is_empty() {
        return vec![1.0 / powers.len().max(1) as f64; powers.len()];
    }
    let share = |p: &Vec<f64>, k: usize| p[k] / totals[k];
    let mean: Vec<f64> =
        powers.iter().map(|p| lit.iter().map(|&k| share(p, k)).sum::<f64>() / lit.len() as f64).collect();
    let largest: Vec<f64> = powers.iter().map(|p| lit.iter().map(|&k| share(p, k)).fold(0.0, f64::max)).collect();
    let largest_total: f64 = largest.iter().sum();
    mean.iter().zip(&largest).map(|(m, l)| 0.5 * m + 0.5 * l / largest_total).collect()
}

#[cfg(test)]
mod tests {
    use super::{intervals, probabilities};

    /// Emitters of all weights beside an environment that leaves them little or nothing: every random number of 24 bits
    /// is counted.
    #[test]
    fn probabilities_are_exactly_what_the_choice_amounts_to() {
        let steps = 16_777_216u32;
        let weights: Vec<f64> = (0..300).map(|i| f64::from(i % 7) * 10f64.powi(-(i % 5))).collect();
        for environment in [0.0, 0.5, 1.0 - 1000.0 / f64::from(steps), 1.0 - 1.0 / f64::from(steps)] {
            let (cdf, emitters) = intervals(environment, &weights);
            let mut counts = vec![0u32; weights.len()];
            for u in (environment * f64::from(steps)) as u32..steps {
                let u = u as f32 / steps as f32;
                counts[cdf.partition_point(|&end| end <= u)] += 1;
            }
            for (i, probability) in emitters.iter().enumerate() {
                assert_eq!(
                    *probability,
                    f64::from(counts[i]) / f64::from(steps),
                    "environment {environment}, emitter {i}"
                );
                let wanted = (1.0 - environment) * weights[i] / weights.iter().sum::<f64>();
                assert!(
                    (probability - wanted).abs() <= 1.0 / f64::from(steps),
                    "environment {environment}, emitter {i}"
                );
            }
        }
    }

    #[test]
    fn shares_follow_design_section_6() {
        // A sun that owns nine of ten channels and heat that owns one: mean shares .9/.1, largest shares 1/1.
        let sun: Vec<f64> = (0..10).map(|k| if k < 9 { 100.0 } else { 0.0 }).collect();
        let heat: Vec<f64> = (0..10).map(|k| if k < 9 { 0.0 } else { 1e-6 }).collect();
        let q = probabilities(&[sun, heat]);
        assert!((q[0] - 0.7).abs() < 1e-12 && (q[1] - 0.3).abs() < 1e-12, "{q:?}");
        // Dark channels are left out; without any power the choice is uniform.
        assert_eq!(probabilities(&[vec![0.0, 1.0], vec![0.0, 3.0]]), vec![0.25, 0.75]);
        assert_eq!(probabilities(&[vec![0.0; 4], vec![0.0; 4]]), vec![0.5, 0.5]);
    }
}
