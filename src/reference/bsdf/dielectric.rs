//! Boundaries between dielectrics: ideal and rough, dispersive or not.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec3;

use super::ggx::Ggx;
use super::reflection::{Boundary, Mirror, RoughMirror, reflected};
use super::{Choice, Lobe, Vertex, cosine_density, cosine_direction, fresnel};
use crate::scene::{Scene, SpectrumId};
use crate::spectral::hemisphere::{DielectricAlbedo, ReflectionProbability};

/// Indices this near to 1 make no visible boundary. The half vector of refraction is lost there: a rough boundary that
/// is matched in all channels is smooth, and one that is in some bends there by an index this far from 1.
const MATCHED: f64 = 1e-4;

/// The lobes of a dielectric: reflection and refraction and, where rough, what is scattered more than once. `range` bounds its index.
pub fn lobes(surface: &Surface, range: [f64; 2], roughness: Option<[f64; 2]>) -> Vec<Box<dyn Lobe>> {
    match roughness.filter(|_| range.iter().any(|eta| (eta - 1.0).abs() >= MATCHED)) {
        None => vec![Box::new(Mirror(surface.clone())), Box::new(Refraction(surface.clone()))],
        Some(alpha) => {
            let (index, albedo) = (surface.index, DielectricAlbedo::shared(alpha[0], range));
            let again = |transmits| Box::new(Again { index, albedo: Arc::clone(&albedo), transmits });
            let mirror = RoughMirror { boundary: surface.clone(), ggx: Ggx { alpha } };
            let once = RoughBoundary { mirror, albedo: Arc::clone(&albedo) };
            vec![Box::new(once), again(false), again(true)]
        }
    }
}

/// The index behind a surface over that before it.
#[derive(Clone, Copy)]
struct Index {
    eta: SpectrumId,
    /// The mean over channels, by which all are bent where dispersion is off.
    mean: Option<f64>,
}

impl Index {
    /// Beyond over before, as seen from the side of the vertex, in channel `k`.
    fn relative(&self, at: &Vertex, k: usize) -> f64 {
        let eta = at.spectra.value(self.eta, k);
        if at.inside { eta.recip() } else { eta }
    }

    /// [`Self::relative`] for directions, by which channel `k` is bent.
    fn bending(&self, at: &Vertex, k: usize) -> f64 {
        match self.mean {
            Some(mean) if at.inside => mean.recip(),
            Some(mean) => mean,
            None => self.relative(at, k),
        }
    }

    /// F in channel `k`: 1 where the channel is totally reflected, be it by the index all are bent by.
    fn reflectance(&self, at: &Vertex, cosine: f64, k: usize) -> f64 {
        match fresnel::cosine_beyond(cosine, self.bending(at, k)) {
            Some(_) => fresnel::dielectric(cosine, self.relative(at, k)),
            None => 1.0,
        }
    }

    /// Whether live channels are bent differently.
    fn disperses(&self, at: &Vertex) -> bool {
        let first = self.bending(at, at.alive.start);
        at.alive.clone().any(|k| self.bending(at, k) != first)
    }
}

/// A boundary, and the table that decides between reflection and refraction at the cosine with its normal.
#[derive(Clone)]
pub struct Surface {
    index: Index,
    decision: Arc<ReflectionProbability>,
}

impl Surface {
    pub fn new(scene: &Scene, eta: SpectrumId, dispersion: bool) -> Surface {
        let curve = &scene.spectra[eta].curve;
        let bounds = &scene.channels.bounds;
        let mean = || bounds.iter().map(|b| curve.mean(b[0], b[1])).sum::<f64>() / bounds.len() as f64;
        let index = Index { eta, mean: (!dispersion).then(mean) };
        Surface { index, decision: Arc::new(ReflectionProbability::new(curve, &scene.channels)) }
    }
}

impl Boundary for Surface {
    fn reflectance(&self, at: &Vertex, cosine: f64, k: usize) -> f64 {
        self.index.reflectance(at, cosine, k)
    }

    fn albedo(&self, at: &Vertex, _k: usize) -> f64 {
        self.decision.at(at.inside, at.o.z)
    }
}

/// Ideal refraction. Where the live channels bend differently, one goes on in its direction and the others stop
/// (degradation: Hoarau et al. 2018, section 3.4, after Evans and McCool 1999).
struct Refraction(Surface);

impl Lobe for Refraction {
    fn albedo(&self, at: &Vertex, _k: usize) -> f64 {
        1.0 - self.0.decision.at(at.inside, at.o.z)
    }

