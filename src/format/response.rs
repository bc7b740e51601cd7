//! Responses of sensors: CSV, wide (nm, then a column a channel, named in the header) or long (header
//! `band,wavelength_nm,response`).

use std::path::Path;

use super::columns;
use super::instrument::Format;
use super::noise::{self, Range};
use super::said::Said;
use super::table;
use super::text::{SpectrumTable, ascending, read};
use super::unit::{self, Density, Kind, Meaning, Stated, Unit};
use crate::error::Problem;
use crate::spectral::Response;
use crate::spectral::planck::{CHARGE, LIGHT_SPEED, PLANCK};

/// The responses of a sensor, by name, in the order of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Responses {
    pub named: Vec<(String, Response)>,
    /// What was not as it should be and could be put right, or was left out; each names the file.
    pub warnings: Vec<String>,
}

/// What numbers of responses are to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Of {
    /// Per energy, in any unit: what is per photon is multiplied by the wavelength.
    Energy,
    /// The share of light, and so of photons, that passes.
    Light,
}

pub fn read_responses(path: &Path) -> Result<Responses, Box<Problem>> {
    parse_responses(&read(path)?, path)
}

/// Like [`read_responses`], of what multiplies a quantum efficiency: shares of the light, in [0, 1].
pub fn read_shares(path: &Path) -> Result<Responses, Box<Problem>> {
    parse(&read(path)?, path, Of::Light)
}

/// [`read_responses`] on the content of the file; `path` stands in messages.
pub fn parse_responses(bytes: &[u8], path: &Path) -> Result<Responses, Box<Problem>> {
    parse(bytes, path, Of::Energy)
}

