//! What a scene file may contain. A decoder takes the keys of a table from here ([`super::decode::Item::table`]), and of the
//! same rows `docs/scene.md` and `spectile help scene` are made: what a decoder accepts is on the page. `tests/manual`
//! holds types, defaults and ranges against the decoder, and has every example planned.
//!
//! A new key is a row; a new table is a [`Section`], named in [`SECTIONS`] and given a place in `page.md`.

mod cameras;
mod lights;
mod materials;
mod media;
mod objects;
mod page;
mod sensor;
mod spectra;
mod view;

use std::fmt;

pub use cameras::*;
pub use lights::*;
pub use materials::*;
pub use media::*;
pub use objects::*;
pub use page::{page, text};
pub use sensor::*;
pub use spectra::*;
pub use view::*;

use super::Quantity;
use super::words::{did_you_mean, edit_distance, list};

/// What a temperature may be instead of a number.
const CELSIUS: &str = "text with its unit (K, C or F) such as `\"37 C\"`";

/// A table of the scene file.
#[derive(Debug)]
pub struct Section {
    /// Its dotted path; NAME stands for what the user names, N for a place in a list. One word for tables that stand in many
    /// places.
    pub path: &'static str,
    /// How it is written, in Markdown.
    pub heading: &'static str,
    /// In a few words, for lists of sections.
    pub summary: &'static str,
    /// What is to be known before its keys; Markdown.
    pub about: &'static str,
    pub keys: &'static [Key],
    /// Keys that the decoder refuses by name until a later version has them.
    pub later: &'static [&'static str],
    /// Where the table stands in its examples.
    pub at: &'static str,
    /// Parts of a scene, in TOML, that add to or replace those of the page's first one. Each key is in one of them.
    pub examples: &'static [&'static str],
    /// What is to be known besides; Markdown.
    pub notes: &'static str,
}

/// A key of a table.
#[derive(Debug, Clone, Copy)]
pub struct Key {
    pub name: &'static str,
    pub kind: Kind,
    /// What it may be instead, in words, besides [`Key::tables`].
    also: &'static str,
    /// Tables that its value may be, or has.
    tables: &'static [&'static Section],
    unit: &'static str,
    range: &'static str,
    pub absent: Absent,
    pub meaning: &'static str,
}

/// What a value is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Number,
    Whole,
    Boolean,
    /// One of these words.
    Choice(&'static [&'static str]),
    Text,
    /// Where a file or folder is.
    File,
    /// Something that the scene names elsewhere: a material, a medium.
    Name(&'static str),
    /// Three numbers.
    Vector,
    /// Three numbers that are not all 0, of any length.
    Direction,
    /// A list, as it is written.
    List(&'static str),
    Spectrum(Quantity),
    Table,
    /// Tables under names that the user chooses.
    NamedTables,
    ListOfTables,
    /// Nothing: it is refused with its reason.
    Refused,
}

/// What holds where a key is absent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Absent {
    /// An error.
    Error,
    /// An error, unless other keys stand in for it, in words.
    Unless(&'static str),
    /// The table has exactly one of the keys that are marked so.
    OneOf,
    /// The same as with this value, in TOML.
    Same(&'static str),
    /// What the words say.
    Means(&'static str),
}

impl Key {
    const fn new(name: &'static str, kind: Kind, absent: Absent, meaning: &'static str) -> Key {
        Key { name, kind, also: "", tables: &[], unit: "", range: "", absent, meaning }
    }

    const fn required(name: &'static str, kind: Kind, meaning: &'static str) -> Key {
        Key::new(name, kind, Absent::Error, meaning)
    }

    const fn one_of(name: &'static str, kind: Kind, meaning: &'static str) -> Key {
        Key::new(name, kind, Absent::OneOf, meaning)
    }

    /// Absent, it is `value`.
    const fn default(name: &'static str, kind: Kind, value: &'static str, meaning: &'static str) -> Key {
        Key::new(name, kind, Absent::Same(value), meaning)
    }

    /// Absent, it is as `words` say.
    const fn optional(name: &'static str, kind: Kind, words: &'static str, meaning: &'static str) -> Key {
        Key::new(name, kind, Absent::Means(words), meaning)
    }

    const fn unless(self, words: &'static str) -> Key {
        Key { absent: Absent::Unless(words), ..self }
    }

    const fn unit(self, unit: &'static str) -> Key {
        Key { unit, ..self }
    }

    /// An interval, its ends included with `[` and `]`, excluded with `(` and `)`; what else is asked for after a comma.
    const fn range(self, range: &'static str) -> Key {
        Key { range, ..self }
    }

    const fn or(self, also: &'static str) -> Key {
        Key { also, ..self }
    }

    const fn tables(self, tables: &'static [&'static Section]) -> Key {
        Key { tables, ..self }
    }

    /// The tables that its value may be, or has.
    pub fn sections(&self) -> Vec<&'static Section> {
        let spectrum: &[&Section] = if matches!(self.kind, Kind::Spectrum(_)) { &[&SPECTRUM] } else { &[] };
        spectrum.iter().chain(self.tables).copied().collect()
    }

    /// Its type, in words.
    pub fn type_words(&self) -> String {
        let mut words = self.kind.to_string();
        if !self.also.is_empty() {
            words += &format!(" or {}", self.also);
        }
        if !matches!(self.kind, Kind::Table | Kind::NamedTables | Kind::ListOfTables | Kind::List(_)) {
            self.tables.iter().for_each(|table| words += &format!(" or {}", table.heading));
        }
        words
    }

    /// Its unit, empty where it has none.
    pub fn unit_words(&self) -> &'static str {
        match self.kind {
            Kind::Spectrum(quantity) => quantity.unit(),
            _ => self.unit,
        }
    }

    /// The values that are allowed, empty where all of its type are.
    pub fn range_words(&self) -> String {
        match self.kind {
            Kind::Choice(words) => list(words.iter().map(|word| format!("`\"{word}\"`"))),
            Kind::Spectrum(quantity) => quantity.interval().to_owned(),
            Kind::Direction => "not all 0".to_owned(),
            _ => self.range.to_owned(),
        }
    }

    /// What holds where it is absent, in words.
    pub fn absent_words(&self) -> String {
        match self.absent {
            Absent::Error => "required".to_owned(),
            Absent::Unless(words) => format!("required, or {words}"),
            Absent::OneOf => "one of these".to_owned(),
            Absent::Same(value) => format!("`{value}`"),
            Absent::Means(words) => words.to_owned(),
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Kind::Number => f.write_str("number"),
            Kind::Whole => f.write_str("whole number"),
            Kind::Boolean => f.write_str("true or false"),
            Kind::Choice(_) => f.write_str("word"),
            Kind::Text => f.write_str("text"),
            Kind::File => f.write_str("file"),
            Kind::Name(what) => write!(f, "name of a {what}"),
            Kind::Vector => f.write_str("`[x, y, z]`"),
            Kind::Direction => f.write_str("direction `[x, y, z]`"),
            Kind::List(written) => f.write_str(written),
            Kind::Spectrum(_) => f.write_str("spectrum"),
            Kind::Table => f.write_str("table"),
            Kind::NamedTables => f.write_str("tables by name"),
            Kind::ListOfTables => f.write_str("list of tables"),
            Kind::Refused => f.write_str("refused"),
        }
    }
}

