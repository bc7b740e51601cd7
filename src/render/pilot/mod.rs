//! What a few samples of a scene decide before it is rendered: at how many wavelengths of a channel paths are evaluated, and which of
//! them are worth it.
//!
//! The theory is in docs/METHOD.md, Several wavelengths a channel and Roulette on evaluation. Nothing here looks at a clock: what paths
//! cost is known by the kind of device, how they vary is measured on paths that are never counted in the picture, so that the choice is
//! the same every time.

mod remainder;
mod work;

use std::ops::Range;
use std::sync::Arc;

use crate::cube::{Brightness, Choices};
use crate::device::evaluator::{Costs, evaluation_cost};
use crate::device::parts::paths::{Thinning, representatives, tried_channels};
use crate::device::prepared::Prepared;
use crate::device::words::{LOOP_LIMIT, MOST_WEIGHT};
use crate::gpu::adapter::Gpu;
use crate::render::interrupt::Interrupt;
use crate::render::wave::Budget;
use crate::render::worker::{UnitRect, Worker};
use crate::scene::{Evaluation, Evaluator, Film, MOST_WAVELENGTHS, Scene};
use crate::{Error, Result};
use work::{Means, Work};

/// Pixels of the pilot, all over the film.
const PIXELS: u32 = 256;
/// Epochs of one sample: independent paths, each with its values.
const SINGLES: u32 = 32;
/// Samples of all pixels in one of two epochs, nets as the render's, whose difference tells how much less than single paths they vary;
/// and those of the largest nets that are tried.
const NET_SAMPLES: u32 = 4096;
const LARGEST_NET: u32 = 256;
/// The pilot's epochs have numbers that no render comes to.
const FIRST_EPOCH: u32 = 1 << 31;
/// Channels whose variance is predicted, at most: evenly among all.
const MOST_CHANNELS: usize = 256;

/// Variance that any channel may gain, over that of evaluating all paths.
const MOST_VARIANCE: f64 = 1.1;
/// What `auto` takes must be expected to bring so much.
const LEAST_GAIN: f64 = 1.1;
/// Where evaluating a path costs less than this share of generating it, `auto` asks no samples: roulette would bring a quarter more at
/// the very most, and usually nothing.
const LEAST_COST: f64 = 0.25;

/// Wavelengths of a channel that the pilot compares with one, as far as a path may be evaluated at so many.
const TRIED_WAVELENGTHS: u32 = 4;
/// Samples of each of the pilot's pixels that tell how bright the picture is.
const SAMPLES_OF_BRIGHTNESS: u32 = 32;
/// Samples of all the pilot's pixels that tell what paths take.
const COUNTED: u32 = 8;
/// Where evaluating a path at one wavelength costs this much of generating it, `auto` takes one: sixteen would bring a quarter more at the
/// very most.
const MOST_COST_OF_ONE: f64 = 4.0;
/// Variance within a channel, over the square of the mean, that some spectrum must have for `auto` to ask samples.
const LEAST_VARIATION: f64 = 0.05;

/// Whether there is something to decide: `pt` evaluates while it traces, and factored renders evaluate what does not separate of all paths.
pub fn is_needed(scene: &Scene, prepared: &Prepared) -> bool {
    may_thin(scene, prepared) || (is_deferred(prepared) && scene.integrator.wavelengths_per_channel.is_none())
}

/// Whether roulette may leave out paths.
pub fn may_thin(scene: &Scene, prepared: &Prepared) -> bool {
    is_deferred(prepared) && scene.integrator.evaluation != Evaluation::All
}

fn is_deferred(prepared: &Prepared) -> bool {
    !matches!(prepared.evaluator, Evaluator::Pt | Evaluator::Factored)
}

/// What a pilot works with.
pub struct Pilot<'a> {
    pub scene: &'a Scene,
    /// The first that can follows its paths. Those that cannot leave the list, which is warned of, as long as there are others.
    pub gpus: &'a mut Vec<Gpu>,
    /// Most that a device may use, bytes.
    pub memory: Option<u64>,
    pub interrupt: &'a Arc<Interrupt>,
    pub warn: &'a mut dyn FnMut(String) -> Result<()>,
}

