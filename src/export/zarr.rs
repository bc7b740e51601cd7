//! Zarr v3, compressed: chunks of a size that suits reading a picture of one band as well as the spectra of a region,
//! several of them in a file (a shard).

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::{Map, Value, json};
use zarrs::array::{Array, ArrayBytes, ArrayMetadata};
use zarrs::storage::store::MemoryStore;
use zarrs::storage::{ReadableStorageTraits, WritableStorageTraits};

use super::{PIECE_BYTES, Progress, check_space, long_name, units};
use crate::cube::{FACTORED, Integers, Quantity, Rect, SENSOR_FORMAT, Strides, View, plain_attributes};
use crate::files::output::{NewFolder, Product, cannot_write, only_holds};
use crate::{Error, Result, files};

/// What [`write`] writes.
pub const STORE: Product = Product {
    name: "a Zarr store that `export` wrote",
    extensions: &["zarr"],
    is_stream: false,
    is_folder: true,
    check: is_store,
};

/// The attribute that tells who wrote a store.
const SOURCE: &str = "source";
const SOURCE_BEGINS: &str = "Spectile ";
/// The array whose attributes say where on a map a picture lies (CF, grid mappings).
const SPATIAL_REF: &str = "spatial_ref";
/// All arrays that stores may have.
const ARRAYS: [&str; 13] = [
    "radiance",
    "counts",
    "standard_error",
    "brightness_temperature",
    "xyz",
    "reflectance",
    SPATIAL_REF,
    "wavelength",
    "wavelength_width",
    "wavelength_bounds",
    "response_integral",
    "x",
    "y",
];

/// Whether the group was made by an export, and holds nothing else. A cube is not.
fn is_store(folder: &Path) -> std::result::Result<(), String> {
    let text = fs::read(folder.join("zarr.json")).map_err(|_| "holds no zarr.json")?;
    let group: Value = serde_json::from_slice(&text).map_err(|_| "holds a zarr.json that is not JSON")?;
    if group["attributes"]["spectile_format"] != Value::Null || folder.join(".spectile").exists() {
        return Err("is a cube".into());
    }
    if !group["attributes"][SOURCE].as_str().is_some_and(|source| source.starts_with(SOURCE_BEGINS)) {
        return Err("is a store of somebody else".into());
    }
    only_holds(folder, |name| name == "zarr.json" || ARRAYS.contains(&name))?;
    let arrays = ARRAYS.iter().map(|name| folder.join(name)).filter(|array| array.is_dir());
    arrays.into_iter().try_for_each(|array| only_holds(&array, |name| ["zarr.json", "c"].contains(&name)))
}

/// About so many bands and pixels a side go into a chunk: 256 KiB.
const CHUNK_BANDS: usize = 64;
const CHUNK_SIDE: u32 = 32;
/// The most pixels a side of a shard.
const SHARD_SIDE: u32 = 256;
const LEVEL: u32 = 3;

/// How a view is cut.
struct Layout {
    /// Bands, lines and columns of a chunk, and of a file.
    chunk: [u64; 3],
    file: [u64; 3],
}

impl Layout {
    fn new(view: &View, shards: bool) -> Layout {
        let bands = view.channels().len();
        let groups = bands.div_ceil(CHUNK_BANDS);
        let chunk_bands = bands.div_ceil(groups);
        let side = CHUNK_SIDE;
        let chunk = [chunk_bands as u64, side.into(), side.into()];
        if !shards {
            return Layout { chunk, file: chunk };
        }
        // All bands of a square of pixels, as long as that fits into memory.
        let bytes = |side: u32| chunk_bands * groups * (side * side) as usize * 4;
        let [width, height] = view.size();
        let mut file_side = side;
        while file_side < SHARD_SIDE && file_side < width.max(height) && bytes(2 * file_side) <= PIECE_BYTES {
            file_side *= 2;
        }
        Layout { chunk, file: [(chunk_bands * groups) as u64, file_side.into(), file_side.into()] }
    }
}

