//! Volumes of numbers: Zarr arrays [z, y, x], version 2 or 3, as xarray and zarr-python write them.

use std::path::Path;
use std::sync::Arc;

use zarrs::array::{Array, ArrayBytes, ElementOwned};
use zarrs::filesystem::FilesystemStore;

use crate::error::Problem;

/// A number for each voxel, x fastest.
#[derive(Debug, Clone, PartialEq)]
pub struct Volume {
    /// Voxels along x, y and z.
    pub size: [u32; 3],
    pub values: Vec<f32>,
}

/// Voxels that one volume may have: 1 GiB of f32, and far below what indices of u32 reach.
const MAX_VOXELS: u64 = 1 << 28;

/// Reads the array in the folder `path`. Errors are of the array as a whole.
pub fn read(path: &Path) -> Result<Volume, Box<Problem>> {
    let problem = |message: String, help: Option<&str>| {
        Box::new(Problem { file: path.to_owned(), message, help: help.map(str::to_owned), ..Problem::default() })
    };
    const HELP: &str =
        "give the folder of one Zarr array [z, y, x]; inside a group, that of the array: \"t.zarr/NAME\"";
    let unread = |e: &dyn std::fmt::Display| problem(format!("cannot be read as a Zarr array: {e}"), Some(HELP));
    if !path.is_dir() {
        return Err(problem("is not a folder".to_owned(), Some(HELP)));
    }
    let store = FilesystemStore::new(path).map_err(|e| unread(&e))?;
    let array = Array::open(Arc::new(store), "/").map_err(|e| unread(&e))?;
    let size: [u64; 3] = array.shape().try_into().map_err(|_| {
        let message = format!("has {} dimensions, but a grid has three: [z, y, x]", array.shape().len());
        problem(message, Some(HELP))
    })?;
    let voxels = size.iter().try_fold(1u64, |n, &side| n.checked_mul(side)).unwrap_or(u64::MAX);
    if voxels == 0 || voxels > MAX_VOXELS {
        return Err(problem(format!("has {size:?} voxels, but must have 1 to {MAX_VOXELS} in all"), None));
    }
    let bytes: ArrayBytes<'static> = array.retrieve_array_subset(&array.subset_all()).map_err(|e| unread(&e))?;
    let values = numbers(&array, bytes)
        .ok_or_else(|| problem(format!("holds {:?}, but must hold real numbers", array.data_type()), None))?;
    let [z, y, x] = size.map(|side| side as u32);
    Ok(Volume { size: [x, y, z], values })
}

/// The elements as f32, whatever real numbers they are.
fn numbers(array: &Array<FilesystemStore>, bytes: ArrayBytes<'static>) -> Option<Vec<f32>> {
    fn of<T: ElementOwned>(
        array: &Array<FilesystemStore>,
        bytes: &ArrayBytes<'static>,
        f32_of: impl Fn(T) -> f32,
    ) -> Option<Vec<f32>> {
        let elements = T::from_array_bytes(array.data_type(), bytes.clone()).ok()?;
        Some(elements.into_iter().map(f32_of).collect())
    }
    of::<f32>(array, &bytes, |x| x)
        .or_else(|| of::<f64>(array, &bytes, |x| x as f32))
        .or_else(|| of::<u8>(array, &bytes, f32::from))
        .or_else(|| of::<i8>(array, &bytes, f32::from))
        .or_else(|| of::<u16>(array, &bytes, f32::from))
        .or_else(|| of::<i16>(array, &bytes, f32::from))
        .or_else(|| of::<u32>(array, &bytes, |x| x as f32))
        .or_else(|| of::<i32>(array, &bytes, |x| x as f32))
        .or_else(|| of::<u64>(array, &bytes, |x| x as f32))
        .or_else(|| of::<i64>(array, &bytes, |x| x as f32))
}
