//! Temperatures of materials: what good ones resolve to, and what is said about wrong ones.

use spectile::scene::Temperature;
use spectile::spectral::Curve;

use super::wrong::check_wrong;
use super::{changed, good};

const SOOT: &str = "[materials.soot.black]";

/// The base scene whose first object is of material "m", defined by `text`.
fn with_material(text: &str) -> String {
    changed("material = \"white\"", "material = \"m\"").replace(SOOT, &format!("{SOOT}\n{text}"))
}

#[test]
fn temperatures_resolve() {
    for (text, expected) in [
        ("[materials.m.diffuse]\nreflectance = 0.5\ntemperature = 300", Some(300.0)),
        ("[materials.m.diffuse]\nreflectance = 0.5", None),
        ("[materials.m.conductor]\neta = 1\nk = 2\ntemperature = 3", Some(3.0)),
        ("[materials.m.plastic]\nreflectance = 0.5\neta = 1.5\ntemperature = 50000.0", Some(5e4)),
        ("[materials.m.black]\ntemperature = 2.5", Some(2.5)),
        ("[materials.m.black]\ntemperature = \"37 C\"", Some(37.0 + 273.15)),
        ("[materials.m.black]\ntemperature = \"-40°F\"", Some((459.67 - 40.0) * 5.0 / 9.0)),
        ("[materials.m.black]\ntemperature = \"1.5e3 K\"", Some(1500.0)),
        ("[materials.m.blend]\na = \"white\"\nb = \"soot\"\nweight = 0.5\ntemperature = 400", Some(400.0)),
        (
            "[materials.m.blend]\na = \"ice\"\nb = \"soot\"\nweight = 0.5\ntemperature = 400\n[materials.ice.dielectric]\neta = 1.3",
            Some(400.0),
        ),
    ] {
        let scene = good(&with_material(text), &[], &[]);
        let m = scene.materials.iter().find(|m| m.name == "m").unwrap();
        assert_eq!(m.temperature, expected.map(Temperature::Constant), "{text}");
        let warmer = good(&with_material(text), &[], &[("materials.m", "{ black = { temperature = 301 } }")]);
        assert_ne!(scene.digest, warmer.digest);
    }
}

/// Emissivity is the complement of a reflectance: the same scene.
#[test]
fn emissivities_resolve() {
    let of = |text: &str| good(&with_material(&format!("[materials.m.diffuse]\n{text}\ntemperature = 300")), &[], &[]);
    let (a, b) = (of("emissivity = 0.75"), of("reflectance = 0.25"));
    assert_eq!(a.digest, b.digest);
    let (a, b) = (
        of("emissivity = { samples = [[400, 0.75], [700, 1]] }"),
        of("reflectance = { samples = [[400, 0.25], [700, 0]] }"),
    );
    assert_eq!((a.digest, a.warnings.len()), (b.digest, 0));
    let short = of("emissivity = { samples = [[450, 0.75], [700, 1]] }");
    assert!(short.warnings[0].contains("an emissivity) does not cover 400-450 nm"), "{:?}", short.warnings);
}

#[test]
fn wrong_emissivities() {
    #[rustfmt::skip]
    let cases: &[(&str, &str, &[&str])] = &[
        ("emissivity = 1.2 #!", "emissivity", &["an emissivity must lie in [0, 1]", "1.2"]),
        ("emissivity = 0.5\nreflectance = 0.5 #!", "reflectance", &["complement of `emissivity`"]),
        ("emissivity = { rgb = [1, 0, 0] } #!", "emissivity.rgb", &["a colour"]),
        ("emissivity = { blackbody = 300 } #!", "emissivity.blackbody", &["a black body"]),
        ("emissivity = { samples = [[400, 1], [700, 1]], outside = \"zero\" } #!", "emissivity.samples", &["outside = \"hold\""]),
    ];
    for (text, key, words) in cases {
        check_wrong(
            &with_material(&format!("[materials.m.diffuse]\n{text}")),
            &[],
            text,
            &format!("materials.m.diffuse.{key}"),
            words,
        );
    }
}

/// A warm sky is a black body's, times its scale.
#[test]
fn environments_have_temperatures() {
    let sky = |text: &str| {
        let scene = good(&changed("[environment]\nradiance = 0.25", &format!("[environment]\n{text}")), &[], &[]);
        let id = scene.environment.expect("a sky").uniform().expect("a uniform one");
        scene.spectra[id].curve.clone()
    };
    assert_eq!(sky("temperature = \"15 C\""), Curve::Blackbody { kelvin: 288.15, scale: 1.0 });
    assert_eq!(sky("temperature = 250\nscale = 0.5"), Curve::Blackbody { kelvin: 250.0, scale: 0.5 });
    let cold = changed("[environment]\nradiance = 0.25", "[environment]\ntemperature = 0 #!");
    check_wrong(&cold, &[], "cold", "environment.temperature", &["above 0"]);
}

#[test]
fn wrong_temperatures() {
    #[rustfmt::skip]
    let cases: &[(&str, &str, &str, &[&str])] = &[
        ("zero", "[materials.m.black]\ntemperature = 0 #!", "materials.m.black.temperature", &["a temperature in K, above 0", "but is 0"]),
        ("negative", "[materials.m.diffuse]\nreflectance = 1\ntemperature = -5 #!", "materials.m.diffuse.temperature", &["above 0", "-5"]),
        ("too hot", "[materials.m.black]\ntemperature = 2e9 #!", "materials.m.black.temperature", &["at most 1e9"]),
        ("words", "[materials.m.conductor]\neta = 1\nk = 1\ntemperature = \"hot\" #!", "materials.m.conductor.temperature", &["above 0", "\"hot\"", "\"37 C\""]),
        ("without a unit", "[materials.m.black]\ntemperature = \"300\" #!", "materials.m.black.temperature", &["as a number"]),
        ("other unit", "[materials.m.black]\ntemperature = \"300 m\" #!", "materials.m.black.temperature", &["K, C or F"]),
        ("below zero", "[materials.m.black]\ntemperature = \"-300 C\" #!", "materials.m.black.temperature", &["above 0", "-26.85"]),
        ("glass", "[materials.m.dielectric]\neta = 1.5\ntemperature = 300 #!", "materials.m.dielectric.temperature", &["a dielectric absorbs nothing", "`interior`"]),
        ("blend of glass", "[materials.m.blend]\na = \"ice\"\nb = \"ice\"\nweight = 0.5\ntemperature = 300 #!\n[materials.ice.dielectric]\neta = 1.3", "materials.m.blend.temperature", &["all that \"m\" blends absorbs nothing"]),
    ];
    for (name, text, key, words) in cases {
        check_wrong(&with_material(text), &[], name, key, words);
    }
}
