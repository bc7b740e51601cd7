//! Phase functions in files: degrees from 0 to 180, then one column for each wavelength.

use std::f64::consts::PI;
use std::path::Path;

use super::table::{self, Table};
use super::text;
use super::unit::{Meaning, Stated, Unit};
use crate::error::Problem;

type Read<T> = Result<T, Box<Problem>>;

/// A phase function by angle and wavelength: linear in degrees between rows, linear in nm between columns, each column with a
/// mean of 1 over the sphere.
#[derive(Debug, Clone, PartialEq)]
pub struct PhaseTable {
    /// From 0 to 180, ascending.
    pub degrees: Vec<f64>,
    /// Ascending; one alone holds at all wavelengths.
    pub nm: Vec<f64>,
    /// \[column\]\[row\], not negative.
    pub values: Vec<Vec<f64>>,
}

/// A table as it was read, and by what each column was divided.
pub struct Normalised {
    pub table: PhaseTable,
    /// The mean over the sphere that a column had in the file.
    pub means: Vec<f64>,
}

/// Reads the file at `path`: a header whose first cell is that of the angles and whose others are wavelengths (nm, or with a unit:
/// `550`, `550 nm`, `0.55 um`), then a row for each angle.
///
/// # Errors
/// By line: what is no table; angles that do not ascend from 0 to 180; values that are missing, negative or not finite; columns that
/// are 0; wavelengths that are none, or the same.
pub fn read(path: &Path) -> Read<Normalised> {
    parse(&text::read(path)?, path)
}

/// [`read`] on the content of a file.
///
/// # Errors
/// As [`read`].
pub fn parse(bytes: &[u8], path: &Path) -> Read<Normalised> {
    let table = table::read(bytes, path)?;
    let nm = wavelengths(&table)?;
    let factor = angle_unit(&table)?;
    let (mut degrees, mut values) = (Vec::new(), vec![Vec::new(); nm.len()]);
    for row in &table.rows {
        table.check_row(row)?;
        let cell = |column: usize| {
            let missing =
                || table.problem(Some(row.line), "has no value in one of its columns".to_owned(), "fill the gap");
            table.number(row, column)?.ok_or_else(missing)
        };
        let angle = cell(0)? * factor;
        if degrees.last().is_some_and(|last| angle <= *last) {
            let message = format!("the angles must ascend, but {angle} degrees follow {}", degrees[degrees.len() - 1]);
            return Err(table.problem(Some(row.line), message, "sort the rows"));
        }
        degrees.push(angle);
        for (column, values) in values.iter_mut().enumerate() {
            let value = cell(column + 1)?;
            if value < 0.0 {
                let message = format!("a phase function is not negative, but is {value} at {angle} degrees");
                return Err(table.problem(Some(row.line), message, "correct the table"));
            }
            values.push(value);
        }
    }
    check_ends(&table, &mut degrees)?;
    let mut columns: Vec<(f64, Vec<f64>, f64)> = Vec::new();
    for (nm, mut column) in nm.into_iter().zip(values) {
        let mean = mean_over_sphere(&degrees, &column);
        if !(mean > 0.0 && mean.is_finite()) {
            let message = format!("the phase function at {nm} nm scatters nothing: its mean over the sphere is {mean}");
            return Err(table.problem(None, message, "remove the column, or correct it"));
        }
        column.iter_mut().for_each(|value| *value /= mean);
        columns.push((nm, column, mean));
    }
    columns.sort_by(|a, b| a.0.total_cmp(&b.0));
    if let Some(same) = columns.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        return Err(table.problem(None, format!("has two columns for {} nm", same[0].0), "remove one"));
    }
    let means = columns.iter().map(|column| column.2).collect();
    let (nm, values) = columns.into_iter().map(|(nm, values, _)| (nm, values)).unzip();
    Ok(Normalised { table: PhaseTable { degrees, nm, values }, means })
}

