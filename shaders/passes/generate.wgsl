// Generate in general scenes, one bounce of every path, in stages: the next vertex is met, what it emits, a light is aimed at, light
// is scattered to and from both directions, and the path goes on. Records are a small program (common/record.wgsl).
// No wavelength takes part in any decision but that of the one channel which dispersion left.
//
// What a scene's parts add to a stage is called in the places of `#lines`.

fn end_path(list: RecordList, rays: u32, overflow: bool) {
    if (overflow) {
        atomicAdd(&counters[COUNTER_OVERFLOW], 1u);
    }
    if (atomicAdd(&counters[COUNTER_RAYS], rays) > 0xffffffffu - rays) {
        atomicAdd(&counters[COUNTER_RAYS_HIGH], 1u);
    }
    note_records(list);
    heads[list.path].y = records_to_read(list) | (wave.sequence << 16u);
}

// Where more were taken than there is room for, evaluation must not read on into those of other paths.
fn records_to_read(list: RecordList) -> u32 {
    return min(list.used, frame.max_records);
}

// The most records that any path took, which the host compares with what there is room for.
fn note_records(list: RecordList) {
    if (list.count > atomicLoad(&counters[COUNTER_RECORDS])) {
        atomicMax(&counters[COUNTER_RECORDS], list.count);
    }
}

// Whether what arrives from a light takes instructions of its own; and those instructions, on F.
fn light_takes_records(aim: Aim, way: ptr<function, LightWay>) -> bool {
#lines LIGHT_TAKES_RECORDS
    return false;
}

fn append_light(list: ptr<function, RecordList>, path: u32, aim: Aim, way: ptr<function, LightWay>) {
#lines LIGHT_RECORDS
}

// Both directions in turn: the light's, if it is seen, adds its radiance; `choice` goes on, unless it is the only one of its lobe.
fn scatter(list: ptr<function, RecordList>, path: Path, site: Site, v: Vertex, aim: Aim, choice: ptr<function, DirectionChoice>, overflow: ptr<function, bool>) {
    let material = site.material;
    let ab = lobes[(*choice).lobe].ab;
    var way: LightWay;
    var advanced = false;
    for (var turn = select(1u, 0u, aim.density > 0.0); turn < 2u; turn += 1u) {
        let to_light = turn == 0u;
        if (!to_light && (!(*choice).goes_on || (*choice).density < 0.0)) {
            break;
        }
        let direction = select((*choice).direction, aim.direction, to_light);
#if SCATTERS
        // Of its own turn in matter it is known since that was chosen.
        var chance = (*choice).density;
        if (!site.in_matter) {
            chance = bsdf_density(material, v, direction);
#lines SURFACE_DENSITY
        } else if (to_light) {
            chance = matter_density(direction);
        }
#else
        let chance = bsdf_density(material, v, direction);
#lines SURFACE_DENSITY
#endif
        var weight = 1.0 / chance;
        if (to_light) {
#lines LIGHT_WEIGHT
            if (!reaches(aim, path.nested, site, &way, overflow)) {
                continue;
            }
        } else {
            (*choice).density = chance;
            if (!(chance > 0.0)) {
                (*choice).goes_on = false;
                break;
            }
        }
        let begin = (*list).count;
        if ((material.flags & MATERIAL_DIFFUSE) != 0u) {
            // One record for both: next-event estimation adds its radiance behind the surface's reflectance.
            let reflected = weight * max(direction.z, 0.0) * INV_PI;
            if (to_light && light_takes_records(aim, &way)) {
                append(list, OP_SPECTRUM | MODE_SINGLE, ab, reflected, 0.0);
                append_light(list, path.number, aim, &way);
                gather(list, begin, aim.source);
            } else if (to_light) {
                append(list, OP_PLAIN | (aim.source << 16u), ab, reflected, 0.0);
                (*list).used = (*list).count;
                advanced = true;
            } else if (!advanced) {
                append(list, OP_PLAIN, ab, 0.0, 0.0);
            }
            continue;
        }
#if SCATTERS
        if (site.in_matter) {
            append_turn(list, direction, weight);
        } else {
#endif
        for (var p = material.first_lobe; p < material.first_lobe + material.lobe_count; p += 1u) {
            if (lobe_pick(p, v) > 0.0) {
                append_lobe(list, lobe_at(p, v), v, direction, weight);
            }
        }
#if SCATTERS
        }
#endif
        if (to_light) {
            if ((*list).count > begin) {
                append_light(list, path.number, aim, &way);
            }
            gather(list, begin, aim.source);
        } else if ((*list).count > begin) {
            advance(list);
        } else {
            (*choice).goes_on = false;
        }
    }
}

