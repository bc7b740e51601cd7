//! Numbers in memory where a scene file would name a file: what a mesh, a picture or a grid says, without one.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::error::Problem;
use crate::format::csv_table;
use crate::format::image::{Colours, Format, Image, Plane, Transfer};
use crate::format::mesh::{self, Part};
use crate::format::said::Said;
use crate::format::text::{self, SpectrumTable};
use crate::format::unit::{self, Stated};
use crate::format::volume::{MAX_VOXELS, Volume};

/// What stands in the place of a file. Each has a name, for messages, that no other of the same scene has.
#[derive(Debug, Clone, PartialEq)]
pub enum Data {
    /// A picture, \[y\]\[x\] or \[y\]\[x\]\[channel\] with rows from the top, or a grid, \[z\]\[y\]\[x\].
    Numbers {
        name: String,
        shape: Vec<usize>,
        values: Arc<Vec<f32>>,
        words: Words,
    },
    /// As a file of them would be read, or what is wrong with it.
    Mesh {
        name: String,
        read: Result<Arc<mesh::Mesh>, Box<Problem>>,
    },
    Table(Table),
    /// A spectrum that says more of itself than its numbers: as a file of it would be read, or what is wrong with it.
    Spectrum {
        name: String,
        read: Result<SpectrumTable, Box<Problem>>,
    },
    /// What a file of this name holds, which is not on this machine.
    File {
        name: String,
        content: Vec<u8>,
    },
}

/// What an array says of its numbers.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Words {
    /// Their unit.
    pub units: Option<String>,
    /// What it calls them.
    pub names: Vec<String>,
}

/// Columns of numbers, each under its name.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Table {
    pub name: String,
    pub columns: Vec<String>,
    /// Row by row.
    pub values: Vec<f64>,
}

/// Triangles that share vertices.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    pub name: String,
    /// In the object's own space, metres.
    pub vertices: Vec<[f64; 3]>,
    /// Indices into `vertices`, counter-clockwise seen from the front.
    pub faces: Vec<[u32; 3]>,
    /// Texture coordinates (u, v).
    pub uv: Option<Corners<2>>,
    /// Normals, of any length but 0.
    pub normals: Option<Corners<3>>,
}

/// Numbers at the corners of triangles.
#[derive(Debug, Clone, PartialEq)]
pub enum Corners<const N: usize> {
    /// One for each vertex.
    OfVertices(Vec<[f64; N]>),
    /// One for each corner of each face.
    OfFaces(Vec<[[f64; N]; 3]>),
}

impl Data {
    pub fn name(&self) -> &str {
        match self {
            Data::Numbers { name, .. }
            | Data::Mesh { name, .. }
            | Data::Spectrum { name, .. }
            | Data::File { name, .. } => name,
            Data::Table(table) => &table.name,
        }
    }

