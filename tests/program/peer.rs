//! The Cornell box against the reference of a program that shares nothing with this one, through the real binary and
//! the real xarray. What is compared, and what bias would be noticed: `tests/python/compare_peer.py`.
//!
//! Skipped without SPECTILE_PYTHON, like `tests/files/python.rs`.

use std::path::{Path, PathBuf};

use tempfile::tempdir;

use crate::binary::{cornell, repository, run};
use crate::outside::python;
use crate::size;

/// Independent renders of 128 samples per pixel: their spread is their error, with 15 degrees of freedom a pixel, in `--full`.
const SEEDS: [u64; 2] = [10, 16];
const SAMPLES: &str = "128";

#[test]
fn the_cornell_box_is_the_peers() {
    let Some(mut python) = python("compare_peer.py") else { return };
    let folder = tempdir().expect("folder");
    let cubes: Vec<PathBuf> =
        (0..SEEDS[usize::from(size::is_full())]).map(|seed| render(folder.path(), seed)).collect();
    let output =
        python.arg(repository("tests/data/cornell_reference_K32.npz")).args(cubes).output().expect("Python runs");
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    println!("{said}");
}

fn render(folder: &Path, seed: u64) -> PathBuf {
    let cube = folder.join(format!("{seed}.zarr"));
    let (scene, seed) = (cornell(), seed.to_string());
    let [scene, into] = [&scene, &cube].map(|path| path.to_str().expect("UTF-8"));
    let small = ["--size", "64x64", "--set", "channels.equal.count=32", "--spp", SAMPLES, "--quiet", "--seed", &seed];
    let output = run(folder, &[&["render", scene, "-o", into], &small[..]].concat());
    assert!(output.status.success(), "seed {seed}: {}", String::from_utf8_lossy(&output.stderr));
    cube
}
