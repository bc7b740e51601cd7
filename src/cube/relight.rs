//! An ordinary cube from a factored one, under other spectra and in other channels: no path is traced.

use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use rayon::prelude::*;
use serde_json::json;

use super::create::{Aside, Existing};
use super::metadata::{DERIVED, FACTORED, Header};
use super::remainder::{RemainderShare, Unions, left_out};
use super::store::Cube;
use super::weights::{Expand, Rows};
use super::writer::Writer;
use crate::Result;
use crate::spectral::Channels;
use crate::spectral::product::{Basis, Expander};

/// Tiles between commits.
const TOGETHER: u32 = 64;

/// The cube that is wanted of a factored one.
#[derive(Clone, Copy)]
pub struct NewCube<'a> {
    /// What its products are made of, and in which channels.
    pub basis: &'a Basis,
    pub channels: &'a Channels,
    /// What of it is not as it was rendered.
    pub changed: &'a [String],
    /// Without what does not separate.
    pub without_remainder: bool,
    /// What makes radiance.
    pub by: &'a dyn Expand,
}

/// What there is to say of a relit cube.
#[derive(Debug, Clone, PartialEq)]
pub struct Relighted {
    /// Per channel the error estimate sqrt(Σ variance of the mean / Σ mean²) over all pixels, by the spread of the groups of
    /// epochs; NaN below two epochs.
    pub error_estimate: Vec<f64>,
    /// Entries of all pixels, and pixels that have some.
    pub entries: u64,
    pub pixels: u64,
    /// How much of the picture does not separate and is as it was rendered, of a cube that has such a thing and where it is not left out.
    pub remainder: Option<RemainderShare>,
    /// Seconds that threads spent on radiance and its standard errors, in all: without reading, what does not separate, and writing.
    pub expand_s: f64,
}

/// Radiance of a tile and its standard errors, pixels column by column. Threads hand them on from tile to tile: memory that is used for
/// the first time takes longer than what is written there.
#[derive(Default)]
struct Buffers {
    values: Vec<f32>,
    errors: Vec<f32>,
}

/// What there is to say of a tile under the new spectra.
struct Tile {
    tile: u32,
    samples: u32,
    /// Per channel Σ variance and Σ mean².
    sums: Vec<[f64; 2]>,
    /// Per channel Σ of the remainder, and of all radiance.
    remainder: [Vec<f64>; 2],
    entries: u64,
    expand_s: f64,
}

/// Makes at `path` the cube that `cube`, a factored one, is where its products are made of another basis and in other channels. What does
/// not separate is added as it was rendered. Standard errors are stored where the cube keeps eight groups of epochs. A few tiles at a
/// time are in memory. `progress` is called with the tiles done, of all; an error of it ends the work, and nothing is left or replaced.
///
/// # Errors
/// Channels in which what does not separate is not known, where it is not left out; what reading and writing cubes may end with.
pub fn relight(
    cube: &Cube,
    new: NewCube,
    path: &Path,
    existing: Existing,
    progress: &mut dyn FnMut(u64, u64) -> Result<()>,
) -> Result<Relighted> {
    let NewCube { basis, channels, changed, without_remainder, by } = new;
    let has_remainder = cube.header().has_remainder();
    let unions = (has_remainder && !without_remainder).then(|| Unions::of(cube, channels)).transpose()?;
    let expander = Expander::new(basis, channels, cube.header().most_factors());
    let mut attributes = cube.header().attributes.clone();
    attributes.remove(FACTORED);
    let mut derived = json!({ "relit": changed });
    if has_remainder {
        let words = if without_remainder { "left_out" } else { "not_relit" };
        derived[words] = json!(cube.header().remainder());
        derived["remainder_share"] = json!(left_out(cube, channels)?);
    }
    attributes.insert(DERIVED.into(), derived);
    let header = Header { channels: channels.clone(), attributes, ..cube.header().clone() };
    let count = cube.grid().count();
    let aside = Aside::new(path, &header, existing)?;
    let writer = Writer::open(aside.path(), &header, Existing::Refuse, 0..count, &mut |_| {});
    let writer = writer.map_err(|error| aside.error(error))?;
    let mut sums = vec![[0.0f64; 2]; channels.len()];
    let mut share = RemainderShare::none(channels.len());
    let (mut entries, mut pixels, mut expand_s) = (0, 0, 0.0);
    let at_once = 2 * rayon::current_num_threads() as u32;
    let (mut since_commit, buffers) = (0, Mutex::new(Vec::new()));
    let kept = || buffers.lock().unwrap_or_else(PoisonError::into_inner);
    for first in (0..count).step_by(at_once as usize) {
        let tiles = first..(first + at_once).min(count);
        let done: Vec<Option<Tile>> = tiles
            .clone()
            .into_par_iter()
            .map(|tile| {
                let mut buffers: Buffers = kept().pop().unwrap_or_default();
                let made = expand(cube, &expander, unions.as_ref(), by, tile, &mut buffers)?;
                if let Some(made) = &made {
                    if let Some(layers) = cube.tile_layers(tile)? {
                        writer.lay(tile, layers);
                    }
                    let errors = header.has_uncertainty().then_some(&buffers.errors[..]);
                    writer
                        .store_columns(tile, made.samples, &buffers.values, errors)
                        .map_err(|error| aside.error(error))?;
                }
                kept().push(buffers);
                Ok(made)
            })
            .collect::<Result<_>>()?;
        for made in done.into_iter().flatten() {
            sums.iter_mut().zip(&made.sums).for_each(|(sum, of_tile)| {
                sum[0] += of_tile[0];
                sum[1] += of_tile[1];
            });
            share.add(&made.remainder[0], &made.remainder[1]);
            entries += made.entries;
            expand_s += made.expand_s;
            pixels += cube.grid().rect(made.tile).pixels();
        }
        since_commit += at_once;
        if since_commit >= TOGETHER {
            since_commit = 0;
            writer.flush().map_err(|error| aside.error(error))?;
        }
        progress(tiles.end.into(), count.into())?;
    }
    writer.flush().map_err(|error| aside.error(error))?;
    drop(writer);
    aside.put()?;
    let estimate = |[variance, square]: &[f64; 2]| if *square > 0.0 { (variance / square).sqrt() } else { 0.0 };
    let error_estimate = sums.iter().map(|sums| if sums[0].is_nan() { f64::NAN } else { estimate(sums) }).collect();
    let remainder = unions.map(|_| share);
    Ok(Relighted { error_estimate, entries, pixels, remainder, expand_s })
}

