//! Materials of general scenes as devices get them: lists of parts (lobes), tables, and the spectra that these need.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;

use crate::device::words::{MATERIAL_DIFFUSE, MATERIAL_TRANSMITS, Part, SurfaceMaterial};
use crate::device::parts::lights::STEPS;
use crate::device::parts::textures::{self, Share, Textures};
use crate::scattering::fresnel::{self, mean_conductor, mean_dielectric};
use crate::scattering::{DielectricAlbedo, ReflectionAlbedo, ReflectionProbability, index_range};
use crate::scene::{Bsdf, MaterialId, Reflectance, SMOOTH, Scene, SpectrumId, Texture, TextureKind, Weight};
use crate::spectral::{Curve, Outside};

/// What a part is: the `KIND_…` of `shaders/common/material.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Kind {
    Lambert = 0,
    Conductor = 1,
    RoughConductor = 2,
    ConductorAgain = 3,
    Mirror = 4,
    Refraction = 5,
    RoughBoundary = 6,
    BoundaryAgain = 7,
    BeyondAgain = 8,
    RoughCoat = 9,
    Base = 10,
}

const OPAQUE: u32 = 0x100;
const TWO_SIDED: u32 = 0x200;
const DISPERSES: u32 = 0x400;
const NARROW: u32 = 0x800;
const TEXTURED: u32 = 0x1000;

/// Intervals of the device's tables over the cosine.
const INTERVALS: usize = 256;
/// Values in a row of a table of albedos; what the numbers of tables over index and cosine count in.
const ROW: usize = 128;
/// Boundaries whose indices are this near to 1 bend by an index this far from it where they are rough (`reference`).
const MATCHED: f64 = 1e-4;

/// A spectrum that materials need on the device.
#[derive(Debug, Clone, PartialEq)]
pub enum Needed {
    Scene(SpectrumId),
    Derived(String, Curve),
    /// Within the tables' bound of every value, not of each channel's peak.
    Pointwise(String, Curve),
    /// As `Derived`, and not to be approximated: other quantities depend on it steeply.
    Exact(String, Curve),
}

/// The materials of a scene, flat. Spectra of parts are positions in `spectra` until [`Surfaces::name_spectra`].
#[derive(Default)]
pub struct Surfaces {
    pub materials: Vec<SurfaceMaterial>,
    pub parts: Vec<Part>,
    pub tables: Vec<f32>,
    pub spectra: Vec<Needed>,
    /// Bit `kind` for each [`Kind`] that occurs.
    pub kinds: u32,
    pub rough_base: bool,
    pub anisotropic: bool,
    /// Some boundary may leave one channel of a path.
    pub dispersion: bool,
    /// Some rough boundary bends each channel by itself.
    pub spread: bool,
    /// Where any material has some.
    pub textures: Option<Textures>,
    /// Some reflectance is a texture; of a coated base.
    pub textured: bool,
    pub textured_base: bool,
    /// Where textures are colours: the spectrum that says where in the visible a wavelength is.
    pub visible_place: Option<u32>,
    /// What blend textures leave of each part.
    shares: Vec<Vec<Share>>,
    /// Most records of a scattering event.
    pub vertex_records: u32,
    albedos: BTreeMap<[u64; 3], Arc<DielectricAlbedo>>,
}

/// Flux that a part scatters per flux arriving: (from behind, cosine, channel).
type Albedo = Box<dyn Fn(bool, f64, usize) -> f64>;

/// A part under construction.
struct Leaf {
    part: Part,
    /// Whether it scatters what comes from before, from behind.
    active: [bool; 2],
    albedo: Albedo,
    /// What blend textures leave of it.
    shares: Vec<Share>,
    /// Records that one evaluation takes; 0 for the only directions of mirrors and ideal refraction.
    records: u32,
}

