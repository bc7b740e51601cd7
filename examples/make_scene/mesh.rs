//! Triangles on their way to an OBJ file.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::io;
use std::path::Path;

use glam::{DAffine3, DVec2, DVec3};

/// A piece of surface of one material.
#[derive(Clone, Default)]
pub struct Part {
    pub positions: Vec<DVec3>,
    /// One per position, or none at all: flat.
    pub normals: Vec<DVec3>,
    /// One per position, or none at all.
    pub uvs: Vec<DVec2>,
    /// Counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
}

impl Part {
    /// Adds a triangle unless it is degenerate, as at the poles of a grid.
    pub fn triangle(&mut self, corners: [u32; 3]) {
        let [a, b, c] = corners.map(|i| self.positions[i as usize]);
        if (b - a).cross(c - a).length() > 1e-11 {
            self.triangles.push(corners);
        }
    }

    /// Smooth normals: the mean over the triangles that meet in a point of space, by area. Positions that are equal
    /// bit for bit are one point, so seams and poles are smooth too.
    pub fn smooth(mut self) -> Part {
        let key = |p: DVec3| (p + 0.0).to_array().map(f64::to_bits);
        let mut sums: HashMap<_, DVec3> = HashMap::new();
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|i| self.positions[i as usize]);
            let normal = (b - a).cross(c - a);
            for p in [a, b, c] {
                *sums.entry(key(p)).or_default() += normal;
            }
        }
        self.normals =
            self.positions.iter().map(|p| sums.get(&key(*p)).map_or(DVec3::Y, |n| n.normalize_or(DVec3::Y))).collect();
        self
    }

    /// Where a normal points behind its triangle, as at the sharp rim of a thin wall, the triangle becomes flat.
    fn flat_where_folded(mut self) -> Part {
        for t in 0..if self.normals.is_empty() { 0 } else { self.triangles.len() } {
            let corners = self.triangles[t].map(|i| i as usize);
            let [a, b, c] = corners.map(|i| self.positions[i]);
            let front = (b - a).cross(c - a).normalize_or(DVec3::Y);
            if corners.iter().any(|i| self.normals[*i].dot(front) < 0.02) {
                let first = self.positions.len() as u32;
                for i in corners {
                    self.positions.push(self.positions[i]);
                    self.normals.push(front);
                    if !self.uvs.is_empty() {
                        self.uvs.push(self.uvs[i]);
                    }
                }
                self.triangles[t] = [first, first + 1, first + 2];
            }
        }
        self
    }

    /// Turns the surface inside out.
    pub fn flipped(mut self) -> Part {
        self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        self.normals.iter_mut().for_each(|n| *n = -*n);
        self
    }

    /// Six times the volume inside a closed surface; negative if its fronts face inwards.
    fn volume(&self) -> f64 {
        self.triangles.iter().map(|t| t.map(|i| self.positions[i as usize])).map(|[a, b, c]| a.dot(b.cross(c))).sum()
    }

    /// A closed surface with its fronts outside.
    pub fn outward(self) -> Part {
        if self.volume() < 0.0 { self.flipped() } else { self }
    }

    pub fn transformed(mut self, by: DAffine3) -> Part {
        let normals = by.matrix3.inverse().transpose();
        self.positions.iter_mut().for_each(|p| *p = by.transform_point3(*p));
        self.normals.iter_mut().for_each(|n| *n = (normals * *n).normalize());
        if by.matrix3.determinant() < 0.0 {
            self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        self
    }

    pub fn moved(self, by: DVec3) -> Part {
        self.transformed(DAffine3::from_translation(by))
    }

    /// Both surfaces as one part; normals and uv stay only where both have them.
    pub fn and(mut self, other: Part) -> Part {
        let offset = self.positions.len() as u32;
        let (mine, theirs) = (self.positions.len(), other.positions.len());
        let keep = |a: usize, b: usize| (a == mine) && (b == theirs);
        if keep(self.normals.len(), other.normals.len()) {
            self.normals.extend(other.normals);
        } else {
            self.normals.clear();
        }
        if keep(self.uvs.len(), other.uvs.len()) {
            self.uvs.extend(other.uvs);
        } else {
            self.uvs.clear();
        }
        self.positions.extend(other.positions);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + offset)));
        self
    }

    /// Cuts the surface in two: triangles whose centre `test` picks, and the others.
    pub fn split(self, test: impl Fn(DVec3) -> bool) -> (Part, Part) {
        let centre = |t: &[u32; 3]| t.iter().map(|i| self.positions[*i as usize]).sum::<DVec3>() / 3.0;
        let (picked, others) = self.triangles.iter().partition(|t| test(centre(t)));
        (Part { triangles: picked, ..self.clone() }, Part { triangles: others, ..self })
    }
}

