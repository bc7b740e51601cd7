//! ENVI rasters: a text header and a file of raw numbers.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use super::{Content, Map, checked_size, nanometres, spectral, whole, with_help};
use crate::error::Problem;

/// The header of the data file at `path`: its name with `.hdr` added, or instead of its extension.
pub fn header_of(path: &Path) -> Option<PathBuf> {
    let mut added = path.as_os_str().to_owned();
    added.push(".hdr");
    let is_header = |candidate: &PathBuf| {
        candidate != path && std::fs::read(candidate).is_ok_and(|bytes| bytes.starts_with(b"ENVI"))
    };
    [PathBuf::from(added), path.with_extension("hdr")].into_iter().find(is_header)
}

/// The data file of the header at `path`.
fn data_of(path: &Path) -> Option<PathBuf> {
    let bare = path.with_extension("");
    let names = ["img", "dat", "bil", "bip", "bsq", "raw"].map(|extension| bare.with_extension(extension));
    std::iter::once(bare).chain(names).find(|name| name.is_file())
}

/// The raster of the header at `path`; `data` is its file of numbers, where that is known.
pub fn read_header(path: &Path, data: Option<&Path>) -> Result<Map, Box<Problem>> {
    let bytes = std::fs::read(path).map_err(|e| whole(path, format!("cannot be read: {e}")))?;
    let header = Header { path, fields: fields(&String::from_utf8_lossy(&bytes)) };
    let data = match data {
        Some(data) => data.to_owned(),
        None => data_of(path).ok_or_else(|| {
            let name = path.with_extension("").display().to_string();
            with_help(path, "is an ENVI header without its data".to_owned(), &format!("put {name}.img beside it"))
        })?,
    };
    let (samples, lines, bands) = (header.count("samples")?, header.count("lines")?, header.count("bands")?);
    let size = checked_size(path, samples, lines)?;
    let nm = header.wavelengths(bands)?;
    let format = Format::of(header.choice("data type")?).ok_or_else(|| {
        header.problem("data type", "must be 1, 2, 3, 4, 5, 12, 13, 14 or 15: numbers that are real".to_owned())
    })?;
    let big_endian = match header.get("byte order") {
        None | Some("0") => false,
        Some("1") => true,
        Some(_) => return Err(header.problem("byte order", "must be 0 or 1".to_owned())),
    };
    let offset = if header.get("header offset").is_some() { header.count("header offset")? } else { 0 };

    // In f64 no file makes these overflow.
    let expected = samples as f64 * lines as f64 * bands as f64 * format.bytes() as f64 + offset as f64;
    let bytes = std::fs::read(&data).map_err(|e| whole(&data, format!("cannot be read: {e}")))?;
    if (bytes.len() as f64) < expected {
        let message = format!("has {} bytes, but its header promises {expected}", bytes.len());
        return Err(whole(&data, message));
    }
    let numbers = &bytes[offset as usize..];
    let (samples, lines, bands) = (samples as usize, lines as usize, bands as usize);
    // Where a number stands among the others.
    let place: fn(usize, usize, usize, [usize; 3]) -> usize = match header.choice("interleave")? {
        "bsq" => |band, line, sample, [samples, lines, _]| (band * lines + line) * samples + sample,
        "bil" => |band, line, sample, [samples, _, bands]| (line * bands + band) * samples + sample,
        "bip" => |band, line, sample, [samples, _, bands]| (line * samples + sample) * bands + band,
        _ => return Err(header.problem("interleave", "must be bsq, bil or bip".to_owned())),
    };
    let ignored = match header.get("data ignore value") {
        Some(text) => {
            Some(text.parse::<f64>().map_err(|_| header.problem("data ignore value", "is no number".into()))?)
        }
        None => None,
    };
    let mut planes = vec![Vec::with_capacity(samples * lines); bands];
    for (band, plane) in planes.iter_mut().enumerate() {
        for line in 0..lines {
            for sample in 0..samples {
                let at = place(band, line, sample, [samples, lines, bands]) * format.bytes();
                let value = format.number(&numbers[at..at + format.bytes()], big_endian);
                if ignored == Some(value) {
                    let message = format!("has no value at column {sample}, row {line} of band {}", band + 1);
                    return Err(with_help(&data, message, "fill the gaps: light comes from every direction"));
                }
                plane.push(value as f32);
            }
        }
    }
    let planes: Vec<&[f32]> = planes.iter().map(Vec::as_slice).collect();
    let content: Content = spectral(path, &nm, &planes)?;
    Ok(Map { size, content, warnings: Vec::new() })
}

