//! Cubes as Python users see them, through the real xarray and zarr.
//!
//! SPECTILE_PYTHON names a Python that has both (`pip install xarray zarr`). Without it these tests say so and pass,
//! except where CI=true.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use serde_json::json;
use spectile::cube::{Cube, Header};
use spectile::spectral::Channels;
use tempfile::tempdir;

use crate::cubes::{create, header, pattern, unit};
use crate::outside::python;

/// read_cube.py with these arguments, where there is a Python to run it.
fn read_cube(arguments: &[&Path]) -> Option<Command> {
    let mut command = python("read_cube.py")?;
    command.args(arguments);
    Some(command)
}

fn succeed(mut command: Command) -> String {
    let output = command.output().expect("Python runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Writes what the cube must hold beside it and has Python check every array.
fn check(folder: &Path, cube: &Cube, value: impl Fn(u32, u32, usize) -> f32, rendered: &[u32]) {
    let (header, channels) = (cube.header(), cube.channels().len());
    let [width, height] = header.size;
    let (mut radiance, mut preview) = (Vec::new(), Vec::new());
    for y in 0..height {
        for x in 0..width {
            let there = rendered.contains(&cube.grid().tile_at(x, y));
            let spectrum: Vec<f32> = (0..channels).map(|k| if there { value(x, y, k) } else { f32::NAN }).collect();
            preview.extend(if there { cube.projection().rgb(&spectrum) } else { [f32::NAN; 3] });
            radiance.extend(spectrum);
        }
    }
    let bytes = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    fs::write(folder.join("radiance.bin"), bytes(&radiance)).expect("written");
    fs::write(folder.join("preview.bin"), bytes(&preview)).expect("written");
    let [columns, rows] = cube.grid().tiles();
    let samples = |row, column| u32::from(rendered.contains(&(row * columns + column)));
    let expected = json!({
        "size": header.size,
        "origin": header.origin,
        "tile": header.tile,
        "bounds": header.channels.bounds,
        "samples": (0..rows).map(|r| (0..columns).map(|c| samples(r, c)).collect()).collect::<Vec<Vec<u32>>>(),
        "radiance": "radiance.bin",
        "preview": "preview.bin",
    });
    let path = folder.join("expected.json");
    fs::write(&path, expected.to_string()).expect("written");
    if let Some(command) = read_cube(&[Path::new("still"), cube.path(), &path]) {
        succeed(command);
    }
}

#[test]
fn xarray_and_zarr_read_every_bit() {
    for (size, tile, channels) in [([20, 13], [8, 8], 7), ([5, 3], [64, 64], 1), ([33, 17], [16, 16], 200)] {
        let folder = tempdir().expect("folder");
        let cube = create(folder.path(), "cube.zarr", header(size, tile, channels));
        let all: Vec<u32> = (0..cube.grid().count()).collect();
        for &tile in &all {
            cube.merge_unit(tile, 1, &unit(&cube, tile, pattern)).expect("merged");
        }
        check(folder.path(), &cube, pattern, &all);
    }
}

#[test]
fn an_incomplete_cube_of_odd_channels_opens() {
    let folder = tempdir().expect("folder");
    let channels = Channels::from_bounds(vec![[8e3, 12e3], [450.0, 470.5], [460.0, 500.0]], Some([0, 1, 2]));
    let cube =
        create(folder.path(), "cube.zarr", Header { channels, origin: [100, 50], ..header([20, 13], [8, 8], 3) });
    check(folder.path(), &cube, pattern, &[]);
    for tile in [1, 5] {
        cube.merge_unit(tile, 1, &unit(&cube, tile, pattern)).expect("merged");
    }
    check(folder.path(), &cube, pattern, &[1, 5]);
}

#[test]
fn a_cube_opens_while_it_grows() {
    let folder = tempdir().expect("folder");
    let cube = create(folder.path(), "cube.zarr", Header { epoch: 1, ..header([40, 40], [16, 16], 20) });
    let Some(command) = read_cube(&[Path::new("growing"), cube.path(), Path::new("20")]) else { return };
    std::thread::scope(|scope| {
        let reader = scope.spawn(|| succeed(command));
        let mut value = 0.0;
        while !reader.is_finished() {
            for tile in 0..cube.grid().count() {
                value += 1.0;
                cube.merge_unit(tile, 1, &unit(&cube, tile, |_, _, _| value)).expect("merged");
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        let seen: u32 = reader.join().expect("no panic").trim().parse().expect("a count");
        assert!(seen > 1, "the cube did not grow while it was read");
    });
}
