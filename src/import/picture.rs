//! Pictures of other people's formats, and the PNG or OpenEXR that a scene has in their place.

use std::path::{Path, PathBuf};
use std::rc::Rc;

use glam::{DMat2, DVec2};

use super::report::{Deviation, Place};
use super::scene::Scene;
use super::text;
use crate::error::Problem;
use crate::format::{image as planes, png};
use crate::spectral::Curve;
use crate::{Error, Result};

/// A picture in memory, rows from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    pub size: [u32; 2],
    pub texels: Texels,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Texels {
    /// 8-bit sRGB.
    Bytes(Vec<[u8; 3]>),
    /// Linear.
    Floats(Vec<[f32; 3]>),
}

/// sRGB to linear (IEC 61966-2-1).
pub fn to_linear(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

impl Picture {
    /// The picture in `path`: PNG, JPEG, BMP, TGA, Radiance, OpenEXR or PFM. Alpha is left out.
    ///
    /// # Errors
    /// One problem that names the file.
    pub fn read(path: &Path) -> std::result::Result<Picture, Box<Problem>> {
        let problem = |message: String| Box::new(Problem { file: path.to_owned(), message, ..Problem::default() });
        let bytes = std::fs::read(path).map_err(|e| problem(format!("cannot be read: {e}")))?;
        Picture::parse(&bytes).map_err(problem)
    }

    /// [`Self::read`] on the content of a file.
    ///
    /// # Errors
    /// A sentence.
    pub fn parse(bytes: &[u8]) -> std::result::Result<Picture, String> {
        let is_exr = bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]);
        match bytes {
            [b'P', b'F' | b'f', b'\n' | b'\r' | b' ', ..] => pfm(bytes),
            _ if is_exr => exr(bytes),
            _ => others(bytes),
        }
    }

    /// The alpha of a PNG, if it has some, as a number for each texel.
    pub fn alpha(bytes: &[u8]) -> Option<Vec<f32>> {
        let image = planes::parse(bytes).ok()?;
        image.planes.iter().find(|plane| image.is_alpha(plane)).map(|plane| plane.samples.clone())
    }

    /// Linear values of each texel.
    pub fn linear(&self) -> Vec<[f32; 3]> {
        match &self.texels {
            Texels::Floats(texels) => texels.clone(),
            Texels::Bytes(texels) => texels.iter().map(|rgb| rgb.map(|v| to_linear(f32::from(v) / 255.0))).collect(),
        }
    }

    /// As if its bytes were no sRGB but linear.
    pub fn raw(self) -> Picture {
        let texels = match self.texels {
            Texels::Bytes(texels) => texels.iter().map(|rgb| rgb.map(|v| f32::from(v) / 255.0)).collect(),
            Texels::Floats(texels) => texels,
        };
        Picture { texels: Texels::Floats(texels), ..self }
    }

    /// With a function of each linear number.
    pub fn map(&self, f: &dyn Fn(f64) -> f64) -> Picture {
        let texels = self.linear().iter().map(|rgb| rgb.map(|v| f(v.into()) as f32)).collect();
        Picture { size: self.size, texels: Texels::Floats(texels) }
    }

    /// How far numbers of texels are beyond 0 and 1, where some are.
    pub fn beyond_one(&self) -> Option<Deviation> {
        let beyond = |v: f32| f64::from((v - v.clamp(0.0, 1.0)).abs());
        let most = self.linear().into_iter().flatten().map(beyond).fold(0.0, f64::max);
        (most > 0.0).then(|| Deviation::at_most(text::up(most)))
    }

    pub fn mean(&self) -> [f64; 3] {
        let texels = self.linear();
        let sum = texels.iter().fold([0.0; 3], |sum, rgb| [0, 1, 2].map(|c| sum[c] + f64::from(rgb[c])));
        sum.map(|v| v / texels.len().max(1) as f64)
    }

    /// Turned upside down (`vertical`), or mirrored.
    pub fn flipped(&self, vertical: bool) -> Picture {
        let [width, height] = self.size.map(|side| side as usize);
        fn moved<T: Copy>(texels: &[T], [width, height]: [usize; 2], vertical: bool) -> Vec<T> {
            let from =
                |x: usize, y: usize| if vertical { (height - 1 - y) * width + x } else { y * width + width - 1 - x };
            (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| texels[from(x, y)]).collect()
        }
        let texels = match &self.texels {
            Texels::Bytes(texels) => Texels::Bytes(moved(texels, [width, height], vertical)),
            Texels::Floats(texels) => Texels::Floats(moved(texels, [width, height], vertical)),
        };
        Picture { size: self.size, texels }
    }

    /// With u for v and v for u, v up.
    fn transposed(&self) -> Picture {
        let [width, height] = self.size.map(|side| side as usize);
        fn moved<T: Copy>(texels: &[T], [width, height]: [usize; 2]) -> Vec<T> {
            let places = (0..width).flat_map(|y| (0..height).map(move |x| (height - 1 - x) * width + width - 1 - y));
            places.map(|at| texels[at]).collect()
        }
        let texels = match &self.texels {
            Texels::Bytes(texels) => Texels::Bytes(moved(texels, [width, height])),
            Texels::Floats(texels) => Texels::Floats(moved(texels, [width, height])),
        };
        Picture { size: [self.size[1], self.size[0]], texels }
    }

    /// A map of light as Mitsuba has it as one of even rows: there the first and the last row are the poles, and between texels
    /// hue and brightness are mixed apart. It is made `finer` along each side, so that what is smooth there stays so.
    pub fn between_poles(&self, finer: usize) -> Picture {
        let [width, height] = self.size.map(|side| side as usize);
        let brightness = |rgb: &[f32; 3]| rgb[0].max(rgb[1]).max(rgb[2]);
        let texels = self.linear();
        let hues: Vec<[f32; 3]> =
            texels.iter().map(|rgb| rgb.map(|v| v / brightness(rgb).max(f32::MIN_POSITIVE))).collect();
        let (rows, columns) = (finer * height, finer * width);
        // The four texels around a place, and their shares.
        let around = |x: usize, y: usize| {
            let v = (y as f64 + 0.5) / rows as f64 * (height - 1) as f64;
            let u = (x as f64 + 0.5) / finer as f64 - 0.5 + width as f64;
            let (left, top) = (u as usize, (v as usize).min(height.saturating_sub(2)));
            let (fx, fy) = ((u - left as f64) as f32, (v - top as f64) as f32);
            let index = |i: usize, j: usize| (top + j).min(height - 1) * width + (left + i) % width;
            [
                (index(0, 0), (1.0 - fx) * (1.0 - fy)),
                (index(1, 0), fx * (1.0 - fy)),
                (index(0, 1), (1.0 - fx) * fy),
                (index(1, 1), fx * fy),
            ]
        };
        let mut mixed = Vec::with_capacity(rows * columns);
        for y in 0..rows {
            for x in 0..columns {
                let (mut hue, mut bright) = ([0.0; 3], 0.0);
                for (i, share) in around(x, y) {
                    hue = [0, 1, 2].map(|c| hue[c] + share * hues[i][c]);
                    bright += share * brightness(&texels[i]);
                }
                mixed.push(hue.map(|v| v * bright));
            }
        }
        Picture { size: [columns as u32, rows as u32], texels: Texels::Floats(mixed) }
    }

    /// Puts it into the scene as PNG, or as OpenEXR where it has more than bytes; gives its path.
    pub fn write(&self, scene: &mut Scene, name: &str) -> Result<String> {
        let stem = Path::new(name).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        match &self.texels {
            Texels::Bytes(texels) => {
                let bytes = png::encode(self.size, texels.as_flattened());
                let bytes = bytes.map_err(|e| Error::Internal(format!("a PNG picture cannot be made: {e}")))?;
                scene.write("textures", &format!("{stem}.png"), &bytes)
            }
            Texels::Floats(texels) => {
                let path = scene.place("textures", &format!("{stem}.exr"))?;
                let target = scene.path_of(&path);
                let [width, height] = self.size.map(|side| side as usize);
                let at = |x: usize, y: usize| {
                    let [r, g, b] = texels[y * width + x];
                    (r, g, b)
                };
                exr::prelude::write_rgb_file(&target, width, height, at).map_err(|e| Error::storage(&target, e))?;
                Ok(path)
            }
        }
    }
}

