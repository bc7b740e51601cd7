//! Lines of H2O, an asymmetric top: Watson's Hamiltonian in the basis |J, K>, diagonalised for every J, and dipole
//! moments along the axes a and b of the molecule (Zare, *Angular Momentum* (1988), chapter 6).
//!
//! Constants in cm-1: Herzberg, *Infrared and Raman Spectra* (1945), and Flaud and Camy-Peyret's analyses of the bands, rounded.

/// A line: its wavenumber, the energy of its lower state in cm-1, and its strength without population: the
/// intensity of its band times its share of the band, (2J + 1) included.
pub struct Line {
    pub nu: f64,
    pub energy: f64,
    pub strength: f64,
}

/// Quanta of the three vibrations.
type State = [u32; 3];

/// A band from the ground state: what it adds, its origin, its intensity in cm-1 / (g m-2), and whether the dipole is
/// along a (otherwise b).
struct Band {
    quanta: State,
    origin: f64,
    intensity: f64,
    along_a: bool,
}

const BANDS: [Band; 6] = [
    Band { quanta: [0, 1, 0], origin: 1594.75, intensity: 41.2, along_a: false },
    Band { quanta: [0, 2, 0], origin: 3151.63, intensity: 0.19, along_a: false },
    Band { quanta: [1, 0, 0], origin: 3657.05, intensity: 2.30, along_a: false },
    Band { quanta: [0, 0, 1], origin: 3755.93, intensity: 22.40, along_a: true },
    Band { quanta: [0, 1, 1], origin: 5331.27, intensity: 3.0, along_a: true },
    Band { quanta: [1, 0, 1], origin: 7249.82, intensity: 2.5, along_a: true },
];

/// Lower states that hold more than a thousandth of the molecules at 1000 K.
const LOWER: [State; 6] = [[0, 0, 0], [0, 1, 0], [0, 2, 0], [0, 3, 0], [1, 0, 0], [0, 0, 1]];
const MAX_J: usize = 25;

/// Energy over the ground state: fundamentals and anharmonic constants.
pub fn vibration(v: State) -> f64 {
    let [a, b, c] = v.map(f64::from);
    3657.05 * a + 1594.75 * b + 3755.93 * c
        - 42.6 * a * (a - 1.0)
        - 16.8 * b * (b - 1.0)
        - 47.6 * c * (c - 1.0)
        - 15.9 * a * b
        - 165.8 * a * c
        - 20.3 * b * c
}

/// A level of rotation: its energy and its coefficients in |J, K>, K from -J.
struct Level {
    energy: f64,
    coefficients: Vec<f64>,
}

/// All levels of one J.
fn levels(v: State, j: usize) -> Vec<Level> {
    let [v1, v2, v3] = v.map(f64::from);
    let a = 27.881 - 0.74 * v1 + 3.25 * v2 - 1.23 * v3;
    let b = 14.522 - 0.22 * v1 + 0.15 * v2 - 0.09 * v3;
    let c = 9.278 - 0.175 * v1 - 0.14 * v2 - 0.14 * v3;
    // Centrifugal distortion of the ground state; that with K^4 grows with the bending and is summed as a geometric series, which
    // stays right for fast rotation about the axis of least inertia.
    let (d_j, d_jk, d_k, s_j, s_k) = (1.249e-3, -5.766e-3, 3.252e-2 * (1.0 + 0.8 * v2), 5.08e-4, 1.302e-3);
    let size = 2 * j + 1;
    let jj = (j * (j + 1)) as f64;
    let mean = (b + c) / 2.0;
    let k_of = |i: usize| i as f64 - j as f64;
    let mut matrix = vec![vec![0.0; size]; size];
    for i in 0..size {
        let kk = k_of(i) * k_of(i);
        let axial = (a - mean) * kk / (1.0 + d_k * kk / (a - mean));
        matrix[i][i] = mean * jj + axial - d_j * jj * jj - d_jk * jj * kk;
        if i + 2 < size {
            let (k, next) = (k_of(i), k_of(i) + 2.0);
            let raise = ((jj - k * (k + 1.0)) * (jj - (k + 1.0) * (k + 2.0))).sqrt();
            let off = ((b - c) / 4.0 - s_j * jj - s_k / 2.0 * (kk + next * next)) * raise;
            (matrix[i][i + 2], matrix[i + 2][i]) = (off, off);
        }
    }
    let (energies, vectors) = eigen(matrix);
    (energies.into_iter().zip(vectors)).map(|(energy, coefficients)| Level { energy, coefficients }).collect()
}

/// Eigenvalues and eigenvectors of a symmetric matrix by Jacobi's rotations.
fn eigen(mut m: Vec<Vec<f64>>) -> (Vec<f64>, Vec<Vec<f64>>) {
    let n = m.len();
    // Row i holds the eigenvector of m[i][i].
    let mut vectors: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|k| f64::from(u8::from(i == k))).collect()).collect();
    loop {
        let off: f64 = (0..n).flat_map(|i| (0..i).map(move |k| (i, k))).map(|(i, k)| m[i][k] * m[i][k]).sum();
        if off < 1e-12 {
            return ((0..n).map(|i| m[i][i]).collect(), vectors);
        }
        for p in 0..n {
            for q in p + 1..n {
                if m[p][q].abs() < 1e-14 {
                    continue;
                }
                let theta = (m[q][q] - m[p][p]) / (2.0 * m[p][q]);
                let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                let s = t * c;
                for row in &mut m {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
                for k in 0..n {
                    (m[p][k], m[q][k]) = (c * m[p][k] - s * m[q][k], s * m[p][k] + c * m[q][k]);
                    (vectors[p][k], vectors[q][k]) =
                        (c * vectors[p][k] - s * vectors[q][k], s * vectors[p][k] + c * vectors[q][k]);
                }
            }
        }
    }
}

