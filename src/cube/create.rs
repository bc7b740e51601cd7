//! Making a cube, replacing one, and going on with one that is there.

use std::fs;
use std::io::ErrorKind;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::checksums;
use super::lock::TileLock;
use super::metadata::Header;
use super::store::{Cube, PRIVATE, Part, read_group};
use super::writer::BATCH_BYTES;
use crate::{Error, Result, files};

/// What may be at the path of a cube that is going to be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    /// Nothing.
    Refuse,
    /// A cube, which is replaced; or nothing.
    Replace,
    /// The same cube, which is gone on with; or nothing.
    Join,
    /// The same cube, which is gone on with.
    Resume,
}

/// What [`open_or_create`] is going to do.
enum Way {
    Create(PathBuf),
    Replace(PathBuf),
    GoOn(Box<Cube>),
}

/// Whether [`super::Writer::open`] may work on `tiles` of a cube at `path`, as far as can be told without changing
/// anything; the header of the cube that is gone on with, if one is.
pub fn check_target(path: &Path, header: &Header, existing: Existing, tiles: &Range<u32>) -> Result<Option<Header>> {
    match find_way(path, header, existing, tiles)? {
        Way::Create(_) => Ok(None),
        Way::Replace(target) => refuse_in_use(TileLock::held(&target.join(PRIVATE), ALL_TILES), &target).map(|()| None),
        Way::GoOn(cube) => {
            refuse_in_use(TileLock::held(&cube.private(), tiles.clone()), cube.path())?;
            Ok(Some(cube.header().clone()))
        }
    }
}

/// Makes a cube without any samples, or opens the one that `existing` allows, and changes nothing of it. Whether this
/// process made it is told, too.
pub fn make(path: &Path, header: &Header, existing: Existing) -> Result<(Cube, bool)> {
    let tiles = 0..header.validate().map_or(0, |()| header.grid().count());
    let is_new = matches!(find_way(path, header, existing, &tiles)?, Way::Create(_));
    open_or_create(path, header, existing, &tiles).map(|cube| (cube, is_new))
}

/// Those of any cube.
const ALL_TILES: Range<u32> = 0..u32::MAX;

fn refuse_in_use(held: Option<Range<u32>>, path: &Path) -> Result<()> {
    held.map_or(Ok(()), |held| Err(super::lock::in_use(path, &held)))
}

/// The cube to write to, made or found. A new one is built under a temporary name beside it and renamed: whoever of
/// several processes comes second finds the first one's.
pub(super) fn open_or_create(path: &Path, header: &Header, existing: Existing, tiles: &Range<u32>) -> Result<Cube> {
    let aside = match Aside::begin(find_way(path, header, existing, tiles)?)? {
        Begun::Aside(aside) => aside,
        Begun::Found(cube) => return Ok(*cube),
    };
    write_empty(aside.path(), header).map_err(|error| aside.error(error))?;
    let target = aside.target.clone();
    match aside.finish()? {
        Finished::InPlace => Ok(Cube::new(&target, header.clone())),
        // Another process was quicker. Joining is what was asked for, or it is an error.
        Finished::Taken(error) => match find_way(path, header, existing, tiles)? {
            Way::GoOn(cube) => Ok(*cube),
            _ => Err(Error::storage(&target, format!("cannot be created: {error}"))),
        },
    }
}

/// A cube that is built under a hidden name beside its own, and takes its place in one step. One that never does is removed,
/// and what it was to replace stays.
pub(super) struct Aside {
    target: PathBuf,
    temporary: PathBuf,
    /// Held on the cube that is replaced.
    old: Option<TileLock>,
    finished: bool,
}

enum Begun {
    Aside(Aside),
    Found(Box<Cube>),
}

enum Finished {
    InPlace,
    /// There is something now where nothing was.
    Taken(std::io::Error),
}

impl Aside {
    /// For a whole cube at `path`, which `existing` allows to be new or to replace one.
    pub(super) fn new(path: &Path, header: &Header, existing: Existing) -> Result<Aside> {
        let tiles = 0..header.validate().map_or(0, |()| header.grid().count());
        let way = find_way(path, header, existing, &tiles)?;
        if let Way::Replace(target) = &way {
            // Both lie there until the new one is whole.
            check_space(path, files::parent(target), header, tiles.end.into(), 0)?;
        }
        match Aside::begin(way)? {
            Begun::Aside(aside) => Ok(aside),
            Begun::Found(_) => Err(Error::Internal(format!("{}: a cube made whole is gone on with", path.display()))),
        }
    }

