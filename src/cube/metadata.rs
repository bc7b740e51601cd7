//! What a cube says about itself: the header, its form as Zarr v3 metadata with CF attributes, and the record under
//! `.spectile/` by which Spectile knows it whatever others make of the attributes.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::{Map, Value, json};

use super::arrays::{arrays, plain};
use super::grid::Grid;
use super::layer::{Layer, LayerNames};
use super::weights::{GROUPS, GROUPS_WITH_UNCERTAINTY, Shape};
use crate::spectral::product::Basis;
use crate::spectral::{Channels, Curve, Response};
use crate::{Error, Result};

/// The version of the layout that is written, `spectile_format` among the attributes of the group.
pub const FORMAT: u64 = 2;

/// The attribute of groups that hold counts of a sensor instead of radiance.
pub const SENSOR_FORMAT: &str = "spectile_sensor_format";
/// Its value: the version of their layout.
pub const COUNTS_FORMAT: u64 = 2;

/// How the files of a tile are laid out in a version of the layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Layout {
    /// Version 1: pixels row by row; `overview` channel by channel. Only read.
    Rows,
    /// Pixels column by column, in `overview` too, the channel fastest: array axes in reverse. An order that is its own
    /// inverse, which programs that mistake a permutation for its inverse read right.
    Columns,
}

impl Layout {
    fn of_format(format: u64) -> Option<Layout> {
        match format {
            1 => Some(Layout::Rows),
            FORMAT => Some(Layout::Columns),
            _ => None,
        }
    }

    /// The place in the file of the pixel in this column and row of a tile of this size.
    pub fn pixel(self, [width, height]: [u32; 2], x: u32, y: u32) -> usize {
        match self {
            Layout::Rows => y as usize * width as usize + x as usize,
            Layout::Columns => x as usize * height as usize + y as usize,
        }
    }
}

/// Everything about a cube that is fixed when it is created.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Column and row, on the full film, of the cube's top left pixel: not zero under `film.crop`.
    pub origin: [u32; 2],
    /// Width and height of a tile in pixels; a multiple of 8, or at least the picture's own width or height.
    pub tile: [u32; 2],
    pub channels: Channels,
    /// Samples per pixel of a full epoch, a power of two up to 1,024.
    pub epoch: u32,
    /// Further attributes of the group: scene digest, settings, seed, evaluator, …
    pub attributes: Map<String, Value>,
}

/// The attribute of cubes with standard errors.
pub(super) const UNCERTAINTY: &str = "uncertainty";

/// Of a cube that holds weights of products of spectra: which spectra.
pub const FACTORED: &str = "factored";

/// Of a cube with layers: which, and what their numbers stand for ([`LayerNames`]).
pub const LAYERS: &str = "layers";

/// Of a cube that lies on a map: the coordinate reference system, and where on the map the place x, y is, in pixels from the cube's top left
/// corner: a x + b y + c, d x + e y + f.
pub const CRS: &str = "crs";
pub const AFFINE: &str = "affine";

/// Of a cube whose camera has an angle: the tangent of the one that a pixel spans on the axis, which is pitch over focal length.
pub const PIXEL_TANGENT: &str = "pixel_tangent";

/// Of a cube that was made of another one's channels: how.
pub(super) const DERIVED: &str = "derived";

/// Places in a tile's files are exact in f32.
const MOST_FACTORED_PIXELS: usize = 1 << 16;

/// Attributes of the group that the header's own fields make.
const RESERVED: [&str; 9] = [
    "Conventions",
    "title",
    "spectile_format",
    "spectile_version",
    "epoch",
    "origin",
    "channel_names",
    "false_colour",
    "responses",
];

impl Header {
    /// Whether the cube has the array `standard_error`: an attribute says so where it has.
    pub fn has_uncertainty(&self) -> bool {
        self.attributes.get(UNCERTAINTY) == Some(&Value::Bool(true))
    }

    /// Degrees of freedom of the standard errors after so many epochs: of factored cubes, and those made of them, these are told apart
    /// in a few groups only.
    pub fn freedom(&self, epochs: u32) -> u32 {
        let is_relit = self.attributes.get(DERIVED).is_some_and(|derived| !derived["relit"].is_null());
        let spreads = if self.is_factored() || is_relit { epochs.min(GROUPS_WITH_UNCERTAINTY as u32) } else { epochs };
        spreads.saturating_sub(1)
    }

