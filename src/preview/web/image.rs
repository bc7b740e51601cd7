//! `/api/image`: a part of the picture at the resolution of a screen, as PNG or as numbers.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};

use axum::body::Body;
use axum::extract::rejection::QueryRejection;
use axum::extract::{Query, State};
use axum::http::HeaderName;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use serde::Deserialize;

use super::App;
use super::api::Refused;
use super::relight::{Which, WhiteAsked, relightable};
use crate::cube::{BLOCK, CubeState, Rect, Window};
use crate::format::png;
use crate::spectral::Channels;
use crate::spectral::temperature::{BandTemperature, THERMAL_NM, is_thermal, shown_range};
use crate::spectral::tone::{Tone, auto_exposure, percentiles};
use crate::{Error, Result};

/// Pixels of an answer.
const MOST_PIXELS: u64 = 4 << 20;
/// Pixels of one side that may become one.
const LARGEST_SCALE: u32 = 1 << 16;

/// The bright end of the colour map of differences is at least here, about what two patches beside each other just let see.
const LEAST_DIFFERENCE: f64 = 1.0;

/// Pixels of a picture of `rect` in which so many squared are one.
fn pixels_of(rect: Rect, scale: u32) -> u64 {
    let side = |from: u32, to: u32| u64::from(to.div_ceil(scale) - from / scale);
    side(rect.x0, rect.x1) * side(rect.y0, rect.y1)
}

/// The finest of the allowed scales at which `rect` fits into an answer.
fn finest(rect: Rect, allowed: impl Fn(u32) -> bool) -> u32 {
    let mut powers = (0..=LARGEST_SCALE.ilog2()).map(|n| 1 << n);
    powers.find(|&scale| allowed(scale) && pixels_of(rect, scale) <= MOST_PIXELS).unwrap_or(LARGEST_SCALE)
}

/// The scale of a picture in colour for which none is asked.
pub fn default_scale(rect: Rect) -> u32 {
    finest(rect, |_| true)
}

/// Tables of brightness temperatures by channel, made when first asked for.
#[derive(Default)]
pub struct Thermometers(Mutex<HashMap<usize, Arc<BandTemperature>>>);

impl Thermometers {
    fn of(&self, channels: &Channels, k: usize) -> Arc<BandTemperature> {
        const KEPT: usize = 64;
        let mut kept = self.0.lock().unwrap_or_else(|e| e.into_inner());
        if kept.len() >= KEPT && !kept.contains_key(&k) {
            kept.clear();
        }
        Arc::clone(kept.entry(k).or_insert_with(|| Arc::new(BandTemperature::of(channels, k))))
    }
}

#[derive(Deserialize, Clone, Copy)]
#[serde(deny_unknown_fields)]
pub struct Asked {
    #[serde(default)]
    show: Show,
    /// The channel, or those shown as red, green and blue.
    k: Option<usize>,
    r: Option<usize>,
    g: Option<usize>,
    b: Option<usize>,
    x0: Option<u32>,
    y0: Option<u32>,
    x1: Option<u32>,
    y1: Option<u32>,
    scale: Option<u32>,
    #[serde(default)]
    format: Format,
    ev: Option<f64>,
    /// Under which of both choices.
    choice: Option<Which>,
    white_x: Option<u32>,
    white_y: Option<u32>,
    white_factor: Option<f64>,
    white_luminance: Option<f64>,
    /// Kelvins, samples or differences, at the ends of the colour map.
    low: Option<f64>,
    high: Option<f64>,
}

#[derive(Deserialize, Default, Clone, Copy, PartialEq)]
#[serde(rename_all = "lowercase")]
enum Show {
    #[default]
    Colour,
    Channel,
    False,
    Temperature,
    Samples,
    Difference,
}

#[derive(Deserialize, Default, Clone, Copy, PartialEq)]
#[serde(rename_all = "lowercase")]
enum Format {
    #[default]
    Png,
    F32,
}

