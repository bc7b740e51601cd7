//! Renders that end early, however they do, and go on: always the same bytes. And several processes on one cube.

use std::fs;
use std::io::{BufRead, BufReader};
use std::process::Command;
use std::time::Duration;

use spectile::cube::Cube;

use super::{ENDLESS, Place, Running, arrays, samples, text, wait_for};

const TILES_OF_8: &[&str] = &["--tile", "8"];

fn sound(place: &Place, name: &str) {
    let (stdout, _) = place.success(&["info", name, "--verify"]);
    assert!(stdout.lines().any(|line| line.starts_with("verified") && line.ends_with(" 0 damaged")), "{stdout}");
    let aside = place.cube(name).path().join(".spectile/aside");
    assert_eq!(fs::read_dir(aside).expect("list").count(), 0, "nothing lies aside");
}

/// Fewer samples first and more later, on other devices: as if all had been asked for at once.
#[test]
fn stopping_and_going_on_gives_the_bytes_of_going_on_at_once() {
    let place = Place::new();
    let straight = arrays(&place.render("straight.zarr", &[TILES_OF_8, &["--spp", "256"]].concat()));
    for (i, stops) in [&["1", "64", "128"][..], &["16"], &["4", "32", "192"]].into_iter().enumerate() {
        let name = format!("{i}.zarr");
        for (j, spp) in stops.iter().chain(&["256"]).enumerate() {
            let devices = ["1", "2", "3"][j % 3];
            let resume: &[&str] = if j > 0 { &["--resume"] } else { &[] };
            let cube = place.render(&name, &[TILES_OF_8, resume, &["--spp", spp, "--devices", devices]].concat());
            assert_eq!(samples(&cube), spp.parse::<u32>().expect("a number"));
        }
        assert!(arrays(&place.cube(&name)) == straight, "{stops:?}");
        sound(&place, &name);
    }
    // What is there already is not rendered again, nor taken away.
    let again = &["render", "scene.toml", "-o", "0.zarr", "--tile", "8", "--resume", "--spp", "64"];
    let done = place.events(again).pop().expect("done");
    assert_eq!((done["paths"].as_u64(), done["samples"].as_u64()), (Some(0), Some(256)));
    assert!(arrays(&place.cube("0.zarr")) == straight);
}

#[test]
fn only_the_same_render_is_gone_on_with() {
    let place = Place::new();
    place.render("cube.zarr", &["--spp", "1"]);
    let before = arrays(&place.cube("cube.zarr"));
    let refusal = |more: &[&str], code: i32| {
        let output =
            place.run(&[&["render", "scene.toml", "-o", "cube.zarr", "--spp", "2", "--resume"], more].concat());
        assert_eq!(output.status.code(), Some(code), "{more:?}");
        text(&output.stderr)
    };
    for (more, difference) in [
        (&["--seed", "1"][..], "seed: 0 in the cube, 1 now"),
        (&["--tile", "8"], "tile: 24 x 20 in the cube, 8 x 8 now"),
        (&["--size", "20x20"], "size: 24 x 20 in the cube, 20 x 20 now"),
        (&["--set", "channels.equal.count=6"], "channels: 5 in the cube, 6 now"),
        (&["--set", "channels.equal.to=701"], "channel 0: 400 to 460 nm in the cube, 400 to 460.2 nm now"),
        (&["--set", "integrator.max_bounces=4"], "settings.integrator.max_bounces: 3 in the cube, 4 now"),
        (&["--set", "integrator.epoch=32"], "integrator.epoch: 64 in the cube, 32 now"),
        (&["--set", "materials.grey.diffuse.reflectance=0.6"], "the scene (its spectra, geometry"),
    ] {
        let said = refusal(more, 2);
        assert!(said.contains("cube.zarr: cannot be gone on with") && said.contains(difference), "{more:?}: {said}");
    }
    assert!(refusal(&["--overwrite"], 2).contains("cannot be used with"));
    // A first run with it begins.
    place.success(&["render", "scene.toml", "-o", "first.zarr", "--spp", "2", "--resume", "--quiet"]);
    place.success(&["render", "scene.toml", "-o", "straight.zarr", "--spp", "2", "--quiet"]);
    assert!(arrays(&place.cube("first.zarr")) == arrays(&place.cube("straight.zarr")));
    // What a cube was begun by: where its own record is damaged, as its metadata says.
    let [record, metadata] = [".spectile/cube.json", "zarr.json"].map(|name| place.path().join("cube.zarr").join(name));
    let ours = [&record, &metadata].map(|file| fs::read_to_string(file).expect("read"));
    fs::write(&record, "{}").expect("written");
    let other = ours[1].replace("\"spectile_version\": \"", "\"spectile_version\": \"9");
    fs::write(&metadata, other).expect("written");
    assert!(refusal(&[], 2).contains("version: it was begun by Spectile 9"));
    fs::write(&record, &ours[0]).expect("written");
    fs::write(&metadata, &ours[1]).expect("written");
    assert!(arrays(&place.cube("cube.zarr")) == before, "nothing was changed");
    place.success(&["render", "scene.toml", "-o", "cube.zarr", "--spp", "2", "--resume", "--quiet"]);
}

