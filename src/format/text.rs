//! Spectra in files. Here CSV (`nm,value`, with more columns by name or number; `nm,n,k`) and `.spd` (`nm value`); which of
//! the other formats a file has is told from its name and how it begins.

use std::fmt::Debug;
use std::path::Path;

use super::said::Said;
use super::table::{self, Table};
use super::unit::{self, Meaning, Stated, Unit};
use super::{columns, csv_table, instrument, library, modtran};
use crate::error::Problem;
use crate::spectral::Channels;

/// Wavelengths in nm, in vacuum, ascending (two equal ones make a step), and a value for each.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SpectrumTable {
    pub nm: Vec<f64>,
    pub value: Vec<f64>,
    /// The 1-based line each value stands on; empty where the file has no lines.
    pub line: Vec<usize>,
    /// The unit of the values, where the file says one that has not been applied yet.
    pub unit: Option<Stated>,
    /// What the file calls them, and in which words.
    pub said: Option<(Said, String)>,
    /// What was left out or mended, in words that go on after the file's name.
    pub notes: Vec<String>,
}

impl SpectrumTable {
    /// The same, called `name` by its file.
    pub(super) fn called(self, name: &str) -> SpectrumTable {
        SpectrumTable { said: Said::in_name(name).map(|said| (said, name.to_owned())), ..self }
    }

    /// Adds a value, and the line it stands on.
    pub(super) fn push(&mut self, nm: f64, value: f64, line: usize) {
        self.nm.push(nm);
        self.value.push(value);
        self.line.push(line);
    }
}

/// Which spectrum of a file is wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Column<'a> {
    /// The only one.
    Only,
    Named(&'a str),
    /// Counted from 1, in a table with that of the wavelengths.
    Number(usize),
}

impl<'a> From<Option<&'a str>> for Column<'a> {
    fn from(name: Option<&'a str>) -> Self {
        name.map_or(Column::Only, Column::Named)
    }
}

/// A spectrum as CSV: a header, then the centre of each channel in nm, its radiance and, where known, standard error, with as
/// many digits as bring back the numbers exactly.
pub fn spectrum_csv<T: Debug>(channels: &Channels, radiance: &[T], standard_error: Option<&[T]>) -> String {
    values_csv("radiance", channels, radiance, standard_error)
}

/// The same of another quantity, by its name.
pub fn values_csv<T: Debug>(name: &str, channels: &Channels, radiance: &[T], standard_error: Option<&[T]>) -> String {
    // The header stands first: many readers of CSV know no comments.
    let columns = if standard_error.is_some() { 3 } else { 2 };
    let mut table = csv_table::Table::new(&["wavelength_nm", name, "standard_error"][..columns]);
    for (k, radiance) in radiance.iter().enumerate() {
        // Debug, not Display: 1e-30 instead of thirty zeros.
        let error = standard_error.map(|errors| format!("{:?}", errors[k]));
        table.row([channels.centre(k).to_string(), format!("{radiance:?}")].into_iter().chain(error));
    }
    table.finish()
}

/// Reads the spectrum of `column` of the file at `path`: CSV, `.spd`, an ENVI spectral library, ECOSTRESS or USGS text,
/// MODTRAN's tape7, or what instruments and other programs write ([`instrument`]). `unit` is that of CSV's first column where
/// its header does not say.
///
/// Errors name the line; without one, the file as a whole could not be read.
pub fn read_spectrum(path: &Path, column: Column, unit: Option<Unit>) -> Result<SpectrumTable, Box<Problem>> {
    parse_any(&read(path)?, path, column, unit, true)
}

/// [`read_spectrum`] on the content of a file that is not there: `path` says its name only. Formats of several files are refused.
pub fn parse_file(
    bytes: &[u8],
    path: &Path,
    column: Column,
    unit: Option<Unit>,
) -> Result<SpectrumTable, Box<Problem>> {
    parse_any(bytes, path, column, unit, false)
}

