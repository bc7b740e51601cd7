//! The channels of a cube: intervals of wavelength, or responses over them.

use serde::{Deserialize, Serialize};

use super::{Curve, Outside};

/// K channels; channel k is `bounds[k]` = [λmin, λmax] in nm, λmin < λmax. Unequal, disjoint and overlapping
/// channels are fine; the order is the user's.
#[derive(Debug, Clone, PartialEq)]
pub struct Channels {
    pub bounds: Vec<[f64; 2]>,
    /// One name a channel, e.g. `550.5 nm`.
    pub names: Vec<String>,
    /// Channels shown as R, G, B in the preview, where the scene asks for it.
    pub false_colour: Option<[usize; 3]>,
    /// Empty, and a channel is the mean over its bounds; or one a channel, and it is the mean weighted by its response,
    /// whose support the bounds are.
    pub responses: Vec<Response>,
}

/// The response of a channel: R(λ) ≥ 0, piecewise linear, zero outside its table and not everywhere.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Nodes", into = "Nodes")]
pub struct Response {
    curve: Curve,
    support: [f64; 2],
    integral: f64,
    centroid: f64,
}

/// A response as it stands in files.
#[derive(Serialize, Deserialize)]
struct Nodes {
    wavelength_nm: Vec<f64>,
    response: Vec<f64>,
}

impl Response {
    /// Through (nm, value), nm ascending; two equal nm make a step. The message says what is wrong.
    pub fn new(nm: Vec<f64>, value: Vec<f64>) -> std::result::Result<Response, String> {
        if nm.len() < 2 || nm.len() != value.len() {
            return Err(format!(
                "has {} values at {} wavelengths where at least two are needed",
                value.len(),
                nm.len()
            ));
        }
        let ascend = nm[0] > 0.0 && nm.windows(2).all(|w| w[0] <= w[1]) && nm.iter().all(|x| x.is_finite());
        if !ascend {
            return Err("has wavelengths that do not ascend from above 0 nm".into());
        }
        if let Some(i) = value.iter().position(|v| !(v.is_finite() && *v >= 0.0)) {
            return Err(format!("is {} at {} nm, but must be finite and not negative", value[i], nm[i]));
        }
        let pieces = || nm.windows(2).zip(value.windows(2)).map(|(x, y)| (x[0], x[1], y[0], y[1]));
        // Of linear pieces: ∫R, and ∫R (λ - λ0) with λ0 the first node, so that nothing cancels.
        let integral: f64 = pieces().map(|(a, b, p, q)| (b - a) * 0.5 * (p + q)).sum();
        let moment = |(a, b, p, q): (f64, f64, f64, f64)| {
            (b - a) * (0.5 * (a - nm[0]) * (p + q) + (b - a) * (p + 2.0 * q) / 6.0)
        };
        let first_moment: f64 = pieces().map(moment).sum();
        if integral <= 0.0 || !integral.is_finite() {
            return Err("is zero everywhere".into());
        }
        let live = || pieces().filter(|(a, b, p, q)| a < b && (*p > 0.0 || *q > 0.0));
        let from = live().next().map_or(nm[0], |piece| piece.0);
        let to = live().next_back().map_or(nm[0], |piece| piece.1);
        let centroid = nm[0] + first_moment / integral;
        let curve = Curve::Linear { nm, value, outside: Outside::Zero };
        Ok(Response { curve, support: [from, to], integral, centroid })
    }

    /// What decides it; all else that it holds follows from that.
    pub fn curve(&self) -> &Curve {
        let Response { curve, support: _, integral: _, centroid: _ } = self;
        curve
    }

    /// Between these, nm, lies all of it.
    pub fn support(&self) -> [f64; 2] {
        self.support
    }

    /// ∫R dλ, nm.
    pub fn integral(&self) -> f64 {
        self.integral
    }

    /// ∫R dλ between two wavelengths, nm.
    pub fn integral_over(&self, from: f64, to: f64) -> f64 {
        let (a, b) = (from.max(self.support[0]), to.min(self.support[1]));
        if a < b { self.curve.mean(a, b) * (b - a) } else { 0.0 }
    }

