//! Whether a cube is what its journals say: bit rot, and files that somebody else changed.

use std::thread;
use std::time::Duration;

use super::checksums;
use super::journal::Journal;
use super::recover::checksum_of;
use super::store::{Cube, Part};
use crate::{Error, Result};

/// What [`Cube::verify`] found.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Verification {
    /// Files compared with their checksums.
    pub files: u64,
    /// What is wrong, a sentence each.
    pub damage: Vec<String>,
}

/// A tile that is being committed is looked at again; a commit takes no longer than this many of these pauses.
const ATTEMPTS: u32 = 100;
const PAUSE: Duration = Duration::from_millis(100);

impl Cube {
    /// Compares every file with its checksum. The cube may be being rendered.
    pub fn verify(&self) -> Result<Verification> {
        let mut found = Verification::default();
        let wrong = checksums::wrong_files(self.path());
        let list = self.path().join(checksums::FILE);
        let (wrong, count) = wrong.map_err(|error| Error::storage(&list, format!("cannot be read: {error}")))?;
        found.files += count;
        found.damage.extend(wrong.into_iter().map(|name| format!("{name} is not what was written")));
        for tile in 0..self.grid().count() {
            self.verify_tile(tile, &mut found)?;
        }
        Ok(found)
    }

    fn verify_tile(&self, tile: u32, found: &mut Verification) -> Result<()> {
        let journal = Journal::of(self, tile);
        for attempt in 1.. {
            let (records, sound) = journal.records()?;
            let damaged_records = !sound || records.contains(&None);
            let last = records.into_iter().flatten().next_back();
            let mut wrong = Vec::new();
            for part in Part::ALL {
                let path = self.part_path(part, tile);
                let expected = last.as_ref().map(|record| record.checksums[part as usize]);
                let there = checksum_of(&path)?;
                if there != expected {
                    let name = path.strip_prefix(self.path()).unwrap_or(&path).display().to_string();
                    wrong.push(match (expected, there) {
                        (None, _) => format!("{name} is there, but no journal speaks of it"),
                        (_, None) => format!("{name} is missing"),
                        _ => format!("{name} is not what was written"),
                    });
                }
            }
            if damaged_records {
                wrong.push(format!("the journal of tile {tile} has a damaged record"));
            }
            // Whoever works on the tile may have been between journal and renames.
            let in_use = self.in_use().is_some();
            if wrong.is_empty() || !in_use || attempt == ATTEMPTS {
                found.files += u64::from(last.is_some()) * (Part::ALL.len() as u64 + 1);
                found.damage.extend(wrong);
                return Ok(());
            }
            thread::sleep(PAUSE);
        }
        unreachable!("the last attempt returns")
    }
}
