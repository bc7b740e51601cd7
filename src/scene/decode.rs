//! Typed access to the scene tree: every accessor either gives a checked value or records what is wrong and gives
//! `None`, so that decoding carries on with the next item.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use glam::DVec3;

use super::arrays::Data;
use super::context::Context;
use super::keys::Section;
use super::tree::{Entry, Node, Origin, Value};
pub use super::words::{did_you_mean, list, quoted};
use super::words::{nearest, suggestion};

/// A value of the scene tree with its dotted key.
#[derive(Clone)]
pub struct Item<'a> {
    pub cx: &'a Context<'a>,
    pub node: &'a Node,
    pub path: String,
    /// Where to point when the value as a whole is wrong.
    pub at: &'a Origin,
}

/// A table whose keys have been checked against those it may have.
#[derive(Clone)]
pub struct Fields<'a> {
    pub cx: &'a Context<'a>,
    pub path: String,
    /// Where to point when something is missing from the table.
    pub at: &'a Origin,
    entries: &'a [Entry],
    section: &'static Section,
    /// For every unknown key the known one that was probably meant, or "".
    misspelt: Vec<&'static str>,
}

impl<'a> Item<'a> {
    pub fn error(&self, message: impl Into<String>) {
        self.cx.error(self.at, &self.path, message, None);
    }

    pub fn error_help(&self, message: impl Into<String>, help: impl Into<String>) {
        self.cx.error(self.at, &self.path, message, Some(help.into()));
    }

    fn wrong_kind<T>(&self, expected: &str) -> Option<T> {
        self.error(format!("must be {expected}, but is {}", self.node.value.kind()));
        None
    }

    /// A finite number.
    pub fn number(&self) -> Option<f64> {
        let value = match self.node.value {
            Value::Integer(i) => i as f64,
            Value::Float(f) => f,
            _ => return self.wrong_kind("a number"),
        };
        if !value.is_finite() {
            self.error(format!("must be a finite number, but is {value}"));
            return None;
        }
        Some(value)
    }

    /// A finite number for which `allowed` holds; `range` says so in words.
    pub fn number_where(&self, allowed: impl Fn(f64) -> bool, range: &str) -> Option<f64> {
        let value = self.number()?;
        if !allowed(value) {
            self.error(format!("must be {range}, but is {value}"));
            return None;
        }
        Some(value)
    }

    /// A finite number above zero.
    pub fn positive(&self) -> Option<f64> {
        self.number_where(|v| v > 0.0, "greater than 0")
    }

    /// A finite number of at least zero.
    pub fn not_negative(&self) -> Option<f64> {
        self.number_where(|v| v >= 0.0, "0 or greater")
    }

    /// A whole number in `range`.
    pub fn whole(&self, range: RangeInclusive<u32>) -> Option<u32> {
        let words = format!("a whole number from {} to {}", range.start(), range.end());
        let Value::Integer(value) = self.node.value else {
            if let Value::Float(value) = self.node.value {
                self.error(format!("must be {words}, but is {value:?}"));
                return None;
            }
            return self.wrong_kind(&words);
        };
        let inside = u32::try_from(value).ok().filter(|v| range.contains(v));
        if inside.is_none() {
            self.error(format!("must be {words}, but is {value}"));
        }
        inside
    }

    pub fn boolean(&self) -> Option<bool> {
        match self.node.value {
            Value::Boolean(b) => Some(b),
            _ => self.wrong_kind("true or false"),
        }
    }

