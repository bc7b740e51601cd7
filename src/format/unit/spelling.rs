//! How units are spelt: in words, in powers, in brackets at the end of names.

use super::{ATMOSPHERE, COUNT, ELECTRONVOLT, KELVIN, LUMEN, METRE, Measure, SECOND, STERADIAN, WATT};

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty())
}

pub(super) fn is_logarithm(text: &str) -> bool {
    let lower = text.to_lowercase();
    let mut all = words(&lower);
    let begins = all.next() == Some("log")
        && all
            .next()
            .is_some_and(|next| ["rad", "refl", "trans", "irr", "int"].iter().any(|start| next.starts_with(start)));
    let always = ["log10", "ln", "db", "decibel", "decibels", "absorbance"];
    begins || lower.contains("log(") || words(&lower).any(|word| always.contains(&word))
}

/// Whether what stands in brackets can hardly be anything but a unit, or says that there is none.
pub(super) fn looks_like_unit(inner: &str) -> bool {
    const RELATIVE: [&str; 9] =
        ["a.u.", "au", "a. u.", "arb. units", "arb", "arbitrary units", "relative", "normalized", "normalised"];
    let is_symbol = |word: &str| symbol(word.trim_end_matches(|c: char| c.is_ascii_digit())).is_some();
    RELATIVE.contains(&inner.to_lowercase().as_str())
        || (inner.contains(['/', '^', '*']) && words(inner).any(is_symbol))
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

/// Whether the words of a name spell a unit of power in no way that could be read: `L_mW_m2_sr_nm`.
pub(super) fn spells_power(text: &str) -> bool {
    let all: Vec<&str> = words(text).collect();
    let any = |of: &[&str]| all.iter().any(|word| of.contains(word));
    any(&["W", "mW", "uW"]) && any(&["m2", "cm2", "sr", "nm", "um"])
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

/// One form for the many ways to write the same characters: superscripts, minus signs, dots, µ and Å, LaTeX.
pub(super) fn plain(text: &str) -> String {
    let mut text = text.trim().to_owned();
    for (command, meant) in [
        ("\\mathrm", ""),
        ("\\mathsf", ""),
        ("\\textrm", ""),
        ("\\text", ""),
        ("\\mu ", "u"),
        ("\\mu", "u"),
        ("\\cdot", "*"),
        ("\\AA", "\u{c5}"),
        ("\\lambda", "lambda"),
        ("\\nu", "nu"),
    ] {
        text = text.replace(command, meant);
    }
    let mut out = String::with_capacity(text.len());
    let mut superscript = false;
    for c in text.trim().trim_matches('"').chars() {
        let digit = match c {
            '\u{2070}' => Some('0'),
            '\u{b9}' => Some('1'),
            '\u{b2}' => Some('2'),
            '\u{b3}' => Some('3'),
            '\u{2074}'..='\u{2079}' => char::from_digit(4 + (c as u32 - 0x2074), 10),
            '\u{207b}' => Some('-'),
            _ => None,
        };
        if let Some(digit) = digit {
            if !superscript {
                out.push('^');
            }
            out.push(digit);
            superscript = true;
            continue;
        }
        superscript = false;
        match c {
            '\u{2212}' | '\u{2013}' | '\u{2010}' | '\u{2011}' | '\u{fe63}' | '\u{ff0d}' => out.push('-'),
            '\u{b7}' | '\u{22c5}' | '\u{2022}' | '\u{d7}' => out.push('*'),
            '\u{b5}' | '\u{3bc}' => out.push('u'),
            '\u{212b}' => out.push('\u{c5}'),
            '\u{a0}' | '\u{2009}' | '\u{202f}' | '\t' => out.push(' '),
            '\u{2126}' => out.push('\u{3a9}'),
            '$' | '{' | '}' | '\\' => {}
            _ => out.push(c),
        }
    }
    // A ring put on A by a character of its own.
    out.replace("A\u{30a}", "\u{c5}").replace("**", "^")
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

pub(super) fn is_wavenumber(word: &str) -> bool {
    let word = word.to_lowercase();
    ["wavenumber", "wavenumbers", "wavenum", "wvnum", "kayser", "kaysers", "wellenzahl"].contains(&word.as_str())
}

/// A unit: products and quotients of symbols or names with powers. `None` where any part of it is not understood.
pub fn parse(text: &str) -> Option<Measure> {
    let text = plain(text);
    let tokens = tokens(&text)?;
    let mut at = 0;
    let measure = product(&tokens, &mut at, 0)?;
    (at == tokens.len()).then_some(measure)
}

#[derive(Debug, Clone, PartialEq)]
enum Token {
    Name(String),
    Number(f64),
    /// The power of what stands before.
    Power(i8),
    Open,
    Close,
    Per,
    Times,
}

/// Splits `W m-2 sr^-1`: whole numbers that follow a name at once are powers, with or without a sign.
fn tokens(text: &str) -> Option<Vec<Token>> {
    let chars: Vec<char> = text.chars().collect();
    let mut tokens: Vec<Token> = Vec::new();
    let mut i = 0;
    while i < chars.len() {
        let c = chars[i];
        let after_name = matches!(tokens.last(), Some(Token::Name(_) | Token::Close));
        let next = chars.get(i + 1).copied();
        match c {
            ' ' if after_name && next == Some('-') && chars.get(i + 2).is_some_and(char::is_ascii_digit) => i += 1,
            ' ' => i += 1,
            '(' | '[' => {
                tokens.push(Token::Open);
                i += 1;
            }
            ')' | ']' => {
                tokens.push(Token::Close);
                i += 1;
            }
            '*' => {
                tokens.push(Token::Times);
                i += 1;
            }
            '.' if !next.is_some_and(|c| c.is_ascii_digit()) || after_name => {
                tokens.push(Token::Times);
                i += 1;
            }
            '/' => {
                tokens.push(Token::Per);
                i += 1;
            }
            '%' => {
                tokens.push(Token::Name("%".to_owned()));
                i += 1;
            }
            '^' | '-' | '+' | '0'..='9' | '_' if after_name => {
                // cm_1 and cm-1 are cm^-1, m2 is m^2, cm^(-1) too.
                let mut digits = String::new();
                let mut negative = false;
                while let Some(&c) = chars.get(i) {
                    match c {
                        '^' | '+' | '(' if digits.is_empty() => {}
                        '-' | '_' if digits.is_empty() => negative = true,
                        '0'..='9' => digits.push(c),
                        ')' if !digits.is_empty()
                            && chars[..i].iter().rev().take(4).any(|c| *c == '(')
                            && opened_by_power(&chars[..i]) =>
                        {
                            i += 1;
                            break;
                        }
                        _ => break,
                    }
                    i += 1;
                }
                let power: i8 = digits.parse().ok().filter(|power| (1..=9).contains(power))?;
                tokens.push(Token::Power(if negative { -power } else { power }));
            }
            c if c.is_ascii_digit() || c == '.' => {
                let start = i;
                while chars.get(i).is_some_and(|c| c.is_ascii_digit() || matches!(c, '.' | 'e' | 'E'))
                    || (i > start && matches!(chars.get(i), Some('-' | '+')) && matches!(chars[i - 1], 'e' | 'E'))
                {
                    i += 1;
                }
                let number: String = chars[start..i].iter().collect();
                let mut value: f64 = number.parse().ok()?;
                // 10^-6
                if chars.get(i) == Some(&'^') {
                    let start = i + 1;
                    i = start;
                    while chars.get(i).is_some_and(|c| c.is_ascii_digit() || matches!(c, '-' | '+')) {
                        i += 1;
                    }
                    let power: i32 = chars[start..i].iter().collect::<String>().parse().ok()?;
                    value = value.powi(power);
                }
                tokens.push(Token::Number(value));
            }
            c if c.is_alphabetic() || c == '\u{b0}' => {
                let start = i;
                while chars.get(i).is_some_and(|c| c.is_alphabetic() || *c == '\u{b0}') {
                    i += 1;
                }
                tokens.push(Token::Name(chars[start..i].iter().collect()));
            }
            _ => return None,
        }
    }
    (!tokens.is_empty()).then_some(tokens)
}

/// Whether the last bracket opened in `before` is that of a power, `^(`.
fn opened_by_power(before: &[char]) -> bool {
    before.iter().rposition(|c| *c == '(').is_some_and(|open| open > 0 && before[open - 1] == '^')
}

fn product(tokens: &[Token], at: &mut usize, depth: usize) -> Option<Measure> {
    if depth > 8 {
        return None;
    }
    let mut total = Measure::ONE;
    let mut sign = 1i8;
    let mut any = false;
    while let Some(token) = tokens.get(*at) {
        let mut factor = match token {
            Token::Close => break,
            Token::Times => {
                sign = 1;
                *at += 1;
                continue;
            }
            Token::Per => {
                sign = -1;
                *at += 1;
                continue;
            }
            Token::Power(_) => return None,
            Token::Number(value) => {
                *at += 1;
                Measure { factor: *value, ..Measure::ONE }
            }
            Token::Open => {
                *at += 1;
                let inner = product(tokens, at, depth + 1)?;
                if tokens.get(*at) != Some(&Token::Close) {
                    return None;
                }
                *at += 1;
                inner
            }
            Token::Name(name) => {
                *at += 1;
                match name.to_lowercase().as_str() {
                    "per" => {
                        sign = -1;
                        continue;
                    }
                    "inverse" | "reciprocal" => {
                        sign = -1;
                        continue;
                    }
                    "square" | "sq" => {
                        let Some(Token::Name(of)) = tokens.get(*at) else { return None };
                        *at += 1;
                        Measure::ONE.times(symbol(of)?, 2)?
                    }
                    _ => symbol(name)?,
                }
            }
        };
        let mut power = 1;
        if let Some(Token::Power(written)) = tokens.get(*at) {
            power = *written;
            *at += 1;
        }
        if power != 1 {
            factor = Measure::ONE.times(factor, power)?;
        }
        // A stroke holds for all that follows it without a dot: W/m2 sr nm is W/(m2 sr nm), as its writers mean it.
        total = total.times(factor, sign)?;
        any = true;
    }
    any.then_some(total)
}

/// A unit by symbol, with an SI prefix, or by name.
fn symbol(name: &str) -> Option<Measure> {
    const NANO: f64 = 1e-9;
    let lower = name.to_lowercase();
    let base = |name: &str| -> Option<Measure> {
        Some(match name {
            "m" => Measure::of(METRE, 1.0),
            "W" => Measure::of(WATT, 1.0),
            "s" => Measure::of(SECOND, 1.0),
            "sr" => Measure::of(STERADIAN, 1.0),
            "Hz" => Measure { powers: Measure::ONE.times(Measure::of(SECOND, 1.0), -1)?.powers, factor: 1.0 },
            "eV" => Measure::of(ELECTRONVOLT, 1.0),
            "J" => Measure::of(WATT, 1.0).times(Measure::of(SECOND, 1.0), 1)?,
            "K" => Measure::of(KELVIN, 1.0),
            "lm" => Measure::of(LUMEN, 1.0),
            "cd" => Measure::of(LUMEN, 1.0).times(Measure::of(STERADIAN, 1.0), -1)?,
            "lx" => Measure::of(LUMEN, 1.0).times(Measure::of(METRE, 1.0), -2)?,
            "mol" => Measure::of(COUNT, 6.022_140_76e23),
            "erg" => Measure::of(WATT, 1e-7).times(Measure::of(SECOND, 1.0), 1)?,
            // 1e-26 W m-2 Hz-1
            "Jy" => Measure::of(WATT, 1e-26).times(Measure::of(SECOND, 1.0), 1)?.times(Measure::of(METRE, 1.0), -2)?,
            _ => return None,
        })
    };
    // Spellings by their whole name first.
    let whole = match lower.as_str() {
        "%" | "percent" | "pct" => Measure { factor: 0.01, ..Measure::ONE },
        "unitless" | "dimensionless" | "fraction" | "none" | "ratio" | "reflectance" | "transmittance" => Measure::ONE,
        "atm" | "atmosphere" | "atmospheres" => Measure::of(ATMOSPHERE, 1.0),
        "bar" => Measure::of(ATMOSPHERE, 1.0 / 1.013_25),
        "hpa" | "mbar" => Measure::of(ATMOSPHERE, 1.0 / 1013.25),
        "pa" => Measure::of(ATMOSPHERE, 1.0 / 101_325.0),
        "photon" | "photons" | "ph" | "quanta" | "molecule" | "molecules" | "molec" | "mole" | "moles" | "counts"
        | "dn" | "count" => Measure::of(COUNT, 1.0),
        "steradian" | "steradians" | "ster" | "str" => Measure::of(STERADIAN, 1.0),
        "sr" => Measure::of(STERADIAN, 1.0),
        "angstrom" | "angstroms" | "\u{e5}ngstr\u{f6}m" | "\u{e5}ngstrom" | "angstr\u{f6}m" | "ang" | "\u{e5}" => {
            Measure::of(METRE, 0.1 * NANO)
        }
        "nm" => Measure::of(METRE, NANO),
        "um" | "micron" | "microns" | "mic" | "mu" | "mum" => Measure::of(METRE, 1e-6),
        "hz" => base("Hz")?,
        "kelvin" | "kelvins" | "degk" => Measure::of(KELVIN, 1.0),
        "electronvolt" | "electronvolts" => Measure::of(ELECTRONVOLT, 1.0),
        "lumen" | "lumens" => Measure::of(LUMEN, 1.0),
        "lux" => base("lx")?,
        "kayser" | "kaysers" => Measure::ONE.times(Measure::of(METRE, 0.01), -1)?,
        "ev" => Measure::of(ELECTRONVOLT, 1.0),
        "sec" | "second" | "seconds" => Measure::of(SECOND, 1.0),
        _ => Measure { factor: 0.0, ..Measure::ONE },
    };
    if whole.factor > 0.0 {
        return Some(whole);
    }
    if matches!(name, "A" | "AA" | "\u{c5}") {
        return Some(Measure::of(METRE, 0.1 * NANO));
    }
    if let Some(measure) = base(name) {
        return Some(measure);
    }
    const PREFIXES: [(&str, &str, f64); 13] = [
        ("f", "femto", 1e-15),
        ("p", "pico", 1e-12),
        ("n", "nano", 1e-9),
        ("u", "micro", 1e-6),
        ("m", "milli", 1e-3),
        ("c", "centi", 1e-2),
        ("d", "deci", 1e-1),
        ("k", "kilo", 1e3),
        ("M", "mega", 1e6),
        ("G", "giga", 1e9),
        ("T", "tera", 1e12),
        ("P", "peta", 1e15),
        ("h", "hecto", 1e2),
    ];
    let scaled = |measure: Measure, by: f64| Measure { factor: measure.factor * by, ..measure };
    for (short, long, by) in PREFIXES {
        if let Some(measure) = name.strip_prefix(short).and_then(base) {
            return Some(scaled(measure, by));
        }
        if let Some(rest) = lower.strip_prefix(long)
            && let Some(measure) = long_name(rest)
        {
            return Some(scaled(measure, by));
        }
    }
    if let Some(measure) = long_name(&lower) {
        return Some(measure);
    }
    // All in capitals, or all in small letters, as old programs write: THZ, ghz, CM.
    for (spelt, unit, prefixes) in
        [("hz", "Hz", "kMGT"), ("ev", "eV", "mk"), ("m", "m", "pnumc"), ("w", "W", "umk"), ("sr", "sr", "")]
    {
        let Some(before) = lower.strip_suffix(spelt) else { continue };
        let prefix = prefixes.chars().find(|c| c.to_lowercase().to_string() == before);
        if before.is_empty() && spelt != "m" {
            return base(unit);
        }
        if let Some(prefix) = prefix
            && let Some((_, _, by)) = PREFIXES.iter().find(|(short, ..)| short.chars().eq([prefix]))
        {
            return base(unit).map(|measure| scaled(measure, *by));
        }
    }
    None
}

fn long_name(name: &str) -> Option<Measure> {
    let name = name.strip_suffix('s').unwrap_or(name);
    Some(match name {
        "meter" | "metre" => Measure::of(METRE, 1.0),
        "watt" => Measure::of(WATT, 1.0),
        "hertz" => Measure::ONE.times(Measure::of(SECOND, 1.0), -1)?,
        "electronvolt" | "ev" => Measure::of(ELECTRONVOLT, 1.0),
        "joule" => Measure::of(WATT, 1.0).times(Measure::of(SECOND, 1.0), 1)?,
        _ => return None,
    })
}
