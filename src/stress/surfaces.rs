//! Roughness, indices and angles at their ends.

use super::bench::{F32, TABLES};
use super::{Bench, Case};
use crate::Result;

const GROUP: &str = "surfaces";

pub const CASES: &[Case] = &[
    Case {
        group: GROUP,
        name: "white-metal",
        what: "a metal that absorbs 4e-8, roughness 0 to 1, under a white sky: 1",
        run: white_metal,
    },
    Case {
        group: GROUP,
        name: "rough-glass",
        what: "a ball of glass, roughness 0 to 1, under a white sky, 64 bounces: 1",
        run: rough_glass,
    },
    Case {
        group: GROUP,
        name: "indices",
        what: "balls of index 0.05, 1, 1.0000001 and 100 under a white sky, until all has got out: 1",
        run: indices,
    },
    Case {
        group: GROUP,
        name: "k-200",
        what: "metal of k = 200 at normal and grazing incidence to 89.999 degrees: Fresnel's equations",
        run: large_k,
    },
    Case {
        group: GROUP,
        name: "grazing-glass",
        what: "glass at 60 to 89.999 degrees from outside: Fresnel's equations",
        run: grazing_glass,
    },
    Case {
        group: GROUP,
        name: "critical-angle",
        what: "glass from inside at the critical angle and 1e-4 degrees beside it: what Fresnel's equations let through",
        run: critical_angle,
    },
];

/// A ball under a white sky.
fn under_sky(bounces: u32, material: &str) -> String {
    format!(
        "[camera.orthographic]\nposition = [0, 0, 3]\nlook_at = [0, 0, 0]\nup = [0, 1, 0]\nwidth = 1.9\n[film]\nwidth = 16\nheight = 16\n\
         [integrator]\nmax_bounces = {bounces}\n[environment]\nradiance = 1\n{material}\n\
         [[objects]]\nsphere = {{ center = [0, 0, 0], radius = 1 }}\nmaterial = \"m\"\n"
    )
}

fn white_metal(bench: &mut Bench) -> Result<()> {
    for roughness in [0.0, 1e-6, 1e-4, 1e-3, 0.01, 0.1, 0.5, 1.0] {
        let material = format!("[materials.m.conductor]\neta = 0.01\nk = 1000\nroughness = {roughness}");
        let seen = bench.render(&under_sky(1, &material), 1024)?;
        // Tables of the energy that single scattering loses.
        bench.check(format!("roughness {roughness}"), 1.0, seen.of(0), 1e-3);
    }
    Ok(())
}

fn rough_glass(bench: &mut Bench) -> Result<()> {
    for roughness in [0.0, 1e-6, 1e-3, 0.1, 0.5, 1.0] {
        let material = format!("[materials.m.dielectric]\neta = 1.5\nroughness = {roughness}");
        let seen = bench.render(&under_sky(64, &material), 256)?;
        bench.check(format!("roughness {roughness}"), 1.0, seen.of(0), 2e-3);
    }
    Ok(())
}

fn indices(bench: &mut Bench) -> Result<()> {
    for (eta, bounces) in [("0.05", 64), ("1", 8), ("1.0000001", 8), ("100", 2048)] {
        let seen = bench.render(&under_sky(bounces, &format!("[materials.m.dielectric]\neta = {eta}")), 64)?;
        bench.check(format!("index {eta}"), 1.0, seen.of(0), TABLES);
    }
    Ok(())
}

/// Reflectance of unpolarised light at `degrees` from index 1 to n + i k (Born and Wolf), by complex arithmetic written out.
fn fresnel(degrees: f64, n: f64, k: f64) -> f64 {
    let (cosine, sine) = (degrees.to_radians().cos(), degrees.to_radians().sin());
    // u + i v = sqrt((n + i k)² - sin²).
    let (re, im) = (n * n - k * k - sine * sine, 2.0 * n * k);
    let length = re.hypot(im);
    let (u, v) = (((length + re) / 2.0).max(0.0).sqrt(), ((length - re) / 2.0).max(0.0).sqrt());
    let s = ((cosine - u).powi(2) + v * v) / ((cosine + u).powi(2) + v * v);
    let (a, b) = ((n * n - k * k) * cosine, 2.0 * n * k * cosine);
    let p = ((a - u).powi(2) + (b - v).powi(2)) / ((a + u).powi(2) + (b + v).powi(2));
    0.5 * (s + p)
}

