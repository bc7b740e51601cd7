//! `spectile plan`: what a render would need.

use super::Output;
use super::scene::SceneArgs;
use crate::{Error, Result};

/// Say what rendering a scene would take, without rendering it
///
/// Reads and checks SCENE and prints the features it uses and what is left out for it, tiles and waves, the memory on
/// every device, the size of the cube on disk, and the time to expect.
#[derive(Debug, clap::Args)]
#[command(after_long_help = "\
Examples:
  spectile plan scene.toml
  spectile plan scene.toml --size 4096x4096 --set channels.equal.count=2000 --spp 256")]
pub struct Args {
    #[command(flatten)]
    pub scene: SceneArgs,

    /// Samples per pixel to predict the time for
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..))]
    pub spp: u32,

    /// One JSON object a line on stdout, instead of text
    #[arg(long)]
    pub json: bool,
}

pub fn run(args: &Args, _output: &Output) -> Result<()> {
    Err(Error::Internal(format!("{}: `plan` is not connected to a device yet", args.scene.scene.display())))
}
