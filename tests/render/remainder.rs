//! `render --factored` of scenes that separate in part, and `relight` of such cubes, as users meet them.

use std::fs;

use serde_json::Value;
use spectile::cube::Cube;

use super::{Place, Running, SCENE, arrays, samples, spectrum, text};
use crate::outside;

/// The scene with a plastic ball, and a lamp that is off.
fn scene() -> String {
    SCENE.replace(
        "[materials.black.black]",
        r#"[spectra.other]
constant = 0.0

[spectra.varnish]
constant = 0.6

[materials.shiny.plastic]
reflectance = "varnish"
eta = 1.5
roughness = 0.2

[[objects]]
sphere = { center = [0.5, -0.6, -0.2], radius = 0.6 }
material = "shiny"

[[objects]]
sphere = { center = [-0.7, 0.7, 0.2], radius = 0.2 }
material = "black"
emission = "other"

[materials.black.black]"#,
    )
}

const TILES_OF_8: &[&str] = &["--size", "16x16", "--tile", "8", "--factored", "--uncertainty"];
const SPP: &[&str] = &["--spp", "128"];

fn values(cube: &Cube) -> Vec<f32> {
    let [width, height] = cube.header().size;
    (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).flat_map(|(x, y)| spectrum(cube, x, y)).collect()
}

/// In portions, by several devices, tile by tile, after kills at moments anywhere: the same bytes. A bit that flips is found and mended.
#[test]
fn remainders_go_on_where_they_were() {
    let place = Place::of(&scene());
    let straight = arrays(&place.render("straight.zarr", &[TILES_OF_8, SPP].concat()));
    for name in ["weights/c/1/1/0/0", "remainder/c/0/1/1", "remainder_standard_error/c/0/1/1"] {
        assert!(straight.contains_key(name), "{name}: {:?}", straight.keys());
    }
    for tiles in ["0..1", "1..4"] {
        place.render("tiles.zarr", &[TILES_OF_8, SPP, &["--tiles", tiles]].concat());
    }
    assert!(arrays(&place.cube("tiles.zarr")) == straight, "by tiles");
    let begun = place.run(&[&["render", "scene.toml", "-o", "cube.zarr", "--spp", "2"], TILES_OF_8].concat());
    let told = text(&begun.stderr);
    assert!(
        begun.status.success() && told.contains("relight cannot change it: the material \"shiny\" (plastic)"),
        "{told}"
    );
    let again = ["render", "scene.toml", "-o", "cube.zarr", "--resume"];
    for (after_ms, devices) in [(600, "1"), (1100, "2")] {
        let mut child: Running =
            place.start("cube.zarr", &[TILES_OF_8, SPP, &["--resume", "--devices", devices]].concat());
        std::thread::sleep(std::time::Duration::from_millis(after_ms));
        // It may have ended by itself.
        let _ = child.0.kill();
        child.0.wait().expect("ended");
    }
    place.success(&[&again[..], TILES_OF_8, SPP, &["--devices", "2"]].concat());
    assert!(arrays(&place.cube("cube.zarr")) == straight, "after kills");

    let file = place.path().join("cube.zarr/remainder/c/0/1/1");
    let mut bytes = fs::read(&file).expect("read");
    bytes[77] ^= 4;
    fs::write(&file, &bytes).expect("written");
    let output = place.run(&["info", "cube.zarr", "--verify"]);
    assert!(text(&output.stdout).contains("remainder/c/0/1/1 is not what was written"), "{}", text(&output.stdout));
    let (_, stderr) = place.success(&[&again[..], TILES_OF_8, SPP].concat());
    assert!(stderr.contains("rendered again"), "{stderr}");
    assert!(arrays(&place.cube("cube.zarr")) == straight, "mended");
}

