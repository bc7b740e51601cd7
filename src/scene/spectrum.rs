//! Spectra: named ones (`[spectra]`) and those written where they are used; from any source to a [`Curve`].

use std::collections::HashMap;
use std::path::PathBuf;

use super::context::Context;
use super::decode::{Item, did_you_mean, list};
use super::keys;
use super::texture::is_texture;
use super::tree::{Origin, Value};
use super::{Spectrum, SpectrumId};
use crate::error::Problem;
use crate::format::noise::{self, Range};
use crate::format::refractive;
use crate::format::text::{self, Column, SpectrumTable};
use crate::format::unit::{Density, Kind, Meaning, Stated, Unit};
use crate::spectral::{Channels, Curve, Outside, hull, upsample};

/// Wavelengths, in nm, far beyond any channel, between which a curve's peak is looked for.
const SHORTEST: f64 = 1e-3;
const LONGEST: f64 = 1e15;
/// Sums and products of a few radiances beyond this leave f32.
const BRIGHTEST: f64 = 1e35;
/// Far above any index of refraction (200 or so in metals at 20 um) and its squares far inside f32.
const DENSEST: f64 = 1e3;
/// Opaque within any distance that matters, and far inside f32 times one.
const MOST_ABSORBING: f64 = 1e15;

/// What a spectrum describes: decides the allowed values, what a table means beyond its ends, and what `rgb` is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// Dimensionless, in [0, 1]; held beyond its table, with a warning.
    Reflectance,
    /// W m⁻² sr⁻¹ nm⁻¹, not negative; zero beyond its table.
    Radiance,
    /// Of a point light, W sr⁻¹ nm⁻¹; as [`Quantity::Radiance`].
    Intensity,
    /// Of a light far away, W m⁻² nm⁻¹ on a plane facing it; as [`Quantity::Radiance`].
    Irradiance,
    /// Of refraction: dimensionless, above 0; held beyond its table, with a warning.
    Index,
    /// Of a coat: at least 1; otherwise as [`Quantity::Index`].
    CoatIndex,
    /// Imaginary part of a complex index, not negative; held beyond its table, with a warning.
    Extinction,
    /// Of a gas: m⁻¹ (and per atmosphere of a species), not negative; zero beyond its table, with a warning.
    Absorption,
}

impl Quantity {
    pub const ALL: [Quantity; 8] = [
        Quantity::Reflectance,
        Quantity::Radiance,
        Quantity::Intensity,
        Quantity::Irradiance,
        Quantity::Index,
        Quantity::CoatIndex,
        Quantity::Extinction,
        Quantity::Absorption,
    ];

    /// Whether it is light itself rather than what becomes of light.
    fn is_light(self) -> bool {
        matches!(self, Quantity::Radiance | Quantity::Intensity | Quantity::Irradiance)
    }

    /// Whether it is an index of refraction or an absorption, which no temperature and no colour makes.
    pub fn is_index(self) -> bool {
        self != Quantity::Reflectance && !self.is_light()
    }

    /// Whether it is n or k.
    fn is_optical_constant(self) -> bool {
        matches!(self, Quantity::Index | Quantity::CoatIndex | Quantity::Extinction)
    }

    fn default_outside(self) -> Outside {
        if self.is_light() || self == Quantity::Absorption { Outside::Zero } else { Outside::Hold }
    }

