//! PLY meshes (the Stanford triangle format, version 1.0): text, and binary in both byte orders. Read here rather than by a crate:
//! those that there are refuse numbers such as `1.`, or do not know at which byte a mistake stands.

mod header;

use std::path::Path;

use self::header::{Element, Encoding, Header, Property, Scalar};
use super::mesh::{Flaws, Mesh, Part, Place};
use crate::error::Problem;

/// Reads a PLY file of this content; `path` stands in messages. Corners of faces are `vertex_indices` or `vertex_index`; normals
/// `nx`, `ny`, `nz`; texture coordinates `u`, `v` or `s`, `t` of vertices, with `texture_` before them or not, or the list
/// `texcoord` of faces, which wins. Other properties say nothing of a surface's place.
///
/// # Errors
/// What is wrong, with the line of what is text and the byte of what is not.
pub fn parse(bytes: &[u8], path: &Path) -> Result<Mesh, Box<Problem>> {
    let problem = |(place, message): Mistake| {
        let (line, message) = match place {
            At::Line(line) => (Some(line), message),
            At::Byte(byte) => (None, format!("at byte {byte}: {message}")),
            At::File => (None, message),
        };
        Box::new(Problem { file: path.to_owned(), line, message, ..Problem::default() })
    };
    let header = header::parse(bytes).map_err(|(line, message)| problem((At::Line(line), message)))?;
    let mut body = Body::default();
    let rest = &bytes[header.body..];
    let read = match header.encoding {
        Encoding::Text => body.read(&header, Text { rest, line: header.lines, words: &[] }),
        Encoding::LittleEndian | Encoding::BigEndian => {
            let big = header.encoding == Encoding::BigEndian;
            body.read(&header, Binary { bytes, at: header.body, big })
        }
    };
    read.and_then(|()| body.mesh()).map_err(problem)
}

/// Where a mistake is.
#[derive(Debug, Clone, Copy, PartialEq)]
enum At {
    File,
    Line(usize),
    Byte(usize),
}

type Mistake = (At, String);

/// What a body is read from, element by element.
trait Source {
    /// Bytes that there are still.
    fn left(&self) -> usize;
    /// The least bytes that a value takes.
    fn least(scalar: Scalar) -> usize;
    fn place(&self) -> At;
    /// Of the element that is about to be read, number `index` of its kind.
    fn of_element(&self, index: usize) -> Place;
    fn begin(&mut self) -> Result<(), Mistake>;
    fn number(&mut self, scalar: Scalar) -> Result<f64, Mistake>;
    fn skip(&mut self, scalar: Scalar, count: usize) -> Result<(), Mistake>;
    fn end(&mut self) -> Result<(), Mistake>;
}

/// One line an element.
struct Text<'a> {
    rest: &'a [u8],
    /// Lines before `rest`.
    line: usize,
    words: &'a [u8],
}

impl<'a> Text<'a> {
    fn word(&mut self) -> Result<&'a [u8], Mistake> {
        self.words = self.words.trim_ascii_start();
        let end = self.words.iter().position(u8::is_ascii_whitespace).unwrap_or(self.words.len());
        let (word, rest) = self.words.split_at(end);
        self.words = rest;
        if word.is_empty() {
            return Err((self.place(), "has fewer numbers than the header says".to_owned()));
        }
        Ok(word)
    }
}

