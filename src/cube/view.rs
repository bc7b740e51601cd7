//! A part of a cube, read in rectangles: some of its channels, in the order wanted, of some of its pixels.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::ops::Range;

use super::grid::Rect;
use super::map::Chunk;
use super::store::Cube;
use crate::spectral::Channels;
use crate::spectral::colour::{Observer, Projection, xyz_weights};
use crate::spectral::temperature::BandTemperature;
use crate::{Error, Result};

/// What the values of a view are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Mean spectral radiance, W m⁻² sr⁻¹ nm⁻¹: what the cube holds.
    Radiance,
    /// Times ∫R dλ: radiance of the channel, W m⁻² sr⁻¹.
    Integrated,
    /// The temperature, K, of a black body with this radiance in the channel.
    Temperature,
    /// The hemispherical-directional reflectance factor: of [`White`].
    Reflectance,
    /// Counts of a sensor, without a unit: whole numbers.
    Counts,
    /// X, Y and Z, W m⁻² sr⁻¹ nm⁻¹: divided by ∫ȳ dλ, so that a constant 1 has Y = 1.
    Xyz(Observer),
}

/// What a reflectance factor is relative to: what an ideal white diffuse surface would send there.
pub enum White<'a> {
    /// π L / E: an irradiance, its mean over each channel of the cube, W m⁻² nm⁻¹.
    Irradiance(Vec<f64>),
    /// L / L of the white: a cube of the same pixels and channels, in which what is seen is white.
    Cube(&'a Cube),
}

/// [`White`] of some channels and pixels.
#[derive(Clone)]
enum Divisor<'a> {
    /// By channel of the cube.
    Irradiance(Vec<f64>),
    Cube(Box<View<'a>>),
}

impl<'a> Divisor<'a> {
    /// With other bands or pixels of a white cube.
    fn map(self, change: impl FnOnce(View<'a>) -> Result<View<'a>>) -> Result<Divisor<'a>> {
        match self {
            Divisor::Irradiance(means) => Ok(Divisor::Irradiance(means)),
            Divisor::Cube(view) => Ok(Divisor::Cube(Box::new(change(*view)?))),
        }
    }
}

/// Some channels of some pixels of a cube.
#[derive(Clone)]
pub struct View<'a> {
    cube: &'a Cube,
    /// Channels of the cube.
    bands: Vec<usize>,
    channels: Channels,
    rect: Rect,
    quantity: Quantity,
    /// Of reflectance factors.
    divisor: Option<Divisor<'a>>,
    /// Standard errors instead of values.
    errors: bool,
}

/// Where values go: that of column x, row y and band b of what is read, all from 0, at `x * pixel + y * row + b * band`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Strides {
    pub row: usize,
    pub pixel: usize,
    pub band: usize,
}

/// Whole numbers as files have them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Integers {
    /// Whether they have 16 bits, not 32.
    pub is_short: bool,
    /// The value of a pixel that is missing.
    pub missing: u32,
}

impl Integers {
    /// Little-endian; what is NaN is missing.
    pub fn encode(self, values: &[f32]) -> Vec<u8> {
        let whole = |value: &f32| if value.is_nan() { self.missing } else { *value as u32 };
        match self.is_short {
            true => values.iter().flat_map(|value| (whole(value) as u16).to_le_bytes()).collect(),
            false => values.iter().flat_map(|value| whole(value).to_le_bytes()).collect(),
        }
    }
}

impl<'a> View<'a> {
    /// All of a cube.
    pub fn whole(cube: &'a Cube) -> View<'a> {
        let [x1, y1] = cube.header().size;
        View {
            cube,
            bands: (0..cube.channels().len()).collect(),
            channels: cube.channels().clone(),
            rect: Rect { x0: 0, y0: 0, x1, y1 },
            quantity: if cube.is_counts() { Quantity::Counts } else { Quantity::Radiance },
            divisor: None,
            errors: false,
        }
    }

    /// Only `bands`, channels of the cube, in this order.
    pub fn with_bands(self, bands: Vec<usize>) -> Result<View<'a>> {
        let count = self.cube.channels().len();
        if let Some(band) = bands.iter().find(|&&band| band >= count) {
            let what = format!("there is no band {band}; the cube's are 0..{count}");
            return Err(Error::Usage(format!("{}: {what}", self.cube.path().display())));
        }
        if bands.is_empty() {
            return Err(Error::Usage(format!("{}: no band is chosen", self.cube.path().display())));
        }
        let divisor =
            self.divisor.clone().map(|divisor| divisor.map(|white| white.with_bands(bands.clone()))).transpose()?;
        Ok(View { channels: self.cube.channels().select(&bands), bands, divisor, ..self })
    }

