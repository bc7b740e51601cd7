//! Where a line scanner is, line by line: a table with a header.

use std::path::Path;

use super::table;
use super::text;
use crate::error::Problem;

type Read<T> = Result<T, Box<Problem>>;

/// Where the scanner is, in the scene's metres, and how it is turned, degrees: yaw clockwise from north as seen from above, pitch with the
/// nose up, roll with the right wing down, in this order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Station {
    pub position: [f64; 3],
    pub yaw: f64,
    pub pitch: f64,
    pub roll: f64,
}

const POSITION: [&str; 3] = ["x", "y", "z"];
const TURNS: [&str; 3] = ["yaw_degrees", "pitch_degrees", "roll_degrees"];

/// Reads the file at `path`: the columns x, y and z, and any of yaw_degrees, pitch_degrees and roll_degrees; a row a line.
///
/// # Errors
/// By line: what is no such table, and cells without a number.
pub fn read(path: &Path) -> Read<Vec<Station>> {
    parse(&text::read(path)?, path)
}

/// [`read`] on the content of a file.
///
/// # Errors
/// As [`read`].
pub fn parse(bytes: &[u8], path: &Path) -> Read<Vec<Station>> {
    let table = table::read_for(bytes, path, "`x,y,z,yaw_degrees`, as its header has them")?;
    table.check_metres()?;
    let help =
        "begin the file with x,y,z,yaw_degrees,pitch_degrees,roll_degrees, of which the last three may be left out";
    let names: Vec<String> = table.names.iter().map(|name| name.trim().to_lowercase()).collect();
    if let Some((i, is_twice)) = table::stray(&names, &[POSITION, TURNS].concat()) {
        let (why, help) =
            if is_twice { ("twice", "keep one of the two") } else { ("which says nothing of a line", help) };
        let message = format!("has a column `{}`, {why}", table::shown(&table.names[i]));
        return Err(table.problem(Some(table.line), message, help));
    }
    let column = |name: &str| names.iter().position(|found| found == name);
    let mut position = [0; 3];
    for (place, name) in position.iter_mut().zip(POSITION) {
        *place =
            column(name).ok_or_else(|| table.problem(Some(table.line), format!("has no column `{name}`"), help))?;
    }
    let turns = TURNS.map(column);
    let mut stations = Vec::with_capacity(table.rows.len());
    for row in &table.rows {
        table.check_row(row)?;
        let cell = |column: usize| table.filled(row, column);
        let turn = |column: Option<usize>| column.map_or(Ok(0.0), cell);
        stations.push(Station {
            position: [cell(position[0])?, cell(position[1])?, cell(position[2])?],
            yaw: turn(turns[0])?,
            pitch: turn(turns[1])?,
            roll: turn(turns[2])?,
        });
    }
    Ok(stations)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<Station>, String> {
        parse(text.as_bytes(), Path::new("track.csv"))
            .map_err(|problem| format!("{:?} {}", problem.line, problem.message))
    }

    #[test]
    fn columns_are_known_by_name() {
        let found = read("# a flight\nroll_degrees,z,y,x\n1.5,100,2,3\n-1,101,4,5\n").expect("a track");
        let first = Station { position: [3.0, 2.0, 100.0], yaw: 0.0, pitch: 0.0, roll: 1.5 };
        assert_eq!((found.len(), found[0]), (2, first));
        for (text, what) in [
            ("x,y\n1,2\n", "no column `z`"),
            ("x,y,z,speed\n1,2,3,4\n", "a column `speed`"),
            ("x,y,z\n1,2,3\n1,,3\n", "Some(3) has no number"),
            ("x,y,z\n1,2,three\n", "not a finite number"),
            ("x,y,z,x\n1,2,3,4\n", "a column `x`, twice"),
            ("x,y,z,Z \n1,2,3,4\n", "a column `Z`, twice"),
            ("# units: cm\nx,y,z\n1,2,3\n", "Some(1) says `# units: cm`"),
            ("# in km\nx,y,z\n1,2,3\n", "Some(1) says `# in km`"),
        ] {
            let error = read(text).expect_err(what);
            assert!(error.contains(what), "{text}: {error}");
        }
    }
}
