//! Tiles that end by their own errors (`--error-per tile`): none waits for another, and those with the largest errors come first. Where
//! a tile ends follows from its own samples alone, so that neither devices, nor kills, nor the order of work change a bit.

use std::collections::BTreeMap;

use super::{Event, Render};
use crate::cube::{Writer, epochs_in, is_within, next_look, samples_before};
use crate::preview::TileEnds;
use crate::render::pool::{Merged, Report};
use crate::render::queue::Queue;
use crate::render::watch::Reports;
use crate::{Error, Result};

/// How far the tiles of a render are.
struct Tiles {
    /// The first of them.
    first: u32,
    each: Vec<Tile>,
    /// How many tiles have so many samples.
    by_samples: BTreeMap<u32, u32>,
    /// What decides: the largest error of a channel, and the most samples.
    error: f64,
    limit: Option<u32>,
    full: u32,
}

/// How far one is.
#[derive(Clone, Copy)]
struct Tile {
    /// Samples per pixel.
    samples: u32,
    /// Its error at the last look.
    look: f32,
    /// The epoch that it has been allowed up to, without that one: no device takes that before it is decided.
    until: u32,
    goes_on: bool,
}

/// What becomes of a tile.
#[derive(Debug, PartialEq)]
enum Verdict {
    Exact,
    /// It has all samples that it may have.
    Full,
    /// It goes on to this epoch, without that one.
    Until(u32),
}

impl Tiles {
    fn of(cube: &Writer, error: f64, limit: Option<u32>) -> Tiles {
        let mut by_samples = BTreeMap::new();
        cube.found().iter().for_each(|&n| *by_samples.entry(n).or_default() += 1);
        let each = cube
            .found()
            .iter()
            .map(|&samples| Tile { samples, look: f32::INFINITY, until: 0, goes_on: true })
            .collect();
        Tiles { first: cube.tiles().start, each, by_samples, error, limit, full: cube.cube().header().epoch }
    }

    fn at(&mut self, tile: u32) -> &mut Tile {
        &mut self.each[(tile - self.first) as usize]
    }

    /// Notes that a tile has `samples` per pixel now.
    fn note(&mut self, tile: u32, samples: u32) {
        let before = std::mem::replace(&mut self.at(tile).samples, samples);
        if let Some(count) = self.by_samples.get_mut(&before) {
            *count -= 1;
            if *count == 0 {
                self.by_samples.remove(&before);
            }
        }
        *self.by_samples.entry(samples).or_default() += 1;
    }

    /// The least that any tile has.
    fn least(&self) -> u32 {
        self.by_samples.keys().next().copied().unwrap_or(0)
    }

    /// What the errors seen at the last two looks say of a tile with `samples` per pixel.
    fn judge(&self, samples: u32, looks: [f32; 2]) -> Result<Verdict> {
        if is_within(looks, self.error) {
            return Ok(Verdict::Exact);
        }
        if self.limit.is_some_and(|limit| samples >= limit) {
            return Ok(Verdict::Full);
        }
        let look = next_look(samples / self.full).checked_mul(self.full);
        let until = match (look, self.limit) {
            (Some(look), Some(limit)) => look.min(limit),
            (Some(look), None) => look,
            (None, Some(limit)) => limit,
            (None, None) => {
                return Err(Error::Usage(format!("more than {} samples per pixel cannot be counted", u32::MAX)));
            }
        };
        Ok(Verdict::Until(epochs_in(until, self.full)))
    }
}

