//! Wavefront OBJ meshes. tobj parses the numbers, resolves indices and cuts polygons into triangles; the lines it
//! reads come through [`Feeder`], which knows what tobj does not keep: line numbers, `usemtl` names without a .mtl
//! file, and the difference between `o` and `g`.

use std::borrow::Cow;
use std::io::{self, BufRead, Read};
use std::path::Path;

use crate::error::Problem;

/// The triangles of one run of faces under the same `o`, `g` and `usemtl`.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    pub labels: Labels,
    /// The line of the first face, 1-based.
    pub line: usize,
    pub positions: Vec<[f64; 3]>,
    /// Indices into `positions`; counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
}

/// What a face stands under.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Labels {
    pub object: Option<String>,
    /// The names of the `g` line, as written; one name or several separated by blanks.
    pub group: Option<String>,
    pub material: Option<String>,
}

impl Labels {
    /// Whether `name` picks this part: its object, its whole group line, or one of the groups on it.
    pub fn in_group(&self, name: &str) -> bool {
        self.object.as_deref() == Some(name)
            || self.group.as_deref().is_some_and(|g| g == name || g.split_whitespace().any(|word| word == name))
    }
}

/// An OBJ file.
#[derive(Debug, Clone, PartialEq)]
pub struct Obj {
    pub parts: Vec<Part>,
    pub has_normals: bool,
    /// Point and line elements, which have no surface.
    pub without_surface: usize,
}

/// Reads the file at `path`. Errors name the line; without one, the file as a whole could not be read.
pub fn read(path: &Path) -> Result<Obj, Box<Problem>> {
    let bytes = std::fs::read(path).map_err(|e| {
        Box::new(Problem { file: path.to_owned(), message: format!("cannot be read: {e}"), ..Problem::default() })
    })?;
    parse(&bytes, path)
}

/// [`read`] on the content of the file; `path` stands in messages.
pub fn parse(bytes: &[u8], path: &Path) -> Result<Obj, Box<Problem>> {
    let problem = |line: Option<usize>, message: &str| {
        Box::new(Problem { file: path.to_owned(), line, message: message.to_owned(), ..Problem::default() })
    };
    let mut feeder = Feeder::new(bytes);
    // Without single_index a vertex is its position alone, so triangles share vertices across texture seams.
    let options = tobj::LoadOptions { triangulate: true, ..tobj::LoadOptions::default() };
    let no_materials = |_: &Path| Err(tobj::LoadError::GenericFailure);
    let models = match tobj::load_obj_buf(&mut feeder, &options, no_materials) {
        Ok((models, _)) => models,
        Err(tobj::LoadError::FaceVertexOutOfBounds) => return Err(bad_index(bytes, problem)),
        Err(error) => {
            let message = feeder.refusal.take().unwrap_or_else(|| match error {
                tobj::LoadError::PositionParseError => "a vertex needs three numbers".to_owned(),
                tobj::LoadError::FaceParseError => {
                    "a face needs whole numbers such as `f 1 2 3` or `f 1/1 2/2 3/3`".to_owned()
                }
                other => other.to_string(),
            });
            return Err(problem(Some(feeder.line), &message));
        }
    };

    let mut parts = Vec::with_capacity(models.len());
    for model in models.into_iter().filter(|model| !model.mesh.indices.is_empty()) {
        // The feeder names every model by the index of its labels.
        let (labels, line) =
            model.name.parse::<usize>().ok().and_then(|i| feeder.parts.get(i)).cloned().unwrap_or_default();
        let positions: Vec<[f64; 3]> = model.mesh.positions.as_chunks::<3>().0.to_vec();
        if positions.iter().flatten().any(|x| !x.is_finite()) {
            return Err(not_finite(bytes, problem));
        }
        parts.push(Part { labels, line, positions, triangles: model.mesh.indices.as_chunks::<3>().0.to_vec() });
    }
    if parts.is_empty() {
        return Err(problem(None, "has no faces"));
    }
    Ok(Obj { parts, has_normals: feeder.has_normals, without_surface: feeder.without_surface })
}

