//! The pixels of a tile as weights of products of spectra ([`crate::spectral::product`]): what factored cubes hold in the place of
//! radiance.

mod expand;

use std::path::Path;

use smallvec::SmallVec;

pub use self::expand::{Entries, Expand, Processor, Rows};

use super::checksums;
use super::metadata::Header;
use crate::spectral::product::{Expander, Product};
use crate::{Error, Result};

/// Entries of a pixel that are kept, and for which a tile's file has room. Of more, the least are thinned out by chance.
const MOST_ENTRIES: usize = 71;
const ROOM: usize = 72;

/// Parts of the epochs whose weights are told apart: odd and even ones, or where standard errors are wanted eight.
pub const GROUPS: usize = 2;
pub const GROUPS_WITH_UNCERTAINTY: usize = 8;

/// A share of a weight is a multiple of this: enough for a spread, and what is 0 below compresses well.
const SHARE_STEPS: f64 = 16_384.0;

/// No product, or no factor.
const NONE: u16 = u16::MAX;
/// Columns of the array `weights` before the shares: pixel, product, weight.
const FIRST_SHARE: usize = 3;

/// Weights of the pixels of a tile, rows from the top, of the full tile size: means over all samples, and how much of them is of each
/// group of epochs.
#[derive(Debug, Clone, PartialEq)]
pub struct Weights {
    /// Ascending, each once.
    pub products: Vec<Product>,
    /// Where each pixel's entries begin, and the end of the last one's.
    starts: Vec<u32>,
    /// Of each entry: its place among the products, and its weight.
    product: Vec<u32>,
    weight: Vec<f32>,
    /// Of each entry the shares of all groups but the first: empty in what is one epoch.
    shares: Vec<f32>,
    groups: usize,
}

/// How many samples of a pixel are of each group, and how many whole epochs.
pub struct Groups {
    samples: Vec<f64>,
    epochs: Vec<u32>,
}

impl Groups {
    /// For `samples` of a cube with epochs of `epoch`, whose numbers modulo `groups` say to which they belong.
    pub fn new(samples: u32, epoch: u32, groups: usize) -> Groups {
        let whole = samples / epoch;
        let of = |group: u32| (whole + groups as u32 - 1 - group) / groups as u32;
        let epochs: Vec<u32> = (0..groups as u32).map(of).collect();
        let mut of_samples: Vec<f64> = epochs.iter().map(|&n| f64::from(n) * f64::from(epoch)).collect();
        of_samples[whole as usize % groups] += f64::from(samples % epoch);
        Groups { samples: of_samples, epochs }
    }

    fn total(&self) -> f64 {
        self.samples.iter().sum()
    }

    /// Those that have epochs, and how many.
    fn with_epochs(&self) -> impl Iterator<Item = (usize, u32)> {
        self.epochs.iter().copied().enumerate().filter(|(_, epochs)| *epochs > 0)
    }

    /// What the groups' squared distances from the mean, each times its epochs, are divided by; `None` below two epochs.
    fn divisor(&self) -> Option<f64> {
        let all: u32 = self.epochs.iter().sum();
        (all >= 2).then(|| (self.with_epochs().count() as f64 - 1.0) * f64::from(all))
    }
}

/// Which group the samples after the first `before` are of.
pub fn group_after(before: u32, epoch: u32, groups: usize) -> usize {
    (before / epoch) as usize % groups
}

impl Weights {
    /// From the products and weights of every pixel, in any order.
    pub fn of_pixels<I: Iterator<Item = (Product, f64)>>(pixels: impl Iterator<Item = I>) -> Weights {
        let mut starts = vec![0];
        let mut entries = Vec::new();
        for pixel in pixels {
            entries.extend(pixel);
            starts.push(entries.len() as u32);
        }
        let mut products: Vec<Product> = entries.iter().map(|(product, _)| product.clone()).collect();
        products.sort_unstable();
        products.dedup();
        let place = |product: &Product| products.binary_search(product).expect("collected above") as u32;
        let mut product: Vec<u32> = entries.iter().map(|(product, _)| place(product)).collect();
        let mut weight: Vec<f32> = entries.iter().map(|(_, weight)| *weight as f32).collect();
        for pixel in starts.windows(2) {
            let range = pixel[0] as usize..pixel[1] as usize;
            let mut sorted: Vec<(u32, f32)> =
                product[range.clone()].iter().copied().zip(weight[range.clone()].iter().copied()).collect();
            sorted.sort_unstable_by_key(|entry| entry.0);
            for (at, entry) in range.zip(sorted) {
                (product[at], weight[at]) = entry;
            }
        }
        Weights { products, starts, product, weight, shares: Vec::new(), groups: 1 }
    }