    /// Empty where it has none.
    pub fn unit(self) -> &'static str {
        match self {
            Quantity::Radiance => "W m⁻² sr⁻¹ nm⁻¹",
            Quantity::Intensity => "W sr⁻¹ nm⁻¹",
            Quantity::Irradiance => "W m⁻² nm⁻¹",
            Quantity::Absorption => "m⁻¹",
            Quantity::Reflectance | Quantity::Index | Quantity::CoatIndex | Quantity::Extinction => "",
        }
    }

    /// What holds beyond the ends of a table, in words.
    pub fn beyond_words(self) -> &'static str {
        match (self.default_outside(), self.is_light()) {
            (Outside::Hold, _) => "its first and last value are held, with a warning",
            (Outside::Zero, true) => "zero",
            (Outside::Zero, false) => "zero, with a warning",
        }
    }

    pub fn noun(self) -> &'static str {
        match self {
            Quantity::Reflectance => "a reflectance",
            Quantity::Radiance => "a radiance",
            Quantity::Intensity => "an intensity",
            Quantity::Irradiance => "an irradiance",
            Quantity::Index => "an index of refraction",
            Quantity::CoatIndex => "the index of refraction of a coat",
            Quantity::Extinction => "an extinction coefficient k",
            Quantity::Absorption => "an absorption coefficient",
        }
    }

    pub fn allows(self, value: f64) -> bool {
        match self {
            Quantity::Reflectance => (0.0..=1.0).contains(&value),
            Quantity::Radiance | Quantity::Intensity | Quantity::Irradiance => (0.0..=BRIGHTEST).contains(&value),
            Quantity::Index => value > 0.0 && value <= DENSEST,
            Quantity::CoatIndex => (1.0..=DENSEST).contains(&value),
            Quantity::Extinction => (0.0..=DENSEST).contains(&value),
            Quantity::Absorption => (0.0..=MOST_ABSORBING).contains(&value),
        }
    }

    /// What measured values of it may be but for noise; `None` where there is no bound that noise could cross.
    fn noise(self) -> Option<Range> {
        match self {
            Quantity::Reflectance => Some(Range::Share),
            Quantity::Extinction => Some(Range::Extinction),
            Quantity::Index | Quantity::CoatIndex => None,
            _ => Some(Range::NotNegative),
        }
    }

    /// What units of it are.
    fn kind(self) -> Kind {
        match self {
            Quantity::Radiance => Kind::Radiance,
            Quantity::Intensity => Kind::Intensity,
            Quantity::Irradiance => Kind::Irradiance,
            Quantity::Absorption => Kind::Absorption,
            _ => Kind::Number,
        }
    }

    /// The values that are allowed.
    pub fn interval(self) -> &'static str {
        match self {
            Quantity::Reflectance => "[0, 1]",
            Quantity::Radiance | Quantity::Intensity | Quantity::Irradiance => "[0, 1e35]",
            Quantity::Index => "(0, 1000]",
            Quantity::CoatIndex => "[1, 1000]",
            Quantity::Extinction => "[0, 1000]",
            Quantity::Absorption => "[0, 1e15]",
        }
    }

    pub fn range(self) -> String {
        format!("{} must lie in {}", self.noun(), self.interval())
    }
}

/// A spectrum as written, before it is known what it describes.
#[derive(Debug, Clone)]
struct Source<'a> {
    data: Data,
    scale: f64,
    outside: Option<Outside>,
    /// The key and place of what `data` was made from.
    path: String,
    at: &'a Origin,
}

#[derive(Debug, Clone)]
enum Data {
    Constant(f64),
    Blackbody(f64),
    Table {
        nm: Vec<f64>,
        value: Vec<f64>,
        /// The file that it was read from, if any.
        file: Option<TableFile>,
    },
    Rgb([f64; 3]),
}

/// What a file says beside the numbers of a table.
#[derive(Debug, Clone)]
struct TableFile {
    path: PathBuf,
    /// The line of each value; empty where the file has no lines.
    lines: Vec<usize>,
    unit: Option<Stated>,
    notes: Vec<String>,
}

/// A table that is checked, and what it is called.
#[derive(Clone, Copy)]
struct Tabulated<'s, 'a> {
    nm: &'s [f64],
    value: &'s [f64],
    file: Option<&'s TableFile>,
    source: &'s Source<'a>,
    name: &'s str,
}

/// A checked spectrum; [`Spectra::take`] makes it part of the scene.
pub type Handle = usize;

/// A checked curve and what to say about it if the scene uses it.
struct Checked {
    name: String,
    curve: Curve,
    warnings: Vec<String>,
    taken: Option<SpectrumId>,
}

/// All spectra of a scene: the named ones, and every one that was asked for.
pub struct Spectra<'a> {
    cx: &'a Context<'a>,
    /// `None` where the definition is wrong, which has been said.
    named: Vec<(&'a str, Option<Source<'a>>)>,
    /// Curves already made from a name.
    by_name: HashMap<(String, Quantity), Option<Handle>>,
    checked: Vec<Checked>,
    /// In the order of their first use.
    scene: Vec<Spectrum>,
    channels: Option<Channels>,
}

