//! Scenes of glTF 2.0: meshes where their nodes put them, materials, lights and cameras.

mod material;

use std::collections::HashMap;
use std::path::Path;

use glam::{DAffine3, DVec3};

use self::material::Look;
use super::geometry::Mesh;
use super::report::{Deviation, Place};
use super::scene::{Scene, Section};
use super::{spot, text};
use crate::format::edges;
use crate::format::gltf::json::camera::Type as CameraType;
use crate::format::gltf::json::extensions::scene::khr_lights_punctual::Type as LightType;
use crate::format::gltf::json::mesh::Semantic;
use crate::format::gltf::json::validation::Checked;
use crate::format::gltf::{File, Placed, Standing, json, parse};
use crate::format::mesh::{self, Part};
use crate::{Error, Result};

/// cd/m² of light whose luminance is 1 here: 683 lm/W times ∫ȳ dλ = 106.857 nm.
pub const CANDELA: f64 = 683.002 * 106.857;

struct Importer<'f, 's> {
    file: &'f File,
    scene: &'s mut Scene,
    looks: HashMap<Option<usize>, Look>,
    /// Whether something shines.
    is_lit: bool,
}

/// Translates the scene in the file `source`.
pub fn read(source: &Path, scene: &mut Scene) -> Result<()> {
    let bytes = mesh::content(source)?;
    let file = parse(&bytes, source)?;
    let mut importer = Importer { file: &file, scene, looks: HashMap::new(), is_lit: false };
    importer.all()
}

impl Importer<'_, '_> {
    fn place(&self, path: impl Into<String>) -> Place {
        Place { file: self.file.path.clone(), line: None, path: Some(path.into()) }
    }

    fn error(&self, message: String) -> Error {
        self.file.problem(message).into()
    }

    fn all(&mut self) -> Result<()> {
        let nodes = self.file.nodes(None).map_err(|message| self.error(message))?;
        let mut bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        if nodes.iter().any(|placed| self.file.root.nodes[placed.node].mesh.is_some()) {
            let read = self.file.standing().map_err(|message| self.error(message))?;
            if read.iter().all(|standing| standing.mesh.parts.is_empty()) {
                return Err(self.error("has no triangles".to_owned()));
            }
            let lines: usize = read.iter().map(|standing| standing.mesh.without_surface).sum();
            if lines > 0 {
                let what = format!("{lines} primitives of points and lines, which have no surface");
                self.scene.report.left_out(None, what);
            }
            for Standing { mesh, places } in &read {
                self.standing(mesh, places)?;
                bounds = around(mesh, places, bounds);
            }
        }
        for placed in &nodes {
            self.light(placed)?;
        }
        self.cameras(&nodes, bounds)?;
        self.scene.integrator = Some(Section::new("[integrator]").with("max_bounces", "8"));
        self.scene.report.chosen(None, "8 bounces: glTF has no integrators");
        if !self.is_lit && self.scene.lights.is_empty() {
            let section =
                Section::new("[environment]").comment("chosen: the file has no lights").with("radiance", "1.0");
            self.scene.environment = Some(section);
            self.scene.report.chosen(None, "a uniform sky of radiance 1, as the file has no lights");
        }
        let root = &self.file.root;
        for (what, count) in [("animation", root.animations.len()), ("skin", root.skins.len())] {
            if count > 0 {
                self.scene.report.left_out(None, format!("{count} {what}s: everything is where its node is"));
            }
        }
        const READ: [&str; 8] = [
            "EXT_mesh_gpu_instancing",
            "KHR_lights_punctual",
            "KHR_materials_emissive_strength",
            "KHR_materials_ior",
            "KHR_materials_transmission",
            "KHR_materials_volume",
            "KHR_texture_transform",
            "KHR_mesh_quantization",
        ];
        for name in root.extensions_used.iter().filter(|name| !READ.contains(&name.as_str())) {
            let shown: String = name.chars().take(60).collect();
            self.scene.report.left_out(None, format!("the extension {}", shown.escape_debug()));
        }
        Ok(())
    }

