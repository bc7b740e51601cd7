//! `spectile converge`: error against run time.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use serde_json::json;

use super::Output;
use super::render::parse_time;
use super::scene::SceneArgs;
use crate::cube::Cube;
use crate::files::shown;
use crate::gpu::adapter::{Gpu, Selection};
use crate::render::interrupt::Interrupt;
use crate::render::plan;
use crate::report::converge::{Curve, Report};
use crate::report::convergence::{Limit, Reference, measure, render};
use crate::report::{Circumstances, make_folder, write};
use crate::scene::Scene;
use crate::spectral::Channels;
use crate::{Error, Result};

/// A reference has so many times the budget of a curve.
const REFERENCE_BUDGETS: u32 = 4;

/// Measure how the error falls with time, and write a report
///
/// Renders SCENE again and again until the budget is spent, compares every epoch with a reference, and writes DIR/converge.csv,
/// .json and .html: curves of relMSE and error against seconds and samples, their slopes, the renderer's own estimate against the
/// true error, errors at equal times, and times to an error. With --vary there is one curve for each combination of values.
///
/// The reference is a cube, taken as exact, or a render of four budgets with another seed, whose own noise is subtracted. The
/// files are complete after every epoch; Ctrl-C leaves what has been measured.
///
/// Everything is held in memory, about 40 bytes x pixels x channels: choose a --size that fits.
#[derive(Debug, clap::Args)]
#[command(after_long_help = "\
Examples:
  spectile converge scene.toml -o report
  spectile converge scene.toml -o report --budget 5m --size 128x128
  spectile converge scene.toml -o report --vary integrator.wavelengths=uniform,emission --vary channels.equal.count=8,40,400
  spectile converge scene.toml -o report --reference long.zarr")]
pub struct Args {
    #[command(flatten)]
    pub scene: SceneArgs,

    /// The folder of the report
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,

    /// Time of rendering for each curve, e.g. 30s or 5m
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = parse_time)]
    pub budget: Duration,

    /// Samples per pixel at which a curve ends, if its budget is not spent before
    #[arg(long, value_name = "N", default_value_t = u32::MAX, hide_default_value = true, value_parser = clap::value_parser!(u32).range(1..))]
    pub spp: u32,

    /// A curve for each value of a key of the scene, as for --set (repeatable: all combinations)
    #[arg(long, value_name = "KEY=A,B,…", value_parser = parse_vary)]
    pub vary: Vec<(String, Vec<String>)>,

    /// A cube of this scene that is taken as exact, instead of a render of its own
    #[arg(long, value_name = "CUBE")]
    pub reference: Option<PathBuf>,

    /// Seed of the curves; references have the next one
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,

    /// The device, as for `render`; the first of several is used
    #[arg(long, value_name = "all|N|LIST", default_value = "all")]
    pub devices: Selection,

    /// One JSON object a line on stdout, instead of text
    #[arg(long)]
    pub json: bool,
}

pub fn run(args: &Args, output: &Output) -> Result<()> {
    let interrupt = output.interrupt()?;
    let scenes = scenes(args)?;
    make_folder(&args.output, "converge")?;
    let gpu = Arc::new(Gpu::open_all(&args.devices)?.remove(0));
    let file = args.scene.scene.display().to_string();
    let mut report = Report { scene: file, circumstances: Circumstances::now(&gpu), curves: Vec::new() };
    output.event("start", json!({ "scene": shown(&args.scene.scene), "curves": scenes.len(), "device": gpu.name }))?;
    let mut references: Vec<(&Channels, Reference)> = Vec::new();
    for (name, scene) in &scenes {
        let channels = &scene.channels;
        if references.iter().all(|(known, _)| *known != channels) {
            references.push((channels, reference(args, scene, &gpu, &interrupt, output)?));
        }
        let (_, reference) = references.iter().find(|(known, _)| *known == channels).expect("just seen to");
        report.curves.push(Curve {
            name: name.clone(),
            centres: (0..channels.len()).map(|k| channels.centre(k)).collect(),
            reference: reference.what.clone(),
            points: Vec::new(),
        });
        let limit = Limit { time: args.budget, samples: args.spp };
        measure(scene, args.seed, &gpu, limit, &interrupt, reference, |point| {
            let curve = report.curves.last_mut().expect("just pushed");
            let (samples, seconds, rel_mse) = (point.samples, point.seconds, point.mean_rel_mse());
            output.say(&format!("{name}: {samples} samples/pixel, {seconds:.1} s, mean relMSE {rel_mse:.3e}"));
            curve.points.push(point);
            write(&args.output, "converge", &report.csv(), &report.json(), &report.html()?)
        })?;
    }
    output.event("done", json!({ "report": report.json(), "folder": shown(&args.output) }))?;
    output.text(&format!("{}{}\n", report.summary(), args.output.join("converge.html").display()))
}

