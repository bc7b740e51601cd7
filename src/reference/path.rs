//! One path: from the camera, surface to surface, carrying all K channels.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::camera;
use super::lights::{Lights, emits};
use super::primitive::{Ray, SurfacePoint};
use super::rng::Rng;
use super::world::{Hit, World};
use crate::scene::{Bsdf, Scene, SpectrumId};

/// What tracing needs of a scene, prepared once and shared by all threads.
pub struct Tracer<'a> {
    scene: &'a Scene,
    world: World,
    lights: Lights,
}

/// The K-channel state of the path under way; reused from path to path.
pub struct Path<'a> {
    scene: &'a Scene,
    /// Wavelength samples λ_k in nm.
    wavelength: Vec<f64>,
    /// Product of the reflectances so far.
    throughput: Vec<f64>,
    /// Radiance gathered so far, W m⁻² sr⁻¹ nm⁻¹.
    pub radiance: Vec<f64>,
    /// Every spectrum of the scene at the wavelength samples, filled when first asked for.
    values: Vec<Option<Vec<f64>>>,
}

impl<'a> Path<'a> {
    pub fn new(scene: &'a Scene) -> Self {
        let channels = scene.channels.len();
        Path {
            scene,
            wavelength: vec![0.0; channels],
            throughput: vec![0.0; channels],
            radiance: vec![0.0; channels],
            values: vec![None; scene.spectra.len()],
        }
    }

    /// Starts a path with wavelength coordinate `mu` (Eq. 4 of the method: one for all channels).
    fn begin(&mut self, mu: f64) {
        for (k, wavelength) in self.wavelength.iter_mut().enumerate() {
            *wavelength = self.scene.channels.wavelength(k, mu);
        }
        self.throughput.fill(1.0);
        self.radiance.fill(0.0);
        for (values, spectrum) in self.values.iter_mut().zip(&self.scene.spectra) {
            if !spectrum.curve.is_constant() {
                *values = None;
            }
        }
    }

    /// Radiance += throughput · spectrum · weight.
    fn gather(&mut self, spectrum: SpectrumId, weight: f64) {
        let values = sampled(&mut self.values, self.scene, &self.wavelength, spectrum);
        for ((radiance, throughput), value) in self.radiance.iter_mut().zip(&self.throughput).zip(values) {
            *radiance += throughput * value * weight;
        }
    }

    /// Throughput *= spectrum; returns the largest.
    fn attenuate(&mut self, spectrum: SpectrumId) -> f64 {
        let values = sampled(&mut self.values, self.scene, &self.wavelength, spectrum);
        let mut largest = 0.0f64;
        for (throughput, value) in self.throughput.iter_mut().zip(values) {
            *throughput *= value;
            largest = largest.max(*throughput);
        }
        largest
    }
}

fn sampled<'v>(values: &'v mut [Option<Vec<f64>>], scene: &Scene, nm: &[f64], spectrum: SpectrumId) -> &'v [f64] {
    values[spectrum].get_or_insert_with(|| {
        let curve = &scene.spectra[spectrum].curve;
        nm.iter().map(|&nm| curve.eval(nm)).collect()
    })
}

impl<'a> Tracer<'a> {
    pub fn new(scene: &'a Scene) -> Self {
        let world = World::new(&scene.objects);
        let lights = Lights::new(scene, &world);
        Tracer { scene, world, lights }
    }

