//! Spectra: named ones (`[spectra]`) and those written where they are used; from any source to a [`Curve`].

mod quantity;
mod written;

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

pub use self::quantity::Quantity;
pub use self::written::report_in_file;
use self::written::{Data, Source, TableFile, column_kelvin, source, table_data};
use super::context::Context;
use super::decode::{Item, did_you_mean, list};
use super::tree::{Value, parse_document};
use super::{Definition, Spectrum, SpectrumId};
use crate::error::{Error, Problem};
use crate::format::noise;
use crate::format::refractive;
use crate::format::said::Said;
use crate::format::table::shown;
use crate::format::text::{self, SpectrumTable};
use crate::format::unit::{Density, Meaning, Stated};
use crate::spectral::illuminant::illuminant;
use crate::spectral::{Channels, Curve, Outside, SOLAR, columns, hull, upsample};

/// Wavelengths, in nm, far beyond any channel, between which a curve's peak is looked for.
const SHORTEST: f64 = 1e-3;
const LONGEST: f64 = 1e15;

/// Where black bodies of mixtures are known if there are no channels, nm.
const BLACK_BODIES: [f64; 2] = [100.0, 1e5];

/// Irradiances of the sun that need no definition, by column of the built-in table.
const STANDARDS: [&str; 2] = ["am0", "am1.5"];

fn standard(name: &str) -> Option<Curve> {
    let column = STANDARDS.iter().position(|known| *known == name)?;
    let (nm, value) = columns::<3>(SOLAR).map(|row| (row[0], row[1 + column])).unzip();
    Some(Curve::Linear { nm, value, outside: Outside::Zero })
}

/// An irradiance that is not part of a scene, written as the `irradiance` of its sun is: a number, `am0` or `am1.5`, a table such as
/// `{ file = "sun.csv", column = "direct" }`; or a file alone. With what is to be said about it over `channels`. `option` names it in
/// messages.
///
/// # Errors
/// As a scene file that has it.
pub fn irradiance(option: &str, written: &str, channels: &Channels) -> crate::Result<(Curve, Vec<String>)> {
    let is_toml = written.trim_start().starts_with(['{', '"', '\'']) || written.trim().parse::<f64>().is_ok();
    let value = match written.trim() {
        value if is_toml => value.to_owned(),
        name if STANDARDS.contains(&name) => format!("\"{name}\""),
        file => format!("{{ file = \"{}\" }}", file.escape_default()),
    };
    let text = format!("irradiance = {value}\n");
    let cx = Context::new(Path::new(option), &text, &[]);
    let root = parse_document(&text).map_err(|_| Error::Usage(format!("{option} {written}: is not valid TOML")))?;
    let curve = {
        let entry = &root[0];
        let item = Item { cx: &cx, node: &entry.node, path: entry.key.clone(), at: &entry.node.origin };
        let mut spectra = Spectra::new(&cx, None, Some(channels.clone()));
        let found = spectra.resolve(&item, Quantity::Irradiance).map(|handle| spectra.take(handle));
        found.map(|id| spectra.finish().swap_remove(id).curve)
    };
    match (curve, cx.finish()) {
        (Some(curve), (problems, warnings)) if problems.is_empty() => Ok((curve, warnings)),
        (_, (problems, _)) => Err(Error::Input(problems)),
    }
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
    definition: Option<Definition>,
    warnings: Vec<String>,
    taken: Option<SpectrumId>,
}