/// What curves in the channels of `scene` are compared with: the cube that was given, or a render of its own.
fn reference(
    args: &Args,
    scene: &Scene,
    gpu: &Arc<Gpu>,
    interrupt: &Arc<Interrupt>,
    output: &Output,
) -> Result<Reference> {
    output.say(&format!("reference for {} channels", scene.channels.len()));
    if let Some(path) = &args.reference {
        return Reference::of_cube(&Cube::open_to_read(path)?, scene);
    }
    // Its noise is known from two epochs on.
    let least = 2 * scene.integrator.epoch;
    let time = args.budget * REFERENCE_BUDGETS;
    let limit = Limit { time, samples: args.spp.saturating_mul(REFERENCE_BUDGETS).max(least) };
    let image = render(scene, args.seed + 1, None, gpu, limit, interrupt, |_, _| Ok(()))?;
    if image.samples < least {
        return Err(Error::Usage(format!(
            "the reference got {} samples per pixel in {:.0} s, and its noise is known from {least} on: give a larger --budget \
             or a smaller --size",
            image.samples,
            time.as_secs_f64()
        )));
    }
    Ok(Reference::of_image(&image))
}

/// The scene with every combination of what varies, and names that tell them apart.
fn scenes(args: &Args) -> Result<Vec<(String, Scene)>> {
    let mut combinations: Vec<Vec<(String, String)>> = vec![Vec::new()];
    for (key, values) in &args.vary {
        let with = |value: &String| {
            combinations.iter().map(move |c| [&c[..], &[(key.clone(), value.clone())]].concat()).collect::<Vec<_>>()
        };
        combinations = values.iter().flat_map(with).collect();
    }
    let load = |combination: Vec<(String, String)>| {
        let short = |(key, value): &(String, String)| format!("{} {value}", key.rsplit('.').next().unwrap_or(key));
        let name = combination.iter().map(short).collect::<Vec<_>>().join(", ");
        let scene = args.scene.with(combination)?;
        plan::check(&scene)?;
        Ok((if name.is_empty() { "as it is".into() } else { name }, scene))
    };
    combinations.into_iter().map(load).collect()
}

/// KEY=A,B,… with at least one value.
fn parse_vary(text: &str) -> std::result::Result<(String, Vec<String>), String> {
    let explain = || "what varies is KEY=A,B, such as integrator.sampler=sobol,independent".to_owned();
    let (key, values) = text.split_once('=').ok_or_else(explain)?;
    let values: Vec<String> = values.split(',').map(|v| v.trim().to_owned()).filter(|v| !v.is_empty()).collect();
    if key.trim().is_empty() || values.is_empty() { Err(explain()) } else { Ok((key.trim().to_owned(), values)) }
}

#[cfg(test)]
mod tests {
    use super::parse_vary;

    #[test]
    fn what_varies_has_a_key_and_values() {
        let expected = ("integrator.sampler".to_owned(), vec!["sobol".to_owned(), "independent".to_owned()]);
        assert_eq!(parse_vary("integrator.sampler = sobol, independent"), Ok(expected));
        for bad in ["", "key", "key=", "=a", "key=,"] {
            assert!(parse_vary(bad).unwrap_err().contains("KEY=A,B"), "{bad}");
        }
    }
}
