//! The real binary, in fresh directories.

use std::fs;
use std::io::Read;
use std::path::Path;
use std::process::Stdio;

use serde_json::Value;
use spectile::cube::Header;
use spectile::spectral::Channels;
use tempfile::tempdir;

use crate::binary::{command, run};
use crate::cubes::{Random, Written, create, header, pattern, patterned, unit};

/// Stdout of a run that must succeed and say nothing on stderr.
fn success(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && stderr.is_empty(), "{arguments:?}: {:?} {stderr}", output.status);
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// Exit code and stderr of a run that must fail with nothing on stdout.
fn failure(folder: &Path, arguments: &[&str]) -> (i32, String) {
    let output = run(folder, arguments);
    assert!(output.stdout.is_empty(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stdout));
    (output.status.code().expect("a code"), String::from_utf8(output.stderr).expect("UTF-8"))
}

fn only_object(stdout: &str) -> Value {
    assert_eq!(stdout.lines().count(), 1, "{stdout}");
    let object: Value = serde_json::from_str(stdout).expect("JSON");
    assert_eq!(object["event"], "done");
    assert!(object["time_s"].as_f64().is_some_and(|t| t >= 0.0));
    object
}

/// Three epochs of noise over 3 of 4 tiles.
fn noisy(folder: &Path, name: &str, seed: u64) -> Written {
    let cube = create(folder, name, Header { epoch: 2, ..header([20, 13], [16, 8], 3) });
    let mut random = Random(seed);
    for tile in 0..3 {
        for _ in 0..3 {
            cube.merge_unit(tile, 2, &unit(&cube, tile, |_, _, _| 1.0 + random.uniform() as f32)).expect("merged");
        }
    }
    cube
}

#[test]
fn help_teaches_and_version_is_printed() {
    let folder = tempdir().expect("folder");
    let top = success(folder.path(), &["--help"]);
    for word in ["render", "Exit codes", "W m-2 sr-1 nm-1", "spectile export cube.zarr"] {
        assert!(top.contains(word), "{word}");
    }
    for name in ["render", "plan", "devices", "info", "spectrum", "compare", "export", "sensor"] {
        let (long, short) = (success(folder.path(), &[name, "--help"]), success(folder.path(), &[name, "-h"]));
        assert!(long.len() > short.len(), "{name}: --help says more than -h");
        assert!(long.contains("Usage: spectile"), "{name}");
    }
    assert_eq!(success(folder.path(), &["--version"]), format!("spectile {}\n", env!("CARGO_PKG_VERSION")));
}

#[test]
fn mistaken_arguments_are_exit_code_2() {
    let folder = tempdir().expect("folder");
    for (arguments, expected) in [
        (vec![], "Usage"),
        (vec!["rendr"], "unrecognized subcommand"),
        (vec!["info"], "<CUBE>"),
        (vec!["spectrum", "a.zarr", "1", "-1"], "invalid value '-1'"),
        (vec!["render", "scene.toml"], "--output"),
        (vec!["render", "scene.toml", "-o", "o.zarr", "--tile", "12"], "multiple of 8"),
        (vec!["render", "scene.toml", "-o", "o.zarr", "--size", "12"], "640x480"),
        (vec!["render", "scene.toml", "-o", "o.zarr", "--time", "soon"], "1.5h"),
        (vec!["render", "scene.toml", "-o", "o.zarr", "--spp", "0"], "0"),
        (vec!["compare", "a", "b", "--tolerance", "-1"], "tolerance"),
        (vec!["export", "a.zarr", "-o", "a.png", "--exposure", "bright"], "EV"),
        (vec!["export", "a.zarr", "-o", "a.jpg"], "names no format"),
        (vec!["export", "a.zarr", "-o", "a.exr", "--bands", "1,,2"], "550nm"),
    ] {
        let (code, stderr) = failure(folder.path(), &arguments);
        assert_eq!(code, 2, "{arguments:?}");
        assert!(stderr.contains(expected), "{arguments:?}: {stderr}");
    }
}

