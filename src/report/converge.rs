//! Error against run time: curves of several ways to render one scene, what they come to, and the report of it.

use std::fmt::Write;

use serde_json::{Value, json};

use super::Circumstances;
use super::convergence::{Point, mean, root_mean_square};
use super::page::Page;
use crate::Result;
use crate::format::csv_table::Table;
use crate::format::plot::{Line, log_log};

/// Channel groups that curves are drawn for, at most.
const GROUPS: usize = 4;
/// Errors, root mean square over channels, whose times are asked for.
const ERRORS: [f64; 5] = [0.1, 0.05, 0.02, 0.01, 0.005];
/// Points below so many samples are no part of a slope: the first epochs are small and their times those of start-up.
const SLOPE_FROM: u32 = 4;

/// One way to render, and how it went so far.
pub struct Curve {
    pub name: String,
    /// Wavelengths of the channels, nm, for groups.
    pub centres: Vec<f64>,
    /// What it is compared with.
    pub reference: String,
    pub points: Vec<Point>,
}

/// What a report is made of.
pub struct Report {
    pub scene: String,
    pub circumstances: Circumstances,
    pub curves: Vec<Curve>,
}

/// log y = intercept + slope log x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    pub slope: f64,
    pub intercept: f64,
}

impl Fit {
    /// Least squares over points with both above 0; `None` below two of them.
    pub fn of(points: impl Iterator<Item = (f64, f64)>) -> Option<Fit> {
        let logs: Vec<(f64, f64)> =
            points.filter(|(x, y)| *x > 0.0 && *y > 0.0).map(|(x, y)| (x.ln(), y.ln())).collect();
        let n = logs.len() as f64;
        let mean = |of: &dyn Fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / n;
        let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
        let square = mean(&|p| (p.0 - x).powi(2));
        if logs.len() < 2 || square == 0.0 {
            return None;
        }
        let slope = mean(&|p| (p.0 - x) * (p.1 - y)) / square;
        Some(Fit { slope, intercept: y - slope * x })
    }

    fn at(&self, x: f64) -> f64 {
        (self.intercept + self.slope * x.ln()).exp()
    }
}

impl Curve {
    /// Channels by wavelength, in groups of equal numbers: name and members.
    fn groups(&self) -> Vec<(String, Vec<usize>)> {
        let mut order: Vec<usize> = (0..self.centres.len()).collect();
        order.sort_by(|&a, &b| self.centres[a].total_cmp(&self.centres[b]));
        let size = self.centres.len().div_ceil(GROUPS);
        let name = |members: &[usize]| {
            let [first, last] = [members[0], members[members.len() - 1]].map(|k| self.centres[k]);
            if members.len() == 1 { format!("{first:.0} nm") } else { format!("{first:.0} to {last:.0} nm") }
        };
        order.chunks(size).map(|members| (name(members), members.to_vec())).collect()
    }

    fn rel_mse(&self, y: impl Fn(&Point) -> f64) -> Vec<(f64, f64)> {
        self.points.iter().map(|p| (y(p), p.mean_rel_mse())).collect()
    }

    /// The exponent of the error, root mean square over channels, in samples and in seconds.
    pub fn slopes(&self) -> [Option<Fit>; 2] {
        let points = || self.points.iter().filter(|p| p.samples >= SLOPE_FROM);
        let error = |p: &Point| p.rms_error();
        [Fit::of(points().map(|p| (f64::from(p.samples), error(p)))), Fit::of(points().map(|p| (p.seconds, error(p))))]
    }

    /// Mean relMSE after so many seconds, between points; `None` outside them.
    fn rel_mse_at(&self, seconds: f64) -> Option<f64> {
        let pair = self.points.windows(2).find(|w| w[0].seconds <= seconds && seconds <= w[1].seconds)?;
        let point = |p: &Point| (p.seconds, p.mean_rel_mse());
        Fit::of(pair.iter().map(point)).map(|fit| fit.at(seconds))
    }

