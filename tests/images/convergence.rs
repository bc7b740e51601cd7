//! How noise falls with samples, and that it does not depend on how many channels share the paths.

use glam::{DVec2, DVec3};
use spectile::scene::{Filter, Projection, Sampler, Scene, Sides};
use spectile::spectral::{Channels, Curve, Outside};

use crate::device::{Epochs, Settings, render};
use crate::scene_builder::*;
use crate::statistics::{Estimate, t_limit};

/// A floor with a ball under a square lamp: soft shadows, interreflection.
fn scene(sampler: Sampler, channels: Channels, radiance: impl IntoCurve) -> Scene {
    let mut scene = Builder::new()
        .camera(look(
            DVec3::new(0.0, 1.0, 2.0),
            DVec3::ZERO,
            DVec3::Y,
            Projection::Perspective { tan_half: DVec2::splat(0.4) },
        ))
        .film(16, 16, Filter::Box)
        .channels(channels)
        .bounces(2)
        .diffuse(quad(DVec3::new(-2.0, -0.5, 2.0), 4.0 * DVec3::X, 4.0 * DVec3::NEG_Z), 0.7)
        .diffuse(sphere(DVec3::ZERO, 0.5), 0.7)
        .lamp(quad(DVec3::new(-0.5, 1.5, -0.5), DVec3::X, DVec3::Z), radiance, Sides::Front)
        .build();
    scene.integrator.sampler = sampler;
    scene
}

/// Groups of pixels that stand for independent repetitions of a measurement.
const GROUPS: usize = 16;

/// ln of the relative variance of one epoch in a channel: the spread of the epochs' means over the square of their mean,
/// both summed over the pixels of one group.
fn log_variance(e: &Epochs, channel: usize, group: usize) -> f64 {
    let (mut variance, mut square) = (0.0, 0.0);
    for i in (channel..e.means[0].len()).step_by(e.channels).skip(group).step_by(GROUPS) {
        let of_pixel = Estimate::of(e.means.iter().map(|m| f64::from(m[i])));
        variance += of_pixel.error * of_pixel.error * e.means.len() as f64;
        square += of_pixel.mean * of_pixel.mean;
    }
    (variance / square).ln()
}

/// Slope of log noise over log samples by least squares, and its own error.
fn slope(sampler: Sampler) -> Estimate {
    let scene = scene(sampler, Channels::equal(500.0, 600.0, 1), 5.0);
    let rendered: Vec<(f64, Epochs)> = [(1, 128), (4, 128), (16, 64), (64, 64), (256, 24)]
        .into_iter()
        .map(|(samples, epochs)| {
            let e = render(&scene, epochs, samples, Settings { seed: u64::from(samples), ..Settings::default() });
            e.assert_clean();
            (f64::from(samples).ln(), e)
        })
        .collect();
    Estimate::of((0..GROUPS).map(|group| {
        let points: Vec<(f64, f64)> = rendered.iter().map(|(x, e)| (*x, 0.5 * log_variance(e, 0, group))).collect();
        let mean = |f: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / points.len() as f64;
        let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
        mean(&|p| (p.0 - x) * (p.1 - y)) / mean(&|p| (p.0 - x).powi(2))
    }))
}

/// -1/2 for independent samples, from 1 to 256. The fit's own error is a fifth of the band of ± 0.02 at most.
#[test]
fn independent_noise_falls_as_one_over_root_n() {
    let slope = slope(Sampler::Independent);
    assert!(slope.error < 0.004, "the fit sees too little: {slope:?}");
    assert!((slope.mean + 0.5).abs() <= 0.02, "{slope:?}");
}

/// Sobol points may only do better.
#[test]
fn sobol_noise_falls_at_least_as_fast() {
    let slope = slope(Sampler::Sobol);
    assert!(slope.error < 0.01, "the fit sees too little: {slope:?}");
    assert!(slope.mean <= -0.48, "{slope:?}");
}

/// Eight channels, and a thousand of which 125 each have the mean of one of the eight: the noise of such a channel is
/// the same. Two lamps with opposite spectra over three decades, so that no channel alone would decide as all do.
#[test]
fn noise_of_a_channel_does_not_grow_with_their_number() {
    let steps = |level: &dyn Fn(f64) -> f64| {
        let nm = (0..8).flat_map(|i| [400.0 + 50.0 * f64::from(i), 450.0 + 50.0 * f64::from(i)]).collect();
        let value = (0..8).flat_map(|i| [level(f64::from(i)); 2]).collect();
        Curve::Linear { nm, value, outside: Outside::Hold }
    };
    let rendered = [8, 1000].map(|count| {
        let lamp =
            scene(Sampler::Independent, Channels::equal(400.0, 800.0, count), steps(&|i| 10f64.powf(-3.0 * i / 7.0)));
        let scene = Builder(lamp)
            .lamp(sphere(DVec3::new(-0.8, 0.5, 0.3), 0.1), steps(&|i| 10f64.powf(3.0 * i / 7.0 - 1.0)), Sides::Front)
            .build();
        let e = render(&scene, 100, 16, Settings { seed: count as u64, ..Settings::default() });
        e.assert_clean();
        (count, e)
    });
    for k in 0..8 {
        let [few, many] = rendered.each_ref().map(|(count, e)| (k * count / 8, e));
        // The same pixels in both: what one group sees differs from what another does.
        let difference =
            Estimate::of((0..GROUPS).map(|g| log_variance(many.1, many.0, g) - log_variance(few.1, few.0, g)));
        // The limit of t is 6.8: a third more variance would be seen in any channel.
        assert!(difference.error < 0.04, "too little is seen in channel {k}: {difference:?}");
        let limit = t_limit(8, difference.freedom) * difference.error;
        assert!(difference.mean.abs() <= limit, "channel {k}, ln of 1,000 over 8: {difference:?}");
    }
}
