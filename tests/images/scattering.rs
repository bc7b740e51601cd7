//! Matter that scatters, on devices and in the f64 reference: furnaces, layers whose answers are published, single scattering, and clouds
//! by one against the other (docs/METHOD.md, Matter that scatters).
//!
//! Where a test has several cases of one kind, each is a channel: coefficients differ by orders from channel to channel, and
//! techniques are tested along.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec3;
use spectile::scene::{Camera, Evaluator, Field, Filter, Mesh, Phase, PhaseTable, Scene, Shape, Sides};

use crate::device::{Settings, assert_as_reference, measure, render};
use crate::scene_builder::heat::*;
use crate::scene_builder::*;
use crate::size;
use crate::statistics::{Bound, Estimate, assert_estimates};
use crate::truth;

fn isotropic(b: &mut Builder) -> Phase {
    b.henyey_greenstein(0.0)
}

/// How wide layers are, in thicknesses.
const HALF_WIDTH: f64 = 600.0;

fn layer() -> (DVec3, DVec3) {
    (DVec3::new(-HALF_WIDTH, -HALF_WIDTH, 0.0), DVec3::new(HALF_WIDTH, HALF_WIDTH, 1.0))
}

/// A layer of thickness 1 m with single scattering albedo and depth in each channel.
fn with_layer(b: Builder, albedo: &[f64], depth: &[f64], phase: impl FnOnce(&mut Builder) -> Phase) -> Builder {
    let scattered: Vec<f64> = albedo.iter().zip(depth).map(|(w, tau)| w * tau).collect();
    let absorbed: Vec<f64> = albedo.iter().zip(depth).map(|(w, tau)| (1.0 - w) * tau).collect();
    let ((channels, scattered), (_, absorbed)) = (by_channel(&scattered), by_channel(&absorbed));
    let mut b = b.channels(channels);
    let phase = phase(&mut b);
    let (low, high) = layer();
    b.medium(absorbed, None, Field::Constant(1.0)).scattering(scattered, phase).null_box(low, high)
}

/// Along one ray on the middle of the layer's top (or, from below, bottom), whose cosine to the normal is `mu`.
fn at_cosine(mu: f64, above: bool) -> Camera {
    let sine = (1.0 - mu * mu).sqrt();
    let direction = DVec3::new(sine, 0.0, if above { mu } else { -mu });
    let target = DVec3::new(0.0, 0.0, if above { 1.0 } else { 0.0 });
    look(target + 1e-3 * direction, target, DVec3::Y, narrow())
}

/// A black floor below the layer: the sky is on its other side only, but for what comes in between, some 1e-5.
fn black_below(b: Builder) -> Builder {
    b.black(disk(-DVec3::Z, DVec3::Z, 1.5 * HALF_WIDTH))
}

/// A line of a table: single scattering albedo, depth, and for light at cosine 1 and ½ what is reflected and what comes through
/// without the part that is not scattered.
type Layer = (f64, f64, [f64; 4]);

/// Reflected and transmitted shares of a beam are, by reciprocity, what the layer shows under a uniform sky of 1 on its side, or on the
/// other. `digit`: half a unit of the last digit.
#[track_caller]
fn assert_layers(what: &str, lines: &[Layer], epochs: u32, bound: f64, phase: impl Fn(&mut Builder) -> Phase) {
    let albedo: Vec<f64> = lines.iter().map(|line| line.0).collect();
    let depth: Vec<f64> = lines.iter().map(|line| line.1).collect();
    for (i, mu, above) in size::first(2, [(0, 1.0, true), (3, 0.5, false), (1, 1.0, false), (2, 0.5, true)]) {
        let direct = |tau: f64| if above { 0.0 } else { (-tau / mu).exp() };
        let expected: Vec<f64> = lines.iter().map(|line| line.2[i] + direct(line.1)).collect();
        let bare = Builder::new().camera(at_cosine(mu, above)).sky(1.0).bounces(600).roulette(64);
        let scene = black_below(with_layer(bare, &albedo, &depth, &phase)).build();
        assert_published(&format!("{what}, cosine {mu}, above {above}"), scene, &expected, epochs, bound);
    }
}

