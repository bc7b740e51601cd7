// What a surface emits where a path meets it, against aiming at it (MIS).

fn emit(list: ptr<function, RecordList>, path: Path, meeting: Meeting, site: Site, v: Vertex) {
    if (site.surface.emitter == NONE) {
        return;
    }
#if PLACED_LIGHTS
    let emitter = emitter_met(site.surface.emitter, meeting.hit.instance);
#else
    let emitter = emitters[site.surface.emitter];
#endif
    if (!site.from_front && (emitter.spectrum & EMITS_BOTH_SIDES) == 0u) {
        return;
    }
    var weight = path.scale;
    if (path.density >= 0.0) {
#if PLACED_LIGHTS
        let chance = light_density(emitter, path.ray.origin, path.ray.direction, meeting.distance, site.surface.normal);
#else
        let chance = light_density(site.surface.emitter, path.ray.origin, path.ray.direction, meeting.distance, site.surface.normal);
#endif
        weight *= power_heuristic(path.density, chance);
    }
    let begin = (*list).count;
#lines EMITTED
    append(list, OP_ONE | MODE_SINGLE, 0u, weight, 0.0);
    gather(list, begin, emitter.spectrum & SPECTRUM_MASK);
}
