//! What factored renders make of records: for each pixel the weights of the products of spectra that its paths bring
//! ([`crate::spectral::product`]). A path's records are read as `common/records.wgsl` reads them, with products in the place of
//! channels; nothing here knows a wavelength.
//!
//! Products are numbered as they are met, by each thread for itself; what a unit returns is in an order of its own, so that no bit
//! depends on who met what first.

use std::collections::HashMap;

use rayon::prelude::*;
use smallvec::{SmallVec, smallvec};

use crate::cube::{Weights, random_of, systematic};
use crate::device::instructions::{
    FIRST_RAW_OP, MODE_ADD, MODE_ADVANCE, MODE_GATHER, MODE_KEEP, MODE_ON_F, MODE_START, OP_ABSORBED, OP_AMOUNTS,
    OP_HELD, OP_HOLD, OP_INNER, OP_MAP, OP_MARCH, OP_MEDIUM, OP_PLAIN, OP_PLANCK, OP_RESTORE, OP_SAVE, OP_SPECTRUM,
};
use crate::device::prepared::Prepared;
use crate::device::separable::{Factor, Mixed, Separable};
use crate::device::words::{Counters, Wave};
use crate::render::worker::UnitRect;
use crate::spectral::product::Product;

/// Not met yet.
const UNKNOWN: u32 = u32::MAX;
/// Numbers in a thread's tables, beyond which it forgets what it has met: rooms of many paints have millions of sets.
const MOST_KNOWN: usize = 1 << 24;
/// Terms that a path's throughput may be a sum of; of more (mixtures upon mixtures) some are chosen by their weights.
const MOST_TERMS: usize = 16;

type Factors = SmallVec<[u16; 8]>;

/// A part of what a register holds: a weight, times factors, times a source, if what is emitted by place has brought one.
#[derive(Debug, Clone, PartialEq)]
struct Part {
    weight: f64,
    factors: Factors,
    source: Option<u16>,
}

impl Part {
    const ONE: Part = Part { weight: 1.0, factors: SmallVec::new_const(), source: None };

    fn of(weight: f64, factor: Option<u16>) -> Part {
        Part { weight, factors: factor.into_iter().collect(), source: None }
    }

    fn times(&self, weight: f64, other: &Part) -> Part {
        let mut both = self.clone();
        both.weight *= weight * other.weight;
        both.factors.extend_from_slice(&other.factors);
        // Light has one source; nothing that is multiplied brings two.
        both.source = self.source.or(other.source);
        both
    }
}

/// The value of an instruction.
enum Value {
    /// 1, or what is in no product.
    One,
    Factor(u16),
    Sum(SmallVec<[Part; 4]>),
}

/// The products that a thread has met. A state is a set of factors, each as often as it multiplies; few are ever met.
struct Met {
    factors: usize,
    sources: usize,
    sets: Vec<Factors>,
    known: HashMap<Factors, u32>,
    /// [state][factor]: the state behind one more factor.
    next: Vec<u32>,
    /// [state][source]: the number of a product.
    numbers: Vec<u32>,
    /// Of each product: state, source.
    products: Vec<(u32, u16)>,
}

/// A thread that walks records: what it has met, and the weights of the pixel that it is at.
struct Walker {
    met: Met,
    /// By product; those of `touched` are not zero, or were.
    weights: Vec<f64>,
    touched: Vec<u32>,
    // Of general scenes: T, P, F, H and Q (`device::instructions`) as sums. T has met what it is made of: weights and states.
    throughput: Vec<(f64, u32)>,
    saved: Vec<(f64, u32)>,
    product: SmallVec<[Part; 2]>,
    factor: Vec<Part>,
    held: Vec<Part>,
    kept: SmallVec<[(f64, Option<u16>); 4]>,
    tally: Tally,
}

/// What a thread has seen beside weights.
#[derive(Debug, Clone, Copy, Default)]
struct Tally {
    /// Paths that ended in this wave.
    ended: u32,
    non_finite: u32,
    /// Slot and sample of a weight that is not finite.
    bad: Option<(u32, u32)>,
}

/// Units that are rendered together.
#[derive(Default)]
struct Group {
    units: Vec<UnitRect>,
    samples: u32,
    /// Of each pixel slot, numbers of products, of the walker that has the slot, and sums of weights.
    pixels: Vec<Vec<(u32, f64)>>,
    tally: Tally,
    last_wave: u32,
}

