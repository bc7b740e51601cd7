//! `spectile plan`: what a render would need.

use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::Output;
use super::progress::short;
use super::render::parse_layer;
use super::scene::SceneArgs;
use crate::cube::{Choices, Header, Layer, RemainderShare};
use crate::device::evaluator::EvaluateShape;
use crate::device::facts;
use crate::device::part::OnDevice;
use crate::device::prepared::Prepared;
use crate::device::separable::MOST_FACTORS;
use crate::device::windows::Windows;
use crate::files::{format_bytes, shown};
use crate::gpu::adapter::{Gpu, Selection};
use crate::gpu::pass::storage_buffers;
use crate::render::job::StopRule;
use crate::render::pilot::Pilot;
use crate::render::pool::MERGE_THREADS;
use crate::render::wave::{Budget, WavePlan};
use crate::render::worker::Worker;
use crate::render::{pilot, plan};
use crate::scene::Scene;
use crate::spectral::table::Bounds;
use crate::{Error, Result};

/// Say what rendering a scene would take, without rendering it
///
/// Reads and checks SCENE and prints the time to expect, the memory on every device, the size of the cube on disk, the
/// evaluator chosen, the features it uses and what is left out for it.
#[derive(Debug, clap::Args)]
#[command(after_long_help = "\
Examples:
  spectile plan scene.toml
  spectile plan scene.toml --pilot
  spectile plan scene.toml --parts
  spectile plan scene.toml --layers depth,normal
  spectile plan scene.toml --size 4096x4096 --set channels.equal.count=2000 --spp 256
  spectile plan scene.toml --devices 2 --memory 512MiB")]
pub struct Args {
    #[command(flatten)]
    pub scene: SceneArgs,

    /// Devices to plan for: all, a number, or positions as `spectile devices` lists them
    ///
    /// As for `render`. All of them are tried at the same time.
    #[arg(long, value_name = "all|N|LIST", default_value = "all")]
    pub devices: Selection,

    /// Memory to use on each device, as for `render`
    #[arg(long, value_name = "SIZE", value_parser = crate::files::parse_bytes)]
    pub memory: Option<u64>,

    /// Samples per pixel to predict the time for, rounded up as by `render`
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..))]
    pub spp: u32,

    /// Layers to store beside the picture, separated by commas, as for `render`: what they take on disk and on the device
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = parse_layer)]
    pub layers: Vec<Layer>,

    /// Decide by samples what `render` decides before it begins: which paths are worth evaluating
    ///
    /// Where `integrator.evaluation` asks for it. Without this, the plan is that of evaluating all paths. Samples also tell how much of the
    /// picture `render --factored` would keep in a remainder.
    #[arg(long)]
    pub pilot: bool,

    /// Say also what each thing that is left out would cost, and how exact the tables of each spectrum are
    #[arg(long)]
    pub verbose: bool,

    /// Print the table of all parts of the renderer too: what each adds to kernels, buffers, records and paths
    #[arg(long)]
    pub parts: bool,

    /// One JSON object a line on stdout, instead of text
    #[arg(long)]
    pub json: bool,
}

