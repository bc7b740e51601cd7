//! Where units stand in names: in brackets, behind a slash, as the last words.

use super::spelling::{is_quantity, parse, symbol, words};
use super::{ATMOSPHERE, COUNT, METRE, Measure, WATT};

/// Whether what stands in brackets after `before` can hardly be anything but a unit, or says that there is none.
pub(super) fn looks_like_unit(before: &str, inner: &str) -> bool {
    const RELATIVE: [&str; 15] = [
        "a.u.",
        "au",
        "a. u.",
        "arb. units",
        "arb",
        "arbitrary units",
        "relative",
        "normalized",
        "normalised",
        "rel.",
        "rel",
        "norm.",
        "norm",
        "bp",
        "bps",
    ];
    // What is said of a quantity, and changes no number.
    const PLAIN: &str = "no unit units n a 0 1 mean average avg median measured calculated simulated total direct diffuse specular \
                         hemispherical spectral";
    let is_symbol = |word: &str| symbol(word.trim_end_matches(|c: char| c.is_ascii_digit())).is_some();
    // cm-1, and not the A1 of a sample.
    let is_power = |word: &str| {
        let symbol_of = word.trim_end_matches(|c: char| c.is_ascii_digit());
        symbol_of.len() < word.len() && symbol_of.strip_suffix('-').is_some_and(|name| symbol(name).is_some())
    };
    let lower = before.to_lowercase();
    // Absorptions by temperature are called 300, 300 K, kappa_300K; samples by smaller numbers.
    let is_kelvin = |word: &str| word.trim_end_matches('k').parse::<f64>().is_ok_and(|kelvin| kelvin >= 50.0);
    let of_temperature = match words(&lower).collect::<Vec<_>>()[..] {
        [only] | [only, "k"] => is_kelvin(only),
        [.., last] => last.ends_with('k') && is_kelvin(last),
        [] => false,
    };
    let of_quantity = of_temperature || words(&lower).any(is_quantity);
    RELATIVE.contains(&inner.to_lowercase().as_str())
        || (inner.contains(['/', '^', '*']) && words(inner).any(is_symbol))
        || inner.split_whitespace().any(is_power)
        || (of_quantity && words(&inner.to_lowercase()).any(|word| PLAIN.split(' ').all(|plain| plain != word)))
}

/// A unit of power at the end of a name without brackets: `radiance W/m2/sr/nm`.
pub(super) fn spectral_power_at_end(text: &str) -> Option<Measure> {
    let starts = text.char_indices().filter(|(_, c)| c.is_whitespace()).map(|(i, c)| i + c.len_utf8());
    starts
        .filter_map(|start| parse(&text[start..]))
        .find(|measure| measure.powers[WATT] == 1 && measure.powers[METRE] < 0)
}

/// The unit of spectral power that a sentence has in brackets or among its words, the longest run first.
pub(super) fn spectral_power_within(text: &str) -> Option<Measure> {
    /// `mW / ( m2 sr cm-1 )` has as many.
    const MOST_WORDS: usize = 8;
    let words: Vec<&str> = text.split_whitespace().collect();
    let strip = |run: &str| run.trim_matches([',', ';', ':', '.', '"', '=']).to_owned();
    for length in (1..=words.len().min(MOST_WORDS)).rev() {
        for run in words.windows(length) {
            let run = strip(&run.join(" "));
            let inner = bracketed(&run).filter(|_| run.ends_with([')', ']'])).unwrap_or("");
            let found = [run.as_str(), inner].into_iter().filter_map(parse).find(|measure| measure.is_spectral_power());
            if found.is_some() {
                return found;
            }
        }
    }
    None
}

/// What the last words of a name are.
pub(super) enum AtEnd {
    /// A unit that can be nothing else.
    Unit(Measure),
    /// A length behind the name of an absorption, per which that may be.
    Length,
    Nothing,
}

