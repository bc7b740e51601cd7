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
const TILE: u32 = 8;
/// A full epoch of each tile.
const SAMPLES: u32 = 64;
const TILE_PATHS: f64 = (TILE * TILE * SAMPLES) as f64;
/// How long a turn should take, seconds; it takes longer where so few tiles do.
const TURN_S: f64 = 0.5;
const LEAST_TILES: usize = 4;

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

    /// Renders an epoch of the first tiles, `repeats` times. Seconds.
    fn turn(&mut self, tiles: usize, repeats: usize) -> Result<f64> {
        let tiles = self.tiles[..tiles].repeat(repeats);
        self.render(&tiles, SAMPLES)
    }

    /// About how many tiles are rendered a second: twice as much work again and again, samples and then tiles, until it takes
    /// half a turn. So neither a slow device is asked for much, nor a fast one judged by what does not fill it.
    fn pace(&mut self) -> Result<f64> {
        let (mut samples, mut count) = (1, 1);
        loop {
            let tiles: Vec<UnitRect> = self.tiles.iter().copied().cycle().take(count).collect();
            let seconds = self.render(&tiles, samples)?;
            if seconds >= 0.5 * TURN_S {
                return Ok(f64::from(samples) / f64::from(SAMPLES) * count as f64 / seconds);
            }
            if samples < SAMPLES { samples *= 2 } else { count *= 2 }
        }
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
    let Some(first) = trials.first() else { return Ok(Vec::new()) };
    let there = first.tiles.len();
    let paces = trials.iter_mut().map(Trial::pace).collect::<Result<Vec<_>>>()?;
    let full: Vec<usize> = trials.iter().map(|trial| trial.worker.plan.units_at_once(SAMPLES)).collect();
    let (tiles, repeats) = turns(&paces, &full, there);
    let mut rates = vec![Rates { paths_per_s: Vec::new(), generate_s: 0.0, evaluate_s: 0.0 }; trials.len()];
    let paths = |repeats: usize| (tiles * repeats) as f64 * TILE_PATHS;
    for _ in 0..rounds {
        for ((trial, rates), &repeats) in trials.iter_mut().zip(&mut rates).zip(&repeats) {
            rates.paths_per_s.push(paths(repeats) / trial.turn(tiles, repeats)?);
        }
    }
    for ((trial, rates), &repeats) in trials.iter_mut().zip(&mut rates).zip(&repeats) {
        trial.worker.enable_profile();
        trial.turn(tiles, repeats)?;
        let (profile, paths) = (trial.worker.profile, paths(repeats));
        rates.generate_s = profile.generate_s / paths;
        rates.evaluate_s = profile.evaluate_s / paths;
    }
    Ok(rates)
}

/// How many tiles a turn has, of those that are `there`, the same for all trials, and how often each trial renders them in
/// one: tiles differ in what they cost, and evaluators hundredfold in what they can do. `paces` are tiles a second, `full` the
/// tiles that fill a trial's waves.
fn turns(paces: &[f64], full: &[usize], there: usize) -> (usize, Vec<usize>) {
    let slowest = paces.iter().copied().fold(f64::INFINITY, f64::min);
    let tiles = ((TURN_S * slowest) as usize).clamp(LEAST_TILES.min(there), there);
    let enough = |(&pace, &full): (&f64, &usize)| ((TURN_S * pace).round() as usize).max(full).div_ceil(tiles);
    (tiles, paces.iter().zip(full).map(enough).collect())
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

    /// The same tiles for all, as many as the slowest does in half a second, and as often as a trial needs for as long.
    #[test]
    fn turns_are_alike_and_long_enough() {
        assert_eq!(turns(&[20.0, 2000.0, 37.0], &[1, 4, 8], 4096), (10, vec![1, 100, 2]));
        // A few tiles take the slowest long; waves that hold many tiles are filled.
        assert_eq!(turns(&[0.1, 4.0], &[1, 64], 4096), (4, vec![1, 16]));
        // A small picture is rendered again and again.
        assert_eq!(turns(&[500.0, 1000.0], &[1, 1], 4), (4, vec![63, 125]));
    }

    #[test]
    fn tiles_are_whole_and_spread() {
        let tiles = spread([0, 0, 500, 300]);
        assert_eq!(tiles.len(), 62 * 37);
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
