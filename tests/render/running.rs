//! A render while it runs, and when it is told to end.

use std::io::{BufRead, BufReader};

use super::{Place, Running, arrays, events, png, samples, wait_for};
use crate::report::excuse;

/// Until every tile of `cube.zarr` has `least` samples; returns them.
fn until_samples(place: &Place, least: u32) -> u32 {
    wait_for("samples", || {
        let progress = spectile::cube::Cube::open(&place.path().join("cube.zarr")).ok()?.progress().expect("progress");
        (progress.tiles_started == progress.tiles && progress.samples[0] >= least).then_some(progress.samples[0])
    })
}

fn first_progress(child: &mut Running) -> serde_json::Value {
    let mut lines = BufReader::new(child.0.stdout.take().expect("piped")).lines();
    lines.find_map(|line| events(&line.expect("UTF-8")).pop().filter(|e| e["event"] == "progress")).expect("progress")
}

#[test]
fn a_picture_comes_with_the_first_units() {
    let place = Place::new();
    let mut child = place.start("cube.zarr", &["--json", "--preview", "now.png", "--tile", "8"]);
    let progress = first_progress(&mut child);
    // After the first group of units of one sample the file is there, and a whole PNG.
    assert_eq!((progress["samples"].as_u64(), progress["samples_next"].as_u64()), (Some(0), Some(1)));
    assert_eq!(png(&place.path().join("now.png")).0, [24, 20]);
    assert!(child.0.try_wait().expect("a child").is_none(), "still rendering");
}

#[test]
fn a_reader_that_goes_away_does_not_end_a_render() {
    let place = Place::new();
    let mut child = place.start("cube.zarr", &["--json"]);
    first_progress(&mut child);
    // The pipe is closed by now.
    until_samples(&place, 256);
    assert!(child.0.try_wait().expect("a child").is_none());
}

#[test]
fn info_and_export_work_while_it_grows() {
    let place = Place::new();
    let _child = place.start("cube.zarr", &["--quiet", "--tile", "8"]);
    until_samples(&place, 1);
    let mut seen = Vec::new();
    for i in 0..3 {
        let done = place.events(&["info", "cube.zarr"]).pop().expect("done");
        assert_eq!((&done["event"], done["tiles_started"].as_u64()), (&"done".into(), Some(9)));
        seen.push(done["samples"]["most"].as_u64().expect("samples"));
        place.success(&["spectrum", "cube.zarr", "3", "4"]);
        let name = format!("{i}.png");
        place.success(&["export", "cube.zarr", "-o", &name]);
        assert_eq!(png(&place.path().join(&name)).0, [24, 20]);
        // It grows by commits, one a second.
        until_samples(&place, seen[i] as u32 + 1);
    }
    assert!(seen.is_sorted() && seen[0] < seen[2], "{seen:?}");
}

#[test]
fn without_a_terminal_there_are_plain_lines() {
    let place = Place::new();
    let (stdout, stderr) = place.success(&["render", "scene.toml", "-o", "cube.zarr"]);
    assert_eq!(stdout.lines().count(), 1);
    assert!(!stderr.contains(['\r', '\u{1b}']), "{stderr:?}");
    let lines: Vec<&str> = stderr.lines().collect();
    assert!(
        lines[0].contains("scene.toml: 24 x 20 pixels x 5 channels, ") && lines[0].ends_with(" KiB on disk"),
        "{stderr}"
    );
    assert!(lines[1].starts_with("device: "), "{stderr}");
    for word in ["samples/pixel", "paths/s", "rays/s", "left"] {
        assert!(lines[2].contains(word), "{word}: {stderr}");
    }
    // The error is estimated from two full epochs on.
    let mut child = place.start("2.zarr", &[]);
    let mut lines = BufReader::new(child.0.stderr.take().expect("piped")).lines();
    let line = lines.find_map(|line| line.ok().filter(|line| line.contains("  error "))).expect("an estimate");
    assert!(line.contains(" % (rough)") || line.contains("  error 0."), "{line}");
}

