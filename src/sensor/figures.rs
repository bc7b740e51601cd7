//! What a band can tell apart.

use super::detect::Electronics;
use super::radiometry::Optical;

/// Figures of a band, from closed forms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Figures {
    /// Signal of the scene over the noise in time, at the picture's mean.
    pub snr: f64,
    /// Noise-equivalent difference of spectrally flat radiance at the picture's mean, W m⁻² sr⁻¹ nm⁻¹.
    pub nedl: f64,
    /// Noise-equivalent difference of temperature of a black body at the reference temperature, K; `None` where its signal is
    /// below the noise.
    pub netd: Option<f64>,
}

impl Figures {
    /// `mean` is the mean signal of the scene, without that of the optics.
    pub fn new(electronics: &Electronics, band: &Optical, mean: f64) -> Figures {
        let noise = electronics.variance(mean + band.background).sqrt();
        let [signal, slope] = band.black_body;
        let at_reference = electronics.variance(signal + band.background).sqrt();
        Figures {
            snr: mean / noise,
            nedl: noise / band.sensitivity(),
            netd: (signal > at_reference).then(|| at_reference / slope),
        }
    }
}