    pub fn pixels(&self) -> usize {
        self.starts.len() - 1
    }

    fn entries(&self, pixel: usize) -> std::ops::Range<usize> {
        self.starts[pixel] as usize..self.starts[pixel + 1] as usize
    }

    /// Entries of all pixels.
    pub fn len(&self) -> usize {
        self.weight.len()
    }

    pub fn is_empty(&self) -> bool {
        self.weight.is_empty()
    }

    /// A unit as the first one of a tile: all of it is of group 0, which the first epoch is of.
    fn alone(self, groups: usize) -> Weights {
        let shares = vec![0.0; self.len() * (groups - 1)];
        Weights { shares, groups, ..self }
    }

    /// `base`, the mean of `n_before` samples, with `unit`, that of `n_unit` more, of group `group`.
    pub fn merged(
        base: Option<&Weights>,
        n_before: u32,
        unit: &Weights,
        n_unit: u32,
        group: usize,
        groups: usize,
    ) -> Weights {
        let Some(base) = base else { return unit.clone().alone(groups) };
        let products = union(&base.products, &unit.products);
        let (of_base, of_unit) = (places(&base.products, &products), places(&unit.products, &products));
        let (before, added) = (f64::from(n_before), f64::from(n_unit));
        let after = before + added;
        let others = groups - 1;
        let mut merged = Weights {
            products: Vec::new(),
            starts: vec![0],
            product: Vec::with_capacity(base.len() + unit.len()),
            weight: Vec::with_capacity(base.len() + unit.len()),
            shares: Vec::with_capacity((base.len() + unit.len()) * others),
            groups,
        };
        let mut sums = vec![0.0f64; groups];
        for pixel in 0..base.pixels() {
            let (mut a, mut b) = (base.entries(pixel), unit.entries(pixel));
            while !a.is_empty() || !b.is_empty() {
                let place_a = a.clone().next().map_or(u32::MAX, |i| of_base[base.product[i] as usize]);
                let place_b = b.clone().next().map_or(u32::MAX, |i| of_unit[unit.product[i] as usize]);
                let place = place_a.min(place_b);
                sums.fill(0.0);
                let (mut old, mut new) = (0.0, 0.0);
                if place_a == place {
                    let i = a.next().expect("not empty");
                    old = f64::from(base.weight[i]);
                    let shares = &base.shares[i * others..(i + 1) * others];
                    let mut first = 1.0;
                    for (sum, &share) in sums[1..].iter_mut().zip(shares) {
                        *sum = f64::from(share) * old * before;
                        first -= f64::from(share);
                    }
                    sums[0] = first * old * before;
                }
                if place_b == place {
                    let i = b.next().expect("not empty");
                    new = f64::from(unit.weight[i]);
                    sums[group] += new * added;
                }
                let weight = (old + (new - old) * (added / after)) as f32;
                if weight == 0.0 {
                    continue;
                }
                merged.product.push(place);
                merged.weight.push(weight);
                let total: f64 = sums.iter().sum();
                merged
                    .shares
                    .extend(sums[1..].iter().map(|sum| ((sum / total * SHARE_STEPS).round() / SHARE_STEPS) as f32));
            }
            merged.starts.push(merged.weight.len() as u32);
        }
        merged.products = products;
        merged
    }

    /// Without what is of which group of epochs: means alone.
    pub(super) fn without_shares(self) -> Weights {
        Weights { shares: Vec::new(), groups: 1, ..self }
    }

