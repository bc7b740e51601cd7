//! Arrays in Zarr stores, version 2 or 3, as the conventions of CF write them: packed numbers (`scale_factor`, `add_offset`), missing
//! ones (`_FillValue`, `missing_value`, valid ranges), units and names of dimensions. The one place where these are applied.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use half::f16;
use serde_json::{Map, Value};
use zarrs::array::{Array, ArrayBytes, ElementOwned};

use folder::Folder;

use super::table::shown;
use super::unit::{self, FACTORS, Measure};
use crate::error::Problem;

mod folder;

type Read<T> = Result<T, Box<Problem>>;

/// An array of a store: what its metadata say.
#[derive(Debug, Clone)]
pub struct Variable {
    /// The folder of the array.
    path: PathBuf,
    pub name: String,
    pub shape: Vec<u64>,
    /// The name of every dimension, empty where it has none.
    pub dimensions: Vec<String>,
    pub attributes: Map<String, Value>,
    fill_value: Option<Value>,
    /// Whether the store is of version 2, where CF's `_FillValue` stands as `fill_value`.
    is_v2: bool,
    packing: Packing,
}

/// Chunks of an array that have no file.
struct Lost {
    /// The name of the first.
    first: String,
    count: u64,
    of: u64,
}

/// How stored numbers become values.
#[derive(Debug, Clone, Default, PartialEq)]
struct Packing {
    scale: Option<f64>,
    offset: Option<f64>,
    /// Stored numbers that stand for none.
    missing: Vec<f64>,
    /// Stored numbers that may be.
    valid: Option<[f64; 2]>,
    /// Whether stored integers are to be taken without or with a sign, whatever their type.
    unsigned: Option<bool>,
}

fn whole(path: &Path, message: String, help: &str) -> Box<Problem> {
    let help = (!help.is_empty()).then(|| help.to_owned());
    Box::new(Problem { file: path.to_owned(), message, help, ..Problem::default() })
}

/// The arrays of the group at `path`, by name. Only their metadata are looked at: what they are compressed with matters to who
/// reads them.
pub fn arrays(path: &Path) -> Read<Vec<Variable>> {
    let what = if Variable::open(path)?.is_some() {
        Some("is one Zarr array")
    } else if !["zarr.json", ".zgroup", ".zmetadata"].iter().any(|name| path.join(name).is_file()) {
        Some("is no Zarr store")
    } else {
        None
    };
    if let Some(what) = what {
        let help = "give the folder of a group with `zarr.json` or `.zgroup` in it";
        return Err(whole(path, what.to_owned(), help));
    }
    let entries = std::fs::read_dir(path).map_err(|e| whole(path, format!("cannot be read: {e}"), ""))?;
    let mut folders: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).filter(|path| path.is_dir()).collect();
    folders.sort();
    let mut found = Vec::new();
    for folder in folders {
        if let Some(array) = Variable::open(&folder)? {
            found.push(array);
        }
    }
    Ok(found)
}

/// The groups right within the group at `path`, by name.
pub fn groups(path: &Path) -> Vec<String> {
    let is_group = |path: &Path| {
        let is_v3 = matches!(json(&path.join("zarr.json")), Ok(Some(data)) if data["node_type"] == "group");
        is_v3 || path.join(".zgroup").is_file()
    };
    let entries = std::fs::read_dir(path).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut names: Vec<String> = entries
        .filter(|path| is_group(path))
        .filter_map(|path| Some(path.file_name()?.to_string_lossy().into_owned()))
        .collect();
    names.sort();
    names
}

fn json(path: &Path) -> Read<Option<Value>> {
    match std::fs::read(path) {
        Ok(bytes) => serde_json::from_slice(&bytes)
            .map(Some)
            .map_err(|e| whole(path, format!("is no JSON that can be read: {e}"), "")),
        Err(e) if matches!(e.kind(), std::io::ErrorKind::NotFound | std::io::ErrorKind::NotADirectory) => Ok(None),
        Err(e) => Err(whole(path, format!("cannot be read: {e}"), "")),
    }
}

