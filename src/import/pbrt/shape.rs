//! Shapes of pbrt.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DMat3, DVec2, DVec3};

use super::token::{At, Parameters, shown};
use super::{Importer, beside};
use crate::Result;
use crate::format::mesh::{self as meshes, Format};
use crate::import::geometry::{AROUND, Mesh, similarity, within_round};
use crate::import::report::Deviation;
use crate::import::scene::Section;
use crate::import::text;

/// What a shape is, before it is placed.
#[derive(Debug, Clone)]
pub enum Form {
    Sphere {
        radius: f64,
    },
    Disk {
        height: f64,
        radius: f64,
        reversed: bool,
    },
    Cylinder {
        radius: f64,
        low: f64,
        high: f64,
    },
    /// The path of a file that is written already, and the area in the mesh's own space.
    Mesh {
        path: String,
        area: f64,
    },
}

/// From Spectile's own axes of a sphere, whose poles are ±y, to those of pbrt's, whose are ±z, with the same longitudes.
const POLES: DMat3 = DMat3::from_cols(DVec3::NEG_Y, DVec3::Z, DVec3::NEG_X);

impl Form {
    /// The object's shape and transform.
    pub fn section(&self, to_world: &DAffine3, textured: bool) -> Option<Section> {
        let object = Section::new("[[objects]]");
        Some(match self {
            Form::Sphere { radius } => {
                let factor = similarity(to_world.matrix3)?;
                if textured {
                    let turned = *to_world * DAffine3::from_mat3(POLES * *radius);
                    let object = object.with("sphere", "{ center = [0.0, 0.0, 0.0], radius = 1.0 }");
                    object.with("transform", text::transform(&turned))
                } else {
                    let center = text::vector(to_world.translation);
                    let radius = text::rounded(radius * factor);
                    object.with("sphere", format!("{{ center = {center}, radius = {radius} }}"))
                }
            }
            Form::Disk { height, radius, reversed } => {
                let factor = similarity(to_world.matrix3)?;
                let sign = if *reversed { -1.0 } else { 1.0 };
                let normal = (to_world.matrix3.inverse().transpose() * DVec3::Z).normalize() * sign;
                let center = to_world.transform_point3(DVec3::new(0.0, 0.0, *height));
                let [center, normal] = [center, normal].map(text::vector);
                let radius = text::rounded(radius * factor);
                object.with("disk", format!("{{ center = {center}, normal = {normal}, radius = {radius} }}"))
            }
            Form::Cylinder { radius, low, high } => {
                let factor = similarity(to_world.matrix3)?;
                let [from, to] = [low, high].map(|z| text::vector(to_world.transform_point3(DVec3::new(0.0, 0.0, *z))));
                let radius = text::rounded(radius * factor);
                object.with("cylinder", format!("{{ from = {from}, to = {to}, radius = {radius} }}"))
            }
            Form::Mesh { path, .. } => {
                let object = object.with("mesh", text::quoted(path));
                match *to_world == DAffine3::IDENTITY {
                    true => object,
                    false => object.with("transform", text::transform(to_world)),
                }
            }
        })
    }

    /// The area under `to_world`, of what a power is spread over.
    pub fn area(&self, to_world: &DAffine3) -> f64 {
        let scale = to_world.matrix3.determinant().abs().powf(2.0 / 3.0);
        let pi = std::f64::consts::PI;
        scale
            * match self {
                Form::Sphere { radius } => 4.0 * pi * radius * radius,
                Form::Disk { radius, .. } => pi * radius * radius,
                Form::Cylinder { radius, low, high } => 2.0 * pi * radius * (high - low),
                Form::Mesh { area, .. } => *area,
            }
    }
}

