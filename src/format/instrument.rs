//! Spectra as instruments and other programs keep them: IES TM-27 (`.spdx`), rawtoaces (`.json`), field spectrometers (SVC `.sig`,
//! Spectral Evolution `.sed`), RADIS (`.spec`); and formats that are known by their look and refused by their name.

use std::ops::Range;
use std::path::Path;

use quick_xml::Reader;
use quick_xml::events::Event;
use serde_json::Value;

use super::asd;
use super::said::Said;
use super::table::{self, shown};
use super::text::{Column, SpectrumTable, ascending, named};
use super::unit::{self, Stated, Unit};
use crate::error::Problem;

type Read<T> = Result<T, Box<Problem>>;

/// A format that is known by its name or how it begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// IES TM-27: XML of one spectrum over nm.
    Spdx,
    /// JSON of rawtoaces: spectra of one or more channels over nm.
    RawToAces,
    /// JSON of RADIS.
    Radis,
    /// Analytical Spectral Devices, binary.
    Asd,
    /// Spectra Vista.
    Svc,
    /// Spectral Evolution.
    SpectralEvolution,
    /// A channel's response as RTTOV has it: two columns over cm⁻¹, after lines about the instrument.
    Rttov,
    /// One that is not read: what it is, and what to do.
    Refused(&'static str, &'static str),
}

/// What is wrong with a file, and what to do.
pub(super) fn wrong<T>(path: &Path, line: Option<usize>, message: impl Into<String>, help: &str) -> Read<T> {
    let help = (!help.is_empty()).then(|| help.to_owned());
    Err(Box::new(Problem { file: path.to_owned(), line, message: message.into(), help, ..Problem::default() }))
}

/// Formats by how they begin: bytes, what it is, and what to do.
const MAGIC: [(&[u8], &str, &str); 6] = [
    (b"\x89HDF", "an HDF5 or netCDF-4 file", "write the spectrum as CSV: `nm,value`"),
    (b"CDF\x01", "a netCDF file", "write the spectrum as CSV: `nm,value`"),
    (b"CDF\x02", "a netCDF file", "write the spectrum as CSV: `nm,value`"),
    (b"PK\x03\x04", "a zip archive or a spreadsheet such as .xlsx", "export it as CSV"),
    (b"\x1f\x8b", "compressed with gzip", "decompress it"),
    (b"\xd0\xcf\x11\xe0", "an old spreadsheet (.xls)", "export it as CSV"),
];

impl Format {
    /// The format of a file that is none of the others.
    pub fn of(path: &Path, bytes: &[u8]) -> Option<Format> {
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
        if name.contains("spccoeff") || name.contains("taucoeff") {
            let help = "take the instrument's responses as text, e.g. of its agency: `wavenumber (cm-1),response`";
            return Some(Format::Refused("a file of coefficients of CRTM, not of responses or spectra", help));
        }
        if name.starts_with("rtcoef_") && !name.contains("srf") {
            let help = "take the responses, rtcoef_…_srf_chNN.txt of the same instrument";
            return Some(Format::Refused("a file of coefficients of RTTOV, not of responses or spectra", help));
        }
        if asd::is_asd(bytes) {
            return Some(Format::Asd);
        }
        if let Some((_, what, help)) = MAGIC.iter().find(|(magic, ..)| bytes.starts_with(magic)) {
            return Some(Format::Refused(what, help));
        }
        let start = String::from_utf8_lossy(&bytes[..bytes.len().min(4096)]);
        let untrimmed = &*start;
        let start = start.trim_start_matches('\u{feff}').trim_start();
        if name.ends_with(".spdx") || start.contains("<IESTM2714") || start.contains("<IESTM27") {
            return Some(Format::Spdx);
        }
        if start.starts_with("##TITLE") || start.contains("\n##JCAMP-DX") {
            let help = "export it as text in columns: wavelengths and values";
            return Some(Format::Refused("JCAMP-DX, whose numbers are packed and scaled by its header", help));
        }
        if start.starts_with('{') {
            if start.contains("\"spectral_data\"") {
                return Some(Format::RawToAces);
            }
            let radis = ["\"arrays\"", "\"wavespace\"", "\"waveunit\"", "\"_q\""];
            let anywhere = |word: &&&str| bytes.windows(word.len()).any(|bytes| bytes == word.as_bytes());
            if name.ends_with(".spec") || radis.iter().filter(anywhere).count() >= 2 {
                return Some(Format::Radis);
            }
        }
        if start.starts_with("/***") && start.to_lowercase().contains("sig data") {
            return Some(Format::Svc);
        }
        let has_columns = start.contains("Columns [");
        if name.ends_with(".sed") && (has_columns || start.contains("Data:"))
            || has_columns && start.contains("\nData:")
        {
            return Some(Format::SpectralEvolution);
        }
        if name.starts_with("rtcoef_") && name.contains("srf") {
            return Some(Format::Rttov);
        }
        if name.ends_with(".header") && start.starts_with('{') && start.contains("\"table_name\"") {
            let help = "compute absorption coefficients from its lines, and write them over wavenumber: `nu (cm-1),coef (cm-1)`";
            return Some(Format::Refused("the header of a list of spectral lines of HAPI", help));
        }
        if is_line_list(untrimmed) {
            let help =
                "compute absorption coefficients from it, e.g. with HAPI or RADIS, and write them over wavelength";
            return Some(Format::Refused("a list of spectral lines of HITRAN", help));
        }
        if is_cross_sections(untrimmed) {
            let help = "write each of its temperatures as a column over wavenumber: `nu (cm-1),208 K (cm2/molecule)`";
            return Some(Format::Refused("a file of HITRAN's cross sections", help));
        }
        None
    }