pub async fn image(
    State(app): State<Arc<App>>,
    asked: std::result::Result<Query<Asked>, QueryRejection>,
) -> std::result::Result<Response, Refused> {
    let Query(asked) = asked.map_err(|error| Refused::query(&error))?;
    for (name, value) in [("ev", asked.ev), ("low", asked.low), ("high", asked.high)] {
        if value.is_some_and(|value| !value.is_finite()) {
            return Err(Refused::bad(format!("`{name}` must be a finite number")));
        }
    }
    if asked.choice.is_some() || asked.show == Show::Difference {
        relightable(&app)?;
    }
    let (shared, revision) = (Arc::clone(&app), app.feed.snapshot().revision);
    let (window, tone, png) = app
        .read(move |state| {
            let window = asked.window(state, &shared, revision)?;
            let tone = asked.tone(&window);
            let png = (asked.format == Format::Png).then(|| asked.png(&window, tone)).transpose()?;
            Ok((window, tone, png))
        })
        .await?;
    let header = |name: &'static str, value: String| (HeaderName::from_static(name), value);
    let size = header("x-size", format!("{},{}", window.size[0], window.size[1]));
    let planes = header("x-planes", window.planes.to_string());
    let (kind, bytes) = match png {
        Some(bytes) => ("image/png", bytes),
        None => ("application/octet-stream", bytemuck::cast_slice::<f32, u8>(&window.values).to_vec()),
    };
    Ok(([(CONTENT_TYPE, kind.into()), size, planes, asked.tone_header(tone)], Body::from(bytes)).into_response())
}

