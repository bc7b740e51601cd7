//! Headers of ENVI images and spectral libraries: `ENVI` on the first line, then `key = value`, lists in braces, comments
//! after `;`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

mod written;

pub use written::{Image, map_info};

use super::said::Said;
use super::table::shown;
use super::unit::{self, FACTORS, Meaning, Stated, Unit};
use crate::error::Problem;

/// How the values of an image follow each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Interleave {
    /// Line by line, in each band by band
    Bil,
    /// Pixel by pixel, in each band by band
    Bip,
    /// Band by band
    Bsq,
}

impl Interleave {
    pub fn name(self) -> &'static str {
        match self {
            Interleave::Bil => "bil",
            Interleave::Bip => "bip",
            Interleave::Bsq => "bsq",
        }
    }
}

/// The number types of ENVI that are real.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DataType {
    U8,
    I16,
    I32,
    F32,
    F64,
    U16,
    U32,
    I64,
    U64,
}

impl DataType {
    fn from_number(number: u64) -> Option<DataType> {
        Some(match number {
            1 => DataType::U8,
            2 => DataType::I16,
            3 => DataType::I32,
            4 => DataType::F32,
            5 => DataType::F64,
            12 => DataType::U16,
            13 => DataType::U32,
            14 => DataType::I64,
            15 => DataType::U64,
            _ => return None,
        })
    }

    pub(super) fn number(self) -> u64 {
        let known = [1, 2, 3, 4, 5, 12, 13, 14, 15];
        known.into_iter().find(|number| DataType::from_number(*number) == Some(self)).unwrap_or_default()
    }

    pub fn bytes(self) -> usize {
        match self {
            DataType::U8 => 1,
            DataType::I16 | DataType::U16 => 2,
            DataType::I32 | DataType::F32 | DataType::U32 => 4,
            DataType::F64 | DataType::I64 | DataType::U64 => 8,
        }
    }

    /// The number in `bytes`, which are [`DataType::bytes`] many.
    pub fn decode(self, bytes: &[u8], big_endian: bool) -> f64 {
        let mut word = [0u8; 8];
        let n = self.bytes();
        for (i, byte) in bytes.iter().take(n).enumerate() {
            word[if big_endian { n - 1 - i } else { i }] = *byte;
        }
        let bits = u64::from_le_bytes(word);
        match self {
            DataType::U8 | DataType::U16 | DataType::U32 | DataType::U64 => bits as f64,
            DataType::I16 => f64::from(bits as u16 as i16),
            DataType::I32 => f64::from(bits as u32 as i32),
            DataType::I64 => bits as i64 as f64,
            DataType::F32 => f64::from(f32::from_bits(bits as u32)),
            DataType::F64 => f64::from_bits(bits),
        }
    }
}

/// What a header says of the layout, and of the bands. Everything else is to be had by its lower-case key.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// Its own file.
    path: PathBuf,
    pub samples: usize,
    pub lines: usize,
    pub bands: usize,
    pub header_offset: u64,
    pub data_type: DataType,
    pub interleave: Interleave,
    pub big_endian: bool,
    /// Of each band (of each sample, in a library), nm; where the header gives them.
    pub wavelength_nm: Option<Vec<f64>>,
    /// What each spans, by its `fwhm`.
    pub spans_nm: Option<Vec<[f64; 2]>>,
    /// What `wavelength units` says.
    pub axis: Option<Unit>,
    /// What was left out or had to be guessed, in words that go on after the file's name.
    pub notes: Vec<String>,
    /// Which bands (samples of a library) `bbl` calls good; empty where it says nothing.
    good: Vec<bool>,
    scaling: Scaling,
    /// What `data units` says of the values, or the second of `z plot titles`.
    unit: Option<Stated>,
    /// Line and text by key.
    entries: BTreeMap<String, (usize, String)>,
}

/// How stored numbers become values: those of a band times its gain, plus its offset, over the factor.
#[derive(Debug, Clone, PartialEq)]
struct Scaling {
    /// One for each band (of a library: one in all, or one for each sample); empty for 1.
    gain: Vec<f64>,
    /// Likewise; empty for 0.
    offset: Vec<f64>,
    factor: f64,
}

