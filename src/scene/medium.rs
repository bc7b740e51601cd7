//! `[media]`: matter that absorbs, scatters and emits.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use super::arrays::Data;
use super::decode::{Fields, Item, did_you_mean, list};
use super::keys;
use super::material::kelvin;
use super::phase::{Pattern, pattern};
use super::spectrum::{Handle, Quantity, Spectra, report_in_file};
use super::tree::Value;
use super::{Absorber, Component, Field, Grid, Medium, MediumId, Scattering};
use crate::format::noise::{self, Range};
use crate::format::said::Said;
use crate::format::table::shown;
use crate::format::unit::{self, Meaning, Measure, Stated};
use crate::format::volume::{self, Volume};

/// An absorption, or a gas by its table.
struct Term {
    strength: f64,
    /// Each of a temperature and a spectrum.
    columns: Vec<(f64, Handle)>,
    /// Whether its table has cross sections: it absorbs by molecules, p / (k T) in a volume.
    by_molecule: bool,
}

/// At which cross sections are made absorptions per atmosphere where the gas has many temperatures, K.
const REFERENCE: f64 = 300.0;

/// Voxels of a medium whose grids of several shapes are divided until they have one.
const MOST_VOXELS: u64 = 1 << 27;

/// A medium as the file defines it.
struct Declared {
    components: Vec<Kind>,
    temperature: Option<Field>,
    taken: Option<MediumId>,
}

/// A kind of matter as the file defines it.
struct Kind {
    absorbers: Vec<Term>,
    scattering: Option<(Handle, Pattern)>,
    density: Field,
}

/// The media of the file, and those in use.
pub struct Media<'a> {
    /// `None` where the definition is wrong, which has been said.
    declared: Vec<(&'a str, Option<Declared>)>,
    scene: Vec<Medium>,
}

impl<'a> Media<'a> {
    pub fn new(item: Option<Item<'a>>, spectra: &mut Spectra<'a>) -> Self {
        let items = item.and_then(|item| item.named_items()).unwrap_or_default();
        let mut grids = Grids::default();
        let declared = items.iter().map(|(name, item)| (*name, decode(item, spectra, &mut grids))).collect();
        Media { declared, scene: Vec::new() }
    }

    /// The medium that `item` names, in the scene.
    pub fn take(&mut self, item: &Item<'a>, spectra: &mut Spectra<'a>) -> Option<MediumId> {
        let name = item.text()?;
        let Some((_, declared)) = self.declared.iter_mut().find(|(known, _)| *known == name) else {
            let names = self.declared.iter().map(|(name, _)| *name);
            let help = did_you_mean(name, names.clone()).unwrap_or_else(|| match self.declared.len() {
                0 => format!("define it: [media.{name}]"),
                _ => format!("[media] has {}", list(names)),
            });
            item.error_help(format!("no medium is named \"{name}\""), help);
            return None;
        };
        let declared = declared.as_mut()?;
        if declared.taken.is_none() {
            let components = declared.components.iter().map(|kind| kind.take(spectra)).collect();
            let temperature = declared.temperature.clone();
            self.scene.push(Medium { name: name.to_owned(), components, temperature });
            declared.taken = Some(self.scene.len() - 1);
        }
        declared.taken
    }

    /// The medium that `item` names, to fill all space: it has no grids, for want of a box, and does not scatter, for want of an
    /// end.
    pub fn take_outer(&mut self, item: &Item<'a>, spectra: &mut Spectra<'a>) -> Option<MediumId> {
        let id = self.take(item, spectra)?;
        let name = &self.scene[id].name;
        if self.scene[id].grid_size().is_some() {
            item.error_help(
                format!("\"{name}\" has a grid, which fills the box of an object, not all space"),
                "use numbers, or give the medium to an object as its `interior`",
            );
            return None;
        }
        if self.scene[id].scatters() {
            item.error_help(
                format!("\"{name}\" scatters, which matter without an end cannot: paths would never leave it"),
                "give the matter a shape: name it as the `interior` of an object around the scene, e.g. a cube or a sphere",
            );
            return None;
        }
        Some(id)
    }

    pub fn finish(self) -> Vec<Medium> {
        self.scene
    }
}

impl Kind {
    fn take(&self, spectra: &mut Spectra) -> Component {
        let absorbers = self.absorbers.iter().map(|Term { strength, columns, .. }| {
            let columns = columns.iter().map(|(kelvin, handle)| (*kelvin, spectra.take(*handle))).collect();
            Absorber { strength: *strength, columns }
        });
        let absorbers = absorbers.collect();
        let scattering = self.scattering.as_ref().map(|(coefficient, pattern)| Scattering {
            coefficient: spectra.take(*coefficient),
            phase: pattern.take(spectra),
        });
        Component { absorbers, scattering, density: self.density.clone() }
    }
}

