//! Dynamic range, optical depth and accumulation.

use super::bench::{F32, TABLES, WALL, lamp};
use super::{Bench, Case};
use crate::Result;
use crate::cube::{epoch_samples, merge_means};
use crate::device::rng::hash;
use crate::spectral::planck;

pub const CASES: &[Case] = &[
    Case {
        group: "dynamic range",
        name: "planck",
        what: "a black wall from 3 K to 50,000 K, 380 to 20,000 nm: Planck's law at every wavelength, 0 where f32 has nothing smaller",
        run: black_walls,
    },
    Case {
        group: "dynamic range",
        name: "sun-and-night",
        what: "6e7 beside 1e-12 in one picture: both to the last bits",
        run: sun_and_night,
    },
    Case {
        group: "dynamic range",
        name: "units",
        what: "radiance of 1e-30 and 1e30, seen and reflected: as it is, and half of it",
        run: units,
    },
    Case {
        group: "optical depth",
        name: "depths",
        what: "1e-9 to 1e6 in one spectrum of one hot medium: (1 - exp(-τ)) B",
        run: depths,
    },
    Case {
        group: "optical depth",
        name: "shadow",
        what: "a lamp behind a cold medium of depth 1e-9 to 1e6: exp(-τ)",
        run: shadow,
    },
    Case {
        group: "optical depth",
        name: "plume-and-mirror",
        what: "hot gas of depth 1e-6 in front of a mirror: (1 - exp(-τ)) (1 + R exp(-τ)) B",
        run: plume_and_mirror,
    },
    Case {
        group: "accumulation",
        name: "constant",
        what: "a visible constant after 1 to 1,600 samples: exact to the last bit",
        run: constant,
    },
    Case {
        group: "accumulation",
        name: "million",
        what: "1e6 samples merged in epochs of 64 into means of f32: a constant to the last bit, a sequence whose mean is known but for the roundings",
        run: million,
    },
];

const NM: [f64; 12] =
    [380.0, 450.0, 550.0, 700.0, 1000.0, 1500.0, 2500.0, 4000.0, 6000.0, 10_000.0, 15_000.0, 19_999.0];

fn black_walls(bench: &mut Bench) -> Result<()> {
    let channels: Vec<String> = NM.iter().map(|nm| format!("[{nm}, {}]", nm + 0.01)).collect();
    for kelvin in [3.0, 30.0, 220.0, 300.0, 900.0, 5778.0, 50_000.0] {
        let text = format!(
            "[channels]\nintervals = [{}]\n[integrator]\nmax_bounces = 0\n[materials.wall.black]\ntemperature = {kelvin}\n\
             [[objects]]\n{WALL}material = \"wall\"\n",
            channels.join(", ")
        );
        let seen = bench.render(&text, 64)?;
        for (k, nm) in NM.iter().enumerate() {
            let expected = planck::radiance(nm + 0.005, kelvin);
            // Below the least normal number of f32 a few bits are left, or none.
            let bound = (2e-5 * expected).max(f64::from(f32::MIN_POSITIVE));
            bench.check_within(format!("{kelvin} K, {nm} nm"), expected, seen.of(k), bound);
        }
    }
    Ok(())
}

fn sun_and_night(bench: &mut Bench) -> Result<()> {
    let text = "[camera.orthographic]\nposition = [0, 0, 1]\nlook_at = [0, 0, 0]\nup = [0, 1, 0]\nwidth = 2\n\
                [integrator]\nmax_bounces = 0\n[materials.black.black]\n\
                [[objects]]\nquad = { corner = [-1, -1, 0], edge_u = [1, 0, 0], edge_v = [0, 2, 0] }\nmaterial = \"black\"\nemission = 6e7\n\
                [[objects]]\nquad = { corner = [0, -1, 0], edge_u = [1, 0, 0], edge_v = [0, 2, 0] }\nmaterial = \"black\"\nemission = 1e-12\n";
    let seen = bench.render(text, 1024)?;
    for (i, value) in seen.image.mean.iter().enumerate() {
        let expected = if i % 8 < 4 { f64::from(6e7f32) } else { f64::from(1e-12f32) };
        bench.check_within(format!("pixel {}, {}", i % 8, i / 8), expected, (*value, 0.0), 0.0);
    }
    Ok(())
}

fn units(bench: &mut Bench) -> Result<()> {
    for radiance in [1e-30, 1e30] {
        let text = format!(
            "[integrator]\nmax_bounces = 1\n[materials.grey.diffuse]\nreflectance = 0.5\n[environment]\nradiance = {radiance:e}\n\
             [[objects]]\n{WALL}material = \"grey\"\n"
        );
        let seen = bench.render(&text, 256)?;
        bench.check(format!("{radiance:e}, from a wall of 0.5"), 0.5 * radiance, seen.of(0), F32);
        let text = format!("[environment]\nradiance = {radiance:e}\n");
        let seen = bench.render(&text, 64)?;
        bench.check_within(format!("{radiance:e}, seen"), f64::from(radiance as f32), seen.of(0), 0.0);
    }
    Ok(())
}

const DEPTHS: [f64; 16] = [1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 0.5, 1.0, 3.0, 10.0, 1e2, 1e4, 1e6];

/// An absorption that has `DEPTHS[k]` over a metre in channel k, 4000 + 10 k to + 0.1 nm, and those channels.
fn stepped() -> (String, String) {
    let at = |k: usize| 4000.0 + 10.0 * k as f64;
    let nodes: Vec<String> =
        (0..16).flat_map(|k| [-1.0, 1.0].map(|off| format!("[{}, {:e}]", at(k) + off, DEPTHS[k]))).collect();
    let channels: Vec<String> = (0..16).map(|k| format!("[{}, {}]", at(k), at(k) + 0.1)).collect();
    (format!("{{ samples = [{}] }}", nodes.join(", ")), format!("[channels]\nintervals = [{}]\n", channels.join(", ")))
}

