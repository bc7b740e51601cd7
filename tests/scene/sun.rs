//! Suns by where they stand or by date and place, and the standards of their irradiance.

use glam::DVec3;
use spectile::scene::{Light, Scene};
use spectile::spectral::Curve;

use super::wrong::check_wrong;
use super::{changed, good};
use crate::outside::python;

const SKY: &str = "[environment]\nradiance = 0.25";

fn with(sun: &str) -> String {
    changed(SKY, &format!("[[lights]]\nsun = {{ {sun} }}"))
}

/// Direction, degrees of the radius, irradiance.
fn sun(scene: &Scene) -> (DVec3, f64, &Curve) {
    let [Light::Sun { direction, angular_radius, irradiance }] = scene.lights[..] else { panic!("{:?}", scene.lights) };
    (direction, angular_radius.to_degrees(), &scene.spectra[irradiance].curve)
}

#[test]
fn suns_stand_where_they_are_said_to() {
    let scene = good(&with("azimuth = 90, elevation = 30, irradiance = 1.5"), &[], &[]);
    assert_eq!(scene.warnings, Vec::<String>::new());
    let (direction, radius, irradiance) = sun(&scene);
    // From the east, which is +x where north is -z: to the west and down.
    assert!((direction - DVec3::new(-0.75f64.sqrt(), -0.5, 0.0)).length() < 1e-15, "{direction}");
    assert!((radius - 0.2665).abs() < 1e-12 && *irradiance == Curve::Constant(1.5));
    let z_up = "azimuth = 180, elevation = 0, up = [0, 0, 2], angular_radius = 1, irradiance = 1";
    let scene = good(&with(z_up), &[], &[]);
    assert!((sun(&scene).0 - DVec3::Y).length() < 1e-15 && (sun(&scene).1 - 1.0).abs() < 1e-12);

    let scene = good(&with("azimuth = 0, elevation = -12.5, irradiance = 1"), &[], &[]);
    assert!(scene.warnings.len() == 1 && scene.warnings[0].contains("12.50 degrees below"), "{:?}", scene.warnings);
}

#[test]
fn suns_of_a_date_are_those_of_pvlib() {
    let Some(mut python) = python("sun_positions.py") else { return };
    let cases = [
        ("2026-06-21T10:30:00Z", 43.6, 5.1),
        ("2003-10-17T12:30:30-07:00", 39.742476, -105.1786),
        ("1985-01-03T03:15:00+05:30", -33.9, 151.2),
        ("2026-12-21T12:00:00Z", 78.2, 15.6),
        ("2050-03-20T18:45:12.5Z", 0.0, -179.9),
        ("2000-07-05T06:00:00Z", -89.9, 30.0),
    ];
    let output = python.args(cases.map(|(date, north, east)| format!("{date},{north},{east}"))).output().expect("runs");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for ((date, latitude, longitude), line) in cases.iter().zip(said.lines()) {
        let words: Vec<f64> = line.split(' ').map(|word| word.parse().expect("a number")).collect();
        let [azimuth, elevation, distance] = words[..] else { panic!("{line}") };
        let place = format!("latitude = {latitude}, longitude = {longitude}");
        let scene = good(&with(&format!("date = \"{date}\", {place}, irradiance = \"am0\"")), &[], &[]);
        let (direction, radius, irradiance) = sun(&scene);
        let towards = -direction;
        assert!((towards.y.asin().to_degrees() - elevation).abs() < 0.002, "{date}: {direction}, {line}");
        let there = (azimuth.to_radians().sin(), -azimuth.to_radians().cos());
        let turn = towards.x.atan2(towards.z) - f64::atan2(there.0, there.1);
        let turn = (turn.to_degrees() + 540.0).rem_euclid(360.0) - 180.0;
        assert!(turn.abs() * elevation.to_radians().cos() < 0.002, "{date}: {turn}");
        assert!((radius * distance / 0.2665 - 1.0).abs() < 1e-4, "{date}: {radius}");
        // ASTM G173-03: 1.8630 W m⁻² nm⁻¹ at 550 nm from one astronomical unit.
        assert!((irradiance.eval(550.0) * distance * distance / 1.8630 - 1.0).abs() < 2e-4, "{date}");
        assert_eq!(scene.warnings.iter().any(|w| w.contains("below the horizon")), elevation < 0.0, "{date}");
    }
}