impl Importer<'_> {
    /// The shape of a directive; `None` where there is none, which has been said.
    pub fn form(
        &mut self,
        kind: &str,
        parameters: &Parameters,
        at: &At,
        (round, textured): (bool, bool),
        reversed: bool,
    ) -> Result<Option<Form>> {
        let radius = || -> Result<f64> {
            let radius = parameters.number("radius")?.unwrap_or(1.0);
            if radius > 0.0 { Ok(radius) } else { Err(at.problem("`radius` must be above 0").into()) }
        };
        // How much of a turn around its axis a round shape goes.
        let turn = || -> Result<f64> { Ok(parameters.number("phimax")?.unwrap_or(360.0).clamp(0.0, 360.0) / 360.0) };
        let around = |turn: f64| (f64::from(AROUND) * turn).ceil() as u32;
        let mesh = match kind {
            "sphere" => {
                let (radius, turn) = (radius()?, turn()?);
                let end = |name: &str, whole: f64| -> Result<f64> {
                    Ok((parameters.number(name)?.unwrap_or(whole) / radius).clamp(-1.0, 1.0))
                };
                let (one, other) = (end("zmin", -radius)?, end("zmax", radius)?);
                let (low, high) = (one.min(other).acos(), one.max(other).acos());
                if round && !reversed && turn == 1.0 && low - high == PI {
                    return Ok(Some(Form::Sphere { radius }));
                }
                if turn == 0.0 || low == high {
                    return Ok(self.empty(kind, at));
                }
                self.tessellated(kind, at);
                let rows = (f64::from(AROUND) * (low - high) / TAU).ceil() as u32;
                Mesh::grid(around(turn), rows, |u, v| {
                    let (azimuth, polar) = (TAU * turn * u, low + v * (high - low));
                    let p = DVec3::new(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos());
                    (radius * p, p, DVec2::new(u, v))
                })
            }
            "disk" => {
                let (radius, height) = (radius()?, parameters.number("height")?.unwrap_or(0.0));
                let inner = parameters.number("innerradius")?.unwrap_or(0.0);
                let turn = turn()?;
                if round && inner == 0.0 && turn == 1.0 {
                    return Ok(Some(Form::Disk { height, radius, reversed }));
                }
                if turn == 0.0 || inner >= radius {
                    return Ok(self.empty(kind, at));
                }
                self.tessellated(kind, at);
                Mesh::grid(around(turn), 1, |u, v| {
                    let azimuth = TAU * turn * u;
                    let r = radius + v * (inner - radius);
                    (DVec3::new(r * azimuth.cos(), r * azimuth.sin(), height), DVec3::Z, DVec2::new(u, v))
                })
            }
            "cylinder" => {
                let radius = radius()?;
                let (low, high) =
                    (parameters.number("zmin")?.unwrap_or(-1.0), parameters.number("zmax")?.unwrap_or(1.0));
                if high <= low {
                    return Err(at.problem("`zmax` must be above `zmin`").into());
                }
                let turn = turn()?;
                if round && !reversed && turn == 1.0 {
                    return Ok(Some(Form::Cylinder { radius, low, high }));
                }
                if turn == 0.0 {
                    return Ok(self.empty(kind, at));
                }
                self.tessellated(kind, at);
                Mesh::grid(around(turn), 1, |u, v| {
                    let azimuth = TAU * turn * u;
                    let normal = DVec3::new(azimuth.cos(), azimuth.sin(), 0.0);
                    (radius * normal + DVec3::Z * (low + v * (high - low)), normal, DVec2::new(u, v))
                })
            }
            "trianglemesh" => triangles(parameters, at)?,
            "bilinearmesh" => self.patches(parameters, at)?,
            "loopsubdiv" => {
                let levels = parameters.number("levels")?.unwrap_or(3.0);
                let levels = self.scene.report.within(at.place(), "`levels`", levels, [0.0, 10.0]) as u32;
                parameters.get("scheme");
                let base = triangles(parameters, at)?;
                subdivided(base, levels, at)?
            }
            "plymesh" => {
                let name = parameters.text("filename")?.ok_or_else(|| at.problem("`plymesh` has no `filename`"))?;
                let path = at.file(name)?;
                let bytes = meshes::content(&path).map_err(|problem| beside(at, &problem))?;
                let read =
                    meshes::parse(Format::of(&path, &bytes), &bytes, &path).map_err(|problem| beside(at, &problem))?;
                if parameters.get("displacement").is_some() {
                    self.scene.report.left_out(at.place(), "the displacement of a `plymesh`");
                }
                let mesh = match &read.parts[..] {
                    [part] => Mesh::of_vertices(part),
                    _ => Mesh::of_file(&read),
                };
                if !reversed && agrees(&mesh) && (mesh.uv.is_some() || !textured) {
                    let area = area(&mesh);
                    return Ok(Some(Form::Mesh { path: self.scene.copy("meshes", &path)?, area }));
                }
                mesh
            }
            other => {
                self.scene.report.left_out(at.place(), format!("the shape `{}`", shown(other)));
                parameters.ask_for_all();
                return Ok(None);
            }
        };
        let mut mesh = mesh;
        if textured {
            // As pbrt has triangles without `uv`.
            mesh.lay_out([DVec2::ZERO, DVec2::X, DVec2::ONE]);
        }
        if reversed {
            mesh.reverse();
        }
        turn_to_normals(&mut mesh);
        let name = format!("{kind}-{}", at.line);
        let area = area(&mesh);
        Ok(Some(Form::Mesh { path: mesh.write(self.scene, &name)?, area }))
    }

    /// No shape, which is said.
    fn empty(&mut self, kind: &str, at: &At) -> Option<Form> {
        self.scene.report.left_out(at.place(), format!("a `{kind}` of which no part is there"));
        None
    }

    fn tessellated(&mut self, kind: &str, at: &At) {
        let what = format!("a round shape by {AROUND} segments around");
        self.scene.report.approximated(at.place(), what, within_round(kind == "sphere"));
    }

    /// Patches of four corners each: flat parallelograms are two triangles, others a grid.
    fn patches(&mut self, parameters: &Parameters, at: &At) -> Result<Mesh> {
        let points = vectors(parameters, "P")?;
        let indices = indices(parameters, points.len(), 4, at)?.unwrap_or_else(|| vec![0, 1, 2, 3]);
        let corners_uv = parameters.get("uv").map(|uv| uv.numbers.as_chunks::<2>().0.to_vec());
        if parameters.get("emissionfilename").is_some() {
            self.scene.report.left_out(at.place(), "`emissionfilename` of a `bilinearmesh`");
        }
        let corners_n = Some(vectors(parameters, "N")?).filter(|normals| !normals.is_empty());
        if corners_n.as_ref().is_some_and(|normals| normals.len() != points.len()) {
            return Err(at.problem(format!("has {} points, and another number of `N`", points.len())).into());
        }
        let (mut normals, mut is_shaded) = (Vec::new(), corners_n.is_some());
        const STEPS: u32 = 8;
        let mut all = Mesh { uv: Some(Vec::new()), ..Mesh::default() };
        for patch in indices.as_chunks::<4>().0 {
            if patch.iter().any(|i| *i as usize >= points.len()) {
                return Err(at.problem("`indices` name a point that is not there").into());
            }
            let [a, b, c, d] = patch.map(|i| points[i as usize]);
            let uv = |i: usize, default: [f64; 2]| {
                let given = corners_uv.as_ref().and_then(|all| all.get(patch[i] as usize));
                DVec2::from_array(*given.unwrap_or(&default))
            };
            let [ua, ub, uc, ud] = [uv(0, [0., 0.]), uv(1, [1., 0.]), uv(2, [0., 1.]), uv(3, [1., 1.])];
            let is_flat = (a - b - c + d).length() <= 1e-9 * (a - d).length();
            let steps = if is_flat { 1 } else { STEPS };
            if !is_flat {
                is_shaded = true;
                // Of a cell that is 1/n of a patch wide, two triangles are a quarter of its twist away in the middle.
                let off = 0.25 * (a - b - c + d).length() / f64::from(STEPS * STEPS);
                let what = format!("a bent patch of a `bilinearmesh` by {STEPS} x {STEPS} quads");
                let share = text::percent(off / (a - d).length().max((b - c).length()));
                let off = format!("{} of its own units, {share} of its diagonal", text::up(off));
                self.scene.report.approximated(at.place(), what, Deviation::at_most(off));
            }
            let first = all.positions.len() as u32;
            let ends = |s: f64, t: f64| [(1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t];
            for j in 0..=steps {
                for i in 0..=steps {
                    let [wa, wb, wc, wd] = ends(f64::from(i) / f64::from(steps), f64::from(j) / f64::from(steps));
                    all.positions.push(wa * a + wb * b + wc * c + wd * d);
                    let (s, t) = (f64::from(i) / f64::from(steps), f64::from(j) / f64::from(steps));
                    let normal = match &corners_n {
                        Some(normals) => {
                            let [na, nb, nc, nd] = patch.map(|i| normals[i as usize]);
                            wa * na + wb * nb + wc * nc + wd * nd
                        }
                        None => {
                            let across = (1.0 - t) * (b - a) + t * (d - c);
                            across.cross((1.0 - s) * (c - a) + s * (d - b))
                        }
                    };
                    normals.push(normal.normalize_or(DVec3::Z));
                    all.uv.iter_mut().for_each(|all| all.push(wa * ua + wb * ub + wc * uc + wd * ud));
                }
            }
            for (j, i) in (0..steps).flat_map(|j| (0..steps).map(move |i| (j, i))) {
                let p = first + j * (steps + 1) + i;
                let q = p + steps + 1;
                all.triangles.extend([[p, p + 1, q + 1], [p, q + 1, q]]);
            }
        }
        all.normals = is_shaded.then_some(normals);
        Ok(all)
    }
}