/// A plate in the plane y = 0, seen at an angle from its normal, before a sky of 1.
fn plate(degrees: f64, material: &str, bounces: u32) -> String {
    let angle = degrees.to_radians();
    format!(
        "[camera.orthographic]\nposition = [0, {:.17e}, {:.17e}]\nlook_at = [0, 0, 0]\nup = [1, 0, 0]\nwidth = 1e-6\n\
         [integrator]\nmax_bounces = {bounces}\n[environment]\nradiance = 1\n{material}\n\
         [[objects]]\nquad = {{ corner = [-1, 0, -1], edge_u = [0, 0, 2], edge_v = [2, 0, 0] }}\nmaterial = \"m\"\n",
        angle.cos(),
        angle.sin()
    )
}

/// What gets there ends.
fn black_floor(y: f64) -> String {
    format!(
        "[materials.b.black]\n[[objects]]\nquad = {{ corner = [-1e3, {y}, -1e3], edge_u = [0, 0, 2e3], edge_v = [2e3, 0, 0] }}\nmaterial = \"b\"\n"
    )
}

fn large_k(bench: &mut Bench) -> Result<()> {
    for (n, k) in [(1.0, 200.0), (0.05, 200.0), (12.0, 50.0)] {
        for degrees in [0.0, 60.0, 89.0, 89.9, 89.999] {
            let material = format!("[materials.m.conductor]\neta = {n}\nk = {k}");
            let seen = bench.render(&plate(degrees, &material, 1), 64)?;
            // A cosine of 1.7e-5 is known to f32's 6e-8 of a unit vector: 0.4 %, of what reflection is short of 1.
            let expected = fresnel(degrees, n, k);
            let bound = F32 + 2.0 * 6e-8 / degrees.to_radians().cos().max(1e-9) * (1.0 - expected);
            bench.check_within(format!("n = {n}, k = {k}, {degrees} degrees"), expected, seen.of(0), bound);
        }
    }
    Ok(())
}

fn grazing_glass(bench: &mut Bench) -> Result<()> {
    for degrees in [60.0, 80.0, 89.0, 89.9, 89.999] {
        // What is refracted goes into black.
        let text = plate(degrees, "[materials.m.dielectric]\neta = 1.5", 2) + &black_floor(-0.1);
        let seen = bench.render(&text, 1024)?;
        let expected = fresnel(degrees, 1.5, 0.0);
        let bound = F32 + 2.0 * 6e-8 / degrees.to_radians().cos() * (1.0 - expected);
        bench.check_within(format!("{degrees} degrees"), expected, seen.of(0), bound);
    }
    Ok(())
}

fn critical_angle(bench: &mut Bench) -> Result<()> {
    let critical = (1.0f64 / 1.5).asin().to_degrees();
    for off in [-1.0, -0.01, -1e-4, 0.0, 1e-4, 0.01, 1.0] {
        // From the back of the surface, which is inside glass, with the sky on the other side.
        let angle = (critical + off).to_radians();
        let text = plate(180.0 - critical - off, "[materials.m.dielectric]\neta = 1.5", 2) + &black_floor(-2.0);
        let seen = bench.render(&text, 1024)?;
        // Radiance inside is n² times that outside (basic radiance), of which 1 - R gets in.
        let sine = 1.5 * angle.sin();
        let expected = if sine >= 1.0 { 0.0 } else { 2.25 * (1.0 - fresnel(sine.asin().to_degrees(), 1.5, 0.0)) };
        // Near the angle transmission goes as the root of the distance: an angle off by f32's 1.2e-7 is off by this.
        let near = (1.5 * angle.cos() * 2.4e-7 / (2.0 * (1.0 - sine * sine).abs().max(1e-9)).sqrt()).min(1e-3);
        bench.check_within(format!("critical angle {off:+} degrees"), expected, seen.of(0), 1e-5 + 20.0 * near);
    }
    Ok(())
}
