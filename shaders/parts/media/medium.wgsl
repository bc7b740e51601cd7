// Media along a path: which volume it is in, and the way through each as records. Boundaries without material are passed as if
// they were not there.

// For every primitive: the number of the volume behind it + 1, and whether it is nothing but a boundary; of instances what is added to
// numbers that are marked with PLACED_VOLUME.
@group(0) @binding(60) var<storage, read> boundaries: array<u32>;
#constants BOUNDARIES

// The number of the volume behind what was met + 1, or 0.
fn volume_met(hit: Hit) -> u32 {
    let boundary = boundaries[hit.primitive];
#if PLACED_VOLUMES
    if ((boundary & PLACED_VOLUME) != 0u) {
        return (boundary & 0xffu) + boundaries[hit.instance];
    }
#endif
    return boundary & 0xffu;
}

// The volumes that a path is in, the innermost in the low byte, numbers + 1; deeper ones above it, in the second word last.
#constants MOST_NESTED
// Boundaries without material on one straight way.
const MOST_CROSSINGS: u32 = 256u;

// Enters or leaves volume `number` (+ 1). False where volumes are nested too deep.
fn cross_boundary(around: ptr<function, vec2<u32>>, number: u32, entering: bool) -> bool {
    let low = (*around).x;
    let high = (*around).y;
    if (entering) {
        *around = vec2<u32>((low << 8u) | number, (high << 8u) | (low >> 24u));
        return (high >> 24u) == 0u;
    }
    // The innermost of this number goes.
    for (var n = 0u; n < MOST_NESTED; n += 1u) {
        let word = select(low, high, n >= 4u);
        let shift = 8u * (n & 3u);
        if (((word >> shift) & 0xffu) == number) {
            let below = (1u << shift) - 1u;
            if (n >= 4u) {
                (*around).y = (high & below) | ((high >> 8u) & ~below);
            } else {
                (*around).x = (low & below) | ((((low >> 8u) & 0x00ffffffu) | (high << 24u)) & ~below);
                (*around).y = high >> 8u;
            }
            break;
        }
    }
    return true;
}

// A straight way: stretches through volumes, from `from` to `to` along the ray, in units of its direction.
struct Way {
    count: u32,
    volume: array<u32, MOST_STRETCHES>,
    start: array<f32, MOST_STRETCHES>,
    to: array<f32, MOST_STRETCHES>,
#if SCATTERS
    around: array<vec2<u32>, MOST_STRETCHES>,
#endif
}

// Notes the stretch up to `to` in the innermost volume. False where there are too many.
fn add_stretch(way: ptr<function, Way>, around: vec2<u32>, start: f32, to: f32) -> bool {
    let number = around.x & 0xffu;
    if (number == 0u || !(to > start)) {
        return true;
    }
#if OPACITY
    // A surface that was passed parts nothing.
    let last = max((*way).count, 1u) - 1u;
    if ((*way).count > 0u && (*way).volume[last] == number - 1u && (*way).to[last] == start) {
        (*way).to[last] = to;
        return true;
    }
#endif
    if ((*way).count == MOST_STRETCHES) {
        return false;
    }
    (*way).volume[(*way).count] = number - 1u;
    (*way).start[(*way).count] = start;
    (*way).to[(*way).count] = to;
#if SCATTERS
    (*way).around[(*way).count] = around;
#endif
    (*way).count += 1u;
    return true;
}

// Where a way ends: what was met, by which part of the ray, and how far that part's start is from the ray's, in units of its
// direction.
struct Walked {
    hit: Hit,
    ray: Ray,
    passed: f32,
}

