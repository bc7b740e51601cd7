//! Materials of general scenes as devices get them: lists of lobes, tables, and the spectra that these need.

use crate::device::part::{Part, Place, Records, SceneBuffer};
use crate::device::parts::by_technique::{self, Way};
use crate::device::parts::geometry::{FEWER_MATERIALS, MATERIALS};
use crate::device::parts::lights::STEPS;
use crate::device::parts::lobe_choice::{self, LobeChoice};
use crate::device::parts::lobes::Leaf;
use crate::device::parts::roughness;
use crate::device::parts::techniques::{Asking, Techniques};
use crate::device::parts::textures::{self, Share, Textures};
use crate::device::text::{Module, module};
use crate::device::words::{
    ALBEDO_ROW, COSINE_INTERVALS, LOBE_BASE, LOBE_BEYOND_AGAIN, LOBE_BOUNDARY_AGAIN, LOBE_CONDUCTOR,
    LOBE_CONDUCTOR_AGAIN, LOBE_LAMBERT, LOBE_MIRROR, LOBE_OPAQUE, LOBE_REFRACTION, LOBE_ROUGH_BOUNDARY,
    LOBE_ROUGH_COAT, LOBE_ROUGH_CONDUCTOR, LOBE_TEXTURED, LOBE_TRANSMITTED, LOBE_TWO_SIDED, Lobe, MASK_SHIFT,
    MATERIAL_BY_TECHNIQUE, MATERIAL_DIFFUSE, MATERIAL_MASK_IS_TEXTURE, MATERIAL_MASKED, MATERIAL_TRANSMITS,
    SurfaceMaterial,
};
use crate::scene::{Attributes, Bsdf, MaterialId, Scene, SpectrumId, Texture, TextureKind, Weight};
use crate::spectral::hemisphere::IndexTable;
use crate::spectral::{Curve, Outside};

/// What a lobe does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Kind {
    Lambert = LOBE_LAMBERT,
    Conductor = LOBE_CONDUCTOR,
    RoughConductor = LOBE_ROUGH_CONDUCTOR,
    ConductorAgain = LOBE_CONDUCTOR_AGAIN,
    Mirror = LOBE_MIRROR,
    Refraction = LOBE_REFRACTION,
    RoughBoundary = LOBE_ROUGH_BOUNDARY,
    BoundaryAgain = LOBE_BOUNDARY_AGAIN,
    BeyondAgain = LOBE_BEYOND_AGAIN,
    RoughCoat = LOBE_ROUGH_COAT,
    Base = LOBE_BASE,
    Transmitted = LOBE_TRANSMITTED,
}

/// Intervals of the device's tables over the cosine.
pub(super) const INTERVALS: usize = COSINE_INTERVALS as usize;
/// Values in a row of a table of albedos; what the numbers of tables over index and cosine count in.
const ROW: usize = ALBEDO_ROW as usize;
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

/// The materials of a scene, flat. Spectra of lobes are positions in `spectra` until [`Surfaces::name_spectra`].
#[derive(Default)]
pub struct Surfaces {
    pub materials: Vec<SurfaceMaterial>,
    pub lobes: Vec<Lobe>,
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
    /// Materials of which each technique has its own chances for the lobes.
    pub by_technique: u32,
    /// Some rough boundary bends paths by the indices of techniques.
    pub bends_by_technique: bool,
    /// Where any material has some.
    pub textures: Option<Textures>,
    /// Some reflectance is a texture; of a coated base.
    pub textured: bool,
    pub textured_base: bool,
    /// Where textures are colours: the spectrum that says where in the visible a wavelength is.
    pub visible_place: Option<u32>,
    /// What blend textures leave of each lobe.
    pub(super) shares: Vec<Vec<Share>>,
    /// Of lobes whose roughness is a texture.
    pub(super) by_place: Vec<roughness::Words>,
    /// Some surface carries texture coordinates, normals or axes; some of them shading normals.
    pub attributes: bool,
    pub smooth: bool,
    /// Some material lets rays pass; some of them by a texture.
    pub masked: bool,
    pub masks: bool,
    /// Most records of a scattering event.
    pub vertex_records: u32,
}

