//! Everything that can be wrong: the right exit code, one clear sentence, nothing half-written.

use std::fs;
use std::process::Stdio;

use super::{ENDLESS, Place, arrays, events, samples, text, wait_for};
use crate::binary::without_devices;
use crate::report::excuse;

/// A run that must fail with `code`, say exactly one line that has all of `expected`, and leave no new file.
#[track_caller]
fn fails(place: &Place, arguments: &[&str], code: i32, expected: &[&str]) {
    let list = || {
        let names = fs::read_dir(place.path()).expect("list").map(|e| e.expect("an entry").file_name());
        let mut names: Vec<_> = names.collect();
        names.sort();
        names
    };
    let before = list();
    let output = place.run(&[arguments, &["--quiet"]].concat());
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {stderr}");
    assert!(output.stdout.is_empty(), "{}", text(&output.stdout));
    assert!(stderr.starts_with("error: ") && !stderr.contains("panicked"), "{stderr}");
    // One sentence; of a scene, the place in it is shown below.
    let sentence = stderr.lines().next().expect("a line");
    for word in expected {
        assert!(sentence.contains(word), "{word}: {stderr}");
    }
    assert_eq!(list(), before, "{arguments:?}");

    // The same to programs.
    let output = place.run(&[arguments, &["--json"]].concat());
    let last = events(&text(&output.stdout)).pop().expect("an event");
    assert_eq!((&last["event"], last["exit_code"].as_i64()), (&"error".into(), Some(i64::from(code))));
    assert!(sentence.contains(last["message"].as_str().expect("a message").lines().next().expect("a line")));
}

