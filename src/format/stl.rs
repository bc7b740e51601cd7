//! STL meshes, binary and text. Read here rather than by a crate, since those that there are keep no lines.

use std::iter::Enumerate;
use std::path::Path;
use std::slice::Split;

use glam::DVec3;

use super::mesh::{Labels, Mesh, Part, Place};
use crate::error::Problem;

/// Bytes before the facets of a binary file: a header of any content and their number.
const BEGIN: usize = 84;
/// Bytes of a facet: normal, three corners, two of whatever the writer liked.
const FACET: usize = 50;

/// Reads an STL file of this content; `path` stands in messages. What a facet's normal is follows from the order of its corners;
/// facets that state the opposite are counted in a note.
///
/// # Errors
/// What is wrong, with the line in text and the facet in binary files.
pub fn parse(bytes: &[u8], path: &Path) -> Result<Mesh, Box<Problem>> {
    let problem = |line: Option<usize>, message: String| {
        Box::new(Problem { file: path.to_owned(), line, message, ..Problem::default() })
    };
    let mut facets = Facets::default();
    let mut mesh = match is_binary(bytes) {
        Some(count) => binary(bytes, count, &mut facets).map_err(|message| problem(None, message))?,
        None if is_text(bytes) => text(bytes, &mut facets).map_err(|(line, message)| problem(Some(line), message))?,
        None => return Err(problem(None, neither(bytes))),
    };
    mesh.parts.retain(|part| !part.triangles.is_empty());
    if mesh.parts.is_empty() {
        return Err(problem(None, "has no facets".to_owned()));
    }
    if facets.opposite > 0 {
        mesh.notes.push(format!(
            "{} facets state a normal against the order of their corners, which is what counts: their front is where the corners \
             run counter-clockwise",
            facets.opposite
        ));
    }
    Ok(mesh)
}

/// The number of facets, if the file has just the length of a binary one. Headers of binary files may begin with `solid`.
fn is_binary(bytes: &[u8]) -> Option<usize> {
    let count = stated(bytes)?;
    (bytes.len() as u64 == BEGIN as u64 + FACET as u64 * u64::from(count)).then_some(count as usize)
}

/// Begins as text does, and has no zeros as numbers of binary files have.
fn is_text(bytes: &[u8]) -> bool {
    let text = bytes.trim_ascii_start();
    text.get(..5).is_some_and(|start| start.eq_ignore_ascii_case(b"solid"))
        && !bytes[..bytes.len().min(BEGIN + FACET)].contains(&0)
}

fn stated(bytes: &[u8]) -> Option<u32> {
    let count = bytes.get(BEGIN - 4..BEGIN)?;
    Some(u32::from_le_bytes(count.try_into().ok()?))
}

fn neither(bytes: &[u8]) -> String {
    match stated(bytes) {
        Some(count) => format!(
            "is neither text, which begins with `solid`, nor binary: its {count} facets would take {} bytes, but it has {}",
            BEGIN as u64 + FACET as u64 * u64::from(count),
            bytes.len()
        ),
        None => format!("is no STL file: it has {} bytes, and does not begin with `solid`", bytes.len()),
    }
}

/// Appends triangles to parts.
#[derive(Default)]
struct Facets {
    opposite: usize,
}

impl Facets {
    fn add(&mut self, part: &mut Part, normal: [f64; 3], corners: [[f64; 3]; 3]) {
        let first = part.positions.len() as u32;
        part.positions.extend(corners);
        part.triangles.push([first, first + 1, first + 2]);
        let [a, b, c] = corners.map(DVec3::from_array);
        if (b - a).cross(c - a).dot(DVec3::from_array(normal)) < 0.0 {
            self.opposite += 1;
        }
    }
}

fn binary(bytes: &[u8], count: usize, facets: &mut Facets) -> Result<Mesh, String> {
    let mut part = Part { place: Place::Face(0), ..Part::default() };
    // Three corners a facet have to have indices.
    if count > u32::MAX as usize / 3 {
        return Err(format!("has {count} facets, more than the {} that are possible", u32::MAX / 3));
    }
    part.positions.reserve_exact(3 * count);
    part.triangles.reserve_exact(count);
    for (i, facet) in bytes[BEGIN..].chunks_exact(FACET).enumerate() {
        let mut numbers = [0.0; 12];
        for (number, four) in numbers.iter_mut().zip(facet.as_chunks::<4>().0) {
            *number = f64::from(f32::from_le_bytes(*four));
        }
        let [normal, corners @ ..] = [0, 3, 6, 9].map(|at| [numbers[at], numbers[at + 1], numbers[at + 2]]);
        if corners.iter().flatten().any(|x| !x.is_finite()) {
            return Err(format!("facet {i} (counted from 0) has a corner that is not finite"));
        }
        facets.add(&mut part, normal, corners);
    }
    Ok(Mesh { parts: vec![part], ..Mesh::default() })
}

