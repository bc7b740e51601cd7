//! `spectile info`: what a cube is and how far it got.

use std::fmt::Write;
use std::io::IsTerminal;
use std::ops::Range;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::Output;
use super::tile_states::{TileStates, list};
use crate::cube::{Choices, Cube, FACTORED, LAYERS, Progress, RemainderShare, Verification};
use crate::files::shown;
use crate::scene::{Evaluation, Evaluator};
use crate::spectral::Channels;
use crate::spectral::colour::ProjectionKind;
use crate::{Error, Result};

/// Say what a cube is, how far it got and how large its error is
///
/// Works on finished cubes and on those being rendered. The error estimate of a channel is the standard error of its
/// pixels, root mean square over the picture, relative to their root mean square radiance. It comes from the spread of
/// the epochs (of integrator.epoch samples each, 64 by default), so it needs two of them and is rough below eight.
///
/// Where several processes or the tasks of an array job work on it, it says which tiles are done, being rendered, failed or still
/// waiting, and by whom; with --watch again and again, until all are done.
///
/// Of counts (`sensor --model`) it tells the sensor and, for every band, signal, SNR, NEDL, NETD and how many pixels were clipped.
///
/// With --verify every file is read and compared with its checksum; the exit code is 1 if one is damaged. Rendering the same
/// scene into the cube with --resume puts it in order.
#[derive(Debug, clap::Args)]
#[command(after_long_help = "\
Examples:
  spectile info cube.zarr
  spectile info cube.zarr --verify
  spectile info cube.zarr --watch       who renders what, until all is done; Ctrl-C ends it
  spectile info cube.zarr --json        all channels, with bounds and error estimates; null where unknown")]
pub struct Args {
    /// The cube, a folder
    pub cube: PathBuf,

    /// Compare every file with its checksum
    #[arg(long)]
    pub verify: bool,

    /// Say again how the tiles stand whenever that changes, until all are done
    ///
    /// On a terminal the picture is drawn anew, otherwise a line is added. Every 2 seconds, or less often where the cube has so
    /// many tiles that looking at them takes longer.
    #[arg(long, conflicts_with = "verify")]
    pub watch: bool,

    /// One JSON object on stdout, instead of text
    #[arg(long)]
    pub json: bool,
}

/// Epochs below which an error estimate is only rough: it is itself one from so few values.
pub(super) const ROUGH_BELOW: u32 = 8;

pub fn run(args: &Args, output: &Output) -> Result<()> {
    if args.watch {
        watch(args, output)?;
    }
    // Of counts as they are; of a cube also where others have changed its metadata.
    if let Ok(Some(counts)) = Cube::open_counts(&args.cube) {
        if args.verify {
            let what = "holds counts of a sensor, which have no checksums: make them anew to compare";
            return Err(Error::Usage(format!("{} {what}", args.cube.display())));
        }
        return super::counts::info(&counts, output);
    }
    let cube = Cube::open(&args.cube)?;
    let verified = if args.verify { Some(cube.verify()?) } else { None };
    let damaged = |damage: &[String]| {
        let files = if damage.len() == 1 { "file is" } else { "files are" };
        Error::Check(format!(
            "{}: {} {files} damaged; rendering the same scene into it with --resume puts the tiles in order",
            args.cube.display(),
            damage.len()
        ))
    };
    let (samples, estimate) = match (cube.all_samples(), cube.error_estimate(), &verified) {
        (Ok(samples), Ok(estimate), _) => (samples, estimate),
        // So damaged that nothing else can be told of it.
        (.., Some(Verification { damage, .. })) if !damage.is_empty() => {
            damage.iter().try_for_each(|what| output.text(&format!("damage           {what}\n")))?;
            return Err(damaged(damage));
        }
        (Err(error), ..) | (_, Err(error), _) => return Err(error),
    };
    let work = TileStates::of(&cube, &samples)?;
    let lost = cube.lost(&samples);
    let choices = Choices::read(cube.path())?;
    let remainder = cube.remainder_share()?;
    let found = Found { progress: Progress::of(&samples), estimate, work, verified, lost, choices, remainder, cube };
    output.event("done", found.facts())?;
    output.text(&found.describe())?;
    match &found.verified {
        Some(Verification { damage, .. }) if !damage.is_empty() => Err(damaged(damage)),
        _ => found.lost.first().map_or(Ok(()), |lost| found.cube.check_files(lost.start)),
    }
}

/// All that is told of a cube.
struct Found {
    cube: Cube,
    progress: Progress,
    estimate: Vec<f64>,
    work: TileStates,
    verified: Option<Verification>,
    /// Tiles that were rendered and lack a file.
    lost: Vec<Range<u32>>,
    /// What was decided before it was rendered, where something was.
    choices: Option<Choices>,
    /// How much of it does not separate, of a factored cube that has such a thing.
    remainder: Option<RemainderShare>,
}

