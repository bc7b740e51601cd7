//! Whether a cube is what its journals say: bit rot, and files that somebody else changed.

use std::thread;
use std::time::Duration;

use rayon::prelude::*;

use super::journal::{Journal, Record};
use super::lock::TileLock;
use super::recover::checksum_of;
use super::restore;
use super::store::{Cube, Origin, PRIVATE, TileArray};
use crate::{Error, Result};

/// What [`Cube::verify`] found.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Verification {
    /// Files compared with their checksums.
    pub files: u64,
    /// What is wrong, a sentence each.
    pub damage: Vec<String>,
    /// Tiles with damage, in order.
    pub tiles: Vec<u32>,
}

/// A tile that somebody works on is looked at again, so often at most.
const ATTEMPTS: u32 = 20;
const PAUSE: Duration = Duration::from_millis(100);

impl Verification {
    /// With what was found in later tiles.
    fn and(mut self, mut later: Verification) -> Verification {
        self.files += later.files;
        self.damage.append(&mut later.damage);
        self.tiles.append(&mut later.tiles);
        self
    }
}

impl Cube {
    /// Compares every file with its checksum. The cube may be being rendered.
    pub fn verify(&self) -> Result<Verification> {
        if *self.origin() == Origin::Copy {
            let what =
                format!("is a copy without {PRIVATE}, so nothing tells what its files must be; verify the original");
            return Err(Error::Usage(format!("{} {what}", self.path().display())));
        }
        let (files, damage) = restore::verify(self)?;
        let found = Verification { files, damage, tiles: Vec::new() };
        // Reading is what takes the time, and disks of many machines want several readers.
        let of_tiles = (0..self.grid().count())
            .into_par_iter()
            .try_fold(Verification::default, |mut found, tile| self.verify_tile(tile, &mut found).map(|()| found))
            .try_reduce(Verification::default, |first, second| Ok(first.and(second)))?;
        Ok(found.and(of_tiles))
    }

    fn verify_tile(&self, tile: u32, found: &mut Verification) -> Result<()> {
        let journal = Journal::of(self, tile);
        let is_in_use = || TileLock::held(&self.private(), tile..tile + 1).is_some();
        for attempt in 1.. {
            // Whoever works on the tile may have been between two renames, then or now.
            let was_in_use = is_in_use();
            let (records, sound) = journal.records()?;
            let damaged_records = !sound || records.contains(&None);
            let last = records.into_iter().flatten().next_back();
            let mut wrong: Vec<String> =
                self.parts().iter().filter_map(|&part| self.wrong(part, tile, &last)).collect();
            if damaged_records {
                wrong.push(format!("the journal of tile {tile} has a damaged record"));
            }
            if wrong.is_empty() || !(was_in_use || is_in_use()) || attempt == ATTEMPTS {
                found.files += u64::from(last.is_some()) * (self.parts().len() as u64 + 1);
                if !wrong.is_empty() {
                    found.tiles.push(tile);
                    found.damage.extend(wrong);
                }
                return Ok(());
            }
            thread::sleep(PAUSE);
        }
        unreachable!("the last attempt returns")
    }

    /// What is wrong with a file of a tile, if `last` is its journal's last record.
    fn wrong(&self, part: TileArray, tile: u32, last: &Option<Record>) -> Option<String> {
        let path = self.part_path(part, tile);
        let name = || path.strip_prefix(self.path()).unwrap_or(&path).display().to_string();
        let Some(record) = last else {
            return path.exists().then(|| format!("{} is there, but no journal speaks of it", name()));
        };
        let expected = Some(record.checksums[part.place()]);
        // A commit that has not come, or never came, to its renames: whoever works on the tile next does them.
        let is_sound = checksum_of(&path) == expected
            || checksum_of(&self.aside_path(part, tile, record.suffix)) == expected
            // It may have taken its place between these two looks.
            || checksum_of(&path) == expected;
        let what = if path.exists() { "is not what was written" } else { "is missing" };
        (!is_sound).then(|| format!("{} {what}", name()))
    }
}
