//! `spectile devices`: what could render here.

use super::Output;
use crate::{Error, Result};

/// List the adapters of this machine and what each can do
///
/// Name, kind, driver and memory limits of every adapter, and whether it can run the shaders. A machine without a GPU
/// needs a software Vulkan driver, such as Mesa's lavapipe (Debian: mesa-vulkan-drivers).
#[derive(Debug, clap::Args)]
pub struct Args {
    /// One JSON object a line on stdout, instead of text
    #[arg(long)]
    pub json: bool,
}

pub fn run(_args: &Args, _output: &Output) -> Result<()> {
    Err(Error::Internal("`devices` is not connected to a device yet".into()))
}
