//! Spectra and textures of pbrt.

use std::rc::Rc;

use super::Importer;
use super::token::{Parameter, Parameters, shown};
use crate::Result;
use crate::format::primaries::{self, White};
use crate::format::text as spectra;
use crate::import::combine;
use crate::import::metals;
use crate::import::picture::{Colour, Picture, Texels, Texture, Wrap, sampled, unbounded};
use crate::import::report::Deviation;
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
                let rgb = self.in_srgb([r, g, b], of);
                let (low, high) = rgb.into_iter().fold((0.0, 1.0), |(low, high), v: f64| (v.min(low), v.max(high)));
                if low < 0.0 {
                    let what = format!("`{}` with negative values, which are 0", shown(&parameter.name));
                    self.scene.report.approximated(at.place(), what, Deviation::at_most(text::up(-low)));
                }
                if of == Of::Albedo && high > 1.0 {
                    let off = Deviation::at_most(text::up(high - 1.0));
                    self.scene.report.approximated(at.place(), "a reflectance above 1, which is 1", off);
                }
                self.rgb(rgb, of)
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
        if of == Of::Albedo
            && let Some(beyond) = largest.map(|value| value - 1.0).filter(|beyond| *beyond > 0.0)
        {
            let off = Deviation::at_most(text::up(beyond));
            self.scene.report.approximated(at.place(), "a reflectance above 1, which is 1", off);
            return Ok(colour.map(|v| v.min(1.0)));
        }
        Ok(colour)
    }

    /// RGB of the colour space of now as sRGB's. Of a reflectance white stays white, of a light its colour stays.
    fn in_srgb(&self, rgb: [f64; 3], of: Of) -> [f64; 3] {
        let white = if of == Of::Light { White::Kept } else { White::Adapted };
        let matrix = self.state.space.filter(|_| of != Of::Index).and_then(|space| space.to_srgb(white));
        matrix.map_or(rgb, |matrix| primaries::apply(&matrix, rgb))
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
            "illum-acesD60" => return self.illuminant("D60", at, name),
            _ if name.starts_with("stdillum-") => return self.illuminant(&name["stdillum-".len()..], at, name),
            _ => {}
        }
        let path = at.file(name)?;
        let table = spectra::read_spectrum(&path, spectra::Column::Only, None)
            .map_err(|problem| super::beside(at, &problem))?;
        self.table(table.nm, table.value, of, parameter)
    }

    fn illuminant(&mut self, of_cie: &str, at: &super::token::At, name: &str) -> Result<Colour> {
        let curve = metals::illuminant(of_cie)
            .ok_or_else(|| at.problem(format!("the light \"{}\" is not known", shown(name))))?;
        let luminance = luminance(&curve);
        Ok(Colour::Spectrum(curve.scaled(1.0 / luminance), None))
    }

    /// A number, or the mean of a texture.
    pub fn mean_number(&mut self, parameters: &Parameters, name: &str) -> Result<Option<f64>> {
        let Some(parameter) = parameters.get(name) else { return Ok(None) };
        match self.colour_of(parameter, Of::Index)? {
            Colour::Texture(texture) => {
                let what = format!("`{name}` by a texture as its mean");
                self.scene.report.approximated(parameter.at.place(), what, texture.off_its_mean());
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
                        let product = |v: &[[f64; 3]]| [0, 1, 2].map(|c| v[0][c] * v[1][c]);
                        self.combined(&[&tex, &scale], name, at, &product, &|v| v[0] * v[1])
                    }
                }
            }
            "mix" => {
                let amount = match parameters.get("amount") {
                    Some(amount) => self.colour_of(amount, Of::Index)?,
                    None => Colour::grey(0.5),
                };
                let (a, b) = (part(self, "tex1", 0.0)?, part(self, "tex2", 1.0)?);
                let mixed = |v: &[[f64; 3]]| [0, 1, 2].map(|c| v[0][c] + v[2][c] * (v[1][c] - v[0][c]));
                self.combined(&[&a, &b, &amount], name, at, &mixed, &|v| v[0] + v[2] * (v[1] - v[0]))
            }
            "bilerp" => {
                // Between the centres of four texels, all of a surface.
                let mut corner =
                    |key: &str, default: f64| part(self, key, default).map(|colour| combine::rgb_of(&colour.mean()));
                let [low, high, right, both] =
                    [corner("v00", 0.0)?, corner("v01", 1.0)?, corner("v10", 0.0)?, corner("v11", 1.0)?];
                let texels = [high, both, low, right].map(|rgb| rgb.map(|v| v as f32)).to_vec();
                let (scale, offset) = self.placement(parameters)?;
                let half = |v: [f64; 2], more: f64| v.map(|v| 0.5 * v + more);
                let texture = Texture {
                    picture: Picture { size: [2, 2], texels: Texels::Floats(texels) },
                    name: name.to_owned(),
                    endmembers: None,
                    nearest: false,
                    scale: half(scale, 0.0),
                    offset: half(offset, 0.25),
                    file: None,
                };
                if [0, 1].iter().any(|i| scale[*i] + offset[*i] > 1.0 || offset[*i] < 0.0) {
                    let what = "a `bilerp` as one that comes back beyond coordinates from 0 to 1";
                    self.scene.report.approximated(at.place(), what, texture.off_elsewhere("there"));
                }
                Colour::Texture(Rc::new(texture))
            }
            "checkerboard" => {
                let two = [part(self, "tex1", 1.0)?, part(self, "tex2", 0.0)?];
                let of_textures = two.iter().any(Colour::is_texture).then(|| two.clone());
                let two = two.map(|colour| if colour.is_texture() { Colour::grey(0.5) } else { colour });
                let (a, b) = ([255, 0, 0], [0, 255, 0]);
                // Fields are a unit wide, and the lower left one is the first.
                let picture = Picture { size: [2, 2], texels: Texels::Bytes(vec![b, a, a, b]) };
                let (scale, offset) = self.placement(parameters)?;
                let half = |v: [f64; 2]| v.map(|v| 0.5 * v);
                let name = "checkerboard.png".to_owned();
                let endmembers = Some(Box::new(two));
                let (scale, offset) = (half(scale), half(offset));
                let fields = Texture { picture, name, endmembers, nearest: true, scale, offset, file: None };
                if parameters.number("dimension")?.is_some_and(|dimension| dimension != 2.0) {
                    let off = fields.off_elsewhere("wherever the two patterns differ");
                    self.scene.report.approximated(at.place(), "a checkerboard in space as one on the surface", off);
                }
                match of_textures {
                    None => Colour::Texture(Rc::new(fields)),
                    Some([a, b]) => {
                        let ends = Some(Box::new([1.0, 0.0].map(Colour::grey)));
                        let first = Colour::Texture(Rc::new(Texture { endmembers: ends, ..fields }));
                        let chosen = |v: &[[f64; 3]]| if v[2][0] > 0.5 { v[0] } else { v[1] };
                        self.combined(&[&a, &b, &first], "checkerboard", at, &chosen, &|v| 0.5 * (v[0] + v[1]))
                    }
                }
            }
            "imagemap" => self.image(parameters, of, at)?,
            other => {
                let what = format!("the texture `{}` as 0.5", shown(other));
                let off = match of {
                    Of::Albedo => Deviation::at_most("0.5 of reflectance"),
                    _ => Deviation::unbounded("its values may be any"),
                };
                self.scene.report.approximated(at.place(), what, off);
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
            let off =
                Deviation::unbounded("the picture is the same and lies elsewhere, in another size, on the surface");
            self.scene.report.approximated(at, what, off);
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
        if of == Of::Albedo
            && let Some(off) = picture.beyond_one()
        {
            self.scene.report.approximated(at.place(), "texels of a reflectance beyond 1, which are 1", off);
            picture = picture.map(&|v| v.clamp(0.0, 1.0));
        }
        let wrap = match parameters.text("wrap")?.unwrap_or("repeat") {
            "repeat" => Wrap::Repeat,
            "clamp" => Wrap::Clamp,
            "black" => Wrap::Nothing,
            other => return Err(at.problem(format!("the wrap mode `{}` is unknown", shown(other))).into()),
        };
        let nearest = parameters.text("filter")? == Some("point");
        parameters.get("maxanisotropy");
        let (scale, offset) = self.placement(parameters)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let texture = Texture { picture, name, endmembers: None, nearest, scale, offset, file: None };
        let (texture, off) = texture.wrapped([wrap; 2]);
        if let Some(off) = off {
            let what = "a texture that does not repeat as one that does, beyond coordinates of the surface from 0 to 1";
            self.scene.report.approximated(at.place(), what, off);
        }
        Ok(Colour::Texture(Rc::new(texture)))
    }

    /// A texture, or spectrum, of `f` of others at each place: of their linear RGB, or, where they are spectra alone, of those.
    fn combined(
        &mut self,
        colours: &[&Colour],
        name: &str,
        at: &super::token::At,
        f: &dyn Fn(&[[f64; 3]]) -> [f64; 3],
        of_numbers: &dyn Fn(&[f64]) -> f64,
    ) -> Colour {
        let means: Vec<Curve> = colours.iter().map(|colour| colour.mean()).collect();
        let of_means = || {
            let at = |nm: f64| of_numbers(&means.iter().map(|mean| mean.eval(nm)).collect::<Vec<f64>>());
            match means.iter().all(Curve::is_constant) {
                true => Colour::grey(at(550.0)),
                false => Colour::Spectrum(sampled(&at), None),
            }
        };
        if !colours.iter().any(|colour| colour.is_texture()) {
            return of_means();
        }
        match combine::combined(colours, name, f) {
            Some((made, None)) => made,
            Some((made, Some(off))) => {
                self.scene.report.approximated(at.place(), "a texture of textures as one picture", off);
                made
            }
            None => {
                let widest = colours
                    .iter()
                    .filter_map(|colour| if let Colour::Texture(of) = colour { Some(of.range()) } else { None });
                let widest = widest.map(|[low, high]| high - low).fold(0.0, f64::max);
                let what = "textures of textures whose periods have nothing in common by their means";
                let off = Deviation::at_most(format!("{} for each of them, as their texels go", text::up(widest)));
                self.scene.report.approximated(at.place(), what, off);
                of_means()
            }
        }
    }
}