impl Scaling {
    fn apply(&self, value: f64, band: usize) -> f64 {
        let of = |list: &[f64], otherwise: f64| match list {
            [] => otherwise,
            [one] => *one,
            several => several.get(band).copied().unwrap_or(otherwise),
        };
        (value * of(&self.gain, 1.0) + of(&self.offset, 0.0)) / self.factor
    }
}

/// Keys that change no number, or that the parser sees to elsewhere.
const KNOWN: [&str; 58] = [
    "description",
    "samples",
    "lines",
    "bands",
    "header offset",
    "file type",
    "data type",
    "interleave",
    "byte order",
    "sensor type",
    "x start",
    "y start",
    "default stretch",
    "default bands",
    "wavelength units",
    "wavelength",
    "fwhm",
    "bbl",
    "band names",
    "spectra names",
    "data ignore value",
    "data units",
    "data gain values",
    "data offset values",
    "data reflectance gain values",
    "data reflectance offset values",
    "reflectance scale factor",
    "z plot range",
    "z plot average",
    "z plot titles",
    "plot titles",
    "map info",
    "projection info",
    "coordinate system string",
    "pixel size",
    "geo points",
    "rpc info",
    "sun azimuth",
    "sun elevation",
    "solar irradiance",
    "cloud cover",
    "acquisition time",
    "security tag",
    "product type",
    "sensor id",
    "dem file",
    "dem band",
    "timestamp",
    "class names",
    "class lookup",
    "classes",
    "history",
    "file compression",
    "major frame offsets",
    "minor frame offsets",
    "complex function",
    "read procedures",
    "band name",
];

impl Header {
    pub fn get(&self, key: &str) -> Option<&str> {
        self.entries.get(key).map(|(_, text)| text.as_str())
    }

    /// A list `{ a, b }`.
    pub fn list(&self, key: &str) -> Option<Vec<&str>> {
        self.get(key).map(split_list)
    }

    /// Whether `bbl` calls a band (a sample, in a library) good, or says nothing.
    pub fn is_good(&self, band: usize) -> bool {
        self.good.get(band).is_none_or(|good| *good)
    }

    /// What to say of the bands that `bbl` calls bad, if there are any.
    pub fn bad_bands(&self) -> Option<String> {
        let bad = self.good.iter().filter(|good| !**good).count();
        (bad > 0).then(|| {
            format!("has {bad} bands that its `bbl` calls bad: they are left out, and bridged by their neighbours")
        })
    }

    /// What `data units` says of the values; where that is nothing, the second of `z plot titles`, in brackets.
    pub fn unit(&self) -> Option<&Stated> {
        self.unit.as_ref()
    }

    /// A number, where the key is there.
    /// What `data units`, or else the second of `z plot titles`, call the values.
    pub fn called(&self) -> Option<&str> {
        let of_plot = || self.list("z plot titles").and_then(|titles| titles.get(1).copied());
        self.get("data units").filter(|text| Said::in_name(text).is_some()).or_else(of_plot)
    }

    pub fn number(&self, key: &str) -> Result<Option<f64>, Box<Problem>> {
        let Some(text) = self.get(key) else { return Ok(None) };
        text.parse()
            .map(Some)
            .map_err(|_| self.problem(key, &format!("must be a number, but is `{}`", text.escape_debug())))
    }

    /// What is wrong about a key, on its line if it has one.
    pub fn problem(&self, key: &str, message: &str) -> Box<Problem> {
        let line = self.entries.get(key).map(|(line, _)| *line);
        wrong(&self.path, line, format!("`{key}` {message}"), "")
    }

    /// Whether this describes a spectral library: `lines` spectra of `samples` values.
    pub fn is_library(&self) -> bool {
        self.get("file type").is_some_and(|kind| kind.eq_ignore_ascii_case("ENVI Spectral Library"))
    }

    /// Bytes that the data file must have at least.
    pub fn data_bytes(&self) -> Option<u64> {
        let values = (self.samples as u64).checked_mul(self.lines as u64)?.checked_mul(self.bands as u64)?;
        values.checked_mul(self.data_type.bytes() as u64)?.checked_add(self.header_offset)
    }

    /// What to say of a data file of `length` bytes that has more than its header describes: it may be that of another type.
    pub fn surplus(&self, length: usize, path: &Path) -> Option<String> {
        let expected = self.data_bytes().filter(|expected| length as u64 > *expected)?;
        Some(format!(
            "has {length} bytes in {}, of which its header describes {expected}: is it the right header?",
            path.display()
        ))
    }

