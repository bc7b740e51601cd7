//! What this scene needs on a device, and nothing else: features, spectra, materials, lights and geometry, flat.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use crate::device::accel::{Accel, Emitting, MAX_MATERIALS};
use crate::device::emission::Emitted;
use crate::device::evaluator;
use crate::device::integration::Integration;
use crate::device::part::{OnDevice, Records};
use crate::device::parts::geometry;
use crate::device::parts::heat::{self, Heat};
use crate::device::parts::lights::{self, LightPicks, STEPS, light_picks};
use crate::device::parts::media::Media;
use crate::device::parts::paths::Thinning;
use crate::device::parts::radiators::Radiators;
use crate::device::parts::scattering::{Coefficients, Scattering};
use crate::device::parts::sky::SkyMap;
use crate::device::parts::surfaces::{Collected, Needed, Surfaces};
use crate::device::parts::techniques::{Asking, Techniques};
use crate::device::separable::{self, Separable, Separated};
use crate::device::spectra::{MAX_REGISTER_SPECTRA, SpectrumIds, daylight, spectral_tables};
use crate::device::windows::Windows;
use crate::device::words::{
    EMITS_BOTH_SIDES, EMITS_BY_ANGLE, EMITS_BY_PLACE, EMITTER_IS_LAMP, Emitter, Frame, HOT_COSINES, LAMP_DIRECTIONAL,
    LAMP_POINT, LAMP_SPOT, LAMP_SUN, LOOP_LIMIT, Lamp, Material, NONE,
};
use crate::scene::{
    Attributes, Bsdf, Distortion, Evaluator, Filter, Light, Line, Projection, Reflectance, Sampler, Scene, Sides,
};
use crate::spectral::Channels;
use crate::spectral::table::SpectralTables;
use crate::spectral::warp::Warp;
use crate::{Error, Result};

/// Evaluation walks the records of a path in one loop.
const MAX_RECORDS: u32 = LOOP_LIMIT;
/// Words of a path's state that every scene has: origin and density; direction, counts of records.
const STATE_WORDS: u32 = 8;
/// With which a surface is gone on from whose spectrum may be exchanged after the render.
pub const LEAST_ALBEDO: f64 = 0.5;
/// Iterations that one bounce may take beside the voxels on its ways.
const MOST_STEPS: u32 = 8_192;

/// Settings, and how geometry, lights and spectra are held: what is false is left out of kernels and buffers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Features {
    pub thin_lens: bool,
    pub orthographic: bool,
    pub latlong: bool,
    pub pushbroom: bool,
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
}

/// A scene as every device gets it.
pub struct Prepared {
    /// Never [`Evaluator::Auto`].
    pub evaluator: Evaluator,
    pub features: Features,
    pub frame: Frame,
    /// Of plain scenes, where diffuse surfaces and lamps are all there is.
    pub materials: Vec<Material>,
    /// Of general scenes, instead: their records have 16 bytes.
    pub surfaces: Option<Surfaces>,
    pub media: Option<Media>,
    /// What media that scatter need.
    pub scattering: Option<Scattering>,
    /// By which paths decide.
    pub techniques: Techniques,
    /// Emitting primitives, then lamps, then the spectra of what emits by angle.
    pub emitters: Vec<Emitter>,
    pub lamps: Vec<Lamp>,
    /// The last so many of the lamps, which are met too.
    pub suns: u32,
    /// Whether some surface emits by angle.
    pub emits_by_angle: bool,
    /// What emits by place.
    pub radiators: Option<Radiators>,
    /// The environment, where it is a map.
    pub sky: Option<SkyMap>,
    /// Id of the wavelength's spectrum, where evaluation works out Planck's law.
    pub wavelength: Option<u32>,
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
    /// At how many wavelengths of each channel a path is evaluated.
    pub wavelengths_per_channel: u32,
    /// Which paths are evaluated, where it is not all of them: what a few samples of the scene decide.
    pub thinning: Option<Thinning>,
    /// Where in the channels wavelengths are drawn.
    pub warp: Warp,
    /// The device id of the spectrum with which a path's throughput begins, where it is not 1: weights of responses and of
    /// wavelengths.
    pub path_weight: Option<u32>,
    /// Of a line scanner, for each line: where it is, and forward, right and nose.
    pub lines: Vec<[[f32; 4]; 4]>,
    /// Of the camera's lens: k1, k2, k3, p1, p2.
    pub distortion: Option<[f32; 5]>,
    /// Whether the host asks what single rays meet.
    pub first_hits: bool,
    /// What records say of products of spectra, where those are kept instead of channels.
    pub separable: Option<Separable>,
    /// What of its heat does not separate into those, in words: of the remainder.
    of_heat: Vec<String>,
}

