//! What a render leaves on disk, and that nothing but scene, settings and seed decides it.

use serde_json::{Value, json};

use super::{Place, arrays, png, samples, spectrum};

#[test]
fn render_info_spectrum_export_compare() {
    let place = Place::new();
    let (stdout, _) = place.success(&["render", "scene.toml", "-o", "cube.zarr"]);
    assert!(stdout.starts_with("cube.zarr: 64 samples/pixel in ") && stdout.contains("30,720 paths"), "{stdout}");
    let cube = place.cube("cube.zarr");
    assert_eq!(samples(&cube), 64);

    let info = place.success(&["info", "cube.zarr"]).0;
    assert!(info.contains("24 x 20 pixels x 5 channels") && info.contains("64 per pixel"), "{info}");
    let csv = place.success(&["spectrum", "cube.zarr", "12", "15"]).0;
    let values: Vec<f32> = csv
        .lines()
        .skip(1)
        .map(|line| line.split_once(',').expect("two columns").1.parse().expect("a number"))
        .collect();
    assert_eq!(values, spectrum(&cube, 12, 15));
    // The floor is lit by a lamp whose spectrum rises from 1 to 2: every sample holds the same paths in all channels.
    assert!(values.windows(2).all(|pair| 0.0 < pair[0] && pair[0] < pair[1]), "{values:?}");

    place.success(&["export", "cube.zarr", "-o", "picture.png"]);
    assert_eq!(png(&place.path().join("picture.png")).0, [24, 20]);
    place.success(&["compare", "cube.zarr", "cube.zarr", "--tolerance", "0"]);
    // Another seed is another picture of the same thing, and twice the samples make a better one.
    place.render("other.zarr", &["--seed", "1"]);
    place.render("long.zarr", &["--seed", "2", "--spp", "4096"]);
    let error = |name: &str| {
        let done = place.events(&["compare", name, "long.zarr"]).pop().expect("done");
        done["rel_mse"]["mean"].as_f64().expect("relMSE")
    };
    let (a, b) = (error("cube.zarr"), error("other.zarr"));
    assert!(0.0 < a && a < 2.0 * b && b < 2.0 * a, "two seeds are as noisy: {a} and {b}");
    place.render("better.zarr", &["--seed", "3", "--spp", "1024"]);
    let c = error("better.zarr");
    assert!(c < 0.25 * a, "16 times the samples: {c}, not 1/16 of {a}");
}

#[test]
fn the_seed_decides_every_bit() {
    let place = Place::new();
    let spp = ["--spp", "192", "--tile", "16"];
    let [first, second] = ["1.zarr", "2.zarr"].map(|name| place.render(name, &spp));
    assert_eq!(arrays(&first), arrays(&second));
    let again = place.render("1.zarr", &[&spp[..], &["--overwrite"]].concat());
    assert_eq!(arrays(&again), arrays(&second));
    let other = place.render("3.zarr", &[&spp[..], &["--seed", "18446744073709551615"]].concat());
    let (first, other) = (arrays(&first), arrays(&other));
    assert!(first.keys().eq(other.keys()));
    let chunks: Vec<_> = first.keys().filter(|name| name.starts_with("radiance/c/")).collect();
    assert_eq!(chunks.len(), 4);
    for name in chunks {
        assert!(first[name] != other[name], "{name} does not depend on the seed");
    }
}

#[test]
fn tiles_change_the_files_not_the_values() {
    let place = Place::new();
    let whole = place.render("whole.zarr", &["--spp", "32"]);
    assert_eq!(whole.grid().count(), 1);
    for (tile, count) in [("8", 9), ("16", 4)] {
        let cube = place.render(&format!("{tile}.zarr"), &["--spp", "32", "--tile", tile]);
        assert_eq!(cube.grid().count(), count);
        for (x, y) in (0..20).flat_map(|y| (0..24).map(move |x| (x, y))) {
            assert_eq!(spectrum(&cube, x, y), spectrum(&whole, x, y), "tile {tile}, pixel {x} {y}");
        }
    }
    // Nor does a crop: its pixels, and their random numbers, are those of the full film.
    let crop = place.render("crop.zarr", &["--spp", "32", "--set", "film.crop=[5, 3, 18, 20]"]);
    assert_eq!((crop.header().size, crop.header().origin), ([13, 17], [5, 3]));
    for (x, y) in (0..17).flat_map(|y| (0..13).map(move |x| (x, y))) {
        assert_eq!(spectrum(&crop, x, y), spectrum(&whole, x + 5, y + 3), "cropped pixel {x} {y}");
    }
}

