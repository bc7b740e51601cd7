//! Matter that scatters light in the air: molecules, haze, and the droplets of a cloud by Mie's theory.

use std::f64::consts::PI;
use std::fmt::Write as _;
use std::io;
use std::path::Path;

use super::sky::Table;

/// Writes what is known of air, haze and droplets to `folder`, whose `water.csv` has the index of refraction of water.
pub fn make(folder: &Path) -> io::Result<()> {
    std::fs::write(folder.join("air.csv"), air())?;
    std::fs::write(folder.join("haze.csv"), haze())?;
    let water = Table::read(&folder.join("water.csv"))?;
    let (coefficients, phase) = droplets(&water);
    std::fs::write(folder.join("droplets.csv"), coefficients)?;
    std::fs::write(folder.join("droplets_phase.csv"), phase)
}

/// Wavelengths in nm whose logarithms are evenly spaced.
fn wavelengths(from: f64, to: f64, count: u32) -> impl Iterator<Item = f64> {
    (0..count).map(move |i| (from * (to / from).powf(f64::from(i) / f64::from(count - 1))).round())
}

/// Rayleigh's scattering coefficient of dry air at 15 C and 1013.25 hPa, m⁻¹, with its King factor: Bodhaine et al., J. Atmos. Oceanic
/// Technol. 16, 1854 (1999), from the index of Peck and Reeder (1972) and the factors of Bates (1984).
pub fn rayleigh(nm: f64) -> f64 {
    const MOLECULES: f64 = 2.546899e25; // m⁻³
    let inverse2 = (1e3 / nm).powi(2); // µm⁻²
    let excess = 1e-8 * (8060.51 + 2480990.0 / (132.274 - inverse2) + 17455.7 / (39.32957 - inverse2));
    let n2 = (1.0 + excess).powi(2);
    let nitrogen = 1.034 + 3.17e-4 * inverse2;
    let oxygen = 1.096 + 1.385e-3 * inverse2 + 1.448e-4 * inverse2 * inverse2;
    // Percent of the volume; argon and carbon dioxide have 1 and 1.15.
    let king = (78.084 * nitrogen + 20.946 * oxygen + 0.934 + 0.036 * 1.15) / (78.084 + 20.946 + 0.934 + 0.036);
    let lambda = nm * 1e-9;
    24.0 * PI.powi(3) * (n2 - 1.0).powi(2) / (lambda.powi(4) * MOLECULES * (n2 + 2.0).powi(2)) * king
}

fn air() -> String {
    let mut text = String::from(
        "# Rayleigh scattering of dry air at 15 C and 1013.25 hPa, King factor included; phase = { rayleigh = 0.0279 }\n\
         # COMPUTED by formula: Bodhaine et al., J. Atmos. Oceanic Technol. 16, 1854 (1999)\n\
         wavelength_nm,scattering (1/m)\n",
    );
    for nm in wavelengths(300.0, 20_000.0, 120) {
        writeln!(text, "{nm},{:.5e}", rayleigh(nm)).expect("memory");
    }
    text
}

/// A clear day's aerosol: 23 km of visibility (Koschmieder: 3.912 over the extinction at 550 nm), which falls with λ^-1.3
/// (Ångström), nine tenths of it scattered.
fn haze() -> String {
    let mut text = String::from(
        "# Haze of 23 km visibility (Koschmieder), Angstrom exponent 1.3, single scattering albedo 0.93; phase = { hg = 0.7 } is usual\n\
         # COMPUTED by formula; the three numbers are choices\n\
         wavelength_nm,scattering (1/m),absorption (1/m)\n",
    );
    for nm in wavelengths(300.0, 20_000.0, 60) {
        let extinction = 3.912 / 23e3 * (nm / 550.0).powf(-1.3);
        writeln!(text, "{nm},{:.5e},{:.5e}", 0.93 * extinction, 0.07 * extinction).expect("memory");
    }
    text
}

