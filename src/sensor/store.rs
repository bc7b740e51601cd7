//! What a sensor's picture is on disk: a Zarr v3 group with `counts` [band, y, x], and the signal without noise on demand.

use std::fs;
use std::path::Path;

use serde_json::{Map, Value, json};

use super::apply::{Applied, Settings};
use super::radiometry::Optical;
use crate::cube::{Cube, SENSOR_FORMAT};
use crate::files::output::{NewFolder, Product, cannot_write, only_holds};
use crate::scene::{Detector, SensorModel};
use crate::{Error, Result, files};

const ARRAYS: [&str; 7] = ["counts", "electrons", "power", "wavelength", "band", "x", "y"];
/// The version of the layout.
const FORMAT: u64 = 1;

const STORE: Product =
    Product { name: "counts of a sensor", extensions: &["zarr"], is_stream: false, is_folder: true, check: is_store };

fn is_store(folder: &Path) -> std::result::Result<(), String> {
    let text = fs::read(folder.join("zarr.json")).map_err(|_| "holds no zarr.json")?;
    let group: Value = serde_json::from_slice(&text).map_err(|_| "holds a zarr.json that is not JSON")?;
    if group["attributes"][SENSOR_FORMAT].is_null() {
        return Err("holds no counts of a sensor".into());
    }
    only_holds(folder, |name| name == "zarr.json" || ARRAYS.contains(&name))?;
    let arrays = ARRAYS.iter().map(|name| folder.join(name)).filter(|array| array.is_dir());
    arrays.into_iter().try_for_each(|array| only_holds(&array, |name| ["zarr.json", "c"].contains(&name)))
}

/// What stands for a pixel that is missing: beyond what the converter counts.
fn fill(model: &SensorModel) -> u32 {
    if is_short(model) { u16::MAX.into() } else { u32::MAX }
}

fn is_short(model: &SensorModel) -> bool {
    model.bits < 16
}

/// Of one tile: [band][y][x].
pub(super) struct Values {
    counts: Vec<u32>,
    signal: Option<Vec<f32>>,
    fill: u32,
}

impl Values {
    pub fn new(count: usize, model: &SensorModel, with_signal: bool) -> Values {
        let fill = fill(model);
        Values { counts: vec![fill; count], signal: with_signal.then(|| vec![f32::NAN; count]), fill }
    }

    pub fn clear(&mut self) {
        self.counts.fill(self.fill);
        self.signal.iter_mut().for_each(|signal| signal.fill(f32::NAN));
    }

    /// Rows of `width` pixels.
    pub fn rows(&mut self, width: usize) -> impl Iterator<Item = (&mut [u32], Option<&mut [f32]>)> {
        let mut signal = self.signal.as_mut().map(|signal| signal.chunks_mut(width));
        self.counts.chunks_mut(width).map(move |row| (row, signal.as_mut().and_then(Iterator::next)))
    }
}

/// A store that is being filled beside its place.
pub(super) struct Store<'a> {
    folder: NewFolder,
    path: &'a Path,
    attributes: Map<String, Value>,
    arrays: Vec<(&'static str, Value)>,
    is_short: bool,
    /// The array of the signal.
    signal: &'static str,
}

