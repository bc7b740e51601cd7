//! The reference of scene files: as a page in Markdown, and as text for a terminal.

use super::{Absent, Found, Key, SECTIONS, Section, find};
use crate::scene::Quantity;
use crate::scene::tree::{self, Entry, Value};

/// The prose of the page. On lines of their own, `{{PATH}}` stands for a section, `{{contents}}` for the list of them and
/// `{{quantities}}` for the table of quantities.
const TEMPLATE: &str = include_str!("page.md");

const MADE: &str = "<!-- Made of src/scene/keys by `SPECTILE_WRITE_DOCS=1 cargo test --release --test manual`: change that, \
                    not this. -->\n";
/// Where lines end, in columns.
const WIDTH: usize = 110;

/// Where a section is shown.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Place {
    Page,
    /// With others, in a terminal.
    Among,
    /// Alone, in a terminal.
    Alone,
}

/// The whole page, `docs/scene.md`.
pub fn page() -> String {
    format!("{MADE}\n{}", filled(TEMPLATE, Place::Page))
}

/// What `spectile help scene` prints: all, or what `topic` says. That is a dotted path (see [`find`]) or the name of a chapter.
///
/// # Errors
/// A sentence with the nearest paths.
pub fn text(topic: Option<&str>) -> Result<String, String> {
    let Some(topic) = topic else { return Ok(plain(&filled(TEMPLATE, Place::Among))) };
    if let Some(chapter) = chapters().find(|chapter| slug(title(chapter)) == slug(topic)) {
        return Ok(plain(&filled(chapter, Place::Among)));
    }
    Ok(plain(&match find(topic)? {
        Found::Section(section) => of_section(section, Place::Alone),
        Found::Key(section, key) => of_key(section, key),
    }))
}

/// The parts of the template under headings of the second level, and below those of the third that are prose.
fn chapters() -> impl Iterator<Item = &'static str> {
    ["\n## ", "\n### "].into_iter().flat_map(|mark| {
        let starts = TEMPLATE.match_indices(mark).map(|(at, _)| at + 1);
        starts.map(move |start| {
            let rest = &TEMPLATE[start..];
            let ends = if mark == "\n## " { &["\n## "][..] } else { &["\n## ", "\n### "] };
            let end = ends.iter().filter_map(|end| rest.find(end)).min().map_or(rest.len(), |end| end + 1);
            &rest[..end]
        })
    })
}

fn title(chapter: &str) -> &str {
    chapter.lines().next().unwrap_or_default().trim_start_matches('#').trim()
}

/// A heading as the end of a link to it.
fn slug(title: &str) -> String {
    title.to_lowercase().replace(' ', "-")
}

fn filled(template: &str, place: Place) -> String {
    let mut out = String::new();
    for line in template.lines() {
        match line.strip_prefix("{{").and_then(|rest| rest.strip_suffix("}}")) {
            Some("quantities") => out += &quantities(),
            Some("contents") => out += &contents(),
            Some(path) => match SECTIONS.iter().find(|section| section.path == path) {
                Some(section) => out += &of_section(section, place),
                // The page's test sees it.
                None => out += &format!("(no section `{path}`)"),
            },
            None => out += line,
        }
        out.push('\n');
    }
    out
}

fn of_section(section: &Section, place: Place) -> String {
    let mut parts = vec![format!("### {}", section.heading)];
    if !section.about.is_empty() {
        parts.push(wrap(section.about, WIDTH, ""));
    }
    parts.push(match place {
        Place::Page => table(section),
        Place::Among | Place::Alone => section.keys.iter().map(row).collect::<Vec<_>>().join("\n"),
    });
    // What a table within this one shows is shown there.
    let is_within = |other: &&&Section| other.path.starts_with(&format!("{}.", section.path));
    let is_shown = |example: &&str| {
        place == Place::Alone || !SECTIONS.iter().filter(is_within).any(|other| other.examples.contains(example))
    };
    parts.extend(section.examples.iter().copied().filter(is_shown).map(block));
    if !section.notes.is_empty() {
        parts.push(wrap(section.notes, WIDTH, ""));
    }
    if !section.later.is_empty() {
        let names: Vec<String> = section.later.iter().map(|name| format!("`{name}`")).collect();
        parts.push(format!("Refused by name, as not supported yet: {}.", names.join(", ")));
    }
    parts.join("\n\n")
}

