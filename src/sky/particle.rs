//! Aerosols.

use std::sync::OnceLock;

use super::Aerosol;
use crate::spectral::columns;

/// nm; extinction and absorption over the extinction at 550 nm, and mean cosine, of each kind in turn.
const AEROSOLS: &str = include_str!("data/aerosols.csv");

/// Extinction and absorption, over the extinction at 550 nm, and mean cosine of scattering. Between the table's wavelengths the first two
/// are powers of the wavelength (Ångström), the last is linear.
pub fn of(kind: Aerosol, nm: f64) -> [f64; 3] {
    static TABLE: OnceLock<Vec<[f64; 13]>> = OnceLock::new();
    let rows = TABLE.get_or_init(|| columns::<13>(AEROSOLS).collect());
    let i = rows.partition_point(|row| row[0] <= nm).clamp(1, rows.len() - 1);
    let [below, above] = [rows[i - 1], rows[i]];
    let first = 1 + 3 * kind as usize;
    let t = (nm / below[0]).ln() / (above[0] / below[0]).ln();
    std::array::from_fn(|column| {
        let [a, b] = [below[first + column], above[first + column]];
        match column {
            2 => a + (nm - below[0]) / (above[0] - below[0]) * (b - a),
            _ => a * (b / a).powf(t),
        }
    })
}

/// Wavelengths that show the whole of it, nm, as far as sunlight goes; and `beyond`.
pub fn wavelengths(beyond: bool) -> impl Iterator<Item = f64> {
    let spread = |from: f64, to: f64, steps: u32| {
        (0..=steps).map(move |i| from * (to / from).powf(f64::from(i) / f64::from(steps)))
    };
    spread(370.0, 2520.0, 120).chain(beyond.then(|| spread(2540.0, 20_500.0, 180)).into_iter().flatten())
}
