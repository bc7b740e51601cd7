//! CSV: a line a pixel, a column a band.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};

use super::{PIECE_BYTES, Progress};
use crate::Result;
use crate::cube::{Rect, Strides, View};
use crate::files::output::{Product, Replacement};

/// What [`write`] writes.
pub const TABLE: Product = Product {
    name: "a table of spectra as CSV",
    extensions: &["csv", "txt"],
    is_stream: true,
    is_folder: false,
    check: is_table,
};

/// Whether the first lines are the header `x,y,…` and a pixel.
fn is_table(path: &Path) -> std::result::Result<(), String> {
    let unreadable = |error: std::io::Error| format!("cannot be read as text ({error})");
    let mut lines = BufReader::new(File::open(path).map_err(unreadable)?).lines();
    let mut next = || lines.next().transpose().map_err(unreadable);
    let header = next()?.unwrap_or_default();
    if !header.starts_with("x,y,") {
        return Err("does not begin with the columns x and y".into());
    }
    // Names may hold commas in quotation marks; a pixel has numbers alone.
    let is_pixel = |line: &str| {
        let mut cells = line.split(',');
        let is_position = (0..2).all(|_| cells.next().is_some_and(|cell| cell.parse::<u32>().is_ok()));
        is_position && cells.all(|cell| cell.is_empty() || cell.parse::<f32>().is_ok())
    };
    match next()? {
        Some(line) if is_pixel(&line) => Ok(()),
        _ => Err("does not have a pixel on its second line".into()),
    }
}

/// Columns `x`, `y` (on the full film), then one a band, named after it. Numbers have as many digits as bring back the
/// stored ones exactly; what is not rendered is empty.
pub fn write(view: &View, path: &Path, progress: &mut Progress) -> Result<Vec<PathBuf>> {
    let mut replacement = Replacement::create(path, TABLE)?;
    let mut file = BufWriter::with_capacity(1 << 20, replacement.file());
    let result = write_rows(view, &mut file, progress);
    let flushed = file.flush();
    drop(file);
    match result {
        Ok(Ok(())) => flushed.map_err(|error| replacement.failed(&error))?,
        Ok(Err(error)) => return Err(replacement.failed(&error)),
        Err(error) => return Err(error),
    }
    replacement.finish()?;
    Ok(vec![path.to_owned()])
}

/// The outer result is that of reading, the inner one that of writing.
fn write_rows(view: &View, file: &mut impl Write, progress: &mut Progress) -> Result<std::io::Result<()>> {
    let (mut reader, bands, rect) = (view.reader(), view.channels().len(), view.rect());
    let [left, top] = view.cube().header().origin;
    // Writing to a string cannot fail.
    let mut line = "x,y".to_owned();
    view.channels().names.iter().for_each(|name| _ = write!(line, ",{}", cell(name)));
    line.push('\n');
    let together = (PIECE_BYTES / (4 * bands)).clamp(1, rect.width() as usize) as u32;
    let mut values = Vec::new();
    for y in rect.y0..rect.y1 {
        for x0 in (rect.x0..rect.x1).step_by(together as usize) {
            let x1 = (x0 + together).min(rect.x1);
            values.resize((x1 - x0) as usize * bands, 0.0);
            let strides = Strides { row: 0, pixel: bands, band: 1 };
            reader.read(Rect { x0, x1, y0: y, y1: y + 1 }, 0..bands, strides, &mut values)?;
            for (x, spectrum) in (x0..x1).zip(values.chunks_exact(bands)) {
                let _ = write!(line, "{},{}", left + x, top + y);
                for &value in spectrum {
                    line.push(',');
                    if !value.is_nan() {
                        // Debug, not Display: 1e-30 instead of thirty zeros.
                        let _ = write!(line, "{value:?}");
                    }
                }
                line.push('\n');
                if let Err(error) = file.write_all(line.as_bytes()) {
                    return Ok(Err(error));
                }
                line.clear();
            }
        }
        progress(u64::from(y + 1 - rect.y0) * u64::from(rect.width()), rect.pixels())?;
    }
    Ok(Ok(()))
}

/// A cell of a table, quoted where its text asks for it.
fn cell(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}