/// The header's keys, in lower case, each with its line and value.
type Fields = HashMap<String, (usize, String)>;

struct Header<'a> {
    path: &'a Path,
    fields: Fields,
}

impl Header<'_> {
    fn get(&self, key: &str) -> Option<&str> {
        self.fields.get(key).map(|(_, value)| value.as_str())
    }

    fn choice(&self, key: &str) -> Result<&str, Box<Problem>> {
        self.get(key).ok_or_else(|| whole(self.path, format!("lacks `{key}`")))
    }

    fn count(&self, key: &str) -> Result<u64, Box<Problem>> {
        let text = self.choice(key)?;
        text.parse().map_err(|_| self.problem(key, format!("must be a whole number, but is {text}")))
    }

    fn problem(&self, key: &str, message: String) -> Box<Problem> {
        let line = self.fields.get(key).map(|(line, _)| *line);
        Box::new(Problem { line, ..*whole(self.path, format!("`{key}` {message}")) })
    }

    /// Centres of the bands in nm.
    fn wavelengths(&self, bands: u64) -> Result<Vec<f64>, Box<Problem>> {
        let list = self.choice("wavelength")?;
        let unit = self.choice("wavelength units")?;
        let nm = nanometres(unit)
            .ok_or_else(|| self.problem("wavelength units", format!("must be nm, um, mm or m, but is {unit}")))?;
        let numbers: Result<Vec<f64>, _> = list.split(',').map(|text| text.trim().parse::<f64>()).collect();
        let numbers = numbers.map_err(|_| self.problem("wavelength", "must be numbers".to_owned()))?;
        if numbers.len() as u64 != bands || bands == 0 {
            return Err(self.problem("wavelength", format!("must have a number for each of {bands} bands")));
        }
        Ok(numbers.into_iter().map(|number| number * nm).collect())
    }
}

/// `key = value` lines; a value in braces may go on over several.
fn fields(text: &str) -> Fields {
    let mut fields = Fields::new();
    let mut lines = text.lines().enumerate().skip(1);
    while let Some((number, line)) = lines.next() {
        let Some((key, value)) = line.split_once('=').filter(|_| !line.trim_start().starts_with(';')) else { continue };
        let mut value = value.trim().to_owned();
        if let Some(list) = value.strip_prefix('{') {
            let mut list = list.to_owned();
            while !list.contains('}') {
                let Some((_, more)) = lines.next() else { break };
                list.push('\n');
                list.push_str(more);
            }
            value = list.split('}').next().unwrap_or("").trim().to_owned();
        }
        let key = key.split_whitespace().collect::<Vec<_>>().join(" ").to_lowercase();
        fields.insert(key, (number + 1, value));
    }
    fields
}

/// How a number is stored.
#[derive(Clone, Copy)]
enum Format {
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

impl Format {
    fn of(code: &str) -> Option<Format> {
        Some(match code {
            "1" => Format::U8,
            "2" => Format::I16,
            "3" => Format::I32,
            "4" => Format::F32,
            "5" => Format::F64,
            "12" => Format::U16,
            "13" => Format::U32,
            "14" => Format::I64,
            "15" => Format::U64,
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Format::U8 => 1,
            Format::I16 | Format::U16 => 2,
            Format::I32 | Format::U32 | Format::F32 => 4,
            Format::F64 | Format::I64 | Format::U64 => 8,
        }
    }

    fn number(self, bytes: &[u8], big_endian: bool) -> f64 {
        fn ordered<const N: usize>(bytes: &[u8], big_endian: bool) -> [u8; N] {
            std::array::from_fn(|i| bytes[if big_endian { N - 1 - i } else { i }])
        }
        match self {
            Format::U8 => f64::from(bytes[0]),
            Format::I16 => f64::from(i16::from_le_bytes(ordered(bytes, big_endian))),
            Format::U16 => f64::from(u16::from_le_bytes(ordered(bytes, big_endian))),
            Format::I32 => f64::from(i32::from_le_bytes(ordered(bytes, big_endian))),
            Format::U32 => f64::from(u32::from_le_bytes(ordered(bytes, big_endian))),
            Format::F32 => f64::from(f32::from_le_bytes(ordered(bytes, big_endian))),
            Format::F64 => f64::from_le_bytes(ordered(bytes, big_endian)),
            Format::I64 => i64::from_le_bytes(ordered(bytes, big_endian)) as f64,
            Format::U64 => u64::from_le_bytes(ordered(bytes, big_endian)) as f64,
        }
    }
}
