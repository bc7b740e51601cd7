//! What a file says of its values' unit, in the names of columns and in sentences.

use super::super::said::Said;
use super::places::{
    self, AtEnd, at_end, bracketed, looks_like_unit, spaced, spectral_power_at_end, spells_power, spelt_power,
};
use super::sentence::{
    begins_with_factor, has_arithmetic, has_factor, is_logarithm, is_percent, is_percent_of, is_power_of_ten,
    is_relative, is_up_to_hundred, is_without_its_marks,
};
use super::spelling::{is_quantity, plain, words};
use super::{KELVIN, LUMEN, Measure, is_celsius, parse, speaks_of_percent, states_a_factor};

const PERCENT: Meaning = Meaning::Unit(Measure { factor: 0.01, ..Measure::ONE });

/// What a file says of its values' unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Stated {
    pub meaning: Meaning,
    /// What says so.
    pub text: String,
    /// Whether it can be nothing but a unit.
    pub certain: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Meaning {
    Unit(Measure),
    /// That of something else than the values themselves: their logarithms, K/S, a derivative, their inverse.
    Logarithm,
    /// A unit that is not known here.
    Unknown,
    /// A factor, or percent, of which it is not plain whether it is applied already.
    Factor,
}

impl Stated {
    /// What the text of a key for units says; `None` if that is not understood.
    pub fn of(text: &str) -> Option<Stated> {
        let measure = parse(text)?;
        Some(Stated { meaning: Meaning::Unit(measure), text: text.trim().to_owned(), certain: true })
    }

    /// The unit of spectral power that a sentence speaks of, if there is just one: what stands in its brackets, or a run of its
    /// words; or that values are in percent.
    pub fn in_sentence(text: &str) -> Option<Stated> {
        let measure = places::spectral_power_within(&plain(text))
            .or_else(|| speaks_of_percent(text).then_some(Measure { factor: 0.01, ..Measure::ONE }))?;
        Some(Stated { meaning: Meaning::Unit(measure), text: text.trim().to_owned(), certain: false })
    }

    /// Whether what is said is a share or a plain number.
    pub fn is_number(&self) -> bool {
        matches!(self.meaning, Meaning::Unit(measure) if measure.is_number())
    }

    /// Whether values are said to be percent.
    pub fn is_percent(&self) -> bool {
        self.meaning == PERCENT
    }

    /// The unit in the name of a column of values: in brackets, at the end of its words, after a comma (where W may as well
    /// be the west), or a percent sign at either end. What does not look like a unit is a part of the name.
    pub fn in_name(name: &str) -> Option<Stated> {
        let text = plain(name);
        let stated = |meaning, certain| Some(Stated { meaning, text: name.to_owned(), certain });
        if is_logarithm(&text) {
            return stated(Meaning::Logarithm, true);
        }
        let Some(inner) = bracketed(&text).map(str::trim).filter(|inner| !inner.is_empty()) else {
            return Stated::outside(&text, name);
        };
        let outside = || text.replacen(inner, "", 1).replace("()", " ").replace("[]", " ");
        // A number by itself is that of a sample, or a factor that is or is not applied.
        if inner.starts_with(|c: char| c.is_ascii_digit()) && parse(inner).is_some_and(Measure::is_number) {
            let is_factor = inner.contains(['e', 'E', '^']) || is_power_of_ten(inner);
            return if is_factor { stated(Meaning::Factor, true) } else { Stated::outside(&outside(), name) };
        }
        // A number within the unit belongs to it: (10^-6 W m-2).
        if parse(inner).is_none() && states_a_factor(inner) || has_factor(&text.replacen(inner, "", 1)) {
            return stated(Meaning::Factor, true);
        }
        // A unit by a line of its own, or in brackets: %R, Abs, which of a reflectance is that it is absolute.
        if is_percent_of(inner) || (is_up_to_hundred(inner) && words(&text.to_lowercase()).any(is_quantity)) {
            return stated(PERCENT, true);
        }
        let before = text.split(['(', '[']).next().unwrap_or("");
        let is_absolute = inner.to_lowercase().starts_with("abs") && Said::in_name(before).is_some();
        if is_logarithm(inner) && !is_absolute {
            return stated(Meaning::Logarithm, true);
        }
        if has_arithmetic(before) || words(&inner.to_lowercase()).any(|word| word == "offset") {
            return stated(Meaning::Factor, true);
        }
        // No factor makes degrees Celsius anything else than a temperature.
        if inner.starts_with(['°', 'º']) && is_celsius(inner) {
            return stated(Meaning::Unit(Measure::of(KELVIN, 1.0)), true);
        }
        match parse(inner) {
            Some(measure) => stated(Meaning::Unit(measure), true),
            // What is in the brackets says which: `% Reflectance (SCI)`.
            None if is_percent(&outside()) == Some(true) => stated(PERCENT, true),
            None if looks_like_unit(&text[..text.rfind(inner).unwrap_or(0)], inner) => {
                stated(if has_factor(&text) { Meaning::Factor } else { Meaning::Unknown }, true)
            }
            None if has_factor(&text) => stated(Meaning::Factor, true),
            None => Stated::outside(&outside(), name),
        }
    }

    /// The same of `text`, which is the column's `name` without what stands in brackets.
    fn outside(text: &str, name: &str) -> Option<Stated> {
        let text = text.trim();
        let stated = |meaning, certain| Some(Stated { meaning, text: name.to_owned(), certain });
        let is_scaled =
            || words(&text.to_lowercase()).any(|word| word.starts_with("scale")) && states_a_factor(&spaced(text));
        if has_factor(text) || begins_with_factor(text) || has_arithmetic(text) || is_scaled() {
            return stated(Meaning::Factor, true);
        }
        // R writes a dot for each mark of `Reflectance (%)` and `% Reflectance`, so that nobody knows which it was.
        if is_without_its_marks(text) {
            return stated(Meaning::Factor, true);
        }
        // Nothing but a unit, and one that no name is like: photons/s/m2/nm/sr.
        let is_long = |measure: &Measure| measure.powers.iter().filter(|power| **power != 0).count() > 2;
        let is_seen = |measure: &Measure| measure.powers[LUMEN] != 0 && text.len() > 2;
        let is_unit = |measure: &Measure| is_long(measure) || measure.is_spectral_power() || is_seen(measure);
        if let Some(measure) = parse(text).filter(is_unit) {
            return stated(Meaning::Unit(measure), true);
        }
        if let Some(measure) = spectral_power_at_end(text) {
            return stated(Meaning::Unit(measure), true);
        }
        if text.ends_with('\u{2030}') {
            return stated(Meaning::Unit(Measure { factor: 1e-3, ..Measure::ONE }), true);
        }
        // Spectrophotometers write %R and %T.
        match is_percent(text) {
            Some(true) => return stated(PERCENT, true),
            Some(false) => {}
            None => return stated(Meaning::Unknown, true),
        }
        if spells_power(text) {
            let measure = match at_end(text) {
                AtEnd::Unit(measure) if measure.is_spectral_power() => Some(measure),
                _ => spelt_power(text),
            };
            return stated(measure.map_or(Meaning::Unknown, Meaning::Unit), true);
        }
        match at_end(text) {
            AtEnd::Unit(measure) => return stated(Meaning::Unit(measure), true),
            AtEnd::Length => return stated(Meaning::Factor, true),
            AtEnd::Nothing => {}
        }
        if let Some(measure) = text.rsplit_once(", ").and_then(|(_, after)| parse(after)) {
            return stated(Meaning::Unit(measure), false);
        }
        if is_relative(text) { stated(Meaning::Unknown, true) } else { None }
    }
}