/// On the device, and less sharply by the reference.
#[track_caller]
fn assert_published(what: &str, scene: Scene, expected: &[f64], epochs: u32, resolution: f64) {
    // Half of the last digit that is published, of a hundredth at least, and the place where scattering happens, which is rounded.
    let allowance = 5e-6 / 0.01 + 2e-4;
    let estimates = measure(scene.clone(), epochs, 7);
    // Of what is hardly anything at all an absolute error is asked.
    let scale =
        |(e, want): (&Estimate, &f64)| if *want < 0.01 { Estimate { mean: e.mean - want + 0.01, ..*e } } else { *e };
    let shown: Vec<f64> = expected.iter().map(|want| want.max(0.01)).collect();
    let of_device: Vec<Estimate> = estimates.iter().zip(expected).map(scale).collect();
    assert_estimates(&format!("{what}, device"), &of_device, &shown, Bound { resolution, allowance });
    let samples = epochs * 4_000;
    let image = truth::render(&scene, &[[8, 8]], samples, 3);
    let estimate =
        |k: usize| Estimate { mean: image.mean[k], error: image.standard_error[k], freedom: f64::from(samples - 1) };
    let of_reference: Vec<Estimate> = (0..expected.len()).map(estimate).collect();
    let of_reference: Vec<Estimate> = of_reference.iter().zip(expected).map(scale).collect();
    assert_estimates(
        &format!("{what}, reference"),
        &of_reference,
        &shown,
        Bound { resolution: size::either(0.1, 0.03), allowance },
    );
}

/// Isotropic and forward layers, black below: adding and doubling with 48 Gauss angles, which agrees with DISORT 4 (Stamnes et al.) to 6e-6.
#[test]
fn layers_reflect_and_transmit_what_is_published() {
    let isotropic_layers: &[Layer] = &[
        (0.5, 0.1, [0.02173, 0.02163, 0.04150, 0.04110]),
        (0.9, 1.0, [0.26741, 0.22375, 0.39366, 0.27950]),
        (0.99, 1.0, [0.33292, 0.28310, 0.48652, 0.35629]),
        (1.0, 0.1, [0.04769, 0.04747, 0.09104, 0.09023]),
        (0.5, 10.0, [0.11523, 0.00008, 0.16014, 0.00002]),
        (0.9, 10.0, [0.41493, 0.00557, 0.50793, 0.00304]),
        (0.99, 10.0, [0.74093, 0.08472, 0.80716, 0.05738]),
        (1.0, 10.0, [0.85300, 0.14695, 0.89825, 0.10175]),
    ];
    assert_layers(
        "isotropic",
        &isotropic_layers[..size::either(4, 8)],
        size::either(2, 28),
        size::either(0.03, 0.01),
        isotropic,
    );
}

#[test]
fn forward_layers_reflect_and_transmit_what_is_published() {
    let forward: &[Layer] = &[
        (0.9, 1.0, [0.02968, 0.49427, 0.11167, 0.54557]),
        (1.0, 1.0, [0.04232, 0.58980, 0.16488, 0.69979]),
        (0.99, 1.0, [0.04079, 0.57959, 0.15833, 0.68238]),
        (1.0, 0.1, [0.00371, 0.09145, 0.01711, 0.16416]),
        (0.9, 10.0, [0.10237, 0.12972, 0.20778, 0.05778]),
        (0.99, 10.0, [0.34469, 0.47837, 0.51608, 0.31244]),
        (1.0, 10.0, [0.42227, 0.57768, 0.60403, 0.39597]),
    ];
    let phase = |b: &mut Builder| b.henyey_greenstein(0.85);
    assert_layers("forward", &forward[..size::either(2, 7)], size::either(2, 20), size::either(0.06, 0.02), phase);
}

