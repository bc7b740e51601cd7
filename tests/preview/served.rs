//! What a server says about a cube is what is in it.

use std::io::Cursor;

use spectile::cube::{Cube, Header};
use spectile::spectral::{Channels, planck};
use tempfile::tempdir;

use super::client::{Events, Running, ask, get, serve};
use crate::binary::{command, run};
use crate::cubes::{create, header, pattern, patterned, unit};

const SIZE: [u32; 2] = [100, 70];

#[test]
fn pictures_hold_every_bit_of_the_cube() {
    let folder = tempdir().expect("folder");
    let cube = patterned(folder.path(), "cube.zarr", header(SIZE, [32, 24], 40));
    let (_server, address) = serve(cube.path(), "127.0.0.1:0");
    let floats = |target: &str| {
        let answer = get(address, &format!("/api/image?{target}&format=f32"));
        (answer.header("x-size").expect("a size").to_owned(), answer.floats())
    };
    let preview = cube.preview().expect("preview");
    assert_eq!(floats("show=colour"), ("100,70".into(), preview.rgb.clone()));
    // A part of it, across tiles.
    let (size, part) = floats("show=colour&x0=30&y0=20&x1=70&y1=50");
    let expected: Vec<f32> =
        (20..50).flat_map(|y| preview.rgb[3 * (y * 100 + 30)..3 * (y * 100 + 70)].to_vec()).collect();
    assert_eq!((size.as_str(), part), ("40,30", expected));
    let channel = |k: usize| (0..70).flat_map(move |y| (0..100).map(move |x| pattern(x, y, k))).collect::<Vec<f32>>();
    for k in [0, 17, 39] {
        assert_eq!(floats(&format!("show=channel&k={k}")).1, channel(k));
    }
    let rgb: Vec<f32> = (0..7000).flat_map(|i| [3, 0, 39].map(|k| pattern(i % 100, i / 100, k))).collect();
    assert_eq!(floats("show=false&r=3&g=0&b=39").1, rgb);
    // Means of blocks, those at the edges smaller: of up to 256 values below 4.1e5 in f32, summed one after the other.
    for (target, scale) in [("show=channel&k=17", 8), ("show=channel&k=17", 16), ("show=channel&k=17", 2)] {
        let (size, got) = floats(&format!("{target}&scale={scale}"));
        let columns = 100u32.div_ceil(scale);
        assert_eq!(size, format!("{columns},{}", 70u32.div_ceil(scale)));
        for (i, got) in (0u32..).zip(got) {
            let (x, y) = (i % columns * scale, i / columns * scale);
            let pixels =
                (y..(y + scale).min(70)).flat_map(|y| (x..(x + scale).min(100)).map(move |x| pattern(x, y, 17)));
            let (sum, n) = pixels.fold((0.0, 0.0), |(sum, n), v| (sum + f64::from(v), n + 1.0));
            let bound = (sum / n) * n * f64::from(f32::EPSILON);
            assert!((f64::from(got) - sum / n).abs() <= bound, "{scale} {x} {y}: {got} {}", sum / n);
        }
    }
    for scale in [8u32, 16] {
        let (_, got) = floats(&format!("show=colour&scale={scale}"));
        let columns = 100u32.div_ceil(scale);
        for (i, got) in (0u32..).zip(got) {
            let (block, c) = (i / 3, (i % 3) as usize);
            let (x, y) = (block % columns * scale, block / columns * scale);
            let inside =
                (y..(y + scale).min(70)).flat_map(|y| (x..(x + scale).min(100)).map(move |x| (y * 100 + x) as usize));
            let (sum, n) = inside.fold((0.0, 0.0), |(sum, n), p| (sum + f64::from(preview.rgb[3 * p + c]), n + 1.0));
            // Means of radiance below 4.1e5 are rounded to f32; the weights of all channels add up to 5.3 at most, signs left
            // aside. The colour is rounded three times more.
            let bound = (5.3 + 3.0) * 4.1e5 * f64::from(f32::EPSILON);
            assert!((f64::from(got) - sum / n).abs() <= bound, "{scale} {x} {y} {c}: {got} {}", sum / n);
        }
    }
    // PNG as `export` makes it.
    let png = get(address, "/api/image?show=colour&ev=-12");
    let mut reader = png::Decoder::new(Cursor::new(&png.body)).read_info().expect("a PNG");
    let mut pixels = vec![0; reader.output_buffer_size().expect("size")];
    reader.next_frame(&mut pixels).expect("pixels");
    assert_eq!(pixels, preview.to_srgb8(-12.0));
}