    /// What it is, for messages.
    fn kind(&self) -> &'static str {
        match self {
            Data::Numbers { .. } => "an array",
            Data::Mesh { .. } => "a mesh",
            Data::Table(_) => "a table",
            Data::Spectrum { .. } => "a spectrum",
            Data::File { .. } => "a file",
        }
    }

    /// Something wrong with the whole of it.
    pub fn problem(&self, message: impl Into<String>, help: &str) -> Box<Problem> {
        problem(self.name(), message, help)
    }

    /// What is wrong where it stands for something else.
    fn no(&self, wanted: &str, help: &str) -> Box<Problem> {
        self.problem(format!("is {}, where {wanted} is needed", self.kind()), help)
    }

    /// As a picture of linear numbers.
    ///
    /// # Errors
    /// Where it is none: what is wrong with the numbers as a whole.
    pub fn image(&self) -> Result<Image, Box<Problem>> {
        const HELP: &str = "give [y, x] or [y, x, channel], rows from the top";
        let Data::Numbers { shape, values, words, .. } = self else {
            return Err(self.no("a picture", HELP));
        };
        let [height, width, channels] = match shape[..] {
            [height, width] => [height, width, 1],
            [height, width, channels] => [height, width, channels],
            _ => return Err(self.problem(format!("has the shape {shape:?}, which no picture has"), HELP)),
        };
        let side = |n: usize| u32::try_from(n).ok().filter(|n| *n > 0);
        let (Some(width), Some(height), true) = (side(width), side(height), channels > 0) else {
            return Err(self.problem(format!("has the shape {shape:?}, which no picture has"), HELP));
        };
        let name = |channel: usize| match channels {
            1 => "Y".to_owned(),
            3 => ["R", "G", "B"][channel].to_owned(),
            _ => channel.to_string(),
        };
        let plane = |channel: usize| Plane {
            name: name(channel),
            samples: values.iter().skip(channel).step_by(channels).copied().collect(),
            rounding: 0.0,
        };
        let colours = Colours { transfer: Transfer::Linear, primaries: None, foreign: None };
        let planes = (0..channels).map(plane).collect();
        let of_name = || words.names.iter().find_map(|name| unit::of_temperature(name));
        let units = words.units.clone().or_else(of_name);
        Ok(Image { format: Format::Memory, size: [width, height], planes, colours, units })
    }

    /// As voxels.
    ///
    /// # Errors
    /// Where it is none: what is wrong with the numbers as a whole.
    pub fn volume(&self) -> Result<Volume, Box<Problem>> {
        const HELP: &str = "give [z, y, x]";
        let Data::Numbers { shape, values, words, .. } = self else {
            return Err(self.no("a grid", HELP));
        };
        let [z, y, x] = shape[..] else {
            return Err(self.problem(format!("has {} dimensions, but a grid has three", shape.len()), HELP));
        };
        if values.is_empty() || values.len() as u64 > MAX_VOXELS {
            let message = format!("has {} voxels, but a grid has 1 to {MAX_VOXELS}", values.len());
            return Err(self.problem(message, HELP));
        }
        // Each is at most the number of voxels.
        Ok(Volume {
            size: [x, y, z].map(|n| n as u32),
            values: Arc::clone(values),
            unit: words.units.as_ref().map(|text| (text.clone(), unit::parse(text))),
            said: words.names.clone(),
            told: Vec::new(),
            notes: Vec::new(),
        })
    }

    /// As a mesh file of one run of faces.
    ///
    /// # Errors
    /// Where it is none: the face or vertex that is wrong.
    pub fn mesh(&self) -> Result<Arc<mesh::Mesh>, Box<Problem>> {
        match self {
            Data::Mesh { read, .. } => read.clone(),
            _ => Err(self.no("a mesh", MESH_HELP)),
        }
    }

    /// As a file of one spectrum.
    ///
    /// # Errors
    /// Where it is none: what is wrong with it.
    pub fn spectrum(&self) -> Result<SpectrumTable, Box<Problem>> {
        match self {
            Data::Spectrum { read, .. } => read.clone(),
            _ => Err(self.no("a spectrum", "give wavelengths and values")),
        }
    }

    /// Wavelengths (nm, vacuum) and values of a spectrum that says no more of these than a table in a scene.
    pub fn plain(&self) -> Option<(&[f64], &[f64])> {
        match self {
            Data::Spectrum { read: Ok(SpectrumTable { nm, value, unit: None, said: None, notes, .. }), .. } => {
                notes.is_empty().then_some((nm, value))
            }
            _ => None,
        }
    }

    /// A spectrum of `pairs`, called `name`: places on an axis and values. What the `axis` and the values are called counts as in the
    /// header of a table: the first of `names` that says a unit, and the first that says a quantity.
    pub fn of_spectrum(name: String, axis: &str, names: &[String], pairs: &[[f64; 2]]) -> Data {
        let mut table = csv_table::Table::new([axis, names.first().map_or("value", String::as_str)]);
        pairs.iter().for_each(|pair| table.row(pair.map(|number| format!("{number:?}"))));
        let read = text::parse_spectrum(table.finish().as_bytes(), Path::new(&name), None);
        let read = read.map(|table| SpectrumTable {
            unit: table.unit.or_else(|| names.iter().find_map(|name| Stated::in_name(name))),
            said: table.said.or_else(|| names.iter().find_map(|name| Some((Said::in_name(name)?, name.clone())))),
            // Arrays have no lines.
            line: Vec::new(),
            ..table
        });
        Data::Spectrum { read: read.map_err(|problem| Box::new(Problem { line: None, ..*problem })), name }
    }

    /// As columns of numbers.
    ///
    /// # Errors
    /// Where it is something else, or a number is none.
    pub fn table(&self) -> Result<&Table, Box<Problem>> {
        let Data::Table(table) = self else { return Err(self.no("a table", "give columns by name")) };
        if let Some(i) = table.values.iter().position(|value| !value.is_finite()) {
            let (row, column) = (i / table.columns.len(), &table.columns[i % table.columns.len()]);
            let message = format!("has {} as `{column}` of row {row}", table.values[i]);
            return Err(self.problem(message, "numbers are finite; rows are counted from 0"));
        }
        Ok(table)
    }
}

