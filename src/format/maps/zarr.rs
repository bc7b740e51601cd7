//! Zarr stores: a spectrum per pixel, as in Spectile's own cubes and as xarray writes them.

use std::path::Path;

use super::{Bands, Map, checked_size, spectral, whole, with_help};
use crate::error::Problem;
use crate::format::said::Said;
use crate::format::table::shown;
use crate::format::unit::{self, Density, Meaning, Stated, Unit};
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
    let shape = radiance.shape.clone();
    let coordinate = |i: usize, of: &Coordinate| of.find(&arrays, &dimensions[i], shape[i]);
    let is_row = |i: usize| known(&ROWS, &dimensions[i]) || coordinate(i, &LATITUDE).is_some();
    let is_column = |i: usize| known(&COLUMNS, &dimensions[i]) || coordinate(i, &LONGITUDE).is_some();
    let [y, x] = plane(path, &dimensions, spectrum, [&is_row, &is_column], &mut warnings)?;
    let size = checked_size(path, shape[x], shape[y])?;
    if radiance.count().is_none_or(|count| count > MOST_NUMBERS) {
        return Err(whole(path, format!("has an array of {shape:?} numbers, but at most {MOST_NUMBERS} are read")));
    }
    let axis = axis(path, &arrays, &dimensions[spectrum], shape[spectrum])?;
    let bands = bands(path, &arrays, axis, &mut warnings)?;
    refuse_other_quantities(path, radiance)?;
    warnings.extend(bad_bands(&arrays, axis)?);
    warnings.extend(unknown_attributes(radiance));
    warnings.extend(told_in_texts(radiance));
    let density = density(path, radiance, axis.unit()?, &mut warnings)?;
    let rows = match coordinate(y, &LATITUDE) {
        Some(array) => from_north(path, array, &mut warnings)?,
        None => (0..shape[y] as usize).collect(),
    };
    let columns = match coordinate(x, &LONGITUDE) {
        Some(array) => from_west(path, array, &mut warnings)?,
        None => (0..shape[x] as usize).collect(),
    };

    let values = radiance.values()?;
    let lost = radiance.lost_chunks()?;
    let stride = |dimension: usize| shape[dimension + 1..].iter().product::<u64>() as usize;
    let (by_band, by_row, by_column) = (stride(spectrum), stride(y), stride(x));
    let mut planes: Vec<Vec<f32>> = Vec::with_capacity(bands.nm.len());
    for (band, &nm) in bands.nm.iter().enumerate() {
        let mut plane = Vec::with_capacity(rows.len() * columns.len());
        for (row, from_row) in rows.iter().enumerate() {
            for (column, from_column) in columns.iter().enumerate() {
                let value = values[band * by_band + from_row * by_row + from_column * by_column];
                if value.is_nan() {
                    let why = lost.map(|words| format!(", and {words}")).unwrap_or_default();
                    let message = format!("has no value at column {column}, row {row} of band {}{why}", band + 1);
                    return Err(with_help(path, message, "fill the gaps: light comes from every direction"));
                }
                plane.push(density.apply(value, nm) as f32);
            }
        }
        planes.push(plane);
    }
    warnings.extend(lost);
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
        [] => {
            let groups = zarr::groups(path);
            let help = match &groups[..] {
                [] => "a map is an array over y, x and `wavelength`: pick one time, height, … of an array with more",
                _ => "if the map is in one of its groups, name that: \"STORE/GROUP\"",
            };
            let inside =
                if groups.is_empty() { String::new() } else { format!(", but the groups {}", groups.join(", ")) };
            Err(with_help(path, format!("has no array of three dimensions{inside}"), help))
        }
        _ => {
            let names: Vec<&str> = cubes.iter().map(|array| array.name.as_str()).collect();
            let message = format!("has several arrays of three dimensions: {}", names.join(", "));
            Err(with_help(path, message, "name the one that is meant `radiance`"))
        }
    }
}

