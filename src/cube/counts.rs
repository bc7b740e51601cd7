//! Counts of a sensor (docs/SENSORS.md), read as the cubes that they are: a value a band.

use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use serde_json::Value;

use super::map::Chunk;
use super::metadata::{COUNTS_FORMAT, Header, Layout, SENSOR_FORMAT, check_meaning};
use super::store::{Cube, Origin, check_folder, read_doubles, read_group};
use crate::spectral::Channels;
use crate::spectral::colour::{Projection, three_of};
use crate::{Error, Result};

/// How the values of a store of counts are read. Those of 24 bits and less are exact in f32.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Counts {
    /// Whether they have 16 bits, not 32.
    pub is_short: bool,
    /// What stands for a pixel that is missing.
    pub fill: u32,
    /// To be made of the signal that lies beside them.
    plain: Option<Plain>,
}

/// What the detector would count without noise and patterns.
#[derive(Debug, Clone, PartialEq)]
struct Plain {
    /// The array of the signal, electrons or W, that of the optics included.
    signal: &'static str,
    /// Electrons without light, and the most that a pixel holds.
    dark: f64,
    full_well: f64,
    counts_per_signal: f64,
    offset: f64,
    most: f64,
}

impl Counts {
    /// Whether noise is left out.
    pub fn is_plain(&self) -> bool {
        self.plain.is_some()
    }
}

impl Plain {
    /// The same steps as `Electronics::count` takes.
    fn count(&self, signal: f32) -> f32 {
        let electrons = (f64::from(signal) + self.dark).min(self.full_well);
        (electrons * self.counts_per_signal + self.offset).round().clamp(0.0, self.most) as f32
    }
}

impl Cube {
    /// Opens a cube of radiance, or the counts of a sensor, for whoever takes its numbers.
    ///
    /// # Errors
    /// As [`Cube::open_to_read`]; counts in another layout, or whose meaning somebody has changed.
    pub fn open_picture(path: &Path) -> Result<Cube> {
        Cube::open_counts(path)?.map_or_else(|| Cube::open_to_read(path), Ok)
    }

    /// Opens the counts of a sensor; `None` of what holds something else.
    ///
    /// # Errors
    /// What is no folder; counts in another layout, or whose meaning somebody has changed.
    pub fn open_counts(path: &Path) -> Result<Option<Cube>> {
        check_folder(path)?;
        // What has a record is a cube of radiance, whatever others have made of its metadata.
        if !path.join(super::store::RECORD).exists()
            && let Ok(group) = read_group(path)
            && !group["attributes"][SENSOR_FORMAT].is_null()
        {
            return read_counts(path, &group).map(Some);
        }
        Ok(None)
    }

    /// Whether it holds counts of a sensor.
    pub fn is_counts(&self) -> bool {
        self.counts().is_some()
    }

    /// The largest count that a pixel of counts may have, and what stands for one that is missing; `None` of radiance.
    pub fn count_range(&self) -> Option<[u32; 2]> {
        let bits = self.header().attributes.get("bits").and_then(Value::as_u64).unwrap_or(0) as u32;
        self.counts().map(|counts| [(1u32 << bits.min(31)) - 1, counts.fill])
    }

    /// The same with what the detector would count without noise and patterns, from the signal beside the counts.
    ///
    /// # Errors
    /// A cube of radiance; counts without that signal.
    pub fn without_noise(mut self) -> Result<Cube> {
        let path = self.path().to_owned();
        let usage = |what: &str| Err(Error::Usage(format!("{} {what}", path.display())));
        let Some(mut counts) = self.counts().cloned() else {
            return usage("holds radiance, not counts of a sensor: there is no noise of one to leave out");
        };
        let Some(signal) = ["electrons", "power"].into_iter().find(|name| path.join(name).is_dir()) else {
            return usage(
                "holds counts alone; make them with `spectile sensor --electrons`, which keeps the signal without noise beside them",
            );
        };
        let number = |name: &str| self.header().attributes.get(name).and_then(Value::as_f64);
        let per_signal = number("gain_electrons_per_count").map(|gain| 1.0 / gain);
        let (Some(per_signal), Some(offset), Some([most, _])) =
            (per_signal.or_else(|| number("responsivity_counts_per_W")), number("offset_counts"), self.count_range())
        else {
            return usage("does not tell gain and offset of its detector: somebody has changed its attributes");
        };
        counts.plain = Some(Plain {
            signal,
            dark: number("dark_electrons").unwrap_or(0.0),
            full_well: number("full_well_electrons").unwrap_or(f64::INFINITY),
            counts_per_signal: per_signal,
            offset,
            most: most.into(),
        });
        self.set_counts(counts);
        Ok(self)
    }

