//! The file of a sensor model, read with the same care as a scene: `[optics]`, `[detector]`, bands.

use std::path::Path;

use super::Quantity;
use super::context::Context;
use super::decode::{Fields, Item};
use super::keys;
use super::spectrum::{Spectra, report_in_file};
use super::tree;
use crate::error::{Error, Result};
use crate::format::mtf::{self, MtfTable};
use crate::format::response;
use crate::spectral::{Channels, Curve, Response};

/// A sensor: SI units but for wavelengths, which are nm.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorModel {
    pub optics: Optics,
    /// Side of a square pixel, m.
    pub pitch: f64,
    /// Pixels of the cube, along each axis, that make one of the detector.
    pub oversampling: u32,
    /// Share of a pixel that is sensitive, (0, 1].
    pub fill_factor: f64,
    pub bits: u32,
    /// Counts without light.
    pub offset: f64,
    /// Relative standard deviation of the response over pixels.
    pub prnu: f64,
    /// Standard deviation of the dark signal over pixels: electrons, or counts of a thermal detector.
    pub dsnu: f64,
    /// Of the fixed patterns, which all exposures share.
    pub pattern_seed: u64,
    pub kind: Detector,
    /// Names and responses; `None` is the interval of all channels.
    pub bands: Option<Vec<(String, Response)>>,
    /// Of the black body that NETD is told for, K.
    pub reference_temperature: f64,
    pub warnings: Vec<String>,
}

impl SensorModel {
    /// The largest count of its converter.
    pub fn most(&self) -> u32 {
        (1 << self.bits) - 1
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Optics {
    pub f_number: f64,
    pub transmittance: Curve,
    pub blur: Blur,
    /// m; known wherever `cos4` is true.
    pub focal_length: Option<f64>,
    /// Whether irradiance falls as cos⁴ of the angle to the axis.
    pub cos4: bool,
    /// K; optics without one emit nothing.
    pub temperature: Option<f64>,
    /// F-number of the cone from which the warm optics shine; `None`: the hemisphere.
    pub cold_shield: Option<f64>,
}

/// How optics spread the light of a point. The aperture of a pixel is no part of it: a cube's pixels are means already.
#[derive(Debug, Clone, PartialEq)]
pub enum Blur {
    None,
    /// Standard deviation along each axis, pixels of the detector.
    Gaussian(f64),
    /// Of a circular aperture without aberrations, by wavelength and F-number.
    Diffraction,
    /// At all wavelengths alike.
    Measured(MtfTable),
}

/// The camera of the cube that a model is used on.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Seen {
    /// Tangent of the angle that a pixel of the cube spans on the axis; `None` where the cube does not tell.
    pub pixel_tangent: Option<f64>,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Detector {
    Photon {
        /// s.
        integration_time: f64,
        quantum_efficiency: Curve,
        /// Electrons/s.
        dark_current: f64,
        /// Electrons.
        full_well: Option<f64>,
        /// Electrons.
        read_noise: f64,
        /// Electrons a count.
        gain: f64,
    },
    Thermal {
        absorptance: Curve,
        /// Counts/W.
        responsivity: f64,
        /// W.
        noise_equivalent_power: f64,
    },
}

/// How far pitch over focal length may be from the angle of the cube's pixels.
const SAME_ANGLE: f64 = 0.01;

/// Reads the model in `file`, to be used on a cube of these channels, rendered with this camera.
///
/// # Errors
/// [`Error::Input`] with every independent mistake; one of pitch and focal length that contradict the camera.
pub fn load_sensor(file: &Path, channels: &Channels, seen: Seen) -> Result<SensorModel> {
    let text = std::fs::read_to_string(file).map_err(|e| Error::input(file, format!("cannot be read: {e}")))?;
    parse_sensor(&text, file, channels, seen)
}

/// [`load_sensor`] on a text; `file` only locates relative paths and messages.
pub fn parse_sensor(text: &str, file: &Path, channels: &Channels, seen: Seen) -> Result<SensorModel> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let cx = Context::new(file, text, &[]);
    let Some(root) = cx.document() else { return Err(Error::Input(cx.finish().0)) };
    let model = decode(&cx, &root, channels, seen);
    let (problems, warnings) = cx.finish();
    if !problems.is_empty() {
        return Err(Error::Input(problems));
    }
    let model = model.ok_or_else(|| Error::Internal("a sensor was refused without saying why".to_owned()))?;
    Ok(SensorModel { warnings, ..model })
}

const PITCH: &str = "greater than 0 and at most 0.1 (m), such as 15e-6";

fn decode<'a>(cx: &'a Context<'a>, root: &'a [tree::Entry], channels: &Channels, seen: Seen) -> Option<SensorModel> {
    let top = Fields::root(cx, root, &keys::SENSOR);
    let mut spectra = Spectra::new(cx, top.get("spectra"), Some(channels.clone()));
    let optics = top.require("optics", "[optics] with f_number").and_then(|item| optics(&item, &mut spectra));
    let detector =
        top.require("detector", "[detector] with pitch and bits").and_then(|item| item.table(&keys::DETECTOR));
    let bands = bands(&top);
    let reference_temperature = number(&top, "reference_temperature", 300.0, |v| v > 0.0, "greater than 0 (K)");
    let detector = detector?;
    let kind = detector.get("kind").map_or(Some(false), |item| item.choice(&[("photon", false), ("thermal", true)]));
    let kind =
        kind.and_then(
            |is_thermal| {
                if is_thermal { thermal(&detector, &mut spectra) } else { photon(&detector, &mut spectra) }
            },
        );
    let oversampling = detector.get("oversampling").map_or(Some(1), |item| item.whole(1..=64));
    // In metres: 15 is one in micrometres.
    let pitch = detector.get("pitch").map(|_| number(&detector, "pitch", 0.0, |v| v > 0.0 && v <= 0.1, PITCH));
    let fill_factor = number(&detector, "fill_factor", 1.0, |v| v > 0.0 && v <= 1.0, "greater than 0 and at most 1");
    let bits = detector.require("bits", "bits = 12").and_then(|item| item.whole(1..=24));
    let offset = number(&detector, "offset", 0.0, |v| v >= 0.0, "0 or greater");
    let prnu = number(&detector, "prnu", 0.0, |v| (0.0..=0.1).contains(&v), "from 0 to 0.1");
    let dsnu = number(&detector, "dsnu", 0.0, |v| v >= 0.0, "0 or greater");
    let pattern_seed = detector.get("pattern_seed").map_or(Some(0), |item| item.whole(0..=u32::MAX));
    let (mut optics, mut kind) = (optics?, kind?);
    let pitch = fit(&detector, &mut optics.0, pitch, oversampling?, seen);
    let all = spectra.finish();
    let curve = |id: usize| all[id].curve.clone();
    if let Some(id) = optics.1 {
        optics.0.transmittance = curve(id);
    }
    if let (Detector::Photon { quantum_efficiency: of, .. } | Detector::Thermal { absorptance: of, .. }, Some(id)) =
        (&mut kind.0, kind.1)
    {
        *of = curve(id);
    }
    Some(SensorModel {
        optics: optics.0,
        pitch: pitch?,
        oversampling: oversampling?,
        fill_factor: fill_factor?,
        bits: bits?,
        offset: offset?,
        prnu: prnu?,
        dsnu: dsnu?,
        pattern_seed: pattern_seed?.into(),
        kind: kind.0,
        bands: bands?,
        reference_temperature: reference_temperature?,
        warnings: Vec::new(),
    })
}

