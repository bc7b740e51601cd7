// Generate in general scenes, one bounce of every path: the next vertex, what it emits, next-event estimation, the next
// direction; where materials are lists of lobes, and records a small program (common/record.wgsl).
// No wavelength takes part in any decision but that of the one channel which dispersion left.

@group(1) @binding(0) var<uniform> wave: Wave;
@group(1) @binding(1) var<storage, read> units: array<vec4<u32>>;
@group(1) @binding(2) var<storage, read_write> states: array<vec4<u32>>;
@group(1) @binding(3) var<storage, read_write> heads: array<vec2<u32>>;
@group(1) @binding(5) var<storage, read_write> counters: array<atomic<u32>>;
@group(1) @binding(6) var<uniform> step: Step;
#if ROULETTE
@group(1) @binding(7) var<storage, read_write> throughputs: array<f32>;
#endif
// Paths still under way: two lists that take turns, and how long each became.
@group(1) @binding(12) var<storage, read_write> queue: array<u32>;
@group(1) @binding(13) var<storage, read_write> queue_lengths: array<atomic<u32>>;

const DIMENSION_LOBE: u32 = 3u;
const DIMENSIONS_PER_VERTEX: u32 = 4u;

fn end_path(list: RecordList, rays: u32, overflow: bool) {
    if (overflow) {
        atomicAdd(&counters[COUNTER_OVERFLOW], 1u);
    }
    if (atomicAdd(&counters[COUNTER_RAYS], rays) > 0xffffffffu - rays) {
        atomicAdd(&counters[COUNTER_RAYS_HIGH], 1u);
    }
    heads[list.path].y = list.used | (wave.sequence << 16u);
}

