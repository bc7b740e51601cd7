//! Pictures as planes of numbers: PNG and OpenEXR, told apart by how they begin.

use std::io::Cursor;
use std::path::Path;

use exr::image::FlatSamples;
use exr::image::read::image::ReadLayers;
use exr::image::read::layers::ReadChannels;
use exr::image::read::read as exr_reader;
use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, SampleType};

use super::primaries::Primaries;
use super::table::shown;
use crate::error::Problem;
use crate::spectral::colour::srgb_decode;

/// A picture. Rows go from the top down, each from left to right.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    pub format: Format,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// In the order of the file: R, G, B, A or Y, A in a PNG; in an EXR that of its header, which is by name; of an array R, G, B
    /// where there are three, Y where there is one, else numbers from 0.
    pub planes: Vec<Plane>,
    /// What its colours are.
    pub colours: Colours,
    /// In what an attribute says that its numbers are.
    pub units: Option<String>,
}

/// What numbers of a picture mean as colours.
#[derive(Debug, Clone, PartialEq)]
pub struct Colours {
    pub transfer: Transfer,
    /// Where they are not those of sRGB.
    pub primaries: Option<Primaries>,
    /// A statement about colours that is not understood, in words that go on after "its colours are those of".
    pub foreign: Option<String>,
}

/// From numbers to light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Transfer {
    Linear,
    Srgb,
    /// To this power.
    Gamma(f64),
}

impl Transfer {
    pub fn decode(self, v: f32) -> f32 {
        match self {
            Transfer::Linear => v,
            Transfer::Srgb => srgb_decode(v.into()) as f32,
            Transfer::Gamma(power) => f64::from(v).powf(power) as f32,
        }
    }
}