fn exr(bytes: &[u8]) -> std::result::Result<Picture, String> {
    let image = planes::parse(bytes)?;
    let opaque: Vec<&planes::Plane> = image.planes.iter().filter(|plane| !image.is_alpha(plane)).collect();
    let rgb = planes::Rgb::of(&opaque)?.ok_or("has no channels R, G and B, and no grey")?;
    let [r, g, b] = rgb.planes();
    let texels = r.samples.iter().zip(&g.samples).zip(&b.samples).map(|((r, g), b)| [*r, *g, *b]).collect();
    Ok(Picture { size: image.size, texels: Texels::Floats(texels) })
}

fn others(bytes: &[u8]) -> std::result::Result<Picture, String> {
    let mut reader = image::ImageReader::new(std::io::Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|e| format!("cannot be read: {e}"))?;
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(1 << 32);
    reader.limits(limits);
    if reader.format() == Some(image::ImageFormat::Png) {
        return png_picture(bytes);
    }
    let decoded = reader.decode().map_err(|e| format!("is no picture that can be read: {e}").replace('\n', " "))?;
    let size = [decoded.width(), decoded.height()];
    Ok(match decoded.color() {
        image::ColorType::Rgb32F | image::ColorType::Rgba32F => {
            let texels = decoded.to_rgb32f().pixels().map(|p| p.0).collect();
            Picture { size, texels: Texels::Floats(texels) }
        }
        _ => Picture { size, texels: Texels::Bytes(decoded.to_rgb8().pixels().map(|p| p.0).collect()) },
    })
}

