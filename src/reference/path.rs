//! One path: from the camera, surface to surface, carrying all K channels.

use std::f64::consts::PI;
use std::ops::Range;

use glam::DVec3;

use super::bsdf::{Bsdf, SpectralValues, Vertex};
use super::camera;
use super::lights::{LightPoint, Lights, Target, disk_solid_angle, emits, sample_disk};
use super::primitive::Ray;
use super::rng::Rng;
use super::shading::Shading;
use super::sky::Sky;
use super::world::{Hit, World};
use crate::scene::{Environment, Light, Scene, SpectrumId};

/// What tracing needs of a scene, prepared once and shared by all threads.
pub struct Tracer<'a> {
    scene: &'a Scene,
    world: World,
    /// The environment, where it is a map.
    sky: Option<Sky<'a>>,
    lights: Lights,
    /// One for each material of the scene.
    materials: Vec<Bsdf>,
}

/// The K-channel state of the path under way; reused from path to path.
pub struct Path<'a> {
    spectra: SpectralValues<'a>,
    /// Product of what the surfaces did so far.
    throughput: Vec<f64>,
    /// The channels that have not stopped: all, or the one that ideal dispersive refraction left.
    alive: Range<usize>,
    /// Radiance gathered so far, W m⁻² sr⁻¹ nm⁻¹.
    pub radiance: Vec<f64>,
    /// What one vertex does to each channel.
    factor: Vec<f64>,
    /// Radiance of what is aimed at or met, or what takes its place.
    emitted: Vec<f64>,
}

/// A way to some light, chosen at a vertex.
struct Aim {
    direction: DVec3,
    /// Where the light is; `None` at infinity.
    target: Option<DVec3>,
    /// Density by solid angle of the choice; `None` for lights without extent, which are never met.
    density: Option<f64>,
    emitted: Emitted,
}

/// Radiance in all channels; of lights without extent, irradiance over the probability of their choice.
enum Emitted {
    Spectrum { spectrum: SpectrumId, scale: f64 },
    Sky(DVec3),
}

impl<'a> Path<'a> {
    pub fn new(scene: &'a Scene) -> Self {
        let channels = scene.channels.len();
        Path {
            spectra: SpectralValues::new(scene),
            throughput: vec![0.0; channels],
            alive: 0..channels,
            radiance: vec![0.0; channels],
            factor: vec![0.0; channels],
            emitted: vec![0.0; channels],
        }
    }

    /// Starts a path with wavelength coordinate `mu` (Eq. 4 of the method: one for all channels).
    fn begin(&mut self, mu: f64) {
        self.spectra.begin(mu);
        for (k, throughput) in self.throughput.iter_mut().enumerate() {
            *throughput = self.spectra.response(k);
        }
        self.radiance.fill(0.0);
        self.alive = 0..self.throughput.len();
    }

    /// Radiance += throughput · spectrum · weight.
    fn gather(&mut self, spectrum: SpectrumId, weight: f64) {
        let values = self.spectra.get(spectrum);
        for k in self.alive.clone() {
            self.radiance[k] += self.throughput[k] * values[k] * weight;
        }
    }

    /// Sets `emitted`.
    fn look_up(&mut self, emitted: &Emitted, sky: Option<&Sky>) {
        match (emitted, sky) {
            (Emitted::Spectrum { spectrum, scale }, _) => {
                let values = self.spectra.get(*spectrum);
                self.emitted.iter_mut().zip(values).for_each(|(e, value)| *e = scale * value);
            }
            (Emitted::Sky(direction), Some(sky)) => {
                sky.radiance(*direction, self.spectra.wavelengths(), &mut self.emitted);
                if let Some(daylight) = sky.daylight() {
                    let values = self.spectra.get(daylight);
                    self.emitted.iter_mut().zip(values).for_each(|(e, value)| *e *= value);
                }
            }
            (Emitted::Sky(_), None) => self.emitted.fill(0.0),
        }
    }
}

impl<'a> Tracer<'a> {
    pub fn new(scene: &'a Scene) -> Self {
        let world = World::new(&scene.objects);
        let sky = scene.environment.as_ref().and_then(|environment| environment.map()).map(|map| Sky::new(scene, map));
        let lights = Lights::new(scene, &world, sky.as_ref());
        let materials = (0..scene.materials.len()).map(|material| Bsdf::new(scene, material)).collect();
        Tracer { scene, world, sky, lights, materials }
    }

