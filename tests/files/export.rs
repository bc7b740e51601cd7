//! `spectile export` through the real binary, read back by programs that were not written here, and its memory.
//!
//! SPECTILE_PYTHON names a Python that has tests/python/requirements.txt. Without it those tests say so and check what can be
//! checked without, except where CI=true.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};
use spectile::cube::{Cube, Existing, Header, View, integrate};
use spectile::export::{self, Format, Map, Shown};
use spectile::format::envi::Interleave;
use spectile::spectral::Channels;
use tempfile::tempdir;

use crate::binary::{command, run};
use crate::cube_files::files;
use crate::cubes::{Written, create, header, pattern, unit};
use crate::outside::python;

/// The last JSON object of an export that must succeed, and what it said on stderr.
fn export(folder: &Path, arguments: &[&str]) -> (Value, String) {
    let output = run(folder, &[&["export", "cube.zarr", "--json"], arguments].concat());
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {stderr}");
    let stdout = String::from_utf8_lossy(&output.stdout);
    let done: Value = serde_json::from_str(stdout.lines().last().expect("a line")).expect("JSON");
    assert_eq!(done["event"], "done");
    (done, stderr)
}

fn refused(folder: &Path, arguments: &[&str], words: &str) {
    let output = run(folder, &[&["export", "cube.zarr"], arguments].concat());
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
    assert!(stderr.contains(words), "{arguments:?}: {stderr}");
}

/// A cube of odd sizes on the film's [100, 50], the tiles `missing` not rendered.
fn cube(folder: &Path, channels: Channels, missing: &[u32]) -> Written {
    let shape = Header { channels, origin: [100, 50], ..header([70, 37], [16, 8], 1) };
    let cube = create(folder, "cube.zarr", shape);
    for tile in (0..cube.grid().count()).filter(|tile| !missing.contains(tile)) {
        cube.merge_unit(tile, 1, &unit(&cube, tile, pattern)).expect("merged");
    }
    cube
}

/// What a part of a cube must be in somebody else's format.
struct Part<'a> {
    cube: &'a Cube,
    bands: Vec<usize>,
    /// x0, y0, x1, y1.
    crop: [u32; 4],
    /// Bands are multiplied by their widths.
    integrated: bool,
}

impl Part<'_> {
    /// [y][x][band], by the slow way through single pixels.
    fn values(&self) -> (Vec<f32>, Vec<f32>) {
        let [x0, y0, x1, y1] = self.crop;
        let channels = self.cube.channels();
        let (mut values, mut colours) = (Vec::new(), Vec::new());
        for y in y0..y1 {
            for x in x0..x1 {
                let spectrum = self.cube.spectrum(x, y).expect("readable");
                let colour = spectrum.as_ref().map_or([f32::NAN; 3], |s| self.cube.projection().rgb(s));
                colours.extend(colour);
                values.extend(self.bands.iter().map(|&k| match &spectrum {
                    None => f32::NAN,
                    Some(s) if self.integrated => (f64::from(s[k]) * channels.width(k)) as f32,
                    Some(s) => s[k],
                }));
            }
        }
        (values, colours)
    }

    /// Has Python compare `files` with it.
    fn check(&self, folder: &Path, format: &str, files: &Value, more: Value) {
        let Some(mut python) = python("read_exports.py") else { return };
        let (values, colours) = self.values();
        fs::write(folder.join("values.bin"), bytemuck::cast_slice::<f32, u8>(&values)).expect("written");
        fs::write(folder.join("rgb.bin"), bytemuck::cast_slice::<f32, u8>(&colours)).expect("written");
        let channels = self.cube.channels().select(&self.bands);
        let each = |value: &dyn Fn(usize) -> f64| (0..channels.len()).map(value).collect::<Vec<f64>>();
        let [x0, y0, x1, y1] = self.crop;
        let mut expected = json!({
            "format": format,
            "files": files,
            "values": "values.bin",
            "rgb": "rgb.bin",
            "size": [x1 - x0, y1 - y0],
            "origin": [self.cube.header().origin[0] + x0, self.cube.header().origin[1] + y0],
            "wavelength": each(&|k| channels.centre(k)),
            "fwhm": each(&|k| channels.width(k)),
            "names": channels.names,
        });
        for (key, value) in more.as_object().expect("an object") {
            expected[key] = value.clone();
        }
        let path = folder.join("expected.json");
        fs::write(&path, expected.to_string()).expect("written");
        let output = python.arg(&path).output().expect("Python runs");
        assert!(output.status.success(), "{format}: {}", String::from_utf8_lossy(&output.stderr));
    }
}

