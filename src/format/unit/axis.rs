//! Words that name a spectral axis, and words that name one from which no wavelength follows.

use super::spelling::words;

/// Wavenumber in one word, in small letters.
const WAVENUMBER: [&str; 16] = [
    "wavenumber",
    "wavenumbers",
    "wavenum",
    "wvnum",
    "kayser",
    "kaysers",
    "wellenzahl",
    "wellenzahlen",
    "golfgetal",
    "golfgetallen",
    "v\u{e5}gtal",
    "b\u{f8}lgetal",
    "b\u{f8}lgetall",
    "vlno\u{10d}et",
    "aaltoluku",
    "hull\u{e1}msz\u{e1}m",
];

/// The same in several words, or in scripts that have no blanks; accents and kinds of apostrophes aside.
const WAVENUMBER_PHRASES: [&str; 14] = [
    "wave number",
    "nombre d'onde",
    "nombres d'onde",
    "numero de onda",
    "numeros de onda",
    "numero d'onda",
    "numero di onda",
    "numeri d'onda",
    "liczba falowa",
    "dalga sayisi",
    "\u{6ce2}\u{6570}",
    "\u{6ce2}\u{6578}",
    "\u{43b}\u{43d}\u{43e}\u{432}\u{43e}\u{435} \u{447}\u{438}\u{441}\u{43b}\u{43e}",
    "\u{d30c}\u{c218}",
];

/// Wavelength in one word, or the symbol of one, in small letters.
const WAVELENGTH: [&str; 26] = [
    "wavelength",
    "wavelengths",
    "wavelen",
    "wavel",
    "wave",
    "waves",
    "wvl",
    "wl",
    "wls",
    "lambda",
    "lambdas",
    "\u{3bb}",
    "lam",
    "awav",
    "wellenl\u{e4}nge",
    "wellenl\u{e4}ngen",
    "wellenlaenge",
    "golflengte",
    "golflengten",
    "v\u{e5}gl\u{e4}ngd",
    "b\u{f8}lgel\u{e6}ngde",
    "b\u{f8}lgelengde",
    "aallonpituus",
    "hull\u{e1}mhossz",
    "dalgaboyu",
    "vlnov\u{e1}",
];

/// The same in several words, or in scripts that have no blanks, without accents.
const WAVELENGTH_PHRASES: [&str; 13] = [
    "wave length",
    "longueur d'onde",
    "longueurs d'onde",
    "longitud de onda",
    "longitudes de onda",
    "comprimento de onda",
    "lunghezza d'onda",
    "lunghezza di onda",
    "dlugosc fali",
    "\u{6ce2}\u{957f}",
    "\u{6ce2}\u{9577}",
    "\u{434}\u{43b}\u{438}\u{43d}\u{430} \u{432}\u{43e}\u{43b}\u{43d}\u{44b}",
    "\u{d30c}\u{c7a5}",
];

/// What names an axis of something else where nothing says a unit, in small letters, accents aside.
const NO_WAVELENGTH_WITHOUT_UNIT: [&str; 29] = [
    "frequency",
    "freq",
    "frequenz",
    "frequence",
    "frecuencia",
    "frequenza",
    "frequentie",
    "frequencia",
    "energy",
    "energie",
    "energia",
    "kelvin",
    "temperature",
    "time",
    "year",
    "date",
    "angle",
    "wn",
    "wvn",
    "wno",
    "wavn",
    "nutilde",
    "\u{3bd}\u{303}",
    "\u{447}\u{430}\u{441}\u{442}\u{43e}\u{442}\u{430}",
    "\u{44d}\u{43d}\u{435}\u{440}\u{433}\u{438}\u{44f}",
    "\u{9891}\u{7387}",
    "\u{80fd}\u{91cf}",
    "\u{5468}\u{6ce2}\u{6570}",
    "\u{30a8}\u{30cd}\u{30eb}\u{30ae}\u{30fc}",
];

/// What is counted, or is no place in a spectrum, where the name is nothing else.
const COUNTED: [&str; 19] = [
    "pixel", "pixels", "channel", "channels", "band", "bands", "index", "point", "points", "step", "steps", "position",
    "number", "no", "nr", "id", "row", "age", "mass",
];

/// Of these every length, wavenumber or energy is a difference, a width or that of a thing.
const NEVER: [&str; 23] = [
    "raman",
    "shift",
    "shifts",
    "fwhm",
    "hwhm",
    "bandwidth",
    "linewidth",
    "halfwidth",
    "retardation",
    "opd",
    "loss",
    "binding",
    "spatial",
    "stokes",
    "delay",
    "resolution",
    "mismatch",
    "error",
    "errors",
    "uncertainty",
    "stdev",
    "stddev",
    "\u{3b4}\u{3bb}",
];

/// So are these, unless the name speaks of waves too.
const NEVER_UNLESS_WAVES: [&str; 20] = [
    "thickness",
    "diameter",
    "radius",
    "size",
    "width",
    "distance",
    "depth",
    "height",
    "path",
    "pathlength",
    "theta",
    "2theta",
    "twotheta",
    "angle",
    "absorption",
    "absorbance",
    "absorptivity",
    "extinction",
    "scattering",
    "attenuation",
];