fn parse(bytes: &[u8], path: &Path, of: Of) -> Result<Responses, Box<Problem>> {
    let wrong = |line: Option<usize>, message: String, help: &str| {
        let help = (!help.is_empty()).then(|| help.to_owned());
        Box::new(Problem { file: path.to_owned(), line, message, help, ..Problem::default() })
    };
    if let Some(found) = Format::of(path, bytes).and_then(|format| format.responses(bytes, path)) {
        return responses(found?, Vec::new(), path, of);
    }
    let table = table::read(bytes, path)?;
    let mut notes = table.notes.clone();
    let count = table.columns();
    if count < 2 {
        return Err(wrong(
            Some(table.line),
            "has one column only".into(),
            "write lines of `nm,response` under a header",
        ));
    }
    let name = |column: usize| table.names.get(column).map_or("", String::as_str);
    let is_long = count == 3 && name(0).eq_ignore_ascii_case("band");
    let has_band = table.names.iter().any(|name| name.eq_ignore_ascii_case("band"));
    if is_long && !(unit::is_axis(name(1)) || matches!(Unit::stated(name(1)), Ok(Some(_)))) && unit::is_axis(name(2)) {
        let help = "write the three columns `band,wavelength_nm,response`, in this order";
        return Err(wrong(Some(table.line), "has the columns of long responses in another order".into(), help));
    }
    if !is_long && has_band {
        let help = "write the three columns `band,wavelength_nm,response`, in this order";
        return Err(wrong(Some(table.line), "has a column `band`, but not the columns of long responses".into(), help));
    }
    let axis = if is_long { 1 } else { columns::axis(&table, false)? };
    let first = axis + 1;
    let unit = Unit::from_header(name(axis)).map_err(|other| {
        let message = format!("gives its wavelengths as {other}, from which none follows");
        wrong(Some(table.line), message, "name wavelength and unit: nm, um, angstrom, cm-1, THz, eV")
    })?;
    if !is_long {
        columns::check_intervals(&table, axis)?;
        refuse_axes_of_their_own(&table, axis, unit)?;
    }
    notes.extend((!is_long && axis > 0).then(|| columns::numbered_words(&table, axis)));
    let in_air = unit::is_in_air(name(axis));
    notes.extend(in_air.then(|| unit::FROM_AIR.to_owned()));

    let mut tables: Vec<(String, SpectrumTable)> = Vec::new();
    if table.names.is_empty() {
        tables.extend((2..=count).map(|number| (format!("column {number}"), SpectrumTable::default())));
        notes
            .push("names no channels: they are called after their columns, and wavelengths are taken as nm".to_owned());
    } else if !is_long {
        tables.extend(table.names[first..].iter().map(|name| (name.clone(), SpectrumTable::default())));
    }
    for row in &table.rows {
        table.check_row(row)?;
        let Some(x) = table.number(row, axis)? else { continue };
        if x <= 0.0 {
            return Err(wrong(Some(row.line), format!("the wavelength must be greater than 0, but is {x}"), ""));
        }
        let nm = if in_air { unit::vacuum_nm(unit.to_nm(x)) } else { unit.to_nm(x) };
        if !is_long {
            for column in first..count {
                if let Some(value) = table.number(row, column)? {
                    let is_twice = table.is_percent(row, column) && says_percent(name(column));
                    let value = if is_twice { value * 100.0 } else { value };
                    tables[column - first].1.push(nm, value, row.line);
                }
            }
            continue;
        }
        let Some(value) = table.number(row, 2)? else { continue };
        let band = row.cells.get(0).unwrap_or("");
        let index = tables.iter().position(|(name, _)| name == band).unwrap_or_else(|| {
            tables.push((band.to_owned(), SpectrumTable::default()));
            tables.len() - 1
        });
        tables[index].1.push(nm, value, row.line);
    }
    if tables.is_empty() {
        return Err(wrong(None, "holds no responses".into(), ""));
    }
    if !is_long {
        let (others, responses): (Vec<_>, Vec<_>) = tables.into_iter().partition(|(name, _)| is_no_response(name));
        tables = responses;
        notes.extend(
            others.iter().map(|(name, _)| {
                format!("has a column \"{}\" that is no response: it is left out", name.escape_debug())
            }),
        );
        if tables.is_empty() {
            return Err(wrong(None, "holds no responses".into(), ""));
        }
    }
    let of_photons = table.comments.iter().map(|(_, text)| text).find(|text| says_per_photon(text)).cloned();
    let value_name = |name: &str| if is_long { table.names[2].clone() } else { name.to_owned() };
    for (name, table) in &mut tables {
        let named = value_name(name);
        apply_unit(&named, table);
        let is_factor = |stated: &Stated| stated.meaning == Meaning::Factor;
        if let Some(stated) = Stated::in_name(&named).filter(is_factor) {
            notes.push(format!("says `{}` of its responses: they are taken as written", table::shown(&stated.text)));
        }
        if of == Of::Light {
            // Electrons a photon are a share as well; amperes a watt are none.
            if Said::in_name(&named) == Some(Said::Responsivity) || is_per_watt(&named) {
                let message =
                    format!("gives the responsivity \"{}\", which is no share of light", named.escape_debug());
                let help = "divide it by λ / 1239.84 nm, or write what passes the band's filter, in [0, 1]";
                return Err(wrong(None, message, help));
            }
            continue;
        }
        if let Some(comment) = &of_photons
            && !is_per_photon(&named)
        {
            per_photon("quantum", table);
            notes.push(format!(
                "has the comment `{}`, so that its responses are per photon: they are multiplied by the wavelength",
                table::shown(comment)
            ));
        }
        notes.extend(per_photon(&named, table).then(|| {
            format!(
                "gives quantum efficiencies as \"{}\", per photon: they are multiplied by the wavelength, as responses are \
                 per energy",
                named.escape_debug()
            )
        }));
    }
    notes.dedup();
    let is_logarithm = |name: &str| Stated::in_name(name).is_some_and(|stated| stated.meaning == Meaning::Logarithm);
    if let Some((name, _)) = tables.iter().find(|(name, _)| is_logarithm(&value_name(name))) {
        let message = format!("gives logarithms, or K/S, as the responses \"{}\"", name.escape_debug());
        return Err(wrong(Some(table.line), message, "write the responses themselves"));
    }
    let mut seen = std::collections::BTreeSet::new();
    if let Some((name, _)) = tables.iter().find(|(name, _)| !seen.insert(name.clone())) {
        let message = format!("has two channels named \"{}\"", name.escape_debug());
        return Err(wrong(Some(table.line), message, "give each its own name"));
    }
    responses(tables, notes, path, of)
}

