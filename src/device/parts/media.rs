//! Media of a scene as devices get them: volumes in their places, and what lies behind each primitive.

use std::sync::Arc;

use glam::{DAffine3, DVec3};

use crate::device::accel::Accel;
use crate::device::part::{Part, Place, Records, SceneBuffer};
use crate::device::parts::crossings::Boundaries;
use crate::device::parts::origins::{Cut, Origins};
use crate::device::parts::surfaces::{Needed, wavelength};
use crate::device::text::{Module, module};
use crate::device::words::{
    KIND_INSTANCE, NONE, NULL_BOUNDARY, PLACED_VOLUME, Primitive, VOLUME_EMITS, VOLUME_GRID, VOLUME_SCATTERS,
    VOLUME_WORDS, VOLUMES_HEAD,
};
use crate::scene::{
    Absorber, Assembly, AssemblyId, Bsdf, Component, Field, Interior, Line, MaterialId, Medium, MediumId, Object,
    Projection, Scene, SpectrumId, box_around, box_around_all,
};
use crate::spectral::{Curve, planck};
use crate::{Error, Result};

/// Numbers of volumes have 8 bits in a path's state, of which 0 is none.
const MOST_VOLUMES: usize = 254;
const HEAD: usize = VOLUMES_HEAD as usize;
const WORDS: usize = VOLUME_WORDS as usize;
/// Stretches through media that one straight way may have.
const MOST_STRETCHES: u32 = 16;

pub const MEDIA: Part = Part {
    name: "media",
    used: |scene| scene.media.is_some(),
    effect: |_| "16 bytes a path, a record for each stretch of a way".into(),
    is_planned: true,
    modules: &[
        (Place::Generate, VOLUME),
        (Place::Generate, module!("parts/media/medium.wgsl")),
        (Place::Stage, module!("stages/meet/media.wgsl")),
        (Place::Evaluate, module!("parts/media/extinction.wgsl")),
    ],
    lines: &[
        ("LIGHT_TAKES_RECORDS", "if (light_is_dimmed(way)) { return true; }"),
        ("LIGHT_RECORDS", "append_light_way(list, way, aim);"),
        ("PASSED", "pass_surface(&path, site, choice.direction, &overflow);"),
    ],
    defines: |scene, _, defines| {
        let Some(media) = &scene.media else { return };
        defines.set("MEDIA", true).set("LONG_WAYS", true);
        defines.constant("OUTER_VOLUME", media.outer).constant("MOST_STRETCHES", media.stretches);
    },
    buffers: |scene| {
        let buffers = scene.prepared.media.as_ref().map(|media| {
            [
                SceneBuffer::new("volumes", &media.volumes, "the media of the scene", "smaller grids"),
                SceneBuffer::new("boundaries", &media.boundaries, "the geometry of the scene", "fewer triangles"),
            ]
        });
        buffers.into_iter().flatten().collect()
    },
    // The way to each vertex, and from each to a light; a vertex that aims through a medium has no record for both.
    records: |scene| {
        let way = scene.media.as_ref().map_or(0, Media::way_records);
        Records { way, vertex: way + 2, path: 0 }
    },
    state_words: |_| 2,
    example: Some(|exhibit| exhibit.add_gas()),
};

pub const VOLUME: Module = module!("parts/media/volume.wgsl");
const CELLS: Module = module!("parts/media/cells.wgsl");

/// In the place of media, in general scenes.
pub const VACUUM: Part = Part {
    name: "vacuum",
    used: |scene| scene.is_general() && scene.media.is_none() && !(super::opacity::OPACITY.used)(scene),
    modules: &[(Place::Stage, module!("stages/meet/vacuum.wgsl"))],
    ..Part::NOTHING
};

pub const CAMERA_CUT: Part = Part {
    name: "camera rays that start in different media",
    used: |scene| scene.media.as_ref().is_some_and(|media| media.camera_is_cut),
    effect: |_| "a way through the lens or window, or along the track, for each path".into(),
    is_planned: true,
    modules: &[(Place::Generate, module!("parts/media/camera_cut.wgsl"))],
    lines: &[("CAMERA_STARTS", "    nested = volumes_at(ray.origin, overflow);")],
    ..Part::NOTHING
};

