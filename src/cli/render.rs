//! `spectile render`: from a scene to a cube.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use super::Output;
use super::progress::Reporter;
use super::scene::SceneArgs;
use super::sinks::Sinks;
use crate::cube::{Existing, Layer};
use crate::files::output::real_path;
use crate::format::png::KEPT;
use crate::gpu::adapter::Selection;
use crate::render::job::{Job, Preview, StopRule};
use crate::render::schedule;
use crate::scene::Scene;
use crate::{Error, Result};

/// Render a scene into a cube
///
/// Renders SCENE into a new cube, a Zarr v3 store that other programs can open while it grows. Every tile first gets 1
/// sample per pixel, then 1, 2, 4, … 32 more, then 64 at a time: there is a picture at once, and after every epoch the
/// cube is complete. (Under --tiles, and where the cube is larger than half of the memory and only --spp ends the render, a
/// tile gets its first 64 samples in one go: the same bytes.)
///
/// Rendering stops at the first limit reached, --spp, --time or --error, always at the end of an epoch of the whole picture;
/// without a limit, after 64 samples per pixel (512 with --uncertainty). Noise falls with the square root of the samples: four times the samples
/// halve the error.
///
/// What is merged is committed to disk once a second. Ctrl-C keeps everything merged so far, and so do a kill, a power
/// cut or a full disk, up to the last commit: the same command with --resume goes on from there, and ends with the same
/// bytes. SIGUSR1 commits what is merged and prints a line on how far the render is.
#[derive(Debug, clap::Args)]
#[command(after_long_help = "\
Examples:
  spectile render scene.toml -o cube.zarr --spp 256
  spectile render scene.toml -o cube.zarr --time 10m --preview now.png
  spectile render scene.toml -o cube.zarr --error 0.01                    until noise is 1 % in every channel
  spectile render scene.toml -o cube.zarr --time 1h --listen 127.0.0.1:8090       watch it in a browser
  spectile render scene.toml -o cube.zarr --spp 1024 --resume             go on, after an end or to more samples
  spectile render scene.toml -o cube.zarr --spp 256 --tiles 0..500        one of several processes on one cube
  spectile render scene.toml -o quick.zarr --size 128x128 --set channels.equal.count=30")]
pub struct Args {
    /// The cube to make, a folder
    #[arg(short, long, value_name = "OUT.zarr")]
    pub output: PathBuf,

    /// Stop after this many samples per pixel
    ///
    /// Rounded up to the end of an epoch: 1, 2, 4, 8, 16, 32, 64, then multiples of 64 (or of integrator.epoch).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub spp: Option<u32>,

    /// Stop after this time, e.g. 90s, 10m, 2min or 1.5h
    ///
    /// Seconds where there is no unit. An epoch that would not finish in time is not started.
    #[arg(long, value_name = "TIME", value_parser = parse_time)]
    pub time: Option<Duration>,

    /// Stop when the estimated error of every channel is at most E, such as 0.01
    ///
    /// The error of a channel is the root of the sum of all pixels' variances over the sum of their squares, so 0.01 is noise of 1 %
    /// where the picture is bright. It is estimated from the spread of epochs of 64 samples (or of integrator.epoch) and is asked
    /// after eight of them, at 512 samples per pixel, for the first time. Channels that are zero everywhere count as done.
    #[arg(long, value_name = "E", value_parser = parse_error)]
    pub error: Option<f64>,

    /// What --error is the error of: the whole image, or each tile by itself
    ///
    /// `tile`: each tile ends where its own error is at most E in every channel, so that quiet tiles cost little and noisy ones get the
    /// samples; the others go on. It is looked at after 8, 10, 12, 14, 16, 20, 24, 28, 32, 40 … epochs, and must hold at two looks in a
    /// row. A tile darker than a tenth of the picture's mean (as a few samples tell it) is held to that. With --spp a tile ends there
    /// at the latest. Which tile gets how many samples follows from its own values alone, and stands in the array `samples`.
    #[arg(long, value_name = "image|tile", value_enum, default_value = "image", requires = "error")]
    pub error_per: ErrorOf,

    /// Store the standard error of every pixel and channel too
    ///
    /// In a second array, `standard_error`, from the spread of the epochs of 64 samples (or of integrator.epoch): it needs two,
    /// and is rough below eight. The cube becomes twice as large; without a limit 512 samples per pixel are rendered. With B
    /// epochs, the true value lies within t standard errors in 95 % of all cases, t from Student's distribution with B - 1
    /// degrees of freedom (2.36 for 8 epochs, 2.13 for 16).
    #[arg(long)]
    pub uncertainty: bool,

