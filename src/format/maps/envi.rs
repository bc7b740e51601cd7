//! ENVI rasters: a text header and a file of raw numbers.

use std::path::{Path, PathBuf};

use super::{Map, checked_size, spectral, whole, with_help};
use crate::error::Problem;
use crate::format::envi::{header_path, parse};
use crate::format::text::nanometres;

/// The header of the data file at `path`, if it is one of ENVI's.
pub fn header_of(path: &Path) -> Option<PathBuf> {
    header_path(path).filter(|header| std::fs::read(header).is_ok_and(|bytes| bytes.starts_with(b"ENVI")))
}

/// The data file of the header at `path`.
fn data_of(path: &Path) -> Option<PathBuf> {
    let bare = path.with_extension("");
    let names = ["img", "dat", "bil", "bip", "bsq", "raw"].map(|extension| bare.with_extension(extension));
    std::iter::once(bare).chain(names).find(|name| name.is_file())
}

/// The raster of the header at `path`; `data` is its file of numbers, where that is known.
pub fn read(path: &Path, data: Option<&Path>) -> Result<Map, Box<Problem>> {
    let bytes = |path: &Path| std::fs::read(path).map_err(|e| whole(path, format!("cannot be read: {e}")));
    let header = parse(&bytes(path)?, path)?;
    let data_path = match data {
        Some(data) => data.to_owned(),
        None => data_of(path).ok_or_else(|| {
            let name = path.with_extension("").display().to_string();
            with_help(path, "is an ENVI header without its data".to_owned(), &format!("put {name}.img beside it"))
        })?,
    };
    let size = checked_size(path, header.samples as u64, header.lines as u64)?;
    let unit = header.get("wavelength units").ok_or_else(|| whole(path, "lacks `wavelength units`".to_owned()))?;
    if nanometres(unit).is_none() {
        // Radiance would be per wavenumber too.
        return Err(header.problem("wavelength units", &format!("must be nm, um, mm or m, but is {unit}")));
    }
    let nm = header.wavelength_nm.as_ref().ok_or_else(|| whole(path, "lacks `wavelength`".to_owned()))?;
    let bytes = bytes(&data_path)?;
    let data = header.data(&bytes, &data_path)?;
    let mut planes = vec![Vec::with_capacity(header.samples * header.lines); header.bands];
    for (band, plane) in planes.iter_mut().enumerate() {
        for (line, sample) in (0..header.lines).flat_map(|line| (0..header.samples).map(move |sample| (line, sample))) {
            let Some(value) = data.value(sample, line, band) else {
                let message = format!("has no value at column {sample}, row {line} of band {}", band + 1);
                return Err(with_help(&data_path, message, "fill the gaps: light comes from every direction"));
            };
            plane.push(value as f32);
        }
    }
    let planes: Vec<&[f32]> = planes.iter().map(Vec::as_slice).collect();
    Ok(Map { size, content: spectral(path, nm, &planes)?, warnings: Vec::new() })
}
