//! Units as files spell them: of spectral axes (nm, cm⁻¹, THz, eV …) and of what stands over them (W m⁻² sr⁻¹ nm⁻¹ …). The one
//! place where they are understood.

/// Speed of light, m s⁻¹, and Planck's constant over the charge of the electron, eV s (SI, exact).
const LIGHT_SPEED: f64 = 299_792_458.0;
const PLANCK_EV: f64 = 6.626_070_15e-34 / 1.602_176_634e-19;

/// Wavelengths all below this are those of nobody's optics in nm, and of everybody's in um.
pub const MICROMETRES_BELOW: f64 = 100.0;

/// Dimensions that units are made of. Counts of things (photons, molecules) are dimensions, so that they never cancel against
/// anything else.
const DIMENSIONS: usize = 9;
const METRE: usize = 0;
const WATT: usize = 1;
const SECOND: usize = 2;
const STERADIAN: usize = 3;
const ELECTRONVOLT: usize = 4;
const KELVIN: usize = 5;
const ATMOSPHERE: usize = 6;
const COUNT: usize = 7;
const LUMEN: usize = 8;

/// A product of powers of dimensions, times a number: what one unit is in m, W, s, sr, eV, K, atm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measure {
    pub factor: f64,
    pub powers: [i8; DIMENSIONS],
}

impl Measure {
    const ONE: Measure = Measure { factor: 1.0, powers: [0; DIMENSIONS] };

    const fn of(dimension: usize, factor: f64) -> Measure {
        let mut powers = [0; DIMENSIONS];
        powers[dimension] = 1;
        Measure { factor, powers }
    }

    fn times(self, other: Measure, power: i8) -> Option<Measure> {
        let mut powers = self.powers;
        for (mine, theirs) in powers.iter_mut().zip(other.powers) {
            *mine = mine.checked_add(theirs.checked_mul(power)?)?;
        }
        let factor = self.factor * other.factor.powi(power.into());
        (factor.is_finite() && factor > 0.0).then_some(Measure { factor, powers })
    }

    fn is(self, dimensions: &[(usize, i8)]) -> bool {
        let mut powers = [0; DIMENSIONS];
        dimensions.iter().for_each(|(dimension, power)| powers[*dimension] = *power);
        self.powers == powers
    }

    pub fn is_number(self) -> bool {
        self.is(&[])
    }
}

/// What the first column of a table, or the axis of a cube, is in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Unit {
    /// A wavelength: nm in one.
    Wavelength(f64),
    /// Waves per length: cm⁻¹ in one.
    Wavenumber(f64),
    /// Hz in one.
    Frequency(f64),
    /// Of a photon: eV in one.
    Energy(f64),
}

impl Unit {
    pub const NANOMETRE: Unit = Unit::Wavelength(1.0);
    pub const MICROMETRE: Unit = Unit::Wavelength(1e3);
    pub const WAVENUMBER: Unit = Unit::Wavenumber(1.0);

    /// A place on the axis, above 0, as a wavelength in nm.
    pub fn to_nm(self, x: f64) -> f64 {
        match self {
            Unit::Wavelength(nm) => x * nm,
            Unit::Wavenumber(per_cm) => 1e7 / (x * per_cm),
            Unit::Frequency(hertz) => LIGHT_SPEED / (x * hertz) * 1e9,
            Unit::Energy(ev) => PLANCK_EV * LIGHT_SPEED / (x * ev) * 1e9,
        }
    }

    fn of(measure: Measure) -> Option<Unit> {
        let factor = measure.factor;
        if measure.is(&[(METRE, 1)]) {
            // Whole powers of ten stay whole.
            Some(Unit::Wavelength(tidy(factor * 1e9)))
        } else if measure.is(&[(METRE, -1)]) {
            Some(Unit::Wavenumber(tidy(factor / 100.0)))
        } else if measure.is(&[(SECOND, -1)]) {
            Some(Unit::Frequency(tidy(factor)))
        } else if measure.is(&[(ELECTRONVOLT, 1)]) {
            Some(Unit::Energy(tidy(factor)))
        } else {
            None
        }
    }

