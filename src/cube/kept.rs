//! A factored cube under other spectra while it is looked at: its weights stay in memory, so that pictures, spectra and colours follow a
//! change at once. What is shown is what the cube would be that [`super::relight`] makes, in the same channels.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;

use super::grid::Rect;
use super::state::{CubeState, RegionMean, Sums, Window, add};
use super::store::Cube;
use super::weights::Weights;
use crate::spectral::colour::{Observer, ProjectionKind, xyz_to_linear_srgb, xyz_weights};
use crate::spectral::lab::{Lab, delta_e_2000, lab};
use crate::spectral::product::{Basis, Expander};
use crate::{Error, Result};

/// Bytes of weights that are kept. What is beyond is read from disk whenever it is needed.
pub const MOST_WEIGHTS: u64 = 1 << 30;
/// Bytes of colours that are kept for each light.
const MOST_COLOURS: u64 = 192 << 20;
/// Pixels that one picture may go through.
const MOST_PIXELS: u64 = 1 << 26;
/// Tiles at a time.
const TOGETHER: usize = 16;

/// Something of a tile, with the samples that the tile then had.
type Slot<T> = Mutex<Option<(u32, Arc<T>)>>;

/// The weights of a cube's tiles in memory, as far as there is room.
pub struct KeptWeights {
    tiles: Vec<Slot<TileWeights>>,
    bytes: AtomicU64,
    most: u64,
    colours: Colours,
}

/// Weights of a tile, and what of its colours does not separate.
struct TileWeights {
    weights: Weights,
    /// Three planes, by pixel of the full tile.
    remainder: Option<Vec<f32>>,
}

/// Three planes that pictures are made of, linear in the channels: X, Y and Z, or where those do not show what an eye would see what the
/// preview shows instead.
struct Colours {
    /// Channels that take part.
    channels: Vec<(usize, [f64; 3])>,
    is_xyz: bool,
}

/// What light and paint are: a basis, in the channels of a cube; and colours of the cube under it, as far as there is room.
pub struct Light {
    expander: Expander,
    colours: Vec<Slot<Vec<f32>>>,
    bytes: AtomicU64,
}

/// A cube as it is at this moment, under a light.
#[derive(Clone, Copy)]
pub struct Relit<'a> {
    pub state: CubeState<'a>,
    pub kept: &'a KeptWeights,
    pub light: &'a Light,
}

/// How a place looks under two lights.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// X, Y, Z of both: of the CIE 1931 observer, divided by ∫ȳ dλ.
    pub xyz: [[f64; 3]; 2],
    pub lab: [Lab; 2],
    /// ΔE 2000.
    pub delta_e: f64,
}

impl Difference {
    /// Of two colours, each with the white that it is seen beside.
    pub fn of(xyz: [[f64; 3]; 2], white: [[f64; 3]; 2]) -> Difference {
        let [a, b] = [0, 1].map(|i| lab(xyz[i], white[i]));
        Difference { xyz, lab: [a, b], delta_e: delta_e_2000(a, b) }
    }
}

fn locked<T>(slot: &Slot<T>) -> MutexGuard<'_, Option<(u32, Arc<T>)>> {
    slot.lock().unwrap_or_else(PoisonError::into_inner)
}

fn slots<T>(cube: &Cube) -> Vec<Slot<T>> {
    (0..cube.grid().count()).map(|_| Mutex::default()).collect()
}

/// What `slot` holds of a tile that has `samples`, or else what `make` makes, kept if `bytes` of all such slots then are `most` at most.
fn kept_or_made<T>(
    slot: &Slot<T>,
    samples: u32,
    (bytes, most): (&AtomicU64, u64),
    size: impl Fn(&T) -> u64,
    make: impl FnOnce() -> Result<Option<T>>,
) -> Result<Option<Arc<T>>> {
    let mut slot = locked(slot);
    if let Some((of, kept)) = &*slot
        && *of == samples
    {
        return Ok(Some(Arc::clone(kept)));
    }
    if let Some((_, old)) = slot.take() {
        bytes.fetch_sub(size(&old), Ordering::SeqCst);
    }
    let Some(made) = make()?.map(Arc::new) else { return Ok(None) };
    let more = size(&made);
    if bytes.fetch_add(more, Ordering::SeqCst) + more <= most {
        *slot = Some((samples, Arc::clone(&made)));
    } else {
        bytes.fetch_sub(more, Ordering::SeqCst);
    }
    Ok(Some(made))
}