/// Latitude or longitude, as the conventions of CF tell an array of them.
struct Coordinate {
    /// Of the array; the second is also its `standard_name`.
    names: [&'static str; 2],
    units: [&'static str; 6],
}

const LATITUDE: Coordinate = Coordinate {
    names: ["lat", "latitude"],
    units: ["degrees_north", "degree_north", "degree_n", "degrees_n", "degreen", "degreesn"],
};
const LONGITUDE: Coordinate = Coordinate {
    names: ["lon", "longitude"],
    units: ["degrees_east", "degree_east", "degree_e", "degrees_e", "degreee", "degreese"],
};

impl Coordinate {
    /// The array of these over a dimension of `count`: the one of its name, or another over it.
    fn find<'a>(&self, arrays: &'a [Variable], dimension: &str, count: u64) -> Option<&'a Variable> {
        let text = |array: &Variable, key: &str| {
            array.attributes.get(key).and_then(|value| value.as_str()).unwrap_or("").trim().to_lowercase()
        };
        let is_such = |array: &&Variable| {
            array.shape == [count]
                && (self.names.contains(&array.name.to_lowercase().as_str())
                    || text(array, "standard_name") == self.names[1]
                    || self.units.contains(&text(array, "units").as_str()))
        };
        let over = |array: &&Variable| array.dimensions.first().is_some_and(|name| name == dimension);
        let mut such = arrays.iter().filter(is_such);
        such.clone().find(|array| array.name == dimension).or_else(|| such.find(over))
    }
}

/// The places that an array gives, in degrees.
fn degrees(path: &Path, array: &Variable) -> Result<Vec<f64>, Box<Problem>> {
    let in_radians = array.units().is_some_and(|(text, _)| text.to_lowercase().starts_with("rad"));
    let mut places = array.values()?;
    if in_radians {
        places.iter_mut().for_each(|place| *place = place.to_degrees());
    }
    match places.iter().find(|place| !place.is_finite()) {
        None => Ok(places),
        Some(wrong) => Err(whole(path, format!("has {wrong} among its coordinates `{}`", array.name))),
    }
}

/// How far, in steps, places may be from where rows and columns are, before it is said.
const OFF: f64 = 0.01;

/// Rows of the array from the north to the south.
fn from_north(path: &Path, array: &Variable, warnings: &mut Vec<String>) -> Result<Vec<usize>, Box<Problem>> {
    let places = degrees(path, array)?;
    let descends = |order: &[usize]| order.windows(2).all(|pair| places[pair[0]] > places[pair[1]]);
    let mut order: Vec<usize> = (0..places.len()).collect();
    if !descends(&order) {
        order.reverse();
    }
    if !descends(&order) {
        let message = format!("has latitudes `{}` that neither ascend nor descend", array.name);
        return Err(with_help(path, message, "sort it by latitude"));
    }
    let step = 180.0 / places.len() as f64;
    let is_there =
        |(row, from): (usize, &usize)| (places[*from] - (90.0 - (row as f64 + 0.5) * step)).abs() <= OFF * step;
    if !order.iter().enumerate().all(is_there) {
        warnings.push(format!(
            "has latitudes `{}` from {} to {} degrees: its rows are taken as {} equal ones from 90 to -90",
            array.name,
            places[order[0]],
            places[order[order.len() - 1]],
            order.len()
        ));
    }
    Ok(order)
}

/// Columns of the array from 180 degrees west over Greenwich to 180 degrees east.
fn from_west(path: &Path, array: &Variable, warnings: &mut Vec<String>) -> Result<Vec<usize>, Box<Problem>> {
    let places = degrees(path, array)?;
    let step = 360.0 / places.len() as f64;
    // -180 and 180 are one, also where rounding has been at them.
    let east = |i: usize| (places[i] + 180.0 + 1e-3 * step).rem_euclid(360.0) - 180.0 - 1e-3 * step;
    let mut order: Vec<usize> = (0..places.len()).collect();
    order.sort_by(|a, b| east(*a).total_cmp(&east(*b)));
    let is_around = order.windows(2).all(|pair| (east(pair[1]) - east(pair[0]) - step).abs() <= OFF * step);
    if !is_around {
        // A part of the sphere is not cut where its longitudes pass 180.
        order.sort();
        if places.first() > places.last() {
            order.reverse();
        }
    }
    let first = places[order[0]];
    if !is_around || (east(order[0]) - (-180.0 + 0.5 * step)).abs() > OFF * step {
        warnings.push(format!(
            "has longitudes `{}` from {first} to {} degrees: its columns are taken as {} equal ones from -180 to 180",
            array.name,
            places[order[order.len() - 1]],
            order.len()
        ));
    }
    Ok(order)
}

