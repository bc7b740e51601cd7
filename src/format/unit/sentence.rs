//! What names and sentences say of values beside their unit: percent, factors, logarithms and other functions.

use super::places::bracketed;
use super::spelling::{is_quantity, parse, plain, words};
use super::{FACTORS, Measure};

/// Whether the name of a column says that its numbers are logarithms, or Kubelka and Munk's function, of the values.
pub(super) fn is_logarithm(text: &str) -> bool {
    let lower = text.to_lowercase();
    let all: Vec<&str> = words(&lower).collect();
    let always = ["log10", "ln", "db", "dbm", "decibel", "decibels", "absorbance", "kubelka"];
    if is_function(&lower) || all.iter().any(|word| word.strip_suffix("log").is_some_and(|n| n.parse::<u8>().is_ok())) {
        return true;
    }
    if lower.contains("log(") || lower.starts_with("-log") || all.iter().any(|word| always.contains(word)) {
        return true;
    }
    // Timber has logs too: "log, oak".
    let is_of = |word: &str| is_quantity(word) || ["irr", "int"].iter().any(|start| word.starts_with(start));
    let is_letter = |word: &str| matches!(word, "r" | "t" | "1");
    let is_of = |word: &str| is_of(word) || ["energy", "sensitivity", "response", "quantal"].contains(&word);
    if matches!(all[..], ["log", next, ..] if is_of(next) || (is_letter(next) && !lower.starts_with("log,"))) {
        return true;
    }
    let before_log = lower.trim_end_matches([')', ']']).strip_suffix("log").map(str::trim_end);
    let before_log = before_log.and_then(|before| before.strip_suffix([',', '(', '[', '_']));
    if before_log.is_some_and(|before| words(before).any(|word| is_of(word) || is_letter(word))) {
        return true;
    }
    // `OD 2` is a filter, of which the column may hold the transmittance.
    let mut pairs = words(text).zip(words(text).skip(1).map(Some).chain([None]));
    if pairs.any(|(word, next)| word == "OD" && next.is_none_or(|next| next.parse::<f64>().is_err())) {
        return true;
    }
    // Of an absorption, `Abs (cm-1)`, and of a share, `Abs (%)`, the unit speaks.
    let of_number = bracketed(text).and_then(parse).is_none_or(|measure| measure == Measure::ONE);
    let bare = lower.split(['(', '[']).next().unwrap_or("").replace(' ', "");
    let squeezed = lower.replace(' ', "");
    all.windows(2).any(|pair| pair == ["optical", "density"])
        || (of_number && matches!(bare.trim_end_matches('.'), "abs" | "od"))
        || matches!(squeezed.as_str(), "k/s" | "k-m" | "density" | "f(r)" | "f(r\u{221e})")
}

/// Whether a word, in small letters, is that of a quantity, or its usual letter.
fn is_quantity_or_letter(word: &str) -> bool {
    is_quantity(word) || matches!(word, "r" | "t" | "rho" | "\u{3c1}" | "tau" | "refl" | "brf" | "hdrf")
}

/// Whether a name, in small letters, says that its numbers are made from the values, and how: `1/R`, `R^2`, `1st derivative`,
/// `continuum removed`.
fn is_function(lower: &str) -> bool {
    let squeezed = lower.replace(' ', "");
    let of = |part: Option<&str>| part.is_some_and(is_quantity_or_letter);
    of(squeezed.strip_prefix("1/"))
        || of(squeezed.strip_suffix("^2"))
        || squeezed.starts_with(['\u{3b4}', '\u{2206}'])
        || (squeezed.starts_with('d')
            && squeezed.split_once("/d").is_some_and(|(before, _)| of(before.strip_prefix('d'))))
        || words(lower).next() == Some("sqrt")
        || lower.contains("square root")
        || words(lower).any(|word| word.starts_with("derivativ"))
        || (lower.contains("continuum") && words(lower).any(|word| matches!(word, "removed" | "removal" | "divided")))
}

/// Whether a name says that its values are multiplied by π, divided by a number, or shifted: `pi*R`, `rho/pi`, `R/2`, `R+0.5`,
/// `R, offset`.
pub(super) fn has_arithmetic(text: &str) -> bool {
    let lower = text.to_lowercase();
    if words(&lower).any(|word| word == "offset") {
        return true;
    }
    let squeezed = lower.replace(" x ", "*").replace(' ', "");
    let is_pi = |part: &str| matches!(part, "pi" | "\u{3c0}");
    // `rho_w/pi`
    let begins = |part: &str| words(part).next().is_some_and(is_quantity_or_letter);
    if let Some((before, after)) = squeezed.split_once(['*', '/'])
        && ((is_pi(before) && begins(after)) || (is_pi(after) && begins(before)))
    {
        return true;
    }
    let number = |part: &str| part.parse::<f64>().is_ok();
    let is_divided = squeezed.split_once('/').is_some_and(|(before, by)| is_quantity_or_letter(before) && number(by));
    let is_shifted = squeezed
        .split_once(['+', '-'])
        .is_some_and(|(before, by)| is_quantity_or_letter(before) && by.contains('.') && number(by));
    is_divided || is_shifted
}

