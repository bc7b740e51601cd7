//! Spectra as the device wants them: for every channel a few strata of the wavelength coordinate μ, in each of them a
//! value and a slope; and exact knots for what no affordable number of strata resolves.

use super::kinks::BentLine;
use super::warp::Warp;
use super::{Channels, Curve};

/// Pointwise bound relative to the channel's peak: what tables may be off, well below a render's noise.
pub const POINTWISE_BOUND: f64 = 1e-4;
/// What makes a curve a line, relative to the channel's peak: some roundings of f32.
const LINE_BOUND: f64 = 1e-6;
/// Most entries (strata x channels) per spectrum, and of all spectra together: 96 MiB, less than what every device binds.
const MAX_ENTRIES: usize = 1 << 18;
const MAX_ENTRIES_IN_ALL: usize = 12 << 20;
/// More strata than this would leave too few bits for the place within one.
const MAX_STRATUM_BITS: u32 = 12;

/// A spectrum that the device gets.
#[derive(Debug, Clone, Copy)]
pub enum Tabulated<'a> {
    /// One curve in all channels.
    Same(&'a Curve),
    /// One curve for each.
    PerChannel(&'a [Curve]),
}

impl<'a> Tabulated<'a> {
    fn of(self, k: usize) -> &'a Curve {
        match self {
            Tabulated::Same(curve) => curve,
            Tabulated::PerChannel(curves) => &curves[k],
        }
    }
}

/// A spectrum, and how the device is to hold it.
#[derive(Debug, Clone, Copy)]
pub struct Wanted<'a> {
    pub spectrum: Tabulated<'a>,
    pub exactness: Exactness,
    /// Times the weights of the wavelengths, see [`Warp::weight`].
    pub weighted: bool,
}

impl<'a> From<Tabulated<'a>> for Wanted<'a> {
    fn from(spectrum: Tabulated<'a>) -> Self {
        Wanted { spectrum, exactness: Exactness::Peak, weighted: false }
    }
}

/// One spectrum over one stratum of one channel: `value + place * slope`, place in [0, 1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    pub value: f64,
    pub slope: f64,
}

/// The tables of a scene. Spectrum ids number the curves given to [`SpectralTables::build`] in another order: see `ids`.
#[derive(Debug)]
pub struct SpectralTables {
    /// Each channel has 2^stratum_bits strata.
    pub stratum_bits: u32,
    /// Spectra held in strata; the others, held in knots, have higher ids.
    pub stratified: usize,
    /// Channels rounded up to a multiple of four.
    pub channels_padded: usize,
    /// Kinks that each spectrum has in each channel, where there is one stratum; see [`BentLine`].
    pub kinks: u32,
    /// [stratum][spectrum][quad][value x 4, slope x 4, each kink's place x 4, each kink's bend x 4].
    pub strata: Vec<f32>,
    /// First knot of (knotted spectrum, padded channel), with one more entry at the end.
    pub knot_starts: Vec<u32>,
    /// (μ in units of 2⁻³², bits of the f32 value), μ ascending within a channel.
    pub knots: Vec<[u32; 2]>,
    /// Device id of each curve that was given.
    pub ids: Vec<u32>,
    /// Reached per curve: largest pointwise error relative to the channel's peak, and largest relative error of a
    /// channel's mean.
    pub bounds: Vec<Bounds>,
}

/// What the error of a table is measured against.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exactness {
    /// The largest value in the channel.
    Peak,
    /// The value itself: an absorption acts in an exponent, where the wing of a line matters beside its top.
    Pointwise,
    /// Nothing: knots, unless a line in each channel is all that the curve is.
    Exact,
}

/// Errors of one spectrum's table over all channels.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bounds {
    pub pointwise: f64,
    pub mean: f64,
}

impl SpectralTables {
    /// Tables for `curves` over `channels`, in the order given (spectra that need knots move to the end), with strata of equal
    /// width.
    pub fn build(curves: &[Tabulated], channels: &Channels) -> SpectralTables {
        let wanted: Vec<Wanted> = curves.iter().map(|&curve| curve.into()).collect();
        SpectralTables::warped(&wanted, channels, &Warp::uniform(channels))
    }

    /// log2 of the strata that so many spectra may have.
    pub fn most_bits(spectra: usize, channels: &Channels) -> u32 {
        let entries = MAX_ENTRIES.min(MAX_ENTRIES_IN_ALL / spectra.max(1));
        (entries / channels.len().next_multiple_of(4)).max(1).ilog2().min(MAX_STRATUM_BITS)
    }