fn whole(cube: &Cube) -> Part<'_> {
    let [x1, y1] = cube.header().size;
    Part { cube, bands: (0..cube.channels().len()).collect(), crop: [0, 0, x1, y1], integrated: false }
}

#[test]
fn envi_in_every_order_is_read_by_spectral_and_rasterio() {
    let folder = tempdir().expect("folder");
    let cube = cube(folder.path(), Channels::equal(380.0, 780.0, 21), &[3, 8]);
    for interleave in ["bil", "bip", "bsq"] {
        let (done, _) = export(folder.path(), &["-o", "all.img", "--interleave", interleave]);
        assert_eq!(done["files"], json!(["all.img", "all.hdr"]));
        let more = json!({ "interleave": interleave, "units": "W m^-2 sr^-1 nm^-1", "default_bands": [13, 8, 4] });
        whole(&cube).check(folder.path(), "envi", &done["files"], more);
        // The extension says the order too.
        let (done, _) = export(
            folder.path(),
            &[
                "-o",
                &format!("part-{interleave}.{interleave}"),
                "--crop",
                "5,7,66,30",
                "--bands",
                "20,3..9",
                "--integrated",
            ],
        );
        let bands = [20].into_iter().chain(3..9).collect();
        let part = Part { cube: &cube, bands, crop: [5, 7, 66, 30], integrated: true };
        let more = json!({ "interleave": interleave, "units": "W m^-2 sr^-1", "default_bands": [6, 6, 2] });
        part.check(folder.path(), "envi", &done["files"], more);
    }
    // Bit for bit without Python too.
    let (done, _) = export(folder.path(), &["-o", "raw.bip"]);
    let expected: Vec<f32> =
        whole(&cube).values().0.into_iter().map(|v| if v.is_nan() { -9999.0 } else { v }).collect();
    let path = folder.path().join(done["files"][0].as_str().expect("a name"));
    assert_eq!(fs::read(path).expect("read"), bytemuck::cast_slice::<f32, u8>(&expected));
}

#[test]
fn openexr_is_read_by_openexr_and_colour() {
    let folder = tempdir().expect("folder");
    let cube = cube(folder.path(), Channels::equal(380.0, 20_000.0, 45), &[8]);
    let (done, stderr) = export(folder.path(), &["-o", "all.exr"]);
    assert_eq!(stderr, "");
    whole(&cube).check(folder.path(), "exr", &done["files"], json!({ "units": "W.m^-2.sr^-1.nm^-1" }));
    let (done, _) = export(folder.path(), &["-o", "strict.exr", "--exr-strict-units"]);
    whole(&cube).check(folder.path(), "exr", &done["files"], json!({ "units": "W.m^-2.sr^-1" }));
    let (done, _) =
        export(folder.path(), &["-o", "part.exr", "--bands", "30,600nm,2..4", "--crop", "1,2,60,31", "--integrated"]);
    let part = Part { cube: &cube, bands: vec![30, 0, 2, 3], crop: [1, 2, 60, 31], integrated: true };
    part.check(folder.path(), "exr", &done["files"], json!({ "units": "W.m^-2.sr^-1" }));
    let (done, _) = export(folder.path(), &["-o", "split.exr", "--exr-split", "20"]);
    assert_eq!(done["files"].as_array().map(Vec::len), Some(3), "{done}");
    whole(&cube).check(folder.path(), "exr-split", &done["files"], json!({ "split": 20 }));
}

