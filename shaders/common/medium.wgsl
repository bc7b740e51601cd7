// Media along a path: which volume it is in, and the way through each as records. Boundaries without material are passed as if
// they were not there.

// For every primitive: the number of the volume behind it + 1, and whether it is nothing but a boundary.
@group(0) @binding(60) var<storage, read> boundaries: array<u32>;
const NULL_BOUNDARY: u32 = 0x80000000u;

// The volumes that a path is in, the innermost in the low byte, numbers + 1; deeper ones above it, in the second word last.
const MOST_NESTED: u32 = 8u;

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
    from: array<f32, MOST_STRETCHES>,
    to: array<f32, MOST_STRETCHES>,
}

// Notes the stretch up to `to` in the innermost volume. False where there are too many.
fn add_stretch(way: ptr<function, Way>, around: vec2<u32>, from: f32, to: f32) -> bool {
    let number = around.x & 0xffu;
    if (number == 0u || !(to > from)) {
        return true;
    }
    if ((*way).count == MOST_STRETCHES) {
        return false;
    }
    (*way).volume[(*way).count] = number - 1u;
    (*way).from[(*way).count] = from;
    (*way).to[(*way).count] = to;
    (*way).count += 1u;
    return true;
}

// What lies behind the primitive that a ray met: the rest of the ray, with what is around it.
fn pass_boundary(ray: Ray, hit: Hit, surface: Surface, around: ptr<function, vec2<u32>>) -> Ray {
    let entering = dot(surface.normal, ray.direction) < 0.0;
    let number = boundaries[hit.primitive] & 0xffu;
    if (number != 0u) {
        _ = cross_boundary(around, number, entering);
    }
    return Ray(offset_origin(surface.position, select(surface.normal, -surface.normal, entering)), ray.direction);
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
        let from = (*way).from[n];
        let metres = ((*way).to[n] - from) * speed;
#if GRIDS
        if ((volumes[first] & VOLUME_GRID) != 0u) {
            append(list, OP_MARCH | mode, volume, scale, metres);
            append_raw(list, vec4<f32>(to_voxels(first, ray.origin + from * ray.direction), 0.0));
            append_raw(list, vec4<f32>(to_voxels(first, ray.origin + (*way).to[n] * ray.direction), 0.0));
            if (mode == 0u && (volumes[first] & VOLUME_EMITS) != 0u) {
                (*list).used = (*list).count;
            }
            continue;
        }
#endif
        let source = volumes[first + 2u];
        let emits = mode == 0u && source != NONE;
        append(list, OP_MEDIUM | mode | (select(0u, source, emits) << 16u), volumes[first + 1u], select(0.0, scale, emits), metres);
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