    /// The same with the array `standard_error`.
    pub fn with_uncertainty(mut self) -> Header {
        self.attributes.insert(UNCERTAINTY.into(), Value::Bool(true));
        self
    }

    /// The same with these layers; without any, as it is.
    pub fn with_layers(mut self, names: &LayerNames) -> Header {
        if !names.layers.is_empty() {
            self.attributes.insert(LAYERS.into(), json!(names));
        }
        self
    }

    /// What the layers' numbers stand for.
    pub fn layer_names(&self) -> LayerNames {
        let names = self.attributes.get(LAYERS).and_then(|value| serde_json::from_value(value.clone()).ok());
        names.unwrap_or_default()
    }

    /// The layers that the cube has.
    pub fn layers(&self) -> Vec<Layer> {
        self.layer_names().layers.iter().filter_map(|name| Layer::named(name)).collect()
    }

    /// The coordinate reference system of a cube that lies on a map, and its affine transform from pixels to there.
    pub fn georeference(&self) -> Option<(&str, [f64; 6])> {
        let affine = serde_json::from_value(self.attributes.get(AFFINE)?.clone()).ok()?;
        Some((self.attributes.get(CRS)?.as_str()?, affine))
    }

    /// [`PIXEL_TANGENT`], of cubes that tell it.
    pub fn pixel_tangent(&self) -> Option<f64> {
        self.attributes.get(PIXEL_TANGENT).and_then(Value::as_f64)
    }

    /// Whether the cube holds weights of products of spectra instead of radiance.
    pub fn is_factored(&self) -> bool {
        self.attributes.contains_key(FACTORED)
    }

    /// What the products of a factored cube are made of.
    pub fn basis(&self) -> Option<Basis> {
        serde_json::from_value(self.attributes.get(FACTORED)?.get("basis")?.clone()).ok()
    }

    /// The same cube, with weights of products of spectra of `basis`, of so many factors at most, instead of radiance; and where
    /// something does not separate, which `remainder` has in words, a remainder in channels; `beside` are named spectra that are in that
    /// alone.
    pub fn with_weights(mut self, basis: &Basis, most_factors: u32, remainder: &[String], beside: &[String]) -> Header {
        let mut factored = json!({ "most_factors": most_factors, "basis": basis });
        if !remainder.is_empty() {
            factored["remainder"] = json!(remainder);
        }
        if !beside.is_empty() {
            factored["remainder_spectra"] = json!(beside);
        }
        self.attributes.insert(FACTORED.into(), factored);
        self
    }

    /// What of a factored cube's scene does not separate, in words: it lies in the array `remainder`.
    pub fn remainder(&self) -> Vec<String> {
        self.words_of_factored("remainder")
    }

    /// The named spectra of a factored cube that are in no product, but in what does not separate; none in cubes of older versions.
    pub fn spectra_of_remainder(&self) -> Vec<String> {
        self.words_of_factored("remainder_spectra")
    }

    fn words_of_factored(&self, name: &str) -> Vec<String> {
        let written = self.attributes.get(FACTORED).and_then(|of| of.get(name));
        written.and_then(|words| serde_json::from_value(words.clone()).ok()).unwrap_or_default()
    }

    pub fn has_remainder(&self) -> bool {
        self.attributes.get(FACTORED).is_some_and(|of| of.get("remainder").is_some())
    }

    /// The numbers of factors and of sources of a factored cube.
    pub(super) fn basis_size(&self) -> [usize; 2] {
        let count =
            |name: &str| self.attributes.get(FACTORED).map_or(0, |of| of["basis"][name].as_array().map_or(0, Vec::len));
        [count("factors"), count("sources")]
    }

    pub fn most_factors(&self) -> usize {
        self.attributes.get(FACTORED).and_then(|of| of["most_factors"].as_u64()).unwrap_or(0) as usize
    }

    /// Parts of the epochs whose weights are told apart.
    pub(super) fn groups(&self) -> usize {
        if self.has_uncertainty() { GROUPS_WITH_UNCERTAINTY } else { GROUPS }
    }

    pub fn grid(&self) -> Grid {
        Grid { size: self.size, tile: self.tile }
    }

    /// Bytes of one chunk of `radiance`.
    pub fn chunk_bytes(&self) -> u64 {
        u64::from(self.tile[0]) * u64::from(self.tile[1]) * self.channels.len() as u64 * 4
    }

