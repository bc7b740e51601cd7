//! Follows a cube on disk, which other processes may be rendering.

use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use super::Feed;
use crate::Result;
use crate::cube::{Cube, Seen};

/// How often the cube is looked at; a large one takes at most this share of the time.
const EVERY: Duration = Duration::from_millis(500);
const SHARE: u32 = 20;

/// Publishes what changes in `cube` until the process ends. The first look is taken before this returns.
pub fn follow(cube: Cube, feed: &Arc<Feed>) -> Result<()> {
    let mut seen = Seen::nothing(&cube);
    let changed = cube.changes(&mut seen)?;
    feed.found(&changed, &seen);
    let feed = Arc::downgrade(feed);
    let watch = move || {
        let mut estimated = None;
        loop {
            // The estimate goes through the journals of all tiles.
            let began = Instant::now();
            let changed = cube.changes(&mut seen);
            let Some(feed) = feed.upgrade() else { return };
            // What cannot be read now, on a file system that is away, may be later; readers get its errors.
            let changed = changed.unwrap_or_default();
            if !changed.is_empty() {
                feed.found(&changed, &seen);
            }
            if !changed.is_empty() || estimated.is_none() {
                let largest = |all: Vec<f64>| all.into_iter().filter(|error| !error.is_nan()).reduce(f64::max);
                let estimate = cube.error_estimate().ok().and_then(largest);
                if estimated != Some(estimate) {
                    estimated = Some(estimate);
                    feed.estimated(estimate);
                }
            }
            drop(feed);
            thread::sleep(EVERY.max(began.elapsed() * SHARE));
        }
    };
    let spawned = thread::Builder::new().name("cube watch".into()).spawn(watch);
    spawned.map(drop).map_err(|error| crate::Error::Internal(format!("no thread to watch the cube: {error}")))
}
