//! Builds `Scene` values directly in Rust, so that a test needs no files and can say everything in a few lines.

pub mod closed_forms;
pub mod heat;
pub mod surfaces;

use glam::{DAffine3, DMat3, DVec2, DVec3};
use spectile::scene::{
    Assembly, Attributes, Bsdf, Camera, Cone, Emission, Environment, EnvironmentMap, Evaluation, Evaluator, Film,
    Filter, Integrator, Light, Material, Mesh, Object, Placement, Projection, Reflectance, Roughness, Sampler, Scene,
    Shape, Sides, Spectrum, Texels, Texture, TextureKind, Wavelengths, Weight,
};
use spectile::spectral::{Channels, Curve, Outside, upsample};

/// A scene under construction. Starts empty and dark: one pixel that looks along -z from (0, 0, 1), one channel
/// 500-600 nm, one bounce.
pub struct Builder(pub Scene);

impl Builder {
    pub fn new() -> Self {
        Builder(Scene {
            file: "built-in-a-test".into(),
            camera: look(DVec3::Z, DVec3::ZERO, DVec3::Y, narrow()),
            film: Film { width: 1, height: 1, filter: Filter::Box, crop: [0, 0, 1, 1] },
            channels: Channels::from_bounds(vec![[500.0, 600.0]], None),
            integrator: Integrator {
                max_bounces: 1,
                russian_roulette_start: 0,
                sampler: Sampler::Independent,
                wavelengths: Wavelengths::Emission,
                wavelengths_per_channel: Some(1),
                techniques: None,
                forced_collision: false,
                evaluation: Evaluation::All,
                evaluator: Evaluator::Auto,
                epoch: 64,
            },
            spectra: Vec::new(),
            materials: Vec::new(),
            textures: Vec::new(),
            objects: Vec::new(),
            assemblies: Vec::new(),
            media: Vec::new(),
            camera_medium: None,
            lights: Vec::new(),
            environment: None,
            georeference: None,
            first_hits: false,
            warnings: Vec::new(),
            digest: String::new(),
        })
    }

    pub fn camera(mut self, camera: Camera) -> Self {
        self.0.camera = camera;
        self
    }

    /// 3 x 3 pixels of a room between (-1, -1, -1) and (1, 1, 3), seen from its open end.
    pub fn into_room(self) -> Self {
        let projection = Projection::Perspective { tan_half: DVec2::splat(0.5) };
        let camera = look(DVec3::new(0.1, 0.2, 2.9), DVec3::new(0.0, -0.2, 0.0), DVec3::Y, projection);
        self.camera(camera).film(3, 3, Filter::Box)
    }

    /// 7 x 5 pixels of what stands in a corner around the origin, in six channels of the visible.
    pub fn into_corner(self) -> Self {
        let projection = Projection::Perspective { tan_half: DVec2::new(0.7, 0.5) };
        let camera = look(DVec3::new(0.2, 0.3, 2.2), DVec3::ZERO, DVec3::Y, projection);
        self.camera(camera).film(7, 5, Filter::Box).channels(Channels::equal(400.0, 700.0, 6)).bounces(4)
    }

    /// A film without crop.
    pub fn film(mut self, width: u32, height: u32, filter: Filter) -> Self {
        self.0.film = Film { width, height, filter, crop: [0, 0, width, height] };
        self
    }

    pub fn channels(mut self, channels: Channels) -> Self {
        self.0.channels = channels;
        self
    }

    pub fn bounces(mut self, max_bounces: u32) -> Self {
        self.0.integrator.max_bounces = max_bounces;
        self
    }

    pub fn roulette(mut self, start: u32) -> Self {
        self.0.integrator.russian_roulette_start = start;
        self
    }

    pub fn sky(mut self, radiance: impl IntoCurve) -> Self {
        let radiance = self.spectrum(radiance);
        self.0.environment = Some(Environment::Uniform(radiance));
        self
    }

    /// A map around the scene, +y up.
    pub fn map(mut self, size: [u32; 2], texels: Texels) -> Self {
        let name = "a map".to_owned();
        self.0.environment =
            Some(Environment::Map(EnvironmentMap { name, to_map: DMat3::IDENTITY, scale: 1.0, size, texels }));
        self
    }

    /// The map of linear sRGB colours, \[y\]\[x\]\[3\].
    pub fn rgb_map(mut self, size: [u32; 2], rgb: Vec<f32>) -> Self {
        let daylight = self.spectrum(upsample::daylight());
        self.map(size, Texels::Rgb { rgb: rgb.into(), daylight })
    }

