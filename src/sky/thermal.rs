//! What gases absorb, and send as heat, beyond the sun's part of the spectrum.
//!
//! LOWTRAN7's band models again, but followed upwards: transmittances from the ground to each height decide how a depth is spread over the
//! layers. T = exp(-D F^a) for the share F of the column below a height, so that of saturated bands more lies near the ground. What comes to the
//! ground from straight above then is LOWTRAN7's radiance, had the depths been made for that way; they are made for one of [`DIFFUSE`] air
//! masses, on which a whole hemisphere's irradiance is about right.

use std::sync::OnceLock;

use super::air::{Layers, Profile, Step};
use super::gas::{between, on_the_way};
use crate::spectral::columns;

/// nm; depth and exponent of water; depths of its continua, by itself and by air; depth and exponent of ozone and of the gases that are mixed
/// evenly (CO₂, CO, CH₄, N₂O, O₂, N₂, and traces: HNO₃, NO, NO₂, SO₂, NH₃); and which share of the last is spread as continua are.
const THERMAL: &str = include_str!("data/thermal.csv");

/// The air mass of light that comes from all directions alike, for irradiance (Elsasser's factor of diffusivity).
pub const DIFFUSE: f64 = 1.66;

/// Gases, each of which is spread over the layers alike at all wavelengths.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Gas {
    Water,
    SelfContinuum,
    ForeignContinuum,
    Ozone,
    MixedBands,
    MixedContinua,
}

impl Gas {
    /// In the order of [`depths`].
    pub const ALL: [Gas; 6] =
        [Gas::Water, Gas::SelfContinuum, Gas::ForeignContinuum, Gas::Ozone, Gas::MixedBands, Gas::MixedContinua];

    /// What the column of `heat.csv` is called, and its grid.
    pub fn names(self) -> [&'static str; 2] {
        match self {
            Gas::Water => ["water", "heat_water"],
            Gas::SelfContinuum => ["water self continuum", "heat_self"],
            Gas::ForeignContinuum => ["water foreign continuum", "heat_foreign"],
            Gas::Ozone => ["ozone", "heat_ozone"],
            Gas::MixedBands => ["bands of mixed gases", "heat_bands"],
            Gas::MixedContinua => ["continua of mixed gases", "heat_continua"],
        }
    }

    /// Share of its depth in each layer. Powers of pressure and exponents are those that are next to LOWTRAN7's in all bands: a sky of them is
    /// within 2 % of one with its own for each wavenumber, by 0.5 % in the root mean square.
    pub fn shares(self, layers: &Layers) -> Vec<f64> {
        let water = |step: &Step| step.molecules * step.water_ppm;
        match self {
            Gas::Water => layers.shares(|step| water(step) * step.pressure.powf(1.45), 0.547),
            // Of the square of its density; stronger in the cold (296 K and 260 K in LOWTRAN7, here a power between).
            Gas::SelfContinuum => layers
                .shares(|step| water(step) * step.molecules * step.water_ppm * (296.0 / step.temperature).powi(5), 1.0),
            Gas::ForeignContinuum => layers.shares(|step| water(step) * step.pressure.powf(0.8), 1.0),
            Gas::Ozone => layers.shares(|step| step.molecules * step.ozone_ppm * step.pressure.powf(0.4), 0.76),
            // scripts/sky_tables.py measures the share by these two.
            Gas::MixedBands => layers.shares(|step| step.molecules * step.pressure, 0.6),
            Gas::MixedContinua => layers.shares(|step| step.molecules * step.pressure.powf(0.9), 1.0),
        }
    }
}

fn table() -> &'static [[f64; 10]] {
    static TABLE: OnceLock<Vec<[f64; 10]>> = OnceLock::new();
    TABLE.get_or_init(|| columns::<10>(THERMAL).collect())
}

/// Wavelengths between which the depths are linear, nm.
pub fn wavelengths() -> impl Iterator<Item = f64> {
    table().iter().map(|row| row[0])
}

/// Vertical depths of [`Gas::ALL`] at `nm`, for columns of `water` (cm) and `ozone` (Dobson units) and light that comes through `air_mass`
/// atmospheres.
pub fn depths(nm: f64, water: f64, ozone: f64, air_mass: f64) -> [f64; 6] {
    let [wetter, richer] = [water / Profile::standard().water(), ozone / Profile::standard().ozone()];
    between(table(), nm, |[_, water, of_water, own, foreign, ozone, of_ozone, mixed, of_mixed, share]| {
        let on_the_way = |depth, amount, power| on_the_way(depth, amount, power, air_mass);
        let mixed = on_the_way(mixed, 1.0, of_mixed);
        [
            on_the_way(water, wetter, of_water),
            wetter * wetter * own,
            wetter * foreign,
            on_the_way(ozone, richer, of_ozone),
            (1.0 - share) * mixed,
            share * mixed,
        ]
    })
}
