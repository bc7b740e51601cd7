//! Every kind of surface: sampling against densities, energy, reciprocity, closed forms.

use std::path::Path;
use std::sync::LazyLock;

use super::*;
use crate::reference::rng::Rng;
use crate::scene;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Probability that right code fails one test.
const ALPHA: f64 = 1e-4;

/// The material "m" of a scene with channels at 400-500, … 700-800 nm, in which η from "glass" falls from 1.6 to 1.5.
struct Material {
    scene: Scene,
    bsdf: Bsdf,
}

impl Material {
    fn new(text: &str) -> Self {
        let text = format!(
            "camera.perspective = {{ position = [0, 0, 5], look_at = [0, 0, 0], fov = 60 }}
            film = {{ width = 1, height = 1 }}
            channels.equal = {{ from = 400, to = 800, count = 4 }}
            spectra.glass = {{ samples = [[400, 1.6], [800, 1.5]] }}
            spectra.steep = {{ samples = [[400, 1.8], [800, 1.5]] }}
            spectra.slope = {{ samples = [[400, 0.2], [800, 0.9]] }}
            materials.white.diffuse.reflectance = 1
            materials.mirror.conductor = {{ eta = 1e-9, k = 3, roughness = 0.4 }}
            materials.ice.dielectric = {{ eta = 1.3 }}
            materials.frost.dielectric = {{ eta = \"glass\", roughness = 0.5 }}
            materials.m.{text}
            [[objects]]
            disk = {{ center = [0, 0, 0], normal = [0, 0, 1], radius = 1 }}
            material = \"m\"\n"
        );
        let scene = scene::parse(&text, Path::new("t.toml"), &[]).unwrap_or_else(|e| panic!("{e}"));
        let material = scene.materials.iter().position(|m| m.name == "m").expect("it is in use");
        Material { bsdf: Bsdf::new(&scene, material), scene }
    }

    /// What `f` makes of the material seen along `o`, all channels at their centres.
    fn seen<T>(&self, o: DVec3, inside: bool, f: impl FnOnce(&Scattering) -> T) -> T {
        let mut spectra = SpectralValues::new(&self.scene);
        spectra.begin(0.5);
        spectra.fill(self.bsdf.spectra());
        let at = Vertex { o, inside, spectra: &spectra, alive: 0..4 };
        f(&self.bsdf.at(at).expect("the material scatters"))
    }

    /// f |cosθ_i| in every channel.
    fn value(&self, o: DVec3, inside: bool, i: DVec3) -> [f64; 4] {
        let mut out = [0.0; 4];
        self.seen(o, inside, |s| s.evaluate(i, &mut out));
        out
    }

    /// What is sent out per flux along `o`, per channel; light that crosses counts by flux, `eta` beyond over before.
    /// Each lobe by itself, over points that fill a cube evenly (n/N and Roberts's two-dimensional sequence).
    fn albedo(&self, o: DVec3, inside: bool, eta: &[f64; 4], points: usize) -> [f64; 4] {
        self.seen(o, inside, |s| {
            let (mut sum, mut below) = ([0.0; 4], 0.0);
            for (_, q) in &s.parts {
                let lobe = below + 0.5 * q;
                below += q;
                for n in 0..points {
                    let (mut factor, n) = ([0.0; 4], n as f64 + 0.5);
                    let turn = (n * 0.754_877_666_246_692_7).fract();
                    let decision = (n * 0.569_840_290_998_053_2).fract();
                    if let Some(next) = s.sample([lobe, decision, n / points as f64, turn], &mut factor) {
                        for k in 0..4 {
                            let flux = if next.direction.z < 0.0 { eta[k] * eta[k] } else { 1.0 };
                            sum[k] += q * factor[k] * flux / points as f64;
                        }
                    }
                }
            }
            sum
        })
    }
}

fn direction(z: f64, azimuth: f64) -> DVec3 {
    let r = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(r * azimuth.cos(), r * azimuth.sin(), z)
}

/// Relative indices at the centres of the channels, 450, 550 … nm.
fn at_centres(eta: &str, inside: bool) -> [f64; 4] {
    let eta = |k: f64| match eta {
        "glass" => 1.6 - 0.1 * (k + 0.5) / 4.0,
        "steep" => 1.8 - 0.3 * (k + 0.5) / 4.0,
        number => number.parse().expect("a number"),
    };
    [0.0, 1.0, 2.0, 3.0].map(|k| if inside { 1.0 / eta(k) } else { eta(k) })
}

/// One of each: its text, and the index of what has an inside.
const EVERY_KIND: [(&str, Option<&str>); 14] = [
    ("diffuse.reflectance = \"slope\"", None),
    ("conductor = { eta = \"slope\", k = 3.4, roughness = 0.3 }", None),
    ("conductor = { eta = 0.2, k = 3.4, roughness = [0.15, 0.6] }", None),
    ("conductor = { eta = 1.5, k = \"slope\", roughness = 1, energy_compensation = false }", None),
    ("conductor = { eta = 0.2, k = \"steep\" }", None),
    ("dielectric = { eta = 1.5, roughness = 0.15 }", Some("1.5")),
    ("dielectric = { eta = \"glass\", roughness = 0.5 }", Some("glass")),
    ("dielectric = { eta = \"steep\", roughness = 0.3 }", Some("steep")),
    ("dielectric = { eta = \"glass\", roughness = 0.8 }", Some("glass")),
    ("dielectric = { eta = \"glass\" }", Some("glass")),
    ("plastic = { reflectance = \"slope\", eta = \"glass\", roughness = 0.2 }", None),
    ("plastic = { reflectance = 0.9, eta = 1.5 }", None),
    ("blend = { a = \"mirror\", b = \"frost\", weight = 0.6 }", Some("glass")),
    ("blend = { a = \"ice\", b = \"white\", weight = 0.3 }", Some("1.3")),
];

/// Made once: tables take their time.
static MATERIALS: LazyLock<Vec<Material>> =
    LazyLock::new(|| EVERY_KIND.iter().map(|(text, _)| Material::new(text)).collect());

/// Every kind with its text, its index and its sides.
fn every_kind() -> impl Iterator<Item = (&'static Material, &'static str, Option<&'static str>)> {
    MATERIALS.iter().zip(EVERY_KIND).map(|(material, (text, index))| (material, text, index))
}

fn sides(index: Option<&str>) -> &'static [bool] {
    if index.is_some() { &[false, true] } else { &[false] }
}

// ---- Sampling

/// Cells of a histogram over the sphere: bands of z, sectors of azimuth.
const BANDS: usize = 24;
const SECTORS: usize = 24;

/// ∫ f over [z0, z1] x [a0, a1] with the 3 x 3 Gauss rule, halved until halving changes it by less than `tolerance`.
fn integral(f: &dyn Fn(DVec3) -> f64, z: [f64; 2], a: [f64; 2], tolerance: f64, depth: u32) -> f64 {
    let gauss = |z: [f64; 2], a: [f64; 2]| {
        const NODES: [(f64, f64); 3] =
            [(-0.774_596_669_241_483_4, 5.0 / 18.0), (0.0, 4.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 18.0)];
        let at = |[from, to]: [f64; 2], x: f64| 0.5 * (from + to) + 0.5 * (to - from) * x;
        let row = |(x, w): (f64, f64)| NODES.map(|(y, v)| w * v * f(direction(at(z, x), at(a, y)))).iter().sum::<f64>();
        NODES.map(row).iter().sum::<f64>() * (z[1] - z[0]) * (a[1] - a[0])
    };
    let (zm, am) = (0.5 * (z[0] + z[1]), 0.5 * (a[0] + a[1]));
    let quarters =
        [([z[0], zm], [a[0], am]), ([z[0], zm], [am, a[1]]), ([zm, z[1]], [a[0], am]), ([zm, z[1]], [am, a[1]])];
    let fine: f64 = quarters.iter().map(|(z, a)| gauss(*z, *a)).sum();
    if depth == 0 || (fine - gauss(z, a)).abs() < tolerance {
        return fine;
    }
    quarters.iter().map(|(z, a)| integral(f, *z, *a, 0.5 * tolerance, depth - 1)).sum()
}

/// The p-value of directions of `material` against the density of `law`: chi-square over the cells, those of fewer than 10 expected
/// pooled, and one more for what is not spread (rejected, or the only direction of a mirror or of refraction).
fn goodness(material: &Material, law: &Material, o: DVec3, inside: bool, rng: &mut Rng) -> f64 {
    const SAMPLES: u32 = 40_000;
    let mut counts = vec![0u32; BANDS * SECTORS + 1];
    material.seen(o, inside, |s| {
        let mut out = [0.0; 4];
        for _ in 0..SAMPLES {
            let next = s.sample(std::array::from_fn(|_| rng.uniform()), &mut out);
            let cell = match next {
                Some(Sampled { direction: i, density: Some(density), .. }) => {
                    assert!((i.length() - 1.0).abs() < 1e-9 && density > 0.0);
                    let (z, turn) = (0.5 * (i.z + 1.0), i.y.atan2(i.x).rem_euclid(TAU) / TAU);
                    let bin = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
                    bin(z, BANDS) * SECTORS + bin(turn, SECTORS)
                }
                _ => BANDS * SECTORS,
            };
            counts[cell] += 1;
        }
    });
    law.seen(o, inside, |s| {
        let density = |i: DVec3| s.evaluate(i, &mut [0.0; 4]);
        let mut expected: Vec<f64> = (0..BANDS * SECTORS)
            .map(|cell| {
                let edge = |j: usize| 2.0 * j as f64 / BANDS as f64 - 1.0;
                let turn = |j: usize| TAU * j as f64 / SECTORS as f64;
                let (band, sector) = (cell / SECTORS, cell % SECTORS);
                integral(&density, [edge(band), edge(band + 1)], [turn(sector), turn(sector + 1)], 1e-6, 8)
            })
            .collect();
        let spread: f64 = expected.iter().sum();
        assert!(spread < 1.0 + 1e-4, "the density integrates to {spread}");
        expected.push((1.0 - spread).max(0.0));
        let (mut chi2, mut cells, mut pooled) = (0.0, 0, (0.0, 0.0));
        for (count, probability) in counts.iter().zip(&expected) {
            let (count, want) = (f64::from(*count), probability * f64::from(SAMPLES));
            if want < 10.0 {
                pooled = (pooled.0 + count, pooled.1 + want);
            } else {
                chi2 += (count - want).powi(2) / want;
                cells += 1;
            }
        }
        if pooled.1 >= 10.0 {
            chi2 += (pooled.0 - pooled.1).powi(2) / pooled.1;
            cells += 1;
        } else {
            // Too few for a square; a Poisson count this far off would be an error by itself.
            assert!(
                pooled.0 < pooled.1 + 8.0 * (pooled.1 + 1.0).sqrt(),
                "{} where {} are expected",
                pooled.0,
                pooled.1
            );
        }
        if cells < 2 { 1.0 } else { ChiSquared::new(f64::from(cells - 1)).unwrap().sf(chi2) }
    })
}

/// Directions follow the density that goes with them.
#[test]
fn directions_follow_their_density() {
    assert_directions(&[direction(0.5, 2.5), direction(0.06, 5.5)]);
}

#[test]
#[ignore = "half a minute: more directions"]
fn more_directions_follow_their_density() {
    assert_directions(&[
        direction(0.999, 0.3),
        direction(0.8, 1.0),
        direction(0.25, 4.0),
        direction(0.65, 3.1),
        direction(0.01, 0.2),
    ]);
}

/// Of every kind and side, Sidak over all.
fn assert_directions(directions: &[DVec3]) {
    let mut values = Vec::new();
    for (m, (material, text, index)) in every_kind().enumerate() {
        for &inside in sides(index) {
            for (d, &o) in directions.iter().enumerate() {
                let mut rng = Rng::from_keys(&[11, m as u64, d as u64, u64::from(inside)]);
                values.push((goodness(material, material, o, inside, &mut rng), text, inside, o));
            }
        }
    }
    let limit = -((-ALPHA).ln_1p() / values.len() as f64).exp_m1();
    let worst = values.iter().min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
    println!("{} tests, least p-value {} of {limit}", values.len(), worst.0);
    assert!(worst.0 > limit, "{worst:?}");
}

/// A roughness that is 10 % beside is found out.
#[test]
fn a_wrong_density_is_found() {
    let rough = |alpha: f64| Material::new(&format!("conductor = {{ eta = 0.2, k = 3.4, roughness = {alpha} }}"));
    let p = goodness(&rough(0.3), &rough(0.33), direction(0.6, 1.0), false, &mut Rng::from_keys(&[12]));
    assert!(p < 1e-6, "{p}");
}

// ---- Energy

/// Nothing sends out more than it gets, in any channel, from either side.
#[test]
fn energy_is_conserved() {
    for (material, text, index) in every_kind() {
        for &inside in sides(index) {
            let eta = index.map_or([1.0; 4], |index| at_centres(index, inside));
            for z in [0.02, 0.3, 0.7, 1.0] {
                let albedo = material.albedo(direction(z, 0.7), inside, &eta, 20_000);
                // The tables' error.
                assert!(albedo.iter().all(|a| *a > 0.0 && *a < 1.001), "{text}, inside {inside}, z {z}: {albedo:?}");
            }
        }
    }
}

/// A kind of surface that absorbs nothing, by its roughness, and the index of what has an inside.
type White<'a> = (&'a str, &'a dyn Fn(f64) -> String, Option<&'a str>);

