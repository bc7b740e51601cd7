//! Spellings seen in files.

use super::*;

mod outside;

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
                "Wavelength_Angstroem",
            ],
            Unit::Wavelength(0.1),
        ),
        // A millimicron of old, which is no micrometre.
        (&["wavelength (m\u{b5})", "\u{3bb} [m\u{3bc}]", "m\u{b5}"], Unit::NANOMETRE),
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
        "wavelength (x10 nm)",
        "WL (tenths of nm)",
        "wavenumber (kcm-1)",
        "wavenumber x 100 (cm-1)",
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
        ("milliwatt / meter ** 2 / nanometer / steradian", 1e-3),
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
        // 1 W cm-2 sr-1 um-1
        ("flick", 10.0),
        ("uflick", 1e-5),
        ("\u{b5}flick", 1e-5),
        ("microflicks", 1e-5),
    ] {
        let got = per_nm(text).unwrap_or_else(|| panic!("{text} is not understood"));
        assert!((got - expected).abs() < 1e-12 * expected, "{text}: {got}, expected {expected}");
    }
    // A unit over a spectral axis names it: one of the same dimension over another axis is another quantity.
    for (text, kinds) in [
        ("W m-2 sr-1 nm-1", &[Kind::Radiance][..]),
        ("W/m3/sr", &[Kind::Radiance]),
        ("W/m2/sr/cm-1", &[Kind::Radiance]),
        ("W m-2 sr-1 cm", &[Kind::Radiance]),
        ("W m-2 sr-1 Hz-1", &[Kind::Radiance]),
        ("W/sr/nm", &[Kind::Intensity]),
        ("mW sr-1 um-1", &[Kind::Intensity]),
        ("W/sr/cm-1", &[Kind::Intensity]),
        ("W/(sr Hz)", &[Kind::Intensity]),
        ("W m-2 nm-1", &[Kind::Irradiance]),
        ("erg/s/cm2/A", &[Kind::Irradiance]),
        ("W/m2/(cm-1)", &[Kind::Irradiance]),
        ("Jy", &[Kind::Irradiance]),
        ("W/nm", &[]),
        ("mW nm-1", &[]),
        ("W/m2*nm", &[]),
        ("W/cm-1", &[]),
        ("W", &[]),
    ] {
        let measure = parse(text).unwrap_or_else(|| panic!("{text} is not understood"));
        let is_of = |kind: &Kind| measure.to(*kind).is_some();
        let found: Vec<Kind> = [Kind::Radiance, Kind::Irradiance, Kind::Intensity].into_iter().filter(is_of).collect();
        assert_eq!(found, kinds, "{text}");
    }
    for text in ["W m-2 sr-1", "W m-2", "K", "photons s-1 m-2 sr-1 nm-1", "Reflectance", "DN", "", "W/m2/sr/foo", "lm"]
    {
        assert_eq!(per_nm(text), None, "{text}");
    }
    let absorption = |text: &str| parse(text).and_then(|measure| measure.to(Kind::Absorption));
    assert_eq!(absorption("cm-1"), Some(Density::Plain(100.0)));
    assert_eq!(absorption("cm-1 atm-1"), Some(Density::Plain(100.0)));
    assert_eq!(absorption("1/km"), Some(Density::Plain(1e-3)));
    assert_eq!(absorption("cm2/molecule"), None);
    for (text, factor) in [
        ("1/inch", 1.0 / 0.0254),
        ("1/ft", 1.0 / 0.3048),
        ("%/cm", 1.0),
        ("kPa-1 cm-1", 100.0 * 101.325),
        ("Torr-1 cm-1", 100.0 * 760.0),
        ("cm-1/Torr", 100.0 * 760.0),
        // Of 1 atm a share of 1e-6 is a ppm.
        ("ppm-1 m-1", 1e6),
    ] {
        let Some(Density::Plain(found)) = absorption(text) else { panic!("{text}: {:?}", absorption(text)) };
        assert!((found / factor - 1.0).abs() < 1e-12, "{text}: {found}, expected {factor}");
    }
    for (text, factor) in [("per mille", 1e-3), ("\u{2030}", 1e-3), ("ppm", 1e-6), ("perc.", 0.01), ("per cent", 0.01)]
    {
        let found = parse(text).and_then(|measure| measure.to(Kind::Number));
        assert_eq!(found, Some(Density::Plain(factor)), "{text}");
    }
}

