//! Shapes, with their material and what they emit.

use std::path::Path;

use glam::{DAffine3, DMat3, DVec2, DVec3};

use super::bsdf::Made;
use super::colour::Of;
use super::values::{self, Plugin};
use super::xml::{Node, inside};
use super::{Importer, MOST_COPIES, at, serialized};
use crate::Result;
use crate::format::mesh::{self as meshes, Format};
use crate::import::geometry::{AROUND, Mesh, similarity, within_round};
use crate::import::media::{self, Boundary};
use crate::import::picture::Colour;
use crate::import::scene::Section;
use crate::import::text;

/// The faces of Mitsuba's cube: four corners each, from that of (0, 1) counter-clockwise by (1, 1), (1, 0) and (0, 0).
const FACES: [[[f64; 3]; 4]; 6] = [
    [[1., -1., -1.], [1., -1., 1.], [-1., -1., 1.], [-1., -1., -1.]],
    [[1., 1., -1.], [-1., 1., -1.], [-1., 1., 1.], [1., 1., 1.]],
    [[1., -1., -1.], [1., 1., -1.], [1., 1., 1.], [1., -1., 1.]],
    [[1., -1., 1.], [1., 1., 1.], [-1., 1., 1.], [-1., -1., 1.]],
    [[-1., -1., 1.], [-1., 1., 1.], [-1., 1., -1.], [-1., -1., -1.]],
    [[1., 1., -1.], [1., -1., -1.], [-1., -1., -1.], [-1., 1., -1.]],
];

/// From Spectile's own axes of a sphere, whose poles are ±y, to those of Mitsuba's, whose are ±z, with the same longitudes.
const POLES: DMat3 = DMat3::from_cols(DVec3::NEG_Y, DVec3::Z, DVec3::NEG_X);

/// A shape on its way to an object.
struct Placing<'a, 'n> {
    plugin: &'a Plugin<'n>,
    object: Section,
    /// What its mesh is called, if it becomes one.
    name: String,
    to_world: DAffine3,
    /// Whether its texture coordinates matter.
    textured: bool,
    /// Whether v of a file runs up.
    is_upward: bool,
    /// Whether its other side is the front.
    flipped: bool,
}

impl Placing<'_, '_> {
    /// Where a mesh has no texture coordinates Mitsuba takes those within each triangle: u is 1 at its second corner, v at its third.
    fn lay_out(&self, mesh: &mut Mesh) {
        if self.textured {
            let v = |v: f64| if self.is_upward { 1.0 - v } else { v };
            mesh.lay_out([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)].map(|(u, down)| DVec2::new(u, v(down))));
        }
    }

    /// The object of a mesh file.
    fn of_mesh(self, path: &str) -> Section {
        let object = self.object.with("mesh", text::quoted(path));
        match self.to_world == DAffine3::IDENTITY {
            true => object,
            false => object.with("transform", text::transform(&self.to_world)),
        }
    }
}

/// Normals as Mitsuba would have them.
fn shade(mesh: &mut Mesh, face_normals: bool) {
    match (face_normals, &mesh.normals) {
        (true, _) => mesh.normals = None,
        (false, None) => mesh.smooth(),
        _ => {}
    }
}

