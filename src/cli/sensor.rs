//! `spectile sensor`: what a sensor would see of a cube.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::Output;
use crate::cube::{Cube, Existing, integrate};
use crate::files::shown;
use crate::format::{plot, response};
use crate::scene::{Seen, load_sensor};
use crate::sensor::{Applied, Bands, Settings, TransferCurve, apply, curves};
use crate::{Error, Result};

/// What a sensor would see of a cube: integrated with responses, or as counts of a detector behind optics
///
/// With --responses every band of the sensor becomes a channel of a new cube: the mean of the radiance weighted by the band's response, in
/// W m-2 sr-1 nm-1. That is exact where the radiance is constant within each channel, also where channels and responses
/// overlap in part; so channels should be narrower than the responses are. Where they are too wide for a response to the
/// point that it matters, the error is estimated from the slope of the spectra and told. Bands that the cube does not cover
/// (99 % of their response) are left out, which is told too.
///
/// (`channels.responses` in a scene weights while rendering instead: fewer channels, and no error of this kind.)
///
/// With --model a file says what the optics and the detector are, and the result is the counts of every band, blurred by the optics, with
/// shot noise, reading noise and fixed patterns: a Zarr store for xarray and others, which `info`, `spectrum`, `compare`, `export` and
/// `view` read too, with SNR, NEDL and, where black bodies at the reference temperature are seen, NETD of every band among its
/// attributes. The same seed gives the same bytes. `sensors/` has models to begin with.
#[derive(Debug, clap::Args)]
#[command(after_long_help = "\
Examples:
  spectile sensor cube.zarr --responses sentinel2.csv -o sentinel2.zarr
  spectile sensor cube.zarr --model camera.toml -o counts.zarr --seed 1
  spectile sensor cube.zarr --model sensors/mwir-insb.toml -o counts.zarr --mtf-plot mtf.svg

Responses are CSV: `wavelength_nm,red,green,blue`, a column a band; or long, with the header
`band,wavelength_nm,response`. Lines that begin with # are comments.")]
pub struct Args {
    /// The cube, a folder
    pub cube: PathBuf,

    /// The responses, a CSV file
    #[arg(long, value_name = "S.csv", required_unless_present = "model", conflicts_with = "model")]
    pub responses: Option<PathBuf>,

    /// The model of a sensor, a TOML file with [optics], [detector] and bands
    #[arg(long, value_name = "SENSOR.toml")]
    pub model: Option<PathBuf>,

    /// Of the noise of this exposure; fixed patterns have the model's `pattern_seed`
    #[arg(long, default_value_t = 0, requires = "model", conflicts_with = "responses")]
    pub seed: u64,

    /// Noise and fixed patterns, or what the mean of many exposures of a perfect detector would be
    #[arg(long, value_enum, default_value_t = Noise::On, requires = "model", conflicts_with = "responses")]
    pub noise: Noise,

    /// Keep the signal without noise, background included, beside the counts: electrons, or W of a thermal detector
    #[arg(long, requires = "model", conflicts_with = "responses")]
    pub electrons: bool,

    /// Take a cube of which tiles are missing; their pixels get the fill value
    #[arg(long, requires = "model", conflicts_with = "responses")]
    pub partial: bool,

    /// Draw the transfer functions of optics and pixel too, as SVG, at the mean wavelength of every band
    ///
    /// An earlier plot of that name is replaced; nothing else is.
    #[arg(long, value_name = "FILE.svg", requires = "model", conflicts_with = "responses")]
    pub mtf_plot: Option<PathBuf>,

    /// The cube to make, a folder
    #[arg(short, long, value_name = "OUT.zarr")]
    pub output: PathBuf,

    /// Replace OUT.zarr if it exists
    ///
    /// Only a Spectile cube that nobody works on is ever replaced; any other folder or file is refused.
    #[arg(long)]
    pub overwrite: bool,

    /// One JSON object a line on stdout, instead of text
    #[arg(long)]
    pub json: bool,
}

/// Whether there is noise.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Noise {
    On,
    Off,
}

pub fn run(args: &Args, output: &Output) -> Result<()> {
    match (&args.model, &args.responses) {
        (Some(model), _) => expose(args, model, output),
        (None, Some(responses)) => integrate_with(args, responses, output),
        (None, None) => Err(Error::Usage("give --responses or --model".into())),
    }
}

/// What optics may leave of the finest waves, of contrast, without a word.
const MUCH: f64 = 0.1;

