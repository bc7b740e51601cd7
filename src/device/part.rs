//! The parts of the renderer that a scene may need: one table, [`PARTS`], with a row for everything that a part adds on a device.
//! Who must know all parts (composition, upload, budgets, `plan`, tests, `bench`, the scene with everything) goes through it.

use std::ops::Deref;

use crate::device::example::Exhibit;
use crate::device::parts::{
    attributes, by_technique, camera, geometry, heat, instances, layers, lights, media, opacity, paths, remainder,
    roughness, scattering, sky, spectra, surfaces, techniques, textures,
};
use crate::device::prepared::Prepared;
use crate::device::text::{Defines, Module};
use crate::device::windows::Windows;

/// A row: what a part of the renderer is, and all that it adds where a scene needs it.
#[derive(Clone, Copy)]
pub struct Part {
    /// What `plan` calls it.
    pub name: &'static str,
    pub used: fn(&OnDevice) -> bool,
    /// What it costs, or what leaving it out saves, beside the lines of its modules.
    pub effect: fn(&OnDevice) -> String,
    /// Whether `plan` says so: not of what only goes with another part.
    pub is_planned: bool,
    /// WGSL files, and where in which kernel they stand.
    pub modules: &'static [(Place, Module)],
    /// Lines for `#lines NAME` in the kernels' own files: calls of what the modules define.
    pub lines: &'static [(&'static str, &'static str)],
    /// Switches, counts and constants.
    pub defines: fn(&OnDevice, Work, &mut Defines),
    /// Storage buffers.
    pub buffers: for<'a> fn(&OnDevice<'a>) -> Vec<SceneBuffer<'a>>,
    /// Records that it may take.
    pub records: fn(&OnDevice) -> Records,
    /// Words of a path's state between two bounces.
    pub state_words: fn(&OnDevice) -> u32,
    /// Adds something to a scene that needs this part; `None` where it is a matter of settings, or in every scene.
    pub example: Option<fn(&mut Exhibit)>,
}

/// Every part, in the order in which `plan` tells of them and texts are composed.
pub const PARTS: &[&Part] = &[
    &geometry::SCENE,
    &lights::AREA_LIGHTS,
    &sky::UNIFORM,
    &geometry::BVH,
    &geometry::FEW,
    &geometry::SHAPES,
    &instances::INSTANCES,
    &instances::LIGHTS,
    &lights::NEXT_EVENT,
    &camera::THIN_LENS,
    &camera::DISTORTION,
    &camera::ORTHOGRAPHIC,
    &camera::LATLONG,
    &camera::PUSHBROOM,
    &camera::GAUSSIAN,
    &paths::ROULETTE,
    &paths::SOBOL,
    &spectra::STRATA,
    &spectra::SEVERAL,
    &spectra::WARP,
    &spectra::RESPONSES,
    &spectra::KNOTS,
    &spectra::REGISTERS,
    &surfaces::LOBES,
    &surfaces::TRANSMISSION,
    &surfaces::BRUSHED,
    &surfaces::TABLES_IN_EVALUATION,
    &textures::TEXTURES,
    &roughness::ROUGHNESS,
    &attributes::ATTRIBUTES,
    &attributes::SMOOTH,
    &lights::AIMS,
    &sky::MAP,
    &lights::LAMPS,
    &lights::SPOTS,
    &lights::SUNS,
    &lights::SURFACES,
    &heat::BY_ANGLE,
    &heat::BY_PLACE,
    &heat::EITHER,
    &media::MEDIA,
    &media::VACUUM,
    &opacity::OPACITY,
    &opacity::OF_LAMPS,
    &opacity::IN_VACUUM,
    &media::CAMERA_CUT,
    &media::VOXELS,
    &media::PLACED,
    &media::PLANCK,
    &scattering::SCATTERING,
    &techniques::TECHNIQUES,
    &by_technique::LOBES,
    &by_technique::BOUNDARIES,
    &scattering::FORCED,
    &scattering::TABLES,
    &surfaces::DISPERSION,
    &surfaces::KNOTS_OF_ONE_CHANNEL,
    &paths::ROULETTE_ON_EVALUATION,
    &remainder::REMAINDER,
    &geometry::WINDOWS,
    &spectra::BOUNCE_BY_BOUNCE,
    &spectra::LAYOUT,
    &layers::FIRST_HITS,
];

