//! A finished cube of 100 GiB: sparse files, of which only what is looked at is read.

use std::fs::{self, File};
use std::io::Write;
use std::path::Path;
use std::process::Stdio;

use spectile::cube::{Cube, Existing, Writer};
use tempfile::tempdir;

use super::client::{Running, get};
use crate::binary::command;
use crate::cubes::{create, header};

const CHANNELS: usize = 2000;
const TILE: u64 = 64;

/// Bytes that a process has asked for, and of files that it has mapped and touched.
fn read_bytes(process: u32) -> (u64, u64) {
    let number = |file: &str, name: &str| {
        let text = fs::read_to_string(format!("/proc/{process}/{file}")).expect("Linux");
        let line = text.lines().find_map(|line| line.strip_prefix(name)).expect("a line");
        line.trim().trim_end_matches(" kB").parse::<u64>().expect("a number")
    };
    (number("io", "rchar:"), number("status", "RssFile:") << 10)
}

#[cfg(target_os = "linux")]
#[test]
fn a_hundred_gibibytes_open_and_a_spectrum_is_one_read() {
    let folder = tempdir().expect("folder");
    // 53 x 64 tiles of 32 MiB.
    let size = [53 * TILE as u32, 64 * TILE as u32];
    let header = header(size, [TILE as u32; 2], CHANNELS);
    let path = folder.path().join("huge.zarr");
    // One tile: space is asked for no more.
    let writer = Writer::open(&path, &header, Existing::Refuse, 0..1, &mut |what| panic!("{what}")).expect("a cube");
    drop(writer);
    let cube = Cube::open(&path).expect("a cube");
    assert!(cube.header().store_bytes() > 100 << 30, "{}", cube.header().store_bytes());
    let sparse = |array: &str, at: &str, bytes: u64| {
        let path = cube.path().join(array).join(at);
        fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        File::create(path).and_then(|file| file.set_len(bytes)).expect("made");
    };
    let pixels = TILE * TILE;
    for (row, column) in (0..64).flat_map(|row| (0..53).map(move |column| (row, column))) {
        sparse("radiance", &format!("c/0/{row}/{column}"), pixels * CHANNELS as u64 * 4);
        sparse("overview", &format!("c/0/{row}/{column}"), pixels / 64 * CHANNELS as u64 * 4);
        sparse("preview", &format!("c/{row}/{column}/0"), pixels * 12);
        let samples = cube.path().join(format!("samples/c/{row}/{column}"));
        fs::create_dir_all(samples.parent().expect("a folder")).expect("made");
        File::create(samples).and_then(|mut file| file.write_all(&64u32.to_le_bytes())).expect("written");
    }
    let running = Running::start(folder.path(), &["view", "huge.zarr", "--listen", "127.0.0.1:0", "--json"]);
    let status = running.until(|status| status["samples"] == 64);
    assert_eq!(status["tiles_started"], 53 * 64);
    let process = running.child.id();
    let cost = |target: &str| {
        let before = read_bytes(process);
        let answer = get(running.address, target);
        let after = read_bytes(process);
        (answer, after.0 - before.0, after.1.saturating_sub(before.1))
    };
    // Requests and metadata; and pages of the program itself, where a page of every tile would be 13 MiB.
    let (slack, pages) = (256 << 10, 8 << 20);
    // One channel of everything: 64 blocks of every tile, and no page of radiance.
    let (answer, read, mapped) = cost("/api/image?show=channel&k=1000&scale=16&format=f32");
    assert_eq!(answer.floats().len(), (53 * 4) * (64 * 4));
    assert!(read <= 53 * 64 * 256 + slack && mapped <= pages, "{read} {mapped}");
    // Zoomed out, nothing but `overview` is needed for any picture, nor read: of it the channels that are shown, which for
    // true colour are those of up to 830 nm.
    let seen = (0..CHANNELS).filter(|&k| cube.channels().bounds[k][0] < 830.0).count() as u64;
    let away = |array: &str| cube.path().join(format!("{array} away"));
    for array in ["radiance", "preview"] {
        fs::rename(cube.path().join(array), away(array)).expect("moved");
    }
    for (target, planes, channels) in [
        ("show=colour&scale=16", 3, seen),
        ("show=colour&scale=64", 3, seen),
        ("show=false&r=0&g=1000&b=1999&scale=16", 3, 3),
        ("show=channel&k=7&scale=16", 1, 1),
    ] {
        let (answer, read, mapped) = cost(&format!("/api/image?{target}&format=f32"));
        let values = answer.floats();
        let scale: usize = target.rsplit('=').next().expect("a scale").parse().expect("a number");
        assert_eq!(values.len(), (53 * 64 / scale) * (64 * 64 / scale) * planes);
        assert!(values.iter().all(|&v| v == 0.0), "{target}");
        let overview = 53 * 64 * (pixels / 64) * channels * 4;
        assert!(read <= overview + slack && mapped <= pages, "{target}: {read} {overview} {mapped}");
        println!("{target}: {} MiB read", read >> 20);
    }
    for array in ["radiance", "preview"] {
        fs::rename(away(array), cube.path().join(array)).expect("moved");
    }
    // A spectrum, in one contiguous read of the file.
    let (answer, read, mapped) = cost("/api/spectrum?x=3000&y=4000");
    assert_eq!(answer.json()["radiance"].as_array().expect("a list").len(), CHANNELS);
    assert!(read <= CHANNELS as u64 * 4 + slack && mapped <= pages, "{read} {mapped}");
    // Close up, the tiles in sight and no others.
    let (answer, read, mapped) = cost("/api/image?show=colour&x0=1000&y0=1000&x1=1100&y1=1050&scale=1&format=f32");
    assert_eq!(answer.floats().len(), 100 * 50 * 3);
    assert!(read <= 3 * 2 * pixels * 12 + slack && mapped <= pages, "{read} {mapped}");
    // More radiance than a look may take is refused with a way out, not begun.
    let all = super::client::ask(running.address, "GET", "/api/image?show=channel&k=0&scale=4&x1=2048&y1=2048", &[]);
    assert!(all.status == 400 && all.text().contains("scale"), "{all:?}");
}

