//! Textures out of textures: products, mixtures and fields of them as one picture.

use std::rc::Rc;

use glam::DVec2;

use super::picture::{Colour, Picture, Texels, Texture};
use super::report::Deviation;
use super::text;
use crate::spectral::Curve;
use crate::spectral::colour::{Observer, xyz_to_linear_srgb};
use crate::spectral::upsample;

/// Linear sRGB of a reflectance in daylight, D65.
pub fn rgb_of(curve: &Curve) -> [f64; 3] {
    if let Curve::Constant(value) = curve {
        return [*value; 3];
    }
    let light = upsample::emission([1.0; 3]);
    let observer = Observer::Cie1931.curves();
    let nm = || (0..=94).map(|i| 360.0 + 5.0 * f64::from(i));
    let seen =
        |i: usize, of: &dyn Fn(f64) -> f64| nm().map(|nm| observer[i].eval(nm) * light.eval(nm) * of(nm)).sum::<f64>();
    let all = seen(1, &|_| 1.0);
    // Grey stays grey: what daylight itself is, by the same sum, is [1, 1, 1].
    let white = xyz_to_linear_srgb([0, 1, 2].map(|i| seen(i, &|_| 1.0) / all));
    let rgb = xyz_to_linear_srgb([0, 1, 2].map(|i| seen(i, &|nm| curve.eval(nm)) / all));
    [0, 1, 2].map(|i| rgb[i] / white[i])
}

/// A texture that can be asked what it is at a place.
struct Sampled<'t> {
    texture: &'t Texture,
    texels: Vec<[f64; 3]>,
}

impl<'t> Sampled<'t> {
    fn new(texture: &'t Texture) -> Self {
        let texels = match &texture.endmembers {
            None => texture.picture.linear(),
            // Shares are as they are written.
            Some(_) => texture.picture.clone().raw().linear(),
        };
        let ends = texture.endmembers.as_ref().map(|two| two.each_ref().map(|colour| rgb_of(&colour.mean())));
        let colour = |texel: [f32; 3]| {
            let texel = texel.map(f64::from);
            match ends {
                None => texel,
                Some([a, b]) => [0, 1, 2].map(|c| texel[0] * a[c] + texel[1] * b[c]),
            }
        };
        Sampled { texture, texels: texels.into_iter().map(colour).collect() }
    }

    /// At coordinates of the surface, as Spectile has it (docs/scene.md, Textures).
    fn at(&self, uv: DVec2) -> [f64; 3] {
        let size = self.texture.picture.size.map(f64::from);
        let place = |i: usize| (uv[i] * self.texture.scale[i] + self.texture.offset[i]) * size[i];
        let texel = |x: f64, y: f64| {
            let (x, y) = (x.rem_euclid(size[0]) as usize, y.rem_euclid(size[1]) as usize);
            let [width, height] = self.texture.picture.size.map(|side| side as usize);
            self.texels[(height - 1 - y.min(height - 1)) * width + x.min(width - 1)]
        };
        let (x, y) = (place(0), place(1));
        if self.texture.nearest {
            return texel(x.floor(), y.floor());
        }
        let (x, y) = (x - 0.5, y - 0.5);
        let (left, low) = (x.floor(), y.floor());
        let (fx, fy) = (x - left, y - low);
        let mix = |a: [f64; 3], b: [f64; 3], f: f64| [0, 1, 2].map(|c| a[c] + f * (b[c] - a[c]));
        let row = |y: f64| mix(texel(left, y), texel(left + 1.0, y), fx);
        mix(row(low), row(low + 1.0), fy)
    }
}

/// Texels along a side of a picture that is made; periods of one texture in that of all.
const MOST_SIDE: u64 = 2048;
const MOST_PERIODS: u32 = 16;

