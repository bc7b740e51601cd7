//! Spectra in files. Here CSV (`nm,value`, with more columns by name; `nm,n,k`) and `.spd` (`nm value`); which of the other
//! formats a file has is told from its name and its first line.

use std::fmt::Debug;
use std::path::Path;

use super::csv_table::Table;
use super::{library, modtran};
use crate::error::Problem;
use crate::spectral::Channels;

/// Wavelengths in nm, ascending (two equal ones make a step), and a value for each.
#[derive(Debug, Clone, PartialEq)]
pub struct SpectrumTable {
    pub nm: Vec<f64>,
    pub value: Vec<f64>,
    /// The 1-based line each value stands on; empty where the file has no lines.
    pub line: Vec<usize>,
}

/// A spectrum as CSV: a header, then the centre of each channel in nm, its radiance and, where known, standard error, with as
/// many digits as bring back the numbers exactly.
pub fn spectrum_csv<T: Debug>(channels: &Channels, radiance: &[T], standard_error: Option<&[T]>) -> String {
    // The header stands first: many readers of CSV know no comments.
    let columns = if standard_error.is_some() { 3 } else { 2 };
    let mut table = Table::new(&["wavelength_nm", "radiance", "standard_error"][..columns]);
    for (k, radiance) in radiance.iter().enumerate() {
        // Debug, not Display: 1e-30 instead of thirty zeros.
        let error = standard_error.map(|errors| format!("{:?}", errors[k]));
        table.row([channels.centre(k).to_string(), format!("{radiance:?}")].into_iter().chain(error));
    }
    table.finish()
}

/// Reads the spectrum of `column` (by name; absent: the only one) of the file at `path`: CSV, `.spd`, an ENVI spectral
/// library, ECOSTRESS or USGS text, or MODTRAN's tape7. `unit` is that of CSV's first column where its header does not say.
///
/// Errors name the line; without one, the file as a whole could not be read.
pub fn read_spectrum(path: &Path, column: Option<&str>, unit: Option<Unit>) -> Result<SpectrumTable, Box<Problem>> {
    let bytes = read(path)?;
    let other = if library::is_envi(path, &bytes) {
        library::read_envi(path, column)
    } else if library::is_ecostress(&bytes) {
        library::no_columns(path, column).and_then(|()| library::parse_ecostress(&bytes, path))
    } else if library::is_usgs(&bytes) {
        library::no_columns(path, column).and_then(|()| library::read_usgs(&bytes, path))
    } else if modtran::is_tape7(path, &bytes) {
        modtran::parse(&bytes, path, column)
    } else {
        return parse(&bytes, path, column.map_or(Column::Only, Column::Named), unit);
    };
    match unit {
        None => other,
        Some(_) => {
            let help = Some("remove `unit`".to_owned());
            let message = "says by itself in which unit its wavelengths are".to_owned();
            Err(Box::new(Problem { file: path.to_owned(), message, help, ..Problem::default() }))
        }
    }
}

/// The content of the file at `path`.
pub(super) fn read(path: &Path) -> Result<Vec<u8>, Box<Problem>> {
    std::fs::read(path).map_err(|e| {
        let message = format!("cannot be read: {e}");
        Box::new(Problem { file: path.to_owned(), message, ..Problem::default() })
    })
}

/// [`read_spectrum`] on the content of a CSV or `.spd` file, which `path` tells apart; it stands in messages too.
pub fn parse_spectrum(bytes: &[u8], path: &Path, column: Option<&str>) -> Result<SpectrumTable, Box<Problem>> {
    parse(bytes, path, column.map_or(Column::Only, Column::Named), None)
}

/// The columns `n` and `k` of an `nm,n,k` file; without a header, the second and the third of three.
pub fn parse_index(bytes: &[u8], path: &Path) -> Result<[SpectrumTable; 2], Box<Problem>> {
    Ok([parse(bytes, path, Column::OfIndex("n"), None)?, parse(bytes, path, Column::OfIndex("k"), None)?])
}

