// Roughness that a texture says (`device::parts::roughness`).

#constants VARIES

// Lobe `base` at the roughness that its texture has here. Facets have just that; what stands in tables is there at some roughnesses, of
// which it is one of the two around, by chance, so that on the whole it lies on the line between them.
fn lobe_of_place(base: Lobe, v: Vertex) -> Lobe {
    let texture = textures[base.rows];
    let alpha = texture_number(texture, texels_around(texture, v.uv), 0u);
    let first = textures[base.rows + 2u];
    var lobe = base;
    if (first == NONE) {
        lobe.alpha = vec2<f32>(alpha);
        return lobe;
    }
    let place = sqrt(alpha) * f32(ROUGHNESS_STEPS) - f32(textures[base.rows + 1u]);
    let node = min(u32(max(place + v.chance, 0.0)), textures[base.rows + 3u] - 1u);
    lobe = lobes[first + node];
    lobe.kind = base.kind;
    lobe.weight = base.weight;
    return lobe;
}