fn vectors(parameters: &Parameters, name: &str) -> Result<Vec<DVec3>> {
    let Some(found) = parameters.get(name) else { return Ok(Vec::new()) };
    let (vectors, rest) = found.numbers.as_chunks::<3>();
    if !rest.is_empty() {
        return Err(found.at.problem(format!("`{name}` needs three numbers each")).into());
    }
    Ok(vectors.iter().copied().map(DVec3::from_array).collect())
}

fn indices(parameters: &Parameters, points: usize, each: usize, at: &At) -> Result<Option<Vec<u32>>> {
    let Some(found) = parameters.get("indices") else {
        return if points == each {
            Ok(None)
        } else {
            Err(at.problem(format!("the shape has {points} points and no `indices`")).into())
        };
    };
    let whole = |x: &f64| (x.fract() == 0.0 && (0.0..points as f64).contains(x)).then_some(*x as u32);
    let all: Option<Vec<u32>> = found.numbers.iter().map(whole).collect();
    let all = all.ok_or_else(|| {
        found.at.problem(format!("`indices` must be whole numbers from 0 to {}", points.saturating_sub(1)))
    })?;
    if all.len() % each != 0 || all.is_empty() {
        return Err(found.at.problem(format!("`indices` has {} numbers, not {each} each", all.len())).into());
    }
    Ok(Some(all))
}

