// Materials of general scenes: lists of lobes, among which a path chooses (docs/METHOD.md, Decisions). `src/device/words.rs` holds
// the structures' Rust twins.

struct SurfaceMaterial {
    first_lobe: u32,
    lobe_count: u32,
    flags: u32,
    // The largest directional albedo over channels and directions, rounded up to a step of the random numbers.
    survival: f32,
}

#constants MATERIALS
#if RATIOS
#constants TECHNIQUES
#endif

// One way in which a material scatters.
struct Lobe {
    // Kind in the low 8 bits, flags above.
    kind: u32,
    // Spectrum ids: a | b << 16, c | d << 16.
    ab: u32,
    cd: u32,
    // Share of a blend.
    weight: f32,
    alpha: vec2<f32>,
    // First values in `tables`: probabilities of choosing this lobe, and of reflection at a dielectric boundary; or the directions of
    // what a metal's facets scatter again.
    picks: u32,
    decision: u32,
    // First value of the table of what single scattering loses, and its rows; or the number of 128 values before a table
    // over index and cosine; or, of a rough boundary, the first of the techniques' indices in `tables`.
    loss: u32,
    rows: u32,
    mean_loss: f32,
    // The index behind over that before, by which all channels bend; and the least and the greatest of any channel.
    eta: f32,
    eta_least: f32,
    eta_greatest: f32,
}

#constants LOBE_KINDS LOBE_FLAGS
#if TRANSMITTED
#constants LOBE_THROUGH
#endif
#if CONDUCTOR_AGAIN
#constants LOBE_AGAIN
#endif

@group(0) @binding(12) var<storage, read> surface_materials: array<SurfaceMaterial>;
@group(0) @binding(13) var<storage, read> lobes: array<Lobe>;

// Tables over the cosine hold [before, behind][257 cosines from 0 to 1].
#constants COSINE_INTERVALS

fn cosine_table(first: u32, behind: bool, cosine: f32) -> f32 {
    let x = clamp(cosine, 0.0, 1.0) * f32(COSINE_INTERVALS);
    let i = min(u32(x), COSINE_INTERVALS - 1u);
    let at = first + select(0u, COSINE_INTERVALS + 1u, behind) + i;
    return tables[at] + (x - f32(i)) * (tables[at + 1u] - tables[at]);
}

// Where cosine `z` stands among the 128 nodes of a table of albedos, as `spectral::hemisphere` has it.
fn albedo_position(z: f32, alpha: f32) -> f32 {
    return 127.0 * sqrt(0.5 * (z + z * (1.0 + alpha) / (z + alpha)));
}
