//! A render that is watched: its picture comes with its first paths, it rests, goes on, saves and stops as it is asked.

use std::fs;
use std::time::{Duration, Instant};

use serde_json::Value;
use spectile::cube::Cube;
use tempfile::tempdir;

use super::client::{Events, Running, get};
use crate::binary::{PATIENCE, command, cornell, wait_for};

fn render<'a>(scene: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let small = ["render", scene, "-o", "cube.zarr", "--json", "--listen", "127.0.0.1:0", "--tile", "16"];
    [&small[..], &["--size", "48x32", "--set", "channels.equal.count=40", "--spp", "1000000000"], more].concat()
}

/// The status of a render that was told to rest and has merged all that was under way then.
fn at_rest(running: &Running) -> Value {
    running.until(|status| status["stage"] == "paused");
    let mut last = running.status();
    wait_for("the last units", || {
        std::thread::sleep(Duration::from_secs(1));
        let now = running.status();
        let rests = now["paths"] == last["paths"];
        last = now;
        rests.then_some(())
    });
    last
}

#[test]
fn the_first_picture_comes_with_the_first_paths_and_controls_are_obeyed() {
    let folder = tempdir().expect("folder");
    let scene = cornell();
    let running = Running::start(folder.path(), &render(scene.to_str().expect("UTF-8"), &[]));
    // As long as there is no cube there is no picture, and the status says why.
    running.until(|status| status["paths"].as_u64().is_some_and(|paths| paths > 0));
    let picture = get(running.address, "/api/image?format=f32&show=colour").floats();
    assert!(picture.iter().any(|v| *v > 0.0));

    // Later pictures have more of it.
    let later = running.until(|status| status["samples"].as_u64() >= Some(2));
    assert_eq!((&later["stage"], &later["controls"]), (&"rendering".into(), &true.into()));
    assert!(get(running.address, "/api/image?format=f32&show=colour").floats().iter().all(|v| v.is_finite()));

    assert_eq!(running.control("pause"), 204);
    let rests = at_rest(&running);
    // All that is merged is on disk.
    assert_eq!(running.control("save"), 204);
    let cube = Cube::open(&folder.path().join("cube.zarr")).expect("a cube");
    let paths = || -> u64 {
        let of_tile = |tile| cube.grid().rect(tile).pixels() * u64::from(cube.samples(tile).expect("samples"));
        (0..cube.grid().count()).map(of_tile).sum()
    };
    wait_for("all that is merged", || (Some(paths()) == rests["paths"].as_u64()).then_some(()));
    // A spectrum is the one on disk.
    let csv = get(running.address, "/api/spectrum?x=20&y=30&format=csv").body;
    assert_eq!(csv, command(folder.path(), &["spectrum", "cube.zarr", "20", "30"]).output().expect("runs").stdout);

    assert_eq!(running.control("resume"), 204);
    running.until(|status| status["paths"].as_u64() > rests["paths"].as_u64());
    let mut events = Events::listen(running.address);
    assert_eq!(running.control("stop"), 204);
    let (_, end) = events.find(|(name, _)| name == "end").expect("an end");
    assert_eq!((&end["stage"], &end["controls"]), (&"stopped".into(), &false.into()));
    // As by Ctrl-C: what is merged is kept.
    let (code, said) = running.ends();
    assert_eq!(code, Some(130));
    let said: Vec<&str> = said.iter().filter_map(|event| event["event"].as_str()).collect();
    let order = ["paused", "resumed", "error"].map(|name| said.iter().position(|event| *event == name).expect(name));
    assert!(order.is_sorted(), "{said:?}");
    assert!(cube.progress().expect("progress").samples[0] >= 2);
}

/// A pause is not counted as time of rendering, nor towards `--time`; a stop during one ends it.
#[test]
fn a_pause_costs_no_time() {
    let folder = tempdir().expect("folder");
    let scene = cornell();
    let running = Running::start(folder.path(), &render(scene.to_str().expect("UTF-8"), &["--time", "10m"]));
    // What has been spent and what is left of `--time`.
    let clocks = |status: &Value| ["rendering_s", "remaining_s"].map(|name| status[name].as_f64().expect("a number"));
    // They are read when units are merged: the next reading is of a moment after this one.
    let next = |before: [f64; 2]| clocks(&running.until(|status| status["rendering_s"].as_f64() > Some(before[0])));
    running.until(|status| status["samples"].as_u64() >= Some(1));
    let begun = Instant::now();
    let first = next(clocks(&running.status()));
    assert_eq!(running.control("pause"), 204);
    let before = clocks(&at_rest(&running));
    let pause = Duration::from_secs(3);
    std::thread::sleep(pause);
    assert_eq!(running.control("resume"), 204);
    let last = next(before);
    // Whatever else the machine had to do meanwhile, these seconds were none of the render's.
    let most = (begun.elapsed() - pause).as_secs_f64();
    assert!(last[0] - first[0] <= most && first[1] - last[1] <= most, "{first:?} {before:?} {last:?} {most}");
    assert_eq!(running.control("pause"), 204);
    running.until(|status| status["stage"] == "paused");
    assert_eq!(running.control("stop"), 204);
    assert_eq!(running.ends().0, Some(130));
}

/// The picture file is replaced as a whole, and not more than once a second.
#[test]
fn the_preview_file_is_whole_and_not_written_too_often() {
    let folder = tempdir().expect("folder");
    let scene = cornell();
    let more = ["--preview", "now.png", "--exposure", "1"];
    let running = Running::start(folder.path(), &render(scene.to_str().expect("UTF-8"), &more));
    let path = folder.path().join("now.png");
    let (mut written, mut last) = (Vec::new(), None);
    let began = Instant::now();
    while written.len() < 4 {
        assert!(began.elapsed() < PATIENCE, "{written:?}");
        if let Ok(found) = fs::metadata(&path) {
            let modified = found.modified().expect("a time");
            if last != Some(modified) {
                last = Some(modified);
                written.push(modified);
            }
            let bytes = fs::read(&path).expect("read");
            let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().expect("a PNG");
            let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
            reader.next_frame(&mut pixels).expect("all of it");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    for pair in written.windows(2) {
        let between = pair[1].duration_since(pair[0]).expect("in order");
        // A busy machine can only make it longer: the second is counted from the end of one to the beginning of the next. File
        // systems round times to the kernel's ticks.
        assert!(between > Duration::from_millis(900), "{between:?}");
    }
    assert_eq!(running.status()["exposure_ev"], 1.0);
    assert_eq!(running.control("stop"), 204);
    assert_eq!(running.ends().0, Some(130));
}
