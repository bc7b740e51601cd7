//! What is served where; docs/http.md says the same to users.

use std::net::IpAddr;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use axum::body::Body;
use axum::extract::{DefaultBodyLimit, Query, Request, State};
use axum::http::header::{CACHE_CONTROL, CONTENT_TYPE, LOCATION, SET_COOKIE};
use axum::http::{HeaderName, HeaderValue, StatusCode};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post, put};
use axum::{Extension, Router};
use serde::Deserialize;
use serde_json::json;

use super::guard::Peer;
use super::relight::{self, LONGEST_CHOICE, Which};
use super::{App, events, image, page};
use crate::cube::{CubeState, Rect, RegionMean};
use crate::format::text;
use crate::preview::Control;
use crate::spectral::colour::{ProjectionKind, three_of};
use crate::spectral::temperature::is_thermal;
use crate::{Error, Result};

/// Bytes of a body; no request needs one, but for a choice.
const LONGEST_BODY: usize = 1024;
/// Where choices are put.
const CHOICES: &str = "/api/relight/";
/// How long a request waits for its turn to read.
const PATIENCE: Duration = Duration::from_secs(20);

/// Why a request has no answer: a status, and a sentence without any path of this machine.
pub struct Refused(pub StatusCode, pub String);

impl Refused {
    /// A query that is not understood: what of it, without the parser's own beginning.
    pub fn query(error: &axum::extract::rejection::QueryRejection) -> Refused {
        let text = error.body_text();
        let what = text.strip_prefix("Failed to deserialize query string: ").unwrap_or(&text);
        Refused::bad(format!("the query is wrong: {what}"))
    }

    pub fn bad(what: impl Into<String>) -> Refused {
        Refused(StatusCode::BAD_REQUEST, what.into())
    }
}

impl IntoResponse for Refused {
    fn into_response(self) -> Response {
        let body = format!("{}\n", json!({ "error": self.1 }));
        (self.0, [(CONTENT_TYPE, "application/json")], body).into_response()
    }
}

impl From<Error> for Refused {
    fn from(error: Error) -> Refused {
        match error {
            Error::Usage(what) => Refused::bad(what),
            // The path is nobody's business.
            Error::Storage { what, .. } => {
                Refused(StatusCode::INTERNAL_SERVER_ERROR, format!("a file of the cube {what}"))
            }
            _ => Refused(StatusCode::INTERNAL_SERVER_ERROR, "the cube cannot be read".into()),
        }
    }
}

pub fn router(app: &Arc<App>) -> Router {
    Router::new()
        .route("/", get(front))
        .route("/api/status", get(status))
        .route("/api/channels", get(channels))
        .route("/api/image", get(image::image))
        .route("/api/spectrum", get(spectrum))
        .route("/api/relight", get(relight::what))
        .route("/api/relight/{which}", put(relight::choose).layer(DefaultBodyLimit::max(LONGEST_CHOICE)))
        .route("/api/difference", get(relight::difference))
        .route("/api/events", get(events::events))
        .route("/api/pause", post(pause))
        .route("/api/resume", post(resume))
        .route("/api/stop", post(stop))
        .route("/api/save", post(save))
        .fallback(async || Refused(StatusCode::NOT_FOUND, "there is nothing here; docs/http.md lists what is".into()))
        .method_not_allowed_fallback(async || Refused(StatusCode::METHOD_NOT_ALLOWED, "not with this method".into()))
        .layer(DefaultBodyLimit::max(LONGEST_BODY))
        .layer(middleware::from_fn_with_state(Arc::clone(app), watch_over))
        .with_state(Arc::clone(app))
}

