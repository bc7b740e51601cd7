//! From the mean signal of a pixel to its count.

use super::noise::{Purpose, Stream};
use crate::scene::{Detector, SensorModel};

/// Where a signal ended.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Clipped {
    /// Pixels whose wells are full; what is too much does not spill into others.
    pub full_wells: u64,
    /// Pixels above and below what the converter counts.
    pub above: u64,
    pub below: u64,
}

impl std::ops::AddAssign for Clipped {
    fn add_assign(&mut self, other: Clipped) {
        self.full_wells += other.full_wells;
        self.above += other.above;
        self.below += other.below;
    }
}

/// The part of a model that knows no wavelength.
#[derive(Debug, Clone)]
pub struct Electronics<'a> {
    pub model: &'a SensorModel,
    /// Of one exposure; fixed patterns have the model's.
    pub seed: u64,
    /// Whether there is noise and fixed patterns at all.
    pub noise: bool,
}

impl Electronics<'_> {
    /// The count of a pixel with this mean signal of light (electrons, or W), background included.
    pub fn count(&self, light: f64, pixel: [u32; 2], band: usize, clipped: &mut Clipped) -> u32 {
        let model = self.model;
        let normal =
            |purpose| if self.noise { Stream::new(model.pattern_seed, purpose, pixel, band).normal() } else { 0.0 };
        let pattern = |size: f64, purpose| if size > 0.0 { size * normal(purpose) } else { 0.0 };
        let light = light * (1.0 + pattern(model.prnu, Purpose::Response));
        let dark = pattern(model.dsnu, Purpose::Dark);
        let mut stream = Stream::new(self.seed, Purpose::Temporal, pixel, band);
        let counts = match model.kind {
            Detector::Photon { integration_time, dark_current, full_well, read_noise, gain, .. } => {
                let mean = light + dark_current * integration_time;
                let mut electrons = if self.noise { stream.poisson(mean) } else { mean };
                if let Some(full) = full_well.filter(|full| electrons >= *full) {
                    electrons = full;
                    clipped.full_wells += 1;
                }
                let read = if self.noise { read_noise * stream.normal() } else { 0.0 };
                (electrons + dark + read) / gain
            }
            Detector::Thermal { responsivity, noise_equivalent_power, .. } => {
                let noise = if self.noise { noise_equivalent_power * stream.normal() } else { 0.0 };
                responsivity * (light + noise) + dark
            }
        };
        let most = f64::from(model.most());
        let counts = (counts + model.offset).round();
        clipped.above += u64::from(counts > most);
        clipped.below += u64::from(counts < 0.0);
        counts.clamp(0.0, most) as u32
    }

    /// Variance in time, in signal units squared, of a pixel with this mean signal of light: shot noise of light and dark current,
    /// reading, rounding. Not what is the same in every exposure.
    pub fn variance(&self, light: f64) -> f64 {
        match self.model.kind {
            Detector::Photon { integration_time, dark_current, read_noise, gain, .. } => {
                light + dark_current * integration_time + read_noise * read_noise + gain * gain / 12.0
            }
            Detector::Thermal { responsivity, noise_equivalent_power, .. } => {
                noise_equivalent_power.powi(2) + 1.0 / (12.0 * responsivity * responsivity)
            }
        }
    }
}