pub const VOXELS: Part = Part {
    name: "media of voxels",
    used: |scene| scene.media.as_ref().is_some_and(Media::has_grids),
    effect: |_| {
        "what lies on a way is summed up once; a march through its cells for each channel where it emits".into()
    },
    is_planned: true,
    modules: &[
        (Place::Generate, CELLS),
        (Place::Generate, module!("parts/media/amounts.wgsl")),
        (Place::Evaluate, VOLUME),
        (Place::Evaluate, CELLS),
    ],
    defines: |scene, _, defines| {
        let Some(media) = &scene.media else { return };
        defines.set("GRIDS", true).set("MOST_COLUMNS", media.most_columns).constant("MOST_TERMS", media.most_terms);
        defines.set("MOST_ABSORBERS", media.most_absorbers).set("ONE_KIND", media.most_kinds <= 1);
    },
    example: Some(|exhibit| exhibit.add_voxels()),
    ..Part::NOTHING
};

pub const PLACED: Part = Part {
    name: "media of voxels in instances",
    used: |scene| scene.media.as_ref().is_some_and(|media| media.is_placed),
    effect: |_| "a volume for each instance, which share voxels".into(),
    is_planned: true,
    defines: |_, _, defines| _ = defines.set("PLACED_VOLUMES", true),
    example: Some(|exhibit| exhibit.add_placed_voxels()),
    ..Part::NOTHING
};

/// Absorption and emission that evaluation works out.
pub const PLANCK: Part = Part {
    name: "emission where paths are evaluated",
    used: |scene| scene.media.is_some() || scene.wavelength.is_some(),
    modules: &[(Place::Evaluate, module!("common/planck.wgsl"))],
    defines: |scene, _, defines| {
        if let Some(wavelength) = scene.wavelength {
            defines.set("PLANCK", true).constant("WAVELENGTH", wavelength);
        }
    },
    ..Part::NOTHING
};

/// Everything about media that a device needs. Spectra are positions in `spectra` until [`Media::name_spectra`].
pub struct Media {
    pub volumes: Vec<u32>,
    /// One for each primitive.
    pub boundaries: Vec<u32>,
    pub spectra: Vec<Needed>,
    /// The number of the medium outside all interiors, or [`NONE`].
    pub outer: u32,
    /// Whether camera rays start in different media.
    pub camera_is_cut: bool,
    /// Whether some volumes are there once for each instance of an assembly.
    is_placed: bool,
    /// Gases of a kind of matter in a volume of voxels, and columns of their tables.
    pub most_absorbers: u32,
    pub most_columns: u32,
    /// Kinds of matter in a volume of voxels.
    pub most_kinds: u32,
    /// Spectra of a volume of voxels whose amounts on a way tell its transmittance; and iterations of going through their list.
    pub most_terms: u32,
    pub most_listed: u32,
    /// Stretches of one way, voxels that it may go through, and those among them that evaluation marches through, at most.
    pub stretches: u32,
    pub cells: u32,
    pub marched: u32,
    /// The volumes that fill it, in order.
    pub places: Vec<Filled>,
    /// Position of the wavelength among `spectra`, where there are grids.
    pub wavelength: Option<u32>,
    /// Words of `volumes` that are positions in `spectra`.
    spectrum_words: Vec<usize>,
    /// Voxels that are to stand at the end of `volumes`, where in them each grid begins, and words of `volumes` that count from the first
    /// of them.
    voxels: Vec<f32>,
    grids: Vec<(Arc<Vec<f32>>, u32)>,
    voxel_words: Vec<usize>,
}

/// A volume, as far as light that it scatters needs to know.
#[derive(Debug, Clone, PartialEq)]
pub struct Filled {
    pub medium: MediumId,
    /// Of each kind of matter: where its voxels begin, or [`NONE`], and the value without them.
    pub densities: Vec<[u32; 2]>,
    /// Metres from end to end.
    pub extent: f64,
    /// Whether it is there for another instance of what the volume before it is of.
    pub is_repeated: bool,
}

/// Words that are to stand behind the volumes.
#[derive(Default)]
pub struct List {
    pub words: Vec<u32>,
    /// Which of them are positions among spectra.
    spectra: Vec<usize>,
    /// Which of them count voxels, or are [`NONE`].
    voxels: Vec<usize>,
}

