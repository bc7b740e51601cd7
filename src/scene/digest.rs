//! The identity of a scene: what decides the values of a cube, and nothing else.

use glam::DVec3;
use sha2::{Digest, Sha256};

use super::{
    Attributes, Bsdf, Environment, EnvironmentMap, Field, Filter, Light, Medium, Projection, Reflectance, Sampler,
    Scene, Shape, Sides, Temperature, Texels, TextureKind, Wavelengths, Weight,
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
            Bsdf::Diffuse { reflectance: Reflectance::Spectrum(spectrum) } => {
                hash.tag(0);
                hash.count(spectrum);
            }
            Bsdf::Diffuse { reflectance: Reflectance::Texture(texture) } => {
                hash.tag(6);
                hash.count(texture);
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
                match reflectance {
                    Reflectance::Spectrum(spectrum) => {
                        hash.tag(4);
                        hash.count(spectrum);
                    }
                    Reflectance::Texture(texture) => {
                        hash.tag(7);
                        hash.count(texture);
                    }
                }
                hash.count(eta);
                hash.number(roughness);
            }
            Bsdf::Blend { a, b, weight } => {
                match weight {
                    Weight::Constant(weight) => {
                        hash.tag(5);
                        hash.number(weight);
                    }
                    Weight::Texture(texture) => {
                        hash.tag(8);
                        hash.count(texture);
                    }
                }
                hash.count(a);
                hash.count(b);
            }
        }
        hash.tag(u8::from(material.two_sided));
        hash.option(material.temperature, |hash, temperature| match temperature {
            Temperature::Constant(kelvin) => hash.number(kelvin),
            Temperature::Texture(texture) => {
                // Which no temperature is.
                hash.number(-1.0);
                hash.count(texture);
            }
        });
    }
    hash.textures(scene);
    hash.count(scene.objects.len());
    for object in &scene.objects {
        hash.attributes(&object.attributes);
        hash.shape(&object.shape);
        hash.option(object.material, Hash::count);
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
        hash.option(object.interior, |hash, interior| {
            hash.count(interior.body);
            hash.count(interior.medium);
            hash.numbers(&interior.to_grid.to_cols_array());
        });
    }
    hash.count(scene.media.len());
    scene.media.iter().for_each(|medium| hash.medium(medium));
    hash.option(scene.camera_medium, Hash::count);
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

    fn option<T>(&mut self, value: Option<T>, some: impl FnOnce(&mut Self, T)) {
        self.tag(u8::from(value.is_some()));
        if let Some(value) = value {
            some(self, value);
        }
    }

    fn medium(&mut self, medium: &Medium) {
        self.count(medium.absorbers.len());
        for absorber in &medium.absorbers {
            self.number(absorber.strength);
            self.count(absorber.columns.len());
            for (kelvin, spectrum) in &absorber.columns {
                self.number(*kelvin);
                self.count(*spectrum);
            }
        }
        self.option(medium.temperature.as_ref(), Hash::field);
        self.field(&medium.density);
    }

    fn field(&mut self, field: &Field) {
        match field {
            Field::Constant(value) => {
                self.tag(0);
                self.number(*value);
            }
            Field::Grid(grid) => {
                self.tag(1);
                grid.size.iter().for_each(|n| self.count(*n as usize));
                grid.values.iter().for_each(|value| self.0.update(value.to_bits().to_le_bytes()));
            }
        }
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
            Wavelengths::Emission => 1,
        });
        self.text(integrator.evaluator.name());
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

    fn textures(&mut self, scene: &Scene) {
        if scene.textures.is_empty() {
            return;
        }
        self.text("textures");
        self.count(scene.textures.len());
        for texture in &scene.textures {
            match &texture.kind {
                TextureKind::Colour => self.tag(0),
                TextureKind::Mixture(endmembers) => {
                    self.tag(1);
                    self.count(endmembers.len());
                    endmembers.iter().for_each(|spectrum| self.count(*spectrum));
                }
                TextureKind::Number => self.tag(2),
            }
            texture.size.iter().for_each(|size| self.count(*size as usize));
            texture.texels.iter().for_each(|texel| self.0.update(texel.to_bits().to_le_bytes()));
        }
    }

    /// Tags that no shape has, before the shape; nothing where there are none.
    fn attributes(&mut self, attributes: &Attributes) {
        if let Some(uv) = &attributes.uv {
            self.tag(100);
            self.count(uv.len());
            self.numbers(uv.iter().flatten().flat_map(|uv| [&uv.x, &uv.y]));
        }
        if let Some(normals) = &attributes.normals {
            self.tag(101);
            self.count(normals.len());
            normals.iter().flatten().for_each(|normal| self.vector(*normal));
        }
        if let Some(axes) = &attributes.axes {
            self.tag(102);
            self.numbers(&axes.to_cols_array());
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
