//! Nodes with their transforms, and the triangles of their meshes.

use std::collections::HashMap;
use std::rc::Rc;

use glam::{DAffine3, DMat3, DQuat, DVec3};
use gltf_json::mesh::{Mode, Primitive, Semantic};
use gltf_json::scene::Node;
use gltf_json::validation::Checked;

use super::File;
use super::accessor::missing;
use crate::format::mesh::{Labels, Mesh, Part, Place};

/// Triangles that a file may be made to have by placing its meshes many times.
const MOST_COPIED: usize = 20_000_000;

/// The extension by which a node's mesh stands in many places.
const INSTANCING: &str = "EXT_mesh_gpu_instancing";

/// A node where its parents put it.
#[derive(Debug, Clone, Copy)]
pub struct Placed {
    /// Index into `nodes`.
    pub node: usize,
    pub to_world: DAffine3,
}

/// A mesh, and where it stands.
#[derive(Debug)]
pub struct Standing {
    /// A part for each primitive: where the mesh stands once, of the world, else of the mesh itself.
    pub mesh: Mesh,
    pub places: Vec<DAffine3>,
}

impl File {
    /// The nodes of the scene that the file shows first, or of the node of this name (which must be the only one) and what hangs on
    /// it; parents before their children.
    ///
    /// # Errors
    /// A sentence.
    pub fn nodes(&self, name: Option<&str>) -> Result<Vec<Placed>, String> {
        let placed = self.all_nodes()?;
        let Some(name) = name else { return Ok(placed) };
        let named: Vec<usize> =
            placed.iter().map(|p| p.node).filter(|node| self.root.nodes[*node].name.as_deref() == Some(name)).collect();
        match named[..] {
            [root] => {
                let mut below = vec![false; self.root.nodes.len()];
                below[root] = true;
                for Placed { node, .. } in &placed {
                    if below[*node] {
                        for child in self.root.nodes[*node].children.iter().flatten() {
                            below[child.value()] = true;
                        }
                    }
                }
                Ok(placed.into_iter().filter(|p| below[p.node]).collect())
            }
            [] => {
                let mut names: Vec<String> = Vec::new();
                for Placed { node, .. } in &placed {
                    let name = self.root.nodes[*node].name.as_ref().map(|name| format!("\"{}\"", name.escape_debug()));
                    if let Some(name) = name.filter(|name| names.len() < 20 && !names.contains(name)) {
                        names.push(name);
                    }
                }
                Err(match names.len() {
                    0 => format!("has no node \"{}\": none has a name", name.escape_debug()),
                    _ => format!("has no node \"{}\"; it has {}", name.escape_debug(), names.join(", ")),
                })
            }
            _ => Err(format!("has {} nodes named \"{}\"", named.len(), name.escape_debug())),
        }
    }

    fn all_nodes(&self) -> Result<Vec<Placed>, String> {
        let root = &self.root;
        let scene = root.scene.map(|scene| scene.value());
        let roots: Vec<usize> = match (scene.or((!root.scenes.is_empty()).then_some(0)), root.nodes.len()) {
            (Some(scene), _) => {
                let found = root.scenes.get(scene).ok_or_else(|| missing("scene", "scene", scene))?;
                found.nodes.iter().map(|node| node.value()).collect()
            }
            (None, count) => {
                let mut is_child = vec![false; count];
                for child in root.nodes.iter().flat_map(|node| node.children.iter().flatten()) {
                    is_child.get_mut(child.value()).into_iter().for_each(|is| *is = true);
                }
                (0..count).filter(|node| !is_child[*node]).collect()
            }
        };
        let mut seen = vec![false; root.nodes.len()];
        let mut placed = Vec::new();
        // Children are put on the stack in reverse, so that they come out as they are written.
        let mut waiting: Vec<(usize, DAffine3, String)> = Vec::new();
        let named = |list: Vec<usize>, of: DAffine3, at: &str| -> Vec<(usize, DAffine3, String)> {
            list.into_iter().rev().map(|node| (node, of, at.to_owned())).collect()
        };
        waiting.extend(named(roots, DAffine3::IDENTITY, "scenes"));
        while let Some((index, parent, at)) = waiting.pop() {
            let node = root.nodes.get(index).ok_or_else(|| missing(&at, "node", index))?;
            if std::mem::replace(&mut seen[index], true) {
                return Err(format!("`nodes[{index}]` hangs on more than one node: nodes must be trees"));
            }
            let to_world = parent * transform(node, index)?;
            placed.push(Placed { node: index, to_world });
            let children = node.children.iter().flatten().map(|child| child.value()).collect();
            waiting.extend(named(children, to_world, &format!("nodes[{index}].children")));
        }
        Ok(placed)
    }

