//! `spectile sky`: its scene against a discrete ordinates code, its sun against ASTM G173, its tables against the cube, and what it refuses.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use spectile::cube::Cube;
use spectile::sky::{Aerosol, Albedo, Atmosphere, Irradiance, Parts, Sun};
use spectile::spectral::{Channels, Curve, Outside, SOLAR, columns};

use super::Place;
use crate::binary::text;
use crate::size;

/// PythonicDISORT's radiance in the scene of [`SKY`]: tests/python/disort_sky.py.
const DISORT: &str = include_str!("../data/disort_sky.csv");
const SKY: [&str; 7] = ["sky", "--sun-elevation", "41.5", "--sun-azimuth", "0", "--aerosol", "0.15"];

/// nm, row, column, radiance, diffuse and direct irradiance.
fn answers() -> Vec<[f64; 6]> {
    columns::<6>(DISORT).collect()
}

/// In the zenith and around on the sun's height, in rows of 36 pixels: parts of each row, and each row as a whole, against the other code. Eight
/// epochs give each pixel's standard error with 7 degrees of freedom, nine pixels and more together 63: Student's quantile for 24
/// comparisons at 1 % (Sidak) is 3.8, for the 210 of `--full`, with more epochs, 4.2.
#[test]
fn radiance_is_that_of_discrete_ordinates() {
    let place = Place::new();
    place.success(&[&SKY[..], &["--scene", "sky"]].concat());
    let answers = answers();
    let wavelengths: &[f64] = if size::is_full() {
        &[400.0, 450.0, 550.0, 675.0, 760.5, 870.0, 940.0, 1240.0, 1640.0, 2200.0]
    } else {
        &[450.0, 675.0, 940.0, 1640.0]
    };
    let rows: &[u32] = if size::is_full() { &[0, 20, 48, 65, 80] } else { &[0, 48] };
    let samples = size::either("512", "2048");
    // Coefficients are linear in so narrow channels.
    let intervals: Vec<String> = wavelengths.iter().map(|nm| format!("[{}, {}]", nm - 0.01, nm + 0.01)).collect();
    let intervals = format!("channels.intervals=[{}]", intervals.join(", "));
    for row in rows {
        let crop = format!("film.crop=[0, {row}, 36, {}]", row + 1);
        let mut words = vec![
            "render",
            "sky/scene.toml",
            "-o",
            "row.zarr",
            "--overwrite",
            "--quiet",
            "--uncertainty",
            "--spp",
            samples,
        ];
        for set in ["film.width=36", &crop, &intervals, "lights.0.directional.irradiance=1.0"] {
            words.extend(["--set", set]);
        }
        place.success(&words);
        let cube = place.cube("row.zarr");
        for (k, nm) in wavelengths.iter().enumerate() {
            let of_row = |answer: &&[f64; 6]| answer[0] == *nm && answer[1] == f64::from(*row);
            let known: BTreeMap<u32, f64> = answers.iter().filter(of_row).map(|a| (a[2] as u32, a[3])).collect();
            let at = |x: u32| {
                let value = |spectrum: Option<Vec<f32>>| f64::from(spectrum.expect("there")[k]);
                let mean = value(cube.spectrum(x, 0).expect("read"));
                let error = value(cube.standard_error(x, 0).expect("read"));
                // West is as east: the sun stands in the north.
                (mean, error, known[&x.max(35 - x)])
            };
            // Around the zenith the other code's interpolation in the cosine does not know which way is which: its parts differ by 3 % between 48
            // and 96 streams, their mean by 1e-4.
            let parts: &[(u32, u32)] = &[(0, 36), (0, 9), (9, 18), (18, 27), (27, 36)];
            for &(from, to) in if *row == 0 { &parts[..1] } else { parts } {
                let pixels: Vec<_> = (from..to).map(at).collect();
                let sum = |of: fn(&(f64, f64, f64)) -> f64| pixels.iter().map(of).sum::<f64>();
                let (mean, expected) = (sum(|p| p.0), sum(|p| p.2));
                let error = sum(|p| p.1 * p.1).sqrt();
                let place = format!("{nm} nm, row {row}, columns {from} to {to}");
                let off = (mean - expected) / error;
                assert!(
                    off.abs() < size::either(3.8, 4.2),
                    "{place}: {:.3} % off, {off:.1} standard errors",
                    100.0 * (mean / expected - 1.0)
                );
                assert!(error < 0.03 * expected, "{place}: the standard error is {:.2} %", 100.0 * error / expected);
            }
        }
    }
}