/// Red, green and blue, or one grey.
#[derive(Debug, Clone, Copy)]
pub enum Rgb<'i> {
    Colour([&'i Plane; 3]),
    Grey(&'i Plane),
}

/// What the channels of a layer are in a picture.
struct Layer<'i> {
    name: &'i str,
    rgb: [Option<&'i Plane>; 3],
    grey: Option<&'i Plane>,
}

impl<'i> Rgb<'i> {
    /// Among `planes`, by their names, whatever their case and the layer before them. `Ok(None)`: there are none; `Err` says what
    /// is in the way.
    pub fn of(planes: &[&'i Plane]) -> Result<Option<Rgb<'i>>, String> {
        const GREY: [&str; 8] = ["y", "l", "v", "i", "gray", "grey", "luminance", "intensity"];
        let mut layers: Vec<Layer> = Vec::new();
        for plane in planes {
            let (name, channel) = plane.parts();
            let index = layers.iter().position(|layer| layer.name == name).unwrap_or_else(|| {
                layers.push(Layer { name, rgb: [None; 3], grey: None });
                layers.len() - 1
            });
            let layer = &mut layers[index];
            match channel.to_lowercase().as_str() {
                "r" | "red" => layer.rgb[0] = Some(plane),
                "g" | "green" => layer.rgb[1] = Some(plane),
                "b" | "blue" => layer.rgb[2] = Some(plane),
                channel if GREY.contains(&channel) => layer.grey = Some(plane),
                _ => {}
            }
        }
        let colour = |layer: &Layer<'i>| {
            let [r, g, b] = layer.rgb;
            Some((layer.name, [r?, g?, b?]))
        };
        let coloured: Vec<(&str, [&'i Plane; 3])> = layers.iter().filter_map(colour).collect();
        match coloured[..] {
            [(_, rgb)] => return Ok(Some(Rgb::Colour(rgb))),
            [] => {}
            _ => {
                // Programs write what is meant to be seen without a layer's name.
                if let Some((_, rgb)) = coloured.iter().find(|(layer, _)| layer.is_empty()) {
                    return Ok(Some(Rgb::Colour(*rgb)));
                }
                let names: Vec<&str> = coloured.iter().map(|(layer, _)| *layer).collect();
                return Err(format!("has colours in several layers: {}", shown(&names.join(", "))));
            }
        }
        let named = |wanted: &str| planes.iter().any(|plane| plane.parts().1.eq_ignore_ascii_case(wanted));
        if ["x", "y", "z"].iter().all(|name| named(name)) {
            return Err("holds CIE X, Y and Z, which are not read: convert it to linear sRGB".to_owned());
        }
        let [only] = planes else { return Ok(None) };
        Ok(layers.iter().find_map(|layer| layer.grey).map(|_| Rgb::Grey(only)))
    }

    /// The plane of each of red, green and blue.
    pub fn planes(&self) -> [&'i Plane; 3] {
        match self {
            Rgb::Colour(planes) => *planes,
            Rgb::Grey(plane) => [plane; 3],
        }
    }
}

/// One channel of a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Plane {
    pub name: String,
    /// width x height. As stored in an EXR; of a PNG the share of its largest number, in [0, 1].
    pub samples: Vec<f32>,
    /// How far a number just below 1 may be from what was meant: half the step of its type.
    pub rounding: f32,
}

impl Plane {
    /// Its layer, which is mostly none, and its name in there.
    pub fn parts(&self) -> (&str, &str) {
        self.name.rsplit_once('.').unwrap_or(("", &self.name))
    }
}

impl Image {
    /// Whether a channel is how opaque the others of its layer are; `a` beside other names than those of colours is an `a`.
    pub fn is_alpha(&self, plane: &Plane) -> bool {
        let (layer, name) = plane.parts();
        let has = |wanted: &str| self.planes.iter().any(|other| other.parts() == (layer, wanted));
        name == "A" || (name == "a" && (["r", "g", "b"].iter().all(|colour| has(colour)) || has("y")))
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    Png,
    Exr,
    /// Numbers that were never a file.
    Memory,
}

/// 16,384 x 16,384: far more than a texture has.
const MOST_PIXELS: u64 = 1 << 28;

/// Reads the picture in `path`. Errors tell what is wrong with the file as a whole.
pub fn read(path: &Path) -> Result<Image, Box<Problem>> {
    let image = match std::fs::read(path) {
        Ok(bytes) => parse(&bytes),
        Err(error) => Err(format!("cannot be read: {error}")),
    };
    image.map_err(|message| Box::new(Problem { file: path.to_owned(), message, ..Problem::default() }))
}

/// [`read`] on the content of the file.
pub fn parse(bytes: &[u8]) -> Result<Image, String> {
    match bytes {
        [0x89, b'P', b'N', b'G', ..] => png(bytes),
        [0x76, 0x2f, 0x31, 0x01, ..] => exr(bytes),
        _ => Err("is neither a PNG nor an OpenEXR picture".to_owned()),
    }
}

fn check_size(size: [u64; 2]) -> Result<[u32; 2], String> {
    match size.map(u32::try_from) {
        [Ok(width), Ok(height)] if (1..=MOST_PIXELS).contains(&(size[0] * size[1])) => Ok([width, height]),
        _ => Err(format!("has {} x {} pixels: at least one and at most 2^28 are read", size[0], size[1])),
    }
}

fn png(bytes: &[u8]) -> Result<Image, String> {
    let wrong = |error: png::DecodingError| format!("is not a whole PNG picture: {error}");
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    // Palettes become colours, fewer bits than eight eight, transparent colours an alpha channel.
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(wrong)?;
    let size = check_size([reader.info().width.into(), reader.info().height.into()])?;
    let colours = png_colours(reader.info());
    let mut data = vec![0; reader.output_buffer_size().ok_or("is too large")?];
    let shape = reader.next_frame(&mut data).map_err(wrong)?;

    let names: &[&str] = match shape.color_type {
        png::ColorType::Grayscale => &["Y"],
        png::ColorType::GrayscaleAlpha => &["Y", "A"],
        png::ColorType::Rgb => &["R", "G", "B"],
        png::ColorType::Rgba => &["R", "G", "B", "A"],
        png::ColorType::Indexed => return Err("is not a whole PNG picture: its palette is missing".to_owned()),
    };
    let (bytes_each, largest) = if shape.bit_depth == png::BitDepth::Sixteen { (2, 65_535.0) } else { (1, 255.0) };
    let plane = |(channel, name): (usize, &&str)| {
        let pixels = data.chunks_exact(bytes_each * names.len());
        let number = |pixel: &[u8]| match pixel[bytes_each * channel..][..bytes_each] {
            [high, low] => u16::from_be_bytes([high, low]),
            [byte] => byte.into(),
            _ => unreachable!("one byte or two"),
        };
        let samples = pixels.map(|pixel| (f64::from(number(pixel)) / largest) as f32).collect();
        Plane { name: (*name).to_owned(), samples, rounding: (0.5 / largest) as f32 }
    };
    Ok(Image { format: Format::Png, size, planes: names.iter().enumerate().map(plane).collect(), colours, units: None })
}

/// What the chunks of a PNG say of its colours; those that say most count, as its specification has it.
fn png_colours(info: &png::Info) -> Colours {
    let srgb = Colours { transfer: Transfer::Srgb, primaries: None, foreign: None };
    if let Some(code) = info.coding_independent_code_points {
        let foreign = format!("cICP {}/{}", code.color_primaries, code.transfer_function);
        return match (code.color_primaries, code.transfer_function) {
            (1, 13) => srgb,
            (1, 8) => Colours { transfer: Transfer::Linear, ..srgb },
            _ => Colours { foreign: Some(foreign), ..srgb },
        };
    }
    if let Some(profile) = &info.icc_profile {
        // Its description holds the name, in one byte a letter or in two.
        let holds = |name: &[u8]| profile.windows(name.len()).any(|bytes| bytes == name);
        if holds(b"sRGB") || holds(b"\0s\0R\0G\0B") {
            return srgb;
        }
        return Colours { foreign: Some("an ICC profile other than sRGB's".to_owned()), ..srgb };
    }
    if info.srgb.is_some() {
        return srgb;
    }
    let transfer = match info.gama_chunk.map(|gamma| f64::from(gamma.into_value())) {
        // Programs that mean sRGB write 1/2.2.
        None => Transfer::Srgb,
        Some(gamma) if (gamma - 1.0 / 2.2).abs() < 5e-3 => Transfer::Srgb,
        Some(gamma) if (gamma - 1.0).abs() < 1e-3 => Transfer::Linear,
        Some(gamma) if gamma > 0.05 => Transfer::Gamma(1.0 / gamma),
        Some(gamma) => return Colours { foreign: Some(format!("a gamma of {gamma}")), ..srgb },
    };
    let primaries = info.chrm_chunk.map(|given| {
        let xy = |(x, y): (png::ScaledFloat, png::ScaledFloat)| [x.into_value().into(), y.into_value().into()];
        Primaries([xy(given.red), xy(given.green), xy(given.blue), xy(given.white)])
    });
    Colours { transfer, primaries: primaries.filter(|primaries| !primaries.are_srgb()), foreign: None }
}

fn exr(bytes: &[u8]) -> Result<Image, String> {
    // An error may quote the names of the file, which hold anything.
    let wrong =
        |error: exr::error::Error| format!("is not a whole OpenEXR picture: {}", error.to_string().escape_debug());
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(wrong)?;
    let header = match &meta.headers[..] {
        [header] => header,
        several => return Err(format!("has {} parts, but a picture with one is needed", several.len())),
    };
    if header.deep {
        return Err("holds deep data, but a flat picture is needed".to_owned());
    }
    let size = check_size([header.layer_size.x() as u64, header.layer_size.y() as u64])?;
    let window = header.shared_attributes.display_window;
    if window.size != header.layer_size || window.position != header.own_attributes.layer_position {
        return Err("has a data window that is not its display window: save it uncropped".to_owned());
    }
    for channel in &header.channels.list {
        if channel.sample_type == SampleType::U32 {
            let name = shown(&channel.name.to_string());
            return Err(format!("has whole numbers in channel {name}, but halfs or floats are needed"));
        }
        if (channel.sampling.x(), channel.sampling.y()) != (1, 1) {
            let name = shown(&channel.name.to_string());
            return Err(format!("has channel {name} at a lower resolution, which is not read"));
        }
    }

    let primaries = header.shared_attributes.chromaticities.map(|given| {
        let xy = |v: exr::math::Vec2<f32>| [f64::from(v.x()), f64::from(v.y())];
        Primaries([xy(given.red), xy(given.green), xy(given.blue), xy(given.white)])
    });
    let primaries = primaries.filter(|primaries| !primaries.are_srgb());
    let attributes = || header.own_attributes.other.iter().chain(&header.shared_attributes.other);
    let text = |wanted: &[&str]| {
        attributes().find_map(|(key, value)| match value {
            AttributeValue::Text(text) if is_called(&key.to_string(), wanted) => Some(text.to_string()),
            _ => None,
        })
    };
    let gamma = attributes().find_map(|(key, value)| match value {
        AttributeValue::F32(gamma) if is_called(&key.to_string(), &["gamma"]) => Some(f64::from(*gamma)),
        AttributeValue::F64(gamma) if is_called(&key.to_string(), &["gamma"]) => Some(*gamma),
        AttributeValue::Text(gamma) if is_called(&key.to_string(), &["gamma"]) => gamma.to_string().trim().parse().ok(),
        _ => None,
    });
    // OpenEXR 3.4's own attribute, and those of programs before it.
    let space = text(&["colorinteropid"]).or_else(|| text(&["colorspace", "colourspace"]));
    let space = space.filter(|space| !is_linear(space, primaries.is_some()));
    let foreign = match (space, gamma) {
        (Some(space), _) => Some(format!("`{}`, by its attribute of the colour space", shown(&space))),
        (None, Some(gamma)) if (gamma - 1.0).abs() > 1e-3 && gamma != 0.0 => Some(format!("a gamma of {gamma}")),
        _ => None,
    };
    let colours = Colours { transfer: Transfer::Linear, primaries, foreign };
    // Texts of EXR have no encoding, and are given as Latin-1: those of UTF-8 have a sign more in °C.
    let units = text(&["units", "unit"]).map(|text| {
        let bytes: Option<Vec<u8>> = text.chars().map(|c| u8::try_from(u32::from(c)).ok()).collect();
        bytes.and_then(|bytes| String::from_utf8(bytes).ok()).unwrap_or(text)
    });
    for (key, neutral) in [("scalefactor", 1.0), ("addoffset", 0.0)] {
        let scaled = attributes().find_map(|(name, value)| match value {
            AttributeValue::F32(by) if is_called(&name.to_string(), &[key]) => Some((name, f64::from(*by))),
            AttributeValue::F64(by) if is_called(&name.to_string(), &[key]) => Some((name, *by)),
            _ => None,
        });
        if let Some((name, by)) = scaled.filter(|(_, by)| *by != neutral) {
            return Err(format!(
                "has the attribute `{}` = {by}, which is not applied: write the values so",
                shown(&name.to_string())
            ));
        }
    }

    let reader = exr_reader().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
    let image = reader.all_attributes().non_parallel().from_buffered(Cursor::new(bytes)).map_err(wrong)?;
    let plane = |channel: exr::image::AnyChannel<FlatSamples>| {
        let rounding = match &channel.sample_data {
            FlatSamples::F16(_) => 2f32.powi(-12),
            _ => 2f32.powi(-25),
        };
        Plane { name: channel.name.to_string(), samples: channel.sample_data.values_as_f32().collect(), rounding }
    };
    let planes = image.layer_data.channel_data.list.into_iter().map(plane).collect();
    Ok(Image { format: Format::Exr, size, planes, colours, units })
}

/// Whether an attribute is called so, whatever the program before a colon, and the case.
pub fn is_called(key: &str, wanted: &[&str]) -> bool {
    let bare = key.rsplit([':', '/', '.']).next().unwrap_or("").to_lowercase().replace(['_', ' '], "");
    wanted.contains(&bare.as_str())
}

/// Whether the name of a space of colours is that of linear numbers, with the primaries that the file gives or those of sRGB.
fn is_linear(space: &str, has_primaries: bool) -> bool {
    let lower = space.to_lowercase();
    let has = |words: &[&str]| words.iter().any(|word| lower.contains(word));
    let of_others = has(&["ap0", "ap1", "aces", "2020", "p3", "adobe", "xyz"]);
    ["", "raw", "none", "data", "unknown"].contains(&lower.trim())
        || ((has(&["lin"]) || of_others && has(&["aces"]))
            && (has_primaries || !of_others)
            && !has(&["log", "display"]))
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use exr::image::write::WritableImage;
    use exr::image::{AnyChannel, AnyChannels, Encoding, Image as ExrImage, Layer};
    use exr::meta::header::LayerAttributes;

    fn encode_png(size: [u32; 2], colour: png::ColorType, depth: png::BitDepth, data: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, size[0], size[1]);
        encoder.set_color(colour);
        encoder.set_depth(depth);
        if colour == png::ColorType::Indexed {
            encoder.set_palette(&[255u8, 0, 0, 0, 51, 102][..]);
        }
        let mut writer = encoder.write_header().expect("header");
        writer.write_image_data(data).expect("pixels");
        writer.finish().expect("end");
        bytes
    }

    fn encode_exr(size: [usize; 2], planes: Vec<(&str, FlatSamples)>) -> Vec<u8> {
        let channels = planes.into_iter().map(|(name, samples)| AnyChannel::new(name, samples)).collect();
        let layer = Layer::new(
            (size[0], size[1]),
            LayerAttributes::default(),
            Encoding::SMALL_LOSSLESS,
            AnyChannels::sort(channels),
        );
        let mut bytes = Cursor::new(Vec::new());
        ExrImage::from_layer(layer).write().non_parallel().to_buffered(&mut bytes).expect("written");
        bytes.into_inner()
    }

    fn planes(image: &Image) -> Vec<(&str, &[f32])> {
        image.planes.iter().map(|plane| (plane.name.as_str(), plane.samples.as_slice())).collect()
    }

    #[test]
    fn pngs_of_every_kind() {
        use png::{BitDepth, ColorType};
        let grey = parse(&encode_png([2, 1], ColorType::Grayscale, BitDepth::Eight, &[0, 51])).unwrap();
        assert_eq!((grey.size, planes(&grey)), ([2, 1], vec![("Y", &[0.0, 0.2][..])]));
        let deep = parse(&encode_png([1, 1], ColorType::Grayscale, BitDepth::Sixteen, &[0x33, 0x33])).unwrap();
        assert_eq!(planes(&deep), [("Y", &[0.2][..])]);
        assert!(deep.planes[0].rounding < grey.planes[0].rounding);
        let bits = parse(&encode_png([8, 1], ColorType::Grayscale, BitDepth::One, &[0b1010_0001])).unwrap();
        assert_eq!(planes(&bits), [("Y", &[1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0][..])]);
        let palette = parse(&encode_png([2, 1], ColorType::Indexed, BitDepth::Eight, &[1, 0])).unwrap();
        assert_eq!(planes(&palette), [("R", &[0.0, 1.0][..]), ("G", &[0.2, 0.0]), ("B", &[0.4, 0.0])]);
        let alpha =
            parse(&encode_png([1, 2], ColorType::Rgba, BitDepth::Eight, &[255, 0, 51, 255, 0, 0, 0, 0])).unwrap();
        assert_eq!(
            planes(&alpha),
            [("R", &[1.0, 0.0][..]), ("G", &[0.0, 0.0]), ("B", &[0.2, 0.0]), ("A", &[1.0, 0.0])]
        );
    }

    #[test]
    fn exrs_keep_numbers_and_the_order_of_their_header() {
        let half = exr::prelude::f16::from_f32;
        let bytes = encode_exr(
            [2, 2],
            vec![
                ("soil", FlatSamples::F32(vec![0.1, -2.0, 3e30, f32::NAN])),
                ("grass", FlatSamples::F16([0.5, 0.25, 1.0, 6e4].map(half).to_vec())),
            ],
        );
        let image = parse(&bytes).unwrap();
        assert_eq!((image.format, image.size), (Format::Exr, [2, 2]));
        assert_eq!((image.planes[0].name.as_str(), image.planes[1].name.as_str()), ("grass", "soil"));
        assert_eq!(image.planes[0].samples, [0.5, 0.25, 1.0, 6e4].map(|v| half(v).to_f32()));
        assert_eq!(image.planes[1].samples[..3], [0.1, -2.0, 3e30]);
        assert!(image.planes[1].samples[3].is_nan());
        // Steps just below 1: 2^-11 of a half, 2^-24 of a float.
        assert_eq!([image.planes[0].rounding, image.planes[1].rounding], [2f32.powi(-12), 2f32.powi(-25)]);
    }

    #[test]
    fn what_is_no_picture_is_refused() {
        let good = encode_png([4, 4], png::ColorType::Rgb, png::BitDepth::Eight, &[7; 48]);
        let exr = encode_exr([4, 4], vec![("Y", FlatSamples::F32(vec![1.0; 16]))]);
        let whole = encode_exr([1, 1], vec![("a\nb", FlatSamples::U32(vec![1]))]);
        for (bytes, words) in [
            (&b""[..], "neither"),
            (b"#?RADIANCE", "neither"),
            (&good[..40], "not a whole PNG"),
            (&exr[..exr.len() - 9], "not a whole OpenEXR"),
            (&exr[..20], "not a whole OpenEXR"),
            (&whole, "whole numbers in channel a\\nb"),
        ] {
            let message = parse(bytes).unwrap_err();
            assert!(message.contains(words), "{message}");
        }
        assert!(read(Path::new("/no/such.png")).unwrap_err().message.contains("cannot be read"));
    }
}