/// Whatever reads cubes reads these as it reads the ordinary cube that `relight` makes of them, and both are what a render in channels
/// makes, by the standard errors of all.
#[test]
fn everything_reads_both_parts() {
    let place = Place::of(&scene());
    let cube = place.render("cube.zarr", &["--factored", "--uncertainty", "--tile", "16", "--spp", "512"]);
    let (said, warned) = place.success(&["relight", "cube.zarr", "-o", "plain.zarr"]);
    assert!(said.contains("spectra as they were") && warned.is_empty(), "{said} {warned}");
    let plain = place.cube("plain.zarr");
    assert_eq!((values(&cube), samples(&cube)), (values(&plain), samples(&plain)));
    for (x, y) in [(0, 0), (23, 19), (16, 3)] {
        let of = |cube: &Cube| cube.standard_error(x, y).expect("inside").expect("there");
        assert_eq!(of(&cube), of(&plain));
    }
    for name in ["cube.zarr", "plain.zarr"] {
        place.success(&["export", name, "-o", &format!("{name}.csv")]);
    }
    let [a, b] = ["cube.zarr.csv", "plain.zarr.csv"].map(|name| fs::read(place.path().join(name)).expect("read"));
    assert!(a == b);
    let usual = place.render("usual.zarr", &["--uncertainty", "--spp", "512", "--seed", "2"]);
    let channels = plain.channels().len();
    // Σ of the difference, of its variance, and of what is rendered in channels.
    let mut sums = vec![[0.0; 3]; channels];
    for (x, y) in (0..20).flat_map(|y| (0..24).map(move |x| (x, y))) {
        let of = |cube: &Cube| (spectrum(cube, x, y), cube.standard_error(x, y).expect("inside").expect("there"));
        let ((a, e), (b, f)) = (of(&plain), of(&usual));
        for (k, [difference, variance, sum]) in sums.iter_mut().enumerate() {
            let [a, b, e, f] = [a[k], b[k], e[k], f[k]].map(f64::from);
            (*difference, *variance, *sum) = (*difference + a - b, *variance + e * e + f * f, *sum + b);
        }
    }
    for (k, [difference, variance, sum]) in sums.into_iter().enumerate() {
        assert!(variance.sqrt() < 0.01 * sum, "channel {k}: nothing can be seen");
        assert!(difference.abs() < 4.0 * variance.sqrt(), "channel {k}: {:.2} sigma", difference / variance.sqrt());
    }
    let (told, _) = place.success(&["info", "cube.zarr"]);
    let line = told.lines().find(|line| line.starts_with("remainder")).expect("a line");
    assert!(line.contains(" % of the radiance") && line.contains("\"shiny\" (plastic)"), "{line}");
    let share = |line: &str| -> f64 {
        let words = line.split(" % of the radiance").next().expect("a share");
        words.rsplit(' ').next().expect("a number").trim().parse().expect("a number")
    };
    let (planned, _) = place.success(&["plan", "scene.toml", "--pilot"]);
    let planned = planned.split_whitespace().collect::<Vec<_>>().join(" ");
    let (_, planned) = planned.split_once("separates in part").expect("a share");
    assert!(planned.contains("\"shiny\" (plastic)"), "{planned}");
    let (guess, found) = (share(planned), share(line));
    assert!((guess - found).abs() < 0.2 * found, "{guess} % by few samples, {found} % in the end");
    if let Some(mut python) = outside::python("read_weights.py") {
        let output = python.arg(cube.path()).arg(plain.path()).output().expect("python");
        assert!(output.status.success(), "{}", text(&output.stderr));
    }
}

