//! Layers: what the first surface behind each pixel is, beside the radiance that comes from there. They are made with a tile's first
//! unit and never change.

use std::io::{Read, Seek, SeekFrom};

use serde_json::{Value, json};

use super::grid::Grid;
use super::store::{Cube, TileArray};
use crate::{Error, Result};

/// An array of its own with a value, or three, for each pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Layer {
    Depth,
    Normal,
    Object,
    Material,
    Coordinates,
    Sun,
}

/// What a layer's numbers are, little-endian.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Numbers {
    F32,
    F64,
    I32,
}

impl Numbers {
    /// As Zarr calls them.
    pub fn name(self) -> &'static str {
        match self {
            Numbers::F32 => "float32",
            Numbers::F64 => "float64",
            Numbers::I32 => "int32",
        }
    }

    pub fn bytes(self) -> usize {
        if self == Numbers::F64 { 8 } else { 4 }
    }

    /// Where nothing is met: NaN, or -1.
    pub fn fill(self) -> Value {
        if self == Numbers::I32 { json!(-1) } else { json!("NaN") }
    }
}

impl Layer {
    pub const ALL: [Layer; 6] =
        [Layer::Depth, Layer::Normal, Layer::Object, Layer::Material, Layer::Coordinates, Layer::Sun];

    pub fn name(self) -> &'static str {
        match self {
            Layer::Depth => "depth",
            Layer::Normal => "normal",
            Layer::Object => "object",
            Layer::Material => "material",
            Layer::Coordinates => "coordinates",
            Layer::Sun => "sun",
        }
    }

    pub fn named(name: &str) -> Option<Layer> {
        Layer::ALL.into_iter().find(|layer| layer.name() == name)
    }

    /// Names of a pixel's values; those of a layer with one have none.
    pub fn axes(self) -> &'static [&'static str] {
        match self {
            Layer::Normal | Layer::Coordinates => &["x", "y", "z"],
            _ => &[""],
        }
    }

    pub fn numbers(self) -> Numbers {
        match self {
            Layer::Object | Layer::Material => Numbers::I32,
            // f32 would round places in a projection of the earth to decimetres.
            Layer::Coordinates => Numbers::F64,
            _ => Numbers::F32,
        }
    }

    pub fn long_name(self) -> &'static str {
        match self {
            Layer::Depth => "distance to the first surface, along the ray through the pixel's centre",
            Layer::Normal => "unit normal of the first surface, on the side that is seen",
            Layer::Object => "number of the object that is seen first; -1: none",
            Layer::Material => "number of the material that is seen first; -1: none",
            Layer::Coordinates => "where the first surface is, in the scene",
            Layer::Sun => "cosine of the angle at which the sun's centre shines on the side that is seen; 0 in shade",
        }
    }

    pub fn units(self) -> &'static str {
        if matches!(self, Layer::Depth | Layer::Coordinates) { "m" } else { "1" }
    }

    /// Bytes of a pixel.
    pub fn pixel_bytes(self) -> usize {
        self.axes().len() * self.numbers().bytes()
    }

    /// The attributes of the array, where numbers stand for these names.
    pub(super) fn attributes(self, names: &[String]) -> Value {
        let mut attributes = json!({ "long_name": self.long_name(), "units": self.units() });
        if matches!(self, Layer::Object | Layer::Material) && !names.is_empty() {
            // CF 3.5: one word each.
            let word = |name: &String| name.replace(char::is_whitespace, "_");
            attributes["flag_values"] = json!((0..names.len()).collect::<Vec<_>>());
            attributes["flag_meanings"] = json!(names.iter().map(word).collect::<Vec<_>>().join(" "));
        }
        attributes
    }
}

/// Which layers a cube has, and what the numbers in them stand for.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LayerNames {
    /// In the order of [`Layer::ALL`].
    pub layers: Vec<String>,
    /// Of the values of `object` and of `material`, from 0; empty without that layer.
    pub objects: Vec<String>,
    pub materials: Vec<String>,
}

impl LayerNames {
    /// Those of `layers`, each once, in an order of their own.
    pub fn new(layers: &[Layer], objects: Vec<String>, materials: Vec<String>) -> LayerNames {
        let has = |layer: Layer| layers.contains(&layer);
        let kept = |layer: Layer, names: Vec<String>| if has(layer) { names } else { Vec::new() };
        LayerNames {
            layers: Layer::ALL.into_iter().filter(|&layer| has(layer)).map(|layer| layer.name().into()).collect(),
            objects: kept(Layer::Object, objects),
            materials: kept(Layer::Material, materials),
        }
    }

