//! Zarr stores: a spectrum per pixel, as in Spectile's own cubes and as xarray writes them.

use std::path::Path;

use super::{Bands, Map, checked_size, spectral, whole, with_help};
use crate::error::Problem;
use crate::format::unit::{Density, Unit};
use crate::format::zarr::{self, Variable};

/// The array that is read where a store has several.
const RADIANCE: &str = "radiance";
/// Names of the dimension that is the spectrum, and of the array of its wavelengths.
const SPECTRUM: [&str; 14] = [
    "wavelength",
    "wavelengths",
    "wavelength_nm",
    "wl",
    "wave",
    "lambda",
    "wvl",
    "wavenumber",
    "wavenumbers",
    "frequency",
    "band",
    "bands",
    "channel",
    "spectral",
];
/// Of a map: 64 GiB while it is read.
const MOST_NUMBERS: u64 = 1 << 33;
const ROWS: [&str; 8] = ["y", "row", "rows", "lat", "latitude", "line", "height", "theta"];
const COLUMNS: [&str; 10] = ["x", "column", "columns", "col", "lon", "longitude", "sample", "samples", "width", "phi"];

/// The store at `path`: a group with an array over y, x and a spectrum, named `radiance` or the only one of three dimensions,
/// and an array of wavelengths, whose attribute `units` says in what.
pub fn read(path: &Path) -> Result<Map, Box<Problem>> {
    let arrays = zarr::arrays(path)?;
    let radiance = the_array(path, &arrays)?;
    let dimensions = match radiance.dimensions.iter().all(String::is_empty) {
        true => ["wavelength", "y", "x"].map(str::to_owned).to_vec(),
        false => radiance.dimensions.clone(),
    };
    let known = |names: &[&str], name: &String| names.contains(&name.to_lowercase().as_str());
    let Some(spectrum) = dimensions.iter().position(|name| known(&SPECTRUM, name)) else {
        let message = format!("has an array over {}, none of which is `wavelength`", dimensions.join(", "));
        return Err(with_help(path, message, "name the dimension of the spectrum `wavelength`"));
    };
    let mut warnings = Vec::new();
    let [y, x] = plane(path, &dimensions, spectrum, &mut warnings)?;
    let shape = radiance.shape.clone();
    let size = checked_size(path, shape[x], shape[y])?;
    if radiance.count().is_none_or(|count| count > MOST_NUMBERS) {
        return Err(whole(path, format!("has an array of {shape:?} numbers, but at most {MOST_NUMBERS} are read")));
    }
    let axis = axis(path, &arrays, &dimensions[spectrum], shape[spectrum])?;
    let bands = bands(path, &arrays, axis, &mut warnings)?;
    let density = density(path, radiance, axis.unit()?, &mut warnings)?;
    // Latitudes grow upward, and rows go down.
    let upside_down = match arrays.iter().find(|array| array.name == dimensions[y] && array.shape == [shape[y]]) {
        Some(rows) if ["lat", "latitude"].contains(&dimensions[y].to_lowercase().as_str()) => {
            let latitudes = rows.values()?;
            latitudes.first() < latitudes.last()
        }
        _ => false,
    };

    let values = radiance.values()?;
    let stride = |dimension: usize| shape[dimension + 1..].iter().product::<u64>() as usize;
    let (by_band, by_row, by_column) = (stride(spectrum), stride(y), stride(x));
    let (width, height) = (size[0] as usize, size[1] as usize);
    let mut planes: Vec<Vec<f32>> = Vec::with_capacity(bands.nm.len());
    for (band, &nm) in bands.nm.iter().enumerate() {
        let mut plane = Vec::with_capacity(width * height);
        for row in 0..height {
            let from = if upside_down { height - 1 - row } else { row };
            for column in 0..width {
                let value = values[band * by_band + from * by_row + column * by_column];
                if value.is_nan() {
                    let message = format!("has no value at column {column}, row {row} of band {}", band + 1);
                    return Err(with_help(path, message, "fill the gaps: light comes from every direction"));
                }
                plane.push(density.apply(value, nm) as f32);
            }
        }
        planes.push(plane);
    }
    let planes: Vec<&[f32]> = planes.iter().map(Vec::as_slice).collect();
    let content = spectral(path, &bands, &planes, &mut warnings)?;
    Ok(Map { size, content, warnings })
}

