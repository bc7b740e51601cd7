//! Cubes in other people's hands: notes among the attributes, arrays and metadata that others write, files that get lost,
//! copies, and cubes of version 1 of the layout.

use std::fs;
use std::path::{Path, PathBuf};

use crate::cube_files::{Files, files};
use crate::cubes::{Random, Written, create, header, pattern, unit};
use serde_json::{Value, json};
use spectile::cube::{Cube, Existing, Header, View, compare, integrate};
use spectile::export::{self, Format, Map, Shown};
use spectile::spectral::Response;
use spectile::{Error, Result};
use tempfile::{TempDir, tempdir};

/// Four tiles with two epochs of one sample each.
fn shape() -> Header {
    Header { epoch: 1, ..header([20, 12], [16, 8], 5) }.with_uncertainty()
}

fn rendered(folder: &Path) -> PathBuf {
    let cube = create(folder, "cube.zarr", shape());
    go_on(&cube, 2);
    cube.path().to_owned()
}

/// Merges what is missing until every tile has so many samples.
fn go_on(cube: &Written, samples: u32) {
    for tile in 0..cube.grid().count() {
        for n in cube.samples(tile).expect("samples")..samples {
            let value = |x: u32, y: u32, k: usize| pattern(x, y, k) * (n + 1) as f32;
            cube.merge_unit(tile, 1, &unit(cube, tile, value)).expect("merged");
        }
    }
}

fn edit(file: &Path, change: impl FnOnce(&mut Value)) {
    let mut value = serde_json::from_slice(&fs::read(file).expect("read")).expect("JSON");
    change(&mut value);
    fs::write(file, value.to_string()).expect("written");
}

fn read(file: &Path) -> Value {
    serde_json::from_slice(&fs::read(file).expect("read")).expect("JSON")
}

fn damage(path: &Path) -> Vec<String> {
    Cube::open(path).expect("opens").verify().expect("verified").damage
}

/// Chunks of all arrays.
fn chunks(path: &Path) -> Files {
    files(path, |name| !name.starts_with('.') && !name.ends_with("zarr.json"))
}

