// The share of rays that a point on an emitter is there for.
fn opacity_aimed_at(emitter: Emitter, point: LightPoint) -> f32 {
    let material = load_primitive_part(emitter.primitive, 0u).w & 0x00ffffffu;
    let flags = surface_materials[material].flags;
    if ((flags & MATERIAL_MASKED) == 0u) {
        return 1.0;
    }
    let hit = hit_on_emitter(emitter, point);
    return masked_opacity(flags, hit, Surface(point.position, point.normal, material, NONE));
}
