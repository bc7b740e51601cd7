//! Responses of sensors: CSV, wide (nm, then a column a channel, named in the header) or long (header
//! `band,wavelength_nm,response`).

use std::path::Path;

use super::text::{Separator, SpectrumTable, Unit, ascending, read};
use crate::error::Problem;
use crate::spectral::Response;

/// The responses of a sensor, by name, in the order of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Responses {
    pub named: Vec<(String, Response)>,
    /// What was not as it should be and could be put right, in words.
    pub warning: Option<String>,
}

/// Negative values are measurement noise down to this share of the peak, and become 0.
const NOISE: f64 = 0.01;

pub fn read_responses(path: &Path) -> Result<Responses, Box<Problem>> {
    parse_responses(&read(path)?, path)
}

/// [`read_responses`] on the content of the file; `path` stands in messages.
pub fn parse_responses(bytes: &[u8], path: &Path) -> Result<Responses, Box<Problem>> {
    let wrong = |line: Option<usize>, message: String, help: &str| {
        let help = (!help.is_empty()).then(|| help.to_owned());
        Box::new(Problem { file: path.to_owned(), line, message, help, ..Problem::default() })
    };
    // Only comments and names can hold anything but ASCII.
    let text = String::from_utf8_lossy(bytes);
    let text = text.trim_start_matches('\u{feff}');
    let mut lines = (1..)
        .zip(text.lines())
        .map(|(line, text)| (line, text.split('#').next().unwrap_or("").trim()))
        .filter(|(_, text)| !text.is_empty());
    let Some((header_line, header)) = lines.next() else {
        return Err(wrong(None, "holds no data".into(), "write lines of `nm,response` under a header with names"));
    };
    let separator = Separator::of(header);
    let names = separator.split(header);
    if names.len() < 2 || names[0].parse::<f64>().is_ok() {
        let help = "begin with a header: `wavelength_nm,red,green,blue`, or `band,wavelength_nm,response`";
        return Err(wrong(Some(header_line), "has no names of channels".into(), help));
    }
    let is_long = names.len() == 3 && names[0].eq_ignore_ascii_case("band");
    let of_wavelength = names[usize::from(is_long)];
    let unit = Unit::from_header(of_wavelength).map_err(|unit| {
        let message = format!("gives wavelengths in `{}`", unit.escape_debug());
        wrong(Some(header_line), message, "give them in nm, um or cm-1")
    })?;

    let mut tables: Vec<(String, SpectrumTable)> = Vec::new();
    let empty = || SpectrumTable { nm: Vec::new(), value: Vec::new(), line: Vec::new() };
    if !is_long {
        tables.extend(names[1..].iter().map(|name| ((*name).to_owned(), empty())));
    }
    for (line, text) in lines {
        let cells = separator.split(text);
        if cells.len() != names.len() {
            let message = format!("has {} cells where {} are expected", cells.len(), names.len());
            return Err(wrong(Some(line), message, "give every line the same number of cells"));
        }
        let number = |cell: &str| {
            let value = cell.parse::<f64>().ok().filter(|v| v.is_finite());
            value.ok_or_else(|| wrong(Some(line), format!("`{}` is not a finite number", cell.escape_debug()), ""))
        };
        let x = number(cells[usize::from(is_long)])?;
        if x <= 0.0 {
            return Err(wrong(Some(line), format!("the wavelength must be greater than 0, but is {x}"), ""));
        }
        let mut push = |index: usize, value: f64| {
            let table = &mut tables[index].1;
            table.nm.push(unit.to_nm(x));
            table.value.push(value);
            table.line.push(line);
        };
        if is_long {
            let value = number(cells[2])?;
            let known = tables.iter().position(|(name, _)| name == cells[0]);
            let index = known.unwrap_or_else(|| {
                tables.push((cells[0].to_owned(), empty()));
                tables.len() - 1
            });
            let table = &mut tables[index].1;
            table.nm.push(unit.to_nm(x));
            table.value.push(value);
            table.line.push(line);
        } else {
            for (index, cell) in cells[1..].iter().enumerate() {
                // Empty: not given there.
                if !cell.is_empty() {
                    push(index, number(cell)?);
                }
            }
        }
    }
    if tables.is_empty() {
        return Err(wrong(None, "holds no responses".into(), ""));
    }
    let mut seen = std::collections::BTreeSet::new();
    if let Some((name, _)) = tables.iter().find(|(name, _)| !seen.insert(name.clone())) {
        let message = format!("has two channels named \"{}\"", name.escape_debug());
        return Err(wrong(Some(header_line), message, "give each its own name"));
    }
    responses(tables, path)
}

