//! The state as JSON, once or as server-sent events.
//!
//! An event is made when the connection has room for it, from the state at that moment: whoever is slow gets fewer events,
//! and each tells all that has changed since the one before.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::header::CONTENT_TYPE;
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use futures_util::stream;
use serde_json::{Value, json};
use tokio::sync::{OwnedSemaphorePermit, watch};

use super::App;
use super::api::Refused;
use crate::preview::{Snapshot, Stage};

/// A listener gets at most one event in this time, and at least a comment in that.
const PACE: Duration = Duration::from_millis(250);
const SILENCE: Duration = Duration::from_secs(10);
/// Ranges of changed tiles in an event; when there are more, all count as changed.
const MOST_RANGES: usize = 1024;

/// What is known about the cube and its render. `curve`: with the points of the error curve.
pub fn status(app: &App, snapshot: &Snapshot, curve: bool) -> Value {
    let mut state = json!({
        "name": app.about.name,
        "version": env!("CARGO_PKG_VERSION"),
        "stage": snapshot.stage.name(),
        "controls": app.about.controls && !snapshot.stage.is_end(),
        "revision": snapshot.revision,
        "exposure_ev": app.about.exposure,
        "served_s": app.began.elapsed().as_secs_f64(),
    });
    let mut set = |name: &str, value: Value| state[name] = value;
    if let Ok([cube, channels]) = app.cube(|state| {
        let (cube, header) = (state.cube(), state.cube().header());
        let shows = match cube.projection().kind {
            crate::spectral::colour::ProjectionKind::Xyz => "xyz",
            crate::spectral::colour::ProjectionKind::FalseColour(_) => "false",
        };
        let cube = json!({
            "size": header.size, "origin": header.origin, "tile": header.tile, "tiles": cube.grid().count(),
            "epoch": header.epoch, "bytes": header.store_bytes(), "shows": shows,
        });
        [cube, json!(cube_channels(state))]
    }) {
        set("cube", cube);
        set("channels", channels);
    }
    if app.is_relightable() {
        set("relight", app.relighting.revisions());
    }
    if let Some(status) = &snapshot.progress.status {
        let devices = status.devices.iter().enumerate().map(|(device, d)| {
            let work = snapshot.progress.work.iter().filter(|work| work.device == device);
            json!({
                "name": d.name, "units": d.units, "paths": d.paths, "busy_s": d.busy_s, "idle_s": d.idle_s,
                "work": work.map(|work| json!({ "epoch": work.epoch, "tiles": work.tiles })).collect::<Vec<_>>(),
            })
        });
        set("devices", devices.collect());
        set("samples", json!(status.samples));
        set("samples_next", json!(status.samples_next));
        set("units", json!(status.units.0));
        set("units_total", json!(status.units.1));
        set("paths", json!(status.paths));
        set("paths_per_s", json!(status.paths as f64 / status.rendering_s.max(1e-9)));
        set("rays", json!(status.rays));
        set("elapsed_s", json!(status.elapsed.as_secs_f64()));
        set("rendering_s", json!(status.rendering_s));
        set("remaining_s", json!(status.remaining.map(|left| left.as_secs_f64())));
        set("error_estimate", json!(status.error_estimate));
        if let Some(ends) = status.tiles {
            set("tile_ends", ends.facts());
        }
    }
    if let Some(([least, most], started)) = snapshot.progress.found {
        set("samples", json!(least));
        set("samples_most", json!(most));
        set("tiles_started", json!(started));
        set("error_estimate", json!(snapshot.progress.estimate));
    }
    if curve {
        let points: Vec<_> = snapshot.points.iter().map(|p| json!([p.seconds, p.samples, p.error])).collect();
        set("curve", json!(points));
    }
    state
}

fn cube_channels(state: crate::cube::CubeState<'_>) -> usize {
    state.cube().channels().len()
}

/// Somebody who listens.
struct Listener {
    app: Arc<App>,
    news: watch::Receiver<u64>,
    /// What it has been told of, and how many points of the curve it has.
    revision: u64,
    points: (usize, u32),
    not_before: Option<Instant>,
    ended: bool,
    _place: OwnedSemaphorePermit,
}

impl Drop for Listener {
    fn drop(&mut self) {
        self.app.busy.fetch_sub(1, Ordering::SeqCst);
    }
}

pub async fn events(State(app): State<Arc<App>>, headers: HeaderMap) -> Result<Response, Refused> {
    let place = Arc::clone(&app.listeners).try_acquire_owned();
    let full = |_| Refused(StatusCode::SERVICE_UNAVAILABLE, "too many are listening already".into());
    let place = place.map_err(full)?;
    // A browser that comes back says what it has heard; from another process that may be in the future.
    let heard = headers.get("last-event-id").and_then(|id| id.to_str().ok()).and_then(|id| id.parse::<u64>().ok());
    let revision = heard.filter(|&id| id <= app.feed.snapshot().revision).unwrap_or(0);
    app.busy.fetch_add(1, Ordering::SeqCst);
    let listener = Listener {
        news: app.news.clone(),
        app,
        revision,
        points: (usize::MAX, 0),
        not_before: None,
        ended: false,
        _place: place,
    };
    let events = stream::unfold(listener, |mut listener| async {
        let event = listener.next().await?;
        Some((Ok::<_, std::convert::Infallible>(event), listener))
    });
    let headers = [(CONTENT_TYPE, "text/event-stream")];
    Ok((headers, Body::from_stream(events)).into_response())
}

impl Listener {
    async fn next(&mut self) -> Option<Bytes> {
        if self.ended {
            return None;
        }
        if let Some(not_before) = self.not_before {
            tokio::time::sleep_until(not_before.into()).await;
        }
        let known = self.revision;
        let news = tokio::time::timeout(SILENCE, self.news.wait_for(|&revision| revision > known)).await;
        match news {
            Err(_) => return Some(Bytes::from_static(b":\n\n")),
            // The server ends.
            Ok(Err(_)) => return None,
            Ok(Ok(_)) => {}
        }
        self.not_before = Some(Instant::now() + PACE);
        // In this order: what changes between the two is told again, not left out.
        let (revision, mut ranges) = self.app.feed.changes(known);
        let snapshot = self.app.feed.snapshot();
        self.revision = revision;
        self.ended = snapshot.stage.is_end();
        let points = (snapshot.points.len(), snapshot.points.last().map_or(0, |point| point.samples));
        let mut state = status(&self.app, &snapshot, points != self.points);
        self.points = points;
        if ranges.len() > MOST_RANGES {
            let end = ranges.last().map_or(0, |last| last.end);
            ranges = std::iter::once(ranges[0].start..end).collect();
        }
        state["changed"] = ranges.iter().map(|range| json!([range.start, range.end])).collect();
        let name = if matches!(snapshot.stage, Stage::Done | Stage::Stopped | Stage::Failed) { "end" } else { "state" };
        Some(Bytes::from(format!("event: {name}\nid: {revision}\ndata: {state}\n\n")))
    }
}
