//! Where the renderer goes on at surfaces, against densities: chi-square.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::chi_square::{check, p_value};
use super::probe::{Chosen, SAMPLES, Scattering, bin, random};
use super::{Bench, Case};
use crate::Result;
use crate::device::prepared::Prepared;
use crate::scene::{Bsdf, Placement, Scene, Texture, TextureKind, Weight};

pub const CASES: &[Case] = &[Case {
    group: "sampling",
    name: "scattering",
    what: "directions at 15 materials, both sides, 5 directions each: chi-square against their density, and for bare facets against \
           Heitz's",
    run: scattering,
}];

/// Cells of a histogram over the sphere: bands of the angle to the normal, sectors of azimuth.
const BANDS: usize = 24;
const SECTORS: usize = 24;
/// In each cell, along both angles: stretches with four points of Gauss and Legendre each.
const STRETCHES: usize = 6;

fn direction(z: f64, azimuth: f64) -> DVec3 {
    let r = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(r * azimuth.cos(), r * azimuth.sin(), z)
}

/// Directions in every cell in turn, and what each stands for in solid angle.
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
                let (angle, turn) = (i.x.hypot(i.y).atan2(i.z) / PI, i.y.atan2(i.x).rem_euclid(TAU) / TAU);
                bin(angle, BANDS) * SECTORS + bin(turn, SECTORS)
            }
            Chosen::Only(_) | Chosen::Nothing => BANDS * SECTORS,
        };
        counts[cell] += 1.0;
    }
    counts
}

