//! A scene with everything in it that Spectile can render, out of sight: what a renderer with one set of kernels for all scenes
//! would run. It is what `bench` compares a scene's own kernels with; each part of [`PARTS`] adds what needs it.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec2, DVec3};

use crate::device::part::{PARTS, Part};
use crate::scene::{
    Absorber, Assembly, Attributes, Bsdf, Component, Cone, Distortion, Emission, Environment, EnvironmentMap, Field,
    Grid, Interior, Light, Material, Medium, Mesh, Object, Phase, PhaseTable, Placement, Profile, Projection,
    Reflectance, Roughness, Scattering, Scene, Shape, Sides, Spectrum, Temperature, Texels, Texture, TextureKind,
    Weight,
};
use crate::spectral::{Curve, Outside};

/// Of everything that shines, so that no path ever asks it; the powers of real lights are above 1e-12 of theirs.
const DARK: f64 = 1e-30;
/// Side of the box behind the camera, of the scene's diagonal.
const SIZE: f64 = 1e-3;

/// `scene`, and a black box behind its camera with one of each kind of material, texture, light, medium and heat that it has not.
/// The picture is the same but for what the box hides from light; camera, film, sampler and roulette are as they were.
pub fn with_everything(scene: &Scene) -> Scene {
    with_parts(scene, PARTS)
}

/// `scene` with what needs `parts`, likewise.
pub fn with_parts(scene: &Scene, parts: &[&Part]) -> Scene {
    let mut exhibit = Exhibit::behind_camera(scene);
    for add in parts.iter().filter_map(|part| part.example) {
        add(&mut exhibit);
    }
    exhibit.scene
}

/// A scene, and where in it things are added that nobody sees.
pub struct Exhibit {
    scene: Scene,
    /// The middle of the box, and its side.
    at: DVec3,
    size: f64,
}

impl Exhibit {
    fn behind_camera(scene: &Scene) -> Exhibit {
        let camera = scene.camera.position;
        let [low, high] = scene.bounds().unwrap_or([camera; 2]);
        let size = SIZE * (high.max(camera) - low.min(camera)).length();
        let size = if size > 0.0 { size } else { SIZE };
        let mut exhibit = Exhibit { scene: scene.clone(), at: camera - 2.0 * size * scene.camera.forward, size };
        let black = exhibit.material(Bsdf::Black, None);
        exhibit.object(exhibit.cube(exhibit.size), Some(black), Attributes::default());
        exhibit
    }

