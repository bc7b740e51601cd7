//! Surfaces that let light through diffusely: what they reflect and transmit is together no more than what arrives.

use std::collections::HashSet;

use super::decode::Item;
use super::material::Reflects;
use super::spectrum::Spectra;
use super::texture::Textures;
use crate::spectral::upsample::smooth_of;
use crate::spectral::{Channels, Curve};

/// f32 texels, and sums.
const ALLOWED: f64 = 1.0 + 1e-6;
/// Wavelengths at which textures are looked at; spectra are at all of their nodes.
const LOOKS: usize = 64;

/// That `parts`, reflectance and transmittance, sum to at most 1 at every wavelength in the channels, texel by texel where both are
/// textures that lie alike. Says of `item` what is wrong; then `None`.
pub fn check(item: &Item, parts: [Reflects; 2], spectra: &Spectra, textures: &Textures) -> Option<()> {
    // Wrong channels are reported elsewhere.
    let Some(channels) = spectra.channels() else { return Some(()) };
    let curves = parts.map(|part| match part {
        Reflects::Spectrum(handle) => Some(spectra.checked_curve(handle)),
        Reflects::Texture(_) => None,
    });
    let nm = wavelengths(channels, &curves);
    let rows = parts.map(|part| Rows::new(part, &nm, spectra, textures));
    let alike = match parts {
        [Reflects::Texture(a), Reflects::Texture(b)] => {
            let (a, b) = (textures.picture(a), textures.picture(b));
            a.size == b.size && a.placement == b.placement
        }
        _ => true,
    };
    let [a, b] = &rows;
    let sums = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + b).collect::<Vec<f64>>();
    let worst = match alike {
        true => {
            let mut seen = HashSet::new();
            let texels = (0..a.len().max(b.len())).filter(|i| seen.insert([a.key(*i), b.key(*i)]));
            texels.map(|i| largest(&sums(&a.at(i), &b.at(i)))).fold((0.0, 0), |x, y| if y.0 > x.0 { y } else { x })
        }
        false => largest(&sums(&a.most(), &b.most())),
    };
    let (sum, at) = worst;
    if sum <= ALLOWED {
        return Some(());
    }
    let nm = nm[at];
    let help = match alike {
        true => "scale them: a surface cannot send on more than it gets",
        false => {
            "scale them, or use pictures of one size that are placed alike, which are compared texel by texel: of others the largest \
             values count"
        }
    };
    item.error_help(
        format!("`reflectance` and `transmittance` must be 1 at most together, but are {sum:.6} at {nm:.1} nm"),
        help,
    );
    None
}

/// The largest value, and where it is.
fn largest(values: &[f64]) -> (f64, usize) {
    values.iter().enumerate().fold((0.0, 0), |most, (i, value)| if *value > most.0 { (*value, i) } else { most })
}

/// Where linear curves can be largest within the channels; some wavelengths where there are textures.
fn wavelengths(channels: &Channels, curves: &[Option<&Curve>; 2]) -> Vec<f64> {
    let ends = channels.bounds.iter().flatten().copied();
    let nodes = curves.iter().flatten().flat_map(|curve| match curve {
        // Either side of a step.
        Curve::Linear { nm, .. } => nm.iter().flat_map(|nm| [nm * (1.0 - 1e-12), *nm, nm * (1.0 + 1e-12)]).collect(),
        _ => Vec::new(),
    });
    let inside = |nm: &f64| channels.bounds.iter().any(|[from, to]| (*from..=*to).contains(nm));
    let mut all: Vec<f64> = ends.chain(nodes.filter(inside)).collect();
    all.sort_by(f64::total_cmp);
    all.dedup();
    if curves.iter().any(Option::is_none) && all.len() > LOOKS {
        all = (0..LOOKS).map(|i| all[i * (all.len() - 1) / (LOOKS - 1)]).collect();
    }
    all
}

/// The values of a spectrum, or of each texel, at some wavelengths.
enum Rows<'t> {
    All(Vec<f64>),
    Colours { texels: &'t [[f32; 3]], nm: &'t [f64] },
    Mixture { texels: &'t [f32], endmembers: Vec<Vec<f64>> },
}

impl<'t> Rows<'t> {
    fn new(part: Reflects, nm: &'t [f64], spectra: &Spectra, textures: &'t Textures) -> Rows<'t> {
        let values = |handle: usize| nm.iter().map(|nm| spectra.checked_curve(handle).eval(*nm)).collect::<Vec<f64>>();
        match part {
            Reflects::Spectrum(handle) => Rows::All(values(handle)),
            Reflects::Texture(handle) => {
                let picture = textures.picture(handle);
                match picture.endmembers {
                    None => Rows::Colours { texels: picture.texels.as_chunks::<3>().0, nm },
                    Some(handles) => {
                        let endmembers = handles.iter().map(|handle| values(*handle)).collect();
                        Rows::Mixture { texels: picture.texels, endmembers }
                    }
                }
            }
        }
    }

    /// How many texels there are.
    fn len(&self) -> usize {
        match self {
            Rows::All(_) => 1,
            Rows::Colours { texels, .. } => texels.len(),
            Rows::Mixture { texels, endmembers } => texels.len() / endmembers.len(),
        }
    }

    fn mixed(texels: &[f32], endmembers: &[Vec<f64>], i: usize) -> Vec<f64> {
        let mut sum = vec![0.0; endmembers[0].len()];
        for (share, values) in texels[i * endmembers.len()..].iter().zip(endmembers) {
            sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += f64::from(*share) * value);
        }
        sum
    }

    fn at(&self, i: usize) -> Vec<f64> {
        match self {
            Rows::All(values) => values.clone(),
            Rows::Colours { texels, nm } => {
                let smooth = smooth_of(&texels[i..=i]);
                nm.iter().map(|nm| smooth[0].eval(*nm)).collect()
            }
            Rows::Mixture { texels, endmembers } => Rows::mixed(texels, endmembers, i),
        }
    }

    /// What tells texels apart.
    fn key(&self, i: usize) -> Vec<u32> {
        match self {
            Rows::All(_) => Vec::new(),
            Rows::Colours { texels, .. } => texels[i].map(f32::to_bits).to_vec(),
            Rows::Mixture { texels, endmembers } => {
                texels[i * endmembers.len()..(i + 1) * endmembers.len()].iter().map(|share| share.to_bits()).collect()
            }
        }
    }

    /// The largest of all texels at each wavelength.
    fn most(&self) -> Vec<f64> {
        let mut seen = HashSet::new();
        let texels = (0..self.len()).filter(|i| seen.insert(self.key(*i)));
        let larger = |most: Vec<f64>, i: usize| most.iter().zip(self.at(i)).map(|(a, b)| a.max(b)).collect();
        texels.fold(self.at(0), larger)
    }
}
