//! Spectra and textures.

use std::rc::Rc;

use glam::DMat2;

use super::values::{self, Plugin, numbers, place};
use super::xml::{Node, inside};
use super::{Importer, at};
use crate::Result;
use crate::format::text as spectra;
use crate::import::picture::{Colour, Numbers, Picture, Texels, Texture, Wrap, unbounded, upward};
use crate::import::report::Deviation;
use crate::import::text;
use crate::spectral::upsample;
use crate::spectral::{Curve, Outside};

/// What a colour is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Of {
    /// Within [0, 1].
    Reflectance,
    /// RGB is light of that colour.
    Emission,
    /// RGB may be more than 1.
    Unbounded,
}

impl<'n> Importer<'n, '_> {
    /// The colour `name` of a plugin; `flip`: whether v of the surface runs down, as Mitsuba's own does.
    pub fn colour(&mut self, plugin: &Plugin<'n>, name: &str, of: Of, flip: bool) -> Result<Option<Colour>> {
        plugin.get(name).map(|node| self.colour_of(node, of, flip)).transpose()
    }

    pub fn colour_of(&mut self, node: &'n Node, of: Of, flip: bool) -> Result<Colour> {
        let node = self.resolve(node)?;
        match node.tag.as_str() {
            "float" | "integer" => self.constant(node, of),
            "rgb" => {
                let rgb = match numbers(values::value(node)?, node)?[..] {
                    [r, g, b] => [r, g, b],
                    [grey] => [grey; 3],
                    _ => return Err(node.problem("`rgb` must have three numbers").into()),
                };
                self.rgb(rgb, of, node)
            }
            "spectrum" | "texture" if node.attribute("type").is_some() => self.plugin_colour(node, of, flip),
            "spectrum" => match (node.attribute("value"), node.attribute("filename")) {
                (Some(value), _) if value.contains(':') => {
                    let mut samples = Vec::new();
                    for pair in value.split([',', ' ', '\t', '\n', '\r']).filter(|pair| !pair.is_empty()) {
                        let (nm, value) = pair
                            .split_once(':')
                            .ok_or_else(|| node.problem(format!("`{}` is no wavelength:value", values::shown(pair))))?;
                        let number = |text: &str| numbers(text, node).map(|n| n.first().copied().unwrap_or(f64::NAN));
                        samples.push((number(nm)?, number(value)?));
                    }
                    self.table(samples, of, node)
                }
                (Some(_), _) => self.constant(node, of),
                (None, Some(name)) => {
                    let path = inside(name, node)?;
                    let table = spectra::read_spectrum(&path, spectra::Column::Only, None).map_err(|p| at(node, &p))?;
                    self.table(table.nm.into_iter().zip(table.value).collect(), of, node)
                }
                (None, None) => Err(node.problem("`spectrum` has no `value`, `filename` or `type`").into()),
            },
            other => Err(node.problem(format!("`{}` is no colour", values::shown(other))).into()),
        }
    }

    fn constant(&mut self, node: &'n Node, of: Of) -> Result<Colour> {
        let [value] = numbers(values::value(node)?, node)?[..] else {
            return Err(node.problem("must be one number").into());
        };
        check(node, of, [value])?;
        Ok(Colour::grey(value))
    }

    fn table(&mut self, mut samples: Vec<(f64, f64)>, of: Of, node: &'n Node) -> Result<Colour> {
        samples.sort_by(|a, b| a.0.total_cmp(&b.0));
        samples.dedup_by(|a, b| a.0 == b.0 && a.1 == b.1);
        if samples.len() < 2 || samples.iter().any(|(nm, _)| *nm <= 0.0) {
            return Err(node.problem("a spectrum needs two wavelengths above 0, or more").into());
        }
        check(node, of, samples.iter().map(|(_, value)| *value))?;
        // Beyond its ends Mitsuba has nothing, which of a reflectance is no measurement.
        let outside = if of == Of::Emission { Outside::Zero } else { Outside::Hold };
        let (nm, value) = samples.into_iter().unzip();
        Ok(Colour::Spectrum(Curve::Linear { nm, value, outside }, None))
    }

    fn rgb(&mut self, rgb: [f64; 3], of: Of, node: &'n Node) -> Result<Colour> {
        check(node, of, rgb)?;
        let written = format!("{{ rgb = {} }}", text::list(rgb));
        let is_grey = rgb == [rgb[0]; 3];
        Ok(match of {
            Of::Reflectance if is_grey => Colour::grey(rgb[0]),
            Of::Reflectance => Colour::Spectrum(upsample::reflectance(rgb), Some(written)),
            Of::Emission => Colour::Spectrum(upsample::emission(rgb), Some(written)),
            Of::Unbounded if is_grey => Colour::grey(rgb[0]),
            Of::Unbounded => {
                if rgb.iter().any(|v| *v > 1.0) {
                    let what = "RGB of an index above 1 is as it is written, as in Mitsuba's RGB variants; its spectral variants (3.9.1) \
                                take 1 in the place of what is more";
                    self.scene.report.chosen(place(node), what);
                }
                Colour::Spectrum(unbounded(rgb), None)
            }
        })
    }

    fn plugin_colour(&mut self, node: &'n Node, of: Of, flip: bool) -> Result<Colour> {
        let plugin = Plugin::new(node);
        let colour = match plugin.kind() {
            "uniform" => {
                let value = plugin.float("value")?.unwrap_or(1.0);
                check(node, of, [value])?;
                Colour::grey(value)
            }
            "rgb" | "srgb" | "d65" => {
                let of = if plugin.kind() == "d65" { Of::Emission } else { of };
                let rgb = match plugin.get("color").or(plugin.get("value")) {
                    Some(node) => numbers(values::value(node)?, node)?,
                    None => vec![1.0; 3],
                };
                let scale = plugin.float("scale")?.unwrap_or(1.0);
                match rgb[..] {
                    [r, g, b] => self.rgb([r, g, b].map(|v| v * scale), of, node)?,
                    [v] => self.rgb([v * scale; 3], of, node)?,
                    _ => return Err(node.problem("`color` must have three numbers").into()),
                }
            }
            "blackbody" => {
                let kelvin = plugin.float("temperature")?.filter(|kelvin| *kelvin > 0.0);
                let kelvin = kelvin.ok_or_else(|| node.problem("`blackbody` needs a `temperature` above 0"))?;
                let scale = plugin.float("scale")?.unwrap_or(1.0);
                Colour::Spectrum(Curve::Blackbody { kelvin, scale }, None)
            }
            "regular" | "irregular" => {
                let text = |name: &str| plugin.string(name).map(|text| text.unwrap_or(""));
                let value = numbers(text("values")?, node)?;
                let nm = match plugin.kind() {
                    "irregular" => numbers(text("wavelengths")?, node)?,
                    _ => {
                        let ends = [plugin.float("wavelength_min")?, plugin.float("wavelength_max")?];
                        let [Some(from), Some(to)] = ends else {
                            return Err(node.problem("`regular` needs `wavelength_min` and `wavelength_max`").into());
                        };
                        let step = (to - from) / (value.len().max(2) - 1) as f64;
                        (0..value.len()).map(|i| from + step * i as f64).collect()
                    }
                };
                if nm.len() != value.len() {
                    return Err(node
                        .problem(format!("has {} wavelengths and {} values", nm.len(), value.len()))
                        .into());
                }
                self.table(nm.into_iter().zip(value).collect(), of, node)?
            }
            "bitmap" => self.bitmap(&plugin, of, flip)?,
            "checkerboard" => self.checkerboard(&plugin, of, flip)?,
            other => {
                let what = format!("the texture `{}` as a grey of 0.5", values::shown(other));
                let off = match of {
                    Of::Reflectance => Deviation::at_most("0.5 of reflectance"),
                    _ => Deviation::unbounded("its values may be any"),
                };
                self.scene.report.approximated(plugin.place(), what, off);
                plugin.objects(&["texture", "spectrum", "rgb"]);
                return Ok(Colour::grey(0.5));
            }
        };
        plugin.finish(&mut self.scene.report);
        self.scene.report.translated(format!("{} `{}`", node.tag, plugin.kind()), plugin.place());
        Ok(colour)
    }

    fn bitmap(&mut self, plugin: &Plugin<'n>, of: Of, flip: bool) -> Result<Colour> {
        let node = plugin.node;
        let name = plugin.string("filename")?.ok_or_else(|| node.problem("`bitmap` has no `filename`"))?;
        let path = inside(name, node)?;
        let raw = plugin.boolean("raw", false)?;
        let nearest = self.filter(plugin)?;
        let mut picture = Picture::read(&path).map_err(|problem| at(node, &problem))?;
        let mut file = None;
        if raw {
            picture = picture.raw();
        } else if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) && is_plain_png(&path) {
            file = Some(path.clone());
        }
        if of == Of::Reflectance
            && let Some(off) = picture.beyond_one()
        {
            self.scene.report.approximated(plugin.place(), "texels of a reflectance beyond 1, which are 1", off);
            (picture, file) = (picture.map(&|v| v.clamp(0.0, 1.0)), None);
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let texture = Texture { picture, name, endmembers: None, nearest, scale: [1.0; 2], offset: [0.0; 2], file };
        let texture = self.placed(texture, plugin, flip)?;
        Ok(Colour::Texture(Rc::new(self.wrapped(texture, plugin)?)))
    }

    fn filter(&mut self, plugin: &Plugin<'n>) -> Result<bool> {
        Ok(plugin.string("filter_type")? == Some("nearest"))
    }

    /// A texture that goes on beyond its picture as `wrap_mode` says.
    fn wrapped(&mut self, texture: Texture, plugin: &Plugin<'n>) -> Result<Texture> {
        let mode = plugin.string("wrap_mode")?.unwrap_or("repeat");
        let wrap = match mode {
            "repeat" => Wrap::Repeat,
            "mirror" => Wrap::Mirror,
            "clamp" => Wrap::Clamp,
            other => {
                let known = "`repeat`, `mirror` and `clamp` are known";
                return Err(plugin.node.problem(format!("the wrap mode `{}`: {known}", values::shown(other))).into());
            }
        };
        let (texture, off) = texture.wrapped([wrap; 2]);
        if let Some(off) = off {
            let what = format!("the wrap mode `{mode}` as `repeat` beyond coordinates of the surface from 0 to 1");
            self.scene.report.approximated(plugin.place(), what, off);
        }
        Ok(texture)
    }

    /// Two colours in a pattern of two by two fields.
    fn checkerboard(&mut self, plugin: &Plugin<'n>, of: Of, flip: bool) -> Result<Colour> {
        let mut two = [0.4, 0.2].map(Colour::grey);
        for (part, name) in two.iter_mut().zip(["color0", "color1"]) {
            match self.colour(plugin, name, of, flip)? {
                Some(texture @ Colour::Texture(_)) => {
                    let what = "a texture within a checkerboard as its mean colour";
                    self.scene.report.approximated(plugin.place(), what, texture.off_its_mean());
                    *part = Colour::Spectrum(texture.mean(), None);
                }
                Some(colour) => *part = colour,
                None => {}
            }
        }
        // Shares: red of the first, green of the second. With v downward, the field at the top left is the first.
        let (a, b) = ([255, 0, 0], [0, 255, 0]);
        let picture = Picture { size: [2, 2], texels: Texels::Bytes(vec![a, b, b, a]) };
        let name = "checkerboard.png".to_owned();
        let endmembers = Some(Box::new(two));
        let (scale, offset) = ([1.0; 2], [0.0; 2]);
        let texture = Texture { picture, name, endmembers, nearest: true, scale, offset, file: None };
        Ok(Colour::Texture(Rc::new(self.placed(texture, plugin, flip)?)))
    }

    /// A texture where `to_uv` puts it; v of the picture runs up here and down there.
    fn placed(&mut self, texture: Texture, plugin: &Plugin<'n>, flip: bool) -> Result<Texture> {
        let transform = plugin.transform("to_uv")?;
        let (x, y) = (transform.matrix3.x_axis.truncate(), transform.matrix3.y_axis.truncate());
        let (matrix, offset) = upward(DMat2::from_cols(x, y), transform.translation.truncate(), flip);
        let (texture, off) = texture.placed(matrix, offset);
        if let Some(off) = off {
            let what = "a texture that `to_uv` turns by other than quarters of a turn, as one that it does not";
            self.scene.report.approximated(plugin.place(), what, off);
        }
        Ok(texture)
    }

    /// The picture of a number that differs over the surface, if it does.
    pub fn texture_of_numbers(&mut self, plugin: &Plugin<'n>, name: &str, flip: bool) -> Result<Option<Rc<Texture>>> {
        let Some(node) = plugin.get(name) else { return Ok(None) };
        let node = self.resolve(node)?;
        if node.tag == "float" || node.tag == "integer" {
            return Ok(None);
        }
        Ok(match self.colour_of(node, Of::Unbounded, flip)? {
            Colour::Texture(texture) => Some(texture),
            Colour::Spectrum(..) => None,
        })
    }

    /// The mean of a number over the surface, where it has to be one.
    pub fn mean_number(&mut self, plugin: &Plugin<'n>, name: &str, default: f64) -> Result<f64> {
        let Some(node) = plugin.get(name) else { return Ok(default) };
        let node = self.resolve(node)?;
        if node.tag == "float" || node.tag == "integer" {
            return Ok(numbers(values::value(node)?, node)?.first().copied().unwrap_or(default));
        }
        let colour = self.colour_of(node, Of::Unbounded, true)?;
        let mean = match &colour {
            Colour::Texture(texture) => {
                let what = format!("`{name}` by a texture as its mean");
                self.scene.report.approximated(place(node), what, texture.off_its_mean());
                texture.picture.mean().iter().sum::<f64>() / 3.0
            }
            Colour::Spectrum(curve, _) => curve.eval(550.0),
        };
        Ok(mean)
    }

    /// The share that a mask or a blend's weight is, as text of the scene.
    pub fn share(&mut self, plugin: &Plugin<'n>, name: &str, default: f64, flip: bool) -> Result<String> {
        let Some(node) = plugin.get(name) else { return Ok(text::number(default)) };
        match self.colour_of(node, Of::Reflectance, flip)? {
            Colour::Spectrum(curve, _) => Ok(text::rounded(curve.eval(550.0))),
            Colour::Texture(texture) => {
                // The luminance of what is a colour.
                let luminance = |[r, g, b]: [f32; 3]| f64::from(0.2126 * r + 0.7152 * g + 0.0722 * b);
                let stem = texture.name.split('.').next().unwrap_or_default();
                Ok(match texture.numbers(self.scene, ("shares", place(node)), stem, &luminance, &|share| share)? {
                    Numbers::One(share) => text::rounded(share),
                    Numbers::Texture(text, _) => text,
                })
            }
        }
    }
}

fn check(node: &Node, of: Of, values: impl IntoIterator<Item = f64>) -> Result<()> {
    let largest = if of == Of::Reflectance { 1.0 } else { f64::INFINITY };
    match values.into_iter().find(|value| !(0.0..=largest).contains(value)) {
        Some(value) if largest == 1.0 => {
            Err(node.problem(format!("a reflectance must be from 0 to 1, but is {value}")).into())
        }
        Some(value) => Err(node.problem(format!("must be 0 or more, but is {value}")).into()),
        None => Ok(()),
    }
}

/// Whether a scene may have the file as it is: colours of 8 bits in sRGB, without alpha.
fn is_plain_png(path: &std::path::Path) -> bool {
    let Ok(file) = std::fs::File::open(path) else { return false };
    let Ok(reader) = png::Decoder::new(std::io::BufReader::new(file)).read_info() else { return false };
    let info = reader.info();
    matches!(info.color_type, png::ColorType::Rgb | png::ColorType::Grayscale)
        && info.bit_depth == png::BitDepth::Eight
        && info.trns.is_none()
        && info.gama_chunk.is_none()
        && info.icc_profile.is_none()
}