fn decode<'a>(item: &Item<'a>, spectra: &mut Spectra<'a>, grids: &mut Grids) -> Option<Declared> {
    let fields = item.table(&keys::MEDIUM)?;
    let mut temperature = field(&fields, "temperature", grids, kelvin, Describes::Temperature)?;
    let density = field(&fields, "density", grids, Item::not_negative, Describes::Density)?;
    let density = density.unwrap_or(Field::Constant(1.0));
    let gas_at = temperature.as_ref().map(|field| match field {
        Field::Constant(kelvin) => *kelvin,
        Field::Grid(_) => REFERENCE,
    });
    let mut components = match fields.get("components") {
        None => vec![kind(&fields, density, gas_at, spectra, ", or several `components`")?],
        Some(item) => several(&fields, &item, &density, gas_at, spectra, grids)?,
    };
    let fields_of_all = temperature.iter_mut().chain(components.iter_mut().map(|kind| &mut kind.density));
    one_shape(&fields, fields_of_all.collect())?;
    let absorbers: Vec<&Term> = components.iter().flat_map(|kind| &kind.absorbers).collect();
    check_temperatures(&fields, temperature.as_ref(), &absorbers)?;
    if let Some(Field::Grid(grid)) = &temperature {
        let each = components.into_iter().map(|kind| with_molecules(&fields, kind, grid)).collect::<Option<Vec<_>>>();
        components = each?.into_iter().flatten().collect();
    }
    Some(Declared { components, temperature, taken: None })
}

/// A kind of matter whose gases by cross sections have p / (k T) molecules in a volume: in voxels of many temperatures their density
/// goes by that, which is not that of all else.
fn with_molecules(fields: &Fields, kind: Kind, kelvin: &Grid) -> Option<Vec<Kind>> {
    let Kind { absorbers, scattering, density } = kind;
    let (by_molecule, others): (Vec<Term>, Vec<Term>) = absorbers.into_iter().partition(|term| term.by_molecule);
    if by_molecule.is_empty() {
        return Some(vec![Kind { absorbers: others, scattering, density }]);
    }
    let relative = |i: usize| match &density {
        Field::Constant(density) => *density,
        Field::Grid(grid) => f64::from(grid.values[i]),
    };
    let mut values = Vec::with_capacity(kelvin.values.len());
    for (i, at) in kelvin.values.iter().enumerate() {
        let value = match relative(i) {
            0.0 => 0.0,
            relative => relative * REFERENCE / f64::from(*at),
        };
        if !(value as f32).is_finite() {
            fields.error_help(
                format!("has a grid of temperatures with {at} K, where a gas by cross sections, p / (k T) molecules, has no density"),
                "correct the temperature, or write density 0 there",
            );
            return None;
        }
        values.push(value as f32);
    }
    let molecules = Field::Grid(Arc::new(Grid { size: kelvin.size, values: Arc::new(values) }));
    let gas = Kind { absorbers: by_molecule, scattering: None, density: molecules };
    if others.is_empty() && scattering.is_none() {
        return Some(vec![gas]);
    }
    Some(vec![Kind { absorbers: others, scattering, density }, gas])
}

/// The keys of a kind of matter, which a medium may have itself or in `components`.
const OF_A_KIND: [&str; 5] = ["absorption", "species", "scattering", "phase", "pressure"];

fn several<'a>(
    fields: &Fields<'a>,
    item: &Item<'a>,
    density: &Field,
    gas_at: Option<f64>,
    spectra: &mut Spectra<'a>,
    grids: &mut Grids,
) -> Option<Vec<Kind>> {
    if let Some(key) = OF_A_KIND.into_iter().find(|key| fields.has(key)) {
        fields.get(key)?.error_help("cannot stand beside `components`", "move it into one of them");
        return None;
    }
    let items = item.array()?;
    if items.is_empty() {
        item.error_help("has no components", "write e.g. [[media.NAME.components]] with a scattering");
        return None;
    }
    let one = |item: &Item<'a>| {
        let fields = item.table(&keys::COMPONENT)?;
        let own = field(&fields, "density", grids, Item::not_negative, Describes::Density)?;
        kind(&fields, own.unwrap_or_else(|| density.clone()), gas_at, spectra, "")
    };
    // All of them, so that all mistakes are told at once.
    items.iter().map(one).collect::<Vec<_>>().into_iter().collect()
}

