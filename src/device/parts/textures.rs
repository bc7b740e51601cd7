//! Textures as devices get them (`shaders/parts/textures/texture.wgsl`), and bounds of what they reflect.

use std::collections::HashSet;
use std::sync::Arc;

use crate::device::part::{Part, Place, SceneBuffer};
use crate::device::text::module;
use crate::device::words::{NONE, TEXTURE_WORDS};
use crate::scene::{Placement, Scene, SpectrumId, Texture, TextureFilter, TextureId, TextureKind};
use crate::spectral::skylight::{self, Tint};
use crate::spectral::upsample::{self, smooth_of};
use crate::spectral::{Curve, Outside};

/// Words of a texture at the head of [`Textures::words`].
const HEAD: usize = TEXTURE_WORDS as usize;
/// Wavelengths at which the spectra of colours are bounded: they are smooth.
const BOUNDS: usize = 48;

/// Number of a texture, and whether what is missing of it to 1 counts: a factor of a lobe's share.
pub type Share = (usize, bool);

pub const TEXTURES: Part = Part {
    name: "textures",
    used: |scene| scene.surfaces.as_ref().is_some_and(|surfaces| surfaces.textures.is_some()),
    effect: |_| "a record for each spectrum that a texture mixes".into(),
    is_planned: true,
    modules: &[(Place::Generate, module!("parts/textures/texture.wgsl"))],
    defines: |scene, _, defines| {
        let Some((surfaces, textures)) = scene.surfaces.as_ref().and_then(|s| Some((s, s.textures.as_ref()?))) else {
            return;
        };
        let hot = scene.radiators.as_ref().map(|radiators| radiators.features).unwrap_or_default();
        let shares = textures.first_share.is_some();
        defines.set("TEXTURES", true).set("TEXTURED", surfaces.textured || hot.textured || hot.pictures);
        defines.set("KEPT", surfaces.textured_base || hot.textured);
        defines.set("COLOURS", textures.colours).set("MIXTURES", textures.mixtures).set("SHARES", shares);
        defines.set(
            "TEXEL_NUMBERS",
            textures.mixtures || shares || hot.numbers || hot.pictures || surfaces.masks || surfaces.varies(),
        );
        defines.set("PRODUCTS", shares || hot.numbers);
        if let Some(first) = textures.first_share {
            defines.constant("FIRST_SHARE", first);
        }
        if let Some(first) = textures.first_placement {
            defines.set("PLACED", true).constant("FIRST_PLACEMENT", first);
        }
        if let Some(place) = surfaces.visible_place {
            defines.constant("VISIBLE_PLACE", place);
        }
    },
    buffers: |scene| {
        let textures = scene.prepared.surfaces.as_ref().and_then(|surfaces| surfaces.textures.as_ref());
        let buffers = textures.map(|textures| {
            [
                SceneBuffer::new("textures", &textures.words, "the textures of the scene", "smaller ones"),
                SceneBuffer::new("texels", &textures.texels, "the textures of the scene", "smaller ones"),
            ]
        });
        buffers.into_iter().flatten().collect()
    },
    example: Some(|exhibit| exhibit.add_textures()),
    ..Part::NOTHING
};

/// The textures of a scene, flat.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Textures {
    /// For each texture: first number, width, height, channels, place of the spectra of its channels or [`NONE`]; then
    /// those, as positions among the spectra that materials need until [`Textures::name_spectra`]; then the shares.
    pub words: Vec<u32>,
    /// Three coefficients for each texel of colours, of light those and a factor; the numbers of others.
    pub texels: Vec<f32>,
    /// Where the shares of lobes start in `words`, where any lobe has some.
    pub first_share: Option<u32>,
    /// Where ids of spectra stand in `words`.
    ids: Vec<usize>,
    pub colours: bool,
    pub mixtures: bool,
    /// Where the placements of all textures start in `words`, where any is unusual.
    pub first_placement: Option<u32>,
}

