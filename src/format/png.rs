//! 8-bit PNG pictures.

use std::fs::File;
use std::io::{BufReader, BufWriter, Write};
use std::path::Path;

use crate::files::output::{Product, Replacement, cannot_write};
use crate::spectral::tone::Picture;
use crate::{Error, Result};

/// What [`stream`] writes.
pub const PICTURE: Product =
    Product { name: "a PNG picture", extensions: &["png"], is_stream: true, is_folder: false, check: is_png };

/// What [`write`] writes, again and again.
pub const KEPT: Product = Product { name: "a PNG picture that is kept up to date", is_stream: false, ..PICTURE };

fn is_png(path: &Path) -> std::result::Result<(), String> {
    let file = File::open(path).map_err(|error| format!("cannot be read ({error})"))?;
    png::Decoder::new(BufReader::new(file)).read_info().map(drop).map_err(|_| "does not begin like one".into())
}

/// Writes a picture at an exposure of `ev` as 8-bit sRGB, marked as such, replacing `path` in one step.
pub fn write(path: &Path, picture: &Picture, ev: f64) -> Result<()> {
    let bytes = encode(picture.size, &picture.to_srgb8(ev));
    KEPT.write(path, &bytes.map_err(|error| Error::storage(path, format!("cannot be made: {error}")))?)
}

/// The bytes of a PNG file of 8-bit sRGB, three bytes a pixel.
pub fn encode(size: [u32; 2], rgb: &[u8]) -> std::result::Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut writer = encoder(&mut bytes, size).write_header()?;
    writer.write_image_data(rgb)?;
    writer.finish()?;
    Ok(bytes)
}

/// Writes a picture piece by piece: `each` passes on its 8-bit sRGB, row by row from the top. What fails leaves nothing, and
/// what was at `path` before.
pub fn stream(
    path: &Path,
    size: [u32; 2],
    each: impl FnOnce(&mut dyn FnMut(&[u8]) -> Result<()>) -> Result<()>,
) -> Result<()> {
    let mut replacement = Replacement::create(path, PICTURE)?;
    let failed = |error: png::EncodingError| match error {
        png::EncodingError::IoError(error) => cannot_write(path, &error),
        error => Error::storage(path, format!("cannot be written: {error}")),
    };
    let mut file = BufWriter::with_capacity(1 << 20, replacement.file());
    let mut writer = encoder(&mut file, size).write_header().map_err(failed)?;
    let mut rows = writer.stream_writer_with_size(1 << 16).map_err(failed)?;
    each(&mut |bytes| rows.write_all(bytes).map_err(|error| cannot_write(path, &error)))?;
    rows.finish().map_err(failed)?;
    writer.finish().map_err(failed)?;
    file.flush().map_err(|error| cannot_write(path, &error))?;
    drop(file);
    replacement.finish()
}

fn encoder<'a, W: Write + 'a>(to: W, [width, height]: [u32; 2]) -> png::Encoder<'a, W> {
    let mut encoder = png::Encoder::new(to, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    encoder
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_and_colour_space_come_back() {
        let picture = Picture { size: [2, 1], rgb: vec![0.0, 0.25, 0.5, f32::NAN, 1.0, 0.1] };
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("p.png");
        for in_pieces in [false, true] {
            match in_pieces {
                false => write(&path, &picture, 1.0).expect("written"),
                true => {
                    stream(&path, [2, 1], |put| picture.to_srgb8(1.0).chunks(3).try_for_each(put)).expect("written")
                }
            }
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
        let short = stream(&path, [2, 1], |put| put(&[1, 2, 3])).unwrap_err();
        assert!(short.to_string().contains("p.png: cannot be written"), "{short}");
        assert_eq!(std::fs::read_dir(folder.path()).expect("list").count(), 1);
    }
}
