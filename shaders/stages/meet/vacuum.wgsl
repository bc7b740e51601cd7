// Meeting the next surface, and light, where nothing lies between surfaces.

fn meet(path: ptr<function, Path>, list: ptr<function, RecordList>, overflow: ptr<function, bool>) -> Meeting {
    let hit = traverse((*path).ray, INFINITE, false, overflow);
    return Meeting(hit, (*path).ray, hit.distance);
}

// Nothing is noted of the way to a light.
struct LightWay {
    unused: u32,
}

// Whether a light is seen.
fn reaches(aim: Aim, nested: vec2<u32>, site: Site, way: ptr<function, LightWay>, overflow: ptr<function, bool>) -> bool {
    return traverse(aim.shadow, aim.limit, true, overflow).primitive == NONE;
}