/// `instead`: what else a table may have that has none of these keys.
fn kind<'a>(
    fields: &Fields<'a>,
    density: Field,
    gas_at: Option<f64>,
    spectra: &mut Spectra<'a>,
    instead: &str,
) -> Option<Kind> {
    let (absorption, gases, scattering) = (fields.get("absorption"), fields.get("species"), fields.get("scattering"));
    if absorption.is_none() && gases.is_none() && scattering.is_none() {
        fields.error_help(
            "has neither an absorption nor a scattering",
            format!("add absorption, species or scattering{instead}"),
        );
        return None;
    }
    if let (Some(_), Some(gases)) = (&absorption, &gases) {
        gases.error_help("cannot stand beside `absorption`", "keep one of them, or make two `components`");
        return None;
    }
    let pressure = match fields.get("pressure") {
        Some(item) if gases.is_none() => {
            item.error_help("goes with `species` only", "remove it; `density` scales an absorption");
            None
        }
        Some(item) => item.not_negative(),
        None => Some(1.0),
    };
    let phase = fields.get("phase");
    if let (None, Some(phase)) = (&scattering, &phase) {
        phase.error_help("goes with `scattering` only", "add scattering, per metre, or remove it");
        return None;
    }
    let scattering = match scattering {
        None => Some(None),
        Some(item) => {
            let coefficient = spectra.resolve(&item, Quantity::Scattering);
            let pattern = pattern(phase.as_ref(), spectra);
            coefficient.zip(pattern).map(Some)
        }
    };
    let absorbers = match (absorption, gases) {
        (Some(item), _) => spectra
            .resolve(&item, Quantity::Absorption)
            .map(|handle| vec![Term { strength: 1.0, columns: vec![(0.0, handle)], by_molecule: false }]),
        (None, Some(item)) => species(&item, gas_at, spectra),
        (None, None) => Some(Vec::new()),
    };
    let (scattering, pressure, mut absorbers) = (scattering?, pressure?, absorbers?);
    absorbers.iter_mut().for_each(|term| term.strength *= pressure);
    Some(Kind { absorbers, scattering, density })
}

/// Divides voxels until all grids of a medium have one shape. Each voxel has one value throughout, so that nothing changes.
fn one_shape(fields: &Fields, mut all: Vec<&mut Field>) -> Option<()> {
    let sizes: Vec<[u32; 3]> = (all.iter())
        .filter_map(|field| match field {
            Field::Constant(_) => None,
            Field::Grid(grid) => Some(grid.size),
        })
        .collect();
    let Some(&first) = sizes.first() else { return Some(()) };
    if sizes.iter().all(|size| *size == first) {
        return Some(());
    }
    let common: [u64; 3] =
        std::array::from_fn(|axis| sizes.iter().fold(1, |all, size| least_common_multiple(all, u64::from(size[axis]))));
    let voxels = common.iter().try_fold(1u64, |all, side| all.checked_mul(*side)).filter(|all| *all <= MOST_VOXELS);
    if voxels.is_none() {
        let shape = |[x, y, z]: [u32; 3]| format!("[{z}, {y}, {x}]");
        let mut shapes: Vec<String> = sizes.into_iter().map(shape).collect();
        shapes.dedup();
        fields.error_help(
            format!(
                "has grids of shapes {}, which have no common division of {MOST_VOXELS} voxels or fewer",
                list(shapes.iter().map(String::as_str))
            ),
            "resample them to one shape, or to multiples of one another",
        );
        return None;
    }
    let size = common.map(|side| side as u32);
    for field in &mut all {
        if let Field::Grid(grid) = field
            && grid.size != size
        {
            **field = Field::Grid(Arc::new(divided(grid, size)));
        }
    }
    Some(())
}

fn divided(grid: &Grid, size: [u32; 3]) -> Grid {
    let each: [u32; 3] = std::array::from_fn(|axis| size[axis] / grid.size[axis]);
    let [nx, ny, _] = grid.size.map(|n| n as usize);
    let mut values = Vec::with_capacity(size.iter().map(|n| *n as usize).product());
    for z in 0..size[2] {
        for y in 0..size[1] {
            let row = ((z / each[2]) as usize * ny + (y / each[1]) as usize) * nx;
            values.extend((0..size[0]).map(|x| grid.values[row + (x / each[0]) as usize]));
        }
    }
    Grid { size, values: Arc::new(values) }
}

fn least_common_multiple(a: u64, b: u64) -> u64 {
    let (mut x, mut y) = (a, b);
    while y != 0 {
        (x, y) = (y, x % y);
    }
    // Saturating: what is too large is refused.
    (a / x).saturating_mul(b)
}