#[test]
fn many_channels_in_openexr_are_warned_of() {
    let folder = tempdir().expect("folder");
    let shape = Header { channels: Channels::equal(400.0, 700.0, 1500), ..header([8, 8], [8, 8], 1) };
    let cube = create(folder.path(), "cube.zarr", shape);
    cube.merge_unit(0, 1, &unit(&cube, 0, pattern)).expect("merged");
    let (done, stderr) = export(folder.path(), &["-o", "all.exr"]);
    assert!(stderr.contains("1503 channels") && stderr.contains("--exr-split"), "{stderr}");
    whole(&cube).check(folder.path(), "exr", &done["files"], json!({ "units": "W.m^-2.sr^-1.nm^-1" }));
    let (_, stderr) = export(folder.path(), &["-o", "all.exr", "--exr-split", "1000"]);
    assert_eq!(stderr, "");
    // Channels that one name would stand for.
    let folder = tempdir().expect("folder");
    let channels = Channels::from_bounds(vec![[400.0, 500.0], [425.0, 475.0]], None);
    create(folder.path(), "cube.zarr", Header { channels, ..header([8, 8], [8, 8], 2) });
    refused(folder.path(), &["-o", "same.exr"], "have one centre, 450 nm");
    assert_eq!(fs::read_dir(folder.path()).expect("list").count(), 1);
}

#[test]
fn compressed_zarr_is_read_by_xarray() {
    let folder = tempdir().expect("folder");
    // More bands than a chunk has, in no order.
    let mut channels = Channels::equal(380.0, 780.0, 100);
    channels.bounds.rotate_left(30);
    let cube = cube(folder.path(), channels, &[3, 8]);
    let more = |sharded: bool, units: &str| json!({ "sharded": sharded, "units": units, "variable": "radiance" });
    let (done, _) = export(folder.path(), &["-o", "all.zarr"]);
    whole(&cube).check(folder.path(), "zarr", &done["files"], more(true, "W m-2 sr-1 nm-1"));
    let (done, _) = export(folder.path(), &["-o", "loose.zarr", "--zarr-no-shards"]);
    whole(&cube).check(folder.path(), "zarr", &done["files"], more(false, "W m-2 sr-1 nm-1"));
    let (done, _) =
        export(folder.path(), &["-o", "part.zarr", "--bands", "7..9,1", "--crop", "9,0,70,37", "--integrated"]);
    let part = Part { cube: &cube, bands: vec![7, 8, 1], crop: [9, 0, 70, 37], integrated: true };
    part.check(folder.path(), "zarr", &done["files"], more(true, "W m-2 sr-1"));
    // One's own export is replaced, unless somebody has put something into it; a cube never is.
    let (done, _) = export(folder.path(), &["-o", "part.zarr", "--bands", "3"]);
    let part = Part { bands: vec![3], ..whole(&cube) };
    part.check(folder.path(), "zarr", &done["files"], more(true, "W m-2 sr-1 nm-1"));
    fs::write(folder.path().join("part.zarr/radiance/notes.txt"), "x").expect("written");
    refused(folder.path(), &["-o", "part.zarr"], "also holds `notes.txt`");
    refused(folder.path(), &["-o", "cube.zarr"], "it is a cube");
}

#[test]
fn tables_are_read_by_pandas() {
    let folder = tempdir().expect("folder");
    let cube = cube(folder.path(), Channels::equal(380.0, 780.0, 4), &[3]);
    let (done, _) = export(folder.path(), &["-o", "all.csv"]);
    whole(&cube).check(folder.path(), "csv", &done["files"], json!({}));
    let (done, _) =
        export(folder.path(), &["-o", "part.csv", "--bands", "480nm..680nm,0", "--crop", "9,3,70,20", "--integrated"]);
    let part = Part { cube: &cube, bands: vec![1, 2, 0], crop: [9, 3, 70, 20], integrated: true };
    part.check(folder.path(), "csv", &done["files"], json!({}));
}

