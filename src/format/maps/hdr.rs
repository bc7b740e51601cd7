//! Radiance RGBE pictures (`.hdr`, `.pic`).

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use image::ImageDecoder;
use image::codecs::hdr::HdrDecoder;

use super::{Content, Map, checked_size, to_srgb, whole, with_help};
use crate::error::Problem;
use crate::format::primaries::Primaries;
use crate::format::table::shown;

/// The picture at `path`, with the exposure and colour correction of its header undone.
pub fn read(path: &Path) -> Result<Map, Box<Problem>> {
    let broken = |e: &dyn std::fmt::Display| whole(path, format!("is no Radiance picture that can be read: {e}"));
    let file = File::open(path).map_err(|e| whole(path, format!("cannot be read: {e}")))?;
    // Writers differ in the first line only: #?RADIANCE, #?RGBE.
    let decoder = HdrDecoder::new_nonstrict(BufReader::new(file)).map_err(|e| broken(&e))?;
    let meta = decoder.metadata();
    let mut primaries = None;
    let mut warnings = Vec::new();
    for (key, value) in &meta.custom_attributes {
        let numbers: Option<Vec<f64>> = value.split_whitespace().map(|word| word.parse().ok()).collect();
        match (key.trim(), numbers.as_deref()) {
            ("EXPOSURE", Some([_])) | ("COLORCORR", Some([_, _, _])) => {}
            ("PRIMARIES", Some(&[rx, ry, gx, gy, bx, by, wx, wy])) => {
                primaries = Some(Primaries([[rx, ry], [gx, gy], [bx, by], [wx, wy]]));
            }
            ("GAMMA" | "PIXASPECT", Some([value])) if *value == 1.0 => {}
            ("GAMMA", _) => {
                let message = format!("says GAMMA={}, so its numbers are not linear", shown(value));
                return Err(with_help(path, message, "save it with linear values, without that line"));
            }
            (key @ ("VIEW" | "PIXASPECT"), _) => {
                let value = shown(value.trim());
                warnings
                    .push(format!("says {key}={value}, which is not applied: it is taken as a map of all directions"));
            }
            // The decoder passes over what it cannot parse.
            (key @ ("EXPOSURE" | "COLORCORR" | "PRIMARIES"), _) => {
                return Err(whole(path, format!("has a header line {key}={value} that holds other than its numbers")));
            }
            _ => {}
        }
    }
    let size = checked_size(path, meta.width.into(), meta.height.into())?;
    let mut rgb = vec![0f32; 3 * meta.width as usize * meta.height as usize];
    decoder.read_image(bytemuck::cast_slice_mut(&mut rgb)).map_err(|e| broken(&e))?;

    let (r, g, b) = meta.color_correction.unwrap_or((1.0, 1.0, 1.0));
    let exposure = meta.exposure.unwrap_or(1.0);
    let factors = [r, g, b].map(|c| c * exposure);
    if factors != [1.0; 3] {
        if !factors.iter().all(|f| f.is_finite() && *f > 0.0) {
            return Err(whole(path, format!("has an exposure or colour correction of {factors:?}, not above 0")));
        }
        rgb.chunks_exact_mut(3).for_each(|texel| texel.iter_mut().zip(factors).for_each(|(v, f)| *v /= f));
        warnings.push(format!("has an exposure and colour correction of {factors:?}, which are undone"));
    }
    if let Some(primaries) = primaries.filter(|primaries| !primaries.are_srgb()) {
        to_srgb(path, &mut rgb, size[0], primaries, &mut warnings)?;
    }
    Ok(Map { size, content: Content::Rgb(rgb), warnings })
}