    /// Traces one path through `pixel` and leaves its radiance in `path`.
    ///
    /// Emission is found in two ways, by aiming at lights and by meeting them, which are combined by the balance
    /// heuristic (Veach 1997, section 9.2.2). The uniform environment is only met.
    pub fn trace(&self, pixel: [u32; 2], rng: &mut Rng, path: &mut Path) {
        let integrator = &self.scene.integrator;
        path.begin(rng.uniform());
        let mut ray = camera::ray(&self.scene.camera, &self.scene.film, pixel, rng);
        // Density by solid angle with which the ray was chosen; none where lights could not have been aimed at instead:
        // for camera rays, mirrors and ideal refraction.
        let mut ray_density = None;

        for event in 0..=integrator.max_bounces {
            let Some(hit) = self.world.closest_hit(&ray) else {
                self.gather_from_afar(ray.direction, ray_density, path);
                return;
            };
            self.gather_emission(&ray, &hit, ray_density, path);
            if event == integrator.max_bounces {
                return;
            }

            let object = &self.scene.objects[self.world.primitives[hit.primitive].object];
            let bsdf = &self.materials[object.material.expect("null boundaries are refused")];
            let aim = self.aim(&hit, rng);
            path.spectra.fill(bsdf.spectra());
            if let Some(aim) = &aim {
                path.look_up(&aim.emitted, self.sky.as_ref());
            }

            let inside = hit.point.normal.dot(ray.direction) > 0.0;
            let geometric = if inside { -hit.point.normal } else { hit.point.normal };
            let shading = Shading::new(&object.attributes, &self.world.primitives[hit.primitive], &hit.point);
            path.spectra.look_up(bsdf.textures(), shading.uv);
            let frame = shading.frame(geometric, inside, -ray.direction);
            let o = frame.transpose() * -ray.direction;
            if o.z <= 0.0 {
                // Along the surface to the last bit.
                return;
            }
            let Path { spectra, throughput, alive, radiance, factor, emitted } = &mut *path;
            let Some(scattering) = bsdf.at(Vertex { o, inside, spectra, alive: alive.clone() }) else { return };
            let kept = aim.filter(|aim| shading.keeps_side(geometric, &frame, aim.direction));
            if let Some(aim) = kept.filter(|aim| self.is_visible(&hit, aim)) {
                let scattered = scattering.evaluate(frame.transpose() * aim.direction, factor);
                // The balance heuristic leaves f cosθ over the sum of both densities by solid angle.
                let weight = aim.density.map_or(1.0, |density| 1.0 / (density + scattered));
                for k in alive.clone() {
                    radiance[k] += throughput[k] * factor[k] * emitted[k] * weight;
                }
            }

            if integrator.russian_roulette_start > 0 && event + 1 >= integrator.russian_roulette_start {
                let survival = scattering.survival();
                if rng.uniform() >= survival {
                    return;
                }
                throughput.iter_mut().for_each(|t| *t /= survival);
            }

            let Some(next) = scattering.sample(std::array::from_fn(|_| rng.uniform()), factor) else { return };
            for k in alive.clone() {
                throughput[k] *= factor[k];
            }
            if let Some(channel) = next.channel {
                *alive = channel..channel + 1;
            }
            if throughput[alive.clone()].iter().all(|t| *t == 0.0) {
                return;
            }
            ray_density = next.density;
            let direction = (frame * next.direction).normalize();
            if !shading.keeps_side(geometric, &frame, direction) {
                return;
            }
            ray = Ray { origin: self.world.leave(hit.primitive, &hit.point, direction), direction };
        }
    }

    /// Emission of the surface that a ray meets.
    fn gather_emission(&self, ray: &Ray, hit: &Hit, ray_density: Option<f64>, path: &mut Path) {
        let cosine = hit.point.normal.dot(ray.direction);
        let object = &self.scene.objects[self.world.primitives[hit.primitive].object];
        let Some(emission) = object.emission.as_ref().filter(|e| emits(e, cosine < 0.0)) else { return };
        let weight = match ray_density {
            None => 1.0,
            Some(density) => {
                let light_density = self.lights.density(hit.primitive) * hit.t * hit.t / cosine.abs();
                density / (density + light_density)
            }
        };
        path.gather(emission.radiance, weight);
    }

