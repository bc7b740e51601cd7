//! How spectra reach the channels: where in them wavelengths are drawn, and how tables are held.

use crate::device::part::{Part, Place, SceneBuffer, Work};
use crate::device::text::module;
use crate::scene::Evaluator;

pub const STRATA: Part = Part {
    name: "wavelength strata",
    used: |scene| scene.features.strata,
    effect: |scene| format!("tables x {}", 1u64 << scene.tables.stratum_bits),
    is_planned: true,
    defines: |_, _, defines| _ = defines.set("STRATA", true),
    ..Part::NOTHING
};

pub const SEVERAL: Part = Part {
    name: "several wavelengths a channel",
    used: |scene| scene.wavelengths_per_channel > 1,
    effect: |scene| format!("every path is evaluated at {}", scene.wavelengths_per_channel),
    is_planned: true,
    defines: |scene, work, defines| {
        let count = scene.wavelengths_per_channel;
        match work {
            // No constant: kernels that know nothing of it stay what they are.
            Work::Generate => _ = defines.set("WAVELENGTH_BITS", count.ilog2()),
            Work::Evaluate => {
                defines.constant("WAVELENGTHS", count);
                // As far apart as the whole of μ, 2^32, allows.
                defines.constant("WAVELENGTH_STEP", (u32::MAX / count) + 1);
            }
        }
    },
    ..Part::NOTHING
};

pub const WARP: Part = Part {
    name: "wavelengths by emission",
    used: |scene| scene.warp.bits() > 0,
    effect: |scene| format!("drawn from {} strata a channel, a weight a path and channel", 1u64 << scene.warp.bits()),
    is_planned: true,
    ..Part::NOTHING
};

pub const RESPONSES: Part = Part {
    name: "responses",
    used: |scene| scene.integration.is_some(),
    effect: |scene| match &scene.integration {
        Some(integration) => format!("{} strata of wavelength", integration.inner.len()),
        None => "weights of wavelengths, and sums of channels".into(),
    },
    is_planned: true,
    ..Part::NOTHING
};

pub const KNOTS: Part = Part {
    name: "exact spectral knots",
    used: |scene| scene.features.knots,
    effect: |_| "a search per lookup and four channels".into(),
    is_planned: true,
    modules: &[(Place::Evaluate, KNOT_VALUES)],
    defines: |scene, _, defines| {
        let knots = &scene.tables.knots;
        defines.set("KNOTS", true).set("KNOT_STEPS", knots.steps());
        defines.constant("FIRST_KNOT_PLACE", knots.first_place() as u32);
    },
    buffers: |scene| {
        let tables = &scene.prepared.tables;
        vec![
            SceneBuffer::new("knot_places", &tables.knots.places, CONTENT, REMEDY),
            SceneBuffer::new("knot_values", &tables.knots.values, CONTENT, REMEDY),
        ]
    },
    example: Some(|exhibit| exhibit.add_spiky_paint()),
    ..Part::NOTHING
};

/// Also what generating paths reads knots by, where dispersion leaves one channel.
pub const KNOT_VALUES: crate::device::text::Module = module!("parts/spectra/knots.wgsl");

/// What spectral tables are of the scene, and what there must be less of where they exceed a binding.
pub const CONTENT: &str = "the spectra of the scene";
pub const REMEDY: &str = "fewer channels or fewer spectra";

pub const REGISTERS: Part = Part {
    name: "spectra in registers",
    used: |scene| scene.features.registers,
    effect: |scene| match (scene.factors + scene.sources, scene.tables.kinks) {
        (spectra, 0) => format!("no table lookups per vertex; {spectra} spectra here"),
        (spectra, kinks) => format!("no table lookups per vertex; {spectra} spectra, up to {kinks} kinks in a channel"),
    },
    is_planned: true,
    defines: |_, _, defines| _ = defines.set("REGISTERS", true),
    ..Part::NOTHING
};

/// Sizes of the tables, for those kernels that read them.
pub const LAYOUT: Part = Part {
    name: "spectral tables",
    defines: |scene, work, defines| {
        if work == Work::Generate && !scene.disperses() {
            return;
        }
        let tables = &scene.tables;
        if work == Work::Evaluate {
            defines.set("FACTORS", scene.factors as u32).set("SOURCES", scene.sources as u32);
            defines.set("HELD", (scene.factors + scene.sources) as u32);
            defines.constant("FIRST_SOURCE", 1 + scene.factors as u32);
            if let Some(weight) = scene.path_weight {
                defines.set("WEIGHTED", true).constant("PATH_WEIGHT", weight);
            }
        }
        if tables.kinks > 0 {
            defines.constant("KINKS", tables.kinks);
        }
        defines.constant("SPECTRA", tables.stratified as u32);
        defines.constant("CHANNELS", scene.channels as u32);
        defines.constant("CHANNELS_PADDED", tables.channels_padded as u32);
        defines.constant("QUADS", tables.channels_padded as u32 / 4);
    },
    ..Part::NOTHING
};

/// Paths of the conventional path tracer are evaluated before their next bounce.
pub const BOUNCE_BY_BOUNCE: Part = Part {
    name: "evaluation after every bounce",
    used: |scene| scene.evaluator == Evaluator::Pt,
    defines: |_, _, defines| _ = defines.set("BOUNCE_BY_BOUNCE", true),
    ..Part::NOTHING
};
