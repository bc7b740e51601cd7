//! `--uncertainty`: standard errors that are what they say, survive whatever radiance survives, and cost nothing unasked.

use serde_json::Value;
use spectile::cube::Cube;
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::{Place, arrays, samples, spectrum};

fn errors(cube: &Cube, x: u32, y: u32) -> Vec<f32> {
    cube.standard_error(x, y).expect("inside").expect("there")
}

fn pixels(cube: &Cube) -> impl Iterator<Item = (u32, u32)> + use<> {
    let [width, height] = cube.header().size;
    (0..height).flat_map(move |y| (0..width).map(move |x| (x, y)))
}

/// 95 % intervals by Student's t from B epochs hold the truth in 93 to 97 %, over all pixels. The truth is a render of
/// 4,096 other samples, whose own error is part of the interval.
#[test]
fn intervals_hold_the_truth() {
    let place = Place::new();
    let scene = ["--size", "32x24", "--tile", "16", "--uncertainty"];
    let truth = place.render("truth.zarr", &[&scene[..], &["--seed", "1", "--spp", "4096"]].concat());
    let mut all = (0u32, 0u32);
    for (epochs, seed) in [("1024", "2"), ("1024", "3"), ("2048", "4")] {
        let cube = place.render("cube.zarr", &[&scene[..], &["--seed", seed, "--spp", epochs, "--overwrite"]].concat());
        let freedom = f64::from(samples(&cube) / 64 - 1);
        let t = StudentsT::new(0.0, 1.0, freedom).expect("freedom").inverse_cdf(0.975);
        let (mut inside, mut count) = (0, 0);
        for (x, y) in pixels(&cube) {
            let (values, of_truth) = (spectrum(&cube, x, y), spectrum(&truth, x, y));
            let (e, f) = (errors(&cube, x, y), errors(&truth, x, y));
            for k in 0..values.len() {
                let error = f64::from(e[k]).hypot(f64::from(f[k]));
                // What is black in every sample has no error and no interval.
                if error > 0.0 {
                    count += 1;
                    inside += u32::from(f64::from(values[k] - of_truth[k]).abs() <= t * error);
                }
            }
        }
        println!("{epochs} samples: {inside} of {count}, {:.2} %", 100.0 * f64::from(inside) / f64::from(count));
        all = (all.0 + inside, all.1 + count);
    }
    let share = f64::from(all.0) / f64::from(all.1);
    assert!(all.1 > 5_000 && (0.93..=0.97).contains(&share), "{share}");
}

/// In portions, interrupted, on other devices, in other tiles of work: the same bytes.
#[test]
fn errors_go_on_where_they_were() {
    let place = Place::new();
    let more = ["--tile", "8", "--uncertainty"];
    let straight = place.render("straight.zarr", &[&more[..], &["--spp", "320"]].concat());
    let expected = arrays(&straight);
    assert!(expected.keys().any(|name| name.starts_with("standard_error/c/0/2/2")), "{:?}", expected.keys());
    for spp in ["1", "64", "128", "192"] {
        let existing: &[&str] = if spp == "1" { &[] } else { &["--resume"] };
        place.render("parts.zarr", &[&more[..], existing, &["--spp", spp]].concat());
    }
    let parts = place.render("parts.zarr", &[&more[..], &["--resume", "--spp", "320", "--devices", "2"]].concat());
    assert!(arrays(&parts) == expected);
    // One tile after another, as several processes would.
    for tiles in ["0..4", "4..9"] {
        place.render("tiles.zarr", &[&more[..], &["--spp", "320", "--tiles", tiles]].concat());
    }
    assert!(arrays(&place.cube("tiles.zarr")) == expected);
    let (text, _) = place.success(&["info", "straight.zarr", "--verify"]);
    assert!(text.contains("from 5 epochs (Student's t, 4 degrees of freedom)") && text.contains("0 damaged"), "{text}");
    // It is part of what the cube is.
    let output = place.run(&["render", "scene.toml", "-o", "straight.zarr", "--tile", "8", "--resume", "--spp", "384"]);
    let stderr = super::text(&output.stderr);
    assert!(output.status.code() == Some(2) && stderr.contains("uncertainty"), "{stderr}");
}

