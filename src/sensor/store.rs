//! What a sensor's picture is on disk: a Zarr v3 group with `counts` [band, y, x], and the signal without noise on demand.

use std::fs;
use std::path::Path;

use serde_json::{Map, Value, json};

use super::apply::{Applied, Frame, Settings};
use super::radiometry::Optical;
use crate::cube::{BLOCK, COUNTS_FORMAT, Cube, Grid, SENSOR_FORMAT};
use crate::files::output::{NewFolder, Product, cannot_write, only_holds};
use crate::scene::{Detector, SensorModel};
use crate::{Error, Result, files};

const ARRAYS: [&str; 9] =
    ["counts", "electrons", "power", "overview", "wavelength", "wavelength_bounds", "band", "x", "y"];

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

    /// Means over blocks of [`BLOCK`] pixels a side, of those that are there: [column][row][band].
    fn overview(&self, grid: Grid, bands: usize) -> Vec<f32> {
        let ([columns, rows], [width, height]) = (grid.tile_blocks(), grid.tile);
        let mut means = Vec::with_capacity(columns as usize * rows as usize * bands);
        for (column, row) in (0..columns).flat_map(|column| (0..rows).map(move |row| (column, row))) {
            let side = |first: u32, end: u32| first * BLOCK..((first + 1) * BLOCK).min(end);
            for band in 0..bands {
                let (mut sum, mut there) = (0.0, 0u32);
                for (y, x) in side(row, height).flat_map(|y| side(column, width).map(move |x| (y, x))) {
                    let count = self.counts[(band * height as usize + y as usize) * width as usize + x as usize];
                    if count != self.fill {
                        sum += f64::from(count);
                        there += 1;
                    }
                }
                means.push(if there > 0 { (sum / f64::from(there)) as f32 } else { f32::NAN });
            }
        }
        means
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
    grid: Grid,
    bands: usize,
}

impl<'a> Store<'a> {
    pub fn create(
        path: &'a Path,
        cube: &Cube,
        frame: Frame,
        model: &SensorModel,
        bands: &[Optical],
        settings: &Settings,
    ) -> Result<Store<'a>> {
        if !settings.overwrite && path.exists() {
            let what = "exists already; choose another name, or --overwrite to replace counts of a sensor";
            return Err(Error::Usage(format!("{} {what}", path.display())));
        }
        let header = cube.header();
        let Frame { grid, origin: [left, top], .. } = frame;
        let ([width, height], [tile_width, tile_height]) = (grid.size, grid.tile);
        let n = bands.len();
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
        let [[block_columns, block_rows], [columns, rows]] = [grid.tile_blocks(), grid.blocks()];
        let mut overview = array(
            json!([n, rows, columns]),
            json!([n, block_rows, block_columns]),
            "float32",
            json!("NaN"),
            json!(["band", "overview_y", "overview_x"]),
            json!({ "long_name": format!("mean counts of blocks of {BLOCK} x {BLOCK} pixels"), "units": "1" }),
        );
        // As in a cube of radiance: the band is fastest in the file.
        if let Some(codecs) = overview["codecs"].as_array_mut() {
            codecs.insert(0, json!({ "name": "transpose", "configuration": { "order": [2, 1, 0] } }));
        }
        arrays.push(("overview", overview));
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
        let hull = cube.channels().hull().unwrap_or_default();
        let bounds: Vec<f64> =
            bands.iter().flat_map(|band| band.response.as_ref().map_or(hull, |response| response.support())).collect();
        arrays.push((
            "wavelength_bounds",
            array(
                json!([n, 2]),
                json!([n, 2]),
                "float64",
                json!("NaN"),
                json!(["band", "bnds"]),
                json!({ "long_name": "beyond which the band responds to nothing", "units": "nm" }),
            ),
        ));
        write(path, &folder.aside().join("wavelength_bounds/c/0/0"), bytemuck::cast_slice(&bounds))?;
        let attributes = json!({
            "Conventions": "CF-1.11",
            "title": "Counts of a sensor",
            SENSOR_FORMAT: COUNTS_FORMAT,
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
        let of_kind = match model.kind {
            Detector::Photon { gain, integration_time, dark_current, full_well, read_noise, .. } => vec![
                ("gain_electrons_per_count", json!(gain)),
                ("integration_time_s", json!(integration_time)),
                ("dark_electrons", json!(dark_current * integration_time)),
                ("read_noise_electrons", json!(read_noise)),
                // Absent where there is no limit.
                ("full_well_electrons", json!(full_well)),
            ],
            Detector::Thermal { responsivity, noise_equivalent_power, .. } => vec![
                ("responsivity_counts_per_W", json!(responsivity)),
                ("noise_equivalent_power_W", json!(noise_equivalent_power)),
            ],
        };
        attributes.extend(of_kind.into_iter().filter(|(_, value)| !value.is_null()).map(|(k, v)| (k.to_owned(), v)));
        let optics = &model.optics;
        attributes.extend([
            ("prnu".to_owned(), json!(model.prnu)),
            ("dsnu".to_owned(), json!(model.dsnu)),
            ("f_number".to_owned(), json!(optics.f_number)),
            ("pitch_m".to_owned(), json!(model.pitch)),
            ("oversampling".to_owned(), json!(model.oversampling)),
            ("origin".to_owned(), json!([left, top])),
        ]);
        if let Some(focal_length) = optics.focal_length {
            attributes.insert("focal_length_m".into(), json!(focal_length));
        }
        if let Some(digest) = header.attributes.get("scene_digest") {
            attributes.insert("scene_digest".into(), digest.clone());
        }
        Ok(Store { folder, path, attributes, arrays, is_short: is_short(model), signal, grid, bands: n })
    }

    /// Where it is filled.
    pub fn aside(&self) -> &Path {
        self.folder.aside()
    }

    /// Writes a tile; one of which every pixel is missing is left out, as in a cube.
    pub fn put(&mut self, tile: u32, values: &Values) -> Result<()> {
        if values.counts.iter().all(|count| *count == values.fill) {
            return Ok(());
        }
        let [column, row] = self.grid.position(tile);
        let place = |name: &str| self.folder.aside().join(name).join(format!("c/0/{row}/{column}"));
        let bytes: Vec<u8> = if self.is_short {
            values.counts.iter().flat_map(|count| (*count as u16).to_le_bytes()).collect()
        } else {
            values.counts.iter().flat_map(|count| count.to_le_bytes()).collect()
        };
        write(self.path, &place("counts"), &bytes)?;
        let overview = values.overview(self.grid, self.bands);
        write(self.path, &place("overview"), bytemuck::cast_slice(&overview))?;
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
            ("background_signal".into(), json!(each(&|band| json!(band.background)))),
            ("pixels".into(), json!(applied.pixels)),
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
