//! `spectile bench` as users meet it, and the scene with everything in it that it compares with.

use std::path::Path;
use std::process::Output;

use glam::{DVec2, DVec3};
use serde_json::Value;
use spectile::device::example::with_everything;
use spectile::device::part::{OnDevice, PARTS};
use spectile::device::prepared::Prepared;
use spectile::device::windows::Windows;
use spectile::scene::{Filter, Projection, Scene, Sides};
use spectile::spectral::Channels;

use crate::binary::{self, cornell};
use crate::device::{Settings, render};
use crate::scene_builder::*;
use crate::{size, statistics};

fn bench(folder: &Path, arguments: &[&str]) -> Output {
    binary::run(folder, &[&["bench"], arguments].concat())
}

#[test]
fn a_report_of_evaluators() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = cornell();
    // Each has kernels of its own, which take longer to compile than to run.
    let (channels, evaluators, sets) = match size::is_full() {
        true => ("4,64", "dpept-pixel,dpept-path,dpept-spectral,pt", 2),
        false => ("4", "dpept-pixel", 0),
    };
    let options = ["-o", "report", "--pools", "1024", "--frames", "32,64", "--rounds", "1", "--json"];
    let small = ["--channels", channels, "--evaluators", evaluators];
    let sets_wanted: &[&str] = if sets == 0 { &["--own-kernels"] } else { &[] };
    let scene = [scene.to_str().expect("UTF-8")];
    let output = bench(folder.path(), &[&scene[..], &options, &small, sets_wanted].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let read = |name: &str| std::fs::read_to_string(folder.path().join("report").join(name)).expect("written");
    let report: Value = serde_json::from_str(&read("bench.json")).expect("JSON");
    let rows = report["rows"].as_array().expect("rows");
    // All evaluators with each number of channels and the pool, and two sets of kernels, of which one is the largest that there is.
    assert_eq!(rows.len(), evaluators.split(',').count() * (channels.split(',').count() + 1) + sets);
    assert_eq!(report["missing"], Value::Array(Vec::new()));
    for row in rows {
        let number = |key: &str| row[key].as_f64().unwrap_or_else(|| panic!("{key}: {row}"));
        assert!(number("paths_per_s") > 0.0, "{row}");
        // What the device's allocator took is what the plan says: all but small change.
        let (planned, allocated) = (number("planned_bytes"), number("allocated_bytes"));
        assert!((allocated - planned).abs() <= 0.001 * planned + 16384.0, "{row}");
        // Times of the passes are there.
        assert!(number("generate_s") > 0.0 && number("evaluate_s") > 0.0, "{row}");
        let conventional = row["evaluator"] == "pt";
        let channels = number("channels");
        if conventional {
            // 32 bytes, 16 a channel (Hoarau et al. 2018, section 4.2), heads, queues and the records of one vertex.
            assert_eq!(number("path_bytes"), 32.0 + 16.0 * channels + 16.0 + 24.0, "{row}");
        } else if row["kernels"] == "own" {
            assert_eq!(number("path_bytes"), 136.0, "{row}");
        }
        if row["part"] == "pool" {
            assert_eq!((number("pool"), channels), (1024.0, 128.0));
        }
    }
    let frames = report["frames"].as_array().expect("frames");
    assert_eq!(frames.iter().map(|f| f["side"].as_u64()).collect::<Vec<_>>(), [Some(32), Some(64)]);
    assert!(frames.iter().all(|f| f["seconds"][0].as_f64().expect("a number") > 0.0), "{frames:?}");
    assert_eq!(read("bench.csv").lines().count(), 1 + rows.len());
    let html = read("bench.html");
    for part in ["<svg", "dpept-spectral", "any number"].into_iter().chain((sets > 0).then_some("What is left out")) {
        assert!(html.contains(part), "{part} is missing");
    }
    assert!(!html.contains("NaN"));
}

#[test]
fn what_cannot_be_benched_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let fails = |arguments: &[&str], words: &str| {
        let output = bench(folder.path(), arguments);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(2) && stderr.contains(words), "{arguments:?}: {stderr}");
    };
    fails(&["-o", "r"], "root of Spectile's repository");
    fails(&["-o", "r", "--evaluators", "dpept"], "one of dpept-pixel, dpept-path, dpept-spectral, pt");
    fails(&["-o", "r", "none.toml"], "none.toml");
}

/// A room that what is added to it is beside. Closed, so that nothing is lost through where the box is.
fn lit_room() -> Scene {
    Builder::new()
        .camera(look(
            DVec3::new(0.0, 0.1, 0.9),
            DVec3::ZERO,
            DVec3::Y,
            Projection::Perspective { tan_half: DVec2::splat(0.7) },
        ))
        .film(8, 8, Filter::Box)
        .channels(Channels::equal(400.0, 700.0, 4))
        .bounces(3)
        .diffuse(room(DVec3::NEG_ONE, DVec3::ONE), 0.6)
        .lamp(sphere(DVec3::new(0.3, 0.6, 0.0), 0.2), 2.0, Sides::Front)
        .build()
}

/// The scene with everything compiles every part of a general scene.
#[test]
fn everything_is_compiled_in() {
    let all = with_everything(&lit_room());
    let prepared = Prepared::new(&all, 0).expect("a scene that fits");
    let on_device = OnDevice { prepared: &prepared, windows: Windows::WHOLE };
    for part in PARTS.iter().filter(|part| part.example.is_some()) {
        assert!((part.used)(&on_device), "{}", part.name);
    }
    let surfaces = prepared.surfaces.as_ref().expect("a general scene");
    let textures = surfaces.textures.as_ref().expect("textures");
    for (what, is_there) in [
        ("a rough base", surfaces.rough_base),
        ("rough dispersion", surfaces.spread),
        ("textures", surfaces.textured && surfaces.textured_base && textures.colours && textures.mixtures),
        ("masks", textures.first_share.is_some()),
        ("heat by place", prepared.radiators.as_ref().is_some_and(|r| r.features.textured && r.features.facets)),
    ] {
        assert!(is_there, "{what}");
    }
    // All kinds of lobes: one bit each without a gap.
    assert_eq!(surfaces.kinds.count_ones(), u32::BITS - surfaces.kinds.leading_zeros(), "{:b}", surfaces.kinds);
}

/// And its picture is the same: what is added is not seen.
#[test]
#[ignore = "kernels of everything: a minute of compiling, and the report of all evaluators renders it too"]
fn everything_is_seen_by_nobody() {
    let scene = lit_room();
    let all = with_everything(&scene);
    let picture = |scene: &_, seed| {
        let rendered = render(scene, 16, 64, Settings { seed, ..Settings::default() });
        rendered.assert_clean();
        rendered.image_means()
    };
    statistics::assert_same_means("everything", &picture(&scene, 1), &picture(&all, 2), 4.5);
}