#[test]
fn samples_end_with_an_epoch_which_is_said() {
    let place = Place::new();
    let (_, stderr) = place.success(&["render", "scene.toml", "-o", "5.zarr", "--spp", "5"]);
    assert_eq!(samples(&place.cube("5.zarr")), 8);
    assert!(stderr.contains("--spp 5 is rounded up to 8 samples/pixel"), "{stderr}");
    for (asked, rounded) in [(1, 1), (2, 2), (64, 64), (65, 128), (130, 192)] {
        let (name, spp) = (format!("{asked}.zarr"), asked.to_string());
        let events = place.events(&["render", "scene.toml", "-o", &name, "--spp", &spp]);
        assert_eq!((&events[0]["samples_asked"], &events[0]["samples_limit"]), (&json!(asked), &json!(rounded)));
        assert_eq!(samples(&place.cube(&name)), rounded);
        let (_, stderr) = place.success(&["render", "scene.toml", "-o", &name, "--spp", &spp, "--overwrite"]);
        assert_eq!(stderr.contains("rounded up"), asked != rounded, "{stderr}");
    }
    // Full epochs of another length.
    let cube = place.render("epoch.zarr", &["--spp", "5", "--set", "integrator.epoch=2"]);
    assert_eq!((samples(&cube), cube.header().epoch), (6, 2));
}

#[test]
fn time_ends_a_render_with_an_epoch() {
    let place = Place::new();
    let done = place.until_a_full_epoch(&["--tile", "8"]);
    let n = samples(&place.cube("cube.zarr"));
    assert!(n >= 64 && n.is_multiple_of(64), "{n}");
    assert_eq!((&done["event"], &done["samples"], &done["units"]), (&json!("done"), &json!(n), &json!(9)));
    // One epoch there always is, and the first of several rules stops.
    let soon = place.success(&["render", "scene.toml", "-o", "soon.zarr", "--time", "1e-9", "--spp", "1000"]).0;
    assert_eq!(samples(&place.cube("soon.zarr")), 1);
    assert!(
        soon.contains("--time: the next 1 samples/pixel, of about") && soon.contains("do not fit any more"),
        "{soon}"
    );
    assert_eq!(samples(&place.render("few.zarr", &["--time", "1h", "--spp", "4"])), 4);
}

#[test]
fn overrides_take_effect() {
    let place = Place::new();
    let cube = place.render(
        "cube.zarr",
        &["--spp", "1", "--size", "10x7", "--set", "channels.equal.count=3", "--set", "integrator.max_bounces=0"],
    );
    assert_eq!((cube.header().size, cube.channels().len()), ([10, 7], 3));
    // Nothing is scattered: without emission of their own, wall and floor are black.
    assert_eq!(spectrum(&cube, 5, 4), [0.0; 3]);
    let brighter = place.render("2.zarr", &["--spp", "1", "--set", "objects.2.emission=2"]);
    let constant = spectrum(&brighter, 12, 15);
    assert!(constant[0] > 0.0 && constant.iter().all(|&v| v == constant[0]), "{constant:?}");
    // A sibling of an exclusive key replaces it.
    let set = "channels.wavenumber={ from = 1000, to = 2000, count = 2 }";
    let thermal = place.render("3.zarr", &["--spp", "1", "--set", set]);
    assert_eq!(thermal.channels().bounds.iter().map(|b| b[0].round()).collect::<Vec<_>>(), [5000.0, 6667.0]);
}

#[test]
fn previews_are_pictures() {
    let place = Place::new();
    let (stdout, _) = place.success(&["render", "scene.toml", "-o", "cube.zarr", "--preview", "auto.png"]);
    let (size, pixels) = png(&place.path().join("auto.png"));
    assert_eq!(size, [24, 20]);
    // Exposed so that 1 % of the lit pixels are white, and exported alike.
    assert!(pixels.contains(&255) && stdout.contains("auto.png: exposure "), "{stdout}");
    place.success(&["export", "cube.zarr", "-o", "exported.png"]);
    assert_eq!(png(&place.path().join("exported.png")).1, pixels);
    // At 0 EV a radiance of 1 is white: halve and halve again what is there.
    let events = place.events(&["render", "scene.toml", "-o", "2.zarr", "--preview", "dark.png", "--exposure", "-8"]);
    assert_eq!(events.last().expect("done")["exposure_ev"], Value::from(-8.0));
    let dark = png(&place.path().join("dark.png")).1;
    assert!(dark.iter().zip(&pixels).all(|(dark, auto)| dark <= auto) && dark.iter().max() < pixels.iter().max());
}