pub fn run(args: &Args, output: &Output) -> Result<()> {
    let scene = args.scene.load()?;
    plan::check(&scene)?;
    let scene = if args.layers.is_empty() { scene } else { scene.with_first_hits() };
    scene.warnings.iter().try_for_each(|warning| warn(output, warning))?;
    // Without a device there is no prediction, but still a plan.
    let mut gpus = match Gpu::open_all(&args.devices) {
        Ok(gpus) => gpus,
        Err(error @ Error::NoDevice(_)) => {
            warn(output, &error.to_string())?;
            Vec::new()
        }
        Err(error) => return Err(error),
    };
    let evaluator = plan::evaluator(&scene, None, gpus.first().is_some_and(|gpu| gpu.is_software))?;
    let prepared = Prepared::for_evaluator(&scene, 0, evaluator)?;
    let (prepared, choices, remainder) = match args.pilot {
        false => (Arc::new(prepared), None, None),
        true if gpus.is_empty() => return Err(Error::NoDevice("--pilot follows paths, and there is no device".into())),
        true => {
            let mut pilot = Pilot {
                scene: &scene,
                gpus: &mut gpus,
                memory: args.memory,
                interrupt: &Arc::default(),
                warn: &mut |what| warn(output, &what),
            };
            let (prepared, choices) = pilot.decide(prepared, None)?;
            let is_deep = scene.integrator.max_bounces > MOST_FACTORS;
            let remainder = if is_deep { None } else { pilot.remainder()? };
            (prepared, choices, remainder)
        }
    };
    let stop = StopRule { samples: Some(args.spp), ..StopRule::default() };
    let samples = stop.samples_limit(scene.integrator.epoch, false)?.unwrap_or(args.spp);
    let tile = plan::tile_size(&scene, args.scene.tile);
    let header = plan::header(&scene, tile, 0, false, &args.layers)?;
    let layer_disk = header.store_bytes() - plan::header(&scene, tile, 0, false, &[])?.store_bytes();
    let budget = Budget { memory: args.memory, paths: None };
    let measured = measure_all(gpus, &prepared, &scene, tile, budget, output)?;
    let waves = match measured.first() {
        Some(m) => m.waves,
        None => plan::waves_without_device(&prepared, tile, budget)?,
    };
    let prepared = &*prepared;
    let scene = &scene;
    let obstacles = prepared.obstacles(scene);
    let plan =
        Plan { args, scene, samples, prepared, choices, obstacles, remainder, header, layer_disk, waves, measured };
    output.event("done", plan.facts())?;
    output.text(&plan.describe())
}

fn warn(output: &Output, what: &str) -> Result<()> {
    output.warn(what)
}

/// What a short trial on a device told.
struct Measured {
    device: String,
    waves: WavePlan,
    /// Seconds to open it, compile and upload.
    setup_s: f64,
    paths_per_s: f64,
}

/// Tries all devices at the same time, as they will work. Those that cannot hold the scene are left out with a warning,
/// unless none can.
fn measure_all(
    gpus: Vec<Gpu>,
    prepared: &Arc<Prepared>,
    scene: &Scene,
    tile: [u32; 2],
    budget: Budget,
    output: &Output,
) -> Result<Vec<Measured>> {
    let tried: Vec<_> = std::thread::scope(|threads| {
        let trial = |gpu| threads.spawn(move || measure(gpu, prepared, scene, tile, budget));
        let trials: Vec<_> = gpus.into_iter().map(trial).collect();
        trials.into_iter().map(|t| t.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))).collect()
    });
    let (mut measured, mut refused) = (Vec::new(), Vec::new());
    for (device, result) in tried.into_iter().enumerate() {
        match result {
            Ok(m) => measured.push(m),
            Err(error) => refused.push((device + 1, error)),
        }
    }
    if measured.is_empty() && !refused.is_empty() {
        return Err(refused.swap_remove(0).1);
    }
    for (device, error) in refused {
        warn(output, &format!("device {device} is left out: {error}"))?;
    }
    Ok(measured)
}

/// Renders a few samples in the middle of the picture, after one that compiles everything: ever more paths, up to a tile of them, until
/// they take long enough to tell. A path may take a microsecond, or on a software device some milliseconds.
fn measure(gpu: Gpu, prepared: &Arc<Prepared>, scene: &Scene, tile: [u32; 2], budget: Budget) -> Result<Measured> {
    const SAMPLES: u32 = 16;
    const TRIAL: Duration = Duration::from_millis(500);
    /// So that some threads of a software device have work.
    const FIRST_SIDE: u32 = 16;
    let started = Instant::now();
    let device = gpu.name.clone();
    let mut worker = Worker::new(gpu, Arc::clone(prepared), tile, budget)?;
    let [width, height] = scene.film.cube_size();
    let mut epochs = 0..;
    // Paths, and the seconds that they took.
    let mut epoch = |size: [u32; 2], samples: u32| -> Result<(f64, f64)> {
        let began = Instant::now();
        let [x, y] = [(width - size[0]) / 2 + scene.film.crop[0], (height - size[1]) / 2 + scene.film.crop[1]];
        worker.submit(&[[x, y, x + size[0], y + size[1]]], epochs.next().unwrap_or(0), samples)?;
        worker.collect()?;
        let paths = f64::from(samples) * f64::from(size[0]) * f64::from(size[1]);
        Ok((paths, began.elapsed().as_secs_f64()))
    };
    let mut size = tile.map(|side| side.min(FIRST_SIDE));
    epoch(size, 1)?;
    let setup_s = started.elapsed().as_secs_f64();
    let (mut samples, mut before) = (1, None);
    let (paths, seconds) = loop {
        let (paths, seconds) = epoch(size, samples)?;
        if seconds >= TRIAL.as_secs_f64() {
            // What any number of paths takes is in the one before too.
            let more = before.map(|(fewer, sooner)| (paths - fewer, seconds - sooner));
            break more.filter(|(_, longer)| *longer > 0.3 * seconds).unwrap_or((paths, seconds));
        }
        before = Some((paths, seconds));
        if samples < SAMPLES {
            samples *= 2;
        } else if size != tile {
            size = [0, 1].map(|axis| (2 * size[axis]).min(tile[axis]));
        } else {
            let (began, mut all) = (Instant::now(), 0.0);
            while began.elapsed() < TRIAL {
                all += epoch(size, samples)?.0;
            }
            break (all, began.elapsed().as_secs_f64());
        }
    };
    Ok(Measured { device, waves: worker.plan, setup_s, paths_per_s: paths / seconds })
}

