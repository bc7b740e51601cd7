//! What this scene needs on a device, and nothing else: features, spectra, materials, lights and geometry, flat.

use crate::device::accel::{Accel, MAX_MATERIALS};
use crate::device::words::{
    EMITS_BOTH_SIDES, EMITS_BY_ANGLE, EMITS_BY_PLACE, EMITTER_IS_LAMP, Emitter, Frame, LAMP_DIRECTIONAL, LAMP_POINT,
    LAMP_SUN, Lamp, Material, NONE, Primitive,
};
use crate::device::words::LOOP_LIMIT;
use crate::device::emission::Emitted;
use crate::device::parts::heat;
use crate::device::integration::Integration;
use crate::device::parts::lights::{LightPicks, STEPS, light_picks};
use crate::device::parts::media::Media;
use crate::device::parts::radiators::{self, Radiators};
use crate::device::parts::sky::SkyMap;
use crate::device::spectra::{MAX_REGISTER_SPECTRA, daylight, spectral_tables};
use crate::device::parts::surfaces::{Kind, Needed, Surfaces};
use crate::scene::{Attributes, Bsdf, Evaluator, Filter, Light, Projection, Reflectance, Sampler, Scene, Sides};
use crate::spectral::table::SpectralTables;
use crate::spectral::warp::Warp;
use crate::{Error, Result};
use glam::DVec3;
use std::f64::consts::PI;

/// Evaluation walks the records of a path in one loop.
const MAX_RECORDS: u32 = LOOP_LIMIT;
/// Triangles up to which rays test them all. Measured on lavapipe: generating a path of the Cornell box, with 32 of them, takes 0.4 to
/// 0.5 of the time that it takes with the BVH; kernels grow with every one.
const FEW_TRIANGLES: usize = 48;

/// Parts of the renderer that a scene needs; what is false is left out of shaders and buffers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Features {
    pub thin_lens: bool,
    pub orthographic: bool,
    pub gaussian: bool,
    pub independent: bool,
    pub emitters: bool,
    pub environment: bool,
    pub shapes: bool,
    /// Triangles so few that every ray tests them all: no BVH.
    pub few_triangles: bool,
    pub roulette: bool,
    /// Wavelength strata within channels, for spectra that vary within one.
    pub strata: bool,
    /// Exact knots, for spectra that no affordable number of strata resolves.
    pub knots: bool,
    /// All spectra held in registers during evaluation.
    pub registers: bool,
    /// Materials of several lobes, records of 16 bytes; `None` where diffuse surfaces are all there is.
    pub general: Option<General>,
}

/// Parts of the renderer that only general scenes have.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct General {
    /// Bit n for each [`Kind`] n that occurs.
    pub kinds: u32,
    /// A rough coat over a diffuse base.
    pub rough_base: bool,
    /// Roughness that differs along and across the surface.
    pub anisotropic: bool,
    /// Refraction that may leave one channel of a path.
    pub dispersion: bool,
    /// Rough refraction that bends each channel by itself.
    pub spread: bool,
    /// Textures of any kind; which of them, and of what, the rest says.
    pub textures: bool,
    pub textured: bool,
    pub textured_base: bool,
    pub colours: bool,
    pub mixtures: bool,
    /// Blends with a texture for weight.
    pub shares: bool,
    /// Texture coordinates, normals or axes on surfaces.
    pub attributes: bool,
    /// Shading normals.
    pub smooth: bool,
    /// Lights without a surface, and how many of them are suns.
    pub lamps: bool,
    pub suns: u32,
    /// Surfaces that emit by angle.
    pub hot: bool,
    /// And by place.
    pub radiators: Option<radiators::Features>,
    /// Id of the wavelength's spectrum, where evaluation works out Planck's law.
    pub wavelength: Option<u32>,
    pub map: Option<Map>,
    pub media: Option<MediaShape>,
}

