//! Scenes whose light transport separates: what a path brings is a weight, which knows no wavelength, times a product of spectra of the
//! scene ([`crate::spectral::product`]). The records that paths leave say by ids which; here is what ids mean.

use std::collections::{BTreeMap, BTreeSet};

use smallvec::SmallVec;

use crate::device::parts::heat::{self, Heat, HotLeaf};
use crate::device::parts::surfaces::Needed;
use crate::device::spectra::SpectrumIds;
use crate::scene::{Bsdf, Reflectance, Scene, SpectrumId, Temperature, TextureKind};
use crate::spectral::product::{Basis, Expression, Leaf, Term};
use crate::spectral::table::SpectralTables;
use crate::{Error, Result};

/// Scattering events of a path at most: a product is stored with room for as many factors.
pub const MOST_FACTORS: u32 = 64;
/// Factors and sources have 16 bits.
const MOST_EXPRESSIONS: usize = u16::MAX as usize;

/// The basis of a scene, and what its spectra are in it.
pub struct Separated {
    pub basis: Basis,
    factors: BTreeMap<SpectrumId, u16>,
    /// Those of an emission are added.
    sources: BTreeMap<SpectrumId, Sources>,
}

type Sources = SmallVec<[u16; 2]>;

/// What the spectrum ids of records are in products.
#[derive(Debug)]
pub struct Separable {
    /// By id; ids that multiply nothing have none.
    pub factors: Vec<Option<u16>>,
    /// By id: those that are added.
    pub sources: Vec<Sources>,
}

/// The basis of `scene`.
///
/// # Errors
/// What of the scene does not separate, by name.
pub fn basis(scene: &Scene) -> Result<Basis> {
    let heat = heat::as_emission(scene);
    Separated::new(&heat.scene, &heat).map(|separated| separated.basis)
}

impl Separated {
    /// Of `scene`, whose heat is emission already.
    ///
    /// # Errors
    /// As [`basis`].
    pub fn new(scene: &Scene, heat: &Heat) -> Result<Separated> {
        check(scene, heat)?;
        let shares = scene.materials.iter().flat_map(|material| match material.bsdf {
            Bsdf::Diffuse { reflectance } => vec![reflectance],
            Bsdf::Translucent { reflectance, transmittance } => vec![reflectance, transmittance],
            _ => Vec::new(),
        });
        let plain = shares.filter_map(|share| match share {
            Reflectance::Spectrum(spectrum) => Some(spectrum),
            Reflectance::Texture(_) => None,
        });
        let endmembers = scene.textures.iter().flat_map(|texture| match &texture.kind {
            TextureKind::Mixture(endmembers) => &endmembers[..],
            _ => &[],
        });
        let reflecting: BTreeSet<SpectrumId> = plain.chain(endmembers.copied()).collect();
        let surfaces = scene.objects.iter().filter_map(|object| object.emission.as_ref().map(|e| e.radiance));
        let environment = scene.environment.as_ref().and_then(|environment| environment.uniform());
        let lights = scene.lights.iter().map(|light| light.spectrum());
        let emitting: BTreeSet<SpectrumId> = surfaces.chain(environment).chain(lights).collect();

        let mut maker = Maker { scene, basis: Basis::default() };
        let mut separated = Separated { basis: Basis::default(), factors: BTreeMap::new(), sources: BTreeMap::new() };
        for spectrum in reflecting {
            let factor = maker.expression(spectrum);
            separated.factors.insert(spectrum, push(&mut maker.basis.factors, factor));
        }
        for spectrum in emitting {
            let made = heat.made.iter().find(|made| made.spectrum == spectrum);
            let (lamp, parts) = made.map_or((Some(spectrum), &[][..]), |made| (made.lamp, &made.parts[..]));
            let lamp = lamp.map(|lamp| maker.expression(lamp));
            let parts: Vec<Expression> = parts.iter().map(|part| maker.heat(part)).collect();
            let sources = lamp.into_iter().chain(parts).map(|source| push(&mut maker.basis.sources, source));
            separated.sources.insert(spectrum, sources.collect());
        }
        separated.basis = maker.basis;
        if separated.basis.factors.len().max(separated.basis.sources.len()) > MOST_EXPRESSIONS {
            let message =
                format!("more than {MOST_EXPRESSIONS} spectra reflect or emit, more than a factored cube can name");
            return Err(Error::input(&scene.file, message));
        }
        Ok(separated)
    }

    /// By the ids that `tables` gave to spectra. `needed`: those that materials of general scenes asked for.
    pub fn by_id(&self, ids: &SpectrumIds, needed: &[Needed], tables: &SpectralTables) -> Separable {
        let (mut factors, mut sources) = (vec![None; tables.ids.len()], vec![SmallVec::new(); tables.ids.len()]);
        let of_materials = ids.factors.iter().map(|(&spectrum, &position)| (spectrum, position));
        let of_surfaces = needed.iter().zip(&ids.needed).filter_map(|(needed, &position)| match needed {
            Needed::Scene(spectrum) => Some((*spectrum, position)),
            _ => None,
        });
        for (spectrum, position) in of_materials.chain(of_surfaces) {
            factors[tables.ids[position] as usize] = self.factors.get(&spectrum).copied();
        }
        for (spectrum, &position) in &ids.sources {
            sources[tables.ids[position] as usize] = self.sources.get(spectrum).cloned().unwrap_or_default();
        }
        Separable { factors, sources }
    }
}