#[test]
fn units_in_names_of_columns() {
    for (name, kind, factor) in [
        ("Reflectance (%)", Kind::Number, 0.01),
        ("Reflectance %", Kind::Number, 0.01),
        ("%R", Kind::Number, 0.01),
        ("% Transmittance", Kind::Number, 0.01),
        ("percent", Kind::Number, 0.01),
        ("Percent Reflectance", Kind::Number, 0.01),
        ("reflectance_percent", Kind::Number, 0.01),
        ("R pct.", Kind::Number, 0.01),
        ("PercentReflectance", Kind::Number, 0.01),
        ("ReflectancePercent", Kind::Number, 0.01),
        ("reflectance (per mille)", Kind::Number, 1e-3),
        ("radiance (flick)", Kind::Radiance, 10.0),
        ("300 (kPa-1 m-1)", Kind::Absorption, 101.325),
        ("Radiance [uW/cm2/sr/nm]", Kind::Radiance, 0.01),
        ("radiance W/m2/sr/um", Kind::Radiance, 1e-3),
        // 1e-7 W, 1e4 cm2 a m2, 10 A a nm.
        ("flux [erg/s/cm2/A]", Kind::Irradiance, 1e-2),
        ("W/m2/nm/sr", Kind::Radiance, 1.0),
        ("L (10^-3 W m-2 sr-1 nm-1)", Kind::Radiance, 1e-3),
    ] {
        let Some(Stated { meaning: Meaning::Unit(measure), certain: true, .. }) = Stated::in_name(name) else {
            panic!("{name}: {:?}", Stated::in_name(name));
        };
        assert_eq!(measure.to(kind), Some(Density::Plain(factor)), "{name}");
    }
    let jansky = parse("Jy").and_then(|measure| measure.to(Kind::Irradiance)).expect("an irradiance");
    // At 500 nm c/λ² is 1.199169832e21 Hz a metre: 1e-26 W m-2 Hz-1 are 1.199169832e-14 W m-2 nm-1.
    assert!((jansky.apply(1.0, 500.0) / 1.199_169_832e-14 - 1.0).abs() < 1e-12);
    let photons = Stated::in_name("photons/s/m2/nm/sr").expect("a unit");
    assert!(matches!(photons.meaning, Meaning::Unit(measure) if measure.to(Kind::Radiance).is_none()));
    for name in [
        "Sample #1",
        "leaf (upper side)",
        "leaf 1 (upper side)",
        "oak (2/3)",
        "log, oak",
        "oak (log)",
        "max x",
        "linen",
        "x2",
        "r2",
        "reflectance (no unit)",
        "reflectance (0-1)",
        "radiance (direct)",
        "absorption",
        "Abs. coefficient",
        "absolute",
        "OD 2 filter",
        "2x zoom",
        "300 K",
        "4x4 panel",
        "period",
        "k",
        "reflectance of bog oak",
    ] {
        assert_eq!(Stated::in_name(name), None, "{name}");
    }
    for name in ["Abs (cm-1)", "Abs (%)"] {
        assert!(matches!(Stated::in_name(name).map(|stated| stated.meaning), Some(Meaning::Unit(_))), "{name}");
    }
    for (name, meaning) in [
        ("log10 radiance", Meaning::Logarithm),
        ("log(1/R)", Meaning::Logarithm),
        ("transmittance (dB)", Meaning::Logarithm),
        ("log_trans", Meaning::Logarithm),
        ("OD", Meaning::Logarithm),
        ("od", Meaning::Logarithm),
        ("filter OD", Meaning::Logarithm),
        ("optical density", Meaning::Logarithm),
        ("Optical Density (a.u.)", Meaning::Logarithm),
        ("Abs", Meaning::Logarithm),
        ("Abs.", Meaning::Logarithm),
        ("Abs (AU)", Meaning::Logarithm),
        ("-log R", Meaning::Logarithm),
        ("-log(R)", Meaning::Logarithm),
        ("log R", Meaning::Logarithm),
        ("log 1/R", Meaning::Logarithm),
        ("reflectance, log", Meaning::Logarithm),
        ("Reflectance (log)", Meaning::Logarithm),
        ("K/S", Meaning::Logarithm),
        ("F(R)", Meaning::Logarithm),
        ("radiance (bananas)", Meaning::Unknown),
        ("reflectance (0-255)", Meaning::Unknown),
        ("300 (cm-1 bananas)", Meaning::Unknown),
        ("300 K (bananas)", Meaning::Unknown),
        ("kappa_300K (bananas)", Meaning::Unknown),
        ("sample (cm-1 bananas)", Meaning::Unknown),
        ("clay with water 10 %", Meaning::Unknown),
        ("clay 10 percent", Meaning::Unknown),
        ("radiance (W/m2/sr/furlong)", Meaning::Unknown),
        ("radiance (a.u.)", Meaning::Unknown),
        ("Relative intensity", Meaning::Unknown),
        ("normalized radiance", Meaning::Unknown),
        ("Relative SPD", Meaning::Unknown),
        ("QE, relative", Meaning::Unknown),
        ("rel. units", Meaning::Unknown),
        ("Power (dBm)", Meaning::Logarithm),
        ("L_mW_furlong_nm", Meaning::Unknown),
        ("reflectance x 10000", Meaning::Factor),
        ("R (x1e4)", Meaning::Factor),
        ("R*100", Meaning::Factor),
        ("R (1e-4)", Meaning::Factor),
        ("reflectance [1/10000]", Meaning::Factor),
        ("reflectance (scaled by 10000)", Meaning::Factor),
        ("radiance (W/m2/sr/um) x 10", Meaning::Factor),
        ("100*R", Meaning::Factor),
        ("10^4 rho", Meaning::Factor),
        ("1e4 R", Meaning::Factor),
        ("10000 x reflectance", Meaning::Factor),
        ("K-M", Meaning::Logarithm),
        ("density", Meaning::Logarithm),
        ("log energy L", Meaning::Logarithm),
    ] {
        assert_eq!(Stated::in_name(name).map(|stated| stated.meaning), Some(meaning), "{name}");
    }
    assert_eq!(Stated::in_name("wall, W").map(|stated| stated.certain), Some(false));
}