/// Every column beside the wavelength, with the name that the header gives it.
pub fn read_columns(path: &Path) -> Result<Vec<(String, SpectrumTable)>, Box<Problem>> {
    parse_columns(&read(path)?, path)
}

/// [`read_columns`] on the content of the file.
pub fn parse_columns(bytes: &[u8], path: &Path) -> Result<Vec<(String, SpectrumTable)>, Box<Problem>> {
    let text = String::from_utf8_lossy(bytes);
    let header = text.trim_start_matches('\u{feff}').lines();
    let header = header.map(|line| line.split('#').next().unwrap_or("").trim()).find(|line| !line.is_empty());
    let names = header.map_or_else(Vec::new, |header| Separator::of(header).split(header));
    if let [_] | [] = names[..] {
        // Says what is wrong.
        return parse(bytes, path, Column::Only, None).map(|table| vec![(String::new(), table)]);
    }
    names[1..].iter().map(|name| Ok(((*name).to_owned(), parse(bytes, path, Column::Named(name), None)?))).collect()
}

/// Which column of a file is wanted.
#[derive(Clone, Copy)]
enum Column<'a> {
    /// The only one beside the wavelength.
    Only,
    Named(&'a str),
    /// `n` or `k`, which stand in this order where there is no header.
    OfIndex(&'a str),
}

fn parse(bytes: &[u8], path: &Path, column: Column, unit: Option<Unit>) -> Result<SpectrumTable, Box<Problem>> {
    // Only comments and names can hold anything but ASCII, so old encodings do no harm.
    let text = String::from_utf8_lossy(bytes);
    let text = text.trim_start_matches('\u{feff}');
    let reader = Reader { path, column };
    let mut lines = (1..)
        .zip(text.lines())
        .map(|(line, text)| (line, text.split('#').next().unwrap_or("").trim()))
        .filter(|(_, text)| !text.is_empty())
        .peekable();
    let Some(&(first_line, first)) = lines.peek() else {
        return Err(reader.at(None, "holds no data".to_owned(), "write lines of `nm,value`"));
    };

    let is_spd = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("spd"));
    let separator = if is_spd { Separator::Space } else { Separator::of(first) };
    let first_cells = separator.split(first);
    let header = first_cells[0].parse::<f64>().is_err();
    let mut layout = reader.layout(first_line, &first_cells, header)?;
    layout.unit = unit.unwrap_or(layout.unit);
    if header {
        lines.next();
    }

    let mut table = SpectrumTable { nm: Vec::new(), value: Vec::new(), line: Vec::new() };
    for (line, text) in lines {
        if let Some((x, value)) = reader.row(line, &separator.split(text), &layout)? {
            table.nm.push(layout.unit.to_nm(x));
            table.value.push(value);
            table.line.push(line);
        }
    }
    reader.ascending(table)
}

/// How the cells of a line are told apart; decided by the first line.
#[derive(Clone, Copy)]
pub(super) enum Separator {
    Char(char),
    Space,
}

impl Separator {
    pub fn of(line: &str) -> Self {
        [';', '\t', ','].into_iter().find(|c| line.contains(*c)).map_or(Separator::Space, Separator::Char)
    }

    /// At least one cell, without surrounding blanks and quotes.
    pub fn split(self, line: &str) -> Vec<&str> {
        match self {
            Separator::Char(c) => line.split(c).map(|cell| cell.trim().trim_matches('"').trim()).collect(),
            Separator::Space => line.split_whitespace().collect(),
        }
    }
}

/// Unit of the first column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    Nanometre,
    Micrometre,
    Wavenumber,
}

impl Unit {
    pub(super) fn to_nm(self, x: f64) -> f64 {
        match self {
            Unit::Nanometre => x,
            Unit::Micrometre => x * 1e3,
            Unit::Wavenumber => 1e7 / x,
        }
    }

