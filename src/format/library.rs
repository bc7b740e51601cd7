//! Spectra as the libraries of remote sensing keep them: ENVI spectral libraries (`.sli` and a header), ECOSTRESS (and ASTER)
//! text, and USGS text, whose wavelengths are in a file of their own.

use std::fs;
use std::path::{Path, PathBuf};

use super::envi;
use super::instrument::wrong;
use super::said::Said;
use super::table::shown;
use super::text::{Column as Wanted, SpectrumTable, ascending, named, only_one, read};
use super::unit::{Stated, Unit};
use crate::error::Problem;

type Read<T> = Result<T, Box<Problem>>;

/// Whether `path` is an ENVI spectral library: its data, or its header.
pub fn is_envi(path: &Path, bytes: &[u8]) -> bool {
    let extension = path.extension().unwrap_or_default();
    extension.eq_ignore_ascii_case("sli") || (extension.eq_ignore_ascii_case("hdr") && envi::is_header(bytes))
}

/// The spectrum of that name or number (by default the only one) of an ENVI spectral library.
pub fn read_envi(path: &Path, wanted: Wanted) -> Read<SpectrumTable> {
    let is_header = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("hdr"));
    let (header_path, data) = if is_header {
        (path.to_owned(), path.with_extension("sli"))
    } else {
        match envi::header_path(path) {
            Some(header) => (header, path.to_owned()),
            None => return wrong(path, None, "has no header beside it", "its name is that of the library, with .hdr"),
        }
    };
    let header = envi::parse(&read(&header_path)?, &header_path)?;
    parse_envi(&header, &header_path, &read(&data)?, &data, wanted)
}

/// [`read_envi`] on the content of both files.
pub fn parse_envi(
    header: &envi::Header,
    header_path: &Path,
    data: &[u8],
    data_path: &Path,
    wanted: Wanted,
) -> Read<SpectrumTable> {
    if !header.is_library() || header.bands != 1 {
        let help = "its file type must be ENVI Spectral Library, with one band";
        return wrong(header_path, None, "describes no spectral library", help);
    }
    let Some(nm) = header.wavelength_nm.clone() else {
        return wrong(header_path, None, "says nothing about `wavelength`", "a spectral library has a list of them");
    };
    let names = header.list("spectra names").unwrap_or_default();
    if !names.is_empty() && names.len() != header.lines {
        let message = format!("has {} `spectra names` for {} spectra", names.len(), header.lines);
        return wrong(header_path, None, message, "names are separated by commas, and hold none");
    }
    let index = match wanted {
        Wanted::Only if header.lines == 1 => 0,
        Wanted::Only => {
            return wrong(
                data_path,
                None,
                format!("has {} spectra", header.lines),
                &format!("pick one with `column`: {}", list(&names)),
            );
        }
        Wanted::Number(number) => match number.checked_sub(1).filter(|index| *index < header.lines) {
            Some(index) => index,
            None => {
                let message = format!("has no spectrum {number}");
                return wrong(data_path, None, message, &format!("it has {}, counted from 1", header.lines));
            }
        },
        Wanted::Named(wanted) => {
            let found: Vec<usize> = (0..names.len()).filter(|i| names[*i] == wanted).collect();
            match only_one(&found, ["spectrum", "spectra"], &format!("\"{wanted}\""), || list(&names)) {
                Ok(index) => index,
                Err((message, help)) => return wrong(data_path, None, message, &help),
            }
        }
    };
    let surplus = header.surplus(data.len(), data_path);
    let data = header.data(data, data_path)?;
    let mut table =
        SpectrumTable { unit: header.unit().cloned(), notes: header.notes.clone(), ..SpectrumTable::default() };
    if let Some(name) = header.called() {
        table = table.called(name);
    }
    table.notes.extend(surplus);
    let mut missing = 0usize;
    for (i, nm) in nm.into_iter().enumerate() {
        if !header.is_good(i) {
            continue;
        }
        let Some(value) = data.value(i, index, 0) else {
            missing += 1;
            continue;
        };
        if !value.is_finite() {
            return wrong(data_path, None, format!("holds {value} at {nm} nm"), "");
        }
        table.nm.push(nm);
        table.value.push(value);
    }
    table.notes.extend(header.bad_bands());
    if missing > 0 {
        table.notes.push(format!("has {missing} bands without a value: they are bridged by their neighbours"));
    }
    ascending(table, data_path, "")
}