    fn sample(&self, at: &Vertex, u: [f64; 3]) -> Option<Choice> {
        let index = &self.0.index;
        let disperses = index.disperses(at);
        let k = if disperses { one_of(at, u[0]) } else { at.alive.start };
        let direction = refracted(at.o, DVec3::Z, index.bending(at, k))?;
        Some(Choice::Only { direction, channel: disperses.then_some(k) })
    }

    fn evaluate(&self, _at: &Vertex, _i: DVec3, _scale: f64, _out: &mut [f64]) {}

    fn density(&self, _at: &Vertex, _i: DVec3) -> f64 {
        0.0
    }

    fn factor(&self, at: &Vertex, k: usize) -> f64 {
        let index = &self.0.index;
        (1.0 - index.reflectance(at, at.o.z, k)) / index.bending(at, k).powi(2)
    }
}

/// Single reflection and refraction by microfacets (Walter et al. 2007, eq. 20 and 21: reflection with masking correlated
/// by height, refraction with their G1 G1). A facet is chosen among the visible ones, then whether it reflects.
///
/// Channels that bend differently have half vectors of their own for one pair of directions. The direction is that of a
/// channel chosen at random, and weighted by the mean density over the live channels (the balance heuristic over
/// channels, Wilkie et al. 2014), so that no channel has to stop.
struct RoughBoundary {
    /// Its reflection, and the facets that refract as well.
    mirror: RoughMirror<Surface>,
    albedo: Arc<DielectricAlbedo>,
}

/// The geometry of one pair of directions across the boundary: the half vector, and |i·h| / (o·h + η i·h)².
struct Half {
    h: DVec3,
    o_h: f64,
    spread: f64,
}

impl RoughBoundary {
    fn bending(&self, at: &Vertex, k: usize) -> f64 {
        let eta = self.mirror.boundary.index.bending(at, k);
        if (eta - 1.0).abs() < MATCHED { 1.0 + MATCHED.copysign(eta - 1.0) } else { eta }
    }

    /// The half vector that refracts o into i, if any does. For f32: the sums cancel as η nears 1, where the bound on
    /// |η - 1| leaves three digits.
    fn half(o: DVec3, i: DVec3, eta: f64) -> Option<Half> {
        let h = -(o + eta * i);
        let h = if h.z < 0.0 { -h } else { h }.try_normalize()?;
        let (o_h, i_h) = (o.dot(h), i.dot(h));
        if o_h <= 0.0 || i_h >= 0.0 {
            return None;
        }
        Some(Half { h, o_h, spread: -i_h / (o_h + eta * i_h).powi(2) })
    }

    fn refracted_density(&self, at: &Vertex, i: DVec3, k: usize) -> f64 {
        let eta = self.bending(at, k);
        let Some(half) = Self::half(at.o, i, eta) else { return 0.0 };
        let refracts = 1.0 - self.mirror.boundary.decision.at(at.inside, half.o_h.min(1.0));
        refracts * self.mirror.ggx.visible_density(at.o, half.h) * eta * eta * half.spread
    }

    fn evaluate_refraction(&self, at: &Vertex, i: DVec3, scale: f64, out: &mut [f64]) {
        let visible = scale * self.mirror.ggx.visible(at.o) * self.mirror.ggx.visible(i) / at.o.z;
        // (η, f |cosθ_i| without 1 - F, o·h): channels that bend alike share it.
        let mut shared: Option<(f64, f64, f64)> = None;
        for k in at.alive.clone() {
            let eta = self.bending(at, k);
            let (_, geometric, o_h) = match shared {
                Some(same) if same.0 == eta => same,
                _ => match Self::half(at.o, i, eta) {
                    // η² of flux and 1/η² of radiance cancel.
                    Some(half) => {
                        (eta, visible * self.mirror.ggx.distribution(half.h) * half.o_h * half.spread, half.o_h)
                    }
                    None => (eta, 0.0, 1.0),
                },
            };
            shared = Some((eta, geometric, o_h));
            out[k] += geometric * (1.0 - self.mirror.boundary.index.reflectance(at, o_h, k));
        }
    }
}

impl Lobe for RoughBoundary {
    fn albedo(&self, at: &Vertex, k: usize) -> f64 {
        1.0 - self.albedo.loss(at.spectra.value(self.mirror.boundary.index.eta, k), at.inside, at.o.z)
    }

