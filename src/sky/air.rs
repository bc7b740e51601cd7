//! Where the matter of the standard atmosphere is, and how its molecules scatter.

use std::f64::consts::PI;
use std::sync::OnceLock;

use crate::spectral::columns;

/// Heights (km), pressure (hPa), temperature (K), molecules a cm³, and parts per million of water and ozone.
const STANDARD: &str = include_str!("data/us_standard.csv");
/// Layers of the scene, each of a kilometre. What is above the last is added to it.
pub const LAYERS: usize = 50;
/// Steps of the sums, km.
const STEP: f64 = 0.02;

/// The powers of pressure that band models weigh amounts of gas by: water's and the mixed gases', for which LOWTRAN7's differ by band,
/// from 0.6 to 1.0.
const WATER_POWER: f64 = 0.9;
const MIXED_POWER: f64 = 0.75;

/// Shares of the columns in each layer, from the ground up; each sums to 1.
pub struct Profile {
    molecules: f64,
    water: f64,
    ozone: f64,
    pub of_molecules: [f64; LAYERS],
    pub of_water: [f64; LAYERS],
    pub of_ozone: [f64; LAYERS],
    pub of_mixed: [f64; LAYERS],
}

impl Profile {
    /// The US standard atmosphere.
    pub fn standard() -> &'static Profile {
        static PROFILE: OnceLock<Profile> = OnceLock::new();
        PROFILE.get_or_init(Profile::make)
    }

    fn make() -> Profile {
        let levels: Vec<[f64; 6]> = columns::<6>(STANDARD).collect();
        // Everything but the mixing ratios falls exponentially between levels, and so do their products nearly.
        let at = |km: f64| -> [f64; 6] {
            let i = levels.partition_point(|level| level[0] <= km).clamp(1, levels.len() - 1);
            let [below, above] = [levels[i - 1], levels[i]];
            let t = (km - below[0]) / (above[0] - below[0]);
            std::array::from_fn(|column| match column {
                0 => km,
                2 => below[2] + t * (above[2] - below[2]),
                _ => below[column] * (above[column] / below[column]).powf(t),
            })
        };
        let top = levels[levels.len() - 1][0];
        let [mut of_molecules, mut of_water, mut of_ozone, mut of_mixed] = [[0.0; LAYERS]; 4];
        let [mut water, mut ozone] = [0.0, 0.0];
        for i in 0..(top / STEP).round() as usize {
            let km = (i as f64 + 0.5) * STEP;
            let [_, pressure, _, number, h2o, o3] = at(km);
            let layer = (km as usize).min(LAYERS - 1);
            let (amount, pressure) = (number * STEP * 1e5, pressure / levels[0][1]);
            of_molecules[layer] += amount;
            of_water[layer] += amount * h2o * pressure.powf(WATER_POWER);
            of_ozone[layer] += amount * o3;
            of_mixed[layer] += amount * pressure.powf(MIXED_POWER);
            water += amount * h2o * 1e-6;
            ozone += amount * o3 * 1e-6;
        }
        let molecules = of_molecules.iter().sum();
        let share = |amounts: [f64; LAYERS]| {
            let all: f64 = amounts.iter().sum();
            amounts.map(|amount| amount / all)
        };
        Profile {
            molecules,
            water,
            ozone,
            of_molecules: share(of_molecules),
            of_water: share(of_water),
            of_ozone: share(of_ozone),
            of_mixed: share(of_mixed),
        }
    }

    /// Molecules above a cm².
    pub fn molecules(&self) -> f64 {
        self.molecules
    }

    /// Column of water vapour, cm of liquid.
    pub fn water(&self) -> f64 {
        self.water * 18.015 / 6.022_140_76e23
    }

    /// Column of ozone, Dobson units (1e-3 cm at 0 °C and 1 atm).
    pub fn ozone(&self) -> f64 {
        self.ozone / 2.686_78e16
    }

    /// Shares of an aerosol that falls to 1/e in `height` km.
    pub fn of_aerosol(height: f64) -> [f64; LAYERS] {
        let below = |km: f64| (1.0 - (-km / height).exp()) / (1.0 - (-(LAYERS as f64) / height).exp());
        std::array::from_fn(|layer| below(layer as f64 + 1.0) - below(layer as f64))
    }
}

/// Rayleigh's cross section of a molecule of dry air, cm², with its King factor: Bodhaine et al., J. Atmos. Oceanic Technol. 16, 1854
/// (1999), by the index of Peck and Reeder (1972) and the factors of Bates (1984); `nm` in vacuum.
pub fn cross_section(nm: f64) -> f64 {
    // Molecules a cm³ at 15 °C and 1 atm, where the index is known.
    const MOLECULES: f64 = 2.546_899e19;
    let inverse2 = (1e3 / nm).powi(2);
    let excess = 1e-8 * (8060.51 + 2_480_990.0 / (132.274 - inverse2) + 17_455.7 / (39.329_57 - inverse2));
    let n2 = (1.0 + excess).powi(2);
    let nitrogen = 1.034 + 3.17e-4 * inverse2;
    let oxygen = 1.096 + 1.385e-3 * inverse2 + 1.448e-4 * inverse2 * inverse2;
    // Percent of the volume; argon and carbon dioxide have the factors 1 and 1.15.
    let king = (78.084 * nitrogen + 20.946 * oxygen + 0.934 + 0.036 * 1.15) / (78.084 + 20.946 + 0.934 + 0.036);
    let cm = nm * 1e-7;
    24.0 * PI.powi(3) * (n2 - 1.0).powi(2) / (cm.powi(4) * MOLECULES.powi(2) * (n2 + 2.0).powi(2)) * king
}