fn png_picture(bytes: &[u8]) -> std::result::Result<Picture, String> {
    let image = planes::parse(bytes)?;
    let opaque: Vec<&planes::Plane> = image.planes.iter().filter(|plane| !image.is_alpha(plane)).collect();
    let rgb = planes::Rgb::of(&opaque)?.ok_or("has no channels R, G and B, and no grey")?;
    let [r, g, b] = rgb.planes();
    let all = r.samples.iter().zip(&g.samples).zip(&b.samples).map(|((r, g), b)| [*r, *g, *b]);
    // More than eight bits are kept.
    let is_fine = opaque.iter().any(|plane| plane.rounding < 1e-3);
    let texels = if is_fine {
        Texels::Floats(all.map(|rgb| rgb.map(to_linear)).collect())
    } else {
        Texels::Bytes(all.map(|rgb| rgb.map(|v| (v * 255.0).round() as u8)).collect())
    };
    Ok(Picture { size: image.size, texels })
}

/// Portable float map: rows from the bottom.
fn pfm(bytes: &[u8]) -> std::result::Result<Picture, String> {
    let channels = if bytes[1] == b'F' { 3 } else { 1 };
    let mut at = 2;
    let mut word = || -> Option<&str> {
        let start = at + bytes.get(at..)?.iter().position(|b| !b.is_ascii_whitespace())?;
        let end = start + bytes[start..].iter().position(u8::is_ascii_whitespace)?;
        at = end;
        std::str::from_utf8(&bytes[start..end]).ok()
    };
    let mut header =
        || Some((word()?.parse::<u32>().ok()?, word()?.parse::<u32>().ok()?, word()?.parse::<f64>().ok()?));
    let (width, height, scale) = header().ok_or("is no PFM picture: its header has no width, height and scale")?;
    let data = bytes.get(at + 1..).unwrap_or_default();
    let needed = u64::from(width) * u64::from(height) * 4 * channels;
    if needed == 0 || needed > data.len() as u64 {
        return Err(format!("has {} bytes of pixels, but {width} x {height} need {needed}", data.len()));
    }
    let number = |four: &[u8; 4]| if scale < 0.0 { f32::from_le_bytes(*four) } else { f32::from_be_bytes(*four) };
    let values: Vec<f32> = data[..needed as usize].as_chunks::<4>().0.iter().map(number).collect();
    let texels = match channels {
        3 => values.as_chunks::<3>().0.to_vec(),
        _ => values.iter().map(|v| [*v; 3]).collect(),
    };
    Ok(Picture { size: [width, height], texels: Texels::Floats(texels) }.flipped(true))
}

/// A colour of a material or lamp: over wavelength, or over a surface.
#[derive(Debug, Clone)]
pub enum Colour {
    /// With its text in the scene, where that is shorter than the curve.
    Spectrum(Curve, Option<String>),
    Texture(Rc<Texture>),
}

