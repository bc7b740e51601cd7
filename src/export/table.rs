//! CSV: a line a pixel, a column a band.

use std::fmt::Write as _;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use super::{PIECE_BYTES, Progress};
use crate::Result;
use crate::cube::{Rect, Strides, View};
use crate::files::Replacement;

/// Columns `x`, `y` (on the full film), then one a band, named after it. Numbers have as many digits as bring back the
/// stored ones exactly; what is not rendered is empty.
pub fn write(view: &View, path: &Path, progress: &mut Progress) -> Result<Vec<PathBuf>> {
    let mut replacement = Replacement::create(path)?;
    let mut file = BufWriter::with_capacity(1 << 20, replacement.file());
    let result = write_rows(view, &mut file, progress);
    let flushed = file.flush();
    drop(file);
    match result {
        Ok(Ok(())) => flushed.map_err(|error| replacement.failed(error))?,
        Ok(Err(error)) => return Err(replacement.failed(error)),
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
