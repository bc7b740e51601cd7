//! Random and spoilt input: accepted or refused, never a panic.

use std::path::Path;

use proptest::prelude::*;
use spectile::{Error, scene};

use super::{BASE, overrides, parse_with};

/// Nothing that is written may panic; what is refused is refused as bad input.
fn survives(text: &str, files: &[(&str, &str)]) {
    if let Err(error) = parse_with(text, files, &[]) {
        assert!(matches!(error, Error::Input(ref problems) if !problems.is_empty()), "{error}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_text_never_panics(text in ".*", bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        survives(&text, &[]);
        survives(&String::from_utf8_lossy(&bytes), &[]);
    }

    #[test]
    fn spoilt_scenes_never_panic(edits in proptest::collection::vec((any::<prop::sample::Index>(), 0..6u8, any::<prop::sample::Index>(), any::<char>()), 1..5)) {
        let mut lines: Vec<String> = BASE.lines().map(str::to_owned).collect();
        let words = ["nan", "-1", "[]", "{}", "1e308", "\"\"", "[[objects]]", "true", "0", "1979-05-27", "[spectra.grey]", "mesh = \"tri.obj\""];
        for (at, kind, with, character) in edits {
            let at = at.index(lines.len());
            match kind {
                0 => { lines.remove(at); if lines.is_empty() { lines.push(String::new()); } }
                1 => lines.insert(at, lines[with.index(lines.len())].clone()),
                2 => lines[at] = lines[with.index(lines.len())].clone(),
                3 => { let half = lines[at].find('=').map_or(0, |i| i + 1); lines[at].truncate(half); lines[at].push_str(words[with.index(words.len())]); }
                4 => { let i = with.index(lines[at].chars().count() + 1); lines[at] = lines[at].chars().take(i).chain([character]).chain(lines[at].chars().skip(i + 1)).collect(); }
                _ => { let i = with.index(lines[at].chars().count() + 1); lines[at] = lines[at].chars().enumerate().filter(|(j, _)| *j != i).map(|(_, c)| c).collect(); }
            }
        }
        survives(&lines.join("\n"), &[]);
    }

    #[test]
    fn random_materials_never_panic(
        kinds in proptest::collection::vec((0..6usize, 0..6usize, 0..6usize, "-?[0-9]\\.?[0-9]?|nan|\"a.csv\"|\\[[01](, 0\\.[0-9])?\\]|\\{ texture = 1 \\}"), 1..6),
    ) {
        let mut text = BASE.to_owned();
        for (i, (kind, a, b, value)) in kinds.iter().enumerate() {
            let (name, keys) = match kind {
                0 => ("diffuse", format!("reflectance = {value}")),
                1 => ("conductor", format!("nk = {value}\nroughness = {value}")),
                2 => ("conductor", format!("eta = {value}\nk = {value}\nroughness = {value}")),
                3 => ("dielectric", format!("eta = {value}")),
                4 => ("plastic", format!("reflectance = 0.5\neta = {value}\nroughness = {value}")),
                _ => ("blend", format!("a = \"m{a}\"\nb = \"m{b}\"\nweight = {value}")),
            };
            text += &format!("[materials.m{i}.{name}]\n{keys}\n");
        }
        text += "[[objects]]\nsphere = { center = [0, 0, 0], radius = 1 }\nmaterial = \"m0\"\n";
        survives(&text, &[("a.csv", "nm,n,k\n400,1,2\n500,0.5,1\n")]);
    }

    #[test]
    fn random_index_files_never_panic(
        bytes in proptest::collection::vec(any::<u8>(), 0..200),
        rows in "([0-9a-z.,;#\t \"-]{0,12}\n){0,8}",
        kind in "tabulated (n|k|nk|n2)|formula (-?[0-9]{1,2})",
        numbers in "( {0,2}-?[0-9]{0,2}\\.?[0-9]{0,2}(e-?[0-9]{1,3})?){0,8}",
        range in "-?[0-9]\\.[0-9] [0-9]\\.[0-9]",
    ) {
        let formula = format!("DATA:\n  - type: {kind}\n    wavelength_range: {range}\n    coefficients: {numbers}\n    data: |\n      {numbers}\n");
        let table = format!("DATA:\n  - type: {kind}\n    data: |\n{}", rows.replace('\n', "\n      "));
        for content in [bytes.as_slice(), rows.as_bytes(), formula.as_bytes(), table.as_bytes()] {
            for name in ["t.csv", "t.yml"] {
                if let Ok(index) = spectile::format::refractive::parse(content, Path::new(name), None) {
                    for table in [index.n, index.k].into_iter().flatten().flatten() {
                        prop_assert!(table.nm.is_sorted() && table.nm.len() == table.value.len() && table.nm.len() >= 2);
                        prop_assert!(table.value.iter().all(|v| v.is_finite()) && table.line.len() == table.nm.len());
                    }
                }
            }
        }
    }

    #[test]
    fn random_overrides_never_panic(key in "[a-z0-9._\"= \\[]{0,20}", value in "[a-z0-9.,{}\\[\\]\"= -]{0,20}") {
        for key in [key.as_str(), "objects.0.quad", "spectra.grey.constant", "channels.intervals", "camera.perspective.position"] {
            let _ = scene::parse(BASE, Path::new("/nonexistent/scene.toml"), &overrides(&[(key, &value)]));
        }
    }

    #[test]
    fn random_spectrum_files_never_panic(
        bytes in proptest::collection::vec(any::<u8>(), 0..200),
        text in "([0-9a-z.,;#\t \"-]{0,12}\n){0,8}",
        column in proptest::option::of("[a-z]{0,3}"),
    ) {
        for content in [bytes.as_slice(), text.as_bytes()] {
            for name in ["t.csv", "t.spd"] {
                if let Ok(table) = spectile::format::text::parse_spectrum(content, Path::new(name), column.as_deref()) {
                    prop_assert!(table.nm.is_sorted() && table.nm.len() == table.value.len() && table.nm.len() >= 2);
                }
            }
        }
    }

    #[test]
    fn random_meshes_never_panic(
        bytes in proptest::collection::vec(any::<u8>(), 0..200),
        lines in proptest::collection::vec("(v|f|g|o|l|vn|vt|usemtl|#)( -?[0-9]{1,2}(/[0-9]{0,2}){0,3}| nan| 1e400| \\\\| x){0,6}", 0..20),
    ) {
        let text = lines.join("\n");
        let valid = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{text}");
        for content in [bytes.as_slice(), text.as_bytes(), valid.as_bytes()] {
            if let Ok(mesh) = spectile::format::obj::parse(content, Path::new("m.obj")) {
                for part in &mesh.parts {
                    prop_assert!(part.positions.iter().flatten().all(|x| x.is_finite()));
                    prop_assert!(part.triangles.iter().flatten().all(|i| (*i as usize) < part.positions.len()));
                }
            }
        }
    }
}
