//! Spectra as the device wants them: for every channel a few strata of the wavelength coordinate μ, in each of them a
//! value and a slope; and exact knots for what no affordable number of strata resolves.

use std::borrow::Cow;

use rayon::prelude::*;

use super::curve::Nodes;
use super::kinks::BentLine;
use super::knots::Knots;
use super::warp::Warp;
use super::{Channels, Curve, Outside};

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

impl Line {
    fn times(self, factor: f64) -> Line {
        Line { value: factor * self.value, slope: factor * self.slope }
    }
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
    /// Those that are held in knots, by (knotted spectrum, quad of channels).
    pub knots: Knots,
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
            .par_iter()
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
            knots: Knots::new(knotted.len() * channels_padded / 4),
            ids,
            bounds: vec![Bounds::default(); wanted.len()],
        };
        // As many at a time as there are threads, since lines are larger than what is kept of them.
        let ids: Vec<usize> = (0..stratified.len()).collect();
        for ids in ids.chunks(rayon::current_num_threads()) {
            let fit = |&id: &usize| place.fit(&wanted[stratified[id]], stratum_bits);
            let fitted: Vec<_> = ids.par_iter().map(fit).collect();
            for (&id, (lines, bounds)) in ids.iter().zip(fitted) {
                tables.fill_strata(id, &lines);
                tables.bounds[stratified[id]] = bounds;
            }
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
            knots: Knots::new(0),
            ids: (0..curves.len() as u32).collect(),
            bounds: bounds.collect(),
        })
    }

    /// `lines`: \[channel\]\[stratum\].
    fn fill_strata(&mut self, id: usize, lines: &[Vec<Line>]) {
        let quads = self.channels_padded / 4;
        for (k, lines) in lines.iter().enumerate() {
            for (stratum, line) in lines.iter().enumerate() {
                let at = (((stratum * self.stratified + id) * quads + k / 4) * 2) * 4 + k % 4;
                (self.strata[at], self.strata[at + 4]) = (line.value as f32, line.slope as f32);
            }
        }
    }

    fn add_knots(&mut self, wanted: &Wanted, place: &Place) -> Bounds {
        let mut bounds = Bounds::default();
        for quad in 0..self.channels_padded / 4 {
            let channels = [0, 1, 2, 3].map(|k| match 4 * quad + k {
                k if k < place.channels.len() => {
                    let (nodes, of_channel) = place.knots(wanted, k);
                    bounds = bounds.max(of_channel);
                    nodes
                }
                _ => vec![(0.0, 0.0), (FIXED_ONE - 1.0, 0.0)],
            });
            self.knots.push(channels.each_ref().map(Vec::as_slice));
        }
        bounds
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
            let [from, to] = self.channels.bounds[k];
            let curve = match Within::of(spectrum.of(k), from, to) {
                Within::Line(_) => return Some(least),
                Within::Curve(curve) => curve,
            };
            let (curve, peak) = (&*curve, curve.max(from, to));
            let keeps_bound = |stratum, bits| fit_within(curve, self.ends(k, stratum, bits), peak, kind).1 <= bound;
            (least..=max_bits).find(|&bits| (0..1usize << bits).all(|stratum| keeps_bound(stratum, bits)))
        })
    }

    /// The wavelengths between which one of 2^`bits` strata of channel `k` lies.
    fn ends(&self, k: usize, stratum: usize, bits: u32) -> [f64; 2] {
        [stratum, stratum + 1].map(|edge| self.warp.edge(k, edge, bits))
    }

    /// What [`Knots`] has of one channel, and how far its mean is off.
    fn knots(&self, wanted: &Wanted, k: usize) -> (Vec<(f64, f64)>, Bounds) {
        let ([from, to], curve, warp) = (self.channels.bounds[k], wanted.spectrum.of(k), self.warp);
        let exact = curve.mean(from, to);
        // (μ in units of the device, value), and the integral over wavelength of what lies between.
        let (mut knots, mut area) = (Vec::<(f64, f64)>::new(), 0.0);
        for stratum in 0..1usize << warp.bits() {
            let [a, b] = self.ends(k, stratum, warp.bits());
            let weight = warp.weight(k, stratum);
            let nodes = curve.linear_pieces(a, b).map_or_else(|| smooth_nodes(curve, a, b), Nodes::into_vec);
            let mu = |nm: f64| (stratum as f64 + (nm - a) / (b - a)) / f64::from(1u32 << warp.bits());
            let first = knots.len();
            let factor = if wanted.weighted { weight } else { 1.0 };
            knots.extend(nodes.iter().map(|(nm, value)| (fixed_point(mu(*nm)), factor * value)));
            // A line much narrower than the channel changes its width a little when its ends are rounded.
            let pieces = knots[first..].windows(2).map(|w| (w[1].0 - w[0].0) * 0.5 * (w[0].1 + w[1].1));
            area += pieces.sum::<f64>() * if wanted.weighted { 1.0 } else { weight };
        }
        let correction = if area > 0.0 { exact / (area / FIXED_ONE) } else { 1.0 };
        let small = (correction - 1.0).abs() <= POINTWISE_BOUND;
        let scale = if small { correction } else { 1.0 };
        knots.iter_mut().for_each(|(_, value)| *value *= scale);
        let mean = if exact != 0.0 { (scale / correction - 1.0).abs() } else { 0.0 };
        (knots, Bounds { pointwise: (scale - 1.0).abs(), mean })
    }

    /// Lines \[channel\]\[stratum\], times the weights of their wavelengths where those are wanted, and how far they are off without.
    fn fit(&self, wanted: &Wanted, bits: u32) -> (Vec<Vec<Line>>, Bounds) {
        let mut bounds = Bounds::default();
        let lines = (0..self.channels.len()).map(|k| {
            let [from, to] = self.channels.bounds[k];
            let weighted = |line: Line, stratum: usize| match wanted.weighted {
                true => line.times(self.warp.weight(k, stratum >> (bits - self.warp.bits()))),
                false => line,
            };
            let strata = 0..1usize << bits;
            let curve = match Within::of(wanted.spectrum.of(k), from, to) {
                Within::Line([first, last]) => {
                    let at = |nm: f64| first + (nm - from) / (to - from) * (last - first);
                    let line = |stratum| {
                        let [a, b] = self.ends(k, stratum, bits).map(at);
                        weighted(Line { value: a, slope: b - a }, stratum)
                    };
                    return strata.map(line).collect();
                }
                Within::Curve(curve) => curve,
            };
            let (curve, peak) = (&*curve, curve.max(from, to));
            let (mut pointwise, mut mean) = (0.0f64, 0.0);
            let lines = strata.map(|stratum| {
                let [a, b] = self.ends(k, stratum, bits);
                let (line, error) = fit_within(curve, [a, b], peak, wanted.exactness);
                pointwise = pointwise.max(error);
                mean += (line.value + 0.5 * line.slope) * (b - a) / (to - from);
                weighted(line, stratum)
            });
            let lines = lines.collect();
            if peak > 0.0 {
                bounds = bounds.max(Bounds { pointwise, mean: off(mean, curve.mean(from, to)) });
            }
            lines
        });
        (lines.collect(), bounds)
    }
}