    fn cube(&self, size: f64) -> Shape {
        let corner = |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2 & 1)) - 0.5;
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        Shape::Mesh(Mesh {
            positions: (0..8).map(|i| self.at + size * corner(i)).collect(),
            triangles: quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        })
    }

    fn ball(&self) -> Shape {
        Shape::Sphere { center: self.at, radius: 0.01 * self.size }
    }

    pub fn add_instances(&mut self) {
        let black = self.material(Bsdf::Black, None);
        self.object(self.ball(), Some(black), Attributes::default());
        let name = "example".to_owned();
        self.scene.objects.last_mut().expect("just pushed").assembly = Some(self.scene.assemblies.len());
        self.scene.assemblies.push(Assembly { name, instances: vec![DAffine3::IDENTITY; 2] });
    }

    pub fn add_luminous_instances(&mut self) {
        self.add_instances();
        let radiance = self.spectrum(Curve::Constant(DARK));
        let emission = Emission { radiance, sides: Sides::Front, texture: None };
        self.scene.objects.last_mut().expect("just pushed").emission = Some(emission);
    }

    /// By nothing: the picture is the same. Cameras without a perspective have none.
    pub fn distort(&mut self) {
        if matches!(self.scene.camera.projection, Projection::Perspective { .. } | Projection::ThinLens { .. }) {
            self.scene.camera.distortion.get_or_insert(Distortion { radial: [0.0; 3], tangential: [0.0; 2] });
        }
    }

    pub fn ask_for_layers(&mut self) {
        self.scene.first_hits = true;
    }

    pub fn add_black_ball(&mut self) {
        let black = self.material(Bsdf::Black, None);
        self.object(self.ball(), Some(black), Attributes::default());
    }

    /// A ball of a material, and its number.
    fn add_ball(&mut self, bsdf: Bsdf, temperature: Option<Temperature>) -> usize {
        let material = self.material(bsdf, temperature);
        let axes = Attributes { axes: Some(DMat3::IDENTITY), ..Attributes::default() };
        self.object(self.ball(), Some(material), axes);
        material
    }

    pub fn add_turned_ball(&mut self) {
        let grey = self.spectrum(Curve::Constant(0.5));
        self.add_ball(Bsdf::Diffuse { reflectance: Reflectance::Spectrum(grey) }, None);
    }

    /// A line in the middle of every channel, which no affordable number of strata resolves.
    fn spiky(&mut self) -> usize {
        let line = |[from, to]: &[f64; 2]| {
            let (middle, width) = (0.5 * (from + to), 1e-4 * (to - from));
            [(middle - width, 0.1), (middle, 0.9), (middle + width, 0.1)]
        };
        let mut points: Vec<(f64, f64)> = self.scene.channels.bounds.iter().flat_map(line).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points.dedup_by(|a, b| a.0 <= b.0);
        let (nm, value) = points.into_iter().unzip();
        self.spectrum(Curve::Linear { nm, value, outside: Outside::Hold })
    }

    pub fn add_spiky_paint(&mut self) {
        let spiky = self.spiky();
        self.add_ball(Bsdf::Diffuse { reflectance: Reflectance::Spectrum(spiky) }, None);
    }

    /// An index that disperses.
    fn index(&mut self) -> usize {
        let (low, high) = (self.lowest(), self.highest());
        self.spectrum(Curve::Linear { nm: vec![low, high], value: vec![1.6, 1.5], outside: Outside::Hold })
    }

    fn metal(&mut self, roughness: [f64; 2]) -> Bsdf {
        let (eta, k) = (self.index(), self.spectrum(Curve::Constant(3.0)));
        Bsdf::Conductor { eta, k, roughness: Roughness::Constant(roughness), energy_compensation: true }
    }

    /// Varnish, a mirror, rough metal.
    pub fn add_surfaces(&mut self) {
        let (grey, eta) = (self.spectrum(Curve::Constant(0.5)), self.index());
        self.add_ball(
            Bsdf::Plastic { reflectance: Reflectance::Spectrum(grey), eta, roughness: Roughness::even(0.0) },
            None,
        );
        for roughness in [[0.0; 2], [0.2; 2]] {
            let metal = self.metal(roughness);
            self.add_ball(metal, None);
        }
    }

    /// A number, and a texture.
    pub fn add_masks(&mut self) {
        let texture = self.texture(TextureKind::Number, &[0.5; 4]);
        for opacity in [Weight::Constant(0.5), Weight::Texture(texture)] {
            let material = self.add_ball(Bsdf::Black, None);
            self.scene.materials[material].opacity = Some(opacity);
        }
    }

    pub fn add_leaf(&mut self) {
        let grey = Reflectance::Spectrum(self.spectrum(Curve::Constant(0.4)));
        self.add_ball(Bsdf::Translucent { reflectance: grey, transmittance: grey }, None);
    }

    pub fn add_brushed_metal(&mut self) {
        let metal = self.metal([0.3, 0.1]);
        self.add_ball(metal, None);
    }

    /// A metal, glass and varnish.
    pub fn add_roughness_textures(&mut self) {
        let roughness = Roughness::Texture(self.texture(TextureKind::Number, &[0.1, 0.2, 0.3, 0.4]));
        let (grey, eta) = (Reflectance::Spectrum(self.spectrum(Curve::Constant(0.5))), self.index());
        let k = self.spectrum(Curve::Constant(3.0));
        self.add_ball(Bsdf::Conductor { eta, k, roughness, energy_compensation: true }, None);
        self.add_ball(Bsdf::Dielectric { eta, dispersion: true, roughness }, None);
        self.add_ball(Bsdf::Plastic { reflectance: grey, eta, roughness }, None);
    }

    pub fn add_rough_glass(&mut self) {
        let eta = self.index();
        self.add_ball(Bsdf::Dielectric { eta, dispersion: true, roughness: Roughness::even(0.2) }, None);
    }

    /// A straight line over all channels.
    fn rising(&mut self, ends: [f64; 2]) -> usize {
        let hull = self.scene.channels.hull().expect("a scene has channels");
        self.spectrum(Curve::Linear { nm: hull.to_vec(), value: ends.to_vec(), outside: Outside::Hold })
    }

    /// Channels scatter to one side or to the other; what is so small asks for no techniques by itself.
    pub fn add_saturated_blend(&mut self) {
        self.scene.integrator.techniques.get_or_insert(3);
        let [reflectance, transmittance] =
            [[0.01, 0.95], [0.95, 0.01]].map(|ends| Reflectance::Spectrum(self.rising(ends)));
        self.add_ball(Bsdf::Translucent { reflectance, transmittance }, None);
    }

    /// Channels bend apart by one and a half widths of the lobe.
    pub fn add_frosted_flint(&mut self) {
        let eta = self.rising([1.9, 1.4]);
        self.add_ball(Bsdf::Dielectric { eta, dispersion: true, roughness: Roughness::even(0.25) }, None);
    }

    pub fn add_glass(&mut self) {
        let eta = self.index();
        self.add_ball(Bsdf::Dielectric { eta, dispersion: true, roughness: Roughness::even(0.0) }, None);
    }

    /// Colours, a mixture under a rough coat, and a mask.
    pub fn add_textures(&mut self) {
        let colour = self.texture(TextureKind::Colour, &[0.5; 12]);
        let weight = self.texture(TextureKind::Number, &[0.5; 4]);
        self.scene.textures[weight].placement.scale = DVec2::splat(2.0);
        let (mixture, eta) = (self.mixture(), self.index());
        let a = self.add_ball(Bsdf::Diffuse { reflectance: Reflectance::Texture(colour) }, None);
        let coated = Bsdf::Plastic { reflectance: Reflectance::Texture(mixture), eta, roughness: Roughness::even(0.2) };
        let b = self.add_ball(coated, None);
        self.add_ball(Bsdf::Blend { a, b, weight: Weight::Texture(weight) }, None);
    }

    fn mixture(&mut self) -> usize {
        let endmembers = vec![self.spectrum(Curve::Constant(0.5)), self.spiky()];
        self.texture(TextureKind::Mixture(endmembers), &[0.5; 8])
    }

    pub fn add_smooth_triangle(&mut self) {
        let grey = self.spectrum(Curve::Constant(0.5));
        let diffuse = self.material(Bsdf::Diffuse { reflectance: Reflectance::Spectrum(grey) }, None);
        let positions = [DVec3::ZERO, DVec3::X, DVec3::Y].map(|p| self.at + 0.01 * self.size * p).to_vec();
        let smooth = Attributes {
            uv: Some(vec![[DVec2::ZERO, DVec2::X, DVec2::Y]]),
            normals: Some(vec![[DVec3::Z, DVec3::new(0.6, 0.0, 0.8), DVec3::Z]]),
            axes: None,
        };
        self.object(Shape::Mesh(Mesh { positions, triangles: vec![[0, 1, 2]] }), Some(diffuse), smooth);
    }

    pub fn add_hot_metal(&mut self) {
        let metal = self.metal([0.2; 2]);
        self.add_ball(metal, Some(Temperature::Constant(1.0)));
    }

    /// Kelvins so low that nothing in the spectrum shines.
    pub fn add_hot_textures(&mut self) {
        let cold = Some(Temperature::Texture(self.texture(TextureKind::Number, &[1.0; 4])));
        let (mixture, eta, metal) = (Reflectance::Texture(self.mixture()), self.index(), self.metal([0.3, 0.1]));
        self.add_ball(metal, cold);
        self.add_ball(Bsdf::Diffuse { reflectance: mixture }, cold);
        self.add_ball(Bsdf::Plastic { reflectance: mixture, eta, roughness: Roughness::even(0.2) }, cold);
        let dark = Reflectance::Spectrum(self.spectrum(Curve::Constant(0.1)));
        self.add_ball(Bsdf::Translucent { reflectance: mixture, transmittance: dark }, cold);
        self.add_picture_lamp();
    }

    fn add_picture_lamp(&mut self) {
        let dark = self.spectrum(Curve::Constant(DARK));
        let texture = self.texture(TextureKind::Light(dark), &[1.0; 12]);
        self.add_ball(Bsdf::Black, None);
        self.last().emission = Some(Emission { radiance: dark, sides: Sides::Front, texture: Some(texture) });
    }

    pub fn add_lamp(&mut self) {
        let dark = self.spectrum(Curve::Constant(DARK));
        self.add_black_ball();
        self.last().emission = Some(Emission { radiance: dark, sides: Sides::Front, texture: None });
    }

    pub fn add_gas(&mut self) {
        self.add_medium(Field::Constant(1.0), Field::Constant(1.0));
    }

    pub fn add_voxels(&mut self) {
        let grid = |value: f32| Field::Grid(Arc::new(Grid { size: [2, 2, 2], values: vec![value; 8].into() }));
        self.add_medium(grid(1.0), grid(1.0));
    }

    pub fn add_placed_voxels(&mut self) {
        self.add_voxels();
        self.last().assembly = Some(self.scene.assemblies.len());
        let name = "example of voxels".to_owned();
        self.scene.assemblies.push(Assembly { name, instances: vec![DAffine3::IDENTITY; 2] });
    }

    /// Fog of two kinds, in voxels.
    pub fn add_cloud(&mut self) {
        let coefficient = self.spectrum(Curve::Constant(DARK));
        let g = self.spectrum(Curve::Constant(0.5));
        self.add_matter([Phase::HenyeyGreenstein(g), Phase::Rayleigh { depolarisation: 0.03 }], coefficient);
    }

    pub fn add_droplets(&mut self) {
        let coefficient = self.spectrum(Curve::Constant(DARK));
        let nm = vec![self.lowest(), self.highest()];
        let table = PhaseTable { degrees: vec![0.0, 180.0], nm, values: vec![vec![1.0; 2]; 2] };
        self.add_matter([Phase::Table(Arc::new(table))], coefficient);
    }

    fn add_matter(&mut self, phases: impl IntoIterator<Item = Phase>, coefficient: usize) {
        self.add_gas();
        let medium = self.scene.media.last_mut().expect("just pushed");
        let absorbers =
            std::mem::take(&mut medium.components).into_iter().next().map_or_else(Vec::new, |gas| gas.absorbers);
        let kind = |phase| Component {
            absorbers: absorbers.clone(),
            scattering: Some(Scattering { coefficient, phase }),
            density: Field::Constant(1.0),
        };
        medium.components = phases.into_iter().map(kind).collect();
    }

    /// A cold gas in a null boundary.
    fn add_medium(&mut self, temperature: Field, density: Field) {
        let absorption = self.spectrum(Curve::Constant(DARK));
        let columns = vec![(1.0, absorption), (300.0, absorption)];
        let absorbers = vec![Absorber { strength: 1.0, columns }];
        let name = "gas of everything".into();
        let components = vec![Component { absorbers, scattering: None, density }];
        self.scene.media.push(Medium { name, components, temperature: Some(temperature) });
        self.object(self.cube(0.5 * self.size), None, Attributes::default());
        let taken = self.scene.objects.iter().filter_map(|object| object.interior).map(|interior| interior.body + 1);
        let body = taken.max().unwrap_or(0);
        let to_grid = DAffine3::from_scale(DVec3::splat(2.0 / self.size))
            * DAffine3::from_translation(-(self.at - 0.25 * self.size));
        self.last().interior = Some(Interior { body, medium: self.scene.media.len() - 1, to_grid });
    }

    pub fn add_lights(&mut self) {
        let dark = self.spectrum(Curve::Constant(DARK));
        let direction = DVec3::NEG_Y;
        self.scene.lights.extend([
            Light::Point { position: self.at, intensity: dark },
            Light::Directional { direction, irradiance: dark },
            Light::Sun { direction, angular_radius: PI / 360.0, irradiance: dark },
        ]);
    }

    /// One of each profile.
    pub fn add_spots(&mut self) {
        let dark = self.spectrum(Curve::Constant(DARK));
        for profile in [Profile::Smooth, Profile::Linear] {
            let cone = Cone { half_angle: 0.5, falloff: 0.25, profile };
            self.scene.lights.push(Light::Spot { position: self.at, direction: DVec3::NEG_Y, intensity: dark, cone });
        }
    }

    /// A map around the scene, where there is no environment yet.
    pub fn add_map(&mut self) {
        if self.scene.environment.is_some() {
            return;
        }
        let nm = vec![self.lowest(), self.highest()];
        self.scene.environment = Some(Environment::Map(EnvironmentMap {
            name: "sky of everything".into(),
            to_map: DMat3::IDENTITY,
            scale: 1.0,
            size: [4, 2],
            texels: Texels::Spectral { nm, radiance: vec![DARK as f32; 16].into() },
        }));
    }

    fn lowest(&self) -> f64 {
        self.scene.channels.bounds.iter().map(|b| b[0]).fold(f64::INFINITY, f64::min)
    }

    fn highest(&self) -> f64 {
        self.scene.channels.bounds.iter().map(|b| b[1]).fold(0.0, f64::max)
    }

    fn spectrum(&mut self, curve: Curve) -> usize {
        self.scene.spectra.push(Spectrum { name: "of everything".into(), curve, definition: None });
        self.scene.spectra.len() - 1
    }

    /// 2 x 2 texels.
    fn texture(&mut self, kind: TextureKind, texels: &[f32]) -> usize {
        let placement = Placement::default();
        let texture = Texture { name: "of everything".into(), size: [2, 2], kind, texels: texels.into(), placement };
        self.scene.textures.push(texture);
        self.scene.textures.len() - 1
    }

    fn material(&mut self, bsdf: Bsdf, temperature: Option<Temperature>) -> usize {
        let name = "of everything".into();
        self.scene.materials.push(Material { name, bsdf, two_sided: true, temperature, opacity: None });
        self.scene.materials.len() - 1
    }

    fn object(&mut self, shape: Shape, material: Option<usize>, attributes: Attributes) {
        let name = "of everything".to_owned();
        self.scene.objects.push(Object {
            name,
            shape,
            attributes,
            material,
            emission: None,
            interior: None,
            assembly: None,
        });
    }

    fn last(&mut self) -> &mut Object {
        self.scene.objects.last_mut().expect("just pushed")
    }
}
