//! Textures: what pictures say about a surface, checked for what they are to describe.

use std::collections::HashMap;
use std::path::PathBuf;
use std::rc::Rc;
use std::sync::Arc;

use glam::DVec2;

use super::arrays::Data;
use super::decode::{Fields, Item, list};
use super::keys;
use super::spectrum::{self, Quantity, Spectra, report_in_file};
use super::tree::Value;
use super::{Placement, SMOOTH, Texture, TextureFilter, TextureId, TextureKind};
use crate::format::image::{self, Format, Image, Plane, Rgb};
use crate::format::noise::{self, Range};
use crate::format::primaries::{self, White};
use crate::format::table::shown;
use crate::format::unit;
use crate::spectral::{Curve, upsample};

/// Spectra that one texture may mix: each costs a record at every vertex.
const MAX_ENDMEMBERS: usize = 32;
/// What the shares of a surface may sum to by noise; they are scaled to 1.
const MOST_ABUNDANT: f64 = 1.01;
/// Sums beyond this are more than the last digits of f32.
const NOTICEABLE: f64 = 1e-6;

/// The most that coordinates are scaled and moved by: f32 still tells a thousandth of the picture there.
const FARTHEST: f64 = 1e4;

/// The most radiance of a texel.
const BRIGHTEST: f64 = 1e30;

/// A checked texture; [`Textures::take`] makes it part of the scene.
pub type Handle = usize;

/// What a texture of single numbers describes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Number {
    /// A share, in [0, 1].
    Weight,
    /// Kelvin, not negative; no PNG holds them.
    Temperature,
    /// GGX's α, in [0, 1]; below [`SMOOTH`] it counts as that.
    Roughness,
}

#[derive(PartialEq)]
enum Use {
    Colour,
    /// Of these spectra.
    Mixture(Vec<spectrum::Handle>),
    Number(Number),
    /// Of a lamp: colours, and how much brighter it is.
    Light(f64),
    /// Of these lamps.
    Lamps(Vec<spectrum::Handle>, f64),
}

struct Checked {
    path: PathBuf,
    kind: Use,
    placement: Placement,
    size: [u32; 2],
    texels: Arc<[f32]>,
    warnings: Vec<String>,
    taken: Option<TextureId>,
}

/// A texture of colours, or of shares of spectra.
pub struct Picture<'t> {
    pub endmembers: Option<&'t [spectrum::Handle]>,
    pub placement: Placement,
    pub size: [u32; 2],
    /// \[y\]\[x\]\[channel\].
    pub texels: &'t [f32],
}

/// All textures of a scene; a file is read once.
#[derive(Default)]
pub struct Textures {
    /// `None` where the file is wrong, which has been said.
    files: HashMap<PathBuf, Option<Rc<Image>>>,
    checked: Vec<Checked>,
    /// In the order of their first use.
    scene: Vec<Texture>,
}

/// Whether `item` is a table that names a texture, or has keys that only textures have.
pub fn is_texture(item: &Item) -> bool {
    const OWN: [&str; 5] = ["texture", "endmembers", "filter", "offset", "strength"];
    let Value::Table(entries) = &item.node.value else { return false };
    entries.iter().any(|entry| OWN.contains(&entry.key.as_str()))
}