fn block(example: &str) -> String {
    format!("```toml\n{}\n```", example.trim())
}

/// The keys of a section as a table in Markdown.
fn table(section: &Section) -> String {
    let mut out = "| key | type | unit | default | range | |\n| --- | --- | --- | --- | --- | --- |".to_owned();
    for key in section.keys {
        let cells = [
            format!("`{}`", key.name),
            key.type_words(),
            key.unit_words().to_owned(),
            key.absent_words(),
            key.range_words(),
            key.meaning.to_owned(),
        ];
        out += &format!("\n| {} |", cells.join(" | "));
    }
    out
}

/// The same of one key, for a terminal.
fn row(key: &Key) -> String {
    let mut facts = key.type_words();
    if !key.unit_words().is_empty() {
        facts += &format!(" in {}", key.unit_words());
    }
    if !key.range_words().is_empty() {
        facts += &format!(": {}", key.range_words());
    }
    let default = match key.absent_words() {
        words if matches!(key.absent, Absent::Same(_) | Absent::Means(_)) => format!("default: {words}"),
        words => words,
    };
    let mut out = format!("  {}\n{}", key.name, wrap(&format!("{facts}; {default}"), WIDTH, "      "));
    if !key.meaning.is_empty() {
        out += &format!("\n{}", wrap(key.meaning, WIDTH, "      "));
    }
    out
}

/// A key by itself, with the examples that have it.
fn of_key(section: &Section, key: &Key) -> String {
    let mut parts = vec![format!("### {}", section.path_of(key)), row(key)];
    parts.extend(section.examples.iter().filter(|example| has(example, section.at, key.name)).map(|e| block(e)));
    let mut more: Vec<&str> = key.sections().iter().map(|section| section.path).collect();
    if !section.about.is_empty() || !section.notes.is_empty() || more.is_empty() {
        more.push(section.path);
    }
    let commands: Vec<String> = more.iter().map(|path| format!("`spectile help scene {path}`")).collect();
    parts.push(format!("More: {}", commands.join(", ")));
    parts.join("\n\n")
}

/// Whether the table at the dotted path `at` of an example has this key.
fn has(example: &str, at: &str, key: &str) -> bool {
    fn below<'a>(entries: &'a [Entry], words: &[&str]) -> Option<&'a [Entry]> {
        let (word, rest) = match words {
            [] => return Some(entries),
            [word, rest @ ..] => (word, rest),
        };
        match &entries.iter().find(|entry| entry.key == *word)?.node.value {
            Value::Table(inner) => below(inner, rest),
            Value::Array(items) => {
                let (index, rest) = rest.split_first()?;
                match &items.get(index.parse::<usize>().ok()?)?.value {
                    Value::Table(inner) => below(inner, rest),
                    _ => None,
                }
            }
            _ => None,
        }
    }
    let words: Vec<&str> = at.split('.').filter(|word| !word.is_empty()).collect();
    let document = tree::parse_document(example).unwrap_or_default();
    below(&document, &words).is_some_and(|entries| entries.iter().any(|entry| entry.key == key))
}

/// What sections there are.
fn contents() -> String {
    let line = |section: &&Section| format!("- `{}`: {}", section.path, section.summary);
    SECTIONS.iter().map(line).collect::<Vec<_>>().join("\n")
}

/// What a spectrum means and may be, by what it describes.
fn quantities() -> String {
    let mut out =
        "| of | unit | allowed | beyond the ends of a table | rgb, blackbody |\n| --- | --- | --- | --- | --- |"
            .to_owned();
    for quantity in Quantity::ALL {
        let cells = [
            quantity.noun().to_owned(),
            quantity.unit().to_owned(),
            quantity.interval().to_owned(),
            quantity.beyond_words().to_owned(),
            if quantity.is_index() { "refused" } else { "allowed" }.to_owned(),
        ];
        out += &format!("\n| {} |", cells.join(" | "));
    }
    out
}