/// How many texels, and what period in coordinates of the surface, a picture needs along an axis for all of these; `None` where the
/// periods have nothing in common.
fn common(textures: &[&Texture], axis: usize) -> Option<(u32, f64)> {
    let first = textures[0].scale[axis].abs();
    if textures.iter().any(|texture| texture.scale[axis] == 0.0) {
        return None;
    }
    // So many periods of the first are whole ones of all.
    let whole = |x: f64| (x - x.round()).abs() < 1e-6 * x.max(1.0) && x > 0.5;
    let periods = (1..=MOST_PERIODS).map(f64::from);
    let mut periods = periods.filter(|n| textures.iter().all(|texture| whole(n * texture.scale[axis].abs() / first)));
    let period = periods.next()? / first;
    let counts =
        textures.iter().map(|t| u64::from(t.picture.size[axis]) * (period * t.scale[axis].abs()).round() as u64);
    let counts: Vec<u64> = counts.collect();
    let gcd = |mut a: u64, mut b: u64| {
        while b != 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let multiple = counts.iter().fold(1, |a, b| (a / gcd(a, *b)).saturating_mul(*b));
    let most = *counts.iter().max()?;
    let count = if multiple <= MOST_SIDE { multiple } else { most.min(MOST_SIDE) };
    Some((count as u32, period))
}

/// One texture of `f` of what `colours` are at each place, named `name`, and how far off it is between the centres of its texels, if it is; `None`
/// where their periods have nothing in common. One of them at least is a texture.
pub fn combined(
    colours: &[&Colour],
    name: &str,
    f: &dyn Fn(&[[f64; 3]]) -> [f64; 3],
) -> Option<(Colour, Option<Deviation>)> {
    let textures: Vec<&Texture> = colours
        .iter()
        .filter_map(|colour| if let Colour::Texture(texture) = colour { Some(&**texture) } else { None })
        .collect();
    let (width, across) = common(&textures, 0)?;
    let (height, up) = common(&textures, 1)?;
    enum Part<'t> {
        Texture(Sampled<'t>),
        Same([f64; 3]),
    }
    let parts: Vec<Part> = colours
        .iter()
        .map(|colour| match colour {
            Colour::Texture(texture) => Part::Texture(Sampled::new(texture)),
            Colour::Spectrum(curve, _) => Part::Same(rgb_of(curve)),
        })
        .collect();
    let right = |uv: DVec2| {
        let values: Vec<[f64; 3]> = parts
            .iter()
            .map(|part| match part {
                Part::Texture(sampled) => sampled.at(uv),
                Part::Same(rgb) => *rgb,
            })
            .collect();
        f(&values)
    };
    let place = |x: f64, y: f64| DVec2::new(x / f64::from(width) * across, y / f64::from(height) * up);
    // Rows from the top.
    let centres = (0..height).rev().flat_map(|y| (0..width).map(move |x| (f64::from(x) + 0.5, f64::from(y) + 0.5)));
    let texels = centres.map(|(x, y)| right(place(x, y)).map(|v| v as f32)).collect();
    let made = Texture {
        picture: Picture { size: [width, height], texels: Texels::Floats(texels) },
        name: name.to_owned(),
        endmembers: None,
        nearest: textures.iter().all(|texture| texture.nearest),
        scale: [1.0 / across, 1.0 / up],
        offset: [0.0; 2],
        file: None,
    };
    // At places spread evenly (R2, Roberts 2018).
    const PLACES: u32 = 20_000;
    let written = Sampled::new(&made);
    let (mut most, mut sum) = (0.0f64, 0.0);
    for i in 0..PLACES {
        let part = |ratio: f64| (0.5 + ratio * f64::from(i)).fract();
        let uv = DVec2::new(part(0.754_877_666_246_693) * across, part(0.569_840_290_998_053) * up);
        let (a, b) = (right(uv), written.at(uv));
        let off = (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f64::max);
        (most, sum) = (most.max(off), sum + off);
    }
    let mean = sum / f64::from(PLACES);
    let off = (most > 1e-6).then(|| {
        let what = format!("{} at most and {} on the mean at {PLACES} places", text::up(most), text::up(mean));
        Deviation::measured(what)
    });
    Some((Colour::Texture(Rc::new(made)), off))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texture(size: [u32; 2], greys: &[f32], nearest: bool, scale: [f64; 2]) -> Colour {
        let texels = Texels::Floats(greys.iter().map(|grey| [*grey; 3]).collect());
        let (picture, name) = (Picture { size, texels }, "a".to_owned());
        Colour::Texture(Rc::new(Texture {
            picture,
            name,
            endmembers: None,
            nearest,
            scale,
            offset: [0.0; 2],
            file: None,
        }))
    }

    #[test]
    fn colours_of_spectra_come_back() {
        for rgb in [[0.5; 3], [0.8, 0.2, 0.1], [0.1, 0.4, 0.7]] {
            let found = rgb_of(&upsample::reflectance(rgb));
            assert!((0..3).all(|c| (found[c] - rgb[c]).abs() < 5e-3), "{rgb:?} came back as {found:?}");
        }
    }

    #[test]
    fn products_are_products() {
        // Fields by fields of half their size: exact.
        let (a, b) = (texture([2, 1], &[0.2, 0.8], true, [1.0; 2]), texture([2, 1], &[0.5, 1.0], true, [2.0, 1.0]));
        let (made, off) = combined(&[&a, &b], "ab", &|v| [0, 1, 2].map(|c| v[0][c] * v[1][c])).unwrap();
        let Colour::Texture(made) = made else { panic!("{made:?}") };
        let values: Vec<f32> = made.picture.linear().iter().map(|rgb| rgb[0]).collect();
        assert!(off.is_none() && made.nearest && made.scale == [1.0; 2], "{off:?}");
        assert_eq!(values, [0.1, 0.2, 0.4, 0.8]);
        // A half of a picture is a half of it; a number that is no texture is the same all over.
        let (made, off) =
            combined(&[&a, &Colour::grey(0.5)], "half", &|v| [0, 1, 2].map(|c| v[0][c] * v[1][c])).unwrap();
        assert!(off.is_none(), "{off:?}");
        assert!(matches!(made, Colour::Texture(of) if of.picture.linear()[0][0] == 0.1));
        // Smooth ones are off between their texels, which is told: 4 x (1 - x) is 1 in the middle of 0.75 and 0.75.
        let ramp = texture([4, 1], &[0.125, 0.375, 0.625, 0.875], false, [1.0; 2]);
        let (_, off) =
            combined(&[&ramp, &ramp], "bow", &|v| [0, 1, 2].map(|c| 4.0 * v[0][c] * (1.0 - v[1][c]))).unwrap();
        assert!(off.is_some_and(|off| off.to_string().starts_with("measured off by 0.")));
        // 1 and π have no period.
        let other = texture([2, 1], &[0.5, 1.0], true, [std::f64::consts::PI, 1.0]);
        assert!(combined(&[&a, &other], "none", &|v| v[0]).is_none());
    }
}
