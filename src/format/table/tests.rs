//! Tables of spreadsheets.

use super::*;

fn numbers(text: &[u8]) -> Vec<Vec<Option<f64>>> {
    let table = read(text, Path::new("t.csv")).unwrap_or_else(|problem| panic!("{problem}"));
    let row = |row: &Row| (0..table.columns()).map(|i| table.number(row, i).unwrap()).collect();
    table.rows.iter().map(row).collect()
}

#[test]
fn whatever_separates_and_ends_lines() {
    let expected = vec![vec![Some(400.5), Some(1.25)], vec![Some(700.0), Some(-2.0)]];
    let utf16 = |text: &str, big: bool| -> Vec<u8> {
        let mark = if big { "" } else { "\u{feff}" };
        format!("{mark}{text}")
            .encode_utf16()
            .flat_map(|word| if big { word.to_be_bytes() } else { word.to_le_bytes() })
            .collect()
    };
    for text in [
        &b"nm,value\r400.5,1.25\r700,-2\r"[..],
        b"nm,value\r\n400.5,1.25\r\n\r\n700,-2\r\n,\r\n,,\r\n",
        b"sep=;\nnm;value\n400,5;1,25\n700;-2\n",
        b"nm;value\n400,5;1,25\n700,0;-2,0\n",
        b"nm\tvalue\n400,5\t1,25\n700\t-2,0\n",
        b"400,5 1,25\n700,0 -2,0\n",
        b"nm,value,\n400.5,1.25,\n700,-2,\n",
        b"\"Wavelength, nm\",\"Value, none\"\n400.5,1.25\n700,-2\n",
        b"Instrument: X\nDate: 2026-01-01\nnm,value\n400.5,1.25\n700,-2\n",
        b"Wavelength,Radiance\n(nm),(W)\n400.5,1.25\n700,-2\n",
        b"nm,value\n4.005D+02,1.25d+0\n7.0D2,-2\n",
        b"% about\n! about\n// about\nnm,value\n400.5,1.25\n700,\xe2\x88\x922\n",
        b"nm\tRed; left\n400.5\t1.25\n700\t-2\n",
        b"nm,value\n400.5,125%\n700,-200%\n",
        b"nm,value\n400.5,125 %\n700,-200 %\n",
        b"nm;value\n400,5;125,0 %\n700,0;-200,0 %\n",
        b"wavelength (nm)   reflectance (no unit)\n 400.5  1.25\n 700  -2\n",
        &utf16("nm,value\n400.5,1.25\n700,-2\n", false),
        &utf16("nm,value\n400.5,1.25\n700,-2\n", true),
    ] {
        assert_eq!(numbers(text), expected, "{}", String::from_utf8_lossy(text));
    }
    assert_eq!(numbers(b"nm,v\n400,1.0-101\n500,2.5+100\n")[1][1], Some(2.5e100));
    assert_eq!(
        numbers(b"nm,v,w\n400,#N/A,1\n500,n/a,2\n"),
        [[Some(400.0), None, Some(1.0)], [Some(500.0), None, Some(2.0)]]
    );
    let table = read(b"nm,Sample #1,Sample #2 # of two\n400,1,2 # first\n700,1,2\n", Path::new("t.csv")).unwrap();
    assert_eq!(table.names, ["nm", "Sample #1", "Sample #2"]);
}

#[test]
fn headers_are_found_where_they_stand() {
    for (text, names) in [
        ("# wavelength_um,radiance\n0.4,1\n0.5,1\n", &["wavelength_um", "radiance"][..]),
        ("# made in 2020, by X\n400,1\n500,1\n", &[]),
        ("# wavelength [um] radiance\n0.4 1\n0.5 1\n", &["wavelength [um]", "radiance"]),
        ("Long name,second\nnm,W\nof a lamp,\n400,1\n500,2\n", &["Long name (nm)", "second (W)"]),
        ("400,1\n500,1\n", &[]),
        ("band,nm,response\nred,400,1\n", &["band", "nm", "response"]),
        ("nm,%\nwavelength,reflectance\n400,1\n500,1\n", &["wavelength (nm)", "reflectance (%)"]),
        ("Al, as WVASE has it\nANGSTROMS\nNK\n4000 1 3\n5000 2 3\n", &["ANGSTROMS", "n", "k"]),
    ] {
        let table = read(text.as_bytes(), Path::new("t.csv")).unwrap_or_else(|problem| panic!("{text}: {problem}"));
        assert_eq!(table.names, names, "{text}");
    }
}

