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
    let hit = hit_on_emitter(emitter, point);
    return vertex_at(hit, Surface(point.position, point.normal, 0u, NONE), dot(point.normal, towards) > 0.0, towards);
}
#endif