/// What others do to the metadata. None of it is damage, all of it can be gone on with, and it stays.
#[test]
fn what_others_write_forbids_nothing() {
    type Change = fn(&Path);
    let changes: [(&str, Change); 10] = [
        ("a note", |cube| edit(&cube.join("zarr.json"), |group| group["attributes"]["comment"] = json!("run 2"))),
        ("an attribute rewritten", |cube| {
            edit(&cube.join("zarr.json"), |group| group["attributes"]["title"] = json!("Figure 3"));
        }),
        ("all attributes gone", |cube| edit(&cube.join("zarr.json"), |group| group["attributes"] = json!({}))),
        ("no attributes at all", |cube| {
            edit(&cube.join("zarr.json"), |group| drop(group.as_object_mut().expect("a group").remove("attributes")));
        }),
        ("other spacing", |cube| edit(&cube.join("zarr.json"), |_| {})),
        ("no consolidated metadata", |cube| {
            edit(&cube.join("zarr.json"), |group| group["consolidated_metadata"] = Value::Null);
        }),
        ("attributes of an array", |cube| {
            edit(&cube.join("radiance/zarr.json"), |array| array["attributes"] = json!({ "checked": "by me" }));
        }),
        ("an array of their own, consolidated", |cube| {
            let mask = json!({ "node_type": "array", "zarr_format": 3, "shape": [1] });
            fs::create_dir(cube.join("mask")).expect("made");
            fs::write(cube.join("mask/zarr.json"), mask.to_string()).expect("written");
            edit(&cube.join("zarr.json"), |group| group["consolidated_metadata"]["metadata"]["mask"] = mask);
        }),
        ("coordinates in their own way", |cube| {
            edit(&cube.join("wavelength/zarr.json"), |array| array["codecs"] = json!([{ "name": "zstd" }]));
            fs::write(cube.join("wavelength/c/0"), b"compressed").expect("written");
        }),
        ("files that are no metadata", |cube| fs::write(cube.join("README.txt"), "ours").expect("written")),
    ];
    let folder = tempdir().expect("folder");
    let straight = create(folder.path(), "straight.zarr", shape());
    go_on(&straight, 3);
    let expected = chunks(straight.path());
    for (what, change) in changes {
        let folder = tempdir().expect("folder");
        let path = rendered(folder.path());
        let written = read(&path.join("zarr.json"));
        change(&path);
        assert_eq!(damage(&path), Vec::<String>::new(), "{what}");
        let cube = Cube::open(&path).expect(what);
        assert_eq!((cube.header(), cube.is_only_read()), (&shape(), None), "{what}");
        let theirs = files(&path, |name| ["README.txt", "mask/zarr.json", "wavelength/c/0"].contains(&name));
        go_on(&Written::open(&path, shape(), Existing::Resume).expect(what), 3);
        assert_eq!(damage(&path), Vec::<String>::new(), "{what}");
        let mut found = chunks(&path);
        for (name, bytes) in theirs {
            // Chunks that nobody rewrote are Spectile's.
            assert!(fs::read(path.join(&name)).expect(what) == bytes, "{what}: {name}");
            if !expected.contains_key(&name) || bytes == b"compressed" {
                found.insert(name.clone(), expected.get(&name).cloned().unwrap_or_default());
            }
        }
        found.retain(|name, _| expected.contains_key(name));
        assert!(found == expected, "{what}");
        // Their words stand, and Spectile's are there again.
        let group = read(&path.join("zarr.json"));
        for (name, value) in written["attributes"].as_object().expect("attributes") {
            assert!(name == "title" || group["attributes"][name] == *value, "{what}: {name}");
        }
        match what {
            "a note" => assert_eq!(group["attributes"]["comment"], "run 2"),
            "an attribute rewritten" => assert_eq!(group["attributes"]["title"], "Figure 3"),
            "attributes of an array" => {
                let array = read(&path.join("radiance/zarr.json"));
                assert_eq!(array["attributes"]["checked"], "by me");
                assert_eq!(array["attributes"]["units"], "W m-2 sr-1 nm-1");
            }
            "an array of their own, consolidated" => {
                assert_eq!(group["consolidated_metadata"]["metadata"]["mask"]["shape"], json!([1]));
            }
            _ => {}
        }
    }
}

