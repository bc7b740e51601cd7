//! The stress suite: stiff and extreme cases, each with an answer from elsewhere, an error and a bound.
//!
//! Cases are scenes as users write them, rendered by the renderer that they use; answers are closed forms, worked out beside each.

mod aiming;
mod bench;
mod chi_square;
mod geometry;
mod interreflection;
mod invariance;
pub mod probe;
mod range;
mod sampling;
mod scattering;
mod spectra;
mod surfaces;

use serde_json::{Value, json};

pub use bench::{Bench, Machine};

use crate::Result;
use crate::format::csv_table::Table;
use crate::report::page::Page;
use crate::report::{Circumstances, STRESS_CSV_HEADER};

/// One row of the suite.
#[derive(Clone, Copy)]
pub struct Case {
    pub group: &'static str,
    pub name: &'static str,
    /// What is stressed, the answer, and where it comes from.
    pub what: &'static str,
    run: fn(&mut Bench) -> Result<()>,
}

/// A number that was rendered, and what it should be.
#[derive(Debug, Clone, PartialEq)]
pub struct Check {
    pub what: String,
    pub expected: f64,
    pub got: f64,
    /// How far it may be off: what f32 and tables allow, and five standard errors.
    pub bound: f64,
    pub standard_error: f64,
}

/// What became of a case.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    pub checks: Vec<Check>,
    pub non_finite: u64,
    pub negative: u64,
    pub overflow: u64,
    /// Why there is no answer, where there is none.
    pub error: Option<String>,
    pub seconds: f64,
}

impl Check {
    /// NaN is within no bound.
    pub fn passes(&self) -> bool {
        (self.got - self.expected).abs() <= self.bound
    }

    pub fn verdict(&self) -> &'static str {
        verdict(self.passes())
    }

    /// The error over its bound: 1 and more fails.
    fn share(&self) -> f64 {
        let off = (self.got - self.expected).abs();
        if off == 0.0 { 0.0 } else { off / self.bound }
    }
}

impl Outcome {
    pub fn passes(&self) -> bool {
        self.bad_samples() == 0
            && self.error.is_none()
            && !self.checks.is_empty()
            && self.checks.iter().all(Check::passes)
    }

    pub fn verdict(&self) -> &'static str {
        verdict(self.passes())
    }

    /// Not finite, negative, or of a path that found no end in a structure.
    pub fn bad_samples(&self) -> u64 {
        self.non_finite + self.negative + self.overflow
    }

    /// The check that is nearest to its bound, or furthest beyond.
    pub fn worst(&self) -> Option<&Check> {
        let share = |check: &Check| if check.passes() { check.share() } else { check.share().max(1.0) };
        self.checks.iter().max_by(|a, b| share(a).total_cmp(&share(b)))
    }
}

fn verdict(passes: bool) -> &'static str {
    if passes { "pass" } else { "fail" }
}

/// All cases, group by group, in the order in which they run and are listed.
pub fn cases() -> Vec<Case> {
    let groups = [spectra::CASES, range::CASES, interreflection::CASES, surfaces::CASES, geometry::CASES];
    [&groups[..], &[scattering::CASES, aiming::CASES, sampling::CASES, invariance::CASES]].concat().concat()
}

/// Runs a case. Errors: an interrupt; what else goes wrong is the case's outcome.
pub fn run(case: &Case, machine: &Machine) -> Result<Outcome> {
    let began = std::time::Instant::now();
    let mut bench = Bench::new(case.name, machine);
    let error = match (case.run)(&mut bench) {
        Ok(()) => None,
        Err(error @ crate::Error::Interrupted { .. }) => return Err(error),
        Err(error) => Some(error.to_string()),
    };
    Ok(Outcome { error, seconds: began.elapsed().as_secs_f64(), ..bench.outcome })
}