/// A number, or the one that holds in its absence.
fn number(fields: &Fields, key: &str, absent: f64, allowed: impl Fn(f64) -> bool, range: &str) -> Option<f64> {
    fields.get(key).map_or(Some(absent), |item| item.number_where(allowed, range))
}

/// An optional number above zero: `Some(None)` where it is absent.
fn positive(fields: &Fields, key: &str) -> Option<Option<f64>> {
    fields.get(key).map_or(Some(None), |item| item.positive().map(Some))
}

/// What is decoded, and the spectrum that goes with it.
type WithSpectrum<T> = Option<(T, Option<usize>)>;

fn optics<'a>(item: &Item<'a>, spectra: &mut Spectra<'a>) -> WithSpectrum<Optics> {
    let fields = item.table(&keys::OPTICS)?;
    let transmittance = match fields.get("transmittance") {
        Some(item) => spectra.resolve(&item, Quantity::Transmittance).map(|handle| Some(spectra.take(handle))),
        None => Some(None),
    };
    let temperature = fields.get("temperature").map_or(Some(None), |item| super::material::kelvin(&item).map(Some));
    let not_below_half = |v: f64| v >= 0.5;
    let range = "0.5 or greater: no lens in air is faster";
    let shield = fields.get("cold_shield").map_or(Some(None), |i| i.number_where(not_below_half, range).map(Some));
    let stated = fields.get("f_number").map_or(Some(None), |i| i.number_where(not_below_half, range).map(Some));
    let (aperture, focal) = (positive(&fields, "aperture")?, positive(&fields, "focal_length")?);
    let f_number = match (stated?, aperture, focal) {
        (Some(_), Some(_), Some(_)) => {
            fields.error_help("has f_number beside aperture and focal_length", "keep f_number, or the two others");
            return None;
        }
        (Some(_), Some(_), None) => {
            fields.error_help("has f_number beside aperture", "keep one of the two");
            return None;
        }
        (Some(stated), _, _) => stated,
        (None, Some(aperture), Some(focal)) if focal / aperture >= 0.5 => focal / aperture,
        (None, Some(aperture), Some(focal)) => {
            fields.error_help(
                format!("focal_length / aperture is {}, but must be {range}", focal / aperture),
                "use a smaller aperture",
            );
            return None;
        }
        (None, ..) => {
            fields.error_help("has no f_number", "add f_number, or aperture and focal_length");
            return None;
        }
    };
    let cos4 = fields.get("cos4").map_or(Some(false), |item| item.boolean())?;
    let blur = blur(&fields)?;
    let optics = Optics {
        f_number,
        transmittance: Curve::Constant(1.0),
        blur,
        focal_length: focal,
        cos4,
        temperature: temperature?,
        cold_shield: shield?,
    };
    if optics.cold_shield.is_some() && optics.temperature.is_none() {
        fields.error_help("has a cold_shield, but no temperature", "add temperature, or remove cold_shield");
        return None;
    }
    Some((optics, transmittance?))
}

