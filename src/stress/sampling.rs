//! What noise is like, and that light may be followed either way.

use std::f64::consts::PI;

use super::bench::TABLES;
use super::{Bench, Case};
use crate::Result;

const GROUP: &str = "sampling";

pub const CASES: &[Case] = &[
    Case {
        group: GROUP,
        name: "reciprocity",
        what: "a lamp far away and the camera change places over 6 materials: the same BSDF",
        run: reciprocity,
    },
    Case {
        group: GROUP,
        name: "noise-slope",
        what: "the spread of 4,096 equal pixels from 1 to 256 independent samples: a slope of -1/2 ± 0.02",
        run: noise_slope,
    },
    Case {
        group: GROUP,
        name: "estimates",
        what: "16 epochs of 64 samples in 4,096 equal pixels: the error estimate within 10 % of the true error, and the truth within \
               93 to 97 % of the intervals of 95 %",
        run: estimates,
    },
];

/// Directions off a plane along z.
const DIRECTIONS: [[f64; 3]; 3] = [[0.1, 0.2, 1.0], [-0.9, 0.3, 0.7], [0.5, -1.2, 0.4]];

fn reciprocity(bench: &mut Bench) -> Result<()> {
    for (name, material) in [
        ("diffuse", "[materials.m.diffuse]\nreflectance = 0.7\n"),
        ("rough metal", "[materials.m.conductor]\neta = 0.2\nk = 3.4\nroughness = 0.4\n"),
        ("brushed metal", "[materials.m.conductor]\neta = 1.5\nk = 2\nroughness = [0.8, 0.3]\n"),
        ("varnish", "[materials.m.plastic]\nreflectance = 0.6\neta = 1.5\nroughness = 0\n"),
        ("plastic", "[materials.m.plastic]\nreflectance = 0.6\neta = 1.5\nroughness = 0.3\n"),
        (
            "blend",
            "[materials.a.diffuse]\nreflectance = 0.7\n[materials.b.conductor]\neta = 0.2\nk = 3.4\nroughness = 0.3\n\
             [materials.m.blend]\na = \"a\"\nb = \"b\"\nweight = 0.4\n",
        ),
    ] {
        for [i, j] in [[0, 1], [0, 2], [1, 2]] {
            let mut bsdf = |to: [f64; 3], from: [f64; 3]| -> Result<f64> {
                let text = format!(
                    "[camera.orthographic]\nposition = {to:?}\nlook_at = [0, 0, 0]\nup = [0, 1, 0]\nwidth = 0.001\n[film]\nwidth = 1\nheight = 1\n\
                     [integrator]\nmax_bounces = 1\n{material}[[objects]]\nquad = {{ corner = [-1, -1, 0], edge_u = [2, 0, 0], \
                     edge_v = [0, 2, 0] }}\nmaterial = \"m\"\n\
                     [[lights]]\ndirectional = {{ direction = [{:?}, {:?}, {:?}], irradiance = 1 }}\n",
                    -from[0], -from[1], -from[2]
                );
                let cosine = from[2] / from.iter().map(|v| v * v).sum::<f64>().sqrt();
                Ok(bench.render(&text, 16)?.mean[0] / cosine)
            };
            let (there, back) = (bsdf(DIRECTIONS[i], DIRECTIONS[j])?, bsdf(DIRECTIONS[j], DIRECTIONS[i])?);
            bench.check(format!("{name}, directions {i} and {j}"), there, (back, 0.0), TABLES);
        }
    }
    Ok(())
}

/// 64 x 64 pixels that all see the same point of a patch below a square lamp, and its radiance
/// (docs/METHOD.md, Closed forms).
fn patch(sampler: &str) -> (String, f64) {
    let text = format!(
        "[camera.orthographic]\nposition = [0, 0.5, 0.5]\nlook_at = [0, 0, 0]\nup = [0, 0, -1]\nwidth = 1e-6\n\
         [film]\nwidth = 64\nheight = 64\n[integrator]\nmax_bounces = 1\nsampler = \"{sampler}\"\n\
         [materials.grey.diffuse]\nreflectance = 0.5\n[materials.b.black]\n\
         [[objects]]\nquad = {{ corner = [-1, 0, 1], edge_u = [2, 0, 0], edge_v = [0, 0, -2] }}\nmaterial = \"grey\"\n\
         [[objects]]\nquad = {{ corner = [-1, 1, -1], edge_u = [2, 0, 0], edge_v = [0, 0, 2] }}\nmaterial = \"b\"\nemission = 1\n"
    );
    // Four corners of a square of side 1, one metre above.
    let root = 2f64.sqrt();
    let corner = (2.0 / root * (1.0 / root).atan()) / (2.0 * PI);
    (text, 0.5 * 4.0 * corner)
}

fn noise_slope(bench: &mut Bench) -> Result<()> {
    let (text, _) = patch("independent");
    let mut points = Vec::new();
    for samples in [1u32, 4, 16, 64, 256] {
        let seen = bench.render(&text, samples)?;
        // The standard error over pixels is a 64th of their spread.
        points.push((f64::from(samples).ln(), (64.0 * seen.error[0]).ln()));
    }
    let count = points.len() as f64;
    let [x, y] = [points.iter().map(|p| p.0).sum::<f64>() / count, points.iter().map(|p| p.1).sum::<f64>() / count];
    let squares: f64 = points.iter().map(|p| (p.0 - x).powi(2)).sum();
    let slope = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>() / squares;
    bench.check_within("slope", -0.5, (slope, 0.0), 0.02);
    Ok(())
}

fn estimates(bench: &mut Bench) -> Result<()> {
    // Student's t of 15 degrees of freedom leaves 2.5 % beyond this.
    const T15: f64 = 2.131_449_5;
    for sampler in ["sobol", "independent"] {
        let (text, truth) = patch(sampler);
        let seen = bench.render(&text, 1024)?;
        let (mut errors, mut estimates, mut covered) = (0.0, 0.0, 0.0);
        for (i, mean) in seen.image.mean.iter().enumerate() {
            let variance = seen.image.variance(i);
            errors += (mean - truth).powi(2);
            estimates += variance;
            covered += f64::from(u8::from((mean - truth).abs() <= T15 * variance.sqrt()));
        }
        let pixels = seen.image.mean.len() as f64;
        bench.check_within(
            format!("{sampler}: estimate over true error"),
            1.0,
            ((estimates / errors).sqrt(), 0.0),
            0.1,
        );
        bench.check_within(
            format!("{sampler}: share of intervals with the truth"),
            0.95,
            (covered / pixels, 0.0),
            0.02,
        );
    }
    Ok(())
}
