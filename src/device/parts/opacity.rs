//! Surfaces that let some rays pass as if they were not there.

use crate::device::part::{Part, Place};
use crate::device::parts::lights;
use crate::device::text::module;

pub const OPACITY: Part = Part {
    name: "opacity",
    used: |scene| scene.surfaces.as_ref().is_some_and(|surfaces| surfaces.masked),
    effect: |_| "ways to lights are walked from surface to surface".into(),
    is_planned: true,
    modules: &[
        (Place::Generate, module!("parts/opacity/opacity.wgsl")),
        (Place::Stage, module!("parts/opacity/way.wgsl")),
    ],
    lines: &[("LIGHT_WEIGHT", "begin_way(path.number, SALT_TO_LIGHT);")],
    defines: |scene, _, defines| {
        let textured = scene.surfaces.as_ref().is_some_and(|surfaces| surfaces.masks);
        defines.set("OPACITY", true).set("MASKS", textured).set("LONG_WAYS", true);
    },
    example: Some(|exhibit| exhibit.add_masks()),
    ..Part::NOTHING
};

/// That of surfaces that are aimed at.
pub const OF_LAMPS: Part = Part {
    name: "opacity of surfaces that shine",
    used: |scene| (OPACITY.used)(scene) && (lights::SURFACES.used)(scene),
    modules: &[
        (Place::Stage, module!("parts/lights/hit_on_emitter.wgsl")),
        (Place::Stage, module!("parts/opacity/aimed.wgsl")),
    ],
    lines: &[("AIMED_AT_SURFACE", "(*aim).strength *= opacity_aimed_at(emitter, point);")],
    ..Part::NOTHING
};

/// Its ways where nothing lies between surfaces.
pub const IN_VACUUM: Part = Part {
    name: "ways past surfaces that let rays pass",
    used: |scene| (OPACITY.used)(scene) && scene.media.is_none(),
    modules: &[(Place::Stage, module!("stages/meet/masked.wgsl"))],
    ..Part::NOTHING
};
