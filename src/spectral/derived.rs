//! Curves computed from other curves.

use rayon::prelude::*;
use smallvec::{SmallVec, smallvec};

use super::{Channels, Curve, Outside};

/// Bisections of an interval between nodes at most.
const MAX_DEPTH: u32 = 14;
/// Of its own peak, that a curve may be off by.
const BOUND: f64 = 2e-5;

impl Curve {
    /// The curve f(values of `curves`) within `channels`: piecewise linear, with nodes so close that it is off by at most
    /// 2e-5 of its own peak, and steps where `curves` have them. Beyond the channels it has no meaning.
    pub fn derived(curves: &[&Curve], channels: &Channels, f: impl Fn(&[f64]) -> f64) -> Curve {
        if curves.iter().all(|c| c.is_constant()) {
            let nm = channels.bounds.first().map_or(550.0, |b| b[0]);
            return Curve::Constant(f(&curves.iter().map(|c| c.eval(nm)).collect::<Vec<_>>()));
        }
        let points = points(curves, &channels.bounds, 1, &|_, values, out| out[0] = f(values));
        let (nm, value) = points.into_iter().map(|(nm, values)| (nm, values[0])).unzip();
        Curve::Linear { nm, value, outside: Outside::Hold }
    }

    /// As [`Curve::derived`] with the wavelength in nm as well, f(nm, values): from bound to bound of `channels`, each stretch by
    /// its own peak, so that the tail of Planck's law is as exact as its top.
    pub fn derived_by_stretch(curves: &[&Curve], channels: &Channels, f: impl Fn(f64, &[f64]) -> f64 + Sync) -> Curve {
        Curve::derived_rows(curves, channels, 1, |nm, values, out| out[0] = f(nm, values)).remove(0)
    }

    /// As [`Curve::derived_by_stretch`], `rows` curves at once, at nodes that they share: f(nm, values, out) writes them all.
    pub fn derived_rows(
        curves: &[&Curve],
        channels: &Channels,
        rows: usize,
        f: impl Fn(f64, &[f64], &mut [f64]) + Sync,
    ) -> Vec<Curve> {
        let mut edges: Vec<f64> = channels.bounds.iter().flatten().copied().collect();
        edges.sort_by(f64::total_cmp);
        edges.dedup();
        let mut bounds = channels.bounds.clone();
        bounds.sort_by(|a, b| a[0].total_cmp(&b[0]));
        // How far the channels reach that begin here or before.
        let (mut next, mut reach) = (0, f64::NEG_INFINITY);
        let within = |edge: &[f64]| {
            while let Some(&[_, to]) = bounds.get(next).filter(|bounds| bounds[0] <= edge[0]) {
                (next, reach) = (next + 1, reach.max(to));
            }
            (reach >= edge[1]).then(|| [edge[0], edge[1]])
        };
        let stretches: Vec<[f64; 2]> = edges.windows(2).filter_map(within).collect();
        let of_stretches: Vec<Vec<Point>> =
            stretches.par_iter().map(|&stretch| points(curves, &[stretch], rows, &f)).collect();
        let nm: Vec<f64> = of_stretches.iter().flatten().map(|point| point.0).collect();
        let curve = |row: usize| Curve::Linear {
            nm: nm.clone(),
            value: of_stretches.iter().flatten().map(|point| point.1[row]).collect(),
            outside: Outside::Hold,
        };
        (0..rows).map(curve).collect()
    }
}

/// A wavelength in nm, and what each row is there.
type Point = (f64, SmallVec<[f64; 1]>);