struct Plan<'a> {
    args: &'a Args,
    /// Per pixel, at the end of an epoch.
    samples: u32,
    scene: &'a Scene,
    prepared: &'a Prepared,
    /// What the pilot decided, if it was asked.
    choices: Option<Choices>,
    /// What of the scene does not separate, in words; and what the pilot says of that.
    obstacles: Vec<String>,
    remainder: Option<RemainderShare>,
    header: Header,
    /// Of the cube's bytes on disk, those of its layers.
    layer_disk: u64,
    /// Of the first device, or of one that is not there.
    waves: WavePlan,
    measured: Vec<Measured>,
}

impl Plan<'_> {
    fn on_device(&self) -> OnDevice<'_> {
        // Waves were planned with the same limit.
        let windows = Windows::of(&self.prepared.accel, self.waves.limits.binding).unwrap_or(Windows::WHOLE);
        OnDevice { prepared: self.prepared, windows }
    }

    /// Each that is asked for once, in the order of the cube.
    fn layer_names(&self) -> Vec<&'static str> {
        Layer::ALL.into_iter().filter(|layer| self.args.layers.contains(layer)).map(Layer::name).collect()
    }

    fn paths(&self) -> f64 {
        self.header.size.iter().map(|&s| f64::from(s)).product::<f64>() * f64::from(self.samples)
    }

    /// Of all devices together.
    fn paths_per_s(&self) -> Option<f64> {
        self.measured.iter().map(|m| m.paths_per_s).reduce(|a, b| a + b)
    }

    fn predicted_s(&self) -> Option<f64> {
        let setup_s = self.measured.iter().map(|m| m.setup_s).reduce(f64::max)?;
        Some(setup_s + self.paths() / self.paths_per_s()?)
    }

    fn facts(&self) -> Value {
        let host = plan::host_memory(self.prepared, &self.header);
        let devices = self.measured.iter().map(|m| {
            json!({
                "name": m.device,
                "wave_paths": m.waves.paths,
                "wave_units": m.waves.units,
                "scene_bytes": m.waves.scene_bytes,
                "wave_bytes": m.waves.wave_bytes(),
                "transfer_bytes": 2 * m.waves.staging_bytes(),
                "paths_per_s": m.paths_per_s,
            })
        });
        let features = facts::parts(&self.on_device());
        let features = features.iter().map(|f| json!({ "name": f.name, "used": f.used, "effect": f.effect }));
        let mut facts = json!({
            "scene": shown(&self.args.scene.scene),
            "size": self.header.size,
            "channels": self.header.channels.len(),
            "tile": self.header.tile,
            "tiles": self.header.grid().count(),
            "evaluator": self.prepared.evaluator.name(),
            "evaluation": self.scene.integrator.evaluation.name(),
            "choices": self.choices,
            "features": features.collect::<Vec<_>>(),
            "spectra": facts::table_bounds(self.prepared),
            "factored_obstacles": self.obstacles,
            "remainder_share": self.remainder.as_ref().map(RemainderShare::of_channels),
            "storage_buffers": self.storage_buffers(),
            "primitives": self.prepared.accel.primitives.len() - self.prepared.accel.instances,
            "instances": self.prepared.accel.instances,
            "bvh_nodes": self.prepared.accel.node_count,
            "emitters": self.prepared.emitters.len(),
            "wave_paths": self.waves.paths,
            "path_bytes": self.waves.path_bytes(),
            "device_scene_bytes": self.waves.scene_bytes,
            "device_wave_bytes": self.waves.wave_bytes(),
            "device_budget_bytes": self.args.memory,
            "devices": devices.collect::<Vec<_>>(),
            "host_scene_bytes": host.scene,
            "host_merge_bytes": host.merge,
            "disk_bytes": self.header.store_bytes(),
            "layers": self.layer_names(),
            "layer_disk_bytes": self.layer_disk,
            "layer_device_bytes": self.waves.first_hit_bytes(),
            "device": self.measured.first().map(|m| m.device.clone()),
            "paths_per_s": self.paths_per_s(),
            "samples": self.samples,
            "predicted_s": self.predicted_s(),
        });
        if self.args.parts {
            facts["parts"] = facts::table(&self.on_device()).iter().map(facts::PartRow::json).collect();
        }
        facts
    }

    /// Storage buffers that a kernel binds at most.
    fn storage_buffers(&self) -> u32 {
        let scene = self.on_device();
        let kernels = scene.kernels(EvaluateShape::of(self.prepared, true));
        // Texts that do not parse are refused where they are compiled.
        kernels.all().filter_map(|source| storage_buffers(source).ok()).max().unwrap_or(0)
    }

    /// What `render --factored` makes of the scene.
    fn describe_factored(&self) -> String {
        let bounces = self.scene.integrator.max_bounces;
        let obstacles = self.obstacles.join(", ");
        if bounces > MOST_FACTORS {
            return format!(
                "not with paths of {bounces} bounces (integrator.max_bounces; render --factored takes {MOST_FACTORS})"
            );
        }
        if obstacles.is_empty() {
            return "the scene separates: render --factored keeps weights, so that spectra and channels can be changed afterwards".into();
        }
        let share = match &self.remainder {
            Some(share) => format!("about {}", share.describe(&self.scene.channels)),
            None => "--pilot says how much".into(),
        };
        format!(
            "the scene separates in part: render --factored keeps weights, and in channels a remainder, which cannot be changed afterwards, \
             of {obstacles}: {share}"
        )
    }

    /// First what users ask: how long, how much memory and disk, what was chosen. Then what the scene needs, and what not.
    fn describe(&self) -> String {
        let (p, header) = (self.prepared, &self.header);
        let [width, height] = header.size;
        let mut text = format!(
            "picture   {width} x {height} pixels x {} channels, {} tiles of {} x {}\n",
            header.channels.len(),
            header.grid().count(),
            header.tile[0],
            header.tile[1]
        );
        text += &self.describe_time();
        text += &self.describe_memory();
        text += &format!("disk      {}\n", format_bytes(header.store_bytes()));
        if !self.args.layers.is_empty() {
            text += &format!(
                "layers    {}: {} of the disk, {} of the device's waves; a few rays a pixel, once\n",
                self.layer_names().join(", "),
                format_bytes(self.layer_disk),
                format_bytes(self.waves.first_hit_bytes())
            );
        }
        text += &format!("evaluator {}\n", p.evaluator.name());
        text += &match &self.choices {
            Some(choices) => {
                wrapped("per path", &choices.describe_wavelengths()) + &wrapped("paths", &choices.describe())
            }
            None if pilot::is_needed(self.scene, p) => wrapped("paths", UNDECIDED),
            None => String::new(),
        };
        let copies = match p.accel.instances {
            0 => String::new(),
            n => format!(" and {n} instances (assemblies: {})", self.scene.assemblies.len()),
        };
        text += &format!(
            "geometry  {} primitives{copies}, {} BVH nodes in {} levels, {} emitters\n",
            p.accel.primitives.len() - p.accel.instances,
            p.accel.node_count,
            p.accel.depth,
            p.emitters.len()
        );
        let lines = facts::parts(&self.on_device());
        let in_full = |title: &str, used: bool| -> String {
            let lines = lines.iter().filter(|l| l.used == used).enumerate();
            lines.map(|(i, l)| format!("{:9} {} ({})\n", if i == 0 { title } else { "" }, l.name, l.effect)).collect()
        };
        text += &in_full("used", true);
        if self.args.verbose {
            text += &in_full("left out", false);
        } else {
            let names: Vec<&str> = lines.iter().filter(|l| !l.used).map(|l| l.name).collect();
            text += &wrapped("left out", &format!("{} (--verbose says what each would cost)", names.join(", ")));
        }
        text += &self.describe_spectra();
        text += &wrapped("factored", &self.describe_factored());
        if self.args.verbose {
            text += &format!("kernels   bind {} storage buffers at most\n", self.storage_buffers());
        }
        if self.args.parts {
            text += "parts     used; what each adds to kernels, stages of generate, buffers, records of a path, words of its state\n";
            facts::table(&self.on_device()).iter().for_each(|row| text += &row.line());
        }
        text
    }

    fn describe_time(&self) -> String {
        let (Some(paths_per_s), Some(seconds)) = (self.paths_per_s(), self.predicted_s()) else {
            return "time      unknown without a device\n".to_owned();
        };
        let devices = match self.measured.as_slice() {
            [only] => only.device.clone(),
            several => format!("{} devices", several.len()),
        };
        let about = short(Duration::from_secs_f64(seconds));
        format!("time      {about} for {} samples per pixel on {devices} ({paths_per_s:.0} paths/s)\n", self.samples)
    }

    fn describe_memory(&self) -> String {
        let budget =
            self.args.memory.map_or_else(|| "without a budget".to_owned(), |b| format!("of {}", format_bytes(b)));
        let device = |name: &str, w: &WavePlan| {
            format!(
                "device    {name}: {} {budget}: {} for the scene, {} for waves of {} paths ({} bytes a path) in {} tiles at \
                 most, two transfers of {} included\n",
                format_bytes(w.device_bytes()),
                format_bytes(w.scene_bytes),
                format_bytes(w.wave_bytes()),
                w.paths,
                w.path_bytes(),
                w.units,
                format_bytes(w.staging_bytes())
            )
        };
        let mut text: String = self.measured.iter().map(|m| device(&m.device, &m.waves)).collect();
        if self.measured.is_empty() {
            text += &device("a common GPU", &self.waves);
        }
        let host = plan::host_memory(self.prepared, &self.header);
        text + &format!(
            "host      {} for the scene, {} a thread that merges (a GPU has up to {}); units are merged from the devices' transfers\n",
            format_bytes(host.scene),
            format_bytes(host.merge),
            MERGE_THREADS
        )
    }

    /// How far tables are off: the largest of all, or each.
    fn describe_spectra(&self) -> String {
        let tables = || self.prepared.spectrum_names.iter().zip(&self.prepared.tables.bounds).skip(1);
        let line = |title: &str, name: &str, pointwise: f64, mean: f64| {
            format!("{title:9} {name}: within {pointwise:.1e} of the channel's peak, means within {mean:.1e}\n")
        };
        if self.args.verbose {
            let each = tables().enumerate();
            let title = |i: usize| if i == 0 { "spectra" } else { "" };
            return each.map(|(i, (name, b))| line(title(i), name, b.pointwise, b.mean)).collect();
        }
        let largest = |value: fn(&Bounds) -> f64| tables().map(|(_, bounds)| value(bounds)).fold(0.0, f64::max);
        let name = format!("{} in tables (--verbose lists them)", tables().count());
        line("spectra", &name, largest(|b| b.pointwise), largest(|b| b.mean))
    }
}

const UNDECIDED: &str = "which are worth evaluating, and at how many wavelengths, is decided by samples when the cube is made (--pilot does it \
                         now); this is the plan of evaluating all at one";

/// Words under a title, in lines of a width that terminals have.
fn wrapped(title: &str, words: &str) -> String {
    const WIDTH: usize = 110;
    let mut lines = vec![String::new()];
    for word in words.split(' ') {
        let line = lines.last_mut().expect("one line at least");
        if !line.is_empty() && line.chars().count() + 1 + word.chars().count() > WIDTH {
            lines.push(word.to_owned());
        } else {
            *line += if line.is_empty() { "" } else { " " };
            *line += word;
        }
    }
    let title = |i: usize| if i == 0 { title } else { "" };
    lines.iter().enumerate().map(|(i, line)| format!("{:9} {line}\n", title(i))).collect()
}
