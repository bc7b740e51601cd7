//! A resolved, validated scene: what `scene.toml`, its meshes and its spectra say, in metres and nanometres,
//! f64, world space. Knows no GPU and no paths.

mod blend;
mod camera;
mod channels;
mod context;
mod decode;
mod digest;
mod environment;
mod file;
mod light;
mod material;
mod object;
mod overrides;
mod shape;
mod spectrum;
mod transform;
mod tree;

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};
use serde::{Deserialize, Serialize};

pub use file::{load, parse};

use crate::spectral::{Channels, Curve};

/// Index into [`Scene::spectra`].
pub type SpectrumId = usize;
/// Index into [`Scene::materials`].
pub type MaterialId = usize;

/// Everything a render needs to know about what is rendered.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The scene file, absolute.
    pub file: PathBuf,
    pub camera: Camera,
    pub film: Film,
    pub channels: Channels,
    pub integrator: Integrator,
    /// Every distinct spectrum in use, named ones and those written in place.
    pub spectra: Vec<Spectrum>,
    /// Only materials that some object uses, itself or as a part of a blend.
    pub materials: Vec<Material>,
    pub objects: Vec<Object>,
    pub lights: Vec<Light>,
    pub environment: Option<Environment>,
    /// Said once to the user: held tables, dropped triangles, …
    pub warnings: Vec<String>,
    /// Hex SHA-256 over everything above that decides the values of a cube (not paths or warnings).
    pub digest: String,
}

/// A curve with the name it goes by in messages.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    pub name: String,
    pub curve: Curve,
}

/// An orthonormal camera frame and a projection. A ray through film position (x, y), in pixels from the top left of
/// the *full* film, leaves along `forward + sx·right + sy·up` with
/// sx = (2x/width - 1)·tan_half.x and sy = (1 - 2y/height)·tan_half.y (perspective).
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    pub position: DVec3,
    pub forward: DVec3,
    /// cross(forward, up), negated under `flip_x`: columns run along it.
    pub right: DVec3,
    pub up: DVec3,
    pub projection: Projection,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Projection {
    Perspective {
        tan_half: DVec2,
    },
    /// Rays start on a disk of `aperture_radius` around `position` and meet at `focus_distance` along `forward`.
    ThinLens {
        tan_half: DVec2,
        aperture_radius: f64,
        focus_distance: f64,
    },
    /// Parallel rays along `forward` from position + sx·right + sy·up, where sx, sy span ± `half_size` (metres).
    Orthographic {
        half_size: DVec2,
    },
}

#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    /// Full size in pixels.
    pub width: u32,
    pub height: u32,
    pub filter: Filter,
    /// x0, y0, x1, y1: the cube covers columns x0..x1 and rows y0..y1 of the full film.
    pub crop: [u32; 4],
}

