//! Roughness by a texture: facets take what it says where a path meets them, and what they have in tables is made at some roughnesses.

use crate::device::part::{Part, Place};
use crate::device::parts::lobes::Leaf;
use crate::device::parts::surfaces::{Kind, Surfaces};
use crate::device::text::module;
use crate::device::words::{LOBE_VARIES, Lobe, NONE, ROUGHNESS_STEPS};
use crate::scene::{Roughness, SMOOTH, Scene, Texture, TextureId};

pub const ROUGHNESS: Part = Part {
    name: "roughness by texture",
    used: |scene| scene.surfaces.as_ref().is_some_and(|surfaces| surfaces.varies()),
    effect: |scene| {
        let by_place = scene.surfaces.iter().flat_map(|surfaces| &surfaces.by_place);
        let variants: u32 = by_place.map(|[.., variants]| variants).sum();
        format!("{variants} lobes at roughnesses of their own")
    },
    is_planned: true,
    modules: &[
        (Place::Generate, module!("parts/roughness/roughness.wgsl")),
        (Place::Stage, module!("parts/roughness/chance.wgsl")),
    ],
    lines: &[("VERTEX", "v.chance = roughness_chance(number);")],
    defines: |_, _, defines| _ = defines.set("VARIES", true),
    example: Some(|exhibit| exhibit.add_roughness_textures()),
    ..Part::NOTHING
};

/// A lobe whose roughness is a texture.
pub(super) struct ByPlace {
    texture: TextureId,
    /// The first of `variants`, among [`node`].
    first: u32,
    /// The lobe at each of these; none of facets, which have no tables.
    variants: Vec<Lobe>,
}

/// Words of [`ByPlace`] on the device: texture, first node, first variant among the lobes or [`NONE`], how many.
pub type Words = [u32; 4];

/// The roughnesses at which there are tables: even steps of √α, since what facets lose changes fastest where they are smooth.
fn node(i: u32) -> f64 {
    (f64::from(i) / f64::from(ROUGHNESS_STEPS)).powi(2).max(SMOOTH)
}

/// The numbers of the nodes around all that `texture` has, and of some that stand for it: of every quarter of the texels the middle
/// one's, and of the roughest.
fn nodes(texture: &Texture) -> (std::ops::RangeInclusive<u32>, Vec<u32>) {
    const CLASSES: usize = 4;
    let place = |alpha: f32| f64::from(alpha).sqrt() * f64::from(ROUGHNESS_STEPS);
    let mut alphas = texture.texels.to_vec();
    alphas.sort_by(f32::total_cmp);
    let (least, most) = (place(alphas[0]).floor() as u32, place(alphas[alphas.len() - 1]).ceil() as u32);
    let middle = |class: usize| alphas[alphas.len() * (2 * class + 1) / (2 * CLASSES)];
    let typical = (0..CLASSES).map(|class| (place(middle(class)).round() as u32).clamp(least, most)).chain([most]);
    (least..=most, typical.collect())
}

impl Surfaces {
    /// The leaves that `at` makes of a roughness along and across, or of none for what is smooth; or those by place.
    pub(super) fn of_roughness(
        &mut self,
        scene: &Scene,
        roughness: Roughness,
        at: impl Fn(&mut Surfaces, Option<[f64; 2]>) -> Vec<Leaf>,
    ) -> Vec<Leaf> {
        let texture = match roughness {
            Roughness::Constant(alpha) => return at(self, (alpha[0] >= SMOOTH).then_some(alpha)),
            Roughness::Texture(texture) => texture,
        };
        let (all, typical) = nodes(&scene.textures[texture]);
        let first = *all.start();
        let mut columns: Vec<_> = all.map(|i| at(self, Some([node(i); 2])).into_iter()).collect();
        let mut leaves = Vec::new();
        while let Some(same) = columns.iter_mut().map(Iterator::next).collect::<Option<Vec<Leaf>>>() {
            let facets = [Kind::RoughConductor, Kind::RoughCoat, Kind::RoughBoundary];
            let has_tables = facets.iter().all(|kind| same[0].lobe.kind & 0xff != *kind as u32);
            let variants = if has_tables { same.iter().map(|leaf| leaf.lobe).collect() } else { Vec::new() };
            // Of the smoothest, which tells whether its facets are narrow.
            let Leaf { lobe, active, records, .. } = same[0];
            let bends = same[0].bends.clone();
            let albedos: Vec<_> = same.into_iter().map(|leaf| leaf.albedo).collect();
            let typical = typical.clone();
            let albedo = move |behind: bool, cosine: f64, k: usize| {
                typical.iter().map(|i| albedos[(i - first) as usize](behind, cosine, k)).sum::<f64>()
                    / typical.len() as f64
            };
            let by_place = ByPlace { texture, first, variants };
            let lobe = Lobe { kind: lobe.kind | LOBE_VARIES, ..lobe };
            leaves.push(Leaf {
                lobe,
                active,
                albedo: Box::new(albedo),
                shares: Vec::new(),
                records,
                by_place: Some(by_place),
                bends,
            });
        }
        leaves
    }

