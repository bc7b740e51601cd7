//! Layers of a cube in other formats: a band, channel or column for each of their numbers, line by line.

use std::io::Write;
use std::path::{Path, PathBuf};

use exr::block::UncompressedBlock;
use exr::block::writer::ChunksWriter;
use exr::math::Vec2;
use exr::meta::BlockDescription;
use exr::meta::attribute::LineOrder;
use exr::meta::header::Header;
use exr::prelude::Compression;
use smallvec::SmallVec;

use super::{PIECE_BYTES, Progress, check_space, envi, exr as spectral_exr, table};
use crate::cube::{Cube, Layer, Rect};
use crate::files::output::Replacement;
use crate::format::envi::{DataType, Image, Interleave};
use crate::{Error, Result};

/// Formats that take layers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// f64, by lines.
    Envi,
    /// f32: no coordinates, which that would round.
    Exr,
    Csv,
}

/// Some layers of some pixels of a cube.
pub struct LayerView<'a> {
    cube: &'a Cube,
    layers: Vec<Layer>,
    rect: Rect,
}

impl<'a> LayerView<'a> {
    /// Errors: layers that the cube does not have, pixels that are not its.
    pub fn new(cube: &'a Cube, layers: &[Layer], rect: Option<Rect>) -> Result<LayerView<'a>> {
        let refuse = |what: String| Err(Error::Usage(format!("{}: {what}", cube.path().display())));
        if let Some(missing) = layers.iter().find(|layer| !cube.layers().contains(layer)) {
            let has = match cube.layers() {
                [] => "no layers".to_owned(),
                layers => format!("only {}", layers.iter().map(|layer| layer.name()).collect::<Vec<_>>().join(", ")),
            };
            let name = missing.name();
            return refuse(format!("has {has}; `spectile render --layers {name}` makes a cube with `{name}`"));
        }
        let [width, height] = cube.header().size;
        let rect = rect.unwrap_or(Rect { x0: 0, y0: 0, x1: width, y1: height });
        if rect.x1 > width || rect.y1 > height {
            let Rect { x0, y0, x1, y1 } = rect;
            return refuse(format!(
                "{x0},{y0},{x1},{y1} is no part of the picture, which has {width} x {height} pixels"
            ));
        }
        let layers = Layer::ALL.into_iter().filter(|layer| layers.contains(layer)).collect();
        Ok(LayerView { cube, layers, rect })
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.rect.width(), self.rect.height()]
    }

    /// Such as `depth`, `normal.x`.
    pub fn names(&self) -> Vec<String> {
        let of = |layer: &Layer| {
            let name = layer.name();
            layer.axes().iter().map(move |axis| if axis.is_empty() { name.into() } else { format!("{name}.{axis}") })
        };
        self.layers.iter().flat_map(of).collect()
    }

    /// As [`crate::cube::View::georeference`].
    fn georeference(&self) -> Option<(&'a str, [f64; 6])> {
        let (crs, [a, b, c, d, e, f]) = self.cube.header().georeference()?;
        let [x, y] = [self.rect.x0, self.rect.y0].map(f64::from);
        Some((crs, [a, b, a * x + b * y + c, d, e, d * x + e * y + f]))
    }

    /// Column and row on the full film.
    fn origin(&self) -> [u32; 2] {
        let [x, y] = self.cube.header().origin;
        [x + self.rect.x0, y + self.rect.y0]
    }

    /// Calls `take(y, values)` for every line, counted from the first: \[name\]\[column\], NaN where nothing is seen.
    fn lines(&self, progress: &mut Progress, mut take: impl FnMut(usize, &[f64]) -> Result<()>) -> Result<()> {
        let (grid, rect, count) = (self.cube.grid(), self.rect, self.names().len());
        let width = rect.width() as usize;
        let together = (PIECE_BYTES / (8 * count * width)).max(1) as u32;
        let mut values = Vec::new();
        let mut y0 = rect.y0;
        while y0 < rect.y1 {
            // Of one row of tiles.
            let y1 = (y0 + together).min((y0 / grid.tile[1] + 1) * grid.tile[1]).min(rect.y1);
            values.clear();
            values.resize((y1 - y0) as usize * count * width, f64::NAN);
            let mut x0 = rect.x0;
            while x0 < rect.x1 {
                let tile = grid.tile_at(x0, y0);
                let of_tile = grid.rect(tile);
                let x1 = of_tile.x1.min(rect.x1);
                let mut column = 0;
                for &layer in &self.layers {
                    let axes = layer.axes().len();
                    let lines = self.cube.layer_lines(layer, tile, y0 - of_tile.y0..y1 - of_tile.y0)?;
                    for (line, y) in
                        lines.iter().flat_map(|lines| lines.chunks_exact(grid.tile[0] as usize * axes)).zip(0..)
                    {
                        let to = y * count * width + column * width + (x0 - rect.x0) as usize;
                        for (i, pixel) in line
                            .chunks_exact(axes)
                            .skip((x0 - of_tile.x0) as usize)
                            .take((x1 - x0) as usize)
                            .enumerate()
                        {
                            for (axis, &value) in pixel.iter().enumerate() {
                                values[to + axis * width + i] = value;
                            }
                        }
                    }
                    column += axes;
                }
                x0 = x1;
            }
            for (i, line) in values.chunks_exact(count * width).enumerate() {
                take((y0 - rect.y0) as usize + i, line)?;
            }
            progress(u64::from(y1 - rect.y0) * u64::from(rect.width()), rect.pixels())?;
            y0 = y1;
        }
        Ok(())
    }
}

