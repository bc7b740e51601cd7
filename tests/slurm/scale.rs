//! The model of docs/SCALE.md against runs on 1, 2 and 4 nodes of this machine. Prints the table that stands there:
//!
//!     cargo test --release --test all slurm::scale -- --ignored --nocapture

use std::process::Command;
use std::time::Instant;

use serde_json::Value;

use super::{Place, folder_with_scene, is_there, turn};

const SPP: &str = "16384";
const TASKS: u32 = 8;

/// What one run says of itself.
struct Run {
    started_s: f64,
    ended_s: f64,
    setup_s: f64,
}

fn runs(place: &Place) -> Vec<Run> {
    let each = std::fs::read_dir(place.at("cube.zarr/.spectile")).expect("a folder").flatten().filter_map(|entry| {
        let is_run = entry.file_name().to_str().is_some_and(|name| name.starts_with("run-"));
        let run: Value = serde_json::from_slice(&std::fs::read(entry.path()).ok().filter(|_| is_run)?).ok()?;
        let number = |key: &str| run[key].as_f64().expect("a number");
        Some(Run { started_s: number("started_s"), ended_s: number("ended_s"), setup_s: number("setup_seconds") })
    });
    each.collect()
}

/// Seconds that `processes` renders of a task's share of the picture each take here at the same time, with a thread each: what
/// the machine gives so many nodes, without Slurm.
fn together(processes: u32) -> f64 {
    let folder = folder_with_scene();
    let began = Instant::now();
    let children: Vec<_> = (0..processes)
        .map(|i| {
            let mut command = Command::new(env!("CARGO_BIN_EXE_spectile"));
            command.current_dir(folder.path()).env("XDG_RUNTIME_DIR", folder.path()).env("LP_NUM_THREADS", "1");
            command.args(["render", "scene.toml", "-o", "cube.zarr", "--tile", "8", "--quiet", "--spp", SPP]);
            command.args(["--tiles", &format!("{}..{}", 8 * i, 8 * i + 8)]).spawn().expect("started")
        })
        .collect();
    for mut child in children {
        assert!(child.wait().expect("ended").success());
    }
    began.elapsed().as_secs_f64()
}

#[test]
#[ignore = "minutes: measures the model of docs/SCALE.md"]
fn scale() {
    if !is_there() {
        return;
    }
    println!(
        "| nodes | a task alone here | predicted | measured | measured / predicted | start of a task | verify, by tile |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    for nodes in [1u32, 2, 4] {
        let alone = {
            let _turn = turn();
            together(nodes)
        };
        let place = Place::new(nodes as usize, 1).expect("Slurm is there");
        place.submit(&["--spp", SPP, "--tasks", &TASKS.to_string()]);
        place.cluster.wait_until_empty();
        let began = Instant::now();
        place.success(&["info", "cube.zarr", "--verify"]);
        let verify_s = began.elapsed().as_secs_f64();
        let runs = runs(&place);
        assert_eq!(runs.len() as u32, TASKS);
        let first = runs.iter().map(|run| run.started_s - run.setup_s).fold(f64::INFINITY, f64::min);
        let last = runs.iter().map(|run| run.ended_s).fold(0.0, f64::max);
        let setup = runs.iter().map(|run| run.setup_s).sum::<f64>() / runs.len() as f64;
        // Rounds of tasks, each as long as so many processes take here together.
        let predicted = f64::from(TASKS.div_ceil(nodes)) * alone;
        let measured = last - first;
        println!(
            "| {nodes} | {alone:.1} s | {predicted:.1} s | {measured:.1} s | {:.2} | {setup:.2} s | {:.2} ms |",
            measured / predicted,
            1e3 * verify_s / 64.0
        );
    }
}
