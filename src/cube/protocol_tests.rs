//! Nothing is ever lost: a writer that dies, loses power or finds the disk full between any two steps, files that rot,
//! and always the same bytes in the end.
//!
//! Writers are processes of their own: this test binary, started again for the one test [`writer`], which merges known
//! units and dies where it is told to.

use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus};

use super::faults::injected::{DIE, FULL, LOG};
use super::journal::Journal;
use super::*;
use crate::cube_files::{Files, files};
use crate::spectral::product::{Basis, Expression, Leaf, Product, Term};
use crate::spectral::{Channels, Curve};
use crate::{Error, Result};

const CUBE: &str = "SPECTILE_TEST_CUBE";
const EPOCHS: &str = "SPECTILE_TEST_EPOCHS";
/// Set where the cube holds weights.
const WEIGHTS: &str = "SPECTILE_TEST_WEIGHTS";
/// Set where a damaged tile may be rendered again.
const MAY_WARN: &str = "SPECTILE_TEST_MAY_WARN";

const TILES: u32 = 3;
/// Epochs in the cube that every test begins with, and in the end: with a batch of every two, journals are written anew
/// on the way.
const BEFORE: u32 = 29;
const AFTER: u32 = 32;
const EPOCHS_PER_BATCH: u32 = 2;

/// What the cube holds.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Radiance,
    /// Weights, and a remainder.
    Weights,
}

fn header(kind: Kind) -> Header {
    let header = Header {
        size: [40, 8],
        origin: [0, 0],
        tile: [16, 8],
        channels: Channels::equal(400.0, 700.0, 5),
        epoch: 4,
        attributes: serde_json::Map::new(),
    }
    .with_uncertainty()
    .with_layers(&LayerNames::new(&LAYERS, vec!["objects.0".into()], Vec::new()));
    match kind {
        Kind::Radiance => header,
        Kind::Weights => header.with_weights(&basis(), 2, &["matter".into()], &[]),
    }
}

/// A source and a factor.
fn basis() -> Basis {
    let leaf = |value: f64| Leaf {
        name: value.to_string(),
        is_named: false,
        quantity: String::new(),
        curve: Curve::Constant(value),
    };
    let of = |i: usize| Expression { scale: 1.0, terms: vec![Term::Spectrum(i)] };
    Basis { spectra: vec![leaf(3.0), leaf(0.5)], sources: vec![of(0)], factors: vec![of(1)] }
}

const LAYERS: [Layer; 2] = [Layer::Normal, Layer::Object];

/// What is seen in a tile.
fn layers(grid: Grid, tile: u32) -> TileLayers {
    let mut layers = TileLayers::empty(&LAYERS, grid);
    for pixel in 0..100 {
        layers.set(Layer::Normal, pixel, &[f64::from(tile), pixel as f64, 0.5]);
        layers.set(Layer::Object, pixel, &[pixel as f64]);
    }
    layers
}

/// What a device would have made of a unit.
fn unit(tile: u32, epoch: u32) -> Vec<f32> {
    let value = |i: u32| ((i * 37 + tile * 101 + epoch * epoch * 13) % 1009) as f32 / 7.0;
    (0..16 * 8 * 5).map(value).collect()
}

/// And what it would have made of a unit's weights.
fn weights(tile: u32, epoch: u32) -> Weights {
    let product = |factors: &[u16]| Product { source: 0, factors: factors.into() };
    let pixel = |i: u32| {
        let weight = |k: u32| f64::from((i * 11 + tile * 7 + epoch * 29 + k) % 13) / 3.0;
        [(product(&[]), weight(0)), (product(&[0]), weight(1)), (product(&[0, 0]), weight(2))].into_iter()
    };
    Weights::of_pixels((0..16 * 8).map(pixel))
}

/// Merges what is missing until every tile has `epochs` epochs, as a render would.
fn work(path: &Path, kind: Kind, epochs: u32, warn: &mut dyn FnMut(String)) -> Result<()> {
    let cube = Writer::open(path, &header(kind), Existing::Resume, 0..TILES, warn)?;
    for epoch in 0..epochs {
        for tile in cube.tiles() {
            if epochs_in(cube.found()[tile as usize], 4) <= epoch {
                if epoch == 0 {
                    cube.lay(tile, layers(cube.cube().grid(), tile));
                }
                let (before, samples) = (samples_before(epoch, 4), epoch_samples(epoch, 4));
                let unit = unit(tile, epoch);
                match kind {
                    Kind::Radiance => cube.merge_unit(tile, before, samples, &unit)?,
                    Kind::Weights => {
                        cube.merge_weights(tile, before, samples, weights(tile, epoch), Some(&unit))?;
                    }
                }
            }
        }
        if epoch % EPOCHS_PER_BATCH == EPOCHS_PER_BATCH - 1 {
            cube.flush()?;
        }
    }
    cube.flush()
}