#[test]
fn what_can_be_read_in_two_ways_is_refused() {
    for (text, line, words) in [
        ("nm\tv\n1,000\t2,000\n1,100\t2,100\n", 2, "decimal comma or a comma between thousands"),
        ("nm,v\n\"1,000\",0.5\n\"1,100\",0.6\n", 2, "no commas within numbers"),
        ("nm;v\n1,5;2.5\n2,5;3.5\n", 2, "decimal comma"),
        ("Scale factor: 100\nnm,v\n400,1\n500,1\n", 1, "not applied"),
        ("X Units: um\nwl,v\n400,1\n500,1\n", 1, "not applied"),
        ("Scale factor,0.01\nnm,v\n400,1\n500,1\n", 1, "not applied"),
        ("Units: percent\nnm,v\n400,1\n500,1\n", 1, "not applied"),
        ("about\nDivide by 10000 to get reflectance\nnm,v\n400,1\n500,1\n", 2, "not applied"),
        ("lamp\nANGSTROMS\nlambda value\n4000 1\n5000 1\n", 2, "not applied"),
        ("Data\nXAxis mode: Raman Shifts\n>>>>>Begin Spectral Data<<<<<\n400\t1\n500\t1\n", 2, "Raman Shifts"),
        ("Y-axis: % Reflectance\n400\t1\n500\t1\n", 1, "% Reflectance"),
        ("Y-axis: Counts\n400\t1\n500\t1\n", 1, "Counts"),
        (",Wavelength (nm),R\n,400,10\n,500,20\n", 2, "remove the first column"),
        ("nm,v,w,x\n400,1\n500,1\n", 1, "4 cells where the numbers below have 2"),
    ] {
        let problem = read(text.as_bytes(), Path::new("t.csv")).unwrap_err();
        assert!(problem.to_string().contains(words) && problem.line == Some(line), "{text}: {problem}");
    }
    // What Windows prints of no number, which is no comment.
    for cell in ["1.#QNAN", "-1.#IND", "1.#INF", "1.#INF00"] {
        let text = format!("nm,v\n400,{cell}\n500,1\n");
        let table = read(text.as_bytes(), Path::new("t.csv")).unwrap_or_else(|problem| panic!("{problem}"));
        let problem = table.number(&table.rows[0], 1).unwrap_err();
        assert!(problem.message.contains("not a finite number") && problem.line == Some(2), "{cell}: {problem}");
    }
    // Lines of OceanView and the like that change nothing are only left out.
    let plain = "User: x\nXAxis mode: Wavelengths\nNumber of Pixels in Spectrum: 2\n400\t1\n500\t1\n";
    assert_eq!(read(plain.as_bytes(), Path::new("t.txt")).map(|table| table.rows.len()).ok(), Some(2));
    let table = read(b"nm,v\n400,0,1,0\n700,0,1,0\n", Path::new("t.csv"));
    let problem = table.and_then(|table| table.check_row(&table.rows[0])).unwrap_err();
    assert!(problem.to_string().contains("2") && problem.line.is_some(), "{problem}");
}

/// What a line before the numbers says of axis or values is not left out, whatever words it has; what changes nothing is.
#[test]
fn statements_before_a_table() {
    for line in [
        "X-Axis,Wavenumber (cm-1)",
        "Abscissa,Wavenumber",
        "Axis,Wavenumber",
        "First column: wavenumber in cm-1",
        "X Units,cm-1",
        "Wavelength unit: Angstrom",
        "Wavelength,Angstrom",
        "Wavelength:,um",
        "Units,Angstrom",
        "nombre d'onde",
        "Unit,%",
        "values are in percent",
        "Reflectance in %",
        "Ordinate,%R",
        "Mode: %T",
        "Measurement mode,Absorbance",
        "Data: -log10(R)",
        "Scale,0.01",
        "YFACTOR,0.01",
        "Y-axis: Counts",
    ] {
        for header in ["", "wl,v\n"] {
            let text = format!("{line}\n{header}4000,0.1\n5000,0.2\n");
            let problem = read(text.as_bytes(), Path::new("t.csv")).expect_err(line);
            assert!(problem.line == Some(1) && problem.message.contains("says `"), "{text}: {problem}");
        }
    }
    for text in [
        "Integration time: 10 ms\nLaser,532 nm\nHumidity (%): 45\nwl,v\n400,1\n500,2\n",
        "Resolution: 4 cm-1\nwl,v\n400,1\n500,2\n",
        "Wavelength range: 0.4 - 2.5 um\nwl,v\n400,1\n500,2\n",
        "Wavelength: 632.8 nm\nwl,v\n400,1\n500,2\n",
        "X Axis,Wavelength (nm)\nY Axis,Radiance\nwl,v\n400,1\n500,2\n",
        "X-Axis,Wavelength (um)\nwl (um),v\n0.4,1\n0.5,2\n",
        "Y-Axis: % Reflectance\nnm,R (%)\n400,1\n500,2\n",
        "Log file: a.txt\nSample: pine/bark\nwl,v\n400,1\n500,2\n",
        "Wavelength: nm\n400 1\n500 2\n",
    ] {
        let table = read(text.as_bytes(), Path::new("t.csv")).unwrap_or_else(|problem| panic!("{text}: {problem}"));
        assert_eq!(table.rows.len(), 2, "{text}");
    }
    let said = |text: &str| read(text.as_bytes(), Path::new("t.csv")).unwrap().said.map(|(said, _)| said);
    assert_eq!(said("Photometric mode: Transmittance\nnm,v\n400,1\n500,2\n"), Some(Said::Transmittance));
    assert_eq!(said("# emissivity\nnm,v\n400,1\n500,2\n"), Some(Said::Emissivity));
    assert_eq!(said("# from the emissivity of oak\nnm,v\n400,1\n500,2\n"), None);
    for unit in ["|Angstrom|W/m2/sr/nm|", "|cm-1|W|"] {
        let text = format!("\\about\n|wavelength|flux|\n|double|double|\n{unit}\n 4000 0.1\n 5000 0.2\n");
        let problem = read(text.as_bytes(), Path::new("t.tbl")).unwrap_err();
        assert!(problem.line == Some(2) && problem.message.contains("a table of IPAC"), "{problem}");
    }
}

