//! `--error-per tile`: each tile ends where its own error is small enough, at two looks in a row, whatever devices, processes and kills
//! there are.

use std::fs;
use std::time::Duration;

use serde_json::{Value, json};
use spectile::cube::Cube;

use super::{Place, Running, arrays, samples};
use crate::binary::text;

/// Small epochs and tiles: 9 of them.
const SMALL: &[&str] = &["--tile", "8", "--set", "integrator.epoch=4"];
const EPOCH: u32 = 4;
const ERROR: f64 = 0.06;

fn stop(error: f64) -> [String; 3] {
    ["--error-per".into(), "tile".into(), format!("--error={error}")]
}

fn with<'a>(stop: &'a [String; 3], more: &[&'a str]) -> Vec<&'a str> {
    [SMALL, &stop.each_ref().map(String::as_str), more].concat()
}

/// Full epochs at which tiles are looked at.
fn looks() -> impl Iterator<Item = u32> {
    [8, 10, 12, 14].into_iter().chain((2u32..).flat_map(|n| (4..8).map(move |i| i << n)))
}

/// The error of a tile of a cube with standard errors, as the documents have it, from nothing but what readers see.
fn error_of(cube: &Cube, tile: u32, bright: &[f64]) -> f64 {
    let (rect, channels) = (cube.grid().rect(tile), cube.channels().len());
    let (mut variance, mut square) = (vec![0.0; channels], vec![0.0; channels]);
    for (x, y) in (rect.y0..rect.y1).flat_map(|y| (rect.x0..rect.x1).map(move |x| (x, y))) {
        let mean = cube.spectrum(x, y).expect("inside").expect("rendered");
        let error = cube.standard_error(x, y).expect("inside").expect("two epochs");
        for k in 0..channels {
            variance[k] += f64::from(error[k]).powi(2);
            square[k] += f64::from(mean[k]).powi(2);
        }
    }
    let least = |k: usize| rect.pixels() as f64 * (0.1 * bright[k]).powi(2);
    (0..channels).map(|k| (variance[k] / square[k].max(least(k))).sqrt()).fold(0.0, f64::max)
}

fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|value| value.to_bits()).collect()
}

fn brightness(cube: &Cube) -> Vec<f64> {
    let text = fs::read_to_string(cube.path().join(".spectile/brightness.json")).expect("noted");
    let told: Value = serde_json::from_str(&text).expect("JSON");
    serde_json::from_value(told["mean_radiance"].clone()).expect("numbers")
}

/// Each tile against renders of all looks, in which no tile ends by itself: it has the bytes of the one at which its error is small
/// enough for the second time in a row.
#[test]
fn tiles_end_at_the_second_look_in_a_row() {
    let place = Place::new();
    let (stop, uncertain) = (stop(ERROR), ["--uncertainty"]);
    let cube = place.render("cube.zarr", &with(&stop, &uncertain));
    let bright = brightness(&cube);
    let found = cube.all_samples().expect("samples");
    let most = *found.iter().max().expect("tiles");
    assert!(most > 2 * found.iter().min().expect("tiles"), "tiles differ: {found:?}");
    let mut is_within: Vec<Vec<bool>> = vec![Vec::new(); found.len()];
    for look in looks().take_while(|look| look * EPOCH <= most) {
        let spp = (look * EPOCH).to_string();
        let even = place.render("even.zarr", &[SMALL, &uncertain, &["--spp", &spp, "--overwrite"]].concat());
        for (tile, &samples) in (0..).zip(&found).filter(|(_, samples)| **samples >= look * EPOCH) {
            let of_tile = &mut is_within[tile as usize];
            of_tile.push(error_of(&even, tile, &bright) <= ERROR);
            let ends = of_tile.ends_with(&[true, true]);
            assert_eq!(ends, samples == look * EPOCH, "tile {tile}: {samples} samples, at {look} epochs: {of_tile:?}");
            if ends {
                let same = |cube: &Cube| bits(cube.chunk(tile).expect("readable").expect("there").values());
                assert!(same(&cube) == same(&even), "tile {tile}");
            }
        }
    }
}

