//! What `render` says while it works: a progress bar, plain lines, or one JSON object a line.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{HumanCount, ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::{Value, json};

use super::Output;
use super::info::ROUGH_BELOW;
use crate::cube::{Cube, Existing, Progress, reduction};
use crate::files::{format_bytes, shown};
use crate::preview::Status;
use crate::render::job::Job;
use crate::render::plan;
use crate::render::schedule::{Event, PREVIEW_PIXELS, Summary};
use crate::{Error, Result};

/// Without a bar: lines about an epoch come at most this often, and some line at least this often.
const LINE_EVERY: Duration = Duration::from_secs(1);
const LINE_AT_LEAST_EVERY: Duration = Duration::from_secs(10);

/// Tells how much of how much is done; an error asks for the end.
pub type Steps<'a> = &'a mut dyn FnMut(u64, u64) -> Result<()>;

/// Does work that is not a render: with a bar on a terminal, and until a signal ends it.
pub fn watched<T>(output: &Output, work: impl FnOnce(Steps) -> Result<T>) -> Result<T> {
    let interrupt = output.interrupt()?;
    let bar = (!output.json() && std::io::stderr().is_terminal()).then(|| {
        let bar = ProgressBar::with_draw_target(Some(1), ProgressDrawTarget::stderr_with_hz(5));
        let style = ProgressStyle::with_template("{bar:30} {percent} %  {eta} left").expect("a valid template");
        bar.with_style(style)
    });
    let result = work(&mut |done, all| {
        if let Some(bar) = &bar {
            bar.set_length(all);
            bar.set_position(done);
        }
        interrupt.check()
    });
    if let Some(bar) = &bar {
        bar.finish_and_clear();
    }
    result
}

pub struct Reporter<'a> {
    output: &'a Output,
    quiet: bool,
    epoch: u32,
    started: Instant,
    last_line: Option<Instant>,
    merged: bool,
    /// Only on a terminal.
    bar: Option<ProgressBar>,
}

impl<'a> Reporter<'a> {
    pub fn new(quiet: bool, output: &'a Output) -> Self {
        let bar = (!quiet && !output.json() && std::io::stderr().is_terminal()).then(|| {
            let bar = ProgressBar::with_draw_target(Some(1), ProgressDrawTarget::stderr_with_hz(5));
            let style = ProgressStyle::with_template("{bar:30} {pos}/{len} units  {msg}").expect("a valid template");
            bar.with_style(style)
        });
        Reporter { output, quiet, epoch: 64, started: Instant::now(), last_line: None, merged: false, bar }
    }

