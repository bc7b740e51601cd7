//! Colour: from a spectrum over channels to CIE XYZ and linear sRGB.
//!
//! What a cube's preview shows is a fixed linear function of a pixel's channels, a [`Projection`]. Exposure and the
//! sRGB transfer function come later, when a picture is shown or written: see [`super::tone`].

use std::sync::OnceLock;

use super::data::{self, columns};
use super::{Channels, Curve, Outside, Response};

/// CIE XYZ (D65 white, Y = 1) to linear sRGB, from the primaries and the white point of IEC 61966-2-1.
pub const XYZ_TO_LINEAR_SRGB: [[f64; 3]; 3] = [
    [3.240_969_941_904_521, -1.537_383_177_570_093, -0.498_610_760_293],
    [-0.969_243_636_280_87, 1.875_967_501_507_72, 0.041_555_057_407_175],
    [0.055_630_079_696_993, -0.203_976_958_888_976, 1.056_971_514_242_878],
];

/// Share of each of ∫x̄, ∫ȳ and ∫z̄ that the channels must cover for XYZ to stand for what an eye would see.
const VISIBLE_SHARE: f64 = 0.95;

/// Whose colour matching functions.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Observer {
    /// CIE 1931, 2°
    #[default]
    #[value(name = "1931")]
    Cie1931,
    /// CIE 1964, 10°
    #[value(name = "1964")]
    Cie1964,
    /// CIE 2015, 2°
    #[value(name = "2015")]
    Cie2015,
}

impl Observer {
    pub fn name(self) -> &'static str {
        match self {
            Observer::Cie1931 => "CIE 1931",
            Observer::Cie1964 => "CIE 1964",
            Observer::Cie2015 => "CIE 2015",
        }
    }

    /// x̄, ȳ, z̄ over nm; zero outside their table, which ends at 830 nm.
    pub fn curves(self) -> &'static [Curve; 3] {
        static OBSERVERS: [OnceLock<[Curve; 3]>; 3] = [const { OnceLock::new() }; 3];
        let table = match self {
            Observer::Cie1931 => data::CIE1931,
            Observer::Cie1964 => data::CIE1964,
            Observer::Cie2015 => data::CIE2015,
        };
        OBSERVERS[self as usize].get_or_init(|| {
            let rows: Vec<[f64; 4]> = columns(table).collect();
            std::array::from_fn(|i| Curve::Linear {
                nm: rows.iter().map(|row| row[0]).collect(),
                value: rows.iter().map(|row| row[i + 1]).collect(),
                outside: Outside::Zero,
            })
        })
    }

    /// ∫x̄ dλ, ∫ȳ dλ and ∫z̄ dλ over all wavelengths, in nm.
    fn integrals(self) -> [f64; 3] {
        self.curves().each_ref().map(|curve| curve.mean(300.0, 900.0) * 600.0)
    }

    /// ∫ȳ dλ over all wavelengths, nm.
    pub fn luminous_nm(self) -> f64 {
        self.integrals()[1]
    }

    /// X, Y and Z of light with this distribution over nm: ∫ x̄ L dλ and so on, over ∫ȳ dλ, so that a constant 1 has Y = 1. Exact where
    /// the light is piecewise linear.
    pub fn xyz(self, light: &Curve) -> [f64; 3] {
        let luminous = self.integrals()[1];
        self.curves().each_ref().map(|curve| {
            let Curve::Linear { nm, .. } = curve else { unreachable!("observers are tables") };
            // Between nodes of either both are lines: Simpson's rule is exact.
            let mut nodes = nm.clone();
            if let Curve::Linear { nm: more, .. } = light {
                nodes.extend(more.iter().filter(|x| (nm[0]..=nm[nm.len() - 1]).contains(*x)));
                nodes.sort_by(f64::total_cmp);
                nodes.dedup();
            }
            let piece = |from: f64, to: f64| {
                let inside = 1e-9 * (to - from);
                let of = |at: f64| curve.eval(at) * light.eval(at);
                (to - from) / 6.0 * (of(from + inside) + 4.0 * of(0.5 * (from + to)) + of(to - inside))
            };
            nodes.windows(2).map(|pair| piece(pair[0], pair[1])).sum::<f64>() / luminous
        })
    }

    /// X, Y and Z as channels whose responses are x̄, ȳ and z̄.
    pub fn channels(self) -> Channels {
        let named = ["X", "Y", "Z"].into_iter().zip(self.curves()).filter_map(|(name, curve)| match curve {
            Curve::Linear { nm, value, .. } => Some((name.to_owned(), Response::new(nm.clone(), value.clone()).ok()?)),
            _ => None,
        });
        Channels::from_responses(named.collect(), None)
    }
}

