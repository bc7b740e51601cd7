//! A cube seen by a sensor, tile by tile.

use std::path::Path;

use rayon::prelude::*;
use serde_json::Value;

use super::detect::{Clipped, Electronics};
use super::figures::Figures;
use super::radiometry::{Bands, Optical};
use super::store::{Store, Values};
use crate::cube::{Chunk, Cube};
use crate::scene::SensorModel;
use crate::{Error, Result};

/// What is asked for besides the model.
#[derive(Debug, Clone)]
pub struct Settings {
    pub seed: u64,
    pub noise: bool,
    /// Whether the signal without noise is kept beside the counts.
    pub electrons: bool,
    /// Whether tiles may be missing.
    pub partial: bool,
    pub overwrite: bool,
    /// The model's name, for the attributes.
    pub about: String,
}

/// What a band became.
#[derive(Debug, Clone)]
pub struct BandReport {
    pub name: String,
    pub figures: Figures,
    /// Mean over pixels of the signal without noise, the optics' share included: electrons, or W.
    pub mean_signal: f64,
    pub clipped: Clipped,
}

/// What a run found.
#[derive(Debug, Clone)]
pub struct Applied {
    pub bands: Vec<BandReport>,
    pub left_out: Vec<(String, f64)>,
    /// Values of radiance below 0, which a render's noise makes, taken as 0 where they make the signal of a pixel negative.
    pub negative: u64,
    pub pixels: u64,
}

/// Of a row of pixels in one band.
#[derive(Debug, Clone, Default)]
struct Row {
    sum: f64,
    negative: u64,
    clipped: Clipped,
    /// The first pixel with a value that is not finite.
    wrong: Option<[u32; 2]>,
}

/// Makes at `path` the counts of `model` looking at `cube`. A tile at a time is in memory. `progress` is called with the tiles done,
/// of all; an error of it ends the work, and nothing is left or replaced.
///
/// # Errors
/// Channels with responses, no band that the channels cover, missing tiles without `partial`, radiance that is not finite.
pub fn apply(
    cube: &Cube,
    model: &SensorModel,
    settings: &Settings,
    path: &Path,
    progress: &mut dyn FnMut(u64, u64) -> Result<()>,
) -> Result<Applied> {
    let usage = |what: String| Err(Error::Usage(format!("{}: {what}", cube.path().display())));
    if !cube.channels().responses.is_empty() {
        return usage("its channels are weighted by responses already; sensors need plain channels".into());
    }
    let film = &cube.header().attributes.get("settings").unwrap_or(&Value::Null)["film"];
    if film["filter"].as_str().is_some_and(|filter| filter != "box") {
        return usage(
            "was rendered with a film.filter that mixes pixels; a detector's pixel is the filter \"box\"".into(),
        );
    }
    let vignetting = match model.optics.cos4 {
        None => None,
        Some(focal_length) => match (film["width"].as_f64(), film["height"].as_f64()) {
            (Some(width), Some(height)) => {
                Some(Vignetting { centre: [0.5 * width, 0.5 * height], per_pixel: model.pitch / focal_length })
            }
            _ => return usage("does not tell the size of its film, which optics.cos4 needs for the axis".into()),
        },
    };
    let Bands { bands, left_out } = Bands::new(model, cube.channels());
    if bands.is_empty() {
        let most = left_out.iter().map(|(_, share)| *share).fold(0.0, f64::max);
        return usage(format!(
            "its channels cover no band of {}: {:.1} % at most of what one responds to, and 99 % are needed",
            settings.about,
            100.0 * most
        ));
    }
    let samples = cube.all_samples()?;
    let missing = samples.iter().filter(|samples| **samples == 0).count();
    if missing == samples.len() || (missing > 0 && !settings.partial) {
        return usage(format!(
            "{missing} of {} tiles are not rendered; go on with the render, or give --partial for a picture with holes",
            samples.len()
        ));
    }
    let electronics = Electronics { model, seed: settings.seed, noise: settings.noise };
    let grid = cube.grid();
    let mut store = Store::create(path, cube, model, &bands, settings)?;
    let mut rows = vec![Row::default(); bands.len()];
    let mut pixels = 0;
    let (width, height) = (grid.tile[0] as usize, grid.tile[1] as usize);
    let mut values = Values::new(bands.len() * width * height, model, settings.electrons);
    for tile in 0..grid.count() {
        if let (Some(chunk), 1..) = (cube.chunk(tile)?, samples[tile as usize]) {
            values.clear();
            let tasks: Vec<_> = values.rows(width).enumerate().collect();
            let done: Vec<Row> = tasks
                .into_par_iter()
                .map(|(i, (counts, signal))| {
                    let (band, y) = (i / height, chunk.rect().y0 + (i % height) as u32);
                    let row = (&chunk, y, cube.header().origin, vignetting);
                    expose_row(row, &bands[band], band, &electronics, counts, signal)
                })
                .collect();
            // In one order whatever the threads did.
            for (i, row) in done.into_iter().enumerate() {
                if let Some([x, y]) = row.wrong {
                    return usage(format!(
                        "the radiance of pixel {x} {y} is not finite in a channel of the band {}; render it again",
                        bands[i / height].name
                    ));
                }
                let of_band = &mut rows[i / height];
                of_band.sum += row.sum;
                of_band.negative += row.negative;
                of_band.clipped += row.clipped;
            }
            pixels += chunk.rect().pixels();
            store.put(grid.position(tile), &values)?;
        }
        progress(u64::from(tile) + 1, grid.count().into())?;
    }
    let reports = bands.iter().zip(&rows).map(|(band, row)| {
        let mean = row.sum / pixels as f64;
        let figures = Figures::new(&electronics, band, mean);
        BandReport { name: band.name.clone(), figures, mean_signal: mean + band.background, clipped: row.clipped }
    });
    let applied =
        Applied { bands: reports.collect(), left_out, negative: rows.iter().map(|row| row.negative).sum(), pixels };
    store.finish(&applied)?;
    Ok(applied)
}