    /// [`SpectralTables::build`] with wavelengths drawn as `warp` says, which has at most [`SpectralTables::most_bits`].
    pub fn warped(wanted: &[Wanted], channels: &Channels, warp: &Warp) -> SpectralTables {
        let channels_padded = channels.len().next_multiple_of(4);
        // All spectra have as many strata as the one that needs most.
        let max_bits = SpectralTables::most_bits(wanted.len(), channels);
        let place = Place { channels, warp };
        let needed: Vec<Option<u32>> = wanted
            .iter()
            .map(|w| match w.exactness {
                Exactness::Exact => place.strata_needed(w.spectrum, warp.bits(), LINE_BOUND, Exactness::Peak),
                kind => place.strata_needed(w.spectrum, max_bits, POINTWISE_BOUND, kind),
            })
            .collect();
        let stratum_bits = needed.iter().flatten().copied().max().unwrap_or(warp.bits());

        // The stratified first, the knotted after them.
        let stratified: Vec<usize> = (0..wanted.len()).filter(|&i| needed[i].is_some()).collect();
        let knotted: Vec<usize> = (0..wanted.len()).filter(|&i| needed[i].is_none()).collect();
        let mut ids = vec![0; wanted.len()];
        for (id, &i) in stratified.iter().chain(&knotted).enumerate() {
            ids[i] = id as u32;
        }

        let mut tables = SpectralTables {
            stratum_bits,
            stratified: stratified.len(),
            channels_padded,
            kinks: 0,
            strata: vec![0.0; (stratified.len() * channels_padded * 2) << stratum_bits],
            knot_starts: vec![0],
            knots: Vec::new(),
            ids,
            bounds: vec![Bounds::default(); wanted.len()],
        };
        for (id, &i) in stratified.iter().enumerate() {
            tables.bounds[i] = tables.fill_strata(id, &wanted[i], &place);
        }
        for &i in &knotted {
            tables.bounds[i] = tables.add_knots(&wanted[i], &place);
        }
        tables
    }

    /// The curves in one stratum, bent where they have nodes: `None` where one of them would need more than `most` kinks in a channel,
    /// or strata.
    pub fn with_kinks(curves: &[&Curve], channels: &Channels, most: usize) -> Option<SpectralTables> {
        let lines: Vec<Vec<(BentLine, f64)>> = curves
            .iter()
            .map(|curve| channels.bounds.iter().map(|&[a, b]| BentLine::of(curve, a, b, most)).collect())
            .collect::<Option<_>>()?;
        let kinks = lines.iter().flatten().map(|(line, _)| line.kinks.len()).max().unwrap_or(0);
        let channels_padded = channels.len().next_multiple_of(4);
        let rows = 2 + 2 * kinks;
        let mut strata = vec![0.0; curves.len() * channels_padded * rows];
        for (id, lines) in lines.iter().enumerate() {
            for (k, (line, _)) in lines.iter().enumerate() {
                let at = (id * channels_padded / 4 + k / 4) * rows * 4 + k % 4;
                (strata[at], strata[at + 4]) = (line.value, line.slope);
                for (i, (place, bend)) in line.kinks.iter().enumerate() {
                    (strata[at + 4 * (2 + i)], strata[at + 4 * (2 + kinks + i)]) = (*place, *bend);
                }
            }
        }
        let bounds = lines.iter().zip(curves).map(|(lines, curve)| {
            let each = lines.iter().zip(&channels.bounds).map(|((line, pointwise), &[a, b])| Bounds {
                pointwise: *pointwise,
                mean: off(line.mean(), curve.mean(a, b)),
            });
            each.fold(Bounds::default(), Bounds::max)
        });
        Some(SpectralTables {
            stratum_bits: 0,
            stratified: curves.len(),
            channels_padded,
            kinks: kinks as u32,
            strata,
            knot_starts: vec![0],
            knots: Vec::new(),
            ids: (0..curves.len() as u32).collect(),
            bounds: bounds.collect(),
        })
    }

