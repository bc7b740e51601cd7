// Materials of general scenes: lists of parts, the lobes that a path chooses among (docs/METHOD.md, Decisions).
// `src/gpu/layout.rs` holds the structures' Rust twins.

struct SurfaceMaterial {
    first_part: u32,
    part_count: u32,
    flags: u32,
    // The largest directional albedo over channels and directions, rounded up to a step of the random numbers.
    survival: f32,
}

// Some part lets light through: directions on both sides matter.
const MATERIAL_TRANSMITS: u32 = 1u;
// One part, Lambert's law: a vertex is one record.
const MATERIAL_DIFFUSE: u32 = 2u;

// One way in which a material scatters.
struct Part {
    // Kind in the low 8 bits, flags above.
    kind: u32,
    // Spectrum ids: a | b << 16, c | d << 16.
    ab: u32,
    cd: u32,
    // Share of a blend.
    weight: f32,
    alpha: vec2<f32>,
    // First values in `tables`: probabilities of choosing this part, and of reflection at a dielectric boundary.
    picks: u32,
    decision: u32,
    // First value of the table of what single scattering loses, and its rows; or the number of 128 values before a table
    // over index and cosine.
    loss: u32,
    rows: u32,
    mean_loss: f32,
    // The index behind over that before, by which all channels bend; and the least and the greatest of any channel.
    eta: f32,
    eta_least: f32,
    eta_greatest: f32,
}

const PART_OPAQUE: u32 = 0x100u;
const PART_TWO_SIDED: u32 = 0x200u;
// Channels bend by their own indices.
const PART_DISPERSES: u32 = 0x400u;
// They bend further apart than the lobe is wide: refraction leaves one.
const PART_NARROW: u32 = 0x800u;

const KIND_LAMBERT: u32 = 0u;
const KIND_CONDUCTOR: u32 = 1u;
const KIND_ROUGH_CONDUCTOR: u32 = 2u;
const KIND_CONDUCTOR_AGAIN: u32 = 3u;
const KIND_MIRROR: u32 = 4u;
const KIND_REFRACTION: u32 = 5u;
const KIND_ROUGH_BOUNDARY: u32 = 6u;
const KIND_BOUNDARY_AGAIN: u32 = 7u;
const KIND_BEYOND_AGAIN: u32 = 8u;
const KIND_ROUGH_COAT: u32 = 9u;
const KIND_BASE: u32 = 10u;

@group(0) @binding(12) var<storage, read> surface_materials: array<SurfaceMaterial>;
@group(0) @binding(13) var<storage, read> parts: array<Part>;

// Tables over the cosine hold [before, behind][257 cosines from 0 to 1].
const TABLE_INTERVALS: u32 = 256u;

fn cosine_table(first: u32, behind: bool, cosine: f32) -> f32 {
    let x = clamp(cosine, 0.0, 1.0) * f32(TABLE_INTERVALS);
    let i = min(u32(x), TABLE_INTERVALS - 1u);
    let at = first + select(0u, TABLE_INTERVALS + 1u, behind) + i;
    return tables[at] + (x - f32(i)) * (tables[at + 1u] - tables[at]);
}

// Where cosine `z` stands among the 128 nodes of a table of albedos, as `scattering::microfacet` has it.
fn albedo_position(z: f32, alpha: f32) -> f32 {
    return 127.0 * sqrt(0.5 * (z + z * (1.0 + alpha) / (z + alpha)));
}