impl Source for Text<'_> {
    fn left(&self) -> usize {
        // The last line need not end.
        self.rest.len() + 1
    }

    fn least(_: Scalar) -> usize {
        // A digit and what ends it.
        2
    }

    fn place(&self) -> At {
        At::Line(self.line)
    }

    fn of_element(&self, _: usize) -> Place {
        Place::Line(self.line)
    }

    fn begin(&mut self) -> Result<(), Mistake> {
        loop {
            if self.rest.is_empty() {
                return Err((At::File, "ends before all elements that its header tells of".to_owned()));
            }
            let end = self.rest.iter().position(|byte| matches!(byte, b'\n' | b'\r')).unwrap_or(self.rest.len());
            self.words = &self.rest[..end];
            let after = &self.rest[end..];
            let ending = if after.starts_with(b"\r\n") { 2 } else { after.len().min(1) };
            self.rest = &after[ending..];
            self.line += 1;
            if !self.words.trim_ascii().is_empty() {
                return Ok(());
            }
        }
    }

    fn number(&mut self, _: Scalar) -> Result<f64, Mistake> {
        let word = self.word()?;
        let number = std::str::from_utf8(word).ok().and_then(|word| word.parse::<f64>().ok());
        number.ok_or_else(|| {
            let word: String = String::from_utf8_lossy(word).chars().take(20).collect();
            (self.place(), format!("`{}` is not a number", word.escape_debug()))
        })
    }

    fn skip(&mut self, _: Scalar, count: usize) -> Result<(), Mistake> {
        (0..count).try_for_each(|_| self.word().map(|_| ()))
    }

    fn end(&mut self) -> Result<(), Mistake> {
        if self.words.trim_ascii().is_empty() {
            return Ok(());
        }
        Err((self.place(), "has more numbers than the header says".to_owned()))
    }
}

/// Values one after the other.
struct Binary<'a> {
    bytes: &'a [u8],
    at: usize,
    big: bool,
}

impl Binary<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], Mistake> {
        let Some(bytes) = self.bytes[self.at..].first_chunk::<N>() else { return self.ends() };
        self.at += N;
        let mut bytes = *bytes;
        if self.big {
            bytes.reverse();
        }
        Ok(bytes)
    }

    fn ends<T>(&self) -> Result<T, Mistake> {
        Err((At::Byte(self.at), "the file ends before all elements that its header tells of".to_owned()))
    }
}

impl Source for Binary<'_> {
    fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    fn least(scalar: Scalar) -> usize {
        scalar.size()
    }

    fn place(&self) -> At {
        At::Byte(self.at)
    }

    fn of_element(&self, index: usize) -> Place {
        Place::Face(index)
    }

    fn begin(&mut self) -> Result<(), Mistake> {
        Ok(())
    }

    fn number(&mut self, scalar: Scalar) -> Result<f64, Mistake> {
        Ok(match scalar {
            Scalar::I8 => f64::from(i8::from_le_bytes(self.take()?)),
            Scalar::U8 => f64::from(u8::from_le_bytes(self.take()?)),
            Scalar::I16 => f64::from(i16::from_le_bytes(self.take()?)),
            Scalar::U16 => f64::from(u16::from_le_bytes(self.take()?)),
            Scalar::I32 => f64::from(i32::from_le_bytes(self.take()?)),
            Scalar::U32 => f64::from(u32::from_le_bytes(self.take()?)),
            Scalar::F32 => f64::from(f32::from_le_bytes(self.take()?)),
            Scalar::F64 => f64::from_le_bytes(self.take()?),
        })
    }

    fn skip(&mut self, scalar: Scalar, count: usize) -> Result<(), Mistake> {
        match scalar.size().checked_mul(count).filter(|bytes| *bytes <= self.left()) {
            Some(bytes) => self.at += bytes,
            None => return self.ends(),
        }
        Ok(())
    }

    fn end(&mut self) -> Result<(), Mistake> {
        Ok(())
    }
}

/// What a property means.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Role {
    Position(usize),
    Normal(usize),
    Uv(usize),
    /// The list of a face's vertices.
    Corners,
    /// The list of (u, v) at a face's corners.
    CornerUv,
    None,
}

