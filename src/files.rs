//! Files written whole or not at all: first aside under a random name, then renamed over their target. And the space
//! for them. What people name goes through [`output`].

pub mod output;

use std::ffi::OsString;
use std::fs;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::io::Write;
use std::path::{Path, PathBuf};

use crate::Result;

/// A number that no other process or call draws, for names of files that are still being written.
pub fn random_number() -> u64 {
    // The standard library seeds its hash keys from the operating system's randomness.
    RandomState::new().build_hasher().finish()
}

/// [`random_number`] as 16 hex digits.
pub fn random_suffix() -> String {
    format!("{:016x}", random_number())
}

/// A hidden sibling of `path` under a random name: same folder, hence same file system, hence renamed in one step.
pub fn sibling(path: &Path, extension: &str) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(format!(".{}.{extension}", random_suffix()));
    path.with_file_name(name)
}

/// Writes `bytes` to `path`, a file that is Spectile's own whatever it holds, replacing it in one step: a reader sees the
/// old file or the new one, never a part, and a failure leaves the old one.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    let aside = sibling(path, "part");
    let written =
        fs::File::create_new(&aside).and_then(|mut file| file.write_all(bytes)).and_then(|()| fs::rename(&aside, path));
    written.map_err(|error| {
        // The write has failed already; a leftover that cannot be removed either changes nothing about that.
        let _ = fs::remove_file(&aside);
        output::cannot_write(path, &error)
    })
}

/// Waits until the names in a folder are on disk.
pub fn sync_folder(folder: &Path) -> std::io::Result<()> {
    // Other systems open no folders, and keep names by themselves.
    if cfg!(unix) { fs::File::open(folder)?.sync_all() } else { Ok(()) }
}

/// Writes a new file and waits until it and its name are on disk.
pub fn write_durably(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut file = fs::File::create_new(path)?;
    file.write_all(bytes)?;
    file.sync_all()?;
    sync_folder(parent(path))
}

/// Makes a folder and those above it where they are missing, so that they survive a power cut.
pub fn make_folder_durably(folder: &Path) -> std::io::Result<()> {
    if folder.is_dir() {
        return Ok(());
    }
    let above = parent(folder);
    make_folder_durably(above)?;
    match fs::create_dir(folder) {
        // Another process was quicker; its entry may not be on disk yet.
        Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {}
        result => result?,
    }
    sync_folder(above)
}

/// Bytes that this user may still write to the file system of `folder`; `None` where that cannot be asked, or where the
/// file system does not say how large it is.
pub fn free_bytes(folder: &Path) -> Option<u64> {
    #[cfg(unix)]
    {
        let stat = nix::sys::statvfs::statvfs(folder).ok()?;
        // The types of these differ from system to system.
        #[allow(clippy::unnecessary_cast, clippy::useless_conversion)]
        (stat.blocks() > 0).then(|| (stat.blocks_available() as u64).saturating_mul(stat.fragment_size() as u64))
    }
    #[cfg(not(unix))]
    {
        let _ = folder;
        None
    }
}

/// Bytes of a file, or of all files under a folder; what cannot be read counts nothing.
pub fn bytes_of(path: &Path) -> u64 {
    match fs::symlink_metadata(path) {
        Ok(found) if found.is_dir() => {
            fs::read_dir(path).into_iter().flatten().flatten().map(|entry| bytes_of(&entry.path())).sum()
        }
        Ok(found) => found.len(),
        Err(_) => 0,
    }
}

/// Bytes of this machine's memory; `None` where that cannot be asked.
pub fn memory_bytes() -> Option<u64> {
    let text = fs::read_to_string("/proc/meminfo").ok()?;
    let total = text.lines().find_map(|line| line.strip_prefix("MemTotal:"))?;
    total.trim().strip_suffix(" kB")?.parse::<u64>().ok()?.checked_mul(1024)
}

