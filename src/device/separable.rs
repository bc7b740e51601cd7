//! Light transport that separates: what a path brings is a weight, which knows no wavelength, times a product of spectra of the
//! scene ([`crate::spectral::product`]). The records that paths leave say by ids which; here is what ids mean.
//!
//! What a path brings by something that does not separate (facets, boundaries, matter, maps) is the *remainder*: it is evaluated in
//! channels as in any other render. Which of both a contribution is [`Mixed`] says by the records before it, one after the other, on the
//! host as on the device (`shaders/parts/remainder/separates.wgsl`), so that nothing is left out and nothing counts twice.

pub mod map;
mod nodes;
mod records;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use smallvec::{SmallVec, smallvec};

use self::map::Clusters;
pub use self::nodes::Nodes;
pub use self::records::{Factor, Mixed, Separable};
use crate::device::parts::heat::{self, Heat, HotLeaf};
use crate::device::parts::radiators::Radiators;
use crate::device::parts::surfaces::Needed;
use crate::device::spectra::SpectrumIds;
use crate::device::words::{SEPARATES_AS_FACTOR, SEPARATES_AS_SOURCE};
use crate::scene::{Bsdf, MaterialId, Reflectance, Scene, SpectrumId, Temperature, Texels, TextureId, TextureKind};
use crate::spectral::product::{Basis, Expression, Leaf, Term};
use crate::spectral::table::SpectralTables;
use crate::spectral::{Channels, Curve, Outside};
use crate::{Error, Result};

/// Scattering events of a path at most: a product is stored with room for as many factors.
pub const MOST_FACTORS: u32 = 64;
/// Factors and sources have 16 bits.
const MOST_EXPRESSIONS: usize = u16::MAX as usize;

/// The basis of a scene, what its spectra are in it, and what of the scene is in no product.
pub struct Separated {
    pub basis: Basis,
    /// What does not separate, in words.
    pub remainder: Vec<String>,
    factors: BTreeMap<SpectrumId, u16>,
    /// What a factor leaves of light, 1 less it, where something hot needs that.
    complements: BTreeMap<u16, u16>,
    /// Those of an emission are added.
    sources: BTreeMap<SpectrumId, Sources>,
    /// What is emitted by place: of each radiator, in their order, what it is in products.
    radiators: Vec<Radiating>,
    /// The environment, where it is a map of spectra.
    map: Option<Map>,
    /// The source 1, where a spectrum that reflects is that of a lamp by place too: such a lamp is 1 times a factor.
    one: Option<u16>,
}

/// A map of spectra in products.
#[derive(Debug, Clone)]
struct Map {
    clusters: Arc<Clusters>,
    /// Of each of its spectra.
    sources: Vec<u16>,
    scale: f64,
}

/// A radiator ([`Radiators`]) in products.
#[derive(Debug, Clone)]
enum Radiating {
    /// Something of the remainder; or a lamp, whose spectra have ids.
    Other,
    /// What is hot: temperatures that are sources, and the factor of what a surface of one reflectance keeps.
    Hot { nodes: Nodes, keeps: Option<u16> },
}

type Sources = SmallVec<[u16; 2]>;

/// The basis of `scene`.
///
/// # Errors
/// What cannot be rendered so at all, by name.
pub fn basis(scene: &Scene) -> Result<Basis> {
    of(scene).map(|separated| separated.basis)
}

/// The basis of `scene`, and what is in no product of it.
///
/// # Errors
/// As [`basis`].
pub fn of(scene: &Scene) -> Result<Separated> {
    let heat = heat::as_emission(scene);
    Separated::new(&heat.scene, &heat, &scene.channels)
}

/// What of `scene` does not separate, in words: nothing where all does.
pub fn remainder(scene: &Scene) -> Vec<String> {
    let heat = heat::as_emission(scene);
    obstacles(scene, of_heat(&heat))
}