#[test]
#[cfg(target_os = "linux")]
fn on_a_terminal_there_is_a_bar() {
    let place = Place::new();
    let line = format!("{} render scene.toml -o cube.zarr --spp 256", env!("CARGO_BIN_EXE_spectile"));
    let mut script = std::process::Command::new("script");
    script.current_dir(place.path()).env("XDG_RUNTIME_DIR", place.path()).args(["-qec", &line, "/dev/null"]);
    let Ok(output) = script.output() else {
        excuse("there is no `script` (util-linux), which makes a terminal");
        return;
    };
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}");
    for expected in ["\u{1b}[", "\u{2588}", "/1 units", "samples/pixel", "rays/s"] {
        assert!(said.contains(expected), "{expected:?}: {said:?}");
    }
    // The bar goes away and the result stays.
    let last = said.trim_end().rsplit(['\n', '\r']).next().expect("a line");
    assert!(last.contains("cube.zarr: ") && !last.contains("units"), "{last:?}");
}

#[test]
fn quiet_is_quiet() {
    let place = Place::new();
    let (stdout, stderr) = place.success(&["render", "scene.toml", "-o", "cube.zarr", "--quiet", "--spp", "5"]);
    assert_eq!((stdout.as_str(), stderr.as_str()), ("", ""));
    let json = place.success(&["render", "scene.toml", "-o", "2.zarr", "--quiet", "--json"]);
    assert!(events(&json.0).last().is_some_and(|e| e["event"] == "done") && json.1.is_empty());
}

#[test]
fn profile_says_where_the_time_went() {
    let place = Place::new();
    let (stdout, _) = place.success(&["render", "scene.toml", "-o", "cube.zarr", "--profile", "--spp", "256"]);
    for stage in ["set-up", "generate", "evaluate", "merge", "idle"] {
        assert!(stdout.lines().any(|line| line.starts_with(stage)), "{stage}: {stdout}");
    }
    let done =
        place.events(&["render", "scene.toml", "-o", "2.zarr", "--profile", "--spp", "256"]).pop().expect("done");
    let profile = &done["profile"];
    let seconds = |key: &str| profile[key].as_f64();
    assert!(seconds("setup_s").is_some_and(|s| s > 0.0) && seconds("merge_s").is_some_and(|s| s > 0.0));
    let device = place.events(&["devices"]).remove(0);
    for key in ["generate_s", "evaluate_s"] {
        assert_eq!(seconds(key).is_some_and(|s| s > 0.0), device["timestamps"] == true, "{key}");
    }
    // Measuring changes no bit.
    assert_eq!(arrays(&place.cube("2.zarr")), arrays(&place.render("3.zarr", &["--spp", "256"])));
}

#[cfg(unix)]
mod signals {
    use super::*;

    /// Ctrl-C and SIGTERM keep what was merged, which is what a shorter render would have made.
    #[test]
    fn the_first_ends_in_order() {
        for (signal, code) in [("INT", 130), ("TERM", 143)] {
            let place = Place::new();
            let mut child = place.start("cube.zarr", &["--tile", "16", "--preview", "now.png"]);
            until_samples(&place, 64);
            child.signal(signal);
            let (exit, stderr) = child.ends();
            assert_eq!(exit, Some(code), "{stderr}");
            let last = stderr.lines().last().expect("a hint");
            assert!(last.starts_with("interrupted: cube.zarr keeps every unit merged so far, "), "{stderr}");
            assert!(!stderr.contains("error:") && !stderr.contains("panic"), "{stderr}");

            let cube = place.cube("cube.zarr");
            let [least, most] = cube.progress().expect("progress").samples;
            assert!(
                least >= 64 && most - least <= 64 && last.contains(&least.to_string()),
                "{least} to {most}: {last}"
            );
            assert_eq!(png(&place.path().join("now.png")).0, [24, 20]);
            assert_eq!(std::fs::read_dir(cube.path().join(".spectile/aside")).expect("list").count(), 0);
            let straight = place.render("straight.zarr", &["--tile", "16", "--spp", &most.to_string()]);
            assert_eq!(samples(&straight), most);
            for tile in (0..cube.grid().count()).filter(|&tile| cube.samples(tile).expect("samples") == most) {
                let values =
                    |cube: &spectile::cube::Cube| cube.chunk(tile).expect("read").expect("there").values().to_vec();
                let bits = |values: Vec<f32>| values.into_iter().map(f32::to_bits).collect::<Vec<_>>();
                assert_eq!(bits(values(&cube)), bits(values(&straight)), "tile {tile}");
            }
        }
    }