    /// Each entry of a pixel: the place of its product, and its weight.
    pub(super) fn of_pixel(&self, pixel: usize) -> impl Iterator<Item = (usize, f32)> + '_ {
        self.entries(pixel).map(|i| (self.product[i] as usize, self.weight[i]))
    }

    /// Bytes that it takes in memory.
    pub(super) fn bytes(&self) -> u64 {
        let of_products = size_of::<Product>() * self.products.len();
        (of_products + 4 * (self.starts.len() + self.product.len() + self.weight.len() + self.shares.len())) as u64
    }

    /// The same among `products`, which must hold all of its own.
    fn over(mut self, products: &[Product]) -> Weights {
        let places = places(&self.products, products);
        self.product.iter_mut().for_each(|product| *product = places[*product as usize]);
        Weights { products: products.to_vec(), ..self }
    }

    /// Thins out pixels of more entries than are kept: those that matter least, with the same mean, by numbers that depend on the
    /// pixel and its samples only.
    pub fn thinned(self, importances: &[f64], tile: [u32; 2], at: [u32; 2], samples: u32) -> Weights {
        let others = self.groups - 1;
        let is_full = |pixel: usize| self.entries(pixel).len() > MOST_ENTRIES;
        if !(0..self.pixels()).any(is_full) {
            return self;
        }
        let mut thinned = Weights {
            products: Vec::new(),
            starts: vec![0],
            product: Vec::with_capacity(self.len()),
            weight: Vec::with_capacity(self.len()),
            shares: Vec::with_capacity(self.shares.len()),
            groups: self.groups,
        };
        for pixel in 0..self.pixels() {
            let entries = self.entries(pixel);
            let first = entries.start;
            let matters = |i: usize| f64::from(self.weight[i]).abs() * importances[self.product[i] as usize];
            let kept = if is_full(pixel) {
                let column = at[0] + pixel as u32 % tile[0];
                let row = at[1] + pixel as u32 / tile[0];
                let random = super::random_of([column, row, samples, 2]);
                systematic(&entries.map(matters).collect::<Vec<f64>>(), MOST_ENTRIES, random)
            } else {
                (0..entries.len()).map(|i| (i, 1.0)).collect()
            };
            for (i, factor) in kept {
                thinned.product.push(self.product[first + i]);
                thinned.weight.push((f64::from(self.weight[first + i]) * factor) as f32);
                thinned.shares.extend(&self.shares[(first + i) * others..(first + i + 1) * others]);
            }
            thinned.starts.push(thinned.weight.len() as u32);
        }
        Weights { products: self.products, ..thinned }
    }

    /// Without products of which there is no entry.
    pub fn compacted(mut self) -> Weights {
        let mut is_used = vec![false; self.products.len()];
        self.product.iter().for_each(|&product| is_used[product as usize] = true);
        let mut place = 0;
        let places: Vec<u32> = is_used
            .iter()
            .map(|&used| {
                place += u32::from(used);
                place.wrapping_sub(1)
            })
            .collect();
        self.product.iter_mut().for_each(|product| *product = places[*product as usize]);
        let mut used = is_used.iter();
        self.products.retain(|_| *used.next().expect("one for each"));
        self
    }

    /// The radiance of a pixel, Σ weight x row of its product; `rows` as [`Expander::rows`] makes them.
    pub fn expand(&self, pixel: usize, rows: &[f32], out: &mut [f32]) {
        out.fill(0.0);
        let channels = out.len();
        for (product, weight) in self.of_pixel(pixel) {
            let row = &rows[product * channels..][..channels];
            out.iter_mut().zip(row).for_each(|(out, value)| *out += weight * value);
        }
    }

    /// The radiance of one pixel alone, with no more spectra made than it has.
    pub fn spectrum(&self, pixel: usize, expander: &Expander) -> Vec<f32> {
        let own: Vec<Product> = self.entries(pixel).map(|i| self.products[self.product[i] as usize].clone()).collect();
        let rows = expander.rows(&own);
        let of_pixel = Weights {
            starts: vec![0, own.len() as u32],
            product: (0..own.len() as u32).collect(),
            weight: self.weight[self.entries(pixel)].to_vec(),
            products: own,
            shares: Vec::new(),
            groups: 1,
        };
        let mut out = vec![0.0; expander.channels()];
        of_pixel.expand(0, &rows, &mut out);
        out
    }

    /// The weight that an entry has by the samples of a group alone; all groups have `total` samples.
    fn weight_in(&self, entry: usize, group: usize, groups: &Groups, total: f64) -> f32 {
        let others = self.groups - 1;
        let shares = &self.shares[entry * others..(entry + 1) * others];
        let share = if group == 0 { 1.0 - shares.iter().sum::<f32>() } else { shares[group - 1] };
        (f64::from(self.weight[entry] * share) * total / groups.samples[group]) as f32
    }

    /// How much each product matters.
    pub fn importances(&self, expander: &Expander, rows: &[f32]) -> Vec<f64> {
        let rows = rows.chunks(expander.channels().max(1));
        self.products.iter().zip(rows).map(|(product, row)| expander.importance(product, row)).collect()
    }

    /// The files of a tile: `weights` and `products`.
    pub fn encode(&self, header: &Header) -> std::io::Result<[Vec<u8>; 2]> {
        let shape = Shape::of(header);
        if self.len() > shape.entries {
            return Err(std::io::Error::other(format!("{} entries are more than {}", self.len(), shape.entries)));
        }
        let mut columns = vec![0.0f32; shape.entries * shape.columns];
        let mut of = columns.chunks_mut(shape.entries);
        let mut column = || of.next().expect("as many columns");
        let pixels = column();
        for pixel in 0..self.pixels() {
            pixels[self.entries(pixel)].fill(pixel as f32);
        }
        column().iter_mut().zip(&self.product).for_each(|(out, &product)| *out = product as f32);
        column()[..self.len()].copy_from_slice(&self.weight);
        let others = self.groups - 1;
        for group in 0..others {
            let shares = self.shares.iter().skip(group).step_by(others);
            column().iter_mut().zip(shares).for_each(|(out, &share)| *out = share);
        }
        let mut products = vec![NONE; shape.entries * shape.width];
        for (row, product) in products.chunks_mut(shape.width).zip(&self.products) {
            row[0] = product.source;
            row[1..][..product.factors.len()].copy_from_slice(&product.factors);
        }
        let products = compress(bytemuck::cast_slice(&products))?;
        // Behind the last entry there is room: by this they are known to belong together.
        for (column, part) in tag(&products).into_iter().enumerate() {
            columns[(column + 1) * shape.entries - 1] = part;
        }
        Ok([compress(bytemuck::cast_slice(&columns))?, products])
    }

    /// What [`Weights::encode`] wrote; `None` where one of both is of another time. Errors: anything else, with the path and what is
    /// wrong.
    pub fn decode(header: &Header, files: [(&Path, &[u8]); 2]) -> Result<Option<Weights>> {
        let shape = Shape::of(header);
        let [(path, weights), (products_path, products)] = files;
        let damaged = |path: &Path, what: &str| Error::storage(path, format!("is damaged: {what}"));
        let decompress = |path: &Path, bytes: &[u8], size: usize| {
            let plain = zstd::bulk::decompress(bytes, size).map_err(|error| damaged(path, &error.to_string()))?;
            if plain.len() == size { Ok(plain) } else { Err(damaged(path, "it is not as long as it must be")) }
        };
        let columns = decompress(path, weights, 4 * shape.entries * shape.columns)?;
        let columns: Vec<f32> = bytemuck::pod_collect_to_vec(&columns);
        if tag(products).iter().enumerate().any(|(i, part)| columns[(i + 1) * shape.entries - 1] != *part) {
            return Ok(None);
        }
        let rows = decompress(products_path, products, 2 * shape.entries * shape.width)?;
        let rows: Vec<u16> = bytemuck::pod_collect_to_vec(&rows);
        let column = |i: usize| &columns[i * shape.entries..(i + 1) * shape.entries];
        let count = column(2).iter().position(|weight| *weight == 0.0).unwrap_or(shape.entries);
        let rows = rows.chunks(shape.width).take_while(|row| row[0] != NONE);
        let products: Vec<Product> = rows
            .map(|row| {
                let factors: SmallVec<[u16; 8]> =
                    row[1..].iter().copied().take_while(|&factor| factor != NONE).collect();
                Product { factors, source: row[0] }
            })
            .collect();
        let [factors, sources] = header.basis_size();
        let is_known = |product: &Product| {
            usize::from(product.source) < sources && product.factors.iter().all(|&factor| usize::from(factor) < factors)
        };
        if !products.iter().all(is_known) {
            return Err(damaged(products_path, "it names spectra that the cube does not have"));
        }
        let pixels = header.grid().tile_pixels();
        let mut starts = vec![0u32; pixels + 1];
        let product: Vec<u32> = column(1)[..count].iter().map(|&place| place as u32).collect();
        let are_places = |column: &[f32], end: usize| {
            column[..count].iter().all(|place| place.fract() == 0.0 && (0.0..end as f32).contains(place))
        };
        let ascend = column(0)[..count].is_sorted() && are_places(column(0), pixels);
        if !ascend || !are_places(column(1), products.len()) {
            return Err(damaged(path, "an entry is of no pixel or no product"));
        }
        column(0)[..count].iter().for_each(|&pixel| starts[pixel as usize + 1] += 1);
        (0..pixels).for_each(|pixel| starts[pixel + 1] += starts[pixel]);
        let groups = shape.columns - FIRST_SHARE + 1;
        let shares =
            (0..count).flat_map(|i| (0..groups - 1).map(move |group| column(FIRST_SHARE + group)[i])).collect();
        let weight = column(2)[..count].to_vec();
        Ok(Some(Weights { products, starts, product, weight, shares, groups }))
    }
}