fn the_array<'a>(path: &Path, arrays: &'a [Variable]) -> Result<&'a Variable, Box<Problem>> {
    let cubes: Vec<&Variable> = arrays.iter().filter(|array| array.shape.len() == 3).collect();
    if let Some(array) = cubes.iter().find(|array| array.name == RADIANCE) {
        return Ok(array);
    }
    match cubes[..] {
        [array] => Ok(array),
        [] => Err(whole(path, "has no array of three dimensions".to_owned())),
        _ => {
            let names: Vec<&str> = cubes.iter().map(|array| array.name.as_str()).collect();
            let message = format!("has several arrays of three dimensions: {}", names.join(", "));
            Err(with_help(path, message, "name the one that is meant `radiance`"))
        }
    }
}

/// Which dimensions are rows and columns: by their names, or else in their order, which is said.
fn plane(
    path: &Path,
    dimensions: &[String],
    spectrum: usize,
    warnings: &mut Vec<String>,
) -> Result<[usize; 2], Box<Problem>> {
    let others: Vec<usize> = (0..3).filter(|i| *i != spectrum).collect();
    let is = |names: &[&str], i: usize| names.contains(&dimensions[i].to_lowercase().as_str());
    let (a, b) = (others[0], others[1]);
    if is(&ROWS, b) && is(&COLUMNS, a) {
        return Ok([b, a]);
    }
    if (is(&ROWS, a) && is(&ROWS, b)) || (is(&COLUMNS, a) && is(&COLUMNS, b)) {
        let message = format!("has an array over {}, of which two are the same", dimensions.join(", "));
        return Err(with_help(path, message, "name the dimensions `y` and `x`"));
    }
    if !is(&ROWS, a) && !is(&COLUMNS, b) {
        warnings.push(format!(
            "has an array over {}: `{}` is taken as rows from the top, `{}` as columns",
            dimensions.join(", "),
            dimensions[a],
            dimensions[b]
        ));
    }
    Ok([a, b])
}

/// The array of wavelengths.
#[derive(Clone, Copy)]
struct SpectralAxis<'a> {
    array: &'a Variable,
    path: &'a Path,
}

impl SpectralAxis<'_> {
    fn unit(&self) -> Result<Unit, Box<Problem>> {
        const HELP: &str = "give the array of wavelengths the attribute units = \"nm\"";
        let Some((text, _)) = self.array.units() else {
            let message = format!("does not say in what unit its wavelengths are (array `{}`)", self.array.name);
            return Err(with_help(self.path, message, HELP));
        };
        Unit::named(text).ok_or_else(|| with_help(self.path, format!("gives wavelengths in \"{text}\""), HELP))
    }
}

/// The array over the dimension of the spectrum alone: the one with its name, or one that has the name of an axis.
fn axis<'a>(
    path: &'a Path,
    arrays: &'a [Variable],
    dimension: &str,
    count: u64,
) -> Result<SpectralAxis<'a>, Box<Problem>> {
    let spectral = |array: &&Variable| {
        array.shape.len() == 1 && SPECTRUM.contains(&array.name.to_lowercase().as_str()) && array.units().is_some()
    };
    let of_dimension =
        |array: &&Variable| array.dimensions.first().is_none_or(|name| name == dimension || name.is_empty());
    let named = arrays.iter().find(|array| array.name == dimension && array.shape.len() == 1);
    // Bands are mostly numbered; their wavelengths stand beside them.
    let numbered = named.is_some_and(|array| array.units().and_then(|(text, _)| Unit::named(text)).is_none());
    let beside = arrays.iter().filter(of_dimension).find(spectral);
    let found = if numbered { beside.or(named) } else { named.or(beside) };
    let Some(array) = found else {
        let message = format!("has no array `{dimension}`");
        return Err(with_help(path, message, "add it, with the attribute units = \"nm\""));
    };
    if array.shape != [count] {
        return Err(whole(path, format!("has {:?} wavelengths for {count} bands", array.shape)));
    }
    Ok(SpectralAxis { array, path })
}

