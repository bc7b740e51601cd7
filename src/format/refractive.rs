//! Complex refractive indices: `nm,n,k` text and the YAML of the refractiveindex.info database.

use std::path::Path;

use serde::Deserialize;
use serde_saphyr::Spanned;

use super::said::Said;
use super::table;
use super::text::{self, SpectrumTable};
use super::unit;
use crate::error::Problem;

/// n and k over wavelength in nm, as far as a file gives them; each may be wrong by itself. k > 0 absorbs.
#[derive(Debug, Clone, PartialEq)]
pub struct Index {
    pub n: Option<Found>,
    pub k: Option<Found>,
}

type Found = Result<SpectrumTable, Box<Problem>>;

/// Largest relative error of a dispersion formula's table between its nodes: well below the f32 of a device.
const TABLE_ERROR: f64 = 1e-8;
/// Beyond these, um, no formula means anything, and products of wavelengths leave f64.
const SHORTEST_UM: f64 = 1e-6;
const LONGEST_UM: f64 = 1e9;
/// Halvings of a formula's range at most. A pole inside the range would need any number.
const MAX_HALVINGS: u32 = 14;

/// Whether the file's name says YAML.
pub fn is_yaml(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("yml") || e.eq_ignore_ascii_case("yaml"))
}

/// Reads the file at `path`: YAML by its name, otherwise text with the columns n and k. A dispersion formula that is not real all
/// over the range of its page is read between the two wavelengths of `needed`, nm.
///
/// Errors name the line; without one, the file as a whole could not be read.
pub fn read(path: &Path, needed: Option<[f64; 2]>) -> Result<Index, Box<Problem>> {
    parse(&text::read(path)?, path, needed)
}

/// [`read`] on the content of the file.
pub fn parse(bytes: &[u8], path: &Path, needed: Option<[f64; 2]>) -> Result<Index, Box<Problem>> {
    if is_yaml(path) {
        return Yaml { path, needed }.parse(&table::text(bytes, path)?);
    }
    let [n, k] = text::parse_index(bytes, path)?;
    Ok(Index { n: n.map(Ok), k: k.map(Ok) })
}

/// What is read of a file; the rest (references, comments, properties) is left aside.
#[derive(Deserialize)]
struct Document {
    #[serde(rename = "DATA")]
    data: Vec<Block>,
}

/// One entry of `DATA`. Numbers are kept as text: rows and lists are separated by blanks.
#[derive(Deserialize)]
struct Block {
    #[serde(rename = "type")]
    kind: Spanned<String>,
    data: Option<Spanned<String>>,
    #[serde(alias = "range")]
    wavelength_range: Option<Spanned<String>>,
    coefficients: Option<Spanned<String>>,
    /// What would change the numbers, and no page has.
    #[serde(
        alias = "factor",
        alias = "scale_factor",
        alias = "multiplier",
        alias = "offset",
        alias = "unit",
        alias = "units",
        alias = "wavelength_unit",
        alias = "wavelength_units"
    )]
    scale: Option<Spanned<String>>,
}

struct Yaml<'a> {
    path: &'a Path,
    needed: Option<[f64; 2]>,
}