impl<'a> Spectra<'a> {
    /// Decodes `[spectra]`. `channels` decide what a table leaves uncovered.
    pub fn new(cx: &'a Context<'a>, item: Option<Item<'a>>, channels: Option<Channels>) -> Self {
        let items = item.and_then(|item| item.named_items()).unwrap_or_default();
        let needed = channels.as_ref().and_then(Channels::hull);
        let define = |(name, item): (&'a str, Item<'a>)| match item.node.value {
            Value::String(_) => {
                item.error_help(
                    "must be a number or a table, but is a string",
                    "write e.g. { file = \"spectrum.csv\" } or { constant = 0.5 }",
                );
                (name, None)
            }
            _ => (name, source(&item, needed)),
        };
        let named = items.into_iter().map(define).collect();
        Spectra { cx, named, by_name: HashMap::new(), checked: Vec::new(), scene: Vec::new(), channels }
    }

    /// The spectrum that `item` names or spells, checked for what it is to describe.
    pub fn resolve(&mut self, item: &Item<'a>, quantity: Quantity) -> Option<Handle> {
        let Value::String(name) = &item.node.value else {
            let source = source(item, self.channel_hull())?;
            return self.check(&source, &item.path, item, quantity);
        };
        let Some((_, definition)) = self.named.iter().find(|(known, _)| known == name) else {
            let names = self.named.iter().map(|(name, _)| *name);
            let help = if name.contains(['.', '/']) {
                format!("for a file write {{ file = \"{}\" }}", name.escape_debug())
            } else {
                did_you_mean(name, names.clone()).unwrap_or_else(|| match self.named.len() {
                    0 => format!("define it: [spectra.{name}]"),
                    _ => format!("[spectra] has {}", list(names)),
                })
            };
            item.error_help(format!("no spectrum is named \"{name}\""), help);
            return None;
        };
        let key = (name.clone(), quantity);
        if let Some(known) = self.by_name.get(&key) {
            return *known;
        }
        let handle = definition.clone().and_then(|source| self.check(&source, name, item, quantity));
        self.by_name.insert(key, handle);
        handle
    }

    /// The complex index of refraction, n and k, in the file that `item` names.
    pub fn complex_index(&mut self, item: &Item<'a>) -> Option<(Handle, Handle)> {
        let path = item.cx.path(item.text()?);
        let index =
            refractive::read(&path, self.channel_hull()).map_err(|problem| report_in_file(item, *problem)).ok()?;
        let given = |name: &str, part: Option<Result<SpectrumTable, Box<Problem>>>| match part {
            Some(table) => table.map_err(|problem| report_in_file(item, *problem)).ok(),
            None => {
                let help = "give both, or write `eta` and `k` instead of `nk`";
                item.error_help(format!("{} does not give {name}", path.display()), help);
                None
            }
        };
        let (n, k) = (given("n", index.n), given("k", index.k));
        let mut part = |name: &str, table: SpectrumTable, quantity: Quantity| {
            let data = table_data(table, path.clone());
            let source = Source { data, scale: 1.0, outside: None, path: item.path.clone(), at: item.at };
            self.check(&source, &format!("{} ({name})", item.text()?), item, quantity)
        };
        let (n, k) = (n?, k?);
        let (n, k) = (part("n", n, Quantity::Index), part("k", k, Quantity::Extinction));
        n.zip(k)
    }

