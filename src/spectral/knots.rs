//! Spectra as exact knots: piecewise linear in the wavelength coordinate μ, for what no affordable number of strata resolves.

/// Knots of spectra in quads of channels. Four channels share the places of their knots, so that one search finds the segments of all.
#[derive(Debug, Clone, PartialEq)]
pub struct Knots {
    /// For each (spectrum, quad of channels) where its places begin in this list, and one more entry for the end; then all places, μ in
    /// units of 2⁻³², ascending within a quad from 0 to 2³² - 1. At a step a place is there twice.
    pub places: Vec<u32>,
    /// Values of the four channels at each place.
    pub values: Vec<[f32; 4]>,
    filled: usize,
}

impl Knots {
    /// Room for so many (spectrum, quad of channels), to be filled by [`Knots::push`].
    pub fn new(quads: usize) -> Knots {
        Knots { places: vec![quads as u32 + 1; quads + 1], values: Vec::new(), filled: 0 }
    }

    /// Entries of `places` before the first place.
    pub fn first_place(&self) -> usize {
        self.places[0] as usize
    }

    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// The next quad: for each channel (μ in whole units of 2⁻³², value), ascending from 0 to 2³² - 1. Where a place is there more than
    /// once, its first and last values are those before and behind a step.
    pub fn push(&mut self, channels: [&[(f64, f64)]; 4]) {
        let mut all: Vec<f64> = channels.iter().flat_map(|nodes| nodes.iter().map(|(mu, _)| *mu)).collect();
        all.sort_by(f64::total_cmp);
        all.dedup();
        // The first node of each channel that is not before `mu`.
        let mut next = [0; 4];
        for mu in all {
            let (mut before, mut behind) = ([0.0; 4], [0.0; 4]);
            for (k, nodes) in channels.iter().enumerate() {
                let here = nodes[next[k]..].iter().take_while(|(at, _)| *at == mu).count();
                [before[k], behind[k]] = if here > 0 {
                    [nodes[next[k]].1, nodes[next[k] + here - 1].1]
                } else {
                    let [(a, from), (b, to)] = [nodes[next[k] - 1], nodes[next[k]]];
                    [from + (mu - a) / (b - a) * (to - from); 2]
                };
                next[k] += here;
            }
            let both = [before, behind];
            for values in &both[usize::from(before == behind)..] {
                self.places.push(mu as u32);
                self.values.push(values.map(|value| value as f32));
            }
        }
        self.filled += 1;
        self.places[self.filled] = self.places.len() as u32;
    }

    /// Where the places of the quad of this number are in `places`.
    fn range(&self, quad: usize) -> std::ops::Range<usize> {
        self.places[quad] as usize..self.places[quad + 1] as usize
    }

    /// Steps of a binary search that finds the segment in any quad; 0 without knots.
    pub fn steps(&self) -> u32 {
        let segments = (0..self.filled).map(|quad| self.range(quad).len() - 1).max().unwrap_or(0);
        segments.next_power_of_two().max(1).ilog2()
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    impl Knots {
        /// The device's lookup, in f32, of the quad of this number.
        pub fn lookup(&self, quad: usize, mu: u32) -> [f32; 4] {
            let range = self.range(quad);
            let places = &self.places[range.start..range.end];
            let i = places[..places.len() - 1].partition_point(|place| *place <= mu).max(1) - 1;
            let [a, b] = [0, 1].map(|more| self.values[range.start - self.first_place() + i + more]);
            let place = ((mu - places[i]) as f32 / ((places[i + 1] - places[i]) as f32).max(1.0)).min(1.0);
            std::array::from_fn(|k| a[k] + place * (b[k] - a[k]))
        }

        /// The mean over μ of one of the channels of a quad.
        pub fn mean(&self, quad: usize, channel: usize) -> f64 {
            let value = |at: usize| f64::from(self.values[at - self.first_place()][channel]);
            let range = self.range(quad);
            let pieces = (range.start..range.end - 1)
                .map(|i| f64::from(self.places[i + 1] - self.places[i]) * 0.5 * (value(i) + value(i + 1)));
            pieces.sum::<f64>() / 4_294_967_296.0
        }
    }

    const END: f64 = 4_294_967_295.0;

    /// Lines, a step, a line of no width and nothing, which have no place in common: each channel is what it is alone.
    #[test]
    fn channels_of_a_quad_keep_their_values() {
        let channels: [&[(f64, f64)]; 4] = [
            &[(0.0, 1.0), (1e9, 3.0), (4e9, 0.0), (END, 0.5)],
            &[(0.0, 0.0), (2e9, 0.0), (2e9, 5.0), (3e9, 4.0), (END, 1.0)],
            &[(0.0, 0.25), (5e8, 0.25), (5e8, 9.0), (5e8, 0.25), (END, 0.25)],
            &[(0.0, 0.0), (END, 0.0)],
        ];
        let mut knots = Knots::new(2);
        knots.push(channels);
        knots.push([channels[3], channels[3], channels[3], channels[0]]);
        // 0, 5e8, 1e9, twice 2e9, 3e9, 4e9 and the end; and four.
        assert_eq!((knots.values.len(), knots.steps()), (8 + 4, 3));
        for (mu, expected) in [
            (0, [1.0, 0.0, 0.25, 0.0]),
            (500_000_000, [2.0, 0.0, 0.25, 0.0]),
            (1_500_000_000, [2.5, 0.0, 0.25, 0.0]),
            (1_999_999_999, [2.0, 0.0, 0.25, 0.0]),
            (2_000_000_000, [2.0, 5.0, 0.25, 0.0]),
            (2_500_000_000, [1.5, 4.5, 0.25, 0.0]),
            (u32::MAX, [0.5, 1.0, 0.25, 0.0]),
        ] {
            for (got, want) in knots.lookup(0, mu).into_iter().zip(expected) {
                assert!((f64::from(got) - want).abs() <= 1e-6 * want, "{mu}: {got}, {want}");
            }
            assert!((f64::from(knots.lookup(1, mu)[3]) - expected[0]).abs() <= 1e-6 * expected[0], "{mu}");
        }
    }
}