impl Variable {
    /// The array in the folder `path`; `None` if there is none.
    pub fn open(path: &Path) -> Read<Option<Variable>> {
        let (metadata, attributes, is_v2) = match json(&path.join("zarr.json"))? {
            Some(metadata) => {
                if metadata.get("node_type").and_then(Value::as_str) != Some("array") {
                    return Ok(None);
                }
                let attributes = metadata.get("attributes").cloned();
                (metadata, attributes, false)
            }
            None => match json(&path.join(".zarray"))? {
                Some(metadata) => (metadata, json(&path.join(".zattrs"))?, true),
                None => return Ok(None),
            },
        };
        let attributes = match attributes {
            Some(Value::Object(attributes)) => attributes,
            _ => Map::new(),
        };
        let shape: Option<Vec<u64>> =
            metadata.get("shape").and_then(Value::as_array).and_then(|sides| sides.iter().map(Value::as_u64).collect());
        let Some(shape) = shape else {
            return Err(whole(path, "is a Zarr array without a `shape`".to_owned(), ""));
        };
        let names = if is_v2 { attributes.get("_ARRAY_DIMENSIONS") } else { metadata.get("dimension_names") };
        let names = names.or(attributes.get("_ARRAY_DIMENSIONS")).and_then(Value::as_array);
        let mut dimensions: Vec<String> = names
            .map(|names| names.iter().map(|name| name.as_str().unwrap_or("").to_owned()).collect())
            .unwrap_or_default();
        dimensions.resize(shape.len(), String::new());
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let fill_value = metadata.get("fill_value").cloned();
        let (path, packing) = (path.to_owned(), Packing::default());
        let mut variable = Variable { path, name, shape, dimensions, attributes, fill_value, is_v2, packing };
        variable.packing = variable.packing()?;
        Ok(Some(variable))
    }

    /// What is wrong with the array.
    pub fn problem(&self, message: String, help: &str) -> Box<Problem> {
        whole(&self.path, message, help)
    }

    /// A number that an attribute holds, also as text or as a list of one.
    fn number(&self, key: &str) -> Read<Option<f64>> {
        match self.attributes.get(key) {
            None | Some(Value::Null) => Ok(None),
            Some(value) => match number(value).filter(|number| number.is_finite()) {
                Some(number) => Ok(Some(number)),
                None => Err(self.problem(format!("has the attribute `{key}` = {value}, which is no number"), "")),
            },
        }
    }

    fn packing(&self) -> Read<Packing> {
        let (scale, offset) = (self.number("scale_factor")?, self.number("add_offset")?);
        let mut missing = Vec::new();
        for key in ["_FillValue", "missing_value"] {
            let Some(value) = self.attributes.get(key) else { continue };
            let values = match value {
                Value::Array(values) => values.iter().map(fill).collect::<Option<Vec<f64>>>(),
                Value::Null => Some(Vec::new()),
                one => fill(one).map(|value| vec![value]),
            };
            match values {
                Some(values) => missing.extend(values),
                None => {
                    return Err(self.problem(format!("has the attribute `{key}` = {value}, which is no number"), ""));
                }
            }
        }
        // 0 is what stores get that nobody asked: a number like any other.
        let of_store = self.fill_value.as_ref().filter(|_| self.is_v2);
        missing.extend(of_store.and_then(fill).filter(|value| *value != 0.0));
        let mut valid = match self.attributes.get("valid_range") {
            None | Some(Value::Null) => None,
            Some(Value::Array(range)) if range.len() == 2 => match (number(&range[0]), number(&range[1])) {
                (Some(from), Some(to)) => Some([from, to]),
                _ => return Err(self.problem("has a `valid_range` that is not two numbers".to_owned(), "")),
            },
            Some(_) => return Err(self.problem("has a `valid_range` that is not two numbers".to_owned(), "")),
        };
        if let Some(least) = self.number("valid_min")? {
            valid = Some([least, valid.map_or(f64::INFINITY, |v| v[1])]);
        }
        if let Some(most) = self.number("valid_max")? {
            valid = Some([valid.map_or(f64::NEG_INFINITY, |v| v[0]), most]);
        }
        let unsigned = match self.attributes.get("_Unsigned") {
            Some(Value::String(text)) => Some(text.eq_ignore_ascii_case("true")),
            Some(Value::Bool(is)) => Some(*is),
            _ => None,
        };
        Ok(Packing { scale, offset, missing, valid, unsigned })
    }