impl Separated {
    /// Of `scene`, whose heat is emission already, for a cube of `channels`.
    ///
    /// # Errors
    /// As [`basis`].
    pub fn new(scene: &Scene, heat: &Heat, channels: &Channels) -> Result<Separated> {
        check(scene)?;
        let shares = scene.materials.iter().flat_map(|material| match material.bsdf {
            Bsdf::Diffuse { reflectance } => vec![reflectance],
            Bsdf::Translucent { reflectance, transmittance } => vec![reflectance, transmittance],
            _ => Vec::new(),
        });
        let reflecting: BTreeSet<SpectrumId> =
            shares.flat_map(|share| reflected(scene, share).unwrap_or_default().to_vec()).collect();
        let lamps = scene.objects.iter().zip(&heat.kinds).filter(|(_, kind)| matches!(kind, heat::Kind::Lamp));
        let surfaces = lamps.filter_map(|(object, _)| object.emission.as_ref().map(|e| e.radiance));
        let environment = scene.environment.as_ref().and_then(|environment| environment.uniform());
        let lights = scene.lights.iter().map(|light| light.spectrum());
        let by_place = heat.radiating.iter().flat_map(|surface| lamps_by_place(scene, surface));
        let emitting: BTreeSet<SpectrumId> = surfaces.chain(environment).chain(lights).chain(by_place).collect();

        let mut maker = Maker { scene, basis: Basis::default(), nodes: Vec::new() };
        let mut separated = Separated {
            basis: Basis::default(),
            remainder: obstacles(scene, of_heat(heat)),
            factors: BTreeMap::new(),
            complements: BTreeMap::new(),
            sources: BTreeMap::new(),
            radiators: Vec::new(),
            map: None,
            one: None,
        };
        for spectrum in reflecting {
            let factor = maker.expression(spectrum);
            separated.factors.insert(spectrum, push(&mut maker.basis.factors, factor));
        }
        for spectrum in emitting {
            let made = heat.made.iter().find(|made| made.spectrum == spectrum);
            let (lamp, parts) = made.map_or((Some(spectrum), &[][..]), |made| (made.lamp, &made.parts[..]));
            if !parts.iter().all(|part| heat_separates(scene, part)) {
                continue;
            }
            let lamp = lamp.map(|lamp| maker.expression(lamp));
            let parts: Vec<Expression> = parts.iter().map(|part| maker.heat(part)).collect();
            let sources = lamp.into_iter().chain(parts).map(|source| push(&mut maker.basis.sources, source));
            separated.sources.insert(spectrum, sources.collect());
        }
        for surface in &heat.radiating {
            for part in &surface.parts {
                let radiating = separated.by_place(&mut maker, part, channels);
                separated.radiators.push(radiating);
            }
            separated.radiators.extend(surface.lamp.map(|_| Radiating::Other));
            if lamps_by_place(scene, surface).iter().any(|lamp| separated.factors.contains_key(lamp)) {
                let one = Expression { scale: 1.0, terms: Vec::new() };
                separated.one = Some(push(&mut maker.basis.sources, one));
            }
        }
        if let Some(map) = scene.environment.as_ref().and_then(|environment| environment.map())
            && let (Some(clusters), Texels::Spectral { nm, .. }) = (map::clusters(map), &map.texels)
        {
            let source = |(i, spectrum): (usize, &Vec<f64>)| maker.of_map(i, nm, spectrum, map.scale);
            let sources = clusters.spectra.iter().enumerate().map(source).collect();
            separated.map = Some(Map { clusters, sources, scale: map.scale });
        }
        separated.basis = maker.basis;
        if separated.basis.factors.len().max(separated.basis.sources.len()) > MOST_EXPRESSIONS {
            let message =
                format!("more than {MOST_EXPRESSIONS} spectra reflect or emit, more than a factored cube can name");
            return Err(Error::input(&scene.file, message));
        }
        Ok(separated)
    }

    /// A hot part whose emission differs by place.
    fn by_place(&mut self, maker: &mut Maker, part: &HotLeaf, channels: &Channels) -> Radiating {
        if !separates_by_place(maker.scene, part) {
            return Radiating::Other;
        }
        let mut keeps = None;
        if let Bsdf::Diffuse { reflectance } = maker.scene.materials[part.material].bsdf {
            for &spectrum in reflected(maker.scene, reflectance).unwrap_or_default().iter() {
                let kept = Expression { scale: 1.0, terms: vec![maker.kept(spectrum)] };
                let kept = push(&mut maker.basis.factors, kept);
                self.complements.insert(self.factors[&spectrum], kept);
                keeps = matches!(reflectance, Reflectance::Spectrum(_)).then_some(kept);
            }
        }
        Radiating::Hot { nodes: maker.temperatures(part, channels), keeps }
    }

    /// The most factors of a product of paths of so many bounces: where something hot ends them, what it keeps of light is one.
    pub fn most_factors(&self, bounces: u32) -> u32 {
        bounces + u32::from(!self.complements.is_empty())
    }

    /// The names of spectra of `scene` that are in no product: those of what does not separate.
    pub fn spectra_of_remainder(&self, scene: &Scene) -> Vec<String> {
        let is_in_products = |name: &str| self.basis.spectra.iter().any(|leaf| leaf.is_named && leaf.name == name);
        let names = scene.spectra.iter().filter_map(|spectrum| spectrum.definition.as_ref().map(|of| of.name.as_str()));
        let beside: BTreeSet<&str> = names.filter(|name| !is_in_products(name)).collect();
        beside.into_iter().map(str::to_owned).collect()
    }