/// Does nothing unless it is started as a writer.
#[test]
fn writer() {
    let Some(path) = std::env::var_os(CUBE) else { return };
    let epochs = std::env::var(EPOCHS).expect("epochs").parse().expect("a number");
    let mut warn = |what: String| assert!(std::env::var_os(MAY_WARN).is_some(), "{what}");
    let kind = if std::env::var_os(WEIGHTS).is_some() { Kind::Weights } else { Kind::Radiance };
    match work(Path::new(&path), kind, epochs, &mut warn) {
        Ok(()) => {}
        // An orderly end: nothing waits, nothing panics.
        Err(Error::Storage { what, .. }) if std::env::var_os(FULL).is_some() => {
            assert!(what.contains("no space left on device"), "{what}");
            std::process::exit(5);
        }
        Err(error) => panic!("{error}"),
    }
}

/// A writer that works until every tile has `epochs`, with faults.
fn start(path: &Path, kind: Kind, epochs: u32, faults: &[(&str, String)]) -> ExitStatus {
    let mut command = Command::new(std::env::current_exe().expect("this test"));
    command.args(["--exact", "cube::protocol_tests::writer", "--nocapture", "-q"]);
    command.env(CUBE, path).env(EPOCHS, epochs.to_string());
    if kind == Kind::Weights {
        command.env(WEIGHTS, "1");
    }
    command.envs(faults.iter().map(|(name, value)| (*name, value)));
    let output = command.output().expect("started");
    let killed = output.status.signal().is_some() || output.status.code() == Some(5);
    assert!(killed || output.status.success(), "{faults:?} {}", String::from_utf8_lossy(&output.stderr));
    output.status
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("made");
    for entry in fs::read_dir(from).expect("list") {
        let entry = entry.expect("entry");
        let target = to.join(entry.file_name());
        if entry.file_type().expect("type").is_dir() {
            copy(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).expect("copied");
        }
    }
}

/// The files of the arrays, and the leftovers aside.
fn arrays(path: &Path) -> Files {
    files(path, |name| !name.starts_with(".spectile") || name.starts_with(".spectile/aside"))
}

/// Numbers by chance, the same in every run.
struct Chance(u64);

impl Chance {
    /// From 0 to `n` - 1.
    fn below(&mut self, n: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % n
    }
}

/// A cube with [`BEFORE`] epochs, the bytes that [`AFTER`] must have, and a place for copies.
struct Bench {
    folder: tempfile::TempDir,
    kind: Kind,
    expected: Files,
}

impl Bench {
    fn new() -> Bench {
        Bench::of(Kind::Radiance)
    }

    fn of(kind: Kind) -> Bench {
        let folder = tempfile::tempdir().expect("folder");
        let (base, straight) = (folder.path().join("base.zarr"), folder.path().join("straight.zarr"));
        work(&base, kind, BEFORE, &mut |what| panic!("{what}")).expect("a cube");
        work(&straight, kind, AFTER, &mut |what| panic!("{what}")).expect("a cube");
        let expected = arrays(&straight);
        Bench { folder, kind, expected }
    }

    fn base(&self) -> PathBuf {
        self.folder.path().join("base.zarr")
    }

    /// A fresh copy of the base.
    fn cube(&self) -> PathBuf {
        let path = self.folder.path().join("cube.zarr");
        let _ = fs::remove_dir_all(&path);
        copy(&self.base(), &path);
        path
    }

    /// The names of the steps that a writer takes from the base to `epochs`.
    fn steps(&self, epochs: u32) -> Vec<String> {
        let log = self.folder.path().join("steps");
        let _ = fs::remove_file(&log);
        let path = self.cube();
        assert!(start(&path, self.kind, epochs, &[(LOG, log.display().to_string())]).success());
        fs::read_to_string(log).expect("a log").lines().map(str::to_owned).collect()
    }

    /// What is there can be read, no samples are lost, and going on ends with the bytes that it must have.
    fn goes_on(&self, path: &Path, what: &str) {
        let cube = Cube::open(path).expect(what);
        let least = samples_before(BEFORE, 4);
        assert!((0..TILES).all(|tile| cube.samples(tile).expect(what) >= least), "{what}");
        assert!((0..TILES).all(|tile| cube.chunk(tile).expect(what).is_some()), "{what}");
        assert!(start(path, self.kind, AFTER, &[]).success(), "{what}");
        assert!(arrays(path) == self.expected, "{what}");
        let found = cube.verify().expect(what);
        assert!(found.damage.is_empty(), "{what}: {:?}", found.damage);
    }
}

fn die_at(step: usize) -> Vec<(&'static str, String)> {
    vec![(DIE, step.to_string())]
}