    /// `units`, and what they are where they are understood.
    pub fn units(&self) -> Option<(&str, Option<Measure>)> {
        let text = self.units_text()?;
        Some((text, unit::parse(text)))
    }

    /// `units` in any case, or `unit`.
    fn units_text(&self) -> Option<&str> {
        let text = |wanted: &str| {
            let mut found = self.attributes.iter().filter(|(key, _)| key.eq_ignore_ascii_case(wanted));
            found.find_map(|(_, value)| value.as_str().map(str::trim).filter(|text| !text.is_empty()))
        };
        self.attributes
            .get("units")
            .and_then(Value::as_str)
            .map(str::trim)
            .filter(|text| !text.is_empty())
            .or_else(|| text("units").or_else(|| text("unit")))
    }

    fn broken(&self, e: &dyn std::fmt::Display) -> Box<Problem> {
        let help = "what is uncompressed, or compressed with zstd, gzip, zlib, bz2 or Blosc, is read: in Python \
                    `xarray.open_zarr(…).to_zarr(…, zarr_format=3)` writes that";
        self.problem(format!("cannot be read as a Zarr array: {e}"), help)
    }

    fn array(&self) -> Read<Array<Folder>> {
        let folder = Folder { path: self.path.clone() };
        Array::open(Arc::new(folder), "/").map_err(|e| self.broken(&e))
    }

    /// Refuses attributes that scale numbers, or say which are none, by other names than CF's: nothing here applies them.
    fn refuse_what_is_not_applied(&self) -> Read<()> {
        const APPLIED: [&str; 4] = ["scale_factor", "add_offset", "_FillValue", "missing_value"];
        const NO_VALUE: [&str; 6] = ["ignore value", "nodata", "no data", "fillvalue", "fill value", "missing value"];
        let changes = |(key, value): &(&String, &Value)| {
            let lower = key.to_lowercase().replace(['_', '-'], " ");
            let has = |words: &[&str]| words.iter().any(|word| lower.contains(word));
            // By other keys only numbers can be meant: a `calibration` is mostly a date.
            let is_number = || matches!(value, Value::Number(_) | Value::Bool(true)) || value.is_array();
            let is = |words: &[&str]| words.contains(&lower.as_str());
            let scales = has(&FACTORS) || has(&["slope"]) || (has(&["scaling", "calibration"]) && is_number());
            let shifts = has(&["offset", "intercept"]) || (is(&["bias", "zero"]) && is_number());
            let is_missing = has(&NO_VALUE) || is(&["fill", "missing", "mask value"]);
            let is_function = is(&["db", "log", "log10", "logarithm"]);
            let other_units = is(&["units", "unit"]) && value.as_str().map(str::trim) != self.units_text();
            let neutral = match (scales, shifts) {
                (true, _) => 1.0,
                (false, true) => 0.0,
                (false, false) if other_units => return value.as_str().is_some_and(|text| !text.trim().is_empty()),
                (false, false) if is_function => {
                    return !matches!(value, Value::Null | Value::Bool(false)) && number(value) != Some(0.0);
                }
                (false, false) if is(&["transform"]) => return value.as_str().is_some_and(unit::is_logarithm_only),
                (false, false) => return is_missing && !value.is_null(),
            };
            let is_neutral = |value: &Value| number(value) == Some(neutral);
            match value {
                Value::Null => false,
                Value::Array(all) => !all.iter().all(is_neutral),
                Value::String(text) if ["", "none", "linear"].contains(&text.trim().to_lowercase().as_str()) => false,
                one => !is_neutral(one),
            }
        };
        let is_applied = |key: &String| APPLIED.contains(&key.as_str());
        match self.attributes.iter().filter(|(key, _)| !is_applied(key)).find(changes) {
            None => Ok(()),
            Some((key, value)) => {
                let value = shown(&value.to_string());
                let help =
                    "apply it and remove it; CF's `scale_factor`, `add_offset` and `_FillValue` are applied here";
                Err(self.problem(format!("has the attribute `{key}` = {value}, which is not applied"), help))
            }
        }
    }

