//! `spectile devices`: what could render here.

use serde_json::json;

use super::Output;
use crate::Result;
use crate::files::format_bytes;
use crate::gpu::adapter::{self, Gpu};
use crate::render::self_test;

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

pub fn run(_args: &Args, output: &Output) -> Result<()> {
    let adapters = adapter::list();
    for (position, facts) in adapters.iter().enumerate() {
        output.event("device", serde_json::to_value(facts).expect("plain values"))?;
        let mut text =
            format!("{position}: {}\n  {} through {}, {}\n", facts.name, facts.kind, facts.backend, facts.driver);
        text += &format!(
            "  one binding shows {}, one buffer holds {}; timestamps: {}\n",
            format_bytes(facts.max_binding),
            format_bytes(facts.max_buffer),
            if facts.timestamps { "yes" } else { "no" }
        );
        match &facts.unusable {
            Some(why) => text += &format!("  cannot be used: {why}\n"),
            None => text += "  can render\n",
        }
        output.text(&text)?;
    }
    // The same choice and the same words as when rendering, and a test that it computes right.
    let gpu = Gpu::open()?;
    self_test::run(&gpu)?;
    output.event("done", json!({ "adapters": adapters.len(), "chosen": gpu.name }))?;
    output.text(&format!("`render` takes {}; its self-test passed\n", gpu.name))
}