/// Finds the first face that names a vertex the file does not have (tobj notices it only at the end of a part).
fn bad_index(bytes: &[u8], problem: impl Fn(Option<usize>, &str) -> Box<Problem>) -> Box<Problem> {
    let vertices = Lines::new(bytes).filter(|(_, line)| keyword(line).0 == "v").count() as i128;
    let mut before = 0;
    for (number, line) in Lines::new(bytes) {
        match keyword(&line) {
            ("v", _) => before += 1,
            ("f", rest) => {
                for corner in without_comment(rest).split_whitespace() {
                    let written = corner.split('/').next().unwrap_or("");
                    let Ok(index) = written.parse::<i128>() else {
                        return problem(Some(number), &format!("`{corner}` names no vertex"));
                    };
                    let resolved = if index < 0 { before + index } else { index - 1 };
                    if !(0..vertices).contains(&resolved) {
                        let message =
                            format!("vertex {index} does not exist: the file has {vertices} vertices, counted from 1");
                        return problem(Some(number), &message);
                    }
                }
            }
            _ => {}
        }
    }
    problem(None, "a face names a vertex that does not exist")
}

fn not_finite(bytes: &[u8], problem: impl Fn(Option<usize>, &str) -> Box<Problem>) -> Box<Problem> {
    let is_bad = |rest: &str| {
        let numbers: Vec<f64> = rest.split_whitespace().take(4).filter_map(|word| word.parse().ok()).collect();
        // A fourth number divides the first three.
        numbers.iter().any(|x| !x.is_finite())
            || (numbers.len() == 4 && numbers[..3].iter().any(|x| !(x / numbers[3]).is_finite()))
    };
    let line = Lines::new(bytes).find_map(|(number, line)| {
        let (word, rest) = keyword(&line);
        (word == "v" && is_bad(without_comment(rest))).then_some(number)
    });
    problem(line, "a vertex is not finite")
}

/// First word and the rest of a line.
fn keyword(line: &str) -> (&str, &str) {
    let line = line.trim();
    line.split_once(char::is_whitespace).map_or((line, ""), |(word, rest)| (word, rest.trim()))
}

fn without_comment(text: &str) -> &str {
    text.split('#').next().unwrap_or("").trim_end()
}

/// Logical lines (a `\` at the end joins the next one) with the number of their first line.
struct Lines<'a> {
    rest: &'a [u8],
    next: usize,
}

impl<'a> Lines<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        Lines { rest: bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), next: 1 }
    }

    fn physical(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.iter().position(|&b| b == b'\n');
        let (line, rest) = end.map_or((self.rest, &[][..]), |end| (&self.rest[..end], &self.rest[end + 1..]));
        self.rest = rest;
        self.next += 1;
        Some(line.strip_suffix(b"\r").unwrap_or(line))
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (usize, Cow<'a, str>);

    fn next(&mut self) -> Option<Self::Item> {
        let number = self.next;
        let line = self.physical()?;
        let Some(mut head) = line.strip_suffix(b"\\") else {
            return Some((number, String::from_utf8_lossy(line)));
        };
        let mut joined = Vec::new();
        loop {
            joined.extend_from_slice(head);
            joined.push(b' ');
            let Some(line) = self.physical() else { break };
            match line.strip_suffix(b"\\") {
                Some(more) => head = more,
                None => {
                    joined.extend_from_slice(line);
                    break;
                }
            }
        }
        Some((number, Cow::Owned(String::from_utf8_lossy(&joined).into_owned())))
    }
}

/// Statements without influence on where a surface is.
const HARMLESS: [&str; 20] = [
    "vt",
    "vn",
    "vp",
    "s",
    "mg",
    "mtllib",
    "maplib",
    "usemap",
    "lod",
    "bevel",
    "c_interp",
    "d_interp",
    "shadow_obj",
    "trace_obj",
    "cstype",
    "deg",
    "bmat",
    "step",
    "parm",
    "end",
];

/// Hands tobj the vertices and faces line by line, and a numbered `o` before the first face of every part.
struct Feeder<'a> {
    lines: Lines<'a>,
    /// The line tobj is being given: the place of any mistake it reports.
    line: usize,
    current: String,
    offset: usize,
    labels: Labels,
    labels_changed: bool,
    parts: Vec<(Labels, usize)>,
    has_normals: bool,
    without_surface: usize,
    /// What the feeder itself found wrong with `line`.
    refusal: Option<String>,
}