#[test]
fn errors_are_on_stderr_and_as_an_event() {
    let folder = tempdir().expect("folder");
    for name in ["info", "compare", "export", "spectrum"] {
        let more: &[&str] = match name {
            "compare" => &["other.zarr"],
            "export" => &["-o", "a.png"],
            "spectrum" => &["0", "0"],
            _ => &[],
        };
        let (code, stderr) = failure(folder.path(), &[&[name, "none.zarr"], more].concat());
        assert_eq!((code, stderr.as_str()), (5, "error: none.zarr: there is no such cube\n"), "{name}");
    }
    for arguments in [vec!["info", "none.zarr", "--json"], vec!["info", "--json"]] {
        let output = run(folder.path(), &arguments);
        let event: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
        assert_eq!(event["event"], "error");
        assert_eq!(event["exit_code"].as_i64(), output.status.code().map(i64::from));
        let message = event["message"].as_str().expect("message");
        assert!(
            String::from_utf8_lossy(&output.stderr).contains(message) && !message.starts_with("error"),
            "{message}"
        );
        assert!(event["time_s"].is_f64());
    }
}

#[test]
fn info_tells_how_far_a_cube_got() {
    let folder = tempdir().expect("folder");
    let cube = noisy(folder.path(), "cube.zarr", 1);
    let text = success(folder.path(), &["info", "cube.zarr"]);
    for expected in [
        "20 x 13 pixels x 3 channels",
        "380 to 780 nm, channels 133.333333 nm wide",
        "4 of 16 x 8 pixels",
        "6 per pixel; 1 of 4 tiles have none yet",
        "from 3 epochs, rough",
        "0123abcd",
    ] {
        assert!(text.contains(expected), "{expected}: {text}");
    }
    let object = only_object(&success(folder.path(), &["info", "cube.zarr", "--json"]));
    assert_eq!(object["size"], serde_json::json!([20, 13]));
    assert_eq!((&object["tiles"], &object["tiles_started"]), (&Value::from(4), &Value::from(3)));
    assert_eq!(object["samples"], serde_json::json!({ "least": 6, "most": 6 }));
    assert_eq!(object["attributes"]["seed"], 7);
    let estimate = cube.error_estimate().expect("estimate");
    for (k, channel) in object["channels"].as_array().expect("channels").iter().enumerate() {
        assert_eq!(channel["error_estimate"].as_f64(), Some(estimate[k]));
        assert_eq!(channel["wavelength_nm"].as_f64(), Some(cube.channels().centre(k)));
    }
    // Uniform in 1..2, 3 epochs: sd sqrt(1/12), relative to the root mean square 1.53: about 0.109.
    assert!(estimate.iter().all(|e| (0.09..0.13).contains(e)), "{estimate:?}");

    create(folder.path(), "new.zarr", header([8, 8], [8, 8], 2));
    let text = success(folder.path(), &["info", "new.zarr"]);
    assert!(text.contains("none yet") && text.contains("unknown before 2 epochs (128 samples per pixel)"), "{text}");
    let object = only_object(&success(folder.path(), &["info", "new.zarr", "--json"]));
    assert_eq!(object["channels"][0]["error_estimate"], Value::Null);
}

#[test]
fn spectrum_prints_every_bit() {
    let folder = tempdir().expect("folder");
    let cube = patterned(folder.path(), "cube.zarr", header([20, 13], [16, 8], 7));
    let csv = success(folder.path(), &["spectrum", "cube.zarr", "17", "9"]);
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!((lines[0], lines.len()), ("wavelength_nm,radiance", 1 + 7));
    for (k, line) in lines[1..].iter().enumerate() {
        let (nm, radiance) = line.split_once(',').expect("two columns");
        assert_eq!(nm.parse::<f64>().expect("nm"), cube.channels().centre(k));
        assert_eq!(radiance.parse::<f32>().expect("radiance").to_bits(), pattern(17, 9, k).to_bits());
    }
    let plotted = success(folder.path(), &["spectrum", "cube.zarr", "17", "9", "--plot", "pixel.svg"]);
    assert_eq!(plotted, csv);
    let svg = fs::read_to_string(folder.path().join("pixel.svg")).expect("plot");
    for label in ["wavelength (nm)", "spectral radiance", "W m⁻² sr⁻¹ nm⁻¹", "cube.zarr, column 17, row 9, 1 samples"]
    {
        assert!(svg.contains(label), "{label}");
    }

    let (code, stderr) = failure(folder.path(), &["spectrum", "cube.zarr", "20", "0"]);
    assert!(
        code == 2 && stderr.contains("pixel 20 0 is outside the picture; columns are 0..20, rows 0..13"),
        "{stderr}"
    );
    noisy(folder.path(), "part.zarr", 1);
    let (code, stderr) = failure(folder.path(), &["spectrum", "part.zarr", "19", "12"]);
    assert!(code == 2 && stderr.contains("no samples yet"), "{stderr}");
}

