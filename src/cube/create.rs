//! Making a cube, replacing one, and going on with one that is there.

use std::fs;
use std::io::ErrorKind;
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::arrays::arrays;
use super::lock::TileLock;
use super::metadata::Header;
use super::restore::{coordinates, pretty};
use super::store::{Cube, Origin, PRIVATE, RECORD};
use super::writer::BATCH_BYTES;
use crate::files::output::{Product, only_holds, put_folder};
use crate::{Error, Result, files};

/// A cube, as far as its name goes; what may be replaced is [`check_removable`]'s to say.
const CUBE: Product = Product {
    name: "a cube",
    extensions: &["zarr"],
    is_stream: false,
    is_folder: true,
    check: |path| is_cube_alone(path),
};

/// What may be at the path of a cube that is going to be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    /// Nothing.
    Refuse,
    /// A cube, which is replaced; or nothing.
    Replace,
    /// The same cube, which is gone on with; or nothing.
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
        Finished::InPlace => Ok(Cube::made(&target, header.clone())),
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
    /// Held on the cube that is replaced; one without `.spectile` cannot be worked on.
    old: Option<Option<TileLock>>,
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
                let private = target.join(PRIVATE);
                let lock = private.is_dir().then(|| TileLock::take(&target, &private, ALL_TILES)).transpose()?;
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
            put_folder(&self.temporary, &self.target, true).map_err(failed)?;
            self.finished = true;
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
    let there = match fs::metadata(path) {
        Ok(_) => true,
        Err(error) if error.kind() == ErrorKind::NotFound => false,
        Err(error) => return Err(Error::storage(path, format!("cannot be created: {error}"))),
    };
    let count = u64::from(tiles.end - tiles.start);
    match existing {
        Existing::Refuse if there => {
            let what =
                "exists already; choose another name, --resume to go on with it, or --overwrite to replace a cube";
            Err(Error::Usage(format!("{} {what}", path.display())))
        }
        Existing::Replace if there => {
            check_removable(path)?;
            // A link to a cube on another disk stays a link.
            let target = fs::canonicalize(path).unwrap_or(path.to_owned());
            check_space(path, files::parent(&target), header, count, files::bytes_of(&target))?;
            Ok(Way::Replace(target))
        }
        Existing::Resume if there => {
            let cube = open_same(path, header)?;
            let missing = tiles.clone().filter(|&tile| !cube.part_path(cube.main_part(), tile).exists()).count();
            if missing > 0 {
                // What a killed process left aside goes first.
                check_space(path, cube.path(), header, missing as u64, files::bytes_of(&cube.aside_folder()))?;
            }
            Ok(Way::GoOn(Box::new(cube)))
        }
        Existing::Refuse | Existing::Replace | Existing::Resume => {
            let target = CUBE.new_target(path)?;
            check_space(path, files::parent(&target), header, count, 0)?;
            Ok(Way::Create(target))
        }
    }
}

/// The cube at `path`, if it is what rendering into `header` would have made; else the difference is named.
pub(super) fn open_same(path: &Path, header: &Header) -> Result<Cube> {
    let cube = Cube::open(path)?;
    if let Some(why) = cube.is_only_read() {
        let what = "cannot be gone on with, only read";
        let instead = "render the scene into a new cube with another -o";
        return Err(Error::Usage(format!("{}: {what}: {why}; {instead}", path.display())));
    }
    let version = env!("CARGO_PKG_VERSION");
    let difference = match cube.origin() {
        Origin::Record { made_by } | Origin::DamagedRecord { made_by } if made_by != version => {
            Some(format!("version: it was begun by Spectile {made_by}, this is {version}"))
        }
        _ => cube.header().difference(header),
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
    let write = |name: &str, bytes: &[u8]| -> Result<()> {
        let path = folder.join(name);
        files::make_folder_durably(files::parent(&path))
            .and_then(|()| files::write_durably(&path, bytes))
            .map_err(|error| files::output::cannot_write(&path, &error))
    };
    let (group, arrays) = header.metadata()?;
    for (name, array) in &arrays {
        write(&format!("{name}/zarr.json"), pretty(array).as_bytes())?;
    }
    for (name, bytes) in coordinates(header) {
        write(name, &bytes)?;
    }
    for private in ["aside", "journal"] {
        let path = folder.join(PRIVATE).join(private);
        let made = files::make_folder_durably(&path);
        made.map_err(|error| Error::storage(&path, format!("cannot be created: {error}")))?;
    }
    write("zarr.json", pretty(&group).as_bytes())?;
    write(RECORD, header.record().as_bytes())
}

/// Refuses to replace what is not a Spectile cube and nothing else, so that nobody's other files are lost.
fn check_removable(path: &Path) -> Result<()> {
    is_cube_alone(path).map_err(|what| {
        let only = "--overwrite replaces nothing but Spectile cubes";
        Error::Usage(format!("{}: {only}: this one {what}", path.display()))
    })
}

fn is_cube_alone(path: &Path) -> std::result::Result<(), String> {
    let cube = Cube::open(path).map_err(|error| match error {
        Error::Storage { what, .. } => what,
        error => error.to_string(),
    })?;
    let arrays = arrays(cube.header(), cube.layout());
    let known = |name: &str| [PRIVATE, "zarr.json"].contains(&name) || arrays.iter().any(|(array, _)| *array == name);
    only_holds(path, known)?;
    let private = path.join(PRIVATE);
    if private.is_dir() {
        // What a process that was killed left aside begins with these names too.
        let of_cube = ["cube.json", "lock", "journal", "choices.json", "brightness.json", "aside", "slurm", "run-"];
        only_holds(&private, |name| of_cube.iter().any(|known| name.trim_start_matches('.').starts_with(known)))?;
    }
    if let Some(name) = cube.foreign_attribute().map_err(|error| error.to_string())? {
        return Err(format!("has the attribute `{name}`, which somebody has put there"));
    }
    let folders = arrays.iter().map(|(array, _)| path.join(array)).filter(|folder| folder.is_dir());
    folders.into_iter().try_for_each(|folder| only_holds(&folder, |name| ["zarr.json", "c"].contains(&name)))
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