#[derive(Debug, Clone)]
pub struct Texture {
    pub picture: Picture,
    pub name: String,
    /// What the channels are shares of; a colour where there are none.
    pub endmembers: Option<Box<[Colour; 2]>>,
    pub nearest: bool,
    /// (u, v) · scale + offset, v upward.
    pub scale: [f64; 2],
    pub offset: [f64; 2],
    /// The picture's file, where it may be taken as it is.
    pub file: Option<PathBuf>,
}

/// What is beyond a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wrap {
    Repeat,
    /// It mirrored.
    Mirror,
    /// What is at its edge.
    Clamp,
    /// Zero.
    Nothing,
}

/// Columns or rows of a picture that a scene may have.
const MOST_TEXELS: u64 = 1 << 26;

impl Texture {
    /// Where `matrix` and `offset` put it, from (u, v) of the surface to those of the picture, both with v up. A quarter of a turn is one of the
    /// picture; others are left out, and it is said how far off that is.
    pub fn placed(mut self, matrix: DMat2, offset: DVec2) -> (Texture, Option<Deviation>) {
        let size = matrix.to_cols_array().into_iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        let is_none = |x: f64| x.abs() <= 1e-6 * size;
        (self.scale, self.offset) = ([matrix.x_axis.x, matrix.y_axis.y], offset.to_array());
        if is_none(matrix.x_axis.y) && is_none(matrix.y_axis.x) {
            return (self, None);
        }
        if is_none(matrix.x_axis.x) && is_none(matrix.y_axis.y) {
            (self.picture, self.file) = (self.picture.transposed(), None);
            self.scale = [matrix.x_axis.y, matrix.y_axis.x];
            self.offset = [offset.y, offset.x];
            return (self, None);
        }
        self.scale = [matrix.x_axis.length(), matrix.y_axis.length()];
        let off = self.off_elsewhere("wherever that shows another place of it");
        (self, Some(off))
    }

    /// As a texture that repeats, by more of its picture: exact where it is mirrored, and within coordinates of the surface from 0 to 1
    /// where it is not repeated; how far off beyond that.
    pub fn wrapped(mut self, wrap: [Wrap; 2]) -> (Texture, Option<Deviation>) {
        if wrap == [Wrap::Repeat; 2] {
            return (self, None);
        }
        // Of each axis, texels before the picture, of it, and after it; the least is one that the edge is mixed with.
        let of_axis = |i: usize| -> [i64; 3] {
            let size = i64::from(self.picture.size[i]);
            match wrap[i] {
                Wrap::Repeat => [0, size, 0],
                Wrap::Mirror => [0, size, size],
                Wrap::Clamp | Wrap::Nothing => {
                    let (from, to) = (self.offset[i], self.offset[i] + self.scale[i]);
                    let texels = |beyond: f64| (beyond.clamp(0.0, 1e4) * size as f64).ceil() as i64 + 1;
                    [texels(-from.min(to)), size, texels(from.max(to) - 1.0)]
                }
            }
        };
        let mut axes = [of_axis(0), of_axis(1)];
        let count = |axes: &[[i64; 3]; 2]| axes.iter().map(|axis| axis.iter().sum::<i64>() as u64).product::<u64>();
        let is_cut = count(&axes) > MOST_TEXELS;
        if is_cut {
            axes = axes
                .map(|[before, size, after]| [before.min(1), size, after.min(if after == size { size } else { 1 })]);
        }
        let is_edged = wrap.iter().any(|wrap| matches!(wrap, Wrap::Clamp | Wrap::Nothing));
        let off = is_edged.then(|| {
            let lost = if is_cut { "wherever coordinates leave the picture" } else { "there" };
            self.off_elsewhere(lost)
        });
        let size = axes.map(|axis| axis.iter().sum::<i64>());
        // Of a column from the left or a row from the bottom, that of the picture.
        let source = |i: usize, at: i64| -> Option<i64> {
            let [before, size, _] = axes[i];
            let at = at - before;
            match wrap[i] {
                _ if (0..size).contains(&at) => Some(at),
                Wrap::Mirror => Some(2 * size - 1 - at),
                Wrap::Nothing => None,
                _ => Some(at.clamp(0, size - 1)),
            }
        };
        let [width, height] = size;
        let own = self.picture.size.map(i64::from);
        let places = (0..height).rev().flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| {
            let (x, y) = (source(0, x)?, source(1, y)?);
            Some(((own[1] - 1 - y) * own[0] + x) as usize)
        });
        let texels = match &self.picture.texels {
            Texels::Bytes(texels) => Texels::Bytes(places.map(|at| at.map_or([0; 3], |at| texels[at])).collect()),
            Texels::Floats(texels) => Texels::Floats(places.map(|at| at.map_or([0.0; 3], |at| texels[at])).collect()),
        };
        self.picture = Picture { size: size.map(|side| side as u32), texels };
        for i in 0..2 {
            let share = own[i] as f64 / size[i] as f64;
            self.scale[i] *= share;
            self.offset[i] = self.offset[i] * share + axes[i][0] as f64 / size[i] as f64;
        }
        self.file = None;
        (self, off)
    }
}