    /// The numbers in `bytes`, the content of the data file at `path`.
    pub fn data<'a>(&'a self, bytes: &'a [u8], path: &Path) -> Result<Data<'a>, Box<Problem>> {
        // That they can be counted was seen to when the header was read.
        let expected = self.data_bytes().unwrap_or(u64::MAX);
        if (bytes.len() as u64) < expected {
            let message = format!("has {} bytes, but its header promises {expected}", bytes.len());
            return Err(wrong(path, None, message, ""));
        }
        let missing = self.number("data ignore value")?;
        Ok(Data { header: self, bytes: &bytes[self.header_offset as usize..], missing })
    }
}

/// The numbers that a header describes.
pub struct Data<'a> {
    header: &'a Header,
    bytes: &'a [u8],
    missing: Option<f64>,
}

impl Data<'_> {
    /// The value there; `None` where the header says that there is none.
    pub fn value(&self, sample: usize, line: usize, band: usize) -> Option<f64> {
        let Header { samples, lines, bands, data_type, .. } = *self.header;
        let place = match self.header.interleave {
            Interleave::Bsq => (band * lines + line) * samples + sample,
            Interleave::Bil => (line * bands + band) * samples + sample,
            Interleave::Bip => (line * samples + sample) * bands + band,
        };
        let value = data_type.decode(&self.bytes[place * data_type.bytes()..], self.header.big_endian);
        // A number of f32 is written in a header with fewer digits than it has.
        let same = |missing: f64| match data_type {
            DataType::F32 => value as f32 == missing as f32,
            _ => value == missing,
        };
        let is_missing = self.missing.is_some_and(|missing| same(missing) || (value.is_nan() && missing.is_nan()));
        let column = if self.header.is_library() { sample } else { band };
        (!is_missing).then(|| self.header.scaling.apply(value, column))
    }
}

fn wrong(path: &Path, line: Option<usize>, message: String, help: &str) -> Box<Problem> {
    let help = (!help.is_empty()).then(|| help.to_owned());
    Box::new(Problem { file: path.to_owned(), line, message, help, ..Problem::default() })
}

fn split_list(text: &str) -> Vec<&str> {
    let inner = text.trim().trim_start_matches('{').trim_end_matches('}');
    inner.split(',').map(str::trim).filter(|item| !item.is_empty()).collect()
}

/// The header beside a data file: `name.img.hdr` or `name.hdr` with `name.img`.
pub fn header_path(data: &Path) -> Option<PathBuf> {
    let appended = {
        let mut name = data.as_os_str().to_owned();
        name.push(".hdr");
        PathBuf::from(name)
    };
    let names = [appended, data.with_extension("hdr"), data.with_extension("HDR")];
    names.into_iter().find(|path| path != data && path.is_file())
}

/// Whether a file that begins with these bytes is a header, with a byte order mark or without.
pub fn is_header(start: &[u8]) -> bool {
    start.strip_prefix("\u{feff}".as_bytes()).unwrap_or(start).starts_with(b"ENVI")
}