    /// Bytes on disk of the finished cube.
    pub fn store_bytes(&self) -> u64 {
        self.bytes_with_tiles(self.grid().count().into())
    }

    /// Bytes on disk of a cube that has so many of its tiles. Files take whole blocks of 4 KiB, and folders one.
    pub(super) fn bytes_with_tiles(&self, tiles: u64) -> u64 {
        const BLOCK_BYTES: u64 = 4096;
        // Metadata and coordinates of ten arrays, the facts of a few runs, and their folders.
        const FIXED_BLOCKS: u64 = 66;
        let in_blocks = |bytes: u64| bytes.div_ceil(BLOCK_BYTES) * BLOCK_BYTES;
        let channels = self.channels.len() as u64;
        let pixels = u64::from(self.tile[0]) * u64::from(self.tile[1]);
        let blocks = self.grid().tile_blocks().map(u64::from);
        let names = self.layer_names();
        let journal = super::journal::most_bytes(self);
        let errors = if self.has_uncertainty() { pixels * channels * 4 } else { 0 };
        let (radiance, errors) = match self.is_factored() {
            false => (pixels * channels * 4, errors),
            // With as many entries as are kept.
            true => (pixels * Shape::of(self).entry_bytes(), pixels * 16),
        };
        let of_remainder = match (self.has_remainder(), self.has_uncertainty()) {
            (false, _) => 0,
            (true, false) => 1,
            (true, true) => 2,
        };
        let files = [radiance, errors, pixels * 12, blocks[0] * blocks[1] * channels * 4, 4, journal];
        // Each tile has a folder of `preview`, each row of tiles one of every array.
        let layers = self.layers();
        let in_layers = layers.iter().map(|layer| in_blocks(pixels * layer.pixel_bytes() as u64) + BLOCK_BYTES);
        let in_remainder = of_remainder * in_blocks(pixels * channels * 4);
        let tile = files.into_iter().map(in_blocks).sum::<u64>() + BLOCK_BYTES + in_remainder + in_layers.sum::<u64>();
        // Each in the attributes of the group, of its array, and in the record; three arrays' metadata, and folders.
        let of_layers =
            names.objects.iter().chain(&names.materials).map(|name| 4 * name.len() as u64 + 64).sum::<u64>()
                + layers.len() as u64 * 3 * BLOCK_BYTES;
        let [_, rows] = self.grid().tiles().map(u64::from);
        // Names stand on a line each; centres, bounds and integrals are four doubles.
        let names: u64 = self.channels.names.iter().map(|name| name.len() as u64 + 16).sum();
        // A node of a response is two numbers, a line each.
        let nodes = |response: &Response| match response.curve() {
            Curve::Linear { nm, .. } => 64 * nm.len() as u64,
            _ => 0,
        };
        let names = names + self.channels.responses.iter().map(nodes).sum::<u64>();
        let coordinates = 32 * channels + 8 * (u64::from(self.size[0]) + u64::from(self.size[1]));
        // The record has the names and nodes again, and bounds as text.
        let record = in_blocks(names + 64 * channels);
        // A number as text for each channel that devices render.
        let choices = in_blocks(1024 + 25 * channels);
        let metadata = FIXED_BLOCKS * BLOCK_BYTES
            + in_blocks(names)
            + record
            + choices
            + in_blocks(coordinates)
            + in_blocks(of_layers)
            + of_remainder * 3 * BLOCK_BYTES
            + (5 + of_remainder + layers.len() as u64) * rows * BLOCK_BYTES;
        tile.saturating_mul(tiles).saturating_add(metadata)
    }

