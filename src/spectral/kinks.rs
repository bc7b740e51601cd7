//! Lines with kinks: what a spectrum is in a channel that holds a few of its nodes. In registers they spare evaluation the tables that
//! strata would take, which it would have to read anew for every path.

use super::Curve;
use super::table::{POINTWISE_BOUND, few_nodes, fit};

/// `value + place * slope + Σ bend * max(place - at, 0)`, place in [0, 1) over a channel; not below 0.
#[derive(Debug, Clone, PartialEq)]
pub struct BentLine {
    pub value: f32,
    pub slope: f32,
    /// (place, change of slope), ascending.
    pub kinks: Vec<(f32, f32)>,
}

impl BentLine {
    /// `curve` over [from, to] nm, and the largest error relative to its peak there: with as few kinks as keep the bound of tables, or
    /// `None` where more than `most` would be needed, or none help.
    pub fn of(curve: &Curve, from: f64, to: f64, most: usize) -> Option<(BentLine, f64)> {
        let line = fit(curve, from, to);
        let straight = BentLine { value: line.value as f32, slope: line.slope as f32, kinks: Vec::new() };
        let pieces = curve.linear_pieces(from, to);
        let is_smooth = pieces.is_none();
        let nodes = pieces.unwrap_or_else(|| few_nodes(curve, from, to));
        let places: Vec<(f64, f64)> = nodes.iter().map(|(nm, value)| ((nm - from) / (to - from), *value)).collect();
        let peak = curve.max(from, to);
        let within = |line: BentLine| {
            let error = line.error(&places) / if peak > 0.0 { peak } else { 1.0 };
            (error <= POINTWISE_BOUND).then_some((line, error))
        };
        within(straight).or_else(|| {
            // Jumps have no width.
            let jumps = places.windows(2).any(|w| w[1].0 <= w[0].0);
            if is_smooth || jumps || places.len() > most + 2 {
                return None;
            }
            let slopes: Vec<f64> = places.windows(2).map(|w| (w[1].1 - w[0].1) / (w[1].0 - w[0].0)).collect();
            let bends = slopes.windows(2).map(|w| (w[1] - w[0]) as f32);
            let kinks = places[1..].iter().map(|(place, _)| *place as f32).zip(bends).collect();
            within(BentLine { value: places[0].1 as f32, slope: slopes[0] as f32, kinks })
        })
    }

    /// As the device evaluates it.
    pub fn at(&self, place: f32) -> f32 {
        let bent = |sum: f32, &(at, bend): &(f32, f32)| sum + bend * (place - at).max(0.0);
        self.kinks.iter().fold(self.value + place * self.slope, bent).max(0.0)
    }

    /// Over the channel.
    pub fn mean(&self) -> f64 {
        let bends = self.kinks.iter().map(|&(at, bend)| 0.5 * f64::from(bend) * (1.0 - f64::from(at)).powi(2));
        f64::from(self.value) + 0.5 * f64::from(self.slope) + bends.sum::<f64>()
    }

    /// Largest distance from the straight lines between `places`. Where f32 rounds most, close behind a kink between steep lines, is
    /// looked at too.
    fn error(&self, places: &[(f64, f64)]) -> f64 {
        let pairs = places.windows(2).filter(|w| w[1].0 > w[0].0);
        let tried = pairs.flat_map(|w| {
            let [(a, value_a), (b, value_b)] = [w[0], w[1]];
            [0.0, 1e-3, 0.25, 0.5, 0.75, 1.0].map(|t| (a + t * (b - a), value_a + t * (value_b - value_a)))
        });
        tried.map(|(place, value)| (f64::from(self.at(place as f32)) - value).abs()).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectral::Outside;

    fn table(points: &[(f64, f64)]) -> Curve {
        let (nm, value) = points.iter().copied().unzip();
        Curve::Linear { nm, value, outside: Outside::Zero }
    }

    #[test]
    fn a_table_is_bent_at_its_nodes() {
        let curve = table(&[(400.0, 0.5), (401.0, 1.5), (403.0, 0.5), (404.0, 0.5)]);
        let (line, error) = BentLine::of(&curve, 400.0, 404.0, 2).unwrap();
        assert_eq!((line.value, line.slope), (0.5, 4.0));
        assert_eq!(line.kinks, [(0.25, -6.0), (0.75, 2.0)]);
        assert!(error < 1e-7, "{error}");
        assert!(BentLine::of(&curve, 400.0, 404.0, 1).is_none());
    }

    #[test]
    fn what_is_a_line_has_no_kinks() {
        let straight = table(&[(400.0, 1.0), (401.0, 2.0), (402.0, 3.00001), (404.0, 5.0)]);
        for curve in [straight, Curve::Constant(0.3), Curve::Blackbody { kelvin: 5778.0, scale: 1.0 }] {
            let (line, error) = BentLine::of(&curve, 400.0, 401.0, 0).unwrap();
            assert!(line.kinks.is_empty() && error < 1e-5, "{curve:?}: {line:?}, {error}");
        }
    }

    #[test]
    fn jumps_and_lines_that_cancel_are_refused() {
        // Ends within the channel, and jumps to zero there.
        assert!(BentLine::of(&table(&[(390.0, 1.0), (400.5, 1.0)]), 400.0, 401.0, 9).is_none());
        // Rises and falls within a ten thousandth of the channel: its slopes are 1e5, and f32 loses 1e-2 of them behind it.
        let spike = table(&[(390.0, 0.0), (400.5, 0.0), (400.50001, 1.0), (400.50002, 0.0), (410.0, 0.0)]);
        assert!(BentLine::of(&spike, 400.0, 401.0, 9).is_none());
        // A smooth curve in a wide channel.
        assert!(BentLine::of(&Curve::Blackbody { kelvin: 300.0, scale: 1.0 }, 3000.0, 20000.0, 9).is_none());
    }

    /// What ends at zero stays there.
    #[test]
    fn nothing_is_negative() {
        let curve = table(&[(390.0, 0.7), (400.01, 0.3), (400.3, 0.0), (410.0, 0.0)]);
        let (line, _) = BentLine::of(&curve, 400.0, 401.0, 2).unwrap();
        for i in 0..1000 {
            assert!(line.at(i as f32 / 1000.0) >= 0.0);
        }
    }
}