    /// The columns of the file that `item` names, absorption of a species at temperatures: K, ascending, and a spectrum.
    pub fn species(&mut self, item: &Item<'a>) -> Option<Vec<(f64, Handle)>> {
        let written = item.text()?;
        let path = item.cx.path(written);
        let columns = text::read_columns(&path).map_err(|problem| report_in_file(item, *problem)).ok()?;
        let mut found = Vec::new();
        for (name, table) in columns {
            let kelvin = column_kelvin(&name);
            if kelvin.is_none() {
                item.error_help(
                    format!("the columns of {} must be named by temperatures, but one is \"{name}\"", path.display()),
                    "write a header such as nm,300,600,1000: temperatures in K",
                );
                return None;
            }
            let data = table_data(table, path.clone());
            let source = Source { data, scale: 1.0, outside: None, path: item.path.clone(), at: item.at };
            let kelvin = kelvin?;
            found.push((kelvin, self.check(&source, &format!("{written} ({kelvin} K)"), item, Quantity::Absorption)?));
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        if let Some(same) = found.windows(2).find(|w| w[0].0 == w[1].0) {
            item.error_help(format!("{} has two columns for {} K", path.display(), same[0].0), "remove one");
            return None;
        }
        Some(found)
    }

    /// The index of a checked spectrum in the scene. Equal curves share one.
    pub fn take(&mut self, handle: Handle) -> SpectrumId {
        let spectrum = &mut self.checked[handle];
        if let Some(id) = spectrum.taken {
            return id;
        }
        spectrum.warnings.drain(..).for_each(|warning| self.cx.warn(warning));
        let same = self.scene.iter().position(|other| other.curve == spectrum.curve);
        let id = same.unwrap_or_else(|| {
            self.scene.push(Spectrum { name: spectrum.name.clone(), curve: spectrum.curve.clone() });
            self.scene.len() - 1
        });
        spectrum.taken = Some(id);
        id
    }

    /// The index in the scene of a curve that no spectrum of the file describes. Equal curves share one.
    pub fn curve(&mut self, name: &str, curve: Curve) -> SpectrumId {
        self.checked.push(Checked { name: name.to_owned(), curve, warnings: Vec::new(), taken: None });
        self.take(self.checked.len() - 1)
    }

    /// `handle`, a radiance, times the number of at least 0 that `item` holds.
    pub fn scaled(&mut self, handle: Handle, item: &Item) -> Option<Handle> {
        let factor = item.not_negative()?;
        let Checked { name, curve, warnings, .. } = &self.checked[handle];
        let (name, warnings, mut curve) = (name.clone(), warnings.clone(), curve.clone());
        match &mut curve {
            Curve::Constant(value) => *value *= factor,
            Curve::Blackbody { scale, .. } => *scale *= factor,
            Curve::Linear { value, .. } => value.iter_mut().for_each(|v| *v *= factor),
        }
        let peak = curve.max(SHORTEST, LONGEST);
        if !Quantity::Radiance.allows(peak) {
            item.error(format!("{}, but is {peak:e} after scaling", Quantity::Radiance.range()));
            return None;
        }
        self.checked.push(Checked { name, curve, warnings, taken: None });
        Some(self.checked.len() - 1)
    }

    /// Says `warning` to the user, once.
    pub fn warn(&self, warning: String) {
        self.cx.warn(warning);
    }

    /// The spectra in use.
    pub fn finish(self) -> Vec<Spectrum> {
        self.scene
    }

    fn check(&mut self, source: &Source<'a>, name: &str, user: &Item<'a>, quantity: Quantity) -> Option<Handle> {
        let used_by =
            if source.path.starts_with(&user.path) { String::new() } else { format!("; used by `{}`", user.path) };
        let refuse = |value: String| {
            let message = format!("{}, but is {value}{used_by}", quantity.range());
            self.cx.error(source.at, &source.path, message, None);
        };
        let mut warnings = Vec::new();
        let is_index = quantity.is_index();
        if is_index && !quantity.allows(0.0) && source.outside == Some(Outside::Zero) {
            let help = "remove `outside`, or write outside = \"hold\"";
            let message = format!("an index of refraction cannot be 0 outside its table{used_by}");
            self.cx.error(source.at, &source.path, message, Some(help.to_owned()));
            return None;
        }
        let curve = match &source.data {
            Data::Constant(value) => {
                let scaled = value * source.scale;
                if !quantity.allows(scaled) {
                    refuse(scaled_words(*value, source.scale));
                    return None;
                }
                Curve::Constant(scaled)
            }
            Data::Blackbody(_) if is_index => {
                refuse("a black body".to_owned());
                return None;
            }
            Data::Rgb(_) if is_index => {
                refuse("a colour".to_owned());
                return None;
            }
            Data::Blackbody(kelvin) => {
                let curve = Curve::Blackbody { kelvin: *kelvin, scale: source.scale };
                let peak = curve.max(SHORTEST, LONGEST);
                if !quantity.allows(peak) {
                    refuse(format!("{peak:e} at the peak of the black body"));
                    return None;
                }
                curve
            }
            Data::Table { nm, value, file } => {
                let table = Tabulated { nm, value, file: file.as_ref(), source, name };
                self.tabulated(&table, user, quantity, &refuse, &mut warnings)?
            }
            Data::Rgb(rgb) => {
                let colour = rgb.map(|v| v * source.scale);
                if !colour.iter().all(|v| quantity.allows(*v)) {
                    refuse(format!(
                        "rgb = {rgb:?}{}",
                        if source.scale == 1.0 { String::new() } else { format!(" x scale {}", source.scale) }
                    ));
                    return None;
                }
                let curve =
                    if quantity.is_light() { upsample::emission(colour) } else { upsample::reflectance(colour) };
                self.rgb_outside(curve, source.outside, name, &mut warnings)
            }
        };
        self.checked.push(Checked { name: name.to_owned(), curve, warnings, taken: None });
        Some(self.checked.len() - 1)
    }

    /// The curve of a table: in the unit of `quantity`, scaled, without noise.
    fn tabulated(
        &self,
        table: &Tabulated<'_, 'a>,
        user: &Item<'a>,
        quantity: Quantity,
        refuse: &dyn Fn(String),
        warnings: &mut Vec<String>,
    ) -> Option<Curve> {
        let Tabulated { nm, file, source, name, .. } = *table;
        let mut unscaled = table.value.to_vec();
        let mut kept = 0..nm.len();
        if let Some(file) = file {
            warnings.extend(file.notes.iter().map(|note| format!("{} {note}", file.path.display())));
            self.convert(table, &mut unscaled, quantity, user, warnings)?;
            if quantity.is_optical_constant() {
                kept = self.sound(file, nm, &unscaled, quantity, warnings);
            }
        }
        let nm = &nm[kept.clone()];
        let mut value: Vec<f64> = unscaled[kept.clone()].iter().map(|v| v * source.scale).collect();
        let mut wrong = None;
        if let (Some(file), Some(range)) = (file, quantity.noise()) {
            match noise::clip(&mut value, range, |v| v) {
                Ok(None) => {}
                Ok(Some(clipped)) => warnings.push(format!("{} holds {}", file.path.display(), clipped.words(range))),
                Err(i) => wrong = Some(i),
            }
        }
        if let Some(i) = wrong.or_else(|| value.iter().position(|v| !quantity.allows(*v))) {
            let text = format!("{} at {} nm", scaled_words(unscaled[kept.start + i], source.scale), nm[i]);
            match file.map(|file| (file, file.lines.get(kept.start + i))) {
                Some((file, Some(line))) => self.cx.push(Problem {
                    file: file.path.clone(),
                    line: Some(*line),
                    key: Some(user.path.clone()),
                    message: format!("{}, but is {text}", quantity.range()),
                    ..Problem::default()
                }),
                _ => refuse(text),
            }
            return None;
        }
        let outside = source.outside.unwrap_or(quantity.default_outside());
        let instead = match (outside, quantity) {
            (Outside::Hold, _) => Some("its end values are held there"),
            (Outside::Zero, Quantity::Absorption) => Some("nothing is absorbed there"),
            (Outside::Zero, _) => None,
        };
        if let (Some(instead), None) = (instead, source.outside) {
            warnings.extend(self.uncovered(nm[0], nm[nm.len() - 1]).map(|gap| {
                let noun = quantity.noun();
                format!("spectrum `{name}` ({noun}) does not cover {gap}: {instead}")
            }));
        }
        let mut nm = nm.to_vec();
        // One row that is left, and held, is a step of no height: a curve has two nodes at least.
        if let ([only_nm], [only]) = (&nm[..], &value[..]) {
            (nm, value) = (vec![*only_nm; 2], vec![*only; 2]);
        }
        Some(Curve::Linear { nm, value, outside })
    }

    /// The rows of n or k that are kept: all, or those that channels see where others are impossible, as beyond the ends of what
    /// a formula or a fit was made for.
    fn sound(
        &self,
        file: &TableFile,
        nm: &[f64],
        value: &[f64],
        quantity: Quantity,
        warnings: &mut Vec<String>,
    ) -> std::ops::Range<usize> {
        let seen = self.seen(nm);
        let impossible = |v: &[f64]| v.iter().any(|v| !quantity.allows(*v));
        if !impossible(&value[..seen.start]) && !impossible(&value[seen.end..]) {
            return 0..nm.len();
        }
        warnings.push(format!(
            "{}: values outside of {} to {} nm, beyond all channels, are left out: some are impossible",
            file.path.display(),
            nm[seen.start],
            nm[seen.end - 1]
        ));
        seen
    }

    /// Brings values into the unit of `quantity`, by what their file says of theirs.
    fn convert(
        &self,
        table: &Tabulated<'_, 'a>,
        value: &mut [f64],
        quantity: Quantity,
        user: &Item<'a>,
        warnings: &mut Vec<String>,
    ) -> Option<()> {
        let Some(file) = table.file else { return Some(()) };
        let Some(Stated { meaning, text, certain }) = &file.unit else { return Some(()) };
        let path = file.path.display();
        let taken_as =
            if quantity.unit().is_empty() { "as they are".to_owned() } else { format!("in {}", quantity.unit()) };
        let measure = match meaning {
            Meaning::Unit(measure) => measure,
            Meaning::Logarithm => {
                user.error_help(
                    format!("{path} gives logarithms as its values (`{text}`)"),
                    "write the values themselves",
                );
                return None;
            }
            Meaning::Unknown => {
                warnings.push(format!(
                    "{path} says `{text}` of its values, which is not understood: they are taken {taken_as}, times `scale`"
                ));
                return Some(());
            }
        };
        match measure.to(quantity.kind()) {
            Some(Density::Plain(1.0)) => {}
            Some(density) => {
                value.iter_mut().zip(table.nm).for_each(|(value, nm)| *value = density.apply(*value, *nm));
            }
            // A share of anything is what reflectances, tabulated beside other things, are without a unit.
            None if measure.is_number() => {}
            None => {
                let message =
                    format!("gives its values in the unit of `{text}`, which is not that of {}", quantity.noun());
                if *certain {
                    let help = format!("convert them to {}, or correct the header", quantity.unit());
                    user.error_help(format!("{path} {message}"), help);
                    return None;
                }
                warnings.push(format!("{path} {message}: they are taken {taken_as}"));
            }
        }
        Some(())
    }

    /// An upsampled colour means something in the visible only: beyond, its ends are held with a warning, or as the
    /// scene says.
    fn rgb_outside(&self, curve: Curve, written: Option<Outside>, name: &str, warnings: &mut Vec<String>) -> Curve {
        let (first, last) = (f64::from(upsample::FIRST_NM), f64::from(upsample::LAST_NM));
        if written.is_none() {
            warnings.extend(self.uncovered(first, last).map(|gap| {
                format!("spectrum `{name}` (rgb) says nothing about {gap}, outside the visible: its end values are held there")
            }));
        }
        match (curve, written) {
            (Curve::Linear { nm, value, .. }, Some(outside)) => Curve::Linear { nm, value, outside },
            (Curve::Constant(v), Some(Outside::Zero)) => {
                Curve::Linear { nm: vec![first, last], value: vec![v, v], outside: Outside::Zero }
            }
            (curve, _) => curve,
        }
    }

    fn channel_hull(&self) -> Option<[f64; 2]> {
        self.channels.as_ref().and_then(Channels::hull)
    }

    /// The nodes of a table that the channels see: those between their ends, and one beyond either.
    fn seen(&self, nm: &[f64]) -> std::ops::Range<usize> {
        let Some([first, last]) = self.channel_hull() else { return 0..nm.len() };
        let from = nm.partition_point(|x| *x <= first).saturating_sub(1);
        let to = (nm.partition_point(|x| *x < last) + 1).min(nm.len());
        from.min(nm.len() - 1)..to
    }

    /// The parts of the channels below `first` and above `last` nm, in words.
    pub fn uncovered(&self, first: f64, last: f64) -> Option<String> {
        let bounds = &self.channels.as_ref()?.bounds;
        let below = hull(bounds.iter().filter(|b| b[0] < first).map(|b| [b[0], b[1].min(first)]));
        let above = hull(bounds.iter().filter(|b| b[1] > last).map(|b| [b[0].max(last), b[1]]));
        let gaps: Vec<String> = [below, above].into_iter().flatten().map(|[a, b]| format!("{a}-{b} nm")).collect();
        (!gaps.is_empty()).then(|| gaps.join(" and "))
    }
}

/// A value as it is written, with what it is multiplied by.
fn scaled_words(value: f64, scale: f64) -> String {
    if scale == 1.0 { value.to_string() } else { format!("{value} x scale {scale}") }
}

/// A spectrum written as a number or a table. Of an index, what the wavelengths `needed` see has to be sound.
fn source<'a>(item: &Item<'a>, needed: Option<[f64; 2]>) -> Option<Source<'a>> {
    let Value::Table(_) = &item.node.value else {
        if !matches!(item.node.value, Value::Integer(_) | Value::Float(_)) {
            item.error_help(
                format!("must be a spectrum, but is {}", item.node.value.kind()),
                "write a name, a number, or a table such as { file = \"spectrum.csv\" }",
            );
            return None;
        }
        let data = Data::Constant(item.number()?);
        return Some(Source { data, scale: 1.0, outside: None, path: item.path.clone(), at: item.at });
    };
    if is_texture(item) {
        item.error_help(
            "is the same all over a surface, so it cannot be a texture",
            "textures are for `reflectance` of diffuse and plastic, `weight` of blend, and `temperature`",
        );
        return None;
    }
    let fields = item.table(&keys::SPECTRUM)?;
    let kind = fields.exactly_one("spectrum source");
    let scale = match fields.get("scale") {
        Some(item) => item.not_negative(),
        None => Some(1.0),
    };
    let outside = match fields.get("outside") {
        Some(item) => Some(item.choice(&[("zero", Outside::Zero), ("hold", Outside::Hold)])?),
        None => None,
    };
    let kind = kind?;
    let data = match kind.path.rsplit('.').next() {
        Some("file") => file(&kind, fields.get("column"), fields.get("unit"), needed),
        Some("constant") => kind.number().map(Data::Constant),
        Some("blackbody") => kind.positive().map(Data::Blackbody),
        Some("samples") => samples(&kind),
        Some("regular") => regular(&kind),
        _ => kind.numbers::<3>("three numbers [r, g, b]").map(Data::Rgb),
    }?;
    for key in ["column", "unit"] {
        if let (Some(item), false) = (fields.get(key), fields.has("file")) {
            item.error_help("goes with `file` only", "remove it");
            return None;
        }
    }
    if outside.is_some() && matches!(data, Data::Constant(_) | Data::Blackbody(_)) {
        item.cx.warn(format!("`{}.outside` has no effect: the spectrum is not a table", item.path));
    }
    Some(Source { data, scale: scale?, outside, path: kind.path, at: kind.at })
}