impl<'a> Feeder<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        Feeder {
            lines: Lines::new(bytes),
            line: 0,
            current: String::new(),
            offset: 0,
            labels: Labels::default(),
            labels_changed: true,
            parts: Vec::new(),
            has_normals: false,
            without_surface: 0,
            refusal: None,
        }
    }

    /// Puts the next line meant for tobj into `current`; leaves it empty at the end.
    fn advance(&mut self) -> Result<(), String> {
        self.current.clear();
        self.offset = 0;
        while self.current.is_empty() {
            let Some((number, line)) = self.lines.next() else { return Ok(()) };
            self.line = number;
            let (word, rest) = keyword(&line);
            let name = || (!rest.is_empty()).then(|| rest.to_owned());
            match word {
                "v" => self.vertex(without_comment(rest)),
                "f" => self.face(without_comment(rest))?,
                "o" => self.relabel(|labels| labels.object = name()),
                "g" => self.relabel(|labels| labels.group = name()),
                "usemtl" if rest.is_empty() => return Err("`usemtl` needs a name".to_owned()),
                "usemtl" => self.relabel(|labels| labels.material = name()),
                "l" | "p" => self.without_surface += 1,
                "curv" | "curv2" | "surf" => {
                    return Err(format!("free-form geometry (`{word}`) is not supported: export polygons"));
                }
                _ if word.is_empty() || word.starts_with('#') => {}
                _ if HARMLESS.contains(&word) => self.has_normals |= word == "vn",
                _ => {
                    return Err(format!(
                        "`{}` is not an OBJ statement",
                        word.chars().take(20).collect::<String>().escape_debug()
                    ));
                }
            }
        }
        Ok(())
    }

    /// A fourth number is a weight; six are a position and a colour, of which only the position counts here.
    fn vertex(&mut self, rest: &str) {
        self.current.push('v');
        let keep = if rest.split_whitespace().nth(5).is_some() { 3 } else { usize::MAX };
        for word in rest.split_whitespace().take(keep) {
            self.current.push(' ');
            self.current.push_str(word);
        }
        self.current.push('\n');
    }

    fn face(&mut self, rest: &str) -> Result<(), String> {
        let corners = rest.split_whitespace().count();
        if corners < 3 {
            return Err(format!("a face needs at least 3 vertices, but has {corners}"));
        }
        if self.labels_changed {
            self.labels_changed = false;
            self.current.push_str(&format!("o {}\n", self.parts.len()));
            self.parts.push((self.labels.clone(), self.line));
        }
        self.current.push_str("f ");
        self.current.push_str(rest);
        self.current.push('\n');
        Ok(())
    }

    fn relabel(&mut self, change: impl FnOnce(&mut Labels)) {
        change(&mut self.labels);
        self.labels_changed = true;
    }
}

impl BufRead for Feeder<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.offset == self.current.len() {
            self.advance().map_err(|refusal| {
                self.refusal = Some(refusal);
                io::Error::other("refused")
            })?;
        }
        Ok(&self.current.as_bytes()[self.offset..])
    }

    fn consume(&mut self, amount: usize) {
        self.offset += amount;
    }
}

