//! A scene with everything in it that Spectile can render, out of sight: what a renderer with one set of kernels for all scenes
//! would run. It is what `bench` compares a scene's own kernels with.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec2, DVec3};

use crate::device::accel;
use crate::scene::{
    Absorber, Attributes, Bsdf, Emission, Environment, EnvironmentMap, Field, Grid, Interior, Light, Material, Medium,
    Mesh, Object, Reflectance, Scene, Shape, Sides, Spectrum, Temperature, Texels, Texture, TextureKind, Weight,
};
use crate::spectral::{Curve, Outside};

/// Of everything that shines, so that no path ever asks it; the powers of real lights are above 1e-12 of theirs.
const DARK: f64 = 1e-30;
/// Side of the box behind the camera, of the scene's diagonal.
const SIZE: f64 = 1e-3;

/// `scene`, and a black box behind its camera with one of each kind of material, texture, light, medium and heat that it has not.
/// The picture is the same but for what the box hides from light; camera, film, sampler and roulette are as they were.
pub fn with_everything(scene: &Scene) -> Scene {
    let camera = scene.camera.position;
    let [low, high] = accel::bounds(scene.objects.iter().map(|object| &object.shape)).unwrap_or([camera; 2]);
    let size = SIZE * (high.max(camera) - low.min(camera)).length();
    let mut all = Everything { scene: scene.clone(), at: camera - 2.0 * size * scene.camera.forward, size };
    all.add();
    all.scene
}

struct Everything {
    scene: Scene,
    /// The middle of the box.
    at: DVec3,
    size: f64,
}

