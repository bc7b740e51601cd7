//! `spectile sensor`, X, Y, Z and pictures of them, through the real binary, against numpy and colour-science
//! (SPECTILE_PYTHON), and closed forms.

use std::fs;
use std::path::Path;

use spectile::cube::{Cube, Header};
use spectile::spectral::{Channels, planck};
use tempfile::tempdir;

use crate::binary::run;
use crate::cubes::{Written, create, header, unit};
use crate::outside::{python, shared};
use crate::size;

/// Stdout and stderr of a run that must succeed.
fn success(folder: &Path, arguments: &[&str]) -> (String, String) {
    let output = run(folder, arguments);
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    (text(&output.stdout), text(&output.stderr))
}

/// integrate.py with these arguments, where there is a Python to run it.
fn integrate(folder: &Path, arguments: &[&str]) {
    let Some(mut command) = python("integrate.py") else { return };
    let output = command.current_dir(folder).args(arguments).output().expect("runs");
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

/// Spectra that vary smoothly by channel and pixel, but for one tile that is not rendered.
fn smooth(folder: &Path, channels: Channels) -> Written {
    let shape = Header { channels: channels.clone(), ..header([20, 13], [8, 8], 1) };
    let cube = create(folder, "cube.zarr", shape);
    for tile in (0..cube.grid().count()).filter(|&tile| tile != 4) {
        let value = |x: u32, y: u32, k: usize| {
            let u = (channels.centre(k) / 900.0).ln();
            (1.0 + 0.3 * (f64::from(x) + 2.0 * u).sin() + 0.01 * f64::from(y)) as f32
        };
        cube.merge_unit(tile, 1, &unit(&cube, tile, value)).expect("merged");
    }
    cube
}

#[test]
fn every_sensor_of_the_data_pack_works_as_it_is() {
    let reflective = Channels::equal(300.0, 2600.0, 2300);
    let thermal = Channels::equal(2400.0, 15_100.0, 1270);
    let sensors = [
        ("rsr_sentinel2a_msi.csv", &reflective, 13, ""),
        ("rsr_landsat8_oli_tirs.csv", &thermal, 2, "negative values"),
        ("camera_nikon_5100_npl.csv", &reflective, 3, ""),
        ("rsr_landsat8_oli_tirs.csv", &reflective, 9, "negative values"),
        ("rsr_terra_aster.csv", &reflective, 10, ""),
        ("rsr_terra_modis_1-16.csv", &reflective, 16, ""),
        ("camera_sigma_sdmerill_npl.csv", &reflective, 3, ""),
        ("bands_ir_SYNTHETIC_2.5-15um.csv", &thermal, 4, ""),
    ];
    for (file, channels, bands, warned) in size::first(3, sensors) {
        let Some(responses) = shared(&format!("sensor/{file}")) else { return };
        let folder = tempdir().expect("folder");
        let cube = smooth(folder.path(), channels.clone());
        let responses = responses.to_str().expect("a name");
        let (said, warnings) =
            success(folder.path(), &["sensor", "cube.zarr", "--responses", responses, "-o", "s.zarr"]);
        println!("{file}: {said}{warnings}");
        assert!(warnings.contains(warned), "{file}: {warnings}");
        assert!(!warnings.contains("too wide"), "{file}: {warnings}");
        let made = Cube::open(&folder.path().join("s.zarr")).expect("a cube");
        assert!(made.channels().len() >= bands, "{file}: {said} {warnings}");
        // Tiles that are not there are not there.
        assert_eq!((made.samples(4).ok(), made.samples(5).ok()), (Some(0), Some(1)));
        assert_eq!(made.grid(), cube.grid());
        let (info, _) = success(folder.path(), &["info", "s.zarr", "--verify"]);
        assert!(info.contains("0 damaged") && info.contains("unknown: made of the channels"), "{info}");
        integrate(folder.path(), &["sensor", "cube.zarr", responses, "s.zarr"]);
    }
}

/// A triangular response over channels as wide as itself: the error that is told is the one that is made.
#[test]
fn channels_too_wide_are_told_with_their_error() {
    let folder = tempdir().expect("folder");
    let channels = Channels::equal(400.0, 700.0, 6);
    let shape = Header { channels: channels.clone(), ..header([8, 8], [8, 8], 1) };
    let cube = create(folder.path(), "cube.zarr", shape);
    // L = λ - 350 nm, whose mean over a channel is its value at the middle.
    let line = |nm: f64| nm - 350.0;
    cube.merge_unit(0, 1, &unit(&cube, 0, |_, _, k| line(channels.centre(k)) as f32)).expect("merged");
    fs::write(folder.path().join("s.csv"), "nm,a\n505,0\n510,1\n515,0\n").expect("written");
    let (_, warnings) = success(folder.path(), &["sensor", "cube.zarr", "--responses", "s.csv", "-o", "s.zarr"]);
    // Seen: the mean of 500-550, 175; true: 160 at 510 nm. The slope is known exactly, so the estimate is.
    let expected = 100.0 * (525.0 - 510.0) / 175.0;
    assert!(warnings.contains("too wide") && warnings.contains(&format!("a ({expected:.2} %)")), "{warnings}");
    let made = Cube::open(&folder.path().join("s.zarr")).expect("a cube");
    assert_eq!(made.spectrum(3, 3).expect("read").expect("there"), [175.0]);
    // Without neighbours nothing is known of the slope, which is told too.
    let folder = tempdir().expect("folder");
    let cube = create(
        folder.path(),
        "cube.zarr",
        Header { channels: Channels::equal(500.0, 550.0, 1), ..header([8, 8], [8, 8], 1) },
    );
    cube.merge_unit(0, 1, &unit(&cube, 0, |_, _, _| 1.0)).expect("merged");
    fs::write(folder.path().join("s.csv"), "nm,a\n505,0\n510,1\n515,0\n").expect("written");
    let (_, warnings) = success(folder.path(), &["sensor", "cube.zarr", "--responses", "s.csv", "-o", "s.zarr"]);
    assert!(warnings.contains("a (unknown"), "{warnings}");
}

#[test]
fn what_cannot_be_integrated_is_refused() {
    let folder = tempdir().expect("folder");
    smooth(folder.path(), Channels::equal(400.0, 500.0, 10));
    let write = |text: &str| fs::write(folder.path().join("s.csv"), text).expect("written");
    let refused = |arguments: &[&str], words: &str| {
        let output = run(folder.path(), &[&["sensor", "cube.zarr", "--responses", "s.csv", "-o"], arguments].concat());
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert!(stderr.contains(words), "{arguments:?}: {stderr}");
    };
    refused(&["s.zarr"], "s.csv: cannot be read");
    write("nm,a\n450,1\n460,x\n");
    refused(&["s.zarr"], "s.csv:3: `x`");
    write("nm,a\n480,1\n560,1\n");
    refused(&["s.zarr"], "25.0 % of the response at most");
    write("nm,a\n450,0\n460,1\n470,0\n");
    refused(&["cube.zarr"], "into itself");
    success(folder.path(), &["sensor", "cube.zarr", "--responses", "s.csv", "-o", "s.zarr"]);
    refused(&["s.zarr"], "exists already");
    success(folder.path(), &["sensor", "cube.zarr", "--responses", "s.csv", "-o", "s.zarr", "--overwrite"]);
    let output = run(folder.path(), &["sensor", "s.zarr", "--responses", "s.csv", "-o", "t.zarr"]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("weighted by responses already"));
}

#[test]
fn xyz_of_every_observer_is_that_of_colour_science() {
    let folder = tempdir().expect("folder");
    // Channels of 2.37 nm that begin and end where no table does.
    smooth(folder.path(), Channels::equal(358.7, 832.3, 200));
    for observer in ["1931", "1964", "2015"] {
        let file = format!("xyz{observer}.zarr");
        success(folder.path(), &["export", "cube.zarr", "-o", &file, "--xyz", observer]);
        if observer == "1931" {
            success(folder.path(), &["export", "cube.zarr", "-o", "xyz.csv", "--xyz"]);
            let table = fs::read_to_string(folder.path().join("xyz.csv")).expect("written");
            assert!(table.starts_with("x,y,X,Y,Z\n"), "{table:.20}");
        }
        integrate(folder.path(), &["xyz", "cube.zarr", observer, &file]);
    }
}

/// A wall of black bodies from 250 to 375 K, as temperatures and in a colour map.
#[test]
fn temperatures_of_black_bodies_come_back() {
    let folder = tempdir().expect("folder");
    let channels = Channels::equal(8e3, 14e3, 60);
    let kelvin = |x: u32, y: u32| 250.0 + f64::from(x) * 6.0 + f64::from(y);
    let cube = create(folder.path(), "cube.zarr", Header { channels: channels.clone(), ..header([20, 8], [8, 8], 1) });
    for tile in 0..cube.grid().count() {
        let mean = |x: u32, y: u32, k: usize| {
            // 20 points of the midpoint rule over 100 nm at 10 um.
            let [from, to] = channels.bounds[k];
            let nm = |i: u32| from + (to - from) * (f64::from(i) + 0.5) / 20.0;
            ((0..20).map(|i| planck::radiance(nm(i), kelvin(x, y))).sum::<f64>() / 20.0) as f32
        };
        cube.merge_unit(tile, 1, &unit(&cube, tile, mean)).expect("merged");
    }
    success(folder.path(), &["export", "cube.zarr", "-o", "t.csv", "--temperature", "--bands", "8um..9um"]);
    let table = fs::read_to_string(folder.path().join("t.csv")).expect("written");
    for line in table.lines().skip(1) {
        let numbers: Vec<f64> = line.split(',').map(|cell| cell.parse().expect("a number")).collect();
        assert_eq!(numbers.len(), 12);
        let expected = kelvin(numbers[0] as u32, numbers[1] as u32);
        for got in &numbers[2..] {
            // f32 radiance: 6e-8 of it is 6e-8 T / (c2 / (λ T)) = 3e-6 K.
            assert!((got - expected).abs() < 1e-4, "{line}: {expected}");
        }
    }
    let (said, _) = success(
        folder.path(),
        &["export", "cube.zarr", "-o", "t.png", "--temperature", "--bands", "8um..14um", "--range", "250..371"],
    );
    assert!(
        said.contains("brightness temperature of 60 bands") && said.contains("250.000000 to 371.000000 K"),
        "{said}"
    );
    let (said, _) = success(folder.path(), &["export", "cube.zarr", "-o", "t.png", "--temperature", "--json"]);
    let done: serde_json::Value = serde_json::from_str(&said).expect("JSON");
    let range: Vec<f64> = done["range"].as_array().expect("a range").iter().map(|v| v.as_f64().expect("K")).collect();
    // The 1st and the 99th percentile of 160 pixels: the second and the 158th.
    let mut all: Vec<f64> = (0..20).flat_map(|x| (0..8).map(move |y| (x, y))).map(|(x, y)| kelvin(x, y)).collect();
    all.sort_by(f64::total_cmp);
    assert!((range[0] - all[1]).abs() < 1e-3 && (range[1] - all[157]).abs() < 1e-3, "{range:?}");
    // From dark to bright.
    let file = std::io::BufReader::new(fs::File::open(folder.path().join("t.png")).expect("opens"));
    let mut reader = png::Decoder::new(file).read_info().expect("a PNG");
    let mut pixels = vec![0; reader.output_buffer_size().expect("size")];
    reader.next_frame(&mut pixels).expect("pixels");
    let light = |x: usize| pixels[3 * x..3 * x + 3].iter().map(|&b| u32::from(b)).sum::<u32>();
    assert!((1..20).all(|x| light(x) >= light(x - 1)) && light(19) > light(0) + 300);
}

#[test]
fn chosen_bands_are_shown_in_false_colours() {
    let folder = tempdir().expect("folder");
    let cube = create(folder.path(), "cube.zarr", header([8, 8], [8, 8], 4));
    cube.merge_unit(0, 1, &unit(&cube, 0, |x, _, k| if k == 2 { 1.0 } else { x as f32 / 8.0 })).expect("merged");
    let pixels = |file: &str| {
        let file = std::io::BufReader::new(fs::File::open(folder.path().join(file)).expect("opens"));
        let mut reader = png::Decoder::new(file).read_info().expect("a PNG");
        let mut pixels = vec![0; reader.output_buffer_size().expect("size")];
        reader.next_frame(&mut pixels).expect("pixels");
        pixels
    };
    let (said, _) = success(
        folder.path(),
        &["export", "cube.zarr", "-o", "f.png", "--bands", "630nm,1,2", "--crop", "0,0,4,2", "--exposure", "0"],
    );
    assert!(said.contains("4 x 2 pixels") && said.contains("630.000 nm as red, 530.000 nm as green"), "{said}");
    // sRGB of 0, 1/8, 2/8, 3/8 (IEC 61966-2-1): 0, 99, 137, 165.
    let row = [255, 0, 255, 255, 99, 255, 255, 137, 255, 255, 165, 255];
    assert_eq!(pixels("f.png"), [row, row].concat());
    success(
        folder.path(),
        &["export", "cube.zarr", "-o", "g.png", "--bands", "1", "--exposure", "0", "--crop", "1,0,3,1"],
    );
    assert_eq!(pixels("g.png"), [99, 99, 99, 137, 137, 137]);
    // Channels of 100 nm, integrated: 12.5 and 25 W m-2 sr-1.
    let integrated = ["--integrated", "--bands", "1", "--crop", "1,0,3,1"];
    success(
        folder.path(),
        &[&["export", "cube.zarr", "-o", "i.png", "--exposure", "-4.643856"], &integrated[..]].concat(),
    );
    // 25 / 25 is white, and half of it 188.
    assert_eq!(pixels("i.png"), [188, 188, 188, 255, 255, 255]);
    let map = ["export", "cube.zarr", "-o", "m.png", "--colour-map", "--json"];
    let (said, _) = success(folder.path(), &[&map, &integrated[..]].concat());
    let done: serde_json::Value = serde_json::from_str(&said).expect("JSON");
    // Both percentiles of two pixels are the smaller one.
    assert_eq!((&done["range"], &done["range_units"]), (&serde_json::json!([12.5, 12.5]), &"W m-2 sr-1".into()));
    for (arguments, words) in [
        (vec!["--bands", "1,2"], "one band or three"),
        (vec!["--integrated"], "--integrated goes with --bands or --colour-map"),
        (vec!["--bands", "1", "--range", "0..1"], "--range goes with"),
        (vec!["--colour-map", "--exposure", "1"], "--exposure means nothing"),
    ] {
        let output = run(folder.path(), &[&["export", "cube.zarr", "-o", "x.png"], &arguments[..]].concat());
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && stderr.contains(words), "{stderr}");
    }
}
