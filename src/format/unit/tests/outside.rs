//! Units and percent outside of brackets, and names of axes in common words.

use crate::format::unit::{Density, Kind, Meaning, Stated, Unit, is_axis, is_in_air, speaks_of_percent};

fn factor(name: &str, kind: Kind) -> Option<Density> {
    match Stated::in_name(name)?.meaning {
        Meaning::Unit(measure) => measure.to(kind),
        _ => None,
    }
}

#[test]
fn units_behind_a_slash_or_as_last_words() {
    for (name, per_metre) in [
        ("alpha / cm^-1", 100.0),
        ("\u{3b1} / cm\u{207b}\u{b9}", 100.0),
        ("alpha/cm-1", 100.0),
        ("alpha_cm-1", 100.0),
        ("alpha cm-1", 100.0),
        ("alpha_cm_1", 100.0),
        ("alpha in 1/cm", 100.0),
        ("absorption 1/cm", 100.0),
        ("Absorption coefficient 1/cm", 100.0),
        ("absorption cm^-1", 100.0),
        ("alpha_per_cm", 100.0),
        ("alpha_inv_cm", 100.0),
        ("mu_a_mm-1", 1e3),
        ("k_1/km", 1e-3),
        ("absorption coefficient / mm-1", 1e3),
        ("alpha, cm-1", 100.0),
        ("alpha (T = 300 K) / cm-1", 100.0),
    ] {
        assert_eq!(factor(name, Kind::Absorption), Some(Density::Plain(per_metre)), "{name}");
    }
    for (name, own) in [
        ("irradiance_mW_m2_nm", 1e-3),
        ("mW/m2/nm", 1e-3),
        ("mW/m2/nm irradiance", 1e-3),
        ("E/(mW m^-2 nm^-1)", 1e-3),
        ("uW/cm2/nm", 1e-2),
        ("E / mW m-2 nm-1", 1e-3),
        ("E.mW.m2.nm", 1e-3),
        ("irradiance..mW.m.2.nm.1.", 1e-3),
        ("irradiance_W_m-2_um-1", 1e-3),
    ] {
        assert_eq!(factor(name, Kind::Irradiance), Some(Density::Plain(own)), "{name}");
    }
    assert_eq!(factor("Radiance (W/m2-sr-um)", Kind::Radiance), Some(Density::Plain(1e-3)));
    assert_eq!(factor("RADIANCE (WATTS/CM2-STER-MICRON)", Kind::Radiance), Some(Density::Plain(10.0)));
    // Of another quantity, or of which it is not plain that it is a unit: refused where it is used.
    for name in ["irradiance mW", "L_mW", "T/K", "alpha/cm"] {
        let stated = Stated::in_name(name).unwrap_or_else(|| panic!("{name}"));
        assert!(
            matches!(stated.meaning, Meaning::Unit(measure) if [Kind::Irradiance, Kind::Number, Kind::Absorption].iter().all(|kind| measure.to(*kind).is_none()))
        );
    }
    for name in [
        "alpha_cm",
        "mu_a_cm",
        "absorption mm",
        "Reflectance....",
        "R...",
        "X..Reflectance",
        "reflectance_scaled_10000",
    ] {
        assert_eq!(Stated::in_name(name).map(|stated| stated.meaning), Some(Meaning::Factor), "{name}");
    }
    for name in [
        "pine/bark",
        "oak 5 m",
        "leaf_mm",
        "kappa_300K",
        "absorption 300 K",
        "band 950 cm-1",
        "R/T",
        "oak.leaf",
        "X300",
        "V1",
        "n/k",
        "sample_1",
        "B4_665nm",
        "west W",
        "soil.A",
        "absorption",
    ] {
        assert_eq!(Stated::in_name(name), None, "{name}");
    }
}