fn blur(fields: &Fields) -> Option<Blur> {
    #[derive(Clone, Copy, PartialEq)]
    enum Psf {
        None,
        Gaussian,
        Diffraction,
    }
    let words = [("none", Psf::None), ("gaussian", Psf::Gaussian), ("diffraction", Psf::Diffraction)];
    let psf = fields.get("psf").map_or(Some(Psf::None), |item| item.choice(&words))?;
    let sigma = positive(fields, "psf_sigma")?;
    if let Some(item) = fields.get("psf_sigma").filter(|_| psf != Psf::Gaussian) {
        item.error_help("belongs to psf = \"gaussian\"", "write that, or remove it");
        return None;
    }
    if let Some(item) = fields.get("mtf") {
        if fields.has("psf") {
            item.error_help("stands beside psf", "keep one of the two");
            return None;
        }
        let read = mtf::read(&item.cx.path(item.text()?));
        return read.map(Blur::Measured).map_err(|problem| report_in_file(&item, *problem)).ok();
    }
    match (psf, sigma) {
        (Psf::None, _) => Some(Blur::None),
        (Psf::Diffraction, _) => Some(Blur::Diffraction),
        (Psf::Gaussian, Some(sigma)) => Some(Blur::Gaussian(sigma)),
        (Psf::Gaussian, None) => {
            fields.error_help("has psf = \"gaussian\", but no psf_sigma", "add psf_sigma = 0.5 (pixels)");
            None
        }
    }
}

/// Pitch, and a focal length beside it, such that they fit the camera's angle: where one is not written the camera gives it.
fn fit(
    detector: &Fields,
    optics: &mut Optics,
    written: Option<Option<f64>>,
    oversampling: u32,
    seen: Seen,
) -> Option<f64> {
    // Of a pixel of the detector, which is several of the cube's.
    let tangent = seen.pixel_tangent.map(|tangent| tangent * f64::from(oversampling));
    let pitch = match (written, optics.focal_length, tangent) {
        (Some(pitch), ..) => pitch?,
        (None, Some(focal_length), Some(tangent)) => focal_length * tangent,
        (None, ..) => {
            detector.require("pitch", "pitch = 15e-6 (m)");
            return None;
        }
    };
    match (optics.focal_length, tangent) {
        (Some(focal_length), Some(tangent)) if (pitch / focal_length / tangent - 1.0).abs() > SAME_ANGLE => {
            let message = format!(
                "pitch / focal_length is {:.6}, but the cube's camera has pixels of {tangent:.6} (tangent of the angle on the axis)",
                pitch / focal_length
            );
            let help = format!(
                "with this pitch the focal length is {:.6} m; or remove one of the two, which then follows from the camera",
                pitch / tangent
            );
            match detector.get("pitch") {
                Some(item) => item.error_help(message, help),
                None => detector.error_help(message, help),
            }
            return None;
        }
        (None, Some(tangent)) => optics.focal_length = Some(pitch / tangent),
        (Some(_), None) => {
            detector
                .warn("the cube does not tell its camera's angle: pitch and focal_length are taken as they are".into());
        }
        (None, None) if optics.cos4 => {
            detector.error_help(
                "has no angle for cos4: the cube does not tell its camera's",
                "add optics.focal_length, or remove cos4",
            );
            return None;
        }
        _ => {}
    }
    Some(pitch)
}

/// Refuses keys that mean nothing for this kind of detector.
fn refuse(fields: &Fields, kind: &str, keys: &[&str]) {
    for item in keys.iter().filter_map(|key| fields.get(key)) {
        item.error_help(format!("is not for {kind} detectors"), "remove it, or change `kind`");
    }
}

