//! Shaders as a scene composes them: the modules of each pass, its switches and constants, and the shape of its workgroups.

use crate::device::words::Primitive;
use crate::device::words::LOOP_LIMIT;
use crate::device::text::{self, Defines, Module};
use crate::device::parts::heat;
use crate::device::prepared::{General, Prepared};
use crate::device::parts::surfaces::Kind;
use crate::scene::Evaluator;

impl Prepared {
    /// Switches and constants of every pass. `windows`: primitives and nodes per binding, see `gpu::upload`.
    pub fn defines(&self, windows: &Windows) -> Defines {
        let f = &self.features;
        let mut d = Defines::default();
        if f.few_triangles {
            d.lines("TRIANGLES", self.triangle_lines());
        } else {
            d.set("STACK_SIZE", self.accel.depth);
        }
        d.set("CAMERA_THIN_LENS", f.thin_lens).set("CAMERA_ORTHOGRAPHIC", f.orthographic).set("GAUSSIAN", f.gaussian);
        d.set("BOUNCE_BY_BOUNCE", self.evaluator == Evaluator::Pt);
        d.set("INDEPENDENT", f.independent).set("ROULETTE", f.roulette).set("SHAPES", f.shapes);
        if let Some(general) = &f.general {
            self.general_defines(general, &mut d);
            if general.dispersion {
                d.set("STRATA", f.strata).set("KNOTS", f.knots).set("KNOT_STEPS", self.tables.knot_steps());
                self.spectra_defines(&mut d);
            }
        }
        d.set("EMITTERS", f.emitters).set("ENVIRONMENT", f.environment).set("LIGHTS", f.emitters || f.environment);
        let mut spread = |count: &'static str, many: &'static str, size: &'static str, list: &WindowList| {
            d.set(count, list.count);
            if list.count > 1 {
                d.set(many, true).constant(size, list.size);
            }
        };
        if !f.few_triangles {
            spread("NODE_WINDOWS", "MANY_NODE_WINDOWS", "NODE_WINDOW", &windows.nodes);
        }
        spread("PRIMITIVE_WINDOWS", "MANY_PRIMITIVE_WINDOWS", "PRIMITIVE_WINDOW", &windows.primitives);
        d
    }

    /// A test of each of a few triangles, which are constants of the shader: the shortest decimals that are these f32 and no others.
    fn triangle_lines(&self) -> Vec<String> {
        let vertex = |[x, y, z]: [f32; 3]| format!("vec3<f32>({x:?}f, {y:?}f, {z:?}f)");
        let test = |(i, p): (usize, &Primitive)| {
            format!("    hit = nearer(ray_sheared, hit, {i}u, {}, {}, {});", vertex(p.a), vertex(p.b), vertex(p.c))
        };
        self.accel.primitives.iter().enumerate().map(test).collect()
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
        modules.push(if self.features.few_triangles { shader::FEW_TRIANGLES } else { shader::BVH });
        modules.push(shader::SURFACE);
        if self.features.emitters || self.features.environment || self.features.general.is_some() {
            modules.push(shader::LIGHT);
        }
        let Some(general) = &self.features.general else {
            modules.push(shader::GENERATE_BOUNCE);
            return modules;
        };
        if general.attributes {
            modules.push(shader::ATTRIBUTES);
        }
        if general.textures {
            modules.push(shader::TEXTURE);
        }
        if general.lamps {
            modules.push(shader::LAMP);
        }
        if general.map.is_some() {
            modules.push(shader::MAP);
        }
        modules.extend([shader::RECORD, shader::APPEND, shader::TABLES, shader::MATERIAL]);
        modules.extend([shader::GGX, shader::BSDF, shader::CHOICE]);
        if general.radiators.is_some() {
            modules.push(shader::RADIATOR);
        }
        if general.hot || general.radiators.is_some() {
            modules.push(shader::HEAT);
        }
        if general.media.is_some() {
            modules.extend([shader::VOLUME, shader::MEDIUM]);
        }
        if general.anisotropic {
            modules.push(shader::TANGENT);
        }
        if general.dispersion {
            if self.features.knots {
                modules.push(shader::KNOTS);
            }
            modules.push(shader::CHANNEL);
        }
        modules.push(shader::GENERATE_VERTEX);
        modules
    }

    /// The pass that leaves the means of a wave's pixels: it evaluates all saved paths, or folds what [`Self::update_modules`]
    /// made of them.
    pub fn evaluate_modules(&self) -> Vec<Module> {
        match self.evaluator {
            Evaluator::Auto | Evaluator::DpeptPixel => self.evaluating(&[shader::FOLD, shader::EVALUATE_PIXEL]),
            Evaluator::DpeptPath => self.evaluating(&[shader::FOLD, shader::EVALUATE_PATH]),
            Evaluator::DpeptSpectral => self.evaluating(&[shader::FOLD, shader::EVALUATE_SPECTRAL]),
            Evaluator::Pt => {
                vec![shader::TYPES, shader::SAVED_PATHS, shader::SPECTRAL_STATE, shader::FOLD, shader::FOLD_PATHS]
            }
        }
    }

    /// The pass after every bounce of the conventional path tracer.
    pub fn update_modules(&self) -> Option<Vec<Module>> {
        (self.evaluator == Evaluator::Pt).then(|| self.evaluating(&[shader::SPECTRAL_STATE, shader::UPDATE_PATH]))
    }

    /// What takes spectra along records, and then `last`.
    fn evaluating(&self, last: &[Module]) -> Vec<Module> {
        let mut modules = vec![shader::TYPES, shader::FRAME, shader::SAVED_PATHS, shader::SPECTRA];
        if self.features.knots {
            modules.push(shader::KNOTS);
        }
        if let Some(general) = &self.features.general {
            modules.push(shader::RECORD);
            if general.has(&[Kind::BoundaryAgain]) || general.rough_base {
                modules.push(shader::TABLES);
            }
            if general.map.is_some() {
                modules.push(shader::MAP_VALUE);
            }
            if general.media.is_some() || general.wavelength.is_some() {
                modules.push(shader::PLANCK);
            }
            if let Some(media) = &general.media {
                modules.push(shader::EXTINCTION);
                if media.grids.is_some() {
                    modules.push(shader::VOLUME);
                }
            }
            modules.push(shader::PROGRAM);
        }
        modules.extend(last);
        modules
    }

    /// What general scenes compile into every pass.
    fn general_defines(&self, general: &General, d: &mut Defines) {
        let has = |kinds: &[Kind]| general.has(kinds);
        let rough_glass = has(&[Kind::RoughBoundary]);
        d.set("GENERAL", true).set("ANISOTROPIC", general.anisotropic).set("DISPERSION", general.dispersion);
        d.constant("STATE_WORDS", self.state_bytes() / 16);
        if general.hot {
            d.set("HOT", true).constant("HOT_COSINES", heat::COSINES as u32);
        }
        for (name, kinds) in [
            ("MIRRORS", &[Kind::Conductor, Kind::Mirror, Kind::Refraction][..]),
            ("MICROFACETS", &[Kind::RoughConductor, Kind::RoughCoat, Kind::RoughBoundary]),
            ("GLASS", &[Kind::Mirror, Kind::RoughBoundary]),
            ("CONDUCTOR", &[Kind::Conductor]),
            ("ROUGH_CONDUCTOR", &[Kind::RoughConductor]),
            ("CONDUCTOR_AGAIN", &[Kind::ConductorAgain]),
            ("MIRROR", &[Kind::Mirror]),
            ("REFRACTION", &[Kind::Refraction]),
            ("ROUGH_GLASS", &[Kind::RoughBoundary]),
            ("ROUGH_COAT", &[Kind::RoughCoat]),
            ("BASE", &[Kind::Base]),
            ("OP_CONDUCTOR", &[Kind::Conductor, Kind::RoughConductor]),
            ("OP_FRESNEL", &[Kind::Mirror, Kind::Refraction, Kind::RoughBoundary, Kind::RoughCoat, Kind::Base]),
        ] {
            d.set(name, has(kinds));
        }
        d.set("ROUGH_BASE", general.rough_base).set("OP_ETA_TABLE", rough_glass || general.rough_base);
        if let Some(media) = &general.media {
            d.set("MEDIA", true).constant("OUTER_VOLUME", media.outer).constant("MOST_STRETCHES", media.stretches);
            d.set("CAMERA_CUT", media.camera_is_cut);
            if let Some(columns) = media.grids {
                d.set("GRIDS", true).set("MOST_COLUMNS", columns);
            }
        }
        if let Some(wavelength) = general.wavelength {
            d.set("PLANCK", true).constant("WAVELENGTH", wavelength);
        }
        let radiators = general.radiators.unwrap_or_default();
        d.set("RADIATORS", general.radiators.is_some()).set("HOT_LAMPS", radiators.lamps);
        d.set("HOT_FACETS", radiators.facets).set("HOT_MIRRORS", radiators.mirrors);
        d.set("HOT_VARNISH", radiators.varnish).set("HOT_COATS", radiators.coats);
        d.set("HOT_TEXTURED", radiators.textured).set("HOT_NUMBERS", radiators.numbers);
        d.set("HOT_RANDOM", general.hot || radiators.facets);
        d.set("HOT_VERTICES", general.radiators.is_some() || (general.hot && general.smooth));
        d.set("OP_ONLY", general.dispersion);
        d.set("TEXTURES", general.textures).set("TEXTURED", general.textured || radiators.textured);
        d.set("KEPT", general.textured_base || radiators.textured);
        d.set("COLOURS", general.colours).set("MIXTURES", general.mixtures).set("SHARES", general.shares);
        d.set("TEXEL_NUMBERS", general.mixtures || general.shares || radiators.numbers);
        d.set("PRODUCTS", general.shares || radiators.numbers);
        d.set("ATTRIBUTES", general.attributes).set("SMOOTH", general.smooth);
        if let Some(surfaces) = &self.surfaces {
            if let Some(first) = surfaces.textures.as_ref().and_then(|textures| textures.first_share) {
                d.constant("FIRST_SHARE", first);
            }
            if let Some(place) = surfaces.visible_place {
                d.constant("VISIBLE_PLACE", place);
            }
        }
        let chooses = self.features.emitters || general.lamps;
        d.set("CHOOSES", chooses).set("AIMS", chooses || general.map.is_some()).set("LAMPS", general.lamps);
        if general.suns > 0 {
            d.constant("SUNS", general.suns);
        }
        if let Some(map) = general.map {
            d.set("MAP", true).set("OP_MAP", true).constant("MAP_SOURCE", map.source);
            d.constant("MAP_AXIS", map.axis).constant("MAP_WIDTH", map.size[0]).constant("MAP_HEIGHT", map.size[1]);
            if let Some(bands) = map.bands {
                d.set("MAP_SPECTRAL", true).constant("MAP_BANDS", bands);
            }
        }
        d.set("OP_ROUGH_TRANSMIT", general.spread).set("RAW_RECORDS", general.spread);
    }

    /// How spectral tables are laid out.
    fn spectra_defines(&self, d: &mut Defines) {
        if self.tables.kinks > 0 {
            d.constant("KINKS", self.tables.kinks);
        }
        d.constant("SPECTRA", self.tables.stratified as u32);
        d.constant("CHANNELS", self.channels as u32);
        d.constant("CHANNELS_PADDED", self.tables.channels_padded as u32);
        d.constant("QUADS", self.tables.channels_padded as u32 / 4);
    }

    /// Workgroups of what evaluates, on a software device or a GPU.
    pub fn evaluate_shape(&self, software: bool) -> EvaluateShape {
        let quads = self.tables.channels_padded as u32 / 4;
        let shape = match self.features.general {
            None => EvaluateShape::new(quads, software),
            // A march through voxels is long, and compiled for each quad.
            Some(general) if general.media.is_some_and(|m| m.grids.is_some()) => {
                EvaluateShape::among(quads, software, &[1])
            }
            Some(_) => EvaluateShape::general(quads, software),
        };
        match self.evaluator {
            Evaluator::DpeptPath => shape.path_by_path(quads, self.path_iterations()),
            _ => shape,
        }
    }

    /// Switches and constants of what evaluates, for workgroups as `shape` says.
    pub fn evaluate_defines(&self, shape: EvaluateShape) -> Defines {
        let mut d = Defines::default();
        d.set("STRATA", self.features.strata).set("KNOTS", self.features.knots);
        d.set("REGISTERS", self.features.registers).set("KNOT_STEPS", self.tables.knot_steps());
        if let Some(general) = &self.features.general {
            self.general_defines(general, &mut d);
        }
        d.set("FACTORS", self.factors as u32).set("SOURCES", self.sources as u32);
        d.set("HELD", (self.factors + self.sources) as u32);
        d.set("WORKGROUP", shape.lanes * shape.pixels);
        d.constant("FIRST_SOURCE", 1 + self.factors as u32);
        if let Some(weight) = self.path_weight {
            d.set("WEIGHTED", true).constant("PATH_WEIGHT", weight);
        }
        self.spectra_defines(&mut d);
        d.constant("LANES", shape.lanes);
        d.constant("VECTORS", shape.vectors);
        d.constant("PIXELS_PER_GROUP", shape.pixels);
        if let Some(batches) = shape.batches {
            d.constant("BATCHES", batches);
        }
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

/// Threads of one workgroup of what evaluates: `lanes` threads for each of `pixels` pixels, `vectors` quads of channels
/// a thread.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EvaluateShape {
    pub vectors: u32,
    pub lanes: u32,
    pub pixels: u32,
    /// Workgroups that share a pixel's channels.
    pub blocks: u32,
    /// How often a thread takes `vectors` quads, one batch after the other (`dpept-path`); else once.
    pub batches: Option<u32>,
}

