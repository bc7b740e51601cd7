//! Units as files spell them: of spectral axes (nm, cm⁻¹, THz, eV …) and of what stands over them (W m⁻² sr⁻¹ nm⁻¹ …). The one
//! place where they are understood.

mod axis;
mod sentence;
mod spelling;
#[cfg(test)]
mod tests;

use super::said::Said;
use sentence::{
    begins_with_factor, has_arithmetic, has_factor, is_logarithm, is_percent, is_percent_of, is_power_of_ten,
};
use spelling::{bracketed, is_about_the_medium, looks_like_unit, plain, spectral_power_at_end, spells_power, words};

use crate::spectral::planck::{CHARGE, LIGHT_SPEED, PLANCK};

pub use sentence::without_mark;
pub use spelling::parse;

/// Planck's constant, eV s.
const PLANCK_EV: f64 = PLANCK / CHARGE;

/// Wavelengths all below this are those of nobody's optics in nm, and of everybody's in um.
pub const MICROMETRES_BELOW: f64 = 100.0;

/// How words begin, in small letters, with which files say that their numbers are multiplied.
pub const FACTORS: [&str; 4] = ["scale", "factor", "gain", "multipl"];

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
    /// How many powers of lengths stand above and below the line: of W/(m2 cm-1) one and two. W m-2 per m-1 and W per m are of one
    /// dimension, and not of one quantity.
    lengths: [i8; 2],
    /// Whether a length shorter than a millimetre stands above the line by itself, as in W/m2*nm.
    is_odd: bool,
}

impl Measure {
    const ONE: Measure = Measure { factor: 1.0, powers: [0; DIMENSIONS], lengths: [0; 2], is_odd: false };

    const fn of(dimension: usize, factor: f64) -> Measure {
        let mut powers = [0; DIMENSIONS];
        powers[dimension] = 1;
        let lengths = if dimension == METRE { [1, 0] } else { [0; 2] };
        Measure { factor, powers, lengths, is_odd: false }
    }