    /// What of this cube's identity is not as in `wanted`, in words; `None` where both are one.
    pub(super) fn difference(&self, wanted: &Header) -> Option<String> {
        let size = |[width, height]: [u32; 2]| format!("{width} x {height}");
        let there_and_wanted =
            |what: &str, there: String, wanted: String| Some(format!("{what}: {there} in the cube, {wanted} now"));
        if self.size != wanted.size {
            return there_and_wanted("size", size(self.size), size(wanted.size));
        }
        if self.origin != wanted.origin {
            return there_and_wanted(
                "film.crop",
                format!("from {:?}", self.origin),
                format!("from {:?}", wanted.origin),
            );
        }
        if self.channels != wanted.channels {
            let (there, wanted) = (&self.channels, &wanted.channels);
            return match (0..there.len().min(wanted.len())).find(|&k| there.bounds[k] != wanted.bounds[k]) {
                _ if there.len() != wanted.len() => {
                    there_and_wanted("channels", there.len().to_string(), wanted.len().to_string())
                }
                Some(k) => {
                    let bounds = |[from, to]: [f64; 2]| format!("{from} to {to} nm");
                    there_and_wanted(&format!("channel {k}"), bounds(there.bounds[k]), bounds(wanted.bounds[k]))
                }
                None => Some("the responses or names of the channels, or channels.false_colour".into()),
            };
        }
        if self.tile != wanted.tile {
            return there_and_wanted("tile", size(self.tile), size(wanted.tile));
        }
        if self.epoch != wanted.epoch {
            return there_and_wanted("integrator.epoch", self.epoch.to_string(), wanted.epoch.to_string());
        }
        // Whoever goes on with a cube adopts the evaluator that it was begun with; what follows from the camera the digest holds, and
        // older cubes do not tell it.
        let decides = |key: &str| !["evaluator", "scene_digest", PIXEL_TANGENT].contains(&key);
        let of = |attributes: &Map<String, Value>| {
            Value::Object(
                attributes.iter().filter(|(key, _)| decides(key)).map(|(k, v)| (k.clone(), v.clone())).collect(),
            )
        };
        if let Some((key, there, wanted)) = first_difference("", &of(&self.attributes), &of(&wanted.attributes)) {
            return there_and_wanted(&key, there, wanted);
        }
        // Last, since it differs whenever any of those does, and says the least.
        (self.attributes.get("scene_digest") != wanted.attributes.get("scene_digest"))
            .then(|| "the scene (its spectra, geometry, materials, lights or camera)".into())
    }

    /// Checks what a cube relies on, [`super::Cube::create`] included; the message says which value is wrong and what is allowed.
    pub fn validate(&self) -> std::result::Result<(), String> {
        let [width, height] = self.size;
        if width == 0 || height == 0 {
            return Err(format!("a cube of {width}x{height} pixels has no pixels"));
        }
        for (axis, name) in ["width", "height"].into_iter().enumerate() {
            let (tile, size) = (self.tile[axis], self.size[axis]);
            if tile == 0 || (tile < size && tile % super::BLOCK != 0) {
                return Err(format!(
                    "tile {name} {tile} is neither a multiple of {} nor the whole {size}",
                    super::BLOCK
                ));
            }
        }
        let tiles = self.grid().tiles().map(u64::from);
        if tiles[0] * tiles[1] > u64::from(u32::MAX) {
            return Err(format!("{} x {} tiles are more than 2^32; choose larger tiles", tiles[0], tiles[1]));
        }
        let values = u128::from(self.tile[0]) * u128::from(self.tile[1]) * self.channels.len() as u128;
        if values > (isize::MAX / 8) as u128 {
            return Err(format!("a tile of {}x{} pixels is too large", self.tile[0], self.tile[1]));
        }
        if self.is_factored() && self.grid().tile_pixels() > MOST_FACTORED_PIXELS {
            return Err(format!(
                "a tile of {}x{} pixels is too large for a factored cube: at most 256x256",
                self.tile[0], self.tile[1]
            ));
        }
        if !self.epoch.is_power_of_two() || self.epoch > 1024 {
            return Err(format!("an epoch of {} samples is not a power of two up to 1024", self.epoch));
        }
        self.validate_channels()
    }

    fn validate_channels(&self) -> std::result::Result<(), String> {
        let channels = &self.channels;
        if channels.is_empty() || channels.names.len() != channels.len() {
            return Err(format!("{} channels with {} names", channels.len(), channels.names.len()));
        }
        if !channels.responses.is_empty() && channels.responses.len() != channels.len() {
            return Err(format!("{} channels with {} responses", channels.len(), channels.responses.len()));
        }
        for (k, [from, to]) in channels.bounds.iter().enumerate() {
            if !(*from > 0.0 && from < to && to.is_finite()) {
                return Err(format!("channel {k} from {from} to {to} nm is no interval of wavelength"));
            }
        }
        match channels.false_colour {
            Some(rgb) if rgb.iter().any(|&k| k >= channels.len()) => {
                Err(format!("false colour {rgb:?} names a channel that is not among the {}", channels.len()))
            }
            _ => Ok(()),
        }
    }

