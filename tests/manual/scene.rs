//! `docs/scene.md`: made of the rows by which decoders know their keys, and each row held against the decoder by what that
//! does with good values, wrong ones and none.

use std::path::PathBuf;

use spectile::Error;
use spectile::error::Problem;
use spectile::scene::keys::{self, Absent, Key, Kind, SECTIONS, Section};
use spectile::scene::{self, Scene};
use tempfile::TempDir;
use toml::{Table, Value};

use super::{blocks, files, spectile, text};

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/scene.md");

fn read(page: &str) -> String {
    std::fs::read_to_string(page).unwrap_or_else(|e| panic!("{page}: {e}"))
}

/// A folder with all files that examples name, and the scene that they are parts of.
struct Place {
    folder: TempDir,
    base: Table,
}

impl Place {
    fn new() -> Place {
        let folder = tempfile::tempdir().expect("a folder");
        files::make(folder.path());
        let base = blocks(&keys::page(), "toml").swap_remove(0).parse().expect("TOML");
        Place { folder, base }
    }

    fn scene_file(&self) -> PathBuf {
        self.folder.path().join("scene.toml")
    }

    /// The base scene with a part of it: sections take the place of the base's, named things and lists are added, and what
    /// nothing uses gets an object that does.
    fn completed(&self, part: &Table) -> Table {
        let mut whole = self.base.clone();
        for (key, value) in part {
            match (whole.get_mut(key), value) {
                (Some(Value::Table(there)), Value::Table(new))
                    if ["spectra", "materials", "media"].contains(&key.as_str()) =>
                {
                    there.extend(new.clone());
                }
                // Those of the part first, where its own numbers count.
                (Some(Value::Array(there)), Value::Array(new)) => {
                    there.splice(0..0, new.iter().cloned());
                }
                _ => {
                    whole.insert(key.clone(), value.clone());
                }
            }
        }
        let used = toml::to_string(&whole).expect("TOML");
        let mut objects = whole.get("objects").and_then(Value::as_array).cloned().unwrap_or_default();
        let mut add = |key: &str, name: &str, more: &str| {
            let quoted = format!("\"{name}\"");
            if !used.lines().any(|line| line.contains('=') && line.contains(&quoted)) {
                let object = format!("sphere = {{ center = [1, 1, 1], radius = 0.2 }}\n{key} = {quoted}\n{more}");
                objects.push(Value::Table(object.parse().expect("TOML")));
            }
        };
        let names = |key: &str| -> Vec<String> {
            part.get(key).and_then(Value::as_table).map(|table| table.keys().cloned().collect()).unwrap_or_default()
        };
        names("materials").iter().for_each(|name| add("material", name, ""));
        names("media").iter().for_each(|name| add("interior", name, ""));
        names("spectra").iter().for_each(|name| add("emission", name, "material = \"lamp\""));
        whole.insert("objects".into(), Value::Array(objects));
        whole
    }

    fn load(&self, scene: &Table, set: Option<(&str, &str)>) -> Result<Scene, Vec<Problem>> {
        let text = toml::to_string(scene).expect("TOML");
        let overrides: Vec<_> = set.into_iter().map(|(key, value)| (key.to_owned(), value.to_owned())).collect();
        scene::parse(&text, &self.scene_file(), &overrides).map_err(|error| match error {
            Error::Input(problems) => problems,
            other => panic!("{other}"),
        })
    }
}

fn parsed(example: &str) -> Table {
    example.parse().unwrap_or_else(|e| panic!("{example}: {e}"))
}

/// The table at a dotted path.
fn at<'a>(scene: &'a mut Table, path: &str) -> Option<&'a mut Table> {
    let mut words = path.split('.').filter(|word| !word.is_empty());
    let Some(first) = words.next() else { return Some(scene) };
    let found = words.try_fold(scene.get_mut(first)?, |value, word| match value {
        Value::Table(table) => table.get_mut(word),
        Value::Array(items) => items.get_mut(word.parse::<usize>().ok()?),
        _ => None,
    });
    found?.as_table_mut()
}

