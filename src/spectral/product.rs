//! What light is made of where its transport separates: a contribution is a weight, which knows no wavelength, times a
//! *product*, one source spectrum times powers of factor spectra. Whoever has the weights of a picture can make it anew for any
//! spectra and channels, exactly in wavelength.

use std::ops::Range;

use serde::{Deserialize, Serialize};
use smallvec::SmallVec;

use super::{Channels, Curve, planck};

/// A spectrum that products are made of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Leaf {
    /// Its name under `[spectra]`, or where it is used.
    pub name: String,
    /// Whether `name` is that of a definition, by which it can be exchanged.
    pub is_named: bool,
    /// What it describes, as the scene's quantities are called (`a reflectance`): decides which values it may have.
    pub quantity: String,
    pub curve: Curve,
}

/// What an [`Expression`] multiplies; spectra by their place in [`Basis::spectra`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Term {
    Spectrum(usize),
    /// 1 - the spectrum.
    Complement(usize),
    /// Planck's law at the temperature of a material, K; or, where that is a texture, at one of the nodes between which temperatures
    /// are.
    Planck {
        material: String,
        kelvin: f64,
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        is_node: bool,
    },
}

/// scale x the product of its terms.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Expression {
    pub scale: f64,
    pub terms: Vec<Term>,
}

/// All that the products of a picture are made of.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Basis {
    pub spectra: Vec<Leaf>,
    /// What multiplies light where it is reflected.
    pub factors: Vec<Expression>,
    /// What emits.
    pub sources: Vec<Expression>,
}

/// A source times factors, by their places in a [`Basis`].
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Product {
    /// Ascending; one that stands twice is squared.
    pub factors: SmallVec<[u16; 8]>,
    pub source: u16,
}

/// Points of a Gauss rule that are enough for any product: with 16 polynomials up to degree 31 are exact, and what is beyond does not
/// show between two nodes of a table.
const MOST_POINTS: usize = 16;
/// Those where a term is no polynomial.
const SMOOTH_POINTS: usize = 5;
/// Planck's law is integrated over at most this share of the wavelength at once.
const PANEL: f64 = 1.0 / 64.0;

/// The means of products over channels: their spectra at the nodes of a quadrature that is exact where all spectra are piecewise
/// linear.
pub struct Expander {
    channels: usize,
    /// Of each channel, where its nodes end.
    ends: Vec<usize>,
    /// Of the nodes, dλ and response over the channel's integral included.
    weights: Vec<f64>,
    /// Values at the nodes.
    factors: Vec<Vec<f64>>,
    sources: Vec<Vec<f64>>,
    /// Per channel, the largest mean of a source.
    brightest: Vec<f64>,
}

impl Term {
    fn eval(&self, basis: &Basis, nm: f64) -> f64 {
        match self {
            Term::Spectrum(i) => basis.spectra[*i].curve.eval(nm),
            Term::Complement(i) => 1.0 - basis.spectra[*i].curve.eval(nm),
            Term::Planck { kelvin, .. } => planck::radiance(nm, *kelvin),
        }
    }
}

impl Expression {
    fn eval(&self, basis: &Basis, nm: f64) -> f64 {
        self.scale * self.terms.iter().map(|term| term.eval(basis, nm)).product::<f64>()
    }

    fn is_smooth(&self, basis: &Basis) -> bool {
        self.terms.iter().any(|term| match term {
            Term::Spectrum(i) | Term::Complement(i) => matches!(basis.spectra[*i].curve, Curve::Blackbody { .. }),
            Term::Planck { .. } => true,
        })
    }
}

