//! Spectra in other people's formats, as the scene file and `spectile sensor` read them: against readers that were not
//! written here (SPECTILE_PYTHON), through a scene, and spoilt in every way.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use proptest::prelude::*;
use serde_json::Value;
use spectile::format::text::{SpectrumTable, read_spectrum};
use spectile::format::unit::Unit;
use spectile::format::{envi, library, modtran, response, text};
use spectile::spectral::Curve;
use spectile::{Error, scene};
use tempfile::tempdir;

use crate::outside::python;

const ECOSTRESS: &str = "Name: Construction Concrete\nType: manmade\nClass: Concrete\nSample No.: 0424UUUCNC\n\
    Owner: caf\u{e9}\nWavelength Range: All\nOrigin: somewhere\nDescription: made up for a test\n\
    Measurement: Directional (10 Degree) Hemispherical Reflectance\nFirst Column: X\nSecond Column: Y\n\
    X Units: Wavelength (micrometers)\nY Units: Reflectance (percent)\nFirst X Value: 14.0112\nLast X Value: 0.42\n\
    Number of X Values: 4\nAdditional Information: none.txt\n\n14.0112\t5.5125\n2.5\t20.0001\n0.9\t12.5\n0.42\t10.25\n";
const USGS: &str = " splib07a Record=12131: Quartz GDS31 0-74um fr       ASDFRa AREF\n 4.0000000e-01\n-1.2300000e+34\n \
    5.5000001e-01\n 6.2500000e-01\n";
const USGS_NM: &str = " splib07a Record=2: Wavelengths ASD 0.35-2.5 microns  2151 ch\n 0.350\n 0.351\n 0.352\n 0.353\n";
const TAPE7: &str = "MM  6    3    2    0\n    FREQ  TOT TRANS  PTH THRML  SURF EMIS  TOTAL RAD  DEPTH\n\
    \x20   500.     0.5000   1.00E-06   2.00E-06   3.00E-06  0.693\n   1000.     0.2500   2.00E-06   1.00E-06   4.00E-06  1.386\n -9999.\n";
const LIBRARY: &str = "ENVI\ndescription = { made up }\nfile type = ENVI Spectral Library\nsamples = 4\nlines = 2\nbands = 1\n\
    data type = 4\ninterleave = bsq\nbyte order = 0\nheader offset = 0\nwavelength units = Nanometers\n\
    wavelength = { 400, 500, 600, 700 }\nspectra names = { first, second }\n";

fn latin1(text: &str) -> Vec<u8> {
    text.chars().map(|c| u8::try_from(u32::from(c)).unwrap_or(b'?')).collect()
}

/// A file of an ASD spectrometer, version 8, of three detectors, as its manufacturer describes the format: counts of a leaf and of
/// the white reference as doubles.
pub fn asd() -> Vec<u8> {
    const CHANNELS: u16 = 21;
    let mut bytes = vec![0u8; 484];
    let mut put = |offset: usize, field: &[u8]| bytes[offset..offset + field.len()].copy_from_slice(field);
    put(0, b"as8");
    // Second, minute, hour, day, month, year since 1900.
    put(160, &[1, 0, 2, 0, 3, 0, 4, 0, 5, 0, 120, 0]);
    // Dark current subtracted; reflectance; a reference was taken.
    put(181, &[1]);
    put(186, &[1]);
    put(187, &1_600_000_000u32.to_le_bytes());
    put(191, &350f32.to_le_bytes());
    put(195, &1f32.to_le_bytes());
    put(199, &[2]);
    put(204, &CHANNELS.to_le_bytes());
    // Integration time, ms; the instrument, gains and where detectors meet.
    put(390, &17u32.to_le_bytes());
    put(431, &[4]);
    put(436, &1000u16.to_le_bytes());
    put(438, &500u16.to_le_bytes());
    put(444, &7f32.to_le_bytes());
    put(448, &14f32.to_le_bytes());
    let counts = |scale: f64| (0..CHANNELS).flat_map(move |i| (scale * (100.0 + f64::from(i).sin())).to_le_bytes());
    bytes.extend(counts(3.0));
    bytes.extend([0xff, 0xff]);
    bytes.extend([0; 16]);
    bytes.extend(7u16.to_le_bytes());
    bytes.extend(b"made up");
    bytes.extend((0..CHANNELS).flat_map(|i| (1000.0 + 7.0 * f64::from(i)).to_le_bytes()));
    bytes
}