/// SIGKILL at moments anywhere in a render, its beginning and a resumption, on one device or several; then the end.
fn killed(times: u64) {
    let place = Place::new();
    let mut random = 1u64;
    // On a busy machine it takes more of them to get anywhere.
    let has_full_epochs = || {
        place.path().join("cube.zarr").exists() && place.cube("cube.zarr").progress().expect("progress").samples[0] > 64
    };
    for i in (0..20 * times).take_while(|&i| i < times || !has_full_epochs()) {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let resume: &[&str] = if place.path().join("cube.zarr").exists() { &["--resume"] } else { &[] };
        let devices = ["1", "2"][i as usize % 2];
        let mut child = place.start("cube.zarr", &[TILES_OF_8, resume, &["--devices", devices, "--quiet"]].concat());
        std::thread::sleep(Duration::from_millis(100 + (random >> 33) % 1500));
        child.0.kill().expect("killed");
        child.0.wait().expect("ended");
    }
    let [least, most] = place.cube("cube.zarr").progress().expect("progress").samples;
    assert!(least > 64, "the renders were too short to tell: {least} to {most}");
    let spp = &(most + 64).to_string();
    place.success(&[&["render", "scene.toml", "-o", "cube.zarr", "--resume", "--spp", spp], TILES_OF_8].concat());
    sound(&place, "cube.zarr");
    let straight = place.render("straight.zarr", &[TILES_OF_8, &["--spp", spp]].concat());
    assert_eq!(samples(&straight), most + 64);
    assert!(arrays(&place.cube("cube.zarr")) == arrays(&straight), "killed {times} times");
}

#[test]
fn kills_change_no_bit() {
    killed(20);
}

#[test]
#[ignore = "200 kills: minutes"]
fn two_hundred_kills_change_no_bit() {
    killed(200);
}

/// Three processes on disjoint tiles of one cube, begun at one moment; what they make is what one makes.
#[test]
fn processes_share_a_cube() {
    let place = Place::new();
    let spp = &["--spp", "128"][..];
    let straight = arrays(&place.render("straight.zarr", &[TILES_OF_8, spp].concat()));
    let start = |tiles: &str| {
        let render = ["render", "scene.toml", "-o", "cube.zarr", "--quiet", "--tiles", tiles];
        let mut command = place.command(&[&render, TILES_OF_8, spp].concat());
        command.stderr(std::process::Stdio::piped());
        Running(command.spawn().expect("started"))
    };
    let mut parts = ["0..4", "4..5", "5..9"].map(start);
    for part in &mut parts {
        let (code, stderr) = part.ends();
        assert_eq!((code, stderr.as_str()), (Some(0), ""));
    }
    assert!(arrays(&place.cube("cube.zarr")) == straight);
    sound(&place, "cube.zarr");

    // Tiles of other samples, too: part by part, and in two goes.
    for (tiles, spp) in [("0..3", "64"), ("2..9", "16"), ("0..9", "128")] {
        place
            .success(&[&["render", "scene.toml", "-o", "2.zarr", "--tiles", tiles, "--spp", spp], TILES_OF_8].concat());
        let info = place.events(&["info", "2.zarr"]).pop().expect("done");
        let (missing, behind) = match tiles {
            "0..3" => (serde_json::json!([[3, 9]]), serde_json::json!([])),
            "2..9" => (serde_json::json!([]), serde_json::json!([[3, 9]])),
            _ => (serde_json::json!([]), serde_json::json!([])),
        };
        assert_eq!((&info["tiles_missing"], &info["tiles_behind"]), (&missing, &behind), "{tiles}");
    }
    assert!(arrays(&place.cube("2.zarr")) == straight);
}

