//! Pictures of a cube other than its preview.

use crate::Result;
use crate::cube::{Rect, View};
use crate::spectral::colour::{Picture, Projection};
use crate::spectral::temperature::BandTemperature;

/// The pixels of `view` in the linear colours of a projection, whatever its bands; NaN where nothing is rendered yet.
pub fn colours(view: &View, projection: &Projection) -> Result<Picture> {
    let mut rgb = vec![f32::NAN; view.rect().pixels() as usize * 3];
    each_pixel(view, |pixel, spectrum| rgb[3 * pixel..3 * pixel + 3].copy_from_slice(&projection.rgb(spectrum)))?;
    Ok(Picture { size: view.size(), rgb })
}

/// What a map shows of the bands of a view together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Map {
    /// Their mean radiance, weighted by their widths, W m⁻² sr⁻¹ nm⁻¹.
    Radiance,
    /// The brightness temperature of that, K.
    Temperature,
}

/// One number a pixel; NaN where nothing is rendered yet.
pub fn map(view: &View, map: Map) -> Result<Vec<f32>> {
    let channels = view.cube().channels();
    let total: f64 = view.bands().iter().map(|&k| channels.integral(k)).sum();
    let weights: Vec<(usize, f64)> = view.bands().iter().map(|&k| (k, channels.integral(k) / total)).collect();
    let temperature = (map == Map::Temperature).then(|| BandTemperature::of_all(channels, view.bands()));
    let mut values = vec![f32::NAN; view.rect().pixels() as usize];
    each_pixel(view, |pixel, spectrum| {
        // One band is itself, to the last bit.
        let mean = weights.iter().map(|&(k, weight)| weight * f64::from(spectrum[k])).sum::<f64>();
        values[pixel] = temperature.as_ref().map_or(mean, |temperature| temperature.kelvin(mean)) as f32;
    })?;
    Ok(values)
}

/// Calls `each` with the number of every pixel, row by row, and all channels of the cube there.
fn each_pixel(view: &View, mut each: impl FnMut(usize, &[f32])) -> Result<()> {
    let (rect, mut reader) = (view.rect(), view.reader());
    let tile = view.cube().grid().tile[1];
    let mut y0 = rect.y0;
    while y0 < rect.y1 {
        // A row of tiles at a time, so that no more of them are mapped.
        let y1 = ((y0 / tile + 1) * tile).min(rect.y1);
        reader.spectra(Rect { y0, y1, ..rect }, |x, y, spectrum| {
            each((y - rect.y0) as usize * rect.width() as usize + (x - rect.x0) as usize, spectrum);
        })?;
        y0 = y1;
    }
    Ok(())
}
