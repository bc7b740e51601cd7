//! GeoTIFF (TIFF 6.0; BigTIFF beyond 4 GB; OGC 19-008r4): floating-point numbers of 32 bits or counts of 16 and 32, uncompressed, one band after the other, with the names and
//! wavelengths of the bands as GDAL keeps them.

use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::envi::Pieces;
use super::{Progress, check_space, long_name, units};
use crate::cube::View;
use crate::files::output::{Product, Replacement};
use crate::{Error, Result};

/// What [`write`] writes. Bands lie one after the other: no pipe takes it.
pub const IMAGE: Product =
    Product { name: "a TIFF image", extensions: &["tif", "tiff"], is_stream: false, is_folder: false, check: is_tiff };

fn is_tiff(path: &Path) -> std::result::Result<(), String> {
    let mut head = [0; 4];
    let read = std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut head));
    read.map_err(|error| format!("cannot be read ({error})"))?;
    if [[b'I', b'I', 42, 0], [b'I', b'I', 43, 0]].contains(&head) {
        Ok(())
    } else {
        Err("does not begin like one".into())
    }
}

/// Samples a pixel that a TIFF can have.
const MOST_BANDS: usize = u16::MAX as usize;

/// Values of a tag.
enum Field {
    Text(String),
    Short(Vec<u16>),
    Long(Vec<u64>),
    Double(Vec<f64>),
}

impl Field {
    /// The number of its type, how many there are, and their bytes.
    fn encode(&self, is_big: bool) -> (u16, usize, Vec<u8>) {
        match self {
            Field::Text(text) => {
                let bytes: Vec<u8> = text.bytes().chain([0]).collect();
                (2, bytes.len(), bytes)
            }
            Field::Short(all) => (3, all.len(), all.iter().flat_map(|v| v.to_le_bytes()).collect()),
            Field::Long(all) if is_big => (16, all.len(), all.iter().flat_map(|v| v.to_le_bytes()).collect()),
            Field::Long(all) => (4, all.len(), all.iter().flat_map(|&v| (v as u32).to_le_bytes()).collect()),
            Field::Double(all) => (12, all.len(), all.iter().flat_map(|v| v.to_le_bytes()).collect()),
        }
    }
}

pub fn write(view: &View, path: &Path, progress: &mut Progress) -> Result<Vec<PathBuf>> {
    let bands = view.channels().len();
    if bands > MOST_BANDS {
        let what = format!("a TIFF has {MOST_BANDS} bands at most, not {bands}; choose some with --bands");
        return Err(Error::Usage(format!("{}: {what}", path.display())));
    }
    if let Some((crs, _)) = view.georeference().filter(|(crs, _)| !crs.starts_with("EPSG:")) {
        let name: String = crs.chars().take(40).collect();
        let what = format!(
            "a GeoTIFF needs the number of its reference system, and the scene has {name}…: write \
             georeference.crs = \"EPSG:…\", or export to ENVI or Zarr"
        );
        return Err(Error::Usage(format!("{}: {what}", path.display())));
    }
    check_space(path, view.bytes())?;
    let is_big = view.bytes() > u64::from(u32::MAX) - (64 << 20);
    let head = head(view, is_big);
    let mut replacement = Replacement::create(path, IMAGE)?;
    let written = replacement.file().write_all(&head);
    written.map_err(|error| replacement.failed(&error))?;
    let (begin, missing) = (head.len() as u64, f32::NAN);
    let mut pieces =
        Pieces { view, reader: view.reader(), file: &mut replacement, values: Vec::new(), progress, missing, begin };
    pieces.by_band()?;
    let ended = replacement.file().seek(SeekFrom::End(0));
    ended.map_err(|error| replacement.failed(&error))?;
    replacement.finish()?;
    Ok(vec![path.to_owned()])
}

/// All that comes before the numbers.
fn head(view: &View, is_big: bool) -> Vec<u8> {
    // Where numbers begin decides what stands in the head, but not how long it is.
    let mut length = 0;
    loop {
        let bytes = head_before(view, is_big, length);
        if bytes.len() as u64 == length {
            return bytes;
        }
        length = bytes.len() as u64;
    }
}