impl From<Vec<u32>> for List {
    fn from(words: Vec<u32>) -> List {
        List { words, ..List::default() }
    }
}

impl List {
    /// Adds a density, as [`Filled`] has it.
    pub fn push_density(&mut self, density: [u32; 2]) {
        self.voxels.push(self.words.len());
        self.words.extend(density);
    }

    pub fn push_spectrum(&mut self, media: &mut Media, needed: Needed) {
        self.spectra.push(self.words.len());
        self.words.push(media.need(needed));
    }

    pub fn push_numbers(&mut self, numbers: impl IntoIterator<Item = f64>) {
        self.words.extend(numbers.into_iter().map(|value| (value as f32).to_bits()));
    }
}

/// A medium in a place: of one body, or of all space.
struct Volume<'a> {
    id: MediumId,
    medium: &'a Medium,
    interior: Option<Interior>,
    /// The instance whose it is, where each has voxels in places of their own; else it is that of all.
    instance: Option<(AssemblyId, usize)>,
    /// The index of refraction behind its surface over that before, where that is a dielectric; then the index there, of all
    /// bodies around it: radiance in matter is n² of that in a vacuum, and so are sources.
    index: Option<Curve>,
}

impl Volume<'_> {
    /// How often it is in the scene.
    fn times(&self, scene: &Scene) -> usize {
        let Some(interior) = self.interior.filter(|_| self.instance.is_none()) else { return 1 };
        let mut assemblies: Vec<Option<AssemblyId>> = of_body(scene, &interior).map(|object| object.assembly).collect();
        assemblies.dedup();
        let times = |assembly: Option<AssemblyId>| assembly.map_or(1, |of| scene.assemblies[of].instances.len());
        assemblies.into_iter().map(times).sum()
    }
}

impl Media {
    /// `None` where the scene has no media. Errors: more volumes than numbers, or around the camera than a path can hold.
    pub fn new(scene: &Scene, accel: &Accel) -> Result<Option<Media>> {
        if scene.media.is_empty() {
            return Ok(None);
        }
        let mut volumes: Vec<Volume> = Vec::new();
        let mut of_object = vec![0u32; scene.objects.len()];
        for (object, number) in scene.objects.iter().zip(&mut of_object) {
            let Some(interior) = object.interior else { continue };
            let medium = &scene.media[interior.medium];
            let assembly = object.assembly.filter(|_| medium.grid_size().is_some());
            let is_of_body = |v: &Volume| {
                v.interior.is_some_and(|i| i.body == interior.body) && v.instance.map(|(of, _)| of) == assembly
            };
            let known = volumes.iter().position(is_of_body);
            let index = known.unwrap_or_else(|| {
                let volume = |instance| Volume {
                    id: interior.medium,
                    medium,
                    interior: Some(interior),
                    instance,
                    index: object.material.and_then(|material| index(scene, material)),
                };
                let first = volumes.len();
                match assembly {
                    None => volumes.push(volume(None)),
                    Some(of) => {
                        // One more than there may be is said to be too many.
                        let instances = 0..scene.assemblies[of].instances.len().min(MOST_VOLUMES + 1);
                        volumes.extend(instances.map(|i| volume(Some((of, i)))));
                    }
                }
                first
            });
            *number = (index as u32 + 1) | if assembly.is_some() { PLACED_VOLUME } else { 0 };
        }
        let mut outer = NONE;
        if let Some(medium) = scene.camera_medium {
            outer = volumes.len() as u32;
            volumes.push(Volume {
                id: medium,
                medium: &scene.media[medium],
                interior: None,
                instance: None,
                index: None,
            });
        }
        if volumes.len() > MOST_VOLUMES {
            return Err(Error::input(&scene.file, too_many(scene, &volumes)));
        }
        let mut is_of_each = vec![false; scene.assemblies.len()];
        volumes.iter().filter_map(|volume| volume.instance).for_each(|(assembly, _)| is_of_each[assembly] = true);
        let boundary = |(primitive, &object): (&Primitive, &u32)| {
            if primitive.tag >> 24 == KIND_INSTANCE {
                let (assembly, instance) = accel.instance_of(scene, primitive);
                return if is_of_each[assembly] { instance as u32 } else { 0 };
            }
            let null = scene.objects[object as usize].material.is_none();
            of_object[object as usize] | if null { NULL_BOUNDARY } else { 0 }
        };
        let boundaries: Vec<u32> = accel.primitives.iter().zip(&accel.objects).map(boundary).collect();
        let world = Boundaries::new(scene, accel, &boundaries);
        let bodies: usize = volumes.iter().map(|volume| volume.times(scene)).sum();
        let mut media = Media {
            volumes: vec![0; HEAD],
            boundaries,
            spectra: Vec::new(),
            outer,
            camera_is_cut: false,
            is_placed: is_of_each.contains(&true),
            most_absorbers: 0,
            most_columns: 0,
            most_kinds: 0,
            most_terms: 1,
            most_listed: 0,
            stretches: (2 * bodies + 1).clamp(4, MOST_STRETCHES as usize) as u32,
            cells: 0,
            marched: 0,
            places: Vec::new(),
            wavelength: None,
            spectrum_words: Vec::new(),
            voxels: Vec::new(),
            grids: Vec::new(),
            voxel_words: Vec::new(),
        };
        media.volumes.resize(HEAD + WORDS * volumes.len(), 0);
        media.volumes[0] = (1.0 / accel.space.scale as f32).to_bits();
        let has_indices = volumes.iter().any(|volume| volume.index.is_some());
        let around = |i: usize| if has_indices { media.bodies_around(i as u32 + 1, &world) } else { Vec::new() };
        let within: Vec<Option<Curve>> =
            (0..volumes.len()).map(|i| product_of_indices(scene, &volumes, &around(i))).collect();
        for (index, (volume, within)) in volumes.iter_mut().zip(within).enumerate() {
            volume.index = within;
            let densities = media.fill(scene, accel, index, volume);
            media.places.push(Filled {
                medium: volume.id,
                densities,
                extent: extent(scene, accel, volume.interior.as_ref()),
                is_repeated: volume.instance.is_some_and(|(_, instance)| instance > 0),
            });
        }
        (media.cells, media.marched) = most_walked(&volumes, media.stretches as usize);
        media.place_camera(scene, accel, &world)?;
        Ok(Some(media))
    }