/// Per channel, what 1 W m⁻² sr⁻¹ nm⁻¹ in it adds to X, Y and Z: ∫ x̄/n dλ over the channel, divided by ∫ȳ dλ, where
/// n(λ) is the number of channels that cover λ.
///
/// So radiance that is constant within each channel is integrated exactly, whatever their widths, gaps count nothing,
/// and where channels overlap their mean counts; a constant 1 over the whole visible has Y = 1.
pub fn xyz_weights(channels: &Channels, observer: Observer) -> Vec<[f64; 3]> {
    let running = RunningIntegral::new(channels, observer.curves());
    let luminous = observer.integrals()[1];
    let weight = |from, to| {
        let (a, b) = (running.at(from), running.at(to));
        std::array::from_fn(|i| (b[i] - a[i]) / luminous)
    };
    channels.bounds.iter().map(|&[from, to]| weight(from, to)).collect()
}

/// ∫ R/n of some curves R from the lowest channel bound up to each bound, n(λ) the number of channels that cover λ. A
/// running integral costs one sort where going through each channel's overlaps would cost K².
pub(crate) struct RunningIntegral<const N: usize> {
    nm: Vec<f64>,
    value: Vec<[f64; N]>,
}

impl<const N: usize> RunningIntegral<N> {
    pub fn new(channels: &Channels, curves: &[Curve; N]) -> Self {
        let mut ends: Vec<(f64, i64)> = channels.bounds.iter().flat_map(|b| [(b[0], 1), (b[1], -1)]).collect();
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut nm, mut value) = (vec![ends[0].0], vec![[0.0; N]]);
        let (mut covering, mut sum) = (0, [0.0; N]);
        for (end, step) in ends {
            let from = nm[nm.len() - 1];
            if end > from {
                if covering > 0 {
                    for (sum, curve) in sum.iter_mut().zip(curves) {
                        *sum += curve.mean(from, end) * (end - from) / covering as f64;
                    }
                }
                nm.push(end);
                value.push(sum);
            }
            covering += step;
        }
        RunningIntegral { nm, value }
    }

    /// The integral up to `nm`, which is a bound of some channel.
    pub fn at(&self, nm: f64) -> [f64; N] {
        self.value[self.nm.partition_point(|&x| x < nm)]
    }
}

/// How the preview makes red, green and blue out of the channels of a pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Projection {
    pub kind: ProjectionKind,
    /// (channel, its weights in R, G, B), channels without weight left out.
    weights: Vec<(usize, [f64; 3])>,
}

/// What the preview shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProjectionKind {
    /// Linear sRGB of XYZ: what an eye would see.
    Xyz,
    /// The radiance of three channels as R, G, B.
    FalseColour([usize; 3]),
}

impl Projection {
    /// The same with the value of each channel k times `factor(k)`.
    pub fn times(mut self, factor: impl Fn(usize) -> f64) -> Self {
        for (k, weights) in &mut self.weights {
            weights.iter_mut().for_each(|weight| *weight *= factor(*k));
        }
        self
    }

