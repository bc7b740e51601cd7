//! What commands write under names that people chose, and what of theirs may lie there.
//!
//! One rule for every output: it goes to a new name, or it replaces a regular file or folder of the same product that
//! Spectile can read as such. Through a link the file behind it is meant, and the same holds for that. A pipe, a device
//! and `-` are written to where the product is a stream, else they are refused. Nothing else is ever replaced.

use std::fs::{self, File, Metadata};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use super::{parent, sibling};
use crate::{Error, Result};

/// A kind of file or folder that Spectile writes.
#[derive(Debug, Clone, Copy)]
pub struct Product {
    /// With its article: "a PNG picture".
    pub name: &'static str,
    /// Extensions of such files, in lower case; the first is advised.
    pub extensions: &'static [&'static str],
    /// Whether it is written from its first byte to its last, so that a pipe can take it.
    pub is_stream: bool,
    pub is_folder: bool,
    /// Reads what is there as one. The error says what it is instead, or lacks.
    pub check: fn(&Path) -> std::result::Result<(), String>,
}

/// Extensions that stand for something in particular. A product under the name of another one is a mistake.
const KNOWN: &[&str] = &[
    "bil", "bip", "bmp", "bsq", "cdf", "csv", "eps", "exr", "gif", "glb", "gltf", "h5", "hdf", "hdf5", "hdr", "html",
    "img", "jp2", "jpeg", "jpg", "json", "jxl", "mat", "md", "mtl", "nc", "npy", "npz", "obj", "pdf", "pfm", "pgm",
    "ply", "png", "ppm", "ps", "py", "rs", "sbatch", "sh", "sli", "spd", "stl", "svg", "tga", "tif", "tiff", "toml",
    "tsv", "txt", "webp", "xml", "yaml", "yml", "zarr",
];

/// The folder that each cube has beside its arrays, for Spectile alone.
pub const PRIVATE: &str = ".spectile";

/// Where a product goes.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Place {
    /// Nothing is there, nor was it asked for by another name than this, with links followed.
    New(PathBuf),
    /// One of the same product, with links followed.
    Old(PathBuf),
    /// A pipe or a device of this name.
    Stream(PathBuf),
    StandardOutput,
}

/// What messages call it.
pub const STANDARD_OUTPUT: &str = "standard output";

impl Product {
    /// Refuses early what could not be written under the name `path`.
    pub fn check_target(&self, path: &Path) -> Result<()> {
        self.place(path).map(drop)
    }

    /// Whether writing to `path` goes to the standard output: named `-`, or as the file that it is.
    pub fn is_standard_output(&self, path: &Path) -> bool {
        matches!(self.place(path), Ok(Place::StandardOutput))
    }

    /// Where the folder of this product goes, with links followed, and whether one is there.
    fn folder(&self, path: &Path) -> Result<(PathBuf, bool)> {
        match self.place(path)? {
            Place::New(path) => Ok((path, false)),
            Place::Old(path) => Ok((path, true)),
            Place::Stream(_) | Place::StandardOutput => {
                Err(Error::Internal(format!("{}: a folder is no stream", path.display())))
            }
        }
    }

    /// Where this product goes under a name that nothing has, with links to nothing followed.
    pub fn new_target(&self, path: &Path) -> Result<PathBuf> {
        match self.place(path)? {
            Place::New(path) => Ok(path),
            _ => Err(Error::Usage(format!("{} exists already; choose another name", path.display()))),
        }
    }

    fn place(&self, path: &Path) -> Result<Place> {
        let refuse = |what: String| Err(Error::Usage(format!("{}: {what}", path.display())));
        let no_stream = |what: &str| {
            let only = if self.is_folder { "a folder" } else { "a file" };
            refuse(format!("{what} cannot hold {}, which needs {only} of its own", self.name))
        };
        if path.as_os_str() == "-" {
            return if self.is_stream { Ok(Place::StandardOutput) } else { no_stream("standard output") };
        }
        let found = match fs::metadata(path) {
            Ok(found) => found,
            Err(error) if error.kind() == ErrorKind::NotFound => {
                self.check_extension(path)?;
                if let Some(cube) = cube_around(&real_path(path)) {
                    return refuse(format!(
                        "lies in the cube {}, where only its own arrays belong; choose a name outside of it",
                        cube.display()
                    ));
                }
                return new_place(path).map(Place::New);
            }
            Err(error) => return Err(Error::storage(path, format!("cannot be written: {error}"))),
        };
        if is_standard_output(&found) {
            return if self.is_stream { Ok(Place::StandardOutput) } else { no_stream("standard output") };
        }
        match kind(&found) {
            Kind::Pipe | Kind::Device if self.is_stream => return Ok(Place::Stream(path.to_owned())),
            Kind::Pipe => return no_stream("a pipe"),
            Kind::Device => return no_stream("a device"),
            Kind::Other(what) => return refuse(format!("is {what}, which is never written to")),
            Kind::Folder if !self.is_folder => {
                return Err(Error::storage(path, "is a folder, so no file can be written under this name"));
            }
            Kind::File | Kind::Folder => {}
        }
        self.check_extension(path)?;
        if let Err(what) = (self.check)(path) {
            return refuse(format!(
                "exists already and is not {}: it {what}; so it is not replaced: choose another name, or remove it",
                self.name
            ));
        }
        if found.permissions().readonly() {
            return refuse("is write-protected, so it is not replaced; choose another name".into());
        }
        let real = fs::canonicalize(path);
        real.map(Place::Old).map_err(|error| Error::storage(path, format!("cannot be written: {error}")))
    }

