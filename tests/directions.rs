//! The directions in which the shader scatters against their densities, the shader's own and, for metals, one written here:
//! chi-square, five directions of every kind of material and side, Sidak over all.

mod chooser;
mod scene_builder;

use std::f64::consts::{PI, TAU};

use chooser::{Chooser, Chosen};
use glam::DVec3;
use scene_builder::surfaces::glass_curve;
use scene_builder::*;
use spectile::render::prepare::Prepared;
use spectile::render::rng::hash;
use spectile::scene::TextureKind;
use spectile::spectral::Channels;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Probability that right code fails.
const ALPHA: f64 = 1e-4;
const SAMPLES: u32 = 60_000;
/// Cells of a histogram over the sphere: bands of the angle to the normal, sectors of azimuth.
const BANDS: usize = 24;
const SECTORS: usize = 24;
/// In each cell, along both angles: stretches with four points of Gauss and Legendre each.
const STRETCHES: usize = 6;

fn direction(z: f64, azimuth: f64) -> DVec3 {
    let r = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(r * azimuth.cos(), r * azimuth.sin(), z)
}

/// Points of every cell in turn, and what each stands for in solid angle.
fn points() -> Vec<(DVec3, f64)> {
    const GAUSS: [(f64, f64); 4] = [
        (0.069_431_844_202_973_71, 0.173_927_422_568_726_9),
        (0.330_009_478_207_571_87, 0.326_072_577_431_273_1),
        (0.669_990_521_792_428_1, 0.326_072_577_431_273_1),
        (0.930_568_155_797_026_3, 0.173_927_422_568_726_9),
    ];
    let row: Vec<(f64, f64)> = (0..STRETCHES)
        .flat_map(|i| GAUSS.map(|(x, w)| ((i as f64 + x) / STRETCHES as f64, w / STRETCHES as f64)))
        .collect();
    let mut points = Vec::new();
    for cell in 0..BANDS * SECTORS {
        let (band, sector) = ((cell / SECTORS) as f64, (cell % SECTORS) as f64);
        for (x, wx) in &row {
            for (y, wy) in &row {
                let (angle, turn) = (PI * (band + x) / BANDS as f64, TAU * (sector + y) / SECTORS as f64);
                let area = wx * wy * PI / BANDS as f64 * TAU / SECTORS as f64 * angle.sin();
                points.push((direction(angle.cos(), turn), area));
            }
        }
    }
    points
}

/// Counts per cell; the last is for what is not spread.
fn histogram(chosen: &[Chosen]) -> Vec<f64> {
    let mut counts = vec![0.0; BANDS * SECTORS + 1];
    for choice in chosen {
        let cell = match choice {
            Chosen::Spread(i) => {
                assert!((i.length() - 1.0).abs() < 1e-5, "{i}");
                let (angle, turn) = (i.x.hypot(i.y).atan2(i.z) / PI, i.y.atan2(i.x).rem_euclid(TAU) / TAU);
                let bin = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
                bin(angle, BANDS) * SECTORS + bin(turn, SECTORS)
            }
            Chosen::Only(_) | Chosen::Nothing => BANDS * SECTORS,
        };
        counts[cell] += 1.0;
    }
    counts
}

