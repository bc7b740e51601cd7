//! `tape7` of MODTRAN (also `.tp7`): a table over wavenumber, whose columns depend on the mode.

use std::path::Path;

use super::said::Said;
use super::text::{Column as Wanted, SpectrumTable, ascending, named, only_one};
use super::unit::{Meaning, Stated};
use crate::error::Problem;

/// Whether the file is such a table: by its name, or by its header.
pub fn is_tape7(path: &Path, bytes: &[u8]) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    if name.ends_with(".tp7") || name == "tape7" {
        return true;
    }
    // MODTRAN's input cards come first; CSV has no line that begins with FREQ.
    name.starts_with("tape7")
        && String::from_utf8_lossy(bytes).lines().any(|line| line.trim_start().starts_with("FREQ"))
}

/// Names of two words.
const TWO_WORDS: [&str; 16] = [
    "TOT TRANS",
    "PTH THRML",
    "THRML SCT",
    "SURF EMIS",
    "SOL SCAT",
    "SING SCAT",
    "GRND RFLT",
    "DRCT RFLT",
    "TOTAL RAD",
    "REF SOL",
    "SOL@OBS TRANS",
    "H2O CONT",
    "MOLEC SCAT",
    "AER+CLD TRANS",
    "N2 CONT",
    "LOG TOTAL",
];

/// A column: its name, and where it ends in the line.
#[derive(Debug, PartialEq)]
struct Column {
    name: String,
    end: usize,
}

/// The column `column` over wavelength. Radiance and irradiance, in W cm⁻² (sr⁻¹) per cm⁻¹, become W m⁻² (sr⁻¹) nm⁻¹:
/// L_λ = L_ν · 10⁷/λ² · 10⁴ with λ in nm. Transmittance and depth have no unit.
pub fn parse(bytes: &[u8], path: &Path, wanted: Wanted) -> Result<SpectrumTable, Box<Problem>> {
    let wrong = |line: Option<usize>, message: String, help: &str| {
        let help = (!help.is_empty()).then(|| help.to_owned());
        Box::new(Problem { file: path.to_owned(), line, message, help, ..Problem::default() })
    };
    // Places in a line are counted in bytes.
    let text: String = bytes.iter().map(|&byte| if byte.is_ascii() { char::from(byte) } else { '?' }).collect();
    let mut lines = (1..).zip(text.lines()).peekable();
    let Some((header_line, header)) = lines.find(|(_, line)| line.trim_start().starts_with("FREQ")) else {
        return Err(wrong(None, "is no tape7: no line begins with FREQ".into(), ""));
    };
    let second = lines.next_if(|(_, line)| line.trim_start().starts_with("CM-1")).map(|(_, line)| line);
    let columns = columns(header, second);
    let choices = || columns[1..].iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(", ");
    let same = |a: &str, b: &str| {
        let plain = |text: &str| text.to_lowercase().replace([' ', '_', '-'], "");
        plain(a) == plain(b)
    };
    let found: Vec<usize> = match wanted {
        Wanted::Only => {
            let message = format!("has {} columns beside the wavenumber", columns.len() - 1);
            return Err(wrong(Some(header_line), message, &format!("pick one with `column`: {}", choices())));
        }
        Wanted::Number(number) => (1..columns.len()).filter(|i| i + 1 == number).collect(),
        Wanted::Named(name) => (1..columns.len()).filter(|i| same(&columns[*i].name, name)).collect(),
    };
    let name = match wanted {
        Wanted::Named(name) => named(name),
        Wanted::Number(number) => number.to_string(),
        Wanted::Only => String::new(),
    };
    let index = only_one(&found, ["column", "columns"], &name, choices)
        .map_err(|(message, help)| wrong(Some(header_line), message, &help))?;
    let name = &columns[index].name;
    let (said, has_no_unit) = what_it_is(name);
    let mut after = (1..).zip(text.lines()).skip(header_line);
    if let Some((line, _)) = after.find(|(_, line)| line.trim_start().starts_with("FREQ")) {
        let message = "begins a second run here, below the one of line ".to_owned() + &header_line.to_string();
        return Err(wrong(Some(line), message, "put each run into a file of its own"));
    }

    let mut table = SpectrumTable { said: said.map(|said| (said, name.clone())), ..SpectrumTable::default() };
    if name.contains("LOG") {
        table.unit = Some(Stated { meaning: Meaning::Logarithm, text: name.clone(), certain: true });
    }
    for (number, line) in lines {
        let words = words(line);
        let Some(&(first, _)) = words.first() else { continue };
        if first.trim_end_matches('.') == "-9999" {
            break;
        }
        let number_in = |text: &str| {
            let value = text.parse::<f64>().ok().filter(|v| v.is_finite());
            value.ok_or_else(|| wrong(Some(number), format!("`{}` is not a finite number", text.escape_debug()), ""))
        };
        let wavenumber = number_in(first)?;
        if wavenumber <= 0.0 {
            return Err(wrong(Some(number), format!("the wavenumber must be greater than 0, but is {wavenumber}"), ""));
        }
        let Some(cell) = cell(&words, &columns, index) else {
            let message = format!("has {} numbers under {} columns", words.len(), columns.len());
            let help = "some columns of this mode are blank, and which cannot be told from where the numbers stand";
            return Err(wrong(Some(number), message, help));
        };
        let Some(cell) = cell else { continue };
        let (value, nm) = (number_in(cell)?, 1e7 / wavenumber);
        table.push(nm, if has_no_unit { value } else { value * 1e11 / (nm * nm) }, number);
    }
    ascending(table, path, &format!(" of {}", columns[index].name))
}