    pub fn point(mut self, position: DVec3, intensity: impl IntoCurve) -> Self {
        let intensity = self.spectrum(intensity);
        self.0.lights.push(Light::Point { position, intensity });
        self
    }

    pub fn spot(mut self, position: DVec3, direction: DVec3, intensity: impl IntoCurve, cone: Cone) -> Self {
        let (direction, intensity) = (direction.normalize(), self.spectrum(intensity));
        self.0.lights.push(Light::Spot { position, direction, intensity, cone });
        self
    }

    pub fn directional(mut self, direction: DVec3, irradiance: impl IntoCurve) -> Self {
        let (direction, irradiance) = (direction.normalize(), self.spectrum(irradiance));
        self.0.lights.push(Light::Directional { direction, irradiance });
        self
    }

    pub fn sun(mut self, direction: DVec3, angular_radius: f64, irradiance: impl IntoCurve) -> Self {
        let (direction, irradiance) = (direction.normalize(), self.spectrum(irradiance));
        self.0.lights.push(Light::Sun { direction, angular_radius, irradiance });
        self
    }

    /// A shape that reflects and does not emit, on both sides.
    pub fn diffuse(mut self, shape: Shape, reflectance: impl IntoCurve) -> Self {
        let reflectance = self.spectrum(reflectance);
        self.object(shape, Bsdf::Diffuse { reflectance: Reflectance::Spectrum(reflectance) }, true, None)
    }

    pub fn one_sided(mut self, shape: Shape, reflectance: impl IntoCurve) -> Self {
        let reflectance = self.spectrum(reflectance);
        self.object(shape, Bsdf::Diffuse { reflectance: Reflectance::Spectrum(reflectance) }, false, None)
    }

    /// A shape that reflects and emits.
    pub fn glowing(
        mut self,
        shape: Shape,
        reflectance: impl IntoCurve,
        radiance: impl IntoCurve,
        sides: Sides,
    ) -> Self {
        let (reflectance, radiance) = (self.spectrum(reflectance), self.spectrum(radiance));
        self.object(
            shape,
            Bsdf::Diffuse { reflectance: Reflectance::Spectrum(reflectance) },
            true,
            Some(Emission { radiance, sides, texture: None }),
        )
    }

    /// A shape that emits and reflects nothing.
    pub fn lamp(mut self, shape: Shape, radiance: impl IntoCurve, sides: Sides) -> Self {
        let radiance = self.spectrum(radiance);
        self.object(shape, Bsdf::Black, true, Some(Emission { radiance, sides, texture: None }))
    }

    pub fn black(self, shape: Shape) -> Self {
        self.object(shape, Bsdf::Black, true, None)
    }

    /// A metal, with energy compensation.
    pub fn conductor(mut self, shape: Shape, eta: impl IntoCurve, k: impl IntoCurve, roughness: [f64; 2]) -> Self {
        let (eta, k) = (self.spectrum(eta), self.spectrum(k));
        self.object(
            shape,
            Bsdf::Conductor { eta, k, roughness: Roughness::Constant(roughness), energy_compensation: true },
            true,
            None,
        )
    }

    /// A dispersive dielectric; the front is outside.
    pub fn dielectric(mut self, shape: Shape, eta: impl IntoCurve, roughness: f64) -> Self {
        let eta = self.spectrum(eta);
        self.object(
            shape,
            Bsdf::Dielectric { eta, dispersion: true, roughness: Roughness::even(roughness) },
            true,
            None,
        )
    }

    pub fn plastic(mut self, shape: Shape, reflectance: impl IntoCurve, eta: impl IntoCurve, roughness: f64) -> Self {
        let (reflectance, eta) = (self.spectrum(reflectance), self.spectrum(eta));
        self.object(
            shape,
            Bsdf::Plastic {
                reflectance: Reflectance::Spectrum(reflectance),
                eta,
                roughness: Roughness::even(roughness),
            },
            true,
            None,
        )
    }

    /// The last material lets rays pass.
    pub fn opacity(mut self, opacity: Weight) -> Self {
        self.0.materials.last_mut().expect("a material").opacity = Some(opacity);
        self
    }