    /// All responses of a sensor by name; `None` where the format has none.
    pub fn responses(self, bytes: &[u8], path: &Path) -> Option<Read<Vec<(String, SpectrumTable)>>> {
        match self {
            Format::RawToAces => Some(rawtoaces_names(bytes, path).and_then(|names| {
                let read = |name: String| Ok((name.clone(), rawtoaces(bytes, path, Column::Named(&name))?));
                names.into_iter().map(read).collect()
            })),
            Format::Rttov | Format::Asd => {
                let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                Some(self.read(bytes, path, Column::Only).map(|table| vec![(name, table)]))
            }
            Format::Refused(..) => Some(self.read(bytes, path, Column::Only).map(|_| Vec::new())),
            _ => None,
        }
    }

    /// The spectrum of `column`.
    pub fn read(self, bytes: &[u8], path: &Path, column: Column) -> Read<SpectrumTable> {
        match self {
            Format::Spdx => spdx(bytes, path, column),
            Format::RawToAces => rawtoaces(bytes, path, column),
            Format::Radis => radis(bytes, path, column),
            Format::Asd => asd::read(bytes, path, column),
            Format::Svc => svc(bytes, path, column),
            Format::SpectralEvolution => spectral_evolution(bytes, path, column),
            Format::Rttov => rttov(bytes, path).and_then(|table| no_columns(path, column).map(|()| table)),
            Format::Refused(what, help) => wrong(path, None, format!("is {what}, which is not read"), help),
        }
    }
}

/// Lines of 160 characters, the first of which are a molecule, an isotopologue and a wavenumber.
fn is_line_list(start: &str) -> bool {
    let mut lines = start.lines().take(3);
    let is_line = |line: &str| {
        // The isotopologue is a letter where there are more than nine.
        let molecule = line.get(..2).is_some_and(|id| id.trim().parse::<u32>().is_ok());
        let wavenumber = line.get(3..15).is_some_and(|text| text.trim().parse::<f64>().is_ok());
        // HAPI adds columns behind.
        line.len() >= 160 && molecule && wavenumber
    };
    lines.next().is_some_and(is_line) && lines.take(1).all(is_line)
}

/// A line of columns of fixed width (the molecule, 20; first and last wavenumber, 10 each; points, 7; temperature, 7; pressure, 6), and
/// below it ten values of ten characters.
fn is_cross_sections(start: &str) -> bool {
    let mut lines = start.lines();
    let number = |line: &str, columns: Range<usize>| line.get(columns)?.trim().parse::<f64>().ok();
    let is_header = |line: &str| {
        let [from, to, points, kelvin, torr] =
            [20..30, 30..40, 40..47, 47..54, 54..60].map(|columns| number(line, columns).unwrap_or(f64::NAN));
        line.len() >= 80 && from < to && points >= 2.0 && points.fract() == 0.0 && kelvin > 0.0 && torr >= 0.0
    };
    let is_values = |line: &str| (0..2).all(|i| number(line, 10 * i..10 * (i + 1)).is_some());
    lines.next().is_some_and(is_header) && lines.next().is_some_and(is_values)
}

fn no_columns(path: &Path, wanted: Column) -> Read<()> {
    super::library::no_columns(path, wanted)
}

