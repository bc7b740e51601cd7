//! Checksums of files: those of the tiles stand in their journals, that of the record in itself.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use xxhash_rust::xxh3::{Xxh3, xxh3_128};

/// The list of the files that are written when a cube is made and never again, in cubes of version 1: `checksum  path`, a
/// line each.
pub(super) const FILE: &str = ".spectile/checksums";

/// Names in the list of the cube at `path` whose files are not what the list says, and how many names it has.
pub(super) fn wrong_files(path: &Path) -> io::Result<(Vec<String>, u64)> {
    let list = fs::read_to_string(path.join(FILE))?;
    let (mut wrong, mut count) = (Vec::new(), 0);
    for line in list.lines() {
        count += 1;
        let (sum, name) = line.split_once("  ").unwrap_or(("", line));
        let found = fs::read(path.join(name)).map(|bytes| format!("{:032x}", of(&bytes)));
        if !found.is_ok_and(|found| found == sum) {
            wrong.push(name.to_owned());
        }
    }
    Ok((wrong, count))
}

/// Writes through to a file and sums up what passes.
pub(super) struct Summing<W> {
    inner: W,
    sum: Xxh3,
}

impl<W: Write> Summing<W> {
    pub fn new(inner: W) -> Self {
        Summing { inner, sum: Xxh3::new() }
    }

    pub fn checksum(&self) -> u128 {
        self.sum.digest128()
    }
}

impl<W: Write> Write for Summing<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.inner.write(bytes)?;
        self.sum.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

/// The checksum of bytes at hand.
pub(super) fn of(bytes: &[u8]) -> u128 {
    xxh3_128(bytes)
}