    /// `Err` names a unit that is none of ours.
    pub(super) fn from_header(name: &str) -> Result<Self, String> {
        let name = name.to_lowercase();
        if name.contains("cm-1") || name.contains("cm^-1") || name.contains("wavenumber") {
            return Ok(Unit::Wavenumber);
        }
        for word in name.split(|c: char| !c.is_alphanumeric()) {
            match word {
                "angstrom" | "angstroms" | "å" | "ev" | "hz" | "thz" => return Err(word.to_owned()),
                _ => match nanometres(word) {
                    Some(1e3) => return Ok(Unit::Micrometre),
                    Some(1e6..) => return Err(word.to_owned()),
                    _ => {}
                },
            }
        }
        Ok(Unit::Nanometre)
    }
}

/// Nanometres in a unit of wavelength, under the names that files give it.
pub(super) fn nanometres(unit: &str) -> Option<f64> {
    match unit.trim().to_ascii_lowercase().as_str() {
        "nm" | "nanometer" | "nanometers" | "nanometre" | "nanometres" => Some(1.0),
        "um" | "µm" | "μm" | "micron" | "microns" | "micrometer" | "micrometers" | "micrometre" | "micrometres" => {
            Some(1e3)
        }
        "mm" | "millimeter" | "millimeters" | "millimetre" | "millimetres" => Some(1e6),
        "m" | "meter" | "meters" | "metre" | "metres" => Some(1e9),
        _ => None,
    }
}

/// Where in a line the numbers are.
struct Layout {
    cells: usize,
    value: usize,
    unit: Unit,
}

/// What every message needs.
struct Reader<'a> {
    path: &'a Path,
    column: Column<'a>,
}

impl Reader<'_> {
    fn at(&self, line: Option<usize>, message: String, help: &str) -> Box<Problem> {
        let help = (!help.is_empty()).then(|| help.to_owned());
        Box::new(Problem { file: self.path.to_owned(), line, message, help, ..Problem::default() })
    }

    fn layout(&self, line: usize, cells: &[&str], header: bool) -> Result<Layout, Box<Problem>> {
        let names = || cells[1..].join(", ");
        if cells.len() < 2 {
            return Err(self.at(Some(line), "has one column only".to_owned(), "write lines of `nm,value`"));
        }
        let value = match self.column {
            Column::Named(_) if !header => {
                let help = "name the columns in a first line such as `nm,value`, or leave `column` out";
                return Err(self.at(
                    Some(line),
                    "has no header line, so no column can be picked by name".to_owned(),
                    help,
                ));
            }
            Column::OfIndex(wanted) if !header => {
                if cells.len() != 3 {
                    let message = format!("has {} columns and no header line", cells.len());
                    return Err(self.at(Some(line), message, "write lines of `nm,n,k`"));
                }
                if wanted == "n" { 1 } else { 2 }
            }
            Column::Named(wanted) | Column::OfIndex(wanted) => {
                let found = cells.iter().skip(1).position(|cell| *cell == wanted);
                found.map(|i| i + 1).ok_or_else(|| {
                    self.at(Some(line), format!("has no column \"{wanted}\""), &format!("its columns are {}", names()))
                })?
            }
            Column::Only if cells.len() == 2 => 1,
            Column::Only if header => {
                let message = format!("has {} value columns", cells.len() - 1);
                return Err(self.at(Some(line), message, &format!("pick one with `column`: {}", names())));
            }
            Column::Only => {
                let message = format!("has {} columns and no header line", cells.len());
                return Err(self.at(
                    Some(line),
                    message,
                    "name the columns in a first line and pick one with `column`",
                ));
            }
        };
        let unit = if header { Unit::from_header(cells[0]) } else { Ok(Unit::Nanometre) };
        let unit = unit.map_err(|unit| {
            self.at(Some(line), format!("the first column is in `{unit}`"), "give wavelengths in nm, um or cm-1")
        })?;
        Ok(Layout { cells: cells.len(), value, unit })
    }

    /// The two numbers of a line; `None` where a file of several columns leaves the value empty: not given there.
    fn row(&self, line: usize, cells: &[&str], layout: &Layout) -> Result<Option<(f64, f64)>, Box<Problem>> {
        if cells.len() != layout.cells {
            let message = format!("has {} cells where {} are expected", cells.len(), layout.cells);
            return Err(self.at(Some(line), message, "give every line the same number of cells"));
        }
        let number = |cell: &str| {
            cell.parse::<f64>()
                .ok()
                .filter(|v| v.is_finite())
                .ok_or_else(|| self.at(Some(line), format!("`{}` is not a finite number", cell.escape_debug()), ""))
        };
        let x = number(cells[0])?;
        if x <= 0.0 {
            return Err(self.at(Some(line), format!("the wavelength must be greater than 0, but is {x}"), ""));
        }
        if cells[layout.value].is_empty() && layout.cells > 2 {
            return Ok(None);
        }
        Ok(Some((x, number(cells[layout.value])?)))
    }

    /// The table in ascending order, which its lines must have one way or the other.
    fn ascending(&self, table: SpectrumTable) -> Result<SpectrumTable, Box<Problem>> {
        let of = match self.column {
            Column::OfIndex(name) => format!(" of {name}"),
            _ => String::new(),
        };
        ascending(table, self.path, &of)
    }
}