/// Writes a store, new or in the place of one.
pub fn write(view: &View, path: &Path, shards: bool, progress: &mut Progress) -> Result<Vec<PathBuf>> {
    // As if nothing could be compressed.
    check_space(path, view.bytes())?;
    let folder = NewFolder::create(path, STORE)?;
    let failed = |what: &dyn std::fmt::Display| Error::storage(path, format!("cannot be written: {what}"));
    let layout = Layout::new(view, shards);
    let arrays = arrays(view, &layout)?;
    for (name, metadata) in &arrays {
        let target = folder.aside().join(name);
        fs::create_dir_all(&target)
            .and_then(|()| fs::write(target.join("zarr.json"), format!("{metadata:#}\n")))
            .map_err(|error| cannot_write(path, &error))?;
    }
    let open = |name: &str| -> Result<Chunks> {
        let metadata = arrays.iter().find(|(of, _)| *of == name).map_or(Value::Null, |(_, metadata)| metadata.clone());
        let metadata: ArrayMetadata = serde_json::from_value(metadata).map_err(|error| failed(&error))?;
        let memory = Arc::new(MemoryStore::new());
        let array = Array::new_with_metadata(Arc::clone(&memory), &format!("/{name}"), metadata);
        Ok(Chunks { array: array.map_err(|error| failed(&error))?, memory, folder: folder.aside(), target: path })
    };
    let channels = view.channels();
    let each = |value: &dyn Fn(usize) -> f64| (0..channels.len()).map(value).collect::<Vec<f64>>();
    let ([left, top], [width, height]) = (view.origin(), view.size());
    // On the map, where its axes are those of the picture; else the number of the pixel on the full film.
    let along = |axis: usize, from: u32, count: u32| -> Vec<f64> {
        let place = |i: u32| match upright(view) {
            Some([step, first]) => first[axis] + step[axis] * (f64::from(i) + 0.5),
            None => f64::from(from + i),
        };
        (0..count).map(place).collect()
    };
    for (name, indices, values) in [
        ("wavelength", vec![0], each(&|k| channels.centre(k))),
        ("wavelength_width", vec![0], each(&|k| channels.width(k))),
        ("wavelength_bounds", vec![0, 0], channels.bounds.iter().flatten().copied().collect()),
        ("response_integral", vec![0], each(&|k| channels.integral(k))),
        ("x", vec![0], along(0, left, width)),
        ("y", vec![0], along(1, top, height)),
    ] {
        let bytes: Vec<u8> = bytemuck::cast_slice(&values).to_vec();
        open(name)?.put(&indices, bytes)?;
    }
    let views = views(view)?;
    let (count, pixels) = (views.len() as u64, view.rect().pixels());
    for (i, of) in (0..).zip(&views) {
        let mut tell = |done: u64, _: u64| progress(i * pixels + done, count * pixels);
        write_values(of, &layout, &open(variable(of))?, &mut tell)?;
    }
    let group = group(view, &arrays);
    fs::write(folder.aside().join("zarr.json"), format!("{group:#}\n")).map_err(|error| cannot_write(path, &error))?;
    folder.finish()?;
    Ok(vec![path.to_owned()])
}

/// The chunks of an array, encoded in memory one at a time: a store of zarrs's on disk takes no path that is not UTF-8.
struct Chunks<'a> {
    array: Array<MemoryStore>,
    memory: Arc<MemoryStore>,
    folder: &'a Path,
    /// What errors name.
    target: &'a Path,
}

impl Chunks<'_> {
    /// Writes the chunk (or shard) of these little-endian values; one that holds nothing but the fill value has no file.
    fn put(&self, indices: &[u64], values: Vec<u8>) -> Result<()> {
        let failed = |error: &dyn std::fmt::Display| Error::storage(self.target, format!("cannot be written: {error}"));
        self.array.store_chunk(indices, ArrayBytes::new_flen(values)).map_err(|error| failed(&error))?;
        let key = self.array.chunk_key(indices);
        let Some(encoded) = self.memory.get(&key).map_err(|error| failed(&error))? else { return Ok(()) };
        self.memory.erase(&key).map_err(|error| failed(&error))?;
        let file = self.folder.join(key.as_str());
        let written = fs::create_dir_all(files::parent(&file)).and_then(|()| fs::write(&file, encoded));
        written.map_err(|error| cannot_write(self.target, &error))
    }
}