#[test]
fn blocks_put_together_are_the_picture() {
    let folder = tempdir().expect("folder");
    let cube = cube(folder.path(), Channels::equal(380.0, 780.0, 5), &[]);
    let (done, _) =
        export(folder.path(), &["-o", "blocks", "--format", "envi", "--interleave", "bip", "--blocks", "32"]);
    assert_eq!(done["files"], json!(["blocks"]));
    let text = fs::read_to_string(folder.path().join("blocks/index.json")).expect("an index");
    let index: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!((&index["size"], &index["origin"]), (&json!([70, 37]), &json!([100, 50])));
    assert_eq!(index["bands"][4]["bounds_nm"], json!([700.0, 780.0]));
    let blocks = index["blocks"].as_array().expect("blocks");
    assert_eq!(blocks.len(), 3 * 2);
    let mut picture = vec![0.0f32; 70 * 37 * 5];
    for block in blocks {
        let range = |axis: &str, from: usize| {
            let end = |i: usize| block[axis][i].as_u64().expect("a number") as usize - from;
            end(0)..end(1)
        };
        let (columns, rows) = (range("x", 100), range("y", 50));
        let file = folder.path().join("blocks").join(block["files"][0].as_str().expect("a name"));
        let bytes = fs::read(&file).expect("a file");
        let mut values = bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b));
        for y in rows {
            for x in columns.clone() {
                (0..5).for_each(|k| picture[(y * 70 + x) * 5 + k] = values.next().expect("a value"));
            }
        }
        assert_eq!(values.next(), None);
    }
    assert_eq!(picture, whole(&cube).values().0);

    // Of a part: one block, which is that part.
    let arguments = ["--blocks", "100", "--bands", "540nm..700nm,0", "--crop", "9,3,70,20", "--integrated"];
    let (_, _) =
        export(folder.path(), &[&["-o", "part", "--format", "envi", "--interleave", "bip"], &arguments[..]].concat());
    let part = Part { cube: &cube, bands: vec![2, 3, 0], crop: [9, 3, 70, 20], integrated: true };
    let index: Value =
        serde_json::from_slice(&fs::read(folder.path().join("part/index.json")).expect("an index")).expect("JSON");
    assert_eq!((&index["units"], &index["bands"][2]["wavelength_nm"]), (&"W m-2 sr-1".into(), &json!(420.0)));
    let block = json!({ "files": ["x000109_y000053.img", "x000109_y000053.hdr"], "x": [109, 170], "y": [53, 70] });
    assert_eq!(index["blocks"], json!([block]));
    let file = fs::read(folder.path().join("part/x000109_y000053.img")).expect("a file");
    assert_eq!(file, bytemuck::cast_slice::<f32, u8>(&part.values().0));
}

/// What is wrong with a cube is said by every format, and leaves nothing.
#[test]
fn damaged_cubes_are_not_exported() {
    let folder = tempdir().expect("folder");
    let cube = cube(folder.path(), Channels::equal(380.0, 780.0, 4), &[]);
    let spoil = |name: &str, bytes: usize| {
        let path = cube.path().join(name);
        let whole = fs::read(&path).expect("read");
        fs::write(&path, &whole[..bytes]).expect("written");
        (path, whole)
    };
    let refused = |words: &str| {
        for more in [
            &["-o", "a.img"][..],
            &["-o", "a.exr"],
            &["-o", "a.zarr"],
            &["-o", "a.csv"],
            &["-o", "a.png", "--bands", "1"],
            &["-o", "a.png"],
            &["-o", "blocks", "--format", "csv", "--blocks", "16"],
        ] {
            let output = run(folder.path(), &[&["export", "cube.zarr"], more].concat());
            let stderr = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(5), "{more:?}: {stderr}");
            assert!(stderr.contains("cube.zarr") && stderr.contains(words), "{more:?}: {stderr}");
            assert!(stderr.starts_with("error: ") && stderr.lines().count() == 1, "{more:?}: {stderr}");
            assert_eq!(fs::read_dir(folder.path()).expect("list").count(), 1, "{more:?}");
        }
    };
    // The last tile, when most of the work is done; the preview is read where the radiance is not.
    let spoilt = [spoil("radiance/c/0/4/4", 100), spoil("preview/c/4/4/0", 100)];
    refused("is damaged");
    spoilt.iter().for_each(|(path, whole)| fs::write(path, whole).expect("written"));
    // The group's metadata matter only where Spectile's own record is missing.
    let (path, whole) = spoil("zarr.json", 50);
    export(folder.path(), &["-o", "a.csv"]);
    fs::remove_file(folder.path().join("a.csv")).expect("removed");
    let kept = tempdir().expect("folder");
    fs::rename(cube.path().join(".spectile"), kept.path().join("kept")).expect("moved");
    refused("zarr.json is not JSON");
    fs::remove_file(&path).expect("removed");
    refused("holds no zarr.json");
    fs::write(path, whole).expect("written");
    export(folder.path(), &["-o", "a.csv"]);
}

