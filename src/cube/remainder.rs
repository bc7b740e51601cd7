//! What of a factored cube does not separate: how large it is, and in which other channels it is known.

use super::journal::Journal;
use super::store::{Cube, Origin};
use crate::spectral::Channels;
use crate::{Error, Result};

/// Σ of the remainder and Σ of all radiance, over all pixels, per channel.
#[derive(Debug, Clone, PartialEq)]
pub struct RemainderShare {
    sum: Vec<f64>,
    of_all: Vec<f64>,
}

impl RemainderShare {
    /// Of nothing yet.
    pub fn none(channels: usize) -> RemainderShare {
        RemainderShare { sum: vec![0.0; channels], of_all: vec![0.0; channels] }
    }

    /// Adds sums over some pixels, per channel.
    pub fn add(&mut self, sum: &[f64], of_all: &[f64]) {
        self.sum.iter_mut().zip(sum).for_each(|(total, more)| *total += more);
        self.of_all.iter_mut().zip(of_all).for_each(|(total, more)| *total += more);
    }

    /// Of each channel; 0 where nothing shines.
    pub fn of_channels(&self) -> Vec<f64> {
        self.sum.iter().zip(&self.of_all).map(|(sum, all)| if *all > 0.0 { sum / all } else { 0.0 }).collect()
    }

    /// The channel in which it is largest, and what it is there; `None` where there is no channel.
    pub fn largest(&self) -> Option<(usize, f64)> {
        self.of_channels().into_iter().enumerate().max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)))
    }

    /// In the mean over channels.
    pub fn mean(&self) -> f64 {
        let all = self.of_channels();
        all.iter().sum::<f64>() / all.len().max(1) as f64
    }

    /// For people: in the mean, and where it is largest.
    pub fn describe(&self, channels: &Channels) -> String {
        match self.largest() {
            Some((k, most)) if self.of_channels().len() > 1 => format!(
                "{} of the radiance in the mean over channels, at most {} ({})",
                percent(self.mean()),
                percent(most),
                channels.names[k]
            ),
            _ => format!("{} of the radiance", percent(self.mean())),
        }
    }

    /// Of what shines in those rendered `channels` that share wavelengths with an interval; `None` where none does, or nothing shines.
    fn around(&self, channels: &Channels, [from, to]: [f64; 2]) -> Option<f64> {
        let overlap = (0..channels.len()).filter(|&k| channels.bounds[k][0] < to && channels.bounds[k][1] > from);
        let [sum, all] = overlap.fold([0.0; 2], |[sum, all], k| [sum + self.sum[k], all + self.of_all[k]]);
        (all > 0.0).then_some(sum / all)
    }
}

fn percent(share: f64) -> String {
    format!("{:.3} %", 100.0 * share)
}

impl Cube {
    /// How much of the cube does not separate, by the journals of its tiles; `None` where it has no remainder, or was copied without them.
    pub fn remainder_share(&self) -> Result<Option<RemainderShare>> {
        if !self.header().has_remainder() || *self.origin() == Origin::Copy {
            return Ok(None);
        }
        let mut share = RemainderShare::none(self.channels().len());
        for tile in 0..self.grid().count() {
            if let Some(of) = Journal::of(self, tile).last()?.and_then(|record| record.remainder) {
                share.add(&of.sum, &of.of_all);
            }
        }
        Ok(Some(share))
    }

    /// Per channel Σ over the pixels of a tile of the variance of the remainder's mean; `None` below two epochs, or without a journal.
    pub(super) fn remainder_variance(&self, tile: u32) -> Result<Option<Vec<f64>>> {
        let Some(record) = Journal::of(self, tile).last()? else { return Ok(None) };
        let epochs = f64::from(record.samples / self.header().epoch);
        let variance = |of: super::journal::OfRemainder| {
            of.spread.iter().map(|spread| spread.max(0.0) / (epochs * (epochs - 1.0))).collect()
        };
        Ok(record.remainder.filter(|_| epochs >= 2.0).map(variance))
    }
}

/// Channels made of those in which a remainder was rendered, each the mean of some by their widths.
pub(super) struct Unions(Vec<Vec<(usize, f64)>>);

impl Unions {
    /// What `wanted` is of the channels of `cube`.
    ///
    /// # Errors
    /// A channel that is no union of them: only the weights know what is between.
    pub fn of(cube: &Cube, wanted: &Channels) -> Result<Unions> {
        let there = cube.channels();
        let mut unions = Vec::with_capacity(wanted.len());
        for k in 0..wanted.len() {
            let Some(union) = union_of(there, wanted, k) else { return Err(refusal(cube, wanted, k)?) };
            unions.push(union);
        }
        Ok(Unions(unions))
    }

    /// Calls `each` with the channels of a pixel or tile, in place, and what of `rendered` is in them.
    pub fn each<T, V: Copy + Into<f64>>(&self, values: &mut [T], rendered: &[V], mut each: impl FnMut(&mut T, f64)) {
        for (value, union) in values.iter_mut().zip(&self.0) {
            each(value, union.iter().map(|&(k, share)| share * rendered[k].into()).sum());
        }
    }
}