impl Asked {
    fn window(&self, state: CubeState<'_>, app: &App, revision: u64) -> Result<Window> {
        let refuse = |what: String| Err(Error::Usage(what));
        let ([width, height], channels) = (state.cube().header().size, state.cube().channels());
        let [x0, y0] = [self.x0, self.y0].map(|v| v.unwrap_or(0));
        let rect = Rect { x0, y0, x1: self.x1.unwrap_or(width), y1: self.y1.unwrap_or(height) };
        if rect.x0 >= rect.x1 || rect.y0 >= rect.y1 || rect.x1 > width || rect.y1 > height {
            return refuse(format!("x0, y0, x1, y1 are no part of the picture, which has {width} x {height} pixels"));
        }
        let pixels = |scale: u32| pixels_of(rect, scale);
        // Without a wish, as fine as it may be; of single channels nothing between pixels and blocks.
        let is_fine = matches!(self.show, Show::Colour | Show::Samples | Show::Difference);
        let allowed = |scale: u32| is_fine || scale == 1 || scale >= BLOCK;
        let scale = self.scale.unwrap_or_else(|| finest(rect, allowed));
        if !scale.is_power_of_two() || scale > LARGEST_SCALE {
            return refuse(format!("scale={scale}: a power of two from 1 to {LARGEST_SCALE}"));
        }
        if pixels(scale) > MOST_PIXELS {
            return refuse(format!(
                "{} pixels are asked for; at most {MOST_PIXELS}: take a larger scale",
                pixels(scale)
            ));
        }
        let channel = |name: &str, k: Option<usize>| match k {
            Some(k) if k < channels.len() => Ok(k),
            _ => Err(Error::Usage(format!("{name}: a channel from 0 to {} is needed", channels.len() - 1))),
        };
        let white = WhiteAsked {
            pixel: [self.white_x, self.white_y],
            factor: self.white_factor,
            luminance: self.white_luminance,
        };
        let has_white = white.pixel != [None; 2] || white.factor.is_some() || white.luminance.is_some();
        if has_white && self.show != Show::Difference {
            return refuse("white_… go with show=difference only".into());
        }
        // Under a choice, or as it was rendered.
        let colour = |state: CubeState<'_>| {
            let relit = |which| app.relighting.changed(state, which, |relit| relit.colour(rect, scale));
            self.choice.map(relit).transpose()?.flatten().map_or_else(|| state.colour(rect, scale), Ok)
        };
        let in_channels = |channels: &[usize]| {
            let relit = |which| app.relighting.changed(state, which, |relit| relit.channels(channels, rect, scale));
            self.choice.map(relit).transpose()?.flatten().map_or_else(|| state.channels(channels, rect, scale), Ok)
        };
        match self.show {
            Show::Colour => colour(state),
            Show::Samples | Show::Difference if self.choice.is_some() => {
                refuse("`choice` goes with what differs by choice: colour, channel, false, temperature".into())
            }
            Show::Samples => state.sample_counts(rect, scale),
            Show::Difference => {
                app.relighting.both(state, revision, white, |[a, b], white| a.differences(&b, white, rect, scale))
            }
            Show::Channel => in_channels(&[channel("k", self.k)?]),
            Show::False => {
                let rgb = [channel("r", self.r)?, channel("g", self.g)?, channel("b", self.b)?];
                in_channels(&rgb)
            }
            Show::Temperature => {
                let k = channel("k", self.k)?;
                if state.cube().is_counts() {
                    return refuse("these are counts of a sensor: temperatures are those of radiance".into());
                }
                if !is_thermal(channels, k) {
                    return refuse(format!(
                        "k={k}: its centre is below {THERMAL_NM} nm, where nothing glows by itself"
                    ));
                }
                let thermometer = app.thermometers.of(channels, k);
                let mut window = in_channels(&[k])?;
                window.values.iter_mut().for_each(|v| *v = thermometer.kelvin(f64::from(*v)) as f32);
                Ok(window)
            }
        }
    }

    /// How the values are shown where nobody has said how: the exposure, or the ends of the colour map.
    fn tone(&self, window: &Window) -> Tone {
        match self.show {
            Show::Temperature => {
                let [low, high] = shown_range(percentiles(&window.values));
                Tone::Range([self.low.unwrap_or(low), self.high.unwrap_or(high)])
            }
            Show::Samples => {
                let lit = || window.values.iter().copied().filter(|n| !n.is_nan());
                // Always something to see.
                let least = lit().reduce(f32::min).map_or(1.0, f64::from);
                let most = lit().reduce(f32::max).map_or(1.0, f64::from).max(2.0 * least);
                Tone::Range([self.low.unwrap_or(least), self.high.unwrap_or(most)])
            }
            Show::Difference => {
                let most = percentiles(&window.values)[1].max(LEAST_DIFFERENCE);
                Tone::Range([self.low.unwrap_or(0.0), self.high.unwrap_or(most)])
            }
            _ => Tone::Exposure(self.ev.unwrap_or_else(|| auto_exposure(&window.values, window.planes))),
        }
    }

    fn png(&self, window: &Window, tone: Tone) -> Result<Vec<u8>> {
        let made = match tone {
            Tone::Exposure(_) if window.planes != 3 => tone.srgb8(&window.clone().into_picture().rgb),
            // Each step as many times more.
            Tone::Range(range) if self.show == Show::Samples => {
                let values: Vec<f32> = window.values.iter().map(|samples| samples.log2()).collect();
                Tone::Range(range.map(f64::log2)).srgb8(&values)
            }
            _ => tone.srgb8(&window.values),
        };
        png::encode(window.size, &made).map_err(|error| Error::Internal(format!("PNG: {error}")))
    }

    /// What the answer says of how it is shown.
    fn tone_header(&self, tone: Tone) -> (HeaderName, String) {
        match tone {
            Tone::Exposure(ev) => (HeaderName::from_static("x-exposure-ev"), ev.to_string()),
            Tone::Range([low, high]) => {
                let name = match self.show {
                    Show::Samples => "x-range-samples",
                    Show::Difference => "x-range-de",
                    _ => "x-range-k",
                };
                (HeaderName::from_static(name), format!("{low},{high}"))
            }
        }
    }
}
