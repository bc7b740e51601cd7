//! `--set key=value`: replaces values of the scene tree by dotted path before anything is decoded.

use std::path::Path;

use super::context::Context;
use super::keys::{self, Section};
use super::tree::{self, Entry, Node, Origin, Value};
use super::words::did_you_mean;
use crate::{Error, Result as Checked};

/// `text`, a document of TOML or a part of a scene, written anew with `overrides` in it; unchanged where there are none.
///
/// # Errors
/// [`Error::Input`] as [`super::load`]'s, of the overrides themselves: what their keys mean is not looked at.
pub fn written(text: &str, overrides: &[(String, String)]) -> Checked<String> {
    if overrides.is_empty() {
        return Ok(text.to_owned());
    }
    let cx = Context::new(Path::new("scene.toml"), text, overrides);
    let mut root = cx.document().unwrap_or_default();
    apply(&cx, &mut root, overrides);
    match cx.finish().0 {
        problems if problems.is_empty() => Ok(table(&root).to_string()),
        problems => Err(Error::Input(problems)),
    }
}

fn table(entries: &[Entry]) -> toml::Table {
    entries.iter().map(|entry| (entry.key.clone(), value(&entry.node.value))).collect()
}

fn value(node: &Value) -> toml::Value {
    match node {
        Value::String(text) => text.clone().into(),
        Value::Integer(number) => (*number).into(),
        Value::Float(number) => (*number).into(),
        Value::Boolean(is_true) => (*is_true).into(),
        Value::Datetime(datetime) => (*datetime).into(),
        Value::Array(items) => toml::Value::Array(items.iter().map(|item| value(&item.value)).collect()),
        Value::Table(entries) => table(entries).into(),
        Value::Data(_) => unreachable!("text holds no arrays in memory"),
    }
}

/// Sections of things under names of the user's own, which only other parts of a scene make use of.
const NAMED: [&str; 2] = ["spectra", "media"];

/// Applies every override to `root`, in order; mistakes are recorded in `cx`, and what changes nothing is told of.
pub fn apply(cx: &Context<'_>, root: &mut Vec<Entry>, overrides: &[(String, String)]) {
    let known = NAMED.map(|section| names_in(root, section));
    for (index, (key, value)) in overrides.iter().enumerate() {
        let origin = Origin::Set(index);
        let Some(path) = parse_key(key) else {
            let help = "write a dotted path such as film.width or objects.0.material";
            cx.error(&origin, key, "is not a dotted key", Some(help.to_owned()));
            continue;
        };
        let node = match parse_value(value, index) {
            Ok(node) => node,
            Err(message) => {
                let help = "write a TOML value such as 5, \"text\", [1, 2, 3] or { constant = 1 }";
                cx.error(&origin, key, format!("the value is not valid TOML: {message}"), Some(help.to_owned()));
                continue;
            }
        };
        if let Err((message, help)) = set_in_table(root, &[], &path, node, &origin) {
            cx.error(&origin, key, message, Some(help));
        }
    }
    for (key, value) in overrides {
        let path = parse_key(key).unwrap_or_default();
        let [section, name, ..] = &path[..] else { continue };
        let Some(known) = NAMED.iter().position(|of| of == section).map(|at| &known[at]) else { continue };
        if known.contains(name) || root.iter().any(|entry| is_named(&entry.node, name)) {
            continue;
        }
        let hint = did_you_mean(name, known.iter().map(String::as_str)).map(|hint| format!(" ({hint})"));
        cx.warn(format!(
            "--set {key}={value} changes nothing: the scene names no `{name}` anywhere{}",
            hint.unwrap_or_default()
        ));
    }
}

/// What stands in a section, by name.
fn names_in(root: &[Entry], section: &str) -> Vec<String> {
    match root.iter().find(|entry| entry.key == section).map(|entry| &entry.node.value) {
        Some(Value::Table(entries)) => entries.iter().map(|entry| entry.key.clone()).collect(),
        _ => Vec::new(),
    }
}

/// Whether a value in the tree is this text.
fn is_named(node: &Node, name: &str) -> bool {
    match &node.value {
        Value::String(text) => text == name,
        Value::Array(items) => items.iter().any(|item| is_named(item, name)),
        Value::Table(entries) => entries.iter().any(|entry| is_named(&entry.node, name)),
        _ => false,
    }
}

