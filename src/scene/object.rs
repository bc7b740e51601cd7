//! `[[objects]]`: a shape, a material, and what it emits.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::closed;
use super::decode::{Fields, Item, list};
use super::keys;
use super::material::{Materials, Needs};
use super::medium::Media;
use super::shape::{self, Replaced};
use super::spectrum::{Handle, Quantity, Spectra, report_in_file};
use super::texture;
use super::transform;
use super::tree::Value;
use super::{AssemblyId, Attributes, Emission, Interior, MaterialId, MediumId, Object, Shape, Sides};
use crate::error::Problem;
use crate::format::gltf;
use crate::format::mesh::{self, Format, Mesh, Part, Place};

/// Decodes objects one after the other; a mesh file is read once.
pub struct Objects<'s, 'a> {
    pub spectra: &'s mut Spectra<'a>,
    pub materials: &'s mut Materials<'a>,
    pub media: &'s mut Media<'a>,
    /// `None` where the file is wrong, which has been said.
    meshes: HashMap<PathBuf, Option<Loaded>>,
    /// Meshes that have been read and not been asked for yet.
    ahead: HashMap<PathBuf, Result<Loaded, Box<Problem>>>,
    scene: Vec<Object>,
    /// Whose part the next object is.
    assembly: Option<AssemblyId>,
    /// Interiors so far.
    bodies: usize,
}

/// A mesh file in memory.
#[derive(Clone)]
enum Loaded {
    Mesh(Format, Arc<Mesh>),
    /// Of which each object may have another node.
    Gltf(Arc<gltf::File>),
}

/// What all pieces of one object share. An outer `None` is a mistake that has been said; the rest of the object is
/// still looked at.
struct Common {
    affine: Option<DAffine3>,
    emission: Option<Option<(Radiates, Sides)>>,
    interior: Option<Option<Filling>>,
}

/// What an emission is: on the whole, and by a texture.
#[derive(Clone, Copy)]
struct Radiates {
    mean: Handle,
    texture: Option<texture::Handle>,
}

/// The medium of an interior, and the box around it in the object's own space.
#[derive(Clone, Copy)]
struct Filling {
    body: usize,
    medium: MediumId,
    bounds: [DVec3; 2],
}

/// What an object says about its material.
#[derive(Clone, Copy)]
enum Covering {
    Of(MaterialId),
    /// None: a null boundary.
    Invisible,
}

impl<'s, 'a> Objects<'s, 'a> {
    pub fn new(spectra: &'s mut Spectra<'a>, materials: &'s mut Materials<'a>, media: &'s mut Media<'a>) -> Self {
        let (meshes, ahead) = (HashMap::new(), HashMap::new());
        Objects { spectra, materials, media, meshes, ahead, scene: Vec::new(), assembly: None, bodies: 0 }
    }