/// Writes `view` to `path`, new or one of the same format that is replaced, and returns the files written.
pub fn write(view: &LayerView, path: &Path, format: Format, progress: &mut Progress) -> Result<Vec<PathBuf>> {
    match format {
        Format::Envi => write_envi(view, path, progress),
        Format::Exr => write_exr(view, path, progress),
        Format::Csv => write_table(view, path, progress),
    }
}

fn write_envi(view: &LayerView, path: &Path, progress: &mut Progress) -> Result<Vec<PathBuf>> {
    let names = view.names();
    let [width, height] = view.size();
    check_space(path, u64::from(width) * u64::from(height) * names.len() as u64 * 8)?;
    let image = Image {
        description: "what the first surface behind each pixel is",
        size: [width as usize, height as usize, names.len()],
        interleave: Interleave::Bil,
        data_type: DataType::F64,
        units: "m; normals, numbers and cosines have none",
        ignore: envi::MISSING.into(),
        origin: view.origin(),
        default_bands: None,
        wavelength_nm: Vec::new(),
        fwhm_nm: Vec::new(),
        names,
        map: view.georeference(),
    };
    envi::write_files(path, &image, &mut |file| {
        view.lines(progress, |_, line| {
            let numbers: Vec<f64> =
                line.iter().map(|value| if value.is_nan() { envi::MISSING.into() } else { *value }).collect();
            let written = file.file().write_all(bytemuck::cast_slice(&numbers));
            written.map_err(|error| file.failed(&error))
        })
    })
}

fn write_exr(view: &LayerView, path: &Path, progress: &mut Progress) -> Result<Vec<PathBuf>> {
    if view.layers.contains(&Layer::Coordinates) {
        let what =
            "OpenEXR has no numbers of 64 bits, and 32 would round coordinates; leave them out, or write ENVI or CSV";
        return Err(Error::Usage(format!("{}: {what}", path.display())));
    }
    let names = view.names();
    let [width, height] = view.size().map(|side| side as usize);
    check_space(path, (width * height * names.len() * 4) as u64)?;
    // Readers expect them in the order of the alphabet.
    let mut order: Vec<usize> = (0..names.len()).collect();
    order.sort_by_key(|&i| &names[i]);
    let channels = order.iter().map(|&i| spectral_exr::channel(&names[i])).collect::<Result<SmallVec<_>>>()?;
    // A line at a time.
    let mut header = Header::new(spectral_exr::text("layers")?, Vec2(width, height), channels).with_encoding(
        Compression::ZIP1,
        BlockDescription::ScanLines,
        LineOrder::Increasing,
    );
    header.own_attributes.layer_name = None;
    header.own_attributes.comments = Some(spectral_exr::text(&format!("Spectile {}", env!("CARGO_PKG_VERSION")))?);
    let failed = spectral_exr::failed(path);
    let image = spectral_exr::write_image(path, header, |meta, writer| {
        let mut indices = exr::block::enumerate_ordered_header_block_indices(&meta.headers);
        view.lines(progress, |_, line| {
            let (at, index) = indices.next().ok_or_else(|| Error::Internal("an EXR image has too few lines".into()))?;
            let of = |&i: &usize| line[i * width..(i + 1) * width].iter().map(|value| *value as f32);
            let numbers: Vec<f32> = order.iter().flat_map(of).collect();
            let block = UncompressedBlock { index, data: bytemuck::cast_slice(&numbers).to_vec() };
            let chunk = block.compress_to_chunk(&meta.headers).map_err(failed)?;
            writer.write_chunk(at, chunk).map_err(failed)
        })
    })?;
    image.finish()?;
    Ok(vec![path.to_owned()])
}

fn write_table(view: &LayerView, path: &Path, progress: &mut Progress) -> Result<Vec<PathBuf>> {
    let mut replacement = Replacement::create(path, table::TABLE)?;
    let names = view.names();
    let ([left, top], width) = (view.origin(), view.size()[0] as usize);
    let header = format!("x,y,{}\n", names.join(","));
    let mut text = header.into_bytes();
    view.lines(progress, |y, line| {
        for x in 0..width {
            let _ = write!(text, "{},{}", left as usize + x, top as usize + y);
            for value in line.chunks_exact(width).map(|values| values[x]) {
                // What is in an array of f32 needs no more digits than that.
                let _ = match (value.is_nan(), f64::from(value as f32) == value) {
                    (true, _) => write!(text, ","),
                    (_, true) => write!(text, ",{}", value as f32),
                    _ => write!(text, ",{value}"),
                };
            }
            text.push(b'\n');
        }
        let written = replacement.file().write_all(&text);
        text.clear();
        written.map_err(|error| replacement.failed(&error))
    })?;
    replacement.finish()?;
    Ok(vec![path.to_owned()])
}