/// Reads a header; `path` stands in messages.
pub fn parse(bytes: &[u8], path: &Path) -> Result<Header, Box<Problem>> {
    // Also as programs of Macintosh and Windows end lines.
    let text = String::from_utf8_lossy(bytes).replace("\r\n", "\n").replace('\r', "\n");
    let wrong = |line: Option<usize>, message: String, help: &str| wrong(path, line, message, help);
    let mut lines = (1..).zip(text.lines());
    if lines.next().is_none_or(|(_, line)| line.trim_start_matches('\u{feff}').trim() != "ENVI") {
        return Err(wrong(None, "is no ENVI header: its first line is not `ENVI`".into(), ""));
    }
    let mut entries: BTreeMap<String, (usize, String)> = BTreeMap::new();
    while let Some((number, line)) = lines.next() {
        if line.trim().is_empty() || line.trim_start().starts_with(';') {
            continue;
        }
        let Some((key, value)) = line.split_once('=') else {
            let shown: String = line.chars().take(60).collect();
            return Err(wrong(Some(number), format!("`{}` is no `key = value`", shown.escape_debug()), ""));
        };
        let mut value = value.trim().to_owned();
        if value.starts_with('{') {
            while !value.contains('}') {
                let Some((_, more)) = lines.next() else {
                    return Err(wrong(Some(number), "opens a list with { that never ends".into(), "close it with }"));
                };
                if !more.trim_start().starts_with(';') {
                    value.push(' ');
                    value.push_str(more.trim());
                }
            }
        }
        let key = key.split_whitespace().collect::<Vec<_>>().join(" ").to_lowercase();
        if let Some((before, same)) = entries.get(&key)
            && *same != value
        {
            let message = format!("gives `{key}` a second time, and differently from line {before}");
            return Err(wrong(Some(number), message, "keep one of them"));
        }
        entries.insert(key, (number, value));
    }

    let mut take = |key: &str| entries.remove(key);
    let mut number = |key: &str, default: Option<u64>| match take(key) {
        Some((line, text)) => text.parse::<u64>().map(|n| (Some(line), n)).map_err(|_| {
            wrong(Some(line), format!("`{key}` must be a whole number, but is `{}`", text.escape_debug()), "")
        }),
        None => default.map(|n| (None, n)).ok_or_else(|| wrong(None, format!("lacks `{key}`"), "")),
    };
    let count = |(line, n): (Option<usize>, u64), key: &str| {
        let fits = usize::try_from(n).ok().filter(|n| *n > 0 && *n <= isize::MAX as usize);
        fits.ok_or_else(|| wrong(line, format!("`{key}` must be at least 1, but is {n}"), ""))
    };
    let samples = count(number("samples", None)?, "samples")?;
    let lines = count(number("lines", None)?, "lines")?;
    let bands = count(number("bands", Some(1))?, "bands")?;
    let (_, header_offset) = number("header offset", Some(0))?;
    let (line, code) = number("data type", None)?;
    let data_type = DataType::from_number(code).ok_or_else(|| {
        let known = "1, 2, 3, 4, 5, 12, 13, 14 or 15: numbers that are real";
        wrong(line, format!("`data type` must be {known}, but is {code}"), "")
    })?;
    let (line, order) = number("byte order", Some(0))?;
    if order > 1 {
        return Err(wrong(line, format!("`byte order` must be 0 or 1, but is {order}"), ""));
    }
    let interleave = match take("interleave") {
        None if bands == 1 => Interleave::Bsq,
        None => return Err(wrong(None, "lacks `interleave`".into(), "it is bil, bip or bsq")),
        Some((line, text)) => match text.to_lowercase().as_str() {
            "bil" => Interleave::Bil,
            "bip" => Interleave::Bip,
            "bsq" => Interleave::Bsq,
            _ => {
                let message = format!("`interleave` must be bil, bip or bsq, but is `{}`", text.escape_debug());
                return Err(wrong(line.into(), message, ""));
            }
        },
    };
    let mut header = Header {
        path: path.to_owned(),
        samples,
        lines,
        bands,
        header_offset,
        data_type,
        interleave,
        big_endian: order == 1,
        wavelength_nm: None,
        spans_nm: None,
        axis: None,
        notes: Vec::new(),
        good: Vec::new(),
        scaling: Scaling { gain: Vec::new(), offset: Vec::new(), factor: 1.0 },
        unit: None,
        entries: BTreeMap::new(),
    };
    if header.data_bytes().is_none() {
        return Err(wrong(None, "describes an image of more bytes than can be counted".into(), ""));
    }
    header.entries = entries;
    header.refuse_what_is_not_applied()?;
    header.find_wavelengths()?;
    header.find_scaling()?;
    header.find_unit()?;
    header.tell_what_is_left_out();
    Ok(header)
}

impl Header {
    /// Bands of an image, samples of a library: what lists have an entry for.
    fn places(&self) -> usize {
        if self.is_library() { self.samples } else { self.bands }
    }