impl Pilot<'_> {
    /// `prepared` with what was chosen for the scene: by the cube that is gone on with (`there`), else by rule, else by samples.
    pub fn decide(&mut self, prepared: Prepared, there: Option<Choices>) -> Result<(Arc<Prepared>, Option<Choices>)> {
        let mut prepared = Arc::new(prepared);
        if !is_needed(self.scene, &prepared) {
            return Ok((prepared, None));
        }
        let choices = match there {
            Some(choices) => {
                set_wavelengths(&mut prepared, choices.wavelengths_per_channel)?;
                choices
            }
            None => {
                let several = self.wavelengths(&mut prepared)?;
                set_wavelengths(&mut prepared, several.count)?;
                several.and(self.paths(&prepared)?)
            }
        };
        let asked = self.scene.integrator.evaluation;
        if asked == Evaluation::Roulette && choices.scale.is_none() {
            let what = "integrator.evaluation = \"roulette\", but all paths are evaluated";
            (self.warn)(format!("{what}: {}", choices.reason))?;
        }
        if let Some(scale) = choices.scale {
            if choices.mean_radiance.len() != prepared.channels {
                return Err(Error::Internal("what was chosen for the cube is for other channels than it has".into()));
            }
            let thinning = Thinning::new(&prepared, scale, &choices.mean_radiance);
            Arc::get_mut(&mut prepared).ok_or_else(kept)?.thinning = Some(thinning);
        }
        Ok((prepared, Some(choices)))
    }

    /// How bright the picture of the cube is that `prepared` renders. It need not be known well: it only tells what is dark.
    pub fn brightness(&mut self, prepared: &Arc<Prepared>) -> Result<Brightness> {
        // What factored renders bring back is no radiance.
        let plain = match prepared.evaluator {
            Evaluator::Factored => {
                let mut scene = self.scene.clone();
                scene.integrator.wavelengths_per_channel = Some(1);
                Arc::new(Prepared::for_evaluator(&scene, 0, Evaluator::DpeptPath)?)
            }
            _ => Arc::clone(prepared),
        };
        self.on_a_device(|pilot, gpu| {
            let mut worker = worker(gpu, &plain, pilot.memory, pilot.interrupt)?;
            let film = &pilot.scene.film;
            let sums = channel_sums(&mut worker, film, plain.channels, 0..SAMPLES_OF_BRIGHTNESS)?;
            let samples = pixels(film).len() as u32 * SAMPLES_OF_BRIGHTNESS;
            let means: Vec<f32> = sums.iter().map(|sum| (sum / f64::from(samples)) as f32).collect();
            let means = plain.integration.as_ref().map_or_else(|| means.clone(), |parts| parts.sums(&means));
            Ok(Brightness { mean_radiance: means.into_iter().map(f64::from).collect(), samples })
        })
    }

    /// At how many wavelengths of each channel paths are evaluated.
    fn wavelengths(&mut self, prepared: &mut Arc<Prepared>) -> Result<Several> {
        if let Some(count) = self.scene.integrator.wavelengths_per_channel {
            return Ok(Several::unasked(count, AS_ASKED.into()));
        }
        if let Some(reason) = one_by_rule(self.scene, prepared, self.gpus[0].is_software) {
            return Ok(Several::unasked(1, reason));
        }
        self.on_a_device(|pilot, gpu| {
            let start = |prepared: &Arc<Prepared>| worker(gpu, prepared, pilot.memory, pilot.interrupt);
            set_wavelengths(prepared, 1)?;
            let each = prepared.path_iterations();
            let mut worker = start(prepared)?;
            let units = pixels(&pilot.scene.film);
            let costs = Costs::of(prepared, gpu.is_software);
            let means = work::means(&mut worker, prepared, &units, COUNTED)?;
            let cost = means.evaluation(&costs, prepared.channels);
            if cost >= MOST_COST_OF_ONE {
                return Ok(Several { means, ..Several::unasked(1, costs_so_much(cost)) });
            }
            let one = net_variances(&mut worker, prepared, pilot.scene)?;
            drop(worker);
            let tried = TRIED_WAVELENGTHS.min(most_wavelengths(each));
            set_wavelengths(prepared, tried)?;
            let several = net_variances(&mut start(prepared)?, prepared, pilot.scene)?;
            let counts = (0..=most_wavelengths(each).ilog2()).map(|bits| 1 << bits);
            let time = |count| means.whole(&costs, prepared.channels, count);
            let found = Several::of(counts, time, [&one, &several], tried, costs_so_much(cost));
            Ok(Several { means, ..found })
        })
    }

    /// Which paths are evaluated.
    fn paths(&mut self, prepared: &Arc<Prepared>) -> Result<Choices> {
        if self.scene.integrator.evaluation == Evaluation::All {
            return Ok(all(AS_ASKED.into(), 0, Vec::new()));
        }
        if let Some(choices) = all_by_rule(self.scene, prepared, self.gpus[0].is_software) {
            return Ok(choices);
        }
        self.on_a_device(|pilot, gpu| choose(gpu, prepared, pilot.scene, pilot.memory, pilot.interrupt))
    }

    /// Lends the first device that can do `work`.
    fn on_a_device<T>(&mut self, mut work: impl FnMut(&Self, &Arc<Gpu>) -> Result<T>) -> Result<T> {
        loop {
            let gpu = Arc::new(self.gpus.remove(0));
            match work(self, &gpu) {
                Ok(done) => {
                    self.gpus.insert(0, Arc::into_inner(gpu).ok_or_else(kept)?);
                    return Ok(done);
                }
                Err(error) if error.may_be_of_one_device() && !self.gpus.is_empty() => {
                    (self.warn)(format!("a device is left out: {error}"))?;
                }
                Err(error) => return Err(error),
            }
        }
    }
}