impl Basis {
    /// By how much a product of so many factors changes over an interval in which spectra are lines, over its largest value: the sum of what
    /// each of its terms does.
    fn slope(&self, from: f64, to: f64, degree: usize) -> f64 {
        let inside = 1e-6 * (to - from);
        let change = |term: &Term| {
            let [a, b] = [from + inside, to - inside].map(|nm| term.eval(self, nm).abs());
            if a.max(b) > 0.0 { (a - b).abs() / a.max(b) } else { 0.0 }
        };
        let of_expression = |expression: &Expression| expression.terms.iter().map(change).sum::<f64>();
        let most = |all: &[Expression]| all.iter().map(of_expression).fold(0.0, f64::max);
        degree as f64 * most(&self.factors) + most(&self.sources)
    }

    fn all(&self) -> impl Iterator<Item = &Expression> {
        self.factors.iter().chain(&self.sources)
    }
}

/// Points that make the mean of a function over an interval right to [`BOUND`] of its largest value, where its derivatives are at most
/// `slope` to their order, relative to that value: (n!)⁴ / ((2n + 1) (2n)!³) slope²ⁿ (Abramowitz and Stegun 25.4.30). At most `most`.
fn points_for(slope: f64, most: usize) -> usize {
    let mut error = 1.0;
    (1..most)
        .find(|&n| {
            let n = n as f64;
            // From n - 1 points to n.
            error *=
                n.powi(4) * (2.0 * n - 1.0) / ((2.0 * n + 1.0) * (2.0 * n * (2.0 * n - 1.0)).powi(3)) * slope * slope;
            error <= BOUND
        })
        .unwrap_or(most)
}

/// Relative error of means that fewer points than are exact may make.
const BOUND: f64 = 1e-9;

impl Expander {
    /// For products of up to `degree` factors, in `channels`: means over their bounds, or by their responses.
    pub fn new(basis: &Basis, channels: &Channels, degree: usize) -> Expander {
        let smooth = basis.all().any(|expression| expression.is_smooth(basis));
        let most_terms = |all: &[Expression]| all.iter().map(|expression| expression.terms.len()).max().unwrap_or(0);
        // Of the integrand, a response included: n points are exact up to 2 n - 1.
        let polynomial = degree * most_terms(&basis.factors) + most_terms(&basis.sources) + 1;
        let points = (polynomial / 2 + 1).max(if smooth { SMOOTH_POINTS } else { 1 }).min(MOST_POINTS);
        let rules: Vec<Vec<(f64, f64)>> = (1..=points).map(gauss_legendre).collect();
        let mut knots: Vec<f64> = basis.spectra.iter().flat_map(|leaf| knots(&leaf.curve)).copied().collect();
        knots.sort_by(f64::total_cmp);
        knots.dedup();

        let (mut nodes, mut weights, mut ends) = (Vec::new(), Vec::new(), Vec::new());
        for (k, &[from, to]) in channels.bounds.iter().enumerate() {
            let response = channels.responses.get(k);
            let inside = &knots[knots.partition_point(|&nm| nm <= from)..];
            let mut breaks: Vec<f64> = inside.iter().copied().take_while(|&nm| nm < to).collect();
            breaks.extend(response.into_iter().flat_map(|r| knots_between(r.curve(), from, to)));
            breaks.extend([from, to]);
            breaks.sort_by(f64::total_cmp);
            breaks.dedup();
            let integral = response.map_or(to - from, |response| response.integral());
            for piece in breaks.windows(2) {
                let panels = if smooth { ((piece[1] / piece[0]).ln() / PANEL).ceil().max(1.0) as usize } else { 1 };
                let width = (piece[1] - piece[0]) / panels as f64;
                for panel in 0..panels {
                    let begin = piece[0] + width * panel as f64;
                    // A response falls from its peak to nothing at most.
                    let slope = basis.slope(begin, begin + width, degree) + f64::from(u8::from(response.is_some()));
                    for &(place, share) in &rules[points_for(slope, points) - 1] {
                        let nm = begin + width * place;
                        let seen = response.map_or(1.0, |response| response.curve().eval(nm));
                        nodes.push(nm);
                        weights.push(width * share * seen / integral);
                    }
                }
            }
            ends.push(nodes.len());
        }
        let values = |all: &[Expression]| -> Vec<Vec<f64>> {
            all.iter().map(|expression| nodes.iter().map(|&nm| expression.eval(basis, nm)).collect()).collect()
        };
        let (factors, sources) = (values(&basis.factors), values(&basis.sources));
        let mut expander =
            Expander { channels: channels.len(), ends, weights, factors, sources, brightest: Vec::new() };
        let mut brightest = vec![0.0f64; channels.len()];
        let runs = expander.runs(0..channels.len());
        for source in &expander.sources {
            means(&runs, &expander.weights, source, |k, mean| brightest[k] = brightest[k].max(mean));
        }
        expander.brightest = brightest;
        expander
    }