    /// Decodes entries of `[[objects]]`, whose meshes are read by all cores at once.
    pub fn add_all(&mut self, items: &[Item<'a>]) {
        self.read_ahead(items);
        items.iter().for_each(|item| self.add(item));
    }

    fn read_ahead(&mut self, items: &[Item<'a>]) {
        let path = |item: &Item| match &item.member("mesh")?.node.value {
            Value::String(name) => Some(item.cx.path(name)),
            _ => None,
        };
        let mut paths: Vec<PathBuf> = items.iter().filter_map(path).collect();
        paths.sort();
        paths.dedup();
        paths.retain(|path| !self.meshes.contains_key(path));
        self.ahead = paths.into_par_iter().map(|path| (path.clone(), load(&path))).collect();
    }

    fn add(&mut self, item: &Item<'a>) {
        let Some(fields) = item.table(&keys::OBJECT) else { return };
        let shape = fields.exactly_one("shape");
        let group = fields.get("group");
        let node = fields.get("node");
        for of_mesh in [&group, &node].into_iter().flatten().filter(|_| !fields.has("mesh")) {
            of_mesh.error_help("goes with `mesh` only", "remove it");
        }
        let mut common = self.common(&fields);
        let named = fields.get("material");
        // An outer `None` has no material; an inner one is a mistake.
        let covering = match (&named, fields.get("interior")) {
            (Some(named), _) => Some(self.named_material(named).map(Covering::Of)),
            (None, Some(_)) => Some(self.null_boundary(&fields)),
            (None, None) => None,
        };
        let Some(shape) = shape else { return };

        if shape.path.ends_with(".mesh") {
            let Some((format, mesh)) = self.read(&shape, group.as_ref(), node.as_ref()) else { return };
            let Some(parts) = pick(&mesh, &shape, group.as_ref()) else { return };
            // A transform, or that of an instance, makes of it what its writer wants.
            if let Some(said) = mesh.unit.as_ref().filter(|_| !fields.has("transform") && self.assembly.is_none()) {
                fields.cx.warn(format!(
                    "{} says \"{}\", but its numbers are taken as metres: give the object a `transform` with the `scale` \
                     that makes metres of them (1 if they are)",
                    file_name(&shape),
                    said.escape_debug()
                ));
            }
            if fields.has("interior") {
                common.interior = self.filling(&fields, &Shape::Mesh(shape::join(&parts, Needs::default()).0));
            }
            match covering {
                Some(covering) => {
                    if let Some(Covering::Invisible) = covering {
                        self.warn_about_names(&shape, format, &parts);
                    }
                    self.push_mesh(&fields, &shape, format, &parts, covering, &common);
                }
                None => self.push_by_name(&fields, &shape, format, &parts, &common),
            }
            return;
        }
        let Some(local) = shape::decode(&shape) else { return };
        let Some(covering) = covering else {
            no_material(&fields, "the object has no `material`");
            return;
        };
        if fields.has("interior") {
            common.interior = self.filling(&fields, &local);
        }
        let kind = shape.path.rsplit('.').next().unwrap_or_default();
        let attributes = shape::attributes(&local, self.needs(covering, &common));
        let name = format!("{} ({kind})", item.path);
        self.place(&fields, name, (local, attributes), covering, &common);
    }

    /// Decodes the objects of an assembly.
    pub fn add_to(&mut self, assembly: AssemblyId, items: &[Item<'a>]) {
        self.assembly = Some(assembly);
        self.add_all(items);
        self.assembly = None;
    }

    /// Adds an object that is already decoded.
    pub fn push(&mut self, object: Object) {
        self.scene.push(object);
    }

    /// Takes all but the first `count` objects away again.
    pub fn forget_since(&mut self, count: usize) {
        self.scene.truncate(count);
    }

    /// Objects so far.
    pub fn count(&self) -> usize {
        self.scene.len()
    }

    /// All but the first `count` objects.
    pub fn since(&self, count: usize) -> &[Object] {
        &self.scene[count..]
    }

    pub fn finish(self) -> Vec<Object> {
        self.scene
    }

    fn common(&mut self, fields: &Fields<'a>) -> Common {
        let affine = fields.get("transform").map_or(Some(DAffine3::IDENTITY), |item| transform::decode(&item));
        let emission = fields.get("emission").map(|item| {
            if texture::is_texture(&item) {
                let (texture, mean) = self.materials.textures().light(&item, self.spectra)?;
                return Some(Radiates { mean, texture: Some(texture) });
            }
            let mean = self.spectra.resolve(&item, Quantity::Radiance)?;
            Some(Radiates { mean, texture: None })
        });
        let sides = match fields.get("emission_sides") {
            Some(item) => {
                if emission.is_none() {
                    item.cx.warn(format!("`{}` has no effect without `emission`", item.path));
                }
                item.choice(&[("front", Sides::Front), ("both", Sides::Both)])
            }
            None => Some(Sides::Front),
        };
        let emission = match emission {
            Some(radiance) => radiance.zip(sides).map(Some),
            None => sides.map(|_| None),
        };
        Common { affine, emission, interior: Some(None) }
    }

    /// An object that is nothing but the bound of its interior; `None` if it should be more.
    fn null_boundary(&self, fields: &Fields<'a>) -> Option<Covering> {
        let emission = fields.get("emission");
        if let Some(emission) = &emission {
            emission.error_help(
                "goes with a `material` only: without one the object is the invisible boundary of its interior",
                "give the object a material, or remove `emission`; a medium with a temperature emits by itself",
            );
        }
        emission.is_none().then_some(Covering::Invisible)
    }

    /// What `interior` says of an object whose shape, in its own space, is `local`.
    fn filling(&mut self, fields: &Fields<'a>, local: &Shape) -> Option<Option<Filling>> {
        let item = fields.get("interior")?;
        let medium = self.media.take(&item, self.spectra);
        if let Some(opening) = closed::opening(local) {
            item.error_help(
                format!("fills closed shapes only, but {opening}"),
                "use a sphere, a cube, or a mesh that is closed and whose faces are all turned outward",
            );
            return None;
        }
        self.bodies += 1;
        Some(Some(Filling { body: self.bodies - 1, medium: medium?, bounds: local.bounds() }))
    }

    /// A null boundary leaves names of materials alone that may have been meant.
    fn warn_about_names(&self, shape: &Item, format: Format, parts: &[&Part]) {
        let named = parts.iter().filter_map(|part| part.labels.material.as_deref());
        if let Some(name) = named.into_iter().find(|name| self.materials.has(name)) {
            shape.cx.warn(format!(
                "{}: its {} names, such as \"{name}\", are not used: without `material` the object is the invisible \
                 boundary of its interior",
                file_name(shape),
                word_of_materials(format)
            ));
        }
    }

    fn named_material(&mut self, item: &Item<'a>) -> Option<MaterialId> {
        let name = item.text()?;
        if !self.materials.has(name) {
            item.error_help(format!("no material is named \"{name}\""), self.materials.help(name));
        }
        self.materials.take(name, self.spectra)
    }

    /// The mesh that `item`, and `node` where it is glTF, name; a file is read once.
    fn read(
        &mut self,
        item: &Item<'a>,
        group: Option<&Item<'a>>,
        node: Option<&Item<'a>>,
    ) -> Option<(Format, Arc<Mesh>)> {
        let (_, path) = item.source()?;
        let loaded = match self.meshes.get(&path) {
            Some(known) => known.clone(),
            None => {
                let loaded = match item.data() {
                    Some(data) => data.mesh().map(|mesh| Loaded::Mesh(Format::Memory, mesh)),
                    None => self.ahead.remove(&path).unwrap_or_else(|| load(&path)),
                };
                let loaded = match loaded {
                    Ok(loaded) => Some(loaded),
                    Err(problem) => {
                        report_in_file(item, *problem);
                        None
                    }
                };
                if let Some(Loaded::Mesh(_, mesh)) = &loaded {
                    warn_about(item, mesh);
                }
                self.meshes.insert(path, loaded.clone());
                loaded
            }
        };
        match loaded? {
            Loaded::Mesh(format, mesh) => {
                for (key, kind) in [(node, "glTF"), (group.filter(|_| format != Format::Obj), "OBJ")] {
                    if let Some(key) = key {
                        key.error_help(format!("goes with {kind} meshes only"), "remove it");
                        return None;
                    }
                }
                Some((format, mesh))
            }
            Loaded::Gltf(file) => {
                if let Some(group) = group {
                    group.error_help("goes with OBJ meshes only", "use `node`, or remove it");
                    return None;
                }
                let name = match node {
                    Some(node) => Some(node.text()?),
                    None => None,
                };
                match file.mesh(name) {
                    Ok(mesh) => {
                        warn_about(item, &mesh);
                        Some((Format::Gltf, Arc::new(mesh)))
                    }
                    Err(message) => {
                        report_in_file(item, *file.problem(message));
                        None
                    }
                }
            }
        }
    }

    /// One object for each material that the file names, in its order.
    fn push_by_name(
        &mut self,
        fields: &Fields<'a>,
        shape: &Item<'a>,
        format: Format,
        parts: &[&Part],
        common: &Common,
    ) {
        let mut names: Vec<&str> = Vec::new();
        let mut bare = None;
        for part in parts {
            match part.labels.material.as_deref() {
                Some(name) if !names.contains(&name) => names.push(name),
                Some(_) => {}
                None => bare = bare.or(Some(&part.place)),
            }
        }
        let word = word_of_materials(format);
        if let Some(place) = bare {
            let file = file_name(shape);
            let message = match names.len() {
                0 => format!("the object has no `material`, and {file} no {word}"),
                _ => format!("the object has no `material`, and the faces from {place} of {file} have no {word}"),
            };
            no_material(fields, &message);
            return;
        }
        let unknown: Vec<&str> = names.iter().copied().filter(|name| !self.materials.has(name)).collect();
        if !unknown.is_empty() {
            shape.error_help(
                format!("{} uses materials that [materials] does not have: {}", file_name(shape), list(&unknown)),
                format!("define them, or set `material`; the file's {word} names are {}", list(&names)),
            );
        }
        for name in names {
            let of_name: Vec<&Part> =
                parts.iter().copied().filter(|part| part.labels.material.as_deref() == Some(name)).collect();
            let material = self.materials.take(name, self.spectra);
            self.push_mesh(fields, shape, format, &of_name, material.map(Covering::Of), common);
        }
    }

    /// The parts as one object; where their file named its material, that stands in its name.
    fn push_mesh(
        &mut self,
        fields: &Fields<'a>,
        shape: &Item<'a>,
        format: Format,
        parts: &[&Part],
        covering: Option<Covering>,
        common: &Common,
    ) {
        let needs = self.needs(covering, common);
        let bare = parts.iter().find(|part| (needs.uv || needs.tangent) && part.uv.is_none());
        if let (Some(part), Some(Covering::Of(material))) = (bare, covering) {
            let of_material = self.materials.needs(material);
            let what = match (of_material.uv, of_material.tangent) {
                (true, _) => format!("material \"{}\" is textured", self.materials.name(material)),
                (_, true) => format!("material \"{}\" has two roughnesses", self.materials.name(material)),
                _ => "the emission is textured".to_owned(),
            };
            let from = match &part.place {
                Place::Line(_) => "the faces from here on have".to_owned(),
                Place::File => "it has".to_owned(),
                place => format!("the triangles from {place} on have"),
            };
            let word = match format {
                Format::Obj => " (vt)",
                Format::Memory => " (`uv`)",
                _ => "",
            };
            let message = format!("{what}, but {from} no texture coordinates{word}");
            shape.cx.push(Problem {
                file: shape.source().unwrap_or_default().1,
                line: part.place.line(),
                key: Some(shape.path.clone()),
                message,
                help: Some("export the mesh with its UV map, or give it another material".to_owned()),
                ..Problem::default()
            });
            return;
        }
        let named = parts.first().and_then(|part| part.labels.material.as_ref()).filter(|_| !fields.has("material"));
        let label = named.map_or_else(String::new, |name| format!(", material \"{name}\""));
        let name = format!("{} ({}{label})", fields.path, file_name(shape));
        let (mesh, attributes) = shape::join(parts, needs);
        if needs.tangent {
            let count = shape::without_tangent(&attributes);
            if count > 0 {
                shape.cx.warn(format!(
                    "{name}: on {count} triangles the texture coordinates give no direction for its two roughnesses; \
                     their first edge does"
                ));
            }
        }
        self.place(fields, name, (Shape::Mesh(mesh), attributes), covering, common);
    }

    fn needs(&self, covering: Option<Covering>, common: &Common) -> Needs {
        let needs = match covering {
            Some(Covering::Of(material)) => self.materials.needs(material),
            _ => Needs::default(),
        };
        let lit = common.emission.flatten().is_some_and(|(radiates, _)| radiates.texture.is_some());
        Needs { uv: needs.uv || lit, ..needs }
    }

    /// Moves `local` into the world and adds it to the scene.
    fn place(
        &mut self,
        fields: &Fields<'a>,
        name: String,
        (local, mut attributes): (Shape, Attributes),
        covering: Option<Covering>,
        common: &Common,
    ) {
        let Some(affine) = common.affine else { return };
        let mut shape = match transform::apply(&affine, local) {
            Ok(shape) => shape,
            Err(message) => {
                let item = fields.get("transform");
                let (at, key) = item.as_ref().map_or((fields.at, fields.path.as_str()), |i| (i.at, i.path.as_str()));
                fields.cx.error(at, key, message, None);
                return;
            }
        };
        transform::apply_attributes(&affine, &mut attributes);
        if let Shape::Mesh(mesh) = &mut shape {
            let dropped = shape::drop_degenerate(mesh, &mut attributes);
            if mesh.triangles.is_empty() {
                fields.error_help(format!("{name} has no area: all its triangles are degenerate"), "correct the mesh");
                return;
            }
            if dropped > 0 {
                fields.cx.warn(format!("{name}: {dropped} triangles without area were dropped"));
            }
            let Replaced { without_length, behind } = shape::settle_normals(mesh, &mut attributes);
            if without_length > 0 {
                let warning =
                    format!("{name}: {without_length} vertex normals of length 0 are replaced by their triangle's");
                fields.cx.warn(warning);
            }
            if behind > 0 {
                let warning = format!(
                    "{name}: {behind} vertex normals point behind their triangle, whose front is where its corners run \
                     counter-clockwise; they are turned round"
                );
                fields.cx.warn(warning);
            }
        }
        let (Some(covering), Some(emission), Some(interior)) = (covering, common.emission, common.interior) else {
            return;
        };
        let material = match covering {
            Covering::Of(material) => Some(material),
            Covering::Invisible => None,
        };
        let interior = interior.map(|Filling { body, medium, bounds: [low, high] }| {
            let to_unit = DAffine3::from_scale((high - low).recip()) * DAffine3::from_translation(-low);
            Interior { body, medium, to_grid: to_unit * affine.inverse() }
        });
        let emission = emission.map(|(Radiates { mean, texture }, sides)| Emission {
            radiance: self.spectra.take(mean),
            sides,
            texture: texture.map(|texture| self.materials.textures().take(texture, self.spectra)),
        });
        let assembly = self.assembly;
        self.scene.push(Object { name, shape, attributes, material, emission, interior, assembly });
    }
}

fn no_material(fields: &Fields, message: &str) {
    let path = &fields.path;
    let help =
        "add e.g. `material = \"white\"`; for a lamp that reflects nothing, a material of kind `black`".to_owned();
    fields.cx.error(fields.at, &format!("{path}.material"), message, Some(help));
}

/// The parts that `group` picks, or all.
fn pick<'m>(mesh: &'m Mesh, shape: &Item, group: Option<&Item>) -> Option<Vec<&'m Part>> {
    let Some(group) = group else { return Some(mesh.parts.iter().collect()) };
    let wanted = group.text()?;
    let parts: Vec<&Part> = mesh.parts.iter().filter(|part| part.labels.in_group(wanted)).collect();
    if parts.is_empty() {
        let mut names: Vec<&str> = Vec::new();
        for label in mesh.parts.iter().flat_map(|p| [p.labels.object.as_deref(), p.labels.group.as_deref()]).flatten() {
            if !names.contains(&label) && names.len() < 20 {
                names.push(label);
            }
        }
        let help = if names.is_empty() {
            "the file has no groups".to_owned()
        } else {
            format!("groups with faces: {}", list(names))
        };
        group.error_help(format!("{} has no faces in a group or object \"{wanted}\"", file_name(shape)), help);
        return None;
    }
    Some(parts)
}

/// What a format calls the names of materials that it has.
fn word_of_materials(format: Format) -> &'static str {
    match format {
        Format::Obj => "usemtl",
        Format::Ply | Format::Stl | Format::Gltf | Format::Memory => "material",
    }
}