    /// A leaf: a spectrum each for what it reflects and transmits.
    pub fn translucent(mut self, shape: Shape, reflectance: impl IntoCurve, transmittance: impl IntoCurve) -> Self {
        let [reflectance, transmittance] =
            [self.spectrum(reflectance), self.spectrum(transmittance)].map(Reflectance::Spectrum);
        self.object(shape, Bsdf::Translucent { reflectance, transmittance }, true, None)
    }

    /// A blend of the materials of the last two objects, which only lend theirs.
    pub fn blend_of_last_two(mut self, shape: Shape, weight: f64) -> Self {
        let last = self.0.materials.len() - 1;
        self.0.objects.truncate(self.0.objects.len() - 2);
        self.object(shape, Bsdf::Blend { a: last - 1, b: last, weight: Weight::Constant(weight) }, true, None)
    }

    /// A diffuse surface with a texture.
    pub fn textured(self, shape: Shape, texture: usize) -> Self {
        self.object(shape, Bsdf::Diffuse { reflectance: Reflectance::Texture(texture) }, true, None)
    }

    /// A coat over a textured base.
    pub fn coated(mut self, shape: Shape, texture: usize, eta: impl IntoCurve, roughness: f64) -> Self {
        let eta = self.spectrum(eta);
        let bsdf =
            Bsdf::Plastic { reflectance: Reflectance::Texture(texture), eta, roughness: Roughness::even(roughness) };
        self.object(shape, bsdf, true, None)
    }

    /// A blend of the materials of the last two objects, which only lend theirs, by a texture.
    pub fn masked_last_two(mut self, shape: Shape, texture: usize) -> Self {
        self = self.blend_of_last_two(shape, 0.5);
        let Some(Bsdf::Blend { weight, .. }) = self.0.materials.last_mut().map(|m| &mut m.bsdf) else { unreachable!() };
        *weight = Weight::Texture(texture);
        self
    }

    /// Shares of `endmembers`, \[y\]\[x\]\[endmember\], rows from the top.
    pub fn mixture(&mut self, size: [u32; 2], texels: &[f32], endmembers: &[Curve]) -> usize {
        let spectra = endmembers.iter().map(|curve| self.spectrum(curve.clone())).collect();
        self.texture(size, texels, TextureKind::Mixture(spectra))
    }

    pub fn texture(&mut self, size: [u32; 2], texels: &[f32], kind: TextureKind) -> usize {
        let placement = Placement::default();
        let texture = Texture { name: "texture".into(), size, kind, texels: texels.into(), placement };
        assert_eq!(texels.len(), size[0] as usize * size[1] as usize * texture.channels());
        self.0.textures.push(texture);
        self.0.textures.len() - 1
    }

    /// The last object's attributes.
    pub fn attributes(mut self, attributes: Attributes) -> Self {
        self.0.objects.last_mut().expect("an object").attributes = attributes;
        self
    }

    /// The last `count` objects, placed so often instead of once.
    pub fn placed(mut self, count: usize, instances: Vec<DAffine3>) -> Self {
        let id = self.0.assemblies.len();
        let first = self.0.objects.len() - count;
        self.0.objects[first..].iter_mut().for_each(|object| object.assembly = Some(id));
        self.0.assemblies.push(Assembly { name: format!("assembly {id}"), instances });
        self
    }

    pub fn build(self) -> Scene {
        self.0
    }

    fn spectrum(&mut self, curve: impl IntoCurve) -> usize {
        let name = format!("spectrum {}", self.0.spectra.len());
        self.0.spectra.push(Spectrum { name, curve: curve.into_curve(), definition: None });
        self.0.spectra.len() - 1
    }

    fn object(mut self, shape: Shape, bsdf: Bsdf, two_sided: bool, emission: Option<Emission>) -> Self {
        let material = self.0.materials.len();
        let name = format!("material {material}");
        self.0.materials.push(Material { name, bsdf, two_sided, temperature: None, opacity: None });
        let name = format!("objects.{}", self.0.objects.len());
        let (attributes, material) = (Attributes::default(), Some(material));
        self.0.objects.push(Object { name, shape, attributes, material, emission, interior: None, assembly: None });
        self
    }
}

/// A number or a curve.
pub trait IntoCurve {
    fn into_curve(self) -> Curve;
}

impl IntoCurve for f64 {
    fn into_curve(self) -> Curve {
        Curve::Constant(self)
    }
}

impl IntoCurve for Curve {
    fn into_curve(self) -> Curve {
        self
    }
}

