//! The parameters of a plugin, by name; what nobody asks for is left out, and said.

use std::cell::RefCell;

use glam::{DAffine3, DMat3, DVec3};

use super::xml::Node;
use crate::error::Problem;
use crate::import::report::{Place, Report};

type Read<T> = Result<T, Box<Problem>>;

/// A plugin: an element with a `type` and what stands in it.
pub struct Plugin<'n> {
    pub node: &'n Node,
    asked: RefCell<Vec<bool>>,
}

/// Elements that are objects rather than parameters.
const OBJECTS: [&str; 14] = [
    "bsdf",
    "texture",
    "emitter",
    "shape",
    "sensor",
    "film",
    "sampler",
    "rfilter",
    "integrator",
    "medium",
    "phase",
    "volume",
    "ref",
    "spectrum",
];

impl<'n> Plugin<'n> {
    pub fn new(node: &'n Node) -> Plugin<'n> {
        Plugin { node, asked: RefCell::new(vec![false; node.children.len()]) }
    }

    /// Its `type`.
    pub fn kind(&self) -> &'n str {
        self.node.attribute("type").unwrap_or("")
    }

    pub fn place(&self) -> Place {
        place(self.node)
    }

    fn find(&self, wanted: impl Fn(&Node) -> bool) -> Option<&'n Node> {
        let index = self.node.children.iter().position(wanted)?;
        self.asked.borrow_mut()[index] = true;
        Some(&self.node.children[index])
    }

    /// The parameter of this name, whatever it is.
    pub fn get(&self, name: &str) -> Option<&'n Node> {
        self.find(|child| child.attribute("name") == Some(name))
    }

    /// All elements with one of these tags that have not been asked for.
    pub fn objects(&self, tags: &[&str]) -> Vec<&'n Node> {
        let mut asked = self.asked.borrow_mut();
        let all = self.node.children.iter().enumerate();
        all.filter(|(index, child)| {
            let is_wanted = !asked[*index] && tags.contains(&child.tag.as_str());
            asked[*index] |= is_wanted;
            is_wanted
        })
        .map(|(_, child)| child)
        .collect()
    }

    pub fn float(&self, name: &str) -> Read<Option<f64>> {
        let Some(node) = self.get(name) else { return Ok(None) };
        let value = value(node)?;
        let number = value.trim().parse::<f64>().ok().filter(|x| x.is_finite());
        number.map(Some).ok_or_else(|| node.problem(format!("`{name}` must be a number, but is `{}`", shown(value))))
    }

    pub fn whole(&self, name: &str) -> Read<Option<i64>> {
        let Some(number) = self.float(name)? else { return Ok(None) };
        if number.fract() != 0.0 || number.abs() > 1e9 {
            return Err(self.node.problem(format!("`{name}` must be a whole number, but is {number}")));
        }
        Ok(Some(number as i64))
    }

    pub fn boolean(&self, name: &str, default: bool) -> Read<bool> {
        let Some(node) = self.get(name) else { return Ok(default) };
        match value(node)?.trim().to_ascii_lowercase().as_str() {
            "true" => Ok(true),
            "false" => Ok(false),
            other => Err(node.problem(format!("`{name}` must be true or false, but is `{}`", shown(other)))),
        }
    }

    pub fn string(&self, name: &str) -> Read<Option<&'n str>> {
        self.get(name).map(value).transpose()
    }

    pub fn vector(&self, name: &str) -> Read<Option<DVec3>> {
        self.get(name).map(|node| vector(node, 0.0)).transpose()
    }

    /// The transform of this name; none is the identity.
    pub fn transform(&self, name: &str) -> Read<DAffine3> {
        let Some(node) = self.get(name) else { return Ok(DAffine3::IDENTITY) };
        transform(node)
    }

    /// Tells what nobody asked for.
    pub fn finish(&self, report: &mut Report) {
        for (child, asked) in self.node.children.iter().zip(self.asked.borrow().iter()) {
            let name = child.attribute("name").or(child.attribute("type")).unwrap_or(&child.tag);
            // What says nothing of the picture itself.
            let is_harmless = ["id", "sampler", "sample_count", "seed", "spp", "samples_per_pass"].contains(&name)
                || ["sampler"].contains(&child.tag.as_str());
            if !asked && !is_harmless {
                let kind = self.node.attribute("type").map_or_else(String::new, |kind| format!(" `{kind}`"));
                let what = if OBJECTS.contains(&child.tag.as_str()) { child.tag.as_str() } else { "parameter" };
                let what = format!("the {what} `{name}` of the {}{kind}", self.node.tag);
                report.left_out(place(child), what);
            }
        }
    }
}

pub fn place(node: &Node) -> Place {
    Place::line(&node.file, node.line)
}

pub fn value(node: &Node) -> Read<&str> {
    node.attribute("value").ok_or_else(|| node.problem(format!("`{}` has no `value`", node.tag)))
}

pub fn shown(text: &str) -> String {
    text.chars().take(40).collect::<String>().escape_debug().to_string()
}

