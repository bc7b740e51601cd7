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
    /// Of a detector, per photon.
    Efficiency,
    /// What is absorbed and scattered of what meets matter, or k.
    Attenuation,
    /// Of a scattering, what is not absorbed.
    SingleScattering,
    /// Per steradian: BRDF, Rrs.
    PerSteradian,
    /// Photons, moles of them, PAR.
    Photons,
    /// As an eye weighs it.
    Luminous,
    /// Over an axis of wavenumbers or frequencies, in a unit that is not said.
    PerWavenumber,
    /// Of a mean: its error, spread or ratio to the noise.
    Uncertainty,
    /// Of quality.
    Flags,
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
        if let Some(said) = Said::as_a_whole(name.trim(), bare, &words, lower.contains(['(', '['])) {
            return Some(said);
        }
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
            // Of two nouns side by side the last is what it is: an irradiance reflectance.
            [_, last] if matches!(words[..], [.., a, b] if noun(a).is_some() && noun(b) == Some(last)) => Some(last),
            _ => None,
        }
    }

    /// What the `words` of a name say together; `bare` is the name in small letters up to a bracket, which `has_unit` says that
    /// there is.
    fn as_a_whole(name: &str, bare: &str, words: &[&str], has_unit: bool) -> Option<Said> {
        const SPREADS: [&str; 10] = [
            "stdev",
            "stddev",
            "stderr",
            "sterr",
            "error",
            "errors",
            "uncertainty",
            "uncertainties",
            "snr",
            "variance",
        ];
        let any = |of: &[&str]| words.iter().any(|word| of.contains(word));
        let pair =
            |first: &str, second: &[&str]| words.windows(2).any(|pair| pair[0] == first && second.contains(&pair[1]));
        let (first, last) = (words.first().copied().unwrap_or(""), words.last().copied().unwrap_or(""));
        let has_noun = || words.iter().any(|word| NOUNS.iter().any(|(start, _)| word.starts_with(start)));
        let squeezed = bare.replace(' ', "");
        let is_spread = SPREADS.contains(&last)
            || SPREADS.contains(&first)
            || pair("standard", &["deviation", "error", "uncertainty"])
            || pair("std", &["dev", "deviation", "error"])
            || matches!(words, ["std" | "sd"])
            || (matches!(last, "std" | "sd" | "unc" | "err" | "sigma") && has_noun());
        let of_light = any(&["flux", "radiance", "irradiance", "exitance", "intensity"]);
        let is_flux = (any(&["photon", "photons", "quantum", "quanta"]) && of_light)
            || any(&["photosynthetic", "photosynthetically", "ppfd", "actinic"]);
        Some(match () {
            () if is_spread => Said::Uncertainty,
            () if name == "PAR" || is_flux => Said::Photons,
            () if any(&["luminance", "illuminance", "luminous"]) => Said::Luminous,
            () if matches!(squeezed.as_str(), "%t" | "t%" | "t/%") => Said::Transmittance,
            () if pair("single", &["scattering", "scatter"]) && last == "albedo" || words == ["ssa"] => {
                Said::SingleScattering
            }
            () if first == "rrs"
                || any(&["brdf", "bsdf", "btdf"])
                || pair("remote", &["sensing"]) && last == "reflectance" =>
            {
                Said::PerSteradian
            }
            () if matches!(name, "Lw" | "nLw" | "LwN") => Said::Radiance,
            () if pair("quantum", &["efficiency", "efficiencies"]) => Said::Efficiency,
            () if pair("extinction", &["coefficient", "coefficients"]) => Said::Attenuation,
            () if matches!(words, ["flag" | "flags"]) => Said::Flags,
            () if has_noun() && (last == "flag" || last == "flags") || pair("quality", &["flag", "flags"]) => {
                Said::Flags
            }
            () if has_noun() && !has_unit && any(&["per"]) && any(&["wavenumber", "frequency", "hz", "hertz"]) => {
                Said::PerWavenumber
            }
            () => return None,
        })
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
            Said::Efficiency => "a quantum efficiency",
            Said::Attenuation => "an extinction",
            Said::SingleScattering => "the albedo of a single scattering",
            Said::PerSteradian => "a reflectance per steradian",
            Said::Photons => "a number of photons",
            Said::Luminous => "a luminous quantity",
            Said::PerWavenumber => "a quantity per wavenumber or frequency",
            Said::Uncertainty => "an error or spread of values",
            Said::Flags => "flags",
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
            ("Rrs", Some(Said::PerSteradian)),
            ("Rrs_443", Some(Said::PerSteradian)),
            ("BRDF", Some(Said::PerSteradian)),
            ("remote sensing reflectance", Some(Said::PerSteradian)),
            ("photon radiance", Some(Said::Photons)),
            ("downwelling_photon_radiance_in_sea_water", Some(Said::Photons)),
            ("PAR", Some(Said::Photons)),
            ("actinic_flux", Some(Said::Photons)),
            ("luminance", Some(Said::Luminous)),
            ("%T", Some(Said::Transmittance)),
            ("single scattering albedo", Some(Said::SingleScattering)),
            ("extinction coefficient", Some(Said::Attenuation)),
            ("quantum efficiency", Some(Said::Efficiency)),
            ("irradiance reflectance", Some(Said::Reflectance)),
            ("radiance uncertainty", Some(Said::Uncertainty)),
            ("standard deviation of radiance", Some(Said::Uncertainty)),
            ("reflectance_std", Some(Said::Uncertainty)),
            ("SNR", Some(Said::Uncertainty)),
            ("toa_outgoing_radiance_per_unit_wavenumber", Some(Said::PerWavenumber)),
            ("Radiance per wavenumber (W m-2 sr-1 cm)", Some(Said::Radiance)),
            ("quality flags", Some(Said::Flags)),
            ("photon detector window, transmittance", Some(Said::Transmittance)),
            ("par", None),
            ("sd card", None),
            ("T", None),
            ("permit", None),
        ] {
            assert_eq!(Said::in_name(name), said, "{name}");
        }
    }
}
