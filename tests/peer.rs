//! The Cornell box against the reference of a program that shares nothing with this one, through the real binary and
//! the real xarray. What is compared, and what bias would be noticed: `tests/python/compare_peer.py`.
//!
//! Skipped without SPECTILE_PYTHON, like `tests/python.rs`.

use std::path::{Path, PathBuf};
use std::process::Command;

use tempfile::tempdir;

/// 16 independent renders of 128 samples per pixel: their spread is their error, with 15 degrees of freedom a pixel.
const SEEDS: u64 = 16;
const SAMPLES: &str = "128";

#[test]
fn the_cornell_box_is_the_peers() {
    let Some(python) = std::env::var_os("SPECTILE_PYTHON").filter(|python| !python.is_empty()) else {
        assert!(std::env::var("CI").as_deref() != Ok("true"), "CI must set SPECTILE_PYTHON");
        eprintln!("skipped: SPECTILE_PYTHON names no Python with xarray and zarr");
        return;
    };
    let folder = tempdir().expect("folder");
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let cubes: Vec<PathBuf> = (0..SEEDS).map(|seed| render(folder.path(), seed)).collect();
    let output = Command::new(python)
        .args(["-W", "error"])
        .arg(here.join("tests/python/compare_peer.py"))
        .arg(here.join("tests/data/cornell_reference_K32.npz"))
        .args(cubes)
        .output()
        .expect("Python runs");
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    println!("{said}");
}

fn render(folder: &Path, seed: u64) -> PathBuf {
    let cube = folder.join(format!("{seed}.zarr"));
    let output = Command::new(env!("CARGO_BIN_EXE_spectile"))
        .arg("render")
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell/cornell.toml"))
        .arg("-o")
        .arg(&cube)
        .args(["--size", "64x64", "--set", "channels.equal.count=32", "--spp", SAMPLES, "--quiet", "--seed"])
        .arg(seed.to_string())
        .output()
        .expect("the binary runs");
    assert!(output.status.success(), "seed {seed}: {}", String::from_utf8_lossy(&output.stderr));
    cube
}
