//! `spectile stress` as users meet it: the quick set passes, and what it prints can be read again: answer, error, bound,
//! verdict.

use std::process::Output;

use serde_json::Value;

use crate::{binary, size};

fn run(arguments: &[&str]) -> (Output, tempfile::TempDir) {
    let folder = tempfile::tempdir().expect("a folder");
    (binary::run(folder.path(), &[&["stress"], arguments].concat()), folder)
}

/// Cases of many kernels, which tests of their own show too: `reference::bsdf`, `images`, `physics`, `render::several`.
const LONG: [&str; 7] = ["cavity", "white-metal", "rough-glass", "indices", "scattering", "machinery", "evaluators"];

#[test]
fn the_quick_set_passes() {
    let (list, _) = run(&["--list"]);
    let list = String::from_utf8_lossy(&list.stdout).into_owned();
    let names: Vec<&str> = list.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert!(LONG.iter().all(|long| names.contains(long)), "{list}");
    let chosen = names.iter().filter(|name| size::is_full() || !LONG.contains(name));
    let cases: Vec<&str> = chosen.flat_map(|name| ["--case", name]).collect();
    let (output, folder) = run(&[&["--json", "-o", "report"], &cases[..]].concat());
    let stdout = String::from_utf8_lossy(&output.stdout).into_owned();
    let events: Vec<Value> = stdout.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let cases: Vec<&Value> = events.iter().filter(|e| e["event"] == "case").collect();
    let failed: Vec<&&Value> = cases.iter().filter(|case| case["verdict"] != "pass").collect();
    assert!(failed.is_empty() && output.status.success(), "{failed:#?}\n{}", String::from_utf8_lossy(&output.stderr));
    assert!(cases.len() >= 25);
    for case in &cases {
        let checks = case["checks"].as_array().expect("checks");
        let complete = |check: &Value| ["expected", "got", "error", "bound"].iter().all(|key| check[key].is_f64());
        assert!(!checks.is_empty() && checks.iter().all(complete), "{case}");
    }
    let html = std::fs::read_to_string(folder.path().join("report/stress.html")).expect("written");
    assert!(cases.iter().all(|case| html.contains(case["case"].as_str().expect("a name"))));
    for name in ["stress.csv", "stress.json"] {
        assert!(folder.path().join("report").join(name).exists());
    }
}

#[test]
fn cases_are_listed_and_chosen_by_name() {
    let (output, _) = run(&["--list"]);
    let list = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success() && list.lines().count() >= 25 && list.contains("watertight"), "{list}");
    let (output, _) = run(&["--case", "two-nodes"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        output.status.success() && text.contains("pass mean, channel 4") && text.contains("1 cases passed"),
        "{text}"
    );
    let (output, _) = run(&["--case", "two-noods"]);
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(2) && stderr.contains("there are line, long-table"), "{stderr}");
}
