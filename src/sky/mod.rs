//! A clear sky as an ordinary scene: layers of air and haze over level ground under the sun, and a camera that looks everywhere.
//!
//! The atmosphere is plane: layers of a kilometre, whose matter is that of the US standard atmosphere (AFGL-TR-86-0110). Molecules scatter
//! by Rayleigh's law (Bodhaine et al. 1999), aerosols by Henyey and Greenstein's with the coefficients of Shettle and Fenn (1979), and gases
//! absorb as LOWTRAN7 has them ([`gas`]). Where channels reach beyond [`SUNNY`] the layers have temperatures and send heat ([`thermal`]), below two
//! kilometres in layers of a hundred metres. Nothing is rendered here: [`Atmosphere::write_scene`] makes the scene, [`Irradiance`] sums up what
//! came of it.

mod air;
mod gas;
mod irradiance;
mod particle;
mod scene;
mod thermal;

use std::fmt;

use crate::{Error, Result};

pub use gas::{STANDARD_OZONE, STANDARD_WATER};
pub use irradiance::Irradiance;
pub use scene::{FOLDER, Parts};

pub use air::ground_temperature;

use air::Profile;

/// Wavelengths that the tables of matter cover, nm.
pub const RANGE: [f64; 2] = [380.0, 20_000.0];
/// Up to this wavelength, nm, the sky is sunlight: what it sends as heat is left out where no channel reaches further.
pub const SUNNY: f64 = 2500.0;
/// Elevations of the sun, degrees. Below them light comes round the earth, which is plane here.
pub const ELEVATIONS: [f64; 2] = [5.0, 90.0];
/// Below this elevation a plane atmosphere's air mass is 1 % or more above the round one's (Kasten and Young 1989).
const LOW_SUN: f64 = 16.0;

/// A kind of aerosol, as Shettle and Fenn (AFGL-TR-79-0214) have it at 70 % of relative humidity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Aerosol {
    Rural,
    Urban,
    Maritime,
    Tropospheric,
}

impl Aerosol {
    /// In the order of the columns of their table.
    pub const ALL: [Aerosol; 4] = [Aerosol::Rural, Aerosol::Urban, Aerosol::Maritime, Aerosol::Tropospheric];

    pub fn name(self) -> &'static str {
        match self {
            Aerosol::Rural => "rural",
            Aerosol::Urban => "urban",
            Aerosol::Maritime => "maritime",
            Aerosol::Tropospheric => "tropospheric",
        }
    }
}

/// What the ground reflects, the same in all directions.
#[derive(Debug, Clone, PartialEq)]
pub enum Albedo {
    /// 0.2 in sunlight, falling to 0.03 from 2,500 to 4,500 nm: soil and plants are nearly black to heat.
    Land,
    Constant(f64),
    /// A spectrum's file, with its whole path.
    File(std::path::PathBuf),
}

/// Where the sun stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sun {
    /// Above the horizon, degrees.
    pub elevation: f64,
    /// Degrees from north over east.
    pub azimuth: f64,
}

/// What decides a sky.
#[derive(Debug, Clone, PartialEq)]
pub struct Atmosphere {
    /// `None` at night.
    pub sun: Option<Sun>,
    pub aerosol: Aerosol,
    /// Vertical optical depth of the aerosol at 550 nm.
    pub aerosol_depth: f64,
    /// Height in which the aerosol falls to 1/e, km.
    pub aerosol_height: f64,
    /// Column of ozone, Dobson units.
    pub ozone: f64,
    /// Column of water vapour, cm of liquid (the same number as g/cm²).
    pub water: f64,
    pub albedo: Albedo,
    /// Of the ground, K.
    pub ground_temperature: f64,
}

/// Vertical optical depths of the whole atmosphere at a wavelength.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Depths {
    pub molecules: f64,
    pub aerosol_scattering: f64,
    pub aerosol_absorption: f64,
    pub water: f64,
    pub ozone: f64,
    pub mixed: f64,
}

impl Depths {
    pub fn sum(&self) -> f64 {
        let Depths { molecules, aerosol_scattering, aerosol_absorption, water, ozone, mixed } = self;
        molecules + aerosol_scattering + aerosol_absorption + water + ozone + mixed
    }
}

