//! Headers and data in every order.

use super::*;

fn read(text: &str) -> Result<Header, Box<Problem>> {
    parse(text.as_bytes(), Path::new("a.hdr"))
}

const SMALL: &str = "ENVI\nsamples = 2\nlines = 3\nbands = 2\ndata type = 4\n";

#[test]
fn headers_of_others_are_read() {
    let text = format!(
        "{SMALL}; a comment\nInterleave = BIP\nbyte order = 1\nheader  offset = 16\nwavelength units = Micrometers\n\
         wavelength = {{\n 0.4,\n 0.5 }}\nspectra names = {{ a, b }}\nsensor type = Unknown\n"
    );
    let header = read(&text).unwrap();
    assert_eq!((header.samples, header.lines, header.bands, header.header_offset), (2, 3, 2, 16));
    assert_eq!((header.interleave, header.big_endian, header.data_bytes()), (Interleave::Bip, true, Some(64)));
    assert_eq!(header.wavelength_nm, Some(vec![400.0, 500.0]));
    assert_eq!(header.list("spectra names"), Some(vec!["a", "b"]));
    let library = read(
        "ENVI\r\nfile type = ENVI Spectral Library\nsamples = 3\nlines = 2\nbands = 1\ndata type = 5\n\
         wavelength = { 400, 500, 600 }",
    )
    .unwrap();
    assert!(library.is_library() && library.wavelength_nm.is_some_and(|nm| nm == [400.0, 500.0, 600.0]));
    let unsaid = read(&format!("{SMALL}interleave = bsq\nwavelength = {{ 0.4, 2.5 }}")).unwrap();
    assert_eq!(unsaid.wavelength_nm, Some(vec![400.0, 2500.0]));
}

#[test]
fn what_is_written_is_read() {
    let image = Image {
        description: "of a test, {1}",
        size: [2, 3, 2],
        interleave: Interleave::Bil,
        data_type: DataType::F32,
        units: "W m^-2 sr^-1 nm^-1",
        ignore: -9999.0,
        origin: [10, 20],
        default_bands: Some([1, 0, 0]),
        wavelength_nm: vec![400.1, 1.0 / 3.0],
        fwhm_nm: vec![1.0, 2.0],
        names: vec!["a, b".into(), "c".into()],
        map: None,
    };
    let header = read(&image.header()).unwrap();
    assert_eq!((header.samples, header.lines, header.bands), (2, 3, 2));
    assert_eq!(header.wavelength_nm, Some(image.wavelength_nm.clone()));
    assert_eq!(header.list("band names"), Some(vec!["a  b", "c"]));
    assert_eq!(header.list("default bands"), Some(vec!["2", "1", "1"]));
    assert_eq!((header.get("x start"), header.get("y start")), (Some("11"), Some("21")));
}

#[test]
fn numbers_of_every_type_and_order() {
    for (kind, little, value) in [
        (DataType::U8, vec![200], 200.0),
        (DataType::I16, vec![0xfe, 0xff], -2.0),
        (DataType::U16, vec![0xfe, 0xff], 65534.0),
        (DataType::I32, (-7i32).to_le_bytes().to_vec(), -7.0),
        (DataType::U32, u32::MAX.to_le_bytes().to_vec(), 4294967295.0),
        (DataType::I64, (-7i64).to_le_bytes().to_vec(), -7.0),
        (DataType::U64, 7u64.to_le_bytes().to_vec(), 7.0),
        (DataType::F32, 0.5f32.to_le_bytes().to_vec(), 0.5),
        (DataType::F64, 0.1f64.to_le_bytes().to_vec(), 0.1),
    ] {
        assert_eq!(kind.decode(&little, false), value, "{kind:?}");
        let big: Vec<u8> = little.into_iter().rev().collect();
        assert_eq!((kind.decode(&big, true), big.len()), (value, kind.bytes()), "{kind:?}");
    }
}

#[test]
fn every_end_of_a_line_and_more_bytes_than_described() {
    let text = "ENVI\nsamples = 2\nlines = 3\nbands = 1\ndata type = 4\ninterleave = bsq\n";
    let header = read(text).unwrap();
    for end in ["\r\n", "\r"] {
        assert_eq!(read(&text.replace('\n', end)).unwrap(), header, "{end:?}");
    }
    assert_eq!(header.surplus(24, Path::new("a.img")), None);
    let told = header.surplus(48, Path::new("a.img")).unwrap();
    assert!(told.contains("48 bytes in a.img, of which its header describes 24"), "{told}");
}

