//! The report of `bench`: the conventional path tracer and the deferred ones side by side (Fig. 4, 7, 8 and 9 of
//! Hoarau et al. 2018).

use std::collections::BTreeMap;
use std::fmt::Write;

use serde_json::{Value, json};

use super::Circumstances;
use super::page::Page;
use super::throughput::{Rates, median};
use crate::Result;
use crate::files::format_bytes;
use crate::format::csv_table::Table;
use crate::format::plot::{Line, log_log};
use crate::scene::Evaluator;

/// Pixels of the frames that frames per second are told of: 512 x 512, one sample each.
const FRAME_PIXELS: f64 = 512.0 * 512.0;
/// Paths and memory for which limits are told: the pools of Hoarau et al. 2018, and the memory of their GPU.
const POOLS: [u64; 3] = [512 * 512, 1024 * 1024, 2048 * 2048];
const MEMORY: u64 = 4 << 30;
/// Channels for which the largest pool is told.
const POOL_CHANNELS: u64 = 512;
/// More channels than anybody asks for: the limit is not the pool.
const MANY_CHANNELS: u64 = 100_000;

/// What a row belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Section {
    /// Against the number of channels.
    Channels,
    /// Against the number of paths at a time.
    Pool,
    /// A scene's own kernels against one set for all scenes.
    LeftOut,
}

impl Section {
    fn name(self) -> &'static str {
        match self {
            Section::Channels => "channels",
            Section::Pool => "pool",
            Section::LeftOut => "left out",
        }
    }
}

/// One measurement.
#[derive(Debug, Clone)]
pub struct Row {
    pub part: Section,
    pub scene: String,
    pub evaluator: Evaluator,
    /// Whether the kernels are those of a scene that has everything.
    pub everything: bool,
    pub channels: usize,
    /// Paths of a wave.
    pub pool: u32,
    pub rates: Rates,
    /// Of a path in a wave, bytes; and the part of them that grows with the channels, for each.
    pub path_bytes: u64,
    pub channel_bytes: u64,
    /// Of scene and waves, bytes: as planned, and as the device's allocator told.
    pub planned_bytes: u64,
    pub allocated_bytes: Option<u64>,
}

/// Frames of one size.
#[derive(Debug, Clone)]
pub struct Frames {
    pub scene: String,
    pub channels: usize,
    /// Width and height, pixels.
    pub side: u32,
    /// Of a sample of every pixel, each.
    pub seconds: Vec<f64>,
}

/// What a report is made of.
pub struct Report {
    pub circumstances: Circumstances,
    pub rounds: u32,
    pub rows: Vec<Row>,
    pub frames: Vec<Frames>,
    /// What was not measured, and why.
    pub missing: Vec<String>,
}

impl Row {
    fn is(&self, part: Section, scene: &str, evaluator: Evaluator) -> bool {
        self.part == part && self.scene == scene && self.evaluator == evaluator
    }
}

/// The first line of its table.
pub const CSV_HEADER: &str = "part,scene,evaluator,kernels,channels,pool,paths_per_s,slowest,fastest,frames_per_s_512,generate_us,evaluate_us,\
     path_bytes,planned_bytes,allocated_bytes";

impl Report {
    pub fn csv(&self) -> String {
        let mut table = Table::new(CSV_HEADER.split(','));
        for row in &self.rows {
            let [slowest, fastest] = row.rates.range();
            let micro = |s: f64| format!("{:.5}", 1e6 * s);
            table.row([
                row.part.name().to_owned(),
                row.scene.clone(),
                row.evaluator.name().to_owned(),
                (if row.everything { "all" } else { "own" }).to_owned(),
                row.channels.to_string(),
                row.pool.to_string(),
                format!("{:.1}", row.rates.median()),
                format!("{slowest:.1}"),
                format!("{fastest:.1}"),
                format!("{:.4}", row.rates.median() / FRAME_PIXELS),
                micro(row.rates.generate_s),
                micro(row.rates.evaluate_s),
                row.path_bytes.to_string(),
                row.planned_bytes.to_string(),
                row.allocated_bytes.map_or(String::new(), |bytes| bytes.to_string()),
            ]);
        }
        table.finish()
    }

