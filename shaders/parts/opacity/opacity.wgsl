// Surfaces that let some rays pass as if they were not there.

#constants MASKS

// Random numbers of the way under way: of its first two surfaces, and what those of others are made of. They depend on the path, the
// bounce and how many surfaces it has come to, not on how those are found.
var<private> way_first: vec2<f32>;
var<private> way_seed: u32;
var<private> way_surfaces: u32;

fn next_chance() -> f32 {
    let n = way_surfaces;
    way_surfaces += 1u;
    let later = f32(hash(way_seed ^ (n * 0x9e3779b9u)) >> 8u) * 5.9604645e-8;
    return select(select(later, way_first.y, n == 1u), way_first.x, n == 0u);
}

// Of a material that is masked.
fn masked_opacity(flags: u32, hit: Hit, surface: Surface) -> f32 {
    let place = flags >> MASK_SHIFT;
#if MASKS
    if ((flags & MATERIAL_MASK_IS_TEXTURE) != 0u) {
        var uv = vec2<f32>(0.0);
#if ATTRIBUTES
        uv = carried_at(hit, surface).uv;
#endif
        let around = texels_around(place, uv);
        let at = textures[TEXTURE_WORDS * place] + around.texel;
        let values = vec4<f32>(texels[at.x], texels[at.y], texels[at.z], texels[at.w]);
        // Weights sum to 1 but for rounding, which must not make a hole.
        let least = min(min(values.x, values.y), min(values.z, values.w));
        let most = max(max(values.x, values.y), max(values.z, values.w));
        return clamp(dot(around.weight, values), least, most);
    }
#endif
    return tables[place];
}

// Whether the ray goes on through what it met.
fn lets_pass(ray: Ray, hit: Hit) -> bool {
    let flags = surface_materials[load_primitive_part(hit.primitive, 0u).w & 0x00ffffffu].flags;
    if ((flags & MATERIAL_MASKED) == 0u) {
        return false;
    }
    return next_chance() >= masked_opacity(flags, hit, surface_at(ray, hit));
}