#[test]
fn what_cannot_be_exported_is_refused() {
    let folder = tempdir().expect("folder");
    cube(folder.path(), Channels::equal(380.0, 780.0, 4), &[]);
    for (arguments, words) in [
        (vec!["-o", "a.img", "--bands", "4"], "the bands of this cube are 0..4"),
        (vec!["-o", "a.img", "--bands", "1,0..3"], "the band 1 twice"),
        (vec!["-o", "a.img", "--bands", "9um"], "9000 nm lies outside of all bands"),
        (vec!["-o", "a.img", "--crop", "0,0,71,37"], "70 x 37 pixels"),
        (vec!["-o", "a.img", "--crop", "5,0,5,37"], "X0 < X1"),
        (vec!["-o", "a.bsq", "--interleave", "bip"], "contradicts"),
        (vec!["-o", "a.exr", "--interleave", "bip"], "--interleave goes with envi"),
        (vec!["-o", "a.img", "--exr-split", "5"], "--exr-split goes with exr"),
        (vec!["-o", "a.img", "--zarr-no-shards"], "--zarr-no-shards goes with zarr"),
        (vec!["-o", "a.csv", "--exposure", "1"], "--exposure goes with png"),
        (vec!["-o", "a", "--blocks", "8"], "--format"),
        (vec!["-o", "a.bmp"], "names no format"),
        (vec!["-o", "a.zarr", "--format", "envi"], "GDAL"),
        (vec!["-o", "cube.zarr"], "exists already"),
    ] {
        refused(folder.path(), &arguments, words);
    }
    let output = run(folder.path(), &["export", "cube.zarr", "-o", "no/where.img"]);
    assert_eq!(output.status.code(), Some(5));
    // Nothing is left of any of them.
    assert_eq!(fs::read_dir(folder.path()).expect("list").count(), 1);
}

/// Whatever ends an export, at its beginning or just before its end, leaves what was there as it was.
#[test]
fn what_is_interrupted_leaves_nothing() {
    let folder = tempdir().expect("folder");
    let cube = cube(folder.path(), Channels::equal(400.0, 800.0, 20), &[]);
    let out = folder.path().join("out");
    fs::create_dir(&out).expect("made");
    let view = View::whole(&cube);
    let colours = Shown::Map(Map::Radiance);
    type Write<'a> = &'a dyn Fn(&Path, &mut dyn FnMut(u64, u64) -> spectile::Result<()>) -> spectile::Result<()>;
    let to = |format: Format| {
        let view = view.clone();
        move |path: &Path, progress: &mut dyn FnMut(u64, u64) -> spectile::Result<()>| {
            export::write(&view, path, format, progress).map(drop)
        }
    };
    let responses = {
        let response = spectile::spectral::Response::new(vec![450.0, 600.0, 750.0], vec![0.0, 1.0, 0.0]);
        vec![("band".to_owned(), response.expect("a response"))]
    };
    let exports: [(&str, Write); 10] = [
        ("a.img", &to(Format::Envi { interleave: Interleave::Bil })),
        ("b.img", &to(Format::Envi { interleave: Interleave::Bsq })),
        ("c.img", &to(Format::Envi { interleave: Interleave::Bip })),
        ("a.exr", &to(Format::Exr { strict_units: false, split: None })),
        ("b.exr", &to(Format::Exr { strict_units: false, split: Some(8) })),
        ("a.zarr", &to(Format::Zarr { shards: true })),
        ("a.csv", &to(Format::Csv)),
        ("blocks", &|path, progress| export::write_blocks(&view, path, Format::Csv, 16, progress).map(drop)),
        ("a.png", &|path, progress| export::write_png(&view, path, &colours, None, progress).map(drop)),
        ("sensor.zarr", &|path, progress| {
            integrate(&cube, &responses, "s.csv", path, Existing::Replace, progress).map(drop)
        }),
    ];
    for (name, write) in exports {
        // First nothing is there, then what was written before.
        for (when, is_old) in [("at once", false), ("at the end", false), ("at once", true), ("at the end", true)] {
            if is_old {
                write(&out.join(name), &mut |_, _| Ok(())).expect("written");
            }
            let before = files(&out, |_| true);
            assert_eq!(before.is_empty(), !is_old, "{name}");
            let stop = &mut |done: u64, all: u64| match when {
                "at the end" if done < all => Ok(()),
                _ => Err(spectile::Error::Interrupted { signal: 15 }),
            };
            let result = write(&out.join(name), stop);
            assert!(matches!(result, Err(spectile::Error::Interrupted { signal: 15 })), "{name} {when}: {result:?}");
            assert!(files(&out, |_| true) == before, "{name} {when}");
        }
        // And what is not interrupted is there, and nothing beside it.
        write(&out.join(name), &mut |_, _| Ok(())).expect("written");
        assert!(
            fs::read_dir(&out)
                .expect("list")
                .all(|entry| { !entry.expect("an entry").file_name().to_str().expect("UTF-8").starts_with('.') })
        );
        fs::remove_dir_all(&out).expect("removed");
        fs::create_dir(&out).expect("made");
    }
}

