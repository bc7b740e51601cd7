//! BSDFs as materials.

use super::colour::Of;
use super::values::{self, Plugin, place};
use super::xml::Node;
use super::{Importer, principled};
use crate::Result;
use crate::import::layers;
use crate::import::metals;
use crate::import::picture::{Colour, Rough, grey};
use crate::import::report::Deviation;
use crate::import::scene::Section;
use crate::import::surfaces::{self, Coat};
use crate::import::text;
use crate::spectral::Curve;

/// What a BSDF became.
#[derive(Debug, Clone, PartialEq)]
pub enum Made {
    /// A material of this name.
    Material { name: String, is_textured: bool },
    /// Nothing: rays pass.
    Nothing,
}

/// Adapters around a BSDF.
#[derive(Debug, Clone, Default)]
struct Around {
    two_sided: bool,
    opacity: Option<String>,
    is_textured: bool,
}

/// BSDFs within BSDFs.
const DEEPEST: usize = 16;

impl<'n> Importer<'n, '_> {
    /// The material of the BSDF that a shape has, or that of a shape without one; `flip`: whether the shape's v runs down.
    pub fn material_of(&mut self, shape: &Plugin<'n>, flip: bool) -> Result<Made> {
        let named = shape.get("bsdf").map(|node| vec![node]);
        let nodes = named.unwrap_or_else(|| shape.objects(&["bsdf"]));
        let refs = shape.objects(&["ref"]);
        for node in nodes.into_iter().chain(refs) {
            let resolved = self.resolve(node)?;
            if resolved.tag == "bsdf" {
                return self.material(resolved, flip);
            }
            self.scene.report.left_out(place(node), format!("the {} of a shape", resolved.tag));
        }
        self.default_material()
    }

    fn default_material(&mut self) -> Result<Made> {
        const NAME: &str = "default";
        if !self.scene.materials.iter().any(|section| section.header == "[materials.default.diffuse]") {
            let name = self.scene.material_name(NAME);
            let section = self.scene.material(&name, "diffuse").comment("of shapes that have none in Mitsuba");
            self.scene.materials.push(section.with("reflectance", "0.5").with("two_sided", "false"));
        }
        Ok(Made::Material { name: NAME.to_owned(), is_textured: false })
    }

    pub fn material(&mut self, node: &'n Node, flip: bool) -> Result<Made> {
        // One without textures is the same for all.
        for key in [(std::ptr::from_ref(node), flip), (std::ptr::from_ref(node), !flip)] {
            match self.materials.get(&key) {
                Some(made @ Made::Material { is_textured, .. }) if key.1 == flip || !is_textured => {
                    return Ok(made.clone());
                }
                Some(Made::Nothing) => return Ok(Made::Nothing),
                _ => {}
            }
        }
        let name = self.name_of(node);
        let made = self.made(node, &name, Around::default(), flip, 0)?;
        self.materials.insert((std::ptr::from_ref(node), flip), made.clone());
        Ok(made)
    }

    fn made(&mut self, node: &'n Node, name: &str, mut around: Around, flip: bool, depth: usize) -> Result<Made> {
        if depth > DEEPEST {
            return Err(node.problem("has BSDFs within more than 16 others").into());
        }
        let plugin = Plugin::new(node);
        let kind = plugin.kind();
        let inner = |importer: &Self| -> Result<Vec<&'n Node>> {
            let nodes = plugin.objects(&["bsdf", "ref"]);
            nodes
                .into_iter()
                .map(|node| Ok(importer.resolve(node)?))
                .filter(|n: &Result<&Node>| n.as_ref().map_or(true, |n| n.tag == "bsdf"))
                .collect()
        };
        let made = match kind {
            "twosided" | "mask" | "bumpmap" | "normalmap" => {
                if kind == "mask" {
                    let opacity = self.share(&plugin, "opacity", 0.5, flip)?;
                    around.is_textured |= opacity.starts_with('{');
                    around.opacity = Some(opacity);
                } else if kind != "twosided" {
                    self.scene.report.left_out(plugin.place(), format!("the `{kind}`: its surface is smooth"));
                    plugin.objects(&["texture"]);
                }
                let all = inner(self)?;
                let Some(first) = all.first() else { return Err(node.problem(format!("`{kind}` has no BSDF")).into()) };
                around.two_sided |= kind == "twosided";
                if all.len() > 1 {
                    self.scene
                        .report
                        .left_out(plugin.place(), "the second BSDF of a `twosided`: both sides have the first");
                }
                self.made(first, name, around, flip, depth + 1)?
            }
            "null" => Made::Nothing,
            "blendbsdf" => {
                let weight = self.share(&plugin, "weight", 0.5, flip)?;
                around.is_textured |= weight.starts_with('{');
                let [a, b] = inner(self)?[..] else { return Err(node.problem("`blendbsdf` needs two BSDFs").into()) };
                let part = |importer: &mut Self, node: &'n Node| {
                    let around = Around { two_sided: around.two_sided, ..Around::default() };
                    let name = importer.name_of(node);
                    importer.made(node, &name, around, flip, depth + 1)
                };
                let parts = [part(self, a)?, part(self, b)?];
                self.blend(&plugin, name, parts, &weight, around)?
            }
            _ => self.surface(&plugin, name, around, flip)?,
        };
        plugin.finish(&mut self.scene.report);
        self.scene.report.translated(format!("bsdf `{}`", values::shown(kind)), plugin.place());
        Ok(made)
    }

    fn blend(
        &mut self,
        plugin: &Plugin<'n>,
        name: &str,
        parts: [Made; 2],
        weight: &str,
        around: Around,
    ) -> Result<Made> {
        let names = match &parts {
            [Made::Material { name: a, is_textured: x }, Made::Material { name: b, is_textured: y }] => {
                Some((a, b, *x || *y))
            }
            // What lets rays pass is opacity.
            [Made::Material { name, .. }, Made::Nothing] | [Made::Nothing, Made::Material { name, .. }] => {
                self.scene.report.left_out(plugin.place(), "the blend with a `null` BSDF: only the other one is there");
                return Ok(Made::Material { name: name.clone(), is_textured: around.is_textured });
            }
            [Made::Nothing, Made::Nothing] => return Ok(Made::Nothing),
        };
        let Some((a, b, textured)) = names else { return Ok(Made::Nothing) };
        let section = Section::default().with("a", text::quoted(a)).with("b", text::quoted(b)).with("weight", weight);
        let around = Around { is_textured: around.is_textured || textured, ..around };
        Ok(self.put(name, "blend", section, &around, false))
    }

    /// Adds a material, with what is around it.
    fn put(&mut self, name: &str, kind: &str, mut section: Section, around: &Around, has_sides: bool) -> Made {
        let name = self.scene.material_name(name);
        section.header = format!("[materials.{}.{kind}]", text::key(&name));
        if has_sides && !around.two_sided {
            section.set("two_sided", "false");
        }
        if let Some(opacity) = &around.opacity {
            section.set("opacity", opacity.clone());
        }
        self.scene.materials.push(section);
        Made::Material { name, is_textured: around.is_textured }
    }

    fn surface(&mut self, plugin: &Plugin<'n>, name: &str, mut around: Around, flip: bool) -> Result<Made> {
        let section = Section::default();
        match plugin.kind() {
            "diffuse" => {
                let colour = self.colour(plugin, "reflectance", Of::Reflectance, flip)?.unwrap_or(Colour::grey(0.5));
                around.is_textured |= colour.is_texture();
                if colour.is_black() {
                    return Ok(self.put(name, "black", section, &around, true));
                }
                let reflectance = colour.toml(self.scene, name)?;
                Ok(self.put(name, "diffuse", section.with("reflectance", reflectance), &around, true))
            }
            "difftrans" => {
                let mut colour = |name: &str| -> Result<Colour> {
                    Ok(self.colour(plugin, name, Of::Reflectance, flip)?.unwrap_or(Colour::grey(0.5)))
                };
                let both = [colour("reflectance")?, colour("transmittance")?];
                let both = surfaces::within_one(both, &mut self.scene.report, plugin.place());
                let mut section = section;
                for (key, colour) in ["reflectance", "transmittance"].into_iter().zip(both) {
                    around.is_textured |= colour.is_texture();
                    section.set(key, colour.toml(self.scene, &format!("{name}-{key}"))?);
                }
                Ok(self.put(name, "diffuse", section, &around, false))
            }
            "conductor" | "roughconductor" => self.conductor(plugin, name, around, flip),
            "dielectric" | "roughdielectric" => self.dielectric(plugin, name, around, flip),
            "thindielectric" => self.thin(plugin, name, around),
            "plastic" | "roughplastic" => self.plastic(plugin, name, around, flip),
            "principled" | "principledthin" => {
                principled::principled(self, plugin, name, around.two_sided, around.opacity, flip)
            }
            other => {
                let what = format!("the BSDF `{}` as a diffuse grey of 0.5", values::shown(other));
                let off = Deviation::at_most("0.5 of all light that arrives, and any other spread of it");
                self.scene.report.approximated(plugin.place(), what, off);
                Ok(self.put(name, "diffuse", section.with("reflectance", "0.5"), &around, true))
            }
        }
    }

    /// GGX's roughness, by one number, two, or a texture; Beckmann's is taken for it.
    fn roughness(&mut self, plugin: &Plugin<'n>, name: &str, flip: bool) -> Result<Option<Rough>> {
        if !plugin.kind().starts_with("rough") {
            return Ok(None);
        }
        if plugin.string("distribution")?.unwrap_or("beckmann") == "beckmann" {
            let what = "facets of Beckmann's distribution as GGX's of the same alpha";
            self.scene.report.approximated(plugin.place(), what, surfaces::beckmann());
        }
        plugin.boolean("sample_visible", true)?;
        if let Some(texture) = self.texture_of_numbers(plugin, "alpha", flip)? {
            return texture.rough(self.scene, ("alphas", plugin.place()), name, &grey, &|alpha| alpha).map(Some);
        }
        let alpha = self.mean_number(plugin, "alpha", 0.1)?;
        let (u, v) = (self.mean_number(plugin, "alpha_u", alpha)?, self.mean_number(plugin, "alpha_v", alpha)?);
        if [u, v].iter().any(|alpha| !(0.0..).contains(alpha)) {
            return Err(plugin.node.problem("`alpha` must be 0 or more").into());
        }
        let [u, v] = [u, v].map(|alpha| {
            if alpha > 1.0 {
                self.scene.report.approximated(plugin.place(), "an alpha above 1 as 1", surfaces::too_rough(alpha));
            }
            alpha.min(1.0)
        });
        Ok(Some(Rough::Pair([u, v])))
    }

    fn conductor(&mut self, plugin: &Plugin<'n>, name: &str, mut around: Around, flip: bool) -> Result<Made> {
        let roughness = self.roughness(plugin, name, flip)?;
        // Beckmann's facets hide less from each other: GGX's with what they send on are nearer to them.
        let is_beckmann = plugin.string("distribution")?.unwrap_or("beckmann") == "beckmann";
        let named = plugin.string("material")?;
        let given = [self.index(plugin, "eta", flip)?, self.index(plugin, "k", flip)?];
        let [eta, k] = match (named, given) {
            (Some("none"), _) => {
                // A mirror: reflects all but 1e-5.
                [Curve::Constant(0.01), Curve::Constant(100.0)]
            }
            (_, [Some(eta), Some(k)]) => [eta, k],
            (Some(metal), _) => metals::metal(metal).ok_or_else(|| {
                let known = metals::names().join(", ");
                plugin.node.problem(format!("the metal `{}` is not known; known are {known}", values::shown(metal)))
            })?,
            // As Mitsuba has it without either.
            (None, [eta, k]) => [eta.unwrap_or(Curve::Constant(0.0)), k.unwrap_or(Curve::Constant(1.0))],
        };
        let outside = plugin.string("ext_eta")?;
        if outside.is_some() {
            self.scene.report.left_out(plugin.place(), "`ext_eta` of a conductor");
        }
        // An index of 0 is none here.
        let positive = |curve: Curve| match curve {
            Curve::Constant(0.0) => Curve::Constant(1e-4),
            curve => curve,
        };
        let mut section = Section::default();
        let eta = positive(eta);
        section.set("eta", self.scene.spectrum(&eta, &format!("{name}-eta"))?);
        section.set("k", self.scene.spectrum(&k, &format!("{name}-k"))?);
        if let Some(rough) = roughness {
            // Which way u runs matters to brushed ones.
            let brushed = rough.brushed();
            around.is_textured |= brushed.is_some() || rough.is_texture();
            section.set("roughness", brushed.map(text::list).or_else(|| rough.even()).unwrap_or_else(|| "0.0".into()));
            if !is_beckmann {
                section.set("energy_compensation", "false");
            }
        }
        let Some(specular) = self.colour(plugin, "specular_reflectance", Of::Reflectance, flip)? else {
            return Ok(self.put(name, "conductor", section, &around, true));
        };
        let mut factor = specular.mean();
        if specular.is_texture() {
            let what = "a `specular_reflectance` by a texture as its mean";
            self.scene.report.approximated(plugin.place(), what, specular.off_its_mean());
        }
        if !factor.is_constant() {
            let (tinted, largest, off) = layers::tinted(&[eta, k], &factor);
            let what = "a coloured `specular_reflectance` as a metal of that colour at normal incidence";
            self.scene.report.approximated(plugin.place(), what, off);
            for (key, curve) in ["eta", "k"].into_iter().zip(&tinted) {
                let written = self.scene.spectrum(curve, &format!("{name}-tinted-{key}"))?;
                section
                    .entries
                    .iter_mut()
                    .filter(|(own, _)| own == key)
                    .for_each(|(_, value)| value.clone_from(&written));
            }
            factor = Curve::Constant(largest);
        }
        self.dimmed(name, "conductor", section, factor.eval(550.0), around)
    }

    /// A material times a factor: a blend with black.
    fn dimmed(&mut self, name: &str, kind: &str, section: Section, mean: f64, around: Around) -> Result<Made> {
        if (mean - 1.0).abs() < 1e-6 {
            return Ok(self.put(name, kind, section, &around, true));
        }
        let inner = Around { opacity: None, ..around.clone() };
        let Made::Material { name: bright, .. } = self.put(&format!("{name}-bright"), kind, section, &inner, true)
        else {
            return Ok(Made::Nothing);
        };
        let Made::Material { name: dark, .. } =
            self.put(&format!("{name}-dark"), "black", Section::default(), &inner, true)
        else {
            return Ok(Made::Nothing);
        };
        let blend = Section::default().comment(format!("times {}", text::rounded(mean)));
        let blend = blend.with("a", text::quoted(&bright)).with("b", text::quoted(&dark));
        let blend = blend.with("weight", text::rounded(1.0 - mean));
        Ok(self.put(name, "blend", blend, &around, false))
    }

    /// An index of refraction by its spectrum, if it is given.
    fn index(&mut self, plugin: &Plugin<'n>, name: &str, flip: bool) -> Result<Option<Curve>> {
        let Some(colour) = self.colour(plugin, name, Of::Unbounded, flip)? else { return Ok(None) };
        if colour.is_texture() {
            let off = colour.off_its_mean();
            self.scene.report.approximated(plugin.place(), format!("`{name}` by a texture as its mean"), off);
        }
        Ok(Some(colour.mean()))
    }

    /// An index inside over that outside, each a number or the name of what is there.
    pub fn relative_index(&mut self, plugin: &Plugin<'n>, default: &str) -> Result<f64> {
        let of = |name: &str, default: &str| -> Result<f64> {
            let Some(node) = plugin.get(name) else { return Ok(metals::matter(default).unwrap_or(1.5)) };
            let text = values::value(node)?;
            if node.tag == "string" {
                return Ok(metals::matter(text.trim()).ok_or_else(|| {
                    let known = metals::matters().join(", ");
                    node.problem(format!("`{}` is not known; known are {known}", values::shown(text)))
                })?);
            }
            let number = text.trim().parse::<f64>().ok().filter(|x| *x > 0.0 && x.is_finite());
            Ok(number.ok_or_else(|| node.problem(format!("`{name}` must be a number above 0")))?)
        };
        let eta = of("int_ior", default)? / of("ext_ior", "air")?;
        match plugin.get("eta") {
            Some(node) => Ok(values::value(node)?.trim().parse().unwrap_or(eta)),
            None => Ok(eta),
        }
    }

    fn dielectric(&mut self, plugin: &Plugin<'n>, name: &str, mut around: Around, flip: bool) -> Result<Made> {
        let roughness = self.roughness(plugin, name, flip)?;
        let eta = self.relative_index(plugin, "bk7")?;
        let mut section = Section::default().with("eta", text::rounded(eta));
        if let Some(rough) = roughness {
            if let Rough::Pair(both @ [u, v]) = rough
                && u != v
            {
                let what = "two roughnesses of a dielectric as their geometric mean";
                self.scene.report.approximated(plugin.place(), what, surfaces::unbrushed(both));
            }
            around.is_textured |= rough.is_texture();
            section.set("roughness", rough.even().unwrap_or_else(|| "0.0".into()));
        }
        for factor in ["specular_reflectance", "specular_transmittance"] {
            if let Some(colour) = self.colour(plugin, factor, Of::Reflectance, flip)?
                && !matches!(colour.mean(), Curve::Constant(1.0))
            {
                self.scene.report.left_out(plugin.place(), format!("`{factor}` of a dielectric"));
            }
        }
        Ok(self.put(name, "dielectric", section, &around, false))
    }

    /// A pane: what is reflected at normal incidence, to and fro, is a mirror's share; the rest passes.
    fn thin(&mut self, plugin: &Plugin<'n>, name: &str, around: Around) -> Result<Made> {
        let eta = self.relative_index(plugin, "bk7")?;
        let (share, off) = surfaces::pane(eta);
        let what = "a `thindielectric` as a mirror of the opacity that it has at normal incidence";
        self.scene.report.approximated(plugin.place(), what, off);
        let section = Section::default().comment("a pane").with("eta", "0.01").with("k", "100.0");
        let around = Around { opacity: Some(text::rounded(share)), two_sided: true, ..around };
        Ok(self.put(name, "conductor", section, &around, true))
    }

    fn plastic(&mut self, plugin: &Plugin<'n>, name: &str, mut around: Around, flip: bool) -> Result<Made> {
        let roughness = self.roughness(plugin, name, flip)?;
        let eta = self.relative_index(plugin, "polypropylene")?;
        let colour = self.colour(plugin, "diffuse_reflectance", Of::Reflectance, flip)?.unwrap_or(Colour::grey(0.5));
        around.is_textured |= colour.is_texture();
        let nonlinear = plugin.boolean("nonlinear", false)?;
        let specular = self.colour(plugin, "specular_reflectance", Of::Reflectance, flip)?;
        if specular.is_some_and(|colour| !matches!(colour.mean(), Curve::Constant(1.0))) {
            self.scene.report.left_out(plugin.place(), "`specular_reflectance` of a plastic");
        }
        let what =
            "a plastic as diffuse matter under a coat, whose light below the coat is that of Spectile's own tables";
        self.scene.report.approximated(plugin.place(), what, Deviation::measured(surfaces::PLASTIC));
        let mut section = Section::default();
        let eta = self.scene.report.within(plugin.place(), "the relative index of a plastic", eta, [1.0, 1000.0]);
        let coat = Coat::new(eta, roughness.as_ref().map_or(0.0, Rough::mean));
        // What no coat changes stays as it is written.
        let colour = match roughness.is_none() && nonlinear {
            true => colour,
            false => coat.under(&colour, |rho| coat.scattered(rho, !nonlinear)).0,
        };
        section.set("reflectance", colour.toml(self.scene, name)?);
        section.set("eta", text::rounded(eta));
        if let Some(rough) = roughness {
            around.is_textured |= rough.is_texture();
            section.set("roughness", rough.even().unwrap_or_else(|| "0.0".into()));
        }
        Ok(self.put(name, "plastic", section, &around, true))
    }

    /// Adds a material that another file made.
    pub fn put_made(
        &mut self,
        name: &str,
        kind: &str,
        section: Section,
        two_sided: bool,
        opacity: Option<String>,
        is_textured: bool,
    ) -> Made {
        let has_sides = !["blend", "dielectric"].contains(&kind);
        self.put(name, kind, section, &Around { two_sided, opacity, is_textured }, has_sides)
    }
}
