//! How fast a device renders a scene, without the cube: trials of different kernels, measured by turns on the same work.

use std::sync::Arc;
use std::time::Instant;

use crate::Result;
use crate::device::prepared::Prepared;
use crate::gpu::adapter::Gpu;
use crate::render::interrupt::Interrupt;
use crate::render::wave::{Budget, WavePlan};
use crate::render::worker::{UnitRect, Worker};
use crate::scene::Scene;

/// Side of the tiles: small, so that a slow device is done with some of them soon.
const TILE: u32 = 16;
/// A full epoch of each tile.
const SAMPLES: u32 = 64;
/// What all trials do in a turn takes the first of them about so long, seconds.
const TURN_S: f64 = 0.5;

/// A device ready to render a scene.
pub struct Trial {
    worker: Worker,
    tiles: Vec<UnitRect>,
    epoch: u32,
    /// What its buffers took from the device when they were made, bytes; `None` where the device does not tell.
    pub allocated_bytes: Option<u64>,
}

/// What was measured of a trial.
#[derive(Debug, Clone, PartialEq)]
pub struct Rates {
    /// Of each turn.
    pub paths_per_s: Vec<f64>,
    /// Of a path in the passes, seconds ([`crate::render::worker::Profile`]).
    pub generate_s: f64,
    pub evaluate_s: f64,
}

impl Rates {
    pub fn median(&self) -> f64 {
        median(&self.paths_per_s)
    }

    /// The slowest and the fastest turn.
    pub fn range(&self) -> [f64; 2] {
        self.paths_per_s.iter().fold([f64::INFINITY, 0.0], |[low, high], &rate| [rate.min(low), rate.max(high)])
    }
}

/// The middle one of some values, or the mean of the two in the middle.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    if sorted.len() % 2 == 1 { sorted[middle] } else { 0.5 * (sorted[middle - 1] + sorted[middle]) }
}

impl Trial {
    /// Compiles `scene`'s kernels for `gpu`, with waves of `pool` paths, or as large as is worth it; or as large as fits.
    pub fn new(scene: &Scene, gpu: &Arc<Gpu>, pool: Option<u32>, interrupt: &Arc<Interrupt>) -> Result<Trial> {
        let prepared = Arc::new(Prepared::new(scene, 0)?);
        let before = gpu.allocated_bytes();
        let budget = Budget { memory: None, paths: pool };
        let mut worker = Worker::new(Arc::clone(gpu), prepared, [TILE, TILE], budget)?;
        worker.watch(interrupt);
        let tiles = spread(scene.film.crop);
        worker.submit(&tiles[..1], 0, 1)?;
        worker.collect()?;
        let allocated_bytes = gpu.allocated_bytes().zip(before).map(|(now, before)| now.saturating_sub(before));
        Ok(Trial { worker, tiles, epoch: 0, allocated_bytes })
    }

    pub fn plan(&self) -> &WavePlan {
        &self.worker.plan
    }

    /// What the plan says that the buffers take, bytes; uploading, which took more for a moment, is over.
    pub fn planned_bytes(&self) -> u64 {
        self.worker.plan.scene_bytes + self.worker.plan.wave_bytes()
    }

    /// Renders an epoch of the first `count` tiles, around again after the last. Seconds.
    fn turn(&mut self, count: usize) -> Result<f64> {
        let tiles: Vec<UnitRect> = self.tiles.iter().copied().cycle().take(count).collect();
        self.render(&tiles, SAMPLES)
    }

    /// Renders the next epoch of `tiles`. Seconds.
    fn render(&mut self, tiles: &[UnitRect], samples: u32) -> Result<f64> {
        let began = Instant::now();
        self.epoch += 1;
        for units in tiles.chunks(self.worker.plan.units_at_once(samples)) {
            self.worker.submit(units, self.epoch, samples)?;
        }
        self.worker.collect()?;
        Ok(began.elapsed().as_secs_f64())
    }
}

/// Seconds that each of `rounds` frames takes, a sample of every pixel.
pub fn frames(trial: &mut Trial, rounds: u32) -> Result<Vec<f64>> {
    let tiles = trial.tiles.clone();
    (0..rounds).map(|_| trial.render(&tiles, 1)).collect()
}

/// Measures all `trials` by turns, so that what else the machine does concerns all alike, then the passes of each once more.
pub fn measure(trials: &mut [Trial], rounds: u32) -> Result<Vec<Rates>> {
    let Some(first) = trials.first_mut() else { return Ok(Vec::new()) };
    // As many tiles as fill the largest waves, and then as many as take long enough.
    let mut count = first.worker.plan.units_at_once(SAMPLES);
    let seconds = first.turn(count)?;
    count *= (TURN_S / seconds).ceil().max(1.0) as usize;
    let paths = (count as u32 * TILE * TILE * SAMPLES) as f64;
    let mut rates = vec![Rates { paths_per_s: Vec::new(), generate_s: 0.0, evaluate_s: 0.0 }; trials.len()];
    for _ in 0..rounds {
        for (trial, rates) in trials.iter_mut().zip(&mut rates) {
            rates.paths_per_s.push(paths / trial.turn(count)?);
        }
    }
    for (trial, rates) in trials.iter_mut().zip(&mut rates) {
        trial.worker.enable_profile();
        trial.turn(count)?;
        let profile = trial.worker.profile;
        rates.generate_s = profile.generate_s / paths;
        rates.evaluate_s = profile.evaluate_s / paths;
    }
    Ok(rates)
}

/// Whole tiles of a film, in an order whose beginnings are spread all over it: by the golden ratio.
fn spread([x0, y0, x1, y1]: [u32; 4]) -> Vec<UnitRect> {
    let starts = |from: u32, to: u32| (from..to).step_by(TILE as usize);
    let tile = |(x, y): (u32, u32)| [x, y, (x + TILE).min(x1), (y + TILE).min(y1)];
    let tiles: Vec<UnitRect> = starts(y0, y1).flat_map(|y| starts(x0, x1).map(move |x| tile((x, y)))).collect();
    let whole = |tile: &UnitRect| tile[2] - tile[0] == TILE && tile[3] - tile[1] == TILE;
    let mut order: Vec<(f64, UnitRect)> =
        tiles.iter().enumerate().map(|(i, tile)| ((i as f64 * 0.618_033_988_75).fract(), *tile)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let spread: Vec<UnitRect> = order.into_iter().map(|(_, tile)| tile).filter(whole).collect();
    if spread.is_empty() { tiles } else { spread }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_whole_and_spread() {
        let tiles = spread([0, 0, 500, 300]);
        assert_eq!(tiles.len(), 31 * 18);
        let left = tiles[..20].iter().filter(|tile| tile[0] < 250).count();
        let above = tiles[..20].iter().filter(|tile| tile[1] < 150).count();
        assert!((6..=14).contains(&left) && (6..=14).contains(&above), "{left}, {above}");
        assert_eq!(spread([3, 3, 8, 9]), [[3, 3, 8, 9]]);
    }

    #[test]
    fn medians_are_in_the_middle() {
        let rates = |values: &[f64]| Rates { paths_per_s: values.to_vec(), generate_s: 0.0, evaluate_s: 0.0 };
        assert_eq!(rates(&[3.0, 1.0, 2.0]).median(), 2.0);
        assert_eq!(rates(&[4.0, 1.0, 2.0, 3.0]).median(), 2.5);
        assert_eq!(rates(&[4.0, 1.0, 2.0]).range(), [1.0, 4.0]);
    }
}