impl Part {
    /// A row that adds nothing, from which others begin.
    pub const NOTHING: Part = Part {
        name: "",
        used: |_| true,
        effect: |_| String::new(),
        is_planned: false,
        modules: &[],
        lines: &[],
        defines: |_, _, _| (),
        buffers: |_| Vec::new(),
        records: |_| Records::NONE,
        state_words: |_| 0,
        example: None,
    };

    /// Lines of WGSL that its modules have.
    pub fn shader_lines(&self) -> usize {
        let mut seen = Vec::new();
        for (_, module) in self.modules {
            if !seen.iter().any(|(name, _)| *name == module.name) {
                seen.push((module.name, module.text.lines().count()));
            }
        }
        seen.iter().map(|(_, lines)| lines).sum()
    }
}

/// A scene and how it is spread over the bindings of a device.
#[derive(Clone, Copy)]
pub struct OnDevice<'a> {
    pub prepared: &'a Prepared,
    pub windows: Windows,
}

impl Deref for OnDevice<'_> {
    type Target = Prepared;

    fn deref(&self) -> &Prepared {
        self.prepared
    }
}

impl<'a> OnDevice<'a> {
    /// The parts that this scene needs.
    pub fn parts(&self) -> impl Iterator<Item = &'static Part> + use<'_, 'a> {
        PARTS.iter().copied().filter(|part| (part.used)(self))
    }

    /// The scene's storage buffers.
    pub fn buffers(&self) -> Vec<SceneBuffer<'a>> {
        self.parts().flat_map(|part| (part.buffers)(self)).collect()
    }
}

/// What kernels do: they generate paths, or evaluate them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Work {
    Generate,
    Evaluate,
}

/// Where the modules of parts stand among those that every kernel of a kind has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// What a ray may meet, and how that is found.
    Shapes,
    Traversal,
    /// All else that generating paths needs, and what one stage of that does.
    Generate,
    /// What needs the records that such kernels save.
    Following,
    Stage,
    Evaluate,
}

/// A storage buffer of the scene.
#[derive(Debug, Clone)]
pub struct SceneBuffer<'a> {
    /// Its variable in WGSL.
    pub name: String,
    pub bytes: &'a [u8],
    /// What of the scene it holds, and what there must be less of where that exceeds a binding.
    pub content: &'static str,
    pub remedy: &'static str,
}

impl<'a> SceneBuffer<'a> {
    pub fn new<T: bytemuck::NoUninit>(
        name: &str,
        elements: &'a [T],
        content: &'static str,
        remedy: &'static str,
    ) -> SceneBuffer<'a> {
        SceneBuffer { name: name.to_owned(), bytes: bytemuck::cast_slice(elements), content, remedy }
    }
}

/// The most records that a path may take for something: once, on each of its ways (one more than scattering events), and at each
/// scattering event.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Records {
    pub path: u32,
    pub way: u32,
    pub vertex: u32,
}

impl Records {
    pub const NONE: Records = Records { path: 0, way: 0, vertex: 0 };

    /// Of a path of `bounces` scattering events.
    pub fn of(self, bounces: u32) -> u32 {
        let ways = bounces.saturating_add(1).saturating_mul(self.way);
        self.path.saturating_add(ways).saturating_add(bounces.saturating_mul(self.vertex))
    }
}

impl std::iter::Sum for Records {
    fn sum<I: Iterator<Item = Records>>(all: I) -> Records {
        all.fold(Records::NONE, |a, b| Records {
            path: a.path.saturating_add(b.path),
            way: a.way.saturating_add(b.way),
            vertex: a.vertex.saturating_add(b.vertex),
        })
    }
}