    /// Distance of the outermost wavelengths at which R is half of its peak, nm.
    pub fn fwhm(&self) -> f64 {
        let Curve::Linear { nm, value, .. } = &self.curve else { return 0.0 };
        let half = 0.5 * value.iter().copied().fold(0.0, f64::max);
        let crossing = |i: usize, j: usize| {
            // From node i outside to node j inside.
            nm[i] + (nm[j] - nm[i]) * ((half - value[i]) / (value[j] - value[i]))
        };
        let (first, last) = (value.iter().position(|&v| v >= half), value.iter().rposition(|&v| v >= half));
        let (first, last) = (first.unwrap_or(0), last.unwrap_or(0));
        let from = if first > 0 { crossing(first - 1, first) } else { nm[first] };
        let to = if last + 1 < nm.len() { crossing(last + 1, last) } else { nm[last] };
        to - from
    }
}

impl TryFrom<Nodes> for Response {
    type Error = String;

    fn try_from(nodes: Nodes) -> std::result::Result<Response, String> {
        Response::new(nodes.wavelength_nm, nodes.response)
    }
}

impl From<Response> for Nodes {
    fn from(response: Response) -> Nodes {
        match response.curve {
            Curve::Linear { nm, value, .. } => Nodes { wavelength_nm: nm, response: value },
            // `new` makes no others.
            _ => Nodes { wavelength_nm: Vec::new(), response: Vec::new() },
        }
    }
}

/// From the shortest to the longest wavelength of some intervals, nm; `None` if there are none.
pub fn hull(bounds: impl Iterator<Item = [f64; 2]>) -> Option<[f64; 2]> {
    bounds.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
}

impl Channels {
    /// The number of channels, K.
    pub fn len(&self) -> usize {
        self.bounds.len()
    }

    pub fn is_empty(&self) -> bool {
        self.bounds.is_empty()
    }

    /// From the shortest to the longest wavelength of all channels, nm; `None` if there are none.
    pub fn hull(&self) -> Option<[f64; 2]> {
        hull(self.bounds.iter().copied())
    }

    /// Centre of channel `k` in nm: the middle of its interval, or the centroid of its response.
    pub fn centre(&self, k: usize) -> f64 {
        match self.responses.get(k) {
            Some(response) => response.centroid,
            None => 0.5 * (self.bounds[k][0] + self.bounds[k][1]),
        }
    }

    /// Width of channel `k` in nm, that of the support of its response.
    pub fn width(&self, k: usize) -> f64 {
        self.bounds[k][1] - self.bounds[k][0]
    }

    /// ∫R dλ in nm, R = 1 where there is no response: mean radiance times this is W m⁻² sr⁻¹.
    pub fn integral(&self, k: usize) -> f64 {
        self.responses.get(k).map_or_else(|| self.width(k), Response::integral)
    }

    /// Full width at half maximum in nm.
    pub fn fwhm(&self, k: usize) -> f64 {
        self.responses.get(k).map_or_else(|| self.width(k), Response::fwhm)
    }

    /// Wavelength sample of channel `k` (Eq. 4 of Hoarau et al. 2018): Λ_k(μ) = (1-μ) λmin + μ λmax, in nm.
    pub fn wavelength(&self, k: usize, mu: f64) -> f64 {
        let [min, max] = self.bounds[k];
        min + mu * (max - min)
    }

    /// Channels with these bounds, named by their centres.
    pub fn from_bounds(bounds: Vec<[f64; 2]>, false_colour: Option<[usize; 3]>) -> Self {
        let names = bounds.iter().map(|[a, b]| format!("{:.3} nm", 0.5 * (a + b))).collect();
        Channels { bounds, names, false_colour, responses: Vec::new() }
    }

    /// Channels of named responses.
    pub fn from_responses(named: Vec<(String, Response)>, false_colour: Option<[usize; 3]>) -> Self {
        let bounds = named.iter().map(|(_, response)| response.support()).collect();
        let (names, responses) = named.into_iter().unzip();
        Channels { bounds, names, false_colour, responses }
    }