/// A table in ascending order, which it must have one way or the other; `of` says what of the file at `path` it is.
pub(super) fn ascending(mut table: SpectrumTable, path: &Path, of: &str) -> Result<SpectrumTable, Box<Problem>> {
    let wrong = |i: Option<usize>, table: &SpectrumTable, message: String, help: &str| {
        let line = i.and_then(|i| table.line.get(i).copied());
        let help = (!help.is_empty()).then(|| help.to_owned());
        Box::new(Problem { file: path.to_owned(), line, message, help, ..Problem::default() })
    };
    if table.nm.len() < 2 {
        let message = format!("has {} values{of}", table.nm.len());
        return Err(wrong(None, &table, message, "give at least two wavelengths"));
    }
    if let Some(i) = table.nm.iter().position(|nm| !nm.is_finite()) {
        return Err(wrong(Some(i), &table, "the wavelength cannot be represented in nm".to_owned(), ""));
    }
    if table.nm.first() > table.nm.last() {
        table.nm.reverse();
        table.value.reverse();
        table.line.reverse();
    }
    for i in 1..table.nm.len() {
        let (before, nm) = (table.nm[i - 1], table.nm[i]);
        if nm < before {
            let message = format!("{nm} nm follows {before} nm");
            return Err(wrong(Some(i), &table, message, "sort the lines by wavelength"));
        }
        if i >= 2 && nm == table.nm[i - 2] {
            let message = format!("{nm} nm stands here for the third time");
            let help = "two equal wavelengths make a step; remove the others";
            return Err(wrong(Some(i), &table, message, help));
        }
    }
    Ok(table)
}