    /// Only the pixels in `rect`, in the coordinates of the cube.
    pub fn with_rect(self, rect: Rect) -> Result<View<'a>> {
        let [width, height] = self.cube.header().size;
        if rect.x0 >= rect.x1 || rect.y0 >= rect.y1 || rect.x1 > width || rect.y1 > height {
            let Rect { x0, y0, x1, y1 } = rect;
            let what = format!("{x0},{y0},{x1},{y1} is no part of the picture, which has {width} x {height} pixels");
            return Err(Error::Usage(format!("{}: {what}", self.cube.path().display())));
        }
        let divisor = self.divisor.clone().map(|divisor| divisor.map(|white| white.with_rect(rect))).transpose()?;
        Ok(View { rect, divisor, ..self })
    }

    /// As another quantity. X, Y and Z are of all channels, and three bands.
    pub fn with_quantity(self, quantity: Quantity) -> Result<View<'a>> {
        if self.cube.is_counts() {
            let what = "holds counts of a sensor: integrals, temperatures and colours are those of radiance";
            return match quantity {
                Quantity::Radiance | Quantity::Counts => Ok(self),
                _ => Err(Error::Usage(format!("{} {what}", self.cube.path().display()))),
            };
        }
        let Quantity::Xyz(observer) = quantity else { return Ok(View { quantity, ..self }) };
        if Projection::as_seen(self.cube.channels(), observer).is_none() {
            let what = "its channels do not cover the visible, so X, Y and Z cannot be told";
            return Err(Error::Usage(format!("{}: {what}", self.cube.path().display())));
        }
        Ok(View { quantity, bands: vec![0, 1, 2], channels: observer.channels(), ..self })
    }

    /// Reflectance factors of the bands and pixels chosen so far. Errors: a white cube of other pixels or channels.
    pub fn with_reflectance(self, white: White<'a>) -> Result<View<'a>> {
        if self.cube.is_counts() {
            let what = "holds counts of a sensor: reflectances are those of radiance";
            return Err(Error::Usage(format!("{} {what}", self.cube.path().display())));
        }
        let divisor = match white {
            White::Irradiance(means) => Divisor::Irradiance(means),
            White::Cube(white) => {
                let (here, there) = (self.cube.header(), white.header());
                let differ = |what: &str, here: String, there: String| {
                    let (cube, white) = (self.cube.path().display(), white.path().display());
                    Err(Error::Usage(format!("the white reference {white} has {what} {there}, and {cube} has {here}")))
                };
                if (here.size, here.origin) != (there.size, there.origin) {
                    let pixels = |[w, h]: [u32; 2], [x, y]: [u32; 2]| format!("{w} x {h} from column {x}, row {y}");
                    return differ("the pixels", pixels(here.size, here.origin), pixels(there.size, there.origin));
                }
                if (&here.channels.bounds, &here.channels.responses)
                    != (&there.channels.bounds, &there.channels.responses)
                {
                    let channels = |channels: &Channels| match channels.hull() {
                        Some([from, to]) => format!("{} from {from} to {to} nm", channels.len()),
                        None => "none".to_owned(),
                    };
                    return differ("other channels,", channels(&here.channels), channels(&there.channels));
                }
                Divisor::Cube(Box::new(View { cube: white, ..self.clone() }))
            }
        };
        Ok(View { quantity: Quantity::Reflectance, divisor: Some(divisor), ..self })
    }

    /// Whether these are reflectance factors by a white cube.
    pub fn is_by_white_cube(&self) -> bool {
        matches!(self.divisor, Some(Divisor::Cube(_)))
    }

    /// The standard errors instead of the values.
    pub fn of_errors(self) -> Result<View<'a>> {
        if self.cube.is_counts() {
            let what = "holds counts of a sensor, which have noise and no standard errors";
            return Err(Error::Usage(format!("{} {what}", self.cube.path().display())));
        }
        if !self.cube.header().has_uncertainty() {
            let what = "has no standard errors; render with --uncertainty to have them";
            return Err(Error::Usage(format!("{} {what}", self.cube.path().display())));
        }
        Ok(View { errors: true, ..self })
    }

    /// Whether these are standard errors.
    pub fn is_of_errors(&self) -> bool {
        self.errors
    }

    pub fn cube(&self) -> &'a Cube {
        self.cube
    }

    /// Channels of the cube, in the order of the view's bands.
    pub fn bands(&self) -> &[usize] {
        &self.bands
    }

    /// The view's bands.
    pub fn channels(&self) -> &Channels {
        &self.channels
    }

    /// The pixels of the cube.
    pub fn rect(&self) -> Rect {
        self.rect
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.rect.width(), self.rect.height()]
    }

    /// Column and row of the top left pixel on the full film.
    pub fn origin(&self) -> [u32; 2] {
        let [x, y] = self.cube.header().origin;
        [x + self.rect.x0, y + self.rect.y0]
    }

    /// Where it lies on a map, if it does: the coordinate reference system, and the affine transform of its own pixels.
    pub fn georeference(&self) -> Option<(&'a str, [f64; 6])> {
        let (crs, [a, b, c, d, e, f]) = self.cube.header().georeference()?;
        let [x, y] = [self.rect.x0, self.rect.y0].map(f64::from);
        Some((crs, [a, b, a * x + b * y + c, d, e, d * x + e * y + f]))
    }

    pub fn quantity(&self) -> Quantity {
        self.quantity
    }

    /// Bytes of all values.
    pub fn bytes(&self) -> u64 {
        let each = if self.integers().is_some_and(|integers| integers.is_short) { 2 } else { 4 };
        self.rect.pixels() * self.bands.len() as u64 * each
    }

    /// How values are written that are whole numbers; `None` of others.
    pub fn integers(&self) -> Option<Integers> {
        let [_, missing] = self.cube.count_range()?;
        Some(Integers { is_short: missing <= u16::MAX.into(), missing })
    }

    pub fn reader(&self) -> Reader<'_> {
        let mut white = None;
        let convert = match self.quantity {
            Quantity::Radiance | Quantity::Counts => Convert::None,
            Quantity::Reflectance => match &self.divisor {
                Some(Divisor::Irradiance(means)) => {
                    // Nothing can be told where nothing arrives.
                    let factor = |&k: &usize| if means[k] > 0.0 { PI / means[k] } else { f64::NAN };
                    Convert::Factors(self.bands.iter().map(factor).collect())
                }
                Some(Divisor::Cube(view)) => {
                    white = Some(Box::new(view.reader()));
                    Convert::None
                }
                None => unreachable!("reflectance has a divisor"),
            },
            Quantity::Integrated => {
                Convert::Factors((0..self.channels.len()).map(|k| self.channels.integral(k)).collect())
            }
            Quantity::Xyz(observer) => Convert::Xyz(xyz_weights(self.cube.channels(), observer)),
            Quantity::Temperature => Convert::Temperatures(
                (0..self.channels.len()).map(|k| BandTemperature::of(&self.channels, k)).collect(),
            ),
        };
        Reader { view: self, convert, chunks: BTreeMap::new(), white }
    }
}

