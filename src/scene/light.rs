//! `[[lights]]`: light that comes from no surface.

use glam::DVec3;
use toml::value::Datetime;

use super::decode::{Fields, Item};
use super::keys;
use super::spectrum::{Handle, Quantity, Spectra};
use super::tree::Value;
use super::{SpectrumId, sun};

/// Degrees. Smaller disks are too narrow for a device to tell which directions are inside; larger ones are no disks.
const ANGULAR_RADIUS: std::ops::RangeInclusive<f64> = 0.001..=90.0;

/// Light that comes from no surface.
#[derive(Debug, Clone, PartialEq)]
pub enum Light {
    Point {
        position: DVec3,
        /// W sr⁻¹ nm⁻¹, the same in all directions.
        intensity: SpectrumId,
    },
    /// A point that shines into a cone.
    Spot {
        position: DVec3,
        /// In which the light on the cone's axis travels; a unit vector.
        direction: DVec3,
        /// W sr⁻¹ nm⁻¹ on the axis.
        intensity: SpectrumId,
        cone: Cone,
    },
    Directional {
        /// In which the light travels; a unit vector.
        direction: DVec3,
        /// W m⁻² nm⁻¹ on a plane facing the light.
        irradiance: SpectrumId,
    },
    /// A disk at infinity, the same radiance all over, visible also to the camera.
    Sun {
        /// In which the light of its centre travels; a unit vector.
        direction: DVec3,
        /// Between centre and rim, radians, up to π/2.
        angular_radius: f64,
        /// W m⁻² nm⁻¹ on a plane facing its centre.
        irradiance: SpectrumId,
    },
}

/// How the intensity of a spot depends on the angle θ to its axis, in radians: 1 up to `falloff`, 0 from `half_angle` on, and
/// as the profile says between.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cone {
    /// In (0, π].
    pub half_angle: f64,
    /// In [0, `half_angle`].
    pub falloff: f64,
    pub profile: Profile,
}

/// How a spot's intensity falls from 1 to 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Profile {
    /// t²(3 - 2t), t = (cos θ - cos `half_angle`) / (cos `falloff` - cos `half_angle`).
    Smooth,
    /// t = (`half_angle` - θ) / (`half_angle` - `falloff`).
    Linear,
}

impl Light {
    /// Its spectrum: intensity or irradiance.
    pub fn spectrum(&self) -> SpectrumId {
        match self {
            Light::Point { intensity, .. } | Light::Spot { intensity, .. } => *intensity,
            Light::Directional { irradiance, .. } | Light::Sun { irradiance, .. } => *irradiance,
        }
    }
}

/// Decodes every light that is right; mistakes are recorded.
pub fn decode_lights<'a>(item: Option<Item<'a>>, spectra: &mut Spectra<'a>) -> Vec<Light> {
    let items = item.and_then(|item| item.array()).unwrap_or_default();
    items.iter().filter_map(|item| decode(item, spectra)).collect()
}

fn decode<'a>(item: &Item<'a>, spectra: &mut Spectra<'a>) -> Option<Light> {
    let kind = item.table(&keys::LIGHT)?.exactly_one("kind of light")?;
    match kind.path.rsplit('.').next() {
        Some("point") => {
            let fields = kind.table(&keys::POINT)?;
            let position = fields.require("position", "position = [0, 0, 0]").and_then(|item| item.vector());
            let intensity = spectrum(&fields, "intensity", Quantity::Intensity, spectra);
            Some(Light::Point { position: position?, intensity: spectra.take(intensity?) })
        }
        Some("spot") => {
            let fields = kind.table(&keys::SPOT)?;
            let position = fields.require("position", "position = [0, 0, 0]").and_then(|item| item.vector());
            let direction = direction(&fields);
            let intensity = spectrum(&fields, "intensity", Quantity::Intensity, spectra);
            let cone = cone(&fields);
            let (position, direction) = (position?, direction?);
            Some(Light::Spot { position, direction, intensity: spectra.take(intensity?), cone: cone? })
        }
        Some("directional") => {
            let fields = kind.table(&keys::DIRECTIONAL)?;
            let direction = direction(&fields);
            let irradiance = spectrum(&fields, "irradiance", Quantity::Irradiance, spectra);
            Some(Light::Directional { direction: direction?, irradiance: spectra.take(irradiance?) })
        }
        _ => {
            let fields = kind.table(&keys::SUN)?;
            let placed = placed_sun(&fields);
            let radius = fields.get("angular_radius").map_or(Some(None), |item| {
                let degrees = item.positive()?;
                if !ANGULAR_RADIUS.contains(&degrees) {
                    let [least, most] = [ANGULAR_RADIUS.start(), ANGULAR_RADIUS.end()];
                    let message = format!("must lie in [{least}, {most}] degrees, but is {degrees}");
                    item.error_help(message, "what is smaller is a `directional` light, what is larger an environment");
                    return None;
                }
                Some(Some(degrees))
            });
            let irradiance = spectrum(&fields, "irradiance", Quantity::Irradiance, spectra);
            let (Sun { direction, distance }, degrees) = (placed?, radius?);
            let irradiance = match distance {
                // Who gives an irradiance of their own gives that of the day.
                Some(distance) if spectra.is_standard(&fields.get("irradiance")?) => {
                    spectra.times(irradiance?, distance.powi(-2))
                }
                _ => irradiance?,
            };
            let degrees = degrees.unwrap_or(sun::ANGULAR_RADIUS / distance.unwrap_or(1.0));
            let angular_radius = degrees.to_radians();
            Some(Light::Sun { direction, angular_radius, irradiance: spectra.take(irradiance) })
        }
    }
}

