//! Factored renders of scenes that separate in part: what does not is evaluated in channels.

use crate::device::part::{Part, Place, SceneBuffer};
use crate::device::parts::spectra::{CONTENT, REMEDY};
use crate::device::text::module;

pub const REMAINDER: Part = Part {
    name: "remainder of weights",
    used: |scene| scene.has_remainder(),
    effect: |_| "paths are evaluated from the first surface or matter on that does not separate".into(),
    is_planned: true,
    modules: &[(Place::Evaluate, module!("parts/remainder/separates.wgsl"))],
    defines: |_, _, defines| _ = defines.set("REMAINDER", true),
    buffers: |scene| match &scene.prepared.separable {
        Some(separable) => vec![SceneBuffer::new("separates", &separable.bits, CONTENT, REMEDY)],
        None => Vec::new(),
    },
    ..Part::NOTHING
};
