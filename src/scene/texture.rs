//! Textures: what pictures say about a surface, checked for what they are to describe.

use std::collections::HashMap;
use std::path::PathBuf;
use std::rc::Rc;
use std::sync::Arc;

use super::decode::{Item, list};
use super::keys;
use super::spectrum::{self, Quantity, Spectra, report_in_file};
use super::tree::Value;
use super::{Texture, TextureId, TextureKind};
use crate::format::image::{self, Format, Image, Plane};
use crate::spectral::colour::srgb_decode;
use crate::spectral::upsample;

/// Spectra that one texture may mix: each costs a record at every vertex.
const MAX_ENDMEMBERS: usize = 32;
/// Sums beyond this are more than the last digits of f32.
const NOTICEABLE: f64 = 1e-6;

/// A checked texture; [`Textures::take`] makes it part of the scene.
pub type Handle = usize;

/// What a texture of single numbers describes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Number {
    /// A share, in [0, 1].
    Weight,
    /// Kelvin, not negative; no PNG holds them.
    Temperature,
}

#[derive(PartialEq)]
enum Use {
    Colour,
    /// Of these spectra.
    Mixture(Vec<spectrum::Handle>),
    Number(Number),
}

struct Checked {
    path: PathBuf,
    kind: Use,
    size: [u32; 2],
    texels: Arc<[f32]>,
    warnings: Vec<String>,
    taken: Option<TextureId>,
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

/// Whether `item` is a table that names a texture.
pub fn is_texture(item: &Item) -> bool {
    let Value::Table(entries) = &item.node.value else { return false };
    entries.iter().any(|entry| matches!(entry.key.as_str(), "texture" | "endmembers"))
}

impl Textures {
    /// The reflectance that `item` spells: `{ texture, endmembers }`, a mixture of spectra, or `{ texture }`, colours.
    pub fn reflectance<'a>(&mut self, item: &Item<'a>, spectra: &mut Spectra<'a>) -> Option<Handle> {
        let fields = item.table(&keys::TEXTURE)?;
        let file = fields.require("texture", "texture = \"abundance.exr\"");
        let endmembers = match fields.get("endmembers") {
            None => None,
            Some(list) => Some((resolve_endmembers(&list, spectra)?, list)),
        };
        let file = file?;
        match endmembers {
            None => self.add(&file, Use::Colour, |image, path| colours(&file, image, path, spectra)),
            Some((handles, names)) => {
                let count = handles.len();
                self.add(&file, Use::Mixture(handles), |image, path| abundances(&file, &names, count, image, path))
            }
        }
    }

    /// The numbers over a surface that `item`, `{ texture }`, spells.
    pub fn number(&mut self, item: &Item, number: Number) -> Option<Handle> {
        let fields = item.table(&keys::TEXTURE_OF_NUMBERS)?;
        let file = fields.require("texture", "texture = \"mask.png\"")?;
        self.add(&file, Use::Number(number), |image, path| numbers(&file, number, image, path))
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
            Use::Number(_) => TextureKind::Number,
        };
        let (name, texels) = (checked.path.display().to_string(), Arc::clone(&checked.texels));
        let texture = Texture { name, size: checked.size, kind, texels };
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
        decode: impl FnOnce(&Image, &str) -> Option<(Vec<f32>, Vec<String>)>,
    ) -> Option<Handle> {
        let name = file.text()?;
        let path = file.cx.path(name);
        let image = match self.files.get(&path) {
            Some(known) => known.clone(),
            None => {
                let read = image::read(&path).map_err(|problem| report_in_file(file, *problem)).ok().map(Rc::new);
                self.files.insert(path.clone(), read.clone());
                read
            }
        }?;
        if let Some(same) = self.checked.iter().position(|known| known.path == path && known.kind == kind) {
            return Some(same);
        }
        let (texels, warnings) = decode(&image, name)?;
        self.checked.push(Checked { path, kind, size: image.size, texels: texels.into(), warnings, taken: None });
        Some(self.checked.len() - 1)
    }
}

fn resolve_endmembers<'a>(item: &Item<'a>, spectra: &mut Spectra<'a>) -> Option<Vec<spectrum::Handle>> {
    let items = item.array()?;
    if !(1..=MAX_ENDMEMBERS).contains(&items.len()) {
        let message = format!("must be 1 to {MAX_ENDMEMBERS} spectra, but are {}", items.len());
        item.error_help(message, "name one for each channel of the texture");
        return None;
    }
    let handles: Vec<_> = items.iter().map(|item| spectra.resolve(item, Quantity::Reflectance)).collect();
    handles.into_iter().collect()
}