/// Reads what the waves of a device leave.
pub struct Gather {
    walkers: Vec<Walker>,
    groups: Vec<Group>,
    tile: [u32; 2],
    max_records: usize,
    is_general: bool,
}

/// A wave as it came back.
pub struct Saved<'a> {
    pub wave: &'a Wave,
    /// Two words a path.
    pub heads: &'a [u32],
    /// [path][record], of 2 or 4 words.
    pub records: &'a [u32],
}

impl Met {
    fn new(scene: &Separable) -> Met {
        let [sources, factors] = scene.counts;
        Met::of(factors, sources)
    }

    fn empty(&self) -> Met {
        Met::of(self.factors, self.sources)
    }

    fn of(factors: usize, sources: usize) -> Met {
        let mut met = Met {
            factors,
            sources,
            sets: Vec::new(),
            known: HashMap::new(),
            next: Vec::new(),
            numbers: Vec::new(),
            products: Vec::new(),
        };
        met.state(Factors::new());
        met
    }

    /// The state of a set, which ascends.
    fn state(&mut self, set: Factors) -> u32 {
        if let Some(&known) = self.known.get(&set) {
            return known;
        }
        let state = self.sets.len() as u32;
        self.sets.push(set.clone());
        self.known.insert(set, state);
        self.next.resize(self.next.len() + self.factors, UNKNOWN);
        self.numbers.resize(self.numbers.len() + self.sources, UNKNOWN);
        state
    }

    fn behind(&mut self, state: u32, factor: u16) -> u32 {
        let at = state as usize * self.factors + usize::from(factor);
        if self.next[at] == UNKNOWN {
            let mut set = self.sets[state as usize].clone();
            set.insert(set.partition_point(|&other| other <= factor), factor);
            self.next[at] = self.state(set);
        }
        self.next[at]
    }

    fn number(&mut self, state: u32, source: u16) -> u32 {
        let at = state as usize * self.sources + usize::from(source);
        if self.numbers[at] == UNKNOWN {
            self.numbers[at] = self.products.len() as u32;
            self.products.push((state, source));
        }
        self.numbers[at]
    }

    /// The number of a product, met or not.
    fn number_of(&mut self, product: Product) -> u32 {
        let state = self.state(product.factors);
        self.number(state, product.source)
    }

    fn product(&self, number: u32) -> Product {
        let (state, source) = self.products[number as usize];
        Product { factors: self.sets[state as usize].clone(), source }
    }
}

impl Walker {
    fn add(&mut self, weight: f64, state: u32, sources: &[u16]) {
        for &source in sources {
            let number = self.met.number(state, source);
            if number as usize >= self.weights.len() {
                self.weights.resize(number as usize + 1, 0.0);
            }
            let sum = &mut self.weights[number as usize];
            if *sum == 0.0 {
                self.touched.push(number);
            }
            *sum += weight;
        }
    }

    /// A path of a plain scene: records of factor, source and weight. False where a weight is not finite.
    fn plain(&mut self, scene: &Separable, records: &[u32]) -> bool {
        let mut state = 0;
        for record in records.chunks_exact(2) {
            let (factor, source) = ((record[0] & 0xffff) as usize, (record[0] >> 16) as usize);
            if let Some(factor) = scene.factors[factor].of_product() {
                state = self.met.behind(state, factor);
            }
            let weight = f32::from_bits(record[1]);
            if !weight.is_finite() {
                return false;
            }
            if let Some(sources) = scene.sources[source].as_ref().filter(|_| weight != 0.0) {
                self.add(f64::from(weight), state, sources);
            }
        }
        true
    }

