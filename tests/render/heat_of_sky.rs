//! What `spectile sky` sends as heat: against a discrete ordinates code, against formulas for its irradiance, and what is opaque or clear.

use std::f64::consts::PI;

use spectile::spectral::{columns, planck};

use super::Place;
use crate::size;

/// PythonicDISORT's radiance in the scene of `spectile sky --night`: tests/python/disort_heat.py.
const DISORT: &str = include_str!("../data/disort_heat.csv");

/// nm, row, radiance, irradiance.
fn answers() -> Vec<[f64; 4]> {
    columns::<4>(DISORT).collect()
}

/// Rows of a map of 180 from the zenith to a few degrees above the horizon: within 0.3 % and four standard errors.
#[test]
fn heat_is_that_of_discrete_ordinates() {
    let place = Place::new();
    place.success(&["sky", "--night", "--scene", "sky"]);
    let answers = answers();
    let mut wavelengths: Vec<f64> = answers.iter().map(|answer| answer[0]).collect();
    wavelengths.dedup();
    let intervals: Vec<String> = wavelengths.iter().map(|nm| format!("[{}, {}]", nm - 0.01, nm + 0.01)).collect();
    let intervals = format!("channels.intervals=[{}]", intervals.join(", "));
    let rows: &[u32] = if size::is_full() { &[0, 30, 60, 80, 87] } else { &[0, 80] };
    for row in rows {
        let crop = format!("film.crop=[0, {row}, 8, {}]", row + 1);
        let samples = size::either("512", "4096");
        let mut words = vec!["render", "sky/scene.toml", "-o", "row.zarr", "--overwrite", "--quiet", "--spp", samples];
        words.push("--uncertainty");
        for set in ["film.width=8", &crop, &intervals] {
            words.extend(["--set", set]);
        }
        place.success(&words);
        let cube = place.cube("row.zarr");
        for (k, nm) in wavelengths.iter().enumerate() {
            let of_row = |answer: &&[f64; 4]| answer[0] == *nm && answer[1] == f64::from(*row);
            let known = answers.iter().find(of_row).expect("an answer")[2];
            let value = |spectrum: Option<Vec<f32>>| f64::from(spectrum.expect("there")[k]);
            let mean = (0..8).map(|x| value(cube.spectrum(x, 0).expect("read"))).sum::<f64>() / 8.0;
            let squares = (0..8).map(|x| value(cube.standard_error(x, 0).expect("read")).powi(2)).sum::<f64>();
            let error = squares.sqrt() / 8.0;
            println!(
                "{nm} nm, row {row}: {:+.3} % off, standard error {:.3} %",
                100.0 * (mean / known - 1.0),
                100.0 * error / known
            );
            assert!(
                (mean - known).abs() < 0.003 * known + 4.0 * error,
                "{nm} nm, row {row}: {mean} ± {error}, {known}"
            );
            assert!(error < 0.01 * known, "{nm} nm, row {row}: the standard error is {:.2} %", 100.0 * error / known);
            // Where carbon dioxide or water is opaque, the lowest hundred metres are seen, half a lapse of 0.65 K below the ground's 288.2 K; between
            // bands, from the zenith, the cold above. (In the zenith 6.3 um is not quite opaque.)
            let over_lowest = mean / planck::radiance(*nm, 287.9);
            match nm {
                4260.0 | 15_000.0 => assert!((over_lowest - 1.0).abs() < 2e-3, "{nm} nm: {over_lowest}"),
                6300.0 => assert!((over_lowest - 1.0).abs() < 0.01, "{nm} nm: {over_lowest}"),
                10_500.0 if *row == 0 => assert!(over_lowest < 0.15, "{nm} nm: {over_lowest}"),
                _ => {}
            }
        }
    }
}

/// The command at night: no sun beside it, and longwave irradiance as formulas have it that were fitted to measurements and other codes, of
/// which Dilley and O'Brien (Q. J. R. Meteorol. Soc. 124, 1391, 1998) has 289 W/m2 for this air, Prata (1996) 296.
#[test]
fn longwave_irradiance_is_that_of_formulas() {
    let place = Place::new();
    let channels = "wavenumber={ from = 500, to = 2500, count = 50 }";
    let night = ["sky", "--night", "-o", "night.zarr", "--size", "24x12", "--spp", "2", "--channels", channels];
    let said = place.events(&night);
    let told = said.iter().find(|event| event["event"] == "irradiance").expect("told");
    assert!(told["sun"].is_null() && told["direct_horizontal"] == 0.0);
    assert!(!place.path().join("night-sun.csv").exists() && place.path().join("night-irradiance.csv").exists());
    // Below 500 cm-1 (beyond 20 um) water is opaque.
    let nm = (0..4000).map(|i| 2e4 * 1.001_f64.powi(i));
    let beyond: f64 = nm.map(|nm| PI * planck::radiance(nm * 1.001_f64.sqrt(), 287.9) * 0.001 * nm).sum();
    let all = told["diffuse_horizontal"].as_f64().expect("a number") + beyond;
    let formula = 59.38 + 113.7 * (288.2_f64 / 273.16).powi(6) + 96.96 * (14.2_f64 / 25.0).sqrt();
    assert!((all / formula - 1.0).abs() < 0.02, "{all} W/m2, {formula} expected");
}

/// By day to 20 um: the sun's own table goes on where the standard's ends, and what is opaque to the sun has none.
#[test]
fn the_sun_goes_on_into_the_infrared() {
    let place = Place::new();
    let day =
        ["sky", "--sun-elevation", "40", "--scene", "day", "--channels", "intervals=[[3000, 5000], [8000, 12000]]"];
    place.success(&day);
    let written = std::fs::read_to_string(place.path().join("day/scene.toml")).expect("a scene");
    assert!(written.contains("intervals = [[3000, 5000], [8000, 12000]]") && written.contains("sun.csv"), "{written}");
    // Nothing that only sunlight needs.
    assert!(!place.path().join("day/gases.csv").exists());
    let text = std::fs::read_to_string(place.path().join("day/sun.csv")).expect("a table");
    let at = |nm: f64| {
        let cells = text.lines().filter_map(|line| line.split_once(','));
        let rows = cells.filter_map(|(nm, value)| Some((nm.parse::<f64>().ok()?, value.parse::<f64>().ok()?)));
        rows.min_by(|a, b| (a.0 - nm).abs().total_cmp(&(b.0 - nm).abs())).expect("a row").1
    };
    assert!((at(4010.0) / at(3990.0) * (4010.0_f64 / 3990.0).powi(4) - 1.0).abs() < 0.02);
    // 10 um: 5,560 K over the sun's solid angle of 6.79e-5 sr.
    let expected = 6.79e-5 * planck::radiance(10_000.0, 5560.0);
    assert!((at(10_000.0) / expected - 1.0).abs() < 0.02, "{} {expected}", at(10_000.0));
}
