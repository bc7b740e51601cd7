//! Absorption of hot CO2 and H2O from published molecular constants and band intensities, smoothed over a few cm-1.
//!
//! CO2: lines of a linear molecule. Energies from the constants of Herzberg, *Infrared and Raman Spectra* (1945), and
//! Rothman et al., JQSRT 48, 537 (1992), bands of a harmonic oscillator's relative strengths with anharmonic origins.
//! H2O: lines of an asymmetric top, see [`water`]. Total intensities of both: Edwards and Balakrishnan, IJHMT 16, 25 (1973), as
//! tabulated in Modest, *Radiative Heat Transfer*, chapter "Molecular gases".

use std::fmt::Write as _;
use std::io;
use std::path::Path;

use super::water::{self, Line};

/// K; the columns of the tables.
const TEMPERATURES: [f64; 9] = [250.0, 300.0, 400.0, 500.0, 600.0, 700.0, 800.0, 900.0, 1000.0];
/// cm-1: a little more than 1.5 to 5.5 um.
const FROM: f64 = 1780.0;
const TO: f64 = 6700.0;
const STEP: f64 = 5.0;
/// Standard deviation of the smoothing, cm-1.
const SMOOTHING: f64 = 4.0;
/// hc/k, cm K.
const C2: f64 = 1.438_776_877;
/// Molecules in a cm3 at 1 atm and 1 K.
const LOSCHMIDT: f64 = 7.338_9e21;
const AVOGADRO: f64 = 6.022_140_76e23;

/// Writes `co2.csv` and `h2o.csv`: `nm` and a column of m-1 atm-1 for each temperature.
pub fn write(folder: &Path) -> io::Result<()> {
    let count = ((TO - FROM) / STEP) as usize + 1;
    let mut tables = [Vec::new(), Vec::new()];
    // Edwards' intensities hold for molecules without vibration.
    let lines = water::lines(FROM, TO, 18.015 * 1e4 / AVOGADRO);
    let rotations = water::rotations();
    for kelvin in TEMPERATURES {
        tables[0].push(co2(kelvin, count));
        tables[1].push(h2o(kelvin, &lines, &rotations, count));
    }
    for (name, columns) in ["co2", "h2o"].into_iter().zip(tables) {
        let mut text = format!(
            "# COMPUTED absorption coefficient of {name} in m-1 atm-1 by examples/make_scene/gases.rs; columns are temperatures in K\nnm"
        );
        TEMPERATURES.iter().for_each(|t| write!(text, ",{t}").expect("memory"));
        for i in (0..count).rev() {
            write!(text, "\n{:.3}", 1e7 / (FROM + STEP * i as f64)).expect("memory");
            columns.iter().for_each(|column| write!(text, ",{:.5e}", column[i]).expect("memory"));
        }
        text.push('\n');
        std::fs::write(folder.join(format!("{name}.csv")), text)?;
    }
    println!("{}: absorption of CO2 and H2O", folder.display());
    Ok(())
}

/// A parallel band of CO2 from the ground state: origin in cm-1, quanta it adds to v1 and v3, and its share of an intensity
/// in cm-1 / (g m-2).
struct Band {
    origin: f64,
    quanta: [u32; 2],
    intensity: f64,
}

const CO2: [Band; 6] = [
    Band { origin: 2349.14, quanta: [0, 1], intensity: 110.0 },
    // The Fermi dyad at 2.7 um and the triad at 2.0 um.
    Band { origin: 3612.84, quanta: [1, 1], intensity: 0.4 * 4.0 },
    Band { origin: 3714.78, quanta: [1, 1], intensity: 0.6 * 4.0 },
    Band { origin: 4853.62, quanta: [2, 1], intensity: 0.145 * 0.066 },
    Band { origin: 4977.83, quanta: [2, 1], intensity: 0.65 * 0.066 },
    Band { origin: 5099.66, quanta: [2, 1], intensity: 0.205 * 0.066 },
];

/// Vibration v = (v1, v2, v3) of CO2: its energy in cm-1, degeneracy, and rotational constant in cm-1.
fn co2_state(v: [u32; 3]) -> (f64, f64, f64) {
    let [v1, v2, v3] = v.map(f64::from);
    // v1 is the mean of each Fermi pair: 1388 and 1285 for one quantum.
    let energy = 1336.8 * v1 + 667.4 * v2 + 2349.14 * v3 - 12.5 * v3 * (v3 - 1.0) - 19.1 * v1 * v3 - 12.5 * v2 * v3;
    (energy, v2 + 1.0, 0.390_22 - 0.001_21 * v1 + 0.000_72 * v2 - 0.003_08 * v3)
}