    pub fn text(&self) -> Option<&'a str> {
        match &self.node.value {
            Value::String(s) => Some(s),
            _ => self.wrong_kind("a string"),
        }
    }

    /// What stands in the place of a file's name: the numbers that the file would hold.
    pub fn data(&self) -> Option<&'a Data> {
        match &self.node.value {
            Value::Data(data) => Some(data),
            _ => None,
        }
    }

    /// The file that the value names, as it is written, and its path; or what numbers in memory are called.
    pub fn source(&self) -> Option<(&'a str, PathBuf)> {
        match self.data() {
            Some(data) => Some((data.name(), PathBuf::from(data.name()))),
            None => self.text().map(|name| (name, self.cx.path(name))),
        }
    }

    /// One of a few named values.
    pub fn choice<T: Copy>(&self, choices: &[(&str, T)]) -> Option<T> {
        let written = self.text()?;
        if let Some((_, value)) = choices.iter().find(|(name, _)| *name == written) {
            return Some(*value);
        }
        let names = choices.iter().map(|(name, _)| *name);
        self.error_help(
            format!("must be one of {}, but is \"{written}\"", quoted(names.clone())),
            did_you_mean(written, names).unwrap_or_else(|| "use one of these values".to_owned()),
        );
        None
    }

    /// The elements of an array.
    pub fn array(&self) -> Option<Vec<Item<'a>>> {
        let Value::Array(nodes) = &self.node.value else {
            return self.wrong_kind("an array");
        };
        let item = |(i, node): (usize, &'a Node)| Item {
            cx: self.cx,
            node,
            path: format!("{}.{i}", self.path),
            at: if node.origin == Origin::Whole { self.at } else { &node.origin },
        };
        Some(nodes.iter().enumerate().map(item).collect())
    }

    /// An array of exactly N elements; `what` says what they are.
    pub fn array_of<const N: usize>(&self, what: &str) -> Option<[Item<'a>; N]> {
        if !matches!(self.node.value, Value::Array(_)) {
            return self.wrong_kind(what);
        }
        let items = self.array()?;
        let found = items.len();
        let items = items.try_into().ok();
        if items.is_none() {
            self.error(format!("must be {what}, but has {found} elements"));
        }
        items
    }

    /// An array of exactly N finite numbers.
    pub fn numbers<const N: usize>(&self, what: &str) -> Option<[f64; N]> {
        let items = self.array_of::<N>(what)?;
        let numbers = items.each_ref().map(|item| item.number());
        numbers.iter().all(Option::is_some).then(|| numbers.map(Option::unwrap_or_default))
    }

    /// Three finite numbers.
    pub fn vector(&self) -> Option<DVec3> {
        self.numbers::<3>("three numbers [x, y, z]").map(DVec3::from_array)
    }

    /// A vector of some length, normalised.
    pub fn direction(&self) -> Option<DVec3> {
        let unit = self.vector()?.try_normalize();
        if unit.is_none() {
            self.error("must be a direction, but its length is 0 or cannot be represented");
        }
        unit
    }

    /// The value of `key`, if this is a table that has it.
    pub fn member(&self, key: &str) -> Option<Item<'a>> {
        let Value::Table(entries) = &self.node.value else { return None };
        entries.iter().find(|e| e.key == key).map(|e| child(self.cx, &self.path, e))
    }

    /// The table, with unknown keys reported and keys of later versions refused by name.
    pub fn table(&self, section: &'static Section) -> Option<Fields<'a>> {
        let Value::Table(entries) = &self.node.value else {
            return self.wrong_kind("a table");
        };
        let (cx, path, at) = (self.cx, self.path.clone(), self.at);
        let mut fields = Fields { cx, path, at, entries, section, misspelt: Vec::new() };
        fields.check();
        Some(fields)
    }

    /// A table of items under names the user chose.
    pub fn named_items(&self) -> Option<Vec<(&'a str, Item<'a>)>> {
        let Value::Table(entries) = &self.node.value else {
            return self.wrong_kind("a table");
        };
        Some(entries.iter().map(|e| (e.key.as_str(), child(self.cx, &self.path, e))).collect())
    }
}

impl<'a> Fields<'a> {
    /// The tables of the whole file.
    pub fn root(cx: &'a Context<'a>, entries: &'a [Entry], section: &'static Section) -> Self {
        let (path, at) = (String::new(), &Origin::Whole);
        let mut fields = Fields { cx, path, at, entries, section, misspelt: Vec::new() };
        fields.check();
        fields
    }

