//! What is known of a scene on a device before anything starts: parts used and left out, memory of the scene, how exact its tables are.

use serde_json::{Value, json};

use crate::device::part::{OnDevice, PARTS, Part};
use crate::device::prepared::Prepared;
use crate::files::format_bytes;
use crate::{Error, Result};

/// One part of the renderer, and whether this scene needs it.
#[derive(Debug, Clone, PartialEq)]
pub struct PartFact {
    pub name: &'static str,
    pub used: bool,
    /// What leaving it out saves, or what it costs.
    pub effect: String,
}

/// Every part that `plan` tells of, used or left out.
pub fn parts(scene: &OnDevice) -> Vec<PartFact> {
    let fact = |part: &&Part| PartFact { name: part.name, used: (part.used)(scene), effect: effect(part, scene) };
    PARTS.iter().filter(|part| part.is_planned).map(fact).collect()
}

fn effect(part: &Part, scene: &OnDevice) -> String {
    match (part.shader_lines(), (part.effect)(scene)) {
        (0, effect) => effect,
        (lines, effect) => format!("{lines} lines of shader, {effect}"),
    }
}

/// The whole table: what each part adds to kernels, buffers, records and path state, and whether this scene has it.
pub fn table(scene: &OnDevice) -> Vec<Value> {
    let row = |part: &&Part| {
        let used = (part.used)(scene);
        let modules: Vec<String> =
            part.modules.iter().map(|(place, module)| format!("{place:?}: {}", module.name)).collect();
        let buffers: Vec<Value> = match used {
            true => (part.buffers)(scene).iter().map(|b| json!({ "name": b.name, "bytes": b.bytes.len() })).collect(),
            false => Vec::new(),
        };
        let records = if used { (part.records)(scene) } else { Default::default() };
        json!({
            "name": part.name, "used": used, "modules": modules,
            "stages": part.lines.iter().map(|(place, _)| *place).collect::<Vec<_>>(), "buffers": buffers,
            "records": { "path": records.path, "way": records.way, "vertex": records.vertex },
            "state_words": part.state_words,
        })
    };
    PARTS.iter().map(row).collect()
}

/// What the scene takes on a device, bytes. `allocated`: what a buffer for so many takes.
pub fn scene_bytes(scene: &OnDevice, allocated: impl Fn(u64) -> u64) -> u64 {
    let buffers = scene.buffers();
    let sizes = buffers.iter().map(|buffer| buffer.bytes.len() as u64);
    sizes.chain([size_of_val(&scene.frame) as u64]).map(allocated).sum()
}

/// What the flattened scene takes on the host, bytes: as on devices, and the BVH, which these may not need.
pub fn host_bytes(scene: &OnDevice) -> u64 {
    let nodes = if scene.features.few_triangles { size_of_val(scene.accel.nodes.as_slice()) as u64 } else { 0 };
    nodes + scene.buffers().iter().map(|buffer| buffer.bytes.len() as u64).sum::<u64>()
}

/// Refuses what is not spread over windows and exceeds one binding of `most` bytes.
pub fn check_bindings(scene: &OnDevice, most: u64) -> Result<()> {
    match scene.buffers().iter().find(|buffer| buffer.bytes.len() as u64 > most) {
        None => Ok(()),
        Some(buffer) => Err(Error::Usage(format!(
            "{} take {} and this device binds at most {}: use {}",
            buffer.content,
            format_bytes(buffer.bytes.len() as u64),
            format_bytes(most),
            buffer.remedy
        ))),
    }
}

/// The spectra in use, and how exactly their tables hold them.
pub fn table_bounds(prepared: &Prepared) -> Value {
    let each = prepared.spectrum_names.iter().zip(&prepared.tables.bounds).skip(1);
    each.map(|(name, b)| json!({ "name": name, "pointwise": b.pointwise, "mean": b.mean })).collect()
}