type Lines<'a> = Enumerate<Split<'a, u8, fn(&u8) -> bool>>;

/// Where the words of a text file are.
struct Words<'a> {
    lines: Lines<'a>,
    line: usize,
    rest: &'a [u8],
}

type Mistake = (usize, String);

impl<'a> Words<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        let is_end: fn(&u8) -> bool = |byte| matches!(byte, b'\n' | b'\r');
        Words { lines: bytes.split(is_end).enumerate(), line: 0, rest: b"" }
    }

    /// The next word, on this line or a later one.
    fn next(&mut self) -> Option<&'a [u8]> {
        loop {
            self.rest = self.rest.trim_ascii_start();
            if !self.rest.is_empty() {
                let end = self.rest.iter().position(u8::is_ascii_whitespace).unwrap_or(self.rest.len());
                let (word, rest) = self.rest.split_at(end);
                self.rest = rest;
                return Some(word);
            }
            (self.line, self.rest) = self.lines.next()?;
        }
    }

    /// What is left of the line.
    fn rest_of_line(&mut self) -> String {
        String::from_utf8_lossy(std::mem::take(&mut self.rest).trim_ascii()).into_owned()
    }

    fn mistake<T>(&self, message: String) -> Result<T, Mistake> {
        Err((self.line + 1, message))
    }

    fn expect(&mut self, expected: &str) -> Result<(), Mistake> {
        match self.next() {
            Some(word) if word.eq_ignore_ascii_case(expected.as_bytes()) => Ok(()),
            Some(word) => self.mistake(format!("`{expected}` is expected here, not `{}`", shown(word))),
            None => self.mistake(format!("the file ends where `{expected}` is expected")),
        }
    }

    fn numbers(&mut self, what: &str) -> Result<[f64; 3], Mistake> {
        let mut numbers = [0.0; 3];
        for number in &mut numbers {
            let Some(word) = self.next() else {
                return self.mistake(format!("the file ends where three numbers of a {what} are expected"));
            };
            let Some(value) = std::str::from_utf8(word).ok().and_then(|word| word.parse::<f64>().ok()) else {
                return self.mistake(format!("a {what} needs three numbers, of which `{}` is none", shown(word)));
            };
            *number = value;
        }
        Ok(numbers)
    }
}

fn shown(word: &[u8]) -> String {
    String::from_utf8_lossy(word).chars().take(20).collect::<String>().escape_debug().to_string()
}

/// Words in any letters, as writers differ; several solids one after the other, each a part.
fn text(bytes: &[u8], facets: &mut Facets) -> Result<Mesh, Mistake> {
    let (mut mesh, mut words) = (Mesh::default(), Words::new(bytes));
    while let Some(word) = words.next() {
        if !word.eq_ignore_ascii_case(b"solid") {
            return words.mistake(format!("`solid` is expected here, not `{}`", shown(word)));
        }
        let line = words.line + 1;
        let name = words.rest_of_line();
        let labels = Labels { object: (!name.is_empty()).then_some(name), ..Labels::default() };
        let mut part = Part { labels, place: Place::Line(line), ..Part::default() };
        loop {
            match words.next() {
                Some(word) if word.eq_ignore_ascii_case(b"facet") => facet(&mut words, &mut part, facets)?,
                Some(word) if word.eq_ignore_ascii_case(b"endsolid") => break,
                Some(word) => {
                    let message = format!("`facet` or `endsolid` is expected here, not `{}`", shown(word));
                    return words.mistake(message);
                }
                None => return words.mistake("the file ends within a solid: `endsolid` is missing".to_owned()),
            }
        }
        words.rest_of_line();
        mesh.parts.push(part);
    }
    Ok(mesh)
}

