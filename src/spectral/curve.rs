//! A curve: a physical quantity over wavelength, as the scene gives it.

use serde::{Deserialize, Serialize};
use smallvec::{SmallVec, smallvec};

use super::planck;

/// (nm, value) of pieces of a curve: few, most of the time.
pub type Nodes = SmallVec<[(f64, f64); 4]>;

/// What a table means beyond its ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outside {
    Zero,
    /// The end values go on.
    Hold,
}

impl Outside {
    /// As scene files call it.
    pub fn name(self) -> &'static str {
        match self {
            Outside::Zero => "zero",
            Outside::Hold => "hold",
        }
    }
}

/// On the line from node `i - 1` to node `i`.
fn between(x: &[f64], y: &[f64], i: usize, at: f64) -> f64 {
    let t = (at - x[i - 1]) / (x[i] - x[i - 1]);
    y[i - 1] + t * (y[i] - y[i - 1])
}

/// A function of wavelength (nm). Values carry the unit of what they describe.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Curve {
    Constant(f64),
    /// Piecewise linear through (nm, value), nm ascending; two equal nm make a step. At least one node.
    Linear {
        nm: Vec<f64>,
        value: Vec<f64>,
        outside: Outside,
    },
    /// `scale` x Planck radiance at `kelvin`.
    Blackbody {
        kelvin: f64,
        scale: f64,
    },
}

impl Curve {
    /// The value at `nm`. At a step the value from above holds.
    pub fn eval(&self, nm: f64) -> f64 {
        match self {
            Curve::Constant(v) => *v,
            Curve::Blackbody { kelvin, scale } => scale * planck::radiance(nm, *kelvin),
            Curve::Linear { nm: x, value: y, outside } => {
                let last = x.len() - 1;
                if nm < x[0] || nm > x[last] {
                    return match outside {
                        Outside::Zero => 0.0,
                        Outside::Hold if nm < x[0] => y[0],
                        Outside::Hold => y[last],
                    };
                }
                let i = x.partition_point(|&xi| xi <= nm);
                if i > last {
                    return y[last];
                }
                between(x, y, i, nm)
            }
        }
    }

    /// The pieces of the curve between `from` and `to` nm as (nm, value) nodes of a piecewise linear function that
    /// starts at `from` and ends at `to`; a step is two nodes of equal nm. `None` for curves that are not piecewise
    /// linear.
    pub fn linear_pieces(&self, from: f64, to: f64) -> Option<Nodes> {
        match self {
            Curve::Constant(v) => Some(smallvec![(from, *v), (to, *v)]),
            Curve::Blackbody { .. } => None,
            Curve::Linear { nm: x, value: y, outside } => {
                let (first, last) = (x[0], x[x.len() - 1]);
                let beyond = |end: f64| if *outside == Outside::Hold { end } else { 0.0 };
                // What is searched for once is needed a hundred thousand times: tables ask for every stratum of every channel.
                let a = x.partition_point(|&xi| xi <= from);
                let b = if from < to {
                    a + x[a..].partition_point(|&xi| xi < to)
                } else {
                    x.partition_point(|&xi| xi < to)
                };
                // Value just inside the interval, at either end.
                let start = if from < first {
                    beyond(y[0])
                } else if from >= last {
                    beyond(y[y.len() - 1])
                } else {
                    between(x, y, a, from)
                };
                let mut nodes: Nodes = smallvec![(from, start)];
                let mut push = |node: (f64, f64)| {
                    if nodes.last() != Some(&node) {
                        nodes.push(node);
                    }
                };
                if first > from && first < to {
                    push((first, beyond(y[0])));
                }
                for i in a..b.max(a) {
                    push((x[i], y[i]));
                }
                if last > from && last < to {
                    push((last, beyond(y[y.len() - 1])));
                }
                // Value approached from below at `to`.
                let end = if to <= first {
                    beyond(y[0])
                } else if to > last {
                    beyond(y[y.len() - 1])
                } else {
                    if x[b] == to || b == 0 { y[b] } else { between(x, y, b, to) }
                };
                push((to, end));
                if nodes.len() == 1 {
                    nodes.push((to, end));
                }
                Some(nodes)
            }
        }
    }

    /// The mean over [from, to] nm: exact for piecewise linear curves, Gauss-Legendre for black bodies.
    pub fn mean(&self, from: f64, to: f64) -> f64 {
        if let Curve::Constant(v) = self {
            return *v;
        }
        match self.linear_pieces(from, to) {
            Some(nodes) => {
                let area: f64 = nodes.windows(2).map(|w| (w[1].0 - w[0].0) * 0.5 * (w[0].1 + w[1].1)).sum();
                area / (to - from)
            }
            None => mean_smooth(|nm| self.eval(nm), from, to),
        }
    }

    /// The largest value over [from, to] nm.
    pub fn max(&self, from: f64, to: f64) -> f64 {
        match self.linear_pieces(from, to) {
            Some(nodes) => nodes.iter().map(|n| n.1).fold(f64::NEG_INFINITY, f64::max),
            None => {
                // Planck's curve has one maximum, at Wien's wavelength.
                let Curve::Blackbody { kelvin, .. } = self else { unreachable!("only black bodies are not piecewise") };
                let wien = 2_897_771.955 / kelvin;
                self.eval(wien.clamp(from, to))
            }
        }
    }