    /// Processor time that a process has used, ticks, and whether it has ended.
    #[cfg(target_os = "linux")]
    fn work(process: u32) -> (u64, bool) {
        let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).expect("a child that is not waited for");
        let fields: Vec<&str> = stat.rsplit(") ").next().expect("after the name").split(' ').collect();
        let number = |i: usize| fields[i].parse::<u64>().expect("a number");
        (number(11) + number(12), fields[0] == "Z")
    }

    /// Nobody waits for the end of a unit: told at the end of an epoch, the render does less than half of what that took,
    /// while each is twice as long as the one before.
    #[cfg(target_os = "linux")]
    #[test]
    fn an_interrupt_does_not_wait_for_a_unit() {
        let place = Place::new();
        let large = ["--size", "128x128", "--tile", "128", "--memory", "16MiB", "--json"];
        let more = ["--set", "integrator.epoch=1024", "--set", "channels.equal.count=64"];
        let mut child = place.start("cube.zarr", &[&large[..], &more].concat());
        let process = child.0.id();
        let mut ends = BufReader::new(child.0.stdout.take().expect("piped")).lines().filter_map(|line| {
            let event = events(&line.expect("UTF-8")).remove(0);
            (event["event"] == "epoch").then(|| (event["time_s"].as_f64().expect("seconds"), work(process).0))
        });
        // Long enough that the signal comes early in the next one.
        let mut last = ends.next().expect("an epoch");
        let (told, epoch) = loop {
            let end = ends.next().expect("an epoch");
            if end.0 - last.0 >= 1.0 {
                break (end.1, end.1 - last.1);
            }
            last = end;
        };
        child.signal("INT");
        let after = wait_for("the end", || Some(work(process)).filter(|work| work.1)).0 - told;
        assert_eq!(child.ends().0, Some(130));
        assert!(2 * after < epoch, "{after} ticks after the signal, {epoch} for the epoch before");
    }

    /// The second signal comes while the first is being obeyed, which takes two waves.
    #[test]
    fn the_second_ends_at_once() {
        let place = Place::new();
        let more = ["--size", "32x32", "--set", "channels.equal.count=5000", "--set", "integrator.max_bounces=30"];
        let mut child = place.start("cube.zarr", &more);
        until_samples(&place, 32);
        child.signals(&["INT", "TERM"]);
        let (exit, stderr) = child.ends();
        // Which of two signals at one moment is the second is not for us to say.
        assert!([Some(130), Some(143)].contains(&exit), "{exit:?} {stderr}");
        assert!(!stderr.contains("interrupted"), "an orderly end: {stderr}");
        assert!(samples(&place.cube("cube.zarr")) >= 32);
        place.success(&["info", "cube.zarr"]);
    }

    #[test]
    fn before_the_first_unit_nothing_is_left() {
        let place = Place::new();
        let mut child = place.start("cube.zarr", &["--set", "channels.equal.count=2000", "--json"]);
        let mut lines = BufReader::new(child.0.stdout.take().expect("piped")).lines();
        lines.next().expect("a line").expect("UTF-8");
        child.signal("INT");
        let said = events(&lines.map(|line| line.expect("UTF-8") + "\n").collect::<String>());
        let (exit, stderr) = child.ends();
        let error = said.last().expect("an error");
        assert_eq!((exit, &error["event"], error["exit_code"].as_i64()), (Some(130), &"error".into(), Some(130)));
        // It may have been quick: then the hint says what is kept.
        if !said.iter().any(|e| e["event"] == "progress") {
            assert_eq!(stderr, "interrupted before anything was rendered\n");
        }
    }
}

/// Of a full-HD picture with 400 channels there is something to see after the first wave: long before the first sample of every
/// pixel.
#[test]
fn the_first_preview_comes_soon() {
    let place = Place::new();
    let large = ["--size", "1920x1080", "--set", "channels.equal.count=400", "--set", "environment.radiance=1.0"];
    let planned = place.events(&[&["plan", "scene.toml"], &large[..]].concat()).pop().expect("done");
    let mut child = place.start("cube.zarr", &[&large[..], &["--preview", "now.png", "--json"]].concat());
    let first = first_progress(&mut child);
    let (picture, _) = (png(&place.path().join("now.png")), child.0.kill().expect("killed"));
    assert_eq!(picture.0, [1920, 1080]);
    assert!(picture.1.iter().any(|&v| v > 0), "the tiles that are there are lit");
    let number = |event: &serde_json::Value, key: &str| event[key].as_u64().expect("a number");
    let (paths, wave) = (number(&first, "paths"), number(&planned, "wave_paths"));
    assert!(0 < paths && paths <= wave && wave < 1920 * 1080, "{paths} paths, {wave} in a wave");
}