/// The facts of a case that has been run.
pub fn facts(case: &Case, outcome: &Outcome) -> Value {
    let check = |c: &Check| {
        json!({
            "what": c.what, "expected": c.expected, "got": c.got, "error": c.got - c.expected, "bound": c.bound,
            "standard_error": c.standard_error, "verdict": c.verdict(),
        })
    };
    json!({
        "group": case.group, "case": case.name, "what": case.what, "verdict": outcome.verdict(),
        "non_finite_samples": outcome.non_finite, "negative_samples": outcome.negative,
        "unended_traversals": outcome.overflow, "failed": outcome.error, "seconds": outcome.seconds,
        "checks": outcome.checks.iter().map(check).collect::<Vec<_>>(),
    })
}

/// The report as CSV: one row a check.
pub fn csv(outcomes: &[(Case, Outcome)]) -> String {
    let mut table = Table::new(STRESS_CSV_HEADER.split(','));
    for (case, outcome) in outcomes {
        for c in &outcome.checks {
            let numbers = [c.expected, c.got, c.got - c.expected, c.bound, c.standard_error];
            let [expected, got, error, bound, standard_error] = numbers.map(|number| format!("{number:e}"));
            let (group, name) = (case.group.to_owned(), case.name.to_owned());
            let verdict = c.verdict().to_owned();
            table.row([group, name, c.what.clone(), expected, got, error, bound, standard_error, verdict]);
        }
    }
    table.finish()
}

/// The report as a page.
pub fn html(outcomes: &[(Case, Outcome)], circumstances: &Circumstances) -> String {
    let failed = outcomes.iter().filter(|(_, outcome)| !outcome.passes()).count();
    let mut page = Page::new(
        "Stiff and extreme cases",
        &format!(
            "{} cases, {failed} failed. Bounds are what f32 and tables allow, and five standard errors.",
            outcomes.len()
        ),
    );
    page.paragraph(&circumstances.sentence());
    let head = ["case", "worst of its checks", "expected", "got", "bound", "checks", "bad samples", "verdict"];
    let head = head.map(str::to_owned);
    let mut group = "";
    let mut rows: Vec<Vec<String>> = Vec::new();
    for (case, outcome) in outcomes {
        if case.group != group {
            if !rows.is_empty() {
                page.table(&head, &std::mem::take(&mut rows));
            }
            page.heading(case.group);
            group = case.group;
        }
        let mut row = vec![format!("{}: {}", case.name, case.what)];
        match (&outcome.error, outcome.worst()) {
            (Some(error), _) => row.extend([error.clone(), String::new(), String::new(), String::new()]),
            (None, Some(c)) => row.extend([
                c.what.clone(),
                format!("{:.7e}", c.expected),
                format!("{:.7e}", c.got),
                format!("{:.1e}", c.bound),
            ]),
            (None, None) => row.extend(std::iter::repeat_n(String::new(), 4)),
        }
        row.extend([outcome.checks.len().to_string(), outcome.bad_samples().to_string(), outcome.verdict().to_owned()]);
        rows.push(row);
    }
    if !rows.is_empty() {
        page.table(&head, &rows);
    }
    page.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(got: f64) -> Outcome {
        let check = Check { what: "x".into(), expected: 1.0, got, bound: 0.1, standard_error: 0.0 };
        Outcome { checks: vec![check], ..Outcome::default() }
    }

    #[test]
    fn what_is_not_right_fails() {
        assert!(outcome(1.05).passes());
        for wrong in [1.2, f64::NAN, f64::INFINITY] {
            assert!(!outcome(wrong).passes());
        }
        assert!(!Outcome { negative: 1, ..outcome(1.0) }.passes());
        assert!(!Outcome { error: Some("refused".into()), ..outcome(1.0) }.passes());
        assert!(!Outcome { checks: Vec::new(), ..outcome(1.0) }.passes());
    }

    #[test]
    fn cases_have_names_of_their_own() {
        let mut names: Vec<_> = cases().iter().map(|case| case.name).collect();
        names.sort_unstable();
        let count = names.len();
        names.dedup();
        assert_eq!(names.len(), count);
    }
}
