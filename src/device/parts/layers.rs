//! Layers (`render --layers`): what the first surface behind each pixel is.

use crate::device::part::Part;

pub const FIRST_HITS: Part = Part {
    name: "layers",
    used: |scene| scene.first_hits,
    effect: |_| "a kernel of its own, some rays a pixel before the first sample".into(),
    is_planned: true,
    example: Some(|exhibit| exhibit.ask_for_layers()),
    ..Part::NOTHING
};