    /// The values of a tile of counts.
    pub(super) fn counts_chunk(&self, counts: &Counts, tile: u32) -> Result<Option<Chunk>> {
        let (grid, bands) = (self.grid(), self.channels().len());
        let (pixels, [width, height]) = (grid.tile_pixels(), grid.tile.map(|side| side as usize));
        let read = |array: &str, bytes: usize| -> Result<Option<Vec<u8>>> {
            let path = self.counts_path(array, tile);
            match fs::read(&path) {
                Ok(found) if found.len() == bytes * pixels * bands => Ok(Some(found)),
                Ok(found) => {
                    let what = format!("is damaged: {} bytes long, not {}", found.len(), bytes * pixels * bands);
                    Err(Error::storage(&path, what))
                }
                Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
                Err(error) => Err(Error::storage(&path, format!("cannot be read: {error}"))),
            }
        };
        let numbers: Vec<f32> = match &counts.plain {
            Some(plain) => match read(plain.signal, 4)? {
                Some(bytes) => bytes.as_chunks().0.iter().map(|b| plain.count(f32::from_le_bytes(*b))).collect(),
                None => return Ok(None),
            },
            None => {
                let number = |count: u32| if count == counts.fill { f32::NAN } else { count as f32 };
                match read("counts", if counts.is_short { 2 } else { 4 })? {
                    None => return Ok(None),
                    Some(bytes) if counts.is_short => {
                        bytes.as_chunks().0.iter().map(|b| number(u16::from_le_bytes(*b).into())).collect()
                    }
                    Some(bytes) => bytes.as_chunks().0.iter().map(|b| number(u32::from_le_bytes(*b))).collect(),
                }
            }
        };
        // From [band][y][x] to [x][y][band].
        let mut values = vec![f32::NAN; numbers.len()];
        for (band, plane) in numbers.chunks_exact(pixels).enumerate() {
            for (i, value) in plane.iter().enumerate() {
                values[((i % width) * height + i / width) * bands + band] = *value;
            }
        }
        Ok(Some(Chunk::of(values, grid.rect(tile), grid.tile, bands)))
    }

    /// The file of a tile.
    pub(super) fn counts_path(&self, array: &str, tile: u32) -> std::path::PathBuf {
        let [column, row] = self.grid().position(tile);
        self.path().join(format!("{array}/c/0/{row}/{column}"))
    }
}

fn read_counts(path: &Path, group: &Value) -> Result<Cube> {
    let attributes = group["attributes"].as_object().cloned().unwrap_or_default();
    let damaged = |what: &str| Error::storage(path, format!("holds damaged counts of a sensor: its zarr.json {what}"));
    if attributes[SENSOR_FORMAT].as_u64() != Some(COUNTS_FORMAT) {
        let what = "holds counts in the layout of another version of Spectile; make them anew, with `spectile sensor`";
        return Err(Error::storage(path, what));
    }
    let stored = &group["consolidated_metadata"]["metadata"]["counts"];
    let three = |value: &Value| -> Option<[u32; 3]> {
        let list: Option<Vec<u32>> = value.as_array()?.iter().map(|v| u32::try_from(v.as_u64()?).ok()).collect();
        list?.try_into().ok()
    };
    let (shape, chunk) = (three(&stored["shape"]), three(&stored["chunk_grid"]["configuration"]["chunk_shape"]));
    let (Some([bands, height, width]), Some([together, tile_height, tile_width])) = (shape, chunk) else {
        return Err(damaged("gives no shape [band, y, x] and chunk of `counts`"));
    };
    let is_short = match stored["data_type"].as_str() {
        Some("uint16") => true,
        Some("uint32") => false,
        _ => return Err(damaged("gives `counts` a type other than uint16 and uint32")),
    };
    let is_plain = stored["codecs"].as_array().is_some_and(|codecs| codecs.len() == 1 && codecs[0]["name"] == "bytes");
    if !is_plain || together != bands {
        let what = "holds counts that somebody has stored in another way; open them with xarray";
        return Err(Error::storage(path, what));
    }
    let fill = if is_short { u16::MAX.into() } else { u32::MAX };
    let ours = serde_json::json!({ "attributes": { "units": "1", "_FillValue": fill } });
    check_meaning(path, "somebody has given", "counts", &ours, stored)?;
    let names: Option<Vec<String>> = attributes
        .get("band_names")
        .and_then(|names| names.as_array()?.iter().map(|name| name.as_str().map(str::to_owned)).collect());
    let origin: Option<[u32; 2]> = attributes.get("origin").and_then(|v| serde_json::from_value(v.clone()).ok());
    let (Some(names), Some(origin)) = (names.filter(|names| names.len() == bands as usize), origin) else {
        return Err(damaged("does not name all bands, or not where the picture begins"));
    };
    let bounds = read_doubles(&path.join("wavelength_bounds/c/0/0"), 2 * bands as usize)?;
    let bounds = bounds.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect();
    let channels = Channels { names, ..Channels::from_bounds(bounds, None) };
    let projection = Projection::false_colour(three_of(&channels, false));
    let header =
        Header { size: [width, height], origin, tile: [tile_width, tile_height], channels, epoch: 1, attributes };
    header.validate().map_err(|what| damaged(&format!("describes {what}")))?;
    let mut cube = Cube::new(path, header, Layout::Columns, Origin::Counts(Counts { is_short, fill, plain: None }));
    cube.set_projection(projection);
    Ok(cube)
}