    fn fill_strata(&mut self, id: usize, wanted: &Wanted, place: &Place) -> Bounds {
        let quads = self.channels_padded / 4;
        let finer = self.stratum_bits - place.warp.bits();
        let mut bounds = Bounds::default();
        for k in 0..place.channels.len() {
            let curve = wanted.spectrum.of(k);
            let lines = place.fit_channel(curve, k, self.stratum_bits);
            bounds = bounds.max(place.channel_bounds(curve, k, &lines, self.stratum_bits, wanted.exactness));
            for (stratum, line) in lines.iter().enumerate() {
                let weight = if wanted.weighted { place.warp.weight(k, stratum >> finer) } else { 1.0 };
                let at = (((stratum * self.stratified + id) * quads + k / 4) * 2) * 4 + k % 4;
                self.strata[at] = (weight * line.value) as f32;
                self.strata[at + 4] = (weight * line.slope) as f32;
            }
        }
        bounds
    }

    fn add_knots(&mut self, wanted: &Wanted, place: &Place) -> Bounds {
        let (channels, warp) = (place.channels, place.warp);
        let mut bounds = Bounds::default();
        for k in 0..self.channels_padded {
            if k < channels.len() {
                let ([from, to], curve) = (channels.bounds[k], wanted.spectrum.of(k));
                let exact = curve.mean(from, to);
                // (μ, value), μ in units of the device, and the integral over wavelength of what lies between.
                let (mut knots, mut area) = (Vec::<(f64, f64)>::new(), 0.0);
                for stratum in 0..1usize << warp.bits() {
                    let [a, b] = [stratum, stratum + 1].map(|j| warp.edge(k, j, warp.bits()));
                    let weight = warp.weight(k, stratum);
                    let nodes = curve.linear_pieces(a, b).unwrap_or_else(|| smooth_nodes(curve, a, b));
                    let mu = |nm: f64| (stratum as f64 + (nm - a) / (b - a)) / f64::from(1u32 << warp.bits());
                    let first = knots.len();
                    let factor = if wanted.weighted { weight } else { 1.0 };
                    knots.extend(nodes.iter().map(|(nm, value)| (fixed_point(mu(*nm)), factor * value)));
                    // A line much narrower than the channel changes its width a little when its ends are rounded.
                    let pieces = knots[first..].windows(2).map(|w| (w[1].0 - w[0].0) * 0.5 * (w[0].1 + w[1].1));
                    area += pieces.sum::<f64>() * if wanted.weighted { 1.0 } else { weight };
                }
                knots.dedup();
                let correction = if area > 0.0 { exact / (area / FIXED_ONE) } else { 1.0 };
                let small = (correction - 1.0).abs() <= POINTWISE_BOUND;
                let scale = if small { correction } else { 1.0 };
                self.knots.extend(knots.iter().map(|&(mu, value)| [mu as u32, ((value * scale) as f32).to_bits()]));
                bounds.pointwise = bounds.pointwise.max((scale - 1.0).abs());
                if exact != 0.0 {
                    bounds.mean = bounds.mean.max((scale / correction - 1.0).abs());
                }
            } else {
                self.knots.extend([[0, 0], [u32::MAX, 0]]);
            }
            self.knot_starts.push(self.knots.len() as u32);
        }
        bounds
    }

    /// Steps of a binary search that finds the segment in any channel's knots; 0 without knots.
    pub fn knot_steps(&self) -> u32 {
        let segments = self.knot_starts.windows(2).map(|w| w[1] - w[0] - 1).max().unwrap_or(0);
        segments.next_power_of_two().max(1).ilog2()
    }

    pub fn has_knots(&self) -> bool {
        !self.knots.is_empty()
    }
}

/// μ = 1 in the units of the device's wavelength coordinate.
const FIXED_ONE: f64 = 4_294_967_296.0;

/// μ as the device has it, a whole number.
fn fixed_point(mu: f64) -> f64 {
    (mu * FIXED_ONE).round().clamp(0.0, FIXED_ONE - 1.0)
}

impl Bounds {
    fn max(self, other: Bounds) -> Bounds {
        Bounds { pointwise: self.pointwise.max(other.pointwise), mean: self.mean.max(other.mean) }
    }
}

/// Where in the channels the wavelengths of strata are.
struct Place<'a> {
    channels: &'a Channels,
    warp: &'a Warp,
}