#[test]
fn the_second_on_a_tile_is_refused() {
    let place = Place::new();
    let mut first = place.start("cube.zarr", &[TILES_OF_8, &["--tiles", "0..4", "--quiet"]].concat());
    wait_for("the lock", || Cube::open(&place.path().join("cube.zarr")).ok()?.in_use());
    let second = |more: &[&str]| {
        let output =
            place.run(&[&["render", "scene.toml", "-o", "cube.zarr", "--spp", "1"], TILES_OF_8, more].concat());
        (output.status.code(), text(&output.stderr))
    };
    let (code, said) = second(&["--tiles", "3..9"]);
    assert_eq!(code, Some(5), "{said}");
    assert!(said.contains("cube.zarr: tile 3 is in use by another process"), "{said}");
    for more in [&["--resume"][..], &["--overwrite"]] {
        let (code, said) = second(more);
        assert!(code == Some(5) && said.contains("tiles 0..4 are in use by another process"), "{said}");
    }
    let (stdout, _) = place.success(&["info", "cube.zarr"]);
    assert!(stdout.contains("tiles 0..4 by ") && stdout.contains("\nwaiting          5 tiles: 4..9"), "{stdout}");
    // The others are free, and who ends, however it does, holds nothing.
    assert_eq!(second(&["--tiles", "4..9"]).0, Some(0));
    first.0.kill().expect("killed");
    first.0.wait().expect("ended");
    assert_eq!(second(&["--tiles", "0..4"]).0, Some(0));
    for (tiles, words) in [("0..10", "this picture has the tiles 0..9"), ("9..9", "A < B"), ("x", "A < B")] {
        let (code, said) = second(&["--tiles", tiles]);
        assert!(code == Some(2) && said.contains(words), "{tiles}: {said}");
    }
    let (code, said) = second(&["--tiles", "0..4", "--time", "1s"]);
    assert!(code == Some(2) && said.contains("cannot be used with"), "{said}");
}

/// A cube of 100 GiB of which one tile is there takes the space and the time of one tile.
#[test]
fn a_tile_of_a_huge_cube() {
    let place = Place::new();
    let huge = ["--size", "8192x8192", "--set", "channels.equal.count=400", "--tiles", "8200..8201", "--spp", "64"];
    let cube = place.render("huge.zarr", &huge);
    assert!(cube.header().store_bytes() > 100 << 30);
    let used = Command::new("du").args(["-s", "--block-size=1M"]).arg(cube.path()).output().expect("du");
    let mebibytes: u64 = text(&used.stdout).split_whitespace().next().expect("a size").parse().expect("a number");
    assert!((6..16).contains(&mebibytes), "{mebibytes} MiB");
    let info = place.events(&["info", "huge.zarr"]).pop().expect("done");
    assert_eq!(info["tiles_missing"], serde_json::json!([[0, 8200], [8201, 16384]]));
    // The same tile as a picture of its own: pixels and random numbers are those of the full film.
    let rect = cube.grid().rect(8200);
    let crop = format!("film.crop=[{}, {}, {}, {}]", rect.x0, rect.y0, rect.x1, rect.y1);
    let tile = place.render("tile.zarr", &[&huge[..4], &["--set", &crop, "--spp", "64"]].concat());
    let values = |cube: &Cube, tile| cube.chunk(tile).expect("read").expect("there").values().to_vec();
    assert!(values(&cube, 8200).iter().map(|v| v.to_bits()).eq(values(&tile, 0).iter().map(|v| v.to_bits())));
}

