//! A cube seen by a sensor, tile by tile; where the optics blur, by way of planes of the whole picture.

use std::path::Path;

use rayon::prelude::*;
use serde_json::Value;

use super::detect::{Clipped, Electronics};
use super::figures::Figures;
use super::planes::{Planes, Wrong};
use super::radiometry::{Bands, Optical};
use super::store::{Store, Values};
use crate::cube::{Chunk, Cube, Grid, Rect};
use crate::scene::{Blur, SensorModel};
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
    /// That of the optics in it.
    pub background: f64,
    pub clipped: Clipped,
}

/// What a run found.
#[derive(Debug, Clone)]
pub struct Applied {
    pub bands: Vec<BandReport>,
    pub left_out: Vec<(String, f64)>,
    /// Negative signals, which a render's noise makes, or a blur of sharp edges, and which are taken as 0.
    pub negative: u64,
    /// Pixels of the detector.
    pub pixels: u64,
    /// Share of the contrast of the finest waves that the cube's pixels hold, along an axis, that a blur leaves: where it is much, detail
    /// between pixels is missing.
    pub at_nyquist: f64,
    /// Bands in which the noise of the cube itself is more than a tenth of the sensor's, and how much of it it is.
    pub noisy: Vec<(String, f64)>,
}

/// Of a row of pixels in one band.
#[derive(Debug, Clone, Default)]
struct Row {
    /// Pixels that are there.
    count: u64,
    sum: f64,
    negative: u64,
    clipped: Clipped,
    /// The first pixel with a value that is not finite.
    wrong: Option<[u32; 2]>,
}

/// The picture of a detector: places in its own pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    pub grid: Grid,
    /// Column and row, on the full film, of the first pixel.
    pub origin: [u32; 2],
    /// Pixels of the cube that make one, along each axis.
    pub oversampling: u32,
}

impl Frame {
    /// # Errors
    /// In words: a cube that is not cut into whole pixels of the detector.
    fn new(cube: &Cube, oversampling: u32) -> std::result::Result<Frame, String> {
        let (header, n) = (cube.header(), oversampling);
        if header.size.iter().chain(&header.origin).any(|side| side % n != 0) {
            let [[width, height], [left, top]] = [header.size, header.origin];
            return Err(format!(
                "its {width} x {height} pixels from column {left}, row {top} are not cut into {n} x {n} by detector.oversampling"
            ));
        }
        let size = header.size.map(|side| side / n);
        Ok(Frame { grid: Grid { size, tile: header.tile }, origin: header.origin.map(|at| at / n), oversampling: n })
    }

    /// The pixels of the cube that make these.
    fn of_cube(&self, rect: Rect) -> Rect {
        let n = self.oversampling;
        Rect { x0: n * rect.x0, y0: n * rect.y0, x1: n * rect.x1, y1: n * rect.y1 }
    }
}

