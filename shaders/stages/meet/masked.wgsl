// Meeting the next surface, and light, past surfaces that let rays pass, where nothing lies between surfaces.

// Surfaces that one ray may pass.
const MOST_PASSED: u32 = 1024u;

// What a ray meets in the end, by which part of it, and how far along the ray that part starts, in units of its direction.
struct Followed {
    hit: Hit,
    ray: Ray,
    passed: f32,
}

fn follow(ray: Ray, limit: f32, overflow: ptr<function, bool>) -> Followed {
    var way: Followed;
    way.hit.distance = limit;
    way.hit.primitive = NONE;
    way.ray = ray;
    for (var n = 0u; n < MOST_PASSED; n += 1u) {
        let left = select(limit - way.passed, INFINITE, limit == INFINITE);
        way.hit = traverse(way.ray, left, false, overflow);
        if (way.hit.primitive == NONE || *overflow || !lets_pass(way.ray, way.hit)) {
            return way;
        }
        // On the same line, where that is as far beyond the surface as paths start off it: a parallel one would miss what is aimed
        // at, or meet it too early. Along a surface not for ever.
        let surface = surface_at(way.ray, way.hit);
        let beyond = select(-surface.normal, surface.normal, dot(surface.normal, ray.direction) > 0.0);
        let depth = dot(offset_origin(surface.position, beyond) - way.ray.origin, beyond);
        let speed = max(dot(ray.direction, beyond), 1.0e-3 * length(ray.direction));
        way.passed += max(depth / speed, way.hit.distance);
        way.ray.origin = ray.origin + way.passed * ray.direction;
    }
    *overflow = true;
    return way;
}

fn meet(path: ptr<function, Path>, list: ptr<function, RecordList>, overflow: ptr<function, bool>) -> Meeting {
    begin_way((*path).number, SALT_FOLLOWED);
    let way = follow((*path).ray, INFINITE, overflow);
    return Meeting(way.hit, way.ray, way.passed + way.hit.distance);
}

// Nothing is noted of the way to a light.
struct LightWay {
    unused: u32,
}

// Whether a light is seen.
fn reaches(aim: Aim, nested: vec2<u32>, site: Site, way: ptr<function, LightWay>, overflow: ptr<function, bool>) -> bool {
    return follow(aim.shadow, aim.limit, overflow).hit.primitive == NONE;
}
