//! `[materials]`.

use super::blend::{Parts, check_blends};
use super::decode::{Fields, Item, did_you_mean, list};
use super::keys;
use super::spectrum::{Handle, Quantity, Spectra};
use super::texture::{self, Number, Textures, is_texture};
use super::translucent;
use super::tree::Value;
use super::{Bsdf, Material, MaterialId, Reflectance, Roughness, SMOOTH, Temperature, Texture, Weight};
use crate::format::unit;

/// K. The peak of Planck's radiance there is 4e33 W m⁻² sr⁻¹ nm⁻¹, near the end of f32.
const HOTTEST: f64 = 1e9;

const REFLECTANCE: &str = "reflectance = 0.5, or the name of a spectrum";
const ETA: &str = "eta = 1.5, or the name of a spectrum";

/// Why something cannot have a temperature.
const TRANSPARENT: &str = "absorbs nothing, so it emits nothing and has no temperature";
const ROUGH_BY_TEXTURE: &str = "has a roughness by texture, with which no temperature is supported yet";
const ONE_ROUGHNESS: &str = "remove it, or give one number for the roughness";

/// A material as the file defines it.
pub enum Kind<'a> {
    Diffuse { reflectance: Reflects },
    Translucent { reflectance: Reflects, transmittance: Reflects },
    Conductor { eta: Handle, k: Handle, roughness: Rough, energy_compensation: bool },
    Dielectric { eta: Handle, dispersion: bool, roughness: Rough },
    Plastic { reflectance: Reflects, eta: Handle, roughness: Rough },
    Blend { parts: Parts<'a>, weight: Varying },
    Black,
}

/// A reflectance, the same all over or textured.
#[derive(Clone, Copy)]
pub enum Reflects {
    Spectrum(Handle),
    Texture(texture::Handle),
}

/// GGX's α: along the tangent and across it, or by place.
#[derive(Clone, Copy)]
pub enum Rough {
    Constant([f64; 2]),
    Texture(texture::Handle),
}

/// A number that may differ over the surface: the share of a blend's second part, a temperature.
#[derive(Clone, Copy)]
pub enum Varying {
    Constant(f64),
    Texture(texture::Handle),
}

/// What a material asks of the surfaces that have it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Needs {
    /// Texture coordinates.
    pub uv: bool,
    /// A direction on the surface: the look depends on how it is turned about its normal.
    pub tangent: bool,
    /// The normal that light sees; nothing on black.
    pub normal: bool,
}

pub struct Declared<'a> {
    pub kind: Kind<'a>,
    two_sided: bool,
    temperature: Option<Varying>,
    opacity: Option<Varying>,
    taken: Option<MaterialId>,
}

/// The materials of the file, and those in use.
pub struct Materials<'a> {
    /// `None` where the definition is wrong, which has been said.
    declared: Vec<(&'a str, Option<Declared<'a>>)>,
    /// In the order of their first use, parts before their blend.
    scene: Vec<Material>,
    textures: Textures,
}

impl<'a> Materials<'a> {
    pub fn new(item: Option<Item<'a>>, spectra: &mut Spectra<'a>) -> Self {
        let items = item.as_ref().and_then(|item| item.named_items()).unwrap_or_default();
        let mut textures = Textures::default();
        let declared = items.iter().map(|(name, item)| (*name, decode(item, spectra, &mut textures))).collect();
        let mut materials = Materials { declared, scene: Vec::new(), textures };
        materials.look_up_parts();
        check_blends(&mut materials.declared);
        materials.check_temperatures(item.as_ref());
        materials
    }

    /// Whether the file defines `name`, rightly or wrongly.
    pub fn has(&self, name: &str) -> bool {
        self.position(name).is_some()
    }

    fn position(&self, name: &str) -> Option<usize> {
        self.declared.iter().position(|(known, _)| *known == name)
    }

    /// What to do about a name that does not exist.
    pub fn help(&self, name: &str) -> String {
        let names = self.declared.iter().map(|(name, _)| *name);
        did_you_mean(name, names.clone()).unwrap_or_else(|| match self.declared.len() {
            0 => format!("define it: [materials.{name}.diffuse]"),
            _ => format!("[materials] has {}", list(names)),
        })
    }