    /// The projection for these channels: `channels.false_colour` where given, else XYZ where the visible is covered,
    /// else the channels of lowest, middle and highest centre wavelength as R, G, B.
    ///
    /// *The visible is covered* when the union of the channels holds at least 95 % of each of ∫x̄, ∫ȳ and ∫z̄ dλ and
    /// at least three channels take part: fewer carry no hue.
    pub fn new(channels: &Channels) -> Self {
        if let Some(rgb) = channels.false_colour {
            return Self::false_colour(rgb);
        }
        if let Some(xyz) = Self::as_seen(channels, Observer::default()) {
            return xyz;
        }
        Self::false_colour(three_of(channels, false))
    }

    /// Linear sRGB of what `observer` would see; `None` where the channels do not cover the visible, or are responses: those
    /// do not tell which wavelengths the light has.
    pub fn as_seen(channels: &Channels, observer: Observer) -> Option<Self> {
        if !channels.responses.is_empty() {
            return None;
        }
        let xyz = xyz_weights(channels, observer);
        covers_the_visible(&xyz, observer).then(|| Self::xyz(&xyz))
    }

    fn xyz(xyz: &[[f64; 3]]) -> Self {
        let weights = xyz
            .iter()
            .enumerate()
            .filter(|(_, weight)| weight.iter().any(|&w| w != 0.0))
            .map(|(k, weight)| (k, xyz_to_linear_srgb(*weight)))
            .collect();
        Projection { kind: ProjectionKind::Xyz, weights }
    }

    /// The radiance of three channels as red, green and blue.
    pub fn false_colour(rgb: [usize; 3]) -> Self {
        let mut weights: Vec<(usize, [f64; 3])> = Vec::new();
        for (i, k) in rgb.into_iter().enumerate() {
            match weights.iter_mut().find(|w| w.0 == k) {
                Some(weight) => weight.1[i] = 1.0,
                None => weights.push((k, std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }))),
            }
        }
        Projection { kind: ProjectionKind::FalseColour(rgb), weights }
    }

    /// The channels that take part.
    pub fn channels(&self) -> impl Iterator<Item = usize> {
        self.weights.iter().map(|(k, _)| *k)
    }

    /// Linear R, G, B of one pixel, from its K channels.
    pub fn rgb(&self, spectrum: &[f32]) -> [f32; 3] {
        self.rgb_of(self.channels().map(|k| spectrum[k]))
    }

    /// Linear R, G, B of the values in [`Projection::channels`].
    pub fn rgb_of(&self, values: impl Iterator<Item = f32>) -> [f32; 3] {
        let mut rgb = [0.0; 3];
        for ((_, weight), radiance) in self.weights.iter().zip(values) {
            let radiance = f64::from(radiance);
            for i in 0..3 {
                rgb[i] += weight[i] * radiance;
            }
        }
        rgb.map(|v| v as f32)
    }
}

/// Three of `channels` to stand for red, green and blue where nobody has said which: those nearest to 640, 550 and 460 nm
/// where they are `visible`, else those of lowest, middle and highest centre wavelength.
pub fn three_of(channels: &Channels, visible: bool) -> [usize; 3] {
    let mut order: Vec<usize> = (0..channels.len()).collect();
    order.sort_by(|&a, &b| channels.centre(a).total_cmp(&channels.centre(b)));
    let last = order.len() - 1;
    if !visible {
        return [order[0], order[last / 2], order[last]];
    }
    [640.0, 550.0, 460.0].map(|nm| {
        let distance = |k: usize| (channels.centre(k) - nm).abs();
        order.iter().copied().min_by(|&a, &b| distance(a).total_cmp(&distance(b))).unwrap_or(order[0])
    })
}

