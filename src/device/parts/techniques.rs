//! Techniques: channels that drive the decisions of paths where the best density differs from channel to channel, one of them drawn for each
//! path (docs/METHOD.md, Techniques). What scatters in media, lobes of surfaces and rough boundaries that disperse share one set of them.

use crate::device::part::{Part, Place};
use crate::device::parts::lobe_choice::LobeChoices;
use crate::device::parts::{media, surfaces};
use crate::device::text::module;
use crate::scene::Scene;

pub const TECHNIQUES: Part = Part {
    name: "several techniques",
    used: |scene| scene.techniques.are_several(),
    effect: |scene| {
        let bytes = 16 * scene.techniques.count().div_ceil(4);
        format!("{}; {bytes} bytes a path, and the density of each at every such decision", scene.techniques.words())
    },
    is_planned: true,
    modules: &[
        (Place::Generate, module!("parts/techniques/techniques.wgsl")),
        (Place::Stage, module!("parts/techniques/begin.wgsl")),
    ],
    lines: &[
        ("BEGIN", "begin_techniques(number);"),
        ("PASSED", "if ((site.material.flags & MATERIAL_BY_TECHNIQUE) != 0u) { note_densities(); }"),
    ],
    defines: |scene, _, defines| {
        defines.set("RATIOS", true);
        let has_third = (media::MEDIA.used)(scene) || (surfaces::DISPERSION.used)(scene);
        defines.constant("RATIOS_ROW", if has_third { 3 } else { 2 });
        if scene.scattering.is_none() {
            defines.constant("TECHNIQUES", scene.techniques.count() as u32);
        }
    },
    state_words: |scene| 4 * (scene.techniques.count() as u32).div_ceil(4),
    ..Part::NOTHING
};

/// Techniques of a scene at most.
pub const MOST_TECHNIQUES: usize = 16;
/// For lobes at most.
const MOST_FOR_LOBES: usize = 4;

/// What asks for several techniques, and what they would differ in.
pub struct Asking {
    /// Of each channel: quantities whose differences are about those of the logarithms of densities.
    points: Vec<Vec<f64>>,
    /// The most that media or boundaries ask for.
    wanted: usize,
    reasons: Vec<String>,
    lobes: Option<LobeChoices>,
    /// As the scene has it.
    demanded: Option<usize>,
}

impl Asking {
    pub fn new(scene: &Scene) -> Asking {
        Asking {
            points: vec![Vec::new(); scene.channels.len()],
            wanted: 1,
            reasons: Vec::new(),
            lobes: None,
            demanded: scene.integrator.techniques.map(|count| count as usize),
        }
    }

    /// Whether the scene says how many, and more than one.
    pub fn is_demanded(&self) -> bool {
        self.demanded.is_some_and(|count| count > 1)
    }

    /// The most that any part of the scene may have.
    pub fn most(&self) -> usize {
        self.demanded.unwrap_or(MOST_TECHNIQUES).min(self.points.len())
    }

    /// Adds a quantity of every channel.
    pub fn tell_apart(&mut self, by_channel: impl IntoIterator<Item = f64>) {
        self.points.iter_mut().zip(by_channel).for_each(|(point, value)| point.push(value));
    }

    /// Asks for `count`, if that is more than one, since `reason`.
    pub fn ask(&mut self, count: usize, reason: impl FnOnce() -> String) {
        if count > 1 {
            self.wanted = self.wanted.max(count);
            self.reasons.push(reason());
        }
    }

    /// Lobes of `materials`, among which channels would choose by other chances than all together, as `coordinates` of every channel tell.
    pub(super) fn ask_for_lobes(&mut self, lobes: LobeChoices, materials: Vec<String>, coordinates: Vec<Vec<f64>>) {
        coordinates.into_iter().for_each(|coordinate| self.tell_apart(coordinate));
        self.reasons.push(format!("lobes of {}", named(&materials)));
        self.lobes = Some(lobes);
    }
}

/// The channels whose coefficients drive the decisions of paths, one of them drawn for each path; without any, all together do.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Techniques {
    pub channels: Vec<usize>,
    reasons: Vec<String>,
}

impl Techniques {
    pub fn new(asking: Asking) -> Techniques {
        let count = match asking.demanded {
            _ if asking.points.iter().all(Vec::is_empty) => 1,
            Some(count) => count,
            None => asking.wanted.max(for_lobes(&asking)),
        };
        let count = count.min(asking.most());
        if count <= 1 {
            return Techniques::default();
        }
        Techniques { channels: farthest_apart(&asking.points, count), reasons: asking.reasons }
    }

    /// T.
    pub fn count(&self) -> usize {
        self.channels.len().max(1)
    }

    pub fn are_several(&self) -> bool {
        self.count() > 1
    }

    /// What each technique takes of a quantity of every channel.
    pub fn values(&self, by_channel: &[f64]) -> Vec<f64> {
        match self.channels.is_empty() {
            true => vec![by_channel.iter().sum::<f64>() / by_channel.len() as f64],
            false => self.channels.iter().map(|&k| by_channel[k]).collect(),
        }
    }

    /// How many, and why, for `plan`.
    fn words(&self) -> String {
        let why = if self.reasons.is_empty() { "the scene says so".to_owned() } else { self.reasons.join("; ") };
        format!("{}, for {why}", self.count())
    }
}

/// How many lobes ask for: so many that every channel has one near, 4 at most.
fn for_lobes(asking: &Asking) -> usize {
    let Some(lobes) = &asking.lobes else { return 1 };
    let most = MOST_FOR_LOBES.min(asking.points.len());
    (2..most).find(|count| lobes.are_near(&farthest_apart(&asking.points, *count))).unwrap_or(most)
}

/// The first few.
fn named(names: &[String]) -> String {
    const MOST: usize = 3;
    let first = names[..names.len().min(MOST)].join(", ");
    if names.len() > MOST { format!("{first} and {} more", names.len() - MOST) } else { first }
}

/// `count` of the points, in order of choice: the two farthest apart, then always the one that is farthest from those chosen; of equal
/// ones the first.
fn farthest_apart(points: &[Vec<f64>], count: usize) -> Vec<usize> {
    let distance = |a: usize, b: usize| -> f64 { points[a].iter().zip(&points[b]).map(|(a, b)| (a - b).powi(2)).sum() };
    let mut best = (f64::NEG_INFINITY, 0, 0);
    for a in 0..points.len() {
        for b in a + 1..points.len() {
            let apart = distance(a, b);
            if apart > best.0 {
                best = (apart, a, b);
            }
        }
    }
    let mut chosen = vec![best.1, best.2];
    let mut nearest: Vec<f64> = (0..points.len()).map(|i| distance(i, chosen[0]).min(distance(i, chosen[1]))).collect();
    while chosen.len() < count {
        let farther = |best: usize, i: usize| if nearest[i] > nearest[best] { i } else { best };
        let next = (0..points.len()).filter(|i| !chosen.contains(i)).reduce(farther);
        let Some(next) = next else { break };
        chosen.push(next);
        nearest.iter_mut().enumerate().for_each(|(i, least)| *least = least.min(distance(i, next)));
    }
    chosen
}
