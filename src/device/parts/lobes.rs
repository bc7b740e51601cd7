//! What a material does, as lobes: one or several for each kind of scattering, with the tables and spectra that they need.

use std::sync::Arc;

use glam::DVec3;

use crate::device::parts::by_technique::Bends;
use crate::device::parts::roughness::ByPlace;
use crate::device::parts::surfaces::{INTERVALS, Kind, Surfaces, texture_records};
use crate::device::parts::textures::{self, Share};
use crate::device::prepared::LEAST_ALBEDO;
use crate::device::words::{LOBE_BOUNDED, LOBE_DISPERSES, LOBE_TEXTURED, Lobe};
use crate::scene::{Reflectance, Scene, SpectrumId};
use crate::spectral::Curve;
use crate::spectral::hemisphere::fresnel::{self, mean_conductor, mean_dielectric};
use crate::spectral::hemisphere::{CoatAlbedo, DielectricAlbedo, ReflectionAlbedo, ReflectionProbability, index_range};

/// Boundaries whose indices are this near to 1 bend by an index this far from it where they are rough (`reference`).
const MATCHED: f64 = 1e-4;

/// Flux that a lobe scatters per flux arriving: (from behind, cosine, channel).
type Albedo = Box<dyn Fn(bool, f64, usize) -> f64>;

/// A lobe under construction.
pub(super) struct Leaf {
    pub lobe: Lobe,
    /// Whether it scatters what comes from before, from behind.
    pub active: [bool; 2],
    pub albedo: Albedo,
    /// What blend textures leave of it.
    pub shares: Vec<Share>,
    /// Where its roughness is a texture.
    pub by_place: Option<ByPlace>,
    /// Of a rough boundary that disperses.
    pub bends: Option<Bends>,
    /// Records that one evaluation takes; 0 for the only directions of mirrors and ideal refraction.
    pub records: u32,
}

impl Leaf {
    /// Of flux that arrives at `cosine` from before or `behind`: what its material scatters by it in channel `k`.
    pub fn scattered(&self, behind: bool, cosine: f64, k: usize) -> f64 {
        match self.active[usize::from(behind)] {
            true => f64::from(self.lobe.weight) * (self.albedo)(behind, cosine, k).max(0.0),
            false => 0.0,
        }
    }
}

impl Surfaces {
    pub(super) fn diffuse(&mut self, scene: &Scene, reflectance: Reflectance) -> Vec<Leaf> {
        let means = match reflectance {
            Reflectance::Spectrum(spectrum) => channel_means(scene, spectrum),
            Reflectance::Texture(texture) => textures::bound(scene, &scene.textures[texture]),
        };
        let least = if scene.is_factored() { LEAST_ALBEDO } else { 0.0 };
        let means: Vec<f64> = means.into_iter().map(|mean| mean.max(least)).collect();
        // What reflects in no channel is black.
        if means.iter().all(|m| *m <= 0.0) {
            return Vec::new();
        }
        let (lobe, records) = match reflectance {
            Reflectance::Spectrum(spectrum) => (Lobe { ab: self.spectrum(spectrum), ..lobe_of(Kind::Lambert) }, 1),
            Reflectance::Texture(texture) => {
                self.textured = true;
                let lobe = Lobe { kind: Kind::Lambert as u32 | LOBE_TEXTURED, loss: texture as u32, ..Lobe::default() };
                (lobe, texture_records(&scene.textures[texture]))
            }
        };
        vec![leaf(lobe, records, move |_, _, k| means[k])]
    }