impl Section {
    /// The names of its keys.
    pub fn names(&self) -> impl Iterator<Item = &'static str> + Clone + use<> {
        self.keys.iter().map(|key| key.name)
    }

    /// The keys of which it has exactly one.
    pub fn one_of(&self) -> impl Iterator<Item = &'static str> + use<> {
        self.keys.iter().filter(|key| key.absent == Absent::OneOf).map(|key| key.name)
    }

    pub fn key(&self, name: &str) -> Option<&'static Key> {
        self.keys.iter().find(|key| key.name == name)
    }

    /// The dotted path of one of its keys.
    pub fn path_of(&self, key: &Key) -> String {
        if self.path == SCENE.path { key.name.to_owned() } else { format!("{}.{}", self.path, key.name) }
    }
}

/// All sections, in the order of the page.
pub static SECTIONS: &[&Section] = &[
    &SCENE,
    &CAMERA,
    &PERSPECTIVE,
    &THIN_LENS,
    &DISTORTION,
    &ORTHOGRAPHIC,
    &LATLONG,
    &PUSHBROOM,
    &FILM,
    &GEOREFERENCE,
    &CHANNELS,
    &EQUAL,
    &WAVENUMBER,
    &INTEGRATOR,
    &SPECTRUM,
    &REGULAR,
    &MATERIAL,
    &DIFFUSE,
    &CONDUCTOR,
    &DIELECTRIC,
    &PLASTIC,
    &BLEND,
    &BLACK,
    &TEXTURE,
    &TEXTURE_OF_NUMBERS,
    &TEXTURE_OF_LIGHT,
    &OBJECT,
    &SPHERE,
    &QUAD,
    &DISK,
    &CUBE,
    &CYLINDER,
    &TRANSFORM,
    &ASSEMBLY,
    &INSTANCE,
    &LIGHT,
    &POINT,
    &SPOT,
    &DIRECTIONAL,
    &SUN,
    &ENVIRONMENT,
    &MEDIUM,
    &COMPONENT,
    &PHASE,
    &SPECIES,
    &GRID,
];

/// What a dotted path leads to.
#[derive(Debug, Clone, Copy)]
pub enum Found {
    Section(&'static Section),
    Key(&'static Section, &'static Key),
}

/// The section or key that `path` means: as on the page (`materials.NAME.plastic`), as in a file (`materials.paint.plastic`,
/// `objects.0.mesh`), or without names (`materials.plastic.eta`).
///
/// # Errors
/// A sentence with the nearest paths.
pub fn find(path: &str) -> Result<Found, String> {
    if let Some(section) = SECTIONS.iter().find(|section| section.path == path) {
        return Ok(Found::Section(section));
    }
    let of_section = |section: &&'static Section| {
        let key = section.key(path.strip_prefix(section.path)?.strip_prefix('.')?)?;
        Some(Found::Key(section, key))
    };
    if let Some(found) = SECTIONS.iter().filter(|section| section.path != SCENE.path).find_map(of_section) {
        return Ok(found);
    }
    let words: Vec<&str> = path.split('.').collect();
    walk(&SCENE, &words).ok_or_else(|| unknown(path))
}