    /// What to say of chunks without a file, if there are any, in words that go on after the store's name: they read as the
    /// fill value.
    pub fn lost_chunks(&self) -> Read<Option<String>> {
        let Some(Lost { first, count, of }) = self.lost(&self.array()?) else { return Ok(None) };
        let fill = self.fill_value.as_ref().map_or("0".to_owned(), Value::to_string);
        Ok(Some(format!(
            "has no file of {count} of the {of} chunks of its array `{}`, the first of them `{first}`: they are read as the \
             fill value, {fill}",
            self.name
        )))
    }

    fn lost(&self, array: &Array<Folder>) -> Option<Lost> {
        let grid = array.chunk_grid_shape();
        let of = grid.iter().product();
        let mut lost: Option<Lost> = None;
        for chunk in 0..of {
            let mut rest: u64 = chunk;
            let mut place = vec![0; grid.len()];
            for (at, side) in place.iter_mut().zip(grid).rev() {
                (*at, rest) = (rest % side, rest / side);
            }
            let key = array.chunk_key(&place);
            if !self.path.join(key.as_str()).is_file() {
                lost.get_or_insert_with(|| Lost { first: key.as_str().to_owned(), count: 0, of }).count += 1;
            }
        }
        lost
    }

    /// All values, C order; NaN where there is none. An error where an attribute that is not applied changes them, or where a
    /// chunk without a file has no fill value.
    pub fn values(&self) -> Read<Vec<f64>> {
        self.refuse_what_is_not_applied()?;
        let array = self.array()?;
        if let (Some(Value::Null), Some(Lost { first, count, of })) = (&self.fill_value, self.lost(&array)) {
            let message =
                format!("has no file of {count} of its {of} chunks, the first of them `{first}`, and no fill value");
            return Err(self.problem(message, "copy the store again, whole"));
        }
        let bytes: ArrayBytes<'static> =
            array.retrieve_array_subset(&array.subset_all()).map_err(|e| self.broken(&e))?;
        let stored = numbers(&array, &bytes, self.packing.unsigned)
            .ok_or_else(|| self.problem(format!("holds {}, but must hold real numbers", array.data_type()), ""))?;
        Ok(self.packing.apply(stored))
    }

    /// Numbers in the array, if they can be counted.
    pub fn count(&self) -> Option<u64> {
        self.shape.iter().try_fold(1u64, |n, &side| n.checked_mul(side))
    }
}

impl Packing {
    fn apply(&self, mut stored: Vec<f64>) -> Vec<f64> {
        let (scale, offset) = (self.scale.unwrap_or(1.0), self.offset.unwrap_or(0.0));
        let is_missing = |value: f64| {
            self.missing.contains(&value) || self.valid.is_some_and(|[from, to]| !(from..=to).contains(&value))
        };
        let plain = self.scale.is_none() && self.offset.is_none();
        if plain && self.missing.iter().all(|value| value.is_nan()) && self.valid.is_none() {
            return stored;
        }
        for value in &mut stored {
            *value = if is_missing(*value) { f64::NAN } else { *value * scale + offset };
        }
        stored
    }
}

fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Number(number) => number.as_f64(),
        Value::String(text) => match text.trim() {
            "NaN" | "nan" => Some(f64::NAN),
            "Infinity" | "inf" => Some(f64::INFINITY),
            "-Infinity" | "-inf" => Some(f64::NEG_INFINITY),
            text => text.parse().ok(),
        },
        Value::Array(one) if one.len() == 1 => number(&one[0]),
        _ => None,
    }
}

/// A value that stands for none. xarray writes those of floats as base64 of a little-endian double.
fn fill(value: &Value) -> Option<f64> {
    if let Some(number) = number(value) {
        return Some(number);
    }
    let bytes = BASE64.decode(value.as_str()?).ok()?;
    Some(f64::from_le_bytes(bytes.try_into().ok()?))
}