    fn begin(way: Way) -> Result<Begun> {
        let (target, old) = match way {
            Way::GoOn(cube) => return Ok(Begun::Found(cube)),
            Way::Create(target) => (target, None),
            Way::Replace(target) => {
                let lock = TileLock::take(&target, &target.join(PRIVATE), ALL_TILES)?;
                (target, Some(lock))
            }
        };
        let temporary = files::sibling(&target, "creating");
        Ok(Begun::Aside(Aside { target, temporary, old, finished: false }))
    }

    /// Where it is built.
    pub(super) fn path(&self) -> &Path {
        &self.temporary
    }

    /// Nobody knows the temporary name: errors name the cube.
    pub(super) fn error(&self, error: Error) -> Error {
        match error {
            Error::Storage { what, .. } => Error::storage(&self.target, what),
            error => error,
        }
    }

    /// Gives a whole cube its place.
    pub(super) fn put(self) -> Result<()> {
        let target = self.target.clone();
        match self.finish()? {
            Finished::InPlace => Ok(()),
            Finished::Taken(error) => Err(Error::storage(&target, format!("cannot be created: {error}"))),
        }
    }

    fn finish(mut self) -> Result<Finished> {
        let failed = |error: std::io::Error| Error::storage(&self.target, format!("cannot be created: {error}"));
        if self.old.is_some() {
            let replaced = files::sibling(&self.target, "replaced");
            fs::rename(&self.target, &replaced).map_err(failed)?;
            if let Err(error) = fs::rename(&self.temporary, &self.target) {
                fs::rename(&replaced, &self.target).map_err(failed)?;
                return Err(failed(error));
            }
            self.finished = true;
            let removed = fs::remove_dir_all(&replaced);
            removed.map_err(|error| Error::storage(&replaced, format!("cannot be removed: {error}")))?;
        } else {
            match fs::rename(&self.temporary, &self.target) {
                Ok(()) => self.finished = true,
                Err(error) if matches!(error.kind(), ErrorKind::DirectoryNotEmpty | ErrorKind::AlreadyExists) => {
                    return Ok(Finished::Taken(error));
                }
                Err(error) => return Err(failed(error)),
            }
        }
        files::sync_folder(files::parent(&self.target)).map_err(failed)?;
        Ok(Finished::InPlace)
    }
}

impl Drop for Aside {
    fn drop(&mut self) {
        if !self.finished {
            // It has failed already; that error is the one to report.
            let _ = fs::remove_dir_all(&self.temporary);
        }
    }
}

/// What there is at `path`, and whether it is what may be there.
fn find_way(path: &Path, header: &Header, existing: Existing, tiles: &Range<u32>) -> Result<Way> {
    header.validate().map_err(|what| Error::Usage(format!("{}: {what}", path.display())))?;
    let there = match fs::symlink_metadata(path) {
        Ok(_) => true,
        Err(error) if error.kind() == ErrorKind::NotFound => false,
        Err(error) => return Err(Error::storage(path, error)),
    };
    let count = u64::from(tiles.end - tiles.start);
    match existing {
        Existing::Refuse if there => {
            let what =
                "exists already; choose another name, --resume to go on with it, or --overwrite to replace a cube";
            Err(Error::Usage(format!("{} {what}", path.display())))
        }
        Existing::Replace if there => {
            // A link to a cube on another disk stays a link.
            let target = fs::canonicalize(path).unwrap_or(path.to_owned());
            check_removable(&target)?;
            check_space(path, files::parent(&target), header, count, files::bytes_of(&target))?;
            Ok(Way::Replace(target))
        }
        Existing::Join | Existing::Resume if there => {
            let cube = open_same(path, header)?;
            let missing = tiles.clone().filter(|&tile| !cube.part_path(Part::Radiance, tile).exists()).count();
            if missing > 0 {
                // What a killed process left aside goes first.
                check_space(path, cube.path(), header, missing as u64, files::bytes_of(&cube.aside_folder()))?;
            }
            Ok(Way::GoOn(Box::new(cube)))
        }
        Existing::Resume => {
            let what = "there is no such cube to go on with; leave --resume out to begin it";
            Err(Error::Usage(format!("{}: {what}", path.display())))
        }
        Existing::Refuse | Existing::Replace | Existing::Join => {
            let folder = files::parent(path);
            if !folder.is_dir() {
                let what = format!("cannot be created: there is no folder {}", folder.display());
                return Err(Error::storage(path, what));
            }
            check_space(path, folder, header, count, 0)?;
            Ok(Way::Create(path.to_owned()))
        }
    }
}

