//! What the tests of the cube share: cubes with known content, and random numbers that never change.

use std::ops::Deref;
use std::path::Path;

use serde_json::{Map, json};
use spectile::Result;
use spectile::cube::{Cube, Existing, Header, Writer};
use spectile::spectral::Channels;

/// SplitMix64 (Steele, Lea and Flood 2014).
pub struct Random(pub u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }
}

pub fn header(size: [u32; 2], tile: [u32; 2], channels: usize) -> Header {
    Header {
        size,
        origin: [0, 0],
        tile,
        channels: Channels::equal(380.0, 780.0, channels),
        epoch: 64,
        attributes: Map::from_iter([("seed".to_owned(), json!(7)), ("scene_digest".to_owned(), json!("0123abcd"))]),
    }
}

/// A cube that this test writes to, every unit committed at once.
pub struct Written(Writer);

impl Deref for Written {
    type Target = Cube;

    fn deref(&self) -> &Cube {
        self.0.cube()
    }
}

impl Written {
    /// Writes to all tiles.
    pub fn open(path: &Path, header: Header, existing: Existing) -> Result<Written> {
        let tiles = header.validate().map_or(0..1, |()| 0..header.grid().count());
        Writer::open(path, &header, existing, tiles, &mut |what| panic!("{what}")).map(Written)
    }

    pub fn merge_unit(&self, tile: u32, n_unit: u32, unit: &[f32]) -> Result<()> {
        self.0.merge_unit(tile, self.samples(tile)?, n_unit, unit)?;
        self.0.flush()
    }
}

pub fn create(folder: &Path, name: &str, header: Header) -> Written {
    Written::open(&folder.join(name), header, Existing::Refuse).expect("a new cube")
}

/// A unit with `value(x, y, k)` in the picture and garbage beyond its edge.
pub fn unit(cube: &Cube, tile: u32, mut value: impl FnMut(u32, u32, usize) -> f32) -> Vec<f32> {
    let (grid, channels) = (cube.grid(), cube.channels().len());
    let rect = grid.rect(tile);
    let mut unit = vec![123.456f32; grid.tile_pixels() * channels];
    for y in rect.y0..rect.y1 {
        for x in rect.x0..rect.x1 {
            let pixel = ((y - rect.y0) * grid.tile[0] + x - rect.x0) as usize;
            for k in 0..channels {
                unit[pixel * channels + k] = value(x, y, k);
            }
        }
    }
    unit
}

/// A value that tells pixel and channel apart, with all 24 bits of its mantissa in use.
pub fn pattern(x: u32, y: u32, k: usize) -> f32 {
    (f64::from(x) + 100.0 * f64::from(y) + 1e4 * k as f64 + 1.0 / 3.0) as f32
}

/// A cube whose tiles all hold [`pattern`] as their first sample.
pub fn patterned(folder: &Path, name: &str, header: Header) -> Written {
    let cube = create(folder, name, header);
    for tile in 0..cube.grid().count() {
        cube.merge_unit(tile, 1, &unit(&cube, tile, pattern)).expect("merged");
    }
    cube
}