impl Yaml<'_> {
    fn at(&self, line: Option<usize>, message: impl Into<String>, help: &str) -> Box<Problem> {
        let help = (!help.is_empty()).then(|| help.to_owned());
        Box::new(Problem { file: self.path.to_owned(), line, message: message.into(), help, ..Problem::default() })
    }

    fn parse(&self, text: &str) -> Result<Index, Box<Problem>> {
        let document: Document = serde_saphyr::from_str(text).map_err(|e| {
            let line = e.location().map(|at| at.line() as usize).filter(|line| *line > 0);
            let message = e.without_snippet().to_string();
            if message.contains("uplicate") {
                return self.at(line, "has a key here that it has had before", "keep one of the two");
            }
            // The place is named once.
            let message = message.split(" at line ").next().unwrap_or_default();
            let help = "a refractiveindex.info file has a list `DATA:` of blocks with `type:`";
            self.at(line, format!("is not what is expected of it: {}", message.replace('\n', " ")), help)
        })?;
        let mut index = Index { n: None, k: None };
        let mut others = Vec::new();
        for block in &document.data {
            let kind = block.kind.value.split_whitespace().collect::<Vec<_>>();
            let line = line_of(&block.kind);
            if let Some(scale) = &block.scale {
                let message = format!(
                    "has a key beside `type` and `data` that is not applied: it says `{}`",
                    table::shown(&scale.value)
                );
                return Err(self.at(
                    line_of(scale),
                    message,
                    "write the numbers so, with wavelengths in um, and remove it",
                ));
            }
            let (n, k) = match kind[..] {
                ["tabulated", "nk"] => {
                    let (n, k) = match self.columns(block, line) {
                        Ok([n, k]) => (Ok(n), Ok(k)),
                        Err(problem) => (Err(problem.clone()), Err(problem)),
                    };
                    (Some(n), Some(k))
                }
                ["tabulated", "n"] => (Some(self.columns(block, line).map(|[n]| n)), None),
                ["tabulated", "k"] => (None, Some(self.columns(block, line).map(|[k]| k))),
                ["formula", number] => (Some(self.formula(block, line, number)), None),
                _ => {
                    others.push((line, block.kind.value.trim()));
                    continue;
                }
            };
            for (name, new, old) in [("n", n, &mut index.n), ("k", k, &mut index.k)] {
                if new.is_some() && old.is_some() {
                    return Err(self.at(line, format!("gives {name} a second time"), "keep one of the blocks"));
                }
                *old = new.or(old.take());
            }
        }
        if let ((None, None), Some((line, kind))) = ((&index.n, &index.k), others.first()) {
            let help = "known types: tabulated nk, tabulated n, tabulated k, formula 1 to 9";
            return Err(self.at(*line, format!("has a block of type `{}`", kind.escape_debug()), help));
        }
        if index.n.is_none() && index.k.is_none() {
            return Err(self.at(None, "has no data", "give at least one block under `DATA:`"));
        }
        for table in [&mut index.n, &mut index.k].into_iter().flatten().flatten() {
            let left_out =
                |(_, kind): &(Option<usize>, &str)| format!("has a block of type `{}`, left out", table::shown(kind));
            table.notes.extend(others.iter().map(left_out));
        }
        for (table, said, name) in [(&mut index.n, Said::Index, "n"), (&mut index.k, Said::Extinction, "k")] {
            if let Some(Ok(table)) = table {
                table.said = Some((said, name.to_owned()));
            }
        }
        self.bring_to_vacuum(&mut index, text)?;
        Ok(index)
    }

    /// Makes wavelengths in air those in vacuum, and n relative to air absolute, where the page says that they are such.
    fn bring_to_vacuum(&self, index: &mut Index, text: &str) -> Result<(), Box<Problem>> {
        // The database has had these words under SPECS, PROPERTIES and CONDITIONS; without them that is the vacuum.
        let denied = |names: [&str; 2]| {
            for (number, line) in (1..).zip(text.lines()) {
                let Some((key, value)) = line.trim().split_once(':') else { continue };
                if !line.starts_with([' ', '\t']) || !names.contains(&key.trim_matches(['"', '\'', ' '])) {
                    continue;
                }
                let value = value.split('#').next().unwrap_or("").trim().trim_matches(['"', '\'']).to_lowercase();
                return match value.as_str() {
                    "true" | "yes" => Ok(false),
                    "false" | "no" => Ok(true),
                    other => {
                        let message = format!("`{}` must be true or false, but is `{}`", names[0], table::shown(other));
                        Err(self.at(Some(number), message, ""))
                    }
                };
            }
            Ok(false)
        };
        let in_air = denied(["wavelength_is_vacuum", "wavelength_vacuum"])?;
        let is_relative = denied(["n_is_absolute", "n_absolute"])?;
        if in_air {
            for table in [&mut index.n, &mut index.k].into_iter().flatten().flatten() {
                table.nm.iter_mut().for_each(|nm| *nm = unit::vacuum_nm(*nm));
                table.notes.push(unit::FROM_AIR.to_owned());
            }
        }
        if let (true, Some(Ok(n))) = (is_relative, &mut index.n) {
            n.value.iter_mut().zip(&n.nm).for_each(|(value, nm)| *value *= unit::air_index(*nm));
            n.notes.push(
                "gives n relative to air: it is multiplied by that of air (Ciddor 1996, dry air of 15 °C)".to_owned(),
            );
        }
        Ok(())
    }

    /// The columns of a tabulated block beside the wavelength, which is in um.
    fn columns<const N: usize>(&self, block: &Block, line: Option<usize>) -> Result<[SpectrumTable; N], Box<Problem>> {
        let Some(data) = &block.data else { return Err(self.at(line, "a tabulated block has no `data`", "")) };
        let first = line_of(data);
        let mut rows: Vec<(Option<usize>, Vec<f64>)> = Vec::new();
        let mut notes = Vec::new();
        for (i, row) in data.value.lines().enumerate() {
            let row = row.split('#').next().unwrap_or("").trim();
            if row.is_empty() {
                continue;
            }
            let line = first.map(|first| first + i);
            let numbers = self.numbers(row, line)?;
            if numbers.len() != N + 1 {
                let message = format!("has {} numbers where {} are expected", numbers.len(), N + 1);
                return Err(self.at(line, message, "a row is a wavelength in um and the values of the block's type"));
            }
            if numbers[0] <= 0.0 || !(numbers[0] * 1e3).is_finite() {
                return Err(self.at(line, format!("{} is no wavelength in um", numbers[0]), ""));
            }
            rows.push((line, numbers));
        }
        match &rows[..] {
            [] => return Err(self.at(line, "has no rows", "give at least one wavelength")),
            [only] => {
                notes.push(format!("gives one wavelength only, {} um: its values are taken to be constant", only.1[0]));
                // Two equal wavelengths, of which everything else is held.
                rows.push(rows[0].clone());
            }
            [first, .., last] if first.1[0] > last.1[0] => rows.reverse(),
            _ => {}
        }
        if let Some(pair) = rows.windows(2).find(|pair| pair[1].1[0] < pair[0].1[0]) {
            notes.push(format!(
                "has rows out of order, first at {} um, which follows {} um: they are sorted",
                pair[1].1[0], pair[0].1[0]
            ));
            rows.sort_by(|a, b| a.1[0].total_cmp(&b.1[0]));
        }
        let count = rows.len();
        if count > 2 {
            rows.dedup_by(|after, before| after.1 == before.1);
        }
        // What is left of equal wavelengths is a step from the first value to the last.
        let mut i = 2;
        while i < rows.len() {
            if rows[i - 2].1[0] == rows[i].1[0] {
                rows.remove(i - 1);
            } else {
                i += 1;
            }
        }
        if rows.len() < count {
            notes.push(format!(
                "has {} rows for wavelengths that it has already given: they are left out",
                count - rows.len()
            ));
        }
        if rows.len() < 2 {
            rows.push(rows[0].clone());
        }
        Ok(std::array::from_fn(|column| SpectrumTable {
            nm: rows.iter().map(|row| row.1[0] * 1e3).collect(),
            value: rows.iter().map(|row| row.1[column + 1]).collect(),
            line: rows.iter().map(|row| row.0.or(line).unwrap_or(1)).collect(),
            notes: notes.clone(),
            ..SpectrumTable::default()
        }))
    }

    /// A dispersion formula, tabulated over its range so finely that linear interpolation is as good.
    fn formula(&self, block: &Block, line: Option<usize>, number: &str) -> Result<SpectrumTable, Box<Problem>> {
        let list = |list: &Option<Spanned<String>>, name: &str| match list {
            Some(list) => self.numbers(&list.value, line_of(list)),
            None => Err(self.at(line, format!("a formula has no `{name}`"), "")),
        };
        let Some(formula) = number.parse().ok().and_then(Formula::new) else {
            return Err(self.at(line, format!("has a formula `{}`", number.escape_debug()), "formulas are 1 to 9"));
        };
        let mut coefficients = list(&block.coefficients, "coefficients")?;
        let mut notes = Vec::new();
        if formula.lacks_one(coefficients.len()) {
            notes.push(format!("has a formula {number} without its last coefficient, which is taken as 0"));
            coefficients.push(0.0);
        }
        if !formula.takes(coefficients.len()) {
            let message = format!("formula {number} cannot have {} coefficients", coefficients.len());
            return Err(self.at(block.coefficients.as_ref().and_then(line_of).or(line), message, ""));
        }
        let range = list(&block.wavelength_range, "wavelength_range")?;
        let at = block.wavelength_range.as_ref().and_then(line_of).or(line);
        let &[from, to] = &range[..] else {
            return Err(self.at(at, format!("a range has two numbers, not {}", range.len()), ""));
        };
        if !(SHORTEST_UM <= from && from < to && to <= LONGEST_UM) {
            return Err(self.at(at, format!("{from} to {to} um is no range of wavelengths"), ""));
        }

        let n = |um: f64| formula.eval(&coefficients, um);
        let tabulated = |from: f64, to: f64| {
            let mut nodes = vec![(from, n(from))];
            subdivide(&n, (from, n(from)), (to, n(to)), MAX_HALVINGS, &mut nodes);
            nodes
        };
        let is_wrong = |(_, n): &&(f64, f64)| !(n.is_finite() && *n > 0.0);
        let mut nodes = tabulated(from, to);
        if let Some(&(um, _)) = nodes.iter().find(is_wrong) {
            nodes = match self.needed.map(|needed| needed.map(|nm| (nm / 1e3).clamp(from, to))) {
                // Channels beside the range see the nearest end of it only.
                Some([first, last]) if first == last => vec![(first, n(first)); 2],
                Some([first, last]) => tabulated(first, last),
                None => nodes,
            };
            if nodes.iter().any(|node| is_wrong(&node)) {
                return Err(self.at(line, format!("the formula has no real value at {um} um"), "narrow its range"));
            }
            notes.push(format!("has a formula without a real value at {um} um, within the range of its page: it is read within the channels only"));
        }
        let (nm, value): (Vec<f64>, Vec<f64>) = nodes.into_iter().map(|(um, n)| (um * 1e3, n)).unzip();
        Ok(SpectrumTable { line: vec![line.unwrap_or(1); nm.len()], nm, value, notes, ..SpectrumTable::default() })
    }

    fn numbers(&self, text: &str, line: Option<usize>) -> Result<Vec<f64>, Box<Problem>> {
        let number = |word: &str| {
            let number = word.parse::<f64>().ok().filter(|x| x.is_finite());
            number.ok_or_else(|| self.at(line, format!("`{}` is not a finite number", word.escape_debug()), ""))
        };
        text.split_whitespace().map(number).collect()
    }
}

