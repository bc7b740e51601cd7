//! Binary files of ASD's field spectrometers (FieldSpec, LabSpec, TerraSpec, HandHeld), versions 1 to 8: a header of 484 bytes,
//! the spectrum, and since version 2 the spectrum of the white reference. What follows (classifiers, calibrations, logs) says
//! nothing about either. Layout: Analytical Spectral Devices, "ASD File Format: Version 8", revision B.

use std::path::Path;

use super::instrument::{pick, wrong};
use super::text::{Column, SpectrumTable, ascending};
use super::unit::Stated;
use crate::error::Problem;

type Read<T> = Result<T, Box<Problem>>;

/// How a file begins, by version.
const VERSIONS: [&[u8; 3]; 9] = [b"ASD", b"asd", b"as2", b"as3", b"as4", b"as5", b"as6", b"as7", b"as8"];
/// Of these there is no white reference behind the spectrum.
const FIRST_VERSION: usize = 2;

/// Bytes of the header, and where its fields are.
const HEADER: usize = 484;
const DARK_CORRECTED: usize = 181;
const DATA_TYPE: usize = 186;
const FIRST_NM: usize = 191;
const STEP_NM: usize = 195;
const DATA_FORMAT: usize = 199;
const CHANNELS: usize = 204;
const SATURATION: usize = 422;

/// Between a spectrum and the white reference: a flag (2 bytes), two times (8 each) and the length of a description.
const REFERENCE_HEADER: usize = 20;

/// No radiance or irradiance in W m⁻² (sr⁻¹) nm⁻¹ that these instruments can see is above this, and all counts are.
const MOST_POWER: f64 = 100.0;

/// Whether `bytes` are such a file, and not text that begins like one.
pub fn is_asd(bytes: &[u8]) -> bool {
    VERSIONS.iter().any(|version| bytes.starts_with(*version)) && bytes[..bytes.len().min(HEADER)].contains(&0)
}

/// `N` bytes at `offset`, where the header has them.
fn at<const N: usize>(bytes: &[u8], offset: usize) -> [u8; N] {
    let mut found = [0; N];
    found.copy_from_slice(&bytes[offset..offset + N]);
    found
}

/// How a spectrum's numbers are stored.
#[derive(Clone, Copy)]
enum Numbers {
    Float,
    Integer,
    Double,
}

impl Numbers {
    fn size(self) -> usize {
        match self {
            Numbers::Float | Numbers::Integer => 4,
            Numbers::Double => 8,
        }
    }

    fn decode(self, bytes: &[u8]) -> Vec<f64> {
        let four = || bytes.as_chunks::<4>().0.iter();
        match self {
            Numbers::Float => four().map(|&b| f32::from_le_bytes(b).into()).collect(),
            Numbers::Integer => four().map(|&b| i32::from_le_bytes(b).into()).collect(),
            Numbers::Double => bytes.as_chunks::<8>().0.iter().map(|&b| f64::from_le_bytes(b)).collect(),
        }
    }
}

/// What a file holds.
struct File {
    data_type: u8,
    dark_corrected: bool,
    /// Which detectors were saturated, a bit each.
    saturated: u8,
    nm: Vec<f64>,
    spectrum: Vec<f64>,
    /// The white reference, where there is one.
    white: Option<Vec<f64>>,
}