impl Textures {
    /// The reflectance or transmittance that `item` spells: `{ texture, endmembers }`, a mixture of spectra, or `{ texture }`, colours.
    pub fn share_of_light<'a>(
        &mut self,
        item: &Item<'a>,
        quantity: Quantity,
        spectra: &mut Spectra<'a>,
    ) -> Option<Handle> {
        let fields = item.table(&keys::TEXTURE)?;
        let file = fields.require("texture", "texture = \"abundance.exr\"");
        let endmembers = match fields.get("endmembers") {
            None => None,
            Some(list) => Some((resolve_endmembers(&list, quantity, spectra)?, list)),
        };
        let (file, placement) = (file?, placement(&fields)?);
        match endmembers {
            None => self.add(&file, Use::Colour, placement, |image, path| colours(&file, image, path, spectra)),
            Some((handles, names)) => {
                let count = handles.len();
                self.add(&file, Use::Mixture(handles), placement, |image, path| {
                    abundances(&file, &names, count, image, path)
                })
            }
        }
    }

    /// The radiance over a surface that `item` spells: `{ texture, endmembers }`, so much of each of some lamps, or `{ texture }`,
    /// colours. And what it is on the whole.
    pub fn light<'a>(&mut self, item: &Item<'a>, spectra: &mut Spectra<'a>) -> Option<(Handle, spectrum::Handle)> {
        let fields = item.table(&keys::TEXTURE_OF_LIGHT)?;
        let file = fields.require("texture", "texture = \"screen.png\"");
        let endmembers = match fields.get("endmembers") {
            None => None,
            Some(list) => Some((resolve_endmembers(&list, Quantity::Radiance, spectra)?, list)),
        };
        let strength = fields.get("strength").map_or(Some(1.0), |item| {
            item.number_where(|strength| (0.0..=BRIGHTEST).contains(&strength), "a factor in [0, 1e30]")
        });
        let (file, placement, strength) = (file?, placement(&fields)?, strength?);
        let handle = match endmembers {
            None => {
                let kind = Use::Light(strength);
                self.add(&file, kind, placement, |image, path| light(&file, image, path, strength))?
            }
            Some((handles, names)) => {
                let kind = Use::Lamps(handles, strength);
                self.add(&file, kind, placement, |image, path| amounts(&file, &names, image, path, strength))?
            }
        };
        let checked = &self.checked[handle];
        let channels = match &checked.kind {
            Use::Lamps(handles, _) => handles.len(),
            _ => 3,
        };
        let texels = (checked.texels.len() / channels) as f64;
        let mean = |channel: usize| {
            checked.texels.iter().skip(channel).step_by(channels).map(|v| f64::from(*v)).sum::<f64>() / texels
        };
        let means: Vec<f64> = (0..channels).map(mean).collect();
        let curve = match (&checked.kind, spectra.channels()) {
            (Use::Lamps(handles, _), Some(channels)) => {
                let curves: Vec<&Curve> = handles.iter().map(|handle| spectra.checked_curve(*handle)).collect();
                let sum = |_: f64, v: &[f64]| v.iter().zip(&means).map(|(v, mean)| v * mean).sum();
                Curve::derived_by_stretch(&curves, channels, sum)
            }
            // Wrong channels are reported elsewhere.
            (Use::Lamps(..), None) => Curve::Constant(1.0),
            _ => upsample::emission([means[0], means[1], means[2]]),
        };
        Some((handle, spectra.add(&format!("the mean of {}", file.source()?.0), curve)))
    }

    /// The numbers over a surface that `item`, `{ texture }`, spells.
    pub fn number(&mut self, item: &Item, number: Number) -> Option<Handle> {
        let fields = item.table(&keys::TEXTURE_OF_NUMBERS)?;
        let file = fields.require("texture", "texture = \"mask.png\"");
        let placement = placement(&fields);
        let file = file?;
        self.add(&file, Use::Number(number), placement?, |image, path| numbers(&file, number, image, path))
    }

    /// A checked texture of colours or mixtures, as it is.
    pub fn picture(&self, handle: Handle) -> Picture<'_> {
        let Checked { kind, placement, size, texels, .. } = &self.checked[handle];
        let endmembers = match kind {
            Use::Mixture(endmembers) => Some(&endmembers[..]),
            Use::Colour => None,
            Use::Number(_) | Use::Light(_) | Use::Lamps(..) => unreachable!("neither is a reflectance"),
        };
        Picture { endmembers, placement: *placement, size: *size, texels }
    }

    /// The index of a checked texture in the scene. Equal ones share one.
    pub fn take(&mut self, handle: Handle, spectra: &mut Spectra) -> TextureId {
        let checked = &mut self.checked[handle];
        if let Some(id) = checked.taken {
            return id;
        }
        checked.warnings.drain(..).for_each(|warning| spectra.warn(warning));
        let kind = match &checked.kind {
            Use::Colour => TextureKind::Colour,
            Use::Mixture(handles) => TextureKind::Mixture(handles.iter().map(|handle| spectra.take(*handle)).collect()),
            Use::Lamps(handles, _) => {
                TextureKind::Mixture(handles.iter().map(|handle| spectra.take(*handle)).collect())
            }
            Use::Light(_) => {
                TextureKind::Light(spectra.curve(&format!("D65 of {}", checked.path.display()), upsample::daylight()))
            }
            Use::Number(_) => TextureKind::Number,
        };
        let (name, texels) = (checked.path.display().to_string(), Arc::clone(&checked.texels));
        let texture = Texture { name, size: checked.size, kind, texels, placement: checked.placement };
        let id = self.scene.iter().position(|same| *same == texture).unwrap_or_else(|| {
            self.scene.push(texture);
            self.scene.len() - 1
        });
        checked.taken = Some(id);
        id
    }

    /// The textures in use.
    pub fn finish(self) -> Vec<Texture> {
        self.scene
    }

    /// The texture of the picture that `file` names, of which `decode` makes texels and warnings.
    fn add(
        &mut self,
        file: &Item,
        kind: Use,
        placement: Placement,
        decode: impl FnOnce(&Image, &str) -> Option<(Vec<f32>, Vec<String>)>,
    ) -> Option<Handle> {
        let (name, path) = file.source()?;
        let image = match self.files.get(&path) {
            Some(known) => known.clone(),
            None => {
                let read = file.data().map_or_else(|| image::read(&path), Data::image);
                let read = read.map_err(|problem| report_in_file(file, *problem)).ok().map(Rc::new);
                self.files.insert(path.clone(), read.clone());
                read
            }
        }?;
        if let Some(units) = image.units.as_deref().filter(|_| kind != Use::Number(Number::Temperature))
            && unit::parse(units).is_none_or(|measure| !measure.is_number() || measure.factor != 1.0)
        {
            file.error_help(
                format!("{name} gives its numbers in `{}`, and is to have numbers without a unit", shown(units)),
                "write them so, and remove the attribute",
            );
            return None;
        }
        let known = |known: &&Checked| known.path == path && known.kind == kind;
        if let Some(same) = self.checked.iter().position(|other| known(&other) && other.placement == placement) {
            return Some(same);
        }
        // Another placement of the same picture says again what it warns of only if that is left out.
        let (texels, warnings) = match self.checked.iter().find(known) {
            Some(other) => (Arc::clone(&other.texels), other.warnings.clone()),
            None => decode(&image, name).map(|(texels, warnings)| (texels.into(), warnings))?,
        };
        self.checked.push(Checked { path, kind, placement, size: image.size, texels, warnings, taken: None });
        Some(self.checked.len() - 1)
    }
}

