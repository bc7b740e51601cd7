//! Rows between the names of columns and the first row of numbers.

use super::super::unit::{self, Stated, Unit, bracketed_in};
use super::statement;
use super::{Read, Table, shown};

impl Table<'_> {
    /// Whether a cell says nothing: that there is no number, or lines of print.
    fn is_blank(&self, cell: &str) -> bool {
        self.is_missing(cell) || cell.eq_ignore_ascii_case("nan") || !cell.chars().any(char::is_alphanumeric)
    }

    /// Whether no cell of a row says anything.
    pub(super) fn has_no_number(&self, row: usize) -> bool {
        self.rows[row].cells.iter().all(|cell| self.is_blank(cell))
    }

    /// Whether a row is none of names: its first cell says nothing, and the others nothing or numbers.
    pub(super) fn has_no_place(&self, row: usize) -> bool {
        let cells = &self.rows[row].cells;
        let is_plain = |cell: &str| self.is_blank(cell) || self.is_number(cell);
        // Of pandas' kind, `,300,400`, the first line may be one of names.
        let is_said =
            cells.get(0).is_some_and(|first| !first.is_empty()) || cells.iter().all(|cell| self.is_blank(cell));
        is_said && cells.get(0).is_some_and(|first| self.is_blank(first)) && cells.iter().all(is_plain)
    }

    /// Of the rows from `head` to `row` that with the name of an axis in its first cell, where `row` has none; `row` if no other has.
    pub(super) fn row_of_axis(&self, head: usize, row: usize) -> usize {
        let is_one = |row: &usize| {
            let cells: Vec<&str> = self.rows[*row].cells.iter().collect();
            let is_value = |cell: &&str| cell.starts_with(|c: char| c.is_ascii_digit());
            (unit::is_axis(cells[0]) || matches!(Unit::stated(cells[0]), Ok(Some(_))))
                && !statement::is_no_header(&cells)
                && !cells[1..].iter().any(|cell| is_value(cell) || cell.is_empty())
        };
        if is_one(&row) { row } else { (head..row).rev().find(is_one).unwrap_or(row) }
    }

    /// Puts what a line below the names calls the columns in their place, with the units of the names; of a table of one column, says
    /// that it is left out.
    pub(super) fn label(&self, names: &mut [String], row: usize) -> Option<String> {
        let cells = &self.rows[row].cells;
        if self.has_no_number(row) {
            return None;
        }
        if names.len() == 2 {
            let text = cells.iter().collect::<Vec<_>>().join(" ");
            return Some(format!(
                "line {} below its header is left out: `{}`",
                self.rows[row].line,
                shown(text.trim())
            ));
        }
        for (name, label) in names.iter_mut().zip(cells).skip(1).filter(|(_, label)| !self.is_blank(label)) {
            let unit = bracketed_in(name).or_else(|| Stated::in_name(name).map(|_| name.clone()));
            *name = unit.map_or(label.to_owned(), |unit| format!("{label} ({unit})"));
        }
        None
    }

    /// Rows of numbers before the first that could be read, whose first cells have commas or apostrophes between thousands.
    pub(super) fn refuse_grouped_digits(&self, start: usize, width: usize) -> Read<()> {
        let is_grouped = |cell: &str| {
            let mut groups = cell.split([',', '\'', '\u{2019}', '\u{a0}', '\u{202f}', ' ']);
            let first = groups.next().unwrap_or("");
            let mut rest = groups.map(|group| group.split('.').next().unwrap_or("")).peekable();
            (1..=3).contains(&first.len())
                && first.bytes().all(|c| c.is_ascii_digit())
                && rest.peek().is_some()
                && rest.all(|group| group.len() == 3 && group.bytes().all(|c| c.is_ascii_digit()))
        };
        let found = self.rows[..start].iter().find(|row| {
            row.cells.len() == width
                && row.cells.get(0).is_some_and(is_grouped)
                && row.cells.iter().skip(1).any(|cell| self.is_number(cell))
        });
        let Some(row) = found else { return Ok(()) };
        let message = format!("`{}` is not a finite number", shown(row.cells.get(0).unwrap_or("")));
        Err(self.problem(Some(row.line), message, "write decimal points, and nothing between thousands"))
    }
}