/// A few names, for people.
fn list(names: &[&str]) -> String {
    const SHOWN: usize = 12;
    match names.len() {
        0 => "it names none".to_owned(),
        n if n <= SHOWN => names.join(", "),
        n => format!("{} and {} more", names[..SHOWN].join(", "), n - SHOWN),
    }
}

/// Whether this is text of ECOSTRESS's kind: lines `Key: value`, the first of them the name.
pub fn is_ecostress(bytes: &[u8]) -> bool {
    let first = bytes.split(|b| *b == b'\n').map(<[u8]>::trim_ascii).find(|line| !line.is_empty());
    first.is_some_and(|line| line.starts_with(b"Name:"))
}

/// An ECOSTRESS spectrum: lines `Key: value`, an empty one, then pairs of numbers.
pub fn parse_ecostress(bytes: &[u8], path: &Path) -> Read<SpectrumTable> {
    // Latin-1: every byte is the character of that number.
    let text: String = bytes.iter().map(|&byte| char::from(byte)).collect();
    let pair = |line: &str| -> Option<[f64; 2]> {
        let mut words = line.split_whitespace().map(|word| word.parse::<f64>().ok().filter(|v| v.is_finite()));
        let pair = [words.next()??, words.next()??];
        words.next().is_none().then_some(pair)
    };
    let mut unit: Option<Unit> = None;
    let (mut y_first, mut promised) = (false, None);
    let mut table = SpectrumTable::default();
    let mut pairs = 0usize;
    for (number, line) in (1..).zip(text.lines()) {
        if let Some([a, b]) = pair(line) {
            let Some(unit) = unit else {
                return wrong(path, Some(number), "begins with numbers before `X Units` is said", "");
            };
            let (x, y) = if y_first { (b, a) } else { (a, b) };
            pairs += 1;
            if x > 0.0 {
                table.push(unit.to_nm(x), y, number);
            }
            continue;
        }
        let Some((key, value)) = line.split_once(':') else {
            // Values without a partner are in the library's own files, and are nobody's.
            let all_numbers = line.split_whitespace().all(|word| word.parse::<f64>().is_ok());
            if pairs > 0 && !all_numbers {
                return wrong(path, Some(number), "is not a pair of numbers", "");
            }
            pairs += usize::from(pairs > 0 && !line.trim().is_empty());
            continue;
        };
        let raw = value.trim();
        let value = raw.to_lowercase();
        match key.trim().to_lowercase().as_str() {
            "x units" => {
                unit = Some(match Unit::stated(raw) {
                    Ok(Some(unit)) => unit,
                    _ => {
                        let message = format!("gives wavelengths in `{}`", value.escape_debug());
                        return wrong(
                            path,
                            Some(number),
                            message,
                            "micrometers, nanometers, cm-1 and other units of a spectrum can be read",
                        );
                    }
                });
            }
            "y units" => {
                table.unit = Stated::in_name(raw);
                table = table.called(raw);
            }
            "first column" => y_first = value == "y",
            "number of x values" => promised = value.parse::<usize>().ok().map(|n| (number, n)),
            _ => {}
        }
    }
    if let Some((line, promised)) = promised.filter(|(_, promised)| *promised != pairs) {
        return wrong(
            path,
            Some(line),
            format!("promises {promised} values, but {pairs} follow"),
            "the file may be cut",
        );
    }
    // Percent of any spelling become fractions here, whatever the spectrum is for.
    if table.unit.as_ref().is_some_and(Stated::is_percent) {
        table.value.iter_mut().for_each(|value| *value /= 100.0);
        table.unit = None;
    }
    ascending(table, path, "")
}

/// Values of the USGS library at or below this are deleted points (-1.23e34).
const DELETED: f64 = -1e30;

/// Whether this is text of the USGS spectral library: ` splib07a Record=…: title`.
pub fn is_usgs(bytes: &[u8]) -> bool {
    let first = bytes.split(|b| *b == b'\n').next().unwrap_or_default();
    let text = String::from_utf8_lossy(first);
    text.contains("Record=") && text.contains(':')
}

/// A column of numbers under one header line.
struct Column {
    title: String,
    values: Vec<f64>,
}

fn parse_column(bytes: &[u8], path: &Path) -> Read<Column> {
    let text = String::from_utf8_lossy(bytes);
    let mut lines = (1..).zip(text.lines());
    let title = lines.next().map_or("", |(_, line)| line).trim().to_owned();
    let mut values = Vec::new();
    for (number, line) in lines {
        let line = line.trim();
        if line.is_empty() {
            continue;
        }
        match line.parse::<f64>() {
            Ok(value) if value.is_finite() => values.push(value),
            _ => {
                let shown: String = line.chars().take(40).collect();
                return wrong(path, Some(number), format!("`{}` is not a finite number", shown.escape_debug()), "");
            }
        }
    }
    Ok(Column { title, values })
}

