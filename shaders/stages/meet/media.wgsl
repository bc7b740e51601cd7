// Meeting the next surface, and light, through media: every way is noted as records.

#if SCATTERS
// The way to what was met last, on which the path may be scattered.
var<private> followed: Way;

fn way_scatters() -> bool {
    for (var n = 0u; n < followed.count; n += 1u) {
        if ((volumes[volume_at(followed.volume[n])] & VOLUME_SCATTERS) != 0u) {
            return true;
        }
    }
    return false;
}

#if FORCED
// Whether that way leads out of the scene.
var<private> way_is_open: bool;
#endif
#endif

fn meet(path: ptr<function, Path>, list: ptr<function, RecordList>, overflow: ptr<function, bool>) -> Meeting {
    let ray = (*path).ray;
    var nested = (*path).nested;
    if (step.bounce == 0u) {
        nested = vec2<u32>(volumes[1], volumes[2]);
#lines CAMERA_STARTS
    }
    var way: Way;
#if OPACITY
    begin_way((*path).number, SALT_FOLLOWED);
#endif
    let walked = walk(ray, INFINITE, &nested, &way, overflow);
    (*path).nested = nested;
#if SCATTERS
    followed = way;
#if FORCED
    way_is_open = walked.hit.primitive == NONE;
#endif
    if (step.bounce < frame.max_bounces && way_scatters()) {
        append(list, OP_SAVE, 0u, 0.0, 0.0);
    }
#endif
    append_way(list, &way, ray, walked.hit.primitive == NONE, 0u, (*path).scale);
    return Meeting(walked.hit, walked.ray, walked.passed + walked.hit.distance);
}

struct LightWay {
    way: Way,
}

// The number of the volume behind a surface + 1, or 0.
fn volume_behind(site: Site) -> u32 {
#if SCATTERS
    if (site.in_matter) {
        return 0u;
    }
#endif
    return volume_met(site.hit);
}

// Whether a light is seen through media; notes them.
fn reaches(aim: Aim, nested: vec2<u32>, site: Site, through: ptr<function, LightWay>, overflow: ptr<function, bool>) -> bool {
    var way: Way;
    way.count = 0u;
    var around = nested;
    let inner = volume_behind(site);
    if (aim.direction.z < 0.0 && inner != 0u && !cross_boundary(&around, inner, site.from_front)) {
        *overflow = true;
    }
    let is_seen = walk(aim.shadow, aim.limit, &around, &way, overflow).hit.primitive == NONE;
    (*through).way = way;
    return is_seen;
}

fn light_is_dimmed(through: ptr<function, LightWay>) -> bool {
    return (*through).way.count > 0u;
}

fn append_light_way(list: ptr<function, RecordList>, through: ptr<function, LightWay>, aim: Aim) {
    var way = (*through).way;
    append_way(list, &way, aim.shadow, aim.limit == INFINITE, MODE_ON_F, 1.0);
}

// Enters or leaves the body behind a surface, where the path goes on through it.
fn pass_surface(path: ptr<function, Path>, site: Site, direction: vec3<f32>, overflow: ptr<function, bool>) {
    let behind = volume_behind(site);
    var nested = (*path).nested;
    if (direction.z < 0.0 && behind != 0u && !cross_boundary(&nested, behind, site.from_front)) {
        *overflow = true;
    }
    (*path).nested = nested;
}
