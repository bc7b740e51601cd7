//! Tables of numbers in text, as people, spreadsheets, instruments and Fortran write them: what separates cells, which line
//! names the columns, what a decimal comma is, and which lines are about something else. What can be read in two ways is refused.

use std::path::Path;

use csv::{ReaderBuilder, StringRecord, Trim};

use super::said::Said;
use super::unit::Stated;
use crate::error::Problem;

mod around;
mod below;
mod header;
mod statement;

type Read<T> = Result<T, Box<Problem>>;

/// A table in a text file.
#[derive(Debug)]
pub struct Table<'p> {
    pub path: &'p Path,
    /// Of every column; empty where the file names none.
    pub names: Vec<String>,
    /// The line of the names, 1-based; that of the first row where there are none.
    pub line: usize,
    pub rows: Vec<Row>,
    /// What was left out or mended, in words that go on after the file's name.
    pub notes: Vec<String>,
    /// The unit of power that the comments before the numbers speak of, and the line of the first that does.
    pub unit_in_comment: Option<(usize, Stated)>,
    /// What lines before the numbers call the values, and the first line that does.
    pub said: Option<(Said, String)>,
    /// The lines that are about the table, by number.
    pub comments: Vec<(usize, String)>,
    decimal: Decimal,
}

/// A line of a table.
#[derive(Debug)]
pub struct Row {
    /// 1-based.
    pub line: usize,
    pub cells: StringRecord,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Decimal {
    Point,
    Comma,
}

/// What lies between cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Separator {
    Char(u8),
    Space,
}

/// What to do about a table that is none.
const SPECTRA: &str = "write lines of `nm,value`";

/// Cells that say that there is no number.
const NOT_GIVEN: [&str; 12] =
    ["", "#n/a", "#na", "n/a", "na", "#null!", "#div/0!", "#value!", "#ref!", "#name?", "#num!", "--"];

fn wrong(path: &Path, line: Option<usize>, message: String, help: &str) -> Box<Problem> {
    let help = (!help.is_empty()).then(|| help.to_owned());
    Box::new(Problem { file: path.to_owned(), line, message, help, ..Problem::default() })
}

/// The text of a file: UTF-8, UTF-16 by its mark or its zeros, otherwise Latin-1. Every kind of line end becomes `\n`.
pub fn text(bytes: &[u8], path: &Path) -> Read<String> {
    let utf16 = |bytes: &[u8], word: fn([u8; 2]) -> u16| {
        let words: Vec<u16> = bytes.as_chunks::<2>().0.iter().map(|&pair| word(pair)).collect();
        String::from_utf16_lossy(&words)
    };
    let text = match bytes {
        [0xff, 0xfe, 0, 0, ..] | [0, 0, 0xfe, 0xff, ..] => {
            return Err(wrong(path, None, "is UTF-32 text".to_owned(), "save it as UTF-8"));
        }
        [0xff, 0xfe, rest @ ..] => utf16(rest, u16::from_le_bytes),
        [0xfe, 0xff, rest @ ..] => utf16(rest, u16::from_be_bytes),
        [a, 0, b, 0, ..] if *a != 0 && *b != 0 => utf16(bytes, u16::from_le_bytes),
        [0, a, 0, b, ..] if *a != 0 && *b != 0 => utf16(bytes, u16::from_be_bytes),
        _ => match std::str::from_utf8(bytes) {
            Ok(text) => text.to_owned(),
            // Names of units such as µm and Å are the same in Latin-1 and what Windows makes of it.
            Err(_) => bytes.iter().map(|&byte| char::from(byte)).collect(),
        },
    };
    let text = text.trim_start_matches('\u{feff}');
    Ok(if text.contains('\r') { text.replace("\r\n", "\n").replace('\r', "\n") } else { text.to_owned() })
}

/// Whether `line` is about the table and no part of it.
fn is_comment(line: &str) -> bool {
    let starts = |mark: &str| {
        line.starts_with(mark) && !NOT_GIVEN.iter().any(|cell| !cell.is_empty() && lower_starts(line, cell))
    };
    // Ocean Optics puts `>>>>>Begin Spectral Data<<<<<` and an end around its numbers.
    starts("#") || line.starts_with(">>>>>") || line.starts_with('%') || line.starts_with('!') || line.starts_with("//")
}

fn lower_starts(line: &str, cell: &str) -> bool {
    line.get(..cell.len()).is_some_and(|start| start.eq_ignore_ascii_case(cell))
}