    /// Refuses a name that stands for something else.
    fn check_extension(&self, path: &Path) -> Result<()> {
        let Some(extension) = path.extension() else { return Ok(()) };
        let extension = extension.to_string_lossy().to_lowercase();
        if self.extensions.contains(&extension.as_str()) || !KNOWN.contains(&extension.as_str()) {
            return Ok(());
        }
        let advice = match self.extensions.first() {
            Some(own) => format!("use .{own}"),
            None => "use a name without it".into(),
        };
        Err(Error::Usage(format!(
            "{}: {} under this name would be taken for something else; {advice}",
            path.display(),
            self.name
        )))
    }
}

/// The cube in whose folder `path` lies, by the journals that each has.
fn cube_around(path: &Path) -> Option<&Path> {
    path.ancestors().skip(1).find(|folder| folder.join(PRIVATE).is_dir() && folder.join("zarr.json").is_file())
}

/// The name of a file that is to be new, with links to nothing followed.
fn new_place(path: &Path) -> Result<PathBuf> {
    /// As many as Linux follows.
    const MOST_LINKS: u32 = 40;
    let mut place = path.to_owned();
    for _ in 0..MOST_LINKS {
        match fs::read_link(&place) {
            // A target that is absolute takes the place of all.
            Ok(target) => place = parent(&place).join(target),
            Err(_) => {
                return match parent(&place) {
                    folder if folder.is_dir() => Ok(place),
                    folder => {
                        let what = format!("cannot be written: there is no folder {}", folder.display());
                        Err(Error::storage(path, what))
                    }
                };
            }
        }
    }
    Err(Error::storage(path, "cannot be written: the link leads in a circle"))
}

/// The file that a name stands for or would stand for, with links followed.
pub fn real_path(path: &Path) -> PathBuf {
    if let Ok(real) = fs::canonicalize(path) {
        return real;
    }
    let place = new_place(path).unwrap_or_else(|_| path.to_owned());
    let folder = fs::canonicalize(parent(&place));
    folder.map(|folder| folder.join(place.file_name().unwrap_or_default())).unwrap_or(place)
}

/// The folder in which that lies, whose disk counts.
pub fn real_folder(path: &Path) -> PathBuf {
    parent(&real_path(path)).to_owned()
}

enum Kind {
    File,
    Folder,
    Pipe,
    Device,
    /// With its article.
    Other(&'static str),
}

fn kind(found: &Metadata) -> Kind {
    if found.is_file() {
        return Kind::File;
    }
    if found.is_dir() {
        return Kind::Folder;
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        let kind = found.file_type();
        if kind.is_fifo() {
            return Kind::Pipe;
        }
        if kind.is_char_device() {
            return Kind::Device;
        }
        if kind.is_block_device() {
            // It holds somebody's data.
            return Kind::Other("a disk");
        }
        if kind.is_socket() {
            return Kind::Other("a socket");
        }
    }
    Kind::Other("neither a file nor a folder")
}

/// Whether this is what the standard output of this process leads to: `/dev/stdout` and links to it.
fn is_standard_output(found: &Metadata) -> bool {
    #[cfg(unix)]
    {
        use std::os::fd::AsFd;
        use std::os::unix::fs::MetadataExt;
        let own = io::stdout().as_fd().try_clone_to_owned().and_then(|fd| File::from(fd).metadata());
        own.is_ok_and(|own| (own.dev(), own.ino()) == (found.dev(), found.ino()))
    }
    #[cfg(not(unix))]
    {
        let _ = found;
        false
    }
}

/// The standard output as a file that can be written piece by piece.
fn standard_output() -> io::Result<File> {
    #[cfg(unix)]
    {
        use std::os::fd::AsFd;
        io::stdout().as_fd().try_clone_to_owned().map(File::from)
    }
    #[cfg(windows)]
    {
        use std::os::windows::io::AsHandle;
        io::stdout().as_handle().try_clone_to_owned().map(File::from)
    }
}

/// The error of something that could not be written to `path`. Whoever has stopped reading a stream has what he wants.
pub fn cannot_write(path: &Path, error: &io::Error) -> Error {
    let why = match error.kind() {
        ErrorKind::BrokenPipe => return Error::BrokenPipe,
        ErrorKind::FileTooLarge => ": it would be larger than files may be here (ulimit -f, or the file system)",
        _ => "",
    };
    let named = if path.as_os_str() == "-" { Path::new(STANDARD_OUTPUT) } else { path };
    Error::storage(named, format!("cannot be written: {error}{why}"))
}

/// An output that is written piece by piece. A file lies under a hidden name beside its own, and takes its place in one
/// step when it is whole; one that never is, is removed. A stream gets what is written at once.
#[derive(Debug)]
pub struct Replacement {
    product: Product,
    /// As it was asked for.
    path: PathBuf,
    /// Where a file lies until it is whole.
    aside: Option<PathBuf>,
    file: File,
}

impl Replacement {
    pub fn create(path: &Path, product: Product) -> Result<Replacement> {
        let place = product.place(path)?;
        let (file, aside) = match &place {
            Place::New(target) | Place::Old(target) => {
                let aside = sibling(target, "part");
                (File::create_new(&aside), Some(aside))
            }
            Place::Stream(path) => (File::options().write(true).open(path), None),
            Place::StandardOutput => (standard_output(), None),
        };
        let file = file.map_err(|error| cannot_write(path, &error))?;
        Ok(Replacement { product, path: path.to_owned(), aside, file })
    }

