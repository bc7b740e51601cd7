//! What cases are measured with.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use super::{Check, Outcome};
use crate::Result;
use crate::gpu::adapter::{Gpu, Selection};
use crate::render::interrupt::Interrupt;
use crate::report::convergence::{Image, Limit, render};
use crate::scene::{self, Scene};

/// Standard errors that a right answer may be off.
const SIGMAS: f64 = 5.0;
/// Roundings of f32: of a table, a weight and a mean.
pub const F32: f64 = 1e-6;
/// What tables of spectra are held to, pointwise: `spectral::table::POINTWISE_BOUND`.
pub const TABLES: f64 = 1e-4;

/// A quad that fills the view of the camera that cases have by default.
pub const WALL: &str = "quad = { corner = [-1, -1, 0], edge_u = [2, 0, 0], edge_v = [0, 2, 0] }\n";

/// A black wall that emits `radiance`, and nothing else.
pub fn lamp(radiance: &str) -> String {
    format!(
        "[integrator]\nmax_bounces = 0\n[materials.black.black]\n[[objects]]\n{WALL}material = \"black\"\nemission = {radiance}\n"
    )
}

/// Renders the scenes of one case and gathers its checks.
pub struct Bench<'a> {
    case: &'static str,
    machine: &'a Machine,
    pub outcome: Outcome,
}

/// What cases run on.
pub struct Machine {
    pub gpu: Arc<Gpu>,
    /// The devices of which `gpu` is the first.
    pub devices: Selection,
    pub interrupt: Arc<Interrupt>,
}

/// Means over a picture's pixels, [channel], and their standard errors from the spread of the pixels, which show the same.
pub struct Measured {
    pub mean: Vec<f64>,
    pub error: Vec<f64>,
    pub image: Image,
}

impl<'a> Bench<'a> {
    pub fn new(case: &'static str, machine: &'a Machine) -> Bench<'a> {
        Bench { case, machine, outcome: Outcome::default() }
    }

    pub fn machine(&self) -> &'a Machine {
        self.machine
    }

    /// The scene that `text` describes. Lines between brackets that a case does not give are these: an orthographic camera at
    /// z = 1 that sees a thousandth of a metre around the origin, 8 x 8 pixels, one channel from 500 to 600 nm.
    pub fn scene(&self, text: &str) -> Result<Scene> {
        let mut all = String::new();
        let defaults = [
            (
                "[camera",
                "[camera.orthographic]\nposition = [0, 0, 1]\nlook_at = [0, 0, 0]\nup = [0, 1, 0]\nwidth = 0.001\n",
            ),
            ("[film]", "[film]\nwidth = 8\nheight = 8\n"),
            ("[channels]", "[channels]\nintervals = [[500, 600]]\n"),
        ];
        for (table, default) in defaults {
            if !text.contains(table) {
                all += default;
            }
        }
        all += text;
        scene::parse(&all, Path::new(&format!("stress-{}.toml", self.case)), &[])
    }

    /// Renders so many samples per pixel.
    pub fn render(&mut self, text: &str, samples: u32) -> Result<Measured> {
        self.render_with(text, samples, 1, None)
    }

    /// The same with a seed and, where the default is not meant, a size of tiles.
    pub fn render_with(&mut self, text: &str, samples: u32, seed: u64, tile: Option<u32>) -> Result<Measured> {
        let scene = self.scene(text)?;
        // Far beyond what any case takes.
        let limit = Limit { time: Duration::from_secs(24 * 3600), samples };
        let image = render(&scene, seed, tile, &self.machine.gpu, limit, &self.machine.interrupt, |_, _| Ok(()))?;
        self.outcome.non_finite += image.non_finite;
        self.outcome.negative += image.negative;
        self.outcome.overflow += image.overflow;
        let channels = scene.channels.len();
        let pixels = (image.mean.len() / channels) as f64;
        let of = |k: usize| image.mean.iter().skip(k).step_by(channels);
        let mean: Vec<f64> = (0..channels).map(|k| of(k).sum::<f64>() / pixels).collect();
        let error = |k: usize| {
            let spread: f64 = of(k).map(|v| (v - mean[k]).powi(2)).sum();
            (spread / (pixels * (pixels - 1.0).max(1.0))).sqrt()
        };
        let error = (0..channels).map(error).collect();
        Ok(Measured { mean, error, image })
    }

    /// `expected` within `relative` of it, and what noise allows.
    pub fn check(&mut self, what: impl Into<String>, expected: f64, got: (f64, f64), relative: f64) {
        self.check_within(what, expected, got, relative * expected.abs());
    }

    /// `expected` within `bound`, and what noise allows.
    pub fn check_within(&mut self, what: impl Into<String>, expected: f64, got: (f64, f64), bound: f64) {
        let (got, standard_error) = got;
        let bound = bound + SIGMAS * standard_error;
        self.outcome.checks.push(Check { what: what.into(), expected, got, bound, standard_error });
    }

    /// Every channel of `measured`.
    pub fn check_all(&mut self, what: &str, expected: &[f64], measured: &Measured, relative: f64) {
        for (k, &expected) in expected.iter().enumerate() {
            self.check(format!("{what}, channel {k}"), expected, measured.of(k), relative);
        }
    }
}

impl Machine {
    /// So many devices, which share what there is.
    pub fn several(&self, count: usize) -> Selection {
        match &self.devices {
            Selection::List(positions) => Selection::List(vec![positions[0]; count]),
            Selection::All | Selection::Software | Selection::Count(_) => Selection::Count(count),
        }
    }
}

impl Measured {
    /// Mean and standard error of a channel.
    pub fn of(&self, k: usize) -> (f64, f64) {
        (self.mean[k], self.error[k])
    }
}
