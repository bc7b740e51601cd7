//! Cubes larger than the memory that a render may use.
#![cfg(target_os = "linux")]

use std::fs;

use super::{Place, Running};

/// What the host may hold beside scene, device buffers and units in flight.
const HOST_BYTES: u64 = 200 << 20;

/// Anonymous memory of a process, bytes. On the software driver that includes what it calls device memory.
fn anonymous_bytes(process: u32) -> Option<u64> {
    let status = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("RssAnon:"))?;
    line.trim().strip_suffix(" kB")?.parse::<u64>().ok().map(|kib| kib << 10)
}

/// Renders and verifies a cube of `size` with `channels`; the memory in use never exceeds what the devices and the host
/// may have.
fn bounded(size: &str, channels: u32, spp: &str, devices: u64, mebibytes_a_device: u64, at_least: u64) {
    let place = Place::new();
    let channels = format!("channels.equal.count={channels}");
    let (count, memory) = (devices.to_string(), format!("{mebibytes_a_device}MiB"));
    let arguments = [
        "render",
        "scene.toml",
        "-o",
        "cube.zarr",
        "--quiet",
        "--size",
        size,
        "--set",
        &channels,
        "--spp",
        spp,
        "--devices",
        &count,
        "--memory",
        &memory,
    ];
    let mut child = Running(place.command(&arguments).spawn().expect("started"));
    let mut peak = 0;
    let status = loop {
        if let Some(status) = child.0.try_wait().expect("a child") {
            break status;
        }
        peak = peak.max(anonymous_bytes(child.0.id()).unwrap_or(0));
        std::thread::sleep(std::time::Duration::from_millis(10));
    };
    assert!(status.success(), "{status}");
    let cube = place.cube("cube.zarr");
    assert!(cube.header().store_bytes() > at_least);
    // Units in flight lie in the devices' buffers.
    let allowed = devices * (mebibytes_a_device << 20) + HOST_BYTES;
    println!("{} MiB at most of {} allowed, for a cube of {} MiB", peak >> 20, allowed >> 20, at_least >> 20);
    assert!(peak > 0 && peak <= allowed, "{} MiB, allowed are {}", peak >> 20, allowed >> 20);
    assert!(allowed < at_least, "the cube is larger than all that");
    let verified = place.events(&["info", "cube.zarr", "--verify"]).pop().expect("done");
    assert_eq!(verified["damage"], serde_json::json!([]));
    assert_eq!(
        (&verified["tiles_missing"], &verified["tiles_behind"]),
        (&serde_json::json!([]), &serde_json::json!([]))
    );
}

#[test]
fn a_cube_larger_than_the_memory_in_use() {
    bounded("1024x512", 256, "1", 2, 32, 512 << 20);
}

#[test]
#[ignore = "8 GiB on disk: minutes"]
fn a_cube_of_eight_gibibytes() {
    bounded("2048x2048", 512, "2", 1, 256, 8 << 30);
}
