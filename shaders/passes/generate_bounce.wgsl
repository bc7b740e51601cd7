// Generate, one bounce of every path: the next vertex, what it emits, next-event estimation, the next direction.
// No wavelength takes part in any decision.
//
// A vertex is saved as records (factor spectrum, source spectrum, weight), to be read as
//     throughput *= factor;  radiance += weight * throughput * source,
// with every wavelength-independent term of the path (densities, cosines, MIS) multiplied into the weight.

@group(1) @binding(0) var<uniform> wave: Wave;
@group(1) @binding(1) var<storage, read> units: array<vec4<u32>>;
@group(1) @binding(2) var<storage, read_write> states: array<vec4<u32>>;
@group(1) @binding(3) var<storage, read_write> heads: array<vec$HEAD_WORDS<u32>>;
@group(1) @binding(4) var<storage, read_write> records: array<vec2<u32>>;
@group(1) @binding(5) var<storage, read_write> counters: array<atomic<u32>>;
@group(1) @binding(6) var<uniform> step: Step;
#if ROULETTE
@group(1) @binding(7) var<storage, read_write> throughputs: array<f32>;
#endif

// Paths still under way, compacted from bounce to bounce: two lists that take turns, and how long each became. Their
// order differs from run to run, the paths do not.
@group(1) @binding(8) var<storage, read_write> queue: array<u32>;
@group(1) @binding(9) var<storage, read_write> queue_lengths: array<atomic<u32>>;

// `count` records so far; evaluation may stop after the last one with a weight, `used`.
struct RecordList {
    path: u32,
    count: u32,
    used: u32,
}

fn append(list: ptr<function, RecordList>, factor: u32, source: u32, weight: f32) {
    records[(*list).path * frame.max_records + (*list).count] = vec2<u32>(factor | (source << 16u), bitcast<u32>(weight));
    (*list).count += 1u;
    // By the bits: a weight that is not a number must reach evaluation, which counts it.
    if (bitcast<u32>(weight) != 0u) {
        (*list).used = (*list).count;
    }
}

fn end_path(list: RecordList, rays: u32) {
    if (atomicAdd(&counters[COUNTER_RAYS], rays) > 0xffffffffu - rays) {
        atomicAdd(&counters[COUNTER_RAYS_HIGH], 1u);
    }
    heads[list.path].y = list.used | (wave.sequence << 16u);
}

