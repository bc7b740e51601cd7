//! All kernels of a render, composed for a scene: each a short list of modules that every scene has, those of its parts, and the
//! kernel's own file.

use crate::device::evaluator::EvaluateShape;
use crate::device::part::{OnDevice, Place, Work};
use crate::device::text::{Defines, Module, compose, module};
use crate::gpu::source::Source;
use crate::scene::Evaluator;

/// What a kernel is made of.
enum Text {
    /// In every scene.
    Of(Module),
    /// What the scene's parts have here.
    Parts(Place),
}

use Text::{Of, Parts};

const TYPES: Text = Of(module!("common/types.wgsl"));
const FRAME: Text = Of(module!("common/frame.wgsl"));
const RNG: Text = Of(module!("common/rng.wgsl"));
const GEOMETRY: Text = Of(module!("common/geometry.wgsl"));
const SAVED_PATHS: Text = Of(module!("common/saved_paths.wgsl"));
const SPECTRAL_STATE: Text = Of(module!("common/spectral_state.wgsl"));
const FOLD: Text = Of(module!("common/fold.wgsl"));

/// Camera rays.
const CAMERA: &[Text] = &[TYPES, RNG, GEOMETRY, FRAME, Of(module!("passes/generate_camera.wgsl"))];

/// What following paths is made of, but for the kernel itself and its stages.
const TRACING: &[Text] = &[
    TYPES,
    RNG,
    GEOMETRY,
    FRAME,
    Of(module!("common/scene.wgsl")),
    Of(module!("common/triangle.wgsl")),
    Parts(Place::Shapes),
    Parts(Place::Traversal),
    Of(module!("common/surface.wgsl")),
    Parts(Place::Generate),
];

/// And what only kernels that save records have.
const FOLLOWING: &[Text] = &[Parts(Place::Following)];

/// One bounce of every path: of plain scenes, whose one kernel was measured as a whole, and of general ones, in stages.
const BOUNCE: Module = module!("passes/generate_bounce.wgsl");

/// What single rays meet, beside all paths.
const FIRST_HITS: Module = module!("passes/first_hits.wgsl");
const STAGES: &[Text] = &[Of(module!("common/wave.wgsl")), Parts(Place::Stage), Of(module!("passes/generate.wgsl"))];

/// What makes radiance of products, for cubes that are relit; of no scene.
pub fn expanding() -> Source {
    compose(&[module!("passes/expand.wgsl")], &Defines::default())
}

/// What says how many workgroups a bounce takes; of no scene.
pub fn launching() -> Source {
    compose(&[module!("common/types.wgsl"), module!("passes/launch.wgsl")], &Defines::default())
}

/// What takes spectra along records.
const EVALUATING: &[Text] = &[TYPES, FRAME, SAVED_PATHS, Of(module!("common/spectra.wgsl")), Parts(Place::Evaluate)];

const PIXEL: &[Text] = &[FOLD, Of(module!("passes/evaluate_pixel.wgsl"))];
const PATH: &[Text] = &[FOLD, Of(module!("passes/evaluate_path.wgsl"))];
const SPECTRAL: &[Text] = &[FOLD, Of(module!("passes/evaluate_spectral.wgsl"))];

/// Roulette on evaluation, before it.
const THIN: &[Text] = &[RNG, Of(module!("passes/thin_paths.wgsl"))];

/// The conventional path tracer: after every bounce, and when all paths of a wave have ended.
const UPDATE: &[Text] = &[SPECTRAL_STATE, Of(module!("passes/update_path.wgsl"))];
const FOLD_PATHS: &[Text] = &[TYPES, SAVED_PATHS, SPECTRAL_STATE, FOLD, Of(module!("passes/fold_paths.wgsl"))];

