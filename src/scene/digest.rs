//! The identity of a scene: what decides the values of a cube, and nothing else.

use glam::DVec3;
use sha2::{Digest, Sha256};

use super::{
    Bsdf, Environment, EnvironmentMap, Filter, Light, Projection, Sampler, Scene, Shape, Sides, Texels, Wavelengths,
};
use crate::spectral::{Curve, Outside};

/// Hex SHA-256 over every number's bits and every choice of `scene`, in order; not over paths, names and warnings.
pub fn digest(scene: &Scene) -> String {
    let mut hash = Hash(Sha256::new());
    // Changes with the meaning of what follows.
    hash.text("spectile scene 1");
    hash.settings(scene);
    hash.count(scene.spectra.len());
    scene.spectra.iter().for_each(|spectrum| hash.curve(&spectrum.curve));
    hash.count(scene.materials.len());
    for material in &scene.materials {
        match material.bsdf {
            Bsdf::Diffuse { reflectance } => {
                hash.tag(0);
                hash.count(reflectance);
            }
            Bsdf::Black => hash.tag(1),
            Bsdf::Conductor { eta, k, roughness, energy_compensation } => {
                hash.tag(2);
                hash.count(eta);
                hash.count(k);
                hash.numbers(&roughness);
                hash.tag(u8::from(energy_compensation));
            }
            Bsdf::Dielectric { eta, dispersion, roughness } => {
                hash.tag(3);
                hash.count(eta);
                hash.tag(u8::from(dispersion));
                hash.number(roughness);
            }
            Bsdf::Plastic { reflectance, eta, roughness } => {
                hash.tag(4);
                hash.count(reflectance);
                hash.count(eta);
                hash.number(roughness);
            }
            Bsdf::Blend { a, b, weight } => {
                hash.tag(5);
                hash.count(a);
                hash.count(b);
                hash.number(weight);
            }
        }
        hash.tag(u8::from(material.two_sided));
    }
    hash.count(scene.objects.len());
    for object in &scene.objects {
        hash.shape(&object.shape);
        hash.count(object.material);
        match &object.emission {
            None => hash.tag(0),
            Some(emission) => {
                hash.tag(match emission.sides {
                    Sides::Front => 1,
                    Sides::Both => 2,
                });
                hash.count(emission.radiance);
            }
        }
    }
    match &scene.environment {
        None => hash.tag(0),
        Some(Environment::Uniform(radiance)) => {
            hash.tag(1);
            hash.count(*radiance);
        }
        Some(Environment::Map(map)) => {
            hash.tag(2);
            hash.map(map);
        }
    }
    hash.count(scene.lights.len());
    scene.lights.iter().for_each(|light| hash.light(light));
    hash.0.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Feeds values in a form that cannot be read in two ways: fixed widths, and lengths before lists.
struct Hash(Sha256);

impl Hash {
    fn tag(&mut self, tag: u8) {
        self.0.update([tag]);
    }

    fn count(&mut self, count: usize) {
        self.0.update((count as u64).to_le_bytes());
    }

    fn number(&mut self, number: f64) {
        self.0.update(number.to_bits().to_le_bytes());
    }

    fn numbers<'n>(&mut self, numbers: impl IntoIterator<Item = &'n f64>) {
        numbers.into_iter().for_each(|number| self.number(*number));
    }

    fn vector(&mut self, vector: DVec3) {
        self.numbers(&vector.to_array());
    }

    fn text(&mut self, text: &str) {
        self.count(text.len());
        self.0.update(text);
    }

    /// Camera, film, channels and integrator.
    fn settings(&mut self, scene: &Scene) {
        let camera = &scene.camera;
        for vector in [camera.position, camera.forward, camera.right, camera.up] {
            self.vector(vector);
        }
        match camera.projection {
            Projection::Perspective { tan_half } => {
                self.tag(0);
                self.numbers(&tan_half.to_array());
            }
            Projection::ThinLens { tan_half, aperture_radius, focus_distance } => {
                self.tag(1);
                self.numbers(&[tan_half.x, tan_half.y, aperture_radius, focus_distance]);
            }
            Projection::Orthographic { half_size } => {
                self.tag(2);
                self.numbers(&half_size.to_array());
            }
        }

        let film = &scene.film;
        self.count(film.width as usize);
        self.count(film.height as usize);
        self.tag(match film.filter {
            Filter::Box => 0,
            Filter::Gaussian => 1,
        });
        film.crop.iter().for_each(|edge| self.count(*edge as usize));

        self.count(scene.channels.len());
        self.numbers(scene.channels.bounds.iter().flatten());
        // Nothing without responses, so that other scenes keep their digests.
        scene.channels.responses.iter().for_each(|response| self.curve(response.curve()));
        match scene.channels.false_colour {
            None => self.tag(0),
            Some(channels) => {
                self.tag(1);
                channels.iter().for_each(|channel| self.count(*channel));
            }
        }

        let integrator = &scene.integrator;
        self.count(integrator.max_bounces as usize);
        self.count(integrator.russian_roulette_start as usize);
        self.tag(match integrator.sampler {
            Sampler::Sobol => 0,
            Sampler::Independent => 1,
        });
        self.tag(match integrator.wavelengths {
            Wavelengths::Uniform => 0,
        });
        self.text(&integrator.evaluator);
        self.count(integrator.epoch as usize);
    }

    fn curve(&mut self, curve: &Curve) {
        match curve {
            Curve::Constant(value) => {
                self.tag(0);
                self.number(*value);
            }
            Curve::Linear { nm, value, outside } => {
                self.tag(match outside {
                    Outside::Zero => 1,
                    Outside::Hold => 2,
                });
                self.count(nm.len());
                self.numbers(nm);
                self.numbers(value);
            }
            Curve::Blackbody { kelvin, scale } => {
                self.tag(3);
                self.numbers(&[*kelvin, *scale]);
            }
        }
    }

    fn light(&mut self, light: &Light) {
        match light {
            Light::Point { position, .. } => {
                self.tag(0);
                self.vector(*position);
            }
            Light::Directional { direction, .. } => {
                self.tag(1);
                self.vector(*direction);
            }
            Light::Sun { direction, angular_radius, .. } => {
                self.tag(2);
                self.vector(*direction);
                self.number(*angular_radius);
            }
        }
        self.count(light.spectrum());
    }

    fn map(&mut self, map: &EnvironmentMap) {
        for column in [map.to_map.x_axis, map.to_map.y_axis, map.to_map.z_axis] {
            self.vector(column);
        }
        self.number(map.scale);
        map.size.iter().for_each(|side| self.count(*side as usize));
        let values = match &map.texels {
            Texels::Rgb { rgb, daylight } => {
                self.tag(0);
                self.count(*daylight);
                rgb
            }
            Texels::Spectral { nm, radiance } => {
                self.tag(1);
                self.count(nm.len());
                self.numbers(nm);
                radiance
            }
        };
        self.count(values.len());
        values.iter().for_each(|value| self.0.update(value.to_bits().to_le_bytes()));
    }

    fn shape(&mut self, shape: &Shape) {
        match shape {
            Shape::Mesh(mesh) => {
                self.tag(0);
                self.count(mesh.positions.len());
                mesh.positions.iter().for_each(|p| self.vector(*p));
                self.count(mesh.triangles.len());
                mesh.triangles.iter().flatten().for_each(|i| self.0.update(i.to_le_bytes()));
            }
            Shape::Sphere { center, radius } => {
                self.tag(1);
                self.vector(*center);
                self.number(*radius);
            }
            Shape::Disk { center, normal, radius } => {
                self.tag(2);
                self.vector(*center);
                self.vector(*normal);
                self.number(*radius);
            }
            Shape::Cylinder { from, to, radius } => {
                self.tag(3);
                self.vector(*from);
                self.vector(*to);
                self.number(*radius);
            }
        }
    }
}