#[test]
fn percent_in_every_place() {
    for name in [
        "\u{53cd}\u{5c04}\u{7387}\u{ff08}%\u{ff09}",
        "\u{53cd}\u{5c04}\u{7387}\u{ff08}\u{ff05}\u{ff09}",
        "R(\u{3bb}) / %",
        "%R (SCI)",
        "% Reflectance (SCI)",
        "total reflectance % (SCI)",
        "R% Sample",
        "Reflectance percent (mean)",
        "refl_percent_mean",
        "Refl. in Prozent",
        "Reflectance (percentage)",
        "reflectance percentage",
        "percentage reflectance",
        "Reflectance (0-100)",
        "reflectance 0 to 100",
        "Reflectance [0..100]",
        "Reflectance (0\u{2013}100 %)",
    ] {
        assert!(Stated::in_name(name).is_some_and(|stated| stated.is_percent()), "{name}");
    }
    for name in ["clay% in oak", "oak (5 % moss)", "depth 0 to 10", "oak 50 percent shade"] {
        assert!(!Stated::in_name(name).is_some_and(|stated| stated.is_percent()), "{name}");
    }
    for text in [
        "# Y Units: Reflectance (percent)",
        "# Units: % reflectance",
        "# nm, %",
        "# wavelength: nm, reflectance: %",
        "# Y axis: % reflectance",
        "# col 2 - %R",
        "# YUNITS= %R",
        "# Reflectance given as percentage",
        "# percentage",
        "# scale: 0-100",
    ] {
        assert!(speaks_of_percent(text), "{text}");
    }
    for text in ["# humidity: 40 %", "# oak, 40 % moss", "# depth: 0-100", "# 0.5 % accuracy", "# nm, oak 5 %"] {
        assert!(!speaks_of_percent(text), "{text}");
    }
}

#[test]
fn axes_in_common_words() {
    for name in [
        "Wavenumber 1/cm",
        "wavenumbers 1/cm",
        "nu 1/cm",
        "wavenumber_1/cm",
        "/cm",
        "cm\u{af}\u{b9}",
        "cm.-1",
        "cm_inv",
        "cm1",
        "cmm1",
        "inv_cm",
        "invcm",
        "recip_cm",
        "Wavenumber (1/cm)",
        "XAXIS (cm-1)",
        "cm^(\u{2212}1)",
        "nu..cm.1.",
    ] {
        assert_eq!(Unit::stated(name), Ok(Some(Unit::WAVENUMBER)), "{name}");
    }
    for name in [
        "wavelength.um",
        "Wavelength..um.",
        "Wavelength..\u{b5}m.",
        "wl.um",
        "wl-um",
        "Wavelength \u{339b}",
        "\u{6ce2}\u{957f}\u{ff08}um\u{ff09}",
    ] {
        assert_eq!(Unit::stated(name), Ok(Some(Unit::MICROMETRE)), "{name}");
    }
    for name in ["wl_aa", "wavelength.A", "Wavelength..A.", "wave.angstrom"] {
        assert_eq!(Unit::stated(name), Ok(Some(Unit::Wavelength(0.1))), "{name}");
    }
    for name in [
        "E",
        "f",
        "Freq.",
        "\u{3bd}\u{303}",
        "nu_tilde",
        "wavn",
        "Position",
        "Step",
        "No.",
        "Number",
        "id",
        "Age",
        "Mass",
        "1/lambda",
        "Wavelength error (nm)",
        "wavelength uncertainty (nm)",
        "\u{394}\u{3bb} (nm)",
        "Log wavelength",
        "lambda^2",
        "sqrt(nm)",
        "m/z",
        "Wavenumber (nm)",
        "wavenum_cm",
    ] {
        assert!(Unit::stated(name).is_err(), "{name}: {:?}", Unit::stated(name));
    }
    for name in [
        "wl",
        "WL",
        "wvl",
        "lambda",
        "\u{3bb}",
        "wl2",
        "wl.1",
        "lambda_2",
        "B2 wavelength",
        "Wellenl\u{e4}nge",
        "longueur d'onde (nm)",
        "\u{6ce2}\u{9577}",
    ] {
        assert!(is_axis(name), "{name}");
    }
    for name in ["B1", "oak", "R at 550 nm", "lambda 665", "x", "flow", "waveform"] {
        assert!(!is_axis(name), "{name}");
    }
    for name in [
        "AWAV",
        "awav (nm)",
        "Wellenl\u{e4}nge in Luft (nm)",
        "longueur d'onde, air (nm)",
        "lunghezza d'onda in aria (nm)",
    ] {
        assert!(is_in_air(name), "{name}");
    }
}