@compute @workgroup_size(64)
fn generate(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let place = id.x + id.y * groups.x * 64u;
    var number = place;
    if (step.bounce == 0u) {
        if (place >= wave.path_count) {
            return;
        }
    } else {
        if (place >= atomicLoad(&queue_lengths[step.bounce - 1u])) {
            return;
        }
        number = queue[(step.bounce & 1u) * wave.path_count + place];
    }
    let second = states[STATE_WORDS * number + 1u];
    if (second.w == ENDED) {
        return;
    }
    var path = load_path(number, second);
#if BOUNCE_BY_BOUNCE
    // Evaluated before the next bounce.
    var list = RecordList(number, 0u, 0u, 0u);
#else
    var list = RecordList(number, second.w & 0xffffu, second.w >> 16u, 0u);
#endif
    var overflow = false;

    // The next vertex, or what comes from beyond the scene.
#if SCATTERS
    let way_begins = list;
#endif
#lines BEGIN
    let meeting = meet(&path, &list, &overflow);
    var site: Site;
    var v: Vertex;
    if (meeting.hit.primitive == NONE) {
#lines BEYOND
#if SCATTERS
    } else {
#else
        end_path(list, 2u * step.bounce + 1u, overflow);
        return;
    }
#endif
    site.surface = surface_at(meeting.ray, meeting.hit);
    site.hit = meeting.hit;
    site.material = surface_materials[site.surface.material];
    site.from_front = dot(site.surface.normal, path.ray.direction) < 0.0;
    site.face = select(-site.surface.normal, site.surface.normal, site.from_front);
    v = vertex_at(meeting.hit, site.surface, site.from_front, -path.ray.direction);
#lines VERTEX

    // What it emits.
#lines EMIT
#if SCATTERS
    }
    // Or matter scatters the path before.
    var position: vec3<f32>;
    var survival: f32;
    if (!overflow && is_scattered(&path, &list, way_begins, &position, &survival)) {
        site = site_in_matter(position, survival);
        v = vertex_in_matter();
    } else if (meeting.hit.primitive == NONE) {
        end_path(list, 2u * step.bounce + 1u, overflow);
        return;
    }
#endif
    if (step.bounce == frame.max_bounces || site.material.lobe_count == 0u || !(v.o.z > 0.0) || overflow) {
        end_path(list, 2u * step.bounce + 1u, overflow);
        return;
    }

    // The next direction, and a light.
    let from_path = draw_of(number);
    let dimension = DIMENSION_BOUNCE + step.bounce * DIMENSIONS_PER_VERTEX;
    let u_bsdf = draw(from_path, dimension + DIMENSION_BSDF);
    let u_choice = draw(from_path, dimension + DIMENSION_CHOICE);
    let u_lobe = draw(from_path, dimension + DIMENSION_LOBE);
#if SCATTERS
    var choice: DirectionChoice;
    if (site.in_matter) {
        choice = choose_turn(u_bsdf, u_lobe.x);
    } else {
        choice = choose_direction(site.material, &v, u_bsdf, u_lobe, heads[number].x, path.live);
    }
#else
    var choice = choose_direction(site.material, &v, u_bsdf, u_lobe, heads[number].x, path.live);
#endif
    if (choice.lobe == NONE) {
        end_path(list, 2u * step.bounce + 1u, overflow);
        return;
    }
#lines CHOSEN
    var aim: Aim;
#lines AIM
    scatter(&list, path, site, v, aim, &choice, &overflow);
    if (choice.goes_on && choice.density < 0.0) {
        append(&list, choice.only | MODE_ADVANCE, lobes[choice.lobe].ab, choice.only_weight, choice.only_parameter);
#lines ONLY_DIRECTION
    }

    // Whether it goes on, and from where.
#lines GO_ON
    if (!choice.goes_on) {
        end_path(list, 2u * step.bounce + 2u, overflow);
        return;
    }
    path.density = choice.density;
    path.ray.direction = to_world(v, choice.direction);
    path.ray.origin = offset_origin(site.surface.position, select(-site.face, site.face, choice.direction.z > 0.0));
#if SCATTERS
    if (site.in_matter) {
        path.ray.origin = site.surface.position;
    }
#endif
#lines PASSED
    if (overflow) {
        atomicAdd(&counters[COUNTER_OVERFLOW], 1u);
    }
#if BOUNCE_BY_BOUNCE
    note_records(list);
    heads[number].y = list.count;
#else
    heads[number].y = records_to_read(list);
#endif
    save_path(path, list.count | (list.used << 16u));
    let next = atomicAdd(&queue_lengths[step.bounce], 1u);
    queue[((step.bounce + 1u) & 1u) * wave.path_count + next] = number;
}