/// The points between which `rows` functions of `curves` are straight within `bounds`, each up to [`BOUND`] of its peak.
fn points(curves: &[&Curve], bounds: &[[f64; 2]], rows: usize, f: &impl Fn(f64, &[f64], &mut [f64])) -> Vec<Point> {
    let at = |nm: f64| -> Point {
        let values: SmallVec<[f64; 8]> = curves.iter().map(|curve| curve.eval(nm)).collect();
        let mut out = smallvec![0.0; rows];
        f(nm, &values, &mut out);
        (nm, out)
    };
    let mut nodes: Vec<f64> = bounds.iter().flatten().copied().collect();
    for curve in curves {
        if let Curve::Linear { nm, .. } = curve {
            for [from, to] in bounds {
                nodes.extend(&nm[nm.partition_point(|x| x < from)..nm.partition_point(|x| x <= to)]);
            }
        }
    }
    nodes.sort_by(f64::total_cmp);
    nodes.dedup();
    let ends = nodes.windows(2).map(|pair| {
        // Just inside, so that a step belongs to neither side.
        let inside = (pair[1] - pair[0]) * 1e-9;
        [(pair[0], at(pair[0] + inside).1), (pair[1], at(pair[1] - inside).1)]
    });
    let ends: Vec<[Point; 2]> = ends.collect();
    let peak = |row: usize| ends.iter().flatten().map(|point| point.1[row].abs()).fold(0.0, f64::max);
    let allowed: Vec<f64> = (0..rows).map(|row| BOUND * peak(row)).collect();
    let mut points: Vec<Point> = Vec::with_capacity(2 * ends.len());
    for [a, b] in &ends {
        push(&mut points, a);
        bisect(&at, a, &at(0.5 * (a.0 + b.0)), b, &allowed, MAX_DEPTH, &mut |node| push(&mut points, node));
        push(&mut points, b);
    }
    points
}

/// Adds a node, unless it is the last one.
fn push(points: &mut Vec<Point>, node: &Point) {
    let close = |a: f64, b: f64| (a - b).abs() <= 1e-8 * a.abs().max(b.abs());
    let is_last = |last: &Point| last.0 == node.0 && last.1.iter().zip(&node.1).all(|(&a, &b)| close(a, b));
    if !points.last().is_some_and(is_last) {
        points.push(node.clone());
    }
}

/// Nodes between `a` and `b`, whose middle is known, in order, until the lines through neighbours are within `allowed` at three points
/// between.
fn bisect(
    at: &impl Fn(f64) -> Point,
    a: &Point,
    middle: &Point,
    b: &Point,
    allowed: &[f64],
    depth: u32,
    push: &mut impl FnMut(&Point),
) {
    if depth == 0 {
        return;
    }
    let [first, last] = [a, b].map(|end| at(0.5 * (end.0 + middle.0)));
    let is_straight = |(t, point): (f64, &Point)| {
        let ends = a.1.iter().zip(&b.1);
        point
            .1
            .iter()
            .zip(ends)
            .zip(allowed)
            .all(|((value, (a, b)), allowed)| (value - (a + t * (b - a))).abs() <= *allowed)
    };
    if [(0.5, middle), (0.25, &first), (0.75, &last)].into_iter().all(is_straight) {
        return;
    }
    bisect(at, a, &first, middle, allowed, depth - 1, push);
    push(middle);
    bisect(at, middle, &last, b, allowed, depth - 1, push);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A product of a rising curve and one with a step, held within the bound, step included.
    #[test]
    fn derived_curves_keep_their_bound_and_steps() {
        let rising = Curve::Linear { nm: vec![400.0, 800.0], value: vec![1.0, 3.0], outside: Outside::Hold };
        let step = Curve::Linear {
            nm: vec![400.0, 530.0, 530.0, 800.0],
            value: vec![1.0, 1.0, 0.25, 0.5],
            outside: Outside::Hold,
        };
        let channels = Channels::from_bounds(vec![[450.0, 500.0], [510.0, 700.0]], None);
        let f = |v: &[f64]| v[0] * v[0] / (1.0 + v[1]);
        let derived = Curve::derived(&[&rising, &step], &channels, f);
        for i in 0..10_000 {
            let nm = 510.0 + 190.0 * f64::from(i) / 10_000.0;
            let want = f(&[rising.eval(nm), step.eval(nm)]);
            assert!((derived.eval(nm) - want).abs() <= 2.1e-5 * 5.0, "{nm}: {} {want}", derived.eval(nm));
        }
        let jump = derived.eval(530.0 + 1e-6) - derived.eval(530.0 - 1e-6);
        let want = f(&[rising.eval(530.0), 0.25]) - f(&[rising.eval(530.0), 1.0]);
        assert!((jump - want).abs() < 1e-4, "{jump} {want}");
        let constants = [Curve::Constant(2.0), Curve::Constant(3.0)];
        assert_eq!(Curve::derived(&constants.each_ref(), &channels, |v| v[0] * v[1]), Curve::Constant(6.0));
    }
}