/// `words` from `section` on.
fn walk(section: &'static Section, words: &[&str]) -> Option<Found> {
    let (word, rest) = words.split_first()?;
    let key = section.key(word)?;
    let inner = key.sections();
    if rest.is_empty() {
        // A table that stands nowhere else explains more than its row.
        let own = matches!(key.kind, Kind::Table | Kind::NamedTables | Kind::ListOfTables);
        return Some(match inner[..] {
            [section] if own => Found::Section(section),
            _ => Found::Key(section, key),
        });
    }
    let has_names = matches!(key.kind, Kind::NamedTables | Kind::ListOfTables);
    let below = |words: &[&str]| inner.iter().find_map(|section| walk(section, words));
    below(rest).or_else(|| match rest {
        // A misspelt key is no name.
        [name] if has_names => {
            let section = *inner.first()?;
            did_you_mean(name, section.names()).is_none().then_some(Found::Section(section))
        }
        [_, rest @ ..] if has_names => below(rest),
        _ => None,
    })
}

fn unknown(path: &str) -> String {
    let paths: Vec<String> =
        SECTIONS.iter().flat_map(|section| section.keys.iter().map(|key| section.path_of(key))).collect();
    let plain =
        |path: &str| path.split('.').filter(|word| !matches!(*word, "NAME" | "N")).collect::<Vec<_>>().join(".");
    let last = |path: &str| path.rsplit('.').next().unwrap_or_default().to_owned();
    const SHOWN: usize = 8;
    let same: Vec<&String> = paths.iter().filter(|known| last(known) == last(path)).take(SHOWN).collect();
    let near = if same.is_empty() {
        let mut by_distance: Vec<&String> = paths.iter().collect();
        let distance = |known: &str| {
            let whole = edit_distance(&plain(known), &plain(path));
            whole.min(edit_distance(&last(known), path))
        };
        by_distance.sort_by_key(|known| distance(known));
        by_distance.truncate(3);
        by_distance
    } else {
        same
    };
    format!("a scene has no `{path}`; the nearest are {} (`spectile help scene` lists all)", list(near))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    fn collect(section: &'static Section, seen: &mut BTreeSet<&'static str>) {
        if seen.insert(section.path) {
            section.keys.iter().flat_map(Key::sections).for_each(|inner| collect(inner, seen));
        }
    }

    #[test]
    fn sections_are_those_that_keys_lead_to() {
        let mut reached = BTreeSet::new();
        collect(&SCENE, &mut reached);
        let listed: BTreeSet<&str> = SECTIONS.iter().map(|section| section.path).collect();
        assert_eq!((listed.len(), listed), (SECTIONS.len(), reached));
        for section in SECTIONS {
            let names: BTreeSet<&str> = section.names().chain(section.later.iter().copied()).collect();
            assert_eq!(names.len(), section.keys.len() + section.later.len(), "{}: a key twice", section.path);
        }
    }

    #[test]
    fn paths_are_found_however_they_are_written() {
        for section in SECTIONS {
            assert!(matches!(find(section.path), Ok(Found::Section(s)) if s.path == section.path), "{}", section.path);
        }
        let key = |path: &str| match find(path) {
            Ok(Found::Key(section, key)) => section.path_of(key),
            other => panic!("{path}: {other:?}"),
        };
        for path in ["materials.NAME.plastic.eta", "materials.paint.plastic.eta", "materials.plastic.eta"] {
            assert_eq!(key(path), "materials.NAME.plastic.eta");
        }
        assert_eq!(key("camera.perspective.fov"), "camera.perspective.fov");
        assert_eq!(key("objects.12.transform.rotate"), "objects.N.transform.rotate");
        assert_eq!(key("spectra.lamp.file"), "spectra.NAME.file");
        assert_eq!(key("lights.0.sun.irradiance.column"), "spectra.NAME.column");
        assert_eq!(key("materials.ground.diffuse.reflectance.endmembers"), "texture.endmembers");
        assert_eq!(key("media.plume.density.grid"), "grid.grid");
        let section = |path: &str| match find(path) {
            Ok(Found::Section(section)) => section.path,
            other => panic!("{path}: {other:?}"),
        };
        assert_eq!(section("materials"), "materials.NAME");
        assert_eq!(section("materials.black"), "materials.NAME.black");
        assert_eq!(section("materials.black.black"), "materials.NAME.black");
        assert_eq!(section("objects.3"), "objects.N");
    }

    #[test]
    fn other_paths_get_a_sentence_with_the_nearest() {
        for (path, nearest) in [
            ("camera.perspektive.fov", "camera.perspective.fov"),
            ("materials.plastik", "materials.NAME.plastic"),
            ("temperature", "media.NAME.temperature"),
            ("film.widht", "film.width"),
        ] {
            let message = find(path).expect_err(path);
            assert!(message.contains(nearest) && !message.contains('\n'), "{message}");
        }
    }
}
