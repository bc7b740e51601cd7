// How far a path goes before matter scatters it: the optical depth of its technique along the way to what it met is inverted, exactly,
// since voxels are constant. What it met, and all that shines on the way, has been added by then, whatever comes of it.

const SALT_FLIGHT: u32 = 0xcc9e2d51u;

// Of a flight: optical depths of all techniques, and what they and the channel that absorbs least lose to absorption.
struct Depths {
    flight: array<f32, TECHNIQUES>,
    lost: array<f32, TECHNIQUES>,
    least: f32,
}

// Adds an amount: of number `term` of a volume.
fn add_depths(depths: ptr<function, Depths>, first: u32, term: u32, amount: f32) {
    let at = volumes[first + 22u] + STEP_WORDS * term;
    for (var t = 0u; t < TECHNIQUES; t += 1u) {
        (*depths).flight[t] += amount * bitcast<f32>(volumes[at + t]);
        (*depths).lost[t] += amount * bitcast<f32>(volumes[at + TECHNIQUES + t]);
    }
    (*depths).least += amount * bitcast<f32>(volumes[at + 2u * TECHNIQUES]);
}

// What technique `t` makes of one metre, of a volume that is the same everywhere.
fn rate_of_metre(first: u32, t: u32) -> f32 {
    return bitcast<f32>(volumes[volumes[first + 22u] + t]);
}

#if GRIDS
fn rate_of_amounts(first: u32, t: u32, amounts: ptr<function, array<f32, MOST_TERMS>>) -> f32 {
    let at = volumes[first + 22u] + t;
    var sum = 0.0;
    for (var term = 0u; term < volumes[first + 23u]; term += 1u) {
        sum += (*amounts)[term] * bitcast<f32>(volumes[at + STEP_WORDS * term]);
    }
    return sum;
}
#endif

#if FORCED
// 1 - exp(-x), without cancellation.
fn chance_within(x: f32) -> f32 {
    let small = x * (1.0 - x * (0.5 - x * (0.16666667 - x * 0.041666667)));
    return select(1.0 - exp(-x), small, x < 0.06);
}

// -log(1 - x), without cancellation.
fn depth_of_chance(x: f32) -> f32 {
    let small = x * (1.0 + x * (0.5 + x * (0.33333333 + x * 0.25)));
    return select(-log(1.0 - x), small, x < 0.03);
}

// Optical depths of all techniques on the way to what was met.
fn depths_of_way(ray: Ray) -> array<f32, TECHNIQUES> {
    let speed = length(ray.direction) * bitcast<f32>(volumes[0]);
    var depths = Depths();
    for (var n = 0u; n < followed.count; n += 1u) {
        let first = volume_at(followed.volume[n]);
        let start = followed.start[n];
        let to = min(followed.to[n], start + 8.0 / length(ray.direction));
        let metres = (to - start) * speed;
#if GRIDS
        if ((volumes[first] & VOLUME_GRID) != 0u) {
            let from_voxels = to_voxels(first, ray.origin + start * ray.direction);
            let end_voxels = to_voxels(first, ray.origin + to * ray.direction);
            let amounts = amounts_along(first, from_voxels, end_voxels, metres);
            for (var term = 0u; term < volumes[first + 23u]; term += 1u) {
                add_depths(&depths, first, term, amounts[term]);
            }
            continue;
        }
#endif
        add_depths(&depths, first, 0u, metres);
    }
    return depths.flight;
}
#endif