    pub fn channels(&self) -> usize {
        self.channels
    }

    /// The nodes of some channels.
    fn nodes(&self, channels: &Range<usize>) -> Range<usize> {
        let end = |channels: usize| if channels > 0 { self.ends[channels - 1] } else { 0 };
        end(channels.start)..end(channels.end)
    }

    /// How many nodes each of some channels has, and how many channels in turn have as many.
    fn runs(&self, channels: Range<usize>) -> Vec<(usize, usize)> {
        let mut runs: Vec<(usize, usize)> = Vec::new();
        for k in channels {
            let nodes = self.nodes(&(k..k + 1)).len();
            match runs.last_mut() {
                Some((of_last, count)) if *of_last == nodes => *count += 1,
                _ => runs.push((nodes, 1)),
            }
        }
        runs
    }

    /// The mean of each product over each channel, [product][channel].
    pub fn rows(&self, products: &[Product]) -> Vec<f32> {
        let mut rows = vec![0.0; products.len() * self.channels];
        self.write_rows(products, 0..self.channels, self.channels, &mut rows);
        rows
    }

    /// The same, product by product, of which some are in memory at a time.
    pub fn each_row(&self, products: &[Product], mut each: impl FnMut(&[f32])) {
        const AT_ONCE: usize = 1024;
        let mut rows = vec![0.0; products.len().min(AT_ONCE) * self.channels];
        for products in products.chunks(AT_ONCE) {
            self.write_rows(products, 0..self.channels, self.channels, &mut rows);
            rows.chunks(self.channels).take(products.len()).for_each(&mut each);
        }
    }

    /// The mean of each product over each of some channels: a product's in `out` from `width` times its number on. Fast where `products`
    /// ascend: what two have in common is multiplied once.
    pub fn write_rows(&self, products: &[Product], channels: Range<usize>, width: usize, out: &mut [f32]) {
        // Compiled for every width of vectors, of which the machine's is taken; what is computed is the same.
        pulp::Arch::new().dispatch(|| self.write_rows_of(products, channels.clone(), width, out));
    }

    #[inline(always)]
    fn write_rows_of(&self, products: &[Product], channels: Range<usize>, width: usize, out: &mut [f32]) {
        let (nodes, runs) = (self.nodes(&channels), self.runs(channels));
        // Weights times the first so many factors of the last product, one behind the other.
        let mut partial = self.weights[nodes.clone()].to_vec();
        let mut before: &[u16] = &[];
        for (product, out) in products.iter().zip(out.chunks_mut(width)) {
            let common = before.iter().zip(&product.factors).take_while(|(a, b)| a == b).count();
            let of = |number: usize| number * nodes.len()..(number + 1) * nodes.len();
            partial.resize(of(product.factors.len()).end, 0.0);
            for (number, &factor) in product.factors.iter().enumerate().skip(common) {
                let (last, next) = partial[of(number).start..of(number + 1).end].split_at_mut(nodes.len());
                let factor = &self.factors[usize::from(factor)][nodes.clone()];
                next.iter_mut().zip(last).zip(factor).for_each(|((next, w), v)| *next = *w * v);
            }
            let source = &self.sources[usize::from(product.source)][nodes.clone()];
            means(&runs, &partial[of(product.factors.len())], source, |k, mean| out[k] = mean as f32);
            before = &product.factors;
        }
    }

