//! What it takes to multiply the weights of a factored cube by spectra, on one core, without reading and writing: the spectra of products, by 64
//! channels; radiance without these, the difference of two times; and all that `relight` does for a tile, standard errors included. Nanoseconds
//! for a value and for a weight and channel, medians of nine rounds. Cubes are arguments (`cargo bench --bench expand -- CUBE.zarr`); the Cornell box is
//! rendered where there is none. Without `--bench`, as `cargo test` runs it, one round of a small box shows that it still works.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use spectile::cube::{Cube, Processor, Rows};
use spectile::spectral::Channels;
use spectile::spectral::product::Expander;

const CHANNELS: usize = 1000;

fn main() {
    let (options, mut cubes): (Vec<String>, Vec<String>) =
        std::env::args().skip(1).partition(|argument| argument.starts_with('-'));
    let is_measured = options.iter().any(|option| option == "--bench");
    let rounds = if is_measured { 9 } else { 1 };
    let folder = tempfile::tempdir().expect("a folder");
    if cubes.is_empty() {
        cubes = vec![render(folder.path(), is_measured).display().to_string()];
    }
    for path in cubes {
        let cube = Cube::open(Path::new(&path)).expect("a cube");
        let [values, entries, radiance, spectra, all] = measure(&cube, rounds);
        println!(
            "{path}: {:.0} weights a pixel; ns a weight and channel: radiance {:.3}, its spectra {:.3}, with standard errors {:.3}; a value: {:.2}, {:.2}, {:.2}",
            entries * CHANNELS as f64 / values,
            radiance / (entries * CHANNELS as f64),
            spectra / (entries * CHANNELS as f64),
            all / (entries * CHANNELS as f64),
            radiance / values,
            spectra / values,
            all / values,
        );
    }
}

fn render(folder: &Path, is_measured: bool) -> PathBuf {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell/cornell.toml");
    let (cube, [size, spp]) =
        (folder.join("cornell.zarr"), if is_measured { ["256x256", "128"] } else { ["16x16", "128"] });
    let mut command = Command::new(env!("CARGO_BIN_EXE_spectile"));
    command.env("XDG_RUNTIME_DIR", folder).arg("render").arg(scene).arg("-o").arg(&cube);
    let status = command.args(["--factored", "--quiet", "--size", size, "--spp", spp]).status().expect("runs");
    assert!(status.success());
    cube
}

/// Values, weights, and nanoseconds of all tiles.
fn measure(cube: &Cube, rounds: usize) -> [f64; 5] {
    let channels =
        Channels::equal(cube.channels().bounds[0][0], cube.channels().bounds[cube.channels().len() - 1][1], CHANNELS);
    let expander = Expander::new(&cube.basis().expect("a factored cube"), &channels, cube.header().most_factors());
    let size = cube.header().tile;
    let (mut values, mut entries, mut sums) = (0.0, 0.0, [0.0; 3]);
    let (mut radiance, mut errors) = (Vec::new(), Vec::new());
    for tile in 0..cube.grid().count() {
        let Some(weights) = cube.state().weights(tile).expect("readable") else { continue };
        let rect = cube.grid().rect(tile);
        let groups = cube.groups(cube.samples(tile).expect("readable"));
        values += (rect.pixels() as usize * CHANNELS) as f64;
        entries += weights.len() as f64;
        let mut times = [(); 3].map(|()| Vec::new());
        for _ in 0..rounds {
            let mut time = |which: usize, work: &mut dyn FnMut()| {
                let began = Instant::now();
                work();
                times[which].push(1e9 * began.elapsed().as_secs_f64());
            };
            let rows = Rows::Of(&expander, &weights.products);
            let done = "a processor has no errors";
            time(0, &mut || {
                weights.expand_by(&Processor, rows, size, rect, None, [&mut radiance, &mut errors]).expect(done);
            });
            let mut spectra = vec![0.0; weights.products.len() * 64];
            time(1, &mut || {
                for from in (0..CHANNELS).step_by(64) {
                    rows.write(from..(from + 64).min(CHANNELS), 64, &mut spectra);
                }
            });
            time(2, &mut || {
                weights
                    .expand_by(&Processor, rows, size, rect, Some(&groups), [&mut radiance, &mut errors])
                    .expect(done);
            });
            assert!(radiance.iter().any(|value| *value > 0.0) && errors.iter().any(|error| *error > 0.0));
        }
        for (sum, times) in sums.iter_mut().zip(&mut times) {
            times.sort_by(f64::total_cmp);
            *sum += times[times.len() / 2];
        }
    }
    let [radiance, spectra, all] = sums;
    [values, entries, radiance - spectra, spectra, all]
}
