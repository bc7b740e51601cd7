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

/// What a step of the standard atmosphere has.
#[derive(Debug, Clone, Copy)]
pub struct Step {
    /// Its middle above the ground, km.
    pub km: f64,
    /// Over that at the ground.
    pub pressure: f64,
    /// K.
    pub temperature: f64,
    /// Molecules above a cm² of its floor, and parts per million of them that are water and ozone.
    pub molecules: f64,
    pub water_ppm: f64,
    pub ozone_ppm: f64,
}

/// The standard atmosphere from the ground to its end.
pub fn steps() -> &'static [Step] {
    static STEPS: OnceLock<Vec<Step>> = OnceLock::new();
    STEPS.get_or_init(|| {
        let levels: Vec<[f64; 6]> = columns::<6>(STANDARD).collect();
        // Everything but the temperature falls exponentially between levels, and so do products nearly.
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
        let step = |i: usize| {
            let km = (i as f64 + 0.5) * STEP;
            let [_, pressure, temperature, number, water_ppm, ozone_ppm] = at(km);
            let molecules = number * STEP * 1e5;
            Step { km, pressure: pressure / levels[0][1], temperature, molecules, water_ppm, ozone_ppm }
        };
        (0..(top / STEP).round() as usize).map(step).collect()
    })
}

/// The temperature of the air at the ground, K.
pub fn ground_temperature() -> f64 {
    columns::<6>(STANDARD).next().expect("a level")[2]
}

/// Amounts by which absorption of sunlight grows: of water, and of the gases that are mixed evenly.
pub fn weighed_water(step: &Step) -> f64 {
    step.molecules * step.water_ppm * step.pressure.powf(WATER_POWER)
}

pub fn weighed_air(step: &Step) -> f64 {
    step.molecules * step.pressure.powf(MIXED_POWER)
}

/// Heights between layers that ascend from the ground, km.
pub struct Layers(pub Vec<f64>);

impl Layers {
    /// Shares of a column in each layer, where the column up to a height grows with the amount of matter there as amount^`exponent`. What is
    /// above the last layer is added to it. Together they are 1 where the layers begin at the ground.
    pub fn shares(&self, amount: impl Fn(&Step) -> f64, exponent: f64) -> Vec<f64> {
        let mut sum = 0.0;
        // Where steps end, and how much is below.
        let below: Vec<(f64, f64)> = steps()
            .iter()
            .map(|step| {
                sum += amount(step);
                (step.km + STEP / 2.0, sum)
            })
            .collect();
        let up_to = |km: f64| {
            let done = below.partition_point(|(end, _)| *end <= km + 1e-9);
            if done == 0 { 0.0 } else { (below[done - 1].1 / sum).powf(exponent) }
        };
        self.between(|km, is_top| if is_top { 1.0 } else { up_to(km) })
    }

    /// Shares of what falls to 1/e in `height` km, all of it below 50 km.
    pub fn of_aerosol(&self, height: f64) -> Vec<f64> {
        let up_to = |km: f64| (1.0 - (-km / height).exp()) / (1.0 - (-(LAYERS as f64) / height).exp());
        self.between(|km, _| up_to(km))
    }

    /// Mean temperatures, weighed by molecules, K.
    pub fn temperatures(&self) -> Vec<f64> {
        let within = |range: &[f64]| {
            let steps = steps().iter().filter(|step| step.km > range[0] && step.km < range[1]);
            let (sum, molecules) = steps
                .fold((0.0, 0.0), |(sum, all), step| (sum + step.molecules * step.temperature, all + step.molecules));
            sum / molecules
        };
        self.0.windows(2).map(within).collect()
    }

    /// Differences of what is below a height, of which the last may be the top of all.
    fn between(&self, up_to: impl Fn(f64, bool) -> f64) -> Vec<f64> {
        let is_top = |i: usize| i + 1 == self.0.len() && self.0[i] >= LAYERS as f64;
        let below: Vec<f64> = self.0.iter().enumerate().map(|(i, km)| up_to(*km, is_top(i))).collect();
        below.windows(2).map(|pair| pair[1] - pair[0]).collect()
    }
}

/// The powers of pressure that band models weigh amounts of gas by: water's and the mixed gases', for which LOWTRAN7's differ by band,
/// from 0.6 to 1.0.
const WATER_POWER: f64 = 0.9;
const MIXED_POWER: f64 = 0.75;

/// The columns of the standard atmosphere.
pub struct Profile {
    molecules: f64,
    water: f64,
    ozone: f64,
}

impl Profile {
    /// The US standard atmosphere.
    pub fn standard() -> &'static Profile {
        static PROFILE: OnceLock<Profile> = OnceLock::new();
        PROFILE.get_or_init(|| {
            let sum = |amount: fn(&Step) -> f64| steps().iter().map(amount).sum();
            Profile {
                molecules: sum(|step| step.molecules),
                water: sum(|step| step.molecules * step.water_ppm * 1e-6),
                ozone: sum(|step| step.molecules * step.ozone_ppm * 1e-6),
            }
        })
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