/// Linear sRGB in [0, 1], \[y\]\[x\]\[3\].
fn colours(file: &Item, image: &Image, name: &str, spectra: &Spectra) -> Option<(Vec<f32>, Vec<String>)> {
    let opaque = without_alpha(file, image, name)?;
    let plane = |wanted: &str| opaque.iter().find(|plane| plane.name == wanted);
    let rgb = match (opaque.len(), plane("Y"), plane("R"), plane("G"), plane("B")) {
        (1, Some(grey), ..) => [*grey; 3],
        (3, _, Some(r), Some(g), Some(b)) => [*r, *g, *b],
        _ => {
            let message = format!("{name} has {}, but a colour needs R, G and B, or Y", channels(&image.planes));
            file.error_help(message, "for a mixture of spectra give their names: endmembers = [\"soil\", …]");
            return None;
        }
    };
    for plane in rgb {
        check_range(file, image, name, plane, |v| (0.0..=1.0).contains(&v), "a reflectance must lie in [0, 1]")?;
    }
    let linear = |v: f32| if image.format == Format::Png { srgb_decode(v.into()) as f32 } else { v };
    let texels = (0..rgb[0].samples.len()).flat_map(|i| rgb.map(|plane| linear(plane.samples[i]))).collect();
    let gap = spectra.uncovered(f64::from(upsample::FIRST_NM), f64::from(upsample::LAST_NM));
    let held =
        |gap| format!("texture {name} (rgb) says nothing about {gap}, outside the visible: its spectra are held there");
    Some((texels, gap.map(held).into_iter().collect()))
}

/// Shares of `count` spectra, \[y\]\[x\]\[count\]; they sum to 1 at most.
fn abundances(
    file: &Item,
    endmembers: &Item,
    count: usize,
    image: &Image,
    name: &str,
) -> Option<(Vec<f32>, Vec<String>)> {
    if image.planes.len() != count {
        let message = format!("names {count} spectra, but {name} has {}", channels(&image.planes));
        endmembers.error_help(message, "name one for each channel, in this order");
        return None;
    }
    for plane in &image.planes {
        check_range(file, image, name, plane, |v| (0.0..=1.0).contains(&v), "an abundance must lie in [0, 1]")?;
    }
    let allowed = 1.0 + image.planes.iter().map(|plane| f64::from(plane.rounding)).sum::<f64>();
    let (mut texels, mut rounded, mut most) = (Vec::with_capacity(image.planes[0].samples.len() * count), 0usize, 1.0);
    for i in 0..image.planes[0].samples.len() {
        let sum: f64 = image.planes.iter().map(|plane| f64::from(plane.samples[i])).sum();
        if sum > allowed {
            let message = format!("{name}: the abundances {} sum to {sum}, more than 1", place(image, i));
            file.error_help(message, "scale them: a surface cannot consist of more than itself");
            return None;
        }
        if sum > 1.0 + NOTICEABLE {
            rounded += 1;
        }
        most = sum.max(most);
        texels.extend(image.planes.iter().map(|plane| (f64::from(plane.samples[i]) / sum.max(1.0)) as f32));
    }
    let warning = format!(
        "texture {name}: the abundances of {rounded} texels sum to more than 1, up to {most:.6}, by rounding; they are \
         scaled to 1"
    );
    Some((texels, if rounded > 0 { vec![warning] } else { Vec::new() }))
}

/// \[y\]\[x\].
fn numbers(file: &Item, number: Number, image: &Image, name: &str) -> Option<(Vec<f32>, Vec<String>)> {
    if number == Number::Temperature && image.format == Format::Png {
        file.error_help(format!("{name} is a PNG, which cannot hold temperatures"), "save kelvins as OpenEXR");
        return None;
    }
    let opaque = without_alpha(file, image, name)?;
    // Greys are often stored as colours.
    let grey = opaque.iter().all(|plane| ["R", "G", "B"].contains(&plane.name.as_str()));
    let same = opaque.windows(2).all(|pair| pair[0].samples == pair[1].samples);
    let plane = match opaque[..] {
        [plane] => plane,
        [plane, ..] if grey && same => plane,
        _ => {
            let message = format!("{name} has {}, but one channel is needed", channels(&image.planes));
            file.error_help(message, "save it as a grey picture");
            return None;
        }
    };
    match number {
        Number::Weight => {
            check_range(file, image, name, plane, |v| (0.0..=1.0).contains(&v), "a weight must lie in [0, 1]")?;
        }
        Number::Temperature => {
            let range = "a temperature must lie in [0, 1e9] K";
            check_range(file, image, name, plane, |v| (0.0..=1e9).contains(&v), range)?;
        }
    }
    Some((plane.samples.clone(), Vec::new()))
}

/// The channels but an A that is 1 everywhere.
fn without_alpha<'i>(file: &Item, image: &'i Image, name: &str) -> Option<Vec<&'i Plane>> {
    let (alpha, others): (Vec<_>, Vec<_>) = image.planes.iter().partition(|plane| plane.name == "A");
    let see_through = alpha.first().and_then(|plane| plane.samples.iter().position(|a| *a != 1.0));
    if let (Some(i), false) = (see_through, others.is_empty()) {
        let message = format!("{name} is transparent {}, which a texture cannot be", place(image, i));
        file.error_help(message, "save it without its alpha channel, or `blend` two materials");
        return None;
    }
    Some(if others.is_empty() { alpha } else { others })
}

fn check_range(
    file: &Item,
    image: &Image,
    name: &str,
    plane: &Plane,
    allowed: impl Fn(f32) -> bool,
    range: &str,
) -> Option<()> {
    let Some(i) = plane.samples.iter().position(|v| !allowed(*v)) else { return Some(()) };
    file.error(format!("{name}: {range}, but channel {} is {} {}", plane.name, plane.samples[i], place(image, i)));
    None
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