fn triangles(parameters: &Parameters, at: &At) -> Result<Mesh> {
    let positions = vectors(parameters, "P")?;
    if positions.is_empty() {
        return Err(at.problem("the shape has no points `P`").into());
    }
    let indices = indices(parameters, positions.len(), 3, at)?.unwrap_or_else(|| vec![0, 1, 2]);
    let normals = vectors(parameters, "N")?;
    let uv = parameters.get("uv").or(parameters.get("st")).map(|uv| uv.numbers.as_chunks::<2>().0.to_vec());
    let fits = |found: usize, name: &str| match found == positions.len() {
        true => Ok(()),
        false => Err(at.problem(format!("has {} points, but {found} of `{name}`", positions.len()))),
    };
    if !normals.is_empty() {
        fits(normals.len(), "N")?;
    }
    if let Some(uv) = &uv {
        fits(uv.len(), "uv")?;
    }
    for unread in ["S", "faceIndices", "alpha", "displacement"] {
        // What would change the picture is said where materials are.
        if unread != "alpha" && unread != "displacement" {
            parameters.get(unread);
        }
    }
    Ok(Mesh {
        positions,
        normals: (!normals.is_empty()).then_some(normals),
        uv: uv.map(|uv| uv.into_iter().map(DVec2::from_array).collect()),
        triangles: indices.as_chunks::<3>().0.to_vec(),
    })
}

/// Whether all triangles are turned to where the normals of their corners point.
fn agrees(mesh: &Mesh) -> bool {
    let Some(normals) = &mesh.normals else { return true };
    mesh.triangles.iter().all(|t| {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        let sum: DVec3 = t.iter().map(|i| normals[*i as usize]).sum();
        (b - a).cross(c - a).dot(sum) >= 0.0
    })
}

/// A triangle of pbrt has its front where the normals of its corners are.
fn turn_to_normals(mesh: &mut Mesh) {
    let Some(normals) = &mesh.normals else { return };
    for t in &mut mesh.triangles {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        let sum: DVec3 = t.iter().map(|i| normals[*i as usize]).sum();
        if (b - a).cross(c - a).dot(sum) < 0.0 {
            t.swap(1, 2);
        }
    }
}

