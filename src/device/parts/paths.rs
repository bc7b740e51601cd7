//! How paths are followed: where their random numbers come from, and when they end.

use crate::device::part::{Part, Place, SceneBuffer, Work};
use crate::device::prepared::Prepared;
use crate::device::text::module;

pub const ROULETTE: Part = Part {
    name: "Russian roulette",
    used: |scene| scene.features.roulette,
    effect: |_| "4 bytes a path, a load and a store a bounce".into(),
    is_planned: true,
    modules: &[(Place::Stage, module!("stages/go_on/roulette.wgsl"))],
    lines: &[("GO_ON", "choice.goes_on = choice.goes_on && survives(&path, u_choice.y, site.material.survival);")],
    defines: |_, _, defines| _ = defines.set("ROULETTE", true).set("SCALED", true),
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
    pub importances: Vec<[f32; 4]>,
}

/// Channels that count, of all representative quads together.
const REPRESENTATIVES: usize = 8;

impl Thinning {
    /// `means` of the picture, of every channel that the device renders.
    pub fn new(prepared: &Prepared, scale: f64, means: &[f64]) -> Thinning {
        let mut importances = vec![[0.0; 4]; representative_quads(prepared).len()];
        for (importances, quad) in importances.iter_mut().zip(representative_quads(prepared)) {
            for channel in channels_of(prepared, quad).filter(|&channel| means[channel] > 0.0) {
                importances[channel % 4] = (scale / means[channel]) as f32;
            }
        }
        Thinning { scale, importances }
    }
}

/// The quads of channels that paths are tried in. Each is compiled, which takes long where records are instructions, and looked up for every
/// path: with four of them in Cornell's box trying a path cost half as much as evaluating it in 512 channels.
fn representative_quads(prepared: &Prepared) -> Vec<usize> {
    let quads = prepared.tables.channels_padded / 4;
    let count = quads.min(2);
    (0..count).map(|r| (2 * r + 1) * quads / (2 * count)).collect()
}

/// Channels in which every path is tried, those included that do not count.
pub fn tried_channels(prepared: &Prepared) -> usize {
    4 * representative_quads(prepared).len()
}

fn channels_of(prepared: &Prepared, quad: usize) -> impl Iterator<Item = usize> + use<> {
    let each = (REPRESENTATIVES / representative_quads(prepared).len()).min(4);
    let channels = prepared.channels;
    (0..each).map(move |i| 4 * quad + i * 4 / each).filter(move |&channel| channel < channels)
}

/// The channels that tell how much a path brings: eight at most, evenly among all that the device renders.
pub fn representatives(prepared: &Prepared) -> Vec<usize> {
    representative_quads(prepared).into_iter().flat_map(|quad| channels_of(prepared, quad)).collect()
}

pub const ROULETTE_ON_EVALUATION: Part = Part {
    name: "roulette on evaluation",
    used: |scene| scene.thinning.is_some(),
    effect: |scene| match &scene.thinning {
        Some(thinning) => format!(
            "a path that brings the mean is evaluated with {:.2}; 8 more bytes a path, tried in {} quads of channels",
            thinning.scale.min(1.0),
            thinning.importances.len()
        ),
        None => "8 more bytes a path, and a pass that tries paths in a few channels".into(),
    },
    is_planned: true,
    modules: &[(Place::Following, module!("parts/paths/seen.wgsl"))],
    lines: &[("BEYOND", "note_seen(&list);"), ("EMIT", "note_seen(&list);")],
    defines: |scene, work, defines| {
        defines.set("THINNED", true);
        if work == Work::Evaluate {
            let quads = representative_quads(scene).into_iter().enumerate();
            defines.lines("REPRESENTATIVE_QUADS", quads.map(|(v, quad)| format!("        let quad_{v} = {quad}u;")));
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
