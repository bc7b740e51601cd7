//! Spectra and textures of pbrt.

use std::rc::Rc;

use super::Importer;
use super::token::{Parameter, Parameters, shown};
use crate::Result;
use crate::format::text as spectra;
use crate::import::metals;
use crate::import::picture::{Colour, Picture, Texels, Texture, sampled, unbounded};
use crate::import::surfaces::luminance;
use crate::import::text;
use crate::spectral::upsample;
use crate::spectral::{Curve, Outside};

/// What a spectrum is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Of {
    Albedo,
    /// Scaled to luminance 1 where it is no RGB, as pbrt does.
    Light,
    Index,
}

impl Importer<'_> {
    pub fn colour(&mut self, parameters: &Parameters, name: &str, of: Of) -> Result<Option<Colour>> {
        parameters.get(name).map(|parameter| self.colour_of(parameter, of)).transpose()
    }

    pub fn colour_of(&mut self, parameter: &Parameter, of: Of) -> Result<Colour> {
        let (at, numbers) = (&parameter.at, &parameter.numbers[..]);
        let colour = match (parameter.kind.as_str(), numbers, &parameter.texts[..]) {
            ("texture", _, [name]) => match self.textures.get(name) {
                Some(colour) => colour.clone(),
                None => return Err(at.problem(format!("no texture is named \"{}\"", shown(name))).into()),
            },
            ("rgb", &[r, g, b], _) => {
                if [r, g, b].iter().any(|v| *v < 0.0) {
                    let what = format!("`{}` with negative values, which are 0", shown(&parameter.name));
                    self.scene.report.approximated(at.place(), what);
                }
                if of == Of::Albedo && [r, g, b].iter().any(|v| *v > 1.0) {
                    self.scene.report.approximated(at.place(), "a reflectance above 1, which is 1");
                }
                self.rgb([r, g, b], of)
            }
            ("float" | "spectrum", &[value], _) => Colour::grey(value),
            ("blackbody", &[kelvin, ..], _) if kelvin > 0.0 => {
                let shape = Curve::Blackbody { kelvin, scale: 1.0 };
                let scale = if of == Of::Light { 1.0 / luminance(&shape) } else { 1.0 };
                Colour::Spectrum(shape.scaled(scale), None)
            }
            ("spectrum", pairs, []) if pairs.len() >= 4 && pairs.len() % 2 == 0 => {
                let (nm, value) = pairs.as_chunks::<2>().0.iter().map(|[nm, value]| (*nm, *value)).unzip();
                self.table(nm, value, of, parameter)?
            }
            ("spectrum", _, [name]) => self.named(name, of, parameter)?,
            (kind, ..) => {
                return Err(at.problem(format!("`{} {}` is no spectrum", shown(kind), shown(&parameter.name))).into());
            }
        };
        let largest = match &colour {
            Colour::Spectrum(Curve::Constant(value), _) => Some(*value),
            Colour::Spectrum(curve @ Curve::Linear { .. }, _) => Some(curve.max(360.0, 830.0)),
            _ => None,
        };
        if largest.is_some_and(|value| value < 0.0) {
            return Err(at.problem(format!("`{}` must not be negative", shown(&parameter.name))).into());
        }
        if of == Of::Albedo && largest.is_some_and(|value| value > 1.0) {
            self.scene.report.approximated(at.place(), "a reflectance above 1, which is 1");
            return Ok(colour.map(|v| v.min(1.0)));
        }
        Ok(colour)
    }

    fn rgb(&mut self, rgb: [f64; 3], of: Of) -> Colour {
        let rgb = rgb.map(|v| v.max(0.0));
        let is_grey = rgb == [rgb[0]; 3];
        let written = |rgb: [f64; 3]| Some(format!("{{ rgb = {} }}", text::list(rgb)));
        match of {
            Of::Albedo => {
                let clipped = rgb.map(|v| v.min(1.0));
                if is_grey {
                    Colour::grey(clipped[0])
                } else {
                    Colour::Spectrum(upsample::reflectance(clipped), written(clipped))
                }
            }
            Of::Light => Colour::Spectrum(upsample::emission(rgb), written(rgb)),
            Of::Index if is_grey => Colour::grey(rgb[0]),
            Of::Index => Colour::Spectrum(unbounded(rgb), None),
        }
    }

    fn table(&mut self, nm: Vec<f64>, value: Vec<f64>, of: Of, parameter: &Parameter) -> Result<Colour> {
        if nm.len() < 2 || !nm.is_sorted() || nm[0] <= 0.0 || value.iter().any(|v| *v < 0.0) {
            let message = "a spectrum needs wavelengths above 0, in ascending order, and values of at least 0";
            return Err(parameter.at.problem(message).into());
        }
        let outside = if of == Of::Light { Outside::Zero } else { Outside::Hold };
        let curve = Curve::Linear { nm, value, outside };
        if of == Of::Light {
            let luminance = luminance(&curve);
            if luminance <= 0.0 {
                return Err(parameter.at.problem("a light without visible power has no scale in pbrt").into());
            }
            return Ok(Colour::Spectrum(curve.scaled(1.0 / luminance), None));
        }
        Ok(Colour::Spectrum(curve, None))
    }

    fn named(&mut self, name: &str, of: Of, parameter: &Parameter) -> Result<Colour> {
        let at = &parameter.at;
        let metal = name.strip_prefix("metal-").and_then(|rest| rest.rsplit_once('-'));
        if let Some((metal, part)) = metal {
            let found = metals::metal(metal).ok_or_else(|| {
                let known = metals::names().join(", ");
                at.problem(format!("the metal of \"{}\" is not known; known are {known}", shown(name)))
            })?;
            let [n, k] = found;
            return Ok(Colour::Spectrum(if part == "k" { k } else { n }, None));
        }
        if let Some(glass) = name.strip_prefix("glass-") {
            let found = metals::glass(glass)
                .ok_or_else(|| at.problem(format!("the glass \"{}\" is not known", shown(glass))))?;
            return Ok(Colour::Spectrum(found, None));
        }
        match name {
            "stdillum-D65" => return Ok(self.rgb([1.0; 3], Of::Light)),
            "stdillum-A" => {
                let shape = Curve::Blackbody { kelvin: 2856.0, scale: 1.0 };
                return Ok(Colour::Spectrum(shape.scaled(1.0 / luminance(&shape)), None));
            }
            _ if name.starts_with("stdillum-") || name.starts_with("illum-") => {
                self.scene.report.approximated(at.place(), format!("the light of \"{}\" as D65", shown(name)));
                return Ok(self.rgb([1.0; 3], Of::Light));
            }
            _ => {}
        }
        let path = at.file(name)?;
        let table = spectra::read_spectrum(&path, spectra::Column::Only, None)
            .map_err(|problem| super::beside(at, &problem))?;
        self.table(table.nm, table.value, of, parameter)
    }

    /// A number, or the mean of a texture.
    pub fn mean_number(&mut self, parameters: &Parameters, name: &str) -> Result<Option<f64>> {
        let Some(parameter) = parameters.get(name) else { return Ok(None) };
        match self.colour_of(parameter, Of::Index)? {
            Colour::Texture(texture) => {
                let what = format!("`{name}` by a texture as its mean");
                self.scene.report.approximated(parameter.at.place(), what);
                Ok(Some(match &texture.endmembers {
                    Some(two) => 0.5 * (two[0].mean().eval(550.0) + two[1].mean().eval(550.0)),
                    None => texture.picture.mean().iter().sum::<f64>() / 3.0,
                }))
            }
            Colour::Spectrum(curve, _) => Ok(Some(curve.eval(550.0))),
        }
    }

    /// `Texture "name" "type" "class"`.
    pub fn texture(
        &mut self,
        name: &str,
        kind: &str,
        class: &str,
        parameters: &Parameters,
        at: &super::token::At,
    ) -> Result<()> {
        let of = if kind == "float" { Of::Index } else { Of::Albedo };
        let part = |importer: &mut Self, name: &str, default: f64| -> Result<Colour> {
            Ok(importer.colour(parameters, name, of)?.unwrap_or(Colour::grey(default)))
        };
        let colour = match class {
            "constant" => part(self, "value", 1.0)?,
            "scale" => {
                let (tex, scale) = (part(self, "tex", 1.0)?, part(self, "scale", 1.0)?);
                match (tex, scale) {
                    (tex, Colour::Spectrum(Curve::Constant(factor), _)) => tex.map(|v| v * factor),
                    (Colour::Spectrum(Curve::Constant(factor), _), scale) => scale.map(|v| v * factor),
                    (tex, scale) => {
                        self.scene.report.approximated(at.place(), "a texture scaled by another by the other's mean");
                        let factor = scale.mean().mean(400.0, 700.0);
                        tex.map(|v| v * factor)
                    }
                }
            }
            "mix" => {
                let amount = self.mean_number(parameters, "amount")?.unwrap_or(0.5);
                let (a, b) = (part(self, "tex1", 0.0)?, part(self, "tex2", 1.0)?);
                if a.is_texture() || b.is_texture() {
                    self.scene.report.approximated(at.place(), "a mixture of textures by their means");
                }
                let (a, b) = (a.mean(), b.mean());
                Colour::Spectrum(sampled(&|nm| (1.0 - amount) * a.eval(nm) + amount * b.eval(nm)), None)
            }
            "checkerboard" => {
                let two = [part(self, "tex1", 1.0)?, part(self, "tex2", 0.0)?].map(|colour| match colour {
                    Colour::Texture(_) => Colour::Spectrum(colour.mean(), None),
                    colour => colour,
                });
                if parameters.number("dimension")?.is_some_and(|dimension| dimension != 2.0) {
                    self.scene.report.approximated(at.place(), "a checkerboard in space as one on the surface");
                }
                let (a, b) = ([255, 0, 0], [0, 255, 0]);
                // Fields are a unit wide, and the lower left one is the first.
                let picture = Picture { size: [2, 2], texels: Texels::Bytes(vec![b, a, a, b]) };
                let (scale, offset) = self.placement(parameters)?;
                let half = |v: [f64; 2]| v.map(|v| 0.5 * v);
                let name = "checkerboard.png".to_owned();
                let endmembers = Some(Box::new(two));
                let (scale, offset) = (half(scale), half(offset));
                Colour::Texture(Rc::new(Texture {
                    picture,
                    name,
                    endmembers,
                    nearest: true,
                    scale,
                    offset,
                    file: None,
                }))
            }
            "imagemap" => self.image(parameters, of, at)?,
            other => {
                let what = format!("the texture `{}` as 0.5", shown(other));
                self.scene.report.approximated(at.place(), what);
                parameters.ask_for_all();
                self.textures.insert(name.to_owned(), Colour::grey(0.5));
                return Ok(());
            }
        };
        parameters.finish(&format!("the texture \"{}\"", shown(name)), &mut self.scene.report);
        self.scene.report.translated(format!("Texture `{class}`"), at.place());
        self.textures.insert(name.to_owned(), colour);
        Ok(())
    }

    fn placement(&mut self, parameters: &Parameters) -> Result<([f64; 2], [f64; 2])> {
        if let Some(mapping) = parameters.text("mapping")?.filter(|mapping| *mapping != "uv") {
            let what = format!("the mapping `{}` as `uv`", shown(mapping));
            let at = parameters.get("mapping").map(|parameter| parameter.at.place());
            self.scene.report.say(crate::import::Fate::Approximated, at, what);
        }
        let pair = |a: &str, b: &str, default: f64| -> Result<[f64; 2]> {
            Ok([parameters.number(a)?.unwrap_or(default), parameters.number(b)?.unwrap_or(default)])
        };
        Ok((pair("uscale", "vscale", 1.0)?, pair("udelta", "vdelta", 0.0)?))
    }

    fn image(&mut self, parameters: &Parameters, of: Of, at: &super::token::At) -> Result<Colour> {
        let name = parameters.text("filename")?.ok_or_else(|| at.problem("`imagemap` has no `filename`"))?;
        let path = at.file(name)?;
        let mut picture = Picture::read(&path).map_err(|problem| super::beside(at, &problem))?;
        match parameters.text("encoding")?.unwrap_or("sRGB") {
            "sRGB" => {}
            "linear" => picture = picture.raw(),
            other => {
                let gamma = other.strip_prefix("gamma ").and_then(|gamma| gamma.trim().parse::<f64>().ok());
                let gamma = gamma.ok_or_else(|| at.problem(format!("the encoding `{}` is unknown", shown(other))))?;
                picture = picture.raw().map(&|v| v.max(0.0).powf(gamma));
            }
        }
        let scale = parameters.number("scale")?.unwrap_or(1.0);
        if parameters.boolean("invert", false)? {
            picture = picture.map(&|v| (1.0 - v).max(0.0));
        }
        if scale != 1.0 {
            picture = picture.map(&|v| v * scale);
        }
        if of == Of::Albedo && picture.linear().iter().flatten().any(|v| !(0.0..=1.0).contains(v)) {
            self.scene.report.approximated(at.place(), "texels of a reflectance beyond 1, which are 1");
            picture = picture.map(&|v| v.clamp(0.0, 1.0));
        }
        if parameters.text("wrap")?.is_some_and(|wrap| wrap != "repeat") {
            self.scene.report.approximated(at.place(), "a texture that does not repeat as one that does");
        }
        let nearest = parameters.text("filter")? == Some("point");
        parameters.get("maxanisotropy");
        let (scale, offset) = self.placement(parameters)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Colour::Texture(Rc::new(Texture { picture, name, endmembers: None, nearest, scale, offset, file: None })))
    }
}
