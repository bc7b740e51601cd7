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
pub use status::{DeviceStatus, Status, TileEnds};
pub use tev::Tev;

/// The picture of a render as a file, replaced in one step again and again.
pub use crate::format::png::{KEPT as PICTURE, write};
