//! Where in their channels paths have their wavelengths: Λ_k(μ), the wavelength of channel k at the path's coordinate μ.
//!
//! Eq. 4 of Hoarau et al. 2018 spreads wavelengths evenly over a channel. Where what emits is spiky within channels, most paths then
//! miss the lines, and the few that meet one carry all of the channel's radiance. Here they are drawn from the emitters' own
//! spectral density instead: Λ_k is piecewise linear over M equal strata of μ with its knots at quantiles of that density,
//! and what a path brings is weighted by dΛ_k/dμ over the channel's width. This is unbiased for any knots. So some are moved to the
//! nodes of the scene's spectra, where they fit: every spectrum is then a line in each stratum, and small tables hold it exactly.

use super::{Channels, Curve};

/// Share of the density that is spread evenly, so that no weight exceeds its inverse.
const EVEN: f64 = 0.1;
/// 2⁸ strata at most.
const MAX_BITS: u32 = 8;
/// Variance, relative to the square of a channel's mean, that more strata would have to save: paths alone differ by more than ten
/// times that, and more strata mean larger tables.
const WORTH_MORE_STRATA: f64 = 0.1;
/// Pieces of a channel in which a smooth curve is taken as linear: this is about noise, not about the answer.
const SMOOTH_PIECES: usize = 32;

/// Λ_k for every channel k.
#[derive(Debug, Clone, PartialEq)]
pub struct Warp {
    /// There are 2^bits strata.
    bits: u32,
    /// nm, [channel][stratum's start], and the channel's end.
    knots: Vec<f64>,
}

/// ChannelEmission of a channel in which the density of emission is linear.
#[derive(Debug, Clone, Copy)]
struct Piece {
    from: f64,
    to: f64,
    /// At either end.
    value: [f64; 2],
}

impl Piece {
    fn width(&self) -> f64 {
        self.to - self.from
    }

    fn at(&self, nm: f64) -> f64 {
        self.value[0] + (nm - self.from) / self.width() * (self.value[1] - self.value[0])
    }

    fn area(&self) -> f64 {
        0.5 * self.width() * (self.value[0] + self.value[1])
    }

    /// ∫ value² between two wavelengths.
    fn square(&self, from: f64, to: f64) -> f64 {
        let (a, b) = (self.at(from), self.at(to));
        (to - from) / 3.0 * (a * a + a * b + b * b)
    }
}

/// A channel: what emits in it, and where its spectra have nodes.
struct ChannelEmission {
    pieces: Vec<Piece>,
    nodes: Vec<f64>,
}

impl ChannelEmission {
    fn ends(&self) -> [f64; 2] {
        [self.pieces[0].from, self.pieces[self.pieces.len() - 1].to]
    }

    fn variance(&self, knots: &[f64]) -> f64 {
        variance(&self.pieces, knots)
    }

    /// Knots of so many strata: quantiles, and all the nodes where there are strata enough.
    fn knots(&self, strata: usize) -> Vec<f64> {
        let flat = self.pieces.iter().flat_map(|piece| piece.value).all(|value| value == self.pieces[0].value[0]);
        let emits = mean(&self.pieces).is_normal();
        let even: Vec<f64> = (1..strata).map(|j| j as f64 / strata as f64).collect();
        // Even wavelengths where emission is even: what is seen directly is exact then.
        if self.nodes.is_empty() || self.nodes.len() >= strata || (flat && emits) {
            return quantiles(&self.pieces, &even);
        }
        // Every cell between two nodes has a stratum, and each further one goes where it lowers the variance most, which n strata
        // of equal probability in a cell of probability p leave at p²/n.
        let cells = cumulative(&self.pieces, &self.nodes);
        let probability = |i: usize| cells[i + 1] - cells[i];
        let mut counts = vec![1usize; cells.len() - 1];
        for _ in counts.len()..strata {
            let use_of = |i: usize| probability(i).powi(2) / (counts[i] * (counts[i] + 1)) as f64;
            let best = (0..counts.len()).max_by(|&a, &b| use_of(a).total_cmp(&use_of(b)));
            counts[best.expect("a channel has a cell")] += 1;
        }
        let shares = counts.iter().enumerate().flat_map(|(i, &count)| {
            let cells = &cells;
            (0..count).map(move |j| cells[i] + (cells[i + 1] - cells[i]) * j as f64 / count as f64)
        });
        let mut knots = quantiles(&self.pieces, &shares.skip(1).collect::<Vec<_>>());
        // The nodes themselves, to the last bit.
        let mut first = 0;
        for (count, &node) in counts.iter().zip(&self.nodes) {
            first += count;
            knots[first] = node;
        }
        knots
    }
}