    /// A line on stderr that neither breaks the bar nor appears under --quiet.
    fn line(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.println(text),
            None if !self.quiet && !self.output.json() => self.output.say(text),
            None => {}
        }
    }

    /// A line on stderr that does not break the bar, under --quiet too.
    fn say_always(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.println(text),
            None => self.output.say(text),
        }
    }

    /// An event for programs. One that has gone away does not end the render.
    pub fn emit(&self, event: &str, fields: Value) -> Result<()> {
        match self.output.event(event, fields) {
            Err(Error::BrokenPipe) => Ok(()),
            result => result,
        }
    }

    /// Warnings are always said, and are events of their own.
    pub fn warn(&self, text: &str) -> Result<()> {
        match &self.bar {
            Some(bar) => bar.println(format!("warning: {text}")),
            None => match self.output.warn(text) {
                Err(Error::BrokenPipe) => {}
                result => return result,
            },
        }
        Ok(())
    }

    /// Where the page is; always said, since nobody else knows.
    #[cfg(feature = "web")]
    pub fn listening(&self, text: &str, fields: Value) -> Result<()> {
        self.say_always(text);
        self.emit("listening", fields)
    }

    pub fn start(&mut self, job: &Job) -> Result<()> {
        self.epoch = job.scene.integrator.epoch;
        let [width, height] = job.scene.film.cube_size();
        let tile = plan::tile_size(&job.scene, job.tile);
        let disk = job.header(tile)?.store_bytes();
        let channels = job.scene.channels.len();
        let samples_limit = job.stop.samples_limit(self.epoch, job.uncertainty)?;
        self.line(&format!(
            "{}: {width} x {height} pixels x {channels} channels, {} on disk",
            job.scene.file.display(),
            format_bytes(disk)
        ));
        if let (Some(asked), Some(limit)) = (job.stop.samples, samples_limit)
            && asked != limit
        {
            self.line(&format!("--spp {asked} is rounded up to {limit} samples/pixel, the end of an epoch"));
        }
        let factor = reduction([width, height], PREVIEW_PIXELS);
        if job.preview.is_some() && factor > 1 {
            self.line(&format!(
                "the preview is reduced: {factor} x {factor} pixels are one (`spectile export` writes them all)"
            ));
        }
        self.emit(
            "start",
            json!({
                "scene": shown(&job.scene.file), "scene_digest": job.scene.digest, "output": shown(&job.output), "seed": job.seed,
                "size": [width, height], "channels": channels, "tile": tile, "disk_bytes": disk,
                "tiles": job.tiles.as_ref().map(|tiles| [tiles.start, tiles.end]), "samples_asked": job.stop.samples, "samples_limit": samples_limit,
                "time_limit_s": job.stop.time.map(|t| t.as_secs_f64()), "error_limit": job.stop.error,
                "error_per": job.stop.error.map(|_| if job.stop.per_tile { "tile" } else { "image" }),
            }),
        )
    }

    pub fn event(&mut self, event: Event) -> Result<()> {
        match event {
            Event::Warning(text) => self.warn(&text),
            Event::Note(text) => {
                self.line(&text);
                self.emit("note", json!({ "message": text }))
            }
            Event::Device(name) => {
                self.line(&format!("device: {name}"));
                self.emit("device", json!({ "name": name }))
            }
            Event::Progress(status) => {
                self.merged = true;
                if let Some(bar) = &self.bar {
                    // The message first: each of these may draw.
                    bar.set_message(self.describe(status, status.samples_next));
                    bar.set_length(u64::from(status.units.1));
                    bar.set_position(u64::from(status.units.0));
                } else if self.last_line.unwrap_or(self.started).elapsed() >= LINE_AT_LEAST_EVERY {
                    self.last_line = Some(Instant::now());
                    self.line(&self.describe_epoch(status));
                }
                self.emit("progress", fields(status))
            }
            Event::Rests(rests) => {
                self.line(if rests { "paused, as was asked on the page" } else { "goes on, as was asked on the page" });
                self.emit(if rests { "paused" } else { "resumed" }, json!({}))
            }
            Event::Asked(status) => {
                self.say_always(&self.describe_epoch(status));
                self.emit("progress", fields(status))
            }
            Event::Epoch(status) => {
                if self.bar.is_none() && self.last_line.is_none_or(|last| last.elapsed() >= LINE_EVERY) {
                    self.last_line = Some(Instant::now());
                    self.line(&self.describe(status, status.samples));
                }
                self.emit("epoch", fields(status))
            }
        }
    }

    /// How far the current epoch is.
    fn describe_epoch(&self, status: &Status) -> String {
        let (done, all) = status.units;
        match status.tiles {
            Some(_) => self.describe(status, status.samples),
            None => format!("{done}/{all} units of {}", self.describe(status, status.samples_next)),
        }
    }

    fn describe(&self, status: &Status, samples: u32) -> String {
        let rate = |count: u64| HumanCount((count as f64 / status.rendering_s.max(1e-9)) as u64).to_string();
        let mut text = format!("{samples} samples/pixel  {} paths/s  {} rays/s", rate(status.paths), rate(status.rays));
        if let Some(error) = status.error_estimate {
            let rough = if status.samples / self.epoch < ROUGH_BELOW { " (rough)" } else { "" };
            text += &format!("  error {:.2} %{rough}", 100.0 * error);
        }
        if let Some(ends) = status.tiles {
            text += &format!("  {}", ends.describe());
        }
        if let Some(left) = status.remaining.filter(|left| !left.is_zero()) {
            text += &format!("  {} left", short(left));
        }
        text
    }

    /// The end, good or bad.
    pub fn finish(&mut self, job: &Job, summary: Result<Summary>) -> Result<()> {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
        let summary = match summary {
            Ok(summary) => summary,
            Err(error @ Error::Interrupted { .. }) => {
                self.output.say(&self.interrupted(job));
                return Err(error);
            }
            Err(error) => {
                if self.merged && matches!(error, Error::DevicesLost(_) | Error::Storage { .. }) {
                    self.output.say("what is merged is kept: the same command with --resume goes on from there");
                }
                return Err(error);
            }
        };
        let status = &summary.status;
        let mut done = fields(status);
        done["output"] = json!(shown(&job.output));
        done["exposure_ev"] = json!(summary.exposure);
        if job.profile {
            done["profile"] = profile_fields(&summary);
        }
        self.emit("done", done)?;
        if job.profile {
            self.output.text(&describe_profile(&summary))?;
        }
        if self.quiet {
            return Ok(());
        }
        let mut text = format!(
            "{}: {}{} samples/pixel in {}, {} paths\n",
            job.output.display(),
            if status.tiles.is_some() { "at least " } else { "" },
            status.samples,
            short(status.elapsed),
            HumanCount(status.paths)
        );
        if let Some(ends) = &status.tiles {
            text += &format!("--error-per tile: {}\n", ends.describe());
        }
        if let Some((samples, seconds)) = summary.too_long {
            let about = short(Duration::from_secs_f64(seconds));
            text += &format!("--time: the next {samples} samples/pixel, of about {about}, do not fit any more\n");
        }
        if let (Some(preview), Some(exposure)) = (&job.preview, summary.exposure) {
            text += &format!("{}: exposure {exposure:+.2} EV\n", preview.file.display());
        }
        self.output.text(&text)
    }

    /// What an interrupted render leaves behind.
    fn interrupted(&self, job: &Job) -> String {
        let goes_on = job.existing == Existing::Resume;
        let found = Cube::open(&job.output).and_then(|cube| cube.progress()).ok();
        let Some(progress) = found.filter(|found| self.merged || (goes_on && found.tiles_started > 0)) else {
            return "interrupted before anything was rendered".into();
        };
        let output = job.output.display();
        let Progress { tiles, tiles_started, samples: [least, most], .. } = progress;
        let samples = if least == most { most.to_string() } else { format!("{least} to {most}") };
        format!(
            "interrupted: {output} keeps every unit merged so far, {samples} samples/pixel in {tiles_started} of {tiles} tiles \
             (--resume goes on from there, `spectile info {output}` says more)"
        )
    }
}