    /// Traces one path through `pixel` and leaves its radiance in `path`.
    ///
    /// Emission is found in two ways, by aiming at lights and by meeting them, which are combined by the balance
    /// heuristic (Veach 1997, section 9.2.2). The uniform environment is only met: for Lambert's law sampling by
    /// the cosine is already proportional to the integrand.
    pub fn trace(&self, pixel: [u32; 2], rng: &mut Rng, path: &mut Path) {
        let integrator = &self.scene.integrator;
        path.begin(rng.uniform());
        let mut ray = camera::ray(&self.scene.camera, &self.scene.film, pixel, rng);
        // Density by solid angle with which the ray was chosen; none for camera rays, which lights never compete with.
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

            let Some(reflectance) = self.reflectance(&ray, &hit) else { return };
            let largest = path.attenuate(reflectance);
            if largest == 0.0 {
                return;
            }
            // The normal on the side the ray came from.
            let normal = -hit.point.normal * hit.point.normal.dot(ray.direction).signum();
            let surface = SurfacePoint { normal, ..hit.point };
            self.gather_direct(hit.primitive, &surface, rng, path);

            if integrator.russian_roulette_start > 0 && event + 1 >= integrator.russian_roulette_start {
                let survival = largest.min(1.0);
                if rng.uniform() >= survival {
                    return;
                }
                path.throughput.iter_mut().for_each(|t| *t /= survival);
            }

            let direction = cosine_direction(normal, rng);
            ray_density = Some(normal.dot(direction).max(0.0) / PI);
            ray = Ray { origin: self.world.leave(hit.primitive, &surface, direction), direction };
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

    /// Next-event estimation: light from one chosen point, reflected by Lambert's law. The throughput holds the
    /// reflectance already.
    fn gather_direct(&self, primitive: usize, surface: &SurfacePoint, rng: &mut Rng, path: &mut Path) {
        let Some(light) = self.lights.sample(&self.world, rng) else { return };
        let towards = light.point.position - surface.position;
        let distance = towards.length();
        if distance == 0.0 {
            return;
        }
        let direction = towards / distance;
        let (cosine, light_cosine) = (surface.normal.dot(direction), light.point.normal.dot(direction));
        let object = &self.scene.objects[self.world.primitives[light.primitive].object];
        let Some(emission) = object.emission.as_ref().filter(|e| emits(e, light_cosine < 0.0)) else { return };
        if cosine <= 0.0 || light_cosine == 0.0 {
            return;
        }
        let from = self.world.leave(primitive, surface, direction);
        let to = self.world.leave(light.primitive, &light.point, -direction);
        if self.world.occluded(from, to) {
            return;
        }
        // The balance heuristic leaves f cosθ over the sum of both densities by solid angle.
        let light_density = light.density * distance * distance / light_cosine.abs();
        let ray_density = cosine / PI;
        path.gather(emission.radiance, cosine / PI / (light_density + ray_density));
    }

    /// The reflectance of the side that a ray meets; `None` where everything is absorbed.
    fn reflectance(&self, ray: &Ray, hit: &Hit) -> Option<SpectrumId> {
        let object = &self.scene.objects[self.world.primitives[hit.primitive].object];
        let material = &self.scene.materials[object.material];
        let front = hit.point.normal.dot(ray.direction) < 0.0;
        match material.bsdf {
            Bsdf::Diffuse { reflectance } if front || material.two_sided => Some(reflectance),
            _ => None,
        }
    }
}

/// A direction about `normal` with density cosθ/π: Malley's method, a point of the disk lifted to the hemisphere.
fn cosine_direction(normal: DVec3, rng: &mut Rng) -> DVec3 {
    let (square, angle) = (rng.uniform(), TAU * rng.uniform());
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    let radius = square.sqrt();
    radius * angle.cos() * tangent + radius * angle.sin() * bitangent + (1.0 - square).sqrt() * normal
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Density cosθ/π: cos²θ is uniform on [0, 1] and azimuths are even; chi-square over 10 x 10 bins of equal
    /// probability, 99 degrees of freedom, fixed seed, alpha 1e-4 (quantile 158.0).
    #[test]
    fn cosine_directions() {
        const N: u32 = 100_000;
        let mut rng = Rng::from_keys(&[9]);
        let normal = DVec3::new(0.3, -0.5, 0.8).normalize();
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        let mut bins = [0u32; 100];
        for _ in 0..N {
            let d = cosine_direction(normal, &mut rng);
            assert!((d.length() - 1.0).abs() < 1e-14);
            let cosine = d.dot(normal);
            assert!(cosine > 0.0);
            let azimuth = d.dot(bitangent).atan2(d.dot(tangent)).rem_euclid(TAU) / TAU;
            let bin = |x: f64| ((10.0 * x) as usize).min(9);
            bins[10 * bin(cosine * cosine) + bin(azimuth)] += 1;
        }
        let expected = f64::from(N) / 100.0;
        let chi2: f64 = bins.iter().map(|&n| (f64::from(n) - expected).powi(2) / expected).sum();
        assert!(chi2 < 158.0, "{chi2}");
    }
}
