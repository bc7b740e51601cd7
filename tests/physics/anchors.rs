//! Published numbers of matter that scatters, on a device and in the f64 reference: what layers, half spaces and a cloud of steps reflect, let
//! through and emit.
//!
//! By reciprocity the share of a beam at the cosine μ that a layer reflects is what a camera sees along μ under a sky of radiance 1 on its side, and the
//! share that comes through what one sees on the other side. So one narrow ray measures a flux. Lines of a table are channels of one medium: what
//! differs between them drives the same paths, by techniques.
//!
//! Of each number the standard error is at most 0.3 % (1 % below 0.01; below 0.001, 1e-5 of what comes in) with `--full`, and ten times that without;
//! of long paths on software devices see [`coarser`]. Samples are as many as a pilot with another seed asks for. All comparisons together fail by chance
//! once in a hundred: Šidák's correction over the suite. With `--nocapture` every number is printed: who, what, published, measured, standard error, z.
//! SPECTILE_ANCHORS names the pictures to take, by words of their first number.

use std::f64::consts::PI;
use std::ops::Range;

use glam::{DMat3, DVec2, DVec3};
use spectile::scene::{Camera, Environment, Field, Phase, Projection, Scene, Texels};
use spectile::spectral::Channels;
use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::device::{Settings, render, shared};
use crate::scene_builder::heat::*;
use crate::scene_builder::*;
use crate::size;
use crate::statistics::Estimate;
use crate::truth;

/// A number: half a unit of its last digit, and the standard error that it was published with.
struct Anchor {
    what: String,
    value: f64,
    digit: f64,
    spread: f64,
}

/// One pixel, whose channels show an anchor each: `unit` times it, and `direct` beside it.
struct Setup {
    scene: Scene,
    anchors: Vec<Anchor>,
    direct: Vec<f64>,
    unit: Vec<f64>,
}

/// A layer: single scattering albedo, depth, asymmetry.
#[derive(Clone, Copy)]
struct Layer {
    albedo: f64,
    depth: f64,
    g: f64,
}

/// What of a layer is measured.
#[derive(Clone, Copy, PartialEq)]
enum Of {
    Reflected(f64),
    /// Without what was not scattered.
    Transmitted(f64),
    /// Straight down and seen from straight above.
    Brf,
}

/// Half of what layers of thickness 1 m are wide. What leaves through the sides has gone so far without a collision: e^(-600 τ), 1e-8 of the thinnest.
const HALF_WIDTH: f64 = 600.0;

/// Of layers that stand for half spaces: 1,000 free paths. Devices do not resolve what is much thinner than their scene, of 1.5e-5 of its half size.
const HALF_WIDTH_OF_DEEP: f64 = 10.0;

fn half_width(layers: &[Layer]) -> f64 {
    if layers.iter().all(|layer| layer.depth >= 100.0) { HALF_WIDTH_OF_DEEP } else { HALF_WIDTH }
}

fn half(digits: i32) -> f64 {
    0.5 * 10f64.powi(-digits)
}

/// Collisions after which 1e-4 is left of the light that stays longest: with each it loses the share 1 - ω to matter, and to both sides
/// π² (1 - g) / (3 (τ* + 1.42)²), τ* = (1 - g) τ (diffusion, 1.42 the extrapolated lengths).
fn collisions(layers: &[Layer]) -> u32 {
    let needed = |layer: &Layer| {
        let depth = (1.0 - layer.g) * layer.depth + 1.42;
        -1e-4f64.ln() / (1.0 - layer.albedo + PI * PI * (1.0 - layer.g) / (3.0 * depth * depth))
    };
    layers.iter().map(needed).fold(12.0, f64::max) as u32
}

fn with_layers(b: Builder, layers: &[Layer], phase: Option<Phase>) -> Builder {
    let each = |value: fn(&Layer) -> f64| by_channel(&layers.iter().map(value).collect::<Vec<f64>>());
    let (channels, scattered) = each(|layer| layer.albedo * layer.depth);
    let (_, absorbed) = each(|layer| (1.0 - layer.albedo) * layer.depth);
    let (_, g) = each(|layer| layer.g);
    let mut b = b.channels(channels).bounces(collisions(layers)).roulette(32);
    let phase = phase.unwrap_or_else(|| b.henyey_greenstein(g));
    let width = half_width(layers);
    let [low, high] = [DVec3::new(-width, -width, 0.0), DVec3::new(width, width, 1.0)];
    b.medium(absorbed, None, Field::Constant(1.0)).scattering(scattered, phase).null_box(low, high)
}

