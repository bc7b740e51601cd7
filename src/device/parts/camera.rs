//! Cameras and filters: where a ray starts, and through which place of its pixel.

use crate::device::part::{Part, SceneBuffer, Work};

pub const THIN_LENS: Part = Part {
    name: "thin lens",
    used: |scene| scene.features.thin_lens,
    effect: |_| "a pair of random numbers a path".into(),
    is_planned: true,
    defines: |_, _, defines| _ = defines.set("CAMERA_THIN_LENS", true),
    ..Part::NOTHING
};

pub const DISTORTION: Part = Part {
    name: "lens distortion",
    used: |scene| scene.distortion.is_some(),
    effect: |_| "undone for each path, in some steps".into(),
    is_planned: true,
    defines: |scene, work, defines| {
        if let (Some(numbers), Work::Generate) = (scene.distortion, work) {
            defines.set("DISTORTION", true);
            // Words, since constants are whole numbers.
            for (name, number) in ["LENS_K1", "LENS_K2", "LENS_K3", "LENS_P1", "LENS_P2"].into_iter().zip(numbers) {
                defines.constant(name, number.to_bits());
            }
        }
    },
    example: Some(|exhibit| exhibit.distort()),
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

pub const PUSHBROOM: Part = Part {
    name: "line scanner",
    used: |scene| scene.features.pushbroom,
    effect: |scene| format!("where it is, of {} lines", scene.lines.len()),
    is_planned: true,
    defines: |scene, work, defines| {
        defines.set("CAMERA_PUSHBROOM", true);
        if work == Work::Generate {
            defines.constant("LINES", scene.lines.len() as u32);
        }
    },
    buffers: |scene| vec![SceneBuffer::new("lines", &scene.prepared.lines, "lines of the scanner", "fewer rows")],
    ..Part::NOTHING
};

pub const LATLONG: Part = Part {
    name: "latlong camera",
    used: |scene| scene.features.latlong,
    effect: |_| "its own camera rays".into(),
    is_planned: true,
    defines: |_, _, defines| _ = defines.set("CAMERA_LATLONG", true),
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