    /// Statements without which the numbers are others, and that nothing here applies.
    fn refuse_what_is_not_applied(&self) -> Result<(), Box<Problem>> {
        let refuse = |key: &str| Err(self.problem(key, "is not applied: save the file without it"));
        if self.get("file compression").is_some_and(|text| text.trim() != "0") {
            return Err(self.problem("file compression", "says that the data are compressed: save them uncompressed"));
        }
        for key in ["major frame offsets", "minor frame offsets"] {
            if self.list(key).unwrap_or_default().iter().any(|item| item.parse() != Ok(0)) {
                return refuse(key);
            }
        }
        // Keys that programs add of their own, such as `scale factor`, nobody else applies.
        let scales = |key: &str| FACTORS.iter().any(|word| key.contains(word));
        let is_one = |text: &str| split_list(text).iter().all(|number| number.parse() == Ok(1.0));
        let is_zero = |text: &str| split_list(text).iter().all(|number| number.parse() == Ok(0.0));
        let has = |key: &str, words: &[&str]| words.iter().any(|word| key.contains(word));
        // What says in what the values are, beside `data units`.
        let is_other_unit = |key: &str, text: &str| {
            let words: Vec<&str> = key.split(' ').collect();
            let of_values = match words[..] {
                ["unit" | "units"] => true,
                [of, "unit" | "units"] => {
                    ["radiance", "irradiance", "reflectance", "spectra", "value", "values", "y", "intensity"]
                        .contains(&of)
                }
                _ => false,
            };
            let is_own = unit::parse(text)
                .is_some_and(|measure| measure.is_own() || measure.is_number() && measure.factor == 1.0);
            of_values && !is_own && self.get("data units") != Some(text)
        };
        let changes = |key: &str, text: &str| match key {
            _ if text.trim().is_empty() => false,
            _ if scales(key) || key.contains("coefficient") => !is_one(text),
            _ if has(key, &["offset", "shift", "intercept"]) => !is_zero(text),
            "wavelength medium" => !["vacuum", "vac"].contains(&text.trim().to_lowercase().as_str()),
            _ if has(key, &["no data", "nodata", "ignore value", "fill value", "missing value", "bad band"]) => true,
            "background" | "bias" => true,
            _ => is_other_unit(key, text),
        };
        let own = |(key, (_, text)): &(&String, &(usize, String))| !KNOWN.contains(&key.as_str()) && changes(key, text);
        if let Some((key, _)) = self.entries.iter().find(own) {
            return refuse(key);
        }
        if self.entries.contains_key("read procedures") {
            return refuse("read procedures");
        }
        if let Some(kind) = self.get("file type") {
            let lower = kind.trim().to_lowercase();
            let plain = lower.is_empty()
                || ["envi", "envi standard", "standard", "envi spectral library", "unknown"].contains(&lower.as_str());
            if !plain {
                let message = format!("must be ENVI Standard or ENVI Spectral Library, but is {}", kind.escape_debug());
                return Err(self.problem("file type", &message));
            }
        }
        Ok(())
    }

    fn tell_what_is_left_out(&mut self) {
        let known = |key: &&String| !KNOWN.contains(&key.as_str());
        let unknown: Vec<&str> = self.entries.keys().filter(known).map(String::as_str).collect();
        if !unknown.is_empty() {
            self.notes.push(format!("has a header with keys that are not known, and left out: {}", unknown.join(", ")));
        }
    }

    /// The numbers of a list, where the key is there: one for each of `counts`' numbers of things.
    fn numbers(&self, key: &str, counts: &[usize]) -> Result<Option<Vec<f64>>, Box<Problem>> {
        let Some(items) = self.list(key) else { return Ok(None) };
        let numbers: Option<Vec<f64>> =
            items.iter().map(|item| item.parse().ok().filter(|v: &f64| v.is_finite())).collect();
        match numbers {
            Some(numbers) if counts.contains(&numbers.len()) => Ok(Some(numbers)),
            Some(numbers) => {
                let expected = counts.iter().map(usize::to_string).collect::<Vec<_>>().join(" or ");
                Err(self.problem(key, &format!("must list {expected} numbers, but lists {}", numbers.len())))
            }
            None => Err(self.problem(key, "must list numbers")),
        }
    }