/// Other spectra change what separates, and it is told how much does not; other channels are unions of those rendered, or without it.
#[test]
fn what_cannot_be_changed_is_told() {
    let place = Place::of(&scene());
    let cube = place.render("cube.zarr", &["--factored", "--spp", "128"]);
    let attributes = |name: &str| place.cube(name).header().attributes["derived"].clone();
    let shares = |value: &Value| -> Vec<f64> {
        value.as_array().expect("a list").iter().map(|share| share.as_f64().expect("a number")).collect()
    };
    let relight = |name: &str, more: &[&str]| place.success(&[&["relight", "cube.zarr", "-o", name], more].concat());

    let (said, warned) = relight("lit.zarr", &["--set", "spectra.other=2.0"]);
    assert!(
        warned.contains("does not separate and is as it was rendered: the material \"shiny\" (plastic)"),
        "{warned}"
    );
    assert!(said.contains("error estimate at most") && !said.contains("NaN"), "{said}");
    let derived = attributes("lit.zarr");
    assert_eq!(derived["not_relit"], serde_json::json!(["the material \"shiny\" (plastic)"]));
    let of_render = shares(&derived["remainder_share"]);
    assert!(of_render.iter().all(|share| (0.01..0.8).contains(share)), "{of_render:?}");

    // Of the first two channels and the last three, exactly.
    let unions = "channels.intervals=[[400, 520], [520, 700]]";
    relight("unions.zarr", &["--channels", unions]);
    let unions = place.cube("unions.zarr");
    for (x, y) in [(3, 3), (16, 15), (20, 7)] {
        let (fine, of_unions) = (spectrum(&cube, x, y), spectrum(&unions, x, y));
        let means = [fine[..2].iter().sum::<f32>() / 2.0, fine[2..].iter().sum::<f32>() / 3.0];
        for (mean, value) in means.iter().zip(&of_unions) {
            assert!((mean - value).abs() <= 1e-6 * mean, "{fine:?} {of_unions:?}");
        }
    }

    let output = place.run(&["relight", "cube.zarr", "-o", "out.zarr", "--set", "spectra.varnish=0.1"]);
    let told = text(&output.stderr);
    let why = "\"varnish\" reaches the picture only by what does not separate (the material \"shiny\" (plastic))";
    assert!(output.status.code() == Some(2) && told.contains(why), "{told}");
    let output = place.run(&["relight", "cube.zarr", "-o", "out.zarr", "--channels", "equal.count=3"]);
    let said = text(&output.stderr);
    let words =
        ["channel 0", "is no union of channels", " % of the radiance there", "--without-remainder", "(plastic)"];
    assert!(output.status.code() == Some(2) && words.iter().all(|words| said.contains(words)), "{said}");
    assert!(!place.path().join("out.zarr").exists());

    let (_, warned) = relight("without.zarr", &["--channels", "equal.count=3", "--without-remainder"]);
    assert!(warned.contains("is left out: the material \"shiny\""), "{warned}");
    let derived = attributes("without.zarr");
    assert_eq!(derived["left_out"], serde_json::json!(["the material \"shiny\" (plastic)"]));
    let left_out = shares(&derived["remainder_share"]);
    let both = relight("same.zarr", &["--without-remainder"]);
    assert!(both.1.contains("is left out"), "{both:?}");
    let sum = |name: &str| values(&place.cube(name)).iter().map(|value| f64::from(*value)).sum::<f64>();
    let kept = sum("same.zarr") / values(&cube).iter().map(|value| f64::from(*value)).sum::<f64>();
    let share = left_out.iter().sum::<f64>() / 3.0;
    assert!((1.0 - kept - share).abs() < 0.02, "{kept} is kept, {share} left out");
}

/// Sums of responses, tiles with ends of their own: with a remainder as without.
#[test]
fn remainders_are_summed_over_responses_and_end_by_tile() {
    let place = Place::of(&scene());
    fs::write(place.path().join("s.csv"), "wavelength_nm,red,blue\n420,0,0\n450,0,1\n480,0,0\n590,0.5,0\n640,1,0\n")
        .expect("written");
    let bands = ["--set", "channels.responses=s.csv", "--factored", "--spp", "128"];
    let cube = place.render("bands.zarr", &bands);
    let usual = place.render("usual.zarr", &[&bands[..2], &["--spp", "128", "--seed", "3"]].concat());
    let mean = |cube: &Cube, k: usize| values(cube).iter().skip(k).step_by(2).map(|v| f64::from(*v)).sum::<f64>();
    for k in 0..2 {
        let ratio = mean(&cube, k) / mean(&usual, k);
        assert!((ratio - 1.0).abs() < 0.05, "band {k}: {ratio}");
    }
    let (_, warned) = place.success(&["relight", "bands.zarr", "-o", "same.zarr", "--responses", "s.csv"]);
    assert!(warned.is_empty(), "{warned}");
    assert_eq!(values(&cube), values(&place.cube("same.zarr")));
    let ends = ["--size", "8x8", "--factored", "--spp", "512", "--error", "0.5", "--error-per", "tile"];
    place.render("ends.zarr", &ends);
    let bright: Value = serde_json::from_str(
        &fs::read_to_string(place.path().join("ends.zarr/.spectile/brightness.json")).expect("read"),
    )
    .expect("JSON");
    let known = bright["mean_radiance"].as_array().expect("a list").clone();
    assert!(known.iter().all(|mean| mean.as_f64().is_some_and(|mean| mean > 0.0)), "{known:?}");
}