/// Markdown for a terminal: no marks of headings, code or links.
fn plain(markdown: &str) -> String {
    let mut out = String::new();
    let mut in_code = false;
    for line in markdown.lines() {
        if line.starts_with("```") {
            in_code = !in_code;
        } else if in_code {
            out += &format!("    {line}");
        } else {
            out += &without_links(line.trim_start_matches('#').trim_start_matches(if line.starts_with('#') {
                " "
            } else {
                ""
            }));
        }
        if !line.starts_with("```") {
            out.push('\n');
        }
    }
    out.trim_end().to_owned() + "\n"
}

/// `[words](place)` as `words`.
fn without_links(line: &str) -> String {
    let mut out = String::new();
    let mut rest = line;
    while let Some((before, after)) = rest.split_once("](") {
        let (text, words) = before.rsplit_once('[').unwrap_or(("", before));
        out += text;
        out += words;
        rest = after.split_once(')').map_or("", |(_, rest)| rest);
    }
    out + rest
}

/// `text` in lines of at most `width` columns, each after `indent`.
fn wrap(text: &str, width: usize, indent: &str) -> String {
    let mut lines = vec![indent.to_owned()];
    for word in text.split_whitespace() {
        let line = lines.last_mut().expect("at least one");
        let columns = line.chars().count();
        if columns == indent.len() {
            line.push_str(word);
        } else if columns + 1 + word.chars().count() <= width {
            line.push(' ');
            line.push_str(word);
        } else {
            lines.push(format!("{indent}{word}"));
        }
    }
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_section_has_its_place_once() {
        for section in SECTIONS {
            let mark = format!("{{{{{}}}}}", section.path);
            assert_eq!(TEMPLATE.lines().filter(|line| **line == mark).count(), 1, "{mark} in page.md");
        }
        assert!(!page().contains("(no section"), "page.md names a section that does not exist");
    }

    #[test]
    fn links_lead_to_headings() {
        let page = page();
        let slugs: Vec<String> = page
            .lines()
            .filter(|line| line.starts_with("##"))
            .map(|line| slug(line.trim_start_matches('#').trim()))
            .collect();
        for (at, _) in page.match_indices("](#") {
            let link = page[at + 3..].split(')').next().expect("an end");
            assert!(slugs.iter().any(|slug| slug == link), "#{link} is no heading");
        }
    }

    #[test]
    fn topics_are_sections_keys_and_chapters() {
        for section in SECTIONS {
            assert!(text(Some(section.path)).is_ok(), "{}", section.path);
            for key in section.keys {
                let path = section.path_of(key);
                let shown = text(Some(&path)).unwrap_or_else(|e| panic!("{path}: {e}"));
                assert!(shown.contains(key.name), "{path}: {shown}");
            }
        }
        let shown = text(Some("camera.perspective.fov")).expect("a key");
        for words in ["camera.perspective.fov", "number in degrees: (0, 180); required", "fov = 39.3077"] {
            assert!(shown.contains(words), "{words}: {shown}");
        }
        assert!(text(Some("Textures")).expect("a chapter").contains("longitude"));
        assert!(text(Some("files-of-spectra")).expect("a chapter").contains("ECOSTRESS"));
        assert!(text(Some("textrues")).is_err());
        let all = text(None).expect("everything");
        assert!(all.contains("angular_radius") && !all.contains("```") && !all.contains("{{"));
    }

    #[test]
    fn lines_are_wrapped_and_links_are_words() {
        assert_eq!(wrap("one two  three", 9, "  "), "  one two\n  three");
        assert_eq!(without_links("see [Files of spectra](#files-of-spectra), [A](B.md)."), "see Files of spectra, A.");
    }
}
