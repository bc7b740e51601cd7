//! Spectra as they are written: numbers, tables, files, colours.

use std::path::PathBuf;

use super::super::arrays;
use super::super::decode::{Item, join};
use super::super::keys;
use super::super::texture::is_texture;
use super::super::tree::{Origin, Value};
use crate::error::Problem;
use crate::format::refractive;
use crate::format::said::Said;
use crate::format::text::{self, Column, SpectrumTable};
use crate::format::unit::{Stated, Unit};
use crate::spectral::illuminant::ILLUMINANTS;
use crate::spectral::{Curve, Outside};

/// A spectrum as written, before it is known what it describes.
#[derive(Debug, Clone)]
pub(super) struct Source<'a> {
    pub(super) data: Data<'a>,
    pub(super) scale: f64,
    /// Whether the scene says so, and be it 1.
    pub(super) is_scaled: bool,
    pub(super) outside: Option<Outside>,
    /// The key and place of what `data` was made from.
    pub(super) path: String,
    pub(super) at: &'a Origin,
}

impl<'a> Source<'a> {
    /// What `name` stands for, where `item` says it.
    fn named(name: &str, item: &Item<'a>) -> Source<'a> {
        Source::of(Data::Named(name.to_owned()), item.path.clone(), item.at)
    }

    fn of(data: Data<'a>, path: String, at: &'a Origin) -> Source<'a> {
        Source { data, scale: 1.0, is_scaled: false, outside: None, path, at }
    }

    /// A curve that is known, under the name of one of `[spectra]`.
    pub(super) fn of_curve(name: &str, curve: &Curve) -> Source<'a> {
        let path = join("spectra", name);
        let of = |data| Source::of(data, path, &Origin::Whole);
        match curve {
            Curve::Constant(value) => of(Data::Constant(*value)),
            Curve::Blackbody { kelvin, scale } => Source { scale: *scale, ..of(Data::Blackbody(*kelvin)) },
            Curve::Linear { nm, value, outside } => {
                let table = Data::Table { nm: nm.clone(), value: value.clone(), file: None };
                Source { outside: Some(*outside), ..of(table) }
            }
        }
    }

    /// The names that it is made of, and where each is said.
    pub(super) fn names(&self) -> Vec<(&str, &Source<'a>)> {
        match &self.data {
            Data::Named(name) => vec![(name, self)],
            Data::Mix(parts, _) => parts.iter().flat_map(Source::names).collect(),
            _ => Vec::new(),
        }
    }
}

#[derive(Debug, Clone)]
pub(super) enum Data<'a> {
    Constant(f64),
    Blackbody(f64),
    Table {
        nm: Vec<f64>,
        value: Vec<f64>,
        /// The file that it was read from, if any.
        file: Option<TableFile>,
    },
    Rgb([f64; 3]),
    /// One of [`ILLUMINANTS`].
    Illuminant(&'static str),
    /// What a name stands for.
    Named(String),
    /// Two spectra, and the share of the second.
    Mix(Box<[Source<'a>; 2]>, f64),
}

/// What a file says beside the numbers of a table.
#[derive(Debug, Clone)]
pub(super) struct TableFile {
    pub(super) path: PathBuf,
    /// The line of each value; empty where the file has no lines.
    pub(super) lines: Vec<usize>,
    pub(super) unit: Option<Stated>,
    pub(super) said: Option<(Said, String)>,
    pub(super) notes: Vec<String>,
}

/// A spectrum written as a number or a table. Of an index, what the wavelengths `needed` see has to be sound.
pub(super) fn source<'a>(item: &Item<'a>, needed: Option<[f64; 2]>) -> Option<Source<'a>> {
    let Value::Table(_) = &item.node.value else {
        if !matches!(item.node.value, Value::Integer(_) | Value::Float(_)) {
            item.error_help(
                format!("must be a spectrum, but is {}", item.node.value.kind()),
                match item.node.value {
                    Value::Array(_) => "write { samples = [[nm, value], …] }, a pair for each wavelength",
                    _ => "write a name, a number, or a table such as { file = \"spectrum.csv\" }",
                },
            );
            return None;
        }
        return Some(Source::of(Data::Constant(item.number()?), item.path.clone(), item.at));
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
        Some("illuminant") => kind.choice(&ILLUMINANTS.map(|name| (name, name))).map(Data::Illuminant),
        Some("named") => kind.text().map(|name| Data::Named(name.to_owned())),
        Some("mix") => mix(&kind, fields.get("share"), needed),
        _ => kind.numbers::<3>("three numbers [r, g, b]").map(Data::Rgb),
    }?;
    for key in ["column", "unit"] {
        if let (Some(item), false) = (fields.get(key), fields.has("file")) {
            item.error_help("goes with `file` only", "remove it");
            return None;
        }
    }
    if let (Some(item), false) = (fields.get("share"), fields.has("mix")) {
        item.error_help("goes with `mix` only", "remove it");
        return None;
    }
    if outside.is_some() && !matches!(data, Data::Table { .. } | Data::Rgb(_)) {
        item.cx.warn(format!("`{}.outside` has no effect: the spectrum is not a table", item.path));
    }
    let is_scaled = fields.has("scale");
    Some(Source { data, scale: scale?, is_scaled, outside, path: kind.path, at: kind.at })
}

