//! Surfaces whose decisions differ by technique (docs/METHOD.md, Techniques): lobes among which channels would choose by chances of their
//! own, and rough boundaries that bend channels further apart than the lobe is wide.

use crate::device::part::{Part, Place};
use crate::device::parts::lobe_choice::chances;
use crate::device::parts::lobes::Leaf;
use crate::device::parts::surfaces::INTERVALS;
use crate::device::parts::techniques::{Asking, Techniques};
use crate::device::text::module;
use crate::device::words::{LOBE_BY_TECHNIQUE, LOBE_NARROW, Lobe};

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
    /// At 45 degrees, where a facet that tilts by δ turns what it refracts by about (1 - 1/η) δ. `range`: the least and the greatest index
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
        if self.spread > 1.0 { (self.spread.ceil() as usize).saturating_add(1) } else { 1 }
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
                let albedos: Vec<f64> = leaves.iter().map(|leaf| leaf.scattered(side == 1, cosine, k)).collect();
                for (table, chance) in tables.iter_mut().zip(chances(&albedos, &by_shares)) {
                    table.push(chance as f32);
                }
            }
        }
    }
    tables
}