/// What tables over temperature say about the medium's: one is needed to choose a column, and where it lies beyond them,
/// the last column is held, which is said.
fn check_temperatures(fields: &Fields, temperature: Option<&Field>, absorbers: &[&Term]) -> Option<()> {
    for (i, Term { columns, .. }) in absorbers.iter().enumerate().filter(|(_, term)| term.columns.len() > 1) {
        let (first, last) = (columns[0].0, columns[columns.len() - 1].0);
        let [low, high] = match temperature {
            None => {
                fields.error_help(
                    format!("has no `temperature`, but the table of species {i} has columns for {first} to {last} K"),
                    "add e.g. temperature = 300.0",
                );
                return None;
            }
            Some(Field::Constant(kelvin)) => [*kelvin; 2],
            Some(Field::Grid(grid)) => {
                let range = |[low, high]: [f32; 2], value: &f32| [low.min(*value), high.max(*value)];
                grid.values.iter().fold([f32::INFINITY, f32::NEG_INFINITY], range).map(f64::from)
            }
        };
        let range = |low: f64, high: f64| if low == high { format!("{low} K") } else { format!("{low}-{high} K") };
        let mut beyond = Vec::new();
        if low < first {
            beyond.push(range(low, high.min(first)));
        }
        if high > last {
            beyond.push(range(low.max(last), high));
        }
        if !beyond.is_empty() {
            fields.cx.warn(format!(
                "`{}.species.{i}`: its table covers {first}-{last} K, not the medium's {}: the nearest column is held there",
                fields.path,
                beyond.join(" and ")
            ));
        }
    }
    Some(())
}

fn species<'a>(item: &Item<'a>, gas_at: Option<f64>, spectra: &mut Spectra<'a>) -> Option<Vec<Term>> {
    const EXAMPLE: &str = "[{ table = \"co2.csv\", fraction = 0.05 }]";
    let items = item.array()?;
    if items.is_empty() {
        item.error_help("has no species", format!("write e.g. species = {EXAMPLE}"));
        return None;
    }
    let mut all = Vec::new();
    let mut total = 0.0;
    for item in &items {
        let one = item.table(&keys::SPECIES).and_then(|fields| {
            let table = fields.require("table", "table = \"co2.csv\"").and_then(|item| spectra.species(&item, gas_at));
            let fraction = fields.require("fraction", "fraction = 0.05, the share of volume").and_then(|item| {
                item.number_where(|share| (0.0..=1.0).contains(&share), "a share of volume in [0, 1]")
            });
            let (columns, by_molecule) = table?;
            Some(Term { strength: fraction?, columns, by_molecule })
        });
        total += one.as_ref().map_or(0.0, |term| term.strength);
        all.push(one);
    }
    let all: Option<Vec<_>> = all.into_iter().collect();
    // Shares such as 0.1 ten times sum to 1 but for rounding.
    if total > 1.0 + 1e-9 {
        item.error_help(format!("the fractions sum to {total}, more than 1"), "they are shares of volume");
        return None;
    }
    all
}

/// What a grid describes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Describes {
    /// K.
    Temperature,
    /// Relative.
    Density,
}

/// A number, or `{ grid = "t.zarr" }`; the inner `None` where the key is absent.
fn field<'a>(
    fields: &Fields<'a>,
    key: &str,
    grids: &mut Grids,
    number: impl Fn(&Item<'a>) -> Option<f64>,
    describes: Describes,
) -> Option<Option<Field>> {
    let Some(item) = fields.get(key) else { return Some(None) };
    if !matches!(item.node.value, Value::Table(_)) {
        return number(&item).map(|value| Some(Field::Constant(value)));
    }
    let grid = item.table(&keys::GRID)?.require("grid", "grid = \"t.zarr\"")?;
    Some(Some(Field::Grid(grids.read(&grid, describes)?)))
}

/// Grids by their path and what they describe: each is read once.
#[derive(Default)]
struct Grids(HashMap<(PathBuf, Describes), Option<Arc<Grid>>>);

impl Grids {
    fn read(&mut self, item: &Item, describes: Describes) -> Option<Arc<Grid>> {
        let key = (item.source()?.1, describes);
        if let Some(known) = self.0.get(&key) {
            return known.clone();
        }
        let grid = match item.data().map_or_else(|| volume::read(&key.0), Data::volume) {
            Ok(volume) => checked(item, volume, describes).map(Arc::new),
            Err(problem) => {
                report_in_file(item, *problem);
                None
            }
        };
        self.0.insert(key, grid.clone());
        grid
    }
}

