//! `[environment]`.

use glam::{DMat3, DQuat, DVec3};

use super::decode::{Fields, Item};
use super::keys;
use super::material::kelvin;
use super::spectrum::{Quantity, Spectra, report_in_file};
use super::{Environment, EnvironmentMap, Texels};
use crate::error::Problem;
use crate::format::maps::{self, Content, Map};
use crate::format::noise::{self, Range};
use crate::spectral::{Curve, upsample};

/// `None` where something is wrong, which has been said.
pub fn decode<'a>(item: &Item<'a>, spectra: &mut Spectra<'a>) -> Option<Environment> {
    let fields = item.table(&keys::ENVIRONMENT)?;
    let source = fields.exactly_one("source of radiance");
    let to_map = to_map(&fields);
    let scale = fields.get("scale");
    let source = source?;
    if source.path == "environment.map" {
        let map = read_map(&source, spectra);
        let scale = match scale {
            Some(item) => item.not_negative().map(|scale| Some((scale, item))),
            None => Some(None),
        };
        let (to_map, scale, (map, warnings)) = (to_map?, scale?, map?);
        let factor = scale.as_ref().map_or(1.0, |(factor, _)| *factor);
        let peak = map.values().iter().fold(0.0, |peak: f64, v| peak.max(f64::from(*v))) * factor;
        if !Quantity::Radiance.allows(peak) {
            let (_, item) = scale.as_ref().map_or((0.0, &source), |(factor, item)| (*factor, item));
            item.error(format!("{}, but is {peak:e} in {}", Quantity::Radiance.range(), source.text()?));
            return None;
        }
        warnings.into_iter().for_each(|warning| item.cx.warn(warning));
        return Some(Environment::Map(EnvironmentMap {
            name: source.text()?.to_owned(),
            to_map,
            scale: factor,
            size: map.size,
            texels: texels(map, spectra, source.text()?),
        }));
    }
    // A uniform environment looks the same however it is turned; the keys still have to make sense.
    let radiance = match source.path.as_str() {
        "environment.temperature" => {
            kelvin(&source).map(|kelvin| spectra.add(&source.path, Curve::Blackbody { kelvin, scale: 1.0 }))
        }
        _ => spectra.resolve(&source, Quantity::Radiance),
    };
    to_map?;
    let radiance = match scale {
        Some(scale) => spectra.scaled(radiance?, &scale)?,
        None => radiance?,
    };
    Some(Environment::Uniform(spectra.take(radiance)))
}

/// The rotation from the world to the map, in which up is +y: the inverse of the shortest turn from +y to `up`, then
/// `rotate_degrees` about `up`.
pub(super) fn to_map(fields: &Fields) -> Option<DMat3> {
    let up = fields.get("up").map_or(Some(DVec3::Y), |item| item.direction());
    let degrees = fields.get("rotate_degrees").map_or(Some(0.0), |item| item.number());
    let (up, degrees) = (up?, degrees?);
    // All turns to the opposite are equally short: about +x.
    let tilt = if up == DVec3::NEG_Y {
        DQuat::from_rotation_x(std::f64::consts::PI)
    } else {
        DQuat::from_rotation_arc(DVec3::Y, up)
    };
    Some(DMat3::from_quat(DQuat::from_axis_angle(up, degrees.to_radians()) * tilt).transpose())
}

/// The map that `item` names, and what to say about it.
fn read_map(item: &Item, spectra: &Spectra) -> Option<(Map, Vec<String>)> {
    let name = item.text()?;
    let path = item.cx.path(name);
    let mut map = maps::read(&path).map_err(|problem| report_in_file(item, *problem)).ok()?;
    let mut warnings: Vec<String> = map.warnings.drain(..).map(|w| format!("environment map {name} {w}")).collect();
    warnings.extend(
        mend(&mut map)
            .map_err(|message| {
                report_in_file(item, Problem { file: path, message, ..Problem::default() });
            })
            .ok()?
            .map(|w| format!("environment map {name} {w}")),
    );
    let [width, height] = map.size;
    // One texel is the same in every direction.
    if width != 2 * height && map.size != [1, 1] {
        warnings.push(format!(
            "environment map {name} has {width} x {height} pixels: what covers all directions by longitude and latitude is \
             twice as wide as high"
        ));
    }
    if matches!(map.content, Content::Rgb(_)) {
        let (first, last) = (f64::from(upsample::FIRST_NM), f64::from(upsample::LAST_NM));
        warnings.extend(spectra.uncovered(first, last).map(|gap| {
            format!("environment map {name} (rgb) says nothing about {gap}, outside the visible: its end values are held there")
        }));
    }
    Some((map, warnings))
}

/// What is not finite or clearly negative is an error; what is negative by no more than noise becomes 0, which is said.
fn mend(map: &mut Map) -> Result<Option<String>, String> {
    let per_texel = map.per_texel();
    let width = map.size[0] as usize;
    let values = map.values_mut();
    match noise::clip(values, Range::NotNegative, |v| v as f32) {
        Ok(clipped) => Ok(clipped.map(|clipped| format!("holds {}", clipped.words(Range::NotNegative)))),
        Err(i) => {
            let (value, texel) = (values[i], i / per_texel);
            let must = if value.is_finite() { "0 or greater" } else { "finite" };
            let (column, row) = (texel % width, texel / width);
            Err(format!("holds {value} at column {column}, row {row}, where radiance must be {must}"))
        }
    }
}

fn texels(map: Map, spectra: &mut Spectra, name: &str) -> Texels {
    match map.content {
        Content::Rgb(rgb) => {
            let daylight = spectra.curve(&format!("D65 of {name}"), upsample::daylight());
            Texels::Rgb { rgb: rgb.into(), daylight }
        }
        Content::Spectral { nm, values } => Texels::Spectral { nm, radiance: values.into() },
    }
}
