//! `spectile sensor`: what a sensor would see of a cube.

use std::path::PathBuf;

use serde_json::json;

use super::Output;
use crate::cube::{Cube, Existing, integrate};
use crate::files::shown;
use crate::format::response;
use crate::{Error, Result};

/// Integrate a cube with the responses of a sensor, after the fact
///
/// Every band of the sensor becomes a channel of a new cube: the mean of the radiance weighted by the band's response, in
/// W m-2 sr-1 nm-1. That is exact where the radiance is constant within each channel, also where channels and responses
/// overlap in part; so channels should be narrower than the responses are. Where they are too wide for a response to the
/// point that it matters, the error is estimated from the slope of the spectra and told. Bands that the cube does not cover
/// (99 % of their response) are left out, which is told too.
///
/// (`channels.responses` in a scene weights while rendering instead: fewer channels, and no error of this kind.)
#[derive(Debug, clap::Args)]
#[command(after_long_help = "\
Examples:
  spectile sensor cube.zarr --responses sentinel2.csv -o sentinel2.zarr

Responses are CSV: `wavelength_nm,red,green,blue`, a column a band; or long, with the header
`band,wavelength_nm,response`. Lines that begin with # are comments.")]
pub struct Args {
    /// The cube, a folder
    pub cube: PathBuf,

    /// The responses, a CSV file
    #[arg(long, value_name = "S.csv")]
    pub responses: PathBuf,

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

pub fn run(args: &Args, output: &Output) -> Result<()> {
    let cube = Cube::open(&args.cube)?;
    let responses = response::read_responses(&args.responses).map_err(|problem| Error::Input(vec![*problem]))?;
    for warning in &responses.warnings {
        output.warn(warning)?;
    }
    let is_itself = |a: &std::path::Path, b: &std::path::Path| {
        std::fs::canonicalize(a).ok().is_some_and(|a| std::fs::canonicalize(b).ok() == Some(a))
    };
    if is_itself(&args.cube, &args.output) {
        let what = "a cube cannot be integrated into itself; choose another name";
        return Err(Error::Usage(format!("{}: {what}", args.output.display())));
    }
    let about = args.responses.file_name().unwrap_or_default().to_string_lossy();
    let existing = if args.overwrite { Existing::Replace } else { Existing::Refuse };
    let findings = super::progress::watched(args.json, |progress| {
        integrate(&cube, &responses.named, &about, &args.output, existing, progress)
    })?;

    if !findings.left_out.is_empty() {
        let each: Vec<String> =
            findings.left_out.iter().map(|(name, share)| format!("{name} ({:.1} %)", 100.0 * share)).collect();
        output.warn(&format!("bands of which the cube does not cover 99 % are left out: {}", each.join(", ")))?;
    }
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
    let wide = |(name, error): &(String, Option<f64>)| json!({ "band": name, "relative_error": error });
    let left_out = |(name, share): &(String, f64)| json!({ "band": name, "covered": share });
    output.event(
        "done",
        json!({
            "cube": shown(&args.output),
            "bands": made.channels().names,
            "left_out": findings.left_out.iter().map(left_out).collect::<Vec<_>>(),
            "too_wide": findings.wide.iter().map(wide).collect::<Vec<_>>(),
        }),
    )?;
    output.text(&format!(
        "{}: {} bands of {}: {}\n",
        args.output.display(),
        made.channels().len(),
        about,
        made.channels().names.join(", ")
    ))
}