/// Expected counts per cell of a density at the points; the last is for what is not spread. And the density's integral.
fn expected(density: &[f64], points: &[(DVec3, f64)]) -> (Vec<f64>, f64) {
    let per_cell = points.len() / (BANDS * SECTORS);
    let cells = density.chunks(per_cell).zip(points.chunks(per_cell));
    let mut shares: Vec<f64> =
        cells.map(|(density, points)| density.iter().zip(points).map(|(d, (_, area))| d * area).sum()).collect();
    let spread: f64 = shares.iter().sum();
    shares.push((1.0 - spread).max(0.0));
    (shares.iter().map(|share| share * f64::from(SAMPLES)).collect(), spread)
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

struct Material {
    name: &'static str,
    /// The material "m", and others that it needs.
    text: &'static str,
    has_inside: bool,
    /// Of facets that scatter once and alone: their roughness.
    facets: Option<[f64; 2]>,
}

const fn opaque(name: &'static str, text: &'static str) -> Material {
    Material { name, text, has_inside: false, facets: None }
}

const fn clear(name: &'static str, text: &'static str) -> Material {
    Material { name, text, has_inside: true, facets: None }
}

const fn facets(name: &'static str, text: &'static str, roughness: [f64; 2]) -> Material {
    Material { name, text, has_inside: false, facets: Some(roughness) }
}

/// GLASS stands for an index that falls over the channels.
const MATERIALS: [Material; 15] = [
    facets(
        "facets",
        "[materials.m.conductor]\neta = 0.2\nk = 3.4\nroughness = 0.3\nenergy_compensation = false\n",
        [0.3, 0.3],
    ),
    facets(
        "facets of roughness 1",
        "[materials.m.conductor]\neta = 0.2\nk = 3.4\nroughness = 1\nenergy_compensation = false\n",
        [1.0, 1.0],
    ),
    facets(
        "brushed facets",
        "[materials.m.conductor]\neta = 0.2\nk = 3.4\nroughness = [0.15, 0.6]\nenergy_compensation = false\n",
        [0.15, 0.6],
    ),
    opaque("diffuse", "[materials.m.diffuse]\nreflectance = { samples = [[400, 0.8], [700, 0.75]] }\n"),
    opaque("metal", "[materials.m.conductor]\neta = 0.2\nk = 3.4\nroughness = 0.7\n"),
    opaque("brushed metal", "[materials.m.conductor]\neta = 1.5\nk = 2\nroughness = [0.8, 0.3]\n"),
    clear("rough glass", "[materials.m.dielectric]\neta = 1.5\nroughness = 0.2\n"),
    clear("rough glass that spreads", "[materials.m.dielectric]\neta = GLASS\nroughness = 0.5\n"),
    clear("hardly rough glass that disperses", "[materials.m.dielectric]\neta = GLASS\nroughness = 0.15\n"),
    opaque("varnish", "[materials.m.plastic]\nreflectance = 0.9\neta = 1.5\nroughness = 0\n"),
    opaque("plastic", "[materials.m.plastic]\nreflectance = 0.6\neta = GLASS\nroughness = 0.2\n"),
    clear(
        "blend",
        "[materials.a.conductor]\neta = 0.2\nk = 3.4\nroughness = 0.4\n[materials.b.dielectric]\neta = 1.5\nroughness = 0.3\n\
         [materials.m.blend]\na = \"a\"\nb = \"b\"\nweight = 0.6\n",
    ),
    opaque(
        "masked blend",
        "[materials.a.diffuse]\nreflectance = 0.8\n[materials.b.conductor]\neta = 0.2\nk = 3.4\nroughness = [0.3, 0.15]\n\
         [materials.m.blend]\na = \"a\"\nb = \"b\"\nweight = 0.5\n",
    ),
    // By the mean of their techniques, each of which is one of the random numbers'.
    clear(
        "rough glass by techniques",
        "[materials.m.dielectric]\neta = { samples = [[400, 1.9], [700, 1.4]] }\nroughness = 0.25\n",
    ),
    opaque(
        "masked blend by techniques",
        "[integrator]\ntechniques = 3\n[materials.a.diffuse]\nreflectance = { samples = [[400, 0.9], [700, 0]] }\n\
         [materials.b.conductor]\neta = 0.2\nk = { samples = [[400, 0.1], [700, 4]] }\nroughness = 0.3\n\
         [materials.m.blend]\na = \"a\"\nb = \"b\"\nweight = 0.5\n",
    ),
];

/// A ball of the material, which comes first in the scene. A lamp without a surface makes any scene a general one.
fn ball(bench: &Bench, material: &Material) -> Result<Scene> {
    let text = format!(
        "[channels]\nequal = {{ from = 400, to = 700, count = 4 }}\n{}[[objects]]\nsphere = {{ center = [0, 0, 0], radius = 1 }}\n\
         material = \"m\"\n[[lights]]\npoint = {{ position = [0, 0, 5], intensity = 1 }}\n",
        material.text.replace("GLASS", "{ samples = [[400, 1.6], [700, 1.5]] }")
    );
    let mut scene = bench.scene(&text)?;
    // Blends come after their parts.
    let last = scene.materials.len() - 1;
    scene.materials.swap(0, last);
    let swapped = |id: usize| if id == 0 { last } else { id % last.max(1) };
    scene.objects.iter_mut().for_each(|object| object.material = object.material.map(swapped));
    if let Bsdf::Blend { a, b, weight } = &mut scene.materials[0].bsdf {
        (*a, *b) = (swapped(*a), swapped(*b));
        if material.name.starts_with("masked") {
            let (size, texels) = ([2, 2], [0.2, 0.9, 0.4, 0.6]);
            scene.textures.push(Texture {
                name: "mask".into(),
                size,
                kind: TextureKind::Number,
                texels: texels.into(),
                placement: Placement::default(),
            });
            *weight = Weight::Texture(0);
        }
    }
    Ok(scene)
}

fn scattering(bench: &mut Bench) -> Result<()> {
    let points = points();
    let at: Vec<DVec3> = points.iter().map(|(direction, _)| *direction).collect();
    let from =
        [direction(0.999, 0.3), direction(0.8, 1.0), direction(0.5, 2.5), direction(0.25, 4.0), direction(0.06, 5.5)];
    let sides = |material: &Material| if material.has_inside { &[false, true][..] } else { &[false] };
    let of_material = |m: &Material| from.len() * (sides(m).len() + usize::from(m.facets.is_some()));
    let tests: usize = MATERIALS.iter().map(of_material).sum();
    for (m, material) in MATERIALS.iter().enumerate() {
        let prepared = Prepared::new(&ball(bench, material)?, 0)?;
        let kernel = Scattering::new(&bench.machine().gpu, &prepared)?;
        let (mut least, mut most, mut own) = (1.0f64, 0.0f64, 1.0f64);
        for &behind in sides(material) {
            for (d, &o) in from.iter().enumerate() {
                let chosen =
                    kernel.choose(o, behind, &random(SAMPLES, (100 * m + 10 * d + usize::from(behind)) as u32))?;
                let counts = histogram(&chosen);
                let (want, spread) = expected(&kernel.densities(o, behind, &at)?, &points);
                least = least.min(p_value(&counts, &want));
                most = most.max(spread);
                if let Some(roughness) = material.facets {
                    let density: Vec<f64> = at.iter().map(|i| ggx_reflection(roughness, o, *i)).collect();
                    own = own.min(p_value(&counts, &expected(&density, &points).0));
                }
            }
        }
        let name = material.name;
        check(bench, name.to_owned(), least, tests);
        if material.facets.is_some() {
            check(bench, format!("{name}, against Heitz's density in f64"), own, tests);
        }
        // What Gauss's points make of a peak; what is missing to 1 goes on in one direction, or not at all.
        bench.check_within(
            format!("{name}: what the density integrates to beyond 1"),
            0.0,
            ((most - 1.0).max(0.0), 0.0),
            1e-3,
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A roughness that is a tenth beside is found out.
    #[test]
    fn a_wrong_density_is_found() {
        let points = points();
        let o = direction(0.5, 2.5);
        let of = |roughness: f64| -> Vec<f64> {
            let density: Vec<f64> = points.iter().map(|(i, _)| ggx_reflection([roughness; 2], o, *i)).collect();
            expected(&density, &points).0
        };
        let counts: Vec<f64> = of(0.3).iter().map(|count| count.round()).collect();
        assert!(p_value(&counts, &of(0.3)) > 0.999);
        assert!(p_value(&counts, &of(0.33)) < 1e-9);
    }
}