impl Film {
    /// Width and height of the cube in pixels.
    pub fn cube_size(&self) -> [u32; 2] {
        [self.crop[2] - self.crop[0], self.crop[3] - self.crop[1]]
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Filter {
    Box,
    /// σ = 0.5 px per axis, cut at ±2 px per axis, by filter importance sampling.
    Gaussian,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Integrator {
    /// Scattering events; next-event estimation at the last one included.
    pub max_bounces: u32,
    /// 0 = off; otherwise the first scattering event (1-based) at which roulette may end a path.
    pub russian_roulette_start: u32,
    pub sampler: Sampler,
    pub wavelengths: Wavelengths,
    /// As written in the scene: `auto`, `dpept-pixel`, …
    pub evaluator: String,
    /// Samples per pixel of a full epoch, a power of two up to 1,024.
    pub epoch: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sampler {
    Sobol,
    Independent,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Wavelengths {
    /// Eq. 4 of the method.
    Uniform,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    pub name: String,
    pub bsdf: Bsdf,
    /// Whether the back side (against the geometric normal) scatters like the front; otherwise it absorbs. True, and
    /// without meaning, for dielectrics, whose back is their inside, and for blends, whose parts have their own.
    pub two_sided: bool,
}

/// How a surface scatters. Roughness is the α of the GGX distribution in [0, 1]; what is below [`SMOOTH`] is smooth.
#[derive(Debug, Clone, PartialEq)]
pub enum Bsdf {
    Diffuse {
        reflectance: SpectrumId,
    },
    /// Complex index of refraction η + i k, k > 0 absorbs.
    Conductor {
        eta: SpectrumId,
        k: SpectrumId,
        /// Along the tangent ([`Shape`]) and across it; both smooth or neither.
        roughness: [f64; 2],
        energy_compensation: bool,
    },
    Dielectric {
        /// The index behind the geometric normal over that before it.
        eta: SpectrumId,
        /// Whether directions differ by wavelength where `eta` does.
        dispersion: bool,
        roughness: f64,
    },
    /// A diffuse base under a dielectric coat.
    Plastic {
        reflectance: SpectrumId,
        eta: SpectrumId,
        roughness: f64,
    },
    /// (1 - weight) a + weight b. Parts come before the blend in [`Scene::materials`].
    Blend {
        a: MaterialId,
        b: MaterialId,
        weight: f64,
    },
    Black,
}

/// Roughness below this is none: a mirror, or ideal refraction.
pub const SMOOTH: f64 = 1e-3;

/// One shape of one material. An OBJ with several materials becomes several objects.
#[derive(Debug, Clone)]
pub struct Object {
    /// For messages, e.g. `objects.3 (floor.obj, material "white")`.
    pub name: String,
    pub shape: Shape,
    pub material: MaterialId,
    pub emission: Option<Emission>,
}

/// World-space geometry, transforms applied.
///
/// Anisotropic materials are turned by a tangent, of either sign: along the first edge (corner 0 to 1) of a triangle,
/// which is along `edge_u` on a quad; around the axis of a disk or cylinder. Spheres and OBJ meshes have no tangent to
/// speak of and no anisotropic material.
#[derive(Debug, Clone)]
pub enum Shape {
    /// Also quads and cubes. Front = counter-clockwise.
    Mesh(Mesh),
    /// Normal outward, also under mirroring.
    Sphere {
        center: DVec3,
        radius: f64,
    },
    Disk {
        center: DVec3,
        normal: DVec3,
        radius: f64,
    },
    /// The side wall only; normal outward.
    Cylinder {
        from: DVec3,
        to: DVec3,
        radius: f64,
    },
}

#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    pub positions: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
}

/// Radiance leaving a surface, W m⁻² sr⁻¹ nm⁻¹, the same in all directions.
#[derive(Debug, Clone, PartialEq)]
pub struct Emission {
    pub radiance: SpectrumId,
    pub sides: Sides,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sides {
    Front,
    Both,
}

/// Light that comes from no surface.
#[derive(Debug, Clone, PartialEq)]
pub enum Light {
    Point {
        position: DVec3,
        /// W sr⁻¹ nm⁻¹, the same in all directions.
        intensity: SpectrumId,
    },
    Directional {
        /// In which the light travels; a unit vector.
        direction: DVec3,
        /// W m⁻² nm⁻¹ on a plane facing the light.
        irradiance: SpectrumId,
    },
    /// A disk at infinity, the same radiance all over, visible also to the camera.
    Sun {
        /// In which the light of its centre travels; a unit vector.
        direction: DVec3,
        /// Between centre and rim, radians, up to π/2.
        angular_radius: f64,
        /// W m⁻² nm⁻¹ on a plane facing its centre.
        irradiance: SpectrumId,
    },
}

impl Light {
    /// Its spectrum: intensity or irradiance.
    pub fn spectrum(&self) -> SpectrumId {
        match self {
            Light::Point { intensity, .. } => *intensity,
            Light::Directional { irradiance, .. } | Light::Sun { irradiance, .. } => *irradiance,
        }
    }
}

/// Radiance arriving from every direction that leaves the scene, W m⁻² sr⁻¹ nm⁻¹.
#[derive(Debug, Clone, PartialEq)]
pub enum Environment {
    /// The same from everywhere.
    Uniform(SpectrumId),
    Map(EnvironmentMap),
}

impl Environment {
    /// The spectrum of a uniform environment.
    pub fn uniform(&self) -> Option<SpectrumId> {
        match self {
            Environment::Uniform(radiance) => Some(*radiance),
            Environment::Map(_) => None,
        }
    }

    pub fn map(&self) -> Option<&EnvironmentMap> {
        match self {
            Environment::Uniform(_) => None,
            Environment::Map(map) => Some(map),
        }
    }
}

/// Radiance by direction. Direction d in the world is m = `to_map` d in the map, at u = ½ + atan2(m.x, -m.z) / 2π and
/// v = acos(m.y) / π. Texel (x, y) is centred at u = (x + ½) / width, v = (y + ½) / height; between centres the
/// radiance of every wavelength is bilinear, repeated in u, held in v.
#[derive(Debug, Clone, PartialEq)]
pub struct EnvironmentMap {
    /// For messages.
    pub name: String,
    /// A rotation.
    pub to_map: DMat3,
    /// Multiplies all radiance.
    pub scale: f64,
    /// Width and height.
    pub size: [u32; 2],
    pub texels: Texels,
}

/// Rows from the top (v = 0), each from u = 0. Finite and not negative.
#[derive(Debug, Clone, PartialEq)]
pub enum Texels {
    /// Linear sRGB, \[y\]\[x\]\[3\]. A texel's radiance is `daylight` times a smooth spectrum
    /// ([`crate::spectral::upsample`]).
    Rgb { rgb: Arc<[f32]>, daylight: SpectrumId },
    /// \[y\]\[x\]\[band\], linear between the wavelengths `nm`, which ascend, and 0 beyond them.
    Spectral { nm: Vec<f64>, radiance: Arc<[f32]> },
}
