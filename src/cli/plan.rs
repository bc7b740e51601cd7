//! `spectile plan`: what a render would need.

use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::Output;
use super::output::say;
use super::progress::short;
use super::scene::SceneArgs;
use crate::cube::Header;
use crate::files::format_bytes;
use crate::gpu::adapter::Gpu;
use crate::render::plan;
use crate::render::prepare::Prepared;
use crate::render::schedule::StopRule;
use crate::render::wave::WavePlan;
use crate::render::worker::Worker;
use crate::scene::Scene;
use crate::{Error, Result};

/// Say what rendering a scene would take, without rendering it
///
/// Reads and checks SCENE and prints the features it uses and what is left out for it, tiles and waves, the memory on
/// every device, the size of the cube on disk, and the time to expect.
#[derive(Debug, clap::Args)]
#[command(after_long_help = "\
Examples:
  spectile plan scene.toml
  spectile plan scene.toml --size 4096x4096 --set channels.equal.count=2000 --spp 256")]
pub struct Args {
    #[command(flatten)]
    pub scene: SceneArgs,

    /// Samples per pixel to predict the time for, rounded up as by `render`
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..))]
    pub spp: u32,

    /// One JSON object a line on stdout, instead of text
    #[arg(long)]
    pub json: bool,
}

pub fn run(args: &Args, output: &Output) -> Result<()> {
    let scene = args.scene.load()?;
    plan::check(&scene)?;
    for warning in &scene.warnings {
        say(&format!("warning: {warning}"));
        output.event("warning", json!({ "message": warning }))?;
    }
    let prepared = Arc::new(Prepared::new(&scene, 0)?);
    let stop = StopRule { samples: Some(args.spp), time: None };
    let samples = stop.samples_limit(scene.integrator.epoch)?.unwrap_or(args.spp);
    let tile = plan::tile_size(&scene, args.scene.tile);
    let header = plan::header(&scene, tile, 0);
    // Without a device there is no prediction, but still a plan.
    let measured = match Gpu::open() {
        Ok(gpu) => Some(measure(gpu, &prepared, &scene, tile)?),
        Err(error @ Error::NoDevice(_)) => {
            say(&format!("warning: {error}"));
            None
        }
        Err(error) => return Err(error),
    };
    let waves = match &measured {
        Some(m) => m.waves,
        None => plan::waves_without_device(&prepared, tile)?,
    };
    let plan = Plan { args, samples, prepared: &prepared, header, waves, measured };
    output.event("done", plan.facts())?;
    output.text(&plan.describe())
}

/// What a short trial on the device told.
struct Measured {
    device: String,
    waves: WavePlan,
    /// Seconds to open it, compile and upload.
    setup_s: f64,
    paths_per_s: f64,
}

/// Renders a few samples of a tile in the middle of the picture, after one that compiles everything.
fn measure(gpu: Gpu, prepared: &Arc<Prepared>, scene: &Scene, tile: [u32; 2]) -> Result<Measured> {
    const SAMPLES: u32 = 16;
    const TRIAL: Duration = Duration::from_millis(500);
    let started = Instant::now();
    let device = gpu.name.clone();
    let mut worker = Worker::new(gpu, Arc::clone(prepared), tile, None)?;
    let [width, height] = scene.film.cube_size();
    let [x, y] = [(width - tile[0]) / 2 + scene.film.crop[0], (height - tile[1]) / 2 + scene.film.crop[1]];
    let unit = [x, y, x + tile[0], y + tile[1]];
    let mut epoch = |samples: u32, index: u32| -> Result<()> {
        worker.submit(&[unit], index, samples, &mut |_| Ok(()))?;
        worker.collect(&mut |_| Ok(()))
    };
    epoch(1, 0)?;
    let setup_s = started.elapsed().as_secs_f64();
    let (began, mut epochs) = (Instant::now(), 0);
    while began.elapsed() < TRIAL {
        epochs += 1;
        epoch(SAMPLES, epochs)?;
    }
    let paths = f64::from(epochs * SAMPLES) * f64::from(tile[0]) * f64::from(tile[1]);
    Ok(Measured { device, waves: worker.plan, setup_s, paths_per_s: paths / began.elapsed().as_secs_f64() })
}