    /// The triangles of all meshes of [`Self::nodes`], a part for each primitive of each node.
    ///
    /// # Errors
    /// A sentence.
    pub fn mesh(&self, node: Option<&str>) -> Result<Mesh, String> {
        let mut primitives = Primitives::new(self);
        let mut mesh = Mesh::default();
        let mut count = 0;
        for placed in self.nodes(node)? {
            for to_world in self.places(&placed)? {
                for part in primitives.of_node(&Placed { to_world, ..placed }, &mut mesh)? {
                    count += part.triangles.len();
                    if count > MOST_COPIED.max(primitives.triangles) {
                        return Err(format!(
                            "has more than {MOST_COPIED} triangles once its meshes stand at all their places: give it in pieces, by \
                             `node`, or `spectile import` it"
                        ));
                    }
                    mesh.parts.push(part);
                }
            }
        }
        if mesh.parts.is_empty() {
            let of = node.map_or_else(String::new, |name| format!(" on the node \"{}\"", name.escape_debug()));
            return Err(format!("has no triangles{of}"));
        }
        Ok(mesh)
    }

    /// The meshes of the nodes of the scene that the file shows first, each once, in the order of their first nodes.
    ///
    /// # Errors
    /// A sentence.
    pub fn standing(&self) -> Result<Vec<Standing>, String> {
        let mut primitives = Primitives::new(self);
        let mut places: Vec<(Placed, Vec<DAffine3>)> = Vec::new();
        let mut known: HashMap<usize, usize> = HashMap::new();
        for placed in self.nodes(None)? {
            // Each node may ask for what is not supported.
            self.check_node(&placed)?;
            let Some(mesh) = self.root.nodes[placed.node].mesh else { continue };
            let at = *known.entry(mesh.value()).or_insert(places.len());
            if at == places.len() {
                places.push((placed, Vec::new()));
            }
            places[at].1.extend(self.places(&placed)?);
        }
        let standing = places.into_iter().filter(|(_, places)| !places.is_empty()).map(|(first, places)| {
            let mut mesh = Mesh::default();
            let to_world = if let [only] = places[..] { only } else { DAffine3::IDENTITY };
            mesh.parts = primitives.of_node(&Placed { to_world, ..first }, &mut mesh)?;
            Ok(Standing { mesh, places })
        });
        standing.collect()
    }

    /// Where a node's mesh stands: at the node, or by EXT_mesh_gpu_instancing at places around it.
    fn places(&self, placed: &Placed) -> Result<Vec<DAffine3>, String> {
        let extensions = self.root.nodes[placed.node].extensions.as_ref();
        let Some(instancing) = extensions.and_then(|e| e.others.get(INSTANCING)) else {
            return Ok(vec![placed.to_world]);
        };
        let path = format!("nodes[{}].extensions.{INSTANCING}.attributes", placed.node);
        let attributes = instancing["attributes"].as_object().ok_or_else(|| format!("`{path}` is missing"))?;
        let index = |name: &str| -> Result<Option<usize>, String> {
            let Some(value) = attributes.get(name) else { return Ok(None) };
            let index = value.as_u64().and_then(|index| usize::try_from(index).ok());
            index.map(Some).ok_or_else(|| format!("`{path}.{name}` is no accessor"))
        };
        let at = |name: &str| format!("{path}.{name}");
        let moved = index("TRANSLATION")?.map(|index| self.vectors::<3>(index, &at("TRANSLATION"))).transpose()?;
        let turned = index("ROTATION")?.map(|index| self.vectors::<4>(index, &at("ROTATION"))).transpose()?;
        let scaled = index("SCALE")?.map(|index| self.vectors::<3>(index, &at("SCALE"))).transpose()?;
        let counts = [moved.as_ref().map(Vec::len), turned.as_ref().map(Vec::len), scaled.as_ref().map(Vec::len)];
        let count = counts.iter().flatten().next().copied().ok_or_else(|| format!("`{path}` has no place"))?;
        if counts.iter().flatten().any(|other| *other != count) {
            return Err(format!("`{path}` has lists of different lengths"));
        }
        let place = |i: usize| {
            let rotation = turned.as_ref().map_or(DQuat::IDENTITY, |all| DQuat::from_array(all[i]));
            if !(rotation.is_finite() && rotation.length_squared() > 1e-12) {
                return Err(format!("`{path}.ROTATION` has no rotation at place {i}"));
            }
            let within = DAffine3::from_scale_rotation_translation(
                scaled.as_ref().map_or(DVec3::ONE, |all| DVec3::from_array(all[i])),
                rotation.normalize(),
                moved.as_ref().map_or(DVec3::ZERO, |all| DVec3::from_array(all[i])),
            );
            let to_world = placed.to_world * within;
            if !to_world.is_finite() {
                return Err(format!("`{path}` is not finite at place {i}"));
            }
            Ok(to_world)
        };
        (0..count).map(place).collect()
    }