impl<'n> Importer<'n, '_> {
    /// Adds a shape within `outer`; shapes of a group may have a material of their instance.
    pub fn shape(&mut self, node: &'n Node, outer: &DAffine3, depth: Option<usize>) -> Result<()> {
        let node = self.resolve(node)?;
        let plugin = Plugin::new(node);
        match plugin.kind() {
            "shapegroup" => {
                // It is there for instances alone.
                return Ok(());
            }
            "instance" => return self.instance(&plugin, outer, depth.unwrap_or(0)),
            _ => {}
        }
        let to_world = *outer * plugin.transform("to_world")?;
        if to_world.matrix3.determinant() == 0.0 {
            self.scene.report.left_out(plugin.place(), "a shape whose `to_world` flattens it");
            return Ok(());
        }
        let is_obj = plugin.kind() == "obj";
        // Mitsuba's v runs down; where it turns that of a file, the file's runs up, and so does that of a sphere here.
        let is_upward = match plugin.kind() {
            "obj" | "ply" => plugin.boolean("flip_tex_coords", is_obj)?,
            kind => kind == "sphere",
        };
        let made = self.material_of(&plugin, !is_upward)?;
        let emission = self.emission(&plugin, !is_upward)?;
        let lit = emission.as_ref().is_some_and(|text| text.starts_with("{ texture"));
        let (material, textured) = match (made, emission.is_some()) {
            (Made::Material { name, is_textured }, _) => (Some(name), is_textured || lit),
            (Made::Nothing, true) => (Some(self.black()), lit),
            (Made::Nothing, false) if plugin.get("interior").is_some() => (None, false),
            (Made::Nothing, false) => {
                self.scene.report.left_out(plugin.place(), "a shape of which nothing is seen (BSDF `null`)");
                plugin.get("exterior");
                plugin.finish(&mut self.scene.report);
                return Ok(());
            }
        };
        let flipped = plugin.boolean("flip_normals", false)?;
        let coordinates = (textured, is_upward);
        let Some(mut object) = self.form(&plugin, &to_world, coordinates, flipped)? else { return Ok(()) };
        if let Some(id) = node.attribute("id") {
            object.comments.insert(0, values::shown(id));
        }
        let boundary = Boundary::of(self.scene, material.as_deref());
        let is_filled = self.fill(&plugin, &mut object, boundary)?;
        match material {
            Some(material) => object.set("material", text::quoted(&material)),
            None if is_filled => {}
            None => {
                plugin.finish(&mut self.scene.report);
                return Ok(());
            }
        }
        if let Some(emission) = emission {
            object.set("emission", emission);
        }
        // Two entries that read better at the end.
        if let Some(at) = object.entries.iter().position(|(key, _)| key == "transform") {
            let transform = object.entries.remove(at);
            object.entries.push(transform);
        }
        self.scene.objects.push(object);
        plugin.finish(&mut self.scene.report);
        self.scene.report.translated(format!("shape `{}`", plugin.kind()), plugin.place());
        Ok(())
    }

    /// Gives a shape the medium of its `interior`, if it has one; whether it did.
    fn fill(&mut self, plugin: &Plugin<'n>, object: &mut Section, boundary: Boundary) -> Result<bool> {
        if plugin.get("exterior").is_some() {
            self.scene.report.left_out(plugin.place(), "the `exterior` medium of a shape");
        }
        let Some(node) = plugin.get("interior") else { return Ok(false) };
        match self.medium(node)? {
            Some(name) => Ok(media::fill(self.scene, object, &name, boundary, plugin.place())),
            None => Ok(false),
        }
    }

    fn black(&mut self) -> String {
        if !self.scene.materials.iter().any(|section| section.header == "[materials.lamp.black]") {
            let name = self.scene.material_name("lamp");
            let section = self.scene.material(&name, "black");
            self.scene.materials.push(section);
        }
        "lamp".to_owned()
    }

    fn instance(&mut self, plugin: &Plugin<'n>, outer: &DAffine3, depth: usize) -> Result<()> {
        let to_world = *outer * plugin.transform("to_world")?;
        if depth > 8 {
            return Err(plugin.node.problem("has instances within more than 8 others").into());
        }
        for node in plugin.objects(&["ref", "shape"]) {
            let group = self.resolve(node)?;
            match self.group(group, depth)? {
                Some(id) if self.scene.assemblies[id].takes(&to_world) => {
                    self.scene.assemblies[id].place(to_world);
                    self.scene.report.translated("shape `instance`", plugin.place());
                }
                _ => {
                    self.copy_group(plugin, group, &to_world, depth)?;
                    self.scene.report.translated("shape `instance`, as a copy", plugin.place());
                }
            }
        }
        plugin.finish(&mut self.scene.report);
        Ok(())
    }

    /// The assembly that a group is; `None` where it has others in it.
    fn group(&mut self, group: &'n Node, depth: usize) -> Result<Option<usize>> {
        if let Some(known) = self.groups.get(&std::ptr::from_ref(group)) {
            return Ok(*known);
        }
        let mut parts = Vec::new();
        let mut nested = false;
        for child in group.children.iter().filter(|child| child.tag == "shape" || child.tag == "ref") {
            let shape = self.resolve(child)?;
            nested |= shape.tag == "shape" && Plugin::new(shape).kind() == "instance";
            parts.push(child);
        }
        let id = if nested {
            None
        } else {
            let before = std::mem::take(&mut self.scene.objects);
            let added = parts.into_iter().try_for_each(|child| match self.resolve(child)?.tag == "shape" {
                true => self.shape(child, &DAffine3::IDENTITY, Some(depth + 1)),
                false => Ok(()),
            });
            let objects = std::mem::replace(&mut self.scene.objects, before);
            added?;
            Some(self.scene.assemble(&values::shown(group.attribute("id").unwrap_or("group")), objects))
        };
        self.groups.insert(std::ptr::from_ref(group), id);
        Ok(id)
    }

    fn copy_group(&mut self, plugin: &Plugin<'n>, group: &'n Node, to_world: &DAffine3, depth: usize) -> Result<()> {
        for shape in group.children.iter().filter(|child| child.tag == "shape" || child.tag == "ref") {
            self.copies += 1;
            if self.copies > MOST_COPIES {
                let message = format!(
                    "the scene has more than {MOST_COPIES} shapes in instances that stretch a round one or hold others, each of \
                     which becomes a copy"
                );
                return Err(plugin.node.problem(message).into());
            }
            if self.resolve(shape)?.tag == "shape" {
                self.shape(shape, to_world, Some(depth + 1))?;
            }
        }
        Ok(())
    }

    /// What an area emitter within a shape emits.
    fn emission(&mut self, shape: &Plugin<'n>, flip: bool) -> Result<Option<String>> {
        let Some(node) = shape.objects(&["emitter"]).first().copied() else { return Ok(None) };
        let node = self.resolve(node)?;
        let plugin = Plugin::new(node);
        if plugin.kind() != "area" {
            self.scene
                .report
                .left_out(plugin.place(), format!("the emitter `{}` of a shape", values::shown(plugin.kind())));
            return Ok(None);
        }
        let name = self.name_of(shape.node);
        let text = match self.colour(&plugin, "radiance", Of::Emission, flip)? {
            Some(Colour::Texture(texture)) => {
                let what = "a picture of light is of colours as they are written, in daylight, as in Mitsuba's RGB variants; its spectral \
                            variants (3.9.1) take 1 in the place of what is more, and no daylight";
                self.scene.report.chosen(plugin.place(), what);
                texture.toml(self.scene, "")?
            }
            Some(colour) => colour.toml(self.scene, &format!("{name}-light"))?,
            None => "{ rgb = [1.0, 1.0, 1.0] }".to_owned(),
        };
        plugin.finish(&mut self.scene.report);
        self.scene.report.translated("emitter `area`", plugin.place());
        Ok(Some(text))
    }

    /// The object's shape and transform; `None` where there is none, which has been said.
    fn form(
        &mut self,
        plugin: &Plugin<'n>,
        to_world: &DAffine3,
        (textured, is_upward): (bool, bool),
        flipped: bool,
    ) -> Result<Option<Section>> {
        let (name, object) = (self.name_of(plugin.node), Section::new("[[objects]]"));
        let placing =
            |object: Section| Placing { plugin, object, name, to_world: *to_world, textured, is_upward, flipped };
        let point = |x: f64, y: f64| to_world.transform_point3(DVec3::new(x, y, 0.0));
        let mirrored = to_world.matrix3.determinant() < 0.0;
        match plugin.kind() {
            "rectangle" if !textured || (!mirrored && !flipped) => {
                let corner = point(-1.0, -1.0);
                let (u, v) = (point(1.0, -1.0) - corner, point(-1.0, 1.0) - corner);
                let (u, v) = if mirrored != flipped { (v, u) } else { (u, v) };
                let [corner, u, v] = [corner, u, v].map(text::vector);
                Ok(Some(object.with("quad", format!("{{ corner = {corner}, edge_u = {u}, edge_v = {v} }}"))))
            }
            "rectangle" => {
                let corners = [[-1., -1., 0.], [1., -1., 0.], [1., 1., 0.], [-1., 1., 0.]].map(DVec3::from_array);
                let uv = [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y];
                let mesh = Mesh {
                    positions: corners.to_vec(),
                    uv: Some(uv.to_vec()),
                    normals: None,
                    triangles: vec![[0, 1, 2], [0, 2, 3]],
                };
                self.put_mesh(placing(object), mesh).map(Some)
            }
            "cube" if !textured && !flipped => {
                let object = object.with("cube", "{ min = [-1.0, -1.0, -1.0], max = [1.0, 1.0, 1.0] }");
                Ok(Some(object.with("transform", text::transform(to_world))))
            }
            "cube" => {
                let uv = [DVec2::Y, DVec2::ONE, DVec2::X, DVec2::ZERO];
                let triangles = (0..6u32).flat_map(|f| [[0, 1, 2], [3, 0, 2]].map(|t| t.map(|i| 4 * f + i))).collect();
                let positions = FACES.iter().flatten().copied().map(DVec3::from_array).collect();
                let mesh = Mesh { positions, uv: Some(uv.repeat(6)), normals: None, triangles };
                self.put_mesh(placing(object), mesh).map(Some)
            }
            "sphere" => {
                let (center, radius) =
                    (plugin.vector("center")?.unwrap_or(DVec3::ZERO), plugin.float("radius")?.unwrap_or(1.0));
                if radius <= 0.0 {
                    return Err(plugin.node.problem("`radius` must be above 0").into());
                }
                let local =
                    DAffine3::from_scale_rotation_translation(DVec3::splat(radius), glam::DQuat::IDENTITY, center);
                let placing = placing(object);
                self.sphere(Placing { to_world: placing.to_world * local, ..placing }).map(Some)
            }
            "disk" => self.disk(placing(object)).map(Some),
            "cylinder" => self.cylinder(placing(object)).map(Some),
            "obj" | "ply" | "serialized" => self.file(placing(object)).map(Some),
            other => {
                self.scene.report.left_out(plugin.place(), format!("the shape `{}`", values::shown(other)));
                Ok(None)
            }
        }
    }

    fn put_mesh(&mut self, placing: Placing<'_, 'n>, mut mesh: Mesh) -> Result<Section> {
        if placing.flipped {
            mesh.reverse();
        }
        let path = mesh.write(self.scene, &placing.name)?;
        Ok(placing.of_mesh(&path))
    }

    /// The unit sphere under `to_world`.
    fn sphere(&mut self, placing: Placing<'_, 'n>) -> Result<Section> {
        match similarity(placing.to_world.matrix3) {
            Some(radius) if !placing.textured && !placing.flipped => {
                let center = text::vector(placing.to_world.translation);
                Ok(placing
                    .object
                    .with("sphere", format!("{{ center = {center}, radius = {} }}", text::rounded(radius))))
            }
            Some(_) if !placing.flipped => {
                let turned = placing.to_world * DAffine3::from_mat3(POLES);
                let object = placing.object.with("sphere", "{ center = [0.0, 0.0, 0.0], radius = 1.0 }");
                Ok(object.with("transform", text::transform(&turned)))
            }
            _ => {
                self.tessellated(placing.plugin);
                let mesh = Mesh::grid(AROUND, AROUND / 2, |u, v| {
                    let (azimuth, polar) = (std::f64::consts::TAU * u, std::f64::consts::PI * v);
                    let p = DVec3::new(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos());
                    (p, p, DVec2::new(u, 1.0 - v))
                });
                self.put_mesh(placing, mesh)
            }
        }
    }

    fn tessellated(&mut self, plugin: &Plugin<'n>) {
        let what = format!("a round shape by {AROUND} segments around");
        self.scene.report.approximated(plugin.place(), what, within_round(plugin.kind() == "sphere"));
    }

    fn disk(&mut self, placing: Placing<'_, 'n>) -> Result<Section> {
        let to_world = &placing.to_world;
        let normal =
            (to_world.matrix3.inverse().transpose() * DVec3::Z).normalize() * if placing.flipped { -1.0 } else { 1.0 };
        let (x, y) = (to_world.matrix3.x_axis, to_world.matrix3.y_axis);
        let is_round =
            (x.length() - y.length()).abs() < 1e-5 * x.length() && x.dot(y).abs() < 1e-5 * x.length_squared();
        if is_round && !placing.textured {
            let center = text::vector(to_world.translation);
            let value = format!(
                "{{ center = {center}, normal = {}, radius = {} }}",
                text::vector(normal),
                text::rounded(x.length())
            );
            return Ok(placing.object.with("disk", value));
        }
        self.tessellated(placing.plugin);
        let mesh = Mesh::grid(AROUND, 8, |u, v| {
            let azimuth = std::f64::consts::TAU * u;
            (v * DVec3::new(azimuth.cos(), azimuth.sin(), 0.0), DVec3::Z, DVec2::new(v, u))
        });
        self.put_mesh(placing, mesh)
    }

    fn cylinder(&mut self, placing: Placing<'_, 'n>) -> Result<Section> {
        let (plugin, to_world) = (placing.plugin, placing.to_world);
        let (p0, p1) = (plugin.vector("p0")?.unwrap_or(DVec3::ZERO), plugin.vector("p1")?.unwrap_or(DVec3::Z));
        let radius = plugin.float("radius")?.unwrap_or(1.0);
        let axis = (p1 - p0).try_normalize();
        let axis = axis
            .filter(|_| radius > 0.0)
            .ok_or_else(|| plugin.node.problem("a `cylinder` needs a length and a `radius`"))?;
        let length = (p1 - p0).length();
        match similarity(to_world.matrix3) {
            Some(factor) if !placing.textured && !placing.flipped => {
                let [from, to] = [p0, p1].map(|p| text::vector(to_world.transform_point3(p)));
                let radius = text::rounded(radius * factor);
                Ok(placing.object.with("cylinder", format!("{{ from = {from}, to = {to}, radius = {radius} }}")))
            }
            _ => {
                self.tessellated(plugin);
                let turn = DMat3::from_quat(glam::DQuat::from_rotation_arc(DVec3::Z, axis));
                let mesh = Mesh::grid(AROUND, 1, |u, v| {
                    let azimuth = std::f64::consts::TAU * u;
                    let normal = turn * DVec3::new(azimuth.cos(), azimuth.sin(), 0.0);
                    (p0 + radius * normal + v * length * axis, normal, DVec2::new(u, v))
                });
                self.put_mesh(placing, mesh)
            }
        }
    }

    /// A mesh of a file: the file itself where its normals are what Mitsuba would have.
    fn file(&mut self, placing: Placing<'_, 'n>) -> Result<Section> {
        let (plugin, node) = (placing.plugin, placing.plugin.node);
        let named = plugin.string("filename")?.ok_or_else(|| node.problem("the shape has no `filename`"))?;
        let path = inside(named, node)?;
        let bytes = meshes::content(&path).map_err(|problem| at(node, &problem))?;
        let face_normals = plugin.boolean("face_normals", false)?;
        if plugin.kind() == "serialized" {
            let index = plugin.whole("shape_index")?.unwrap_or(0).max(0) as usize;
            let mut mesh =
                serialized::parse(&bytes, index).map_err(|message| node.problem(format!("{named} {message}")))?;
            shade(&mut mesh, face_normals);
            placing.lay_out(&mut mesh);
            return self.put_mesh(placing, mesh);
        }
        let format = if plugin.kind() == "obj" { Format::Obj } else { Format::Ply };
        let read = meshes::parse(format, &bytes, &path).map_err(|problem| at(node, &problem))?;
        let has_normals = read.parts.iter().all(|part| part.normals.is_some());
        let is_laid_out = !placing.textured || read.parts.iter().all(|part| part.uv.is_some());
        if has_normals && !face_normals && !placing.flipped && is_laid_out {
            let path = self.scene.copy("meshes", &path)?;
            return Ok(placing.of_mesh(&path));
        }
        // The vertices of a PLY are what normals are shared by; those of an OBJ are what its corners have in common.
        let mut mesh = match (&read.parts[..], format) {
            ([part], Format::Ply) => Mesh::of_vertices(part),
            _ => Mesh::of_file(&read),
        };
        shade(&mut mesh, face_normals);
        placing.lay_out(&mut mesh);
        let stem = Path::new(named).file_stem().map(|stem| stem.to_string_lossy().into_owned());
        let name = stem.unwrap_or_else(|| placing.name.clone());
        self.put_mesh(Placing { name, ..placing }, mesh)
    }
}
