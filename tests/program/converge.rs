//! `spectile converge` as users meet it: one small scene in four ways, and what the report says of it.

use std::path::Path;
use std::process::Output;

use serde_json::Value;

use crate::binary;

fn run(folder: &Path, arguments: &[&str]) -> Output {
    let scene = binary::cornell();
    let small = ["--size", "16x16", "--set", "channels.equal.count=8"];
    binary::run(folder, &[&["converge", scene.to_str().expect("UTF-8")], &small[..], arguments].concat())
}

#[test]
fn a_report_of_two_samplers_and_two_numbers_of_channels() {
    let folder = tempfile::tempdir().expect("a folder");
    let vary = ["--vary", "integrator.sampler=sobol,independent", "--vary", "channels.equal.count=4,8"];
    let output =
        run(folder.path(), &[&["-o", "report", "--spp", "1024", "--budget", "1h", "--json"], &vary[..]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let read = |name: &str| std::fs::read_to_string(folder.path().join("report").join(name)).expect("written");
    let report: Value = serde_json::from_str(&read("converge.json")).expect("JSON");
    let curves = report["curves"].as_array().expect("curves");
    let names: Vec<&str> = curves.iter().map(|c| c["name"].as_str().expect("a name")).collect();
    let expected = [
        "sampler sobol, count 4",
        "sampler independent, count 4",
        "sampler sobol, count 8",
        "sampler independent, count 8",
    ];
    assert_eq!(names, expected);
    let (mut estimated, mut real) = (0.0, 0.0);
    for curve in curves {
        let points = curve["points"].as_array().expect("points");
        // 1, 1, 2, … 32 samples, then 64 at a time to 1,024.
        assert_eq!(points.len(), 7 + 15);
        let number = |i: usize, key: &str| points[i][key].as_f64().expect("a number");
        assert_eq!((number(0, "samples"), number(21, "samples")), (1.0, 1024.0));
        assert!((1..22).all(|i| number(i, "seconds") > number(i - 1, "seconds")));
        assert!(points[6]["error_estimate"].is_null() && number(21, "error_estimate") > 0.0);
        estimated += number(21, "error_estimate").powi(2);
        real += number(21, "error").powi(2);
        let slope = curve["slope_samples"].as_f64().expect("a slope");
        // Of one realisation in which the few pixels at the lamp's edge count most, by Sobol points or without:
        // tests/images/convergence.rs measures slopes.
        assert!((-1.5..-0.3).contains(&slope), "{curve}");
    }
    // The few pixels at the lamp's edge carry most of it, so that of one curve neither is known to a factor of two;
    // tests/render/accuracy.rs calibrates.
    let ratio = (estimated / real).sqrt();
    assert!((0.5..2.0).contains(&ratio), "{ratio}");
    let csv = read("converge.csv");
    assert_eq!(csv.lines().count(), 1 + 4 * 4 * 22);
    let html = read("converge.html");
    assert!(html.contains("<svg") && html.contains("sampler independent, count 8") && !html.contains("NaN"));
    let done = String::from_utf8_lossy(&output.stdout).lines().last().map(str::to_owned).expect("events");
    assert_eq!(serde_json::from_str::<Value>(&done).expect("JSON")["event"], "done");
}

#[test]
fn what_cannot_be_measured_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let fails = |arguments: &[&str], words: &str| {
        let output = run(folder.path(), arguments);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(2) && stderr.contains(words), "{arguments:?}: {stderr}");
    };
    fails(&["-o", "r", "--vary", "integrator.sampler"], "KEY=A,B");
    fails(&["-o", "r", "--vary", "integrator.sampler=sobol,dice"], "integrator.sampler");
    fails(&["-o", "r", "--budget", "0s"], "a time is");
    fails(&["-o", "r", "--budget", "0.001s"], "give a larger --budget");
}