/// The line a value stands on: the first of the lines of a block of text.
fn line_of(value: &Spanned<String>) -> Option<usize> {
    Some(value.referenced.line() as usize).filter(|line| *line > 0)
}

/// Adds nodes after `a` up to `b` until the middle of each piece is where a line would have it.
fn subdivide(f: &dyn Fn(f64) -> f64, a: (f64, f64), b: (f64, f64), halvings: u32, nodes: &mut Vec<(f64, f64)>) {
    // Equal ratios: resonances are narrow at short wavelengths.
    let x = (a.0 * b.0).sqrt();
    let middle = (x, f(x));
    let line = a.1 + (x - a.0) / (b.0 - a.0) * (b.1 - a.1);
    // A straight middle alone can be a coincidence; the first levels are always there.
    let straight = (middle.1 - line).abs() <= TABLE_ERROR * middle.1.abs() && halvings + 4 <= MAX_HALVINGS;
    if halvings > 0 && !straight && middle.1.is_finite() {
        subdivide(f, a, middle, halvings - 1, nodes);
        subdivide(f, middle, b, halvings - 1, nodes);
        return;
    }
    if !middle.1.is_finite() {
        nodes.push(middle);
    }
    nodes.push(b);
}

/// The dispersion formulas of refractiveindex.info (its document "Dispersion formulas", C1 = c\[0\], λ in um).
#[derive(Clone, Copy)]
struct Formula(u8);

