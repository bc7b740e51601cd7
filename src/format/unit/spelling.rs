//! How units are spelt: in words, in powers, in brackets at the end of names.

use super::{ATMOSPHERE, COUNT, ELECTRONVOLT, KELVIN, LUMEN, METRE, Measure, SECOND, STERADIAN, WATT};

pub(super) fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty())
}

/// How the names of quantities begin that tables hold.
const QUANTITIES: [&str; 17] = [
    "radian", "irradian", "intens", "flux", "refl", "trans", "emis", "absor", "extinc", "scatter", "atten", "coef",
    "cross", "power", "albedo", "value", "kappa",
];

pub(super) fn is_quantity(word: &str) -> bool {
    QUANTITIES.iter().any(|start| word.starts_with(start))
}

/// One form for the many ways to write the same characters: superscripts, minus signs, dots, µ and Å, LaTeX.
pub(super) fn plain(text: &str) -> String {
    let mut text = text.trim().to_owned();
    // Of old a millimicron, which is no micrometre.
    for spelt in ["m\u{b5}", "m\u{3bc}"] {
        if let Some(at) = text.find(spelt)
            && !text[..at].ends_with(char::is_alphanumeric)
            && !text[at + spelt.len()..].starts_with(char::is_alphanumeric)
        {
            text.replace_range(at..at + spelt.len(), "nm");
        }
    }
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
            '\u{2212}' | '\u{2013}' | '\u{2010}' | '\u{2011}' | '\u{fe63}' | '\u{ff0d}' | '\u{af}' => out.push('-'),
            // Letters, brackets and marks in the width of Chinese ones.
            '\u{ff01}'..='\u{ff5e}' => out.extend(char::from_u32(c as u32 - 0xfee0)),
            '\u{3000}' => out.push(' '),
            // A unit in one character of that width.
            '\u{339a}' => out.push_str("nm"),
            '\u{339b}' => out.push_str("um"),
            '\u{339c}' => out.push_str("mm"),
            '\u{339d}' => out.push_str("cm"),
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
    let out = out.replace("A\u{30a}", "\u{c5}").replace("**", "^");
    // pint's powers: `meter ** 2`.
    out.replace(" ^ ", "^")
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
            // W/m2-sr-um
            '-' if (after_name || matches!(tokens.last(), Some(Token::Power(_))))
                && next.is_some_and(char::is_alphabetic) =>
            {
                i += 1
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
            '%' | '\u{2030}' => {
                tokens.push(Token::Name(c.to_string()));
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
                        let share = match tokens.get(*at) {
                            Some(Token::Name(of)) if of.eq_ignore_ascii_case("cent") => 0.01,
                            Some(Token::Name(of)) if of.eq_ignore_ascii_case("mille") => 1e-3,
                            _ => {
                                sign = -1;
                                continue;
                            }
                        };
                        *at += 1;
                        Measure { factor: share, ..Measure::ONE }
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
        // The wavelength that a unit is over stands below the line.
        factor.is_odd |=
            factor.lengths == [1, 0] && factor.factor < 1e-3 && power > 0 && matches!(token, Token::Name(_));
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
pub(super) fn symbol(name: &str) -> Option<Measure> {
    let lower = name.to_lowercase();
    // Spellings by their whole name first.
    if let Some(whole) = spelt_out(&lower) {
        return Some(whole);
    }
    if name == "Mb" {
        return long_name("barn").and_then(|barn| Measure { factor: 1e6, ..Measure::ONE }.times(barn, 1));
    }
    if matches!(name, "A" | "AA" | "\u{c5}") {
        return Some(Measure::of(METRE, 1e-10));
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

/// A unit that is spelt in no other way, in small letters.
fn spelt_out(lower: &str) -> Option<Measure> {
    Some(match lower {
        "%" | "percent" | "percentage" | "pct" | "perc" => Measure { factor: 0.01, ..Measure::ONE },
        "\u{2030}" | "permille" | "promille" => Measure { factor: 1e-3, ..Measure::ONE },
        "ppm" | "ppmv" => Measure { factor: 1e-6, ..Measure::ONE },
        "ppb" | "ppbv" => Measure { factor: 1e-9, ..Measure::ONE },
        "unitless" | "dimensionless" | "fraction" | "none" | "ratio" | "reflectance" | "transmittance" => Measure::ONE,
        "atm" | "atmosphere" | "atmospheres" => Measure::of(ATMOSPHERE, 1.0),
        "bar" => Measure::of(ATMOSPHERE, 1.0 / 1.013_25),
        "kpa" => Measure::of(ATMOSPHERE, 1.0 / 101.325),
        "torr" | "mmhg" => Measure::of(ATMOSPHERE, 1.0 / 760.0),
        // Loschmidt's number of molecules in a cubic metre (CODATA 2018).
        "amagat" | "amagats" => Measure::of(COUNT, 2.686_780_111e25).times(Measure::of(METRE, 1.0), -3)?,
        "inch" | "inches" => Measure::of(METRE, 0.0254),
        "ft" | "foot" | "feet" => Measure::of(METRE, 0.3048),
        "hpa" | "mbar" => Measure::of(ATMOSPHERE, 1.0 / 1013.25),
        "pa" => Measure::of(ATMOSPHERE, 1.0 / 101_325.0),
        "photon" | "photons" | "ph" | "quanta" | "molecule" | "molecules" | "molec" | "mole" | "moles" | "counts"
        | "dn" | "count" => Measure::of(COUNT, 1.0),
        "steradian" | "steradians" | "ster" | "str" => Measure::of(STERADIAN, 1.0),
        "sr" => Measure::of(STERADIAN, 1.0),
        "angstrom" | "angstroms" | "angstroem" | "angstroems" | "\u{e5}ngstr\u{f6}m" | "\u{e5}ngstrom"
        | "angstr\u{f6}m" | "ang" | "\u{e5}" => Measure::of(METRE, 1e-10),
        "nm" => Measure::of(METRE, 1e-9),
        "um" | "micron" | "microns" | "mic" | "mu" | "mum" => Measure::of(METRE, 1e-6),
        "hz" => base("Hz")?,
        "kelvin" | "kelvins" | "degk" => Measure::of(KELVIN, 1.0),
        "electronvolt" | "electronvolts" => Measure::of(ELECTRONVOLT, 1.0),
        "lumen" | "lumens" => Measure::of(LUMEN, 1.0),
        "lux" => base("lx")?,
        "kayser" | "kaysers" => Measure::ONE.times(Measure::of(METRE, 0.01), -1)?,
        "ev" => Measure::of(ELECTRONVOLT, 1.0),
        "sec" | "second" | "seconds" => Measure::of(SECOND, 1.0),
        _ => return None,
    })
}

/// An SI unit, or another one that takes prefixes, by its symbol.
fn base(name: &str) -> Option<Measure> {
    Some(match name {
        "m" => Measure::of(METRE, 1.0),
        "W" => Measure::of(WATT, 1.0),
        "s" => Measure::of(SECOND, 1.0),
        "sr" => Measure::of(STERADIAN, 1.0),
        "Hz" => Measure::ONE.times(Measure::of(SECOND, 1.0), -1)?,
        "eV" => Measure::of(ELECTRONVOLT, 1.0),
        "J" => Measure::of(WATT, 1.0).times(Measure::of(SECOND, 1.0), 1)?,
        "K" => Measure::of(KELVIN, 1.0),
        "lm" => Measure::of(LUMEN, 1.0),
        "cd" => Measure::of(LUMEN, 1.0).times(Measure::of(STERADIAN, 1.0), -1)?,
        "lx" => Measure::of(LUMEN, 1.0).times(Measure::of(METRE, 1.0), -2)?,
        "mol" => Measure::of(COUNT, 6.022_140_76e23),
        "flick" => long_name(name)?,
        "erg" => Measure::of(WATT, 1e-7).times(Measure::of(SECOND, 1.0), 1)?,
        // 1e-26 W m-2 Hz-1
        "Jy" => Measure::of(WATT, 1e-26).times(Measure::of(SECOND, 1.0), 1)?.times(Measure::of(METRE, 1.0), -2)?,
        _ => return None,
    })
}

fn long_name(name: &str) -> Option<Measure> {
    let name = name.strip_suffix('s').unwrap_or(name);
    Some(match name {
        "meter" | "metre" => Measure::of(METRE, 1.0),
        "watt" => Measure::of(WATT, 1.0),
        "hertz" => Measure::ONE.times(Measure::of(SECOND, 1.0), -1)?,
        "electronvolt" | "ev" => Measure::of(ELECTRONVOLT, 1.0),
        "flick" => {
            Measure::of(WATT, 1e10).times(Measure::of(METRE, 1.0), -3)?.times(Measure::of(STERADIAN, 1.0), -1)?
        }
        // Of the cross section of one molecule; a single b is more often a name.
        "barn" => Measure::ONE.times(Measure::of(METRE, 1e-14), 2)?,
        "joule" => Measure::of(WATT, 1.0).times(Measure::of(SECOND, 1.0), 1)?,
        _ => return None,
    })
}
