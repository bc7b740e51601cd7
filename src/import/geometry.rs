//! Meshes that are made for a scene: shapes cut into triangles, and meshes whose normals or texture coordinates are to be others.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use super::report::Deviation;
use super::scene::Scene;
use super::text;
use crate::Result;
use crate::format::mesh;

/// Triangles with what is at their vertices.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    pub positions: Vec<DVec3>,
    pub normals: Option<Vec<DVec3>>,
    pub uv: Option<Vec<DVec2>>,
    pub triangles: Vec<[u32; 3]>,
}

/// Segments around of a full turn.
pub const AROUND: u32 = 128;

/// How far a round shape of [`AROUND`] segments is from its own: the middles of chords are at cos(π/n) of the radius, those of quads of a sphere,
/// which is round in two directions, at its square.
pub fn within_round(is_sphere: bool) -> Deviation {
    let cosine = (std::f64::consts::PI / f64::from(AROUND)).cos();
    let off = 1.0 - if is_sphere { cosine * cosine } else { cosine };
    Deviation::at_most(format!("{} of its radius, inward", text::percent(off)))
}

impl Mesh {
    /// All parts of a file, with a vertex for each combination of what a corner has.
    pub fn of_file(of: &mesh::Mesh) -> Mesh {
        let has_uv = of.parts.iter().all(|part| part.uv.is_some());
        let has_normals = of.parts.iter().all(|part| part.normals.is_some());
        let mut out = Mesh { normals: has_normals.then(Vec::new), uv: has_uv.then(Vec::new), ..Mesh::default() };
        let mut known: HashMap<[u64; 8], u32> = HashMap::new();
        for part in &of.parts {
            for (i, triangle) in part.triangles.iter().enumerate() {
                let corners = [0, 1, 2].map(|c| {
                    let position = part.positions[triangle[c] as usize];
                    let uv = part.uv.as_ref().filter(|_| has_uv).map_or([0.0; 2], |uv| uv[i][c]);
                    let normal = part.normals.as_ref().filter(|_| has_normals).map_or([0.0; 3], |n| n[i][c]);
                    let mut bits = [0; 8];
                    let all = position.into_iter().chain(uv).chain(normal);
                    bits.iter_mut().zip(all).for_each(|(bits, x)| *bits = (x + 0.0).to_bits());
                    let next = out.positions.len() as u32;
                    *known.entry(bits).or_insert_with(|| {
                        out.positions.push(DVec3::from_array(position));
                        out.uv.iter_mut().for_each(|all| all.push(DVec2::from_array(uv)));
                        out.normals.iter_mut().for_each(|all| all.push(DVec3::from_array(normal)));
                        next
                    })
                });
                out.triangles.push(corners);
            }
        }
        out
    }

    /// A part whose corners have what their vertex has.
    pub fn of_vertices(part: &mesh::Part) -> Mesh {
        let count = part.positions.len();
        let mut out = Mesh { triangles: part.triangles.clone(), ..Mesh::default() };
        out.positions = part.positions.iter().copied().map(DVec3::from_array).collect();
        let vertices = || part.triangles.iter().flatten().map(|i| *i as usize);
        out.uv = part.uv.as_ref().map(|uv| {
            let mut all = vec![DVec2::ZERO; count];
            vertices().zip(uv.iter().flatten()).for_each(|(i, uv)| all[i] = DVec2::from_array(*uv));
            all
        });
        out.normals = part.normals.as_ref().map(|normals| {
            let mut all = vec![DVec3::Z; count];
            vertices().zip(normals.iter().flatten()).for_each(|(i, n)| all[i] = DVec3::from_array(*n));
            all
        });
        out
    }

    /// Normals at vertices as the mean of the triangles around, weighted by their angles (Thürmer and Wüthrich 1998).
    pub fn smooth(&mut self) {
        let mut normals = vec![DVec3::ZERO; self.positions.len()];
        for triangle in &self.triangles {
            let corners = triangle.map(|i| self.positions[i as usize]);
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
            for (c, vertex) in triangle.iter().enumerate() {
                let (a, b) = (corners[(c + 1) % 3] - corners[c], corners[(c + 2) % 3] - corners[c]);
                let angle = if a.length() * b.length() > 0.0 { a.angle_between(b) } else { 0.0 };
                normals[*vertex as usize] += angle * normal;
            }
        }
        self.normals = Some(normals.into_iter().map(DVec3::normalize_or_zero).collect());
    }

