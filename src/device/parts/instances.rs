//! What is stored once and placed many times: a tree for each assembly below that of the world.

use crate::device::part::{Part, Place};
use crate::device::text::module;

pub const INSTANCES: Part = Part {
    name: "instances",
    used: |scene| scene.accel.instances > 0,
    effect: |scene| format!("{} of them: rays enter a second tree", scene.accel.instances),
    is_planned: true,
    modules: &[(Place::Shapes, module!("parts/instances/instances.wgsl"))],
    defines: |_, _, defines| _ = defines.set("INSTANCES", true),
    example: Some(|exhibit| exhibit.add_instances()),
    ..Part::NOTHING
};

pub const LIGHTS: Part = Part {
    name: "instances that emit",
    used: |scene| !scene.accel.luminous.is_empty(),
    effect: |scene| format!("{}: a light each, a table for each assembly", scene.accel.luminous.len()),
    is_planned: true,
    modules: &[
        (Place::Generate, module!("parts/instances/lights.wgsl")),
        (Place::Stage, module!("parts/instances/choose_placed.wgsl")),
    ],
    defines: |scene, _, defines| {
        defines.set("PLACED_LIGHTS", true);
        defines.constant("FIRST_LUMINOUS", scene.accel.emitters.len() as u32);
        defines.constant("LUMINOUS", scene.accel.luminous.len() as u32);
    },
    example: Some(|exhibit| exhibit.add_luminous_instances()),
    ..Part::NOTHING
};