#[test]
fn units_in_sentences() {
    for (text, irradiance) in [
        ("# wavelength [nm]   irradiance [mW/(m2 nm)]", Some(1e-3)),
        ("# Second column: extraterrestrial irradiance in mW m-2 nm-1, at 1 AU.", Some(1e-3)),
        ("# 2. irradiance (W/m2/um)", Some(1e-3)),
        ("# nm W/m^2/nm", Some(1.0)),
        ("# scaled to a total of 1366.1 W/m2", None),
        ("# Kurucz, R. L., at 1.0 nm; W. M. Sr.", None),
        ("# reflectance of oak in 2 nm steps", None),
    ] {
        let found = Stated::in_sentence(text).map(|stated| match stated.meaning {
            Meaning::Unit(measure) => measure.to(Kind::Irradiance),
            other => panic!("{other:?}"),
        });
        assert_eq!(found, irradiance.map(|factor| Some(Density::Plain(factor))), "{text}");
    }
}

#[test]
fn percent_in_sentences_and_axes_by_their_names() {
    for text in [
        "# Column 2: reflectance (percent)",
        "# Reflectance in percent",
        "# reflectance, in %",
        "# unit = %",
        "Units: percent",
        "# values are percent",
        "# transmittance [%]",
        "# reflectance: %",
        "# % reflectance",
        "# percent",
        "# in %",
        "values are in percent",
        "# all values are given in percent",
    ] {
        assert!(speaks_of_percent(text), "{text}");
    }
    for text in [
        "# reflectance of a 5 percent mixture",
        "# reflectance is 5 percent lower in summer",
        "# uncertainty of reflectance 1 %",
        "# 50 % humidity",
        "# X units: percent",
        "# humidity in percent",
        "% reflectance of oak",
    ] {
        assert!(!speaks_of_percent(text), "{text}");
    }
    for name in
        ["Wavelength", "wavelength (um)", "Wavenumber (cm-1)", "wl_nm", "nm", "b nm", "\u{3bb} [nm]", "Frequency"]
    {
        assert!(is_axis(name), "{name}");
    }
    for name in
        ["B1", "B4 (665 nm)", "665 nm", "radiance (W/m2/sr/nm)", "Response", "uncertainty", "band 550", "R (%)", ""]
    {
        assert!(!is_axis(name), "{name}");
    }
}