/// The symbols of quantities that are over a length, in small letters.
const COEFFICIENTS: [&str; 8] = ["alpha", "\u{3b1}", "kappa", "\u{3ba}", "sigma", "\u{3c3}", "mu", "beta"];

/// The unit behind a name without brackets: after a slash (`alpha / cm^-1`, as ISO writes it), or as its last words (`alpha_cm-1`,
/// `absorption 1/cm`, `k per cm`).
pub(super) fn at_end(text: &str) -> AtEnd {
    let is_coefficient = |word: &str| {
        COEFFICIENTS.contains(&word)
            || ["absor", "extinc", "scatter", "atten", "coef"].iter().any(|start| word.starts_with(start))
    };
    let is_of_quantity = |before: &str| {
        let lower = before.to_lowercase();
        words(&lower).any(|word| is_quantity(word) || is_coefficient(word))
            || words(&lower).count() == 1 && lower.trim().chars().count() == 1
    };
    for (i, _) in text.match_indices('/') {
        let (before, after) = (text[..i].trim_end(), &text[i + 1..]);
        let is_reciprocal = before.is_empty()
            || before == "1"
            || before.ends_with([' ', '_'])
            || before.ends_with(" 1")
            || before.ends_with("_1");
        let is_spaced = text[..i].ends_with(' ') && after.starts_with(' ');
        if !is_reciprocal
            && (is_spaced || is_of_quantity(before))
            && let Some(measure) = parse(after).filter(|measure| !measure.is_number())
        {
            return AtEnd::Unit(measure);
        }
    }
    let spaced = spaced(text);
    let all: Vec<&str> = spaced.split_whitespace().collect();
    let is_place = |before: &[&str]| before.last().is_some_and(|word| word.parse::<f64>().is_ok());
    for length in (1..all.len().min(4)).rev() {
        let (before, run) = all.split_at(all.len() - length);
        let run = run.join(" ");
        let is_written = run.contains(['/', '-', '^']) || run.starts_with("per ") || run.starts_with("inverse ");
        let has_number = run.starts_with(|c: char| c.is_ascii_digit()) && !run.starts_with("1/");
        let Some(measure) = parse(&run).filter(|_| is_written && !has_number && !is_place(before)) else { continue };
        let is_one = measure.is(&[(METRE, -1)])
            || measure.is(&[(METRE, -1), (ATMOSPHERE, -1)])
            || measure.is(&[(METRE, 2), (COUNT, -1)]);
        if is_one {
            return AtEnd::Unit(measure);
        }
    }
    let [before @ .., last] = &all[..] else { return AtEnd::Nothing };
    let lower = before.join(" ").to_lowercase();
    match symbol(last).filter(|_| !before.is_empty() && !is_place(before)) {
        Some(measure) if measure.is(&[(WATT, 1)]) && *last != "W" && is_of_quantity(&lower) => AtEnd::Unit(measure),
        Some(measure)
            if measure.is(&[(METRE, 1)])
                && last.len() > 1
                && words(&lower).any(is_coefficient)
                && words(&lower).all(|word| is_coefficient(word) || word.chars().count() == 1) =>
        {
            AtEnd::Length
        }
        _ => AtEnd::Nothing,
    }
}

