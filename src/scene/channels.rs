//! `[channels]`: the intervals of wavelength that are rendered.

use super::decode::{Fields, Item};
use super::keys;
use super::spectrum::report_in_file;
use crate::format::response::{self, Responses};
use crate::format::unit::MICROMETRES_BELOW;
use crate::spectral::{self, Channels, Response};

/// The most channels a cube may have; far beyond the 5,000 that are meant to be used.
const MAX_CHANNELS: u32 = 65_536;
/// Beyond a millimetre geometric optics has nothing to say.
const MAX_NM: f64 = 1e6;
/// nm; the range that Spectile is made and tested for.
const SHORTEST: f64 = 380.0;
const LONGEST: f64 = 20_000.0;
const WAVELENGTHS: &str = "greater than 0 and at most 1000000 (nm)";
/// Units of wavelengths, and how many nm one is.
const UNITS: [(&str, f64); 2] = [("nm", 1.0), ("um", 1e3)];

pub fn decode(item: &Item) -> Option<Channels> {
    let fields = item.table(&keys::CHANNELS)?;
    let kind = fields.exactly_one("kind of channels");
    if let (Some(kind), Some(unit)) =
        (kind.as_ref().filter(|kind| kind.path != "channels.intervals"), fields.get("unit"))
    {
        let help = match kind.path.as_str() {
            "channels.equal" => "write it inside of `equal`: equal = { from = 8, to = 14, unit = \"um\", count = 60 }",
            _ => "remove it",
        };
        unit.error_help("is the unit of `intervals` only", help);
        return None;
    }
    if let Some(kind) = kind.as_ref().filter(|kind| kind.path == "channels.responses") {
        let named = responses(kind);
        let false_colour = match fields.get("false_colour") {
            Some(item) => Some(self::false_colour(&item, named.as_ref().map(Vec::len))?),
            None => None,
        };
        let channels = Channels::from_responses(named?, false_colour);
        warn_of_far_channels(kind, &channels);
        return Some(channels);
    }
    let bounds = kind.as_ref().and_then(|kind| match kind.path.as_str() {
        "channels.equal" => equal(kind),
        "channels.wavenumber" => wavenumber(kind),
        "channels.intervals" => intervals(kind, unit(&fields)?),
        // Refused by the table's key check.
        _ => None,
    });
    let false_colour = match fields.get("false_colour") {
        Some(item) => Some(self::false_colour(&item, bounds.as_ref().map(Vec::len))?),
        None => None,
    };
    let channels = Channels::from_bounds(bounds?, false_colour);
    warn_of_far_channels(&kind?, &channels);
    Some(channels)
}

/// Channels outside of what the renderer is made for are rendered, with a word; whose numbers look like micrometres are told so.
fn warn_of_far_channels(kind: &Item, channels: &Channels) {
    // A response may have tails.
    let far = |k: &usize| match channels.responses.get(*k) {
        Some(_) => !(SHORTEST..=LONGEST).contains(&channels.centre(*k)),
        None => channels.bounds[*k][0] < SHORTEST || channels.bounds[*k][1] > LONGEST,
    };
    let found: Vec<[f64; 2]> = (0..channels.len()).filter(far).map(|k| channels.bounds[k]).collect();
    let Some(hull) = spectral::hull(found.iter().copied()) else { return };
    let all = channels.bounds.iter().flatten().copied();
    let hint = if all.fold(0.0, f64::max) < MICROMETRES_BELOW {
        match channels.responses.is_empty() {
            true => "; the numbers look like micrometres: write unit = \"um\"",
            false => "; the numbers look like micrometres: say so in the name of the file's column, `wavelength (um)`",
        }
    } else {
        ""
    };
    kind.cx.warn(format!(
        "`{}`: {} of {} channels, between {} and {} nm, lie outside of {SHORTEST} to {LONGEST} nm{hint}",
        kind.path,
        found.len(),
        channels.len(),
        hull[0],
        hull[1]
    ));
}

/// The responses in the file that `item` names.
fn responses(item: &Item) -> Option<Vec<(String, Response)>> {
    let path = item.cx.path(item.text()?);
    let Responses { named, warnings } =
        response::read_responses(&path).map_err(|problem| report_in_file(item, *problem)).ok()?;
    if let Some((name, response)) = named.iter().find(|(_, response)| response.support()[1] > MAX_NM) {
        let message = format!("the response of the channel \"{name}\" reaches {} nm", response.support()[1]);
        item.error_help(message, format!("wavelengths must be {WAVELENGTHS}"));
        return None;
    }
    warnings.into_iter().for_each(|warning| item.cx.warn(warning));
    Some(named)
}