/// Along one ray on the top of layers, or on their bottom, at a cosine to the normal; beside the middle, where triangles meet, and one ray in 2,500 slips
/// through between them in the reference.
fn at_cosine(mu: f64, above: bool) -> Camera {
    let sine = (1.0 - mu * mu).sqrt();
    let direction = DVec3::new(sine, 0.0, if above { mu } else { -mu });
    let target = DVec3::new(0.0, 0.2, if above { 1.0 } else { 0.0 });
    look(target + 1e-3 * direction, target, DVec3::Y, narrow())
}

/// A sky that depends on the cosine to the zenith alone, by channel: 4,096 rows from the zenith to the nadir.
fn sky_of(mut b: Builder, radiance: impl Fn(f64, usize) -> f64) -> Builder {
    const ROWS: u32 = 4_096;
    let channels = b.0.channels.bounds.clone();
    let nm: Vec<f64> = channels.iter().flatten().copied().collect();
    let row = |y: u32| {
        let cosine = (PI * (f64::from(y) + 0.5) / f64::from(ROWS)).cos();
        let bands: Vec<f32> = (0..channels.len()).flat_map(|k| [radiance(cosine, k) as f32; 2]).collect();
        [bands.clone(), bands.clone(), bands.clone(), bands].concat()
    };
    let texels: Vec<f32> = (0..ROWS).flat_map(row).collect();
    b = b.map([4, ROWS], Texels::Spectral { nm, radiance: texels.into() });
    let Some(Environment::Map(map)) = &mut b.0.environment else { unreachable!("a map") };
    // The map's +y is the zenith, +z.
    map.to_map = DMat3::from_rotation_x(-0.5 * PI);
    b
}

/// Layers under light from above. Thin ones, of which most of a ray sees nothing, by a map whose lower half is dark, before which collisions can be
/// forced; others above a black floor, so near that what passes between both from beyond its edge is 1e-8.
fn measured(layers: &[Layer], phase: Option<Phase>, of: Of) -> Scene {
    let (mu, above) = match of {
        Of::Reflected(mu) => (mu, true),
        Of::Transmitted(mu) => (mu, false),
        Of::Brf => (1.0, true),
    };
    let thin = layers.iter().all(|layer| layer.depth <= 0.2);
    let b = with_layers(Builder::new().camera(at_cosine(mu, above)), layers, phase);
    let b = match of {
        Of::Brf => b.directional(-DVec3::Z, PI),
        _ if thin => sky_of(b, |cosine, _| if cosine > 0.0 { 1.0 } else { 0.0 }),
        _ => b.sky(1.0).black(disk(-0.1 * DVec3::Z, DVec3::Z, 1.5 * HALF_WIDTH)),
    };
    let mut scene = b.build();
    scene.integrator.forced_collision = thin;
    scene
}

/// What is measured of layers, each a channel, by one picture.
fn setup(name: &str, layers: &[Layer], phase: Option<Phase>, of: Of, values: &[f64], digits: i32) -> Setup {
    let what = |layer: &Layer| {
        let quantity = match of {
            Of::Reflected(mu) => format!("R({mu})"),
            Of::Transmitted(mu) => format!("T({mu})"),
            Of::Brf => "BRF".into(),
        };
        format!("{name}, ω {} τ {}, {quantity}", layer.albedo, layer.depth)
    };
    let direct = |layer: &Layer| match of {
        Of::Transmitted(mu) => (-layer.depth / mu).exp(),
        _ => 0.0,
    };
    let anchor =
        |(layer, value): (&Layer, &f64)| Anchor { what: what(layer), value: *value, digit: half(digits), spread: 0.0 };
    Setup {
        scene: measured(layers, phase, of),
        anchors: layers.iter().zip(values).map(anchor).collect(),
        direct: layers.iter().map(direct).collect(),
        unit: vec![1.0; layers.len()],
    }
}