fn worker(gpu: &Arc<Gpu>, prepared: &Arc<Prepared>, memory: Option<u64>, interrupt: &Arc<Interrupt>) -> Result<Worker> {
    let budget = Budget { memory, paths: None };
    let mut worker = Worker::new(Arc::clone(gpu), Arc::clone(prepared), [1, 1], budget)?;
    worker.watch(interrupt);
    Ok(worker)
}

/// Follows the paths of the pilot on `gpu` and chooses which of a render's are evaluated.
pub fn choose(
    gpu: &Arc<Gpu>,
    prepared: &Arc<Prepared>,
    scene: &Scene,
    memory: Option<u64>,
    interrupt: &Arc<Interrupt>,
) -> Result<Choices> {
    let trial = Trial::run(&mut worker(gpu, prepared, memory, interrupt)?, prepared, scene)?;
    let costs = Costs::of(prepared, gpu.is_software);
    let means = trial.means_of_work;
    Ok(with_means(trial.choose(&costs, scene.integrator.evaluation == Evaluation::Roulette), &means))
}

/// The reason for what a scene has chosen itself.
const AS_ASKED: &str = "as the scene says";

fn set_wavelengths(prepared: &mut Arc<Prepared>, count: u32) -> Result<()> {
    Arc::get_mut(prepared).ok_or_else(kept)?.wavelengths_per_channel = count;
    Ok(())
}

/// At how many wavelengths of each channel paths are evaluated, and why.
struct Several {
    count: u32,
    gain: f64,
    reason: String,
    /// Of the paths that were asked.
    means: Means,
}

impl Several {
    /// One, or as many as were asked for.
    fn unasked(count: u32, reason: String) -> Several {
        Several { count, gain: 1.0, reason, means: Means::default() }
    }

    /// The one among `counts` that is expected to bring most, by variances of each channel with one wavelength and with `tried`; a path
    /// with so many takes `time`. Of m the noise within a channel falls as 1/m at least: V(m) = V_p + V_l / m (docs/METHOD.md,
    /// Several wavelengths a channel).
    fn of(
        counts: impl Iterator<Item = u32>,
        time: impl Fn(u32) -> f64,
        [one, several]: [&[f64]; 2],
        tried: u32,
        costs: String,
    ) -> Several {
        let lit: Vec<(f64, f64)> =
            one.iter().copied().zip(several.iter().copied()).filter(|(one, _)| *one > 0.0).collect();
        let tried = f64::from(tried);
        let gain = |count: u32| {
            let m = f64::from(count);
            let grown = lit.iter().map(|&(one, several)| {
                let within = ((one - several) * tried / (tried - 1.0)).clamp(0.0, one);
                (one - within + within / m) / one
            });
            let mean = grown.sum::<f64>() / lit.len() as f64;
            // To whole percents: so that what differs in the last bits chooses the same.
            (time(1) / time(count) / mean.max(1e-3) * 100.0).round() / 100.0
        };
        // Of equal gains the fewest.
        let best = counts.filter(|_| !lit.is_empty()).map(|count| (count, gain(count)));
        let best = best.fold((1, 1.0), |best, found| if found.1 > best.1 { found } else { best });
        match best {
            (count, gain) if count > 1 && gain >= LEAST_GAIN => {
                Several { count, gain, reason: costs, means: Means::default() }
            }
            (_, gain) => Several::unasked(1, format!("several would bring {gain:.2}, too little")),
        }
    }