/// How a texture lies on its surface.
fn placement(fields: &Fields) -> Option<Placement> {
    let usual = Placement::default();
    let filter = fields.get("filter").map_or(Some(usual.filter), |item| {
        item.choice(&[("bilinear", TextureFilter::Bilinear), ("nearest", TextureFilter::Nearest)])
    });
    let two = "a number, or two [u, v]";
    let scale = fields.get("scale").map_or(Some(usual.scale), |item| match item.node.value {
        Value::Array(_) => item.numbers::<2>(two).map(DVec2::from_array),
        _ => item.number().map(DVec2::splat),
    });
    let offset = fields
        .get("offset")
        .map_or(Some(usual.offset), |item| item.numbers::<2>("two numbers [u, v]").map(DVec2::from_array));
    let (filter, scale, offset) = (filter?, scale?, offset?);
    // What f32 can tell apart within a picture.
    for (key, value) in [("scale", scale), ("offset", offset)] {
        if value.abs().max_element() > FARTHEST {
            let item = fields.get(key)?;
            item.error(format!("must lie in [-{FARTHEST}, {FARTHEST}], but is {value}"));
            return None;
        }
    }
    Some(Placement { filter, scale, offset })
}

fn resolve_endmembers<'a>(
    item: &Item<'a>,
    quantity: Quantity,
    spectra: &mut Spectra<'a>,
) -> Option<Vec<spectrum::Handle>> {
    let items = item.array()?;
    if !(1..=MAX_ENDMEMBERS).contains(&items.len()) {
        let message = format!("must be 1 to {MAX_ENDMEMBERS} spectra, but are {}", items.len());
        item.error_help(message, "name one for each channel of the texture");
        return None;
    }
    let handles: Vec<_> = items.iter().map(|item| spectra.resolve(item, quantity)).collect();
    handles.into_iter().collect()
}

