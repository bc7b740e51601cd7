//! What may not change the answer: not a bit of it, or not beyond noise.

use std::path::PathBuf;
use std::sync::Arc;

use super::bench::{F32, TABLES};
use super::{Bench, Case};
use crate::cube::{Cube, Existing};
use crate::render::interrupt::Interrupt;
use crate::render::job::{Job, StopRule};
use crate::render::schedule::{self, Event};
use crate::{Error, Result};

const GROUP: &str = "invariance";

pub const CASES: &[Case] = &[
    Case {
        group: GROUP,
        name: "machinery",
        what: "one cube by 1, 2 and 3 devices, in little memory, tile by tile in another order, stopped and broken off and gone on \
               with: the same bits",
        run: machinery,
    },
    Case {
        group: GROUP,
        name: "evaluators",
        what: "the four evaluators, large and small tiles, each with its own paths: the same means",
        run: evaluators,
    },
    Case {
        group: GROUP,
        name: "neighbours",
        what: "one channel alone and among 2, 7 and 2,000: the same bits where spectra are lines, else as near as tables are",
        run: neighbours,
    },
];

/// A floor with a ball and a mirror under a lamp and a sky, 40 x 24 pixels.
fn still_life(channels: &str) -> String {
    format!(
        "[camera.perspective]\nposition = [0.2, 0.3, 2.2]\nlook_at = [0, 0, 0]\nup = [0, 1, 0]\nfov = 60\n\
         [film]\nwidth = 40\nheight = 24\n[channels]\n{channels}\n[integrator]\nmax_bounces = 4\nepoch = 16\n\
         [materials.floor.diffuse]\nreflectance = {{ samples = [[400, 0.2], [520, 0.5], [700, 0.9]] }}\n\
         [materials.ball.diffuse]\nreflectance = 0.7\n[materials.metal.conductor]\neta = 0.2\nk = 3.4\nroughness = 0.2\n[materials.b.black]\n\
         [[objects]]\nquad = {{ corner = [-2, -1, 2], edge_u = [4, 0, 0], edge_v = [0, 0, -4] }}\nmaterial = \"floor\"\n\
         [[objects]]\nsphere = {{ center = [0.6, -0.5, 0.2], radius = 0.5 }}\nmaterial = \"ball\"\n\
         [[objects]]\nsphere = {{ center = [-0.6, -0.5, 0.2], radius = 0.5 }}\nmaterial = \"metal\"\n\
         [[objects]]\nquad = {{ corner = [-0.5, 1.5, -0.5], edge_u = [1, 0, 0], edge_v = [0, 0, 1] }}\nmaterial = \"b\"\n\
         emission = {{ samples = [[400, 3], [610, 9], [700, 5]] }}\n[environment]\nradiance = 0.2\n"
    )
}

fn machinery(bench: &mut Bench) -> Result<()> {
    const SAMPLES: u32 = 64;
    let folder = tempfile::tempdir().map_err(|error| Error::storage(&std::env::temp_dir(), error))?;
    let scene = bench.scene(&still_life("equal = { from = 400, to = 700, count = 30 }"))?;
    let machine = bench.machine();
    let job = |name: &str| Job {
        scene: scene.clone(),
        output: folder.path().join(name),
        existing: Existing::Resume,
        tiles: None,
        seed: 7,
        tile: Some(8),
        uncertainty: true,
        layers: Vec::new(),
        stop: StopRule { samples: Some(SAMPLES), ..StopRule::default() },
        preview: None,
        profile: false,
        devices: machine.several(1),
        memory: None,
        feed: None,
    };
    let [width, height] = scene.film.cube_size();
    let bits = |output: PathBuf| -> Result<Vec<u32>> {
        let cube = Cube::open(&output)?;
        let mut bits = Vec::new();
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let spectrum = cube.spectrum(x, y)?.ok_or_else(|| Error::Internal(format!("no pixel {x}, {y}")))?;
            bits.extend(spectrum.iter().map(|v| v.to_bits()));
        }
        Ok(bits)
    };
    let render = |job: &Job| schedule::run(job, &machine.interrupt, &mut |_| Ok(())).map(|_| ());

    let first = job("first.zarr");
    render(&first)?;
    let expected = bits(first.output)?;
    let mut others = Vec::new();
    for devices in [2, 3] {
        let job = Job { devices: machine.several(devices), ..job(&format!("devices-{devices}.zarr")) };
        render(&job)?;
        others.push((format!("{devices} devices"), bits(job.output)?));
    }
    // The least that a render says it needs.
    let refusal = render(&Job { memory: Some(1), ..job("memory.zarr") }).err().map(|error| error.to_string());
    let least = refusal.iter().flat_map(|text| text.split(' ')).filter_map(|word| word.parse().ok()).nth(1);
    let least: u64 = least.ok_or_else(|| Error::Internal(format!("no least memory is named: {refusal:?}")))?;
    let little = Job { memory: Some(least), ..job("memory.zarr") };
    render(&little)?;
    others.push((format!("in {least} bytes"), bits(little.output)?));
    // 15 tiles of 8 x 8: the last ones first.
    for tiles in [10..15, 3..10, 0..3] {
        render(&Job { tiles: Some(tiles), ..job("order.zarr") })?;
    }
    others.push(("tiles in another order".into(), bits(folder.path().join("order.zarr"))?));
    // Stopped in order after a quarter of the samples, then gone on with.
    let stopped = job("stopped.zarr");
    let interrupt = Arc::new(Interrupt::default());
    let mut stop = |event: Event| {
        if matches!(event, Event::Epoch(status) if status.samples >= SAMPLES / 4) {
            interrupt.stop(2);
        }
        Ok(())
    };
    let end = schedule::run(&stopped, &interrupt, &mut stop);
    let was_stopped = matches!(end, Err(Error::Interrupted { .. }));
    render(&stopped)?;
    others.push((format!("stopped ({was_stopped})"), bits(stopped.output)?));
    // Broken off by an error of whoever listens, in the middle of an epoch, as often as it takes.
    let broken = job("broken.zarr");
    let mut ends = 0;
    loop {
        let mut events = 0;
        let mut break_off = |event: Event| {
            events += u32::from(matches!(event, Event::Progress(_) | Event::Epoch(_)));
            if events > 2 + ends { Err(Error::BrokenPipe) } else { Ok(()) }
        };
        match schedule::run(&broken, &Arc::default(), &mut break_off) {
            Err(Error::BrokenPipe) => ends += 1,
            Err(error) => return Err(error),
            Ok(_) => break,
        }
    }
    others.push((format!("broken off {ends} times"), bits(broken.output)?));
    let count = expected.len() as f64;
    for (what, found) in others {
        let same = found.iter().zip(&expected).filter(|(a, b)| a == b).count();
        bench.check_within(format!("{what}: equal values"), count, (same as f64, 0.0), 0.0);
    }
    bench.check_within("was stopped and broken off", 1.0, (f64::from(u8::from(was_stopped && ends > 0)), 0.0), 0.0);
    Ok(())
}