/// In matter light has no side to come from: a triangle with shading normals where nobody sees it, under the black floor, changes nothing.
#[test]
fn shading_normals_are_none_of_matters() {
    let positions = [DVec3::ZERO, DVec3::X, DVec3::Y].map(|at| at - 3.0 * DVec3::Z).to_vec();
    let hidden = Shape::Mesh(Mesh { positions, triangles: vec![[0, 1, 2]] });
    let normals = round_normals(DVec3::new(0.3, 0.3, -6.0), &hidden);
    let bare = Builder::new().camera(at_cosine(0.5, true)).sky(1.0).bounces(20);
    let scene =
        black_below(with_layer(bare, &[0.5], &[10.0], isotropic)).diffuse(hidden, 0.5).attributes(normals).build();
    let found = measure(scene, 2, 7);
    // As `layers_reflect_and_transmit_what_is_published` has it.
    assert_estimates("beside normals", &found, &[0.16014], Bound { resolution: 0.01, allowance: 5e-6 / 0.16 + 2e-4 });
}

/// What is scattered once, of a beam straight down that is seen straight from above: BRF = ω P / (4 (μ + μ₀)) (1 - e^(-τ (1/μ + 1/μ₀))), times μ₀ E / π.
#[test]
fn what_is_scattered_once() {
    let depth = [0.1, 1.0, 10.0];
    let once = |phase: f64| depth.map(|tau: f64| phase / 8.0 * -(-2.0 * tau).exp_m1() * 5.0 / PI);
    assert!((once(1.0)[0] * PI / 5.0 - 0.0226587).abs() < 1e-7, "the published digits");
    let scene = |phase: &dyn Fn(&mut Builder) -> Phase| {
        let b = Builder::new().camera(at_cosine(1.0, true)).directional(-DVec3::Z, 5.0).bounces(1);
        black_below(with_layer(b, &[1.0; 3], &depth, phase)).build()
    };
    // Straight back: (1 - g²) / (1 + g)³ and 3/4 (1 + cos²).
    let table = PhaseTable { degrees: vec![0.0, 90.0, 180.0], nm: vec![500.0], values: vec![vec![1.0; 3]] };
    let table = Arc::new(table);
    type Case<'a> = (&'a str, &'a dyn Fn(&mut Builder) -> Phase, f64);
    let cases: [Case; 4] = [
        ("isotropic", &isotropic, 1.0),
        ("forward", &|b| b.henyey_greenstein(0.5), 0.75 / 1.5f64.powi(3)),
        ("Rayleigh", &|_| Phase::Rayleigh { depolarisation: 0.0 }, 1.5),
        ("a table", &|_| Phase::Table(table.clone()), 1.0),
    ];
    for (what, phase, backward) in cases {
        assert_published(&format!("once, {what}"), scene(phase), &once(backward), 4, 0.01);
    }
}

/// Half spaces of one temperature, isotropic: √(1 - ω) H(μ), Kirchhoff's complement of the plane albedo.
#[test]
fn half_spaces_emit_what_is_published() {
    let albedo = [0.5, 0.8, 0.9, 0.99];
    for (mu, shares) in
        [(1.0, [0.884774, 0.714745, 0.585053, 0.247279]), (0.2, [0.787336, 0.549464, 0.408387, 0.139977])]
    {
        let (channels, scattered) = by_channel(&albedo.map(|w| 60.0 * w));
        let (_, absorbed) = by_channel(&albedo.map(|w| 60.0 * (1.0 - w)));
        let mut b = Builder::new().camera(at_cosine(mu, true)).channels(channels.clone()).bounces(500).roulette(32);
        let phase = isotropic(&mut b);
        let (low, high) = layer();
        let kelvin = Some(Field::Constant(3000.0));
        let scene =
            b.medium(absorbed, kelvin, Field::Constant(1.0)).scattering(scattered, phase).null_box(low, high).build();
        let black = means(&planck(3000.0), &channels);
        let expected: Vec<f64> = shares.iter().zip(black).map(|(share, black)| share * black).collect();
        // Radiances are all above 0.01 of what is asked: scaled, so that they are.
        let scale = 1.0 / expected[0];
        let estimates = measure(scene.clone(), size::either(1, 10), 7);
        let scaled = |e: &Estimate| Estimate { mean: scale * e.mean, error: scale * e.error, ..*e };
        let of_device: Vec<Estimate> = estimates.iter().map(scaled).collect();
        let expected: Vec<f64> = expected.iter().map(|want| scale * want).collect();
        let bound = Bound { resolution: size::either(0.03, 0.01), allowance: 2e-4 };
        assert_estimates(&format!("half space at {mu}, device"), &of_device, &expected, bound);
        let samples = size::either(2_000, 20_000);
        let image = truth::render(&scene, &[[0, 0]], samples, 3);
        let estimate = |k: usize| Estimate {
            mean: scale * image.mean[k],
            error: scale * image.standard_error[k],
            freedom: f64::from(samples - 1),
        };
        let of_reference: Vec<Estimate> = (0..4).map(estimate).collect();
        assert_estimates(
            &format!("half space at {mu}, reference"),
            &of_reference,
            &expected,
            Bound { resolution: 0.1, ..bound },
        );
    }
}

