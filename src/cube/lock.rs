//! Who works on which tiles: byte ranges of one file, byte = tile, so that processes on several machines with a shared
//! file system keep apart.

use std::fs::{File, OpenOptions};
use std::ops::Range;
use std::path::Path;

use crate::{Error, Result};

/// Name of the lock file in a cube's private folder.
pub(super) const LOCK: &str = "lock";

/// Tiles of a cube that nobody else may change while this lives. A process that ends, however it does, holds none.
pub(super) struct TileLock {
    file: File,
}

impl TileLock {
    /// Takes `tiles` of the cube at `path`. An error where another worker holds one of them, or where the file system
    /// knows no locks.
    pub fn take(path: &Path, private: &Path, tiles: Range<u32>) -> Result<TileLock> {
        let lock = private.join(LOCK);
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&lock);
        let file = file.map_err(|error| Error::storage(&lock, format!("cannot be opened: {error}")))?;
        match try_lock(&file, &tiles) {
            Ok(None) => Ok(TileLock { file }),
            Ok(Some(held)) => Err(in_use(path, &held)),
            Err(error) => Err(no_locks(&lock, &error)),
        }
    }

    /// Whether the file locked is still the one of that name: the cube may have been replaced meanwhile.
    pub fn is_current(&self, private: &Path) -> bool {
        #[cfg(unix)]
        {
            use std::os::unix::fs::MetadataExt;
            let identity = |metadata: std::fs::Metadata| (metadata.dev(), metadata.ino());
            let ours = self.file.metadata().map(identity).ok();
            ours.is_some() && ours == std::fs::metadata(private.join(LOCK)).map(identity).ok()
        }
        #[cfg(not(unix))]
        {
            // An open file cannot be replaced.
            let _ = &self.file;
            private.join(LOCK).exists()
        }
    }

    /// Tiles among `tiles` that somebody works on, as far as the first range goes; `None`: nobody does, as far as can be
    /// told.
    pub fn held(private: &Path, tiles: Range<u32>) -> Option<Range<u32>> {
        // A cube without this file is one that nobody has worked on.
        let file = File::open(private.join(LOCK)).ok()?;
        holder(&file, &tiles).ok()?
    }

    /// All ranges among `tiles` that somebody works on, in order, as far as can be told.
    pub fn all_held(private: &Path, tiles: Range<u32>) -> Vec<Range<u32>> {
        let Ok(file) = File::open(private.join(LOCK)) else { return Vec::new() };
        let (mut open, mut found) = (vec![tiles], Vec::new());
        // The system names any of several locks, not the first: what lies before and behind it is asked for again.
        while let Some(tiles) = open.pop() {
            if tiles.is_empty() {
                continue;
            }
            if let Ok(Some(held)) = holder(&file, &tiles) {
                open.extend([tiles.start..held.start, held.end..tiles.end]);
                found.push(held);
            }
        }
        found.sort_by_key(|held| held.start);
        found
    }
}

/// A byte of the lock file that stands for no tile: what one process holds, another must not get, however far away it is.
const PROBE: Range<u32> = u32::MAX - 1..u32::MAX;

/// Held by who wants to know whether locks reach another machine.
pub struct Probe {
    _lock: TileLock,
}

impl Probe {
    pub(super) fn hold(path: &Path, private: &Path) -> Result<Probe> {
        TileLock::take(path, private, PROBE).map(|lock| Probe { _lock: lock })
    }

    /// Whether somebody's probe keeps this process from it, as it should. An error where files cannot be locked here.
    pub(super) fn is_felt(path: &Path, private: &Path) -> Result<bool> {
        let file = OpenOptions::new().read(true).write(true).open(private.join(LOCK));
        let file = file.map_err(|error| Error::storage(&private.join(LOCK), format!("cannot be opened: {error}")))?;
        match try_lock(&file, &PROBE) {
            Ok(held) => Ok(held.is_some()),
            Err(error) => Err(no_locks(path, &error)),
        }
    }
}

fn no_locks(path: &Path, error: &std::io::Error) -> Error {
    let what = format!(
        "this file system cannot lock files ({error}), so nothing would keep two renders of one cube apart; put the cube \
         on another file system"
    );
    Error::storage(path, what)
}

/// The error of who comes second on a tile.
pub(super) fn in_use(path: &Path, held: &Range<u32>) -> Error {
    let tiles = match held.len() {
        1 => format!("tile {} is", held.start),
        _ => format!("tiles {}..{} are", held.start, held.end),
    };
    Error::storage(path, format!("{tiles} in use by another process; wait for it to end, or choose other --tiles"))
}

