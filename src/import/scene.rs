//! The scene that is being made: sections of scene.toml and the files beside it.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use glam::DAffine3;

use super::geometry::similarity;
use super::report::Report;
use super::text;
use crate::format::csv_table;
use crate::spectral::Curve;
use crate::{Error, Result};

/// A table of the file.
#[derive(Debug, Clone, Default)]
pub struct Section {
    /// Lines of a comment before it.
    pub comments: Vec<String>,
    pub header: String,
    pub entries: Vec<(String, String)>,
}

impl Section {
    pub fn new(header: impl Into<String>) -> Section {
        Section { header: header.into(), ..Section::default() }
    }

    pub fn with(mut self, key: &str, value: impl Into<String>) -> Section {
        self.entries.push((key.to_owned(), value.into()));
        self
    }

    pub fn set(&mut self, key: &str, value: impl Into<String>) {
        self.entries.push((key.to_owned(), value.into()));
    }

    pub fn comment(mut self, comment: impl Into<String>) -> Section {
        self.comments.push(comment.into());
        self
    }

    fn write(&self, out: &mut String) {
        out.push('\n');
        for comment in &self.comments {
            for line in comment.lines() {
                *out += &format!("# {line}\n");
            }
        }
        *out += &format!("{}\n", self.header);
        for (key, value) in &self.entries {
            *out += &format!("{key} = {value}\n");
        }
    }
}

/// Objects that are placed together.
#[derive(Debug)]
pub struct Assembly {
    name: String,
    objects: Vec<Section>,
    places: Vec<DAffine3>,
}

impl Assembly {
    pub fn place(&mut self, to_world: DAffine3) {
        self.places.push(to_world);
    }

    /// Whether it can be placed so: round shapes keep their form.
    pub fn takes(&self, to_world: &DAffine3) -> bool {
        let is_round = |object: &Section| {
            object.entries.iter().any(|(key, _)| ["sphere", "disk", "cylinder"].contains(&key.as_str()))
        };
        similarity(to_world.matrix3).is_some() || !self.objects.iter().any(is_round)
    }
}

/// So many places of an assembly stand in the scene itself; more in a file beside it.
const PLACES_IN_SCENE: usize = 8;

/// Everything of it.
#[derive(Debug, Default)]
pub struct Scene {
    pub camera: Option<Section>,
    pub film: Option<Section>,
    pub integrator: Option<Section>,
    pub materials: Vec<Section>,
    pub media: Vec<Section>,
    pub objects: Vec<Section>,
    pub assemblies: Vec<Assembly>,
    pub lights: Vec<Section>,
    pub environment: Option<Section>,
    pub report: Report,
    /// Where files go.
    folder: PathBuf,
    materials_named: HashSet<String>,
    /// Names of those by [`Scene::with_opacity`], by what it was asked.
    masked: HashMap<(String, String), String>,
    files: HashSet<String>,
    spectra: HashMap<String, String>,
    copied: HashMap<PathBuf, String>,
}

impl Scene {
    pub fn new(folder: &Path) -> Scene {
        Scene { folder: folder.to_owned(), ..Scene::default() }
    }

    /// A name that no material and no medium has, as near to `wanted` as can be.
    pub fn material_name(&mut self, wanted: &str) -> String {
        let wanted = if wanted.is_empty() { "material" } else { wanted };
        let name = (1..).map(|i| if i == 1 { wanted.to_owned() } else { format!("{wanted}-{i}") });
        let name = name.into_iter().find(|name| !self.materials_named.contains(name)).unwrap_or_default();
        self.materials_named.insert(name.clone());
        name
    }

    /// A material of this name and kind.
    pub fn material(&mut self, name: &str, kind: &str) -> Section {
        Section::new(format!("[materials.{}.{kind}]", text::key(name)))
    }