fn head_before(view: &View, is_big: bool, begin: u64) -> Vec<u8> {
    let ([width, height], bands) = (view.size().map(u64::from), view.channels().len());
    // A few lines together, so that a reader takes a piece of a band.
    let integers = view.integers();
    let each = if integers.is_some_and(|integers| integers.is_short) { 2 } else { 4 };
    let rows = (((1 << 20) / (each * width)).max(1)).min(height);
    let strips = height.div_ceil(rows);
    let line = each * width;
    let strip = |i: u64| (i / strips, (i % strips) * rows);
    let offset = |i: u64| {
        let (band, row) = strip(i);
        begin + (band * height + row) * line
    };
    let bytes = |i: u64| rows.min(height - strip(i).1) * line;
    let all = || 0..strips * bands as u64;
    let mut tags = vec![
        (256, Field::Long(vec![width])),
        (257, Field::Long(vec![height])),
        (258, Field::Short(vec![8 * each as u16; bands])),
        // No compression; the least is black.
        (259, Field::Short(vec![1])),
        (262, Field::Short(vec![1])),
        (270, Field::Text(format!("{}, {}", long_name(view), units(view)))),
        (273, Field::Long(all().map(offset).collect())),
        (277, Field::Short(vec![bands as u16])),
        (278, Field::Long(vec![rows])),
        (279, Field::Long(all().map(bytes).collect())),
        // One band after the other.
        (284, Field::Short(vec![2])),
        (305, Field::Text(format!("Spectile {}", env!("CARGO_PKG_VERSION")))),
    ];
    if bands > 1 {
        tags.push((338, Field::Short(vec![0; bands - 1])));
    }
    // Whole numbers, or floating point.
    tags.push((339, Field::Short(vec![if integers.is_some() { 1 } else { 3 }; bands])));
    if let Some((crs, [a, b, c, d, e, f])) = view.georeference() {
        let (is_upright, is_down) = (b == 0.0 && d == 0.0, a > 0.0 && e < 0.0);
        if is_upright && is_down {
            tags.push((33550, Field::Double(vec![a, -e, 0.0])));
            tags.push((33922, Field::Double(vec![0.0, 0.0, 0.0, c, f, 0.0])));
        } else {
            let matrix = vec![a, b, 0.0, c, d, e, 0.0, f, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
            tags.push((34264, Field::Double(matrix)));
        }
        let code: u16 = crs.strip_prefix("EPSG:").and_then(|code| code.parse().ok()).unwrap_or_default();
        // Geographic systems have these numbers.
        let [model, key] = if (4000..5000).contains(&code) { [2, 2048] } else { [1, 3072] };
        // Version 1.1.0 and three keys: the kind of system, pixels as areas, which it is.
        let keys = vec![1, 1, 0, 3, 1024, 0, 1, model, 1025, 0, 1, 1, key, 0, 1, code];
        tags.push((34735, Field::Short(keys)));
    }
    tags.push((42112, Field::Text(metadata(view))));
    let missing = integers.map_or("nan".into(), |integers| integers.missing.to_string());
    tags.push((42113, Field::Text(missing)));

    let (word, header) = if is_big { (8, 16) } else { (4, 8) };
    let entry = if is_big { 20 } else { 12 };
    let mut bytes = if is_big { vec![b'I', b'I', 43, 0, 8, 0, 0, 0] } else { vec![b'I', b'I', 42, 0] };
    let number = |bytes: &mut Vec<u8>, value: u64| bytes.extend(&value.to_le_bytes()[..word]);
    number(&mut bytes, header);
    if is_big {
        bytes.extend((tags.len() as u64).to_le_bytes());
    } else {
        bytes.extend((tags.len() as u16).to_le_bytes());
    }
    let mut more = Vec::new();
    let data = bytes.len() + tags.len() * entry + word;
    for (tag, field) in &tags {
        let (kind, count, values) = field.encode(is_big);
        bytes.extend((*tag as u16).to_le_bytes());
        bytes.extend(kind.to_le_bytes());
        number(&mut bytes, count as u64);
        if values.len() <= word {
            bytes.extend(&values);
            bytes.extend(vec![0; word - values.len()]);
        } else {
            number(&mut bytes, (data + more.len()) as u64);
            more.extend(&values);
            more.resize(more.len().next_multiple_of(8), 0);
        }
    }
    number(&mut bytes, 0);
    bytes.extend(more);
    // Numbers begin on whole ones.
    bytes.resize(bytes.len().next_multiple_of(16), 0);
    bytes
}

/// As GDAL keeps what TIFF has no word for.
fn metadata(view: &View) -> String {
    let channels = view.channels();
    let plain =
        |text: &str| text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;");
    let mut text = String::from("<GDALMetadata>\n");
    for (k, name) in channels.names.iter().enumerate() {
        let item = |name: &str, more: &str, value: &str| {
            format!("  <Item name=\"{name}\" sample=\"{k}\"{more}>{}</Item>\n", plain(value))
        };
        text += &item("DESCRIPTION", " role=\"description\"", name);
        text += &item("UNITTYPE", " role=\"unittype\"", units(view));
        text += &item("wavelength", "", &channels.centre(k).to_string());
        text += &item("wavelength_units", "", "Nanometers");
        text += &item("fwhm", "", &channels.fwhm(k).to_string());
    }
    text + "</GDALMetadata>\n"
}