    /// What arrives from beyond all surfaces: the environment and the suns in that direction.
    fn gather_from_afar(&self, direction: DVec3, ray_density: Option<f64>, path: &mut Path) {
        // The balance heuristic, for light that could have been aimed at with density `other`.
        let weight = |other: f64| ray_density.map_or(1.0, |density| density / (density + other));
        match (&self.scene.environment, &self.sky) {
            (Some(Environment::Uniform(radiance)), _) => path.gather(*radiance, 1.0),
            (Some(Environment::Map(_)), Some(sky)) => {
                path.look_up(&Emitted::Sky(direction), Some(sky));
                let weight = weight(self.lights.sky * sky.density(direction));
                for k in path.alive.clone() {
                    path.radiance[k] += path.throughput[k] * path.emitted[k] * weight;
                }
            }
            _ => {}
        }
        for (i, light) in self.scene.lights.iter().enumerate() {
            if let Light::Sun { direction: travel, angular_radius, irradiance } = light
                && direction.dot(-*travel) >= angular_radius.cos()
            {
                let density = self.lights.probability(i) / disk_solid_angle(*angular_radius);
                path.gather(*irradiance, weight(density) * radiance_of_disk(*angular_radius));
            }
        }
    }

    /// Chooses a light and a way to it; `None` where it sends nothing there.
    fn aim(&self, hit: &Hit, rng: &mut Rng) -> Option<Aim> {
        match self.lights.sample(&self.world, rng)? {
            Target::Surface(light) => self.aim_at_surface(hit, &light),
            Target::Light(light) => {
                let probability = self.lights.probability(light);
                match self.scene.lights[light] {
                    Light::Point { position, intensity } => {
                        let towards = position - hit.point.position;
                        let distance2 = towards.length_squared();
                        let emitted = Emitted::Spectrum { spectrum: intensity, scale: 1.0 / (distance2 * probability) };
                        let direction = towards.try_normalize()?;
                        Some(Aim { direction, target: Some(position), density: None, emitted })
                    }
                    Light::Directional { direction, irradiance } => {
                        let emitted = Emitted::Spectrum { spectrum: irradiance, scale: 1.0 / probability };
                        Some(Aim { direction: -direction, target: None, density: None, emitted })
                    }
                    Light::Sun { direction, angular_radius, irradiance } => {
                        let density = probability / disk_solid_angle(angular_radius);
                        let scale = radiance_of_disk(angular_radius);
                        let emitted = Emitted::Spectrum { spectrum: irradiance, scale };
                        let direction = sample_disk(-direction, angular_radius, rng);
                        Some(Aim { direction, target: None, density: Some(density), emitted })
                    }
                }
            }
            Target::Sky => {
                let (direction, density) = self.sky.as_ref()?.sample(rng);
                let density = Some(self.lights.sky * density);
                Some(Aim { direction, target: None, density, emitted: Emitted::Sky(direction) })
            }
        }
    }

    fn aim_at_surface(&self, hit: &Hit, light: &LightPoint) -> Option<Aim> {
        let towards = light.point.position - hit.point.position;
        let distance = towards.length();
        if distance == 0.0 {
            return None;
        }
        let direction = towards / distance;
        let light_cosine = light.point.normal.dot(direction);
        let object = &self.scene.objects[self.world.primitives[light.primitive].object];
        let emission = object.emission.as_ref()?;
        if light_cosine == 0.0 || !emits(emission, light_cosine < 0.0) {
            return None;
        }
        Some(Aim {
            direction,
            target: Some(self.world.leave(light.primitive, &light.point, -direction)),
            density: Some(light.density * distance * distance / light_cosine.abs()),
            emitted: Emitted::Spectrum { spectrum: emission.radiance, scale: 1.0 },
        })
    }

    fn is_visible(&self, hit: &Hit, aim: &Aim) -> bool {
        let origin = self.world.leave(hit.primitive, &hit.point, aim.direction);
        match aim.target {
            Some(target) => !self.world.occluded(origin, target),
            None => self.world.closest_hit(&Ray { origin, direction: aim.direction }).is_none(),
        }
    }
}

/// Radiance of a disk of angular `radius` that causes a unit irradiance facing it, sr⁻¹: ∫ cosθ over it is π sin².
fn radiance_of_disk(radius: f64) -> f64 {
    1.0 / (PI * radius.sin().powi(2))
}