    /// Adds a material of the name nearest to `wanted`; gives that.
    pub fn put(&mut self, wanted: &str, kind: &str, mut section: Section) -> String {
        let name = self.material_name(wanted);
        section.header = format!("[materials.{}.{kind}]", text::key(&name));
        self.materials.push(section);
        name
    }

    /// The name of a material like `name` of which a share is there; `None` where it has an opacity already.
    pub fn with_opacity(&mut self, name: &str, opacity: &str) -> Option<String> {
        let key = (name.to_owned(), opacity.to_owned());
        if let Some(known) = self.masked.get(&key) {
            return Some(known.clone());
        }
        let begins = format!("[materials.{}.", text::key(name));
        let mut section = self.materials.iter().find(|section| section.header.starts_with(&begins))?.clone();
        if section.entries.iter().any(|(key, _)| key == "opacity") {
            return None;
        }
        section.set("opacity", opacity);
        let kind = section.header[begins.len()..].trim_end_matches(']').to_owned();
        let masked = self.put(&format!("{name}-masked"), &kind, section);
        self.masked.insert(key, masked.clone());
        Some(masked)
    }

    /// Writes a file into `sort`, one of meshes, spectra, textures; gives its path in the scene.
    pub fn write(&mut self, sort: &str, name: &str, bytes: &[u8]) -> Result<String> {
        let path = self.place(sort, name)?;
        let target = self.folder.join(&path);
        std::fs::write(&target, bytes).map_err(|error| Error::storage(&target, error))?;
        Ok(path)
    }

    /// The path of a file to be written, in a folder that is there.
    pub fn place(&mut self, sort: &str, name: &str) -> Result<String> {
        let folder = self.folder.join(sort);
        std::fs::create_dir_all(&folder).map_err(|error| Error::storage(&folder, error))?;
        let name = text::file_name(name);
        let (stem, end) = name.rsplit_once('.').unwrap_or((&name, ""));
        let numbered = |i: usize| match (i, end) {
            (1, _) => name.clone(),
            (_, "") => format!("{stem}-{i}"),
            _ => format!("{stem}-{i}.{end}"),
        };
        // Some file systems do not tell letters apart by their case.
        let free = (1..).map(|i| format!("{sort}/{}", numbered(i)));
        let path = free.into_iter().find(|path| !self.files.contains(&path.to_lowercase())).unwrap_or_default();
        self.files.insert(path.to_lowercase());
        Ok(path)
    }

    /// Where a file of the scene will be until the folder has its name.
    pub fn path_of(&self, relative: &str) -> PathBuf {
        self.folder.join(relative)
    }

    /// Copies a file, once.
    pub fn copy(&mut self, sort: &str, from: &Path) -> Result<String> {
        if let Some(path) = self.copied.get(from) {
            return Ok(path.clone());
        }
        let bytes = std::fs::read(from).map_err(|e| Error::input(from, format!("cannot be read: {e}")))?;
        let name = from.file_name().unwrap_or_default().to_string_lossy();
        let path = self.write(sort, &name, &bytes)?;
        self.copied.insert(from.to_owned(), path.clone());
        Ok(path)
    }