/// A key in its place: the scene that has it, and its dotted path there.
struct Case {
    section: &'static Section,
    key: &'static Key,
    scene: Table,
    path: String,
}

/// Every key of every section, in the first of the section's examples that has it.
fn cases(place: &Place) -> Vec<Case> {
    let mut found = Vec::new();
    for &section in SECTIONS {
        let examples: Vec<Table> = section.examples.iter().map(|example| parsed(example)).collect();
        for key in section.keys {
            // What is refused stands beside the others.
            let has = |example: &Table| {
                let mut example = example.clone();
                at(&mut example, section.at).is_some_and(|t| t.contains_key(key.name) || key.kind == Kind::Refused)
            };
            let example = examples.iter().find(|example| has(example));
            let example = example.unwrap_or_else(|| panic!("`{}` is in no example", section.path_of(key)));
            let dot = if section.at.is_empty() { "" } else { "." };
            let path = format!("{}{dot}{}", section.at, key.name);
            found.push(Case { section, key, scene: place.completed(example), path });
        }
    }
    found
}

impl Case {
    /// The scene without the key.
    fn without(&self) -> Table {
        let mut scene = self.scene.clone();
        at(&mut scene, self.section.at).expect("its table").remove(self.key.name);
        scene
    }

    /// That `value` in the place of the key is an error that names it; what is said.
    #[track_caller]
    fn refused(&self, place: &Place, value: &str) -> String {
        let problems = match place.load(&self.scene, Some((&self.path, value))) {
            Ok(_) => panic!("{} = {value} is accepted", self.path),
            Err(problems) => problems,
        };
        // Of lists and tables a part may be named.
        let names =
            |key: &str| key == self.path || key.strip_prefix(&self.path).is_some_and(|rest| rest.starts_with('.'));
        let named = problems.iter().find(|problem| problem.key.as_deref().is_some_and(names));
        named.unwrap_or_else(|| panic!("{} = {value}: {problems:?}", self.path)).to_string()
    }

    #[track_caller]
    fn accepted(&self, place: &Place, value: &str) {
        if let Err(problems) = place.load(&self.scene, Some((&self.path, value))) {
            panic!("{} = {value} is refused: {problems:?}", self.path);
        }
    }
}

#[test]
fn the_page_is_made_of_the_rows() {
    if std::env::var_os("SPECTILE_WRITE_DOCS").is_some() {
        std::fs::write(PAGE, keys::page()).expect("written");
    }
    let (there, made) = (read(PAGE), keys::page());
    let differs = there.lines().zip(made.lines()).position(|(a, b)| a != b);
    let line = differs.unwrap_or(there.lines().count().min(made.lines().count()));
    assert!(
        there == made,
        "docs/scene.md is not what src/scene/keys says, from line {}: `{}` should be `{}`; \
         SPECTILE_WRITE_DOCS=1 cargo test --release --test manual writes it",
        line + 1,
        there.lines().nth(line).unwrap_or_default(),
        made.lines().nth(line).unwrap_or_default()
    );
}

#[test]
fn every_example_loads() {
    let place = Place::new();
    for example in SECTIONS.iter().flat_map(|section| section.examples) {
        if let Err(problems) = place.load(&place.completed(&parsed(example)), None) {
            panic!("{example}: {problems:?}");
        }
    }
    assert!(cases(&place).len() > 100);
}

