//! What a render, or a watch over a cube on disk, publishes: the latest state, and which tiles have changed since when.
//!
//! Publishing is a lock and an assignment. Whoever looks is woken, asks what has changed since the last time, and reads
//! the tiles themselves: a slow viewer sees fewer states, never older ones, and nobody waits for it.

use std::ops::Range;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use crossbeam_channel::{Receiver, Sender, unbounded};

use super::status::Status;
use crate::cube::{CubeState, Seen};

/// Most points of the error curve. More are thinned out by half, from every second on.
const MOST_POINTS: usize = 1000;

/// Gives access to a cube for as long as there is one.
pub trait Source: Send + Sync {
    /// Calls `read` with the cube as it is at this moment; false where there is none any more.
    fn with_state(&self, read: &mut dyn FnMut(CubeState<'_>)) -> bool;
}

impl Source for crate::cube::Cube {
    fn with_state(&self, read: &mut dyn FnMut(CubeState<'_>)) -> bool {
        read(self.state());
        true
    }
}

/// What goes on with the cube.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Devices and shaders are set up; there is no cube yet.
    Preparing,
    Rendering,
    Paused,
    /// The render has reached its end, was stopped, or failed.
    Done,
    Stopped,
    Failed,
    /// A cube on disk that is looked at; others may work on it.
    Viewing,
}

impl Stage {
    pub fn name(self) -> &'static str {
        match self {
            Stage::Preparing => "preparing",
            Stage::Rendering => "rendering",
            Stage::Paused => "paused",
            Stage::Done => "done",
            Stage::Stopped => "stopped",
            Stage::Failed => "failed",
            Stage::Viewing => "viewing",
        }
    }

    pub fn is_end(self) -> bool {
        matches!(self, Stage::Done | Stage::Stopped | Stage::Failed)
    }
}

/// A point of the curve of the error estimate: seconds of rendering, samples per pixel, largest estimate of a channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorPoint {
    pub seconds: f64,
    pub samples: u32,
    pub error: f64,
}

/// Published states; see the module.
pub struct Feed {
    state: Mutex<State>,
    changed: Condvar,
    control: Sender<Control>,
    controls: Receiver<Control>,
}

/// What whoever watches wants of a render.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Control {
    /// To rest, or to go on.
    Rest(bool),
    /// To have everything merged so far on disk.
    Save,
    /// An orderly end.
    Stop,
}

struct State {
    /// Counts what has been published.
    revision: u64,
    /// The revision at which each tile changed last; 0: never.
    tiles: Vec<u64>,
    stage: Stage,
    progress: Progress,
    points: Arc<Vec<ErrorPoint>>,
    /// Only every so many points is kept, and how many came since the last one that was.
    stride: usize,
    skipped: usize,
    source: Option<Arc<dyn Source>>,
}

/// How far it is.
#[derive(Debug, Clone, Default)]
pub struct Progress {
    /// Of a render.
    pub status: Option<Arc<Status>>,
    /// What each device of a render has under way.
    pub work: Arc<Vec<Work>>,
    /// Of a cube on disk: the least and the most samples per pixel, tiles with any, and the largest error estimate.
    pub found: Option<([u32; 2], u32)>,
    pub estimate: Option<f64>,
}

/// Units that a device has under way.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Work {
    pub device: usize,
    /// The first of its epochs.
    pub epoch: u32,
    pub tiles: Vec<u32>,
}

/// The state at one moment.
#[derive(Clone)]
pub struct Snapshot {
    pub revision: u64,
    pub stage: Stage,
    pub progress: Progress,
    pub points: Arc<Vec<ErrorPoint>>,
    pub source: Option<Arc<dyn Source>>,
}

impl Feed {
    /// A feed of a render, which hears of [`Feed::controls`].
    pub fn of_render() -> Arc<Feed> {
        Arc::new(Feed::new(Stage::Preparing))
    }

    /// A feed of a cube on disk, which nothing here controls.
    pub fn of_cube(cube: crate::cube::Cube) -> Arc<Feed> {
        let feed = Feed::new(Stage::Viewing);
        feed.publish(|state| {
            state.tiles = vec![0; cube.grid().count() as usize];
            state.source = Some(Arc::new(cube));
        });
        Arc::new(feed)
    }

