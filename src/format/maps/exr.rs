//! OpenEXR: RGB, and the spectral layout of Fichet, Pacanowski and Wilkie, *An OpenEXR Layout for Spectral Images*
//! (Journal of Computer Graphics Techniques 10(3), 2021).

use std::path::Path;

use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, EnvironmentMap, Text};
use exr::meta::header::Header;

use super::{Bands, Content, Map, checked_size, spectral, to_srgb, with_help};
use crate::error::Problem;
use crate::format::image::{self, Plane, Rgb};
use crate::format::table::shown;
use crate::format::unit::{self, Density, Unit};
use crate::spectral::Response;
use crate::spectral::planck::LIGHT_SPEED;

/// The file at `path` as spectra where it has emissive spectral channels, else as R, G and B.
pub fn read_map(path: &Path) -> Result<Map, Box<Problem>> {
    let picture = image::read(path)?;
    let size = checked_size(path, picture.size[0].into(), picture.size[1].into())?;
    let planes = &picture.planes;
    let mut warnings = Vec::new();
    // That the file can be read was seen to.
    let meta = MetaData::read_from_file(path, false).ok();
    let header = meta.as_ref().and_then(|meta| meta.headers.first());
    let attribute = |name: &str| text_attribute(header?, name);
    said(path, header, &mut warnings)?;
    if let Some(foreign) = &picture.colours.foreign {
        return Err(with_help(path, format!("has values that are those of {foreign}"), "convert it to linear numbers"));
    }
    let emissive: Vec<(f64, &Plane)> =
        planes.iter().filter_map(|plane| Some((emissive_band(&plane.name)?, plane))).collect();
    if !emissive.is_empty() {
        // The layout's own label; its authors store W m-2 sr-1 nm-1 under it, as everybody does.
        const KNOWN: [&str; 3] = ["W.m^-2.sr^-1", "W.m^-2.sr^-1.nm^-1", "W m^-2 sr^-1 nm^-1"];
        if planes.iter().any(|plane| ["S1.", "S2.", "S3."].iter().any(|start| plane.name.starts_with(start))) {
            warnings.push("holds polarised light: S1, S2 and S3 are left out".to_owned());
        }
        if let Some(quantity) = attribute(QUANTITY) {
            let message = format!("holds {quantity}, no spectral radiance");
            return Err(with_help(path, message, "export it without --integrated"));
        }
        let mut bands: Vec<(f64, &[f32])> =
            emissive.iter().map(|(nm, plane)| (*nm, plane.samples.as_slice())).collect();
        let mut converted: Vec<Vec<f32>> = Vec::new();
        if let Some(units) = attribute("emissiveUnits").filter(|units| !KNOWN.contains(&units.as_str())) {
            match super::radiance_of(path, &units, unit::parse(&units), Unit::NANOMETRE, &mut warnings)? {
                Density::Plain(1.0) => {}
                density => {
                    let convert = |(nm, plane): &(f64, &[f32])| {
                        plane.iter().map(|v| density.apply(f64::from(*v), *nm) as f32).collect::<Vec<f32>>()
                    };
                    converted.extend(bands.iter().map(convert));
                    bands.iter_mut().zip(&converted).for_each(|(band, plane)| band.1 = plane);
                }
            }
        }
        let (nm, planes): (Vec<f64>, Vec<&[f32]>) = bands.into_iter().unzip();
        let responses: Vec<Option<String>> = emissive.iter().map(|(_, plane)| attribute(&plane.name)).collect();
        let boxes: Option<Vec<[f64; 2]>> = responses.iter().map(|text| interval(text.as_ref()?)).collect();
        let widths = || {
            let of = |(nm, text): (&f64, &Option<String>)| {
                let half = 0.5 * response(text.as_ref()?)?.fwhm();
                (half > 0.0).then_some([nm - half, nm + half])
            };
            nm.iter().zip(&responses).map(of).collect::<Option<Vec<[f64; 2]>>>()
        };
        let spans = boxes.or_else(|| {
            let spans = widths();
            if responses.iter().any(Option::is_some) {
                let what = match spans {
                    Some(_) => {
                        "bands are taken as 1 over their widths at half of their heights, around their wavelengths"
                    }
                    None => "they are not applied, and bands count at their wavelengths",
                };
                warnings.push(format!("has responses of bands that are not 1 over an interval each: {what}"));
            }
            spans
        });
        let content = spectral(path, &Bands { nm, spans }, &planes, &mut warnings)?;
        return Ok(Map { size, content, warnings });
    }
    // Whether a picture is transparent matters to nobody who looks at the sky.
    let planes: Vec<&Plane> =
        planes.iter().filter(|plane| !matches!(plane.parts().1.to_lowercase().as_str(), "a" | "alpha")).collect();
    let found =
        Rgb::of(&planes).map_err(|message| with_help(path, message, "save one layer, with channels R, G, B"))?;
    let Some(found) = found else {
        let names: Vec<&str> = planes.iter().take(8).map(|plane| plane.name.as_str()).collect();
        let more = if planes.len() > 8 { ", …" } else { "" };
        let names = names.join(", ");
        let message = format!("has the channels {}{more}: neither R, G, B nor spectral radiance", names.escape_debug());
        return Err(with_help(path, message, "name channels R, G, B, or by wavelength as in S0.550,0nm"));
    };
    if let Rgb::Colour(of) = found
        && planes.len() > 3
    {
        warnings.push(format!(
            "has {} channels, of which {}, {} and {} are used",
            planes.len(),
            shown(&of[0].name),
            shown(&of[1].name),
            shown(&of[2].name)
        ));
    }
    let [r, g, b] = found.planes().map(|plane| &plane.samples);
    let mut rgb: Vec<f32> = r.iter().zip(g).zip(b).flat_map(|((r, g), b)| [*r, *g, *b]).collect();
    if let (Some(primaries), Rgb::Colour(_)) = (picture.colours.primaries, found) {
        to_srgb(path, &mut rgb, size[0], primaries, &mut warnings)?;
    }
    Ok(Map { size, content: Content::Rgb(rgb), warnings })
}

