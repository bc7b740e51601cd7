//! `--memory`: what it covers, what it changes, and what does not fit.

use super::{Place, arrays};

/// The least that the scene needs on a device, from the refusal of less.
fn least(place: &Place) -> u64 {
    let output = place.run(&["plan", "scene.toml", "--memory", "1kB"]);
    assert_eq!(output.status.code(), Some(2));
    let stderr = super::text(&output.stderr);
    let least = stderr.split("the least is ").nth(1).and_then(|rest| rest.split(' ').next()).expect("a number");
    least.parse().expect("bytes")
}

/// The same bytes in every array, whatever the budget, on one device and on two.
#[test]
fn memory_changes_no_bit() {
    let place = Place::new();
    let least = least(&place).to_string();
    let more = ["--overwrite", "--tile", "8", "--spp", "128"];
    let expected = arrays(&place.render("free.zarr", &more));
    for memory in [&least, "2MiB", "16MB", "4GiB"] {
        for devices in ["1", "2"] {
            let budget = ["--memory", memory, "--devices", devices];
            let cube = place.render("bound.zarr", &[&budget[..], &more].concat());
            assert!(arrays(&cube) == expected, "--memory {memory} --devices {devices}");
        }
    }
}

/// Plan and render agree on what is needed, to the byte, and plan keeps the budget.
#[test]
fn a_plan_keeps_its_budget() {
    let place = Place::new();
    let least = least(&place);
    let planned = |memory: u64| {
        let memory = memory.to_string();
        let events = place.events(&["plan", "scene.toml", "--devices", "2", "--memory", &memory]);
        events.last().expect("done").clone()
    };
    let mut last = 0;
    for memory in [least, least + 100_000, 64 << 20] {
        let done = planned(memory);
        assert_eq!(done["device_budget_bytes"].as_u64(), Some(memory));
        let devices = done["devices"].as_array().expect("devices");
        assert_eq!(devices.len(), 2);
        for device in devices {
            let bytes = |name: &str| device[name].as_u64().expect("bytes");
            assert!(
                bytes("scene_bytes") + bytes("wave_bytes") <= memory && bytes("transfer_bytes") < bytes("wave_bytes")
            );
            assert!(bytes("wave_paths") > last, "{device}");
        }
        assert_eq!(devices[0]["wave_paths"], done["wave_paths"]);
        last = devices[0]["wave_paths"].as_u64().expect("paths");
    }
    let too_little = (least - 1).to_string();
    let output = place.run(&["render", "scene.toml", "-o", "o.zarr", "--devices", "2", "--memory", &too_little]);
    assert_eq!(output.status.code(), Some(2));
    let stderr = super::text(&output.stderr);
    // All devices refuse, which is one error and no warnings.
    assert!(!stderr.contains("warning") && stderr.matches("the least is").count() == 1, "{stderr}");
    assert!(!place.path().join("o.zarr").exists());
}