/// `line` up to a comment: from a `#` on that a blank follows, or, after numbers, any that begins no cell such as `#N/A`.
fn without_comment(line: &str) -> &str {
    let numbers = line.trim_start().starts_with(|c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+'));
    for (i, _) in line.match_indices('#') {
        let rest = &line[i..];
        let quoted = line[..i].matches('"').count() % 2 == 1;
        let is_cell = NOT_GIVEN.iter().any(|cell| cell.starts_with('#') && lower_starts(rest, cell));
        // What Windows prints of what is no number: 1.#QNAN, -1.#INF.
        let is_cell = is_cell
            || (line[..i].ends_with('.')
                && ["#QNAN", "#SNAN", "#INF", "#IND", "#J"].iter().any(|cell| lower_starts(rest, cell)));
        if !quoted && !is_cell && (numbers || rest[1..].starts_with([' ', '\t']) || rest.len() == 1) {
            return line[..i].trim_end();
        }
    }
    line
}

/// A number, also with Fortran's exponents (`1.0D+02`, `1.0-101`), a minus sign of print, or percent.
fn parse_number(cell: &str, decimal: Decimal) -> Option<f64> {
    let plain = |text: &str| text.parse::<f64>().ok();
    if decimal == Decimal::Point
        && let Some(value) = plain(cell)
    {
        return Some(value);
    }
    let mut text = cell.replace('\u{2212}', "-");
    if decimal == Decimal::Comma {
        if text.contains('.') {
            return None;
        }
        text = text.replace(',', ".");
    }
    if let Some(percent) = text.strip_suffix('%') {
        return plain(percent.trim_end()).map(|value| value / 100.0);
    }
    if let Some(value) = plain(&text) {
        return Some(value);
    }
    let digits = |text: &str| text.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '.' | '+' | '-'));
    if !digits(&text) {
        return None;
    }
    if let Some(value) = plain(&text.replace(['d', 'D'], "e")) {
        return Some(value);
    }
    // An exponent of three digits leaves no room for its letter.
    let sign = text.char_indices().skip(1).filter(|(_, c)| matches!(c, '+' | '-')).map(|(i, _)| i).last()?;
    let (mantissa, exponent) = text.split_at(sign);
    if mantissa.contains(['e', 'E']) || exponent.len() != 4 {
        return None;
    }
    plain(&format!("{mantissa}e{exponent}"))
}

/// Splits the lines of `text`; a record may go on over a line end within quotes.
fn records(lines: &[(usize, &str)], separator: Separator) -> Vec<Row> {
    let Separator::Char(delimiter) = separator else {
        return lines
            .iter()
            .map(|(line, text)| Row { line: *line, cells: text.split_whitespace().map(unquoted).collect() })
            .collect();
    };
    let mut joined = String::with_capacity(lines.iter().map(|(_, text)| text.len() + 1).sum());
    for (_, text) in lines {
        joined.push_str(text);
        joined.push('\n');
    }
    let mut reader = ReaderBuilder::new()
        .delimiter(delimiter)
        .has_headers(false)
        .flexible(true)
        .trim(Trim::All)
        .quoting(joined.contains('"'))
        .from_reader(joined.as_bytes());
    let mut rows = Vec::with_capacity(lines.len());
    let mut record = StringRecord::new();
    // Reading from memory text that is UTF-8 cannot fail.
    while let Ok(true) = reader.read_record(&mut record) {
        let index = record.position().map_or(0, |position| position.line() as usize).saturating_sub(1);
        let line = lines.get(index).map_or(0, |(line, _)| *line);
        rows.push(Row { line, cells: std::mem::take(&mut record) });
    }
    rows
}

fn unquoted(cell: &str) -> &str {
    cell.trim_matches('"')
}

/// How many cells most rows have, the earlier number where two are as frequent.
fn usual_count(rows: &[Row]) -> usize {
    let mut counts: Vec<(usize, usize)> = Vec::new();
    for row in rows {
        match counts.iter_mut().find(|(cells, _)| *cells == row.cells.len()) {
            Some((_, times)) => *times += 1,
            None => counts.push((row.cells.len(), 1)),
        }
    }
    let most = counts.iter().map(|(_, times)| *times).max().unwrap_or(0);
    counts.iter().find(|(_, times)| *times == most).map_or(0, |(cells, _)| *cells)
}

/// Reads the table in `bytes`. A file named `.spd` has blanks between its cells.
pub fn read<'p>(bytes: &[u8], path: &'p Path) -> Read<Table<'p>> {
    let text = text(bytes, path)?;
    parse(&text, 1, path)
}

/// Like [`read`], of a table of other numbers than spectra; `rows` says in messages what its lines are.
pub fn read_for<'p>(bytes: &[u8], path: &'p Path, rows: &str) -> Read<Table<'p>> {
    read(bytes, path).map_err(|mut problem| {
        problem.help = problem.help.map(|help| match help.as_str() {
            SPECTRA => format!("write lines of {rows}"),
            _ => help,
        });
        problem
    })
}

