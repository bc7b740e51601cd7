//! Scenes of Mitsuba 3, in XML.

mod bsdf;
mod colour;
mod emitter;
mod medium;
mod principled;
mod sensor;
mod serialized;
mod shape;
mod values;
mod xml;

use std::collections::HashMap;
use std::path::Path;

use glam::DAffine3;

use self::values::{Plugin, place};
use self::xml::Node;
use super::MOST_BOUNCES;
use super::report::Deviation;
use super::scene::{Scene, Section};
use super::text;
use crate::error::Problem;
use crate::{Error, Result};

/// Shapes that instances may become where they are copies.
const MOST_COPIES: usize = 10_000;

/// What is known while a scene is translated.
struct Importer<'n, 's> {
    scene: &'s mut Scene,
    /// By their `id`.
    objects: HashMap<&'n str, &'n Node>,
    /// Names of BSDFs that are materials already, by their element and whether v runs down.
    materials: HashMap<(*const Node, bool), bsdf::Made>,
    /// Media that are in the scene already; `None`: those that are left out.
    media: HashMap<*const Node, Option<String>>,
    /// Groups that are assemblies already; `None`: those that have others in them are not.
    groups: HashMap<*const Node, Option<usize>>,
    /// Copies so far.
    copies: usize,
}

/// Translates the scene in the file `source`.
pub fn read(source: &Path, scene: &mut Scene) -> Result<()> {
    let root = xml::Files::default().read(source)?;
    let mut objects = HashMap::new();
    collect(&root, &mut objects)?;
    let mut importer = Importer {
        scene,
        objects,
        materials: HashMap::new(),
        media: HashMap::new(),
        groups: HashMap::new(),
        copies: 0,
    };
    importer.scene(&root)
}

/// All elements with an `id`, and aliases.
fn collect<'n>(node: &'n Node, objects: &mut HashMap<&'n str, &'n Node>) -> std::result::Result<(), Box<Problem>> {
    for child in &node.children {
        if child.tag == "alias" {
            let (id, name) = (child.attribute("id").unwrap_or(""), child.attribute("as").unwrap_or(""));
            let meant = objects.get(id).copied();
            objects.insert(name, meant.ok_or_else(|| child.problem(format!("`{}` is no object", values::shown(id))))?);
            continue;
        }
        if let Some(id) = child.attribute("id").filter(|_| child.tag != "ref")
            && let Some(before) = objects.insert(id, child)
        {
            let message = format!("`{}` is the id of another object too, on line {}", values::shown(id), before.line);
            return Err(child.problem(message));
        }
        collect(child, objects)?;
    }
    Ok(())
}

impl<'n> Importer<'n, '_> {
    fn scene(&mut self, root: &'n Node) -> Result<()> {
        let plugin = Plugin::new(root);
        let sensors = plugin.objects(&["sensor"]);
        match sensors.split_first() {
            Some((first, others)) => {
                self.sensor(first)?;
                for other in others {
                    self.scene.report.left_out(
                        place(other),
                        "sensors after the first: `--set camera…` or a copy of the scene has them",
                    );
                }
            }
            None => self.default_sensor(),
        }
        self.integrator(&plugin.objects(&["integrator"]))?;
        for emitter in plugin.objects(&["emitter"]) {
            self.emitter(emitter)?;
        }
        for shape in plugin.objects(&["shape"]) {
            self.shape(shape, &DAffine3::IDENTITY, None)?;
        }
        // What stands there to be referred to is translated where it is.
        plugin.objects(&["bsdf", "texture", "spectrum", "default", "alias", "medium"]);
        plugin.finish(&mut self.scene.report);
        Ok(())
    }

    /// The element itself, or the one that a `ref` means.
    fn resolve(&self, node: &'n Node) -> std::result::Result<&'n Node, Box<Problem>> {
        if node.tag != "ref" {
            return Ok(node);
        }
        let id = node.attribute("id").unwrap_or("");
        self.objects
            .get(id)
            .copied()
            .ok_or_else(|| node.problem(format!("no object has the id `{}`", values::shown(id))))
    }

    fn integrator(&mut self, nodes: &[&'n Node]) -> Result<()> {
        let mut section = Section::new("[integrator]");
        let Some(node) = nodes.first() else {
            self.scene
                .report
                .chosen(None, "32 bounces at most, as the scene has no integrator (`integrator.max_bounces`)");
            self.scene.integrator = Some(section.with("max_bounces", "32").with("russian_roulette_start", "5"));
            return Ok(());
        };
        let mut plugin = Plugin::new(node);
        // Some only count what others render.
        while ["moment", "aov", "multichannel", "stokes"].contains(&plugin.kind()) {
            let Some(inner) = plugin.objects(&["integrator"]).first().copied() else { break };
            self.scene
                .report
                .left_out(plugin.place(), format!("the integrator `{}`: what it renders is", plugin.kind()));
            plugin = Plugin::new(inner);
        }
        let depth = plugin.whole("max_depth")?;
        let roulette = plugin.whole("rr_depth")?;
        match plugin.kind() {
            "path" | "volpath" | "volpathmis" | "prb" | "prb_basic" | "prbvolpath" => {}
            "direct" => section = section.comment("direct light only"),
            other => {
                let what = format!("the integrator `{}` as a path tracer", values::shown(other));
                let off = Deviation::unbounded("light that only one of the two counts, and its noise");
                self.scene.report.approximated(plugin.place(), what, off);
            }
        }
        let hides = plugin.boolean("hide_emitters", false)?;
        if hides {
            self.scene.report.left_out(plugin.place(), "`hide_emitters`: lamps are seen");
        }
        let bounces = match (plugin.kind(), depth) {
            ("direct", _) => 1,
            (_, Some(depth)) if depth >= 0 => {
                self.scene.report.within(plugin.place(), "`max_depth`", depth as f64, [1.0, MOST_BOUNCES + 1.0]) as i64
                    - 1
            }
            _ => {
                self.scene
                    .report
                    .chosen(None, "32 bounces at most and Russian roulette from the fifth, in the place of no limit");
                32
            }
        };
        section.set("max_bounces", bounces.to_string());
        if bounces >= 32 {
            // Mitsuba's counts segments, and begins at 5 unless told otherwise.
            let start = roulette.unwrap_or(5) as f64;
            let start = self.scene.report.within(plugin.place(), "`rr_depth`", start, [1.0, MOST_BOUNCES]);
            section.set("russian_roulette_start", start.to_string());
        }
        plugin.finish(&mut self.scene.report);
        self.scene.report.translated(format!("integrator `{}`", values::shown(plugin.kind())), plugin.place());
        self.scene.integrator = Some(section);
        Ok(())
    }

    /// The name of a thing, for its material and files: its id, or what it is.
    fn name_of(&self, node: &Node) -> String {
        let name = node.attribute("id").or(node.attribute("type")).unwrap_or(&node.tag);
        name.chars().take(60).collect()
    }
}

/// A file that cannot be read, at the place where it is named.
fn at(node: &Node, problem: &Problem) -> Error {
    let file = text::file_name(&problem.file.file_name().unwrap_or_default().to_string_lossy());
    let line = problem.line.map_or_else(String::new, |line| format!(":{line}"));
    node.problem(format!("{file}{line}: {}", problem.message)).into()
}