/// Before a request is answered it is checked; what is answered carries headers that keep browsers strict.
async fn watch_over(
    State(app): State<Arc<App>>,
    peer: Option<Extension<Peer>>,
    request: Request,
    next: Next,
) -> Response {
    let peer: Option<IpAddr> = peer.map(|Extension(Peer(ip))| ip);
    let length = request.headers().get("content-length").and_then(|length| length.to_str().ok());
    let (longest, why) = match request.uri().path().starts_with(CHOICES) {
        true => (LONGEST_CHOICE, "a choice has 1 MiB at most"),
        false => (LONGEST_BODY, "no request needs a body"),
    };
    let too_long = length.is_some_and(|length| length.parse::<usize>().is_ok_and(|length| length > longest));
    let mut response = match app.guard.check(request.method(), request.uri(), request.headers(), peer) {
        Ok(()) if too_long => Refused(StatusCode::PAYLOAD_TOO_LARGE, why.into()).into_response(),
        Ok(()) => {
            app.busy.fetch_add(1, Ordering::SeqCst);
            let response = next.run(request).await;
            app.busy.fetch_sub(1, Ordering::SeqCst);
            *app.last_request.lock().unwrap_or_else(|e| e.into_inner()) = Some(Instant::now());
            response
        }
        Err((status, what)) => Refused(status, what.into()).into_response(),
    };
    let mut set = |name: &'static str, value: &'static str| {
        response.headers_mut().entry(HeaderName::from_static(name)).or_insert(HeaderValue::from_static(value));
    };
    set("cache-control", "no-store");
    set("x-content-type-options", "nosniff");
    set("x-frame-options", "DENY");
    set("referrer-policy", "no-referrer");
    set("cross-origin-resource-policy", "same-origin");
    set("cross-origin-opener-policy", "same-origin");
    set("content-security-policy", "default-src 'none'; frame-ancestors 'none'");
    response
}

impl App {
    /// Runs `read` on a thread that may wait for files, with the cube as it is now.
    pub async fn read<T: Send + 'static>(
        self: &Arc<Self>,
        read: impl FnOnce(CubeState<'_>) -> Result<T> + Send + 'static,
    ) -> std::result::Result<T, Refused> {
        let turn = tokio::time::timeout(PATIENCE, self.readers.acquire()).await;
        let Ok(Ok(_turn)) = turn else {
            return Err(Refused(StatusCode::SERVICE_UNAVAILABLE, "too much is being read already; try again".into()));
        };
        let source = self.feed.snapshot().source.ok_or_else(no_cube)?;
        let task = tokio::task::spawn_blocking(move || {
            let (mut read, mut result) = (Some(read), None);
            source.with_state(&mut |state| result = read.take().map(|read| read(state)));
            result
        });
        match task.await {
            Ok(Some(result)) => result.map_err(Refused::from),
            Ok(None) => Err(no_cube()),
            Err(_) => Err(Refused(StatusCode::INTERNAL_SERVER_ERROR, "reading failed".into())),
        }
    }

