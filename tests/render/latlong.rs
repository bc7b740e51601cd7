//! `camera.latlong` makes environment maps: what it sees, used as a sky, is seen again.

use spectile::cube::Cube;

use super::Place;

const ROOM: &str = r#"
[camera.latlong]
position = [0.1, -0.2, 0.3]
up = [0.2, 0.3, 1]
rotate_degrees = 35

[film]
width = 32
height = 16

[channels]
intervals = [[400, 500], [500, 600]]

[integrator]
max_bounces = 0
epoch = 1024

[materials.lamp.black]
"#;

/// Six walls of their own radiance, in two channels.
fn room() -> String {
    let walls = [
        ("[-1, -1, -1]", "[0, 2, 0]", "[2, 0, 0]"),
        ("[-1, -1, 1]", "[2, 0, 0]", "[0, 2, 0]"),
        ("[-1, -1, -1]", "[2, 0, 0]", "[0, 0, 2]"),
        ("[-1, 1, -1]", "[0, 0, 2]", "[2, 0, 0]"),
        ("[-1, -1, -1]", "[0, 0, 2]", "[0, 2, 0]"),
        ("[1, -1, -1]", "[0, 2, 0]", "[0, 0, 2]"),
    ];
    let wall = |(i, (corner, u, v)): (usize, &(&str, &str, &str))| {
        let [a, b] = [1.0 + i as f64, 7.5 - i as f64];
        format!(
            "\n[[objects]]\nquad = {{ corner = {corner}, edge_u = {u}, edge_v = {v} }}\nmaterial = \"lamp\"\nemission_sides = \"both\"\n\
             emission = {{ samples = [[400, {a}], [500, {a}], [500.001, {b}], [600, {b}]] }}\n"
        )
    };
    walls.iter().enumerate().map(wall).collect()
}

/// A map that is seen from inside is, in each pixel, the mean of what is bilinear between its texels: 3/4 of the texel's own value and 1/8 of
/// each neighbour's, along both axes. With 1,024 samples that are a net the error is at most their discrepancy, (m/2 + 3/2) / 2^m
/// with m = 10 (Niederreiter 1992, theorem 4.7), times the variation, three times the range of the nine texels that have a part in it.
#[test]
fn a_map_that_was_rendered_is_the_sky_that_was_seen() {
    let place = Place::of(&format!("{ROOM}{}", room()));
    let spp = ["--spp", "1024"];
    let seen = place.render("sky.zarr", &spp);
    let sky = "\n[environment]\nmap = \"sky.zarr\"\nup = [0.2, 0.3, 1]\nrotate_degrees = 35\n";
    std::fs::write(place.path().join("scene.toml"), format!("{ROOM}{sky}")).expect("written");
    let again = place.render("again.zarr", &spp);
    let at = |x: i64, y: i64, k: usize| {
        let (x, y) = (x.rem_euclid(32) as u32, y.clamp(0, 15) as u32);
        f64::from(seen.spectrum(x, y).expect("read").expect("there")[k])
    };
    let discrepancy = (5.0 + 1.5) / 1024.0;
    let mut most = 0.0f64;
    for (x, y) in (0..16).flat_map(|y| (0..32).map(move |x| (x, y))) {
        let found = again.spectrum(x as u32, y as u32).expect("read").expect("there");
        for (k, &found) in found.iter().enumerate() {
            let around = (-1..=1).flat_map(|j| (-1..=1).map(move |i| (i, j)));
            let (mut expected, mut low, mut high) = (0.0, f64::INFINITY, 0.0f64);
            for (i, j) in around {
                let value = at(x + i, y + j, k);
                let weight = |i: i64| if i == 0 { 0.75 } else { 0.125 };
                expected += weight(i) * weight(j) * value;
                (low, high) = (low.min(value), high.max(value));
            }
            let bound = 3.0 * discrepancy * (high - low) + 1e-5 * high;
            let off = (f64::from(found) - expected).abs();
            assert!(off <= bound, "pixel {x} {y}, channel {k}: {found} {expected} {bound}");
            most = most.max(off / bound);
        }
    }
    // The map has edges, so that a wrong turn or a flip is far beyond that.
    println!("{most:.3} of the bound");
    let flat = (0..32).all(|x| (at(x, 4, 0) - at(x + 1, 4, 0)).abs() < 0.5);
    assert!(!flat, "a poor test");
}

