//! What became of everything in a scene: `IMPORT.md`.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::{Path, PathBuf};

use super::{Summary, text};

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

/// How far what stands in a thing's place is from it, in the terms of who looks at the picture.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Deviation {
    /// No further than this: worked out from the scene, or from a closed form.
    AtMost(String),
    /// As far as this in the cases that were measured (tests/import/deviations.rs).
    Measured(String),
    /// No number bounds it: what is lost, and what that depends on.
    Unbounded(String),
}

impl Deviation {
    pub fn at_most(what: impl Into<String>) -> Deviation {
        Deviation::AtMost(what.into())
    }

    pub fn measured(what: impl Into<String>) -> Deviation {
        Deviation::Measured(what.into())
    }

    pub fn unbounded(what: impl Into<String>) -> Deviation {
        Deviation::Unbounded(what.into())
    }
}

impl std::fmt::Display for Deviation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Deviation::AtMost(what) => write!(f, "off by at most {what}"),
            Deviation::Measured(what) => write!(f, "measured off by {what}"),
            Deviation::Unbounded(what) => write!(f, "no bound: {what}"),
        }
    }
}

/// What became of a thing that is not exactly as it was.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Fate {
    /// Nothing stands in its place.
    LeftOut,
    /// Something near it does, so far off.
    Approximated(Deviation),
    /// The scene says nothing of it.
    Chosen,
}

/// Everything that is to be said.
#[derive(Debug, Default)]
pub struct Report {
    /// The first places, and how many there are.
    translated: BTreeMap<String, (Vec<Place>, usize)>,
    /// Each place once, however often it was come to.
    said: BTreeMap<(String, Fate), BTreeSet<Place>>,
    /// Where in the code approximations were made, for the test that meets them all.
    #[cfg(test)]
    pub made_at: BTreeSet<(&'static str, u32)>,
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

    fn say(&mut self, fate: Fate, place: Option<Place>, what: impl Into<String>) {
        self.said.entry((what.into(), fate)).or_default().extend(place);
    }

    #[track_caller]
    pub fn approximated(&mut self, place: impl Into<Option<Place>>, what: impl Into<String>, off: Deviation) {
        #[cfg(test)]
        {
            let caller = std::panic::Location::caller();
            self.made_at.insert((caller.file(), caller.line()));
        }
        self.say(Fate::Approximated(off), place.into(), what);
    }

    pub fn left_out(&mut self, place: impl Into<Option<Place>>, what: impl Into<String>) {
        self.say(Fate::LeftOut, place.into(), what);
    }

    /// `value`, or the nearest in `range` with a word on it.
    pub fn within(&mut self, place: Place, what: &str, value: f64, range: [f64; 2]) -> f64 {
        let taken = value.clamp(range[0], range[1]);
        if taken != value {
            let off = Deviation::at_most(text::up((value - taken).abs()));
            self.approximated(place, format!("{what} of {value} as {taken}"), off);
        }
        taken
    }

    pub fn chosen(&mut self, place: impl Into<Option<Place>>, what: impl Into<String>) {
        self.say(Fate::Chosen, place.into(), what);
    }

    fn of(&self, wanted: impl Fn(&Fate) -> bool) -> impl Iterator<Item = (&str, &Fate, &BTreeSet<Place>)> {
        self.said
            .iter()
            .filter(move |((_, fate), _)| wanted(fate))
            .map(|((what, fate), places)| (&**what, fate, places))
    }

    pub fn summary(&self) -> Summary {
        Summary {
            translated: self.translated.values().map(|(_, count)| count).sum(),
            approximated: self.of(|fate| matches!(fate, Fate::Approximated(_))).count(),
            left_out: self.of(|fate| *fate == Fate::LeftOut).count(),
            chosen: self.of(|fate| *fate == Fate::Chosen).count(),
        }
    }

    /// Writes a section of the page; writing into a string cannot fail.
    fn section(&self, page: &mut String, title: &str, wanted: impl Fn(&Fate) -> bool + Copy) {
        let _ = write!(page, "\n## {title}\n\n");
        if self.of(wanted).next().is_none() {
            let _ = writeln!(page, "Nothing.");
        }
        for (what, fate, places) in self.of(wanted) {
            let off = if let Fate::Approximated(off) = fate { format!(": {off}") } else { String::new() };
            let _ = writeln!(page, "- {what}{}{off}", shown(places, places.len()));
        }
    }

    /// The page, for the scene in `source`.
    pub fn page(&self, source: &Path) -> String {
        let name = source.file_name().unwrap_or_default().to_string_lossy();
        let mut page =
            format!("# Import of {name}\n\nMade by `spectile import`. Numbers behind names of files are lines.\n");
        self.section(&mut page, "Left out", |fate| *fate == Fate::LeftOut);
        self.section(&mut page, "Approximated", |fate| matches!(fate, Fate::Approximated(_)));
        self.section(&mut page, "Chosen", |fate| *fate == Fate::Chosen);
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
        let summary = report.summary();
        assert_eq!((summary.left_out, summary.translated), (1, 60));
        assert!(
            page.contains("- hair (scene.xml:1, scene.xml:2, ") && page.contains("scene.xml:24, and 6 more)"),
            "{page}"
        );
        assert!(page.contains("- sphere (scene.xml:1, ") && page.contains("scene.xml:24, and 36 more)"), "{page}");
    }
}