/// Linear between nodes, held beyond them.
pub fn table(nm: &[f64], value: &[f64]) -> Curve {
    Curve::Linear { nm: nm.to_vec(), value: value.to_vec(), outside: Outside::Hold }
}

/// Channels a nanometre wide, and a spectrum of these values in them.
pub fn by_channel(values: &[f64]) -> (Channels, Curve) {
    let bounds: Vec<[f64; 2]> = (0..values.len()).map(|k| [500.0 + 10.0 * k as f64, 501.0 + 10.0 * k as f64]).collect();
    let nm = bounds.iter().flatten().copied().collect();
    let value = values.iter().flat_map(|value| [*value; 2]).collect();
    (Channels::from_bounds(bounds, None), Curve::Linear { nm, value, outside: Outside::Hold })
}

/// A projection so narrow that all rays of a film go to one point to within 1e-9 of the distance.
pub fn narrow() -> Projection {
    Projection::Perspective { tan_half: DVec2::splat(1e-9) }
}

/// A camera at `position` that looks at `target`; `up` must not be along the line of sight.
pub fn look(position: DVec3, target: DVec3, up: DVec3, projection: Projection) -> Camera {
    let forward = (target - position).normalize();
    let right = forward.cross(up).normalize();
    Camera { position, forward, right, up: right.cross(forward), projection, distortion: None }
}

/// A parallelogram with normal edge_u x edge_v, its tangent along edge_u.
/// (u, v) at the corners of the two triangles of a quad, as `quad` of a scene file has them.
pub fn quad_uv() -> Attributes {
    let [a, b, c, d] = [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y];
    Attributes { uv: Some(vec![[a, b, c], [c, d, a]]), ..Attributes::default() }
}

pub fn quad(corner: DVec3, edge_u: DVec3, edge_v: DVec3) -> Shape {
    let positions = vec![corner, corner + edge_u, corner + edge_u + edge_v, corner + edge_v];
    Shape::Mesh(Mesh { positions, triangles: vec![[0, 1, 2], [2, 3, 0]] })
}

/// The six faces of a box whose normals point inwards.
pub fn room(min: DVec3, max: DVec3) -> Shape {
    let corner = |i: u32| DVec3::select(glam::BVec3::new(i & 1 != 0, i & 2 != 0, i & 4 != 0), max, min);
    let faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Shape::Mesh(Mesh { positions: (0..8).map(corner).collect(), triangles })
}

pub fn disk(center: DVec3, normal: DVec3, radius: f64) -> Shape {
    Shape::Disk { center, normal, radius }
}

pub fn sphere(center: DVec3, radius: f64) -> Shape {
    Shape::Sphere { center, radius }
}

/// A mesh around `center` with shading normals that lead away from there.
pub fn round_normals(center: DVec3, mesh: &Shape) -> Attributes {
    let Shape::Mesh(mesh) = mesh else { panic!("round shapes have their own normals") };
    let away = |i: u32| (mesh.positions[i as usize] - center).normalize();
    Attributes { normals: Some(mesh.triangles.iter().map(|t| t.map(away)).collect()), ..Attributes::default() }
}

/// An icosahedron whose triangles are split in four `levels` times, vertices pushed onto the sphere; outward normals.
pub fn icosphere(center: DVec3, radius: f64, levels: u32) -> Shape {
    let golden = 0.5 * (1.0 + 5f64.sqrt());
    let mut positions: Vec<DVec3> = Vec::new();
    for (a, b) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
        positions.extend([DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)].map(DVec3::normalize));
    }
    // Its faces are the triples of vertices at edge distance from one another.
    let edge = 2.0 / (1.0 + golden * golden).sqrt();
    let near = |a: usize, b: usize| (positions[a].distance(positions[b]) - edge).abs() < 1e-9;
    let mut triangles = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    let outward =
                        (positions[b] - positions[a]).cross(positions[c] - positions[a]).dot(positions[a]) > 0.0;
                    triangles.push(if outward { [a, b, c] } else { [a, c, b] }.map(|i| i as u32));
                }
            }
        }
    }
    for _ in 0..levels {
        let mut middles = std::collections::HashMap::new();
        let mut finer = Vec::new();
        for [a, b, c] in triangles {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    positions.push((positions[i as usize] + positions[j as usize]).normalize());
                    positions.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    Shape::Mesh(Mesh { positions: positions.into_iter().map(|p| center + radius * p).collect(), triangles })
}