/// Anonymous memory of exports of a sparse cube, whose holes read as zeros.
#[cfg(target_os = "linux")]
mod memory {
    use super::*;

    /// The peak, bytes, of an export.
    fn peak_of_export(folder: &Path, arguments: &[&str]) -> u64 {
        peak(folder, &[&["export", "cube.zarr"], arguments].concat())
    }

    /// The peak, bytes, of the program with these arguments.
    fn peak(folder: &Path, arguments: &[&str]) -> u64 {
        let mut child = command(folder, arguments).spawn().expect("started");
        let mut peak = 0;
        loop {
            let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
            let line = status.lines().find_map(|line| line.strip_prefix("RssAnon:"));
            let bytes = line.and_then(|line| line.trim().strip_suffix(" kB")?.parse::<u64>().ok()).unwrap_or(0) << 10;
            peak = peak.max(bytes);
            if let Some(status) = child.try_wait().expect("a child") {
                assert!(status.success(), "{arguments:?}");
                return peak;
            }
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
    }

    /// A cube of so many pixels a side and channels, of which one pixel is not a hole; and how many bytes it has.
    fn sparse(folder: &Path, side: u32, channels: usize) -> (Written, u64) {
        let cube = create(folder, "cube.zarr", header([side, side], [64, 64], channels));
        let bytes = cube.header().chunk_bytes();
        let [columns, rows] = cube.grid().tiles();
        for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
            let path = folder.join(format!("cube.zarr/radiance/c/0/{row}/{column}"));
            fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            let file = fs::File::create(path).expect("made");
            file.set_len(bytes).expect("a hole");
            if (row, column) == (1, 1) {
                use std::os::unix::fs::FileExt;
                let spectrum: Vec<f32> = (0..channels).map(|k| k as f32 + 0.5).collect();
                file.write_all_at(bytemuck::cast_slice(&spectrum), 0).expect("written");
            }
        }
        let count = u64::from(cube.grid().count());
        (cube, count * bytes)
    }

