//! The colour picture of a cube, put together from its tiles.

use std::fs::File;
use std::io::{ErrorKind, Read};

use super::store::{Cube, Part};
use crate::spectral::colour::Picture;
use crate::{Error, Result};

/// How many columns and rows of a picture of `size` go into one, so that no more than `max_pixels` are left.
pub fn reduction(size: [u32; 2], max_pixels: u64) -> u32 {
    let pixels = |factor: u32| size.iter().map(|side| u64::from(side.div_ceil(factor))).product::<u64>();
    (1..).find(|&factor| pixels(factor) <= max_pixels).unwrap_or(u32::MAX)
}

impl Cube {
    /// The preview of the whole picture, NaN where nothing is rendered yet.
    pub fn preview(&self) -> Result<Picture> {
        self.preview_of(1, |tile| File::open(self.part_path(Part::Preview, tile)))
    }

    /// The preview from files that `open` finds, none where a tile has no samples yet; means of `factor` x `factor`
    /// pixels, so that the memory it takes is bounded whatever the cube's size.
    pub(super) fn preview_of(&self, factor: u32, open: impl Fn(u32) -> std::io::Result<File>) -> Result<Picture> {
        let grid = self.grid();
        let [width, height] = grid.size.map(|side| side.div_ceil(factor));
        // The zero that changes nothing it is added to.
        let mut rgb = vec![-0.0f32; width as usize * height as usize * 3];
        let mut counts = vec![0u32; width as usize * height as usize];
        let mut tile_rgb = vec![0.0f32; grid.tile_pixels() * 3];
        for tile in 0..grid.count() {
            let failed = |what: &dyn std::fmt::Display| Error::storage(&self.part_path(Part::Preview, tile), what);
            match open(tile) {
                Ok(mut file) => file
                    .read_exact(bytemuck::cast_slice_mut(&mut tile_rgb))
                    .map_err(|error| failed(&format!("is damaged: {error}")))?,
                Err(error) if error.kind() == ErrorKind::NotFound => continue,
                Err(error) => return Err(failed(&error)),
            }
            let rect = grid.rect(tile);
            for (y, row) in (rect.y0..rect.y1).zip(tile_rgb.chunks_exact(grid.tile[0] as usize * 3)) {
                for (x, pixel) in (rect.x0..rect.x1).zip(row.chunks_exact(3)) {
                    let at = (y / factor) as usize * width as usize + (x / factor) as usize;
                    counts[at] += 1;
                    rgb[3 * at..3 * at + 3].iter_mut().zip(pixel).for_each(|(sum, value)| *sum += value);
                }
            }
        }
        for (pixel, &count) in rgb.chunks_exact_mut(3).zip(&counts) {
            // One pixel is itself, to the last bit; none is NaN.
            if count != 1 {
                pixel.iter_mut().for_each(|value| *value /= count as f32);
            }
        }
        Ok(Picture { size: [width, height], rgb })
    }
}

#[cfg(test)]
mod tests {
    use super::reduction;

    #[test]
    fn large_pictures_are_reduced_and_others_are_not() {
        assert_eq!(reduction([3840, 2160], 3840 * 2160), 1);
        assert_eq!(reduction([3841, 2160], 3840 * 2160), 2);
        assert_eq!(reduction([100_000, 100_000], 1 << 23), 35);
        assert_eq!(reduction([1, u32::MAX], 1), u32::MAX);
    }
}
