//! What this scene needs on a device, and nothing else: features, spectra, materials, lights and geometry, flat.

use crate::accel::{Accel, MAX_MATERIALS};
use crate::gpu::layout::{EMITS_BOTH_SIDES, Emitter, Frame, Material, NONE};
use crate::gpu::shader::{self, Defines, Module};
use crate::render::lights::{LightPicks, STEPS, light_picks};
use crate::scene::{Bsdf, Filter, Projection, Reflectance, Sampler, Scene, Sides};
use crate::spectral::Curve;
use crate::spectral::table::SpectralTables;
use crate::{Error, Result};

/// Spectra that may be held in registers while a pixel is evaluated; with more, each is looked up where it is needed.
const MAX_REGISTER_SPECTRA: usize = 8;
/// Spectrum ids have 16 bits in a record.
const MAX_SPECTRA: usize = 1 << 16;
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
    pub features: Features,
    pub frame: Frame,
    pub materials: Vec<Material>,
    pub emitters: Vec<Emitter>,
    pub picks: LightPicks,
    pub accel: Accel,
    pub tables: SpectralTables,
    /// Names of the spectra in the tables, in the order of `tables.bounds`.
    pub spectrum_names: Vec<String>,
    /// Spectra that multiply throughput, and spectra that emit; the constant 1 apart.
    pub factors: usize,
    pub sources: usize,
    pub channels: usize,
}

impl Prepared {
    /// Flattens `scene`. Errors: materials that no shader knows; more materials, spectra or bounces than ids and
    /// counters have bits for.
    pub fn new(scene: &Scene, seed: u64) -> Result<Prepared> {
        check_materials(scene)?;
        let accel = Accel::build(scene);
        if scene.materials.len() > MAX_MATERIALS {
            return Err(Error::input(&scene.file, format!("more than {MAX_MATERIALS} materials")));
        }
        let picks = light_picks(scene, &accel);
        let (tables, ids) = spectral_tables(scene)?;

        let factor = |s: usize| tables.ids[ids.factors[&s]];
        let source = |s: usize| tables.ids[ids.sources[&s]];
        let materials = scene.materials.iter().map(|m| material(scene, m, factor)).collect();
        let emitters = accel
            .emitters
            .iter()
            .zip(&picks.emitters)
            .map(|(&(primitive, object, area), &pick)| {
                let emission = scene.objects[object].emission.as_ref().expect("emitters come from emitting objects");
                let sides = if emission.sides == Sides::Both { EMITS_BOTH_SIDES } else { 0 };
                Emitter { primitive, spectrum: source(emission.radiance) | sides, pick: pick as f32, area: area as f32 }
            })
            .collect();
        let environment_spectrum = scene.environment.as_ref().map_or(0, |e| source(e.radiance));
        let features = features(scene, &accel, &tables, ids.factors.len() + ids.sources.len());
        Ok(Prepared {
            features,
            frame: frame(scene, seed, &accel, &picks, environment_spectrum, tables.stratum_bits, features),
            materials,
            emitters,
            picks,
            spectrum_names: ids.names,
            factors: ids.factors.len(),
            sources: ids.sources.len(),
            channels: scene.channels.len(),
            accel,
            tables,
        })
    }

    /// Most records that one path can have: at each vertex what it emits and what next-event estimation found.
    pub fn max_records(&self) -> u32 {
        self.frame.max_records
    }

    /// Switches and constants of every pass. `windows`: primitives and nodes per binding, see `gpu::upload`.
    pub fn defines(&self, windows: &Windows) -> Defines {
        let f = &self.features;
        let mut d = Defines::default();
        d.constant("STACK_SIZE", self.accel.depth);
        d.set("CAMERA_THIN_LENS", f.thin_lens).set("CAMERA_ORTHOGRAPHIC", f.orthographic).set("GAUSSIAN", f.gaussian);
        d.set("INDEPENDENT", f.independent).set("ROULETTE", f.roulette).set("SHAPES", f.shapes);
        d.set("EMITTERS", f.emitters).set("ENVIRONMENT", f.environment).set("LIGHTS", f.emitters || f.environment);
        for (count, many, size_name, list) in [
            ("NODE_WINDOWS", "MANY_NODE_WINDOWS", "NODE_WINDOW", &windows.nodes),
            ("PRIMITIVE_WINDOWS", "MANY_PRIMITIVE_WINDOWS", "PRIMITIVE_WINDOW", &windows.primitives),
        ] {
            d.set(count, list.count);
            if list.count > 1 {
                d.set(many, true).constant(size_name, list.size);
            }
        }
        d
    }

    /// The modules of each pass, the pass itself last.
    pub fn camera_modules(&self) -> Vec<Module> {
        vec![shader::TYPES, shader::RNG, shader::GEOMETRY, shader::FRAME, shader::GENERATE_CAMERA]
    }