fn role(element: &str, property: &Property) -> Role {
    let name = property.name.as_str();
    match (element, property.length.is_some()) {
        ("vertex", false) => match name {
            "x" | "y" | "z" => Role::Position(usize::from(name.as_bytes()[0] - b'x')),
            "nx" | "ny" | "nz" => Role::Normal(usize::from(name.as_bytes()[1] - b'x')),
            "u" | "s" | "texture_u" | "texture_s" => Role::Uv(0),
            "v" | "t" | "texture_v" | "texture_t" => Role::Uv(1),
            _ => Role::None,
        },
        ("face", true) => match name {
            "vertex_indices" | "vertex_index" => Role::Corners,
            "texcoord" => Role::CornerUv,
            _ => Role::None,
        },
        _ => Role::None,
    }
}

/// What has been read of the elements.
#[derive(Default)]
struct Body {
    positions: Vec<[f64; 3]>,
    normals: Option<Vec<[f64; 3]>>,
    uv: Option<Vec<[f64; 2]>>,
    /// The vertices of all faces, one after the other, how many of them each face has, and where it stands.
    corners: Vec<u32>,
    faces: Vec<Face>,
    /// Of the faces that have them: (u, v) at each corner.
    corner_uv: Vec<[f64; 2]>,
    first_line: usize,
    is_text: bool,
    without_surface: usize,
    notes: Vec<String>,
}

#[derive(Clone, Copy)]
struct Face {
    corners: u32,
    /// After the first of them, for text; faces are dense, but for blank lines.
    line: u32,
    has_uv: bool,
}

impl Body {
    fn read<S: Source>(&mut self, header: &Header, mut source: S) -> Result<(), Mistake> {
        for element in &header.elements {
            let roles: Vec<Role> = element.properties.iter().map(|property| role(&element.name, property)).collect();
            self.check(element, &roles, &source)?;
            match element.name.as_str() {
                "vertex" => self.vertices(element, &roles, &mut source)?,
                "face" => self.read_faces(element, &roles, &mut source)?,
                _ => {
                    if element.name == "edge" {
                        self.without_surface += element.count;
                    } else if element.count > 0 {
                        self.notes.push(format!("elements \"{}\" are left out", element.name));
                    }
                    skip(element, &mut source)?;
                }
            }
        }
        Ok(())
    }

    /// Whether an element is what it should be, and the file has room for as many as it states.
    fn check<S: Source>(&self, element: &Element, roles: &[Role], source: &S) -> Result<(), Mistake> {
        let at = At::Line(element.line);
        let least: usize =
            element.properties.iter().map(|property| S::least(property.length.unwrap_or(property.scalar))).sum();
        if element.count > 0 && (source.left() / element.count.max(1)) < least {
            let message =
                format!("there are to be {} elements \"{}\", but the file ends before", element.count, element.name);
            return Err((at, message));
        }
        let has = |wanted: &[Role]| wanted.iter().filter(|role| roles.contains(role)).count();
        let axes = |role: fn(usize) -> Role| has(&[role(0), role(1), role(2)]);
        match element.name.as_str() {
            "vertex" if axes(Role::Position) < 3 => Err((at, "vertices need properties x, y and z".to_owned())),
            "vertex" if ![0, 3].contains(&axes(Role::Normal)) => {
                Err((at, "normals need all of nx, ny and nz".to_owned()))
            }
            "vertex" if has(&[Role::Uv(0), Role::Uv(1)]) == 1 => {
                Err((at, "texture coordinates need both u and v, or s and t".to_owned()))
            }
            "face" if element.count > 0 && has(&[Role::Corners]) == 0 => {
                Err((at, "faces need a list `vertex_indices` or `vertex_index`".to_owned()))
            }
            "vertex" | "face" if roles.iter().enumerate().any(|(i, r)| *r != Role::None && roles[..i].contains(r)) => {
                Err((at, "two properties mean the same".to_owned()))
            }
            "tristrips" if element.count > 0 => Err((at, "triangle strips are not supported: export faces".to_owned())),
            _ => Ok(()),
        }
    }

