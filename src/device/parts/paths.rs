//! How paths are followed: where their random numbers come from, and when they end.

use crate::device::part::{Part, Place};
use crate::device::text::module;

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