/// Percent in words, in small letters.
const PERCENT: [&str; 10] =
    ["percent", "percentage", "percents", "pct", "perc", "prozent", "procent", "pourcent", "porcentaje", "%"];

/// Whether a name ends with a range of percent, `(0-100)`, `0 to 100 %`.
pub(super) fn is_up_to_hundred(text: &str) -> bool {
    let lower = text.to_lowercase();
    let spaced = lower.replace(" to ", " - ").replace(['-', '.', '\u{2026}'], " ");
    let all: Vec<&str> = spaced.trim_end_matches(['%', ' ']).split_whitespace().collect();
    spaced != lower && matches!(all[..], [.., "0", "100"])
}

/// Whether a name of R's has only dots where `(%)` or `%` stood: `Reflectance....`, `X..Reflectance`.
pub(super) fn is_without_its_marks(text: &str) -> bool {
    let lower = text.to_lowercase();
    let of_start = lower.strip_prefix("x.").map(|rest| rest.trim_start_matches('.'));
    lower.ends_with("...") || of_start.is_some_and(|rest| words(rest).next().is_some_and(is_quantity_or_letter))
}

/// Whether a text is percent and nothing else than what of: `%`, `%R`, `R%`, `% Refl`, `percent`. Of a mixture it is not: `wt%`.
pub(super) fn is_percent_of(text: &str) -> bool {
    let lower = text.trim().to_lowercase().replace("per cent", "percent").replace(['_', '.', '(', ')'], " ");
    let lower = lower.strip_prefix("in ").unwrap_or(&lower);
    let rest = PERCENT.iter().find_map(|mark| {
        let lower = lower.trim();
        let at_end = lower.strip_suffix(mark).filter(|rest| *mark == "%" || rest.is_empty() || rest.ends_with(' '));
        let at_start = || lower.strip_prefix(mark).filter(|rest| *mark == "%" || rest.starts_with(' '));
        at_end.or_else(at_start)
    });
    rest.is_some_and(|rest| {
        let mut left = words(rest).peekable();
        rest.trim().is_empty()
            || (left.peek().is_some()
                && left.all(|word| {
                    is_quantity_or_letter(word) || matches!(word, "a" | "e" | "total" | "diffuse" | "spectral")
                }))
    })
}

/// Whether the words of a name make it a share in percent: the first or the last is that word. `None` where a number stands
/// before it, which may be that of a mixture.
pub(super) fn is_percent(text: &str) -> Option<bool> {
    // PercentReflectance, ReflectancePercent.
    let mut text = text.to_owned();
    let is_capital = |after: &str| after.starts_with(|c: char| c.is_uppercase());
    if text.strip_prefix("Percent").is_some_and(is_capital) {
        text.insert("Percent".len(), ' ');
    } else if text.strip_suffix("Percent").is_some_and(|before| before.ends_with(char::is_lowercase)) {
        text.insert(text.len() - "Percent".len(), ' ');
    }
    let lower = text.to_lowercase().replace("per cent", "percent").replace('_', " ");
    let is = |word: &str| PERCENT.contains(&word.trim_end_matches('.'));
    let all: Vec<&str> = lower.split_whitespace().collect();
    if is_up_to_hundred(&lower) {
        return Some(true);
    }
    let at_end = match lower.trim_end().strip_suffix('%') {
        Some(before) => Some(before.trim_end()),
        None => {
            all.last().filter(|word| is(word)).map(|word| lower.trim_end().strip_suffix(word).unwrap_or("").trim_end())
        }
    };
    match at_end {
        Some(before) if before.ends_with(|c: char| c.is_ascii_digit()) => None,
        Some(_) => Some(true),
        None if is_percent_among(&lower) => Some(true),
        None => Some(
            all.first().is_some_and(|word| is(word))
                || all.last().is_some_and(|word| word.starts_with('%') && is_percent_of(word))
                || lower.strip_prefix('%').is_some_and(|rest| rest.trim_start().starts_with(char::is_alphabetic)),
        ),
    }
}