impl Prepared {
    /// Flattens `scene`. Errors: materials that no shader knows; more materials, spectra or bounces than ids and
    /// counters have bits for.
    pub fn new(scene: &Scene, seed: u64) -> Result<Prepared> {
        Prepared::for_evaluator(scene, seed, evaluator::resolve(scene, true))
    }

    /// As [`Prepared::new`], for the evaluator chosen.
    pub fn for_evaluator(scene: &Scene, seed: u64, evaluator: Evaluator) -> Result<Prepared> {
        // Weights have no channels.
        let has_channels = || evaluator != Evaluator::Factored || !separable::remainder(scene).is_empty();
        match Integration::of(&scene.channels).filter(|_| has_channels()) {
            None => Prepared::flatten(scene, seed, evaluator, &scene.channels, None),
            Some(integration) => {
                let inner = Scene { channels: integration.inner.clone(), ..scene.clone() };
                Prepared::flatten(&inner, seed, evaluator, &scene.channels, Some(integration))
            }
        }
    }

    /// `scene` in the channels that the device renders, for a cube of channels `wanted`.
    fn flatten(
        scene: &Scene,
        seed: u64,
        evaluator: Evaluator,
        wanted: &Channels,
        integration: Option<Integration>,
    ) -> Result<Prepared> {
        let heat = heat::as_emission(scene);
        let scene = &*heat.scene;
        let mut accel = Accel::build(scene);
        if scene.materials.len() > MAX_MATERIALS {
            return Err(Error::input(&scene.file, format!("more than {MAX_MATERIALS} materials")));
        }
        let General { mut surfaces, mut media, scattering, techniques, mut radiators, mut sky } =
            General::of(scene, &heat, &accel)?;
        let is_general = surfaces.is_some();

        // General scenes meet a uniform environment by sampling the BSDF, and do not aim at it.
        let uniform = scene.environment.as_ref().and_then(|e| e.uniform());
        let flux = uniform.map(|radiance| scene.spectra[radiance].curve.scaled(4.0 * PI));
        let aimed_at = flux.as_ref().filter(|_| !is_general).or(sky.as_ref().map(|sky| &sky.flux));
        let picks = light_picks(scene, &accel, aimed_at);

        // A pixel's paths share the registers; who takes a path at a time would fill them for each.
        let in_registers = !is_general && integration.is_none() && evaluator == Evaluator::DpeptPixel;
        let weights = integration.as_ref().map(|integration| integration.weights.as_slice());
        let environment = flux.as_ref().or(sky.as_ref().map(|sky| &sky.flux));
        let emitted = || Emitted::of(scene, &accel, &picks.lamps, environment).shares(scene, &accel);
        let needed = surfaces.as_ref().map_or(&[][..], |s| &s.spectra);
        // A factored scene may be evaluated otherwise too, in order to know how bright it is.
        let separated = (evaluator == Evaluator::Factored).then(|| Separated::new(scene, &heat, wanted)).transpose()?;
        let values = separated.as_ref().is_none_or(|separated| !separated.remainder.is_empty());
        let (tables, ids, warp) = spectral_tables(scene, &heat, needed, in_registers, values, weights, emitted)?;
        let separable = separated.map(|separated| separated.by_id(&ids, needed, radiators.as_ref(), &tables));
        if let (Some(separable), Some(sky)) = (&separable, &mut sky) {
            sky.append_left(separable);
        }
        let factor = |s: usize| tables.ids[ids.factors[&s]];
        let source = |s: usize| tables.ids[ids.sources[&s]];
        let id = |position: usize| tables.ids[ids.needed[position]];
        surfaces.iter_mut().for_each(|surfaces| surfaces.name_spectra(id));
        radiators.iter_mut().for_each(|radiators| radiators.name_spectra(id));
        media.iter_mut().for_each(|media| media.name_spectra(id));
        if let Some(sky) = &mut sky {
            sky.axis_id = id(sky.axis_id as usize);
            sky.source_id = scene.environment.as_ref().and_then(daylight).map_or(0, source);
        }

        let materials = match surfaces {
            None => scene.materials.iter().map(|m| material(scene, m, factor)).collect(),
            Some(_) => Vec::new(),
        };
        let (lamps, of_lamps) = lamps(scene, &accel, &picks, source);
        let emitters = emitters(scene, &mut accel, &picks, &heat, radiators.as_ref(), of_lamps, source);
        let features =
            Features { registers: in_registers && fit_registers(&tables, &ids), ..features(scene, &accel, &tables) };
        let suns = scene.lights.iter().filter(|light| matches!(light, Light::Sun { .. })).count() as u32;
        let frame = frame(scene, seed, &accel, &picks, uniform.map_or(0, source), tables.stratum_bits);
        let mut prepared = Prepared {
            evaluator,
            features,
            frame,
            materials,
            wavelength: media.as_ref().and_then(|m| m.wavelength).or(radiators.as_ref().map(|r| r.wavelength)),
            surfaces,
            media,
            scattering,
            techniques,
            emitters,
            lamps,
            suns,
            emits_by_angle: !heat.by_angle.is_empty(),
            radiators,
            sky,
            picks,
            spectrum_names: ids.names,
            factors: ids.factors.len(),
            sources: ids.sources.len(),
            channels: scene.channels.len(),
            wavelengths_per_channel: scene.integrator.wavelengths_per_channel.unwrap_or(1),
            path_weight: ids.path_weight.map(|position| tables.ids[position]),
            integration,
            separable,
            of_heat: separable::of_heat(&heat),
            thinning: None,
            lines: lines(scene, &accel),
            distortion: scene.camera.distortion.map(|Distortion { radial: [k1, k2, k3], tangential: [p1, p2] }| {
                [k1, k2, k3, p1, p2].map(|number| number as f32)
            }),
            first_hits: scene.first_hits,
            warp,
            accel,
            tables,
        };
        prepared.plan_records(scene)?;
        Ok(prepared)
    }