#[test]
fn errors_are_there_only_when_asked_for() {
    let place = Place::new();
    let plain = place.render("plain.zarr", &["--spp", "128"]);
    let with = place.render("with.zarr", &["--spp", "128", "--uncertainty"]);
    assert_eq!(plain.standard_error(3, 3).expect("read"), None);
    // Nothing else changes by it.
    let radiance =
        |cube: &Cube| arrays(cube).into_iter().filter(|(name, _)| name.starts_with("radiance/c")).collect::<Vec<_>>();
    assert!(radiance(&plain) == radiance(&with));
    assert!(!arrays(&plain).keys().any(|name| name.starts_with("standard_error")));
    // Below two epochs nothing is known.
    let few = place.render("few.zarr", &["--spp", "64", "--uncertainty"]);
    assert!(pixels(&few).all(|(x, y)| errors(&few, x, y).iter().all(|e| e.is_nan())));
    assert!(pixels(&with).all(|(x, y)| errors(&with, x, y).iter().all(|e| *e >= 0.0)));
    // Without a limit there are enough epochs for them.
    let said = place.events(&["render", "scene.toml", "-o", "default.zarr", "--uncertainty", "--size", "8x8"]);
    assert_eq!(said.last().expect("done")["samples"], Value::from(512));

    let (x, y) = pixels(&with).find(|&(x, y)| errors(&with, x, y).iter().all(|e| *e > 0.0)).expect("a lit pixel");
    let (column, row) = (x.to_string(), y.to_string());
    let (csv, _) = place.success(&["spectrum", "with.zarr", &column, &row, "--plot", "p.svg"]);
    assert!(csv.starts_with("wavelength_nm,radiance,standard_error\n") && csv.lines().count() == 6, "{csv}");
    let last = csv.lines().last().expect("a line").rsplit(',').next().expect("a cell").parse::<f32>();
    assert_eq!(last.ok(), errors(&with, x, y).last().copied());
    let svg = std::fs::read_to_string(place.path().join("p.svg")).expect("written");
    assert!(svg.contains("opacity=\"0.25\""));
    let (csv, _) = place.success(&["spectrum", "plain.zarr", "3", "3"]);
    assert!(csv.starts_with("wavelength_nm,radiance\n"));
}

/// Exports carry them, and `compare` tests with them.
#[test]
fn errors_are_exported_and_compared() {
    let place = Place::new();
    let a = place.render("a.zarr", &["--spp", "1024", "--uncertainty", "--seed", "1"]);
    place.render("b.zarr", &["--spp", "1024", "--uncertainty", "--seed", "2"]);
    place.success(&["export", "a.zarr", "-o", "e.bip", "--standard-error"]);
    let bytes = std::fs::read(place.path().join("e.bip")).expect("written");
    let expected: Vec<u8> = pixels(&a).flat_map(|(x, y)| errors(&a, x, y)).flat_map(f32::to_le_bytes).collect();
    assert!(bytes == expected);
    place.success(&["export", "a.zarr", "-o", "e.zarr"]);
    assert!(place.path().join("e.zarr/standard_error/c/0/0/0").exists());
    let output = place.run(&["export", "e.zarr", "-o", "x.csv"]);
    assert_eq!(output.status.code(), Some(5), "an export is no cube");

    let done = place.events(&["compare", "a.zarr", "b.zarr"]).pop().expect("done");
    for channel in done["channels"].as_array().expect("channels") {
        let number = |key: &str| channel[key].as_f64().expect("a number");
        // 480 pixels, variances from 16 epochs: t² has a mean of 15/13, and the root of their mean spreads by 3 to 4 %.
        assert!(number("z").abs() < 4.5 && (0.85..1.3).contains(&number("z_rms")), "{channel}");
    }
    // A bias of 20 % is seen in every channel.
    place.render("c.zarr", &["--spp", "1024", "--seed", "3", "--set", "spectra.lamp.scale=1.2"]);
    let done = place.events(&["compare", "c.zarr", "a.zarr"]).pop().expect("done");
    for channel in done["channels"].as_array().expect("channels") {
        assert!(channel["z"].as_f64().expect("a number") > 10.0, "{channel}");
    }
    let (table, _) = place.success(&["compare", "a.zarr", "b.zarr"]);
    assert!(table.lines().next().is_some_and(|line| line.contains("z_rms")), "{table}");
}
