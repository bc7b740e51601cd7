//! The Zarr v3 arrays of a cube, with CF attributes.

use serde_json::{Value, json};

use super::metadata::{Header, Layout};
use super::weights::{Shape, ZSTD_LEVEL};
use crate::spectral::colour::{Projection, ProjectionKind};

/// The arrays of a cube, by name.
pub(super) fn arrays(header: &Header, layout: Layout) -> Vec<(&'static str, Value)> {
    let channels = header.channels.len() as u64;
    let [width, height] = header.size.map(u64::from);
    let [tile_width, tile_height] = header.tile.map(u64::from);
    let [columns, rows] = header.grid().tiles().map(u64::from);
    let [blocks_x, blocks_y] = header.grid().blocks().map(u64::from);
    let [tile_blocks_x, tile_blocks_y] = header.grid().tile_blocks().map(u64::from);
    let radiance_units = "W m-2 sr-1 nm-1";
    let shows = match Projection::new(&header.channels).kind {
        ProjectionKind::Xyz => "linear sRGB of CIE 1931 XYZ divided by the integral of ybar".to_owned(),
        ProjectionKind::FalseColour(rgb) => {
            let [r, g, b] = rgb.map(|k| header.channels.names[k].as_str());
            format!("false colour: radiance of the channels {r}, {g}, {b} as red, green, blue")
        }
    };
    let pixel = |side: &str| json!({ "long_name": format!("pixel on the full film, from the {side}, the first 0"), "units": "pixel" });
    let mut arrays = vec![
        (
            "radiance",
            Array {
                codecs: channel_fastest(layout),
                attributes: json!({
                    "long_name": "mean spectral radiance over the channel",
                    "units": radiance_units,
                    "coordinates": "response_integral",
                }),
                ..Array::new("float32", &[channels, height, width], &["wavelength", "y", "x"])
            }
            .chunked(&[channels, tile_height, tile_width]),
        ),
        (
            "wavelength",
            Array {
                attributes: json!({
                    "standard_name": "radiation_wavelength",
                    "long_name": "centre of the channel",
                    "units": "nm",
                    "bounds": "wavelength_bounds",
                }),
                ..Array::new("float64", &[channels], &["wavelength"])
            }
            .whole(),
        ),
        (
            "wavelength_bounds",
            Array {
                attributes: json!({ "long_name": "lower and upper end of the channel", "units": "nm" }),
                ..Array::new("float64", &[channels, 2], &["wavelength", "bnds"])
            }
            .whole(),
        ),
        (
            "response_integral",
            Array {
                attributes: json!({
                    "long_name": "integral of the channel's response (its width where it has none): times radiance, W m-2 sr-1",
                    "units": "nm",
                }),
                ..Array::new("float64", &[channels], &["wavelength"])
            }
            .whole(),
        ),
        ("y", Array { attributes: pixel("top"), ..Array::new("float64", &[height], &["y"]) }.whole()),
        ("x", Array { attributes: pixel("left"), ..Array::new("float64", &[width], &["x"]) }.whole()),
        (
            "samples",
            Array {
                fill: json!(0),
                attributes: json!({ "long_name": "samples per pixel in the tile", "units": "1" }),
                ..Array::new("uint32", &[rows, columns], &["tile_y", "tile_x"])
            }
            .chunked(&[1, 1]),
        ),
        (
            "preview",
            Array {
                attributes: json!({ "long_name": shows, "units": radiance_units }),
                ..Array::new("float32", &[height, width, 3], &["y", "x", "rgb"])
            }
            .chunked(&[tile_height, tile_width, 3]),
        ),
        (
            "overview",
            Array {
                codecs: if layout == Layout::Rows { plain() } else { channel_fastest(layout) },
                attributes: json!({ "long_name": "radiance, mean over blocks of 8 x 8 pixels", "units": radiance_units }),
                ..Array::new("float32", &[channels, blocks_y, blocks_x], &["wavelength", "overview_y", "overview_x"])
            }
            .chunked(&[channels, tile_blocks_y, tile_blocks_x]),
        ),
    ];
    if header.is_factored() {
        let [weights, products] = of_weights(header);
        arrays[0] = weights;
        arrays.push(products);
    }
    let of_channels = |what: &str| {
        let attributes = json!({ "long_name": what, "units": radiance_units });
        let array = Array::new("float32", &[channels, height, width], &["wavelength", "y", "x"]);
        Array { codecs: channel_fastest(layout), attributes, ..array }.chunked(&[channels, tile_height, tile_width])
    };
    if header.has_remainder() {
        arrays.push((
            "remainder",
            of_channels("the part of the mean spectral radiance that weights of products do not hold"),
        ));
    }
    if header.has_uncertainty() {
        let (name, of) = match (header.is_factored(), header.has_remainder()) {
            (false, _) => (Some("standard_error"), "radiance"),
            (true, true) => (Some("remainder_standard_error"), "remainder"),
            (true, false) => (None, ""),
        };
        let what = format!("standard error of {of}, from the spread of equal epochs; NaN below two of them");
        arrays.extend(name.map(|name| (name, of_channels(&what))));
    }
    let names = header.layer_names();
    for layer in header.layers() {
        let (count, pixels) = (layer.axes().len() as u64, [height, width, 3]);
        let dimensions = if count == 1 { 2 } else { 3 };
        let array = Array {
            fill: layer.numbers().fill(),
            attributes: layer.attributes(names.of(layer)),
            ..Array::new(layer.numbers().name(), &pixels[..dimensions], &["y", "x", "xyz"][..dimensions])
        };
        arrays.push((layer.name(), array.chunked(&[tile_height, tile_width, 3][..dimensions])));
    }
    arrays
}