/// What absorbs nothing sends out all it gets, from both sides. Prints the worst of each kind; the bound is the target of
/// 1e-3, of which the tables' own error is up to 6e-4.
fn assert_white(kinds: &[White], alphas: &[f64], points: usize) {
    for (kind, text, index) in kinds {
        let mut worst = (0.0, 0.0, 0.0, false);
        for &alpha in alphas {
            let material = Material::new(&text(alpha));
            for &inside in sides(*index) {
                let eta = index.map_or([1.0; 4], |index| at_centres(index, inside));
                for z in [0.01, 0.1, 0.35, 0.7, 0.99] {
                    let albedo = material.albedo(direction(z, 0.9), inside, &eta, points);
                    let error = albedo.iter().fold(0.0f64, |worst, a| worst.max((a - 1.0).abs()));
                    if error > worst.0 {
                        worst = (error, alpha, z, inside);
                    }
                }
            }
        }
        let (error, alpha, z, inside) = worst;
        println!("furnace, {kind}: worst {error:.1e} at roughness {alpha:.1}, cosine {z}, inside {inside}");
        assert!(error < 1e-3, "{kind}: {worst:?}");
    }
}

/// Tables are made anew for every roughness: few here.
#[test]
fn white_furnace() {
    white_surfaces(&[0.0, 0.2, 1.0]);
}