    /// The index of material `name` in the scene; `None` if it does not exist or is wrong.
    pub fn take(&mut self, name: &str, spectra: &mut Spectra) -> Option<MaterialId> {
        let index = self.position(name)?;
        self.take_declared(index, spectra)
    }

    /// Recursion ends: blends have no cycles and few parts.
    fn take_declared(&mut self, index: usize, spectra: &mut Spectra) -> Option<MaterialId> {
        let (name, declared) = &self.declared[index];
        let declared = declared.as_ref()?;
        if let Some(id) = declared.taken {
            return Some(id);
        }
        let (name, two_sided) = ((*name).to_owned(), declared.two_sided);
        let temperature = declared.temperature.map(|temperature| match temperature {
            Varying::Constant(kelvin) => Temperature::Constant(kelvin),
            Varying::Texture(handle) => Temperature::Texture(self.textures.take(handle, spectra)),
        });
        let opacity = declared.opacity.map(|opacity| match opacity {
            Varying::Constant(opacity) => Weight::Constant(opacity),
            Varying::Texture(handle) => Weight::Texture(self.textures.take(handle, spectra)),
        });
        let bsdf = match declared.kind {
            Kind::Diffuse { reflectance } => Bsdf::Diffuse { reflectance: self.take_reflectance(reflectance, spectra) },
            Kind::Translucent { reflectance, transmittance } => Bsdf::Translucent {
                reflectance: self.take_reflectance(reflectance, spectra),
                transmittance: self.take_reflectance(transmittance, spectra),
            },
            Kind::Conductor { eta, k, roughness, energy_compensation } => {
                let (eta, k, roughness) = (spectra.take(eta), spectra.take(k), self.take_roughness(roughness, spectra));
                Bsdf::Conductor { eta, k, roughness, energy_compensation }
            }
            Kind::Dielectric { eta, dispersion, roughness } => {
                let (eta, roughness) = (spectra.take(eta), self.take_roughness(roughness, spectra));
                Bsdf::Dielectric { eta, dispersion, roughness }
            }
            Kind::Plastic { reflectance, eta, roughness } => {
                let reflectance = self.take_reflectance(reflectance, spectra);
                let (eta, roughness) = (spectra.take(eta), self.take_roughness(roughness, spectra));
                Bsdf::Plastic { reflectance, eta, roughness }
            }
            Kind::Blend { ref parts, weight } => {
                let [a, b] = parts.indices?;
                let weight = match weight {
                    Varying::Constant(weight) => Weight::Constant(weight),
                    Varying::Texture(handle) => Weight::Texture(self.textures.take(handle, spectra)),
                };
                let (a, b) = (self.take_declared(a, spectra), self.take_declared(b, spectra));
                Bsdf::Blend { a: a?, b: b?, weight }
            }
            Kind::Black => Bsdf::Black,
        };
        self.scene.push(Material { name, bsdf, two_sided, temperature, opacity });
        let id = self.scene.len() - 1;
        if let Some(declared) = &mut self.declared[index].1 {
            declared.taken = Some(id);
        }
        Some(id)
    }

    fn take_reflectance(&mut self, reflectance: Reflects, spectra: &mut Spectra) -> Reflectance {
        match reflectance {
            Reflects::Spectrum(handle) => Reflectance::Spectrum(spectra.take(handle)),
            Reflects::Texture(handle) => Reflectance::Texture(self.textures.take(handle, spectra)),
        }
    }

    fn take_roughness(&mut self, roughness: Rough, spectra: &mut Spectra) -> Roughness {
        match roughness {
            Rough::Constant(alpha) => Roughness::Constant(alpha),
            Rough::Texture(handle) => Roughness::Texture(self.textures.take(handle, spectra)),
        }
    }

    /// The textures of the file, which emissions have too.
    pub fn textures(&mut self) -> &mut Textures {
        &mut self.textures
    }

