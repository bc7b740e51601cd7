//! What the records of paths are in products of spectra, and which of them are of the remainder.

use std::collections::BTreeMap;

use super::{Map, Nodes, Sources};
use crate::device::instructions::{
    MODE_ADD, MODE_ADVANCE, MODE_GATHER, MODE_KEEP, MODE_ON_F, MODE_START, OP_ABSORBED, OP_AMOUNTS, OP_HELD, OP_HOLD,
    OP_INNER, OP_MAP, OP_MARCH, OP_MEDIUM, OP_ONE, OP_PLAIN, OP_PLANCK, OP_RESTORE, OP_SAVE, OP_SPECTRUM,
};

/// What a spectrum id stands for where it multiplies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Factor {
    /// The constant 1.
    One,
    Of(u16),
    /// A source, of what is emitted by place.
    Source(u16),
    /// Something that is in no product.
    Mixed,
}

/// What the spectrum ids of records are in products.
#[derive(Debug)]
pub struct Separable {
    pub factors: Vec<Factor>,
    /// What a factor leaves of light, 1 less it, where something hot needs that.
    pub(super) complements: BTreeMap<u16, u16>,
    /// Those that are added; `None` where what shines is no source of products. Where several surfaces that emit by place are gathered
    /// under id 0, what they multiply has sources of its own.
    pub sources: Vec<Option<Sources>>,
    /// Of each radiator, where it is hot and in products.
    pub(super) heat: Vec<Option<Nodes>>,
    /// The environment, where it is a map of spectra.
    pub(super) map: Option<Map>,
    /// The same for devices: [`SEPARATES_AS_FACTOR`] and [`SEPARATES_AS_SOURCE`] of each id.
    pub bits: Vec<u32>,
    /// How many sources and factors products are made of.
    pub counts: [usize; 2],
    /// Whether there is something that does not separate.
    pub has_remainder: bool,
}

impl Factor {
    /// Its place among the factors, of one that is in products.
    pub fn of_product(self) -> Option<u16> {
        match self {
            Factor::Of(factor) => Some(factor),
            Factor::One | Factor::Source(_) | Factor::Mixed => None,
        }
    }
}

impl Separable {
    /// Of spectrum a of an instruction that has one.
    pub fn factor(&self, spectra: u32) -> Factor {
        self.factors[(spectra & 0xffff) as usize]
    }

    /// What a factor leaves of light, where something hot asks for that.
    pub fn complement(&self, factor: u16) -> Option<u16> {
        self.complements.get(&factor).copied()
    }

    /// Whether a map is a sum of sources, but for what these leave of it.
    pub fn has_map(&self) -> bool {
        self.map.is_some()
    }

    /// What its sources leave of a map, if that is anything, and the map's scale.
    pub fn left_of_map(&self) -> Option<(&[f32], f64)> {
        self.map.as_ref().and_then(|map| Some((map.clusters.left.as_deref()?, map.scale)))
    }

    /// Of a map ([`Separable::has_map`]) how much of which sources there is at the place that a record names.
    pub fn map_at(&self, cell: u32, fractions: u32) -> impl Iterator<Item = (u16, f64)> {
        let found =
            self.map.iter().flat_map(move |map| map.clusters.at(cell, fractions).into_iter().map(move |it| (map, it)));
        found.map(|(map, (spectrum, share))| (map.sources[usize::from(spectrum)], share))
    }

    /// The temperatures of what the word of an instruction for Planck's law names.
    ///
    /// # Panics
    /// Of what is in no product ([`Mixed`]).
    pub fn nodes(&self, radiator: u32) -> &Nodes {
        self.heat[radiator as usize - 1].as_ref().expect("devices mark those that are in products")
    }

    /// What the first word of an instruction that gathers names; `None` where that is no source of products.
    pub fn sources_of(&self, word: u32) -> Option<&[u16]> {
        self.sources.get((word >> 16) as usize)?.as_deref()
    }
}

/// Which registers of a path ([`crate::device::instructions`]) hold something that does not separate: T, P, F, Q, H and the T put aside.
#[derive(Debug, Clone, Copy)]
pub struct Mixed {
    pub throughput: bool,
    product: bool,
    factor: bool,
    kept: bool,
    held: bool,
    /// Also before anything was put aside, which is taken back only then.
    saved: bool,
}

impl Mixed {
    /// Where a path begins.
    pub const NOTHING: Mixed =
        Mixed { throughput: false, product: false, factor: false, kept: false, held: false, saved: true };

    /// Whether all that the path brings from now on is of the remainder.
    pub fn is_settled(self) -> bool {
        self.throughput && self.saved
    }

    /// Goes on by an instruction, and says whether what it adds to R, if anything, is of the remainder.
    pub fn step(&mut self, scene: &Separable, [word, spectra, _, parameter]: [u32; 4]) -> bool {
        let operation = word & 0x3f;
        match operation {
            OP_MEDIUM | OP_MARCH => {
                self.throughput = true;
                return true;
            }
            OP_AMOUNTS => {
                match word & MODE_ON_F {
                    0 => self.throughput = true,
                    _ => self.factor = word & MODE_GATHER == 0,
                }
                return true;
            }
            OP_SAVE => {
                self.saved = self.throughput;
                return false;
            }
            OP_RESTORE => {
                self.throughput = self.saved;
                return false;
            }
            OP_HOLD => {
                (self.held, self.factor) = (self.factor, false);
                return false;
            }
            _ => {}
        }
        let value = match operation {
            OP_ONE => false,
            OP_PLAIN | OP_SPECTRUM => scene.factor(spectra) == Factor::Mixed,
            // Radiators that are in products say which they are.
            OP_PLANCK => spectra == 0,
            OP_HELD => self.held,
            OP_MAP => !scene.has_map(),
            // Without a coat 1 - Q, which is a sum of products.
            OP_ABSORBED => self.kept || parameter != 0,
            _ => true,
        };
        if word & MODE_KEEP != 0 {
            self.kept |= value;
            return false;
        }
        if operation == OP_ABSORBED || operation == OP_INNER {
            self.kept = false;
        }
        let source = scene.sources_of(word).is_none();
        if operation == OP_PLAIN {
            self.throughput |= value;
            return self.throughput || source;
        }
        self.product &= word & MODE_START == 0;
        if word & MODE_ON_F != 0 {
            self.factor |= value;
        } else {
            self.product |= value;
        }
        self.factor |= word & MODE_ADD != 0 && self.product;
        let is_remainder = self.throughput || self.factor || source;
        if word & MODE_GATHER != 0 {
            self.factor = false;
        }
        if word & MODE_ADVANCE != 0 {
            self.throughput |= self.factor;
            self.factor = false;
        }
        is_remainder
    }
}