enum Convert {
    None,
    Factors(Vec<f64>),
    Temperatures(Vec<BandTemperature>),
    /// Per channel of the cube.
    Xyz(Vec<[f64; 3]>),
}

/// Reads a view. The tiles of the rows read last stay mapped, so a cube that grows meanwhile is read as it was when a row of
/// tiles was begun.
pub struct Reader<'a> {
    view: &'a View<'a>,
    convert: Convert,
    chunks: BTreeMap<u32, Option<Chunk>>,
    /// What values are divided by.
    white: Option<Box<Reader<'a>>>,
}

/// Pixels whose values of one band are copied together.
const TOGETHER: u32 = 16;

impl Reader<'_> {
    /// Reads the bands `bands` (of the view) of the pixels in `rect` (of the cube) to `out`; NaN where nothing is rendered
    /// yet.
    pub fn read(&mut self, rect: Rect, bands: Range<usize>, strides: Strides, out: &mut [f32]) -> Result<()> {
        let view = self.view;
        let channels = &view.bands[bands.clone()];
        self.each(rect, |convert, chunk, common| {
            for y in common.y0..common.y1 {
                let row = (y - rect.y0) as usize * strides.row;
                for x0 in (common.x0..common.x1).step_by(TOGETHER as usize) {
                    let pixels = x0..(x0 + TOGETHER).min(common.x1);
                    let at = |x: u32, b: usize| row + (x - rect.x0) as usize * strides.pixel + b * strides.band;
                    let Some(chunk) = chunk else {
                        for b in 0..channels.len() {
                            pixels.clone().for_each(|x| out[at(x, b)] = f32::NAN);
                        }
                        continue;
                    };
                    let first = chunk.spectra_from(x0, y);
                    let stride = chunk.column_step();
                    if let Convert::Xyz(weights) = convert {
                        for x in pixels.clone() {
                            let spectrum = chunk.spectrum(x, y);
                            for b in bands.clone() {
                                let sum: f64 = weights.iter().zip(spectrum).map(|(w, v)| w[b] * f64::from(*v)).sum();
                                out[at(x, b - bands.start)] = sum as f32;
                            }
                        }
                        continue;
                    }
                    for (b, &k) in channels.iter().enumerate() {
                        let values = first[k..].iter().step_by(stride);
                        match convert {
                            Convert::None | Convert::Xyz(_) => {
                                pixels.clone().zip(values).for_each(|(x, &v)| out[at(x, b)] = v)
                            }
                            Convert::Factors(factors) => {
                                let factor = factors[bands.start + b];
                                let times = |v: f32| (f64::from(v) * factor) as f32;
                                pixels.clone().zip(values).for_each(|(x, &v)| out[at(x, b)] = times(v));
                            }
                            Convert::Temperatures(bands_of) => {
                                let band = &bands_of[bands.start + b];
                                let kelvin = |v: f32| band.kelvin(f64::from(v)) as f32;
                                pixels.clone().zip(values).for_each(|(x, &v)| out[at(x, b)] = kelvin(v));
                            }
                        }
                    }
                }
            }
        })?;
        self.divide_by_white(rect, bands, strides, out)
    }

    /// NaN where the white is black, or not rendered yet.
    fn divide_by_white(&mut self, rect: Rect, bands: Range<usize>, strides: Strides, out: &mut [f32]) -> Result<()> {
        let Some(white) = &mut self.white else { return Ok(()) };
        let mut of_white = vec![0.0f32; out.len()];
        let count = bands.len();
        white.read(rect, bands, strides, &mut of_white)?;
        for y in 0..rect.height() as usize {
            for x in 0..rect.width() as usize {
                for b in 0..count {
                    let at = y * strides.row + x * strides.pixel + b * strides.band;
                    let white = f64::from(of_white[at]);
                    out[at] = if white > 0.0 { (f64::from(out[at]) / white) as f32 } else { f32::NAN };
                }
            }
        }
        Ok(())
    }

    /// Calls `each` with column, row and all channels of the cube of every pixel in `rect` that is rendered, tile by tile.
    pub fn spectra(&mut self, rect: Rect, mut each: impl FnMut(u32, u32, &[f32])) -> Result<()> {
        self.each(rect, |_, chunk, common| {
            let Some(chunk) = chunk else { return };
            for y in common.y0..common.y1 {
                (common.x0..common.x1).for_each(|x| each(x, y, chunk.spectrum(x, y)));
            }
        })
    }

    /// Calls `each` with every tile that shares pixels with `rect`, and those pixels.
    fn each(&mut self, rect: Rect, mut each: impl FnMut(&Convert, Option<&Chunk>, Rect)) -> Result<()> {
        let grid = self.view.cube.grid();
        let rows = rect.y0 / grid.tile[1]..=(rect.y1 - 1) / grid.tile[1];
        self.chunks.retain(|&tile, _| rows.contains(&grid.position(tile)[1]));
        for tile in grid.tiles_in(rect) {
            if !self.chunks.contains_key(&tile) {
                let cube = self.view.cube;
                let chunk = if self.view.errors { cube.error_chunk(tile) } else { cube.chunk(tile) };
                self.chunks.insert(tile, chunk?);
            }
            let common = grid.rect(tile).intersection(&rect);
            if let (Some(chunk), Some(common)) = (self.chunks.get(&tile), common) {
                each(&self.convert, chunk.as_ref(), common);
            }
        }
        Ok(())
    }
}