// Whether matter scatters the path on the way; then `collision` and `position` say where, and the records since `begins` are those of the way to
// there. Else the path comes to what it met. Either way its weight is by the densities of all techniques.
fn is_scattered(path: ptr<function, Path>, list: ptr<function, RecordList>, begins: RecordList, position: ptr<function, vec3<f32>>, survival: ptr<function, f32>) -> bool {
    if (step.bounce >= frame.max_bounces || !way_scatters()) {
        return false;
    }
    let ray = (*path).ray;
#if RATIOS
    let own = technique;
#else
    let own = 0u;
#endif
    let from_path = draw_of((*path).number);
    let u = draw(Draw(from_path.key ^ SALT_FLIGHT, from_path.index), DIMENSION_BOUNCE + step.bounce * DIMENSIONS_PER_VERTEX).x;
#if FORCED
    // What comes straight from the camera and meets nothing goes on nowhere else: all of these paths are scattered, with the weight of
    // the chance of it.
    let is_forced = step.bounce == 0u && way_is_open;
    var whole_depths = array<f32, TECHNIQUES>();
    var wanted = -log(1.0 - u);
    if (is_forced) {
        whole_depths = depths_of_way(ray);
        wanted = depth_of_chance(u * chance_within(whole_depths[own]));
    }
#else
    let wanted = -log(1.0 - u);
#endif
    // Only where something was added on the way must its throughput be put aside.
    let whole = *list;
    let added = (*list).used > begins.used;
    if (added) {
        append(list, OP_RESTORE, 0u, 0.0, 0.0);
    } else {
        (*list).count = begins.count;
    }
    let speed = length(ray.direction) * bitcast<f32>(volumes[0]);
    // Rounding must not put a place beyond the end of its stretch.
    let reach = abs(ray.origin) / length(ray.direction);
    let slack = 2.4e-7 * max(reach.x, max(reach.y, reach.z));
    var depths = Depths();
    var depth = 0.0;
    var is_hit = false;
    var rate_there = array<f32, TECHNIQUES>();
    for (var n = 0u; n < followed.count && !is_hit; n += 1u) {
        let first = volume_at(followed.volume[n]);
        let start = followed.start[n];
        let to = min(followed.to[n], start + 8.0 / length(ray.direction));
        let metres = (to - start) * speed;
        // Of the stretch, up to where the path is scattered.
        var share = 1.0;
        collision.first = first;
        collision.voxel = 0u;
        let scatters = (volumes[first] & VOLUME_SCATTERS) != 0u;
#if GRIDS
        if ((volumes[first] & VOLUME_GRID) != 0u) {
            let from_voxels = to_voxels(first, ray.origin + start * ray.direction);
            let end_voxels = to_voxels(first, ray.origin + to * ray.direction);
            var amounts = array<f32, MOST_TERMS>();
            let size = volume_size(first);
            var cells = cells_along(from_voxels, end_voxels, size);
            var done = 0.0;
            for (var c = 0u; c < most_cells(size); c += 1u) {
                let end = cell_end(cells);
                if (end > done) {
                    let voxel = voxel_of(cells);
                    var here = array<f32, MOST_TERMS>();
                    add_amounts(first, voxel, metres * (end - done), &here);
                    let step_depth = rate_of_amounts(first, own, &here);
                    var part = 1.0;
                    if (scatters && depth + step_depth > wanted) {
                        part = clamp((wanted - depth) / step_depth, 0.0, 1.0);
                        is_hit = true;
                        collision.voxel = voxel;
                        share = done + part * (end - done);
                        for (var t = 0u; t < TECHNIQUES; t += 1u) {
                            rate_there[t] = rate_of_amounts(first, t, &here) / (metres * (end - done));
                        }
                    }
                    for (var term = 0u; term < volumes[first + 23u]; term += 1u) {
                        amounts[term] += part * here[term];
                    }
                    if (is_hit) {
                        break;
                    }
                    depth += step_depth;
                    done = end;
                }
                if (!next_cell(&cells, end)) {
                    break;
                }
            }
            for (var term = 0u; term < volumes[first + 23u]; term += 1u) {
                add_depths(&depths, first, term, amounts[term]);
            }
            append_amounts(list, first, &amounts, 0u);
        } else {
#endif
            let step_depth = metres * rate_of_metre(first, own);
            if (scatters && depth + step_depth > wanted) {
                share = clamp((wanted - depth) / step_depth, 0.0, 1.0);
                is_hit = true;
                for (var t = 0u; t < TECHNIQUES; t += 1u) {
                    rate_there[t] = rate_of_metre(first, t);
                }
            } else {
                depth += step_depth;
            }
            add_depths(&depths, first, 0u, share * metres);
            append(list, OP_MEDIUM, volumes[first + 1u], 0.0, share * metres);
#if GRIDS
        }
#endif
        if (is_hit) {
            let room = min(slack + 2.4e-7 * to, 0.5 * (to - start));
            let at = clamp(start + share * (to - start), start + room, to - room);
            *position = ray.origin + at * ray.direction;
            (*path).nested = followed.around[n];
        }
    }
    let own_depth = depths.flight[own];
#if RATIOS
    let before = sum_of_ratios();
    let own_rate = select(1.0, rate_there[own], is_hit);
    for (var t = 0u; t < TECHNIQUES; t += 1u) {
        let rate = select(1.0, rate_there[t] / own_rate, is_hit);
#if FORCED
        if (is_forced) {
            ratios[t] *= chance_within(whole_depths[own]) / max(chance_within(whole_depths[t]), 1.0e-37);
        }
#endif
        ratios[t] = min(ratios[t] * rate * exp(own_depth - depths.flight[t]), 1.0e30);
    }
    (*path).scale *= before / sum_of_ratios();
#endif
    if (!is_hit) {
        // The chance of having come here.
        (*path).scale *= exp(own_depth);
        if (added) {
            *list = whole;
        }
        return false;
    }
    collision.direction = normalize(ray.direction);
    collision.technique = own;
    collision.weight = exp(own_depth) / rate_there[own];
#if FORCED
    if (is_forced) {
        collision.weight *= chance_within(whole_depths[own]);
    }
#endif
    // The most that any technique, or the channel that absorbs least, keeps.
    var least_lost = depths.least;
    for (var t = 0u; t < TECHNIQUES; t += 1u) {
        least_lost = min(least_lost, depths.lost[t]);
    }
    var kept = exp(-least_lost);
    if ((volumes[collision.first] & VOLUME_BY_EXTINCTION) != 0u) {
        var most = 0.0;
        for (var t = 0u; t < TECHNIQUES; t += 1u) {
            most = max(most, scattered_there(collision.first, collision.voxel, t).x / max(rate_there[t], 1.0e-37));
        }
        kept *= min(most, 1.0);
    }
    *survival = clamp(kept, 0.05, 1.0);
    return true;
}