    /// Sets the most records of a path. Errors: more of them, or of the voxels on its ways, than one evaluation can walk through.
    fn plan_records(&mut self, scene: &Scene) -> Result<()> {
        let bounces = self.frame.max_bounces;
        let records: Records = self.whole().parts().map(|part| (part.records)(&self.whole())).sum();
        let most = records.of(self.vertices_at_once());
        if most >= MAX_RECORDS {
            let message = format!(
                "a path of {bounces} bounces may take {most} records in this scene, at most {MAX_RECORDS} are supported: \
                 lower integrator.max_bounces"
            );
            return Err(Error::input(&scene.file, message));
        }
        self.frame.max_records = most;
        // The way to what is met, that to a light, and the flight; what else a ray does takes some thousand.
        let walked = self.media.as_ref().map_or(0, |media| media.cells.saturating_mul(3));
        if walked > LOOP_LIMIT - MOST_STEPS {
            let message = format!(
                "a straight way may go through {} voxels, at most {} are supported: use coarser grids",
                walked / 3,
                (LOOP_LIMIT - MOST_STEPS) / 3
            );
            return Err(Error::input(&scene.file, message));
        }
        if self.path_iterations() > LOOP_LIMIT {
            let message = format!(
                "a path of {bounces} bounces may go through {} voxels that emit on each of its ways, more than one evaluation can: lower \
                 integrator.max_bounces or integrator.wavelengths_per_channel, or use coarser grids",
                self.media.as_ref().map_or(0, |media| media.marched)
            );
            return Err(Error::input(&scene.file, message));
        }
        Ok(())
    }

    /// Whether what does not separate is evaluated in channels, beside weights.
    pub fn has_remainder(&self) -> bool {
        self.separable.as_ref().is_some_and(|separable| separable.has_remainder)
    }

    /// What of `scene`, which this is made of, does not separate into products of spectra, in words.
    pub fn obstacles(&self, scene: &Scene) -> Vec<String> {
        separable::obstacles(scene, self.of_heat.clone())
    }