/// Like [`read`], of text whose first line has the number `first_line` in the file.
pub fn parse<'p>(text: &str, first_line: usize, path: &'p Path) -> Read<Table<'p>> {
    let mut comments: Vec<(usize, &str)> = Vec::new();
    let mut lines: Vec<(usize, &str)> = Vec::new();
    let mut declared = None;
    for (number, line) in (first_line..).zip(text.split('\n')) {
        let line = line.trim_matches([' ', '\u{0}', '\u{1a}']);
        if line.trim().is_empty() {
            continue;
        }
        if lines.is_empty()
            && declared.is_none()
            && let Some(separator) = line.trim_matches('"').strip_prefix("sep=").and_then(|rest| rest.chars().next())
            && separator.is_ascii()
        {
            declared = Some(Separator::Char(separator as u8));
        } else if is_comment(line.trim_start()) {
            comments.push((number, line.trim_start()));
        } else {
            lines.push((number, without_comment(line)));
        }
    }
    if lines.is_empty() {
        return Err(wrong(path, None, "holds no data".to_owned(), SPECTRA));
    }
    // IPAC's, of which names, types and units stand between bars over numbers between blanks.
    let is_barred = |line: &str| line.starts_with('|') && line.ends_with('|') && line.len() > 2;
    if let Some((line, _)) = lines.iter().find(|(_, line)| is_barred(line))
        && lines.iter().any(|(_, line)| line.starts_with(|c: char| c.is_ascii_digit()) && !line.contains('|'))
    {
        let help = "export it as CSV, with the units in the names: `wavelength (um),radiance (W m-2 sr-1 um-1)`";
        return Err(wrong(path, Some(*line), "is a table of IPAC, which is not read".to_owned(), help));
    }
    let is_spd = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("spd"));
    let separator = match declared {
        Some(separator) => separator,
        None if is_spd => Separator::Space,
        None => separator_of(&lines),
    };
    let mut rows = records(&lines, separator);
    let decimal = decimal_of(&rows, separator, path)?;
    drop_empty(&mut rows);
    if rows.is_empty() {
        return Err(wrong(path, None, "holds no data".to_owned(), SPECTRA));
    }
    let mut table = Table {
        path,
        names: Vec::new(),
        line: rows[0].line,
        rows,
        notes: Vec::new(),
        unit_in_comment: None,
        said: None,
        comments: comments.iter().map(|(line, text)| (*line, (*text).to_owned())).collect(),
        decimal,
    };
    table.find_header(separator, &comments)?;
    Ok(table)
}

/// What separates the cells of most lines, looking at those with numbers first: names may hold anything.
fn separator_of(lines: &[(usize, &str)]) -> Separator {
    let numeric = |line: &str| line.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+' | '"'));
    let mut sample: Vec<&str> = lines.iter().map(|(_, line)| *line).filter(|line| numeric(line)).take(200).collect();
    if sample.is_empty() {
        sample = lines.iter().map(|(_, line)| *line).take(200).collect();
    }
    let with = |c: char| sample.iter().filter(|line| line.trim_end().contains(c)).count();
    let found = [';', '\t', ',', '|'].into_iter().find(|c| 2 * with(*c) > sample.len());
    match found {
        // Blanks between numbers with decimal commas: no comma stands before a blank.
        Some(',') if sample.iter().all(|line| is_spaced_decimals(line)) => Separator::Space,
        Some(c) => Separator::Char(c as u8),
        None => Separator::Space,
    }
}

/// Whether a line is several numbers with one decimal comma at most each, and blanks between them.
fn is_spaced_decimals(line: &str) -> bool {
    let words: Vec<&str> = line.split_whitespace().collect();
    words.len() > 1
        && words.iter().all(|word| {
            word.contains(|c: char| c.is_ascii_digit())
                && !word.starts_with(',')
                && !word.ends_with(',')
                && word.matches(',').count() <= 1
        })
}

