// Suns, which rays that leave the scene may meet.

// The density over solid angle with which a sun is aimed at in `direction`; negative outside its disk.
fn sun_density(emitter: Emitter, direction: vec3<f32>) -> f32 {
    let lamp = lamps[2u * emitter.primitive];
    let size = bitcast<vec2<f32>>(lamps[2u * emitter.primitive + 1u].xy);
    let axis = bitcast<vec3<f32>>(lamp.xyz);
    let off = cross(direction, axis);
    if (dot(direction, axis) <= 0.0 || dot(off, off) > size.x) {
        return -1.0;
    }
    return emitter.pick / (2.0 * PI * size.y);
}