fn expose(args: &Args, file: &Path, output: &Output) -> Result<()> {
    let cube = Cube::open_to_read(&args.cube)?;
    let model = load_sensor(file, cube.channels(), Seen { pixel_tangent: cube.header().pixel_tangent() })?;
    for warning in &model.warnings {
        output.warn(warning)?;
    }
    let settings = Settings {
        seed: args.seed,
        noise: args.noise == Noise::On,
        electrons: args.electrons,
        partial: args.partial,
        overwrite: args.overwrite,
        about: file.file_name().unwrap_or_default().to_string_lossy().into_owned(),
    };
    if let Some(path) = &args.mtf_plot {
        plot::MTF_PLOT.check_target(path)?;
    }
    let Applied { bands, left_out, negative, pixels, at_nyquist, noisy } =
        super::progress::watched(output, |progress| apply(&cube, &model, &settings, &args.output, progress))?;
    warn_left_out(&left_out, output)?;
    if negative > 0 {
        let what = "which the noise of the cube makes, or a blur at sharp edges, are taken as 0";
        output.warn(&format!("{negative} negative signals, {what}"))?;
    }
    if at_nyquist > MUCH && model.oversampling == 1 {
        output.warn(&format!(
            "the optics leave {:.0} % of the contrast of the finest waves that the cube's pixels hold: detail that the detector sees \
             between pixels is missing; render with smaller pixels, and set detector.oversampling",
            100.0 * at_nyquist
        ))?;
    }
    for (band, share) in &noisy {
        output.warn(&format!(
            "{band}: the noise of the cube itself is about {share:.2} of the sensor's at the picture's mean; render more samples"
        ))?;
    }
    let mut text = format!("{}: counts of {} bands of {}\n", args.output.display(), bands.len(), settings.about);
    let mut each = Vec::new();
    for band in &bands {
        let (figures, clipped) = (&band.figures, &band.clipped);
        text += &format!("  {}: SNR {:.4}, NEDL {:.4e} W m-2 sr-1 nm-1", band.name, figures.snr, figures.nedl);
        if let Some(netd) = figures.netd {
            text += &format!(", NETD {netd:.4} K at {} K", model.reference_temperature);
        }
        text += "\n";
        let share = |count: u64| 100.0 * count as f64 / pixels as f64;
        for (count, what) in [
            (clipped.full_wells, "have full wells"),
            (clipped.above, "are above the converter's range"),
            (clipped.below, "are below the converter's range"),
        ] {
            if count > 0 {
                output.warn(&format!("{}: {count} pixels ({:.2} %) {what}", band.name, share(count)))?;
            }
        }
        each.push(json!({
            "band": band.name,
            "snr_at_mean": figures.snr,
            "nedl": figures.nedl,
            "netd_k": figures.netd,
            "mean_signal": band.mean_signal,
            "full_wells": clipped.full_wells,
            "clipped_above": clipped.above,
            "clipped_below": clipped.below,
        }));
    }
    if let Some(path) = &args.mtf_plot {
        let bands = Bands::new(&model, cube.channels()).bands;
        let lines: Vec<plot::Line> = curves(&model, &bands)
            .into_iter()
            .map(|TransferCurve { name, points, is_guide }| plot::Line { name, points, guide: is_guide })
            .collect();
        let title = format!("{}: F/{}, pixels of {} um", settings.about, model.optics.f_number, 1e6 * model.pitch);
        plot::MTF_PLOT.write(path, plot::mtf(&title, &lines)?.as_bytes())?;
    }
    let left_out: Vec<_> = left_out.iter().map(|(name, share)| json!({ "band": name, "covered": share })).collect();
    output.event("done", json!({ "cube": shown(&args.output), "bands": each, "left_out": left_out }))?;
    output.text(&text)
}

fn warn_left_out(left_out: &[(String, f64)], output: &Output) -> Result<()> {
    if left_out.is_empty() {
        return Ok(());
    }
    let each: Vec<String> = left_out.iter().map(|(name, share)| format!("{name} ({:.1} %)", 100.0 * share)).collect();
    output.warn(&format!("bands of which the cube does not cover 99 % are left out: {}", each.join(", ")))
}

/// Refuses a cube that would take its own place.
pub(super) fn refuse_itself(cube: &Path, output: &Path, done: &str) -> Result<()> {
    let there = std::fs::canonicalize(cube).ok();
    match there.is_some_and(|there| std::fs::canonicalize(output).ok() == Some(there)) {
        true => {
            let what = format!("a cube cannot be {done} into itself; choose another name");
            Err(Error::Usage(format!("{}: {what}", output.display())))
        }
        false => Ok(()),
    }
}

fn integrate_with(args: &Args, file: &Path, output: &Output) -> Result<()> {
    let cube = Cube::open_to_read(&args.cube)?;
    let responses = response::read_responses(file).map_err(|problem| Error::Input(vec![*problem]))?;
    for warning in &responses.warnings {
        output.warn(warning)?;
    }
    refuse_itself(&args.cube, &args.output, "integrated")?;
    let about = file.file_name().unwrap_or_default().to_string_lossy();
    let existing = if args.overwrite { Existing::Replace } else { Existing::Refuse };
    let findings = super::progress::watched(output, |progress| {
        integrate(&cube, &responses.named, &about, &args.output, existing, progress)
    })?;

    warn_left_out(&findings.left_out, output)?;
    if !findings.wide.is_empty() {
        let each: Vec<String> = findings
            .wide
            .iter()
            .map(|(name, error)| match error {
                Some(error) => format!("{name} ({:.2} %)", 100.0 * error),
                None => format!("{name} (unknown: no neighbouring channels)"),
            })
            .collect();
        output.warn(&format!(
            "the cube's channels are too wide for some bands; estimated error, root mean square: {}",
            each.join(", ")
        ))?;
    }
    let made = Cube::open(&args.output)?;
    let [missing, tiles] = made.progress()?.tiles_missing();
    let wide = |(name, error): &(String, Option<f64>)| json!({ "band": name, "relative_error": error });
    let left_out = |(name, share): &(String, f64)| json!({ "band": name, "covered": share });
    output.event(
        "done",
        json!({
            "cube": shown(&args.output),
            "bands": made.channels().names,
            "left_out": findings.left_out.iter().map(left_out).collect::<Vec<_>>(),
            "too_wide": findings.wide.iter().map(wide).collect::<Vec<_>>(),
            "tiles_missing": missing,
        }),
    )?;
    output.text(&format!(
        "{}: {} bands of {}: {}\n",
        args.output.display(),
        made.channels().len(),
        about,
        made.channels().names.join(", ")
    ))?;
    match missing {
        0 => Ok(()),
        _ => output.text(&format!("{missing} of {tiles} tiles have no samples yet\n")),
    }
}