/// Media, as shaders are composed for them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MediaShape {
    pub outer: u32,
    /// Whether camera rays start in different ones.
    pub camera_is_cut: bool,
    pub stretches: u32,
    /// The most columns of an absorber, where there are grids.
    pub grids: Option<u32>,
}

/// An environment map, as shaders are composed for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Map {
    pub size: [u32; 2],
    /// Of a spectral one.
    pub bands: Option<u32>,
    /// Ids of the spectra that tell a wavelength's place, and that multiply all texels.
    pub axis: u32,
    pub source: u32,
}

impl General {
    fn of(surfaces: &Surfaces, scene: &Scene) -> General {
        let textures = surfaces.textures.as_ref();
        let carries = |f: &dyn Fn(&Attributes) -> bool| scene.objects.iter().any(|object| f(&object.attributes));
        General {
            textures: textures.is_some(),
            textured: surfaces.textured,
            textured_base: surfaces.textured_base,
            colours: textures.is_some_and(|t| t.colours),
            mixtures: textures.is_some_and(|t| t.mixtures),
            shares: textures.is_some_and(|t| t.first_share.is_some()),
            attributes: carries(&|attributes| *attributes != Attributes::default()),
            smooth: carries(&|attributes| attributes.normals.is_some()),
            kinds: surfaces.kinds,
            rough_base: surfaces.rough_base,
            anisotropic: surfaces.anisotropic,
            dispersion: surfaces.dispersion,
            spread: surfaces.spread,
            ..General::default()
        }
    }

    pub(super) fn has(&self, kinds: &[Kind]) -> bool {
        kinds.iter().any(|&kind| self.kinds >> kind as u32 & 1 == 1)
    }
}

/// A scene as every device gets it.
pub struct Prepared {
    /// Never [`Evaluator::Auto`].
    pub evaluator: Evaluator,
    pub features: Features,
    pub frame: Frame,
    pub materials: Vec<Material>,
    /// In general scenes, instead of `materials`.
    pub surfaces: Option<Surfaces>,
    pub media: Option<Media>,
    /// Emitting primitives, then lamps.
    pub emitters: Vec<Emitter>,
    pub lamps: Vec<Lamp>,
    /// What emits by place.
    pub radiators: Option<Radiators>,
    /// The environment, where it is a map.
    pub sky: Option<SkyMap>,
    pub picks: LightPicks,
    pub accel: Accel,
    pub tables: SpectralTables,
    /// Names of the spectra in the tables, in the order of `tables.bounds`.
    pub spectrum_names: Vec<String>,
    /// Spectra that multiply throughput, and spectra that emit; the constant 1 apart.
    pub factors: usize,
    pub sources: usize,
    /// That the device renders: with responses these are not the scene's.
    pub channels: usize,
    /// How the scene's channels are made of those; `None` where they are the same.
    pub integration: Option<Integration>,
    /// Where in the channels wavelengths are drawn.
    pub warp: Warp,
    /// The device id of the spectrum with which a path's throughput begins, where it is not 1: weights of responses and of
    /// wavelengths.
    pub path_weight: Option<u32>,
}

impl Prepared {
    /// Flattens `scene`. Errors: materials that no shader knows; more materials, spectra or bounces than ids and
    /// counters have bits for.
    pub fn new(scene: &Scene, seed: u64) -> Result<Prepared> {
        Prepared::for_evaluator(scene, seed, scene.integrator.evaluator.on(true, scene.channels.len()))
    }

    /// As [`Prepared::new`], for the evaluator chosen ([`plan::evaluator`](super::plan::evaluator)).
    pub fn for_evaluator(scene: &Scene, seed: u64, evaluator: Evaluator) -> Result<Prepared> {
        match Integration::of(&scene.channels) {
            None => Prepared::flatten(scene, seed, evaluator, None),
            Some(integration) => {
                let inner = Scene { channels: integration.inner.clone(), ..scene.clone() };
                Prepared::flatten(&inner, seed, evaluator, Some(integration))
            }
        }
    }