impl Render<'_> {
    /// Every tile until its error is `error` at most in every channel, at two looks in a row, or until it has all samples that it may
    /// have.
    pub(super) fn tiles_by_error(
        &mut self,
        error: f64,
        cube: &Writer,
        queue: &Queue,
        reports: &mut Reports,
        observe: &mut dyn FnMut(Event) -> Result<()>,
    ) -> Result<()> {
        let mut tiles = Tiles::of(cube, error, self.samples_limit);
        let count = cube.tiles().len() as u32;
        let full = tiles.full;
        queue.fill(cube.tiles().zip(cube.found().iter().map(|&n| epochs_in(n, full))), 1);
        self.status.tiles = Some(TileEnds { ended: 0, by_samples: 0, tiles: count, worst: None });
        self.status.units = (0, count);
        for tile in cube.tiles() {
            self.judge(&mut tiles, tile, cube, queue)?;
        }
        self.look_at_all(&tiles, cube);
        self.update_estimate(cube);
        // An epoch is as many units as there are tiles, whichever.
        let (mut units, mut groups) = (0, 0u32);
        while self.status.units.0 < self.status.units.1 {
            self.answer(cube, observe)?;
            self.rest_if_asked(queue, observe)?;
            if self.is_over(groups) {
                return self.finish_units(&mut tiles, cube, queue, reports, observe);
            }
            match self.hear(reports)? {
                Some((device, Report::Merged(merged))) => {
                    (units, groups) = (units + merged.group.tiles.len() as u32, groups + 1);
                    self.note_of_tiles(&mut tiles, cube, queue, device, merged, observe)?;
                }
                Some((device, report)) => self.left(device, report, observe)?,
                None => {}
            }
            if units >= count {
                units -= count;
                self.end_epoch(&tiles, cube, observe)?;
            }
        }
        self.end_epoch(&tiles, cube, observe)?;
        if cube.is_dark() {
            observe(Event::Warning(super::DARK.into()))?;
        }
        Ok(())
    }

    fn end_epoch(&mut self, tiles: &Tiles, cube: &Writer, observe: &mut dyn FnMut(Event) -> Result<()>) -> Result<()> {
        self.look_at_all(tiles, cube);
        self.tell_epoch(cube, observe)
    }

    /// Decides whether a tile goes on, and how far.
    fn judge(&mut self, tiles: &mut Tiles, tile: u32, cube: &Writer, queue: &Queue) -> Result<()> {
        let ends = self.status.tiles.as_mut().ok_or_else(|| Error::Internal("tiles end that have no ends".into()))?;
        let (samples, looks) = (tiles.at(tile).samples, cube.looks(tile));
        tiles.at(tile).look = looks[1];
        match tiles.judge(samples, looks)? {
            Verdict::Until(epoch) => {
                tiles.at(tile).until = epoch;
                queue.allow_tile(tile, epoch, looks[1]);
                return Ok(());
            }
            Verdict::Exact => {}
            Verdict::Full => ends.by_samples += 1,
        }
        ends.ended += 1;
        self.status.units.0 = ends.ended;
        tiles.at(tile).goes_on = false;
        Ok(())
    }

    /// A group of units is in the cube.
    fn note_of_tiles(
        &mut self,
        tiles: &mut Tiles,
        cube: &Writer,
        queue: &Queue,
        device: usize,
        merged: Merged,
        observe: &mut dyn FnMut(Event) -> Result<()>,
    ) -> Result<()> {
        let end = merged.group.epoch + merged.group.epochs;
        let samples = samples_before(end, tiles.full);
        for &tile in &merged.group.tiles {
            tiles.note(tile, samples);
            // Before that a device may have merged more of it meanwhile than this report says.
            if end == tiles.at(tile).until {
                self.judge(tiles, tile, cube, queue)?;
            }
        }
        self.tell_least(tiles);
        self.note_group(cube, queue, device, merged, observe)
    }

    /// Puts into the status how many samples every tile has at least; no epoch is under way that all of them are in.
    fn tell_least(&mut self, tiles: &Tiles) {
        self.status.samples = tiles.least();
        self.status.samples_next = self.status.samples;
    }

    /// Puts into the status what asks for a look at every tile.
    fn look_at_all(&mut self, tiles: &Tiles, cube: &Writer) {
        let going_on = || cube.tiles().zip(&tiles.each).filter(|(_, tile)| tile.goes_on);
        let worst = going_on().map(|(_, tile)| tile.look).reduce(f32::max).filter(|worst| worst.is_finite());
        if let Some(ends) = &mut self.status.tiles {
            ends.worst = worst;
        }
        self.tell_least(tiles);
        // Errors fall with the square root of the samples.
        self.paths_needed = worst.map(|_| {
            let left = going_on().map(|(number, tile)| {
                let samples = f64::from(tile.samples);
                let whole = samples * (f64::from(tile.look) / tiles.error).max(1.0).powi(2);
                let whole = tiles.limit.map_or(whole, |limit| whole.min(f64::from(limit)));
                (whole - samples).max(0.0) * cube.cube().grid().rect(number).pixels() as f64
            });
            self.status.paths as f64 + left.sum::<f64>()
        });
    }

    /// Whether another group would not fit into the time that is left, by the mean of those that there were.
    fn is_over(&self, groups: u32) -> bool {
        let Some(limit) = self.job.stop.time else { return false };
        let each = self.rendering_s() * self.active as f64 / f64::from(groups.max(1));
        groups > 0 && (self.started.elapsed() - self.rested()).as_secs_f64() + each > limit.as_secs_f64()
    }

    /// Takes no more units, and hears of those under way.
    fn finish_units(
        &mut self,
        tiles: &mut Tiles,
        cube: &Writer,
        queue: &Queue,
        reports: &mut Reports,
        observe: &mut dyn FnMut(Event) -> Result<()>,
    ) -> Result<()> {
        queue.pause(true);
        while !queue.under_way().is_empty() {
            match self.hear(reports)? {
                Some((device, Report::Merged(merged))) => {
                    self.note_of_tiles(tiles, cube, queue, device, merged, observe)?;
                }
                Some((device, report)) => self.left(device, report, observe)?,
                None => {}
            }
        }
        self.end_epoch(tiles, cube, observe)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_end_by_two_looks_or_by_their_samples() {
        let tiles =
            |limit| Tiles { first: 0, each: Vec::new(), by_samples: BTreeMap::new(), error: 0.01, limit, full: 64 };
        let judge = |limit, samples, looks| tiles(limit).judge(samples, looks).expect("a verdict");
        let unseen = [f32::INFINITY; 2];
        // Up to eight full epochs, the first of which comes in seven: the fifteenth is not taken.
        assert_eq!(judge(None, 0, unseen), Verdict::Until(14));
        assert_eq!(judge(Some(128), 0, unseen), Verdict::Until(8));
        assert_eq!(judge(None, 512, [f32::INFINITY, 0.005]), Verdict::Until(16));
        assert_eq!(judge(None, 640, [0.01, 0.005]), Verdict::Exact);
        assert_eq!(judge(None, 640, [0.005, 0.011]), Verdict::Until(18));
        assert_eq!(judge(Some(640), 640, [0.011, 0.005]), Verdict::Full);
        assert_eq!(judge(None, 64 * 40, [0.011, 0.005]), Verdict::Until(54));
        assert!(tiles(None).judge(u32::MAX / 64 * 64, unseen).is_err());
    }
}