    /// How much a unit of weight of a product matters: half by the channel in which it is the largest share of the brightest source,
    /// half as if everything reflected a half, so that no spectrum that is exchanged later brings what was never kept.
    pub fn importance(&self, product: &Product, row: &[f32]) -> f64 {
        let shares = row.iter().zip(&self.brightest).filter(|(_, most)| **most > 0.0);
        let largest = shares.map(|(mean, most)| f64::from(*mean) / most).fold(0.0, f64::max);
        0.5 * largest + 0.5 * 0.5f64.powi(product.factors.len() as i32)
    }
}

/// Σ weight x value over the nodes of each channel, for channels by [`Expander::runs`].
#[inline(always)]
fn means(runs: &[(usize, usize)], weighted: &[f64], values: &[f64], mut each: impl FnMut(usize, f64)) {
    let (mut channel, mut node) = (0, 0);
    for &(nodes, count) in runs {
        let own = node..node + nodes * count;
        let (weighted, values) = (&weighted[own.clone()], &values[own.clone()]);
        let mut each = |k: usize, mean: f64| each(channel + k, mean);
        match nodes {
            1 => means_of::<1>(weighted, values, each),
            2 => means_of::<2>(weighted, values, each),
            3 => means_of::<3>(weighted, values, each),
            4 => means_of::<4>(weighted, values, each),
            _ => weighted
                .chunks(nodes)
                .zip(values.chunks(nodes))
                .map(|(weighted, values)| weighted.iter().zip(values).map(|(w, v)| w * v).sum())
                .enumerate()
                .for_each(|(k, mean)| each(k, mean)),
        }
        (channel, node) = (channel + count, own.end);
    }
}

/// The same where every channel has `N` nodes, known when this is compiled.
#[inline(always)]
fn means_of<const N: usize>(weighted: &[f64], values: &[f64], mut each: impl FnMut(usize, f64)) {
    for (k, (weighted, values)) in weighted.as_chunks::<N>().0.iter().zip(values.as_chunks::<N>().0).enumerate() {
        let mut sum = 0.0;
        weighted.iter().zip(values).for_each(|(w, v)| sum += w * v);
        each(k, sum);
    }
}

/// Wavelengths between which a curve is a line.
fn knots(curve: &Curve) -> &[f64] {
    match curve {
        Curve::Linear { nm, .. } => nm,
        Curve::Constant(_) | Curve::Blackbody { .. } => &[],
    }
}

fn knots_between(curve: &Curve, from: f64, to: f64) -> impl Iterator<Item = f64> + '_ {
    knots(curve).iter().copied().filter(move |&nm| nm > from && nm < to)
}