    /// The name of a material of the scene.
    pub fn name(&self, id: MaterialId) -> &str {
        &self.scene[id].name
    }

    /// What a material of the scene asks of its surfaces.
    pub fn needs(&self, id: MaterialId) -> Needs {
        let textured =
            |reflectance| Needs { uv: matches!(reflectance, Reflectance::Texture(_)), tangent: false, normal: true };
        let material = &self.scene[id];
        let needs = match material.bsdf {
            Bsdf::Diffuse { reflectance } => textured(reflectance),
            Bsdf::Plastic { reflectance, roughness, .. } => {
                let needs = textured(reflectance);
                Needs { uv: needs.uv || matches!(roughness, Roughness::Texture(_)), ..needs }
            }
            Bsdf::Translucent { reflectance, transmittance } => {
                let (a, b) = (textured(reflectance), textured(transmittance));
                Needs { uv: a.uv || b.uv, ..a }
            }
            Bsdf::Conductor { roughness, .. } | Bsdf::Dielectric { roughness, .. } => Needs {
                uv: matches!(roughness, Roughness::Texture(_)),
                tangent: matches!(roughness, Roughness::Constant([x, y]) if x != y),
                normal: true,
            },
            Bsdf::Blend { a, b, weight } => {
                let (a, b) = (self.needs(a), self.needs(b));
                Needs {
                    uv: a.uv || b.uv || matches!(weight, Weight::Texture(_)),
                    tangent: a.tangent || b.tangent,
                    normal: a.normal || b.normal,
                }
            }
            Bsdf::Black => Needs::default(),
        };
        let by_place = matches!(material.temperature, Some(Temperature::Texture(_)))
            || matches!(material.opacity, Some(Weight::Texture(_)));
        Needs { uv: needs.uv || by_place, ..needs }
    }

    pub fn finish(self) -> (Vec<Material>, Vec<Texture>) {
        (self.scene, self.textures.finish())
    }

    /// Reports blends with a temperature of which no part can be hot, or some part with this temperature cannot, and leaves `None` in their
    /// place.
    fn check_temperatures(&mut self, item: Option<&Item<'a>>) {
        for i in 0..self.declared.len() {
            let (name, Some(declared)) = &self.declared[i] else { continue };
            if declared.temperature.is_none() {
                continue;
            }
            let (problem, help) = match (self.absorbs(i), self.rough_by_texture(i)) {
                (false, _) => (format!("all that \"{name}\" blends {TRANSPARENT}"), "remove it"),
                (_, Some(part)) => (format!("\"{part}\" {ROUGH_BY_TEXTURE}"), ONE_ROUGHNESS),
                (true, None) => continue,
            };
            let kinds = ["blend", "conductor", "plastic"];
            let of_kind =
                |material: &Item<'a>| kinds.iter().find_map(|kind| material.member(kind)?.member("temperature"));
            if let Some(item) = item.and_then(|item| of_kind(&item.member(name)?)) {
                item.error_help(problem, help);
            }
            self.declared[i].1 = None;
        }
    }

