//! The identity of a scene: what decides the values of a cube, and nothing else.
//!
//! Everything is taken apart without `..`, so that a new field does not compile before somebody has decided here whether it is
//! a part of that.

use glam::DVec3;
use sha2::{Digest, Sha256};

use super::{
    Absorber, Assembly, Attributes, Bsdf, Camera, Component, Cone, Distortion, Emission, Environment, EnvironmentMap,
    Evaluation, Field, Film, Filter, Grid, Integrator, Interior, Light, Line, Material, Medium, Mesh, Object, Phase,
    PhaseTable, Placement, Profile, Projection, Reflectance, Roughness, Sampler, Scattering, Scene, Shape, Sides,
    Spectrum, Temperature, Texels, Texture, TextureFilter, TextureKind, Wavelengths, Weight,
};
use crate::spectral::{Channels, Curve, Outside};

/// Hex SHA-256 over every number's bits and every choice of `scene`, in order; not over paths, names and warnings.
pub fn digest(scene: &Scene) -> String {
    let Scene {
        file: _,
        camera,
        film,
        channels,
        integrator,
        spectra,
        materials,
        textures,
        objects,
        assemblies,
        media,
        camera_medium,
        lights,
        environment,
        // They change no value of the radiance.
        georeference: _,
        first_hits: _,
        warnings: _,
        digest: _,
    } = scene;
    let mut hash = Hash(Sha256::new());
    // Changes with the meaning of what follows.
    hash.text("spectile scene 1");
    hash.camera(camera);
    hash.film(film);
    hash.channels(channels);
    hash.integrator(integrator);
    hash.list(spectra, |hash, Spectrum { name: _, curve, definition: _ }| hash.curve(curve));
    hash.list(materials, Hash::material);
    if !textures.is_empty() {
        hash.text("textures");
        hash.list(textures, Hash::texture);
    }
    hash.list(objects, Hash::object);
    // Nothing without any, so that other scenes keep their digests.
    if !assemblies.is_empty() {
        hash.text("assemblies");
        hash.list(assemblies, Hash::assembly);
    }
    hash.list(media, Hash::medium);
    hash.option(*camera_medium, Hash::count);
    match environment {
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
    hash.list(lights, Hash::light);
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

    fn counts<'n>(&mut self, counts: impl IntoIterator<Item = &'n u32>) {
        counts.into_iter().for_each(|count| self.count(*count as usize));
    }

    fn number(&mut self, number: f64) {
        self.0.update(number.to_bits().to_le_bytes());
    }

    fn numbers<'n>(&mut self, numbers: impl IntoIterator<Item = &'n f64>) {
        numbers.into_iter().for_each(|number| self.number(*number));
    }

    /// Without their number, which their size or what follows must tell.
    fn floats(&mut self, floats: &[f32]) {
        floats.iter().for_each(|float| self.0.update(float.to_bits().to_le_bytes()));
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

    fn list<T>(&mut self, items: &[T], each: impl Fn(&mut Self, &T)) {
        self.count(items.len());
        items.iter().for_each(|item| each(self, item));
    }

    fn camera(&mut self, camera: &Camera) {
        let Camera { position, forward, right, up, projection, distortion } = camera;
        for vector in [position, forward, right, up] {
            self.vector(*vector);
        }
        match projection {
            Projection::Perspective { tan_half } => {
                self.tag(0);
                self.numbers(&tan_half.to_array());
            }
            Projection::ThinLens { tan_half, aperture_radius, focus_distance } => {
                self.tag(1);
                self.numbers(&[tan_half.x, tan_half.y, *aperture_radius, *focus_distance]);
            }
            Projection::Orthographic { half_size } => {
                self.tag(2);
                self.numbers(&half_size.to_array());
            }
            Projection::Latlong => self.tag(3),
            Projection::Pushbroom { half_width, half_pixel, lines } => {
                self.tag(4);
                self.numbers(&[*half_width, *half_pixel]);
                self.list(lines, |hash, Line { position, forward, right, nose }| {
                    [position, forward, right, nose].into_iter().for_each(|vector| hash.vector(*vector));
                });
            }
        }
        if let Some(Distortion { radial, tangential }) = distortion {
            self.text("distortion");
            self.numbers(radial);
            self.numbers(tangential);
        }
    }

    fn film(&mut self, film: &Film) {
        let Film { width, height, filter, crop } = film;
        self.counts([width, height]);
        self.tag(match filter {
            Filter::Box => 0,
            Filter::Gaussian => 1,
        });
        self.counts(crop);
    }

    fn channels(&mut self, channels: &Channels) {
        let Channels { bounds, names: _, false_colour, responses } = channels;
        self.count(bounds.len());
        self.numbers(bounds.iter().flatten());
        // Nothing without responses, so that other scenes keep their digests.
        responses.iter().for_each(|response| self.curve(response.curve()));
        self.option(*false_colour, |hash, channels| channels.iter().for_each(|channel| hash.count(*channel)));
    }

    fn integrator(&mut self, integrator: &Integrator) {
        let Integrator {
            max_bounces,
            russian_roulette_start,
            sampler,
            wavelengths,
            wavelengths_per_channel,
            techniques,
            forced_collision,
            evaluation,
            evaluator,
            epoch,
        } = integrator;
        self.counts([max_bounces, russian_roulette_start]);
        self.tag(match sampler {
            Sampler::Sobol => 0,
            Sampler::Independent => 1,
        });
        self.tag(match wavelengths {
            Wavelengths::Uniform => 0,
            Wavelengths::Emission => 1,
        });
        self.text(evaluator.name());
        self.counts([epoch]);
        // Nothing of what was usual when they came, so that scenes that ask for that keep their digests.
        match wavelengths_per_channel {
            Some(1) => {}
            Some(count) => {
                self.text("wavelengths per channel");
                self.counts([count]);
            }
            None => self.text("wavelengths per channel as it pays"),
        }
        if let Some(techniques) = techniques {
            self.text("techniques");
            self.counts([techniques]);
        }
        if *forced_collision {
            self.text("forced collision");
        }
        if *evaluation != Evaluation::Auto {
            self.text("evaluation");
            self.text(evaluation.name());
        }
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

    fn material(&mut self, material: &Material) {
        let Material { name: _, bsdf, two_sided, temperature, opacity } = material;
        // Before the tag of its kind, which is less; nothing without one, so that other scenes keep their digests.
        match opacity {
            None => {}
            Some(Weight::Constant(opacity)) => {
                self.tag(100);
                self.number(*opacity);
            }
            Some(Weight::Texture(texture)) => {
                self.tag(101);
                self.count(*texture);
            }
        }
        match bsdf {
            Bsdf::Diffuse { reflectance } => self.reflectance([0, 6], reflectance),
            Bsdf::Black => self.tag(1),
            Bsdf::Translucent { reflectance, transmittance } => {
                self.tag(9);
                self.reflectance([0, 6], reflectance);
                self.reflectance([0, 6], transmittance);
            }
            Bsdf::Conductor { eta, k, roughness, energy_compensation } => {
                self.tag(2);
                self.count(*eta);
                self.count(*k);
                self.roughness(roughness, 2);
                self.tag(u8::from(*energy_compensation));
            }
            Bsdf::Dielectric { eta, dispersion, roughness } => {
                self.tag(3);
                self.count(*eta);
                self.tag(u8::from(*dispersion));
                self.roughness(roughness, 1);
            }
            Bsdf::Plastic { reflectance, eta, roughness } => {
                self.reflectance([4, 7], reflectance);
                self.count(*eta);
                self.roughness(roughness, 1);
            }
            Bsdf::Blend { a, b, weight } => {
                match weight {
                    Weight::Constant(weight) => {
                        self.tag(5);
                        self.number(*weight);
                    }
                    Weight::Texture(texture) => {
                        self.tag(8);
                        self.count(*texture);
                    }
                }
                self.count(*a);
                self.count(*b);
            }
        }
        self.tag(u8::from(*two_sided));
        self.option(*temperature, |hash, temperature| match temperature {
            Temperature::Constant(kelvin) => hash.number(kelvin),
            Temperature::Texture(texture) => {
                // Which no temperature is.
                hash.number(-1.0);
                hash.count(texture);
            }
        });
    }

    /// With the tag of a material whose reflectance is a spectrum, or that of one whose is a texture.
    fn reflectance(&mut self, [of_spectrum, of_texture]: [u8; 2], reflectance: &Reflectance) {
        match reflectance {
            Reflectance::Spectrum(spectrum) => {
                self.tag(of_spectrum);
                self.count(*spectrum);
            }
            Reflectance::Texture(texture) => {
                self.tag(of_texture);
                self.count(*texture);
            }
        }
    }

    /// One number of what has the same in all directions.
    fn roughness(&mut self, roughness: &Roughness, directions: usize) {
        match roughness {
            Roughness::Constant(alpha) if directions == 1 => self.number(alpha[0]),
            Roughness::Constant(alpha) => self.numbers(alpha),
            Roughness::Texture(texture) => {
                self.tag(102);
                self.count(*texture);
            }
        }
    }

    fn texture(&mut self, texture: &Texture) {
        let Texture { name: _, size, kind, texels, placement } = texture;
        // Before the tag of its kind, which is less; nothing where it is usual, so that other scenes keep their digests.
        if *placement != Placement::default() {
            let Placement { filter, scale, offset } = placement;
            self.tag(match filter {
                TextureFilter::Bilinear => 100,
                TextureFilter::Nearest => 101,
            });
            self.numbers(&[scale.x, scale.y, offset.x, offset.y]);
        }
        match kind {
            TextureKind::Colour => self.tag(0),
            TextureKind::Mixture(endmembers) => {
                self.tag(1);
                self.list(endmembers, |hash, spectrum| hash.count(*spectrum));
            }
            TextureKind::Number => self.tag(2),
            TextureKind::Light(daylight) => {
                self.tag(3);
                self.count(*daylight);
            }
        }
        self.counts(size);
        self.floats(texels);
    }

    fn object(&mut self, object: &Object) {
        let Object { name: _, shape, attributes, material, emission, interior, assembly } = object;
        // A tag that no shape has; nothing in the world itself.
        if let Some(assembly) = assembly {
            self.tag(103);
            self.count(*assembly);
        }
        self.attributes(attributes);
        self.shape(shape);
        self.option(*material, Hash::count);
        match emission {
            None => self.tag(0),
            Some(Emission { radiance, sides, texture }) => {
                self.tag(match (sides, texture) {
                    (Sides::Front, None) => 1,
                    (Sides::Both, None) => 2,
                    (Sides::Front, Some(_)) => 3,
                    (Sides::Both, Some(_)) => 4,
                });
                self.count(*radiance);
                texture.iter().for_each(|texture| self.count(*texture));
            }
        }
        self.option(*interior, |hash, Interior { body, medium, to_grid }| {
            hash.count(body);
            hash.count(medium);
            hash.numbers(&to_grid.to_cols_array());
        });
    }

    fn assembly(&mut self, assembly: &Assembly) {
        let Assembly { name: _, instances } = assembly;
        self.list(instances, |hash, placed| hash.numbers(&placed.to_cols_array()));
    }

    /// Tags that no shape has, before the shape; nothing where there are none.
    fn attributes(&mut self, attributes: &Attributes) {
        let Attributes { uv, normals, axes } = attributes;
        if let Some(uv) = uv {
            self.tag(100);
            self.count(uv.len());
            self.numbers(uv.iter().flatten().flat_map(|uv| [&uv.x, &uv.y]));
        }
        if let Some(normals) = normals {
            self.tag(101);
            self.count(normals.len());
            normals.iter().flatten().for_each(|normal| self.vector(*normal));
        }
        if let Some(axes) = axes {
            self.tag(102);
            self.numbers(&axes.to_cols_array());
        }
    }

    fn shape(&mut self, shape: &Shape) {
        match shape {
            Shape::Mesh(Mesh { positions, triangles }) => {
                self.tag(0);
                self.list(positions, |hash, position| hash.vector(*position));
                self.count(triangles.len());
                triangles.iter().flatten().for_each(|i| self.0.update(i.to_le_bytes()));
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

    fn medium(&mut self, medium: &Medium) {
        let Medium { name: _, components, temperature } = medium;
        for (i, component) in components.iter().enumerate() {
            let Component { absorbers, scattering, density } = component;
            // Nothing of what most media are not, so that they keep their digests.
            if i > 0 {
                self.text("component");
            }
            self.list(absorbers, |hash, Absorber { strength, columns }| {
                hash.number(*strength);
                hash.list(columns, |hash, (kelvin, spectrum)| {
                    hash.number(*kelvin);
                    hash.count(*spectrum);
                });
            });
            if let Some(Scattering { coefficient, phase }) = scattering {
                self.text("scattering");
                self.count(*coefficient);
                self.phase(phase);
            }
            if i == 0 {
                self.option(temperature.as_ref(), Hash::field);
            }
            self.field(density);
        }
    }

    fn phase(&mut self, phase: &Phase) {
        match phase {
            Phase::HenyeyGreenstein(g) => {
                self.tag(0);
                self.count(*g);
            }
            Phase::Rayleigh { depolarisation } => {
                self.tag(1);
                self.number(*depolarisation);
            }
            Phase::Table(table) => {
                let PhaseTable { degrees, nm, values } = &**table;
                self.tag(2);
                self.count(nm.len());
                self.numbers(nm);
                self.count(degrees.len());
                self.numbers(degrees);
                self.numbers(values.iter().flatten());
            }
        }
    }

    fn field(&mut self, field: &Field) {
        match field {
            Field::Constant(value) => {
                self.tag(0);
                self.number(*value);
            }
            Field::Grid(grid) => {
                let Grid { size, values } = &**grid;
                self.tag(1);
                self.counts(size);
                self.floats(values);
            }
        }
    }

    fn light(&mut self, light: &Light) {
        match light {
            Light::Point { position, intensity } => {
                self.tag(0);
                self.vector(*position);
                self.count(*intensity);
            }
            Light::Spot { position, direction, intensity, cone: Cone { half_angle, falloff, profile } } => {
                self.tag(3);
                self.vector(*position);
                self.vector(*direction);
                self.count(*intensity);
                self.numbers(&[*half_angle, *falloff]);
                self.tag(match profile {
                    Profile::Smooth => 0,
                    Profile::Linear => 1,
                });
            }
            Light::Directional { direction, irradiance } => {
                self.tag(1);
                self.vector(*direction);
                self.count(*irradiance);
            }
            Light::Sun { direction, angular_radius, irradiance } => {
                self.tag(2);
                self.vector(*direction);
                self.number(*angular_radius);
                self.count(*irradiance);
            }
        }
    }

    fn map(&mut self, map: &EnvironmentMap) {
        let EnvironmentMap { name: _, to_map, scale, size, texels } = map;
        for column in [to_map.x_axis, to_map.y_axis, to_map.z_axis] {
            self.vector(column);
        }
        self.number(*scale);
        self.counts(size);
        let values = match texels {
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
        self.floats(values);
    }
}

#[cfg(test)]
mod tests;
