//! Choosing a point on the scene's emitting surfaces.

use super::primitive::SurfacePoint;
use super::rng::Rng;
use super::world::World;
use crate::scene::{Emission, Scene, Sides};

/// A point on a light.
pub struct LightPoint {
    /// Index into [`World::primitives`].
    pub primitive: usize,
    pub point: SurfacePoint,
    /// Probability density by area of this choice, m⁻².
    pub density: f64,
}

/// Emitting primitives with the probability of each.
///
/// A light's probability is its share of the emitted power, averaged over the channels in which anything emits: so
/// whatever emits in any channel can be chosen, and no channel rules the others.
pub struct Lights {
    primitives: Vec<usize>,
    /// Probability that one of `primitives[..=i]` is chosen; the last is 1.
    cumulative: Vec<f64>,
    /// Per primitive of the world: probability over area, m⁻²; 0 where nothing is emitted.
    density: Vec<f64>,
}

impl Lights {
    pub fn new(scene: &Scene, world: &World) -> Self {
        let mut object_area = vec![0.0; scene.objects.len()];
        for primitive in &world.primitives {
            object_area[primitive.object] += primitive.surface.area();
        }
        let share = object_shares(scene, &object_area);

        let density: Vec<f64> = world
            .primitives
            .iter()
            .map(|p| if share[p.object] > 0.0 { share[p.object] / object_area[p.object] } else { 0.0 })
            .collect();
        let (mut primitives, mut cumulative, mut sum) = (Vec::new(), Vec::new(), 0.0);
        for (i, primitive) in world.primitives.iter().enumerate().filter(|(i, _)| density[*i] > 0.0) {
            sum += density[i] * primitive.surface.area();
            primitives.push(i);
            cumulative.push(sum);
        }
        // Shares sum to 1 but for rounding, which the last light takes.
        if let Some(last) = cumulative.last_mut() {
            *last = 1.0;
        }
        Lights { primitives, cumulative, density }
    }

    /// `None` where nothing emits.
    pub fn sample(&self, world: &World, rng: &mut Rng) -> Option<LightPoint> {
        let choice = rng.uniform();
        let primitive = *self.primitives.get(self.cumulative.partition_point(|&c| c <= choice))?;
        let point = world.primitives[primitive].surface.sample(rng);
        Some(LightPoint { primitive, point, density: self.density[primitive] })
    }

    /// The density by area, m⁻², with which [`Lights::sample`] chooses a given point of `primitive`.
    pub fn density(&self, primitive: usize) -> f64 {
        self.density[primitive]
    }
}

/// Whether radiance leaves on this side.
pub fn emits(emission: &Emission, front: bool) -> bool {
    front || emission.sides == Sides::Both
}

/// Probability of choosing each object; sums to 1 where anything emits.
fn object_shares(scene: &Scene, area: &[f64]) -> Vec<f64> {
    let mut share = vec![0.0; scene.objects.len()];
    let mut channels_lit = 0.0;
    for &[from, to] in &scene.channels.bounds {
        // Proportional to power; the common factor π does not matter.
        let power = |(i, object): (usize, &crate::scene::Object)| match &object.emission {
            Some(emission) => {
                let sides = if emission.sides == Sides::Both { 2.0 } else { 1.0 };
                sides * area[i] * scene.spectra[emission.radiance].curve.mean(from, to)
            }
            None => 0.0,
        };
        let powers: Vec<f64> = scene.objects.iter().enumerate().map(power).collect();
        let total: f64 = powers.iter().sum();
        if total > 0.0 {
            channels_lit += 1.0;
            for (share, power) in share.iter_mut().zip(&powers) {
                *share += power / total;
            }
        }
    }
    if channels_lit > 0.0 {
        share.iter_mut().for_each(|s| *s /= channels_lit);
    }
    share
}