impl Surfaces {
    /// Parts and tables of all materials of `scene`.
    pub fn new(scene: &Scene) -> Surfaces {
        let mut surfaces = Surfaces::default();
        for material in 0..scene.materials.len() {
            let mut leaves = Vec::new();
            surfaces.collect(scene, material, 1.0, &[], &mut leaves);
            surfaces.add(scene, leaves);
        }
        if !scene.textures.is_empty() {
            let mut textures = Textures::new(scene, |spectrum| surfaces.spectrum(spectrum));
            textures.add_shares(&surfaces.shares);
            if textures.colours {
                let place = surfaces.derived("place in the visible".to_owned(), textures::visible_place());
                surfaces.visible_place = Some(place);
            }
            surfaces.textures = Some(textures);
        }
        surfaces
    }

    pub fn has(&self, kind: Kind) -> bool {
        self.kinds >> kind as u32 & 1 == 1
    }

    /// Replaces positions in `spectra` by the ids that the device's tables gave them.
    pub fn name_spectra(&mut self, id: impl Fn(usize) -> u32) {
        let both = |word: u32| id((word & 0xffff) as usize) | id((word >> 16) as usize) << 16;
        let low = |word: u32| id((word & 0xffff) as usize) | word & 0xffff_0000;
        self.visible_place = self.visible_place.map(|position| id(position as usize));
        if let Some(textures) = &mut self.textures {
            textures.name_spectra(&id);
        }
        for part in &mut self.parts {
            match part.kind & 0xff {
                // A texture has its own.
                k if k == Kind::Lambert as u32 && part.kind & TEXTURED != 0 => {}
                k if k == Kind::Conductor as u32 || k == Kind::RoughConductor as u32 => part.ab = both(part.ab),
                k if k == Kind::Base as u32 && part.kind & TEXTURED != 0 => {
                    (part.ab, part.cd) = (low(part.ab), both(part.cd));
                }
                k if k == Kind::Base as u32 => (part.ab, part.cd) = (low(part.ab), low(part.cd)),
                k if k == Kind::BoundaryAgain as u32 || k == Kind::BeyondAgain as u32 => {
                    (part.ab, part.cd) = (low(part.ab), both(part.cd));
                }
                _ => part.ab = low(part.ab),
            }
        }
        self.albedos.clear();
        // Where nothing scatters, shaders still bind a part.
        if self.parts.is_empty() {
            self.parts.push(Part::default());
        }
    }

    /// Appends a material of these leaves, with the probabilities of choosing each.
    fn add(&mut self, scene: &Scene, leaves: Vec<Leaf>) {
        let channels = scene.channels.len();
        let mut survival = 0.0f64;
        let mut picks = vec![Vec::with_capacity(2 * (INTERVALS + 1)); leaves.len()];
        for side in 0..2 {
            for node in 0..=INTERVALS {
                let cosine = node as f64 / INTERVALS as f64;
                let albedo = |leaf: &Leaf, k: usize| match leaf.active[side] {
                    true => f64::from(leaf.part.weight) * (leaf.albedo)(side == 1, cosine, k).max(0.0),
                    false => 0.0,
                };
                let (q, largest) = probabilities(&leaves, channels, &albedo);
                survival = survival.max(largest);
                for (l, q) in q.iter().enumerate() {
                    picks[l].push(if leaves[l].active[side] { *q as f32 } else { 0.0 });
                }
            }
        }
        let diffuse = leaves.len() == 1 && leaves[0].part.kind & 0xff == Kind::Lambert as u32 && leaves[0].active[0];
        let diffuse = diffuse && leaves[0].part.weight == 1.0 && leaves[0].part.kind & TEXTURED == 0;
        let diffuse = diffuse && leaves[0].shares.is_empty();
        let transmits = leaves.iter().any(|leaf| leaf.part.kind & OPAQUE == 0);
        self.materials.push(SurfaceMaterial {
            first_part: self.parts.len() as u32,
            part_count: leaves.len() as u32,
            flags: if transmits { MATERIAL_TRANSMITS } else { 0 } | if diffuse { MATERIAL_DIFFUSE } else { 0 },
            survival: ((survival.min(1.0) * STEPS).ceil() / STEPS) as f32,
        });
        let spread: u32 = leaves.iter().map(|leaf| leaf.records).sum();
        self.vertex_records = self.vertex_records.max(spread + spread.max(2));
        for (leaf, picks) in leaves.into_iter().zip(picks) {
            self.kinds |= 1 << (leaf.part.kind & 0xff);
            let picks = self.table(&picks);
            self.parts.push(Part { picks, ..leaf.part });
            self.shares.push(leaf.shares);
        }
    }

