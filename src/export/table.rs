//! CSV: a line a pixel, a column a band.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};

use super::{PIECE_BYTES, Progress};
use crate::cube::{Rect, Strides, View};
use crate::files::output::{Product, Replacement};
use crate::{Error, Result};

/// What [`write`] writes.
pub const TABLE: Product = Product {
    name: "a table of spectra as CSV",
    extensions: &["csv", "txt"],
    is_stream: true,
    is_folder: false,
    check: is_table,
};

/// Whether the first lines are the header `x,y,…` and pixels in the order of [`write`]: what other tables of places and values,
/// points of a survey say, have by accident at most in their first two.
fn is_table(path: &Path) -> std::result::Result<(), String> {
    let unreadable = |error: std::io::Error| format!("cannot be read as text ({error})");
    let mut lines = BufReader::new(File::open(path).map_err(unreadable)?).lines();
    let mut next = || lines.next().transpose().map_err(unreadable);
    let header = next()?.unwrap_or_default();
    if !header.starts_with("x,y,") {
        return Err("does not begin with the columns x and y".into());
    }
    // Names may hold commas in quotation marks; a pixel has numbers alone.
    let pixel = |line: &str| {
        let mut cells = line.split(',');
        let mut place = || cells.next()?.parse::<u32>().ok();
        let place = [place()?, place()?];
        cells.all(|cell| cell.is_empty() || cell.parse::<f32>().is_ok()).then_some(place)
    };
    let Some([left, mut y]) = next()?.as_deref().and_then(pixel) else {
        return Err("does not have a pixel on its second line".into());
    };
    let (mut x, first) = (left, y);
    let mut row_ends = None;
    for number in 3..SEEN_LINES {
        let Some(line) = next()? else { break };
        match pixel(&line) {
            Some([left_again, below])
                if left_again == left && below == y + 1 && row_ends.is_none_or(|end| end == x) =>
            {
                row_ends = Some(x);
                (x, y) = (left, below);
            }
            Some(place) if place == [x + 1, y] => x += 1,
            _ => return Err(format!("does not go on with the next pixel on line {number}")),
        }
    }
    // Bands of sensors have names of people's choice, as the columns of their own tables have.
    if !has_names_of_bands(&header) && (y == first || row_ends == Some(left)) {
        return Err("has columns beside x and y that are called by no wavelength, and is no picture".into());
    }
    Ok(())
}

/// Whether all columns but the first two are called as channels are that have no name of their own, or as X, Y and Z.
fn has_names_of_bands(header: &str) -> bool {
    let is_band = |name: &str| {
        let name = name.trim_matches('"');
        name.strip_suffix(" nm").is_some_and(|nm| nm.parse::<f64>().is_ok()) || ["X", "Y", "Z"].contains(&name)
    };
    header.split(',').skip(2).all(is_band)
}

/// Lines by which a table is known.
const SEEN_LINES: u32 = 1000;

/// Columns `x`, `y` (on the full film), then one a band, named after it. Numbers have as many digits as bring back the
/// stored ones exactly; what is not rendered is empty.
pub fn write(view: &View, path: &Path, progress: &mut Progress) -> Result<Vec<PathBuf>> {
    let mut replacement = Replacement::create(path, TABLE)?;
    let mut table = csv::WriterBuilder::new().buffer_capacity(1 << 20).from_writer(replacement.file());
    let written = write_rows(view, &mut table, progress)?;
    let flushed = written.and_then(|()| Ok(table.flush()?));
    drop(table);
    flushed.map_err(|error| match error.into_kind() {
        csv::ErrorKind::Io(error) => replacement.failed(&error),
        other => Error::Internal(format!("{}: {other:?}", path.display())),
    })?;
    replacement.finish()?;
    Ok(vec![path.to_owned()])
}

/// The outer result is that of reading, the inner one that of writing.
fn write_rows(view: &View, table: &mut csv::Writer<impl Write>, progress: &mut Progress) -> Result<csv::Result<()>> {
    let (mut reader, bands, rect) = (view.reader(), view.channels().len(), view.rect());
    let [left, top] = view.cube().header().origin;
    let names = view.channels().names.iter().map(String::as_str);
    if let Err(error) = table.write_record(["x", "y"].into_iter().chain(names)) {
        return Ok(Err(error));
    }
    let together = (PIECE_BYTES / (4 * bands)).clamp(1, rect.width() as usize) as u32;
    let is_whole = view.integers().is_some();
    let mut values = Vec::new();
    let mut cell = String::new();
    for y in rect.y0..rect.y1 {
        for x0 in (rect.x0..rect.x1).step_by(together as usize) {
            let x1 = (x0 + together).min(rect.x1);
            values.resize((x1 - x0) as usize * bands, 0.0);
            let strides = Strides { row: 0, pixel: bands, band: 1 };
            reader.read(Rect { x0, x1, y0: y, y1: y + 1 }, 0..bands, strides, &mut values)?;
            for (x, spectrum) in (x0..x1).zip(values.chunks_exact(bands)) {
                if let Err(error) = write_row(table, [left + x, top + y], spectrum, is_whole, &mut cell) {
                    return Ok(Err(error));
                }
            }
        }
        progress(u64::from(y + 1 - rect.y0) * u64::from(rect.width()), rect.pixels())?;
    }
    Ok(Ok(()))
}

/// `cell` is for this function only, whose memory is kept between rows.
fn write_row(
    table: &mut csv::Writer<impl Write>,
    place: [u32; 2],
    spectrum: &[f32],
    is_whole: bool,
    cell: &mut String,
) -> csv::Result<()> {
    for coordinate in place {
        table.write_field(coordinate.to_string())?;
    }
    for value in spectrum {
        cell.clear();
        if !value.is_nan() {
            // Debug, not Display: 1e-30 instead of thirty zeros. Writing to a string cannot fail.
            let _ = if is_whole { write!(cell, "{}", *value as u32) } else { write!(cell, "{value:?}") };
        }
        table.write_field(&*cell)?;
    }
    table.write_record(None::<&[u8]>)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_of_others_are_not_taken_for_pictures() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("t.csv");
        for (text, is_ours) in [
            ("x,y,550.000 nm\n0,0,1\n", true),
            ("x,y,550.000 nm,560.5 nm\n4,2,1,\n5,2,1,2\n", true),
            ("x,y,X,Y,Z\n0,0,1,1,1\n", true),
            ("x,y,red\n0,0,1\n1,0,2\n0,1,3\n1,1,4\n", true),
            ("x,y,temperature\n0,0,1\n", false),
            ("x,y,z\n0,0,1.5\n", false),
            ("x,y,z,label\n0,0,1.5,7\n1,0,2,7\n2,0,2,7\n", false),
            ("x,y,z\n0,0,1.5\n0,1,2\n0,2,3\n", false),
            ("x,y,z\n0,0,1\n1,0,1\n0,1,1\n0,2,1\n1,2,1\n", false),
            ("nm,v\n400,1\n", false),
        ] {
            std::fs::write(&path, text).expect("written");
            assert_eq!(is_table(&path).is_ok(), is_ours, "{text}");
        }
    }
}