/// The cube at `path`, if it is what rendering into `header` would have made; else the difference is named.
pub(super) fn open_same(path: &Path, header: &Header) -> Result<Cube> {
    let group = read_group(path)?;
    let cube = Cube::from_group(path, &group)?;
    let made_by = group["attributes"]["spectile_version"].as_str().unwrap_or("another version");
    let version = env!("CARGO_PKG_VERSION");
    let difference = if made_by == version {
        cube.header().difference(header)
    } else {
        Some(format!("version: it was begun by Spectile {made_by}, this is {version}"))
    };
    match difference {
        None => Ok(cube),
        Some(what) => Err(Error::Usage(format!(
            "{}: cannot be gone on with, since something else would be rendered: {what}",
            path.display()
        ))),
    }
}

/// Writes metadata, coordinates and empty folders of a cube into a new folder, durably.
fn write_empty(folder: &Path, header: &Header) -> Result<()> {
    let mut checksums = checksums::List::default();
    let mut write = |name: &str, bytes: &[u8]| -> Result<()> {
        let path = folder.join(name);
        files::make_folder_durably(files::parent(&path))
            .and_then(|()| files::write_durably(&path, bytes))
            .map_err(|error| Error::storage(&path, format!("{name} cannot be written: {error}")))?;
        checksums.add(name, bytes);
        Ok(())
    };
    let (group, arrays) = header.metadata()?;
    for (name, array) in arrays {
        write(&format!("{name}/zarr.json"), pretty(&array).as_bytes())?;
    }
    let channels = &header.channels;
    let each = |value: &dyn Fn(usize) -> f64| doubles((0..channels.len()).map(value));
    write("wavelength/c/0", &each(&|k| channels.centre(k)))?;
    write("wavelength_bounds/c/0/0", &doubles(channels.bounds.iter().flatten().copied()))?;
    write("response_integral/c/0", &each(&|k| channels.integral(k)))?;
    for (axis, name) in ["x", "y"].into_iter().enumerate() {
        let centres = (0..header.size[axis]).map(|i| f64::from(header.origin[axis]) + f64::from(i) + 0.5);
        write(&format!("{name}/c/0"), &doubles(centres))?;
    }
    for private in ["aside", "journal"] {
        let path = folder.join(PRIVATE).join(private);
        let made = files::make_folder_durably(&path);
        made.map_err(|error| Error::storage(&path, format!("cannot be created: {error}")))?;
    }
    write("zarr.json", pretty(&group).as_bytes())?;
    let list = folder.join(checksums::FILE);
    files::write_durably(&list, checksums.to_string().as_bytes())
        .map_err(|error| Error::storage(&list, format!("cannot be written: {error}")))
}

fn pretty(value: &Value) -> String {
    format!("{value:#}\n")
}

fn doubles(values: impl Iterator<Item = f64>) -> Vec<u8> {
    values.flat_map(f64::to_le_bytes).collect()
}

/// Whether `path` is a Spectile cube and nothing else, so that replacing it loses nobody's other files.
fn check_removable(path: &Path) -> Result<()> {
    let refuse = |what: String| {
        Error::Usage(format!("{}: --overwrite replaces nothing but Spectile cubes: {what}", path.display()))
    };
    if !path.exists() {
        return Err(refuse("this is a link to nothing".into()));
    }
    let group = read_group(path).map_err(|error| match error {
        Error::Storage { what, .. } => refuse(format!("this {what}")),
        error => error,
    })?;
    let arrays = group["consolidated_metadata"]["metadata"].as_object();
    let known =
        |name: &str| [PRIVATE, "zarr.json"].contains(&name) || arrays.is_some_and(|arrays| arrays.contains_key(name));
    for entry in fs::read_dir(path).map_err(|error| Error::storage(path, error))? {
        let name = entry.map_err(|error| Error::storage(path, error))?.file_name();
        if !name.to_str().is_some_and(known) {
            return Err(refuse(format!("this one also holds `{}`, which is no part of it", name.display())));
        }
    }
    Ok(())
}

/// Refuses what would not fit into `folder`: a cube with `tiles` more tiles than there are, `freed` bytes of the one it replaces
/// counted in, and a batch of files aside beside those that they replace.
fn check_space(path: &Path, folder: &Path, header: &Header, tiles: u64, freed: u64) -> Result<()> {
    let needed = header.bytes_with_tiles(tiles).saturating_add(header.store_bytes().min(2 * BATCH_BYTES));
    match files::free_bytes(folder) {
        Some(free) if free.saturating_add(freed) < needed => Err(Error::Usage(format!(
            "{}: the cube needs {}, and {} are free there; use fewer channels or pixels, or another disk",
            path.display(),
            files::format_bytes(needed),
            files::format_bytes(free.saturating_add(freed))
        ))),
        _ => Ok(()),
    }
}