    pub fn file(&mut self) -> &mut File {
        &mut self.file
    }

    /// The error of a write that failed.
    pub fn failed(&self, error: &io::Error) -> Error {
        cannot_write(&self.path, error)
    }

    /// Gives a file its name.
    pub fn finish(mut self) -> Result<()> {
        let Some(aside) = self.aside.take() else { return Ok(()) };
        let renamed = self.put(&aside);
        if renamed.is_err() {
            self.aside = Some(aside);
        }
        renamed
    }

    fn put(&self, aside: &Path) -> Result<()> {
        // Somebody else may have put something there meanwhile.
        let place = self.product.place(&self.path)?;
        let (Place::New(target) | Place::Old(target)) = &place else {
            return Err(Error::storage(&self.path, "was replaced by a pipe or a device while it was being made"));
        };
        let moved = match &place {
            Place::Old(target) => fs::metadata(target).and_then(|old| fs::set_permissions(aside, old.permissions())),
            _ => Ok(()),
        };
        moved.and_then(|()| fs::rename(aside, target)).map_err(|error| self.failed(&error))
    }
}

impl Drop for Replacement {
    fn drop(&mut self) {
        if let Some(aside) = &self.aside {
            // Writing has failed already; that error is the one to report.
            let _ = fs::remove_file(aside);
        }
    }
}

impl Product {
    /// Writes all of it at once. A reader of a file sees the old one or the new one, never a part, and a failure leaves
    /// the old one.
    pub fn write(self, path: &Path, bytes: &[u8]) -> Result<()> {
        let mut replacement = Replacement::create(path, self)?;
        let written = replacement.file().write_all(bytes);
        written.map_err(|error| replacement.failed(&error))?;
        replacement.finish()
    }
}

/// A folder that is filled under a hidden name beside its own, and takes its place in one step. One that never does is
/// removed, and what it was to replace stays.
pub struct NewFolder {
    product: Product,
    path: PathBuf,
    aside: PathBuf,
    finished: bool,
}

impl NewFolder {
    pub fn create(path: &Path, product: Product) -> Result<NewFolder> {
        let (target, _) = product.folder(path)?;
        let aside = sibling(&target, "part");
        fs::create_dir(&aside).map_err(|error| cannot_write(path, &error))?;
        Ok(NewFolder { product, path: path.to_owned(), aside, finished: false })
    }

    /// Where it is filled.
    pub fn aside(&self) -> &Path {
        &self.aside
    }

    /// Gives it its name.
    pub fn finish(mut self) -> Result<()> {
        let (target, is_old) = self.product.folder(&self.path)?;
        put_folder(&self.aside, &target, is_old).map_err(|error| cannot_write(&self.path, &error))?;
        self.finished = true;
        Ok(())
    }
}

/// Says what a folder holds beside the names that are `known`.
pub fn only_holds(folder: &Path, known: impl Fn(&str) -> bool) -> std::result::Result<(), String> {
    let unreadable = |error: io::Error| format!("cannot be read ({error})");
    for entry in fs::read_dir(folder).map_err(unreadable)? {
        let name = entry.map_err(unreadable)?.file_name();
        if !name.to_str().is_some_and(&known) {
            return Err(format!("also holds `{}`, which is no part of it", name.display()));
        }
    }
    Ok(())
}

/// Renames the folder `aside` to `target`, where there is one already if `is_old`: that one is removed after its name has
/// gone to the new one, and keeps it where that fails.
pub fn put_folder(aside: &Path, target: &Path, is_old: bool) -> io::Result<()> {
    if !is_old {
        return fs::rename(aside, target);
    }
    let replaced = sibling(target, "replaced");
    fs::rename(target, &replaced)?;
    if let Err(error) = fs::rename(aside, target) {
        fs::rename(&replaced, target)?;
        return Err(error);
    }
    fs::remove_dir_all(&replaced)
}

impl Drop for NewFolder {
    fn drop(&mut self) {
        if !self.finished {
            // Writing has failed already; that error is the one to report.
            let _ = fs::remove_dir_all(&self.aside);
        }
    }
}