/// What attributes say of the numbers, or of the directions of the pixels, and nothing here applies.
fn said(path: &Path, header: Option<&Header>, warnings: &mut Vec<String>) -> Result<(), Box<Problem>> {
    let Some(header) = header else { return Ok(()) };
    if header.own_attributes.environment_map == Some(EnvironmentMap::Cube) {
        let message = "says (`envmap`) that it is the six faces of a cube".to_owned();
        return Err(with_help(path, message, "convert it to longitude and latitude, e.g. with exrenvmap"));
    }
    if let Some(luminance) = header.own_attributes.white_luminance {
        warnings.push(format!("says that its white has {luminance} cd/m2 (`whiteLuminance`), which is not applied"));
    }
    for (key, value) in header.own_attributes.other.iter().chain(&header.shared_attributes.other) {
        const CHANGING: [&str; 5] = ["ev", "cameraresponse", "lenstransmission", "exposure", "exposurecompensation"];
        let name = key.to_string();
        let is_unit = || match value {
            AttributeValue::Text(text) if image::is_called(&name, &["units", "unit"]) => {
                unit::parse(&text.to_string()).is_some_and(|unit| unit.is_number() && unit.factor != 1.0)
            }
            _ => false,
        };
        if image::is_called(&name, &CHANGING) || is_unit() {
            let name = shown(&name);
            warnings
                .push(format!("has the attribute `{name}`, which is not applied: its values are taken as they are"));
        }
    }
    Ok(())
}

/// The attribute of a file whose channels hold another quantity than spectral radiance, which the layout has no word for.
pub const QUANTITY: &str = "spectileQuantity";

/// An attribute that is a text.
fn text_attribute(header: &Header, name: &str) -> Option<String> {
    let key = Text::new_or_none(name)?;
    let found = header.own_attributes.other.get(&key).or(header.shared_attributes.other.get(&key));
    match found {
        Some(AttributeValue::Text(text)) => Some(text.to_string()),
        _ => None,
    }
}

