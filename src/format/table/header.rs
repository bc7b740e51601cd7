//! The line that names the columns of a table: where it stands, and what is put together with it.

use super::super::unit::{self, Stated, Unit};
use super::{Read, Row, SPECTRA, Separator, Table, records, shown, statement, usual_count};

/// The names of columns, and the row that has them.
struct Header {
    names: Vec<String>,
    row: usize,
    /// Of names and units the row that stands first.
    first: usize,
    notes: Vec<String>,
}

impl Table<'_> {
    /// Takes the names of columns, and whatever stands before them, out of the rows.
    pub(super) fn find_header(&mut self, separator: Separator, comments: &[(usize, &str)]) -> Read<()> {
        let usual = usual_count(&self.rows);
        let start = self.first_row(usual)?;
        let width = self.rows.get(start).map_or(usual, |row| row.cells.len());
        self.refuse_grouped_digits(start, width)?;
        let header = (self.header_of_cells(start, width))
            .or_else(|| self.header_of_words(start, width).filter(|_| separator == Separator::Space));
        let mut preamble = header.as_ref().map_or(start, |header| header.first);
        let mut names = Vec::new();
        if let Some(header) = header {
            self.notes.extend(header.notes);
            (names, self.line) = (header.names, self.rows[header.row].line);
        } else if let Some((line, found)) = self.header_in_comment(separator, width, start, comments) {
            let axis = &found[0];
            if !matches!(Unit::stated(axis), Ok(None | Some(Unit::NANOMETRE))) || unit::is_in_air(axis) {
                let shown = shown(axis);
                self.notes.push(format!("names its columns in the comment on line {line}, the first one `{shown}`"));
            }
            (names, self.line) = (found, line);
        } else if let Some(unit) = self.unit_over_optical_constants(start, width) {
            (names, self.line) = (vec![unit, "n".to_owned(), "k".to_owned()], self.rows[start - 2].line);
            preamble = start - 2;
        } else if start > 0 {
            let notes = self.notes.len();
            self.look_at_preamble(start, &[])?;
            self.notes.truncate(notes);
            self.refuse_names_of_other_columns(start - 1, width)?;
        }
        self.look_at_preamble(preamble, &names)?;
        self.warn_of_statements_in_comments(&names, start, comments);
        self.warn_of_factors_in_comments(&names, comments);
        self.unit_in_comment = self.unit_of_comments(start, comments);
        self.warn_of_rows_in_comments(separator, &names, comments);
        if names.is_empty() {
            self.line = self.rows.get(start).map_or(self.line, |row| row.line);
        }
        self.names = names;
        self.rows.drain(..start);
        Ok(())
    }

    /// The place of the first row of numbers, of which most have `usual` cells; that of a long table of responses begins with a
    /// name.
    fn first_row(&self, usual: usize) -> Read<usize> {
        let begins = |row: &Row| row.cells.get(0).is_some_and(|cell| self.is_number(cell));
        let is_long = |i: &usize| {
            let cells = &self.rows[*i].cells;
            let next_is_named =
                || self.rows.get(i + 1).is_some_and(|next| !begins(next) && !self.is_line_of_units(i + 1));
            cells.get(0).is_some_and(|c| c.eq_ignore_ascii_case("band"))
                && (cells.len() == 3 || cells.len() > 3 && next_is_named())
        };
        if let Some(header) = (0..self.rows.len()).find(is_long) {
            return Ok(header + 1);
        }
        let whole = |row: &Row| begins(row) && row.cells.len() == usual;
        self.rows.iter().position(whole).or_else(|| self.rows.iter().position(begins)).ok_or_else(|| {
            let row = &self.rows[self.rows.len().min(2) - 1];
            let cell = shown(row.cells.get(0).unwrap_or(""));
            let message = format!("`{cell}` is not a finite number, and no line begins with one");
            let is_empty =
                |row: &Row| row.cells.get(0) == Some("") && row.cells.iter().skip(1).any(|c| self.is_number(c));
            let help = match cell.contains(',') {
                _ if self.rows.iter().any(is_empty) => "remove the first column, which is empty where the numbers are",
                true => "write decimal points, and no commas within numbers",
                false => SPECTRA,
            };
            self.problem(Some(row.line), message, help)
        })
    }

    /// Names with a cell each, right before the row `start`; a line of units may stand between.
    fn header_of_cells(&self, start: usize, width: usize) -> Option<Header> {
        let head = self.rows[..start].iter().rposition(|row| row.cells.len() != width).map_or(0, |i| i + 1);
        if head == start {
            return None;
        }
        // Rows without a first number, or without any, are not those of the names.
        let end = (head + 1..start).rev().find(|row| !self.has_no_place(*row)).map_or(head + 1, |row| row + 1);
        let cells = |row: usize| self.rows[row].cells.iter().map(str::to_owned).collect::<Vec<_>>();
        let whole = |row: usize| self.rows[row].cells.iter().collect::<Vec<_>>().join(" ");
        let units = (head + 1..end).find(|&row| self.is_line_of_units(row) && !unit::states_a_factor(&whole(row - 1)));
        let mut units = units;
        let mut row = units.unwrap_or(end) - 1;
        // A line that says something of the table is none of names, and goes with those before it.
        if statement::is_no_header(&self.rows[row].cells.iter().collect::<Vec<_>>()) {
            row = units.take()?;
        }
        // What samples are called may stand below the line that names axis and values.
        let labels = row;
        if units.is_none() {
            row = self.row_of_axis(head, row);
        }
        let mut names = cells(row);
        let line = units.map_or(0, |units| self.rows[units].line);
        let mut notes = Vec::new();
        // Some write the units first.
        let before = row.checked_sub(1).filter(|before| {
            units.is_none()
                && *before >= head
                && self.is_nothing_but_units(*before)
                && Unit::stated(&names[0]) == Ok(None)
        });
        let units = units.or(before);
        for (name, unit) in names.iter_mut().zip(units.map(cells).unwrap_or_default()) {
            let bare = unit.trim_matches(['(', ')', '[', ']', ' ']);
            if !bare.chars().any(|c| c.is_alphanumeric() || matches!(c, '%' | '\u{2030}')) || *bare == *name {
                continue;
            }
            let joined = format!("{name} ({bare})");
            let is_bracketed = *bare != *unit;
            if is_bracketed || unit::parse(bare).is_some() || Stated::in_name(&joined).is_some() {
                *name = joined;
            } else {
                let bare = shown(bare);
                notes.push(format!("has a line of units, {line}, of which `{bare}` is not understood: it is left out"));
            }
        }
        for below in (row + 1..=labels).filter(|_| labels > row) {
            notes.extend(self.label(&mut names, below));
        }
        notes.extend((end..start).filter(|row| !self.has_no_number(*row)).map(|row| {
            format!("has a row without a number in its first column, line {}, which is left out", self.rows[row].line)
        }));
        Some(Header { names, row, first: before.unwrap_or(row), notes })
    }

    /// Whether every cell of a row can be nothing but a unit, the first that of a spectral axis.
    fn is_nothing_but_units(&self, row: usize) -> bool {
        let bare = |cell: &str| cell.trim_matches(['(', ')', '[', ']', ' ']).to_owned();
        let mut cells = self.rows[row].cells.iter().map(bare);
        cells.next().is_some_and(|cell| Unit::named(&cell).is_some()) && cells.all(|cell| unit::parse(&cell).is_some())
    }

    /// The unit of the first column where three lines, a title, the unit and `NK`, stand before n and k, as WVASE writes them.
    fn unit_over_optical_constants(&self, start: usize, width: usize) -> Option<String> {
        let row =
            |back: usize| Some(&self.rows[start.checked_sub(back)?].cells).filter(|cells| cells.len() == 1)?.get(0);
        let is_such = width == 3 && row(1)?.eq_ignore_ascii_case("nk");
        row(2).filter(|unit| is_such && Unit::named(unit).is_some()).map(str::to_owned)
    }

    /// Names between blanks, which hold blanks themselves, so that they seem to be more than there are columns.
    fn header_of_words(&self, start: usize, width: usize) -> Option<Header> {
        let row = start.checked_sub(1)?;
        let words: Vec<&str> = self.rows[row].cells.iter().collect();
        if statement::is_no_header(&words) {
            return None;
        }
        Some(Header { names: join_names(&words, width)?, row, first: row, notes: Vec::new() })
    }

    /// A line before the numbers that names columns, but not these.
    fn refuse_names_of_other_columns(&self, row: usize, width: usize) -> Read<()> {
        let row = &self.rows[row];
        let names_something = row.cells.len() > 1 || Unit::stated(row.cells.get(0).unwrap_or("")) != Ok(None);
        if !names_something {
            return Ok(());
        }
        // `Wavelength: nm` changes nothing.
        let cells: Vec<&str> = row.cells.iter().collect();
        if cells.len() == width && statement::is_no_header(&cells) && statement::is_of_axis(&cells) {
            return Ok(());
        }
        let message = match row.cells.len() {
            cells if cells == width => {
                format!("says `{}`, which names no columns", shown(&row.cells.iter().collect::<Vec<_>>().join(" ")))
            }
            cells => format!("has {cells} cells where the numbers below have {width}"),
        };
        let help = "give the header a name for every column, and begin lines about something else with `# `";
        Err(self.problem(Some(row.line), message, help))
    }

    /// Whether every cell of a row is empty or a unit, the first that of a spectral axis.
    fn is_line_of_units(&self, row: usize) -> bool {
        let bare = |cell: &str| cell.trim_matches(['(', ')', '[', ']', ' ']).to_owned();
        let mut cells = self.rows[row].cells.iter().map(bare);
        cells.next().is_some_and(|cell| Unit::named(&cell).is_some())
            && self.rows[row].cells.iter().skip(1).all(|cell| {
                let inner = bare(cell);
                inner.is_empty() || inner != cell || unit::parse(&inner).is_some() || inner.len() <= 6
            })
    }

    /// numpy.savetxt writes the names of columns as a comment right before the numbers.
    fn header_in_comment(
        &self,
        separator: Separator,
        width: usize,
        start: usize,
        comments: &[(usize, &str)],
    ) -> Option<(usize, Vec<String>)> {
        let first = self.rows.get(start)?.line;
        let (line, text) = comments.iter().rev().find(|(line, _)| *line < first)?;
        let text = text.trim_start_matches(['#', '%', '!', '/', ' ']);
        let row = records(&[(*line, text)], separator).pop()?;
        let words: Vec<&str> = row.cells.iter().collect();
        let names = if words.len() == width {
            words.iter().map(|word| (*word).to_owned()).collect()
        } else if separator == Separator::Space {
            join_names(&words, width)?
        } else {
            return None;
        };
        if statement::is_no_header(&names.iter().map(String::as_str).collect::<Vec<_>>()) {
            return None;
        }
        let is_axis = |name: &str| {
            let lower = name.to_lowercase();
            ["wave", "wl", "lambda", "\u{3bb}", "lam", "freq", "energy"].iter().any(|word| lower.starts_with(word))
        };
        let says_something = Unit::stated(&names[0]) != Ok(None) || is_axis(&names[0]);
        says_something.then_some((*line, names))
    }
}

/// Names that hold blanks, where columns are separated by blanks: those in brackets belong to the word before, and of two
/// columns the first is the first word or what is up to the bracket.
fn join_names(words: &[&str], width: usize) -> Option<Vec<String>> {
    let mut names: Vec<String> = Vec::new();
    let mut depth = 0i32;
    for word in words {
        let opens = word.matches(['(', '[']).count() as i32 - word.matches([')', ']']).count() as i32;
        match names.last_mut() {
            Some(last) if depth > 0 || word.starts_with(['(', '[']) => {
                last.push(' ');
                last.push_str(word);
            }
            _ => names.push((*word).to_owned()),
        }
        depth += opens;
    }
    (names.len() == width).then_some(names)
}
