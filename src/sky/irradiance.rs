//! What a sky that was rendered sends to level ground.

use std::f64::consts::PI;
use std::fmt::Write as _;

use super::{Atmosphere, Parts};
use crate::cube::Cube;
use crate::spectral::{Channels, Curve, Outside};
use crate::{Error, Result};

/// Spectral irradiance at the ground in every channel, W m⁻² nm⁻¹: means over the channels, as the cube's.
pub struct Irradiance {
    channels: Channels,
    /// Of the sun, on a plane that faces it.
    pub direct_normal: Vec<f64>,
    /// Of the sun, on level ground.
    pub direct: Vec<f64>,
    /// Of the sky, on level ground.
    pub diffuse: Vec<f64>,
}

impl Irradiance {
    /// Sums up the upper half of `cube`, a whole map of all directions of [`Atmosphere::write_scene`]'s scene.
    ///
    /// # Errors
    /// [`Error::Storage`] where the cube cannot be read or lacks tiles.
    pub fn of(atmosphere: &Atmosphere, parts: Parts, cube: &Cube) -> Result<Irradiance> {
        let channels = cube.channels().clone();
        let [width, height] = cube.header().size;
        let mut diffuse = vec![0.0; channels.len()];
        for tile in 0..cube.grid().count() {
            let rect = cube.grid().rect(tile);
            if 2 * rect.y0 >= height {
                continue;
            }
            let Some(chunk) = cube.chunk(tile)? else {
                return Err(Error::storage(cube.path(), format!("tile {tile} has no samples yet")));
            };
            for y in rect.y0..rect.y1.min(height.div_ceil(2)) {
                // The integral of cos θ sin θ over the row's angles from the zenith, ended by the horizon.
                let sin2 = |row: u32| (PI * f64::from(row) / f64::from(height)).min(PI / 2.0).sin().powi(2);
                let weight = 2.0 * PI / f64::from(width) * (sin2(y + 1) - sin2(y)) / 2.0;
                for x in rect.x0..rect.x1 {
                    let spectrum = chunk.spectrum(x, y);
                    diffuse.iter_mut().zip(spectrum).for_each(|(sum, &value)| *sum += weight * f64::from(value));
                }
            }
        }
        let (nm, value) = atmosphere.direct(parts).into_iter().unzip();
        let curve = Curve::Linear { nm, value, outside: Outside::Zero };
        let direct_normal: Vec<f64> = (0..channels.len()).map(|k| channels.mean_of(k, &curve)).collect();
        let cosine = atmosphere.sun.map_or(0.0, |sun| sun.elevation.to_radians().sin());
        let direct = direct_normal.iter().map(|value| value * cosine).collect();
        Ok(Irradiance { channels, direct_normal, direct, diffuse })
    }

    /// W m⁻² over all channels, of one of the spectra here.
    pub fn total(&self, spectrum: &[f64]) -> f64 {
        spectrum.iter().enumerate().map(|(k, value)| value * self.channels.integral(k)).sum()
    }

    /// A line a channel, as CSV. The first line is `mark`.
    pub fn csv(&self, mark: &str) -> String {
        let mut text = format!(
            "{mark}\nwavelength_nm,direct normal (W/m2/nm),direct horizontal (W/m2/nm),diffuse horizontal (W/m2/nm),global horizontal (W/m2/nm)\n"
        );
        for (k, diffuse) in self.diffuse.iter().enumerate() {
            let [normal, direct] = [self.direct_normal[k], self.direct[k]];
            let nm = self.channels.centre(k);
            writeln!(text, "{nm},{normal:.6e},{direct:.6e},{diffuse:.6e},{:.6e}", direct + diffuse).expect("memory");
        }
        text
    }
}