/// Whether a name, in small letters, has percent among its words, of a quantity and not of a number: `refl percent mean`, `R% Sample`.
fn is_percent_among(lower: &str) -> bool {
    let all: Vec<&str> =
        lower.split(|c: char| c.is_whitespace() || matches!(c, '.' | ',')).filter(|w| !w.is_empty()).collect();
    let of_first = all.first().is_some_and(|word| word.len() > 1 && word.ends_with('%') && is_percent_of(word));
    let of_word = all.windows(2).any(|pair| {
        let is_of = |word: &str| is_quantity(word) || word == "refl";
        (is_of(pair[0]) && PERCENT.contains(&pair[1]))
            || (PERCENT.contains(&pair[0]) && is_of(pair[1]) && pair[0] == all[0])
    });
    of_first || of_word
}

/// Whether a name says that its values are relative to something that it leaves open: `Relative intensity`, `normalized radiance`,
/// `rel. units`, `QE, relative`.
pub(super) fn is_relative(text: &str) -> bool {
    const RELATIVE: [&str; 8] =
        ["relative", "rel", "normalized", "normalised", "norm", "relativ", "relatif", "arbitrary"];
    const OF: [&str; 14] = [
        "spd",
        "spectral",
        "spectrum",
        "power",
        "intensity",
        "energy",
        "flux",
        "output",
        "signal",
        "sensitivity",
        "response",
        "qe",
        "efficiency",
        "units",
    ];
    let lower = text.to_lowercase();
    let all: Vec<&str> = words(&lower).collect();
    // The relative standard deviation of a radiance is said to be one elsewhere.
    let is_at_end = |word: &&&str| RELATIVE.contains(*word);
    let is_of = |word: &&str| is_quantity(word) || OF.contains(word);
    [all.first(), all.last()].iter().flatten().any(is_at_end) && all.iter().any(is_of)
}

/// Whether a name says that its values are multiplied by something: `reflectance x 10000`, `R (x1e4)`, `R*100`.
pub(super) fn has_factor(text: &str) -> bool {
    text.char_indices().filter(|(_, c)| matches!(c, 'x' | 'X' | '*')).any(|(i, c)| {
        let alone = c == '*' || text[..i].chars().next_back().is_some_and(|before| !before.is_alphanumeric());
        let after = text[i + 1..].trim_start();
        let end = after
            .find(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | 'e' | 'E' | '^' | '-')))
            .unwrap_or(after.len());
        let number = after[..end].replace("10^", "1e");
        alone && number.parse::<f64>().is_ok_and(|factor| factor != 1.0)
    })
}

/// Whether a name begins with a factor of its values: `100*R`, `10^4 rho`, `1e4 R`.
pub(super) fn begins_with_factor(text: &str) -> bool {
    let end = text
        .find(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | 'e' | 'E' | '^' | '-' | '+')))
        .unwrap_or(text.len());
    let (number, rest) = text.split_at(end);
    let after = rest.trim_start();
    let is_written = number.contains(['e', 'E', '^']) || after.starts_with('*') || rest.starts_with(" x ");
    let factor = number.replace("10^", "1e").parse::<f64>();
    is_written
        && factor.is_ok_and(|factor| factor != 1.0)
        && after.trim_start_matches(['*', 'x', ' ']).starts_with(char::is_alphabetic)
}

/// Whether this is 1 over a power of ten above one: 1/10000.
pub(super) fn is_power_of_ten(text: &str) -> bool {
    let under = text.split_once('/').filter(|(over, _)| over.trim() == "1").map(|(_, under)| under.trim());
    under
        .is_some_and(|under| under.len() > 1 && under.starts_with('1') && under[1..].bytes().all(|digit| digit == b'0'))
}

/// A line without the marks that make it a comment. A percent sign is one where it stands first, and no unit.
pub fn without_mark(text: &str) -> &str {
    let text = text.trim();
    match text.strip_prefix('%') {
        Some(rest) => rest.trim_start_matches(['%', ' ', '\t']),
        None => text.trim_start_matches(['#', '!', '/', '>', ' ', '\t']),
    }
}