impl Warp {
    /// Evenly over each channel: one stratum.
    pub fn uniform(channels: &Channels) -> Warp {
        Warp { bits: 0, knots: channels.bounds.iter().flatten().copied().collect() }
    }

    /// Quantiles of 0.9 x `emitters`, a sum of curves times factors, + 0.1 x uniform; of their product with the channels'
    /// `responses`, where there are any. At most 2^`most_bits` strata, and no more than lower the noise or let strata end at the
    /// nodes of `tabulated`, the curves that there will be tables of.
    pub fn of_emission(
        channels: &Channels,
        emitters: &[(&Curve, f64)],
        responses: Option<&[Curve]>,
        tabulated: &[&Curve],
        most_bits: u32,
    ) -> Warp {
        let most_bits = most_bits.min(MAX_BITS);
        let parts: Vec<ChannelEmission> = (0..channels.len())
            .map(|k| {
                let response = responses.map(|responses| &responses[k]);
                let pieces = density(channels.bounds[k], emitters, response);
                let nodes = nodes(channels.bounds[k], tabulated.iter().copied().chain(response));
                // A channel that no affordable number of strata aligns is not worth more strata in the others.
                let nodes = if nodes.len() < 1 << most_bits { nodes } else { Vec::new() };
                ChannelEmission { pieces, nodes }
            })
            .collect();
        // Without spikes there is nothing to gain by other wavelengths.
        if parts.iter().all(|part| part.variance(&part.ends()) <= most_useful(&part.pieces) + WORTH_MORE_STRATA) {
            return Warp::uniform(channels);
        }
        // What satisfied the channels so far is where the next channel starts.
        let bits = parts.iter().fold(1.min(most_bits), |least, part| {
            let worth = most_useful(&part.pieces) + WORTH_MORE_STRATA;
            let is_enough = |bits: &u32| part.nodes.len() < 1 << bits && part.variance(&part.knots(1 << bits)) <= worth;
            (least..most_bits).find(is_enough).unwrap_or(most_bits)
        });
        if bits == 0 {
            return Warp::uniform(channels);
        }
        Warp { bits, knots: parts.iter().flat_map(|part| part.knots(1 << bits)).collect() }
    }

    /// How many times as many paths even wavelengths need to the same noise, at least: means over channels of what a path's
    /// radiance squared is to the square of its mean, by the emission alone.
    pub fn gain(&self, channels: &Channels, emitters: &[(&Curve, f64)], responses: Option<&[Curve]>) -> f64 {
        let (mut even, mut own) = (0.0, 0.0);
        for k in 0..channels.len() {
            let pieces = density(channels.bounds[k], emitters, responses.map(|responses| &responses[k]));
            even += 1.0 + variance(&pieces, &channels.bounds[k]);
            own += 1.0 + variance(&pieces, self.of_channel(k));
        }
        even / own
    }

    /// log2 of the number of strata.
    pub fn bits(&self) -> u32 {
        self.bits
    }

    fn of_channel(&self, k: usize) -> &[f64] {
        let count = (1 << self.bits) + 1;
        &self.knots[k * count..][..count]
    }

    /// Λ_k(j / 2^bits), nm, for at least as many strata as this has itself.
    pub fn edge(&self, k: usize, j: usize, bits: u32) -> f64 {
        let (knots, finer) = (self.of_channel(k), bits - self.bits);
        let (stratum, rest) = (j >> finer, j & ((1 << finer) - 1));
        if rest == 0 {
            return knots[stratum];
        }
        knots[stratum] + rest as f64 / f64::from(1u32 << finer) * (knots[stratum + 1] - knots[stratum])
    }

    /// What the radiance at wavelengths of a stratum is weighted with: 2^bits times its share of the channel's width.
    pub fn weight(&self, k: usize, stratum: usize) -> f64 {
        let knots = self.of_channel(k);
        let even = (knots[knots.len() - 1] - knots[0]) / (knots.len() - 1) as f64;
        (knots[stratum + 1] - knots[stratum]) / even
    }
}