/// The parts of a dotted key, by TOML's own rules.
pub(super) fn parse_key(key: &str) -> Option<Vec<String>> {
    if key.contains(['\n', '=', '#']) {
        return None;
    }
    let mut entries = tree::parse_document(&format!("{key} = 0")).ok()?;
    let mut path = Vec::new();
    loop {
        let entry = entries.pop()?;
        path.push(entry.key);
        match entry.node.value {
            Value::Table(inner) => entries = inner,
            _ => return Some(path),
        }
    }
}

/// TOML, or else a bare word, which is a string.
fn parse_value(text: &str, index: usize) -> Result<Node, String> {
    let text = text.trim();
    match tree::parse_value(text, index) {
        Ok(node) => Ok(node),
        Err(_) if !text.is_empty() && !text.starts_with(['[', '{', '"', '\'']) => {
            Ok(Node { value: Value::String(text.to_owned()), origin: Origin::Set(index) })
        }
        Err(errors) => Err(errors.into_iter().next().map_or_else(|| "it is empty".to_owned(), |e| e.1)),
    }
}

/// What is wrong, and what to do.
type Refusal = (String, String);

/// Sets `path` (not empty) below the table `entries`, which stands at `parents`.
fn set_in_table(
    entries: &mut Vec<Entry>,
    parents: &[&str],
    path: &[String],
    node: Node,
    origin: &Origin,
) -> Result<(), Refusal> {
    let key = path[0].as_str();
    let rivals = rivals(parents, key);
    entries.retain(|entry| !rivals.contains(&entry.key.as_str()));
    let here: Vec<&str> = parents.iter().copied().chain([key]).collect();
    let rest = &path[1..];
    if let Some(entry) = entries.iter_mut().find(|entry| entry.key == key) {
        if !rest.is_empty() {
            return set_below(&mut entry.node, &here, rest, node, origin);
        }
        // From now on the value is the override's, and so is whatever it lacks.
        *entry = Entry { key: key.to_owned(), key_origin: origin.clone(), node };
        return Ok(());
    }
    let created = if rest.is_empty() {
        node
    } else {
        let mut table = Node { value: Value::Table(Vec::new()), origin: origin.clone() };
        set_below(&mut table, &here, rest, node, origin)?;
        table
    };
    entries.push(Entry { key: key.to_owned(), key_origin: origin.clone(), node: created });
    Ok(())
}

/// Sets `path` (not empty) inside `target`, which stands at `here`.
fn set_below(target: &mut Node, here: &[&str], path: &[String], node: Node, origin: &Origin) -> Result<(), Refusal> {
    let at = || here.join(".");
    match &mut target.value {
        Value::Table(entries) => set_in_table(entries, here, path, node, origin),
        Value::Array(items) => {
            let count = items.len();
            let index = path[0].parse::<usize>().ok().filter(|&i| i <= count);
            let Some(index) = index else {
                let range = if count == 0 {
                    "0 to append".to_owned()
                } else {
                    format!("0 to {} to change, {count} to append", count - 1)
                };
                return Err((
                    format!("`{}` is no index of `{}`, which has {count} elements", path[0], at()),
                    format!("use {range}"),
                ));
            };
            let inner: Vec<&str> = here.iter().copied().chain([path[0].as_str()]).collect();
            match &path[1..] {
                [] if index < count => items[index] = node,
                [] => items.push(node),
                rest => {
                    if index == count {
                        items.push(Node { value: Value::Table(Vec::new()), origin: origin.clone() });
                    }
                    set_below(&mut items[index], &inner, rest, node, origin)?;
                }
            }
            Ok(())
        }
        other => Err((
            format!("`{}` is {}, which has no keys to set", at(), other.kind()),
            format!("set `{}` as a whole", at()),
        )),
    }
}

