//! Which columns of a table are wavelengths: that of its axis, behind row numbers too, those that other columns have of their own, and
//! the two ends of intervals.

use super::table::{self, Table};
use super::unit::{self, Unit};
use crate::error::Problem;

type Read<T> = Result<T, Box<Problem>>;

/// Rows that are looked at to tell what a column is.
const LOOKED_AT: usize = 200;

/// What the ends of an interval are called, in small letters.
const ENDS: [[&str; 2]; 17] = [
    ["from", "to"],
    ["start", "end"],
    ["start", "stop"],
    ["begin", "end"],
    ["beginning", "end"],
    ["lower", "upper"],
    ["min", "max"],
    ["minimum", "maximum"],
    ["lo", "hi"],
    ["low", "high"],
    ["left", "right"],
    ["first", "last"],
    ["von", "bis"],
    ["de", "a"],
    ["da", "a"],
    ["1", "2"],
    ["0", "1"],
];

fn name<'t>(table: &'t Table, column: usize) -> &'t str {
    table.names.get(column).map_or("", String::as_str)
}

/// The first numbers of a column; `None` where a cell has none.
fn numbers(table: &Table, column: usize) -> Option<Vec<f64>> {
    table.rows.iter().take(LOOKED_AT).map(|row| table.number(row, column).ok().flatten()).collect()
}

/// Whether a column is called as that of row numbers is.
fn is_row_number(name: &str) -> bool {
    ["", "index", "unnamed: 0", "no", "nr", "row"].contains(&name.to_lowercase().as_str())
}

/// Whether numbers go up by one from a whole number on.
fn counts(numbers: &[f64]) -> bool {
    numbers.first().is_some_and(|first| *first >= 0.0 && first.fract() == 0.0)
        && numbers.windows(2).all(|pair| pair[1] - pair[0] == 1.0)
}

/// Whether the name of a column says that it is a spectral axis.
fn says_axis(name: &str) -> bool {
    unit::is_axis(name) || matches!(Unit::stated(name), Ok(Some(_)))
}

/// The column of wavelengths: the first, unless that has the numbers of rows and the second is called as an axis is.
/// `is_known` says whether the unit of the axis is given elsewhere.
pub fn axis(table: &Table, is_known: bool) -> Read<usize> {
    let first = name(table, 0);
    if says_axis(first) {
        return Ok(0);
    }
    let second_says = || !matches!(Unit::stated(name(table, 1)), Ok(None)) || unit::is_axis(name(table, 1));
    if table.columns() > 2 && is_row_number(first) && second_says() {
        return Ok(1);
    }
    let later = (1..table.columns()).filter(|_| table.columns() > 2).find(|column| unit::is_axis(name(table, *column)));
    let counted = numbers(table, 0).filter(|numbers| counts(numbers));
    let Some(later) = later else {
        let from_start = counted.filter(|numbers| numbers.len() > 2 && numbers[0] <= 1.0);
        return match from_start {
            Some(numbers) if !is_known && Unit::stated(first) == Ok(None) => {
                let message = format!(
                    "has {}, {}, {} … in its first column, which are numbers of rows and no wavelengths",
                    numbers[0], numbers[1], numbers[2]
                );
                let help =
                    "remove that column, or, if they are wavelengths, name them with their unit: `wavelength (um)`";
                Err(table.problem(Some(table.line), message, help))
            }
            _ => Ok(0),
        };
    };
    if counted.is_some() && later == 1 {
        return Ok(1);
    }
    let units = [0, later].map(|column| Unit::stated(name(table, column)).map(|unit| unit.unwrap_or(Unit::NANOMETRE)));
    if let ([Ok(first), Ok(other)], Some(here), Some(there)) = (units, numbers(table, 0), numbers(table, later))
        && here.iter().zip(there).all(|(here, there)| {
            let [here, there] = [first.to_nm(*here), other.to_nm(there)];
            (here - there).abs() <= 1e-3 * here.abs()
        })
    {
        return Ok(0);
    }
    let message = format!(
        "has wavelengths in column {}, `{}`, and its first column, `{}`, is none of them",
        later + 1,
        table::shown(name(table, later)),
        table::shown(first)
    );
    Err(table.problem(Some(table.line), message, "put the column of wavelengths first"))
}

/// What to say of a table whose axis is not its first column.
pub fn numbered_words(table: &Table, axis: usize) -> String {
    let axis = table::shown(name(table, axis));
    format!("begins with a column of row numbers, which is left out: wavelengths are those of `{axis}`")
}

/// Refuses a table whose columns from `column` on are the two ends of intervals, by their names or their numbers.
pub fn check_intervals(table: &Table, column: usize) -> Read<()> {
    if column + 2 >= table.columns() || !(are_called_ends(table, column) || are_ends(table, column)) {
        return Ok(());
    }
    let [from, to] = [column, column + 1].map(|column| match name(table, column) {
        "" => format!("column {}", column + 1),
        name => format!("`{}`", table::shown(name)),
    });
    let message = format!("gives values of intervals, from {from} to {to}");
    let help = "write the value at each end: two lines of one wavelength make a step";
    Err(table.problem(Some(table.line), message, help))
}

