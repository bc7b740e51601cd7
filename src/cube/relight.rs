//! An ordinary cube from a factored one, under other spectra and in other channels: no path is traced.

use std::path::Path;
use std::time::Instant;

use rayon::prelude::*;
use serde_json::json;

use super::create::{Aside, Existing};
use super::metadata::{DERIVED, FACTORED, Header};
use super::store::Cube;
use super::writer::Writer;
use crate::Result;
use crate::spectral::Channels;
use crate::spectral::product::{Basis, Expander};

/// Tiles between commits.
const TOGETHER: u32 = 64;

/// What there is to say of a relit cube.
#[derive(Debug, Clone, PartialEq)]
pub struct Relighted {
    /// Per channel the error estimate sqrt(Σ variance of the mean / Σ mean²) over all pixels, by the spread of the groups of
    /// epochs; NaN below two epochs.
    pub error_estimate: Vec<f64>,
    /// Entries of all pixels, and pixels that have some.
    pub entries: u64,
    pub pixels: u64,
    /// Seconds that threads spent multiplying weights by spectra, in all: without reading, standard errors and writing.
    pub expand_s: f64,
}

/// A tile under the new spectra: rows of pixels, and standard errors, column by column.
struct Tile {
    tile: u32,
    samples: u32,
    values: Vec<f32>,
    errors: Vec<f32>,
    /// Per channel Σ variance and Σ mean².
    sums: Vec<[f64; 2]>,
    entries: u64,
    expand_s: f64,
}

/// Makes at `path` the cube that `cube`, a factored one, is in `channels` where its products are made of `basis`; `changed` says what of
/// it is not as it was rendered. Standard errors are stored where the cube keeps eight groups of epochs. A few tiles at a time are in
/// memory. `progress` is called with the tiles done, of all; an error of it ends the work, and nothing is left or replaced.
pub fn relight(
    cube: &Cube,
    basis: &Basis,
    channels: &Channels,
    changed: &[String],
    path: &Path,
    existing: Existing,
    progress: &mut dyn FnMut(u64, u64) -> Result<()>,
) -> Result<Relighted> {
    let expander = Expander::new(basis, channels, cube.header().most_factors());
    let mut attributes = cube.header().attributes.clone();
    attributes.remove(FACTORED);
    attributes.insert(DERIVED.into(), json!({ "relit": changed }));
    let header = Header { channels: channels.clone(), attributes, ..cube.header().clone() };
    let count = cube.grid().count();
    let aside = Aside::new(path, &header, existing)?;
    let writer = Writer::open(aside.path(), &header, Existing::Refuse, 0..count, &mut |_| {});
    let writer = writer.map_err(|error| aside.error(error))?;
    let mut sums = vec![[0.0f64; 2]; channels.len()];
    let (mut entries, mut pixels, mut expand_s) = (0, 0, 0.0);
    let at_once = 2 * rayon::current_num_threads() as u32;
    let mut since_commit = 0;
    for first in (0..count).step_by(at_once as usize) {
        let tiles = first..(first + at_once).min(count);
        let done: Vec<Option<Tile>> = tiles
            .clone()
            .into_par_iter()
            .map(|tile| {
                let made = expand(cube, &expander, tile)?;
                if let Some(made) = &made {
                    if let Some(layers) = cube.tile_layers(tile)? {
                        writer.lay(tile, layers);
                    }
                    let errors = header.has_uncertainty().then_some(&made.errors[..]);
                    writer
                        .store_columns(tile, made.samples, &made.values, errors)
                        .map_err(|error| aside.error(error))?;
                }
                Ok(made.map(|made| Tile { values: Vec::new(), errors: Vec::new(), ..made }))
            })
            .collect::<Result<_>>()?;
        for made in done.into_iter().flatten() {
            sums.iter_mut().zip(&made.sums).for_each(|(sum, of_tile)| {
                sum[0] += of_tile[0];
                sum[1] += of_tile[1];
            });
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
    Ok(Relighted { error_estimate, entries, pixels, expand_s })
}

/// A tile under other spectra; `None` before its first unit.
fn expand(cube: &Cube, expander: &Expander, tile: u32) -> Result<Option<Tile>> {
    let samples = cube.samples(tile)?;
    let (Some(weights), 1..) = (cube.state().weights(tile)?, samples) else { return Ok(None) };
    let (size, rect, channels) = (cube.header().tile, cube.grid().rect(tile), expander.channels());
    let rows = expander.rows(&weights.products);
    let began = Instant::now();
    let values = weights.expanded(&rows, channels, size, rect);
    let expand_s = began.elapsed().as_secs_f64();
    let errors = weights.standard_errors(&rows, channels, size, rect, &cube.groups(samples));
    let mut sums = vec![[0.0f64; 2]; channels];
    for (values, errors) in
        values.chunks(channels).zip(errors.chunks(channels)).filter(|(values, _)| !values[0].is_nan())
    {
        for ((sums, value), error) in sums.iter_mut().zip(values).zip(errors) {
            sums[0] += f64::from(*error) * f64::from(*error);
            sums[1] += f64::from(*value) * f64::from(*value);
        }
    }
    Ok(Some(Tile { tile, samples, values, errors, sums, entries: weights.len() as u64, expand_s }))
}