/// The kernels of a render, in the order in which a wave runs them.
pub struct Kernels {
    /// Camera rays.
    pub camera: Source,
    /// One bounce of every path.
    pub bounce: Source,
    /// What happens to all channels after each bounce, in the conventional path tracer.
    pub update: Option<Source>,
    /// Chooses the paths that are evaluated, where it is not all of them.
    pub thin: Option<Source>,
    /// Leaves the means of a wave's pixels: it evaluates all saved paths, or folds what `update` made of them. None where records are
    /// all that is wanted (factored renders of what separates).
    pub evaluate: Option<Source>,
    /// What rays of the host's choice meet, where there are layers: before a tile's first wave.
    pub first_hits: Option<Source>,
}

impl Kernels {
    pub fn all(&self) -> impl Iterator<Item = &Source> {
        let always = [&self.camera, &self.bounce].into_iter();
        always.chain(&self.update).chain(&self.thin).chain(&self.evaluate).chain(&self.first_hits)
    }
}

impl OnDevice<'_> {
    /// The kernels for workgroups of evaluation as `shape` says.
    pub fn kernels(&self, shape: EvaluateShape) -> Kernels {
        let generate = self.defines(Work::Generate);
        let mut evaluate = self.defines(Work::Evaluate);
        shape.define(&mut evaluate);
        let bounce = match self.is_general() {
            true => [TRACING, FOLLOWING, STAGES].map(|texts| self.modules(texts)).concat(),
            false => [&self.modules(TRACING)[..], &self.modules(FOLLOWING), &[BOUNCE]].concat(),
        };
        let mut try_paths = self.defines(Work::Evaluate);
        if let Some(thinning) = &self.thinning {
            // A thread has one path, whose few records need few of the spectra that one with many paths holds in registers.
            let quads = thinning.importances.len() as u32;
            try_paths.constant("VECTORS", quads).set("THINS", true).set("REGISTERS", false);
        }
        let text = |last: &[Text], defines: &Defines| {
            compose(&[EVALUATING, last].map(|texts| self.modules(texts)).concat(), defines)
        };
        let evaluating = |last: &[Text]| text(last, &evaluate);
        Kernels {
            camera: compose(&self.modules(CAMERA), &generate),
            bounce: compose(&bounce, &generate),
            update: (self.evaluator == Evaluator::Pt).then(|| evaluating(UPDATE)),
            thin: self.thinning.is_some().then(|| text(THIN, &try_paths)),
            evaluate: match self.evaluator {
                Evaluator::Auto | Evaluator::DpeptPixel => Some(evaluating(PIXEL)),
                Evaluator::DpeptPath => Some(evaluating(PATH)),
                Evaluator::DpeptSpectral => Some(evaluating(SPECTRAL)),
                Evaluator::Pt => Some(compose(&self.modules(FOLD_PATHS), &evaluate)),
                Evaluator::Factored => self.has_remainder().then(|| evaluating(PIXEL)),
            },
            first_hits: self.first_hits.then(|| self.around_tracing(FIRST_HITS)),
        }
    }

    /// A kernel of its own around what paths are followed by.
    pub fn around_tracing(&self, kernel: Module) -> Source {
        compose(&[&self.modules(TRACING)[..], &[kernel]].concat(), &self.defines(Work::Generate))
    }

    fn modules(&self, texts: &[Text]) -> Vec<Module> {
        let of_parts = |place: Place| {
            let all = self.parts().flat_map(|part| part.modules);
            all.filter(move |(at, _)| *at == place).map(|(_, module)| *module)
        };
        let mut modules: Vec<Module> = Vec::new();
        for text in texts {
            match text {
                Of(module) => modules.push(*module),
                // Parts may need the same file.
                Parts(place) => of_parts(*place).for_each(|module| {
                    if !modules.iter().any(|known| known.name == module.name) {
                        modules.push(module);
                    }
                }),
            }
        }
        modules
    }

    /// Switches, constants and lines of all parts.
    fn defines(&self, work: Work) -> Defines {
        let mut defines = Defines::default();
        for part in self.parts() {
            (part.defines)(self, work, &mut defines);
            for (name, line) in part.lines {
                defines.lines(name, [format!("    {line}")]);
            }
        }
        defines
    }
}
