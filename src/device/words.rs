//! What host and devices share, word by word: constants, which `shaders/` name by `#constants` and get from here, and the
//! twins of WGSL structures, whose sizes and offsets a test compares with what naga reads.

use bytemuck::{Pod, Zeroable};

/// Named numbers that WGSL files take over together: `#constants GROUP`, or some of them by name.
macro_rules! constants {
    ($($(#[$of:meta])* $group:ident { $($(#[$doc:meta])* $name:ident = $value:literal;)* })*) => {
        $($($(#[$doc])* pub const $name: u32 = $value;)*)*
        /// All groups: name, and the constants with their values as they are written here.
        const GROUPS: &[(&str, &[(&str, &str)])] =
            &[$((stringify!($group), &[$((stringify!($name), stringify!($value))),*])),*];
    };
}

constants! {
    /// What is no index, and the last word of the state of a path that goes no further.
    IDS {
        NONE = 0xffff_ffff;
        ENDED = 0xffff_ffff;
    }
    /// Roulette on evaluation: what a path counts for at most, so that its chance is 1 / this at least.
    CHANCES {
        MOST_WEIGHT = 64;
    }
    /// Places of [`Counters`], which every pass may raise.
    COUNTERS {
        /// Traversals that gave up.
        COUNTER_OVERFLOW = 0;
        COUNTER_NON_FINITE = 1;
        COUNTER_NEGATIVE = 2;
        /// Where these were: the pixel slot that reported first, and the largest sample index + 1 reported.
        COUNTER_BAD_SLOT = 3;
        COUNTER_BAD_SAMPLE = 4;
        /// Rays traced by the paths that ended: low and high word.
        COUNTER_RAYS = 5;
        COUNTER_RAYS_HIGH = 6;
        /// Proof that all took place: samples folded, of pixels all of whose paths have ended in the same wave (of all pixel slots,
        /// by each workgroup of a pixel, modulo 2^32), and the sequence number of the last wave.
        COUNTER_FOLDED = 7;
        COUNTER_SEQUENCE = 8;
    }
    /// The most records that a path took: in general scenes, where materials decide how many there are.
    RECORDS_USED {
        COUNTER_RECORDS = 9;
    }
    /// [`Emitter::spectrum`]: a spectrum id in the low bits.
    EMITTERS {
        EMITS_BOTH_SIDES = 0x8000_0000;
        SPECTRUM_MASK = 0xffff;
    }
    /// Further bits of [`Emitter::spectrum`].
    EMITTER_KINDS {
        /// [`Emitter::primitive`] is the index of a [`Lamp`], and [`Emitter::area`] the factor that its spectrum takes: for points device
        /// units squared per square metre, for suns the radiance of a unit irradiance, else 1.
        EMITTER_IS_LAMP = 0x4000_0000;
        /// The rest is the place among the emitters of the first spectrum of a row over cosines.
        EMITS_BY_ANGLE = 0x2000_0000;
        /// The rest is the first of some radiators and, from bit 16, their number.
        EMITS_BY_PLACE = 0x1000_0000;
    }
    /// [`Primitive::tag`]: what it is, in the high byte; 0 is a triangle.
    PRIMITIVE_KINDS {
        KIND_SPHERE = 1;
        KIND_DISK = 2;
        KIND_CYLINDER = 3;
    }
    /// One more kind: its corners are the rows of a matrix.
    INSTANCES {
        KIND_INSTANCE = 4;
    }
    /// Bits of [`Primitive::attributes`].
    ATTRIBUTES {
        HAS_COORDINATES = 0x8000_0000;
        HAS_NORMALS = 0x4000_0000;
    }
    /// Bits of [`SurfaceMaterial::flags`].
    MATERIALS {
        /// Some lobe lets light through: directions on both sides matter.
        MATERIAL_TRANSMITS = 1;
        /// One lobe, Lambert's law: a vertex is one record.
        MATERIAL_DIFFUSE = 2;
    }
    /// Further bits: some rays pass. From bit 8 on the place of its opacity in the tables, or its texture.
    MASKS {
        MATERIAL_MASKED = 4;
        MATERIAL_MASK_IS_TEXTURE = 8;
        MASK_SHIFT = 8;
    }
    /// Another, where paths decide by several techniques: each has its own chances for the lobes.
    TECHNIQUES {
        MATERIAL_BY_TECHNIQUE = 16;
        /// Of [`Lobe::kind`]: channels bend by their own indices, and each technique by its own, `loss` of the tables being the first.
        LOBE_BY_TECHNIQUE = 0x8000;
    }
    /// Flags of what a ray meets first: its traversal gave up; less than half of all rays are stopped there.
    FIRST_HITS {
        FIRST_HIT_OVERFLOW = 1;
        FIRST_HIT_OPEN = 2;
    }
    /// [`Lobe::kind`]: what it does, in the low byte.
    LOBE_KINDS {
        LOBE_LAMBERT = 0;
        LOBE_CONDUCTOR = 1;
        LOBE_ROUGH_CONDUCTOR = 2;
        LOBE_CONDUCTOR_AGAIN = 3;
        LOBE_MIRROR = 4;
        LOBE_REFRACTION = 5;
        LOBE_ROUGH_BOUNDARY = 6;
        LOBE_BOUNDARY_AGAIN = 7;
        LOBE_BEYOND_AGAIN = 8;
        LOBE_ROUGH_COAT = 9;
        LOBE_BASE = 10;
    }
    /// A further one: Lambert's law on the other side.
    LOBE_THROUGH {
        LOBE_TRANSMITTED = 11;
    }
    /// Above: facets of a metal whose further scattering has a lobe of its own, and which mirror hardly anything below the surface.
    LOBE_AGAIN {
        LOBE_BOUNDED = 0x2000;
    }
    /// And: the roughness is a texture. `rows` says where the words about it stand among those of textures.
    VARIES {
        LOBE_VARIES = 0x4000;
        /// What there is in tables is there at so many even steps of √α from 0 to 1.
        ROUGHNESS_STEPS = 32;
    }
    /// And the bits above it.
    LOBE_FLAGS {
        LOBE_OPAQUE = 0x100;
        LOBE_TWO_SIDED = 0x200;
        /// Channels bend by their own indices.
        LOBE_DISPERSES = 0x400;
        /// They bend further apart than the lobe is wide: refraction leaves one.
        LOBE_NARROW = 0x800;
        /// The reflectance of its diffuse surface or base is texture `loss`.
        LOBE_TEXTURED = 0x1000;
    }
    /// Tables over the cosine hold [before, behind][this + 1 cosines from 0 to 1]; rows of tables of albedos so many values.
    TABLES {
        COSINE_INTERVALS = 256;
        ALBEDO_ROW = 128;
    }
    /// Of a spectrum, in factored renders of scenes that separate in part: whether it is in products where it multiplies, and where it shines.
    SEPARABLE {
        SEPARATES_AS_FACTOR = 1;
        SEPARATES_AS_SOURCE = 2;
    }
    /// Words of a texture at the head of their list.
    TEXTURES {
        TEXTURE_WORDS = 5;
    }
    /// And of each in the list of their placements: scale and offset along u and v, and whether texels are nearest ones.
    PLACEMENTS {
        PLACEMENT_WORDS = 5;
    }
    /// [`Lamp::kind`].
    LAMPS {
        LAMP_POINT = 0;
        LAMP_DIRECTIONAL = 1;
        LAMP_SUN = 2;
    }
    /// Further ones: a point that shines into a cone, which is the [`Lamp`] after it. And the kinds of cones: how they end.
    SPOTS {
        LAMP_SPOT = 3;
        CONE_SMOOTH = 0;
        CONE_LINEAR = 1;
    }
    /// [`Radiator::kind`]: what the surface does, in the low byte.
    RADIATORS {
        /// Nothing: what is inside is black or reflects diffusely.
        RADIATOR_OPEN = 0;
        /// A smooth metal, and one of facets.
        RADIATOR_MIRROR = 1;
        RADIATOR_FACETS = 2;
        /// A smooth or rough coat.
        RADIATOR_VARNISH = 3;
        RADIATOR_COAT = 4;
        /// A lamp, which no temperature decides.
        RADIATOR_LAMP = 5;
        /// And the bits above it: the back is as the front.
        RADIATOR_TWO_SIDED = 0x100;
        /// What is inside absorbs as spectrum `inner` says: below a coat, or what facets have scattered more than once.
        RADIATOR_ABSORBS = 0x200;
        /// What it sends is in products of spectra (`device::separable`).
        RADIATOR_SEPARATES = 0x1000;
    }
    /// Further bits: what is inside keeps, beside its textured reflectance, what spectrum a says; or what the texture in the
    /// upper half of the word says.
    RADIATORS_THROUGH {
        RADIATOR_PASSES_SPECTRUM = 0x400;
        RADIATOR_PASSES_TEXTURE = 0x800;
    }
    /// Facets that a rough metal shows at once; cosines at which the emission of a side is known.
    HEAT {
        HOT_FACET_COUNT = 5;
        HOT_COSINES = 128;
    }
    /// Words before the first volume, and of each, with the bits of its first (`shaders/parts/media/volume.wgsl`).
    VOLUMES {
        VOLUMES_HEAD = 5;
        VOLUME_WORDS = 24;
        VOLUME_GRID = 1;
        VOLUME_EMITS = 2;
        VOLUME_SCATTERS = 4;
        /// How far paths go in it is decided by what it takes of them, not by what it scatters.
        VOLUME_BY_EXTINCTION = 8;
    }
    /// Words of a kind of matter that scatters, before those of each technique; its phase functions.
    SCATTERERS {
        SCATTERER_WORDS = 7;
        PHASE_HENYEY_GREENSTEIN = 0;
        PHASE_RAYLEIGH = 1;
        PHASE_TABLE = 2;
    }
    /// What lies behind a primitive: the number of a volume + 1, whether it is nothing but a boundary, and whether the number is that of the
    /// first instance, to which what stands for the instance is added.
    BOUNDARIES {
        NULL_BOUNDARY = 0x8000_0000;
        PLACED_VOLUME = 0x4000_0000;
    }
    /// Volumes that a path may be in, of 8 bits each.
    NESTING {
        MOST_NESTED = 8;
    }
    /// Numbers before the intervals of rows in the table of an environment map: its rotation.
    MAPS {
        MAP_ROWS = 12;
    }
}

/// The most loop iterations, of all its loops, that one invocation of any kernel may run: Mesa 22.3's lavapipe ends loops at 65,535
/// without a word. The self-test at start-up checks this many.
pub const LOOP_LIMIT: u32 = 32_768;

/// Declarations in WGSL of the group of constants `name`, or of the one constant; `None` where there is neither.
pub fn declarations(name: &str) -> Option<Vec<String>> {
    let declare = |(name, value): &(&str, &str)| format!("const {name}: u32 = {}u;", value.replace('_', ""));
    let group = GROUPS.iter().find(|(group, _)| *group == name).map(|(_, all)| all.iter().map(declare).collect());
    let single = || GROUPS.iter().flat_map(|(_, all)| *all).find(|(constant, _)| *constant == name);
    group.or_else(|| single().map(|constant| vec![declare(constant)]))
}

/// `Frame` in WGSL: what stays the same during a render. Lengths in device units.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
pub struct Frame {
    pub camera_position: [f32; 3],
    pub seed_low: u32,
    pub camera_forward: [f32; 3],
    pub seed_high: u32,
    pub camera_right: [f32; 3],
    pub aperture_radius: f32,
    pub camera_up: [f32; 3],
    pub focus_distance: f32,
    pub half_size: [f32; 2],
    pub film_size: [f32; 2],
    pub max_bounces: u32,
    pub roulette_start: u32,
    pub emitter_count: u32,
    pub environment_pick: f32,
    pub environment_spectrum: u32,
    pub max_records: u32,
    pub stratum_bits: u32,
    pub unused: u32,
}

/// `Wave` in WGSL: one range of samples of the pixels of one or several units of one epoch.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct Wave {
    pub path_count: u32,
    pub pixel_count: u32,
    pub samples: u32,
    pub sample_begin: u32,
    pub pixel_begin: u32,
    pub tile_width: u32,
    pub tile_pixels: u32,
    pub epoch: u32,
    pub epoch_mask: u32,
    pub sequence: u32,
}

/// `Step` in WGSL: one dispatch of a wave, a bounce of all paths or a sample of all pixels.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
pub struct Step {
    pub bounce: u32,
    pub sample: u32,
}

/// `Emitter` in WGSL: one emitting primitive.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
pub struct Emitter {
    pub primitive: u32,
    /// Spectrum id, with [`EMITS_BOTH_SIDES`].
    pub spectrum: u32,
    pub pick: f32,
    pub area: f32,
    /// Upper end of its interval in [0, 1], from which a random number chooses; the intervals lie above the environment's.
    pub pick_end: f32,
}

/// `Material` in WGSL.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
pub struct Material {
    /// Spectrum of the throughput; [`NONE`] where nothing is scattered.
    pub factor: u32,
    pub two_sided: u32,
    pub albedo: f32,
    pub unused: u32,
}

/// `SurfaceMaterial` in WGSL: a material of a general scene.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
pub struct SurfaceMaterial {
    pub first_lobe: u32,
    pub lobe_count: u32,
    /// [`MATERIAL_TRANSMITS`] and others.
    pub flags: u32,
    pub survival: f32,
}

/// `Lobe` in WGSL: one way in which a material scatters.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
pub struct Lobe {
    /// A `LOBE_…` kind, with flags.
    pub kind: u32,
    /// Spectrum ids a | b << 16, c | d << 16.
    pub ab: u32,
    pub cd: u32,
    pub weight: f32,
    pub alpha: [f32; 2],
    pub picks: u32,
    pub decision: u32,
    pub loss: u32,
    pub rows: u32,
    pub mean_loss: f32,
    pub eta: f32,
    pub eta_least: f32,
    pub eta_greatest: f32,
}

/// `Radiator` in WGSL: a hot part of a surface that emits by place.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
pub struct Radiator {
    /// A `RADIATOR_…`, with flags.
    pub kind: u32,
    /// Spectrum ids a | b << 16.
    pub spectra: u32,
    /// A spectrum id, and the number of a table over index and cosine << 16.
    pub inner: u32,
    pub weight: f32,
    pub alpha: [f32; 2],
    pub kelvin: f32,
    /// Textures, or [`NONE`]: of the temperature, and of the reflectance or a lamp.
    pub temperature: u32,
    pub reflectance: u32,
    /// Where the textures of its share are, and how many.
    pub shares: u32,
}

/// A light without a surface, two vectors of words (shaders/parts/lights/lamp.wgsl).
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
pub struct Lamp {
    /// Position in device units, or the unit vector towards the light; of a cone its axis.
    pub place: [f32; 3],
    /// One of `LAMP_…`, or of a cone, one of `CONE_…`.
    pub kind: u32,
    /// Of a sun's angular radius: sine squared, and 1 - cos. Of a cone where it begins to fall, and where it ends: 1 - cos of
    /// that, or with `CONE_LINEAR` the angles over π.
    pub sine2: f32,
    pub versine: f32,
    pub unused: [u32; 2],
}

/// One primitive, 48 bytes: three words of four. A triangle is its three vertices; see `shaders/parts/geometry/shapes.wgsl`
/// for the others.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
pub struct Primitive {
    pub a: [f32; 3],
    /// Material in the low 24 bits, kind in the high 8.
    pub tag: u32,
    pub b: [f32; 3],
    /// Index of the emitter, or [`NONE`].
    pub emitter: u32,
    pub c: [f32; 3],
    /// Where its [`crate::device::accel::Accel::attributes`] start, with [`HAS_COORDINATES`] and [`HAS_NORMALS`]; 0 without.
    pub attributes: u32,
}

/// The counters that every pass may raise, in the order of the `COUNTER_…` constants.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct Counters {
    pub overflow: u32,
    pub non_finite: u32,
    pub negative: u32,
    pub bad_slot: u32,
    pub bad_sample: u32,
    pub rays_low: u32,
    pub rays_high: u32,
    pub folded: u32,
    pub sequence: u32,
    pub records: u32,
}

/// What the counters of a submission must show if every kernel ran.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Proof {
    /// Camera paths of the pixels in the image: each traces at least one ray.
    pub paths: u64,
    /// Samples of all pixel slots, times the workgroups that share a pixel.
    pub folded: u64,
    /// Of the last wave.
    pub sequence: u32,
}

impl Counters {
    pub fn rays(&self) -> u64 {
        u64::from(self.rays_high) << 32 | u64::from(self.rays_low)
    }

    /// What a kernel left out, if one did: drivers have dropped work without a word.
    pub fn missing(&self, proof: &Proof) -> Option<String> {
        if self.sequence != proof.sequence {
            Some(format!("its last wave is number {}, not {}", self.sequence, proof.sequence))
        } else if self.folded != proof.folded as u32 {
            Some(format!("{} samples have paths that ended, not {} (modulo 2^32)", self.folded, proof.folded as u32))
        } else if self.rays() < proof.paths {
            Some(format!("{} rays were traced for {} camera paths", self.rays(), proof.paths))
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::text::{Defines, compose, module};
    use std::mem::{offset_of, size_of};

    /// What naga says about the struct `name` in types.wgsl: its size, and its members' names and offsets.
    fn wgsl_struct(name: &str) -> (u32, Vec<(String, u32)>) {
        let sources = [
            module!("common/types.wgsl"),
            module!("common/tables.wgsl"),
            module!("parts/surfaces/material.wgsl"),
            module!("parts/heat/radiator.wgsl"),
        ];
        let module = compose(&sources, &Defines::default()).parse().unwrap();
        let found = module.types.iter().find_map(|(_, t)| match &t.inner {
            naga::TypeInner::Struct { members, span } if t.name.as_deref() == Some(name) => {
                Some((*span, members.iter().map(|m| (m.name.clone().unwrap(), m.offset)).collect()))
            }
            _ => None,
        });
        found.unwrap_or_else(|| panic!("no struct {name} in types.wgsl or the parts"))
    }

    macro_rules! same_layout {
        ($name:ident { $($field:ident),* }) => {
            let (span, members) = wgsl_struct(stringify!($name));
            assert_eq!(size_of::<$name>(), span as usize, "size of {}", stringify!($name));
            let ours = vec![$((stringify!($field).to_owned(), offset_of!($name, $field) as u32)),*];
            assert_eq!(ours, members, "members of {}", stringify!($name));
        };
    }

    #[test]
    fn structs_match_the_wgsl() {
        same_layout!(Frame {
            camera_position,
            seed_low,
            camera_forward,
            seed_high,
            camera_right,
            aperture_radius,
            camera_up,
            focus_distance,
            half_size,
            film_size,
            max_bounces,
            roulette_start,
            emitter_count,
            environment_pick,
            environment_spectrum,
            max_records,
            stratum_bits,
            unused
        });
        same_layout!(Wave {
            path_count,
            pixel_count,
            samples,
            sample_begin,
            pixel_begin,
            tile_width,
            tile_pixels,
            epoch,
            epoch_mask,
            sequence
        });
        same_layout!(Step { bounce, sample });
        same_layout!(Emitter { primitive, spectrum, pick, area, pick_end });
        same_layout!(Material { factor, two_sided, albedo, unused });
        same_layout!(SurfaceMaterial { first_lobe, lobe_count, flags, survival });
        same_layout!(Lobe {
            kind,
            ab,
            cd,
            weight,
            alpha,
            picks,
            decision,
            loss,
            rows,
            mean_loss,
            eta,
            eta_least,
            eta_greatest
        });
        same_layout!(Radiator { kind, spectra, inner, weight, alpha, kelvin, temperature, reflectance, shares });
        assert_eq!(size_of::<Primitive>(), 48);
        let counters = [
            (COUNTER_OVERFLOW, offset_of!(Counters, overflow)),
            (COUNTER_NON_FINITE, offset_of!(Counters, non_finite)),
            (COUNTER_NEGATIVE, offset_of!(Counters, negative)),
            (COUNTER_BAD_SLOT, offset_of!(Counters, bad_slot)),
            (COUNTER_BAD_SAMPLE, offset_of!(Counters, bad_sample)),
            (COUNTER_RAYS, offset_of!(Counters, rays_low)),
            (COUNTER_RAYS_HIGH, offset_of!(Counters, rays_high)),
            (COUNTER_FOLDED, offset_of!(Counters, folded)),
            (COUNTER_SEQUENCE, offset_of!(Counters, sequence)),
            (COUNTER_RECORDS, offset_of!(Counters, records)),
        ];
        assert_eq!(size_of::<Counters>(), 4 * counters.len());
        for (place, offset) in counters {
            assert_eq!(4 * place as usize, offset);
        }
    }

    #[test]
    fn what_a_kernel_left_out_is_noticed() {
        let proof = Proof { paths: 100, folded: (1 << 32) + 128, sequence: 7 };
        let done = Counters { rays_low: 100, folded: 128, sequence: 7, ..Counters::default() };
        assert_eq!(done.missing(&proof), None);
        assert_eq!(Counters { rays_low: 0, rays_high: 1, ..done }.missing(&proof), None);
        let missing = |counters: Counters| counters.missing(&proof).expect("something is missing");
        assert!(missing(Counters::default()).contains("last wave is number 0, not 7"));
        assert!(missing(Counters { sequence: 6, ..done }).contains("number 6"));
        assert!(missing(Counters { folded: 64, ..done }).contains("64 samples have paths that ended, not 128"));
        assert!(missing(Counters { rays_low: 99, ..done }).contains("99 rays"));
    }

    /// No WGSL file declares what the host has a name for.
    #[test]
    fn no_constant_is_typed_twice() {
        fn files(folder: &std::path::Path) -> Vec<std::path::PathBuf> {
            let entries = std::fs::read_dir(folder).expect("shaders").map(|entry| entry.expect("an entry").path());
            entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
        }
        let ours: Vec<&str> = GROUPS.iter().flat_map(|(_, all)| all.iter().map(|(name, _)| *name)).collect();
        let ops = crate::device::instructions::INSTRUCTIONS.iter().map(|instruction| instruction.name);
        let ours: Vec<&str> = ours.into_iter().chain(ops).collect();
        let all = files(&std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders"));
        assert!(all.len() > 40);
        for file in all {
            let text = std::fs::read_to_string(&file).expect("a shader");
            for line in text.lines().filter_map(|line| line.trim().strip_prefix("const ")) {
                let name = line.split(':').next().expect("a name");
                assert!(!ours.contains(&name), "{}: {name} is in words.rs or instructions.rs", file.display());
            }
        }
    }
}
