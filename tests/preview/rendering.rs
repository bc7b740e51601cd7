//! A render that is watched: its picture comes at once, it rests, goes on, saves and stops as it is asked.

use std::fs;
use std::time::{Duration, Instant};

use spectile::cube::Cube;
use tempfile::tempdir;

use crate::client::{Events, Running, command, cornell, get};

fn render<'a>(scene: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let small = ["render", scene, "-o", "cube.zarr", "--json", "--listen", "127.0.0.1:0", "--tile", "16"];
    [&small[..], &["--size", "48x32", "--set", "channels.equal.count=40", "--spp", "1000000000"], more].concat()
}

#[test]
fn the_first_picture_comes_within_two_seconds_and_controls_are_obeyed() {
    let folder = tempdir().expect("folder");
    let scene = cornell();
    let running = Running::start(folder.path(), &render(scene.to_str().expect("UTF-8"), &[]));
    // As long as there is no cube there is no picture, and the status says why.
    let first = running.until(|status| status["paths"].as_u64().is_some_and(|paths| paths > 0));
    let picture = get(running.address, "/api/image?format=f32&show=colour").floats();
    assert!(picture.iter().any(|v| *v > 0.0));
    let seconds = first["rendering_s"].as_f64().expect("a number");
    assert!(seconds < 2.0, "{seconds} s from the first device that was ready");

    // Later pictures have more of it.
    let later = running.until(|status| status["samples"].as_u64() >= Some(2));
    assert_eq!((&later["stage"], &later["controls"]), (&"rendering".into(), &true.into()));
    assert!(get(running.address, "/api/image?format=f32&show=colour").floats().iter().all(|v| v.is_finite()));

    assert_eq!(running.control("pause"), 204);
    running.until(|status| status["stage"] == "paused");
    // Units under way when the pause begins still come.
    std::thread::sleep(Duration::from_secs(2));
    let rests = running.status();
    std::thread::sleep(Duration::from_secs(1));
    let still = running.status();
    assert_eq!(rests["paths"], still["paths"]);
    // All that is merged is on disk, at once.
    assert_eq!(running.control("save"), 204);
    std::thread::sleep(Duration::from_secs(1));
    let cube = Cube::open(&folder.path().join("cube.zarr")).expect("a cube");
    let paths: u64 = (0..cube.grid().count())
        .map(|tile| cube.grid().rect(tile).pixels() * u64::from(cube.samples(tile).expect("samples")))
        .sum();
    assert_eq!(Some(paths), still["paths"].as_u64());
    // A spectrum is the one on disk.
    let csv = get(running.address, "/api/spectrum?x=20&y=30&format=csv").body;
    assert_eq!(csv, command(folder.path(), &["spectrum", "cube.zarr", "20", "30"]).output().expect("runs").stdout);

    assert_eq!(running.control("resume"), 204);
    running.until(|status| status["paths"].as_u64() > still["paths"].as_u64());
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
    // What is left of `--time`, and what has been spent: together always the same, but for the moment between two looks at
    // the clock.
    let clocks = |status: &serde_json::Value| {
        ["rendering_s", "remaining_s"].map(|name| status[name].as_f64().expect("a number"))
    };
    running.until(|status| status["samples"].as_u64() >= Some(1));
    assert_eq!(running.control("pause"), 204);
    running.until(|status| status["stage"] == "paused");
    std::thread::sleep(Duration::from_secs(2));
    let (before, began) = (clocks(&running.status()), Instant::now());
    std::thread::sleep(Duration::from_secs(3));
    assert_eq!(running.control("resume"), 204);
    let goes_on =
        |status: &serde_json::Value| status["stage"] == "rendering" && status["rendering_s"].as_f64() > Some(before[0]);
    let after = clocks(&running.until(goes_on));
    assert!((after[0] - before[0] + after[1] - before[1]).abs() < 0.1, "{before:?} {after:?}");
    let awake = began.elapsed().as_secs_f64() - 3.0;
    assert!(before[1] - after[1] <= awake + 0.1, "the pause is counted: {before:?} {after:?} {awake}");
    assert_eq!(running.control("pause"), 204);
    running.until(|status| status["stage"] == "paused");
    let began = Instant::now();
    assert_eq!(running.control("stop"), 204);
    assert_eq!(running.ends().0, Some(130));
    assert!(began.elapsed() < Duration::from_secs(30));
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
        assert!(began.elapsed() < crate::client::PATIENCE, "{written:?}");
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
        // From the end of one to the end of the next, whose making takes a moment, too.
        assert!(between > Duration::from_millis(900), "{between:?}");
    }
    assert_eq!(running.status()["exposure_ev"], 1.0);
    assert_eq!(running.control("stop"), 204);
    assert_eq!(running.ends().0, Some(130));
}