    /// A path of a general scene: a small program on sums of products. What it brings by registers that hold something else is evaluated
    /// on the device.
    fn general(&mut self, scene: &Separable, records: &[u32], random: u64) -> bool {
        self.throughput.clear();
        self.throughput.push((1.0, 0));
        self.factor.clear();
        self.kept.clear();
        let mut mixed = Mixed::NOTHING;
        let mut places = (0..records.len() / 4).fuse();
        while let Some(place) = places.next() {
            let record: [u32; 4] = std::array::from_fn(|i| records[4 * place + i]);
            let [word, spectra, ..] = record;
            let operation = word & 0x3f;
            // Records of numbers.
            let numbers = if operation == OP_MARCH { 2 } else { usize::from(operation >= FIRST_RAW_OP) };
            (0..numbers).for_each(|_| _ = places.next());
            let is_remainder = mixed.step(scene, record);
            if mixed.is_settled() {
                break;
            }
            match operation {
                OP_SAVE => self.saved.clone_from(&self.throughput),
                OP_RESTORE => self.throughput.clone_from(&self.saved),
                OP_HOLD => self.held = std::mem::take(&mut self.factor),
                OP_AMOUNTS if word & MODE_GATHER != 0 => self.factor.clear(),
                _ => {}
            }
            if matches!(operation, OP_MEDIUM | OP_MARCH | OP_AMOUNTS | OP_SAVE | OP_RESTORE | OP_HOLD) {
                continue;
            }
            let weight = f32::from_bits(record[2]);
            if !weight.is_finite() && !mixed.throughput {
                return false;
            }
            let weight = f64::from(weight);
            let factor = match operation {
                OP_PLAIN | OP_SPECTRUM => scene.factor(spectra),
                _ => Factor::One,
            };
            if word & MODE_KEEP != 0 {
                self.kept.push((weight, factor.of_product()));
                continue;
            }
            let is_added = word & MODE_GATHER != 0 || (operation == OP_PLAIN && weight != 0.0);
            debug_assert!(scene.has_remainder || !(is_remainder && is_added), "nobody evaluates {word:x} {spectra:x}");
            let sources = scene.sources_of(word).filter(|_| !is_remainder).unwrap_or_default();
            if operation == OP_PLAIN {
                self.plain_vertex(factor.of_product(), weight, sources, mixed);
                continue;
            }
            let value = self.value(scene, record, factor);
            self.instruction(word, value, weight);
            if word & MODE_GATHER != 0 {
                match is_remainder {
                    true => self.factor.clear(),
                    false => self.multiply_out(|walker, weight, state, own| match own {
                        Some(source) => walker.add(weight, state, &[source]),
                        None => walker.add(weight, state, sources),
                    }),
                }
            }
            if word & MODE_ADVANCE != 0 {
                let mut through = Vec::with_capacity(self.throughput.len());
                match mixed.throughput {
                    true => self.factor.clear(),
                    false => self.multiply_out(|_, weight, state, _| through.push((weight, state))),
                }
                self.throughput = choose(through, random ^ place as u64);
            }
        }
        true
    }

    /// A diffuse vertex in one record.
    fn plain_vertex(&mut self, value: Option<u16>, weight: f64, sources: &[u16], mixed: Mixed) {
        if mixed.throughput {
            return;
        }
        if let Some(factor) = value {
            for (_, state) in &mut self.throughput {
                *state = self.met.behind(*state, factor);
            }
        }
        if weight != 0.0 {
            for i in 0..self.throughput.len() {
                let (through, state) = self.throughput[i];
                self.add(weight * through, state, sources);
            }
        }
    }

    /// What an instruction multiplies by, which takes what it uses up.
    fn value(&mut self, scene: &Separable, [word, spectra, _, parameter]: [u32; 4], factor: Factor) -> Value {
        // `spectra` and `parameter` are what the operation has in their places.
        let source = |weight: f64, source: u16| Part { weight, source: Some(source), ..Part::ONE };
        match word & 0x3f {
            OP_PLANCK if spectra != 0 => {
                let nodes = scene.nodes(spectra).at(f64::from(f32::from_bits(parameter)));
                let sent = nodes.into_iter().filter(|(share, _)| *share > 0.0);
                Value::Sum(sent.map(|(share, node)| source(share, node)).collect())
            }
            OP_MAP if scene.has_map() => {
                Value::Sum(scene.map_at(spectra, parameter).map(|(of_map, share)| source(share, of_map)).collect())
            }
            // 1 - Σ w ρ = (1 - Σ w) + Σ w (1 - ρ).
            OP_ABSORBED => {
                let kept = std::mem::take(&mut self.kept);
                let beside = (1.0 - kept.iter().map(|(share, _)| share).sum::<f64>()).max(0.0);
                let absorbed = kept.iter().filter_map(|&(share, factor)| Some((share, scene.complement(factor?)?)));
                let absorbed = absorbed.map(|(share, factor)| Part::of(share, Some(factor)));
                Value::Sum(absorbed.chain([Part::of(beside, None)]).collect())
            }
            OP_INNER => {
                self.kept.clear();
                Value::One
            }
            OP_HELD => Value::Sum(self.held.drain(..).collect()),
            _ => match factor {
                Factor::Of(factor) => Value::Factor(factor),
                Factor::Source(of_lamp) => Value::Sum(smallvec![source(1.0, of_lamp)]),
                Factor::One | Factor::Mixed => Value::One,
            },
        }
    }