/// `is_there`: whether `path` has what belongs to the file beside it.
fn parse_any(
    bytes: &[u8],
    path: &Path,
    column: Column,
    unit: Option<Unit>,
    is_there: bool,
) -> Result<SpectrumTable, Box<Problem>> {
    let problem = |message: &str, help: &str| {
        let (message, help) = (message.to_owned(), Some(help.to_owned()));
        Err(Box::new(Problem { file: path.to_owned(), message, help, ..Problem::default() }))
    };
    let several = || problem("is one of several files that belong together", "write the spectrum as CSV: `nm,value`");
    let other = if library::is_envi(path, bytes) {
        if !is_there {
            return several();
        }
        library::read_envi(path, column)
    } else if let Some(format) = instrument::Format::of(path, bytes) {
        format.read(bytes, path, column)
    } else if library::is_ecostress(bytes) {
        library::no_columns(path, column).and_then(|()| library::parse_ecostress(bytes, path))
    } else if library::is_usgs(bytes) {
        if !is_there {
            return several();
        }
        library::no_columns(path, column).and_then(|()| library::read_usgs(bytes, path))
    } else if modtran::is_tape7(path, bytes) {
        modtran::parse(bytes, path, column)
    } else {
        return parse(bytes, path, column, unit);
    };
    match unit {
        None => other,
        Some(_) => problem("says by itself in which unit its wavelengths are", "remove `unit`"),
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
    parse(bytes, path, column.into(), None)
}

/// n and k of an `nm,n,k` file, or of one of refractiveindex.info's, as far as it gives them; without a header, the second and
/// the third of three columns.
pub fn parse_index(bytes: &[u8], path: &Path) -> Result<[Option<SpectrumTable>; 2], Box<Problem>> {
    let text = table::text(bytes, path)?;
    if let Some(blocks) = downloaded(&text) {
        let block = |name: &str| match blocks.iter().find(|block| block.name == name) {
            Some(block) => block.read(path).map(Some),
            None => Ok(None),
        };
        return Ok([block("n")?, block("k")?]);
    }
    let table = table::parse(&text, 1, path)?;
    let axis = Axis::of(&table, None)?;
    let mut found = ["n", "k"].map(|name| position(&table, name));
    if table.names.is_empty() {
        if table.columns() != 3 {
            let message = format!("has {} columns and no header line", table.columns());
            return Err(table.problem(Some(table.line), message, "write lines of `nm,n,k`"));
        }
        found = [Ok(1), Ok(2)];
    }
    let [n, k] = found;
    Ok([Some(axis.column(&table, n?, " of n")?), Some(axis.column(&table, k?, " of k")?)])
}

/// Every column beside the wavelength, with the name that the header gives it.
pub fn read_columns(path: &Path) -> Result<Vec<(String, SpectrumTable)>, Box<Problem>> {
    let bytes = read(path)?;
    match instrument::Format::of(path, &bytes) {
        Some(format @ instrument::Format::Refused(..)) => format.read(&bytes, path, Column::Only).map(|_| Vec::new()),
        _ => parse_columns(&bytes, path),
    }
}

/// [`read_columns`] on the content of the file.
pub fn parse_columns(bytes: &[u8], path: &Path) -> Result<Vec<(String, SpectrumTable)>, Box<Problem>> {
    let table = table::read(bytes, path)?;
    let axis = Axis::of(&table, None)?;
    let name = |column: usize| table.names.get(column).cloned().unwrap_or_default();
    let of =
        |column: usize| if table.names.is_empty() { String::new() } else { format!(" of {}", named(&name(column))) };
    axis.columns(&table, &(axis.column + 1..table.columns()).collect::<Vec<_>>(), of)?
        .into_iter()
        .map(|(column, table)| Ok((name(column), table)))
        .collect()
}

fn parse(bytes: &[u8], path: &Path, column: Column, unit: Option<Unit>) -> Result<SpectrumTable, Box<Problem>> {
    let text = table::text(bytes, path)?;
    if unit.is_none()
        && let Some(blocks) = downloaded(&text)
    {
        return Block::pick(&blocks, path, column)?.read(path);
    }
    let table = table::parse(&text, 1, path)?;
    let axis = Axis::of(&table, unit)?;
    let value = axis.pick(&table, column)?;
    axis.column(&table, value, "")
}

/// The column of wavelengths, and what its numbers are.
struct Axis {
    column: usize,
    unit: Unit,
    /// Whether the header says that these are wavelengths in air.
    in_air: bool,
    /// Whether nothing says the unit, so that it is nm.
    is_guessed: bool,
    /// What is to be said of the table.
    notes: Vec<String>,
}

impl Axis {
    /// `unit` is what the scene says; otherwise the header does.
    fn of(table: &Table, unit: Option<Unit>) -> Result<Axis, Box<Problem>> {
        if table.columns() < 2 {
            return Err(table.problem(Some(table.line), "has one column only".to_owned(), "write lines of `nm,value`"));
        }
        let name = |column: usize| table.names.get(column).map_or("", String::as_str);
        let column = columns::axis(table, unit.is_some())?;
        let stated = Unit::stated(name(column));
        if let (Some(unit), Ok(Some(of_header))) = (unit, &stated)
            && unit != *of_header
        {
            let message =
                format!("calls its first column `{}`, and the scene says another unit", table::shown(name(column)));
            return Err(table.problem(Some(table.line), message, "remove `unit`, or correct the header"));
        }
        let is_guessed = unit.is_none() && stated == Ok(None);
        if is_guessed && table.path.extension().is_some_and(|e| e.eq_ignore_ascii_case("dpt")) {
            let message = "does not say in what its first column is, which OPUS of Bruker writes as wavenumbers mostly";
            return Err(table.problem(None, message.to_owned(), "say so in the scene, `unit = \"cm-1\"`"));
        }
        let unit = match unit {
            Some(unit) => unit,
            None => stated.map(|unit| unit.unwrap_or(Unit::NANOMETRE)).map_err(|other| {
                let message = format!("gives its first column as {other}, from which no wavelength follows");
                let second = table.names.get(1).map(|name| name.to_lowercase()).unwrap_or_default();
                let help = if second.starts_with("coef") {
                    "of HAPI's absorption coefficients say the units: `nu (cm-1),coef (cm-1)`, or for a species \
                     `nu (cm-1),300 K (cm2/molecule)`"
                } else {
                    "name wavelength and unit in the header: nm, um, angstrom, cm-1, THz, eV; or write `unit = \"nm\"`"
                };
                table.problem(Some(table.line), message, help)
            })?,
        };
        columns::check_intervals(table, column)?;
        let mut notes = table.notes.clone();
        notes.extend((column > 0).then(|| columns::numbered_words(table, column)));
        Ok(Axis { column, unit, in_air: unit::is_in_air(name(column)), is_guessed, notes })
    }

    /// The number of the column that is wanted.
    fn pick(&self, table: &Table, column: Column) -> Result<usize, Box<Problem>> {
        let others: Vec<usize> = (self.column + 1..table.columns()).collect();
        let names = || others.iter().filter_map(|i| table.names.get(*i)).cloned().collect::<Vec<_>>().join(", ");
        let by_number = |number: usize| {
            let found = number.checked_sub(1).filter(|i| others.contains(i));
            found.ok_or_else(|| {
                let message = format!("has no column {number} of values");
                let help = format!("its columns of values are {} to {}", self.column + 2, table.columns());
                table.problem(Some(table.line), message, &help)
            })
        };
        match column {
            Column::Number(number) => by_number(number),
            Column::Named(wanted) if table.names.is_empty() => match wanted.trim().parse() {
                Ok(number) => by_number(number),
                Err(_) => Err(table.problem(
                    Some(table.line),
                    "has no header line, so no column can be picked by name".to_owned(),
                    "give its number (`column = 2` is the one after the wavelengths), or name the columns in a first line",
                )),
            },
            Column::Named(wanted) => position(table, wanted),
            Column::Only if others.len() == 1 => Ok(others[0]),
            Column::Only if table.names.is_empty() => {
                let message = format!("has {} columns and no header line", table.columns());
                let help = if table.columns() == 7 {
                    "pick one by its number: `column = 2` is the one after the wavelengths (if this is output of libRadtran's \
                     uvspec: lambda, edir, edn, eup, uavgdir, uavgdn, uavgup, in the unit of its solar spectrum, mostly \
                     mW m-2 nm-1: `scale = 0.001`)"
                } else {
                    "pick one by its number: `column = 2` is the one after the wavelengths"
                };
                Err(table.problem(Some(table.line), message, help))
            }
            Column::Only => {
                let message = format!("has {} value columns", others.len());
                Err(table.problem(Some(table.line), message, &format!("pick one with `column`: {}", names())))
            }
        }
    }

    /// Wavelengths and values of one column, ascending; `of` says which it is.
    fn column(&self, table: &Table, value: usize, of: &str) -> Result<SpectrumTable, Box<Problem>> {
        let mut all = self.columns(table, &[value], |_| of.to_owned())?;
        Ok(all.pop().map(|(_, table)| table).unwrap_or_default())
    }

    /// Several columns in one pass.
    fn columns(
        &self,
        table: &Table,
        wanted: &[usize],
        of: impl Fn(usize) -> String,
    ) -> Result<Vec<(usize, SpectrumTable)>, Box<Problem>> {
        let own = columns::own_axes(table, self.column);
        for column in wanted {
            self.check_axis_of(table, *column, &own)?;
        }
        let mut found: Vec<SpectrumTable> = vec![SpectrumTable::default(); wanted.len()];
        // Cells that say percent by themselves, in columns that say it too.
        let stated = |column: &usize| Stated::in_name(table.names.get(*column).map_or("", String::as_str));
        let in_percent: Vec<bool> =
            wanted.iter().map(|column| stated(column).is_some_and(|stated| stated.is_percent())).collect();
        for row in &table.rows {
            table.check_row(row)?;
            let Some(x) = table.number(row, self.column)? else { continue };
            let nm = self.nm(table, row.line, x)?;
            for ((column, found), in_percent) in wanted.iter().zip(&mut found).zip(&in_percent) {
                if let Some(value) = table.number(row, *column)? {
                    let is_twice = *in_percent && table.is_percent(row, *column);
                    found.push(nm, if is_twice { value * 100.0 } else { value }, row.line);
                }
            }
        }
        let finish = |(column, mut found): (&usize, SpectrumTable)| {
            let name = table.names.get(*column).map_or("", String::as_str);
            found.unit = Stated::in_name(name);
            found = match optical_constant(&table.names, *column) {
                Some(said) => SpectrumTable { said: Some((said, name.to_owned())), ..found },
                None => found.called(name),
            };
            // Of one column, what lines before the numbers call it.
            if table.columns() == 2 && found.said.is_none() {
                found.said.clone_from(&table.said);
            }
            found.notes.clone_from(&self.notes);
            if let (None, 3.., Some((_, stated))) = (&found.unit, table.columns(), &table.unit_in_comment)
                && stated.is_percent()
            {
                found.unit = Some(Stated { meaning: Meaning::Factor, certain: true, text: stated.text.clone() });
            }
            if let (None, 2, Some((line, stated))) = (&found.unit, table.columns(), &table.unit_in_comment) {
                if !matches!(stated.meaning, Meaning::Unit(measure) if measure.is_own()) {
                    let text = table::shown(&stated.text);
                    found.notes.push(format!("says the unit of its values in the comment on line {line}: `{text}`"));
                }
                found.unit = Some(stated.clone());
            }
            found.notes.extend(self.looks_like_micrometres(&found.nm));
            if self.in_air {
                found.notes.push(unit::FROM_AIR.to_owned());
            }
            Ok((*column, ascending(found, table.path, &of(*column))?))
        };
        wanted.iter().zip(found).map(finish).collect()
    }

    /// Refuses a column that stands after wavelengths of its own, which are among `own`, as spectrophotometers write a sample beside
    /// the other, unless they are the same.
    fn check_axis_of(&self, table: &Table, column: usize, own: &[usize]) -> Result<(), Box<Problem>> {
        let Some(other) = own.iter().rev().find(|other| **other < column) else { return Ok(()) };
        match columns::differs(table, self.column, self.unit, *other)? {
            None => Ok(()),
            Some(line) => {
                let message = format!(
                    "gives column {} over wavelengths of its own, those of column {}, which differ from the first column's here",
                    column + 1,
                    other + 1
                );
                Err(table.problem(Some(line), message, "put each spectrum into a file of its own"))
            }
        }
    }

    /// What to say of wavelengths in nm that nobody has there.
    fn looks_like_micrometres(&self, nm: &[f64]) -> Option<String> {
        let longest = nm.iter().copied().fold(0.0, f64::max);
        (self.is_guessed && longest < unit::MICROMETRES_BELOW).then(|| {
            format!(
                "does not say in what its wavelengths are: up to {longest}, they are taken as nm (if they are micrometres, \
                 write `unit = \"um\"`)"
            )
        })
    }

    /// A wavelength in vacuum.
    fn nm(&self, table: &Table, line: usize, x: f64) -> Result<f64, Box<Problem>> {
        if x <= 0.0 {
            return Err(table.problem(Some(line), format!("the wavelength must be greater than 0, but is {x}"), ""));
        }
        let nm = self.unit.to_nm(x);
        Ok(if self.in_air { unit::vacuum_nm(nm) } else { nm })
    }
}

/// What a column called `n` or `k` is: one of an index where the table has both, or is of it alone. Beside other single letters
/// it is a name as they are.
fn optical_constant(names: &[String], column: usize) -> Option<Said> {
    let bare = |name: &String| name.split(['(', '[']).next().unwrap_or("").trim().to_lowercase();
    let has_unit = |name: &String| Stated::in_name(name).is_some_and(|stated| !stated.is_number());
    let values = names.get(1..)?;
    let is = |name: &String, letter: &str| bare(name) == letter && !has_unit(name);
    let name = names.get(column)?;
    let both = ["n", "k"].iter().all(|letter| values.iter().any(|name| is(name, letter)));
    let letters = values.iter().filter(|name| bare(name).chars().count() == 1).count();
    match () {
        () if !(both && letters == 2 || values.len() == 1) => None,
        () if is(name, "n") => Some(Said::Index),
        () if is(name, "k") => Some(if both { Said::Extinction } else { Said::Kay }),
        () => None,
    }
}

/// The column called `wanted`, which no other must be.
fn position(table: &Table, wanted: &str) -> Result<usize, Box<Problem>> {
    let exact = |name: &String| name == wanted;
    // Beside a header of units, or of capitals, the bare name is meant.
    let bare = |name: &String| {
        let bare = name.split(['(', '[']).next().unwrap_or("").trim();
        bare.eq_ignore_ascii_case(wanted.trim())
    };
    let all = |matches: &dyn Fn(&String) -> bool| {
        table.names.iter().enumerate().skip(1).filter(|(_, name)| matches(name)).map(|(i, _)| i).collect::<Vec<_>>()
    };
    let mut found = all(&exact);
    if found.is_empty() {
        found = all(&bare);
    }
    let names = || table.names.iter().skip(1).cloned().collect::<Vec<_>>().join(", ");
    only_one(&found, ["column", "columns"], &format!("\"{wanted}\""), names)
        .map_err(|(message, help)| table.problem(Some(table.line), message, &help))
}

/// One of the tables that a download of refractiveindex.info has one under the other: `wl` in um, and n or k.
struct Block<'t> {
    name: &'t str,
    text: &'t str,
    line: usize,
}