/// GGX's α: along u and along v, or the text of a texture and its mean.
pub enum Rough {
    Pair([f64; 2]),
    Texture(String, f64),
}

/// A scene has mirrors below this, and no texture says less.
const LEAST_ROUGH: f64 = 1e-3;

impl Rough {
    /// As text for what is as rough in all directions, the geometric mean; `None` for what is smooth.
    pub fn even(&self) -> Option<String> {
        match self {
            Rough::Pair(_) => Some(self.mean()).filter(|alpha| *alpha > 0.0).map(text::rounded),
            Rough::Texture(text, _) => Some(text.clone()),
        }
    }

    pub fn is_texture(&self) -> bool {
        matches!(self, Rough::Texture(..))
    }

    /// The two of a brushed surface.
    pub fn brushed(&self) -> Option<[f64; 2]> {
        match self {
            Rough::Pair(both @ [u, v]) => Some(*both).filter(|_| u != v && u.min(*v) >= LEAST_ROUGH),
            Rough::Texture(..) => None,
        }
    }

    /// One number for all of it.
    pub fn mean(&self) -> f64 {
        match self {
            Rough::Pair([u, v]) => (u * v).sqrt(),
            Rough::Texture(_, mean) => *mean,
        }
    }
}

/// The number that a texel is.
pub fn grey(rgb: [f32; 3]) -> f64 {
    rgb.into_iter().map(f64::from).sum::<f64>() / 3.0
}

/// A number over a surface: one where it is the same all over, else the text of a texture and its mean.
pub enum Numbers {
    One(f64),
    Texture(String, f64),
}

impl Texture {
    /// `value` of each texel's `number` within [0, 1], of `what`; where the channels are shares of two spectra, of the number that they are at
    /// 550 nm. `name` is for the file that it needs, `at` where it is asked for.
    pub fn numbers(
        &self,
        scene: &mut Scene,
        (what, at): (&str, Place),
        name: &str,
        number: &dyn Fn([f32; 3]) -> f64,
        value: &dyn Fn(f64) -> f64,
    ) -> Result<Numbers> {
        let ends = self.endmembers.as_ref().map(|two| [two[0].mean().eval(550.0), two[1].mean().eval(550.0)]);
        let of_texel = |rgb: [f32; 3]| match ends {
            Some([a, b]) => f64::from(rgb[0]) * a + f64::from(rgb[1]) * b,
            None => number(rgb),
        };
        // Shares are as they are written.
        let picture = if ends.is_some() { self.picture.clone().raw() } else { self.picture.clone() };
        let numbers: Vec<f64> = picture.linear().into_iter().map(of_texel).collect();
        let beyond = numbers.iter().map(|number| (number - number.clamp(0.0, 1.0)).abs()).fold(0.0, f64::max);
        if beyond > 0.0 {
            let what = format!("{what} of a texture outside of 0 to 1, which are clipped to that");
            scene.report.approximated(at, what, Deviation::at_most(text::up(beyond)));
        }
        let values: Vec<f32> = numbers.into_iter().map(|number| value(number.clamp(0.0, 1.0)) as f32).collect();
        if let [first, rest @ ..] = &values[..]
            && rest.iter().all(|value| value == first)
        {
            return Ok(Numbers::One(f64::from(*first)));
        }
        let mean = values.iter().map(|value| f64::from(*value)).sum::<f64>() / values.len().max(1) as f64;
        Ok(Numbers::Texture(self.greys(scene, name, values)?, mean))
    }