    /// `scene` in the channels that the device renders.
    fn flatten(scene: &Scene, seed: u64, evaluator: Evaluator, integration: Option<Integration>) -> Result<Prepared> {
        let heat = heat::as_emission(scene);
        let scene = &*heat.scene;
        let accel = Accel::build(scene);
        if scene.materials.len() > MAX_MATERIALS {
            return Err(Error::input(&scene.file, format!("more than {MAX_MATERIALS} materials")));
        }
        let sky = scene.environment.as_ref().and_then(|e| e.map()).map(|map| SkyMap::new(scene, map));
        let carries = scene.objects.iter().any(|object| object.attributes != Attributes::default());
        let general = scene.materials.iter().any(|m| !matches!(m.bsdf, Bsdf::Diffuse { .. } | Bsdf::Black))
            || carries
            || !scene.textures.is_empty()
            || !scene.lights.is_empty()
            || sky.is_some()
            || !scene.media.is_empty()
            || !heat.by_angle.is_empty()
            || !heat.radiating.is_empty();
        let mut media = Media::new(scene, &accel)?;
        let mut surfaces = general.then(|| Surfaces::new(scene));
        let mut radiators = match &mut surfaces {
            Some(surfaces) if !heat.radiating.is_empty() => Some(Radiators::new(scene, &heat.radiating, surfaces)?),
            _ => None,
        };
        let axis = surfaces.as_mut().zip(sky.as_ref()).map(|(surfaces, sky)| {
            surfaces.spectra.push(Needed::Exact("places in the environment map".into(), sky.axis.clone()));
            surfaces.spectra.len() - 1
        });
        // General scenes meet a uniform environment by sampling the BSDF, and do not aim at it.
        let uniform = scene.environment.as_ref().and_then(|e| e.uniform());
        let uniform = uniform.map(|radiance| scene.spectra[radiance].curve.scaled(4.0 * PI));
        let aimed_at = uniform.as_ref().filter(|_| !general).or(sky.as_ref().map(|sky| &sky.flux));
        let picks = light_picks(scene, &accel, aimed_at);
        let media_spectra = surfaces.as_ref().map_or(0, |s| s.spectra.len());
        if let (Some(surfaces), Some(media)) = (&mut surfaces, &mut media) {
            surfaces.spectra.append(&mut media.spectra);
        }
        let weights = integration.as_ref().map(|integration| integration.weights.as_slice());
        let environment = uniform.as_ref().or(sky.as_ref().map(|sky| &sky.flux));
        let emitted = || Emitted::of(scene, &accel, &picks.lamps, environment).shares(scene, &accel);
        let needed = surfaces.as_ref().map_or(&[][..], |s| &s.spectra);
        // A pixel's paths share them; who takes a path at a time would fill them for each.
        let in_registers = !general && integration.is_none() && evaluator == Evaluator::DpeptPixel;
        let (tables, ids, warp) = spectral_tables(scene, &heat, needed, in_registers, weights, emitted)?;
        if let Some(surfaces) = &mut surfaces {
            surfaces.name_spectra(|position| tables.ids[ids.needed[position]]);
        }
        if let Some(radiators) = &mut radiators {
            radiators.name_spectra(|position| tables.ids[ids.needed[position]]);
        }
        if let Some(media) = &mut media {
            media.name_spectra(|position| tables.ids[ids.needed[media_spectra + position]]);
        }
        let media_shape = media.as_ref().map(|m| MediaShape {
            outer: m.outer,
            camera_is_cut: m.camera_is_cut,
            stretches: m.stretches,
            grids: m.wavelength.map(|_| m.most_columns),
        });
        let of_grids = media.as_ref().and_then(|m| m.wavelength).map(|w| tables.ids[ids.needed[media_spectra + w]]);
        let wavelength = of_grids.or(radiators.as_ref().map(|r| r.wavelength));

        let factor = |s: usize| tables.ids[ids.factors[&s]];
        let source = |s: usize| tables.ids[ids.sources[&s]];
        let materials = match surfaces {
            None => scene.materials.iter().map(|m| material(scene, m, factor)).collect(),
            Some(_) => Vec::new(),
        };
        let map = sky.as_ref().zip(axis).map(|(sky, axis)| Map {
            size: sky.size,
            bands: sky.bands,
            axis: tables.ids[ids.needed[axis]],
            source: scene.environment.as_ref().and_then(daylight).map_or(0, source),
        });
        let (lamps, lamp_emitters) = lamps(scene, &accel, &picks, source);
        // Behind all that can be chosen: the spectra of what emits by angle.
        let first_row = accel.emitters.len() + lamp_emitters.len();
        let rows = heat.by_angle.iter().flatten().flatten();
        let rows = rows.map(|&spectrum| Emitter { primitive: source(spectrum), ..Emitter::default() });
        let emitters = accel
            .emitters
            .iter()
            .zip(&picks.emitters)
            .map(|(&(primitive, object, area), &pick)| {
                let emission = scene.objects[object].emission.as_ref().expect("emitters come from emitting objects");
                let sides = if emission.sides == Sides::Both { EMITS_BOTH_SIDES } else { 0 };
                let spectrum = match (heat.kinds[object], &radiators) {
                    (heat::Kind::ByAngle(group), _) => (first_row + 2 * group * heat::COSINES) as u32 | EMITS_BY_ANGLE,
                    (heat::Kind::ByPlace(place), Some(radiators)) => radiators.words[place] | EMITS_BY_PLACE,
                    _ => source(emission.radiance),
                };
                Emitter { primitive, spectrum: spectrum | sides, pick: pick as f32, area: area as f32 }
            })
            .chain(lamp_emitters)
            .chain(rows)
            .collect();
        let environment_spectrum = scene.environment.as_ref().and_then(|e| e.uniform()).map_or(0, source);
        let mut features = features(scene, &accel, &tables, ids.factors.len() + ids.sources.len());
        let suns = scene.lights.iter().filter(|light| matches!(light, Light::Sun { .. })).count() as u32;
        let of = |surfaces: &Surfaces| General {
            hot: !heat.by_angle.is_empty(),
            radiators: radiators.as_ref().map(|r| r.features),
            wavelength,
            lamps: !lamps.is_empty(),
            suns,
            map,
            media: media_shape,
            ..General::of(surfaces, scene)
        };
        features.general = surfaces.as_ref().map(of);
        features.registers &= in_registers;
        let frame = frame(scene, seed, &accel, &picks, environment_spectrum, tables.stratum_bits);
        let max_records = max_records(vertices_at_once(evaluator, &frame), features, surfaces.as_ref(), media.as_ref());
        if max_records >= MAX_RECORDS {
            let message = format!(
                "a path of {} bounces may take {max_records} records in this scene, at most {MAX_RECORDS} are supported: \
                 lower integrator.max_bounces",
                frame.max_bounces
            );
            return Err(Error::input(&scene.file, message));
        }
        let prepared = Prepared {
            evaluator,
            features,
            frame: Frame { max_records, ..frame },
            materials,
            surfaces,
            media,
            emitters,
            lamps,
            radiators,
            sky,
            picks,
            spectrum_names: ids.names,
            factors: ids.factors.len(),
            sources: ids.sources.len(),
            channels: scene.channels.len(),
            path_weight: ids.path_weight.map(|position| tables.ids[position]),
            integration,
            warp,
            accel,
            tables,
        };
        if prepared.path_iterations() > LOOP_LIMIT {
            let message = format!(
                "a path of {} bounces may go through {} voxels on each of its ways, more than one evaluation can: lower \
                 integrator.max_bounces or use coarser grids",
                prepared.frame.max_bounces,
                prepared.media.as_ref().map_or(0, |media| media.cells)
            );
            return Err(Error::input(&scene.file, message));
        }
        Ok(prepared)
    }

