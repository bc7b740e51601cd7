//! Materials of pbrt.

use std::rc::Rc;

use super::colour::Of;
use super::token::{At, Parameter, Parameters, shown};
use super::{Importer, Look};
use crate::Result;
use crate::import::picture::{Colour, Numbers, Rough, grey};
use crate::import::scene::Section;
use crate::import::{surfaces, text};
use crate::spectral::Curve;

impl Importer<'_> {
    /// A material of this kind under the name nearest to `name`.
    pub fn material(&mut self, name: &str, kind: &str, parameters: &Parameters, at: &At) -> Result<Look> {
        for unread in ["displacement", "normalmap"] {
            if parameters.get(unread).is_some() {
                self.scene.report.left_out(at.place(), format!("the `{unread}` of a material"));
            }
        }
        let look = match kind {
            "diffuse" => {
                let colour = self.colour(parameters, "reflectance", Of::Albedo)?.unwrap_or(Colour::grey(0.5));
                if colour.is_black() {
                    Look::Material { name: self.scene.put(name, "black", Section::default()), textured: false }
                } else {
                    let section = Section::default().with("reflectance", colour.toml(self.scene, name)?);
                    Look::Material { name: self.scene.put(name, "diffuse", section), textured: colour.is_texture() }
                }
            }
            "diffusetransmission" => {
                let scale = parameters.number("scale")?.unwrap_or(1.0);
                let (mut section, mut textured) = (Section::default(), false);
                let mut colour = |key: &str| -> Result<Colour> {
                    let colour = self.colour(parameters, key, Of::Albedo)?.unwrap_or(Colour::grey(0.25));
                    Ok(if scale == 1.0 { colour } else { colour.map(|v| v * scale) })
                };
                let both = [colour("reflectance")?, colour("transmittance")?];
                let both = surfaces::within_one(both, &mut self.scene.report, at.place());
                for (key, colour) in ["reflectance", "transmittance"].into_iter().zip(both) {
                    textured |= colour.is_texture();
                    section.set(key, colour.toml(self.scene, &format!("{name}-{key}"))?);
                }
                Look::Material { name: self.scene.put(name, "diffuse", section), textured }
            }
            "coateddiffuse" => {
                let colour = self.colour(parameters, "reflectance", Of::Albedo)?.unwrap_or(Colour::grey(0.5));
                let eta = self.index(parameters, "eta", 1.5)?;
                for unread in ["thickness", "g", "albedo", "maxdepth", "nsamples"] {
                    parameters.get(unread);
                }
                let what = "a `coateddiffuse` as Spectile's plastic: a coat without thickness, and nothing that scatters in it";
                self.scene.report.approximated(at.place(), what);
                let mut section = Section::default().with("reflectance", colour.toml(self.scene, name)?);
                section.set("eta", self.scene.spectrum(&eta, &format!("{name}-eta"))?);
                let textured = self.one_roughness(&mut section, name, parameters, at)? || colour.is_texture();
                Look::Material { name: self.scene.put(name, "plastic", section), textured }
            }
            "conductor" => self.conductor(name, "", parameters, at)?,
            "coatedconductor" => {
                for unread in [
                    "interface.roughness",
                    "interface.uroughness",
                    "interface.vroughness",
                    "interface.eta",
                    "thickness",
                    "g",
                    "albedo",
                    "maxdepth",
                    "nsamples",
                ] {
                    parameters.get(unread);
                }
                self.scene.report.approximated(at.place(), "a `coatedconductor` as its metal without the coat: by estimate up to 8 % darker or brighter, with one highlight of two");
                self.conductor(name, "conductor.", parameters, at)?
            }
            "dielectric" => {
                let eta = self.index(parameters, "eta", 1.5)?;
                let mut section = Section::default().with("eta", self.scene.spectrum(&eta, &format!("{name}-eta"))?);
                let textured = self.one_roughness(&mut section, name, parameters, at)?;
                Look::Material { name: self.scene.put(name, "dielectric", section), textured }
            }
            "thindielectric" => {
                let eta = self.index(parameters, "eta", 1.5)?.eval(550.0);
                let once = ((eta - 1.0) / (eta + 1.0)).powi(2);
                let what = "a `thindielectric` as a mirror of the opacity that it has at normal incidence: exact there, too clear at grazing angles";
                self.scene.report.approximated(at.place(), what);
                let section = Section::default().comment("a pane").with("eta", "0.01").with("k", "100.0");
                let section = section.with("opacity", text::rounded(2.0 * once / (1.0 + once)));
                Look::Material { name: self.scene.put(name, "conductor", section), textured: false }
            }
            "mix" => self.mix(name, parameters, at)?,
            "interface" | "" | "none" => Look::Nothing,
            other => {
                self.scene
                    .report
                    .approximated(at.place(), format!("the material `{}` as a diffuse grey of 0.5", shown(other)));
                parameters.ask_for_all();
                let section = Section::default().with("reflectance", "0.5");
                Look::Material { name: self.scene.put(name, "diffuse", section), textured: false }
            }
        };
        parameters.finish(&format!("the material `{}`", shown(kind)), &mut self.scene.report);
        self.scene.report.translated(format!("Material `{}`", shown(kind)), at.place());
        Ok(look)
    }

    fn index(&mut self, parameters: &Parameters, name: &str, default: f64) -> Result<Curve> {
        Ok(self.colour(parameters, name, Of::Index)?.map_or(Curve::Constant(default), |colour| colour.mean()))
    }

    /// GGX's alpha along u and v, or by a texture. Unless it is told not to, pbrt takes the square root of what is written.
    fn roughness(&mut self, name: &str, prefix: &str, parameters: &Parameters, at: &At) -> Result<Rough> {
        let remap = parameters.boolean("remaproughness", true)?;
        let alpha = |roughness: f64| if remap { roughness.sqrt() } else { roughness };
        let [both, u, v] = ["roughness", "uroughness", "vroughness"].map(|key| format!("{prefix}{key}"));
        if let (Some(parameter), None, None) = (parameters.get(&both), parameters.get(&u), parameters.get(&v))
            && let Colour::Texture(texture) = self.colour_of(parameter, Of::Index)?
        {
            return texture.rough(self.scene, ("roughnesses", at.place()), name, &grey, &alpha);
        }
        let both = self.mean_number(parameters, &both)?.unwrap_or(0.0);
        let pair =
            [self.mean_number(parameters, &u)?.unwrap_or(both), self.mean_number(parameters, &v)?.unwrap_or(both)];
        let within = |roughness| alpha(self.scene.report.within(at.place(), "a roughness", roughness, [0.0, 1.0]));
        Ok(Rough::Pair(pair.map(within)))
    }

    /// Whether it is a texture.
    fn one_roughness(&mut self, section: &mut Section, name: &str, parameters: &Parameters, at: &At) -> Result<bool> {
        let rough = self.roughness(name, "", parameters, at)?;
        if matches!(rough, Rough::Pair([u, v]) if u != v) {
            self.scene.report.approximated(at.place(), "two roughnesses of a coat or of glass as their geometric mean");
        }
        if let Some(alpha) = rough.even() {
            section.set("roughness", alpha);
        }
        Ok(rough.is_texture())
    }

    fn conductor(&mut self, name: &str, prefix: &str, parameters: &Parameters, at: &At) -> Result<Look> {
        let mut part = |key: &str| self.colour(parameters, &format!("{prefix}{key}"), Of::Index);
        let (eta, k) = (part("eta")?, part("k")?);
        let reflectance = self.colour(parameters, &format!("{prefix}reflectance"), Of::Albedo)?;
        let (eta, k) = match reflectance {
            // As pbrt makes an index of a colour: n = 1, k = 2 √r / √(1 - r).
            Some(colour) => {
                if colour.is_texture() {
                    self.scene.report.approximated(at.place(), "the colour of a metal by a texture as its mean");
                }
                let mean = Colour::Spectrum(colour.mean(), None);
                let k = mean.map(|r| 2.0 * (r.clamp(0.0, 0.9999) / (1.0 - r.clamp(0.0, 0.9999))).sqrt());
                (Curve::Constant(1.0), k.mean())
            }
            None => {
                let [copper_n, copper_k] =
                    crate::import::metals::metal("Cu").unwrap_or([Curve::Constant(0.5), Curve::Constant(2.6)]);
                (eta.map_or(copper_n, |eta| eta.mean()), k.map_or(copper_k, |k| k.mean()))
            }
        };
        let mut section = Section::default();
        section.set("eta", self.scene.spectrum(&eta, &format!("{name}-eta"))?);
        section.set("k", self.scene.spectrum(&k, &format!("{name}-k"))?);
        let rough = self.roughness(name, prefix, parameters, at)?;
        // Brushed metals need a direction on the surface.
        let brushed = rough.brushed();
        if let Some(alpha) = brushed.map(text::list).or_else(|| rough.even()) {
            section.set("roughness", alpha);
        }
        if !matches!(rough, Rough::Pair([u, v]) if u.max(v) < 1e-3) {
            section.set("energy_compensation", "false");
        }
        let textured = brushed.is_some() || rough.is_texture();
        Ok(Look::Material { name: self.scene.put(name, "conductor", section), textured })
    }

    /// A share in [0, 1], as text of the scene, and whether it is a texture: of one that many shapes have, a file.
    pub fn share(&mut self, parameter: &Parameter) -> Result<(String, bool)> {
        let at = parameter.at.place();
        let texture = match self.colour_of(parameter, Of::Index)? {
            Colour::Texture(texture) => texture,
            Colour::Spectrum(curve, _) => {
                let what = format!("`{}`", shown(&parameter.name));
                let share = self.scene.report.within(at, &what, curve.eval(550.0), [0.0, 1.0]);
                return Ok((text::rounded(share), false));
            }
        };
        if let Some((_, known)) = self.shares.iter().find(|(of, _)| Rc::ptr_eq(of, &texture)) {
            return Ok(known.clone());
        }
        let name = format!("{}-share", texture.name.split('.').next().unwrap_or_default());
        let made = match texture.numbers(self.scene, ("shares", at), &name, &grey, &|share| share)? {
            Numbers::One(value) => (text::rounded(value), false),
            Numbers::Texture(text, _) => (text, true),
        };
        self.shares.push((texture, made.clone()));
        Ok(made)
    }

    /// A material of which only a share is there.
    pub fn masked(&mut self, look: Look, opacity: (String, bool), at: &At) -> Look {
        let (opacity, is_texture) = opacity;
        match look {
            Look::Nothing => Look::Nothing,
            Look::Material { name, textured } => match self.scene.with_opacity(&name, &opacity) {
                Some(masked) => Look::Material { name: masked, textured: textured || is_texture },
                None => {
                    let what =
                        "the `alpha` of a shape whose material has an opacity of its own: it is there for all rays";
                    self.scene.report.left_out(at.place(), what);
                    Look::Material { name, textured }
                }
            },
        }
    }

    fn mix(&mut self, name: &str, parameters: &Parameters, at: &At) -> Result<Look> {
        let names = parameters.get("materials").map(|found| found.texts.clone()).unwrap_or_default();
        let [a, b] = &names[..] else { return Err(at.problem("a `mix` needs two names of `materials`").into()) };
        let look = |name: &String| -> Result<Look> {
            let found = self.named.get(name).cloned();
            Ok(found.ok_or_else(|| at.problem(format!("no material is named \"{}\"", shown(name))))?)
        };
        let (a, b) = (look(a)?, look(b)?);
        let (weight, mut textured) = match parameters.get("amount") {
            Some(amount) => self.share(amount)?,
            None => ("0.5".to_owned(), false),
        };
        let (Look::Material { name: first, textured: x }, Look::Material { name: second, textured: y }) = (&a, &b)
        else {
            self.scene.report.left_out(at.place(), "a `mix` with an `interface`: only the other material is there");
            return Ok(if matches!(a, Look::Nothing) { b } else { a });
        };
        textured |= *x || *y;
        let section = Section::default().with("a", text::quoted(first)).with("b", text::quoted(second));
        let section = section.with("weight", weight);
        Ok(Look::Material { name: self.scene.put(name, "blend", section), textured })
    }
}
