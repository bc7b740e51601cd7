//! What files call the quantity that they hold, beside its unit.

/// A quantity by the noun of a name: of a column, an array, a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Said {
    Reflectance,
    Transmittance,
    Emissivity,
    /// A share that is absorbed.
    Absorptance,
    /// Of matter.
    Absorption,
    Scattering,
    Radiance,
    Irradiance,
    /// Of a detector, of no unit.
    Counts,
    Temperature,
    OpticalDepth,
    /// An absorption to the base of ten, or per mole.
    Decadic,
    /// n: of refraction.
    Index,
    /// k of a complex index.
    Extinction,
    /// k by itself, which may be that of an index, or an absorption.
    Kay,
    /// n squared, with an imaginary part.
    Permittivity,
    /// n of pulses.
    GroupIndex,
    /// n - 1.
    Refractivity,
    /// Of a detector, per power.
    Responsivity,
}

/// How words begin that name a quantity, in small letters. One that begins so by chance (irradiance) stands first.
const NOUNS: [(&str, Said); 20] = [
    ("irradiance", Said::Irradiance),
    ("exitance", Said::Irradiance),
    ("radiance", Said::Radiance),
    ("reflectan", Said::Reflectance),
    ("reflectiv", Said::Reflectance),
    ("albedo", Said::Reflectance),
    ("transmittan", Said::Transmittance),
    ("transmission", Said::Transmittance),
    ("transmissiv", Said::Transmittance),
    ("emissivit", Said::Emissivity),
    ("emittance", Said::Emissivity),
    ("absorptance", Said::Absorptance),
    ("absorptiv", Said::Absorptance),
    ("absorption", Said::Absorption),
    ("abscoef", Said::Absorption),
    ("scattering", Said::Scattering),
    ("decadic", Said::Decadic),
    ("molar", Said::Decadic),
    ("permittivit", Said::Permittivity),
    ("responsivit", Said::Responsivity),
];

impl Said {
    /// What the name of a column or an array says, where its nouns are of one quantity only.
    pub fn in_name(name: &str) -> Option<Said> {
        let lower = name.to_lowercase();
        let bare = lower.split(['(', '[']).next().unwrap_or("").trim().trim_end_matches('.');
        let words: Vec<&str> =
            bare.split(|c: char| !c.is_alphanumeric() && c != '*').filter(|word| !word.is_empty()).collect();
        match words[..] {
            ["counts" | "count" | "dn"] | ["raw" | "dark", "counts"] | ["digital", "number" | "numbers"] => {
                return Some(Said::Counts);
            }
            ["temperature" | "temp" | "tb"] | ["brightness" | "radiation", "temperature"] => {
                return Some(Said::Temperature);
            }
            [.., "optical", "depth" | "thickness"] => return Some(Said::OpticalDepth),
            ["alpha" | "a" | "mu" | "k", "10"] | ["alpha10" | "a10" | "eps" | "epsilon" | "ε"] => {
                return Some(Said::Decadic);
            }
            ["1", "r" | "reflectance"] if bare.contains('-') => return Some(Said::Absorptance),
            ["n", "1"] if bare.contains('-') => return Some(Said::Refractivity),
            ["group", "index"] | ["ng" | "n_g"] | ["group", "refractive", "index"] => return Some(Said::GroupIndex),
            [.., "refractive", "index"] | [.., "index", "of", "refraction"] => return Some(Said::Index),
            ["dielectric", ..] => return Some(Said::Permittivity),
            _ => {}
        }
        let noun = |word: &str| NOUNS.iter().find(|(start, _)| word.starts_with(start)).map(|(_, said)| *said);
        let mut found: Vec<Said> = words.iter().filter_map(|word| noun(word)).collect();
        if words.contains(&"brightness") && words.contains(&"temperature") {
            found.push(Said::Temperature);
        }
        // A decadic absorption is one.
        if found.contains(&Said::Decadic) {
            found.retain(|said| !matches!(said, Said::Absorption | Said::Absorptance));
        }
        found.dedup();
        match found[..] {
            [one] => Some(one),
            _ => None,
        }
    }

    pub fn noun(self) -> &'static str {
        match self {
            Said::Reflectance => "a reflectance",
            Said::Transmittance => "a transmittance",
            Said::Emissivity => "an emissivity",
            Said::Absorptance => "an absorptance",
            Said::Absorption => "an absorption",
            Said::Scattering => "a scattering coefficient",
            Said::Radiance => "a radiance",
            Said::Irradiance => "an irradiance",
            Said::Counts => "counts of a detector",
            Said::Temperature => "a temperature",
            Said::OpticalDepth => "an optical depth",
            Said::Decadic => "a decadic or molar absorption",
            Said::Index => "an index of refraction",
            Said::Extinction => "the imaginary part of an index of refraction",
            Said::Kay => "k of an index of refraction, or of an absorption",
            Said::Permittivity => "a permittivity, which is n squared",
            Said::GroupIndex => "a group index, which is no n of refraction",
            Said::Refractivity => "n - 1, and not n",
            Said::Responsivity => "a responsivity",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_what_they_are_of() {
        for (name, said) in [
            ("Reflectance (percent)", Some(Said::Reflectance)),
            ("reflectivity_oak", Some(Said::Reflectance)),
            ("Transmittance", Some(Said::Transmittance)),
            ("transmission (%)", Some(Said::Transmittance)),
            ("leaf transmittance, lower side", Some(Said::Transmittance)),
            ("emissivity", Some(Said::Emissivity)),
            ("absorptance", Some(Said::Absorptance)),
            ("1-R", Some(Said::Absorptance)),
            ("spectral irradiance", Some(Said::Irradiance)),
            ("toa_brightness_temperature", Some(Said::Temperature)),
            ("toa_bidirectional_reflectance", Some(Said::Reflectance)),
            ("DN", Some(Said::Counts)),
            ("counts", Some(Said::Counts)),
            ("decadic absorption coefficient (m-1)", Some(Said::Decadic)),
            ("molar absorptivity", Some(Said::Decadic)),
            ("alpha_10", Some(Said::Decadic)),
            ("eps (M-1cm-1)", Some(Said::Decadic)),
            ("optical depth", Some(Said::OpticalDepth)),
            ("absorption", Some(Said::Absorption)),
            ("radiance_noslit", Some(Said::Radiance)),
            ("transmitted radiance", Some(Said::Radiance)),
            ("reflectance and transmittance", None),
            ("value", None),
            ("oak", None),
            ("lamp at a temperature of 2856 K", None),
            ("raw counts of sheep", None),
            ("R", None),
            ("emission", None),
            ("300 K", None),
            ("radians", None),
            ("group index", Some(Said::GroupIndex)),
            ("n-1", Some(Said::Refractivity)),
            ("relative permittivity", Some(Said::Permittivity)),
            ("dielectric constant", Some(Said::Permittivity)),
            ("refractive index", Some(Said::Index)),
            ("responsivity (A/W)", Some(Said::Responsivity)),
            ("n", None),
            ("n-butane", None),
            ("permit", None),
        ] {
            assert_eq!(Said::in_name(name), said, "{name}");
        }
    }
}
