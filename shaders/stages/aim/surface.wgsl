// Aiming at an emitting surface.

fn aim_at_surface(aim: ptr<function, Aim>, path: u32, emitter: Emitter, seen_from: vec3<f32>, u: vec2<f32>) {
    let point = sample_emitter(emitter, seen_from, u);
    let towards = point.position - seen_from;
    (*aim).towards = towards;
    (*aim).density = point.density;
    (*aim).end = offset_origin(point.position, select(point.normal, -point.normal, dot(point.normal, towards) > 0.0));
#lines AIMED_AT_SURFACE
}
