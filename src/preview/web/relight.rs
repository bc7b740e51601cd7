//! `/api/relight` and `/api/difference`: a factored cube under two choices of light and paint, and how much they differ.

use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use axum::body::Bytes;
use axum::extract::rejection::QueryRejection;
use axum::extract::{Path, Query, State};
use axum::http::StatusCode;
use axum::response::Response;
use serde::Deserialize;
use serde_json::{Value, json};

use super::App;
use super::api::{Refused, json_response};
use crate::cube::{Cube, CubeState, Difference, KeptWeights, Light, MOST_WEIGHTS, Rect, Relit};
use crate::error::Problem;
use crate::preview::Stage;
use crate::scene::{self, Choice, Chosen, Rendered};
use crate::spectral::colour::Observer;
use crate::spectral::illuminant::ILLUMINANTS;
use crate::spectral::tone::auto_exposure;
use crate::{Error, Result};

/// Bytes of a choice.
pub const LONGEST_CHOICE: usize = 1 << 20;
/// X, Y and Z of the white of sRGB, D65, where Y is 1 (IEC 61966-2-1).
const WHITE: [f64; 3] = [0.950_47, 1.0, 1.088_83];
/// Lumens a watt of light at 555 nm or so.
const LUMENS: f64 = 683.002;

/// Which of the two choices.
#[derive(Deserialize, Debug, Clone, Copy, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Which {
    A,
    B,
}

/// What is white.
#[derive(Debug, Clone, Copy, Default)]
pub struct WhiteAsked {
    /// A pixel that is, under each choice by itself.
    pub pixel: [Option<u32>; 2],
    /// How much that reflects.
    pub factor: Option<f64>,
    /// Y of daylight that is.
    pub luminance: Option<f64>,
}

/// The choices for the cube that is looked at, and what is kept for them.
#[derive(Default)]
pub struct Relighting(OnceLock<Table>);

struct Table {
    kept: KeptWeights,
    rendered: Arc<Light>,
    choices: Mutex<[Arc<Current>; 2]>,
    /// White without a wish, and the revision of the feed at which it was so.
    white: Mutex<Option<(u64, [f64; 3])>>,
}

/// A choice as it is now.
struct Current {
    choice: Choice,
    light: Arc<Light>,
    /// Whether anything is not as it was rendered.
    is_changed: bool,
    /// Of the feed when it was made.
    revision: u64,
    /// What is said about it.
    answer: Value,
}

/// What decides how `cube` was rendered, held together.
struct Facts {
    basis: crate::spectral::product::Basis,
    remainder: Vec<String>,
    beside: Vec<String>,
}

impl Facts {
    fn of(cube: &Cube) -> Result<Facts> {
        let header = cube.header();
        Ok(Facts { basis: cube.basis()?, remainder: header.remainder(), beside: header.spectra_of_remainder() })
    }

    fn rendered<'a>(&'a self, cube: &'a Cube) -> Rendered<'a> {
        let Facts { basis, remainder, beside } = self;
        Rendered { basis, channels: cube.channels(), remainder, beside }
    }
}

impl Relighting {
    fn table(&self, cube: &Cube) -> Result<&Table> {
        if let Some(table) = self.0.get() {
            return Ok(table);
        }
        let rendered = Arc::new(Light::new(cube, &cube.basis()?));
        let as_rendered = Arc::new(Current {
            choice: Choice::default(),
            light: Arc::clone(&rendered),
            is_changed: false,
            revision: 0,
            answer: answer(&Choice::default(), None, &[], ""),
        });
        let kept = KeptWeights::new(cube, MOST_WEIGHTS);
        let choices = Mutex::new([Arc::clone(&as_rendered), as_rendered]);
        Ok(self.0.get_or_init(|| Table { kept, rendered, choices, white: Mutex::default() }))
    }

    /// The revisions of both choices, for who asks what has changed.
    pub fn revisions(&self) -> Value {
        let [a, b] = self.0.get().map_or([0, 0], |table| table.now().each_ref().map(|current| current.revision));
        json!({ "a": a, "b": b })
    }