#[test]
fn a_scene_that_is_not_there_or_not_right() {
    let place = Place::new();
    let render = |more: &[&'static str]| [&["render"], more, &["-o", "o.zarr"]].concat();
    fails(&place, &render(&["none.toml"]), 2, &["none.toml"]);
    fails(&place, &render(&["."]), 2, &["."]);
    fs::write(place.path().join("text.toml"), "film = [").expect("written");
    fails(&place, &render(&["text.toml"]), 2, &["text.toml:1"]);
    fails(&place, &render(&["scene.toml", "--set", "film.width=-3"]), 2, &["film.width", "-3", "1 to 131072"]);
    fails(&place, &render(&["scene.toml", "--set", "films.width=3"]), 2, &["films"]);
    fails(
        &place,
        &render(&["scene.toml", "--set", "materials.grey.diffuse.reflectance=1.5"]),
        2,
        &["reflectance", "1.5"],
    );
    fails(&place, &render(&["scene.toml", "--set", "objects.0.mesh=none.obj"]), 2, &["none.obj"]);
    let planned = place.run(&["plan", "none.toml"]);
    assert_eq!((planned.status.code(), planned.stdout.len()), (Some(2), 0));
}

#[test]
fn a_render_that_cannot_fit() {
    let place = Place::new();
    let render = |more: &[&'static str]| [&["render", "scene.toml", "-o", "o.zarr"], more].concat();
    fails(&place, &render(&["--spp", "4294967295"]), 2, &["--spp 4294967295", "4294967232"]);
    fails(
        &place,
        &render(&["--size", "65535x65535", "--set", "channels.equal.count=5000"]),
        2,
        &["o.zarr", "free there"],
    );
    let whole = ["--size", "1024x1024", "--tile", "1024", "--set", "channels.equal.count=600"];
    let expected = ["1000 bytes", "the least is", "for the scene", "for a tile of 24 x 20 pixels", "raise --memory"];
    fails(&place, &render(&["--memory", "1kB"]), 2, &expected);
    fails(&place, &render(&whole), 2, &["1024 x 1024 pixels with 600 channels", "smaller --tile"]);
}

#[test]
fn an_output_that_is_there_is_kept() {
    let place = Place::new();
    let cube = place.render("cube.zarr", &["--spp", "2"]);
    let before = arrays(&cube);
    let render = ["render", "scene.toml", "-o", "cube.zarr", "--spp", "1"];
    fails(&place, &render, 2, &["cube.zarr exists already", "--overwrite"]);
    assert_eq!(arrays(&cube), before);
    // Only a cube is replaced, and only by a render that starts.
    fails(
        &place,
        &["render", "scene.toml", "-o", "scene.toml", "--overwrite"],
        2,
        &["scene.toml", "nothing but Spectile cubes"],
    );
    fs::create_dir(place.path().join("folder")).expect("made");
    fails(
        &place,
        &["render", "scene.toml", "-o", "folder", "--overwrite"],
        2,
        &["folder", "nothing but Spectile cubes"],
    );
    fails(&place, &[&render[..], &["--overwrite", "--set", "film.width=0"]].concat(), 2, &["film.width"]);
    assert_eq!(arrays(&cube), before);
    assert_eq!(samples(&place.render("cube.zarr", &["--spp", "1", "--overwrite"])), 1);
}

#[test]
fn an_output_that_cannot_be_written() {
    let place = Place::new();
    let to = |output: &'static str| ["render", "scene.toml", "-o", output];
    fails(&place, &to("no/folder/o.zarr"), 5, &["no/folder/o.zarr", "there is no folder"]);
    fails(&place, &to("scene.toml/o.zarr"), 5, &["scene.toml/o.zarr"]);
    if cfg!(target_os = "linux") {
        fails(&place, &to("/proc/o.zarr"), 5, &["/proc/o.zarr", "cannot be"]);
    }
    let preview = |file: &'static str| [&to("o.zarr")[..], &["--preview", file]].concat();
    fails(&place, &preview("no/now.png"), 5, &["no/now.png", "there is no folder"]);
    fs::create_dir(place.path().join("folder")).expect("made");
    fails(&place, &preview("folder"), 5, &["folder", "is a folder"]);
}

#[test]
#[cfg(target_os = "linux")]
fn standard_output_that_cannot_be_written() {
    let place = Place::new();
    let full = fs::File::options().write(true).open("/dev/full").expect("/dev/full");
    let mut command = place.command(&["render", "scene.toml", "-o", "cube.zarr", "--json"]);
    let output = command.stdout(Stdio::from(full)).output().expect("runs");
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(5), "{stderr}");
    assert_eq!((stderr.lines().count(), stderr.contains("standard output")), (1, true), "{stderr}");
}

#[test]
fn no_device() {
    let place = Place::new();
    for arguments in [vec!["render", "scene.toml", "-o", "o.zarr"], vec!["devices"]] {
        let output = without_devices(&mut place.command(&arguments)).output().expect("runs");
        let stderr = text(&output.stderr);
        if output.status.success() {
            excuse("this machine has devices that are no Vulkan drivers");
            return;
        }
        assert_eq!(output.status.code(), Some(3), "{stderr}");
        let last = stderr.lines().last().expect("a line");
        assert!(
            last.starts_with("error: no adapter") && last.contains("apt-get install mesa-vulkan-drivers"),
            "{stderr}"
        );
        assert!(!place.path().join("o.zarr").exists());
    }
    // A plan does not need one.
    let output = without_devices(&mut place.command(&["plan", "scene.toml", "--json"])).output().expect("runs");
    let done = events(&text(&output.stdout)).pop().expect("done");
    assert!(done["device"].is_null() && done["predicted_s"].is_null() && done["disk_bytes"].is_u64(), "{done}");
}

/// A small file system of its own, where this user may mount one.
#[cfg(target_os = "linux")]
struct Disk(std::path::PathBuf);

#[cfg(target_os = "linux")]
impl Disk {
    fn mount(place: &Place, options: &str) -> Option<Disk> {
        let path = place.path().join("disk");
        fs::create_dir(&path).expect("made");
        let mut mount = std::process::Command::new("mount");
        let mount = mount.args(["-t", "tmpfs", "-o", options, "spectile-test"]).arg(&path).output();
        if mount.is_ok_and(|output| output.status.success()) {
            return Some(Disk(path));
        }
        excuse("mounting a small disk needs root, and the permission of the container");
        None
    }
}

#[cfg(target_os = "linux")]
impl Drop for Disk {
    fn drop(&mut self) {
        // What is left is left to the temporary folder's end.
        let _ = std::process::Command::new("umount").arg(&self.0).status();
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_disk_that_is_read_only() {
    let place = Place::new();
    let Some(_disk) = Disk::mount(&place, "size=16m,ro") else { return };
    fails(&place, &["render", "scene.toml", "-o", "disk/o.zarr"], 5, &["disk/o.zarr", "Read-only"]);
}

#[test]
#[cfg(target_os = "linux")]
fn a_disk_that_is_too_small() {
    let place = Place::new();
    let Some(_disk) = Disk::mount(&place, "size=64k") else { return };
    fails(&place, &["render", "scene.toml", "-o", "disk/o.zarr"], 2, &["disk/o.zarr", "free there"]);
}

#[test]
#[cfg(target_os = "linux")]
fn a_disk_that_fills_up() {
    let place = Place::new();
    let Some(disk) = Disk::mount(&place, "size=16m") else { return };
    let arguments =
        [&["render", "scene.toml", "-o", "disk/o.zarr", "--tile", "8", "--preview", "disk/p.png"], ENDLESS].concat();
    let child = place.command(&arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("starts");
    let mut child = super::Running(child);
    let cube = || spectile::cube::Cube::open(&disk.0.join("o.zarr")).ok();
    wait_for("samples", || cube().filter(|cube| cube.progress().expect("progress").samples[0] >= 64));
    // As long as it takes: the render frees and takes blocks all the while.
    let filler = std::cell::RefCell::new(fs::File::create(disk.0.join("filler")).expect("made"));
    wait_for("the disk to fill", || {
        while std::io::Write::write(&mut *filler.borrow_mut(), &[1; 4096]).is_ok_and(|n| n > 0) {}
        child.0.try_wait().expect("a child")
    });
    let (code, stderr) = child.ends();
    assert_eq!(code, Some(5), "{stderr}");
    let errors: Vec<&str> = stderr.lines().filter(|line| line.starts_with("error: ")).collect();
    assert!(errors.len() == 1 && errors[0].contains("disk/") && errors[0].contains("No space left"), "{stderr}");
    // What was merged is there and whole.
    fs::remove_file(disk.0.join("filler")).expect("removed");
    let kept = cube().expect("a cube");
    let most = kept.progress().expect("progress").samples[1];
    assert!(kept.error_estimate().is_ok());
    let straight = place.render("straight.zarr", &["--tile", "8", "--spp", &most.to_string()]);
    for tile in (0..9).filter(|&tile| kept.samples(tile).expect("samples") == most) {
        let bytes = |cube: &spectile::cube::Cube| {
            let chunk = cube.chunk(tile).expect("read").expect("there");
            chunk.values().iter().map(|v| v.to_bits()).collect::<Vec<_>>()
        };
        assert_eq!(bytes(&kept), bytes(&straight), "tile {tile}");
    }
}