/// A name in a message, in quotes.
pub(super) fn named(name: &str) -> String {
    format!("\"{}\"", name.escape_debug())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn csv(text: &str, column: Option<&str>) -> Result<SpectrumTable, Box<Problem>> {
        parse_spectrum(text.as_bytes(), Path::new("t.csv"), column)
    }

    #[test]
    fn reads_the_common_layouts() {
        for text in [
            "400,0.5\n500,0.75\n",
            "# about\nwavelength_nm,value\n400,0.5\n\n500,0.75 # end\n",
            "\u{feff}nm;r\r\n400;0.5\r\n500;0.75",
            "nm\tr\n400\t0.5\n500\t0.75",
            "\"wavelength (um)\",\"r\"\n0.5,0.75\n0.4,0.5",
            "wavenumber_cm-1,r\n20000,0.75\n25000,0.5",
            "400 0.5\n500   0.75",
        ] {
            let table = csv(text, None).unwrap();
            assert_eq!((table.nm, table.value), (vec![400.0, 500.0], vec![0.5, 0.75]), "{text}");
        }
        let spd = parse_spectrum(b"400 0.5 # x\n500 0.75", Path::new("t.SPD"), None).unwrap();
        assert_eq!((spd.nm, spd.line), (vec![400.0, 500.0], vec![1, 2]));
    }

    #[test]
    fn picks_columns_and_skips_what_is_not_given() {
        let text = "nm,a,b\n400,1,\n500,2,5\n600,3,6\n";
        assert_eq!(csv(text, Some("a")).unwrap().value, [1.0, 2.0, 3.0]);
        let b = csv(text, Some("b")).unwrap();
        assert_eq!((b.nm, b.value, b.line), (vec![500.0, 600.0], vec![5.0, 6.0], vec![3, 4]));
        assert!(csv(text, None).unwrap_err().help.unwrap().contains("a, b"));
        assert!(csv(text, Some("c")).unwrap_err().help.unwrap().contains("a, b"));
    }

    #[test]
    fn an_index_is_two_columns() {
        let index = |text: &str| parse_index(text.as_bytes(), Path::new("nk.csv"));
        for text in ["400,1.5,0\n500,1.4,0.25\n", "k,nm,x\n", "um,k,x,n\n0.4,0,9,1.5\n0.5,0.25,,1.4\n"] {
            match index(text) {
                Ok([n, k]) => {
                    assert_eq!((n.nm, n.value), (vec![400.0, 500.0], vec![1.5, 1.4]), "{text}");
                    assert_eq!((k.nm, k.value), (vec![400.0, 500.0], vec![0.0, 0.25]), "{text}");
                }
                Err(problem) => assert!(text.starts_with('k') && problem.message.contains("no column \"n\"")),
            }
        }
        // Each has the wavelengths at which it is given.
        let [n, k] = index("nm,n,k\n400,1.5,\n500,1.4,1\n600,1.3,2\n").unwrap();
        assert_eq!((n.nm.len(), k.nm), (3, vec![500.0, 600.0]));
        assert!(index("nm,n,k\n400,1.5,\n500,1.4,\n").unwrap_err().message.contains("0 values of k"));
        assert!(index("400,1.5\n500,1.4\n").unwrap_err().message.contains("2 columns and no header"));
    }

    #[test]
    fn a_step_is_two_equal_wavelengths() {
        assert_eq!(csv("400,1\n400,2\n500,3", None).unwrap().nm, [400.0, 400.0, 500.0]);
    }

    #[test]
    fn mistakes_name_their_line() {
        for (text, line, words) in [
            ("", None, "no data"),
            ("# only\n\n", None, "no data"),
            ("400\n500", Some(1), "one column"),
            ("400,1,2\n500,1,2", Some(1), "no header"),
            ("nm,v\n400,1\n500,x", Some(3), "`x` is not a finite number"),
            ("400,1\n500,nan", Some(2), "finite"),
            ("400,1\n500,inf", Some(2), "finite"),
            ("400,1\n500,", Some(2), "finite"),
            ("400,1\n500,1,1", Some(2), "cells"),
            ("400,1\n-500,1", Some(2), "greater than 0"),
            ("400,1\n500,1\n450,1\n600,1", Some(3), "follows"),
            ("400,1\n400,2\n400,3\n500,1", Some(3), "third time"),
            ("400,1", None, "1 values"),
            ("angstrom,v\n4000,1\n5000,1", Some(1), "angstrom"),
        ] {
            let problem = csv(text, None).unwrap_err();
            assert_eq!(problem.line, line, "{text:?}: {problem}");
            assert!(problem.message.contains(words), "{text:?}: {problem}");
            assert_eq!(problem.file, Path::new("t.csv"));
        }
        assert!(csv("400,1\n500,2", Some("a")).unwrap_err().message.contains("no header"));
    }
}