/// A USGS spectrum with the wavelengths of the file in its folder that has as many: `…_Wavelengths_SPECTROMETER_….txt`. If
/// several have, the one whose spectrometer the spectrum's name holds.
pub fn read_usgs(bytes: &[u8], path: &Path) -> Read<SpectrumTable> {
    let spectrum = parse_column(bytes, path)?;
    let said = usgs_kind(&spectrum.title, path)?;
    let folder = crate::files::parent(path);
    let name_of = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut candidates: Vec<(PathBuf, Column)> = Vec::new();
    let mut entries: Vec<PathBuf> = fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path()).collect();
    entries.sort();
    for entry in entries.into_iter().filter(|entry| name_of(entry).to_lowercase().contains("wavelengths")) {
        let column = parse_column(&read(&entry)?, &entry)?;
        if column.values.len() == spectrum.values.len() {
            candidates.push((entry, column));
        }
    }
    if candidates.len() > 1 {
        let name = name_of(path).to_uppercase();
        let spectrometer = |candidate: &Path| {
            let of_candidate = name_of(candidate).to_uppercase();
            let after = of_candidate.split("WAVELENGTHS_").nth(1).unwrap_or_default().to_owned();
            after.split(['_', '.']).next().unwrap_or_default().to_owned()
        };
        candidates.retain(|(candidate, _)| {
            let spectrometer = spectrometer(candidate);
            !spectrometer.is_empty() && name.contains(&spectrometer)
        });
    }
    let count = spectrum.values.len();
    let help =
        "the USGS library keeps them in files such as splib07a_Wavelengths_ASD_….txt; put the right one beside it";
    match &candidates[..] {
        [(file, wavelengths)] => {
            let found = pair_usgs(&spectrum, wavelengths, path, file)?;
            Ok(SpectrumTable { said: Some((said, spectrum.title)), ..found })
        }
        [] => {
            wrong(path, None, format!("has {count} values, but no file of {count} wavelengths is in its folder"), help)
        }
        several => {
            let names: Vec<String> = several.iter().map(|(file, _)| name_of(file)).collect();
            wrong(path, None, format!("has {count} values, and so have {}", names.join(", ")), help)
        }
    }
}

/// What a record is of, by the words of its title and of its file's name: a reflectance, but for those that say something else.
fn usgs_kind(title: &str, path: &Path) -> Read<Said> {
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let about = title.split_once(':').map_or(title, |(_, about)| about);
    let all = [about, &name].map(str::to_uppercase).join(" ");
    let words: Vec<&str> = all.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
    let any = |starts: &[&str]| words.iter().any(|word| starts.iter().any(|start| word.starts_with(start)));
    let is = |wanted: &[&str]| words.iter().any(|word| wanted.contains(word));
    let refuse = |what: &str| wrong(path, Some(1), format!("is a record of {what}: `{}`", shown(about.trim())), "");
    if any(&["ERROR"]) || is(&["STDEV", "UNCERTAINTY"]) {
        return refuse("the errors of another");
    }
    if any(&["ABSORBANCE"]) || is(&["ABSB", "ABS"]) {
        return refuse("absorbance, a logarithm");
    }
    if any(&["WAVELENGTH", "BANDPASS", "RESOLUTION"]) {
        return refuse("wavelengths or bandpasses, not of a spectrum");
    }
    let is_reflectance = is(&["AREF", "RREF", "RTGC"]) || any(&["REFLECTAN"]);
    Ok(match () {
        () if is_reflectance => Said::Reflectance,
        () if is(&["TRAN", "TRANS"]) || any(&["TRANSMITTAN", "TRANSMISSION"]) => Said::Transmittance,
        () if any(&["EMISSIVIT"]) || is(&["EMIS"]) => Said::Emissivity,
        () => Said::Reflectance,
    })
}

