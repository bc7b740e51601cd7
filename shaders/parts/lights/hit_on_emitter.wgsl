// A point on an emitter that is aimed at, as if a ray had met it there.
fn hit_on_emitter(emitter: Emitter, point: LightPoint) -> Hit {
#if PLACED_LIGHTS
    let p = emitter_primitive(emitter);
#else
    let p = load_primitive(emitter.primitive);
#endif
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
    return hit;
}