    pub fn bounce_modules(&self) -> Vec<Module> {
        let mut modules =
            vec![shader::TYPES, shader::RNG, shader::GEOMETRY, shader::FRAME, shader::SCENE, shader::TRIANGLE];
        if self.features.shapes {
            modules.push(shader::SHAPES);
        }
        modules.push(shader::BVH);
        if self.features.emitters || self.features.environment {
            modules.push(shader::LIGHT);
        }
        modules.push(shader::GENERATE_BOUNCE);
        modules
    }

    pub fn evaluate_modules(&self) -> Vec<Module> {
        vec![shader::TYPES, shader::FRAME, shader::EVALUATE_PIXEL]
    }

    /// Switches and constants of `evaluate_pixel`, for workgroups as `shape` says.
    pub fn evaluate_defines(&self, shape: EvaluateShape) -> Defines {
        let mut d = Defines::default();
        d.set("STRATA", self.features.strata).set("KNOTS", self.features.knots);
        d.set("REGISTERS", self.features.registers).set("KNOT_STEPS", self.tables.knot_steps());
        d.set("FACTORS", self.factors as u32).set("SOURCES", self.sources as u32);
        d.set("WORKGROUP", shape.lanes * shape.pixels);
        d.constant("FIRST_SOURCE", 1 + self.factors as u32);
        d.constant("SPECTRA", self.tables.stratified as u32);
        d.constant("CHANNELS", self.channels as u32);
        d.constant("CHANNELS_PADDED", self.tables.channels_padded as u32);
        d.constant("QUADS", self.tables.channels_padded as u32 / 4);
        d.constant("LANES", shape.lanes);
        d.constant("VECTORS", shape.vectors);
        d.constant("PIXELS_PER_GROUP", shape.pixels);
        d
    }
}

/// How nodes and primitives are spread over bindings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Windows {
    pub nodes: WindowList,
    pub primitives: WindowList,
}

/// `count` windows of `size` elements each (the last may be shorter).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WindowList {
    pub count: u32,
    pub size: u32,
}

/// Threads of one workgroup of `evaluate_pixel`: `lanes` threads for each of `pixels` pixels, `vectors` quads of channels
/// a thread.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EvaluateShape {
    pub vectors: u32,
    pub lanes: u32,
    pub pixels: u32,
    /// Workgroups that share a pixel's channels.
    pub blocks: u32,
}

impl EvaluateShape {
    /// For `quads` quads of channels: groups of 64 to 256 threads, few of them idle.
    ///
    /// On software devices loads count most, and more channels a thread share them: measured on lavapipe, a thread's time
    /// goes as 2.2 + vectors. A GPU hides loads behind other threads, and needs the registers for that.
    pub fn new(quads: u32, software: bool) -> EvaluateShape {
        let width = if software { 8 } else { 32 };
        let of = |vectors: u32| {
            let threads = quads.div_ceil(vectors);
            if threads < width {
                let lanes = threads.next_power_of_two();
                return EvaluateShape { vectors, lanes, pixels: (64 / lanes).max(1), blocks: 1 };
            }
            let blocks = threads.div_ceil(256);
            EvaluateShape { vectors, lanes: threads.div_ceil(blocks).next_multiple_of(width), pixels: 1, blocks }
        };
        let cost = |s: &EvaluateShape| f64::from(s.lanes * s.blocks) * (2.2 + f64::from(s.vectors));
        let candidates: &[u32] = if software { &[1, 2, 4] } else { &[1] };
        let shapes = candidates.iter().map(|&v| of(v));
        shapes.min_by(|a, b| cost(a).total_cmp(&cost(b))).expect("at least one candidate")
    }
}

struct SpectrumIds {
    /// Scene spectrum → position among the curves of the tables.
    factors: std::collections::BTreeMap<usize, usize>,
    sources: std::collections::BTreeMap<usize, usize>,
    names: Vec<String>,
}

/// Scenes may have materials that the devices do not render yet.
fn check_materials(scene: &Scene) -> Result<()> {
    for material in &scene.materials {
        let kind = match material.bsdf {
            Bsdf::Diffuse { reflectance: Reflectance::Spectrum(_) } | Bsdf::Black => continue,
            Bsdf::Diffuse { reflectance: Reflectance::Texture(_) } => "diffuse, with a texture",
            Bsdf::Conductor { .. } => "conductor",
            Bsdf::Dielectric { .. } => "dielectric",
            Bsdf::Plastic { .. } => "plastic",
            Bsdf::Blend { .. } => "blend",
        };
        let message = format!(
            "material \"{}\" is of kind `{kind}`, which cannot be rendered yet: use `diffuse` or `black`",
            material.name
        );
        return Err(Error::input(&scene.file, message));
    }
    let smooth = scene.objects.iter().find(|object| object.attributes.normals.is_some());
    if let Some(object) = smooth {
        let message = format!("{} has vertex normals, which cannot be rendered yet: remove them", object.name);
        return Err(Error::input(&scene.file, message));
    }
    Ok(())
}

