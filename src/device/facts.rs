//! What is known of a scene on a device before anything starts: parts used and left out, memory of the scene, how exact its tables are.

use serde_json::{Value, json};

use crate::device::part::{OnDevice, PARTS, Part, Records};
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

/// A row of [`PARTS`] as it is for a scene.
pub struct PartRow {
    name: &'static str,
    used: bool,
    modules: Vec<&'static str>,
    /// Where it adds to the kernel that generates paths of general scenes.
    stages: Vec<&'static str>,
    /// Names and bytes; none where it is not used.
    buffers: Vec<(String, usize)>,
    records: Records,
    state_words: u32,
}

/// The whole table: what each part adds to kernels, buffers, records and path state, and whether this scene has it.
pub fn table(scene: &OnDevice) -> Vec<PartRow> {
    let row = |part: &&Part| {
        let used = (part.used)(scene);
        let buffers = if used { (part.buffers)(scene) } else { Vec::new() };
        let (mut modules, mut stages): (Vec<_>, Vec<_>) = (
            part.modules.iter().map(|(_, module)| module.name).collect(),
            part.lines.iter().map(|(at, _)| *at).collect(),
        );
        modules.dedup();
        stages.dedup();
        PartRow {
            name: part.name,
            used,
            modules,
            stages,
            buffers: buffers.into_iter().map(|buffer| (buffer.name, buffer.bytes.len())).collect(),
            records: if used { (part.records)(scene) } else { Records::NONE },
            state_words: if used { (part.state_words)(scene) } else { 0 },
        }
    };
    PARTS.iter().map(row).collect()
}

impl PartRow {
    pub fn json(&self) -> Value {
        let buffers = self.buffers.iter().map(|(name, bytes)| json!({ "name": name, "bytes": bytes }));
        let Records { path, way, vertex } = self.records;
        json!({
            "name": self.name, "used": self.used, "modules": self.modules, "stages": self.stages,
            "buffers": buffers.collect::<Vec<_>>(), "records": { "path": path, "way": way, "vertex": vertex },
            "state_words": self.state_words,
        })
    }

    /// For the terminal.
    pub fn line(&self) -> String {
        let buffers = self.buffers.iter().map(|(name, bytes)| format!("{name} {}", format_bytes(*bytes as u64)));
        let Records { path, way, vertex } = self.records;
        let all = [
            self.modules.join(", "),
            self.stages.join(", "),
            buffers.collect::<Vec<_>>().join(", "),
            if self.records == Records::NONE {
                String::new()
            } else {
                format!("{path} + {way} a way + {vertex} a vertex")
            },
            if self.state_words == 0 { String::new() } else { format!("{} words", self.state_words) },
        ];
        let all: Vec<String> = all.into_iter().filter(|text| !text.is_empty()).collect();
        format!("{:9} {}: {}\n", if self.used { "      yes" } else { "       no" }, self.name, all.join("; "))
    }
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
