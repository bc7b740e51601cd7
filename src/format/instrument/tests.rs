use super::*;

fn read(name: &str, text: &str, column: Option<&str>) -> Read<SpectrumTable> {
    let path = Path::new(name);
    let format = Format::of(path, text.as_bytes()).unwrap_or_else(|| panic!("{name} is not known"));
    format.read(text.as_bytes(), path, column.into())
}

const SPDX: &str = "<?xml version=\"1.0\"?>\n<IESTM2714 xmlns=\"http://www.ies.org/iestm2714\" version=\"1.0\">\n<Header>\n\
    <Manufacturer>made up</Manufacturer></Header>\n<SpectralDistribution>\n<SpectralQuantity>irradiance</SpectralQuantity>\n\
    <SpectralData wavelength=\"400\">0.5</SpectralData>\n<SpectralData wavelength=\"405.5\">0.75</SpectralData>\n\
    </SpectralDistribution>\n</IESTM2714>\n";
const CAMERA: &str = r#"{"header": {"manufacturer": "made up"}, "spectral_data": {"units": "relative",
    "index": {"main": ["R", "G", "B"]}, "data": {"main": {"400": [0.1, 0.2, 0.3], "380": [0.0, 0.1, 0.2], "1000": [1, 2, 3]}}}}"#;
const RADIS: &str = r#"{"arrays": {"wavespace": [2000.0, 2500.0], "radiance_noslit": [1.0, 2.0], "abscoeff": [3.0, 4.0]},
    "units": {"radiance_noslit": "mW/cm2/sr/cm-1", "abscoeff": "cm-1"}, "conditions": {"waveunit": "cm-1"}}"#;
const SIG: &str = "/*** Spectra Vista SIG Data ***/\nname= made up\nunits= Radiance, Radiance\ndata=\n\
    350.0  2000.0  1000.0  50.00\n400.0  3000.0  600.0  20.00\n";
const SED: &str = "Comment:\nVersion: 2.3\nUnits: W/m^2/sr/nm\nChannels: 2\nColumns [4]:\nData:\n\
    Wvl\tRad. (Ref.)\tRad. (Target)\tReflect. %\n350\t0.5\t0.25\t50.0\n351\t0.5\t0.10\t20.0\n";

#[test]
fn each_is_read_with_its_units() {
    let lamp = read("lamp.spdx", SPDX, None).unwrap();
    let density = |table: &SpectrumTable, kind| match table.unit.as_ref()?.meaning {
        unit::Meaning::Unit(measure) => measure.to(kind),
        _ => None,
    };
    assert_eq!(density(&lamp, unit::Kind::Irradiance), Some(unit::Density::Plain(1.0)));
    assert_eq!((lamp.nm, lamp.value, lamp.line), (vec![400.0, 405.5], vec![0.5, 0.75], vec![7, 8]));
    let green = read("camera.json", CAMERA, Some("g")).unwrap();
    assert_eq!((green.nm, green.value), (vec![380.0, 400.0, 1000.0], vec![0.1, 0.2, 2.0]));
    let gas = read("co2.spec", RADIS, Some("abscoeff")).unwrap();
    assert_eq!(density(&gas, unit::Kind::Absorption), Some(unit::Density::Plain(100.0)));
    assert_eq!((gas.nm, gas.value), (vec![4000.0, 5000.0], vec![4.0, 3.0]));
    let radiance = read("co2.spec", RADIS, Some("radiance_noslit")).unwrap();
    // 1 mW cm-2 sr-1 / cm-1 at 2000 cm-1: 10 W m-2 sr-1 / cm-1, and 1e7/5000² = 0.4 cm-1 a nm.
    let per_nm = density(&radiance, unit::Kind::Radiance).unwrap().apply(1.0, 5000.0);
    assert!((per_nm - 4.0).abs() < 1e-12, "{per_nm}");
    let leaf = read("leaf.sig", SIG, None).unwrap();
    assert_eq!((leaf.nm, leaf.value, leaf.line), (vec![350.0, 400.0], vec![0.5, 0.2], vec![5, 6]));
    // 1000 x 1e-10 W cm-2 = 1e-3 W m-2.
    assert!((read("leaf.sig", SIG, Some("target")).unwrap().value[0] - 1e-3).abs() < 1e-18);
    let leaf = read("leaf.sed", SED, None).unwrap();
    assert_eq!(density(&leaf, unit::Kind::Number), Some(unit::Density::Plain(0.01)));
    assert_eq!((leaf.nm, leaf.value), (vec![350.0, 351.0], vec![50.0, 20.0]));
    assert_eq!(read("leaf.sed", SED, Some("Rad. (Target)")).unwrap().value, [0.25, 0.1]);
    let text = "GOES-99 ABI channel 13\nmade up\n  wavenumber  response\n 950.0  0.5\n 1000.0 1.0\n";
    let band = read("rtcoef_goes_99_abi_srf_ch13.txt", text, None).unwrap();
    assert!((band.nm[1] - 1e7 / 950.0).abs() < 1e-9 && band.value == [1.0, 0.5], "{band:?}");
}

