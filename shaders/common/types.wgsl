// Structures shared by the kernels; `src/device/words.rs` holds their Rust twins and a test compares both.

const PI: f32 = 3.14159265;
const INV_PI: f32 = 0.318309886;
#constants NONE
const INFINITE: f32 = 3.0e38;
#constants ENDED

// What stays the same during a render. Lengths are in device units: recentred, and scaled by a power of two so that
// the scene spans about [-1, 1].
struct Frame {
    camera_position: vec3<f32>,
    seed_low: u32,
    camera_forward: vec3<f32>,
    seed_high: u32,
    camera_right: vec3<f32>,
    aperture_radius: f32,
    camera_up: vec3<f32>,
    focus_distance: f32,
    // tan of the half angles, or half the orthographic window.
    half_size: vec2<f32>,
    film_size: vec2<f32>,
    max_bounces: u32,
    // First scattering event at which roulette may end a path.
    roulette_start: u32,
    emitter_count: u32,
    // Probability that next-event estimation asks the environment, and its spectrum.
    environment_pick: f32,
    environment_spectrum: u32,
    max_records: u32,
    // Wavelength strata per channel in the spectral tables: 2^stratum_bits.
    stratum_bits: u32,
    unused: u32,
}

// What stays the same during a wave: one range of samples of the pixels of one or several units of one epoch.
struct Wave {
    path_count: u32,
    pixel_count: u32,
    // Samples per pixel in this wave, and the index of the first within its epoch.
    samples: u32,
    sample_begin: u32,
    // First pixel slot; slots number the pixels of all units of the wave, tile after tile.
    pixel_begin: u32,
    tile_width: u32,
    tile_pixels: u32,
    epoch: u32,
    // Samples of the epoch - 1, a power of two - 1.
    epoch_mask: u32,
    // Marks what this wave writes: 1 to 65,535, not that of any of the last waves.
    sequence: u32,
}

// One dispatch of a wave: a bounce of all paths, or a sample of all pixels.
struct Step {
    bounce: u32,
    sample: u32,
}

struct Ray {
    origin: vec3<f32>,
    direction: vec3<f32>,
}

struct Hit {
    distance: f32,
    primitive: u32,
    // Barycentric weights of the second and third vertex (triangles only).
    u: f32,
    v: f32,
#if INSTANCES
    // The instance that it is a part of, or NONE.
    instance: u32,
#endif
}

// What a ray can meet: three vertices, or a shape as shapes.wgsl has it.
struct Primitive {
    a: vec3<f32>,
    // Material in the low 24 bits, kind in the high 8; kind 0 is a triangle.
    tag: u32,
    b: vec3<f32>,
    // NONE where nothing is emitted.
    emitter: u32,
    c: vec3<f32>,
}

// A surface point; the normal is the geometric one, not turned towards the ray.
struct Surface {
    position: vec3<f32>,
    normal: vec3<f32>,
    material: u32,
    emitter: u32,
}

// One emitting primitive. `pick` is its share in next-event estimation, `pick_end` the upper end of the interval in [0, 1] that
// chooses it, `area` in device units.
struct Emitter {
    primitive: u32,
    spectrum: u32,
    pick: f32,
    area: f32,
    pick_end: f32,
}

#constants EMITTERS

// `factor`: spectrum of the throughput, NONE where nothing is scattered. `albedo`: its largest value over the channels,
// rounded up to a step of the random numbers, so that it is the probability with which roulette lets a path go on.
struct Material {
    factor: u32,
    two_sided: u32,
    albedo: f32,
    unused: u32,
}

#constants COUNTERS
