// What a ray has met.

fn surface_at(ray: Ray, hit: Hit) -> Surface {
#if INSTANCES
    let p = primitive_met(hit);
#else
    let p = load_primitive(hit.primitive);
#endif
    let material = p.tag & 0x00ffffffu;
#if SHAPES
    if ((p.tag >> 24u) != 0u) {
        let s = shape_surface(p, ray.origin + hit.distance * ray.direction);
        return Surface(s[0], s[1], material, p.emitter);
    }
#endif
    // From the vertices: more exact than along the ray.
    let position = (1.0 - hit.u - hit.v) * p.a + hit.u * p.b + hit.v * p.c;
    let normal = triangle_normal(p);
    return Surface(off_edges(position, normal, p), normal, material, p.emitter);
}
