//! What the tests of the cube share: cubes with known content, and random numbers that never change.

use std::ops::Deref;
use std::path::Path;

use serde_json::{Map, json};
use spectile::Result;
use spectile::cube::{Cube, Existing, Header, Weights, Writer};
use spectile::scene::Quantity;
use spectile::spectral::product::{Basis, Expression, Leaf, Product, Term};
use spectile::spectral::{Channels, Curve, Outside};

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

/// What [`factored`] is made of: two lamps, one of them off, a paint that lines of a lamp fall on, a grey.
pub fn basis() -> Basis {
    let leaf = |name: &str, quantity: Quantity, curve: Curve| Leaf {
        name: name.into(),
        is_named: true,
        quantity: quantity.noun().into(),
        curve,
    };
    let paint = Curve::Linear {
        nm: vec![400.0, 480.0, 520.0, 560.0, 600.0, 700.0],
        value: vec![0.1, 0.12, 0.5, 0.3, 0.8, 0.85],
        outside: Outside::Hold,
    };
    let of = |i: usize| Expression { scale: 1.0, terms: vec![Term::Spectrum(i)] };
    Basis {
        spectra: vec![
            leaf("desk lamp", Quantity::Radiance, Curve::Blackbody { kelvin: 2900.0, scale: 1e-5 }),
            leaf("ceiling", Quantity::Radiance, Curve::Constant(0.0)),
            leaf("paint", Quantity::Reflectance, paint),
            leaf("grey", Quantity::Reflectance, Curve::Constant(0.5)),
        ],
        sources: vec![of(0), of(1)],
        factors: vec![of(2), of(3)],
    }
}

/// A factored cube of [`basis`] in which each pixel has weights of its own: the desk lamp from the left, the ceiling from above, onto paint
/// on the right half and grey on the left. With a remainder or without.
pub fn factored(folder: &Path, name: &str, header: Header, has_remainder: bool) -> Written {
    let (remainder, beside): (&[String], &[String]) = match has_remainder {
        true => (&["the material \"cat\" (plastic)".to_owned()], &["varnish".to_owned()]),
        false => (&[], &[]),
    };
    let cube = create(folder, name, header.with_weights(&basis(), 4, remainder, beside));
    let [width, height] = cube.header().size.map(f64::from);
    for tile in 0..cube.grid().count() {
        let (rect, size) = (cube.grid().rect(tile), cube.grid().tile);
        let pixel = |i: u32| {
            let (x, y) = (f64::from(rect.x0 + i % size[0]), f64::from(rect.y0 + i / size[0]));
            let paint = u16::from(x < width / 2.0);
            let product = |source: u16, factors: &[u16]| Product { source, factors: factors.into() };
            let (near, above) = (0.2 + 0.8 * (-3.0 * x / width).exp(), 0.3 + 0.7 * (1.0 - y / height));
            let direct = if (x - 5.0).hypot(y - 5.0) < 3.0 { 1.0 } else { 0.0 };
            let all = [
                (product(0, &[]), direct),
                (product(0, &[paint]), near),
                (product(0, &[0, 1]), 0.1 * near),
                (product(1, &[paint]), above),
                (product(1, &[paint, paint]), 0.2 * above),
            ];
            all.into_iter().filter(|(_, weight)| *weight > 0.0)
        };
        let weights = Weights::of_pixels((0..size[0] * size[1]).map(pixel));
        let more = has_remainder.then(|| unit(&cube, tile, |x, y, k| 2e-8 * (x + 2 * y) as f32 * (k + 1) as f32));
        cube.0.merge_weights(tile, 0, 1, weights, more.as_deref()).expect("merged");
    }
    cube.0.flush().expect("committed");
    cube
}