fn photon<'a>(fields: &Fields<'a>, spectra: &mut Spectra<'a>) -> WithSpectrum<Detector> {
    refuse(fields, "photon", &["responsivity", "noise_equivalent_power", "absorptance"]);
    let efficiency = fields.require("quantum_efficiency", "quantum_efficiency = 0.6, or a table");
    let efficiency = efficiency.and_then(|item| spectra.resolve(&item, Quantity::Efficiency));
    let time = fields.require("integration_time", "integration_time = 0.01 (s)").and_then(|item| item.positive());
    let gain = fields.require("gain", "gain = 2.5 (electrons a count)").and_then(|item| item.positive());
    let dark = number(fields, "dark_current", 0.0, |v| v >= 0.0, "0 or greater");
    let read = number(fields, "read_noise", 0.0, |v| v >= 0.0, "0 or greater");
    let well = positive(fields, "full_well");
    let detector = Detector::Photon {
        integration_time: time?,
        quantum_efficiency: Curve::Constant(1.0),
        dark_current: dark?,
        full_well: well?,
        read_noise: read?,
        gain: gain?,
    };
    Some((detector, Some(spectra.take(efficiency?))))
}

fn thermal<'a>(fields: &Fields<'a>, spectra: &mut Spectra<'a>) -> WithSpectrum<Detector> {
    let of_photons = ["integration_time", "quantum_efficiency", "dark_current", "full_well", "read_noise", "gain"];
    refuse(fields, "thermal", &of_photons);
    let absorptance = match fields.get("absorptance") {
        Some(item) => spectra.resolve(&item, Quantity::Absorptance).map(|handle| Some(spectra.take(handle))),
        None => Some(None),
    };
    let responsivity =
        fields.require("responsivity", "responsivity = 1e11 (counts/W)").and_then(|item| item.positive());
    let noise = fields.require("noise_equivalent_power", "noise_equivalent_power = 2e-11 (W)");
    let noise = noise.and_then(|item| item.not_negative());
    let detector = Detector::Thermal {
        absorptance: Curve::Constant(1.0),
        responsivity: responsivity?,
        noise_equivalent_power: noise?,
    };
    Some((detector, absorptance?))
}

fn bands(top: &Fields) -> Option<Option<Vec<(String, Response)>>> {
    if let Some(item) = top.get("responses") {
        if top.has("bands") {
            item.error_help("stands beside [[bands]]", "keep one of the two");
            return None;
        }
        let read = response::read_shares(&item.cx.path(item.text()?));
        let read = read.map_err(|problem| report_in_file(&item, *problem)).ok()?;
        read.warnings.into_iter().for_each(|warning| top.warn(warning));
        return Some(Some(read.named));
    }
    let Some(list) = top.get("bands") else { return Some(None) };
    let mut bands: Vec<(String, Response)> = Vec::new();
    let items = list.array()?;
    if items.is_empty() {
        list.error_help("has no band", "add one, or remove it");
        return None;
    }
    for item in &items {
        let fields = item.table(&keys::BAND)?;
        let name = fields.require("name", "name = \"MWIR\"").and_then(|item| item.text())?;
        if bands.iter().any(|(other, _)| other == name) {
            item.error_help(format!("there are two bands \"{name}\""), "give each a name of its own");
            return None;
        }
        if let Some(file) = fields.get("response") {
            if fields.has("from") || fields.has("to") {
                file.error_help("stands beside from and to", "keep it, or the two others");
                return None;
            }
            bands.push((name.to_owned(), band_response(top, &file, name)?));
            continue;
        }
        let end = |key: &str| fields.require(key, &format!("{key} = 3500 (nm)")).and_then(|item| item.positive());
        let (from, to) = (end("from")?, end("to")?);
        match Response::new(vec![from, to], vec![1.0, 1.0]) {
            Ok(response) if from < to => bands.push((name.to_owned(), response)),
            _ => {
                item.error_help(
                    format!("from {from} to {to} nm is no interval"),
                    "write the shorter wavelength as `from`",
                );
                return None;
            }
        }
    }
    Some(Some(bands))
}

/// The response in a file of one, or the one that is called like the band.
fn band_response(top: &Fields, item: &Item, name: &str) -> Option<Response> {
    let read = response::read_shares(&item.cx.path(item.text()?));
    let read = read.map_err(|problem| report_in_file(item, *problem)).ok()?;
    read.warnings.into_iter().for_each(|warning| top.warn(warning));
    let mut named = read.named;
    if named.len() == 1 {
        return named.pop().map(|(_, response)| response);
    }
    let found = named.iter().position(|(other, _)| other == name);
    if found.is_none() {
        let all: Vec<&str> = named.iter().map(|(other, _)| other.as_str()).collect();
        item.error_help(
            format!("has several responses, none of them called \"{name}\": {}", all.join(", ")),
            "call the band as one of them",
        );
    }
    found.map(|at| named.swap_remove(at).1)
}