/// Which dimensions are rows and columns: by their names and coordinates, or else in their order, which is said.
fn plane(
    path: &Path,
    dimensions: &[String],
    spectrum: usize,
    [is_row, is_column]: [&dyn Fn(usize) -> bool; 2],
    warnings: &mut Vec<String>,
) -> Result<[usize; 2], Box<Problem>> {
    let others: Vec<usize> = (0..3).filter(|i| *i != spectrum).collect();
    let (a, b) = (others[0], others[1]);
    if is_row(b) && is_column(a) {
        return Ok([b, a]);
    }
    if (is_row(a) && is_row(b)) || (is_column(a) && is_column(b)) {
        let message = format!("has an array over {}, of which two are the same", dimensions.join(", "));
        return Err(with_help(path, message, "name the dimensions `y` and `x`"));
    }
    if !is_row(a) && !is_column(b) {
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
    let says_air = |key: &str| {
        let text = axis.array.attributes.get(key).and_then(|value| value.as_str()).unwrap_or("");
        unit::is_in_air(text) && !text.to_lowercase().contains("vac")
    };
    let in_air = ["long_name", "standard_name", "medium", "comment", "description"].into_iter().any(says_air);
    let text = |key: &str| axis.array.attributes.get(key).and_then(|value| value.as_str()).unwrap_or("");
    if let Some(name) = [text("long_name"), text("standard_name")].into_iter().find(|name| says_logarithm(name)) {
        return Err(whole(path, format!("gives logarithms as its wavelengths: `{name}`")));
    }
    warnings.extend(in_air.then(|| unit::FROM_AIR.to_owned()));
    let in_nm = |x: f64, unit: Unit| match unit.to_nm(x) {
        _ if x <= 0.0 => f64::NAN,
        nm if in_air => unit::vacuum_nm(nm),
        nm => nm,
    };
    let nm = |x: f64| in_nm(x, unit);
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
            let edge = |x: f64| in_nm(x, own);
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
fn says_logarithm(name: &str) -> bool {
    Stated::in_name(name).is_some_and(|stated| stated.meaning == Meaning::Logarithm)
}

/// Refuses an array that CF's names call something else than a radiance.
fn refuse_other_quantities(path: &Path, array: &Variable) -> Result<(), Box<Problem>> {
    let text = |key: &str| array.attributes.get(key).and_then(|value| value.as_str());
    let says = ["standard_name", "long_name", "quantity"].map(|key| (key, text(key)));
    for (key, name) in says.into_iter().chain([("its name", Some(array.name.as_str()))]) {
        let Some(name) = name else { continue };
        let what = match Said::in_name(name) {
            _ if says_logarithm(name) => "logarithms",
            Some(said) if said != Said::Radiance => said.noun(),
            _ if name == "xyz" => "CIE X, Y and Z",
            _ => continue,
        };
        let message = format!("says that `{}` is {what} (`{key}`: `{}`)", array.name, shown(name));
        return Err(with_help(path, message, "a map holds radiance: compute it, or correct the attribute"));
    }
    Ok(())
}

/// What to say of bands that an array beside the wavelengths calls bad, as those of EMIT do.
fn bad_bands(arrays: &[Variable], axis: SpectralAxis) -> Result<Option<String>, Box<Problem>> {
    /// Names of flags, and whether 1 is a good band; of others nobody knows which is.
    const FLAGS: [(&str, Option<bool>); 15] = [
        ("good_wavelengths", Some(true)),
        ("good_bands", Some(true)),
        ("good", Some(true)),
        ("bbl", Some(true)),
        ("valid", Some(true)),
        ("valid_bands", Some(true)),
        ("bad_bands", Some(false)),
        ("bad_wavelengths", Some(false)),
        ("bad", Some(false)),
        ("mask", None),
        ("band_mask", None),
        ("quality", None),
        ("quality_flag", None),
        ("flag", None),
        ("flags", None),
    ];
    for array in arrays.iter().filter(|array| array.shape == axis.array.shape) {
        let lower = array.name.to_lowercase();
        let Some((_, one_is_good)) = FLAGS.iter().find(|(name, _)| *name == lower) else { continue };
        let flags = array.values()?;
        let name = shown(&array.name);
        let bad = |is_bad: &dyn Fn(f64) -> bool| flags.iter().filter(|flag| is_bad(**flag)).count();
        let said = match one_is_good {
            Some(true) => Some(bad(&|flag| flag == 0.0)).filter(|bad| *bad > 0),
            Some(false) => Some(bad(&|flag| flag != 0.0)).filter(|bad| *bad > 0),
            None if flags.windows(2).any(|pair| pair[0] != pair[1]) => {
                return Ok(Some(format!(
                    "has flags of its bands, `{name}`, which are not applied: all bands are read"
                )));
            }
            None => None,
        };
        if let Some(bad) = said {
            return Ok(Some(format!("has {bad} bands that `{name}` calls bad: they are read as the others")));
        }
    }
    Ok(None)
}

fn density(path: &Path, array: &Variable, axis: Unit, warnings: &mut Vec<String>) -> Result<Density, Box<Problem>> {
    match array.units() {
        Some((text, measure)) => super::radiance_of(path, text, measure, axis, warnings),
        None => match array.attributes.get("long_name").and_then(|value| value.as_str()).and_then(Stated::in_name) {
            Some(Stated { meaning: Meaning::Unit(measure), text, certain: true }) => {
                super::radiance_of(path, &text, Some(measure), axis, warnings)
            }
            Some(Stated { meaning: Meaning::Factor | Meaning::Unknown, text, .. }) => {
                let message = format!("says `{}` of its values, which is not applied", shown(&text));
                Err(with_help(path, message, "give the array the attribute units = \"W m-2 sr-1 nm-1\""))
            }
            _ => super::radiance_unsaid(path, axis),
        },
    }
}

/// What to say of attributes that may change what the numbers are, and that nothing here knows.
fn unknown_attributes(array: &Variable) -> Option<String> {
    /// Of CF, xarray, GDAL and Spectile.
    const KNOWN: [&str; 40] = [
        "scale",
        "gain",
        "factor",
        "offset",
        "slope",
        "intercept",
        "units",
        "unit",
        "long_name",
        "standard_name",
        "quantity",
        "coordinates",
        "grid_mapping",
        "cell_methods",
        "ancillary_variables",
        "flag_values",
        "flag_meanings",
        "flag_masks",
        "comment",
        "description",
        "title",
        "source",
        "history",
        "institution",
        "references",
        "axis",
        "bounds",
        "positive",
        "calendar",
        "name",
        "valid_min",
        "valid_max",
        "valid_range",
        "actual_range",
        "scale_factor",
        "add_offset",
        "missing_value",
        "created",
        "date",
        "crs",
    ];
    let is_known = |key: &str| {
        let lower = key.to_lowercase();
        KNOWN.contains(&lower.as_str()) || lower.starts_with('_') || lower.contains("stat")
    };
    let mut said: Vec<String> = array
        .attributes
        .iter()
        .filter(|(key, value)| !is_known(key) && !value.is_null())
        .map(|(key, _)| shown(key))
        .collect();
    said.truncate(8);
    (!said.is_empty())
        .then(|| format!("has attributes of `{}` that are not known, and left out: {}", array.name, said.join(", ")))
}

/// What the texts about an array say of a factor, or percent.
fn told_in_texts(array: &Variable) -> Option<String> {
    ["description", "comment", "title", "note"].into_iter().find_map(|key| {
        let text = array.attributes.get(key)?.as_str()?;
        (unit::states_a_factor(text) || unit::speaks_of_percent(text))
            .then(|| format!("has the attribute `{key}` = \"{}\", which is not applied", shown(text)))
    })
}