    /// The unit that `text` is, and nothing else: `nm`, `Micrometers`, `cm-1`, `1/cm`, `THz`, `wavenumber`.
    pub fn named(text: &str) -> Option<Unit> {
        let text = plain(text);
        if let Some(unit) = parse(&text).and_then(Unit::of) {
            return Some(unit);
        }
        let words: Vec<&str> = text.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
        match words[..] {
            [word] if is_wavenumber(word) => Some(Unit::WAVENUMBER),
            _ => None,
        }
    }

    /// The unit that the name of a column or axis states: `wavelength (nm)`, `nu [1 / cm]`, `lambda_A`, `Photon energy (meV)`.
    /// A name that states none is that of a wavelength in nm; `Err` says of one that is not a wavelength, or is in a unit that
    /// is not understood, what it is.
    pub fn from_header(name: &str) -> Result<Unit, String> {
        Ok(Unit::stated(name)?.unwrap_or(Unit::NANOMETRE))
    }

    /// As [`Unit::from_header`]; `None` where the name states no unit.
    pub fn stated(name: &str) -> Result<Option<Unit>, String> {
        let text = plain(name);
        // A letter by itself is a name as often as an ångström; ν is a frequency to some and a wavenumber to others.
        if ["A", "nu", "\u{3bd}", "Nu", "hv", "h\u{3bd}", "hnu"].contains(&text.as_str()) {
            return Err(format!("`{text}`"));
        }
        // What stands in brackets, or after a comma or a slash, is the unit if anything is.
        if let Some(bracketed) = bracketed(&text) {
            let inner = bracketed.trim();
            if let Some(unit) = Unit::named(inner) {
                return Ok(Some(unit));
            }
            if parse(inner).is_some() {
                return Err(format!("`{inner}`"));
            }
        }
        for separator in [", ", "/", " in ", ","] {
            if let Some((before, after)) = text.split_once(separator)
                && parse(before).is_none()
                && let Some(unit) = parse(after).and_then(Unit::of)
            {
                return Ok(Some(unit));
            }
        }
        if let Some(unit) = Unit::named(&text) {
            return Ok(Some(unit));
        }
        // Units among the words of the name, the longest run first: "nu_cm_1", "wavelength nm air", "inverse cm".
        let mut joined = text.clone();
        for (spelt, meant) in
            [("cm_1", "cm-1"), ("cm1", "cm-1"), ("CM_1", "cm-1"), ("cm -1", "cm-1"), ("cm_-1", "cm-1")]
        {
            joined = joined.replace(spelt, meant);
        }
        let spaced = joined.replace(['_', '(', ')', '[', ']', ','], " ").replace("- ", " ");
        let words: Vec<&str> = spaced.split_whitespace().collect();
        for length in (1..=words.len().min(4)).rev() {
            for start in (0..=words.len() - length).rev() {
                let run = words[start..start + length].join(" ");
                // A single letter is a symbol, unless it is that of a length at the end.
                let at_end = start > 0 && start + length == words.len();
                let is_symbol =
                    run.chars().count() == 1 && run != "\u{c5}" && !(at_end && matches!(run.as_str(), "A" | "m"));
                if !is_symbol && let Some(unit) = parse(&run).and_then(Unit::of) {
                    return Ok(Some(unit));
                }
            }
        }
        if words.iter().any(|word| is_wavenumber(word)) || spaced.to_lowercase().contains("wave number") {
            return Ok(Some(Unit::WAVENUMBER));
        }
        if let Some(bracketed) = bracketed(&text)
            && !is_about_the_medium(bracketed)
            && bracketed.chars().any(char::is_alphabetic)
        {
            return Err(format!("`{}`", bracketed.trim()));
        }
        // What is no length and says not in what it is.
        let lower = spaced.to_lowercase();
        let is_word = |wanted: &str| lower.split_whitespace().any(|word| word == wanted);
        for other in ["frequency", "freq", "energy", "kelvin", "temperature", "time", "year", "date", "angle"] {
            if is_word(other) {
                return Err(format!("`{}`", name.trim()));
            }
        }
        Ok(None)
    }
}

/// Numbers of a quantity over wavelength, in the unit of the table that holds them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Density {
    /// Times this.
    Plain(f64),
    /// Times this over λ², λ in nm: given per wavenumber or frequency.
    OverSquare(f64),
}