    /// The text of a texture like this one with a number for each texel.
    pub fn greys(&self, scene: &mut Scene, name: &str, values: Vec<f32>) -> Result<String> {
        let texels = Texels::Floats(values.into_iter().map(|value| [value; 3]).collect());
        let picture = Picture { size: self.picture.size, texels };
        Texture { picture, name: format!("{name}.exr"), endmembers: None, file: None, ..self.clone() }.toml(scene, "")
    }

    /// The roughness that the texels say, by `alpha` of each one's `number`.
    pub fn rough(
        &self,
        scene: &mut Scene,
        said: (&str, Place),
        name: &str,
        number: &dyn Fn([f32; 3]) -> f64,
        alpha: &dyn Fn(f64) -> f64,
    ) -> Result<Rough> {
        let name = format!("{name}-roughness");
        let found = self.numbers(scene, said, &name, number, &|v| alpha(v).max(LEAST_ROUGH))?;
        Ok(match found {
            Numbers::One(alpha) => Rough::Pair([alpha; 2]),
            Numbers::Texture(text, mean) => Rough::Texture(text, mean),
        })
    }
}

impl Colour {
    pub fn grey(value: f64) -> Colour {
        Colour::Spectrum(Curve::Constant(value), None)
    }

    pub fn is_texture(&self) -> bool {
        matches!(self, Colour::Texture(_))
    }

    pub fn is_black(&self) -> bool {
        match self {
            Colour::Spectrum(Curve::Constant(value), _) => *value == 0.0,
            Colour::Spectrum(Curve::Linear { value, .. }, _) => value.iter().all(|v| *v == 0.0),
            _ => false,
        }
    }

    /// Of a texture the curve of its mean colour.
    pub fn mean(&self) -> Curve {
        match self {
            Colour::Spectrum(curve, _) => curve.clone(),
            Colour::Texture(texture) => match &texture.endmembers {
                Some(two) => {
                    let [a, b] = [two[0].mean(), two[1].mean()];
                    sampled(&|nm| 0.5 * (a.eval(nm) + b.eval(nm)))
                }
                None => crate::spectral::upsample::reflectance(texture.picture.mean().map(|v| v.clamp(0.0, 1.0))),
            },
        }
    }

    /// With a function of its value at each wavelength; of a texture's, of each linear number of its texels.
    pub fn map(&self, f: impl Fn(f64) -> f64) -> Colour {
        self.mapped(&f)
    }

    fn mapped(&self, f: &dyn Fn(f64) -> f64) -> Colour {
        let curve = |curve: &Curve| match curve {
            Curve::Constant(value) => Curve::Constant(f(*value)),
            Curve::Linear { nm, value, outside } => {
                Curve::Linear { nm: nm.clone(), value: value.iter().map(|v| f(*v)).collect(), outside: *outside }
            }
            curve => sampled(&|nm| f(curve.eval(nm))),
        };
        match self {
            Colour::Spectrum(of, _) => Colour::Spectrum(curve(of), None),
            Colour::Texture(texture) => {
                let mut texture = (**texture).clone();
                match &mut texture.endmembers {
                    Some(endmembers) => endmembers.iter_mut().for_each(|of| *of = of.mapped(f)),
                    None => (texture.picture, texture.file) = (texture.picture.map(f), None),
                }
                Colour::Texture(Rc::new(texture))
            }
        }
    }

    /// Its text in the scene; `name` for files that it needs.
    pub fn toml(&self, scene: &mut Scene, name: &str) -> Result<String> {
        match self {
            Colour::Spectrum(_, Some(text)) => Ok(text.clone()),
            Colour::Spectrum(curve, None) => scene.spectrum(curve, name),
            Colour::Texture(texture) => texture.toml(scene, ""),
        }
    }
}

impl Texture {
    /// With further keys, such as `, strength = 2`.
    pub fn toml(&self, scene: &mut Scene, more: &str) -> Result<String> {
        let path = match &self.file {
            Some(file) => scene.copy("textures", file)?,
            None => self.picture.write(scene, &self.name)?,
        };
        let mut out = format!("{{ texture = {}", text::quoted(&path));
        if let Some(endmembers) = &self.endmembers {
            let mut texts = Vec::new();
            let stem = self.name.split('.').next().unwrap_or_default();
            for (i, colour) in endmembers.iter().enumerate() {
                texts.push(colour.toml(scene, &format!("{stem}-{i}"))?);
            }
            // PNG has a third channel, which is empty.
            out += &format!(", endmembers = [{}, {}, 0.0]", texts[0], texts[1]);
        }
        if self.nearest {
            out += ", filter = \"nearest\"";
        }
        for (key, pair, default) in [("scale", self.scale, 1.0), ("offset", self.offset, 0.0)] {
            if pair != [default; 2] {
                out += &format!(", {key} = [{}, {}]", text::rounded(pair[0]), text::rounded(pair[1]));
            }
        }
        Ok(out + more + " }")
    }
}