    pub fn json(&self) -> Value {
        let rows = self.rows.iter().map(|row| {
            json!({
                "part": row.part.name(), "scene": row.scene, "evaluator": row.evaluator.name(),
                "kernels": if row.everything { "all" } else { "own" }, "channels": row.channels, "pool": row.pool,
                "paths_per_s": row.rates.median(), "rounds": row.rates.paths_per_s,
                "generate_s": row.rates.generate_s, "evaluate_s": row.rates.evaluate_s,
                "path_bytes": row.path_bytes, "planned_bytes": row.planned_bytes, "allocated_bytes": row.allocated_bytes,
            })
        });
        let frames = self.frames.iter().map(|frames| {
            json!({
                "scene": frames.scene, "channels": frames.channels, "side": frames.side, "seconds": frames.seconds,
            })
        });
        json!({
            "measured": self.circumstances.facts(), "rows": rows.collect::<Vec<_>>(),
            "frames": frames.collect::<Vec<_>>(), "missing": self.missing,
        })
    }

    /// Geometric means over scenes of how many times `pt`'s paths per second each evaluator makes, by channels.
    fn speedups(&self) -> Vec<(Evaluator, Vec<(f64, f64)>)> {
        let pt: BTreeMap<(&str, usize), f64> = self
            .rows
            .iter()
            .filter(|row| row.part == Section::Channels && row.evaluator == Evaluator::Pt)
            .map(|row| ((row.scene.as_str(), row.channels), row.rates.median()))
            .collect();
        let of = |evaluator: Evaluator| {
            let mut logs: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
            for row in self.rows.iter().filter(|row| row.part == Section::Channels && row.evaluator == evaluator) {
                if let Some(pt) = pt.get(&(row.scene.as_str(), row.channels)) {
                    logs.entry(row.channels).or_default().push((row.rates.median() / pt).ln());
                }
            }
            let mean = |logs: &Vec<f64>| (logs.iter().sum::<f64>() / logs.len() as f64).exp();
            (evaluator, logs.iter().map(|(&channels, logs)| (channels as f64, mean(logs))).collect())
        };
        self.evaluators().into_iter().map(of).collect()
    }

    fn evaluators(&self) -> Vec<Evaluator> {
        Evaluator::ALL.into_iter().filter(|e| self.rows.iter().any(|row| row.evaluator == *e)).collect()
    }

    fn scenes(&self) -> Vec<String> {
        let mut scenes: Vec<String> = Vec::new();
        for row in &self.rows {
            if !scenes.contains(&row.scene) {
                scenes.push(row.scene.clone());
            }
        }
        scenes
    }

    /// A table for the terminal.
    pub fn summary(&self) -> String {
        let mut text = String::new();
        for (evaluator, points) in self.speedups() {
            let each = points.iter().map(|(channels, speedup)| format!("K = {channels}: {speedup:.2}"));
            let _ = writeln!(text, "{} over pt: {}", evaluator.name(), each.collect::<Vec<_>>().join(", "));
        }
        for (own, _, times) in self.pairs() {
            let _ = writeln!(
                text,
                "{}: its own kernels make {times:.2} times the paths of one set for all scenes",
                own.scene
            );
        }
        for what in &self.missing {
            let _ = writeln!(text, "not measured: {what}");
        }
        text
    }

    /// Each scene with its own kernels and with those that have everything, and how many times faster its own are.
    fn pairs(&self) -> impl Iterator<Item = (&Row, &Row, f64)> {
        self.rows.iter().filter(|row| row.everything).filter_map(|all| {
            let own =
                self.rows.iter().find(|own| own.is(Section::LeftOut, &all.scene, all.evaluator) && !own.everything)?;
            Some((own, all, own.rates.median() / all.rates.median()))
        })
    }

    /// Lines of `y` over `x` for each evaluator, of the rows of one part and scene.
    fn lines(&self, part: Section, scene: &str, x: fn(&Row) -> f64, y: fn(&Row) -> f64) -> Vec<Line> {
        let line = |evaluator: Evaluator| Line {
            name: evaluator.name().into(),
            points: self.rows.iter().filter(|row| row.is(part, scene, evaluator)).map(|row| (x(row), y(row))).collect(),
            guide: false,
        };
        self.evaluators().into_iter().map(line).filter(|line| !line.points.is_empty()).collect()
    }