    /// Iterations that evaluation may take for one path: its records, and the voxels on its ways with the absorbers in each.
    pub fn path_iterations(&self) -> u32 {
        let cells = self.media.as_ref().map_or(0, |media| media.cells.saturating_mul(1 + media.most_absorbers));
        let ways = vertices_at_once(self.evaluator, &self.frame).saturating_mul(2) + 1;
        (self.frame.max_records + 1).saturating_add(ways.saturating_mul(cells))
    }

    /// Most records of a path that are kept at once: at each vertex what it emits and what next-event estimation found.
    pub fn max_records(&self) -> u32 {
        self.frame.max_records
    }

    /// Bytes of the state that all channels of a path have between two bounces: none where they are evaluated at its end.
    pub fn spectral_state_bytes(&self) -> u32 {
        if self.evaluator == Evaluator::Pt { 16 * self.tables.channels_padded as u32 } else { 0 }
    }

    /// Bytes of a record.
    pub fn record_bytes(&self) -> u32 {
        if self.features.general.is_some() { 16 } else { 8 }
    }

    /// Bytes of a path's state between two bounces.
    pub fn state_bytes(&self) -> u32 {
        if self.features.general.is_some_and(|g| g.dispersion || g.media.is_some()) { 48 } else { 32 }
    }
}