#[test]
fn a_writer_may_die_between_any_two_steps() {
    let bench = Bench::new();
    let steps = bench.steps(AFTER);
    let all: std::collections::BTreeSet<&str> = steps.iter().map(String::as_str).collect();
    for step in [
        "file aside written",
        "folder aside synced",
        "journal half appended",
        "journal synced",
        "file in place",
        "new journal renamed",
        "folder synced",
    ] {
        assert!(all.contains(step), "{step} is among the steps: {all:?}");
    }
    for (n, name) in steps.iter().enumerate() {
        let path = bench.cube();
        assert_eq!(start(&path, bench.kind, AFTER, &die_at(n)).signal(), Some(6), "step {n}");
        bench.goes_on(&path, &format!("died at step {n}, {name}"));
    }
}

/// So may one of weights and what does not separate.
fn a_writer_of_two_parts_may_die(every: usize) {
    let bench = Bench::of(Kind::Weights);
    let steps = bench.steps(AFTER);
    for (n, name) in steps.iter().enumerate().step_by(every) {
        let path = bench.cube();
        assert_eq!(start(&path, bench.kind, AFTER, &die_at(n)).signal(), Some(6), "step {n}");
        bench.goes_on(&path, &format!("died at step {n}, {name}"));
    }
}

#[test]
fn a_writer_of_two_parts_may_die_between_steps() {
    a_writer_of_two_parts_may_die(17);
}

#[test]
#[ignore = "hundreds of deaths: a minute"]
fn a_writer_of_two_parts_may_die_between_any_two_steps() {
    a_writer_of_two_parts_may_die(1);
}

/// The second death comes anywhere in the recovery from the first, or soon after it.
fn dies_twice(every: usize) {
    let bench = Bench::new();
    for n in (0..bench.steps(AFTER).len()).step_by(every) {
        for again in (n % every..30).step_by(every) {
            let path = bench.cube();
            assert_eq!(start(&path, bench.kind, AFTER, &die_at(n)).signal(), Some(6));
            start(&path, bench.kind, AFTER, &die_at(again));
            bench.goes_on(&path, &format!("died at step {n} and then at {again}"));
        }
    }
}

#[test]
fn a_writer_may_die_twice_in_a_row() {
    dies_twice(9);
}

#[test]
#[ignore = "thousands of deaths: minutes"]
fn a_writer_may_die_twice_in_a_row_at_more_steps() {
    dies_twice(3);
}

#[test]
fn a_disk_may_be_full_at_any_step() {
    let bench = Bench::new();
    for n in 0..bench.steps(AFTER).len() {
        let path = bench.cube();
        assert_eq!(start(&path, bench.kind, AFTER, &[(FULL, n.to_string())]).code(), Some(5), "step {n}");
        bench.goes_on(&path, &format!("full at step {n}"));
    }
}

/// A power cut undoes whatever was not synced: files aside, the end of a journal, renames; each or not, by chance.
#[test]
fn power_may_be_cut_between_any_two_steps() {
    let bench = Bench::new();
    // One batch, so that the base holds what a rename replaces.
    let epochs = BEFORE + 1;
    let steps = bench.steps(epochs);
    let mut chance = Chance(1);
    for n in 0..steps.len() {
        let done = &steps[..=n];
        let path = bench.cube();
        assert_eq!(start(&path, bench.kind, epochs, &die_at(n)).signal(), Some(6));
        let cube = Cube::open(&path).expect("a cube");
        let last = |name: &str| done.iter().rposition(|step| step == name);
        if last("folder aside synced").is_none() {
            for entry in fs::read_dir(cube.aside_folder()).expect("list") {
                let file = entry.expect("entry").path();
                let length = fs::metadata(&file).expect("there").len();
                match chance.below(3) {
                    0 => fs::remove_file(file).expect("removed"),
                    1 => truncate(&file, chance.below(length + 1)),
                    _ => {}
                }
            }
        } else if last("journal opened") > last("journal synced") {
            let journals = (0..TILES).map(|tile| cube.journal_folder().join(tile.to_string()));
            let newest = journals.max_by_key(|j| fs::metadata(j).and_then(|m| m.modified()).ok()).expect("a journal");
            let (before, now) =
                (bench.base().join(".spectile/journal").join(newest.file_name().expect("a name")), &newest);
            let before = fs::metadata(before).expect("there").len();
            let length = fs::metadata(now).expect("there").len();
            truncate(now, before + chance.below(length.saturating_sub(before) + 1));
        } else if last("file in place").is_some() && last("folder synced").is_none() {
            for tile in 0..TILES {
                let suffix = Journal::of(&cube, tile).last().expect("read").expect("a record").suffix;
                for &part in cube.parts() {
                    let (target, aside) = (cube.part_path(part, tile), cube.aside_path(part, tile, suffix));
                    let old = bench.base().join(target.strip_prefix(&path).expect("inside"));
                    if !aside.exists() && chance.below(2) == 0 {
                        fs::rename(&target, aside).expect("back");
                        fs::copy(old, &target).expect("as it was");
                    }
                }
            }
        }
        bench.goes_on(&path, &format!("power cut at step {n}, {}", steps[n]));
    }
}