    /// Keep weights of products of spectra instead of radiance, so that lamps, paints and channels can be changed afterwards
    ///
    /// By diffuse, translucent and black surfaces, also blends and textures of endmembers, under lamps, lights, suns and uniform
    /// skies, what a path brings is a number times one source spectrum times the spectra of what it met. The cube holds these
    /// numbers; their size does not depend on the channels, nor is there noise from wavelengths. What comes by anything else (metals,
    /// glass, plastic, matter, maps …) is kept in channels beside them, as a remainder. `spectile relight` makes cubes of it, all
    /// else reads it as it is. docs/METHOD.md says how, `spectile plan` whether a scene separates.
    #[arg(long)]
    pub factored: bool,

    /// Store what the first surface behind each pixel is: depth, normal, object, material, coordinates, sun, separated by commas
    ///
    /// In an array each, seen through the pixel's centre (and the middle of a lens): the distance along that ray, m; the unit
    /// normal of the geometry, on the side that is seen; the numbers of object and material, whose names stand among the array's
    /// attributes; where it is in the scene, m; and the cosine at which the only sun or directional light shines on it, 0 in shade.
    /// Where nothing is met they are NaN, numbers -1. What has no material, or an opacity below a half, is looked through; matter
    /// that absorbs or scatters is not seen. They cost a few rays a pixel, once.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = parse_layer)]
    pub layers: Vec<Layer>,

    /// Seed of all random numbers
    ///
    /// The same scene, settings and seed give the same cube, bit for bit. Cubes of different seeds are independent:
    /// their mean has half the variance.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,

    /// Go on with OUT.zarr, which an earlier render of the same scene and settings has begun; begin it where there is none
    ///
    /// To finish what was interrupted, or to add samples. Every tile is compared with its checksums first; one that is
    /// damaged is rendered again, with a warning. Everything that decides the values must be as it was (scene, --set, --size,
    /// --tile, --seed); limits, devices, memory and preview may differ. What others have put into the store, such as notes
    /// among its attributes, stays. Cubes of format 1 and copies without .spectile can be read, not gone on with.
    #[arg(long, conflicts_with = "overwrite")]
    pub resume: bool,

    /// Replace OUT.zarr if it exists
    ///
    /// Only a Spectile cube that nobody works on is ever replaced; any other folder or file is refused, and so is a cube in
    /// which others have put something.
    #[arg(long)]
    pub overwrite: bool,

    /// Render only the tiles A to B - 1, numbered row by row from 0
    ///
    /// Several processes, also on several machines with a shared file system, may render disjoint tiles of one cube: the
    /// first makes it, the others join, and nothing has to be put together at the end. A tile that another process works
    /// on is refused, one that is finished is left as it is. `spectile info` lists the tiles that are missing. The limit
    /// is --spp, or --error with --error-per tile: nobody sees the whole picture.
    #[arg(long, value_name = "A..B", value_parser = parse_tiles, conflicts_with_all = ["time", "overwrite"])]
    pub tiles: Option<std::ops::Range<u32>>,

    #[command(flatten)]
    pub scene: SceneArgs,

    /// Devices to render on: all, a number, or positions as `spectile devices` lists them
    ///
    /// `all` takes every GPU, and software devices only where there is no GPU. A number takes so many of those; on a machine
    /// with fewer they share them. Positions are separated by commas: 0,2 (a single one: 0,). The devices share the picture,
    /// each takes the next tile when it is done with its last; how many there are changes no bit of the cube as long as they
    /// are of one kind.
    #[arg(long, value_name = "all|N|LIST", default_value = "all")]
    pub devices: Selection,

    /// Memory to use on each device, such as 512MiB, 2G, 1.5GB or a number of bytes; else what is worth using
    ///
    /// It covers all that Spectile holds there: the scene, the paths under way, a tile or several with all channels, and
    /// two transfers. A small budget makes small steps and changes no bit of the cube; what does not fit at all is refused,
    /// and says what the least is. `spectile plan` says what would be used.
    #[arg(long, value_name = "SIZE", value_parser = crate::files::parse_bytes)]
    pub memory: Option<u64>,

    /// Keep a picture of the cube as it grows (PNG, 8-bit sRGB)
    ///
    /// A new file, or a PNG picture that is there already and is replaced; through a link the file behind it. It is written
    /// again and again, so pipes and devices are refused.
    #[arg(long, value_name = "FILE.png")]
    pub preview: Option<PathBuf>,

    /// Exposure of --preview and --listen in EV: every step up is twice as bright
    ///
    /// At 0 a radiance of 1 W m-2 sr-1 nm-1 in all channels is white. Without it the 99th percentile of the lit pixels
    /// is, and the exposure chosen is printed. The page can change its own.
    #[arg(long, value_name = "EV", value_parser = super::parse_exposure, allow_hyphen_values = true)]
    pub exposure: Option<f64>,

