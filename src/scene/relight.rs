//! Other spectra, temperatures and channels for the products of a factored cube, written as in a scene file.

mod choice;

use std::path::Path;
use std::sync::Arc;

pub use self::choice::{Changeable, Choice, Chosen, changeable, choose};
use super::arrays::Data;

use super::context::Context;
use super::decode::{Item, did_you_mean, join, list};
use super::spectrum::{Quantity, Spectra};
use super::tree::{Entry, Node, Origin, Value};
use super::{channels, overrides};
use crate::error::Error;
use crate::format::response::{self, Responses};
use crate::spectral::product::{Basis, Leaf, Term};
use crate::spectral::{Channels, Curve, planck};
use crate::{Result, files};

/// A factored cube as it was rendered.
#[derive(Debug, Clone, Copy)]
pub struct Rendered<'a> {
    pub basis: &'a Basis,
    pub channels: &'a Channels,
    /// What does not separate, in words.
    pub remainder: &'a [String],
    /// Names of spectra that light meets nowhere else.
    pub beside: &'a [String],
}

/// Where the files are that spectra name.
#[derive(Debug, Clone, Copy)]
pub enum Files<'a> {
    /// On this machine.
    Disk,
    /// Here, each under its name; others are refused.
    Given(&'a [(String, String)]),
}

