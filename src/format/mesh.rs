//! Triangle meshes, whatever file they come from: the one type that `obj`, `ply`, `stl` and `gltf` fill.

use std::fmt;
use std::path::Path;

use super::polygon::{self, Outline};
use super::{obj, ply, stl};
use crate::error::Problem;

/// The triangles of a file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// At least one, each with at least one triangle.
    pub parts: Vec<Part>,
    /// Point and line elements, which have no surface.
    pub without_surface: usize,
    pub flaws: Flaws,
    /// What it says in a comment of its lengths, where that is not the metre.
    pub unit: Option<String>,
    /// What else is to be said of the file, a sentence each.
    pub notes: Vec<String>,
}

/// Triangles under the same labels whose corners are given alike.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Part {
    pub labels: Labels,
    /// Where it begins.
    pub place: Place,
    pub positions: Vec<[f64; 3]>,
    /// Indices into `positions`; counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// (u, v) at the corners of each triangle, v upward, where all its faces have them.
    pub uv: Option<Vec<[[f64; 2]; 3]>>,
    /// Normals at the corners of each triangle, of any length, where all its faces have them.
    pub normals: Option<Vec<[[f64; 3]; 3]>>,
}

/// What a face stands under.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Labels {
    /// An OBJ's `o`, an STL's solid, a glTF's node.
    pub object: Option<String>,
    /// The names of an OBJ's `g` line, as written; one name or several separated by blanks.
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

/// A place in a file, as exactly as its format has places.
#[derive(Debug, Clone, Default, PartialEq)]
pub enum Place {
    #[default]
    File,
    /// 1-based.
    Line(usize),
    /// Of a binary file, counted from 0 as its indices are.
    Face(usize),
    /// A path of JSON, such as `meshes[0].primitives[1]`.
    Json(String),
}

impl Place {
    /// The line, for [`Problem::line`].
    pub fn line(&self) -> Option<usize> {
        match self {
            Place::Line(line) => Some(*line),
            _ => None,
        }
    }

    /// `on line 5`, `at face 12`.
    pub fn on(&self) -> String {
        match self {
            Place::Line(_) => format!("on {self}"),
            Place::Face(_) => format!("at {self}"),
            Place::File | Place::Json(_) => format!("in {self}"),
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::File => write!(f, "the file"),
            Place::Line(line) => write!(f, "line {line}"),
            Place::Face(face) => write!(f, "face {face}"),
            Place::Json(path) => write!(f, "`{path}`"),
        }
    }
}

/// Polygons that are not what they should be: how many, and where the first is.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Flaws {
    /// Their corners do not lie in one plane.
    pub bent: Option<(usize, Place)>,
    /// Their outline crosses itself.
    pub crossing: Option<(usize, Place)>,
}

impl Flaws {
    /// Cuts a polygon of more than three corners, as places in `corners`, and keeps what is wrong with it.
    pub fn cut(&mut self, corners: &[[f64; 3]], place: impl Fn() -> Place) -> Vec<[u32; 3]> {
        let Outline { triangles, bent, crossing } = polygon::cut(corners);
        for (found, kind) in [(bent, &mut self.bent), (crossing, &mut self.crossing)] {
            if found {
                kind.get_or_insert_with(|| (0, place())).0 += 1;
            }
        }
        triangles
    }
}

/// A format that holds meshes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    Obj,
    Ply,
    Stl,
    /// glTF 2.0, as text (.gltf) or binary (.glb); [`super::gltf`] reads it.
    Gltf,
    /// None: vertices and faces in memory.
    Memory,
}

impl Format {
    /// By the end of the name; by how the file begins where that says nothing. OBJ has no such beginning.
    pub fn of(path: &Path, bytes: &[u8]) -> Format {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        match extension.as_str() {
            "obj" => Format::Obj,
            "ply" => Format::Ply,
            "stl" => Format::Stl,
            "gltf" | "glb" => Format::Gltf,
            _ if bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r") => Format::Ply,
            _ if bytes.starts_with(b"glTF") => Format::Gltf,
            _ if bytes.starts_with(b"solid ") => Format::Stl,
            _ => Format::Obj,
        }
    }
}

