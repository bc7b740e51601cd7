//! `[[lights]]`: light that comes from no surface.

use super::Light;
use super::decode::{Fields, Item};
use super::keys;
use super::spectrum::{Handle, Quantity, Spectra};

/// Degrees. Smaller disks are too narrow for a device to tell which directions are inside; larger ones are no disks.
const ANGULAR_RADIUS: std::ops::RangeInclusive<f64> = 0.001..=90.0;

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
        Some("directional") => {
            let fields = kind.table(&keys::DIRECTIONAL)?;
            let direction = direction(&fields);
            let irradiance = spectrum(&fields, "irradiance", Quantity::Irradiance, spectra);
            Some(Light::Directional { direction: direction?, irradiance: spectra.take(irradiance?) })
        }
        _ => {
            let fields = kind.table(&keys::SUN)?;
            let direction = direction(&fields);
            let radius = fields.require("angular_radius", "angular_radius = 0.2665, in degrees").and_then(|item| {
                let degrees = item.positive()?;
                if !ANGULAR_RADIUS.contains(&degrees) {
                    let [least, most] = [ANGULAR_RADIUS.start(), ANGULAR_RADIUS.end()];
                    let message = format!("must lie in [{least}, {most}] degrees, but is {degrees}");
                    item.error_help(message, "what is smaller is a `directional` light, what is larger an environment");
                    return None;
                }
                Some(degrees.to_radians())
            });
            let irradiance = spectrum(&fields, "irradiance", Quantity::Irradiance, spectra);
            let (direction, angular_radius) = (direction?, radius?);
            Some(Light::Sun { direction, angular_radius, irradiance: spectra.take(irradiance?) })
        }
    }
}

fn direction(fields: &Fields) -> Option<glam::DVec3> {
    fields.require("direction", "direction = [0, -1, 0], in which the light travels").and_then(|item| item.direction())
}

fn spectrum<'a>(fields: &Fields<'a>, key: &str, quantity: Quantity, spectra: &mut Spectra<'a>) -> Option<Handle> {
    let example = format!("{key} = 1, or the name of a spectrum");
    fields.require(key, &example).and_then(|item| spectra.resolve(&item, quantity))
}
