//! Units as files spell them: of spectral axes (nm, cm⁻¹, THz, eV …) and of what stands over them (W m⁻² sr⁻¹ nm⁻¹ …). The one
//! place where they are understood.

mod axis;
mod places;
mod sentence;
mod spelling;
mod stated;
mod temperature;
#[cfg(test)]
mod tests;

use places::{bracketed, is_about_the_medium};
use sentence::{has_factor, is_logarithm, is_percent_of};
use spelling::{plain, words};

use crate::spectral::planck::{CHARGE, LIGHT_SPEED, PLANCK};

pub use sentence::without_mark;
pub use spelling::parse;
pub use stated::{Meaning, Stated};
pub use temperature::{is_celsius, kelvin, of_temperature};

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
        const AMBIGUOUS: [&str; 12] =
            ["A", "E", "f", "nu", "\u{3bd}", "\u{3bd}\u{303}", "Nu", "nu_tilde", "nu tilde", "hv", "h\u{3bd}", "hnu"];
        if AMBIGUOUS.contains(&text.as_str()) {
            return Err(format!("`{text}`"));
        }
        let is_wavenumber = axis::speaks_of_wavenumber(&lower);
        let stated = Unit::among(&text)?;
        // A wavenumber in nm, or in cm, is one or the other.
        if is_wavenumber && matches!(stated, Some(Unit::Wavelength(_))) {
            return Err(format!("`{text}`"));
        }
        if stated.is_some() {
            return Ok(stated);
        }
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
        let spaced = places::spaced(&text).to_lowercase();
        if axis::needs_unit(&spaced) { Err(format!("`{}`", name.trim())) } else { Ok(None) }
    }

    /// The unit in a name: in brackets, after a comma or a slash, or among its words; `Err` is of what is in brackets one of
    /// something else.
    fn among(text: &str) -> Result<Option<Unit>, String> {
        // What stands in brackets, or after a comma or a slash, is the unit if anything is.
        if let Some(bracketed) = bracketed(text) {
            let inner = bracketed.trim();
            if let Some(unit) = Unit::named(inner) {
                return Ok(Some(unit));
            }
            if parse(inner).is_some() {
                return Err(format!("`{inner}`"));
            }
        }
        for separator in [", ", "/", " in ", ","] {
            // What a slash stands behind a 1 or nothing of is a reciprocal: `wavenumber 1/cm`.
            let is_reciprocal = |before: &str| {
                let before = before.trim_end();
                separator == "/"
                    && (before.is_empty()
                        || before.ends_with([' ', '_', '('])
                        || before.ends_with(" 1")
                        || before.ends_with("_1"))
            };
            if let Some((before, after)) = text.split_once(separator)
                && !is_reciprocal(before)
                && parse(before).is_none()
                && let Some(unit) = parse(after).and_then(Unit::of)
            {
                return Ok(Some(unit));
            }
        }
        // Units among the words of the name, the longest run first: "nu_cm_1", "wavelength nm air", "inverse cm".
        let spaced = places::spaced(text);
        let whole = if text.contains(['(', '[']) { Unit::named(text) } else { None };
        if let Some(unit) = whole.or_else(|| Unit::named(spaced.trim())) {
            return Ok(Some(unit));
        }
        let words: Vec<&str> = spaced.split_whitespace().collect();
        for length in (1..=words.len().min(4)).rev() {
            for start in (0..=words.len() - length).rev() {
                let run = words[start..start + length].join(" ");
                // A single letter is a symbol, unless it is that of a length at the end.
                let at_end = start > 0 && start + length == words.len();
                let is_symbol =
                    run.chars().count() == 1 && run != "\u{c5}" && !(at_end && matches!(run.as_str(), "A" | "m"));
                // Of no value, in which two letters are a name as often.
                let run = if at_end && run == "aa" { "\u{c5}".to_owned() } else { run };
                if !is_symbol && let Some(unit) = parse(&run).and_then(Unit::of) {
                    return Ok(Some(unit));
                }
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

/// Rounds to 15 digits: what products of powers of ten leave behind the last.
fn tidy(value: f64) -> f64 {
    format!("{value:.14e}").parse().unwrap_or(value)
}

/// Whether the name of a column is that of a spectral axis: by its first word, or as nothing but a unit of one after a name.
pub fn is_axis(name: &str) -> bool {
    let lower = plain(name).to_lowercase();
    let first = words(&lower).find(|word| word.chars().any(char::is_alphabetic)).unwrap_or("");
    let begins = ["wavelength", "wavenumber", "wavelen", "wvl", "frequency"].iter().any(|axis| first.starts_with(axis))
        || axis::is_of_wavelengths(&lower)
        || axis::speaks_of_wavenumber(&lower);
    let of_number = first.trim_end_matches(|c: char| c.is_ascii_digit());
    let is_symbol = ["nu", "nm", "um", "cm", "ev", "thz"].contains(&of_number);
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

/// What stands in the last pair of brackets of a name.
pub fn bracketed_in(name: &str) -> Option<String> {
    bracketed(name).map(str::to_owned)
}

/// Whether the name of a column says that its wavelengths are those in air.
pub fn is_in_air(name: &str) -> bool {
    const AIR: [&str; 7] = ["air", "awav", "luft", "aire", "aria", "lucht", "\u{7a7a}\u{6c14}"];
    let lower = plain(name).to_lowercase();
    words(&lower).any(|word| AIR.contains(&word))
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