#[test]
fn each_says_what_it_is_of() {
    let said =
        |name: &str, text: &str, column: Option<&str>| read(name, text, column).unwrap().said.map(|(said, _)| said);
    assert_eq!(said("lamp.spdx", SPDX, None), Some(Said::Irradiance));
    for (quantity, expected) in [
        ("transmittance", Some(Said::Transmittance)),
        ("T-Factor", Some(Said::Transmittance)),
        ("R-Factor", Some(Said::Reflectance)),
        ("absorptance", Some(Said::Absorptance)),
        ("relative", None),
    ] {
        assert_eq!(said("lamp.spdx", &SPDX.replace("irradiance", quantity), None), expected, "{quantity}");
    }
    assert!(
        read("lamp.spdx", &SPDX.replace("irradiance", "absorbance"), None).unwrap_err().message.contains("logarithm")
    );
    // A flux is no irradiance, though W nm-1 has the dimension of one over wavenumber.
    for quantity in ["flux", "intensity"] {
        let unit = read("lamp.spdx", &SPDX.replace("irradiance", quantity), None).unwrap().unit.expect("a unit");
        let unit::Meaning::Unit(measure) = unit.meaning else { panic!("{unit:?}") };
        assert_eq!(
            [unit::Kind::Irradiance, unit::Kind::Radiance].map(|kind| measure.to(kind)),
            [None; 2],
            "{quantity}"
        );
    }
    assert_eq!(said("leaf.sig", SIG, None), Some(Said::Reflectance));
    assert_eq!(said("leaf.sig", SIG, Some("target")), Some(Said::Radiance));
    let irradiance = SIG.replace("Radiance, Radiance", "Irradiance, Irradiance");
    assert!(read("leaf.sig", &irradiance, Some("target")).unwrap_err().message.contains("no radiance"));
    assert_eq!(said("leaf.sed", SED, Some("Rad. (Target)")), Some(Said::Radiance));
    assert_eq!(said("leaf.sed", &SED.replace("Reflect. %", "Transmit. %"), None), Some(Said::Transmittance));
    assert_eq!(said("co2.spec", RADIS, Some("radiance_noslit")), Some(Said::Radiance));
    let um = CAMERA.replace("\"units\": \"relative\"", "\"units\": \"relative\", \"wavelength_units\": \"um\"");
    assert!(read("camera.json", &um, Some("R")).unwrap_err().message.contains("`um`"));
}

#[test]
fn air_is_converted_where_a_file_says_so() {
    let text = RADIS.replace("\"cm-1\"}}", "\"nm\"}}").replace("[2000.0, 2500.0]", "[500.0, 589.0]");
    let air = read("a.spec", &text, Some("abscoeff")).unwrap();
    // n - 1 of standard air at 589 nm is 2.7643e-4 (Ciddor 1996, table 1 gives 1.000276… for dry air at 15 °C).
    assert!((air.nm[1] / 589.0 - 1.0 - 2.77e-4).abs() < 1e-6, "{:?}", air.nm);
    let vacuum = text.replace("\"nm\"}}", "\"nm_vac\"}}");
    assert_eq!(read("a.spec", &vacuum, Some("abscoeff")).unwrap().nm, [500.0, 589.0]);
}

#[test]
fn what_is_not_read_is_named() {
    let par = format!("{:<160}\n", " 21  667.380000 1.0E-19 2.0E+00");
    let xsc = format!(
        "{:>20}{:10.4}{:10.4}{:7}{:7.2}{:6.2} 2.000E-17  .03{:>15}     air  8\n{}\n",
        "CCl4", 700.0, 724.0, 4, 208.1, 7.51, "carbon tetra", " 1.000E-18 2.000E-18 3.000E-18 4.000E-18"
    );
    for (name, bytes, words) in [
        ("a.nc", &b"\x89HDF\r\n"[..], "netCDF-4"),
        ("a.xlsx", b"PK\x03\x04", "spreadsheet"),
        ("a.csv", b"\x1f\x8b\x08", "gzip"),
        ("02_hit.par", par.as_bytes(), "lines of HITRAN"),
        ("H2O.data", par.replace('\n', ",0.5\n").as_bytes(), "lines of HITRAN"),
        ("H2O.header", b"{\"table_name\": \"H2O\", \"order\": [\"nu\"]}", "lines of HAPI"),
        ("CCl4_208.0K.xsc", xsc.as_bytes(), "HITRAN's cross sections"),
        ("leaf.jdx", b"##TITLE= leaf\n##JCAMP-DX= 4.24\n##YFACTOR= 0.1\n##XYPOINTS= (XY..XY)\n400, 1\n", "JCAMP-DX"),
        ("abi_g16.SpcCoeff.nc", b"\x89HDF", "coefficients of CRTM"),
        ("abi_g16.SpcCoeff.bin", b"\0\0", "coefficients of CRTM"),
        ("rtcoef_goes_16_abi.dat", b" ! RTTOV coefficient file", "coefficients of RTTOV"),
    ] {
        let path = Path::new(name);
        let format = Format::of(path, bytes).unwrap_or_else(|| panic!("{name} is not known"));
        let problem = format.read(bytes, path, Column::Only).unwrap_err();
        assert!(problem.message.contains(words) && problem.help.is_some(), "{problem}");
    }
    for (name, text, column, words) in [
        ("lamp.spdx", SPDX.replace("405.5", "x"), None, "without a `wavelength`"),
        ("lamp.spdx", SPDX.replace("</IESTM2714>", ""), None, "ends within"),
        ("camera.json", CAMERA.to_owned(), None, "has 3 spectra"),
        ("camera.json", CAMERA.to_owned(), Some("X"), "no column \"X\""),
        ("leaf.sig", SIG.replace("Radiance, Radiance", "Counts, Counts"), Some("target"), "no radiance"),
        ("leaf.sig", SIG.replace("400.0", "340.0"), None, "next detector"),
        ("leaf.sed", SED.replace("\nData:", "\nDaten:"), None, "no line `Data:`"),
    ] {
        let problem = read(name, &text, column).unwrap_err();
        assert!(problem.message.contains(words), "{name}: {problem}");
    }
    assert_eq!(Format::of(Path::new("a.csv"), b"nm,value\n400,1\n"), None);
}