    /// The leaves of `material` with their shares of `weight`.
    fn collect(&mut self, scene: &Scene, material: MaterialId, weight: f64, shares: &[Share], out: &mut Vec<Leaf>) {
        if weight == 0.0 {
            return;
        }
        let description = &scene.materials[material];
        let (opaque, leaves) = match description.bsdf {
            Bsdf::Black => (true, Vec::new()),
            Bsdf::Diffuse { reflectance } => (true, self.diffuse(scene, reflectance)),
            Bsdf::Conductor { eta, k, roughness, energy_compensation } => {
                let rough = (roughness[0] >= SMOOTH).then_some(roughness);
                (true, self.conductor(scene, &description.name, [eta, k], rough, energy_compensation))
            }
            Bsdf::Dielectric { eta, dispersion, roughness } => {
                let range = index_range(&scene.spectra[eta].curve, &scene.channels);
                let matched = range.iter().all(|eta| (eta - 1.0).abs() < MATCHED);
                let leaves = match roughness >= SMOOTH && !matched {
                    false => self.glass(scene, eta, dispersion),
                    true => self.rough_glass(scene, &description.name, eta, dispersion, roughness),
                };
                (false, leaves)
            }
            Bsdf::Plastic { reflectance, eta, roughness } => {
                let rough = (roughness >= SMOOTH).then_some(roughness);
                (true, self.plastic(scene, &description.name, reflectance, eta, rough))
            }
            Bsdf::Blend { a, b, weight: Weight::Constant(of_b) } => {
                self.collect(scene, a, weight * (1.0 - of_b), shares, out);
                return self.collect(scene, b, weight * of_b, shares, out);
            }
            Bsdf::Blend { a, b, weight: Weight::Texture(texture) } => {
                let with = |missing| [shares, &[(texture, missing)]].concat();
                self.collect(scene, a, weight, &with(true), out);
                return self.collect(scene, b, weight, &with(false), out);
            }
        };
        let two_sided = description.two_sided;
        for mut leaf in leaves {
            leaf.part.weight = weight as f32;
            leaf.shares = shares.to_vec();
            leaf.part.kind |= if opaque { OPAQUE } else { 0 } | if two_sided { TWO_SIDED } else { 0 };
            leaf.active = [true, !opaque || two_sided];
            if opaque {
                // The back of an opaque surface is as its front.
                let albedo = leaf.albedo;
                leaf.albedo = Box::new(move |_, cosine, k| albedo(false, cosine, k));
            }
            out.push(leaf);
        }
    }

    fn diffuse(&mut self, scene: &Scene, reflectance: Reflectance) -> Vec<Leaf> {
        let means = match reflectance {
            Reflectance::Spectrum(spectrum) => channel_means(scene, spectrum),
            Reflectance::Texture(texture) => textures::bound(scene, &scene.textures[texture]),
        };
        // What reflects in no channel is black.
        if means.iter().all(|m| *m <= 0.0) {
            return Vec::new();
        }
        let (part, records) = match reflectance {
            Reflectance::Spectrum(spectrum) => (Part { ab: self.spectrum(spectrum), ..part(Kind::Lambert) }, 1),
            Reflectance::Texture(texture) => {
                self.textured = true;
                let part = Part { kind: Kind::Lambert as u32 | TEXTURED, loss: texture as u32, ..Part::default() };
                (part, texture_records(&scene.textures[texture]))
            }
        };
        vec![leaf(part, records, move |_, _, k| means[k])]
    }

