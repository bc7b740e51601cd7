//! Statistics of bands: a line of CSV for each.

use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};

use super::{PIECE_BYTES, Progress, units};
use crate::Result;
use crate::cube::{Rect, Strides, View};
use crate::files::output::{Product, Replacement};
use crate::format::csv_table::Table;

const COLUMNS: [&str; 9] =
    ["band", "wavelength_nm", "width_nm", "unit", "pixels", "minimum", "maximum", "mean", "standard_deviation"];

/// What [`write`] writes.
pub const TABLE: Product = Product {
    name: "a table of statistics that `export --statistics` wrote",
    extensions: &["csv"],
    is_stream: true,
    is_folder: false,
    check: is_table,
};

fn is_table(path: &Path) -> std::result::Result<(), String> {
    let unreadable = |error: std::io::Error| format!("cannot be read as text ({error})");
    let mut first = String::new();
    BufReader::new(File::open(path).map_err(unreadable)?).read_line(&mut first).map_err(unreadable)?;
    if first.trim_end() == COLUMNS.join(",") { Ok(()) } else { Err("does not begin with its columns".into()) }
}

/// Of the values of a band that are there.
#[derive(Clone, Copy)]
struct Sums {
    count: u64,
    least: f32,
    greatest: f32,
    /// Mean, and the sum of squared distances from it (Welford 1962).
    mean: f64,
    spread: f64,
}

impl Sums {
    const NONE: Sums = Sums { count: 0, least: f32::INFINITY, greatest: f32::NEG_INFINITY, mean: 0.0, spread: 0.0 };

    fn add(&mut self, value: f32) {
        if value.is_nan() {
            return;
        }
        self.count += 1;
        self.least = self.least.min(value);
        self.greatest = self.greatest.max(value);
        let distance = f64::from(value) - self.mean;
        self.mean += distance / self.count as f64;
        self.spread += distance * (f64::from(value) - self.mean);
    }
}

/// Of bands without a pixel only the number, 0; of those with one no deviation.
pub fn write(view: &View, path: &Path, progress: &mut Progress) -> Result<Vec<PathBuf>> {
    let (channels, rect) = (view.channels(), view.rect());
    let (bands, mut reader) = (channels.len(), view.reader());
    let mut sums = vec![Sums::NONE; bands];
    let mut values = Vec::new();
    let together = (PIECE_BYTES / (4 * bands)).clamp(1, rect.width() as usize) as u32;
    for y in rect.y0..rect.y1 {
        for x0 in (rect.x0..rect.x1).step_by(together as usize) {
            let x1 = (x0 + together).min(rect.x1);
            values.resize((x1 - x0) as usize * bands, 0.0);
            let strides = Strides { row: 0, pixel: bands, band: 1 };
            reader.read(Rect { x0, x1, y0: y, y1: y + 1 }, 0..bands, strides, &mut values)?;
            for spectrum in values.chunks_exact(bands) {
                sums.iter_mut().zip(spectrum).for_each(|(sums, &value)| sums.add(value));
            }
        }
        progress(u64::from(y + 1 - rect.y0) * u64::from(rect.width()), rect.pixels())?;
    }
    let mut table = Table::new(COLUMNS);
    for (k, sums) in sums.iter().enumerate() {
        let some = |is_there: bool, number: String| if is_there { number } else { String::new() };
        let deviation = (sums.spread / (sums.count.max(2) - 1) as f64).sqrt();
        table.row([
            channels.names[k].clone(),
            channels.centre(k).to_string(),
            channels.fwhm(k).to_string(),
            units(view).to_owned(),
            sums.count.to_string(),
            some(sums.count > 0, format!("{:?}", sums.least)),
            some(sums.count > 0, format!("{:?}", sums.greatest)),
            some(sums.count > 0, format!("{:?}", sums.mean)),
            some(sums.count > 1, format!("{deviation:?}")),
        ]);
    }
    let text = table.finish();
    let mut replacement = Replacement::create(path, TABLE)?;
    let written = replacement.file().write_all(text.as_bytes());
    written.map_err(|error| replacement.failed(&error))?;
    replacement.finish()?;
    Ok(vec![path.to_owned()])
}