/// The interval, in nm, over which the response of a band is 1: of `400nm:1;410nm:1;`, as the layout writes responses. None of those
/// that are no box.
fn interval(response: &str) -> Option<[f64; 2]> {
    let points = response.split(';').map(str::trim).filter(|point| !point.is_empty()).map(|point| {
        let (place, value) = point.split_once(':')?;
        (value.trim().parse() == Ok(1.0)).then_some(())?;
        place.trim().strip_suffix("nm")?.replace(',', ".").parse().ok()
    });
    let points: Vec<f64> = points.collect::<Option<_>>()?;
    <[f64; 2]>::try_from(points).ok().filter(|[from, to]| from < to)
}

/// The response of a band, as the layout writes it.
fn response(text: &str) -> Option<Response> {
    let points = text.split(';').map(str::trim).filter(|point| !point.is_empty()).map(|point| {
        let (place, value) = point.split_once(':')?;
        let nm: f64 = place.trim().strip_suffix("nm")?.replace(',', ".").parse().ok()?;
        Some((nm, value.trim().parse::<f64>().ok()?))
    });
    let (nm, value) = points.collect::<Option<Vec<_>>>()?.into_iter().unzip();
    Response::new(nm, value).ok()
}

/// The wavelength, in nm, of an unpolarised emissive channel: `S0.` and a number with a decimal comma, an SI prefix, and
/// m or Hz.
fn emissive_band(name: &str) -> Option<f64> {
    let text = name.strip_prefix("S0.")?;
    // The number ends before the unit; an exponent is part of it.
    let digits = |c: char| c.is_ascii_digit() || matches!(c, ',' | '+' | '-');
    let end = text
        .char_indices()
        .find(|&(i, c)| {
            let exponent = matches!(c, 'e' | 'E')
                && text[i + 1..].starts_with(|next: char| next.is_ascii_digit() || matches!(next, '+' | '-'));
            !digits(c) && !exponent
        })
        .map(|(i, _)| i)?;
    let number: f64 = text[..end].replace(',', ".").parse().ok()?;
    let (prefix, hertz) = match text[end..].strip_suffix("Hz") {
        Some(prefix) => (prefix, true),
        None => (text[end..].strip_suffix('m')?, false),
    };
    let power = match prefix {
        "" => 0,
        "Y" => 24,
        "Z" => 21,
        "E" => 18,
        "P" => 15,
        "T" => 12,
        "G" => 9,
        "M" => 6,
        "k" => 3,
        "h" => 2,
        "da" => 1,
        "d" => -1,
        "c" => -2,
        "m" => -3,
        "u" => -6,
        "n" => -9,
        "p" => -12,
        _ => return None,
    };
    // Exact for nanometres.
    Some(if hertz { LIGHT_SPEED * 1e9 / (number * 10f64.powi(power)) } else { number * 10f64.powi(power + 9) })
}

#[cfg(test)]
mod tests {
    use exr::image::pixel_vec::PixelVec;
    use exr::image::{Encoding, Image, Layer};
    use exr::meta::attribute::{AttributeValue, EnvironmentMap, Text};
    use exr::meta::header::LayerAttributes;
    use exr::prelude::{SpecificChannels, WritableImage};

    use super::{emissive_band, interval, read_map, response};