#[test]
fn spectra_are_those_of_the_command_line() {
    let folder = tempdir().expect("folder");
    let cube = patterned(folder.path(), "cube.zarr", header(SIZE, [32, 24], 40));
    let (_server, address) = serve(cube.path(), "127.0.0.1:0");
    for [x, y] in [[0, 0], [99, 69], [31, 24], [64, 23]] {
        let printed = command(folder.path(), &["spectrum", "cube.zarr", &x.to_string(), &y.to_string()]).output();
        let printed = String::from_utf8(printed.expect("runs").stdout).expect("UTF-8");
        assert_eq!(get(address, &format!("/api/spectrum?x={x}&y={y}&format=csv")).text(), printed);
        let json = get(address, &format!("/api/spectrum?x={x}&y={y}")).json();
        let numbers: Vec<f32> =
            json["radiance"].as_array().expect("a list").iter().map(|v| v.as_f64().expect("a number") as f32).collect();
        assert_eq!(numbers, cube.spectrum(x, y).expect("read").expect("there"));
        assert_eq!((json["samples"].as_u64(), json["standard_error"].is_null()), (Some(1), true));
    }
    let mean = get(address, "/api/spectrum?x=30&y=20&x1=70&y1=50").json();
    assert_eq!(mean["pixels"], 1200);
    for k in [0, 39] {
        let sum: f64 = (20..50).flat_map(|y| (30..70).map(move |x| f64::from(pattern(x, y, k)))).sum();
        let got = mean["radiance"][k].as_f64().expect("a number");
        assert!((got / (sum / 1200.0) - 1.0).abs() < 1200.0 * f64::EPSILON, "{got}");
    }
}

/// What a cube with `--uncertainty` has beside its radiance, laid out alike.
#[test]
fn standard_errors_are_served_where_the_cube_has_them() {
    let folder = tempdir().expect("folder");
    let cube = patterned(folder.path(), "cube.zarr", header([16, 8], [8, 8], 5).with_uncertainty());
    for column in 0..2 {
        let place = |array: &str| cube.path().join(format!("{array}/c/0/0/{column}"));
        let radiance = std::fs::read(place("radiance")).expect("read");
        let tenth: Vec<u8> =
            radiance.as_chunks().0.iter().flat_map(|bytes| (f32::from_le_bytes(*bytes) / 10.0).to_le_bytes()).collect();
        std::fs::create_dir_all(place("standard_error").parent().expect("a folder")).expect("made");
        std::fs::write(place("standard_error"), tenth).expect("written");
    }
    let (_server, address) = serve(cube.path(), "127.0.0.1:0");
    let csv = get(address, "/api/spectrum?x=9&y=3&format=csv");
    let line = csv.text().lines().nth(3).expect("channel 2");
    let value = pattern(9, 3, 2);
    assert_eq!(line, format!("{},{value:?},{:?}", cube.channels().centre(2), value / 10.0));
    assert!(csv.text().starts_with("wavelength_nm,radiance,standard_error\n"));
    let mean = get(address, "/api/spectrum?x=6&y=0&x1=10&y1=8").json();
    let squares: f64 = (0..8).flat_map(|y| (6..10).map(move |x| f64::from(pattern(x, y, 4) / 10.0).powi(2))).sum();
    let got = mean["standard_error"][4].as_f64().expect("a number");
    assert!((got / (squares.sqrt() / 32.0) - 1.0).abs() < 1e-12, "{got}");
}

