//! What changes a scene's digest, and what does not.

use std::path::Path;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec2};

use super::super::Evaluator;
use super::*;
use crate::scene;
use crate::spectral::Response;

fn object(shape: Shape, attributes: Attributes) -> Object {
    Object { name: "o".into(), shape, attributes, material: Some(1), emission: None, interior: None, assembly: None }
}

fn material(bsdf: Bsdf) -> Material {
    Material { name: "m".into(), bsdf, two_sided: true, temperature: None, opacity: None }
}

fn texture(kind: TextureKind, texels: &[f32]) -> Texture {
    Texture { name: "t".into(), size: [1, 2], kind, texels: texels.into(), placement: Placement::default() }
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
        Bsdf::Conductor { eta: 1, k: 2, roughness: Roughness::Constant([0.1, 0.3]), energy_compensation: true },
        Bsdf::Dielectric { eta: 3, dispersion: true, roughness: Roughness::even(0.15) },
        Bsdf::Plastic { reflectance: spectrum, eta: 2, roughness: Roughness::even(0.35) },
        Bsdf::Plastic { reflectance: texel, eta: 2, roughness: Roughness::even(0.45) },
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
    objects[1].emission = Some(Emission { radiance: 3, sides: Sides::Front, texture: None });
    objects[2].emission = Some(Emission { radiance: 0, sides: Sides::Both, texture: None });
    objects[3].material = None;
    let to_grid = DAffine3::from_scale(DVec3::new(2.0, 3.0, 5.0));
    objects[3].interior = Some(Interior { body: 7, medium: 1, to_grid });

    let grid = Field::Grid(Arc::new(Grid { size: [2, 1, 1], values: vec![280.5, 300.25].into() }));
    let absorbers = vec![Absorber { strength: 0.04, columns: vec![(200.0, 1), (300.0, 2)] }];
    let medium = |temperature, density| {
        let component = Component { absorbers: absorbers.clone(), scattering: None, density };
        Medium { name: "air".into(), components: vec![component], temperature }
    };
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
            distortion: None,
        },
        film: Film { width: 40, height: 30, filter: Filter::Box, crop: [1, 2, 39, 28] },
        channels: Channels::from_bounds(vec![[400.0, 500.0], [500.0, 650.0]], None),
        integrator: Integrator {
            max_bounces: 5,
            russian_roulette_start: 3,
            sampler: Sampler::Sobol,
            wavelengths: Wavelengths::Uniform,
            wavelengths_per_channel: Some(1),
            techniques: None,
            forced_collision: false,
            evaluation: Evaluation::Auto,
            evaluator: Evaluator::Auto,
            epoch: 64,
        },
        spectra: curves.map(|curve| Spectrum { name: "s".into(), curve, definition: None }).to_vec(),
        materials,
        textures: vec![
            texture(TextureKind::Colour, &[0.5, 0.25, 0.125, 0.0, 1.0, 0.75]),
            texture(TextureKind::Mixture(vec![1, 2]), &[0.5, 0.5, 0.25, 0.75]),
            texture(TextureKind::Number, &[300.0, 310.0]),
        ],
        objects,
        assemblies: Vec::new(),
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
        georeference: None,
        first_hits: false,
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
                scene.camera.projection = Projection::ThinLens { tan_half, aperture_radius: 0.01, focus_distance: 3.5 };
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
                    wavelengths_per_channel: Some(1),
                    techniques: None,
                    forced_collision: false,
                    evaluation: Evaluation::Auto,
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
fn a_textured_roughness_counts() {
    let with = |material: usize, texture: usize| {
        let mut scene = full();
        let (Bsdf::Conductor { roughness, .. } | Bsdf::Dielectric { roughness, .. } | Bsdf::Plastic { roughness, .. }) =
            &mut scene.materials[material].bsdf
        else {
            panic!("one of these")
        };
        *roughness = Roughness::Texture(texture);
        digest(&scene)
    };
    for material in [2, 3, 5] {
        let found = [with(material, 1), with(material, 2), digest(&full())];
        assert!(found[0] != found[1] && found[1] != found[2] && found[0] != found[2], "material {material}");
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
    // Before there was a choice.
    let one = [("integrator.wavelengths_per_channel".to_owned(), "1".to_owned())];
    let digest = scene::load(&file, &one).expect("the Cornell box").digest;
    assert_eq!(digest, "0974c0c5980c31b57850778acd84aba60c4ba962bb0ad2d800fb07b0e67e0b69");
    let digest = scene::load(&file, &[]).expect("the Cornell box").digest;
    assert_eq!(digest, "8578787f1ad3cc06ae82c1d795679dae0488c4421db89121899394ec0b9ba1c8");
}