    /// Refuses what changes the mesh of a node and is not supported.
    fn check_node(&self, placed: &Placed) -> Result<(), String> {
        let node = &self.root.nodes[placed.node];
        let at = format!("nodes[{}]", placed.node);
        let hidden = node.extensions.iter().filter_map(|e| e.others.get("KHR_node_visibility"));
        if hidden.into_iter().any(|visibility| visibility["visible"] == false) {
            return Err(format!(
                "`{at}` is hidden by KHR_node_visibility, which is not supported: export without what is hidden"
            ));
        }
        let Some(index) = node.mesh.map(|mesh| mesh.value()) else { return Ok(()) };
        let of = self.root.meshes.get(index).ok_or_else(|| missing(&format!("{at}.mesh"), "mesh", index))?;
        if node.skin.is_some() {
            return Err(format!("`{at}` has a skin, which is not supported: apply its pose before exporting"));
        }
        let weights = node.weights.as_ref().or(of.weights.as_ref());
        if weights.is_some_and(|weights| weights.iter().any(|weight| *weight != 0.0)) {
            return Err(format!("`{at}` is morphed, which is not supported: apply the shape before exporting"));
        }
        Ok(())
    }

    /// The name that material `index` goes by: its own, or `material N` where it has none.
    pub fn material_name(&self, index: usize) -> String {
        let name = self.root.materials.get(index).and_then(|material| material.name.clone());
        name.filter(|name| !name.is_empty()).unwrap_or_else(|| format!("material {index}"))
    }
}

/// Where a node is within its parent.
fn transform(node: &Node, index: usize) -> Result<DAffine3, String> {
    let at = format!("nodes[{index}]");
    let affine = match node.matrix {
        Some(_) if node.scale.is_some() || node.rotation.is_some() || node.translation.is_some() => {
            return Err(format!(
                "`{at}` has a matrix and a translation, rotation or scale: only one of both says where it is"
            ));
        }
        Some(m) => {
            if [m[3], m[7], m[11], m[15]] != [0.0, 0.0, 0.0, 1.0] {
                return Err(format!("`{at}.matrix` has a last row that is not 0, 0, 0, 1"));
            }
            let column = |i: usize| DVec3::new(m[i].into(), m[i + 1].into(), m[i + 2].into());
            DAffine3 { matrix3: DMat3::from_cols(column(0), column(4), column(8)), translation: column(12) }
        }
        None => {
            let [x, y, z, w] = node.rotation.map_or([0.0, 0.0, 0.0, 1.0], |rotation| rotation.0.map(f64::from));
            let rotation = DQuat::from_xyzw(x, y, z, w);
            if rotation.length_squared() < 1e-12 || !rotation.is_finite() {
                return Err(format!("`{at}.rotation` is no rotation"));
            }
            DAffine3::from_scale_rotation_translation(
                node.scale.map_or(DVec3::ONE, |scale| DVec3::from_array(scale.map(f64::from))),
                rotation.normalize(),
                node.translation.map_or(DVec3::ZERO, |by| DVec3::from_array(by.map(f64::from))),
            )
        }
    };
    if !affine.is_finite() {
        return Err(format!("`{at}` has a transform that is not finite"));
    }
    Ok(affine)
}

/// A primitive in the space of its mesh.
#[derive(Debug, Default)]
struct Local {
    positions: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    uv: Option<Vec<[[f64; 2]; 3]>>,
    normals: Option<Vec<[[f64; 3]; 3]>>,
}