impl<'a> Store<'a> {
    pub fn create(
        path: &'a Path,
        cube: &Cube,
        model: &SensorModel,
        bands: &[Optical],
        settings: &Settings,
    ) -> Result<Store<'a>> {
        if !settings.overwrite && path.exists() {
            let what = "exists already; choose another name, or --overwrite to replace counts of a sensor";
            return Err(Error::Usage(format!("{} {what}", path.display())));
        }
        let header = cube.header();
        let ([width, height], [tile_width, tile_height]) = (header.size, header.tile);
        let (n, [left, top]) = (bands.len(), header.origin);
        let values = u64::from(width) * u64::from(height) * n as u64;
        let bytes = values * (if is_short(model) { 2 } else { 4 } + if settings.electrons { 4 } else { 0 });
        if let Some(free) = files::free_bytes(files::parent(path)).filter(|free| *free < bytes) {
            return Err(Error::Usage(format!(
                "{}: the counts need {}, and {} are free there; use another disk",
                path.display(),
                files::format_bytes(bytes),
                files::format_bytes(free)
            )));
        }
        let is_photon = matches!(model.kind, Detector::Photon { .. });
        let signal = if is_photon { "electrons" } else { "power" };
        let image = |data_type: &str, fill: Value, attributes: Value| {
            let chunk = json!([n, tile_height, tile_width]);
            array(json!([n, height, width]), chunk, data_type, fill, json!(["band", "y", "x"]), attributes)
        };
        let filler = fill(model);
        let mut arrays = vec![(
            "counts",
            image(
                if is_short(model) { "uint16" } else { "uint32" },
                json!(filler),
                json!({ "long_name": "counts", "units": "1", "_FillValue": filler, "coordinates": "wavelength" }),
            ),
        )];
        if settings.electrons {
            let (name, units) =
                if is_photon { ("electrons without noise", "1") } else { ("power on the detector", "W") };
            arrays.push((signal, image("float32", json!("NaN"), json!({ "long_name": name, "units": units }))));
        }
        let centres = |from: u32, count: u32| (0..count).map(|i| f64::from(from + i) + 0.5).collect::<Vec<f64>>();
        let lines = [
            ("wavelength", "band", bands.iter().map(|band| band.centre).collect(), "nm"),
            ("band", "band", (0..n).map(|i| i as f64).collect::<Vec<f64>>(), "1"),
            ("x", "x", centres(left, width), "pixel"),
            ("y", "y", centres(top, height), "pixel"),
        ];
        let folder = NewFolder::create(path, STORE)?;
        for (name, dimension, values, units) in lines {
            let shape = json!([values.len()]);
            let attributes = json!({ "units": units });
            arrays.push((name, array(shape.clone(), shape, "float64", json!("NaN"), json!([dimension]), attributes)));
            write(path, &folder.aside().join(name).join("c/0"), bytemuck::cast_slice(&values))?;
        }
        let attributes = json!({
            "Conventions": "CF-1.11",
            "title": "Counts of a sensor",
            SENSOR_FORMAT: FORMAT,
            "spectile_version": env!("CARGO_PKG_VERSION"),
            "sensor": settings.about,
            "band_names": bands.iter().map(|band| &band.name).collect::<Vec<_>>(),
            "seed": settings.seed,
            "noise": if settings.noise { "on" } else { "off" },
            "bits": model.bits,
            "offset_counts": model.offset,
            "reference_temperature_K": model.reference_temperature,
            "channels_integrated": cube.channels().len(),
        });
        let mut attributes = attributes.as_object().cloned().unwrap_or_default();
        if let Detector::Photon { gain, .. } = model.kind {
            attributes.insert("gain_electrons_per_count".into(), json!(gain));
        }
        if let Some(digest) = header.attributes.get("scene_digest") {
            attributes.insert("scene_digest".into(), digest.clone());
        }
        Ok(Store { folder, path, attributes, arrays, is_short: is_short(model), signal })
    }

    /// Writes the tile in this column and row.
    pub fn put(&mut self, [column, row]: [u32; 2], values: &Values) -> Result<()> {
        let place = |name: &str| self.folder.aside().join(name).join(format!("c/0/{row}/{column}"));
        let bytes: Vec<u8> = if self.is_short {
            values.counts.iter().flat_map(|count| (*count as u16).to_le_bytes()).collect()
        } else {
            values.counts.iter().flat_map(|count| count.to_le_bytes()).collect()
        };
        write(self.path, &place("counts"), &bytes)?;
        match &values.signal {
            Some(signal) => write(self.path, &place(self.signal), bytemuck::cast_slice(signal)),
            None => Ok(()),
        }
    }

    /// Writes what was found, and gives the store its name.
    pub fn finish(self, applied: &Applied) -> Result<()> {
        let mut attributes = self.attributes;
        let each = |value: &dyn Fn(&super::BandReport) -> Value| applied.bands.iter().map(value).collect::<Vec<_>>();
        attributes.extend([
            ("snr_at_mean".into(), json!(each(&|band| json!(band.figures.snr)))),
            ("nedl".into(), json!(each(&|band| json!(band.figures.nedl)))),
            ("mean_signal".into(), json!(each(&|band| json!(band.mean_signal)))),
            ("full_wells".into(), json!(each(&|band| json!(band.clipped.full_wells)))),
            ("clipped_above".into(), json!(each(&|band| json!(band.clipped.above)))),
            ("clipped_below".into(), json!(each(&|band| json!(band.clipped.below)))),
            // NaN, as text, where a band has none: lists in netCDF are of one kind.
            ("netd_K".into(), json!(each(&|band| json!(band.figures.netd.map_or("NaN".into(), |k| k.to_string()))))),
        ]);
        for (name, metadata) in &self.arrays {
            let text = format!("{metadata:#}\n");
            write(self.path, &self.folder.aside().join(name).join("zarr.json"), text.as_bytes())?;
        }
        let consolidated: Map<String, Value> =
            self.arrays.iter().map(|(name, metadata)| ((*name).to_owned(), metadata.clone())).collect();
        let group = json!({
            "zarr_format": 3,
            "node_type": "group",
            "attributes": attributes,
            "consolidated_metadata": { "kind": "inline", "must_understand": false, "metadata": consolidated },
        });
        write(self.path, &self.folder.aside().join("zarr.json"), format!("{group:#}\n").as_bytes())?;
        self.folder.finish()
    }
}

fn array(shape: Value, chunk: Value, data_type: &str, fill: Value, dimensions: Value, attributes: Value) -> Value {
    json!({
        "zarr_format": 3,
        "node_type": "array",
        "shape": shape,
        "data_type": data_type,
        "chunk_grid": { "name": "regular", "configuration": { "chunk_shape": chunk } },
        "chunk_key_encoding": { "name": "default", "configuration": { "separator": "/" } },
        "fill_value": fill,
        "codecs": [{ "name": "bytes", "configuration": { "endian": "little" } }],
        "dimension_names": dimensions,
        "attributes": attributes,
        "storage_transformers": [],
    })
}

/// Errors name the store.
fn write(store: &Path, file: &Path, bytes: &[u8]) -> Result<()> {
    let written = fs::create_dir_all(files::parent(file)).and_then(|()| files::write_durably(file, bytes));
    written.map_err(|error| cannot_write(store, &error))
}