impl Everything {
    fn add(&mut self) {
        let corner = |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2 & 1)) - 0.5;
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let cube = |at: DVec3, size: f64| {
            Shape::Mesh(Mesh {
                positions: (0..8).map(|i| at + size * corner(i)).collect(),
                triangles: quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
            })
        };
        let black = self.material(Bsdf::Black, None);
        self.object(cube(self.at, self.size), Some(black), Attributes::default());
        let ball = |this: &Self| Shape::Sphere { center: this.at, radius: 0.01 * this.size };
        let axes = || Attributes { axes: Some(DMat3::IDENTITY), ..Attributes::default() };

        // A line in the middle of every channel, which no affordable number of strata resolves.
        let line = |[from, to]: &[f64; 2]| {
            let (middle, width) = (0.5 * (from + to), 1e-4 * (to - from));
            [(middle - width, 0.1), (middle, 0.9), (middle + width, 0.1)]
        };
        let mut points: Vec<(f64, f64)> = self.scene.channels.bounds.iter().flat_map(line).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points.dedup_by(|a, b| a.0 <= b.0);
        let (nm, value) = points.into_iter().unzip();
        let spiky = self.spectrum(Curve::Linear { nm, value, outside: Outside::Hold });
        let (grey, dark) = (self.spectrum(Curve::Constant(0.5)), self.spectrum(Curve::Constant(DARK)));
        let (low, high) = (self.lowest(), self.highest());
        let index = Curve::Linear { nm: vec![low, high], value: vec![1.6, 1.5], outside: Outside::Hold };
        let (eta, k) = (self.spectrum(index), self.spectrum(Curve::Constant(3.0)));

        let colour = self.texture(TextureKind::Colour, &[0.5; 12]);
        let mixture = self.texture(TextureKind::Mixture(vec![grey, spiky]), &[0.5; 8]);
        let weight = self.texture(TextureKind::Number, &[0.5; 4]);
        // Kelvins so low that nothing in the spectrum shines.
        let cold = self.texture(TextureKind::Number, &[1.0; 4]);
        let metal = |roughness| Bsdf::Conductor { eta, k, roughness, energy_compensation: true };
        let glass = |roughness| Bsdf::Dielectric { eta, dispersion: true, roughness };
        let diffuse = |reflectance| Bsdf::Diffuse { reflectance };
        let coated = |reflectance, roughness| Bsdf::Plastic { reflectance, eta, roughness };
        let kinds = [
            (diffuse(Reflectance::Spectrum(spiky)), None),
            (diffuse(Reflectance::Texture(colour)), None),
            (coated(Reflectance::Spectrum(grey), 0.0), None),
            (coated(Reflectance::Texture(mixture), 0.2), None),
            (metal([0.0; 2]), None),
            (metal([0.3, 0.1]), None),
            (metal([0.2; 2]), Some(Temperature::Constant(1.0))),
            (metal([0.3, 0.1]), Some(Temperature::Texture(cold))),
            (diffuse(Reflectance::Texture(mixture)), Some(Temperature::Texture(cold))),
            (coated(Reflectance::Texture(mixture), 0.2), Some(Temperature::Texture(cold))),
            (glass(0.0), None),
            (glass(0.2), None),
        ];
        let mut last = Vec::new();
        for (bsdf, temperature) in kinds {
            let material = self.material(bsdf, temperature);
            last.push(material);
            self.object(ball(self), Some(material), axes());
        }
        let blend = Bsdf::Blend { a: last[0], b: last[1], weight: Weight::Texture(weight) };
        let blend = self.material(blend, None);
        self.object(ball(self), Some(blend), axes());

        // Shading normals.
        let positions = [DVec3::ZERO, DVec3::X, DVec3::Y].map(|p| self.at + 0.01 * self.size * p).to_vec();
        let smooth = Attributes {
            uv: Some(vec![[DVec2::ZERO, DVec2::X, DVec2::Y]]),
            normals: Some(vec![[DVec3::Z, DVec3::new(0.6, 0.0, 0.8), DVec3::Z]]),
            axes: None,
        };
        self.object(Shape::Mesh(Mesh { positions, triangles: vec![[0, 1, 2]] }), Some(last[0]), smooth);

        self.object(ball(self), Some(black), Attributes::default());
        self.last().emission = Some(Emission { radiance: dark, sides: Sides::Front });
        self.add_gas(cube(self.at, 0.5 * self.size), dark);
        self.add_lights(dark);
    }

    /// A cold gas on a grid, in a null boundary.
    fn add_gas(&mut self, boundary: Shape, absorption: usize) {
        let grid = |value: f32| Field::Grid(Arc::new(Grid { size: [2, 2, 2], values: vec![value; 8] }));
        let columns = vec![(1.0, absorption), (300.0, absorption)];
        let absorbers = vec![Absorber { strength: 1.0, columns }];
        let medium =
            Medium { name: "gas of everything".into(), absorbers, temperature: Some(grid(1.0)), density: grid(1.0) };
        self.scene.media.push(medium);
        self.object(boundary, None, Attributes::default());
        let taken = self.scene.objects.iter().filter_map(|object| object.interior).map(|interior| interior.body + 1);
        let body = taken.max().unwrap_or(0);
        let to_grid = DAffine3::from_scale(DVec3::splat(2.0 / self.size))
            * DAffine3::from_translation(-(self.at - 0.25 * self.size));
        self.last().interior = Some(Interior { body, medium: self.scene.media.len() - 1, to_grid });
    }

    fn add_lights(&mut self, dark: usize) {
        let direction = DVec3::NEG_Y;
        self.scene.lights.extend([
            Light::Point { position: self.at, intensity: dark },
            Light::Directional { direction, irradiance: dark },
            Light::Sun { direction, angular_radius: PI / 360.0, irradiance: dark },
        ]);
        if self.scene.environment.is_none() {
            self.scene.environment = Some(Environment::Map(EnvironmentMap {
                name: "sky of everything".into(),
                to_map: DMat3::IDENTITY,
                scale: 1.0,
                size: [4, 2],
                texels: Texels::Spectral {
                    nm: vec![self.lowest(), self.highest()],
                    radiance: vec![DARK as f32; 16].into(),
                },
            }));
        }
    }

    fn lowest(&self) -> f64 {
        self.scene.channels.bounds.iter().map(|b| b[0]).fold(f64::INFINITY, f64::min)
    }

    fn highest(&self) -> f64 {
        self.scene.channels.bounds.iter().map(|b| b[1]).fold(0.0, f64::max)
    }

    fn spectrum(&mut self, curve: Curve) -> usize {
        self.scene.spectra.push(Spectrum { name: "of everything".into(), curve });
        self.scene.spectra.len() - 1
    }

    /// 2 x 2 texels.
    fn texture(&mut self, kind: TextureKind, texels: &[f32]) -> usize {
        let texture = Texture { name: "of everything".into(), size: [2, 2], kind, texels: texels.into() };
        self.scene.textures.push(texture);
        self.scene.textures.len() - 1
    }

    fn material(&mut self, bsdf: Bsdf, temperature: Option<Temperature>) -> usize {
        self.scene.materials.push(Material { name: "of everything".into(), bsdf, two_sided: true, temperature });
        self.scene.materials.len() - 1
    }

    fn object(&mut self, shape: Shape, material: Option<usize>, attributes: Attributes) {
        let name = "of everything".to_owned();
        self.scene.objects.push(Object { name, shape, attributes, material, emission: None, interior: None });
    }

    fn last(&mut self) -> &mut Object {
        self.scene.objects.last_mut().expect("just pushed")
    }
}
