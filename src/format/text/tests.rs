use super::*;

fn csv(text: &str, column: Option<&str>) -> Result<SpectrumTable, Box<Problem>> {
    parse_spectrum(text.as_bytes(), Path::new("t.csv"), column)
}

#[test]
fn reads_the_common_layouts() {
    for text in [
        "400,0.5\n500,0.75\n",
        "# about\nwavelength_nm,value\n400,0.5\n\n500,0.75 # end\n",
        "\u{feff}nm;r\r\n400;0.5\r\n500;0.75",
        "nm\tr\n400\t0.5\n500\t0.75",
        "\"wavelength (um)\",\"r\"\n0.5,0.75\n0.4,0.5",
        "wavenumber_cm-1,r\n20000,0.75\n25000,0.5",
        "\u{3bb} (\u{c5}),r\n4000,0.5\n5000,0.75",
        ",nm,r\n0,400,0.5\n1,500,0.75",
        "# wavelength_um,r\n0.4,0.5\n0.5,0.75",
        "400 0.5\n500   0.75",
    ] {
        let table = csv(text, None).unwrap();
        assert_eq!((table.nm, table.value), (vec![400.0, 500.0], vec![0.5, 0.75]), "{text}");
    }
    let spd = parse_spectrum(b"400 0.5 # x\n500 0.75", Path::new("t.SPD"), None).unwrap();
    assert_eq!((spd.nm, spd.line), (vec![400.0, 500.0], vec![1, 2]));
}

#[test]
fn picks_columns_and_skips_what_is_not_given() {
    let text = "nm,a,b\n400,1,\n500,2,5\n600,3,6\n";
    assert_eq!(csv(text, Some("a")).unwrap().value, [1.0, 2.0, 3.0]);
    let b = csv(text, Some("b")).unwrap();
    assert_eq!((b.nm, b.value, b.line), (vec![500.0, 600.0], vec![5.0, 6.0], vec![3, 4]));
    assert!(csv(text, None).unwrap_err().help.unwrap().contains("a, b"));
    assert!(csv(text, Some("c")).unwrap_err().help.unwrap().contains("a, b"));
    let number = |text: &str, column| parse(text.as_bytes(), Path::new("t.csv"), column, None);
    assert_eq!(number("400,1,2\n500,3,4\n", Column::Number(3)).unwrap().value, [2.0, 4.0]);
    assert_eq!(number("400,1,2\n500,3,4\n", Column::Named("2")).unwrap().value, [1.0, 3.0]);
    for wrong in [0, 1, 4] {
        assert!(number("400,1,2\n500,3,4\n", Column::Number(wrong)).unwrap_err().help.unwrap().contains("2 to 3"));
    }
    let in_um = |text: &str| parse(text.as_bytes(), Path::new("t.csv"), Column::Only, Some(Unit::MICROMETRE));
    assert_eq!(in_um("Frequency,v\n0.4,1\n0.5,3\n").unwrap().nm, [400.0, 500.0]);
    assert_eq!(in_um("wl (um),v\n0.4,1\n0.5,3\n").unwrap().nm, [400.0, 500.0]);
    assert!(in_um("nm,v\n400,1\n500,3\n").unwrap_err().message.contains("the scene says another unit"));
    let twice = number("nm,v,v\n400,1,2\n500,1,2", Column::Named("v")).unwrap_err();
    assert!(twice.message.contains("several columns") && twice.help.unwrap().contains("`column = 2` or 3"));
}

/// As Cary's programs write samples beside each other.
#[test]
fn a_column_with_wavelengths_of_its_own_is_not_read_over_others() {
    let text = "nm,%T,nm,%T\n400,1,400,2\n500,1,500,2\n";
    let number = |text: &str| parse(text.as_bytes(), Path::new("t.csv"), Column::Number(4), None);
    assert_eq!(number(text).unwrap().value, [2.0, 2.0]);
    let problem = number(&text.replace("1,500", "1,501")).unwrap_err();
    assert!(problem.message.contains("column 4 over wavelengths of its own") && problem.line == Some(3), "{problem}");
}