/// Roughnesses from 0 to 1.
fn tenths() -> Vec<f64> {
    (0..=10).map(|i| f64::from(i) * 0.1).collect()
}

#[test]
#[ignore = "a minute: the white furnace at every tenth of roughness"]
fn white_furnace_of_every_roughness() {
    white_surfaces(&tenths());
}

fn white_surfaces(alphas: &[f64]) {
    let kinds: [White; 5] = [
        ("diffuse", &|_| "diffuse.reflectance = 1".into(), None),
        ("conductor", &|a| format!("conductor = {{ eta = 1e-9, k = 3, roughness = {a} }}"), None),
        ("anisotropic", &|a| format!("conductor = {{ eta = 1e-9, k = 3, roughness = [{a}, {}] }}", 0.4 * a), None),
        ("dielectric 1.5", &|a| format!("dielectric = {{ eta = 1.5, roughness = {a} }}"), Some("1.5")),
        ("plastic", &|a| format!("plastic = {{ reflectance = 1, eta = 1.5, roughness = {a} }}"), None),
    ];
    assert_white(&kinds, alphas, 20_000);
    let some: [White; 2] = [
        ("dispersive", &|a| format!("dielectric = {{ eta = \"glass\", roughness = {a} }}"), Some("glass")),
        ("blend", &|a| format!("blend = {{ a = \"mirror\", b = \"frost\", weight = {a} }}"), Some("glass")),
    ];
    assert_white(&some, &[0.0, 0.3, 0.9], 20_000);
}