    /// What does not change about the cube, read without waiting for anybody.
    pub fn cube<T>(&self, read: impl FnOnce(CubeState<'_>) -> T) -> std::result::Result<T, Refused> {
        let source = self.feed.snapshot().source.ok_or_else(no_cube)?;
        let (mut read, mut result) = (Some(read), None);
        source.with_state(&mut |state| result = read.take().map(|read| read(state)));
        result.ok_or_else(no_cube)
    }
}

fn no_cube() -> Refused {
    Refused(StatusCode::SERVICE_UNAVAILABLE, "there is no cube yet; devices are being prepared".into())
}

pub fn json_response(body: String) -> Response {
    ([(CONTENT_TYPE, "application/json")], body).into_response()
}

/// The page; whoever came with the token gets it as a cookie and an address without it.
async fn front(State(app): State<Arc<App>>, request: Request) -> Response {
    if request.uri().query().is_some_and(|query| query.split('&').any(|pair| pair.starts_with("token="))) {
        let cookie = HeaderValue::from_str(&app.guard.set_cookie());
        let Ok(cookie) = cookie else { return StatusCode::INTERNAL_SERVER_ERROR.into_response() };
        let to = [(LOCATION, HeaderValue::from_static("/")), (SET_COOKIE, cookie)];
        return (StatusCode::SEE_OTHER, to).into_response();
    }
    let mut nonce = [0u8; 16];
    if getrandom::fill(&mut nonce).is_err() {
        return StatusCode::INTERNAL_SERVER_ERROR.into_response();
    }
    let nonce: String = nonce.iter().map(|byte| format!("{byte:02x}")).collect();
    let policy = format!(
        "default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; img-src 'self' data: blob:; \
         connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    );
    let headers = [
        (CONTENT_TYPE, "text/html; charset=utf-8".to_owned()),
        (HeaderName::from_static("content-security-policy"), policy),
        (CACHE_CONTROL, "no-store".to_owned()),
    ];
    (headers, Body::from(page::page(&nonce))).into_response()
}

async fn status(State(app): State<Arc<App>>) -> Response {
    let snapshot = app.feed.snapshot();
    json_response(events::status(&app, &snapshot, true).to_string())
}

async fn channels(State(app): State<Arc<App>>) -> std::result::Result<Response, Refused> {
    app.cube(|state| {
        let (cube, channels) = (state.cube(), state.cube().channels());
        let is_counts = cube.is_counts();
        let (false_colour, rgb) = match cube.projection().kind {
            ProjectionKind::Xyz => (None, three_of(channels, true)),
            ProjectionKind::FalseColour(rgb) => (Some(rgb), rgb),
        };
        json_response(
            json!({
                "count": channels.len(),
                "centre_nm": (0..channels.len()).map(|k| channels.centre(k)).collect::<Vec<_>>(),
                "bounds_nm": channels.bounds,
                "names": channels.names,
                "false_colour": false_colour,
                "rgb": rgb,
                "thermal": (0..channels.len()).filter(|&k| !is_counts && is_thermal(channels, k)).collect::<Vec<_>>(),
                "quantity": if is_counts { "counts" } else { "radiance" },
            })
            .to_string(),
        )
    })
}

/// A pixel, or the rectangle from it to x1, y1 (not included).
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Where {
    x: u32,
    y: u32,
    x1: Option<u32>,
    y1: Option<u32>,
    choice: Option<Which>,
    #[serde(default)]
    format: Format,
}

#[derive(Deserialize, Default, Clone, Copy, PartialEq)]
#[serde(rename_all = "lowercase")]
enum Format {
    #[default]
    Json,
    Csv,
}

async fn spectrum(
    State(app): State<Arc<App>>,
    place: std::result::Result<Query<Where>, axum::extract::rejection::QueryRejection>,
) -> std::result::Result<Response, Refused> {
    let Query(place) = place.map_err(|error| Refused::query(&error))?;
    let (format, shared) = (place.format, Arc::clone(&app));
    if place.choice.is_some() {
        relight::relightable(&app)?;
    }
    let body = app.read(move |state| read_spectrum(state, &place, &shared.relighting)).await?;
    let body = body.ok_or_else(|| Refused(StatusCode::NOT_FOUND, "there are no samples here yet".into()))?;
    Ok(match format {
        Format::Json => json_response(body),
        Format::Csv => ([(CONTENT_TYPE, "text/csv; charset=utf-8")], body).into_response(),
    })
}

/// A spectrum as it is sent; numbers have the fewest digits that bring them back.
#[derive(serde::Serialize)]
struct Spectrum<T> {
    x: u32,
    y: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    x1: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    y1: Option<u32>,
    pixels: u64,
    samples: u32,
    radiance: Vec<T>,
    standard_error: Option<Vec<T>>,
}

/// What is read of a pixel, with standard errors where there are some, or of a rectangle.
enum Spectra {
    Pixel(Option<(Vec<f32>, Option<Vec<f32>>)>),
    Region(Option<RegionMean>),
}

/// A pixel, or the rectangle from it to an end that is not included, of the picture.
pub fn rectangle(state: CubeState<'_>, [x, y]: [u32; 2], [x1, y1]: [Option<u32>; 2]) -> Result<Rect> {
    let [width, height] = state.cube().header().size;
    let [end_x, end_y] = [(x, x1), (y, y1)].map(|(from, to)| to.unwrap_or(from.saturating_add(1)));
    if x >= end_x || y >= end_y || end_x > width || end_y > height {
        return Err(Error::Usage(format!(
            "pixels {x}..{end_x} x {y}..{end_y} are not of the picture; columns are 0..{width}, rows 0..{height}"
        )));
    }
    Ok(Rect { x0: x, y0: y, x1: end_x, y1: end_y })
}

/// The spectrum of a pixel, or the mean over a rectangle, as text; `None` where nothing is rendered yet.
fn read_spectrum(state: CubeState<'_>, place: &Where, relighting: &relight::Relighting) -> Result<Option<String>> {
    let &Where { x, y, x1, y1, .. } = place;
    let rect = rectangle(state, [x, y], [x1, y1])?;
    let is_pixel = x1.is_none() && y1.is_none();
    let samples = state.samples(state.cube().grid().tile_at(x, y))?;
    let relit = |which: Which| {
        relighting.changed(state, which, |relit| match is_pixel {
            true => Ok(Spectra::Pixel(relit.spectrum(x, y)?.map(|radiance| (radiance, None)))),
            false => Ok(Spectra::Region(relit.region(rect)?)),
        })
    };
    let found = match place.choice.map(relit).transpose()?.flatten() {
        Some(relit) => relit,
        None if is_pixel => {
            let radiance = state.spectrum(x, y)?;
            let errors = if radiance.is_some() { state.standard_error(x, y)? } else { None };
            Spectra::Pixel(radiance.map(|radiance| (radiance, errors)))
        }
        None => Spectra::Region(state.region(rect)?),
    };
    let mean = match found {
        Spectra::Pixel(None) | Spectra::Region(None) => return Ok(None),
        Spectra::Pixel(Some((radiance, standard_error))) => {
            let spectrum = Spectrum { x, y, x1, y1, pixels: 1, samples, radiance, standard_error };
            return Ok(Some(spectrum.text(state, place.format)));
        }
        Spectra::Region(Some(mean)) => mean,
    };
    let spectrum = Spectrum {
        x,
        y,
        x1: Some(rect.x1),
        y1: Some(rect.y1),
        pixels: mean.pixels,
        samples,
        radiance: mean.radiance,
        standard_error: mean.standard_error,
    };
    Ok(Some(spectrum.text(state, place.format)))
}

impl<T: serde::Serialize + std::fmt::Debug> Spectrum<T> {
    fn text(&self, state: CubeState<'_>, format: Format) -> String {
        match format {
            // Numbers and lists of them can always be written.
            Format::Json => serde_json::to_string(self).unwrap_or_default(),
            Format::Csv => {
                let name = if state.cube().is_counts() { "counts" } else { "radiance" };
                text::values_csv(name, state.cube().channels(), &self.radiance, self.standard_error.as_deref())
            }
        }
    }
}

async fn pause(state: State<Arc<App>>) -> std::result::Result<Response, Refused> {
    control(&state, |app| app.feed.control(Control::Rest(true)))
}

async fn resume(state: State<Arc<App>>) -> std::result::Result<Response, Refused> {
    control(&state, |app| app.feed.control(Control::Rest(false)))
}

async fn stop(state: State<Arc<App>>) -> std::result::Result<Response, Refused> {
    control(&state, |app| app.feed.control(Control::Stop))
}

async fn save(state: State<Arc<App>>) -> std::result::Result<Response, Refused> {
    control(&state, |app| app.feed.control(Control::Save))
}

fn control(app: &App, act: impl FnOnce(&App)) -> std::result::Result<Response, Refused> {
    if !app.about.controls || app.feed.snapshot().stage.is_end() {
        return Err(Refused(StatusCode::CONFLICT, "there is no render here to control".into()));
    }
    act(app);
    Ok(StatusCode::NO_CONTENT.into_response())
}