/// What is gone or broken of Spectile's own is damage, and put back from its record; and the record from the metadata.
#[test]
fn what_is_written_once_is_put_back() {
    type Spoil = fn(&Path);
    let gone = |file: &Path| fs::remove_file(file).expect("removed");
    let flip = |file: &Path| {
        let mut bytes = fs::read(file).expect("read");
        let last = bytes.len() - 2;
        bytes[last] ^= 1;
        fs::write(file, bytes).expect("written");
    };
    let order = |file: &Path| {
        edit(file, |array| array["codecs"][0]["configuration"]["order"] = json!([1, 2, 0]));
    };
    let whole = {
        let folder = tempdir().expect("folder");
        files(&rendered(folder.path()), |_| true)
    };
    let spoils: [(&str, Spoil, &str); 11] = [
        ("zarr.json", gone, "is not what was written"),
        ("zarr.json", flip, "is not what was written"),
        ("radiance/zarr.json", gone, "is not what was written"),
        ("radiance/zarr.json", flip, "is not what was written"),
        ("radiance/zarr.json", order, "describes another layout"),
        ("overview/zarr.json", order, "describes another layout"),
        ("wavelength/zarr.json", gone, "is not what was written"),
        ("wavelength/c/0", flip, "is not what was written"),
        ("wavelength_bounds/c/0/0", gone, "is not what was written"),
        ("y/c/0", |file| fs::write(file, []).expect("written"), "is not what was written"),
        (".spectile/cube.json", flip, "is not what was written"),
    ];
    for (name, spoil, words) in spoils {
        let folder = tempdir().expect("folder");
        let path = rendered(folder.path());
        spoil(&path.join(name));
        let found = damage(&path);
        assert!(found.len() == 1 && found[0].starts_with(name) && found[0].contains(words), "{name}: {found:?}");
        drop(Written::open(&path, shape(), Existing::Resume).expect(name));
        assert_eq!(damage(&path), Vec::<String>::new(), "{name}");
        let now = files(&path, |name| !name.contains("lock"));
        for (file, bytes) in &whole {
            let is_of_run = file.contains("journal") || file.contains("lock");
            assert!(is_of_run || now.get(file) == Some(bytes), "{name}: {file}");
        }
    }
    // Others' arrays are not hidden by metadata that are consolidated anew.
    let folder = tempdir().expect("folder");
    let path = rendered(folder.path());
    fs::create_dir_all(path.join("analysis/mask/c")).expect("made");
    fs::write(path.join("analysis/zarr.json"), r#"{"node_type": "group"}"#).expect("written");
    fs::write(path.join("analysis/mask/zarr.json"), r#"{"node_type": "array"}"#).expect("written");
    fs::remove_file(path.join("zarr.json")).expect("removed");
    drop(Written::open(&path, shape(), Existing::Resume).expect("opens"));
    let metadata = &read(&path.join("zarr.json"))["consolidated_metadata"]["metadata"];
    assert_eq!(metadata["analysis/mask"], json!({ "node_type": "array" }));
    assert_eq!(metadata["radiance"]["shape"], json!([5, 12, 20]));
}

/// What would make other numbers of a cube is refused by who takes its numbers, in place as in a copy, and by its name.
#[test]
fn other_meanings_are_refused_by_name() {
    type Change = fn(&Path);
    const RADIANCE: &str = "radiance/zarr.json";
    let both = |cube: &Path, name: &str, value: Value| {
        edit(&cube.join(RADIANCE), |array| array["attributes"][name] = value.clone());
        edit(&cube.join("zarr.json"), |group| {
            group["consolidated_metadata"]["metadata"]["radiance"]["attributes"][name] = value;
        });
    };
    type ChangeOf = fn(&Path, &dyn Fn(&Path, &str, Value));
    let cases: [(&str, ChangeOf); 8] = [
        ("the units `W m-2 sr-1 um-1`", |cube, both| both(cube, "units", json!("W m-2 sr-1 um-1"))),
        ("a `scale_factor` of 2.0", |cube, both| both(cube, "scale_factor", json!(2.0))),
        ("a `gain` of 2.0", |cube, both| both(cube, "gain", json!(2.0))),
        ("a `slope` of 0.5", |cube, both| both(cube, "slope", json!(0.5))),
        ("a `missing_value` of 1.0", |cube, both| both(cube, "missing_value", json!(1.0))),
        ("a `valid_max` of 1.0", |cube, both| both(cube, "valid_max", json!(1.0))),
        ("a `_FillValue` of 0.0", |cube, both| both(cube, "_FillValue", json!(0.0))),
        ("somebody has changed `wavelength`", |cube, _| {
            let file = cube.join("wavelength/c/0");
            let mut bytes = fs::read(&file).expect("read");
            bytes[..8].copy_from_slice(&401.0f64.to_le_bytes());
            fs::write(file, bytes).expect("written");
        }),
    ];
    let nothing: Change = |_| {};
    let copy: Change = |cube| fs::remove_dir_all(cube.join(".spectile")).expect("removed");
    for (words, change) in cases {
        for after in [nothing, copy] {
            let folder = tempdir().expect("folder");
            let path = rendered(folder.path());
            change(&path, &both);
            after(&path);
            let error = Cube::open_to_read(&path).map(|_| ()).expect_err(words).to_string();
            assert!(error.contains(words), "{words}: {error}");
        }
    }
    // What xarray adds, and words, change nothing.
    let folder = tempdir().expect("folder");
    let path = rendered(folder.path());
    for (name, value) in
        [("_FillValue", json!("AAAAAAAA+H8=")), ("comment", json!("x 2")), ("scale_factor", json!(1.0))]
    {
        both(&path, name, value);
    }
    Cube::open_to_read(&path).expect("as it was");
}

/// A bit that flips in the record is noticed, whatever it is.
#[test]
fn the_record_is_checked() {
    let folder = tempdir().expect("folder");
    let path = rendered(folder.path());
    let record = path.join(".spectile/cube.json");
    let whole = fs::read(&record).expect("read");
    let mut random = Random(5);
    for _ in 0..200 {
        let mut bytes = whole.clone();
        let at = (random.uniform() * bytes.len() as f64) as usize;
        bytes[at] ^= 1 << (random.uniform() * 8.0) as u32;
        fs::write(&record, &bytes).expect("written");
        let cube = Cube::open(&path).expect("opens by its metadata");
        assert_eq!(cube.header(), &shape(), "byte {at}");
    }
}

/// Everything that reads a cube, by name.
fn readers(path: &Path, to: &TempDir) -> Vec<(&'static str, Result<()>)> {
    let open = || Cube::open(path).expect("opens");
    let fresh = |name: &str| {
        let target = to.path().join(name);
        let _ = fs::remove_dir_all(&target);
        target
    };
    let export = |format: Format, name: &str| {
        export::write(&View::whole(&open()), &fresh(name), format, &mut |_, _| Ok(())).map(drop)
    };
    let picture = |shown: Shown| {
        export::write_png(&View::whole(&open()), &fresh("a.png"), &shown, None, &mut |_, _| Ok(())).map(drop)
    };
    let response = Response::new(vec![380.0, 780.0], vec![1.0, 1.0]).expect("a response");
    let envi = Format::Envi { interleave: spectile::format::envi::Interleave::Bil };
    vec![
        ("envi", export(envi, "a.img")),
        ("exr", export(Format::Exr { strict_units: false, split: None }, "a.exr")),
        ("zarr", export(Format::Zarr { shards: true }, "a.zarr")),
        ("csv", export(Format::Csv, "a.csv")),
        ("a map", picture(Shown::Map(Map::Radiance))),
        ("the sensor", {
            let named = [("a".to_owned(), response)];
            integrate(&open(), &named, "a", &fresh("s.zarr"), Existing::Refuse, &mut |_, _| Ok(())).map(drop)
        }),
        ("compare", compare(&open(), &open()).map(drop)),
        ("a pixel", open().spectrum(1, 1).map(drop)),
        ("a region", open().state().region(open().grid().whole()).map(drop)),
        ("one channel", open().state().channels(&[2], open().grid().whole(), 1).map(drop)),
    ]
}

/// A file that is gone although its tile was rendered: whoever reads it says so, with exit code 5.
#[test]
fn files_that_are_gone_are_not_passed_over() {
    let to = tempdir().expect("folder");
    for copy in [false, true] {
        let folder = tempdir().expect("folder");
        let path = rendered(folder.path());
        if copy {
            fs::remove_dir_all(path.join(".spectile")).expect("removed");
        }
        assert!(readers(&path, &to).iter().all(|(_, result)| result.is_ok()));
        let is_lost = |result: &Result<()>, name: &str| matches!(result, Err(Error::Storage { path, what }) if path.ends_with(name) && what.contains("is missing, although"));
        let without = |name: &str, check: &dyn Fn()| {
            let (file, aside) = (path.join(name), folder.path().join("aside"));
            fs::rename(&file, &aside).expect("moved");
            check();
            let cube = Cube::open(&path).expect("opens");
            assert!(is_lost(&cube.check_files(0), name), "{name}: {:?}", cube.check_files(0));
            fs::rename(aside, file).expect("back");
        };
        let radiance = "radiance/c/0/0/0";
        without(radiance, &|| {
            for (reader, result) in readers(&path, &to) {
                assert!(is_lost(&result, radiance), "{reader}: {result:?}");
                assert_eq!(result.unwrap_err().exit_code(), 5);
            }
            let left =
                fs::read_dir(to.path()).expect("list").flat_map(|e| e.expect("an entry").file_name().into_string());
            assert!(left.into_iter().all(|name| !name.starts_with('.')), "nothing half-made stays");
            let cube = Cube::open(&path).expect("opens");
            assert_eq!(cube.lost(&cube.all_samples().expect("samples")), std::slice::from_ref(&(0..1)));
            assert!(cube.spectrum(17, 9).expect("another tile").is_some());
        });
        without("preview/c/0/0/0", &|| {
            let cube = Cube::open(&path).expect("opens");
            assert!(is_lost(&cube.preview().map(drop), "preview/c/0/0/0"));
        });
        without("overview/c/0/0/0", &|| {
            let cube = Cube::open(&path).expect("opens");
            assert!(is_lost(&cube.state().colour(cube.grid().whole(), 8).map(drop), "overview/c/0/0/0"));
        });
        without("standard_error/c/0/0/0", &|| {
            let cube = Cube::open(&path).expect("opens");
            assert!(is_lost(&cube.standard_error(0, 0).map(drop), "standard_error/c/0/0/0"));
        });
        // The samples themselves are missed by the journal, or in a copy by the radiance.
        without("samples/c/0/0", &|| {
            let cube = Cube::open(&path).expect("opens");
            assert!(is_lost(&cube.all_samples().map(drop), "samples/c/0/0"));
        });
        // A tile that nobody has rendered is none that is lost.
        for array in ["radiance/c/0", "standard_error/c/0", "overview/c/0", "samples/c"] {
            fs::remove_file(path.join(format!("{array}/1/1"))).expect("removed");
        }
        fs::remove_file(path.join("preview/c/1/1/0")).expect("removed");
        if !copy {
            fs::remove_file(path.join(".spectile/journal/3")).expect("removed");
        }
        let cube = Cube::open(&path).expect("opens");
        assert!(cube.spectrum(17, 9).expect("read").is_none() && cube.check_files(3).is_ok());
    }
}

/// A copy without `.spectile` is read by everything and gone on with by nothing.
#[test]
fn copies_are_read_only() {
    let folder = tempdir().expect("folder");
    let path = rendered(folder.path());
    let original = Cube::open(&path).expect("opens");
    let (header, estimate) = (original.header().clone(), original.spectrum(3, 4).expect("read"));
    for part in [".spectile/journal", ".spectile/cube.json", ".spectile"] {
        if path.join(part).is_dir() {
            fs::remove_dir_all(path.join(part)).expect("removed");
        } else {
            fs::remove_file(path.join(part)).expect("removed");
        }
        let cube = Cube::open(&path).expect("opens");
        assert_eq!(cube.header(), &header, "{part}");
        assert_eq!(cube.spectrum(3, 4).expect("read"), estimate);
        assert!(
            cube.error_estimate().expect("none").iter().all(|v| v.is_nan()) && cube.runs().expect("none").is_empty()
        );
        assert!(cube.is_only_read().expect("a reason").contains("a copy without .spectile"));
        let verified = cube.verify().unwrap_err();
        assert!(
            verified.exit_code() == 2 && verified.to_string().contains("is a copy without .spectile"),
            "{verified}"
        );
        let error = Written::open(&path, shape(), Existing::Resume).err().expect("refused");
        let message = error.to_string();
        assert_eq!(error.exit_code(), 2, "{message}");
        assert!(message.contains("a copy without .spectile") && message.contains("render the scene into a new cube"));
    }
    assert!(!path.join(".spectile").exists(), "nothing was made");
}

/// Cubes of version 1, in another order of pixels, are read by everything and gone on with by nothing. This one was made by
/// the program of then, which also wrote down what is in it.
#[test]
fn cubes_of_version_1_are_read_only() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let cube = Cube::open(&data.join("cube-of-version-1.zarr")).expect("opens");
    assert_eq!((cube.header().size, cube.header().tile), ([20, 12], [8, 8]));
    let table = |name: &str| -> Vec<Vec<f32>> {
        let text = fs::read_to_string(data.join(name)).expect("a table");
        let row = |line: &str| line.split(',').skip(2).map(|cell| cell.parse().expect("a number")).collect();
        text.lines().skip(1).map(row).collect()
    };
    let (values, errors) = (table("cube-of-version-1.csv"), table("cube-of-version-1.errors.csv"));
    for (i, (values, errors)) in values.iter().zip(&errors).enumerate() {
        let (x, y) = (i as u32 % 20, i as u32 / 20);
        assert_eq!(cube.spectrum(x, y).expect("read").as_ref(), Some(values), "{x} {y}");
        assert_eq!(cube.standard_error(x, y).expect("read").as_ref(), Some(errors), "{x} {y}");
    }
    // Means of 8 x 8 pixels, which lie otherwise in the file too.
    let means = cube.state().channels(&[4, 1], cube.grid().whole(), 8).expect("read");
    assert_eq!((means.size, means.planes), ([3, 2], 2));
    for (block, mean) in means.values.chunks(2).enumerate() {
        let (x0, y0) = (block % 3 * 8, block / 3 * 8);
        let pixels: Vec<usize> =
            (y0..(y0 + 8).min(12)).flat_map(|y| (x0..(x0 + 8).min(20)).map(move |x| y * 20 + x)).collect();
        for (&got, k) in mean.iter().zip([4, 1]) {
            let sum: f64 = pixels.iter().map(|&i| f64::from(values[i][k])).sum();
            let expected = sum / pixels.len() as f64;
            assert!((f64::from(got) / expected - 1.0).abs() < 1e-6, "{block} {k}: {got} {expected}");
        }
    }
    assert!(readers(cube.path(), &tempdir().expect("folder")).iter().all(|(_, result)| result.is_ok()));
    assert_eq!(cube.error_estimate().expect("estimate").iter().filter(|e| e.is_finite()).count(), 5);
    assert_eq!(cube.verify().expect("verified").damage, Vec::<String>::new());
    let error = Written::open(cube.path(), cube.header().clone(), Existing::Resume).err().expect("refused");
    let message = error.to_string();
    assert_eq!(error.exit_code(), 2, "{message}");
    assert!(message.contains("version 1") && message.contains("render the scene into a new cube"), "{message}");
    // It compares with a cube of now as with itself.
    let folder = tempdir().expect("folder");
    let header = Header { tile: [20, 12], ..cube.header().clone() };
    let now = create(folder.path(), "now.zarr", header);
    now.merge_unit(0, 64, &unit(&now, 0, |x, y, k| values[(y * 20 + x) as usize][k])).expect("merged");
    let comparison = compare(&cube, &now).expect("compared");
    assert!(comparison.channels.iter().all(|channel| channel.rmse == 0.0) && comparison.pixels == 240);
}

/// Attributes are what netCDF can hold: numbers, texts, and lists of them.
#[test]
fn attributes_are_plain() {
    let folder = tempdir().expect("folder");
    let path = rendered(folder.path());
    let is_plain = |value: &Value| match value {
        Value::Number(_) | Value::String(_) => true,
        Value::Array(items) => !items.is_empty() && items.iter().all(|item| item.is_number() || item.is_string()),
        _ => false,
    };
    let response = Response::new(vec![380.0, 780.0], vec![1.0, 1.0]).expect("a response");
    let sensor = folder.path().join("s.zarr");
    let cube = Cube::open(&path).expect("opens");
    integrate(&cube, &[("a".into(), response)], "a", &sensor, Existing::Refuse, &mut |_, _| Ok(())).expect("made");
    let exported = folder.path().join("e.zarr");
    export::write(&View::whole(&cube), &exported, Format::Zarr { shards: false }, &mut |_, _| Ok(())).expect("written");
    for store in [&path, &sensor, &exported] {
        for (name, bytes) in files(store, |name| name.ends_with("zarr.json")) {
            let metadata: Value = serde_json::from_slice(&bytes).expect("JSON");
            for (key, value) in metadata["attributes"].as_object().expect("attributes") {
                assert!(is_plain(value), "{} {name}: {key} is {value}", store.display());
            }
        }
    }
    // Without its record the cube is the same.
    fs::remove_dir_all(sensor.join(".spectile")).expect("removed");
    let made = Cube::open(&sensor).expect("opens");
    assert_eq!(made.channels().responses.len(), 1);
    assert!(made.is_derived() && made.header().attributes["derived"].is_object());
}