impl Colour {
    /// How far its mean is from what it is at places, or wavelengths.
    pub fn off_its_mean(&self) -> Deviation {
        match self {
            Colour::Texture(texture) => texture.off_its_mean(),
            Colour::Spectrum(curve, _) => {
                let (mean, [low, high]) = (curve.mean(400.0, 700.0), range(curve));
                let off = text::up((high - mean).max(mean - low));
                Deviation::at_most(format!("{off}: it is from {} to {} over wavelengths", short(low), short(high)))
            }
        }
    }
}

impl Texture {
    /// The least and the largest of what its texels are.
    pub fn range(&self) -> [f64; 2] {
        let fold = |[low, high]: [f64; 2], v: f64| [low.min(v), high.max(v)];
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        match &self.endmembers {
            Some(two) => two.iter().flat_map(|colour| range(&colour.mean())).fold(none, fold),
            None => self.picture.linear().iter().flatten().map(|v| f64::from(*v)).fold(none, fold),
        }
    }

    /// [`Colour::off_its_mean`].
    pub fn off_its_mean(&self) -> Deviation {
        let [low, high] = self.range();
        let means: Vec<f64> = match &self.endmembers {
            Some(two) => vec![two.iter().map(|colour| colour.mean().eval(550.0)).sum::<f64>() / 2.0],
            None => self.picture.mean().to_vec(),
        };
        let off = means.into_iter().map(|mean| (high - mean).max(mean - low)).fold(0.0, f64::max);
        Deviation::at_most(format!("{}: its texels are from {} to {}", text::up(off), short(low), short(high)))
    }

    /// How far what is elsewhere on it is from what is at a place.
    pub fn off_elsewhere(&self, lost: &str) -> Deviation {
        let [low, high] = self.range();
        let shown = format!("its texels are from {} to {}", short(low), short(high));
        Deviation::at_most(format!("{} {lost}: {shown}", text::up(high - low)))
    }
}

/// The least and the largest over the visible.
fn range(curve: &Curve) -> [f64; 2] {
    let all = (72..=166).map(|i| curve.eval(5.0 * f64::from(i)));
    all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
}

/// Three digits.
pub fn short(value: f64) -> String {
    let short: f64 = format!("{value:.2e}").parse().unwrap_or(value);
    text::number(short)
}

/// A placement of a picture whose v runs down, for surfaces whose v runs down too (`flip`) or up, by one whose v runs up.
pub fn upward(matrix: DMat2, offset: DVec2, flip: bool) -> (DMat2, DVec2) {
    // Of the surface v is 1 - v up unless it runs down as it is; of the picture it is 1 - v up.
    let (sign, start) = if flip { (1.0, DVec2::ZERO) } else { (-1.0, DVec2::Y) };
    let [of_surface, of_picture] = [sign, -1.0].map(|sign| DMat2::from_diagonal(DVec2::new(1.0, sign)));
    (of_picture * matrix * of_surface, of_picture * (matrix * start + offset) + DVec2::Y)
}

/// RGB as numbers of any size: a smooth spectrum of half of their size, scaled.
pub fn unbounded(rgb: [f64; 3]) -> Curve {
    let scale = 2.0 * rgb[0].max(rgb[1]).max(rgb[2]).max(f64::MIN_POSITIVE);
    let smooth = crate::spectral::upsample::reflectance(rgb.map(|v| v / scale));
    sampled(&|nm| scale * smooth.eval(nm))
}

/// A function of wavelength at every 5 nm of what is visible.
pub fn sampled(f: &dyn Fn(f64) -> f64) -> Curve {
    let nm: Vec<f64> = (72..=166).map(|i| 5.0 * f64::from(i)).collect();
    let value = nm.iter().map(|nm| f(*nm)).collect();
    Curve::Linear { nm, value, outside: crate::spectral::Outside::Hold }
}
