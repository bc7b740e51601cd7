//! Zarr stores: a spectrum per pixel, as in Spectile's own cubes and as xarray writes them.

use std::path::Path;
use std::sync::Arc;

use zarrs::array::Array;
use zarrs::filesystem::FilesystemStore;
use zarrs::group::Group;

use super::{Map, checked_size, nanometres, spectral, whole, with_help};
use crate::error::Problem;

/// The array that is read where a store has several.
const RADIANCE: &str = "radiance";
/// The dimension that is the spectrum, and the array of its wavelengths.
const WAVELENGTH: &str = "wavelength";

type StoredArray = Array<FilesystemStore>;

/// The store at `path`: a group with an array over y, x and `wavelength`, named `radiance` or the only one of three
/// dimensions, and the array `wavelength`, whose attribute `units` says in what.
pub fn read(path: &Path) -> Result<Map, Box<Problem>> {
    let broken = |e: &dyn std::fmt::Display| whole(path, format!("is no Zarr store that can be read: {e}"));
    let store = Arc::new(FilesystemStore::new(path).map_err(|e| broken(&e))?);
    let group = Group::open(store, "/").map_err(|e| broken(&e))?;
    let arrays = group.child_arrays().map_err(|e| broken(&e))?;

    let radiance = the_array(path, &arrays)?;
    let dimensions: Vec<String> = match radiance.dimension_names() {
        Some(names) => names.iter().map(|name| name.clone().unwrap_or_default()).collect(),
        None => ["wavelength", "y", "x"].map(str::to_owned).into(),
    };
    let Some(spectrum) = dimensions.iter().position(|name| name == WAVELENGTH) else {
        let message = format!("has an array over {}, none of which is `{WAVELENGTH}`", dimensions.join(", "));
        return Err(with_help(path, message, "name the dimension of the spectrum `wavelength`"));
    };
    // The other two keep their order: rows, then columns.
    let [y, x] = match spectrum {
        0 => [1, 2],
        1 => [0, 2],
        _ => [0, 1],
    };
    let shape = radiance.shape().to_vec();
    let size = checked_size(path, shape[x], shape[y])?;
    let nm = wavelengths(path, &arrays, shape[spectrum])?;

    let values = numbers(path, radiance)?;
    let stride = |dimension: usize| shape[dimension + 1..].iter().product::<u64>() as usize;
    let (by_band, by_row, by_column) = (stride(spectrum), stride(y), stride(x));
    let planes: Vec<Vec<f32>> = (0..nm.len())
        .map(|band| {
            let (width, height) = (size[0] as usize, size[1] as usize);
            let rows = (0..height).map(|row| band * by_band + row * by_row);
            rows.flat_map(|start| (0..width).map(move |column| start + column * by_column))
                .map(|i| values[i] as f32)
                .collect()
        })
        .collect();
    let planes: Vec<&[f32]> = planes.iter().map(Vec::as_slice).collect();
    Ok(Map { size, content: spectral(path, &nm, &planes)?, warnings: Vec::new() })
}

fn the_array<'a>(path: &Path, arrays: &'a [StoredArray]) -> Result<&'a StoredArray, Box<Problem>> {
    let cubes: Vec<&StoredArray> = arrays.iter().filter(|array| array.shape().len() == 3).collect();
    if let Some(array) = cubes.iter().find(|array| name(array) == RADIANCE) {
        return Ok(array);
    }
    match cubes[..] {
        [array] => Ok(array),
        [] => Err(whole(path, "has no array of three dimensions".to_owned())),
        _ => {
            let names: Vec<&str> = cubes.iter().map(|array| name(array)).collect();
            let message = format!("has several arrays of three dimensions: {}", names.join(", "));
            Err(with_help(path, message, "name the one that is meant `radiance`"))
        }
    }
}

fn name(array: &StoredArray) -> &str {
    array.path().as_str().trim_start_matches('/')
}

/// Wavelengths in nm, `count` of them.
fn wavelengths(path: &Path, arrays: &[StoredArray], count: u64) -> Result<Vec<f64>, Box<Problem>> {
    let Some(array) = arrays.iter().find(|array| name(array) == WAVELENGTH) else {
        return Err(with_help(
            path,
            format!("has no array `{WAVELENGTH}`"),
            "add it, with the attribute units = \"nm\"",
        ));
    };
    if array.shape() != [count] {
        let message = format!("has {:?} wavelengths for {count} bands", array.shape());
        return Err(whole(path, message));
    }
    let unit = array.attributes().get("units").and_then(|unit| unit.as_str());
    let Some(nm) = unit.and_then(nanometres) else {
        let message = match unit {
            Some(unit) => format!("gives wavelengths in \"{unit}\""),
            None => "does not say in what unit its wavelengths are".to_owned(),
        };
        return Err(with_help(path, message, "give the array `wavelength` the attribute units = \"nm\""));
    };
    Ok(numbers(path, array)?.into_iter().map(|number| number * nm).collect())
}

/// All numbers of an array of f32 or f64, in order.
fn numbers(path: &Path, array: &StoredArray) -> Result<Vec<f64>, Box<Problem>> {
    let broken =
        |e: &dyn std::fmt::Display| whole(path, format!("has an array {} that cannot be read: {e}", name(array)));
    let all = array.subset_all();
    if array.data_type() == &zarrs::array::data_type::float64() {
        return array.retrieve_array_subset(&all).map_err(|e| broken(&e));
    }
    let values: Vec<f32> = array.retrieve_array_subset(&all).map_err(|e| broken(&e))?;
    Ok(values.into_iter().map(f64::from).collect())
}
