//! The working cube: a Zarr v3 store with raw, memory-mapped chunks that other tools can open at any moment (DESIGN
//! section 4).
//!
//! A tile of pixels with all its channels is one chunk, and one file. Units (tile, epoch) are merged into it one at a
//! time: the new chunk is written aside and renamed over the old one, never changed in place. So are the parts of the
//! derived arrays (`samples`, `preview`, `overview`) that belong to the tile, and the error sums under `.spectile/`.
//!
//! Invariant: nothing outside this module maps memory.

mod aside;
mod compare;
mod estimate;
mod grid;
mod map;
mod merge;
mod metadata;
mod store;

pub use compare::{ChannelMetrics, Comparison, compare};
pub use grid::{Grid, Rect};
pub use map::Chunk;
pub use merge::merge_bytes;
pub use metadata::{FORMAT, Header};
pub use store::{Cube, Progress};

/// Side, in pixels, of the blocks whose means make up `overview`.
pub const BLOCK: u32 = 8;