    /// What an instruction makes of P and F, but for what it does with them then.
    fn instruction(&mut self, word: u32, value: Value, weight: f64) {
        let multiply = |part: &mut Part| {
            part.weight *= weight;
            if let Value::Factor(factor) = value {
                part.factors.push(factor);
            }
        };
        let by = |parts: &[Part], sum: &[Part]| -> Vec<Part> {
            parts.iter().flat_map(|part| sum.iter().map(move |other| part.times(weight, other))).collect()
        };
        if word & MODE_ON_F != 0 {
            match &value {
                Value::Sum(sum) => self.factor = by(&self.factor, sum),
                _ => self.factor.iter_mut().for_each(multiply),
            }
        } else {
            if word & MODE_START != 0 {
                self.product = smallvec![Part::ONE];
            }
            match &value {
                Value::Sum(sum) => self.product = by(&self.product, sum).into(),
                _ => self.product.iter_mut().for_each(multiply),
            }
        }
        if word & MODE_ADD != 0 {
            self.factor.extend(self.product.iter().cloned());
        }
    }

    /// Calls `each` with every term of T F, and the source that F has brought; leaves F = 0.
    fn multiply_out(&mut self, mut each: impl FnMut(&mut Walker, f64, u32, Option<u16>)) {
        let (factor, throughput) = (std::mem::take(&mut self.factor), std::mem::take(&mut self.throughput));
        for &(through, state) in &throughput {
            for part in &factor {
                let weight = through * part.weight;
                if weight != 0.0 {
                    let state = part.factors.iter().fold(state, |state, &factor| self.met.behind(state, factor));
                    each(self, weight, state, part.source);
                }
            }
        }
        (self.factor, self.throughput) = (factor, throughput);
        self.factor.clear();
    }

    /// The samples of a pixel in a wave, added to what it has.
    fn pixel(
        &mut self,
        scene: &Separable,
        gather: &Layout,
        saved: &Saved,
        slot: u32,
        of_pixel: &mut Vec<(u32, f64)>,
        at: [u32; 2],
    ) {
        for (number, weight) in of_pixel.drain(..) {
            if number as usize >= self.weights.len() {
                self.weights.resize(number as usize + 1, 0.0);
            }
            self.weights[number as usize] = weight;
            self.touched.push(number);
        }
        let wave = saved.wave;
        for sample in 0..wave.samples {
            let path = ((slot - wave.pixel_begin) * wave.samples + sample) as usize;
            let head = saved.heads[2 * path + 1];
            if head >> 16 != wave.sequence {
                continue;
            }
            self.tally.ended += 1;
            let records = &saved.records[path * gather.path_words..][..(head & 0xffff) as usize * gather.record_words];
            let index = wave.sample_begin + sample;
            let is_finite = match gather.is_general {
                false => self.plain(scene, records),
                true => self.general(scene, records, random_of([at[0], at[1], wave.epoch, index])),
            };
            if !is_finite {
                self.tally.non_finite += 1;
                self.tally.bad.get_or_insert((slot, index));
            }
        }
        // In the order in which they were met, which is that of the paths.
        for number in self.touched.drain(..) {
            let weight = std::mem::take(&mut self.weights[number as usize]);
            if weight != 0.0 {
                of_pixel.push((number, weight));
            }
        }
    }
}

/// How records lie.
struct Layout {
    path_words: usize,
    record_words: usize,
    is_general: bool,
}

impl Gather {
    /// For as many groups of units under way, walked through by `threads` threads.
    pub fn new(prepared: &Prepared, tile: [u32; 2], groups: usize, threads: usize) -> Option<Gather> {
        let separable = prepared.separable.as_ref()?;
        let walker = || Walker {
            met: Met::new(separable),
            weights: Vec::new(),
            touched: Vec::new(),
            throughput: Vec::new(),
            saved: Vec::new(),
            product: smallvec![],
            factor: Vec::new(),
            held: Vec::new(),
            kept: smallvec![],
            tally: Tally::default(),
        };
        Some(Gather {
            walkers: (0..threads).map(|_| walker()).collect(),
            groups: (0..groups).map(|_| Group::default()).collect(),
            tile,
            max_records: prepared.max_records() as usize,
            is_general: prepared.is_general(),
        })
    }

    /// Forgets what group number `group` was; now it is these units.
    pub fn begin(&mut self, group: usize, units: &[UnitRect], samples: u32) {
        let slots = units.len() * (self.tile[0] * self.tile[1]) as usize;
        let pixels = vec![Vec::new(); slots];
        self.groups[group] = Group { units: units.to_vec(), samples, pixels, ..Group::default() };
    }