/// At 273.15 K and 1 atm a cubic metre of an ideal gas has Loschmidt's number of molecules, 2.686 780 111e25 (CODATA 2018).
#[test]
fn cross_sections_are_absorptions_at_a_temperature() {
    let per_atm = |text: &str| parse(text).and_then(|measure| measure.cross_section_per_atmosphere(273.15));
    // A cubic metre of an amagat has as many; a megabarn is 1e-18 cm2.
    for (text, expected) in [
        ("cm2/molecule", 2.686_780_111e21),
        ("cm^2 molecule^-1", 2.686_780_111e21),
        ("cm2", 2.686_780_111e21),
        ("Mb", 2.686_780_111e3),
        ("cm-1 amagat-1", 100.0),
    ] {
        let found = per_atm(text).unwrap_or_else(|| panic!("{text} is a cross section"));
        assert!((found / expected - 1.0).abs() < 1e-9, "{text}: {found}");
    }
    assert_eq!([per_atm("cm-1"), per_atm("cm2/g"), per_atm("K")], [None; 3]);
}

/// Lines whose wavelengths in air and in vacuum NIST's Atomic Spectra Database gives: Na D2, H alpha, Hg.
#[test]
fn air_becomes_vacuum() {
    for (air, vacuum) in [(588.995_095, 589.158_326), (656.279, 656.460_3), (404.6565, 404.7708)] {
        assert!((vacuum_nm(air) - vacuum).abs() < 2e-4, "{air}: {}", vacuum_nm(air));
    }
    assert_eq!(vacuum_nm(150.0), 150.0);
    // Its index is what they differ by.
    assert!((air_index(vacuum_nm(588.995_095)) * 588.995_095 - vacuum_nm(588.995_095)).abs() < 1e-9);
    assert_eq!(air_index(150.0), 1.0);
    assert!(is_in_air("wavelength in air (nm)") && is_in_air("wl_air_nm") && !is_in_air("wavelength, dairy"));
}

#[test]
fn sentences_about_factors_and_air() {
    for text in [
        "# scale factor: 0.001",
        "# multiply by 1e-3 to get radiance",
        "# values x 1000",
        "# Reflectance * 10000",
        "# Divide by 100.",
        "# gain = 2",
        "# offset: -0.5",
        "# all values were multiplied by 10^4",
        "# multiply radiance by 1000",
        "# values in units of 10^-3",
        "# *1e-3",
        "# multiplied with pi",
    ] {
        assert!(states_a_factor(text), "{text}");
    }
    for text in [
        "# scale factor: 1",
        "# offset = 0",
        "# a scale model of 1 m",
        "# reflectance of oak, 3 scans",
        "# multiplier: none",
        "# 2 x 3 samples",
        "# divided into two",
        "# King factor included; phase = 0.0279",
        "# scaled to a luminance of 1000 cd m-2",
        "# gain: auto",
        "# made in 2020",
    ] {
        assert!(!states_a_factor(text), "{text}");
    }
    for (text, expected) in [
        ("# wavelengths in air", true),
        ("# Wavelength (air), radiance", true),
        ("# air wavelengths, nm", true),
        ("# wavelengths in standard air", true),
        ("# wavelengths in vacuum, converted from those in air", false),
        ("# dried in air", false),
        ("# wavelengths of air-dried soil, in air-tight boxes", false),
    ] {
        assert_eq!(speaks_of_air(text), expected, "{text}");
    }
}