/// Says how the tiles stand, again and again until all are done.
fn watch(args: &Args, output: &Output) -> Result<()> {
    const EVERY: Duration = Duration::from_secs(2);
    /// Looking takes this share of the time at most.
    const SHARE: u32 = 10;
    let draws = std::io::stdout().is_terminal() && !args.json;
    let mut last = None;
    loop {
        let began = Instant::now();
        let cube = Cube::open(&args.cube)?;
        let standing = TileStates::of(&cube, &cube.all_samples()?)?;
        if last.as_ref() != Some(&standing) {
            output.event("progress", standing.facts())?;
            if draws {
                let mut text = format!("\x1b[H\x1b[2J{}\n", args.cube.display());
                for (name, value) in standing.rows() {
                    // Writing to a string cannot fail.
                    let _ = writeln!(text, "{name:<16} {value}");
                }
                output.text(&text)?;
            } else if !args.json {
                output.text(&format!("{}\n", standing.line()))?;
            }
        }
        if standing.is_done() {
            return Ok(());
        }
        last = Some(standing);
        std::thread::sleep(EVERY.max(began.elapsed() * SHARE));
    }
}

fn pairs(tiles: &[Range<u32>]) -> Vec<[u32; 2]> {
    tiles.iter().map(|tiles| [tiles.start, tiles.end]).collect()
}

/// Whole epochs that every tile begun has.
fn epochs(cube: &Cube, progress: &Progress) -> u32 {
    progress.samples[0] / cube.header().epoch
}

impl Found {
    fn facts(&self) -> Value {
        let Found { cube, progress, estimate, .. } = self;
        let (header, channels) = (cube.header(), cube.channels());
        let each = (0..channels.len()).map(|k| {
            json!({
                "name": channels.names[k],
                "wavelength_nm": channels.centre(k),
                "bounds_nm": channels.bounds[k],
                "error_estimate": estimate[k],
            })
        });
        json!({
            "cube": shown(cube.path()),
            "size": header.size,
            "origin": header.origin,
            "tile": header.tile,
            "tiles": progress.tiles,
            "tiles_started": progress.tiles_started,
            "tiles_missing": pairs(&progress.missing),
            "tiles_behind": pairs(&progress.behind),
            "tiles_lost": pairs(&self.lost),
            "only_read": cube.is_only_read(),
            "tiles_in_use": self.work.first_in_use().map(|tiles| [tiles.start, tiles.end]),
            "verified_files": self.verified.as_ref().map(|verified| verified.files),
            "damage": self.verified.as_ref().map(|verified| &verified.damage),
            "work": self.work.facts(),
            "samples": { "least": progress.samples[0], "most": progress.samples[1] },
            "epoch": header.epoch,
            "epochs": epochs(cube, progress),
            "error_estimate_is_rough": epochs(cube, progress) < ROUGH_BELOW,
            "store_bytes": header.store_bytes(),
            "uncertainty": header.has_uncertainty(),
            "layers": self.layers(),
            "choices": self.choices,
            "remainder_share": self.remainder.as_ref().map(RemainderShare::of_channels),
            "preview": shows(cube),
            "attributes": header.attributes,
            "channels": each.collect::<Vec<_>>(),
        })
    }

    /// Whether nobody has decided yet which paths are evaluated.
    fn is_pending(&self) -> bool {
        let attributes = &self.cube.header().attributes;
        let setting = |name: &str| attributes.get("settings")?["integrator"][name].as_str();
        let is_open = setting("wavelengths_per_channel").is_some()
            || setting("evaluation").is_some_and(|setting| setting != Evaluation::All.name());
        let by_itself = [Evaluator::Pt, Evaluator::Factored].map(Evaluator::name);
        let by_itself =
            attributes.get("evaluator").is_some_and(|evaluator| by_itself.iter().any(|name| evaluator == name));
        !by_itself && self.progress.samples[1] == 0 && is_open
    }