/// libRadtran's solar spectra, an instrument's marks around its numbers.
#[test]
fn comments_may_say_the_unit_of_the_values() {
    let sun = csv("# Kurucz 1992\n# wavelength (nm), irradiance mW/(m2 nm)\n250 50\n251 60\n", None).unwrap();
    let Meaning::Unit(measure) = sun.unit.unwrap().meaning else { panic!("a unit") };
    assert_eq!(measure.to(unit::Kind::Irradiance), Some(unit::Density::Plain(1e-3)));
    assert!(sun.notes.iter().any(|note| note.contains("in the comment on line 2")), "{:?}", sun.notes);
    let own = csv("# W m-2 sr-1 nm-1\n400 1\n500 2\n", None).unwrap();
    assert!(own.unit.is_some() && own.notes.is_empty());
    // Two units that differ say nothing.
    assert_eq!(csv("# from W/m2/um\n# now in mW/m2/um\n400 1\n500 2\n", None).unwrap().unit, None);
    let ocean = ">>>>>Begin Spectral Data<<<<<\n400\t1\n500\t2\n>>>>>End Spectral Data<<<<<\n";
    assert_eq!(csv(ocean, None).unwrap().value, [1.0, 2.0]);
    let hapi = csv("nu,coef\n1000,1e-22\n1001,1e-22\n", None).unwrap_err();
    assert!(hapi.help.unwrap().contains("300 K (cm2/molecule)"));
}

#[test]
fn comments_about_factors_and_air_are_told_once() {
    let notes = |text: &str| csv(text, None).unwrap().notes;
    for comment in ["scale factor: 0.001", "multiply by 1e-3 to get radiance", "values x 1000", "wavelengths in air"] {
        let notes = notes(&format!("# made up\n# {comment}\n# {comment}\nnm,v\n300,3\n900,9\n"));
        let [note] = &notes[..] else { panic!("{comment}: {notes:?}") };
        assert!(note.contains(&format!("`# {comment}` on line 2, which is not applied")), "{note}");
    }
    // Where the header says so, they are converted.
    let converted = notes("# wavelengths in air\nair wavelength (nm),v\n300,3\n900,9\n");
    assert!(converted.len() == 1 && converted[0].contains("converted to vacuum"), "{converted:?}");
    assert_eq!(notes("# by A. Nonymous, 2020\nnm,v\n300,3\n900,9\n"), Vec::<String>::new());
}

#[test]
fn an_empty_cell_says_nothing_also_of_one_column() {
    let table = csv("nm,v\n400,1\n500,\n600,3\n", None).unwrap();
    assert_eq!((table.nm, table.value), (vec![400.0, 600.0], vec![1.0, 3.0]));
    assert!(csv("nm,v\n400,1\n500\n600,3\n", None).is_err(), "a row without the cell");
}

#[test]
fn an_index_is_two_columns() {
    let index = |text: &str| parse_index(text.as_bytes(), Path::new("nk.csv"));
    for text in ["400,1.5,0\n500,1.4,0.25\n", "k,nm,x\n400,1,2\n500,1,2\n", "um,k,x,n\n0.4,0,9,1.5\n0.5,0.25,,1.4\n"] {
        match index(text) {
            Ok([Some(n), Some(k)]) => {
                assert_eq!((n.nm, n.value), (vec![400.0, 500.0], vec![1.5, 1.4]), "{text}");
                assert_eq!((k.nm, k.value), (vec![400.0, 500.0], vec![0.0, 0.25]), "{text}");
            }
            Ok(_) => panic!("{text} gives both"),
            Err(problem) => assert!(text.starts_with('k') && problem.message.contains("has wavelengths in column 2")),
        }
    }
    // Each has the wavelengths at which it is given.
    let [Some(n), Some(k)] = index("nm,n,k\n400,1.5,\n500,1.4,1\n600,1.3,2\n").unwrap() else { panic!("both") };
    assert_eq!((n.nm.len(), k.nm), (3, vec![500.0, 600.0]));
    assert!(index("nm,n,k\n400,1.5,\n500,1.4,\n").unwrap_err().message.contains("0 values of k"));
    assert!(index("400,1.5\n500,1.4\n").unwrap_err().message.contains("2 columns and no header"));
}