    fn bounded(side: u32, channels: usize, most: u64, formats: &[&[&str]]) {
        // On a disk, which must have room for all of it although nothing is written.
        let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).expect("folder");
        let (_cube, bytes) = sparse(folder.path(), side, channels);
        for arguments in formats {
            let peak = peak_of_export(folder.path(), arguments);
            println!("{arguments:?}: {} MiB of a cube of {} MiB", peak >> 20, bytes >> 20);
            assert!(peak <= most, "{arguments:?}: {} MiB of {} allowed", peak >> 20, most >> 20);
        }
        assert!(bytes > 4 * most, "the cube is larger than that");
        // And what came out is what was in: pixel 64, 64 of the last band but two.
        let file = fs::read(folder.path().join("bands.bsq")).expect("written");
        let values: &[f32] = bytemuck::cast_slice(&file);
        let plane = (side * side) as usize;
        assert_eq!(values.len(), 10 * plane);
        let at = 64 * side as usize + 64;
        assert_eq!(values[7 * plane + at], (channels - 10 + 7) as f32 + 0.5);
        assert_eq!(values.iter().filter(|&&v| v != 0.0).count(), 10);
    }

    #[test]
    fn of_a_sparse_cube_is_bounded() {
        // 640 MiB; what is held is 32 MiB at a time, and Python's readers are not part of it.
        let last: &str = "630..640";
        bounded(
            512,
            640,
            150 << 20,
            &[
                &["-o", "bands.bsq", "--bands", last],
                &["-o", "bands.zarr", "--bands", last],
                &["-o", "bands.exr", "--bands", last],
                &["-o", "all.bil"],
                &["-o", "all.zarr"],
                &["-o", "colours.png", "--bands", "1,2,3"],
                &["-o", "map.png", "--colour-map"],
                &["-o", "all.exr", "--crop", "0,0,256,256"],
            ],
        );
    }

    /// A picture is larger than what is held of it.
    #[test]
    fn of_a_large_picture_is_bounded() {
        let folder = tempdir().expect("folder");
        let (cube, _) = sparse(folder.path(), 4096, 3);
        for tile in 0..cube.grid().count() {
            let [column, row] = cube.grid().position(tile);
            let path = folder.path().join(format!("cube.zarr/preview/c/{row}/{column}/0"));
            fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            fs::File::create(path).expect("made").set_len(64 * 64 * 12).expect("a hole");
        }
        let (most, picture) = (96u64 << 20, 4096u64 * 4096 * 12);
        for arguments in [&["-o", "all.png"][..], &["-o", "some.png", "--bands", "2"]] {
            let peak = peak_of_export(folder.path(), arguments);
            println!("{arguments:?}: {} MiB of a picture of {} MiB", peak >> 20, picture >> 20);
            assert!(peak <= most && picture >= 2 * most, "{arguments:?}: {} MiB", peak >> 20);
        }
        // One pixel has light: it is what exposure goes by.
        let file = std::io::BufReader::new(fs::File::open(folder.path().join("some.png")).expect("opens"));
        let mut reader = png::Decoder::new(file).read_info().expect("a PNG");
        let mut pixels = vec![0; reader.output_buffer_size().expect("size")];
        reader.next_frame(&mut pixels).expect("pixels");
        let lit: Vec<usize> = (0..pixels.len()).filter(|&i| pixels[i] != 0).collect();
        let at = 3 * (64 * 4096 + 64);
        assert_eq!((lit, pixels[at]), (vec![at, at + 1, at + 2], 255));
    }

    /// The real binary, told to end in the middle of its work.
    #[test]
    fn what_is_told_to_end_leaves_nothing() {
        let folder = tempdir().expect("folder");
        let (cube, _) = sparse(folder.path(), 512, 640);
        for tile in 0..cube.grid().count() {
            let [column, row] = cube.grid().position(tile);
            let path = folder.path().join(format!("cube.zarr/samples/c/{row}/{column}"));
            fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            fs::write(path, 64u32.to_le_bytes()).expect("written");
        }
        fs::write(folder.path().join("s.csv"), "nm,a,b\n400,0,1\n500,1,1\n700,1,0\n").expect("written");
        let names = || {
            let mut names: Vec<String> = fs::read_dir(folder.path())
                .expect("list")
                .map(|entry| entry.expect("an entry").file_name().into_string().expect("UTF-8"))
                .collect();
            names.sort();
            names
        };
        for arguments in [
            &["export", "cube.zarr", "-o", "all.csv"][..],
            &["export", "cube.zarr", "-o", "all.zarr"],
            &["export", "cube.zarr", "-o", "all.exr"],
            &["export", "cube.zarr", "-o", "blocks", "--format", "csv", "--blocks", "100"],
            &["sensor", "cube.zarr", "--responses", "s.csv", "-o", "new.zarr"],
        ] {
            let mut command = command(folder.path(), arguments);
            let mut child = command.stderr(std::process::Stdio::null()).spawn().expect("started");
            // It has begun as soon as something lies aside.
            while !names().iter().any(|name| name.starts_with('.')) {
                assert!(child.try_wait().expect("a child").is_none(), "{arguments:?} ended by itself");
                std::thread::sleep(std::time::Duration::from_millis(2));
            }
            let told = Command::new("kill").arg(child.id().to_string()).status().expect("runs");
            assert!(told.success());
            assert_eq!(child.wait().expect("ends").code(), Some(143), "{arguments:?}");
            assert_eq!(names(), ["cube.zarr", "s.csv"], "{arguments:?}");
        }
        // The sensor, left to its work, holds a tile at a time.
        let peak = peak(folder.path(), &["sensor", "cube.zarr", "--responses", "s.csv", "-o", "new.zarr"]);
        assert!(peak <= 150 << 20, "{} MiB", peak >> 20);
    }

    /// A camera whose optics blur, on a sparse cube: the peak, bytes, of what is held, and the cube's size.
    fn peak_of_sensor(side: u32, channels: usize) -> (u64, u64) {
        let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).expect("folder");
        let (cube, bytes) = sparse(folder.path(), side, channels);
        for tile in 0..cube.grid().count() {
            let [column, row] = cube.grid().position(tile);
            let path = folder.path().join(format!("cube.zarr/samples/c/{row}/{column}"));
            fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            fs::write(path, 64u32.to_le_bytes()).expect("written");
        }
        let model = "[optics]\nf_number = 4\npsf = \"diffraction\"\n[detector]\npitch = 2e-6\nintegration_time = 1\n\
                     quantum_efficiency = 1\ngain = 1\nbits = 16\n";
        fs::write(folder.path().join("sensor.toml"), model).expect("written");
        let arguments =
            ["sensor", "cube.zarr", "--model", "sensor.toml", "-o", "s.zarr", "--noise", "off", "--electrons"];
        let peak = peak(folder.path(), &arguments);
        println!("sensor: {} MiB of a cube of {} MiB", peak >> 20, bytes >> 20);
        // The one pixel that shines does so in its neighbours too; how far, other tests say.
        let tile = fs::read(folder.path().join("s.zarr/electrons/c/0/1/1")).expect("a tile");
        let values: &[f32] = bytemuck::cast_slice(&tile);
        assert!(values[0] > values[1] && values[1] > 0.0, "{:?}", &values[..2]);
        (peak, bytes)
    }

    /// A store of 640 MiB, of which tiles, strips of planes and what the program itself needs are held.
    #[test]
    fn of_a_sensor_is_bounded() {
        let (peak, bytes) = peak_of_sensor(512, 640);
        assert!(peak <= 150 << 20 && bytes > 4 * (150 << 20), "{} MiB of {} MiB", peak >> 20, bytes >> 20);
    }

    #[test]
    #[ignore = "reads 20 GiB of holes: minutes"]
    fn of_a_sensor_on_twenty_gibibytes_is_below_500_mib() {
        let (peak, bytes) = peak_of_sensor(1040, 5000);
        assert!(peak <= 500 << 20 && bytes > 20 << 30, "{} MiB of {} MiB", peak >> 20, bytes >> 20);
    }

    #[test]
    #[ignore = "reads 20 GiB of holes: a minute"]
    fn of_a_sparse_cube_of_twenty_gibibytes_is_below_500_mib() {
        let formats: &[&[&str]] = &[
            &["-o", "bands.bsq", "--bands", "4990..5000"],
            &["-o", "lines.bil", "--bands", "4990..5000"],
            &["-o", "bands.zarr", "--bands", "400nm..402nm"],
            &["-o", "bands.exr", "--bands", "700nm..702nm"],
        ];
        bounded(1040, 5000, 500 << 20, formats);
    }
}