/// Numbers between commas or blanks.
pub fn numbers(text: &str, node: &Node) -> Read<Vec<f64>> {
    let words = text.split(|c: char| c == ',' || c.is_whitespace()).filter(|word| !word.is_empty());
    let parse = |word: &str| {
        let number = word.parse::<f64>().ok().filter(|x| x.is_finite());
        number.ok_or_else(|| node.problem(format!("`{}` is not a finite number", shown(word))))
    };
    words.map(parse).collect()
}

/// x, y and z, or a `value` of three numbers or one; what is missing is `default`.
fn vector(node: &Node, default: f64) -> Read<DVec3> {
    if let Some(text) = node.attribute("value") {
        return match numbers(text, node)?[..] {
            [all] => Ok(DVec3::splat(all)),
            [x, y, z] => Ok(DVec3::new(x, y, z)),
            [x, y] => Ok(DVec3::new(x, y, default)),
            _ => Err(node.problem(format!("`{}` must have three numbers", node.tag))),
        };
    }
    let axis = |name: &str| match node.attribute(name).map(|text| numbers(text, node)).transpose()? {
        None => Ok(default),
        Some(number) if number.len() == 1 => Ok(number[0]),
        Some(_) => Err(node.problem(format!("`{name}` must be a number"))),
    };
    Ok(DVec3::new(axis("x")?, axis("y")?, axis("z")?))
}

fn point(node: &Node, name: &str) -> Read<DVec3> {
    let text = node.attribute(name).ok_or_else(|| node.problem(format!("`{}` has no `{name}`", node.tag)))?;
    match numbers(text, node)?[..] {
        [x, y, z] => Ok(DVec3::new(x, y, z)),
        _ => Err(node.problem(format!("`{name}` must have three numbers"))),
    }
}

/// Steps one after the other, the first one first.
pub fn transform(node: &Node) -> Read<DAffine3> {
    let mut all = DAffine3::IDENTITY;
    for step in &node.children {
        let next = match step.tag.as_str() {
            "translate" => DAffine3::from_translation(vector(step, 0.0)?),
            "scale" => DAffine3::from_scale(vector(step, 1.0)?),
            "rotate" => {
                let axis = match step.attribute("axis") {
                    Some(_) => point(step, "axis")?,
                    None => vector(step, 0.0)?,
                };
                if axis == DVec3::ZERO {
                    return Err(step.problem("`rotate` has no axis"));
                }
                let angle = step.attribute("angle").map(|text| numbers(text, step)).transpose()?.unwrap_or_default();
                let [angle] = angle[..] else { return Err(step.problem("`rotate` needs one `angle`")) };
                DAffine3::from_mat3(rotation(axis, angle.to_radians()))
            }
            "matrix" => matrix(step)?,
            "lookat" => {
                let (origin, target, up) = (point(step, "origin")?, point(step, "target")?, point(step, "up")?);
                let frame = || {
                    let forward = (target - origin).try_normalize()?;
                    let left = up.cross(forward).try_normalize()?;
                    Some(DMat3::from_cols(left, forward.cross(left), forward))
                };
                let matrix3 =
                    frame().ok_or_else(|| step.problem("`lookat` has no direction, or `up` lies along it"))?;
                DAffine3 { matrix3, translation: origin }
            }
            other => return Err(step.problem(format!("`{}` is no step of a transform", shown(other)))),
        };
        all = next * all;
    }
    if !all.is_finite() {
        return Err(node.problem("has a transform that is not finite"));
    }
    Ok(all)
}

/// Rodrigues' formula as Mitsuba 3 has it: an axis that is not of length 1 stretches, too.
fn rotation(axis: DVec3, angle: f64) -> DMat3 {
    let (sine, cosine) = angle.sin_cos();
    let outer = DMat3::from_cols(axis * axis.x, axis * axis.y, axis * axis.z);
    let cross = DMat3::from_cols(
        DVec3::new(0.0, axis.z, -axis.y),
        DVec3::new(-axis.z, 0.0, axis.x),
        DVec3::new(axis.y, -axis.x, 0.0),
    );
    DMat3::IDENTITY * cosine + cross * sine + outer * (1.0 - cosine)
}

fn matrix(node: &Node) -> Read<DAffine3> {
    match numbers(value(node)?, node)?[..] {
        [a, b, c, d, e, f, g, h, i] => {
            let columns = [[a, d, g], [b, e, h], [c, f, i]].map(DVec3::from_array);
            Ok(DAffine3::from_mat3(DMat3::from_cols(columns[0], columns[1], columns[2])))
        }
        [a, b, c, x, d, e, f, y, g, h, i, z, 0.0, 0.0, 0.0, 1.0] => {
            let columns = [[a, d, g], [b, e, h], [c, f, i]].map(DVec3::from_array);
            let matrix3 = DMat3::from_cols(columns[0], columns[1], columns[2]);
            Ok(DAffine3 { matrix3, translation: DVec3::new(x, y, z) })
        }
        ref others if others.len() == 16 => Err(node.problem("`matrix` must have the last row 0 0 0 1")),
        ref others => Err(node.problem(format!("`matrix` needs 9 or 16 numbers, but has {}", others.len()))),
    }
}