/// As refractiveindex.info offers them: um, n and k one under the other.
#[test]
fn downloads_are_two_tables() {
    for separator in [",", "\t"] {
        let text = "wl,n\n0.4,0.2\n0.7,0.25\n\nwl,k\n0.4,3\n0.7,4\n".replace(',', separator);
        let [Some(n), Some(k)] = parse_index(text.as_bytes(), Path::new("a.csv")).unwrap() else { panic!("both") };
        assert_eq!((n.nm, n.value, k.value), (vec![400.0, 700.0], vec![0.2, 0.25], vec![3.0, 4.0]));
        assert_eq!(k.line, [6, 7]);
        assert_eq!(csv(&text, Some("k")).unwrap().value, [3.0, 4.0]);
        assert_eq!(csv(&text, None).unwrap().value, [0.2, 0.25]);
    }
    let [n, k] = parse_index(b"wl,n\n0.4,1.5\n0.7,1.4\n", Path::new("a.csv")).unwrap();
    assert!(n.is_some() && k.is_none());
}

#[test]
fn a_step_is_two_equal_wavelengths() {
    assert_eq!(csv("400,1\n400,2\n500,3", None).unwrap().nm, [400.0, 400.0, 500.0]);
}

#[test]
fn mistakes_name_their_line() {
    for (text, line, words) in [
        ("", None, "no data"),
        ("# only\n\n", None, "no data"),
        ("400\n500", Some(1), "one column"),
        ("400,1,2\n500,1,2", Some(1), "no header"),
        ("nm,v\n400,1\n500,x", Some(3), "`x` is not a finite number"),
        ("400,1\n500,nan", Some(2), "finite"),
        ("400,1\n500,inf", Some(2), "finite"),
        ("400,1\n500,", None, "1 values"),
        ("400,1\n500,1,1", Some(2), "cells"),
        ("400,1\n-500,1", Some(2), "greater than 0"),
        ("1e-32nm,v\n1e-320,1\n500,1", Some(2), "cannot be represented"),
        ("400,1\n500,1\n450,1\n600,1", Some(3), "follows"),
        ("400,1\n400,2\n400,3\n500,1", Some(3), "third time"),
        ("400,1", None, "1 values"),
        ("Frequency,v\n4000,1\n5000,1", Some(1), "`Frequency`"),
        ("nm,v,v\n400,1,2\n500,1,2", Some(1), "2 value columns"),
    ] {
        let problem = csv(text, None).unwrap_err();
        assert_eq!(problem.line, line, "{text:?}: {problem}");
        assert!(problem.message.contains(words), "{text:?}: {problem}");
        assert_eq!(problem.file, Path::new("t.csv"));
    }
    assert!(csv("400,1\n500,2", Some("a")).unwrap_err().message.contains("no header"));
}

#[test]
fn percent_counts_once() {
    // A tenth and a fifth, whether the header, the cells or both say percent; in a header of percent a bare number is percent too.
    for text in ["nm,R (%)\n400,10%\n500,20%", "nm,R (%)\n400,10%\n500,20", "nm,R (%)\n400,10\n500,20"] {
        let table = csv(text, None).unwrap();
        assert!(table.unit.as_ref().is_some_and(Stated::is_percent), "{text}");
        assert_eq!(table.value, [10.0, 20.0], "{text}");
    }
    let table = csv("nm,R\n400,10%\n500,20%", None).unwrap();
    assert_eq!((table.unit, table.value), (None, vec![0.1, 0.2]));
    // A comment counts where there is one column; of several nobody can tell.
    let table = csv("# Column 2: reflectance (percent)\nnm,v\n400,10\n500,20", None).unwrap();
    assert!(
        table.unit.as_ref().is_some_and(Stated::is_percent) && table.notes[0].contains("line 1"),
        "{:?}",
        table.notes
    );
    let table = csv("# Reflectance in percent\nnm,v,w\n400,10,1\n500,20,1", Some("v")).unwrap();
    assert_eq!(table.unit.map(|stated| stated.meaning), Some(Meaning::Factor));
}

/// Bruker's tables have wavenumbers, and no header that says so.
#[test]
fn tables_of_opus_need_a_unit() {
    let read = |unit| parse(b"25000,0.1\n20000,0.2\n", Path::new("a.dpt"), Column::Only, unit);
    assert!(read(None).unwrap_err().help.is_some_and(|help| help.contains("cm-1")));
    assert_eq!(read(Some(Unit::WAVENUMBER)).unwrap().nm, [400.0, 500.0]);
}