/// The content of the file at `path`.
///
/// # Errors
/// One problem that names the file.
pub fn content(path: &Path) -> Result<Vec<u8>, Box<Problem>> {
    std::fs::read(path).map_err(|e| {
        Box::new(Problem { file: path.to_owned(), message: format!("cannot be read: {e}"), ..Problem::default() })
    })
}

/// Reads the OBJ, PLY or STL file of this content; `path` stands in messages.
///
/// # Errors
/// What is wrong with it, with the line where the file has lines.
pub fn parse(format: Format, bytes: &[u8], path: &Path) -> Result<Mesh, Box<Problem>> {
    let mut mesh = match format {
        Format::Obj => obj::parse(bytes, path),
        Format::Ply => ply::parse(bytes, path),
        Format::Stl => stl::parse(bytes, path),
        Format::Memory => {
            let message = "is no file".to_owned();
            Err(Box::new(Problem { file: path.to_owned(), message, ..Problem::default() }))
        }
        Format::Gltf => {
            let file = super::gltf::parse(bytes, path)?;
            file.mesh(None).map_err(|message| file.problem(message))
        }
    }?;
    mesh.unit = stated_unit(format, bytes);
    Ok(mesh)
}

/// What the comments at the head of a file say of its lengths (`File units = millimeters`, `UNITS=mm`): none of these
/// formats has a place for that, but writers have their habits. Nothing where it is the metre.
fn stated_unit(format: Format, bytes: &[u8]) -> Option<String> {
    /// Longer heads are not searched.
    const HEAD: usize = 4096;
    const UNITS: [&str; 29] = [
        "mm",
        "millimeter",
        "millimeters",
        "millimetre",
        "millimetres",
        "cm",
        "centimeter",
        "centimeters",
        "centimetre",
        "centimetres",
        "um",
        "micron",
        "microns",
        "micrometer",
        "micrometers",
        "micrometre",
        "micrometres",
        "km",
        "kilometer",
        "kilometers",
        "kilometre",
        "kilometres",
        "in",
        "inch",
        "inches",
        "ft",
        "foot",
        "feet",
        "yards",
    ];
    let head = match format {
        // The header of a binary file; the name of the solid in text.
        Format::Stl => 80,
        Format::Obj | Format::Ply => HEAD,
        Format::Gltf | Format::Memory => return None,
    };
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(head)]);
    let comments = text.split(['\r', '\n', '\0']).filter_map(|line| match format {
        Format::Obj => line.trim_start().strip_prefix('#'),
        Format::Ply => line.strip_prefix("comment").or(line.strip_prefix("obj_info")),
        _ => Some(line),
    });
    comments.map(str::trim).find_map(|comment| {
        let lower = comment.to_lowercase();
        let words: Vec<&str> = lower.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
        let said = (1..words.len()).filter(|i| matches!(words[i - 1], "unit" | "units")).any(|i| match words[i] {
            // The preposition, or inches.
            "in" => words.get(i + 1).is_none_or(|next| UNITS.contains(next)),
            word => UNITS.contains(&word),
        });
        said.then(|| comment.chars().take(60).collect())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_in_comments() {
        for (format, head, said) in [
            (Format::Obj, "# made by hand\n# File units = millimeters\nv 0 0 0\n", Some("File units = millimeters")),
            (Format::Obj, "# Units: in\r\nv 0 0 0\r\n", Some("Units: in")),
            (Format::Obj, "# units in cm\nv 0 0 0\n", Some("units in cm")),
            (Format::Obj, "# File units = meters\nv 0 0 0\n", None),
            (Format::Obj, "# published coordinates (mm) in metres\nv 0 0 0\n", None),
            (Format::Obj, "# unit cube in mm\nv 0 0 0\n", None),
            (Format::Obj, "# units in metres\nv 0 0 0\n", None),
            (Format::Obj, "o units mm\n", None),
            (Format::Ply, "ply\nformat ascii 1.0\ncomment unit: mm\n", Some("unit: mm")),
            (Format::Stl, "made by a slicer UNITS=mm\0\0", Some("made by a slicer UNITS=mm")),
            (Format::Stl, "solid part\nfacet", None),
        ] {
            assert_eq!(stated_unit(format, head.as_bytes()).as_deref(), said, "{head}");
        }
    }
}