#[test]
fn thermal_channels_have_brightness_temperatures() {
    let folder = tempdir().expect("folder");
    let bounds = vec![[500.0, 510.0], [3e3, 5e3], [8e3, 12e3]];
    let channels = Channels::from_bounds(bounds.clone(), None);
    let cube = create(folder.path(), "cube.zarr", Header { channels, ..header([16, 8], [8, 8], 3) });
    let kelvin = |x: u32| 250.0 + 10.0 * f64::from(x);
    for tile in 0..2 {
        let mean = |[from, to]: [f64; 2], t: f64| {
            (0..2000).map(|i| planck::radiance(from + (to - from) * (f64::from(i) + 0.5) / 2e3, t)).sum::<f64>() / 2e3
        };
        cube.merge_unit(tile, 1, &unit(&cube, tile, |x, _, k| mean(bounds[k], kelvin(x)) as f32)).expect("merged");
    }
    let (_server, address) = serve(cube.path(), "127.0.0.1:0");
    for k in [1, 2] {
        let got = get(address, &format!("/api/image?show=temperature&k={k}&y1=1&format=f32")).floats();
        for (x, got) in (0..16).zip(got) {
            // f32 of both, and the table.
            assert!((f64::from(got) - kelvin(x)).abs() < 2e-3, "{k} {x}: {got}");
        }
    }
    let refused = ask(address, "GET", "/api/image?show=temperature&k=0", &[]);
    assert_eq!(refused.status, 400);
    assert_eq!(get(address, "/api/channels").json()["thermal"], serde_json::json!([1, 2]));
}

#[test]
fn samples_are_shown_by_tile() {
    let folder = tempdir().expect("folder");
    let cube = create(folder.path(), "cube.zarr", header([20, 8], [8, 8], 3));
    for (tile, samples) in [(0, 1), (0, 1), (0, 2), (1, 1)] {
        cube.merge_unit(tile, samples, &unit(&cube, tile, |_, _, _| 1.0)).expect("merged");
    }
    let (_server, address) = serve(cube.path(), "127.0.0.1:0");
    let row = get(address, "/api/image?show=samples&y1=1&format=f32").floats();
    let expected: Vec<f32> = (0..20).map(|x| [4.0, 1.0, f32::NAN][x / 8]).collect();
    assert_eq!(format!("{row:?}"), format!("{expected:?}"));
    // Means of what is rendered: of columns 8 to 15 one sample, of 16 to 19 none.
    assert_eq!(get(address, "/api/image?show=samples&scale=16&format=f32").floats()[0], 2.5);
    let picture = get(address, "/api/image?show=samples");
    assert_eq!(picture.header("x-range-samples"), Some("1,4"));
    // Each step is as many times more: 2 is half-way between 1 and 4.
    let shades = |low: u32| get(address, &format!("/api/image?show=samples&y1=1&low={low}&high=16")).body;
    assert!(shades(1) != shades(2));
}

