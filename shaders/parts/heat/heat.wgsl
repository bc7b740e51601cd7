// What surfaces send out whose emission depends on the angle, or differs from place to place.

// Random numbers beside those of the bounce.
const SALT_ANGLE: u32 = 0x85ebca6bu;
const SALT_MET: u32 = 0xc2b2ae35u;
const SALT_AIMED: u32 = 0x27d4eb2fu;

#if HOT_RANDOM
fn hot_numbers(path: u32, salt: u32) -> vec2<f32> {
    let from_path = draw_of(path);
    return draw(Draw(from_path.key ^ salt, from_path.index), DIMENSION_BOUNCE + step.bounce * DIMENSIONS_PER_VERTEX);
}
#endif

#if HOT_VERTICES
// A point on an emitter, as `towards`, a unit vector from there, sees it.
fn emitting_vertex(emitter: Emitter, point: LightPoint, towards: vec3<f32>) -> Vertex {
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
    return vertex_at(hit, Surface(point.position, point.normal, 0u, NONE), dot(point.normal, towards) > 0.0, towards);
}
#endif
