//! Pictures of other people's formats, and the PNG or OpenEXR that a scene has in their place.

use std::path::{Path, PathBuf};
use std::rc::Rc;

use super::report::Place;
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
        if numbers.iter().any(|number| !(0.0..=1.0).contains(number)) {
            scene.report.approximated(at, format!("{what} of a texture outside of 0 to 1, which are clipped to that"));
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
