//! Temperatures: numbers with a unit, and the units that names say.

use super::places::bracketed;
use super::spelling::{self, plain};

/// The kelvins that `text` says, a number and a unit of temperature.
pub fn kelvin(text: &str) -> Option<f64> {
    let number = text.rfind(|c: char| c.is_ascii_digit() || c == '.')? + 1;
    let (number, unit) = (text[..number].trim().parse::<f64>().ok()?, text[number..].trim());
    match unit {
        _ if is_fahrenheit(unit) => Some((number + 459.67) * 5.0 / 9.0),
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

fn is_fahrenheit(unit: &str) -> bool {
    let unit = unit.to_lowercase();
    ["f", "degf", "deg_f", "deg f", "fahrenheit"].contains(&unit.trim_start_matches(['°', 'º']).trim_start())
}

/// The unit that a name or a sentence says of temperatures: `temperature_C`, `LST_cK`, `tempC`, `temperature [°C]`, `celsius`,
/// `Temperature in Celsius`.
pub fn of_temperature(name: &str) -> Option<String> {
    // A name of EXR in UTF-8, read as Latin-1, has a sign more.
    let text = plain(&name.replace("\u{c2}\u{b0}", "\u{b0}"));
    let is_unit = |word: &str| {
        let is_rankine = ["r", "rankine"].contains(&word.to_lowercase().as_str());
        is_celsius(word)
            || is_fahrenheit(word)
            || is_rankine
            || ["k", "mk", "ck"].contains(&word.to_lowercase().as_str())
            || spelling::parse(word).is_some_and(|measure| measure.kelvin().is_some())
    };
    let first = text.to_lowercase();
    let is_of_temperature = first.starts_with('t')
        || ["lst", "sst", "bt", "brightness", "surface", "skin", "air"].iter().any(|start| first.starts_with(start));
    if let Some(inner) = bracketed(&text).map(str::trim).filter(|inner| is_of_temperature && is_unit(inner)) {
        return Some(inner.to_owned());
    }
    let words: Vec<&str> =
        text.split(|c: char| !c.is_alphanumeric() && c != '°' && c != 'º').filter(|word| !word.is_empty()).collect();
    match words[..] {
        // A letter by itself is a channel's name.
        [only] if only.chars().count() > 2 && is_unit(only) => Some(only.to_owned()),
        [only] => {
            only.strip_prefix("temp").or(only.strip_prefix("Temp")).filter(|unit| is_unit(unit)).map(str::to_owned)
        }
        [.., last] if is_of_temperature && is_unit(last) => Some(last.to_owned()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_of_temperatures_in_names() {
        for (name, unit) in [
            ("temperature_C", "C"),
            ("Temp_C", "C"),
            ("T(C)", "C"),
            ("T_degC", "degC"),
            ("tempC", "C"),
            ("celsius", "celsius"),
            ("LST_C", "C"),
            ("temperature [\u{b0}C]", "\u{b0}C"),
            ("temperature [\u{c2}\u{b0}C]", "\u{b0}C"),
            ("temperature.C", "C"),
            ("degF", "degF"),
            ("fahrenheit", "fahrenheit"),
            ("T_cK", "cK"),
            ("T_mK", "mK"),
            ("temperature_F", "F"),
            ("Temperature (C)", "C"),
            ("temperature in Celsius", "Celsius"),
            ("kelvin", "kelvin"),
        ] {
            assert_eq!(of_temperature(name).as_deref(), Some(unit), "{name}");
        }
        for name in ["Y", "C", "K", "F", "T", "temperature", "B.C", "soil_C", "R", "temp", "emissivity (C)"] {
            assert_eq!(of_temperature(name), None, "{name}");
        }
    }
}