    /// The attributes of the group: numbers, texts and lists of them, which netCDF can hold too. What is neither is written as
    /// JSON.
    fn group_attributes(&self) -> Result<Map<String, Value>> {
        if let Some(name) = RESERVED.iter().find(|name| self.attributes.contains_key(**name)) {
            return Err(Error::Internal(format!("the attribute `{name}` of a cube is made from its header")));
        }
        let mut attributes = self.attributes.clone();
        attributes.extend([
            ("Conventions".into(), json!("CF-1.11")),
            ("title".into(), json!("Spectral image")),
            ("spectile_format".into(), json!(FORMAT)),
            ("spectile_version".into(), json!(env!("CARGO_PKG_VERSION"))),
            ("epoch".into(), json!(self.epoch)),
            ("origin".into(), json!(self.origin)),
            ("channel_names".into(), json!(self.channels.names)),
        ]);
        if let Some((crs, affine)) = self.georeference() {
            // As the conventions of GeoZarr have it.
            let key = if crs.starts_with("EPSG:") { "proj:code" } else { "proj:wkt2" };
            attributes.insert(key.into(), json!(crs));
            attributes.insert("spatial:transform".into(), json!(affine));
            attributes.insert("spatial:dimensions".into(), json!(["y", "x"]));
        }
        if let Some(rgb) = self.channels.false_colour {
            attributes.insert("false_colour".into(), json!(rgb));
        }
        if !self.channels.responses.is_empty() {
            attributes.insert("responses".into(), json!(self.channels.responses));
        }
        Ok(plain_attributes(attributes))
    }