fn facet(words: &mut Words, part: &mut Part, facets: &mut Facets) -> Result<(), Mistake> {
    words.expect("normal")?;
    let normal = words.numbers("normal")?;
    words.expect("outer")?;
    words.expect("loop")?;
    let mut corners = [[0.0; 3]; 3];
    for corner in &mut corners {
        words.expect("vertex")?;
        *corner = words.numbers("vertex")?;
        if corner.iter().any(|x| !x.is_finite()) {
            return words.mistake("a vertex is not finite".to_owned());
        }
    }
    words.expect("endloop")?;
    words.expect("endfacet")?;
    if part.positions.len() > u32::MAX as usize - 3 {
        return words.mistake(format!("a solid has more than the {} facets that are possible", u32::MAX / 3));
    }
    facets.add(part, normal, corners);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stl(bytes: &[u8]) -> Result<Mesh, Box<Problem>> {
        parse(bytes, Path::new("m.stl"))
    }

    const TEXT: &str = "solid a part\nfacet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex 0 1e0 0\n endloop\n\
        endfacet\nendsolid a part\nSOLID\nFACET NORMAL 0 0 -1\nOUTER LOOP\nVERTEX 0 0 1\nVERTEX 1 0 1\nVERTEX 0 1 1\nENDLOOP\n\
        ENDFACET\nENDSOLID\n";

    fn binary_file(facets: &[[f32; 12]]) -> Vec<u8> {
        let mut bytes = b"solid of a binary file".to_vec();
        bytes.resize(80, b' ');
        bytes.extend((facets.len() as u32).to_le_bytes());
        for facet in facets {
            bytes.extend(facet.iter().flat_map(|x| x.to_le_bytes()));
            bytes.extend([7, 7]);
        }
        bytes
    }

    const FIRST: [[f64; 3]; 3] = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]];

    #[test]
    fn solids_of_text_are_parts() {
        // Older programs write capitals only.
        let capitals = TEXT.replacen("solid a part\nfacet normal", "SOLID a part\nFACET NORMAL", 1);
        for text in [TEXT.to_owned(), capitals, TEXT.replace('\n', "\r\n"), TEXT.replace('\n', "\r")] {
            let mesh = stl(text.as_bytes()).unwrap();
            assert_eq!(mesh.parts.len(), 2);
            assert_eq!(mesh.parts[0].positions, FIRST);
            assert_eq!(mesh.parts[0].triangles, [[0, 1, 2]]);
            assert_eq!(mesh.parts[0].labels.object.as_deref(), Some("a part"));
            assert_eq!(mesh.parts[1].labels.object, None);
            assert!(mesh.notes.len() == 1 && mesh.notes[0].starts_with("1 facets"), "{:?}", mesh.notes);
        }
        assert_eq!(stl(TEXT.as_bytes()).unwrap().parts[1].place, Place::Line(10));
    }

    #[test]
    fn binary_files_may_begin_as_text_does() {
        let facet = [0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1., 0.];
        let mesh = stl(&binary_file(&[facet, facet])).unwrap();
        assert_eq!(mesh.parts[0].positions, [FIRST, FIRST].concat());
        assert_eq!(mesh.parts[0].triangles, [[0, 1, 2], [3, 4, 5]]);
        assert!(mesh.notes.is_empty());
    }

    #[test]
    fn mistakes_have_a_place() {
        let wrong = |from: &str, to: &str| stl(TEXT.replacen(from, to, 1).as_bytes()).unwrap_err().to_string();
        assert_eq!(
            wrong("vertex 1 0 0", "vertex 1 x 0"),
            "m.stl:5: a vertex needs three numbers, of which `x` is none"
        );
        assert_eq!(
            wrong("vertex 1 0 0", "vertex 1 0"),
            "m.stl:6: a vertex needs three numbers, of which `vertex` is none"
        );
        assert_eq!(wrong(" endloop", ""), "m.stl:8: `endloop` is expected here, not `endfacet`");
        assert_eq!(wrong("vertex 1 0 0", "vertex 1 0 inf"), "m.stl:5: a vertex is not finite");
        assert!(wrong("ENDSOLID\n", "").ends_with("`endsolid` is missing"));
        let mut file = binary_file(&[[f32::NAN; 12]]);
        assert_eq!(
            stl(&file).unwrap_err().to_string(),
            "m.stl: facet 0 (counted from 0) has a corner that is not finite"
        );
        file.pop();
        let said = stl(&file).unwrap_err().to_string();
        assert!(said.contains("its 1 facets would take 134 bytes, but it has 133"), "{said}");
        assert_eq!(stl(&binary_file(&[])).unwrap_err().to_string(), "m.stl: has no facets");
        assert!(stl(b"").unwrap_err().message.starts_with("is no STL file"));
    }
}
