//! Temperatures of a texture as sources of products: what a body sends at a temperature is interpolated between what it sends at two
//! *nodes*, which know no place.

use crate::spectral::{Channels, planck};

/// The most that what is interpolated is off, relative to what is sent at that temperature: 1e-4, a little of which is left to wavelengths
/// between those that are looked at.
const BOUND: f64 = 0.9e-4;
/// Steps by which the next node is searched for.
const HALVINGS: usize = 16;

/// Temperatures, ascending, each with the number of its source.
#[derive(Debug, Clone, PartialEq)]
pub struct Nodes {
    kelvin: Vec<f64>,
    sources: Vec<u16>,
}

impl Nodes {
    pub fn new(sources: Vec<u16>, kelvin: Vec<f64>) -> Nodes {
        assert_eq!(sources.len(), kelvin.len());
        Nodes { kelvin, sources }
    }

    /// Two sources and how much of each is sent at a temperature. A single node is every temperature.
    pub fn at(&self, kelvin: f64) -> [(f64, u16); 2] {
        let last = self.kelvin.len() - 1;
        let above = self.kelvin.partition_point(|node| *node < kelvin).min(last);
        let below = above.checked_sub(1);
        // Nothing is sent at 0 K, which is no node.
        let low = below.map_or(0.0, |below| self.kelvin[below]);
        let share = if last == 0 { 1.0 } else { ((kelvin - low) / (self.kelvin[above] - low)).min(1.0) };
        let of_lower = below.map_or((0.0, self.sources[above]), |below| (1.0 - share, self.sources[below]));
        [of_lower, (share, self.sources[above])]
    }
}

/// Nodes for temperatures from `least` to `most` kelvin, so few that chords between them are right to [`BOUND`] in the range of `channels`.
/// Where `least` is 0 there is none for that.
pub fn between(least: f64, most: f64, channels: &Channels) -> Vec<f64> {
    let Some(range) = channels.hull().filter(|_| most > 0.0) else { return vec![most] };
    let is_right = |from: f64, to: f64| planck::chord_error(range, [from, to], most) <= BOUND;
    let mut nodes = vec![most];
    loop {
        let upper = nodes[nodes.len() - 1];
        if upper <= least {
            break;
        }
        if is_right(least, upper) {
            nodes.extend((least > 0.0).then_some(least));
            break;
        }
        let [mut right, mut wrong] = [upper, least];
        for _ in 0..HALVINGS {
            let middle = 0.5 * (right + wrong);
            *(if is_right(middle, upper) { &mut right } else { &mut wrong }) = middle;
        }
        // Beside rounding a step is there always.
        nodes.push(right.min(upper * (1.0 - 1e-6)));
    }
    nodes.reverse();
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_between_nodes_is_right_to_the_bound() {
        for (least, most, [from, to], count) in [
            (250.0, 350.0, [3e3, 14e3], 20..200),
            (0.0, 350.0, [8e3, 12e3], 20..500),
            (500.0, 2500.0, [400.0, 5e3], 100..2000),
        ] {
            let channels = Channels::equal(from, to, 10);
            let kelvin = between(least, most, &channels);
            assert!(kelvin.is_sorted() && count.contains(&kelvin.len()), "{} nodes", kelvin.len());
            assert_eq!(kelvin[kelvin.len() - 1], most);
            let nodes = Nodes::new((0..kelvin.len() as u16).collect(), kelvin.clone());
            for i in 0..=5000 {
                let t = least + (most - least) * f64::from(i) / 5000.0;
                for nm in [from, (from * to).sqrt(), to] {
                    let sent = |(share, node): (f64, u16)| share * planck::radiance(nm, kelvin[usize::from(node)]);
                    let [got, want] = [nodes.at(t).into_iter().map(sent).sum::<f64>(), planck::radiance(nm, t)];
                    let bound = 1.05e-4 * want.max(1e-3 * planck::radiance(nm, most));
                    assert!((got - want).abs() <= bound, "{t} K, {nm} nm: {got} {want}");
                }
            }
        }
    }

    #[test]
    fn nodes_themselves_are_exact() {
        let nodes = Nodes::new(vec![7, 8, 9], vec![200.0, 300.0, 400.0]);
        assert_eq!(nodes.at(300.0), [(0.0, 7), (1.0, 8)]);
        assert_eq!(nodes.at(350.0), [(0.5, 8), (0.5, 9)]);
        assert_eq!(nodes.at(400.00001)[1], (1.0, 9));
        assert_eq!(nodes.at(100.0), [(0.0, 7), (0.5, 7)]);
        let single = Nodes::new(vec![3], vec![300.0]);
        assert_eq!(single.at(299.0), [(0.0, 3), (1.0, 3)]);
    }
}