/// A curve within a channel, so that its strata search through few nodes, or none.
enum Within<'a> {
    /// From one value to another.
    Line([f64; 2]),
    Curve(Cow<'a, Curve>),
}

impl Within<'_> {
    fn of(curve: &Curve, from: f64, to: f64) -> Within<'_> {
        match curve.linear_pieces(from, to) {
            None => Within::Curve(Cow::Borrowed(curve)),
            Some(nodes) if nodes.len() == 2 => Within::Line([nodes[0].1, nodes[1].1]),
            Some(nodes) => {
                let (nm, value) = nodes.into_iter().unzip();
                Within::Curve(Cow::Owned(Curve::Linear { nm, value, outside: Outside::Hold }))
            }
        }
    }
}

/// The line that stands for `curve` over [a, b], and how far it is off at most, of `peak` or of the value itself; not at all where the
/// peak is 0.
fn fit_within(curve: &Curve, [a, b]: [f64; 2], peak: f64, kind: Exactness) -> (Line, f64) {
    let pieces = curve.linear_pieces(a, b);
    let line = match &pieces {
        Some(nodes) => fit_pieces(nodes, a, b),
        None => fit_smooth(curve, a, b),
    };
    let nodes = match pieces {
        // It is that line.
        Some(nodes) if nodes.len() == 2 => return (line, 0.0),
        Some(nodes) => nodes,
        None => few_nodes(curve, a, b),
    };
    if peak <= 0.0 {
        return (line, 0.0);
    }
    let error = |(nm, value): (f64, f64)| {
        let place = (nm - a) / (b - a);
        let of = if kind == Exactness::Pointwise { value.max(1e-9 * peak) } else { peak };
        (line.value + place * line.slope - value).abs() / of
    };
    (line, nodes.into_iter().map(error).fold(0.0, f64::max))
}

/// How far a mean is off, relative to what it should be where that is not 0.
fn off(mean: f64, exact: f64) -> f64 {
    if exact != 0.0 { (mean / exact - 1.0).abs() } else { mean.abs() }
}

/// Where a smooth curve is compared with a line.
pub(super) fn few_nodes(curve: &Curve, from: f64, to: f64) -> Nodes {
    (0..=8).map(|i| from + (to - from) * f64::from(i) / 8.0).map(|nm| (nm, curve.eval(nm))).collect()
}

/// The line over [from, to] with the curve's mean and first moment (so that its product with a linear factor has the
/// right mean as well), or the curve itself where it is linear; never negative.
pub(super) fn fit(curve: &Curve, from: f64, to: f64) -> Line {
    match curve.linear_pieces(from, to) {
        Some(nodes) => fit_pieces(&nodes, from, to),
        None => fit_smooth(curve, from, to),
    }
}

fn fit_pieces(nodes: &[(f64, f64)], from: f64, to: f64) -> Line {
    if let [(_, a), (_, b)] = nodes {
        return Line { value: *a, slope: b - a };
    }
    // Mean and first moment about the middle, exactly, piece by piece; x in [-1/2, 1/2].
    let (mut mean, mut moment) = (0.0, 0.0);
    for w in nodes.windows(2) {
        let x = [0, 1].map(|i| (w[i].0 - from) / (to - from) - 0.5);
        let (h, y) = (x[1] - x[0], [w[0].1, w[1].1]);
        mean += 0.5 * h * (y[0] + y[1]);
        moment += h / 6.0 * (y[0] * (2.0 * x[0] + x[1]) + y[1] * (x[0] + 2.0 * x[1]));
    }
    non_negative(mean, 12.0 * moment)
}

/// With five Gauss-Legendre points.
fn fit_smooth(curve: &Curve, from: f64, to: f64) -> Line {
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
            t.knots.lookup((id - t.stratified) * t.channels_padded / 4 + k / 4, mu)[k % 4]
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
        t.knots.mean((id - t.stratified) * t.channels_padded / 4 + k / 4, k % 4)
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
