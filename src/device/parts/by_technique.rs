//! Surfaces whose decisions differ by technique (docs/METHOD.md, Techniques): lobes among which channels would choose by chances of their
//! own, and rough boundaries that bend channels further apart than the lobe is wide.

use std::ops::Range;

use crate::device::part::{Part, Place};
use crate::device::parts::lobes::Leaf;
use crate::device::parts::surfaces::{INTERVALS, Kind};
use crate::device::parts::techniques::{Asking, Techniques};
use crate::device::parts::textures;
use crate::device::text::module;
use crate::device::words::{LOBE_BY_TECHNIQUE, LOBE_NARROW, Lobe};
use crate::scene::Scene;

pub const LOBES: Part = Part {
    name: "lobes chosen by technique",
    used: |scene| scene.surfaces.as_ref().is_some_and(|surfaces| surfaces.by_technique > 0),
    effect: |scene| {
        let count = scene.surfaces.as_ref().map_or(0, |surfaces| surfaces.by_technique);
        format!("tables of chances for each technique in {count} material{}", if count == 1 { "" } else { "s" })
    },
    is_planned: true,
    modules: &[(Place::Generate, module!("parts/techniques/lobes.wgsl"))],
    lines: &[("SURFACE_DENSITY", "if (!to_light) { chosen_densities = densities; }")],
    defines: |_, _, defines| _ = defines.set("BY_TECHNIQUE", true),
    example: Some(|exhibit| exhibit.add_saturated_blend()),
    ..Part::NOTHING
};

pub const BOUNDARIES: Part = Part {
    name: "rough dispersion by technique",
    used: |scene| scene.surfaces.as_ref().is_some_and(|surfaces| surfaces.bends_by_technique),
    effect: |_| "the density of each refracted direction under each technique; all channels go on".into(),
    is_planned: true,
    lines: &[("BEGIN", "lone_channel = path.live; lone_mu = heads[number].x;")],
    defines: |_, _, defines| _ = defines.set("BENDS_BY_TECHNIQUE", true),
    example: Some(|exhibit| exhibit.add_frosted_flint()),
    ..Part::NOTHING
};

/// Of a technique's own chances in those by which it chooses; the rest is by shares, so that all that any channel uses has some chance.
const OWN_CHANCE: f64 = 0.9;
/// Predicted second moments over those of chances of a channel's own, from which on lobes ask for techniques: rooms of saturated plastic gain
/// nothing below it that could be measured. And where the scene asks for several of itself.
const SMALL_EXCESS: f64 = 2.0;
const NO_EXCESS: f64 = 1.001;

/// How a rough boundary bends channels apart.
#[derive(Debug, Clone)]
pub struct Bends {
    /// Of each channel.
    indices: Vec<f64>,
    /// The direction in which each bends, over the width of the lobe.
    directions: Vec<f64>,
    /// How far the least and the greatest index of all bend apart, over that.
    spread: f64,
}

impl Bends {
    /// At 45 degrees, where a facet that tilts by δ densities what it refracts by about (1 - 1/η) δ. `range`: the least and the greatest index
    /// within any channel; `eta`: their mean; `alpha`: the roughness.
    pub fn new(indices: Vec<f64>, range: [f64; 2], eta: f64, alpha: f64) -> Bends {
        let refracted = |eta: f64| (0.5f64.sqrt() / eta.max(1.0 / eta)).asin();
        let width = alpha * (1.0 - 1.0 / eta).abs();
        Bends {
            directions: indices.iter().map(|eta| refracted(*eta) / width).collect(),
            spread: (refracted(range[0]) - refracted(range[1])).abs() / width,
            indices,
        }
    }

    /// By how many techniques directions are as near to one another as the lobe is wide; 1 where they all are.
    fn needs(&self) -> usize {
        if self.spread > 1.0 { 1 + self.spread.ceil() as usize } else { 1 }
    }
}

/// How a boundary lets channels go on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// All of them, in directions by three indices.
    Together,
    /// All of them, in directions by the indices of techniques.
    ByTechnique,
    /// One of them.
    One,
}

impl Bends {
    fn way(&self, techniques: &Techniques) -> Way {
        match self.needs() {
            1 => Way::Together,
            needed if needed <= techniques.count() => Way::ByTechnique,
            _ => Way::One,
        }
    }

    /// Sets the flags of `lobe` accordingly. `table` appends values to the tables.
    pub fn decide(&self, lobe: &mut Lobe, techniques: &Techniques, table: impl FnOnce(&[f32]) -> u32) -> Way {
        let way = self.way(techniques);
        match way {
            Way::Together => (),
            Way::One => lobe.kind |= LOBE_NARROW,
            Way::ByTechnique => {
                let indices = techniques.values(&self.indices).into_iter().map(|eta| eta as f32);
                lobe.loss = table(&indices.collect::<Vec<f32>>());
                lobe.kind |= LOBE_BY_TECHNIQUE;
            }
        }
        way
    }
}