/// The planes of a picture of colours, which are sRGB's unless OpenEXR says others.
fn rgb_of<'p>(file: &Item, opaque: &[&'p Plane], image: &Image, name: &str) -> Option<Rgb<'p>> {
    let help = "for a mixture of spectra give their names: endmembers = [\"soil\", …]";
    let rgb = match Rgb::of(opaque) {
        Ok(Some(rgb)) => rgb,
        Ok(None) => {
            let message = format!("{name} has {}, but a colour needs R, G and B, or Y", channels(&image.planes));
            file.error_help(message, help);
            return None;
        }
        Err(message) => {
            file.error_help(format!("{name} {message}"), "save one layer, with channels R, G, B");
            return None;
        }
    };
    if let Some(foreign) = &image.colours.foreign {
        file.error_help(format!("{name}: its colours are those of {foreign}"), "convert it to sRGB");
        return None;
    }
    Some(rgb)
}

/// Linear sRGB in [0, 1], \[y\]\[x\]\[3\].
fn colours(file: &Item, image: &Image, name: &str, spectra: &Spectra) -> Option<(Vec<f32>, Vec<String>)> {
    let opaque = without_alpha(file, image, name)?;
    let rgb = rgb_of(file, &opaque, image, name)?;
    let mut warnings = Vec::new();
    let mut planes = Vec::new();
    for plane in rgb.planes() {
        let samples = shares(file, image, name, plane, "a reflectance must lie in [0, 1]", &mut warnings)?;
        planes.push(samples.iter().map(|v| image.colours.transfer.decode(*v)).collect::<Vec<f32>>());
    }
    let mut texels = interleaved(&planes);
    if let (Some(from), Rgb::Colour(_)) = (image.colours.primaries, rgb) {
        let Some(matrix) = from.to_srgb(White::Adapted) else {
            file.error(format!("{name} has primaries {:?} that span no colours", from.0));
            return None;
        };
        for texel in texels.as_chunks_mut::<3>().0 {
            *texel = primaries::apply(&matrix, texel.map(f64::from)).map(|v| v as f32);
        }
        warnings.push(format!("texture {name} has primaries other than sRGB's: its colours are converted"));
        match noise::clip(&mut texels, Range::Share, |v| v as f32) {
            Ok(Some(clipped)) => {
                warnings.push(format!("texture {name}, converted, holds {}", clipped.words(Range::Share)))
            }
            Ok(None) => {}
            Err(i) => {
                let message = format!(
                    "{name} has primaries other than sRGB's, and a colour outside of sRGB {}",
                    place(image, i / 3)
                );
                file.error_help(message, "convert it to sRGB and choose there what becomes of such colours");
                return None;
            }
        }
    }
    let gap = spectra.uncovered(f64::from(upsample::FIRST_NM), f64::from(upsample::LAST_NM));
    let held =
        |gap| format!("texture {name} (rgb) says nothing about {gap}, outside the visible: its spectra are held there");
    warnings.extend(gap.map(held));
    Some((texels, warnings))
}

/// The numbers of a channel in [0, 1], without noise; `range` says so in words.
fn shares(
    file: &Item,
    image: &Image,
    name: &str,
    plane: &Plane,
    range: &str,
    warnings: &mut Vec<String>,
) -> Option<Vec<f32>> {
    let mut samples = plane.samples.clone();
    match noise::clip(&mut samples, Range::Share, |v| v as f32) {
        Ok(clipped) => {
            let words = |clipped: noise::Clipped| {
                format!("texture {name}, channel {}, holds {}", plane.name, clipped.words(Range::Share))
            };
            let warning = clipped.map(words);
            warnings.extend(warning.filter(|warning| !warnings.contains(warning)));
            Some(samples)
        }
        Err(i) => {
            let (channel, value) = (&plane.name, plane.samples[i]);
            file.error(format!("{name}: {range}, but channel {channel} is {value} {}", place(image, i)));
            None
        }
    }
}