/// The channels that are wanted.
#[derive(Debug, Clone, PartialEq)]
pub enum NewChannels<'a> {
    /// The cube's.
    Same,
    /// The cube's, with keys of `[channels]` set, such as `equal.count`.
    Set(&'a [(String, String)]),
    /// Those of another scene.
    Scene(&'a Path),
    /// The bands of a sensor.
    Responses(&'a Path),
}

/// What a cube is made anew of.
#[derive(Debug, Clone, PartialEq)]
pub struct Relit {
    pub basis: Basis,
    pub channels: Channels,
    /// Keys of what is not as it was.
    pub changed: Vec<String>,
    pub warnings: Vec<String>,
}

/// What heat may be off between nodes of temperatures (docs/METHOD.md, Factored cubes), before it is told.
const ROUGH: f64 = 1.1e-4;

/// Where mistakes of an option are said to stand.
const OPTION: &str = "--set";

/// What `rendered` is made of with what `sets` changes: `spectra.NAME` and what may stand below it in a scene file, and
/// `materials.NAME.temperature`. Names within spectra (`named`, `mix`) are of spectra as they were rendered.
///
/// # Errors
/// What a cube cannot change, and mistakes as in scene files.
pub fn relight(rendered: Rendered, sets: &[(String, String)], wanted: NewChannels, files: Files) -> Result<Relit> {
    let mut warnings = Vec::new();
    let Rendered { basis, channels, .. } = rendered;
    let channels = new_channels(channels, wanted, &mut warnings)?;
    let (names, materials) = (names(basis), materials(basis, false));
    let mut spectra: Vec<&str> = Vec::new();
    let mut hot: Vec<&str> = Vec::new();
    let mut normal = Vec::new();
    for (key, value) in sets {
        let path = overrides::parse_key(key).unwrap_or_default();
        let path: Vec<&str> = path.iter().map(String::as_str).collect();
        match path[..] {
            ["spectra", name, ..] if names.contains(&name) => {
                spectra.extend(names.iter().find(|n| **n == name));
                normal.push((key.clone(), value.clone()));
            }
            // With the kind of the material between, as it stands in scenes, or without.
            ["materials", name, "temperature"] | ["materials", name, _, "temperature"] if materials.contains(&name) => {
                hot.extend(materials.iter().find(|n| **n == name));
                normal.push((format!("materials.\"{}\".temperature", name.escape_default()), value.clone()));
            }
            _ => return Err(refusal(key, &path, &names, &materials, rendered)),
        }
    }
    [&mut spectra, &mut hot].into_iter().for_each(|all| {
        all.sort_unstable();
        all.dedup();
    });

    let text = document(basis, &spectra, &hot);
    // What uses each of them.
    let users: Vec<(&str, Node)> = spectra
        .iter()
        .map(|name| (*name, Node { value: Value::String((*name).to_owned()), origin: Origin::Whole }))
        .collect();
    let cx = Context::new(Path::new(OPTION), &text, &normal);
    let Some(mut root) = cx.document() else { return Err(Error::Input(cx.finish().0)) };
    overrides::apply(&cx, &mut root, &normal);
    let mut relit = basis.clone();
    let are_all_there = match files {
        Files::Disk => true,
        Files::Given(files) => root.iter_mut().all(|entry| give(&cx, entry, "", files)),
    };
    if are_all_there {
        let known = names.iter().map(|name| (*name, &leaf(basis, name).curve)).collect::<Vec<_>>();
        decode(&cx, &root, &channels, &users, &known, &hot, &mut relit);
    }
    let (problems, more) = cx.finish();
    if !problems.is_empty() {
        return Err(Error::Input(problems));
    }
    warnings.extend(more);
    warnings.extend(dark(&relit, &channels));
    warnings.extend(rough_temperatures(&relit, &channels));
    let changed = spectra.iter().map(|name| format!("spectra.{name}"));
    let changed = changed.chain(hot.iter().map(|name| format!("materials.{name}.temperature"))).collect();
    Ok(Relit { basis: relit, channels, changed, warnings })
}

/// The named spectra of a basis, each once.
fn names(basis: &Basis) -> Vec<&str> {
    let mut names: Vec<&str> =
        basis.spectra.iter().filter(|leaf| leaf.is_named).map(|leaf| leaf.name.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    names
}

/// The first spectrum of that name, which there is.
fn leaf<'b>(basis: &'b Basis, name: &str) -> &'b Leaf {
    basis.spectra.iter().find(|leaf| leaf.is_named && leaf.name == name).expect("a name of the basis")
}

/// Puts what `files` hold in the places of their names, wherever below `entry` there is one; false where one is not among them, which is
/// said.
fn give(cx: &Context, entry: &mut Entry, parent: &str, files: &[(String, String)]) -> bool {
    let path = join(parent, &entry.key);
    let Value::String(name) = &entry.node.value else { return give_below(cx, &mut entry.node, &path, files) };
    if entry.key != "file" {
        return true;
    }
    let Some((name, content)) = files.iter().find(|(known, _)| known == name) else {
        let message = format!("names the file \"{name}\", but no file of this machine is read here");
        cx.error(&entry.node.origin, &path, message, Some("send what it holds along".to_owned()));
        return false;
    };
    let data = Data::File { name: name.clone(), content: content.clone().into_bytes() };
    entry.node.value = Value::Data(Arc::new(data));
    true
}

fn give_below(cx: &Context, node: &mut Node, path: &str, files: &[(String, String)]) -> bool {
    match &mut node.value {
        Value::Table(entries) => entries.iter_mut().all(|entry| give(cx, entry, path, files)),
        Value::Array(items) => items.iter_mut().all(|item| give_below(cx, item, path, files)),
        _ => true,
    }
}

/// The hot materials of a basis whose temperatures are numbers; or those that a texture tells.
fn materials(basis: &Basis, by_texture: bool) -> Vec<&str> {
    let terms = basis.factors.iter().chain(&basis.sources).flat_map(|expression| &expression.terms);
    let mut materials: Vec<&str> = terms
        .filter_map(|term| match term {
            Term::Planck { material, is_node, .. } if *is_node == by_texture => Some(material.as_str()),
            _ => None,
        })
        .collect();
    materials.sort_unstable();
    materials.dedup();
    materials
}

fn refusal(key: &str, path: &[&str], names: &[&str], materials: &[&str], rendered: Rendered) -> Error {
    let what = match path {
        ["spectra", name, ..] if rendered.beside.iter().any(|beside| beside == name) => format!(
            "the spectrum \"{name}\" reaches the picture only by what does not separate ({}), which is kept as it was rendered; what \
             changes it needs a new render",
            rendered.remainder.join(", ")
        ),
        ["spectra", name, ..] => {
            let hint = did_you_mean(name, names.iter().copied());
            let known = || format!("the cube has {}", list(names.iter().copied()));
            format!("no spectrum of the cube is named \"{name}\"; {}", hint.unwrap_or_else(known))
        }
        ["materials", name, "temperature"] | ["materials", name, _, "temperature"]
            if self::materials(rendered.basis, true).contains(name) =>
        {
            format!("the temperature of \"{name}\" comes from a texture; what changes it needs a new render")
        }
        ["materials", name, "temperature"] | ["materials", name, _, "temperature"] => {
            let known = if materials.is_empty() { "none".to_owned() } else { list(materials.iter().copied()) };
            format!("\"{name}\" is no hot material of the cube, which are: {known}")
        }
        _ => "a cube is relit by spectra.NAME and materials.NAME.temperature; what else changes needs a new render"
            .to_owned(),
    };
    Error::Usage(format!("--set {key}: {what}"))
}

/// What is going to be changed, as a scene file would have it.
fn document(basis: &Basis, spectra: &[&str], hot: &[&str]) -> String {
    let mut text = String::new();
    for name in spectra {
        text += &format!("[spectra.\"{}\"]\n{}\n", name.escape_default(), written(&leaf(basis, name).curve));
    }
    for name in hot {
        let terms = basis.sources.iter().flat_map(|source| &source.terms);
        let kelvin = terms.filter_map(|term| match term {
            Term::Planck { material, kelvin, .. } if material == name => Some(*kelvin),
            _ => None,
        });
        let kelvin = kelvin.max_by(f64::total_cmp).unwrap_or_default();
        text += &format!("[materials.\"{}\"]\ntemperature = {kelvin:?}\n", name.escape_default());
    }
    text
}

/// A curve in the words of a scene file.
fn written(curve: &Curve) -> String {
    match curve {
        Curve::Constant(value) => format!("constant = {value:?}\n"),
        Curve::Blackbody { kelvin, scale } => format!("blackbody = {kelvin:?}\nscale = {scale:?}\n"),
        Curve::Linear { nm, value, outside } => {
            let nodes: Vec<String> = nm.iter().zip(value).map(|(nm, value)| format!("[{nm:?}, {value:?}]")).collect();
            format!("samples = [{}]\noutside = \"{}\"\n", nodes.join(", "), outside.name())
        }
    }
}

/// Puts what the tree says of the spectra that `users` name and of the temperatures of `hot` into `basis`; mistakes are recorded.
fn decode<'a>(
    cx: &'a Context<'a>,
    root: &'a [Entry],
    channels: &Channels,
    users: &'a [(&str, Node)],
    known: &[(&'a str, &Curve)],
    hot: &[&str],
    basis: &mut Basis,
) {
    let top = |key: &str| root.iter().find(|entry| entry.key == key);
    let item = |entry: &'a Entry| Item { cx, node: &entry.node, path: entry.key.clone(), at: &entry.node.origin };
    let mut all = Spectra::meaning(cx, top("spectra").map(item), Some(channels.clone()), known);
    let mut found = Vec::new();
    for (name, node) in users {
        for (i, leaf) in basis.spectra.iter().enumerate().filter(|(_, leaf)| leaf.is_named && leaf.name == *name) {
            let Some(quantity) = quantity(leaf) else { continue };
            let user = Item { cx, node, path: format!("spectra.{name}"), at: &node.origin };
            if let Some(handle) = all.resolve(&user, quantity) {
                found.push((i, all.take(handle)));
            }
        }
    }
    let curves = all.finish();
    found.into_iter().for_each(|(i, id)| basis.spectra[i].curve = curves[id].curve.clone());

    for name in hot {
        let Some(materials) = top("materials").map(item) else { continue };
        let of_material = |entries: &'a [Entry], key: &str| entries.iter().find(|entry| entry.key == key);
        let Value::Table(entries) = &materials.node.value else { continue };
        let Some(Value::Table(keys)) = of_material(entries, name).map(|entry| &entry.node.value) else { continue };
        let Some(entry) = of_material(keys, "temperature") else { continue };
        let path = format!("materials.{name}.temperature");
        let entry = Item { cx, node: &entry.node, path, at: &entry.node.origin };
        let Some(value) = super::material::kelvin(&entry) else { continue };
        for term in basis.sources.iter_mut().flat_map(|source| &mut source.terms) {
            if let Term::Planck { material, kelvin, is_node: false } = term
                && material == name
            {
                *kelvin = value;
            }
        }
    }
}

/// Sources that shine in none of the channels, as of scenes; what is 0 everywhere has been switched off.
fn dark<'b>(basis: &'b Basis, channels: &'b Channels) -> impl Iterator<Item = String> + use<'b> {
    let shines = |curve: &Curve| channels.bounds.iter().any(|&[a, b]| curve.mean(a, b) >= f64::from(f32::MIN_POSITIVE));
    // Also of wavelengths that nobody's channels have, by a unit that is not meant.
    let is_on = |curve: &Curve| match curve {
        Curve::Linear { value, .. } => value.iter().any(|value| *value > 0.0),
        other => other.max(1e-3, 1e15) > 0.0,
    };
    let is_dark = move |leaf: &&Leaf| {
        quantity(leaf).is_some_and(Quantity::is_light) && !shines(&leaf.curve) && is_on(&leaf.curve)
    };
    let [first, last] = channels.hull().unwrap_or_default();
    basis.spectra.iter().filter(is_dark).map(move |leaf| {
        format!("the spectrum `{}` of a source shines in none of the channels, {first} and {last} nm", leaf.name)
    })
}

/// Temperatures of textures whose nodes, which were chosen for the channels of the render, are too far apart for others.
fn rough_temperatures<'b>(basis: &'b Basis, channels: &Channels) -> impl Iterator<Item = String> + use<'b> {
    let range = channels.hull();
    materials(basis, true).into_iter().filter_map(move |name| {
        let terms = basis.sources.iter().flat_map(|source| &source.terms);
        let mut kelvin: Vec<f64> = terms
            .filter_map(|term| match term {
                Term::Planck { material, kelvin, is_node: true } if material == name => Some(*kelvin),
                _ => None,
            })
            .collect();
        kelvin.sort_by(f64::total_cmp);
        let hottest = *kelvin.last()?;
        let error = |pair: &[f64]| planck::chord_error(range.unwrap_or_default(), [pair[0], pair[1]], hottest);
        let worst = kelvin.windows(2).map(error).fold(0.0, f64::max);
        (worst > ROUGH).then(|| {
            format!(
                "heat of \"{name}\", whose temperature is a texture, is interpolated for the channels that were rendered: in these \
                 it may be off by {:.2} %",
                100.0 * worst
            )
        })
    })
}

