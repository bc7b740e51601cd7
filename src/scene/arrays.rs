//! Numbers in memory where a scene file would name a file: what a mesh, a picture or a grid says, without one.

use std::path::PathBuf;

use crate::error::Problem;
use crate::format::image::{Colours, Format, Image, Plane, Transfer};
use crate::format::mesh::{self, Part};
use crate::format::volume::{MAX_VOXELS, Volume};

/// What stands in the place of a file. Each has a name, for messages, that no other of the same scene has.
#[derive(Debug, Clone, PartialEq)]
pub enum Data {
    /// A picture, \[y\]\[x\] or \[y\]\[x\]\[channel\] with rows from the top, or a grid, \[z\]\[y\]\[x\].
    Numbers {
        name: String,
        shape: Vec<usize>,
        values: Vec<f32>,
    },
    Mesh(Mesh),
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
            Data::Numbers { name, .. } => name,
            Data::Mesh(mesh) => &mesh.name,
        }
    }

    fn problem(&self, message: impl Into<String>, help: &str) -> Box<Problem> {
        let (file, message) = (PathBuf::from(self.name()), message.into());
        Box::new(Problem { file, message, help: Some(help.to_owned()), ..Problem::default() })
    }

    /// As a picture of linear numbers.
    ///
    /// # Errors
    /// Where it is none: what is wrong with the numbers as a whole.
    pub fn image(&self) -> Result<Image, Box<Problem>> {
        const HELP: &str = "give [y, x] or [y, x, channel], rows from the top";
        let Data::Numbers { shape, values, .. } = self else {
            return Err(self.problem("is a mesh, where a picture is needed", HELP));
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
        Ok(Image { format: Format::Memory, size: [width, height], planes, colours, units: None })
    }

    /// As voxels, of the unit that the scene expects.
    ///
    /// # Errors
    /// Where it is none: what is wrong with the numbers as a whole.
    pub fn volume(&self) -> Result<Volume, Box<Problem>> {
        const HELP: &str = "give [z, y, x]";
        let Data::Numbers { shape, values, .. } = self else {
            return Err(self.problem("is a mesh, where a grid is needed", HELP));
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
            values: values.clone(),
            unit: None,
            said: Vec::new(),
            told: Vec::new(),
            notes: Vec::new(),
        })
    }

    /// As a mesh file of one run of faces.
    ///
    /// # Errors
    /// Where it is none: the face or vertex that is wrong.
    pub fn mesh(&self) -> Result<mesh::Mesh, Box<Problem>> {
        const HELP: &str = "give vertices [vertex, 3] and faces [face, 3]";
        let Data::Mesh(Mesh { vertices, faces, uv, normals, .. }) = self else {
            return Err(self.problem("is an array, where a mesh is needed", HELP));
        };
        if faces.is_empty() {
            return Err(self.problem("has no faces", HELP));
        }
        if let Some(i) = vertices.iter().position(|vertex| vertex.iter().any(|x| !x.is_finite())) {
            return Err(self.problem(format!("has numbers that are not finite at vertex {i}"), "correct the vertices"));
        }
        let beyond = |face: &[u32; 3]| face.iter().any(|corner| *corner as usize >= vertices.len());
        if let Some(i) = faces.iter().position(beyond) {
            let message = format!(
                "face {i}, {:?}, names a vertex that is not among 0 to {}",
                faces[i],
                vertices.len() as i64 - 1
            );
            return Err(self.problem(message, "vertices are counted from 0"));
        }
        let uv = uv.as_ref().map(|uv| self.corners(uv, "uv", vertices.len(), faces)).transpose()?;
        let normals =
            normals.as_ref().map(|normals| self.corners(normals, "normals", vertices.len(), faces)).transpose()?;
        let part = Part { positions: vertices.clone(), triangles: faces.clone(), uv, normals, ..Part::default() };
        Ok(mesh::Mesh { parts: vec![part], ..mesh::Mesh::default() })
    }

    fn corners<const N: usize>(
        &self,
        given: &Corners<N>,
        what: &str,
        vertices: usize,
        faces: &[[u32; 3]],
    ) -> Result<Vec<[[f64; N]; 3]>, Box<Problem>> {
        let (found, wanted) = match given {
            Corners::OfVertices(values) => (values.len(), vertices),
            Corners::OfFaces(values) => (values.len(), faces.len()),
        };
        if found != wanted {
            let of = if matches!(given, Corners::OfVertices(_)) { "vertices" } else { "faces" };
            let message = format!("has {wanted} {of}, but `{what}` has {found}");
            let help = "give one for each vertex, or one for each corner of each face [face, 3, number]";
            return Err(self.problem(message, help));
        }
        let corners: Vec<[[f64; N]; 3]> = match given {
            Corners::OfVertices(values) => {
                faces.iter().map(|face| face.map(|corner| values[corner as usize])).collect()
            }
            Corners::OfFaces(values) => values.clone(),
        };
        if let Some(i) = corners.iter().position(|face| face.iter().flatten().any(|x| !x.is_finite())) {
            let message = format!("has numbers in `{what}` that are not finite at face {i}");
            return Err(self.problem(message, "correct them"));
        }
        Ok(corners)
    }
}