/// A path as text, for people and for JSON: what is not UTF-8 becomes U+FFFD.
pub fn shown(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

/// The folder that holds `path`, `.` for a bare name.
pub fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// A size for people, in binary units.
pub fn format_bytes(bytes: u64) -> String {
    let units = ["KiB", "MiB", "GiB", "TiB", "PiB", "EiB"];
    let mut value = bytes as f64;
    let mut unit = "bytes";
    for next in units {
        if value < 1024.0 {
            break;
        }
        (value, unit) = (value / 1024.0, next);
    }
    if unit == "bytes" { format!("{bytes} bytes") } else { format!("{value:.1} {unit}") }
}

/// A size as people write it: bytes, or a number with kB, MB, GB, TB (powers of 1000) or KiB, MiB, GiB, TiB (of 1024). K,
/// M, G and T alone are powers of 1024 as for sbatch, ulimit and dd.
pub fn parse_bytes(text: &str) -> std::result::Result<u64, String> {
    let explain = || "a size is a positive number of bytes, or one with a unit, such as 512MiB, 2G or 1.5GB".to_owned();
    let text = text.trim();
    let (number, unit) = text.split_at(text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len()));
    let unit = match unit.to_ascii_lowercase().as_str() {
        "" | "b" => 1.0,
        "kb" => 1e3,
        "mb" => 1e6,
        "gb" => 1e9,
        "tb" => 1e12,
        "k" | "kib" => f64::from(1 << 10),
        "m" | "mib" => f64::from(1 << 20),
        "g" | "gib" => f64::from(1 << 30),
        "t" | "tib" => 1024.0 * f64::from(1 << 30),
        _ => return Err(explain()),
    };
    let bytes = number.trim_end().parse::<f64>().map_err(|_| explain())? * unit;
    // Whole bytes up to 2^53 are exact in f64; nothing that Spectile runs on has more.
    if (1.0..=f64::from(1 << 23) * f64::from(1 << 30)).contains(&bytes) { Ok(bytes as u64) } else { Err(explain()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replaces_whole_and_leaves_nothing_aside() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("picture.png");
        for content in [b"first".as_slice(), b"second, longer"] {
            write_atomically(&path, content).expect("written");
            assert_eq!(fs::read(&path).expect("read"), content);
        }
        assert_eq!(fs::read_dir(folder.path()).expect("list").count(), 1);
        let missing = folder.path().join("no such folder/picture.png");
        assert!(write_atomically(&missing, b"x").unwrap_err().to_string().contains("picture.png: cannot be written"));
    }

    #[test]
    fn sizes_for_people() {
        let shown = [0, 1023, 1024, 1536, 5 << 30, u64::MAX].map(format_bytes);
        assert_eq!(shown, ["0 bytes", "1023 bytes", "1.0 KiB", "1.5 KiB", "5.0 GiB", "16.0 EiB"]);
    }

    #[test]
    fn sizes_from_people() {
        let cases = [
            ("1", 1),
            ("123456789", 123_456_789),
            ("512MiB", 512 << 20),
            ("2GiB", 2 << 30),
            ("2 gib", 2 << 30),
            ("1.5GB", 1_500_000_000),
            ("0.5KiB", 512),
            ("64kB", 64_000),
            ("3TiB", 3 << 40),
            ("7B", 7),
            ("2G", 2 << 30),
            ("1.5k", 1536),
            ("64M", 64 << 20),
            ("1t", 1 << 40),
        ];
        for (text, bytes) in cases {
            assert_eq!(parse_bytes(text), Ok(bytes), "{text}");
        }
        for bad in ["", "0", "-1MiB", "2Gi", "2x", "GiB", "G", "1e", "nan", "inf", "1MiBs", "0.1", "9e18", "1 2MiB"] {
            assert!(parse_bytes(bad).unwrap_err().contains("512MiB"), "{bad}");
        }
    }

    #[test]
    fn suffixes_differ() {
        assert_ne!(random_suffix(), random_suffix());
        assert_eq!(random_suffix().len(), 16);
    }
}