/// All spectra of a scene: the named ones, and every one that was asked for.
pub struct Spectra<'a> {
    cx: &'a Context<'a>,
    /// `None` where the definition is wrong, which has been said.
    named: Vec<(&'a str, Option<Source<'a>>)>,
    /// What names stand for within spectra, where that is not `named`.
    meant: Option<Vec<(&'a str, Option<Source<'a>>)>>,
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
        let (by_name, checked, scene) = (HashMap::new(), Vec::new(), Vec::new());
        let mut spectra = Spectra { cx, named: Vec::new(), meant: None, by_name, checked, scene, channels };
        spectra.define(item);
        spectra
    }

    fn define(&mut self, item: Option<Item<'a>>) {
        let items = item.and_then(|item| item.named_items()).unwrap_or_default();
        let needed = self.channel_hull();
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
        self.named = items.into_iter().map(define).collect();
        // Also what nothing uses.
        self.named.iter().flat_map(|(_, source)| source).for_each(|source| self.check_names(source));
    }

    /// What names stand for within spectra.
    fn known(&self) -> &[(&'a str, Option<Source<'a>>)] {
        self.meant.as_ref().unwrap_or(&self.named)
    }

    /// Refuses names that `source` is made of and that there are not.
    fn check_names(&self, source: &Source<'a>) {
        let known = || self.known().iter().map(|(name, _)| *name);
        for (name, said) in source.names() {
            if known().any(|known| known == name) {
                continue;
            }
            let help = did_you_mean(name, known()).unwrap_or_else(|| match known().next() {
                None => format!("define it: [spectra.{name}]"),
                Some(_) => format!("[spectra] has {}", list(known())),
            });
            self.cx.error(said.at, &said.path, format!("no spectrum is named \"{name}\""), Some(help));
        }
    }

    /// The same where spectra that are made of others, by `named` and `mix`, mean `known` by their names, and not each other.
    pub fn meaning(
        cx: &'a Context<'a>,
        item: Option<Item<'a>>,
        channels: Option<Channels>,
        known: &[(&'a str, &Curve)],
    ) -> Self {
        let meant = known.iter().map(|(name, curve)| (*name, Some(Source::of_curve(name, curve)))).collect();
        let mut spectra = Spectra::new(cx, None, channels);
        spectra.meant = Some(meant);
        spectra.define(item);
        spectra
    }

    /// The spectrum that `item` names or spells, checked for what it is to describe.
    pub fn resolve(&mut self, item: &Item<'a>, quantity: Quantity) -> Option<Handle> {
        let Value::String(name) = &item.node.value else {
            let source = source(item, self.channel_hull())?;
            self.check_names(&source);
            return self.check(&source, &item.path, item, quantity);
        };
        let Some((_, definition)) = self.named.iter().find(|(known, _)| known == name) else {
            if let (Quantity::Irradiance, Some(curve)) = (quantity, standard(name)) {
                return Some(self.standard(name, curve));
            }
            let of_the_sun = if quantity == Quantity::Irradiance { &STANDARDS[..] } else { &[] };
            let names = self.named.iter().map(|(name, _)| *name).chain(of_the_sun.iter().copied());
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
        if let Some(handle) = handle {
            let checked = &mut self.checked[handle];
            let curve = Arc::new(checked.curve.clone());
            checked.definition =
                Some(Definition { name: name.clone(), quantity, curve, scale: 1.0, is_complement: false });
        }
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
            let source =
                Source { data, scale: 1.0, is_scaled: false, outside: None, path: item.path.clone(), at: item.at };
            self.check(&source, &format!("{} ({name})", item.text()?), item, quantity)
        };
        let (n, k) = (n?, k?);
        let (n, k) = (part("n", n, Quantity::Index), part("k", k, Quantity::Extinction));
        n.zip(k)
    }

    /// The columns of the file that `item` names, absorption of a species at temperatures: K, ascending, and a spectrum. And whether
    /// they are cross sections, which are made absorptions per atmosphere of a gas of `gas_at` kelvins, by default the column's own.
    pub fn species(&mut self, item: &Item<'a>, gas_at: Option<f64>) -> Option<(Vec<(f64, Handle)>, bool)> {
        let written = item.text()?;
        let path = item.cx.path(written);
        let columns = text::read_columns(&path).map_err(|problem| report_in_file(item, *problem)).ok()?;
        let mut found = Vec::new();
        let mut cross_sections = 0;
        for (name, table) in columns {
            let kelvin = column_kelvin(&name);
            if kelvin.is_none() {
                item.error_help(
                    format!("the columns of {} must be named by temperatures, but one is \"{name}\"", path.display()),
                    "write a header such as nm,300,600,1000: temperatures in K",
                );
                return None;
            }
            let kelvin = kelvin?;
            let (table, is_cross_section) = per_atmosphere(table, gas_at.unwrap_or(kelvin));
            cross_sections += usize::from(is_cross_section);
            let data = table_data(table, path.clone());
            let source =
                Source { data, scale: 1.0, is_scaled: false, outside: None, path: item.path.clone(), at: item.at };
            found.push((kelvin, self.check(&source, &format!("{written} ({kelvin} K)"), item, Quantity::Absorption)?));
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        if let Some(same) = found.windows(2).find(|w| w[0].0 == w[1].0) {
            item.error_help(format!("{} has two columns for {} K", path.display(), same[0].0), "remove one");
            return None;
        }
        if cross_sections != 0 && cross_sections != found.len() {
            item.error_help(
                format!("{} has {cross_sections} columns of cross sections among {}", path.display(), found.len()),
                "write all of a species in one unit",
            );
            return None;
        }
        Some((found, cross_sections != 0))
    }

    /// The index of a checked spectrum in the scene. Equal curves of one definition share one.
    pub fn take(&mut self, handle: Handle) -> SpectrumId {
        let spectrum = &mut self.checked[handle];
        if let Some(id) = spectrum.taken {
            return id;
        }
        spectrum.warnings.drain(..).for_each(|warning| self.cx.warn(warning));
        // What has names of its own may be exchanged by itself (factored cubes).
        let is_same = |other: &Spectrum| other.curve == spectrum.curve && other.definition == spectrum.definition;
        let same = self.scene.iter().position(is_same);
        let id = same.unwrap_or_else(|| {
            let Checked { name, curve, definition, .. } = spectrum;
            self.scene.push(Spectrum { name: name.clone(), curve: curve.clone(), definition: definition.clone() });
            self.scene.len() - 1
        });
        spectrum.taken = Some(id);
        id
    }

    /// A curve that no spectrum of the file describes.
    pub fn add(&mut self, name: &str, curve: Curve) -> Handle {
        let (name, warnings) = (name.to_owned(), Vec::new());
        self.checked.push(Checked { name, curve, definition: None, warnings, taken: None });
        self.checked.len() - 1
    }

    /// The index in the scene of a curve that no spectrum of the file describes. Equal curves share one.
    pub fn curve(&mut self, name: &str, curve: Curve) -> SpectrumId {
        let handle = self.add(name, curve);
        self.take(handle)
    }

    /// A spectrum that is known without a definition.
    fn standard(&mut self, name: &str, curve: Curve) -> Handle {
        let Curve::Linear { nm, .. } = &curve else { unreachable!("standards are tables") };
        let gap = self.uncovered(nm[0], nm[nm.len() - 1]);
        let handle = self.add(name, curve);
        self.checked[handle].warnings =
            gap.map(|gap| format!("the standard `{name}` does not cover {gap}: it is 0 there")).into_iter().collect();
        handle
    }

    /// Whether `item` names a spectrum that is known without a definition, and that the file does not define.
    pub fn is_standard(&self, item: &Item) -> bool {
        matches!(&item.node.value, Value::String(name)
            if STANDARDS.contains(&name.as_str()) && !self.named.iter().any(|(known, _)| known == name))
    }

    /// `handle` times `factor`.
    pub fn times(&mut self, handle: Handle, factor: f64) -> Handle {
        let Checked { name, curve, definition, warnings, .. } = &self.checked[handle];
        let definition = definition.as_ref().filter(|definition| !definition.is_complement);
        let scaled = Checked {
            name: name.clone(),
            curve: curve.scaled(factor),
            definition: definition.map(|of| Definition { scale: of.scale * factor, ..of.clone() }),
            warnings: warnings.clone(),
            taken: None,
        };
        self.checked.push(scaled);
        self.checked.len() - 1
    }

    /// One minus `handle`, a share.
    pub fn complement(&mut self, handle: Handle) -> Handle {
        let Checked { name, curve, definition, warnings, .. } = &self.checked[handle];
        let definition = definition.as_ref().filter(|definition| definition.scale == 1.0);
        let definition = definition.map(|of| Definition { is_complement: !of.is_complement, ..of.clone() });
        let curve = match curve {
            Curve::Constant(value) => Curve::Constant(1.0 - value),
            Curve::Linear { nm, value, outside: Outside::Hold } => {
                Curve::Linear { nm: nm.clone(), value: value.iter().map(|v| 1.0 - v).collect(), outside: Outside::Hold }
            }
            Curve::Linear { .. } | Curve::Blackbody { .. } => {
                unreachable!("refused for shares whose complement is asked")
            }
        };
        let (name, warnings) = (format!("1 - {name}"), warnings.clone());
        self.checked.push(Checked { name, curve, definition, warnings, taken: None });
        self.checked.len() - 1
    }

    /// `handle`, a radiance, times the number of at least 0 that `item` holds.
    pub fn scaled(&mut self, handle: Handle, item: &Item) -> Option<Handle> {
        let scaled = self.times(handle, item.not_negative()?);
        let peak = self.checked[scaled].curve.max(SHORTEST, LONGEST);
        if !Quantity::Radiance.allows(peak) {
            item.error(format!("{}, but is {peak:e} after scaling", Quantity::Radiance.range()));
            return None;
        }
        Some(scaled)
    }

    /// The curve of a checked spectrum.
    pub fn checked_curve(&self, handle: Handle) -> &Curve {
        &self.checked[handle].curve
    }

    /// The channels, where they are right.
    pub fn channels(&self) -> Option<&Channels> {
        self.channels.as_ref()
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
        let mut warnings = Vec::new();
        let curve = self.curve_of(source, name, user, quantity, &[], &mut warnings)?;
        self.checked.push(Checked { name: name.to_owned(), curve, definition: None, warnings, taken: None });
        Some(self.checked.len() - 1)
    }

    /// What `source` is, checked. `within`: the names in whose definitions it stands.
    fn curve_of(
        &self,
        source: &Source<'a>,
        name: &str,
        user: &Item<'a>,
        quantity: Quantity,
        within: &[&str],
        warnings: &mut Vec<String>,
    ) -> Option<Curve> {
        let used_by =
            if source.path.starts_with(&user.path) { String::new() } else { format!("; used by `{}`", user.path) };
        let refuse = |value: String| {
            let message = format!("{}, but is {value}{used_by}", quantity.range());
            self.cx.error(source.at, &source.path, message, None);
        };
        let is_index = quantity.is_index();
        if quantity == Quantity::Emissivity && source.outside == Some(Outside::Zero) {
            let help = "remove `outside`, or write outside = \"hold\"; a reflectance may be 0 there";
            let message = format!("an emissivity is held outside its table, where it is not known{used_by}");
            self.cx.error(source.at, &source.path, message, Some(help.to_owned()));
            return None;
        }
        if is_index && !quantity.allows(0.0) && source.outside == Some(Outside::Zero) {
            let help = "remove `outside`, or write outside = \"hold\"";
            let message = format!("an index of refraction cannot be 0 outside its table{used_by}");
            self.cx.error(source.at, &source.path, message, Some(help.to_owned()));
            return None;
        }
        Some(match &source.data {
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
                self.tabulated(&table, user, quantity, &refuse, warnings)?
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
                self.rgb_outside(curve, source.outside, name, warnings)
            }
            Data::Illuminant(of) => {
                let curve = illuminant(of).filter(|_| quantity.is_light());
                let Some(curve) = curve else {
                    refuse(format!("the illuminant {of}, which is light"));
                    return None;
                };
                if let Curve::Linear { nm, .. } = &curve {
                    let gap = self.uncovered(nm[0], nm[nm.len() - 1]);
                    warnings.extend(gap.map(|gap| format!("the illuminant {of} does not cover {gap}: it is 0 there")));
                }
                self.in_range(curve.scaled(source.scale), quantity, &refuse)?
            }
            Data::Named(of) => {
                // A name that there is not has been refused.
                let (of, definition) = self.known().iter().find(|(known, _)| known == of)?;
                if within.contains(of) {
                    let help = "name another, or write what it is";
                    self.cx.error(source.at, &source.path, format!("`{of}` is made of itself"), Some(help.to_owned()));
                    return None;
                }
                let curve =
                    self.curve_of(definition.as_ref()?, of, user, quantity, &[within, &[of]].concat(), warnings)?;
                self.in_range(curve.scaled(source.scale), quantity, &refuse)?
            }
            Data::Mix(parts, share) => {
                let mut part = |i: usize| self.curve_of(&parts[i], name, user, quantity, within, warnings);
                let (first, second) = (part(0), part(1));
                let mixed = first?.mixed(&second?, *share, self.channel_hull().unwrap_or(BLACK_BODIES));
                self.in_range(mixed.scaled(source.scale), quantity, &refuse)?
            }
        })
    }

    /// `curve`, or what of it is not allowed is refused.
    fn in_range(&self, curve: Curve, quantity: Quantity, refuse: &dyn Fn(String)) -> Option<Curve> {
        let wrong = match &curve {
            Curve::Linear { value, .. } => value.iter().copied().find(|v| !quantity.allows(*v)),
            other => Some(other.max(SHORTEST, LONGEST)).filter(|v| !quantity.allows(*v)),
        };
        if let Some(value) = wrong {
            refuse(format!("{value:e}"));
            return None;
        }
        Some(curve)
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
        if let (Quantity::Absorption, Some(file @ TableFile { said: Some((Said::Extinction, _)), .. })) =
            (quantity, table.file)
        {
            let (nm, value, lines) = absorption_of(table.nm, table.value, &file.lines);
            let mut file = TableFile { lines, said: None, ..file.clone() };
            file.notes.push("gives k of an index of refraction: absorption is taken as 4 π k / λ".to_owned());
            let table = Tabulated { nm: &nm, value: &value, file: Some(&file), ..*table };
            return self.tabulated(&table, user, quantity, refuse, warnings);
        }
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
            (Outside::Zero, Quantity::Efficiency) => Some("it is 0 there"),
            (Outside::Zero, _) => None,
        };
        if let (Some(instead), None) = (instead, source.outside) {
            let (first, last) = (nm[0], nm[nm.len() - 1]);
            let noun = quantity.noun();
            // Databases of indices say their unit, and have pages for other parts of the spectrum.
            if self.meets_no_channel(first, last) && !quantity.is_optical_constant() {
                user.error_help(
                    format!("spectrum `{name}` ({noun}) lies at {first} to {last} nm, beside all channels"),
                    "say its unit, such as unit = \"um\"; or, if what is beyond its ends is meant, outside = \"hold\" or \"zero\"",
                );
                return None;
            }
            warnings.extend(
                self.uncovered(first, last)
                    .map(|gap| format!("spectrum `{name}` ({noun}) does not cover {gap}: {instead}")),
            );
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
        let path = file.path.display();
        let is_scaled = table.source.is_scaled;
        if let Some((said, text)) = file.said.as_ref().filter(|(said, _)| !quantity.may_be(*said)) {
            let text = shown(text);
            let (noun, wanted) = (said.noun(), quantity.noun());
            if !is_scaled {
                user.error_help(
                    format!("{path} calls its values `{text}`, {noun}, and is to be {wanted}"),
                    format!("take another column or file; if they make {wanted} as they are, say so: `scale = 1`"),
                );
                return None;
            }
            warnings.push(format!("{path} calls its values `{text}`: times `scale` they are taken as {wanted}"));
        }
        let Some(Stated { meaning, text, certain }) = &file.unit else { return Some(()) };
        let taken_as =
            if quantity.unit().is_empty() { "as they are".to_owned() } else { format!("in {}", quantity.unit()) };
        let measure = match meaning {
            Meaning::Unit(_) if !certain && is_scaled && file.unit.as_ref().is_some_and(Stated::is_percent) => {
                warnings.push(format!("{path} says `{}`: it is taken that `scale` sees to that", shown(text)));
                return Some(());
            }
            Meaning::Unit(measure) => measure,
            Meaning::Logarithm => {
                user.error_help(
                    format!("{path} gives logarithms, or K/S, as its values (`{text}`)"),
                    "write the values themselves",
                );
                return None;
            }
            Meaning::Factor if is_scaled => {
                warnings.push(format!(
                    "{path} says `{}` of its values: they are taken as written, times `scale`",
                    shown(text)
                ));
                return Some(());
            }
            Meaning::Factor => {
                user.error_help(
                    format!("{path} says `{}` of its values, which is not applied", shown(text)),
                    "say in the scene what they are to be multiplied by, `scale = …` (1 if nothing), or write the values so",
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
                // Who knows the unit may have meant to convert it.
                let scale = table.source.scale;
                if let Density::Plain(factor) = density
                    && (scale / factor - 1.0).abs() < 1e-9
                {
                    warnings.push(format!(
                        "{path} says `{}`, which is applied, and `scale` = {scale} besides: together {factor:e} twice (leave `scale` out \
                         where it is meant for the unit)",
                        shown(text)
                    ));
                }
                value.iter_mut().zip(table.nm).for_each(|(value, nm)| *value = density.apply(*value, *nm));
            }
            // What is relative has no unit.
            None if measure.is_number() && measure.factor == 1.0 => {}
            None => {
                let message =
                    format!("gives its values in the unit of `{text}`, which is not that of {}", quantity.noun());
                if *certain {
                    let is_cross_section = measure.cross_section_per_atmosphere(1.0).is_some();
                    let help = if quantity == Quantity::Absorption && is_cross_section {
                        "multiply them by the molecules in a volume, p / (k T); or write them as a table of a `species`, \
                         with the temperature: `nu (cm-1),300 K (cm2/molecule)`"
                            .to_owned()
                    } else {
                        let unit = if quantity.unit().is_empty() { "numbers without a unit" } else { quantity.unit() };
                        format!("convert them to {unit}, or correct the header")
                    };
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

    /// Whether there are channels, and none of them between `first` and `last` nm.
    fn meets_no_channel(&self, first: f64, last: f64) -> bool {
        let bounds = self.channels.iter().flat_map(|channels| &channels.bounds);
        bounds.clone().next().is_some() && bounds.clone().all(|[from, to]| *to < first || *from > last)
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

/// The absorption per metre of a k that is linear between wavelengths, 4 π k / λ, at these and between them so close that a line is as
/// good; and the line of each.
fn absorption_of(nm: &[f64], k: &[f64], lines: &[usize]) -> (Vec<f64>, Vec<f64>, Vec<usize>) {
    /// Of neighbours: a line between them is off by an eighth of its square at most.
    const STEP: f64 = 0.002;
    let per_metre = |nm: f64, k: f64| 4.0 * std::f64::consts::PI * k / (nm * 1e-9);
    let mut found = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..nm.len() {
        let line = lines.get(i).copied();
        if let Some(before) = i.checked_sub(1) {
            let pieces = ((nm[i] / nm[before]).ln() / STEP).ceil().min(5000.0);
            for piece in 1..pieces as usize {
                let share = piece as f64 / pieces;
                let (x, k) = (nm[before] + share * (nm[i] - nm[before]), k[before] + share * (k[i] - k[before]));
                found.0.push(x);
                found.1.push(per_metre(x, k));
                found.2.extend(line);
            }
        }
        found.0.push(nm[i]);
        found.1.push(per_metre(nm[i], k[i]));
        found.2.extend(line);
    }
    found
}

/// The table of a species at `kelvin` in m⁻¹ atm⁻¹, if it has cross sections; and whether it has.
fn per_atmosphere(mut table: SpectrumTable, kelvin: f64) -> (SpectrumTable, bool) {
    if let Some(Stated { meaning: Meaning::Unit(measure), .. }) = &table.unit
        && let Some(factor) = measure.cross_section_per_atmosphere(kelvin)
    {
        table.value.iter_mut().for_each(|value| *value *= factor);
        table.unit = None;
        return (table, true);
    }
    (table, false)
}

/// A value as it is written, with what it is multiplied by.
fn scaled_words(value: f64, scale: f64) -> String {
    if scale == 1.0 { value.to_string() } else { format!("{value} x scale {scale}") }
}