fn co2(kelvin: f64, count: usize) -> Vec<f64> {
    const MASS: f64 = 44.01;
    let mut states = Vec::new();
    for v1 in 0..4 {
        for v2 in 0..10 {
            for v3 in 0..4 {
                states.push([v1, v2, v3]);
            }
        }
    }
    let boltzmann = |energy: f64| (-C2 * energy / kelvin).exp();
    let vibrations: f64 = states.iter().map(|v| co2_state(*v)).map(|(energy, g, _)| g * boltzmann(energy)).sum();
    let mut bins = vec![0.0; count];
    for Band { origin, quanta, intensity } in CO2 {
        // cm per molecule, for molecules without vibration.
        let strength = intensity * MASS * 1e4 / AVOGADRO;
        for v @ [v1, v2, v3] in states.iter().copied() {
            let (energy, g, b) = co2_state(v);
            let (upper, _, b_upper) = co2_state([v1 + quanta[0], v2, v3 + quanta[1]]);
            let (base, _, _) = co2_state([quanta[0], 0, quanta[1]]);
            let centre = origin + (upper - energy - base);
            // Matrix elements of a harmonic oscillator: v + 1 for one quantum, (v + 1)(v + 2)/2 for two.
            let ladder = |v: u32, quanta: u32| (1..=quanta).map(|k| f64::from(v + k) / f64::from(k)).product::<f64>();
            let population = g * boltzmann(energy) / vibrations;
            let amplitude = strength * population * ladder(v1, quanta[0]) * ladder(v3, quanta[1]);
            if amplitude < 1e-6 * strength {
                continue;
            }
            let rotations = kelvin / (C2 * b);
            for j in 0..180u32 {
                let jj = f64::from(j);
                let share = boltzmann(b * jj * (jj + 1.0)) / rotations;
                // P and R branch: m = -J and J + 1 (Herzberg's line formula and Hoenl-London factors).
                for (m, weight) in [(-jj, jj), (jj + 1.0, jj + 1.0)] {
                    let nu = centre + (b_upper + b) * m + (b_upper - b) * m * m;
                    let line = amplitude * share * weight * (nu / centre) * (1.0 - boltzmann(nu));
                    add(&mut bins, nu, line);
                }
            }
        }
    }
    coefficient(&bins, kelvin)
}

/// m-1 atm-1 from sums of line strengths in cm per molecule.
fn coefficient(bins: &[f64], kelvin: f64) -> Vec<f64> {
    smooth(bins).iter().map(|s| s / STEP * LOSCHMIDT / kelvin * 100.0).collect()
}

/// Adds a line to the two nearest bins, by nearness.
fn add(bins: &mut [f64], nu: f64, line: f64) {
    let at = (nu - FROM) / STEP;
    if at < 0.0 || at >= bins.len() as f64 - 1.0 {
        return;
    }
    let (i, f) = (at as usize, at.fract());
    bins[i] += line * (1.0 - f);
    bins[i + 1] += line * f;
}

fn smooth(bins: &[f64]) -> Vec<f64> {
    let reach = (4.0 * SMOOTHING / STEP).ceil() as isize;
    let kernel: Vec<f64> = (-reach..=reach).map(|k| (-0.5 * (k as f64 * STEP / SMOOTHING).powi(2)).exp()).collect();
    let sum: f64 = kernel.iter().sum();
    let value = |i: isize| bins.get(usize::try_from(i).unwrap_or(usize::MAX)).copied().unwrap_or(0.0);
    (0..bins.len() as isize)
        .map(|i| (-reach..=reach).zip(&kernel).map(|(k, w)| w * value(i + k)).sum::<f64>() / sum)
        .collect()
}

/// Lines of H2O at one temperature: by the population of their lower states, and less what is emitted by stimulation.
fn h2o(kelvin: f64, lines: &[Line], rotations: &[(f64, f64)], count: usize) -> Vec<f64> {
    let boltzmann = |energy: f64| (-C2 * energy / kelvin).exp();
    let states: f64 = rotations.iter().map(|(energy, g)| g * boltzmann(*energy)).sum::<f64>()
        * water::vibrations().map(boltzmann).sum::<f64>();
    let mut bins = vec![0.0; count];
    for line in lines {
        add(&mut bins, line.nu, line.strength * boltzmann(line.energy) / states * (1.0 - boltzmann(line.nu)));
    }
    coefficient(&bins, kelvin)
}
