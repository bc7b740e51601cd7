//! Wavefront OBJ meshes. tobj parses the numbers, resolves indices and cuts polygons into triangles. It is fed line by line,
//! through [`Feeder`], since it neither says on which line a mistake stands nor keeps `usemtl` names without a .mtl file or the
//! difference between `o` and `g`: whoever hands it the lines knows all three.

use std::borrow::Cow;
use std::io::{self, BufRead, Read};
use std::path::Path;

use smallvec::SmallVec;

use super::mesh::{Flaws, Labels, Mesh, Part, Place};
use crate::error::Problem;

/// Reads an OBJ file of this content; `path` stands in messages.
///
/// # Errors
/// What is wrong with it, with the line.
pub fn parse(bytes: &[u8], path: &Path) -> Result<Mesh, Box<Problem>> {
    let problem = |line: Option<usize>, message: &str| {
        Box::new(Problem { file: path.to_owned(), line, message: message.to_owned(), ..Problem::default() })
    };
    let bytes = &*with_newlines(bytes);
    let mut feeder = Feeder::new(bytes);
    // Without single_index a vertex is its position alone, so triangles share vertices across texture seams. tobj would cut
    // polygons as fans, whatever their outline.
    let options = tobj::LoadOptions { triangulate: false, ..tobj::LoadOptions::default() };
    let no_materials = |_: &Path| Err(tobj::LoadError::GenericFailure);
    let models = match tobj::load_obj_buf(&mut feeder, &options, no_materials) {
        Ok((models, _)) => models,
        Err(
            tobj::LoadError::FaceVertexOutOfBounds
            | tobj::LoadError::FaceTexCoordOutOfBounds
            | tobj::LoadError::FaceNormalOutOfBounds,
        ) => return Err(bad_index(bytes, problem)),
        Err(error) => {
            let message = feeder.refusal.take().unwrap_or_else(|| match error {
                tobj::LoadError::PositionParseError => "a vertex needs three numbers".to_owned(),
                tobj::LoadError::NormalParseError => "a normal needs three numbers".to_owned(),
                tobj::LoadError::TexcoordParseError => "texture coordinates are one to three numbers".to_owned(),
                tobj::LoadError::FaceParseError => {
                    "a face needs whole numbers such as `f 1 2 3` or `f 1/1 2/2 3/3`".to_owned()
                }
                other => other.to_string(),
            });
            return Err(problem(Some(feeder.line), &message));
        }
    };

    let mut parts = Vec::with_capacity(models.len());
    let mut polygons = Polygons::new(&feeder.polygons);
    for model in models.into_iter().filter(|model| !model.mesh.indices.is_empty()) {
        // The feeder names every model by the index of its labels.
        let (labels, line, given) =
            model.name.parse::<usize>().ok().and_then(|i| feeder.parts.get(i)).cloned().unwrap_or_default();
        let positions: Vec<[f64; 3]> = model.mesh.positions.as_chunks::<3>().0.to_vec();
        let mesh = &model.mesh;
        if mesh.positions.iter().chain(&mesh.texcoords).chain(&mesh.normals).any(|x| !x.is_finite()) {
            return Err(not_finite(bytes, problem));
        }
        // tobj has no indices where the file has no such coordinates at all.
        let missing = |indices: &[u32]| indices.len() != mesh.indices.len();
        if given.uv && missing(&mesh.texcoord_indices) || given.normals && missing(&mesh.normal_indices) {
            return Err(bad_index(bytes, problem));
        }
        let (texcoords, normals) = (mesh.texcoords.as_chunks::<2>().0, mesh.normals.as_chunks::<3>().0);
        // Places in the lists of indices.
        let cut = polygons.cut(&mesh.face_arities, &mesh.indices, &positions);
        let triangles = cut.iter().map(|corners| corners.map(|i| mesh.indices[i as usize])).collect();
        let uv = given.uv.then(|| corners(&cut, &mesh.texcoord_indices, texcoords));
        let normals = given.normals.then(|| corners(&cut, &mesh.normal_indices, normals));
        parts.push(Part { labels, place: Place::Line(line), positions, triangles, uv, normals });
    }
    if parts.is_empty() {
        return Err(problem(None, "has no faces"));
    }
    let flaws = polygons.flaws;
    Ok(Mesh { parts, without_surface: feeder.without_surface, flaws, unit: None, notes: Vec::new() })
}

/// The lines of a file whose lines end as those of old Macs do, as everybody's.
fn with_newlines(bytes: &[u8]) -> Cow<'_, [u8]> {
    if bytes.contains(&b'\n') || !bytes.contains(&b'\r') {
        return Cow::Borrowed(bytes);
    }
    bytes.iter().map(|byte| if *byte == b'\r' { b'\n' } else { *byte }).collect()
}

/// The values at the corners of triangles, which are places in `indices`.
fn corners<T: Copy>(triangles: &[[u32; 3]], indices: &[u32], values: &[T]) -> Vec<[T; 3]> {
    triangles.iter().map(|triangle| triangle.map(|i| values[indices[i as usize] as usize])).collect()
}

/// Cuts the faces of one mesh after the other.
struct Polygons<'f> {
    /// The lines of those of more than three corners that are still to come.
    lines: std::slice::Iter<'f, usize>,
    flaws: Flaws,
}

impl<'f> Polygons<'f> {
    fn new(lines: &'f [usize]) -> Self {
        Polygons { lines: lines.iter(), flaws: Flaws::default() }
    }