    /// The metadata of the group and, for readers that open an array by itself, of every array.
    pub(super) fn metadata(&self) -> Result<(Value, Vec<(&'static str, Value)>)> {
        let attributes = self.group_attributes()?;
        let arrays = arrays(self, Layout::Columns);
        let consolidated: Map<String, Value> = arrays.iter().map(|(name, v)| ((*name).into(), v.clone())).collect();
        let group = json!({
            "zarr_format": 3,
            "node_type": "group",
            "attributes": attributes,
            "consolidated_metadata": { "kind": "inline", "must_understand": false, "metadata": consolidated },
        });
        Ok((group, arrays))
    }

    /// All that makes a cube what it is, as JSON that only Spectile writes.
    pub(super) fn record(&self) -> String {
        let Channels { bounds, names, false_colour, responses } = &self.channels;
        let content = json!({
            "spectile_format": FORMAT,
            "spectile_version": env!("CARGO_PKG_VERSION"),
            "size": self.size,
            "origin": self.origin,
            "tile": self.tile,
            "epoch": self.epoch,
            "channels": { "bounds": bounds, "names": names, "false_colour": false_colour, "responses": responses },
            "attributes": self.attributes,
        });
        let checksum = record_checksum(&content);
        let about = "what Spectile knows this cube by, whatever others write into its metadata";
        format!("{:#}\n", json!({ "about": about, "checksum": checksum, "cube": content }))
    }

    /// The cube at `path` from [`Header::record`].
    pub(super) fn from_record(path: &Path, text: &str) -> Result<Recorded> {
        let Ok(record) = serde_json::from_str::<Value>(text) else { return Ok(Recorded::Damaged) };
        let content = &record["cube"];
        if record["checksum"] != record_checksum(content) {
            return Ok(Recorded::Damaged);
        }
        match content["spectile_format"].as_u64() {
            Some(FORMAT) => {}
            format => return Err(unknown_format(path, format.unwrap_or(0))),
        }
        fn take<T: serde::de::DeserializeOwned>(value: &Value) -> Option<T> {
            serde_json::from_value(value.clone()).ok()
        }
        let read = || {
            let channels = &content["channels"];
            Some(Header {
                size: take(&content["size"])?,
                origin: take(&content["origin"])?,
                tile: take(&content["tile"])?,
                epoch: take(&content["epoch"])?,
                channels: Channels {
                    bounds: take(&channels["bounds"])?,
                    names: take(&channels["names"])?,
                    false_colour: take(&channels["false_colour"])?,
                    responses: take(&channels["responses"])?,
                },
                attributes: take(&content["attributes"])?,
            })
        };
        let header = read().filter(|header| header.validate().is_ok());
        let made_by = content["spectile_version"].as_str().unwrap_or_default().to_owned();
        Ok(header.map_or(Recorded::Damaged, |header| Recorded::Sound { header: Box::new(header), made_by }))
    }

    /// The header of the cube at `path` from its group's metadata alone, and how it is laid out. `read_bounds(K)` gets the
    /// values of `wavelength_bounds`.
    pub(super) fn parse(
        path: &Path,
        group: &Value,
        read_bounds: impl FnOnce(usize) -> Result<Vec<[f64; 2]>>,
    ) -> Result<(Header, Layout)> {
        let layout = match group["attributes"]["spectile_format"].as_u64() {
            Some(format) => Layout::of_format(format).ok_or_else(|| unknown_format(path, format))?,
            None if !group["attributes"][SENSOR_FORMAT].is_null() => {
                let what = "holds counts of a sensor, and this command takes cubes of radiance";
                return Err(Error::storage(path, what));
            }
            None => {
                let what = "is a Zarr store, but not a Spectile cube: it has no attribute `spectile_format`";
                return Err(Error::storage(path, what));
            }
        };
        let damaged = |what: &str| Error::storage(path, format!("is a damaged Spectile cube: its zarr.json {what}"));
        let stored = &group["consolidated_metadata"]["metadata"];
        let numbers = |value: &Value| -> Option<Vec<u32>> {
            value.as_array()?.iter().map(|v| u32::try_from(v.as_u64()?).ok()).collect()
        };
        let shape_of = |name: &str| numbers(&stored[name]["shape"]);
        let chunk_of = |name: &str| numbers(&stored[name]["chunk_grid"]["configuration"]["chunk_shape"]);
        let ([height, width], [tile_height, tile_width]) = match (shape_of("preview"), chunk_of("preview")) {
            (Some(shape), Some(chunk)) if shape.len() == 3 && chunk.len() == 3 => {
                ([shape[0], shape[1]], [chunk[0], chunk[1]])
            }
            (Some(_), _) => return Err(rewritten(path, "preview")),
            _ if stored["preview"].is_object() => {
                return Err(damaged("gives no shape [y, x, rgb] and chunk of `preview`"));
            }
            _ => {
                let what = "is a copy of a cube that another program has changed: it has no `preview`";
                return Err(Error::storage(path, format!("{what}; {COPY}")));
            }
        };
        let Some(&[count]) = shape_of("wavelength").as_deref() else {
            if stored["wavelength"].is_object() {
                return Err(damaged("gives no shape [wavelength] of `wavelength`"));
            }
            let what = "is a copy of a cube that another program has changed: it has no list `wavelength`";
            return Err(Error::storage(path, format!("{what}; {COPY}")));
        };
        let bounds = "wavelength_bounds";
        if !stored[bounds].is_object() {
            return Err(damaged("describes no `wavelength_bounds`"));
        }
        if stored[bounds]["codecs"] != plain() {
            return Err(rewritten(path, bounds));
        }

        let mut attributes = group["attributes"].as_object().cloned().unwrap_or_default();
        structure_attributes(&mut attributes);
        let mut take = |name: &str| attributes.remove(name).unwrap_or_default();
        let names = serde_json::from_value(take("channel_names")).map_err(|_| damaged("has no `channel_names`"))?;
        let false_colour = serde_json::from_value(take("false_colour"))
            .map_err(|_| damaged("has a `false_colour` that is not three channels"))?;
        let epoch = serde_json::from_value(take("epoch")).map_err(|_| damaged("has no `epoch`"))?;
        let origin = serde_json::from_value(take("origin")).map_err(|_| damaged("has no `origin`"))?;
        let responses = attributes.remove("responses").unwrap_or_else(|| json!([]));
        let responses = serde_json::from_value(responses)
            .map_err(|what| damaged(&format!("holds no valid `responses`: {what}")))?;
        for name in ["proj:code", "proj:wkt2", "spatial:transform", "spatial:dimensions"] {
            attributes.remove(name);
        }
        for name in RESERVED {
            attributes.remove(name);
        }
        let header = Header {
            size: [width, height],
            origin,
            tile: [tile_width, tile_height],
            channels: Channels { bounds: read_bounds(count as usize)?, names, false_colour, responses },
            epoch,
            attributes,
        };
        header.validate().map_err(|what| damaged(&format!("is not valid: {what}")))?;

        // What is read as raw files must be laid out as this version does it, to the last codec.
        let arrays = arrays(&header, layout);
        for (name, array) in arrays.iter().filter(|(name, _)| is_raw(name)) {
            if !same_layout(array, &stored[*name]) {
                return Err(rewritten(path, name));
            }
        }
        // And mean what it means by them.
        for (name, array) in &arrays {
            check_meaning(path, "is a copy of a cube in which somebody gave", name, array, &stored[*name])?;
        }
        header.check_wavelengths(path)?;
        Ok((header, layout))
    }

    /// Refuses the cube at `path`, known by its record, where somebody has since given its arrays attributes by which their numbers
    /// are others, or other wavelengths: in their own metadata or in those of the group. What cannot be read is left to who verifies.
    pub(super) fn check_in_place(&self, path: &Path) -> Result<()> {
        let json = |file: &Path| -> Option<Value> { serde_json::from_slice(&std::fs::read(file).ok()?).ok() };
        let group = json(&path.join("zarr.json")).unwrap_or_default();
        let consolidated = &group["consolidated_metadata"]["metadata"];
        for (name, array) in arrays(self, Layout::Columns) {
            let own = json(&path.join(name).join("zarr.json")).unwrap_or_default();
            check_meaning(path, "somebody has given", name, &array, &own)?;
            check_meaning(path, "somebody has given", name, &array, &consolidated[name])?;
        }
        self.check_wavelengths(path)
    }

    /// Refuses wavelengths, and their bounds, other than the cube's, where they lie as Spectile writes them.
    fn check_wavelengths(&self, path: &Path) -> Result<()> {
        let channels = &self.channels;
        let centres = (0..channels.len()).map(|k| channels.centre(k)).collect();
        let bounds = channels.bounds.iter().flatten().copied().collect();
        let ours: [(&str, &str, Vec<f64>); 2] =
            [("wavelength", "wavelength/c/0", centres), ("wavelength_bounds", "wavelength_bounds/c/0/0", bounds)];
        for (name, file, ours) in ours {
            let Ok(bytes) = std::fs::read(path.join(file)) else { continue };
            // Bytes of another number are no plain list: another program has stored it anew.
            if bytes.len() != 8 * ours.len() {
                continue;
            }
            let found = bytes.as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes));
            if let Some((found, ours)) = found.zip(ours).find(|(found, ours)| (found - ours).abs() > 1e-9 * ours) {
                let what =
                    format!("somebody has changed `{name}`: it has {found} nm where the channel is at {ours} nm");
                let help = "put that back, as `spectile render … --resume` does, or open the cube with xarray";
                return Err(Error::storage(path, format!("{what}; {help}")));
            }
        }
        Ok(())
    }
}