impl Read for Feeder<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let available = self.fill_buf()?;
        let count = available.len().min(out.len());
        out[..count].copy_from_slice(&available[..count]);
        self.consume(count);
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn obj(text: &str) -> Result<Obj, Box<Problem>> {
        parse(text.as_bytes(), Path::new("m.obj"))
    }

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    #[test]
    fn polygons_become_fans() {
        let mesh = obj(&format!("{SQUARE}f 1/1/1 2//1 3/2 -1 # four\n")).unwrap();
        assert_eq!(mesh.parts.len(), 1);
        assert_eq!(mesh.parts[0].positions, [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]]);
        assert_eq!(mesh.parts[0].triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.parts[0].labels, Labels::default());
        let pentagon = obj("v 0 0 0\nv 2 0 0\nv 3 1 0\nv 1 2 0\nv -1 1 0\nf 1 2 3 4 5").unwrap();
        assert_eq!(pentagon.parts[0].triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
    }

    #[test]
    fn parts_carry_object_group_and_material() {
        let text = format!(
            "mtllib missing.mtl\no house\n{SQUARE}vn 0 0 1\nusemtl brick wall\nf 1 2 3\nf 1 3 4\ng roof left\nf 1 2 4\nusemtl tile\ng\nf 2 3 4\n"
        );
        let mesh = obj(&text).unwrap();
        assert!(mesh.has_normals);
        let found: Vec<_> = mesh
            .parts
            .iter()
            .map(|p| {
                (
                    p.labels.object.as_deref(),
                    p.labels.group.as_deref(),
                    p.labels.material.as_deref(),
                    p.line,
                    p.triangles.len(),
                )
            })
            .collect();
        assert_eq!(
            found,
            [
                (Some("house"), None, Some("brick wall"), 9, 2),
                (Some("house"), Some("roof left"), Some("brick wall"), 12, 1),
                (Some("house"), None, Some("tile"), 15, 1),
            ]
        );
        let roof = &mesh.parts[1].labels;
        assert!(roof.in_group("house") && roof.in_group("roof") && roof.in_group("left") && roof.in_group("roof left"));
        assert!(!roof.in_group("brick wall") && !mesh.parts[0].labels.in_group("roof"));
    }

    #[test]
    fn vertices_keep_their_f64_bits_and_extras_are_understood() {
        let mesh = obj("v 0.1 1e-9 1234567.1234567\nv 2 4 6 2\nv 1 1 1 0.5 0.5 0.5\nf 1 \\\n 2 3\nl 1 2\n").unwrap();
        assert_eq!(mesh.parts[0].positions, [[0.1, 1e-9, 1234567.1234567], [1., 2., 3.], [1., 1., 1.]]);
        assert_eq!(mesh.without_surface, 1);
    }

    #[test]
    fn mistakes_name_their_line() {
        for (text, line, words) in [
            ("", None, "no faces"),
            ("v 0 0 0\n", None, "no faces"),
            ("v 0 0 0\nv 1 0\nv 0 1 0\nf 1 2 3", Some(2), "three numbers"),
            ("v 0 0 0\nv 1 0 x\nv 0 1 0\nf 1 2 3", Some(2), "three numbers"),
            ("v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3", Some(2), "not finite"),
            ("v 0 0 0\nv 1 0 0\nv 0 1e999 0\nf 1 2 3", Some(3), "not finite"),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\n\nf 1 2 4\nf 1 2 3", Some(5), "vertex 4 does not exist"),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 2 3", Some(4), "vertex 0"),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -4 2 3", Some(4), "vertex -4"),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2", Some(4), "at least 3"),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf", Some(4), "at least 3"),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 c", Some(4), "whole numbers"),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 /3", Some(4), "names no vertex"),
            ("v 0 0 0\nusemtl\n", Some(2), "needs a name"),
            ("surf 0 1 0 1 1 2\n", Some(1), "free-form"),
            ("PK\u{3}\u{4}binary", Some(1), "not an OBJ statement"),
        ] {
            let problem = obj(text).unwrap_err();
            assert_eq!(problem.line, line, "{text:?}: {problem}");
            assert!(problem.message.contains(words), "{text:?}: {problem}");
        }
    }
}