fn profile_fields(summary: &Summary) -> Value {
    let device = summary.profile;
    json!({
        "setup_s": summary.setup_s,
        "generate_s": device.map(|p| p.generate_s),
        "evaluate_s": device.map(|p| p.evaluate_s),
        "merge_s": summary.merge_s,
    })
}

fn describe_profile(summary: &Summary) -> String {
    let status = &summary.status;
    let per_path = |seconds: f64| 1e6 * seconds / status.paths.max(1) as f64;
    let mut text = format!("set-up    {:8.3} s  (scene, device, shaders)\n", summary.setup_s);
    if let Some(p) = summary.profile {
        text += &format!("generate  {:8.3} s  {:.3} us a path\n", p.generate_s, per_path(p.generate_s));
        text += &format!("evaluate  {:8.3} s  {:.3} us a path\n", p.evaluate_s, per_path(p.evaluate_s));
    }
    text += &format!(
        "merge     {:8.3} s  {:.3} us a path, beside the device's work\n",
        summary.merge_s,
        per_path(summary.merge_s)
    );
    for device in &status.devices {
        text += &format!("idle      {:8.3} s  {}\n", device.idle_s, device.name);
    }
    text
}

/// The fields of `progress`, `epoch` and `done`; docs/json.md lists them.
fn fields(status: &Status) -> Value {
    let devices = status
        .devices
        .iter()
        .map(|d| json!({ "name": d.name, "units": d.units, "busy_s": d.busy_s, "idle_s": d.idle_s }));
    json!({
        "samples": status.samples,
        "samples_next": status.samples_next,
        "units": status.units.0,
        "units_total": status.units.1,
        "paths": status.paths,
        "paths_per_s": status.paths as f64 / status.rendering_s.max(1e-9),
        "rays": status.rays,
        "error_estimate": status.error_estimate,
        "tile_ends": status.tiles.map(|ends| ends.facts()),
        "remaining_s": status.remaining.map(|d| d.as_secs_f64()),
        "devices": devices.collect::<Vec<_>>(),
    })
}

/// A duration as people say it.
pub fn short(d: Duration) -> String {
    let s = d.as_secs_f64();
    match s {
        s if s < 60.0 => format!("{s:.1} s"),
        s if s < 3600.0 => format!("{:.0} min {:02.0} s", (s / 60.0).floor(), s % 60.0),
        s => format!("{:.0} h {:02.0} min", (s / 3600.0).floor(), (s % 3600.0) / 60.0),
    }
}