/// The sum of `emitters` over [from, to], times `response`.
fn density([from, to]: [f64; 2], emitters: &[(&Curve, f64)], response: Option<&Curve>) -> Vec<Piece> {
    let edge = |i: usize| if i == SMOOTH_PIECES { to } else { from + (to - from) * i as f64 / SMOOTH_PIECES as f64 };
    let nodes = |curve: &Curve| {
        let smooth = || (0..=SMOOTH_PIECES).map(|i| (edge(i), curve.eval(edge(i)))).collect();
        curve.linear_pieces(from, to).unwrap_or_else(smooth)
    };
    // Where the sum jumps, and by how much; where its slope changes, and by how much.
    let mut changes: Vec<(f64, f64, f64)> = vec![(to, 0.0, 0.0)];
    for (curve, factor) in emitters {
        for pair in nodes(curve).windows(2) {
            let [(x0, y0), (x1, y1)] = [pair[0], pair[1]];
            if x1 > x0 && (y0 > 0.0 || y1 > 0.0) {
                let slope = factor * (y1 - y0) / (x1 - x0);
                changes.extend([(x0, factor * y0, slope), (x1, -factor * y1, -slope)]);
            }
        }
    }
    if let Some(response) = response {
        changes.extend(nodes(response).iter().map(|&(nm, _)| (nm, 0.0, 0.0)));
    }
    changes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut pieces, mut at, mut value, mut slope) = (Vec::new(), from, 0.0f64, 0.0f64);
    for (nm, jump, turn) in changes {
        if nm > at {
            let end = value + slope * (nm - at);
            pieces.push(Piece { from: at, to: nm, value: [value.max(0.0), end.max(0.0)] });
            (at, value) = (nm, end);
        }
        value += jump;
        slope += turn;
    }
    if let Some(response) = response {
        for piece in &mut pieces {
            // Just inside, so that a step belongs to neither side.
            let inside = 1e-9 * piece.width();
            piece.value[0] *= response.eval(piece.from + inside);
            piece.value[1] *= response.eval(piece.to - inside);
        }
    }
    pieces
}

fn mean(pieces: &[Piece]) -> f64 {
    pieces.iter().map(Piece::area).sum::<f64>() / extent(pieces)
}

fn extent(pieces: &[Piece]) -> f64 {
    pieces[pieces.len() - 1].to - pieces[0].from
}

/// Where the exactly piecewise linear ones of `curves` have nodes inside a channel, ascending.
fn nodes<'a>([from, to]: [f64; 2], curves: impl Iterator<Item = &'a Curve>) -> Vec<f64> {
    let mut nodes: Vec<f64> =
        curves.filter_map(|curve| curve.linear_pieces(from, to)).flatten().map(|(nm, _)| nm).collect();
    nodes.sort_by(f64::total_cmp);
    // Roundings of what is the same number do not make a cell.
    let least = 1e-9 * (to - from);
    nodes.retain(|nm| *nm > from + least && *nm < to - least);
    nodes.dedup_by(|next, last| *next - *last < least);
    nodes
}

/// The density of wavelengths, relative to an even one, as a function of that of emission. Even where nothing emits.
fn share(pieces: &[Piece]) -> impl Fn(f64) -> f64 {
    let mean = mean(pieces);
    move |value: f64| if mean.is_normal() { (1.0 - EVEN) * value / mean + EVEN } else { 1.0 }
}

/// The probability of wavelengths below the channel's start, each of `nodes`, and its end.
fn cumulative(pieces: &[Piece], nodes: &[f64]) -> Vec<f64> {
    let density = share(pieces);
    let (mut sums, mut below, mut next) = (vec![0.0], 0.0, nodes.iter().peekable());
    for piece in pieces {
        let area = |to: f64| 0.5 * (to - piece.from) * (density(piece.value[0]) + density(piece.at(to)));
        while let Some(&node) = next.next_if(|node| **node < piece.to) {
            sums.push((below + area(node)) / extent(pieces));
        }
        below += area(piece.to);
    }
    sums.resize(nodes.len() + 1, 1.0);
    sums.push(1.0);
    sums
}

/// The channel's start, where the probability of wavelengths below is each of `shares`, ascending, and the channel's end.
fn quantiles(pieces: &[Piece], shares: &[f64]) -> Vec<f64> {
    let (first, last) = (pieces[0].from, pieces[pieces.len() - 1].to);
    let flat = pieces.iter().flat_map(|piece| piece.value).all(|value| value == pieces[0].value[0]);
    let mut knots = vec![first];
    if flat || !mean(pieces).is_normal() {
        knots.extend(shares.iter().map(|share| first + (last - first) * share));
        knots.push(last);
        return knots;
    }
    let density = share(pieces);
    let mut below = 0.0;
    for piece in pieces {
        let [a, b] = piece.value.map(&density);
        let area = 0.5 * piece.width() * (a + b);
        while let Some(share) = shares.get(knots.len() - 1) {
            let wanted = extent(pieces) * share - below;
            if wanted > area {
                break;
            }
            // a h + (b - a) h² / 2w = wanted, by the root that does not cancel.
            let slope = (b - a) / piece.width();
            let h = 2.0 * wanted / (a + (a * a + 2.0 * slope * wanted).max(0.0).sqrt());
            knots.push((piece.from + h).clamp(knots[knots.len() - 1], piece.to));
        }
        below += area;
    }
    // Roundings may leave the last ones beyond the end.
    knots.resize(shares.len() + 1, last);
    knots.push(last);
    knots
}