    /// On a device that binds each array as a whole.
    fn whole(&self) -> OnDevice<'_> {
        OnDevice { prepared: self, windows: Windows::WHOLE }
    }

    /// Whether there is more than diffuse surfaces and lamps.
    pub fn is_general(&self) -> bool {
        self.surfaces.is_some()
    }

    /// Whether refraction leaves some paths to one channel each.
    pub fn disperses(&self) -> bool {
        self.surfaces.as_ref().is_some_and(|surfaces| surfaces.dispersion)
    }

    /// Scattering events that are saved before they are evaluated: a path's, or one.
    fn vertices_at_once(&self) -> u32 {
        if self.evaluator == Evaluator::Pt { 1 } else { self.frame.max_bounces }
    }

    /// Iterations that evaluation may take for one path, at each of its wavelengths: its records, and the voxels on its ways from vertex
    /// to vertex.
    pub fn path_iterations(&self) -> u32 {
        let way = self.media.as_ref().map_or(0, Media::way_iterations);
        let walk = (self.frame.max_records + 1).saturating_add((self.vertices_at_once() + 1).saturating_mul(way));
        walk.saturating_mul(self.wavelengths_per_channel)
    }

    /// Most records of a path that are kept at once: at each vertex what it emits and what next-event estimation found.
    pub fn max_records(&self) -> u32 {
        self.frame.max_records
    }

    /// Bytes of the state that all channels of a path have between two bounces: none where they are evaluated at its end.
    pub fn spectral_state_bytes(&self) -> u32 {
        let each = 16 * self.tables.channels_padded as u32;
        if self.evaluator == Evaluator::Pt { each * self.wavelengths_per_channel } else { 0 }
    }

    /// Bytes of a record.
    pub fn record_bytes(&self) -> u32 {
        if self.is_general() { 16 } else { 8 }
    }

    /// Bytes of a path's state between two bounces: whole vectors of four words.
    pub fn state_bytes(&self) -> u32 {
        let words: u32 = self.whole().parts().map(|part| (part.state_words)(&self.whole())).sum();
        4 * (STATE_WORDS + words).next_multiple_of(4)
    }
}

/// What makes a scene general. Spectrum ids are positions in `surfaces.spectra` until the tables have given them.
#[derive(Default)]
struct General {
    surfaces: Option<Surfaces>,
    media: Option<Media>,
    scattering: Option<Scattering>,
    techniques: Techniques,
    radiators: Option<Radiators>,
    sky: Option<SkyMap>,
}

impl General {
    /// Nothing where diffuse surfaces and lamps are all there is.
    fn of(scene: &Scene, heat: &Heat, accel: &Accel) -> Result<General> {
        let sky = scene.environment.as_ref().and_then(|e| e.map()).map(|map| SkyMap::new(scene, map));
        let is_general = scene.materials.iter().any(|m| !matches!(m.bsdf, Bsdf::Diffuse { .. } | Bsdf::Black))
            || scene.objects.iter().any(|object| object.attributes != Attributes::default())
            || !scene.textures.is_empty()
            || !scene.lights.is_empty()
            || sky.is_some()
            || !scene.media.is_empty()
            || scene.materials.iter().any(|material| material.opacity.is_some())
            || !accel.luminous.is_empty()
            || !heat.by_angle.is_empty()
            || !heat.radiating.is_empty();
        if !is_general {
            return Ok(General::default());
        }
        let mut media = Media::new(scene, accel)?;
        let mut asking = Asking::new(scene);
        let coefficients = media.as_ref().and_then(|media| Coefficients::of(scene, media, &mut asking));
        let collected = Collected::new(scene, &mut asking);
        let techniques = Techniques::new(asking);
        let both = media.as_mut().zip(coefficients.as_ref());
        let scattering = both.map(|(media, coefficients)| Scattering::new(scene, media, coefficients, &techniques));
        let mut surfaces = collected.finish(scene, &techniques);
        let radiators = match heat.radiating.is_empty() {
            true => None,
            false => Some(Radiators::new(scene, &heat.radiating, &mut surfaces)?),
        };
        let sky = sky.map(|sky| {
            let axis = Needed::Exact("places in the environment map".into(), sky.axis.clone());
            SkyMap { axis_id: surfaces.need(axis), ..sky }
        });
        if let Some(media) = &mut media {
            media.finish();
            media.move_spectra(&mut surfaces.spectra);
        }
        Ok(General { surfaces: Some(surfaces), media, scattering, techniques, radiators, sky })
    }
}