/// A folder with one file of every kind.
fn files() -> tempfile::TempDir {
    let folder = tempdir().expect("folder");
    let put = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).expect("written");
    put("concrete.spectrum.txt", &latin1(ECOSTRESS));
    put("splib07a_Quartz_GDS31_ASDFRa_AREF.txt", USGS.as_bytes());
    put("splib07a_Wavelengths_ASD_0.35-2.5_microns_2151_ch.txt", USGS_NM.as_bytes());
    put("run.tp7", TAPE7.as_bytes());
    put("soils.hdr", LIBRARY.as_bytes());
    let values: Vec<u8> = (0..8).flat_map(|i| (0.1f32 + i as f32 / 20.0).to_le_bytes()).collect();
    put("soils.sli", &values);
    put("lamp.spd", b"400 1 # begins\n500 2\n");
    put("um.csv", b"wavelength_um;r\n0.5;0.75\n0.4;0.5\n");
    put("cm.csv", b"wavenumber (cm-1),r\n20000,0.75\n25000,0.5\n");
    put("bare.csv", b"0.4 0.5\n0.5 0.75\n");
    put("leaf.asd", &asd());
    folder
}

fn read(folder: &Path, name: &str, column: Option<&str>, unit: Option<Unit>) -> SpectrumTable {
    read_spectrum(&folder.join(name), column.into(), unit).unwrap_or_else(|problem| panic!("{problem}"))
}

#[test]
fn every_kind_of_file_is_told_apart() {
    let folder = files();
    let read = |name: &str, column: Option<&str>, unit| {
        let table = read(folder.path(), name, column, unit);
        (table.nm.iter().map(|nm| (nm * 1e6).round() / 1e6).collect::<Vec<f64>>(), table.value)
    };
    for name in ["um.csv", "cm.csv"] {
        assert_eq!(read(name, None, None), (vec![400.0, 500.0], vec![0.5, 0.75]), "{name}");
    }
    assert_eq!(read("bare.csv", None, Some(Unit::MICROMETRE)).0, [400.0, 500.0]);
    assert_eq!(read("lamp.spd", None, None), (vec![400.0, 500.0], vec![1.0, 2.0]));
    assert_eq!(read("concrete.spectrum.txt", None, None).0, [420.0, 900.0, 2500.0, 14_011.2]);
    assert_eq!(read("splib07a_Quartz_GDS31_ASDFRa_AREF.txt", None, None).0, [350.0, 352.0, 353.0]);
    assert_eq!(read("run.tp7", Some("total rad"), None).0, [10_000.0, 20_000.0]);
    for name in ["soils.sli", "soils.hdr"] {
        let (nm, value) = read(name, Some("second"), None);
        let expected = [0.3f32, 0.35, 0.4, 0.45];
        assert!(
            nm == [400.0, 500.0, 600.0, 700.0] && value.iter().zip(expected).all(|(a, b)| *a as f32 == b),
            "{value:?}"
        );
    }
}