/// The p-value of counts against a density at the points; cells of fewer than 10 expected in one.
fn p_value(what: &str, counts: &[f64], density: &[f64], points: &[(DVec3, f64)]) -> f64 {
    let per_cell = points.len() / (BANDS * SECTORS);
    let cells = density.chunks(per_cell).zip(points.chunks(per_cell));
    let mut expected: Vec<f64> =
        cells.map(|(density, points)| density.iter().zip(points).map(|(d, (_, area))| d * area).sum()).collect();
    let spread: f64 = expected.iter().sum();
    assert!(spread < 1.0 + 1e-3, "{what}: the density integrates to {spread}");
    expected.push((1.0 - spread).max(0.0));
    let (mut chi2, mut cells, mut few) = (0.0, 0, [0.0; 2]);
    for (count, probability) in counts.iter().zip(&expected) {
        let want = probability * f64::from(SAMPLES);
        if want < 10.0 {
            few = [few[0] + count, few[1] + want];
        } else {
            chi2 += (count - want).powi(2) / want;
            cells += 1;
        }
    }
    if few[1] >= 10.0 {
        chi2 += (few[0] - few[1]).powi(2) / few[1];
        cells += 1;
    } else {
        // Too few for a square; a Poisson count this far off would be an error by itself.
        assert!(few[0] < few[1] + 8.0 * (few[1] + 1.0).sqrt(), "{what}: {} where {} are expected", few[0], few[1]);
    }
    if cells < 2 { 1.0 } else { ChiSquared::new(f64::from(cells - 1)).unwrap().sf(chi2) }
}

/// Four random numbers of 24 bits each.
fn random(seed: u32) -> Vec<[f32; 4]> {
    let number = |i: u32| (hash(hash(seed) ^ i) >> 8) as f32 / 16_777_216.0;
    (0..SAMPLES).map(|i| [0, 1, 2, 3].map(|j| number(4 * i + j))).collect()
}

/// Density of reflection by visible GGX facets (Heitz 2018): G1(o) D(h) / (4 cos o), as tan² of the slopes says it.
fn ggx_reflection([ax, ay]: [f64; 2], o: DVec3, i: DVec3) -> f64 {
    if i.z <= 0.0 {
        return 0.0;
    }
    let h = (o + i).normalize();
    let tan2 = (h.x / (ax * h.z)).powi(2) + (h.y / (ay * h.z)).powi(2);
    let distribution = 1.0 / (PI * ax * ay * h.z.powi(4) * (1.0 + tan2).powi(2));
    let stretched = ((ax * o.x).powi(2) + (ay * o.y).powi(2)) / (o.z * o.z);
    let seen = 2.0 / (1.0 + (1.0 + stretched).sqrt());
    seen * distribution / (4.0 * o.z)
}

/// A scene whose first material is looked at.
type Add = fn(Builder) -> Builder;

fn single(mut b: Builder, alpha: [f64; 2]) -> Builder {
    b = b.conductor(sphere(DVec3::ZERO, 1.0), 0.2, 3.4, alpha);
    let Some(spectile::scene::Bsdf::Conductor { energy_compensation, .. }) =
        b.0.materials.last_mut().map(|m| &mut m.bsdf)
    else {
        unreachable!()
    };
    *energy_compensation = false;
    b
}

/// A blend is the last material and comes first.
fn blend_first(mut b: Builder) -> Builder {
    let last = b.0.materials.len() - 1;
    b.0.materials.swap(0, last);
    let swapped = |id: usize| {
        if id == 0 {
            last
        } else if id == last {
            0
        } else {
            id
        }
    };
    b.0.objects.iter_mut().for_each(|object| object.material = object.material.map(swapped));
    if let spectile::scene::Bsdf::Blend { a, b, .. } = &mut b.0.materials[0].bsdf {
        (*a, *b) = (swapped(*a), swapped(*b));
    }
    b
}

