//! What rays meet, and how it is found.

use crate::device::part::{OnDevice, Part, Place, Records, SceneBuffer};
use crate::device::text::{Defines, module};
use crate::device::windows::WindowList;
use crate::device::words::Primitive;

use super::spectra::{CONTENT as SPECTRA, REMEDY as FEWER_SPECTRA};

/// Triangles up to which rays test them all. Measured on lavapipe: generating a path of the Cornell box, with 32 of them, takes 0.4 to
/// 0.5 of the time that it takes with the BVH; kernels grow with every one.
const FEW_TRIANGLES: usize = 48;

/// What every scene has.
pub const SCENE: Part = Part {
    name: "scene",
    defines: |scene, _, defines| {
        window_defines(
            ["PRIMITIVE_WINDOWS", "MANY_PRIMITIVE_WINDOWS", "PRIMITIVE_WINDOW"],
            scene.windows.primitives,
            defines,
        );
        // Roulette on evaluation adds what it leaves of a path.
        defines.set("HEAD_WORDS", if scene.thinning.is_some() { 4u32 } else { 2 });
    },
    buffers: |scene| {
        let prepared = scene.prepared;
        let emitting = ["the emitting triangles of the scene", "a coarser mesh where it emits"];
        let mut buffers = vec![
            SceneBuffer::new("emitters", &prepared.emitters, emitting[0], emitting[1]),
            SceneBuffer::new("spectra", &prepared.tables.strata, SPECTRA, FEWER_SPECTRA),
        ];
        if !prepared.is_general() {
            buffers.push(SceneBuffer::new("materials", &prepared.materials, MATERIALS, FEWER_MATERIALS));
        }
        buffers.extend(in_windows("primitives", &prepared.accel.primitives, scene.windows.primitives));
        buffers
    },
    records: |scene| Records {
        // Where a path leaves the scene, if nothing in it emits.
        path: u32::from(!scene.features.emitters),
        vertex: u32::from(!scene.is_general()),
        way: 0,
    },
    ..Part::NOTHING
};

pub const MATERIALS: &str = "the materials of the scene";
pub const FEWER_MATERIALS: &str = "fewer of them";

pub const BVH: Part = Part {
    name: "BVH",
    used: |scene| !scene.features.few_triangles,
    effect: |scene| match scene.features.few_triangles {
        true => format!("every ray tests all {} triangles, constants of its kernel", scene.accel.primitives.len()),
        false => format!("{} nodes, a stack of {} a ray", scene.accel.node_count, scene.accel.depth),
    },
    is_planned: true,
    modules: &[(Place::Traversal, module!("parts/geometry/bvh.wgsl"))],
    defines: |scene, _, defines| {
        defines.set("STACK_SIZE", scene.accel.depth);
        window_defines(["NODE_WINDOWS", "MANY_NODE_WINDOWS", "NODE_WINDOW"], scene.windows.nodes, defines);
    },
    buffers: |scene| in_windows("nodes", &scene.prepared.accel.nodes, scene.windows.nodes).collect(),
    ..Part::NOTHING
};

/// In the place of the BVH.
pub const FEW: Part = Part {
    name: "few triangles",
    used: |scene| scene.features.few_triangles,
    modules: &[(Place::Traversal, module!("parts/geometry/few_triangles.wgsl"))],
    defines: |scene, _, defines| _ = defines.lines("TRIANGLES", triangle_lines(scene)),
    ..Part::NOTHING
};

pub const SHAPES: Part = Part {
    name: "spheres, disks, cylinders",
    used: |scene| scene.features.shapes,
    effect: |_| "a test per primitive".into(),
    is_planned: true,
    modules: &[(Place::Shapes, module!("parts/geometry/shapes.wgsl"))],
    defines: |_, _, defines| _ = defines.set("SHAPES", true),
    example: Some(|exhibit| exhibit.add_black_ball()),
    ..Part::NOTHING
};

pub const WINDOWS: Part = Part {
    name: "windowed geometry",
    used: |scene| scene.windows.are_many(),
    effect: |_| "a switch per load".into(),
    is_planned: true,
    ..Part::NOTHING
};

/// Whether these triangles may be constants of a shader, whose text has no subnormal numbers.
pub fn are_few(triangles: &[Primitive]) -> bool {
    let plain = |v: &f32| *v == 0.0 || v.is_normal();
    (1..=FEW_TRIANGLES).contains(&triangles.len())
        && triangles.iter().all(|p| [p.a, p.b, p.c].as_flattened().iter().all(plain))
}

/// A test of each of a few triangles, which are constants of the shader: the shortest decimals that are these f32 and no others.
fn triangle_lines(scene: &OnDevice) -> Vec<String> {
    let vertex = |[x, y, z]: [f32; 3]| format!("vec3<f32>({x:?}f, {y:?}f, {z:?}f)");
    let test = |(i, p): (usize, &Primitive)| {
        format!("    hit = nearer(ray_sheared, hit, {i}u, {}, {}, {});", vertex(p.a), vertex(p.b), vertex(p.c))
    };
    scene.accel.primitives.iter().enumerate().map(test).collect()
}

fn window_defines([count, many, size]: [&'static str; 3], list: WindowList, defines: &mut Defines) {
    defines.set(count, list.count);
    if list.count > 1 {
        defines.set(many, true).constant(size, list.size);
    }
}

/// A buffer for each window.
fn in_windows<'a, T: bytemuck::NoUninit>(
    name: &'static str,
    elements: &'a [T],
    list: WindowList,
) -> impl Iterator<Item = SceneBuffer<'a>> {
    let ranges = list.ranges(elements.len()).enumerate();
    ranges.map(move |(i, range)| {
        SceneBuffer::new(&format!("{name}_{i}"), &elements[range], "the geometry of the scene", "fewer triangles")
    })
}