    /// The triangles of the faces of `arities` corners (all three where there are none), as places in `indices`.
    fn cut(&mut self, arities: &[u32], indices: &[u32], positions: &[[f64; 3]]) -> Vec<[u32; 3]> {
        if arities.is_empty() {
            return (0..indices.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        }
        let mut triangles = Vec::with_capacity(indices.len());
        let mut start = 0u32;
        for &arity in arities {
            let corners: Vec<[f64; 3]> =
                (start..start + arity).map(|i| positions[indices[i as usize] as usize]).collect();
            if arity == 3 {
                triangles.push([start, start + 1, start + 2]);
            } else if arity > 3 {
                let line = self.lines.next().copied().unwrap_or(0);
                let cut = self.flaws.cut(&corners, || Place::Line(line));
                triangles.extend(cut.iter().map(|corners| corners.map(|i| start + i)));
            }
            start += arity;
        }
        triangles
    }
}

/// Finds the first face that names what the file does not have (tobj notices it only at the end of a part).
fn bad_index(bytes: &[u8], problem: impl Fn(Option<usize>, &str) -> Box<Problem>) -> Box<Problem> {
    const KINDS: [(&str, &str, &str); 3] =
        [("v", "vertex", "vertices"), ("vt", "texture coordinate", "texture coordinates"), ("vn", "normal", "normals")];
    let kind_of = |word: &str| KINDS.iter().position(|kind| kind.0 == word);
    let mut all = [0i128; 3];
    Lines::new(bytes).filter_map(|(_, line)| kind_of(keyword(&line).0)).for_each(|kind| all[kind] += 1);
    let mut before = [0i128; 3];
    for (number, line) in Lines::new(bytes) {
        let (word, rest) = keyword(&line);
        if let Some(kind) = kind_of(word) {
            before[kind] += 1;
        }
        if word != "f" {
            continue;
        }
        for corner in without_comment(rest).split_whitespace() {
            for (kind, written) in corner.split('/').take(3).enumerate().filter(|(k, w)| *k == 0 || !w.is_empty()) {
                let (_, one, many) = KINDS[kind];
                let Ok(index) = written.parse::<i128>() else {
                    return problem(Some(number), &format!("`{corner}` names no {one}"));
                };
                let resolved = if index < 0 { before[kind] + index } else { index - 1 };
                if !(0..all[kind]).contains(&resolved) {
                    let count = all[kind];
                    let message = format!("{one} {index} does not exist: the file has {count} {many}, counted from 1");
                    return problem(Some(number), &message);
                }
            }
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
        let bad = match word {
            "v" => is_bad(without_comment(rest)),
            "vt" | "vn" => rest.split_whitespace().any(|word| word.parse().is_ok_and(|x: f64| !x.is_finite())),
            _ => false,
        };
        bad.then_some(number)
    });
    problem(line, "a vertex, normal or texture coordinate is not finite")
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
const HARMLESS: [&str; 18] = [
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

/// What every corner of a face has beside its vertex.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Given {
    uv: bool,
    normals: bool,
}

/// Hands tobj the vertices and faces line by line, and a numbered `o` before the first face of every part.
struct Feeder<'a> {
    lines: Lines<'a>,
    /// The line tobj is being given: the place of any mistake it reports.
    line: usize,
    current: String,
    offset: usize,
    labels: Labels,
    labels_changed: bool,
    given: Given,
    parts: Vec<(Labels, usize, Given)>,
    without_surface: usize,
    /// The lines of faces of more than three corners.
    polygons: Vec<usize>,
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
            given: Given::default(),
            parts: Vec::new(),
            without_surface: 0,
            polygons: Vec::new(),
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
                "vt" => self.texture_coordinates(without_comment(rest)),
                "vn" => self.current = format!("vn {}\n", without_comment(rest)),
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
                _ if HARMLESS.contains(&word) => {}
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
        self.current.push_str("v ");
        match rest.split_whitespace().nth(5) {
            None => self.current.push_str(rest),
            Some(_) => rest.split_whitespace().take(3).for_each(|word| self.current.extend([word, " "])),
        }
        self.current.push('\n');
    }

    /// Those of a curve have no v, those of a solid a third number.
    fn texture_coordinates(&mut self, rest: &str) {
        let mut words = rest.split_whitespace();
        let (u, v) = (words.next().unwrap_or(""), words.next().unwrap_or("0"));
        self.current = format!("vt {u} {v}\n");
    }

    /// A face goes on with what all its corners have.
    fn face<'c>(&mut self, rest: &'c str) -> Result<(), String> {
        let corner = |corner: &'c str| {
            let mut words = corner.splitn(3, '/');
            std::array::from_fn(|_| words.next().unwrap_or(""))
        };
        let corners: SmallVec<[[&str; 3]; 4]> = rest.split_whitespace().map(corner).collect();
        if corners.len() < 3 {
            return Err(format!("a face needs at least 3 vertices, but has {}", corners.len()));
        }
        if corners.len() > 3 {
            self.polygons.push(self.line);
        }
        let all = |place: usize| corners.iter().all(|corner| !corner[place].is_empty());
        let given = Given { uv: all(1), normals: all(2) };
        if self.labels_changed || self.given != given {
            (self.labels_changed, self.given) = (false, given);
            self.current.push_str(&format!("o {}\n", self.parts.len()));
            self.parts.push((self.labels.clone(), self.line, given));
        }
        self.current.push('f');
        for [v, vt, vn] in corners {
            // What not all corners have is left out, but for mistakes, which tobj reports.
            let kept = |word: &'c str, all: bool| {
                if all || !word.is_empty() && word.parse::<isize>().is_err() { word } else { "" }
            };
            self.current.extend([" ", v, "/", kept(vt, given.uv), "/", kept(vn, given.normals)]);
        }
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
mod tests;