fn cone(fields: &Fields) -> Option<Cone> {
    let half_angle =
        fields.require("half_angle", "half_angle = 30, in degrees, where the light ends").and_then(|item| {
            item.number_where(|degrees| degrees > 0.0 && degrees <= 180.0, "an angle in (0, 180] degrees")
        });
    let profile = fields
        .get("profile")
        .map_or(Some(Profile::Smooth), |item| item.choice(&[("smooth", Profile::Smooth), ("linear", Profile::Linear)]));
    let half_angle = half_angle?;
    let falloff = fields.get("falloff").map_or(Some(half_angle), |item| {
        let range = format!("an angle in [0, {half_angle}] degrees, up to `half_angle`");
        item.number_where(|degrees| (0.0..=half_angle).contains(&degrees), &range)
    });
    let (half_angle, falloff) = (half_angle.to_radians(), falloff?.to_radians());
    Some(Cone { half_angle, falloff, profile: profile? })
}

/// A sun in the scene.
struct Sun {
    /// Of its light.
    direction: DVec3,
    /// In astronomical units, where a date tells.
    distance: Option<f64>,
}

/// The sun by the direction of its light, by where it stands, or by date and place.
fn placed_sun(fields: &Fields) -> Option<Sun> {
    const BY_PLACE: [&str; 2] = ["azimuth", "elevation"];
    const BY_DATE: [&str; 3] = ["date", "latitude", "longitude"];
    let first_of = |keys: &[&str]| keys.iter().find_map(|key| fields.get(key));
    let ways = [fields.get("direction"), first_of(&BY_PLACE), first_of(&BY_DATE)];
    if let [_, second, ..] = &ways.iter().flatten().collect::<Vec<_>>()[..] {
        second.error_help(
            "says once more where the sun stands",
            "keep one of `direction`, `azimuth` and `elevation`, or `date`, `latitude` and `longitude`",
        );
        return None;
    }
    let axis = |key: &str| fields.get(key).map(|item| item.direction());
    let (north, up) = (axis("north"), axis("up").unwrap_or(Some(DVec3::Y)));
    let (azimuth, elevation, distance) = match ways {
        [_, Some(_), _] => {
            let azimuth = fields.require("azimuth", "azimuth = 135, in degrees from north over east");
            let elevation = fields.require("elevation", "elevation = 40, in degrees above the horizon");
            let azimuth = azimuth.and_then(|item| degrees(&item, 360.0));
            (azimuth?, elevation.and_then(|item| degrees(&item, 90.0))?, None)
        }
        [_, _, Some(_)] => {
            let date = fields.require("date", "date = \"2026-06-21T10:30:00Z\"");
            let latitude = fields.require("latitude", "latitude = 43.6, in degrees north");
            let longitude = fields.require("longitude", "longitude = 5.1, in degrees east");
            let latitude = latitude.and_then(|item| degrees(&item, 90.0));
            let longitude = longitude.and_then(|item| degrees(&item, 180.0));
            let date = date.and_then(|item| moment(&item).map(|date| (date, item)));
            let ((date, item), latitude, longitude) = (date?, latitude?, longitude?);
            match sun::position(&date, latitude, longitude) {
                Ok(sun) => (sun.azimuth, sun.elevation, Some(sun.distance)),
                Err(what) => {
                    item.error_help(what, "write e.g. \"2026-06-21T10:30:00Z\", or +02:00 in the place of Z");
                    return None;
                }
            }
        }
        _ => {
            let help = "azimuth = 135 and elevation = 40; or date, latitude and longitude; or direction = [0, -1, 0], in which its light \
                        travels";
            let given = fields.require("direction", help).and_then(|item| item.direction());
            if let Some(item) = first_of(&["north", "up"]) {
                item.error_help("says nothing beside `direction`", "remove it, or give `azimuth` and `elevation`");
                return None;
            }
            return given.map(|direction| Sun { direction, distance: None });
        }
    };
    let up = up?;
    // Where up is z, maps have their north at the top: +y.
    let north = match north {
        Some(north) => north?,
        None if up.z.abs() > 0.999_999 => DVec3::Y,
        None => DVec3::NEG_Z,
    };
    let Some(direction) = sun::travels(azimuth, elevation, north, up) else {
        let item = first_of(&["north", "up"])?;
        item.error_help("`north` and `up` must not be parallel", "write e.g. up = [0, 0, 1] and north = [0, 1, 0]");
        return None;
    };
    if elevation < 0.0 {
        let path = &first_of(&["elevation", "date"])?.path;
        let below = -elevation;
        fields.warn(format!("`{path}`: the sun stands {below:.2} degrees below the horizon, and shines from there"));
    }
    Some(Sun { direction, distance })
}

/// Degrees of at most `most` on either side.
fn degrees(item: &Item, most: f64) -> Option<f64> {
    item.number_where(|degrees| degrees.abs() <= most, &format!("an angle in [-{most}, {most}] degrees"))
}

/// A date, as TOML has them or as text.
fn moment(item: &Item) -> Option<Datetime> {
    let parsed = match &item.node.value {
        Value::Datetime(date) => Some(*date),
        Value::String(text) => text.parse().ok(),
        _ => None,
    };
    if parsed.is_none() {
        item.error_help("must be a date and a time", "write e.g. \"2026-06-21T10:30:00Z\"");
    }
    parsed
}

fn direction(fields: &Fields) -> Option<DVec3> {
    fields.require("direction", "direction = [0, -1, 0], in which the light travels").and_then(|item| item.direction())
}

fn spectrum<'a>(fields: &Fields<'a>, key: &str, quantity: Quantity, spectra: &mut Spectra<'a>) -> Option<Handle> {
    let example = format!("{key} = 1, or the name of a spectrum");
    fields.require(key, &example).and_then(|item| spectra.resolve(&item, quantity))
}
