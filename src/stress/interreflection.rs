//! Light that goes to and fro many times.

use super::bench::TABLES;
use super::{Bench, Case};
use crate::Result;
use crate::spectral::planck;

const GROUP: &str = "interreflection";

pub const CASES: &[Case] = &[
    Case {
        group: GROUP,
        name: "cavity",
        what: "inside a glowing sphere that reflects 0.5 to 0.999999, 8 to 256 bounces: (1 - ρ^(n+1)) / (1 - ρ)",
        run: cavity,
    },
    Case {
        group: GROUP,
        name: "mirrors",
        what: "between two hot mirrors, 1 to 256 bounces: (1 - R^(n+1)) B",
        run: mirrors,
    },
];

fn cavity(bench: &mut Bench) -> Result<()> {
    for bounces in [8, 64, 256] {
        for rho in [0.5, 0.9, 0.99, 0.9999, 0.999999] {
            let text = format!(
                "[camera.perspective]\nposition = [0.1, 0.2, 0.3]\nlook_at = [0, 0, -1]\nup = [0, 1, 0]\nfov = 60\n\
                 [integrator]\nmax_bounces = {bounces}\n[materials.wall.diffuse]\nreflectance = {rho}\n\
                 [[objects]]\nsphere = {{ center = [0, 0, 0], radius = 1 }}\nmaterial = \"wall\"\nemission = 1\nemission_sides = \"both\"\n"
            );
            let seen = bench.render(&text, 64)?;
            let expected = (0..=bounces).map(|i| f64::from(rho as f32).powi(i)).sum();
            // A rounding of f32 at every bounce.
            let roundings = 1.2e-7 * f64::from(bounces + 1);
            bench.check(format!("ρ = {rho}, {bounces} bounces"), expected, seen.of(0), TABLES + roundings);
        }
    }
    Ok(())
}

fn mirrors(bench: &mut Bench) -> Result<()> {
    for bounces in [1, 8, 64, 256] {
        let text = format!(
            "[channels]\nintervals = [[4000, 4000.1]]\n[integrator]\nmax_bounces = {bounces}\n\
             [materials.metal.conductor]\neta = 0.2\nk = 3.4\ntemperature = 1000\n\
             [[objects]]\nquad = {{ corner = [-1, -1, 0], edge_u = [2, 0, 0], edge_v = [0, 2, 0] }}\nmaterial = \"metal\"\n\
             [[objects]]\nquad = {{ corner = [-1, -1, 2], edge_u = [0, 2, 0], edge_v = [2, 0, 0] }}\nmaterial = \"metal\"\n"
        );
        let seen = bench.render(&text, 64)?;
        // ((n - 1)² + k²) / ((n + 1)² + k²), a metal at normal incidence.
        let reflected: f64 = (0.64 + 11.56) / (1.44 + 11.56);
        let expected = (1.0 - reflected.powi(bounces + 1)) * planck::radiance(4000.05, 1000.0);
        bench.check(format!("{bounces} bounces"), expected, seen.of(0), TABLES);
    }
    Ok(())
}
