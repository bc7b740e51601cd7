//! Looking up textures.

use std::collections::HashMap;

use glam::DVec2;

use crate::scene::{Texture, TextureFilter, TextureKind};
use crate::spectral::skylight::{self, Tint};
use crate::spectral::{Curve, upsample};

/// The texels around a point with their weights, which sum to 1, as positions in [`Texture::texels`] divided by the number
/// of channels.
pub fn around(texture: &Texture, uv: DVec2) -> [(usize, f64); 4] {
    let [width, height] = texture.size.map(|size| size as usize);
    let uv = uv * texture.placement.scale + texture.placement.offset;
    if texture.placement.filter == TextureFilter::Nearest {
        let inside = |share: f64, size: usize| ((share.rem_euclid(1.0) * size as f64) as usize).min(size - 1);
        return [(inside(1.0 - uv.y, height) * width + inside(uv.x, width), 1.0), (0, 0.0), (0, 0.0), (0, 0.0)];
    }
    // In texels from the top left, 0 at the centre of the first.
    let place = |share: f64, size: usize| {
        let x = share.rem_euclid(1.0) * size as f64 - 0.5;
        let before = x.floor();
        let wrap = |i: f64| i.rem_euclid(size as f64) as usize % size;
        ([wrap(before), wrap(before + 1.0)], x - before)
    };
    let (columns, x) = place(uv.x, width);
    let (rows, y) = place(1.0 - uv.y, height);
    let texel = |column: usize, row: usize| rows[row] * width + columns[column];
    [
        (texel(0, 0), (1.0 - x) * (1.0 - y)),
        (texel(1, 0), x * (1.0 - y)),
        (texel(0, 1), (1.0 - x) * y),
        (texel(1, 1), x * y),
    ]
}

/// Channel `channel` at a point.
pub fn channel(texture: &Texture, uv: DVec2, channel: usize) -> f64 {
    let channels = texture.channels();
    around(texture, uv).iter().map(|(i, w)| w * f64::from(texture.texels[i * channels + channel])).sum()
}

/// Spectra of the colours met so far, of surfaces and of lamps.
#[derive(Default)]
pub struct Colours(HashMap<[u32; 3], Curve>, HashMap<[u32; 3], Tint>);

impl Colours {
    /// Calls `add(spectrum, weight)` for what makes up a texture of colours at a point.
    pub fn at(&mut self, texture: &Texture, uv: DVec2, mut add: impl FnMut(&Curve, f64)) {
        assert_eq!(texture.kind, TextureKind::Colour);
        for (i, weight) in around(texture, uv) {
            let rgb = std::array::from_fn(|c| texture.texels[3 * i + c]);
            let spectrum = self.0.entry(rgb.map(f32::to_bits));
            add(spectrum.or_insert_with(|| upsample::reflectance(rgb.map(f64::from))), weight);
        }
    }

    /// Calls `add(tint, weight)` for what makes up a texture of light at a point; daylight multiplies all of it.
    pub fn of_light(&mut self, texture: &Texture, uv: DVec2, mut add: impl FnMut(&Tint, f64)) {
        for (i, weight) in around(texture, uv) {
            let rgb: [f32; 3] = std::array::from_fn(|c| texture.texels[3 * i + c]);
            let tint = self.1.entry(rgb.map(f32::to_bits));
            add(tint.or_insert_with(|| skylight::tints(&rgb)[0]), weight);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Placement;

    /// 3 x 2 texels, 1 2 4 over 8 16 32: centres, corners, halfway, beyond the edges.
    #[test]
    fn bilinear_repeated_and_v_up() {
        let texels = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0];
        let (size, kind) = ([3, 2], TextureKind::Number);
        let texture = Texture { name: "t".into(), size, kind, texels: texels.into(), placement: Placement::default() };
        for (u, v, expected) in [
            (0.5 / 3.0, 0.75, 1.0),
            (1.5 / 3.0, 0.75, 2.0),
            (2.5 / 3.0, 0.25, 32.0),
            (1.0 / 3.0, 0.75, 1.5),
            (1.0 / 3.0, 0.25, 12.0),
            (0.5 / 3.0, 0.5, 4.5),
            (1.25 / 3.0, 0.625, 0.75 * (0.25 + 1.5) + 0.25 * (2.0 + 12.0)),
            // The left edge is between the last and the first column, top and bottom likewise.
            (0.0, 0.75, 2.5),
            (0.5 / 3.0, 0.0, 4.5),
            (0.0, 0.0, 0.25 * (1.0 + 4.0 + 8.0 + 32.0)),
            (1.0, 1.0, 0.25 * (1.0 + 4.0 + 8.0 + 32.0)),
        ] {
            for (du, dv) in [(0.0, 0.0), (1.0, -1.0), (-3.0, 7.0)] {
                let found = channel(&texture, DVec2::new(u + du, v + dv), 0);
                assert!((found - expected).abs() < 1e-12, "{u} {v}: {found}, expected {expected}");
            }
        }
        let mut moved = texture.clone();
        moved.placement =
            Placement { scale: DVec2::new(2.0, -0.5), offset: DVec2::new(-0.25, 3.0), ..Placement::default() };
        for uv in [DVec2::new(0.1, 0.2), DVec2::new(-3.3, 7.9)] {
            let direct = channel(&texture, DVec2::new(2.0 * uv.x - 0.25, 3.0 - 0.5 * uv.y), 0);
            assert!((channel(&moved, uv, 0) - direct).abs() < 1e-12, "{uv}");
        }
        let mut steps = texture.clone();
        steps.placement.filter = TextureFilter::Nearest;
        for (u, v, expected) in
            [(0.0, 0.99, 1.0), (0.33, 0.51, 1.0), (0.34, 0.51, 2.0), (0.99, 0.49, 32.0), (1.01, -0.6, 8.0)]
        {
            assert_eq!(channel(&steps, DVec2::new(u, v), 0), expected, "{u} {v}");
        }
        let one = Texture { size: [1, 1], texels: [5.0].into(), ..texture };
        assert_eq!(channel(&one, DVec2::new(-0.3, 12.9), 0), 5.0);
    }
}