/// The keys beside `key`, in the table at `parents`, that setting `key` replaces.
fn rivals(parents: &[&str], key: &str) -> Vec<&'static str> {
    let is_one_of = |section: &Section| section.one_of().any(|k| k == key);
    let others = |section: &Section| -> Vec<&'static str> {
        if is_one_of(section) { section.one_of().filter(|k| *k != key).collect() } else { Vec::new() }
    };
    match parents {
        ["camera"] => others(&keys::CAMERA),
        ["channels"] => {
            let mut rivals = others(&keys::CHANNELS);
            if is_one_of(&keys::CHANNELS) && key != "intervals" {
                rivals.push("unit");
            }
            rivals
        }
        ["materials", _] => others(&keys::MATERIAL),
        ["materials", _, "diffuse"] => match key {
            "reflectance" => vec!["emissivity"],
            "emissivity" => vec!["reflectance"],
            _ => Vec::new(),
        },
        ["materials", _, "conductor"] => match key {
            "nk" => vec!["eta", "k"],
            "eta" | "k" => vec!["nk"],
            _ => Vec::new(),
        },
        ["lights", _] => others(&keys::LIGHT),
        ["lights", _, "sun"] => match key {
            "direction" => vec!["azimuth", "elevation", "date", "latitude", "longitude", "north", "up"],
            "azimuth" | "elevation" => vec!["direction", "date", "latitude", "longitude"],
            "date" | "latitude" | "longitude" => vec!["direction", "azimuth", "elevation"],
            _ => Vec::new(),
        },
        ["environment"] => others(&keys::ENVIRONMENT),
        ["objects", _] => {
            let mut rivals = others(&keys::OBJECT);
            if is_one_of(&keys::OBJECT) && key != "mesh" {
                rivals.extend(["group", "node"]);
            }
            rivals
        }
        ["objects", _, "transform"] => match key {
            "matrix" => vec!["translate", "rotate", "scale"],
            "translate" | "rotate" | "scale" => vec!["matrix"],
            _ => Vec::new(),
        },
        // Everywhere else a table with these keys is a spectrum.
        _ => {
            let mut rivals = others(&keys::SPECTRUM);
            match key {
                // A texture stands in the place of a spectrum, with keys of its own.
                "texture" | "endmembers" => {
                    rivals.extend(keys::SPECTRUM.one_of());
                    rivals.extend(["column", "share", "scale", "outside"]);
                }
                _ if is_one_of(&keys::SPECTRUM) => rivals.extend(["texture", "endmembers"]),
                _ => {}
            }
            if is_one_of(&keys::SPECTRUM) && key != "file" {
                rivals.push("column");
            }
            if is_one_of(&keys::SPECTRUM) && key != "mix" {
                rivals.push("share");
            }
            if matches!(key, "constant" | "blackbody" | "illuminant" | "named" | "mix") {
                rivals.push("outside");
            }
            rivals
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::scene::decode::join;

    fn applied(text: &str, sets: &[(&str, &str)]) -> (Vec<Entry>, Vec<String>) {
        let sets: Vec<_> = sets.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
        let mut root = tree::parse_document(text).unwrap();
        let cx = Context::new(Path::new("s.toml"), text, &sets);
        apply(&cx, &mut root, &sets);
        let messages = cx.finish().0.iter().map(|p| p.to_string()).collect();
        (root, messages)
    }

    /// The tree as text, one `path=value` a leaf.
    fn leaves(path: &str, node: &Value, out: &mut Vec<String>) {
        match node {
            Value::Table(entries) if entries.is_empty() => out.push(format!("{path}={{}}")),
            Value::Table(entries) => entries.iter().for_each(|e| leaves(&join(path, &e.key), &e.node.value, out)),
            Value::Array(items) => {
                items.iter().enumerate().for_each(|(i, n)| leaves(&join(path, &i.to_string()), &n.value, out))
            }
            Value::String(s) => out.push(format!("{path}={s}")),
            Value::Integer(i) => out.push(format!("{path}={i}")),
            Value::Float(f) => out.push(format!("{path}={f:?}")),
            other => out.push(format!("{path}={other:?}")),
        }
    }

    fn check(text: &str, sets: &[(&str, &str)], expected: &[&str]) {
        let (root, messages) = applied(text, sets);
        assert_eq!(messages, Vec::<String>::new());
        let mut found = Vec::new();
        leaves("", &Value::Table(root), &mut found);
        found.sort();
        assert_eq!(found, expected);
    }

    #[test]
    fn what_is_written_anew_is_what_it_was_set_to() {
        let text = "[channels]\nequal = { from = 380.0, to = 780.0, count = 4 }\n";
        let set = |key: &str, value: &str| written(text, &[(key.to_owned(), value.to_owned())]);
        assert_eq!(
            set("channels.equal.count", "9").expect("set"),
            "[channels.equal]\ncount = 9\nfrom = 380.0\nto = 780.0\n"
        );
        assert_eq!(set("channels.intervals", "[[1, 2.5]]").expect("set"), "[channels]\nintervals = [[1, 2.5]]\n");
        assert_eq!(written(text, &[]).expect("nothing to set"), text);
        assert!(set("channels.equal.count", "[1").is_err());
    }

    #[test]
    fn edits_creates_and_replaces_siblings() {
        check("a.b = 1", &[("a.b", "2"), ("a.c.d", "word")], &["a.b=2", "a.c.d=word"]);
        check("channels.equal.count = 4", &[("channels.equal.count", "9")], &["channels.equal.count=9"]);
        check(
            "channels.equal.count = 4",
            &[("channels.intervals", "[[4, 5]]")],
            &["channels.intervals.0.0=4", "channels.intervals.0.1=5"],
        );
        check("materials.w.diffuse.reflectance = 1", &[("materials.w.black", "{}")], &["materials.w.black={}"]);
        check(
            "materials.g.conductor.nk = \"au.csv\"",
            &[("materials.g.conductor.eta", "0.2"), ("materials.g.conductor.k", "{ constant = 3 }")],
            &["materials.g.conductor.eta=0.2", "materials.g.conductor.k.constant=3"],
        );
        check("materials.g.conductor.eta = 1", &[("materials.g.conductor.nk", "a")], &["materials.g.conductor.nk=a"]);
        check(
            "[[objects]]\nmesh = \"a\"\ngroup = \"g\"\nmaterial = \"w\"",
            &[("objects.0.sphere", "{ radius = 1.5 }")],
            &["objects.0.material=w", "objects.0.sphere.radius=1.5"],
        );
        check("e = { file = \"x\", column = \"c\" }", &[("e.blackbody", "300")], &["e.blackbody=300"]);
        check(
            "r = { texture = \"a.exr\", endmembers = [\"s\"] }",
            &[("r.texture", "b.exr")],
            &["r.endmembers.0=s", "r.texture=b.exr"],
        );
        check("r = { texture = \"a.exr\", endmembers = [\"s\"] }", &[("r.constant", "1")], &["r.constant=1"]);
        check("r = { file = \"a\", column = \"c\", scale = 2 }", &[("r.texture", "a.png")], &["r.texture=a.png"]);
        check(
            "materials.w.diffuse.reflectance = 1",
            &[("materials.w.diffuse.emissivity", "0.9")],
            &["materials.w.diffuse.emissivity=0.9"],
        );
        check(
            "channels = { intervals = [[1, 2]], unit = \"um\" }",
            &[("channels.equal.count", "9")],
            &["channels.equal.count=9"],
        );
        check(
            "[[lights]]\nsun = { azimuth = 1, elevation = 2, up = [0, 0, 1], irradiance = 3 }",
            &[("lights.0.sun.latitude", "4"), ("lights.0.sun.date", "x")],
            &[
                "lights.0.sun.date=x",
                "lights.0.sun.irradiance=3",
                "lights.0.sun.latitude=4",
                "lights.0.sun.up.0=0",
                "lights.0.sun.up.1=0",
                "lights.0.sun.up.2=1",
            ],
        );
        check("objects = []", &[("objects.0.material", "red")], &["objects.0.material=red"]);
        check("p = [1, 2, 3]", &[("p.1", "-4e1")], &["p.0=1", "p.1=-40.0", "p.2=3"]);
        check("m.\"my paint\".k = 1", &[("m.\"my paint\".k", "dpept-pixel")], &["m.\"my paint\".k=dpept-pixel"]);
    }

    #[test]
    fn refusals_name_the_argument() {
        for (key, value, words) in [
            ("a..b", "1", "not a dotted key"),
            ("", "1", "not a dotted key"),
            ("a=1\nb", "1", "not a dotted key"),
            ("p.7", "1", "no index of `p`"),
            ("p.x", "1", "no index of `p`"),
            ("n.x", "1", "has no keys"),
            ("n", "[1,", "not valid TOML"),
            ("n", "", "not valid TOML"),
        ] {
            let (_, messages) = applied("p = [1]\nn = 3", &[(key, value)]);
            assert_eq!(messages.len(), 1, "{key}={value}");
            assert!(
                messages[0].starts_with(&format!("--set {key}={value}")) && messages[0].contains(words),
                "{messages:?}"
            );
        }
    }
}
