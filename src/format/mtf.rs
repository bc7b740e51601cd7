//! Measured transfer functions of modulation (ISO 15529, ISO 12233): cycles a millimetre on the detector, and the share of a sine
//! wave's contrast that is left.

use std::path::Path;

use super::table;
use super::text;
use crate::error::Problem;

type Read<T> = Result<T, Box<Problem>>;

/// Values are in `[0, 1]`, the first 1 at 0; linear between.
#[derive(Debug, Clone, PartialEq)]
pub struct MtfTable {
    /// Ascending from 0, cycles/mm.
    pub cycles_per_mm: Vec<f64>,
    pub values: Vec<f64>,
}

/// Reads the file at `path`: a header, then rows of two columns, cycles/mm and MTF; one without a row at 0 begins with 1 there.
///
/// # Errors
/// By line: what is no such table; frequencies that do not ascend from 0; values outside of 0 to 1, or another than 1 at 0.
pub fn read(path: &Path) -> Read<MtfTable> {
    parse(&text::read(path)?, path)
}

/// [`read`] on the content of a file.
///
/// # Errors
/// As [`read`].
pub fn parse(bytes: &[u8], path: &Path) -> Read<MtfTable> {
    const HELP: &str = "write `cycles_per_mm,mtf`, then a row for each frequency, ascending";
    let table = table::read(bytes, path)?;
    if table.columns() != 2 {
        return Err(table.problem(Some(table.line), format!("has {} columns, not 2", table.columns()), HELP));
    }
    // Cycles per pixel, per degree or per metre would be other numbers.
    let says = |name: &String| name.to_lowercase().replace([' ', '_', '(', ')', '[', ']'], "");
    let is_known = |name: String| ["cyclespermm", "cycles/mm", "cy/mm", "cymm-1", "lp/mm", "lppermm"].contains(&&*name);
    match table.names.first().map(says) {
        Some(name) if is_known(name.clone()) => {}
        Some(name) if ["cycles/mm", "cy/mm", "lp/mm"].iter().any(|unit| name.ends_with(unit)) => {}
        Some(_) => {
            let message = format!("has a column `{}`, which does not say cycles/mm", table::shown(&table.names[0]));
            return Err(table.problem(Some(table.line), message, HELP));
        }
        None => return Err(table.problem(Some(table.line), "has no header".to_owned(), HELP)),
    }
    let (mut cycles_per_mm, mut values) = (Vec::new(), Vec::new());
    for row in &table.rows {
        table.check_row(row)?;
        let cell = |column: usize| table.filled(row, column);
        let (frequency, value) = (cell(0)?, cell(1)?);
        if table.is_percent(row, 1) || !(0.0..=1.0).contains(&value) {
            let message = format!("an MTF is from 0 to 1, but is {} here", row.cells.get(1).unwrap_or_default());
            return Err(table.problem(Some(row.line), message, "write shares, not percent"));
        }
        if cycles_per_mm.last().map_or(frequency < 0.0, |last| frequency <= *last) {
            let message = format!("frequencies ascend from 0, but {frequency} cycles/mm stands here");
            return Err(table.problem(Some(row.line), message, "sort the rows"));
        }
        if frequency == 0.0 && value != 1.0 {
            let message = format!("the MTF at 0 cycles/mm is 1, not {value}: what optics lose is `transmittance`");
            return Err(table.problem(Some(row.line), message, "divide all values by the first"));
        }
        if cycles_per_mm.is_empty() && frequency > 0.0 {
            cycles_per_mm.push(0.0);
            values.push(1.0);
        }
        cycles_per_mm.push(frequency);
        values.push(value);
    }
    if cycles_per_mm.len() < 2 {
        return Err(table.problem(None, "holds no frequency above 0".to_owned(), HELP));
    }
    Ok(MtfTable { cycles_per_mm, values })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<MtfTable, String> {
        parse(text.as_bytes(), Path::new("m.csv")).map_err(|problem| format!("{:?} {}", problem.line, problem.message))
    }

    #[test]
    fn tables_begin_at_one() {
        let table = parsed("cycles_per_mm,mtf\n10,0.8\n20,0.5\n").expect("a table");
        assert_eq!((table.cycles_per_mm, table.values), (vec![0.0, 10.0, 20.0], vec![1.0, 0.8, 0.5]));
        assert!(parsed("frequency (lp/mm);MTF\n0;1\n50;0,25\n").is_ok());
    }

    #[test]
    fn others_are_refused_by_line() {
        for (text, words) in [
            ("cycles_per_mm,mtf\n0,1\n10,80\n", "Some(3) an MTF is from 0 to 1"),
            ("cycles_per_mm,mtf\n0,1\n20,0.5\n10,0.8\n", "Some(4) frequencies ascend"),
            ("cycles_per_mm,mtf\n0,0.9\n20,0.5\n", "is 1, not 0.9"),
            ("cycles_per_pixel,mtf\n0,1\n0.5,0.5\n", "does not say cycles/mm"),
            ("cycles_per_mm,mtf,x\n0,1,1\n", "3 columns"),
            ("cycles_per_mm,mtf\n0,1\n", "no frequency above 0"),
        ] {
            let error = parsed(text).expect_err(text);
            assert!(error.contains(words), "{text}: {error}");
        }
    }
}
