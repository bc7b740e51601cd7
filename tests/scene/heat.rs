//! Temperatures of materials: what good ones resolve to, and what is said about wrong ones.

use spectile::scene::Temperature;

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

#[test]
fn wrong_temperatures() {
    #[rustfmt::skip]
    let cases: &[(&str, &str, &str, &[&str])] = &[
        ("zero", "[materials.m.black]\ntemperature = 0 #!", "materials.m.black.temperature", &["a temperature in K, above 0", "but is 0"]),
        ("negative", "[materials.m.diffuse]\nreflectance = 1\ntemperature = -5 #!", "materials.m.diffuse.temperature", &["above 0", "-5"]),
        ("too hot", "[materials.m.black]\ntemperature = 2e9 #!", "materials.m.black.temperature", &["at most 1e9"]),
        ("words", "[materials.m.conductor]\neta = 1\nk = 1\ntemperature = \"hot\" #!", "materials.m.conductor.temperature", &["must be a number, but is a string"]),
        ("glass", "[materials.m.dielectric]\neta = 1.5\ntemperature = 300 #!", "materials.m.dielectric.temperature", &["a dielectric absorbs nothing", "`interior`"]),
        ("blend of glass", "[materials.m.blend]\na = \"ice\"\nb = \"ice\"\nweight = 0.5\ntemperature = 300 #!\n[materials.ice.dielectric]\neta = 1.3", "materials.m.blend.temperature", &["all that \"m\" blends absorbs nothing"]),
    ];
    for (name, text, key, words) in cases {
        check_wrong(&with_material(text), &[], name, key, words);
    }
}
