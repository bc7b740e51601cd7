//! ENVI rasters: a text header and a file of raw numbers.

use std::path::{Path, PathBuf};

use super::{Bands, Map, checked_size, spectral, whole, with_help};
use crate::error::Problem;
use crate::format::envi::{Header, header_path, is_header, parse};
use crate::format::said::Said;
use crate::format::unit::{Meaning, Stated};

/// The header of the data file at `path`, if it is one of ENVI's.
pub fn header_of(path: &Path) -> Option<PathBuf> {
    header_path(path).filter(|header| std::fs::read(header).is_ok_and(|bytes| is_header(&bytes)))
}

/// The data file of the header at `path`.
fn data_of(path: &Path) -> Result<PathBuf, Box<Problem>> {
    let bare = path.with_extension("");
    let names = ["img", "dat", "bil", "bip", "bsq", "raw"].map(|extension| bare.with_extension(extension));
    let mut found: Vec<PathBuf> = std::iter::once(bare.clone()).chain(names).filter(|name| name.is_file()).collect();
    // Where a header is called m.img.hdr, both are one.
    found.dedup();
    match &found[..] {
        [one] => Ok(one.clone()),
        [] => {
            let name = bare.display();
            Err(with_help(path, "is an ENVI header without its data".to_owned(), &format!("put {name}.img beside it")))
        }
        several => {
            let names: Vec<String> = several.iter().map(|name| name.display().to_string()).collect();
            let message = format!("may be the header of any of {}", names.join(", "));
            Err(with_help(path, message, "name the file of the data that is meant as the map"))
        }
    }
}

/// Refuses a map of the sphere by latitude and longitude whose first column is not at the west of it, or its first row not at the
/// north: columns go from -180 to 180 degrees, rows from 90 to -90.
fn check_place(header: &Header) -> Result<(), Box<Problem>> {
    let Some(info) = header.list("map info") else { return Ok(()) };
    let lower = info.first().map(|name| name.to_lowercase()).unwrap_or_default();
    let numbers: Vec<f64> = info.iter().skip(1).take(6).map_while(|text| text.parse().ok()).collect();
    let (true, &[x, y, longitude, latitude, dx, dy]) = (lower.contains("lat"), &numbers[..]) else { return Ok(()) };
    // The reference is a corner at 1, the middle of the first pixel at 1.5.
    let (west, north) = (longitude - (x - 1.0) * dx, latitude + (y - 1.0) * dy);
    let off = |found: f64, wanted: f64, step: f64| (found - wanted).abs() > 0.01 * step.abs();
    if off(west, -180.0, dx) && off(west, 180.0, dx) {
        let message = format!(
            "begins at longitude {west}, but the first column of a map is at -180: bring the columns into that order (numpy.roll)"
        );
        return Err(header.problem("map info", &message));
    }
    if off(north, 90.0, dy) {
        let message = format!("begins at latitude {north}, but the first row of a map is at 90, the north");
        return Err(header.problem("map info", &message));
    }
    Ok(())
}

/// The raster of the header at `path`; `data` is its file of numbers, where that is known.
pub fn read(path: &Path, data: Option<&Path>) -> Result<Map, Box<Problem>> {
    let bytes = |path: &Path| std::fs::read(path).map_err(|e| whole(path, format!("cannot be read: {e}")));
    let header = parse(&bytes(path)?, path)?;
    let data_path = match data {
        Some(data) => data.to_owned(),
        None => data_of(path)?,
    };
    let size = checked_size(path, header.samples as u64, header.lines as u64)?;
    let Some(axis) = header.axis else {
        let help = "say in what its wavelengths are, e.g. `wavelength units = Nanometers`";
        return Err(with_help(path, "lacks `wavelength units`".to_owned(), help));
    };
    let nm = header.wavelength_nm.as_ref().ok_or_else(|| {
        with_help(
            path,
            "lacks `wavelength`".to_owned(),
            "list that of each band, e.g. `wavelength = { 400, 500, 600 }`",
        )
    })?;
    check_place(&header)?;
    if let Some(said) = header.called().and_then(Said::in_name).filter(|said| *said != Said::Radiance) {
        let key =
            if header.get("data units").and_then(Said::in_name).is_some() { "data units" } else { "z plot titles" };
        let message = format!("calls the values {}: a map holds radiance", said.noun());
        return Err(header.problem(key, &message));
    }
    let names = header.list("band names").unwrap_or_default();
    if names.len() == 3 && ["X", "Y", "Z"].iter().zip(&names).all(|(one, name)| name.eq_ignore_ascii_case(one)) {
        return Err(header.problem("band names", "are those of CIE X, Y and Z, which are no spectrum: export radiance"));
    }
    let mut warnings: Vec<String> = header.notes.clone();
    let density = match header.unit() {
        Some(Stated { meaning, text, .. }) => {
            let measure = match meaning {
                Meaning::Unit(measure) => Some(*measure),
                Meaning::Unknown | Meaning::Factor => None,
                Meaning::Logarithm => {
                    return Err(header.problem("z plot titles", "speaks of logarithms: write radiances"));
                }
            };
            super::radiance_of(path, text, measure, axis, &mut warnings)?
        }
        None => super::radiance_unsaid(path, axis)?,
    };
    let bytes = bytes(&data_path)?;
    warnings.extend(header.surplus(bytes.len(), &data_path));
    let data = header.data(&bytes, &data_path)?;
    let good: Vec<usize> = (0..header.bands).filter(|band| header.is_good(*band)).collect();
    if good.is_empty() {
        return Err(header.problem("bbl", "calls every band bad"));
    }
    warnings.extend(header.bad_bands());
    let mut planes = vec![Vec::with_capacity(header.samples * header.lines); good.len()];
    for (&band, plane) in good.iter().zip(&mut planes) {
        for (line, sample) in (0..header.lines).flat_map(|line| (0..header.samples).map(move |sample| (line, sample))) {
            let Some(value) = data.value(sample, line, band) else {
                let message = format!("has no value at column {sample}, row {line} of band {}", band + 1);
                return Err(with_help(&data_path, message, "fill the gaps: light comes from every direction"));
            };
            plane.push(density.apply(value, nm[band]) as f32);
        }
    }
    let of_good = |all: &Vec<[f64; 2]>| good.iter().map(|band| all[*band]).collect();
    let bands = Bands { nm: good.iter().map(|band| nm[*band]).collect(), spans: header.spans_nm.as_ref().map(of_good) };
    let planes: Vec<&[f32]> = planes.iter().map(Vec::as_slice).collect();
    let content = spectral(path, &bands, &planes, &mut warnings)?;
    Ok(Map { size, content, warnings })
}