#[test]
fn mistakes_name_their_line() {
    for (text, line, words) in [
        ("", None, "first line"),
        ("ENVI\nsamples\n", Some(2), "no `key = value`"),
        ("ENVI\nsamples = 2\n", None, "lacks `lines`"),
        ("ENVI\nsamples = -2\nlines = 1\n", Some(2), "whole number"),
        ("ENVI\nsamples = 0\nlines = 1\ndata type = 4\n", Some(2), "at least 1"),
        ("ENVI\nsamples = 1\nlines = 1\ndata type = 6\n", Some(4), "numbers that are real, but is 6"),
        ("ENVI\nsamples = 1\nlines = 1\ndata type = 4\nbyte order = 2\n", Some(5), "0 or 1"),
        ("ENVI\nsamples = 1\nlines = 1\ndata type = 4\ninterleave = x\n", Some(5), "bil, bip or bsq"),
        (
            "ENVI\nsamples = 1\nlines = 1\ndata type = 4\nwavelength = { 1, 2 }\n",
            Some(5),
            "each of 1 bands, above 0, but lists 2",
        ),
        ("ENVI\nsamples = 1\nlines = 1\ndata type = 4\nwavelength = { -1 }\n", Some(5), "above 0"),
        ("ENVI\nsamples = 1\nlines = 1\ndata type = 4\nwavelength = { 1\n", Some(5), "never ends"),
        (
            "ENVI\nsamples = 1\nlines = 1\ndata type = 4\nwavelength units = Index\nwavelength = { 1 }\n",
            Some(5),
            "unit of a spectrum, but is `index`",
        ),
        (
            "ENVI\nsamples = 1\nlines = 1\ndata type = 2\nscale factor = 1000\n",
            Some(5),
            "`scale factor` is not applied",
        ),
        ("ENVI\nsamples = 1\nlines = 1\ndata type = 2\noffset = 2\n", Some(5), "`offset` is not applied"),
        ("ENVI\nsamples = 1\nlines = 1\ndata type = 2\nradiance offset = -1\n", Some(5), "not applied"),
        ("ENVI\nsamples = 1\nlines = 1\ndata type = 2\nno data = -1\n", Some(5), "not applied"),
        ("ENVI\nsamples = 1\nlines = 1\ndata type = 2\ndata ignore values = {0, -1}\n", Some(5), "not applied"),
        ("ENVI\nsamples = 1\nlines = 1\ndata type = 2\nradiance units = mW/m2/sr/nm\n", Some(5), "not applied"),
        ("ENVI\nsamples = 1\nlines = 1\ndata type = 2\nwavelength medium = air\n", Some(5), "not applied"),
        ("ENVI\nsamples = 1\nlines = 1\ndata type = 2\ncoefficients = {2}\n", Some(5), "not applied"),
        ("ENVI\nsamples = 1\nlines = 1\nbands = 2\ndata type = 4\n", None, "lacks `interleave`"),
        ("ENVI\nsamples = 9999999999999\nlines = 9999999999999\ndata type = 4\n", None, "counted"),
    ] {
        let problem = read(text).unwrap_err();
        assert_eq!(problem.line, line, "{text:?}: {problem}");
        assert!(problem.message.contains(words), "{text:?}: {problem}");
    }
}

#[test]
fn titles_of_plots_say_the_unit_where_data_units_do_not() {
    let unit = |more: &str| {
        let header = read(&format!("{SMALL}interleave = bsq\n{more}\n"))?;
        Ok::<_, Box<Problem>>(header.unit().map(|stated| stated.meaning))
    };
    let titles = |text: &str| format!("z plot titles = {{Wavelength (nm), {text}}}");
    assert_eq!(unit(""), Ok(None));
    assert_eq!(unit(&titles("Reflectance")), Ok(None));
    let radiance = Some(Meaning::Unit(unit::parse("uW/cm^2/sr/nm").unwrap()));
    assert_eq!(unit(&titles("Radiance (uW/cm^2/sr/nm)")), Ok(radiance));
    assert_eq!(unit(&titles("Reflectance (percent)")), Ok(Some(Meaning::Unit(unit::parse("%").unwrap()))));
    assert_eq!(unit(&titles("Reflectance (bananas)")), Ok(Some(Meaning::Unknown)));
    assert_eq!(unit(&titles("Absorbance")), Ok(Some(Meaning::Logarithm)));
    assert_eq!(unit("data units = Bananas"), Ok(Some(Meaning::Unknown)));
    let both = |data: &str| unit(&format!("{}\ndata units = {data}", titles("Radiance (uW/cm^2/sr/nm)")));
    assert_eq!(both("uW / (cm2 sr nm)"), Ok(radiance));
    assert_eq!(both("Radiance"), Ok(radiance));
    let problem = both("W m-2 sr-1 nm-1").unwrap_err();
    assert!(problem.line == Some(7) && problem.message.contains("`z plot titles` says `Radiance (uW"), "{problem}");
}

/// Keys of others that change nothing are only told of.
#[test]
fn neutral_keys_of_others_are_left_out() {
    for line in ["offset = 0", "gain = 1", "radiance units = W/m2/sr/nm", "wavelength medium = vacuum", "operator = x"]
    {
        let header = read(&format!("ENVI\nsamples = 1\nlines = 1\ndata type = 4\n{line}\n"));
        let header = header.unwrap_or_else(|problem| panic!("{line}: {problem}"));
        assert!(header.notes.len() == 1 && header.notes[0].contains("not known"), "{line}: {:?}", header.notes);
    }
}