    /// Seconds until the error, root mean square over channels, is this; and whether that was reached.
    fn seconds_to(&self, error: f64) -> Option<(f64, bool)> {
        let of = |p: &Point| (p.rms_error(), p.seconds);
        if let Some(pair) = self.points.windows(2).find(|w| of(&w[0]).0 > error && of(&w[1]).0 <= error) {
            return Fit::of(pair.iter().map(of)).map(|fit| (fit.at(error), true));
        }
        let last = self.points.last()?;
        // Beyond the end at the slope of independent samples.
        (of(last).0 > error).then(|| (last.seconds * (of(last).0 / error).powi(2), false))
    }
}

/// The first line of its table.
pub const CSV_HEADER: &str = "curve,channels,samples_per_pixel,seconds,group_nm,relmse,error,error_estimate";

impl Report {
    /// One row a curve, epoch and group of channels.
    pub fn csv(&self) -> String {
        let mut table = Table::new(CSV_HEADER.split(','));
        for curve in &self.curves {
            for (group, members) in curve.groups() {
                for p in &curve.points {
                    let of = |values: &[f64]| members.iter().map(|&k| values[k]).collect::<Vec<_>>();
                    let (relmse, error) = (mean(&of(&p.rel_mse)), root_mean_square(&of(&p.error)));
                    let estimate = root_mean_square(&of(&p.estimate));
                    let estimate = if estimate.is_nan() { String::new() } else { format!("{estimate:e}") };
                    table.row([
                        curve.name.clone(),
                        curve.centres.len().to_string(),
                        p.samples.to_string(),
                        format!("{:.6}", p.seconds),
                        group.clone(),
                        format!("{relmse:e}"),
                        format!("{error:e}"),
                        estimate,
                    ]);
                }
            }
        }
        table.finish()
    }

    pub fn json(&self) -> Value {
        let curves = self.curves.iter().map(|curve| {
            let [samples, seconds] = curve.slopes().map(|fit| fit.map(|fit| fit.slope));
            let points = curve.points.iter().map(|p| {
                let estimate = p.rms_estimate();
                json!({
                    "samples": p.samples, "seconds": p.seconds, "mean_relmse": p.mean_rel_mse(),
                    "largest_relmse": p.rel_mse.iter().copied().fold(0.0, f64::max), "error": p.rms_error(),
                    "error_estimate": if estimate.is_nan() { Value::Null } else { json!(estimate) },
                })
            });
            json!({
                "name": curve.name, "channels": curve.centres.len(), "reference": curve.reference,
                "slope_samples": samples, "slope_seconds": seconds, "points": points.collect::<Vec<_>>(),
            })
        });
        json!({ "scene": self.scene, "measured": self.circumstances.facts(), "curves": curves.collect::<Vec<_>>() })
    }

    /// A table for the terminal: what each curve came to.
    pub fn summary(&self) -> String {
        let mut text = String::new();
        for curve in &self.curves {
            let Some(last) = curve.points.last() else { continue };
            let slope = |fit: Option<Fit>| fit.map_or("-".into(), |fit| format!("{:.3}", fit.slope));
            let [samples, seconds] = curve.slopes().map(slope);
            let _ = writeln!(
                text,
                "{}: {} samples/pixel in {:.1} s, mean relMSE {:.3e}, error {:.3e}; slope {samples} in samples, {seconds} in seconds",
                curve.name,
                last.samples,
                last.seconds,
                last.mean_rel_mse(),
                last.rms_error()
            );
        }
        text
    }

