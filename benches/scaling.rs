//! Two devices against one: the Cornell box rendered by the program itself with one driver thread a device, taking turns.
//! Prints paths by the second, their ratio, and how long each device was idle. Without `--bench`, as `cargo test` runs it,
//! one short round shows that it still works.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

fn main() {
    let measure = std::env::args().any(|a| a == "--bench");
    let (size, spp, rounds) = if measure { ("256x256", "128", 5) } else { ("64x64", "4", 1) };
    let mut ratios = Vec::new();
    for round in 0..rounds {
        let [one, two] = ["1", "2"].map(|devices| render(devices, size, spp));
        let rate = |done: &Value| done["paths_per_s"].as_f64().expect("a rate");
        let idle = |done: &Value| -> Vec<String> {
            let devices = done["devices"].as_array().expect("devices");
            devices.iter().map(|d| format!("{:.3}", d["idle_s"].as_f64().expect("seconds"))).collect()
        };
        ratios.push(rate(&two) / rate(&one));
        println!(
            "round {round}: {:.0} paths/s on one, {:.0} on two: x {:.3}; idle {} s and {} s",
            rate(&one),
            rate(&two),
            ratios[round],
            idle(&one).join(", "),
            idle(&two).join(", ")
        );
    }
    ratios.sort_by(f64::total_cmp);
    println!("two devices against one: x {:.3} (median)", ratios[ratios.len() / 2]);
}

/// The `done` event of a render on so many devices.
fn render(devices: &str, size: &str, spp: &str) -> Value {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell/cornell.toml");
    let output = Command::new(env!("CARGO_BIN_EXE_spectile"))
        .args(["render".as_ref(), scene.as_os_str(), "-o".as_ref(), folder.path().join("c.zarr").as_os_str()])
        .args(["--devices", devices, "--size", size, "--spp", spp, "--json", "--quiet"])
        .args(["--set", "channels.equal.count=200", "--tile", "32"])
        .env("LP_NUM_THREADS", "1")
        .output()
        .expect("started");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let stdout = String::from_utf8(output.stdout).expect("UTF-8");
    serde_json::from_str(stdout.lines().last().expect("a line")).expect("JSON")
}