fn truncate(file: &Path, length: u64) {
    fs::OpenOptions::new().write(true).open(file).expect("opened").set_len(length).expect("truncated");
}

/// Bits that flip, files that are cut, emptied, lengthened or lost: found by `verify`, put in order by the next writer,
/// and in the end the same bytes.
#[test]
fn damaged_files_are_found_and_made_anew() {
    let bench = Bench::new();
    let mut chance = Chance(7);
    let cube = Cube::open(&bench.base()).expect("a cube");
    let of_tile = |tile: u32| {
        let parts: Vec<PathBuf> = cube.parts().iter().map(|&part| cube.part_path(part, tile)).collect();
        parts.into_iter().chain([cube.journal_folder().join(tile.to_string())])
    };
    for file in (0..TILES).flat_map(of_tile) {
        let name = file.strip_prefix(cube.path()).expect("inside").to_owned();
        for damage in ["flipped", "flipped", "flipped", "cut", "cut", "emptied", "lengthened", "lost"] {
            let path = bench.cube();
            let file = path.join(&name);
            let mut bytes = fs::read(&file).expect("read");
            let at = chance.below(bytes.len() as u64) as usize;
            match damage {
                "flipped" => bytes[at] ^= 1 << chance.below(8),
                "cut" => bytes.truncate(at),
                "emptied" => bytes.clear(),
                _ => bytes.extend([7; 99]),
            }
            fs::write(&file, bytes).expect("written");
            if damage == "lost" {
                fs::remove_file(&file).expect("removed");
            }
            let what = format!("{} {damage} at {at}", name.display());
            let damaged = Cube::open(&path).expect(&what);
            assert!(!damaged.verify().expect(&what).damage.is_empty(), "{what}");

            let mut warnings = Vec::new();
            work(&path, bench.kind, AFTER, &mut |warning| warnings.push(warning)).expect(&what);
            assert!(arrays(&path) == bench.expected, "{what}");
            assert_eq!(damaged.verify().expect(&what).damage, Vec::<String>::new(), "{what}");
            // What is derived from sound radiance is made anew without a word; samples that are lost are mourned.
            let sampled = ["radiance", "standard_error", "normal", "object"];
            let is_sampled = sampled.iter().any(|array| name.starts_with(array));
            let derived = !is_sampled && !name.starts_with(".spectile");
            assert!(!derived || warnings.is_empty(), "{what}: {warnings:?}");
            assert!(!is_sampled || warnings.len() == 1, "{what}: {warnings:?}");
        }
    }
    // What is written once.
    for name in ["zarr.json", "wavelength/c/0", "radiance/zarr.json"] {
        let path = bench.cube();
        let mut bytes = fs::read(path.join(name)).expect("read");
        let last = bytes.len() - 2;
        bytes[last] ^= 1;
        fs::write(path.join(name), bytes).expect("written");
        let Ok(cube) = Cube::open(&path) else { continue };
        let found = cube.verify().expect("verified").damage;
        assert_eq!(found, [format!("{name} is not what was written")]);
    }
}

/// Two writers that do not know of each other, as on a file system whose locks have failed: one of them stops, and the
/// cube is what the other made.
#[test]
fn who_has_lost_its_lock_stops() {
    let bench = Bench::new();
    let path = bench.cube();
    let open = || {
        Writer::open(&path, &header(bench.kind), Existing::Resume, 0..TILES, &mut |what| panic!("{what}"))
            .expect("a cube")
    };
    let first = open();
    // A lock file that was removed locks nobody out any more.
    fs::remove_file(path.join(".spectile/lock")).expect("removed");
    let second = open();
    let (before, n) = (samples_before(BEFORE, 4), epoch_samples(BEFORE, 4));
    first.merge_unit(0, before, n, &unit(0, BEFORE)).expect("merged");
    second.merge_unit(0, before, n, &unit(0, BEFORE)).expect("merged");
    first.flush().expect("committed");
    let error = second.flush().expect_err("the journal has gone on");
    assert!(error.to_string().contains("tile 0 was changed by another process"), "{error}");
    let error = second.merge_unit(1, before, n, &unit(1, BEFORE)).expect_err("it has stopped");
    assert_eq!(error.exit_code(), 5);
    drop((first, second));
    bench.goes_on(&path, "after a quarrel");
}
