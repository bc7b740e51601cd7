//! What a scene without a feature pays for it: nothing. The kernels that the Cornell box composes, and the sizes of its
//! buffers, are pinned as they were before there was anything but diffuse surfaces and lamps (version 3f5f51e).
//!
//! A change of this file's snapshot is a change of every plain scene: make it knowingly, with
//! `UPDATE_SNAPSHOT=1 cargo test --release --test all cornell_kernels`.

use std::fmt::Write;
use std::path::Path;

use spectile::device::evaluator::EvaluateShape;
use spectile::device::facts;
use spectile::device::part::OnDevice;
use spectile::device::prepared::Prepared;
use spectile::device::windows::Windows;
use spectile::gpu::buffer;
use spectile::gpu::source::Source;
use spectile::render::wave::{Budget, DeviceLimits, WavePlan};
use spectile::scene;

/// A pass's code without comments, which explain and cost nothing.
fn code(source: &Source) -> String {
    let code = source.text.lines().map(|line| line.split("//").next().unwrap_or("").trim_end());
    code.filter(|line| !line.trim().is_empty()).map(|line| format!("{line}\n")).collect()
}

#[test]
fn the_cornell_box_pays_for_nothing_else() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let scene = scene::load(&root.join("scenes/cornell/cornell.toml"), &[]).expect("the scene");
    let prepared = Prepared::new(&scene, 0).expect("a scene that fits");
    let mut found = String::new();
    for software in [true, false] {
        let limits = DeviceLimits { binding: 128 << 20, uniform_alignment: 256, software };
        let windows = Windows::of(&prepared.accel, limits.binding).expect("windows");
        let waves = WavePlan::new(&prepared, [64, 64], limits, Budget::default()).expect("waves");
        let on_device = OnDevice { prepared: &prepared, windows };
        let kernels = on_device.kernels(EvaluateShape::of(&prepared, software));
        let kind = if software { "software device" } else { "GPU" };
        writeln!(
            found,
            "==== {kind}: scene {} bytes, a path {} bytes, waves {} bytes",
            facts::scene_bytes(&on_device, buffer::allocated),
            waves.path_bytes(),
            waves.wave_bytes()
        )
        .unwrap();
        for pass in kernels.all() {
            writeln!(found, "==== {kind}: {}.wgsl\n{}", pass.label, code(pass)).unwrap();
        }
    }
    let file = root.join("tests/data/cornell_kernels.txt");
    if std::env::var_os("UPDATE_SNAPSHOT").is_some() {
        std::fs::write(&file, &found).expect("the snapshot is written");
    }
    let pinned = std::fs::read_to_string(&file).expect("the snapshot");
    for (i, (now, then)) in found.lines().zip(pinned.lines()).enumerate() {
        assert_eq!(now, then, "line {} of {}", i + 1, file.display());
    }
    assert_eq!(found.len(), pinned.len());
}
