// Lenses, windows and tracks of line scanners that boundaries of media cut.

// The volumes around `start`, where a camera ray begins: those of a place in the same lens or window, or on the same track, but for what the straight way
// from there enters and leaves.
fn volumes_at(start: vec3<f32>, overflow: ptr<function, bool>) -> vec2<u32> {
    var around = vec2<u32>(volumes[1], volumes[2]);
    let place = volume_vector(volumes[3]);
    var ray = Ray(place, start - place);
    let length2 = max(dot(ray.direction, ray.direction), 1.0e-37);
    for (var n = 0u; n < MOST_CROSSINGS; n += 1u) {
        let hit = traverse(ray, dot(start - ray.origin, ray.direction) / length2, false, overflow);
        if (hit.primitive == NONE || *overflow) {
            return around;
        }
        let surface = surface_at(ray, hit);
        let entering = dot(surface.normal, ray.direction) < 0.0;
        let number = volume_met(hit);
        if (number != 0u && !cross_boundary(&around, number, entering)) {
            *overflow = true;
        }
        ray.origin = offset_origin(surface.position, select(surface.normal, -surface.normal, entering));
    }
    *overflow = true;
    return around;
}