/// Clebsch and Gordan's <j k; 1 q | upper k + q> for q = -1, 0, 1.
fn coupling(j: usize, k: f64, q: i32, upper: usize) -> f64 {
    let j_ = j as f64;
    let (sum, difference) = (j_ + k, j_ - k);
    let value = match (upper as i32 - j as i32, q) {
        (1, 1) => (sum + 1.0) * (sum + 2.0) / ((2.0 * j_ + 1.0) * (2.0 * j_ + 2.0)),
        (1, 0) => (difference + 1.0) * (sum + 1.0) / ((2.0 * j_ + 1.0) * (j_ + 1.0)),
        (1, -1) => (difference + 1.0) * (difference + 2.0) / ((2.0 * j_ + 1.0) * (2.0 * j_ + 2.0)),
        (0, _) if j == 0 => 0.0,
        (0, 1) => return -((sum + 1.0) * difference / (2.0 * j_ * (j_ + 1.0))).max(0.0).sqrt(),
        (0, 0) => return k / (j_ * (j_ + 1.0)).sqrt(),
        (0, -1) => sum * (difference + 1.0) / (2.0 * j_ * (j_ + 1.0)),
        (-1, 1) => (difference - 1.0) * difference / (2.0 * j_ * (2.0 * j_ + 1.0)),
        (-1, 0) => return -(difference * sum / (j_ * (2.0 * j_ + 1.0))).max(0.0).sqrt(),
        (-1, -1) => (sum - 1.0) * sum / (2.0 * j_ * (2.0 * j_ + 1.0)),
        _ => 0.0,
    };
    value.max(0.0).sqrt()
}

/// The square of the dipole's matrix element between two levels, summed over their orientations.
fn strength(lower: &Level, j: usize, upper: &Level, j_upper: usize, along_a: bool) -> f64 {
    let mut sum = 0.0;
    for (i, a) in lower.coefficients.iter().enumerate().filter(|(_, a)| a.abs() > 1e-8) {
        let k = i as i32 - j as i32;
        let to = |q: i32| {
            let index = k + q + j_upper as i32;
            let coefficient = usize::try_from(index).ok().and_then(|index| upper.coefficients.get(index));
            coefficient.map_or(0.0, |b| a * b * coupling(j, f64::from(k), q, j_upper))
        };
        sum += if along_a { to(0) } else { (to(-1) - to(1)) * std::f64::consts::FRAC_1_SQRT_2 };
    }
    (2 * j + 1) as f64 * sum * sum
}

/// Energies of all rotational levels of the ground state, each with 2J + 1.
pub fn rotations() -> Vec<(f64, f64)> {
    let all =
        (0..=MAX_J).flat_map(|j| levels([0; 3], j).into_iter().map(move |level| (level.energy, (2 * j + 1) as f64)));
    all.collect()
}

/// What the permanent dipole adds to the bending band: a factor that falls linearly with the distance from the origin in
/// amplitude (Herman and Wallis, J. Chem. Phys. 23, 637, 1955). Its length is chosen so that the mean over 2000 to
/// 2100 cm-1 at 600 K is about that of a line-by-line calculation, 0.9 m-1 atm-1.
fn herman_wallis(distance: f64) -> f64 {
    const LENGTH: f64 = 800.0;
    (1.0 - distance / LENGTH).max(0.0).powi(2)
}

/// All lines between `from` and `to` cm-1. Intensities are `intensity` x `unit`.
pub fn lines(from: f64, to: f64, unit: f64) -> Vec<Line> {
    let mut lines = Vec::new();
    let of = |v: State| (0..=MAX_J + 1).map(|j| levels(v, j)).collect::<Vec<_>>();
    let lowers = LOWER.map(of);
    for band in &BANDS {
        for (v, lower) in LOWER.into_iter().zip(&lowers) {
            let target: State = std::array::from_fn(|i| v[i] + band.quanta[i]);
            let upper = of(target);
            let origin = band.origin + vibration(target) - vibration(v) - vibration(band.quanta);
            // A harmonic oscillator's matrix elements: v + 1 for a quantum, (v + 1)(v + 2)/2 for two.
            let ladder: f64 = (0..3)
                .map(|i| (1..=band.quanta[i]).map(|n| f64::from(v[i] + n) / f64::from(n)).product::<f64>())
                .product();
            for (j, levels) in lower.iter().enumerate().take(MAX_J + 1) {
                for (j_upper, uppers) in upper.iter().enumerate().take(j + 2).skip(j.saturating_sub(1)) {
                    for a in levels {
                        for b in uppers {
                            let nu = origin + b.energy - a.energy;
                            let strength = strength(a, j, b, j_upper, band.along_a);
                            if strength > 1e-6 && (from..to).contains(&nu) {
                                let strength = if band.quanta == [0, 1, 0] {
                                    strength * herman_wallis(nu - origin)
                                } else {
                                    strength
                                };
                                let strength = strength * ladder * band.intensity * unit * nu / origin;
                                lines.push(Line { nu, energy: a.energy + vibration(v), strength });
                            }
                        }
                    }
                }
            }
        }
    }
    lines
}

/// Energies of the vibrations that are populated.
pub fn vibrations() -> impl Iterator<Item = f64> {
    LOWER.into_iter().map(vibration)
}