    pub fn html(&self) -> Result<String> {
        let mut page = Page::new(
            "Path tracing against deferred path evaluation",
            "Paths per second of a device, cube and merging apart. pt is the conventional path tracer, which keeps all channels of \
             every path in memory and updates them at each bounce; the others evaluate saved paths: dpept-path a path a thread, \
             dpept-spectral a path a workgroup, dpept-pixel a pixel's paths a workgroup. They trace the same paths and differ in \
             rounding only.",
        );
        page.paragraph(&self.circumstances.sentence());
        page.paragraph(&format!(
            "Medians of {} rounds in which all evaluators take turns on the same tiles, 64 samples per pixel; slowest and fastest in \
             brackets. Times of the passes are of one more round, which waits for every wave: the device's own where it has timestamps.",
            self.rounds
        ));
        for what in &self.missing {
            page.paragraph(&format!("Not measured: {what}."));
        }
        page.heading("Paths per second against channels (Fig. 8)");
        for scene in self.scenes() {
            let lines = self.lines(Section::Channels, &scene, |row| row.channels as f64, |row| row.rates.median());
            if lines.is_empty() {
                continue;
            }
            let chart = log_log(&scene, "channels", "paths/s", &lines)?;
            page.figure(&chart, "Pools as each evaluator chooses them, and as fits.");
            self.table(&mut page, Section::Channels, &scene);
        }
        page.heading("Speed-up over the conventional path tracer (Fig. 9)");
        let guide = |points: &[(f64, f64)]| {
            let ends = [points.first(), points.last()].into_iter().flatten().map(|p| (p.0, 1.0)).collect();
            Line { name: "pt".into(), points: ends, guide: true }
        };
        let speedups = self.speedups();
        let mut lines: Vec<Line> = speedups
            .iter()
            .filter(|(evaluator, _)| *evaluator != Evaluator::Pt)
            .map(|(evaluator, points)| Line { name: evaluator.name().into(), points: points.clone(), guide: false })
            .collect();
        lines.extend(speedups.iter().map(|(_, points)| guide(points)).next());
        let chart = log_log("Paths per second over pt's", "channels", "times pt", &lines)?;
        page.figure(&chart, "Geometric means over the scenes.");
        page.heading("Paths per second against the pool");
        for scene in self.scenes() {
            let lines = self.lines(Section::Pool, &scene, |row| f64::from(row.pool), |row| row.rates.median());
            if lines.is_empty() {
                continue;
            }
            page.figure(&log_log(&scene, "paths of a wave", "paths/s", &lines)?, "The same channels for all.");
            self.table(&mut page, Section::Pool, &scene);
        }
        self.linearity(&mut page)?;
        self.memory(&mut page)?;
        self.left_out(&mut page);
        Ok(page.finish())
    }

    fn table(&self, page: &mut Page, part: Section, scene: &str) {
        let head = [
            "evaluator",
            "channels",
            "pool",
            "paths/s",
            "frames/s at 512 x 512",
            "generate, us a path",
            "evaluate, us a path",
        ];
        let micro = |s: f64| format!("{:.4}", 1e6 * s);
        let rows = self.rows.iter().filter(|row| row.part == part && row.scene == scene).map(|row| {
            vec![
                row.evaluator.name().into(),
                row.channels.to_string(),
                row.pool.to_string(),
                rate(&row.rates),
                format!("{:.3}", row.rates.median() / FRAME_PIXELS),
                micro(row.rates.generate_s),
                micro(row.rates.evaluate_s),
            ]
        });
        page.table(&head.map(str::to_owned), &rows.collect::<Vec<_>>());
    }