    pub(super) fn conductor(
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
            let lobe = Lobe { ab, ..lobe_of(Kind::Conductor) };
            return vec![leaf(lobe, 0, move |_, cosine, k| reflectance(cosine, k))];
        };
        self.anisotropic |= alpha[0] != alpha[1];
        let albedo = ReflectionAlbedo::shared(alpha);
        let once = Lobe { ab, alpha: alpha.map(|a| a as f32), ..lobe_of(Kind::RoughConductor) };
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
            // Both lobes together then send a white metal's light on with hardly differing weights. In a cavity of a metal that reflects
            // nearly everything these are multiplied dozens of times, and their spread grows with each.
            leaves[0].lobe.kind |= LOBE_BOUNDED;
            let lobe = Lobe {
                ab: self.derived(format!("{name}, scattered again"), curve),
                alpha: alpha.map(|a| a as f32),
                decision: self.table(&again_directions(&albedo)),
                loss: self.table(&rows),
                rows: albedo.rows().len() as u32,
                mean_loss: lost as f32,
                ..lobe_of(Kind::ConductorAgain)
            };
            leaves.push(leaf(lobe, 1, move |_, cosine, k| means[k] * mean_over_turns(&albedo, cosine)));
        }
        leaves
    }

    pub(super) fn dielectric(
        &mut self,
        scene: &Scene,
        name: &str,
        eta: SpectrumId,
        dispersion: bool,
        roughness: Option<[f64; 2]>,
    ) -> Vec<Leaf> {
        let range = index_range(&scene.spectra[eta].curve, &scene.channels);
        let matched = range.iter().all(|eta| (eta - 1.0).abs() < MATCHED);
        match roughness.filter(|_| !matched) {
            None => self.glass(scene, eta, dispersion),
            Some([alpha, _]) => self.rough_glass(scene, name, eta, dispersion, alpha),
        }
    }

    fn glass(&mut self, scene: &Scene, eta: SpectrumId, dispersion: bool) -> Vec<Leaf> {
        let index = Index::new(scene, eta, dispersion);
        self.dispersion |= index.disperses;
        let decision = Arc::new(ReflectionProbability::new(&scene.spectra[eta].curve, &scene.channels));
        let ab = self.spectrum(eta);
        let kind = if index.disperses { LOBE_DISPERSES } else { 0 };
        let with = |k: Kind| Lobe { ab, kind: k as u32 | kind, eta: index.bending as f32, ..Lobe::default() };
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
        let albedo = DielectricAlbedo::shared(alpha, range);
        let number = self.eta_table(albedo.table());
        let id = self.spectrum(eta);
        let decision = ReflectionProbability::new(curve, &scene.channels);
        let decisions: Vec<f32> = [false, true]
            .iter()
            .flat_map(|&behind| (0..=INTERVALS).map(move |i| (behind, i as f64 / INTERVALS as f64)))
            .map(|(behind, cosine)| decision.at(behind, cosine) as f32)
            .collect();
        let apart = |eta: f64| if (eta - 1.0).abs() < MATCHED { 1.0 + MATCHED.copysign(eta - 1.0) } else { eta };
        self.dispersion |= index.disperses;
        let boundary = Lobe {
            kind: Kind::RoughBoundary as u32 | if index.disperses { LOBE_DISPERSES } else { 0 },
            ab: id,
            alpha: [alpha as f32; 2],
            decision: self.table(&decisions),
            eta: apart(index.bending) as f32,
            eta_least: apart(range[0]) as f32,
            eta_greatest: apart(range[1]) as f32,
            ..Lobe::default()
        };
        let (table, indices) = (Arc::clone(&albedo), n.clone());
        let mut leaves = vec![leaf(boundary, 2, move |behind, cosine, k| 1.0 - table.loss(indices[k], behind, cosine))];
        leaves[0].bends = index.disperses.then(|| {
            let indices = n.iter().map(|eta| apart(*eta)).collect();
            Bends::new(indices, range, index.bending, alpha)
        });

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
            let lobe = Lobe { ab: id | number << 16, cd, alpha: [alpha as f32; 2], ..lobe_of(kind) };
            let (table, indices) = (Arc::clone(&albedo), n.clone());
            leaves.push(leaf(lobe, 3, move |behind, cosine, k| {
                let eta = indices[k];
                let mean = table.mean_loss(eta, behind != passes);
                share(&table, eta, behind, passes) * mean * table.loss(eta, behind, cosine)
            }));
        }
        leaves
    }

    pub(super) fn plastic(
        &mut self,
        scene: &Scene,
        name: &str,
        reflectance: Reflectance,
        eta: SpectrumId,
        roughness: Option<[f64; 2]>,
    ) -> Vec<Leaf> {
        let of_index = &scene.spectra[eta].curve;
        let n = channel_means(scene, eta);
        let id = self.spectrum(eta);
        let rough = roughness.map(|[alpha, _]| CoatAlbedo::shared(alpha, index_range(of_index, &scene.channels)));
        let table = rough.clone();
        let mean_reflected = move |eta: f64| match &table {
            None => mean_dielectric(eta),
            Some(table) => table.mean_reflected(eta),
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
                (self.derived(format!("{name}, base"), curve), means, Lobe::default(), 3)
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
                let lobe = Lobe { kind: LOBE_TEXTURED, loss: id as u32, ..Lobe::default() };
                (back | square << 16, means, lobe, texture_records(&scene.textures[id]) + 4)
            }
        };
        let alpha = roughness.unwrap_or_default().map(|alpha| alpha as f32);
        // Seen from outside nothing is totally reflected, whatever the index.
        let coat_kind = if roughness.is_some() { Kind::RoughCoat } else { Kind::Mirror };
        let coat = Lobe { kind: coat_kind as u32 | LOBE_DISPERSES, ab: id, alpha, eta: 1.0, ..Lobe::default() };
        let number = rough.as_ref().map_or(0, |table| self.eta_table(table.table()));
        self.rough_base |= rough.is_some();
        let kind = Kind::Base as u32 | textured.kind;
        let base = Lobe { kind, ab: id | number << 16, cd, alpha, ..textured };
        let mean: Vec<f64> = n.iter().map(|&eta| 1.0 - mean_reflected(eta)).collect();
        let reflected = Arc::new(move |cosine: f64, k: usize| match &rough {
            None => fresnel::dielectric(cosine, n[k]),
            Some(table) => table.reflected(n[k], cosine),
        });
        let of_coat = Arc::clone(&reflected);
        vec![
            leaf(coat, u32::from(roughness.is_some()), move |_, cosine, k| of_coat(cosine, k)),
            leaf(base, records, move |_, cosine, k| (1.0 - reflected(cosine, k)) * base_means[k] * mean[k]),
        ]
    }
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