/// The scene's lights as the device has them, and their places among the emitters.
fn lamps(scene: &Scene, accel: &Accel, picks: &LightPicks, source: impl Fn(usize) -> u32) -> (Vec<Lamp>, Vec<Emitter>) {
    let lamp = |(index, (&light, &pick)): (usize, (&usize, &f64))| {
        let light = &scene.lights[light];
        let place = |towards: DVec3| towards.as_vec3().to_array();
        let (lamp, factor) = match *light {
            Light::Point { position, .. } => {
                let lamp = Lamp { place: accel.space.point(position), kind: LAMP_POINT, ..Lamp::default() };
                (lamp, accel.space.scale.powi(2))
            }
            Light::Directional { direction, .. } => {
                (Lamp { place: place(-direction), kind: LAMP_DIRECTIONAL, ..Lamp::default() }, 1.0)
            }
            Light::Sun { direction, angular_radius, .. } => {
                let (sine, half) = (angular_radius.sin(), (0.5 * angular_radius).sin());
                let (sine2, versine) = ((sine * sine) as f32, (2.0 * half * half) as f32);
                // The irradiance facing a disk of unit radiance is π sin².
                let factor = 1.0 / (PI * sine * sine);
                (Lamp { place: place(-direction), kind: LAMP_SUN, sine2, versine, ..Lamp::default() }, factor)
            }
        };
        let spectrum = source(light.spectrum()) | EMITTER_IS_LAMP;
        (lamp, Emitter { primitive: index as u32, spectrum, pick: pick as f32, area: factor as f32 })
    };
    picks.lamps.iter().zip(&picks.emitters[accel.emitters.len()..]).enumerate().map(lamp).unzip()
}

fn material(scene: &Scene, m: &crate::scene::Material, factor: impl Fn(usize) -> u32) -> Material {
    let (factor, albedo) = match m.bsdf {
        Bsdf::Diffuse { reflectance: Reflectance::Spectrum(reflectance) } => {
            let curve = &scene.spectra[reflectance].curve;
            let albedo = scene.channels.bounds.iter().map(|b| curve.max(b[0], b[1])).fold(0.0, f64::max);
            // What reflects in no channel is black.
            (if albedo > 0.0 { factor(reflectance) } else { NONE }, albedo)
        }
        _ => (NONE, 0.0),
    };
    let survival = (albedo * STEPS).ceil() / STEPS;
    Material { factor, two_sided: u32::from(m.two_sided), albedo: survival as f32, unused: 0 }
}

