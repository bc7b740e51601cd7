//! `spectile relight`: other lamps, paints, temperatures and channels for a factored cube.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::Output;
use super::scene::parse_override;
use super::sensor::refuse_itself;
use crate::cube::{self, Cube, Existing, Expand, NewCube, Processor, Relighted};
use crate::files::shown;
use crate::gpu::adapter::Selection;
use crate::render::expand::Devices;
use crate::scene::{self, Files, NewChannels, Relit};
use crate::{Error, Result};

/// A cube under other lamps, paints, temperatures or channels, without rendering it again
///
/// CUBE was made with `spectile render --factored`: it holds numbers that know no wavelength, by which spectra are multiplied. So
/// other spectra and channels make another cube in seconds, with no other error than the noise that the numbers have. What has a name
/// under [spectra] in the scene can be changed, in any form that a scene file allows: `--set spectra.lamp.blackbody=6500`, `--set
/// spectra.paint='{ file = "paint.csv" }'`; a key below a spectrum changes what the cube has (`spectra.lamp.scale=2` makes it twice
/// as bright). Temperatures of materials, too: `--set materials.wall.temperature=310`. Files are looked for from where you are.
///
/// Geometry, which material is where, lights that were not there: all that needs paths is refused. The cube gets standard errors where
/// CUBE was rendered with --uncertainty. Noise is that of the paths: where other lamps or paints give weight to paths that hardly
/// mattered before, it is larger, which is told.
///
/// What of the scene does not separate (metals, glass, plastic, matter, maps …) is added as it was rendered, and how much of the picture
/// that is is told. It is known in the channels that were rendered, so that others must be unions of these, or go without it.
#[derive(Debug, clap::Args)]
#[command(after_long_help = "\
Examples:
  spectile render scene.toml -o room.zarr --factored --spp 1024
  spectile relight room.zarr -o evening.zarr --set spectra.lamp.blackbody=2700
  spectile relight room.zarr -o fine.zarr --channels equal.count=2000
  spectile relight room.zarr -o camera.zarr --responses camera.csv")]
pub struct Args {
    /// The factored cube, a folder
    pub cube: PathBuf,

    /// What changes: a key such as spectra.NAME or materials.NAME.temperature, and its value as in a scene file (repeatable)
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = parse_override)]
    pub sets: Vec<(String, String)>,

    /// Other channels: those of a scene, or keys of [channels] set, such as equal.count=1000 (repeatable)
    #[arg(long, value_name = "SCENE.toml|KEY=VALUE", conflicts_with = "responses")]
    pub channels: Vec<String>,

    /// Channels that are the bands of a sensor, a CSV file: means weighted by each response, exact in wavelength
    #[arg(long, value_name = "S.csv")]
    pub responses: Option<PathBuf>,

    /// Leave out what does not separate, so that any channels can be had; how much that is stands in the cube's attributes
    #[arg(long)]
    pub without_remainder: bool,

    /// Make radiance on devices instead of the processor's cores: all, a number, or positions as `spectile devices` lists them
    ///
    /// As for `render`. Sums are made in the same order, but a device may round otherwise: values differ in their last bits.
    #[arg(long, value_name = "all|N|LIST")]
    pub devices: Option<Selection>,

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
    let cube = Cube::open_to_read(&args.cube)?;
    refuse_itself(&args.cube, &args.output, "relit")?;
    let basis = cube.basis()?;
    let keys: Vec<(String, String)> =
        args.channels.iter().filter_map(|channels| parse_override(channels).ok()).collect();
    let wanted = match (&args.responses, &args.channels[..]) {
        (Some(file), _) => NewChannels::Responses(file),
        (None, []) => NewChannels::Same,
        (None, all) if keys.len() == all.len() => NewChannels::Set(&keys),
        (None, [file]) => NewChannels::Scene(Path::new(file)),
        (None, _) => return Err(Error::Usage("--channels: give one scene, or keys such as equal.count=1000".into())),
    };
    let (remainder, beside) = (cube.header().remainder(), cube.header().spectra_of_remainder());
    let rendered = scene::Rendered { basis: &basis, channels: cube.channels(), remainder: &remainder, beside: &beside };
    let relit = scene::relight(rendered, &args.sets, wanted, Files::Disk)?;
    for warning in &relit.warnings {
        output.warn(warning)?;
    }
    let existing = if args.overwrite { Existing::Replace } else { Existing::Refuse };
    let devices = args.devices.as_ref().map(Devices::open).transpose()?;
    let found = super::progress::watched(output, |progress| {
        let new = NewCube {
            basis: &relit.basis,
            channels: &relit.channels,
            changed: &relit.changed,
            without_remainder: args.without_remainder,
            by: devices.as_ref().map_or(&Processor as &dyn Expand, |devices| devices),
        };
        cube::relight(&cube, new, &args.output, existing, progress)
    })?;
    warn_of_remainder(&cube, &relit, args.without_remainder, &found, output)?;
    let known = found.error_estimate.iter().copied().filter(|error| !error.is_nan());
    let largest = known.fold(None, |most: Option<f64>, error| Some(most.map_or(error, |most| most.max(error))));
    let mut text = format!("{}: {} channels", args.output.display(), relit.channels.len());
    text += &match relit.changed.len() {
        0 => ", spectra as they were".to_owned(),
        _ => format!(", changed: {}", relit.changed.join(", ")),
    };
    text += &match largest {
        Some(error) => format!("; error estimate at most {:.3} %\n", 100.0 * error),
        None => "; error unknown below two epochs\n".to_owned(),
    };
    output.event(
        "done",
        json!({
            "cube": shown(&args.output),
            "channels": relit.channels.len(),
            "changed": relit.changed,
            "error_estimate": largest,
            "remainder_share": found.remainder.as_ref().map(|share| share.of_channels()),
            "entries_per_pixel": found.entries as f64 / found.pixels.max(1) as f64,
            "expand_s": found.expand_s,
            "devices": devices.as_ref().map(Devices::names),
        }),
    )?;
    output.text(&text)
}

/// Says what of the picture is not as it was asked for.
fn warn_of_remainder(cube: &Cube, relit: &Relit, left_out: bool, found: &Relighted, output: &Output) -> Result<()> {
    let words = cube.header().remainder();
    if words.is_empty() {
        return Ok(());
    }
    let words = words.join(", ");
    match &found.remainder {
        Some(share) if !relit.changed.is_empty() => output.warn(&format!(
            "{}, does not separate and is as it was rendered: {words}",
            share.describe(&relit.channels)
        )),
        None if left_out => {
            let share = cube.remainder_share()?.map(|share| share.describe(cube.channels()));
            let share = share.unwrap_or_else(|| "an unknown share of the radiance".to_owned());
            output.warn(&format!("as rendered {share}, does not separate and is left out: {words}"))
        }
        _ => Ok(()),
    }
}