/// Degrees, finer where the forward peak, the bow and the glory are.
fn angles() -> Vec<f64> {
    let mut all = vec![0.0f64];
    for (to, step) in [(1.0, 0.05), (2.0, 0.1), (10.0, 0.25), (20.0, 0.5), (130.0, 2.0), (170.0, 1.0), (180.0, 0.25)] {
        let from = all[all.len() - 1];
        let count = ((to - from) / step).round() as u32;
        all.extend((1..=count).map(|i| from + (to - from) * f64::from(i) / f64::from(count)));
    }
    all
}

/// Radii in µm and how many have them: Hansen's gamma distribution (Hansen and Travis 1974) of effective radius 10 µm and variance 0.1.
fn sizes() -> Vec<(f64, f64)> {
    const EFFECTIVE: f64 = 10.0;
    const VARIANCE: f64 = 0.1;
    (1..=120)
        .map(|i| 0.25 * f64::from(i))
        .map(|r| (r, r.powf(1.0 / VARIANCE - 3.0) * (-r / (EFFECTIVE * VARIANCE)).exp()))
        .collect()
}

/// Coefficients of a gram of water a cubic metre, and the phase function.
fn droplets(water: &Table) -> (String, String) {
    let mut coefficients = String::from(
        "# Cloud droplets, effective radius 10 um, effective variance 0.1, one gram of water a cubic metre\n\
         # COMPUTED by Mie's theory from water.csv\n\
         wavelength_nm,scattering (1/m),absorption (1/m)\n",
    );
    let columns: Vec<f64> = vec![400.0, 550.0, 700.0, 900.0, 1200.0, 1650.0, 2200.0, 2500.0];
    let degrees = angles();
    let mut phases = Vec::new();
    let between = wavelengths(400.0, 2500.0, 40).filter(|nm| !columns.contains(nm));
    let mut rows: Vec<(f64, f64, f64)> = Vec::new();
    for (nm, wants_phase) in columns.iter().map(|nm| (*nm, true)).chain(between.map(|nm| (nm, false))) {
        let index = Complex(water.at(nm, 1), water.at(nm, 2));
        let cosines: Vec<f64> =
            if wants_phase { degrees.iter().map(|d| d.to_radians().cos()).collect() } else { Vec::new() };
        let (mut scattered, mut lost, mut volume) = (0.0, 0.0, 0.0);
        let mut intensity = vec![0.0; cosines.len()];
        for (radius, count) in sizes() {
            let x = 2e3 * PI * radius / nm;
            let sphere = mie(x, index, &cosines);
            let area = PI * radius * radius * count;
            scattered += area * sphere.scattering;
            lost += area * sphere.extinction;
            volume += 4.0 / 3.0 * PI * radius.powi(3) * count;
            intensity.iter_mut().zip(&sphere.intensity).for_each(|(sum, value)| *sum += count * value);
        }
        // µm² over µm³ of water; a gram of water has 1e-6 m³.
        let per_gram = 1e-6 * 1e6 / volume;
        rows.push((nm, scattered * per_gram, (lost - scattered).max(0.0) * per_gram));
        if wants_phase {
            // With k² C, the mean of the intensities over the sphere is C k² / 4π.
            let k = 2e3 * PI / nm;
            phases.push(intensity.iter().map(|value| 4.0 * PI * value / (k * k * scattered)).collect::<Vec<f64>>());
        }
    }
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (nm, scattering, absorption) in rows {
        writeln!(coefficients, "{nm},{scattering:.5e},{absorption:.5e}").expect("memory");
    }
    let mut phase = String::from(
        "# Phase function of cloud droplets, effective radius 10 um, effective variance 0.1, mean 1 over the sphere\n\
         # COMPUTED by Mie's theory from water.csv\n\
         degrees",
    );
    columns.iter().for_each(|nm| write!(phase, ",{nm}").expect("memory"));
    for (i, degrees) in degrees.iter().enumerate() {
        write!(phase, "\n{degrees:.4}").expect("memory");
        phases.iter().for_each(|column| write!(phase, ",{:.5e}", column[i]).expect("memory"));
    }
    (coefficients, phase + "\n")
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Complex(pub f64, pub f64);

impl std::ops::Add for Complex {
    type Output = Complex;
    fn add(self, other: Complex) -> Complex {
        Complex(self.0 + other.0, self.1 + other.1)
    }
}

impl std::ops::Sub for Complex {
    type Output = Complex;
    fn sub(self, other: Complex) -> Complex {
        Complex(self.0 - other.0, self.1 - other.1)
    }
}

impl std::ops::Mul for Complex {
    type Output = Complex;
    fn mul(self, other: Complex) -> Complex {
        Complex(self.0 * other.0 - self.1 * other.1, self.0 * other.1 + self.1 * other.0)
    }
}

impl std::ops::Div for Complex {
    type Output = Complex;
    fn div(self, other: Complex) -> Complex {
        let square = other.norm();
        Complex((self.0 * other.0 + self.1 * other.1) / square, (self.1 * other.0 - self.0 * other.1) / square)
    }
}

impl Complex {
    fn times(self, factor: f64) -> Complex {
        Complex(self.0 * factor, self.1 * factor)
    }

    fn norm(self) -> f64 {
        self.0 * self.0 + self.1 * self.1
    }
}

/// What a sphere does: efficiencies, and (|S₁|² + |S₂|²) / 2 at the cosines asked for.
pub struct Sphere {
    pub extinction: f64,
    pub scattering: f64,
    pub intensity: Vec<f64>,
}

/// Mie's series for size parameter `x` and relative index `index` (Bohren and Huffman 1983, chapter 4): logarithmic derivatives by downward
/// recurrence, Riccati-Bessel functions upwards.
pub fn mie(x: f64, index: Complex, cosines: &[f64]) -> Sphere {
    let terms = (x + 4.05 * x.cbrt() + 2.0) as usize;
    let inner = index.times(x);
    let first = terms.max(inner.norm().sqrt() as usize) + 16;
    let mut derivatives = vec![Complex(0.0, 0.0); first + 1];
    for n in (1..=first).rev() {
        let step = Complex(n as f64, 0.0) / inner;
        derivatives[n - 1] = step - Complex(1.0, 0.0) / (derivatives[n] + step);
    }
    let (mut psi_before, mut psi) = (x.cos(), x.sin());
    let (mut chi_before, mut chi) = (-x.sin(), x.cos());
    let mut sums = [0.0; 2];
    let mut amplitudes = vec![[Complex(0.0, 0.0); 2]; cosines.len()];
    let mut angular = vec![[0.0, 1.0]; cosines.len()];
    for n in 1..=terms {
        let order = n as f64;
        let next = (2.0 * order - 1.0) / x * psi - psi_before;
        (psi_before, psi) = (psi, next);
        let next = (2.0 * order - 1.0) / x * chi - chi_before;
        (chi_before, chi) = (chi, next);
        let (xi, xi_before) = (Complex(psi, -chi), Complex(psi_before, -chi_before));
        let coefficient = |inside: Complex| {
            let slope = inside + Complex(order / x, 0.0);
            (slope.times(psi) - Complex(psi_before, 0.0)) / (slope * xi - xi_before)
        };
        let a = coefficient(derivatives[n] / index);
        let b = coefficient(index * derivatives[n]);
        sums[0] += (2.0 * order + 1.0) * (a.0 + b.0);
        sums[1] += (2.0 * order + 1.0) * (a.norm() + b.norm());
        let weight = (2.0 * order + 1.0) / (order * (order + 1.0));
        for ((amplitude, angular), &mu) in amplitudes.iter_mut().zip(&mut angular).zip(cosines) {
            let [pi_before, pi] = *angular;
            let tau = order * mu * pi - (order + 1.0) * pi_before;
            amplitude[0] = amplitude[0] + (a.times(pi) + b.times(tau)).times(weight);
            amplitude[1] = amplitude[1] + (a.times(tau) + b.times(pi)).times(weight);
            *angular = [pi, ((2.0 * order + 1.0) * mu * pi - (order + 1.0) * pi_before) / order];
        }
    }
    Sphere {
        extinction: 2.0 / (x * x) * sums[0],
        scattering: 2.0 / (x * x) * sums[1],
        intensity: amplitudes.iter().map(|[s1, s2]| 0.5 * (s1.norm() + s2.norm())).collect(),
    }
}