/// What stands for radiance where weights of products are kept.
fn of_weights(header: &Header) -> [(&'static str, Value); 2] {
    let [columns, rows] = header.grid().tiles().map(u64::from);
    let shape = Shape::of(header);
    let [entries, columns_of_entries, width] = [shape.entries, shape.columns, shape.width].map(|n| n as u64);
    let weights = Array {
        fill: json!(0.0),
        codecs: compressed(),
        attributes: json!({
            "long_name": "entries of the pixels of a tile: pixel (row x tile width + column), place in `products`, weight, and \
                          the shares of the weight that the groups of epochs but the first have; weight 0: none",
            "units": "1",
        }),
        ..Array::new("float32", &[rows, columns, columns_of_entries, entries], &["tile_y", "tile_x", "column", "entry"])
    };
    let products = Array {
        fill: json!(u16::MAX),
        codecs: compressed(),
        attributes: json!({
            "long_name": "of each product of a tile: the place of its source and of its factors in the attribute `factored`; \
                          65535: none",
            "units": "1",
        }),
        ..Array::new("uint16", &[rows, columns, entries, width], &["tile_y", "tile_x", "product", "source_and_factors"])
    };
    [
        ("weights", weights.chunked(&[1, 1, columns_of_entries, entries])),
        ("products", products.chunked(&[1, 1, entries, width])),
    ]
}

/// The axes [wavelength, y, x] in another order: a chunk is the raw tile, a pixel's spectrum contiguous.
fn channel_fastest(layout: Layout) -> Value {
    let order = match layout {
        Layout::Rows => [1, 2, 0],
        Layout::Columns => [2, 1, 0],
    };
    json!([
        { "name": "transpose", "configuration": { "order": order } },
        { "name": "bytes", "configuration": { "endian": "little" } },
    ])
}

fn compressed() -> Value {
    json!([
        { "name": "bytes", "configuration": { "endian": "little" } },
        { "name": "zstd", "configuration": { "level": ZSTD_LEVEL, "checksum": true } },
    ])
}

pub(super) fn plain() -> Value {
    json!([{ "name": "bytes", "configuration": { "endian": "little" } }])
}

/// The metadata of one array, made into a Zarr v3 document by naming its chunks.
struct Array {
    data_type: &'static str,
    shape: Vec<u64>,
    dimensions: Vec<&'static str>,
    fill: Value,
    codecs: Value,
    attributes: Value,
}

impl Array {
    /// An array of raw little-endian numbers, NaN where there is no chunk.
    fn new(data_type: &'static str, shape: &[u64], dimensions: &[&'static str]) -> Self {
        Array {
            data_type,
            shape: shape.to_vec(),
            dimensions: dimensions.to_vec(),
            fill: json!("NaN"),
            codecs: plain(),
            attributes: json!({}),
        }
    }

    /// The array in a single chunk.
    fn whole(self) -> Value {
        let shape = self.shape.clone();
        self.chunked(&shape)
    }

    fn chunked(self, chunk: &[u64]) -> Value {
        json!({
            "zarr_format": 3,
            "node_type": "array",
            "shape": self.shape,
            "data_type": self.data_type,
            "chunk_grid": { "name": "regular", "configuration": { "chunk_shape": chunk } },
            "chunk_key_encoding": { "name": "default", "configuration": { "separator": "/" } },
            "fill_value": self.fill,
            "codecs": self.codecs,
            "attributes": self.attributes,
            "dimension_names": self.dimensions,
            "storage_transformers": [],
        })
    }
}
