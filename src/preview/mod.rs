//! Looking at a cube while it is rendered, or afterwards.
//!
//! A render publishes to a [`Feed`] and never waits for anybody; the web page and tev are sinks that read from it, on
//! threads of their own. What they show they read from the cube itself.

mod disk;
mod feed;
mod status;
mod tev;
#[cfg(feature = "web")]
pub mod web;

pub use disk::follow;
pub use feed::{Control, ErrorPoint, Feed, Progress, Snapshot, Source, Stage, Work};
pub use status::{DeviceStatus, Status};
pub use tev::Tev;

/// Writes the picture of a render at an exposure of `ev`, 8-bit sRGB, replacing the last one in one step.
pub use crate::format::png::write;