    fn conductor(
        &mut self,
        scene: &Scene,
        name: &str,
        [eta, k]: [SpectrumId; 2],
        roughness: Option<[f64; 2]>,
        compensation: bool,
    ) -> Vec<Leaf> {
        let [n, kappa] = [eta, k].map(|s| channel_means(scene, s));
        let ab = self.spectrum(eta) | self.spectrum(k) << 16;
        let reflectance = move |cosine: f64, k: usize| fresnel::conductor(cosine, n[k], kappa[k]);
        let Some(alpha) = roughness else {
            let part = Part { ab, ..part(Kind::Conductor) };
            return vec![leaf(part, 0, move |_, cosine, k| reflectance(cosine, k))];
        };
        self.anisotropic |= alpha[0] != alpha[1];
        let albedo = Arc::new(ReflectionAlbedo::new(alpha));
        let once = Part { ab, alpha: alpha.map(|a| a as f32), ..part(Kind::RoughConductor) };
        let single = Arc::clone(&albedo);
        let mut leaves =
            vec![leaf(once, 1, move |_, cosine, k| reflectance(cosine, k) * (1.0 - mean_over_turns(&single, cosine)))];
        let lost = albedo.mean_loss();
        if compensation && lost > 1e-7 {
            // F_ms of Kulla and Conty 2017, as `reference::bsdf` has it.
            let again = move |v: &[f64]| {
                let f = mean_conductor(v[0], v[1]);
                f * f * (1.0 - lost) / (1.0 - f * lost)
            };
            let curve = Curve::derived(&[&scene.spectra[eta].curve, &scene.spectra[k].curve], &scene.channels, again);
            let means = means_of(scene, &curve);
            let rows: Vec<f32> = albedo.rows().iter().flatten().map(|v| *v as f32).collect();
            let part = Part {
                ab: self.derived(format!("{name}, scattered again"), curve),
                alpha: alpha.map(|a| a as f32),
                loss: self.table(&rows),
                rows: albedo.rows().len() as u32,
                mean_loss: lost as f32,
                ..part(Kind::ConductorAgain)
            };
            leaves.push(leaf(part, 1, move |_, cosine, k| means[k] * mean_over_turns(&albedo, cosine)));
        }
        leaves
    }

    fn glass(&mut self, scene: &Scene, eta: SpectrumId, dispersion: bool) -> Vec<Leaf> {
        let index = Index::new(scene, eta, dispersion);
        self.dispersion |= index.disperses;
        let decision = Arc::new(ReflectionProbability::new(&scene.spectra[eta].curve, &scene.channels));
        let ab = self.spectrum(eta);
        let kind = if index.disperses { DISPERSES } else { 0 };
        let with = |k: Kind| Part { ab, kind: k as u32 | kind, eta: index.bending as f32, ..Part::default() };
        let through = Arc::clone(&decision);
        vec![
            leaf(with(Kind::Mirror), 0, move |behind, cosine, _| decision.at(behind, cosine)),
            leaf(with(Kind::Refraction), 0, move |behind, cosine, _| 1.0 - through.at(behind, cosine)),
        ]
    }

