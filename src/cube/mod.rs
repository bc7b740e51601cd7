//! The working cube: a Zarr v3 store with raw, memory-mapped chunks that other tools can open at any moment.
//!
//! A tile of pixels with all its channels is one chunk, and one file. Units (tile, epoch) are merged into it one at a
//! time: the new chunk is written aside, journalled, and renamed over the old one, never changed in place. So are the
//! parts of the derived arrays (`samples`, `preview`, `overview`) that belong to the tile.
//!
//! A [`Cube`] reads; a [`Writer`] holds the locks of some tiles and changes them. What a writer merges is gathered in a
//! batch and committed at most once a second. Whatever ends a writer, the next one's [`recover`] finds each tile as it
//! was after one of its commits.
//!
//! Invariant: nothing outside this module maps memory.

mod arrays;
mod checksums;
mod choices;
mod compare;
mod counts;
mod create;
mod epochs;
mod estimate;
mod faults;
mod grid;
mod journal;
mod kept;
mod layer;
mod lock;
mod map;
mod merge;
mod metadata;
mod preview;
#[cfg(all(test, unix))]
mod protocol_tests;
mod recover;
mod relight;
mod remainder;
mod restore;
mod runs;
mod sensor;
mod state;
mod store;
mod tile_files;
mod verify;
mod view;
mod weights;
mod writer;

pub use choices::{Brightness, Choices};
pub use compare::{ChannelMetrics, Comparison, ZTest, compare};
pub use create::{Existing, check_target, make};
pub use epochs::{epoch_samples, epochs_in, samples_before, whole_epochs};
pub use estimate::{is_within, next_look};
pub use grid::{Grid, Rect};
pub use kept::{Difference, KeptWeights, Light, MOST_WEIGHTS, Relit};
pub use layer::{Layer, LayerNames, Numbers, TileLayers};
pub use map::Chunk;
pub use merge::{merge_bytes, merge_means};
pub use metadata::{
    AFFINE, COUNTS_FORMAT, CRS, FACTORED, FORMAT, Header, LAYERS, PIXEL_TANGENT, SENSOR_FORMAT, plain_attributes,
};
pub use preview::reduction;
pub use relight::{NewCube, Relighted, relight};
pub use remainder::RemainderShare;
pub use runs::{Run, RunFile, RunState, SlurmTask, Stand, Work, node_name, now_s};
pub use sensor::{Findings, integrate};
pub use state::{CubeState, RegionMean, Seen, Window};
pub use store::{Cube, Progress};
pub use verify::Verification;
pub use view::{Integers, Quantity, Reader, Strides, View, White};
pub use weights::{Entries, Expand, Merging, Processor, Rows, Weights, systematic};
pub use writer::Writer;

/// A number from others, the same on every machine (the mixing of SplitMix64: Steele, Lea and Flood 2014).
pub fn random_of(words: [u32; 4]) -> u64 {
    const STEP: u64 = 0x9e37_79b9_7f4a_7c15;
    words.iter().fold(STEP, |state, &word| {
        let mut z = (state ^ u64::from(word)).wrapping_add(STEP);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    })
}

/// Side, in pixels, of the blocks whose means make up `overview`.
pub const BLOCK: u32 = 8;