/// Whether XYZ from channels of these weights shows what an eye would see (see [`Projection::new`]).
fn covers_the_visible(xyz: &[[f64; 3]], observer: Observer) -> bool {
    let integrals = observer.integrals();
    let taking_part = xyz.iter().filter(|weight| weight[1] > 0.0).count();
    let covered = |i: usize| xyz.iter().map(|weight| weight[i]).sum::<f64>() * integrals[1] / integrals[i];
    taking_part >= 3 && (0..3).all(|i| covered(i) >= VISIBLE_SHARE)
}

/// Linear sRGB of CIE XYZ; negative components are colours outside the gamut.
pub fn xyz_to_linear_srgb(xyz: [f64; 3]) -> [f64; 3] {
    XYZ_TO_LINEAR_SRGB.map(|row| row[0] * xyz[0] + row[1] * xyz[1] + row[2] * xyz[2])
}

/// The sRGB transfer function (IEC 61966-2-1): linear 0…1 to encoded 0…1.
pub fn srgb_encode(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The inverse of [`srgb_encode`].
pub fn srgb_decode(encoded: f64) -> f64 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum(weights: &[[f64; 3]]) -> [f64; 3] {
        weights.iter().fold([0.0; 3], |s, w| std::array::from_fn(|i| s[i] + w[i]))
    }

    fn channels(bounds: &[[f64; 2]]) -> Channels {
        Channels::from_bounds(bounds.to_vec(), None)
    }

    /// Known sums of the 1 nm table: ∫x̄ = 106.865, ∫ȳ = 106.857, ∫z̄ = 106.892 nm.
    #[test]
    fn observer_has_its_published_sums() {
        for (got, expected) in Observer::Cie1931.integrals().into_iter().zip([106.865, 106.857, 106.892]) {
            assert!((got - expected).abs() < 1e-3, "{got} {expected}");
        }
    }

    /// The white point of D65 is published for both classical observers: (0.31272, 0.32903) for 2°, (0.31382, 0.33100) for
    /// 10° (ISO/CIE 11664-2, from the 1 nm tables; a table of 5 nm differs in the fifth digit).
    #[test]
    fn observers_see_daylight_where_the_cie_says() {
        let (nm, value) = columns::<2>(super::super::data::D65).map(|[nm, value]| (nm, value)).unzip();
        let curve = Curve::Linear { nm, value, outside: Outside::Zero };
        let channels = Channels::equal(360.0, 780.0, 420);
        for (observer, x, y) in [(Observer::Cie1931, 0.31272, 0.32903), (Observer::Cie1964, 0.31382, 0.33100)] {
            let xyz = xyz_weights(&channels, observer).iter().enumerate().fold([0.0; 3], |s, (k, w)| {
                let radiance = curve.mean(360.0 + k as f64, 361.0 + k as f64);
                std::array::from_fn(|i| s[i] + w[i] * radiance)
            });
            let total: f64 = xyz.iter().sum();
            assert!((xyz[0] / total - x).abs() < 5e-5 && (xyz[1] / total - y).abs() < 5e-5, "{observer:?} {xyz:?}");
        }
        // Equal energy is white for the observer of 2015 by construction.
        let [x, y, z] = Observer::Cie2015.integrals();
        assert!((x / y - 1.0).abs() < 2e-4 && (z / y - 1.0).abs() < 2e-4, "{x} {y} {z}");
    }

    /// Against channels of 1 nm in which the light is a constant, and of the nodes between: X, Y, Z by both are sums over the same pieces.
    #[test]
    fn light_has_the_colour_of_fine_channels() {
        let light = Curve::Linear {
            nm: vec![400.5, 500.25, 500.25, 700.0],
            value: vec![1.0, 3.0, 0.5, 2.0],
            outside: Outside::Zero,
        };
        let body = Curve::Blackbody { kelvin: 3000.0, scale: 1e-3 };
        let channels = Channels::equal(360.0, 830.0, 47_000);
        for (light, observer) in [(&light, Observer::Cie1931), (&body, Observer::Cie1964)] {
            let weights = xyz_weights(&channels, observer);
            let want = weights.iter().zip(&channels.bounds).fold([0.0; 3], |sum, (w, [from, to])| {
                let mean = light.mean(*from, *to);
                std::array::from_fn(|i| sum[i] + w[i] * mean)
            });
            // Within 0.01 nm both are lines: means of products are products of means to their slopes' product over twelve.
            for (got, want) in observer.xyz(light).into_iter().zip(want) {
                assert!((got / want - 1.0).abs() < 1e-6, "{got} {want}");
            }
        }
        let integrals = Observer::Cie1931.integrals();
        let white = Observer::Cie1931.xyz(&Curve::Constant(1.0));
        assert!((0..3).all(|i| (white[i] / (integrals[i] / integrals[1]) - 1.0).abs() < 1e-12));
    }

    #[test]
    fn observers_are_channels_too() {
        let channels = Observer::Cie1964.channels();
        assert_eq!(channels.names, ["X", "Y", "Z"]);
        for k in 0..3 {
            assert!((channels.integral(k) / Observer::Cie1964.integrals()[k] - 1.0).abs() < 1e-12);
        }
        assert_eq!(Projection::as_seen(&channels, Observer::Cie1964), None);
    }

    #[test]
    fn three_stand_for_red_green_and_blue() {
        let visible = Channels::equal(400.0, 800.0, 4);
        assert_eq!(three_of(&visible, true), [2, 1, 0]);
        assert_eq!(three_of(&visible, false), [0, 1, 3]);
        assert_eq!(three_of(&channels(&[[9e3, 1e4], [8e3, 9e3]]), false), [1, 1, 0]);
        assert_eq!(three_of(&channels(&[[9e3, 1e4]]), true), [0; 3]);
    }

    /// The matrix from the primaries' chromaticities and white (0.3127, 0.3290), independently of its digits above.
    #[test]
    fn matrix_follows_from_the_primaries() {
        let xyz = |x: f64, y: f64| [x / y, 1.0, (1.0 - x - y) / y];
        let primaries = [xyz(0.64, 0.33), xyz(0.30, 0.60), xyz(0.15, 0.06)];
        assert_eq!(xyz_to_linear_srgb(xyz(0.3127, 0.3290)).map(|v| (v * 1e6).round()), [1e6; 3]);
        for (i, primary) in primaries.into_iter().enumerate() {
            for (j, v) in xyz_to_linear_srgb(primary).into_iter().enumerate() {
                assert!(if i == j { v > 0.1 } else { v.abs() < 1e-9 }, "primary {i} component {j}: {v}");
            }
        }
    }

    #[test]
    fn constant_radiance_has_unit_luminance_for_any_partition() {
        let whole = channels(&[[360.0, 830.0]]);
        let uneven = channels(&[[700.0, 830.0], [360.0, 361.3], [361.3, 555.55], [555.55, 700.0]]);
        let fine = Channels::equal(360.0, 830.0, 997);
        for c in [whole, uneven, fine] {
            let total = sum(&xyz_weights(&c, Observer::Cie1931));
            assert!((total[1] - 1.0).abs() < 1e-12, "{total:?}");
            assert!((total[0] - 106.865 / 106.857).abs() < 1e-5 && (total[2] - 106.892 / 106.857).abs() < 1e-5);
        }
    }

    #[test]
    fn overlaps_share_and_gaps_count_nothing() {
        let plain = xyz_weights(&channels(&[[400.0, 500.0], [500.0, 600.0], [600.0, 700.0]]), Observer::Cie1931);
        let twice = xyz_weights(
            &channels(&[[400.0, 500.0], [500.0, 600.0], [500.0, 600.0], [600.0, 700.0]]),
            Observer::Cie1931,
        );
        for i in 0..3 {
            assert!((twice[1][i] - 0.5 * plain[1][i]).abs() < 1e-14 && twice[1] == twice[2]);
        }
        let partly = xyz_weights(&channels(&[[400.0, 600.0], [500.0, 700.0]]), Observer::Cie1931);
        assert!((sum(&partly)[1] - sum(&plain)[1]).abs() < 1e-14);
        let (left, middle) = (partly[0][1], plain[1][1]);
        assert!((left - (plain[0][1] + 0.5 * middle)).abs() < 1e-14);
        let gap = xyz_weights(&channels(&[[400.0, 500.0], [600.0, 700.0], [8000.0, 12000.0]]), Observer::Cie1931);
        for i in 0..3 {
            assert!((gap[0][i] - plain[0][i]).abs() < 1e-15 && (gap[1][i] - plain[2][i]).abs() < 1e-14);
        }
        assert_eq!(gap[2], [0.0; 3]);
    }

    #[test]
    fn projection_is_xyz_only_where_the_visible_is_covered() {
        assert_eq!(Projection::new(&Channels::equal(380.0, 780.0, 8)).kind, ProjectionKind::Xyz);
        assert_eq!(Projection::new(&Channels::equal(405.0, 700.0, 59)).kind, ProjectionKind::Xyz);
        assert_eq!(Projection::new(&Channels::equal(380.0, 20_000.0, 2000)).kind, ProjectionKind::Xyz);
        let false_colour = |c: &Channels| match Projection::new(c).kind {
            ProjectionKind::FalseColour(rgb) => rgb,
            kind => panic!("{kind:?}"),
        };
        assert_eq!(false_colour(&Channels::equal(380.0, 780.0, 1)), [0, 0, 0]);
        assert_eq!(false_colour(&Channels::equal(380.0, 780.0, 2)), [0, 0, 1]);
        assert_eq!(false_colour(&Channels::equal(380.0, 600.0, 40)), [0, 19, 39]);
        assert_eq!(false_colour(&channels(&[[8e3, 9e3], [3e3, 4e3], [4e3, 5e3]])), [1, 2, 0]);
        let asked = Channels { false_colour: Some([2, 0, 0]), ..Channels::equal(380.0, 780.0, 8) };
        assert_eq!(false_colour(&asked), [2, 0, 0]);
        let spectrum = [0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0];
        assert_eq!(Projection::new(&asked).rgb(&spectrum), [0.3, 0.1, 0.1]);
    }

    /// D65 has x, y = 0.31271, 0.32902; it is the white of sRGB.
    #[test]
    fn daylight_is_white() {
        let (nm, value) = columns::<2>(super::super::data::D65).map(|[nm, value]| (nm, value)).unzip();
        let curve = Curve::Linear { nm, value, outside: Outside::Zero };
        let channels = Channels::equal(360.0, 780.0, 420);
        let spectrum: Vec<f32> = (0..420).map(|k| curve.mean(360.0 + k as f64, 361.0 + k as f64) as f32).collect();
        let xyz = xyz_weights(&channels, Observer::Cie1931).iter().zip(&spectrum).fold([0.0; 3], |s, (w, &l)| {
            std::array::from_fn(|i| s[i] + w[i] * f64::from(l)) //
        });
        let total: f64 = xyz.iter().sum();
        assert!((xyz[0] / total - 0.31271).abs() < 5e-5 && (xyz[1] / total - 0.32902).abs() < 5e-5, "{xyz:?}");
        let rgb = Projection::new(&channels).rgb(&spectrum).map(|v| f64::from(v) / xyz[1]);
        assert!(rgb.iter().all(|v| (v - 1.0).abs() < 1e-3), "{rgb:?}");
    }

    #[test]
    fn transfer_function() {
        assert_eq!(srgb_encode(0.0), 0.0);
        assert!((srgb_encode(1.0) - 1.0).abs() < 1e-12);
        assert!((srgb_encode(0.18) - 0.461_356).abs() < 1e-6);
        assert!((srgb_encode(0.003_130_8) - srgb_encode(0.003_130_800_1)).abs() < 1e-6);
    }
}