    fn rough_glass(&mut self, scene: &Scene, name: &str, eta: SpectrumId, dispersion: bool, alpha: f64) -> Vec<Leaf> {
        let index = Index::new(scene, eta, dispersion);
        let curve = &scene.spectra[eta].curve;
        let n = channel_means(scene, eta);
        let range = index_range(curve, &scene.channels);
        let albedo = self.dielectric_albedo(alpha, range);
        let number = self.eta_table(&albedo);
        let id = self.spectrum(eta);
        let decision = ReflectionProbability::new(curve, &scene.channels);
        let decisions: Vec<f32> = [false, true]
            .iter()
            .flat_map(|&behind| (0..=INTERVALS).map(move |i| (behind, i as f64 / INTERVALS as f64)))
            .map(|(behind, cosine)| decision.at(behind, cosine) as f32)
            .collect();
        let apart = |eta: f64| if (eta - 1.0).abs() < MATCHED { 1.0 + MATCHED.copysign(eta - 1.0) } else { eta };
        let narrow = index.disperses && bends_apart(range, index.bending, alpha);
        self.dispersion |= index.disperses;
        self.spread |= index.disperses && !narrow;
        let boundary = Part {
            kind: Kind::RoughBoundary as u32
                | if index.disperses { DISPERSES } else { 0 }
                | if narrow { NARROW } else { 0 },
            ab: id,
            alpha: [alpha as f32; 2],
            decision: self.table(&decisions),
            eta: apart(index.bending) as f32,
            eta_least: apart(range[0]) as f32,
            eta_greatest: apart(range[1]) as f32,
            ..Part::default()
        };
        let (table, indices) = (Arc::clone(&albedo), n.clone());
        let mut leaves = vec![leaf(boundary, 2, move |behind, cosine, k| 1.0 - table.loss(indices[k], behind, cosine))];

        // What is scattered again, by `reference::bsdf::dielectric`'s reciprocal split between both sides: the share over
        // the mean loss of the side it goes to.
        let share = |albedo: &DielectricAlbedo, eta: f64, behind: bool, passes: bool| {
            let relative = if behind { 1.0 / eta } else { eta };
            let here = albedo.mean_loss(eta, behind);
            let beyond = albedo.mean_loss(eta, !behind) * relative * relative;
            let factor = if passes { relative * relative } else { 1.0 };
            if here + beyond > 0.0 { factor / (here + beyond) } else { 0.0 }
        };
        for passes in [false, true] {
            let mut of_side = |behind: bool| {
                let bending = if behind { 1.0 / index.bending } else { index.bending };
                let own = |eta: f64| if behind { 1.0 / eta } else { eta };
                let radiance = |eta: f64| match (passes, index.disperses) {
                    (false, _) => 1.0,
                    (true, true) => own(eta).powi(-2),
                    (true, false) => bending.powi(-2),
                };
                let f = |v: &[f64]| share(&albedo, v[0], behind, passes) * radiance(v[0]);
                let side = if behind { "behind" } else { "before" };
                let way = if passes { "transmitted" } else { "reflected" };
                let derived = Curve::derived(&[curve], &scene.channels, f);
                self.derived(format!("{name}, {way} again from {side}"), derived)
            };
            let cd = of_side(false) | of_side(true) << 16;
            let kind = if passes { Kind::BeyondAgain } else { Kind::BoundaryAgain };
            let part = Part { ab: id | number << 16, cd, alpha: [alpha as f32; 2], ..part(kind) };
            let (table, indices) = (Arc::clone(&albedo), n.clone());
            leaves.push(leaf(part, 3, move |behind, cosine, k| {
                let eta = indices[k];
                let mean = table.mean_loss(eta, behind != passes);
                share(&table, eta, behind, passes) * mean * table.loss(eta, behind, cosine)
            }));
        }
        leaves
    }

    fn plastic(
        &mut self,
        scene: &Scene,
        name: &str,
        reflectance: Reflectance,
        eta: SpectrumId,
        roughness: Option<f64>,
    ) -> Vec<Leaf> {
        let of_index = &scene.spectra[eta].curve;
        let n = channel_means(scene, eta);
        let id = self.spectrum(eta);
        let rough = roughness.map(|alpha| self.dielectric_albedo(alpha, index_range(of_index, &scene.channels)));
        let table = rough.clone();
        let mean_reflected = move |eta: f64| match &table {
            None => mean_dielectric(eta),
            Some(table) => table.mean_reflected(eta, false),
        };
        // ρ τ / (1 - ρ (1 - τ)) over the mean transmittance, by `reference::bsdf::plastic`.
        let inner = |v: &[f64]| {
            let mean = 1.0 - mean_reflected(v[1]);
            let leaves = mean / (v[1] * v[1]);
            v[0] * leaves / (1.0 - v[0] * (1.0 - leaves)) / mean
        };
        let (cd, base_means, textured, records) = match reflectance {
            Reflectance::Spectrum(spectrum) => {
                let curve = Curve::derived(&[&scene.spectra[spectrum].curve, of_index], &scene.channels, inner);
                let means = means_of(scene, &curve);
                (self.derived(format!("{name}, base"), curve), means, Part::default(), 3)
            }
            Reflectance::Texture(id) => {
                (self.textured, self.textured_base) = (true, true);
                let bound = textures::bound(scene, &scene.textures[id]);
                let means = bound.iter().zip(&n).map(|(rho, eta)| inner(&[*rho, *eta])).collect();
                // What the coat sends back to the base, and τ over the mean transmittance.
                let back = |v: &[f64]| 1.0 - (1.0 - mean_reflected(v[0])) / (v[0] * v[0]);
                let back = Curve::derived(&[of_index], &scene.channels, back);
                let square = Curve::derived(&[of_index], &scene.channels, |v| (v[0] * v[0]).recip());
                let back = self.derived(format!("{name}, back to the base"), back);
                let square = self.derived(format!("{name}, out of the base"), square);
                let part = Part { kind: TEXTURED, loss: id as u32, ..Part::default() };
                (back | square << 16, means, part, texture_records(&scene.textures[id]) + 4)
            }
        };
        let alpha = [roughness.unwrap_or(0.0) as f32; 2];
        // Seen from outside nothing is totally reflected, whatever the index.
        let coat_kind = if roughness.is_some() { Kind::RoughCoat } else { Kind::Mirror };
        let coat = Part { kind: coat_kind as u32 | DISPERSES, ab: id, alpha, eta: 1.0, ..Part::default() };
        let number = rough.as_ref().map_or(0, |table| self.eta_table(table));
        self.rough_base |= rough.is_some();
        let kind = Kind::Base as u32 | textured.kind;
        let base = Part { kind, ab: id | number << 16, cd, alpha, ..textured };
        let mean: Vec<f64> = n.iter().map(|&eta| 1.0 - mean_reflected(eta)).collect();
        let reflected = Arc::new(move |cosine: f64, k: usize| match &rough {
            None => fresnel::dielectric(cosine, n[k]),
            Some(table) => table.reflected(n[k], false, cosine),
        });
        let of_coat = Arc::clone(&reflected);
        vec![
            leaf(coat, u32::from(roughness.is_some()), move |_, cosine, k| of_coat(cosine, k)),
            leaf(base, records, move |_, cosine, k| (1.0 - reflected(cosine, k)) * base_means[k] * mean[k]),
        ]
    }