    /// `cube` under a choice; `None` where that is as it was rendered.
    pub fn changed<T>(
        &self,
        state: CubeState<'_>,
        which: Which,
        read: impl FnOnce(Relit<'_>) -> Result<T>,
    ) -> Result<Option<T>> {
        check(state)?;
        let table = self.table(state.cube())?;
        let current = table.current(which);
        if !current.is_changed {
            return Ok(None);
        }
        read(Relit { state, kept: &table.kept, light: &current.light }).map(Some)
    }

    /// Both choices, and what is white under each.
    pub fn both<T>(
        &self,
        state: CubeState<'_>,
        revision: u64,
        white: WhiteAsked,
        read: impl FnOnce([Relit<'_>; 2], [[f64; 3]; 2]) -> Result<T>,
    ) -> Result<T> {
        check(state)?;
        let table = self.table(state.cube())?;
        let now = table.now();
        let relit = now.each_ref().map(|current| Relit { state, kept: &table.kept, light: &current.light });
        let white = table.white(state, revision, white, &relit)?;
        read(relit, white)
    }
}

/// Refuses what has no products.
fn check(state: CubeState<'_>) -> Result<()> {
    if state.cube().header().is_factored() && !state.cube().is_counts() {
        return Ok(());
    }
    Err(Error::Usage("only cubes of `spectile render --factored` can be relit, and this is none".into()))
}

impl Table {
    fn choices(&self) -> MutexGuard<'_, [Arc<Current>; 2]> {
        self.choices.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn now(&self) -> [Arc<Current>; 2] {
        self.choices().clone()
    }

    fn current(&self, which: Which) -> Arc<Current> {
        Arc::clone(&self.choices()[which as usize])
    }

    /// What is white under each choice.
    fn white(
        &self,
        state: CubeState<'_>,
        revision: u64,
        asked: WhiteAsked,
        relit: &[Relit<'_>; 2],
    ) -> Result<[[f64; 3]; 2]> {
        let refuse = |what: &str| Err(Error::Usage(what.to_owned()));
        let factor = asked.factor.unwrap_or(1.0);
        if !(factor > 0.0 && factor.is_finite()) || asked.luminance.is_some_and(|y| !(y > 0.0 && y.is_finite())) {
            return refuse("white_factor and white_luminance must be numbers above 0");
        }
        if asked.pixel == [None; 2] && asked.factor.is_some() {
            return refuse("white_factor goes with white_x and white_y");
        }
        match (asked.pixel, asked.luminance) {
            ([None, None], Some(luminance)) => Ok([WHITE.map(|v| v * luminance); 2]),
            ([None, None], None) => {
                let mut known = self.white.lock().unwrap_or_else(PoisonError::into_inner);
                if let Some((_, white)) = known.filter(|(at, _)| *at == revision) {
                    return Ok([white; 2]);
                }
                let [a, _] = relit;
                let whole = state.cube().grid().whole();
                let window = a.colour(whole, super::image::default_scale(whole))?;
                let luminance = (-auto_exposure(&window.values, window.planes)).exp2();
                let white = WHITE.map(|v| v * luminance);
                *known = Some((revision, white));
                Ok([white; 2])
            }
            ([Some(x), Some(y)], None) => {
                let [width, height] = state.cube().header().size;
                if x >= width || y >= height {
                    return refuse("white_x, white_y are no pixel of the picture");
                }
                let mut found = [[0.0; 3]; 2];
                for (white, relit) in found.iter_mut().zip(relit) {
                    let xyz = relit.xyz(Rect { x0: x, y0: y, x1: x + 1, y1: y + 1 })?.unwrap_or_default();
                    if !xyz.iter().all(|v| *v > 0.0) {
                        return refuse("the pixel white_x, white_y has no light under one of the choices");
                    }
                    *white = xyz.map(|v| v / factor);
                }
                Ok(found)
            }
            (_, Some(_)) => refuse("white_luminance does not go with white_x and white_y"),
            _ => refuse("white_x and white_y belong together"),
        }
    }
}

/// What is said of a choice.
fn answer(choice: &Choice, chosen: Option<&Chosen>, warnings: &[String], name: &str) -> Value {
    let sets = chosen.map_or(&[][..], |chosen| &chosen.sets);
    let command =
        sets.iter().fold(format!("spectile relight {} -o relit.zarr", quoted(name)), |command, (key, value)| {
            format!("{command} --set {}", quoted(&format!("{key}={value}")))
        });
    json!({
        "choice": choice,
        "changed": chosen.map_or(&[][..], |chosen| &chosen.relit.changed),
        "warnings": warnings,
        "sets": sets.iter().map(|(key, value)| format!("{key}={value}")).collect::<Vec<_>>(),
        "command": command,
    })
}

/// A word of a command line.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-._/=".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// The cube, if it is one that is looked at and can be relit.
pub fn relightable(app: &App) -> std::result::Result<(), Refused> {
    if app.is_relightable() {
        return Ok(());
    }
    let what = "only cubes of `spectile render --factored` can be relit, and only by `spectile view`, not while they are rendered";
    Err(Refused(StatusCode::NOT_FOUND, what.into()))
}

impl App {
    /// Whether the cube is a factored one that is looked at.
    pub fn is_relightable(&self) -> bool {
        let of_cube = |state: CubeState<'_>| check(state).is_ok();
        self.feed.snapshot().stage == Stage::Viewing && self.cube(of_cube).unwrap_or(false)
    }
}

pub async fn what(State(app): State<Arc<App>>) -> std::result::Result<Response, Refused> {
    relightable(&app)?;
    let shared = Arc::clone(&app);
    let body = app
        .read(move |state| {
            let (cube, table) = (state.cube(), shared.relighting.table(state.cube())?);
            let facts = Facts::of(cube)?;
            let can = scene::changeable(facts.rendered(cube));
            let share = cube.remainder_share()?.map(|share| share.describe(cube.channels()));
            let [a, b] = table.now();
            Ok(json!({
                "spectra": can.spectra,
                "temperatures": can.temperatures,
                "not_changed": facts.beside,
                "remainder": facts.remainder,
                "remainder_share": share,
                "illuminants": ILLUMINANTS.as_slice(),
                "colours": table.kept.is_xyz(),
                "bytes": table.kept.bytes(),
                "most_bytes": MOST_WEIGHTS,
                "choices": { "a": said(&a, &shared), "b": said(&b, &shared) },
            }))
        })
        .await?;
    Ok(json_response(body.to_string()))
}

/// A choice, for whoever asks.
fn said(current: &Current, app: &App) -> Value {
    let mut answer = current.answer.clone();
    answer["revision"] = json!(current.revision);
    if !current.is_changed {
        answer["command"] = json!(format!("spectile relight {} -o relit.zarr", quoted(&app.about.name)));
    }
    answer
}

pub async fn choose(
    State(app): State<Arc<App>>,
    Path(which): Path<Which>,
    body: Bytes,
) -> std::result::Result<Response, Refused> {
    relightable(&app)?;
    let choice: Choice =
        serde_json::from_slice(&body).map_err(|error| Refused::bad(format!("this is no choice: {error}")))?;
    let shared = Arc::clone(&app);
    let answer = app.read(move |state| Ok(shared.put(state, which, choice))).await??;
    Ok(json_response(answer.to_string()))
}

impl App {
    fn put(&self, state: CubeState<'_>, which: Which, choice: Choice) -> std::result::Result<Value, Refused> {
        let cube = state.cube();
        let table = self.relighting.table(cube)?;
        let same = table.now().into_iter().find(|current| current.choice == choice);
        let (light, is_changed, answer) = match same {
            // Colours that are known already.
            Some(same) => (Arc::clone(&same.light), same.is_changed, same.answer.clone()),
            None => {
                let facts = Facts::of(cube)?;
                let chosen = scene::choose(facts.rendered(cube), &choice).map_err(refused)?;
                let mut warnings = chosen.relit.warnings.clone();
                if !facts.remainder.is_empty() && !chosen.relit.changed.is_empty() {
                    let share = cube.remainder_share()?.map(|share| share.describe(cube.channels()));
                    let share = share.unwrap_or_else(|| "an unknown share of the radiance".into());
                    warnings.push(format!(
                        "as rendered {share}, does not separate and stays as it was: {}",
                        facts.remainder.join(", ")
                    ));
                }
                let is_changed = chosen.relit.basis != facts.basis;
                let light = match is_changed {
                    true => Arc::new(Light::new(cube, &chosen.relit.basis)),
                    false => Arc::clone(&table.rendered),
                };
                (light, is_changed, answer(&choice, Some(&chosen), &warnings, &self.about.name))
            }
        };
        let revision = self.feed.touched();
        let current = Current { choice, light, is_changed, revision, answer };
        let said = said(&current, self);
        table.choices()[which as usize] = Arc::new(current);
        // Who heard of the revision before the choice was there hears of it again.
        self.feed.touched();
        Ok(said)
    }
}

/// What is wrong with a choice: its keys, and the names of its own files.
fn refused(error: Error) -> Refused {
    let Error::Input(problems) = error else { return error.into() };
    let of_problem = |problem: &Problem| {
        let place = match (problem.line, &problem.key) {
            (Some(line), _) => {
                format!("{}, line {line}: ", problem.file.file_name().unwrap_or_default().to_string_lossy())
            }
            (None, Some(key)) => format!("{key}: "),
            (None, None) => String::new(),
        };
        let help = problem.help.as_ref().map(|help| format!(" ({help})")).unwrap_or_default();
        format!("{place}{}{help}", problem.message)
    };
    Refused::bad(problems.iter().map(of_problem).collect::<Vec<_>>().join("; "))
}

/// A pixel, or the rectangle from it to x1, y1 (not included), and what is white.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Where {
    x: u32,
    y: u32,
    x1: Option<u32>,
    y1: Option<u32>,
    white_x: Option<u32>,
    white_y: Option<u32>,
    white_factor: Option<f64>,
    white_luminance: Option<f64>,
}

pub async fn difference(
    State(app): State<Arc<App>>,
    place: std::result::Result<Query<Where>, QueryRejection>,
) -> std::result::Result<Response, Refused> {
    relightable(&app)?;
    let Query(place) = place.map_err(|error| Refused::query(&error))?;
    let white = WhiteAsked {
        pixel: [place.white_x, place.white_y],
        factor: place.white_factor,
        luminance: place.white_luminance,
    };
    let (shared, revision) = (Arc::clone(&app), app.feed.snapshot().revision);
    let found = app
        .read(move |state| {
            let rect = super::api::rectangle(state, [place.x, place.y], [place.x1, place.y1])?;
            shared.relighting.both(state, revision, white, |[a, b], white| {
                let (Some(a), Some(b)) = (a.xyz(rect)?, b.xyz(rect)?) else { return Ok(None) };
                Ok(Some((Difference::of([a, b], white), white)))
            })
        })
        .await?;
    let nothing = || Refused(StatusCode::NOT_FOUND, "there are no samples here yet".into());
    let (difference, white) = found.ok_or_else(nothing)?;
    let luminous = Observer::Cie1931.luminous_nm() * LUMENS;
    let of = |i: usize| {
        json!({
            "xyz": difference.xyz[i], "lab": difference.lab[i], "white": white[i],
            "luminance_cd_m2": difference.xyz[i][1] * luminous,
        })
    };
    let body = json!({ "x": place.x, "y": place.y, "a": of(0), "b": of(1), "delta_e_2000": difference.delta_e });
    Ok(json_response(body.to_string()))
}