fn quantity(leaf: &Leaf) -> Option<Quantity> {
    Quantity::ALL.into_iter().find(|quantity| quantity.noun() == leaf.quantity)
}

fn new_channels(channels: &Channels, wanted: NewChannels, warnings: &mut Vec<String>) -> Result<Channels> {
    let (file, text, sets) = match wanted {
        NewChannels::Same => return Ok(channels.clone()),
        NewChannels::Responses(file) => {
            let read = response::read_responses(file).map_err(|problem| Error::Input(vec![*problem]))?;
            let Responses { named, warnings: more } = read;
            warnings.extend(more);
            return Ok(Channels::from_responses(named, None));
        }
        NewChannels::Scene(file) => {
            let text = std::fs::read_to_string(file)
                .map_err(|error| Error::Usage(format!("--channels {}: {error}", files::shown(file))))?;
            (file, text, Vec::new())
        }
        NewChannels::Set(sets) => {
            let key = |key: &str| format!("channels.{}", key.strip_prefix("channels.").unwrap_or(key));
            let sets = sets.iter().map(|(name, value)| (key(name), value.clone())).collect();
            (Path::new("--channels"), channels_document(channels), sets)
        }
    };
    let cx = Context::new(file, super::file::without_mark(&text), &sets);
    let Some(mut root) = cx.document() else { return Err(Error::Input(cx.finish().0)) };
    overrides::apply(&cx, &mut root, &sets);
    let entry = root.iter().find(|entry| entry.key == "channels");
    if entry.is_none() {
        cx.error(&Origin::Whole, "channels", "`[channels]` is missing", Some("name a scene that has it".into()));
    }
    let found = entry.and_then(|entry| {
        channels::decode(&Item { cx: &cx, node: &entry.node, path: entry.key.clone(), at: &entry.node.origin })
    });
    let (problems, more) = cx.finish();
    warnings.extend(more);
    match found {
        Some(found) if problems.is_empty() => Ok(found),
        _ => Err(Error::Input(problems)),
    }
}

