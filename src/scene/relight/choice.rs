//! Spectra that somebody has chosen for a factored cube, in JSON: the words of a scene file, and what files hold instead of their names.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::{Files, NewChannels, Relit, Rendered, leaf, materials, names, quantity, relight};
use crate::Result;
use crate::error::Error;
use crate::scene::Quantity;
use crate::scene::decode::join;
use crate::spectral::Curve;
use crate::spectral::colour::Observer;
use crate::spectral::product::Term;

/// What is to be as nobody rendered it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Choice {
    /// Spectra by name, as a scene file writes them.
    pub spectra: BTreeMap<String, Value>,
    /// Of those of them that are light: how many times the luminance that was rendered they are scaled to.
    pub luminances: BTreeMap<String, f64>,
    /// Kelvins by the names of materials.
    pub temperatures: BTreeMap<String, f64>,
    /// What files hold, by the names that spectra have for them.
    pub files: BTreeMap<String, String>,
}

/// What a choice comes to.
#[derive(Debug, Clone, PartialEq)]
pub struct Chosen {
    pub relit: Relit,
    /// The same for `spectile relight --set`.
    pub sets: Vec<(String, String)>,
}

/// What can be chosen of a cube.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub struct Changeable {
    pub spectra: Vec<NamedSpectrum>,
    pub temperatures: Vec<HotMaterial>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NamedSpectrum {
    pub name: String,
    /// All that it is used as, such as `a reflectance`.
    pub quantities: Vec<String>,
    /// Whether it is light.
    pub light: bool,
    /// What it was rendered with, in words.
    pub rendered: String,
    /// ∫ȳ L dλ / ∫ȳ dλ of light, in its unit.
    pub luminance: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HotMaterial {
    pub material: String,
    pub kelvin: f64,
}

/// The spectra and temperatures of `rendered` that can be chosen.
pub fn changeable(rendered: Rendered) -> Changeable {
    let basis = rendered.basis;
    let spectrum = |name: &str| {
        let all = || basis.spectra.iter().filter(|leaf| leaf.is_named && leaf.name == name);
        let light = all().any(|leaf| quantity(leaf).is_some_and(Quantity::is_light));
        let curve = &leaf(basis, name).curve;
        NamedSpectrum {
            name: name.to_owned(),
            quantities: all().map(|leaf| leaf.quantity.clone()).collect(),
            light,
            rendered: words(curve),
            luminance: light.then(|| luminance(curve)),
        }
    };
    let kelvin = |name: &str| {
        let terms = basis.factors.iter().chain(&basis.sources).flat_map(|expression| &expression.terms);
        let kelvin = terms.filter_map(|term| match term {
            Term::Planck { material, kelvin, .. } if material == name => Some(*kelvin),
            _ => None,
        });
        HotMaterial { material: name.to_owned(), kelvin: kelvin.fold(0.0, f64::max) }
    };
    Changeable {
        spectra: names(basis).into_iter().map(spectrum).collect(),
        temperatures: materials(basis, false).into_iter().map(kelvin).collect(),
    }
}

fn words(curve: &Curve) -> String {
    match curve {
        Curve::Constant(value) => format!("{value:?} everywhere"),
        Curve::Blackbody { kelvin, scale } if *scale == 1.0 => format!("black body of {kelvin} K"),
        Curve::Blackbody { kelvin, scale } => format!("black body of {kelvin} K, times {scale:?}"),
        Curve::Linear { nm, .. } => {
            format!("table of {} values, {} to {} nm", nm.len(), nm[0], nm[nm.len() - 1])
        }
    }
}

fn luminance(curve: &Curve) -> f64 {
    Observer::Cie1931.xyz(curve)[1]
}

/// `rendered` under a choice. No file of this machine is read.
///
/// # Errors
/// As [`relight`]; and luminances that cannot be kept.
pub fn choose(rendered: Rendered, choice: &Choice) -> Result<Chosen> {
    let files: Vec<(String, String)> =
        choice.files.iter().map(|(name, content)| (name.clone(), content.clone())).collect();
    let with = |spectra: &BTreeMap<String, Value>| {
        let mut sets = Vec::new();
        for (name, value) in spectra {
            sets.push((join("spectra", name), toml_of(name, value)?));
        }
        for (material, kelvin) in &choice.temperatures {
            sets.push((join(&join("materials", material), "temperature"), format!("{kelvin:?}")));
        }
        let relit = relight(rendered, &sets, NewChannels::Same, Files::Given(&files))?;
        Ok(Chosen { relit, sets })
    };
    let chosen = with(&choice.spectra)?;
    if choice.luminances.is_empty() {
        return Ok(chosen);
    }
    let mut spectra = choice.spectra.clone();
    for (name, times) in &choice.luminances {
        let refuse = |what: &str| Err(Error::Usage(format!("luminances: `{name}` {what}")));
        if !(*times >= 0.0 && times.is_finite()) {
            return refuse("must be 0 or more");
        }
        let Some(value) = spectra.get_mut(name) else { return refuse("is not among the spectra that are chosen") };
        let [before, after] = [rendered.basis, &chosen.relit.basis].map(|basis| leaf(basis, name));
        if !quantity(before).is_some_and(Quantity::is_light) {
            return refuse("is no light, which alone has a luminance");
        }
        let [before, after] = [before, after].map(|leaf| luminance(&leaf.curve));
        if before <= 0.0 {
            return refuse("was rendered without luminance: give its `scale` instead");
        }
        if after <= 0.0 {
            return refuse("has no luminance, so that no scale gives it that of the render");
        }
        *value = scaled(value.take(), times * before / after);
    }
    with(&spectra)
}

/// A spectrum times `factor`, as it would be written.
fn scaled(written: Value, factor: f64) -> Value {
    match written {
        Value::Object(mut table) => {
            let scale = table.get("scale").and_then(Value::as_f64).unwrap_or(1.0);
            table.insert("scale".to_owned(), json!(scale * factor));
            Value::Object(table)
        }
        number => json!({ "constant": number, "scale": factor }),
    }
}

/// The value of `spectra.NAME` in TOML.
fn toml_of(name: &str, value: &Value) -> Result<String> {
    let written = toml::Value::try_from(value);
    let refused = |_| Error::Usage(format!("`{}`: JSON's null is no value of a scene file", join("spectra", name)));
    written.map(|value| value.to_string()).map_err(refused)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectral::product::{Basis, Expression, Leaf};
    use crate::spectral::{Channels, Outside};

    fn basis() -> Basis {
        let leaf = |name: &str, quantity: Quantity, curve: Curve| Leaf {
            name: name.into(),
            is_named: true,
            quantity: quantity.noun().into(),
            curve,
        };
        let table = Curve::Linear { nm: vec![400.0, 700.0], value: vec![0.1, 0.7], outside: Outside::Hold };
        let of = |terms: Vec<Term>| Expression { scale: 1.0, terms };
        Basis {
            spectra: vec![
                leaf("desk lamp", Quantity::Radiance, Curve::Blackbody { kelvin: 3000.0, scale: 0.5 }),
                leaf("paint", Quantity::Reflectance, table),
                leaf("off", Quantity::Radiance, Curve::Constant(0.0)),
            ],
            factors: vec![of(vec![Term::Spectrum(1)])],
            sources: vec![
                of(vec![Term::Spectrum(0)]),
                of(vec![Term::Spectrum(2)]),
                of(vec![Term::Complement(1), Term::Planck { material: "wall".into(), kelvin: 290.0, is_node: false }]),
            ],
        }
    }

    fn chosen(choice: Value) -> Result<Chosen> {
        let (basis, channels) = (basis(), Channels::equal(400.0, 700.0, 3));
        let rendered = Rendered { basis: &basis, channels: &channels, remainder: &[], beside: &[] };
        choose(rendered, &serde_json::from_value(choice).expect("a choice"))
    }

    /// What the command line gets makes the same.
    #[test]
    fn choices_are_sets() {
        let choice = json!({
            "spectra": {
                "desk lamp": { "mix": [{ "illuminant": "FL11" }, { "named": "desk lamp", "scale": 2 }], "share": 0.25, "scale": 3 },
                "paint": { "samples": [[400, 0.5], [700, 0.25]] },
                "off": 0.125,
            },
            "temperatures": { "wall": 300.5 },
        });
        let Chosen { relit, sets } = chosen(choice).expect("a choice");
        let (basis, channels) = (basis(), Channels::equal(400.0, 700.0, 3));
        let rendered = Rendered { basis: &basis, channels: &channels, remainder: &[], beside: &[] };
        assert_eq!(relight(rendered, &sets, NewChannels::Same, Files::Disk).expect("the same"), relit);
        assert_eq!(relit.changed, ["spectra.desk lamp", "spectra.off", "spectra.paint", "materials.wall.temperature"]);
        assert_eq!(sets[1], ("spectra.off".to_owned(), "0.125".to_owned()));
        assert_eq!(chosen(json!({})).expect("nothing").relit.basis, basis);
    }

    #[test]
    fn luminances_are_kept() {
        for value in [json!({ "illuminant": "A" }), json!(3), json!({ "blackbody": 9000, "scale": 7e-4 })] {
            let choice = json!({ "spectra": { "desk lamp": value }, "luminances": { "desk lamp": 0.25 } });
            let relit = chosen(choice).expect("a lamp").relit;
            let ratio = luminance(&relit.basis.spectra[0].curve) / luminance(&basis().spectra[0].curve);
            assert!((ratio - 0.25).abs() < 1e-12, "{value}: {ratio}");
        }
        for (choice, words) in [
            (json!({ "spectra": { "off": 1 }, "luminances": { "off": 1 } }), "without luminance"),
            (json!({ "spectra": { "desk lamp": 0 }, "luminances": { "desk lamp": 1 } }), "no scale"),
            (json!({ "spectra": { "paint": 0.5 }, "luminances": { "paint": 1 } }), "no light"),
            (json!({ "luminances": { "desk lamp": 1 } }), "not among"),
            (json!({ "spectra": { "desk lamp": null } }), "null"),
            (json!({ "spectra": { "desk lamp": "off" } }), "must be a number or a table"),
        ] {
            let said = chosen(choice).expect_err(words).to_string();
            assert!(said.contains(words), "{said}");
        }
    }

    #[test]
    fn what_can_be_chosen_is_listed() {
        let (basis, channels) = (basis(), Channels::equal(400.0, 700.0, 3));
        let rendered = Rendered { basis: &basis, channels: &channels, remainder: &[], beside: &[] };
        let Changeable { spectra, temperatures } = changeable(rendered);
        let facts: Vec<_> = spectra.iter().map(|s| (s.name.as_str(), s.light, s.rendered.as_str())).collect();
        let want = [
            ("desk lamp", true, "black body of 3000 K, times 0.5"),
            ("off", true, "0.0 everywhere"),
            ("paint", false, "table of 2 values, 400 to 700 nm"),
        ];
        assert_eq!((facts, temperatures[0].kelvin), (want.to_vec(), 290.0));
    }
}