/// Units by a line of their own count as those in brackets do.
#[test]
fn lines_of_units() {
    let name = |unit: &str| {
        let text = format!("Wavelength,Sample 1\n{unit}\n400,0.5\n500,0.6\n");
        let table = read(text.as_bytes(), Path::new("t.csv")).unwrap_or_else(|problem| panic!("{text}: {problem}"));
        let is_told = table.notes.iter().any(|note| note.contains("not understood"));
        (Stated::in_name(&table.names[1]).map(|stated| stated.meaning), is_told)
    };
    let percent = Stated::of("%").map(|stated| stated.meaning);
    for unit in ["%", "(%)", "pct", "%R", "%T", "R%", "% R", "% Refl", "%REFL", "Reflectance %", "%reflectance"] {
        assert_eq!(name(&format!("nm,{unit}")), (percent, false), "{unit}");
    }
    for unit in ["Abs", "dB", "log10", "OD"] {
        assert_eq!(name(&format!("nm,{unit}")), (Some(crate::format::unit::Meaning::Logarithm), false), "{unit}");
    }
    for (unit, is_told) in [("", false), ("-", false), ("v", true), ("wt%", true), ("xyz", true)] {
        assert_eq!(name(&format!("nm,{unit}")), (None, is_told), "{unit}");
    }
    // Names and units on two lines, of which the second is the header.
    let problem = read(b"Mode,%T\nnm,v\n400,50\n500,60\n", Path::new("t.csv")).unwrap_err();
    assert!(problem.line == Some(1) && problem.message.contains("Mode %T"), "{problem}");
    let table = read(b"Mode,fast\nnm,v\n400,50\n500,60\n", Path::new("t.csv")).unwrap();
    assert_eq!(table.names, ["nm", "v"]);
}

/// Rows that are none of names do not take the place of those that are.
#[test]
fn names_stand_above_rows_without_numbers() {
    let head = "Wavelength (um),Reflectance (%)\n";
    for between in ["NA,NA\n", ",\n", "sample,leaf\n", "-----,-----\n", ",Leaf 1\n", "NA,9\n", "N/A,#N/A\n--,--\n"] {
        let text = format!("{head}{between}0.4,0.5\n0.7,0.5\n");
        let table = read(text.as_bytes(), Path::new("t.csv")).unwrap();
        assert_eq!(
            (&table.names[..], table.rows.len()),
            (&["Wavelength (um)", "Reflectance (%)"].map(String::from)[..], 2),
            "{between}"
        );
        let is_told = table.notes.iter().any(|note| note.contains("left out"));
        assert_eq!(is_told, between.contains("eaf") || between.contains('9'), "{between}: {:?}", table.notes);
    }
    let labelled = "Wavelength (um),Reflectance (%),Reflectance (%)\n,Leaf 1,Leaf 2\n0.4,1,2\n0.7,1,2\n";
    let table = read(labelled.as_bytes(), Path::new("t.csv")).unwrap();
    assert_eq!(table.names, ["Wavelength (um)", "Leaf 1 (%)", "Leaf 2 (%)"]);
    for rows in [
        "\"2,500\",0.2\n\"1,000\",0.2\n950,0.6\n900,0.6\n",
        "\"1'000\",0.2\n950,0.6\n900,0.6\n",
        "\"1 000\",0.2\n950,0.6\n",
    ] {
        let problem = read(format!("Wavelength,Reflectance\n{rows}").as_bytes(), Path::new("t.csv")).unwrap_err();
        assert!(problem.line == Some(2) && problem.help.unwrap().contains("thousands"), "{rows}");
    }
}