    /// What both choices are together.
    fn and(self, paths: Choices) -> Choices {
        let Several { count, gain, reason, means } = self;
        let paths = if paths.rays > 0.0 { paths } else { with_means(paths, &means) };
        Choices { wavelengths_per_channel: count, wavelengths_gain: gain, wavelengths_reason: reason, ..paths }
    }
}

/// Why one wavelength a channel is enough, where no sample needs to be asked.
fn one_by_rule(scene: &Scene, prepared: &Prepared, software: bool) -> Option<String> {
    if prepared.disperses() {
        return Some("behind dispersion a path counts at its own wavelength only".into());
    }
    if most_wavelengths(prepared.path_iterations()) == 1 {
        return Some("one evaluation of a path is as long as a loop may be".into());
    }
    // Of scenes whose paths take as much as others' do; else it is counted.
    let cost = evaluation_cost(prepared, software);
    if cost >= MOST_COST_OF_ONE {
        return Some(costs_so_much(cost));
    }
    // Wavelengths that are drawn by emission make that even.
    let drawn = if prepared.warp.bits() > 0 { sources(scene) } else { Vec::new() };
    let curves = (0..scene.spectra.len()).filter(|spectrum| !drawn.contains(spectrum));
    let channels = prepared.integration.as_ref().map_or(&scene.channels, |responses| &responses.inner);
    let varies = |spectrum: usize| {
        let bounds = &channels.bounds;
        bounds.iter().any(|b| scene.spectra[spectrum].curve.variation(b[0], b[1]) > LEAST_VARIATION)
    };
    let none = !curves.into_iter().any(varies);
    none.then(|| "no spectrum varies by much within a channel".into())
}

fn costs_so_much(cost: f64) -> String {
    format!("evaluating a path once costs {cost:.2} of generating it")
}

/// At how many wavelengths a path may be evaluated at all, each of which takes so many iterations.
fn most_wavelengths(each: u32) -> u32 {
    let most = (LOOP_LIMIT / each).clamp(1, MOST_WAVELENGTHS);
    1 << most.ilog2()
}

/// Spectra of what emits.
fn sources(scene: &Scene) -> Vec<usize> {
    let surfaces = scene.objects.iter().filter_map(|object| Some(object.emission.as_ref()?.radiance));
    let lights = scene.lights.iter().map(|light| light.spectrum());
    surfaces.chain(lights).chain(scene.environment.iter().filter_map(|sky| sky.uniform())).collect()
}

/// Of each channel of the cube: variance of a sample as the nets of the render's sampler make it, from the difference of two.
fn net_variances(worker: &mut Worker, prepared: &Prepared, scene: &Scene) -> Result<Vec<f64>> {
    let net = net_samples(scene);
    let [first, second] = nets(worker, &pixels(&scene.film), net)?.map(|means| match &prepared.integration {
        Some(responses) => responses.sums(&means),
        None => means,
    });
    Ok(differences(&first, &second, scene.channels.len(), net))
}

/// Samples of a net: those of a full epoch of the render, as far as they are tried.
fn net_samples(scene: &Scene) -> u32 {
    scene.integrator.epoch.min(LARGEST_NET)
}

/// Two nets of `net` samples of the first of `units`, as [`values`].
fn nets(worker: &mut Worker, units: &[UnitRect], net: u32) -> Result<[Vec<f32>; 2]> {
    let some = &units[..units.len().min((NET_SAMPLES / net) as usize)];
    let mut of = |i: u32| Ok::<_, Error>(values(worker, some, FIRST_EPOCH + SINGLES + i, net)?.radiance);
    Ok([of(0)?, of(1)?])
}

fn kept() -> Error {
    Error::Internal("the pilot kept what it was lent".into())
}

/// All paths, where no sample needs to be asked.
fn all_by_rule(scene: &Scene, prepared: &Prepared, software: bool) -> Option<Choices> {
    let reason = if prepared.disperses() {
        "dispersion leaves paths to one channel each, of which the few that they are tried in do not tell".to_owned()
    } else {
        let cost = evaluation_cost(prepared, software);
        if scene.integrator.evaluation == Evaluation::Roulette || cost >= LEAST_COST {
            return None;
        }
        format!("evaluating a path costs {cost:.2} of generating it, too little to save")
    };
    Some(all(reason, 0, Vec::new()))
}