    /// The position of a scene's spectrum among those needed.
    pub(super) fn spectrum(&mut self, id: SpectrumId) -> u32 {
        let known = self.spectra.iter().position(|s| *s == Needed::Scene(id));
        known.unwrap_or_else(|| {
            self.spectra.push(Needed::Scene(id));
            self.spectra.len() - 1
        }) as u32
    }

    pub(super) fn derived(&mut self, name: String, curve: Curve) -> u32 {
        self.need(Needed::Derived(name, curve))
    }

    pub(super) fn need(&mut self, spectrum: Needed) -> u32 {
        self.spectra.push(spectrum);
        self.spectra.len() as u32 - 1
    }

    /// Appends what blend textures leave of something, and gives where that stands.
    pub(super) fn append_shares(&mut self, shares: &[Share]) -> u32 {
        self.textures.as_mut().expect("shares are of textures").append_shares(shares)
    }

    fn table(&mut self, values: &[f32]) -> u32 {
        self.tables.extend_from_slice(values);
        (self.tables.len() - values.len()) as u32
    }

    pub(super) fn dielectric_albedo(&mut self, alpha: f64, range: [f64; 2]) -> Arc<DielectricAlbedo> {
        let key = [alpha, range[0], range[1]].map(f64::to_bits);
        Arc::clone(self.albedos.entry(key).or_insert_with(|| Arc::new(DielectricAlbedo::new(alpha, range))))
    }

    /// Appends a table over index and cosine, as `eta_table` in `program.wgsl` reads it, and gives its number.
    pub(super) fn eta_table(&mut self, albedo: &DielectricAlbedo) -> u32 {
        let aligned = self.tables.len().next_multiple_of(ROW);
        self.tables.resize(aligned, 0.0);
        let (first, step, columns) = albedo.columns();
        let mut head = [0.0; ROW];
        head[..3].copy_from_slice(&[first, if step > 0.0 { 1.0 / step } else { 0.0 }, columns.len() as f64]);
        let values = head.iter().chain(columns.iter().flatten().copied().flatten());
        self.tables.extend(values.map(|v| *v as f32));
        (aligned / ROW) as u32
    }
}

/// Most records that a textured reflectance takes.
pub(super) fn texture_records(texture: &Texture) -> u32 {
    match &texture.kind {
        TextureKind::Colour => 4,
        TextureKind::Mixture(endmembers) => endmembers.len() as u32,
        TextureKind::Number => unreachable!("numbers are no reflectance"),
    }
}

