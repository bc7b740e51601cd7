//! Colours of light, a picture at a time: what [`upsample::emission`] does for one.

use super::upsample::{self, Smooth};

/// A texel's radiance over D65 ([`upsample::daylight`]): `scale` times a smooth spectrum that is ½ at most where the colour
/// has its largest component, the smoothest there is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tint {
    pub smooth: Smooth,
    pub scale: f64,
}

impl Tint {
    /// The value at `nm`; beyond 360-830 nm the end values hold.
    pub fn eval(&self, nm: f64) -> f64 {
        self.scale * self.smooth.eval(nm)
    }
}

/// The tints of colours in linear sRGB, \[texel\]\[3\], finite and of at least 0. Greys are exact, black is 0.
pub fn tints(rgb: &[f32]) -> Vec<Tint> {
    let peak = |c: &[f32]| c[0].max(c[1]).max(c[2]);
    // The least f32 has no half: what is that dark is taken as grey.
    let normal = |c: &[f32]| match peak(c) {
        peak if peak < f32::MIN_POSITIVE => [0.5; 3],
        peak => [c[0], c[1], c[2]].map(|v| 0.5 * (v / peak)),
    };
    let colours: Vec<[f32; 3]> = rgb.chunks_exact(3).map(normal).collect();
    let smooth = upsample::smooth_of(&colours);
    let scales = rgb.chunks_exact(3).map(|c| 2.0 * f64::from(peak(c)));
    smooth.into_iter().zip(scales).map(|(smooth, scale)| Tint { smooth, scale }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As [`upsample::emission`] has them, but for its grid of 1 nm, between whose nodes a spectrum of curvature c is off
    /// by c/8 nm² : measured for the purest of these, 4e-6 of the peak.
    #[test]
    fn tints_are_emissions() {
        let colours = [[3.0, 3.0, 3.0], [0.0; 3], [5.0, 0.5, 2.0], [0.0, 1e-3, 2e-3], [2e4, 0.0, 100.0], [1e-40; 3]];
        let all = tints(&colours.concat());
        let white = upsample::daylight();
        for (rgb, tint) in colours.iter().zip(&all) {
            let curve = upsample::emission(rgb.map(f64::from));
            for nm in [300.0, 360.0, 450.0, 551.0, 702.5, 830.0, 2000.0] {
                let (one, many) = (curve.eval(nm), tint.eval(nm) * white.eval(nm));
                let bound = if rgb[0] == rgb[1] { 1e-12 * one } else { 1e-5 * curve.max(360.0, 830.0) };
                assert!((one - many).abs() <= bound, "{rgb:?} at {nm} nm: {one} {many}");
            }
        }
    }
}
