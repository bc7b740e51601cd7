//! A batch of files that take their places together.

use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use crate::files::random_suffix;
use crate::{Error, Result};

/// New files, written under random names in a folder of their own, that [`Batch::commit`] renames over their targets
/// in the order in which they were written. A batch that is dropped removes its files.
pub(super) struct Batch {
    folder: PathBuf,
    /// (where it lies, where it belongs).
    files: Vec<(PathBuf, PathBuf)>,
}

impl Batch {
    pub fn new(folder: PathBuf) -> Self {
        Batch { folder, files: Vec::new() }
    }

    /// Writes a file that will be `target`.
    pub fn write(&mut self, target: PathBuf, write: impl FnOnce(&mut File) -> std::io::Result<()>) -> Result<()> {
        let aside = self.folder.join(random_suffix());
        let failed = |error| Error::storage(&target, format!("cannot be written: {error}"));
        let mut file = File::create_new(&aside).map_err(failed)?;
        let written = write(&mut file).map_err(failed);
        self.files.push((aside, target));
        written
    }

    /// Like [`Batch::write`], of bytes that are there already.
    pub fn write_bytes(&mut self, target: PathBuf, bytes: &[u8]) -> Result<()> {
        self.write(target, |file| file.write_all(bytes))
    }

    /// Renames every file to its place.
    pub fn commit(mut self) -> Result<()> {
        for (aside, target) in &self.files {
            rename_into(aside, target)
                .map_err(|error| Error::storage(target, format!("cannot be replaced: {error}")))?;
        }
        self.files.clear();
        Ok(())
    }
}

impl Drop for Batch {
    fn drop(&mut self) {
        for (aside, _) in &self.files {
            // Nobody knows a file aside by name; one that cannot be removed is only wasted space.
            let _ = fs::remove_file(aside);
        }
    }
}

/// Renames a file to a target whose folder may not exist yet: the first unit of a tile makes it.
fn rename_into(from: &Path, to: &Path) -> std::io::Result<()> {
    match fs::rename(from, to) {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            fs::create_dir_all(crate::files::parent(to))?;
            fs::rename(from, to)
        }
        result => result,
    }
}