    pub fn has_grids(&self) -> bool {
        self.wavelength.is_some()
    }

    /// Records of one way: of a stretch through voxels three where they emit, and one for each pair of amounts.
    pub fn way_records(&self) -> u32 {
        let marched = if self.marched > 0 { 3 } else { 1 };
        self.stretches * self.most_terms.div_ceil(2).max(marched)
    }

    /// Iterations that evaluation may take for one way of a path: cells of what emits, in each the kinds of matter where there are several;
    /// and on each stretch the list of spectra. Ways to lights are not marched through.
    pub fn way_iterations(&self) -> u32 {
        if self.marched == 0 {
            return 0;
        }
        let of_cell = if self.most_kinds > 1 { 1 + self.most_kinds } else { 1 };
        self.marched.saturating_mul(of_cell).saturating_add(self.stretches * self.most_listed)
    }

    /// Puts voxels behind everything else in `volumes`, which is whole then.
    pub fn finish(&mut self) {
        let first = self.volumes.len() as u32;
        for word in std::mem::take(&mut self.voxel_words) {
            self.volumes[word] += first;
        }
        self.volumes.extend(std::mem::take(&mut self.voxels).into_iter().map(f32::to_bits));
    }

    /// Moves its spectra to the end of `all`; positions are then those there.
    pub fn move_spectra(&mut self, all: &mut Vec<Needed>) {
        let first = all.len();
        all.append(&mut self.spectra);
        self.name_spectra(|position| (first + position) as u32);
    }

    /// Replaces positions of spectra by the ids that the device's tables gave them.
    pub fn name_spectra(&mut self, id: impl Fn(usize) -> u32) {
        for &word in &self.spectrum_words {
            self.volumes[word] = id(self.volumes[word] as usize);
        }
        self.wavelength = self.wavelength.map(|position| id(position as usize));
    }