impl Atmosphere {
    /// # Errors
    /// [`Error::Usage`]: the number that no clear sky has, and what it may be.
    pub fn check(&self) -> Result<()> {
        let number = |name: &str, value: f64, [least, most]: [f64; 2], unit: &str| {
            if (least..=most).contains(&value) {
                return Ok(());
            }
            Err(Error::Usage(format!("{name} is {value}{unit}, but it must be from {least} to {most}{unit}")))
        };
        if let Some(Sun { elevation, azimuth }) = self.sun {
            if elevation < ELEVATIONS[0] {
                return Err(Error::Usage(format!(
                    "--sun-elevation is {elevation}, but the atmosphere is plane here, which has no dusk: give 5 to 90 degrees"
                )));
            }
            number("--sun-elevation", elevation, ELEVATIONS, " degrees")?;
            number("--sun-azimuth", azimuth, [-360.0, 360.0], " degrees")?;
        }
        number("--aerosol", self.aerosol_depth, [0.0, 5.0], "")?;
        number("--aerosol-height", self.aerosol_height, [0.1, 10.0], " km")?;
        number("--ozone", self.ozone, [0.0, 1000.0], " Dobson units")?;
        // SPCTRAL2, SMARTS and others have it in atm-cm.
        if self.ozone > 0.0 && self.ozone < 1.0 {
            return Err(Error::Usage(format!(
                "--ozone is {} Dobson units, which no sky has: that many atm-cm are {} (or write 0 for none)",
                self.ozone,
                (self.ozone * 1e6).round() / 1e3
            )));
        }
        number("--water", self.water, [0.0, 10.0], " cm")?;
        number("--ground-temperature", self.ground_temperature, [150.0, 400.0], " K")?;
        match self.albedo {
            Albedo::Constant(albedo) => number("--albedo", albedo, [0.0, 1.0], ""),
            Albedo::Land | Albedo::File(_) => Ok(()),
        }
    }

    /// What to know of this sky although it can be made.
    pub fn warnings(&self) -> Vec<String> {
        let Some(Sun { elevation: h, .. }) = self.sun.filter(|sun| sun.elevation < LOW_SUN) else { return Vec::new() };
        let round = 1.0 / (h.to_radians().sin() + 0.50572 * (h + 6.07995).powf(-1.6364));
        let more = 100.0 * (self.air_mass() / round - 1.0);
        vec![format!(
            "the sun is low: a plane atmosphere puts {more:.1} % more matter before it than the round one of the earth"
        )]
    }

    /// Ways through the atmosphere to the sun over the vertical one; at night that of light from everywhere.
    pub fn air_mass(&self) -> f64 {
        self.sun.map_or(thermal::DIFFUSE, |sun| 1.0 / sun.elevation.to_radians().sin())
    }

    /// Depths at a wavelength (nm, vacuum) within [`RANGE`]; those of gases are what they are for sunlight: [`gas`], [`thermal`].
    pub fn depths(&self, nm: f64) -> Depths {
        let [extinction, absorption, _] = particle::of(self.aerosol, nm).map(|value| value * self.aerosol_depth);
        let [water, ozone, mixed] = if nm <= SUNNY {
            gas::depths(nm, self.water, self.ozone, self.air_mass())
        } else {
            let [lines, own, foreign, ozone, bands, continua] =
                thermal::depths(nm, self.water, self.ozone, self.air_mass());
            [lines + own + foreign, ozone, bands + continua]
        };
        Depths {
            molecules: Profile::standard().molecules() * air::cross_section(nm),
            aerosol_scattering: extinction - absorption,
            aerosol_absorption: absorption,
            water,
            ozone,
            mixed,
        }
    }

    /// Share of the sun's light that arrives on a plane that faces it.
    pub fn transmittance(&self, nm: f64) -> f64 {
        (-self.air_mass() * self.depths(nm).sum()).exp()
    }

    /// Mean cosine of what the aerosol scatters.
    pub fn asymmetry(&self, nm: f64) -> f64 {
        particle::of(self.aerosol, nm)[2]
    }
}

impl fmt::Display for Aerosol {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.name())
    }
}