    /// The name of a part that is hot by the temperature of this material, and whose roughness is a texture.
    fn rough_by_texture(&self, index: usize) -> Option<&'a str> {
        let (name, declared) = &self.declared[index];
        match &declared.as_ref()?.kind {
            Kind::Conductor { roughness: Rough::Texture(_), .. }
            | Kind::Plastic { roughness: Rough::Texture(_), .. } => Some(name),
            Kind::Blend { parts: Parts { indices: Some(indices), .. }, .. } => {
                indices.iter().find_map(|&part| self.rough_by_texture(part))
            }
            _ => None,
        }
    }

    /// Whether some part absorbs, or is not known to absorb nothing.
    fn absorbs(&self, index: usize) -> bool {
        match self.declared[index].1.as_ref().map(|d| &d.kind) {
            Some(Kind::Dielectric { .. }) => false,
            Some(Kind::Blend { parts: Parts { indices: Some(indices), .. }, .. }) => {
                indices.iter().any(|&part| self.absorbs(part))
            }
            _ => true,
        }
    }

    /// The parts of every blend, by name; a name that does not exist is reported.
    fn look_up_parts(&mut self) {
        for i in 0..self.declared.len() {
            let Some(Declared { kind: Kind::Blend { parts, .. }, .. }) = &self.declared[i].1 else { continue };
            let found = parts.items.each_ref().map(|item| {
                let name = item.text()?;
                let index = self.position(name);
                if index.is_none() {
                    item.error_help(format!("no material is named \"{name}\""), self.help(name));
                }
                let declared = index.and_then(|index| self.declared[index].1.as_ref());
                if declared.is_some_and(|declared| declared.opacity.is_some()) {
                    item.error_help(
                        format!("\"{name}\" has an `opacity`, which a part of a blend cannot have"),
                        "give the `opacity` to the blend",
                    );
                    return None;
                }
                index
            });
            let indices = match found {
                [Some(a), Some(b)] => Some([a, b]),
                _ => None,
            };
            if let Some(Declared { kind: Kind::Blend { parts, .. }, .. }) = &mut self.declared[i].1 {
                parts.indices = indices;
            }
        }
    }
}

fn decode<'a>(item: &Item<'a>, spectra: &mut Spectra<'a>, textures: &mut Textures) -> Option<Declared<'a>> {
    let fields = item.table(&keys::MATERIAL)?;
    let kind = fields.exactly_one("kind of material")?;
    let (fields, kind) = match kind.path.rsplit('.').next() {
        Some("diffuse") => {
            let fields = kind.table(&keys::DIFFUSE)?;
            let kind = diffuse(&fields, spectra, textures);
            (fields, kind)
        }
        Some("conductor") => {
            let fields = kind.table(&keys::CONDUCTOR)?;
            let kind = conductor(&fields, spectra, textures);
            (fields, kind)
        }
        Some("dielectric") => {
            let fields = kind.table(&keys::DIELECTRIC)?;
            let eta = spectrum(&fields, "eta", ETA, Quantity::Index, spectra);
            let (dispersion, roughness) = (boolean(&fields, "dispersion", true), roughness(&fields, textures));
            let opacity = opacity(&fields, textures);
            if let Some(item) = fields.get("temperature") {
                item.error_help(
                    format!("a dielectric {TRANSPARENT}"),
                    "remove it; for glass that absorbs, give the object an `interior` whose medium has a temperature",
                );
                return None;
            }
            return Some(Declared {
                kind: Kind::Dielectric { eta: eta?, dispersion: dispersion?, roughness: roughness? },
                two_sided: true,
                temperature: None,
                opacity: opacity?,
                taken: None,
            });
        }
        Some("plastic") => {
            let fields = kind.table(&keys::PLASTIC)?;
            let reflectance = reflects(&fields, spectra, textures);
            let eta = spectrum(&fields, "eta", ETA, Quantity::CoatIndex, spectra);
            let kind = match (reflectance, eta, roughness(&fields, textures)) {
                (Some(reflectance), Some(eta), Some(roughness)) => Some(Kind::Plastic { reflectance, eta, roughness }),
                _ => None,
            };
            (fields, kind)
        }
        Some("blend") => {
            let fields = kind.table(&keys::BLEND)?;
            let (kind, temperature) = (blend(&fields, textures), temperature(&fields, textures));
            let (opacity, temperature) = (opacity(&fields, textures), temperature?);
            return Some(Declared { kind: kind?, two_sided: true, temperature, opacity: opacity?, taken: None });
        }
        _ => (kind.table(&keys::BLACK)?, Some(Kind::Black)),
    };
    let (two_sided, temperature) = (boolean(&fields, "two_sided", true), temperature(&fields, textures));
    let opacity = opacity(&fields, textures);
    Some(Declared { kind: kind?, two_sided: two_sided?, temperature: temperature?, opacity: opacity?, taken: None })
}

