//! Choosing what to aim at: a point on an emitting surface, one of the scene's lights, or its environment map.

use std::f64::consts::{PI, TAU};

use super::bsdf::{Bsdf, SpectralValues, Vertex, hemisphere};
use super::primitive::SurfacePoint;
use super::rng::Rng;
use super::sky::Sky;
use super::world::World;
use crate::scene::{Cone, Emission, Light, Object, Profile, Scene, Sides};

/// What was chosen.
pub enum Target {
    Surface(LightPoint),
    /// Index into `Scene::lights`.
    Light(usize),
    Sky,
}

/// A point on a light.
pub struct LightPoint {
    /// Index into [`World::primitives`].
    pub primitive: usize,
    pub point: SurfacePoint,
    /// Probability density by area of this choice, m⁻².
    pub density: f64,
}

/// Emitting primitives and other lights with the probability of each.
///
/// A light's probability is its share of the emitted power, averaged over the channels in which anything emits: so
/// whatever emits in any channel can be chosen, and no channel rules the others. The uniform environment is none.
pub struct Lights {
    choices: Vec<Choice>,
    /// Probability that one of `choices[..=i]` is chosen; the last is 1.
    cumulative: Vec<f64>,
    /// Per primitive of the world: probability over area, m⁻²; 0 where nothing is emitted.
    density: Vec<f64>,
    /// Probability of each of `Scene::lights`.
    lights: Vec<f64>,
    /// Probability of the environment map.
    pub sky: f64,
}

enum Choice {
    Primitive(usize),
    Light(usize),
    Sky,
}

impl Lights {
    /// `materials`: one for each of the scene.
    pub fn new(scene: &Scene, world: &World, sky: Option<&Sky>, materials: &[Bsdf]) -> Self {
        let mut object_area = vec![0.0; scene.objects.len()];
        for primitive in &world.primitives {
            object_area[primitive.object] += primitive.surface.area();
        }
        let Shares { objects, lights, sky } = shares(scene, &object_area, world.radius(), sky, materials);

        let density: Vec<f64> = world
            .primitives
            .iter()
            .map(|p| if objects[p.object] > 0.0 { objects[p.object] / object_area[p.object] } else { 0.0 })
            .collect();
        let primitives = world.primitives.iter().enumerate();
        let all = primitives
            .map(|(i, primitive)| (Choice::Primitive(i), density[i] * primitive.surface.area()))
            .chain(lights.iter().enumerate().map(|(i, share)| (Choice::Light(i), *share)))
            .chain([(Choice::Sky, sky)]);
        let (mut choices, mut cumulative, mut sum) = (Vec::new(), Vec::new(), 0.0);
        for (choice, probability) in all.filter(|(_, probability)| *probability > 0.0) {
            sum += probability;
            choices.push(choice);
            cumulative.push(sum);
        }
        // Shares sum to 1 but for rounding, which the last takes.
        if let Some(last) = cumulative.last_mut() {
            *last = 1.0;
        }
        Lights { choices, cumulative, density, lights, sky }
    }

    /// `None` where nothing emits.
    pub fn sample(&self, world: &World, rng: &mut Rng) -> Option<Target> {
        let choice = rng.uniform();
        Some(match self.choices.get(self.cumulative.partition_point(|&c| c <= choice))? {
            Choice::Primitive(primitive) => {
                let primitive = *primitive;
                let point = world.primitives[primitive].surface.sample(rng);
                Target::Surface(LightPoint { primitive, point, density: self.density[primitive] })
            }
            Choice::Light(light) => Target::Light(*light),
            Choice::Sky => Target::Sky,
        })
    }

    /// The density by area, m⁻², with which [`Lights::sample`] chooses a given point of `primitive`.
    pub fn density(&self, primitive: usize) -> f64 {
        self.density[primitive]
    }

    /// The probability with which [`Lights::sample`] chooses a light of the scene.
    pub fn probability(&self, light: usize) -> f64 {
        self.lights[light]
    }
}

/// Whether radiance leaves on this side.
pub fn emits(emission: &Emission, front: bool) -> bool {
    front || emission.sides == Sides::Both
}

/// Probabilities, which sum to 1 where anything emits.
struct Shares {
    objects: Vec<f64>,
    lights: Vec<f64>,
    sky: f64,
}

