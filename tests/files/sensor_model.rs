//! `spectile sensor --model` through the real binary: counts as they lie in the store, by seed and not by tile or thread.

use std::fs;
use std::path::Path;

use spectile::Error;
use spectile::cube::Header;
use spectile::scene::{Seen, load_sensor};
use spectile::sensor::{Bands, Electronics, Figures};
use spectile::spectral::{Channels, planck};
use tempfile::tempdir;

use crate::binary::{repository, run};
use crate::cubes::{create, header, unit};
use crate::outside::python;

const SIZE: [u32; 2] = [20, 13];

const MODEL: &str = "
[optics]
f_number = 2
[detector]
pitch = 10e-6
integration_time = 0.01
quantum_efficiency = 0.5
read_noise = 10
gain = 2
offset = 50
prnu = 0.01
dsnu = 5
bits = 12
[[bands]]
name = \"blue\"
from = 400
to = 500
[[bands]]
name = \"red\"
from = 600
to = 700
";

/// A ramp of radiance, in tiles of this size; without the tile `missing`.
fn cube(folder: &Path, name: &str, tile: [u32; 2], missing: Option<u32>) {
    let cube = create(folder, name, Header { channels: Channels::equal(400.0, 700.0, 30), ..header(SIZE, tile, 1) });
    for tile in (0..cube.grid().count()).filter(|tile| Some(*tile) != missing) {
        let value = |x: u32, y: u32, k: usize| 1e-5 * (1.0 + f64::from(x + 20 * y) + k as f64) as f32;
        cube.merge_unit(tile, 1, &unit(&cube, tile, value)).expect("merged");
    }
}

/// The array `counts` of a store whose tiles have this size: [band][y][x].
fn counts(store: &Path, [width, height]: [u32; 2]) -> Vec<u16> {
    let [columns, rows] = SIZE;
    let mut found = vec![0; (2 * columns * rows) as usize];
    for (row, column) in (0..rows.div_ceil(height)).flat_map(|r| (0..columns.div_ceil(width)).map(move |c| (r, c))) {
        let Ok(bytes) = fs::read(store.join(format!("counts/c/0/{row}/{column}"))) else { continue };
        assert_eq!(bytes.len() as u32, 2 * width * height * 2);
        for (i, pair) in (0..).zip(bytes.chunks_exact(2)) {
            let (band, y, x) = (i / (width * height), row * height + i / width % height, column * width + i % width);
            if x < columns && y < rows {
                found[((band * rows + y) * columns + x) as usize] = u16::from_le_bytes([pair[0], pair[1]]);
            }
        }
    }
    found
}