    /// Names of what is known of the first surface behind each pixel.
    fn layers(&self) -> Vec<&'static str> {
        self.cube.layers().iter().map(|layer| layer.name()).collect()
    }

    fn describe(&self) -> String {
        let Found { cube, progress, estimate, .. } = self;
        let header = cube.header();
        let ([width, height], [tile_width, tile_height]) = (header.size, header.tile);
        let mut text = String::new();
        let mut row = |name: &str, value: String| {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{name:<16} {value}");
        };
        row("cube", cube.path().display().to_string());
        row("size", format!("{width} x {height} pixels x {} channels", cube.channels().len()));
        if header.origin != [0, 0] {
            row("crop", format!("from column {}, row {} of the film", header.origin[0], header.origin[1]));
        }
        row("wavelengths", describe_channels(cube.channels()));
        row("tiles", format!("{} of {tile_width} x {tile_height} pixels", progress.tiles));
        row("samples", describe_samples(progress));
        if !progress.missing.is_empty() && progress.tiles_started > 0 {
            row("missing tiles", list(&progress.missing));
        }
        if !progress.behind.is_empty() && !self.work.has_own_ends() {
            row("tiles behind", list(&progress.behind));
        }
        if !self.lost.is_empty() {
            row("lost tiles", format!("{}: files of them are missing", list(&self.lost)));
        }
        self.work.rows().into_iter().for_each(|(name, value)| row(name, value));
        if let Some(why) = cube.is_only_read() {
            row("to be read only", format!("{why}; to go on, render into a new cube"));
        }
        row("error estimate", describe_estimate(cube, progress, estimate));
        if header.has_uncertainty() {
            let epochs = epochs(cube, progress);
            let what = match epochs {
                0 | 1 => "of every pixel and channel once there are 2 epochs".to_owned(),
                n => format!(
                    "of every pixel and channel, from {n} epochs (Student's t, {} degrees of freedom)",
                    header.freedom(n)
                ),
            };
            row("standard error", what);
        }
        if !cube.layers().is_empty() {
            row("layers", self.layers().join(", "));
        }
        if let Some(choices) = &self.choices {
            row("wavelengths", choices.describe_wavelengths());
            row("evaluation", choices.describe());
        } else if self.is_pending() {
            row(
                "evaluation",
                "pending: samples decide which paths are evaluated, and at how many wavelengths, when the first device renders".into(),
            );
        }
        row("preview", shows(cube));
        row("on disk", format!("{} when all tiles are begun", crate::files::format_bytes(header.store_bytes())));
        if let Some(basis) = header.basis() {
            let names: Vec<&str> = basis.spectra.iter().filter(|leaf| leaf.is_named).map(|leaf| &*leaf.name).collect();
            let what = format!(
                "weights of products of {} factors and {} sources; spectile relight changes the spectra {}",
                basis.factors.len(),
                basis.sources.len(),
                if names.is_empty() { "(none has a name)".to_owned() } else { names.join(", ") }
            );
            row("factored", what);
        }
        if header.has_remainder() {
            let share = match &self.remainder {
                Some(_) if progress.samples[1] == 0 => "nothing is rendered yet".to_owned(),
                Some(share) => share.describe(cube.channels()),
                None => "an unknown share of the radiance: this is a copy".to_owned(),
            };
            row("remainder", format!("{share}; relight does not change {}", header.remainder().join(", ")));
        }
        // What has a line of its own above.
        let is_told = |name: &str| name == LAYERS || (header.is_factored() && name == FACTORED);
        let written = header.attributes.iter().filter(|(name, _)| !is_told(name));
        for (name, value) in written {
            row(name, value.as_str().map_or_else(|| value.to_string(), str::to_owned));
        }
        if let Some(verified) = &self.verified {
            row("verified", format!("{} files, {} damaged", verified.files, verified.damage.len()));
            verified.damage.iter().for_each(|what| row("damage", what.clone()));
        }
        text
    }
}

fn describe_channels(channels: &Channels) -> String {
    let from = channels.bounds.iter().map(|b| b[0]).fold(f64::INFINITY, f64::min);
    let to = channels.bounds.iter().map(|b| b[1]).fold(f64::NEG_INFINITY, f64::max);
    let widths = || (0..channels.len()).map(|k| channels.width(k));
    let (least, most) = (widths().fold(f64::INFINITY, f64::min), widths().fold(0.0, f64::max));
    let width = if most - least <= 1e-6 * most { format!("{most:.6}") } else { format!("{least:.6} to {most:.6}") };
    format!("{from} to {to} nm, channels {width} nm wide")
}

fn describe_samples(progress: &Progress) -> String {
    let [least, most] = progress.samples;
    let per_pixel = if least == most { format!("{most} per pixel") } else { format!("{least} to {most} per pixel") };
    match progress.tiles - progress.tiles_started {
        0 => per_pixel,
        missing if missing == progress.tiles => "none yet".into(),
        missing => format!("{per_pixel}; {missing} of {} tiles have none yet", progress.tiles),
    }
}

fn describe_estimate(cube: &Cube, progress: &Progress, estimate: &[f64]) -> String {
    if cube.is_derived() {
        return "unknown: made of the channels of another cube, whose errors belong together".into();
    }
    let epochs = epochs(cube, progress);
    if epochs < 2 {
        return format!("unknown before 2 epochs ({} samples per pixel)", 2 * cube.header().epoch);
    }
    let mut order: Vec<usize> = (0..estimate.len()).collect();
    order.sort_by(|&a, &b| estimate[a].total_cmp(&estimate[b]));
    let (median, worst) = (order[(order.len() - 1) / 2], order[order.len() - 1]);
    let rough = if epochs < ROUGH_BELOW { ", rough" } else { "" };
    format!(
        "{:.3} % in the median channel, {:.3} % in the worst ({}: {}), from {epochs} epochs{rough}",
        100.0 * estimate[median],
        100.0 * estimate[worst],
        worst,
        cube.channels().names[worst],
    )
}

/// What the preview shows, for people.
pub(super) fn shows(cube: &Cube) -> String {
    match cube.projection().kind {
        ProjectionKind::Xyz => "colours as seen (CIE 1931, sRGB)".into(),
        ProjectionKind::FalseColour(rgb) => {
            let [r, g, b] = rgb.map(|k| cube.channels().names[k].as_str());
            format!("false colours: {r} as red, {g} as green, {b} as blue")
        }
    }
}
