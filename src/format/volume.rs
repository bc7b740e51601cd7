//! Volumes of numbers: Zarr arrays [z, y, x], version 2 or 3, as xarray and zarr-python write them.

use std::path::Path;
use std::sync::Arc;

use super::unit::Measure;
use super::zarr::Variable;
use crate::error::Problem;

/// A number for each voxel, x fastest.
#[derive(Debug, Clone, PartialEq)]
pub struct Volume {
    /// Voxels along x, y and z.
    pub size: [u32; 3],
    pub values: Arc<Vec<f32>>,
    /// What the file says of its unit, and what that is where it is understood.
    pub unit: Option<(String, Option<Measure>)>,
    /// What attributes call its values.
    pub said: Vec<String>,
    /// What attributes tell of them in sentences.
    pub told: Vec<String>,
    /// What to say of the file, in words that go on after its name.
    pub notes: Vec<String>,
}

/// Voxels that one volume may have: 1 GiB of f32, and far below what indices of u32 reach.
pub const MAX_VOXELS: u64 = 1 << 28;

/// Reads the array in the folder `path`. Errors are of the array as a whole.
pub fn read(path: &Path) -> Result<Volume, Box<Problem>> {
    let problem = |message: String, help: Option<&str>| {
        Box::new(Problem { file: path.to_owned(), message, help: help.map(str::to_owned), ..Problem::default() })
    };
    const HELP: &str =
        "give the folder of one Zarr array [z, y, x]; inside a group, that of the array: \"t.zarr/NAME\"";
    if !path.is_dir() {
        return Err(problem("is not a folder".to_owned(), Some(HELP)));
    }
    let Some(array) = Variable::open(path)? else {
        return Err(problem("cannot be read as a Zarr array: it has no metadata of one".to_owned(), Some(HELP)));
    };
    let shape: [u64; 3] = array.shape[..].try_into().map_err(|_| {
        let message = format!("has {} dimensions, but a grid has three: [z, y, x]", array.shape.len());
        problem(message, Some(HELP))
    })?;
    let voxels = array.count().unwrap_or(u64::MAX);
    if voxels == 0 || voxels > MAX_VOXELS {
        return Err(problem(format!("has {shape:?} voxels, but must have 1 to {MAX_VOXELS} in all"), None));
    }
    let order = order(&array.dimensions).map_err(|message| problem(message, Some("name its dimensions z, y and x")))?;
    let flipped = flipped(path, &array)?;
    let stored = array.values()?;

    let [nz, ny, nx] = order.map(|dimension| shape[dimension] as usize);
    let stride = |dimension: usize| shape[dimension + 1..].iter().product::<u64>() as usize;
    let place = |of: usize, i: usize, count: usize| {
        let dimension = order[of];
        stride(dimension) * if flipped[dimension] { count - 1 - i } else { i }
    };
    let mut values = Vec::with_capacity(stored.len());
    for z in 0..nz {
        for y in 0..ny {
            let start = place(0, z, nz) + place(1, y, ny);
            values.extend((0..nx).map(|x| stored[start + place(2, x, nx)] as f32));
        }
    }
    let unit = array.units().map(|(text, measure)| (text.to_owned(), measure));
    let notes = array.lost_chunks()?.into_iter().collect();
    let texts = |keys: &[&str]| -> Vec<String> {
        keys.iter().filter_map(|key| array.attributes.get(*key)?.as_str().map(str::to_owned)).collect()
    };
    let (said, told) = (texts(&["standard_name", "long_name", "quantity"]), texts(&["description", "comment"]));
    Ok(Volume { size: [nx, ny, nz].map(|side| side as u32), values: Arc::new(values), unit, said, told, notes })
}

/// Which dimensions are z, y and x: by their names, in any order, or [z, y, x] where they have none of these.
fn order(dimensions: &[String]) -> Result<[usize; 3], String> {
    let lower: Vec<String> = dimensions.iter().map(|name| name.to_lowercase()).collect();
    let of = |name: &str| lower.iter().position(|dimension| dimension == name);
    match ["z", "y", "x"].map(of) {
        [Some(z), Some(y), Some(x)] => Ok([z, y, x]),
        [None, None, None] => Ok([0, 1, 2]),
        _ => Err(format!("has the dimensions {}, of which only some are z, y or x", dimensions.join(", "))),
    }
}

/// Along which dimensions the coordinates beside the array descend. A grid has voxels of one size, so uneven ones are refused.
fn flipped(path: &Path, array: &Variable) -> Result<[bool; 3], Box<Problem>> {
    let mut flipped = [false; 3];
    let Some(group) = path.parent() else { return Ok(flipped) };
    for (dimension, name) in array.dimensions.iter().enumerate().filter(|(_, name)| is_plain(name)) {
        let Some(coordinate) = Variable::open(&group.join(name))? else { continue };
        if coordinate.shape != [array.shape[dimension]] || array.shape[dimension] > 1 << 20 {
            continue;
        }
        let places = coordinate.values()?;
        let Some(step) = places.windows(2).map(|pair| pair[1] - pair[0]).next() else { continue };
        let mean = (places[places.len() - 1] - places[0]) / (places.len() - 1) as f64;
        let even = places.windows(2).all(|pair| ((pair[1] - pair[0]) - mean).abs() <= 1e-3 * mean.abs());
        if !even || step == 0.0 {
            let message = format!("has coordinates along {name} that are not evenly spaced");
            return Err(array.problem(message, "resample it: the voxels of a grid have one size"));
        }
        // CF's depth grows downward, as z does upward.
        let is_down = coordinate
            .attributes
            .get("positive")
            .and_then(|value| value.as_str())
            .is_some_and(|positive| positive.eq_ignore_ascii_case("down"));
        flipped[dimension] = (step < 0.0) != is_down;
    }
    Ok(flipped)
}

/// Whether a name is that of a folder beside others, and no way out of it.
fn is_plain(name: &str) -> bool {
    !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || c == '_' || c == '-')
}