    /// Gives the densities of its kinds of matter.
    fn fill(&mut self, scene: &Scene, accel: &Accel, index: usize, volume: &Volume) -> Vec<[u32; 2]> {
        let first = HEAD + WORDS * index;
        let medium = volume.medium;
        let mut words = [0u32; WORDS];
        (words[2], words[3], words[5]) = (NONE, NONE, NONE);
        words[0] = if medium.temperature.is_some() { VOLUME_EMITS } else { 0 };
        words[0] |= if medium.scatters() { VOLUME_SCATTERS } else { 0 };
        words[23] = 1;
        let densities: Vec<[u32; 2]> = match medium.grid_size() {
            None => {
                self.fill_evenly(scene, first, volume, &mut words);
                medium.components.iter().map(|component| self.field(Some(&component.density))).collect()
            }
            Some(size) => self.fill_voxels(scene, accel, first, volume, size, &mut words),
        };
        self.volumes[first..first + WORDS].copy_from_slice(&words);
        densities
    }

    /// Of a medium that is the same everywhere: what it takes of a way, and what it emits for that.
    fn fill_evenly(&mut self, scene: &Scene, first: usize, volume: &Volume, words: &mut [u32; WORDS]) {
        let medium = volume.medium;
        let kelvin = medium.temperature.as_ref().map(|field| field.at(0));
        let (absorbing, factors) = absorption(medium, kelvin, |component| component.density.at(0));
        let (scattering, strengths) = scattering(medium, |component| component.density.at(0));
        let curves: Vec<&Curve> =
            absorbing.iter().chain(&scattering).map(|&spectrum| &scene.spectra[spectrum].curve).collect();
        let count = absorbing.len();
        let sum = |v: &[f64], by: &[f64]| v.iter().zip(by).map(|(v, f)| v * f).sum::<f64>();
        let lost = |v: &[f64]| sum(v, &factors) + sum(&v[count..], &strengths);
        let extinction = Curve::derived(&curves, &scene.channels, lost);
        words[1] = self.spectrum(first + 1, format!("medium \"{}\"", medium.name), extinction, true);
        let Some(kelvin) = kelvin.filter(|kelvin| *kelvin > 0.0) else { return };
        let mut source = source(scene, kelvin, volume.index.as_ref());
        if !scattering.is_empty() {
            // What is emitted is absorption times Planck's law, while a way loses what is scattered too.
            let all: Vec<&Curve> = curves.into_iter().chain([&source]).collect();
            let share = |_: f64, v: &[f64]| {
                let (absorbed, lost) = (sum(v, &factors), lost(&v[..v.len() - 1]));
                if lost > 0.0 { v[v.len() - 1] * absorbed / lost } else { 0.0 }
            };
            source = Curve::derived_by_stretch(&all, &scene.channels, share);
        }
        let name = format!("\"{}\" at {kelvin} K", medium.name);
        words[2] = self.spectrum(first + 2, name, source, false);
    }

    fn fill_voxels(
        &mut self,
        scene: &Scene,
        accel: &Accel,
        first: usize,
        volume: &Volume,
        size: [u32; 3],
        words: &mut [u32; WORDS],
    ) -> Vec<[u32; 2]> {
        let medium = volume.medium;
        words[0] |= VOLUME_GRID;
        [words[3], words[4]] = self.field(medium.temperature.as_ref());
        self.note_voxels(first + 3, words[3]);
        if let Some(index) = &volume.index {
            words[5] = self.spectrum(first + 5, format!("index in \"{}\"", medium.name), index.clone(), false);
        }
        words[7..10].copy_from_slice(&size);
        let interior = volume.interior.expect("grids fill interiors");
        let from_device = DAffine3::from_translation(accel.space.center)
            * DAffine3::from_scale(DVec3::splat(1.0 / accel.space.scale));
        let to_world = volume.instance.map_or(DAffine3::IDENTITY, |(of, i)| scene.assemblies[of].instances[i]);
        let to_grid = interior.to_grid * to_world.inverse();
        let scaled = DAffine3::from_scale(DVec3::from(size.map(f64::from))) * to_grid * from_device;
        let rows = scaled.matrix3.transpose();
        for (i, value) in [rows.x_axis, rows.y_axis, rows.z_axis, scaled.translation].iter().enumerate() {
            let bits = value.as_vec3().to_array().map(f32::to_bits);
            words[10 + 3 * i..13 + 3 * i].copy_from_slice(&bits);
        }
        words[6] = self.volumes.len() as u32;
        let densities: Vec<[u32; 2]> =
            medium.components.iter().map(|component| self.field(Some(&component.density))).collect();
        words[23] = self.components(scene, medium, &densities);
        self.most_terms = self.most_terms.max(words[23]);
        if self.wavelength.is_none() {
            self.wavelength = Some(self.spectra.len() as u32);
            self.spectra.push(wavelength(scene));
        }
        densities
    }