#[test]
#[ignore = "minutes: the white furnace at more indices"]
fn white_furnace_of_other_indices() {
    let kinds: [White; 5] = [
        ("dielectric 1.05", &|a| format!("dielectric = {{ eta = 1.05, roughness = {a} }}"), Some("1.05")),
        ("dielectric 2.4", &|a| format!("dielectric = {{ eta = 2.4, roughness = {a} }}"), Some("2.4")),
        ("dielectric 0.7", &|a| format!("dielectric = {{ eta = 0.7, roughness = {a} }}"), Some("0.7")),
        ("dispersive", &|a| format!("dielectric = {{ eta = \"glass\", roughness = {a} }}"), Some("glass")),
        ("brushed", &|a| format!("conductor = {{ eta = 1e-9, k = 3, roughness = [{a}, {}] }}", 0.1 * a), None),
    ];
    assert_white(&kinds, &tenths(), 120_000);
}

/// What single scattering alone sends back where F = 1 (docs/METHOD.md, Closed forms).
#[test]
fn published_albedos_of_single_scattering() {
    for (alpha, z, want) in
        [(0.1, 0.5, 0.969), (0.3, 0.3, 0.818), (0.5, 1.0, 0.688), (0.8, 0.1, 0.801), (1.0, 1.0, 0.306853)]
    {
        let text = format!("conductor = {{ eta = 1e-9, k = 3, roughness = {alpha}, energy_compensation = false }}");
        let albedo = Material::new(&text).albedo(direction(z, 0.2), false, &[1.0; 4], 10_000)[0];
        assert!((albedo - want).abs() < 6e-4 + 5e-4, "α {alpha}, z {z}: {albedo}, published {want}");
    }
}