/// The optical depths are those that the other code was given by the scene's files: direct light to the rounding of its file.
#[test]
fn direct_light_is_what_the_layers_let_through() {
    let atmosphere = Atmosphere { sun: Some(Sun { elevation: 41.5, azimuth: 0.0 }), aerosol_depth: 0.15, ..standard() };
    let mut seen = 0;
    for [nm, _, _, _, _, direct] in answers() {
        let expected = direct / 41.5_f64.to_radians().sin();
        let found = atmosphere.transmittance(nm);
        // The file's coefficients are linear between 120 wavelengths, of molecules too; and its numbers have six digits.
        assert!((found / expected - 1.0).abs() < 2e-3, "{nm} nm: {found} {expected}");
        seen += 1;
    }
    assert!(seen > 100);
}

/// The atmosphere of ASTM G173, but for its albedo, which direct light does not know: 1.4164 cm of water, 343.8 Dobson units, an aerosol of
/// 0.084 at 500 nm, an air mass of 1.5.
fn standard() -> Atmosphere {
    Atmosphere {
        sun: Some(Sun { elevation: (1.0_f64 / 1.5).asin().to_degrees(), azimuth: 180.0 }),
        aerosol: Aerosol::Rural,
        aerosol_depth: 0.0767,
        aerosol_height: 1.5,
        ozone: 343.8,
        water: 1.4164,
        albedo: Albedo::Constant(0.2),
        ground_temperature: 288.2,
    }
}

fn sunlight(atmosphere: &Atmosphere) -> Parts {
    Parts::of(atmosphere, [380.0, 2500.0])
}

/// Within 3 % of the standard over all, and in windows between bands. In bands the two codes' gases differ, LOWTRAN7 (1988) and SMARTS
/// (2001), by as much as is printed.
#[test]
fn the_sun_is_that_of_the_standard() {
    let atmosphere = standard();
    let (nm, value) = atmosphere.direct(sunlight(&atmosphere)).into_iter().unzip();
    let found = Curve::Linear { nm, value, outside: Outside::Zero };
    let (nm, value) = columns::<3>(SOLAR).map(|row| (row[0], row[2])).unzip();
    let known = Curve::Linear { nm, value, outside: Outside::Zero };
    let off = |from: f64, to: f64| found.mean(from, to) / known.mean(from, to) - 1.0;
    for from in (400..2400).step_by(100) {
        println!("{from} to {} nm: {:+.1} %", from + 100, 100.0 * off(f64::from(from), f64::from(from + 100)));
    }
    assert!(off(380.0, 2500.0).abs() < 0.03, "{}", off(380.0, 2500.0));
    for (from, to) in [
        (400.0, 500.0),
        (500.0, 600.0),
        (600.0, 680.0),
        (740.0, 758.0),
        (770.0, 810.0),
        (840.0, 880.0),
        (1000.0, 1080.0),
        (1230.0, 1300.0),
        (1540.0, 1700.0),
    ] {
        assert!(off(from, to).abs() < 0.03, "{from} to {to} nm: {}", off(from, to));
    }
}

