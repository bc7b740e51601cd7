//! What `spectile sky` sends as heat: against a discrete ordinates code, against LOWTRAN7 itself, and what any physics says.

use std::f64::consts::PI;

use spectile::sky::{self, Aerosol, Albedo, Atmosphere, Parts, Sun};
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
            assert!((mean - known).abs() < 0.003 * known + 4.0 * error, "{nm} nm, row {row}: {mean} ± {error}, {known}");
            assert!(error < 0.01 * known, "{nm} nm, row {row}: the standard error is {:.2} %", 100.0 * error / known);
        }
    }
}
