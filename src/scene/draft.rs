//! A scene that a program has made or edited, as a tree instead of a text.

use std::path::{Path, PathBuf};

use super::Scene;
use super::context::Context;
use super::file::{resolve, without_mark};
use super::tree::{Entry, Node, Origin, Value};
use crate::{Error, Result};

/// A tree of a scene, and the text that it was read from, so that mistakes in what is as it was there are shown in their lines.
#[derive(Debug)]
pub struct Draft {
    file: PathBuf,
    text: String,
    root: Vec<Entry>,
}

impl Draft {
    /// `file` locates relative paths and messages. `text` is what `root` was before it was edited; empty where it was nothing.
    pub fn new(file: PathBuf, text: String, root: Vec<Entry>) -> Draft {
        Draft { file, text, root }
    }

    pub fn file(&self) -> &Path {
        &self.file
    }

    /// Every text in the tree: names, and files.
    pub fn texts(&self) -> Vec<&str> {
        fn gather<'a>(value: &'a Value, texts: &mut Vec<&'a str>) {
            match value {
                Value::String(text) => texts.push(text),
                Value::Array(items) => items.iter().for_each(|item| gather(&item.value, texts)),
                Value::Table(entries) => entries.iter().for_each(|entry| gather(&entry.node.value, texts)),
                _ => {}
            }
        }
        let mut texts = Vec::new();
        self.root.iter().for_each(|entry| gather(&entry.node.value, &mut texts));
        texts
    }

    /// The scene, with `overrides` as in [`super::load`].
    ///
    /// # Errors
    /// [`Error::Input`] with every independent mistake.
    pub fn resolve(&self, overrides: &[(String, String)]) -> Result<Scene> {
        let cx = Context::new(&self.file, without_mark(&self.text), overrides);
        let Some(written) = cx.document() else { return Err(Error::Input(cx.finish().0)) };
        let root = place_table(&self.root, &written).0;
        resolve(cx, root, overrides)
    }
}

/// `edited` with the places of what is as it is `written`, and whether all of it is.
fn place_table(edited: &[Entry], written: &[Entry]) -> (Vec<Entry>, bool) {
    let mut same = edited.len() == written.len();
    let entries = edited.iter().map(|entry| {
        let Some(old) = written.iter().find(|old| old.key == entry.key) else {
            same = false;
            return entry.clone();
        };
        let (node, is_same) = place(&entry.node, &old.node);
        same &= is_same;
        // A table that has changed is not what stands below its key there.
        let key_origin = if is_same { old.key_origin.clone() } else { Origin::Whole };
        Entry { key: entry.key.clone(), key_origin, node }
    });
    let entries = entries.collect();
    (entries, same)
}

fn place(edited: &Node, written: &Node) -> (Node, bool) {
    let (value, same) = match (&edited.value, &written.value) {
        (Value::Table(edited), Value::Table(written)) => {
            let (entries, same) = place_table(edited, written);
            (Value::Table(entries), same)
        }
        (Value::Array(edited), Value::Array(written)) => {
            let mut same = edited.len() == written.len();
            let items = edited.iter().enumerate().map(|(i, item)| {
                let (node, is_same) = written.get(i).map_or_else(|| (item.clone(), false), |old| place(item, old));
                same &= is_same;
                node
            });
            let items = items.collect();
            (Value::Array(items), same)
        }
        (edited, written) => (edited.clone(), is_same(edited, written)),
    };
    // What has changed in part has no place of its own: the text there says something else.
    let origin = if same { written.origin.clone() } else { Origin::Whole };
    (Node { value, origin }, same)
}

/// Whether two values that hold no others are the same.
fn is_same(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::String(a), Value::String(b)) => a == b,
        (Value::Integer(a), Value::Integer(b)) => a == b,
        // A NaN that stays one has not changed.
        (Value::Float(a), Value::Float(b)) => a.to_bits() == b.to_bits() || a == b,
        (Value::Boolean(a), Value::Boolean(b)) => a == b,
        (Value::Datetime(a), Value::Datetime(b)) => a == b,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::tree::parse_document;

    const TEXT: &str = "[film]\nwidth = 8\nheight = 0\n[camera.perspective]\nposition = [0, 0, 5]\nfov = 200\n";

    fn problems(edit: impl Fn(&mut Vec<Entry>)) -> Vec<(Option<usize>, String)> {
        let mut root = parse_document(TEXT).expect("TOML");
        edit(&mut root);
        match Draft::new("s.toml".into(), TEXT.to_owned(), root).resolve(&[]) {
            Err(Error::Input(problems)) => problems.into_iter().map(|p| (p.line, p.key.unwrap_or_default())).collect(),
            other => panic!("{other:?}"),
        }
    }

    fn set(root: &mut [Entry], path: &[&str], value: Value) {
        let entry = root.iter_mut().find(|entry| entry.key == path[0]).expect("a key");
        match (&path[1..], &mut entry.node.value) {
            ([], _) => entry.node = Node { value, origin: Origin::Whole },
            (rest, Value::Table(entries)) => set(entries, rest, value),
            _ => panic!("no table"),
        }
    }

    #[test]
    fn what_is_as_it_was_written_keeps_its_line_and_what_is_not_has_none() {
        let line_of = |found: &[(Option<usize>, String)], key: &str| {
            found.iter().find(|(_, k)| k == key).unwrap_or_else(|| panic!("{key}: {found:?}")).0
        };
        let as_written = problems(|_| ());
        assert_eq!(line_of(&as_written, "film.height"), Some(3));
        assert_eq!(line_of(&as_written, "camera.perspective.fov"), Some(6));
        let edited = problems(|root| set(root, &["film", "height"], Value::Integer(-1)));
        assert_eq!(line_of(&edited, "film.height"), None);
        assert_eq!(line_of(&edited, "camera.perspective.fov"), Some(6));
        let without = problems(|root| set(root, &["film"], Value::Table(Vec::new())));
        assert_eq!(line_of(&without, "film.height"), None);
    }

    #[test]
    fn a_draft_without_a_text_is_the_scene_of_its_tree() {
        let text = std::fs::read_to_string("scenes/cornell/cornell.toml").expect("the scene");
        let root = parse_document(&text).expect("TOML");
        let file = Path::new("scenes/cornell/cornell.toml");
        let loaded = crate::scene::load(file, &[]).expect("a scene");
        for text in [String::new(), text] {
            let draft = Draft::new(file.to_owned(), text, root.clone());
            assert_eq!(draft.resolve(&[]).expect("a scene").digest, loaded.digest);
        }
    }
}
