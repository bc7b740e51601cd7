//! What became of everything in a scene: `IMPORT.md`.

use std::collections::BTreeMap;
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
    translated: BTreeMap<String, Vec<Place>>,
    said: BTreeMap<(Fate, String), Vec<Place>>,
}

/// Places of one thing that are listed.
const MOST_PLACES: usize = 24;

impl Report {
    pub fn translated(&mut self, what: impl Into<String>, place: Place) {
        self.translated.entry(what.into()).or_default().push(place);
    }

    pub fn say(&mut self, fate: Fate, place: Option<Place>, what: impl Into<String>) {
        let places = self.said.entry((fate, what.into())).or_default();
        if let Some(place) = place.filter(|place| !places.contains(place)) {
            places.push(place);
        }
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
        self.translated.values().map(Vec::len).sum()
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
                let _ = writeln!(page, "- {what}{}", shown(places));
            }
        }
        let _ = write!(page, "\n## Translated\n\n");
        for (what, places) in &self.translated {
            let _ = writeln!(page, "- {what}{}", shown(places));
        }
        page
    }
}

fn shown(places: &[Place]) -> String {
    if places.is_empty() {
        return String::new();
    }
    let mut list: Vec<String> = places.iter().take(MOST_PLACES).map(Place::shown).collect();
    if places.len() > MOST_PLACES {
        list.push(format!("and {} more", places.len() - MOST_PLACES));
    }
    format!(" ({})", list.join(", "))
}