impl Place<'_> {
    /// Stratum bits that keep the pointwise bound in every channel, or `None` where `max_bits` do not.
    fn strata_needed(&self, spectrum: Tabulated, max_bits: u32, bound: f64, kind: Exactness) -> Option<u32> {
        // What satisfied the channels so far is where the next channel starts.
        (0..self.channels.len()).try_fold(self.warp.bits(), |least, k| {
            let curve = spectrum.of(k);
            let keeps_bound = |bits: &u32| {
                let lines = self.fit_channel(curve, k, *bits);
                self.channel_bounds(curve, k, &lines, *bits, kind).pointwise <= bound
            };
            (least..=max_bits).find(keeps_bound)
        })
    }

    fn fit_channel(&self, curve: &Curve, k: usize, bits: u32) -> Vec<Line> {
        let edge = |j: usize| self.warp.edge(k, j, bits);
        (0..1usize << bits).map(|j| fit(curve, edge(j), edge(j + 1))).collect()
    }

    fn channel_bounds(&self, curve: &Curve, k: usize, lines: &[Line], bits: u32, kind: Exactness) -> Bounds {
        let [from, to] = self.channels.bounds[k];
        let peak = curve.max(from, to);
        if peak <= 0.0 {
            return Bounds::default();
        }
        let (mut pointwise, mut mean) = (0.0f64, 0.0);
        for (j, line) in lines.iter().enumerate() {
            let (a, b) = (self.warp.edge(k, j, bits), self.warp.edge(k, j + 1, bits));
            mean += (line.value + 0.5 * line.slope) * (b - a) / (to - from);
            for (nm, value) in curve.linear_pieces(a, b).unwrap_or_else(|| few_nodes(curve, a, b)) {
                let place = (nm - a) / (b - a);
                let of = if kind == Exactness::Pointwise { value.max(1e-9 * peak) } else { peak };
                pointwise = pointwise.max((line.value + place * line.slope - value).abs() / of);
            }
        }
        let exact = curve.mean(from, to);
        Bounds { pointwise, mean: off(mean, exact) }
    }
}

/// How far a mean is off, relative to what it should be where that is not 0.
fn off(mean: f64, exact: f64) -> f64 {
    if exact != 0.0 { (mean / exact - 1.0).abs() } else { mean.abs() }
}

/// Where a smooth curve is compared with a line.
pub(super) fn few_nodes(curve: &Curve, from: f64, to: f64) -> Vec<(f64, f64)> {
    (0..=8).map(|i| from + (to - from) * f64::from(i) / 8.0).map(|nm| (nm, curve.eval(nm))).collect()
}

/// The line over [from, to] with the curve's mean and first moment (so that its product with a linear factor has the
/// right mean as well), or the curve itself where it is linear; never negative.
pub(super) fn fit(curve: &Curve, from: f64, to: f64) -> Line {
    if let Some(nodes) = curve.linear_pieces(from, to) {
        if let [(_, a), (_, b)] = nodes[..] {
            return Line { value: a, slope: b - a };
        }
        // Mean and first moment about the middle, exactly, piece by piece; x in [-1/2, 1/2].
        let (mut mean, mut moment) = (0.0, 0.0);
        for w in nodes.windows(2) {
            let x = [0, 1].map(|i| (w[i].0 - from) / (to - from) - 0.5);
            let (h, y) = (x[1] - x[0], [w[0].1, w[1].1]);
            mean += 0.5 * h * (y[0] + y[1]);
            moment += h / 6.0 * (y[0] * (2.0 * x[0] + x[1]) + y[1] * (x[0] + 2.0 * x[1]));
        }
        return non_negative(mean, 12.0 * moment);
    }
    // Smooth: five Gauss-Legendre points.
    const NODE: [f64; 3] = [0.0, 0.538_469_310_105_683_1, 0.906_179_845_938_664];
    const WEIGHT: [f64; 3] = [0.568_888_888_888_888_9, 0.478_628_670_499_366_5, 0.236_926_885_056_189_1];
    let (mut mean, mut moment) = (0.0, 0.0);
    for i in 0..3 {
        for sign in if i == 0 { &[1.0][..] } else { &[-1.0, 1.0][..] } {
            let x = 0.5 * sign * NODE[i];
            let y = curve.eval(from + (x + 0.5) * (to - from));
            mean += 0.5 * WEIGHT[i] * y;
            moment += 0.5 * WEIGHT[i] * x * y;
        }
    }
    non_negative(mean, 12.0 * moment)
}