/// Nodes in (0, 1) and weights, which add up to 1, of the rule of so many points: exact for polynomials up to degree 2 n - 1 (Newton's
/// method on Legendre polynomials, Abramowitz and Stegun 25.4.29).
fn gauss_legendre(points: usize) -> Vec<(f64, f64)> {
    let n = points as f64;
    let node = |i: usize| {
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..100 {
            let (mut p, mut q) = (1.0, 0.0);
            for j in 0..points {
                let j = j as f64;
                (p, q) = (((2.0 * j + 1.0) * x * p - j * q) / (j + 1.0), p);
            }
            slope = n * (x * p - q) / (x * x - 1.0);
            let step = p / slope;
            x -= step;
            if step.abs() < 1e-15 {
                break;
            }
        }
        (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..points).map(node).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectral::{Outside, Response};

    fn leaf(curve: Curve) -> Leaf {
        Leaf { name: "s".into(), is_named: true, quantity: "radiance".into(), curve }
    }

    fn of(terms: Vec<Term>, scale: f64) -> Expression {
        Expression { scale, terms }
    }

    /// A sawtooth, a step and a line; a product of nine of them is a polynomial of degree nine between their knots.
    fn basis() -> Basis {
        let linear =
            |nm: &[f64], value: &[f64], outside| Curve::Linear { nm: nm.to_vec(), value: value.to_vec(), outside };
        Basis {
            spectra: vec![
                leaf(linear(&[400.0, 430.0, 455.0, 500.0], &[0.1, 0.9, 0.2, 0.7], Outside::Hold)),
                leaf(linear(&[400.0, 440.0, 440.0, 480.0], &[3.0, 3.5, 1.0, 2.0], Outside::Zero)),
                leaf(Curve::Constant(0.25)),
            ],
            factors: vec![
                of(vec![Term::Spectrum(0)], 1.0),
                of(vec![Term::Complement(0)], 1.0),
                of(vec![Term::Spectrum(2)], 1.0),
            ],
            sources: vec![
                of(vec![Term::Spectrum(1)], 2.0),
                of(
                    vec![Term::Complement(0), Term::Planck { material: "hot".into(), kelvin: 3000.0, is_node: false }],
                    0.5,
                ),
            ],
        }
    }

    fn product(source: u16, factors: &[u16]) -> Product {
        Product { source, factors: SmallVec::from_slice(factors) }
    }

    /// Against the midpoint rule with many steps; with responses too.
    #[test]
    fn means_are_those_of_many_steps() {
        let basis = basis();
        let products = [
            product(0, &[]),
            product(1, &[]),
            product(0, &[0, 0, 0, 0, 0, 0, 0, 0]),
            product(1, &[0, 0, 1, 2]),
            product(0, &[0, 1, 1]),
        ];
        let bounds = vec![[395.0, 445.0], [440.0, 441.0], [470.0, 505.0]];
        let response =
            |from: f64, to: f64| Response::new(vec![from, 0.3 * from + 0.7 * to, to], vec![0.2, 1.0, 0.0]).unwrap();
        let plain = Channels::from_bounds(bounds.clone(), None);
        let seen = bounds.iter().map(|&[from, to]| ("r".to_owned(), response(from, to))).collect();
        for channels in [plain, Channels::from_responses(seen, None)] {
            let expander = Expander::new(&basis, &channels, 8);
            let rows = expander.rows(&products);
            for (product, row) in products.iter().zip(rows.chunks(channels.len())) {
                for (k, &got) in row.iter().enumerate() {
                    let [from, to] = channels.bounds[k];
                    let (mut sum, mut norm) = (0.0, 0.0);
                    const STEPS: u32 = 400_000;
                    for i in 0..STEPS {
                        let nm = from + (to - from) * (f64::from(i) + 0.5) / f64::from(STEPS);
                        let seen = channels.responses.get(k).map_or(1.0, |response| response.curve().eval(nm));
                        let factors = product.factors.iter().map(|&f| basis.factors[f as usize].eval(&basis, nm));
                        sum +=
                            seen * basis.sources[product.source as usize].eval(&basis, nm) * factors.product::<f64>();
                        norm += seen;
                    }
                    // A step that holds a jump, of 7 at most, is half wrong; values are rounded to f32.
                    let want = sum / norm;
                    let bound = 0.5 * 7.0 * 3.0 / f64::from(STEPS) + 1e-7 * want.abs();
                    assert!((f64::from(got) - want).abs() < bound, "{product:?} {k}: {got} {want}");
                }
            }
        }
    }

    /// Moments of every order that a rule is said to have exact.
    #[test]
    fn rules_are_exact_up_to_their_degree() {
        for points in 1..=MOST_POINTS {
            let rule = gauss_legendre(points);
            for degree in 0..2 * points {
                let got: f64 = rule.iter().map(|(x, w)| w * x.powi(degree as i32)).sum();
                assert!((got * (degree as f64 + 1.0) - 1.0).abs() < 1e-13, "{points} {degree}: {got}");
            }
        }
    }

    #[test]
    fn a_basis_comes_back_from_json() {
        let text = serde_json::to_string(&basis()).unwrap();
        assert_eq!(serde_json::from_str::<Basis>(&text).unwrap(), basis());
    }
}
