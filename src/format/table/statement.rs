//! What lines about a table say that would change its numbers: in what its axis or its values are, and what these are of.

use crate::format::said::Said;
use crate::format::unit::{self, FACTORS, Unit};

/// What a line says beside the names of columns.
#[derive(Debug, Clone, PartialEq)]
pub enum Statement {
    /// That the axis is in this unit, which is not nm.
    Axis(Unit),
    /// That it is something from which no wavelength follows.
    OtherAxis,
    Percent,
    /// That the values are logarithms or another function of what they should be.
    Logarithm,
    Of(Said),
}

/// Words, without blanks and marks, that begin a key of the axis, and of the values.
const AXIS_KEYS: [&str; 9] =
    ["xaxis", "xunit", "xlabel", "xdata", "abscissa", "firstcolumn", "column1", "spectralaxis", "wavelengthunit"];
const VALUE_KEYS: [&str; 18] = [
    "yaxis",
    "yunit",
    "ylabel",
    "ydata",
    "ordinate",
    "secondcolumn",
    "column2",
    "unit",
    "value",
    "data",
    "mode",
    "photometricmode",
    "measurementmode",
    "measurementtype",
    "datatype",
    "quantity",
    "signal",
    "spectrumtype",
];

/// What the line of these cells says.
pub fn of(cells: &[&str]) -> Vec<Statement> {
    let whole = cells.join(" ");
    let whole = unit::without_mark(&whole);
    let split = whole.split_once([':', '=']).filter(|(key, _)| !key.trim().is_empty());
    let (key, value) = match (split, cells) {
        (Some((key, value)), _) => (key.to_owned(), value.trim().to_owned()),
        (None, [first, rest @ ..]) if !rest.is_empty() => (unit::without_mark(first).to_owned(), rest.join(" ")),
        _ => (String::new(), whole.to_owned()),
    };
    let squeezed: String = key.to_lowercase().chars().filter(|c| c.is_alphanumeric()).collect();
    let begins = |keys: &[&str]| keys.iter().any(|start| squeezed.starts_with(start));
    let mut found = Vec::new();

    let of_axis = begins(&AXIS_KEYS) || matches!(squeezed.as_str(), "x" | "axis");
    // `Wavelength: Angstrom`, `lambda in um`; not `Wavelength range: 0.4 to 2.5 um`.
    let first = squeezed.starts_with("wave") || squeezed.starts_with("lambda");
    let has_number = value.chars().next().is_some_and(|c| c.is_ascii_digit() && !value.starts_with("1/"));
    if of_axis && squeezed.starts_with("xaxis") || (of_axis || first) && !has_number {
        found.extend(axis_in(&value, of_axis));
    } else if squeezed.starts_with("unit") && unit::parse(&value).is_none_or(|measure| !measure.is_number()) {
        // `Units: Angstrom`; of `cm-1` and `1/m` nobody knows whether they are those of an absorption.
        found.extend(Unit::named(&value).and_then(other_than_nm).map(Statement::Axis));
    } else if key.is_empty() {
        found.extend(axis_of_sentence(whole));
    }
    if !of_axis && !first {
        let of_values = begins(&VALUE_KEYS) || key.is_empty();
        if unit::speaks_of_percent(whole) || (of_values && unit::is_percent_only(&value)) {
            found.push(Statement::Percent);
        }
        if of_values && unit::is_logarithm_only(&value) {
            found.push(Statement::Logarithm);
        } else if of_values && value.split_whitespace().count() <= 2 {
            found.extend(Said::in_name(&value).map(Statement::Of));
        }
    }
    found
}

fn other_than_nm(unit: Unit) -> Option<Unit> {
    (unit != Unit::NANOMETRE).then_some(unit)
}

/// What the value of a key of the axis says; where the key is plainly that, what is neither a wavelength nor a unit is another axis.
fn axis_in(value: &str, is_certain: bool) -> Option<Statement> {
    match Unit::stated(value) {
        Ok(Some(unit)) => other_than_nm(unit).map(Statement::Axis),
        Err(_) if is_certain => Some(Statement::OtherAxis),
        _ => None,
    }
}