/// Wavelengths, and what each band spans where the store says so: CF's bounds, or widths in an array of their own.
fn bands(
    path: &Path,
    arrays: &[Variable],
    axis: SpectralAxis,
    warnings: &mut Vec<String>,
) -> Result<Bands, Box<Problem>> {
    let unit = axis.unit()?;
    let centres = axis.array.values()?;
    let nm = |x: f64| if x > 0.0 { unit.to_nm(x) } else { f64::NAN };
    let count = centres.len() as u64;
    let of = |name: &str| arrays.iter().find(|array| array.name == name);
    let stated = axis.array.attributes.get("bounds").and_then(|name| name.as_str());
    let guesses = [format!("{}_bounds", axis.array.name), format!("{}_bnds", axis.array.name)];
    let bounds = stated.and_then(of).or_else(|| guesses.iter().find_map(|name| of(name)));
    if let (Some(name), None) = (stated, bounds) {
        warnings.push(format!("has wavelengths whose `bounds` \"{name}\" are not there: bands are taken as points"));
    }
    let spans: Option<Vec<[f64; 2]>> = match bounds.filter(|array| array.shape == [count, 2]) {
        Some(array) => {
            // Of CF's rules: bounds without units have those of their axis.
            let own = match array.units() {
                Some((text, _)) => Unit::named(text)
                    .ok_or_else(|| with_help(path, format!("gives bounds of wavelengths in \"{text}\""), ""))?,
                None => unit,
            };
            let edge = |x: f64| if x > 0.0 { own.to_nm(x) } else { f64::NAN };
            let values = array.values()?;
            Some(values.as_chunks::<2>().0.iter().map(|[a, b]| [edge(*a), edge(*b)]).collect())
        }
        None => {
            let width = ["wavelength_width", "fwhm", "wavelength_fwhm", "bandwidth"].iter().find_map(|name| of(name));
            match width.filter(|array| array.shape == [count]) {
                Some(array) => {
                    let own = array.units().and_then(|(text, _)| Unit::named(text));
                    let factor = match (own.unwrap_or(unit), unit) {
                        (Unit::Wavelength(a), Unit::Wavelength(b)) => a / b,
                        (Unit::Wavenumber(a), Unit::Wavenumber(b))
                        | (Unit::Frequency(a), Unit::Frequency(b))
                        | (Unit::Energy(a), Unit::Energy(b)) => a / b,
                        _ => {
                            return Err(whole(
                                path,
                                "gives wavelengths and their widths in different kinds of unit".into(),
                            ));
                        }
                    };
                    let widths = array.values()?;
                    let span = |(x, width): (&f64, f64)| [nm(x - 0.5 * width * factor), nm(x + 0.5 * width * factor)];
                    Some(centres.iter().zip(widths).map(span).collect())
                }
                None => None,
            }
        }
    };
    Ok(Bands { nm: centres.iter().map(|x| nm(*x)).collect(), spans })
}

/// What makes radiance of the numbers.
fn density(path: &Path, array: &Variable, axis: Unit, warnings: &mut Vec<String>) -> Result<Density, Box<Problem>> {
    match array.units() {
        Some((text, measure)) => super::radiance_of(path, text, measure, axis, warnings),
        None => super::radiance_unsaid(path, axis),
    }
}
