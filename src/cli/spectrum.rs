//! `spectile spectrum`: one pixel of a cube.

use std::path::PathBuf;

use super::Output;
use crate::cube::Cube;
use crate::format::{plot, text};
use crate::{Error, Result};

/// Print the spectrum of one pixel as CSV
///
/// A header, then one line a channel, in the order of the cube: the centre of the channel in nm and its mean spectral
/// radiance in W m-2 sr-1 nm-1, with as many digits as bring back the stored number exactly. Cubes rendered with
/// --uncertainty have a third column, the standard error (NaN below two epochs); a plot shows the values plus and minus
/// two of them. Of counts of a sensor (`sensor --model`) the second column is called counts.
#[derive(Debug, clap::Args)]
#[command(after_long_help = "\
Examples:
  spectile spectrum cube.zarr 120 80 > pixel.csv
  spectile spectrum cube.zarr 120 80 --plot pixel.svg")]
pub struct Args {
    /// The cube, a folder
    pub cube: PathBuf,

    /// Column, from 0 at the left
    #[arg(allow_negative_numbers = true)]
    pub x: u32,

    /// Row, from 0 at the top
    #[arg(allow_negative_numbers = true)]
    pub y: u32,

    /// Draw the spectrum too, as SVG: every channel a level over its own interval
    ///
    /// An earlier plot of that name is replaced; nothing else is.
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,
}

/// A text as it is.
struct Plain<'a>(&'a str);

impl std::fmt::Debug for Plain<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.0)
    }
}

pub fn run(args: &Args, output: &Output) -> Result<()> {
    if let Some(path) = &args.plot {
        plot::PLOT.check_target(path)?;
        if plot::PLOT.is_standard_output(path) {
            let what = "--plot: the values go to the standard output; give the plot a file of its own";
            return Err(Error::Usage(what.into()));
        }
    }
    let cube = Cube::open_picture(&args.cube)?;
    if cube.is_counts() && args.plot.is_some() {
        let what = "holds counts of a sensor: --plot draws radiance";
        return Err(Error::Usage(format!("{} {what}", args.cube.display())));
    }
    let Some(spectrum) = cube.spectrum(args.x, args.y)? else {
        let what = format!("pixel {} {} has no samples yet; try again when its tile is rendered", args.x, args.y);
        return Err(Error::Usage(format!("{}: {what}", args.cube.display())));
    };
    let errors = cube.standard_error(args.x, args.y)?;
    if let Some(path) = &args.plot {
        let samples = cube.samples(cube.grid().tile_at(args.x, args.y))?;
        let title = format!("{}, column {}, row {}, {samples} samples", args.cube.display(), args.x, args.y);
        let plot = plot::spectrum(cube.channels(), &spectrum, errors.as_deref(), &title)?;
        plot::PLOT.write(path, plot.as_bytes())?;
    }
    if cube.is_counts() {
        // Whole numbers, without `.0`; what is missing is NaN, as errors are.
        let counts: Vec<String> = spectrum.iter().map(f32::to_string).collect();
        let plain: Vec<Plain> = counts.iter().map(|count| Plain(count)).collect();
        return output.text(&text::values_csv("counts", cube.channels(), &plain, None));
    }
    output.text(&text::spectrum_csv(cube.channels(), &spectrum, errors.as_deref()))
}