#[test]
fn scenes_use_them_wherever_a_spectrum_is_expected() {
    let folder = files();
    let scene = r#"
        [camera.perspective]
        position = [0, 0, 3]
        look_at = [0, 0, 0]
        up = [0, 1, 0]
        fov = 40
        [film]
        width = 4
        height = 4
        [channels]
        equal = { from = 420, to = 700, count = 4 }
        [spectra.quartz]
        file = "splib07a_Quartz_GDS31_ASDFRa_AREF.txt"
        outside = "hold"
        [spectra.lamp]
        file = "bare.csv"
        unit = "um"
        [materials.concrete.diffuse]
        reflectance = { file = "concrete.spectrum.txt" }
        [materials.soil.diffuse]
        reflectance = { file = "soils.sli", column = "first" }
        [materials.quartz.diffuse]
        reflectance = "quartz"
        [[objects]]
        sphere = { center = [0, 0, 0], radius = 1 }
        material = "concrete"
        emission = "lamp"
        [[objects]]
        sphere = { center = [3, 0, 0], radius = 1 }
        material = "soil"
        emission = { file = "run.tp7", column = "TOTAL RAD", scale = 2 }
        [[objects]]
        sphere = { center = [6, 0, 0], radius = 1 }
        material = "quartz"
    "#;
    let path = folder.path().join("scene.toml");
    fs::write(&path, scene).expect("written");
    let scene = scene::load(&path, &[]).unwrap_or_else(|error| panic!("{error}"));
    let curve = |name: &str| &scene.spectra.iter().find(|s| s.name.contains(name)).expect(name).curve;
    assert!((curve("quartz").eval(351.0) - 0.475).abs() < 1e-7);
    assert!((curve("lamp").eval(450.0) - 0.625).abs() < 1e-12);
    let at = |object: usize, nm: f64| {
        let emission = scene.objects[object].emission.as_ref().expect("it shines");
        scene.spectra[emission.radiance].curve.eval(nm)
    };
    // 4e-6 W cm-2 sr-1 / cm-1 at 10 um are 4e-3 W m-2 sr-1 nm-1.
    assert!((at(1, 1e4) - 8e-3).abs() < 1e-14);
    assert!(scene.spectra.iter().any(|s| matches!(&s.curve, Curve::Linear { value, .. } if value[0] == 0.1025)));
    // What is wrong in them is said at the key that names them.
    let wrong = |from: &str, to: &str, words: &str| {
        let text = fs::read_to_string(&path).expect("read").replacen(from, to, 1);
        let path = folder.path().join("wrong.toml");
        fs::write(&path, text).expect("written");
        let error = scene::load(&path, &[]).map(|_| ()).expect_err("refused");
        assert!(matches!(error, Error::Input(_)) && error.to_string().contains(words), "{words}: {error}");
    };
    wrong("column = \"first\"", "column = \"third\"", "no spectrum \"third\"");
    wrong("column = \"TOTAL RAD\"", "unit = \"um\", column = \"TOTAL RAD\"", "says by itself");
    wrong("unit = \"um\"", "unit = \"furlong\"", "must be");
    wrong("file = \"bare.csv\"\n", "constant = 1\n", "goes with `file` only");
}

