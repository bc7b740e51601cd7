//! The channels of a cube: intervals of wavelength.

use serde::{Deserialize, Serialize};

/// K channels; channel k is `bounds[k]` = [λmin, λmax] in nm, λmin < λmax. Unequal, disjoint and overlapping
/// channels are fine; the order is the user's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Channels {
    pub bounds: Vec<[f64; 2]>,
    /// One name a channel, e.g. `550.5 nm`.
    pub names: Vec<String>,
    /// Channels shown as R, G, B in the preview, where the scene asks for it.
    pub false_colour: Option<[usize; 3]>,
}

impl Channels {
    /// The number of channels, K.
    pub fn len(&self) -> usize {
        self.bounds.len()
    }

    pub fn is_empty(&self) -> bool {
        self.bounds.is_empty()
    }

    /// Centre of channel `k` in nm.
    pub fn centre(&self, k: usize) -> f64 {
        0.5 * (self.bounds[k][0] + self.bounds[k][1])
    }

    /// Width of channel `k` in nm.
    pub fn width(&self, k: usize) -> f64 {
        self.bounds[k][1] - self.bounds[k][0]
    }

    /// Wavelength sample of channel `k` (Eq. 4 of the method): Λ_k(μ) = (1-μ) λmin + μ λmax, in nm.
    pub fn wavelength(&self, k: usize, mu: f64) -> f64 {
        let [min, max] = self.bounds[k];
        min + mu * (max - min)
    }

    /// Channels with these bounds, named by their centres.
    pub fn from_bounds(bounds: Vec<[f64; 2]>, false_colour: Option<[usize; 3]>) -> Self {
        let names = bounds.iter().map(|[a, b]| format!("{:.3} nm", 0.5 * (a + b))).collect();
        Channels { bounds, names, false_colour }
    }

    /// `count` equal channels between `from` and `to` nm; each bound is computed once, so neighbours share it.
    pub fn equal(from: f64, to: f64, count: usize) -> Self {
        let edge = |i: usize| if i == count { to } else { from + (to - from) * (i as f64 / count as f64) };
        Self::from_bounds((0..count).map(|i| [edge(i), edge(i + 1)]).collect(), None)
    }
}
