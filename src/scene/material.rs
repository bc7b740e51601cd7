//! `[materials]`.

use super::decode::{Item, Keys, did_you_mean, list};
use super::overrides::MATERIAL_KINDS;
use super::spectrum::{Handle, Quantity, Spectra};
use super::{Bsdf, Material, MaterialId};

const KINDS: Keys = Keys::new(&["diffuse", "black"]).later(&["conductor", "dielectric", "plastic", "blend"]);
const DIFFUSE: Keys = Keys::new(&["reflectance", "two_sided"]).later(&["temperature"]);
const BLACK: Keys = Keys::new(&["two_sided"]).later(&["temperature"]);

#[derive(Clone, Copy)]
enum Kind {
    Diffuse(Handle),
    Black,
}

#[derive(Clone, Copy)]
struct Declared {
    kind: Kind,
    two_sided: bool,
    taken: Option<MaterialId>,
}

/// The materials of the file, and those in use.
pub struct Materials<'a> {
    /// `None` where the definition is wrong, which has been said.
    declared: Vec<(&'a str, Option<Declared>)>,
    /// In the order of their first use.
    scene: Vec<Material>,
}

impl<'a> Materials<'a> {
    pub fn new(item: Option<Item<'a>>, spectra: &mut Spectra<'a>) -> Self {
        let items = item.and_then(|item| item.named_items()).unwrap_or_default();
        let declared = items.iter().map(|(name, item)| (*name, decode(item, spectra))).collect();
        Materials { declared, scene: Vec::new() }
    }

    /// Whether the file defines `name`, rightly or wrongly.
    pub fn has(&self, name: &str) -> bool {
        self.declared.iter().any(|(known, _)| *known == name)
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
        let (_, declared) = self.declared.iter_mut().find(|(known, _)| *known == name)?;
        let declared = declared.as_mut()?;
        if let Some(id) = declared.taken {
            return Some(id);
        }
        let bsdf = match declared.kind {
            Kind::Diffuse(reflectance) => Bsdf::Diffuse { reflectance: spectra.take(reflectance) },
            Kind::Black => Bsdf::Black,
        };
        self.scene.push(Material { name: name.to_owned(), bsdf, two_sided: declared.two_sided });
        declared.taken = Some(self.scene.len() - 1);
        declared.taken
    }

    pub fn finish(self) -> Vec<Material> {
        self.scene
    }
}

fn decode<'a>(item: &Item<'a>, spectra: &mut Spectra<'a>) -> Option<Declared> {
    let fields = item.table(KINDS)?;
    let kind = fields.exactly_one(&MATERIAL_KINDS, "kind of material")?;
    let (fields, kind) = match kind.path.rsplit('.').next() {
        Some("diffuse") => {
            let fields = kind.table(DIFFUSE)?;
            let reflectance = fields.require("reflectance", "reflectance = 0.5, or the name of a spectrum");
            (fields, reflectance.and_then(|item| spectra.resolve(&item, Quantity::Reflectance)).map(Kind::Diffuse))
        }
        Some("black") => (kind.table(BLACK)?, Some(Kind::Black)),
        // Refused by the table's key check.
        _ => return None,
    };
    let two_sided = match fields.get("two_sided") {
        Some(item) => item.boolean(),
        None => Some(true),
    };
    Some(Declared { kind: kind?, two_sided: two_sided?, taken: None })
}