fn all(reason: String, samples: u32, mean_radiance: Vec<f64>) -> Choices {
    Choices {
        wavelengths_per_channel: 1,
        wavelengths_gain: 1.0,
        wavelengths_reason: String::new(),
        reason,
        scale: None,
        evaluated: 1.0,
        gain: 1.0,
        variance: 1.0,
        rays: 0.0,
        records: 0.0,
        map_records: 0.0,
        voxels: 0.0,
        samples,
        mean_radiance,
    }
}

fn with_means(choices: Choices, means: &Means) -> Choices {
    let Means { rays, work: Work { records, maps, cells } } = *means;
    Choices { rays, records, map_records: maps, voxels: cells, ..choices }
}

/// The pilot's pixels, in the coordinates of the full film: all where they are few, else points of Roberts' R2 sequence
/// (Martin Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018).
fn pixels(film: &Film) -> Vec<UnitRect> {
    let [x0, y0, ..] = film.crop;
    let [width, height] = film.cube_size();
    let unit = |x: u32, y: u32| [x, y, x + 1, y + 1];
    if u64::from(width) * u64::from(height) <= u64::from(PIXELS) {
        return (0..height).flat_map(|y| (0..width).map(move |x| unit(x0 + x, y0 + y))).collect();
    }
    // 1/g and 1/g² for the real root g of g³ = g + 1.
    const STEPS: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
    let place = |i: u32, step: f64, size: u32| ((0.5 + f64::from(i) * step).fract() * f64::from(size)) as u32;
    (0..PIXELS).map(|i| unit(x0 + place(i, STEPS[0], width), y0 + place(i, STEPS[1], height))).collect()
}

/// The pilot's paths.
struct Trial {
    /// Mean of the picture in every channel.
    means: Vec<f64>,
    /// Of each channel kept: variance of a sample, as the sampler's nets make it.
    variances: Vec<f64>,
    /// [path][channel kept]: radiance that was scattered.
    scattered: Vec<f32>,
    /// Of each path: the most that its scattered light brings to a representative channel, over that one's mean.
    energy: Vec<f64>,
    /// Of each path: what there is to evaluate of it, and of what is seen before it is scattered.
    work: Vec<[Work; 2]>,
    means_of_work: Means,
    /// Channels in all, and those in which a path is tried.
    channels: usize,
    tried: usize,
    samples: u32,
}

impl Trial {
    fn run(worker: &mut Worker, prepared: &Prepared, scene: &Scene) -> Result<Trial> {
        let (units, count) = (pixels(&scene.film), prepared.channels);
        let net = net_samples(scene);
        let representatives = representatives(prepared);
        let even = (0..count.min(MOST_CHANNELS)).map(|i| i * count / count.min(MOST_CHANNELS));
        let mut channels: Vec<usize> = even.chain(representatives.iter().copied()).collect();
        channels.sort_unstable();
        channels.dedup();
        let kept = |values: &[f32]| -> Vec<f32> {
            values.chunks(count).flat_map(|pixel| channels.iter().map(|&k| pixel[k])).collect()
        };
        let mut means = vec![0.0; count];
        let mut add = |values: &[f32]| {
            for pixel in values.chunks(count) {
                means.iter_mut().zip(pixel).for_each(|(mean, &value)| *mean += f64::from(value));
            }
        };
        let (mut radiance, mut scattered, mut work) = (Vec::new(), Vec::new(), Vec::new());
        let mut means_of_work = Means::default();
        for epoch in 0..SINGLES {
            let (values, works, rays) = work::sample(worker, prepared, &units, FIRST_EPOCH + epoch)?;
            add(&values);
            radiance.extend(kept(&values));
            means_of_work.rays += rays as f64;
            work.extend(works);
        }
        let paths = work.len() as f64;
        means_of_work.rays /= paths;
        means_of_work.work = work.iter().fold(Work::default(), |sum, &work| sum + work) * (1.0 / paths);
        let [first, second] = nets(worker, &units, net)?.map(|values| kept(&values));
        // The same paths, ended where they are scattered first.
        worker.limit_bounces(0);
        let mut of_seen = Vec::new();
        for epoch in 0..SINGLES {
            let (values, works, _) = work::sample(worker, prepared, &units, FIRST_EPOCH + epoch)?;
            of_seen.extend(works);
            let seen = kept(&values);
            let all = &radiance[epoch as usize * seen.len()..];
            scattered.extend(all.iter().zip(&seen).map(|(all, seen)| all - seen));
        }
        means.iter_mut().for_each(|mean| *mean /= f64::from(SINGLES) * units.len() as f64);
        let at: Vec<(usize, f64)> = (channels.iter().enumerate())
            .filter(|(_, k)| representatives.contains(k) && means[**k] > 0.0)
            .map(|(i, &k)| (i, means[k]))
            .collect();
        let energy = scattered
            .chunks(channels.len())
            .map(|path| at.iter().map(|&(i, mean)| (f64::from(path[i]) / mean).abs()).fold(0.0, f64::max));
        let energy = energy.collect();
        let singles = Samples { radiance: &radiance, pixels: units.len(), channels: channels.len() };
        let share = share_of_nets(&singles, &first, &second, net);
        Ok(Trial {
            means,
            variances: singles.variances(units.len()).into_iter().map(|variance| variance * share).collect(),
            scattered,
            energy,
            work: work.into_iter().zip(of_seen).map(|(all, seen)| [all, seen]).collect(),
            means_of_work,
            channels: count,
            tried: tried_channels(prepared),
            samples: units.len() as u32 * SINGLES + 2 * (first.len() / channels.len()) as u32 * net,
        })
    }