fn refusal(cube: &Cube, wanted: &Channels, k: usize) -> Result<Error> {
    let share = cube.remainder_share()?.and_then(|share| share.around(cube.channels(), wanted.bounds[k]));
    let share = share.map_or_else(|| "an unknown share".to_owned(), percent);
    let [from, to] = wanted.bounds[k];
    Ok(Error::Usage(format!(
        "channel {k} ({}, {from} to {to} nm) is no union of channels that {} was rendered in, and {share} of the radiance there does not \
         separate ({}), which is known in those only: choose unions of them, or leave it out by --without-remainder",
        wanted.names[k],
        cube.path().display(),
        cube.header().remainder().join(", ")
    )))
}

/// Of which channels of `there` channel `k` of `wanted` is made, and by which shares.
fn union_of(there: &Channels, wanted: &Channels, k: usize) -> Option<Vec<(usize, f64)>> {
    let [from, to] = wanted.bounds[k];
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-9 * b.abs();
    let is_same = |i: usize| near(there.bounds[i][0], from) && near(there.bounds[i][1], to);
    if !wanted.responses.is_empty() || !there.responses.is_empty() {
        let is_same = |i: &usize| is_same(*i) && there.responses.get(*i) == wanted.responses.get(k);
        return (0..there.len()).find(is_same).map(|i| vec![(i, 1.0)]);
    }
    if let Some(i) = (0..there.len()).find(|&i| is_same(i)) {
        return Some(vec![(i, 1.0)]);
    }
    let mut inside: Vec<usize> = (0..there.len())
        .filter(|&i| there.bounds[i][0] >= from * (1.0 - 1e-9) && there.bounds[i][1] <= to * (1.0 + 1e-9))
        .collect();
    inside.sort_by(|&a, &b| there.bounds[a][0].total_cmp(&there.bounds[b][0]));
    // Channels that follow one another from `from` on: each with the one before it.
    let mut chains: Vec<(usize, Option<usize>)> = Vec::new();
    for i in inside {
        let [begin, end] = there.bounds[i];
        let before = chains.iter().rposition(|&(last, _)| near(there.bounds[last][1], begin));
        if before.is_none() && !near(begin, from) {
            continue;
        }
        chains.push((i, before));
        if near(end, to) {
            let mut union = Vec::new();
            let mut at = Some(chains.len() - 1);
            while let Some((i, before)) = at.map(|at| chains[at]) {
                union.push((i, (there.bounds[i][1] - there.bounds[i][0]) / (to - from)));
                at = before;
            }
            union.reverse();
            return Some(union);
        }
    }
    None
}

/// The share that is left out of each of `wanted`, as far as it is known from the channels rendered around it.
pub(super) fn left_out(cube: &Cube, wanted: &Channels) -> Result<Vec<Option<f64>>> {
    let share = cube.remainder_share()?;
    let of = |bounds: &[f64; 2]| share.as_ref().and_then(|share| share.around(cube.channels(), *bounds));
    Ok(wanted.bounds.iter().map(of).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectral::Response;

    #[test]
    fn unions_are_found_and_nothing_else() {
        let there = Channels::from_bounds(
            vec![[400.0, 410.0], [420.0, 450.0], [410.0, 420.0], [500.0, 600.0], [400.0, 430.0], [450.0, 500.0]],
            None,
        );
        let of = |bounds: [f64; 2]| union_of(&there, &Channels::from_bounds(vec![bounds], None), 0);
        assert_eq!(of([410.0, 420.0]), Some(vec![(2, 1.0)]));
        assert_eq!(of([400.0, 450.0]), Some(vec![(0, 0.2), (2, 0.2), (1, 0.6)]));
        assert_eq!(of([410.0, 600.0 * (1.0 + 1e-12)]).map(|union| union.len()), Some(4));
        for bounds in [[400.0, 415.0], [405.0, 420.0], [390.0, 450.0], [430.0, 450.0], [600.0, 700.0]] {
            assert_eq!(of(bounds), None, "{bounds:?}");
        }
        // A response is none but itself.
        let response = |peak: f64| Response::new(vec![400.0, 405.0, 410.0], vec![0.0, peak, 0.0]).expect("a response");
        let seen = |peak: f64| Channels::from_responses(vec![("r".to_owned(), response(peak))], None);
        assert_eq!(union_of(&seen(1.0), &seen(1.0), 0), Some(vec![(0, 1.0)]));
        assert_eq!(union_of(&seen(1.0), &seen(0.5), 0), None);
        assert_eq!(union_of(&there, &seen(1.0), 0), None);
        assert_eq!(union_of(&seen(1.0), &there, 0), None);
    }

    #[test]
    fn shares_are_those_of_sums() {
        let mut share = RemainderShare::none(3);
        share.add(&[1.0, 0.0, 2.0], &[2.0, 0.0, 8.0]);
        share.add(&[0.0, 0.0, 2.0], &[2.0, 0.0, 2.0]);
        assert_eq!(share.of_channels(), [0.25, 0.0, 0.4]);
        assert_eq!(share.largest(), Some((2, 0.4)));
        let channels = Channels::equal(400.0, 700.0, 3);
        assert_eq!(share.around(&channels, [450.0, 550.0]), Some(0.25));
        assert_eq!(share.around(&channels, [500.0, 600.0]), None);
        assert!(share.describe(&channels).contains("at most 40.000 % (650"), "{}", share.describe(&channels));
    }
}