/// A volume in Spectile's units, without noise; what is missing or impossible is an error.
fn checked(item: &Item, volume: Volume, describes: Describes) -> Option<Grid> {
    let Volume { size, mut values, unit, said, told, notes } = volume;
    let (name, _) = item.source()?;
    notes.iter().for_each(|note| item.cx.warn(format!("{name} {note}")));
    let place = |i: usize| {
        let [nx, ny, _] = size.map(|n| n as usize);
        format!("[{}, {}, {}]", i / (nx * ny), i / nx % ny, i % nx)
    };
    refuse_other_quantities(item, name, &said, describes)?;
    // Where no attribute is that of the unit, a name may say it: `Temperature (C)`.
    let of_name = || {
        let text = said
            .iter()
            .chain(&told)
            .find_map(|text| unit::of_temperature(text))
            .filter(|_| describes == Describes::Temperature)?;
        let measure = unit::parse(&text);
        Some((text, measure))
    };
    if let Some((text, measure)) = unit.or_else(of_name) {
        convert(item, name, Arc::make_mut(&mut values).as_mut_slice(), describes, &text, measure)?;
    }
    if let Some(i) = values.iter().position(|value| value.is_nan()) {
        item.error_help(format!("{name} has no value at {}", place(i)), "fill the gaps");
        return None;
    }
    match noise::find(&values, Range::NotNegative) {
        Ok(None) => {}
        Ok(Some(clipped)) => {
            // What was found is within noise: this cannot fail.
            let _ = noise::clip(Arc::make_mut(&mut values).as_mut_slice(), Range::NotNegative, |v| v as f32);
            item.cx.warn(format!("{name} holds {}", clipped.words(Range::NotNegative)));
        }
        Err(i) => {
            let what = if describes == Describes::Temperature { "temperatures in K" } else { "densities" };
            item.error_help(
                format!("must hold {what}, not negative, but is {} at {}", values[i], place(i)),
                "correct the array",
            );
            return None;
        }
    }
    Some(Grid { size, values })
}

/// Refuses values that attributes call something else than what they are to be.
fn refuse_other_quantities(item: &Item, name: &str, said: &[String], describes: Describes) -> Option<()> {
    for text in said {
        let is_logarithm = Stated::in_name(text).is_some_and(|stated| stated.meaning == Meaning::Logarithm);
        let what = match Said::in_name(text) {
            _ if is_logarithm => "logarithms",
            Some(said @ (Said::Uncertainty | Said::Flags)) => said.noun(),
            Some(Said::Temperature) if describes == Describes::Density => Said::Temperature.noun(),
            // Whatever grows with the matter in a voxel is a density.
            Some(_) if describes == Describes::Density => continue,
            Some(said) if said != Said::Temperature => said.noun(),
            Some(_) => continue,
            // CF's: air_temperature, sea_surface_temperature.
            None if describes == Describes::Density
                && text.to_lowercase().replace(' ', "_").ends_with("_temperature") =>
            {
                "a temperature"
            }
            None => continue,
        };
        let wanted = if describes == Describes::Temperature { "a temperature" } else { "a density" };
        item.error_help(
            format!("{name} calls its values `{}`, {what}, and is to be {wanted}", shown(text)),
            "take another array, or correct the attribute",
        );
        return None;
    }
    Some(())
}

/// Brings values into K, or sees that densities are numbers without a unit.
fn convert(
    item: &Item,
    name: &str,
    values: &mut [f32],
    describes: Describes,
    text: &str,
    measure: Option<Measure>,
) -> Option<()> {
    match (describes, measure) {
        (Describes::Temperature, Some(measure)) if measure.kelvin().is_some() => {
            let kelvin = measure.kelvin()? as f32;
            if kelvin != 1.0 {
                values.iter_mut().for_each(|value| *value *= kelvin);
            }
        }
        (Describes::Temperature, _) if unit::is_celsius(text) => {
            values.iter_mut().for_each(|value| *value = (f64::from(*value) + 273.15) as f32);
            item.cx.warn(format!("{name} is in `{text}`: converted to K"));
        }
        (Describes::Density, Some(measure)) if measure.is_number() => {
            if measure.factor != 1.0 {
                values.iter_mut().for_each(|value| *value = (f64::from(*value) * measure.factor) as f32);
            }
        }
        (Describes::Temperature, _) => {
            item.error_help(format!("must be in K, but {name} is in `{text}`"), "convert it, or correct its `units`");
            return None;
        }
        (Describes::Density, _) => {
            item.error_help(
                format!("is relative, a number without a unit, but {name} is in `{text}`"),
                "divide it by the density at which the absorption was measured, and remove its `units`",
            );
            return None;
        }
    }
    Some(())
}