/// An even sky of radiance L sends π L to level ground, whatever the pixels; and totals are sums over channels.
#[test]
fn irradiance_is_the_cosines_integral() {
    let scene = "[camera.latlong]\nposition = [0, 0, 0]\nup = [0, 0, 1]\n[film]\nwidth = 16\nheight = 8\n\
        [channels]\nequal = { from = 500, to = 520, count = 2 }\n[environment]\nradiance = 0.7\n";
    let place = Place::of(scene);
    let cube: Cube = place.render("even.zarr", &["--spp", "1"]);
    let found = Irradiance::of(&standard(), sunlight(&standard()), &cube).expect("summed up");
    for diffuse in &found.diffuse {
        // Radiance is an f32.
        assert!((diffuse / (0.7 * PI) - 1.0).abs() < 1e-6, "{diffuse}");
    }
    assert!((found.total(&found.diffuse) / (0.7 * PI * 20.0) - 1.0).abs() < 1e-6);
    for (normal, level) in found.direct_normal.iter().zip(&found.direct) {
        assert!((level * 1.5 / normal - 1.0).abs() < 1e-12);
    }
}

/// The command's files go together: a scene under its map and its sun has a white ground of the irradiance that the table says.
#[test]
fn a_scene_under_it_has_its_irradiance() {
    let scene = r#"
[camera.orthographic]
position = [0, 0, 1]
look_at = [0, 0, 0]
up = [0, 1, 0]
width = 0.1
[film]
width = 8
height = 8
[channels]
equal = { from = 400, to = 1000, count = 3 }
[integrator]
max_bounces = 1
[environment]
map = "sky.zarr"
up = [0, 0, 1]
[[lights]]
sun = { azimuth = 120, elevation = 35, up = [0, 0, 1], irradiance = { file = "sky-sun.csv" } }
[materials.white.diffuse]
reflectance = 1.0
[[objects]]
quad = { corner = [-1, -1, 0], edge_u = [2, 0, 0], edge_v = [0, 2, 0] }
material = "white"
"#;
    let place = Place::of(scene);
    let sky =
        ["sky", "--sun-elevation", "35", "--sun-azimuth", "120", "-o", "sky.zarr", "--size", "32x16", "--spp", "16"];
    let channels = ["--channels", "equal.from=400", "--channels", "equal.to=1000", "--channels", "equal.count=3"];
    let said = place.events(&[&sky[..], &channels].concat());
    let [.., told, done] = &said[..] else { panic!("{said:?}") };
    assert!(told["event"] == "irradiance" && done["event"] == "done");
    let table = std::fs::read_to_string(place.path().join("sky-irradiance.csv")).expect("a table");
    let rows: Vec<Vec<f64>> = table
        .lines()
        .filter(|line| line.starts_with(|c: char| c.is_ascii_digit()))
        .map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect())
        .collect();
    assert_eq!(rows.iter().map(|row| row[0]).collect::<Vec<_>>(), [500.0, 700.0, 900.0]);
    let total: f64 = rows.iter().map(|row| 200.0 * row[4]).sum();
    assert!((told["global_horizontal"].as_f64().expect("a number") / total - 1.0).abs() < 1e-5);
    let cube = place.render("ground.zarr", &["--spp", "512", "--uncertainty"]);
    for (k, row) in rows.iter().enumerate() {
        let pixels = (0..64).map(|i| (i % 8, i / 8));
        let of = |spectrum: Option<Vec<f32>>| f64::from(spectrum.expect("there")[k]);
        let (sum, squares) = pixels.fold((0.0, 0.0), |(sum, squares), (x, y)| {
            let error = of(cube.standard_error(x, y).expect("read"));
            (sum + of(cube.spectrum(x, y).expect("read")), squares + error * error)
        });
        let (found, error) = (PI * sum / 64.0, PI * squares.sqrt() / 64.0);
        // The map is bilinear between the pixels that the table sums up, whose rows are 11 degrees high; below the horizon lies ground, which
        // takes the place of sky in the lowest row by an eighth: a part of at most 1 % of the sky's light. Sunlight is that of the same file.
        let allowed = 4.0 * error + 0.012 * row[3];
        assert!((found - row[4]).abs() < allowed, "{} nm: {found} ± {error}, the table has {}", row[0], row[4]);
        assert!(error < 0.01 * row[4]);
    }
    // Once more only where that is asked for; what is finished is gone on with, since the scene is the same, and the tables are made again.
    let words = [&sky[..], &channels].concat();
    assert!(text(&place.run(&words).stderr).contains("exists already"));
    std::fs::remove_file(place.path().join("sky-sun.csv")).expect("removed");
    place.success(&[&words[..], &["--resume", "--quiet"]].concat());
    assert!(place.path().join("sky-sun.csv").exists());
}