/// Tables of the constant 1, of what multiplies throughput, then of what emits.
fn spectral_tables(scene: &Scene) -> Result<(SpectralTables, SpectrumIds)> {
    let factors = scene.materials.iter().filter_map(|m| match m.bsdf {
        Bsdf::Diffuse { reflectance: Reflectance::Spectrum(reflectance) } => Some(reflectance),
        _ => None,
    });
    let sources = scene.objects.iter().filter_map(|o| o.emission.as_ref().map(|e| e.radiance));
    let sources = sources.chain(scene.environment.as_ref().map(|e| e.radiance));
    let mut curves = vec![&Curve::Constant(1.0)];
    let mut names = vec!["1".to_owned()];
    let mut number = |list: std::collections::BTreeSet<usize>| -> std::collections::BTreeMap<usize, usize> {
        list.into_iter()
            .map(|s| {
                curves.push(&scene.spectra[s].curve);
                names.push(scene.spectra[s].name.clone());
                (s, curves.len() - 1)
            })
            .collect()
    };
    let (factors, sources) = (number(factors.collect()), number(sources.collect()));
    if curves.len() > MAX_SPECTRA {
        return Err(Error::input(
            &scene.file,
            format!("{} spectra in use, at most {MAX_SPECTRA} are supported", curves.len()),
        ));
    }
    Ok((SpectralTables::build(&curves, &scene.channels), SpectrumIds { factors, sources, names }))
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
        environment: scene.environment.is_some(),
        shapes: accel.has_shapes,
        roulette: scene.integrator.russian_roulette_start > 0,
        strata: tables.stratum_bits > 0,
        knots: tables.has_knots(),
        registers: !tables.has_knots() && spectra <= MAX_REGISTER_SPECTRA,
    }
}

fn frame(
    scene: &Scene,
    seed: u64,
    accel: &Accel,
    picks: &LightPicks,
    environment_spectrum: u32,
    stratum_bits: u32,
    features: Features,
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
        emitter_count: accel.emitters.len() as u32,
        environment_pick: picks.environment as f32,
        environment_spectrum,
        // Next-event estimation at every scattering event, and emission where a surface or the sky emits.
        max_records: bounces + if features.emitters { bounces + 1 } else { 1 },
        stratum_bits,
        unused: 0,
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{EvaluateShape, Prepared};
    use crate::scene;

    /// What the scene file may have and no shader knows is refused in one sentence that names it.
    #[test]
    fn materials_that_no_shader_knows_are_refused() {
        const SCENE: &str = "camera.perspective = { position = [0, 0, 5], look_at = [0, 0, 0], fov = 60 }
            film = { width = 1, height = 1 }
            channels.equal = { from = 400, to = 700, count = 1 }
            materials.grey.diffuse.reflectance = 0.5
            objects = [{ sphere = { center = [0, 0, 0], radius = 1 }, material = \"m\" }]\n";
        for (kind, keys) in [
            ("conductor", "{ eta = 0.2, k = 3.4 }"),
            ("dielectric", "{ eta = 1.5 }"),
            ("plastic", "{ reflectance = 0.5, eta = 1.5 }"),
            ("blend", "{ a = \"grey\", b = \"grey\", weight = 0.5 }"),
        ] {
            let text = format!("{SCENE}materials.m.{kind} = {keys}");
            let scene = scene::parse(&text, Path::new("t.toml"), &[]).unwrap_or_else(|e| panic!("{e}"));
            let Err(error) = Prepared::new(&scene, 0) else { panic!("{kind} was accepted") };
            assert_eq!(error.exit_code(), 2);
            let message = error.to_string();
            assert!(message.contains("material \"m\"") && message.contains(&format!("`{kind}`")), "{message}");
        }
    }

    #[test]
    fn evaluation_groups_cover_all_channels_with_few_idle_threads() {
        for software in [true, false] {
            let width = if software { 8 } else { 32 };
            for quads in (1..300).chain([500, 512, 1250, 2500]) {
                let s = EvaluateShape::new(quads, software);
                let (threads, needed) = (s.lanes * s.blocks, quads.div_ceil(s.vectors));
                // Each of a pixel's workgroups has channels: evaluation counts on that.
                assert_eq!(quads.div_ceil(s.lanes * s.vectors), s.blocks, "{quads}: {s:?}");
                assert!(threads >= needed && s.lanes * s.pixels <= 256, "{quads}: {s:?}");
                assert!(threads < 2 * needed || threads < needed + width * s.blocks, "{quads}: {s:?}");
            }
        }
        assert_eq!(EvaluateShape::new(100, false), EvaluateShape { vectors: 1, lanes: 128, pixels: 1, blocks: 1 });
        assert_eq!(EvaluateShape::new(100, true), EvaluateShape { vectors: 4, lanes: 32, pixels: 1, blocks: 1 });
        assert_eq!(EvaluateShape::new(2, true), EvaluateShape { vectors: 2, lanes: 1, pixels: 64, blocks: 1 });
    }
}