/// The elements as f64, whatever real numbers they are.
fn numbers(array: &Array<Folder>, bytes: &ArrayBytes<'static>, unsigned: Option<bool>) -> Option<Vec<f64>> {
    fn of<T: ElementOwned>(
        array: &Array<Folder>,
        bytes: &ArrayBytes<'static>,
        f64_of: impl Fn(T) -> f64,
    ) -> Option<Vec<f64>> {
        let elements = T::from_array_bytes(array.data_type(), bytes.clone()).ok()?;
        Some(elements.into_iter().map(f64_of).collect())
    }
    of::<f32>(array, bytes, f64::from)
        .or_else(|| of::<f64>(array, bytes, |x| x))
        .or_else(|| of::<f16>(array, bytes, f64::from))
        .or_else(|| of::<u8>(array, bytes, |x| if unsigned == Some(false) { f64::from(x as i8) } else { f64::from(x) }))
        .or_else(|| of::<i8>(array, bytes, |x| if unsigned == Some(true) { f64::from(x as u8) } else { f64::from(x) }))
        .or_else(|| {
            of::<u16>(array, bytes, |x| if unsigned == Some(false) { f64::from(x as i16) } else { f64::from(x) })
        })
        .or_else(|| {
            of::<i16>(array, bytes, |x| if unsigned == Some(true) { f64::from(x as u16) } else { f64::from(x) })
        })
        .or_else(|| {
            of::<u32>(array, bytes, |x| if unsigned == Some(false) { f64::from(x as i32) } else { f64::from(x) })
        })
        .or_else(|| {
            of::<i32>(array, bytes, |x| if unsigned == Some(true) { f64::from(x as u32) } else { f64::from(x) })
        })
        .or_else(|| of::<u64>(array, bytes, |x| x as f64))
        .or_else(|| of::<i64>(array, bytes, |x| x as f64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// numcodecs' Zlib() as it comes, without a level, in a folder whose name is Latin-1.
    #[cfg(unix)]
    #[test]
    fn folders_of_any_name_and_codecs_without_levels_are_read() {
        use std::os::unix::ffi::OsStrExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(std::ffi::OsStr::from_bytes(b"d\xfcsen"));
        std::fs::create_dir_all(path.join("c")).unwrap();
        // A stored block of the numbers 1 and 2.
        let data: Vec<u8> = [1f32, 2.0].iter().flat_map(|x| x.to_le_bytes()).collect();
        let (mut a, mut b) = (1u32, 0u32);
        for byte in &data {
            a += u32::from(*byte);
            b += a;
        }
        let bytes = [&[0x78, 1, 1, 8, 0, 0xf7, 0xff][..], &data, &(b << 16 | a).to_be_bytes()].concat();
        std::fs::write(path.join("c/0"), bytes).unwrap();
        let metadata = json!({
            "zarr_format": 3, "node_type": "array", "shape": [2], "data_type": "float32", "fill_value": 0.0,
            "chunk_grid": { "name": "regular", "configuration": { "chunk_shape": [2] } },
            "chunk_key_encoding": { "name": "default", "configuration": { "separator": "/" } },
            "codecs": [{ "name": "bytes", "configuration": { "endian": "little" } }, { "name": "numcodecs.zlib", "configuration": {} }],
        });
        std::fs::write(path.join("zarr.json"), metadata.to_string()).unwrap();
        let array = Variable::open(&path).unwrap().unwrap();
        assert_eq!(array.values().unwrap_or_else(|problem| panic!("{problem}")), [1.0, 2.0]);
    }

    #[test]
    fn fill_values_in_every_spelling() {
        for (value, expected) in [
            (json!(-9999), -9999.0),
            (json!([1.5]), 1.5),
            (json!("-1e20"), -1e20),
            // base64.standard_b64encode(struct.pack("<d", x)) of Python.
            (json!("AAAAAADAWEA="), 99.0),
            (json!("AAAAAADwv8A="), -8176.0),
        ] {
            assert_eq!(fill(&value), Some(expected), "{value}");
        }
        assert!(fill(&json!("AAAAAAAA+H8=")).is_some_and(f64::is_nan));
        assert!(fill(&json!("NaN")).is_some_and(f64::is_nan));
        assert_eq!(fill(&json!("missing")), None);
    }
}