impl KeptWeights {
    /// Of `cube`, a factored one: nothing is read yet. At most `most` bytes of weights will be kept.
    pub fn new(cube: &Cube, most: u64) -> KeptWeights {
        KeptWeights { tiles: slots(cube), bytes: AtomicU64::new(0), most, colours: Colours::of(cube) }
    }

    /// Whether colours are those that an eye would see.
    pub fn is_xyz(&self) -> bool {
        self.colours.is_xyz
    }

    /// Bytes that are kept now.
    pub fn bytes(&self) -> u64 {
        self.bytes.load(Ordering::SeqCst)
    }

    /// A tile; `None` before its first unit.
    fn tile(&self, state: CubeState<'_>, tile: u32) -> Result<Option<(u32, Arc<TileWeights>)>> {
        let samples = state.samples(tile)?;
        if samples == 0 {
            return Ok(None);
        }
        let size = |tile: &TileWeights| {
            tile.weights.bytes() + 4 * tile.remainder.as_ref().map_or(0, |planes| planes.len() as u64)
        };
        let make = || {
            let Some(weights) = state.weights(tile)? else { return Ok(None) };
            let remainder = match state.remainder(tile)? {
                None => None,
                Some(chunk) => {
                    let grid = state.cube().grid();
                    let mut planes = vec![0.0f32; 3 * weights.pixels()];
                    for (x, y) in places(chunk.rect()) {
                        let pixel = grid.pixel_in_tile(x, y);
                        let colour = self.colours.of_spectrum(chunk.spectrum(x, y));
                        planes[3 * pixel..3 * pixel + 3].copy_from_slice(&colour.map(|v| v as f32));
                    }
                    Some(planes)
                }
            };
            Ok(Some(TileWeights { weights: weights.without_shares(), remainder }))
        };
        let found = kept_or_made(&self.tiles[tile as usize], samples, (&self.bytes, self.most), size, make)?;
        Ok(found.map(|found| (samples, found)))
    }
}

/// Columns and rows of the pixels of a rectangle.
fn places(rect: Rect) -> impl Iterator<Item = (u32, u32)> {
    (rect.y0..rect.y1).flat_map(move |y| (rect.x0..rect.x1).map(move |x| (x, y)))
}

impl Colours {
    fn of(cube: &Cube) -> Colours {
        let is_xyz = cube.projection().kind == ProjectionKind::Xyz;
        let weights: Vec<[f64; 3]> = match cube.projection().kind {
            ProjectionKind::Xyz => xyz_weights(cube.channels(), Observer::Cie1931),
            ProjectionKind::FalseColour(rgb) => {
                let of = |k: usize| rgb.map(|shown| if shown == k { 1.0 } else { 0.0 });
                (0..cube.channels().len()).map(of).collect()
            }
        };
        let takes_part = |(_, weight): &(usize, [f64; 3])| weight.iter().any(|&w| w != 0.0);
        Colours { channels: weights.into_iter().enumerate().filter(takes_part).collect(), is_xyz }
    }

    /// The three planes of what has this radiance in all channels.
    fn of_spectrum(&self, radiance: &[f32]) -> [f64; 3] {
        self.channels.iter().fold([0.0; 3], |sum, (k, weight)| {
            let value = f64::from(radiance[*k]);
            std::array::from_fn(|i| sum[i] + weight[i] * value)
        })
    }

    /// As the preview shows them.
    fn rgb(&self, planes: [f32; 3]) -> [f32; 3] {
        if self.is_xyz { xyz_to_linear_srgb(planes.map(f64::from)).map(|v| v as f32) } else { planes }
    }
}

impl Light {
    /// What the products of `cube`, a factored one, are under `basis`.
    pub fn new(cube: &Cube, basis: &Basis) -> Light {
        let expander = Expander::new(basis, cube.channels(), cube.header().most_factors());
        Light { expander, colours: slots(cube), bytes: AtomicU64::new(0) }
    }
}