/// In a furnace all directions are the same, to the last bit.
#[test]
fn a_furnace_is_even() {
    let place = Place::of(&format!("{ROOM}\n[environment]\nradiance = 0.7\n"));
    let cube = place.render("cube.zarr", &["--spp", "8"]);
    for (x, y) in (0..16).flat_map(|y| (0..32).map(move |x| (x, y))) {
        assert_eq!(cube.spectrum(x, y).expect("read").expect("there"), [0.7, 0.7], "{x} {y}");
    }
    // A film of another shape is seldom meant.
    let output = place.run(&["plan", "scene.toml", "--set", "film.width=30"]);
    assert!(crate::binary::text(&output.stderr).contains("twice as wide as high"));
}

/// An OpenEXR file of what a sensor saw, as a sky under the same sensor. A band that is even comes back as it is. Of another one the file
/// says the response, and it is even over the width at half of its height: of 600 to 700 nm with edges of 20 nm that is 610 to 690 nm.
/// The response has 75 of its integral of 80 nm there; 2.5 below, where the sky is linear from the one band, 1 at 500 nm, to the other, 4
/// at 610; and 2.5 above, where it is 0. Of N samples each is there or not, so that their mean is off by 4 √(p (1 - p) / N), p = 2.5/80,
/// and hardly by what is below.
#[test]
fn what_a_sensor_saw_comes_back_from_openexr() {
    let place = Place::of(&format!(
        "{ROOM}\n[environment]\nradiance = {{ samples = [[300, 1], [550, 1], [550, 4], [900, 4]] }}\n"
    ));
    let responses = "nm,even,edged\n400,1,\n500,1,\n600,,0\n620,,1\n680,,1\n700,,0\n";
    std::fs::write(place.path().join("s.csv"), responses).expect("written");
    let sensor = ["--set", "channels.responses=s.csv"];
    let seen = place.render("seen.zarr", &[&["--spp", "1"][..], &sensor].concat());
    let pixels = |cube: &Cube| -> Vec<[f64; 2]> {
        let places = (0..16).flat_map(|y| (0..32).map(move |x| (x, y)));
        let found = places.map(|(x, y)| cube.spectrum(x, y).expect("read").expect("there"));
        found.map(|found| [0, 1].map(|k| f64::from(found[k]))).collect()
    };
    let mean = |pixels: &[[f64; 2]]| pixels.iter().map(|pixel| pixel[1]).sum::<f64>() / pixels.len() as f64;
    let [low, high] = [f64::min, f64::max].map(|of| pixels(&seen).iter().map(|pixel| pixel[1]).fold(4.0, of));
    // Where its wavelengths fall leaves a path 5 % of a flat spectrum at most.
    let known = 4.0 * 4.0 * 0.05 / f64::from(32 * 16).sqrt();
    assert!((mean(&pixels(&seen)) - 4.0).abs() < known, "{low} to {high}");
    place.success(&["export", "seen.zarr", "-o", "seen.exr"]);
    let sky = "\n[environment]\nmap = \"seen.exr\"\nup = [0.2, 0.3, 1]\nrotate_degrees = 35\n";
    std::fs::write(place.path().join("scene.toml"), format!("{ROOM}{sky}")).expect("written");
    let again = pixels(&place.render("again.zarr", &[&["--spp", "64"][..], &sensor].concat()));
    // The integral from 600 to 610 nm of (nm - 600) / 20 times 1 + 3 (nm - 500) / 110.
    let below = ((1.0 + 300.0 / 110.0) * 50.0 + 3.0 / 110.0 * 1000.0 / 3.0) / 20.0;
    let (expected, share): (f64, f64) = ((4.0 * 75.0 + below) / 80.0, 2.5 / 80.0);
    let bound = 4.0 * 4.0 * (share * (1.0 - share) / (again.len() * 64) as f64).sqrt();
    let found = mean(&again);
    println!("{found} of {expected} ± {bound}");
    assert!(again.iter().all(|pixel| (pixel[0] - 1.0).abs() < 1e-6), "{again:?}");
    assert!((found - expected).abs() < bound, "{found}");
    // Where the file has the band, it has all of its radiance; beyond the last none.
    let within = ["--spp", "1", "--set", "channels.intervals=[[400, 500], [610.5, 689.5], [691, 699]]"];
    let within = place.render("within.zarr", &within).spectrum(7, 7).expect("read").expect("there");
    assert!((within[0] - 1.0).abs() < 1e-6 && within[2] == 0.0, "{within:?}");
    assert!((low - 1e-5..high + 1e-5).contains(&f64::from(within[1])), "{within:?}");
}