/// The lobes of a material, as decisions see them: what goes the same ways is one.
pub struct LobeChoice {
    pub material: String,
    nodes: Vec<Node>,
    /// Lobes that go different ways.
    count: usize,
    bounces: u32,
}

/// At one cosine.
struct Node {
    /// Of the flux that arrives evenly from all directions.
    measure: f64,
    /// What each lobe scatters: `albedos[k * count + lobe]`.
    albedos: Vec<f64>,
    /// Chances by shares.
    common: Vec<f64>,
}

/// What lobes of a kind share directions with.
fn ways(leaves: &[Leaf]) -> Vec<usize> {
    let mut ways = Vec::new();
    let mut names: Vec<Option<bool>> = Vec::new();
    for leaf in leaves {
        let kind = leaf.lobe.kind & 0xff;
        let is = |kinds: &[Kind]| kinds.iter().any(|k| *k as u32 == kind);
        // By the cosine, or nearly so, on one side or the other; all else by itself.
        let name = if is(&[Kind::Lambert, Kind::Base, Kind::BoundaryAgain, Kind::ConductorAgain]) {
            Some(false)
        } else if is(&[Kind::Transmitted, Kind::BeyondAgain]) {
            Some(true)
        } else {
            None
        };
        let known = name.and_then(|name| names.iter().position(|other| *other == Some(name)));
        ways.push(known.unwrap_or(names.len()));
        if known.is_none() {
            names.push(name);
        }
    }
    ways
}

impl LobeChoice {
    /// `by_shares` gives the chances of all leaves where each scatters what a function of (leaf, channel) says.
    pub(super) fn new(
        scene: &Scene,
        material: &str,
        leaves: &[Leaf],
        behind: bool,
        by_shares: impl Fn(&dyn Fn(&Leaf, usize) -> f64) -> Vec<f64>,
    ) -> LobeChoice {
        const NODES: usize = 8;
        let ways = ways(leaves);
        let count = ways.iter().max().map_or(0, |last| last + 1);
        let channels = scene.channels.len();
        let shares: Vec<f64> = leaves
            .iter()
            .map(|leaf| {
                let share = |(texture, missing): &textures::Share| {
                    let mean = textures::mean_number(&scene.textures[*texture]);
                    if *missing { 1.0 - mean } else { mean }
                };
                leaf.shares.iter().map(share).product()
            })
            .collect();
        let node = |i: usize| {
            let cosine = ((i as f64 + 0.5) / NODES as f64).sqrt();
            let albedo = |leaf: &Leaf, k: usize| match leaf.active[usize::from(behind)] {
                true => f64::from(leaf.lobe.weight) * (leaf.albedo)(behind, cosine, k).max(0.0),
                false => 0.0,
            };
            let mut albedos = vec![0.0; channels * count];
            for k in 0..channels {
                for ((way, leaf), share) in ways.iter().zip(leaves).zip(&shares) {
                    albedos[k * count + way] += share * albedo(leaf, k);
                }
            }
            let mut common = vec![0.0; count];
            let chances = by_shares(&albedo);
            let all: f64 = chances.iter().zip(&shares).map(|(chance, share)| chance * share).sum();
            for ((way, chance), share) in ways.iter().zip(chances).zip(&shares) {
                common[*way] += chance * share / all.max(1e-30);
            }
            Node { measure: 1.0 / NODES as f64, albedos, common }
        };
        LobeChoice {
            material: material.to_owned(),
            nodes: (0..NODES).map(node).collect(),
            count,
            bounces: scene.integrator.max_bounces,
        }
    }

    fn channels(&self) -> Range<usize> {
        0..self.nodes[0].albedos.len() / self.count.max(1)
    }

    /// The second moment of light that has met nothing but this material, chosen among its lobes as `technique` does, or by shares, over that
    /// with the channel's own chances: Σ G^n / Σ A^2n over all numbers n of bounces, with A = Σ_j a_j what all lobes scatter, and
    /// G = Σ_j a_j² / q_j.
    fn excess(&self, channel: usize, technique: Option<usize>) -> f64 {
        let (mut spread, mut own) = (0.0, 0.0);
        for node in &self.nodes {
            let of = |k: usize| &node.albedos[k * self.count..(k + 1) * self.count];
            let all: f64 = of(channel).iter().sum();
            let chances = match technique {
                Some(technique) => chances(of(technique), &node.common),
                None => node.common.clone(),
            };
            let terms = of(channel).iter().zip(&chances).filter(|(a, _)| **a > 0.0);
            spread += node.measure * terms.map(|(a, q)| a * a / q).sum::<f64>();
            own += node.measure * all * all;
        }
        let series = |x: f64| (0..=self.bounces.min(1_000)).map(|n| x.powi(n as i32)).sum::<f64>();
        series(spread) / series(own)
    }