    /// Lists the kinds of matter of a medium of voxels, and gives their number of terms.
    fn components(&mut self, scene: &Scene, medium: &Medium, densities: &[[u32; 2]]) -> u32 {
        self.volumes.push(medium.components.len() as u32);
        self.most_kinds = self.most_kinds.max(medium.components.len() as u32);
        let mut terms = 0;
        for (component, density) in medium.components.iter().zip(densities) {
            self.note_voxels(self.volumes.len(), density[0]);
            self.volumes.extend(density);
            self.volumes.push(NONE);
            if let Some(scattering) = &component.scattering {
                let word = self.volumes.len() - 1;
                self.volumes[word] = self.scene_spectrum(scene, word, scattering.coefficient);
                terms += 1;
            }
            self.volumes.push(component.absorbers.len() as u32);
            for absorber in &component.absorbers {
                self.volumes.extend([(absorber.strength as f32).to_bits(), absorber.columns.len() as u32]);
                for &(kelvin, spectrum) in &absorber.columns {
                    self.volumes.push((kelvin as f32).to_bits());
                    let position = self.scene_spectrum(scene, self.volumes.len(), spectrum);
                    self.volumes.push(position);
                }
                self.most_columns = self.most_columns.max(absorber.columns.len() as u32);
                terms += absorber.columns.len() as u32;
            }
            self.most_absorbers = self.most_absorbers.max(component.absorbers.len() as u32);
        }
        let absorbers: usize = medium.components.iter().map(|component| component.absorbers.len()).sum();
        self.most_listed = self.most_listed.max(terms + (absorbers + medium.components.len()) as u32);
        terms
    }

    /// Notes that word `word`, where it is not [`NONE`], counts voxels.
    fn note_voxels(&mut self, word: usize, value: u32) {
        if value != NONE {
            self.voxel_words.push(word);
        }
    }

    /// Where the voxels of a field begin among all, or [`NONE`]; and its value without them.
    fn field(&mut self, field: Option<&Field>) -> [u32; 2] {
        match field {
            Some(Field::Grid(grid)) => {
                let known = self.grids.iter().find(|(values, _)| Arc::ptr_eq(values, &grid.values));
                let first = known.map_or(self.voxels.len() as u32, |(_, first)| *first);
                if known.is_none() {
                    self.voxels.extend_from_slice(&grid.values);
                    self.grids.push((grid.values.clone(), first));
                }
                [first, 0]
            }
            Some(Field::Constant(value)) => [NONE, (*value as f32).to_bits()],
            None => [NONE, 0],
        }
    }

    fn scene_spectrum(&mut self, scene: &Scene, word: usize, spectrum: SpectrumId) -> u32 {
        let (name, curve) = (scene.spectra[spectrum].name.clone(), scene.spectra[spectrum].curve.clone());
        self.spectrum(word, name, curve, true)
    }

    /// What a spectrum is on the device, by its position.
    pub fn need(&mut self, needed: Needed) -> u32 {
        let known = self.spectra.iter().position(|s| *s == needed);
        known.unwrap_or_else(|| {
            self.spectra.push(needed);
            self.spectra.len() - 1
        }) as u32
    }

    /// Appends a list, and says where it begins.
    pub fn append(&mut self, list: List) -> u32 {
        let first = self.volumes.len();
        self.spectrum_words.extend(list.spectra.iter().map(|word| first + word));
        list.voxels.iter().for_each(|&word| self.note_voxels(first + word, list.words[word]));
        self.volumes.extend(list.words);
        first as u32
    }

    /// Notes a spectrum for word `word` and gives its position. `pointwise`: wherever it is small it is as exact as elsewhere.
    fn spectrum(&mut self, word: usize, name: String, curve: Curve, pointwise: bool) -> u32 {
        self.spectrum_words.push(word);
        self.need(if pointwise { Needed::Pointwise(name, curve) } else { Needed::Derived(name, curve) })
    }