fn pair_usgs(spectrum: &Column, wavelengths: &Column, path: &Path, of: &Path) -> Read<SpectrumTable> {
    // Microns go without saying in this library.
    let unit = match Unit::stated(wavelengths.title.split_once(':').map_or("", |(_, title)| title)) {
        Ok(unit) => unit.unwrap_or(Unit::MICROMETRE),
        Err(other) => return wrong(of, Some(1), format!("gives wavelengths in {other}"), ""),
    };
    let mut table = SpectrumTable::default();
    for (i, (&x, &value)) in wavelengths.values.iter().zip(&spectrum.values).enumerate() {
        if value <= DELETED || x <= DELETED {
            continue;
        }
        if x <= 0.0 {
            return wrong(of, Some(i + 2), format!("the wavelength must be greater than 0, but is {x}"), "");
        }
        table.push(unit.to_nm(x), value, i + 2);
    }
    ascending(table, path, "")
}

/// Columns that a reader of one spectrum has no use for.
pub fn no_columns(path: &Path, wanted: Wanted) -> Read<()> {
    let which = match wanted {
        Wanted::Only => return Ok(()),
        Wanted::Named(name) => named(name),
        Wanted::Number(number) => number.to_string(),
    };
    wrong(path, None, format!("holds one spectrum, and no column {which}"), "remove `column`")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::unit::{Density, Kind, Meaning};

    const ECOSTRESS: &str = "Name: Construction Concrete\nType: manmade\nOwner: caf\u{e9}: none\nFirst Column: X\n\
        X Units: Wavelength (micrometers)\nY Units:Reflectance (percent)\nNumber of X Values:4\n\
        Additional Information: none.txt\n\n 14.0\t5.5\n 2.5\t20.0\n 0.4 10.0\n 0.0 99.0\n";

    fn latin1(text: &str) -> Vec<u8> {
        text.chars().map(|c| u8::try_from(u32::from(c)).unwrap_or(b'?')).collect()
    }

    #[test]
    fn ecostress_is_reversed_and_scaled() {
        let bytes = latin1(ECOSTRESS);
        assert!(is_ecostress(&bytes));
        let table = parse_ecostress(&bytes, Path::new("c.spectrum.txt")).unwrap();
        assert_eq!((table.nm, table.value), (vec![400.0, 2500.0, 14_000.0], vec![0.1, 0.2, 0.055]));
        assert_eq!(table.line, [12, 11, 10]);
    }

    /// What its `Y Units` say is what it is of, and in what.
    #[test]
    fn ecostress_says_what_it_is_of() {
        for (units, said, first) in [
            ("Reflectance (percent)", Said::Reflectance, 0.1),
            ("Transmittance (percent)", Said::Transmittance, 0.1),
            ("Emissivity", Said::Emissivity, 10.0),
            ("Radiance (W/m2/sr/um)", Said::Radiance, 10.0),
        ] {
            let text = ECOSTRESS.replace("Reflectance (percent)", units);
            let table = parse_ecostress(&latin1(&text), Path::new("c.txt")).unwrap();
            assert_eq!((table.said.map(|(said, _)| said), table.value[0]), (Some(said), first), "{units}");
        }
        let text = ECOSTRESS.replace("Reflectance (percent)", "Radiance (W/m2/sr/um)");
        let unit = parse_ecostress(&latin1(&text), Path::new("c.txt")).unwrap().unit.expect("a unit");
        let Meaning::Unit(measure) = unit.meaning else { panic!("{unit:?}") };
        assert_eq!(measure.to(Kind::Radiance), Some(Density::Plain(1e-3)));
    }

    #[test]
    fn wrong_ecostress_files_say_where() {
        for (from, to, line, words) in [
            ("Values:4", "Values:5", Some(7), "promises 5 values, but 4"),
            ("(micrometers)", "(furlongs)", Some(5), "furlongs"),
            ("X Units: Wavelength (micrometers)\n", "", Some(9), "before `X Units`"),
            (" 2.5\t20.0\n", " 2.5\ttwenty\n", Some(11), "not a pair"),
            (" 2.5\t20.0\n", " 25\t20.0\n", Some(10), "follows"),
        ] {
            let text = ECOSTRESS.replacen(from, to, 1);
            let problem = parse_ecostress(&latin1(&text), Path::new("c.txt")).unwrap_err();
            assert!(problem.message.contains(words), "{problem}");
            assert_eq!(problem.line, line, "{problem}");
        }
    }

    #[test]
    fn usgs_spectra_find_their_wavelengths() {
        let folder = tempfile::tempdir().expect("folder");
        let put = |name: &str, text: &str| fs::write(folder.path().join(name), text).expect("written");
        put("splib07a_Quartz_BECKb_AREF.txt", " splib07a Record=1: Quartz\n 0.5\n-1.23e34\n 0.7\n");
        let path = folder.path().join("splib07a_Quartz_BECKb_AREF.txt");
        let read = || {
            let bytes = fs::read(&path).expect("read");
            assert!(is_usgs(&bytes));
            read_usgs(&bytes, &path)
        };
        assert!(read().unwrap_err().message.contains("no file of 3 wavelengths"));
        put("splib07a_Wavelengths_BECK_Beckman.txt", " splib07a Record=2: Wavelengths in microns\n 0.4\n 0.5\n 0.6\n");
        put("splib07a_Wavelengths_NIC4_x.txt", " splib07a Record=3: Wavelengths\n 1\n 2\n");
        let table = read().unwrap();
        assert_eq!((table.nm, table.value, table.line), (vec![400.0, 600.0], vec![0.5, 0.7], vec![2, 4]));
        put("splib07a_Wavelengths_ASD_x.txt", " splib07a Record=3: Wavelengths (nm)\n 1\n 2\n 3\n");
        assert_eq!(read().unwrap().nm, [400.0, 600.0]);
        fs::rename(folder.path().join("splib07a_Wavelengths_ASD_x.txt"), folder.path().join("wavelengths.txt"))
            .expect("renamed");
        fs::rename(folder.path().join("splib07a_Wavelengths_BECK_Beckman.txt"), folder.path().join("Wavelengths2.txt"))
            .expect("renamed");
        assert!(read().is_err(), "none of two names the spectrometer");
        put("wavelengths.txt", " x Record=1: y\n 1\n x\n 3\n");
        assert_eq!(read().unwrap_err().line, Some(3));
    }

    #[test]
    fn usgs_records_say_what_they_are_of() {
        let kind = |title: &str| usgs_kind(&format!("splib07a Record=3: {title}"), Path::new("a.txt"));
        for (title, said) in [
            ("Water H2O BECKb Transmittance", Said::Transmittance),
            ("Olivine GDS70 BECKa TRAN", Said::Transmittance),
            ("Olivine GDS70 BECKa AREF", Said::Reflectance),
            ("Quartz", Said::Reflectance),
        ] {
            assert_eq!(kind(title).ok(), Some(said), "{title}");
        }
        for (title, words) in [
            ("error to previous reflectance AREF", "the errors of another"),
            ("Olivine GDS70 BECKa ABSB", "absorbance"),
            ("Olivine absorbance", "absorbance"),
            ("Wavelengths in microns", "wavelengths"),
        ] {
            let problem = kind(title).unwrap_err();
            assert!(problem.line == Some(1) && problem.message.contains(words), "{title}: {problem}");
        }
        assert!(matches!(usgs_kind("splib07a Record=3: Oak", Path::new("oak_ASD_TRAN.txt")), Ok(Said::Transmittance)));
    }

    fn library(names: &str) -> String {
        format!(
            "ENVI\nfile type = ENVI Spectral Library\nsamples = 3\nlines = 2\nbands = 1\ndata type = 4\ninterleave = bsq\n\
             byte order = 0\nwavelength units = Micrometers\nreflectance scale factor = 100\nwavelength = {{ 0.6, 0.5, 0.4 }}\n\
             spectra names = {{ {names} }}\n"
        )
    }

    #[test]
    fn envi_libraries_pick_a_spectrum() {
        let path = Path::new("a.hdr");
        let header = envi::parse(library("dry soil, wet").as_bytes(), path).unwrap();
        let data: Vec<u8> = [1f32, 2.0, 3.0, 10.0, 20.0, 30.0].iter().flat_map(|v| v.to_le_bytes()).collect();
        let read = |header: &envi::Header, data: &[u8], name: Option<&str>| {
            parse_envi(header, path, data, Path::new("a.sli"), name.into())
        };
        let table = read(&header, &data, Some("wet")).unwrap();
        assert_eq!((table.nm, table.value), (vec![400.0, 500.0, 600.0], vec![0.3, 0.2, 0.1]));
        for (data, name, words) in [
            (&data[..], None, "has 2 spectra"),
            (&data[..], Some("dust"), "no spectrum \"dust\""),
            (&data[..20], Some("wet"), "20 bytes, but its header promises 24"),
        ] {
            let problem = read(&header, data, name).unwrap_err();
            assert!(problem.message.contains(words), "{problem}");
        }
        let three = envi::parse(library("a, b, c").as_bytes(), path).unwrap();
        assert!(read(&three, &data, Some("a")).unwrap_err().message.contains("3 `spectra names`"));
    }
}