fn evaluators(bench: &mut Bench) -> Result<()> {
    let text = still_life("equal = { from = 400, to = 700, count = 6 }");
    let mut means = Vec::new();
    for (seed, (name, tile)) in (1..).zip([
        ("dpept-pixel", None),
        ("dpept-path", None),
        ("dpept-spectral", None),
        ("pt", None),
        ("dpept-pixel", Some(8)),
    ]) {
        let text = text.replace("[integrator]\n", &format!("[integrator]\nevaluator = \"{name}\"\n"));
        let seen = bench.render_with(&text, 1024, seed, tile)?;
        // Pixels differ; epochs of one pixel do not but for noise.
        let (channels, values) = (seen.mean.len(), seen.image.mean.len());
        let variance = |k: usize| (k..values).step_by(channels).map(|i| seen.image.variance(i)).sum::<f64>();
        let pixels = (values / channels) as f64;
        let of = |k: usize| (seen.mean[k], variance(k).sqrt() / pixels);
        let name = if tile.is_some() { "small tiles" } else { name };
        means.push((name, (0..channels).map(of).collect::<Vec<_>>()));
    }
    let (_, first) = means[0].clone();
    for (name, other) in &means[1..] {
        for (k, (&(expected, own), &(got, error))) in first.iter().zip(other).enumerate() {
            bench.check(format!("{name}, channel {k}"), expected, (got, error.hypot(own)), F32);
        }
    }
    Ok(())
}

fn neighbours(bench: &mut Bench) -> Result<()> {
    // With several lights what all channels decide is which of them is asked: here is one.
    let bent = still_life("CHANNELS").replace("[environment]\nradiance = 0.2\n", "");
    let straight = bent.replace(", [520, 0.5]", "").replace(", [610, 9]", "");
    for (what, text) in [("lines", straight), ("with nodes", bent)] {
        let mut seen = |others: usize| -> Result<Vec<f64>> {
            let mut bounds = vec![[500.0, 525.0]];
            bounds.extend((0..others).map(|i| [400.0 + 0.1 * i as f64, 401.0 + 0.14 * i as f64]));
            let text = text.replace("CHANNELS", &format!("intervals = {bounds:?}"));
            Ok(bench.render(&text, 16)?.image.mean.into_iter().step_by(1 + others).collect())
        };
        let expected = seen(0)?;
        let found = [1, 6, 1999].into_iter().map(|others| Ok((others, seen(others)?))).collect::<Result<Vec<_>>>()?;
        for (others, found) in found {
            let off = found.iter().zip(&expected).map(|(a, b)| if a == b { 0.0 } else { (a / b - 1.0).abs() });
            let off = off.fold(0.0, f64::max);
            let bound = if what == "lines" { 0.0 } else { TABLES };
            let what = format!("{what}, among {}: largest difference, relative", 1 + others);
            bench.check_within(what, 0.0, (off, 0.0), bound);
        }
    }
    Ok(())
}