    fn linearity(&self, page: &mut Page) -> Result<()> {
        page.heading("Cost against channels and pixels");
        page.paragraph(
            "How much longer a path takes with more channels, of dpept-pixel: what does not grow with them is its generation.",
        );
        let mut rows = Vec::new();
        for scene in self.scenes() {
            let of: Vec<&Row> =
                self.rows.iter().filter(|row| row.is(Section::Channels, &scene, Evaluator::DpeptPixel)).collect();
            rows.extend(of.windows(2).map(|pair| {
                let times = pair[0].rates.median() / pair[1].rates.median();
                let evaluate = pair[1].rates.evaluate_s / pair[0].rates.evaluate_s;
                let channels = pair[1].channels as f64 / pair[0].channels as f64;
                vec![
                    scene.clone(),
                    format!("{} to {}", pair[0].channels, pair[1].channels),
                    format!("{channels:.0}"),
                    format!("{times:.2}"),
                    format!("{evaluate:.2}"),
                ]
            }));
        }
        let head = ["scene", "channels", "times the channels", "times the time of a path", "of its evaluation"];
        page.table(&head.map(str::to_owned), &rows);
        if self.frames.is_empty() {
            return Ok(());
        }
        let pixels = |frames: &Frames| f64::from(frames.side).powi(2);
        let line = |scene: String| {
            let of = self.frames.iter().filter(|frames| frames.scene == scene);
            Line { points: of.map(|f| (pixels(f), median(&f.seconds))).collect(), name: scene, guide: false }
        };
        let mut lines: Vec<Line> = self.scenes().into_iter().map(line).filter(|line| !line.points.is_empty()).collect();
        if let Some(first) = lines.first().filter(|line| line.points.len() > 1) {
            let (from, to) = (first.points[0], first.points[first.points.len() - 1].0);
            let points = vec![from, (to, from.1 * to / from.0)];
            lines.push(Line { name: "as the pixels".into(), points, guide: true });
        }
        let chart = log_log("A frame of one sample per pixel", "pixels", "time (s)", &lines)?;
        page.figure(&chart, "Medians, dpept-pixel; the dashed line grows as the pixels do.");
        let rows = self.frames.iter().map(|frames| {
            let seconds = median(&frames.seconds);
            vec![
                frames.scene.clone(),
                frames.channels.to_string(),
                format!("{0} x {0}", frames.side),
                format!("{seconds:.4}"),
                format!("{:.4}", 1e6 * seconds / pixels(frames)),
            ]
        });
        let head = ["scene", "channels", "frame", "seconds", "us a pixel"];
        page.table(&head.map(str::to_owned), &rows.collect::<Vec<_>>());
        Ok(())
    }

    fn memory(&self, page: &mut Page) -> Result<()> {
        page.heading("Memory (Fig. 4 and 7)");
        let Some(scene) = self.scenes().into_iter().next() else { return Ok(()) };
        let lines = self.lines(Section::Channels, &scene, |row| row.channels as f64, |row| row.path_bytes as f64);
        page.figure(
            &log_log(&format!("A path of {scene}"), "channels", "bytes", &lines)?,
            "By formula: pt 32 bytes and 16 a channel, the deferred ones 32 and their records, and 16 more for queues and heads.",
        );
        let head =
            ["scene", "evaluator", "channels", "pool", "bytes a path", "planned", "allocated", "allocated / planned"];
        let rows = self.rows.iter().filter(|row| row.part == Section::Channels).map(|row| {
            let of = |bytes: u64| bytes as f64 / row.planned_bytes as f64;
            vec![
                row.scene.clone(),
                row.evaluator.name().into(),
                row.channels.to_string(),
                row.pool.to_string(),
                row.path_bytes.to_string(),
                format_bytes(row.planned_bytes),
                row.allocated_bytes.map_or("-".into(), format_bytes),
                row.allocated_bytes.map_or("-".into(), |bytes| format!("{:.3}", of(bytes))),
            ]
        });
        page.table(&head.map(str::to_owned), &rows.collect::<Vec<_>>());
        page.paragraph(&format!(
            "What paths alone let {} hold, scene and picture apart: the most channels for pools of 512², 1,024² and 2,048² paths, and \
             the largest pool for {POOL_CHANNELS} channels.",
            format_bytes(MEMORY)
        ));
        let head = ["scene", "evaluator", "channels, 512²", "channels, 1,024²", "channels, 2,048²", "largest pool"];
        let mut rows = Vec::new();
        for scene in self.scenes() {
            for evaluator in self.evaluators() {
                let Some(row) = self.rows.iter().find(|row| row.is(Section::Channels, &scene, evaluator)) else {
                    continue;
                };
                let fixed = row.path_bytes - row.channel_bytes * row.channels.next_multiple_of(4) as u64;
                let mut cells = vec![scene.clone(), evaluator.name().into()];
                cells.extend(POOLS.map(|pool| {
                    let left = (MEMORY / pool).saturating_sub(fixed);
                    match left.checked_div(row.channel_bytes) {
                        _ if left == 0 => "none".into(),
                        Some(channels) => channels.min(MANY_CHANNELS).to_string(),
                        None => "any number".into(),
                    }
                }));
                cells.push((MEMORY / (fixed + row.channel_bytes * POOL_CHANNELS)).to_string());
                rows.push(cells);
            }
        }
        page.table(&head.map(str::to_owned), &rows);
        Ok(())
    }