/// A phase function with a forward peak, by two columns.
fn droplets() -> Phase {
    let degrees: Vec<f64> = (0..=360).map(|i| 0.5 * f64::from(i)).collect();
    let peak = |width: f64| degrees.iter().map(|d| 0.2 + (-d / width).exp() * 30.0 / width).collect::<Vec<f64>>();
    let normalised = |values: Vec<f64>| {
        let mean: f64 = (0..values.len() - 1)
            .map(|i| {
                let [a, b] = [degrees[i], degrees[i + 1]].map(f64::to_radians);
                let slope = (values[i + 1] - values[i]) / (b - a);
                values[i] * a.cos() - values[i + 1] * b.cos() + slope * (b.sin() - a.sin())
            })
            .sum::<f64>()
            / 2.0;
        values.iter().map(|v| v / mean).collect()
    };
    let values = vec![normalised(peak(6.0)), normalised(peak(20.0))];
    Phase::Table(Arc::new(PhaseTable { degrees: degrees.clone(), nm: vec![500.0, 530.0], values }))
}

/// Everything at once: voxels of three kinds of matter, one of them with a temperature, of several phase functions.
fn cloud(b: Builder, absorption: f64, kelvin: Option<Field>) -> Builder {
    let hash = |[x, y, z]: [u32; 3], salt: u32| f64::from((x * 73 + y * 179 + z * 283 + salt * 37) % 101) / 50.0;
    let (channels, steep) = by_channel(&[4.0, 1.0, 0.25, 0.06]);
    let (_, flat) = by_channel(&[0.5, 0.6, 0.7, 0.8]);
    let (_, g) = by_channel(&[0.8, 0.6, 0.3, -0.4]);
    let mut b = b.channels(channels);
    let forward = b.henyey_greenstein(g);
    b.medium(absorption, kelvin, grid([3, 4, 5], |v| hash(v, 1)))
        .scattering(steep, forward)
        .beside(absorption, Field::Constant(1.0))
        .scattering(flat.clone(), Phase::Rayleigh { depolarisation: 0.1 })
        .beside(0.0, grid([3, 4, 5], |v| hash(v, 2)))
        .scattering(flat, droplets())
        .null_box(DVec3::new(-0.8, -0.7, -0.6), DVec3::new(0.7, 0.8, 0.9))
}

/// Nothing is lost and nothing gained: under a sky of radiance 1 whatever scatters shows 1; in a black room of one temperature whatever
/// also absorbs shows what a black body does.
#[test]
fn furnaces() {
    // Many pixels, so that a device has something to do.
    let scene = cloud(Builder::new().into_room().film(24, 24, Filter::Box).sky(1.0).bounces(100), 0.0, None).build();
    let rendered = render(&scene, 8, 4, Settings::default());
    rendered.assert_clean();
    assert_estimates("furnace", &rendered.image_means(), &[1.0; 4], Bound { resolution: 0.01, allowance: 1e-4 });
    let kelvin = Some(grid([3, 4, 5], |_| 3000.0));
    let room = || room(DVec3::new(-1.0, -1.0, -1.0), DVec3::new(1.0, 1.0, 3.0));
    let scene = cloud(
        Builder::new().into_room().film(24, 24, Filter::Box).bounces(60).black(room()).at_kelvin(3000.0),
        0.3,
        kelvin,
    )
    .build();
    let black = means(&planck(3000.0), &scene.channels);
    let rendered = render(&scene, 8, 4, Settings::default());
    rendered.assert_clean();
    assert_estimates("thermal furnace", &rendered.image_means(), &black, Bound { resolution: 0.01, allowance: 1e-4 });
}

