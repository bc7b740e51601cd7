//! `docs/json.md` against what the program prints: the same events, the same fields, the same types.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use super::{Place, events, text};

const DOCUMENT: &str = include_str!("../../docs/json.md");

/// What a field may be, as the document says.
type Fields = BTreeMap<String, String>;

/// Fields by (command, event); `all commands` and what every event has are merged into each.
fn documented() -> BTreeMap<(String, String), Fields> {
    let mut found: BTreeMap<(String, String), Fields> = BTreeMap::new();
    let (mut command, mut event) = (String::new(), String::new());
    for line in DOCUMENT.lines() {
        if let Some(name) = line.strip_prefix("### ") {
            event = name.to_owned();
            found.entry((command.clone(), event.clone())).or_default();
        } else if let Some(name) = line.strip_prefix("## ") {
            (command, event) = (name.to_owned(), String::new());
        } else if let Some(row) = line.strip_prefix("| `") {
            let (field, rest) = row.split_once("` | ").expect("a field");
            let kind = rest.split(" | ").next().expect("a type");
            found.entry((command.clone(), event.clone())).or_default().insert(field.to_owned(), kind.to_owned());
        } else if line.contains("Fields as in `progress`") {
            let fields = found[&(command.clone(), "progress".to_owned())].clone();
            found.entry((command.clone(), event.clone())).or_default().extend(fields);
        }
    }
    let everywhere = found.remove(&(String::new(), String::new())).expect("what every event has");
    found.values_mut().for_each(|fields| fields.extend(everywhere.clone()));
    found
}

/// Every field of an event with its type, nested ones as `a.b` and `a[].b`; open objects are not looked into.
fn collect(value: &Value, prefix: &str, allowed: &Fields, seen: &mut BTreeSet<String>) {
    for (key, value) in value.as_object().expect("an object") {
        let path = format!("{prefix}{key}");
        let kind = allowed.get(&path).unwrap_or_else(|| panic!("`{path}` is not in docs/json.md"));
        assert!(is_a(value, kind), "`{path}` is {value}, documented as {kind}");
        seen.insert(path.clone());
        match value {
            Value::Object(_) if !kind.starts_with("open") => collect(value, &format!("{path}."), allowed, seen),
            Value::Array(items) if items.iter().all(Value::is_object) => {
                items.iter().for_each(|item| collect(item, &format!("{path}[]."), allowed, seen));
            }
            _ => {}
        }
    }
}

fn is_a(value: &Value, kind: &str) -> bool {
    let kind = kind.trim_end_matches(", optional");
    kind.split(" or ").any(|kind| match kind {
        "string" => value.is_string(),
        "integer" => value.is_u64(),
        "number" => value.is_number(),
        "boolean" => value.is_boolean(),
        "array" => value.is_array(),
        "object" | "open object" => value.is_object(),
        "null" => value.is_null(),
        _ => panic!("docs/json.md: `{kind}` is no type"),
    })
}