/// Name, what it is, whether it has an inside, and for facets alone their roughness.
const MATERIALS: [(&str, Add, bool, Option<[f64; 2]>); 13] = [
    ("facets", |b| single(b, [0.3; 2]), false, Some([0.3; 2])),
    ("facets of roughness 1", |b| single(b, [1.0; 2]), false, Some([1.0; 2])),
    ("brushed facets", |b| single(b, [0.15, 0.6]), false, Some([0.15, 0.6])),
    ("diffuse", |b| b.diffuse(sphere(DVec3::ZERO, 1.0), glass_curve().scaled(0.5)), false, None),
    ("metal", |b| b.conductor(sphere(DVec3::ZERO, 1.0), 0.2, 3.4, [0.7; 2]), false, None),
    ("brushed metal", |b| b.conductor(sphere(DVec3::ZERO, 1.0), 1.5, 2.0, [0.8, 0.3]), false, None),
    ("rough glass", |b| b.dielectric(sphere(DVec3::ZERO, 1.0), 1.5, 0.2), true, None),
    ("rough glass that spreads", |b| b.dielectric(sphere(DVec3::ZERO, 1.0), glass_curve(), 0.5), true, None),
    ("hardly rough glass that disperses", |b| b.dielectric(sphere(DVec3::ZERO, 1.0), glass_curve(), 0.15), true, None),
    ("varnish", |b| b.plastic(sphere(DVec3::ZERO, 1.0), 0.9, 1.5, 0.0), false, None),
    ("plastic", |b| b.plastic(sphere(DVec3::ZERO, 1.0), 0.6, glass_curve(), 0.2), false, None),
    (
        "blend",
        |b| {
            let s = || sphere(DVec3::ZERO, 1.0);
            blend_first(b.conductor(s(), 0.2, 3.4, [0.4; 2]).dielectric(s(), 1.5, 0.3).blend_of_last_two(s(), 0.6))
        },
        true,
        None,
    ),
    (
        "masked blend",
        |mut b| {
            let s = || sphere(DVec3::ZERO, 1.0);
            let mask = b.texture([2, 2], &[0.2, 0.9, 0.4, 0.6], TextureKind::Number);
            blend_first(b.diffuse(s(), 0.8).conductor(s(), 0.2, 3.4, [0.3, 0.15]).masked_last_two(s(), mask))
        },
        false,
        None,
    ),
];

fn directions() -> [DVec3; 5] {
    [direction(0.999, 0.3), direction(0.8, 1.0), direction(0.5, 2.5), direction(0.25, 4.0), direction(0.06, 5.5)]
}

fn prepared(add: Add) -> Prepared {
    // A lamp without a surface makes even a diffuse scene a general one.
    let base = Builder::new().channels(Channels::equal(400.0, 700.0, 4)).point(5.0 * DVec3::Z, 1.0);
    Prepared::new(&add(base).build(), 0).expect("a scene that fits")
}

#[test]
fn directions_follow_their_density() {
    let points = points();
    let at: Vec<DVec3> = points.iter().map(|(direction, _)| *direction).collect();
    let mut values = Vec::new();
    for (m, (name, add, inside, facets)) in MATERIALS.into_iter().enumerate() {
        let chooser = Chooser::new(&prepared(add));
        for behind in [false, true].into_iter().take(if inside { 2 } else { 1 }) {
            for (d, o) in directions().into_iter().enumerate() {
                let what = format!("{name}, behind {behind}, o {o}");
                let chosen = chooser.choose(o, behind, &random((100 * m + 10 * d + usize::from(behind)) as u32));
                let counts = histogram(&chosen);
                values.push((p_value(&what, &counts, &chooser.densities(o, behind, &at), &points), what.clone()));
                if let Some(alpha) = facets {
                    let density: Vec<f64> = at.iter().map(|i| ggx_reflection(alpha, o, *i)).collect();
                    values.push((p_value(&what, &counts, &density, &points), format!("{what}, in f64")));
                }
            }
        }
    }
    let limit = -((-ALPHA).ln_1p() / values.len() as f64).exp_m1();
    let worst = values.iter().min_by(|a, b| a.0.total_cmp(&b.0)).expect("some values");
    println!("{} tests, least p-value {} of {limit}", values.len(), worst.0);
    assert!(worst.0 > limit, "{worst:?}");
}

/// A roughness that is a tenth beside is found out.
#[test]
fn a_wrong_density_is_found() {
    let points = points();
    let chooser = Chooser::new(&prepared(|b| single(b, [0.3; 2])));
    let o = directions()[2];
    let counts = histogram(&chooser.choose(o, false, &random(1)));
    let density: Vec<f64> = points.iter().map(|(i, _)| ggx_reflection([0.33; 2], o, *i)).collect();
    let p = p_value("10 % rougher", &counts, &density, &points);
    assert!(p < 1e-9, "{p}");
}
