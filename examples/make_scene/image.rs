//! Pictures and maps that scenes read.

use std::f64::consts::{PI, TAU};
use std::fs::{self, File};
use std::io::{self, BufWriter};
use std::path::Path;

use glam::{DVec3, dvec3};

/// Writes a square PNG of `size` pixels whose red, green and blue are the shares of three constituents at (u, v) in
/// [0, 1)², v up. In every pixel the three bytes add up to 255, so the shares to 1.
pub fn abundances(path: &Path, size: u32, mut shares: impl FnMut(f64, f64) -> [f64; 3]) -> io::Result<()> {
    let mut bytes = Vec::with_capacity(size as usize * size as usize * 3);
    for row in 0..size {
        for column in 0..size {
            let at = |k: u32| (f64::from(k) + 0.5) / f64::from(size);
            let [_, second, third] = shares(at(column), 1.0 - at(row));
            let (g, b) = ((second * 255.0).round() as u8, (third * 255.0).round() as u8);
            let b = b.min(255 - g);
            bytes.extend([255 - g - b, g, b]);
        }
    }
    let mut encoder = png::Encoder::new(BufWriter::new(File::create(path)?), size, size);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header()?.write_image_data(&bytes)?;
    println!("{}: {size} x {size} pixels", path.display());
    Ok(())
}

/// A texel above this is the sun's, in the units of `sky.hdr`, whose clouds stay below.
const SUN: f64 = 12.0;
/// Standard deviation of the glow that takes the sun's place, degrees.
const GLOW: f64 = 5.0;
/// Of the sun's light: behind thin cloud.
const KEPT: f64 = 0.35;

/// Rewrites a flat Radiance RGBE lat-long map with the light of its sun spread over a wide glow: the disk itself is a few
/// texels around which the map rings, and would be found through glass by a path in 100,000.
pub fn soften_sun(from: &Path, to: &Path) -> io::Result<()> {
    let bytes = fs::read(from)?;
    let wrong = || io::Error::other(format!("{}: not a flat RGBE map of 512 x 256", from.display()));
    const SIZE: &[u8] = b"-Y 256 +X 512\n";
    let start = bytes.windows(SIZE.len()).position(|w| w == SIZE).ok_or_else(wrong)? + SIZE.len();
    let (width, height) = (512, 256);
    let texels = bytes[start..].as_chunks::<4>().0;
    if texels.len() != width * height {
        return Err(wrong());
    }
    let direction = |i: usize| {
        let (sin, cos) = (PI * ((i / width) as f64 + 0.5) / height as f64).sin_cos();
        let (s, c) = (TAU * ((i % width) as f64 + 0.5) / width as f64).sin_cos();
        (dvec3(sin * c, cos, sin * s), sin * PI / height as f64 * TAU / width as f64)
    };
    let mut colours: Vec<DVec3> = texels.iter().map(|t| rgb(*t)).collect();
    let (mut flux, mut centre) = (DVec3::ZERO, DVec3::ZERO);
    for (i, colour) in colours.iter_mut().enumerate() {
        let peak = colour.max_element();
        if peak > SUN {
            let (towards, solid_angle) = direction(i);
            let excess = *colour * (1.0 - SUN / peak);
            flux += excess * solid_angle;
            centre += towards * excess.max_element() * solid_angle;
            *colour -= excess;
        }
    }
    let sigma = GLOW.to_radians();
    let glow = |i: usize| (-0.5 * (direction(i).0.angle_between(centre) / sigma).powi(2)).exp();
    let total: f64 = (0..colours.len()).map(|i| glow(i) * direction(i).1).sum();
    let mut out = bytes[..start].to_vec();
    for (i, colour) in colours.iter().enumerate() {
        out.extend(rgbe(*colour + flux * KEPT * glow(i) / total));
    }
    println!("{}: its sun as a glow of {GLOW} degrees", to.display());
    fs::write(to, out)
}

/// Ward, "Real pixels", *Graphics Gems II* (1991).
fn rgb([r, g, b, e]: [u8; 4]) -> DVec3 {
    if e == 0 { DVec3::ZERO } else { dvec3(r.into(), g.into(), b.into()) * f64::from(i32::from(e) - 136).exp2() }
}

fn rgbe(colour: DVec3) -> [u8; 4] {
    let peak = colour.max_element();
    if peak < 1e-32 {
        return [0; 4];
    }
    // 0.5 <= peak / 2^exponent < 1
    let exponent = peak.log2().floor() as i32 + 1;
    let [r, g, b] = (colour * f64::from(8 - exponent).exp2()).to_array().map(|x| x.min(255.0) as u8);
    [r, g, b, (exponent + 128) as u8]
}