#[test]
fn wavelengths_of_their_own_are_refused() {
    for (text, column, words) in [
        ("Wavelength (nm),v,Wavelength (um),w\n400,1,0.5,1\n500,1,0.6,1", "w", "wavelengths of its own"),
        ("Wavelength (nm),v,Wavelength (nm),w\n400,1,500,1\n500,1,600,1", "w", "wavelengths of its own"),
        ("from (nm),to (nm),v\n400,500,1\n500,600,1", "v", "intervals"),
        ("lower_nm,upper_nm,v\n400,500,1\n500,600,1", "v", "intervals"),
    ] {
        let problem = csv(text, Some(column)).unwrap_err();
        assert!(problem.message.contains(words), "{text}: {problem}");
    }
    // The same places in another unit are no others, nor is a second axis beside the first.
    for text in [
        "Wavelength (nm),v,Wavelength (um),w\n400,1,0.4,3\n500,1,0.5,4",
        "Wavelength (um),Wavenumber (cm-1),w\n0.4,25000,3\n0.5,20000.1,4",
    ] {
        assert_eq!(csv(text, Some("w")).unwrap().value, [3.0, 4.0], "{text}");
    }
}

/// n and k are those of an index where nothing else can be meant.
#[test]
fn columns_of_an_index_are_known() {
    let said = |text: &str, column: &str| {
        let table = csv(text, Some(column)).unwrap_or_else(|problem| panic!("{text}: {problem}"));
        table.said.map(|(said, _)| said)
    };
    for (text, column, expected) in [
        ("nm,n,k\n400,1.5,0\n500,1.5,0\n", "n", Some(Said::Index)),
        ("nm,n,k\n400,1.5,0\n500,1.5,0\n", "k", Some(Said::Extinction)),
        ("um,k,n\n0.4,0,1.5\n0.5,0,1.5\n", "k", Some(Said::Extinction)),
        ("wl,n\n0.4,1.5\n0.5,1.5\n\nwl,k\n0.4,0\n0.5,0\n", "k", Some(Said::Extinction)),
        ("nm,n\n400,1.5\n500,1.5\n", "n", Some(Said::Index)),
        ("nm,k\n400,1\n500,1\n", "k", Some(Said::Kay)),
        ("nm,k (m-1)\n400,1\n500,1\n", "k", None),
        ("nm,k,m,n\n400,1,1,1\n500,1,1,1\n", "k", None),
        ("nm,n-butane\n400,1\n500,1\n", "n-butane", None),
        ("nm,k,leaf\n400,1,1\n500,1,1\n", "k", None),
    ] {
        assert_eq!(said(text, column), expected, "{text}: {column}");
    }
}

/// Rows of 1 nm from 350 nm on, numbered from `first`.
fn numbered(header: &str, first: usize) -> String {
    let rows: String =
        (0..60).map(|i| format!("{},{},{}\n", first + i, 350 + i, if i < 30 { 0.25 } else { 0.75 })).collect();
    format!("{header}\n{rows}")
}