@compute @workgroup_size(64)
fn generate_vertex(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
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
    let state1 = states[STATE_WORDS * path + 1u];
    let packed = state1.w;
    if (packed == ENDED) {
        return;
    }
    let state0 = bitcast<vec4<f32>>(states[STATE_WORDS * path]);
    let ray = Ray(state0.xyz, bitcast<vec3<f32>>(state1.xyz));
    // Density of `direction`, for MIS; negative where it competes with nothing: the camera's own rays, mirrors, ideal
    // refraction.
    let density = state0.w;
    // The one channel that refraction left, or NONE.
#if DISPERSION
    var live = states[STATE_WORDS * path + 2u].x;
#else
    let live = NONE;
#endif
#if BOUNCE_BY_BOUNCE
    // Evaluated before the next bounce.
    var list = RecordList(path, 0u, 0u, 0u);
#else
    var list = RecordList(path, packed & 0xffffu, packed >> 16u, 0u);
#endif
    var overflow = false;
#if ROULETTE
    var scale = throughputs[path];
#else
    let scale = 1.0;
#endif

    // The next vertex.
#if MEDIA
    var nested = vec2<u32>(volumes[1], volumes[2]);
    if (step.bounce > 0u) {
        nested = states[STATE_WORDS * path + 2u].yz;
    }
#if CAMERA_CUT
    else {
        nested = volumes_at(ray.origin, &overflow);
    }
#endif
    var way: Way;
    let walked = walk(ray, INFINITE, &nested, &way, &overflow);
    let hit = walked.hit;
    append_way(&list, &way, ray, hit.primitive == NONE, 0u, scale);
    let distance = walked.passed + hit.distance;
#else
    let hit = traverse(ray, INFINITE, false, &overflow);
    let distance = hit.distance;
#endif
    if (hit.primitive == NONE) {
#if ENVIRONMENT
        // A uniform environment is met by sampling the BSDF, which is as good as aiming at it.
        let begin = list.count;
        append(&list, OP_ONE | MODE_SINGLE, 0u, scale, 0.0);
        gather(&list, begin, frame.environment_spectrum);
#endif
#if MAP
        let found = find_in_map(ray.direction);
        let map_begin = list.count;
        append_map(&list, MODE_SINGLE, found.place, scale * select(power_heuristic(density, frame.environment_pick * found.density), 1.0, density < 0.0));
        gather(&list, map_begin, MAP_SOURCE);
#endif
#if SUNS
        for (var s = frame.emitter_count - SUNS; s < frame.emitter_count; s += 1u) {
            let sun = emitters[s];
            let other = sun_density(sun, ray.direction);
            if (other >= 0.0) {
                let sun_begin = list.count;
                append(&list, OP_ONE | MODE_SINGLE, 0u, scale * sun.area * select(power_heuristic(density, other), 1.0, density < 0.0), 0.0);
                gather(&list, sun_begin, sun.spectrum & SPECTRUM_MASK);
            }
        }
#endif
        end_path(list, 2u * step.bounce + 1u, overflow);
        return;
    }
#if MEDIA
    let surface = surface_at(walked.ray, hit);
#else
    let surface = surface_at(ray, hit);
#endif
    let from_front = dot(surface.normal, ray.direction) < 0.0;

    let material = surface_materials[surface.material];
    // The geometric normal on the side of the ray.
    let face = select(-surface.normal, surface.normal, from_front);
    var v = vertex_at(hit, surface, from_front, -ray.direction);

    // What it emits.
#if EMITTERS
    if (surface.emitter != NONE) {
        let spectrum = emitters[surface.emitter].spectrum;
        if (from_front || (spectrum & EMITS_BOTH_SIDES) != 0u) {
            var weight = 1.0;
            if (density >= 0.0) {
                weight = power_heuristic(density, light_density(surface.emitter, ray.origin, ray.direction, distance, surface.normal));
            }
            let begin = list.count;
#if RADIATORS
            if ((spectrum & EMITS_BY_PLACE) != 0u) {
#if HOT_FACETS
                append_heat(&list, spectrum, v, scale * weight, hot_numbers(path, SALT_MET));
#else
                append_heat(&list, spectrum, v, scale * weight, vec2<f32>(0.0));
#endif
                gather(&list, begin, 0u);
            } else {
#endif
            append(&list, OP_ONE | MODE_SINGLE, 0u, scale * weight, 0.0);
#if HOT
#if SMOOTH
            let cosine = v.o.z;
#else
            let cosine = abs(dot(surface.normal, ray.direction));
#endif
            gather(&list, begin, emitted_spectrum(emitters[surface.emitter], from_front, cosine, hot_numbers(path, SALT_ANGLE).x));
#else
            gather(&list, begin, spectrum & SPECTRUM_MASK);
#endif
#if RADIATORS
            }
#endif
        }
    }
#endif
    if (step.bounce == frame.max_bounces || material.lobe_count == 0u || !(v.o.z > 0.0) || overflow) {
        end_path(list, 2u * step.bounce + 1u, overflow);
        return;
    }

    // Random numbers of this bounce.
    let slot = wave.pixel_begin + path / wave.samples;
    let index = wave.sample_begin + path % wave.samples;
    let in_tile = slot % wave.tile_pixels;
    let pixel = units[slot / wave.tile_pixels].xy + vec2<u32>(in_tile % wave.tile_width, in_tile / wave.tile_width);
    let key = pixel_key(frame.seed_low, frame.seed_high, pixel.x, pixel.y, wave.epoch);
    let dimension = DIMENSION_BOUNCE + step.bounce * DIMENSIONS_PER_VERTEX;
    let u_bsdf = random_pair(key, dimension + DIMENSION_BSDF, index, wave.epoch_mask);
    let u_choice = random_pair(key, dimension + DIMENSION_CHOICE, index, wave.epoch_mask);
    let u_lobe = random_pair(key, dimension + DIMENSION_LOBE, index, wave.epoch_mask);

    let choice = choose_direction(material, &v, u_bsdf, u_lobe, heads[path].x, live);
    if (choice.lobe == NONE) {
        end_path(list, 2u * step.bounce + 1u, overflow);
        return;
    }
    let lobe = lobes[choice.lobe];
    let i = choice.direction;
    var next_density = choice.density;
    var goes_on = choice.goes_on;

#if SMOOTH
    // No light is reflected into a surface, or passes to where it came from.
    goes_on = goes_on && dot(to_world(v, i), face) * i.z > 0.0;
#endif

    // A light, and the direction to it.
    var light_direction = vec3<f32>(0.0);
    var light_weight = 0.0;
    var light_pdf = 0.0;
    var source = 0u;
    var shadow = Ray(surface.position, vec3<f32>(0.0, 0.0, 1.0));
    var shadow_limit = 1.0;
#if LAMPS
    var light_strength = 1.0;
    var is_met = true;
#endif
#if RADIATORS
    // Radiators of the light, and the point on it.
    var hot = 0u;
    var hot_vertex: Vertex;
#if HOT_FACETS
    let hot_random = hot_numbers(path, SALT_AIMED);
#else
    let hot_random = vec2<f32>(0.0);
#endif
#endif
#if MAP
    var map_place: MapPlace;
    var from_map = false;
#endif
#if AIMS
    {
        let u_light = random_pair(key, dimension + DIMENSION_LIGHT_POINT, index, wave.epoch_mask);
        let transmits = (material.flags & MATERIAL_TRANSMITS) != 0u;
        let seen_from = select(offset_origin(surface.position, face), surface.position, transmits);
        var towards = vec3<f32>(0.0);
        // Where the way to the light ends, if it does.
        var end = vec3<f32>(0.0);
#if MAP
        from_map = u_choice.x < frame.environment_pick;
        if (from_map) {
            let sampled = sample_map(u_light);
            towards = sampled.direction;
            light_pdf = frame.environment_pick * sampled.density;
            map_place = sampled.place;
            source = MAP_SOURCE;
            shadow_limit = INFINITE;
        }
#endif
#if CHOOSES
#if MAP
        else
#endif
        {
            let emitter = emitters[choose_emitter(u_choice.x)];
            source = emitter.spectrum & SPECTRUM_MASK;
#if LAMPS
            if ((emitter.spectrum & EMITTER_IS_LAMP) != 0u) {
                let aim = aim_at_lamp(emitter, seen_from, u_light);
                towards = aim.towards;
                light_pdf = aim.density;
                light_strength = aim.strength;
                is_met = aim.kind == LAMP_SUN;
                end = seen_from + towards;
                shadow_limit = select(INFINITE, 1.0, aim.kind == LAMP_POINT);
            }
#if EMITTERS
            else
#endif
#endif
#if EMITTERS
            {
                let point = sample_emitter(emitter, seen_from, u_light);
                towards = point.position - seen_from;
                light_pdf = point.density;
                let facing = select(point.normal, -point.normal, dot(point.normal, towards) > 0.0);
                end = offset_origin(point.position, facing);
#if HOT
                let along = dot(point.normal, towards) / max(length(towards), 1.0e-30);
#if SMOOTH
                var cosine = abs(along);
                if ((emitter.spectrum & EMITS_BY_ANGLE) != 0u && light_pdf > 0.0) {
                    cosine = emitting_vertex(emitter, point, -normalize(towards)).o.z;
                }
                source = emitted_spectrum(emitter, along < 0.0, cosine, hot_numbers(path, SALT_ANGLE).y);
#else
                source = emitted_spectrum(emitter, along < 0.0, abs(along), hot_numbers(path, SALT_ANGLE).y);
#endif
#endif
#if RADIATORS
                if ((emitter.spectrum & EMITS_BY_PLACE) != 0u && light_pdf > 0.0) {
                    hot = emitter.spectrum;
                    hot_vertex = emitting_vertex(emitter, point, -normalize(towards));
                    source = 0u;
                }
#endif
            }
#endif
        }
#endif
        let side = dot(face, towards);
#if SMOOTH
        let keeps_side = side * dot(v.normal, towards) > 0.0;
#else
        let keeps_side = true;
#endif
        if (light_pdf > 0.0 && side != 0.0 && (side > 0.0 || transmits) && keeps_side) {
            light_direction = normalize(to_local(v, towards));
            shadow.origin = offset_origin(surface.position, select(-face, face, side > 0.0));
            shadow.direction = select(end - shadow.origin, towards, shadow_limit == INFINITE);
        } else {
            light_pdf = 0.0;
        }
    }
#endif

    // Both directions in turn: the light's, if it is seen, adds its radiance; the other goes on.
    var advanced = false;
    for (var turn = select(1u, 0u, light_pdf > 0.0); turn < 2u; turn += 1u) {
        let to_light = turn == 0u;
        if (!to_light && (!goes_on || next_density < 0.0)) {
            break;
        }
        let direction = select(i, light_direction, to_light);
        let chance = bsdf_density(material, v, direction);
        var weight = 1.0 / chance;
        if (to_light) {
            weight = scale * power_heuristic(light_pdf, chance) / light_pdf;
#if LAMPS
            weight = light_strength * select(scale / light_pdf, weight, is_met);
#endif
#if MEDIA
            way.count = 0u;
            var nested_light = nested;
            let inner = boundaries[hit.primitive] & 0xffu;
            if (direction.z < 0.0 && inner != 0u && !cross_boundary(&nested_light, inner, from_front)) {
                overflow = true;
            }
            if (walk(shadow, shadow_limit, &nested_light, &way, &overflow).hit.primitive != NONE) {
                continue;
            }
#else
            if (traverse(shadow, shadow_limit, true, &overflow).primitive != NONE) {
                continue;
            }
#endif
        } else {
            next_density = chance;
            if (!(chance > 0.0)) {
                goes_on = false;
                break;
            }
        }
        let begin = list.count;
        if ((material.flags & MATERIAL_DIFFUSE) != 0u) {
            // One record for both: next-event estimation adds its radiance behind the surface's reflectance.
#if MAP
            if (to_light && from_map) {
                append(&list, OP_SPECTRUM | MODE_SINGLE, lobe.ab, weight * max(direction.z, 0.0) * INV_PI, 0.0);
                append_map(&list, MODE_ON_F, map_place, 1.0);
#if MEDIA
                append_way(&list, &way, shadow, true, MODE_ON_F, 1.0);
#endif
                gather(&list, begin, source);
                continue;
            }
#endif
#if RADIATORS
            if (to_light && hot != 0u) {
                append(&list, OP_SPECTRUM | MODE_SINGLE, lobe.ab, weight * max(direction.z, 0.0) * INV_PI, 0.0);
                append_heat_aimed_at(&list, hot, hot_vertex, hot_random);
#if MEDIA
                append_way(&list, &way, shadow, false, MODE_ON_F, 1.0);
#endif
                gather(&list, begin, 0u);
                continue;
            }
#endif
#if MEDIA
            if (to_light && way.count > 0u) {
                append(&list, OP_SPECTRUM | MODE_SINGLE, lobe.ab, weight * max(direction.z, 0.0) * INV_PI, 0.0);
                append_way(&list, &way, shadow, shadow_limit == INFINITE, MODE_ON_F, 1.0);
                gather(&list, begin, source);
                continue;
            }
#endif
            if (to_light) {
                append(&list, OP_PLAIN | (source << 16u), lobe.ab, weight * max(direction.z, 0.0) * INV_PI, 0.0);
                list.used = list.count;
                advanced = true;
            } else if (!advanced) {
                append(&list, OP_PLAIN, lobe.ab, 0.0, 0.0);
            }
            continue;
        }
        for (var p = material.first_lobe; p < material.first_lobe + material.lobe_count; p += 1u) {
            if (lobe_pick(p, v) > 0.0) {
                append_lobe(&list, lobe_at(p, v), v, direction, weight);
            }
        }
        if (to_light) {
#if MAP
            if (from_map && list.count > begin) {
                append_map(&list, MODE_ON_F, map_place, 1.0);
            }
#endif
#if RADIATORS
            if (hot != 0u && list.count > begin) {
                append_heat_aimed_at(&list, hot, hot_vertex, hot_random);
            }
#endif
#if MEDIA
            if (list.count > begin) {
                append_way(&list, &way, shadow, shadow_limit == INFINITE, MODE_ON_F, 1.0);
            }
#endif
            gather(&list, begin, source);
        } else if (list.count > begin) {
            records[list.last].x |= MODE_ADVANCE;
        } else {
            goes_on = false;
        }
    }
    if (goes_on && next_density < 0.0) {
        append(&list, choice.only | MODE_ADVANCE, lobe.ab, choice.only_weight, choice.only_parameter);
#if DISPERSION
        if (choice.only_channel != NONE) {
            live = choice.only_channel;
            append(&list, OP_ONLY | MODE_SINGLE | MODE_ADVANCE, live, f32(CHANNELS), 0.0);
        }
#endif
    }

#if ROULETTE
    if (goes_on && step.bounce + 1u >= frame.roulette_start) {
        goes_on = u_choice.y < material.survival;
        scale /= material.survival;
    }
    throughputs[path] = scale;
#endif
    if (!goes_on) {
        end_path(list, 2u * step.bounce + 2u, overflow);
        return;
    }
    if (overflow) {
        atomicAdd(&counters[COUNTER_OVERFLOW], 1u);
    }
    let direction = to_world(v, i);
    let origin = offset_origin(surface.position, select(-face, face, i.z > 0.0));
#if BOUNCE_BY_BOUNCE
    heads[path].y = list.count;
#else
    heads[path].y = list.used;
#endif
    states[STATE_WORDS * path] = bitcast<vec4<u32>>(vec4<f32>(origin, next_density));
    states[STATE_WORDS * path + 1u] = vec4<u32>(bitcast<vec3<u32>>(direction), list.count | (list.used << 16u));
#if MEDIA
    let behind_surface = boundaries[hit.primitive] & 0xffu;
    if (i.z < 0.0 && behind_surface != 0u && !cross_boundary(&nested, behind_surface, from_front)) {
        atomicAdd(&counters[COUNTER_OVERFLOW], 1u);
    }
#if DISPERSION
    states[STATE_WORDS * path + 2u] = vec4<u32>(live, nested, 0u);
#else
    states[STATE_WORDS * path + 2u] = vec4<u32>(NONE, nested, 0u);
#endif
#else
#if DISPERSION
    states[STATE_WORDS * path + 2u] = vec4<u32>(live, 0u, 0u, 0u);
#endif
#endif
    let next = atomicAdd(&queue_lengths[step.bounce], 1u);
    queue[((step.bounce + 1u) & 1u) * wave.path_count + next] = path;
}
