//! How much of a picture the last of a scene's bounces brings, where matter scatters: what more of them would is not far below.

use std::fmt;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::Result;
use crate::device::prepared::Prepared;
use crate::gpu::adapter::Gpu;
use crate::render::interrupt::Interrupt;
use crate::render::pilot;
use crate::render::wave::Budget;
use crate::render::worker::Worker;
use crate::scene::Scene;

/// Epochs of one sample of the pilot's pixels, at most; and after what time no more of them are begun: a path through a cloud takes
/// milliseconds on a software device, and all that hangs on this is a sentence.
const EPOCHS: u32 = 16;
const TIME: Duration = Duration::from_secs(1);
/// What is warned of.
const NOTED: f64 = 0.01;

/// The share of a channel's radiance that paths bring at their last scattering event.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LastBounce {
    pub bounces: u32,
    /// The largest of all channels, and which that is.
    pub share: f64,
    pub channel: usize,
}

impl LastBounce {
    /// Follows the same paths to the last event and to the one before it, in some pixels; `None` where nothing scatters in
    /// space, or nothing is seen.
    ///
    /// # Errors
    /// Those of a device.
    pub fn measure(
        scene: &Scene,
        prepared: &Arc<Prepared>,
        gpu: &Arc<Gpu>,
        memory: Option<u64>,
        interrupt: &Arc<Interrupt>,
    ) -> Result<Option<LastBounce>> {
        let bounces = scene.integrator.max_bounces;
        if prepared.scattering.is_none() || bounces == 0 {
            return Ok(None);
        }
        let budget = Budget { memory, paths: None };
        let mut worker = Worker::new(Arc::clone(gpu), Arc::clone(prepared), [1, 1], budget)?;
        worker.watch(interrupt);
        let (film, channels) = (&scene.film, prepared.channels);
        let (began, mut epochs) = (Instant::now(), 0);
        let mut all = vec![0.0; channels];
        while epochs < EPOCHS && (epochs == 0 || began.elapsed() < TIME) {
            add(&mut all, &pilot::channel_sums(&mut worker, film, channels, epochs..epochs + 1)?);
            epochs += 1;
        }
        worker.limit_bounces(bounces - 1);
        let before = pilot::channel_sums(&mut worker, film, channels, 0..epochs)?;
        let shares = all.iter().zip(&before).map(|(all, before)| if *all > 0.0 { (all - before) / all } else { 0.0 });
        let most = shares.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        Ok(most.map(|(channel, share)| LastBounce { bounces, share, channel }))
    }

    pub fn is_much(&self) -> bool {
        self.share > NOTED
    }
}

fn add(sums: &mut [f64], more: &[f64]) {
    sums.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
}

impl fmt::Display for LastBounce {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let LastBounce { bounces, share, channel } = self;
        write!(f, "the last of {bounces} bounces brings {:.2} % of the radiance in channel {channel}", 100.0 * share)?;
        match self.is_much() {
            true => f.write_str(": matter that scatters is too dark by more than that; raise integrator.max_bounces"),
            false => f.write_str(", less in others"),
        }
    }
}