/// The one among `names` that is wanted; numbers count from `first`.
pub(super) fn pick(names: &[String], wanted: Column, default: Option<usize>, first: usize, path: &Path) -> Read<usize> {
    let list = || names.join(", ");
    match wanted {
        Column::Only if names.len() == 1 => Ok(0),
        Column::Only => match default {
            Some(index) => Ok(index),
            None => wrong(
                path,
                None,
                format!("has {} spectra", names.len()),
                &format!("pick one with `column`: {}", list()),
            ),
        },
        Column::Number(number) => match number.checked_sub(first).filter(|index| *index < names.len()) {
            Some(index) => Ok(index),
            None => {
                let last = first + names.len() - 1;
                wrong(path, None, format!("has no column {number}"), &format!("its columns are {first} to {last}"))
            }
        },
        Column::Named(name) => {
            let found: Vec<usize> = (0..names.len()).filter(|i| names[*i].eq_ignore_ascii_case(name)).collect();
            match found[..] {
                [index] => Ok(index),
                _ => {
                    wrong(path, None, format!("has no column {}", named(name)), &format!("its columns are {}", list()))
                }
            }
        }
    }
}

/// IES TM-27-14: `SpectralData` elements with an attribute `wavelength`, in nm, under `SpectralDistribution`.
fn spdx(bytes: &[u8], path: &Path, column: Column) -> Read<SpectrumTable> {
    no_columns(path, column)?;
    let text = table::text(bytes, path)?;
    let mut reader = Reader::from_str(&text);
    let line_at = |offset: u64| Some(text[..text.floor_char_boundary(offset as usize)].matches('\n').count() + 1);
    let mut found = SpectrumTable::default();
    let mut wavelength: Option<f64> = None;
    let mut element = String::new();
    let mut content = String::new();
    let mut quantity = String::new();
    let mut depth = 0usize;
    loop {
        let line = line_at(reader.buffer_position());
        let event = match reader.read_event() {
            Ok(event) => event,
            // The parser quotes names as they are, with the ends of lines in them.
            Err(e) => {
                let what = e.to_string().replace('\n', " ");
                return wrong(path, line, format!("is no XML that can be read: {what}"), "");
            }
        };
        match event {
            Event::Start(start) => {
                depth += 1;
                start.local_name().as_ref().clone_into(&mut element);
                content.clear();
                if element == "SpectralData" {
                    let attribute = start.attributes().flatten().find(|a| a.key.as_ref() == "wavelength");
                    let value = attribute.and_then(|a| a.value.trim().parse::<f64>().ok());
                    match value.filter(|nm| nm.is_finite() && *nm > 0.0) {
                        Some(nm) => wavelength = Some(nm),
                        None => return wrong(path, line, "has `SpectralData` without a `wavelength` above 0", ""),
                    }
                }
            }
            Event::Text(text) => content.push_str(text.as_ref()),
            Event::End(end) => {
                depth = depth.saturating_sub(1);
                match end.local_name().as_ref() {
                    "SpectralQuantity" => quantity = content.trim().to_lowercase(),
                    "SpectralData" => {
                        let Some(nm) = wavelength.take() else { continue };
                        let Some(value) = content.trim().parse::<f64>().ok().filter(|v| v.is_finite()) else {
                            return wrong(path, line, format!("`{}` is not a finite number", shown(&content)), "");
                        };
                        found.push(nm, value, line.unwrap_or(1));
                    }
                    _ => {}
                }
                content.clear();
            }
            Event::Eof if depth > 0 => {
                return wrong(path, line, format!("ends within `{element}`"), "the file may be cut");
            }
            Event::Eof => break,
            _ => {}
        }
    }
    // The quantities of the standard; the others are relative, or numbers.
    let of = match quantity.as_str() {
        "irradiance" | "exitance" => Some("W m-2 nm-1"),
        "r-factor" => return ascending(found.called("reflectance"), path, ""),
        "t-factor" => return ascending(found.called("transmittance"), path, ""),
        "radiance" => Some("W m-2 sr-1 nm-1"),
        "intensity" => Some("W sr-1 nm-1"),
        "flux" => Some("W nm-1"),
        _ => None,
    };
    found.unit = of.and_then(Stated::of);
    const OTHERS: [&str; 7] = ["", "other", "relative", "reflectance", "transmittance", "absorptance", "absorbance"];
    if of.is_none() && !OTHERS.contains(&quantity.as_str()) {
        let message = format!("says that its quantity is `{}`, which TM-27 does not have", shown(&quantity));
        return wrong(path, None, message, "write the values as CSV, with their unit: `nm,radiance (W m-2 sr-1 nm-1)`");
    }
    if quantity == "absorbance" {
        let help = "write the values themselves, as CSV: `nm,value`";
        return wrong(path, None, "says that its quantity is absorbance, a logarithm", help);
    }
    ascending(found.called(&quantity), path, "")
}