#[test]
fn compare_has_a_verdict() {
    let folder = tempdir().expect("folder");
    let scaled = |name: &str, factor: f32| {
        let cube = create(folder.path(), name, header([20, 13], [16, 8], 2));
        for tile in 0..4 {
            cube.merge_unit(tile, 1, &unit(&cube, tile, |_, _, k| factor * (k + 1) as f32)).expect("merged");
        }
    };
    scaled("a.zarr", 1.5);
    scaled("b.zarr", 1.0);
    // (0.5)² / (1 + 0.01²), in both channels.
    let rel_mse = 0.25 / (1.0 + 1e-4);
    let text = success(folder.path(), &["compare", "a.zarr", "b.zarr"]);
    assert!(text.contains("2.49975e-1 at most (channel 0)") && text.lines().count() == 4, "{text}");
    let object =
        only_object(&success(folder.path(), &["compare", "a.zarr", "b.zarr", "--json", "--tolerance", "0.25"]));
    assert_eq!((&object["passed"], &object["pixels"]), (&Value::from(true), &Value::from(260)));
    for (k, channel) in object["channels"].as_array().expect("channels").iter().enumerate() {
        assert_eq!(channel["bias"].as_f64(), Some(0.5 * (k + 1) as f64));
        assert_eq!(channel["rmse"].as_f64(), Some(0.5 * (k + 1) as f64));
        assert!((channel["rel_mse"].as_f64().expect("relMSE") / rel_mse - 1.0).abs() < 1e-12);
    }

    let failed = run(folder.path(), &["compare", "a.zarr", "b.zarr", "--tolerance", "0.2"]);
    assert_eq!(failed.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&failed.stdout).contains("relMSE"), "the table is printed all the same");
    let stderr = String::from_utf8_lossy(&failed.stderr).into_owned();
    assert!(stderr.contains("error: relMSE 2.500e-1 of channel 0 exceeds the tolerance 2e-1"), "{stderr}");
    let failed = run(folder.path(), &["compare", "a.zarr", "b.zarr", "--tolerance", "0.2", "--json"]);
    let lines: Vec<Value> =
        failed.stdout.split(|&b| b == b'\n').filter_map(|l| serde_json::from_slice(l).ok()).collect();
    assert_eq!((&lines[0]["passed"], &lines[1]["event"]), (&Value::from(false), &Value::from("error")));
    success(folder.path(), &["compare", "a.zarr", "a.zarr", "--tolerance", "0"]);

    // Of many channels those that differ most are shown, in their order.
    let many = |name: &str, grown: usize| {
        let cube = create(folder.path(), name, header([20, 13], [16, 8], 25));
        for tile in 0..4 {
            let value = |_, _, k: usize| if k % 2 == grown { 1.0 + k as f32 } else { 1.0 };
            cube.merge_unit(tile, 1, &unit(&cube, tile, value)).expect("merged");
        }
    };
    many("even.zarr", 0);
    many("none.zarr", 2);
    let text = success(folder.path(), &["compare", "even.zarr", "none.zarr"]);
    let shown: Vec<&str> = text.lines().skip(1).map_while(|line| line.split_whitespace().next()).collect();
    assert_eq!(shown[..11].join(" "), "6 8 10 12 14 16 18 20 22 24 the", "{text}");
    assert!(text.contains("the 10 of 25 channels with the largest relMSE"), "{text}");
    let all = success(folder.path(), &["compare", "even.zarr", "none.zarr", "--all"]);
    assert_eq!(all.lines().count(), 27, "{all}");

    // What is not rendered is left out, said, and never passes.
    noisy(folder.path(), "part.zarr", 1);
    noisy(folder.path(), "same.zarr", 1);
    let text = success(folder.path(), &["compare", "part.zarr", "same.zarr"]);
    assert!(text.contains("20 pixels left out"), "{text}");
    let failed = run(folder.path(), &["compare", "part.zarr", "same.zarr", "--tolerance", "1"]);
    assert_eq!(failed.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&failed.stderr).contains("only 240 of 260 pixels"));
    let (code, stderr) = failure(folder.path(), &["compare", "part.zarr", "a.zarr"]);
    assert!(code == 2 && stderr.contains("3 channels, the second 2"), "{stderr}");
}

