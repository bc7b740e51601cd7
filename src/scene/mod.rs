//! A resolved, validated scene: what `scene.toml`, its meshes and its spectra say, in metres and nanometres,
//! f64, world space. Knows no GPU and no paths.

pub mod arrays;
mod assembly;
mod blend;
mod camera;
mod channels;
mod closed;
mod context;
mod coverage;
mod decode;
mod digest;
mod draft;
mod environment;
mod file;
mod georeference;
mod integrator;
pub mod keys;
mod light;
mod material;
mod medium;
mod object;
mod overrides;
mod phase;
mod relight;
mod sensor;
mod shape;
mod spectrum;
mod sun;
mod texture;
mod transform;
mod translucent;
pub mod tree;
mod words;

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec2, DVec3};
use serde::{Deserialize, Serialize};

pub use assembly::box_around_all;
pub use decode::join as dotted_key;
pub use draft::Draft;
pub use file::{load, parse, read};
pub use integrator::{Evaluation, Evaluator, Integrator, MOST_WAVELENGTHS, Sampler, Wavelengths};
pub use light::{Cone, Light, Profile};
pub use overrides::written;
pub use transform::box_around;

pub use crate::format::mtf::MtfTable;
pub use crate::format::phase::PhaseTable;
pub use relight::{Changeable, Choice, Chosen, Files, NewChannels, Relit, Rendered, changeable, choose, relight};
pub use sensor::{Blur, Detector, Optics, Seen, SensorModel, load_sensor, parse_sensor};
pub use spectrum::{Quantity, irradiance};

use crate::spectral::{Channels, Curve};

/// Index into [`Scene::spectra`].
pub type SpectrumId = usize;
/// Index into [`Scene::textures`].
pub type TextureId = usize;
/// Index into [`Scene::materials`].
pub type MaterialId = usize;
/// Index into [`Scene::media`].
pub type MediumId = usize;
/// Index into [`Scene::assemblies`].
pub type AssemblyId = usize;

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
    /// Only those that some material in use has.
    pub textures: Vec<Texture>,
    pub objects: Vec<Object>,
    /// Only those that are placed.
    pub assemblies: Vec<Assembly>,
    /// Only those that fill something.
    pub media: Vec<Medium>,
    /// What fills space outside all interiors.
    pub camera_medium: Option<MediumId>,
    pub lights: Vec<Light>,
    pub environment: Option<Environment>,
    pub georeference: Option<Georeference>,
    /// Whether the first surface behind each pixel is asked for, beside its radiance (`render --layers`).
    pub first_hits: bool,
    /// Said once to the user: held tables, dropped triangles, …
    pub warnings: Vec<String>,
    /// Hex SHA-256 over everything above that decides the values of a cube (not paths or warnings).
    pub digest: String,
}

impl Scene {
    /// Whether weights of products of its spectra are kept instead of radiance.
    pub fn is_factored(&self) -> bool {
        self.integrator.evaluator == Evaluator::Factored
    }

    /// The same, with the first surface behind each pixel asked for.
    pub fn with_first_hits(mut self) -> Scene {
        self.first_hits = true;
        self
    }

    /// The same, with weights of products of its spectra kept instead of radiance.
    pub fn factored(mut self) -> Scene {
        self.integrator.evaluator = Evaluator::Factored;
        self
    }
}

/// A curve with the name it goes by in messages.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    pub name: String,
    pub curve: Curve,
    /// What of `[spectra]` it was made of; `None` where it is written in place.
    pub definition: Option<Definition>,
}

/// Under a name in `[spectra]`, what a curve was made of: it is `scale` x this, or 1 - this.
#[derive(Debug, Clone, PartialEq)]
pub struct Definition {
    pub name: String,
    pub quantity: Quantity,
    pub curve: Arc<Curve>,
    pub scale: f64,
    pub is_complement: bool,
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
    /// Of the lens, under a perspective.
    pub distortion: Option<Distortion>,
}