fn area(mesh: &Mesh) -> f64 {
    let of = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        0.5 * (b - a).cross(c - a).length()
    };
    mesh.triangles.iter().map(of).sum()
}

/// Neighbours of each vertex, counter-clockwise, and whether they go all around it; of one that lies on a boundary from one end of it to the other.
fn rings(count: usize, triangles: &[[u32; 3]]) -> Vec<(Vec<u32>, bool)> {
    let mut pairs = vec![Vec::new(); count];
    for t in triangles {
        (0..3).for_each(|i| pairs[t[i] as usize].push([t[(i + 1) % 3], t[(i + 2) % 3]]));
    }
    let ring = |pairs: &Vec<[u32; 2]>| {
        let begins = pairs.iter().find(|[a, _]| pairs.iter().all(|[_, b]| a != b));
        let Some([first, _]) = begins.or(pairs.first()) else { return (Vec::new(), false) };
        let mut ring = vec![*first];
        while let Some([_, b]) = pairs.iter().find(|[a, _]| Some(a) == ring.last())
            && b != first
            && ring.len() <= pairs.len()
        {
            ring.push(*b);
        }
        (ring, begins.is_none())
    };
    pairs.iter().map(ring).collect()
}

/// Where the vertices lie on the surface that endless refinement would lead to, and its normals there; these point as pbrt's do, to where
/// triangles run clockwise.
fn to_the_limit(mesh: &mut Mesh) {
    let rings = rings(mesh.positions.len(), &mesh.triangles);
    let at = |positions: &[DVec3], ring: &[u32]| ring.iter().map(|i| positions[*i as usize]).collect::<Vec<DVec3>>();
    let limits = mesh.positions.iter().zip(&rings).map(|(p, (ring, is_whole))| {
        let near = at(&mesh.positions, ring);
        let n = near.len() as f64;
        match (&near[..], is_whole) {
            ([], _) => *p,
            (_, true) => {
                let beta = if near.len() == 3 { 3.0 / 16.0 } else { 3.0 / (8.0 * n) };
                let weight = 1.0 / (n + 3.0 / (8.0 * beta));
                (1.0 - n * weight) * *p + weight * near.iter().sum::<DVec3>()
            }
            ([first, .., last], false) => 0.6 * *p + 0.2 * (*first + *last),
            ([_], false) => *p,
        }
    });
    let limits: Vec<DVec3> = limits.collect();
    let normals = limits.iter().zip(&rings).map(|(p, (ring, is_whole))| {
        let near = at(&limits, ring);
        let n = near.len();
        // Tangents by the eigenvectors of refinement (Hoppe and others 1994).
        let (s, t) = match &near[..] {
            _ if *is_whole => {
                let turn = |j: usize| TAU * j as f64 / n as f64;
                let sum = |f: fn(f64) -> f64| near.iter().enumerate().map(|(j, q)| f(turn(j)) * *q).sum::<DVec3>();
                (-sum(f64::cos), sum(f64::sin))
            }
            [a, b] => (*b - *a, *a + *b - 2.0 * *p),
            [a, b, c] => (*c - *a, *b - *p),
            [a, b, c, d] => (*d - *a, 2.0 * (*b + *c) - *a - *d - 2.0 * *p),
            [a, .., z] => {
                let theta = PI / (n - 1) as f64;
                let inner: DVec3 = (1..n - 1).map(|k| (k as f64 * theta).sin() * near[k]).sum();
                (*z - *a, -(theta.sin() * (*a + *z) + (2.0 * theta.cos() - 2.0) * inner))
            }
            _ => (DVec3::ZERO, DVec3::ZERO),
        };
        s.cross(t).normalize_or(DVec3::Z)
    });
    mesh.normals = Some(normals.collect());
    mesh.positions = limits;
}