/// The place of `expression` among `all`: equal ones share it.
fn push(all: &mut Vec<Expression>, expression: Expression) -> u16 {
    let place = all.iter().position(|known| *known == expression).unwrap_or_else(|| {
        all.push(expression);
        all.len() - 1
    });
    place as u16
}

/// What makes a basis of a scene's spectra.
struct Maker<'a> {
    scene: &'a Scene,
    basis: Basis,
}

impl Maker<'_> {
    fn expression(&mut self, spectrum: SpectrumId) -> Expression {
        let definition = &self.scene.spectra[spectrum].definition;
        let (scale, is_complement) = definition.as_ref().map_or((1.0, false), |of| (of.scale, of.is_complement));
        let leaf = self.leaf(spectrum);
        Expression { scale, terms: vec![if is_complement { Term::Complement(leaf) } else { Term::Spectrum(leaf) }] }
    }

    /// What a hot part emits: ε B(λ, T).
    fn heat(&mut self, part: &HotLeaf) -> Expression {
        let Temperature::Constant(kelvin) = part.temperature else { unreachable!("refused by `check`") };
        let material = &self.scene.materials[part.material];
        let mut terms = Vec::new();
        if let Bsdf::Diffuse { reflectance: Reflectance::Spectrum(spectrum) } = material.bsdf {
            let reflectance = self.expression(spectrum);
            match (&reflectance.terms[0], reflectance.scale) {
                // 1 - (1 - s) is s.
                (Term::Complement(leaf), 1.0) => terms.push(Term::Spectrum(*leaf)),
                (Term::Spectrum(leaf), 1.0) => terms.push(Term::Complement(*leaf)),
                _ => unreachable!("reflectances are not scaled from outside"),
            }
        }
        terms.push(Term::Planck { material: material.name.clone(), kelvin });
        Expression { scale: part.weight, terms }
    }

    /// The place of what a spectrum is made of. One definition is one leaf, whatever is made of it.
    fn leaf(&mut self, spectrum: SpectrumId) -> usize {
        let described = &self.scene.spectra[spectrum];
        let leaf = match &described.definition {
            Some(of) => Leaf {
                name: of.name.clone(),
                is_named: true,
                quantity: of.quantity.noun().to_owned(),
                curve: of.curve.as_ref().clone(),
            },
            None => Leaf {
                name: described.name.clone(),
                is_named: false,
                quantity: String::new(),
                curve: described.curve.clone(),
            },
        };
        let spectra = &mut self.basis.spectra;
        spectra.iter().position(|other| *other == leaf).unwrap_or_else(|| {
            spectra.push(leaf);
            spectra.len() - 1
        })
    }
}

/// Refuses what does not separate.
fn check(scene: &Scene, heat: &Heat) -> Result<()> {
    let found = obstacles(scene, heat);
    if found.is_empty() {
        return Ok(());
    }
    let message = format!(
        "--factored: light transport does not separate into weights and spectra in this scene: {}; render without it",
        found.join(", ")
    );
    Err(Error::input(&scene.file, message))
}

/// What of `scene`, whose heat is emission already, keeps its light transport from separating, in words: nothing where it does.
pub fn obstacles(scene: &Scene, heat: &Heat) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for material in &scene.materials {
        let kind = match &material.bsdf {
            Bsdf::Diffuse { .. } | Bsdf::Translucent { .. } | Bsdf::Blend { .. } | Bsdf::Black => continue,
            Bsdf::Conductor { .. } => "conductor",
            Bsdf::Dielectric { .. } => "dielectric",
            Bsdf::Plastic { .. } => "plastic",
        };
        found.push(format!("the material \"{}\" ({kind})", material.name));
    }
    let is_colour =
        |texture: &crate::scene::Texture| matches!(texture.kind, TextureKind::Colour | TextureKind::Light(_));
    if scene.textures.iter().any(is_colour) {
        found.push("textures of colours (those of endmembers do)".into());
    }
    if !scene.media.is_empty() {
        found.push("media".into());
    }
    if matches!(&scene.environment, Some(environment) if environment.uniform().is_none()) {
        found.push("the environment map".into());
    }
    if !heat.by_angle.is_empty() {
        found.push("heat of surfaces whose front and back differ, or by angle".into());
    }
    if !heat.radiating.is_empty() {
        found.push("heat and emission that differ by place".into());
    }
    for made in &heat.made {
        let mixed =
            |part: &&HotLeaf| !matches!(scene.materials[part.material].bsdf, Bsdf::Black | Bsdf::Diffuse { .. });
        if let Some(part) = made.parts.iter().find(mixed) {
            found.push(format!("heat of the material \"{}\"", scene.materials[part.material].name));
        }
    }
    let bounces = scene.integrator.max_bounces;
    if bounces > MOST_FACTORS {
        found.push(format!("paths of {bounces} bounces (integrator.max_bounces; at most {MOST_FACTORS})"));
    }
    found.dedup();
    found
}
