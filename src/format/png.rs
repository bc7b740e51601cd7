//! 8-bit PNG pictures.

use std::path::Path;

use crate::files::write_atomically;
use crate::spectral::colour::Picture;
use crate::{Error, Result};

/// Writes a picture at an exposure of `ev` as 8-bit sRGB, marked as such, replacing `path` in one step.
pub fn write(path: &Path, picture: &Picture, ev: f64) -> Result<()> {
    write_srgb8(path, picture.size, &picture.to_srgb8(ev))
}

/// Writes 8-bit sRGB, three bytes a pixel, as it stands.
pub fn write_srgb8(path: &Path, size: [u32; 2], rgb: &[u8]) -> Result<()> {
    let bytes = encode_srgb8(size, rgb).map_err(|error| Error::storage(path, format!("cannot be made: {error}")))?;
    write_atomically(path, &bytes)
}

/// A picture as the bytes of a PNG file.
pub fn encode(picture: &Picture, ev: f64) -> std::result::Result<Vec<u8>, png::EncodingError> {
    encode_srgb8(picture.size, &picture.to_srgb8(ev))
}

/// The same of 8-bit sRGB as it stands.
pub fn encode_srgb8(size: [u32; 2], rgb: &[u8]) -> std::result::Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size[0], size[1]);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(rgb)?;
    writer.finish()?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_and_colour_space_come_back() {
        let picture = Picture { size: [2, 1], rgb: vec![0.0, 0.25, 0.5, f32::NAN, 1.0, 0.1] };
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("p.png");
        write(&path, &picture, 1.0).expect("written");
        let file = std::io::BufReader::new(std::fs::File::open(&path).expect("opens"));
        let mut reader = png::Decoder::new(file).read_info().expect("a PNG");
        let mut pixels = vec![0; reader.output_buffer_size().expect("size")];
        reader.next_frame(&mut pixels).expect("pixels");
        assert_eq!(pixels, picture.to_srgb8(1.0));
        assert_eq!(pixels[..3], [0, 188, 255]);
        let info = reader.info();
        assert_eq!(info.srgb, Some(png::SrgbRenderingIntent::RelativeColorimetric));
        assert_eq!((info.width, info.height), (2, 1));
    }
}