/// A line of a table: albedo, depth; R and T at cosine 1, at ½; BRF.
type Line = (f64, f64, [f64; 5]);

/// Adding and doubling with 48 Gauss angles, which agrees with DISORT 4 (Stamnes et al.) to 6e-6.
const ISOTROPIC: [Line; 12] = [
    (0.5, 0.1, [0.02173, 0.02163, 0.04150, 0.04110, 0.01233]),
    (0.9, 0.1, [0.04210, 0.04191, 0.08038, 0.07965, 0.02390]),
    (0.99, 0.1, [0.04712, 0.04691, 0.08996, 0.08915, 0.02675]),
    (1.0, 0.1, [0.04769, 0.04747, 0.09104, 0.09023, 0.02707]),
    (0.5, 1.0, [0.09912, 0.07818, 0.14975, 0.09495, 0.07658]),
    (0.9, 1.0, [0.26741, 0.22375, 0.39366, 0.27950, 0.21000]),
    (0.99, 1.0, [0.33292, 0.28310, 0.48652, 0.35629, 0.26262]),
    (1.0, 1.0, [0.34133, 0.29079, 0.49838, 0.36629, 0.26939]),
    (0.5, 10.0, [0.11523, 0.00008, 0.16014, 0.00002, 0.09785]),
    (0.9, 10.0, [0.41493, 0.00557, 0.50793, 0.00304, 0.38505]),
    (0.99, 10.0, [0.74093, 0.08472, 0.80716, 0.05738, 0.74165]),
    (1.0, 10.0, [0.85300, 0.14695, 0.89825, 0.10175, 0.87184]),
];

/// The same, g = 0.85.
const FORWARD: [Line; 7] = [
    (1.0, 0.1, [0.00371, 0.09145, 0.01711, 0.16416, 0.00118]),
    (0.9, 1.0, [0.02968, 0.49427, 0.11167, 0.54557, 0.01295]),
    (0.99, 1.0, [0.04079, 0.57959, 0.15833, 0.68238, 0.01707]),
    (1.0, 1.0, [0.04232, 0.58980, 0.16488, 0.69979, 0.01763]),
    (0.9, 10.0, [0.10237, 0.12972, 0.20778, 0.05778, 0.08276]),
    (0.99, 10.0, [0.34469, 0.47837, 0.51608, 0.31244, 0.31825]),
    (1.0, 10.0, [0.42227, 0.57768, 0.60403, 0.39597, 0.39546]),
];

/// A table, five pictures for lines of one depth.
fn table(name: &str, lines: &[Line], g: f64) -> Vec<Setup> {
    let of_one_depth = |lines: &[Line]| {
        let layers: Vec<Layer> = lines.iter().map(|&(albedo, depth, _)| Layer { albedo, depth, g }).collect();
        let columns = [Of::Reflected(1.0), Of::Transmitted(1.0), Of::Reflected(0.5), Of::Transmitted(0.5), Of::Brf];
        let values = |i: usize| lines.iter().map(|line| line.2[i]).collect::<Vec<f64>>();
        let column = |(i, of): (usize, Of)| setup(name, &layers, None, of, &values(i), 5);
        columns.into_iter().enumerate().map(column).collect::<Vec<Setup>>()
    };
    // What needs long paths is not among what does not.
    lines.chunk_by(|a, b| a.1 == b.1 && (a.1 < 5.0 || b.0 < 0.95 || a.0 >= 0.95)).flat_map(of_one_depth).collect()
}

/// What is reflected, and what comes through, of layers that are channels of one medium.
fn fluxes(name: &str, phase: Option<Phase>, mu: f64, lines: &[(Layer, f64, f64)], digits: i32) -> Vec<Setup> {
    let layers: Vec<Layer> = lines.iter().map(|line| line.0).collect();
    let [reflected, transmitted]: [Vec<f64>; 2] =
        [lines.iter().map(|line| line.1).collect(), lines.iter().map(|line| line.2).collect()];
    vec![
        setup(name, &layers, phase.clone(), Of::Reflected(mu), &reflected, digits),
        setup(name, &layers, phase, Of::Transmitted(mu), &transmitted, digits),
    ]
}