/// Ground, a sun, a point light and a lamp around it; a ball of glass in it.
#[test]
fn clouds_against_the_reference() {
    let lit = |b: Builder| {
        b.into_room()
            .bounces(6)
            .diffuse(quad(DVec3::new(-1.0, -1.0, -1.0), 2.0 * DVec3::X, 2.0 * DVec3::Y), 0.6)
            .lamp(disk(DVec3::new(0.9, 0.0, 0.5), -DVec3::X, 0.3), 6.0, Sides::Front)
            .point(DVec3::new(-0.9, 0.95, 1.5), 3.0)
            .sun(DVec3::new(0.3, -1.0, -0.2).normalize(), 0.05, 4.0)
    };
    let bound = Bound { resolution: size::either(0.25, 0.1), allowance: 3e-4 };
    let samples = size::either([16, 128], [64, 256]);
    let warm = cloud(
        lit(Builder::new()).dielectric(sphere(DVec3::new(0.1, 0.0, 0.1), 0.3), 1.4, 0.0),
        0.2,
        Some(Field::Constant(2800.0)),
    );
    assert_as_reference("warm cloud with a ball of glass", &warm.build(), samples, size::either(3_000, 50_000), bound);
    if size::is_full() {
        let cold = cloud(lit(Builder::new()), 0.2, None).build();
        assert_as_reference("cloud", &cold, samples, 50_000, bound);
    }
}

/// 64 channels over six decades of one medium, sixteen collisions: with techniques every channel has its mean, and a relative variance of a sample
/// of at most twice their number; with one for all, the mean of coefficients, thin channels have none to speak of.
#[test]
fn techniques_bound_the_spread_of_samples() {
    let coefficients: Vec<f64> = (0..64).map(|k| 10f64.powf(-3.0 + 6.0 * f64::from(k) / 63.0)).collect();
    let (channels, scattered) = by_channel(&coefficients);
    let scene = |techniques: Option<u32>| {
        let mut b =
            Builder::new().camera(look(4.0 * DVec3::Z, DVec3::ZERO, DVec3::Y, narrow())).channels(channels.clone());
        let phase = isotropic(&mut b);
        let b = b.sky(1.0).bounces(16).medium(0.0, None, Field::Constant(1.0)).scattering(scattered.clone(), phase);
        let mut scene = b.null(sphere(DVec3::ZERO, 1.0)).build();
        scene.integrator.techniques = techniques;
        scene
    };
    let samples = 16_384;
    let image = truth::render(&scene(None), &[[0, 0]], size::either(400, 20_000), 3);
    let spread = |techniques: Option<u32>| {
        let mut scene = scene(techniques);
        (scene.film.width, scene.film.height, scene.film.crop) = (128, 128, [0, 0, 128, 128]);
        // One sample a pixel: the pixels are samples.
        let rendered = render(&scene, 2, 1, Settings::default());
        rendered.assert_clean();
        rendered.replicas()
    };
    let relative = |e: &Estimate| e.error.powi(2) * 2.0 * f64::from(samples) / e.mean.powi(2);
    let with = spread(None);
    for (k, estimate) in with.iter().enumerate() {
        let variance = relative(estimate);
        assert!(variance <= 2.0 * 16.0, "channel {k}: relative variance {variance}");
        let error = (estimate.error.powi(2) + image.standard_error[k].powi(2)).sqrt();
        // Of 64 channels: 3.9 errors are exceeded by chance in one of 160. What none of n samples met may be 3/n of all.
        let limit = 3.9 * error + 3.0 / f64::from(image.samples);
        let off = (estimate.mean - image.mean[k]).abs();
        assert!(off < limit, "channel {k}: {} ± {}, the reference {}", estimate.mean, estimate.error, image.mean[k]);
    }
    // By the mean coefficient alone, thinner channels have a spread that grows with every collision.
    let most = |all: &[Estimate]| all.iter().map(relative).fold(0.0, f64::max);
    let (with, without) = (most(&with), most(&spread(Some(1))));
    assert!(without > 10.0 * with, "relative variance {without} with one technique, {with} with sixteen");
}

