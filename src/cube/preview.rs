//! The colour picture of a cube, put together from its tiles.

use super::look::Window;
use super::store::Cube;
use crate::Result;
use crate::spectral::tone::Picture;

/// How many columns and rows of a picture of `size` go into one, so that no more than `max_pixels` are left.
pub fn reduction(size: [u32; 2], max_pixels: u64) -> u32 {
    let pixels = |factor: u32| size.iter().map(|side| u64::from(side.div_ceil(factor))).product::<u64>();
    (1..).find(|&factor| pixels(factor) <= max_pixels).unwrap_or(u32::MAX)
}

impl Cube {
    /// The preview of the whole picture, NaN where nothing is rendered yet.
    pub fn preview(&self) -> Result<Picture> {
        self.look().colour(self.grid().whole(), 1).map(Window::into_picture)
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