/// Makes at `path` the counts of `model` looking at `cube`. A tile at a time is in memory; where the optics blur, or several pixels make
/// one, 8 bytes for each pixel, band and wavelength of the blur lie beside the result meanwhile. `progress` is called with the steps done,
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
    let frame = match Frame::new(cube, model.oversampling) {
        Ok(frame) => frame,
        Err(what) => return usage(what),
    };
    let vignetting = match (model.optics.cos4, model.optics.focal_length) {
        (true, Some(focal_length)) => match (film["width"].as_f64(), film["height"].as_f64()) {
            (Some(width), Some(height)) => {
                let half = 0.5 / f64::from(frame.oversampling);
                Some(Vignetting { centre: [half * width, half * height], per_pixel: model.pitch / focal_length })
            }
            _ => return usage("does not tell the size of its film, which optics.cos4 needs for the axis".into()),
        },
        _ => None,
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
    let missing: Vec<u32> = (0..cube.grid().count()).filter(|tile| samples[*tile as usize] == 0).collect();
    if missing.len() == samples.len() || (!missing.is_empty() && !settings.partial) {
        return usage(format!(
            "{} of {} tiles are not rendered; go on with the render, or give --partial for a picture with holes",
            missing.len(),
            samples.len()
        ));
    }
    let electronics = Electronics { model, seed: settings.seed, noise: settings.noise };
    let exposure = Exposure { frame, bands: &bands, electronics: &electronics, vignetting };
    let mut store = Store::create(path, cube, frame, model, &bands, settings)?;
    let tiles = frame.grid.count();
    let mut rows = vec![Row::default(); bands.len()];
    let mut values = Values::new(bands.len() * frame.grid.tile_pixels(), model, settings.electrons);
    let wrong = |[x, y]: [u32; 2], band: usize| {
        usage(format!(
            "the radiance of pixel {x} {y} is not finite in a channel of the band {}; render it again",
            bands[band].name
        ))
    };
    let mut at_nyquist = 0.0;
    if model.optics.blur == Blur::None && frame.oversampling == 1 {
        for tile in 0..tiles {
            if let (Some(chunk), 1..) = (cube.chunk(tile)?, samples[tile as usize]) {
                let light = |band: usize, x: u32, y: u32| Some(of_pixel(&chunk, &bands[band], x, y));
                if let Err((pixel, band)) = exposure.tile(tile, &light, &mut values, &mut rows) {
                    return wrong(pixel, band);
                }
                store.put(tile, &values)?;
            }
            progress(u64::from(tile) + 1, tiles.into())?;
        }
    } else {
        let mut planes = Planes::new(store.aside(), path, cube, model, &bands)?;
        at_nyquist = planes.at_nyquist();
        let (taken, blurred) = (u64::from(cube.grid().count()), planes.steps());
        let all = taken + blurred + u64::from(tiles);
        for tile in 0..cube.grid().count() {
            if let (Some(chunk), 1..) = (cube.chunk(tile)?, samples[tile as usize])
                && let Some((pixel, band)) = planes.put(&chunk)?
            {
                return wrong(pixel, band);
            }
            progress(u64::from(tile) + 1, all)?;
        }
        planes.blur(&mut |done| progress(taken + done, all))?;
        let holes: Vec<Rect> = missing.iter().map(|&tile| cube.grid().rect(tile)).collect();
        let reach: Vec<f64> =
            (0..bands.len()).map(|band| if holes.is_empty() { 0.0 } else { planes.reach(band) }).collect();
        let mut signals = vec![Vec::new(); bands.len()];
        for tile in 0..tiles {
            let part = frame.of_cube(frame.grid.rect(tile));
            for (band, signals) in signals.iter_mut().enumerate() {
                planes.signals(band, part, signals)?;
            }
            let holes = Holes { near: &holes, reach: &reach };
            let light = |band: usize, x: u32, y: u32| {
                let pixel = frame.of_cube(Rect { x0: x, y0: y, x1: x + 1, y1: y + 1 });
                (!holes.touch(band, pixel)).then(|| mean(&signals[band], part, pixel))
            };
            if let Err((pixel, band)) = exposure.tile(tile, &light, &mut values, &mut rows) {
                return wrong(pixel, band);
            }
            store.put(tile, &values)?;
            progress(taken + blurred + u64::from(tile) + 1, all)?;
        }
        planes.finish()?;
    }
    let pixels = rows.iter().map(|row| row.count).max().unwrap_or(0);
    let estimate = cube.error_estimate()?;
    let mut noisy = Vec::new();
    let mut reports = Vec::new();
    for (band, row) in bands.iter().zip(&rows) {
        let mean = if row.count > 0 { row.sum / row.count as f64 } else { 0.0 };
        let figures = Figures::new(&electronics, band, mean);
        // Channels of a pixel come from the same paths, so that their errors add up.
        let error = band.weights.iter().map(|&(k, weight)| weight * estimate[k]).sum::<f64>() / band.sensitivity();
        let share = error * figures.snr;
        if share > MOST_NOISE {
            noisy.push((band.name.clone(), share));
        }
        let mean_signal = mean + band.background;
        let (name, background) = (band.name.clone(), band.background);
        reports.push(BandReport { name, figures, mean_signal, background, clipped: row.clipped });
    }
    let negative = rows.iter().map(|row| row.negative).sum();
    let applied = Applied { bands: reports, left_out, negative, pixels, at_nyquist, noisy };
    store.finish(&applied)?;
    Ok(applied)
}

/// The noise of a cube is told from this share of the sensor's own on.
const MOST_NOISE: f64 = 0.1;