    /// Of the channel that has most of it, by shares.
    fn largest_excess(&self) -> f64 {
        self.channels().map(|k| self.excess(k, None)).fold(1.0, f64::max)
    }

    /// Whether every channel has one of `techniques` by which it has an excess of at most `most`.
    pub fn are_near(&self, techniques: &[usize], most: f64) -> bool {
        self.channels().all(|k| techniques.iter().any(|t| self.excess(k, Some(*t)) <= most))
    }

    /// Of each lobe, in each channel: the logarithm of its chance over that by shares, times what the material scatters, as dark ones
    /// do not matter.
    pub fn coordinates(&self) -> Vec<Vec<f64>> {
        let mean = |of: &dyn Fn(&Node) -> f64| self.nodes.iter().map(|node| node.measure * of(node)).sum::<f64>();
        let common: Vec<f64> = (0..self.count).map(|way| mean(&|node| node.common[way])).collect();
        let mut coordinates = vec![Vec::new(); self.count];
        for k in self.channels() {
            let albedos: Vec<f64> =
                (0..self.count).map(|way| mean(&|node| node.albedos[k * self.count + way])).collect();
            let all: f64 = albedos.iter().sum();
            for (way, chance) in chances(&albedos, &common).into_iter().enumerate() {
                coordinates[way].push(if common[way] > 0.0 { all * (chance / common[way]).ln() } else { 0.0 });
            }
        }
        coordinates
    }
}

/// By which a technique chooses among lobes of these albedos, where all together would choose by `common`.
pub(super) fn chances(albedos: &[f64], common: &[f64]) -> Vec<f64> {
    let all: f64 = albedos.iter().sum();
    if !(all > 0.0) {
        return common.to_vec();
    }
    albedos.iter().zip(common).map(|(a, common)| OWN_CHANCE * a / all + (1.0 - OWN_CHANCE) * common).collect()
}

/// Lets the lobes of a material ask, and tells whether they do: where a factored render's spectra will be others nobody knows by how much.
pub(super) fn ask(
    scene: &Scene,
    material: &str,
    leaves: &[Leaf],
    by_shares: impl Fn(&dyn Fn(&Leaf, usize) -> f64) -> Vec<f64>,
    asking: &mut Asking,
) -> bool {
    if leaves.len() < 2 || asking.most() < 2 || scene.is_factored() && !asking.is_demanded() {
        return false;
    }
    let least = if asking.is_demanded() { NO_EXCESS } else { SMALL_EXCESS };
    let sides = [false, true].into_iter().filter(|behind| leaves.iter().any(|leaf| leaf.active[usize::from(*behind)]));
    let choices = sides.map(|behind| LobeChoice::new(scene, material, leaves, behind, &by_shares));
    let most = choices.map(|choice| (choice.largest_excess(), choice)).reduce(|a, b| if b.0 > a.0 { b } else { a });
    let Some((_, choice)) = most.filter(|(excess, _)| *excess >= least) else { return false };
    asking.ask_for_lobes(choice);
    true
}

/// Lets a rough boundary ask, where as many techniques as it needs are possible.
pub(super) fn ask_for_bends(material: &str, bends: &Bends, asking: &mut Asking) -> bool {
    let needed = bends.needs();
    if needed < 2 || needed > asking.most() {
        return false;
    }
    asking.tell_apart(bends.directions.iter().copied());
    asking.ask(needed, || format!("{material}, whose channels bend {:.1} widths of its lobe apart", bends.spread));
    true
}

/// Chances of every technique for each of the leaves of a material, as `lobes.wgsl` reads them: [before, behind][257 cosines][technique];
/// `common` has those by shares.
pub(super) fn tables(leaves: &[Leaf], techniques: &Techniques, common: &[Vec<f32>]) -> Vec<Vec<f32>> {
    let mut tables: Vec<Vec<f32>> = vec![Vec::with_capacity(2 * (INTERVALS + 1) * techniques.count()); leaves.len()];
    for side in 0..2 {
        for node in 0..=INTERVALS {
            let cosine = node as f64 / INTERVALS as f64;
            let by_shares: Vec<f64> =
                common.iter().map(|picks| f64::from(picks[side * (INTERVALS + 1) + node])).collect();
            for &k in &techniques.channels {
                let albedo = |leaf: &Leaf| match leaf.active[side] {
                    true => f64::from(leaf.lobe.weight) * (leaf.albedo)(side == 1, cosine, k).max(0.0),
                    false => 0.0,
                };
                let albedos: Vec<f64> = leaves.iter().map(albedo).collect();
                for (table, chance) in tables.iter_mut().zip(chances(&albedos, &by_shares)) {
                    table.push(chance as f32);
                }
            }
        }
    }
    tables
}