/// Metals and plastics keep their colour: with loss, less than all and more than single scattering.
#[test]
fn compensation_absorbs_too() {
    let of = |compensation: bool| {
        let text =
            format!("conductor = {{ eta = 0.2, k = 3.4, roughness = 0.8, energy_compensation = {compensation} }}");
        Material::new(&text).albedo(direction(0.8, 0.0), false, &[1.0; 4], 10_000)[0]
    };
    let smooth = fresnel::conductor(1.0, 0.2, 3.4);
    assert!(of(false) < of(true) && of(true) < smooth, "{} {} {smooth}", of(false), of(true));
}

// ---- Reciprocity

/// f(o, i) = f(i, o), and across a boundary f(o, i) / n_o² = f(i, o) / n_i², for random pairs of directions. The bound is
/// rounding; where a half vector is a small difference, amplified by how small it is.
#[test]
fn reciprocity() {
    let mut rng = Rng::from_keys(&[13]);
    for (material, text, index) in every_kind() {
        let mut compared = 0;
        for &inside in sides(index) {
            let eta = index.map_or([1.0; 4], |index| at_centres(index, inside));
            for _ in 0..400 {
                let o = direction(rng.uniform().max(1e-3), TAU * rng.uniform());
                let i = direction((2.0 * rng.uniform() - 1.0).clamp(-0.999, 0.999), TAU * rng.uniform());
                if i.z.abs() < 1e-3 || (i.z < 0.0 && index.is_none()) {
                    continue;
                }
                let there = material.value(o, inside, i).map(|f| f / i.z.abs());
                let crosses = i.z < 0.0;
                // From beyond, normal and bitangent point the other way.
                let flip = |v: DVec3| if crosses { DVec3::new(v.x, -v.y, -v.z) } else { v };
                let back = material.value(flip(i), inside != crosses, flip(o)).map(|f| f / o.z);
                for k in 0..4 {
                    let there = there[k] * if crosses { eta[k] * eta[k] } else { 1.0 };
                    assert!(
                        (there - back[k]).abs() <= 1e-9 * (there + back[k]) + 1e-14,
                        "{text}, {o} {i}: {there} {}",
                        back[k]
                    );
                    compared += usize::from(there > 0.0);
                }
            }
        }
        let ideal =
            ["eta = 0.2, k = \"steep\" }", "dielectric = { eta = \"glass\" }"].iter().any(|end| text.ends_with(end));
        assert!(ideal || compared > 300, "{text}: {compared}");
    }
}

