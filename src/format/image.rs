//! Pictures as planes of numbers: PNG and OpenEXR, told apart by how they begin.

use std::io::Cursor;
use std::path::Path;

use exr::image::FlatSamples;
use exr::image::read::image::ReadLayers;
use exr::image::read::layers::ReadChannels;
use exr::image::read::read as exr_reader;
use exr::meta::MetaData;
use exr::meta::attribute::SampleType;

use crate::error::Problem;

/// A picture. Rows go from the top down, each from left to right.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    pub format: Format,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// In the order of the file: R, G, B, A or Y, A in a PNG; in an EXR that of its header, which is by name.
    pub planes: Vec<Plane>,
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

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    Png,
    Exr,
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
    Ok(Image { format: Format::Png, size, planes: names.iter().enumerate().map(plane).collect() })
}

fn exr(bytes: &[u8]) -> Result<Image, String> {
    let wrong = |error: exr::error::Error| format!("is not a whole OpenEXR picture: {error}");
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
            return Err(format!("has whole numbers in channel {}, but halfs or floats are needed", channel.name));
        }
        if (channel.sampling.x(), channel.sampling.y()) != (1, 1) {
            return Err(format!("has channel {} at a lower resolution, which is not read", channel.name));
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
    Ok(Image { format: Format::Exr, size, planes })
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
        let whole = encode_exr([1, 1], vec![("id", FlatSamples::U32(vec![1]))]);
        for (bytes, words) in [
            (&b""[..], "neither"),
            (b"#?RADIANCE", "neither"),
            (&good[..40], "not a whole PNG"),
            (&exr[..exr.len() - 9], "not a whole OpenEXR"),
            (&exr[..20], "not a whole OpenEXR"),
            (&whole, "whole numbers in channel id"),
        ] {
            let message = parse(bytes).unwrap_err();
            assert!(message.contains(words), "{message}");
        }
        assert!(read(Path::new("/no/such.png")).unwrap_err().message.contains("cannot be read"));
    }
}