/// A date of TOML is one as text; an irradiance of one's own is that of the day.
#[test]
fn dates_without_quotes_and_own_irradiances() {
    let place = "latitude = 43.6, longitude = 5.1";
    let quoted = good(&with(&format!("date = \"2026-01-05T10:30:00Z\", {place}, irradiance = 1.5")), &[], &[]);
    let plain = good(&with(&format!("date = 2026-01-05T11:30:00+01:00, {place}, irradiance = 1.5")), &[], &[]);
    assert_eq!(sun(&quoted), sun(&plain));
    assert_eq!(*sun(&plain).2, Curve::Constant(1.5));
    // Own spectra come before standards of the same name.
    let own = with(&format!("date = \"2026-01-05T10:30:00Z\", {place}, irradiance = \"am0\""))
        + "\n[spectra.am0]\nconstant = 2\n";
    assert_eq!(*sun(&good(&own, &[], &[])).2, Curve::Constant(2.0));
    let noon = good(&with("azimuth = 180, elevation = 50, irradiance = \"am1.5\""), &[], &[]);
    // ASTM G173-03, direct and circumsolar.
    assert!((sun(&noon).2.eval(550.0) / 1.3648 - 1.0).abs() < 1e-9, "{}", sun(&noon).2.eval(550.0));
}

#[test]
fn standards_say_where_they_end() {
    let text = with("azimuth = 180, elevation = 50, irradiance = \"am0\"");
    let scene = good(&text, &[], &[("channels", "{ intervals = [[500, 600], [3000, 5000]] }")]);
    let said = scene.warnings.iter().any(|w| w.contains("standard `am0` does not cover 4000-5000 nm"));
    assert!(said, "{:?}", scene.warnings);
}

#[test]
fn wrong_suns() {
    const OF_A_DAY: &str = "date = \"2026-06-21T10:30:00Z\", latitude = 43.6, longitude = 5.1";
    #[rustfmt::skip]
    let cases: [(String, &str, &[&str]); 13] = [
        ("irradiance = 1".into(), "direction", &["`direction` is missing"]),
        ("azimuth = 10, irradiance = 1".into(), "elevation", &["`elevation` is missing", "above the horizon"]),
        ("date = \"2026-06-21T10:30:00Z\", latitude = 1, irradiance = 1".into(), "longitude", &["degrees east"]),
        ("direction = [0, -1, 0], azimuth = 1, elevation = 2, irradiance = 1".into(), "azimuth", &["says once more", "keep one"]),
        (format!("azimuth = 1, elevation = 2, {OF_A_DAY}, irradiance = 1"), "date", &["says once more"]),
        ("azimuth = 1, elevation = 91, irradiance = 1".into(), "elevation", &["[-90, 90]"]),
        (format!("{}, irradiance = 1", OF_A_DAY.replace("43.6", "143.6")), "latitude", &["[-90, 90]"]),
        (format!("{}, irradiance = 1", OF_A_DAY.replace("10:30:00Z", "10:30:00")), "date", &["offset from UTC", "+02:00"]),
        (format!("{}, irradiance = 1", OF_A_DAY.replace("2026-06-21T10:30:00Z", "at noon")), "date", &["2026-06-21T10:30:00Z"]),
        ("azimuth = 1, elevation = 2, north = [0, 1, 0], irradiance = 1".into(), "north", &["parallel", "north = [0, 1, 0]"]),
        ("direction = [0, -1, 0], up = [0, 0, 1], irradiance = 1".into(), "up", &["beside `direction`"]),
        ("azimuth = 1, elevation = 2, irradiance = \"am2\"".into(), "irradiance", &["no spectrum is named \"am2\"", "am0"]),
        ("azimuth = 1, elevation = 2, irradiance = 1, angular_radius = 100".into(), "angular_radius", &["[0.001, 90]"]),
    ];
    for (sun, key, words) in &cases {
        let text = changed(SKY, &format!("[[lights]]\nsun = {{ {sun} }} #!"));
        check_wrong(&text, &[], sun, &format!("lights.0.sun.{key}"), words);
    }
    // Names of standards are known where irradiance is meant, and nowhere else.
    let sky = changed(SKY, "[environment]\nradiance = \"am0\" #!");
    check_wrong(&sky, &[], "radiance", "environment.radiance", &["no spectrum is named \"am0\""]);
}
