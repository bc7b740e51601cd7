//! `phase`: where scattered light goes.

use std::sync::Arc;

use super::decode::Item;
use super::keys;
use super::spectrum::{Handle, Quantity, Spectra, report_in_file};
use super::{Phase, PhaseTable};
use crate::format::phase;
use crate::spectral::Curve;

/// By how much the mean of a table may be off before that is told of.
const NOTED: f64 = 0.01;

/// A phase function whose spectrum is not in the scene yet.
pub enum Pattern {
    HenyeyGreenstein(Handle),
    Rayleigh(f64),
    Table(Arc<PhaseTable>),
}

impl Pattern {
    pub fn take(&self, spectra: &mut Spectra) -> Phase {
        match self {
            Pattern::HenyeyGreenstein(g) => Phase::HenyeyGreenstein(spectra.take(*g)),
            Pattern::Rayleigh(depolarisation) => Phase::Rayleigh { depolarisation: *depolarisation },
            Pattern::Table(table) => Phase::Table(table.clone()),
        }
    }
}

/// The phase function that `item` describes; without one, the same in all directions.
pub fn pattern<'a>(item: Option<&Item<'a>>, spectra: &mut Spectra<'a>) -> Option<Pattern> {
    let Some(item) = item else {
        return Some(Pattern::HenyeyGreenstein(spectra.add("isotropic", Curve::Constant(0.0))));
    };
    let chosen = item.table(&keys::PHASE)?.exactly_one("phase function")?;
    match chosen.path.rsplit('.').next() {
        Some("hg") => spectra.resolve(&chosen, Quantity::Asymmetry).map(Pattern::HenyeyGreenstein),
        Some("rayleigh") => {
            let range = "a depolarisation factor in [0, 0.5]";
            chosen.number_where(|factor| (0.0..=0.5).contains(&factor), range).map(Pattern::Rayleigh)
        }
        _ => table(&chosen, spectra).map(|table| Pattern::Table(Arc::new(table))),
    }
}

fn table<'a>(item: &Item<'a>, spectra: &Spectra<'a>) -> Option<PhaseTable> {
    let path = item.cx.path(item.text()?);
    let read = phase::read(&path).map_err(|problem| report_in_file(item, *problem)).ok()?;
    let table = read.table;
    let off = |mean: &&f64| (**mean - 1.0).abs() > NOTED;
    if let Some(mean) = read.means.iter().find(off) {
        let all = read.means.iter().filter(off).count();
        let others = if all > 1 { format!(" ({all} columns are off)") } else { String::new() };
        spectra.warn(format!(
            "{}: the mean over the sphere of a phase function is {mean:.6}, not 1: divided by it{others}",
            path.display()
        ));
    }
    let (first, last) = (table.nm[0], table.nm[table.nm.len() - 1]);
    if table.nm.len() > 1
        && let Some(gap) = spectra.uncovered(first, last)
    {
        spectra.warn(format!("{} does not cover {gap}: its outermost columns are held there", path.display()));
    }
    Some(table)
}