#[cfg(unix)]
use unix::{holder, try_lock};

#[cfg(unix)]
mod unix {
    use std::fs::File;
    use std::io::Result;
    use std::ops::Range;

    use nix::errno::Errno;
    use nix::fcntl::{FcntlArg, fcntl};
    use nix::libc::{self, flock};

    // Locks of an open file where there are such, so that two in one process keep apart as well.
    #[cfg(not(target_os = "linux"))]
    use nix::fcntl::FcntlArg::{F_GETLK as GET, F_SETLK as SET};
    #[cfg(target_os = "linux")]
    use nix::fcntl::FcntlArg::{F_OFD_GETLK as GET, F_OFD_SETLK as SET};

    fn range(tiles: &Range<u32>) -> flock {
        flock {
            l_type: libc::F_WRLCK as _,
            l_whence: libc::SEEK_SET as _,
            l_start: tiles.start.into(),
            l_len: tiles.len() as _,
            l_pid: 0,
        }
    }

    fn call(file: &File, argument: FcntlArg) -> std::result::Result<i32, Errno> {
        fcntl(file, argument)
    }

    /// Locks the bytes `tiles` of the file until it is closed. `Some`: somebody else holds these of them.
    pub fn try_lock(file: &File, tiles: &Range<u32>) -> Result<Option<Range<u32>>> {
        loop {
            match call(file, SET(&range(tiles))) {
                Ok(_) => return Ok(None),
                Err(Errno::EACCES | Errno::EAGAIN) => match holder(file, tiles)? {
                    // Whoever it was has just let go.
                    None => {}
                    held => return Ok(held),
                },
                Err(error) => return Err(error.into()),
            }
        }
    }

    /// Who has locked some of the bytes `tiles`: those of the first range found.
    pub fn holder(file: &File, tiles: &Range<u32>) -> Result<Option<Range<u32>>> {
        let mut found = range(tiles);
        call(file, GET(&mut found))?;
        if found.l_type == libc::F_UNLCK as libc::c_short {
            return Ok(None);
        }
        let start = (found.l_start as u32).max(tiles.start);
        let end = if found.l_len == 0 { i64::MAX } else { found.l_start.saturating_add(found.l_len) };
        Ok(Some(start..end.min(tiles.end.into()) as u32))
    }
}

/// Elsewhere the whole file: one process works on a cube at a time.
#[cfg(not(unix))]
fn try_lock(file: &File, tiles: &Range<u32>) -> std::io::Result<Option<Range<u32>>> {
    match file.try_lock() {
        Ok(()) => Ok(None),
        Err(std::fs::TryLockError::WouldBlock) => Ok(Some(tiles.clone())),
        Err(std::fs::TryLockError::Error(error)) => Err(error),
    }
}

/// Whether somebody holds the file; the lock taken to find out goes with it.
#[cfg(not(unix))]
use try_lock as holder;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn disjoint_tiles_go_together_and_the_second_on_a_tile_is_refused() {
        let folder = tempfile::tempdir().expect("folder");
        let take = |tiles| TileLock::take(Path::new("a.zarr"), folder.path(), tiles);
        assert_eq!(TileLock::held(folder.path(), 0..9), None);
        let first = take(0..4).expect("free");
        let _second = take(4..6).expect("free");
        let message = |tiles| take(tiles).err().expect("held").to_string();
        assert!(message(3..9).contains("tile 3 is in use by another process"), "{}", message(3..9));
        assert!(message(0..2).contains("tiles 0..2 are in use"), "{}", message(0..2));
        assert_eq!(TileLock::held(folder.path(), 5..9), Some(5..6));
        let _third = take(8..9).expect("free");
        assert_eq!(TileLock::all_held(folder.path(), 0..20), [0..4, 4..6, 8..9]);
        assert_eq!(TileLock::all_held(folder.path(), 1..5), [1..4, 4..5]);
        let felt = || Probe::is_felt(Path::new("a.zarr"), folder.path()).expect("lockable");
        assert!(!felt());
        let probe = Probe::hold(Path::new("a.zarr"), folder.path()).expect("free");
        assert!(felt());
        drop(probe);
        assert!(!felt());
        drop(first);
        take(0..4).expect("free again");
        assert_eq!(TileLock::held(folder.path(), 0..4), None);
    }
}