    /// The scale that is expected to bring most. All paths are evaluated where nothing brings enough, unless it `must` be.
    fn choose(self, costs: &Costs, must: bool) -> Choices {
        if let Some(dark) = self.means.iter().position(|mean| mean.is_nan() || *mean <= 0.0) {
            // Its light may come along paths that bring nothing elsewhere.
            let reason = format!("channel {dark} was dark in all samples of the pilot, and roulette could starve it");
            return all(reason, self.samples, self.means);
        }
        // Powers of the square root of two: so that what differs in the last bits chooses the same.
        let scales = (-24..=24).map(|i| 2f64.powf(0.5 * f64::from(i)));
        let expected = scales.map(|scale| (scale, self.expect(scale, costs)));
        let cost = self.means_of_work.evaluation(costs, self.channels);
        let fair = expected.filter(|(_, expected)| expected.variance <= MOST_VARIANCE);
        let best = fair.max_by(|(_, a), (_, b)| a.rounded_gain().total_cmp(&b.rounded_gain()));
        match best {
            None => all("some channel's noise would grow by more than a tenth".into(), self.samples, self.means),
            Some((_, expected)) if !must && expected.gain < LEAST_GAIN => {
                all(format!("roulette would bring {:.2}, too little", expected.gain), self.samples, self.means)
            }
            Some((scale, expected)) => Choices {
                scale: Some(scale),
                evaluated: expected.evaluated,
                gain: expected.gain,
                variance: expected.variance,
                ..all(format!("evaluating a path costs {cost:.2} of generating it"), self.samples, self.means)
            },
        }
    }

    /// What roulette with `scale` is expected to do. Dropping a path with the chance 1 - p and counting it for 1/p adds
    /// (1/p - 1) S² to the variance of what it scatters. What it saves is the evaluation of what comes behind what is seen; a path is
    /// tried wherever there is something behind.
    fn expect(&self, scale: f64, costs: &Costs) -> Expected {
        let kept = self.variances.len();
        let paths = self.energy.len() as f64;
        let (channels, tried) = (self.channels as f64, self.tried as f64);
        let (mut evaluated, mut added, mut time) = (0.0, vec![0.0; kept], 0.0);
        for ((path, energy), [work, seen]) in self.scattered.chunks(kept).zip(&self.energy).zip(&self.work) {
            let p = (scale * energy).clamp(1.0 / f64::from(MOST_WEIGHT), 1.0);
            let dropped = if seen.records > 0.0 { seen.cost(costs) } else { costs.skipped };
            let behind = work.records > seen.records;
            let p = if behind { p } else { 0.0 };
            time += channels * (p * work.cost(costs) + (1.0 - p) * dropped) / paths;
            if behind {
                time += tried * costs.tried * work.cost(costs) / paths;
            }
            evaluated += p / paths;
            // What scatters nothing adds none.
            if !behind || path.iter().all(|x| *x == 0.0) {
                continue;
            }
            if p < 1.0 {
                let more = (1.0 / p - 1.0) / paths;
                added.iter_mut().zip(path).for_each(|(sum, &x)| *sum += more * f64::from(x).powi(2));
            }
        }
        let grown = added
            .iter()
            .zip(&self.variances)
            .filter(|(added, _)| **added > 0.0)
            .map(|(added, of_all)| 1.0 + added / of_all);
        let (sum, variance) =
            grown.fold((0.0, 1.0), |(sum, most): (f64, f64), grown| (sum + grown - 1.0, most.max(grown)));
        let mean = 1.0 + sum / kept as f64;
        let whole = self.means_of_work.whole(costs, self.channels, 1);
        Expected { evaluated, variance, gain: whole / (self.means_of_work.making(costs) + time) / mean }
    }
}