/// An OBJ file in the making: parts under their material's name.
#[derive(Default)]
pub struct Mesh {
    parts: Vec<(String, Part)>,
}

impl Mesh {
    pub fn add(&mut self, material: &str, part: Part) {
        self.parts.push((material.to_owned(), part.flat_where_folded()));
    }

    pub fn triangles(&self) -> usize {
        self.parts.iter().map(|(_, part)| part.triangles.len()).sum()
    }

    /// Writes the parts, those of one material together: positions in metres to a micrometre, normals to 1e-4.
    pub fn write(mut self, path: &Path) -> io::Result<()> {
        self.parts.sort_by(|a, b| a.0.cmp(&b.0));
        let mut text = String::from("# Made by examples/make_scene; metres, y up.\n");
        // OBJ counts positions, texture coordinates and normals each by itself, from 1.
        let mut next = [1u32; 3];
        let mut material = None;
        for (name, part) in &self.parts {
            if material != Some(name) {
                writeln!(text, "usemtl {name}").expect("memory");
                material = Some(name);
            }
            write_part(&mut text, part, &mut next);
        }
        println!("{}: {} triangles", path.display(), self.triangles());
        std::fs::write(path, text)
    }
}

fn write_part(text: &mut String, part: &Part, next: &mut [u32; 3]) {
    // Only what a triangle uses: a part that was cut out of another shares its positions.
    let mut new = vec![u32::MAX; part.positions.len()];
    let mut used = Vec::new();
    for &i in part.triangles.iter().flatten() {
        if new[i as usize] == u32::MAX {
            new[i as usize] = used.len() as u32;
            used.push(i as usize);
        }
    }
    let mut line = |args: std::fmt::Arguments| text.write_fmt(args).expect("memory");
    // Adding 0 turns -0 into 0.
    let digits = |x: f64, scale: f64| (x * scale).round() / scale + 0.0;
    for &i in &used {
        let p = part.positions[i].to_array().map(|x| digits(x, 1e6));
        line(format_args!("v {} {} {}\n", p[0], p[1], p[2]));
    }
    let (uv, normal) = (!part.uvs.is_empty(), !part.normals.is_empty());
    for &i in used.iter().filter(|_| uv) {
        let t = part.uvs[i].to_array().map(|x| digits(x, 1e5));
        line(format_args!("vt {} {}\n", t[0], t[1]));
    }
    for &i in used.iter().filter(|_| normal) {
        let n = part.normals[i].to_array().map(|x| digits(x, 1e4));
        line(format_args!("vn {} {} {}\n", n[0], n[1], n[2]));
    }
    for triangle in &part.triangles {
        line(format_args!("f"));
        for i in triangle.map(|i| new[i as usize]) {
            match (uv, normal) {
                (false, false) => line(format_args!(" {}", i + next[0])),
                (true, false) => line(format_args!(" {}/{}", i + next[0], i + next[1])),
                (false, true) => line(format_args!(" {}//{}", i + next[0], i + next[2])),
                (true, true) => line(format_args!(" {}/{}/{}", i + next[0], i + next[1], i + next[2])),
            }
        }
        line(format_args!("\n"));
    }
    let count = used.len() as u32;
    *next = [next[0] + count, next[1] + count * u32::from(uv), next[2] + count * u32::from(normal)];
}