#[test]
fn axes_from_which_no_wavelength_follows() {
    for name in [
        "Raman shift (cm-1)",
        "Raman Shift / cm-1",
        "Wavenumber shift (cm-1)",
        "energy loss (eV)",
        "binding energy (eV)",
        "linewidth (cm-1)",
        "Absorption (cm-1)",
        "spatial frequency (1/cm)",
        "thickness (nm)",
        "particle diameter (um)",
        "bandwidth (nm)",
        "FWHM (nm)",
        "wavelength shift (nm)",
        "retardation (nm)",
        "OPD (nm)",
        "pixel",
        "Band",
        "2theta",
        "WN",
        "wvn",
        "Frequenz",
        "fr\u{e9}quence",
        "\u{5468}\u{6ce2}\u{6570}",
        "\u{447}\u{430}\u{441}\u{442}\u{43e}\u{442}\u{430}",
        "Wavelength (\u{81})",
    ] {
        assert!(Unit::stated(name).is_err(), "{name}: {:?}", Unit::stated(name));
    }
    for name in [
        "nombre d'onde",
        "nombre d\u{2019}onde",
        "n\u{fa}mero de onda",
        "numero d'onda",
        "Golfgetal",
        "Wellenzahl",
        "\u{6ce2}\u{6570}",
        "Wavenumbers",
        "wave number",
    ] {
        assert_eq!(Unit::stated(name), Ok(Some(Unit::WAVENUMBER)), "{name}");
    }
    for name in [
        "Wavelength",
        "Wavelength position (nm)",
        "Emission wavelength (nm)",
        "nm",
        "Wavelength of pixel",
        "Wave length (nm)",
        "Longueur d'onde (nm)",
        "Band center (nm)",
        "wl",
        "x",
        "\u{6ce2}\u{9577}",
    ] {
        let unit = Unit::from_header(name);
        assert_eq!(unit, Ok(Unit::NANOMETRE), "{name}");
    }
}

/// What names say was done to values, and names that only look so.
#[test]
fn what_was_done_to_values_is_seen_in_their_names() {
    for (name, meaning) in [
        ("pi*R", Some(Meaning::Factor)),
        ("R*pi", Some(Meaning::Factor)),
        ("reflectance/pi", Some(Meaning::Factor)),
        ("rho / \u{3c0}", Some(Meaning::Factor)),
        ("R/2", Some(Meaning::Factor)),
        ("R+0.5", Some(Meaning::Factor)),
        ("R (offset for clarity)", Some(Meaning::Factor)),
        ("R, offset", Some(Meaning::Factor)),
        ("1/R", Some(Meaning::Logarithm)),
        ("R^2", Some(Meaning::Logarithm)),
        ("R\u{b2}", Some(Meaning::Logarithm)),
        ("1st derivative", Some(Meaning::Logarithm)),
        ("reflectance, continuum removed", Some(Meaning::Logarithm)),
        ("R [10log]", Some(Meaning::Logarithm)),
        ("Sample 1 (Abs)", Some(Meaning::Logarithm)),
        ("R (rel.)", Some(Meaning::Unknown)),
        ("R (bp)", Some(Meaning::Unknown)),
        ("pine/bark", None),
        ("spinach/2", None),
        ("pi-meson", None),
        ("R-1", None),
        ("R2", None),
        ("2R", None),
        ("1/2 oak", None),
        ("R", None),
        ("value", None),
        ("n-butane", None),
        ("Reflectance (abs.)", None),
        ("soil (% clay)", None),
        ("soil (5 % clay)", None),
        ("catalog", None),
    ] {
        let found = Stated::in_name(name).map(|stated| stated.meaning);
        let is_plain = name.starts_with("Reflectance (abs") && found == Some(Meaning::Unknown);
        assert!(found == meaning || is_plain, "{name}: {found:?}");
    }
    for name in ["Sample 1 (%R)", "Sample 1 (% Refl)", "Sample 1 (R%)", "Sample 1 %T"] {
        assert!(Stated::in_name(name).is_some_and(|stated| stated.is_percent()), "{name}");
    }
}

/// Shares in words and signs, what an eye sees, and what is relative only in part.
#[test]
fn shares_and_lumens_in_names() {
    let factor = |name: &str| match Stated::in_name(name).map(|stated| stated.meaning) {
        Some(Meaning::Unit(measure)) if measure.is_number() => Some(measure.factor),
        _ => None,
    };
    for (name, expected) in [("Reflectance (in %)", 0.01), ("R [in percent]", 0.01), ("Reflectance \u{2030}", 1e-3)] {
        assert_eq!(factor(name), Some(expected), "{name}");
    }
    for name in ["lm/nm", "cd/m2", "lux"] {
        let stated = Stated::in_name(name);
        assert!(matches!(stated, Some(Stated { meaning: Meaning::Unit(_), .. })), "{name}: {stated:?}");
    }
    for name in ["relative humidity", "normal", "Reflectance relative_azimuth 30", "lm", "oak, rel"] {
        assert_eq!(Stated::in_name(name), None, "{name}");
    }
}
