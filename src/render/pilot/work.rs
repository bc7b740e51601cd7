//! What paths take: rays to make them, and what there is to evaluate along them. Counted on the pilot's own paths, since scenes differ in
//! it by more than devices do.

use std::ops::{Add, AddAssign, Mul};

use crate::Result;
use crate::device::evaluator::Costs;
use crate::device::instructions::{FIRST_RAW_OP, OP_MAP, OP_MARCH};
use crate::device::prepared::Prepared;
use crate::render::worker::{UnitRect, Worker};

use super::{FIRST_EPOCH, values};

/// What is evaluated along a path, in every channel; or the mean of several.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Work {
    /// Records, each with its numbers; those among them that look up an environment map.
    pub records: f64,
    pub maps: f64,
    /// Voxels that are marched through.
    pub cells: f64,
}

impl Work {
    /// Nanoseconds of a path in one channel, at one wavelength.
    pub fn cost(&self, costs: &Costs) -> f64 {
        costs.path + costs.record * self.records + costs.map * self.maps + costs.cell * self.cells
    }
}

impl Add for Work {
    type Output = Work;

    fn add(self, other: Work) -> Work {
        let Work { records, maps, cells } = other;
        Work { records: self.records + records, maps: self.maps + maps, cells: self.cells + cells }
    }
}

impl AddAssign for Work {
    fn add_assign(&mut self, other: Work) {
        *self = *self + other;
    }
}

impl Mul<f64> for Work {
    type Output = Work;

    fn mul(self, factor: f64) -> Work {
        Work { records: factor * self.records, maps: factor * self.maps, cells: factor * self.cells }
    }
}

/// Means over some paths.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Means {
    pub rays: f64,
    pub work: Work,
}

impl Means {
    /// Nanoseconds to make a path.
    pub fn making(&self, costs: &Costs) -> f64 {
        costs.camera + costs.ray * self.rays
    }

    /// Nanoseconds to make a path and evaluate it at `count` wavelengths in each of `channels` channels.
    pub fn whole(&self, costs: &Costs, channels: usize, count: u32) -> f64 {
        let several = f64::from(count) * (self.work.cost(costs) - costs.path);
        self.making(costs) + channels as f64 * (costs.path + several)
    }

    /// What evaluating a path in all channels costs, over making it.
    pub fn evaluation(&self, costs: &Costs, channels: usize) -> f64 {
        channels as f64 * self.work.cost(costs) / self.making(costs)
    }
}

/// Of `epochs` samples of every pixel in `units`.
pub fn means(worker: &mut Worker, prepared: &Prepared, units: &[UnitRect], epochs: u32) -> Result<Means> {
    let mut means = Means::default();
    for epoch in 0..epochs {
        let (_, works, rays) = sample(worker, prepared, units, FIRST_EPOCH + epoch)?;
        means.rays += rays as f64;
        works.into_iter().for_each(|work| means.work += work);
    }
    let paths = f64::from(epochs) * units.len() as f64;
    Ok(Means { rays: means.rays / paths, work: means.work * (1.0 / paths) })
}

/// One sample of every pixel in `units`: [pixel][channel], what was evaluated for each pixel, and all their rays.
pub fn sample(
    worker: &mut Worker,
    prepared: &Prepared,
    units: &[UnitRect],
    epoch: u32,
) -> Result<(Vec<f32>, Vec<Work>, u64)> {
    let (mut radiance, mut works, mut rays) = (Vec::new(), Vec::new(), 0);
    for units in units.chunks(worker.plan.units_at_once(1)) {
        let found = values(worker, units, epoch, 1)?;
        radiance.extend(found.radiance);
        rays += found.rays;
        // One wave: a path for each unit, in their order.
        let (heads, records) = worker.saved_paths(units.len() as u32)?;
        let [head_words, record_words] = [heads.len(), records.len()].map(|words| words / units.len());
        let paths = heads.chunks(head_words).zip(records.chunks(record_words));
        works.extend(paths.map(|(head, records)| work(prepared, head[1] & 0xffff, records)));
    }
    Ok((radiance, works, rays))
}

/// Of a path with `used` records.
fn work(prepared: &Prepared, used: u32, records: &[u32]) -> Work {
    if !prepared.is_general() {
        return Work { records: f64::from(used), ..Work::default() };
    }
    let mut work = Work::default();
    let mut rest = records.chunks(4).take(used as usize);
    while let Some(record) = rest.next() {
        work.records += 1.0;
        match record[0] & 0x3f {
            OP_MAP => work.maps += 1.0,
            OP_MARCH => {
                if let (Some(from), Some(to)) = (rest.next(), rest.next()) {
                    work.cells += cells(from, to);
                }
            }
            operation if operation >= FIRST_RAW_OP => _ = rest.next(),
            _ => {}
        }
    }
    work
}

/// Voxels on a straight way between two places, in voxels.
fn cells(from: &[u32], to: &[u32]) -> f64 {
    let planes = |axis: usize| (f32::from_bits(to[axis]).floor() - f32::from_bits(from[axis]).floor()).abs();
    1.0 + f64::from((0..3).map(planes).sum::<f32>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::instructions::{OP_ROUGH_TRANSMIT, OP_SPECTRUM};

    #[test]
    fn voxels_on_a_way() {
        let place = |p: [f32; 3]| p.map(f32::to_bits);
        assert_eq!(cells(&place([0.5, 0.5, 0.5]), &place([0.6, 0.5, 0.5])), 1.0);
        assert_eq!(cells(&place([0.5, 3.5, 0.5]), &place([9.5, 0.1, 1.5])), 1.0 + 9.0 + 3.0 + 1.0);
    }

    /// Numbers after an instruction are no instructions, whatever they are.
    #[test]
    fn instructions_with_numbers_count_once() {
        let scene = crate::scene_builder::Builder::new().plastic(
            crate::scene_builder::sphere(glam::DVec3::ZERO, 1.0),
            0.5,
            1.5,
            0.2,
        );
        let prepared = Prepared::new(&scene.build(), 0).expect("a scene");
        let numbers = |p: [f32; 3]| [p[0].to_bits(), p[1].to_bits(), p[2].to_bits(), OP_MARCH];
        let records = [
            [OP_MAP, 0, 0, 0],
            [OP_MARCH, 0, 0, 0],
            numbers([0.5, 0.5, 0.5]),
            numbers([4.5, 0.5, 0.5]),
            [OP_ROUGH_TRANSMIT, 0, 0, 0],
            [OP_MARCH, 0, 0, 0],
            [OP_SPECTRUM, 0, 0, 0],
            [OP_SPECTRUM, 0, 0, 0],
        ];
        assert_eq!(work(&prepared, 7, records.as_flattened()), Work { records: 4.0, maps: 1.0, cells: 5.0 });
    }
}
