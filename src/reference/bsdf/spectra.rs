//! Spectra at the wavelength samples of one path.

use glam::DVec2;

use super::super::texture::{self, Colours};
use crate::scene::{Reflectance, Scene, SpectrumId, TextureId, TextureKind};

/// Every spectrum of a scene at a path's wavelength samples, filled in when first asked for.
pub struct SpectralValues<'a> {
    scene: &'a Scene,
    /// λ_k in nm.
    wavelength: Vec<f64>,
    values: Vec<Option<Vec<f64>>>,
    /// What each texture is at the vertex of the last [`SpectralValues::look_up`] that named it: \[K\], or one number.
    textured: Vec<Vec<f64>>,
    colours: Colours,
}

impl<'a> SpectralValues<'a> {
    pub fn new(scene: &'a Scene) -> Self {
        SpectralValues {
            scene,
            wavelength: vec![0.0; scene.channels.len()],
            values: vec![None; scene.spectra.len()],
            textured: vec![Vec::new(); scene.textures.len()],
            colours: Colours::default(),
        }
    }

    /// Goes over to wavelength coordinate `mu` (Eq. 4 of Hoarau et al. 2018: one for all channels).
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

    /// Of channel `k`, in nm.
    pub fn wavelength(&self, k: usize) -> f64 {
        self.wavelength[k]
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

    /// Looks `textures` up at a vertex.
    pub fn look_up(&mut self, textures: &[TextureId], uv: DVec2) {
        let scene = self.scene;
        for &id in textures {
            let texture = &scene.textures[id];
            let mut values = vec![0.0; self.wavelength.len()];
            match &texture.kind {
                TextureKind::Colour => {
                    let wavelength = &self.wavelength;
                    self.colours.at(texture, uv, |spectrum, weight| {
                        for (value, nm) in values.iter_mut().zip(wavelength) {
                            *value += weight * spectrum.eval(*nm);
                        }
                    });
                }
                TextureKind::Mixture(endmembers) => {
                    for (channel, spectrum) in endmembers.iter().enumerate() {
                        let abundance = texture::channel(texture, uv, channel);
                        for (value, of_spectrum) in values.iter_mut().zip(self.get(*spectrum)) {
                            *value += abundance * of_spectrum;
                        }
                    }
                }
                TextureKind::Light(daylight) => {
                    let wavelength = &self.wavelength;
                    self.colours.of_light(texture, uv, |tint, weight| {
                        for (value, nm) in values.iter_mut().zip(wavelength) {
                            *value += weight * tint.eval(*nm);
                        }
                    });
                    values.iter_mut().zip(self.get(*daylight)).for_each(|(value, white)| *value *= white);
                }
                TextureKind::Number => values = vec![texture::channel(texture, uv, 0)],
            }
            self.textured[id] = values;
        }
    }

    /// A reflectance that has been filled in or looked up, in channel `k`.
    pub fn reflectance(&self, reflectance: Reflectance, k: usize) -> f64 {
        match reflectance {
            Reflectance::Spectrum(spectrum) => self.value(spectrum, k),
            Reflectance::Texture(texture) => self.textured[texture][k],
        }
    }

    /// A spectrum of a texture that has been looked up, in channel `k`.
    pub fn textured(&self, texture: TextureId, k: usize) -> f64 {
        self.textured[texture][k]
    }

    /// The number of a texture that has been looked up.
    pub fn number(&self, texture: TextureId) -> f64 {
        self.textured[texture][0]
    }

    /// The value of a spectrum that has been filled in, in channel `k`.
    pub fn value(&self, spectrum: SpectrumId, k: usize) -> f64 {
        self.values[spectrum].as_ref().expect("a material's spectra are filled in before it scatters")[k]
    }
}