    fn vertices<S: Source>(&mut self, element: &Element, roles: &[Role], source: &mut S) -> Result<(), Mistake> {
        let has = |role: Role| roles.contains(&role);
        let mut normals = has(Role::Normal(0)).then(Vec::new);
        let mut uvs = has(Role::Uv(0)).then(Vec::new);
        self.positions.reserve_exact(element.count);
        normals.iter_mut().for_each(|normals| normals.reserve_exact(element.count));
        uvs.iter_mut().for_each(|uvs| uvs.reserve_exact(element.count));
        for _ in 0..element.count {
            source.begin()?;
            let place = source.place();
            let (mut position, mut normal, mut uv) = ([0.0; 3], [0.0; 3], [0.0; 2]);
            for (property, role) in element.properties.iter().zip(roles) {
                match *role {
                    Role::Position(axis) => position[axis] = source.number(property.scalar)?,
                    Role::Normal(axis) => normal[axis] = source.number(property.scalar)?,
                    Role::Uv(axis) => uv[axis] = source.number(property.scalar)?,
                    _ => skip_property(property, source)?,
                }
            }
            source.end()?;
            if position.iter().chain(&normal).chain(&uv).any(|x| !x.is_finite()) {
                return Err((place, "a vertex, normal or texture coordinate is not finite".to_owned()));
            }
            self.positions.push(position);
            normals.iter_mut().for_each(|normals| normals.push(normal));
            uvs.iter_mut().for_each(|uvs| uvs.push(uv));
        }
        (self.normals, self.uv) = (normals, uvs);
        Ok(())
    }

    fn read_faces<S: Source>(&mut self, element: &Element, roles: &[Role], source: &mut S) -> Result<(), Mistake> {
        self.faces.reserve_exact(element.count);
        let mut uv: Vec<f64> = Vec::new();
        for index in 0..element.count {
            source.begin()?;
            if index == 0 {
                let line = source.of_element(0).line();
                (self.is_text, self.first_line) = (line.is_some(), line.unwrap_or(0));
            }
            let line = source.of_element(index).line().map_or(0, |line| line - self.first_line);
            let place = source.place();
            let first = self.corners.len();
            uv.clear();
            for (property, role) in element.properties.iter().zip(roles) {
                match (role, property.length) {
                    (Role::Corners, Some(length)) => {
                        for _ in 0..list_length(length, source)? {
                            let vertex = source.number(property.scalar)?;
                            let vertex = whole(vertex).and_then(|vertex| u32::try_from(vertex).ok());
                            self.corners.push(vertex.ok_or_else(|| {
                                (source.place(), "a face names a vertex by something that is no index".to_owned())
                            })?);
                        }
                    }
                    (Role::CornerUv, Some(length)) => {
                        for _ in 0..list_length(length, source)? {
                            uv.push(source.number(property.scalar)?);
                        }
                    }
                    _ => skip_property(property, source)?,
                }
            }
            source.end()?;
            let corners = self.corners.len() - first;
            let has_uv = !uv.is_empty();
            if has_uv && uv.len() != 2 * corners {
                let message =
                    format!("a face of {corners} corners has {} numbers of `texcoord`, not two each", uv.len());
                return Err((place, message));
            }
            if uv.iter().any(|x| !x.is_finite()) {
                return Err((place, "a texture coordinate is not finite".to_owned()));
            }
            self.corner_uv.extend(uv.as_chunks::<2>().0);
            let face = u32::try_from(corners).ok().zip(u32::try_from(line).ok());
            let (corners, line) = face.ok_or_else(|| (place, "the file is too long".to_owned()))?;
            self.faces.push(Face { corners, line, has_uv });
        }
        Ok(())
    }

    fn place(&self, face: usize) -> Place {
        if self.is_text { Place::Line(self.first_line + self.faces[face].line as usize) } else { Place::Face(face) }
    }

