//! What surfaces carry beside their geometry: texture coordinates, shading normals, axes.

use crate::device::part::{Part, Place, SceneBuffer};
use crate::device::text::module;
use crate::files::format_bytes;

pub const ATTRIBUTES: Part = Part {
    name: "texture coordinates and normals",
    used: |scene| scene.surfaces.as_ref().is_some_and(|surfaces| surfaces.attributes),
    effect: |scene| format_bytes(size_of_val(scene.accel.attributes.as_slice()) as u64),
    is_planned: true,
    modules: &[
        (Place::Generate, module!("common/turn.wgsl")),
        (Place::Generate, module!("parts/attributes/attributes.wgsl")),
    ],
    defines: |_, _, defines| _ = defines.set("ATTRIBUTES", true),
    buffers: |scene| {
        let content = "the texture coordinates and normals of the scene";
        vec![SceneBuffer::new("attributes", &scene.prepared.accel.attributes, content, "fewer triangles")]
    },
    example: Some(|exhibit| exhibit.add_turned_ball()),
    ..Part::NOTHING
};

pub const SMOOTH: Part = Part {
    name: "shading normals",
    used: |scene| scene.surfaces.as_ref().is_some_and(|surfaces| surfaces.smooth),
    modules: &[(Place::Stage, module!("parts/attributes/smooth.wgsl"))],
    lines: &[
        ("CHOSEN", "let along_face = dot(to_world(v, choice.direction), site.face);"),
        ("CHOSEN", "choice.goes_on = choice.goes_on && keeps_side(site, along_face, choice.direction.z);"),
        ("LIGHT_SIDE", "is_kept = keeps_side(site, side, dot(v.normal, aim.towards));"),
        ("MET_COSINE", "cosine = v.o.z;"),
        (
            "AIMED_COSINE",
            "if ((*aim).density > 0.0) { cosine = emitting_vertex(emitter, point, -normalize((*aim).towards)).o.z; }",
        ),
    ],
    defines: |_, _, defines| _ = defines.set("SMOOTH", true),
    example: Some(|exhibit| exhibit.add_smooth_triangle()),
    ..Part::NOTHING
};