/// Whether the unit of a response is one per watt.
fn is_per_watt(name: &str) -> bool {
    let squeezed = name.replace(' ', "");
    ["A/W", "AW-1", "A.W-1", "V/W", "VW-1"].iter().any(|unit| squeezed.contains(unit))
}

/// Whether a column is another axis, as NOAA's files have one, or the uncertainty of the one before, as those of Landsat.
fn is_no_response(name: &str) -> bool {
    let lower = name.to_lowercase();
    let first = lower.split(|c: char| !c.is_alphabetic()).find(|word| !word.is_empty()).unwrap_or("");
    let last = lower.split(|c: char| !c.is_alphabetic()).rfind(|word| !word.is_empty()).unwrap_or("");
    const SPREADS: [&str; 12] =
        ["stdev", "stddev", "std", "sd", "uncertainty", "unc", "uncert", "sigma", "err", "error", "fwhm", "bandwidth"];
    // An axis by its unit, but for a wavelength, which may be that of a band.
    let other_axis = matches!(Unit::stated(name), Ok(Some(Unit::Wavenumber(_) | Unit::Frequency(_) | Unit::Energy(_))))
        && Stated::in_name(name).is_none_or(|stated| !stated.is_number());
    unit::is_axis(name)
        || other_axis
        || ["freq", "flag", "flags", "mask", "quality", "reference", "comment"].contains(&lower.trim())
        || ["wavelength", "wavenumber", "frequency"].contains(&first)
        || SPREADS.contains(&first)
        || (last != lower && SPREADS.contains(&last))
        || lower.replace(' ', "").contains("(k=")
}

/// Refuses wavelengths that stand between two responses, as those of each band beside it, unless they are those of the first
/// column.
fn refuse_axes_of_their_own(table: &table::Table, axis: usize, unit: Unit) -> Result<(), Box<Problem>> {
    let is_value = |column: &usize| table.names.get(*column).is_none_or(|name| !is_no_response(name));
    let own = columns::own_axes(table, axis);
    for (i, other) in own.iter().copied().enumerate() {
        let end = own.get(i + 1).copied().unwrap_or(table.columns());
        if !(other + 1..end).any(|column| is_value(&column)) {
            continue;
        }
        if let Some(line) = columns::differs(table, axis, unit, other)? {
            let message = format!(
                "gives the responses after column {} over wavelengths of their own, which differ from the first column's here",
                other + 1
            );
            let help = "write them long, under the header `band,wavelength_nm,response`";
            return Err(table.problem(Some(line), message, help));
        }
    }
    Ok(())
}

fn says_percent(name: &str) -> bool {
    Stated::in_name(name).is_some_and(|stated| stated.is_percent())
}

/// Abbreviations of efficiencies that count photons.
const EFFICIENCIES: [&str; 5] = ["qe", "eqe", "iqe", "ipce", "pde"];

fn is_per_photon(name: &str) -> bool {
    let lower = name.to_lowercase().replace("q.e.", "qe");
    let mut words = lower.split(|c: char| !c.is_alphanumeric());
    words.any(|word| {
        EFFICIENCIES.contains(&word) || ["quantum", "quantal", "quanta", "photon", "photons"].contains(&word)
    }) || lower.replace(' ', "").contains("e-/ph")
}