    /// The mean of `curve` over channel `k`, weighted by its response where it has one.
    pub fn mean_of(&self, k: usize, curve: &Curve) -> f64 {
        let [from, to] = self.bounds[k];
        let Some(response) = self.responses.get(k) else { return curve.mean(from, to) };
        // Both are linear between nodes of either; a smooth curve nearly so.
        let smooth = || (0..=1000).map(|i| from + (to - from) * f64::from(i) / 1000.0).collect();
        let nodes = |curve: &Curve| -> Vec<f64> {
            curve.linear_pieces(from, to).map_or_else(smooth, |nodes| nodes.iter().map(|node| node.0).collect())
        };
        let mut nm = [nodes(curve), nodes(response.curve())].concat();
        nm.sort_by(f64::total_cmp);
        nm.dedup();
        let ends = |curve: &Curve, a: f64, b: f64| match curve.linear_pieces(a, b) {
            Some(nodes) => [nodes[0].1, nodes[nodes.len() - 1].1],
            None => [curve.eval(a), curve.eval(b)],
        };
        let piece = |w: &[f64]| {
            let ([p, q], [r, s]) = (ends(curve, w[0], w[1]), ends(response.curve(), w[0], w[1]));
            (w[1] - w[0]) / 6.0 * (2.0 * p * r + p * s + q * r + 2.0 * q * s)
        };
        nm.windows(2).map(piece).sum::<f64>() / response.integral()
    }

    /// Those of `bands`, in that order.
    pub fn select(&self, bands: &[usize]) -> Self {
        let responses = bands.iter().filter_map(|&k| self.responses.get(k).cloned()).collect();
        let position = |k: usize| bands.iter().position(|&band| band == k);
        Channels {
            bounds: bands.iter().map(|&k| self.bounds[k]).collect(),
            names: bands.iter().map(|&k| self.names[k].clone()).collect(),
            false_colour: self.false_colour.and_then(|[r, g, b]| Some([position(r)?, position(g)?, position(b)?])),
            responses,
        }
    }

    /// `count` equal channels between `from` and `to` nm; each bound is computed once, so neighbours share it.
    pub fn equal(from: f64, to: f64, count: usize) -> Self {
        let edge = |i: usize| if i == count { to } else { from + (to - from) * (i as f64 / count as f64) };
        Self::from_bounds((0..count).map(|i| [edge(i), edge(i + 1)]).collect(), None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn responses_know_their_moments() {
        let triangle = Response::new(vec![390.0, 400.0, 410.0, 430.0, 440.0], vec![0.0, 0.0, 2.0, 0.0, 0.0]).unwrap();
        assert_eq!(triangle.support(), [400.0, 430.0]);
        assert_eq!(triangle.integral(), 30.0);
        assert!((triangle.centroid - (400.0 + 410.0 + 430.0) / 3.0).abs() < 1e-10);
        assert_eq!(triangle.fwhm(), 15.0);
        assert_eq!(triangle.integral_over(0.0, 410.0), 10.0);
        assert_eq!(triangle.integral_over(500.0, 600.0), 0.0);
        // What does not reach zero at its ends has steps there.
        let step = Response::new(vec![500.0, 600.0], vec![1.0, 1.0]).unwrap();
        assert_eq!(
            (step.support(), step.integral(), step.centroid, step.fwhm()),
            ([500.0, 600.0], 100.0, 550.0, 100.0)
        );
    }

    #[test]
    fn wrong_responses_say_why() {
        for (nm, value, words) in [
            (vec![400.0], vec![1.0], "at least two"),
            (vec![500.0, 400.0], vec![1.0, 1.0], "ascend"),
            (vec![400.0, 500.0], vec![1.0, -1.0], "-1 at 500 nm"),
            (vec![400.0, 500.0], vec![1.0, f64::NAN], "finite"),
            (vec![400.0, 500.0], vec![0.0, 0.0], "zero everywhere"),
        ] {
            assert!(Response::new(nm, value).unwrap_err().contains(words), "{words}");
        }
    }

    #[test]
    fn responses_come_back_from_json() {
        let response = Response::new(vec![400.1, 500.0], vec![0.1, 1.0 / 3.0]).unwrap();
        let text = serde_json::to_string(&response).unwrap();
        assert_eq!(serde_json::from_str::<Response>(&text).unwrap(), response);
        assert!(serde_json::from_str::<Response>(&text.replace("400.1", "600.0")).is_err());
    }

    #[test]
    fn selections_keep_names_and_colours() {
        let channels = Channels { false_colour: Some([2, 1, 0]), ..Channels::equal(400.0, 700.0, 3) };
        let two = channels.select(&[2, 0]);
        assert_eq!((two.bounds.clone(), two.false_colour), (vec![[600.0, 700.0], [400.0, 500.0]], None));
        assert_eq!(channels.select(&[2, 1, 0]).false_colour, Some([0, 1, 2]));
    }
}