impl Textures {
    /// `position` gives the place of a spectrum among those that materials need.
    pub fn new(scene: &Scene, mut position: impl FnMut(SpectrumId) -> u32) -> Textures {
        let mut textures = Textures { words: vec![0; HEAD * scene.textures.len()], ..Textures::default() };
        for (i, texture) in scene.textures.iter().enumerate() {
            // Where the same picture lies otherwise on another surface it is there already.
            let known = |other: &&Texture| Arc::ptr_eq(&other.texels, &texture.texels) && other.kind == texture.kind;
            if let Some(other) = scene.textures[..i].iter().position(|other| known(&other)) {
                textures.words.copy_within(HEAD * other..HEAD * (other + 1), HEAD * i);
                continue;
            }
            let first = textures.texels.len() as u32;
            let mut spectra_at = NONE;
            match &texture.kind {
                TextureKind::Colour => {
                    textures.colours = true;
                    let coefficients = smooth_of(texture.texels.as_chunks::<3>().0);
                    textures.texels.extend(coefficients.iter().flat_map(|smooth| smooth.0.map(|c| c as f32)));
                }
                TextureKind::Mixture(endmembers) => {
                    textures.mixtures = true;
                    spectra_at = textures.words.len() as u32;
                    for spectrum in endmembers {
                        textures.ids.push(textures.words.len());
                        textures.words.push(position(*spectrum));
                    }
                    textures.texels.extend_from_slice(&texture.texels);
                }
                TextureKind::Light(_) => {
                    textures.colours = true;
                    let words = |tint: &Tint| {
                        let [a, b, c] = tint.smooth.0;
                        [a, b, c, tint.scale].map(|v| v as f32)
                    };
                    textures.texels.extend(skylight::tints(&texture.texels).iter().flat_map(words));
                }
                TextureKind::Number => textures.texels.extend_from_slice(&texture.texels),
            }
            let [width, height] = texture.size;
            let head = [first, width, height, texture.channels() as u32, spectra_at];
            textures.words[HEAD * i..HEAD * (i + 1)].copy_from_slice(&head);
        }
        if scene.textures.iter().any(|texture| texture.placement != Placement::default()) {
            textures.first_placement = Some(textures.words.len() as u32);
            for Texture { placement: Placement { filter, scale, offset }, .. } in &scene.textures {
                let numbers = [scale.x, scale.y, offset.x, offset.y].map(|number| (number as f32).to_bits());
                textures.words.extend(numbers);
                textures.words.push(u32::from(*filter == TextureFilter::Nearest));
            }
        }
        textures
    }

    /// Appends the shares of all lobes, if any lobe has some.
    pub fn add_shares(&mut self, of_lobes: &[Vec<Share>]) {
        if of_lobes.iter().all(Vec::is_empty) {
            return;
        }
        let first = self.words.len();
        self.first_share = Some(first as u32);
        self.words.resize(first + of_lobes.len(), 0);
        for (p, shares) in of_lobes.iter().enumerate() {
            self.words[first + p] = self.append_shares(shares);
        }
    }

    /// Appends shares, and gives the word that tells where they are and how many.
    pub fn append_shares(&mut self, shares: &[Share]) -> u32 {
        let at = self.words.len();
        let word = |&(texture, missing): &Share| texture as u32 | u32::from(missing) << 31;
        self.words.extend(shares.iter().map(word));
        (at << 8 | shares.len()) as u32
    }

    /// Replaces positions by the ids that the device's tables gave the spectra.
    pub fn name_spectra(&mut self, id: impl Fn(usize) -> u32) {
        for &at in &self.ids {
            self.words[at] = id(self.words[at] as usize);
        }
    }
}

/// Where a wavelength stands in the visible: t of [`upsample::Smooth`].
pub fn visible_place() -> Curve {
    let ends = [upsample::FIRST_NM, upsample::LAST_NM].map(f64::from);
    Curve::Linear { nm: ends.to_vec(), value: vec![0.0, 1.0], outside: Outside::Hold }
}

/// The mean over the texels of one number.
fn mean_number(texture: &Texture) -> f64 {
    texture.texels.iter().map(|v| f64::from(*v)).sum::<f64>() / texture.texels.len() as f64
}

