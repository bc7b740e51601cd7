//! The identity of a scene: what decides the values of a cube, and nothing else.
//!
//! Everything is taken apart without `..`, so that a new field does not compile before somebody has decided here whether it is
//! a part of that.

use glam::DVec3;
use sha2::{Digest, Sha256};

use super::{
    Absorber, Attributes, Bsdf, Camera, Emission, Environment, EnvironmentMap, Field, Film, Filter, Grid, Integrator,
    Interior, Light, Material, Medium, Mesh, Object, Projection, Reflectance, Sampler, Scene, Shape, Sides, Spectrum,
    Temperature, Texels, Texture, TextureKind, Wavelengths, Weight,
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
        media,
        camera_medium,
        lights,
        environment,
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
    hash.list(spectra, |hash, Spectrum { name: _, curve }| hash.curve(curve));
    hash.list(materials, Hash::material);
    if !textures.is_empty() {
        hash.text("textures");
        hash.list(textures, Hash::texture);
    }
    hash.list(objects, Hash::object);
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
        let Camera { position, forward, right, up, projection } = camera;
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
        let Integrator { max_bounces, russian_roulette_start, sampler, wavelengths, evaluator, epoch } = integrator;
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
        let Material { name: _, bsdf, two_sided, temperature } = material;
        match bsdf {
            Bsdf::Diffuse { reflectance } => self.reflectance([0, 6], reflectance),
            Bsdf::Black => self.tag(1),
            Bsdf::Conductor { eta, k, roughness, energy_compensation } => {
                self.tag(2);
                self.count(*eta);
                self.count(*k);
                self.numbers(roughness);
                self.tag(u8::from(*energy_compensation));
            }
            Bsdf::Dielectric { eta, dispersion, roughness } => {
                self.tag(3);
                self.count(*eta);
                self.tag(u8::from(*dispersion));
                self.number(*roughness);
            }
            Bsdf::Plastic { reflectance, eta, roughness } => {
                self.reflectance([4, 7], reflectance);
                self.count(*eta);
                self.number(*roughness);
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

    fn texture(&mut self, texture: &Texture) {
        let Texture { name: _, size, kind, texels } = texture;
        match kind {
            TextureKind::Colour => self.tag(0),
            TextureKind::Mixture(endmembers) => {
                self.tag(1);
                self.list(endmembers, |hash, spectrum| hash.count(*spectrum));
            }
            TextureKind::Number => self.tag(2),
        }
        self.counts(size);
        self.floats(texels);
    }

    fn object(&mut self, object: &Object) {
        let Object { name: _, shape, attributes, material, emission, interior } = object;
        self.attributes(attributes);
        self.shape(shape);
        self.option(*material, Hash::count);
        match emission {
            None => self.tag(0),
            Some(Emission { radiance, sides }) => {
                self.tag(match sides {
                    Sides::Front => 1,
                    Sides::Both => 2,
                });
                self.count(*radiance);
            }
        }
        self.option(*interior, |hash, Interior { body, medium, to_grid }| {
            hash.count(body);
            hash.count(medium);
            hash.numbers(&to_grid.to_cols_array());
        });
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
        let Medium { name: _, absorbers, temperature, density } = medium;
        self.list(absorbers, |hash, Absorber { strength, columns }| {
            hash.number(*strength);
            hash.list(columns, |hash, (kelvin, spectrum)| {
                hash.number(*kelvin);
                hash.count(*spectrum);
            });
        });
        self.option(temperature.as_ref(), Hash::field);
        self.field(density);
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
mod tests {
    use std::path::Path;
    use std::sync::Arc;

    use glam::{DAffine3, DMat3, DVec2};

    use super::super::Evaluator;
    use super::*;
    use crate::scene;
    use crate::spectral::Response;

    fn object(shape: Shape, attributes: Attributes) -> Object {
        Object { name: "o".into(), shape, attributes, material: Some(1), emission: None, interior: None }
    }

    fn material(bsdf: Bsdf) -> Material {
        Material { name: "m".into(), bsdf, two_sided: true, temperature: None }
    }

    fn texture(kind: TextureKind, texels: &[f32]) -> Texture {
        Texture { name: "t".into(), size: [1, 2], kind, texels: texels.into() }
    }

    /// One of everything, with numbers that are no two alike. It need not make sense.
    fn full() -> Scene {
        let curves = [
            Curve::Constant(0.25),
            Curve::Linear { nm: vec![400.0, 500.5], value: vec![0.1, 0.7], outside: Outside::Zero },
            Curve::Linear { nm: vec![410.0, 510.5], value: vec![0.2, 0.6], outside: Outside::Hold },
            Curve::Blackbody { kelvin: 2856.0, scale: 1.5 },
        ];
        let (spectrum, texel) = (Reflectance::Spectrum(1), Reflectance::Texture(0));
        let mut materials = [
            Bsdf::Diffuse { reflectance: spectrum },
            Bsdf::Diffuse { reflectance: texel },
            Bsdf::Conductor { eta: 1, k: 2, roughness: [0.1, 0.3], energy_compensation: true },
            Bsdf::Dielectric { eta: 3, dispersion: true, roughness: 0.15 },
            Bsdf::Plastic { reflectance: spectrum, eta: 2, roughness: 0.35 },
            Bsdf::Plastic { reflectance: texel, eta: 2, roughness: 0.45 },
            Bsdf::Blend { a: 0, b: 3, weight: Weight::Constant(0.65) },
            Bsdf::Blend { a: 1, b: 2, weight: Weight::Texture(2) },
            Bsdf::Black,
        ]
        .map(material)
        .to_vec();
        materials[0].two_sided = false;
        materials[2].temperature = Some(Temperature::Constant(310.0));
        materials[4].temperature = Some(Temperature::Texture(2));

        let attributes = Attributes {
            uv: Some(vec![[DVec2::new(0.5, 0.125), DVec2::X, DVec2::Y]]),
            normals: Some(vec![[DVec3::Z, DVec3::new(0.6, 0.0, 0.8), DVec3::Y]]),
            axes: None,
        };
        let positions = vec![DVec3::new(1.0, 2.0, 3.0), DVec3::X, DVec3::Y];
        let axes = Attributes { axes: Some(DMat3::from_rotation_x(0.5)), ..Attributes::default() };
        let mut objects = vec![
            object(Shape::Mesh(Mesh { positions, triangles: vec![[0, 1, 2]] }), attributes),
            object(Shape::Sphere { center: DVec3::new(0.0, 1.0, 4.0), radius: 0.75 }, axes),
            object(Shape::Disk { center: DVec3::X, normal: DVec3::Z, radius: 0.85 }, Attributes::default()),
            object(Shape::Cylinder { from: DVec3::X, to: DVec3::Y, radius: 0.95 }, Attributes::default()),
        ];
        objects[1].emission = Some(Emission { radiance: 3, sides: Sides::Front });
        objects[2].emission = Some(Emission { radiance: 0, sides: Sides::Both });
        objects[3].material = None;
        let to_grid = DAffine3::from_scale(DVec3::new(2.0, 3.0, 5.0));
        objects[3].interior = Some(Interior { body: 7, medium: 1, to_grid });

        let grid = Field::Grid(Arc::new(Grid { size: [2, 1, 1], values: vec![280.5, 300.25] }));
        let absorbers = vec![Absorber { strength: 0.04, columns: vec![(200.0, 1), (300.0, 2)] }];
        let medium =
            |temperature, density| Medium { name: "air".into(), absorbers: absorbers.clone(), temperature, density };
        let media = vec![medium(None, Field::Constant(1.25)), medium(Some(Field::Constant(290.0)), grid)];
        let to_map = DMat3::from_rotation_y(0.25);
        let texels = Texels::Rgb { rgb: vec![0.5, 1.5, 2.5].into(), daylight: 1 };
        Scene {
            file: "scene.toml".into(),
            camera: Camera {
                position: DVec3::new(0.1, 0.2, 0.3),
                forward: DVec3::NEG_Z,
                right: DVec3::X,
                up: DVec3::Y,
                projection: Projection::Perspective { tan_half: DVec2::new(0.5, 0.4) },
            },
            film: Film { width: 40, height: 30, filter: Filter::Box, crop: [1, 2, 39, 28] },
            channels: Channels::from_bounds(vec![[400.0, 500.0], [500.0, 650.0]], None),
            integrator: Integrator {
                max_bounces: 5,
                russian_roulette_start: 3,
                sampler: Sampler::Sobol,
                wavelengths: Wavelengths::Uniform,
                evaluator: Evaluator::Auto,
                epoch: 64,
            },
            spectra: curves.map(|curve| Spectrum { name: "s".into(), curve }).to_vec(),
            materials,
            textures: vec![
                texture(TextureKind::Colour, &[0.5, 0.25, 0.125, 0.0, 1.0, 0.75]),
                texture(TextureKind::Mixture(vec![1, 2]), &[0.5, 0.5, 0.25, 0.75]),
                texture(TextureKind::Number, &[300.0, 310.0]),
            ],
            objects,
            media,
            camera_medium: Some(0),
            lights: vec![
                Light::Point { position: DVec3::Y, intensity: 1 },
                Light::Directional { direction: DVec3::NEG_Y, irradiance: 2 },
                Light::Sun { direction: DVec3::NEG_Z, angular_radius: 0.005, irradiance: 3 },
            ],
            environment: Some(Environment::Map(EnvironmentMap {
                name: "sky".into(),
                to_map,
                scale: 2.0,
                size: [1, 1],
                texels,
            })),
            warnings: Vec::new(),
            digest: String::new(),
        }
    }

    /// Cubes on disk hold digests: those of scenes that mean the same must stay as they were.
    #[test]
    fn digests_are_those_of_earlier_versions() {
        type Change = fn(&mut Scene);
        let cases: [(Change, &str); 6] = [
            (|_| {}, "06ac8761fd4e50c50bf29ff79742587916e9d01f0306f5d828b35f04978a9010"),
            (
                |scene| {
                    let tan_half = DVec2::new(0.5, 0.4);
                    scene.camera.projection =
                        Projection::ThinLens { tan_half, aperture_radius: 0.01, focus_distance: 3.5 };
                    scene.film.filter = Filter::Gaussian;
                    scene.channels.false_colour = Some([1, 0, 1]);
                },
                "8bc1064513e61e5a97679c0aa0d50fa2102ef082fa3113380a284423cd12ab12",
            ),
            (
                |scene| {
                    scene.camera.projection = Projection::Orthographic { half_size: DVec2::new(2.0, 1.5) };
                    let response = Response::new(vec![450.0, 500.0, 600.0], vec![0.0, 1.0, 0.5]).expect("a response");
                    scene.channels = Channels::from_responses(vec![("r".into(), response)], None);
                    scene.integrator = Integrator {
                        max_bounces: 16,
                        russian_roulette_start: 0,
                        sampler: Sampler::Independent,
                        wavelengths: Wavelengths::Emission,
                        evaluator: Evaluator::Pt,
                        epoch: 128,
                    };
                },
                "5f9a52a7835f2391916c73b6042f8d9a6e61185fe12bd8388a1dc61da763f8c9",
            ),
            (
                |scene| {
                    let Some(Environment::Map(map)) = &mut scene.environment else { panic!("a map") };
                    map.texels = Texels::Spectral { nm: vec![400.0, 700.0], radiance: vec![1.0, 2.0].into() };
                },
                "6ce9107466320387a7e81951c97d94214b471cf8944ecf4139207c2b468c3f5a",
            ),
            (
                |scene| scene.environment = Some(Environment::Uniform(2)),
                "2046ee165d060f11350d954e990033f065fe88842bbcf7532943b6bc8b044de6",
            ),
            (
                |scene| {
                    scene.textures.clear();
                    scene.materials.truncate(1);
                    scene.media.clear();
                    scene.camera_medium = None;
                    scene.objects.truncate(1);
                    scene.objects[0].attributes = Attributes::default();
                    scene.lights.clear();
                    scene.environment = None;
                },
                "eed4c0936124d91cb95cce141be1ec959d24f341626f6c9cafe4fd77c012423a",
            ),
        ];
        for (number, (change, expected)) in cases.into_iter().enumerate() {
            let mut scene = full();
            change(&mut scene);
            assert_eq!(digest(&scene), expected, "case {number}");
        }
    }

    #[test]
    fn names_and_files_do_not_count() {
        let mut scene = full();
        scene.file = "elsewhere.toml".into();
        scene.warnings.push("a warning".into());
        scene.digest = "older".into();
        scene.channels.names[0] = "blue".into();
        scene.spectra[0].name = "other".into();
        scene.materials[0].name = "other".into();
        scene.textures[0].name = "other".into();
        scene.objects[0].name = "other".into();
        scene.media[0].name = "other".into();
        let Some(Environment::Map(map)) = &mut scene.environment else { panic!("a map") };
        map.name = "other".into();
        assert_eq!(digest(&scene), digest(&full()));
    }

    #[test]
    fn the_cornell_box_is_what_it_was() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell/cornell.toml");
        let digest = scene::load(&file, &[]).expect("the Cornell box").digest;
        assert_eq!(digest, "0974c0c5980c31b57850778acd84aba60c4ba962bb0ad2d800fb07b0e67e0b69");
    }
}