/// What `view` refuses, in one sentence and with the right exit code.
#[test]
fn what_cannot_be_viewed_is_refused() {
    let folder = tempdir().expect("folder");
    let cube = create(folder.path(), "cube.zarr", header([8, 8], [8, 8], 3));
    let refused = |arguments: &[&str], code: i32, words: &str| {
        let output = command(folder.path(), arguments).stdout(Stdio::null()).output().expect("runs");
        let said = String::from_utf8(output.stderr).expect("UTF-8");
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
        assert!(said.contains(words), "{arguments:?}: {said}");
    };
    refused(&["view", "nothing.zarr"], 5, "no such cube");
    refused(&["view", "cube.zarr", "--listen", "8090"], 2, "127.0.0.1:8090");
    refused(&["view", "cube.zarr", "--listen", "203.0.113.1:0"], 2, "this machine has no such address");
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("binds");
    let address = taken.local_addr().expect("an address").to_string();
    refused(&["view", "cube.zarr", "--listen", &address], 2, "another process listens there already");
    let scene = crate::binary::cornell();
    let render = |more: &[&str], words: &str| {
        let scene = scene.to_str().expect("UTF-8");
        refused(&[&["render", scene, "-o", "new.zarr"], more].concat(), 2, words);
        assert!(!Path::new(&folder.path().join("new.zarr")).exists());
    };
    render(&["--listen", &address], "another process listens there already");
    render(&["--tev", "nowhere"], "HOST:PORT");
    render(&["--exposure", "1"], "--preview or --listen");
    drop(cube);
}