fn features(scene: &Scene, accel: &Accel, tables: &SpectralTables, spectra: usize) -> Features {
    Features {
        thin_lens: matches!(scene.camera.projection, Projection::ThinLens { .. }),
        orthographic: matches!(scene.camera.projection, Projection::Orthographic { .. }),
        gaussian: scene.film.filter == Filter::Gaussian,
        independent: scene.integrator.sampler == Sampler::Independent,
        emitters: !accel.emitters.is_empty(),
        environment: scene.environment.as_ref().is_some_and(|e| e.uniform().is_some()),
        shapes: accel.has_shapes,
        few_triangles: !accel.has_shapes && scene.media.is_empty() && are_few(&accel.primitives),
        roulette: scene.integrator.russian_roulette_start > 0,
        strata: tables.stratum_bits > 0,
        knots: tables.has_knots(),
        registers: !tables.has_knots() && spectra <= MAX_REGISTER_SPECTRA,
        general: None,
    }
}

/// Whether these triangles may be constants of a shader, whose text has no subnormal numbers.
fn are_few(triangles: &[Primitive]) -> bool {
    let plain = |v: &f32| *v == 0.0 || v.is_normal();
    (1..=FEW_TRIANGLES).contains(&triangles.len())
        && triangles.iter().all(|p| [p.a, p.b, p.c].as_flattened().iter().all(plain))
}

/// Scattering events that are saved before they are evaluated: a path's, or one.
fn vertices_at_once(evaluator: Evaluator, frame: &Frame) -> u32 {
    if evaluator == Evaluator::Pt { 1 } else { frame.max_bounces }
}

/// Most records of `bounces` scattering events of a path and of what it meets after them: at every one what materials take, and
/// emission where a surface or the sky emits.
fn max_records(bounces: u32, features: Features, surfaces: Option<&Surfaces>, media: Option<&Media>) -> u32 {
    let general = features.general.unwrap_or_default();
    // Where a path leaves the scene: the environment, and suns that may cover one another.
    let hot = general.radiators.map_or(0, |radiators| radiators.records);
    let emission = if features.emitters { (bounces + 1).saturating_mul(hot.max(1)) } else { 1 } + general.suns;
    // A direction in a map is an instruction of its own, and parts a diffuse vertex in two.
    let aimed = if general.map.is_some() { 2 } else { 0 };
    // The way to each vertex, and from each to a light; a vertex that aims through a medium has no record for both.
    let way = media.map_or(0, Media::way_records);
    let through = if media.is_some() { way + 2 } else { 0 };
    // What is aimed at may be hot: its records, put aside and back, and a diffuse vertex in two.
    let aimed = aimed + if hot > 0 { hot + 3 } else { 0 };
    let vertex = surfaces.map_or(1, |s| s.vertex_records) + aimed + way + through;
    (emission + way).saturating_add(bounces.saturating_mul(vertex))
}

fn frame(
    scene: &Scene,
    seed: u64,
    accel: &Accel,
    picks: &LightPicks,
    environment_spectrum: u32,
    stratum_bits: u32,
) -> Frame {
    let (camera, space) = (&scene.camera, &accel.space);
    let (half_size, aperture_radius, focus_distance) = match camera.projection {
        Projection::Perspective { tan_half } => (tan_half, 0.0, 1.0),
        Projection::ThinLens { tan_half, aperture_radius, focus_distance } => {
            (tan_half, space.length(aperture_radius), space.length(focus_distance))
        }
        Projection::Orthographic { half_size } => (half_size * space.scale, 0.0, 1.0),
    };
    let bounces = scene.integrator.max_bounces;
    Frame {
        camera_position: space.point(camera.position),
        seed_low: seed as u32,
        camera_forward: camera.forward.as_vec3().to_array(),
        seed_high: (seed >> 32) as u32,
        camera_right: camera.right.as_vec3().to_array(),
        aperture_radius,
        camera_up: camera.up.as_vec3().to_array(),
        focus_distance,
        half_size: half_size.as_vec2().to_array(),
        film_size: [scene.film.width as f32, scene.film.height as f32],
        max_bounces: bounces,
        roulette_start: scene.integrator.russian_roulette_start,
        emitter_count: (accel.emitters.len() + picks.lamps.len()) as u32,
        environment_pick: picks.environment as f32,
        environment_spectrum,
        max_records: 0,
        stratum_bits,
        unused: 0,
    }
}