/// Whether the names of two neighbours differ by what the ends of an interval are called: `wl_min,wl_max`.
fn are_called_ends(table: &Table, column: usize) -> bool {
    let words = |column: usize| -> Vec<String> {
        let lower = name(table, column).to_lowercase();
        let mut words: Vec<String> = Vec::new();
        // Numbers are words of their own: `lambda1`.
        let mut before = ' ';
        for c in lower.chars() {
            if c.is_alphanumeric() {
                match words.last_mut() {
                    Some(word) if before.is_alphanumeric() && c.is_ascii_digit() == before.is_ascii_digit() => {
                        word.push(c)
                    }
                    _ => words.push(c.to_string()),
                }
            }
            before = c;
        }
        words
    };
    let (from, to) = (words(column), words(column + 1));
    let pair_of = |from: &str, to: &str| ENDS.iter().find(|[a, b]| (*a, *b) == (from, to));
    let different: Vec<usize> = (0..from.len().min(to.len())).filter(|i| from[*i] != to[*i]).collect();
    let by_one = match different[..] {
        [i] if from.len() == to.len() => pair_of(&from[i], &to[i]),
        _ => None,
    };
    let by_first = || from.first().zip(to.first()).and_then(|(from, to)| pair_of(from, to));
    match by_one.or_else(by_first) {
        // Of columns that are numbered, or called `de` and `a`, the numbers must speak too.
        Some([from, _]) if from.len() < 3 && *from != "lo" => {
            let ends = numbers(table, column).zip(numbers(table, column + 1));
            ends.is_some_and(|(from, to)| from.iter().zip(&to).all(|(from, to)| from < to && *to <= 2.0 * from))
        }
        found => found.is_some(),
    }
}

/// Whether each number of the column after this one is this column's in the next row.
fn are_ends(table: &Table, column: usize) -> bool {
    let Some((from, to)) = numbers(table, column).zip(numbers(table, column + 1)) else { return false };
    let follows = |from: &[f64], to: &[f64]| from.iter().skip(1).zip(to).all(|(next, end)| next == end);
    let rises = from.iter().zip(&to).all(|(from, to)| from < to);
    let falls = from.iter().zip(&to).all(|(from, to)| from > to);
    from.len() > 2 && ((rises && (follows(&from, &to) || follows(&to, &from))) || (falls && follows(&from, &to)))
}

/// The columns of wavelengths behind the axis that the columns after them have of their own: those that are called as an axis is, or
/// have the numbers of one where they have no name.
pub fn own_axes(table: &Table, axis: usize) -> Vec<usize> {
    if table.names.is_empty() {
        let places = (axis + 2..table.columns()).step_by(2);
        let is_paired = (table.columns() - axis).is_multiple_of(2) && table.columns() > axis + 2;
        let of_axis = numbers(table, axis).filter(|_| is_paired);
        let all = of_axis.is_some_and(|of_axis| places.clone().all(|column| are_places(table, column, &of_axis)));
        return if all { places.collect() } else { Vec::new() };
    }
    let first = name(table, axis);
    let of_axis = numbers(table, axis);
    let (mut has_values, mut has_other_stem) = (false, false);
    let mut found = Vec::new();
    for column in axis + 1..table.columns() {
        let here = name(table, column);
        let is_axis = unit::is_axis(here);
        let has_stem = has_other_stem && !stem(here).is_empty() && stem(here) == stem(first);
        let has_places =
            || here.is_empty() && of_axis.as_ref().is_some_and(|of_axis| are_places(table, column, of_axis));
        // Right after the first axis another one is of the same places.
        if (!here.is_empty() && here == first) || (has_values && (is_axis || has_stem || has_places())) {
            found.push(column);
        }
        has_values |= !is_axis;
        has_other_stem |= stem(here) != stem(first);
    }
    found
}

/// A name without the number behind it: that of `x2` and of `x.1` is x.
fn stem(name: &str) -> &str {
    name.trim_end_matches(|c: char| c.is_ascii_digit() || matches!(c, '.' | '_' | ' ' | '-'))
}

/// Whether a column ascends or descends over places like those of the axis.
fn are_places(table: &Table, column: usize, of_axis: &[f64]) -> bool {
    let ends = |numbers: &[f64]| numbers.iter().fold([f64::INFINITY, 0.0f64], |[a, b], x| [a.min(*x), b.max(*x)]);
    let [shortest, longest] = ends(of_axis);
    numbers(table, column).is_some_and(|numbers| {
        let [first, last] = ends(&numbers);
        let rises = numbers.windows(2).all(|pair| pair[0] < pair[1]);
        let falls = numbers.windows(2).all(|pair| pair[0] > pair[1]);
        numbers.len() > 2 && (rises || falls) && first >= shortest / 5.0 && last <= 5.0 * longest
    })
}

/// The line of the first row in which the wavelengths of `other` are not those of the axis, whose unit is `unit`.
pub fn differs(table: &Table, axis: usize, unit: Unit, other: usize) -> Read<Option<usize>> {
    let of_other = Unit::stated(name(table, other)).ok().flatten().unwrap_or(unit);
    for row in &table.rows {
        let is_same = match (table.number(row, other)?, table.number(row, axis)?) {
            (Some(here), Some(first)) => {
                let (here, first) = (of_other.to_nm(here), unit.to_nm(first));
                (here - first).abs() <= 1e-9 * first
            }
            (here, first) => here == first,
        };
        if !is_same {
            return Ok(Some(row.line));
        }
    }
    Ok(None)
}