// ---- Ideal reflection and refraction

/// Mirrors and ideal refraction have their Fresnel factors in the mean over their choice, in the right direction.
#[test]
fn ideal_surfaces_are_fresnel() {
    let (z, glass) = (0.6, Material::new("dielectric = { eta = 1.5 }"));
    for (inside, eta) in [(false, 1.5f64), (true, 1.0 / 1.5)] {
        let o = direction(if inside { 0.9 } else { z }, 0.4);
        let f = fresnel::dielectric(o.z, eta);
        glass.seen(o, inside, |s| {
            let mut factor = [0.0; 4];
            let q = s.parts[0].1;
            let up = s.sample([0.5 * q, 0.0, 0.5, 0.5], &mut factor).unwrap();
            assert_eq!((up.density, up.channel), (None, None));
            assert!((up.direction - DVec3::new(-o.x, -o.y, o.z)).length() < 1e-15);
            assert!(factor.iter().all(|w| (w * q - f).abs() < 1e-14), "{factor:?}");
            let down = s.sample([q + 0.5 * (1.0 - q), 0.0, 0.5, 0.5], &mut factor).unwrap();
            // Snell, in the plane of incidence.
            assert!((down.direction.x * eta + o.x).abs() < 1e-14 && (down.direction.y * eta + o.y).abs() < 1e-14);
            assert!(down.direction.z < 0.0 && down.channel.is_none());
            assert!(factor.iter().all(|w| (w * (1.0 - q) - (1.0 - f) / (eta * eta)).abs() < 1e-14), "{factor:?}");
        });
    }
    // Beyond the critical angle all is reflected, and refraction is never chosen.
    glass.seen(direction(0.3, 0.0), true, |s| assert_eq!(s.parts[0].1, 1.0));
    // A matched index is not there.
    let air = Material::new("dielectric = { eta = 1, roughness = 0.5 }");
    let o = direction(0.4, 1.0);
    let mut factor = [0.0; 4];
    let next = air.seen(o, false, |s| s.sample([0.5; 4], &mut factor)).unwrap();
    assert!((next.direction + o).length() < 1e-15 && next.density.is_none() && factor == [1.0; 4]);
    let gold = Material::new("conductor = { eta = 0.2, k = 3.4 }");
    gold.seen(direction(0.5, 0.0), false, |s| s.sample([0.5; 4], &mut factor)).unwrap();
    assert!((factor[0] - 0.5 * (0.969688 + 0.895381)).abs() < 1e-6, "{factor:?}");
}