/// A cube that somebody else renders: what is missing is NaN, what comes is told, and nothing twice.
#[test]
fn what_grows_on_disk_is_told() {
    let folder = tempdir().expect("folder");
    let cube = create(folder.path(), "cube.zarr", header(SIZE, [32, 24], 4));
    let (server, address) = serve(cube.path(), "127.0.0.1:0");
    let mut events = Events::listen(address);
    let (name, state) = events.next().expect("a first event");
    assert_eq!(
        (name.as_str(), &state["stage"], &state["changed"]),
        ("state", &"viewing".into(), &serde_json::json!([]))
    );
    assert!(get(address, "/api/image?show=colour&format=f32").floats().iter().all(|v| v.is_nan()));
    assert_eq!(ask(address, "GET", "/api/spectrum?x=0&y=0", &[]).status, 404);
    let mut told = Vec::new();
    for tile in [5, 6, 1] {
        cube.merge_unit(tile, 1, &unit(&cube, tile, pattern)).expect("merged");
        let found = |(_, state): (String, serde_json::Value)| {
            let changed = state["changed"].as_array().expect("a list").clone();
            let range = |range: &serde_json::Value| range[0].as_u64().expect("from")..range[1].as_u64().expect("to");
            let tiles: Vec<u64> = changed.iter().flat_map(range).collect();
            (!tiles.is_empty()).then_some(tiles)
        };
        told.extend(events.find_map(found).expect("news"));
    }
    assert_eq!(told, [5, 6, 1]);
    assert_eq!(get(address, "/api/status").json()["tiles_started"], 3);
    // Nobody waits for listeners at the end.
    drop(server);
    assert!(Cube::open(cube.path()).is_ok());
}

/// Counts of a sensor, with their noise as they are, and without it as the detector would count: the store that `--noise off` makes.
#[test]
fn counts_are_served_with_their_noise_and_without() {
    let folder = tempdir().expect("folder");
    let path = folder.path();
    patterned(path, "cube.zarr", header([40, 24], [16, 16], 12));
    let model = "[optics]\nf_number = 2\n[detector]\npitch = 1e-5\nintegration_time = 1e-8\nquantum_efficiency = 0.5\nread_noise = 9\n\
                 gain = 1e3\noffset = 7\nbits = 14\ndark_current = 1e9\nfull_well = 7.2e6\nprnu = 0.01\n";
    std::fs::write(path.join("sensor.toml"), model).expect("written");
    for (out, noise) in [("noisy.zarr", "on"), ("plain.zarr", "off")] {
        let output =
            run(path, &["sensor", "cube.zarr", "--model", "sensor.toml", "-o", out, "--electrons", "--noise", noise]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    let stored = |store: &str| -> Vec<f32> {
        let cube = Cube::open_picture(&path.join(store)).expect("counts");
        let at = |i: u32| cube.spectrum(i % 40, i / 40).expect("read").expect("there")[0];
        (0..40 * 24).map(at).collect()
    };
    let [noisy, plain] = ["noisy.zarr", "plain.zarr"].map(stored);
    assert_ne!(noisy, plain);
    // Full wells of 7,200 counts are among them.
    assert!(plain.contains(&7207.0) && plain.iter().any(|count| *count < 7207.0), "{plain:?}");
    for (noise, expected) in [("on", &noisy), ("off", &plain)] {
        let arguments = ["view", "noisy.zarr", "--listen", "127.0.0.1:0", "--noise", noise, "--json"];
        let running = Running::start(path, &arguments);
        let channels = get(running.address, "/api/channels").json();
        assert_eq!((&channels["quantity"], &channels["names"]), (&"counts".into(), &serde_json::json!(["all"])));
        assert_eq!(channels["thermal"], serde_json::json!([]));
        let found = get(running.address, "/api/image?show=channel&k=0&scale=1&format=f32").floats();
        assert_eq!(&found, expected, "{noise}");
        // Three times the one band.
        let colour = get(running.address, "/api/image?show=colour&scale=1&format=f32").floats();
        assert_eq!(colour.iter().step_by(3).copied().collect::<Vec<_>>(), *expected);
        let blocks = get(running.address, "/api/image?show=channel&k=0&scale=8&format=f32").floats();
        let mean = (0..64).map(|i| f64::from(expected[40 * (i / 8) + 8 + i % 8])).sum::<f64>() / 64.0;
        assert!((f64::from(blocks[1]) / mean - 1.0).abs() < 1e-6, "{noise}: {} {mean}", blocks[1]);
        let csv = get(running.address, "/api/spectrum?x=3&y=2&format=csv");
        assert!(csv.text().starts_with("wavelength_nm,counts\n"), "{}", csv.text());
    }
}