impl EvaluateShape {
    /// For `quads` quads of channels: groups of 64 to 256 threads, few of them idle.
    ///
    /// On software devices loads count most, and more channels a thread share them: measured on lavapipe, a thread's time
    /// goes as 2.2 + vectors. A GPU hides loads behind other threads, and needs the registers for that.
    pub fn new(quads: u32, software: bool) -> EvaluateShape {
        EvaluateShape::among(quads, software, &[1, 2, 4])
    }

    /// For general scenes, whose code per quad is long: compiling it, and registers, set the limit.
    pub fn general(quads: u32, software: bool) -> EvaluateShape {
        EvaluateShape::among(quads, software, &[1, 2])
    }

    fn among(quads: u32, software: bool, candidates: &[u32]) -> EvaluateShape {
        let width = if software { 8 } else { 32 };
        let of = |vectors: u32| {
            let threads = quads.div_ceil(vectors);
            if threads < width {
                let lanes = threads.next_power_of_two();
                return EvaluateShape { vectors, lanes, pixels: (64 / lanes).max(1), blocks: 1, batches: None };
            }
            let blocks = threads.div_ceil(256);
            let lanes = threads.div_ceil(blocks).next_multiple_of(width);
            EvaluateShape { vectors, lanes, pixels: 1, blocks, batches: None }
        };
        let cost = |s: &EvaluateShape| f64::from(s.lanes * s.blocks) * (2.2 + f64::from(s.vectors));
        let candidates = if software { candidates } else { &[1] };
        let shapes = candidates.iter().map(|&v| of(v));
        shapes.min_by(|a, b| cost(a).total_cmp(&cost(b))).expect("at least one candidate")
    }

    /// A thread for all of a path's channels, or as many as its loops can take.
    fn path_by_path(self, quads: u32, path_iterations: u32) -> EvaluateShape {
        let batches = quads.div_ceil(self.vectors);
        let at_once = (LOOP_LIMIT / path_iterations).clamp(1, batches);
        EvaluateShape { lanes: 1, pixels: 64, blocks: batches.div_ceil(at_once), batches: Some(at_once), ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::EvaluateShape;

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
        assert_eq!(
            EvaluateShape::new(100, false),
            EvaluateShape { vectors: 1, lanes: 128, pixels: 1, blocks: 1, batches: None }
        );
        assert_eq!(
            EvaluateShape::new(100, true),
            EvaluateShape { vectors: 4, lanes: 32, pixels: 1, blocks: 1, batches: None }
        );
        assert_eq!(
            EvaluateShape::new(2, true),
            EvaluateShape { vectors: 2, lanes: 1, pixels: 64, blocks: 1, batches: None }
        );
    }
}