/// Reads primitives and the accessors that they share, each once.
struct Primitives<'f> {
    file: &'f File,
    read: HashMap<(usize, usize), Rc<Local>>,
    three: HashMap<usize, Rc<Vec<[f64; 3]>>>,
    two: HashMap<usize, Rc<Vec<[f64; 2]>>>,
    /// Those of all that have been read, each once.
    triangles: usize,
}

impl<'f> Primitives<'f> {
    fn new(file: &'f File) -> Self {
        Primitives { file, read: HashMap::new(), three: HashMap::new(), two: HashMap::new(), triangles: 0 }
    }

    fn of_node(&mut self, placed: &Placed, mesh: &mut Mesh) -> Result<Vec<Part>, String> {
        let file = self.file;
        file.check_node(placed)?;
        let node = &file.root.nodes[placed.node];
        let Some(index) = node.mesh.map(|mesh| mesh.value()) else { return Ok(Vec::new()) };
        let of = &file.root.meshes[index];
        let mut parts = Vec::new();
        for (i, primitive) in of.primitives.iter().enumerate() {
            let path = format!("meshes[{index}].primitives[{i}]");
            let mode = match primitive.mode {
                Checked::Valid(mode) => mode,
                Checked::Invalid => return Err(format!("`{path}.mode` is unknown")),
            };
            if matches!(mode, Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
                mesh.without_surface += 1;
                continue;
            }
            let local = self.local(index, i, primitive, mode, &path)?;
            if local.triangles.is_empty() {
                continue;
            }
            let material = primitive.material.map(|material| material.value());
            if let Some(material) = material.filter(|material| *material >= file.root.materials.len()) {
                return Err(missing(&format!("{path}.material"), "material", material));
            }
            let labels = Labels {
                object: node.name.clone(),
                group: None,
                material: material.map(|material| file.material_name(material)),
            };
            parts.push(moved(&local, placed.to_world, labels, Place::Json(path)));
        }
        Ok(parts)
    }

    fn local(
        &mut self,
        mesh: usize,
        index: usize,
        primitive: &Primitive,
        mode: Mode,
        path: &str,
    ) -> Result<Rc<Local>, String> {
        if let Some(known) = self.read.get(&(mesh, index)) {
            return Ok(known.clone());
        }
        if let Some(name) =
            primitive.extensions.iter().flat_map(|e| e.others.keys()).find(|name| name.contains("compression"))
        {
            return Err(format!("`{path}` is compressed by {name}, which is not supported: export without it"));
        }
        let attribute = |semantic: Semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(|a| a.value());
        let at = |name: &str| format!("{path}.attributes.{name}");
        let Some(of_positions) = attribute(Semantic::Positions) else {
            return Err(format!("`{path}` has no POSITION"));
        };
        let positions = read_once(self.file, &mut self.three, of_positions, &at("POSITION"))?;
        let count = positions.len();
        let order: Vec<u32> = match primitive.indices {
            Some(indices) => {
                let indices = self.file.vectors::<1>(indices.value(), &format!("{path}.indices"))?;
                let outside = |[index]: &&[f64; 1]| !(0.0..count as f64).contains(index) || index.fract() != 0.0;
                if let Some([index]) = indices.iter().find(outside) {
                    return Err(format!("`{path}.indices` names vertex {index} of {count}"));
                }
                indices.iter().map(|[index]| *index as u32).collect()
            }
            None => (0..u32::try_from(count).map_err(|_| format!("`{path}` has {count} vertices"))?).collect(),
        };
        let triangles = triangles(&order, mode)
            .ok_or_else(|| format!("`{path}` has {} corners, which make no whole number of triangles", order.len()))?;
        let attributes = |what: &str, found: usize| {
            if found == count { Ok(()) } else { Err(format!("`{path}` has {count} positions, but {found} of {what}")) }
        };
        let mut uv = None;
        if let Some(index) = attribute(Semantic::TexCoords(0)) {
            let all = read_once(self.file, &mut self.two, index, &at("TEXCOORD_0"))?;
            attributes("TEXCOORD_0", all.len())?;
            // In glTF v runs down.
            let corner = |i: u32| [all[i as usize][0], 1.0 - all[i as usize][1]];
            uv = Some(triangles.iter().map(|t| t.map(corner)).collect::<Vec<_>>());
        }
        let mut normals = None;
        if let Some(index) = attribute(Semantic::Normals) {
            let all = read_once(self.file, &mut self.three, index, &at("NORMAL"))?;
            attributes("NORMAL", all.len())?;
            normals = Some(triangles.iter().map(|t| t.map(|i| all[i as usize])).collect::<Vec<_>>());
        }
        let (positions, triangles) = compact(&positions, triangles);
        let finite = positions.iter().flatten().chain(uv.iter().flatten().flatten().flatten());
        if finite.chain(normals.iter().flatten().flatten().flatten()).any(|x| !x.is_finite()) {
            return Err(format!("`{path}` has a position, normal or texture coordinate that is not finite"));
        }
        self.triangles += triangles.len();
        let local = Rc::new(Local { positions, triangles, uv, normals });
        self.read.insert((mesh, index), local.clone());
        Ok(local)
    }
}