/// A tile under other spectra; `None` before its first unit.
fn expand(
    cube: &Cube,
    expander: &Expander,
    unions: Option<&Unions>,
    by: &dyn Expand,
    tile: u32,
    Buffers { values, errors }: &mut Buffers,
) -> Result<Option<Tile>> {
    let samples = cube.samples(tile)?;
    let (Some(weights), 1..) = (cube.state().weights(tile)?, samples) else { return Ok(None) };
    let (size, rect, channels) = (cube.header().tile, cube.grid().rect(tile), expander.channels());
    let (rows, groups) = (Rows::Of(expander, &weights.products), cube.groups(samples));
    let began = Instant::now();
    weights.expand_by(by, rows, size, rect, Some(&groups), [values, errors])?;
    let expand_s = began.elapsed().as_secs_f64();
    let mut sums = vec![[0.0f64; 2]; channels];
    let mut remainder = [vec![0.0; channels], vec![0.0; channels]];
    if let Some(unions) = unions {
        add_remainder(cube, tile, unions, values, errors, &mut remainder[0])?;
    }
    for (values, errors) in
        values.chunks(channels).zip(errors.chunks(channels)).filter(|(values, _)| !values[0].is_nan())
    {
        for (k, (value, error)) in values.iter().zip(errors).enumerate() {
            sums[k][0] += f64::from(*error) * f64::from(*error);
            sums[k][1] += f64::from(*value) * f64::from(*value);
            remainder[1][k] += f64::from(*value);
        }
    }
    // Without errors of its pixels there are those of the tile.
    if let Some(unions) = unions.filter(|_| !cube.header().has_uncertainty()) {
        let deviations: Vec<f64> = match cube.remainder_variance(tile)? {
            Some(variance) => variance.into_iter().map(f64::sqrt).collect(),
            None => vec![f64::NAN; cube.channels().len()],
        };
        unions.each(&mut sums, &deviations, |sums, deviation| sums[0] = (sums[0].sqrt() + deviation).powi(2));
    }
    Ok(Some(Tile { tile, samples, sums, remainder, entries: weights.len() as u64, expand_s }))
}

/// Adds what does not separate to the pixels of a tile, and its standard errors, if there are some, to theirs: at most they add up. Sums
/// it per channel.
fn add_remainder(
    cube: &Cube,
    tile: u32,
    unions: &Unions,
    values: &mut [f32],
    errors: &mut [f32],
    sum: &mut [f64],
) -> Result<()> {
    let (channels, rendered) = (sum.len(), cube.channels().len());
    let Some(remainder) = cube.state().remainder(tile)? else { return Ok(()) };
    for (pixel, remainder) in values.chunks_mut(channels).zip(remainder.values().chunks(rendered)) {
        if remainder[0].is_nan() {
            continue;
        }
        unions.each(pixel, remainder, |value, more| *value += more as f32);
        unions.each(sum, remainder, |sum, more| *sum += more);
    }
    if let Some(more) = cube.state().remainder_errors(tile)? {
        for (errors, more) in errors.chunks_mut(channels).zip(more.values().chunks(rendered)) {
            unions.each(errors, more, |error, more| *error += more as f32);
        }
    }
    Ok(())
}