/// Independent samples, [epoch][pixel][channel].
struct Samples<'a> {
    radiance: &'a [f32],
    pixels: usize,
    channels: usize,
}

impl Samples<'_> {
    /// Variance of each channel's samples around their pixel's mean, mean over the first so many pixels.
    fn variances(&self, pixels: usize) -> Vec<f64> {
        let epoch = self.pixels * self.channels;
        let mut variances = vec![0.0; self.channels];
        for pixel in 0..pixels {
            for (k, variance) in variances.iter_mut().enumerate() {
                let samples = || self.radiance.chunks(epoch).map(|epoch| f64::from(epoch[pixel * self.channels + k]));
                let n = samples().count() as f64;
                let mean = samples().sum::<f64>() / n;
                *variance += samples().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (n - 1.0) / pixels as f64;
            }
        }
        variances
    }
}

/// Variance of the sampler's nets over that of independent `singles`, per sample, 1 at most: from two means of a `net` in the first
/// pixels; the mean over the channels, since each alone is known badly.
fn share_of_nets(singles: &Samples, first: &[f32], second: &[f32], net: u32) -> f64 {
    let kept = singles.channels;
    let pixels = first.len() / kept;
    let squares = differences(first, second, kept, net);
    let of_paths = singles.variances(pixels);
    let shares: Vec<f64> = squares.iter().zip(&of_paths).filter(|(_, v)| **v > 0.0).map(|(s, v)| s / v).collect();
    if shares.is_empty() { 1.0 } else { (shares.iter().sum::<f64>() / shares.len() as f64).clamp(1e-4, 1.0) }
}

/// Variance of a sample of each channel, mean over the pixels, by two means of a `net`.
fn differences(first: &[f32], second: &[f32], channels: usize, net: u32) -> Vec<f64> {
    let pixels = (first.len() / channels) as f64;
    let mut squares = vec![0.0; channels];
    for (a, b) in first.chunks(channels).zip(second.chunks(channels)) {
        for (square, (a, b)) in squares.iter_mut().zip(a.iter().zip(b)) {
            *square += 0.5 * f64::from(a - b).powi(2) * f64::from(net) / pixels;
        }
    }
    squares
}

struct Expected {
    evaluated: f64,
    variance: f64,
    gain: f64,
}

impl Expected {
    fn rounded_gain(&self) -> f64 {
        (self.gain * 100.0).round() / 100.0
    }
}

/// Sums over the pilot's pixels and its `epochs` of one sample of each, of every channel.
pub fn channel_sums(worker: &mut Worker, film: &Film, channels: usize, epochs: Range<u32>) -> Result<Vec<f64>> {
    let units = pixels(film);
    let mut sums = vec![0.0; channels];
    for epoch in epochs {
        for pixel in values(worker, &units, FIRST_EPOCH + epoch, 1)?.radiance.chunks(channels) {
            sums.iter_mut().zip(pixel).for_each(|(sum, value)| *sum += f64::from(*value));
        }
    }
    Ok(sums)
}

/// What a pilot's samples brought back.
#[derive(Default)]
struct Values {
    /// [unit][channel]: means.
    radiance: Vec<f32>,
    /// Of all paths together.
    rays: u64,
}

/// Of `samples` samples of every pixel in `units`.
fn values(worker: &mut Worker, units: &[UnitRect], epoch: u32, samples: u32) -> Result<Values> {
    let mut values = Values::default();
    for units in units.chunks(worker.plan.units_at_once(samples)) {
        worker.submit(units, epoch, samples)?;
        if let Some(collected) = worker.collect()? {
            values.radiance.extend(collected.means());
            values.rays += collected.counters.rays();
        }
    }
    Ok(values)
}