    /// The variance of the values over [from, to] nm, over the square of their mean; 0 where that is 0.
    pub fn variation(&self, from: f64, to: f64) -> f64 {
        let mean = self.mean(from, to);
        if !mean.is_normal() {
            return 0.0;
        }
        let square = match self.linear_pieces(from, to) {
            Some(nodes) => {
                let of = |a: f64, b: f64| (a * a + a * b + b * b) / 3.0;
                nodes.windows(2).map(|w| (w[1].0 - w[0].0) * of(w[0].1, w[1].1)).sum::<f64>() / (to - from)
            }
            None => mean_smooth(|nm| self.eval(nm).powi(2), from, to),
        };
        (square / (mean * mean) - 1.0).max(0.0)
    }

    /// The curve times `factor`.
    pub fn scaled(&self, factor: f64) -> Curve {
        match self {
            Curve::Constant(value) => Curve::Constant(value * factor),
            Curve::Blackbody { kelvin, scale } => Curve::Blackbody { kelvin: *kelvin, scale: scale * factor },
            Curve::Linear { nm, value, outside } => {
                Curve::Linear { nm: nm.clone(), value: value.iter().map(|v| v * factor).collect(), outside: *outside }
            }
        }
    }

    /// (1 - `share`) of this curve and `share` of `other`. Black bodies beside curves of another kind become lines between [from, to] nm,
    /// right to 1e-6 of their values, and end there.
    pub fn mixed(&self, other: &Curve, share: f64, range: [f64; 2]) -> Curve {
        let (first, second) = (self.scaled(1.0 - share), other.scaled(share));
        match (&first, &second) {
            _ if share == 0.0 => return first,
            _ if share == 1.0 => return second,
            (Curve::Constant(a), Curve::Constant(b)) => return Curve::Constant(a + b),
            (Curve::Blackbody { kelvin, scale }, Curve::Blackbody { kelvin: same, scale: more }) if kelvin == same => {
                return Curve::Blackbody { kelvin: *kelvin, scale: scale + more };
            }
            _ => {}
        }
        let parts = [first, second].map(|curve| curve.as_lines(range));
        let mut places: Vec<f64> = parts.iter().flat_map(Curve::knots).copied().collect();
        places.sort_by(f64::total_cmp);
        places.dedup();
        let (mut nm, mut value) = (Vec::new(), Vec::new());
        for &place in &places {
            let limits = parts.each_ref().map(|part| part.limits(place));
            let [below, above] = [0, 1].map(|side| limits[0][side] + limits[1][side]);
            nm.push(place);
            value.push(below);
            if above != below {
                nm.push(place);
                value.push(above);
            }
        }
        let goes_on = |end: Option<&f64>| end.is_some_and(|value| *value != 0.0);
        let outside = if goes_on(value.first()) || goes_on(value.last()) { Outside::Hold } else { Outside::Zero };
        Curve::Linear { nm, value, outside }
    }

    /// Wavelengths between which it is a line.
    pub fn knots(&self) -> &[f64] {
        match self {
            Curve::Linear { nm, .. } => nm,
            Curve::Constant(_) | Curve::Blackbody { .. } => &[],
        }
    }

    /// A black body as lines, of which none is off by more than 1e-6 of its value; zero outside of the range.
    fn as_lines(&self, [from, to]: [f64; 2]) -> Curve {
        let Curve::Blackbody { kelvin, .. } = self else { return self.clone() };
        let (mut nm, mut at) = (Vec::new(), from);
        while at < to {
            nm.push(at);
            // Planck's law L bends by less than (x + 5)² L / λ², x = c₂ / (λ T); a chord is off by an eighth of that times its square.
            let x = 1e9 * planck::C2 / (at * kelvin);
            at *= 1.0 + (7e-6f64).sqrt() / (x.min(300.0) + 5.0);
        }
        nm.push(to);
        let value = nm.iter().map(|nm| self.eval(*nm)).collect();
        Curve::Linear { nm, value, outside: Outside::Zero }
    }

    /// The values that it has below and above `place`, which differ at steps and ends.
    fn limits(&self, place: f64) -> [f64; 2] {
        let Curve::Linear { nm, value, outside } = self else { return [self.eval(place); 2] };
        let at = nm.partition_point(|x| *x < place)..nm.partition_point(|x| *x <= place);
        if at.is_empty() {
            return [self.eval(place); 2];
        }
        let beyond = |end: f64| if *outside == Outside::Hold { end } else { 0.0 };
        let below = if at.start == 0 { beyond(value[0]) } else { value[at.start] };
        let above = if at.end == nm.len() { beyond(value[at.end - 1]) } else { value[at.end - 1] };
        [below, above]
    }

    /// Whether the value is the same at every wavelength.
    pub fn is_constant(&self) -> bool {
        match self {
            Curve::Constant(_) => true,
            Curve::Linear { value, outside: Outside::Hold, .. } => value.windows(2).all(|w| w[0] == w[1]),
            _ => false,
        }
    }
}