pub(super) fn file(
    item: &Item,
    column: Option<Item>,
    unit: Option<Item>,
    needed: Option<[f64; 2]>,
) -> Option<Data<'static>> {
    let given = match item.data() {
        Some(arrays::Data::File { name, content }) => Some((PathBuf::from(name), content)),
        _ => None,
    };
    if let (Some(data), None) = (item.data(), &given) {
        if let Some(key) = column.or(unit) {
            key.error_help("goes with the names of files only", "remove it");
            return None;
        }
        if let Some((nm, value)) = data.plain() {
            return Some(Data::Table { nm: nm.to_vec(), value: value.to_vec(), file: None });
        }
        return match data.spectrum() {
            Ok(table) => Some(table_data(table, PathBuf::from(data.name()))),
            Err(problem) => {
                report_in_file(item, *problem);
                None
            }
        };
    }
    let path = match &given {
        Some((name, _)) => name.clone(),
        None => item.cx.path(item.text()?),
    };
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
    if refractive::is_yaml(&path) && given.is_none() {
        if let Some(unit) = unit {
            unit.error_help("goes with tables only", "remove it: these files are in um");
            return None;
        }
        return index_file(item, path, column, needed);
    }
    let read = match given {
        Some((name, content)) => text::parse_file(content, &name, column, unit_of_x),
        None => text::read_spectrum(&path, column, unit_of_x),
    };
    match read {
        Ok(table) => Some(table_data(table, path)),
        Err(problem) => {
            report_in_file(item, *problem);
            None
        }
    }
}

/// `n` (the default) or `k` of a refractiveindex.info file.
pub(super) fn index_file(
    item: &Item,
    path: PathBuf,
    column: Column,
    needed: Option<[f64; 2]>,
) -> Option<Data<'static>> {
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
pub(super) fn column_kelvin(name: &str) -> Option<f64> {
    // The unit of the values may follow: `300 K (cm2/molecule)`.
    let bracket = name.rfind(['(', '[']).filter(|i| name.trim_end().ends_with([')', ']']) && *i > 0);
    let number = name[..bracket.unwrap_or(name.len())].trim_end_matches(['K', 'k', ' ']);
    // A number below 0 is none of kelvins; `kappa-300` is.
    if number.trim_start().starts_with(['-', '\u{2212}']) {
        return None;
    }
    let start = number.rfind(|c: char| !c.is_ascii_digit() && c != '.').map_or(0, |i| i + 1);
    number.get(start..)?.parse().ok().filter(|kelvin: &f64| kelvin.is_finite() && *kelvin > 0.0)
}

pub(super) fn table_data(table: SpectrumTable, path: PathBuf) -> Data<'static> {
    let SpectrumTable { nm, value, line, unit, said, notes } = table;
    Data::Table { nm, value, file: Some(TableFile { path, lines: line, unit, said, notes }) }
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

/// Two spectra, each as it is written in the place of one, and a share.
fn mix<'a>(item: &Item<'a>, share: Option<Item<'a>>, needed: Option<[f64; 2]>) -> Option<Data<'a>> {
    let share = match share {
        Some(item) => item.number_where(|v| (0.0..=1.0).contains(&v), "in [0, 1]"),
        None => Some(0.5),
    };
    let parts = item.array_of::<2>("two spectra")?.map(|part| match &part.node.value {
        Value::String(name) => Some(Source::named(name, &part)),
        _ => source(&part, needed),
    });
    let [Some(first), Some(second)] = parts else { return None };
    Some(Data::Mix(Box::new([first, second]), share?))
}

pub(super) fn samples(item: &Item) -> Option<Data<'static>> {
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

pub(super) fn regular(item: &Item) -> Option<Data<'static>> {
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