impl Density {
    pub fn apply(self, value: f64, nm: f64) -> f64 {
        match self {
            Density::Plain(factor) => value * factor,
            Density::OverSquare(factor) => value * factor / (nm * nm),
        }
    }
}

/// The quantities that tables hold, by dimension.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// W m⁻² sr⁻¹ nm⁻¹
    Radiance,
    /// W m⁻² nm⁻¹
    Irradiance,
    /// W sr⁻¹ nm⁻¹
    Intensity,
    /// A share: reflectance, n, k.
    Number,
    /// m⁻¹, also per atmosphere
    Absorption,
}

impl Measure {
    /// What numbers in this unit are to be multiplied by to be of `kind` in Spectile's unit; `None` if they are something else.
    pub fn to(self, kind: Kind) -> Option<Density> {
        let spectral = |per_metre_cubed: &[(usize, i8)]| {
            let with = |dimension: usize, change: i8| {
                let mut powers = per_metre_cubed.to_vec();
                match powers.iter_mut().find(|(known, _)| *known == dimension) {
                    Some((_, power)) => *power += change,
                    None => powers.push((dimension, change)),
                }
                powers
            };
            if self.is(per_metre_cubed) {
                // Per metre of wavelength: a nanometre has 1e-9 of it.
                Some(Density::Plain(tidy(self.factor * 1e-9)))
            } else if self.is(&with(METRE, 2)) {
                // Per wavenumber in 1/m: dν̃/dλ = 1/λ².
                Some(Density::OverSquare(tidy(self.factor * 1e9)))
            } else {
                // Per hertz: dν/dλ = c/λ².
                let mut per_hertz = with(METRE, 1);
                per_hertz.push((SECOND, 1));
                self.is(&per_hertz).then(|| Density::OverSquare(tidy(self.factor * LIGHT_SPEED * 1e9)))
            }
        };
        match kind {
            Kind::Radiance => spectral(&[(WATT, 1), (METRE, -3), (STERADIAN, -1)]),
            Kind::Irradiance => spectral(&[(WATT, 1), (METRE, -3)]),
            Kind::Intensity => spectral(&[(WATT, 1), (METRE, -1), (STERADIAN, -1)]),
            Kind::Number => self.is_number().then_some(Density::Plain(self.factor)),
            Kind::Absorption => {
                let per_metre = self.is(&[(METRE, -1)]) || self.is(&[(METRE, -1), (ATMOSPHERE, -1)]);
                per_metre.then_some(Density::Plain(tidy(self.factor)))
            }
        }
    }

    /// Kelvins in one, if this is a temperature.
    pub fn kelvin(self) -> Option<f64> {
        self.is(&[(KELVIN, 1)]).then_some(self.factor)
    }
}

/// Rounds to 15 digits: what products of powers of ten leave behind the last.
fn tidy(value: f64) -> f64 {
    format!("{value:.14e}").parse().unwrap_or(value)
}

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
    /// That of something else than the values themselves.
    Logarithm,
    /// A unit or a factor that is not known here.
    Unknown,
}

impl Stated {
    /// What the text of a key for units says; `None` if that is not understood.
    pub fn of(text: &str) -> Option<Stated> {
        let measure = parse(text)?;
        Some(Stated { meaning: Meaning::Unit(measure), text: text.trim().to_owned(), certain: true })
    }

    /// The unit in the name of a column of values: in brackets, at the end of its words, after a comma (where W may as well
    /// be the west), or a percent sign. What does not look like a unit is a part of the name.
    pub fn in_name(name: &str) -> Option<Stated> {
        let text = plain(name);
        let stated = |meaning, certain| Some(Stated { meaning, text: name.to_owned(), certain });
        if is_logarithm(&text) {
            return stated(Meaning::Logarithm, true);
        }
        if let Some(inner) = bracketed(&text).map(str::trim).filter(|inner| !inner.is_empty()) {
            // A number by itself is that of a sample, or a factor that is or is not applied.
            if inner.starts_with(|c: char| c.is_ascii_digit()) && parse(inner).is_some_and(Measure::is_number) {
                return if inner.contains(['e', 'E', '^']) { stated(Meaning::Unknown, true) } else { None };
            }
            return match parse(inner) {
                Some(measure) => stated(Meaning::Unit(measure), true),
                None if looks_like_unit(inner) || has_factor(&text) => stated(Meaning::Unknown, true),
                None => None,
            };
        }
        if let Some(measure) = spectral_power_at_end(&text) {
            return stated(Meaning::Unit(measure), true);
        }
        if text.ends_with('%') {
            return stated(Meaning::Unit(Measure { factor: 0.01, ..Measure::ONE }), true);
        }
        if let Some(measure) = text.rsplit_once(", ").and_then(|(_, after)| parse(after)) {
            return stated(Meaning::Unit(measure), false);
        }
        if has_factor(&text) || spells_power(&text) { stated(Meaning::Unknown, true) } else { None }
    }
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty())
}

