//! What decides a render: a scene, where its cube goes, what of it, on what, and when to stop.

use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use crate::cube::{Existing, Header, Layer, epochs_in, whole_epochs};
use crate::gpu::adapter::Selection;
use crate::preview::Feed;
use crate::render::plan;
use crate::scene::Scene;
use crate::{Error, Result, files};

/// Samples per pixel where no stop rule says otherwise.
pub const DEFAULT_SAMPLES: u32 = 64;
/// The same where standard errors are wanted, which the spread of few epochs tells badly.
pub const DEFAULT_SAMPLES_WITH_UNCERTAINTY: u32 = 512;

/// Full epochs below which the error estimate is too rough to stop a render.
pub const SURE_EPOCHS: u32 = 8;

/// When to stop; the first that is reached does, at the end of an epoch of the whole image, or each tile by itself.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StopRule {
    pub samples: Option<u32>,
    pub time: Option<Duration>,
    /// The error estimate (docs/METHOD.md, Errors) that no channel is to exceed; asked once there are [`SURE_EPOCHS`].
    pub error: Option<f64>,
    /// Whether each tile ends where its own estimate is there, or at `samples`.
    pub per_tile: bool,
}

/// A picture of the cube that is kept up to date.
#[derive(Debug, Clone, PartialEq)]
pub struct Preview {
    pub file: PathBuf,
    /// EV, or automatic.
    pub exposure: Option<f64>,
}

/// Everything that decides a render.
pub struct Job {
    pub scene: Scene,
    pub output: PathBuf,
    /// What may be there already.
    pub existing: Existing,
    /// The tiles to render, if not all.
    pub tiles: Option<Range<u32>>,
    pub seed: u64,
    /// Side of the tiles, if asked for.
    pub tile: Option<u32>,
    pub stop: StopRule,
    /// Whether the cube has standard errors.
    pub uncertainty: bool,
    /// What of the first surface behind each pixel it has, of a scene [`Scene::with_first_hits`].
    pub layers: Vec<Layer>,
    pub preview: Option<Preview>,
    pub profile: bool,
    pub devices: Selection,
    /// Bytes of each device that may be used.
    pub memory: Option<u64>,
    /// Where the render publishes how far it is, and hears what whoever watches wants.
    pub feed: Option<Arc<Feed>>,
}

impl StopRule {
    /// The samples per pixel at which a render with full epochs of `full` samples stops; `None`: only time or error do.
    pub fn samples_limit(&self, full: u32, uncertainty: bool) -> Result<Option<u32>> {
        let wanted = match self {
            StopRule { samples: None, time: None, error: None, .. } if uncertainty => DEFAULT_SAMPLES_WITH_UNCERTAINTY,
            StopRule { samples: None, time: None, error: None, .. } => DEFAULT_SAMPLES,
            StopRule { samples: None, .. } => return Ok(None),
            StopRule { samples: Some(wanted), .. } => *wanted,
        };
        let too_many =
            || Error::Usage(format!("--spp {wanted}: the most that whole epochs make is {}", u32::MAX / full * full));
        whole_epochs(wanted, full).ok_or_else(too_many).map(Some)
    }

    /// The error at which each tile ends by itself.
    pub fn tile_error(&self) -> Option<f64> {
        self.error.filter(|_| self.per_tile)
    }

    /// Whether the number of samples alone decides where a render ends.
    pub(super) fn is_of_samples(&self) -> bool {
        self.time.is_none() && self.error.is_none()
    }
}

impl Job {
    /// What the cube is, in tiles of this size.
    pub fn header(&self, tile: [u32; 2]) -> Result<Header> {
        plan::header(&self.scene, tile, self.seed, self.uncertainty, &self.layers)
    }

    /// The tiles to render, of the cube that `header` describes.
    pub(super) fn tiles(&self, header: &Header) -> Result<Range<u32>> {
        header.validate().map_err(Error::Usage)?;
        let count = header.grid().count();
        match &self.tiles {
            None => Ok(0..count),
            Some(tiles) if tiles.start < tiles.end && tiles.end <= count => Ok(tiles.clone()),
            Some(tiles) => Err(Error::Usage(format!(
                "--tiles {}..{}: this picture has the tiles 0..{count}, and A must be less than B",
                tiles.start, tiles.end
            ))),
        }
    }

    /// How many epochs of a new tile are rendered at once and merged once: all of the first full one where nobody could
    /// look at the picture before, since it is too large or only a part of it is rendered here.
    pub(super) fn together(&self, header: &Header, samples_limit: Option<u32>) -> u32 {
        let full = header.epoch;
        let only_samples = self.stop.is_of_samples() && samples_limit.is_some_and(|limit| limit >= full);
        let larger_than_half = || files::memory_bytes().is_some_and(|memory| header.store_bytes() > memory / 2);
        if only_samples && (self.tiles.is_some() || larger_than_half()) { epochs_in(full, full) } else { 1 }
    }
}

#[cfg(test)]
mod tests {
    use super::StopRule;

    #[test]
    fn limits_that_cannot_be_counted_are_refused() {
        let limit = |samples| StopRule { samples: Some(samples), ..StopRule::default() }.samples_limit(64, false);
        assert_eq!(limit(u32::MAX - 63).ok(), Some(Some(u32::MAX - 63)));
        assert!(limit(u32::MAX).unwrap_err().to_string().contains("4294967232"));
    }
}