fn responses(tables: Vec<(String, SpectrumTable)>, path: &Path) -> Result<Responses, Box<Problem>> {
    let (mut named, mut noisy, mut count, mut least) = (Vec::new(), Vec::new(), 0usize, 0f64);
    for (name, table) in tables {
        let of = format!(" of the channel \"{}\"", name.escape_debug());
        let mut table = ascending(table, path, &of)?;
        let peak = table.value.iter().copied().fold(0.0, f64::max);
        let mut is_noisy = false;
        for (i, value) in table.value.iter_mut().enumerate().filter(|(_, value)| **value < 0.0) {
            if *value < -NOISE * peak {
                let message = format!("the response{of} must not be negative, but is {value}");
                let help = Some("values down to -1 % of the peak are taken as noise and become 0".to_owned());
                return Err(Box::new(Problem {
                    file: path.to_owned(),
                    line: Some(table.line[i]),
                    message,
                    help,
                    ..Problem::default()
                }));
            }
            least = least.min(*value);
            count += 1;
            is_noisy = true;
            *value = 0.0;
        }
        if is_noisy {
            noisy.push(name.clone());
        }
        let response = Response::new(table.nm, table.value).map_err(|what| {
            let message = format!("the response{of} {what}");
            Box::new(Problem { file: path.to_owned(), message, ..Problem::default() })
        })?;
        named.push((name, response));
    }
    let warning = (count > 0).then(|| {
        format!(
            "{}: {count} slightly negative responses (down to {least}) of the channels {} became 0",
            path.display(),
            noisy.join(", ")
        )
    });
    Ok(Responses { named, warning })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Responses, Box<Problem>> {
        parse_responses(text.as_bytes(), Path::new("s.csv"))
    }

    #[test]
    fn wide_and_long_files_say_the_same() {
        let wide = parse("# a sensor\nwavelength_nm,red,blue\n400,,1\n500,0,0.5\n600,1,\n").unwrap();
        let long = parse("band,um,response\nred,0.5,0\nred,0.6,1\nblue,0.4,1\nblue,0.5,0.5\n").unwrap();
        assert_eq!(wide, long);
        assert_eq!(wide.named[1].1.integral(), 75.0);
        assert_eq!(wide.warning, None);
    }

    #[test]
    fn noise_becomes_zero_and_is_told() {
        let noisy = parse("nm,a,b\n400,-0.009,0\n500,1,2\n600,-0.001,0\n").unwrap();
        let warning = noisy.warning.unwrap();
        assert!(
            warning.contains("2 slightly negative") && warning.contains("-0.009") && warning.contains("channels a "),
            "{warning}"
        );
        assert_eq!(noisy.named[0].1.integral(), 100.0);
    }

    #[test]
    fn mistakes_name_their_line() {
        for (text, line, words) in [
            ("", None, "no data"),
            ("400,1\n500,1\n", Some(1), "no names"),
            ("nm,a\n400,1\n500,x\n", Some(3), "`x` is not a finite number"),
            ("nm,a\n400,1\n500,1,2\n", Some(3), "3 cells"),
            ("nm,a\n400,1\n0,1\n", Some(3), "greater than 0"),
            ("nm,a\n400,1\n", None, "1 values of the channel \"a\""),
            ("nm,a\n400,1\n500,-0.02\n", Some(3), "must not be negative, but is -0.02"),
            ("nm,a\n400,0\n500,0\n", None, "zero everywhere"),
            ("nm,a,a\n400,1,1\n500,1,1\n", Some(1), "two channels named \"a\""),
            ("thz,a\n400,1\n500,1\n", Some(1), "`thz`"),
            ("band,nm,response\n", None, "no responses"),
            ("band,nm,response\na,400,1\na,500,1\na,450,1\na,600,1\n", Some(4), "follows"),
        ] {
            let problem = parse(text).unwrap_err();
            assert!(problem.message.contains(words), "{text:?}: {problem}");
            assert_eq!(problem.line, line, "{text:?}: {problem}");
        }
    }
}