/// Lists of lobes, and records that are instructions of a small program.
pub const LOBES: Part = Part {
    name: "materials of several lobes",
    used: |scene| scene.is_general(),
    effect: |_| "records of 16 bytes instead of 8".into(),
    is_planned: true,
    modules: &[
        (Place::Generate, module!("common/record.wgsl")),
        (Place::Generate, module!("common/append.wgsl")),
        (Place::Generate, TABLES),
        (Place::Generate, module!("parts/surfaces/material.wgsl")),
        (Place::Generate, module!("parts/surfaces/ggx.wgsl")),
        (Place::Generate, module!("parts/surfaces/bsdf.wgsl")),
        (Place::Generate, module!("parts/surfaces/choice.wgsl")),
        (Place::Evaluate, module!("common/record.wgsl")),
        (Place::Evaluate, module!("common/program.wgsl")),
    ],
    defines: |scene, _, defines| {
        let Some(surfaces) = &scene.surfaces else { return };
        defines.set("GENERAL", true).constant("STATE_WORDS", scene.state_bytes() / 16);
        defines.set("THIRD_STATE", scene.media.is_some() || scene.disperses());
        for (name, kinds) in LOBES_OF_CODE {
            defines.set(name, kinds.iter().any(|kind| surfaces.has(*kind)));
        }
        defines.set("ROUGH_BASE", surfaces.rough_base);
        defines.set("OP_ETA_TABLE", surfaces.has(Kind::RoughBoundary) || surfaces.rough_base);
    },
    buffers: |scene| {
        let Some(surfaces) = &scene.prepared.surfaces else { return Vec::new() };
        vec![
            SceneBuffer::new("surface_materials", &surfaces.materials, MATERIALS, FEWER_MATERIALS),
            SceneBuffer::new("lobes", &surfaces.lobes, MATERIALS, FEWER_MATERIALS),
            SceneBuffer::new("tables", &surfaces.tables, MATERIALS, FEWER_MATERIALS),
        ]
    },
    records: |scene| Records { vertex: scene.surfaces.as_ref().map_or(0, |s| s.vertex_records), ..Records::NONE },
    example: Some(|exhibit| exhibit.add_surfaces()),
    ..Part::NOTHING
};

const TABLES: Module = module!("common/tables.wgsl");

/// Code that some kinds of lobes share, by its switch.
const LOBES_OF_CODE: [(&str, &[Kind]); 14] = [
    ("MIRRORS", &[Kind::Conductor, Kind::Mirror, Kind::Refraction]),
    ("MICROFACETS", &[Kind::RoughConductor, Kind::RoughCoat, Kind::RoughBoundary]),
    ("GLASS", &[Kind::Mirror, Kind::RoughBoundary]),
    ("CONDUCTOR", &[Kind::Conductor]),
    ("ROUGH_CONDUCTOR", &[Kind::RoughConductor]),
    ("CONDUCTOR_AGAIN", &[Kind::ConductorAgain]),
    ("MIRROR", &[Kind::Mirror]),
    ("REFRACTION", &[Kind::Refraction]),
    ("ROUGH_GLASS", &[Kind::RoughBoundary]),
    ("ROUGH_COAT", &[Kind::RoughCoat]),
    ("BASE", &[Kind::Base]),
    ("TRANSMITTED", &[Kind::Transmitted]),
    ("OP_CONDUCTOR", &[Kind::Conductor, Kind::RoughConductor]),
    ("OP_FRESNEL", &[Kind::Mirror, Kind::Refraction, Kind::RoughBoundary, Kind::RoughCoat, Kind::Base]),
];

/// Light that passes through leaves; `LOBES` has its code.
pub const TRANSMISSION: Part = Part {
    name: "diffuse transmission",
    used: |scene| scene.surfaces.as_ref().is_some_and(|surfaces| surfaces.has(Kind::Transmitted)),
    effect: |_| "shadow rays on both sides".into(),
    is_planned: true,
    example: Some(|exhibit| exhibit.add_leaf()),
    ..Part::NOTHING
};

pub const BRUSHED: Part = Part {
    name: "roughness along and across",
    used: |scene| scene.surfaces.as_ref().is_some_and(|surfaces| surfaces.anisotropic),
    modules: &[(Place::Generate, module!("parts/surfaces/tangent.wgsl"))],
    defines: |_, _, defines| _ = defines.set("ANISOTROPIC", true),
    example: Some(|exhibit| exhibit.add_brushed_metal()),
    ..Part::NOTHING
};

/// Rough boundaries whose losses evaluation looks up, for each channel's index.
pub const TABLES_IN_EVALUATION: Part = Part {
    name: "tables over index and cosine",
    used: |scene| scene.surfaces.as_ref().is_some_and(|s| s.has(Kind::BoundaryAgain) || s.rough_base),
    modules: &[(Place::Evaluate, TABLES)],
    example: Some(|exhibit| exhibit.add_rough_glass()),
    ..Part::NOTHING
};

