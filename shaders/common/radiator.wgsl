// Hot parts of surfaces that emit otherwise at every place. `src/gpu/layout.rs` holds the structure's Rust twin,
// `src/render/radiators.rs` says what its parts are.

struct Radiator {
    // What the surface does in the low 8 bits, flags above.
    kind: u32,
    // Spectrum ids: a | b << 16.
    spectra: u32,
    // A spectrum id, and the number of 128 values before a table over index and cosine << 16.
    inner: u32,
    weight: f32,
    alpha: vec2<f32>,
    kelvin: f32,
    // Textures, or NONE.
    temperature: u32,
    reflectance: u32,
    shares: u32,
}

const RADIATOR_OPEN: u32 = 0u;
const RADIATOR_MIRROR: u32 = 1u;
const RADIATOR_FACETS: u32 = 2u;
const RADIATOR_VARNISH: u32 = 3u;
const RADIATOR_COAT: u32 = 4u;
const RADIATOR_LAMP: u32 = 5u;
const RADIATOR_TWO_SIDED: u32 = 0x100u;
const RADIATOR_ABSORBS: u32 = 0x200u;

// Of an emitter's spectrum: it is the first of some radiators, and their number.
const EMITS_BY_PLACE: u32 = 0x10000000u;

@group(0) @binding(15) var<storage, read> radiators: array<Radiator>;