/// Where camera rays are always scattered that leave through matter, no mean changes, of voxels nor of what is the same everywhere: a thin cloud
/// that fills a part of the pixels, before the sky and before ground, as the reference sees it, which knows nothing of that; and light that is
/// scattered once in a layer as the closed form has it, without the noise of rays that go through.
#[test]
fn forced_collisions_change_no_mean() {
    // Voxels without a surface behind: `render::sky`, by another code.
    if size::is_full() {
        let b = Builder::new().into_room().bounces(6).sky(0.2);
        let b = b.diffuse(quad(DVec3::new(-1.0, -1.0, -1.0), 1.2 * DVec3::X, 2.0 * DVec3::Y), 0.6);
        let mut scene = cloud(b.point(DVec3::new(-0.9, 0.95, 1.5), 3.0), 0.2, None).build();
        scene.integrator.forced_collision = true;
        let bound = Bound { resolution: 0.1, allowance: 3e-4 };
        assert_as_reference("cloud, forced", &scene, [64, 256], 50_000, bound);
    }

    // Depths down to where 1 - e^-τ is rounding in an f32; a sun straight down, seen from above at a cosine of a half.
    let depth = [1e-6, 1e-3, 0.03, 0.3, 1.0];
    let scene = |forced: bool| {
        let b = Builder::new().camera(at_cosine(0.5, true)).bounces(1).directional(-DVec3::Z, PI);
        let mut scene = with_layer(b, &[1.0; 5], &depth, isotropic).build();
        scene.integrator.forced_collision = forced;
        (scene.film.width, scene.film.height, scene.film.crop) = (64, 64, [0, 0, 64, 64]);
        scene
    };
    let expected = depth.map(|tau: f64| (1.0 - (-3.0 * tau).exp()) / (4.0 * 1.5));
    let spread = |forced: bool| {
        let rendered = render(&scene(forced), 4, 16, Settings::default());
        rendered.assert_clean();
        rendered.replicas()
    };
    let (with, without) = (spread(true), spread(false));
    assert_estimates("a layer, forced", &with, &expected, Bound { resolution: 0.02, allowance: 2e-5 });
    for k in 0..3 {
        let gain = (without[k].error / with[k].error).powi(2);
        assert!(gain > 10.0, "depth {}: a variance {gain} times less", depth[k]);
    }
}

/// The same by all evaluators.
#[test]
fn clouds_by_all_evaluators() {
    let scene = |evaluator: Evaluator| -> Scene {
        let b = cloud(Builder::new().into_room().bounces(5).sky(1.0).point(DVec3::new(0.0, 0.9, 0.9), 1.0), 0.2, None);
        let mut scene = b.build();
        scene.integrator.evaluator = evaluator;
        scene
    };
    let shown = |evaluator| render(&scene(evaluator), 2, 16, Settings::default()).means;
    let pixel = shown(Evaluator::DpeptPixel);
    for other in size::first(1, [Evaluator::Pt, Evaluator::DpeptPath, Evaluator::DpeptSpectral]) {
        let same = shown(other);
        for (a, b) in pixel.iter().flatten().zip(same.iter().flatten()) {
            // Coefficients are the same all over a channel; some hundred records are rounded.
            assert!((a - b).abs() <= 2e-4 * a.abs().max(0.01), "{other:?}: {a} {b}");
        }
    }
}