/// The wavelength in µm, linear in every channel.
pub(super) fn wavelength(scene: &Scene) -> Needed {
    let bounds = scene.channels.bounds.iter().flatten();
    let [low, high] = bounds.fold([f64::INFINITY, 0.0f64], |[low, high], &nm| [low.min(nm), high.max(nm)]);
    let curve = Curve::Linear { nm: vec![low, high], value: vec![low * 1e-3, high * 1e-3], outside: Outside::Hold };
    Needed::Exact("wavelength".into(), curve)
}

/// The index of a boundary.
struct Index {
    /// Behind over before; what all channels bend by, or the mean of those they bend by.
    bending: f64,
    /// Whether channels bend by their own.
    disperses: bool,
}

impl Index {
    fn new(scene: &Scene, eta: SpectrumId, dispersion: bool) -> Index {
        let means = channel_means(scene, eta);
        let [least, greatest] = index_range(&scene.spectra[eta].curve, &scene.channels);
        Index { bending: means.iter().sum::<f64>() / means.len() as f64, disperses: dispersion && least != greatest }
    }
}

/// Whether the directions in which the extreme indices bend differ by more than the lobe of roughness `alpha` is wide: at 45
/// degrees, where a facet that tilts by δ turns what it refracts by about (1 - 1/η) δ.
fn bends_apart(range: [f64; 2], eta: f64, alpha: f64) -> bool {
    let refracted = |eta: f64| (0.5f64.sqrt() / eta.max(1.0 / eta)).asin();
    (refracted(range[0]) - refracted(range[1])).abs() > alpha * (1.0 - 1.0 / eta).abs()
}

fn part(kind: Kind) -> Part {
    Part { kind: kind as u32, ..Part::default() }
}

fn leaf(part: Part, records: u32, albedo: impl Fn(bool, f64, usize) -> f64 + 'static) -> Leaf {
    Leaf { part, active: [true; 2], albedo: Box::new(albedo), shares: Vec::new(), records }
}

/// The mean of `curve` over each channel.
fn means_of(scene: &Scene, curve: &Curve) -> Vec<f64> {
    scene.channels.bounds.iter().map(|b| curve.mean(b[0], b[1])).collect()
}

fn channel_means(scene: &Scene, spectrum: SpectrumId) -> Vec<f64> {
    means_of(scene, &scene.spectra[spectrum].curve)
}

/// What single scattering loses, the mean over a few azimuths: for decisions.
fn mean_over_turns(albedo: &ReflectionAlbedo, cosine: f64) -> f64 {
    let turns = if albedo.rows().len() == 1 { 1 } else { 4 };
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    let direction = |i: usize| {
        let (sin, cos) = ((i as f64 + 0.5) / turns as f64 * std::f64::consts::FRAC_PI_2).sin_cos();
        DVec3::new(sine * cos, sine * sin, cosine)
    };
    (0..turns).map(|i| albedo.loss(direction(i))).sum::<f64>() / turns as f64
}

/// q by shares (docs/METHOD.md, Decisions) for the leaves at one cosine, and the largest albedo of all together.
fn probabilities(leaves: &[Leaf], channels: usize, albedo: &dyn Fn(&Leaf, usize) -> f64) -> (Vec<f64>, f64) {
    let (mut mean, mut largest) = (vec![0.0; leaves.len()], vec![0.0f64; leaves.len()]);
    let (mut lit, mut most) = (0.0, 0.0f64);
    let mut albedos = vec![0.0; leaves.len()];
    for k in 0..channels {
        for (value, leaf) in albedos.iter_mut().zip(leaves) {
            *value = albedo(leaf, k);
        }
        let total: f64 = albedos.iter().sum();
        if total > 0.0 {
            lit += 1.0;
            most = most.max(total);
            for (l, value) in albedos.iter().enumerate() {
                mean[l] += value / total;
                largest[l] = largest[l].max(value / total);
            }
        }
    }
    if lit == 0.0 {
        return (vec![1.0 / leaves.len() as f64; leaves.len()], 0.0);
    }
    let of_all: f64 = largest.iter().sum();
    (mean.iter().zip(&largest).map(|(m, l)| 0.5 * m / lit + 0.5 * l / of_all).collect(), most)
}