const MESH_HELP: &str = "give vertices [vertex, 3] and faces [face, 3]";

fn problem(name: &str, message: impl Into<String>, help: &str) -> Box<Problem> {
    let (file, message) = (PathBuf::from(name), message.into());
    Box::new(Problem { file, message, help: Some(help.to_owned()), ..Problem::default() })
}

impl Table {
    pub fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.values.chunks_exact(self.columns.len().max(1))
    }
}

impl From<Mesh> for Data {
    /// Its numbers are not copied.
    fn from(mut mesh: Mesh) -> Data {
        let name = std::mem::take(&mut mesh.name);
        let read = mesh.read(&name).map(Arc::new);
        Data::Mesh { name, read }
    }
}

impl Mesh {
    fn read(self, name: &str) -> Result<mesh::Mesh, Box<Problem>> {
        let Mesh { name: _, vertices, faces, uv, normals } = self;
        let wrong = |message: String, help: &str| problem(name, message, help);
        if faces.is_empty() {
            return Err(wrong("has no faces".to_owned(), MESH_HELP));
        }
        if let Some(i) = vertices.iter().position(|vertex| vertex.iter().any(|x| !x.is_finite())) {
            return Err(wrong(format!("has numbers that are not finite at vertex {i}"), "correct the vertices"));
        }
        let beyond = |face: &[u32; 3]| face.iter().any(|corner| *corner as usize >= vertices.len());
        if let Some(i) = faces.iter().position(beyond) {
            let message = format!(
                "face {i}, {:?}, names a vertex that is not among 0 to {}",
                faces[i],
                vertices.len() as i64 - 1
            );
            return Err(wrong(message, "vertices are counted from 0"));
        }
        let uv = uv.map(|uv| uv.of_faces("uv", vertices.len(), &faces, wrong)).transpose()?;
        let normals = normals.map(|normals| normals.of_faces("normals", vertices.len(), &faces, wrong)).transpose()?;
        let part = Part { positions: vertices, triangles: faces, uv, normals, ..Part::default() };
        Ok(mesh::Mesh { parts: vec![part], ..mesh::Mesh::default() })
    }
}

impl<const N: usize> Corners<N> {
    /// At the corners of each of `faces`, which name `vertices` of them; those that are given so are not copied.
    fn of_faces(
        self,
        what: &str,
        vertices: usize,
        faces: &[[u32; 3]],
        problem: impl Fn(String, &str) -> Box<Problem>,
    ) -> Result<Vec<[[f64; N]; 3]>, Box<Problem>> {
        let (found, wanted, of) = match &self {
            Corners::OfVertices(values) => (values.len(), vertices, "vertices"),
            Corners::OfFaces(values) => (values.len(), faces.len(), "faces"),
        };
        if found != wanted {
            let message = format!("has {wanted} {of}, but `{what}` has {found}");
            let help = "give one for each vertex, or one for each corner of each face [face, 3, number]";
            return Err(problem(message, help));
        }
        let corners: Vec<[[f64; N]; 3]> = match self {
            Corners::OfVertices(values) => {
                faces.iter().map(|face| face.map(|corner| values[corner as usize])).collect()
            }
            Corners::OfFaces(values) => values,
        };
        if let Some(i) = corners.iter().position(|face| face.iter().flatten().any(|x| !x.is_finite())) {
            let message = format!("has numbers in `{what}` that are not finite at face {i}");
            return Err(problem(message, "correct them"));
        }
        Ok(corners)
    }
}