fn file(item: &Item, column: Option<Item>, unit: Option<Item>, needed: Option<[f64; 2]>) -> Option<Data> {
    let path = item.cx.path(item.text()?);
    let column = match &column {
        None => Column::Only,
        Some(column) if matches!(column.node.value, Value::Integer(_)) => {
            Column::Number(column.whole(1..=1_000_000)? as usize)
        }
        Some(column) => Column::Named(column.text()?),
    };
    let unit_of_x = match &unit {
        Some(item) => {
            let written = item.text()?;
            let unit = Unit::named(written);
            if unit.is_none() {
                item.error_help(
                    format!("must be a unit of wavelength, wavenumber, frequency or energy, but is \"{written}\""),
                    "write e.g. nm, um, angstrom, cm-1, THz or eV",
                );
            }
            Some(unit?)
        }
        None => None,
    };
    if refractive::is_yaml(&path) {
        if let Some(unit) = unit {
            unit.error_help("goes with tables only", "remove it: these files are in um");
            return None;
        }
        return index_file(item, path, column, needed);
    }
    match text::read_spectrum(&path, column, unit_of_x) {
        Ok(table) => Some(table_data(table, path)),
        Err(problem) => {
            report_in_file(item, *problem);
            None
        }
    }
}

/// `n` (the default) or `k` of a refractiveindex.info file.
fn index_file(item: &Item, path: PathBuf, column: Column, needed: Option<[f64; 2]>) -> Option<Data> {
    let name = match column {
        Column::Only | Column::Named("n") | Column::Number(2) => "n",
        Column::Named("k") | Column::Number(3) => "k",
        Column::Named(_) | Column::Number(_) => {
            let other = match column {
                Column::Named(name) => format!("\"{name}\""),
                Column::Number(number) => number.to_string(),
                Column::Only => String::new(),
            };
            item.error_help(format!("{} has no column {other}", path.display()), "its columns are n and k");
            return None;
        }
    };
    let index = refractive::read(&path, needed).map_err(|problem| report_in_file(item, *problem)).ok()?;
    let table = match if name == "n" { index.n } else { index.k } {
        Some(table) => table.map_err(|problem| report_in_file(item, *problem)).ok()?,
        None => {
            item.error(format!("{} does not give {name}", path.display()));
            return None;
        }
    };
    Some(table_data(table, path))
}