fn layer(albedo: f64, depth: f64, g: f64) -> Layer {
    Layer { albedo, depth, g }
}

/// Problems 1 to 3 of DISORT's own tests (van de Hulst 1980; Sweigart 1970 for Rayleigh), and MCML's layer (Wang, Jacques, Zheng 1995; van de
/// Hulst): absorption 10, scattering 90 per cm, 0.02 cm.
fn disort() -> Vec<Setup> {
    let rayleigh = Some(Phase::Rayleigh { depolarisation: 0.0 });
    let thin: Vec<_> = [(0.2, 0.025447, 0.025277), (0.99, 0.133177, 0.132330), (1.0, 0.134651, 0.133782)]
        .map(|(albedo, r, t)| (layer(albedo, 0.03125, 0.0), r, t))
        .into();
    let thick: Vec<_> = [(0.2, 0.082661, 0.0), (0.99, 0.877510, 0.000779), (1.0, 0.978426, 0.021536)]
        .map(|(albedo, r, t)| (layer(albedo, 32.0, 0.0), r, t))
        .into();
    let air: Vec<_> = [
        (0.5, 0.2, 0.211725, 0.174817),
        (1.0, 0.2, 0.496837, 0.419925),
        (0.5, 5.0, 0.247206, 0.000996),
        (1.0, 5.0, 0.893943, 0.106048),
    ]
    .map(|(albedo, depth, r, t)| (layer(albedo, depth, 0.0), r, t))
    .into();
    let forward = [
        (layer(1.0, 1.0, 0.75), 0.078744, 0.553378),
        (layer(1.0, 8.0, 0.75), 0.506408, 0.493237),
        (layer(0.9, 2.0, 0.75), 0.09739, 0.66096 - (-2.0f64).exp()),
    ];
    let mut all = fluxes("isotropic", None, 0.1, &thin, 6);
    all.extend(fluxes("isotropic", None, 0.1, &thick[..1], 6));
    all.extend(fluxes("isotropic", None, 0.1, &thick[1..], 6));
    all.extend(fluxes("Rayleigh", rayleigh.clone(), 0.080442, &air[..2], 6));
    all.extend(fluxes("Rayleigh", rayleigh.clone(), 0.080442, &air[2..], 6));
    all.extend(fluxes("g 0.75", None, 1.0, &forward, 5));
    for (mu, r, t) in [(1.0, 0.09121, 0.09006), (0.5, 0.16719, 0.16249), (0.1, 0.46243, 0.40223)] {
        all.extend(fluxes("Rayleigh", rayleigh.clone(), mu, &[(layer(1.0, 0.2, 0.0), r, t)], 5));
    }
    all
}

/// Of an isothermal half space, isotropic, √(1 - ω) H(μ) of what a black body sends: a layer so deep that e^-17 at most of it is missing. Its mean
/// over the hemisphere is what a small white disk shows that faces it.
fn half_spaces() -> Vec<Setup> {
    let all = [0.5, 0.8, 0.9, 0.99];
    let (kelvin, lines) = (
        3000.0,
        [
            (Some(0.1), [0.758279, 0.509290, 0.370664, 0.122488]),
            (Some(0.2), [0.787336, 0.549464, 0.408387, 0.139977]),
            (Some(0.5), [0.839856, 0.632030, 0.492061, 0.184860]),
            (Some(1.0), [0.884774, 0.714745, 0.585053, 0.247279]),
            (None, [0.853456, 0.658133, 0.521976, 0.205436]),
        ],
    );
    let of_line = |(mu, values): (Option<f64>, [f64; 4]), range: Range<usize>| {
        let (albedo, values) = (&all[range.clone()], &values[range]);
        let layers: Vec<Layer> = albedo.iter().map(|albedo| layer(*albedo, 100.0, 0.0)).collect();
        // A thousandth of the layer's half width above it, its own radius two thousandths of that.
        let [lens, patch] = [1.0099, 1.01].map(|z| DVec3::new(0.0, 0.2, z));
        let camera = mu.map_or_else(|| look(lens, patch, DVec3::Y, narrow()), |mu| at_cosine(mu, true));
        let mut b = with_layers(Builder::new().camera(camera), &layers, None);
        b.0.media[0].temperature = Some(Field::Constant(kelvin));
        if mu.is_none() {
            b.0.integrator.max_bounces += 1;
            b = b.diffuse(disk(patch, -DVec3::Z, 2e-5), 1.0);
        }
        let scene = b.build();
        let quantity = mu.map_or("mean".to_owned(), |mu| format!("μ {mu}"));
        let anchor = |(albedo, value): (&f64, &f64)| Anchor {
            what: format!("half space, ω {albedo}, emissivity, {quantity}"),
            value: *value,
            digit: half(6),
            spread: 0.0,
        };
        let unit = means(&planck(kelvin), &scene.channels);
        Setup { scene, anchors: albedo.iter().zip(values).map(anchor).collect(), direct: vec![0.0; albedo.len()], unit }
    };
    // What needs long paths is alone.
    lines.into_iter().flat_map(|line| [of_line(line, 0..3), of_line(line, 3..4)]).collect()
}

