// An environment map on the way of paths: the instruction that looks it up, arriving at it, and aiming at it.

// X = its value at a place over the source spectrum.
fn append_map(list: ptr<function, RecordList>, mode: u32, place: MapPlace, weight: f32) {
    let fraction = vec2<u32>(place.fraction * 65535.0 + 0.5);
    append_words(list, vec4<u32>(OP_MAP | mode, place.column | (place.row << 16u), bitcast<u32>(weight), fraction.x | (fraction.y << 16u)));
}

fn arrive_from_map(list: ptr<function, RecordList>, path: Path) {
    let found = find_in_map(path.ray.direction);
    let begin = (*list).count;
    append_map(list, MODE_SINGLE, found.place, path.scale * select(power_heuristic(path.density, frame.environment_pick * found.density), 1.0, path.density < 0.0));
    gather(list, begin, MAP_SOURCE);
}

// Whether the map is what is aimed at; then also how.
fn aim_at_map(aim: ptr<function, Aim>, choice: f32, u: vec2<f32>) -> bool {
    if (choice >= frame.environment_pick) {
        return false;
    }
    let sampled = sample_map(u);
    (*aim).towards = sampled.direction;
    (*aim).density = frame.environment_pick * sampled.density;
    (*aim).from_map = true;
    (*aim).map_place = sampled.place;
    (*aim).source = MAP_SOURCE;
    (*aim).limit = INFINITE;
    return true;
}