/// Refuses an array whose stored metadata make other numbers of it than `ours`; `who` has given it those.
pub(super) fn check_meaning(path: &Path, who: &str, name: &str, ours: &Value, stored: &Value) -> Result<()> {
    let Some(what) = other_meaning(&ours["attributes"], &stored["attributes"]) else { return Ok(()) };
    let help = "values are read as Spectile writes them: put that right, or open the cube with xarray";
    Err(Error::storage(path, format!("{who} `{name}` {what}; {help}")))
}

/// What to do about a cube that is no more what Spectile writes.
const COPY: &str = "copy the folder itself, or open this one with xarray";

/// The error of an array that another program has stored anew.
fn rewritten(path: &Path, name: &str) -> Error {
    let what = format!(
        "is a copy of a cube in which another program has stored `{name}` in another way (codecs, chunks or shape)"
    );
    Error::storage(path, format!("{what}: {COPY}"))
}

/// What of an array's attributes makes other numbers of the stored ones than `ours`, in words.
fn other_meaning(ours: &Value, stored: &Value) -> Option<String> {
    // Whatever the case of the key, and also as `unit`.
    let text = |attributes: &Value, name: &str| {
        let singular = name.trim_end_matches('s');
        let of = |(key, value): (&String, &Value)| {
            let is = key.eq_ignore_ascii_case(name) || key.eq_ignore_ascii_case(singular);
            value.as_str().filter(|_| is).map(str::to_owned)
        };
        attributes.as_object()?.iter().find_map(of)
    };
    match (text(ours, "units"), text(stored, "units")) {
        (Some(ours), Some(stored)) if ours != stored => {
            return Some(format!("the units `{stored}` instead of `{ours}`"));
        }
        _ => {}
    }
    /// What words attributes hold that change numbers, and the number with which they do not.
    const CHANGES: [(&str, f64); 8] = [
        ("scale", 1.0),
        ("factor", 1.0),
        ("gain", 1.0),
        ("slope", 1.0),
        ("multipl", 1.0),
        ("offset", 0.0),
        ("intercept", 0.0),
        ("bias", 0.0),
    ];
    /// That say which numbers are none. xarray gives floats a `_FillValue` that is NaN, in base64.
    const MISSING: [&str; 6] = ["fillvalue", "fill value", "missing value", "nodata", "ignore value", "valid "];
    const NAN: [&str; 3] = ["NaN", "nan", "AAAAAAAA+H8="];
    let changed = stored.as_object()?.iter().find(|(name, value)| {
        if &ours[name.as_str()] == *value || value.is_null() {
            return false;
        }
        let lower = name.to_lowercase().replace(['_', '-'], " ");
        if let Some((_, neutral)) = CHANGES.iter().find(|(word, _)| lower.split(' ').any(|part| part.starts_with(word)))
        {
            return value.as_f64() != Some(*neutral);
        }
        MISSING.iter().any(|word| lower.trim().starts_with(word))
            && !value.as_str().is_some_and(|text| NAN.contains(&text))
    });
    changed.map(|(name, value)| format!("a `{name}` of {value}"))
}