/// The number k of the eigenfunction e^(-kτ) of isotropic matter of albedo ω: (ω / 2k) ln((1 + k) / (1 - k)) = 1, by bisection.
fn decay(albedo: f64) -> f64 {
    let (mut low, mut high) = (1e-9f64, 1.0 - 1e-15);
    for _ in 0..200 {
        let k = 0.5 * (low + high);
        if albedo / (2.0 * k) * ((1.0 + k) / (1.0 - k)).ln() < 1.0 { low = k } else { high = k }
    }
    low
}

/// Deep in matter light decays as e^(-kτ), and its radiance along the cosine μ to the depth is as 1 / (1 - kμ). A layer lit from both sides by just that
/// holds just that, however thin it is, and shows it at the other side: e^(-kτ) / (1 - k) from below, 1 / (1 + k) from above.
fn deep_decay() -> Vec<Setup> {
    let albedo = [0.5, 0.8, 0.9, 0.99];
    let published = [0.957504, 0.710412, 0.525430, 0.172511];
    let k = albedo.map(decay);
    assert!(k.iter().zip(published).all(|(k, digits)| (k - digits).abs() < half(6)), "the published digits: {k:?}");
    let depth = 1.0;
    let of_side = |above: bool, range: Range<usize>| {
        let (albedo, k) = (&albedo[range.clone()], &k[range]);
        let layers: Vec<Layer> = albedo.iter().zip(k).map(|(albedo, k)| layer(*albedo, depth / k, 0.0)).collect();
        let b = with_layers(Builder::new().camera(at_cosine(1.0, above)), &layers, None);
        // From above down along μ: 1 / (1 - kμ); from below up: e^(-kτ) / (1 + kμ).
        let lit = |zenith: f64, i: usize| {
            let here = if zenith > 0.0 { 1.0 } else { (-depth).exp() };
            here / (1.0 - k[i] * zenith)
        };
        let scene = sky_of(b, lit).build();
        let shown = |k: &f64| if above { 1.0 / (1.0 + k) } else { (-depth).exp() / (1.0 - k) };
        let side = if above { "lit side" } else { "far side" };
        let anchor = |(albedo, k): (&f64, &f64)| Anchor {
            what: format!("mode of depth, ω {albedo}, k τ {depth}, {side}"),
            value: shown(k),
            digit: 0.0,
            spread: 0.0,
        };
        let anchors = albedo.iter().zip(k).map(anchor).collect();
        Setup { scene, anchors, direct: vec![0.0; k.len()], unit: vec![1.0; k.len()] }
    };
    // What needs long paths is alone.
    vec![of_side(false, 0..3), of_side(true, 0..3), of_side(false, 3..4), of_side(true, 3..4)]
}

/// What is scattered once: BRF = ω P / (4 (μ + μ₀)) (1 - e^(-τ (1/μ + 1/μ₀))), all three cosines 1.
fn once() -> Vec<Setup> {
    let lines = [(0.1, 0.0226587), (1.0, 0.1080831), (10.0, 0.125)];
    let one = |(depth, value): (f64, f64)| {
        assert!((-(-2.0 * depth).exp_m1() / 8.0 - value).abs() < half(7), "the published digits");
        let mut setup = setup("once, isotropic", &[layer(1.0, depth, 0.0)], None, Of::Brf, &[value], 7);
        setup.scene.integrator.max_bounces = 1;
        setup
    };
    lines.map(one).into()
}

