//! What stands around the rows of a table: lines before its header, and comments.

use super::super::said::Said;
use super::super::unit::{self, FACTORS, Stated, Unit};
use super::statement::{self, Statement};
use super::{Read, Separator, Table, records, shown};

impl Table<'_> {
    /// Lines before the header are about something else; one that says what would change the numbers, and that no name of a column
    /// says too, is not left out in silence.
    pub(super) fn look_at_preamble(&mut self, end: usize, names: &[String]) -> Read<()> {
        for row in &self.rows[..end] {
            let cells: Vec<&str> = row.cells.iter().collect();
            let whole = cells.join(" ");
            let key = whole.split([':', '=']).next().unwrap_or("").to_lowercase();
            let has_value =
                row.cells.iter().flat_map(|cell| cell.split([':', '=', ' '])).any(|word| self.is_number(word));
            let scales = FACTORS.iter().chain(["offset"].iter()).any(|word| key.contains(word));
            let of_units =
                key.contains("unit") && (Unit::stated(&whole) != Ok(None) || unit::speaks_of_percent(&whole));
            let mut is_wrong = (scales && has_value) || of_units || unit::states_a_factor(&whole);
            for statement in statement::of(&cells) {
                match statement {
                    Statement::Of(said) if said != Said::Counts => {
                        self.said.get_or_insert((said, whole.clone()));
                    }
                    other => is_wrong |= !is_said_by(&other, names),
                }
            }
            if is_wrong {
                let message = format!("says `{}`, which is not applied", shown(&whole));
                let help = "apply it, put units into the header (`wavelength (um)`), and begin the line with `# `";
                return Err(self.problem(Some(row.line), message, help));
            }
        }
        if let [first, ..] = &self.rows[..end] {
            let last = self.rows[end - 1].line;
            let lines = if first.line == last {
                format!("line {last} before the table is")
            } else {
                format!("lines {} to {last} before the table are", first.line)
            };
            self.notes
                .push(format!("{lines} left out: `{}`", shown(&first.cells.iter().collect::<Vec<_>>().join(" "))));
        }
        Ok(())
    }

    /// Lines of a long table whose band begins with the mark of a comment, `#1,400,0.5`: they are none of its rows.
    pub(super) fn warn_of_rows_in_comments(
        &mut self,
        separator: Separator,
        names: &[String],
        comments: &[(usize, &str)],
    ) {
        let is_long = names.first().is_some_and(|name| name.eq_ignore_ascii_case("band"));
        let is_row = |(line, text): &&(usize, &str)| {
            let is_name = text.chars().nth(1).is_some_and(char::is_alphanumeric);
            let rows = records(&[(*line, text)], separator);
            is_name
                && rows.first().is_some_and(|row| {
                    row.cells.len() == names.len() && row.cells.iter().skip(1).all(|cell| self.is_number(cell))
                })
        };
        let found: Vec<usize> = comments.iter().filter(|_| is_long).filter(is_row).map(|(line, _)| *line).collect();
        if let [first, ..] = found[..] {
            self.notes.push(format!(
                "has {} lines that look like rows, the first of them {first}, and begin as comments do: they are left out (give \
                 the band a name that does not begin so)",
                found.len()
            ));
        }
    }

    /// The unit of spectral power in the comments, as those of libRadtran's solar spectra have it, if it is the same in all that
    /// speak of one.
    pub(super) fn unit_of_comments(&self, start: usize, comments: &[(usize, &str)]) -> Option<(usize, Stated)> {
        let first = self.rows.get(start).map_or(usize::MAX, |row| row.line);
        let before = comments.iter().filter(|(line, _)| *line < first);
        let mut found = before.filter_map(|(line, text)| Some((*line, Stated::in_sentence(text)?)));
        let one = found.next()?;
        found.all(|(_, other)| other.meaning == one.1.meaning).then_some(one)
    }

    /// Comments that say what would change the numbers, and that no name of a column says.
    pub(super) fn warn_of_statements_in_comments(
        &mut self,
        names: &[String],
        start: usize,
        comments: &[(usize, &str)],
    ) {
        let first = self.rows.get(start).map_or(usize::MAX, |row| row.line);
        let axis_is_said = names.first().is_some_and(|name| Unit::stated(name) != Ok(None));
        let mut seen: Vec<Statement> = Vec::new();
        for (line, text) in
            comments.iter().filter(|(line, _)| *line < first && (names.is_empty() || *line != self.line))
        {
            let mut found = statement::of(&[text]);
            let lower = text.to_lowercase();
            let about_axis =
                ["wave", "lambda", "first column", "column 1", "wl"].iter().any(|word| lower.contains(word));
            if about_axis
                && let Ok(Some(unit)) = Unit::stated(unit::without_mark(text))
                && unit != Unit::NANOMETRE
            {
                found.push(Statement::Axis(unit));
            }
            for statement in found {
                let is_said = match statement {
                    Statement::Axis(_) | Statement::OtherAxis => axis_is_said,
                    // What is said of a unit of power or of percent is applied, or told of, by column.
                    Statement::Percent => true,
                    Statement::Logarithm => is_said_by(&statement, names),
                    Statement::Of(said) => {
                        self.said.get_or_insert((said, (*text).to_owned()));
                        true
                    }
                };
                let kind = std::mem::discriminant(&statement);
                if is_said || seen.iter().any(|other| std::mem::discriminant(other) == kind) {
                    continue;
                }
                let what = match statement {
                    Statement::Axis(_) | Statement::OtherAxis => {
                        "but no header says a unit: its wavelengths are taken as nm (say `unit = …` in the scene)"
                    }
                    _ => "which is not applied: its values are taken as they are (write the values themselves)",
                };
                self.notes.push(format!("has the comment `{}` on line {line}, {what}", shown(text)));
                seen.push(statement);
            }
            if let Some(unit) = unit::of_matter_within(text)
                && !names.iter().skip(1).any(|name| Stated::in_name(name).is_some())
            {
                self.notes.push(format!(
                    "has the comment `{}` on line {line}, but no header says that its values are in `{unit}`: they are taken as they \
                     are",
                    shown(text)
                ));
            }
        }
    }

    /// The first comment that states a factor of the values, and the first that says that the wavelengths are those in air, where
    /// the header does not.
    pub(super) fn warn_of_factors_in_comments(&mut self, names: &[String], comments: &[(usize, &str)]) {
        let is_header = |line: usize| !names.is_empty() && line == self.line;
        let others = || comments.iter().filter(|(line, _)| !is_header(*line));
        let told = |(line, text): &(usize, &str)| format!("has the comment `{}` on line {line}", shown(text));
        let factor = others().find(|(_, text)| unit::states_a_factor(text)).map(|comment| {
            format!("{}, which is not applied (write the values so, or say `scale = …` in the scene)", told(comment))
        });
        let header_says = names.iter().any(|name| unit::is_in_air(name));
        let air = others().find(|(_, text)| !header_says && unit::speaks_of_air(text)).map(|comment| {
            let instead = "are taken as those in vacuum (name the column e.g. `wavelength in air (nm)`)";
            format!("{}, which is not applied: its wavelengths {instead}", told(comment))
        });
        self.notes.extend(factor.into_iter().chain(air));
    }

    /// Refuses comments that say another unit of length than the metre, for tables of places.
    pub fn check_metres(&self) -> Read<()> {
        for (line, text) in &self.comments {
            let other = |statement: &Statement| matches!(statement, Statement::Axis(unit) if *unit != Unit::METRE);
            if statement::of(&[text]).iter().any(other) {
                let message = format!("says `{}`, which is not applied: places are in metres", shown(text));
                return Err(self.problem(Some(*line), message, "write them in metres, and remove the comment"));
            }
        }
        Ok(())
    }
}

/// Whether the names of columns say the same as a statement.
fn is_said_by(statement: &Statement, names: &[String]) -> bool {
    let values = || names.iter().skip(1).filter_map(|name| Stated::in_name(name));
    match statement {
        Statement::Axis(unit) => names.first().is_some_and(|name| Unit::stated(name) == Ok(Some(*unit))),
        Statement::OtherAxis => false,
        Statement::Percent => values().any(|stated| stated.is_percent()),
        // A column that says a unit is no logarithm, whatever the others are.
        Statement::Logarithm => values().next().is_some(),
        Statement::Of(said) => names.iter().skip(1).any(|name| Said::in_name(name) == Some(*said)),
    }
}
