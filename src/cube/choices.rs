//! What a few samples decided before a render began: which paths of it are evaluated, and at how many wavelengths. It stays with the
//! cube, so that whoever joins or goes on renders the same.

use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::store::{Cube, PRIVATE};
use crate::{Error, Result, files};

const CHOICES: &str = "choices.json";
const BRIGHTNESS: &str = "brightness.json";

/// Written once, in `.spectile/choices.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Choices {
    /// At how many wavelengths of each channel a path is evaluated. Cubes made before there was a choice say nothing, and have 1.
    #[serde(default = "one")]
    pub wavelengths_per_channel: u32,
    /// Efficiency (1 / (time x variance), mean over channels) over that of one wavelength, as expected.
    #[serde(default = "no_gain")]
    pub wavelengths_gain: f64,
    /// Why so many, in words.
    #[serde(default)]
    pub wavelengths_reason: String,
    /// Why so many paths, in words.
    pub reason: String,
    /// What a path's energy is multiplied with to be its chance of being evaluated; `None` where all are.
    #[serde(deserialize_with = "Option::deserialize")] // Not `None` where it is missing.
    pub scale: Option<f64>,
    /// Share of the paths that is expected to be evaluated.
    pub evaluated: f64,
    /// Efficiency (1 / (time x variance), mean over channels) over that of evaluating all paths, as expected.
    pub gain: f64,
    /// Variance of the channel that suffers most, over that with all paths, as expected.
    pub variance: f64,
    /// Means over paths of the pilot: rays, records, those that look up an environment map, and voxels that are marched through; 0 where no
    /// pilot was needed.
    #[serde(default)]
    pub rays: f64,
    #[serde(default)]
    pub records: f64,
    #[serde(default)]
    pub map_records: f64,
    #[serde(default)]
    pub voxels: f64,
    /// Samples of the pilot, all pixels together; 0 where none was needed.
    pub samples: u32,
    /// Mean radiance of the picture in every channel that devices render, W m⁻² sr⁻¹ nm⁻¹, as far as the pilot knows.
    pub mean_radiance: Vec<f64>,
}

fn one() -> u32 {
    1
}

fn no_gain() -> f64 {
    1.0
}

impl Choices {
    /// How many wavelengths, in a line, for people.
    pub fn describe_wavelengths(&self) -> String {
        let gain = match self.wavelengths_gain {
            1.0 => String::new(),
            gain => format!(", {gain:.2} times the efficiency of one expected"),
        };
        let reason = if self.wavelengths_reason.is_empty() { "as always" } else { &self.wavelengths_reason };
        let count = match self.wavelengths_per_channel {
            1 => "1 wavelength".to_owned(),
            several => format!("{several} wavelengths"),
        };
        format!("{count} a channel{gain} ({reason})")
    }

    /// Which paths, in a line, for people.
    pub fn describe(&self) -> String {
        match self.scale {
            None => format!("all paths: {}", self.reason),
            Some(scale) => format!(
                "roulette: a path that brings the mean is evaluated with {:.2}, {:.1} % of all are; {:.2} times the efficiency of all \
                 paths expected, at most {:.2} times the variance ({})",
                scale.min(1.0),
                100.0 * self.evaluated,
                self.gain,
                self.variance,
                self.reason
            ),
        }
    }

    /// Those of the cube at `path`, if it has any.
    pub fn read(path: &Path) -> Result<Option<Choices>> {
        read(path, CHOICES)
    }

    /// Writes them into the cube, unless it has some: those that it has then.
    pub fn record(self, cube: &Cube) -> Result<Choices> {
        record(self, cube, CHOICES)
    }
}

/// How bright the picture is, as far as a few samples tell: what the errors of its tiles are measured by.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Brightness {
    /// In every channel of the cube, W m⁻² sr⁻¹ nm⁻¹ (or what its channels integrate).
    pub mean_radiance: Vec<f64>,
    /// All pixels together.
    pub samples: u32,
}

impl Brightness {
    /// That of the cube at `path`, if somebody has noted it.
    pub fn read(path: &Path) -> Result<Option<Brightness>> {
        read(path, BRIGHTNESS)
    }

    /// Writes it into the cube, unless it has one: that one then.
    pub(super) fn record(self, cube: &Cube) -> Result<Brightness> {
        record(self, cube, BRIGHTNESS)?.checked(cube)
    }

    /// The same, of as many channels as the cube has.
    pub(super) fn checked(self, cube: &Cube) -> Result<Brightness> {
        let (told, channels) = (self.mean_radiance.len(), cube.channels().len());
        if told == channels && self.mean_radiance.iter().all(|mean| mean.is_finite()) {
            return Ok(self);
        }
        let what = format!("tells the brightness of {told} channels where the cube has {channels}: put the file back");
        Err(Error::storage(&cube.private().join(BRIGHTNESS), what))
    }
}

fn read<T: DeserializeOwned>(path: &Path, name: &str) -> Result<Option<T>> {
    let file = path.join(PRIVATE).join(name);
    let text = match fs::read(&file) {
        Ok(text) => text,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(Error::storage(&file, format!("cannot be read: {error}"))),
    };
    let what = "is damaged: render the scene into a new cube, or put the file back";
    serde_json::from_slice(&text).map(Some).map_err(|error| Error::storage(&file, format!("{what} ({error})")))
}

/// Writes `value` into the cube under `name`, unless there is something, which it gives then.
fn record<T: Serialize + DeserializeOwned>(value: T, cube: &Cube, name: &str) -> Result<T> {
    let file = cube.private().join(name);
    let aside = files::sibling(&file, "creating");
    let failed = |error: std::io::Error| Error::storage(&file, format!("cannot be written: {error}"));
    let text = serde_json::to_string(&value).expect("plain values");
    files::write_durably(&aside, text.as_bytes()).map_err(failed)?;
    // The first one stays, whole: a link fails where there is something.
    let linked = fs::hard_link(&aside, &file);
    let _ = fs::remove_file(&aside);
    match linked {
        Ok(()) => {
            files::sync_folder(files::parent(&file)).map_err(failed)?;
            Ok(value)
        }
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {
            read(cube.path(), name)?.ok_or_else(|| failed(ErrorKind::NotFound.into()))
        }
        // No links here: whoever of two is second replaces the first one's, which says the same where they are of one kind.
        Err(_) => {
            if let Some(there) = read(cube.path(), name)? {
                return Ok(there);
            }
            files::write_atomically(&file, text.as_bytes())?;
            Ok(value)
        }
    }
}