    /// Cuts faces into triangles: those with texture coordinates of their own are a part, the others another.
    fn mesh(mut self) -> Result<Mesh, Mistake> {
        let mut mesh = Mesh { without_surface: self.without_surface, notes: self.notes.clone(), ..Mesh::default() };
        for own_uv in [false, true] {
            let Some(begin) = self.faces.iter().position(|face| face.has_uv == own_uv && face.corners > 2) else {
                continue;
            };
            let part = self.part(own_uv, self.place(begin), &mut mesh.flaws)?;
            mesh.parts.push(part);
        }
        if let [others @ .., last] = &mut mesh.parts[..] {
            others.iter_mut().for_each(|part| part.positions = self.positions.clone());
            last.positions = std::mem::take(&mut self.positions);
        }
        mesh.without_surface += self.faces.iter().filter(|face| face.corners < 3).count();
        if mesh.parts.is_empty() {
            return Err((At::File, "has no faces".to_owned()));
        }
        Ok(mesh)
    }

    /// All but the positions.
    fn part(&self, own_uv: bool, place: Place, flaws: &mut Flaws) -> Result<Part, Mistake> {
        let mut triangles: Vec<[u32; 3]> = Vec::with_capacity(self.faces.len());
        let mut uv = (own_uv || self.uv.is_some()).then(Vec::new);
        let (mut first, mut first_uv) = (0, 0);
        for (index, face) in self.faces.iter().enumerate() {
            let count = face.corners as usize;
            let corners = &self.corners[first..first + count];
            let own = if face.has_uv { &self.corner_uv[first_uv..first_uv + count] } else { &[] };
            first += count;
            first_uv += own.len();
            if face.has_uv != own_uv || count < 3 {
                continue;
            }
            if let Some(vertex) = corners.iter().find(|vertex| **vertex as usize >= self.positions.len()) {
                let message = format!(
                    "face {index} names vertex {vertex}, but the file has {} vertices, counted from 0",
                    self.positions.len()
                );
                let at = self.place(index).line().map_or(At::File, At::Line);
                return Err((at, message));
            }
            let mut push = |cut: [u32; 3]| {
                triangles.push(cut.map(|corner| corners[corner as usize]));
                match (&mut uv, &self.uv) {
                    (Some(uv), _) if own_uv => uv.push(cut.map(|corner| own[corner as usize])),
                    (Some(uv), Some(all)) => uv.push(cut.map(|corner| all[corners[corner as usize] as usize])),
                    _ => {}
                }
            };
            if count == 3 {
                push([0, 1, 2]);
            } else {
                let outline: Vec<[f64; 3]> = corners.iter().map(|vertex| self.positions[*vertex as usize]).collect();
                flaws.cut(&outline, || self.place(index)).into_iter().for_each(push);
            }
        }
        let of = |all: &Vec<[f64; 3]>| triangles.iter().map(|t| t.map(|vertex| all[vertex as usize])).collect();
        let normals = self.normals.as_ref().map(of);
        Ok(Part { place, triangles, uv, normals, ..Part::default() })
    }
}

fn whole(value: f64) -> Option<u64> {
    (value >= 0.0 && value.fract() == 0.0 && value < 1e15).then_some(value as u64)
}

/// How long the list is that begins here.
fn list_length<S: Source>(length: Scalar, source: &mut S) -> Result<usize, Mistake> {
    let number = source.number(length)?;
    let length = whole(number).and_then(|length| usize::try_from(length).ok());
    length.ok_or_else(|| (source.place(), format!("a list has {number} elements")))
}

fn skip_property<S: Source>(property: &Property, source: &mut S) -> Result<(), Mistake> {
    let count = match property.length {
        Some(length) => list_length(length, source)?,
        None => 1,
    };
    source.skip(property.scalar, count)
}

/// Passes over elements, which without properties are nothing.
fn skip<S: Source>(element: &Element, source: &mut S) -> Result<(), Mistake> {
    if element.properties.is_empty() {
        return Ok(());
    }
    for _ in 0..element.count {
        source.begin()?;
        element.properties.iter().try_for_each(|property| skip_property(property, source))?;
        source.end()?;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