/// Shares of `count` spectra, \[y\]\[x\]\[count\]; they sum to 1 at most.
fn abundances(
    file: &Item,
    endmembers: &Item,
    count: usize,
    image: &Image,
    name: &str,
) -> Option<(Vec<f32>, Vec<String>)> {
    let mut warnings = Vec::new();
    let mut planes = Vec::with_capacity(count);
    for plane in pair(endmembers, image, name, &mut warnings)? {
        planes.push(shares(file, image, name, plane, "an abundance must lie in [0, 1]", &mut warnings)?);
    }
    let allowed = MOST_ABUNDANT + image.planes.iter().map(|plane| f64::from(plane.rounding)).sum::<f64>();
    let (mut texels, mut rounded, mut most) = (Vec::with_capacity(planes[0].len() * count), 0usize, 1.0);
    for i in 0..planes[0].len() {
        let sum: f64 = planes.iter().map(|plane| f64::from(plane[i])).sum();
        if sum > allowed {
            let message = format!("{name}: the abundances {} sum to {sum}, more than 1", place(image, i));
            file.error_help(message, "scale them: a surface cannot consist of more than itself");
            return None;
        }
        if sum > 1.0 + NOTICEABLE {
            rounded += 1;
        }
        most = sum.max(most);
        texels.extend(planes.iter().map(|plane| (f64::from(plane[i]) / sum.max(1.0)) as f32));
    }
    let warning = format!(
        "texture {name}: the abundances of {rounded} texels sum to more than 1, up to {most:.6}, by rounding or noise; \
         they are scaled to 1"
    );
    warnings.extend((rounded > 0).then_some(warning));
    Some((texels, warnings))
}

/// The numbers of a channel without the noise below 0, which is told of; what else is negative stays, to be refused.
fn not_negative(plane: &Plane, name: &str, warnings: &mut Vec<String>) -> Vec<f32> {
    let mut samples = plane.samples.clone();
    if let Ok(Some(clipped)) = noise::clip(&mut samples, Range::NotNegative, |v| v as f32) {
        warnings.push(format!("texture {name} holds {}", clipped.words(Range::NotNegative)));
    }
    samples
}

/// Numbers of at least 0, as they are stored times `strength`, \[y\]\[x\]; noise below 0 is 0, with a warning.
fn amounts_of(
    file: &Item,
    image: &Image,
    name: &str,
    plane: &Plane,
    decode: impl Fn(f32) -> f32,
    strength: f64,
    warnings: &mut Vec<String>,
) -> Option<Vec<f32>> {
    let samples = not_negative(plane, name, warnings);
    let brightest = BRIGHTEST as f32;
    let scaled: Vec<f32> = samples.iter().map(|v| (f64::from(decode(*v)) * strength) as f32).collect();
    if let Some(i) = scaled.iter().position(|v| !(0.0..=brightest).contains(v)) {
        let (channel, value) = (&plane.name, plane.samples[i]);
        let message = format!(
            "{name}: a radiance must lie in [0, 1e30], but channel {channel} is {value} {}, times `strength` {strength}",
            place(image, i)
        );
        file.error(message);
        return None;
    }
    Some(scaled)
}

/// Linear sRGB of light, \[y\]\[x\]\[3\].
fn light(file: &Item, image: &Image, name: &str, strength: f64) -> Option<(Vec<f32>, Vec<String>)> {
    let opaque = without_alpha(file, image, name)?;
    let rgb = rgb_of(file, &opaque, image, name)?;
    if image.colours.primaries.is_some() {
        file.error_help(format!("{name} has primaries other than sRGB's"), "convert it to sRGB");
        return None;
    }
    let mut warnings = Vec::new();
    let mut planes = Vec::new();
    for plane in rgb.planes() {
        let decode = |v: f32| image.colours.transfer.decode(v);
        planes.push(amounts_of(file, image, name, plane, decode, strength, &mut warnings)?);
    }
    warnings.dedup();
    Some((interleaved(&planes), warnings))
}