/// What a column is of, by its name, and whether its numbers have no unit of power. What no name here is like is of power.
fn what_it_is(name: &str) -> (Option<Said>, bool) {
    /// How columns are called, by parts of their names; of several the first decides.
    const KINDS: [(&str, Option<Said>, bool); 17] = [
        ("LOG", None, true),
        ("TRAN", Some(Said::Transmittance), true),
        ("DEPTH", Some(Said::OpticalDepth), true),
        ("BBODY", Some(Said::Temperature), true),
        ("DIR_EM", Some(Said::Emissivity), true),
        ("DIREC", Some(Said::Emissivity), true),
        ("TOA", Some(Said::Irradiance), false),
        ("REF", Some(Said::Irradiance), false),
        ("SOL@OBS", Some(Said::Irradiance), false),
        ("SOL TR", Some(Said::Irradiance), false),
        ("SOL_TR", Some(Said::Irradiance), false),
        ("SOLAR", Some(Said::Irradiance), false),
        ("RAD", Some(Said::Radiance), false),
        ("THRML", Some(Said::Radiance), false),
        ("EMIS", Some(Said::Radiance), false),
        ("SCAT", Some(Said::Radiance), false),
        ("RFLT", Some(Said::Radiance), false),
    ];
    let upper = name.to_uppercase();
    let found = KINDS.iter().find(|(part, ..)| upper.contains(part));
    found.map_or((None, false), |(_, said, has_no_unit)| (*said, *has_no_unit))
}

/// The words of a line and where they end.
fn words(line: &str) -> Vec<(&str, usize)> {
    let mut words = Vec::new();
    let mut at = 0;
    for word in line.split_ascii_whitespace() {
        let start = at + line[at..].find(word).unwrap_or(0);
        at = start + word.len();
        words.push((word, at));
    }
    words
}

/// The names in the header; with a second line, each continues the one that it stands under.
fn columns(header: &str, second: Option<&str>) -> Vec<Column> {
    let mut columns: Vec<Column> = Vec::new();
    let mut previous: Option<&str> = None;
    for (word, end) in words(header) {
        let joined =
            previous.map(|before| format!("{before} {word}")).filter(|name| TWO_WORDS.contains(&name.as_str()));
        match (joined, columns.last_mut()) {
            (Some(name), Some(last)) => {
                *last = Column { name, end };
                previous = None;
            }
            _ => {
                columns.push(Column { name: word.to_owned(), end });
                previous = Some(word);
            }
        }
    }
    if let Some(second) = second {
        let continued = words(second);
        if continued.len() == columns.len() {
            for (column, (word, end)) in columns.iter_mut().zip(continued).skip(1) {
                column.name = format!("{} {word}", column.name);
                column.end = end.max(column.end);
            }
        }
    }
    columns
}

