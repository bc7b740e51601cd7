// Light that matter scatters: by which technique a path decides, and the densities of all of them (docs/METHOD.md, Techniques). Words of a volume's
// list, as `device::parts::scattering` lays them out: for each amount TECHNIQUES numbers for how far paths go, TECHNIQUES and one more
// for what is lost; then how many kinds of matter scatter, and of each SCATTERER_WORDS words:
//      0, 1 density, as kinds of matter have it    2 scattering (spectrum)    3 kind of phase function    5 its share, per density
//      4 g (spectrum), γ, or number of the table   6 place among a table's columns (spectrum)
// and what each technique scatters, then its g.

#constants SCATTERERS

const STEP_WORDS: u32 = 2u * TECHNIQUES + 1u;

// Where a path was scattered by matter.
struct Collision {
    // The first word of its volume, and the voxel there.
    first: u32,
    voxel: u32,
    // The direction in which the path went.
    direction: vec3<f32>,
    // What the density of having come to this place makes of its weight.
    weight: f32,
    // The path's technique.
    technique: u32,
}

var<private> collision: Collision;

// 1 - cos of the angle between two unit vectors, without cancellation.
fn versine_between(a: vec3<f32>, b: vec3<f32>) -> f32 {
    let chord = b - a;
    return min(0.5 * dot(chord, chord), 2.0);
}

fn henyey_greenstein(g: f32, versine: f32) -> f32 {
    let x = (1.0 - g) * (1.0 - g) + 2.0 * versine * g;
    return (1.0 - g) * (1.0 + g) / (x * sqrt(x));
}

fn rayleigh(gamma: f32, versine: f32) -> f32 {
    let cosine = 1.0 - versine;
    return 0.75 / (1.0 + 2.0 * gamma) * (1.0 + 3.0 * gamma + (1.0 - gamma) * cosine * cosine);
}

// The list of what scatters in a volume.
fn scatterers_of(first: u32) -> u32 {
    return volumes[first + 22u] + STEP_WORDS * volumes[first + 23u];
}

fn scatterer_density(at: u32, voxel: u32) -> f32 {
#if GRIDS
    return value_in(at, voxel);
#else
    return bitcast<f32>(volumes[at + 1u]);
#endif
}

// What technique `t` has of kind of matter `at` for each direction (of mean 1).
fn phase_density(at: u32, t: u32, versine: f32) -> f32 {
    let kind = volumes[at + 3u];
    if (kind == PHASE_RAYLEIGH) {
        return rayleigh(bitcast<f32>(volumes[at + 4u]), versine);
    }
#if PHASE_TABLES
    if (kind == PHASE_TABLE) {
        return table_density(volumes[at + 4u], t, versine);
    }
#endif
    return henyey_greenstein(bitcast<f32>(volumes[at + SCATTERER_WORDS + TECHNIQUES + t]), versine);
}

// What technique `t` scatters at a place, per metre; and what all kinds of matter count for all channels.
fn scattered_there(first: u32, voxel: u32, t: u32) -> vec2<f32> {
    let list = scatterers_of(first);
    var at = list + 1u;
    var sum = vec2<f32>(0.0);
    for (var n = 0u; n < volumes[list]; n += 1u) {
        let density = scatterer_density(at, voxel);
        sum += density * vec2<f32>(bitcast<f32>(volumes[at + SCATTERER_WORDS + t]), bitcast<f32>(volumes[at + 5u]));
        at += SCATTERER_WORDS + 2u * TECHNIQUES;
    }
    return sum;
}

// With which chance a kind of matter is taken as the one that scatters.
fn chance_of_kind(at: u32, voxel: u32, t: u32, all: vec2<f32>) -> f32 {
    let density = scatterer_density(at, voxel);
    let common_share = density * bitcast<f32>(volumes[at + 5u]) / all.y;
    if (!(all.x > 0.0)) {
        return common_share;
    }
    return 0.9 * density * bitcast<f32>(volumes[at + SCATTERER_WORDS + t]) / all.x + 0.1 * common_share;
}

// The density over solid angle with which technique `t` goes on from the collision by an angle.
fn turn_density(t: u32, versine: f32) -> f32 {
    let list = scatterers_of(collision.first);
    let all = scattered_there(collision.first, collision.voxel, t);
    var at = list + 1u;
    var sum = 0.0;
    for (var n = 0u; n < volumes[list]; n += 1u) {
        sum += chance_of_kind(at, collision.voxel, t, all) * phase_density(at, t, versine);
        at += SCATTERER_WORDS + 2u * TECHNIQUES;
    }
    return sum * (0.25 * INV_PI);
}

// That of all techniques, as paths come here by them.
fn matter_density(direction: vec3<f32>) -> f32 {
    let versine = versine_between(collision.direction, direction);
#if RATIOS
    var sum = 0.0;
    var all = 0.0;
    for (var t = 0u; t < TECHNIQUES; t += 1u) {
        densities[t] = 0.0;
        // What never comes here decides nothing.
        if (ratios[t] > 0.0) {
            densities[t] = turn_density(t, versine);
            sum += ratios[t] * densities[t];
            all += ratios[t];
        }
    }
    return sum / all;
#else
    return turn_density(0u, versine);
#endif
}

// A unit vector at an angle to `direction`.
fn turned(direction: vec3<f32>, versine: f32, u: f32) -> vec3<f32> {
    let around = tangents(direction);
    let side = unit_circle(u) * sqrt(max(0.0, versine * (2.0 - versine)));
    return normalize((1.0 - versine) * direction + side.x * around.s + side.y * around.t);
}

// A direction by the path's technique.
fn sample_turn(u: vec2<f32>, u_kind: f32) -> vec3<f32> {
    let t = collision.technique;
    let list = scatterers_of(collision.first);
    let all = scattered_there(collision.first, collision.voxel, t);
    var at = list + 1u;
    var chosen = at;
    var below = 0.0;
    for (var n = 0u; n < volumes[list]; n += 1u) {
        let chance = chance_of_kind(at, collision.voxel, t, all);
        if (chance > 0.0 && (below == 0.0 || u_kind >= below)) {
            chosen = at;
        }
        below += chance;
        at += SCATTERER_WORDS + 2u * TECHNIQUES;
    }
    var versine: f32;
    let kind = volumes[chosen + 3u];
    if (kind == PHASE_RAYLEIGH) {
        // A constant and a square of the cosine.
        let gamma = bitcast<f32>(volumes[chosen + 4u]);
        let even = (1.0 + 3.0 * gamma) / (1.0 + 3.0 * gamma + (1.0 - gamma) / 3.0);
        let v = 2.0 * select((u.x - even) / (1.0 - even), u.x / even, u.x < even) - 1.0;
        versine = 1.0 - select(sign(v) * pow(abs(v), 1.0 / 3.0), v, u.x < even);
    } else {
        let g = bitcast<f32>(volumes[chosen + SCATTERER_WORDS + TECHNIQUES + t]);
        // Inverted without a difference of nearly equal numbers, for any g.
        let below_one = 1.0 - g + 2.0 * g * u.x;
        let k = (1.0 - g) * (1.0 + g) / below_one;
        versine = (1.0 - g) * (1.0 - u.x) * (k + 1.0 - g) / below_one;
    }
#if PHASE_TABLES
    if (kind == PHASE_TABLE) {
        versine = sample_table(volumes[chosen + 4u], t, u.x);
    }
#endif
    return turned(collision.direction, clamp(versine, 0.0, 2.0), u.y);
}