/// Whether a comment says that responses are per photon, and not that they were made from such.
fn says_per_photon(text: &str) -> bool {
    let lower = text.to_lowercase().replace("q.e.", "qe");
    let words: Vec<&str> = lower.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
    let of_photons = words.iter().any(|word| EFFICIENCIES.contains(word) || *word == "quantal")
        || ["quantum efficienc", "per photon", "photon response", "photon sensitivity", "response to photons", "e-/ph"]
            .iter()
            .any(|phrase| lower.contains(phrase));
    of_photons && !["from", "convert", "divided", "per energy", "not "].iter().any(|word| lower.contains(word))
}

/// Percent become shares.
fn apply_unit(name: &str, table: &mut SpectrumTable) {
    if let Some(Stated { meaning: Meaning::Unit(measure), certain: true, .. }) = Stated::in_name(name)
        && let Some(Density::Plain(factor)) = measure.to(Kind::Number)
    {
        table.value.iter_mut().for_each(|value| *value *= factor);
    }
}

/// Makes a response to photons one to energy, A/W, if its name says that it is one; whether it did.
fn per_photon(name: &str, table: &mut SpectrumTable) -> bool {
    // Of a quantum efficiency of 1 each photon gives one charge: λ / 1239.84 nm amperes a watt (h c / e).
    const NM_VOLT: f64 = PLANCK * LIGHT_SPEED / CHARGE * 1e9;
    let is = is_per_photon(name);
    if is {
        table.value.iter_mut().zip(&table.nm).for_each(|(value, nm)| *value *= nm / NM_VOLT);
    }
    is
}

