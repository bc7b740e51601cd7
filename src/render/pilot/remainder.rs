//! How much of a picture does not separate, before it is rendered factored.

use std::sync::Arc;

use super::{FIRST_EPOCH, Pilot, pixels, worker};
use crate::Result;
use crate::cube::RemainderShare;
use crate::device::prepared::Prepared;
use crate::device::separable;
use crate::render::worker::Collected;
use crate::scene::{Evaluator, Scene};
use crate::spectral::product::Expander;

/// Samples of each of the pilot's pixels.
const SAMPLES: u32 = 16;

impl Pilot<'_> {
    /// What share of the radiance `render --factored` would keep in a remainder, by few samples of the pilot's pixels; `None` where all
    /// separates.
    pub fn remainder(&mut self) -> Result<Option<RemainderShare>> {
        let scene: Scene = self.scene.clone().factored();
        let prepared = Arc::new(Prepared::for_evaluator(&scene, 0, Evaluator::Factored)?);
        if !prepared.has_remainder() {
            return Ok(None);
        }
        let separated = separable::of(&scene)?;
        let most_factors = separated.most_factors(scene.integrator.max_bounces);
        let expander = Expander::new(&separated.basis, &scene.channels, most_factors as usize);
        self.on_a_device(|pilot, gpu| {
            let mut worker = worker(gpu, &prepared, pilot.memory, pilot.interrupt)?;
            let mut share = RemainderShare::none(scene.channels.len());
            for epoch in 0..SAMPLES {
                for units in pixels(&pilot.scene.film).chunks(worker.plan.units_at_once(1)) {
                    worker.submit(units, FIRST_EPOCH + epoch, 1)?;
                    if let Some(collected) = worker.collect()? {
                        add(&mut share, &collected, &prepared, &expander);
                    }
                }
            }
            Ok(Some(share))
        })
    }
}

/// Adds what came back of units of one pixel each.
fn add(share: &mut RemainderShare, collected: &Collected, prepared: &Prepared, expander: &Expander) {
    let sums = prepared.integration.as_ref().map(|integration| integration.sums(collected.means()));
    let remainder = sums.as_deref().unwrap_or(collected.means());
    let channels = expander.channels();
    let mut separated = vec![0.0f32; channels];
    for (weights, remainder) in collected.weights.iter().zip(remainder.chunks(channels)) {
        weights.expand(0, &expander.rows(&weights.products), &mut separated);
        let remainder: Vec<f64> = remainder.iter().map(|value| f64::from(*value)).collect();
        let of_all = remainder.iter().zip(&separated).map(|(value, more)| value + f64::from(*more));
        share.add(&remainder, &of_all.collect::<Vec<_>>());
    }
}