/// As R, pandas, spreadsheets and instruments number their rows.
#[test]
fn row_numbers_are_no_wavelengths() {
    for first in ["", "\"\"", "X", "No.", "Nr", "ID", "n", "Obs", "V1", "Step", "Position", "Unnamed: 0", "#", "rank"] {
        for second in
            ["wl", "WL", "wvl", "lambda", "\u{3bb}", "wave", "Wavelength (nm)", "Wellenl\u{e4}nge", "Wavelength..nm."]
        {
            for from in [0, 1, 50] {
                let text = numbered(&format!("{first},{second},refl"), from);
                match csv(&text, Some("refl")) {
                    Ok(table) => assert_eq!((table.nm[0], table.value[29], table.value[30]), (350.0, 0.25, 0.75)),
                    // A line that begins with the mark of a comment names no columns.
                    Err(problem) => assert!(first == "#", "{first},{second}: {problem}"),
                }
            }
        }
    }
    // Where no column is called as wavelengths are.
    for header in ["X,a,refl", "", "No.,Messwert,refl", ",a,refl"] {
        let problem =
            csv(numbered(header, 1).trim_start(), Some(if header.is_empty() { "3" } else { "refl" })).unwrap_err();
        let is_said =
            ["numbers of rows", "from which no wavelength follows"].iter().any(|words| problem.message.contains(words));
        assert!(is_said, "{header}: {problem}");
    }
    // Behind more than numbers of rows.
    for header in ["sample,x,wl,refl", "oak,wl,pine,elm"] {
        let problem = csv(&format!("{header}\n3,7,400,0.5\n9,8,500,0.5\n"), Some("4")).unwrap_err();
        assert!(problem.message.contains("put") || problem.help.unwrap().contains("first"), "{header}");
    }
    // The same places twice, and what counts by ones and is called so.
    assert_eq!(csv("channel centre,um,v\n400,0.4,1\n401,0.401,2\n", Some("v")).unwrap().nm, [400.0, 401.0]);
    assert_eq!(csv("wavelength (um),v\n1,3\n2,4\n3,5\n", None).unwrap().nm, [1000.0, 2000.0, 3000.0]);
}

#[test]
fn pairs_of_columns_have_wavelengths_of_their_own() {
    for header in [
        "wl,B1,wl,B2",
        "WL,B1,WL,B2",
        "\u{3bb},B1,\u{3bb},B2",
        "wl1,B1,wl2,B2",
        "lambda_1,B1,lambda_2,B2",
        "x1,y1,x2,y2",
        "w,B1,w,B2",
        "nm1,B1,nm2,B2",
        "wl,B1,wl.1,B2",
        "wl,B1,,B2",
        "B1 wavelength,B1 response,B2 wavelength,B2 response",
        "wl_A,A,wl_B,B",
        "",
    ] {
        let text = format!("{header}\n450,0,600,0\n460,1,610,1\n500,0,650,0\n");
        let problem = parse(text.trim_start().as_bytes(), Path::new("t.csv"), Column::Number(4), None).unwrap_err();
        assert!(problem.message.contains("wavelengths of its own"), "{header}: {problem}");
        let problem = crate::format::response::parse_responses(text.trim_start().as_bytes(), Path::new("t.csv"));
        assert!(problem.unwrap_err().message.contains("of their own"), "{header}");
    }
    // R's names of a table without any, and values that ascend.
    let read = |text: &str| parse(text.as_bytes(), Path::new("t.csv"), Column::Number(4), None);
    assert_eq!(read("V1,V2,V3,V4\n400,1,2,7\n500,3,4,8\n600,5,6,9\n").unwrap().value, [7.0, 8.0, 9.0]);
    assert_eq!(read("400,1,2,7\n500,3,4,8\n600,5,6,9\n").unwrap().value, [7.0, 8.0, 9.0]);
}

#[test]
fn values_of_intervals_are_refused() {
    for header in [
        "wl_min,wl_max,v",
        "wavelength_start_nm,wavelength_end_nm,v",
        "lambda_min,lambda_max,v",
        "bin_start,bin_end,v",
        "lo,hi,v",
        "low,high,v",
        "left,right,v",
        "wl_from,wl_to,v",
        "nm_lo,nm_hi,v",
        "lambda1,lambda2,v",
        "edge1,edge2,v",
        "Lambda von,Lambda bis,v",
        "from (nm),to (nm),v",
        "a,b,v",
        "",
    ] {
        for rows in ["400,500,0.1\n500,600,0.2\n600,700,0.3\n", "600,700,0.3\n500,600,0.2\n400,500,0.1\n"] {
            let text = format!("{header}\n{rows}");
            let problem = parse(text.trim_start().as_bytes(), Path::new("t.csv"), Column::Number(3), None).unwrap_err();
            assert!(problem.message.contains("values of intervals"), "{header}: {problem}");
        }
    }
    // Minima and maxima of what lies over a wavelength.
    assert_eq!(csv("wl,min,max\n400,1,2\n500,2,3\n600,3,4\n", Some("max")).unwrap().value, [2.0, 3.0, 4.0]);
    assert_eq!(csv("V1,V2,V3\n400,1,2\n500,2,3\n600,3,4\n", Some("V3")).unwrap().value, [2.0, 3.0, 4.0]);
}
