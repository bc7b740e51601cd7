//! From linear numbers to what a screen shows: exposure, 8-bit sRGB, a colour map, and percentiles to choose them by.

use std::convert::Infallible;

use super::colour::srgb_encode;

/// A linear value as 8-bit sRGB; what is beyond 0 and 1 is cut, NaN is 0.
pub fn srgb8(linear: f64) -> u8 {
    // `as u8` saturates, and sends NaN to 0.
    (255.0 * srgb_encode(linear) + 0.5).floor() as u8
}

/// Colours of [`map_srgb8`], from its low end to its high one.
pub const MAP_LEVELS: usize = 256;

/// The colour at one of [`MAP_LEVELS`]: a map that is perceptually uniform (inferno, by N. Smith and S. van der Walt).
pub fn map_level(level: usize) -> [u8; 3] {
    colorous::INFERNO.eval_rational(level.min(MAP_LEVELS - 1), MAP_LEVELS).as_array()
}

/// 8-bit sRGB of one quantity in the colours of [`map_level`], from the first to the second number of `range`. What lies
/// beyond its ends has their colours, what is not rendered yet is black.
pub fn map_srgb8(values: &[f32], range: [f64; 2]) -> Vec<u8> {
    let [low, high] = range;
    let last = (MAP_LEVELS - 1) as f64;
    let colour = |value: f64| match (value - low) / (high - low) {
        _ if value.is_nan() => [0, 0, 0],
        // A range of no width: all is at its upper end, or below.
        t if t.is_nan() => map_level(MAP_LEVELS - 1),
        t => map_level((last * t.clamp(0.0, 1.0) + 0.5) as usize),
    };
    values.iter().flat_map(|&value| colour(f64::from(value))).collect()
}

/// How numbers become brightness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tone {
    /// Of linear R, G, B: EV, a factor of 2^EV.
    Exposure(f64),
    /// Of one quantity: the ends of the colour map.
    Range([f64; 2]),
}

impl Tone {
    /// 8-bit sRGB, of three values a pixel or of one.
    pub fn srgb8(self, values: &[f32]) -> Vec<u8> {
        match self {
            Tone::Exposure(ev) => values.iter().map(|&v| srgb8(f64::from(v) * ev.exp2())).collect(),
            Tone::Range(range) => map_srgb8(values, range),
        }
    }
}

/// Percentiles of what is finite and above zero, as what has no light has no place on a scale, to the last bit and without
/// holding the values: `each` goes through all of them and is called twice. `None` where there are none.
pub fn percentiles_of<const N: usize, E>(
    percents: [u64; N],
    mut each: impl FnMut(&mut dyn FnMut(f32)) -> Result<(), E>,
) -> Result<Option<[f32; N]>, E> {
    // Positive numbers are ordered as their bits are. First the upper half of these is found, then the lower one.
    let lit = |v: f32| (v.is_finite() && v > 0.0).then(|| [(v.to_bits() >> 16) as usize, v.to_bits() as u16 as usize]);
    let mut upper = vec![0u64; 1 << 16];
    each(&mut |v| lit(v).into_iter().for_each(|[high, _]| upper[high] += 1))?;
    let Some(last) = upper.iter().sum::<u64>().checked_sub(1) else { return Ok(None) };
    // Where in `counts` the number of that rank is, and its rank among those there.
    let find = |counts: &[u64], mut rank: u64| {
        let at = counts.iter().position(|&count| {
            let found = rank < count;
            rank -= if found { 0 } else { count };
            found
        });
        (at.unwrap_or(0), rank)
    };
    let found = percents.map(|percent| find(&upper, (u128::from(last) * u128::from(percent) / 100) as u64));
    let mut lower = found.map(|_| vec![0u64; 1 << 16]);
    each(&mut |v| {
        if let Some([high, low]) = lit(v) {
            let here = lower.iter_mut().zip(found).filter(|(_, found)| found.0 == high);
            here.for_each(|(counts, _)| counts[low] += 1);
        }
    })?;
    Ok(Some(std::array::from_fn(|i| {
        let (high, rank) = found[i];
        let (low, _) = find(&lower[i], rank);
        f32::from_bits((high as u32) << 16 | low as u32)
    })))
}

/// The 1st and the 99th percentile, in the sense of [`percentiles_of`]; 0 and 1 where there are none.
pub fn percentiles(values: &[f32]) -> [f64; 2] {
    let each = |take: &mut dyn FnMut(f32)| -> Result<(), Infallible> {
        values.iter().for_each(|&v| take(v));
        Ok(())
    };
    let Ok(found) = percentiles_of([1, 99], each);
    found.map_or([0.0, 1.0], |found| found.map(f64::from))
}

/// The exposure in EV that brings the 99th percentile of the largest components to 1; 0 where there is none.
pub fn exposure_of(percentile: Option<f32>) -> f64 {
    percentile.map_or(0.0, |v| -f64::from(v).log2())
}

