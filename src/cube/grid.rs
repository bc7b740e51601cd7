//! How a picture is cut into tiles.

/// Tiles over a picture, numbered row by row from 0. Those at the right and the bottom edge may reach over it: their
/// files have the full tile size, their [`Rect`] only the pixels of the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Grid {
    /// Width and height of the picture in pixels.
    pub size: [u32; 2],
    /// Width and height of a tile in pixels.
    pub tile: [u32; 2],
}

/// Pixels x0..x1, y0..y1 of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rect {
    pub x0: u32,
    pub y0: u32,
    pub x1: u32,
    pub y1: u32,
}

impl Rect {
    pub fn width(&self) -> u32 {
        self.x1 - self.x0
    }

    pub fn height(&self) -> u32 {
        self.y1 - self.y0
    }

    /// The number of pixels.
    pub fn pixels(&self) -> u64 {
        u64::from(self.width()) * u64::from(self.height())
    }

    /// The pixels in both.
    pub fn intersection(&self, other: &Rect) -> Option<Rect> {
        let (x0, y0) = (self.x0.max(other.x0), self.y0.max(other.y0));
        let (x1, y1) = (self.x1.min(other.x1), self.y1.min(other.y1));
        (x0 < x1 && y0 < y1).then_some(Rect { x0, y0, x1, y1 })
    }
}

impl Grid {
    /// Columns and rows of tiles.
    pub fn tiles(&self) -> [u32; 2] {
        [self.size[0].div_ceil(self.tile[0]), self.size[1].div_ceil(self.tile[1])]
    }

    /// All pixels of the picture.
    pub fn whole(&self) -> Rect {
        Rect { x0: 0, y0: 0, x1: self.size[0], y1: self.size[1] }
    }

    /// The number of tiles. [`super::Header`] sees to it that it fits.
    pub fn count(&self) -> u32 {
        let [columns, rows] = self.tiles();
        columns * rows
    }

    /// Column and row of a tile.
    pub fn position(&self, tile: u32) -> [u32; 2] {
        let columns = self.tiles()[0];
        [tile % columns, tile / columns]
    }

    /// The pixels of the picture in a tile.
    pub fn rect(&self, tile: u32) -> Rect {
        let [column, row] = self.position(tile);
        let (x0, y0) = (column * self.tile[0], row * self.tile[1]);
        let end = |start: u32, axis: usize| start + self.tile[axis].min(self.size[axis] - start);
        Rect { x0, y0, x1: end(x0, 0), y1: end(y0, 1) }
    }

    /// The tile that holds a pixel of the picture.
    pub fn tile_at(&self, x: u32, y: u32) -> u32 {
        y / self.tile[1] * self.tiles()[0] + x / self.tile[0]
    }

    /// The number of a pixel of the cube among those of its tile, row by row of full ones.
    pub fn pixel_in_tile(&self, x: u32, y: u32) -> usize {
        (y % self.tile[1]) as usize * self.tile[0] as usize + (x % self.tile[0]) as usize
    }

    /// The tiles that share pixels with `rect`.
    pub fn tiles_in(&self, rect: Rect) -> impl Iterator<Item = u32> + use<> {
        let columns = self.tiles()[0];
        let (x, y) = (rect.x0 / self.tile[0]..=(rect.x1 - 1) / self.tile[0], self.tile[1]);
        (rect.y0 / y..=(rect.y1 - 1) / y).flat_map(move |row| x.clone().map(move |column| row * columns + column))
    }

    /// The pixels of a tile's file, those beyond the edge of the picture included.
    pub fn tile_pixels(&self) -> usize {
        self.tile[0] as usize * self.tile[1] as usize
    }

    /// Columns and rows of [`super::BLOCK`]s of pixels in a tile.
    pub fn tile_blocks(&self) -> [u32; 2] {
        self.tile.map(|side| side.div_ceil(super::BLOCK))
    }

    /// Columns and rows of [`super::BLOCK`]s of pixels in the picture.
    pub fn blocks(&self) -> [u32; 2] {
        self.size.map(|side| side.div_ceil(super::BLOCK))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_lies_in_exactly_one_tile() {
        for (size, tile) in [([1, 1], [64, 64]), ([64, 64], [64, 64]), ([65, 63], [64, 64]), ([50, 33], [16, 8])] {
            let grid = Grid { size, tile };
            let mut seen = vec![0; (size[0] * size[1]) as usize];
            for t in 0..grid.count() {
                let rect = grid.rect(t);
                for y in rect.y0..rect.y1 {
                    for x in rect.x0..rect.x1 {
                        seen[(y * size[0] + x) as usize] += 1;
                        assert_eq!(grid.tile_at(x, y), t);
                    }
                }
            }
            assert!(seen.iter().all(|&n| n == 1), "{grid:?}");
        }
    }

    #[test]
    fn tiles_are_numbered_row_by_row() {
        let grid = Grid { size: [100, 70], tile: [32, 32] };
        assert_eq!((grid.tiles(), grid.count()), ([4, 3], 12));
        assert_eq!(grid.position(5), [1, 1]);
        assert_eq!(grid.rect(11), Rect { x0: 96, y0: 64, x1: 100, y1: 70 });
        let inside = grid.tiles_in(Rect { x0: 31, y0: 32, x1: 65, y1: 65 });
        assert_eq!(inside.collect::<Vec<_>>(), [4, 5, 6, 8, 9, 10]);
    }

    #[test]
    fn intersections() {
        let a = Rect { x0: 0, y0: 0, x1: 10, y1: 10 };
        let b = Rect { x0: 8, y0: 9, x1: 20, y1: 20 };
        assert_eq!(a.intersection(&b), Some(Rect { x0: 8, y0: 9, x1: 10, y1: 10 }));
        assert_eq!(a.intersection(&Rect { x0: 10, ..b }), None);
    }
}