    /// By the ids that `tables` gave to spectra. `needed`: those that materials of general scenes asked for, as `radiators` name them.
    pub fn by_id(
        &self,
        ids: &SpectrumIds,
        needed: &[Needed],
        radiators: Option<&Radiators>,
        tables: &SpectralTables,
    ) -> Separable {
        let (mut factors, mut sources) = (vec![Factor::Mixed; tables.ids.len()], vec![None; tables.ids.len()]);
        factors[0] = Factor::One;
        let of_materials = ids.factors.iter().map(|(&spectrum, &position)| (spectrum, position));
        let of_surfaces = needed.iter().zip(&ids.needed).filter_map(|(needed, &position)| match needed {
            Needed::Scene(spectrum) => Some((*spectrum, position)),
            _ => None,
        });
        for (spectrum, position) in of_materials.chain(of_surfaces) {
            let id = tables.ids[position] as usize;
            if let Some(&factor) = self.factors.get(&spectrum) {
                factors[id] = Factor::Of(factor);
            } else if let Some([source]) = self.sources.get(&spectrum).map(|sources| &sources[..]) {
                factors[id] = Factor::Source(*source);
            }
        }
        for (spectrum, &position) in &ids.sources {
            sources[tables.ids[position] as usize] = self.sources.get(spectrum).cloned();
        }
        let mut heat = Vec::with_capacity(self.radiators.len());
        for (n, radiating) in self.radiators.iter().enumerate() {
            heat.push(match radiating {
                Radiating::Other => None,
                Radiating::Hot { nodes, keeps } => {
                    let radiator =
                        radiators.map(|radiators| radiators.all[n]).expect("what emits by place has radiators");
                    if let Some(kept) = *keeps {
                        factors[tables.ids[ids.needed[(radiator.inner & 0xffff) as usize]] as usize] = Factor::Of(kept);
                    }
                    Some(nodes.clone())
                }
            });
        }
        if !heat.is_empty() || self.map.is_some() {
            sources[0] = Some(self.one.into_iter().collect());
        }
        let bits = factors.iter().zip(&sources).map(|(factor, source)| {
            let as_factor = if *factor == Factor::Mixed { 0 } else { SEPARATES_AS_FACTOR };
            as_factor | if source.is_some() { SEPARATES_AS_SOURCE } else { 0 }
        });
        let (bits, complements, map) = (bits.collect(), self.complements.clone(), self.map.clone());
        let counts = [self.basis.sources.len(), self.basis.factors.len()];
        let has_remainder = !self.remainder.is_empty();
        Separable { bits, factors, complements, sources, heat, map, counts, has_remainder }
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
    /// Those of temperatures that are known already.
    nodes: Vec<((MaterialId, Temperature), Nodes)>,
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
            terms.push(self.kept(spectrum));
        }
        terms.push(Term::Planck { material: material.name.clone(), kelvin, is_node: false });
        Expression { scale: part.weight, terms }
    }

    /// One of the spectra that a map is made of, as a source.
    fn of_map(&mut self, number: usize, nm: &[f64], values: &[f64], scale: f64) -> u16 {
        self.basis.spectra.push(Leaf {
            name: format!("environment map, spectrum {number}"),
            is_named: false,
            quantity: String::new(),
            curve: Curve::Linear { nm: nm.to_vec(), value: values.to_vec(), outside: Outside::Zero },
        });
        let terms = vec![Term::Spectrum(self.basis.spectra.len() - 1)];
        push(&mut self.basis.sources, Expression { scale, terms })
    }

    /// 1 - a reflectance.
    fn kept(&mut self, reflectance: SpectrumId) -> Term {
        let reflectance = self.expression(reflectance);
        match (&reflectance.terms[0], reflectance.scale) {
            // 1 - (1 - s) is s.
            (Term::Complement(leaf), 1.0) => Term::Spectrum(*leaf),
            (Term::Spectrum(leaf), 1.0) => Term::Complement(*leaf),
            _ => unreachable!("reflectances are not scaled from outside"),
        }
    }

    /// The temperatures that a hot part has, or those between which its own are, as sources.
    fn temperatures(&mut self, part: &HotLeaf, channels: &Channels) -> Nodes {
        let key = (part.material, part.temperature);
        if let Some((_, known)) = self.nodes.iter().find(|(known, _)| *known == key) {
            return known.clone();
        }
        let material = &self.scene.materials[part.material].name;
        let (kelvin, is_node) = match part.temperature {
            Temperature::Constant(kelvin) => (vec![kelvin], false),
            Temperature::Texture(texture) => {
                let texels = self.scene.textures[texture].texels.iter().map(|v| f64::from(*v));
                let [least, most] = texels.fold([f64::INFINITY, 0.0], |[a, b], v| [v.min(a), v.max(b)]);
                (nodes::between(least, most, channels), true)
            }
        };
        let source = |&kelvin: &f64| {
            let terms = vec![Term::Planck { material: material.clone(), kelvin, is_node }];
            push(&mut self.basis.sources, Expression { scale: 1.0, terms })
        };
        let nodes = Nodes::new(kelvin.iter().map(source).collect::<Vec<_>>(), kelvin);
        self.nodes.push((key, nodes.clone()));
        nodes
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

/// Refuses what cannot be rendered so at all.
fn check(scene: &Scene) -> Result<()> {
    let bounces = scene.integrator.max_bounces;
    if bounces <= MOST_FACTORS {
        return Ok(());
    }
    let message = format!(
        "--factored: paths of {bounces} bounces (integrator.max_bounces) may be of more factors than the {MOST_FACTORS} that a factored \
         cube has room for; lower it, or render without --factored"
    );
    Err(Error::input(&scene.file, message))
}

/// Whether what a hot part emits is a product.
fn heat_separates(scene: &Scene, part: &HotLeaf) -> bool {
    let is_even = matches!(part.temperature, Temperature::Constant(_));
    let bsdf = &scene.materials[part.material].bsdf;
    is_even && matches!(bsdf, Bsdf::Black | Bsdf::Diffuse { reflectance: Reflectance::Spectrum(_) })
}

/// The spectra that a share of light is a sum of; `None` of colours.
fn reflected(scene: &Scene, share: Reflectance) -> Option<SmallVec<[SpectrumId; 4]>> {
    match share {
        Reflectance::Spectrum(spectrum) => Some(smallvec![spectrum]),
        Reflectance::Texture(texture) => match &scene.textures[texture].kind {
            TextureKind::Mixture(endmembers) => Some(SmallVec::from_slice(endmembers)),
            _ => None,
        },
    }
}

/// Whether what a hot part emits, another at each place, is a sum of products there.
pub fn separates_by_place(scene: &Scene, part: &HotLeaf) -> bool {
    match scene.materials[part.material].bsdf {
        Bsdf::Black => true,
        Bsdf::Diffuse { reflectance } => reflected(scene, reflectance).is_some(),
        _ => false,
    }
}

/// The spectra of the lamp of a surface that emits by place.
fn lamps_by_place(scene: &Scene, surface: &heat::Radiating) -> Vec<SpectrumId> {
    match surface.lamp {
        None => Vec::new(),
        Some((spectrum, _, None)) => vec![spectrum],
        Some((_, _, Some(texture))) => match &scene.textures[texture].kind {
            TextureKind::Mixture(lamps) => lamps.clone(),
            _ => Vec::new(),
        },
    }
}

/// Whether all that a surface sends, another at each place, is a sum of products there.
fn radiates_products(scene: &Scene, surface: &heat::Radiating) -> bool {
    let is_colour = |texture: TextureId| matches!(scene.textures[texture].kind, TextureKind::Light(_));
    let lamp = surface.lamp.is_none_or(|(_, _, texture)| !texture.is_some_and(is_colour));
    lamp && surface.parts.iter().all(|part| separates_by_place(scene, part))
}

/// [`remainder`], of which that `of_heat` is known. It looks into maps, which takes its time.
pub fn obstacles(scene: &Scene, of_heat: Vec<String>) -> Vec<String> {
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
    if let Some(map) = scene.environment.as_ref().and_then(|environment| environment.map()) {
        match map::clusters(map) {
            None => found.push("the environment map, which is of colours".into()),
            Some(clusters) if clusters.left.is_some() => {
                found.push(format!("what {} spectra leave of the environment map", clusters.spectra.len()));
            }
            Some(_) => {}
        }
    }
    found.extend(of_heat);
    found.dedup();
    found
}

/// What of heat does not separate, in words.
pub fn of_heat(heat: &Heat) -> Vec<String> {
    let scene = &*heat.scene;
    let mut found: Vec<String> = Vec::new();
    if !heat.by_angle.is_empty() {
        found.push("heat of surfaces whose front and back differ, or by angle".into());
    }
    if !heat.radiating.iter().all(|surface| radiates_products(scene, surface)) {
        found.push("heat and emission that differ by place, of what is not diffuse or black".into());
    }
    for made in &heat.made {
        if let Some(part) = made.parts.iter().find(|part| !heat_separates(scene, part)) {
            found.push(format!("heat of the material \"{}\"", scene.materials[part.material].name));
        }
    }
    found
}