/// A decoder that does not look at a key says nothing about its type: so each is looked at.
#[test]
fn keys_have_their_types() {
    let place = Place::new();
    for case in cases(&place) {
        let wrong = if case.key.kind == Kind::Boolean { "3" } else { "true" };
        case.refused(&place, wrong);
        match case.key.kind {
            Kind::Choice(words) => {
                words.iter().for_each(|word| case.accepted(&place, word));
                let said = case.refused(&place, "nonsense");
                let all = words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(", ");
                assert!(said.contains(&format!("must be one of {all}, but")), "{said}");
            }
            Kind::Boolean => ["true", "false"].iter().for_each(|value| case.accepted(&place, value)),
            Kind::Whole => _ = case.refused(&place, "2.5"),
            Kind::Name(_) | Kind::Spectrum(_) => _ = case.refused(&place, "nothing of this name"),
            Kind::File => _ = case.refused(&place, "nothing.csv"),
            Kind::Vector | Kind::Direction => {
                case.refused(&place, "[1, 2]");
                if case.key.kind == Kind::Direction {
                    case.refused(&place, "[0, 0, 0]");
                }
            }
            Kind::Number => _ = case.refused(&place, "nan"),
            _ => {}
        }
    }
}

/// The interval at the beginning of a range: its ends, and whether they are included; and whether that is all.
fn interval(range: &str) -> Option<([(f64, bool); 2], bool)> {
    let (interval, rest) = range.split_at(range.find([']', ')'])? + 1);
    let inner = interval.strip_prefix(['[', '('])?;
    let (low, high) = inner[..inner.len() - 1].split_once(", ")?;
    let number = |text: &str| if text == "∞" { f64::INFINITY } else { text.parse().expect("a number") };
    let ends = [(number(low), interval.starts_with('[')), (number(high), interval.ends_with(']'))];
    Some((ends, rest.is_empty()))
}

#[test]
fn keys_have_their_ranges() {
    let place = Place::new();
    let mut seen = 0;
    for case in cases(&place) {
        let range = case.key.range_words();
        let Some((ends, is_all)) = interval(&range) else {
            let interval_like = range.starts_with(['[', '(']) && case.key.kind != Kind::Boolean;
            assert!(!interval_like, "{}: {range}", case.path);
            continue;
        };
        let whole = case.key.kind == Kind::Whole;
        for ((end, included), outward) in ends.into_iter().zip([-1.0, 1.0]) {
            if end.is_infinite() {
                continue;
            }
            let step = if whole { 1.0 } else { 1e-3 * f64::abs(end).max(1e-3) };
            let written = |value: f64| if whole { format!("{value}") } else { format!("{value:?}") };
            case.refused(&place, &written(end + outward * step));
            if !included {
                case.refused(&place, &written(end));
            }
            if is_all {
                case.accepted(&place, &written(if included { end } else { end - outward * step }));
            }
            seen += 1;
        }
    }
    assert!(seen > 60, "{seen} ends of ranges");
}

#[test]
fn absent_keys_are_what_their_rows_say() {
    let place = Place::new();
    let resolved = |scene: &Table| match place.load(scene, None) {
        Ok(scene) => format!("{scene:?}"),
        Err(problems) => panic!("{problems:?}"),
    };
    for case in cases(&place) {
        let path = case.path.as_str();
        let without = case.without();
        match case.key.absent {
            Absent::Error => {
                let problems = place.load(&without, None).expect_err(path);
                let said = problems.iter().any(|p| p.key.as_deref() == Some(path) && p.message.contains("is missing"));
                assert!(said, "{path}: {problems:?}");
            }
            Absent::Unless(_) => assert!(place.load(&without, None).is_err(), "{path} is not needed"),
            Absent::OneOf => {
                let problems = place.load(&without, None).expect_err(path);
                let section = case.section.at;
                assert!(problems.iter().any(|p| p.key.as_deref() == Some(section)), "{path}: {problems:?}");
            }
            Absent::Same(value) => {
                let mut written = case.scene.clone();
                let value: Table = format!("value = {value}").parse().expect("TOML");
                at(&mut written, case.section.at)
                    .expect("its table")
                    .insert(case.key.name.into(), value["value"].clone());
                assert_eq!(resolved(&without), resolved(&written), "{path}");
            }
            // What is named elsewhere may be missed there.
            Absent::Means(_) if matches!(case.key.kind, Kind::NamedTables | Kind::ListOfTables) => {}
            Absent::Means(_) => _ = resolved(&without),
        }
    }
}