fn conductor<'a>(fields: &Fields<'a>, spectra: &mut Spectra<'a>, textures: &mut Textures) -> Option<Kind<'a>> {
    let index = match (fields.get("nk"), fields.get("eta").or(fields.get("k"))) {
        (Some(_), Some(other)) => {
            other.error_help("goes without `nk` only", "keep `nk`, or `eta` and `k`");
            None
        }
        (Some(file), None) => spectra.complex_index(&file),
        (None, Some(_)) => {
            let eta = spectrum(fields, "eta", "eta = 0.2, or the name of a spectrum", Quantity::Index, spectra);
            let k = spectrum(fields, "k", "k = 3.4, or the name of a spectrum", Quantity::Extinction, spectra);
            eta.zip(k)
        }
        (None, None) => {
            fields.require("nk", "nk = \"gold.csv\", or eta and k");
            None
        }
    };
    let roughness = match fields.get("roughness") {
        Some(item) if matches!(item.node.value, Value::Array(_)) => anisotropic_roughness(&item).map(Rough::Constant),
        _ => roughness(fields, textures),
    };
    let energy_compensation = boolean(fields, "energy_compensation", true);
    let (eta, k) = index?;
    Some(Kind::Conductor { eta, k, roughness: roughness?, energy_compensation: energy_compensation? })
}

fn anisotropic_roughness(item: &Item) -> Option<[f64; 2]> {
    let items = item.array_of::<2>("a number, or two [alpha_x, alpha_y]")?;
    let [x, y] = items.each_ref().map(alpha);
    let (x, y) = (x?, y?);
    if (x < SMOOTH) != (y < SMOOTH) {
        item.error_help(
            format!("both numbers must be at least {SMOOTH}, or both below, which is smooth; but they are {x} and {y}"),
            format!("use {SMOOTH} for the smoother direction"),
        );
        return None;
    }
    Some([x, y])
}

fn alpha(item: &Item) -> Option<f64> {
    item.number_where(|alpha| (0.0..=1.0).contains(&alpha), "a GGX roughness in [0, 1]")
}

fn roughness(fields: &Fields, textures: &mut Textures) -> Option<Rough> {
    let Some(item) = fields.get("roughness") else { return Some(Rough::Constant([0.0; 2])) };
    if matches!(item.node.value, Value::Table(_)) {
        return textures.number(&item, Number::Roughness).map(Rough::Texture);
    }
    alpha(&item).map(|alpha| Rough::Constant([alpha; 2]))
}

/// The outer `None` is a mistake that has been said.
fn temperature(fields: &Fields, textures: &mut Textures) -> Option<Option<Varying>> {
    let Some(item) = fields.get("temperature") else { return Some(None) };
    let temperature = match item.node.value {
        Value::Table(_) => textures.number(&item, Number::Temperature).map(Varying::Texture),
        _ => kelvin(&item).map(Varying::Constant),
    };
    temperature.map(Some)
}

/// The outer `None` is a mistake that has been said.
fn opacity(fields: &Fields, textures: &mut Textures) -> Option<Option<Varying>> {
    let Some(item) = fields.get("opacity") else { return Some(None) };
    if matches!(item.node.value, Value::Table(_)) {
        return textures.number(&item, Number::Weight).map(|handle| Some(Varying::Texture(handle)));
    }
    let opacity =
        item.number_where(|opacity| (0.0..=1.0).contains(&opacity), "the share of rays that it stops, in [0, 1]");
    // What is there for all rays is as without one.
    opacity.map(|opacity| (opacity < 1.0).then_some(Varying::Constant(opacity)))
}

/// A temperature that `item` holds: a number of kelvins, or text with its unit.
pub fn kelvin(item: &Item) -> Option<f64> {
    const RANGE: &str = "a temperature in K, above 0 and at most 1e9";
    let allowed = |kelvin: f64| kelvin > 0.0 && kelvin <= HOTTEST;
    let Value::String(text) = &item.node.value else { return item.number_where(allowed, RANGE) };
    let Some(kelvin) = unit::kelvin(text) else {
        item.error_help(
            format!("must be {RANGE}, but is \"{text}\""),
            "write kelvins as a number, or text with the unit K, C or F: \"37 C\"",
        );
        return None;
    };
    if !allowed(kelvin) {
        item.error(format!("must be {RANGE}, but is {kelvin} K"));
        return None;
    }
    Some(kelvin)
}