/// The wavelengths that the columns are named by.
fn wavelengths(table: &Table) -> Read<Vec<f64>> {
    let help = "write a header such as degrees,450,550,700: an angle, then wavelengths in nm";
    if table.names.len() < 2 {
        let message = "has no header that names its columns by wavelengths".to_owned();
        return Err(table.problem(None, message, help));
    }
    let one = |name: &String| {
        let digits = name.find(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | 'e' | 'E' | '+' | '-' | ' ')));
        let (number, unit) = name.split_at(digits.unwrap_or(name.len()));
        let number: Option<f64> = number.trim().parse().ok();
        let unit = if unit.trim().is_empty() { Some(Unit::NANOMETRE) } else { Unit::named(unit.trim()) };
        let nm = number.zip(unit).map(|(number, unit)| unit.to_nm(number));
        nm.filter(|nm| *nm > 0.0 && nm.is_finite()).ok_or_else(|| {
            let message = format!("the columns must be named by wavelengths, but one is \"{}\"", table::shown(name));
            table.problem(Some(table.line), message, help)
        })
    };
    table.names[1..].iter().map(one).collect()
}

/// Degrees in the unit of the first column.
fn angle_unit(table: &Table) -> Read<f64> {
    let name = table.names[0].to_lowercase();
    let words = |all: &[&str]| name.split(|c: char| !c.is_alphabetic()).any(|word| all.contains(&word));
    if words(&["rad", "radian", "radians"]) {
        return Ok(180.0 / PI);
    }
    if words(&["cos", "mu", "cosine"]) || name.contains('µ') || name.contains('μ') {
        let message = format!("gives cosines (`{}`), not angles", table.names[0]);
        return Err(table.problem(Some(table.line), message, "write degrees from 0 to 180"));
    }
    if let Some(Stated { meaning: Meaning::Unknown | Meaning::Factor, text, .. }) = Stated::in_name(&table.names[0])
        && !words(&["deg", "degree", "degrees", "angle", "theta"])
    {
        let message = format!("the unit of its angles, `{text}`, is not known");
        return Err(table.problem(Some(table.line), message, "write degrees from 0 to 180"));
    }
    Ok(1.0)
}

/// Refuses tables that do not run from 0 to 180; ends that miss them by rounding are these.
fn check_ends(table: &Table, degrees: &mut [f64]) -> Read<()> {
    let (first, last) = (degrees.first().copied(), degrees.last().copied());
    match (first, last) {
        (Some(first), Some(last)) if first.abs() < 1e-4 && (last - 180.0).abs() < 1e-4 => {
            let end = degrees.len() - 1;
            (degrees[0], degrees[end]) = (0.0, 180.0);
            Ok(())
        }
        _ => {
            let range = |end: Option<f64>| end.map_or("nothing".to_owned(), |end| end.to_string());
            let message =
                format!("the angles must run from 0 to 180 degrees, but run from {} to {}", range(first), range(last));
            Err(table.problem(None, message, "add what is missing"))
        }
    }
}

/// ½ ∫ P sinθ dθ of a function that is linear in θ between `degrees`, exactly: with P = a + b (θ - θ₀), ∫ P sinθ dθ =
/// P₀ cosθ₀ - P₁ cosθ₁ + b (sinθ₁ - sinθ₀).
fn mean_over_sphere(degrees: &[f64], values: &[f64]) -> f64 {
    let interval = |i: usize| {
        let [from, to] = [degrees[i], degrees[i + 1]].map(f64::to_radians);
        // cosθ₀ - cosθ₁ and sinθ₁ - sinθ₀ by products, since neighbours may be close.
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        let (cosines, sines) = (2.0 * middle.sin() * half.sin(), 2.0 * middle.cos() * half.sin());
        let slope = (values[i + 1] - values[i]) / (to - from);
        // P₀ (cosθ₀ - cosθ₁) - (P₁ - P₀) cosθ₁ + b (sinθ₁ - sinθ₀)
        values[i] * cosines - (values[i + 1] - values[i]) * to.cos() + slope * sines
    };
    0.5 * (0..degrees.len().saturating_sub(1)).map(interval).sum::<f64>()
}

impl PhaseTable {
    /// At an angle in degrees and a wavelength in nm; the outermost columns hold beyond them.
    pub fn value(&self, degrees: f64, nm: f64) -> f64 {
        let (row, along) = place(&self.degrees, degrees);
        let (column, across) = place(&self.nm, nm);
        let at = |column: usize| {
            let values = &self.values[column];
            values[row] + along * (values[(row + 1).min(values.len() - 1)] - values[row])
        };
        at(column) + across * (at((column + 1).min(self.nm.len() - 1)) - at(column))
    }
}