impl Relit<'_> {
    /// The three planes of all pixels of a tile, by pixel of the full tile; `None` before its first unit.
    fn planes(&self, tile: u32) -> Result<Option<Arc<Vec<f32>>>> {
        let Some((samples, of_tile)) = self.kept.tile(self.state, tile)? else { return Ok(None) };
        let light = self.light;
        let make = || {
            let TileWeights { weights, remainder } = &*of_tile;
            let mut rows: Vec<[f64; 3]> = Vec::with_capacity(weights.products.len());
            light.expander.each_row(&weights.products, |row| rows.push(self.kept.colours.of_spectrum(row)));
            let mut planes = Vec::with_capacity(3 * weights.pixels());
            for pixel in 0..weights.pixels() {
                let mut sum = [0.0f64; 3];
                for (product, weight) in weights.of_pixel(pixel) {
                    let (row, weight) = (&rows[product], f64::from(weight));
                    (0..3).for_each(|i| sum[i] += weight * row[i]);
                }
                if let Some(remainder) = remainder {
                    (0..3).for_each(|i| sum[i] += f64::from(remainder[3 * pixel + i]));
                }
                planes.extend(sum.map(|v| v as f32));
            }
            Ok(Some(planes))
        };
        let size = |planes: &Vec<f32>| 4 * planes.len() as u64;
        kept_or_made(&light.colours[tile as usize], samples, (&light.bytes, MOST_COLOURS), size, make)
    }

    /// Calls `each` with the tiles that share pixels with `pixels`, what `of` makes of each, side by side, and the part that is shared.
    fn each_tile<T: Send>(
        &self,
        pixels: Rect,
        of: impl Fn(u32) -> Result<Option<T>> + Sync,
        mut each: impl FnMut(T, Rect),
    ) -> Result<()> {
        let grid = self.state.cube().grid();
        if pixels.pixels() > MOST_PIXELS {
            return Err(Error::Usage(format!(
                "{} pixels are more than the {MOST_PIXELS} that are made anew at once: take fewer",
                pixels.pixels()
            )));
        }
        let tiles: Vec<u32> = grid.tiles_in(pixels).collect();
        for tiles in tiles.chunks(TOGETHER) {
            let made: Vec<Option<T>> = tiles.par_iter().map(|&tile| of(tile)).collect::<Result<_>>()?;
            for (&tile, made) in tiles.iter().zip(made) {
                if let (Some(made), Some(shared)) = (made, grid.rect(tile).intersection(&pixels)) {
                    each(made, shared);
                }
            }
        }
        Ok(())
    }

    /// As [`CubeState::colour`].
    pub fn colour(&self, rect: Rect, factor: u32) -> Result<Window> {
        let (grid, mut sums) = (self.state.cube().grid(), Sums::new(rect, factor, 3));
        let pixels = sums.pixels(grid);
        self.each_tile(
            pixels,
            |tile| self.planes(tile),
            |planes, shared| {
                for (x, y) in places(shared) {
                    sums.add(x, y, 1, &self.kept.colours.rgb(at(&planes, grid.pixel_in_tile(x, y))));
                }
            },
        )?;
        Ok(sums.means())
    }

    /// As [`CubeState::channels`].
    pub fn channels(&self, channels: &[usize], rect: Rect, factor: u32) -> Result<Window> {
        let (grid, mut sums) = (self.state.cube().grid(), Sums::new(rect, factor, channels.len()));
        let pixels = sums.pixels(grid);
        self.each_tile(
            pixels,
            |tile| {
                let Some((_, of_tile)) = self.kept.tile(self.state, tile)? else { return Ok(None) };
                let products = &of_tile.weights.products;
                let mut rows = vec![0.0; channels.len() * products.len()];
                for (&k, row) in channels.iter().zip(rows.chunks_mut(products.len().max(1))) {
                    self.light.expander.write_rows(products, k..k + 1, 1, row);
                }
                Ok(Some((of_tile, rows, self.state.remainder(tile)?)))
            },
            |(of_tile, rows, remainder), shared| {
                let mut values = vec![0.0f32; channels.len()];
                let products = of_tile.weights.products.len().max(1);
                for (x, y) in places(shared) {
                    let pixel = grid.pixel_in_tile(x, y);
                    values.fill(0.0);
                    for (product, weight) in of_tile.weights.of_pixel(pixel) {
                        let of_channel = values.iter_mut().zip(rows.chunks(products));
                        of_channel.for_each(|(value, row)| *value += weight * row[product]);
                    }
                    if let Some(remainder) = &remainder {
                        let more = remainder.spectrum(x, y);
                        values.iter_mut().zip(channels).for_each(|(value, &k)| *value += more[k]);
                    }
                    sums.add(x, y, 1, &values);
                }
            },
        )?;
        Ok(sums.means())
    }

    /// As [`CubeState::spectrum`].
    pub fn spectrum(&self, x: u32, y: u32) -> Result<Option<Vec<f32>>> {
        let grid = self.state.cube().grid();
        let Some((_, of_tile)) = self.kept.tile(self.state, grid.tile_at(x, y))? else { return Ok(None) };
        let pixel = grid.pixel_in_tile(x, y);
        let mut spectrum = of_tile.weights.spectrum(pixel, &self.light.expander);
        if of_tile.remainder.is_some() {
            add(&mut spectrum, &self.state.remainder_of(x, y)?);
        }
        Ok(Some(spectrum))
    }

    /// As [`CubeState::region`], without standard errors.
    pub fn region(&self, rect: Rect) -> Result<Option<RegionMean>> {
        let grid = self.state.cube().grid();
        let all = self.light.expander.channels();
        let (mut pixels, mut radiance) = (0u64, vec![0.0f64; all]);
        self.each_tile(
            rect,
            |tile| {
                let Some((_, of_tile)) = self.kept.tile(self.state, tile)? else { return Ok(None) };
                Ok(Some((of_tile, self.state.remainder(tile)?)))
            },
            |(of_tile, remainder), shared| {
                let weights = &of_tile.weights;
                let mut of_products = vec![0.0f64; weights.products.len()];
                for (x, y) in places(shared) {
                    let pixel = grid.pixel_in_tile(x, y);
                    weights.of_pixel(pixel).for_each(|(product, weight)| of_products[product] += f64::from(weight));
                    if let Some(remainder) = &remainder {
                        radiance.iter_mut().zip(remainder.spectrum(x, y)).for_each(|(sum, &v)| *sum += f64::from(v));
                    }
                }
                pixels += shared.pixels();
                let mut of_products = of_products.into_iter();
                self.light.expander.each_row(&weights.products, |row| {
                    let weight = of_products.next().expect("one of each");
                    radiance.iter_mut().zip(row).for_each(|(sum, &value)| *sum += weight * f64::from(value));
                });
            },
        )?;
        radiance.iter_mut().for_each(|sum| *sum /= pixels as f64);
        Ok((pixels > 0).then_some(RegionMean { pixels, radiance, standard_error: None }))
    }

    /// Mean X, Y, Z over the pixels of `rect` that have samples, and how many there are; `None` where there is none.
    ///
    /// # Errors
    /// Channels that do not show what an eye would see.
    pub fn xyz(&self, rect: Rect) -> Result<Option<[f64; 3]>> {
        self.check_xyz()?;
        let grid = self.state.cube().grid();
        let (mut sum, mut pixels) = ([0.0f64; 3], 0);
        self.each_tile(
            rect,
            |tile| self.planes(tile),
            |planes, shared| {
                for (x, y) in places(shared) {
                    let xyz = at(&planes, grid.pixel_in_tile(x, y));
                    (0..3).for_each(|i| sum[i] += f64::from(xyz[i]));
                }
                pixels += shared.pixels();
            },
        )?;
        Ok((pixels > 0).then(|| sum.map(|v| v / pixels as f64)))
    }

    fn check_xyz(&self) -> Result<()> {
        if self.kept.is_xyz() {
            return Ok(());
        }
        Err(Error::Usage(
            "the channels do not show what an eye would see (they do not cover the visible, are responses, or `channels.false_colour` is \
             set), so that there are no colours to compare"
                .into(),
        ))
    }

    /// ΔE 2000 between this and `other` of each pixel, in means of `factor` x `factor` pixels as [`CubeState::colour`] has them. Each is
    /// seen beside its own white.
    ///
    /// # Errors
    /// As [`Relit::xyz`].
    pub fn differences(&self, other: &Relit<'_>, white: [[f64; 3]; 2], rect: Rect, factor: u32) -> Result<Window> {
        self.check_xyz()?;
        let (grid, mut sums) = (self.state.cube().grid(), Sums::new(rect, factor, 1));
        let pixels = sums.pixels(grid);
        self.each_tile(
            pixels,
            |tile| Ok(self.planes(tile)?.zip(other.planes(tile)?)),
            |(a, b), shared| {
                for (x, y) in places(shared) {
                    let xyz = [&a, &b].map(|planes| at(planes, grid.pixel_in_tile(x, y)).map(f64::from));
                    let delta_e =
                        if xyz[0] == xyz[1] && white[0] == white[1] { 0.0 } else { Difference::of(xyz, white).delta_e };
                    sums.add(x, y, 1, &[delta_e as f32]);
                }
            },
        )?;
        Ok(sums.means())
    }
}

/// The three planes of a pixel of a tile.
fn at(planes: &[f32], pixel: usize) -> [f32; 3] {
    std::array::from_fn(|i| planes[3 * pixel + i])
}
