//! Headers of images that Spectile writes.

use std::fmt::Write;

use super::{DataType, Interleave};

/// What a header of an image that Spectile writes says.
pub struct Image<'a> {
    pub description: &'a str,
    /// Columns, lines and bands.
    pub size: [usize; 3],
    pub interleave: Interleave,
    pub data_type: DataType,
    pub units: &'a str,
    /// The value of what is not rendered.
    pub ignore: f64,
    /// Column and line of the first pixel in the whole picture, from 0.
    pub origin: [u32; 2],
    /// Bands, from 0, shown as red, green and blue.
    pub default_bands: Option<[usize; 3]>,
    /// Empty where bands are none of wavelength.
    pub wavelength_nm: Vec<f64>,
    pub fwhm_nm: Vec<f64>,
    pub names: Vec<String>,
    /// The coordinate reference system, and the affine transform from pixels to there ([`map_info`]).
    pub map: Option<(&'a str, [f64; 6])>,
}

/// What `map info` says of an affine transform (a x + b y + c, d x + e y + f of x, y in pixels from the top left corner): a grid of squares
/// or rectangles with its first line at the top, turned. `None` where it is mirrored or sheared, or turned and not of squares.
pub fn map_info(crs: &str, [a, b, c, d, e, f]: [f64; 6]) -> Option<String> {
    let (width, height) = (a.hypot(d), b.hypot(e));
    let is_small = |value: f64| value.abs() <= 1e-9 * width.max(height);
    // Rows run to the right of columns' left: (a, d) turned by -90 degrees is (d, -a).
    let is_grid = is_small(b / height * width - d) && is_small(e / height * width + a);
    // As GDAL reads it: columns run along (cos, sin).
    let turned = d.atan2(a).to_degrees();
    let is_turned = !is_small(d);
    if !is_grid || (is_turned && !is_small(width - height)) {
        return None;
    }
    let code = crs.strip_prefix("EPSG:").and_then(|code| code.parse::<u32>().ok());
    let utm = |zone: u32, half: &str| ("UTM", format!(", {zone}, {half}, WGS-84, units=Meters"));
    let (projection, datum) = match code {
        Some(code @ 32601..=32660) => utm(code - 32600, "North"),
        Some(code @ 32701..=32760) => utm(code - 32700, "South"),
        Some(4326) => ("Geographic Lat/Lon", ", WGS-84, units=Degrees".to_owned()),
        _ => ("Arbitrary", String::new()),
    };
    let rotation = if is_turned { format!(", rotation={turned}") } else { String::new() };
    Some(format!("{{ {projection}, 1, 1, {c}, {f}, {width}, {height}{datum}{rotation} }}"))
}

impl Image<'_> {
    /// The text of the header.
    pub fn header(&self) -> String {
        let mut text = String::from("ENVI\n");
        let mut entry = |key: &str, value: &str| {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{key} = {value}");
        };
        let list = |items: &mut dyn Iterator<Item = String>| in_lines(items);
        let numbers = |values: &[f64]| list(&mut values.iter().map(f64::to_string));
        let [samples, lines, bands] = self.size;
        entry("description", &format!("{{ {} }}", plain(self.description)));
        entry("samples", &samples.to_string());
        entry("lines", &lines.to_string());
        entry("bands", &bands.to_string());
        entry("header offset", "0");
        entry("file type", "ENVI Standard");
        entry("data type", &self.data_type.number().to_string());
        entry("interleave", self.interleave.name());
        entry("byte order", "0");
        if self.origin != [0, 0] {
            entry("x start", &(self.origin[0] + 1).to_string());
            entry("y start", &(self.origin[1] + 1).to_string());
        }
        entry("data ignore value", &self.ignore.to_string());
        entry("data units", self.units);
        if !self.wavelength_nm.is_empty() {
            entry("wavelength units", "Nanometers");
        }
        if let Some(shown) = self.default_bands {
            entry("default bands", &list(&mut shown.iter().map(|band| (band + 1).to_string())));
        }
        if !self.wavelength_nm.is_empty() {
            entry("wavelength", &numbers(&self.wavelength_nm));
            entry("fwhm", &numbers(&self.fwhm_nm));
        }
        entry("bbl", &list(&mut (0..bands).map(|_| "1".to_owned())));
        if let Some((crs, affine)) = self.map {
            if let Some(info) = map_info(crs, affine) {
                entry("map info", &info);
            }
            if !crs.starts_with("EPSG:") {
                entry("coordinate system string", &format!("{{{crs}}}"));
            }
        }
        entry("band names", &list(&mut self.names.iter().map(|name| plain(name))));
        text
    }
}

/// A list in lines. GDAL, and so QGIS and rasterio, reads no further in a header than to the first line of 10,000 characters.
fn in_lines(items: &mut dyn Iterator<Item = String>) -> String {
    const WIDTH: usize = 100;
    let mut text = String::from("{");
    let mut length = WIDTH;
    for (i, item) in items.enumerate() {
        text += if i > 0 { "," } else { "" };
        if length + item.len() > WIDTH {
            text.push('\n');
            length = 0;
        }
        text += " ";
        text += &item;
        length += item.len() + 2;
    }
    text + " }"
}

/// Without what would end a list or an item of one.
fn plain(text: &str) -> String {
    text.chars().map(|c| if matches!(c, ',' | '{' | '}' | '\n' | '\r' | ';') { ' ' } else { c }).collect()
}