impl File {
    fn parse(bytes: &[u8], path: &Path) -> Read<File> {
        let cut = |end: usize, what: &str| {
            let message = format!("ends after {} bytes, where {what} goes on to {end}", bytes.len());
            wrong(path, None, message, "the file is cut: copy it again")
        };
        if bytes.len() < HEADER {
            return cut(HEADER, "the header");
        }
        let first = f64::from(f32::from_le_bytes(at(bytes, FIRST_NM)));
        let step = f64::from(f32::from_le_bytes(at(bytes, STEP_NM)));
        let channels = usize::from(u16::from_le_bytes(at(bytes, CHANNELS)));
        if !(first.is_finite() && first > 0.0 && step.is_finite() && step > 0.0 && channels > 1) {
            let message = format!("says that it has {channels} channels from {first} nm on in steps of {step} nm");
            return wrong(path, None, message, "the header is damaged");
        }
        let numbers = match bytes[DATA_FORMAT] {
            0 => Numbers::Float,
            1 => Numbers::Integer,
            2 => Numbers::Double,
            other => {
                let message = format!("stores its numbers in the format {other}, which ASD does not describe");
                return wrong(path, None, message, "export it as text: wavelengths in nm and reflectance or radiance");
            }
        };
        let size = channels * numbers.size();
        let Some(spectrum) = bytes.get(HEADER..HEADER + size) else {
            return cut(HEADER + size, "the spectrum");
        };
        let version = VERSIONS.iter().position(|version| bytes.starts_with(*version));
        let has_white = version.is_some_and(|version| version >= FIRST_VERSION);
        let white = match has_white.then(|| white_reference(bytes, HEADER + size, size)) {
            Some(Ok(white)) => white,
            Some(Err(end)) => return cut(end, "the white reference"),
            None => None,
        };
        Ok(File {
            data_type: bytes[DATA_TYPE],
            dark_corrected: bytes[DARK_CORRECTED] != 0,
            saturated: bytes[SATURATION] & 0b111,
            nm: (0..channels).map(|i| first + step * i as f64).collect(),
            spectrum: numbers.decode(spectrum),
            white: white.map(|bytes| numbers.decode(bytes)).filter(|values| values.iter().any(|v| *v > 0.0)),
        })
    }

    /// Spectrum over white reference, where that is above 0; how often it is not.
    fn quotient(&self, white: &[f64]) -> (SpectrumTable, usize) {
        let mut found = SpectrumTable::default();
        for ((nm, value), white) in self.nm.iter().zip(&self.spectrum).zip(white) {
            if *white > 0.0 && (value / white).is_finite() {
                found.nm.push(*nm);
                found.value.push(value / white);
            }
        }
        let left_out = self.nm.len() - found.nm.len();
        (found, left_out)
    }

    fn table(&self, values: &[f64], unit: &str) -> SpectrumTable {
        SpectrumTable {
            nm: self.nm.clone(),
            value: values.to_vec(),
            unit: Stated::of(unit),
            ..SpectrumTable::default()
        }
    }
}

/// The bytes of the white reference behind a spectrum that ends at `start`, or where they would have to end.
fn white_reference(bytes: &[u8], start: usize, size: usize) -> Result<Option<&[u8]>, usize> {
    let header = bytes.get(start..start + REFERENCE_HEADER).ok_or(start + REFERENCE_HEADER)?;
    let taken = header[..2] != [0, 0];
    let from = start + REFERENCE_HEADER + usize::from(u16::from_le_bytes(at(header, REFERENCE_HEADER - 2)));
    let found = bytes.get(from..from + size).ok_or(from + size)?;
    Ok(taken.then_some(found))
}

