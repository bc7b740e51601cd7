//! How paths are followed: where their random numbers come from, and when they end.

use crate::device::part::{Part, Place, SceneBuffer, Work};
use crate::device::prepared::Prepared;
use crate::device::text::module;
use crate::device::words::LOOP_LIMIT;

pub const ROULETTE: Part = Part {
    name: "Russian roulette",
    used: |scene| scene.features.roulette,
    effect: |_| "4 bytes a path, a load and a store a bounce".into(),
    is_planned: true,
    modules: &[(Place::Stage, module!("stages/go_on/roulette.wgsl"))],
    lines: &[("GO_ON", "choice.goes_on = choice.goes_on && survives(&path, u_choice.y, site.material.survival);")],
    defines: |_, _, defines| _ = defines.set("ROULETTE", true),
    ..Part::NOTHING
};

pub const SOBOL: Part = Part {
    name: "Owen-scrambled Sobol",
    used: |scene| !scene.features.independent,
    effect: |_| "nets in every epoch instead of independent numbers".into(),
    is_planned: true,
    defines: |_, _, defines| _ = defines.set("SOBOL", true),
    ..Part::NOTHING
};

/// Which paths are evaluated, where it is not all of them (docs/METHOD.md, Roulette on evaluation).
#[derive(Debug, Clone, PartialEq)]
pub struct Thinning {
    /// s: a path that brings the mean of the picture to some channel is evaluated with this probability.
    pub scale: f64,
    /// Of each representative quad of channels: s over the mean of those that count, 0 for the others.
    importances: Vec<[f32; 4]>,
}

/// Channels that count, of all representative quads together.
const REPRESENTATIVES: usize = 8;
/// Channels for each representative: what trying paths takes beside evaluating them.
const CHANNELS_A_QUAD: usize = 128;

impl Thinning {
    /// `means` of the picture, of every channel that the device renders.
    pub fn new(prepared: &Prepared, scale: f64, means: &[f64]) -> Thinning {
        let mut importances = vec![[0.0; 4]; representative_quads(prepared)];
        let quads = importances.len();
        for channel in representatives(prepared).filter(|&channel| means[channel] > 0.0) {
            let at = (0..quads).find(|&r| representative_quad(prepared, r, quads) == channel / 4);
            importances[at.expect("a representative's quad")][channel % 4] = (scale / means[channel]) as f32;
        }
        Thinning { scale, importances }
    }
}

/// How many quads of channels a path is tried in: as many as one invocation's loops can take.
fn representative_quads(prepared: &Prepared) -> usize {
    let affordable = LOOP_LIMIT / (prepared.path_iterations() / prepared.wavelengths_per_channel).max(1);
    let wanted = (prepared.channels / CHANNELS_A_QUAD).clamp(1, REPRESENTATIVES.min(affordable as usize).max(1));
    1 << wanted.ilog2()
}

/// As passes/thin_paths.wgsl has it.
fn representative_quad(prepared: &Prepared, r: usize, quads: usize) -> usize {
    (2 * r + 1) * (prepared.tables.channels_padded / 4) / (2 * quads)
}

/// The channels that tell how much a path brings: eight at most, evenly among all that the device renders.
pub fn representatives(prepared: &Prepared) -> impl Iterator<Item = usize> + use<> {
    let quads = representative_quads(prepared);
    let each = (REPRESENTATIVES / quads).min(4);
    let channels = prepared.channels;
    let first: Vec<usize> = (0..quads).map(|r| 4 * representative_quad(prepared, r, quads)).collect();
    first.into_iter().flat_map(move |first| (0..each).map(move |i| first + i * 4 / each)).filter(move |&k| k < channels)
}

pub const ROULETTE_ON_EVALUATION: Part = Part {
    name: "roulette on evaluation",
    used: |scene| scene.thinning.is_some(),
    effect: |scene| match &scene.thinning {
        Some(thinning) => format!(
            "a path that brings the mean is evaluated with {:.2}; 8 bytes a path, tried in {} quads of channels",
            thinning.scale.min(1.0),
            thinning.importances.len()
        ),
        None => "8 bytes a path, and a pass that tries paths in a few channels".into(),
    },
    is_planned: true,
    modules: &[(Place::Stage, module!("parts/paths/seen.wgsl"))],
    lines: &[("BEYOND", "note_seen(&list);"), ("EMIT", "note_seen(&list);")],
    defines: |scene, work, defines| {
        defines.set("THINNED", true);
        if let (Work::Evaluate, Some(thinning)) = (work, &scene.thinning) {
            defines.constant("REPRESENTATIVES", thinning.importances.len() as u32);
        }
    },
    buffers: |scene| match &scene.prepared.thinning {
        Some(thinning) => vec![SceneBuffer::new(
            "importances",
            &thinning.importances,
            "the channels that paths are tried in",
            "evaluation = \"all\"",
        )],
        None => Vec::new(),
    },
    ..Part::NOTHING
};
