//! Arguments → job → exit code; one file per subcommand.

mod array;
mod bands;
mod bench;
mod call;
mod compare;
mod converge;
mod counts;
mod devices;
mod export;
mod help;
mod import;
mod info;
mod interrupt;
mod output;
mod plan;
mod program;
mod progress;
mod relight;
mod render;
mod scene;
mod sensor;
mod sinks;
mod sky;
mod spectrum;
mod stress;
mod submit;
mod tile_states;
mod view;

use clap::{Parser, Subcommand};

use crate::Result;

pub use call::{Host, call, catch};
pub use output::Output;
pub use program::{program, program_of_script};

/// Spectral image renderer: the radiance of a scene in hundreds or thousands of channels.
#[derive(Debug, Parser)]
#[command(
    name = "spectile",
    version,
    max_term_width = 110,
    arg_required_else_help = true,
    disable_help_subcommand = true,
    long_about = "Spectile renders spectral images: for every pixel, the radiance of a scene in K channels of \
        wavelength, anywhere from 380 to 20,000 nm. The result is a cube: a Zarr v3 store that xarray and zarr open, \
        also while it is being rendered.",
    after_help = "`spectile COMMAND --help` explains a command with examples.",
    after_long_help = "\
Examples:
  spectile render scene.toml -o cube.zarr --spp 256     render 256 samples per pixel
  spectile sky --sun-elevation 40 -o sky.zarr           a clear sky, as an environment map
  spectile submit scene.toml -o cube.zarr --spp 256     the same on a Slurm cluster
  spectile info cube.zarr                               how far it got, how large the error is
  spectile spectrum cube.zarr 120 80                    the spectrum of one pixel, as CSV
  spectile export cube.zarr -o picture.png              a picture of it
  spectile sensor cube.zarr --responses s.csv -o s.zarr what a sensor would see of it
  spectile relight cube.zarr -o warm.zarr --set …       a factored cube under other lamps, paints, channels
  spectile view cube.zarr                               a page to look at it
  spectile compare cube.zarr reference.zarr             how it differs from another cube
  spectile converge scene.toml -o report                error against run time, as a report
  spectile bench -o report                              evaluators side by side, as a report
  spectile stress                                       stiff and extreme cases against their answers
  spectile import scene.xml -o folder                   a scene of Mitsuba, pbrt or glTF as one of Spectile's
  spectile help scene                                   every section and key of a scene file

Radiance is in W m-2 sr-1 nm-1, wavelengths are in nm (vacuum), pixels are counted from 0 at the top left.

Exit codes:
  0  done                               3  no usable device
  1  a comparison or check failed       4  all devices were lost
  2  bad input or arguments             5  storage cannot be read or written"
)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Render(render::Args),
    Sky(sky::Args),
    Submit(submit::Args),
    Plan(plan::Args),
    Devices(devices::Args),
    Import(import::Args),
    Info(info::Args),
    Spectrum(spectrum::Args),
    Compare(compare::Args),
    Export(export::Args),
    Sensor(sensor::Args),
    Relight(relight::Args),
    View(view::Args),
    Converge(converge::Args),
    Bench(bench::Args),
    Stress(stress::Args),
    Help(help::Args),
    /// A task of an array job (written into the batch script by `submit`)
    #[command(hide = true)]
    ArrayTask(array::Args),
    /// The finaliser of an array job (submitted by `submit`)
    #[command(hide = true)]
    ArrayEnd(array::Args),
    /// Whether a node sees cube and scene (run there by `submit`)
    #[command(hide = true)]
    ArrayProbe(array::Args),
}

impl Cli {
    /// Whether stdout carries JSON.
    pub fn json(&self) -> bool {
        match &self.command {
            Command::Render(args) => args.json,
            Command::Sky(args) => args.json,
            Command::Plan(args) => args.json,
            Command::Devices(args) => args.json,
            Command::Import(args) => args.json,
            Command::Info(args) => args.json,
            Command::Compare(args) => args.json,
            Command::Export(args) => args.json,
            Command::Sensor(args) => args.json,
            Command::Relight(args) => args.json,
            Command::View(args) => args.json,
            Command::Converge(args) => args.json,
            Command::Bench(args) => args.json,
            Command::Stress(args) => args.json,
            Command::Submit(args) => args.json,
            Command::Spectrum(_) | Command::Help(_) => false,
            Command::ArrayTask(_) | Command::ArrayEnd(_) | Command::ArrayProbe(_) => false,
        }
    }

    /// Does what the arguments ask for.
    pub fn run(&self, output: &Output) -> Result<()> {
        match &self.command {
            Command::Render(args) => render::run(args, output),
            Command::Sky(args) => sky::run(args, output),
            Command::Plan(args) => plan::run(args, output),
            Command::Devices(args) => devices::run(args, output),
            Command::Import(args) => import::run(args, output),
            Command::Info(args) => info::run(args, output),
            Command::Spectrum(args) => spectrum::run(args, output),
            Command::Compare(args) => compare::run(args, output),
            Command::Export(args) => export::run(args, output),
            Command::Sensor(args) => sensor::run(args, output),
            Command::Relight(args) => relight::run(args, output),
            Command::View(args) => view::run(args, output),
            Command::Converge(args) => converge::run(args, output),
            Command::Bench(args) => bench::run(args, output),
            Command::Stress(args) => stress::run(args, output),
            Command::Help(args) => help::run(args, output),
            Command::Submit(args) => submit::run(args, output),
            Command::ArrayTask(args) => array::task(args, output),
            Command::ArrayEnd(args) => array::end(args),
            Command::ArrayProbe(args) => array::probe(args),
        }
    }
}

/// An exposure in EV: any finite number.
fn parse_exposure(text: &str) -> std::result::Result<f64, String> {
    match text.parse::<f64>() {
        Ok(ev) if ev.is_finite() => Ok(ev),
        _ => Err("an exposure is a number of EV, such as 2 or -0.5".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_are_declared_without_contradiction() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }
}