/// The temperature that names a column: `300`, `300K`, or with words before it as in `kappa_300K`.
fn column_kelvin(name: &str) -> Option<f64> {
    let number = name.trim_end_matches(['K', 'k', ' ']);
    let start = number.rfind(|c: char| !c.is_ascii_digit() && c != '.').map_or(0, |i| i + 1);
    number.get(start..)?.parse().ok().filter(|kelvin: &f64| kelvin.is_finite() && *kelvin > 0.0)
}

fn table_data(table: SpectrumTable, path: PathBuf) -> Data {
    let SpectrumTable { nm, value, line, unit, notes } = table;
    Data::Table { nm, value, file: Some(TableFile { path, lines: line, unit, notes }) }
}

/// A mistake in a file that `item` names: at its line there, or, if the file as a whole is wrong, at the item.
pub fn report_in_file(item: &Item, problem: Problem) {
    if problem.line.is_some() {
        item.cx.push(Problem { key: Some(item.path.clone()), ..problem });
    } else {
        let message = format!("{} {}", problem.file.display(), problem.message);
        item.cx.error(item.at, &item.path, message, problem.help);
    }
}

fn samples(item: &Item) -> Option<Data> {
    let items = item.array()?;
    if items.len() < 2 {
        item.error_help(format!("must have at least two [nm, value] pairs, but has {}", items.len()), "use `constant`");
        return None;
    }
    let mut pairs: Vec<Option<[f64; 2]>> = Vec::with_capacity(items.len());
    for (i, item) in items.iter().enumerate() {
        let pair = item.numbers::<2>("a pair [nm, value]").filter(|[nm, _]| {
            let before = |k: usize| i.checked_sub(k).and_then(|j| pairs[j]).map_or(0.0, |p| p[0]);
            let ascending = *nm > 0.0 && *nm >= before(1) && (i < 2 || *nm > before(2));
            if !ascending {
                item.error_help(
                    format!("wavelengths must be above 0 and ascend, but {nm} follows {}", before(1)),
                    "sort the pairs; two equal wavelengths make a step",
                );
            }
            ascending
        });
        pairs.push(pair);
    }
    let pairs: Vec<[f64; 2]> = pairs.into_iter().collect::<Option<_>>()?;
    let (nm, value) = pairs.into_iter().map(|[nm, value]| (nm, value)).unzip();
    Some(Data::Table { nm, value, file: None })
}

fn regular(item: &Item) -> Option<Data> {
    let fields = item.table(&keys::REGULAR)?;
    const EXAMPLE: &str = "all of { from = 400, to = 700, values = [0.1, 0.8] }";
    let bound = |key: &str| fields.require(key, EXAMPLE).and_then(|item| item.positive());
    let (from, to, values) = (bound("from"), bound("to"), fields.require("values", EXAMPLE));
    let values = values.and_then(|item| {
        let items = item.array()?;
        if items.len() < 2 {
            item.error(format!("must have at least two values, but has {}", items.len()));
            return None;
        }
        let numbers: Vec<_> = items.iter().map(Item::number).collect();
        numbers.into_iter().collect::<Option<Vec<f64>>>()
    });
    let (from, to) = (from?, to?);
    if from >= to {
        fields.get("from")?.error_help(format!("`from` must be less than `to`, but {from} ≥ {to}"), "exchange them");
        return None;
    }
    let value = values?;
    let last = value.len() - 1;
    let nm = (0..=last).map(|i| if i == last { to } else { from + (to - from) * (i as f64 / last as f64) }).collect();
    Some(Data::Table { nm, value, file: None })
}
