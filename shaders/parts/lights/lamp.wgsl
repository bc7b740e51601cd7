// Lights without a surface: points, directional lights and suns. They stand among the emitters, after all surfaces, the suns
// last.

// Two vectors each, `device::words::Lamp`: place, kind; sine squared and versine (1 - cos) of a sun's angular radius. The place is
// a point's position in device units, else the unit vector towards the light.
@group(0) @binding(40) var<storage, read> lamps: array<vec4<u32>>;

#constants LAMPS EMITTER_IS_LAMP

// A way to a lamp as seen from a reference point.
struct LampAim {
    // To the point itself, or in its direction.
    towards: vec3<f32>,
    // Of the choice, over solid angle where it is met too; else a probability.
    density: f32,
    // What multiplies the spectrum.
    strength: f32,
    kind: u32,
}

fn aim_at_lamp(emitter: Emitter, origin: vec3<f32>, u: vec2<f32>) -> LampAim {
    let lamp = lamps[2u * emitter.primitive];
    let place = bitcast<vec3<f32>>(lamp.xyz);
    if (lamp.w == LAMP_POINT) {
        let towards = place - origin;
        let distance2 = dot(towards, towards);
        return LampAim(towards, select(0.0, emitter.pick, distance2 > 0.0), emitter.area / max(distance2, 1.0e-30), LAMP_POINT);
    }
#if SPOTS
    if (lamp.w == LAMP_SPOT) {
        let towards = place - origin;
        let distance2 = dot(towards, towards);
        let share = spot_share(2u * emitter.primitive, towards);
        let density = select(0.0, emitter.pick, distance2 > 0.0 && share > 0.0);
        return LampAim(towards, density, emitter.area * share / max(distance2, 1.0e-30), LAMP_POINT);
    }
#endif
    if (lamp.w == LAMP_DIRECTIONAL) {
        return LampAim(place, emitter.pick, emitter.area, LAMP_DIRECTIONAL);
    }
#if SUNS
    // Uniform over the disk.
    let versine = bitcast<f32>(lamps[2u * emitter.primitive + 1u].y);
    let rim = concentric_disk(u);
    let r2 = dot(rim, rim);
    let sine = sqrt(max(0.0, r2 * versine * (2.0 - r2 * versine)));
    let around = tangents(place);
    let side = select(rim / sqrt(r2), vec2<f32>(1.0, 0.0), r2 == 0.0);
    let d = normalize(sine * (side.x * around.s + side.y * around.t) + (1.0 - r2 * versine) * place);
    return LampAim(d, emitter.pick / (2.0 * PI * versine), emitter.area, LAMP_SUN);
#else
    return LampAim(place, 0.0, 0.0, LAMP_SUN);
#endif
}