fn blend<'a>(fields: &Fields<'a>, textures: &mut Textures) -> Option<Kind<'a>> {
    let part = |key: &str| {
        let item = fields.require(key, &format!("{key} = \"white\", the name of a material"))?;
        item.text().map(|_| item)
    };
    let (a, b) = (part("a"), part("b"));
    let weight = fields.require("weight", "weight = 0.5, the share of b").and_then(|item| {
        if matches!(item.node.value, Value::Table(_)) {
            return textures.number(&item, Number::Weight).map(Varying::Texture);
        }
        item.number_where(|weight| (0.0..=1.0).contains(&weight), "the share of b, in [0, 1]").map(Varying::Constant)
    });
    Some(Kind::Blend { parts: Parts { items: [a?, b?], indices: None }, weight: weight? })
}

fn reflects<'a>(fields: &Fields<'a>, spectra: &mut Spectra<'a>, textures: &mut Textures) -> Option<Reflects> {
    share_of_light(&fields.require("reflectance", REFLECTANCE)?, Quantity::Reflectance, spectra, textures)
}

/// A spectrum or texture of what becomes of light.
fn share_of_light<'a>(
    item: &Item<'a>,
    quantity: Quantity,
    spectra: &mut Spectra<'a>,
    textures: &mut Textures,
) -> Option<Reflects> {
    if is_texture(item) {
        return textures.share_of_light(item, quantity, spectra).map(Reflects::Texture);
    }
    spectra.resolve(item, quantity).map(Reflects::Spectrum)
}

/// A surface that scatters by Lambert's law, on one side or on both.
fn diffuse<'a>(fields: &Fields<'a>, spectra: &mut Spectra<'a>, textures: &mut Textures) -> Option<Kind<'a>> {
    let reflectance = diffusely_reflects(fields, spectra, textures);
    let Some(item) = fields.get("transmittance") else {
        return reflectance.map(|reflectance| Kind::Diffuse { reflectance });
    };
    let transmittance = share_of_light(&item, Quantity::Transmittance, spectra, textures);
    if let Some(emissivity) = fields.get("emissivity") {
        emissivity.error_help(
            "does not say how much is reflected beside `transmittance`",
            "give `reflectance`: the emissivity is 1 - reflectance - transmittance",
        );
        return None;
    }
    if let Some(sides) = fields.get("two_sided")
        && sides.boolean() == Some(false)
    {
        sides.error_help(
            "a surface with a `transmittance` has two sides: light that passes through it comes from the other one",
            "remove `two_sided`, or `transmittance`",
        );
        return None;
    }
    let (reflectance, transmittance) = (reflectance?, transmittance?);
    translucent::check(&item, [reflectance, transmittance], spectra, textures)?;
    Some(Kind::Translucent { reflectance, transmittance })
}

/// Of a diffuse surface, whose emissivity is the same in all directions, that may be given instead.
fn diffusely_reflects<'a>(fields: &Fields<'a>, spectra: &mut Spectra<'a>, textures: &mut Textures) -> Option<Reflects> {
    let Some(emissivity) = fields.get("emissivity") else { return reflects(fields, spectra, textures) };
    if let Some(reflectance) = fields.get("reflectance") {
        reflectance.error_help("is the complement of `emissivity`", "keep one of the two");
        return None;
    }
    let emissivity = spectra.resolve(&emissivity, Quantity::Emissivity)?;
    Some(Reflects::Spectrum(spectra.complement(emissivity)))
}

fn spectrum<'a>(
    fields: &Fields<'a>,
    key: &str,
    example: &str,
    quantity: Quantity,
    spectra: &mut Spectra<'a>,
) -> Option<Handle> {
    fields.require(key, example).and_then(|item| spectra.resolve(&item, quantity))
}

fn boolean(fields: &Fields, key: &str, default: bool) -> Option<bool> {
    fields.get(key).map_or(Some(default), |item| item.boolean())
}