/// What blend textures leave of something, on the mean.
pub fn mean_share(scene: &Scene, shares: &[Share]) -> f64 {
    let mean = |&(texture, missing): &Share| {
        let mean = mean_number(&scene.textures[texture]);
        if missing { 1.0 - mean } else { mean }
    };
    shares.iter().map(mean).product()
}

/// Numbers of a texture above 0 that stand for all of them, each with its share of the texels: the largest of some of equally
/// many.
pub fn typical_numbers(texture: &Texture) -> Vec<(f64, f64)> {
    const CLASSES: usize = 8;
    let mut all: Vec<f32> = texture.texels.iter().copied().filter(|v| *v > 0.0).collect();
    all.sort_by(f32::total_cmp);
    let class = |class: &[f32]| {
        (class.len() as f64 / texture.texels.len() as f64, f64::from(*class.last().expect("chunks are not empty")))
    };
    all.chunks(all.len().div_ceil(CLASSES).max(1)).map(class).collect()
}

/// The mean over the texels of a texture's reflectance; of colours the spectrum of the mean.
pub fn mean_reflectance(scene: &Scene, texture: TextureId) -> Curve {
    let texture = &scene.textures[texture];
    let channels = texture.channels();
    let texels = (texture.texels.len() / channels) as f64;
    let mean = |channel: usize| {
        texture.texels.iter().skip(channel).step_by(channels).map(|v| f64::from(*v)).sum::<f64>() / texels
    };
    let means: Vec<f64> = (0..channels).map(mean).collect();
    match &texture.kind {
        TextureKind::Mixture(endmembers) => {
            let curves: Vec<&Curve> = endmembers.iter().map(|&id| &scene.spectra[id].curve).collect();
            Curve::derived(&curves, &scene.channels, |v| v.iter().zip(&means).map(|(v, mean)| v * mean).sum())
        }
        TextureKind::Colour => upsample::reflectance([means[0], means[1], means[2]]),
        TextureKind::Number | TextureKind::Light(_) => unreachable!("neither is a reflectance"),
    }
}

/// What no texel reflects more than, for each channel of the scene.
pub fn bound(scene: &Scene, texture: &Texture) -> Vec<f64> {
    let bounds = &scene.channels.bounds;
    match &texture.kind {
        TextureKind::Number | TextureKind::Light(_) => vec![1.0; bounds.len()],
        TextureKind::Mixture(endmembers) => {
            // Of those that occur.
            let occurs =
                |channel: usize| texture.texels.iter().skip(channel).step_by(endmembers.len()).any(|a| *a > 0.0);
            let curves: Vec<&Curve> = (0..endmembers.len())
                .filter(|channel| occurs(*channel))
                .map(|channel| &scene.spectra[endmembers[channel]].curve)
                .collect();
            let largest = |b: &[f64; 2]| curves.iter().map(|curve| curve.max(b[0], b[1])).fold(0.0, f64::max);
            bounds.iter().map(largest).collect()
        }
        TextureKind::Colour => {
            let mut seen = HashSet::new();
            let mut distinct = texture.texels.as_chunks::<3>().0.to_vec();
            distinct.retain(|rgb| seen.insert(rgb.map(f32::to_bits)));
            let spectra = smooth_of(&distinct);
            let [first, last] = [upsample::FIRST_NM, upsample::LAST_NM].map(f64::from);
            let step = (last - first) / (BOUNDS - 1) as f64;
            let at = |i: usize| spectra.iter().map(|s| s.eval(first + step * i as f64)).fold(0.0, f64::max);
            let nodes: Vec<f64> = (0..BOUNDS).map(at).collect();
            let place = |nm: f64| ((nm - first) / step).clamp(0.0, (BOUNDS - 1) as f64);
            let largest = |b: &[f64; 2]| {
                let (from, to) = (place(b[0]).floor() as usize, place(b[1]).ceil() as usize);
                nodes[from..=to].iter().fold(0.0, |a: f64, b| a.max(*b))
            };
            bounds.iter().map(largest).collect()
        }
    }
}