/// Nothing is lost: matter that only scatters, under an even sky; and nothing gained: where it also absorbs, in a black room of one temperature.
fn furnaces() -> Vec<Setup> {
    let layers = [layer(1.0, 0.1, 0.85), layer(1.0, 1.0, 0.0), layer(1.0, 3.0, -0.5), layer(1.0, 10.0, 0.85)];
    let anchors = |what: &str, of: &[Layer]| {
        let anchor = |layer: &Layer| Anchor {
            what: format!("{what}, ω {} τ {} g {}", layer.albedo, layer.depth, layer.g),
            value: 1.0,
            digit: 0.0,
            spread: 0.0,
        };
        of.iter().map(anchor).collect::<Vec<Anchor>>()
    };
    let cold = with_layers(Builder::new().camera(at_cosine(0.5, true)), &layers, None).sky(1.0).build();
    let warm = [layer(0.5, 0.1, 0.85), layer(0.9, 1.0, 0.0), layer(0.99, 3.0, -0.5), layer(0.2, 10.0, 0.85)];
    let walls = DVec3::new(1.2 * HALF_WIDTH, 1.2 * HALF_WIDTH, 3.0);
    let kelvin = 3000.0;
    let b = with_layers(Builder::new().camera(at_cosine(0.5, true)), &warm, None);
    let mut hot = b.black(room(-walls, walls)).at_kelvin(kelvin).build();
    hot.media[0].temperature = Some(Field::Constant(kelvin));
    let unit = means(&planck(kelvin), &hot.channels);
    vec![
        Setup { scene: cold, anchors: anchors("furnace", &layers), direct: vec![0.0; 4], unit: vec![1.0; 4] },
        Setup { scene: hot, anchors: anchors("furnace of 3000 K", &warm), direct: vec![0.0; 4], unit },
    ]
}

/// Case 1 of I3RC, a cloud of steps: 0.25 km thick, columns of depth 2 and 18 that take turns every 0.25 km (all 0.5 km again), g = 0.85. 41 periods
/// wide, of which the middle one is seen: what comes from beyond the ends has gone 40 thicknesses sideways. Means over the period are of 10⁶ photons.
fn step_cloud() -> Vec<Setup> {
    const PERIODS: u32 = 41;
    let lines = [
        (1.0, true, [0.3274, 0.2610], [0.0004, 0.0006]),
        (1.0, false, [0.6727, 0.5981], [0.0004, 0.0006]),
        (0.5, true, [0.5801, 0.4762], [0.0008, 0.0006]),
        (0.5, false, [0.4199, 0.3252], [0.0008, 0.0006]),
    ];
    let one = |(mu, above, values, spread): (f64, bool, [f64; 2], [f64; 2])| {
        let (albedo, half_width) = ([1.0, 0.99], f64::from(PERIODS));
        let (channels, scattered) = by_channel(&albedo);
        let (_, absorbed) = by_channel(&albedo.map(|w| 1.0 - w));
        // One period, seen along the cosine.
        let Camera { position, forward, right, up, .. } = at_cosine(mu, above);
        let window = Projection::Orthographic { half_size: DVec2::new(mu, 1e-6) };
        let camera =
            Camera { position: position - 3.0 * forward, forward, right, up, projection: window, distortion: None };
        let mut b = Builder::new()
            .camera(camera)
            .channels(channels)
            .bounces(collisions(&[layer(1.0, 18.0, 0.85)]))
            .roulette(32);
        let phase = b.henyey_greenstein(0.85);
        let columns = grid([2 * PERIODS, 1, 1], |[x, _, _]| if x % 2 == 0 { 2.0 } else { 18.0 });
        let b = b.medium(absorbed, None, columns).scattering(scattered, phase);
        let b = b.null_box(DVec3::new(-half_width, -half_width, 0.0), DVec3::new(half_width, half_width, 1.0));
        let scene = sky_of(b, |zenith, _| if zenith > 0.0 { 1.0 } else { 0.0 }).build();
        let side = if above { "R" } else { "T" };
        let anchor = |i: usize| Anchor {
            what: format!("step cloud, ω {}, {side}({mu})", albedo[i]),
            value: values[i],
            digit: half(4),
            spread: spread[i],
        };
        Setup { scene, anchors: vec![anchor(0), anchor(1)], direct: vec![0.0; 2], unit: vec![1.0; 2] }
    };
    lines.map(one).into()
}