    pub fn html(&self) -> Result<String> {
        let mut page = Page::new(
            &format!("Error against run time: {}", self.scene),
            "relMSE of a channel is the mean over pixels of (x - ref)² / (ref² + ε), ε = (0.01 x mean of ref)²; the error of a \
             channel is the root of Σ (x - ref)² / Σ ref². What the reference's own noise adds to both is taken away. Seconds are \
             those of rendering and merging, without set-up and without the time that these metrics take.",
        );
        page.paragraph(&self.circumstances.sentence());
        let used: Vec<String> = self.curves.iter().map(|c| format!("{}: {}", c.name, c.reference)).collect();
        page.paragraph(&format!("References: {}.", used.join("; ")));

        let of_all = |x: fn(&Point) -> f64| -> Vec<Line> {
            let line = |c: &Curve| Line { name: c.name.clone(), points: c.rel_mse(x), guide: false };
            self.curves.iter().map(line).collect()
        };
        page.heading("Error against time");
        let chart = log_log("Mean relMSE of all channels", "time (s)", "relMSE", &of_all(|p| p.seconds))?;
        page.figure(&chart, "Every mark is an epoch: 1, 1, 2, 4, … samples per pixel more.");
        page.heading("Error against samples");
        let mut lines = of_all(|p| f64::from(p.samples));
        if let Some(first) = lines.first().filter(|line| line.points.len() > 1) {
            let (from, to) = (first.points[0], first.points[first.points.len() - 1]);
            let points = vec![from, (to.0, from.1 * from.0 / to.0)];
            lines.push(Line { name: "independent samples: 1/n".into(), points, guide: true });
        }
        let chart = log_log("Mean relMSE of all channels", "samples per pixel", "relMSE", &lines)?;
        page.figure(&chart, "The dashed line falls as that of independent samples does.");
        for curve in &self.curves {
            let line = |(name, members): (String, Vec<usize>)| {
                let of = |p: &Point| mean(&members.iter().map(|&k| p.rel_mse[k]).collect::<Vec<_>>());
                Line { name, points: curve.points.iter().map(|p| (p.seconds, of(p))).collect(), guide: false }
            };
            let lines: Vec<Line> = curve.groups().into_iter().map(line).collect();
            let chart = log_log(&format!("{}: groups of channels", curve.name), "time (s)", "relMSE", &lines)?;
            page.figure(&chart, "Mean relMSE of the channels in each range of wavelengths.");
        }

        page.heading("Estimated against true error");
        let line = |c: &Curve| Line {
            name: c.name.clone(),
            points: c.points.iter().map(|p| (p.rms_error(), p.rms_estimate())).collect(),
            guide: false,
        };
        let mut lines: Vec<Line> = self.curves.iter().map(line).collect();
        let errors = || lines.iter().flat_map(|l| &l.points).filter(|p| p.1 > 0.0).map(|p| p.0);
        let (low, high) = errors().fold((f64::INFINITY, 0.0), |(a, b), v| (v.min(a), v.max(b)));
        lines.push(Line { name: "estimate = truth".into(), points: vec![(low, low), (high, high)], guide: true });
        let chart = log_log("The renderer's own estimate", "true error", "estimated error", &lines)?;
        page.figure(
            &chart,
            "Estimated from the spread of equal epochs, from the second full one on. Below eight it is rough.",
        );

        page.heading("Slopes");
        let number = |fit: Option<Fit>| fit.map_or("-".into(), |fit| format!("{:.3}", fit.slope));
        let rows: Vec<Vec<String>> = self
            .curves
            .iter()
            .map(|c| {
                let [samples, seconds] = c.slopes();
                vec![c.name.clone(), number(samples), number(seconds)]
            })
            .collect();
        page.table(&["curve".into(), "error against samples".into(), "error against seconds".into()], &rows);
        page.paragraph(
            "Exponents fitted by least squares from 4 samples per pixel on; -0.5 is that of independent samples.",
        );

        page.heading("Equal time: mean relMSE");
        let shortest = self.curves.iter().filter_map(|c| Some(c.points.last()?.seconds)).fold(f64::INFINITY, f64::min);
        let times: Vec<f64> = [64.0, 16.0, 4.0, 1.0].map(|part| 0.999 * shortest / part).to_vec();
        let head = std::iter::once("curve".to_owned()).chain(times.iter().map(|t| format!("{t:.2} s")));
        let rows: Vec<Vec<String>> = self
            .curves
            .iter()
            .map(|c| {
                let of = |t: &f64| c.rel_mse_at(*t).map_or("-".into(), |v| format!("{v:.3e}"));
                std::iter::once(c.name.clone()).chain(times.iter().map(of)).collect()
            })
            .collect();
        page.table(&head.collect::<Vec<_>>(), &rows);

        page.heading("Time to an error");
        let head = std::iter::once("curve".to_owned()).chain(ERRORS.iter().map(|e| format!("{e}")));
        let rows: Vec<Vec<String>> = self
            .curves
            .iter()
            .map(|c| {
                let of = |e: &f64| match c.seconds_to(*e) {
                    Some((seconds, true)) => format!("{seconds:.2} s"),
                    Some((seconds, false)) => format!("({seconds:.0} s)"),
                    None => "-".into(),
                };
                std::iter::once(c.name.clone()).chain(ERRORS.iter().map(of)).collect()
            })
            .collect();
        page.table(&head.collect::<Vec<_>>(), &rows);
        page.paragraph(
            "Errors are roots of mean squares over channels. In brackets: beyond the end, if the error goes on as the inverse root \
             of time; -: smaller from the first epoch on.",
        );
        Ok(page.finish())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// relMSE 1/n, error n^-1/2, a millisecond a sample.
    fn curve() -> Curve {
        let point = |n: u32| {
            let relmse = 1.0 / f64::from(n);
            let estimate = if n < 128 { f64::NAN } else { relmse.sqrt() };
            Point {
                samples: n,
                seconds: 1e-3 * f64::from(n),
                rel_mse: vec![relmse; 5],
                error: vec![relmse.sqrt(); 5],
                estimate: vec![estimate; 5],
            }
        };
        Curve {
            name: "a".into(),
            centres: vec![500.0, 400.0, 600.0, 700.0, 800.0],
            reference: "a cube".into(),
            points: (0..=10).map(|i| point(1 << i)).collect(),
        }
    }

    #[test]
    fn slopes_times_and_errors_are_those_of_the_curve() {
        let curve = curve();
        let [samples, seconds] = curve.slopes().map(|fit| fit.expect("points").slope);
        assert!((samples + 0.5).abs() < 1e-12 && (seconds + 0.5).abs() < 1e-12);
        assert!((curve.rel_mse_at(0.1).expect("inside") - 0.01).abs() < 1e-12);
        assert_eq!((curve.rel_mse_at(1e-4), curve.rel_mse_at(2.0)), (None, None));
        let (time, reached) = curve.seconds_to(0.1).expect("reached");
        assert!(reached && (time - 0.1).abs() < 1e-9);
        let (time, reached) = curve.seconds_to(0.01).expect("an extrapolation");
        assert!(!reached && (time - 10.0).abs() < 1e-9);
        assert_eq!(curve.seconds_to(2.0), None);
        let groups: Vec<_> = curve.groups().into_iter().map(|g| g.1).collect();
        assert_eq!(groups, [vec![1, 0], vec![2, 3], vec![4]]);
    }

    #[test]
    fn reports_hold_every_point() {
        let circumstances = Circumstances {
            command: "spectile converge".into(),
            adapter: "a device".into(),
            cores: 2,
            date: "2026-11-27".into(),
        };
        let report = Report { scene: "scene.toml".into(), circumstances, curves: vec![curve()] };
        assert_eq!(report.csv().lines().count(), 1 + 3 * 11);
        assert_eq!(report.json()["curves"][0]["points"].as_array().map(Vec::len), Some(11));
        let html = report.html().expect("a page");
        for part in ["a device", "-0.500", "estimate = truth", "time (s)", "(10 s)"] {
            assert!(html.contains(part), "{part} is missing");
        }
        assert!(report.summary().contains("1024 samples/pixel in 1.0 s"));
    }
}