fn depths(bench: &mut Bench) -> Result<()> {
    let (absorption, channels) = stepped();
    let text = format!(
        "{channels}[integrator]\nmax_bounces = 0\n[media.gas]\nabsorption = {absorption}\ntemperature = 1000\n\
         [[objects]]\ncube = {{ min = [-1, -1, -1], max = [1, 1, 0] }}\ninterior = \"gas\"\n"
    );
    let seen = bench.render(&text, 256)?;
    for (k, depth) in DEPTHS.iter().enumerate() {
        let expected = -(-depth).exp_m1() * planck::radiance(4000.05 + 10.0 * k as f64, 1000.0);
        bench.check(format!("τ = {depth:e}"), expected, seen.of(k), TABLES);
    }
    Ok(())
}

fn shadow(bench: &mut Bench) -> Result<()> {
    let (absorption, channels) = stepped();
    let text = format!(
        "{channels}[integrator]\nmax_bounces = 0\n[environment]\nradiance = 1\n[media.gas]\nabsorption = {absorption}\n\
         [[objects]]\ncube = {{ min = [-1, -1, -1], max = [1, 1, 0] }}\ninterior = \"gas\"\n"
    );
    let seen = bench.render(&text, 256)?;
    for (k, depth) in DEPTHS.iter().enumerate() {
        // An absorption off by 1e-4 of itself is a depth off by as much.
        let bound = ((TABLES * depth).exp_m1() + F32) * (-depth).exp();
        bench.check_within(
            format!("τ = {depth:e}"),
            (-depth).exp(),
            seen.of(k),
            bound.max(f64::from(f32::MIN_POSITIVE)),
        );
    }
    Ok(())
}

fn plume_and_mirror(bench: &mut Bench) -> Result<()> {
    let text = format!(
        "[channels]\nintervals = [[4000, 4000.1]]\n[integrator]\nmax_bounces = 2\n[media.gas]\nabsorption = 1e-5\ntemperature = 1000\n\
         [materials.metal.conductor]\neta = 0.2\nk = 3.4\n[[objects]]\n{WALL}material = \"metal\"\n\
         [[objects]]\ncube = {{ min = [-0.5, -0.5, 0.1], max = [0.5, 0.5, 0.2] }}\ninterior = \"gas\"\n"
    );
    let seen = bench.render(&text, 256)?;
    // ((n - 1)² + k²) / ((n + 1)² + k²), a metal at normal incidence.
    let (reflected, through) = ((0.64 + 11.56) / (1.44 + 11.56), (-1e-6f64).exp());
    let expected = (1.0 - through) * (1.0 + reflected * through) * planck::radiance(4000.05, 1000.0);
    bench.check("at normal incidence", expected, seen.of(0), TABLES);
    Ok(())
}

fn constant(bench: &mut Bench) -> Result<()> {
    for samples in [1, 2, 32, 64, 128, 1600] {
        let seen = bench.render(&lamp("0.1"), samples)?;
        let wrong = seen.image.mean.iter().filter(|v| **v != f64::from(0.1f32)).count();
        bench.check_within(format!("pixels that are not 0.1 after {samples}"), 0.0, (wrong as f64, 0.0), 0.0);
    }
    Ok(())
}

fn million(bench: &mut Bench) -> Result<()> {
    const EPOCH: u32 = 64;
    // The first value is 0.1 for ever, the others are anything in [1/2, 1).
    const VALUES: u32 = 256;
    let unit = |epoch: u32| -> Vec<f32> {
        let random = |i: u32| 0.5 + (hash(VALUES * epoch + i) >> 9) as f32 / 16_777_216.0;
        (0..VALUES).map(|i| if i == 0 { 0.1 } else { random(i) }).collect()
    };
    let (mut mean, mut sums) = (unit(0), vec![0.0; VALUES as usize]);
    let (mut samples, mut merges) = (0, 0u32);
    while samples < 1_000_000 {
        let (new, count) = (unit(merges), epoch_samples(merges, EPOCH));
        for (sum, value) in sums.iter_mut().zip(&new) {
            *sum += f64::from(count) * f64::from(*value);
        }
        merge_means(&mut mean, samples, &new, count);
        (samples, merges) = (samples + count, merges + 1);
    }
    bench.check_within("a constant", f64::from(0.1f32), (f64::from(mean[0]), 0.0), 0.0);
    let error = |i: usize| f64::from(mean[i]) - sums[i] / f64::from(samples);
    // Merge j of n rounds to 2^-24, evenly, and its rounding is worth j / n at the end: in all sqrt(n / 3) times 2^-24 / sqrt(12).
    let rounding = 2f64.powi(-24) / 12f64.sqrt() * (f64::from(merges) / 3.0).sqrt();
    let others = f64::from(VALUES - 1);
    let square = (1..VALUES as usize).map(|i| error(i).powi(2)).sum::<f64>() / others;
    let mean_error = (1..VALUES as usize).map(error).sum::<f64>() / others;
    bench.check_within("roundings of a sequence, mean", 0.0, (mean_error, rounding / others.sqrt()), 0.0);
    // The square of a normal number scatters by sqrt(2) of its mean.
    let relative = square / (rounding * rounding);
    bench.check_within("their square over what it should be", 1.0, (relative, (2.0 / others).sqrt()), 0.1);
    Ok(())
}