/// The channels of a cube in the words of a scene file: equal ones as such. Responses are left out: they come from files.
fn channels_document(channels: &Channels) -> String {
    let bounds = &channels.bounds;
    if let ([from, _], [_, to]) = (bounds[0], bounds[bounds.len() - 1])
        && Channels::equal(from, to, bounds.len()).bounds == *bounds
    {
        return format!("[channels]\nequal = {{ from = {from:?}, to = {to:?}, count = {} }}\n", bounds.len());
    }
    let each: Vec<String> = bounds.iter().map(|[from, to]| format!("[{from:?}, {to:?}]")).collect();
    format!("[channels]\nintervals = [{}]\n", each.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectral::Outside;
    use crate::spectral::product::Expression;

    fn basis() -> Basis {
        let leaf = |name: &str, quantity: Quantity, curve: Curve| Leaf {
            name: name.into(),
            is_named: true,
            quantity: quantity.noun().into(),
            curve,
        };
        let table = Curve::Linear { nm: vec![400.0, 700.0], value: vec![0.1, 0.7], outside: Outside::Hold };
        let of = |terms: Vec<Term>| Expression { scale: 1.0, terms };
        Basis {
            spectra: vec![
                leaf("lamp", Quantity::Radiance, Curve::Blackbody { kelvin: 3000.0, scale: 0.5 }),
                leaf("paint", Quantity::Reflectance, table),
            ],
            factors: vec![of(vec![Term::Spectrum(1)])],
            sources: vec![
                of(vec![Term::Spectrum(0)]),
                of(vec![Term::Complement(1), Term::Planck { material: "wall".into(), kelvin: 290.0, is_node: false }]),
            ],
        }
    }

    fn set(sets: &[(&str, &str)]) -> Result<Relit> {
        let sets: Vec<_> = sets.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
        let (basis, channels) = (basis(), Channels::equal(400.0, 700.0, 3));
        relight(rendered(&basis, &channels), &sets, NewChannels::Same, Files::Disk)
    }

    fn rendered<'a>(basis: &'a Basis, channels: &'a Channels) -> Rendered<'a> {
        Rendered { basis, channels, remainder: &[], beside: &[] }
    }

    #[test]
    fn what_is_set_changes_and_nothing_else() {
        let relit = set(&[
            ("spectra.lamp.blackbody", "6500"),
            ("spectra.paint", "{ samples = [[400, 0.2], [500, 0.4]], outside = \"hold\" }"),
            ("materials.wall.diffuse.temperature", "350"),
        ])
        .expect("changes");
        let mut want = basis();
        want.spectra[0].curve = Curve::Blackbody { kelvin: 6500.0, scale: 0.5 };
        want.spectra[1].curve = Curve::Linear { nm: vec![400.0, 500.0], value: vec![0.2, 0.4], outside: Outside::Hold };
        want.sources[1].terms[1] = Term::Planck { material: "wall".into(), kelvin: 350.0, is_node: false };
        assert_eq!(relit.basis, want);
        assert_eq!(relit.changed, ["spectra.lamp", "spectra.paint", "materials.wall.temperature"]);
        // Half of what the cube has.
        let half = set(&[("spectra.paint.scale", "0.5")]).expect("a change").basis.spectra[1].curve.clone();
        assert_eq!(half, Curve::Linear { nm: vec![400.0, 700.0], value: vec![0.05, 0.35], outside: Outside::Hold });
        assert_eq!(set(&[]).expect("nothing").basis, basis());
        assert_eq!(set(&[]).expect("nothing").warnings, Vec::<String>::new());
    }

    #[test]
    fn lamps_that_shine_in_no_channel_are_told_of() {
        let relit = set(&[("spectra.lamp", "{ samples = [[4000, 1], [7000, 2]] }")]).expect("a change");
        let words = "the spectrum `lamp` of a source shines in none of the channels, 400 and 700 nm";
        assert_eq!(relit.warnings, [words]);
        assert_eq!(set(&[("spectra.lamp", "0.0")]).expect("off").warnings, Vec::<String>::new());
        // So it is where the channels are others, as of a sensor whose file is in micrometres and does not say so.
        let sets = [("intervals".to_owned(), "[[0.4, 0.7]]".to_owned())];
        let mut cube = basis();
        let table = Curve::Linear { nm: vec![400.0, 700.0], value: vec![1.0, 2.0], outside: Outside::Zero };
        cube.spectra[0].curve = table;
        let channels = Channels::equal(400.0, 700.0, 3);
        let wanted = NewChannels::Set(&sets);
        let relit = relight(rendered(&cube, &channels), &[], wanted, Files::Disk).expect("channels");
        assert!(relit.warnings.iter().any(|warning| warning.contains("in none of the channels, 0.4 and 0.7 nm")));
    }

    /// Temperatures of a texture stay, and are told of where their nodes are too far apart for new channels.
    #[test]
    fn temperatures_of_textures_stay() {
        let mut cube = basis();
        for kelvin in [300.0, 301.0, 302.0] {
            let terms = vec![Term::Planck { material: "ground".into(), kelvin, is_node: true }];
            cube.sources.push(Expression { scale: 1.0, terms });
        }
        let infrared = Channels::equal(8e3, 12e3, 4);
        let relit = |sets: &[(&str, &str)], wanted: &[(String, String)]| {
            let sets: Vec<_> = sets.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
            relight(rendered(&cube, &infrared), &sets, NewChannels::Set(wanted), Files::Disk)
        };
        let warm = relit(&[("materials.wall.temperature", "320")], &[]).expect("a wall");
        assert!(warm.warnings.iter().all(|warning| !warning.contains("ground")), "{:?}", warm.warnings);
        let said = relit(&[("materials.ground.temperature", "320")], &[]).expect_err("a texture").to_string();
        assert!(said.contains("\"ground\" comes from a texture"), "{said}");
        let short = relit(&[], &[("equal.from".to_owned(), "2000".to_owned())]).expect("channels").warnings.join("\n");
        // (x² - 2 x) / 8 (ΔT/T)², x = 24 at 2 µm.
        assert!(short.contains("heat of \"ground\"") && short.contains("off by 0.07 %"), "{short}");
    }

    #[test]
    fn what_cannot_be_changed_is_refused_by_name() {
        for (key, value, words) in [
            ("spectra.lmap", "1", "lamp"),
            ("spectra.sky", "1", "lamp, paint"),
            ("objects.0.material", "\"x\"", "needs a new render"),
            ("materials.floor.temperature", "300", "wall"),
            ("materials.wall.temperature", "-3", "above 0"),
            ("spectra.paint", "1.5", "in [0, 1]"),
            ("spectra.paint.blackbody", "3000", "spectra.paint"),
            ("spectra.lamp", "{ file = \"no-such.csv\" }", "no-such.csv"),
            ("camera.fov", "3", "needs a new render"),
        ] {
            let said = set(&[(key, value)]).expect_err(key).to_string();
            assert!(said.contains(words), "{key}: {said}");
        }
    }

    /// Names within spectra are those of the render, also of what is being changed.
    #[test]
    fn spectra_are_made_of_others() {
        let lamp = |value: &str| set(&[("spectra.lamp", value)]).map(|relit| relit.basis.spectra[0].curve.clone());
        let dimmed = lamp("{ named = \"lamp\", scale = 0.5 }").expect("dimmed");
        assert_eq!(dimmed, Curve::Blackbody { kelvin: 3000.0, scale: 0.25 });
        let mixed = lamp("{ mix = [\"lamp\", { illuminant = \"E\", scale = 2 }], share = 0.25 }").expect("mixed");
        for nm in [400.0, 512.3, 699.0] {
            let want = 0.75 * 0.5 * crate::spectral::planck::radiance(nm, 3000.0) + 0.5;
            assert!((mixed.eval(nm) / want - 1.0).abs() < 1e-6, "{nm}");
        }
        let swapped = set(&[("spectra.lamp", "1.0"), ("spectra.paint", "{ named = \"paint\", scale = 0.1 }")]);
        let want = basis().spectra[1].curve.scaled(0.1);
        assert_eq!(swapped.expect("swapped").basis.spectra[1].curve, want);
        for (key, value, words) in [
            ("spectra.lamp", "{ named = \"lmap\" }", "no spectrum is named \"lmap\""),
            ("spectra.lamp", "{ illuminant = \"D66\" }", "\"D65\""),
            ("spectra.lamp", "{ illuminant = \"D65\", share = 0.5 }", "goes with `mix` only"),
            ("spectra.lamp", "{ mix = [1.0, 2.0], share = 1.5 }", "in [0, 1]"),
            ("spectra.lamp", "{ mix = [1.0] }", "two spectra"),
            ("spectra.paint", "{ illuminant = \"D65\" }", "the illuminant D65, which is light"),
            ("spectra.paint", "{ named = \"paint\", scale = 2 }", "in [0, 1]"),
        ] {
            let said = set(&[(key, value)]).expect_err(value).to_string();
            assert!(said.contains(words), "{value}: {said}");
        }
    }

    #[test]
    fn files_are_given_or_refused() {
        let (basis, channels) = (basis(), Channels::equal(400.0, 700.0, 3));
        let files = [("paint.csv".to_owned(), "nm,a,b\n400,0.1,0.3\n700,0.2,0.4\n".to_owned())];
        let given = |value: &str| {
            let sets = [("spectra.paint".to_owned(), value.to_owned())];
            relight(rendered(&basis, &channels), &sets, NewChannels::Same, Files::Given(&files))
        };
        let relit = given("{ file = \"paint.csv\", column = \"b\" }").expect("given");
        let table = Curve::Linear { nm: vec![400.0, 700.0], value: vec![0.3, 0.4], outside: Outside::Hold };
        assert_eq!(relit.basis.spectra[1].curve, table);
        given("{ mix = [{ file = \"paint.csv\", column = 2 }, 0.5] }").expect("within");
        for name in ["other.csv", "/etc/hostname", "../paint.csv"] {
            for value in [format!("{{ file = \"{name}\" }}"), format!("{{ mix = [0.5, {{ file = \"{name}\" }}] }}")] {
                let said = given(&value).expect_err(name).to_string();
                assert!(said.contains("no file of this machine is read here"), "{said}");
            }
        }
        let said = given("{ file = \"paint.csv\" }").expect_err("two columns").to_string();
        assert!(said.contains("paint.csv"), "{said}");
    }

    #[test]
    fn what_is_only_in_the_remainder_is_told_so() {
        let (basis, channels) = (basis(), Channels::equal(400.0, 700.0, 3));
        let (remainder, beside) = (["the material \"cat\" (plastic)".to_owned()], ["varnish".to_owned()]);
        let rendered = Rendered { remainder: &remainder, beside: &beside, ..rendered(&basis, &channels) };
        let sets = [("spectra.varnish".to_owned(), "0.5".to_owned())];
        let said = relight(rendered, &sets, NewChannels::Same, Files::Disk).expect_err("refused").to_string();
        assert!(said.contains("only by what does not separate (the material \"cat\" (plastic))"), "{said}");
    }

    #[test]
    fn channels_are_written_as_in_scenes() {
        let of = |channels: &Channels, key: &str, value: &str| {
            let sets = [(key.to_owned(), value.to_owned())];
            let wanted = NewChannels::Set(&sets);
            relight(rendered(&basis(), channels), &[], wanted, Files::Disk).map(|relit| relit.channels)
        };
        let equal = Channels::equal(400.0, 700.0, 3);
        assert_eq!(of(&equal, "equal.count", "6").expect("six").bounds, Channels::equal(400.0, 700.0, 6).bounds);
        assert_eq!(of(&equal, "channels.equal.count", "6").expect("six").len(), 6);
        let uneven = Channels::from_bounds(vec![[400.0, 410.0], [420.0, 700.0]], None);
        assert_eq!(of(&uneven, "intervals", "[[500, 510]]").expect("one").bounds, [[500.0, 510.0]]);
        assert!(of(&equal, "equal.count", "0").expect_err("none").to_string().contains("equal.count"));
        assert!(of(&equal, "evenly", "3").is_err());
    }
}
