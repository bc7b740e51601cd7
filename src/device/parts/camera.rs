//! Cameras and filters: where a ray starts, and through which place of its pixel.

use crate::device::part::Part;

pub const THIN_LENS: Part = Part {
    name: "thin lens",
    used: |scene| scene.features.thin_lens,
    effect: |_| "a pair of random numbers a path".into(),
    is_planned: true,
    defines: |_, _, defines| _ = defines.set("CAMERA_THIN_LENS", true),
    ..Part::NOTHING
};

pub const ORTHOGRAPHIC: Part = Part {
    name: "orthographic camera",
    used: |scene| scene.features.orthographic,
    effect: |_| "its own camera rays".into(),
    is_planned: true,
    defines: |_, _, defines| _ = defines.set("CAMERA_ORTHOGRAPHIC", true),
    ..Part::NOTHING
};

pub const GAUSSIAN: Part = Part {
    name: "Gaussian filter",
    used: |scene| scene.features.gaussian,
    effect: |_| "an inverse error function a path".into(),
    is_planned: true,
    defines: |_, _, defines| _ = defines.set("GAUSSIAN", true),
    ..Part::NOTHING
};