/// All of both, ascending.
fn union(a: &[Product], b: &[Product]) -> Vec<Product> {
    let mut all = [a, b].concat();
    all.sort_unstable();
    all.dedup();
    all
}

/// Where those of `own` are among `all`, which has them.
fn places(own: &[Product], all: &[Product]) -> Vec<u32> {
    own.iter().map(|product| all.binary_search(product).expect("all has it") as u32).collect()
}

/// A tile before and after a unit, all among the same products, and their means over the cube's channels.
pub struct Merging {
    pub old: Option<Weights>,
    pub unit: Weights,
    pub merged: Weights,
    /// As [`Expander::rows`] makes them.
    pub rows: Vec<f32>,
}

impl Merging {
    /// `unit`, of `n_unit` samples after `n_before`, with what is there; `at`: column and row of the tile on the full film.
    pub fn new(
        header: &Header,
        expander: &Expander,
        at: [u32; 2],
        old: Option<Weights>,
        n_before: u32,
        unit: Weights,
        n_unit: u32,
    ) -> Merging {
        let (groups, group) = (header.groups(), group_after(n_before, header.epoch, header.groups()));
        let products = union(old.as_ref().map_or(&[], |old| &old.products), &unit.products);
        let rows = expander.rows(&products);
        let (old, unit) = (old.map(|old| old.over(&products)), unit.over(&products));
        let merged = Weights::merged(old.as_ref(), n_before, &unit, n_unit, group, groups);
        let importances = merged.importances(expander, &rows);
        let merged = merged.thinned(&importances, header.tile, at, n_before + n_unit);
        Merging { old, unit, merged, rows }
    }
}