    fn new(stage: Stage) -> Feed {
        let state = State {
            revision: 1,
            tiles: Vec::new(),
            stage,
            progress: Progress::default(),
            points: Arc::default(),
            stride: 1,
            skipped: 0,
            source: None,
        };
        let (control, controls) = unbounded();
        Feed { state: Mutex::new(state), changed: Condvar::new(), control, controls }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn publish(&self, change: impl FnOnce(&mut State)) {
        let mut state = self.state();
        state.revision += 1;
        change(&mut state);
        drop(state);
        self.changed.notify_all();
    }

    /// The render has its cube, of so many tiles, of which those in `there` have samples already.
    pub fn opened(&self, source: Arc<dyn Source>, tiles: u32, there: impl Iterator<Item = u32>) {
        self.publish(|state| {
            state.stage = Stage::Rendering;
            state.tiles = vec![0; tiles as usize];
            there.for_each(|tile| state.tiles[tile as usize] = state.revision);
            state.source = Some(source);
        });
    }

    /// Units of these tiles are merged, and others are under way.
    pub fn merged(&self, tiles: &[u32], status: &Status, work: Vec<Work>) {
        let (status, work) = (Arc::new(status.clone()), Arc::new(work));
        self.publish(|state| {
            tiles.iter().for_each(|&tile| state.tiles[tile as usize] = state.revision);
            state.progress.status = Some(status);
            state.progress.work = work;
        });
    }

    /// An epoch is complete: a point of the error curve, where there is an estimate.
    pub fn epoch(&self, status: &Status) {
        let status = Arc::new(status.clone());
        self.publish(|state| {
            if let Some(error) = status.error_estimate {
                state.add_point(ErrorPoint { seconds: status.rendering_s, samples: status.samples, error });
            }
            state.progress.status = Some(status);
        });
    }

    /// The render rests, or goes on.
    pub fn rests(&self, rests: bool) {
        self.publish(|state| state.stage = if rests { Stage::Paused } else { Stage::Rendering });
    }

    /// The render has ended; from now on its cube is read as it is on disk.
    pub fn ended(&self, stage: Stage, source: Option<Arc<dyn Source>>) {
        self.publish(|state| {
            state.stage = stage;
            state.progress.work = Arc::default();
            state.source = source;
        });
    }

    /// A look at a cube on disk has found these tiles changed.
    pub fn found(&self, tiles: &[u32], seen: &Seen) {
        let samples = seen.samples();
        let most = samples.iter().copied().max().unwrap_or(0);
        let least = samples.iter().copied().filter(|&n| n > 0).min().unwrap_or(0);
        let started = samples.iter().filter(|&&n| n > 0).count() as u32;
        self.publish(|state| {
            tiles.iter().for_each(|&tile| state.tiles[tile as usize] = state.revision);
            state.progress.found = Some(([least, most], started));
        });
    }

    /// The error estimate of a cube on disk.
    pub fn estimated(&self, estimate: Option<f64>) {
        self.publish(|state| state.progress.estimate = estimate);
    }

    /// Something that who watches has a hand in has changed: the revision that it then has.
    pub fn touched(&self) -> u64 {
        let mut revision = 0;
        self.publish(|state| revision = state.revision);
        revision
    }

    pub fn snapshot(&self) -> Snapshot {
        self.state().snapshot()
    }

    /// Waits until something newer than `revision` is published, but not longer than `time_limit`.
    pub fn wait(&self, revision: u64, time_limit: Duration) -> Snapshot {
        let old = |state: &mut State| state.revision <= revision;
        let (state, _) =
            self.changed.wait_timeout_while(self.state(), time_limit, old).unwrap_or_else(PoisonError::into_inner);
        state.snapshot()
    }

    /// The tiles that have changed after `revision`, neighbours together; and up to which revision this is true.
    pub fn changes(&self, revision: u64) -> (u64, Vec<Range<u32>>) {
        let state = self.state();
        let mut ranges: Vec<Range<u32>> = Vec::new();
        for (tile, _) in (0..).zip(&state.tiles).filter(|(_, changed)| **changed > revision) {
            match ranges.last_mut() {
                Some(last) if last.end == tile => last.end += 1,
                _ => ranges.push(tile..tile + 1),
            }
        }
        (state.revision, ranges)
    }

    /// Passes on what somebody who watches wants.
    pub fn control(&self, control: Control) {
        // Both ends of the channel are here.
        let _ = self.control.send(control);
    }

    /// What whoever watches wants, for the render to do.
    pub fn controls(&self) -> &Receiver<Control> {
        &self.controls
    }
}

impl State {
    fn snapshot(&self) -> Snapshot {
        Snapshot {
            revision: self.revision,
            stage: self.stage,
            progress: self.progress.clone(),
            points: Arc::clone(&self.points),
            source: self.source.clone(),
        }
    }

