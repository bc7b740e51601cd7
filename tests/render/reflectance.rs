//! `export --reflectance`: of a ground under a sun, what the scene says its paint reflects, by a rendered white reference and by the
//! irradiance.

use std::fs;

use super::Place;

/// A painted ground seen from above, under a sun in the zenith; a wedge that shades and brightens its neighbourhood.
const GROUND: &str = r#"
[camera.perspective]
position = [0.0, 0.0, 4.0]
look_at = [0.0, 0.0, 0.0]
up = [0.0, 1.0, 0.0]
fov = 30.0

[film]
width = 9
height = 5

[channels]
equal = { from = 400.0, to = 800.0, count = 4 }

[integrator]
max_bounces = 1

[materials.paint.diffuse]
reflectance = { samples = [[400, 0.1], [500, 0.1], [500, 0.3], [600, 0.3], [600, 0.7], [800, 0.7]] }

[[objects]]
quad = { corner = [-9, -9, 0], edge_u = [18, 0, 0], edge_v = [0, 18, 0] }
material = "paint"

[[lights]]
directional = { direction = [0, 0, -1], irradiance = "am1.5" }
"#;

const PAINT: [f64; 4] = [0.1, 0.3, 0.7, 0.7];
const WHITE: [&str; 2] = ["--set", "materials.paint.diffuse.reflectance=1"];

/// Lines of the table after its head: the values of each pixel.
fn factors(place: &Place, more: &[&str]) -> Vec<Vec<f64>> {
    place.success(&[&["export", "paint.zarr", "-o", "r.csv"], more].concat());
    let table = fs::read_to_string(place.path().join("r.csv")).expect("written");
    let numbers = |line: &str| line.split(',').skip(2).map(|cell| cell.parse().unwrap_or(f64::NAN)).collect();
    table.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit())).map(numbers).collect()
}

#[test]
fn a_painted_ground_has_the_reflectance_of_its_paint() {
    let place = Place::of(GROUND);
    place.render("paint.zarr", &["--spp", "64"]);
    place.render("white.zarr", &[&["--spp", "64"][..], &WHITE].concat());
    for white in ["white.zarr", "am1.5", "{ file = \"sun.csv\", column = \"direct\", scale = 0.5 }"] {
        if white.starts_with('{') {
            // Twice the sun, in another unit, as a file of one's own.
            let text = "wavelength_nm,other,direct (W m-2 um-1)\n300,1,2000\n900,1,2000\n";
            fs::write(place.path().join("sun.csv"), text).expect("written");
            place.render("paint.zarr", &["--spp", "64", "--overwrite", "--set", "lights.0.directional.irradiance=1"]);
        }
        let pixels = factors(&place, &["--reflectance", white]);
        assert_eq!(pixels.len(), 45);
        for factor in &pixels {
            assert_eq!(factor.len(), 4, "{factor:?}");
            for (got, want) in factor.iter().zip(PAINT) {
                // By irradiance, what wavelengths of 64 samples miss of the sun's lines in a channel of 100 nm.
                let bound = if white == "am1.5" { 0.03 } else { 1e-4 };
                assert!((got / want - 1.0).abs() < bound, "{white}: {factor:?}");
            }
        }
    }
    // Of some bands and pixels, in other formats.
    let part = ["--reflectance", "white.zarr", "--bands", "3,1", "--crop", "2,1,5,3"];
    place.render("paint.zarr", &["--spp", "64", "--overwrite"]);
    let pixels = factors(&place, &part);
    assert!(
        pixels.len() == 6 && pixels.iter().all(|p| (p[0] - 0.7).abs() < 1e-4 && (p[1] - 0.3).abs() < 1e-4),
        "{pixels:?}"
    );
    place.success(&[&["export", "paint.zarr", "-o", "r.img"], &part[..]].concat());
    let header = fs::read_to_string(place.path().join("r.hdr")).expect("a header");
    assert!(header.contains("data units = reflectance") && header.contains("white reference"), "{header}");
    place.success(&[&["export", "paint.zarr", "-o", "r.zarr"], &part[..]].concat());
    let about = fs::read_to_string(place.path().join("r.zarr/reflectance/zarr.json")).expect("an array");
    assert!(about.contains("hemispherical-directional reflectance factor"), "{about}");
}

#[test]
fn references_that_do_not_fit_are_refused() {
    let place = Place::of(GROUND);
    place.render("paint.zarr", &["--spp", "1"]);
    place.render("few.zarr", &["--spp", "1", "--set", "channels.equal.count=2"]);
    place.render("small.zarr", &["--spp", "1", "--size", "8x5"]);
    fs::write(place.path().join("infrared.csv"), "nm,e\n3000,1\n5000,1\n").expect("written");
    for (white, output, words) in [
        ("few.zarr", "r.csv", "other channels, 2 from 400 to 800 nm"),
        ("small.zarr", "r.csv", "the pixels 8 x 5"),
        ("none.zarr", "r.csv", "none.zarr"),
        ("none.csv", "r.csv", "none.csv"),
        ("-1", "r.csv", "an irradiance must lie in [0, 1e35], but is -1"),
        ("infrared.csv", "r.csv", "nothing arrives in any channel"),
        ("am0", "r.exr", "--reflectance goes with"),
        ("am0", "r.png", "--reflectance goes with"),
    ] {
        let output = place.run(&["export", "paint.zarr", "-o", output, &format!("--reflectance={white}")]);
        let stderr = super::text(&output.stderr);
        assert!(!output.status.success() && stderr.contains(words), "{white}: {stderr}");
    }
}