/// 48 bits of a file's checksum, as numbers that are exact in f32.
fn tag(file: &[u8]) -> [f32; 2] {
    let sum = checksums::of(file) as u64;
    [sum & 0xff_ffff, sum >> 24 & 0xff_ffff].map(|part| part as f32)
}

fn compress(bytes: &[u8]) -> std::io::Result<Vec<u8>> {
    let mut compressor = zstd::bulk::Compressor::new(ZSTD_LEVEL)?;
    // What is damaged must not be read as something else.
    compressor.include_checksum(true)?;
    compressor.compress(bytes)
}

/// Of the codec `zstd`, in metadata too.
pub const ZSTD_LEVEL: i32 = 3;

/// The arrays of a tile.
pub struct Shape {
    pub entries: usize,
    /// Of `weights`.
    pub columns: usize,
    /// Of a row of `products`.
    pub width: usize,
}

impl Shape {
    /// What a pixel takes with as many entries as are kept, compressed: pixels follow each other, and shares are short.
    pub fn entry_bytes(&self) -> u64 {
        (ROOM * (6 + 3 * (self.columns - FIRST_SHARE))) as u64
    }

    pub fn of(header: &Header) -> Shape {
        let groups = header.groups();
        Shape {
            entries: header.grid().tile_pixels() * ROOM,
            columns: FIRST_SHARE + groups - 1,
            width: 1 + header.most_factors().max(1),
        }
    }
}

/// Of things that matter so much, at most so many, chosen so that each one's mean stays what it is: what stays and by what it is
/// multiplied. Those that matter most always stay; the others by systematic sampling, in their order.
pub fn systematic(importances: &[f64], most: usize, random: u64) -> Vec<(usize, f64)> {
    if importances.len() <= most {
        return (0..importances.len()).map(|i| (i, 1.0)).collect();
    }
    let mut order: Vec<usize> = (0..importances.len()).collect();
    order.sort_by(|&a, &b| importances[b].total_cmp(&importances[a]).then(a.cmp(&b)));
    let mut rest: f64 = importances.iter().sum();
    let mut certain = 0;
    // The largest that would have a chance above 1.
    while certain < most && importances[order[certain]] * (most - certain) as f64 >= rest {
        rest -= importances[order[certain]];
        certain += 1;
    }
    // What rounding left of the sum must not make a chance.
    let rest: f64 = order[certain..].iter().map(|&i| importances[i]).sum();
    let spacing = rest / (most - certain) as f64;
    let mut stays = vec![0.0; importances.len()];
    order[..certain].iter().for_each(|&i| stays[i] = 1.0);
    if spacing > 0.0 {
        let mut next = spacing * ((random >> 11) as f64 / (1u64 << 53) as f64);
        let mut sum = 0.0;
        let mut left = most - certain;
        let mut others = order[certain..].to_vec();
        others.sort_unstable();
        for i in others {
            sum += importances[i];
            if sum > next && left > 0 {
                stays[i] = spacing / importances[i];
                next += spacing;
                left -= 1;
            }
        }
    }
    stays.into_iter().enumerate().filter(|(_, factor)| *factor > 0.0).collect()
}