fn write_values(view: &View, layout: &Layout, chunks: &Chunks, progress: &mut Progress) -> Result<()> {
    let (mut reader, rect, bands) = (view.reader(), view.rect(), view.channels().len());
    let [deep, side, _] = layout.file.map(|n| n as usize);
    let strides = Strides { row: side, pixel: 1, band: side * side };
    let mut values = vec![f32::NAN; deep * side * side];
    for (row, y0) in (0..).zip((rect.y0..rect.y1).step_by(side)) {
        let y1 = y0.saturating_add(side as u32).min(rect.y1);
        for (column, x0) in (0..).zip((rect.x0..rect.x1).step_by(side)) {
            let x1 = x0.saturating_add(side as u32).min(rect.x1);
            for (group, first) in (0..).zip((0..bands).step_by(deep)) {
                // Beyond the edges chunks are padded with the fill value.
                values.fill(f32::NAN);
                let part = first..(first + deep).min(bands);
                reader.read(Rect { x0, y0, x1, y1 }, part, strides, &mut values)?;
                let bytes = match view.integers() {
                    None => bytemuck::cast_slice(&values).to_vec(),
                    Some(integers) => integers.encode(&values),
                };
                chunks.put(&[group, row, column], bytes)?;
            }
        }
        progress(u64::from(y1 - rect.y0) * u64::from(rect.width()), rect.pixels())?;
    }
    Ok(())
}

/// What is written: values, and their standard errors where the cube has them and they are of the same quantity.
fn views<'a>(view: &View<'a>) -> Result<Vec<View<'a>>> {
    let same = matches!(view.quantity(), Quantity::Radiance | Quantity::Integrated);
    let mut views = vec![view.clone()];
    if same && !view.is_of_errors() && view.cube().header().has_uncertainty() {
        views.push(view.clone().of_errors()?);
    }
    Ok(views)
}

/// The name of the array with the values.
fn variable(view: &View) -> &'static str {
    match view.quantity() {
        _ if view.is_of_errors() => "standard_error",
        Quantity::Radiance | Quantity::Integrated => "radiance",
        Quantity::Counts => "counts",
        Quantity::Temperature => "brightness_temperature",
        Quantity::Reflectance => "reflectance",
        Quantity::Xyz(_) => "xyz",
    }
}

/// Steps of x and y on the map from pixel to pixel, and where the first one's corner is; `None` where the picture lies on none, or is turned
/// on it.
fn upright(view: &View) -> Option<[[f64; 2]; 2]> {
    let (_, [a, b, c, d, e, f]) = view.georeference()?;
    let is_upright = b.abs() <= 1e-9 * e.abs() && d.abs() <= 1e-9 * a.abs();
    is_upright.then_some([[a, e], [c, f]])
}

fn group(view: &View, arrays: &[(&str, Value)]) -> Value {
    let header = view.cube().header();
    let mut attributes = header.attributes.clone();
    // Of the cube, which this is no longer.
    attributes.remove("uncertainty");
    // What is exported is radiance.
    attributes.remove(FACTORED);
    attributes.remove(SENSOR_FORMAT);
    attributes.extend([
        ("Conventions".into(), json!("CF-1.11")),
        ("title".into(), json!(if view.cube().is_counts() { "Counts of a sensor" } else { "Spectral image" })),
        (SOURCE.into(), json!(format!("{SOURCE_BEGINS}{}", env!("CARGO_PKG_VERSION")))),
        ("channel_names".into(), json!(view.channels().names)),
    ]);
    if !view.channels().responses.is_empty() {
        attributes.insert("responses".into(), json!(view.channels().responses));
    }
    let metadata: Map<String, Value> = arrays.iter().map(|(name, value)| ((*name).into(), value.clone())).collect();
    json!({
        "zarr_format": 3,
        "node_type": "group",
        "attributes": plain_attributes(attributes),
        "consolidated_metadata": { "kind": "inline", "must_understand": false, "metadata": metadata },
    })
}