/// The spectrum in the file: reflectance or transmittance, that is spectrum over white reference, or radiance or irradiance, of
/// which `column` may ask for that of the white too.
pub fn read(bytes: &[u8], path: &Path, column: Column) -> Read<SpectrumTable> {
    let file = File::parse(bytes, path)?;
    let white = file.white.as_deref();
    let as_text = "export it as text in ASD's program: wavelengths in nm and reflectance or radiance";
    let mut found = match (file.data_type, white) {
        // Counts of both are of the same exposure: RS3 takes a new reference whenever it changes that.
        (0 | 1 | 6, Some(white)) => {
            let name = if file.data_type == 6 { "transmittance" } else { "reflectance" };
            pick(&[name.to_owned()], column, None, 2, path)?;
            let highest = file.spectrum.iter().copied().fold(0.0, f64::max);
            if highest <= 2.0 && white.iter().any(|v| *v > MOST_POWER) {
                let message = format!(
                    "holds values up to {highest} and a white reference in counts: whether they are to be divided by it, it does not say"
                );
                return wrong(path, None, message, as_text);
            }
            let (mut found, left_out) = file.quotient(white);
            if left_out > 0 {
                found.notes.push(format!(
                    "has no white reference at {left_out} of {} wavelengths: these are left out",
                    file.nm.len()
                ));
            }
            if file.data_type == 0 {
                found.notes.push("holds counts, and those of a white reference: their quotient is taken".to_owned());
            }
            found.called(name)
        }
        // What the first version keeps is the quotient itself.
        (1 | 6, None) if bytes.starts_with(VERSIONS[0]) || bytes.starts_with(VERSIONS[1]) => {
            pick(&["reflectance".to_owned()], column, None, 2, path)?;
            file.table(&file.spectrum, "").called(if file.data_type == 6 { "transmittance" } else { "reflectance" })
        }
        (0 | 1 | 6, None) => {
            let what = if file.data_type == 0 { "counts" } else { "a spectrum to be divided by a white reference" };
            return wrong(path, None, format!("holds {what}, and no white reference"), as_text);
        }
        (2 | 4, _) => {
            let (name, unit) =
                if file.data_type == 2 { ("radiance", "W m-2 sr-1 nm-1") } else { ("irradiance", "W m-2 nm-1") };
            let names = [name, "reference"].map(str::to_owned);
            let index = pick(&names[..1 + usize::from(white.is_some())], column, Some(0), 2, path)?;
            let values = white.filter(|_| index == 1).unwrap_or(&file.spectrum);
            let highest = values.iter().copied().fold(0.0, f64::max);
            if highest > MOST_POWER {
                let message = format!(
                    "says that it holds {name}, but its values, up to {highest}, are counts that are to be calibrated"
                );
                return wrong(path, None, message, as_text);
            }
            file.table(values, unit).called(name)
        }
        (other, _) => {
            let what = match other {
                3 => "numbers without a unit",
                5 => "a quality index",
                8 => "absorbance, a logarithm",
                _ => "a quantity that its header does not name",
            };
            return wrong(path, None, format!("is a file of an ASD spectrometer that holds {what}"), as_text);
        }
    };
    if let Some(i) = found.value.iter().position(|value| !value.is_finite()) {
        return wrong(path, None, format!("has {} at {} nm, which is no number", found.value[i], found.nm[i]), as_text);
    }
    if !file.dark_corrected {
        found.notes.push("says that the dark current was not subtracted: what is dark comes out too bright".to_owned());
    }
    if file.saturated != 0 {
        let names = ["below 1000 nm", "1000 to 1800 nm", "above 1800 nm"];
        let which: Vec<&str> = (0..3).filter(|bit| file.saturated & (1 << bit) != 0).map(|bit| names[bit]).collect();
        found.notes.push(format!(
            "says that the detector for {} was saturated: its values there are too low",
            which.join(", ")
        ));
    }
    ascending(found, path, "")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of `version` as the published layout has it: 350 nm on in steps of 2, with a description of the reference.
    fn file(version: &[u8; 3], data_type: u8, numbers: Numbers, spectrum: &[f64], white: Option<&[f64]>) -> Vec<u8> {
        let mut bytes = vec![0; HEADER];
        bytes[..3].copy_from_slice(version);
        bytes[DARK_CORRECTED] = 1;
        bytes[DATA_TYPE] = data_type;
        bytes[FIRST_NM..FIRST_NM + 4].copy_from_slice(&350f32.to_le_bytes());
        bytes[STEP_NM..STEP_NM + 4].copy_from_slice(&2f32.to_le_bytes());
        bytes[DATA_FORMAT] = numbers as u8;
        bytes[CHANNELS..CHANNELS + 2].copy_from_slice(&(spectrum.len() as u16).to_le_bytes());
        let put = |values: &[f64], bytes: &mut Vec<u8>| {
            for value in values {
                match numbers {
                    Numbers::Float => bytes.extend((*value as f32).to_le_bytes()),
                    Numbers::Integer => bytes.extend((*value as i32).to_le_bytes()),
                    Numbers::Double => bytes.extend(value.to_le_bytes()),
                }
            }
        };
        put(spectrum, &mut bytes);
        if let Some(white) = white {
            bytes.extend([0xff, 0xff]);
            bytes.extend([1; 16]);
            bytes.extend(5u16.to_le_bytes());
            bytes.extend(b"white");
            put(white, &mut bytes);
        }
        bytes
    }

    fn parse(bytes: &[u8], column: Option<&str>) -> Read<SpectrumTable> {
        assert!(is_asd(bytes));
        read(bytes, Path::new("leaf.asd"), column.into())
    }

    #[test]
    fn reflectance_is_the_quotient_with_the_white_reference() {
        let (counts, white) = ([100.0, 300.0, 50.0], [400.0, 400.0, 100.0]);
        for numbers in [Numbers::Float, Numbers::Integer, Numbers::Double] {
            for version in [b"as2", b"as6", b"as7", b"as8"] {
                let leaf = parse(&file(version, 1, numbers, &counts, Some(&white)), None).unwrap();
                assert_eq!((leaf.nm, leaf.value), (vec![350.0, 352.0, 354.0], vec![0.25, 0.75, 0.5]));
                assert!(leaf.notes.is_empty() && leaf.unit.is_none());
            }
        }
        let raw = parse(&file(b"as8", 0, Numbers::Double, &counts, Some(&white)), Some("reflectance")).unwrap();
        assert_eq!(raw.value, [0.25, 0.75, 0.5]);
        assert!(raw.notes[0].contains("their quotient"));
        // Where nothing was seen of the white there is no quotient.
        let dark = parse(&file(b"as8", 1, Numbers::Double, &counts, Some(&[400.0, 0.0, 100.0])), None).unwrap();
        assert_eq!((dark.nm, dark.value), (vec![350.0, 354.0], vec![0.25, 0.5]));
        assert!(dark.notes[0].contains("at 1 of 3 wavelengths"));
        // The first version keeps reflectance itself.
        assert_eq!(parse(&file(b"ASD", 1, Numbers::Float, &[0.25, 0.5], None), None).unwrap().value, [0.25, 0.5]);
    }

    #[test]
    fn radiance_has_its_unit() {
        let bytes = file(b"as7", 2, Numbers::Double, &[0.25, 0.5], Some(&[1.0, 2.0]));
        let radiance = parse(&bytes, None).unwrap();
        assert_eq!((radiance.value, radiance.unit.clone()), (vec![0.25, 0.5], Stated::of("W m-2 sr-1 nm-1")));
        assert_eq!(parse(&bytes, Some("reference")).unwrap().value, [1.0, 2.0]);
        let sun = parse(&file(b"ASD", 4, Numbers::Float, &[1.5, 1.25], None), None).unwrap();
        assert_eq!((sun.value, sun.unit), (vec![1.5, 1.25], Stated::of("W m-2 nm-1")));
    }

    #[test]
    fn what_a_header_says_of_faults_is_told() {
        let mut bytes = file(b"as8", 1, Numbers::Double, &[1.0, 2.0], Some(&[4.0, 4.0]));
        bytes[DARK_CORRECTED] = 0;
        bytes[SATURATION] = 0b101;
        let notes = parse(&bytes, None).unwrap().notes.join("; ");
        assert!(notes.contains("dark current was not subtracted"), "{notes}");
        assert!(notes.contains("below 1000 nm, above 1800 nm was saturated"), "{notes}");
    }

    #[test]
    fn what_would_be_guessed_is_refused() {
        let whole = file(b"as8", 1, Numbers::Double, &[100.0, 200.0], Some(&[400.0, 400.0]));
        let spoilt = |offset: usize, byte: u8| {
            let mut bytes = whole.clone();
            bytes[offset] = byte;
            bytes
        };
        let taken_never = {
            let mut bytes = whole.clone();
            bytes[HEADER + 16..HEADER + 18].fill(0);
            bytes
        };
        for (bytes, words) in [
            (whole[..300].to_vec(), "ends after 300 bytes, where the header goes on to 484"),
            (whole[..490].to_vec(), "the spectrum goes on to 500"),
            (whole[..510].to_vec(), "the white reference goes on to 520"),
            (whole[..530].to_vec(), "the white reference goes on to 541"),
            (spoilt(DATA_FORMAT, 3), "the format 3"),
            (spoilt(DATA_TYPE, 8), "absorbance"),
            (spoilt(DATA_TYPE, 5), "a quality index"),
            (spoilt(DATA_TYPE, 2), "are counts"),
            (spoilt(CHANNELS, 0), "has 0 channels"),
            (taken_never, "no white reference"),
            (file(b"as8", 1, Numbers::Double, &[0.5, 0.25], Some(&[4000.0, 4000.0])), "it does not say"),
            (file(b"ASD", 0, Numbers::Float, &[100.0, 200.0], None), "holds counts, and no white reference"),
        ] {
            let problem = parse(&bytes, None).unwrap_err();
            assert!(problem.message.contains(words), "{problem}");
        }
        assert!(parse(&whole, Some("radiance")).unwrap_err().message.contains("no column"));
        // Text that ASD's own programs export begins alike.
        assert!(!is_asd(b"ASD ASCII Export\nWavelength(nm)\tReflectance\n350\t0.5\n"));
    }
}
