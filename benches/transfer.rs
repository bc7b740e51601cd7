//! What a cube on disk costs: a tile of 64 x 64 pixels with 512 channels of the Cornell box is rendered in units of 1 to 64
//! samples, each transferred, merged into the cube and committed in the background, against the same samples in one unit
//! that nobody looks at. Process CPU time, all threads; rounds take turns; medians with the range of the middle half.
//! Without `--bench`, as `cargo test` runs it, one short round shows that it still works.

mod clock;

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use clock::cpu_seconds;
use spectile::Result;
use spectile::cube::{Existing, Header, Writer};
use spectile::device::prepared::Prepared;
use spectile::gpu::adapter::Gpu;
use spectile::render::plan;
use spectile::render::wave::Budget;
use spectile::render::worker::{UnitRect, Worker};
use spectile::scene;

const TILE: u32 = 64;
/// Of what is rendered for one measurement.
const LEAST_SAMPLES: u32 = 8;

fn main() -> Result<()> {
    let measure = std::env::args().any(|a| a == "--bench");
    let [channels, most, rounds] = if measure { [512, 64, 9] } else { [32, 16, 1] };
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell/cornell.toml");
    let set = |key: &str, value: &str| (key.to_owned(), value.to_owned());
    let size = TILE.to_string();
    let scene = scene::load(
        &file,
        &[set("film.width", &size), set("film.height", &size), set("channels.equal.count", &channels.to_string())],
    )?;
    let prepared = Arc::new(Prepared::new(&scene, 0)?);
    let header = plan::header(&scene, [TILE; 2], 0, false, &[]).expect("a header");
    let mut worker = Worker::new(Arc::new(Gpu::open()?), Arc::clone(&prepared), [TILE; 2], Budget::default())?;
    let unit: UnitRect = [0, 0, TILE, TILE];
    // Compiles everything.
    worker.submit(&[unit], 0, 1)?;
    worker.collect()?;

    let portions: Vec<u32> = (0..4).map(|i| 1 << (2 * i)).filter(|n| *n <= most).collect();
    let mut seconds = vec![Vec::new(); portions.len()];
    let mut extra = vec![Vec::new(); portions.len()];
    let mut walls = vec![Vec::new(); portions.len()];
    for _ in 0..rounds {
        for (i, &portion) in portions.iter().enumerate() {
            let samples = portion.max(LEAST_SAMPLES);
            let [without, _] = timed(|| {
                worker.submit(&[unit], 0, samples)?;
                worker.collect().map(drop)
            })?;
            let [with, wall] = timed(|| into_cube(&mut worker, &header, unit, samples, portion))?;
            let units = f64::from(samples / portion);
            seconds[i].push(with / units);
            walls[i].push(wall / units);
            extra[i].push(with / without - 1.0);
        }
    }
    println!("samples a unit  CPU s a unit   wall s    above the same without transfers (middle half)");
    for (i, portion) in portions.iter().enumerate() {
        let [low, median, high] = quartiles(&mut extra[i]);
        println!(
            "{portion:14}  {:7.3}  {:8.3}    {:+6.1} % ({:+.1} … {:+.1})",
            quartiles(&mut seconds[i])[1],
            quartiles(&mut walls[i])[1],
            100.0 * median,
            100.0 * low,
            100.0 * high
        );
    }
    Ok(())
}

/// Renders `samples` in units of `portion`, each merged into a cube on disk.
fn into_cube(worker: &mut Worker, header: &Header, unit: UnitRect, samples: u32, portion: u32) -> Result<()> {
    let folder = tempfile::tempdir().expect("a folder");
    let header = Header { epoch: portion, ..header.clone() };
    let path = folder.path().join("cube.zarr");
    let cube = Writer::open(&path, &header, Existing::Refuse, 0..1, &mut |what| panic!("{what}"))?;
    let mut merged = 0;
    let mut merge = |means: &[f32]| -> Result<()> {
        cube.merge_unit(0, merged, portion, means)?;
        merged += portion;
        Ok::<(), spectile::Error>(())
    };
    std::thread::scope(|threads| {
        let committer = threads.spawn(|| cube.commit_regularly());
        let mut render = || {
            for epoch in 0..samples / portion {
                let before = worker.submit(&[unit], epoch, portion)?;
                before.map_or(Ok(()), |c| merge(c.means()))?;
            }
            worker.collect()?.map_or(Ok(()), |c| merge(c.means()))
        };
        let rendered = render();
        // Also after an error: the committer would wait for ever.
        cube.close();
        committer.join().expect("no panic")?;
        rendered?;
        cube.flush()
    })
}

/// CPU seconds and wall seconds of some work.
fn timed(work: impl FnOnce() -> Result<()>) -> Result<[f64; 2]> {
    let (began, cpu_began) = (Instant::now(), cpu_seconds());
    work()?;
    Ok([cpu_seconds() - cpu_began, began.elapsed().as_secs_f64()])
}

fn quartiles(values: &mut [f64]) -> [f64; 3] {
    values.sort_by(f64::total_cmp);
    [values.len() / 4, values.len() / 2, 3 * values.len() / 4].map(|i| values[i.min(values.len() - 1)])
}