fn lobe_of(kind: Kind) -> Lobe {
    Lobe { kind: kind as u32, ..Lobe::default() }
}

fn leaf(lobe: Lobe, records: u32, albedo: impl Fn(bool, f64, usize) -> f64 + 'static) -> Leaf {
    Leaf { lobe, active: [true; 2], albedo: Box::new(albedo), shares: Vec::new(), by_place: None, bends: None, records }
}

/// The mean of `curve` over each channel.
fn means_of(scene: &Scene, curve: &Curve) -> Vec<f64> {
    scene.channels.bounds.iter().map(|b| curve.mean(b[0], b[1])).collect()
}

fn channel_means(scene: &Scene, spectrum: SpectrumId) -> Vec<f64> {
    means_of(scene, &scene.spectra[spectrum].curve)
}

/// How directions are chosen of what facets scatter again: by what single scattering loses there, as Kulla and Conty's lobe has it.
/// Over the square z² of the cosine, which Lambert's law spreads evenly: its integral up to each of [`INTERVALS`] + 1 even cosines, then
/// the density over z² in each interval between them, of the very numbers before.
fn again_directions(albedo: &ReflectionAlbedo) -> Vec<f32> {
    const POINTS: usize = 4;
    let square = |node: f64| (node / INTERVALS as f64).powi(2);
    let lost = |interval: usize| {
        let (from, to) = (square(interval as f64), square(interval as f64 + 1.0));
        let at = |i: usize| from + (to - from) * (i as f64 + 0.5) / POINTS as f64;
        // Never nothing, so that no direction in which anything is sent is left out.
        let lost =
            (0..POINTS).map(|i| mean_over_turns(albedo, at(i).sqrt()).max(1e-3 * albedo.mean_loss())).sum::<f64>();
        lost / POINTS as f64 * (to - from)
    };
    let mut below = vec![0.0];
    for interval in 0..INTERVALS {
        below.push(below[interval] + lost(interval));
    }
    let whole = below[INTERVALS];
    let below: Vec<f32> = below.into_iter().map(|sum| (sum / whole) as f32).collect();
    let density = (0..INTERVALS).map(|i| {
        let width = square(i as f64 + 1.0) - square(i as f64);
        (f64::from(below[i + 1] - below[i]) / width) as f32
    });
    below.iter().copied().chain(density).collect()
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