pub const DISPERSION: Part = Part {
    name: "dispersion",
    used: |scene| scene.disperses(),
    effect: |_| "16 bytes a path".into(),
    is_planned: true,
    modules: &[
        (Place::Generate, module!("parts/spectra/channel.wgsl")),
        (Place::Stage, module!("stages/leave_one_channel.wgsl")),
    ],
    lines: &[("ONLY_DIRECTION", "leave_one_channel(&list, &path, choice);")],
    defines: |scene, _, defines| {
        let spread = scene.surfaces.as_ref().is_some_and(|surfaces| surfaces.spread);
        defines.set("DISPERSION", true).set("OP_ONLY", true);
        defines.set("OP_ROUGH_TRANSMIT", spread).set("RAW_RECORDS", spread);
    },
    state_words: |_| 1,
    example: Some(|exhibit| exhibit.add_glass()),
    ..Part::NOTHING
};

/// The one channel's index may have knots.
pub const KNOTS_OF_ONE_CHANNEL: Part = Part {
    name: "dispersion by exact knots",
    used: |scene| scene.features.knots && (DISPERSION.used)(scene),
    modules: &[(Place::Generate, super::spectra::KNOT_VALUES)],
    ..Part::NOTHING
};

/// The materials of a scene, before it is known by how many techniques paths decide.
pub struct Collected {
    surfaces: Surfaces,
    materials: Vec<OfMaterial>,
}

struct OfMaterial {
    leaves: Vec<Leaf>,
    mask: u32,
    /// Whether techniques have chances of their own.
    asks: bool,
}

impl Collected {
    /// Parts of all materials of `scene`, which ask for techniques.
    pub fn new(scene: &Scene, asking: &mut Asking) -> Collected {
        let carries = |f: &dyn Fn(&Attributes) -> bool| scene.objects.iter().any(|object| f(&object.attributes));
        let mut surfaces = Surfaces {
            attributes: carries(&|attributes| *attributes != Attributes::default()),
            smooth: carries(&|attributes| attributes.normals.is_some()),
            ..Surfaces::default()
        };
        // First in the tables, where few bits tell their places.
        let masks: Vec<u32> = scene.materials.iter().map(|material| surfaces.mask(material.opacity)).collect();
        let materials = masks.into_iter().enumerate().map(|(material, mask)| {
            let mut leaves = Vec::new();
            surfaces.collect(scene, material, 1.0, &[], &mut leaves);
            OfMaterial { leaves, mask, asks: false }
        });
        let mut materials: Vec<OfMaterial> = materials.collect();
        let choices = materials.iter().zip(&scene.materials).map(|(of, material)| {
            let by_shares =
                |albedo: &dyn Fn(&Leaf, usize) -> f64| probabilities(&of.leaves, scene.channels.len(), albedo).0;
            LobeChoice::new(scene, &material.name, &of.leaves, by_shares)
        });
        let asks = lobe_choice::ask(scene, choices.collect(), asking);
        for ((of, asks), material) in materials.iter_mut().zip(asks).zip(&scene.materials) {
            of.asks = asks;
            for bends in of.leaves.iter().filter_map(|leaf| leaf.bends.as_ref()) {
                of.asks |= by_technique::ask_for_bends(&material.name, bends, asking);
            }
        }
        Collected { surfaces, materials }
    }

    /// With the tables of all materials.
    pub fn finish(self, scene: &Scene, techniques: &Techniques) -> Surfaces {
        let Collected { mut surfaces, materials } = self;
        for material in materials {
            surfaces.add(scene, material, techniques);
        }
        if !scene.textures.is_empty() {
            let mut textures = Textures::new(scene, |spectrum| surfaces.spectrum(spectrum));
            textures.add_shares(&surfaces.shares);
            if textures.colours {
                let place = surfaces.derived("place in the visible".to_owned(), textures::visible_place());
                surfaces.visible_place = Some(place);
            }
            surfaces.textures = Some(textures);
            surfaces.add_roughnesses();
        }
        surfaces
    }
}