    /// Reads a wave of a group.
    pub fn take(&mut self, group: usize, scene: &Separable, saved: &Saved) {
        let words = if self.is_general { 4 } else { 2 };
        let layout = Layout { path_words: self.max_records * words, record_words: words, is_general: self.is_general };
        let Group { units, pixels, tally, last_wave, .. } = &mut self.groups[group];
        let [width, height] = self.tile;
        let place = |slot: u32| {
            let in_tile = slot % (width * height);
            let [x, y, ..] = units[(slot / (width * height)) as usize];
            [x + in_tile % width, y + in_tile / width]
        };
        let each = pixels.len().div_ceil(self.walkers.len());
        let of_wave = saved.wave.pixel_begin..saved.wave.pixel_begin + saved.wave.pixel_count;
        // A slot is always with the same walker, whose numbers its products have.
        self.walkers.par_iter_mut().zip(pixels.par_chunks_mut(each)).enumerate().for_each(|(w, (walker, pixels))| {
            let first = (w * each) as u32;
            let from = of_wave.start.max(first);
            let to = of_wave.end.min(first + pixels.len() as u32);
            for slot in from..to {
                walker.pixel(scene, &layout, saved, slot, &mut pixels[(slot - first) as usize], place(slot));
            }
        });
        for walker in &mut self.walkers {
            let seen = std::mem::take(&mut walker.tally);
            tally.ended = tally.ended.wrapping_add(seen.ended);
            tally.non_finite += seen.non_finite;
            tally.bad = tally.bad.or(seen.bad);
        }
        *last_wave = saved.wave.sequence;
    }

    /// What came of the units of a group, and what evaluation would have counted: beside it, where there is a remainder.
    pub fn finish(&mut self, group: usize, counters: &mut Counters) -> Vec<Weights> {
        let Group { units, samples, pixels, tally, last_wave } = std::mem::take(&mut self.groups[group]);
        counters.folded = tally.ended;
        counters.sequence = last_wave;
        counters.non_finite += tally.non_finite;
        if let Some((slot, sample)) = tally.bad {
            (counters.bad_slot, counters.bad_sample) = (slot, sample + 1);
        }
        let each = pixels.len().div_ceil(self.walkers.len());
        let weights = self.weights_of(&units, samples, &pixels, each);
        self.forget();
        weights
    }

    fn weights_of(&self, units: &[UnitRect], samples: u32, pixels: &[Vec<(u32, f64)>], each: usize) -> Vec<Weights> {
        let slots = (self.tile[0] * self.tile[1]) as usize;
        let of_unit = |unit: usize| {
            let own = &pixels[unit * slots..(unit + 1) * slots];
            let entries = own.iter().enumerate().map(|(i, entries)| {
                let met = &self.walkers[(unit * slots + i) / each].met;
                entries.iter().map(move |&(number, sum)| (met.product(number), sum / f64::from(samples)))
            });
            Weights::of_pixels(entries)
        };
        (0..units.len()).into_par_iter().map(of_unit).collect()
    }

    /// Where a thread has met too much, numbers begin anew, for the groups under way too.
    fn forget(&mut self) {
        for w in 0..self.walkers.len() {
            let met = &self.walkers[w].met;
            if met.next.len() + met.numbers.len() <= MOST_KNOWN {
                continue;
            }
            let mut anew = met.empty();
            for group in &mut self.groups {
                let each = group.pixels.len().div_ceil(self.walkers.len()).max(1);
                for (number, _) in group.pixels.iter_mut().skip(w * each).take(each).flatten() {
                    *number = anew.number_of(met.product(*number));
                }
            }
            let walker = &mut self.walkers[w];
            walker.met = anew;
            walker.weights.clear();
        }
    }
}

/// Of terms, no more than [`MOST_TERMS`] with the same mean: each stays with a chance by its weight.
fn choose(terms: Vec<(f64, u32)>, random: u64) -> Vec<(f64, u32)> {
    if terms.len() <= MOST_TERMS {
        return terms;
    }
    let weights: Vec<f64> = terms.iter().map(|term| term.0.abs()).collect();
    let kept = systematic(&weights, MOST_TERMS, random_of([random as u32, (random >> 32) as u32, 0, 1]));
    kept.into_iter().map(|(i, factor)| (terms[i].0 * factor, terms[i].1)).collect()
}
