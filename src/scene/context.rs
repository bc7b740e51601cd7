//! Where mistakes and warnings are gathered while a scene is decoded, and how they are shown.

use std::cell::RefCell;
use std::ops::Range;
use std::path::{Path, PathBuf};

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};

use super::tree::{self, Entry, Origin};
use crate::error::Problem;

/// The file being read and everything found wrong with it so far. Decoding goes on after a mistake, so that
/// independent ones are reported together.
pub struct Context<'a> {
    /// The scene file, as the user named it.
    pub file: &'a Path,
    text: &'a str,
    overrides: &'a [(String, String)],
    problems: RefCell<Vec<Problem>>,
    warnings: RefCell<Vec<String>>,
}

impl<'a> Context<'a> {
    pub fn new(file: &'a Path, text: &'a str, overrides: &'a [(String, String)]) -> Self {
        Context { file, text, overrides, problems: RefCell::default(), warnings: RefCell::default() }
    }

    /// The document, or its mistakes of syntax recorded.
    pub fn document(&self) -> Option<Vec<Entry>> {
        let errors = match tree::parse_document(self.text) {
            Ok(root) => return Some(root),
            Err(errors) => errors,
        };
        let mut last_line = None;
        for (span, message) in errors {
            let line = span.as_ref().map(|span| position(self.text, span.start).0);
            // What follows on the same line is mostly an echo of the first mistake.
            if line.is_none() || line != last_line {
                let origin = span.map_or(Origin::Whole, Origin::File);
                self.error(&origin, "", format!("is not valid TOML: {message}"), None);
            }
            last_line = line;
        }
        None
    }

    /// A path of the scene, which is relative to the scene file.
    pub fn path(&self, relative: &str) -> PathBuf {
        self.file.parent().unwrap_or(Path::new("")).join(relative)
    }

    /// Records a mistake at `origin`; `key` is the dotted key, empty for the file as a whole.
    pub fn error(&self, origin: &Origin, key: &str, message: impl Into<String>, help: Option<String>) {
        let mut problem = Problem {
            file: self.file.to_owned(),
            key: (!key.is_empty()).then(|| key.to_owned()),
            message: message.into(),
            help,
            ..Problem::default()
        };
        match origin {
            Origin::File(span) => {
                let (line, column) = position(self.text, span.start);
                problem.line = Some(line);
                problem.column = Some(column);
                problem.snippet = Some(snippet(self.text, span.clone()));
            }
            Origin::Set(index) => problem.file = self.set_argument(*index),
            Origin::Whole => {}
        }
        self.push(problem);
    }

    /// Records a mistake found elsewhere (a spectrum or mesh file). The same one, met twice, is said once.
    pub fn push(&self, problem: Problem) {
        let mut problems = self.problems.borrow_mut();
        if !problems.contains(&problem) {
            problems.push(problem);
        }
    }

    /// Records a warning; the same one is said once.
    pub fn warn(&self, warning: String) {
        let mut warnings = self.warnings.borrow_mut();
        if !warnings.contains(&warning) {
            warnings.push(warning);
        }
    }

    /// All mistakes, those of the scene file first and in its order; and all warnings.
    pub fn finish(self) -> (Vec<Problem>, Vec<String>) {
        let mut problems = self.problems.into_inner();
        problems.sort_by_key(|p| {
            (p.file != self.file, if p.file == self.file { (p.line, p.column) } else { (None, None) })
        });
        (problems, self.warnings.into_inner())
    }

    /// Stands where a file name would for mistakes in `--set`: the argument itself.
    fn set_argument(&self, index: usize) -> PathBuf {
        let (key, value) = &self.overrides[index];
        PathBuf::from(format!("--set {key}={value}"))
    }
}

/// 1-based line and column (in characters) of byte `offset` of `text`.
pub fn position(text: &str, offset: usize) -> (usize, usize) {
    let offset = text.floor_char_boundary(offset.min(text.len()));
    let before = &text[..offset];
    let line_start = before.rfind('\n').map_or(0, |i| i + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}

/// The line `span` starts on, with a marker under the part of the span that lies on it.
fn snippet(text: &str, span: Range<usize>) -> String {
    // Long lines (tables written in one line) are cut to what fits around the mark.
    const BEFORE: usize = 60;
    const AFTER: usize = 100;
    let start = text.floor_char_boundary(span.start.min(text.len()));
    let line_start = text[..start].rfind('\n').map_or(0, |i| i + 1);
    let line_end = text[start..].find('\n').map_or(text.len(), |i| start + i);
    let from = if start - line_start > BEFORE { text.ceil_char_boundary(start - BEFORE) } else { line_start };
    let to = if line_end - start > AFTER { text.floor_char_boundary(start + AFTER) } else { line_end };
    let shown = text[from..to].trim_end_matches('\r');
    let mark_start = (start - from).min(shown.len());
    let mark_end = text.floor_char_boundary(span.end.clamp(start, to)) - from;
    let mark = mark_start..mark_end.clamp(mark_start, shown.len());
    let source =
        Snippet::source(shown).line_start(position(text, start).0).annotation(AnnotationKind::Primary.span(mark));
    Renderer::plain().render(&[Group::with_level(Level::ERROR).element(source)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_count_characters_from_one() {
        let text = "é = 1\n  ö = 2\n";
        assert_eq!(position(text, 0), (1, 1));
        assert_eq!(position(text, text.find('1').unwrap()), (1, 5));
        assert_eq!(position(text, text.find('ö').unwrap()), (2, 3));
        assert_eq!(position(text, 1000), (3, 1));
    }

    #[test]
    fn snippets_mark_the_place() {
        let text = "a = 1\nreflectance = 1.5\n";
        let at = text.find("1.5").unwrap();
        let shown = snippet(text, at..at + 3);
        assert!(shown.contains("2 | reflectance = 1.5"), "{shown}");
        assert!(shown.contains("^^^"), "{shown}");
    }

    #[test]
    fn snippets_survive_any_span() {
        let text = "é\r\n\t日本語 = [\n1,2]\n";
        for start in 0..text.len() + 3 {
            for end in 0..text.len() + 3 {
                snippet(text, start..end);
            }
        }
        snippet("", 0..0);
    }
}