impl Surfaces {
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
        for lobe in &mut self.lobes {
            match lobe.kind & 0xff {
                // A texture has its own.
                k if (k == Kind::Lambert as u32 || k == Kind::Transmitted as u32) && lobe.kind & LOBE_TEXTURED != 0 => {
                }
                k if k == Kind::Conductor as u32 || k == Kind::RoughConductor as u32 => lobe.ab = both(lobe.ab),
                k if k == Kind::Base as u32 && lobe.kind & LOBE_TEXTURED != 0 => {
                    (lobe.ab, lobe.cd) = (low(lobe.ab), both(lobe.cd));
                }
                k if k == Kind::Base as u32 => (lobe.ab, lobe.cd) = (low(lobe.ab), low(lobe.cd)),
                k if k == Kind::BoundaryAgain as u32 || k == Kind::BeyondAgain as u32 => {
                    (lobe.ab, lobe.cd) = (low(lobe.ab), both(lobe.cd));
                }
                _ => lobe.ab = low(lobe.ab),
            }
        }
        // Where nothing scatters, shaders still bind a lobe.
        if self.lobes.is_empty() {
            self.lobes.push(Lobe::default());
        }
    }

    /// The flags of a material of some opacity.
    fn mask(&mut self, opacity: Option<Weight>) -> u32 {
        let Some(opacity) = opacity else { return 0 };
        self.masked = true;
        match opacity {
            Weight::Constant(opacity) => MATERIAL_MASKED | self.table(&[opacity as f32]) << MASK_SHIFT,
            Weight::Texture(texture) => {
                self.masks = true;
                MATERIAL_MASKED | MATERIAL_MASK_IS_TEXTURE | (texture as u32) << MASK_SHIFT
            }
        }
    }

    /// Appends a material, with the probabilities of choosing each of its leaves.
    fn add(&mut self, scene: &Scene, material: OfMaterial, techniques: &Techniques) {
        let OfMaterial { mut leaves, mask, asks } = material;
        let asks = asks && techniques.are_several();
        let (mut picks, survival) = chances(scene, &leaves);
        if asks {
            let own = by_technique::tables(&leaves, techniques, &picks);
            picks.iter_mut().zip(own).for_each(|(picks, own)| picks.extend(own));
            self.by_technique += 1;
        }
        for leaf in &mut leaves {
            if let Some(bends) = &leaf.bends {
                let way = bends.decide(&mut leaf.lobe, techniques, |values| self.table(values));
                self.spread |= way != Way::One;
                self.bends_by_technique |= way == Way::ByTechnique;
            }
        }
        let diffuse = leaves.len() == 1 && leaves[0].lobe.kind & 0xff == Kind::Lambert as u32 && leaves[0].active[0];
        let diffuse = diffuse && leaves[0].lobe.weight == 1.0 && leaves[0].lobe.kind & LOBE_TEXTURED == 0;
        let diffuse = diffuse && leaves[0].shares.is_empty();
        let transmits = leaves.iter().any(|leaf| leaf.lobe.kind & LOBE_OPAQUE == 0);
        let flag = |is: bool, flag: u32| if is { flag } else { 0 };
        self.materials.push(SurfaceMaterial {
            first_lobe: self.lobes.len() as u32,
            lobe_count: leaves.len() as u32,
            flags: flag(transmits, MATERIAL_TRANSMITS)
                | flag(diffuse, MATERIAL_DIFFUSE)
                | flag(asks, MATERIAL_BY_TECHNIQUE)
                | mask,
            survival: ((survival.min(1.0) * STEPS).ceil() / STEPS) as f32,
        });
        let spread: u32 = leaves.iter().map(|leaf| leaf.records).sum();
        self.vertex_records = self.vertex_records.max(spread + spread.max(2));
        let first = self.lobes.len();
        let mut by_place = Vec::new();
        for (leaf, picks) in leaves.into_iter().zip(picks) {
            self.kinds |= 1 << (leaf.lobe.kind & 0xff);
            let picks = self.table(&picks);
            self.lobes.push(Lobe { picks, ..leaf.lobe });
            self.shares.push(leaf.shares);
            by_place.push(leaf.by_place);
        }
        for (p, by_place) in by_place.into_iter().enumerate() {
            if let Some(by_place) = by_place {
                self.lobes[first + p].rows = self.add_variants(by_place);
            }
        }
    }

    /// The leaves of `material` with their shares of `weight`.
    fn collect(&mut self, scene: &Scene, material: MaterialId, weight: f64, shares: &[Share], out: &mut Vec<Leaf>) {
        if weight == 0.0 {
            return;
        }
        let description = &scene.materials[material];
        let name = &description.name;
        let (opaque, leaves) = match description.bsdf {
            Bsdf::Black => (true, Vec::new()),
            Bsdf::Diffuse { reflectance } => (true, self.diffuse(scene, reflectance)),
            Bsdf::Translucent { reflectance, transmittance } => {
                let mut leaves = self.diffuse(scene, reflectance);
                let through = self.diffuse(scene, transmittance).into_iter().map(|mut leaf| {
                    leaf.lobe.kind += Kind::Transmitted as u32 - Kind::Lambert as u32;
                    leaf
                });
                leaves.extend(through);
                (false, leaves)
            }
            Bsdf::Conductor { eta, k, roughness, energy_compensation } => {
                let at = |surfaces: &mut Surfaces, alpha| {
                    surfaces.conductor(scene, name, [eta, k], alpha, energy_compensation)
                };
                (true, self.of_roughness(scene, roughness, at))
            }
            Bsdf::Dielectric { eta, dispersion, roughness } => {
                let at = |surfaces: &mut Surfaces, alpha| surfaces.dielectric(scene, name, eta, dispersion, alpha);
                (false, self.of_roughness(scene, roughness, at))
            }
            Bsdf::Plastic { reflectance, eta, roughness } => {
                let at = |surfaces: &mut Surfaces, alpha| surfaces.plastic(scene, name, reflectance, eta, alpha);
                (true, self.of_roughness(scene, roughness, at))
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
            leaf.lobe.weight = weight as f32;
            leaf.shares = shares.to_vec();
            leaf.lobe.kind |= if opaque { LOBE_OPAQUE } else { 0 } | if two_sided { LOBE_TWO_SIDED } else { 0 };
            leaf.active = [true, !opaque || two_sided];
            if opaque {
                // The back of an opaque surface is as its front.
                let albedo = leaf.albedo;
                leaf.albedo = Box::new(move |_, cosine, k| albedo(false, cosine, k));
            }
            out.push(leaf);
        }
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

    pub fn need(&mut self, spectrum: Needed) -> u32 {
        self.spectra.push(spectrum);
        self.spectra.len() as u32 - 1
    }

    /// Appends what blend textures leave of something, and gives where that stands.
    pub(super) fn append_shares(&mut self, shares: &[Share]) -> u32 {
        self.textures.as_mut().expect("shares are of textures").append_shares(shares)
    }

    pub(super) fn table(&mut self, values: &[f32]) -> u32 {
        self.tables.extend_from_slice(values);
        (self.tables.len() - values.len()) as u32
    }

    /// Appends a table over index and cosine, as `eta_table` in `program.wgsl` reads it, and gives its number.
    pub(super) fn eta_table(&mut self, IndexTable { first, step, columns }: IndexTable) -> u32 {
        let aligned = self.tables.len().next_multiple_of(ROW);
        self.tables.resize(aligned, 0.0);
        let mut head = [0.0; ROW];
        head[..3].copy_from_slice(&[first, if step > 0.0 { 1.0 / step } else { 0.0 }, columns.len() as f64]);
        let values = head.iter().chain(columns.iter().flatten().copied().flatten());
        self.tables.extend(values.map(|v| *v as f32));
        (aligned / ROW) as u32
    }
}

/// Most records that a textured reflectance or radiance takes.
pub(super) fn texture_records(texture: &Texture) -> u32 {
    match &texture.kind {
        TextureKind::Colour => 4,
        TextureKind::Mixture(endmembers) => endmembers.len() as u32,
        // Its colour and daylight.
        TextureKind::Light(_) => 8,
        TextureKind::Number => unreachable!("numbers are no spectra"),
    }
}

/// The wavelength in µm, linear in every channel.
pub(super) fn wavelength(scene: &Scene) -> Needed {
    let [low, high] = scene.channels.hull().expect("a scene has channels");
    let curve = Curve::Linear { nm: vec![low, high], value: vec![low * 1e-3, high * 1e-3], outside: Outside::Hold };
    Needed::Exact("wavelength".into(), curve)
}

/// Chances of every leaf at [before, behind][257 cosines], by shares; and the largest albedo of all together.
fn chances(scene: &Scene, leaves: &[Leaf]) -> (Vec<Vec<f32>>, f64) {
    let mut survival = 0.0f64;
    let mut picks = vec![Vec::with_capacity(2 * (INTERVALS + 1)); leaves.len()];
    for side in 0..2 {
        for node in 0..=INTERVALS {
            let cosine = node as f64 / INTERVALS as f64;
            let albedo = |leaf: &Leaf, k: usize| leaf.scattered(side == 1, cosine, k);
            let (q, largest) = probabilities(leaves, scene.channels.len(), &albedo);
            survival = survival.max(largest);
            for (l, q) in q.iter().enumerate() {
                picks[l].push(if leaves[l].active[side] { *q as f32 } else { 0.0 });
            }
        }
    }
    (picks, survival)
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
