// The share of rays that a point on an emitter is there for.
fn opacity_aimed_at(emitter: Emitter, point: LightPoint) -> f32 {
#if PLACED_LIGHTS
    let p = emitter_primitive(emitter);
#else
    let p = load_primitive(emitter.primitive);
#endif
    let material = p.tag & 0x00ffffffu;
    let flags = surface_materials[material].flags;
    if ((flags & MATERIAL_MASKED) == 0u) {
        return 1.0;
    }
    let n = cross(p.b - p.a, p.c - p.a);
    let at = point.position - p.a;
    // Weights of a triangle's second and third vertex; round shapes have no use for them.
    let weights = vec2<f32>(dot(cross(at, p.c - p.a), n), dot(cross(p.b - p.a, at), n)) / max(dot(n, n), 1.0e-37);
    var hit: Hit;
    hit.primitive = emitter.primitive;
    hit.u = weights.x;
    hit.v = weights.y;
#if PLACED_LIGHTS
    hit.instance = light_in;
#else
#if INSTANCES
    hit.instance = NONE;
#endif
#endif
    return masked_opacity(flags, hit, Surface(point.position, point.normal, material, NONE));
}