/// Where a lens makes a picture of what a pinhole would have at (x, y), x to the right and y down in units of the focal length: with
/// r² = x² + y² at x (1 + k₁ r² + k₂ r⁴ + k₃ r⁶) + 2 p₁ x y + p₂ (r² + 2 x²), y (1 + k₁ r² + k₂ r⁴ + k₃ r⁶) + p₁ (r² + 2 y²) + 2 p₂ x y
/// (Brown 1966, *Decentering distortion of lenses*, with the names and signs of OpenCV).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distortion {
    /// Radial: k₁, k₂, k₃.
    pub radial: [f64; 3],
    /// Tangential: p₁, p₂.
    pub tangential: [f64; 2],
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
    /// All directions from one point, by longitude along x and latitude along y, as [`EnvironmentMap`] has them: `forward` (the map's -z)
    /// is in the middle, `right` (its +x) a quarter of the width right of it, `up` along the upper edge.
    Latlong,
    /// A line at a time, each from where the scanner is then. Across the track a line spans ± `half_width` at distance 1, along it ±
    /// `half_pixel`. The row of place y on the film is exposed from y = row to row + 1, while the scanner moves: at y it stands between
    /// lines as [`Line::at`] says.
    Pushbroom {
        half_width: f64,
        half_pixel: f64,
        /// One for each row of the full film, as it is in the middle of its exposure.
        lines: Arc<[Line]>,
    },
}

/// Where a line scanner is, and where it looks: unit vectors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    pub position: DVec3,
    pub forward: DVec3,
    /// Columns run along it.
    pub right: DVec3,
    /// Where the nose points.
    pub nose: DVec3,
}

impl Line {
    /// Between two of `lines`, at least two, in proportion: at the place y on the film, and on beyond the first and the last as between those
    /// next to them. Directions are not normalised.
    pub fn at(lines: &[Line], y: f64) -> Line {
        let place = y - 0.5;
        let first = place.floor().clamp(0.0, lines.len() as f64 - 2.0);
        let (from, to, share) = (&lines[first as usize], &lines[first as usize + 1], place - first);
        let between = |a: DVec3, b: DVec3| a + share * (b - a);
        Line {
            position: between(from.position, to.position),
            forward: between(from.forward, to.forward),
            right: between(from.right, to.right),
            nose: between(from.nose, to.nose),
        }
    }
}

/// Where on a map the full film lies.
#[derive(Debug, Clone, PartialEq)]
pub struct Georeference {
    /// `EPSG:` and a number, or WKT.
    pub crs: String,
    /// Of the place x, y on the film, in pixels from its top left corner: easting `a x + b y + c`, northing `d x + e y + f`, from a to f.
    pub affine: [f64; 6],
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

#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    pub name: String,
    pub bsdf: Bsdf,
    /// Whether the back side (against the geometric normal) scatters like the front; otherwise it absorbs. True, and
    /// without meaning, for dielectrics, whose back is their inside, and for blends, whose parts have their own.
    pub two_sided: bool,
    /// Emits ε(λ, ω) B(λ, T), ε = 1 - what the very same surface sends on of flux along ω, on either side. Of a blend: for
    /// those of its parts that have none of their own. `None` on dielectrics, which absorb nothing.
    pub temperature: Option<Temperature>,
    /// The share of rays that the surface is there for; the others pass as if it were not, into its interior if it has one.
    /// `None`: it is there for all of them. Parts of blends have none.
    pub opacity: Option<Weight>,
}

/// How hot a surface is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Temperature {
    /// K, above 0, all over.
    Constant(f64),
    /// A texture of [`TextureKind::Number`], K; what is at 0 K emits nothing.
    Texture(TextureId),
}