fn json(bytes: &[u8], path: &Path) -> Read<Value> {
    let text = table::text(bytes, path)?;
    serde_json::from_str(&text)
        .or_else(|e| wrong(path, Some(e.line()), format!("is no JSON that can be read: {e}"), ""))
}

fn rawtoaces_names(bytes: &[u8], path: &Path) -> Read<Vec<String>> {
    let document = json(bytes, path)?;
    let names = document["spectral_data"]["index"]["main"].as_array().cloned().unwrap_or_default();
    Ok(names.iter().map(|name| name.as_str().unwrap_or("").to_owned()).collect())
}

/// JSON of rawtoaces: `spectral_data.index.main` names the channels, `spectral_data.data.main` has their numbers by wavelength.
fn rawtoaces(bytes: &[u8], path: &Path, column: Column) -> Read<SpectrumTable> {
    let document = json(bytes, path)?;
    let data = &document["spectral_data"];
    let names = rawtoaces_names(bytes, path)?;
    let Some(rows) = data["data"]["main"].as_object().filter(|_| !names.is_empty()) else {
        let help = "it has `spectral_data` with `index.main` and `data.main`";
        return wrong(path, None, "is no spectrum of rawtoaces", help);
    };
    let index = pick(&names, column, None, 2, path)?;
    let mut pairs: Vec<(f64, f64)> = Vec::with_capacity(rows.len());
    for (key, values) in rows {
        let nm = key.trim().parse::<f64>().ok().filter(|nm| nm.is_finite() && *nm > 0.0);
        let (Some(nm), Some(value)) = (nm, values[index].as_f64()) else {
            return wrong(path, None, format!("has no number for {} at `{}`", names[index], shown(key)), "");
        };
        pairs.push((nm, value));
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (nm, value) = pairs.into_iter().unzip();
    let unit = data["units"].as_str().unwrap_or("");
    if unit::is_logarithm_only(unit) {
        let message = format!("says that its values are in `{}`, logarithms", shown(unit));
        return wrong(path, None, message, "write the values themselves");
    }
    let mut notes = Vec::new();
    if Stated::of(unit).is_none() && !["", "relative", "radiometric"].contains(&unit.to_lowercase().as_str()) {
        notes
            .push(format!("says `{}` of its values, which is not understood: they are taken as they are", shown(unit)));
    }
    let said = Said::in_name(unit).map(|said| (said, unit.to_owned()));
    let axis = ["wavelength_units", "wavelength units"]
        .iter()
        .find_map(|key| data[*key].as_str().or(document["header"][*key].as_str()));
    if let Some(axis) = axis.filter(|axis| Unit::named(axis) != Some(Unit::NANOMETRE)) {
        let message = format!("gives its wavelengths in `{}`, where rawtoaces has nm", shown(axis));
        return wrong(path, None, message, "write them in nm");
    }
    ascending(SpectrumTable { nm, value, unit: Stated::of(unit), said, notes, ..SpectrumTable::default() }, path, "")
}

/// A spectrum of RADIS: arrays by name, the axis in `waveunit`: cm⁻¹, nm (in air) or nm_vac.
fn radis(bytes: &[u8], path: &Path, column: Column) -> Read<SpectrumTable> {
    let document = json(bytes, path)?;
    let arrays = ["arrays", "_q"].iter().find_map(|key| document.get(*key)?.as_object());
    let Some(arrays) = arrays else {
        return wrong(
            path,
            None,
            "is no spectrum of RADIS that can be read: it has no `arrays`",
            "store it with `compress=False`",
        );
    };
    let axis_name = ["wavespace", "wavenumber", "wavelength"].into_iter().find(|name| arrays.contains_key(*name));
    let Some(axis_name) = axis_name else {
        return wrong(path, None, "has no array `wavespace`", "store it with `compress=False`");
    };
    let conditions = &document["conditions"];
    let waveunit = document["waveunit"].as_str().or(conditions["waveunit"].as_str()).unwrap_or(match axis_name {
        "wavenumber" => "cm-1",
        _ => "",
    });
    let (unit, in_air) = match waveunit {
        "cm-1" => (Unit::WAVENUMBER, false),
        "nm" => (Unit::NANOMETRE, true),
        "nm_vac" | "nm_vacuum" => (Unit::NANOMETRE, false),
        other => {
            let message = format!("gives its axis in `{}`, where RADIS has cm-1, nm or nm_vac", shown(other));
            return wrong(path, None, message, "");
        }
    };
    let numbers = |name: &str| -> Read<Vec<f64>> {
        let array = &arrays[name];
        let array = array.get("__ndarray__").unwrap_or(array);
        match array.as_array().map(|list| list.iter().map(Value::as_f64).collect::<Option<Vec<f64>>>()) {
            Some(Some(numbers)) => Ok(numbers),
            _ => wrong(path, None, format!("has an array {} that is no list of numbers", named(name)), ""),
        }
    };
    let names: Vec<String> = arrays.keys().filter(|name| *name != axis_name).cloned().collect();
    let index = pick(&names, column, None, 2, path)?;
    let name = &names[index];
    let (x, value) = (numbers(axis_name)?, numbers(name)?);
    if x.len() != value.len() {
        let message = format!("has {} places on its axis and {} values of {name}", x.len(), value.len());
        return wrong(path, None, message, "");
    }
    if let Some(wrong_x) = x.iter().find(|x| **x <= 0.0) {
        return wrong(path, None, format!("has {wrong_x} on its axis, which must be above 0"), "");
    }
    let to_nm = |x: &f64| if in_air { unit::vacuum_nm(unit.to_nm(*x)) } else { unit.to_nm(*x) };
    let text = document["units"][name].as_str().unwrap_or("");
    let stated = Stated::of(text);
    if stated.is_none() && !text.is_empty() {
        return wrong(path, None, format!("gives {name} in `{}`, a unit that is not understood", shown(text)), "");
    }
    let mut found =
        SpectrumTable { nm: x.iter().map(to_nm).collect(), value, unit: stated, ..SpectrumTable::default() };
    if in_air {
        found.notes.push("gives wavelengths in air, as RADIS has them in nm: they are converted to vacuum".to_owned());
    }
    if Stated::in_name(name).is_some_and(|stated| stated.meaning == unit::Meaning::Logarithm) {
        return wrong(path, None, format!("gives {}, which is a logarithm", named(name)), "take another array");
    }
    ascending(found.called(name), path, "")
}

/// Spectra Vista: lines `key= value` up to `data=`, then wavelength in nm, reference, target and reflectance in percent.
fn svc(bytes: &[u8], path: &Path, column: Column) -> Read<SpectrumTable> {
    let text = table::text(bytes, path)?;
    let names = ["reference", "target", "reflectance"].map(str::to_owned);
    let index = pick(&names, column, Some(2), 2, path)?;
    let mut lines = (1..).zip(text.lines());
    let mut units = String::new();
    let Some(_) = lines.find(|(_, line)| {
        let (key, value) = line.split_once('=').unwrap_or((line, ""));
        if key.trim() == "units" {
            units = value.trim().to_owned();
        }
        key.trim() == "data"
    }) else {
        return wrong(path, None, "has no line `data=`", "the file may be cut");
    };
    let mut found = SpectrumTable::default();
    for (number, line) in lines {
        let cells: Vec<&str> = line.split_whitespace().collect();
        if cells.is_empty() {
            continue;
        }
        let numbers: Option<Vec<f64>> =
            cells.iter().map(|cell| cell.parse().ok().filter(|v: &f64| v.is_finite())).collect();
        let Some(numbers) = numbers.filter(|numbers| numbers.len() == 4 && numbers[0] > 0.0) else {
            return wrong(path, Some(number), "is not a wavelength and three numbers", "");
        };
        found.push(numbers[0], if index == 2 { numbers[3] / 100.0 } else { numbers[1 + index] }, number);
    }
    if index < 2 {
        // Counts are of one detector at one exposure; radiance is in 1e-10 W cm-2 sr-1 nm-1.
        let units_of_it = units.split(',').nth(index).unwrap_or(&units).trim();
        if Said::in_name(units_of_it) != Some(Said::Radiance) {
            let message = format!("holds {} in `{}`, which is no radiance", names[index], shown(units_of_it));
            return wrong(path, None, message, "export radiance, or take the reflectance");
        }
        found.value.iter_mut().for_each(|value| *value *= 1e-6);
        found.unit = Stated::of("W m-2 sr-1 nm-1");
    }
    found = found.called(if index == 2 { "reflectance" } else { "radiance" });
    if let Some(i) = (1..found.nm.len()).find(|&i| found.nm[i] <= found.nm[i - 1]) {
        let line = found.line[i];
        return wrong(
            path,
            Some(line),
            "goes back to a shorter wavelength, where the next detector begins",
            "remove the overlap of detectors in the instrument's program first",
        );
    }
    ascending(found, path, "")
}

/// Spectral Evolution: lines `Key: value` up to `Data:`, a line of names, and rows; reflectance is in percent.
fn spectral_evolution(bytes: &[u8], path: &Path, column: Column) -> Read<SpectrumTable> {
    let text = table::text(bytes, path)?;
    let mut before = 0usize;
    let mut units = String::new();
    let mut start = None;
    for (number, line) in (1..).zip(text.split('\n')) {
        before += line.len() + 1;
        match line.split_once(':').map(|(key, value)| (key.trim(), value.trim())) {
            Some(("Data", _)) => {
                start = Some((number + 1, before.min(text.len())));
                break;
            }
            Some(("Units", value)) => units = value.to_owned(),
            _ => {}
        }
    }
    let Some((first_line, offset)) = start else {
        return wrong(path, None, "has no line `Data:`", "the file may be cut");
    };
    let table = table::parse(&text[offset..], first_line, path)?;
    if table.names.len() < 2 {
        return wrong(path, Some(table.line), "has no names of columns after `Data:`", "");
    }
    let names = &table.names[1..];
    let lower: Vec<String> = names.iter().map(|name| name.to_lowercase()).collect();
    let is_share = |name: &String| name.contains("reflect") || name.contains("tgt./ref") || name.contains("transmit");
    let default = lower.iter().position(is_share).or((names.len() == 1).then_some(0));
    let index = pick(names, column, default, 2, path)?;
    let (name, lower) = (&names[index], &lower[index]);
    let unit = if lower.contains('%') {
        Stated::of("%")
    } else if let Some(stated) = Stated::in_name(name).filter(|stated| stated.meaning == unit::Meaning::Logarithm) {
        Some(stated)
    } else if lower.contains("rad") {
        match Stated::of(&units) {
            Some(stated) => Some(stated),
            None => {
                return wrong(
                    path,
                    None,
                    format!("gives {name} in `{}`, a unit that is not understood", shown(&units)),
                    "",
                );
            }
        }
    } else if lower.contains("dn") {
        return wrong(
            path,
            Some(table.line),
            format!("holds {name}, which are counts"),
            "take reflectance or radiance",
        );
    } else {
        None
    };
    let mut found = SpectrumTable { unit, ..SpectrumTable::default() };
    let noun = [
        ("reflect", "reflectance"),
        ("tgt./ref", "reflectance"),
        ("transmit", "transmittance"),
        ("irrad", "irradiance"),
        ("rad", "radiance"),
    ];
    let noun = noun.into_iter().find(|(part, _)| lower.contains(part)).map(|(_, noun)| noun);
    found = found.called(noun.unwrap_or(name));
    for row in &table.rows {
        table.check_row(row)?;
        if let (Some(nm), Some(value)) = (table.number(row, 0)?, table.number(row, index + 1)?) {
            if nm <= 0.0 {
                return wrong(path, Some(row.line), format!("the wavelength must be greater than 0, but is {nm}"), "");
            }
            found.push(nm, value, row.line);
        }
    }
    ascending(found, path, "")
}

/// A response of RTTOV: whatever stands before the first two numbers is about the instrument.
pub fn rttov(bytes: &[u8], path: &Path) -> Read<SpectrumTable> {
    let text = table::text(bytes, path)?;
    let mut found = SpectrumTable::default();
    for (number, line) in (1..).zip(text.lines()) {
        let numbers: Option<Vec<f64>> =
            line.split_whitespace().map(|word| word.parse().ok().filter(|v: &f64| v.is_finite())).collect();
        match numbers.as_deref() {
            Some(&[wavenumber, response]) if wavenumber > 0.0 => {
                found.push(Unit::WAVENUMBER.to_nm(wavenumber), response, number);
            }
            Some([]) => {}
            _ if found.nm.len() < 2 => {
                found.nm.clear();
                found.value.clear();
                found.line.clear();
            }
            _ => return wrong(path, Some(number), "is not a wavenumber and a response", ""),
        }
    }
    ascending(found, path, "")
}

#[cfg(test)]
mod tests;