/// Powers are taken without the common factor π. What comes from far away has the power that enters a sphere of
/// `radius` around everything.
fn shares(scene: &Scene, area: &[f64], radius: f64, sky: Option<&Sky>, materials: &[Bsdf]) -> Shares {
    let heat: Vec<Option<Vec<f64>>> = materials.iter().map(|bsdf| heat(scene, bsdf)).collect();
    let mut shares =
        Shares { objects: vec![0.0; scene.objects.len()], lights: vec![0.0; scene.lights.len()], sky: 0.0 };
    let mut channels_lit = 0.0;
    for (k, &[from, to]) in scene.channels.bounds.iter().enumerate() {
        let mean = |spectrum: usize| scene.spectra[spectrum].curve.mean(from, to);
        let of_object = |(i, object): (usize, &Object)| {
            let emission = object.emission.as_ref().map_or(0.0, |emission| {
                let sides = if emission.sides == Sides::Both { 2.0 } else { 1.0 };
                sides * mean(emission.radiance)
            });
            let heat = object.material.and_then(|material| heat[material].as_ref());
            area[i] * (emission + heat.map_or(0.0, |heat| heat[k]))
        };
        let of_light = |light: &Light| {
            mean(light.spectrum())
                * match light {
                    Light::Point { .. } => 4.0,
                    Light::Spot { cone, .. } => spot_flux(cone) / PI,
                    Light::Directional { .. } | Light::Sun { .. } => radius * radius,
                }
        };
        let objects: Vec<f64> = scene.objects.iter().enumerate().map(of_object).collect();
        let lights: Vec<f64> = scene.lights.iter().map(of_light).collect();
        // A sphere of that radius has the area 4 π r²; one by one, 1/4 of the flux from each direction counts.
        let sky = sky.map_or(0.0, |sky| radius * radius * sky.flux[k]);
        let total = objects.iter().sum::<f64>() + lights.iter().sum::<f64>() + sky;
        if total > 0.0 {
            channels_lit += 1.0;
            let add = |share: &mut f64, power: f64| *share += power / total;
            shares.objects.iter_mut().zip(objects).for_each(|(share, power)| add(share, power));
            shares.lights.iter_mut().zip(lights).for_each(|(share, power)| add(share, power));
            add(&mut shares.sky, sky);
        }
    }
    if channels_lit > 0.0 {
        let all = shares.objects.iter_mut().chain(&mut shares.lights).chain([&mut shares.sky]);
        all.for_each(|share| *share /= channels_lit);
    }
    shares
}

/// What a spot of unit intensity on its axis sends out: the midpoint rule over the angle, whose error only makes a choice a
/// little less apt.
fn spot_flux(cone: &Cone) -> f64 {
    const RINGS: u32 = 256;
    let width = cone.half_angle / f64::from(RINGS);
    let angles = (0..RINGS).map(|i| (f64::from(i) + 0.5) * width);
    angles.map(|angle| TAU * angle.sin() * width * spot_share(cone, angle)).sum()
}

/// The intensity of a spot at an `angle` to its axis, over that on the axis.
pub fn spot_share(cone: &Cone, angle: f64) -> f64 {
    if angle >= cone.half_angle {
        return 0.0;
    }
    if angle <= cone.falloff {
        return 1.0;
    }
    match cone.profile {
        Profile::Linear => 1.0 - (angle - cone.falloff) / (cone.half_angle - cone.falloff),
        Profile::Smooth => {
            let t = (angle.cos() - cone.half_angle.cos()) / (cone.falloff.cos() - cone.half_angle.cos());
            3.0 * t.powi(2) - 2.0 * t.powi(3)
        }
    }
}

/// Places along u and along v that stand for a textured surface.
const TEXTURED_PLACES: u32 = 6;

/// Thermal radiance of both sides at the channels' centres, averaged over the hemisphere and over texture coordinates; `None` where there is none.
fn heat(scene: &Scene, bsdf: &Bsdf) -> Option<Vec<f64>> {
    if !bsdf.is_hot() {
        return None;
    }
    let mut spectra = SpectralValues::new(scene);
    spectra.begin(0.5);
    spectra.fill(bsdf.spectra());
    // Some places: what is chosen too seldom is met instead.
    let places = if bsdf.textures().is_empty() { 1 } else { TEXTURED_PLACES };
    let (mut sum, mut directions) = (vec![0.0; scene.channels.len()], 0.0);
    for i in 0..places * places {
        let at = glam::DVec2::new(f64::from(i % places), f64::from(i / places)) + 0.5;
        spectra.look_up(bsdf.textures(), at / f64::from(places));
        for o in hemisphere() {
            directions += 1.0;
            for inside in [false, true] {
                bsdf.emit(&Vertex { o, inside, spectra: &spectra, alive: 0..sum.len() }, &mut sum);
            }
        }
    }
    sum.iter_mut().for_each(|radiance| *radiance /= directions);
    Some(sum)
}

/// Solid angle of a disk of angular `radius`.
pub fn disk_solid_angle(radius: f64) -> f64 {
    4.0 * PI * (0.5 * radius).sin().powi(2)
}

/// A direction uniform over the disk of angular `radius` about `axis`.
pub fn sample_disk(axis: glam::DVec3, radius: f64, rng: &mut Rng) -> glam::DVec3 {
    // 1 - cosθ, without cancellation.
    let versine = rng.uniform() * 2.0 * (0.5 * radius).sin().powi(2);
    let sine = (versine * (2.0 - versine)).sqrt();
    let angle = TAU * rng.uniform();
    let (s, t) = axis.any_orthonormal_pair();
    (sine * (angle.cos() * s + angle.sin() * t) + (1.0 - versine) * axis).normalize()
}