#[test]
fn export_writes_the_picture_it_says() {
    let folder = tempdir().expect("folder");
    // A false-colour cube: red 0.25, green 0.125, blue 0; the last tile is missing.
    let channels = Channels::from_bounds(vec![[3e3, 4e3], [4e3, 5e3], [8e3, 12e3]], Some([2, 0, 1]));
    let cube = create(folder.path(), "cube.zarr", Header { channels, ..header([20, 13], [16, 8], 3) });
    for tile in 0..3 {
        cube.merge_unit(tile, 1, &unit(&cube, tile, |_, _, k| [0.125, 0.0, 0.25][k])).expect("merged");
    }
    let read = |name: &str| {
        let file = std::io::BufReader::new(fs::File::open(folder.path().join(name)).expect("opens"));
        let mut reader = png::Decoder::new(file).read_info().expect("a PNG");
        assert!(reader.info().srgb.is_some());
        let mut pixels = vec![0; reader.output_buffer_size().expect("size")];
        let info = reader.next_frame(&mut pixels).expect("pixels");
        assert_eq!((info.width, info.height, info.color_type), (20, 13, png::ColorType::Rgb));
        pixels
    };
    let text = success(folder.path(), &["export", "cube.zarr", "-o", "auto.png"]);
    assert!(text.contains("exposure +2.000 EV (99th percentile white)"), "{text}");
    assert!(text.contains("10000.000 nm as red, 3500.000 nm as green, 4500.000 nm as blue"), "{text}");
    assert!(text.contains("1 of 4 tiles have no samples yet"), "{text}");
    // sRGB of 1, 0.5 and 0 is 255, 188 and 0.
    let pixels = read("auto.png");
    assert_eq!(pixels[..3], [255, 188, 0]);
    assert_eq!(pixels[(12 * 20 + 19) * 3..], [0, 0, 0]);
    let object = only_object(&success(
        folder.path(),
        &["export", "cube.zarr", "-o", "fixed.png", "--exposure", "-1", "--format", "png", "--json"],
    ));
    assert_eq!((object["exposure_ev"].as_f64(), object["tiles_missing"].as_u64()), (Some(-1.0), Some(1)));
    // sRGB of 0.125 and 0.0625 is 99 and 71.
    assert_eq!(read("fixed.png")[..3], [99, 71, 0]);

    let (code, stderr) = failure(folder.path(), &["export", "cube.zarr", "-o", "no/where.png"]);
    assert!(code == 5 && stderr.contains("no/where.png: cannot be written"), "{stderr}");
}

#[test]
fn a_broken_pipe_ends_quietly() {
    let folder = tempdir().expect("folder");
    // More output than a pipe holds.
    patterned(folder.path(), "cube.zarr", header([8, 8], [8, 8], 20_000));
    let mut child = command(folder.path(), &["spectrum", "cube.zarr", "1", "1"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("starts");
    drop(child.stdout.take());
    let mut stderr = String::new();
    child.stderr.take().expect("piped").read_to_string(&mut stderr).expect("read");
    assert!(child.wait().expect("ends").success() && stderr.is_empty(), "{stderr}");
}

/// A build without the page: `cargo test --release --no-default-features --test all cli::`.
#[cfg(not(feature = "web"))]
#[test]
fn a_build_without_the_page_says_so() {
    let folder = tempdir().expect("folder");
    create(folder.path(), "cube.zarr", header([8, 8], [8, 8], 2));
    let scene = crate::binary::cornell();
    let render = ["render", scene.to_str().expect("UTF-8"), "-o", "new.zarr", "--listen", "127.0.0.1:0"];
    for arguments in [&["view", "cube.zarr"][..], &render] {
        let (code, stderr) = failure(folder.path(), arguments);
        let what = "error: this program was built without its web page; build it with the cargo feature `web`";
        assert!(code == 2 && stderr.starts_with(what) && stderr.lines().count() == 1, "{stderr}");
    }
    assert!(!folder.path().join("new.zarr").exists());
}