/// Signal of a pixel of a cube.
fn of_pixel(chunk: &Chunk, band: &Optical, x: u32, y: u32) -> f64 {
    let spectrum = chunk.spectrum(x, y);
    band.weights.iter().map(|&(k, weight)| weight * f64::from(spectrum[k])).sum()
}

/// The mean over the pixels `of` among those of `part`, row by row.
fn mean(signals: &[f64], part: Rect, of: Rect) -> f64 {
    let at = |x: u32, y: u32| (y - part.y0) as usize * part.width() as usize + (x - part.x0) as usize;
    let rows = (of.y0..of.y1).map(|y| (of.x0..of.x1).map(|x| signals[at(x, y)]).sum::<f64>());
    rows.sum::<f64>() / of.pixels() as f64
}

/// Tiles that are missing.
struct Holes<'a> {
    near: &'a [Rect],
    /// By band, in pixels of the cube.
    reach: &'a [f64],
}

impl Holes<'_> {
    /// Whether a pixel lies in one, or so near that it lacks light from there.
    fn touch(&self, band: usize, pixel: Rect) -> bool {
        let gap = |[a0, a1]: [u32; 2], [b0, b1]: [u32; 2]| f64::from(a0.saturating_sub(b1).max(b0.saturating_sub(a1)));
        self.near.iter().any(|hole| {
            let (x, y) = (gap([hole.x0, hole.x1], [pixel.x0, pixel.x1]), gap([hole.y0, hole.y1], [pixel.y0, pixel.y1]));
            hole.intersection(&pixel).is_some() || x.hypot(y) < self.reach[band]
        })
    }
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

/// What makes counts of light, tile by tile.
struct Exposure<'a> {
    frame: Frame,
    bands: &'a [Optical],
    electronics: &'a Electronics<'a>,
    vignetting: Option<Vignetting>,
}

/// Signal of light in a band, column and row; `None` where the pixel is missing.
type Light<'a> = dyn Fn(usize, u32, u32) -> Option<f64> + Sync + 'a;

impl Exposure<'_> {
    /// Fills `values` and adds to `rows`, one a band. Errors: pixel and band of a signal that is not finite.
    fn tile(&self, tile: u32, light: &Light, values: &mut Values, rows: &mut [Row]) -> std::result::Result<(), Wrong> {
        let (rect, [width, height]) = (self.frame.grid.rect(tile), self.frame.grid.tile.map(|side| side as usize));
        values.clear();
        let tasks: Vec<_> = values.rows(width).enumerate().collect();
        let done: Vec<Row> = tasks
            .into_par_iter()
            .map(|(i, (counts, signal))| {
                let (band, y) = (i / height, rect.y0 + (i % height) as u32);
                self.row(rect, y, band, light, counts, signal)
            })
            .collect();
        // In one order whatever the threads did.
        for (i, row) in done.into_iter().enumerate() {
            if let Some(pixel) = row.wrong {
                return Err((pixel, i / height));
            }
            let of_band = &mut rows[i / height];
            of_band.count += row.count;
            of_band.sum += row.sum;
            of_band.negative += row.negative;
            of_band.clipped += row.clipped;
        }
        Ok(())
    }

    /// One row of a tile in one band; rows below the picture stay empty.
    fn row(
        &self,
        rect: Rect,
        y: u32,
        band: usize,
        light: &Light,
        counts: &mut [u32],
        mut signal: Option<&mut [f32]>,
    ) -> Row {
        let (mut row, background, [left, top]) = (Row::default(), self.bands[band].background, self.frame.origin);
        if y >= rect.y1 {
            return row;
        }
        for x in rect.x0..rect.x1 {
            let Some(light) = light(band, x, y) else { continue };
            if !light.is_finite() {
                row.wrong.get_or_insert([x, y]);
                continue;
            }
            row.count += 1;
            row.negative += u64::from(light < 0.0);
            let pixel = [left + x, top + y];
            let light = light.max(0.0) * self.vignetting.map_or(1.0, |vignetting| vignetting.at(pixel));
            row.sum += light;
            let at = (x - rect.x0) as usize;
            counts[at] = self.electronics.count(light + background, pixel, band, &mut row.clipped);
            if let Some(signal) = &mut signal {
                signal[at] = (light + background) as f32;
            }
        }
        row
    }
}
