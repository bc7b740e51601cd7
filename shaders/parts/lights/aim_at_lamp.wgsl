// Lights without a surface on the way of paths.

// Whether `emitter` is one; then also how it is aimed at.
fn aims_at_lamp(aim: ptr<function, Aim>, emitter: Emitter, seen_from: vec3<f32>, u: vec2<f32>) -> bool {
    if ((emitter.spectrum & EMITTER_IS_LAMP) == 0u) {
        return false;
    }
    let lamp = aim_at_lamp(emitter, seen_from, u);
    (*aim).towards = lamp.towards;
    (*aim).density = lamp.density;
    (*aim).strength = lamp.strength;
    (*aim).is_met = lamp.kind == LAMP_SUN;
    (*aim).end = seen_from + lamp.towards;
    (*aim).limit = select(INFINITE, 1.0, lamp.kind == LAMP_POINT);
    return true;
}