/// Emitting primitives of the world, instances that emit, lamps; then, behind all that can be chosen, the spectra of what emits by
/// angle, and the emitters of each assembly with their number before them, which its primitives are told of.
fn emitters(
    scene: &Scene,
    accel: &mut Accel,
    picks: &LightPicks,
    heat: &Heat,
    radiators: Option<&Radiators>,
    lamps: Vec<Emitter>,
    source: impl Fn(usize) -> u32,
) -> Vec<Emitter> {
    let first_row = picks.cdf.len();
    let rows = heat.by_angle.iter().flatten().flatten();
    let rows = rows.map(|&spectrum| Emitter { primitive: source(spectrum), ..Emitter::default() });
    let emitter = |&(primitive, object, area): &Emitting, pick: f64, pick_end: f32| {
        let emission = scene.objects[object].emission.as_ref().expect("emitters come from emitting objects");
        let sides = if emission.sides == Sides::Both { EMITS_BOTH_SIDES } else { 0 };
        let spectrum = match (heat.kinds[object], radiators) {
            (heat::Kind::ByAngle(group), _) => (first_row as u32 + 2 * group as u32 * HOT_COSINES) | EMITS_BY_ANGLE,
            (heat::Kind::ByPlace(place), Some(radiators)) => radiators.words[place] | EMITS_BY_PLACE,
            _ => source(emission.radiance),
        };
        Emitter { primitive, spectrum: spectrum | sides, pick: pick as f32, area: area as f32, pick_end }
    };
    let mut intervals = picks.emitters.iter().zip(&picks.cdf);
    let mut all: Vec<Emitter> =
        accel.emitters.iter().zip(intervals.by_ref()).map(|(of, (&pick, &end))| emitter(of, pick, end)).collect();
    // Where the table of the assembly begins is known when all else is there.
    let placed = accel.luminous.iter().zip(intervals.by_ref()).map(|(instance, (&pick, &pick_end))| Emitter {
        primitive: instance.primitive,
        pick: pick as f32,
        pick_end,
        ..Emitter::default()
    });
    all.extend(placed);
    all.extend(lamps.into_iter().zip(intervals).map(|(lamp, (_, &pick_end))| Emitter { pick_end, ..lamp }));
    all.extend(rows);
    for (assembly, (of, (ends, within))) in accel.emitters_of.iter().zip(&picks.within).enumerate() {
        let table = all.len() as u32;
        for (i, _) in accel.luminous.iter().enumerate().filter(|(_, instance)| instance.assembly == assembly) {
            all[accel.emitters.len() + i].spectrum = table;
        }
        if of.is_empty() {
            continue;
        }
        all.push(Emitter { primitive: of.len() as u32, ..Emitter::default() });
        let entries = of.iter().zip(within).zip(ends);
        all.extend(entries.map(|((of, &pick), &end)| emitter(of, pick, end)));
        for (i, (primitive, ..)) in of.iter().enumerate() {
            accel.primitives[*primitive as usize].emitter = table + 1 + i as u32;
        }
    }
    all
}

/// The scene's lights as the device has them, and their places among the emitters.
fn lamps(scene: &Scene, accel: &Accel, picks: &LightPicks, source: impl Fn(usize) -> u32) -> (Vec<Lamp>, Vec<Emitter>) {
    let place = |towards: DVec3| towards.as_vec3().to_array();
    let (mut lamps, mut emitters) = (Vec::new(), Vec::new());
    for (&light, &pick) in picks.lamps.iter().zip(&picks.emitters[accel.emitters.len() + accel.luminous.len()..]) {
        let light = &scene.lights[light];
        let spectrum = source(light.spectrum()) | EMITTER_IS_LAMP;
        let mut emitter = Emitter {
            primitive: lamps.len() as u32,
            spectrum,
            pick: pick as f32,
            area: accel.space.scale.powi(2) as f32,
            ..Emitter::default()
        };
        match *light {
            Light::Point { position, .. } => {
                lamps.push(Lamp { place: accel.space.point(position), kind: LAMP_POINT, ..Lamp::default() });
            }
            Light::Spot { position, direction, ref cone, .. } => {
                lamps.push(Lamp { place: accel.space.point(position), kind: LAMP_SPOT, ..Lamp::default() });
                lamps.push(lights::cone(direction, cone));
            }
            Light::Directional { direction, .. } => {
                lamps.push(Lamp { place: place(-direction), kind: LAMP_DIRECTIONAL, ..Lamp::default() });
                emitter.area = 1.0;
            }
            Light::Sun { direction, angular_radius, .. } => {
                let sine = angular_radius.sin();
                let (sine2, versine) = ((sine * sine) as f32, lights::versine(angular_radius) as f32);
                lamps.push(Lamp { place: place(-direction), kind: LAMP_SUN, sine2, versine, ..Lamp::default() });
                // The irradiance facing a disk of unit radiance is π sin².
                emitter.area = (1.0 / (PI * sine * sine)) as f32;
            }
        }
        emitters.push(emitter);
    }
    (lamps, emitters)
}