impl<'t> Block<'t> {
    fn pick<'b>(blocks: &'b [Block<'t>], path: &Path, column: Column) -> Result<&'b Block<'t>, Box<Problem>> {
        let found = match column {
            Column::Only if blocks.len() == 1 => blocks.first(),
            // What an index file gives unless asked for k.
            Column::Only => blocks.iter().find(|block| block.name == "n"),
            Column::Named(name) => blocks.iter().find(|block| block.name == name),
            Column::Number(number) => number.checked_sub(2).and_then(|i| blocks.get(i)),
        };
        found.ok_or_else(|| {
            let names: Vec<&str> = blocks.iter().map(|block| block.name).collect();
            let message = "has no such column".to_owned();
            let help = Some(format!("its columns are {}", names.join(", ")));
            Box::new(Problem { file: path.to_owned(), message, help, ..Problem::default() })
        })
    }

    fn read(&self, path: &Path) -> Result<SpectrumTable, Box<Problem>> {
        let table = table::parse(self.text, self.line, path)?;
        let axis =
            Axis { column: 0, unit: Unit::MICROMETRE, in_air: false, is_guessed: false, notes: table.notes.clone() };
        if table.columns() != 2 {
            return Err(table.problem(
                Some(table.line),
                format!("has {} columns", table.columns()),
                "two are expected",
            ));
        }
        let found = axis.column(&table, 1, &format!(" of {}", self.name))?;
        let said = if self.name == "n" { Said::Index } else { Said::Extinction };
        Ok(SpectrumTable { said: Some((said, self.name.to_owned())), ..found })
    }
}