/// How a surface scatters.
#[derive(Debug, Clone, PartialEq)]
pub enum Bsdf {
    Diffuse {
        reflectance: Reflectance,
    },
    /// Lambert's law on both sides: of what arrives from either, some is reflected and some transmitted, together 1 at most.
    Translucent {
        reflectance: Reflectance,
        transmittance: Reflectance,
    },
    /// Complex index of refraction η + i k, k > 0 absorbs.
    Conductor {
        eta: SpectrumId,
        k: SpectrumId,
        roughness: Roughness,
        energy_compensation: bool,
    },
    Dielectric {
        /// The index behind the geometric normal over that before it.
        eta: SpectrumId,
        /// Whether directions differ by wavelength where `eta` does.
        dispersion: bool,
        roughness: Roughness,
    },
    /// A diffuse base under a dielectric coat.
    Plastic {
        reflectance: Reflectance,
        eta: SpectrumId,
        roughness: Roughness,
    },
    /// (1 - weight) a + weight b. Parts come before the blend in [`Scene::materials`].
    Blend {
        a: MaterialId,
        b: MaterialId,
        weight: Weight,
    },
    Black,
}

/// The fraction of light that a surface reflects, over wavelength.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reflectance {
    /// The same all over.
    Spectrum(SpectrumId),
    /// A texture of [`TextureKind::Colour`] or [`TextureKind::Mixture`].
    Texture(TextureId),
}

/// The share of a blend's second part, or an opacity, in [0, 1].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Weight {
    Constant(f64),
    /// A texture of [`TextureKind::Number`].
    Texture(TextureId),
}

/// Numbers over a surface by its texture coordinates (u, v), scaled and moved as its placement says: u runs right, v up, both
/// repeat. Texel (x, y), counted from the top left, is centred at u = (x + ½) / width, 1 - v = (y + ½) / height; between centres
/// everything is bilinear, of colours the spectra, not their coefficients, unless the placement says otherwise.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    /// The file, for messages.
    pub name: String,
    /// Width and height.
    pub size: [u32; 2],
    pub kind: TextureKind,
    /// \[y\]\[x\]\[channel\], rows from the top. Those of one picture are shared.
    pub texels: Arc<[f32]>,
    pub placement: Placement,
}

/// How a texture lies on a surface: looked up at (u, v) · scale + offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    pub filter: TextureFilter,
    pub scale: DVec2,
    pub offset: DVec2,
}

impl Default for Placement {
    fn default() -> Self {
        Placement { filter: TextureFilter::Bilinear, scale: DVec2::ONE, offset: DVec2::ZERO }
    }
}

/// What a texture is between the centres of its texels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TextureFilter {
    Bilinear,
    /// The texel that a point lies in, all over it.
    Nearest,
}

/// What the channels of a texture are.
#[derive(Debug, Clone, PartialEq)]
pub enum TextureKind {
    /// Linear sRGB in [0, 1]; each texel's spectrum is that of `rgb` ([`crate::spectral::upsample::reflectance`]).
    Colour,
    /// The share of each of these reflectances, which sum to 1 at most, and what is missing is black; or how much there is of each
    /// of these radiances.
    Mixture(Vec<SpectrumId>),
    /// Linear sRGB of at least 0; each texel's radiance is that of [`crate::spectral::skylight::Tint`], times this daylight.
    Light(SpectrumId),
    /// One number: a weight, or kelvins.
    Number,
}

impl Texture {
    /// Numbers in a texel.
    pub fn channels(&self) -> usize {
        match &self.kind {
            TextureKind::Colour | TextureKind::Light(_) => 3,
            TextureKind::Mixture(endmembers) => endmembers.len(),
            TextureKind::Number => 1,
        }
    }
}

/// The α of the GGX distribution, in [0, 1].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Roughness {
    /// Along the tangent ([`Shape`]) and across it, the same for what has one: both below [`SMOOTH`], which is smooth, or neither.
    Constant([f64; 2]),
    /// The same in all directions: a texture of [`TextureKind::Number`], whose numbers are [`SMOOTH`] at least.
    Texture(TextureId),
}

impl Roughness {
    /// The same all over and in all directions.
    pub const fn even(alpha: f64) -> Roughness {
        Roughness::Constant([alpha; 2])
    }

    /// That of a hot surface, which the scene file lets have but one.
    pub fn of_hot_surface(self) -> [f64; 2] {
        match self {
            Roughness::Constant(alpha) => alpha,
            Roughness::Texture(_) => unreachable!("a hot surface has one roughness all over"),
        }
    }
}