    /// A mesh that stands once is objects, one of several places an assembly.
    fn standing(&mut self, mesh: &mesh::Mesh, places: &[DAffine3]) -> Result<()> {
        if places.len() == 1 {
            return mesh.parts.iter().try_for_each(|part| self.part(part));
        }
        let before = std::mem::take(&mut self.scene.objects);
        let added = mesh.parts.iter().try_for_each(|part| self.part(part));
        let objects = std::mem::replace(&mut self.scene.objects, before);
        added?;
        let Some(first) = mesh.parts.first() else { return Ok(()) };
        let mesh::Place::Json(path) = &first.place else { return Ok(()) };
        let id = self.scene.assemble(first.labels.object.as_deref().unwrap_or("mesh"), objects);
        let (flat, solid): (Vec<DAffine3>, Vec<_>) =
            places.iter().copied().partition(|place| place.matrix3.determinant() == 0.0);
        if !flat.is_empty() {
            let what = format!("{} places of a mesh that flatten it", flat.len());
            self.scene.report.left_out(self.place(path.clone()), what);
        }
        solid.into_iter().for_each(|place| self.scene.assemblies[id].place(place));
        self.scene.report.translated("mesh of several places", self.place(path.clone()));
        Ok(())
    }

    fn part(&mut self, part: &Part) -> Result<()> {
        let mesh::Place::Json(path) = &part.place else { return Ok(()) };
        // `meshes[I].primitives[J]`.
        let numbers: Vec<usize> = path.split(['[', ']']).filter_map(|word| word.parse().ok()).collect();
        let [m, p] = numbers[..] else { return Ok(()) };
        let primitive = &self.file.root.meshes[m].primitives[p];
        if primitive.attributes.contains_key(&Checked::Valid(Semantic::Colors(0))) {
            self.scene.report.left_out(self.place(path.clone()), "colours of vertices (COLOR_0)");
        }
        let look = self.look(primitive.material.map(|material| material.value()))?;
        let whole = mesh::Mesh { parts: vec![part.clone()], ..mesh::Mesh::default() };
        let mut shape = Mesh::of_file(&whole);
        let (mut material, mut emission) = (look.material.clone(), look.emission.clone());
        if look.textured && shape.uv.is_none() {
            // Textures need coordinates: without them glTF looks at (0, 0).
            let what = "a textured material on a mesh without TEXCOORD_0 as its mean";
            self.scene.report.approximated(self.place(path.clone()), what, look.off_plain.clone());
            (material, emission) = (look.plain.clone(), look.plain_emission.clone());
        }
        if !look.textured {
            shape.uv = None;
        }
        let is_double = primitive.material.is_some_and(|of| self.file.root.materials[of.value()].double_sided);
        let open = if is_double { 0 } else { edges::open(&shape.positions, &shape.triangles).len() };
        if open > 0 {
            let what = "an open surface that is seen from its front only (no `doubleSided`) as one of both sides";
            let off = Deviation::unbounded("its back is seen where glTF shows what is behind it, and casts shadows");
            self.scene.report.approximated(self.place(path.clone()), what, off);
        }
        let name =
            part.labels.object.clone().or(self.file.root.meshes[m].name.clone()).unwrap_or_else(|| format!("mesh {m}"));
        let file = shape.write(self.scene, &name)?;
        let shown: String = name.chars().take(60).collect();
        let mut object = Section::new("[[objects]]").comment(shown.escape_debug().to_string());
        object.set("mesh", text::quoted(&file));
        object.set("material", text::quoted(&material));
        if let Some(emission) = emission {
            object.set("emission", emission);
            self.is_lit = true;
        }
        self.scene.objects.push(object);
        self.scene.report.translated("primitive", self.place(path.clone()));
        Ok(())
    }