/// Loop's subdivision (1987), with the rules of boundaries, and its limit.
fn subdivided(base: Mesh, levels: u32, at: &At) -> Result<Mesh> {
    use std::collections::BTreeMap;
    let mut mesh = Mesh { normals: None, uv: None, ..base };
    for _ in 0..levels {
        if mesh.triangles.len() > 5_000_000 {
            return Err(at.problem("the surface has more than 20 million triangles when it is refined").into());
        }
        // Of each edge the corners opposite; of each vertex its neighbours, and those along a boundary.
        let mut edges: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
        for t in &mesh.triangles {
            for i in 0..3 {
                let (a, b) = (t[i], t[(i + 1) % 3]);
                edges.entry([a.min(b), a.max(b)]).or_default().push(t[(i + 2) % 3]);
            }
        }
        let count = mesh.positions.len();
        let mut around = vec![Vec::new(); count];
        let mut boundary = vec![Vec::new(); count];
        for (&[a, b], opposite) in &edges {
            around[a as usize].push(b);
            around[b as usize].push(a);
            if opposite.len() == 1 {
                boundary[a as usize].push(b);
                boundary[b as usize].push(a);
            }
        }
        let p = |i: u32| mesh.positions[i as usize];
        let mut positions: Vec<DVec3> = (0..count as u32)
            .map(|i| match &boundary[i as usize][..] {
                [] => {
                    let neighbours = &around[i as usize];
                    let n = neighbours.len().max(1) as f64;
                    let beta = if neighbours.len() == 3 { 3.0 / 16.0 } else { 3.0 / (8.0 * n) };
                    let sum: DVec3 = neighbours.iter().map(|j| p(*j)).sum();
                    (1.0 - n * beta) * p(i) + beta * sum
                }
                [a, b] => 0.75 * p(i) + 0.125 * (p(*a) + p(*b)),
                _ => p(i),
            })
            .collect();
        let mut middle: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        for (&[a, b], opposite) in &edges {
            middle.insert([a, b], positions.len() as u32);
            positions.push(match opposite[..] {
                [c, d] => 0.375 * (p(a) + p(b)) + 0.125 * (p(c) + p(d)),
                _ => 0.5 * (p(a) + p(b)),
            });
        }
        let of = |a: u32, b: u32| middle[&[a.min(b), a.max(b)]];
        let split = mesh.triangles.iter().flat_map(|&[a, b, c]| {
            let (ab, bc, ca) = (of(a, b), of(b, c), of(c, a));
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        });
        mesh = Mesh { triangles: split.collect(), positions, normals: None, uv: None };
    }
    to_the_limit(&mut mesh);
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A regular octahedron becomes a body without corners, of the volume that Loop's rules leave; all its vertices stay alike.
    #[test]
    fn loops_rules_keep_what_is_alike_alike() {
        let positions = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z].to_vec();
        let triangles = vec![[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]];
        let at = At { file: std::path::Path::new("a").into(), line: 1 };
        let base = Mesh { positions, triangles, ..Mesh::default() };
        let once = subdivided(base.clone(), 1, &at).unwrap();
        assert_eq!((once.positions.len(), once.triangles.len()), (18, 32));
        // A corner has 1 - 4 · 3/32 of itself, and four neighbours that cancel. Its limit, 1 - 4/8 of itself and 1/8 of each neighbour,
        // is the same whether the mesh was refined before or not.
        let never = subdivided(base.clone(), 0, &at).unwrap();
        for mesh in [&once, &never] {
            assert!(mesh.positions[..6].iter().all(|p| (p.length() - 0.5).abs() < 1e-12), "{:?}", mesh.positions);
            // Along its axis, inward: that is where triangles run clockwise.
            let normals = mesh.normals.as_ref().unwrap();
            assert!((0..6).all(|i| normals[i].dot(mesh.positions[i].normalize()) < -1.0 + 1e-9), "{normals:?}");
        }
        // No vertex of a coarse limit is off that of a fine one.
        let thrice = subdivided(base.clone(), 3, &at).unwrap();
        assert!((0..18).all(|i| once.positions[i].distance(thrice.positions[i]) < 1e-12));
        let plane = Mesh {
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(1.0, 1.0, 0.0)],
            triangles: vec![[0, 1, 2], [1, 3, 2]],
            ..Mesh::default()
        };
        let fine = subdivided(plane, 2, &at).unwrap();
        assert!(fine.positions.iter().all(|p| p.z == 0.0) && fine.triangles.len() == 32);
        assert!(fine.normals.unwrap().iter().all(|n| n.z < -1.0 + 1e-9));
    }
}