/// The unit of spectral power at the end of a name that has no signs: `irradiance_mW_m2_nm`, `L.W.m.2.sr.1.um.1`. All but the watts
/// stand below the line.
pub(super) fn spelt_power(text: &str) -> Option<Measure> {
    let spaced = text.replace(['_', '.'], " ");
    if let Some(measure) = spectral_power_at_end(&spaced).filter(|measure| measure.is_spectral_power()) {
        return Some(measure);
    }
    // The unit first: `mW/m2/sr/nm radiance`.
    let mut begins = spaced.char_indices().filter(|(_, c)| *c == ' ').filter_map(|(i, _)| parse(&spaced[..i]));
    if let Some(measure) = begins.rfind(|measure| measure.is_spectral_power()) {
        return Some(measure);
    }
    if text.contains('-') {
        return None;
    }
    let all: Vec<&str> = words(text).collect();
    let is_watt = |word: &&str| symbol(word).is_some_and(|measure| measure.is(&[(WATT, 1)]));
    let start = all.iter().position(is_watt)?;
    let mut unit = all[start].to_owned();
    for word in &all[start + 1..] {
        match word.parse::<u8>() {
            Ok(power) => unit.push_str(&format!("-{power}")),
            Err(_) => {
                let name = word.trim_end_matches(|c: char| c.is_ascii_digit());
                let power = &word[name.len()..];
                let has_own = all.iter().any(|word| word.parse::<u8>().is_ok());
                unit.push_str(&match (power, has_own) {
                    ("", true) => format!(" {name}"),
                    ("", false) => format!(" {name}-1"),
                    (power, _) => format!(" {name}-{power}"),
                });
            }
        }
    }
    parse(&unit).filter(|measure| measure.is_spectral_power())
}

/// Whether the words of a name spell a unit of power in no way that could be read: `L_mW_m2_sr_nm`.
pub(super) fn spells_power(text: &str) -> bool {
    let all: Vec<&str> = words(text).collect();
    let any = |of: &[&str]| all.iter().any(|word| of.contains(word));
    any(&["W", "mW", "uW", "kW", "nW"]) && any(&["m2", "cm2", "sr", "nm", "um"])
}

/// The words of a name with blanks between them, and what spells cm⁻¹ in many ways in one.
pub(super) fn spaced(text: &str) -> String {
    let chars: Vec<char> = text.chars().collect();
    // Dots and dashes between letters stand for blanks: `wavelength.um` is R's, `wl-um`.
    let spaced: String = (0..chars.len())
        .map(|i| {
            let next = chars.get(i + 1).copied();
            match chars[i] {
                '_' | '(' | ')' | '[' | ']' | ',' => ' ',
                '.' if !next.is_some_and(|c| c.is_ascii_digit()) || i > 0 && chars[i - 1].is_alphabetic() => ' ',
                '.' if i > 0 && chars[i - 1] == '.' => ' ',
                '-' if next.is_none_or(|c| c.is_alphabetic() || c == ' ') => ' ',
                c => c,
            }
        })
        .collect();
    let mut words: Vec<&str> = spaced.split_whitespace().collect();
    let mut i = 0;
    while i < words.len() {
        let is = |at: usize, of: &[&str]| words.get(at).is_some_and(|word| of.contains(&word.to_lowercase().as_str()));
        if is(i, &["cm1", "cmm1", "invcm", "percm", "icm"]) {
            words[i] = "cm-1";
        } else if is(i, &["cm"]) && is(i + 1, &["-1", "1", "inv", "^-1", "m1"])
            || is(i, &["inv", "recip", "rec", "reciprocal", "inverse", "per"])
                && is(i + 1, &["cm", "centimeter", "centimetre"])
        {
            words[i] = "cm-1";
            words.remove(i + 1);
        }
        i += 1;
    }
    words.join(" ")
}

/// What stands in the last pair of brackets; brackets within belong to the unit.
pub(super) fn bracketed(text: &str) -> Option<&str> {
    let end = text.rfind([')', ']'])?;
    let (open, close) = if text[end..].starts_with(')') { ('(', ')') } else { ('[', ']') };
    let mut depth = 0;
    for (i, c) in text[..=end].char_indices().rev() {
        if c == close {
            depth += 1;
        } else if c == open {
            depth -= 1;
            // What follows a letter or a slash at once is a part of a unit: W/(m2 sr).
            if depth == 0 && !text[..i].ends_with(['/', '*', '^']) {
                return Some(&text[i + 1..end]);
            }
        }
    }
    None
}

pub(super) fn is_about_the_medium(text: &str) -> bool {
    ["air", "vac", "vacuum"].contains(&text.trim().to_lowercase().as_str())
}
