//! How much the lobes of a scene's materials would gain if channels chose among them by chances of their own (docs/METHOD.md, Techniques).

use std::f64::consts::PI;
use std::ops::Range;

use crate::device::parts::lobes::Leaf;
use crate::device::parts::surfaces::Kind;
use crate::device::parts::techniques::Asking;
use crate::device::parts::textures;
use crate::scene::{Scene, Shape};

/// Of a technique's own chances in those by which it chooses; the rest is by shares, so that all that any channel uses has some chance.
const OWN_CHANCE: f64 = 0.9;
/// Second moments over those with chances of a channel's own from which on the lobes of a scene ask for techniques, and then which materials
/// have chances by technique; and these where the scene asks for several of itself. Where it was less, as in rooms of saturated plastic or of white walls
/// with a few saturated things in them, no gain was to be measured.
const SMALL_EXCESS: f64 = 2.0;
const SMALL_EXCESS_OF_ONE: f64 = 1.3;
const NO_EXCESS: f64 = 1.001;
/// What a channel's second moment may be by the technique nearest to it.
const NEAR: f64 = 2.0;

/// The lobes of a material, as decisions see them: what goes the same ways is one.
pub struct LobeChoice {
    pub material: String,
    nodes: Vec<Node>,
    /// Lobes that go different ways.
    count: usize,
    /// Of a world of nothing else, in the channel that has most of it, by shares.
    excess: f64,
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
    /// `None` of what scatters nothing. `by_shares` gives the chances of all leaves where each scatters what a function of (leaf, channel) says.
    pub(super) fn new(
        scene: &Scene,
        material: &str,
        leaves: &[Leaf],
        by_shares: impl Fn(&dyn Fn(&Leaf, usize) -> f64) -> Vec<f64>,
    ) -> Option<LobeChoice> {
        let sides =
            [false, true].into_iter().filter(|behind| leaves.iter().any(|leaf| leaf.active[usize::from(*behind)]));
        let choices = sides.map(|behind| LobeChoice::from_side(scene, material, leaves, behind, &by_shares));
        // From which channels differ more.
        choices.reduce(|a, b| if b.excess > a.excess { b } else { a })
    }