    fn sample(&self, at: &Vertex, u: [f64; 3]) -> Option<Choice> {
        let h = self.mirror.ggx.visible_normal(at.o, [u[1], u[2]]);
        let reflects = self.mirror.boundary.decision.at(at.inside, at.o.dot(h).min(1.0));
        if u[0] < reflects {
            return reflected(at.o, h).map(Choice::Spread);
        }
        let k = one_of(at, (u[0] - reflects) / (1.0 - reflects));
        let i = refracted(at.o, h, self.bending(at, k))?;
        (i.z < 0.0).then_some(Choice::Spread(i))
    }

    fn evaluate(&self, at: &Vertex, i: DVec3, scale: f64, out: &mut [f64]) {
        if i.z > 0.0 {
            self.mirror.evaluate(at, i, scale, out);
        } else if i.z < 0.0 {
            self.evaluate_refraction(at, i, scale, out);
        }
    }

    fn density(&self, at: &Vertex, i: DVec3) -> f64 {
        if i.z >= 0.0 {
            let h = (at.o + i).normalize();
            let reflects = self.mirror.boundary.decision.at(at.inside, at.o.dot(h).min(1.0));
            return reflects * self.mirror.density(at, i);
        }
        if !self.mirror.boundary.index.disperses(at) {
            return self.refracted_density(at, i, at.alive.start);
        }
        let sum: f64 = at.alive.clone().map(|k| self.refracted_density(at, i, k)).sum();
        sum / at.alive.len() as f64
    }
}

/// What a rough boundary scatters more than once, after Kulla and Conty 2017: with L = 1 - R - T of single scattering on
/// the side of a direction and L_avg its hemispherical mean, the share a of what is lost comes back as
/// a L(o) L(i) / (π L_avg), the share b = 1 - a passes as b L(o) L(i) / (π L_avg,beyond), of flux. Reciprocity asks that
/// b L_avg n² be the same from both sides, which b = η² L_avg,beyond / (η² L_avg,beyond + L_avg) is, η beyond over before.
struct Again {
    index: Index,
    albedo: Arc<DielectricAlbedo>,
    transmits: bool,
}

impl Again {
    /// This lobe's share of what is lost, and the mean loss on the side it goes to.
    fn share(&self, at: &Vertex, k: usize) -> (f64, f64) {
        let eta = at.spectra.value(self.index.eta, k);
        let here = self.albedo.mean_loss(eta, at.inside);
        let beyond = self.albedo.mean_loss(eta, !at.inside) * self.index.relative(at, k).powi(2);
        if here + beyond <= 0.0 {
            return (0.0, 1.0);
        }
        if self.transmits {
            (beyond / (here + beyond), self.albedo.mean_loss(eta, !at.inside))
        } else {
            (here / (here + beyond), here)
        }
    }

    fn loss(&self, at: &Vertex, behind: bool, z: f64, k: usize) -> f64 {
        self.albedo.loss(at.spectra.value(self.index.eta, k), behind, z).max(0.0)
    }
}

impl Lobe for Again {
    fn albedo(&self, at: &Vertex, k: usize) -> f64 {
        self.share(at, k).0 * self.loss(at, at.inside, at.o.z, k)
    }

    fn sample(&self, _at: &Vertex, u: [f64; 3]) -> Option<Choice> {
        let mut i = cosine_direction([u[1], u[2]]);
        if self.transmits {
            i.z = -i.z;
        }
        Some(Choice::Spread(i))
    }

    fn evaluate(&self, at: &Vertex, i: DVec3, scale: f64, out: &mut [f64]) {
        if (i.z < 0.0) != self.transmits {
            return;
        }
        for k in at.alive.clone() {
            let (share, mean) = self.share(at, k);
            let radiance = if self.transmits { self.index.bending(at, k).powi(-2) } else { 1.0 };
            let lost =
                self.loss(at, at.inside, at.o.z, k) * self.loss(at, at.inside != self.transmits, i.z.abs(), k) / mean;
            out[k] += scale * share * lost * radiance * i.z.abs() / PI;
        }
    }

    fn density(&self, _at: &Vertex, i: DVec3) -> f64 {
        cosine_density(if self.transmits { -i } else { i })
    }
}

/// `o` bent by a boundary of relative index `eta` (beyond over before) and normal `h`; `None` under total reflection.
fn refracted(o: DVec3, h: DVec3, eta: f64) -> Option<DVec3> {
    let cosine = o.dot(h);
    let beyond = fresnel::cosine_beyond(cosine, eta)?;
    Some(((cosine / eta - beyond) * h - o / eta).normalize())
}

/// One of the live channels.
fn one_of(at: &Vertex, u: f64) -> usize {
    let count = at.alive.len();
    at.alive.start + ((u * count as f64) as usize).min(count - 1)
}