    fn find_wavelengths(&mut self) -> Result<(), Box<Problem>> {
        let places = self.places();
        let stated = self.get("wavelength units").map(str::trim).filter(|text| !text.is_empty());
        self.axis = match stated.filter(|text| !text.eq_ignore_ascii_case("unknown")) {
            None => None,
            Some(text) => Some(Unit::named(text).ok_or_else(|| {
                let message = format!(
                    "must be Nanometers, Micrometers, Wavenumber or another unit of a spectrum, but is `{}`",
                    text.to_lowercase().escape_debug()
                );
                self.problem("wavelength units", &message)
            })?),
        };
        let Some(items) = self.list("wavelength") else { return Ok(()) };
        let parsed: Option<Vec<f64>> =
            items.iter().map(|item| item.parse().ok().filter(|v: &f64| v.is_finite() && *v > 0.0)).collect();
        let Some(values) = parsed.filter(|values| values.len() == places) else {
            let of = if self.is_library() { "samples" } else { "bands" };
            let message = format!("must have a number for each of {places} {of}, above 0, but lists {}", items.len());
            return Err(self.problem("wavelength", &message));
        };
        let unit = self.axis.unwrap_or_else(|| {
            let unit =
                if values.iter().all(|v| *v < unit::MICROMETRES_BELOW) { Unit::MICROMETRE } else { Unit::NANOMETRE };
            let name = if unit == Unit::MICROMETRE { "um" } else { "nm" };
            self.notes.push(format!("does not say in what its wavelengths are: they are taken as {name}"));
            unit
        });
        self.wavelength_nm = Some(values.iter().map(|v| unit.to_nm(*v)).collect());
        let widths = self.numbers("fwhm", &[places])?;
        self.spans_nm = widths.filter(|widths| widths.iter().all(|width| *width > 0.0)).map(|widths| {
            let span = |(x, width): (&f64, &f64)| [unit.to_nm(x - 0.5 * width), unit.to_nm(x + 0.5 * width)];
            values.iter().zip(&widths).map(span).collect()
        });
        Ok(())
    }

    fn find_unit(&mut self) -> Result<(), Box<Problem>> {
        let of_data = self.get("data units").map(str::trim).filter(|text| !text.is_empty());
        let unknown = |text: &str| Stated { meaning: Meaning::Unknown, text: text.to_owned(), certain: true };
        let in_name = |text: &str| Stated::in_name(text).filter(|stated| stated.meaning != Meaning::Unknown);
        let of_data = of_data.map(|text| Stated::of(text).or_else(|| in_name(text)).unwrap_or_else(|| unknown(text)));
        let of_plot = self.list("z plot titles").and_then(|titles| Stated::in_name(titles.get(1)?));
        if let (Some(data), Some(plot)) = (&of_data, &of_plot)
            && let (Meaning::Unit(a), Meaning::Unit(b)) = (data.meaning, plot.meaning)
            && !(a.powers == b.powers && (a.factor / b.factor - 1.0).abs() < 1e-9)
        {
            let (plot, data) = (shown(&plot.text), shown(&data.text));
            let message = format!("says `{plot}` of the values, but `data units` says `{data}`: correct one of them");
            return Err(self.problem("z plot titles", &message));
        }
        let is_known = |stated: &Stated| stated.meaning != Meaning::Unknown;
        self.unit = match (of_data, of_plot) {
            (Some(data), Some(plot)) if !is_known(&data) && is_known(&plot) => Some(plot),
            (data, plot) => data.or(plot),
        };
        Ok(())
    }

    fn find_scaling(&mut self) -> Result<(), Box<Problem>> {
        let places = self.places();
        // A library is one band to who wrote it, or has a number for every sample.
        let counts = if self.is_library() { vec![1, places] } else { vec![places] };
        self.good = self.numbers("bbl", &[places])?.unwrap_or_default().iter().map(|good| *good != 0.0).collect();
        let gain = self.numbers("data gain values", &counts)?.unwrap_or_default();
        let offset = self.numbers("data offset values", &counts)?.unwrap_or_default();
        let factor = match self.number("reflectance scale factor")? {
            None => 1.0,
            Some(scale) if scale.is_finite() && scale > 0.0 => scale,
            Some(scale) => {
                return Err(self.problem("reflectance scale factor", &format!("must be above 0, but is {scale}")));
            }
        };
        let scales = gain.iter().any(|v| *v != 1.0) || offset.iter().any(|v| *v != 0.0);
        if scales && factor != 1.0 {
            return Err(
                self.problem("reflectance scale factor", "and `data gain values` are two scales for the same numbers")
            );
        }
        if self.is_library() && self.entries.contains_key("data reflectance gain values") {
            return Err(self.problem("data reflectance gain values", "is not applied: scale the library by it"));
        }
        self.scaling = Scaling { gain, offset, factor };
        Ok(())
    }
}

#[cfg(test)]
mod tests;