#[test]
fn the_document_names_every_event_and_field() {
    let place = Place::new();
    let render = |more: &[&'static str]| [&["render", "scene.toml", "--json", "-o"], more].concat();
    // Spectra that do not cover the channels make warnings.
    let short = "spectra.lamp.samples=[[450, 1.0], [600, 2.0]]";
    let wide = ["--set", "materials.grey.diffuse.reflectance={ samples = [[450, 0.1], [600, 0.2]] }", "--set", short];
    let runs: Vec<Vec<&str>> = vec![
        render(&["a.zarr", "--spp", "130", "--preview", "a.png", "--profile", "--time", "1h"]),
        render(&["b.zarr", "--spp", "1", "--listen", "127.0.0.1:0"]),
        render(&[&["c.zarr"], &wide[..]].concat()),
        render(&["a.zarr"]),
        render(&["d.zarr", "--set", "film.width=0"]),
        vec!["render", "fog.toml", "--json", "-o", "fog.zarr", "--spp", "1"],
        vec!["plan", "scene.toml", "--parts", "--layers", "depth", "--json"],
        vec!["devices", "--json"],
        vec!["info", "a.zarr", "--json"],
        vec!["info", "a.zarr", "--json", "--watch"],
        vec!["submit", "scene.toml", "-o", "e.zarr", "--spp", "64", "--dry-run", "--json"],
        vec!["compare", "a.zarr", "b.zarr", "--json"],
        vec!["export", "a.zarr", "-o", "b.png", "--json"],
        vec!["export", "a.zarr", "-o", "c.png", "--colour-map", "--json"],
        vec!["export", "a.zarr", "-o", "b.csv", "--json"],
        vec!["sensor", "a.zarr", "--responses", "s.csv", "-o", "s.zarr", "--json"],
        render(&["l.zarr", "--spp", "1", "--layers", "depth"]),
        vec!["export", "l.zarr", "-o", "l.csv", "--layers", "depth", "--json"],
        render(&["t.zarr", "--spp", "64", "--tile", "8", "--error", "0.5", "--error-per", "tile"]),
        vec!["info", "t.zarr", "--json"],
        render(&["w.zarr", "--spp", "1", "--factored"]),
        vec!["relight", "w.zarr", "-o", "r.zarr", "--json"],
        vec!["info", "nothing.zarr", "--json"],
        vec![
            "sky",
            "--sun-elevation",
            "30",
            "-o",
            "k.zarr",
            "--size",
            "8x4",
            "--spp",
            "1",
            "--channels",
            "equal.count=2",
            "--json",
        ],
    ];
    let fog = "[media.fog]\nscattering = 0.01\n[[objects]]\nsphere = { center = [0, 0, 0], radius = 9 }\ninterior = \"fog\"\n";
    let scene = std::fs::read_to_string(place.path().join("scene.toml")).expect("a scene");
    std::fs::write(place.path().join("fog.toml"), format!("{scene}\n{fog}")).expect("written");
    // A band that is narrower than a channel, and one beyond them all.
    let responses = "nm,narrow,infrared\n450,1,0\n460,1,0\n470,0,0\n800,0,1\n900,0,1\n";
    std::fs::write(place.path().join("s.csv"), responses).expect("written");
    let documented = documented();
    let all = "all commands".to_owned();
    let mut seen: BTreeMap<(String, String), BTreeSet<String>> = BTreeMap::new();
    for arguments in runs {
        let said = events(&text(&place.run(&arguments).stdout));
        let ends = ["done", "error"];
        assert!(said.last().is_some_and(|e| ends.iter().any(|end| e["event"] == *end)), "{arguments:?}: {said:?}");
        for event in &said {
            let name = event["event"].as_str().expect("a name").to_owned();
            let key = match (arguments[0].to_owned(), name.clone()) {
                own if documented.contains_key(&own) => own,
                // A sky is rendered.
                (command, name) if command == "sky" => ("render".to_owned(), name),
                _ => (all.clone(), name),
            };
            let allowed = documented.get(&key).unwrap_or_else(|| panic!("{key:?} is not in docs/json.md"));
            let mut fields = BTreeSet::new();
            collect(event, "", allowed, &mut fields);
            let is_missing =
                |(path, kind): &(&String, &String)| !kind.contains("optional") && !path.contains(['[', '.']);
            let missing: Vec<_> =
                allowed.iter().filter(is_missing).filter(|(path, _)| !fields.contains(*path)).collect();
            assert!(missing.is_empty(), "{key:?} lacks {missing:?}");
            seen.entry(key).or_default().extend(fields);
        }
    }
    // Nobody presses buttons here; tests/preview does.
    let by_hand = ("render".to_owned(), "paused, resumed".to_owned());
    for (key, fields) in documented.iter().filter(|(key, _)| **key != by_hand) {
        let all: BTreeSet<String> = fields.keys().cloned().collect();
        assert_eq!(seen.get(key), Some(&all), "{key:?}: what was printed, and what docs/json.md names");
    }
}

#[test]
fn progress_adds_up() {
    let place = Place::new();
    let said = place.events(&["render", "scene.toml", "-o", "cube.zarr", "--spp", "130", "--tile", "8"]);
    let of = |name: &str| said.iter().filter(|e| e["event"] == name).collect::<Vec<_>>();
    let names: Vec<&str> = said.iter().map(|e| e["event"].as_str().expect("a name")).collect();
    assert_eq!((&names[..2], names.last()), (&["start", "device"][..], Some(&"done")));

    let ends = |name: &str| of(name).iter().map(|e| e["samples"].as_u64().expect("samples")).collect::<Vec<_>>();
    assert_eq!(ends("epoch"), [1, 2, 4, 8, 16, 32, 64, 128, 192]);
    let device = of("device")[0]["name"].clone();
    let mut last = (0, 0);
    for event in of("progress").into_iter().chain(of("done")) {
        let number = |key: &str| event[key].as_f64().expect("a number");
        let now = (event["paths"].as_u64().expect("paths"), event["devices"][0]["units"].as_u64().expect("units"));
        assert!(now.0 >= last.0 && now.1 >= last.1, "{event}");
        last = now;
        // Paths by the second count all time since a device was ready; at the end that goes on after its last unit.
        let busy = event["devices"][0]["busy_s"].as_f64().expect("seconds");
        let idle = event["devices"][0]["idle_s"].as_f64().expect("seconds");
        assert!(busy > 0.0 && idle >= 0.0 && busy + idle <= number("time_s"), "{event}");
        let share = number("paths_per_s") * (busy + idle) / number("paths");
        let least = if event["event"] == "progress" { 1.0 - 1e-9 } else { 0.0 };
        assert!((least..1.0 + 1e-9).contains(&share), "{event}");
        assert_eq!((&event["devices"][0]["name"], event["units_total"].as_u64()), (&device, Some(9)));
        let estimate = event["error_estimate"].as_f64();
        assert_eq!(estimate.is_some(), event["samples"].as_u64() >= Some(128), "{event}");
        assert!(estimate.is_none_or(|e| (1e-4..1.0).contains(&e)), "{event}");
    }
    // 24 x 20 pixels, 192 samples; 9 tiles, 9 epochs.
    assert_eq!(last, (24 * 20 * 192, 81));
    let done = of("done")[0];
    let info = place.events(&["info", "cube.zarr"]).pop().expect("done");
    let largest = info["channels"]
        .as_array()
        .expect("channels")
        .iter()
        .map(|c| c["error_estimate"].as_f64().expect("an estimate"));
    // The render adds and takes away as tiles come, `info` adds once.
    let (largest, estimate) = (largest.reduce(f64::max), done["error_estimate"].as_f64());
    assert!(estimate.zip(largest).is_some_and(|(a, b)| (a / b - 1.0).abs() < 1e-9), "{estimate:?} {largest:?}");
    assert_eq!((&done["remaining_s"], &done["samples_next"]), (&Value::from(0.0), &Value::from(192)));
}
