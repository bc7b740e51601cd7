//! What gases absorb.
//!
//! LOWTRAN7's transmittances are means over 20 cm⁻¹, in which lines of all strengths stand: T = exp(-(C U)^a) for an amount U, with a below 1.
//! A renderer that follows light through layers needs depths that add up (Beer's law). So the depth is that of sunlight's way, divided by its
//! air mass: direct light has LOWTRAN's own transmittance, and what is scattered, whose ways are others, nearly so.

use std::sync::OnceLock;

use super::air::Profile;
use crate::spectral::columns;

/// Column of ozone in the standard atmosphere, Dobson units, in whole ones.
pub const STANDARD_OZONE: f64 = 344.0;
/// Column of water vapour in the standard atmosphere, cm of liquid, to two digits.
pub const STANDARD_WATER: f64 = 1.42;

/// nm; depth and exponent of water; depths of its continuum and of ozone; depth and exponent of the gases that are mixed evenly (CO₂, O₂,
/// CH₄, N₂O, CO, N₂).
const GASES: &str = include_str!("data/gases.csv");

fn table() -> &'static [[f64; 7]] {
    static TABLE: OnceLock<Vec<[f64; 7]>> = OnceLock::new();
    TABLE.get_or_init(|| columns::<7>(GASES).collect())
}

/// Wavelengths between which the depths are linear, nm.
pub fn wavelengths() -> impl Iterator<Item = f64> {
    table().iter().map(|row| row[0])
}

/// What `of` makes of the rows around `nm`, which is in the first column, on the line between both.
pub(super) fn between<const N: usize, const M: usize>(
    rows: &[[f64; N]],
    nm: f64,
    of: impl Fn([f64; N]) -> [f64; M],
) -> [f64; M] {
    let i = rows.partition_point(|row| row[0] <= nm).clamp(1, rows.len() - 1);
    let t = (nm - rows[i - 1][0]) / (rows[i][0] - rows[i - 1][0]);
    let [below, above] = [of(rows[i - 1]), of(rows[i])];
    std::array::from_fn(|column| below[column] + t * (above[column] - below[column]))
}

/// The vertical depth of a band, (C U)^a for `amount` over that for which `depth` holds, such that a way of `air_mass` has its transmittance.
pub(super) fn on_the_way(depth: f64, amount: f64, power: f64, air_mass: f64) -> f64 {
    if amount > 0.0 { depth * (amount * air_mass).powf(power) / air_mass } else { 0.0 }
}

/// Vertical depths of water, ozone and the mixed gases at `nm`, for columns of `water` (cm) and `ozone` (Dobson units) and light that
/// comes through `air_mass` atmospheres.
pub fn depths(nm: f64, water: f64, ozone: f64, air_mass: f64) -> [f64; 3] {
    let [wetter, richer] = [water / Profile::standard().water(), ozone / Profile::standard().ozone()];
    between(table(), nm, |[_, lines, power, continuum, ozone, mixed, mixed_power]| {
        let lines = on_the_way(lines, wetter, power, air_mass);
        [lines + wetter * continuum, richer * ozone, on_the_way(mixed, 1.0, mixed_power, air_mass)]
    })
}