/// The variance over μ of emission times weight, relative to the square of its mean.
fn variance(pieces: &[Piece], knots: &[f64]) -> f64 {
    let mean = mean(pieces);
    if !mean.is_normal() {
        return 0.0;
    }
    let even = extent(pieces) / (knots.len() - 1) as f64;
    let (mut sum, mut next) = (0.0, 0);
    for stratum in knots.windows(2) {
        let weight = (stratum[1] - stratum[0]) / even;
        while next < pieces.len() {
            let piece = &pieces[next];
            let (a, b) = (piece.from.max(stratum[0]), piece.to.min(stratum[1]));
            if b > a {
                // ∫ (weight · value)² dμ, with dμ = dλ / (strata · width of this one).
                sum += weight * piece.square(a, b);
            }
            if piece.to > stratum[1] {
                break;
            }
            next += 1;
        }
    }
    sum / (extent(pieces) * mean * mean) - 1.0
}

/// [`variance`] of infinitely many strata.
fn most_useful(pieces: &[Piece]) -> f64 {
    let mean = mean(pieces);
    if !mean.is_normal() {
        return 0.0;
    }
    let weighted = |value: f64| {
        let relative = value / mean;
        relative * relative / ((1.0 - EVEN) * relative + EVEN)
    };
    // Simpson's rule in each piece.
    let of = |piece: &Piece| {
        let [a, b] = piece.value;
        piece.width() / 6.0 * (weighted(a) + 4.0 * weighted(0.5 * (a + b)) + weighted(b))
    };
    pieces.iter().map(of).sum::<f64>() / extent(pieces) - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectral::Outside;

    fn line(centre: f64, width: f64, peak: f64) -> Curve {
        let nm = vec![centre - width, centre, centre + width];
        Curve::Linear { nm, value: vec![0.0, peak, 0.0], outside: Outside::Zero }
    }

    /// ∫ f over each channel, from wavelengths that the warp gives and its weights, is that from the curve.
    #[test]
    fn weights_make_up_for_the_knots() {
        let channels = Channels::from_bounds(vec![[400.0, 500.0], [500.0, 700.0], [450.0, 550.0]], None);
        let (sharp, broad) = (line(453.3, 0.5, 100.0), line(600.0, 150.0, 1.0));
        let warp = Warp::of_emission(&channels, &[(&sharp, 1.0), (&broad, 2.0)], None, &[], 8);
        assert!(warp.bits() >= 3, "{} bits", warp.bits());
        for k in 0..3 {
            let strata = 1usize << warp.bits();
            assert_eq!([warp.edge(k, 0, warp.bits()), warp.edge(k, strata, warp.bits())], channels.bounds[k]);
            let weights: f64 = (0..strata).map(|j| warp.weight(k, j)).sum();
            assert!((weights / strata as f64 - 1.0).abs() < 1e-12);
            assert!((0..strata).all(|j| warp.weight(k, j) > 0.0 && warp.weight(k, j) <= 1.0 / EVEN + 1e-9));
            for curve in [&sharp, &broad] {
                let of = |j: usize| curve.mean(warp.edge(k, j, warp.bits()), warp.edge(k, j + 1, warp.bits()));
                let mean = (0..strata).map(|j| warp.weight(k, j) * of(j)).sum::<f64>() / strata as f64;
                assert!((mean - curve.mean(channels.bounds[k][0], channels.bounds[k][1])).abs() < 1e-12 * 100.0);
            }
        }
        // Finer edges lie evenly between.
        let [a, b, c] = [4, 5, 6].map(|j| warp.edge(0, j, warp.bits() + 1));
        assert!((b - 0.5 * (a + c)).abs() < 1e-9 && a < b && b < c);
    }

    /// A line of a thousandth of the channel: what is left of the variance comes from the two strata in which the line ends.
    #[test]
    fn lines_are_met_by_nine_paths_of_ten() {
        let channels = Channels::from_bounds(vec![[400.0, 500.0]], None);
        let sharp = line(453.3, 0.05, 1.0);
        let pieces = density(channels.bounds[0], &[(&sharp, 3.0)], None);
        let warp = Warp::of_emission(&channels, &[(&sharp, 3.0)], None, &[], 8);
        // Evenly: the line fills a thousandth of the channel.
        let even = variance(&pieces, &channels.bounds[0]);
        assert!((even / (1000.0 * 4.0 / 3.0) - 1.0).abs() < 0.01, "{even}");
        let warped = variance(&pieces, warp.of_channel(0));
        assert!(warped < 1e-3 * even && most_useful(&pieces) < 0.12, "{warped}");
        let met = (0..1 << warp.bits()).filter(|&j| {
            let (a, b) = (warp.edge(0, j, warp.bits()), warp.edge(0, j + 1, warp.bits()));
            a < 453.35 && b > 453.25
        });
        assert!(met.count() as f64 / f64::from(1 << warp.bits()) > 0.85);
    }

    #[test]
    fn without_spikes_wavelengths_are_uniform() {
        let channels = Channels::equal(400.0, 700.0, 30);
        let flat = Curve::Constant(3.0);
        let smooth = Curve::Blackbody { kelvin: 3000.0, scale: 1.0 };
        for emitters in [&[][..], &[(&flat, 1.0)], &[(&flat, 0.0)], &[(&flat, 1.0), (&smooth, 1e-3)]] {
            assert_eq!(Warp::of_emission(&channels, emitters, None, &[], 8), Warp::uniform(&channels));
        }
        // A channel without emission beside one with a line, and a flat one: weights are exactly 1.
        let channels = Channels::from_bounds(vec![[400.0, 500.0], [500.0, 600.0]], None);
        let warp = Warp::of_emission(&channels, &[(&line(450.0, 1.0, 1.0), 1.0)], None, &[], 8);
        assert!((0..1 << warp.bits()).all(|j| warp.weight(1, j) == 1.0));
    }

    /// Strata end at all nodes of a lamp's table and of a wall's, and the lamp's peak has most of them: what is linear in every
    /// stratum needs no finer tables, and the noise is that of quantiles but for a tenth of the mean's square.
    #[test]
    fn strata_end_at_nodes() {
        let channels = Channels::from_bounds(vec![[400.0, 450.0], [450.0, 500.0]], None);
        let steps = |step: f64, of: &dyn Fn(f64) -> f64| {
            let nm: Vec<f64> = (0..).map(|i| 400.0 + step * f64::from(i)).take_while(|nm| *nm <= 500.0).collect();
            Curve::Linear { value: nm.iter().map(|nm| of(*nm)).collect(), nm, outside: Outside::Hold }
        };
        let lamp = steps(5.0, &|nm| if nm == 435.0 { 9.0 } else { 0.1 + 1e-3 * (nm - 400.0) });
        let wall = steps(4.0, &|nm| 0.5 + 0.2 * (0.1 * nm).sin());
        let emitters = [(&lamp, 1.0)];
        let warp = Warp::of_emission(&channels, &emitters, None, &[&lamp, &wall], 8);
        for (k, [from, to]) in channels.bounds.iter().copied().enumerate() {
            let knots = warp.of_channel(k);
            for nm in (400..=500).filter(|nm| nm % 4 == 0 || nm % 5 == 0).map(f64::from) {
                assert!(nm < from || nm > to || knots.contains(&nm), "{nm} nm in {knots:?}");
            }
            let pieces = density([from, to], &emitters, None);
            assert!(variance(&pieces, knots) <= most_useful(&pieces) + WORTH_MORE_STRATA);
        }
        assert!(warp.gain(&channels, &emitters, None) > 1.0);
        let uniform = Warp::uniform(&channels);
        assert_eq!(uniform.gain(&channels, &emitters, None), 1.0);
    }

    /// Responses say which part of a channel matters.
    #[test]
    fn responses_draw_wavelengths_too() {
        let channels = Channels::from_bounds(vec![[400.0, 500.0]], None);
        let warp =
            Warp::of_emission(&channels, &[(&Curve::Constant(1.0), 1.0)], Some(&[line(480.0, 2.0, 1.0)]), &[], 8);
        // Strata wholly within the response: the others are its share of 0.1 that is even.
        let edges: Vec<f64> = (0..=1 << warp.bits()).map(|j| warp.edge(0, j, warp.bits())).collect();
        let inside = edges.windows(2).filter(|edges| edges[0] >= 478.0 && edges[1] <= 482.0).count();
        assert!(inside as f64 > 0.85 * f64::from(1 << warp.bits()), "{inside}");
    }
}