    /// Notes the volumes around the camera, the innermost in the low byte; where boundaries cut its lens or window, those around a
    /// place there, from which devices find those of each ray.
    fn place_camera(&mut self, scene: &Scene, accel: &Accel, boundaries: &Boundaries) -> Result<()> {
        let mut place = (scene.camera.position - accel.space.center) * accel.space.scale;
        if let Projection::Pushbroom { lines, .. } = &scene.camera.projection {
            // Any place of the track does, to which straight ways lead from all others; one that is on no boundary that a model is likely to have.
            const SHARE: f64 = 0.381_966_011;
            let middle = Line::at(lines, 0.5 + SHARE * (lines.len() as f64 - 1.0)).position;
            place = self.start_everywhere((middle - accel.space.center) * accel.space.scale);
        } else if let Some(origins) = Origins::of(scene, &accel.space) {
            let mut cuts: Vec<Cut> = Vec::new();
            boundaries.each(|primitive, _| cuts.extend(origins.cut(primitive)));
            if !cuts.is_empty() {
                place = self.start_everywhere(origins.place_apart_from(&cuts));
            }
        }
        let around = self.around(place, boundaries);
        if around.len() > 8 {
            return Err(Error::input(&scene.file, "the camera is inside more than 8 nested media"));
        }
        let around = around.iter().rev().fold(0, |word, &n| word << 8 | u64::from(n));
        self.volumes[1..3].copy_from_slice(&[around as u32, (around >> 32) as u32]);
        Ok(())
    }

    /// Has each camera ray find what is around its start on the way there from `place`, in device units; gives that as devices have it.
    fn start_everywhere(&mut self, place: DVec3) -> DVec3 {
        let on_device = place.as_vec3();
        self.camera_is_cut = true;
        self.volumes[3] = self.volumes.len() as u32;
        self.volumes.extend(on_device.to_array().map(f32::to_bits));
        on_device.as_dvec3()
    }

    /// Volume `number` and those around it, as they are at one place of its surface; the innermost first.
    fn bodies_around(&self, number: u32, boundaries: &Boundaries) -> Vec<u32> {
        let around = boundaries.place_on(number).map(|place| self.around(place, boundaries)).unwrap_or_default();
        let outer = around.into_iter().filter(|other| *other != number);
        std::iter::once(number).chain(outer).collect()
    }

    /// The volumes around a point in device units, the innermost first.
    fn around(&self, point: DVec3, boundaries: &Boundaries) -> Vec<u32> {
        let outer = (self.outer != NONE).then(|| self.outer + 1);
        boundaries.bodies_around(point).into_iter().chain(outer).collect()
    }
}

/// Why there are more volumes than numbers for them.
fn too_many(scene: &Scene, volumes: &[Volume]) -> String {
    let placed = volumes.iter().filter_map(|volume| Some((volume.instance?.0, volume.medium)));
    let most = placed.max_by_key(|(assembly, _)| scene.assemblies[*assembly].instances.len());
    match most {
        None => format!("{} interiors with media, at most {MOST_VOLUMES} are supported", volumes.len()),
        Some((assembly, medium)) => {
            let Assembly { name, instances } = &scene.assemblies[assembly];
            format!(
                "more than {MOST_VOLUMES} interiors with media, of which each instance of a medium with a grid is one: assembly \"{name}\" \
                 with \"{}\" is placed {} times; place it less often, or use numbers instead of its grids",
                medium.name,
                instances.len()
            )
        }
    }
}

/// The most voxels that a way of so many stretches goes through, and those among them that evaluation marches through.
fn most_walked(volumes: &[Volume], stretches: usize) -> (u32, u32) {
    let sum = |is_walked: fn(&Medium) -> bool| {
        let walked = volumes.iter().filter(|volume| is_walked(volume.medium));
        let cells = |size: [u32; 3]| size.iter().sum::<u32>() + 3;
        let mut all: Vec<u32> = walked.filter_map(|volume| volume.medium.grid_size().map(cells)).collect();
        all.sort_unstable_by(|a, b| b.cmp(a));
        all.iter().take(stretches).sum()
    };
    (sum(|_| true), sum(|medium| medium.temperature.is_some()))
}