    /// A spectrum in place: a number, few samples, or a file `name` of many.
    pub fn spectrum(&mut self, curve: &Curve, name: &str) -> Result<String> {
        match curve {
            Curve::Constant(value) => Ok(text::number(*value)),
            Curve::Blackbody { kelvin, scale } if *scale == 1.0 => {
                Ok(format!("{{ blackbody = {} }}", text::number(*kelvin)))
            }
            Curve::Blackbody { kelvin, scale } => {
                Ok(format!("{{ blackbody = {}, scale = {} }}", text::number(*kelvin), text::rounded(*scale)))
            }
            Curve::Linear { nm, value, .. } if nm.len() == 1 => Ok(text::number(value[0])),
            Curve::Linear { nm, value, outside } if nm.len() <= 6 => {
                let samples =
                    nm.iter().zip(value).map(|(nm, v)| format!("[{}, {}]", text::rounded(*nm), text::rounded(*v)));
                Ok(format!(
                    "{{ samples = [{}], outside = \"{}\" }}",
                    samples.collect::<Vec<_>>().join(", "),
                    outside.name()
                ))
            }
            Curve::Linear { nm, value, outside } => {
                let mut table = csv_table::Table::new(["nm", "value"]);
                nm.iter().zip(value).for_each(|(nm, value)| table.row([text::rounded(*nm), text::rounded(*value)]));
                let content = table.finish();
                let path = match self.spectra.get(&content) {
                    Some(path) => path.clone(),
                    None => {
                        let path = self.write("spectra", &format!("{name}.csv"), content.as_bytes())?;
                        self.spectra.insert(content, path.clone());
                        path
                    }
                };
                Ok(format!("{{ file = {}, outside = \"{}\" }}", text::quoted(&path), outside.name()))
            }
        }
    }

    /// Adds objects that are placed together; gives their place among [`Scene::assemblies`].
    pub fn assemble(&mut self, wanted: &str, objects: Vec<Section>) -> usize {
        let wanted = if wanted.is_empty() { "assembly" } else { wanted };
        let name = (1..).map(|i| if i == 1 { wanted.to_owned() } else { format!("{wanted}-{i}") });
        let name = name.into_iter().find(|name| self.assemblies.iter().all(|known| known.name != *name));
        self.assemblies.push(Assembly { name: name.unwrap_or_default(), objects, places: Vec::new() });
        self.assemblies.len() - 1
    }

    /// The sections of all assemblies that are placed; many places go into files.
    pub fn write_assemblies(&mut self) -> Result<Vec<Section>> {
        let mut sections = Vec::new();
        for Assembly { name, objects, places } in std::mem::take(&mut self.assemblies) {
            if places.is_empty() || objects.is_empty() {
                continue;
            }
            let header = format!("[[assemblies.{}.objects]]", text::key(&name));
            sections.extend(objects.into_iter().map(|object| Section { header: header.clone(), ..object }));
            let instance = || Section::new("[[instances]]").with("assembly", text::quoted(&name));
            if places.len() <= PLACES_IN_SCENE {
                sections.extend(places.iter().map(|place| match *place == DAffine3::IDENTITY {
                    true => instance(),
                    false => instance().with("transform", text::transform(place)),
                }));
                continue;
            }
            let columns = (0..12).map(|i| format!("m{}{}", i / 4, i % 4));
            let mut table = csv_table::Table::new(columns);
            for DAffine3 { matrix3: m, translation: t } in &places {
                let rows = (0..3).flat_map(|i| [m.x_axis[i], m.y_axis[i], m.z_axis[i], t[i]]);
                table.row(rows.map(text::rounded));
            }
            let path = self.write("placements", &format!("{name}.csv"), table.finish().as_bytes())?;
            sections.push(instance().with("placements", text::quoted(&path)));
        }
        Ok(sections)
    }

    /// scene.toml.
    pub fn toml(&self, source: &Path, assemblies: &[Section]) -> String {
        let name = source.file_name().unwrap_or_default().to_string_lossy();
        let mut out =
            format!("# From {} by `spectile import`; IMPORT.md tells what became of it.\n", name.escape_debug());
        let channels = Section::new("[channels]")
            .comment("chosen: scenes of this format say nothing of channels")
            .with("equal", "{ from = 380.0, to = 780.0, count = 40 }");
        let singles = [&self.camera, &self.film].into_iter().flatten();
        let all = singles
            .chain([&channels])
            .chain(&self.integrator)
            .chain(&self.environment)
            .chain(&self.materials)
            .chain(&self.media)
            .chain(&self.lights)
            .chain(&self.objects)
            .chain(assemblies);
        all.for_each(|section| section.write(&mut out));
        out
    }
}