#[test]
fn counts_depend_on_the_seed_and_on_no_tile() {
    let folder = tempdir().expect("folder");
    let path = folder.path();
    fs::write(path.join("sensor.toml"), MODEL).expect("written");
    cube(path, "small.zarr", [8, 8], None);
    cube(path, "whole.zarr", SIZE, None);
    let expose = |cube: &str, out: &str, more: &[&str]| {
        let output = run(path, &[&["sensor", cube, "--model", "sensor.toml", "-o", out], more].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let said = expose("small.zarr", "a.zarr", &["--seed", "1", "--electrons"]);
    assert!(said.contains("blue: SNR") && said.contains("red: SNR") && !said.contains("NETD"), "{said}");
    expose("whole.zarr", "b.zarr", &["--seed", "1"]);
    expose("whole.zarr", "c.zarr", &["--seed", "2"]);
    expose("whole.zarr", "d.zarr", &["--noise", "off"]);
    let [a, b] = [("a.zarr", [8, 8]), ("b.zarr", SIZE)].map(|(name, tile)| counts(&path.join(name), tile));
    assert_eq!(a, b);
    assert_ne!(b, counts(&path.join("c.zarr"), SIZE));
    // Without noise a count is offset + electrons / gain, rounded, with π τ L A t / (4 N²) QE Δ(λ²) / 2hc electrons.
    let plain = counts(&path.join("d.zarr"), SIZE);
    let per_radiance = std::f64::consts::PI / 16.0 * 1e-10 * 0.01 * 0.5 * 1e-9 / (6.626_070_15e-34 * 299_792_458.0);
    for (band, first) in [(0usize, 0usize), (1, 20)] {
        for (x, y) in [(0u32, 0u32), (7, 3), (19, 12)] {
            let of = |k: usize| {
                let radiance = f64::from(1e-5 * (1.0 + f64::from(x + 20 * y) + k as f64) as f32);
                let [from, to] = [400.0 + 10.0 * k as f64, 410.0 + 10.0 * k as f64];
                radiance * 0.5 * (to * to - from * from)
            };
            let expected = 50.0 + per_radiance * (first..first + 10).map(of).sum::<f64>() / 2.0;
            let found = plain[band * 260 + (y * 20 + x) as usize];
            assert!(
                (f64::from(found) - expected.min(4095.0)).abs() <= 0.5 + 1e-6,
                "{band} {x} {y}: {found} {expected}"
            );
        }
    }
}

/// Off the axis light falls as cos⁴: 1 / (1 + (pitch r / f)²)², r in pixels from the middle of the film.
#[test]
fn light_falls_off_the_axis_and_other_filters_are_refused() {
    let folder = tempdir().expect("folder");
    let path = folder.path();
    let flat = |name: &str, filter: &str| {
        let channels = Channels::equal(400.0, 700.0, 30);
        let mut header = Header { channels, ..header(SIZE, [8, 8], 1) };
        let film = serde_json::json!({ "film": { "width": 20, "height": 13, "filter": filter } });
        header.attributes.insert("settings".into(), film);
        let cube = create(path, name, header);
        for tile in 0..cube.grid().count() {
            cube.merge_unit(tile, 1, &unit(&cube, tile, |_, _, _| 0.01)).expect("merged");
        }
    };
    flat("box.zarr", "box");
    flat("gaussian.zarr", "gaussian");
    // The tangent of the angle grows by 0.1 a pixel.
    let model = MODEL.replace("f_number = 2", "f_number = 2\nfocal_length = 1e-4\ncos4 = true");
    fs::write(path.join("sensor.toml"), model.replace("gain = 2", "gain = 10").replace("bits = 12", "bits = 15"))
        .expect("written");
    let expose = |cube: &str| run(path, &["sensor", cube, "--model", "sensor.toml", "-o", "s.zarr", "--noise", "off"]);
    let output = expose("gaussian.zarr");
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("film.filter"));
    let output = expose("box.zarr");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found = counts(&path.join("s.zarr"), [8, 8]);
    let light = |x: f64, y: f64| (1.0 + 0.01 * ((x - 9.5).powi(2) + (y - 6.0).powi(2))).powi(-2);
    let at = |x: usize, y: usize| f64::from(found[y * 20 + x]) - 50.0;
    assert!(at(9, 6) > 1000.0 && at(9, 6) < 32_000.0, "{}", at(9, 6));
    for (x, y) in [(0, 0), (19, 12), (9, 0), (3, 6)] {
        let expected = at(9, 6) * light(x as f64, y as f64) / light(9.0, 6.0);
        // Both are rounded.
        assert!((at(x, y) - expected).abs() <= 1.0, "{x} {y}: {} {expected}", at(x, y));
    }
}

#[test]
fn holes_existing_stores_and_other_commands_are_refused_in_words() {
    let folder = tempdir().expect("folder");
    let path = folder.path();
    fs::write(path.join("sensor.toml"), MODEL).expect("written");
    cube(path, "cube.zarr", [8, 8], Some(1));
    let sensor = ["sensor", "cube.zarr", "--model", "sensor.toml", "-o", "s.zarr"];
    let refused = |arguments: &[&str], words: &str| {
        let output = run(path, arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && stderr.contains(words), "{arguments:?}: {stderr}");
    };
    refused(&sensor, "1 of 6 tiles are not rendered");
    let output = run(path, &[&sensor[..], &["--partial"]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(!path.join("s.zarr/counts/c/0/0/1").exists() && path.join("s.zarr/counts/c/0/0/0").exists());
    refused(&[&sensor[..], &["--partial"]].concat(), "exists already");
    let output = run(path, &[&sensor[..], &["--partial", "--overwrite"]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    refused(&["info", "s.zarr", "--verify"], "no checksums");
    refused(&["sensor", "s.zarr", "--model", "sensor.toml", "-o", "t.zarr"], "holds counts of a sensor");
    refused(&["relight", "s.zarr", "-o", "t.zarr"], "holds counts of a sensor");
    refused(&["compare", "s.zarr", "cube.zarr"], "the first holds counts of a sensor, the second radiance");
    refused(&["export", "s.zarr", "-o", "t.csv", "--integrated"], "--integrated is about radiance");
    refused(&["export", "s.zarr", "-o", "t.png", "--temperature"], "--temperature is about radiance");
    refused(&["view", "s.zarr", "--noise", "off"], "--electrons");
    refused(&["view", "cube.zarr", "--noise", "off"], "holds radiance");
    // Nothing but counts is ever replaced.
    let onto = ["sensor", "cube.zarr", "--model", "sensor.toml", "-o", "cube.zarr", "--partial", "--overwrite"];
    refused(&onto, "cube.zarr");
    assert!(path.join("cube.zarr/radiance").exists());
    refused(&[&sensor[..], &["--responses", "x.csv"]].concat(), "cannot be used with");
    let integrated = ["sensor", "cube.zarr", "--responses", "x.csv", "-o", "i.zarr"];
    for of_model in
        [&["--mtf-plot", "m.svg"][..], &["--electrons"], &["--noise", "off"], &["--seed", "5"], &["--partial"]]
    {
        refused(&[&integrated[..], of_model].concat(), "cannot be used with");
    }
}

/// A script of tests/python with these arguments, where there is a Python to run it; its standard output.
fn read_counts(arguments: &[&str]) -> Option<String> {
    let mut command = python("read_counts.py")?;
    let output = command.args(arguments).output().expect("runs");
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    Some(String::from_utf8_lossy(&output.stdout).into_owned())
}

fn success(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Counts of 12 and of 20 bits, with a tile that is missing, through every command and into every format; and back, in Python.
#[test]
fn counts_are_read_by_every_command() {
    let folder = tempdir().expect("folder");
    let path = folder.path();
    cube(path, "cube.zarr", [8, 8], Some(1));
    for (bits, gain) in [("12", "1.1"), ("20", "0.01")] {
        let folder = path.join(bits);
        fs::create_dir(&folder).expect("made");
        let model =
            MODEL.replace("bits = 12", &format!("bits = {bits}")).replace("gain = 2", &format!("gain = {gain}"));
        fs::write(folder.join("sensor.toml"), model.replace("integration_time = 0.01", "integration_time = 1e-4"))
            .expect("written");
        let make = |out: &str, seed: &str| {
            let model = ["sensor", "../cube.zarr", "--model", "sensor.toml", "--partial", "--electrons"];
            success(&folder, &[&model[..], &["-o", out, "--seed", seed]].concat())
        };
        make("counts.zarr", "1");
        make("other.zarr", "2");
        read_counts(&["store", folder.join("counts.zarr").to_str().expect("a name")]);
        let said = success(&folder, &["info", "counts.zarr"]);
        for words in
            ["20 x 13 pixels x 2 bands", "missing tiles    1 of 6", "400 to 500 nm: SNR", "read_noise_electrons"]
        {
            assert!(said.contains(words), "{words}: {said}");
        }
        let facts: serde_json::Value =
            serde_json::from_str(&success(&folder, &["info", "counts.zarr", "--json"])).expect("JSON");
        assert_eq!((&facts["quantity"], &facts["tiles_missing"]), (&"counts".into(), &serde_json::json!([[1, 2]])));
        assert_eq!(facts["bands"][1]["band"], "red");
        let none: u64 = if bits == "12" { 65_535 } else { u32::MAX.into() };
        assert_eq!(facts["count_missing"], none);
        // A pixel as the store has it.
        let table = success(&folder, &["spectrum", "counts.zarr", "3", "2"]);
        let bytes = fs::read(folder.join("counts.zarr/counts/c/0/0/0")).expect("read");
        let stored = |band: usize| match bits {
            "12" => u64::from(u16::from_le_bytes([bytes[2 * (64 * band + 19)], bytes[2 * (64 * band + 19) + 1]])),
            _ => u64::from(u32::from_le_bytes(bytes[4 * (64 * band + 19)..][..4].try_into().expect("four"))),
        };
        assert_eq!(table, format!("wavelength_nm,counts\n450,{}\n650,{}\n", stored(0), stored(1)));
        // Equal to itself; to another exposure in the mean.
        success(&folder, &["compare", "counts.zarr", "counts.zarr"]);
        let said = success(&folder, &["compare", "counts.zarr", "other.zarr", "--json"]);
        let compared: serde_json::Value = serde_json::from_str(&said).expect("JSON");
        assert_eq!((&compared["pixels"], &compared["pixels_in_all"]), (&(260 - 64).into(), &260.into()));
        let largest = compared["rel_mse"]["largest"].as_f64().expect("a number");
        assert!(largest > 0.0 && largest < 0.2, "{said}");
        for arguments in [
            &["-o", "c_bil.bil"][..],
            &["-o", "c_bip.bip"],
            &["-o", "c_bsq.bsq"],
            &["-o", "c.tif"],
            &["-o", "c.exr"],
            &["-o", "c.zarr"],
            &["-o", "plain.zarr", "--zarr-no-shards"],
            &["-o", "c.csv"],
            &["-o", "s.csv", "--statistics"],
            &["-o", "c.png"],
            &["-o", "b.png", "--bands", "red"],
            &["-o", "m.png", "--colour-map"],
        ] {
            success(&folder, &[&["export", "counts.zarr"], arguments].concat());
        }
        read_counts(&["exports", folder.to_str().expect("a name"), bits]);
        let statistics = fs::read_to_string(folder.join("s.csv")).expect("written");
        assert!(statistics.lines().nth(1).is_some_and(|line| line.starts_with("blue,450,100,1,196,")), "{statistics}");
    }
}

/// The models in `sensors/`, on channels that cover them: SNR and signals are finite, nothing is warned of, and NETD is that of theory and
/// of the table in their README. Theory: σ over dS/dT of Planck's law by differences, all numbers read from the file as TOML.
#[test]
fn models_that_ship_have_the_noise_they_say() {
    let readme = fs::read_to_string(repository("sensors/README.md")).expect("read");
    let mut checked = 0;
    for entry in fs::read_dir(repository("sensors")).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.extension() != Some("toml".as_ref()) {
            continue;
        }
        checked += 1;
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        let text = fs::read_to_string(&path).expect("read");
        // Every number says where it comes from.
        for line in text.lines().filter(|line| line.contains(" = ") && line.contains(|c: char| c.is_ascii_digit())) {
            let is_band = line.starts_with("from") || line.starts_with("to ") || line.contains("samples");
            assert!(is_band || line.contains('#') || line.starts_with("bits"), "{name}: {line}");
        }
        let of: toml::Table = text.parse().expect("TOML");
        let channels = match name.as_str() {
            "silicon-12bit.toml" => Channels::equal(400.0, 1100.0, 70),
            "swir-ingaas.toml" => Channels::equal(900.0, 1700.0, 80),
            _ => Channels::equal(3000.0, 14_000.0, 1100),
        };
        let seen = Seen { pixel_tangent: Some(1e-3) };
        let model = load_sensor(&path, &channels, seen).expect("a model");
        assert_eq!(
            (&model.warnings, model.optics.focal_length),
            (&Vec::<String>::new(), Some(model.pitch / 1e-3)),
            "{name}"
        );
        let bands = Bands::new(&model, &channels);
        assert!(bands.left_out.is_empty() && bands.bands.len() == 1, "{name}");
        let electronics = Electronics { model: &model, seed: 0, noise: true };
        let figures = Figures::new(&electronics, &bands.bands[0], 1e4);
        assert!(figures.nedl.is_finite() && figures.nedl > 0.0, "{name}");
        let said = readme.lines().find(|line| line.contains(&format!("`{name}`"))).expect("a row");
        let said = said.split('|').nth(3).and_then(|cell| cell.trim().strip_suffix(" mK")?.parse::<f64>().ok());
        let Some(millikelvin) = said else {
            assert!(figures.netd.is_none(), "{name}: {figures:?}");
            continue;
        };
        let netd = 1e3 * figures.netd.expect("a thermal band");
        let expected = 1e3 * netd_of(&of);
        println!("{name}: NETD {netd:.3} mK, {expected:.3} by theory, {millikelvin} told");
        assert!((netd / expected - 1.0).abs() < 0.01, "{name}: {netd} {expected}");
        assert!((netd / millikelvin - 1.0).abs() < 0.005, "{name}: {netd} {millikelvin}");
    }
    assert_eq!(checked, 4);
}

/// NETD, K, of a black body of 300 K by the numbers of a model.
fn netd_of(of: &toml::Table) -> f64 {
    const H: f64 = 6.626_070_15e-34;
    const C: f64 = 299_792_458.0;
    let number = |table: &str, key: &str, absent: f64| {
        of[table].get(key).map_or(absent, |v| v.as_float().or(v.as_integer().map(|i| i as f64)).expect("a number"))
    };
    let band = &of["bands"].as_array().expect("bands")[0];
    let end = |key: &str| band[key].as_integer().expect("nm") as f64;
    let (optics, detector) = (
        |key: &str, absent: f64| number("optics", key, absent),
        |key: &str, absent: f64| number("detector", key, absent),
    );
    let is_photon = detector("integration_time", 0.0) > 0.0;
    // The midpoint rule over 1 nm, per m.
    let sum = |kelvin: f64| -> f64 {
        let nm = (end("from") as u32..end("to") as u32).map(|nm| f64::from(nm) + 0.5);
        nm.map(|nm| planck::radiance(nm, kelvin) * if is_photon { nm * 1e-9 / (H * C) } else { 1.0 }).sum()
    };
    let cone = |f_number: f64| std::f64::consts::PI / (4.0 * f_number * f_number);
    let efficiency = if is_photon {
        detector("quantum_efficiency", 0.0) * detector("integration_time", 0.0)
    } else {
        detector("absorptance", 1.0)
    };
    let area = detector("pitch", 0.0).powi(2) * detector("fill_factor", 1.0) * efficiency;
    let through = cone(optics("f_number", 0.0)) * optics("transmittance", 1.0) * area;
    let slope = through * (sum(300.05) - sum(299.95)) / 0.1;
    let shield = optics("cold_shield", 0.0);
    let warm = if shield > 0.0 { cone(shield) } else { std::f64::consts::PI };
    let background = warm * (1.0 - optics("transmittance", 1.0)) * area * sum(optics("temperature", 300.0));
    let variance = if is_photon {
        through * sum(300.0)
            + background
            + detector("dark_current", 0.0) * detector("integration_time", 0.0)
            + detector("read_noise", 0.0).powi(2)
            + detector("gain", 0.0).powi(2) / 12.0
    } else {
        detector("noise_equivalent_power", 0.0).powi(2) + 1.0 / (12.0 * detector("responsivity", 1.0).powi(2))
    };
    variance.sqrt() / slope
}

/// Pitch, focal length and the cube's camera: one follows from the others, or contradicts them by line and key.
#[test]
fn pitch_and_focal_length_fit_the_camera() {
    let channels = Channels::equal(400.0, 700.0, 30);
    let parse = |text: &str, tangent: Option<f64>| {
        spectile::scene::parse_sensor(text, Path::new("s.toml"), &channels, Seen { pixel_tangent: tangent })
    };
    let with = |focal: &str| MODEL.replace("f_number = 2", &format!("f_number = 2\n{focal}"));
    // 10 um at 20 mm.
    let model = parse(&with("focal_length = 0.02"), Some(5.02e-4)).expect("within 1 %");
    assert_eq!((model.pitch, model.optics.focal_length), (10e-6, Some(0.02)));
    let model = parse(
        &with("").replace("pitch = 10e-6\n", "").replace("f_number = 2", "f_number = 2\nfocal_length = 0.02"),
        Some(5e-4),
    );
    assert!((model.expect("a pitch").pitch / 10e-6 - 1.0).abs() < 1e-12);
    let model = parse(&with("cos4 = true"), Some(5e-4)).expect("a focal length");
    assert!((model.optics.focal_length.expect("one") / 0.02 - 1.0).abs() < 1e-12);
    // Of pixels that are several of the cube's.
    let text = with("focal_length = 0.02").replace("pitch = 10e-6", "pitch = 10e-6\noversampling = 4");
    assert!(parse(&text, Some(1.25e-4)).is_ok() && parse(&text, Some(5e-4)).is_err());
    for (text, tangent, key, words) in [
        (with("focal_length = 0.02"), Some(5.1e-4), "detector.pitch", "0.000500"),
        (with("focal_length = 0.02").replace("pitch = 10e-6\n", ""), None, "detector.pitch", "missing"),
        (with("cos4 = true"), None, "detector", "no angle for cos4"),
        (with("mtf = \"m.csv\"\npsf = \"diffraction\""), None, "optics.mtf", "stands beside psf"),
        (with("psf = \"gaussian\""), None, "optics", "no psf_sigma"),
        (with("psf = \"diffraction\"\npsf_sigma = 1"), None, "optics.psf_sigma", "belongs to"),
        (MODEL.replace("from = 400", "from = 400\nresponse = \"r.csv\""), None, "bands.0.response", "stands beside"),
    ] {
        let Err(Error::Input(problems)) = parse(&text, tangent) else { panic!("{text}") };
        let found = problems.iter().find(|problem| problem.key.as_deref() == Some(key));
        let found = found.unwrap_or_else(|| panic!("{key}: {problems:?}"));
        assert!(found.line.is_some() && found.message.contains(words), "{found:?}");
    }
    // Where the cube does not tell, that is said.
    let model = parse(&with("focal_length = 0.02"), None).expect("a model");
    assert!(model.warnings[0].contains("does not tell its camera's angle"), "{:?}", model.warnings);
}

/// A band by a file: of one response, or the one called like it. A quantum efficiency is 0 beyond its table, which is said.
#[test]
fn bands_by_files_and_efficiencies_that_end() {
    let folder = tempdir().expect("folder");
    let path = folder.path();
    cube(path, "cube.zarr", SIZE, None);
    fs::write(path.join("one.csv"), "nm,response\n400,1\n500,1\n").expect("written");
    fs::write(path.join("two.csv"), "nm,green,red\n500,1,0\n600,1,1\n700,0,1\n").expect("written");
    let model = |bands: &str| MODEL.split("[[bands]]").next().expect("a head").to_owned() + bands;
    let make = |name: &str, text: &str| {
        fs::write(path.join("sensor.toml"), text.replace("integration_time = 0.01", "integration_time = 2e-4"))
            .expect("written");
        run(path, &["sensor", "cube.zarr", "--model", "sensor.toml", "-o", name, "--seed", "1"])
    };
    let bands =
        "[[bands]]\nname = \"blue\"\nresponse = \"one.csv\"\n[[bands]]\nname = \"red\"\nresponse = \"two.csv\"\n";
    let output = make("files.zarr", &model(bands));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(make("ends.zarr", MODEL).status.success());
    let [by_file, by_ends] = ["files.zarr", "ends.zarr"].map(|name| counts(&path.join(name), SIZE));
    // The first band has the same interval, the second another.
    assert_eq!(by_file[..260], by_ends[..260]);
    assert_ne!(by_file[260..], by_ends[260..]);
    let output = make("x.zarr", &model("[[bands]]\nname = \"blue\"\nresponse = \"two.csv\"\n"));
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(2) && stderr.contains("none of them called \"blue\": green, red"), "{stderr}");
    // They multiply a quantum efficiency: percent are told from shares, another efficiency is one, and amperes a watt are none.
    for (head, value, words) in [
        ("response", "100", "must be a share of light, in [0, 1], but is 100"),
        ("Responsivity (A/W)", "0.3", "no share of light"),
    ] {
        fs::write(path.join("one.csv"), format!("nm,{head}\n400,{value}\n500,{value}\n")).expect("written");
        let output = make("x.zarr", &model(bands));
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && stderr.contains(words), "{stderr}");
    }
    for (name, head, value) in [("percent.zarr", "response (%)", "100"), ("photons.zarr", "QE", "1")] {
        fs::write(path.join("one.csv"), format!("nm,{head}\n400,{value}\n500,{value}\n")).expect("written");
        assert!(make(name, &model(bands)).status.success());
        assert_eq!(counts(&path.join(name), SIZE), by_file, "{head}");
    }
    let table = "quantum_efficiency = { samples = [[400, 0.5], [620, 0.5]] }";
    let output = make("qe.zarr", &MODEL.replace("quantum_efficiency = 0.5", table));
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && stderr.contains("does not cover 620-700 nm: it is 0 there"), "{stderr}");
    // Of the red band a fifth is left: 600 to 620 of 700 nm.
    let of_red = |name: &str| counts(&path.join(name), SIZE)[260..].iter().map(|c| f64::from(*c) - 50.0).sum::<f64>();
    let (cut, whole) = (of_red("qe.zarr"), of_red("ends.zarr"));
    assert!(cut > 0.1 * whole && cut < 0.25 * whole, "{cut} {whole}");
}

/// The page's model is one, and its program finds a spot as far away as it must: 2 x 2 pixels of 600 K before 290 K, seen without a blur.
#[test]
fn the_page_tells_how_far_a_spot_is_seen() {
    let page = repository("docs/SENSORS.md");
    let text = fs::read_to_string(&page).expect("read");
    let channels = Channels::equal(3000.0, 5000.0, 20);
    let block = text.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).expect("a model");
    let model = spectile::scene::parse_sensor(block, &page, &channels, Seen::default()).expect("the page's model");
    assert!((model.pitch, model.optics.f_number, model.bits) == (15e-6, 2.5, 14), "{model:?}");

    let folder = tempdir().expect("folder");
    let path = folder.path();
    let means = |kelvin: f64| -> Vec<f64> {
        let mean = |[from, to]: [f64; 2]| {
            (0..100).map(|i| planck::radiance(from + (to - from) * (f64::from(i) + 0.5) / 100.0, kelvin)).sum::<f64>()
                / 100.0
        };
        channels.bounds.iter().map(|bounds| mean(*bounds)).collect()
    };
    let (cold, hot) = (means(290.0), means(600.0));
    let cube = create(path, "cube.zarr", Header { channels: channels.clone(), ..header([32, 20], [16, 16], 1) });
    for tile in 0..cube.grid().count() {
        let value = |x: u32, y: u32, k: usize| if x / 2 == 8 && y / 2 == 4 { hot[k] } else { cold[k] } as f32;
        cube.merge_unit(tile, 1, &unit(&cube, tile, value)).expect("merged");
    }
    let model = fs::read_to_string(repository("sensors/mwir-insb.toml")).expect("read");
    fs::write(path.join("sensor.toml"), model.replace("psf = \"diffraction\"", "")).expect("written");
    success(path, &["sensor", "cube.zarr", "--model", "sensor.toml", "-o", "counts.zarr", "--electrons"]);
    // π τ A t QE / 4N² Σ L_k Δ(λ²) / 2hc.
    let per_radiance = std::f64::consts::PI * 0.85 / (4.0 * 6.25) * 15e-6f64.powi(2) * 0.0033 * 0.9 * 1e-9
        / (2.0 * 6.626_070_15e-34 * 299_792_458.0);
    let electrons = |radiance: &[f64]| -> f64 {
        let square = |[from, to]: [f64; 2]| to * to - from * from;
        per_radiance * radiance.iter().zip(&channels.bounds).map(|(l, bounds)| l * square(*bounds)).sum::<f64>()
    };
    let facts: serde_json::Value =
        serde_json::from_str(&success(path, &["info", "counts.zarr", "--json"])).expect("JSON");
    let warm = facts["attributes"]["background_signal"][0].as_f64().expect("electrons");
    let noise = (electrons(&cold) + warm + 5e4 * 0.0033 + 400.0 * 400.0 + 430.0 * 430.0 / 12.0).sqrt();
    let expected = 58.0 * (4.0 * (electrons(&hot) - electrons(&cold)) / (5.0 * noise)).sqrt();
    let Some(said) = read_counts(&["example", page.to_str().expect("a name"), path.to_str().expect("a name")]) else {
        return;
    };
    let found: serde_json::Value = serde_json::from_str(&said).expect("JSON");
    let range = |share: &str| found["ranges"][share].as_f64().expect("metres");
    println!("{} m, {expected} by hand", range("1.0"));
    assert_eq!(found["pixels"], 4);
    assert!((range("1.0") / expected - 1.0).abs() < 1e-4, "{found} {expected}");
    assert!((range("0.01") / expected - 0.1).abs() < 1e-5, "{found}");
    // R e^(αR/2) is the range without air.
    let air = found["air"]["0.01"].as_f64().expect("metres");
    assert!((air * (0.1e-3 * air).exp() / range("0.01") - 1.0).abs() < 1e-5, "{found}");
    let snr = electrons(&hot) / (electrons(&hot) + noise * noise - electrons(&cold)).sqrt();
    assert!((found["snr"].as_f64().expect("a number") / snr - 1.0).abs() < 1e-4, "{found} {snr}");
}

/// Eight epochs of 0.9 and 1.1 by turns: their mean has the relative standard error 0.1 √(8/7) / √8, which is far more than a tenth of the
/// sensor's noise; eight equal ones have none.
#[test]
fn noise_of_the_cube_itself_is_told() {
    let folder = tempdir().expect("folder");
    let path = folder.path();
    fs::write(path.join("sensor.toml"), MODEL.replace("integration_time = 0.01", "integration_time = 1e-4"))
        .expect("written");
    for (name, swing) in [("noisy.zarr", 0.1f32), ("still.zarr", 0.0)] {
        let channels = Channels::equal(400.0, 700.0, 30);
        let cube = create(path, name, Header { channels, epoch: 1, ..header(SIZE, SIZE, 1) });
        for i in 0..8 {
            let value = if i % 2 == 0 { 1.0 - swing } else { 1.0 + swing };
            cube.merge_unit(0, 1, &unit(&cube, 0, |_, _, _| 0.01 * value)).expect("merged");
        }
        let output = run(path, &["sensor", name, "--model", "sensor.toml", "-o", &format!("s-{name}")]);
        let [said, warned] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text).into_owned());
        assert!(output.status.success(), "{warned}");
        let snr =
            said.split("blue: SNR ").nth(1).and_then(|rest| rest.split(',').next()?.parse::<f64>().ok()).expect("SNR");
        let share = warned.split("blue: the noise of the cube itself is about ").nth(1);
        let share = share.and_then(|rest| rest.split(' ').next()?.parse::<f64>().ok());
        match swing > 0.0 {
            true => {
                let expected = snr * 0.1 / 7f64.sqrt();
                let share = share.expect("a warning");
                assert!(expected > 0.1 && (share - expected).abs() < 0.006, "{share} {expected}: {warned}");
            }
            false => assert!(!warned.contains("noise of the cube"), "{warned}"),
        }
    }
}
