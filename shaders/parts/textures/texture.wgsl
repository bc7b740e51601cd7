// Textures: what a surface is at its texture coordinates (`device::parts::textures`).

// Five words for each texture: its first number in `texels`, width, height, channels, and where in this list the spectra of
// its channels are, NONE for colours and numbers. Then those ids, and the textured shares of lobes.
@group(0) @binding(50) var<storage, read> textures: array<u32>;
#if TEXEL_NUMBERS
@group(0) @binding(51) var<storage, read> texels: array<f32>;
#endif

#constants TEXTURE_WORDS

// Numbers and weights of the texels around a point, which sum to 1.
struct Around {
    texel: vec4<u32>,
    weight: vec4<f32>,
}

#if PLACED
#constants PLACEMENTS

fn placed_number(texture: u32, word: u32) -> vec2<f32> {
    let at = FIRST_PLACEMENT + PLACEMENT_WORDS * texture + word;
    return vec2<f32>(bitcast<f32>(textures[at]), bitcast<f32>(textures[at + 1u]));
}
#endif

// Bilinear, repeated, v up.
#if PLACED
fn texels_around(texture: u32, uv_of_surface: vec2<f32>) -> Around {
    let uv = uv_of_surface * placed_number(texture, 0u) + placed_number(texture, 2u);
#else
fn texels_around(texture: u32, uv: vec2<f32>) -> Around {
#endif
    let size = vec2<u32>(textures[TEXTURE_WORDS * texture + 1u], textures[TEXTURE_WORDS * texture + 2u]);
    // From the top left, 0 at the centre of the first texel.
    let place = fract(vec2<f32>(uv.x, 1.0 - uv.y)) * vec2<f32>(size) - 0.5;
    let before = floor(place);
#if PLACED
    // All of the weight is the nearest texel's.
    let nearest = textures[FIRST_PLACEMENT + PLACEMENT_WORDS * texture + 4u] != 0u;
    let share = select(place - before, floor(place - before + 0.5), nearest);
#else
    let share = place - before;
#endif
    let low = (vec2<u32>(vec2<i32>(before) + vec2<i32>(size))) % size;
    let high = (low + 1u) % size;
    return Around(
        vec4<u32>(low.y, low.y, high.y, high.y) * size.x + vec4<u32>(low.x, high.x, low.x, high.x),
        vec4<f32>(1.0 - share.y, 1.0 - share.y, share.y, share.y) * vec4<f32>(1.0 - share.x, share.x, 1.0 - share.x, share.x),
    );
}

#if TEXEL_NUMBERS
fn texture_number(texture: u32, around: Around, channel: u32) -> f32 {
    let first = textures[TEXTURE_WORDS * texture] + channel;
    let stride = textures[TEXTURE_WORDS * texture + 3u];
    let at = first + stride * around.texel;
    return dot(around.weight, vec4<f32>(texels[at.x], texels[at.y], texels[at.z], texels[at.w]));
}
#endif

#if TEXTURED
// Appends what adds `weight` times a textured reflectance, with `mode`.
fn append_reflectance(list: ptr<function, RecordList>, texture: u32, uv: vec2<f32>, weight: f32, mode: u32) {
    let around = texels_around(texture, uv);
    let spectra_at = textures[TEXTURE_WORDS * texture + 4u];
#if COLOURS
    if (spectra_at == NONE) {
        for (var n = 0u; n < 4u; n += 1u) {
            if (around.weight[n] > 0.0) {
                let coefficients = textures[TEXTURE_WORDS * texture] + 3u * around.texel[n];
                append(list, OP_SMOOTH | mode, coefficients, weight * around.weight[n], 0.0);
            }
        }
        return;
    }
#endif
#if MIXTURES
    for (var channel = 0u; channel < textures[TEXTURE_WORDS * texture + 3u]; channel += 1u) {
        let share = texture_number(texture, around, channel);
        if (share > 0.0) {
            append(list, OP_SPECTRUM | mode, textures[spectra_at + channel], weight * share, 0.0);
        }
    }
#endif
}
#endif

#if PRODUCTS
// What blend textures leave of something: the product of their numbers, or of what these lack to 1. `factors`: where they
// stand, and how many.
fn product_of_shares(factors: u32, uv: vec2<f32>) -> f32 {
    var share = 1.0;
    for (var n = factors >> 8u; n < (factors >> 8u) + (factors & 0xffu); n += 1u) {
        let texture = textures[n] & 0x7fffffffu;
        let number = texture_number(texture, texels_around(texture, uv), 0u);
        share *= select(number, 1.0 - number, textures[n] != texture);
    }
    return share;
}
#endif

#if SHARES
fn lobe_share(p: u32, uv: vec2<f32>) -> f32 {
    return product_of_shares(textures[FIRST_SHARE + p], uv);
}
#endif