    /// With coordinates of its own for each triangle, of its three corners, where it has none.
    pub fn lay_out(&mut self, corners: [DVec2; 3]) {
        if self.uv.is_some() {
            return;
        }
        let vertices = || self.triangles.iter().flatten().map(|i| *i as usize);
        let positions = vertices().map(|i| self.positions[i]).collect();
        let normals = self.normals.as_ref().map(|normals| vertices().map(|i| normals[i]).collect());
        let uv = self.triangles.iter().flat_map(|_| corners).collect();
        let triangles = (0..self.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        *self = Mesh { positions, normals, uv: Some(uv), triangles };
    }

    /// The other side in front.
    pub fn reverse(&mut self) {
        self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        self.normals.iter_mut().flatten().for_each(|n| *n = -*n);
    }

    /// A grid over u and v in [0, 1] of `across` times `up` quads, the front where v × … is `point`'s own.
    pub fn grid(across: u32, up: u32, point: impl Fn(f64, f64) -> (DVec3, DVec3, DVec2)) -> Mesh {
        let mut mesh = Mesh { normals: Some(Vec::new()), uv: Some(Vec::new()), ..Mesh::default() };
        for j in 0..=up {
            for i in 0..=across {
                let (position, normal, uv) = point(f64::from(i) / f64::from(across), f64::from(j) / f64::from(up));
                mesh.positions.push(position);
                mesh.normals.iter_mut().for_each(|normals| normals.push(normal));
                mesh.uv.iter_mut().for_each(|all| all.push(uv));
            }
        }
        let normals = mesh.normals.clone().unwrap_or_default();
        for j in 0..up {
            for i in 0..across {
                let a = j * (across + 1) + i;
                let (b, c, d) = (a + 1, a + across + 1, a + across + 2);
                for t in [[a, b, d], [a, d, c]] {
                    let corners = t.map(|i| mesh.positions[i as usize]);
                    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
                    let wanted: DVec3 = t.iter().map(|i| normals[*i as usize]).sum();
                    match normal.dot(wanted) {
                        d if d > 0.0 => mesh.triangles.push(t),
                        d if d < 0.0 => mesh.triangles.push([t[0], t[2], t[1]]),
                        // At a pole.
                        _ => {}
                    }
                }
            }
        }
        mesh
    }

    /// As binary PLY, in f64 where f32 would move a vertex.
    pub fn ply(&self) -> Vec<u8> {
        let is_single = self.positions.iter().flat_map(|p| p.to_array()).all(|x| f64::from(x as f32) == x);
        let kind = if is_single { "float" } else { "double" };
        let mut bytes = format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", self.positions.len());
        let property = |names: &[&str], kind: &str| -> String {
            names.iter().map(|name| format!("property {kind} {name}\n")).collect()
        };
        bytes += &property(&["x", "y", "z"], kind);
        if self.normals.is_some() {
            bytes += &property(&["nx", "ny", "nz"], "float");
        }
        if self.uv.is_some() {
            bytes += &property(&["u", "v"], "float");
        }
        bytes +=
            &format!("element face {}\nproperty list uchar uint vertex_indices\nend_header\n", self.triangles.len());
        let mut bytes = bytes.into_bytes();
        for (i, position) in self.positions.iter().enumerate() {
            for x in position.to_array() {
                match is_single {
                    true => bytes.extend((x as f32).to_le_bytes()),
                    false => bytes.extend(x.to_le_bytes()),
                }
            }
            let normal = self.normals.as_ref().map(|normals| normals[i].to_array());
            let uv = self.uv.as_ref().map(|uv| uv[i].to_array());
            for x in normal.into_iter().flatten().chain(uv.into_iter().flatten()) {
                bytes.extend((x as f32).to_le_bytes());
            }
        }
        for triangle in &self.triangles {
            bytes.push(3);
            triangle.iter().for_each(|i| bytes.extend(i.to_le_bytes()));
        }
        bytes
    }

    /// Puts it into the scene; gives its path.
    pub fn write(&self, scene: &mut Scene, name: &str) -> Result<String> {
        scene.write("meshes", &format!("{name}.ply"), &self.ply())
    }
}

/// The factor of a matrix that only scales, turns and mirrors.
pub fn similarity(m: glam::DMat3) -> Option<f64> {
    let factor = m.determinant().abs().cbrt();
    let product = m.transpose() * m * (factor * factor).recip();
    let far = (product - glam::DMat3::IDENTITY).to_cols_array().into_iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    (far <= 1e-5).then_some(factor)
}
