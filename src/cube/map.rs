//! Chunks mapped into memory: the only place that maps files.

use std::fs::File;
use std::path::Path;

use memmap2::Mmap;

use super::grid::Rect;
use super::metadata::Layout;
use crate::{Error, Result};

#[cfg(target_endian = "big")]
compile_error!("chunks are little-endian floats that are used in place; a big-endian host would need to swap them");

/// The radiance of one tile, mapped from its file: [tile_w][tile_h][K] f32, column by column, the channel fastest
/// ([tile_h][tile_w][K] in cubes of version 1). Pixels beyond the edge of the picture are NaN. It stays what it was when the
/// tile is merged again.
pub struct Chunk {
    values: Values,
    rect: Rect,
    tile: [u32; 2],
    channels: usize,
    layout: Layout,
}

/// Where the values are.
enum Values {
    File(Mmap),
    /// Made of weights.
    Memory(Vec<f32>),
}

impl Chunk {
    /// Values made of something else, column by column.
    pub(super) fn of(values: Vec<f32>, rect: Rect, tile: [u32; 2], channels: usize) -> Chunk {
        Chunk { values: Values::Memory(values), rect, tile, channels, layout: Layout::Columns }
    }

    /// Maps a chunk that is open; `path` is what errors name.
    pub(super) fn map(
        file: &File,
        path: &Path,
        rect: Rect,
        tile: [u32; 2],
        channels: usize,
        layout: Layout,
    ) -> Result<Chunk> {
        // SAFETY: a mapped file must not change or shrink underneath. Spectile never writes to a chunk that bears its
        // name: a new one is written aside and renamed over it, and the old one lives on for as long as it is mapped.
        let map = unsafe { Mmap::map(file) }.map_err(|error| Error::storage(path, format!("cannot map: {error}")))?;
        let (bytes, expected) = (map.len(), tile[0] as usize * tile[1] as usize * channels * 4);
        if bytes != expected {
            return Err(Error::storage(path, format!("is damaged: {bytes} bytes long, not {expected}")));
        }
        Ok(Chunk { values: Values::File(map), rect, tile, channels, layout })
    }

    /// All values, as they lie in the file.
    pub fn values(&self) -> &[f32] {
        // A mapping starts at a page, so it is aligned, and `map` has checked the length.
        match &self.values {
            Values::File(map) => bytemuck::cast_slice(map),
            Values::Memory(values) => values,
        }
    }

    /// The file as it is.
    pub(super) fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(self.values())
    }

    pub(super) fn layout(&self) -> Layout {
        self.layout
    }

    /// The pixels of the picture in this tile.
    pub fn rect(&self) -> Rect {
        self.rect
    }

    /// The K channels of a pixel of the picture that lies in this tile.
    pub fn spectrum(&self, x: u32, y: u32) -> &[f32] {
        &self.spectra_from(x, y)[..self.channels]
    }

    /// All values from the spectrum of a pixel of this tile on. That of the pixel to its right begins [`Chunk::column_step`]
    /// values later.
    pub(super) fn spectra_from(&self, x: u32, y: u32) -> &[f32] {
        let pixel = self.layout.pixel(self.tile, x - self.rect.x0, y - self.rect.y0);
        &self.values()[pixel * self.channels..]
    }

    pub(super) fn column_step(&self) -> usize {
        self.layout.pixel(self.tile, 1, 0) * self.channels
    }
}
