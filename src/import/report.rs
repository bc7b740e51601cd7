//! What became of everything in a scene: `IMPORT.md`.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// A place in the files of a scene.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    pub file: PathBuf,
    /// 1-based, where the file has lines.
    pub line: Option<usize>,
    /// Where it has none: a path of JSON.
    pub path: Option<String>,
}

impl Place {
    pub fn line(file: &Path, line: usize) -> Place {
        Place { file: file.to_owned(), line: Some(line), path: None }
    }

    /// With the last part of the file's path.
    fn shown(&self) -> String {
        let name = self.file.file_name().unwrap_or_default().to_string_lossy();
        match (self.line, &self.path) {
            (Some(line), _) => format!("{name}:{line}"),
            (None, Some(path)) => format!("{name} `{path}`"),
            (None, None) => name.into_owned(),
        }
    }
}

/// What can be said of a thing that is not exactly as it was.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Fate {
    /// Something near it stands in its place.
    Approximated,
    /// Nothing does.
    LeftOut,
    /// The scene says nothing of it.
    Chosen,
}

/// Everything that is to be said.
#[derive(Debug, Default)]
pub struct Report {
    /// The first places, and how many there are.
    translated: BTreeMap<String, (Vec<Place>, usize)>,
    /// Each place once, however often it was come to.
    said: BTreeMap<(Fate, String), BTreeSet<Place>>,
}

/// Places of one thing that are listed.
const MOST_PLACES: usize = 24;

impl Report {
    pub fn translated(&mut self, what: impl Into<String>, place: Place) {
        let (listed, count) = self.translated.entry(what.into()).or_default();
        *count += 1;
        if listed.len() < MOST_PLACES {
            listed.push(place);
        }
    }

    pub fn say(&mut self, fate: Fate, place: Option<Place>, what: impl Into<String>) {
        self.said.entry((fate, what.into())).or_default().extend(place);
    }

    pub fn approximated(&mut self, place: Place, what: impl Into<String>) {
        self.say(Fate::Approximated, Some(place), what);
    }

    pub fn left_out(&mut self, place: Place, what: impl Into<String>) {
        self.say(Fate::LeftOut, Some(place), what);
    }

    /// `value`, or the nearest in `range` with a word on it.
    pub fn within(&mut self, place: Place, what: &str, value: f64, range: [f64; 2]) -> f64 {
        let taken = value.clamp(range[0], range[1]);
        if taken != value {
            self.approximated(place, format!("{what} of {value} as {taken}"));
        }
        taken
    }

    pub fn chosen(&mut self, what: impl Into<String>) {
        self.say(Fate::Chosen, None, what);
    }

    /// Kinds of things of this fate.
    pub fn count(&self, fate: Fate) -> usize {
        self.said.keys().filter(|(of, _)| *of == fate).count()
    }

    /// Things that are exactly as they were.
    pub fn translations(&self) -> usize {
        self.translated.values().map(|(_, count)| count).sum()
    }

    /// The page, for the scene in `source`.
    pub fn page(&self, source: &Path) -> String {
        let name = source.file_name().unwrap_or_default().to_string_lossy();
        let mut page =
            format!("# Import of {name}\n\nMade by `spectile import`. Numbers behind names of files are lines.\n");
        for (fate, title, none) in [
            (Fate::LeftOut, "Left out", "Nothing."),
            (Fate::Approximated, "Approximated", "Nothing."),
            (Fate::Chosen, "Chosen", "Nothing."),
        ] {
            // Writing into a string cannot fail.
            let _ = write!(page, "\n## {title}\n\n");
            if self.count(fate) == 0 {
                let _ = writeln!(page, "{none}");
            }
            for ((_, what), places) in self.said.iter().filter(|((of, _), _)| *of == fate) {
                let _ = writeln!(page, "- {what}{}", shown(places, places.len()));
            }
        }
        let _ = write!(page, "\n## Translated\n\n");
        for (what, (listed, count)) in &self.translated {
            let _ = writeln!(page, "- {what}{}", shown(listed, *count));
        }
        page
    }
}

/// The first of `count` places.
fn shown<'p>(places: impl IntoIterator<Item = &'p Place>, count: usize) -> String {
    if count == 0 {
        return String::new();
    }
    let mut list: Vec<String> = places.into_iter().take(MOST_PLACES).map(Place::shown).collect();
    if count > MOST_PLACES {
        list.push(format!("and {} more", count - MOST_PLACES));
    }
    format!(" ({})", list.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A place that is come to several times is one, whatever was said between.
    #[test]
    fn places_are_listed_once_and_counted() {
        let mut report = Report::default();
        let at = |line| Place::line(Path::new("a/scene.xml"), line);
        for line in (1..=30).chain(1..=30) {
            report.left_out(at(line), "hair");
            report.translated("sphere", at(line));
        }
        let page = report.page(Path::new("a/scene.xml"));
        assert_eq!((report.count(Fate::LeftOut), report.translations()), (1, 60));
        assert!(
            page.contains("- hair (scene.xml:1, scene.xml:2, ") && page.contains("scene.xml:24, and 6 more)"),
            "{page}"
        );
        assert!(page.contains("- sphere (scene.xml:1, ") && page.contains("scene.xml:24, and 36 more)"), "{page}");
    }
}