/// How much there is of each of some lamps, \[y\]\[x\]\[lamp\].
fn amounts(
    file: &Item,
    endmembers: &Item,
    image: &Image,
    name: &str,
    strength: f64,
) -> Option<(Vec<f32>, Vec<String>)> {
    let mut warnings = Vec::new();
    let mut planes = Vec::new();
    for plane in pair(endmembers, image, name, &mut warnings)? {
        planes.push(amounts_of(file, image, name, plane, |v| v, strength, &mut warnings)?);
    }
    Some((interleaved(&planes), warnings))
}

/// \[y\]\[x\]\[channel\].
fn interleaved(planes: &[Vec<f32>]) -> Vec<f32> {
    (0..planes[0].len()).flat_map(|i| planes.iter().map(move |plane| plane[i])).collect()
}

/// The channel of each endmember: by name where all names match, whatever their case and the layers before them; in the order of
/// the header where none does, which is said of an EXR, whose header sorts by name.
fn pair<'i>(endmembers: &Item, image: &'i Image, name: &str, warnings: &mut Vec<String>) -> Option<Vec<&'i Plane>> {
    let items = endmembers.array()?;
    if image.planes.len() != items.len() {
        let message = format!("names {} spectra, but {name} has {}", items.len(), channels(&image.planes));
        endmembers.error_help(message, "name one for each channel, in this order");
        return None;
    }
    if image.format == Format::Memory {
        return Some(image.planes.iter().collect());
    }
    let names: Vec<Option<&str>> = items
        .iter()
        .map(|item| match &item.node.value {
            Value::String(name) => Some(name.as_str()),
            _ => None,
        })
        .collect();
    let same = |a: &str, b: &str| a.to_lowercase() == b.to_lowercase();
    let channels_of = |wanted: &str| -> Vec<usize> {
        let by =
            |named: &dyn Fn(&Plane) -> bool| (0..image.planes.len()).filter(|i| named(&image.planes[*i])).collect();
        let whole: Vec<usize> = by(&|plane| same(&plane.name, wanted));
        if whole.is_empty() { by(&|plane| same(plane.parts().1, wanted)) } else { whole }
    };
    let found: Vec<Vec<usize>> = names.iter().map(|name| name.map_or_else(Vec::new, channels_of)).collect();
    let distinct: std::collections::BTreeSet<usize> = found.iter().flatten().copied().collect();
    if found.iter().all(|channels| channels.len() == 1) && distinct.len() == found.len() {
        return Some(found.concat().into_iter().map(|i| &image.planes[i]).collect());
    }
    let written = || list(items.iter().map(written));
    if found.iter().any(|channels| !channels.is_empty()) {
        let message = format!(
            "only some of the endmembers {} are names of channels of {name}, which has {}",
            written(),
            channels(&image.planes)
        );
        endmembers.error_help(message, "name the spectra as the channels, each once, or none of them");
        return None;
    }
    if image.format == Format::Exr && image.planes.len() > 1 {
        let planes = list(image.planes.iter().map(|plane| plane.name.as_str()));
        warnings.push(format!(
            "texture {name}: none of its channels is named as an endmember, so they are paired in order: {planes} are the \
             shares of {}",
            written()
        ));
    }
    Some(image.planes.iter().collect())
}

/// An endmember as the scene has it: its name, or its number.
fn written(item: &Item) -> String {
    match &item.node.value {
        Value::String(name) => name.clone(),
        Value::Float(number) => number.to_string(),
        Value::Integer(number) => number.to_string(),
        other => other.kind().to_owned(),
    }
}