/// Whether commas are decimal: only where something else separates cells, and only if no number has a point.
fn decimal_of(rows: &[Row], separator: Separator, path: &Path) -> Read<Decimal> {
    if separator == Separator::Char(b',') {
        return Ok(Decimal::Point);
    }
    let number = |cell: &&str| {
        cell.contains(',')
            && cell
                .trim_end_matches(['%', ' '])
                .chars()
                .all(|c| c.is_ascii_digit() || matches!(c, ',' | '.' | '+' | '-' | 'e' | 'E' | '%'))
    };
    let with_comma = || rows.iter().flat_map(|row| row.cells.iter().filter(number).map(move |cell| (row.line, cell)));
    let Some((first, example)) = with_comma().next() else { return Ok(Decimal::Point) };
    let has_points = rows
        .iter()
        .flat_map(|row| row.cells.iter())
        .any(|cell| cell.contains('.') && cell.parse::<f64>().is_ok() || number(&cell) && cell.contains('.'));
    let grouped = |cell: &str| {
        let (before, after) = cell.split_once(',').unwrap_or((cell, ""));
        let before = before.trim_start_matches(['-', '+']);
        (1..=3).contains(&before.len()) && !before.starts_with('0') && after.len() == 3
    };
    let several = with_comma().any(|(_, cell)| cell.matches(',').count() > 1);
    let ambiguous = separator != Separator::Char(b';') && with_comma().all(|(_, cell)| grouped(cell));
    if has_points || several || ambiguous {
        let message = format!("`{example}` may have a decimal comma or a comma between thousands");
        return Err(wrong(path, Some(first), message, "write decimal points, and no commas within numbers"));
    }
    Ok(Decimal::Comma)
}

/// Drops rows without any content, and columns at the end that have none.
fn drop_empty(rows: &mut Vec<Row>) {
    rows.retain(|row| row.cells.iter().any(|cell| !cell.is_empty()));
    let filled = |row: &Row| (0..row.cells.len()).rev().find(|i| !row.cells[*i].is_empty()).map_or(0, |i| i + 1);
    let most = rows.iter().map(filled).max().unwrap_or(0);
    for row in rows.iter_mut().filter(|row| row.cells.len() > most) {
        row.cells.truncate(most);
    }
}

impl Table<'_> {
    pub fn problem(&self, line: Option<usize>, message: String, help: &str) -> Box<Problem> {
        wrong(self.path, line, message, help)
    }

    /// Columns of the table.
    pub fn columns(&self) -> usize {
        if self.names.is_empty() { self.rows.first().map_or(0, |row| row.cells.len()) } else { self.names.len() }
    }

    /// The number in a cell; `None` where there is none.
    pub fn number(&self, row: &Row, column: usize) -> Read<Option<f64>> {
        let cell = row.cells.get(column).unwrap_or("");
        match parse_number(cell, self.decimal).filter(|value| value.is_finite()) {
            Some(value) => Ok(Some(value)),
            None if self.is_missing(cell) => Ok(None),
            None => Err(self.problem(Some(row.line), format!("`{}` is not a finite number", shown(cell)), "")),
        }
    }

    /// The same of a column in which no cell may be empty.
    pub fn filled(&self, row: &Row, column: usize) -> Read<f64> {
        let missing = || self.problem(Some(row.line), "has no number in one of its columns".to_owned(), "fill the gap");
        self.number(row, column)?.ok_or_else(missing)
    }

    /// Whether a cell says by itself that its number is percent.
    pub fn is_percent(&self, row: &Row, column: usize) -> bool {
        row.cells.get(column).is_some_and(|cell| cell.ends_with('%'))
    }

    fn is_missing(&self, cell: &str) -> bool {
        let lower = cell.to_lowercase();
        NOT_GIVEN.contains(&lower.as_str())
    }

    /// Refuses rows that have more or fewer cells than the table.
    pub fn check_row(&self, row: &Row) -> Read<()> {
        let (has, expected) = (row.cells.len(), self.columns());
        if has == expected {
            return Ok(());
        }
        let message = format!("has {has} cells where {expected} are expected");
        let help = if has == 2 * expected && row.cells.iter().all(|cell| cell.parse::<f64>().is_ok()) {
            "write decimal points, or semicolons between cells, if the commas are decimal; else give every line the same \
             number of cells"
        } else {
            "give every line the same number of cells"
        };
        Err(self.problem(Some(row.line), message, help))
    }

    fn is_number(&self, cell: &str) -> bool {
        parse_number(cell, self.decimal).is_some()
    }
}

/// Of a table whose columns are known by name: the first that is none of `known`, or that stands for the second time, which is told.
pub fn stray(names: &[String], known: &[&str]) -> Option<(usize, bool)> {
    names.iter().enumerate().find_map(|(i, name)| {
        let is_twice = names[..i].contains(name);
        (is_twice || !known.contains(&name.as_str())).then_some((i, is_twice))
    })
}

/// The beginning of what a file says, fit for a message.
pub fn shown(text: &str) -> String {
    const MOST: usize = 60;
    let mut cut: String = text.chars().take(MOST).collect();
    if text.chars().count() > MOST {
        cut.push('…');
    }
    cut.escape_debug().to_string()
}

#[cfg(test)]
mod tests;