/// What a sentence without a key says of the axis: nothing but a unit, or `wavelengths in Angstrom`.
fn axis_of_sentence(text: &str) -> Option<Statement> {
    let text = text.strip_prefix("in ").unwrap_or(text);
    let is_one = |text: &str| text.chars().count() == 1 && text != "\u{c5}";
    if let Some(unit) = Unit::named(text).and_then(other_than_nm).filter(|_| !is_one(text)) {
        return Some(Statement::Axis(unit));
    }
    // Names between other marks than the table has: `lambda_A,v`.
    let piece = text.split([',', ';', '\t']).next().unwrap_or(text).trim();
    let words: Vec<&str> = piece.split_whitespace().collect();
    let lower = piece.to_lowercase();
    let begins = ["wave", "lambda", "\u{3bb}"].iter().any(|word| lower.starts_with(word));
    let has_number = words.iter().any(|word| word.starts_with(|c: char| c.is_ascii_digit()) && !word.starts_with("1/"));
    if !begins || words.len() > 6 || has_number {
        return None;
    }
    Unit::stated(piece).ok().flatten().and_then(other_than_nm).map(Statement::Axis)
}

/// Whether a row right before the numbers, of as many cells as they, is no line of names but one that says something of the table:
/// `Units: Angstrom`, `Scale,0.01`, `Wavelength:,um`.
pub fn is_no_header(cells: &[&str]) -> bool {
    let [first, rest @ ..] = cells else { return false };
    if rest.is_empty() {
        return false;
    }
    let lower = first.to_lowercase();
    let is_key = first.ends_with(':') && !rest.iter().all(|cell| cell.ends_with(':'));
    let of_units = matches!(lower.trim_end_matches(':'), "unit" | "units" | "x units" | "xunit" | "xunits" | "y units");
    let is_number = rest[0].parse::<f64>().is_ok();
    let scales = FACTORS
        .iter()
        .chain(["offset"].iter())
        .any(|word| lower.starts_with(word) || (is_number && lower.contains(word)));
    // No values are called after a unit of wavelength, but for those of one letter or a Greek one.
    let is_length = |cell: &str| {
        !matches!(cell, "mu" | "Mu" | "MU")
            && cell.chars().filter(char::is_ascii).count() != 1
            && !cell.contains(|c: char| c.is_ascii_digit())
            && { matches!(Unit::named(cell), Some(Unit::Wavelength(_))) }
    };
    // `X-Axis,Wavenumber (cm-1)`; but `X-Axis,Y-Axis` are names.
    let squeezed = |cell: &str| cell.to_lowercase().chars().filter(|c| c.is_alphanumeric()).collect::<String>();
    let key = squeezed(first);
    const OTHER_KEYS: [&str; 9] = [
        "yaxis",
        "yunit",
        "ylabel",
        "ordinate",
        "secondcolumn",
        "photometricmode",
        "measurementmode",
        "measurementtype",
        "datatype",
    ];
    let begins = AXIS_KEYS.iter().chain(&OTHER_KEYS).any(|start| key.starts_with(start))
        || matches!(key.as_str(), "axis" | "mode");
    // `XAXIS (cm-1)` is a name by its unit.
    let has_unit = first.contains(['(', '[']) && matches!(Unit::stated(first), Ok(Some(_)));
    let is_key = is_key || (begins && !has_unit && rest.len() == 1 && !squeezed(rest[0]).starts_with("yaxis"));
    let is_unit = rest.len() == 1 && is_length(rest[0]) && Unit::named(first).is_none();
    is_key
        || of_units
        || scales && rest.len() == 1
        || is_unit
        || (Unit::named(first).is_none() && Unit::named(&cells.join(" ")).is_some())
}

/// Whether a line that names no columns has a key of the axis or of units.
pub fn is_of_axis(cells: &[&str]) -> bool {
    let first = cells.first().map(|cell| cell.to_lowercase()).unwrap_or_default();
    ["wave", "lambda", "unit", "x"].iter().any(|start| first.starts_with(start))
}