struct Plan<'a> {
    args: &'a Args,
    /// Per pixel, at the end of an epoch.
    samples: u32,
    prepared: &'a Prepared,
    header: Header,
    waves: WavePlan,
    measured: Option<Measured>,
}

impl Plan<'_> {
    fn paths(&self) -> f64 {
        self.header.size.iter().map(|&s| f64::from(s)).product::<f64>() * f64::from(self.samples)
    }

    fn predicted_s(&self) -> Option<f64> {
        self.measured.as_ref().map(|m| m.setup_s + self.paths() / m.paths_per_s)
    }

    fn facts(&self) -> Value {
        let memory = plan::memory(self.prepared, &self.waves, &self.header);
        let features = plan::feature_lines(self.prepared, &self.waves);
        let features = features.iter().map(|f| json!({ "name": f.name, "used": f.used, "effect": f.effect }));
        json!({
            "scene": self.args.scene.scene,
            "size": self.header.size,
            "channels": self.header.channels.len(),
            "tile": self.header.tile,
            "tiles": self.header.grid().count(),
            "features": features.collect::<Vec<_>>(),
            "spectra": plan::table_bounds(self.prepared),
            "primitives": self.prepared.accel.primitives.len(),
            "bvh_nodes": self.prepared.accel.nodes.len(),
            "emitters": self.prepared.emitters.len(),
            "wave_paths": self.waves.paths,
            "path_bytes": self.waves.path_bytes(),
            "device_scene_bytes": memory.scene,
            "device_wave_bytes": memory.waves,
            "host_scene_bytes": memory.scene,
            "disk_bytes": memory.disk,
            "device": self.measured.as_ref().map(|m| m.device.clone()),
            "paths_per_s": self.measured.as_ref().map(|m| m.paths_per_s),
            "samples": self.samples,
            "predicted_s": self.predicted_s(),
        })
    }

    fn describe(&self) -> String {
        let (p, header) = (self.prepared, &self.header);
        let memory = plan::memory(p, &self.waves, header);
        let [width, height] = header.size;
        let mut text = format!(
            "picture   {width} x {height} pixels x {} channels, {} tiles of {} x {}\n",
            header.channels.len(),
            header.grid().count(),
            header.tile[0],
            header.tile[1]
        );
        text += &format!(
            "geometry  {} primitives, {} BVH nodes in {} levels, {} emitters\n",
            p.accel.primitives.len(),
            p.accel.nodes.len(),
            p.accel.depth,
            p.emitters.len()
        );
        let lines = plan::feature_lines(p, &self.waves);
        for (title, used) in [("used", true), ("left out", false)] {
            for (i, line) in lines.iter().filter(|l| l.used == used).enumerate() {
                text += &format!("{:9} {} ({})\n", if i == 0 { title } else { "" }, line.name, line.effect);
            }
        }
        for (i, (name, b)) in p.spectrum_names.iter().zip(&p.tables.bounds).skip(1).enumerate() {
            let title = if i == 0 { "spectra" } else { "" };
            text += &format!(
                "{title:9} {name}: within {:.1e} of the channel's peak, means within {:.1e}\n",
                b.pointwise, b.mean
            );
        }
        text += &format!(
            "device    {} for the scene, {} for waves of {} paths ({} bytes a path)\n",
            format_bytes(memory.scene),
            format_bytes(memory.waves),
            self.waves.paths,
            self.waves.path_bytes()
        );
        text += &format!("host      {} for the scene, 1 MiB to merge\n", format_bytes(memory.scene));
        text += &format!("disk      {}\n", format_bytes(memory.disk));
        match (&self.measured, self.predicted_s()) {
            (Some(m), Some(seconds)) => {
                text += &format!(
                    "time      {} for {} samples per pixel on {} ({:.0} paths/s)\n",
                    short(Duration::from_secs_f64(seconds)),
                    self.samples,
                    m.device,
                    m.paths_per_s
                );
            }
            _ => text += "time      unknown without a device\n",
        }
        text
    }
}