#[cfg(unix)]
#[test]
fn sigusr1_commits_and_says_how_far_it_is() {
    let place = Place::new();
    let mut child = place.start("cube.zarr", &[TILES_OF_8, &["--quiet"]].concat());
    wait_for("a commit", || Cube::open(&place.path().join("cube.zarr")).ok()?.samples(0).ok().filter(|&n| n > 0));
    child.signal("USR1");
    let mut line = String::new();
    BufReader::new(child.0.stderr.as_mut().expect("piped")).read_line(&mut line).expect("a line");
    assert!(line.contains("/9 units of ") && line.contains("samples/pixel") && line.contains("paths/s"), "{line}");
    // It is said when it is on disk.
    let (units, rest) = line.split_once("/9 units of ").expect("units");
    let number = |text: &str| text.parse::<u32>().expect("a number");
    let (units, epoch) = (number(units), number(rest.split(' ').next().expect("samples")));
    let cube = place.cube("cube.zarr");
    let there = (0..9).filter(|&tile| cube.samples(tile).expect("samples") >= epoch).count() as u32;
    assert!(there >= units, "{there} on disk: {line}");
    child.signal("TERM");
    assert_eq!(child.ends().0, Some(143));
}

/// No file may grow beyond a size that the journals reach in the middle of the render: what a full disk does, without
/// filling one. The end is orderly, and the render can be gone on with.
#[cfg(unix)]
#[test]
fn a_full_disk_ends_in_order() {
    let place = Place::new();
    let render = "render scene.toml -o cube.zarr --tile 8 --set channels.equal.count=40 --set integrator.epoch=1";
    // 64 x 40 x 4 bytes are a chunk, a record has 768 bytes: one of 10,752 fits, 14 records do.
    let limited = format!(
        "trap '' XFSZ; ulimit -f 21; exec '{}' {render} {} --quiet",
        env!("CARGO_BIN_EXE_spectile"),
        ENDLESS.join(" ")
    );
    let mut command = Command::new("sh");
    command.args(["-c", &limited]).current_dir(place.path()).env("XDG_RUNTIME_DIR", place.path());
    command.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::piped());
    let (code, stderr) = Running(command.spawn().expect("a shell")).ends();
    assert_eq!(code, Some(5), "{stderr}");
    assert!(stderr.contains("journal/") && stderr.contains("File too large"), "{stderr}");
    assert!(stderr.contains("--resume goes on from there") && !stderr.contains("panic"), "{stderr}");

    let most = place.cube("cube.zarr").progress().expect("progress").samples[1];
    assert!(most >= 14, "{most}");
    let spp = &(most + 1).to_string();
    let arguments: Vec<&str> = render.split(' ').chain(["--resume", "--spp", spp]).collect();
    let (_, stderr) = place.success(&arguments);
    assert!(!stderr.contains("warning"), "{stderr}");
    sound(&place, "cube.zarr");
    let more: Vec<&str> = render.split(' ').skip(4).chain(["--spp", spp]).collect();
    assert!(arrays(&place.cube("cube.zarr")) == arrays(&place.render("straight.zarr", &more)));
}

/// A damaged tile is named, and made anew by the next render that goes on.
#[test]
fn damage_is_found_and_mended() {
    let place = Place::new();
    let cube = place.render("cube.zarr", &[TILES_OF_8, &["--spp", "64"]].concat());
    let before = arrays(&cube);
    let chunk = cube.path().join("radiance/c/0/1/2");
    let mut bytes = fs::read(&chunk).expect("read");
    bytes[100] ^= 16;
    fs::write(&chunk, bytes).expect("written");
    let output = place.run(&["info", "cube.zarr", "--verify"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stdout).contains("damage           radiance/c/0/1/2 is not what was written"));
    assert!(text(&output.stderr).contains("cube.zarr: 1 file is damaged"), "{}", text(&output.stderr));
    let mend = ["render", "scene.toml", "-o", "cube.zarr", "--tile", "8", "--spp", "64", "--resume", "--quiet"];
    let (_, stderr) = place.success(&mend);
    assert!(stderr.contains("tile 5 of ") && stderr.contains("rendered again from its first sample"), "{stderr}");
    assert!(arrays(&cube) == before);
    sound(&place, "cube.zarr");
}