/// What files say of their values, through a scene: applied, refused or told of, never skipped.
#[test]
fn what_columns_say_of_their_values_is_applied_refused_or_told() {
    let folder = files();
    let percent = format!("{LIBRARY}z plot titles = {{Wavelength (nm), Reflectance (percent)}}\n");
    fs::write(folder.path().join("percent.hdr"), percent).expect("written");
    fs::copy(folder.path().join("soils.sli"), folder.path().join("percent.sli")).expect("copied");
    let load = |header: &str, material: &str| {
        fs::write(folder.path().join("a.csv"), format!("nm,{header}\n300,0.5\n900,0.5\n")).expect("written");
        let text = format!(
            "[camera.perspective]\nposition = [0, 0, 3]\nlook_at = [0, 0, 0]\nup = [0, 1, 0]\nfov = 40\n[film]\nwidth = 4\n\
             height = 4\n[channels]\nequal = {{ from = 420, to = 700, count = 4 }}\n[environment]\nradiance = 1\n{material}"
        );
        scene::parse(&text, &folder.path().join("scene.toml"), &[]).map_err(|error| error.to_string())
    };
    let ball = "[[objects]]\nsphere = { center = [0, 0, 0], radius = 1 }";
    let diffuse = |source: &str| format!("[materials.x.diffuse]\nreflectance = {source}\n{ball}\nmaterial = \"x\"\n");
    let csv = diffuse("{ file = \"a.csv\" }");
    let gas = format!(
        "[media.m]\ntemperature = 600\nspecies = [{{ table = \"a.csv\", fraction = 0.5 }}]\n{ball}\ninterior = \"m\"\n"
    );
    let holds = |scene: &scene::Scene, expected: f64| {
        scene.spectra.iter().any(|s| match &s.curve {
            Curve::Linear { value, .. } => (value[0] / expected - 1.0).abs() < 1e-6,
            _ => false,
        })
    };
    for (header, material, expected) in [
        ("percent", &csv, 0.005),
        ("reflectance (0-100)", &csv, 0.005),
        ("reflectance (per mille)", &csv, 0.5e-3),
        ("reflectance (ppm)", &csv, 0.5e-6),
        ("300 (kPa-1 m-1)", &gas, 0.5 * 101.325),
        // At 600 K there are fewer molecules in a cubic metre of 1 atm.
        ("600 (m-1 amagat-1)", &gas, 0.5 * 273.15 / 600.0),
        ("", &diffuse("{ file = \"percent.sli\", column = \"second\" }"), 0.003),
    ] {
        let scene = load(header, material).unwrap_or_else(|error| panic!("{header}: {error}"));
        assert!(holds(&scene, expected), "{header}: {:?}", scene.spectra);
        assert!(scene.warnings.iter().all(|warning| !warning.contains("not understood")), "{:?}", scene.warnings);
    }
    for (header, material) in [("reflectance (bananas)", &csv), ("300 (cm-1 bananas)", &gas)] {
        let scene = load(header, material).unwrap_or_else(|error| panic!("{header}: {error}"));
        let told =
            scene.warnings.iter().filter(|warning| warning.contains(&format!("`{header}` of its values"))).count();
        assert_eq!(told, 1, "{header}: {:?}", scene.warnings);
    }
    for header in ["OD", "optical density", "Abs", "-log R", "\"reflectance, log\"", "K/S"] {
        let error = load(header, &csv).expect_err(header);
        assert!(error.contains("gives logarithms, or K/S, as its values"), "{header}: {error}");
    }
}

/// What spectral's own readers and pyASDReader make of the files, and a library that spectral wrote.
#[test]
fn readers_of_python_read_the_same() {
    let Some(mut python) = python("read_libraries.py") else { return };
    let folder = files();
    let output = python.arg(folder.path()).output().expect("runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let theirs: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    for (name, column) in [
        ("concrete.spectrum.txt", None),
        ("splib07a_Quartz_GDS31_ASDFRa_AREF.txt", None),
        ("leaf.asd", None),
        ("written.sli", Some("dry soil")),
        ("written.sli", Some("wet soil")),
    ] {
        let ours = read(folder.path(), name, column, None);
        let key = column.map_or(name.to_owned(), |column| format!("{name}: {column}"));
        let numbers = |part: &str| -> Vec<f64> {
            theirs[&key][part].as_array().expect(&key).iter().map(|v| v.as_f64().expect("a number")).collect()
        };
        let close =
            |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-12 * b.abs());
        assert!(close(&ours.nm, &numbers("nm")), "{key}: {:?} {:?}", ours.nm, numbers("nm"));
        assert!(close(&ours.value, &numbers("value")), "{key}: {:?} {:?}", ours.value, numbers("value"));
    }
}