fn responses(
    tables: Vec<(String, SpectrumTable)>,
    notes: Vec<String>,
    path: &Path,
    wanted: Of,
) -> Result<Responses, Box<Problem>> {
    let mut named = Vec::new();
    let (mut noisy, mut count, mut worst) = (Vec::new(), 0, 0f64);
    let mut warnings: Vec<String> = notes.into_iter().map(|note| format!("{} {note}", path.display())).collect();
    for (name, table) in tables {
        let of = format!(" of the channel \"{}\"", name.escape_debug());
        let mut table = ascending(table, path, &of)?;
        warnings.extend(table.notes.drain(..).map(|note| format!("{} {note}{of}", path.display())));
        if wanted == Of::Light
            && let Some(i) = table.value.iter().position(|v| *v > 1.01)
        {
            let message = format!("the response{of} must be a share of light, in [0, 1], but is {}", table.value[i]);
            let help =
                Some("write `(%)` behind the name of what is percent, or divide by the largest value".to_owned());
            let line = table.line.get(i).copied();
            return Err(Box::new(Problem { file: path.to_owned(), line, message, help, ..Problem::default() }));
        }
        match noise::clip(&mut table.value, Range::NotNegative, |v| v) {
            Ok(None) => {}
            Ok(Some(clipped)) => {
                noisy.push(name.clone());
                count += clipped.count;
                worst = worst.min(clipped.worst);
            }
            Err(i) => {
                let message = format!("the response{of} must not be negative, but is {}", table.value[i]);
                let help = Some("values down to -1 % of the peak are taken as noise and become 0".to_owned());
                return Err(Box::new(Problem {
                    file: path.to_owned(),
                    line: table.line.get(i).copied(),
                    message,
                    help,
                    ..Problem::default()
                }));
            }
        }
        let response = Response::new(table.nm, table.value).map_err(|what| {
            let message = format!("the response{of} {what}");
            Box::new(Problem { file: path.to_owned(), message, ..Problem::default() })
        })?;
        named.push((name, response));
    }
    if count > 0 {
        warnings.push(format!(
            "{}: the responses of the channels {} hold {count} negative values, the lowest {worst}, within 1 % of their peak: \
             taken as noise, and as 0",
            path.display(),
            noisy.join(", ")
        ));
    }
    Ok(Responses { named, warnings })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Responses, Box<Problem>> {
        parse_responses(text.as_bytes(), Path::new("s.csv"))
    }

    #[test]
    fn wide_and_long_files_say_the_same() {
        let wide = parse("# a sensor\nwavelength_nm,red,blue\n400,,1\n500,0,0.5\n600,1,\n").unwrap();
        let long = parse("band,um,response\nred,0.5,0\nred,0.6,1\nblue,0.4,1\nblue,0.5,0.5\n").unwrap();
        assert_eq!(wide, long);
        assert_eq!(wide.named[1].1.integral(), 75.0);
        assert!(wide.warnings.is_empty());
    }

    #[test]
    fn percent_and_quantum_efficiencies_are_applied() {
        let share = parse("nm,red\n400,0\n500,0.5\n600,0\n").unwrap();
        for text in ["nm,red (%)\n400,0\n500,50\n600,0\n", "band,nm,response [%]\nred,400,0\nred,500,50\nred,600,0\n"] {
            let percent = parse(text).unwrap();
            assert_eq!(percent.named[0].1, share.named[0].1, "{text}");
            assert!(percent.warnings.is_empty());
        }
        // A silicon diode at 1239.84 nm and an efficiency of 1: 1 A/W; at half of that 0.5 A/W.
        let photons = parse("nm,QE\n619.920992,1\n1239.841984,1\n").unwrap();
        assert!(photons.warnings[0].contains("multiplied by the wavelength"), "{:?}", photons.warnings);
        let mean = photons.named[0].1.integral() / (1_239.841_984 - 619.920_992);
        assert!((mean - 0.75).abs() < 1e-9, "{mean}");
        assert!(parse("band,nm,log10 response\na,400,1\na,500,2\n").unwrap_err().message.contains("logarithms"));
    }

    /// NOAA's files of ABI, and USGS's of Landsat 8.
    #[test]
    fn columns_that_are_no_responses_are_left_out() {
        let abi = parse(
            "Wavelength (um)   Wavenumber (cm-1)   Response\n0.50 20000 0.1\n0.51 19607.8 1.0\n0.52 19230.8 0.1\n",
        )
        .unwrap();
        assert_eq!(abi.named.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["Response"]);
        assert!(abi.warnings[0].contains("Wavenumber") && abi.warnings[0].contains("left out"), "{:?}", abi.warnings);
        let oli = parse("Wavelength,BA RSR [watts],STDEV[+/-]\n500,0.1,0.01\n510,1,0.02\n520,0.1,0.01\n").unwrap();
        assert_eq!((oli.named.len(), oli.warnings.len()), (1, 1));
        assert!(parse("nm,wavenumber\n500,20000\n510,19607\n").unwrap_err().message.contains("no responses"));
    }

    #[test]
    fn shares_of_light_are_at_most_one_and_never_multiplied() {
        let shares = |text: &str| super::parse(text.as_bytes(), Path::new("s.csv"), Of::Light);
        for (text, integral) in [
            ("nm,a\n400,1\n500,1\n", 100.0),
            ("nm,QE a\n400,0.5\n500,0.5\n", 50.0),
            ("nm,a (%)\n400,90\n500,90\n", 90.0),
            ("# QE\nnm,a\n400,0.5\n500,0.5\n", 50.0),
        ] {
            let found = shares(text).unwrap_or_else(|problem| panic!("{text}: {problem}"));
            assert!(
                (found.named[0].1.integral() - integral).abs() < 1e-9 && found.warnings.is_empty(),
                "{text}: {found:?}"
            );
        }
        for (text, words) in [
            ("nm,a\n400,90\n500,90\n", "a share of light, in [0, 1], but is 90"),
            ("nm,a\n400,0.5\n500,2\n", "but is 2"),
            ("nm,responsivity (A/W)\n400,0.5\n500,0.5\n", "responsivity"),
            ("nm,a (A W-1)\n400,0.5\n500,0.5\n", "responsivity"),
        ] {
            let problem = shares(text).unwrap_err();
            assert!(problem.message.contains(words), "{text}: {problem}");
        }
    }

    #[test]
    fn what_is_per_photon_is_seen_in_names_and_comments() {
        for text in [
            "nm,PDE\n",
            "nm,Q.E.\n",
            "nm,e-/ph\n",
            "# QE\nnm,a\n",
            "# response per photon\nnm,a\n",
            "# photon response\nnm,a\n",
            "# electrons per photon\nnm,a\n",
            "# relative quantal sensitivity\nnm,a\n",
        ] {
            let found = parse(&format!("{text}400,1\n500,1\n")).unwrap();
            assert!(found.warnings.iter().any(|w| w.contains("multiplied by the wavelength")), "{text}: {found:?}");
        }
        for text in ["# converted from QE\nnm,a\n", "# photon energies\nnm,a\n", "# not per photon\nnm,a\n"] {
            let found = parse(&format!("{text}400,1\n500,1\n")).unwrap();
            assert!(found.warnings.is_empty(), "{text}: {found:?}");
        }
    }

    #[test]
    fn axes_and_flags_are_no_channels_and_lost_rows_are_told_of() {
        for column in ["photon energy (eV)", "freq_THz", "wavenumber (cm-1)", "flag", "reference"] {
            let found = parse(&format!("nm,a,{column}\n400,1,2\n500,1,3\n")).unwrap();
            assert_eq!(found.named.len(), 1, "{column}");
            assert!(found.warnings[0].contains("left out"), "{column}: {found:?}");
        }
        assert_eq!(parse("nm,B1,reference panel\n400,1,2\n500,1,3\n").unwrap().named.len(), 2);
        let lost = parse("band,wavelength_nm,response\n#1,400,1\n#1,500,1\nA,400,1\nA,500,1\n").unwrap();
        assert!(lost.warnings[0].contains("2 lines that look like rows, the first of them 2"), "{lost:?}");
        for (text, words) in [
            ("band,wavelength_nm,response,uncertainty\na,400,1,0\na,500,1,0\n", "not the columns of long responses"),
            ("band,detector,wavelength_nm,response\na,x,400,1\na,x,500,1\n", "not the columns of long responses"),
            ("band,response,wavelength_nm\na,0,400\na,1,500\n", "in another order"),
        ] {
            let problem = parse(text).unwrap_err();
            assert!(problem.message.contains(words), "{text}: {problem}");
            assert!(problem.help.is_some_and(|help| help.contains("band,wavelength_nm,response")), "{text}");
        }
    }

    #[test]
    fn axes_of_single_bands_are_refused() {
        for text in [
            "Wavelength (nm),B1,Wavelength (nm),B2\n400,0,500,0\n500,1,600,1\n600,0,700,0\n",
            "Wavelength,B1,Wavelength,B2\n400,0,500,0\n500,1,600,1\n600,0,700,0\n",
            "a nm,a,b nm,b\n400,0,500,0\n500,1,600,1\n600,0,700,0\n",
            "Wavelength (nm),B1,Wavelength (um),B2\n400,0,0.5,0\n500,1,0.6,1\n600,0,0.7,0\n",
        ] {
            let problem = parse(text).unwrap_err();
            assert!(
                problem.message.contains("wavelengths of their own") && problem.line == Some(2),
                "{text}: {problem}"
            );
        }
        // The same places, once more, are left out as before; so is what follows the last response.
        let same = parse("nm,B1,um,B2\n400,0,0.4,0\n500,1,0.5,1\n600,0,0.6,0\n").unwrap();
        assert_eq!((same.named.len(), same.warnings.len()), (2, 1), "{:?}", same.warnings);
        let behind = parse("nm,B1,Wavenumber (cm-1)\n400,0,25000\n500,1,20000\n600,0,16667\n").unwrap();
        assert_eq!((behind.named.len(), behind.warnings.len()), (1, 1));
        assert!(parse("from (nm),to (nm),v\n400,500,1\n500,600,1\n").unwrap_err().message.contains("intervals"));
        let numbered = parse(",wavelength (nm),a\n0,400,0\n1,500,1\n2,600,0\n").unwrap();
        assert_eq!((numbered.named.len(), numbered.named[0].1.integral()), (1, 100.0));
        assert!(numbered.warnings[0].contains("row numbers"), "{:?}", numbered.warnings);
    }

    #[test]
    fn what_is_no_response_or_of_photons_is_known_by_more_names() {
        for text in [
            "nm,RSR,RSR_err\n400,0,.01\n500,1,.01\n600,0,.01\n",
            "nm,RSR,uncertainty,U(k=2)\n400,0,.01,.01\n500,1,.01,.01\n600,0,.01,.01\n",
        ] {
            let found = parse(text).unwrap();
            assert_eq!(found.named.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["RSR"], "{text}");
        }
        // Made responses per energy by their wavelength: means are weighted by it, whatever the factor.
        for text in ["nm,L cone (quantal)\n400,0\n500,1\n600,0\n", "# quantum efficiency\nnm,a\n400,0\n500,1\n600,0\n"]
        {
            let found = parse(text).unwrap();
            let per_photon = parse("nm,QE\n400,0\n500,1\n600,0\n").unwrap();
            assert_eq!(found.named[0].1, per_photon.named[0].1, "{text}");
            assert!(found.warnings[0].contains("multiplied by the wavelength"), "{:?}", found.warnings);
        }
        // Centres and widths are no curves.
        assert!(parse("nm,fwhm\n500,50\n600,50\n").unwrap_err().message.contains("no responses"));
        assert!(parse("nm,log energy L\n400,1\n500,2\n").unwrap_err().message.contains("logarithms"));
        let twice = parse("nm,red (%)\n400,0%\n500,50%\n600,0%\n").unwrap();
        assert_eq!(twice.named[0].1.integral(), 50.0);
    }

    #[test]
    fn wavelengths_in_air_are_converted_which_is_said() {
        let found = parse("wavelength in air (nm),a\n400,0\n500,1\n600,0\n").unwrap();
        assert!(found.warnings.len() == 1 && found.warnings[0].contains("converted to vacuum"), "{:?}", found.warnings);
    }

    #[test]
    fn noise_becomes_zero_and_is_told() {
        let noisy = parse("nm,a,b\n400,-0.009,0\n500,1,2\n600,-0.001,0\n").unwrap();
        let [warning] = &noisy.warnings[..] else { panic!("{:?}", noisy.warnings) };
        assert!(
            warning.contains("2 negative values") && warning.contains("-0.009") && warning.contains("channels a hold"),
            "{warning}"
        );
        assert_eq!(noisy.named[0].1.integral(), 100.0);
    }

    #[test]
    fn mistakes_name_their_line() {
        for (text, line, words) in [
            ("", None, "no data"),
            ("nm,a\n400,1\n500,x\n", Some(3), "`x` is not a finite number"),
            ("nm,a\n400,1\n500,1,2\n", Some(3), "3 cells"),
            ("nm,a\n400,1\n0,1\n", Some(3), "greater than 0"),
            ("nm,a\n400,1\n", None, "1 values of the channel \"a\""),
            ("nm,a\n400,1\n500,-0.02\n", Some(3), "must not be negative, but is -0.02"),
            ("nm,a\n400,0\n500,0\n", None, "zero everywhere"),
            ("nm,a,a\n400,1,1\n500,1,1\n", Some(1), "two channels named \"a\""),
            ("Frequency,a\n400,1\n500,1\n", Some(1), "`Frequency`"),
            ("band,nm,response\n", None, "no responses"),
            ("nm,band,response\n400,a,0\n450,a,1\n", Some(1), "long responses"),
            ("nm,log10 a\n400,0\n500,1\n", Some(1), "logarithms"),
            ("nm,filter OD\n400,4\n500,0.1\n600,4\n", Some(1), "logarithms"),
            ("band,nm,response\na,400,1\na,500,1\na,450,1\na,600,1\n", Some(4), "follows"),
        ] {
            let problem = parse(text).unwrap_err();
            assert!(problem.message.contains(words), "{text:?}: {problem}");
            assert_eq!(problem.line, line, "{text:?}: {problem}");
        }
    }
}