fn read_once<const N: usize>(
    file: &File,
    read: &mut HashMap<usize, Rc<Vec<[f64; N]>>>,
    index: usize,
    at: &str,
) -> Result<Rc<Vec<[f64; N]>>, String> {
    if let Some(known) = read.get(&index) {
        return Ok(known.clone());
    }
    let vectors = Rc::new(file.vectors::<N>(index, at)?);
    read.insert(index, vectors.clone());
    Ok(vectors)
}

/// The corners of each triangle; `None` where some are left over. glTF 2.0, section 3.7.2.1.
fn triangles(order: &[u32], mode: Mode) -> Option<Vec<[u32; 3]>> {
    match mode {
        Mode::TriangleStrip => {
            let turned = |(i, t): (usize, &[u32])| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[0], t[2], t[1]] };
            (order.len() >= 3).then(|| order.windows(3).enumerate().map(turned).collect())
        }
        Mode::TriangleFan => {
            let (hub, rim) = order.split_first()?;
            (rim.len() >= 2).then(|| rim.windows(2).map(|edge| [*hub, edge[0], edge[1]]).collect())
        }
        _ => {
            let (triangles, rest) = order.as_chunks::<3>();
            rest.is_empty().then(|| triangles.to_vec())
        }
    }
}

/// Those positions alone that triangles have, in the order of their first use: primitives often share one long list.
fn compact(all: &[[f64; 3]], mut triangles: Vec<[u32; 3]>) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let mut positions = Vec::new();
    let mut first = |old: u32, slot: &mut u32| {
        if *slot == u32::MAX {
            *slot = positions.len() as u32;
            positions.push(all[old as usize]);
        }
        *slot
    };
    if triangles.len() < all.len() / 16 {
        let mut places: HashMap<u32, u32> = HashMap::new();
        for corner in triangles.iter_mut().flatten() {
            *corner = first(*corner, places.entry(*corner).or_insert(u32::MAX));
        }
    } else {
        let mut places = vec![u32::MAX; all.len()];
        for corner in triangles.iter_mut().flatten() {
            *corner = first(*corner, &mut places[*corner as usize]);
        }
    }
    (positions, triangles)
}

/// The front stays the front: under mirroring corners change their order.
fn moved(local: &Local, to_world: DAffine3, labels: Labels, place: Place) -> Part {
    let determinant = to_world.matrix3.determinant();
    let mirrored = determinant < 0.0;
    fn turned<T: Copy>(corners: &[[T; 3]], mirrored: bool) -> Vec<[T; 3]> {
        corners.iter().map(|[a, b, c]| if mirrored { [*b, *a, *c] } else { [*a, *b, *c] }).collect()
    }
    let place_of = |p: &[f64; 3]| to_world.transform_point3(DVec3::from_array(*p)).to_array();
    // What is flattened has no area, hence no normals.
    let normals = local.normals.as_ref().filter(|_| determinant != 0.0).map(|normals| {
        let matrix = to_world.matrix3.inverse().transpose();
        let mut normals = turned(normals, mirrored);
        normals.iter_mut().flatten().for_each(|n| *n = (matrix * DVec3::from_array(*n)).to_array());
        normals
    });
    Part {
        labels,
        place,
        positions: local.positions.iter().map(place_of).collect(),
        triangles: turned(&local.triangles, mirrored),
        uv: local.uv.as_ref().map(|uv| turned(uv, mirrored)),
        normals,
    }
}