    /// Appends the variants of a lobe, and gives where its words stand among all of their kind.
    pub(super) fn add_variants(&mut self, by_place: ByPlace) -> u32 {
        let ByPlace { texture, first, variants } = by_place;
        let at = if variants.is_empty() { NONE } else { self.lobes.len() as u32 };
        self.by_place.push([texture as u32, first, at, variants.len() as u32]);
        self.shares.resize(self.shares.len() + variants.len(), Vec::new());
        self.lobes.extend(variants);
        (self.by_place.len() as u32 - 1) * size_of::<Words>() as u32 / 4
    }

    /// Appends the words of all lobes whose roughness is a texture to those of the textures, and tells the lobes where.
    pub(super) fn add_roughnesses(&mut self) {
        let Some(textures) = &mut self.textures else { return };
        let first = textures.words.len() as u32;
        textures.words.extend(self.by_place.as_flattened());
        let varying = self.lobes.iter_mut().filter(|lobe| lobe.kind & LOBE_VARIES != 0);
        varying.for_each(|lobe| lobe.rows += first);
    }

    /// Whether some roughness is a texture.
    pub fn varies(&self) -> bool {
        !self.by_place.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::spectral::hemisphere::{CoatAlbedo, ReflectionAlbedo};

    /// The most that what stands in tables is off the line between two roughnesses, halfway, where it is furthest from it: losses of a metal
    /// and reflectances of a coat, times the cosine, and their hemispherical means.
    fn off_the_line(i: u32) -> [f64; 4] {
        let halfway = ((f64::from(i) + 0.5) / f64::from(ROUGHNESS_STEPS)).powi(2);
        let alphas = [node(i), halfway, node(i + 1)];
        let off = |[a, b, c]: [f64; 3]| (0.5 * (a + c) - b).abs();
        let metals = alphas.map(|alpha| ReflectionAlbedo::new([alpha; 2]));
        let coats = alphas.map(|alpha| CoatAlbedo::new(alpha, [1.5; 2]));
        let most = |of: &dyn Fn(f64) -> [f64; 3]| {
            (0..=40).map(|step| f64::from(step) / 40.0).map(|z| z * off(of(z))).fold(0.0, f64::max)
        };
        let towards = |z: f64| DVec3::new((1.0 - z * z).sqrt(), 0.0, z);
        [
            most(&|z| metals.each_ref().map(|metal| metal.loss(towards(z)))),
            off(metals.each_ref().map(ReflectionAlbedo::mean_loss)),
            most(&|z| coats.each_ref().map(|coat| coat.reflected(1.5, z))),
            off(coats.each_ref().map(|coat| coat.mean_reflected(1.5))),
        ]
    }

    /// As docs/METHOD.md has it.
    const BOUNDS: [f64; 4] = [6e-4, 3e-4, 6e-4, 3e-4];

    fn check(nodes: impl IntoIterator<Item = u32>) {
        for i in nodes {
            let off = off_the_line(i);
            println!("{i}: {off:?}");
            assert!(off.iter().zip(BOUNDS).all(|(off, bound)| *off < bound), "{i}: {off:?}");
        }
    }

    #[test]
    fn tables_lie_on_lines() {
        check([2, 16]);
    }

    #[test]
    #[ignore = "a minute: between all roughnesses of which there are tables"]
    fn all_tables_lie_on_lines() {
        check(1..ROUGHNESS_STEPS);
    }
}
