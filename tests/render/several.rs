//! Several devices share one picture. On a machine with one adapter `--devices N` opens N independent ones.

use super::{ENDLESS, Place, arrays, samples};

/// The same bytes in every array, whatever the number of devices, also where units are few and epochs many.
#[test]
fn the_number_of_devices_changes_no_bit() {
    let place = Place::new();
    for more in [
        &["--tile", "8", "--spp", "128"][..],
        &["--spp", "64"],
        &["--tile", "16", "--set", "integrator.epoch=4", "--spp", "40"],
    ] {
        let one = arrays(&place.render("1.zarr", &[&["--overwrite", "--devices", "1"], more].concat()));
        for devices in ["2", "3", "0,", "0,0"] {
            let name = format!("{}.zarr", devices.replace(',', "_"));
            let cube = place.render(&name, &[&["--overwrite", "--devices", devices], more].concat());
            assert!(arrays(&cube) == one, "--devices {devices} {more:?}");
        }
    }
}

/// Each device is named, works, and says for how long.
#[test]
fn every_device_says_what_it_did() {
    let place = Place::new();
    let mut pulled = Vec::new();
    // On a busy machine one may be through before the other has begun.
    for (samples, epochs) in [("512", 14), ("2048", 38), ("8192", 134)] {
        let stop = ["--devices", "2", "--tile", "8", "--spp", samples];
        let events = place.events(&[&["render", "scene.toml", "-o", "cube.zarr", "--overwrite"][..], &stop].concat());
        assert_eq!(events.iter().filter(|e| e["event"] == "device").count(), 2);
        let done = events.last().expect("done");
        let devices = done["devices"].as_array().expect("a list");
        let units: Vec<u64> = devices.iter().map(|d| d["units"].as_u64().expect("units")).collect();
        // In 9 tiles.
        assert_eq!(units.iter().sum::<u64>(), 9 * epochs, "{units:?}");
        let idle = devices.iter().map(|d| d["idle_s"].as_f64().expect("seconds"));
        let busy = devices.iter().map(|d| d["busy_s"].as_f64().expect("seconds"));
        assert!(idle.chain(busy.clone()).all(|seconds| seconds >= 0.0), "{devices:?}");
        assert!(busy.zip(&units).all(|(seconds, units)| seconds > 0.0 || *units == 0), "{devices:?}");
        pulled.push(units);
        if pulled.iter().flatten().rev().take(2).all(|&units| units > 0) {
            return;
        }
    }
    panic!("one device did all: {pulled:?}");
}

/// A time limit is decided at the end of every epoch, for all devices alike: no tile is ahead of another.
#[test]
fn a_time_limit_ends_all_devices_at_the_same_epoch() {
    let place = Place::new();
    place.until_a_full_epoch(&["--devices", "2", "--tile", "8"]);
    assert!(samples(&place.cube("cube.zarr")) >= 64);
}

#[test]
fn devices_that_are_not_there_are_refused() {
    let place = Place::new();
    let output = place.run(&["render", "scene.toml", "-o", "cube.zarr", "--devices", "63,"]);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{stderr}");
    assert!(stderr.contains("device 63: there is no such adapter"), "{stderr}");
    assert!(!place.path().join("cube.zarr").exists(), "nothing is written");
    assert_eq!(
        place.run(&[&["render", "scene.toml", "-o", "x.zarr", "--devices", "0"], ENDLESS].concat()).status.code(),
        Some(2)
    );
}