#[cfg(test)]
mod tests {
    use super::super::grid::Rect;
    use super::*;

    fn product(source: u16, factors: &[u16]) -> Product {
        Product { factors: SmallVec::from_slice(factors), source }
    }

    /// Chances are those asked for, and no more stay than may.
    #[test]
    fn systematic_choices_keep_every_mean() {
        let importances = [5.0, 0.3, 0.2, 0.9, 0.05, 0.45, 0.1, 2.0, 0.6, 0.4];
        const TURNS: u32 = 20_000;
        let mut means = [0.0; 10];
        for turn in 0..TURNS {
            let kept = systematic(&importances, 5, super::super::random_of([turn, 7, 1, 0]));
            assert!(kept.len() <= 5, "{kept:?}");
            assert!([0, 7].iter().all(|certain| kept.contains(&(*certain, 1.0))), "{kept:?}");
            kept.iter().for_each(|(i, factor)| means[*i] += factor / f64::from(TURNS));
        }
        for (i, mean) in means.iter().enumerate() {
            // Of three places, the chance of i is p: variance (1 - p) / p of 1 / p.
            let p = (importances[i] / 1.0).min(1.0);
            let bound = 5.0 * ((1.0 - p) / p / f64::from(TURNS)).sqrt() + 1e-12;
            assert!((mean - 1.0).abs() < bound, "{i}: {mean}");
        }
    }

    #[test]
    fn groups_count_their_epochs() {
        let groups = Groups::new(64 * 11, 64, 8);
        assert_eq!(groups.epochs, [2, 2, 2, 1, 1, 1, 1, 1]);
        assert_eq!(Groups::new(24, 64, 2).samples, [24.0, 0.0]);
        assert_eq!(Groups::new(24, 64, 2).epochs, [0, 0]);
        assert_eq!([0, 32, 64, 64 * 9].map(|before| group_after(before, 64, 8)), [0, 0, 1, 1]);
    }

    /// Merging is the mean of all samples, and of each group's.
    #[test]
    fn merged_weights_are_means() {
        let pixel =
            |entries: &[(Product, f64)]| Weights::of_pixels([entries.iter().cloned(), [].iter().cloned()].into_iter());
        let (a, b, c) = (product(0, &[]), product(1, &[0, 2]), product(0, &[1]));
        let first = pixel(&[(b.clone(), 3.0), (a.clone(), 1.0)]);
        assert_eq!(first.products, [a.clone(), b.clone()]);
        let mut all = Weights::merged(None, 0, &first, 64, 0, 2);
        for (n, unit) in [(1u32, pixel(&[(c.clone(), 8.0), (a.clone(), 3.0)])), (2, pixel(&[(a.clone(), 2.0)]))] {
            all = Weights::merged(Some(&all), 64 * n, &unit, 64, group_after(64 * n, 64, 2), 2);
        }
        let rows = [1.0f32, 10.0, 100.0];
        assert_eq!(all.products, [a, b, c]);
        let mut out = [0.0f32];
        all.expand(0, &rows, &mut out);
        assert!((out[0] - (2.0 + 30.0 / 3.0 + 800.0 / 3.0)).abs() < 1e-4, "{out:?}");
        all.expand(1, &rows, &mut out);
        assert_eq!(out, [0.0]);
        // Group 0: two epochs, means 1.5 and 1.5 of b's 10; group 1: one, 3 and 8 of c's 100.
        let (picture, groups) = (Rect { x0: 0, y0: 0, x1: 2, y1: 1 }, Groups::new(192, 64, 2));
        let errors = all.standard_errors(Rows::Made(&rows, 1), [2, 1], picture, &groups);
        let (m0, m1) = (1.5 + 15.0, 3.0 + 800.0);
        let m = (2.0 * m0 + m1) / 3.0;
        let want = ((2.0 * (m0 - m) * (m0 - m) + (m1 - m) * (m1 - m)) / 3.0f64).sqrt();
        assert!((f64::from(errors[0]) / want - 1.0).abs() < 1e-4, "{errors:?} {want}");
        assert_eq!(errors[1], 0.0);
    }
}