    fn check(&mut self) {
        let section = self.section;
        for entry in self.entries {
            let key = entry.key.as_str();
            if section.key(key).is_some() {
                continue;
            }
            let path = join(&self.path, key);
            if section.later.contains(&key) {
                let help = Some("remove it, or use a later version".to_owned());
                self.cx.error(&entry.key_origin, &path, format!("`{path}` is not supported yet"), help);
                continue;
            }
            let all = section.names().chain(section.later.iter().copied());
            let meant = nearest(key, all.clone());
            let help = meant.map_or_else(|| format!("known keys: {}", list(all)), suggestion);
            self.cx.error(&entry.key_origin, &path, format!("unknown key `{key}`"), Some(help));
            self.misspelt.push(meant.unwrap_or(""));
        }
    }

    pub fn get(&self, key: &str) -> Option<Item<'a>> {
        self.assert_known(key);
        self.entries.iter().find(|e| e.key == key).map(|e| child(self.cx, &self.path, e))
    }

    pub fn has(&self, key: &str) -> bool {
        self.assert_known(key);
        self.entries.iter().any(|e| e.key == key)
    }

    /// A decoder that asks for a key without a row would never see it.
    fn assert_known(&self, key: &str) {
        let known = self.section.key(key).is_some() || self.section.later.contains(&key);
        assert!(known, "`{key}` has no row in scene::keys for `{}`", self.section.path);
    }

    /// Says `warning` to the user, once.
    pub fn warn(&self, warning: String) {
        self.cx.warn(warning);
    }

    /// The value of `key`, whose absence is an error; `help` shows how to write it.
    pub fn require(&self, key: &str, help: &str) -> Option<Item<'a>> {
        let item = self.get(key);
        if item.is_none() && !self.misspelt.contains(&key) {
            self.cx.error(self.at, &join(&self.path, key), format!("`{key}` is missing"), Some(format!("add {help}")));
        }
        item
    }

    /// The one key that is present of those of which there must be one; several or none are an error. `what` names the thing
    /// chosen.
    pub fn exactly_one(&self, what: &str) -> Option<Item<'a>> {
        let names: Vec<&str> = self.section.one_of().collect();
        let present: Vec<&Entry> = self.entries.iter().filter(|e| names.contains(&e.key.as_str())).collect();
        match present[..] {
            [entry] => Some(child(self.cx, &self.path, entry)),
            // An unknown key was probably meant to be one.
            [] if !self.misspelt.is_empty() => None,
            [] => {
                self.error_help(
                    format!("has no {what}"),
                    format!("add exactly one of {}", list(names.iter().copied())),
                );
                None
            }
            [_, second, ..] => {
                self.cx.error(
                    &second.key_origin,
                    &join(&self.path, &second.key),
                    format!(
                        "only one {what} is allowed, but {} are given",
                        list(present.iter().map(|e| e.key.as_str()))
                    ),
                    Some("keep exactly one".to_owned()),
                );
                None
            }
        }
    }

    pub fn error_help(&self, message: impl Into<String>, help: impl Into<String>) {
        self.cx.error(self.at, &self.path, message, Some(help.into()));
    }
}

fn child<'a>(cx: &'a Context<'a>, parent: &str, entry: &'a Entry) -> Item<'a> {
    // A table's own span may be its header or nothing at all; its key is always there.
    let at = if matches!(entry.node.value, Value::Table(_)) { &entry.key_origin } else { &entry.node.origin };
    Item { cx, node: &entry.node, path: join(parent, &entry.key), at }
}

/// `parent.key`; keys that TOML would quote are quoted.
pub fn join(parent: &str, key: &str) -> String {
    let bare = !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    let key = if bare { key.to_owned() } else { format!("{key:?}") };
    if parent.is_empty() { key } else { format!("{parent}.{key}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_quoted_where_toml_would() {
        assert_eq!(join("materials", "my paint"), "materials.\"my paint\"");
        assert_eq!(join("", "film"), "film");
    }
}