/// The blocks of a download of refractiveindex.info, if `text` is one.
fn downloaded(text: &str) -> Option<Vec<Block<'_>>> {
    let heads = |line: &str| -> Option<&'static str> {
        let mut words =
            line.split([',', '\t', ';', ' ']).map(|word| word.trim().trim_matches('"')).filter(|w| !w.is_empty());
        let name = match (words.next(), words.next(), words.next()) {
            (Some("wl"), Some("n"), None) => "n",
            (Some("wl"), Some("k"), None) => "k",
            _ => return None,
        };
        Some(name)
    };
    let first = text.lines().find(|line| !line.trim().is_empty())?;
    heads(first)?;
    let mut starts: Vec<(usize, usize, &'static str)> = Vec::new();
    let mut offset = 0;
    for (number, line) in (1..).zip(text.split('\n')) {
        if let Some(name) = heads(line) {
            starts.push((number, offset, name));
        }
        offset += line.len() + 1;
    }
    let ends: Vec<usize> = starts.iter().skip(1).map(|(_, offset, _)| *offset).chain([text.len()]).collect();
    let blocks = starts.into_iter().zip(ends);
    Some(blocks.map(|((line, start, name), end)| Block { name, text: &text[start..end], line }).collect())
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
    if let Some(i) = table.nm.iter().position(|nm| !(nm.is_finite() && *nm > 0.0)) {
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

/// The place of the spectrum that is `wanted`, where those in `found` are called so; otherwise what is wrong, and what to do. `noun`:
/// what the file calls a spectrum, one and several; `choices`: all that there are.
pub(super) fn only_one(
    found: &[usize],
    [one, several]: [&str; 2],
    wanted: &str,
    choices: impl FnOnce() -> String,
) -> Result<usize, (String, String)> {
    match found {
        [index] => Ok(*index),
        [] => Err((format!("has no {one} {wanted}"), format!("its {several} are {}", choices()))),
        [first, second, ..] => {
            let help = format!("pick one by its number: `column = {}` or {}", first + 1, second + 1);
            Err((format!("has several {several} {wanted}"), help))
        }
    }
}

/// A name in a message, in quotes.
pub(super) fn named(name: &str) -> String {
    format!("\"{}\"", name.escape_debug())
}

#[cfg(test)]
mod tests;
