//! `spectile stress`: numerical stability on stiff and extreme cases.

use std::path::PathBuf;
use std::sync::Arc;

use serde_json::json;

use super::Output;
use crate::gpu::adapter::{Gpu, Selection};
use crate::report::{self, Circumstances};
use crate::stress::{self, Case, Machine};
use crate::{Error, Result};

/// Render stiff and extreme cases, and compare each with its answer
///
/// Lines far narrower than channels, Planck's law from 3 K to 50,000 K, optical depths from 1e-9 to 1e6, hundreds of bounces,
/// roughness and indices at their ends, scenes of all sizes: every case prints its answer, its error, the bound and a verdict, and
/// samples that were not finite or negative. The exit code is 1 if any fails.
#[derive(Debug, clap::Args)]
#[command(after_long_help = "\
Examples:
  spectile stress                       all cases
  spectile stress --list                what there is
  spectile stress --case cavity         one of them, with every check
  spectile stress -o report             all, and report/stress.html, .csv, .json")]
pub struct Args {
    /// Only this case (repeatable); prints all of its checks
    #[arg(long = "case", value_name = "NAME")]
    pub cases: Vec<String>,

    /// Say which cases there are, and stop
    #[arg(long)]
    pub list: bool,

    /// The folder for a report
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,

    /// The device, as for `render`; the first of several is used
    #[arg(long, value_name = "all|N|LIST", default_value = "all")]
    pub devices: Selection,

    /// One JSON object a line on stdout, instead of text
    #[arg(long)]
    pub json: bool,
}

pub fn run(args: &Args, output: &Output) -> Result<()> {
    let cases = chosen(args)?;
    if args.list {
        for case in &cases {
            output.text(&format!("{:16} {}: {}\n", case.name, case.group, case.what))?;
        }
        return Ok(());
    }
    let interrupt = output.interrupt()?;
    if let Some(folder) = &args.output {
        report::make_folder(folder, "stress")?;
    }
    let gpu = Arc::new(Gpu::open_all(&args.devices)?.remove(0));
    let circumstances = Circumstances::now(&gpu);
    let machine = Machine { gpu, devices: args.devices.clone(), interrupt };
    output.event("start", json!({ "cases": cases.len(), "measured": circumstances.facts() }))?;
    let mut outcomes = Vec::new();
    for case in cases {
        let outcome = stress::run(&case, &machine)?;
        output.event("case", stress::facts(&case, &outcome))?;
        output.text(&line(&case, &outcome))?;
        if !args.cases.is_empty() {
            for c in &outcome.checks {
                let verdict = if c.passes() { "pass" } else { "FAIL" };
                output.text(&format!(
                    "  {verdict} {}: {:.9e}, expected {:.9e} ± {:.1e}\n",
                    c.what, c.got, c.expected, c.bound
                ))?;
            }
        }
        outcomes.push((case, outcome));
        if let Some(folder) = &args.output {
            let facts: Vec<_> = outcomes.iter().map(|(case, outcome)| stress::facts(case, outcome)).collect();
            let json = json!({ "measured": circumstances.facts(), "cases": facts });
            report::write(folder, "stress", &stress::csv(&outcomes), &json, &stress::html(&outcomes, &circumstances))?;
        }
    }
    let failed: Vec<&str> = outcomes.iter().filter(|(_, o)| !o.passes()).map(|(case, _)| case.name).collect();
    output.event("done", json!({ "cases": outcomes.len(), "failed": failed }))?;
    match failed.len() {
        0 => output.text(&format!("{} cases passed\n", outcomes.len())),
        n => Err(Error::Check(format!("{n} of {} cases failed: {}", outcomes.len(), failed.join(", ")))),
    }
}

fn line(case: &Case, outcome: &stress::Outcome) -> String {
    let bad = outcome.bad_samples();
    let bad = if bad > 0 { format!(", {bad} bad samples") } else { String::new() };
    let what = match (&outcome.error, outcome.worst()) {
        (Some(error), _) => error.clone(),
        (None, Some(c)) => {
            format!(
                "{}: {:.7e}, expected {:.7e}, off by {:.1e} of {:.1e} allowed",
                c.what,
                c.got,
                c.expected,
                (c.got - c.expected).abs(),
                c.bound
            )
        }
        (None, None) => "nothing was checked".into(),
    };
    let verdict = if outcome.passes() { "pass" } else { "FAIL" };
    format!("{verdict} {} ({} checks, {:.1} s{bad}); worst: {what}\n", case.name, outcome.checks.len(), outcome.seconds)
}

fn chosen(args: &Args) -> Result<Vec<Case>> {
    let all = stress::cases();
    if args.cases.is_empty() {
        return Ok(all);
    }
    let find = |name: &String| {
        all.iter().find(|case| case.name == name).copied().ok_or_else(|| {
            let names: Vec<&str> = all.iter().map(|case| case.name).collect();
            Error::Usage(format!("--case {name}: there is no such case; there are {}", names.join(", ")))
        })
    };
    args.cases.iter().map(find).collect()
}
