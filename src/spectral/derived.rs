//! Curves computed from other curves.

use smallvec::SmallVec;

use super::{Channels, Curve, Outside};

/// Bisections of an interval between nodes at most.
const MAX_DEPTH: u32 = 14;

impl Curve {
    /// The curve f(values of `curves`) within `channels`: piecewise linear, with nodes so close that it is off by at most
    /// 2e-5 of its own peak, and steps where `curves` have them. Beyond the channels it has no meaning.
    pub fn derived(curves: &[&Curve], channels: &Channels, f: impl Fn(&[f64]) -> f64) -> Curve {
        if curves.iter().all(|c| c.is_constant()) {
            let nm = channels.bounds.first().map_or(550.0, |b| b[0]);
            return Curve::Constant(f(&curves.iter().map(|c| c.eval(nm)).collect::<Vec<_>>()));
        }
        let at = |nm: f64| f(&curves.iter().map(|c| c.eval(nm)).collect::<SmallVec<[f64; 8]>>());
        let mut nodes: Vec<f64> = channels.bounds.iter().flatten().copied().collect();
        for curve in curves {
            if let Curve::Linear { nm, .. } = curve {
                for [from, to] in &channels.bounds {
                    nodes.extend(&nm[nm.partition_point(|x| x < from)..nm.partition_point(|x| x <= to)]);
                }
            }
        }
        nodes.sort_by(f64::total_cmp);
        nodes.dedup();
        let peak = nodes.iter().map(|&nm| at(nm).abs()).fold(0.0, f64::max);
        let (mut nm, mut value) = (Vec::new(), Vec::new());
        for pair in nodes.windows(2) {
            // Just inside, so that a step belongs to neither side.
            let inside = (pair[1] - pair[0]) * 1e-9;
            let (a, b) = ((pair[0], at(pair[0] + inside)), (pair[1], at(pair[1] - inside)));
            push(&mut nm, &mut value, a);
            bisect(&at, a, b, 2e-5 * peak, MAX_DEPTH, &mut |node| push(&mut nm, &mut value, node));
            push(&mut nm, &mut value, b);
        }
        Curve::Linear { nm, value, outside: Outside::Hold }
    }
}

impl Curve {
    /// As [`Curve::derived`] with the wavelength in nm as well, f(nm, values): from bound to bound of `channels`, each stretch by
    /// its own peak, so that the tail of Planck's law is as exact as its top.
    pub fn derived_by_stretch(curves: &[&Curve], channels: &Channels, f: impl Fn(f64, &[f64]) -> f64) -> Curve {
        let mut edges: Vec<f64> = channels.bounds.iter().flatten().copied().collect();
        edges.sort_by(f64::total_cmp);
        edges.dedup();
        let (mut nm, mut value) = (Vec::new(), Vec::new());
        let mut bounds = channels.bounds.clone();
        bounds.sort_by(|a, b| a[0].total_cmp(&b[0]));
        // How far the channels reach that begin here or before.
        let (mut next, mut reach) = (0, f64::NEG_INFINITY);
        for edge in edges.windows(2) {
            while let Some(&[_, to]) = bounds.get(next).filter(|bounds| bounds[0] <= edge[0]) {
                (next, reach) = (next + 1, reach.max(to));
            }
            if reach < edge[1] {
                continue;
            }
            // The wavelength itself is one of the curves.
            let wavelength = Curve::Linear { nm: edge.to_vec(), value: edge.to_vec(), outside: Outside::Hold };
            let all: Vec<&Curve> = std::iter::once(&wavelength).chain(curves.iter().copied()).collect();
            let stretch = Channels::from_bounds(vec![[edge[0], edge[1]]], None);
            if let Curve::Linear { nm: x, value: y, .. } = Curve::derived(&all, &stretch, |v| f(v[0], &v[1..])) {
                nm.extend(x);
                value.extend(y);
            }
        }
        Curve::Linear { nm, value, outside: Outside::Hold }
    }
}

/// Adds a node, unless it is the last one.
fn push(nm: &mut Vec<f64>, value: &mut Vec<f64>, node: (f64, f64)) {
    let close = |a: f64, b: f64| (a - b).abs() <= 1e-8 * a.abs().max(b.abs());
    if nm.last() == Some(&node.0) && value.last().is_some_and(|&v| close(v, node.1)) {
        return;
    }
    nm.push(node.0);
    value.push(node.1);
}

/// Nodes between `a` and `b`, in order, until the line through neighbours is within `bound` at three points between.
fn bisect(
    f: &impl Fn(f64) -> f64,
    a: (f64, f64),
    b: (f64, f64),
    bound: f64,
    depth: u32,
    push: &mut impl FnMut((f64, f64)),
) {
    let off = |t: f64| {
        let nm = a.0 + t * (b.0 - a.0);
        (f(nm) - (a.1 + t * (b.1 - a.1))).abs()
    };
    if depth == 0 || [0.25, 0.5, 0.75].iter().all(|&t| off(t) <= bound) {
        return;
    }
    let middle = 0.5 * (a.0 + b.0);
    let middle = (middle, f(middle));
    bisect(f, a, middle, bound, depth - 1, push);
    push(middle);
    bisect(f, middle, b, bound, depth - 1, push);
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
