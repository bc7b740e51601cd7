//! What is made of a cube for people who look at numbers: statistics of bands, temperatures where there is heat.

use super::{Place, spectrum};
use crate::binary::text;

#[test]
fn bands_have_statistics() {
    let place = Place::new();
    let cube = place.render("cube.zarr", &["--spp", "4", "--tile", "8"]);
    place.success(&[
        "export",
        "cube.zarr",
        "-o",
        "bands.csv",
        "--statistics",
        "--bands",
        "3,1",
        "--crop",
        "2,3,20,17",
        "--integrated",
    ]);
    let table = std::fs::read_to_string(place.path().join("bands.csv")).expect("read");
    let lines: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(lines[0][..5], ["band", "wavelength_nm", "width_nm", "unit", "pixels"]);
    assert_eq!(lines.len(), 3);
    for (line, k) in lines[1..].iter().zip([3usize, 1]) {
        assert_eq!(
            line[..5],
            [&*cube.channels().names[k], &cube.channels().centre(k).to_string(), "60", "W m-2 sr-1", "252"]
        );
        let pixels = (3..17).flat_map(|y| (2..20).map(move |x| (x, y)));
        let values: Vec<f64> =
            pixels.map(|(x, y)| f64::from((f64::from(spectrum(&cube, x, y)[k]) * 60.0) as f32)).collect();
        let mean = values.iter().sum::<f64>() / 252.0;
        let deviation = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 251.0).sqrt();
        let number = |i: usize| line[i].parse::<f64>().expect("a number");
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let greatest = values.iter().copied().fold(0.0, f64::max);
        assert!(number(5) as f32 == least as f32 && number(6) as f32 == greatest as f32, "{line:?} {least} {greatest}");
        assert!((number(7) / mean - 1.0).abs() < 1e-12 && (number(8) / deviation - 1.0).abs() < 1e-9, "{line:?}");
    }
    // Its own kind is replaced, another table is not.
    place.success(&["export", "cube.zarr", "-o", "bands.csv", "--statistics"]);
    place.success(&["export", "cube.zarr", "-o", "pixels.csv", "--bands", "0"]);
    let output = place.run(&["export", "cube.zarr", "-o", "pixels.csv", "--statistics"]);
    assert!(output.status.code() == Some(2) && text(&output.stderr).contains("statistics"), "{}", text(&output.stderr));
    let output = place.run(&["export", "cube.zarr", "-o", "bands.img", "--statistics"]);
    assert!(text(&output.stderr).contains("--statistics goes with csv"), "{}", text(&output.stderr));
}

/// Light is no heat: temperatures of channels below 2.5 µm are refused, unless they are named.
#[test]
fn temperatures_are_told_where_heat_is_seen() {
    let place = Place::new();
    place.render("light.zarr", &["--spp", "1"]);
    for file in ["heat.csv", "heat.png"] {
        let output = place.run(&["export", "light.zarr", "-o", file, "--temperature"]);
        let said = text(&output.stderr);
        assert!(output.status.code() == Some(2) && said.contains("no heat is seen in 5 of its 5 channels"), "{said}");
        assert!(said.contains("all of that kind"), "{said}");
    }
    place.success(&["export", "light.zarr", "-o", "heat.csv", "--temperature", "--bands", "4"]);
    place.render("both.zarr", &["--spp", "1", "--set", "channels.intervals=[[500,600],[8000,9000],[9000,11500]]"]);
    let output = place.run(&["export", "both.zarr", "-o", "both.csv", "--temperature"]);
    assert!(
        text(&output.stderr).contains("no heat is seen in 1 of its 3 channels, such as"),
        "{}",
        text(&output.stderr)
    );
    assert!(text(&output.stderr).contains("--bands 2.5um..12um"), "{}", text(&output.stderr));
    place.success(&["export", "both.zarr", "-o", "both.csv", "--temperature", "--bands", "2.5um..12um"]);
}