/// What sources are multiplied with twice in a body of `material`: its index; the mean over channels where it does not disperse.
fn index(scene: &Scene, material: MaterialId) -> Option<Curve> {
    let Bsdf::Dielectric { eta, dispersion, .. } = scene.materials[material].bsdf else { return None };
    let (curve, bounds) = (&scene.spectra[eta].curve, &scene.channels.bounds);
    let mean = || bounds.iter().map(|b| curve.mean(b[0], b[1])).sum::<f64>() / bounds.len() as f64;
    Some(if dispersion { curve.clone() } else { Curve::Constant(mean()) })
}

/// The index of a place in volumes (numbers + 1), each of which knows its own over what is around it; `None` where none has one.
fn product_of_indices(scene: &Scene, volumes: &[Volume], around: &[u32]) -> Option<Curve> {
    let curves = around.iter().filter_map(|number| volumes.get(*number as usize - 1)?.index.as_ref());
    let curves: Vec<&Curve> = curves.collect();
    match curves[..] {
        [] => None,
        [one] => Some(one.clone()),
        _ => Some(Curve::derived(&curves, &scene.channels, |v| v.iter().product())),
    }
}

/// n² B(λ, T).
fn source(scene: &Scene, kelvin: f64, index: Option<&Curve>) -> Curve {
    let Some(index) = index else { return Curve::Blackbody { kelvin, scale: 1.0 } };
    if index.is_constant() {
        return Curve::Blackbody { kelvin, scale: index.eval(scene.channels.centre(0)).powi(2) };
    }
    Curve::derived_by_stretch(&[index], &scene.channels, |nm, v| planck::radiance(nm, kelvin) * v[0] * v[0])
}

/// How far an interior reaches, in metres from end to end; without one, all space, as far as the scene.
pub fn extent(scene: &Scene, accel: &Accel, interior: Option<&Interior>) -> f64 {
    let Some(interior) = interior else { return 2.0 * accel.space.radius / accel.space.scale };
    let Some(own) = box_around_all(of_body(scene, interior).map(|object| object.shape.bounds())) else { return 0.0 };
    let reach = |[low, high]: [DVec3; 2]| (high - low).length();
    let placed = of_body(scene, interior).filter_map(|object| object.assembly);
    let placed = placed.flat_map(|assembly| &scene.assemblies[assembly].instances);
    placed.map(|to_world| reach(box_around(to_world, own))).reduce(f64::max).unwrap_or(reach(own))
}

/// The objects that together are the surface of a body.
fn of_body<'a>(scene: &'a Scene, interior: &Interior) -> impl Iterator<Item = &'a Object> {
    let body = interior.body;
    scene.objects.iter().filter(move |object| object.interior.is_some_and(|of| of.body == body))
}

/// Spectra and factors whose sum is the absorption of a medium, m⁻¹, at a temperature and the density of each kind of matter.
pub fn absorption(
    medium: &Medium,
    kelvin: Option<f64>,
    mut density: impl FnMut(&Component) -> f64,
) -> (Vec<SpectrumId>, Vec<f64>) {
    let of = |component: &Component| {
        let density = density(component);
        component
            .absorbers
            .iter()
            .flat_map(move |absorber| absorption_of(absorber, kelvin, density))
            .collect::<Vec<_>>()
    };
    medium.components.iter().flat_map(of).unzip()
}

/// Those of one absorber: a column of its table, or the two around a temperature.
pub fn absorption_of(absorber: &Absorber, kelvin: Option<f64>, density: f64) -> Vec<(SpectrumId, f64)> {
    let (columns, strength) = (&absorber.columns, absorber.strength * density);
    let above = kelvin.map_or(0, |kelvin| columns.partition_point(|column| column.0 < kelvin));
    let high = above.min(columns.len() - 1);
    let low = above.max(1) - 1;
    if low == high || columns.len() == 1 {
        return vec![(columns[high].1, strength)];
    }
    let kelvin = kelvin.expect("a table over temperature has one to look up");
    let place = (kelvin - columns[low].0) / (columns[high].0 - columns[low].0);
    vec![(columns[low].1, strength * (1.0 - place)), (columns[high].1, strength * place)]
}

/// The same of its scattering.
pub fn scattering(medium: &Medium, density: impl Fn(&Component) -> f64) -> (Vec<SpectrumId>, Vec<f64>) {
    let of = |component: &Component| Some((component.scattering.as_ref()?.coefficient, density(component)));
    medium.components.iter().filter_map(of).unzip()
}
