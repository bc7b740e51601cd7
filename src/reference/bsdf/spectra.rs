//! Spectra at the wavelength samples of one path.

use crate::scene::{Scene, SpectrumId};

/// Every spectrum of a scene at a path's wavelength samples, filled in when first asked for.
pub struct SpectralValues<'a> {
    scene: &'a Scene,
    /// λ_k in nm.
    wavelength: Vec<f64>,
    values: Vec<Option<Vec<f64>>>,
}

impl<'a> SpectralValues<'a> {
    pub fn new(scene: &'a Scene) -> Self {
        SpectralValues { scene, wavelength: vec![0.0; scene.channels.len()], values: vec![None; scene.spectra.len()] }
    }

    /// Goes over to wavelength coordinate `mu` (Eq. 4 of the method: one for all channels).
    pub fn begin(&mut self, mu: f64) {
        for (k, wavelength) in self.wavelength.iter_mut().enumerate() {
            *wavelength = self.scene.channels.wavelength(k, mu);
        }
        for (values, spectrum) in self.values.iter_mut().zip(&self.scene.spectra) {
            if !spectrum.curve.is_constant() {
                *values = None;
            }
        }
    }

    /// What the response of channel `k` makes of its wavelength: R(λ_k) over its mean on the support, 1 without one.
    pub fn response(&self, k: usize) -> f64 {
        let channels = &self.scene.channels;
        channels
            .responses
            .get(k)
            .map_or(1.0, |response| response.curve().eval(self.wavelength[k]) * channels.width(k) / response.integral())
    }

    /// λ_k in nm.
    pub fn wavelengths(&self) -> &[f64] {
        &self.wavelength
    }

    pub fn fill(&mut self, spectra: &[SpectrumId]) {
        for &spectrum in spectra {
            self.get(spectrum);
        }
    }

    /// \[K\].
    pub fn get(&mut self, spectrum: SpectrumId) -> &[f64] {
        self.values[spectrum].get_or_insert_with(|| {
            let curve = &self.scene.spectra[spectrum].curve;
            self.wavelength.iter().map(|&nm| curve.eval(nm)).collect()
        })
    }

    /// The value of a spectrum that has been filled in, in channel `k`.
    pub fn value(&self, spectrum: SpectrumId, k: usize) -> f64 {
        self.values[spectrum].as_ref().expect("a material's spectra are filled in before it scatters")[k]
    }
}