    #[test]
    fn what_attributes_say_is_told_or_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sky.exr");
        let write = |change: &dyn Fn(&mut LayerAttributes)| {
            let mut attributes = LayerAttributes::default();
            change(&mut attributes);
            let pixels = PixelVec { resolution: (2, 1).into(), pixels: vec![(1f32, 2f32, 3f32); 2] };
            let layer = Layer::new((2, 1), attributes, Encoding::SMALL_LOSSLESS, SpecificChannels::rgb(pixels));
            Image::from_layer(layer).write().non_parallel().to_file(&path).unwrap();
            read_map(&path)
        };
        assert!(write(&|_| {}).unwrap().warnings.is_empty());
        assert!(
            write(&|all| all.environment_map = Some(EnvironmentMap::LatitudeLongitude)).unwrap().warnings.is_empty()
        );
        let cube = write(&|all| all.environment_map = Some(EnvironmentMap::Cube)).unwrap_err();
        assert!(cube.message.contains("six faces of a cube"), "{cube}");
        let white = write(&|all| all.white_luminance = Some(100.0)).unwrap();
        assert!(white.warnings[0].contains("100 cd/m2"), "{:?}", white.warnings);
        let exposed = write(&|all| drop(all.other.insert(Text::from("EV"), AttributeValue::F32(2.0)))).unwrap();
        assert!(exposed.warnings[0].contains("`EV`"), "{:?}", exposed.warnings);
        let text = |name: &'static str, value: &'static str| {
            write(&move |all| drop(all.other.insert(Text::from(name), AttributeValue::Text(Text::from(value)))))
        };
        for (name, value) in [
            ("colorInteropID", "lin_ap1_scene"),
            ("colorInteropID", "srgb_tx"),
            ("colorInteropID", "lin_ciexyzd65_scene"),
            ("oiio:ColorSpace", "acescg"),
            ("Gamma", "2.2"),
        ] {
            assert!(text(name, value).unwrap_err().message.contains("those of"), "{name}: {value}");
        }
        for (name, value) in [("colorInteropID", "lin_rec709_scene"), ("colorInteropID", "data"), ("Gamma", "1")] {
            assert!(text(name, value).unwrap().warnings.is_empty(), "{name}: {value}");
        }
        for (name, value) in [("exposure", "1"), ("EXPOSURE", "2"), ("exposureCompensation", "1"), ("units", "percent")]
        {
            assert!(text(name, value).unwrap().warnings[0].contains(name), "{name}");
        }
        let scaled =
            |all: &mut LayerAttributes| drop(all.other.insert(Text::from("scale_factor"), AttributeValue::F32(0.5)));
        assert!(write(&scaled).unwrap_err().message.contains("`scale_factor` = 0.5"));
    }

    #[test]
    fn responses_that_are_intervals() {
        for (text, expected) in [
            ("400nm:1;410.5nm:1;", Some([400.0, 410.5])),
            ("400,25nm:1.0; 410nm:1", Some([400.25, 410.0])),
            ("400nm:0;405nm:1;410nm:0;", None),
            ("400nm:1;405nm:1;410nm:1;", None),
            ("410nm:1;400nm:1;", None),
            ("400:1;410:1;", None),
            ("", None),
        ] {
            assert_eq!(interval(text), expected, "{text}");
        }
    }

    /// A trapezoid from 400 to 500 nm, half of its height 1 nm inside of either end.
    #[test]
    fn responses_have_widths() {
        let width = |text: &str| response(text).map(|response| response.fwhm());
        assert_eq!(width("400nm:0;402nm:0.5;498nm:0.5;500nm:0;"), Some(98.0));
        assert_eq!([width("400nm:0;500nm:0;"), width("400nm:x;"), width("")], [None; 3]);
    }

    #[test]
    fn names_of_spectral_channels() {
        for (name, nm) in [
            ("S0.550,000000nm", Some(550.0)),
            ("S0.0,55um", Some(550.0)),
            ("S0.5,5E-7m", Some(550.0)),
            ("S0.1e3nm", Some(1000.0)),
            ("S0.10,25um", Some(10_250.0)),
            ("S1.550,0nm", None),
            ("T.550,0nm", None),
            ("S0.nm", None),
            ("S0.550", None),
            ("S0.550,0kg", None),
            ("R", None),
        ] {
            let got = emissive_band(name);
            let close = |a: f64, b: f64| (a - b).abs() <= 4.0 * f64::EPSILON * b;
            assert!(got.is_some() == nm.is_some() && got.zip(nm).is_none_or(|(a, b)| close(a, b)), "{name}: {got:?}");
        }
        // 299,792,458 m/s over 600 THz.
        assert!((emissive_band("S0.600,0THz").unwrap() - 499.654_096_666_666_7).abs() < 1e-9);
    }
}
