//! One path: from the camera, surface to surface, carrying all K channels.

use std::ops::Range;

use glam::DVec3;

use super::bsdf::{Bsdf, SpectralValues, Vertex};
use super::camera;
use super::lights::{LightPoint, Lights, emits};
use super::primitive::Ray;
use super::rng::Rng;
use super::shading::Shading;
use super::world::{Hit, World};
use crate::scene::{Scene, SpectrumId};

/// What tracing needs of a scene, prepared once and shared by all threads.
pub struct Tracer<'a> {
    scene: &'a Scene,
    world: World,
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
        }
    }

    /// Starts a path with wavelength coordinate `mu` (Eq. 4 of the method: one for all channels).
    fn begin(&mut self, mu: f64) {
        self.spectra.begin(mu);
        self.throughput.fill(1.0);
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
}

impl<'a> Tracer<'a> {
    pub fn new(scene: &'a Scene) -> Self {
        let world = World::new(&scene.objects);
        let lights = Lights::new(scene, &world);
        let materials = (0..scene.materials.len()).map(|material| Bsdf::new(scene, material)).collect();
        Tracer { scene, world, lights, materials }
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
                if let Some(environment) = &self.scene.environment {
                    path.gather(environment.radiance, 1.0);
                }
                return;
            };
            self.gather_emission(&ray, &hit, ray_density, path);
            if event == integrator.max_bounces {
                return;
            }

            let object = &self.scene.objects[self.world.primitives[hit.primitive].object];
            let bsdf = &self.materials[object.material];
            let light = self.lights.sample(&self.world, rng);
            let emission = light.as_ref().and_then(|light| self.emitted(light));
            path.spectra.fill(bsdf.spectra());
            path.spectra.fill(emission.as_slice());

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
            let Path { spectra, throughput, alive, radiance, factor } = &mut *path;
            let Some(scattering) = bsdf.at(Vertex { o, inside, spectra, alive: alive.clone() }) else { return };
            if let Some((light, emission)) = light.zip(emission)
                && let Some((direction, per_area)) = self.aim(&hit, &light)
                && shading.keeps_side(geometric, &frame, direction)
            {
                let scattered = scattering.evaluate(frame.transpose() * direction, factor);
                // The balance heuristic leaves f cosθ over the sum of both densities by solid angle.
                let weight = 1.0 / (light.density * per_area + scattered);
                for k in alive.clone() {
                    radiance[k] += throughput[k] * factor[k] * spectra.value(emission, k) * weight;
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

    /// The spectrum that a point of a light sends to anywhere.
    fn emitted(&self, light: &LightPoint) -> Option<SpectrumId> {
        let object = &self.scene.objects[self.world.primitives[light.primitive].object];
        object.emission.as_ref().map(|emission| emission.radiance)
    }

    /// The direction of a point of a light and its area per solid angle, m² sr⁻¹; `None` where it sends nothing there or
    /// is hidden.
    fn aim(&self, hit: &Hit, light: &LightPoint) -> Option<(DVec3, f64)> {
        let towards = light.point.position - hit.point.position;
        let distance = towards.length();
        if distance == 0.0 {
            return None;
        }
        let direction = towards / distance;
        let light_cosine = light.point.normal.dot(direction);
        let object = &self.scene.objects[self.world.primitives[light.primitive].object];
        if light_cosine == 0.0 || !object.emission.as_ref().is_some_and(|e| emits(e, light_cosine < 0.0)) {
            return None;
        }
        let from = self.world.leave(hit.primitive, &hit.point, direction);
        let to = self.world.leave(light.primitive, &light.point, -direction);
        (!self.world.occluded(from, to)).then(|| (direction, distance * distance / light_cosine.abs()))
    }
}