/// How much darker pixels off the axis are.
#[derive(Debug, Clone, Copy)]
struct Vignetting {
    /// The axis, in pixels of the full film.
    centre: [f64; 2],
    /// Tangent of the angle a pixel.
    per_pixel: f64,
}

impl Vignetting {
    /// cos⁴θ = 1 / (1 + tan²θ)² at the middle of a pixel.
    fn at(&self, pixel: [u32; 2]) -> f64 {
        let tangent = |axis: usize| self.per_pixel * (f64::from(pixel[axis]) + 0.5 - self.centre[axis]);
        (1.0 + tangent(0).powi(2) + tangent(1).powi(2)).powi(-2)
    }
}

/// One row of a tile in one band; rows below the picture stay empty.
fn expose_row(
    (chunk, y, origin, vignetting): (&Chunk, u32, [u32; 2], Option<Vignetting>),
    band: &Optical,
    index: usize,
    electronics: &Electronics,
    counts: &mut [u32],
    mut signal: Option<&mut [f32]>,
) -> Row {
    let (rect, mut row) = (chunk.rect(), Row::default());
    if y >= rect.y1 {
        return row;
    }
    for x in rect.x0..rect.x1 {
        let spectrum = chunk.spectrum(x, y);
        let light: f64 = band.weights.iter().map(|&(k, weight)| weight * f64::from(spectrum[k])).sum();
        if !light.is_finite() {
            row.wrong.get_or_insert([x, y]);
            continue;
        }
        row.negative += u64::from(light < 0.0);
        let pixel = [origin[0] + x, origin[1] + y];
        let light = light.max(0.0) * vignetting.map_or(1.0, |vignetting| vignetting.at(pixel));
        row.sum += light;
        let at = (x - rect.x0) as usize;
        counts[at] = electronics.count(light + band.background, pixel, index, &mut row.clipped);
        if let Some(signal) = &mut signal {
            signal[at] = (light + band.background) as f32;
        }
    }
    row
}