// Follows `ray` up to the first surface with a material, nearer than `limit`; `around` and `way` note what it goes through.
fn walk(ray: Ray, limit: f32, around: ptr<function, vec2<u32>>, way: ptr<function, Way>, overflow: ptr<function, bool>) -> Walked {
    var walked: Walked;
    walked.hit.distance = limit;
    walked.hit.primitive = NONE;
    walked.ray = ray;
    // Where the stretch begins: at the boundary itself, not where the rest of the ray starts.
    var begins = 0.0;
    for (var n = 0u; n < MOST_CROSSINGS; n += 1u) {
        let left = select(limit - walked.passed, INFINITE, limit == INFINITE);
        walked.hit = traverse(walked.ray, left, false, overflow);
        let met = walked.hit.primitive != NONE;
        let ends = select(limit, walked.passed + walked.hit.distance, met);
        if (!add_stretch(way, *around, begins, ends)) {
            *overflow = true;
        }
        begins = ends;
#if OPACITY
        if (!met || *overflow || ((boundaries[walked.hit.primitive] & NULL_BOUNDARY) == 0u && !lets_pass(walked.ray, walked.hit))) {
            return walked;
        }
#else
        if (!met || (boundaries[walked.hit.primitive] & NULL_BOUNDARY) == 0u || *overflow) {
            return walked;
        }
#endif
        let surface = surface_at(walked.ray, walked.hit);
        let entering = dot(surface.normal, ray.direction) < 0.0;
        let number = volume_met(walked.hit);
        if (number != 0u && !cross_boundary(around, number, entering)) {
            *overflow = true;
        }
        // On the same line, where that is as far beyond the boundary as paths start off surfaces: a parallel one would be of another
        // length. Along a boundary not for ever.
        let beyond = select(surface.normal, -surface.normal, entering);
        let depth = dot(offset_origin(surface.position, beyond) - walked.ray.origin, beyond);
        let speed = max(dot(ray.direction, beyond), 1.0e-3 * length(ray.direction));
        walked.passed += max(depth / speed, walked.hit.distance);
        walked.ray.origin = ray.origin + walked.passed * ray.direction;
    }
    *overflow = true;
    return walked;
}

// Records of the way along `ray`; the outer medium, volume OUTER_VOLUME, is left out where the way leads to infinity: what arrives
// from there has been measured at the scene. With `mode` 0 they act on the path, and the media emit `scale`; with MODE_ON_F on
// what next-event estimation found.
fn append_way(list: ptr<function, RecordList>, way: ptr<function, Way>, ray: Ray, infinite: bool, mode: u32, scale: f32) {
    let speed = length(ray.direction) * bitcast<f32>(volumes[0]);
    for (var n = 0u; n < (*way).count; n += 1u) {
        let volume = (*way).volume[n];
        if (infinite && volume == OUTER_VOLUME) {
            continue;
        }
        let first = volume_at(volume);
        let start = (*way).start[n];
        // Interiors end within the scene, which is some 4 units across.
        let to = min((*way).to[n], start + 8.0 / length(ray.direction));
        let metres = (to - start) * speed;
#if GRIDS
        if ((volumes[first] & VOLUME_GRID) != 0u) {
            let from_voxels = to_voxels(first, ray.origin + start * ray.direction);
            let end_voxels = to_voxels(first, ray.origin + to * ray.direction);
            if (mode != 0u || (volumes[first] & VOLUME_EMITS) == 0u) {
                var amounts = amounts_along(first, from_voxels, end_voxels, metres);
                append_amounts(list, first, &amounts, mode);
                continue;
            }
            append(list, OP_MARCH, volume, scale, metres);
            append_raw(list, vec4<f32>(from_voxels, 0.0));
            append_raw(list, vec4<f32>(end_voxels, 0.0));
            (*list).used = (*list).count;
            continue;
        }
#endif
        let source = volumes[first + 2u];
        let emits = mode == 0u && source != NONE;
        if (mode != 0u) {
            append(list, OP_EXTINCTION | mode, volumes[first + 1u], 1.0, metres);
            continue;
        }
        append(list, OP_MEDIUM | (select(0u, source, emits) << 16u), volumes[first + 1u], select(0.0, scale, emits), metres);
        if (emits) {
            (*list).used = (*list).count;
        }
    }
}

#if GRIDS
// From device units to voxels.
fn to_voxels(first: u32, p: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(
        dot(volume_vector(first + 10u), p),
        dot(volume_vector(first + 13u), p),
        dot(volume_vector(first + 16u), p),
    ) + volume_vector(first + 19u);
}
#endif