#[test]
fn of_exclusive_keys_there_is_one() {
    let place = Place::new();
    let cases = cases(&place);
    let is_one = |case: &&Case| case.key.absent == Absent::OneOf;
    for case in cases.iter().filter(is_one) {
        for other in cases.iter().filter(is_one).filter(|o| o.section.path == case.section.path && o.path != case.path)
        {
            let value = at(&mut other.scene.clone(), other.section.at).expect("its table")[other.key.name].clone();
            let mut both = case.scene.clone();
            at(&mut both, case.section.at).expect("its table").insert(other.key.name.into(), value);
            let problems = place.load(&both, None).expect_err(&case.path);
            assert!(
                problems.iter().any(|p| p.message.starts_with("only one ")),
                "{} {}: {problems:?}",
                case.path,
                other.path
            );
        }
    }
}

#[test]
fn keys_of_later_versions_are_refused_by_name() {
    let place = Place::new();
    for section in SECTIONS {
        for name in section.later {
            let scene = place.completed(&parsed(section.examples[0]));
            let problems = place.load(&scene, Some((&format!("{}.{name}", section.at), "0.5"))).expect_err(name);
            assert!(problems.iter().any(|p| p.message.contains("is not supported yet")), "{name}: {problems:?}");
        }
    }
}

/// As a user would: each block of the page through `spectile plan`, without a device.
#[test]
fn every_block_of_the_page_is_planned() {
    let place = Place::new();
    let blocks = blocks(&read(PAGE), "toml");
    assert!(blocks.len() > 40);
    for block in blocks {
        let scene = toml::to_string(&place.completed(&parsed(&block))).expect("TOML");
        std::fs::write(place.scene_file(), scene).expect("written");
        let output = spectile(place.folder.path(), &["plan", "scene.toml"], false);
        assert!(output.status.success(), "{block}: {}", text(&output.stderr));
        assert!(text(&output.stdout).contains("picture "), "{block}");
    }
}

#[test]
fn help_prints_what_the_page_says() {
    let place = Place::new();
    let help = |arguments: &[&str]| {
        let output = spectile(place.folder.path(), &[&["help"], arguments].concat(), false);
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    };
    let (code, all, said) = help(&["scene"]);
    assert_eq!((code, said.as_str()), (Some(0), ""));
    for key in SECTIONS.iter().flat_map(|section| section.keys) {
        // Lines are broken elsewhere.
        let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        let first = key.meaning.split('[').next().unwrap_or_default();
        assert!(all.contains(&format!("  {}\n", key.name)) && words(&all).contains(&words(first)), "{}", key.name);
    }
    let (code, fov, _) = help(&["scene", "camera.perspective.fov"]);
    assert!(code == Some(0) && fov.contains("full angle of view") && fov.contains("(0, 180)"), "{fov}");
    let (code, plastic, _) = help(&["scene", "materials.varnish.plastic"]);
    assert!(code == Some(0) && plastic.contains("roughness") && plastic.contains("eta = 1.5"), "{plastic}");
    let (code, _, said) = help(&["scene", "materials.plastik"]);
    assert!(code == Some(2) && said.contains("materials.NAME.plastic") && said.lines().count() == 1, "{said}");
    assert_eq!(help(&["scene", "film", "width"]).0, Some(2));

    // And commands as ever.
    let long = |arguments: &[&str]| text(&spectile(place.folder.path(), arguments, false).stdout);
    assert_eq!(help(&["render"]), (Some(0), long(&["render", "--help"]), String::new()));
    assert_eq!(help(&[]), (Some(0), long(&["--help"]), String::new()));
    let (code, out, said) = help(&["rendr"]);
    assert!(code == Some(2) && out.is_empty() && said.contains("unrecognized subcommand 'rendr'"), "{said}");
}