/// The line with this mean and, as far as it stays non-negative, this slope.
fn non_negative(mean: f64, slope: f64) -> Line {
    let slope = slope.clamp(-2.0 * mean.max(0.0), 2.0 * mean.max(0.0));
    Line { value: mean - 0.5 * slope, slope }
}

/// A smooth curve as nodes close enough for linear interpolation.
fn smooth_nodes(curve: &Curve, from: f64, to: f64) -> Vec<(f64, f64)> {
    let n = (((to / from).ln() * 4096.0).ceil() as usize).clamp(1, 1 << 16);
    (0..=n)
        .map(|i| if i == n { to } else { from * (to / from).powf(i as f64 / n as f64) })
        .map(|nm| (nm, curve.eval(nm)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectral::Outside;

    fn build(curves: &[&Curve], channels: &Channels) -> SpectralTables {
        let same: Vec<Tabulated> = curves.iter().map(|curve| Tabulated::Same(curve)).collect();
        SpectralTables::build(&same, channels)
    }

    /// The device's lookup, in f32.
    fn lookup(t: &SpectralTables, curve: usize, k: usize, mu: u32) -> f32 {
        let id = t.ids[curve] as usize;
        if id < t.stratified {
            let stratum = (u64::from(mu) >> (32 - t.stratum_bits)) as usize;
            let place = ((mu << t.stratum_bits) >> 8) as f32 * 5.9604645e-8;
            let at = ((stratum * t.stratified + id) * (t.channels_padded / 4) + k / 4) * 8 + k % 4;
            t.strata[at] + place * t.strata[at + 4]
        } else {
            let first = t.knot_starts[(id - t.stratified) * t.channels_padded + k] as usize;
            let last = t.knot_starts[(id - t.stratified) * t.channels_padded + k + 1] as usize - 1;
            let i = first + t.knots[first..last].partition_point(|n| n[0] <= mu).max(1) - 1;
            let [a_value, b_value] = [t.knots[i][1], t.knots[i + 1][1]].map(f32::from_bits);
            let place = (mu - t.knots[i][0]) as f32 / ((t.knots[i + 1][0] - t.knots[i][0]) as f32).max(1.0);
            a_value + place.min(1.0) * (b_value - a_value)
        }
    }

    /// The mean over a channel of what the device holds, in f64.
    fn device_mean(t: &SpectralTables, curve: usize, k: usize) -> f64 {
        let id = t.ids[curve] as usize;
        if id < t.stratified {
            let strata = 1usize << t.stratum_bits;
            let at = |j: usize| ((j * t.stratified + id) * (t.channels_padded / 4) + k / 4) * 8 + k % 4;
            let sum: f64 = (0..strata).map(|j| f64::from(t.strata[at(j)]) + 0.5 * f64::from(t.strata[at(j) + 4])).sum();
            return sum / strata as f64;
        }
        let start = (id - t.stratified) * t.channels_padded + k;
        let range = t.knot_starts[start] as usize..t.knot_starts[start + 1] as usize;
        let value = |knot: [u32; 2]| f64::from(f32::from_bits(knot[1]));
        let area = |w: &[[u32; 2]]| f64::from(w[1][0] - w[0][0]) * 0.5 * (value(w[0]) + value(w[1]));
        t.knots[range].windows(2).map(area).sum::<f64>() / FIXED_ONE
    }

    fn table(points: &[(f64, f64)], outside: Outside) -> Curve {
        let (nm, value) = points.iter().copied().unzip();
        Curve::Linear { nm, value, outside }
    }

    /// A jagged table of `n` nodes.
    fn jagged(n: usize, seed: u32) -> Curve {
        // Steele, Lea and Flood 2014, in 32 bits: any numbers without a pattern will do.
        let mixed = |x: u32| (x ^ x >> 16).wrapping_mul(0x7feb_352d);
        let value = |i: usize| f64::from(mixed(mixed(seed ^ (i as u32).wrapping_mul(0x9e37_79b9)))) / 4.3e9;
        let points: Vec<_> = (0..n).map(|i| (380.0 + 400.0 * i as f64 / (n - 1) as f64, value(i))).collect();
        table(&points, Outside::Zero)
    }

    fn check(curve: &Curve, channels: &Channels) {
        let tables = build(&[&Curve::Constant(1.0), curve], channels);
        check_curve(&tables, 1, curve, channels);
    }

    /// What `tables` hold at position `at` is `curve`, within the bounds.
    fn check_curve(tables: &SpectralTables, at: usize, curve: &Curve, channels: &Channels) {
        for k in 0..channels.len() {
            let [from, to] = channels.bounds[k];
            let peak = curve.max(from, to);
            for i in 0..4096u32 {
                let mu = (i << 20) + (1 << 19);
                let nm = channels.wavelength(k, f64::from(mu) / 4_294_967_296.0);
                let got = f64::from(lookup(tables, at, k, mu));
                let allowed = (1.01 * POINTWISE_BOUND + 3e-7) * peak + 1e-30;
                assert!((got - curve.eval(nm)).abs() <= allowed, "channel {k} at {nm}: {got} {}", curve.eval(nm));
                assert!(got >= 0.0);
            }
            let (mean, exact) = (device_mean(tables, at, k), curve.mean(from, to));
            assert!((mean - exact).abs() <= 1e-5 * exact, "channel {k}: mean {mean} instead of {exact}");
        }
    }

    #[test]
    fn every_kind_of_table_keeps_its_bounds() {
        let smooth = table(&[(380.0, 0.2), (450.0, 0.5), (601.0, 0.3), (780.0, 0.9)], Outside::Hold);
        let line = table(&[(380.0, 0.0), (500.0, 0.0), (500.005, 1.0), (500.01, 0.0), (780.0, 0.0)], Outside::Zero);
        for count in [1, 2, 3, 7, 40, 400, 333] {
            let channels = Channels::equal(380.0, 780.0, count);
            check(&smooth, &channels);
            check(&line, &channels);
            check(&jagged(101, 5), &channels);
        }
        check(&jagged(10_000, 6), &Channels::equal(380.0, 780.0, 8));
        check(&Curve::Blackbody { kelvin: 300.0, scale: 1.0 }, &Channels::equal(3000.0, 20000.0, 3));
        check(&Curve::Blackbody { kelvin: 5778.0, scale: 1.0 }, &Channels::equal(380.0, 20000.0, 1));
        // Ends inside a channel.
        check(&table(&[(412.3, 0.5), (700.1, 0.25)], Outside::Zero), &Channels::equal(380.0, 780.0, 10));
    }

    #[test]
    fn constants_are_exact_and_need_one_stratum() {
        let channels = Channels::equal(380.0, 780.0, 7);
        let c = 0.123_456_79_f32;
        let curve = table(&[(380.0, f64::from(c)), (612.7, f64::from(c)), (780.0, f64::from(c))], Outside::Hold);
        let tables = build(&[&Curve::Constant(1.0), &curve, &Curve::Constant(f64::from(c))], &channels);
        assert_eq!(tables.stratum_bits, 0);
        for mu in [0, 1, 0x1234_5678, u32::MAX] {
            for k in 0..7 {
                assert_eq!(lookup(&tables, 1, k, mu).to_bits(), c.to_bits());
                assert_eq!(lookup(&tables, 2, k, mu).to_bits(), c.to_bits());
            }
        }
    }

    /// Strata that one spectrum wants are paid for by all of them.
    #[test]
    fn many_spectra_do_not_outgrow_a_binding() {
        let channels = Channels::equal(380.0, 780.0, 1000);
        let zigzag: Vec<_> = (0..212).map(|j| (380.0 + 1.9 * j as f64 + 0.01, 0.5 + 0.08 * f64::from(j % 2))).collect();
        let zigzag = table(&zigzag, Outside::Hold);
        let alone = build(&[&zigzag], &channels);
        assert!(!alone.has_knots() && alone.stratum_bits > 5, "{} bits", alone.stratum_bits);
        let mut curves = vec![&zigzag];
        let constant = Curve::Constant(0.5);
        curves.resize(400, &constant);
        let tables = build(&curves, &channels);
        assert!(size_of_val(tables.strata.as_slice()) <= 8 * MAX_ENTRIES_IN_ALL);
        check_curve(&tables, 0, &zigzag, &channels);
        assert_eq!(lookup(&tables, 399, 999, 12345), 0.5);
    }

    /// Channels that share their edges with the table's nodes need no strata.
    #[test]
    fn aligned_tables_are_exact() {
        let curve = jagged(101, 1);
        let tables = build(&[&curve], &Channels::equal(380.0, 780.0, 400));
        assert_eq!((tables.stratum_bits, tables.stratified), (0, 1));
        assert!(tables.bounds[0].pointwise < 1e-12, "{:?}", tables.bounds[0]);
    }
}