    /// Serve a page that shows the render while it goes on, at IP:PORT (port 0: any that is free)
    ///
    /// The picture fills in after every unit; a click shows the spectrum of a pixel; the render can be paused, stopped and saved.
    /// On an address of this machine alone, such as 127.0.0.1:8090, whoever works on it may look. Where others can connect,
    /// the address that is printed holds a token, without which nothing is answered. docs/http.md is for scripts.
    #[arg(long, value_name = "IP:PORT", value_parser = super::view::parse_address)]
    pub listen: Option<SocketAddr>,

    /// A name by which a proxy is reached that passes requests on to the page of --listen: NAME or NAME:PORT (repeatable)
    ///
    /// With it every request needs the token that is printed, also from this machine. docs/http.md has more.
    #[arg(long, value_name = "NAME", requires = "listen", value_parser = super::view::parse_host)]
    pub public_host: Vec<String>,

    /// Stream the picture to tev, an image viewer, usually at 127.0.0.1:14158
    ///
    /// tev may be started later, and again: it is looked for once a second and gets all tiles that are there.
    #[arg(long, value_name = "HOST:PORT", value_parser = parse_tev)]
    pub tev: Option<String>,

    /// Say where the time went, stage by stage
    ///
    /// The device's own times of its passes where it has timestamps, else those of waiting for each.
    #[arg(long)]
    pub profile: bool,

    /// One JSON object a line on stdout, instead of text
    #[arg(long)]
    pub json: bool,

    /// No progress; only warnings and errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// What an error is one of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum ErrorOf {
    Image,
    Tile,
}

pub fn run(args: &Args, output: &Output) -> Result<()> {
    check(args)?;
    render(args, args.scene.load()?, output, |_| Ok(()))
}

/// Refuses arguments that do not go together, and pictures that cannot be written.
pub(super) fn check(args: &Args) -> Result<()> {
    if args.tiles.is_some() && args.error.is_some() && args.error_per == ErrorOf::Image {
        let what = "--tiles goes with --error only where each tile has its own end: add --error-per tile";
        return Err(Error::Usage(what.into()));
    }
    if args.exposure.is_some() && args.preview.is_none() && args.listen.is_none() {
        return Err(Error::Usage("--exposure is that of --preview or --listen, and neither is there".into()));
    }
    if let Some(preview) = &args.preview {
        KEPT.check_target(preview)?;
        args.scene.refuse_as_output(preview)?;
        if real_path(preview) == real_path(&args.output) {
            let what = "the cube and --preview cannot have one name";
            return Err(Error::Usage(format!("{}: {what}", preview.display())));
        }
    }
    Ok(())
}

/// Renders `scene`, which `args` name, and does `before_end` with the whole cube before the last event is told.
pub(super) fn render(
    args: &Args,
    scene: Scene,
    output: &Output,
    before_end: impl FnOnce(&Reporter) -> Result<()>,
) -> Result<()> {
    let interrupt = output.interrupt()?;
    let scene = if args.factored { scene.factored() } else { scene };
    let scene = if args.layers.is_empty() { scene } else { scene.with_first_hits() };
    let mut reporter = Reporter::new(args.quiet, output);
    for warning in &scene.warnings {
        reporter.warn(warning)?;
    }
    if let Some(error) = args.error.filter(|error| *error > 1.0) {
        reporter.warn(&format!("--error {error} lets noise be {:.0} % of the picture: 1 % is 0.01", 100.0 * error))?;
    }
    let sinks = Sinks::start(args, output, &mut reporter)?;
    let job = Job {
        output: args.output.clone(),
        existing: match args.overwrite {
            true => Existing::Replace,
            false if args.resume || args.tiles.is_some() => Existing::Resume,
            false => Existing::Refuse,
        },
        tiles: args.tiles.clone(),
        seed: args.seed,
        tile: args.scene.tile,
        stop: StopRule {
            samples: args.spp,
            time: args.time,
            error: args.error,
            per_tile: args.error_per == ErrorOf::Tile,
        },
        uncertainty: args.uncertainty,
        layers: args.layers.clone(),
        preview: args.preview.clone().map(|file| Preview { file, exposure: args.exposure }),
        profile: args.profile,
        devices: args.devices.clone(),
        memory: args.memory,
        feed: sinks.feed.clone(),
        scene,
    };
    reporter.start(&job)?;
    let summary = schedule::run(&job, &interrupt, &mut |event| reporter.event(event));
    sinks.finish(&job.output, &summary);
    let summary = summary.and_then(|summary| before_end(&reporter).map(|()| summary));
    reporter.finish(&job, summary)
}

