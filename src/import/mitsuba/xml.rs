//! A Mitsuba scene as a tree of elements: with what it includes, and with parameters put in.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use crate::error::Problem;

/// An element.
#[derive(Debug)]
pub struct Node {
    pub tag: String,
    pub attributes: Vec<(String, String)>,
    pub children: Vec<Node>,
    pub file: Rc<Path>,
    pub line: usize,
}

type Read<T> = Result<T, Box<Problem>>;

/// Elements within elements.
const DEEPEST: usize = 64;
/// Files that a scene may be made of, each counted as often as it is included; and the elements of all.
const MOST_FILES: usize = 1000;
const MOST_ELEMENTS: usize = 2_000_000;

impl Node {
    /// An attribute, if it is there.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
    }

    pub fn problem(&self, message: impl Into<String>) -> Box<Problem> {
        problem(&self.file, self.line, message)
    }
}

fn problem(file: &Path, line: usize, message: impl Into<String>) -> Box<Problem> {
    Box::new(Problem { file: file.to_owned(), line: Some(line), message: message.into(), ..Problem::default() })
}

/// Reads files and what they include.
#[derive(Default)]
pub struct Files {
    parameters: HashMap<String, String>,
    /// The files that are being read, each included by the one before.
    open: Vec<PathBuf>,
    files: usize,
    elements: usize,
}

impl Files {
    /// The element `scene` of a file; those that it includes stand in it as its own.
    ///
    /// # Errors
    /// What is wrong, with file and line.
    pub fn read(&mut self, path: &Path) -> Read<Node> {
        let whole = |message: String| Box::new(Problem { file: path.to_owned(), message, ..Problem::default() });
        let identity = std::fs::canonicalize(path).map_err(|e| whole(format!("cannot be read: {e}")))?;
        if self.open.contains(&identity) {
            return Err(whole("includes itself".to_owned()));
        }
        self.files += 1;
        if self.files > MOST_FILES {
            return Err(whole(format!("is included after {MOST_FILES} others: that many are read at most")));
        }
        let bytes = std::fs::read(path).map_err(|e| whole(format!("cannot be read: {e}")))?;
        let text = String::from_utf8(bytes).map_err(|_| whole("is not UTF-8".to_owned()))?;
        self.open.push(identity);
        let root = self.parse(&text, path);
        self.open.pop();
        root
    }

    fn parse(&mut self, text: &str, path: &Path) -> Read<Node> {
        let file: Rc<Path> = path.into();
        let mut reader = Reader::from_str(text);
        let mut stack: Vec<Node> = Vec::new();
        let (mut counted, mut line) = (0, 1);
        let root = loop {
            let at = text.floor_char_boundary(reader.buffer_position() as usize);
            line += text[counted..at].matches('\n').count();
            counted = at;
            let event = reader.read_event().map_err(|e| {
                let what = e.to_string().replace(['\n', '\r'], " ");
                problem(path, line, format!("is no XML that can be read: {what}"))
            })?;
            // Blanks before an element are events of their own, so that `line` is that of its first byte.
            let (element, is_whole) = match event {
                Event::Start(start) => (self.element(&start, &file, line)?, false),
                Event::Empty(start) => (self.element(&start, &file, line)?, true),
                Event::End(_) => {
                    let Some(node) = stack.pop() else { continue };
                    match self.close(node, &mut stack)? {
                        Some(root) => break root,
                        None => continue,
                    }
                }
                Event::Eof => {
                    let what =
                        stack.last().map_or("has no element".to_owned(), |node| format!("ends within `{}`", node.tag));
                    return Err(problem(path, line, what));
                }
                _ => continue,
            };
            if stack.len() >= DEEPEST {
                return Err(problem(path, line, format!("has elements within more than {DEEPEST} others")));
            }
            if !is_whole {
                stack.push(element);
            } else if let Some(root) = self.close(element, &mut stack)? {
                break root;
            }
        };
        if root.tag != "scene" {
            return Err(root.problem(format!("is no Mitsuba scene: its first element is `{}`, not `scene`", root.tag)));
        }
        match root.attribute("version").map(|version| version.split('.').next().and_then(|v| v.parse::<u32>().ok())) {
            Some(Some(2..)) => Ok(root),
            Some(_) => Err(root.problem("is a scene of a Mitsuba before version 2: let Mitsuba 3 convert it")),
            None => Err(root.problem("the scene has no `version`")),
        }
    }

    fn element(&mut self, start: &BytesStart, file: &Rc<Path>, line: usize) -> Read<Node> {
        self.elements += 1;
        if self.elements > MOST_ELEMENTS {
            return Err(problem(file, line, format!("the scene has more than {MOST_ELEMENTS} elements")));
        }
        let mut attributes = Vec::new();
        for attribute in start.attributes() {
            let attribute =
                attribute.map_err(|e| problem(file, line, format!("has an attribute that is none: {e}")))?;
            let value = quick_xml::escape::unescape(&attribute.value)
                .map_err(|e| problem(file, line, format!("has an attribute that cannot be read: {e}")))?;
            let value = self.filled(&value).map_err(|message| problem(file, line, message))?;
            attributes.push((attribute.key.as_ref().to_owned(), value));
        }
        let tag = start.local_name().as_ref().to_owned();
        Ok(Node { tag, attributes, children: Vec::new(), file: file.clone(), line })
    }

    /// With the values of parameters in the place of `$name`, the longest name that fits.
    fn filled(&self, value: &str) -> Result<String, String> {
        let Some((before, mut rest)) = value.split_once('$') else { return Ok(value.to_owned()) };
        let mut out = before.to_owned();
        loop {
            let fitting = self.parameters.iter().filter(|(name, _)| rest.starts_with(name.as_str()));
            let Some((name, value)) = fitting.max_by_key(|(name, _)| name.len()) else {
                let name: String = rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').take(40).collect();
                return Err(format!("`${name}` has no <default>"));
            };
            out += value;
            if out.len() > 1 << 20 {
                return Err("has an attribute of more than a million letters".to_owned());
            }
            rest = &rest[name.len()..];
            match rest.split_once('$') {
                Some((before, after)) => {
                    out += before;
                    rest = after;
                }
                None => return Ok(out + rest),
            }
        }
    }

    /// Puts a whole element where it belongs; gives it back if it is the outermost.
    fn close(&mut self, mut node: Node, stack: &mut [Node]) -> Read<Option<Node>> {
        let needed = |node: &Node, key: &str| {
            node.attribute(key).map(str::to_owned).ok_or_else(|| node.problem(format!("`{}` has no `{key}`", node.tag)))
        };
        match node.tag.as_str() {
            "default" => {
                // The first one counts, as what is given from outside would.
                let (name, value) = (needed(&node, "name")?, needed(&node, "value")?);
                if name.is_empty() {
                    return Err(node.problem("`default` has an empty `name`"));
                }
                self.parameters.entry(name).or_insert(value);
                return Ok(None);
            }
            "include" => {
                let name = needed(&node, "filename")?;
                let path = inside(&name, &node)?;
                let children = self.read(&path)?.children;
                if let Some(parent) = stack.last_mut() {
                    parent.children.extend(children);
                }
                return Ok(None);
            }
            _ => {}
        }
        match stack.last_mut() {
            Some(parent) => parent.children.push(node),
            None => {
                node.children.shrink_to_fit();
                return Ok(Some(node));
            }
        }
        Ok(None)
    }
}

/// The file that `name` means in the file of `node`.
pub fn inside(name: &str, node: &Node) -> Read<PathBuf> {
    super::super::path_beside(&node.file, name).map_err(|message| node.problem(message))
}