/// Roughness below this is none: a mirror, or ideal refraction. Where a texture says it, it is what is least.
pub const SMOOTH: f64 = 1e-3;

/// One shape of one material. An OBJ with several materials becomes several objects.
#[derive(Debug, Clone)]
pub struct Object {
    /// For messages, e.g. `objects.3 (floor.obj, material "white")`.
    pub name: String,
    pub shape: Shape,
    pub attributes: Attributes,
    /// `None`: a null boundary, which only bounds its interior. Paths pass it as if it were not there.
    pub material: Option<MaterialId>,
    pub emission: Option<Emission>,
    /// What fills the inside of a closed shape: behind its geometric normal.
    pub interior: Option<Interior>,
    /// Whose part it is: its geometry then is in the assembly's space.
    pub assembly: Option<AssemblyId>,
}

/// Objects that are placed together, any number of times, and stored once.
#[derive(Debug, Clone, PartialEq)]
pub struct Assembly {
    pub name: String,
    /// From its own space to the world, for each of its instances: at least one, none of them mirrored.
    pub instances: Vec<DAffine3>,
}

/// A medium in its place. Where several interiors overlap, the innermost counts: the one that a path entered last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interior {
    /// Objects that are parts of one closed surface have the same number, all others numbers of their own.
    pub body: usize,
    pub medium: MediumId,
    /// From the world to the unit cube that the medium's grids fill: the object's bounding box in its own space.
    pub to_grid: DAffine3,
}

/// Matter that absorbs, scatters and emits: one or several kinds of it in the same place. Where it has a temperature it emits as
/// much as it absorbs, times Planck's radiance.
#[derive(Debug, Clone, PartialEq)]
pub struct Medium {
    pub name: String,
    pub components: Vec<Component>,
    /// K, not negative.
    pub temperature: Option<Field>,
}

/// A kind of matter. Its absorption coefficient in m⁻¹ is density · Σ strength · table(λ, T), its scattering coefficient
/// density · `scattering.coefficient`.
#[derive(Debug, Clone, PartialEq)]
pub struct Component {
    pub absorbers: Vec<Absorber>,
    pub scattering: Option<Scattering>,
    /// Relative, not negative.
    pub density: Field,
}

/// How a kind of matter scatters light.
#[derive(Debug, Clone, PartialEq)]
pub struct Scattering {
    /// m⁻¹ at density 1.
    pub coefficient: SpectrumId,
    pub phase: Phase,
}

/// Where scattered light goes: the phase function P of the angle θ by which it turns, whose mean over the sphere is 1; what is
/// scattered into a direction is σs P / 4π.
#[derive(Debug, Clone, PartialEq)]
pub enum Phase {
    /// (1 - g²) / (1 + g² - 2 g cosθ)^(3/2) (Henyey and Greenstein 1941), g the mean cosine, in (-1, 1).
    HenyeyGreenstein(SpectrumId),
    /// 3 / (4 (1 + 2γ)) (1 + 3γ + (1 - γ) cos²θ) with γ = ρ / (2 - ρ), ρ the depolarisation factor in \[0, ½\] (Chandrasekhar
    /// 1960, §17); of radiance alone, without its polarisation.
    Rayleigh { depolarisation: f64 },
    /// Of particles, from a table.
    Table(Arc<PhaseTable>),
}

/// A term of a medium's absorption.
#[derive(Debug, Clone, PartialEq)]
pub struct Absorber {
    /// Fraction x pressure of a species; 1 for an absorption that is given as such.
    pub strength: f64,
    /// K, ascending, and the spectrum there, in m⁻¹ at strength 1. Between two, linear in temperature; beyond, the ends
    /// are held. Where there is only one, temperature does not matter.
    pub columns: Vec<(f64, SpectrumId)>,
}

/// A number of a medium, or one for each voxel.
#[derive(Debug, Clone, PartialEq)]
pub enum Field {
    Constant(f64),
    Grid(Arc<Grid>),
}

/// Voxels with a constant value each, x fastest. All grids of one medium have one shape: where its file gives several, they are
/// divided until they have.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Voxels along x, y and z.
    pub size: [u32; 3],
    /// Shared with whoever gave them, where that is memory.
    pub values: Arc<Vec<f32>>,
}