/// The interval of ascending `nodes` that holds `x`, and the place within; the ends hold.
fn place(nodes: &[f64], x: f64) -> (usize, f64) {
    let low = nodes.partition_point(|node| *node <= x).clamp(1, nodes.len().max(2) - 1) - 1;
    match nodes.get(low + 1) {
        Some(high) => (low, ((x - nodes[low]) / (high - nodes[low])).clamp(0.0, 1.0)),
        None => (0, 0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> Read<Normalised> {
        parse(text.as_bytes(), Path::new("mie.csv"))
    }

    /// Linear in degrees: P = θ / 180°, ½ ∫ θ/π sinθ dθ = ½; and 1 + cosθ by many nodes has a mean of 1.
    #[test]
    fn columns_are_normalised_by_the_exact_integral() {
        let read = table("degrees,500,1 um\n0,0,2\n180,1,2\n").unwrap_or_else(|e| panic!("{e:?}"));
        assert!((read.means[0] - 0.5).abs() < 1e-15 && (read.means[1] - 2.0).abs() < 1e-15, "{:?}", read.means);
        assert_eq!((read.table.nm, read.table.degrees), (vec![500.0, 1000.0], vec![0.0, 180.0]));
        assert!((read.table.values[0][1] - 2.0).abs() < 1e-15 && read.table.values[1] == [1.0, 1.0]);
        let rows = (0..=1800).map(|i| 0.1 * f64::from(i)).map(|angle| (angle, 1.0 + angle.to_radians().cos()));
        let (degrees, values): (Vec<f64>, Vec<f64>) = rows.unzip();
        // A chord of a cosine is off by h²/8, h = 0.1 degrees.
        assert!((mean_over_sphere(&degrees, &values) - 1.0).abs() < 4e-7);
    }

    #[test]
    fn values_are_linear_in_degrees_and_nanometres_and_held_beyond() {
        let read = table("angle (deg),400,600\n0,3,1\n90,1,1\n180,1,1\n").unwrap_or_else(|e| panic!("{e:?}"));
        let (table, mean) = (&read.table, read.means[0]);
        for (degrees, nm, expected) in [
            (0.0, 400.0, 3.0 / mean),
            (45.0, 400.0, 2.0 / mean),
            (45.0, 500.0, 0.5 * (2.0 / mean + 1.0)),
            (180.0, 600.0, 1.0),
            (0.0, 300.0, 3.0 / mean),
            (0.0, 900.0, 1.0),
        ] {
            let found = table.value(degrees, nm);
            assert!((found - expected).abs() < 1e-14, "{degrees} degrees, {nm} nm: {found}, not {expected}");
        }
    }

    #[test]
    fn wrong_tables_are_refused_by_line() {
        for (text, line, words) in [
            ("degrees,500\n0,1\n90,-1\n180,1\n", Some(3), "not negative, but is -1 at 90 degrees"),
            ("degrees,500\n0,1\n90,1\n", None, "from 0 to 180 degrees, but run from 0 to 90"),
            ("degrees,500\n1,1\n180,1\n", None, "run from 1 to 180"),
            ("degrees,500\n0,1\n90,1\n90,1\n180,1\n", Some(4), "must ascend"),
            ("degrees,500,500\n0,1,1\n180,1,1\n", None, "two columns for 500 nm"),
            ("degrees,500,blue\n0,1,1\n180,1,1\n", Some(1), "named by wavelengths, but one is \"blue\""),
            ("degrees,500,600\n0,1,\n180,1,1\n", Some(2), "has no value"),
            ("degrees,500\n0,0\n180,0\n", None, "scatters nothing"),
            ("cos theta,500\n-1,1\n1,1\n", Some(1), "gives cosines"),
            ("0,1\n180,1\n", None, "has no header"),
        ] {
            let problem = table(text).err().unwrap_or_else(|| panic!("accepted: {text}"));
            assert!(problem.message.contains(words), "{text}: {problem:?}");
            assert_eq!(problem.line, line, "{text}: {problem:?}");
        }
    }
}