    fn add_point(&mut self, point: ErrorPoint) {
        self.skipped += 1;
        if self.skipped < self.stride {
            return;
        }
        self.skipped = 0;
        let points = Arc::make_mut(&mut self.points);
        if points.len() == MOST_POINTS {
            // The first ones, a decade or two of the curve, are far apart by themselves.
            let mut number = 0;
            points.retain(|_| {
                number += 1;
                number <= 16 || number % 2 == 0
            });
            self.stride *= 2;
        }
        points.push(point);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(samples: u32) -> Status {
        Status {
            samples,
            samples_next: samples,
            units: (0, 9),
            paths: 0,
            rays: 0,
            elapsed: Duration::ZERO,
            rendering_s: f64::from(samples),
            error_estimate: Some(1.0 / f64::from(samples.max(1))),
            tiles: None,
            remaining: None,
            devices: Vec::new(),
        }
    }

    fn feed(tiles: usize) -> Arc<Feed> {
        let feed = Feed::of_render();
        feed.publish(|state| state.tiles = vec![0; tiles]);
        feed
    }

    #[test]
    fn who_asks_late_hears_of_every_tile_once() {
        let feed = feed(9);
        let (start, none) = feed.changes(0);
        assert!(none.is_empty());
        feed.merged(&[3, 4, 5], &status(1), Vec::new());
        let (middle, first) = feed.changes(start);
        feed.merged(&[5, 8], &status(1), Vec::new());
        assert_eq!(first, vec![3..6]);
        assert_eq!(feed.changes(middle).1, vec![5..6, 8..9]);
        let (end, all) = feed.changes(start);
        assert_eq!(all, vec![3..6, 8..9]);
        assert!(feed.changes(end).1.is_empty());
    }

    #[test]
    fn waiting_ends_with_news_or_with_patience() {
        let feed = feed(1);
        let revision = feed.snapshot().revision;
        assert_eq!(feed.wait(revision, Duration::from_millis(5)).revision, revision);
        std::thread::scope(|threads| {
            let waiting = threads.spawn(|| feed.wait(revision, Duration::from_secs(60)).revision);
            feed.merged(&[0], &status(1), Vec::new());
            assert!(waiting.join().expect("no panic") > revision);
        });
    }

    #[test]
    fn the_curve_is_bounded_and_keeps_its_ends() {
        let feed = feed(1);
        let epochs = 100_000;
        (1..=epochs).for_each(|epoch| feed.epoch(&status(64 * epoch)));
        let points = feed.snapshot().points;
        assert!(points.len() <= MOST_POINTS && points.len() > MOST_POINTS / 3, "{}", points.len());
        assert_eq!(points[0].samples, 64);
        assert!(points.windows(2).all(|pair| pair[0].samples < pair[1].samples));
        assert!(points[points.len() - 1].samples > 63 * epochs, "{:?}", points.last());
    }

    #[test]
    fn controls_reach_who_renders() {
        let feed = Feed::of_render();
        let all = [Control::Rest(true), Control::Save, Control::Rest(false), Control::Stop];
        all.into_iter().for_each(|control| feed.control(control));
        assert!(feed.controls().try_iter().eq(all));
    }
}
