//! The colour picture of a cube, put together from its tiles.

use super::state::Window;
use super::store::Cube;
use crate::Result;
use crate::spectral::tone::Picture;

/// How many columns and rows of a picture of `size` go into one, so that no more than `max_pixels` are left.
pub fn reduction(size: [u32; 2], max_pixels: u64) -> u32 {
    let pixels = |factor: u32| size.iter().map(|side| u64::from(side.div_ceil(factor))).product::<u64>();
    // A larger factor never leaves more.
    let (mut low, mut high) = (1, u32::MAX);
    while low < high {
        let middle = low + (high - low) / 2;
        if pixels(middle) <= max_pixels { high = middle } else { low = middle + 1 }
    }
    low
}

impl Cube {
    /// The preview of the whole picture, NaN where nothing is rendered yet.
    pub fn preview(&self) -> Result<Picture> {
        self.state().colour(self.grid().whole(), 1).map(Window::into_picture)
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
