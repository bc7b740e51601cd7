// Hot parts of surfaces that emit otherwise at every place. `src/device/words.rs` holds the structure's Rust twin,
// `src/device/parts/radiators.rs` says what its parts are.

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

#constants RADIATORS EMITS_BY_PLACE
#if HOT_TRANSLUCENT
#constants RADIATORS_THROUGH
#endif

@group(0) @binding(15) var<storage, read> radiators: array<Radiator>;