#[test]
fn what_no_clear_sky_has_is_refused() {
    let place = Place::new();
    for (words, says) in [
        (&["--sun-elevation", "3"][..], "no dusk"),
        (&["--sun-elevation", "91"], "from 5 to 90"),
        (&["--sun-elevation", "40", "--aerosol", "-1"], "--aerosol is -1"),
        (&["--sun-elevation", "40", "--aerosol-type", "desert"], "rural, urban, maritime, tropospheric"),
        (&["--sun-elevation", "40", "--ozone", "3000"], "Dobson"),
        (&["--sun-elevation", "40", "--ozone", "0.344"], "that many atm-cm are 344"),
        (&["--sun-elevation", "40", "--water", "nan"], "--water is NaN"),
        (&["--sun-elevation", "40", "--albedo", "1.5"], "--albedo is 1.5"),
        (&["--sun-elevation", "40", "--albedo", "none.csv"], "no file that can be read"),
        (&["--sun-elevation", "40", "--channels", "equal.to=21000"], "ends at 20000 nm"),
        (&["--sun-elevation", "40", "--ground-temperature", "20 C"], "no channel reaches beyond 2500 nm"),
        (&["--night", "--sun-elevation", "40"], "cannot be used with"),
        (&["--night", "--ground-temperature", "20 m"], "the unit K, C or F"),
        (&["--night", "--ground-temperature", "20"], "from 150 to 400 K"),
        (&["--sun-elevation", "40", "--channels", "equal.from=350"], "begins at 380 nm"),
        (&["--sun-elevation", "40", "--size", "100x100"], "twice as wide as high"),
    ] {
        let output = place.run(&[&["sky", "-o", "sky.zarr"], words].concat());
        let said = text(&output.stderr);
        assert!(output.status.code() == Some(2) && said.contains(says), "{words:?}: {said}");
        assert!(!place.path().join("sky.zarr").exists());
    }
    let low = place.success(&["sky", "--sun-elevation", "8", "--scene", "low"]).1;
    assert!(low.contains("the sun is low"), "{low}");
    let again = place.run(&["sky", "--sun-elevation", "8", "--scene", "low"]);
    assert!(again.status.code() == Some(2) && text(&again.stderr).contains("exists already"));
    assert!(place.run(&["sky", "--sun-elevation", "8"]).status.code() == Some(2));
}

/// The numbers that the defaults are called by are those of the tables.
#[test]
fn the_standard_atmosphere_has_its_columns() {
    let at = |water: f64, ozone: f64| Atmosphere { water, ozone, ..standard() }.depths(600.0);
    // Depth is proportional to ozone; of twice the standard column it is twice LOWTRAN7's 0.0421 at 600 nm.
    assert!((at(1.42, 688.0).ozone / at(1.42, 344.0).ozone - 2.0).abs() < 1e-9);
    assert!((at(1.42, 344.0).ozone - 0.0421).abs() < 0.0003, "{:?}", at(1.42, 344.0));
    // Bodhaine et al. (1999), table 3: 4.513e-27 cm² at 550 nm; times 2.153e25 molecules a cm², 1013.25 hPa over weight, within what gravity loses
    // with height.
    let rayleigh = standard().depths(550.0).molecules;
    assert!((rayleigh / (4.513e-27 * 2.153e25) - 1.0).abs() < 0.004, "{rayleigh}");
    assert_eq!(Channels::equal(380.0, 2500.0, 200).len(), 200);
}