impl Formula {
    fn new(number: u8) -> Option<Self> {
        (1..=9).contains(&number).then_some(Formula(number))
    }

    /// Whether there may be `count` coefficients: those not given at the end are 0, but pairs are whole.
    fn takes(self, count: usize) -> bool {
        match self.0 {
            1 | 2 | 3 | 5 | 6 => count % 2 == 1,
            4 => count == 1 || count == 5 || (count >= 9 && count % 2 == 1),
            8 => (1..=4).contains(&count),
            _ => (1..=6).contains(&count),
        }
    }

    /// Whether the second number of the last pair is missing.
    fn lacks_one(self, count: usize) -> bool {
        matches!(self.0, 1 | 2 | 3 | 5 | 6) && count > 1 && !self.takes(count)
    }

    /// n at `um`; not finite where the formula has no real value.
    fn eval(self, c: &[f64], um: f64) -> f64 {
        let at = |i: usize| c.get(i).copied().unwrap_or(0.0);
        let square = um * um;
        let pairs = |first: usize| (first..c.len()).step_by(2).map(|i| (c[i], at(i + 1)));
        let powers = |first: usize| pairs(first).map(|(c, power)| c * um.powf(power)).sum::<f64>();
        match self.0 {
            1 => (1.0 + at(0) + pairs(1).map(|(b, c)| b * square / (square - c * c)).sum::<f64>()).sqrt(),
            2 => (1.0 + at(0) + pairs(1).map(|(b, c)| b * square / (square - c)).sum::<f64>()).sqrt(),
            3 => (at(0) + powers(1)).sqrt(),
            4 => {
                let term = |i: usize| {
                    if at(i) == 0.0 { 0.0 } else { at(i) * um.powf(at(i + 1)) / (square - at(i + 2).powf(at(i + 3))) }
                };
                (at(0) + term(1) + term(5) + powers(9)).sqrt()
            }
            5 => at(0) + powers(1),
            6 => 1.0 + at(0) + pairs(1).map(|(b, c)| b / (c - square.recip())).sum::<f64>(),
            7 => {
                let pole = (square - 0.028).recip();
                at(0) + at(1) * pole + at(2) * pole * pole + square * (at(3) + square * (at(4) + square * at(5)))
            }
            8 => {
                let q = at(0) + at(1) * square / (square - at(2)) + at(3) * square;
                ((1.0 + 2.0 * q) / (1.0 - q)).sqrt()
            }
            _ => {
                let shifted = um - at(4);
                (at(0) + at(1) / (square - at(2)) + at(3) * shifted / (shifted * shifted + at(5))).sqrt()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// n and k, both right if they are there.
    fn yaml(text: &str) -> Result<[Option<SpectrumTable>; 2], Box<Problem>> {
        let Index { n, k } = parse(text.as_bytes(), Path::new("t.yml"), None)?;
        Ok([n.transpose()?, k.transpose()?])
    }

    fn interpolated(table: &SpectrumTable, nm: f64) -> f64 {
        let i = table.nm.partition_point(|x| *x <= nm).clamp(1, table.nm.len() - 1);
        let t = (nm - table.nm[i - 1]) / (table.nm[i] - table.nm[i - 1]);
        table.value[i - 1] + t * (table.value[i] - table.value[i - 1])
    }

    #[test]
    fn tables_and_their_lines() {
        let text = "# about\nREFERENCES: |\n    A. Name, <i>J.</i> (2012): 5\nCOMMENTS: \"none\"\nDATA:\n  - type: tabulated nk\n    data: |\n        3.000E-01 1.596E+00 1.888\n        0.4 1.5 0\nPROPERTIES:\n  - type: formula A\n";
        let [Some(n), Some(k)] = yaml(text).unwrap() else { panic!("both are given") };
        assert_eq!((n.nm, n.value, n.line), (vec![300.0, 400.0], vec![1.596, 1.5], vec![8, 9]));
        assert_eq!(k.value, [1.888, 0.0]);
        let apart = "DATA:\n- type: tabulated k\n  data: |\n    0.5 2\n    0.4 1\n- type: tabulated n\n  data: |\n    0.3 1.5\n    0.5 1.6\n";
        let [Some(n), Some(k)] = yaml(apart).unwrap() else { panic!("both are given") };
        assert_eq!((n.nm, k.nm, k.value), (vec![300.0, 500.0], vec![400.0, 500.0], vec![1.0, 2.0]));
        assert_eq!(k.line, [5, 4]);
    }

    /// The database has said what wavelengths are relative to in several places.
    #[test]
    fn what_changes_numbers_is_applied_or_refused() {
        let rows = "DATA:\n  - type: tabulated n\n    data: |\n        0.4 1.5\n        0.5 1.6\n";
        for place in ["SPECS", "Specs", "PROPERTIES", "CONDITIONS"] {
            for key in ["wavelength_is_vacuum", "wavelength_vacuum"] {
                let [Some(n), _] = yaml(&format!("{rows}{place}:\n    {key}: false\n")).unwrap() else { panic!("n") };
                assert_eq!(n.nm, [400.0, 500.0].map(unit::vacuum_nm), "{place}: {key}");
                let [Some(n), _] = yaml(&format!("{rows}{place}:\n    {key}: true\n")).unwrap() else { panic!("n") };
                assert_eq!(n.nm, [400.0, 500.0]);
            }
        }
        for key in ["scale: 2", "unit: nm", "offset: 0.1"] {
            let problem = yaml(&rows.replace("    data:", &format!("    {key}\n    data:"))).unwrap_err();
            assert!(problem.message.contains("not applied") && problem.line == Some(3), "{key}: {problem}");
        }
    }

    /// Sellmeier's formula with Schott's coefficients of N-BK7 (data sheet, 2017) and its published indices; Malitson's
    /// of fused silica (J. Opt. Soc. Am. 55, 1205, 1965), which squares the poles.
    #[test]
    fn sellmeier_formulas_have_their_published_values() {
        let bk7 = "DATA:\n  - type: formula 2\n    wavelength_range: 0.3 2.5\n    coefficients: 0 1.03961212 0.00600069867 0.231792344 0.0200179144 1.01046945 103.560653\n  - type: tabulated k\n    data: |\n      0.3 2.8607E-06\n      2.5 1E-4\n";
        let [Some(n), Some(k)] = yaml(bk7).unwrap() else { panic!("both are given") };
        for (nm, index) in [
            (404.66, 1.530239),
            (486.13, 1.522376),
            (546.07, 1.518722),
            (587.56, 1.516800),
            (1014.0, 1.507308),
            (2000.0, 1.494502),
        ] {
            assert!((interpolated(&n, nm) - index).abs() < 1e-6, "{nm} nm: {}", interpolated(&n, nm));
        }
        assert_eq!(k.nm, [300.0, 2500.0]);
        assert!(n.nm.len() < 5000, "{} nodes", n.nm.len());
        let silica = "DATA:\n  - type: formula 1\n    range: 0.21 6.7\n    coefficients: 0 0.6961663 0.0684043 0.4079426 0.1162414 0.8974794 9.896161\n";
        let [Some(n), _] = yaml(silica).unwrap() else { panic!("n is given") };
        // Malitson's table I.
        for (nm, index) in [(587.5618, 1.45846), (1529.582, 1.44427)] {
            assert!((interpolated(&n, nm) - index).abs() < 1e-5, "{nm} nm: {}", interpolated(&n, nm));
        }
    }

    /// Each formula at 0.5 um, where λ² = ¼, with round coefficients worked out by hand.
    #[test]
    fn every_formula_by_hand() {
        for (number, coefficients, expected) in [
            (1u8, "0.25 1 0 0.75 1e-200", 3f64.sqrt()),
            (2, "0.25 0.5 -0.25", 1.5f64.sqrt()),
            (3, "2 1 2 0.5 -2", 4.25f64.sqrt()),
            (4, "1 1 2 0.5 2 0 0 0 0 1 1", f64::NAN),
            (4, "1 0.5 2 0.5 1 0.5 0 0.5 2 1 -1", f64::NAN),
            (4, "1 0.5 2 0.1 1 0.75 1 0.5 3 1 -1", (1.0 + 0.125 / 0.15 + 0.375 / 0.125 + 2.0f64).sqrt()),
            (5, "1.25 0.5 1", 1.5),
            (6, "0.25 1 6", 1.75),
            (7, "1 0.222 0 1 4 16", 1.0 + 1.0 + 0.25 + 0.25 + 0.25),
            (8, "0.125 0.125 -0.25 0.25", 2f64.sqrt()),
            (9, "1 0.5 -0.25 1 0.25 0.0625", (1.0 + 1.0 + 2.0f64).sqrt()),
        ] {
            let c: Vec<f64> = coefficients.split(' ').map(|c| c.parse().unwrap()).collect();
            let formula = Formula::new(number).unwrap();
            let got = formula.eval(&c, 0.5);
            if expected.is_nan() {
                assert!(!got.is_finite(), "{number}: {got}, where the pole is at 0.5 um");
            } else {
                assert!(formula.takes(c.len()), "{number}");
                assert!((got - expected).abs() < 1e-14, "{number}: {got}, expected {expected}");
            }
        }
    }

    #[test]
    fn mistakes_name_their_line() {
        for (text, line, words) in [
            ("", Some(1), "not what is expected"),
            ("DATA: []\n", None, "no data"),
            ("DATA: 3\n", Some(1), "not what is expected"),
            ("REFERENCES: x\n", Some(1), "DATA"),
            ("DATA:\n  - data: |\n      1 1\n", Some(2), "type"),
            ("DATA:\n  - type: tabulated n2\n    data: |\n      1 1\n", Some(2), "`tabulated n2`"),
            ("DATA:\n  - type: formula 10\n    wavelength_range: 1 2\n    coefficients: 1\n", Some(2), "formula `10`"),
            ("DATA:\n  - type: formula 5\n    wavelength_range: 1 2\n", Some(2), "no `coefficients`"),
            ("DATA:\n  - type: formula 5\n    coefficients: 1.5\n", Some(2), "no `wavelength_range`"),
            ("DATA:\n  - type: formula 5\n    wavelength_range: 2 1\n    coefficients: 1.5\n", Some(3), "no range"),
            (
                "DATA:\n  - type: formula 4\n    wavelength_range: 1 2\n    coefficients: 1.5 2\n",
                Some(4),
                "2 coefficients",
            ),
            (
                "DATA:\n  - type: formula 3\n    wavelength_range: 1 2\n    coefficients: -4\n",
                Some(2),
                "no real value at 1 um",
            ),
            ("DATA:\n  - type: tabulated nk\n    data: |\n      1 1 1\n      2 1\n", Some(5), "2 numbers where 3"),
            ("DATA:\n  - type: tabulated n\n    data: |\n      1 1\n      2 x\n", Some(5), "`x` is not a finite"),
            ("DATA:\n  - type: tabulated n\n    data: |\n      # none\n", Some(2), "no rows"),
            ("COMMENTS: a\nCOMMENTS: b\nDATA:\n  - type: tabulated n\n    data: |\n      1 1\n", Some(2), "had before"),
            (
                "DATA:\n  - type: tabulated n\n    data: |\n      1 1\n      2 1\n  - type: formula 5\n    wavelength_range: 1 2\n    coefficients: 1.5\n",
                Some(6),
                "n a second time",
            ),
        ] {
            let problem = yaml(text).unwrap_err();
            assert!(problem.to_string().contains(words), "{text:?}: {problem}");
            assert_eq!(problem.line, line, "{text:?}: {problem}");
            assert!(!problem.message.contains('\n'), "{problem}");
        }
    }

    #[test]
    fn blemishes_are_mended_with_a_word() {
        let table = |rows: &str| {
            let text =
                format!("DATA:\n  - type: tabulated nk\n    data: |\n        {}\n", rows.replace('\n', "\n        "));
            let [Some(n), Some(k)] = yaml(&text).unwrap() else { panic!("both are given") };
            (n.nm, n.value, k.value, n.notes.join("; "))
        };
        let (nm, n, k, notes) = table("# wl n k\n0.4 1.5 0 # first\n0.5 1.4 1\n0.5 1.4 1\n0.6 1.3 2");
        assert_eq!((nm, n, k), (vec![400.0, 500.0, 600.0], vec![1.5, 1.4, 1.3], vec![0.0, 1.0, 2.0]));
        assert!(notes.contains("1 rows"), "{notes}");
        // Different values at one wavelength are a step, of the first and the last of them.
        let (nm, n, ..) = table("0.4 1.5 0\n0.5 1.4 1\n0.5 9 9\n0.5 1.2 1\n0.6 1.3 2");
        assert_eq!((nm, n), (vec![400.0, 500.0, 500.0, 600.0], vec![1.5, 1.4, 1.2, 1.3]));
        let (nm, _, k, notes) = table("0.4 1 0\n0.6 1 2\n0.5 1 1\n0.7 1 3");
        assert_eq!((nm, k), (vec![400.0, 500.0, 600.0, 700.0], vec![0.0, 1.0, 2.0, 3.0]));
        assert!(notes.contains("out of order"), "{notes}");
        let (nm, n, _, notes) = table("0.5876 1.473 0");
        assert_eq!((nm, n), (vec![587.6, 587.6], vec![1.473, 1.473]));
        assert!(notes.contains("one wavelength only"), "{notes}");
    }

    /// A formula that is real in the channels, and not all over the range of its page.
    #[test]
    fn a_pole_far_away_is_left_out() {
        let text =
            "DATA:\n  - type: formula 2\n    wavelength_range: 0.35 50\n    coefficients: 0 6.44 0.05 3.16 2200\n";
        let read = |needed| parse(text.as_bytes(), Path::new("t.yml"), needed).unwrap().n.unwrap();
        assert!(read(None).unwrap_err().message.contains("no real value"));
        let n = read(Some([400.0, 700.0])).unwrap();
        assert_eq!((n.nm.first(), n.nm.last(), n.notes.len()), (Some(&400.0), Some(&700.0), 1));
        // n² = 1 + 6.44/(1 - 0.05/λ²) + 3.16/(1 - 2200/λ²) at 0.5 um.
        let expected = (1.0 + 6.44 / (1.0 - 0.05 / 0.25) + 3.16 / (1.0 - 2200.0 / 0.25f64)).sqrt();
        assert!((interpolated(&n, 500.0) - expected).abs() < 2e-8 * expected);
        assert!(read(Some([40_000.0, 49_000.0])).is_err());
    }

    /// Of a pair that is not whole the second number is 0, and beside its range a formula has the value of its nearest end.
    #[test]
    fn what_formulas_leave_out() {
        let text = "DATA:\n  - type: formula 5\n    wavelength_range: 1 2\n    coefficients: 1.5 2\n";
        let [Some(n), _] = yaml(text).unwrap() else { panic!("n is given") };
        assert!(n.value.iter().all(|n| *n == 3.5) && n.notes.len() == 1, "{:?}", n.notes);
        let text = "DATA:\n  - type: formula 2\n    wavelength_range: 2 50\n    coefficients: 0 6.44 0.05 3.16 2200\n";
        let n = parse(text.as_bytes(), Path::new("t.yml"), Some([400.0, 700.0])).unwrap().n.unwrap().unwrap();
        let expected = (1.0 + 6.44 / (1.0 - 0.05 / 4.0) + 3.16 / (1.0 - 2200.0 / 4.0f64)).sqrt();
        assert!(n.nm == [2000.0; 2] && n.value.iter().all(|n| (n - expected).abs() < 1e-15), "{n:?}");
    }

    /// As the database's pages of glasses have it. Of the sodium line in air NIST gives the wavelength in vacuum.
    #[test]
    fn what_is_relative_to_air_is_brought_to_vacuum() {
        let page = |specs: &str| {
            format!(
                "DATA:\n  - type: tabulated nk\n    data: |\n        0.588995095 1.5 0.25\n        0.9 1.5 0.25\nSPECS:\n{specs}    temperature: 20.0 °C\n"
            )
        };
        let read = |specs: &str| {
            let [Some(n), Some(k)] = yaml(&page(specs)).unwrap() else { panic!("both are given") };
            (n, k)
        };
        let (n, k) = read("    n_is_absolute: false\n    wavelength_is_vacuum: false\n");
        assert!((n.nm[0] - 589.158_326).abs() < 2e-4 && k.nm == n.nm, "{n:?}");
        // λ in vacuum over λ in air is the index of air.
        assert!((n.value[0] / 1.5 - 589.158_326 / 588.995_095).abs() < 1e-7, "{n:?}");
        assert_eq!((k.value[0], n.notes.len(), k.notes.len()), (0.25, 2, 1));
        let (n, _) = read("    n_is_absolute: false\n    wavelength_is_vacuum: true\n");
        assert!(n.nm[0] == 588.995095 && n.value[0] > 1.5 && n.notes[0].contains("multiplied by that of air"), "{n:?}");
        let (n, _) = read("    n_is_absolute: true\n");
        assert_eq!((n.value[0], n.notes.len()), (1.5, 0));
        let problem = yaml(&page("    n_is_absolute: perhaps\n")).unwrap_err();
        assert!(problem.line == Some(7) && problem.message.contains("true or false, but is `perhaps`"), "{problem}");
        let formula = "DATA:\n  - type: formula 5\n    wavelength_range: 0.4 0.8\n    coefficients: 1.5\nSPECS:\n  n_is_absolute: false\n";
        let [Some(n), _] = yaml(formula).unwrap() else { panic!("n is given") };
        assert!(n.value.iter().all(|n| *n > 1.5004 && *n < 1.50043), "{n:?}");
    }

    #[test]
    fn a_single_coefficient_is_a_list_too() {
        let text = "DATA:\n  - type: formula 5\n    range: 1 2\n    coefficients: 1.5\n";
        let [Some(n), _] = yaml(text).unwrap() else { panic!("n is given") };
        assert!(n.value.iter().all(|n| *n == 1.5) && n.nm.first() == Some(&1000.0) && n.nm.last() == Some(&2000.0));
    }
}