/// \[y\]\[x\].
fn numbers(file: &Item, number: Number, image: &Image, name: &str) -> Option<(Vec<f32>, Vec<String>)> {
    if number == Number::Temperature && image.format == Format::Png {
        file.error_help(format!("{name} is a PNG, which cannot hold temperatures"), "save kelvins as OpenEXR");
        return None;
    }
    let opaque = without_alpha(file, image, name)?;
    let plane = match (&opaque[..], Rgb::of(&opaque)) {
        ([plane], _) => *plane,
        // Greys are often stored as colours.
        (_, Ok(Some(Rgb::Colour([r, g, b])))) if r.samples == g.samples && g.samples == b.samples => r,
        _ => {
            let message = format!("{name} has {}, but one channel is needed", channels(&image.planes));
            file.error_help(message, "save it as a grey picture");
            return None;
        }
    };
    let mut warnings = Vec::new();
    let samples = match number {
        Number::Weight => shares(file, image, name, plane, "a weight must lie in [0, 1]", &mut warnings)?,
        Number::Roughness => {
            let mut samples = shares(file, image, name, plane, "a roughness must lie in [0, 1]", &mut warnings)?;
            let least = SMOOTH as f32;
            let smoother = samples.iter().filter(|alpha| **alpha < least).count();
            if smoother > 0 {
                samples.iter_mut().for_each(|alpha| *alpha = alpha.max(least));
                warnings.push(format!(
                    "texture {name} has {smoother} of {} roughnesses below {SMOOTH}, which count as that: a texture has no mirrors",
                    samples.len()
                ));
            }
            samples
        }
        Number::Temperature => {
            let samples = match kelvins(plane, image, name, &mut warnings) {
                Ok(samples) => samples,
                Err(unit) => {
                    file.error_help(format!("{name} gives its temperatures in `{unit}`"), "write them in kelvins");
                    return None;
                }
            };
            if let Some(i) = samples.iter().position(|v| !(0.0..=1e9).contains(v)) {
                let (channel, value) = (&plane.name, samples[i]);
                let range = "a temperature must lie in [0, 1e9] K";
                file.error(format!("{name}: {range}, but channel {channel} is {value} {}", place(image, i)));
                return None;
            }
            samples
        }
    };
    Some((samples, warnings))
}

/// The numbers of a channel in kelvins, by its name, such as `temperature_C`, or what its picture says of units; the error is a unit
/// that is not understood.
fn kelvins(plane: &Plane, image: &Image, name: &str, warnings: &mut Vec<String>) -> Result<Vec<f32>, String> {
    let of_name = unit::of_temperature(&plane.name).or_else(|| unit::of_temperature(plane.parts().1));
    let Some(unit) = image.units.as_deref().or(of_name.as_deref()) else {
        return Ok(not_negative(plane, name, warnings));
    };
    if unit::is_celsius(unit) {
        warnings.push(format!("texture {name} gives its temperatures in `{unit}`: they are converted to K"));
        return Ok(plane.samples.iter().map(|v| (f64::from(*v) + 273.15) as f32).collect());
    }
    match unit::parse(unit).and_then(unit::Measure::kelvin) {
        Some(1.0) => Ok(not_negative(plane, name, warnings)),
        Some(factor) => {
            warnings.push(format!("texture {name} gives its temperatures in `{unit}`: they are converted to K"));
            Ok(not_negative(plane, name, warnings).iter().map(|v| (f64::from(*v) * factor) as f32).collect())
        }
        None => Err(unit.to_owned()),
    }
}

/// The channels but an A that is 1 everywhere.
fn without_alpha<'i>(file: &Item, image: &'i Image, name: &str) -> Option<Vec<&'i Plane>> {
    let (alpha, others): (Vec<_>, Vec<_>) = image.planes.iter().partition(|plane| image.is_alpha(plane));
    let see_through = alpha.iter().find_map(|plane| plane.samples.iter().position(|a| *a != 1.0));
    if let (Some(i), false) = (see_through, others.is_empty()) {
        let message = format!("{name} is transparent {}, which a texture cannot be", place(image, i));
        file.error_help(message, "save it without its alpha channel, or `blend` two materials");
        return None;
    }
    Some(if others.is_empty() { alpha } else { others })
}

fn place(image: &Image, i: usize) -> String {
    let width = image.size[0] as usize;
    format!("at column {}, row {} from the top left", i % width, i / width)
}

fn channels(planes: &[Plane]) -> String {
    let names = list(planes.iter().take(MAX_ENDMEMBERS).map(|plane| plane.name.as_str()));
    match planes.len() {
        1 => format!("1 channel: {names}"),
        count => format!("{count} channels: {names}{}", if count > MAX_ENDMEMBERS { ", …" } else { "" }),
    }
}
