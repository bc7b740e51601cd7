//! Spellings seen in files.

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
    for text in ["W m-2 sr-1", "W m-2", "K", "photons s-1 m-2 sr-1 nm-1", "Reflectance", "DN", "", "W/m2/sr/foo", "lm"]
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
        ("%R", Kind::Number, 0.01),
        ("% Transmittance", Kind::Number, 0.01),
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

/// At 273.15 K and 1 atm a cubic metre of an ideal gas has Loschmidt's number of molecules, 2.686 780 111e25 (CODATA 2018).
#[test]
fn cross_sections_are_absorptions_at_a_temperature() {
    let per_atm = |text: &str| parse(text).and_then(|measure| measure.cross_section_per_atmosphere(273.15));
    for text in ["cm2/molecule", "cm^2 molecule^-1", "cm2"] {
        let found = per_atm(text).unwrap_or_else(|| panic!("{text} is a cross section"));
        assert!((found / 2.686_780_111e21 - 1.0).abs() < 1e-9, "{text}: {found}");
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
    assert!(is_in_air("wavelength in air (nm)") && is_in_air("wl_air_nm") && !is_in_air("wavelength, dairy"));
}