fn arrays(view: &View, layout: &Layout) -> Result<Vec<(&'static str, Value)>> {
    let bands = view.channels().len() as u64;
    let [width, height] = view.size().map(u64::from);
    let little = json!({ "name": "bytes", "configuration": { "endian": "little" } });
    let compressed = json!([little, { "name": "zstd", "configuration": { "level": LEVEL, "checksum": false } }]);
    let codecs = if layout.chunk == layout.file {
        compressed
    } else {
        json!([{ "name": "sharding_indexed", "configuration": {
            "chunk_shape": layout.chunk,
            "codecs": compressed,
            "index_codecs": [little, { "name": "crc32c" }],
            "index_location": "end",
        } }])
    };
    let array = |data_type: &str, shape: &[u64], file: &[u64], codecs: Value, names: &[&str], attributes: Value| {
        json!({
            "zarr_format": 3,
            "node_type": "array",
            "shape": shape,
            "data_type": data_type,
            "chunk_grid": { "name": "regular", "configuration": { "chunk_shape": file } },
            "chunk_key_encoding": { "name": "default", "configuration": { "separator": "/" } },
            "fill_value": "NaN",
            "codecs": codecs,
            "attributes": attributes,
            "dimension_names": names,
            "storage_transformers": [],
        })
    };
    let coordinate = |shape: &[u64], names: &[&str], attributes: Value| {
        array("float64", shape, shape, json!([little]), names, attributes)
    };
    let pixel = |axis: &str, side: &str| match upright(view) {
        Some(_) => json!({
            "standard_name": format!("projection_{axis}_coordinate"),
            "long_name": format!("{axis} of the pixel's centre on the map"),
            "units": "m",
        }),
        None => {
            json!({ "long_name": format!("pixel on the full film, from the {side}, the first 0"), "units": "pixel" })
        }
    };
    let mut arrays = Vec::new();
    for of in views(view)? {
        let mut attributes = json!({
            "long_name": long_name(&of),
            "units": units(&of),
            "coordinates": "wavelength_width response_integral",
        });
        if view.georeference().is_some() {
            attributes["grid_mapping"] = json!(SPATIAL_REF);
            attributes["coordinates"] = json!(format!("wavelength_width response_integral {SPATIAL_REF}"));
        }
        let names = ["wavelength", "y", "x"];
        let shape = [bands, height, width];
        let (kind, fill) = match view.integers() {
            None => ("float32", json!("NaN")),
            Some(Integers { is_short: true, missing }) => ("uint16", json!(missing)),
            Some(Integers { missing, .. }) => ("uint32", json!(missing)),
        };
        if view.integers().is_some() {
            // By which CF and xarray know what is missing.
            attributes["_FillValue"] = fill.clone();
        }
        let mut values = array(kind, &shape, &layout.file, codecs.clone(), &names, attributes);
        values["fill_value"] = fill;
        arrays.push((variable(&of), values));
    }
    arrays.extend([
        (
            "wavelength",
            coordinate(
                &[bands],
                &["wavelength"],
                json!({
                    "standard_name": "radiation_wavelength",
                    "long_name": "centre of the channel",
                    "units": "nm",
                    "bounds": "wavelength_bounds",
                }),
            ),
        ),
        (
            "wavelength_width",
            coordinate(&[bands], &["wavelength"], json!({ "long_name": "width of the channel", "units": "nm" })),
        ),
        (
            "wavelength_bounds",
            coordinate(
                &[bands, 2],
                &["wavelength", "bnds"],
                json!({ "long_name": "lower and upper end of the channel", "units": "nm" }),
            ),
        ),
        (
            "response_integral",
            coordinate(
                &[bands],
                &["wavelength"],
                json!({ "long_name": "integral of the channel's response (its width where it has none)", "units": "nm" }),
            ),
        ),
        ("y", coordinate(&[height], &["y"], pixel("y", "top"))),
        ("x", coordinate(&[width], &["x"], pixel("x", "left"))),
    ]);
    if let Some((crs, [a, b, c, d, e, f])) = view.georeference() {
        // As GDAL and rioxarray have them: the corner, and the steps, x first.
        let transform = [c, a, b, f, d, e].map(|number| number.to_string()).join(" ");
        let attributes = json!({ "crs_wkt": crs, "spatial_ref": crs, "GeoTransform": transform });
        let mut array = array("int32", &[], &[], json!([little]), &[], attributes);
        array["fill_value"] = json!(0);
        arrays.push((SPATIAL_REF, array));
    }
    Ok(arrays)
}
