//! Materials of pbrt.

use std::rc::Rc;

use super::colour::Of;
use super::token::{At, Parameter, Parameters, shown};
use super::{Importer, Look};
use crate::Result;
use crate::import::layers::{self, Coated, Palette};
use crate::import::metals;
use crate::import::picture::{Colour, Numbers, Rough, Texture, grey};
use crate::import::report::Deviation;
use crate::import::scene::Section;
use crate::import::surfaces::{self, Coat};
use crate::import::text;
use crate::spectral::Curve;

/// What a metal is.
enum Metal {
    /// n and k.
    Index([Curve; 2]),
    /// Its reflectance at normal incidence.
    Texture(Rc<Texture>),
}

/// As pbrt makes an index of a colour: n = 1, k = 2 √r / √(1 - r).
fn index_of_colour(colour: &Curve) -> [Curve; 2] {
    let k = |r: f64| 2.0 * (r.clamp(0.0, 0.9999) / (1.0 - r.clamp(0.0, 0.9999))).sqrt();
    [Curve::Constant(1.0), Colour::Spectrum(colour.clone(), None).map(k).mean()]
}

/// A metal but for its index, and whether it needs coordinates.
fn rough_metal(rough: &Rough) -> (Section, bool) {
    let mut section = Section::default();
    // Brushed metals need a direction on the surface.
    let brushed = rough.brushed();
    if let Some(alpha) = brushed.map(text::list).or_else(|| rough.even()) {
        section.set("roughness", alpha);
    }
    if !matches!(rough, Rough::Pair([u, v]) if u.max(*v) < 1e-3) {
        section.set("energy_compensation", "false");
    }
    (section, brushed.is_some() || rough.is_texture())
}

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
                self.scene.report.approximated(at.place(), what, Deviation::measured(surfaces::COATED_DIFFUSE));
                let mut section = Section::default();
                section.set("eta", self.scene.spectrum(&eta, &format!("{name}-eta"))?);
                let rough = self.one_roughness(&mut section, name, parameters, at)?;
                let textured = rough.is_texture() || colour.is_texture();
                // Under a smooth coat the base is what it is.
                let colour = match rough.mean() >= 1e-3 {
                    true => {
                        let coat = Coat::new(eta.eval(550.0).clamp(1.0, 1000.0), rough.mean());
                        coat.under(&colour, |rho| coat.scattered(rho, false)).0
                    }
                    false => colour,
                };
                section.entries.insert(0, ("reflectance".to_owned(), colour.toml(self.scene, name)?));
                Look::Material { name: self.scene.put(name, "plastic", section), textured }
            }
            "conductor" => self.conductor(name, parameters, at)?,
            "coatedconductor" => self.coated_conductor(name, parameters, at)?,
            "dielectric" => {
                let eta = self.index(parameters, "eta", 1.5)?;
                let mut section = Section::default().with("eta", self.scene.spectrum(&eta, &format!("{name}-eta"))?);
                let textured = self.one_roughness(&mut section, name, parameters, at)?.is_texture();
                Look::Material { name: self.scene.put(name, "dielectric", section), textured }
            }
            "thindielectric" => {
                let eta = self.index(parameters, "eta", 1.5)?.eval(550.0);
                let (share, off) = surfaces::pane(eta);
                let what = "a `thindielectric` as a mirror of the opacity that it has at normal incidence";
                self.scene.report.approximated(at.place(), what, off);
                let section = Section::default().comment("a pane").with("eta", "0.01").with("k", "100.0");
                let section = section.with("opacity", text::rounded(share));
                Look::Material { name: self.scene.put(name, "conductor", section), textured: false }
            }
            "mix" => self.mix(name, parameters, at)?,
            "interface" | "" | "none" => Look::Nothing,
            other => {
                let off = Deviation::at_most("0.5 of all light that arrives, and any other spread of it");
                let what = format!("the material `{}` as a diffuse grey of 0.5", shown(other));
                self.scene.report.approximated(at.place(), what, off);
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

    /// GGX's alpha along u and v, or by a texture, as it is `seen`. Unless it is told not to, pbrt takes the square root of what is written.
    fn roughness(
        &mut self,
        name: &str,
        prefix: &str,
        parameters: &Parameters,
        at: &At,
        seen: &dyn Fn(f64) -> f64,
    ) -> Result<Rough> {
        let remap = parameters.boolean("remaproughness", true)?;
        let alpha = |roughness: f64| seen(if remap { roughness.sqrt() } else { roughness });
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

    /// The one of what has no direction on its surface.
    fn one_roughness(&mut self, section: &mut Section, name: &str, parameters: &Parameters, at: &At) -> Result<Rough> {
        let rough = self.roughness(name, "", parameters, at, &|alpha| alpha)?;
        if let Rough::Pair(both @ [u, v]) = rough
            && u != v
        {
            let what = "two roughnesses of a coat or of glass as their geometric mean";
            self.scene.report.approximated(at.place(), what, surfaces::unbrushed(both));
        }
        if let Some(alpha) = rough.even() {
            section.set("roughness", alpha);
        }
        Ok(rough)
    }

    /// What a metal is by `eta` and `k`, those of copper where there are none, or by its colour.
    fn metal(&mut self, prefix: &str, parameters: &Parameters, at: &At) -> Result<Metal> {
        let mut part = |key: &str| -> Result<Option<Curve>> {
            let Some(colour) = self.colour(parameters, &format!("{prefix}{key}"), Of::Index)? else { return Ok(None) };
            if colour.is_texture() {
                let what = format!("`{prefix}{key}` by a texture as its mean");
                self.scene.report.approximated(at.place(), what, colour.off_its_mean());
            }
            Ok(Some(colour.mean()))
        };
        let (eta, k) = (part("eta")?, part("k")?);
        Ok(match self.colour(parameters, &format!("{prefix}reflectance"), Of::Albedo)? {
            Some(Colour::Texture(texture)) => Metal::Texture(texture),
            Some(colour) => Metal::Index(index_of_colour(&colour.mean())),
            None => {
                let [copper_n, copper_k] = metals::metal("Cu").unwrap_or([Curve::Constant(0.5), Curve::Constant(2.6)]);
                Metal::Index([eta.unwrap_or(copper_n), k.unwrap_or(copper_k)])
            }
        })
    }

    fn conductor(&mut self, name: &str, parameters: &Parameters, at: &At) -> Result<Look> {
        let metal = self.metal("", parameters, at)?;
        let rough = self.roughness(name, "", parameters, at, &|alpha| alpha)?;
        let (section, textured) = rough_metal(&rough);
        let index = match metal {
            Metal::Index(index) => index,
            Metal::Texture(texture) => {
                let palette = Palette::of(&texture, &|_| true);
                self.scene.report.approximated(
                    at.place(),
                    "the colour of a metal by a texture as a mixture of metals",
                    palette.off.clone(),
                );
                let name = palette.write(self.scene, &texture, name, &index_of_colour, &section, &|section| section)?;
                return Ok(Look::Material { name, textured: true });
            }
        };
        let section = self.with_index(section, name, &index)?;
        Ok(Look::Material { name: self.scene.put(name, "conductor", section), textured })
    }

    fn with_index(&mut self, mut section: Section, name: &str, [eta, k]: &[Curve; 2]) -> Result<Section> {
        let (eta, k) =
            (self.scene.spectrum(eta, &format!("{name}-eta"))?, self.scene.spectrum(k, &format!("{name}-k"))?);
        section.entries.splice(0..0, [("eta".to_owned(), eta), ("k".to_owned(), k)]);
        Ok(section)
    }

    /// A metal under a coat: one metal where both are smooth, else one for each of the two highlights.
    fn coated_conductor(&mut self, name: &str, parameters: &Parameters, at: &At) -> Result<Look> {
        let coat = self.index(parameters, "interface.eta", 1.5)?;
        // Nothing in the coat scatters unless it has an albedo.
        if self.colour(parameters, "albedo", Of::Albedo)?.is_some_and(|colour| !colour.is_black()) {
            self.scene.report.left_out(at.place(), "`albedo` of a coat: nothing in it scatters");
        }
        for unread in ["thickness", "g", "maxdepth", "nsamples"] {
            parameters.get(unread);
        }
        let metal = match self.metal("conductor.", parameters, at)? {
            Metal::Index(index) => index,
            Metal::Texture(texture) => {
                let what = "the colour of a metal under a coat by a texture as its mean";
                self.scene.report.approximated(at.place(), what, texture.off_its_mean());
                index_of_colour(&Colour::Texture(texture).mean())
            }
        };
        let above = self.roughness(&format!("{name}-coat"), "interface.", parameters, at, &|alpha| alpha)?;
        let (eta, of_coat) = (coat.eval(550.0), above.mean());
        let below =
            self.roughness(name, "conductor.", parameters, at, &|alpha| layers::seen_through(alpha, eta, of_coat))?;
        let is_smooth = |rough: &Rough| matches!(rough, Rough::Pair([u, v]) if u.max(*v) < 1e-3);
        let Coated { metal, coat, off } = layers::coated(&coat, &metal, is_smooth(&above) && is_smooth(&below));
        self.scene.report.approximated(at.place(), "a `coatedconductor` as a metal that reflects as both", off);
        let (section, mut textured) = rough_metal(&below);
        let section = self.with_index(section, name, &metal)?;
        let Some((own, weight)) = coat else {
            return Ok(Look::Material { name: self.scene.put(name, "conductor", section), textured });
        };
        let seen = self.scene.put(&format!("{name}-metal"), "conductor", section);
        let (section, of_coat) = rough_metal(&above);
        textured |= of_coat;
        let section = self.with_index(section, &format!("{name}-coat"), &own)?;
        let above = self.scene.put(&format!("{name}-coat"), "conductor", section);
        let section = Section::default().with("a", text::quoted(&seen)).with("b", text::quoted(&above));
        let section = section.with("weight", text::rounded(weight));
        Ok(Look::Material { name: self.scene.put(name, "blend", section), textured })
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