/// A duration: seconds, or numbers with units, such as 10m, 2 min or 1h30m.
pub(super) fn parse_time(text: &str) -> std::result::Result<Duration, String> {
    let explain = || "a time is a positive number with s, min or h, such as 90s, 10m, 2min or 1.5h".to_owned();
    let is_number = |c: char| c.is_ascii_digit() || c == '.';
    let mut rest = text.trim();
    let mut seconds = 0.0;
    // A number alone is seconds, also one with an exponent.
    if let Ok(alone) = rest.parse::<f64>() {
        (seconds, rest) = (alone, "");
    }
    while !rest.is_empty() {
        let (number, unit) = rest.split_at(rest.find(|c| !is_number(c)).unwrap_or(rest.len()));
        let unit = unit.trim_start();
        let (unit, after) = unit.split_at(unit.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(unit.len()));
        let factor = match unit {
            "s" | "sec" | "second" | "seconds" => 1.0,
            "m" | "min" | "minute" | "minutes" => 60.0,
            "h" | "hr" | "hour" | "hours" => 3600.0,
            _ => return Err(explain()),
        };
        seconds += number.parse::<f64>().map_err(|_| explain())? * factor;
        rest = after.trim_start();
    }
    if seconds > 0.0 { Duration::try_from_secs_f64(seconds).map_err(|_| explain()) } else { Err(explain()) }
}

/// A layer by its name.
pub(super) fn parse_layer(text: &str) -> std::result::Result<Layer, String> {
    let names = Layer::ALL.map(Layer::name).join(", ");
    Layer::named(text.trim()).ok_or_else(|| format!("layers are {names}, separated by commas"))
}

/// An error estimate to reach.
pub(super) fn parse_error(text: &str) -> std::result::Result<f64, String> {
    let error = text.parse::<f64>().ok().filter(|error| *error > 0.0 && error.is_finite());
    error.ok_or_else(|| "an error is a positive number, such as 0.01 for 1 %".into())
}

/// A host and a port, which may be there later.
fn parse_tev(text: &str) -> std::result::Result<String, String> {
    let parts =
        text.rsplit_once(':').filter(|(host, port)| !host.is_empty() && port.parse::<u16>().is_ok_and(|p| p > 0));
    parts.map(|_| text.to_owned()).ok_or_else(|| "tev is at HOST:PORT, such as 127.0.0.1:14158".into())
}

/// A half-open range of tiles.
fn parse_tiles(text: &str) -> std::result::Result<std::ops::Range<u32>, String> {
    let number = |text: &str| text.trim().parse::<u32>().ok();
    let range = text.split_once("..").and_then(|(from, to)| Some(number(from)?..number(to)?));
    range.filter(|range| range.start < range.end).ok_or_else(|| "tiles are A..B with A < B, such as 0..100".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_half_open_ranges() {
        assert_eq!(parse_tiles("0..100"), Ok(0..100));
        assert_eq!(parse_tiles("7 .. 8"), Ok(7..8));
        for bad in ["", "5", "5..5", "6..5", "-1..5", "0...5", "0..x", "0..=5", "..5"] {
            assert!(parse_tiles(bad).unwrap_err().contains("0..100"), "{bad}");
        }
    }

    #[test]
    fn tev_is_a_host_and_a_port() {
        for good in ["127.0.0.1:14158", "viewer.local:1", "[::1]:14158"] {
            assert_eq!(parse_tev(good), Ok(good.to_owned()));
        }
        for bad in ["", "14158", ":14158", "host:", "host:0", "host:99999", "host"] {
            assert!(parse_tev(bad).unwrap_err().contains("14158"), "{bad}");
        }
    }

    #[test]
    fn times_have_units() {
        for (text, seconds) in [
            ("90", 90.0),
            ("90s", 90.0),
            ("10m", 600.0),
            ("1.5h", 5400.0),
            ("0.5 s", 0.5),
            ("2min", 120.0),
            ("2 minutes", 120.0),
            ("3hr", 10_800.0),
            ("1h30m", 5400.0),
            ("1 h 5 sec", 3605.0),
        ] {
            assert_eq!(parse_time(text), Ok(Duration::from_secs_f64(seconds)), "{text}");
        }
        for bad in
            ["", "m", "0", "-5s", "nan", "inf", "5d", "1e300h", "10m30", "1.2.3s", "2ms", "9999999999999999999999s"]
        {
            assert!(parse_time(bad).unwrap_err().contains("1.5h"), "{bad}");
        }
    }
}
