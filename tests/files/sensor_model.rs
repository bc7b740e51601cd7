//! `spectile sensor --model` through the real binary: counts as they lie in the store, by seed and not by tile or thread.

use std::fs;
use std::path::Path;

use spectile::cube::Header;
use spectile::spectral::Channels;
use tempfile::tempdir;

use crate::binary::run;
use crate::cubes::{create, header, unit};

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
    refused(&["info", "s.zarr"], "holds counts of a sensor");
    // Nothing but counts is ever replaced.
    let onto = ["sensor", "cube.zarr", "--model", "sensor.toml", "-o", "cube.zarr", "--partial", "--overwrite"];
    refused(&onto, "cube.zarr");
    assert!(path.join("cube.zarr/radiance").exists());
    refused(&[&sensor[..], &["--responses", "x.csv"]].concat(), "cannot be used with");
}