    fn light(&mut self, placed: &Placed) -> Result<()> {
        let node = &self.file.root.nodes[placed.node];
        let Some(of_node) = node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref()) else {
            return Ok(());
        };
        let path = format!("nodes[{}]", placed.node);
        let index = of_node.light.value();
        let lights = self.file.root.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        let light = lights.and_then(|all| all.lights.get(index));
        let light = light.ok_or_else(|| self.error(format!("`{path}` names light {index}, which does not exist")))?;
        let colour = light.color.map(f64::from);
        let amount = f64::from(light.intensity);
        if colour.iter().any(|v| !(0.0..1e30).contains(v)) || !(0.0..1e30).contains(&amount) {
            return Err(self.error(format!("light {index} has a colour or intensity that is negative or not finite")));
        }
        let light_text = format!("{{ rgb = {}, scale = {} }}", text::list(colour), text::rounded(amount / CANDELA));
        let position = text::vector(placed.to_world.translation);
        let direction = placed.to_world.matrix3 * DVec3::NEG_Z;
        let direction = text::vector(direction.normalize_or(DVec3::NEG_Z));
        let (key, value) = match light.type_ {
            Checked::Valid(LightType::Point) => {
                ("point", format!("{{ position = {position}, intensity = {light_text} }}"))
            }
            Checked::Valid(LightType::Directional) => {
                ("directional", format!("{{ direction = {direction}, irradiance = {light_text} }}"))
            }
            Checked::Valid(LightType::Spot) => {
                let [inner, outer] = light.spot.as_ref().map_or([0.0, std::f64::consts::FRAC_PI_4], |spot| {
                    [spot.inner_cone_angle, spot.outer_cone_angle].map(f64::from)
                });
                let at = self.place(path.clone());
                let half = self.scene.report.within(at.clone(), "`outerConeAngle`", outer.to_degrees(), [1e-3, 90.0]);
                let inner = self.scene.report.within(at.clone(), "`innerConeAngle`", inner.to_degrees(), [0.0, half]);
                let (start, end) = (inner.to_radians().cos(), half.to_radians().cos());
                // KHR_lights_punctual: the square of what is linear in the cosine.
                let squared =
                    |angle: f64| ((angle.to_radians().cos() - end) / (start - end).max(1e-9)).clamp(0.0, 1.0).powi(2);
                let edge = spot::nearest(&squared, inner, half);
                if edge.off > 1e-3 {
                    let what = "the edge of a spot, whose intensity falls as the square of what is linear in the cosine, by the nearest one";
                    let off = format!("{} of the intensity on its axis", text::percent(edge.off));
                    self.scene.report.approximated(at, what, Deviation::at_most(off));
                }
                let mut angles =
                    format!("half_angle = {}, falloff = {}", text::rounded(edge.half), text::rounded(edge.falloff));
                if edge.profile != "smooth" {
                    angles += &format!(", profile = {}", text::quoted(edge.profile));
                }
                (
                    "spot",
                    format!("{{ position = {position}, direction = {direction}, intensity = {light_text}, {angles} }}"),
                )
            }
            Checked::Invalid => return Err(self.error(format!("light {index} has a type that is unknown"))),
        };
        if light.range.is_some() {
            self.scene.report.left_out(self.place(path.clone()), "the `range` of a light");
        }
        self.scene.lights.push(Section::new("[[lights]]").with(key, value));
        self.scene.report.translated(format!("light `{key}`"), self.place(path));
        Ok(())
    }

    fn cameras(&mut self, nodes: &[Placed], bounds: [DVec3; 2]) -> Result<()> {
        let mut with = nodes.iter().filter(|placed| self.file.root.nodes[placed.node].camera.is_some());
        let Some(first) = with.next() else {
            self.framed(bounds);
            return Ok(());
        };
        let others: Vec<usize> = with.map(|placed| placed.node).collect();
        for node in others {
            self.scene.report.left_out(self.place(format!("nodes[{node}]")), "cameras after the first");
        }
        let index = self.file.root.nodes[first.node].camera.map_or(0, |camera| camera.value());
        let found = self.file.root.cameras.get(index);
        let camera = found
            .ok_or_else(|| self.error(format!("`nodes[{}]` names camera {index}, which does not exist", first.node)))?;
        self.camera(&first.to_world, camera, index)
    }

    fn camera(&mut self, to_world: &DAffine3, camera: &json::Camera, index: usize) -> Result<()> {
        let matrix = to_world.matrix3;
        let (forward, up) = (-matrix.z_axis.normalize_or(DVec3::Z), matrix.y_axis.normalize_or(DVec3::Y));
        let kind = match camera.type_ {
            Checked::Valid(CameraType::Perspective) => "perspective",
            Checked::Valid(CameraType::Orthographic) => "orthographic",
            Checked::Invalid => return Err(self.error(format!("`cameras[{index}].type` is unknown"))),
        };
        let mut section = Section::new(format!("[camera.{kind}]"));
        section.set("position", text::vector(to_world.translation));
        section.set("look_at", text::vector(to_world.translation + forward));
        section.set("up", text::vector(up));
        let aspect = match (&camera.perspective, &camera.orthographic) {
            (Some(perspective), _) if kind == "perspective" => {
                let fov = f64::from(perspective.yfov).to_degrees();
                if !(0.0 < fov && fov < 180.0) {
                    return Err(self.error(format!("`cameras[{index}].perspective.yfov` must be between 0 and π")));
                }
                section.set("fov", text::rounded(fov));
                section.set("fov_axis", "\"y\"");
                perspective.aspect_ratio.map_or(16.0 / 9.0, f64::from)
            }
            (_, Some(orthographic)) if kind == "orthographic" => {
                let [x, y] = [orthographic.xmag, orthographic.ymag].map(|mag| f64::from(mag).abs());
                if !(x > 0.0 && y > 0.0 && x.is_finite() && y.is_finite()) {
                    return Err(
                        self.error(format!("`cameras[{index}].orthographic` must have xmag and ymag other than 0"))
                    );
                }
                section.set("width", text::rounded(2.0 * x * matrix.x_axis.length()));
                x / y
            }
            _ => return Err(self.error(format!("`cameras[{index}]` has no `{kind}`"))),
        };
        if forward.cross(up).dot(matrix.x_axis) < 0.0 {
            section.set("flip_x", "true");
        }
        self.scene.report.translated(format!("camera `{kind}`"), self.place(format!("cameras[{index}]")));
        self.scene.camera = Some(section);
        self.film(aspect);
        Ok(())
    }

    fn film(&mut self, aspect: f64) {
        const HEIGHT: f64 = 720.0;
        let width = (HEIGHT * aspect).round().clamp(1.0, 65_536.0);
        let section = Section::new("[film]").with("width", format!("{width}")).with("height", format!("{HEIGHT}"));
        self.scene.film = Some(section.with("filter", "\"gaussian\""));
        self.scene.report.chosen(None, format!("{width} x {HEIGHT} pixels: glTF has no films"));
    }

    /// A camera that sees everything, from the front, the right and above.
    fn framed(&mut self, [low, high]: [DVec3; 2]) {
        let (middle, radius) = match low.cmple(high).all() {
            true => (0.5 * (low + high), (0.5 * (high - low).length()).max(1e-6)),
            false => (DVec3::ZERO, 1.0),
        };
        const FOV: f64 = 40.0;
        let position = middle + DVec3::new(0.5, 0.4, 1.0).normalize() * radius * 1.1 / (0.5 * FOV.to_radians()).sin();
        let section =
            Section::new("[camera.perspective]").comment("chosen: the file has no camera; this one sees everything");
        let section = section.with("position", text::vector(position)).with("look_at", text::vector(middle));
        let section =
            section.with("up", "[0.0, 1.0, 0.0]").with("fov", text::number(FOV)).with("fov_axis", "\"smaller\"");
        self.scene.camera = Some(section);
        self.scene.report.chosen(None, "a camera that sees everything, as the file has none");
        self.film(16.0 / 9.0);
    }
}

/// `bounds` and all of a mesh wherever it stands.
fn around(mesh: &mesh::Mesh, places: &[DAffine3], mut bounds: [DVec3; 2]) -> [DVec3; 2] {
    let own = mesh.parts.iter().flat_map(|part| &part.positions).copied().map(DVec3::from_array);
    let own = own.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)]);
    if !own[0].cmple(own[1]).all() {
        return bounds;
    }
    // A mesh that stands once is in the world already.
    let once = [DAffine3::IDENTITY];
    for place in if places.len() == 1 { &once } else { places } {
        for corner in 0..8 {
            let of = |axis: usize| own[corner >> axis & 1][axis];
            let p = place.transform_point3(DVec3::new(of(0), of(1), of(2)));
            bounds = [bounds[0].min(p), bounds[1].max(p)];
        }
    }
    bounds
}