fn material(scene: &Scene, m: &crate::scene::Material, factor: impl Fn(usize) -> u32) -> Material {
    let (factor, albedo) = match m.bsdf {
        Bsdf::Diffuse { reflectance: Reflectance::Spectrum(reflectance) } => {
            let curve = &scene.spectra[reflectance].curve;
            let albedo = scene.channels.bounds.iter().map(|b| curve.max(b[0], b[1])).fold(0.0, f64::max);
            let albedo = if scene.is_factored() { albedo.max(LEAST_ALBEDO) } else { albedo };
            // What reflects in no channel is black.
            (if albedo > 0.0 { factor(reflectance) } else { NONE }, albedo)
        }
        _ => (NONE, 0.0),
    };
    let survival = (albedo * STEPS).ceil() / STEPS;
    Material { factor, two_sided: u32::from(m.two_sided), albedo: survival as f32, unused: 0 }
}

fn features(scene: &Scene, accel: &Accel, tables: &SpectralTables) -> Features {
    Features {
        thin_lens: matches!(scene.camera.projection, Projection::ThinLens { .. }),
        orthographic: matches!(scene.camera.projection, Projection::Orthographic { .. }),
        latlong: scene.camera.projection == Projection::Latlong,
        pushbroom: matches!(scene.camera.projection, Projection::Pushbroom { .. }),
        gaussian: scene.film.filter == Filter::Gaussian,
        independent: scene.integrator.sampler == Sampler::Independent,
        emitters: !accel.emitters.is_empty() || !accel.luminous.is_empty(),
        environment: scene.environment.as_ref().is_some_and(|e| e.uniform().is_some()),
        shapes: accel.has_shapes,
        few_triangles: !accel.has_shapes
            && accel.instances == 0
            && scene.media.is_empty()
            && geometry::are_few(&accel.primitives),
        roulette: scene.integrator.russian_roulette_start > 0,
        strata: tables.stratum_bits > 0,
        knots: tables.has_knots(),
        registers: false,
    }
}

/// Whether all spectra of a plain scene may be held in registers.
fn fit_registers(tables: &SpectralTables, ids: &SpectrumIds) -> bool {
    !tables.has_knots() && ids.factors.len() + ids.sources.len() <= MAX_REGISTER_SPECTRA
}

/// Of a line scanner, as `generate_camera` reads them.
fn lines(scene: &Scene, accel: &Accel) -> Vec<[[f32; 4]; 4]> {
    let Projection::Pushbroom { lines, .. } = &scene.camera.projection else { return Vec::new() };
    let of = |line: &Line| {
        let [x, y, z] = accel.space.point(line.position);
        let direction = |of: DVec3| of.as_vec3().extend(0.0).to_array();
        [[x, y, z, 0.0], direction(line.forward), direction(line.right), direction(line.nose)]
    };
    lines.iter().map(of).collect()
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
        Projection::Pushbroom { half_width, half_pixel, .. } => (DVec2::new(half_width, half_pixel), 0.0, 1.0),
        // In turns.
        Projection::Latlong => (DVec2::new(0.5, 0.25), 0.0, 1.0),
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
        emitter_count: picks.cdf.len() as u32,
        environment_pick: picks.environment as f32,
        environment_spectrum,
        max_records: 0,
        stratum_bits,
        unused: 0,
    }
}