/// A half space of index 1.5, absorption 10 and scattering 90 per cm, isotropic, light straight down: Giovanelli 1955, as Wang, Jacques and Zheng 1995
/// have it, what the boundary itself reflects included.
fn glass() -> Vec<Setup> {
    let of = [layer(0.9, 100.0, 0.0)];
    let mut b = with_layers(Builder::new().camera(at_cosine(1.0, true)), &of, None).sky(1.0);
    let body = b.0.objects.pop().expect("a layer").shape;
    let mut scene =
        b.dielectric(body, 1.5, 0.0).filled().black(disk(-0.1 * DVec3::Z, DVec3::Z, 1.5 * HALF_WIDTH_OF_DEEP)).build();
    // Ways within, from one reflection at the boundary to the next, are bounces too.
    scene.integrator.max_bounces *= 2;
    let anchor =
        Anchor { what: "half space of index 1.5, ω 0.9, R(1)".into(), value: 0.26, digit: half(4), spread: 0.0 };
    vec![Setup { scene, anchors: vec![anchor], direct: vec![0.0], unit: vec![1.0] }]
}

fn all() -> [Vec<Setup>; 9] {
    [
        table("isotropic", &ISOTROPIC, 0.0),
        table("g 0.85", &FORWARD, 0.85),
        disort(),
        half_spaces(),
        deep_decay(),
        once(),
        furnaces(),
        step_cloud(),
        glass(),
    ]
}

/// Standard error to reach, of a number where 1 comes in.
fn resolution(value: f64) -> f64 {
    let full = match value {
        v if v >= 0.01 => 0.003 * v,
        v if v >= 0.001 => 0.01 * v,
        _ => 1e-5,
    };
    size::either(10.0, 1.0) * full
}

/// On a device without hardware of its own a dispatch costs by all paths of its wave, dead or alive: where they may be longer than fifty bounces
/// so many fewer are taken that the time is the same.
fn coarser(scene: &Scene) -> f64 {
    let bounces = f64::from(scene.integrator.max_bounces);
    if shared().is_software { (bounces / 50.0).sqrt().max(1.0) } else { 1.0 }
}

/// How many times as many samples as a pilot of error `pilot` had reach `target`; a quarter more, since pilots have errors too.
fn times(pilot: f64, target: f64) -> f64 {
    1.25 * (pilot / target).powi(2)
}

/// Of a device's pictures, one above the other: where a window is wide, each is as wide as it.
const PIXELS: u32 = 256;

/// Records of a device's path are limited. What it cuts, of depth 32 without absorption, is 1e-4 of what comes in.
const MOST_COLLISIONS: u32 = 2_048;

/// Means of channels in units of the anchors, and the errors that they were to have.
type Measured = Vec<(Estimate, f64)>;

impl Setup {
    fn in_units(&self, k: usize, e: Estimate) -> Estimate {
        Estimate { mean: (e.mean - self.direct[k]) / self.unit[k], error: e.error / self.unit[k], ..e }
    }

    /// As many epochs of pixels that are replicas of each other as it takes.
    fn by_device(&self) -> Measured {
        let coarser = coarser(&self.scene);
        let mut scene = self.scene.clone();
        (scene.film.height, scene.film.crop) = (PIXELS, [0, 0, 1, PIXELS]);
        scene.integrator.max_bounces = scene.integrator.max_bounces.min(MOST_COLLISIONS);
        let epochs = |epochs: f64, seed: u64| {
            let settings = Settings { seed, tile: [1, PIXELS], ..Settings::default() };
            let rendered = render(&scene, epochs.ceil() as u32, 64, settings);
            rendered.assert_clean();
            let estimates = rendered.replicas();
            let in_units = |(k, e)| (self.in_units(k, e), coarser * resolution(self.anchors[k].value));
            estimates.into_iter().enumerate().map(in_units).collect::<Measured>()
        };
        let pilot = size::either(1.0, 4.0);
        let needed =
            epochs(pilot, 11).iter().map(|(found, target)| times(found.error, *target)).fold(1.0 / pilot, f64::max);
        epochs(pilot * needed, 7)
    }