#[test]
fn devices_processes_kills_and_goals_before_change_no_bit() {
    let place = Place::new();
    let stop = stop(ERROR);
    let straight = arrays(&place.render("straight.zarr", &with(&stop, &[])));
    let two = place.render("two.zarr", &with(&stop, &["--devices", "2", "--memory", "24MiB"]));
    assert!(arrays(&two) == straight, "two devices");
    // In two processes, of which nobody sees the whole picture.
    for tiles in ["5..9", "0..5"] {
        place.render("parts.zarr", &with(&stop, &["--tiles", tiles]));
    }
    assert!(arrays(&place.cube("parts.zarr")) == straight, "two processes");
    // Up to another error first, and to samples; then killed again and again.
    place.render("cube.zarr", &with(&self::stop(0.2), &["--spp", "64"]));
    let finer = self::stop(ERROR / 2.0);
    let fine = arrays(&place.render("fine.zarr", &with(&finer, &[])));
    for i in 0..12 {
        let devices = ["1", "2"][i % 2];
        let render = ["render", "scene.toml", "-o", "cube.zarr", "--resume", "--quiet", "--devices", devices];
        let mut child = Running(place.command(&[&render, &with(&finer, &[])[..]].concat()).spawn().expect("started"));
        std::thread::sleep(Duration::from_millis(300 + 150 * i as u64));
        // It may have ended already.
        let _ = child.0.kill();
        child.0.wait().expect("ended");
    }
    assert!(arrays(&place.render("cube.zarr", &with(&finer, &["--resume"]))) == fine, "killed");
}

#[test]
fn samples_may_end_a_tile_before() {
    let place = Place::new();
    let (stop, uncertain) = (stop(1e-9), ["--spp", "48"]);
    let done = place.events(&[&["render", "scene.toml", "-o", "cube.zarr"][..], &with(&stop, &uncertain)].concat());
    let start = done.iter().find(|event| event["event"] == "start").expect("start");
    assert_eq!((&start["error_limit"], &start["error_per"]), (&json!(1e-9), &json!("tile")));
    let done = done.last().expect("done");
    assert_eq!((&done["tile_ends"]["ended"], &done["tile_ends"]["by_samples"]), (&json!(9), &json!(9)));
    assert_eq!((samples(&place.cube("cube.zarr")), &done["samples"]), (48, &json!(48)));
    let info = place.events(&["info", "cube.zarr"]).pop().expect("done");
    assert_eq!((&info["work"]["tiles_done"], &info["work"]["tiles_exact"]), (&json!(9), &json!(0)));
    assert_eq!(info["work"]["tile_error_wanted"], json!(1e-9));
    let told = place.success(&["info", "cube.zarr"]).0;
    assert!(told.contains("0 of 9 are within 0.000 %, 9 ended by their samples; the worst has"), "{told}");
    // Nobody has looked at tiles of fewer than eight epochs.
    place.render("few.zarr", &with(&stop, &["--spp", "16"]));
    let told = place.success(&["info", "few.zarr"]).0;
    assert!(told.contains("9 ended by their samples; the worst has not been looked at"), "{told}");
    // What is within is done, whatever it has; nothing is warned of.
    let loose = self::stop(0.2);
    place.render("loose.zarr", &with(&loose, &["--spp", "40000"]));
    let info = place.events(&["info", "loose.zarr"]).pop().expect("done");
    assert_eq!((&info["work"]["tiles_done"], &info["work"]["tiles_exact"]), (&json!(9), &json!(9)));
    let told = place.success(&["export", "loose.zarr", "-o", "picture.png"]).1;
    assert!(!told.contains("warning"), "{told}");
}

/// Weights of products end alike.
#[test]
fn factored_cubes_have_tiles_with_their_own_ends() {
    let place = Place::new();
    let cube = place.render("cube.zarr", &with(&stop(0.04), &["--factored"]));
    let found = cube.all_samples().expect("samples");
    assert!(found.iter().max() > found.iter().min(), "{found:?}");
    assert!(cube.all_looks().expect("looks").iter().flatten().all(|look| *look <= 0.04));
}

#[test]
fn what_does_not_go_together_is_refused() {
    let place = Place::new();
    for (more, words) in [
        (&["--error-per", "tile"][..], "--error <E>"),
        (&["--error", "0.1", "--tiles", "0..1"], "add --error-per tile"),
        (&["--error", "0.1", "--error-per", "pixel"], "possible values: image, tile"),
    ] {
        let output = place.run(&[&["render", "scene.toml", "-o", "cube.zarr"], more].concat());
        let stderr = text(&output.stderr);
        assert!(output.status.code() == Some(2) && stderr.contains(words), "{more:?}: {stderr}");
    }
    assert!(!place.path().join("cube.zarr").exists());
    // A brightness of other channels is not this cube's.
    let cube = place.render("cube.zarr", &with(&stop(1e-9), &["--spp", "4"]));
    fs::write(cube.path().join(".spectile/brightness.json"), r#"{"mean_radiance": [1.0], "samples": 9}"#)
        .expect("written");
    let output =
        place.run(&[&["render", "scene.toml", "-o", "cube.zarr", "--resume"], &with(&stop(1e-9), &[])[..]].concat());
    let stderr = text(&output.stderr);
    assert!(output.status.code() == Some(5) && stderr.contains("of 1 channels where the cube has 5"), "{stderr}");
}