/// Whether a sentence says that values are in percent: a quantity `in percent` or with it in brackets, or a key for units.
pub(super) fn speaks_of_percent(text: &str) -> bool {
    /// What may stand between what is in percent and that word.
    const BETWEEN: [&str; 9] = ["in", "as", "=", ":", "are", "is", "given", "expressed", "all"];
    let text = plain(without_mark(text));
    let lower = text.to_lowercase().replace("per cent", "percent");
    let is = |word: &str| PERCENT.contains(&word.trim_matches(['.', ',', ';', '(', ')', '[', ']']));
    let is_said = |value: &str| {
        let bracketed = bracketed(value).is_some_and(|inner| is(inner.trim()) || is_percent_of(inner));
        value.split_whitespace().count() <= 3 && (is(value.trim()) || is_percent_of(value) || bracketed)
    };
    if let Some((key, value)) = lower.split_once([':', '='])
        && !words(key).any(|word| word.starts_with('x') || word.starts_with("wave"))
    {
        let is_key = |word: &str| {
            word.contains("unit") || word.starts_with("yaxis") || matches!(word, "y" | "ordinate" | "scale" | "range")
        };
        if words(key).any(|word| word.contains("unit")) {
            return is_said(value);
        }
        if words(key).any(|word| is_key(word) || is_quantity(word))
            && (is_said(value) || is_up_to_hundred(&format!(" {value}")))
        {
            return true;
        }
    }
    // A list of units, or of columns: `nm, %`, `col 2 - %R`.
    let pieces: Vec<&str> = lower.split([',', ';']).flat_map(|piece| piece.split(" - ")).map(str::trim).collect();
    let is_of_axis = |piece: &str| super::Unit::named(piece).is_some() || piece.starts_with("col");
    if let [first, rest @ ..] = &pieces[..]
        && is_of_axis(first)
        && rest.iter().any(|piece| is_said(piece))
    {
        return true;
    }
    let all: Vec<&str> = lower.split_whitespace().collect();
    let is_of = |word: &str| {
        let word = word.trim_start_matches('(').trim_end_matches([',', ':', ')']);
        is_quantity(word) || matches!(word, "r" | "t" | "values" | "data" | "y")
    };
    // Nothing else: `percent`, `in %`, `% reflectance`.
    let bare = if let ["in", rest @ ..] = &all[..] { rest } else { &all[..] };
    if bare.len() <= 3 && is_percent_of(&bare.join(" ")) {
        return true;
    }
    all.iter().enumerate().any(|(i, word)| {
        if !is(word) || i == 0 {
            return false;
        }
        let in_brackets = word.starts_with(['(', '[']);
        match all[i - 1] {
            between if BETWEEN.contains(&between) => {
                all[..i].iter().rev().find(|word| !BETWEEN.contains(word)).is_some_and(|word| is_of(word))
            }
            before => in_brackets && is_of(before) || before.ends_with([',', ':']) && is_of(before),
        }
    })
}

/// Whether a sentence states a factor, or an offset, other than none.
pub(super) fn states_a_factor(text: &str) -> bool {
    /// What may stand between the word and its number.
    const BETWEEN: [&str; 12] =
        ["factor", "factors", "of", "by", "is", "was", "are", "all", "value", "values", "data", "the"];
    let lower = without_mark(text).to_lowercase();
    let scales = |word: &str| FACTORS.iter().any(|start| word.starts_with(start)) || word.starts_with("divide");
    let offsets = |word: &str| word.starts_with("offset");
    let number = |word: &str| {
        word.trim_start_matches(['x', '*'])
            .trim_end_matches(['.', ',', ';', ')'])
            .replace("10^", "1e")
            .parse::<f64>()
            .ok()
    };
    let changes = |word: &str, value: f64| if offsets(word) { value != 0.0 } else { value != 1.0 };
    // As keys of a list: `radiance scale to nm: 0.001`.
    if let Some((key, value)) = lower.split_once([':', '='])
        && let Some(word) =
            words(key.rsplit([';', ',']).next().unwrap_or("")).find(|word| scales(word) || offsets(word))
        && let Some(value) = value.split_whitespace().next().and_then(number)
    {
        return changes(word, value);
    }
    let all: Vec<&str> = lower
        .split(|c: char| c.is_whitespace() || matches!(c, ':' | '=' | '('))
        .filter(|word| !word.is_empty())
        .collect();
    let stated = all.iter().enumerate().filter(|(_, word)| scales(word) || offsets(word)).any(|(i, word)| {
        // One more word may be what is scaled: multiply radiance by 1000.
        let mut after = all[i + 1..].iter().filter(|word| !BETWEEN.contains(word)).take(2);
        after.any(|next| number(next).is_some_and(|value| changes(word, value)))
    });
    let of_values = all.iter().any(|word| {
        is_quantity(word) || ["data", "number", "column", "unit", "y"].iter().any(|start| word.starts_with(start))
    });
    // `*1e-3`, `in units of 10^-3`, `multiplied with pi`.
    let is_factor = lower.starts_with(['*', 'x']) && has_factor(&format!("v {lower}"));
    let in_units = lower.split("units of ").nth(1).and_then(|after| after.split_whitespace().next()).and_then(number);
    let times = all.windows(2).any(|pair| pair[0] == "times" && number(pair[1]).is_some_and(|value| value != 1.0));
    let times = times && all.iter().any(|word| is_quantity(word) || word.starts_with("data"));
    let by_pi = times
        || all.iter().any(|word| word.starts_with("multipl") || word.starts_with("divide"))
            && words(&lower).any(|word| matches!(word, "pi" | "\u{3c0}"));
    stated || (of_values && has_factor(&lower)) || is_factor || in_units.is_some_and(|value| value != 1.0) || by_pi
}