    fn left_out(&self, page: &mut Page) {
        let row = |(own, all, times): (&Row, &Row, f64)| {
            vec![
                all.scene.clone(),
                all.channels.to_string(),
                rate(&own.rates),
                rate(&all.rates),
                format!("{times:.2}"),
                format!("{} / {}", own.path_bytes, all.path_bytes),
                format!("{} / {}", format_bytes(own.planned_bytes), format_bytes(all.planned_bytes)),
            ]
        };
        let rows: Vec<Vec<String>> = self.pairs().map(row).collect();
        if rows.is_empty() {
            return;
        }
        page.heading("What is left out");
        page.paragraph(
            "Each scene with the kernels composed for it, against the kernels of a scene that has every kind of material, texture, \
             light, medium and heat: those things are in a black box behind the camera, which no path looks into, but every path runs \
             through the code for them.",
        );
        let head =
            ["scene", "channels", "own kernels, paths/s", "all kernels, paths/s", "times", "bytes a path", "memory"];
        page.table(&head.map(str::to_owned), &rows);
    }
}

/// Median, slowest and fastest.
fn rate(rates: &Rates) -> String {
    let [slowest, fastest] = rates.range();
    format!("{:.3e} ({slowest:.3e} to {fastest:.3e})", rates.median())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(part: Section, evaluator: Evaluator, everything: bool, channels: usize, rate: f64) -> Row {
        let per_channel = if evaluator == Evaluator::Pt { 16 } else { 0 };
        Row {
            part,
            scene: "box".into(),
            evaluator,
            everything,
            channels,
            pool: 1 << 15,
            rates: Rates { paths_per_s: vec![rate, 0.9 * rate, 1.2 * rate], generate_s: 1e-6, evaluate_s: 2e-6 },
            path_bytes: 136 + per_channel * channels as u64,
            channel_bytes: per_channel,
            planned_bytes: 1 << 20,
            allocated_bytes: Some(1 << 20),
        }
    }

    #[test]
    fn reports_hold_ratios_and_limits() {
        let (pt, pixel) = (Evaluator::Pt, Evaluator::DpeptPixel);
        let report = Report {
            circumstances: Circumstances {
                command: "spectile bench".into(),
                adapter: "a device".into(),
                cores: 2,
                date: "2026-11-27".into(),
            },
            rounds: 3,
            rows: vec![
                row(Section::Channels, pt, false, 512, 1e5),
                row(Section::Channels, pixel, false, 512, 38e5),
                row(Section::LeftOut, pixel, false, 128, 3e5),
                row(Section::LeftOut, pixel, true, 128, 2e5),
            ],
            frames: [(128, 0.1), (256, 0.4)]
                .map(|(side, s)| Frames { scene: "box".into(), channels: 128, side, seconds: vec![s] })
                .into(),
            missing: vec!["a thing: no time".into()],
        };
        assert_eq!(report.csv().lines().count(), 5);
        let summary = report.summary();
        for part in ["dpept-pixel over pt: K = 512: 38.00", "make 1.50 times", "not measured: a thing: no time"] {
            assert!(summary.contains(part), "{part} is missing: {summary}");
        }
        let html = report.html().expect("a page");
        // 4 GiB hold 1,024² paths of 4,096 bytes: 136 and 16 for each of 247 channels.
        for part in ["a device", ">247<", "any number", "1.50", "3.800e6", "6.1035"] {
            assert!(html.contains(part), "{part} is missing");
        }
        assert_eq!(report.json()["rows"].as_array().map(Vec::len), Some(4));
    }
}