impl Medium {
    /// Voxels along x, y and z, where any quantity has a grid.
    pub fn grid_size(&self) -> Option<[u32; 3]> {
        let densities = self.components.iter().map(|component| &component.density);
        self.temperature.as_ref().into_iter().chain(densities).find_map(|field| match field {
            Field::Constant(_) => None,
            Field::Grid(grid) => Some(grid.size),
        })
    }

    pub fn scatters(&self) -> bool {
        self.components.iter().any(|component| component.scattering.is_some())
    }

    /// All spectra of its absorption.
    pub fn absorption(&self) -> impl Iterator<Item = SpectrumId> {
        let absorbers = self.components.iter().flat_map(|component| &component.absorbers);
        absorbers.flat_map(|absorber| absorber.columns.iter().map(|column| column.1))
    }
}

impl Field {
    /// The value in voxel `i`; without a grid the same everywhere.
    pub fn at(&self, i: usize) -> f64 {
        match self {
            Field::Constant(value) => *value,
            Field::Grid(grid) => f64::from(grid.values[i]),
        }
    }
}

/// What a shape carries beside its geometry, each only where its material asks for it.
///
/// Textures are laid out by (u, v), and anisotropic materials turned by a tangent, of either sign, which is the direction
/// of growing u. On a quad u runs along `edge_u`, v along `edge_v`. On each face of a cube u runs to the right and v up,
/// seen from outside with y up; on top and bottom u runs along x. On an OBJ mesh they are its `vt`. Round shapes have an
/// axis, y: the sphere its own y axis, the disk its normal, the cylinder that from `from` to `to`; and with (x, y, z) in
/// [`Attributes::axes`], u = ½ + atan2(x, z) / 2π, so that u grows counter-clockwise about the axis. v is ½ + asin(y) / π
/// on a unit sphere, 0 at `from` and 1 at `to` on a cylinder, 0 on the rim and 1 in the centre of a disk.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Attributes {
    /// (u, v) at the corners of each triangle of a mesh.
    pub uv: Option<Vec<[DVec2; 3]>>,
    /// Unit shading normals at the corners of each triangle of a mesh, on its front; interpolated between.
    pub normals: Option<Vec<[DVec3; 3]>>,
    /// Columns: where x, y (the axis) and z of a round shape point. Orthonormal, left-handed on what is mirrored.
    pub axes: Option<DMat3>,
}

/// Geometry of the world, or of its assembly, transforms applied.
///
/// Without texture coordinates the tangent of anisotropic materials ([`Attributes`]) is along the first edge (corner 0 to
/// 1) of a triangle, which is that of growing u on quads and cubes.
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

impl Shape {
    /// The least and the greatest coordinates; a mesh without triangles has infinite ones, the least above the greatest.
    pub fn bounds(&self) -> [DVec3; 2] {
        match self {
            Shape::Sphere { center, radius } | Shape::Disk { center, radius, .. } => {
                [*center - *radius, *center + *radius]
            }
            Shape::Cylinder { from, to, radius } => [from.min(*to) - *radius, from.max(*to) + *radius],
            Shape::Mesh(mesh) => {
                let used = || mesh.triangles.iter().flatten().map(|&corner| mesh.positions[corner as usize]);
                [used().fold(DVec3::INFINITY, DVec3::min), used().fold(DVec3::NEG_INFINITY, DVec3::max)]
            }
        }
    }
}

#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    pub positions: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
}

/// Radiance leaving a surface, W m⁻² sr⁻¹ nm⁻¹, the same in all directions.
#[derive(Debug, Clone, PartialEq)]
pub struct Emission {
    /// Where it is textured, what it is on the whole: for choosing lights and wavelengths.
    pub radiance: SpectrumId,
    pub sides: Sides,
    /// A texture of [`TextureKind::Light`] or [`TextureKind::Mixture`], of radiances, in its place.
    pub texture: Option<TextureId>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sides {
    Front,
    Both,
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