    fn times(self, other: Measure, power: i8) -> Option<Measure> {
        let mut powers = self.powers;
        for (mine, theirs) in powers.iter_mut().zip(other.powers) {
            *mine = mine.checked_add(theirs.checked_mul(power)?)?;
        }
        let factor = self.factor * other.factor.powi(power.into());
        let mut lengths = self.lengths;
        for (side, mine) in lengths.iter_mut().enumerate() {
            let theirs = other.lengths[if power < 0 { 1 - side } else { side }];
            *mine = mine.checked_add(theirs.checked_mul(power.checked_abs()?)?)?;
        }
        let is_odd = self.is_odd || (other.is_odd && power > 0);
        (factor.is_finite() && factor > 0.0).then_some(Measure { factor, powers, lengths, is_odd })
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
    pub const METRE: Unit = Unit::Wavelength(1e9);
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
        let bare = text.trim_matches(|c: char| !c.is_alphanumeric());
        axis::is_nothing_but_wavenumber(bare).then_some(Unit::WAVENUMBER)
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
        // `wavelength (x10 nm)` and `tenths of nm` say two things at once.
        let lower = text.to_lowercase();
        if has_factor(&text)
            || words(&lower).any(|word| ["tenths", "tenth", "hundreds", "hundredths", "tens"].contains(&word))
        {
            return Err(format!("`{text}`"));
        }
        if axis::is_none(&lower) {
            return Err(format!("`{text}`"));
        }
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
        let is_wavenumber = axis::speaks_of_wavenumber(&lower);
        // `wavenumber (kcm-1)` says more than `wavenumber (measured)`.
        if is_wavenumber && !lower.contains("cm") {
            return Ok(Some(Unit::WAVENUMBER));
        }
        if let Some(bracketed) = bracketed(&text)
            && !is_about_the_medium(bracketed)
            && bracketed.chars().any(|c| c.is_alphabetic() || c.is_control())
        {
            return Err(format!("`{}`", bracketed.trim()));
        }
        if is_wavenumber {
            return Err(format!("`{text}`"));
        }
        // What is no length and says not in what it is.
        if axis::needs_unit(&spaced.to_lowercase()) { Err(format!("`{}`", name.trim())) } else { Ok(None) }
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
        // A unit over a spectral axis names that axis: per nm all lengths stand below the line, per cm-1 one stands above it.
        let below = if kind == Kind::Intensity { 0 } else { 2 };
        let named = match self.lengths {
            [0, all] => all == below + 1 || (all == below && self.powers[SECOND] != 0),
            [1, all] => all == below && !self.is_odd,
            _ => false,
        };
        let spectral = |per_metre_cubed: &[(usize, i8)]| {
            if !named {
                return None;
            }
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

    /// What a cross section of a molecule in this unit is as an absorption per metre and atmosphere of partial pressure, at
    /// `kelvin`; `None` if it is none. The number of molecules in 1 m³ is p / (k T).
    pub fn cross_section_per_atmosphere(self, kelvin: f64) -> Option<f64> {
        const BOLTZMANN: f64 = 1.380_649e-23;
        const ATMOSPHERE_PA: f64 = 101_325.0;
        let is_area = self.is(&[(METRE, 2), (COUNT, -1)]) || self.is(&[(METRE, 2)]);
        is_area.then(|| self.factor * ATMOSPHERE_PA / (BOLTZMANN * kelvin))
    }

    /// Whether this has the dimension of a spectral radiance, irradiance, intensity or power.
    fn is_spectral_power(self) -> bool {
        let mut others = self.powers;
        let [metre, watt, second, steradian] = [METRE, WATT, SECOND, STERADIAN].map(|i| std::mem::take(&mut others[i]));
        watt == 1
            && others == [0; DIMENSIONS]
            && matches!(
                (metre, second, steradian),
                (-3 | -1 | 1, 0, -1) | (-2 | 0, 1, -1) | (-3 | -1, 0, 0) | (-2, 1, 0)
            )
    }

    /// Whether numbers in this unit are those of Spectile's.
    pub fn is_own(self) -> bool {
        [Kind::Radiance, Kind::Irradiance, Kind::Intensity]
            .iter()
            .any(|kind| self.to(*kind) == Some(Density::Plain(1.0)))
    }

    /// Kelvins in one, if this is a temperature.
    pub fn kelvin(self) -> Option<f64> {
        self.is(&[(KELVIN, 1)]).then_some(self.factor)
    }
}

/// The kelvins that `text` says, a number and a unit of temperature.
pub fn kelvin(text: &str) -> Option<f64> {
    let number = text.rfind(|c: char| c.is_ascii_digit() || c == '.')? + 1;
    let (number, unit) = (text[..number].trim().parse::<f64>().ok()?, text[number..].trim());
    match unit.to_lowercase().trim_start_matches(['°', 'º']) {
        "f" | "degf" | "deg_f" | "deg f" | "fahrenheit" => Some((number + 459.67) * 5.0 / 9.0),
        _ if is_celsius(unit) => Some(number + 273.15),
        _ => Some(number * spelling::parse(unit)?.kelvin()?),
    }
}

/// Whether a unit is the degree Celsius, which no factor makes a kelvin.
pub fn is_celsius(unit: &str) -> bool {
    let unit = unit.to_lowercase();
    let spellings = ["c", "celsius", "degc", "deg_c", "deg c", "degree_celsius", "degrees_celsius"];
    spellings.contains(&unit.trim_start_matches(['°', 'º']).trim_start())
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
        let measure = spelling::spectral_power_within(&plain(text))
            .or_else(|| speaks_of_percent(text).then_some(Measure { factor: 0.01, ..Measure::ONE }))?;
        Some(Stated { meaning: Meaning::Unit(measure), text: text.trim().to_owned(), certain: false })
    }

    /// Whether what is said is a share or a plain number.
    pub fn is_number(&self) -> bool {
        matches!(self.meaning, Meaning::Unit(measure) if measure.is_number())
    }

    /// Whether values are said to be percent.
    pub fn is_percent(&self) -> bool {
        self.meaning == Meaning::Unit(Measure { factor: 0.01, ..Measure::ONE })
    }

    /// The unit in the name of a column of values: in brackets, at the end of its words, after a comma (where W may as well
    /// be the west), or a percent sign at either end. What does not look like a unit is a part of the name.
    pub fn in_name(name: &str) -> Option<Stated> {
        let text = plain(name);
        let stated = |meaning, certain| Some(Stated { meaning, text: name.to_owned(), certain });
        if is_logarithm(&text) {
            return stated(Meaning::Logarithm, true);
        }
        if let Some(inner) = bracketed(&text).map(str::trim).filter(|inner| !inner.is_empty()) {
            // A number by itself is that of a sample, or a factor that is or is not applied.
            if inner.starts_with(|c: char| c.is_ascii_digit()) && parse(inner).is_some_and(Measure::is_number) {
                let is_factor = inner.contains(['e', 'E', '^']) || is_power_of_ten(inner);
                return if is_factor { stated(Meaning::Factor, true) } else { None };
            }
            // A number within the unit belongs to it: (10^-6 W m-2).
            if parse(inner).is_none() && states_a_factor(inner) || has_factor(&text.replacen(inner, "", 1)) {
                return stated(Meaning::Factor, true);
            }
            // A unit by a line of its own, or in brackets: %R, Abs, which of a reflectance is that it is absolute.
            if is_percent_of(inner) {
                return stated(Meaning::Unit(Measure { factor: 0.01, ..Measure::ONE }), true);
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
            return match parse(inner) {
                Some(measure) => stated(Meaning::Unit(measure), true),
                None if looks_like_unit(&text[..text.rfind(inner).unwrap_or(0)], inner) => {
                    stated(if has_factor(&text) { Meaning::Factor } else { Meaning::Unknown }, true)
                }
                None if has_factor(&text) => stated(Meaning::Factor, true),
                None => None,
            };
        }
        if has_factor(&text) || begins_with_factor(&text) || has_arithmetic(&text) {
            return stated(Meaning::Factor, true);
        }
        // Nothing but a unit, and one of so many parts that no name is like it: photons/s/m2/nm/sr.
        if let Some(measure) =
            parse(&text).filter(|measure| measure.powers.iter().filter(|power| **power != 0).count() > 2)
        {
            return stated(Meaning::Unit(measure), true);
        }
        if let Some(measure) = spectral_power_at_end(&text) {
            return stated(Meaning::Unit(measure), true);
        }
        // Spectrophotometers write %R and %T.
        match is_percent(&text) {
            Some(true) => return stated(Meaning::Unit(Measure { factor: 0.01, ..Measure::ONE }), true),
            Some(false) => {}
            None => return stated(Meaning::Unknown, true),
        }
        if let Some(measure) = text.rsplit_once(", ").and_then(|(_, after)| parse(after)) {
            return stated(Meaning::Unit(measure), false);
        }
        if spells_power(&text) { stated(Meaning::Unknown, true) } else { None }
    }
}

/// Whether the name of a column is that of a spectral axis: by its first word, or as nothing but a unit of one after a name.
pub fn is_axis(name: &str) -> bool {
    let lower = plain(name).to_lowercase();
    let first = words(&lower).find(|word| word.chars().any(char::is_alphabetic)).unwrap_or("");
    let begins = ["wavelength", "wavenumber", "wavelen", "wvl", "frequency"].iter().any(|axis| first.starts_with(axis));
    let is_symbol = ["wl", "nu", "lambda", "\u{3bb}", "nm", "um", "cm", "ev", "thz"].contains(&first);
    // A band over `b nm`; but `b4 (665 nm)` is where one band is.
    let all: Vec<&str> = words(&lower).collect();
    let is_place = all.len() > 1 && all[all.len() - 2].parse::<f64>().is_ok();
    let ends = all.last().is_some_and(|word| ["nm", "um"].contains(word));
    let is_of_values = Stated::in_name(name).is_some_and(|stated| match stated.meaning {
        Meaning::Unit(measure) => Unit::of(measure).is_none(),
        Meaning::Unknown => false,
        Meaning::Logarithm | Meaning::Factor => true,
    });
    !is_of_values && (begins || ((is_symbol || ends) && !is_place && matches!(Unit::stated(name), Ok(Some(_)))))
}

/// Whether the name of a column says that its wavelengths are those in air.
pub fn is_in_air(name: &str) -> bool {
    plain(name).to_lowercase().split(|c: char| !c.is_alphanumeric()).any(|word| word == "air")
}

/// Whether a sentence says that its wavelengths are those in air.
pub fn speaks_of_air(text: &str) -> bool {
    let lower = text.to_lowercase();
    let of_axis = ["wave", "lambda", "\u{3bb}"].iter().any(|word| lower.contains(word));
    let in_air = ["in air", "in standard air", "in dry air", "in the air"].iter().any(|words| {
        lower.split(words).skip(1).any(|after| !after.starts_with(|c: char| c.is_alphanumeric() || c == '-'))
    });
    let said = in_air || ["air wave", "(air)", "[air]", ": air", "= air"].iter().any(|words| lower.contains(words));
    of_axis && said && !lower.contains("vac")
}

/// Whether a sentence says that values are to be, or have been, multiplied: `scale factor: 0.001`, `multiply by 1e-3`,
/// `values x 1000`.
pub fn states_a_factor(text: &str) -> bool {
    sentence::states_a_factor(&plain(text))
}

/// Whether a sentence says that the values are in percent: `Reflectance in percent`, `column 2: reflectance (%)`, `units: percent`.
pub fn speaks_of_percent(text: &str) -> bool {
    sentence::speaks_of_percent(text)
}

/// The unit of an absorption or of a cross section that a sentence about one holds, if it does.
pub fn of_matter_within(text: &str) -> Option<String> {
    let text = plain(without_mark(text));
    let lower = text.to_lowercase();
    let is_about =
        ["absor", "cross", "coeff", "scatter", "extinc", "kappa", "sigma"].iter().any(|of| lower.contains(of));
    let all: Vec<&str> = text.split_whitespace().collect();
    let runs = (1..=4usize.min(all.len())).rev().flat_map(|length| all.windows(length));
    let of_run = |run: &[&str]| {
        let run = run.join(" ");
        let run = run.trim_matches([',', ';', ':', '.', '(', ')', '[', ']']);
        let measure = parse(run)?;
        let is_one = measure.to(Kind::Absorption).is_some() || measure.cross_section_per_atmosphere(1.0).is_some();
        (is_one && measure.to(Kind::Absorption) != Some(Density::Plain(1.0))).then(|| run.to_owned())
    };
    let of_axis = lower.contains("wave");
    runs.filter(|_| is_about && !of_axis).find_map(of_run)
}

/// Whether a text is nothing but what values are of that are no values: `absorbance`, `log(1/R)`, `K/S`.
pub fn is_logarithm_only(text: &str) -> bool {
    let text = plain(text);
    text.split_whitespace().count() <= 3 && is_logarithm(&text)
}

/// Whether a text is nothing but percent, or percent of a quantity: `%`, `%R`, `% Reflectance`, `R (%)`.
pub fn is_percent_only(text: &str) -> bool {
    let text = plain(text);
    text.split_whitespace().count() <= 3
        && (is_percent_of(&text) || Stated::in_name(&text).is_some_and(|stated| stated.is_percent()))
}

/// What is said of wavelengths in air, after the name of their file.
pub const FROM_AIR: &str = "gives wavelengths in air: they are converted to vacuum (Ciddor 1996, dry air of 15 °C)";

/// A wavelength in air, nm, as that in vacuum: P. E. Ciddor, Applied Optics 35, 1566 (1996), eq. 1, for standard air (dry, 15 °C,
/// 101,325 Pa, 450 ppm CO₂). Below 185 nm, where the formula ends, nothing changes.
pub fn vacuum_nm(air_nm: f64) -> f64 {
    if air_nm < CIDDOR_FROM_NM {
        return air_nm;
    }
    // The index changes so slowly that two steps reach the last digit.
    let first = air_nm * ciddor(air_nm);
    air_nm * ciddor(air_nm * ciddor(first))
}

/// The index of refraction of the same air at a wavelength in vacuum, nm; 1 where the formula has ended.
pub fn air_index(vacuum_nm: f64) -> f64 {
    if vacuum_nm < CIDDOR_FROM_NM { 1.0 } else { ciddor(vacuum_nm) }
}

const CIDDOR_FROM_NM: f64 = 185.0;

fn ciddor(vacuum_nm: f64) -> f64 {
    // Squared wavenumber, µm⁻².
    let s2 = 1e6 / (vacuum_nm * vacuum_nm);
    1.0 + 1e-8 * (5_792_105.0 / (238.0185 - s2) + 167_917.0 / (57.362 - s2))
}