    fn from_side(
        scene: &Scene,
        material: &str,
        leaves: &[Leaf],
        behind: bool,
        by_shares: &impl Fn(&dyn Fn(&Leaf, usize) -> f64) -> Vec<f64>,
    ) -> LobeChoice {
        const NODES: usize = 8;
        let ways = ways(leaves);
        let count = ways.iter().max().map_or(0, |last| last + 1);
        let channels = scene.channels.len();
        let shares: Vec<f64> = leaves.iter().map(|leaf| textures::mean_share(scene, &leaf.shares)).collect();
        let node = |i: usize| {
            let cosine = ((i as f64 + 0.5) / NODES as f64).sqrt();
            let albedo = |leaf: &Leaf, k: usize| leaf.scattered(behind, cosine, k);
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
        let nodes = (0..NODES).map(node).collect();
        let mut choice = LobeChoice { material: material.to_owned(), nodes, count, excess: 1.0 };
        let of_channel = |k: usize| excess(choice.moments(k, None), scene.integrator.max_bounces);
        choice.excess = choice.channels().map(of_channel).fold(1.0, f64::max);
        choice
    }

    fn channels(&self) -> Range<usize> {
        0..self.nodes[0].albedos.len() / self.count.max(1)
    }

    /// Of light that arrives evenly, in a channel: A² with A = Σ_j a_j what all lobes scatter, which is the second moment with chances q_j of
    /// the channel's own; and G = Σ_j a_j² / q_j, that with those of a technique, or by shares.
    fn moments(&self, channel: usize, technique: Option<usize>) -> [f64; 2] {
        let mut moments = [0.0; 2];
        for node in &self.nodes {
            let of = |k: usize| &node.albedos[k * self.count..(k + 1) * self.count];
            let all: f64 = of(channel).iter().sum();
            let chances = match technique {
                Some(technique) => chances(of(technique), &node.common),
                None => node.common.clone(),
            };
            let terms = of(channel).iter().zip(&chances).filter(|(a, _)| **a > 0.0);
            moments[0] += node.measure * all * all;
            moments[1] += node.measure * terms.map(|(a, q)| a * a / q).sum::<f64>();
        }
        moments
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
    if all <= 0.0 {
        return common.to_vec();
    }
    albedos.iter().zip(common).map(|(a, common)| OWN_CHANCE * a / all + (1.0 - OWN_CHANCE) * common).collect()
}

/// Σ G^n / Σ A^2n over all numbers n of bounces.
fn excess([own, by_others]: [f64; 2], bounces: u32) -> f64 {
    let series = |x: f64| (0..=bounces.min(1_000)).map(|n| x.powi(n as i32)).sum::<f64>();
    series(by_others) / series(own)
}

/// The lobes of all materials, each with its share of all surfaces.
pub struct LobeChoices {
    choices: Vec<(f64, LobeChoice)>,
    bounces: u32,
    channels: usize,
}

impl LobeChoices {
    /// In a world where paths meet each material by its share.
    fn excess(&self, channel: usize, technique: Option<usize>) -> f64 {
        let mut all = [0.0; 2];
        for (share, choice) in &self.choices {
            let moments = choice.moments(channel, technique);
            all.iter_mut().zip(moments).for_each(|(sum, moment)| *sum += share * moment);
        }
        excess(all, self.bounces)
    }

    fn largest_excess(&self) -> f64 {
        (0..self.channels).map(|k| self.excess(k, None)).fold(1.0, f64::max)
    }

    /// Whether every channel has a near one among `techniques`.
    pub fn are_near(&self, techniques: &[usize]) -> bool {
        (0..self.channels).all(|k| techniques.iter().any(|t| self.excess(k, Some(*t)) <= NEAR))
    }
}

/// Lets the lobes of all materials ask, and tells which have chances by technique. In a factored render nobody knows what
/// spectra will be.
pub(super) fn ask(scene: &Scene, choices: Vec<Option<LobeChoice>>, asking: &mut Asking) -> Vec<bool> {
    let nobody = vec![false; choices.len()];
    let least = if asking.is_demanded() { NO_EXCESS } else { SMALL_EXCESS_OF_ONE };
    let differs = |choice: &Option<LobeChoice>| choice.as_ref().is_some_and(|choice| choice.excess >= least);
    if asking.most() < 2 || scene.is_factored() && !asking.is_demanded() || !choices.iter().any(differs) {
        return nobody;
    }
    let areas = areas(scene);
    let differ: Vec<bool> = choices.iter().zip(&areas).map(|(choice, area)| differs(choice) && *area > 0.0).collect();
    let of_those =
        || choices.iter().zip(&differ).filter(|(_, differs)| **differs).filter_map(|(choice, _)| choice.as_ref());
    let names: Vec<String> = of_those().map(|choice| choice.material.clone()).collect();
    let coordinates: Vec<Vec<f64>> = of_those().flat_map(LobeChoice::coordinates).collect();
    let all: f64 = areas.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let choices = choices.into_iter().zip(areas).filter_map(|(choice, area)| Some((area / all, choice?))).collect();
    let choices = LobeChoices { choices, bounces: scene.integrator.max_bounces, channels: scene.channels.len() };
    if names.is_empty() || !asking.is_demanded() && choices.largest_excess() < SMALL_EXCESS {
        return nobody;
    }
    asking.ask_for_lobes(choices, names, coordinates);
    differ
}

/// Square metres of each material, of all instances together.
fn areas(scene: &Scene) -> Vec<f64> {
    let mut areas = vec![0.0; scene.materials.len()];
    for object in &scene.objects {
        let Some(material) = object.material else { continue };
        let own = match &object.shape {
            Shape::Sphere { radius, .. } => 4.0 * PI * radius * radius,
            Shape::Disk { radius, .. } => PI * radius * radius,
            Shape::Cylinder { from, to, radius } => 2.0 * PI * radius * from.distance(*to),
            Shape::Mesh(mesh) => {
                let corners =
                    mesh.triangles.iter().map(|corners| corners.map(|corner| mesh.positions[corner as usize]));
                corners.map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length()).sum()
            }
        };
        // Under scales that differ by direction a mean.
        let times = object.assembly.map_or(1.0, |assembly| {
            let instances = scene.assemblies[assembly].instances.iter();
            instances.map(|to_world| to_world.matrix3.determinant().abs().powf(2.0 / 3.0)).sum()
        });
        areas[material] += times * own;
    }
    areas
}