/// Files of real instruments, of versions 6 to 8: reflectances, and where there are counts their quotient by the white reference's, as
/// pyASDReader reads them. Those that call counts radiance, since a calibration behind them would make it, are refused.
#[test]
#[ignore = "downloads pyASDReader's samples from a registry of Python packages"]
fn real_files_of_asd_are_read_as_pyasdreader_reads_them() {
    let Some(mut python) = python("asd_samples.py") else { return };
    let folder = tempdir().expect("a folder");
    let output = python.arg(folder.path()).current_dir(folder.path()).output().expect("runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let theirs: serde_json::Map<String, Value> = serde_json::from_slice(&output.stdout).expect("JSON");
    let mut seen = HashMap::new();
    for (path, theirs) in &theirs {
        let numbers = |part: &str| -> Vec<f64> {
            theirs[part].as_array().expect(path).iter().map(|v| v.as_f64().expect("a number")).collect()
        };
        let kind = theirs["type"].as_str().expect("a type");
        *seen.entry(kind).or_insert(0) += 1;
        let ours = match read_spectrum(Path::new(path), None.into(), None) {
            Ok(ours) => ours,
            Err(problem) => {
                assert!(kind == "dt_RAD_TYPE" && problem.message.contains("are counts"), "{problem}");
                continue;
            }
        };
        let is_of_counts = ours.notes.iter().any(|note| note.contains("counts"));
        assert_eq!(is_of_counts, kind == "dt_RAW_TYPE", "{path}: {:?}", ours.notes);
        // Theirs are of f32 where ours are not, and the other way round.
        let furthest = |a: &[f64], b: &[f64]| {
            assert_eq!(a.len(), b.len(), "{path}");
            a.iter().zip(b).map(|(a, b)| (a - b).abs() / b.abs().max(1e-9)).fold(0.0, f64::max)
        };
        assert!(furthest(&ours.nm, &numbers("nm")) < 1e-12, "{path}");
        let furthest = furthest(&ours.value, &numbers("quotient"));
        assert!(furthest < 1e-6, "{path}: {furthest}");
    }
    assert_eq!([seen["dt_REF_TYPE"], seen["dt_RAD_TYPE"], seen["dt_RAW_TYPE"]], [6, 3, 5]);
}

/// Everything that reads bytes, on bytes: accepted or refused with words, never a panic.
fn survives(bytes: &[u8]) {
    let words = |result: Result<(), Box<spectile::error::Problem>>| {
        assert!(result.is_ok() || result.is_err_and(|problem| !problem.message.is_empty()));
    };
    for name in ["a.csv", "a.spd", "a.txt"] {
        words(text::parse_spectrum(bytes, Path::new(name), None).map(|_| ()));
        words(text::parse_spectrum(bytes, Path::new(name), Some("a")).map(|_| ()));
    }
    words(library::parse_ecostress(bytes, Path::new("a.txt")).map(|_| ()));
    words(library::read_usgs(bytes, Path::new("/no such folder/a.txt")).map(|_| ()));
    for column in [None, Some("TOTAL RAD"), Some("x")] {
        words(modtran::parse(bytes, Path::new("tape7"), column.into()).map(|_| ()));
    }
    words(response::parse_responses(bytes, Path::new("a.csv")).map(|_| ()));
    if let Ok(header) = envi::parse(bytes, Path::new("a.hdr")) {
        for name in [None, Some("first")] {
            let library = library::parse_envi(&header, Path::new("a.hdr"), bytes, Path::new("a.sli"), name.into());
            words(library.map(|_| ()));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(400) })]

    #[test]
    fn random_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        survives(&bytes);
    }

    #[test]
    fn spoilt_files_never_panic(
        which in 0..6usize,
        edits in proptest::collection::vec((any::<prop::sample::Index>(), 0..5u8, any::<u8>(), any::<prop::sample::Index>()), 1..6),
    ) {
        const RESPONSES: &str = "band,wavelength_nm,response\nred,600,0\nred,650,1\nblue,400,1\nblue,450,0.5\n";
        let original = [ECOSTRESS, USGS, TAPE7, LIBRARY, RESPONSES, "nm,a,b\n400,1,2\n500,1,\n600,0,3\n"][which];
        let mut bytes = latin1(original);
        let words: [&[u8]; 8] = [b"nan", b"-1", b"1e999", b"{", b"}", b"=", b"\n", b"999999999999999999999"];
        for (at, kind, byte, word) in edits {
            let i = at.index(bytes.len().max(1)).min(bytes.len());
            match kind {
                0 if i < bytes.len() => { bytes.remove(i); }
                1 => bytes.insert(i, byte),
                2 if i < bytes.len() => bytes[i] = byte,
                3 => bytes.truncate(i),
                _ => { bytes.splice(i..i, words[word.index(words.len())].iter().copied()); }
            }
        }
        survives(&bytes);
    }
}