fn load(path: &Path) -> Result<Loaded, Box<Problem>> {
    let bytes = mesh::content(path)?;
    Ok(match Format::of(path, &bytes) {
        Format::Gltf => Loaded::Gltf(Arc::new(gltf::parse(&bytes, path)?)),
        format => Loaded::Mesh(format, Arc::new(mesh::parse(format, &bytes, path)?)),
    })
}

fn warn_about(item: &Item, mesh: &Mesh) {
    let file = file_name(item);
    if mesh.without_surface > 0 {
        item.cx.warn(format!("{file}: {} points and lines have no surface and are left out", mesh.without_surface));
    }
    if let Some((count, place)) = &mesh.flaws.bent {
        item.cx.warn(format!(
            "{file}: {count} faces of more than three corners, the first {}, do not lie in one plane: how they are cut \
             into triangles is a choice",
            place.on()
        ));
    }
    if let Some((count, place)) = &mesh.flaws.crossing {
        item.cx.warn(format!(
            "{file}: the outlines of {count} faces, the first {}, cross themselves: what they cover is not clear",
            place.on()
        ));
    }
    for note in &mesh.notes {
        item.cx.warn(format!("{file}: {note}"));
    }
}

/// The last part of the path that `item` spells.
fn file_name(item: &Item) -> String {
    match &item.node.value {
        Value::String(path) => path.rsplit(['/', '\\']).next().unwrap_or(path).to_owned(),
        Value::Data(data) => data.name().to_owned(),
        _ => String::new(),
    }
}