/// Dispersive refraction goes on in one channel with four times its weight; reflection, a constant index and a mean index
/// leave all four.
#[test]
fn degradation() {
    let o = direction(0.7, 0.0);
    let mut factor = [0.0; 4];
    let glass = Material::new("dielectric = { eta = \"glass\" }");
    let eta = at_centres("glass", false);
    for channel in 0..4 {
        let (next, q) = glass.seen(o, false, |s| {
            let next = s.sample([0.99, 0.25 * channel as f64 + 0.1, 0.5, 0.5], &mut factor).unwrap();
            (next, s.parts[1].1)
        });
        assert_eq!(next.channel, Some(channel));
        assert!((next.direction.x * eta[channel] + o.x).abs() < 1e-14);
        let passed = 1.0 - fresnel::dielectric(o.z, eta[channel]);
        for (k, factor) in factor.iter().enumerate() {
            let want = if k == channel { 4.0 * passed / eta[k].powi(2) / q } else { 0.0 };
            assert!((factor - want).abs() < 1e-14, "{k}: {factor} {want}");
        }
    }
    assert_eq!(glass.seen(o, false, |s| s.sample([0.0; 4], &mut factor)).unwrap().channel, None);
    for text in ["dielectric = { eta = 1.5 }", "dielectric = { eta = \"glass\", dispersion = false }"] {
        let next = Material::new(text).seen(o, false, |s| s.sample([0.99; 4], &mut factor)).unwrap();
        assert!(next.channel.is_none() && next.direction.z < 0.0, "{text}");
    }
    // All bend by the mean index, 1.55, and each reflects by its own.
    let mean = Material::new("dielectric = { eta = \"glass\", dispersion = false }");
    let q = mean.seen(o, false, |s| {
        let next = s.sample([0.99; 4], &mut factor).unwrap();
        assert!((next.direction.x * 1.55 + o.x).abs() < 1e-13);
        s.parts[1].1
    });
    for k in 0..4 {
        let want = (1.0 - fresnel::dielectric(o.z, eta[k])) / (1.55 * 1.55) / q;
        assert!((factor[k] - want).abs() < 1e-13, "{k}");
    }
}

/// One-sided surfaces are black from behind, two-sided ones the same; a blend's parts have their own sides.
#[test]
fn sides_of_opaque_surfaces() {
    let o = direction(0.5, 1.0);
    let i = direction(0.7, 3.0);
    for text in [
        "diffuse = { reflectance = 0.5 }",
        "conductor = { eta = 1, k = 2, roughness = 0.3 }",
        "plastic = { reflectance = 0.5, eta = 1.5 }",
    ] {
        let both = Material::new(text);
        assert_eq!(both.value(o, false, i), both.value(o, true, i), "{text}");
        let front = Material::new(&text.replace(" }", ", two_sided = false }"));
        assert_eq!(front.value(o, false, i), both.value(o, false, i));
        let spectra = SpectralValues::new(&front.scene);
        assert!(front.bsdf.at(Vertex { o, inside: true, spectra: &spectra, alive: 0..4 }).is_none(), "{text}");
    }
}

/// Lobes that matter in one channel only are chosen by half their mean and half their largest share (docs/METHOD.md,
/// Decisions).
#[test]
fn lobes_are_chosen_for_every_channel() {
    let blend = Material::new(
        "blend = { a = \"white\", b = \"red\", weight = 0.5 }\nmaterials.red.diffuse.reflectance = { samples = [[700, 0], [700, 1]], outside = \"hold\" }",
    );
    blend.seen(direction(0.5, 0.0), false, |s| {
        // Shares of b: 0, 0, 0, ½; of a: 1, 1, 1, ½.
        let q: Vec<f64> = s.parts.iter().map(|p| p.1).collect();
        let want = 0.5 * 0.875 + 0.5 * 1.0 / 1.5;
        assert!((q[0] - want).abs() < 1e-14 && (q[0] + q[1] - 1.0).abs() < 1e-14, "{q:?}");
        assert_eq!(s.survival(), 1.0);
    });
}