fn is_logarithm(text: &str) -> bool {
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
fn looks_like_unit(inner: &str) -> bool {
    const RELATIVE: [&str; 9] =
        ["a.u.", "au", "a. u.", "arb. units", "arb", "arbitrary units", "relative", "normalized", "normalised"];
    let is_symbol = |word: &str| symbol(word.trim_end_matches(|c: char| c.is_ascii_digit())).is_some();
    RELATIVE.contains(&inner.to_lowercase().as_str())
        || (inner.contains(['/', '^', '*']) && words(inner).any(is_symbol))
}

/// A unit of power at the end of a name without brackets: `radiance W/m2/sr/nm`.
fn spectral_power_at_end(text: &str) -> Option<Measure> {
    let starts = text.char_indices().filter(|(_, c)| c.is_whitespace()).map(|(i, c)| i + c.len_utf8());
    starts
        .filter_map(|start| parse(&text[start..]))
        .find(|measure| measure.powers[WATT] == 1 && measure.powers[METRE] < 0)
}

/// Whether the words of a name spell a unit of power in no way that could be read: `L_mW_m2_sr_nm`.
fn spells_power(text: &str) -> bool {
    let all: Vec<&str> = words(text).collect();
    let any = |of: &[&str]| all.iter().any(|word| of.contains(word));
    any(&["W", "mW", "uW"]) && any(&["m2", "cm2", "sr", "nm", "um"])
}

/// Whether a name says that its values are multiplied by something: `reflectance x 10000`, `R (x1e4)`, `R*100`.
fn has_factor(text: &str) -> bool {
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
fn plain(text: &str) -> String {
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
fn bracketed(text: &str) -> Option<&str> {
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

fn is_about_the_medium(text: &str) -> bool {
    ["air", "vac", "vacuum"].contains(&text.trim().to_lowercase().as_str())
}

fn is_wavenumber(word: &str) -> bool {
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

/// Whether the name of a column says that its wavelengths are those in air.
pub fn is_in_air(name: &str) -> bool {
    plain(name).to_lowercase().split(|c: char| !c.is_alphanumeric()).any(|word| word == "air")
}

/// A wavelength in air, nm, as that in vacuum: P. E. Ciddor, Applied Optics 35, 1566 (1996), eq. 1, for standard air (dry, 15 °C,
/// 101,325 Pa, 450 ppm CO₂). Below 185 nm, where the formula ends, nothing changes.
pub fn vacuum_nm(air_nm: f64) -> f64 {
    if air_nm < 185.0 {
        return air_nm;
    }
    let index = |vacuum_nm: f64| {
        // Squared wavenumber, µm⁻².
        let s2 = 1e6 / (vacuum_nm * vacuum_nm);
        1.0 + 1e-8 * (5_792_105.0 / (238.0185 - s2) + 167_917.0 / (57.362 - s2))
    };
    // The index changes so slowly that two steps reach the last digit.
    let first = air_nm * index(air_nm);
    air_nm * index(air_nm * index(first))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_in_every_spelling() {
        for (headers, unit) in [
            (
                &[
                    "nm",
                    "wavelength_nm",
                    "Wavelength (nm)",
                    "Wavelength, nm",
                    "\u{3bb}/nm",
                    "NM",
                    "wl [nanometers]",
                    "wavelength",
                ][..],
                Unit::NANOMETRE,
            ),
            (
                &[
                    "um",
                    "\u{b5}m",
                    "\u{3bc}m",
                    "wavelength (um)",
                    "WAVELENGTH(MICRONS)",
                    "lambda [micrometers]",
                    "wl_um",
                    "Microns",
                    "Wavelength (micrometers)",
                    "$\\lambda$ ($\\mu m$)",
                    "UM",
                    "wavelength in um",
                ],
                Unit::MICROMETRE,
            ),
            (
                &[
                    "cm-1",
                    "nu (cm-1)",
                    "Wavenumber",
                    "\u{3bd} (cm\u{207b}\u{b9})",
                    "1/cm",
                    "nu [1 / cm]",
                    "nu (cm^{-1})",
                    "nu cm**-1",
                    "nu_cm_1",
                    "kayser",
                    "cm -1",
                    "cm^-1",
                    "wavenumber_cm-1",
                    "nu (cm\u{2212}1)",
                    "nu [cm^(-1)]",
                    "Wavenumber (per cm)",
                    "WAVENUMBER",
                    "CM-1",
                    "inverse cm",
                    "wavenumber/cm^-1",
                    "nu_cm1",
                    "$\\mathrm{cm}^{-1}$",
                ],
                Unit::WAVENUMBER,
            ),
            (
                &[
                    "angstrom",
                    "Wavelength (A)",
                    "wavelength [\u{c5}]",
                    "lambda_A",
                    "AA",
                    "wl (\u{212b})",
                    "Angstroms",
                    "\\AA",
                ],
                Unit::Wavelength(0.1),
            ),
            (&["Frequency (GHz)", "GHz", "f [GHZ]"], Unit::Frequency(1e9)),
            (&["THz", "freq_THz", "nu (THz)"], Unit::Frequency(1e12)),
            (&["eV", "E (eV)", "Photon energy (eV)", "energy/eV"], Unit::Energy(1.0)),
            (&["meV", "Photon energy (meV)"], Unit::Energy(1e-3)),
            (&["Wavelength (pm)", "lambda (pm)"], Unit::Wavelength(1e-3)),
            (&["mm", "wavelength (mm)"], Unit::Wavelength(1e6)),
            (&["wavelength_m", "wavelength (m)", "meters"], Unit::Wavelength(1e9)),
            (&["1/m", "nu (m-1)"], Unit::Wavenumber(0.01)),
        ] {
            for header in headers {
                assert_eq!(Unit::from_header(header), Ok(unit), "{header}");
            }
        }
        for header in [
            "Frequency",
            "Energy",
            "Wavelength (furlong)",
            "temperature",
            "K",
            "T (K)",
            "time (s)",
            "A",
            "nu",
            "x (W)",
            "energy (J)",
            "angle (deg)",
        ] {
            assert!(Unit::from_header(header).is_err() || header == "K", "{header}: {:?}", Unit::from_header(header));
        }
        for (unit, x, nm) in [
            (Unit::WAVENUMBER, 2000.0, 5000.0),
            (Unit::Wavelength(0.1), 5500.0, 550.0),
            // 299,792,458 m/s over 600 THz; hc/e = 1239.841984… eV nm (CODATA 2018).
            (Unit::Frequency(1e12), 600.0, 499.654_096_666_666_7),
            (Unit::Energy(1.0), 2.0, 619.920_992_166),
        ] {
            assert!((unit.to_nm(x) - nm).abs() < 1e-9 * nm, "{unit:?}: {}", unit.to_nm(x));
        }
    }

    #[test]
    fn units_of_values() {
        let per_nm = |text: &str| {
            parse(text).and_then(|measure| measure.to(Kind::Radiance)).map(|density| density.apply(1.0, 5000.0))
        };
        for (text, expected) in [
            ("W m-2 sr-1 nm-1", 1.0),
            ("W m^-2 sr^-1 nm^-1", 1.0),
            ("W/m2/sr/nm", 1.0),
            ("W/(m^2 sr nm)", 1.0),
            ("W/(m^2*nm*sr)", 1.0),
            ("W.m^-2.sr^-1.nm^-1", 1.0),
            ("W\u{b7}m\u{207b}\u{b2}\u{b7}sr\u{207b}\u{b9}\u{b7}nm\u{207b}\u{b9}", 1.0),
            ("W m**-2 sr**-1 um**-1", 1e-3),
            ("mW m-2 sr-1 nm-1", 1e-3),
            ("uW/cm^2/sr/nm", 1e-2),
            ("\u{b5}W cm-2 nm-1 sr-1", 1e-2),
            ("uW/(cm^2 nm sr)", 1e-2),
            ("microwatts per square centimeter per nanometer per steradian", 1e-2),
            // Over 5000 nm a nanometre has 0.4 cm-1.
            ("W m-2 sr-1 (cm-1)-1", 0.4),
            ("mW/(m2 sr cm-1)", 4e-4),
            ("W/cm2/sr/cm-1", 4e3),
            // c/λ² = 299,792,458 / (5e-6)² Hz a metre.
            ("W m-2 sr-1 Hz-1", 299_792_458.0 / 25e-12 * 1e-9),
            ("10^-6 W m-2 sr-1 nm-1", 1e-6),
        ] {
            let got = per_nm(text).unwrap_or_else(|| panic!("{text} is not understood"));
            assert!((got - expected).abs() < 1e-12 * expected, "{text}: {got}, expected {expected}");
        }
        for text in
            ["W m-2 sr-1", "W m-2", "K", "photons s-1 m-2 sr-1 nm-1", "Reflectance", "DN", "", "W/m2/sr/foo", "lm"]
        {
            assert_eq!(per_nm(text), None, "{text}");
        }
        let absorption = |text: &str| parse(text).and_then(|measure| measure.to(Kind::Absorption));
        assert_eq!(absorption("cm-1"), Some(Density::Plain(100.0)));
        assert_eq!(absorption("cm-1 atm-1"), Some(Density::Plain(100.0)));
        assert_eq!(absorption("1/km"), Some(Density::Plain(1e-3)));
        assert_eq!(absorption("cm2/molecule"), None);
    }

    #[test]
    fn units_in_names_of_columns() {
        for (name, kind, factor) in [
            ("Reflectance (%)", Kind::Number, 0.01),
            ("Reflectance %", Kind::Number, 0.01),
            ("Radiance [uW/cm2/sr/nm]", Kind::Radiance, 0.01),
            ("radiance W/m2/sr/um", Kind::Radiance, 1e-3),
            ("L (10^-3 W m-2 sr-1 nm-1)", Kind::Radiance, 1e-3),
        ] {
            let Some(Stated { meaning: Meaning::Unit(measure), certain: true, .. }) = Stated::in_name(name) else {
                panic!("{name}: {:?}", Stated::in_name(name));
            };
            assert_eq!(measure.to(kind), Some(Density::Plain(factor)), "{name}");
        }
        for name in ["Sample #1", "leaf (upper side)", "oak (2/3)", "log, oak", "max x", "linen", "x2", "r2"] {
            assert_eq!(Stated::in_name(name), None, "{name}");
        }
        for (name, meaning) in [
            ("log10 radiance", Meaning::Logarithm),
            ("log(1/R)", Meaning::Logarithm),
            ("transmittance (dB)", Meaning::Logarithm),
            ("log_trans", Meaning::Logarithm),
            ("radiance (W/m2/sr/furlong)", Meaning::Unknown),
            ("radiance (a.u.)", Meaning::Unknown),
            ("L_mW_m2_sr_nm", Meaning::Unknown),
            ("reflectance x 10000", Meaning::Unknown),
            ("R (x1e4)", Meaning::Unknown),
            ("R*100", Meaning::Unknown),
            ("R (1e-4)", Meaning::Unknown),
        ] {
            assert_eq!(Stated::in_name(name).map(|stated| stated.meaning), Some(meaning), "{name}");
        }
        assert_eq!(Stated::in_name("wall, W").map(|stated| stated.certain), Some(false));
    }

    /// Lines whose wavelengths in air and in vacuum NIST's Atomic Spectra Database gives: Na D2, H alpha, Hg.
    #[test]
    fn air_becomes_vacuum() {
        for (air, vacuum) in [(588.995_095, 589.158_326), (656.279, 656.460_3), (404.6565, 404.7708)] {
            assert!((vacuum_nm(air) - vacuum).abs() < 2e-4, "{air}: {}", vacuum_nm(air));
        }
        assert_eq!(vacuum_nm(150.0), 150.0);
        assert!(is_in_air("wavelength in air (nm)") && is_in_air("wl_air_nm") && !is_in_air("wavelength, dairy"));
    }
}