/// The number of column `index` in a line: as many numbers as columns are theirs in turn; fewer belong to the columns that
/// end nearest, if that is one to one. The inner `None` is a blank; the outer one means that it cannot be told.
fn cell<'l>(words: &[(&'l str, usize)], columns: &[Column], index: usize) -> Option<Option<&'l str>> {
    if words.len() == columns.len() {
        return Some(Some(words[index].0));
    }
    let mut found = None;
    let mut last = None;
    for (word, end) in words {
        let distance = |i: usize| columns[i].end.abs_diff(*end);
        let nearest = (0..columns.len()).min_by_key(|&i| distance(i))?;
        if distance(nearest) > 4 || last.is_some_and(|last| nearest <= last) {
            return None;
        }
        last = Some(nearest);
        if nearest == index {
            found = Some(*word);
        }
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Radiance mode, with a blank column in the second row.
    const RADIANCE: &str = "MM  6    3    2    0\n   1.0 cards\n    FREQ  TOT TRANS  PTH THRML  SURF EMIS  TOTAL RAD  DEPTH\n\
         \x20   500.     0.5000   1.00E-06   2.00E-06   3.00E-06  0.693\n\
         \x20  1000.     0.2500              1.00E-06   4.00E-06  1.386\n -9999.\n  2000. 0 0 0 0 0\n";
    /// Transmittance mode, whose names stand on two lines.
    const TRANSMITTANCE: &str = " FREQ   COMBIN    H2O   UMIX\n CM-1    TRANS  TRANS  TRANS\n  500.   0.5000 0.6 0.7\n  600.   0.4 0.5 0.6\n-9999.\n";

    fn read(text: &str, column: Option<&str>) -> Result<SpectrumTable, Box<Problem>> {
        parse(text.as_bytes(), Path::new("tape7"), column.into())
    }

    #[test]
    fn radiance_is_per_nanometre_and_ascends() {
        let table = read(RADIANCE, Some("total_rad")).unwrap();
        assert_eq!(table.nm, [10_000.0, 20_000.0]);
        // 4e-6 W cm-2 sr-1 / cm-1 at 1000 cm-1: dν/dλ = 1e7/λ² = 0.1 cm-1 a nm, and 1e4 cm² a m².
        assert!((table.value[0] - 4e-3).abs() < 1e-15 && (table.value[1] - 7.5e-4).abs() < 1e-15, "{:?}", table.value);
        assert_eq!(table.line, [5, 4]);
        assert_eq!(read(RADIANCE, Some("TOT TRANS")).unwrap().value, [0.25, 0.5]);
        assert_eq!(read(RADIANCE, Some("depth")).unwrap().value, [1.386, 0.693]);
        assert!(read(RADIANCE, Some("PTH THRML")).unwrap_err().message.contains("1 values of PTH THRML"));
        assert_eq!(read(TRANSMITTANCE, Some("h2o trans")).unwrap().value, [0.5, 0.6]);
    }

    #[test]
    fn mistakes_name_their_line() {
        for (text, column, line, words) in [
            ("nothing\n", Some("x"), None, "no line begins with FREQ"),
            (RADIANCE, None, Some(3), "5 columns"),
            (RADIANCE, Some("x"), Some(3), "no column \"x\""),
            ("FREQ A\n500 x\n", Some("A"), Some(2), "`x` is not a finite number"),
            ("FREQ A\n0 1\n", Some("A"), Some(2), "greater than 0"),
            ("FREQ A\n500 1 2\n", Some("A"), Some(2), "3 numbers under 2 columns"),
            ("FREQ A\n500 1\n700 2\n600 3\n-9999.\n", Some("A"), Some(3), "follows"),
        ] {
            let problem = read(text, column).unwrap_err();
            assert!(problem.message.contains(words), "{text:?}: {problem}");
            assert_eq!(problem.line, line, "{text:?}: {problem}");
        }
    }

    #[test]
    fn columns_are_what_they_are_called() {
        let text = "FREQ TOT_TRANS PTH_THRML TOTAL_RAD REF_SOL -LOG_TOTAL DEPTH DIR_EM TOA_SUN BBODY_T[K] X\n\
             500 0.5 1e-8 1e-8 1e-8 0.3 0.7 1 1e-8 300 1\n600 0.5 1e-8 1e-8 1e-8 0.3 0.7 1 1e-8 300 1\n-9999.\n";
        for (column, said) in [
            ("TOT_TRANS", Some(Said::Transmittance)),
            ("PTH_THRML", Some(Said::Radiance)),
            ("TOTAL_RAD", Some(Said::Radiance)),
            ("REF_SOL", Some(Said::Irradiance)),
            ("DEPTH", Some(Said::OpticalDepth)),
            ("DIR_EM", Some(Said::Emissivity)),
            ("TOA_SUN", Some(Said::Irradiance)),
            ("BBODY_T[K]", Some(Said::Temperature)),
            ("X", None),
        ] {
            let table = read(text, Some(column)).unwrap();
            assert_eq!(table.said.map(|(said, _)| said), said, "{column}");
        }
        let logarithm = read(text, Some("-LOG_TOTAL")).unwrap().unit.map(|stated| stated.meaning);
        assert_eq!(logarithm, Some(Meaning::Logarithm));
        let problem = read(&format!("{text}{text}"), Some("TOTAL_RAD")).unwrap_err();
        assert!(problem.line == Some(5) && problem.message.contains("a second run"), "{problem}");
    }
}