    pub fn of(&self, layer: Layer) -> &[String] {
        match layer {
            Layer::Object => &self.objects,
            Layer::Material => &self.materials,
            _ => &[],
        }
    }
}

/// The layers of a tile, each as its file holds it: [row of the full tile][column][value], padded beyond the edge of the picture with
/// what stands for nothing.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TileLayers(pub Vec<(Layer, Vec<u8>)>);

impl TileLayers {
    /// As where nothing is met.
    pub fn empty(layers: &[Layer], grid: Grid) -> TileLayers {
        let empty = |&layer: &Layer| {
            let value: Vec<u8> = match layer.numbers() {
                Numbers::F32 => f32::NAN.to_le_bytes().into(),
                Numbers::F64 => f64::NAN.to_le_bytes().into(),
                Numbers::I32 => (-1i32).to_le_bytes().into(),
            };
            (layer, value.repeat(grid.tile_pixels() * layer.axes().len()))
        };
        TileLayers(layers.iter().map(empty).collect())
    }

    /// Sets the values of a pixel of the tile, counted by rows, in one of the layers that are there.
    pub fn set(&mut self, layer: Layer, pixel: usize, values: &[f64]) {
        let Some((_, bytes)) = self.0.iter_mut().find(|(of, _)| *of == layer) else { return };
        let (size, count) = (layer.numbers().bytes(), layer.axes().len());
        for (i, &value) in values.iter().take(count).enumerate() {
            let at = (pixel * count + i) * size;
            match layer.numbers() {
                Numbers::F32 => bytes[at..at + 4].copy_from_slice(&(value as f32).to_le_bytes()),
                Numbers::F64 => bytes[at..at + 8].copy_from_slice(&value.to_le_bytes()),
                Numbers::I32 => bytes[at..at + 4].copy_from_slice(&(value as i32).to_le_bytes()),
            }
        }
    }

    pub(super) fn of(&self, layer: Layer) -> Option<&[u8]> {
        self.0.iter().find(|(of, _)| *of == layer).map(|(_, bytes)| &bytes[..])
    }
}

impl Cube {
    /// The layers of a tile; `None` before its first unit.
    pub fn tile_layers(&self, tile: u32) -> Result<Option<TileLayers>> {
        let mut found = Vec::new();
        for &layer in self.layers() {
            let Some(mut file) = self.open_part(TileArray::Layer(layer), tile)? else { return Ok(None) };
            let path = self.part_path(TileArray::Layer(layer), tile);
            let mut bytes = Vec::new();
            file.read_to_end(&mut bytes).map_err(|error| Error::storage(&path, error))?;
            let expected = self.grid().tile_pixels() * layer.pixel_bytes();
            if bytes.len() != expected {
                return Err(Error::storage(&path, format!("is damaged: {} bytes long, not {expected}", bytes.len())));
            }
            found.push((layer, bytes));
        }
        Ok(Some(TileLayers(found)))
    }

    /// Some lines of a layer of a tile, as numbers: \[line\]\[column of the full tile\]\[axis\], NaN for none. `None` before its first unit.
    pub fn layer_lines(&self, layer: Layer, tile: u32, lines: std::ops::Range<u32>) -> Result<Option<Vec<f64>>> {
        let part = TileArray::Layer(layer);
        let Some(mut file) = self.open_part(part, tile)? else { return Ok(None) };
        let path = self.part_path(part, tile);
        let line = self.grid().tile[0] as usize * layer.pixel_bytes();
        let mut bytes = vec![0; lines.len() * line];
        let read =
            file.seek(SeekFrom::Start(u64::from(lines.start) * line as u64)).and_then(|_| file.read_exact(&mut bytes));
        read.map_err(|error| Error::storage(&path, format!("is damaged: {error}")))?;
        let numbers = match layer.numbers() {
            Numbers::F32 => bytes.as_chunks().0.iter().map(|b| f64::from(f32::from_le_bytes(*b))).collect(),
            Numbers::F64 => bytes.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect(),
            Numbers::I32 => {
                let number = |b: &[u8; 4]| Some(i32::from_le_bytes(*b)).filter(|n| *n >= 0).map_or(f64::NAN, f64::from);
                bytes.as_chunks().0.iter().map(number).collect()
            }
        };
        Ok(Some(numbers))
    }
}