/// Mean of a smooth function over [from, to]: 5-point Gauss-Legendre on panels of at most 1/64 of the wavelength.
fn mean_smooth(f: impl Fn(f64) -> f64, from: f64, to: f64) -> f64 {
    const NODE: [f64; 3] = [0.0, 0.538_469_310_105_683_1, 0.906_179_845_938_664];
    const WEIGHT: [f64; 3] = [0.568_888_888_888_888_9, 0.478_628_670_499_366_5, 0.236_926_885_056_189_1];
    let panels = ((to / from).ln() * 64.0).ceil().max(1.0) as usize;
    let ratio = (to / from).powf(1.0 / panels as f64);
    let (mut sum, mut a) = (0.0, from);
    for panel in 0..panels {
        let b = if panel + 1 == panels { to } else { a * ratio };
        let (centre, half) = (0.5 * (a + b), 0.5 * (b - a));
        let mut panel_sum = WEIGHT[0] * f(centre);
        for i in 1..3 {
            panel_sum += WEIGHT[i] * (f(centre - half * NODE[i]) + f(centre + half * NODE[i]));
        }
        sum += half * panel_sum;
        a = b;
    }
    sum / (to - from)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(outside: Outside) -> Curve {
        Curve::Linear { nm: vec![400.0, 500.0, 500.0, 600.0], value: vec![1.0, 2.0, 5.0, 3.0], outside }
    }

    #[test]
    fn values_steps_and_ends() {
        let zero = table(Outside::Zero);
        assert_eq!(zero.eval(399.0), 0.0);
        assert_eq!(zero.eval(400.0), 1.0);
        assert_eq!(zero.eval(450.0), 1.5);
        assert_eq!(zero.eval(500.0), 5.0);
        assert_eq!(zero.eval(600.0), 3.0);
        assert_eq!(zero.eval(601.0), 0.0);
        assert_eq!(table(Outside::Hold).eval(601.0), 3.0);
    }

    #[test]
    fn mixtures_are_sums_everywhere() {
        let body = |kelvin: f64| Curve::Blackbody { kelvin, scale: 0.5 };
        let flat = Curve::Linear { nm: vec![450.0, 550.0], value: vec![2.0, 2.0], outside: Outside::Zero };
        let range = [300.0, 900.0];
        for (a, b) in [
            (table(Outside::Zero), flat.clone()),
            (table(Outside::Hold), flat.clone()),
            (table(Outside::Zero), Curve::Constant(3.0)),
            (Curve::Constant(1.0), Curve::Constant(3.0)),
            (body(3000.0), flat),
            (body(3000.0), body(6000.0)),
            (body(3000.0), body(3000.0)),
            (body(300.0), Curve::Constant(1e-12)),
        ] {
            let mixed = a.mixed(&b, 0.3, range);
            // Between nodes: at a step a sum has the value from above, and an end belongs to its table.
            for nm in (3001..8999).step_by(7).map(|nm| f64::from(nm) / 10.0 + 0.05) {
                let want = 0.7 * a.eval(nm) + 0.3 * b.eval(nm);
                assert!((mixed.eval(nm) - want).abs() <= 1e-6 * want, "{nm}: {} {want} {a:?}", mixed.eval(nm));
            }
            assert_eq!((a.mixed(&b, 0.0, range), a.mixed(&b, 1.0, range)), (a.scaled(1.0), b.scaled(1.0)));
            let mean = 0.7 * a.mean(380.0, 700.0) + 0.3 * b.mean(380.0, 700.0);
            assert!((mixed.mean(380.0, 700.0) - mean).abs() <= 1e-6 * mean);
        }
    }

    #[test]
    fn means_are_exact_over_steps_and_ends() {
        let zero = table(Outside::Zero);
        assert!((zero.mean(400.0, 500.0) - 1.5).abs() < 1e-14);
        assert!((zero.mean(500.0, 600.0) - 4.0).abs() < 1e-14);
        assert!((zero.mean(300.0, 700.0) - 550.0 / 400.0).abs() < 1e-14);
        assert!((table(Outside::Hold).mean(300.0, 700.0) - (550.0 + 100.0 + 300.0) / 400.0).abs() < 1e-14);
        assert_eq!(zero.mean(700.0, 800.0), 0.0);
        assert_eq!(zero.mean(100.0, 400.0), 0.0);
    }

    /// Planck's law integrated over 8-12 um at 300 K is 38.50042 W m-2 sr-1.
    #[test]
    fn blackbody_band() {
        let b = Curve::Blackbody { kelvin: 300.0, scale: 1.0 };
        for (from, to, expected) in
            [(3e3, 5e3, 1.865956), (8e3, 12e3, 38.50042), (8e3, 14e3, 54.93346), (380.0, 2e4, 107.8647)]
        {
            let got = b.mean(from, to) * (to - from);
            assert!((got / expected - 1.0).abs() < 1e-6, "{from}-{to}: {got} {expected}");
        }
    }
}