/// What [`Header::from_record`] finds.
pub(super) enum Recorded {
    Sound {
        header: Box<Header>,
        /// The version of Spectile that made the cube.
        made_by: String,
    },
    Damaged,
}

/// Whatever the order of keys and the spaces between them.
fn record_checksum(content: &Value) -> String {
    fn sorted(value: &Value) -> Value {
        match value {
            Value::Object(fields) => {
                let in_order: BTreeMap<&String, Value> = fields.iter().map(|(k, v)| (k, sorted(v))).collect();
                Value::Object(in_order.into_iter().map(|(k, v)| (k.clone(), v)).collect())
            }
            Value::Array(items) => Value::Array(items.iter().map(sorted).collect()),
            other => other.clone(),
        }
    }
    format!("{:032x}", super::checksums::of(sorted(content).to_string().as_bytes()))
}

fn unknown_format(path: &Path, format: u64) -> Error {
    let what = format!("is a Spectile cube of format {format}; this version reads the formats 1 and {FORMAT}");
    Error::storage(path, what)
}

/// Attributes whose values are made of others, so that netCDF could hold them as text only.
const STRUCTURED: [&str; 5] = ["settings", "responses", DERIVED, FACTORED, LAYERS];

/// The same without values that netCDF cannot hold.
pub fn plain_attributes(mut attributes: Map<String, Value>) -> Map<String, Value> {
    for value in attributes.values_mut() {
        let is_plain = |value: &Value| value.is_number() || value.is_string();
        match value {
            Value::Bool(is) => *value = json!(u8::from(*is)),
            Value::Number(_) | Value::String(_) => {}
            // Empty lists have no type, and mixed ones none in common.
            Value::Array(items)
                if !items.is_empty()
                    && items.iter().all(|item| is_plain(item) && item.is_string() == items[0].is_string()) => {}
            _ => *value = json!(value.to_string()),
        }
    }
    attributes
}

/// What [`plain_attributes`] did, undone where it is known.
fn structure_attributes(attributes: &mut Map<String, Value>) {
    for name in STRUCTURED {
        if let Some(value) = attributes.get_mut(name)
            && let Some(Ok(structured)) = value.as_str().map(serde_json::from_str::<Value>)
        {
            *value = structured;
        }
    }
    if attributes.get(UNCERTAINTY) == Some(&json!(1)) {
        attributes.insert(UNCERTAINTY.into(), Value::Bool(true));
    }
}

/// Whether the files of an array are read and written as they are.
pub(super) fn is_raw(name: &str) -> bool {
    super::store::TileArray::all().any(|part| part.name() == name)
}

/// Whether the files of an array hold the same in both descriptions.
pub(super) fn same_layout(a: &Value, b: &Value) -> bool {
    ["shape", "data_type", "chunk_grid", "chunk_key_encoding", "fill_value", "codecs"]
        .iter()
        .all(|key| a[key] == b[key])
}

/// Dotted key and both values of the first difference between two JSON values.
fn first_difference(key: &str, a: &Value, b: &Value) -> Option<(String, String, String)> {
    match (a, b) {
        (Value::Object(a), Value::Object(b)) => a.keys().chain(b.keys()).find_map(|name| {
            let inner = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
            first_difference(&inner, a.get(name).unwrap_or(&Value::Null), b.get(name).unwrap_or(&Value::Null))
        }),
        _ if a == b => None,
        _ => Some((key.to_owned(), a.to_string(), b.to_string())),
    }
}