@compute @workgroup_size(64)
fn generate_bounce(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let place = id.x + id.y * groups.x * 64u;
    var path = place;
    if (step.bounce == 0u) {
        if (place >= wave.path_count) {
            return;
        }
    } else {
        if (place >= atomicLoad(&queue_lengths[step.bounce - 1u])) {
            return;
        }
        path = queue[(step.bounce & 1u) * wave.path_count + place];
    }
    let state1 = states[2u * path + 1u];
    let packed = state1.w;
    if (packed == ENDED) {
        return;
    }
    let state0 = bitcast<vec4<f32>>(states[2u * path]);
    let ray = Ray(state0.xyz, bitcast<vec3<f32>>(state1.xyz));
    // Density of `direction`, for MIS; the camera's own rays compete with nothing.
    let density = state0.w;
#if BOUNCE_BY_BOUNCE
    // Evaluated before the next bounce.
    var list = RecordList(path, 0u, 0u);
#else
    var list = RecordList(path, packed & 0xffffu, packed >> 16u);
#endif
    var overflow = false;
#if ROULETTE
    var scale = throughputs[path];
#else
    let scale = 1.0;
#endif

    // The next vertex.
    let hit = traverse(ray, INFINITE, false, &overflow);
    if (hit.primitive == NONE) {
#if ENVIRONMENT
        // The environment is sampled in proportion to the cosine, like the surface: the densities differ by `pick`.
        let weight = select(power_heuristic(1.0, frame.environment_pick), 1.0, step.bounce == 0u);
        append(&list, 0u, frame.environment_spectrum, scale * weight);
#endif
#if THINNED
        note_seen(&list);
#endif
        if (overflow) {
            atomicAdd(&counters[COUNTER_OVERFLOW], 1u);
        }
        end_path(list, 2u * step.bounce + 1u);
        return;
    }
    let surface = surface_at(ray, hit);
    let from_front = dot(surface.normal, ray.direction) < 0.0;

    // What it emits.
#if EMITTERS
    if (surface.emitter != NONE) {
        let spectrum = emitters[surface.emitter].spectrum;
        if (from_front || (spectrum & EMITS_BOTH_SIDES) != 0u) {
            var weight = 1.0;
            if (step.bounce > 0u) {
                weight = power_heuristic(density, light_density(surface.emitter, ray.origin, ray.direction, hit.distance, surface.normal));
            }
            append(&list, 0u, spectrum & SPECTRUM_MASK, scale * weight);
        }
    }
#endif

#if THINNED
    note_seen(&list);
#endif
    let material = materials[surface.material];
    if (step.bounce == frame.max_bounces || material.factor == NONE || !(from_front || material.two_sided != 0u) || overflow) {
        if (overflow) {
            atomicAdd(&counters[COUNTER_OVERFLOW], 1u);
        }
        end_path(list, 2u * step.bounce + 1u);
        return;
    }

    // Random numbers of this bounce.
    let slot = wave.pixel_begin + path / wave.samples;
    let index = wave.sample_begin + path % wave.samples;
    let in_tile = slot % wave.tile_pixels;
    let pixel = units[slot / wave.tile_pixels].xy + vec2<u32>(in_tile % wave.tile_width, in_tile / wave.tile_width);
    let key = pixel_key(frame.seed_low, frame.seed_high, pixel.x, pixel.y, wave.epoch);
    let dimension = DIMENSION_BOUNCE + step.bounce * DIMENSIONS_PER_BOUNCE;
    let u_light = random_pair(key, dimension + DIMENSION_LIGHT_POINT, index, wave.epoch_mask);
    let u_bsdf = random_pair(key, dimension + DIMENSION_BSDF, index, wave.epoch_mask);
    let u_choice = random_pair(key, dimension + DIMENSION_CHOICE, index, wave.epoch_mask);

    // Next-event estimation. A Lambertian surface reflects factor/pi, sampled with cosine/pi.
    let normal = select(-surface.normal, surface.normal, from_front);
    let origin = offset_origin(surface.position, normal);
    var weight = 0.0;
    var source = 0u;
    var shadow = Ray(origin, vec3<f32>(0.0, 0.0, 1.0));
    var shadow_limit = 0.0;
#if ENVIRONMENT
    if (u_choice.x < frame.environment_pick) {
        shadow.direction = cosine_hemisphere(normal, u_light);
        shadow_limit = INFINITE;
        weight = power_heuristic(frame.environment_pick, 1.0) / frame.environment_pick;
        source = frame.environment_spectrum;
    }
#endif
#if EMITTERS
#if ENVIRONMENT
    else
#endif
    {
        let emitter = emitters[choose_emitter(u_choice.x)];
        let point = sample_emitter(emitter, origin, u_light);
        let towards = point.position - origin;
        let cosine = dot(normal, towards) / length(towards);
        if (point.density > 0.0 && cosine > 0.0) {
            let facing = select(point.normal, -point.normal, dot(point.normal, towards) > 0.0);
            shadow.direction = offset_origin(point.position, facing) - origin;
            shadow_limit = 1.0;
            weight = cosine * INV_PI / point.density * power_heuristic(point.density, cosine * INV_PI);
            source = emitter.spectrum & SPECTRUM_MASK;
        }
    }
#endif
#if LIGHTS
    if (traverse(shadow, shadow_limit, true, &overflow).primitive != NONE) {
        weight = 0.0;
    }
#endif
    append(&list, material.factor, source, scale * weight);

    // The next direction.
    let direction = cosine_hemisphere(normal, u_bsdf);
#if ROULETTE
    if (step.bounce + 1u >= frame.roulette_start) {
        if (u_choice.y >= material.albedo) {
            if (overflow) {
                atomicAdd(&counters[COUNTER_OVERFLOW], 1u);
            }
            end_path(list, 2u * step.bounce + 2u);
            return;
        }
        scale /= material.albedo;
    }
    throughputs[path] = scale;
#endif
    if (overflow) {
        atomicAdd(&counters[COUNTER_OVERFLOW], 1u);
    }
#if BOUNCE_BY_BOUNCE
    heads[path].y = list.count;
#else
    heads[path].y = list.used;
#endif
    states[2u * path] = bitcast<vec4<u32>>(vec4<f32>(origin, dot(normal, direction) * INV_PI));
    states[2u * path + 1u] = vec4<u32>(bitcast<vec3<u32>>(direction), list.count | (list.used << 16u));
    let next = atomicAdd(&queue_lengths[step.bounce], 1u);
    queue[((step.bounce + 1u) & 1u) * wave.path_count + next] = path;
}