/// What a `unit` is in nm.
fn unit(fields: &Fields) -> Option<f64> {
    let Some(item) = fields.get("unit") else { return Some(1.0) };
    // The sign for micro is a character of its own beside the Greek letter.
    let is_micro = matches!(item.text()?, "\u{b5}m" | "\u{3bc}m");
    if is_micro { Some(1e3) } else { item.choice(&UNITS) }
}

/// A wavelength in nm, written in a unit.
fn wavelength(item: &Item, unit: f64) -> Option<f64> {
    let range = match unit {
        1.0 => WAVELENGTHS,
        _ => "greater than 0 and at most 1000 (um)",
    };
    item.number_where(|value| value > 0.0 && value * unit <= MAX_NM, range).map(|value| value * unit)
}

/// `from` < `to` and `count` of a table, `from` and `to` read by `number`.
fn range(fields: &Fields, example: &str, number: impl Fn(&Item) -> Option<f64>) -> Option<(f64, f64, usize)> {
    let bound = |key: &str| fields.require(key, example).and_then(|item| number(&item));
    let (from, to) = (bound("from"), bound("to"));
    let count = fields.require("count", example).and_then(|item| item.whole(1..=MAX_CHANNELS));
    let (from, to) = (from?, to?);
    if from >= to {
        fields.get("from")?.error_help(format!("`from` must be less than `to`, but {from} ≥ {to}"), "exchange them");
        return None;
    }
    Some((from, to, count? as usize))
}

fn equal(item: &Item) -> Option<Vec<[f64; 2]>> {
    const EXAMPLE: &str = "all of { from = 380, to = 780, count = 400 }";
    let fields = item.table(&keys::EQUAL)?;
    let unit = unit(&fields)?;
    let (from, to, count) = range(&fields, EXAMPLE, |item| wavelength(item, unit))?;
    not_empty(item, Channels::equal(from, to, count).bounds)
}

/// Equal steps of wavenumber, in ascending nanometres.
fn wavenumber(item: &Item) -> Option<Vec<[f64; 2]>> {
    const EXAMPLE: &str = "all of { from = 500, to = 5000, count = 1000 }";
    let per_cm = |item: &Item| item.number_where(|v| v >= 1e7 / MAX_NM, "at least 10 (cm-1, a wavelength of 1 mm)");
    let (from, to, count) = range(&item.table(&keys::WAVENUMBER)?, EXAMPLE, per_cm)?;
    let edges = Channels::equal(from, to, count).bounds;
    not_empty(item, edges.iter().rev().map(|[low, high]| [1e7 / high, 1e7 / low]).collect())
}

fn intervals(item: &Item, unit: f64) -> Option<Vec<[f64; 2]>> {
    let items = item.array()?;
    if items.is_empty() || items.len() > MAX_CHANNELS as usize {
        let help = "list [from, to] pairs in nm, e.g. [[380, 390], [8000, 12000]]";
        item.error_help(format!("must have 1 to {MAX_CHANNELS} intervals, but has {}", items.len()), help);
        return None;
    }
    let pair = |item: &Item| {
        let [from, to] = item.array_of::<2>("two wavelengths [from, to]")?;
        let (from, to) = (wavelength(&from, unit), wavelength(&to, unit));
        let (from, to) = (from?, to?);
        if from >= to {
            item.error_help(format!("must be [from, to] with from less than to, but {from} ≥ {to}"), "exchange them");
            return None;
        }
        Some([from, to])
    };
    let pairs: Vec<_> = items.iter().map(pair).collect();
    pairs.into_iter().collect()
}

/// Channels so narrow that rounding leaves nothing of them are an error.
fn not_empty(item: &Item, bounds: Vec<[f64; 2]>) -> Option<Vec<[f64; 2]>> {
    if bounds.iter().any(|[a, b]| a >= b) {
        item.error_help("the channels are too narrow to be told apart", "use fewer channels or a wider range");
        return None;
    }
    Some(bounds)
}

fn false_colour(item: &Item, count: Option<usize>) -> Option<[usize; 3]> {
    let items = item.array_of::<3>("three channel numbers [r, g, b]")?;
    let last = count.map_or(MAX_CHANNELS, |count| count as u32) - 1;
    let numbers = items.each_ref().map(|item| item.whole(0..=last));
    numbers.iter().all(Option::is_some).then(|| numbers.map(|n| n.unwrap_or_default() as usize))
}