    fn by_reference(&self) -> Measured {
        let of_channel = |k: usize| {
            let mut scene = self.scene.clone();
            scene.channels = Channels::from_bounds(vec![scene.channels.bounds[k]], None);
            let estimate = |samples: f64, seed: u64| {
                let image = truth::render(&scene, &[[0, 0]], samples as u32, seed);
                let (mean, error) = (image.mean[0], image.standard_error[0]);
                self.in_units(k, Estimate { mean, error, freedom: samples - 1.0 })
            };
            let pilot = size::either(4_096.0, 262_144.0);
            let target = resolution(self.anchors[k].value);
            (estimate(pilot * times(estimate(pilot, 11).error, target).max(1.0), 7), target)
        };
        (0..self.anchors.len()).map(of_channel).collect()
    }
}

/// Probability that right answers fail somewhere in the suite.
const ALPHA: f64 = 0.01;
/// Where collisions happen is rounded on devices; and what paths are cut off from.
const ROUNDED: f64 = 2e-4;
const CUT: f64 = 1e-4;

/// Without `--full` devices stay away from pictures of longer paths, which take them many seconds.
const LONG: u32 = 100;

/// What measures the numbers of a setup.
type Way = fn(&Setup) -> Measured;

/// Every number, by both.
#[track_caller]
fn check(setups: impl IntoIterator<Item = Setup>) {
    let comparisons = 2 * all().iter().flatten().map(|setup| setup.anchors.len()).sum::<usize>();
    let each = -((-ALPHA).ln_1p() / comparisons as f64).exp_m1();
    let only = std::env::var("SPECTILE_ANCHORS").unwrap_or_default();
    let mut wrong = Vec::new();
    for setup in setups.into_iter().filter(|setup| setup.anchors[0].what.contains(&only)) {
        let measured: [(&str, f64, Way); 2] =
            [("device", ROUNDED + CUT, Setup::by_device), ("reference", CUT, Setup::by_reference)];
        let skipped = usize::from(!size::is_full() && setup.scene.integrator.max_bounces > LONG);
        for (by, allowance, measure) in measured.into_iter().skip(skipped) {
            for (Anchor { what, value, digit, spread }, (e, target)) in setup.anchors.iter().zip(measure(&setup)) {
                let error = e.error.hypot(*spread);
                let quantile = StudentsT::new(0.0, 1.0, e.freedom).expect("freedom").inverse_cdf(1.0 - 0.5 * each);
                let off = e.mean - value;
                println!("{by}\t{what}\t{value}\t{:.7}\t{:.2e}\t{:.2}", e.mean, e.error, off / error);
                if e.error > target || off.abs() > quantile * error + digit + allowance * value {
                    wrong.push(format!("{what}, {by}: {} ± {}, not {value}; error asked: {target}", e.mean, e.error));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
#[ignore = "minutes: tables of layers, of which images::scattering has small twins"]
fn layers() {
    check(table("isotropic", &ISOTROPIC, 0.0).into_iter().chain(table("g 0.85", &FORWARD, 0.85)));
}

#[test]
#[ignore = "minutes: half spaces, of which images::scattering has small twins"]
fn emissivity_of_half_spaces() {
    check(half_spaces());
}

#[test]
fn problems_of_disort() {
    check(size::first(1, disort()));
}

#[test]
fn the_mode_of_depth() {
    check(size::first(1, deep_decay()));
}

#[test]
fn single_scattering() {
    check(size::first(1, once()));
}

#[test]
#[ignore = "minutes: furnaces, of which images::scattering has small twins"]
fn cold_and_warm_furnaces() {
    check(furnaces());
}

#[test]
fn a_cloud_of_steps() {
    check(size::first(1, step_cloud()));
}

#[test]
fn scattering_glass() {
    check(glass());
}
