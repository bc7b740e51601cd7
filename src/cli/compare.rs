//! `spectile compare`: how a cube differs from a reference.

use std::fmt::Write;
use std::path::PathBuf;

use serde_json::{Value, json};

use super::Output;
use crate::cube::{Comparison, Cube, compare};
use crate::files::shown;
use crate::{Error, Result};

/// Compare a cube with a reference, channel by channel
///
/// For every channel, over all pixels: bias = mean of A - B; RMSE = root of the mean of (A - B)²; both in W m-2 sr-1
/// nm-1; and relMSE = mean of (A - B)² / (B² + e) with e = (0.01 x mean of B)², which counts dark and bright pixels
/// alike and has no unit. A renderer's noise shows in RMSE and relMSE, a mistake also in the bias.
///
/// Where a cube was rendered with --uncertainty, z is the difference of the means in units of its standard error (within -2
/// and 2 in 95 % of all cases if nothing but noise differs) and z_rms that of single pixels, root mean square (then 1).
///
/// Counts of a sensor (`sensor --model`) are compared with counts, band by band, without a unit.
///
/// Size and channels must agree, tiles need not. Pixels that one of the cubes has not rendered yet are left out, which is
/// said. Of many channels, those ten with the largest relMSE are shown; --all shows all, and so does --json.
#[derive(Debug, clap::Args)]
#[command(after_long_help = "\
Examples:
  spectile compare cube.zarr reference.zarr
  spectile compare cube.zarr reference.zarr --tolerance 1e-3 || echo differs")]
pub struct Args {
    /// The cube in question
    pub a: PathBuf,

    /// The reference
    pub b: PathBuf,

    /// Fail, with exit code 1, if the largest relMSE of any channel exceeds this
    ///
    /// Cubes that have not rendered every pixel fail as well.
    #[arg(long, value_name = "RELMSE", value_parser = parse_tolerance, allow_negative_numbers = true)]
    pub tolerance: Option<f64>,

    /// Show every channel, not only the ten that differ most
    #[arg(long)]
    pub all: bool,

    /// One JSON object on stdout, instead of a table
    #[arg(long)]
    pub json: bool,
}

pub fn run(args: &Args, output: &Output) -> Result<()> {
    let (cube, reference) = (Cube::open_picture(&args.a)?, Cube::open_picture(&args.b)?);
    let comparison = compare(&cube, &reference)?;
    let verdict = args.tolerance.map(|tolerance| judge(&comparison, tolerance));
    output.event("done", facts(args, &cube, &comparison, verdict.as_ref().map(|v| v.is_ok())))?;
    output.text(&table(&cube, &comparison, args.all))?;
    verdict.unwrap_or(Ok(()))
}

fn judge(comparison: &Comparison, tolerance: f64) -> Result<()> {
    let Comparison { pixels, pixels_in_all, .. } = comparison;
    if pixels < pixels_in_all {
        let what = format!("only {pixels} of {pixels_in_all} pixels are rendered in both cubes");
        return Err(Error::Check(format!("{what}, so they cannot pass --tolerance")));
    }
    let (channel, largest) = comparison.worst();
    // A NaN is not within any tolerance.
    if largest <= tolerance {
        return Ok(());
    }
    Err(Error::Check(format!("relMSE {largest:.3e} of channel {channel} exceeds the tolerance {tolerance:e}")))
}

fn mean_rel_mse(comparison: &Comparison) -> f64 {
    comparison.channels.iter().map(|c| c.rel_mse).sum::<f64>() / comparison.channels.len() as f64
}

fn facts(args: &Args, cube: &Cube, comparison: &Comparison, passed: Option<bool>) -> Value {
    let (worst, largest) = comparison.worst();
    let each = comparison.channels.iter().enumerate().map(|(k, c)| {
        json!({
            "wavelength_nm": cube.channels().centre(k),
            "mean": c.mean,
            "reference_mean": c.reference_mean,
            "bias": c.bias,
            "rmse": c.rmse,
            "rel_mse": c.rel_mse,
            "z": c.z.map(|z| z.mean),
            "z_rms": c.z.map(|z| z.rms),
        })
    });
    json!({
        "cube": shown(&args.a),
        "reference": shown(&args.b),
        "pixels": comparison.pixels,
        "pixels_in_all": comparison.pixels_in_all,
        "rel_mse": { "mean": mean_rel_mse(comparison), "largest": largest, "channel": worst },
        "tolerance": args.tolerance,
        "passed": passed,
        "channels": each.collect::<Vec<_>>(),
    })
}

/// Channels that are shown unless all are asked for.
const SHOWN: usize = 10;

fn table(cube: &Cube, comparison: &Comparison, all: bool) -> String {
    let has_z = comparison.channels.iter().any(|c| c.z.is_some());
    let mut text = format!(
        "{:>7} {:>14} {:>13} {:>13} {:>13} {:>13}{}\n",
        "channel",
        "wavelength_nm",
        "mean_B",
        "bias",
        "RMSE",
        "relMSE",
        if has_z { format!(" {:>9} {:>9}", "z", "z_rms") } else { String::new() }
    );
    let count = comparison.channels.len();
    let mut shown: Vec<usize> = (0..count).collect();
    if !all && count > SHOWN {
        // What is not a number differs most of all.
        shown.sort_by(|&a, &b| comparison.channels[b].rel_mse.total_cmp(&comparison.channels[a].rel_mse));
        shown.truncate(SHOWN);
        shown.sort_unstable();
    }
    for &k in &shown {
        let (c, nm) = (&comparison.channels[k], cube.channels().centre(k));
        let (mean, bias, rmse, rel_mse) = (c.reference_mean, c.bias, c.rmse, c.rel_mse);
        // Writing to a string cannot fail.
        let _ = write!(text, "{k:>7} {nm:>14.4} {mean:>13.5e} {bias:>13.5e} {rmse:>13.5e} {rel_mse:>13.5e}");
        if let Some(z) = c.z {
            let _ = write!(text, " {:>9.3} {:>9.3}", z.mean, z.rms);
        }
        text.push('\n');
    }
    let ((worst, largest), mean) = (comparison.worst(), mean_rel_mse(comparison));
    let Comparison { pixels, pixels_in_all, .. } = comparison;
    if shown.len() < count {
        let _ = writeln!(text, "the {SHOWN} of {count} channels with the largest relMSE; --all shows all");
    }
    let left_out = match pixels_in_all - pixels {
        0 => String::new(),
        missing => format!("; {missing} pixels left out, not rendered in both yet"),
    };
    let _ = writeln!(text, "relMSE: {mean:.5e} in the mean, {largest:.5e} at most (channel {worst}){left_out}");
    text
}

fn parse_tolerance(text: &str) -> std::result::Result<f64, String> {
    match text.parse::<f64>() {
        Ok(tolerance) if tolerance >= 0.0 => Ok(tolerance),
        _ => Err("a tolerance is a relMSE from 0, such as 1e-3".into()),
    }
}
