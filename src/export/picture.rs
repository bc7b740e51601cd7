//! Pictures of a cube: PNG, row by row.

use std::path::Path;

use super::{PIECE_BYTES, Progress};
use crate::Result;
use crate::cube::{Reader, Rect, View};
use crate::format::png;
use crate::spectral::colour::Projection;
use crate::spectral::temperature::{BandTemperature, shown_range};
use crate::spectral::tone::{Tone, exposure_of, largest, percentiles_of};

/// What a picture shows of the pixels of a view.
#[derive(Debug, Clone, PartialEq)]
pub enum Shown {
    /// The colours of the cube's preview.
    Preview,
    /// Those of a projection, whatever the bands of the view.
    Colours(Projection),
    /// The bands of the view together, in a colour map.
    Map(Map),
}

/// What a map shows of the bands of a view together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Map {
    /// Their mean radiance, weighted by their widths, W m⁻² sr⁻¹ nm⁻¹.
    Radiance,
    /// Their radiance, W m⁻² sr⁻¹.
    Integrated,
    /// The brightness temperature of the mean, K.
    Temperature,
}

/// Writes a picture as PNG, and returns how its values became brightness: as asked, else so that the 99th percentile is white,
/// or the 1st and the 99th are the ends of the colour map. For that the cube is read three times rather than held.
pub fn write_png(
    view: &View,
    path: &Path,
    shown: &Shown,
    asked: Option<Tone>,
    progress: &mut Progress,
) -> Result<Tone> {
    let mut rows = Rows::new(view, shown, if asked.is_some() { 1 } else { 3 });
    let tone = match asked {
        Some(tone) => tone,
        None => rows.tone(progress)?,
    };
    png::stream(path, view.size(), |put| rows.each(progress, |values| put(&tone.srgb8(values))))?;
    Ok(tone)
}

impl Shown {
    /// Values of a pixel.
    fn planes(&self) -> usize {
        if let Shown::Map(_) = self { 1 } else { 3 }
    }
}

/// The rows of a picture, a piece at a time.
struct Rows<'a> {
    view: &'a View<'a>,
    shown: &'a Shown,
    reader: Reader<'a>,
    /// Of a map: bands and their weights, and the temperatures of what they add up to.
    weights: Vec<(usize, f64)>,
    temperature: Option<BandTemperature>,
    values: Vec<f32>,
    /// How often all rows are gone through, and how often they have been.
    passes: u64,
    passed: u64,
}

impl<'a> Rows<'a> {
    fn new(view: &'a View<'a>, shown: &'a Shown, passes: u64) -> Rows<'a> {
        let channels = view.cube().channels();
        // Counts of several bands are as they are, whatever their widths.
        let is_counts = view.cube().is_counts();
        let total: f64 = match shown {
            Shown::Map(Map::Integrated) => 1.0,
            _ => view.bands().iter().map(|&k| channels.integral(k)).sum(),
        };
        let count = view.bands().len() as f64;
        let share = |k: usize| if is_counts { 1.0 / count } else { channels.integral(k) / total };
        let weights = view.bands().iter().map(|&k| (k, share(k))).collect();
        let is_heat = *shown == Shown::Map(Map::Temperature);
        let temperature = is_heat.then(|| BandTemperature::of_all(channels, view.bands()));
        Rows { view, shown, reader: view.reader(), weights, temperature, values: Vec::new(), passes, passed: 0 }
    }

    /// The values of the pixels in `rect`, rows from the top; NaN where nothing is rendered yet.
    fn read(&mut self, rect: Rect) -> Result<()> {
        let Rows { view, shown, reader, weights, temperature, values, .. } = self;
        if **shown == Shown::Preview {
            *values = view.cube().state().colour(rect, 1)?.values;
            return Ok(());
        }
        let planes = shown.planes();
        values.clear();
        values.resize(rect.pixels() as usize * planes, f32::NAN);
        reader.spectra(rect, |x, y, spectrum| {
            let pixel = (y - rect.y0) as usize * rect.width() as usize + (x - rect.x0) as usize;
            let pixel = &mut values[pixel * planes..][..planes];
            if let Shown::Colours(projection) = shown {
                return pixel.copy_from_slice(&projection.rgb(spectrum));
            }
            // One band is itself, to the last bit.
            let sum = weights.iter().map(|&(k, weight)| weight * f64::from(spectrum[k])).sum::<f64>();
            pixel[0] = temperature.as_ref().map_or(sum, |temperature| temperature.kelvin(sum)) as f32;
        })
    }

    /// Calls `each` with all values, in pieces of whole rows.
    fn each(&mut self, progress: &mut Progress, mut each: impl FnMut(&[f32]) -> Result<()>) -> Result<()> {
        let (rect, tile) = (self.view.rect(), self.view.cube().grid().tile[1]);
        let most = (PIECE_BYTES / (rect.width() as usize * self.shown.planes() * 4)).max(1) as u32;
        let pixels = rect.pixels();
        let mut y0 = rect.y0;
        while y0 < rect.y1 {
            // Of a row of tiles at most, so that no more of them are mapped.
            let y1 = ((y0 / tile + 1) * tile).min(y0.saturating_add(most)).min(rect.y1);
            self.read(Rect { y0, y1, ..rect })?;
            each(&self.values)?;
            let done = u64::from(y1 - rect.y0) * u64::from(rect.width());
            progress(self.passed * pixels + done, self.passes * pixels)?;
            y0 = y1;
        }
        self.passed += 1;
        Ok(())
    }

    fn tone(&mut self, progress: &mut Progress) -> Result<Tone> {
        let planes = self.shown.planes();
        let found = percentiles_of([1, 99], |take| {
            self.each(progress, |values| {
                values.chunks_exact(planes).for_each(|pixel| take(largest(pixel)));
                Ok(())
            })
        })?;
        let range = found.map_or([0.0, 1.0], |found| found.map(f64::from));
        Ok(match self.shown {
            Shown::Map(Map::Temperature) => Tone::Range(shown_range(range)),
            Shown::Map(_) => Tone::Range(range),
            _ => Tone::Exposure(exposure_of(found.map(|[_, high]| high))),
        })
    }
}