/// The component of a pixel that exposure goes by.
pub fn largest(rgb: &[f32]) -> f32 {
    rgb.iter().copied().fold(f32::NAN, f32::max)
}

/// The exposure in EV that brings the 99th percentile of the largest of each pixel's `planes` values, over the pixels with any
/// light, to 1; 0 without light.
pub fn auto_exposure(values: &[f32], planes: usize) -> f64 {
    let each = |take: &mut dyn FnMut(f32)| -> Result<(), Infallible> {
        values.chunks_exact(planes).for_each(|pixel| take(largest(pixel)));
        Ok(())
    };
    let Ok(found) = percentiles_of([99], each);
    exposure_of(found.map(|[percentile]| percentile))
}

/// A linear picture: rows from the top, R, G, B interleaved; NaN where nothing is rendered yet.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Width and height in pixels.
    pub size: [u32; 2],
    pub rgb: Vec<f32>,
}

impl Picture {
    /// The exposure in EV (a factor of 2^EV) that brings the 99th percentile of the largest component, over the
    /// pixels with any light, to 1. A picture without light has exposure 0.
    pub fn auto_exposure(&self) -> f64 {
        auto_exposure(&self.rgb, 3)
    }

    /// 8-bit sRGB at an exposure of `ev`. What is brighter than 1 or outside the gamut is cut to 0…255, what is not
    /// rendered yet is black.
    pub fn to_srgb8(&self, ev: f64) -> Vec<u8> {
        Tone::Exposure(ev).srgb8(&self.rgb)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against sorting, with numbers of all sizes and what is not counted among them.
    #[test]
    fn percentiles_are_exact_without_holding_anything() {
        let mut bits = 1u32;
        let values: Vec<f32> = (0..5000)
            .map(|_| {
                bits = bits.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f32::from_bits(bits)
            })
            .collect();
        let mut sorted: Vec<f32> = values.iter().copied().filter(|v| v.is_finite() && *v > 0.0).collect();
        sorted.sort_by(f32::total_cmp);
        let at = |percent: usize| sorted[(sorted.len() - 1) * percent / 100];
        let each = |take: &mut dyn FnMut(f32)| -> Result<(), ()> {
            values.iter().for_each(|&v| take(v));
            Ok(())
        };
        assert_eq!(percentiles_of([0, 1, 50, 99, 100], each), Ok(Some([0, 1, 50, 99, 100].map(at))));
        assert_eq!(percentiles(&values), [1, 99].map(|percent| f64::from(at(percent))));
        assert_eq!(
            percentiles_of([50], |take| {
                [0.0, -1.0, f32::NAN].into_iter().for_each(take);
                Ok::<_, ()>(())
            }),
            Ok(None)
        );
        assert_eq!(percentiles_of([50], |_| Err(7)), Err(7));
    }

    #[test]
    fn maps_run_from_dark_to_bright_between_their_ends() {
        assert_eq!(percentiles(&[f32::NAN, f32::INFINITY]), [0.0, 1.0]);
        let ramp: Vec<f32> = (0..=200).map(|i| i as f32).chain([f32::NAN]).collect();
        assert_eq!(percentiles(&ramp), [2.0, 198.0]);
        let bytes = map_srgb8(&[f32::NAN, 1.0, 2.0, 3.0, 4.0, 5.0], [2.0, 4.0]);
        let light = |i: usize| bytes[3 * i..3 * i + 3].iter().map(|&b| u32::from(b)).sum::<u32>();
        assert_eq!((light(0), light(1), light(4)), (0, light(2), light(5)));
        assert!(light(2) < light(3) && light(3) < light(4));
        assert_eq!(map_srgb8(&[7.0], [7.0, 7.0]), map_srgb8(&[9.0], [1.0, 7.0]));
    }

    #[test]
    fn exposure_goes_by_what_is_lit() {
        let pixel = |v: f32| [0.0, v, v / 2.0];
        let picture = |values: &[f32]| Picture {
            size: [values.len() as u32, 1],
            rgb: values.iter().flat_map(|&v| pixel(v)).collect(),
        };
        let ramp: Vec<f32> = (0..=100).map(|i| i as f32 / 25.0 + 0.04).collect();
        assert_eq!(picture(&ramp).auto_exposure(), -f64::from(ramp[99]).log2());
        // Unlit and missing pixels do not count.
        assert_eq!(picture(&[0.0, 0.0, f32::NAN, 0.25]).auto_exposure(), 2.0);
        assert_eq!(picture(&[0.0, f32::NAN]).auto_exposure(), 0.0);
        let bytes = picture(&[1.0, f32::NAN, 7.0, -1.0]).to_srgb8(0.0);
        assert_eq!(bytes, [0, 255, 188, 0, 0, 0, 0, 255, 255, 0, 0, 0]);
        assert_eq!(picture(&[0.5]).to_srgb8(1.0), [0, 255, 188]);
    }
}