/// In small letters, with one apostrophe and without the accents of Romance languages.
fn simple(lower: &str) -> String {
    let plain = |c: char| match c {
        '\u{2019}' | '\u{b4}' | '`' => '\'',
        '\u{e0}' | '\u{e1}' => 'a',
        '\u{e8}' | '\u{e9}' => 'e',
        '\u{ed}' | '\u{131}' => 'i',
        '\u{f3}' => 'o',
        '\u{fa}' => 'u',
        '_' => ' ',
        other => other,
    };
    lower.chars().map(plain).collect()
}

/// Whether a word is that of wavenumbers.
pub(super) fn is_wavenumber(word: &str) -> bool {
    WAVENUMBER.contains(&word.to_lowercase().as_str())
}

/// Whether a name, in small letters, speaks of wavenumbers in any way.
pub(super) fn speaks_of_wavenumber(lower: &str) -> bool {
    let simple = simple(lower);
    // A frequency in Japanese ends like one.
    let simple = simple.replace("\u{5468}\u{6ce2}\u{6570}", "");
    words(lower).any(is_wavenumber) || WAVENUMBER_PHRASES.iter().any(|phrase| simple.contains(phrase))
}

/// Whether a name, in small letters, speaks of wavelengths in any way; numbers may stand behind the word.
pub(super) fn speaks_of_wavelength(lower: &str) -> bool {
    let simple = simple(lower);
    let bare = |word: &str| word.trim_end_matches(|c: char| c.is_ascii_digit()).to_owned();
    words(&simple).chain(words(lower)).any(|word| WAVELENGTH.contains(&bare(word).as_str()))
        || WAVELENGTH_PHRASES.iter().any(|phrase| simple.contains(phrase))
}

/// Whether a name, in small letters, is one of wavelengths by its first or its last word (`wl2`, `B1 wavelength`), numbers and
/// what stands in brackets aside; one of another thing at a wavelength (`665 nm`, `B4, lambda 665`) is none.
pub(super) fn is_of_wavelengths(lower: &str) -> bool {
    let simple = simple(lower);
    let outside = simple.split(['(', '[']).next().unwrap_or("");
    let bare = |word: &&str| !word.bytes().all(|c| c.is_ascii_digit());
    let all: Vec<&str> = words(outside).filter(bare).collect();
    let is = |word: &&str| speaks_of_wavelength(word);
    let has_place = words(outside).any(|word| word.parse::<f64>().is_ok_and(|place| place >= 100.0));
    !has_place
        && (all.first().is_some_and(is)
            || all.last().is_some_and(is)
            || WAVELENGTH_PHRASES.iter().any(|phrase| outside.trim().starts_with(phrase)))
}

/// Whether a name is one of wavenumbers, and nothing else.
pub(super) fn is_nothing_but_wavenumber(text: &str) -> bool {
    let lower = text.trim().to_lowercase();
    is_wavenumber(&lower) || WAVENUMBER_PHRASES.contains(&simple(&lower).as_str())
}

/// Whether no wavelength follows from what an axis of this name, in small letters, has, in whatever unit.
pub(super) fn is_none(lower: &str) -> bool {
    let any = |list: &[&str]| words(lower).any(|word| list.contains(&word));
    let squeezed = lower.replace(' ', "");
    // A function of it is none: `1/lambda`, `lambda^2`, `log wavelength`, `sqrt(nm)`, `m/z`.
    let is_function = ["1/lambda", "1/\u{3bb}", "1/wavelength", "m/z"].iter().any(|start| squeezed.starts_with(start))
        || words(lower).next().is_some_and(|word| ["log", "log10", "ln", "sqrt"].contains(&word))
        || (speaks_of_wavelength(lower) && (squeezed.contains("lambda^2") || squeezed.contains("\u{3bb}^2")));
    if is_function {
        return true;
    }
    let of_waves = ["wave", "lambda", "\u{3bb}"].iter().any(|word| lower.contains(word));
    any(&NEVER) || (any(&NEVER_UNLESS_WAVES) && !of_waves)
}

/// Whether a name, in small letters, says without a unit that it is no wavelength's.
pub(super) fn needs_unit(lower: &str) -> bool {
    let simple = simple(lower);
    let of_waves = simple.contains("wavelength");
    let is = |word: &str| {
        let word = word.trim_matches(['.', ',', ':', ';']);
        NO_WAVELENGTH_WITHOUT_UNIT.contains(&word)
    };
    let is_count = match words(lower).collect::<Vec<_>>()[..] {
        [only] | [only, "number" | "no" | "nr" | "index"] => COUNTED.contains(&only),
        _ => false,
    };
    if is_count {
        return true;
    }
    // Scripts without blanks have more than the word between them.
    simple.split_whitespace().any(is) && !of_waves || simple.contains("\u{5468}\u{6ce2}\u{6570}")
}
